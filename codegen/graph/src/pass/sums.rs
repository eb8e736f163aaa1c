//! Fewer and better fused additions: sums with all their terms at once.
//!
//! Equal over the reals, so only where rules of grade `Algebraic` are allowed. Four steps, in rounds until none helps:
//!
//! * flatten: (a + b) + c = a + b + c where a + b has no other user; x − x goes;
//!   c x + x = (c + 1) x, where nothing else uses the product: what cancels does so among constants, without rounding;
//! * factor: a b + a c = a (b + c) where neither product has another user: a multiplication less, and no fused
//!   instruction more; a b + a b = a (b + b), where the product fuses;
//! * share: the pair ±x ± y that stands in most sums is added once, for all of them;
//! * order: products without another user come last, so that each of them is one instruction with its addition.
//!
//! Before: any graph that [`verify`](crate::expr::verify()) accepts. After: the same results over the reals, no operation
//! more. Names and sections go with the values that survive.

use crate::expr::{Binary, Builder, Constant, Counts, Graph, NodeId, Note, Op, RuleSet, Unary, TAIL};
use rustc_hash::{FxHashMap, FxHasher};
use std::cmp::Reverse;
use std::collections::hash_map::Entry;
use std::collections::BTreeSet;
use std::hash::{Hash, Hasher};
use std::rc::Rc;
use straightline_core::Dd;

/// More rounds have not been seen to help; this only bounds the time.
const ROUNDS: usize = 6;

/// The graph with its sums taken apart and put together again.
pub fn sums(graph: &Graph) -> Graph {
    graph.expect_plain("sums");
    let mut table = Table::read(graph);
    table.simplify();
    table.write(graph)
}

/// What [`sums`] would take: the same counts, without writing the graph. Only what it can change is counted: products and
/// sums, and pairs of sine and cosine.
pub fn count_sums(graph: &Graph) -> Counts {
    let mut table = Table::read(graph);
    table.simplify();
    table.counts()
}

/// A value with a sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Term(u32);

impl Term {
    fn new(value: usize, negative: bool) -> Term {
        Term((value as u32) << 1 | u32::from(negative))
    }

    fn value(self) -> usize {
        (self.0 >> 1) as usize
    }

    fn is_negative(self) -> bool {
        self.0 & 1 == 1
    }

    fn signed(self, negative: bool) -> Term {
        Term(self.0 ^ u32::from(negative))
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
    Other(Op, [Option<Term>; 2]),
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
    /// What was counted since the last change.
    uses: Option<Rc<Uses>>,
    /// Whether anything is not as it was.
    changed: bool,
}

/// How often each value is used, and the values that are, operands before users.
type Uses = (Vec<u32>, Vec<usize>);

impl Table {
    fn read(graph: &Graph) -> Table {
        let mut table = Table {
            values: Vec::with_capacity(graph.ops.len()),
            results: Vec::new(),
            origin: Vec::with_capacity(graph.ops.len()),
            products: FxHashMap::default(),
            constants: FxHashMap::default(),
            uses: None,
            changed: false,
        };
        let live = graph.live();
        let mut term_of = vec![Term(u32::MAX); graph.ops.len()];
        for id in graph.ids().filter(|id| live[id.index()]) {
            let t = |a: NodeId| term_of[a.index()];
            let term = match graph.op(id) {
                Op::Unary(Unary::Neg, a) => t(a).signed(true),
                Op::Constant(c) => table.constant(c.value()),
                Op::Binary(Binary::Mul, a, b) => table.product(t(a), t(b), Some(id)),
                Op::Binary(Binary::Add, a, b) => table.push(Value::Sum(vec![t(a), t(b)]), Some(id)),
                Op::Binary(Binary::Sub, a, b) => table.push(Value::Sum(vec![t(a), t(b).signed(true)]), Some(id)),
                op => {
                    let mut operands = [None; 2];
                    op.operands().zip(&mut operands).for_each(|(a, place)| *place = Some(t(a)));
                    table.push(Value::Other(op, operands), Some(id))
                }
            };
            term_of[id.index()] = term;
        }
        table.results = graph.results.iter().map(|r| term_of[r.index()]).collect();
        table
    }

