//! Which values are equal to which.

use super::pairs::{is_one_lost, key, keys, Filter, PairTable};
use super::values::{is_atom, values, AtPoints, POINTS};
use super::zeros::zeros;
use super::{Becomes, GraphChange, NewPair, Operand, PairForm, EQUAL};
use crate::expr::op::OpKind;
use crate::expr::{Binary, Graph, NodeId, Op, Unary};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use straightline_core::Dd;

/// Operands of a pair, and what a value is formed of, lie at most so many values apart in the program: what belongs together stands
/// together, and the time stays linear. Inputs, constants, sines and cosines are always there.
pub(super) const WINDOW: usize = 80;

/// How much greater than the terms of what it replaces a term may be.
const GREATER: f64 = 4.0;

/// How v is taken apart: v − x, v + x and v / x are what is looked for.
const WAYS: [PairForm; 3] = [PairForm::Difference, PairForm::Sum, PairForm::Product];

/// Which values are equal to which.
pub(super) struct EqualitySearch<'g> {
    pub(super) graph: &'g Graph,
    pub(super) values: Vec<AtPoints>,
    /// Which of them are zero whatever the inputs.
    pub(super) zero: Vec<bool>,
    pub(super) uses: Vec<u32>,
    /// What may be an operand, in the order of the graph.
    pub(super) numbers: Vec<usize>,
    /// Whether it is there at no cost: inputs, constants, sines and cosines.
    pub(super) free: Vec<bool>,
    /// What is free of `numbers`.
    free_numbers: Vec<usize>,
    /// Per value, the quotients, roots and signs that it depends on; so many words each.
    pub(super) quotients: Vec<u64>,
    pub(super) words: usize,
    pub(super) known: Filter,
    pub(super) singles: FxHashMap<u64, Vec<u32>>,
}

/// Which values need v: found as far as somebody asks, as most who ask stand near v.
struct Later<'g> {
    graph: &'g Graph,
    v: usize,
    /// Of v and what stands behind it, up to where it is known.
    known: Vec<bool>,
}

impl<'g> Later<'g> {
    fn new(graph: &'g Graph) -> Self {
        Later { graph, v: 0, known: Vec::new() }
    }

    fn begin(&mut self, v: usize) {
        self.v = v;
        self.known.clear();
        self.known.push(true);
    }

    fn needs(&mut self, x: usize) -> bool {
        let Some(behind) = x.checked_sub(self.v) else { return false };
        while self.known.len() <= behind {
            let operands = self.graph.ops[self.v + self.known.len()].operands();
            let needs = operands.filter_map(|a| a.index().checked_sub(self.v)).any(|a| self.known[a]);
            self.known.push(needs);
        }
        self.known[behind]
    }
}

impl<'g> EqualitySearch<'g> {
    pub(super) fn new(graph: &'g Graph) -> Self {
        let n = graph.ops.len();
        let live = graph.live();
        let mut uses = vec![0u32; n];
        for id in graph.ids().filter(|id| live[id.index()]) {
            graph.op(id).operands().for_each(|a| uses[a.index()] += 1);
        }
        graph.results.iter().for_each(|r| uses[r.index()] += 1);
        let values = values(graph);
        let zero = zeros(graph, &values);
        // what is zero everywhere is part of anything, in as many ways as there are other values
        let is_number = |i: &usize| match graph.ops[*i] {
            Op::Unary(Unary::Neg, _) | Op::SinCos(_) | Op::AngleSum(..) => false,
            _ => live[*i] && !zero[*i],
        };
        let numbers: Vec<usize> = (0..n).filter(is_number).collect();
        let is_free = |op: &Op| matches!(op, Op::Input(_) | Op::Constant(_) | Op::Sin(_) | Op::Cos(_));
        let free: Vec<bool> = graph.ops.iter().map(is_free).collect();
        let free_numbers = numbers.iter().copied().filter(|i| free[*i]).collect();
        let may_be_no_number = |i: &usize| graph.ops[*i].row().is_some_and(|row| row.kind != OpKind::Polynomial);
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
        let mut singles: FxHashMap<u64, Vec<u32>> = FxHashMap::default();
        for i in &numbers {
            singles.entry(key(values[*i][0].hi())).or_default().push(*i as u32);
        }
        let mut known = Filter::new(64 * singles.len());
        singles.keys().for_each(|key| known.insert(*key));
        EqualitySearch { graph, values, zero, uses, numbers, free, free_numbers, quotients, words, known, singles }
    }

