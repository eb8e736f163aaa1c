//! Values formed anew from what is there anyway: resubstitution, as in logic synthesis (Mishchenko and Brayton 2006), over the reals.
//!
//! Equal over the reals, so only where rules of grade `Algebraic` are allowed. Where v takes more operations of its own than that, it
//! becomes one of
//!
//! * u or −u, a value that was formed in another way;
//! * c x or x + c, c a constant;
//! * x ∘ y, of two values that others use;
//! * x ∘ p, p = y ∘ z, where p is new and may serve several values.
//!
//! Which of these hold is not derived, by whatever rules, but seen: at random inputs, in double-double. All values are rational in
//! the inputs, sines and cosines; roots and signs count as inputs of their own. Two that agree to 1e-28 at four random states are one,
//! as long as no result of the program sees what they differ by: what is below all digits of a value need not be below those of a result.
//! That finds what follows from distributive laws, from s² + c² = 1 and from constants that fit, however many steps it takes, and
//! nothing that holds for unit quaternions alone.
//!
//! No sum may have greater terms than the operations that it replaces: that is where digits would go. Whether the program
//! as a whole keeps them, the caller asks (`rounding.rs`).
//!
//! Before: any graph that [`verify`](crate::expr::verify()) accepts. After: the same results over the reals, fewer operations. Values
//! that stay keep their order, names and sections.

use super::{count_sums, dead_code, sums};
use crate::expr::op::Kind;
use crate::expr::{of_rounded_sum, values_by, Binary, Constant, Counts, Graph, NodeId, Note, Op, Unary};
use crate::random::Random;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use straightline_core::Dd;

/// Random states.
const POINTS: usize = 4;
/// Two values that agree so well are equal; double-double has 1e-31, of the greatest term. Less well agree those of programs whose constants
/// differ by 1e20: a term that is missed there may be all that another state has.
const EQUAL: f64 = 1e-28;
/// So little of it a result may change.
const UNCHANGED: f64 = 1e-27;
/// How much greater than the terms of what it replaces a term may be.
const GREATER: f64 = 4.0;
/// Values of the greatest graph that is searched; it takes some tenths of a second.
const LARGEST: usize = 3000;
/// Values of the greatest graph that is searched once more: that finds little in great ones.
const TWICE: usize = 600;
/// Values that are looked at while moves are tried, in one round: of a program whose values agree by the thousand, the moves that gain
/// little are left; of all others, none.
const WORK: usize = 700_000;
/// Operands of a pair, and what a value is formed of, lie at most so many values apart in the program: what belongs together stands
/// together, and the time stays linear. Inputs, constants, sines and cosines are always there.
const WINDOW: usize = 80;

type Value = [Dd; POINTS];

/// The graph with values formed of others where that takes fewer operations and `keeps` is content with the program, its [`sums`] put
/// together again. Of greater graphs than some thousand values: as it is.
pub fn substitute(graph: &Graph, keeps: &dyn Fn(&Graph) -> bool) -> Graph {
    graph.expect_plain("substitute");
    let mut graph = graph.clone();
    if graph.ops.len() > LARGEST {
        return graph;
    }
    for _ in 0..if graph.ops.len() > TWICE { 1 } else { 2 } {
        let Some(better) = round(&graph, keeps) else { break };
        graph = dead_code(&sums(&better));
    }
    graph
}

/// One round: all moves that are there, the most gainful first, each taken if it still pays.
fn round(graph: &Graph, keeps: &dyn Fn(&Graph) -> bool) -> Option<Graph> {
    let mut net = Net { ops: graph.ops.clone(), notes: graph.notes.clone() };
    let mut best = count_sums(graph);
    let mut taken = None;
    let before = results(graph);
    let mut live = net.live(graph);
    let mut work = 0;
    for found in Search::new(graph).moves() {
        // moves taken before may have left no use of it
        if work > WORK || !found.becomes.iter().any(|b| live[b.value]) {
            continue;
        }
        let tried = net.with(&found);
        let Some(ordered) = tried.ordered(graph) else { continue };
        work += ordered.ops.len();
        let counts = count_sums(&ordered);
        let fewer = price(counts) < price(best) && counts.flops() <= best.flops() && counts.fma <= best.fma;
        if fewer && is_unchanged(&before, &ordered) && keeps(&ordered) {
            (net, best, taken) = (tried, counts, Some(ordered));
            live = net.live(graph);
        }
    }
    taken
}