    /// The steps, in rounds until none helps.
    fn simplify(&mut self) {
        for round in 0..ROUNDS {
            self.changed = false;
            self.flatten();
            self.double();
            if self.factor() {
                self.flatten();
            }
            // what is as it was has been shared
            if round > 0 && !self.changed {
                break;
            }
            self.share();
        }
    }

    fn push(&mut self, value: Value, origin: Option<NodeId>) -> Term {
        self.uses = None;
        self.values.push(value);
        self.origin.push(origin);
        Term::new(self.values.len() - 1, false)
    }

    fn constant(&mut self, c: Dd) -> Term {
        let negative = c.hi() < 0.0;
        let key = Constant::new(if negative { -c } else { c });
        if let Some(value) = self.constants.get(&key) {
            return Term::new(*value, negative);
        }
        let value = self.push(Value::Constant(key), None).value();
        self.constants.insert(key, value);
        Term::new(value, negative)
    }

    fn product(&mut self, a: Term, b: Term, origin: Option<NodeId>) -> Term {
        let (a, b) = (self.resolved(a), self.resolved(b));
        let key = (a.value().min(b.value()), a.value().max(b.value()));
        let negative = a.is_negative() != b.is_negative();
        if let Some(value) = self.products.get(&key) {
            return Term::new(*value, negative);
        }
        let value = self.push(Value::Product(key.0, key.1), origin).value();
        self.products.insert(key, value);
        Term::new(value, negative)
    }

    fn resolved(&self, mut term: Term) -> Term {
        while let Value::Same(t) = self.values[term.value()] {
            term = t.signed(term.is_negative());
        }
        term
    }

    /// Operand `k` of a value.
    fn operand(&self, value: usize, k: usize) -> Option<Term> {
        let term = match &self.values[value] {
            Value::Constant(_) => None,
            Value::Product(a, b) => [*a, *b].get(k).map(|v| Term::new(*v, false)),
            Value::Sum(terms) => terms.get(k).copied(),
            Value::Same(t) => (k == 0).then_some(*t),
            Value::Other(_, operands) => operands.get(k).copied().flatten(),
        };
        term.map(|t| self.resolved(t))
    }

    /// Both factors of a product.
    fn factors(&self, product: usize) -> [Term; 2] {
        [0, 1].map(|k| self.operand(product, k).expect("a product has two factors"))
    }

    /// The terms of a sum.
    fn terms(&self, sum: usize) -> Vec<Term> {
        (0..).map_while(|k| self.operand(sum, k)).collect()
    }

    fn is_product(&self, t: Term) -> bool {
        matches!(self.values[t.value()], Value::Product(..))
    }

    /// How often each value is used by what the results need, and those values, operands before users.
    fn uses(&mut self) -> Rc<Uses> {
        let found = self.uses.take().unwrap_or_else(|| Rc::new(self.counted_uses()));
        self.uses = Some(Rc::clone(&found));
        found
    }

    fn counted_uses(&self) -> Uses {
        let mut uses = vec![0; self.values.len()];
        let mut order = Vec::with_capacity(self.values.len());
        // a value, and which of its operands is next
        let mut stack: Vec<(usize, usize)> = Vec::new();
        for r in &self.results {
            let root = self.resolved(*r).value();
            uses[root] += 1;
            if uses[root] == 1 {
                stack.push((root, 0));
            }
            'values: while let Some((value, first)) = stack.pop() {
                let two: [Term; 2];
                let operands: &[Term] = match &self.values[value] {
                    Value::Sum(terms) => terms,
                    Value::Product(a, b) => {
                        two = [a, b].map(|v| Term::new(*v, false));
                        &two
                    }
                    Value::Other(_, operands) => {
                        two = operands.map(|t| t.unwrap_or(Term(0)));
                        &two[..operands.iter().flatten().count()]
                    }
                    Value::Same(t) => std::slice::from_ref(t),
                    Value::Constant(_) => &[],
                };
                for (k, t) in operands.iter().enumerate().skip(first) {
                    let operand = self.resolved(*t).value();
                    uses[operand] += 1;
                    if uses[operand] > 1 {
                        continue;
                    }
                    if matches!(self.values[operand], Value::Constant(_) | Value::Other(_, [None, None])) {
                        order.push(operand);
                        continue;
                    }
                    stack.extend([(value, k + 1), (operand, 0)]);
                    continue 'values;
                }
                order.push(value);
            }
        }
        (uses, order)
    }

