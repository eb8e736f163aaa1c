//! Running error bounds: the values of a program once more, each with a bound of its error, as another program.
//!
//! Every value v̂ is computed again and beside it e with |w − v| ≤ e, v the value over the real numbers, and w either v̂ or what the program
//! in question computes in its place: the same bits, or other ones where that program fuses multiplications with additions or is partly
//! in another format ([`Running::of_other_bits`]). u is the unit of that program's rounding at the node, t makes up for underflow.
//!
//! * v = a ± b: e = e_a + e_b + u |v̂| + t. What rounding adds is at most half an ulp, hence at most u |w|.
//! * v = a b: |a' b' − a b| ≤ |a| e_b + |b| e_a + e_a e_b, and |a| ≤ |â| + e_a: e = |â| e_b + (|b̂| + k e_b) e_a + u |v̂| + t, k = 1 for the same
//!   bits, as â b̂ − a b = â (b̂ − b) + b (â − a), and else 3.
//! * v = a / b: a'/b' − a/b = (a' − a − (a/b)(b' − b)) / b', |b| ≥ |b̂| − e_b, |b'| ≥ |b̂| − 2 e_b = l: e = (e_a + (|â| + e_a)/l e_b)/l + u |v̂| + t.
//! * v = √a: |√a' − √a| = |a' − a|/(√a' + √a): e = e_a/√(â − 2 e_a) + u |v̂| + t.
//! * sine and cosine: the kernel's proven error, and the angle's; constants: the distance to their rounding; −v, inputs: nothing of their own.
//!   (An input below the normal numbers must be given as zero where the machine reads it so.) A sign is right if |â| > 2 e_a.
//!
//! Where a divisor may vanish, a root has none, or a sign may be wrong, e is NaN, by the root of a negative number.
//!
//! **The bound is rounded, too.** It consists of sums, products, quotients and roots of numbers ≥ 0, each rounded by a factor of 1 − u at least.
//! Let s = 1 + 2 n u for n operations so far; by induction what is computed is e/s at least, as long as no product has two factors that
//! have lost something. Products of two errors get 2 e_b in place of e_b (and so on) for that, as s ≤ 4/3, and what is multiplied further
//! is [`settled`](Running::settled) by that factor first. Other bits are rounded by u |w| ≤ u (|v̂| + 2 e): a factor of 1 − 2 u more at each
//! operation, so that s = 1 + 6 n u. Products that underflow lose less than the smallest normal number; t is four of them.

use super::FloatFormat;
use crate::expr::{Binary, Folding, Graph, GraphBuilder, NodeId, Op, Port, RuleSet, Unary};
use crate::number::Scalar;
use straightline_core::Dd;

/// A value, and a bound of its error; none if it is exact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tracked {
    pub value: NodeId,
    pub error: Option<NodeId>,
}

/// A proof that is wrong on purpose: tests must notice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(not(test), allow(dead_code))]
pub(super) enum BrokenProof {
    /// The residual counts as exact.
    Residual,
    /// The mass matrix counts as exact.
    MassMatrix,
    /// The Jacobian and what is made of it count as exact.
    Jacobian,
    /// Errors of reactions do not accelerate anything.
    Reactions,
    /// Accelerations that are found count as exact in the equations of their derivatives.
    Accelerations,
    /// A divisor counts as exact.
    Divisor,
}

/// A program that is being written.
pub(super) struct Running {
    b: GraphBuilder,
    /// Of its numbers.
    pub format: FloatFormat,
    /// Of the program whose errors are bounded.
    rounding: FloatFormat,
    other_bits: bool,
    ports: Vec<Port>,
    operations: usize,
    #[cfg(test)]
    pub broken: Option<BrokenProof>,
}

impl Running {
    /// For a program that computes the same bits.
    pub fn new(ports: Vec<Port>, format: FloatFormat) -> Self {
        // no rules: values are to be the same bits
        let b = GraphBuilder::new(RuleSet::exact(Folding::DoubleDouble), ports.clone());
        Running {
            b,
            format,
            rounding: format,
            other_bits: false,
            ports,
            operations: 0,
            #[cfg(test)]
            broken: None,
        }
    }

    /// For a program that rounds in `rounding`, or better, but elsewhere than this one does in `format`, which is no coarser.
    pub fn of_other_bits(ports: Vec<Port>, format: FloatFormat, rounding: FloatFormat) -> Self {
        Running { rounding, other_bits: true, ..Running::new(ports, format) }
    }

