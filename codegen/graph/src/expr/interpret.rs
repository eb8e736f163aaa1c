//! Runs a graph over any scalar.

use super::{Graph, NodeId, Op, Sines};
use straightline_core::Real;

/// The results of a graph for these inputs (group after group), as many as the graph has results.
///
/// # Panics
/// If the number of inputs is not the graph's.
pub fn evaluate<T: Real>(graph: &Graph, inputs: &[T]) -> Vec<T> {
    let sin_cos = match graph.sines {
        Sines::Precise => T::sin_cos_of_sum,
        Sines::Short => T::short_sin_cos_of_sum,
    };
    evaluate_by(graph, inputs, |_, _| None, sin_cos)
}

/// [`evaluate`] where some operations are computed otherwise: `other` gives the value of a node from those before it, or
/// none, and `sin_cos` those of a sum of angles.
///
/// # Panics
/// As [`evaluate`].
pub fn evaluate_by<T: Real>(
    graph: &Graph,
    inputs: &[T],
    other: impl Fn(NodeId, &[T]) -> Option<T>,
    sin_cos: impl Fn(&[T]) -> (T, T),
) -> Vec<T> {
    let values = values_by(graph, inputs, other, sin_cos);
    graph.results.iter().map(|r| values[r.index()]).collect()
}

/// The values of all nodes, sums of angles rounded like any other; of a pair of sine and cosine that of its sine.
///
/// # Panics
/// As [`evaluate`].
pub fn values<T: Real>(graph: &Graph, inputs: &[T]) -> Vec<T> {
    values_by(graph, inputs, |_, _| None, of_rounded_sum)
}

/// Sine and cosine of a sum of angles that is rounded.
pub(crate) fn of_rounded_sum<T: Real>(angles: &[T]) -> (T, T) {
    let (first, rest) = angles.split_first().expect("an angle has a term");
    rest.iter().fold(*first, |sum, x| sum + *x).sin_cos()
}

/// [`values`] where some operations are computed otherwise, as in [`evaluate_by`].
///
/// # Panics
/// As [`evaluate`].
pub fn values_by<T: Real>(
    graph: &Graph,
    inputs: &[T],
    other: impl Fn(NodeId, &[T]) -> Option<T>,
    sin_cos: impl Fn(&[T]) -> (T, T),
) -> Vec<T> {
    let expected: usize = graph.inputs.iter().map(|p| p.len()).sum();
    assert_eq!(inputs.len(), expected, "one number per input scalar");
    // a SinCos node holds the sine; its cosine stands beside it
    let mut values: Vec<T> = Vec::with_capacity(graph.ops.len());
    let mut cosines: Vec<T> = Vec::new();
    let mut cosine_of = vec![0u32; graph.ops.len()];
    for (i, op) in graph.ops.iter().enumerate() {
        if let Some(value) = other(NodeId(i as u32), &values) {
            values.push(value);
            continue;
        }
        let v = |id: NodeId| values[id.index()];
        let value = match *op {
            Op::Input(k) => inputs[k as usize],
            Op::Constant(c) => T::constant(c.value()),
            Op::Unary(op, a) => op.value(v(a)),
            Op::Binary(op, a, b) => op.value(v(a), v(b)),
            Op::AngleSum(a, b) => v(a) + v(b),
            Op::SinCos(a) => {
                let (s, c) = sin_cos(&graph.angle_terms(a).into_iter().map(v).collect::<Vec<T>>());
                cosine_of[i] = cosines.len() as u32;
                cosines.push(c);
                s
            }
            Op::Sin(a) => v(a),
            Op::Cos(a) => cosines[cosine_of[a.index()] as usize],
        };
        values.push(value);
    }
    values
}
