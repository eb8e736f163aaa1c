//! Fewer and better fused additions: sums with all their terms at once.
//!
//! Equal over the reals, so only where rules of grade `Algebraic` are allowed. Four steps, in rounds until none helps:
//!
//! * flatten: (a + b) + c = a + b + c where a + b has no other user; x − x goes;
//! * factor: a b + a c = a (b + c) where neither product has another user: a multiplication less, and no fused
//!   instruction more; a b + a b = a (b + b), where the product fuses;
//! * share: the pair ±x ± y that stands in most sums is added once, for all of them;
//! * order: products without another user come last, so that each of them is one instruction with its addition.
//!
//! Before: any graph that [`verify`](crate::expr::verify()) accepts. After: the same results over the reals, no operation
//! more. Names and sections go with the values that survive.

use crate::expr::{Builder, Constant, Graph, NodeId, Note, Op, RuleSet};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use straightline_core::Dd;

/// More rounds have not been seen to help; this only bounds the time.
const ROUNDS: usize = 6;

/// The graph with its sums taken apart and put together again.
pub fn sums(graph: &Graph) -> Graph {
    let mut table = Table::read(graph);
    for _ in 0..ROUNDS {
        let before = table.clone();
        table.flatten();
        table.double();
        table.factor();
        table.flatten();
        table.share();
        if table.values == before.values {
            break;
        }
    }
    table.write(graph)
}

/// A value with a sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Term {
    value: usize,
    negative: bool,
}

impl Term {
    fn signed(self, negative: bool) -> Term {
        Term { value: self.value, negative: self.negative != negative }
    }
}

/// Signs stand outside: of products, of constants, and of sums, whose first term is positive when they are made.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Constant(Constant),
    Product(usize, usize),
    Sum(Vec<Term>),
    /// The same as that one.
    Same(Term),
    /// Anything else: the operation, and its operands with their signs.
    Other(Op, Vec<Term>),
}

/// A graph as sums of many terms.
#[derive(Clone)]
struct Table {
    values: Vec<Value>,
    results: Vec<Term>,
    /// Where a value came from: the node whose name and place it has.
    origin: Vec<Option<NodeId>>,
    /// For look-ups only.
    products: FxHashMap<(usize, usize), usize>,
    constants: FxHashMap<Constant, usize>,
}

impl Table {
    fn read(graph: &Graph) -> Table {
        let mut table = Table {
            values: Vec::new(),
            results: Vec::new(),
            origin: Vec::new(),
            products: FxHashMap::default(),
            constants: FxHashMap::default(),
        };
        let live = graph.live();
        let mut term_of = vec![Term { value: usize::MAX, negative: false }; graph.ops.len()];
        for id in graph.ids().filter(|id| live[id.index()]) {
            let t = |a: NodeId| term_of[a.index()];
            let term = match graph.op(id) {
                Op::Neg(a) => t(a).signed(true),
                Op::Constant(c) => table.constant(c.value()),
                Op::Mul(a, b) => table.product(t(a), t(b), Some(id)),
                Op::Add(a, b) => table.push(Value::Sum(vec![t(a), t(b)]), Some(id)),
                Op::Sub(a, b) => table.push(Value::Sum(vec![t(a), t(b).signed(true)]), Some(id)),
                op => table.push(Value::Other(op, op.operands().map(t).collect()), Some(id)),
            };
            term_of[id.index()] = term;
        }
        table.results = graph.results.iter().map(|r| term_of[r.index()]).collect();
        table
    }

    fn push(&mut self, value: Value, origin: Option<NodeId>) -> Term {
        self.values.push(value);
        self.origin.push(origin);
        Term { value: self.values.len() - 1, negative: false }
    }

    fn constant(&mut self, c: Dd) -> Term {
        let negative = c.hi() < 0.0;
        let key = Constant::new(if negative { -c } else { c });
        let value = match self.constants.get(&key) {
            Some(v) => *v,
            None => self.push(Value::Constant(key), None).value,
        };
        self.constants.insert(key, value);
        Term { value, negative }
    }

    fn product(&mut self, a: Term, b: Term, origin: Option<NodeId>) -> Term {
        let (a, b) = (self.resolved(a), self.resolved(b));
        let key = (a.value.min(b.value), a.value.max(b.value));
        let value = match self.products.get(&key) {
            Some(v) => *v,
            None => self.push(Value::Product(key.0, key.1), origin).value,
        };
        self.products.insert(key, value);
        Term { value, negative: a.negative != b.negative }
    }