/// The results at the random states; none where roots and signs stand for inputs, whose order is that of the graph.
fn results(graph: &Graph) -> Option<Vec<Value>> {
    let has_atoms = graph.ops.iter().any(is_atom);
    (!has_atoms).then(|| {
        let values = values(graph);
        graph.results.iter().map(|r| values[r.index()]).collect()
    })
}

/// Whether another program has the same results.
fn is_unchanged(before: &Option<Vec<Value>>, graph: &Graph) -> bool {
    let Some(before) = before else { return true };
    let same = |(a, b): (&Value, &Value)| (0..POINTS).all(|k| (a[k] - b[k]).abs().hi() <= UNCHANGED * a[k].abs().hi());
    results(graph).is_some_and(|after| before.iter().zip(&after).all(same))
}

/// Operations and instructions with fused multiply-add, as either may be what a machine does.
fn price(counts: Counts) -> usize {
    counts.flops() + counts.fma
}

/// How v is taken apart: v − x, v + x and v / x are what is looked for.
const WAYS: [Form; 3] = [Form::Difference, Form::Sum, Form::Product];

/// How two values make one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Form {
    Sum,
    Difference,
    Product,
}

impl Form {
    fn op(self) -> Binary {
        match self {
            Form::Sum => Binary::Add,
            Form::Difference => Binary::Sub,
            Form::Product => Binary::Mul,
        }
    }

    fn of(self, x: &Value, y: &Value) -> Value {
        let op = self.op();
        std::array::from_fn(|k| op.value(x[k], y[k]))
    }
}

/// An operand of what a value becomes.
#[derive(Clone, Copy, Debug)]
enum Operand {
    Node(usize),
    Constant(Dd),
    /// The pair of the move.
    Pair,
}

/// What a value becomes: ± x, or ± (x ∘ y).
#[derive(Clone, Copy, Debug)]
struct Becomes {
    value: usize,
    x: usize,
    y: Option<(Form, Operand)>,
    negative: bool,
}

/// Two values that make one that is not there yet.
type Pair = (usize, usize, Form);

/// A change of the graph.
struct Move {
    gain: usize,
    pair: Option<Pair>,
    becomes: Vec<Becomes>,
}

/// The operations, in any order.
#[derive(Clone)]
struct Net {
    ops: Vec<Op>,
    notes: Vec<Note>,
}

impl Net {
    fn with(&self, found: &Move) -> Net {
        let mut net = self.clone();
        let section = self.notes[found.becomes[0].value].section;
        let push = |net: &mut Net, op: Op| {
            net.ops.push(op);
            net.notes.push(Note { name: None, section });
            NodeId(net.ops.len() as u32 - 1)
        };
        let node = |i: usize| NodeId(i as u32);
        let pair = found.pair.map(|(x, y, form)| push(&mut net, Op::Binary(form.op(), node(x), node(y))));
        for b in &found.becomes {
            let mut becomes = match b.y {
                None => Op::neg(node(b.x)),
                Some((form, y)) => {
                    let y = match y {
                        Operand::Node(y) => node(y),
                        Operand::Constant(c) => push(&mut net, Op::Constant(Constant::new(c))),
                        Operand::Pair => pair.expect("a pair where an operand is one"),
                    };
                    Op::Binary(form.op(), node(b.x), y)
                }
            };
            // −(x ∘ y), and x itself as −(−x): sums dissolves signs
            if b.negative != b.y.is_none() {
                becomes = Op::neg(push(&mut net, becomes));
            }
            net.ops[b.value] = becomes;
        }
        net
    }