    #[cfg(test)]
    pub fn is_broken(&self, what: BrokenProof) -> bool {
        self.broken == Some(what)
    }

    #[cfg(not(test))]
    pub fn is_broken(&self, _what: BrokenProof) -> bool {
        false
    }

    pub fn insert(&mut self, op: Op) -> NodeId {
        self.operations += 1;
        self.b.insert(op)
    }

    /// How many operations were written so far, at most.
    pub fn operations(&self) -> usize {
        self.operations
    }

    pub fn constant(&mut self, x: f64) -> NodeId {
        self.b.constant(Dd::from(x))
    }

    pub fn inputs(&mut self) -> Vec<Tracked> {
        let count: usize = self.ports.iter().map(Port::len).sum();
        (0..count as u32).map(|k| Tracked { value: self.insert(Op::Input(k)), error: None }).collect()
    }

    /// A number that is exact.
    pub fn exact(value: NodeId) -> Tracked {
        Tracked { value, error: None }
    }

    /// Whether it is the constant zero.
    pub fn is_zero(&self, x: Tracked) -> bool {
        x.error.is_none() && self.b.as_constant(x.value).is_some_and(|c| c.is(0.0))
    }

    /// x · sign x.
    pub fn absolute(&mut self, x: NodeId) -> NodeId {
        let sign = self.insert(Op::sign(x));
        self.insert(Op::mul(x, sign))
    }

    pub fn scaled(&mut self, factor: f64, x: NodeId) -> NodeId {
        let factor = self.constant(factor);
        self.insert(Op::mul(factor, x))
    }

    fn plus(&mut self, a: NodeId, b: Option<NodeId>) -> NodeId {
        match b {
            Some(b) => self.insert(Op::add(a, b)),
            None => a,
        }
    }

    fn plus_tiny(&mut self, a: NodeId, count: usize) -> NodeId {
        let tiny = self.constant(4.0 * count as f64 * self.rounding.tiny);
        self.insert(Op::add(a, tiny))
    }

    /// x where it is positive, a little less or more by rounding; else NaN.
    pub fn positive(&mut self, x: NodeId) -> NodeId {
        let root = self.insert(Op::sqrt(x));
        self.insert(Op::mul(root, root))
    }

    /// The greatest of numbers ≥ 0: (x + y + |x − y|)/2.
    pub fn greatest(&mut self, parts: &[NodeId]) -> NodeId {
        let greater = |a: NodeId, b: NodeId| {
            let (sum, difference) = (self.insert(Op::add(a, b)), self.insert(Op::sub(a, b)));
            let difference = self.absolute(difference);
            let twice = self.insert(Op::add(sum, difference));
            self.scaled(0.5, twice)
        };
        let most = parts.iter().copied().reduce(greater).expect("there is a part");
        self.plus_tiny(most, 1)
    }

    /// Of numbers ≥ 0, with what so many products can lose by underflow.
    pub fn total(&mut self, parts: &[NodeId]) -> NodeId {
        let sum = parts.iter().copied().reduce(|a, b| self.insert(Op::add(a, b))).expect("there is a part");
        self.plus_tiny(sum, parts.len())
    }

    /// a b of numbers ≥ 0.
    pub fn times(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let product = self.insert(Op::mul(a, b));
        self.plus_tiny(product, 1)
    }

    /// a / b of numbers ≥ 0.
    pub fn over(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let quotient = self.insert(Op::div(a, b));
        self.plus_tiny(quotient, 1)
    }

    /// Σ a b of numbers ≥ 0, of which one each has lost nothing.
    pub fn dot(&mut self, pairs: &[(NodeId, NodeId)]) -> NodeId {
        let products: Vec<NodeId> = pairs.iter().map(|(a, b)| self.insert(Op::mul(*a, *b))).collect();
        self.total(&products)
    }

    /// |v̂| + e.
    pub fn magnitude(&mut self, x: Tracked) -> NodeId {
        let size = self.absolute(x.value);
        self.plus(size, x.error)
    }

    /// What the roundings of the bounds themselves are worth so far.
    pub fn slack(&self) -> f64 {
        let each = if self.other_bits { 6.0 } else { 2.0 };
        1.0 + each * self.operations as f64 * self.rounding.u.max(self.format.u)
    }

    /// A bound with what its roundings may have lost.
    pub fn settled(&mut self, x: NodeId) -> NodeId {
        let slack = self.slack();
        self.scaled(slack, x)
    }