    /// Sums without another user dissolve in the sum that uses them; constants of a sum become one, multiples of a value one, opposites go.
    fn flatten(&mut self) {
        let found = self.uses();
        let (uses, order) = &*found;
        let mut flat: Vec<Term> = Vec::new();
        for v in order.iter().copied() {
            let Value::Sum(terms) = &self.values[v] else { continue };
            flat.clear();
            for t in terms.iter().map(|t| self.resolved(*t)) {
                match &self.values[t.value()] {
                    // already flat itself: it stands before its user
                    Value::Sum(inner) if uses[t.value()] == 1 => {
                        flat.extend(inner.iter().map(|u| self.resolved(*u).signed(t.is_negative())));
                    }
                    _ => flat.push(t),
                }
            }
            self.gather(&mut flat, uses);
            self.set_sum(v, &flat);
        }
        self.unite();
    }

    /// Makes `v` the sum of these terms.
    fn set_sum(&mut self, v: usize, terms: &[Term]) {
        let mut constant = Dd::ZERO;
        let mut kept: Vec<Term> = Vec::with_capacity(terms.len());
        for t in terms.iter().copied() {
            if let Value::Constant(c) = self.values[t.value()] {
                constant = if t.is_negative() { constant - c.value() } else { constant + c.value() };
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
        let value = if kept.len() == 1 { Value::Same(kept[0]) } else { Value::Sum(kept) };
        self.set(v, value);
    }

    fn set(&mut self, v: usize, value: Value) {
        if self.values[v] != value {
            self.uses = None;
            self.values[v] = value;
            self.changed = true;
        }
    }

    /// Equal products and equal sums become one: operands may have become equal.
    fn unite(&mut self) {
        let found = self.uses();
        self.products.clear();
        // sums by a hash of their terms; two that share one by chance stay apart
        let mut sums: FxHashMap<u64, (usize, bool)> = FxHashMap::default();
        let mut key: Vec<Term> = Vec::new();
        let mut other: Vec<Term> = Vec::new();
        for v in found.1.iter().copied() {
            match &self.values[v] {
                Value::Product(..) => {
                    let [a, b] = self.factors(v);
                    let negative = a.is_negative() != b.is_negative();
                    let (a, b) = (a.value().min(b.value()), a.value().max(b.value()));
                    let value = match self.products.get(&(a, b)) {
                        Some(&value) => Value::Same(Term::new(value, negative)),
                        None if negative => {
                            let value = self.push(Value::Product(a, b), self.origin[v]);
                            self.products.insert((a, b), value.value());
                            Value::Same(value.signed(true))
                        }
                        None => {
                            self.products.insert((a, b), v);
                            Value::Product(a, b)
                        }
                    };
                    self.set(v, value);
                }
                Value::Sum(_) => {
                    let negative = self.canonical(v, &mut key);
                    let mut hasher = FxHasher::default();
                    key.hash(&mut hasher);
                    let hash = hasher.finish();
                    match sums.get(&hash) {
                        Some(&(u, turned)) => {
                            self.canonical(u, &mut other);
                            if key == other {
                                self.set(v, Value::Same(Term::new(u, turned != negative)));
                            }
                        }
                        None => {
                            sums.insert(hash, (v, negative));
                            let Value::Sum(terms) = &self.values[v] else { unreachable!("seen above") };
                            if terms.iter().any(|t| self.resolved(*t) != *t) {
                                let terms = self.terms(v);
                                self.set(v, Value::Sum(terms));
                            }
                        }
                    }
                }
                _ => {}
            }
        }
    }

    /// The terms of a sum, sorted, the first positive; and whether all signs were turned for that.
    fn canonical(&self, sum: usize, key: &mut Vec<Term>) -> bool {
        key.clear();
        key.extend((0..).map_while(|k| self.operand(sum, k)));
        key.sort_unstable();
        let negative = key[0].is_negative();
        key.iter_mut().for_each(|t| *t = t.signed(negative));
        negative
    }

    /// Of the terms of one sum: c x ± d x ± x = (c ± d ± 1) x, where nothing else uses the products.
    fn gather(&mut self, terms: &mut Vec<Term>, uses: &[u32]) {
        let mut first = 0;
        while let Some(k) = (first..terms.len()).find(|k| self.multiple(terms[*k], uses).1.is_some()) {
            first = k + 1;
            let x = self.multiple(terms[k], uses).0.value();
            let is_met = |t: &Term| self.multiple(*t, uses).0.value() == x;
            if terms.iter().filter(|t| is_met(t)).count() < 2 {
                continue;
            }
            let mut sum = Dd::ZERO;
            for (x, factor) in terms.iter().filter(|t| is_met(t)).map(|t| self.multiple(*t, uses)) {
                let factor = factor.unwrap_or(Dd::ONE);
                sum = if x.is_negative() { sum - factor } else { sum + factor };
            }
            let rest: Vec<Term> = terms.iter().copied().filter(|t| !is_met(t)).collect();
            *terms = rest;
            first = 0;
            let x = Term::new(x, false);
            if sum == Dd::ONE || sum == -Dd::ONE {
                terms.push(x.signed(sum == -Dd::ONE));
            } else if sum != Dd::ZERO {
                let factor = self.constant(sum);
                let product = self.product(factor, x, None);
                terms.push(product);
            }
        }
    }

    /// What a term is a multiple of, and the factor, where it may be taken apart: a product with a constant.
    fn multiple(&self, t: Term, uses: &[u32]) -> (Term, Option<Dd>) {
        if self.is_product(t) && uses.get(t.value()) == Some(&1) {
            let [a, b] = self.factors(t.value());
            for (c, x) in [(a, b), (b, a)] {
                if let Value::Constant(factor) = self.values[c.value()] {
                    let negative = c.is_negative() != x.is_negative();
                    return (Term::new(x.value(), t.is_negative() != negative), Some(factor.value()));
                }
            }
        }
        (t, None)
    }

    /// a b + a b = a (b + b), where nothing else uses the product: then it fuses. Twice the factor that more values use,
    /// as it may be wanted doubled elsewhere.
    fn double(&mut self) {
        let found = self.uses();
        let (uses, order) = &*found;
        let used = |t: Term| uses.get(t.value()).copied().unwrap_or(0);
        let mut doubled = false;
        for v in order.iter().copied() {
            let Value::Sum(terms) = &self.values[v] else { continue };
            let is_twice = |k: &usize| {
                let t = terms[*k];
                used(t) == 2 && self.is_product(t) && terms[*k + 1..].contains(&t)
            };
            let Some(at) = (0..terms.len()).find(is_twice) else { continue };
            let twice = terms[at];
            let mut terms: Vec<Term> = terms.iter().copied().filter(|t| *t != twice).collect();
            let [a, b] = self.factors(twice.value());
            let (once, twofold) = if used(a) > used(b) { (b, a) } else { (a, b) };
            let sum = self.push(Value::Sum(vec![twofold, twofold]), None);
            let product = self.push(Value::Product(once.value(), sum.value()), None);
            terms.push(product.signed(twice.is_negative() != once.is_negative()));
            self.set_sum(v, &terms);
            doubled = true;
        }
        if doubled {
            self.unite();
        }
    }

    /// a b ± a c = a (b ± c), the factor of most terms first. Whether there was any.
    fn factor(&mut self) -> bool {
        // the factors of a sum's products, and at which terms
        let mut members: Vec<(usize, usize)> = Vec::new();
        let mut any = false;
        loop {
            let found = self.uses();
            let (uses, order) = &*found;
            let mut factored = false;
            for v in order.iter().copied() {
                let Value::Sum(terms) = &self.values[v] else { continue };
                members.clear();
                for (k, t) in terms.iter().enumerate() {
                    if uses.get(t.value()) == Some(&1) && self.is_product(*t) {
                        let [a, b] = self.factors(t.value());
                        members.push((a.value(), k));
                        if a.value() != b.value() {
                            members.push((b.value(), k));
                        }
                    }
                }
                members.sort_unstable();
                // the most terms; of those, the factor that was there first
                let groups = members.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1);
                let Some(best) = groups.max_by_key(|group| (group.len(), Reverse(group[0].0))) else { continue };
                let factor = best[0].0;
                let other = |k: usize| {
                    let [a, b] = self.factors(terms[k].value());
                    // operands of a product carry signs only through what they were replaced by
                    let (own, other) = if a.value() == factor { (a, b) } else { (b, a) };
                    other.signed(terms[k].is_negative() != own.is_negative())
                };
                let others: Vec<Term> = best.iter().map(|(_, k)| other(*k)).collect();
                let is_rest = |k: &usize| best.iter().all(|(_, member)| member != k);
                let mut rest: Vec<Term> = (0..terms.len()).filter(is_rest).map(|k| terms[k]).collect();
                let inner = self.push(Value::Sum(Vec::new()), None);
                self.set_sum(inner.value(), &others);
                rest.push(self.push(Value::Product(factor, inner.value()), None));
                self.set_sum(v, &rest);
                factored = true;
            }
            if !factored {
                return any;
            }
            any = true;
            self.unite();
        }
    }

    /// The pair of terms, up to a common sign, that stands in most sums is added once.
    fn share(&mut self) {
        let found = self.uses();
        let mut pairs = Pairs::default();
        for v in found.1.iter().copied() {
            if let Value::Sum(_) = self.values[v] {
                pairs.insert(v, &self.terms(v));
            }
        }
        while let Some((best, sums)) = pairs.most_frequent() {
            let (a, b, opposite) = best;
            let (a, b) = (Term::new(a, false), Term::new(b, opposite));
            let exact = sums.iter().copied().find(|v| self.operand(*v, 2).is_none());
            let shared = match exact {
                Some(v) => Term::new(v, !self.terms(v).contains(&a)),
                None => self.push(Value::Sum(vec![a, b]), None),
            };
            for v in sums.into_iter().filter(|v| *v != shared.value()) {
                let mut terms = self.terms(v);
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
                    self.set(v, Value::Same(terms[0]));
                } else {
                    pairs.insert(v, &terms);
                    self.set(v, Value::Sum(terms));
                }
            }
            if exact.is_none() {
                pairs.insert(shared.value(), &[a, b]);
            }
        }
    }