    /// Which of the operations the results of the graph need.
    fn live(&self, graph: &Graph) -> Vec<bool> {
        let mut live = vec![false; self.ops.len()];
        let mut stack: Vec<usize> = graph.results.iter().map(|r| r.index()).collect();
        while let Some(i) = stack.pop() {
            if !std::mem::replace(&mut live[i], true) {
                stack.extend(self.ops[i].operands().map(NodeId::index));
            }
        }
        live
    }

    /// As a graph, in the order that it was in where that can be; none if a value would need itself.
    fn ordered(&self, graph: &Graph) -> Option<Graph> {
        const OPEN: NodeId = NodeId(u32::MAX - 1);
        const UNSEEN: NodeId = NodeId(u32::MAX);
        let live = self.live(graph);
        let mut stack = Vec::new();
        let mut ordered = Graph {
            sections: graph.sections.clone(),
            inputs: graph.inputs.clone(),
            outputs: graph.outputs.clone(),
            ..Graph::default()
        };
        let mut placed = vec![UNSEEN; self.ops.len()];
        let mut known: FxHashMap<Op, NodeId> = FxHashMap::default();
        for root in 0..self.ops.len() {
            if !live[root] || placed[root] != UNSEEN {
                continue;
            }
            stack.push(root);
            while let Some(&i) = stack.last() {
                if placed[i] < OPEN {
                    stack.pop();
                    continue;
                }
                let waits = self.ops[i].operands().map(NodeId::index).find(|a| placed[*a] >= OPEN);
                if let Some(a) = waits {
                    if placed[a] == OPEN {
                        return None;
                    }
                    placed[i] = OPEN;
                    stack.push(a);
                    continue;
                }
                stack.pop();
                let mut place = |i: usize, placed: &mut Vec<NodeId>| {
                    let op = self.ops[i].map(|a| placed[a.index()]);
                    placed[i] = *known.entry(op).or_insert_with(|| {
                        ordered.ops.push(op);
                        ordered.notes.push(self.notes[i]);
                        NodeId(ordered.ops.len() as u32 - 1)
                    });
                };
                place(i, &mut placed);
                if let Op::SinCos(_) = self.ops[i] {
                    // the halves stand right behind their pair
                    let pair = NodeId(i as u32);
                    let is_half = |h: &usize| live[*h] && [Op::Sin(pair), Op::Cos(pair)].contains(&self.ops[*h]);
                    for half in (i + 1..(i + 3).min(self.ops.len())).filter(is_half) {
                        place(half, &mut placed);
                    }
                }
            }
        }
        ordered.results = graph.results.iter().map(|r| placed[r.index()]).collect();
        Some(ordered)
    }
}

/// Which values are equal to which.
struct Search<'g> {
    graph: &'g Graph,
    values: Vec<Value>,
    uses: Vec<u32>,
    /// What may be an operand, in the order of the graph.
    numbers: Vec<usize>,
    /// Whether it is there at no cost: inputs, constants, sines and cosines.
    free: Vec<bool>,
    /// Per value, the quotients, roots and signs that it depends on; so many words each.
    quotients: Vec<u64>,
    words: usize,
    known: Filter,
    singles: FxHashMap<u64, Vec<u32>>,
}

impl<'g> Search<'g> {
    fn new(graph: &'g Graph) -> Self {
        let n = graph.ops.len();
        let live = graph.live();
        let mut uses = vec![0u32; n];
        for id in graph.ids().filter(|id| live[id.index()]) {
            graph.op(id).operands().for_each(|a| uses[a.index()] += 1);
        }
        graph.results.iter().for_each(|r| uses[r.index()] += 1);
        let is_number = |i: &usize| match graph.ops[*i] {
            Op::Unary(Unary::Neg, _) | Op::SinCos(_) | Op::AngleSum(..) => false,
            Op::Constant(c) => live[*i] && c.value() != Dd::ZERO,
            _ => live[*i],
        };
        let numbers: Vec<usize> = (0..n).filter(is_number).collect();
        let is_free = |op: &Op| matches!(op, Op::Input(_) | Op::Constant(_) | Op::Sin(_) | Op::Cos(_));
        let free: Vec<bool> = graph.ops.iter().map(is_free).collect();
        let may_be_no_number = |i: &usize| graph.ops[*i].row().is_some_and(|row| row.kind != Kind::Polynomial);
        let atoms: Vec<usize> = (0..n).filter(may_be_no_number).collect();
        let words = atoms.len().div_ceil(64);
        let mut quotients = vec![0; n * words];
        for i in 0..n {
            for a in graph.ops[i].operands() {
                (0..words).for_each(|w| quotients[i * words + w] |= quotients[a.index() * words + w]);
            }
            if let Ok(k) = atoms.binary_search(&i) {
                quotients[i * words + k / 64] |= 1 << (k % 64);
            }
        }
        let values = values(graph);
        let mut singles: FxHashMap<u64, Vec<u32>> = FxHashMap::default();
        for i in &numbers {
            singles.entry(key(values[*i][0].hi())).or_default().push(*i as u32);
        }
        let mut known = Filter::new(64 * singles.len());
        singles.keys().for_each(|key| known.insert(*key));
        Search { graph, values, uses, numbers, free, quotients, words, known, singles }
    }

