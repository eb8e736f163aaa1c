//! Fused multiply-add: which products go into which sums, and the functions that compute both in one rounding, sines and
//! cosines among them.

use super::Style;
use straightline_core::Real;
use straightline_graph::expr::{evaluate_by, Binary, Graph, NodeId, Op, Unary};
use straightline_graph::schedule::{Part, Schedule};

/// A sum whose one term is a product: ±x·y ± c.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fused {
    /// Whether the product is subtracted.
    pub negated: bool,
    /// The factors.
    pub factors: (NodeId, NodeId),
    /// The other term, and whether it is subtracted.
    pub other: (NodeId, bool),
}

/// The sums of a part that take a product in, and what they take in: those that [`Graph::counts`] counts as `fma`, as far as
/// product and sum are in the same part.
pub(super) fn fusions(graph: &Graph, part: &Part) -> (Vec<Option<Fused>>, Vec<bool>) {
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

/// The module `fused` of a file whose functions are fused; with sines and cosines if there is a module `trig` beside it.
pub fn module(style: Style, with_kernel: bool) -> String {
    let kernel = if with_kernel { KERNEL } else { "" };
    let operation = if style.fused_by_caller { BY_CALLER } else { BY_STD };
    [MODULE, operation, FMA, kernel, "}\n"].concat().replace("f64", style.scalar.name())
}

const MODULE: &str = r#"
#[allow(unused_imports)]
use fused::{fma, fma_if, FUSED};
"#;

const BY_STD: &str = r#"
/// a·b + c in one rounding.
///
/// Only where the machine has it as an instruction, never by a call: the crate is compiled for one (`-C target-cpu`,
/// `-C target-feature=+fma`), or a batch has asked. Otherwise a·b is rounded, and the sum again.
#[allow(dead_code, unused_imports)]
mod fused {
    // the instruction is not to be had from `core`
    #[cfg(not(target_os = "none"))]
    extern crate std;

    /// Whether this crate is compiled for a machine with the instruction, and with `std`.
    pub const FUSED: bool =
        cfg!(all(not(target_os = "none"), any(target_feature = "fma", all(target_arch = "aarch64", target_feature = "neon"))));
    /// Whether it is one operation whatever the machine.
    const ALWAYS: bool = false;

    #[cfg(not(target_os = "none"))]
    #[inline(always)]
    fn mul_add(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }

    #[cfg(target_os = "none")]
    #[inline(always)]
    fn mul_add(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
"#;

const BY_CALLER: &str = r#"
/// a·b + c in one rounding, by the function `mul_add_f64(a, b, c)` of this crate: always, with the same bits on every machine.
#[allow(dead_code, unused_imports)]
mod fused {
    use crate::mul_add_f64 as mul_add;

    /// a·b + c is one operation.
    pub const FUSED: bool = true;
    /// Whether it is one operation whatever the machine.
    const ALWAYS: bool = true;
"#;

const FMA: &str = r#"
    #[inline(always)]
    pub fn fma(a: f64, b: f64, c: f64) -> f64 {
        fma_if::<FUSED>(a, b, c)
    }

    #[inline(always)]
    pub fn fma_if<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
        if FUSED || ALWAYS {
            mul_add(a, b, c)
        } else {
            a * b + c
        }
    }
"#;

const KERNEL: &str = r#"
    use super::trig;

    #[inline(always)]
    pub fn sin_cos_f64(x: f64) -> (f64, f64) {
        sin_cos_if_f64::<FUSED>(x)
    }

    #[inline(always)]
    pub fn sin_cos_of_sum_f64(x: [f64; 2]) -> (f64, f64) {
        sin_cos_of_sum_if_f64::<FUSED>(x)
    }

    #[inline(always)]
    pub fn sin_cos_if_f64<const FUSED: bool>(x: f64) -> (f64, f64) {
        if FUSED || ALWAYS {
            trig::sin_cos_fused_f64(x, mul_add)
        } else {
            trig::sin_cos_f64(x)
        }
    }

    #[inline(always)]
    pub fn sin_cos_of_sum_if_f64<const FUSED: bool>(x: [f64; 2]) -> (f64, f64) {
        if FUSED || ALWAYS {
            trig::sin_cos_of_sum_fused_f64(x, mul_add)
        } else {
            trig::sin_cos_of_sum_f64(x)
        }
    }

    #[inline(always)]
    pub fn sin_cos_lanes_f64<const N: usize>(x: [f64; N]) -> ([f64; N], [f64; N]) {
        if FUSED || ALWAYS {
            trig::sin_cos_lanes_fused_f64(x, mul_add)
        } else {
            trig::sin_cos_lanes_f64(x)
        }
    }

    #[inline(always)]
    pub fn sin_cos_lanes_of_sums_f64<const N: usize>(x: [[f64; 2]; N]) -> ([f64; N], [f64; N]) {
        if FUSED || ALWAYS {
            trig::sin_cos_lanes_of_sums_fused_f64(x, mul_add)
        } else {
            trig::sin_cos_lanes_of_sums_f64(x)
        }
    }
"#;