    /// What v − x, v + x or v / x is at the first point, to be found.
    fn rest(&self, v: usize, x: usize, way: PairForm) -> f64 {
        let [v, x] = [v, x].map(|i| self.values[i][0].hi());
        match way {
            PairForm::Difference => v - x,
            PairForm::Sum => v + x,
            PairForm::Product => v / x,
        }
    }

    /// What v may be formed of, in the order of the graph.
    fn near(&self, later: &mut Later<'g>) -> Vec<usize> {
        let v = later.v;
        let place = |list: &[usize], end: usize| list.partition_point(|x| *x < end);
        let (from, to) = (v.saturating_sub(WINDOW), v + WINDOW + 1);
        let window = &self.numbers[place(&self.numbers, from)..place(&self.numbers, to)];
        let (before, behind) = (
            &self.free_numbers[..place(&self.free_numbers, from)],
            &self.free_numbers[place(&self.free_numbers, to)..],
        );
        let near = before.iter().chain(window).chain(behind).copied();
        near.filter(|x| self.may_form(*x, later)).collect()
    }

    /// Whether a value can be part of v: it does not need v itself, nor a quotient that may be infinite where v is not.
    fn may_form(&self, x: usize, later: &mut Later<'g>) -> bool {
        let v = later.v;
        !later.needs(x)
            && (0..self.words).all(|w| self.quotients[x * self.words + w] & !self.quotients[v * self.words + w] == 0)
    }

    /// The pairs that some value is formed of, and maybe others.
    fn pairs(&self, candidates: &[usize]) -> PairTable {
        let mut later = Later::new(self.graph);
        let mut wanted = Filter::new(6 * WINDOW * candidates.len());
        for &v in candidates {
            later.begin(v);
            for x in self.near(&mut later) {
                for way in WAYS {
                    keys(self.rest(v, x, way)).for_each(|key| wanted.insert(key));
                }
            }
        }
        PairTable::new(self.graph, &self.numbers, &self.free, &self.values, &wanted)
    }