    /// What v − x, v + x or v / x is at the first point, to be found.
    fn rest(&self, v: usize, x: usize, way: Form) -> f64 {
        let [v, x] = [v, x].map(|i| self.values[i][0].hi());
        match way {
            Form::Difference => v - x,
            Form::Sum => v + x,
            Form::Product => v / x,
        }
    }

    /// Which values need v.
    fn later(&self, v: usize, later: &mut [bool]) {
        later[..v].fill(false);
        later[v] = true;
        for i in v + 1..later.len() {
            later[i] = self.graph.ops[i].operands().any(|a| later[a.index()]);
        }
    }

    /// What v may be formed of.
    fn near<'s>(&'s self, v: usize, later: &'s [bool]) -> impl Iterator<Item = usize> + 's {
        let near = move |x: &usize| (self.free[*x] || x.abs_diff(v) <= WINDOW) && self.may_form(*x, v, later);
        self.numbers.iter().copied().filter(near)
    }

    /// Whether a value can be part of v: it does not need v itself, nor a quotient that may be infinite where v is not.
    fn may_form(&self, x: usize, v: usize, later: &[bool]) -> bool {
        !later[x]
            && (0..self.words).all(|w| self.quotients[x * self.words + w] & !self.quotients[v * self.words + w] == 0)
    }

    /// The pairs that some value is formed of, and maybe others.
    fn pairs(&self, candidates: &[usize]) -> Pairs {
        let mut later = vec![false; self.graph.ops.len()];
        let mut wanted = Filter::new(6 * WINDOW * candidates.len());
        for &v in candidates {
            self.later(v, &mut later);
            for x in self.near(v, &later) {
                for way in WAYS {
                    keys(self.rest(v, x, way)).for_each(|key| wanted.insert(key));
                }
            }
        }
        Pairs::new(self.graph, &self.numbers, &self.free, &self.values, &wanted)
    }

