//! The program of a gradient: from a graph with results r(x, p) to one with λᵀ ∂r/∂p, backwards through the operations.

use super::{Graph, GraphBuilder, NodeId, Op, Port, RuleSet};
use crate::trace::{self, Expr};
use straightline_core::Real;

/// The program of Σ_k λ_k ∂r_k/∂p for the inputs of the group `of` of a graph with results r. Its inputs are those of the graph and a
/// group `seed` with a λ_k per result, its one output the gradient. About twice to four times the operations of the graph, however many
/// inputs (Griewank and Walther 2008, section 3.3). The sign of a number has the derivative zero.
///
/// # Panics
/// If the graph has no group of inputs of that name.
pub fn gradient(graph: &Graph, of: &str) -> Graph {
    graph.expect_plain("gradient");
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
    let mut b = GraphBuilder::new(RuleSet::all(), inputs);
    let mut copy: Vec<Expr> = Vec::with_capacity(graph.ops.len());
    for op in &graph.ops {
        copy.push(Expr::of(b.insert(op.map(|id| copy[id.index()].node()))));
    }
    let (b, results) = trace::continued(b, || {
        // ∂/∂(node) of Σ λ r; of a pair of sine and cosine that of its angle
        let mut adjoint: Vec<Option<Expr>> = vec![None; graph.ops.len()];
        for (k, result) in graph.results.iter().enumerate() {
            let seed = Expr::of_op(Op::Input(seed_at + k as u32));
            add(&mut adjoint, *result, seed);
        }
        let mut of_inputs: Vec<Option<Expr>> = vec![None; group.len()];
        for (i, op) in graph.ops.iter().enumerate().rev() {
            let Some(x) = adjoint[i] else { continue };
            let v = |a: NodeId| copy[a.index()];
            let slopes = op.row().map_or(&[][..], |row| row.slopes);
            match *op {
                Op::Input(k) if group.contains(&k) => of_inputs[(k - group.start) as usize] = Some(x),
                Op::Input(_) | Op::Constant(_) => {}
                Op::Unary(_, a) => {
                    let part = slopes[0].times(x, v(a), v(a), copy[i]);
                    part.into_iter().for_each(|part| add(&mut adjoint, a, part));
                }
                Op::Binary(_, a, b) => {
                    let parts = [(a, b, slopes[0]), (b, a, slopes[1])]
                        .map(|(own, other, slope)| (own, slope.times(x, v(own), v(other), copy[i])));
                    for (own, part) in parts {
                        part.into_iter().for_each(|part| add(&mut adjoint, own, part));
                    }
                }
                Op::AngleSum(a, b) => [a, b].into_iter().for_each(|a| add(&mut adjoint, a, x)),
                Op::SinCos(angle) => add(&mut adjoint, angle, x),
                Op::Sin(pair) => add(&mut adjoint, pair, x * Expr::of_op(Op::Cos(v(pair).node()))),
                Op::Cos(pair) => add(&mut adjoint, pair, -(x * Expr::of_op(Op::Sin(v(pair).node())))),
            }
        }
        let zero = Expr::zero();
        of_inputs.into_iter().map(|a| a.unwrap_or(zero).node()).collect()
    });
    let shape = [group.len()];
    b.finish(vec![Port::new("gradient", &shape)], results)
}

/// One more part of an adjoint.
fn add(adjoint: &mut [Option<Expr>], to: NodeId, part: Expr) {
    adjoint[to.index()] = Some(match adjoint[to.index()] {
        None => part,
        Some(sum) => sum + part,
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::evaluate;
    use crate::trace::trace;
    use straightline_core::Dd;

    /// Every operation, against central differences of the program itself in double-double.
    #[test]
    fn a_gradient_is_that_of_differences() {
        let inputs = vec![Port::new("x", &[2]), Port::new("p", &[3])];
        let graph = trace(RuleSet::all(), inputs, vec![Port::new("r", &[2])], |given| {
            let (x, p) = (&given[0], &given[1]);
            let (sin, cos) = (p[0] * x[0]).sin_cos();
            let (s, c) = Expr::sin_cos_of_sum(&[p[1], x[1], p[2]]);
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