    pub fn all_settled(&mut self, parts: &[NodeId]) -> Vec<NodeId> {
        let slack = self.slack();
        parts.iter().map(|x| self.scaled(slack, *x)).collect()
    }

    /// A value with its error settled, and another error added.
    pub fn widened(&mut self, x: Tracked, by: Option<NodeId>) -> Tracked {
        let error = x.error.map(|e| self.settled(e));
        Tracked { value: x.value, error: by.map(|by| self.plus(by, error)).or(error) }
    }

    /// u |v̂| + t, and what else there is.
    fn rounded(&mut self, value: NodeId, others: Option<NodeId>, unit: f64) -> Tracked {
        let size = self.absolute(value);
        let own = self.scaled(unit, size);
        let own = self.plus_tiny(own, 1);
        Tracked { value, error: Some(self.plus(own, others)) }
    }

    fn either(&mut self, a: Option<NodeId>, b: Option<NodeId>) -> Option<NodeId> {
        match (a, b) {
            (Some(x), Some(y)) => Some(self.insert(Op::add(x, y))),
            (x, y) => x.or(y),
        }
    }

    fn sum_in(&mut self, op: Binary, a: Tracked, b: Tracked, unit: f64) -> Tracked {
        let value = self.insert(Op::Binary(op, a.value, b.value));
        let others = self.either(a.error, b.error);
        self.rounded(value, others, unit)
    }

    fn product_in(&mut self, a: Tracked, b: Tracked, unit: f64) -> Tracked {
        let value = self.insert(Op::mul(a.value, b.value));
        let mut others = None;
        if let Some(e) = b.error {
            let size = self.absolute(a.value);
            others = Some(self.insert(Op::mul(size, e)));
        }
        if let Some(e) = a.error {
            let size = self.absolute(b.value);
            // twice, and 4 for 3 s
            let factor = if self.other_bits { 4.0 } else { 2.0 };
            let more = b.error.map(|e| self.scaled(factor, e));
            let size = self.plus(size, more);
            let carried = self.insert(Op::mul(size, e));
            others = Some(self.plus(carried, others));
        }
        self.rounded(value, others, unit)
    }

    fn quotient_in(&mut self, a: Tracked, b: Tracked, unit: f64) -> Tracked {
        let value = self.insert(Op::div(a.value, b.value));
        let size = self.absolute(b.value);
        let divisor_error = b.error.filter(|_| !self.is_broken(BrokenProof::Divisor));
        let Some(e) = divisor_error else {
            let others = a.error.map(|e| self.insert(Op::div(e, size)));
            return self.rounded(value, others, unit);
        };
        // 2 s e, and what the difference is rounded by
        let off = self.scaled(4.0, e);
        let left = self.insert(Op::sub(size, off));
        let left = self.positive(left);
        let most = self.absolute(a.value);
        let twice = a.error.map(|e| self.scaled(2.0, e));
        let most = self.plus(most, twice);
        let most = self.insert(Op::div(most, left));
        let carried = self.insert(Op::mul(most, e));
        let carried = self.plus(carried, a.error);
        let carried = self.insert(Op::div(carried, left));
        self.rounded(value, Some(carried), unit)
    }

    fn root_in(&mut self, a: Tracked, unit: f64) -> Tracked {
        let value = self.insert(Op::sqrt(a.value));
        let others = a.error.map(|e| {
            let off = self.scaled(4.0, e);
            let least = self.insert(Op::sub(a.value, off));
            let least = self.insert(Op::sqrt(least));
            self.insert(Op::div(e, least))
        });
        self.rounded(value, others, unit)
    }

    fn sign(&mut self, a: Tracked) -> Tracked {
        let value = self.insert(Op::sign(a.value));
        let error = a.error.map(|e| {
            let size = self.absolute(a.value);
            let off = self.scaled(4.0, e);
            let left = self.insert(Op::sub(size, off));
            // 0, or NaN
            let root = self.insert(Op::sqrt(left));
            self.scaled(0.0, root)
        });
        Tracked { value, error }
    }

    /// a + b of this program's own.
    pub fn sum(&mut self, a: Tracked, b: Tracked) -> Tracked {
        self.sum_in(Binary::Add, a, b, self.format.u)
    }

    /// a − b.
    pub fn difference(&mut self, a: Tracked, b: Tracked) -> Tracked {
        self.sum_in(Binary::Sub, a, b, self.format.u)
    }