    /// All moves that save an operation, the best first; of those, the first.
    fn moves(&self) -> Vec<Move> {
        let mut moves = Vec::new();
        let mut by_pair: BTreeMap<Pair, BTreeMap<usize, (usize, Becomes)>> = BTreeMap::new();
        let mut later = vec![false; self.graph.ops.len()];
        let sums: Vec<usize> = self.numbers.iter().copied().filter(|v| self.is_formed(*v)).collect();
        let candidates: Vec<usize> = sums.iter().copied().filter(|v| self.freed(*v, &[]) > 1).collect();
        let pairs = self.pairs(&candidates);
        for &v in &sums {
            let target = &self.values[v];
            let mut add = |gain: usize, becomes: Becomes| moves.push(Move { gain, pair: None, becomes: vec![becomes] });
            let equal = self.found(target[0].hi()).filter(|u| *u != v);
            let equal: Vec<(usize, bool)> =
                equal.filter_map(|u| sign(target, &self.values[u], target).map(|negative| (u, negative))).collect();
            if equal.is_empty() && candidates.binary_search(&v).is_err() {
                continue;
            }
            self.later(v, &mut later);
            for (u, negative) in equal.into_iter().filter(|(u, _)| self.may_form(*u, v, &later)) {
                add(self.freed(v, &[u]), Becomes { value: v, x: u, y: None, negative });
            }
            if candidates.binary_search(&v).is_err() {
                continue;
            }
            for x in self.near(v, &later) {
                let own = &self.values[x];
                if !matches!(self.graph.ops[x], Op::Constant(_)) {
                    if let Some((form, c, negative)) = constant(target, own) {
                        let gain = self.freed(v, &[x]) - 1;
                        let becomes = Becomes { value: v, x, y: Some((form, Operand::Constant(c))), negative };
                        if gain > 0 && self.keeps(v, form, own, &[c; POINTS]) {
                            add(gain, becomes);
                        }
                    }
                }
                for way in WAYS {
                    if way != Form::Product && is_one_lost(target, own) {
                        continue;
                    }
                    let rest = self.rest(v, x, way);
                    for y in self.found(rest).filter(|y| self.may_form(*y, v, &later)) {
                        let Some((form, negative)) = self.form(v, way, own, &self.values[y]) else { continue };
                        let gain = self.freed(v, &[x, y]) - 1;
                        if gain > 0 {
                            add(gain, Becomes { value: v, x, y: Some((form, Operand::Node(y))), negative });
                        }
                    }
                    for pair @ (y, z, f) in pairs.find(rest) {
                        if !(self.may_form(y, v, &later) && self.may_form(z, v, &later)) {
                            continue;
                        }
                        let (a, b) = (&self.values[y], &self.values[z]);
                        let made = f.of(a, b);
                        let Some((form, negative)) = self.form(v, way, own, &made) else { continue };
                        // its own terms may not be greater than what it makes or v is
                        let greatest = |k: usize| made[k].abs().hi().max(target[k].abs().hi());
                        let cancels = |k: usize| a[k].abs().hi().max(b[k].abs().hi()) > GREATER * greatest(k);
                        if f != Form::Product && (0..POINTS).any(cancels) {
                            continue;
                        }
                        let gain = self.freed(v, &[x, y, z]) - 1;
                        if gain == 0 {
                            continue;
                        }
                        let becomes = Becomes { value: v, x, y: Some((form, Operand::Pair)), negative };
                        let best = by_pair.entry(pair).or_default().entry(v).or_insert((gain, becomes));
                        if best.0 < gain {
                            *best = (gain, becomes);
                        }
                    }
                }
            }
        }
        for (pair, of) in by_pair {
            let gain: usize = of.values().map(|(gain, _)| gain).sum();
            if gain > 1 {
                let becomes = of.into_values().map(|(_, becomes)| becomes).collect();
                moves.push(Move { gain: gain - 1, pair: Some(pair), becomes });
            }
        }
        moves.retain(|m| m.gain > 0);
        // stable: of equal gains the first
        moves.sort_by_key(|m| std::cmp::Reverse(m.gain));
        moves
    }

    /// Whether a value may be formed in another way.
    fn is_formed(&self, v: usize) -> bool {
        self.graph.ops[v].is_counted() && self.graph.ops[v].is_polynomial()
    }

