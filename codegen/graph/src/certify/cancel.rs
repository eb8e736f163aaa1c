//! Sums in which products cancel, written without what cancels.
//!
//! A row and a column of U = \[ε×\] + \[ω×\]\[ω×\] make such sums: U₃₁ = 2 ω_x ω_z − U₁₃, and U₁₃ holds ω_x ω_z once more. Intervals of the
//! terms know nothing of that, and the loss grows threefold with every link. With ω_z = ω′ + q̇ and what the turned vectors are
//! turned from, most of it goes: U₃₁ = 2 q̇ ω_x − (c U₂₁′ + s U₂₃′).
//!
//! A value is expanded over the real numbers, so that what is found here holds for exact values; a computed one is off by its
//! accumulated error at most, which [`analysis`](super::analysis) adds.

use super::forms::{simplified, Atom, Coefficient, FormTerm, LinearForm};
use crate::expr::{Binary, Graph, NodeId, Op, Unary};
use std::collections::BTreeMap;

/// Factors by node, sorted.
type Monomial = Vec<u32>;
/// Whole multiples of monomials; none is zero.
type MonomialSum = BTreeMap<Monomial, i64>;

/// Longer sums stay in parts.
const LONGEST: usize = 24;
/// Longer products stay in parts.
const FACTORS: usize = 8;
/// A form repeats a term for each multiple: not more often than this.
const MULTIPLE: u64 = 4;

/// For each node, a form of its exact value in which products have cancelled, where there is one.
pub fn cancelled(graph: &Graph, live: &[bool]) -> Vec<Option<LinearForm>> {
    let mut sums = Sums { graph, of: Vec::with_capacity(graph.ops.len()), nodes: BTreeMap::new() };
    let mut forms = Vec::with_capacity(graph.ops.len());
    for id in graph.ids() {
        let sum = sums.expand(id);
        let is_sum = live[id.index()] && matches!(graph.op(id), Op::Binary(Binary::Add | Binary::Sub, ..));
        forms.push(if is_sum { sums.without_cancelling(&sum) } else { None });
        let (canonical, negative) = canonical(&sum);
        sums.nodes.entry(canonical).or_insert((id.0, negative));
        sums.of.push(sum);
    }
    forms
}

fn canonical(sum: &MonomialSum) -> (Vec<(Monomial, i64)>, bool) {
    let negative = sum.values().next().is_some_and(|k| *k < 0);
    (sum.iter().map(|(m, k)| (m.clone(), if negative { -k } else { *k })).collect(), negative)
}

fn add(to: &mut MonomialSum, monomial: Monomial, multiple: i64) {
    let sum = to.get(&monomial).copied().unwrap_or(0) + multiple;
    if sum == 0 {
        to.remove(&monomial);
    } else {
        to.insert(monomial, sum);
    }
}

fn product(a: &[u32], b: &[u32]) -> Monomial {
    let mut factors = [a, b].concat();
    factors.sort_unstable();
    factors
}

struct Sums<'g> {
    graph: &'g Graph,
    /// Of each node the sum of products that it is.
    of: Vec<MonomialSum>,
    /// Nodes by their sums, and whether the node is minus that.
    nodes: BTreeMap<Vec<(Monomial, i64)>, (u32, bool)>,
}