    /// As [`Graph::counts`] of what [`Table::write`] makes: n products of one user and a rest are n fused instructions.
    fn counts(&mut self) -> Counts {
        let found = self.uses();
        let (uses, order) = &*found;
        let mut counts = Counts::default();
        let mut fused = 0;
        for v in order.iter().copied() {
            match &self.values[v] {
                Value::Product(..) => counts.mul += 1,
                Value::Sum(_) => {
                    let terms = || (0..).map_while(|k| self.operand(v, k));
                    let additions = terms().count() - 1;
                    let products = terms().filter(|t| uses[t.value()] == 1 && self.is_product(*t)).count();
                    counts.add += additions;
                    fused += products.min(additions);
                }
                Value::Other(Op::SinCos(_), [Some(angle), _]) => {
                    counts.sin_cos += 1;
                    let sum = matches!(self.values[self.resolved(*angle).value()], Value::Other(Op::AngleSum(..), _));
                    counts.tail += usize::from(sum);
                }
                Value::Other(Op::AngleSum(..), _) => {
                    counts.add += 1;
                    counts.tail += TAIL;
                }
                Value::Other(op, _) => op.row().into_iter().for_each(|row| counts.count(row.counted)),
                Value::Constant(_) | Value::Same(_) => {}
            }
        }
        counts.fma = counts.mul + counts.add - fused;
        counts
    }

