//! Runs a graph over any scalar.

use super::{Graph, Op};
use straightline_core::Real;

/// The results of a graph for these inputs (group after group), as many as the graph has results.
///
/// # Panics
/// If the number of inputs is not the graph's.
pub fn evaluate<T: Real>(graph: &Graph, inputs: &[T]) -> Vec<T> {
    let expected: usize = graph.inputs.iter().map(|p| p.len()).sum();
    assert_eq!(inputs.len(), expected, "one number per input scalar");
    // a SinCos node holds the sine; its cosine stands beside it
    let mut values: Vec<T> = Vec::with_capacity(graph.ops.len());
    let mut cosines: Vec<T> = Vec::new();
    let mut cosine_of = vec![0u32; graph.ops.len()];
    for (i, op) in graph.ops.iter().enumerate() {
        let v = |id: super::NodeId| values[id.index()];
        let value = match *op {
            Op::Input(k) => inputs[k as usize],
            Op::Constant(c) => T::constant(c.value()),
            Op::Neg(a) => -v(a),
            Op::Add(a, b) => v(a) + v(b),
            Op::Sub(a, b) => v(a) - v(b),
            Op::Mul(a, b) => v(a) * v(b),
            Op::Div(a, b) => v(a) / v(b),
            Op::Sqrt(a) => v(a).sqrt(),
            Op::Sign(a) => v(a).sign(),
            Op::AngleSum(a, b) => v(a) + v(b),
            Op::SinCos(a) => {
                let terms = graph.angle_terms(a);
                let (s, c) = match terms.as_slice() {
                    [angle] => v(*angle).sin_cos(),
                    _ => T::sin_cos_of_sum(&terms.into_iter().map(v).collect::<Vec<T>>()),
                };
                cosine_of[i] = cosines.len() as u32;
                cosines.push(c);
                s
            }
            Op::Sin(a) => v(a),
            Op::Cos(a) => cosines[cosine_of[a.index()] as usize],
        };
        values.push(value);
    }
    graph.results.iter().map(|r| values[r.index()]).collect()
}