impl Sums<'_> {
    fn expand(&self, id: NodeId) -> MonomialSum {
        let alone = || MonomialSum::from([(vec![id.0], 1)]);
        let joined = |a: NodeId, b: NodeId, sign: i64| {
            let mut sum = self.of[a.index()].clone();
            self.of[b.index()].iter().for_each(|(m, k)| add(&mut sum, m.clone(), sign * k));
            if sum.len() > LONGEST {
                alone()
            } else {
                sum
            }
        };
        match self.graph.op(id) {
            Op::Unary(Unary::Neg, a) => self.of[a.index()].iter().map(|(m, k)| (m.clone(), -k)).collect(),
            Op::Binary(Binary::Add, a, b) => joined(a, b, 1),
            Op::Binary(Binary::Sub, a, b) => joined(a, b, -1),
            Op::Binary(Binary::Mul, a, b) => {
                // products of products are one; sums are factors
                let factors = |x: NodeId| match self.of[x.index()].first_key_value() {
                    Some((m, k)) if self.of[x.index()].len() == 1 => (*k, m.clone()),
                    _ => {
                        let (k, x) = self.bare(x);
                        (k, vec![x])
                    }
                };
                let ((k, a), (l, b)) = (factors(a), factors(b));
                if a.len() + b.len() > FACTORS {
                    alone()
                } else {
                    MonomialSum::from([(product(&a, &b), k * l)])
                }
            }
            _ => alone(),
        }
    }

    /// A sum without its sign and without a doubling.
    fn bare(&self, id: NodeId) -> (i64, u32) {
        match self.graph.op(id) {
            Op::Unary(Unary::Neg, a) => {
                let (k, node) = self.bare(a);
                (-k, node)
            }
            Op::Binary(Binary::Add, a, b) if a == b => {
                let (k, node) = self.bare(a);
                (2 * k, node)
            }
            _ => (1, id.0),
        }
    }

    /// The two operands of a sum, as products where they are such.
    fn halves(&self, id: u32) -> MonomialSum {
        let mut sum = MonomialSum::new();
        let mut push = |a: NodeId, sign: i64| {
            if self.is_sum(a.0) {
                let (k, a) = self.bare(a);
                add(&mut sum, vec![a], sign * k);
            } else {
                self.of[a.index()].iter().for_each(|(m, k)| add(&mut sum, m.clone(), sign * k));
            }
        };
        match self.graph.ops[id as usize] {
            Op::Binary(Binary::Add, a, b) => {
                push(a, 1);
                push(b, 1);
            }
            Op::Binary(Binary::Sub, a, b) => {
                push(a, 1);
                push(b, -1);
            }
            _ => push(NodeId(id), 1),
        }
        sum
    }

    fn half(&self, node: u32) -> Option<Coefficient> {
        match self.graph.ops[node as usize] {
            Op::Sin(p) => Some(Coefficient::Sin(p.0)),
            Op::Cos(p) => Some(Coefficient::Cos(p.0)),
            _ => None,
        }
    }

    fn without_cancelling(&self, sum: &MonomialSum) -> Option<LinearForm> {
        for (monomial, &multiple) in sum {
            let &[a, b] = &monomial[..] else { continue };
            // of x y, y is taken apart, and x where that cancels
            for (x, y) in [(a, b), (b, a)] {
                if !(self.is_sum(x) && self.is_sum(y)) {
                    continue;
                }
                let form = self.taken_apart(sum, monomial, multiple, x, y);
                if form.is_some() {
                    return form;
                }
            }
        }
        None
    }

    fn is_sum(&self, node: u32) -> bool {
        self.of[node as usize].len() > 1
    }

    fn taken_apart(&self, sum: &MonomialSum, taken: &Monomial, multiple: i64, x: u32, y: u32) -> Option<LinearForm> {
        let mut rest = MonomialSum::new();
        for (m, &k) in sum.iter().filter(|(m, _)| *m != taken) {
            // turned vectors: c z + s w with the sums that z and w are
            match m[..] {
                [a, b] if self.is_sum(a) != self.is_sum(b) => {
                    let (z, other) = if self.is_sum(a) { (a, b) } else { (b, a) };
                    self.of[z as usize].iter().for_each(|(n, l)| add(&mut rest, product(&[other], n), k * l));
                }
                _ => add(&mut rest, m.clone(), k),
            }
        }
        let mut whole: Vec<(i64, Monomial)> = Vec::new();
        let mut cancels = false;
        for (m, l) in &self.halves(y) {
            let parts = self.of[x as usize].iter().map(|(n, k)| (product(n, m), k * l * multiple));
            let parts: Vec<(Monomial, i64)> = parts.collect();
            if parts.iter().any(|(n, k)| rest.get(n).is_some_and(|other| (*other < 0) != (*k < 0))) {
                cancels = true;
                parts.into_iter().for_each(|(n, k)| add(&mut rest, n, k));
            } else {
                whole.push((l * multiple, m.clone()));
            }
        }
        if !cancels {
            return None;
        }
        let mut form = LinearForm::new();
        let mut repeat = |multiple: i64, coefficient: Coefficient, atom: Atom| {
            let term = FormTerm { coefficient, atom, negative: multiple < 0 };
            (0..multiple.unsigned_abs().min(MULTIPLE)).for_each(|_| form.push(term));
            (multiple.unsigned_abs() <= MULTIPLE).then_some(())
        };
        for (k, factor) in whole {
            let (l, Atom::Value(node)) = self.atom(&MonomialSum::from([(factor, 1)]))? else { return None };
            repeat(k * l, Coefficient::Node(node), Atom::Value(x))?;
        }
        // what has a sine or cosine, by that
        let mut turned: BTreeMap<u32, MonomialSum> = BTreeMap::new();
        for (m, k) in rest {
            match m.iter().rev().find(|f| self.half(**f).is_some()) {
                Some(&trig) => {
                    let at = m.iter().rposition(|f| *f == trig).expect("it was found there");
                    let mut others = m.clone();
                    others.remove(at);
                    add(turned.entry(trig).or_default(), others, k);
                }
                None => {
                    let (l, atom) = self.atom(&MonomialSum::from([(m, 1)]))?;
                    repeat(k * l, Coefficient::One, atom)?;
                }
            }
        }
        for (trig, part) in turned {
            let coefficient = self.half(trig).expect("only such are keys");
            for (k, atom) in self.atoms(&part)? {
                repeat(k, coefficient, atom)?;
            }
        }
        Some(simplified(form))
    }

    /// Values of which a sum consists: one, one and a product, or all products.
    fn atoms(&self, sum: &MonomialSum) -> Option<Vec<(i64, Atom)>> {
        if let Some(atom) = self.atom(sum) {
            return Some(vec![atom]);
        }
        let product =
            |m: &Monomial, k: i64| self.atom(&MonomialSum::from([(m.clone(), 1)])).map(|(sign, atom)| (k * sign, atom));
        let all_but = |(m, k): (&Monomial, &i64)| {
            let mut others = sum.clone();
            others.remove(m);
            Some(vec![self.atom(&others)?, product(m, *k)?])
        };
        sum.iter().find_map(all_but).or_else(|| sum.iter().map(|(m, k)| product(m, *k)).collect())
    }

    /// The value, or half of one, that is this sum, and its sign.
    fn atom(&self, sum: &MonomialSum) -> Option<(i64, Atom)> {
        let (mut key, negative) = canonical(sum);
        let sign = |minus: bool| if negative != minus { -1 } else { 1 };
        if let Some((node, minus)) = self.nodes.get(&key) {
            return Some((sign(*minus), Atom::Value(*node)));
        }
        key.iter_mut().for_each(|(_, k)| *k *= 2);
        let (node, minus) = self.nodes.get(&key)?;
        Some((sign(*minus), Atom::Half(*node)))
    }
}