    /// Values that are about ± this at the first point.
    fn found(&self, x: f64) -> impl Iterator<Item = usize> + '_ {
        keys(x).filter(|k| self.known.may_have(*k)).filter_map(|k| self.singles.get(&k)).flatten().map(|i| *i as usize)
    }

    /// How v is formed of x and y, if `y` is what the way to it asks for: the form, and whether all signs are turned.
    fn form(&self, v: usize, way: Form, x: &Value, y: &Value) -> Option<(Form, bool)> {
        let target = &self.values[v];
        let negative = |form: Form, scale: &Value| sign(target, &form.of(x, y), scale);
        let scale = greater(target, x);
        let form = match way {
            Form::Product => (Form::Product, negative(Form::Product, target)?),
            // v = x + y or x − y
            Form::Difference => match negative(Form::Sum, &scale) {
                Some(false) => (Form::Sum, false),
                _ => (negative(Form::Difference, &scale) == Some(false)).then_some((Form::Difference, false))?,
            },
            // v = y − x or −y − x
            Form::Sum => match negative(Form::Difference, &scale) {
                Some(true) => (Form::Difference, true),
                _ => (negative(Form::Sum, &scale) == Some(true)).then_some((Form::Sum, true))?,
            },
        };
        self.keeps(v, form.0, x, y).then_some(form)
    }

    /// Whether a sum has no greater terms than the operation that it replaces.
    fn keeps(&self, v: usize, form: Form, x: &Value, y: &Value) -> bool {
        let size = |i: usize, k: usize| self.values[i][k].abs().hi();
        let most = |k: usize| match self.graph.ops[v] {
            Op::Binary(Binary::Add | Binary::Sub, a, b) => size(v, k).max(size(a.index(), k)).max(size(b.index(), k)),
            _ => size(v, k),
        };
        form == Form::Product || (0..POINTS).all(|k| x[k].abs().hi().max(y[k].abs().hi()) <= GREATER * most(k))
    }

    /// So many operations are needed no more if v is formed of these.
    fn freed(&self, v: usize, of: &[usize]) -> usize {
        let mut less: Vec<(usize, u32)> = Vec::new();
        let mut freed = 0;
        let mut stack = vec![v];
        while let Some(i) = stack.pop() {
            freed += usize::from(self.graph.ops[i].is_counted() && !is_atom(&self.graph.ops[i]));
            for a in self.graph.ops[i].operands().map(NodeId::index) {
                let times = match less.iter_mut().find(|l| l.0 == a) {
                    Some(l) => {
                        l.1 += 1;
                        l.1
                    }
                    None => {
                        less.push((a, 1));
                        1
                    }
                };
                if times == self.uses[a] && !of.contains(&a) {
                    stack.push(a);
                }
            }
        }
        freed
    }
}

/// A set of keys that may hold more than was put in: most of what is looked for is not there, and this fits into a cache.
struct Filter(Vec<u64>);

impl Filter {
    fn new(keys: usize) -> Filter {
        Filter(vec![0; (keys / 8).max(8).next_power_of_two()])
    }

    fn place(&self, key: u64) -> (usize, u64) {
        let hash = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 20) as usize;
        ((hash / 64) & (self.0.len() - 1), 1 << (hash % 64))
    }

    fn insert(&mut self, key: u64) {
        let (word, bit) = self.place(key);
        self.0[word] |= bit;
    }

    fn may_have(&self, key: u64) -> bool {
        let (word, bit) = self.place(key);
        self.0[word] & bit != 0
    }
}

/// Values of pairs, found by what they are at the first point.
struct Pairs {
    known: Filter,
    entries: FxHashMap<u64, Vec<Pair>>,
}

impl Pairs {
    /// Those that are wanted.
    fn new(graph: &Graph, numbers: &[usize], free: &[bool], values: &[Value], wanted: &Filter) -> Pairs {
        let is_constant = |i: usize| matches!(graph.ops[i], Op::Constant(_));
        let mut entries: FxHashMap<u64, Vec<Pair>> = FxHashMap::default();
        for (k, &i) in numbers.iter().enumerate() {
            for &j in &numbers[k..] {
                if !(free[i] || free[j] || j - i <= WINDOW) || (is_constant(i) && is_constant(j)) {
                    continue;
                }
                let (x, y) = (values[i][0].hi(), values[j][0].hi());
                let is_one_lost = is_one_lost(&values[i], &values[j]);
                for (form, z) in [(Form::Product, x * y), (Form::Sum, x + y), (Form::Difference, x - y)] {
                    if form != Form::Product && is_one_lost {
                        break;
                    }
                    if wanted.may_have(key(z)) && (i != j || form != Form::Difference) {
                        entries.entry(key(z)).or_default().push((i, j, form));
                    }
                }
            }
        }
        let mut known = Filter::new(8 * entries.len());
        entries.keys().for_each(|key| known.insert(*key));
        Pairs { known, entries }
    }

    fn find(&self, x: f64) -> impl Iterator<Item = Pair> + '_ {
        keys(x).filter(|k| self.known.may_have(*k)).filter_map(|k| self.entries.get(&k)).flatten().copied()
    }
}