    fn resolved(&self, mut term: Term) -> Term {
        while let Value::Same(t) = self.values[term.value] {
            term = t.signed(term.negative);
        }
        term
    }

    fn operands(&self, value: usize) -> Vec<Term> {
        let plain = |value: usize| Term { value, negative: false };
        let operands = match &self.values[value] {
            Value::Constant(_) => vec![],
            Value::Product(a, b) => vec![plain(*a), plain(*b)],
            Value::Sum(terms) => terms.clone(),
            Value::Same(t) => vec![*t],
            Value::Other(_, operands) => operands.clone(),
        };
        operands.into_iter().map(|t| self.resolved(t)).collect()
    }

    /// How often each value is used by what the results need, and those values, operands before users.
    fn uses(&self) -> (Vec<u32>, Vec<usize>) {
        let mut uses = vec![0; self.values.len()];
        let mut order = Vec::new();
        // (value, whether its operands are done)
        let mut stack: Vec<(usize, bool)> = Vec::new();
        for r in &self.results {
            let r = self.resolved(*r).value;
            uses[r] += 1;
            if uses[r] == 1 {
                stack.push((r, false));
            }
            while let Some((value, done)) = stack.pop() {
                if done {
                    order.push(value);
                    continue;
                }
                stack.push((value, true));
                for t in self.operands(value) {
                    uses[t.value] += 1;
                    if uses[t.value] == 1 {
                        stack.push((t.value, false));
                    }
                }
            }
        }
        (uses, self.sorted(order))
    }

    /// Operands before users: a value first met by one user may be wanted by an earlier one.
    fn sorted(&self, values: Vec<usize>) -> Vec<usize> {
        let mut done = vec![false; self.values.len()];
        let mut order = Vec::with_capacity(values.len());
        for value in values {
            let mut stack = vec![(value, false)];
            while let Some((v, ready)) = stack.pop() {
                if done[v] {
                    continue;
                }
                if ready {
                    done[v] = true;
                    order.push(v);
                } else {
                    stack.push((v, true));
                    stack.extend(self.operands(v).into_iter().filter(|t| !done[t.value]).map(|t| (t.value, false)));
                }
            }
        }
        order
    }

    /// Sums without another user dissolve in the sum that uses them; constants of a sum become one, opposites go.
    fn flatten(&mut self) {
        let (uses, order) = self.uses();
        for v in order {
            let Value::Sum(terms) = &self.values[v] else { continue };
            let mut flat: Vec<Term> = Vec::new();
            for t in terms.iter().map(|t| self.resolved(*t)) {
                match &self.values[t.value] {
                    // already flat itself: it stands before its user
                    Value::Sum(inner) if uses[t.value] == 1 => {
                        flat.extend(inner.iter().map(|u| self.resolved(*u).signed(t.negative)));
                    }
                    _ => flat.push(t),
                }
            }
            self.set_sum(v, flat);
        }
        self.unite();
    }

    /// Makes `v` the sum of these terms.
    fn set_sum(&mut self, v: usize, terms: Vec<Term>) {
        let mut constant = Dd::ZERO;
        let mut kept: Vec<Term> = Vec::new();
        for t in terms {
            if let Value::Constant(c) = self.values[t.value] {
                constant = if t.negative { constant - c.value() } else { constant + c.value() };
            } else if let Some(opposite) = kept.iter().position(|u| *u == t.signed(true)) {
                kept.remove(opposite);
            } else {
                kept.push(t);
            }
        }
        if constant != Dd::ZERO || kept.is_empty() {
            let c = self.constant(constant);
            kept.push(c);
        }
        self.values[v] = if kept.len() == 1 { Value::Same(kept[0]) } else { Value::Sum(kept) };
    }