    fn write(&self, graph: &Graph) -> Graph {
        let (uses, order) = self.counted_uses();
        // in the order of the original; what has a single user goes to it
        let mut roots: Vec<(NodeId, usize)> = order
            .iter()
            .filter(|v| uses[**v] > 1 || !matches!(self.values[**v], Value::Product(..) | Value::Sum(_)))
            .filter_map(|v| self.origin[*v].map(|id| (id, *v)))
            .collect();
        let results = graph.results.iter().zip(&self.results).map(|(id, t)| (*id, self.resolved(*t).value()));
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
    /// For look-ups only: most pairs stand in one sum.
    sums: FxHashMap<Pair, (usize, Vec<usize>)>,
    /// How often each pair stands that is there more than once: the most frequent last; of those, the one that was there
    /// first.
    ranks: BTreeSet<(usize, Reverse<Pair>)>,
    scratch: Vec<Pair>,
}

impl Pairs {
    fn insert(&mut self, sum: usize, terms: &[Term]) {
        pairs_of(terms, &mut self.scratch);
        for p in &self.scratch {
            let p = *p;
            match self.sums.entry(p) {
                Entry::Vacant(place) => {
                    place.insert((sum, Vec::new()));
                }
                Entry::Occupied(mut place) => {
                    let more = &mut place.get_mut().1;
                    self.ranks.remove(&(more.len() + 1, Reverse(p)));
                    more.push(sum);
                    self.ranks.insert((more.len() + 1, Reverse(p)));
                }
            }
        }
    }

