//! How much a program loses to rounding, estimated to first order at a few states: to tell forms of the same equations apart, not to
//! promise anything (that is what `certify` does).
//!
//! Every operation makes an error of its own, independent of the others; what it does to an output is the operation's adjoint.
//! The root of the sum of (adjoint · value)² is the rms error of the output in units of the rounding error (Monte Carlo arithmetic to
//! first order, without the Monte Carlo). Parameters of moved masses that cancel show here, and nowhere in an operation count.

use crate::expr::op::Slope;
use crate::expr::{values, Graph, NodeId, Op};
use straightline_core::magnitude::Magnitude;
use straightline_core::{Dd, Real};

/// So many operations are visited at most for one estimate; if there are more, outputs share a sweep.
const WORK: usize = 200_000;
/// An output that is so small against what it is made of is judged by that.
const SMALL: f64 = 1e-6;

/// What errors of each output are compared with: its rms value at these states, or, where that is small against what it is made of, a part of
/// that. Each by itself: a light wrist below a heavy base has digits of its own.
pub fn scales(graph: &Graph, states: &[Vec<f64>]) -> Vec<f64> {
    let of_state = |x: &Vec<f64>| {
        let inputs: Vec<Magnitude> = x.iter().map(|x| Magnitude::new(Dd::from(*x))).collect();
        crate::expr::evaluate(graph, &inputs)
    };
    let outputs: Vec<Vec<Magnitude>> = states.iter().map(of_state).collect();
    let rms = |of: &dyn Fn(&Magnitude) -> f64, k: usize| {
        (outputs.iter().map(|x| of(&x[k]).powi(2)).sum::<f64>() / states.len() as f64).sqrt()
    };
    (0..graph.results.len()).map(|k| rms(&|x| x.value.hi(), k).max(SMALL * rms(&|x| x.size, k))).collect()
}

/// The worst rms error of the outputs over these [`scales`], in units of the rounding error.
pub fn estimate(graph: &Graph, states: &[Vec<f64>], scales: &[f64]) -> f64 {
    let values: Vec<Vec<f64>> = states.iter().map(|x| values(graph, x)).collect();
    if graph.results.is_empty() {
        return 0.0;
    }
    let rounds: Vec<bool> = graph.ids().map(|id| rounds(graph.op(id))).collect();
    let sweeps = (WORK / (graph.ops.len() * states.len())).clamp(1, graph.results.len());
    let mut worst: f64 = 0.0;
    for sweep in 0..sweeps {
        let mut square = 0.0;
        for values in &values {
            let mut adjoints = vec![0.0; graph.ops.len()];
            // outputs of one sweep with signs of their own, so that on average they do not meet
            for (k, r) in graph.results.iter().enumerate().skip(sweep).step_by(sweeps) {
                let sign = if (k.wrapping_mul(0x9e37_79b9) >> 16) % 2 == 0 { 1.0 } else { -1.0 };
                // what is made of nothing is zero
                if scales[k] > 0.0 {
                    adjoints[r.index()] += sign / scales[k];
                }
            }
            square += swept(graph, values, &rounds, &mut adjoints);
        }
        let outputs = (graph.results.len() - sweep).div_ceil(sweeps);
        worst = worst.max((square / (states.len() * outputs) as f64).sqrt());
    }
    worst
}

/// Whether the result is rounded. Numbers that a short float holds are not; sums of angles keep what they lose.
fn rounds(op: Op) -> bool {
    match op {
        Op::Constant(c) => !c.is(f64::from(c.value().to_f32())),
        Op::Input(_) | Op::AngleSum(..) | Op::SinCos(_) => false,
        Op::Sin(_) | Op::Cos(_) => true,
        Op::Unary(..) | Op::Binary(..) => op.row().is_some_and(|row| !row.is_exact),
    }
}

/// Backwards through the program: the sum of (adjoint · value)² over what is rounded.
fn swept(graph: &Graph, values: &[f64], rounds: &[bool], adjoints: &mut [f64]) -> f64 {
    let mut square = 0.0;
    backwards(graph, values, adjoints, |i, adjoint| {
        if rounds[i] {
            square += (adjoint * values[i]).powi(2);
        }
    });
    square
}

/// Backwards through the first operations of a program, as many as there are adjoints: `tell` gets each whose adjoint is not zero, with it.
/// Angles count as inputs.
pub fn backwards<T: Real + PartialEq>(graph: &Graph, values: &[T], adjoints: &mut [T], mut tell: impl FnMut(usize, T)) {
    let zero = T::zero();
    for i in (0..adjoints.len()).rev() {
        let adjoint = adjoints[i];
        if adjoint == zero {
            continue;
        }
        tell(i, adjoint);
        let v = |a: NodeId| values[a.index()];
        let mut to = |a: NodeId, slope: Slope, other: NodeId| {
            if let Some(part) = slope.times(adjoint, v(a), v(other), values[i]) {
                adjoints[a.index()] = adjoints[a.index()] + part;
            }
        };
        match graph.ops[i] {
            Op::Unary(op, a) => to(a, op.row().slopes[0], a),
            Op::Binary(op, a, b) => {
                to(a, op.row().slopes[0], b);
                to(b, op.row().slopes[1], a);
            }
            Op::Input(_) | Op::Constant(_) | Op::AngleSum(..) | Op::SinCos(_) | Op::Sin(_) | Op::Cos(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{GraphBuilder, Port, RuleSet};

    fn program(results: impl Fn(&mut GraphBuilder, NodeId, NodeId) -> NodeId) -> Graph {
        let mut builder = GraphBuilder::new(
            RuleSet::exact(crate::expr::Folding::In(crate::number::Scalar::F64)),
            vec![Port::new("x", &[2])],
        );
        let (x, y) = (builder.insert(Op::Input(0)), builder.insert(Op::Input(1)));
        let result = results(&mut builder, x, y);
        builder.finish(vec![Port::new("z", &[1])], vec![result])
    }

    #[test]
    fn one_operation_loses_one_rounding_error() {
        let product = program(|b, x, y| b.insert(Op::mul(x, y)));
        let states = [vec![3.0, -7.0]];
        assert_eq!(estimate(&product, &states, &scales(&product, &states)), 1.0);
    }

    /// (x² + y) − x², x = 100: the product is rounded at 10⁴, and so is the sum; what is left is one.
    #[test]
    fn what_cancels_loses_as_much_as_it_was_greater() {
        let cancelling = program(|b, x, y| {
            let large = b.insert(Op::mul(x, x));
            let sum = b.insert(Op::add(large, y));
            b.insert(Op::sub(sum, large))
        });
        // the product's error cancels with itself; that of the sum stays
        let states = [vec![1e2, 1.0]];
        let lost = estimate(&cancelling, &states, &scales(&cancelling, &states));
        assert!((lost / 1e4 - 1.0).abs() < 1e-3, "{lost:e}");
    }
}