    /// Equal products and equal sums become one: operands may have become equal.
    fn unite(&mut self) {
        let (_, order) = self.uses();
        self.products.clear();
        let mut sums: FxHashMap<Vec<Term>, Term> = FxHashMap::default();
        for v in order {
            match self.values[v].clone() {
                Value::Product(..) => {
                    let operands = self.operands(v);
                    let negative = operands[0].negative != operands[1].negative;
                    let key = {
                        let (a, b) = (operands[0].value, operands[1].value);
                        (a.min(b), a.max(b))
                    };
                    match self.products.get(&key) {
                        Some(&value) => self.values[v] = Value::Same(Term { value, negative }),
                        None if negative => {
                            let value = self.push(Value::Product(key.0, key.1), self.origin[v]).value;
                            self.products.insert(key, value);
                            self.values[v] = Value::Same(Term { value, negative });
                        }
                        None => {
                            self.values[v] = Value::Product(key.0, key.1);
                            self.products.insert(key, v);
                        }
                    }
                }
                Value::Sum(_) => {
                    let operands = self.operands(v);
                    let (key, negative) = canonical(&operands);
                    match sums.get(&key) {
                        Some(t) => self.values[v] = Value::Same(t.signed(negative)),
                        None => {
                            sums.insert(key, Term { value: v, negative });
                            self.values[v] = Value::Sum(operands);
                        }
                    }
                }
                _ => {}
            }
        }
    }

    /// a b + a b = a (b + b), where nothing else uses the product: then it fuses. Twice the factor that more values use,
    /// as it may be wanted doubled elsewhere.
    fn double(&mut self) {
        let (uses, order) = self.uses();
        for v in order {
            let Value::Sum(terms) = &self.values[v] else { continue };
            let mut terms: Vec<Term> = terms.iter().map(|t| self.resolved(*t)).collect();
            let is_twice = |k: &usize| {
                let t = terms[*k];
                let product = matches!(self.values[t.value], Value::Product(..)) && uses.get(t.value) == Some(&2);
                product && terms[*k + 1..].contains(&t)
            };
            let Some(at) = (0..terms.len()).find(is_twice) else { continue };
            let twice = terms[at];
            let operands = self.operands(twice.value);
            let used = |t: &Term| uses.get(t.value).copied().unwrap_or(0);
            let (once, doubled) = match used(&operands[0]) > used(&operands[1]) {
                true => (operands[1], operands[0]),
                false => (operands[0], operands[1]),
            };
            let sum = self.push(Value::Sum(vec![doubled, doubled]), None);
            let product = self.push(Value::Product(once.value, sum.value), None);
            terms.retain(|t| *t != twice);
            terms.push(product.signed(twice.negative != once.negative));
            self.set_sum(v, terms);
        }
        self.unite();
    }

    /// a b ± a c = a (b ± c), the factor of most terms first.
    fn factor(&mut self) {
        loop {
            let (uses, order) = self.uses();
            let mut changed = false;
            for v in order {
                let Value::Sum(terms) = self.values[v].clone() else { continue };
                let terms: Vec<Term> = terms.iter().map(|t| self.resolved(*t)).collect();
                let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
                for (k, t) in terms.iter().enumerate() {
                    if let Value::Product(..) = self.values[t.value] {
                        if uses.get(t.value) == Some(&1) {
                            let operands = self.operands(t.value);
                            members.entry(operands[0].value).or_default().push(k);
                            if operands[1].value != operands[0].value {
                                members.entry(operands[1].value).or_default().push(k);
                            }
                        }
                    }
                }
                // the most terms; of those, the factor that was there first
                let best = members.iter().filter(|(_, m)| m.len() > 1).max_by_key(|(f, m)| (m.len(), usize::MAX - *f));
                let Some((&factor, members)) = best else { continue };
                let members = members.clone();
                let others: Vec<Term> = members
                    .iter()
                    .map(|k| {
                        let operands = self.operands(terms[*k].value);
                        let sign = terms[*k].negative;
                        // operands of a product carry signs only through what they were replaced by
                        let (first, second) = (operands[0], operands[1]);
                        let other = if first.value == factor { second } else { first };
                        let own = if first.value == factor { first } else { second };
                        other.signed(sign != own.negative)
                    })
                    .collect();
                let inner = self.push(Value::Sum(others.clone()), None);
                self.set_sum(inner.value, others);
                let product = self.push(Value::Product(factor, inner.value), None);
                let mut rest: Vec<Term> =
                    terms.iter().enumerate().filter(|(k, _)| !members.contains(k)).map(|(_, t)| *t).collect();
                rest.push(product);
                self.set_sum(v, rest);
                changed = true;
            }
            self.unite();
            if !changed {
                return;
            }
        }
    }

