//! Fused multiply-add: which products go into which sums.

use straightline_core::Real;
use straightline_graph::expr::{evaluate_by, Binary, Graph, NodeId, Op, Unary};
use straightline_graph::schedule::{ProgramPart, Schedule};

/// A sum whose one term is a product: ±x·y ± c.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fused {
    /// Whether the product is subtracted.
    pub negated: bool,
    /// The factors.
    pub factors: (NodeId, NodeId),
    /// The other term, and whether it is subtracted.
    pub other: (NodeId, bool),
}

/// The sums of a part that take a product in, and what they take in: those that [`Graph::counts`] counts as `fma`, as far as
/// product and sum are in the same part.
pub fn fusions(graph: &Graph, part: &ProgramPart) -> (Vec<Option<Fused>>, Vec<bool>) {
    let mut uses = graph.uses();
    // what crosses to a loop over limbs, or from one, is a value of its own
    uses.iter_mut().zip(graph.uses_across()).for_each(|(uses, across)| *uses += across);
    let mut here = vec![false; graph.ops.len()];
    part.nodes.iter().for_each(|id| here[id.index()] = true);
    // what crosses to another part is a value of its own
    part.stores.iter().for_each(|(id, _)| uses[id.index()] += 1);
    let mut fused = vec![None; graph.ops.len()];
    let mut absorbed = vec![false; graph.ops.len()];
    // the product behind a term, seen through a sign: whether the sign is there, the nodes that vanish, the factors
    let product = |term: NodeId| {
        let alone = |id: NodeId| here[id.index()] && uses[id.index()] == 1;
        let (inner, sign) = match graph.op(term) {
            Op::Unary(Unary::Neg, inner) if alone(term) => (inner, true),
            _ => (term, false),
        };
        match graph.op(inner) {
            Op::Binary(Binary::Mul, x, y) if alone(inner) => Some((sign, inner, (x, y))),
            _ => None,
        }
    };
    for id in &part.nodes {
        let (a, b, minus) = match graph.op(*id) {
            Op::Binary(Binary::Add, a, b) => (a, b, false),
            Op::Binary(Binary::Sub, a, b) => (a, b, true),
            _ => continue,
        };
        let (term, found, negated, other) = match (product(b), product(a)) {
            (Some(found), _) => (b, found, found.0 != minus, (a, false)),
            (None, Some(found)) => (a, found, found.0, (b, minus)),
            (None, None) => continue,
        };
        absorbed[term.index()] = true;
        absorbed[found.1.index()] = true;
        fused[id.index()] = Some(Fused { negated, factors: found.2, other });
    }
    (fused, absorbed)
}

/// The results of a program as its fused text computes them where the machine has the instruction: `fma` is a·b + c in one
/// rounding, `sin_cos` the fused sine and cosine of a sum in two pieces.
pub fn evaluate<T: Real>(
    (graph, schedule): (&Graph, &Schedule),
    inputs: &[T],
    fma: impl Fn(T, T, T) -> T,
    sin_cos: impl Fn([T; 2]) -> (T, T),
) -> Vec<T> {
    let mut fused: Vec<Option<Fused>> = vec![None; graph.ops.len()];
    for part in &schedule.parts {
        let found = fusions(graph, part).0;
        part.nodes.iter().for_each(|id| fused[id.index()] = found[id.index()]);
    }
    let sum = |id: NodeId, values: &[T]| {
        let Fused { negated, factors: (a, b), other: (c, minus) } = fused[id.index()]?;
        let [a, b, c] = [a, b, c].map(|id| values[id.index()]);
        Some(fma(if negated { -a } else { a }, b, if minus { -c } else { c }))
    };
    let sin_cos = |angles: &[T]| match angles {
        [angle] => sin_cos([*angle, T::zero()]),
        angles => sin_cos(T::sum_of_angles(angles)),
    };
    evaluate_by(graph, inputs, sum, sin_cos)
}