/// Whether one of two is too small for the key of their sum: that is the other's.
fn is_one_lost(x: &Value, y: &Value) -> bool {
    let [x, y] = [x, y].map(|v| v[0].hi().abs());
    x.min(y) < 1e-9 * x.max(y)
}

/// Numbers that agree to some 1e-9 have the same key, whatever their sign, or neighbouring ones.
fn key(x: f64) -> u64 {
    x.abs().to_bits() >> 22
}

/// The keys that a number may have that is about this one.
fn keys(x: f64) -> impl Iterator<Item = u64> {
    let bits = x.abs().to_bits();
    let (low, high) = (bits.saturating_sub(1 << 14) >> 22, (bits + (1 << 14)) >> 22);
    [Some(low), (high != low).then_some(high)].into_iter().flatten()
}

/// Whether a = −b; none if they differ in more than the sign.
fn sign(a: &Value, b: &Value, scale: &Value) -> Option<bool> {
    let equal = |turned: bool| {
        (0..POINTS).all(|k| {
            let difference = if turned { a[k] + b[k] } else { a[k] - b[k] };
            difference.abs().hi() <= EQUAL * scale[k].abs().hi()
        })
    };
    [false, true].into_iter().find(|turned| equal(*turned))
}

fn greater(a: &Value, b: &Value) -> Value {
    std::array::from_fn(|k| if a[k].abs().hi() > b[k].abs().hi() { a[k] } else { b[k] })
}

/// v = c x, x + c or −(x − c), for a constant.
fn constant(v: &Value, x: &Value) -> Option<(Form, Dd, bool)> {
    let [a, b] = [0, 1].map(|k| (v[k].hi(), x[k].hi()));
    let about = |x: f64, y: f64| (x - y).abs() <= 1e-9 * x.abs();
    if about(a.0 / a.1, b.0 / b.1) {
        let c = v[0] / x[0];
        let made: Value = x.map(|x| x * c);
        return sign(v, &made, v).map(|negative| (Form::Product, c, negative));
    }
    if about(a.0 - a.1, b.0 - b.1) {
        let c = v[0] - x[0];
        let made: Value = x.map(|x| x + c);
        return (sign(v, &made, &greater(v, x)) == Some(false)).then_some((Form::Sum, c, false));
    }
    if about(a.0 + a.1, b.0 + b.1) {
        let c = v[0] + x[0];
        let made: Value = x.map(|x| x - c);
        return (sign(v, &made, &greater(v, x)) == Some(true)).then_some((Form::Difference, c, true));
    }
    None
}

/// Whether a value counts as an input of its own: it is not rational in its operands.
fn is_atom(op: &Op) -> bool {
    op.row().is_some_and(|row| row.kind == Kind::Other)
}