    /// The pair of terms, up to a common sign, that stands in most sums is added once.
    fn share(&mut self) {
        let (_, order) = self.uses();
        let mut pairs = Pairs::default();
        for v in order.into_iter().filter(|v| matches!(self.values[*v], Value::Sum(_))) {
            pairs.insert(v, &self.operands(v));
        }
        while let Some((best, sums)) = pairs.most_frequent() {
            let (a, b, opposite) = best;
            let (a, b) = (Term { value: a, negative: false }, Term { value: b, negative: opposite });
            let exact = sums.iter().copied().find(|v| self.operands(*v).len() == 2);
            let shared = match exact {
                Some(v) => Term { value: v, negative: !self.operands(v).contains(&a) },
                None => self.push(Value::Sum(vec![a, b]), None),
            };
            for v in sums.into_iter().filter(|v| *v != shared.value) {
                let mut terms = self.operands(v);
                pairs.remove(v, &terms);
                for negative in [false, true] {
                    let (a, b) = (a.signed(negative), b.signed(negative));
                    let at_a = terms.iter().position(|t| *t == a);
                    let at_b = terms.iter().enumerate().position(|(k, t)| *t == b && Some(k) != at_a);
                    if let (Some(i), Some(j)) = (at_a, at_b) {
                        terms.remove(i.max(j));
                        terms.remove(i.min(j));
                        terms.insert(i.min(j), shared.signed(negative));
                        break;
                    }
                }
                if terms.len() == 1 {
                    // the very pair once more
                    self.values[v] = Value::Same(terms[0]);
                } else {
                    pairs.insert(v, &terms);
                    self.values[v] = Value::Sum(terms);
                }
            }
            if exact.is_none() {
                pairs.insert(shared.value, &[a, b]);
            }
        }
    }

    fn write(&self, graph: &Graph) -> Graph {
        let (uses, order) = self.uses();
        // in the order of the original; what has a single user goes to it
        let mut roots: Vec<(NodeId, usize)> = order
            .iter()
            .filter(|v| uses[**v] > 1 || !matches!(self.values[**v], Value::Product(..) | Value::Sum(_)))
            .filter_map(|v| self.origin[*v].map(|id| (id, *v)))
            .collect();
        let results = graph.results.iter().zip(&self.results).map(|(id, t)| (*id, self.resolved(*t).value));
        roots.extend(results);
        roots.sort_unstable();
        let mut writer = Writer {
            table: self,
            graph,
            uses,
            builder: Builder::new(RuleSet::all(), graph.inputs.clone()),
            written: vec![None; self.values.len()],
        };
        for (id, value) in roots {
            writer.builder.section(graph.sections[graph.notes[id.index()].section as usize]);
            writer.value(value);
        }
        let results: Vec<NodeId> = self.results.iter().map(|t| writer.signed(*t)).collect();
        writer.builder.finish(graph.outputs.clone(), results)
    }
}

/// Two values, and whether their signs differ.
type Pair = (usize, usize, bool);

/// In which sums each pair of terms stands.
#[derive(Default)]
struct Pairs {
    sums: BTreeMap<Pair, BTreeSet<usize>>,
    /// How often each pair stands: the most frequent last; of those, the one that was there first.
    ranks: BTreeSet<(usize, Reverse<Pair>)>,
}

impl Pairs {
    fn insert(&mut self, sum: usize, terms: &[Term]) {
        for p in pairs_of(terms) {
            let sums = self.sums.entry(p).or_default();
            self.ranks.remove(&(sums.len(), Reverse(p)));
            sums.insert(sum);
            self.ranks.insert((sums.len(), Reverse(p)));
        }
    }

    fn remove(&mut self, sum: usize, terms: &[Term]) {
        for p in pairs_of(terms) {
            let sums = self.sums.get_mut(&p).expect("a pair that was inserted");
            self.ranks.remove(&(sums.len(), Reverse(p)));
            sums.remove(&sum);
            self.ranks.insert((sums.len(), Reverse(p)));
        }
    }

    fn most_frequent(&self) -> Option<(Pair, Vec<usize>)> {
        let (times, Reverse(pair)) = self.ranks.last()?;
        (*times > 1).then(|| (*pair, self.sums[pair].iter().copied().collect()))
    }
}

