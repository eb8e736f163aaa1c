//! The program of a gradient: from a graph with results r(x, p) to one with λᵀ ∂r/∂p, backwards through the operations.

use super::{Builder, Graph, NodeId, Op, Port, RuleSet};
use straightline_core::Dd;

/// The program of Σ_k λ_k ∂r_k/∂p for the inputs of the group `of` of a graph with results r. Its inputs are those of the graph and a
/// group `seed` with a λ_k per result, its one output the gradient. About twice to four times the operations of the graph, however many
/// inputs (Griewank and Walther 2008, section 3.3). The sign of a number has the derivative zero.
///
/// # Panics
/// If the graph has no group of inputs of that name.
pub fn gradient(graph: &Graph, of: &str) -> Graph {
    let seed_at = graph.inputs.iter().map(Port::len).sum::<usize>() as u32;
    let mut first = 0;
    let group = graph.inputs.iter().find_map(|port| {
        let begins = first;
        first += port.len() as u32;
        (port.name == of).then(|| begins..begins + port.len() as u32)
    });
    let group = group.expect("the graph has the group of inputs");
    let mut inputs = graph.inputs.clone();
    inputs.push(Port::new("seed", &[graph.results.len()]));
    let mut b = Builder::new(RuleSet::all(), inputs);
    let mut copy: Vec<NodeId> = Vec::with_capacity(graph.ops.len());
    for op in &graph.ops {
        let id = b.insert(op.map(|id| copy[id.index()]));
        copy.push(id);
    }
    // ∂/∂(node) of Σ λ r; of a pair of sine and cosine that of its angle
    let mut adjoint: Vec<Option<NodeId>> = vec![None; graph.ops.len()];
    let add = |b: &mut Builder, adjoint: &mut Vec<Option<NodeId>>, to: NodeId, x: NodeId| {
        adjoint[to.index()] = Some(match adjoint[to.index()] {
            None => x,
            Some(sum) => b.add(Op::Add(sum, x)),
        });
    };
    for (k, result) in graph.results.iter().enumerate() {
        let seed = b.insert(Op::Input(seed_at + k as u32));
        add(&mut b, &mut adjoint, *result, seed);
    }
    let mut of_inputs: Vec<Option<NodeId>> = vec![None; group.len()];
    for (i, op) in graph.ops.iter().enumerate().rev() {
        let Some(a) = adjoint[i] else { continue };
        match *op {
            Op::Input(k) if group.contains(&k) => of_inputs[(k - group.start) as usize] = Some(a),
            Op::Input(_) | Op::Constant(_) | Op::Sign(_) => {}
            Op::Neg(x) => {
                let minus = b.add(Op::Neg(a));
                add(&mut b, &mut adjoint, x, minus);
            }
            Op::Add(x, y) | Op::AngleSum(x, y) => {
                add(&mut b, &mut adjoint, x, a);
                add(&mut b, &mut adjoint, y, a);
            }
            Op::Sub(x, y) => {
                let minus = b.add(Op::Neg(a));
                add(&mut b, &mut adjoint, x, a);
                add(&mut b, &mut adjoint, y, minus);
            }
            Op::Mul(x, y) => {
                let (of_x, of_y) = (b.add(Op::Mul(a, copy[y.index()])), b.add(Op::Mul(a, copy[x.index()])));
                add(&mut b, &mut adjoint, x, of_x);
                add(&mut b, &mut adjoint, y, of_y);
            }
            Op::Div(x, y) => {
                // v = x/y: 1/y and −v/y
                let of_x = b.add(Op::Div(a, copy[y.index()]));
                let product = b.add(Op::Mul(of_x, copy[i]));
                let of_y = b.add(Op::Neg(product));
                add(&mut b, &mut adjoint, x, of_x);
                add(&mut b, &mut adjoint, y, of_y);
            }
            Op::Sqrt(x) => {
                let half = b.constant(Dd::HALF);
                let scaled = b.add(Op::Mul(a, half));
                let of_x = b.add(Op::Div(scaled, copy[i]));
                add(&mut b, &mut adjoint, x, of_x);
            }
            Op::Sin(pair) => {
                let cos = b.add(Op::Cos(copy[pair.index()]));
                let of_angle = b.add(Op::Mul(a, cos));
                add(&mut b, &mut adjoint, pair, of_angle);
            }
            Op::Cos(pair) => {
                let sin = b.add(Op::Sin(copy[pair.index()]));
                let product = b.add(Op::Mul(a, sin));
                let of_angle = b.add(Op::Neg(product));
                add(&mut b, &mut adjoint, pair, of_angle);
            }
            Op::SinCos(angle) => add(&mut b, &mut adjoint, angle, a),
        }
    }
    let zero = b.constant(Dd::ZERO);
    let results = of_inputs.into_iter().map(|a| a.unwrap_or(zero)).collect();
    let shape = [group.len()];
    b.finish(vec![Port::new("gradient", &shape)], results)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::evaluate;
    use crate::trace::trace;
    use straightline_core::Real;

    /// Every operation, against central differences of the program itself in double-double.
    #[test]
    fn a_gradient_is_that_of_differences() {
        let inputs = vec![Port::new("x", &[2]), Port::new("p", &[3])];
        let graph = trace(RuleSet::all(), inputs, vec![Port::new("r", &[2])], |given| {
            let (x, p) = (&given[0], &given[1]);
            let (sin, cos) = (p[0] * x[0]).sin_cos();
            let (s, c) = crate::trace::Expr::sin_cos_of_sum(&[p[1], x[1], p[2]]);
            let root = (p[0] * p[0] + cos * cos).sqrt();
            vec![sin * p[1] - s / root + p[2].sign() * p[2], -(c * p[2]) / (p[1] + x[0]) + cos]
        });
        let program = crate::pass::dead_code(&gradient(&graph, "p"));
        let (x, p, seed) = ([0.7, -0.4], [0.3, 1.9, -0.8], [1.3, -0.6]);
        let wide = |x: &[f64]| x.iter().map(|x| Dd::from(*x)).collect::<Vec<Dd>>();
        let found = evaluate(&program, &[wide(&x), wide(&p), wide(&seed)].concat());
        let (h, seed) = (Dd::from(1e-9), wide(&seed));
        for i in 0..3 {
            let at = |sign: f64| {
                let mut p = wide(&p);
                p[i] += h * Dd::from(sign);
                let r = evaluate(&graph, &[wide(&x), p].concat());
                r[0] * seed[0] + r[1] * seed[1]
            };
            let expected = (at(1.0) - at(-1.0)) / (h + h);
            // differences leave h² of the third derivative
            assert!((found[i] - expected).to_f64().abs() < 1e-15, "{i}: {} and {expected}", found[i]);
        }
    }
}