/// All values at random inputs; roots and signs are random themselves.
fn values(graph: &Graph) -> Vec<Value> {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let mut any = || -> Value {
        std::array::from_fn(|_| {
            let size = 0.3 + 2.0 * random.unit();
            Dd::new(if random.below(2) == 0 { size } else { -size }, 0.0)
        })
    };
    let inputs: usize = graph.inputs.iter().map(|p| p.len()).sum();
    let inputs: Vec<Value> = (0..inputs).map(|_| any()).collect();
    let atoms: Vec<Option<Value>> = graph.ops.iter().map(|op| is_atom(op).then(&mut any)).collect();
    let points: [Vec<Dd>; POINTS] = std::array::from_fn(|k| {
        let inputs: Vec<Dd> = inputs.iter().map(|x| x[k]).collect();
        values_by(graph, &inputs, |id, _| atoms[id.index()].map(|x| x[k]), of_rounded_sum)
    });
    (0..graph.ops.len()).map(|i| std::array::from_fn(|k| points[k][i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{Builder, Port, RuleSet};

    /// The program of some results of four inputs, before and after.
    fn programs(results: impl Fn(&mut Builder, [NodeId; 4]) -> Vec<NodeId>) -> [Graph; 2] {
        let mut builder = Builder::new(RuleSet::all(), vec![Port::new("x", &[4])]);
        let x = [0, 1, 2, 3].map(|k| builder.insert(Op::Input(k)));
        let results = results(&mut builder, x);
        let before = builder.finish(vec![Port::new("z", &[results.len()])], results);
        let after = substitute(&before, &|_| true);
        crate::expr::verify(&after).expect("a pass keeps what graphs promise");
        let x = [0.7, -1.3, 2.9, 0.4].map(Dd::from);
        let [a, b] = [&before, &after].map(|graph| crate::expr::evaluate(graph, &x));
        assert!(a.iter().zip(&b).all(|(a, b)| (*a - *b).abs().hi() < 1e-28 * a.abs().hi()), "{a:?} {b:?}");
        [before, after]
    }

    fn flops(programs: &[Graph; 2]) -> [usize; 2] {
        programs.each_ref().map(|graph| graph.counts().flops())
    }

    /// (x + y)² − x² − y² = x y + x y, with x y at hand.
    #[test]
    fn what_is_there_already_is_not_computed_in_another_way() {
        let programs = programs(|b, [x, y, z, _]| {
            let [xx, yy] = [x, y].map(|v| b.add(Op::mul(v, v)));
            let sum = b.add(Op::add(x, y));
            let square = b.add(Op::mul(sum, sum));
            let rest = b.add(Op::sub(square, xx));
            let twice = b.add(Op::sub(rest, yy));
            let product = b.add(Op::mul(x, y));
            let last = b.add(Op::mul(product, z));
            vec![twice, product, last, xx, yy]
        });
        assert_eq!(flops(&programs), [8, 5]);
    }

    /// s (s x) + c (c x) = x, a rule that is in no table.
    #[test]
    fn squares_of_sine_and_cosine_add_to_one() {
        let programs = programs(|b, [q, x, ..]| {
            let pair = b.add(Op::SinCos(q));
            let halves = [Op::Sin(pair), Op::Cos(pair)].map(|half| b.add(half));
            let turned = halves.map(|half| b.add(Op::mul(half, x)));
            let back = [0, 1].map(|k| b.add(Op::mul(halves[k], turned[k])));
            let sum = b.add(Op::add(back[0], back[1]));
            vec![turned[0], turned[1], sum]
        });
        assert_eq!(flops(&programs), [5, 2]);
    }

    /// x z w and y z w share z w.
    #[test]
    fn a_new_value_may_serve_two() {
        let programs = programs(|b, [x, y, z, w]| {
            let of = [x, y].map(|v| {
                let product = b.add(Op::mul(v, z));
                b.add(Op::mul(product, w))
            });
            of.to_vec()
        });
        assert_eq!(flops(&programs), [4, 3]);
    }

    /// y z w = (y / x) (x z w) takes an operation less, and is no number where x is zero.
    #[test]
    fn no_value_gets_a_quotient_that_it_did_not_need() {
        let [_, after] = programs(|b, [x, y, z, w]| {
            let quotient = b.add(Op::div(y, x));
            let of = [x, y].map(|v| {
                let product = b.add(Op::mul(v, z));
                b.add(Op::mul(product, w))
            });
            vec![quotient, of[0], of[1]]
        });
        let quotient =
            after.ids().find(|id| matches!(after.op(*id), Op::Binary(Binary::Div, ..))).expect("it is a result");
        assert_eq!(after.uses()[quotient.index()], 1);
    }

    /// x y as the difference of two numbers of its size, and of two that are a thousand times as great.
    #[test]
    fn no_value_becomes_the_difference_of_greater_ones() {
        let [graph, _] = programs(|b, [x, y, ..]| vec![b.add(Op::mul(x, y))]);
        let search = Search::new(&graph);
        let product = graph.results[0].index();
        let times = |k: f64| search.values[product].map(|v| v * Dd::from(k));
        assert!(search.keeps(product, Form::Difference, &times(2.0), &times(1.0)));
        assert!(!search.keeps(product, Form::Difference, &times(1001.0), &times(1000.0)));
        assert!(search.keeps(product, Form::Product, &times(1000.0), &times(0.001)));
    }
}