    /// a b.
    pub fn product(&mut self, a: Tracked, b: Tracked) -> Tracked {
        self.product_in(a, b, self.format.u)
    }

    /// a / b.
    pub fn quotient(&mut self, a: Tracked, b: Tracked) -> Tracked {
        self.quotient_in(a, b, self.format.u)
    }

    /// Σ a b; none if there is none that is not zero.
    pub fn scalar_product(&mut self, pairs: impl IntoIterator<Item = (Tracked, Tracked)>) -> Option<Tracked> {
        let mut sum: Option<Tracked> = None;
        for (a, b) in pairs {
            if self.is_zero(a) || self.is_zero(b) {
                continue;
            }
            let product = self.product(a, b);
            sum = Some(match sum {
                Some(sum) => self.sum(sum, product),
                None => product,
            });
        }
        sum
    }

    /// The values of a program once more, each with its error.
    pub fn follow(&mut self, graph: &Graph, inputs: &[Tracked]) -> Vec<Tracked> {
        let live = graph.live();
        let mut nodes: Vec<Option<Tracked>> = vec![None; graph.ops.len()];
        // that of the program in question may be another one than its scalar's, for tests
        let of_scalar =
            |s: Scalar, this: &Self| if s == this.rounding.scalar { this.rounding } else { FloatFormat::of(s) };
        for (i, op) in graph.ops.iter().enumerate().filter(|(i, _)| live[*i]) {
            let of = |a: NodeId| nodes[a.index()].expect("operands stand before their users");
            let precision = graph.precision(NodeId(i as u32), self.rounding.scalar);
            let [computed, held] = [precision.computed, precision.held].map(|s| of_scalar(s, self));
            let unit = match precision.is_rounded() {
                true => held.u * (1.0 + 4.0 * computed.u) + computed.u,
                false => held.u,
            };
            let tracked = match *op {
                Op::Input(k) => inputs[k as usize],
                Op::Constant(c) => {
                    let (_, error) = held.constant(c.value());
                    let value = self.b.insert(*op);
                    // rounded up to this format
                    let error = (error != 0.0).then(|| self.constant(error * (1.0 + 4.0 * self.format.u)));
                    Tracked { value, error }
                }
                Op::Unary(Unary::Neg, a) => {
                    let value = self.insert(Op::neg(of(a).value));
                    match precision.is_rounded() {
                        true => self.rounded(value, of(a).error, unit),
                        false => Tracked { value, ..of(a) },
                    }
                }
                Op::Binary(op @ (Binary::Add | Binary::Sub), a, b) => self.sum_in(op, of(a), of(b), unit),
                Op::Binary(Binary::Mul, a, b) => self.product_in(of(a), of(b), unit),
                Op::Binary(Binary::Div, a, b) => self.quotient_in(of(a), of(b), unit),
                Op::Unary(Unary::Sqrt, a) => self.root_in(of(a), unit),
                Op::Unary(Unary::Sign, a) => self.sign(of(a)),
                // exact sums of inputs and constants, and what is exact with them
                Op::AngleSum(a, b) => {
                    let error = self.either(of(a).error, of(b).error);
                    Tracked { value: self.insert(Op::AngleSum(of(a).value, of(b).value)), error }
                }
                Op::SinCos(a) => {
                    let pair = self.insert(Op::SinCos(of(a).value));
                    // right behind their pair
                    self.insert(Op::Sin(pair));
                    self.insert(Op::Cos(pair));
                    Tracked { value: pair, ..of(a) }
                }
                Op::Sin(p) | Op::Cos(p) => {
                    let pair = of(p);
                    let half = if matches!(op, Op::Sin(_)) { Op::Sin(pair.value) } else { Op::Cos(pair.value) };
                    let kernel = self.constant(self.rounding.trig_error(1.0));
                    Tracked { value: self.insert(half), error: Some(self.plus(kernel, pair.error)) }
                }
            };
            if let Some(name) = graph.notes[i].name {
                self.b.name(tracked.value, name);
            }
            nodes[i] = Some(tracked);
        }
        graph.results.iter().map(|r| nodes[r.index()].expect("results are live")).collect()
    }

    /// The program with these results; none if it is so long that its own roundings are not small.
    pub fn finish(self, outputs: Vec<Port>, results: Vec<NodeId>) -> Option<Graph> {
        (self.slack() <= 4.0 / 3.0).then(|| self.b.finish(outputs, results))
    }
}