/// The pairs among some terms, each once.
fn pairs_of(terms: &[Term]) -> Vec<Pair> {
    let mut pairs = Vec::with_capacity(terms.len() * terms.len() / 2);
    for (i, a) in terms.iter().enumerate() {
        pairs.extend(terms[i + 1..].iter().map(|b| pair(*a, *b)));
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// The unordered pair up to a common sign: whether the signs differ.
fn pair(a: Term, b: Term) -> Pair {
    (a.value.min(b.value), a.value.max(b.value), a.negative != b.negative)
}

/// Sorted, the first positive; and whether all signs were turned for that.
fn canonical(terms: &[Term]) -> (Vec<Term>, bool) {
    let mut sorted = terms.to_vec();
    sorted.sort_unstable();
    let negative = sorted[0].negative;
    (sorted.into_iter().map(|t| t.signed(negative)).collect(), negative)
}

/// Back to a graph.
struct Writer<'a> {
    table: &'a Table,
    graph: &'a Graph,
    uses: Vec<u32>,
    builder: Builder,
    /// The node of a value, and whether it is the value's negative.
    written: Vec<Option<(NodeId, bool)>>,
}

impl Writer<'_> {
    /// The node of a value, and whether it is the value's negative.
    fn value(&mut self, value: usize) -> (NodeId, bool) {
        if let Some(done) = self.written[value] {
            return done;
        }
        let written = match &self.table.values[value] {
            Value::Constant(c) => (self.builder.insert(Op::Constant(*c)), false),
            Value::Product(..) => {
                let operands = self.table.operands(value);
                let ((a, s), (b, t)) = (self.term(operands[0]), self.term(operands[1]));
                (self.builder.insert(Op::Mul(a.min(b), a.max(b))), s != t)
            }
            Value::Sum(_) => self.sum(&self.table.operands(value)),
            Value::Same(_) => unreachable!("terms are resolved"),
            Value::Other(op, operands) => {
                let operands: Vec<NodeId> = operands.iter().map(|t| self.signed(*t)).collect();
                let mut given = operands.into_iter();
                let op = op.map(|_| given.next().expect("as many operands as before"));
                let node = self.builder.insert(op);
                if let Op::SinCos(_) = op {
                    // the halves stand right behind the pair
                    self.builder.insert(Op::Sin(node));
                    self.builder.insert(Op::Cos(node));
                }
                (node, false)
            }
        };
        self.written[value] = Some(written);
        if let Some(Note { name: Some(name), .. }) = self.table.origin[value].map(|id| self.graph.notes[id.index()]) {
            if !written.1 {
                self.builder.name(written.0, name);
            }
        }
        written
    }

    fn term(&mut self, term: Term) -> (NodeId, bool) {
        let term = self.table.resolved(term);
        let (node, negative) = self.value(term.value);
        (node, negative != term.negative)
    }

    /// The node of a term, negated if need be.
    fn signed(&mut self, term: Term) -> NodeId {
        match self.term(term) {
            (node, false) => node,
            (node, true) => self.builder.insert(Op::Neg(node)),
        }
    }

    /// Terms that are not fused first, then the products that are.
    fn sum(&mut self, terms: &[Term]) -> (NodeId, bool) {
        let fuses = |t: &Term| matches!(self.table.values[t.value], Value::Product(..)) && self.uses[t.value] == 1;
        let (products, rest): (Vec<Term>, Vec<Term>) = terms.iter().partition(|t| fuses(t));
        let rest: Vec<(NodeId, bool)> = rest.into_iter().map(|t| self.term(t)).collect();
        let mut left = rest;
        // a product is written where it is added
        let mut waiting = products.into_iter();
        if left.len() < 2 {
            left.extend(waiting.next().map(|t| self.term(t)));
        }
        if left.len() < 2 {
            left.extend(waiting.next().map(|t| self.term(t)));
        }
        // lead with a positive term, or turn all signs
        let lead = left.iter().position(|t| !t.1);
        let turned = lead.is_none();
        let (mut sum, _) = left.remove(lead.unwrap_or(0));
        let mut add = |builder: &mut Builder, (node, negative): (NodeId, bool)| {
            sum = builder.insert(match negative != turned {
                true => Op::Sub(sum, node),
                false => Op::Add(sum, node),
            });
        };
        for t in left {
            add(&mut self.builder, t);
        }
        for t in waiting {
            let t = self.term(t);
            add(&mut self.builder, t);
        }
        (sum, turned)
    }
}