    /// All moves that save an operation, the best first; of those, the first.
    pub(super) fn moves(&self) -> Vec<GraphChange> {
        let mut moves = Vec::new();
        let mut by_pair: BTreeMap<NewPair, BTreeMap<usize, (usize, Becomes)>> = BTreeMap::new();
        let mut later = Later::new(self.graph);
        let sums: Vec<usize> = self.numbers.iter().copied().filter(|v| self.is_formed(*v)).collect();
        let candidates: Vec<usize> = sums.iter().copied().filter(|v| self.freed(*v, &[]) > 1).collect();
        let pairs = self.pairs(&candidates);
        for &v in &sums {
            let target = &self.values[v];
            let mut add =
                |gain: usize, becomes: Becomes| moves.push(GraphChange { gain, pair: None, becomes: vec![becomes] });
            let equal = self.found(target[0].hi()).filter(|u| *u != v);
            let equal: Vec<(usize, bool)> =
                equal.filter_map(|u| sign(target, &self.values[u], target).map(|negative| (u, negative))).collect();
            if equal.is_empty() && candidates.binary_search(&v).is_err() {
                continue;
            }
            later.begin(v);
            for (u, negative) in equal.into_iter().filter(|(u, _)| self.may_form(*u, &mut later)) {
                add(self.freed(v, &[u]), Becomes { value: v, x: u, y: None, negative });
            }
            if candidates.binary_search(&v).is_err() {
                continue;
            }
            for x in self.near(&mut later) {
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
                    if way != PairForm::Product && is_one_lost(target, own) {
                        continue;
                    }
                    let rest = self.rest(v, x, way);
                    for y in self.found(rest).filter(|y| self.may_form(*y, &mut later)) {
                        let Some((form, negative)) = self.form(v, way, own, &self.values[y]) else { continue };
                        let gain = self.freed(v, &[x, y]) - 1;
                        if gain > 0 {
                            add(gain, Becomes { value: v, x, y: Some((form, Operand::Node(y))), negative });
                        }
                    }
                    for pair @ (y, z, _) in pairs.find(rest) {
                        if !(self.may_form(y, &mut later) && self.may_form(z, &mut later)) {
                            continue;
                        }
                        let Some((form, negative)) = self.form_of_pair(v, way, own, pair) else { continue };
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
                moves.push(GraphChange { gain: gain - 1, pair: Some(pair), becomes });
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
    fn form(&self, v: usize, way: PairForm, x: &AtPoints, y: &AtPoints) -> Option<(PairForm, bool)> {
        let target = &self.values[v];
        let negative = |form: PairForm, scale: &AtPoints| sign(target, &form.of(x, y), scale);
        let scale = greater(target, x);
        let form = match way {
            PairForm::Product => (PairForm::Product, negative(PairForm::Product, target)?),
            // v = x + y or x − y
            PairForm::Difference => match negative(PairForm::Sum, &scale) {
                Some(false) => (PairForm::Sum, false),
                _ => {
                    (negative(PairForm::Difference, &scale) == Some(false)).then_some((PairForm::Difference, false))?
                }
            },
            // v = y − x or −y − x
            PairForm::Sum => match negative(PairForm::Difference, &scale) {
                Some(true) => (PairForm::Difference, true),
                _ => (negative(PairForm::Sum, &scale) == Some(true)).then_some((PairForm::Sum, true))?,
            },
        };
        self.keeps(v, form.0, x, y).then_some(form)
    }

    /// The same where y is a pair that is not there yet.
    fn form_of_pair(&self, v: usize, way: PairForm, x: &AtPoints, (y, z, f): NewPair) -> Option<(PairForm, bool)> {
        let (a, b, target) = (&self.values[y], &self.values[z], &self.values[v]);
        let made = f.of(a, b);
        let form = self.form(v, way, x, &made)?;
        // its own terms may not be greater than what it makes or v is
        let greatest = |k: usize| made[k].abs().hi().max(target[k].abs().hi());
        let cancels = |k: usize| a[k].abs().hi().max(b[k].abs().hi()) > GREATER * greatest(k);
        (f == PairForm::Product || !(0..POINTS).any(cancels)).then_some(form)
    }

    /// Whether a sum has no greater terms than the operation that it replaces.
    pub(super) fn keeps(&self, v: usize, form: PairForm, x: &AtPoints, y: &AtPoints) -> bool {
        let size = |i: usize, k: usize| self.values[i][k].abs().hi();
        let most = |k: usize| match self.graph.ops[v] {
            Op::Binary(Binary::Add | Binary::Sub, a, b) => size(v, k).max(size(a.index(), k)).max(size(b.index(), k)),
            _ => size(v, k),
        };
        form == PairForm::Product || (0..POINTS).all(|k| x[k].abs().hi().max(y[k].abs().hi()) <= GREATER * most(k))
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

/// v = c x, x + c or −(x − c), for a constant.
pub(super) fn constant(v: &AtPoints, x: &AtPoints) -> Option<(PairForm, Dd, bool)> {
    let [a, b] = [0, 1].map(|k| (v[k].hi(), x[k].hi()));
    let about = |x: f64, y: f64| (x - y).abs() <= 1e-9 * x.abs();
    if about(a.0 / a.1, b.0 / b.1) {
        let c = v[0] / x[0];
        let made: AtPoints = x.map(|x| x * c);
        return sign(v, &made, v).map(|negative| (PairForm::Product, c, negative));
    }
    if about(a.0 - a.1, b.0 - b.1) {
        let c = v[0] - x[0];
        let made: AtPoints = x.map(|x| x + c);
        return (sign(v, &made, &greater(v, x)) == Some(false)).then_some((PairForm::Sum, c, false));
    }
    if about(a.0 + a.1, b.0 + b.1) {
        let c = v[0] + x[0];
        let made: AtPoints = x.map(|x| x - c);
        return (sign(v, &made, &greater(v, x)) == Some(true)).then_some((PairForm::Difference, c, true));
    }
    None
}

pub(super) fn greater(a: &AtPoints, b: &AtPoints) -> AtPoints {
    std::array::from_fn(|k| if a[k].abs().hi() > b[k].abs().hi() { a[k] } else { b[k] })
}

/// Whether a = −b; none if they differ in more than the sign.
pub(super) fn sign(a: &AtPoints, b: &AtPoints, scale: &AtPoints) -> Option<bool> {
    let equal = |turned: bool| {
        (0..POINTS).all(|k| {
            let difference = if turned { a[k] + b[k] } else { a[k] - b[k] };
            difference.abs().hi() <= EQUAL * scale[k].abs().hi()
        })
    };
    [false, true].into_iter().find(|turned| equal(*turned))
}