    fn remove(&mut self, sum: usize, terms: &[Term]) {
        pairs_of(terms, &mut self.scratch);
        for p in &self.scratch {
            let p = *p;
            let Entry::Occupied(mut place) = self.sums.entry(p) else { unreachable!("a pair that was inserted") };
            let (first, more) = place.get_mut();
            if more.is_empty() {
                place.remove();
                continue;
            }
            self.ranks.remove(&(more.len() + 1, Reverse(p)));
            match more.iter().position(|s| *s == sum) {
                Some(at) => {
                    more.swap_remove(at);
                }
                None => *first = more.swap_remove(0),
            }
            if !more.is_empty() {
                self.ranks.insert((more.len() + 1, Reverse(p)));
            }
        }
    }

    fn most_frequent(&self) -> Option<(Pair, Vec<usize>)> {
        let (_, Reverse(pair)) = self.ranks.last()?;
        let (first, more) = &self.sums[pair];
        let mut sums = more.clone();
        sums.push(*first);
        sums.sort_unstable();
        Some((*pair, sums))
    }
}

/// The pairs among some terms, each once.
fn pairs_of(terms: &[Term], pairs: &mut Vec<Pair>) {
    pairs.clear();
    for (i, a) in terms.iter().enumerate() {
        pairs.extend(terms[i + 1..].iter().map(|b| pair(*a, *b)));
    }
    pairs.sort_unstable();
    pairs.dedup();
}

/// The unordered pair up to a common sign: whether the signs differ.
fn pair(a: Term, b: Term) -> Pair {
    (a.value().min(b.value()), a.value().max(b.value()), a.is_negative() != b.is_negative())
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
                let [a, b] = self.table.factors(value);
                let ((a, s), (b, t)) = (self.term(a), self.term(b));
                (self.builder.insert(Op::mul(a.min(b), a.max(b))), s != t)
            }
            Value::Sum(_) => self.sum(&self.table.terms(value)),
            Value::Same(_) => unreachable!("terms are resolved"),
            Value::Other(op, operands) => {
                let operands: Vec<NodeId> = operands.iter().flatten().map(|t| self.signed(*t)).collect();
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
        let (node, negative) = self.value(term.value());
        (node, negative != term.is_negative())
    }

    /// The node of a term, negated if need be.
    fn signed(&mut self, term: Term) -> NodeId {
        let term = self.table.resolved(term);
        if let Value::Constant(c) = &self.table.values[term.value()] {
            let c = c.value();
            return self.builder.constant(if term.is_negative() { -c } else { c });
        }
        match self.term(term) {
            (node, false) => node,
            (node, true) => self.builder.insert(Op::neg(node)),
        }
    }

    /// Terms that are not fused first, then the products that are.
    fn sum(&mut self, terms: &[Term]) -> (NodeId, bool) {
        let fuses = |t: &Term| self.table.is_product(*t) && self.uses[t.value()] == 1;
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
                true => Op::sub(sum, node),
                false => Op::add(sum, node),
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
