//! The worst error that a search finds: what a bound must never fall below, and how far above it may be.
//!
//! Hill climbing per result: from the best of many random inputs, single inputs move by steps of all sizes down to the
//! last place; what makes the error greater is kept. The truth is the same program in double-double.

use super::Interval;
use crate::expr::{evaluate, Graph, NodeId, Op, Precision};
use crate::number::Scalar;
use straightline_core::random::Random;
use straightline_core::{Dd, Real};

/// The worst that was found for one output scalar.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstFound {
    /// |computed − exact|.
    pub error: f64,
    /// At these inputs.
    pub inputs: Vec<f64>,
}

/// The number of the format that is nearest to x and in the range.
fn representable(x: f64, range: Interval, scalar: Scalar) -> f64 {
    let x = x.clamp(range.lo, range.hi);
    let near = scalar.rounded(x);
    let near = if near > range.hi { -scalar.next_up(-near) } else { near };
    if near < range.lo {
        scalar.next_up(near)
    } else {
        near
    }
}

/// Errors of all output scalars at inputs that the format holds.
pub fn errors_at(graph: &Graph, scalar: Scalar, inputs: &[f64]) -> Vec<f64> {
    let truth = evaluate::<Dd>(graph, &inputs.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
    let computed: Vec<f64> = computed_at(graph, scalar, inputs);
    computed.iter().zip(truth).map(|(c, t)| (Dd::from(*c) - t).to_f64().abs()).collect()
}

/// What the program computes in its format.
pub fn computed_at(graph: &Graph, scalar: Scalar, inputs: &[f64]) -> Vec<f64> {
    if !graph.formats.is_empty() {
        return mixed_at(graph, scalar, inputs);
    }
    in_scalar!(scalar, T => {
        let inputs: Vec<T> = inputs.iter().map(|x| *x as T).collect();
        evaluate::<T>(graph, &inputs).into_iter().map(f64::from).collect()
    })
}

/// What a program in mixed precision computes; values of short formats are held as the f64 that they are.
fn mixed_at(graph: &Graph, scalar: Scalar, inputs: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(graph.ops.len());
    for (i, op) in graph.ops.iter().enumerate() {
        let Precision { computed, held } = graph.precision(NodeId(i as u32), scalar);
        let v = |a: NodeId| values[a.index()];
        let halves = |pair: NodeId| match graph.op(pair) {
            Op::SinCos(a) => in_scalar!(scalar, T => {
                let terms: Vec<T> = graph.angle_terms(a).into_iter().map(|t| v(t) as T).collect();
                let (sin, cos) = <T as Real>::sin_cos_of_sum(&terms);
                (f64::from(sin), f64::from(cos))
            }),
            _ => unreachable!("verified graphs have halves of pairs"),
        };
        values.push(match *op {
            Op::Input(k) => scalar.rounded(inputs[k as usize]),
            Op::Constant(c) => held.nearest(c.value()),
            Op::Unary(op, a) => held.rounded(in_scalar!(computed, T => f64::from(op.value(v(a) as T)))),
            Op::Binary(op, a, b) => held.rounded(in_scalar!(computed, T => f64::from(op.value(v(a) as T, v(b) as T)))),
            // formed where the sine is
            Op::AngleSum(..) | Op::SinCos(_) => 0.0,
            Op::Sin(p) => halves(p).0,
            Op::Cos(p) => halves(p).1,
        });
    }
    graph.results.iter().map(|r| values[r.index()]).collect()
}

/// The worst errors found in a box with so many evaluations.
pub fn worst_found(
    graph: &Graph,
    scalar: Scalar,
    ranges: &[Interval],
    evaluations: usize,
    seed: u64,
) -> Vec<WorstFound> {
    let mut random = Random(seed);
    let outputs = graph.results.len();
    let fits = |x: Vec<f64>| -> Vec<f64> { x.iter().zip(ranges).map(|(x, r)| representable(*x, *r, scalar)).collect() };
    // errors of a short format are seen in f64 well enough to climb; what was found is measured in double-double
    let errors = |inputs: &[f64]| -> Vec<f64> {
        if !scalar.is_short() {
            return errors_at(graph, scalar, inputs);
        }
        let truth = evaluate::<f64>(graph, inputs);
        computed_at(graph, scalar, inputs).iter().zip(truth).map(|(c, t)| (c - t).abs()).collect()
    };
    let mut best = vec![WorstFound { error: -1.0, inputs: Vec::new() }; outputs];
    let keep = |best: &mut Vec<WorstFound>, inputs: &[f64], errors: &[f64]| {
        for (found, e) in best.iter_mut().zip(errors) {
            // an error that is no number is the worst of all
            if *e > found.error || e.is_nan() {
                *found = WorstFound { error: if e.is_nan() { f64::INFINITY } else { *e }, inputs: inputs.to_vec() };
            }
        }
    };
    for _ in 0..evaluations / 5 + 1 {
        let place = |r: &Interval, random: &mut Random| match random.below(6) {
            0 => r.lo,
            1 => r.hi,
            _ => r.lo + random.unit() * (r.hi - r.lo),
        };
        let inputs = fits(ranges.iter().map(|r| place(r, &mut random)).collect());
        let e = errors(&inputs);
        keep(&mut best, &inputs, &e);
    }
    let climbs = (evaluations - evaluations / 5) / outputs.max(1);
    for k in 0..outputs {
        for _ in 0..climbs {
            let mut inputs = best[k].inputs.clone();
            for _ in 0..1 + random.below(3) {
                let i = random.below(inputs.len());
                let width = ranges[i].hi - ranges[i].lo;
                // steps from the whole range to the last places, evenly in their exponents
                let step = width * (-17.0 * random.unit()).exp() * (2.0 * random.unit() - 1.0);
                inputs[i] += step;
            }
            let inputs = fits(inputs);
            let e = errors(&inputs);
            keep(&mut best, &inputs, &e);
        }
    }
    for (k, found) in best.iter_mut().enumerate().filter(|(_, found)| found.error.is_finite()) {
        found.error = errors_at(graph, scalar, &found.inputs)[k];
    }
    best
}
