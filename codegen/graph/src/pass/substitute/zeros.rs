//! What is zero whatever the inputs.

use super::values::AtPoints;
use super::EQUAL;
use crate::expr::{Binary, Constant, Graph, NodeId, Note, Op, Unary};
use straightline_core::Dd;

/// Which values are zero whatever the inputs: sums of which nothing is left at random inputs, and products of such a sum.
pub(super) fn zeros(graph: &Graph, values: &[AtPoints]) -> Vec<bool> {
    let mut zero = vec![false; graph.ops.len()];
    for i in 0..zero.len() {
        let nothing_left = |a: NodeId, b: NodeId| {
            let [v, a, b] = [i, a.index(), b.index()].map(|n| &values[n]);
            v.iter().zip(a).zip(b).all(|((v, a), b)| v.abs().hi() <= EQUAL * a.abs().hi().max(b.abs().hi()))
        };
        zero[i] = match graph.ops[i] {
            Op::Constant(c) => c.value() == Dd::ZERO,
            Op::Unary(Unary::Neg, a) => zero[a.index()],
            Op::Binary(Binary::Mul, a, b) => zero[a.index()] || zero[b.index()],
            Op::Binary(Binary::Add | Binary::Sub, a, b) => match (zero[a.index()], zero[b.index()]) {
                (true, true) => true,
                (false, false) => nothing_left(a, b),
                _ => false,
            },
            _ => false,
        };
    }
    zero
}

/// The graph with zero in the place of what is zero; none if there is nothing of the kind. Quotients, roots and signs keep their operands.
pub(super) fn without(graph: &Graph, zero: &[bool]) -> Option<Graph> {
    let is_made = |i: usize| zero[i] && !matches!(graph.ops[i], Op::Constant(_));
    if !(0..zero.len()).any(is_made) {
        return None;
    }
    let mut less = Graph {
        ops: vec![Op::Constant(Constant::new(Dd::ZERO))],
        notes: vec![Note { name: None, section: graph.notes[0].section }],
        results: Vec::new(),
        ..graph.clone()
    };
    let nothing = NodeId(0);
    // where each value is, and what sums and products have in its place
    let (mut place, mut part) = (vec![nothing; zero.len()], vec![nothing; zero.len()]);
    for i in 0..zero.len() {
        let (op, is_zero) = (graph.ops[i], |a: NodeId| zero[a.index()]);
        let same = match op {
            Op::Constant(_) if zero[i] => Some(nothing),
            Op::Binary(Binary::Add, a, b) if !zero[i] && is_zero(a) => Some(part[b.index()]),
            Op::Binary(Binary::Add | Binary::Sub, a, b) if !zero[i] && is_zero(b) => Some(part[a.index()]),
            _ => None,
        };
        let op = match op {
            Op::Binary(Binary::Sub, a, b) if !zero[i] && is_zero(a) => Op::neg(part[b.index()]),
            Op::Binary(Binary::Add | Binary::Sub | Binary::Mul, ..) if !zero[i] => op.map(|a| part[a.index()]),
            _ => op.map(|a| place[a.index()]),
        };
        place[i] = same.unwrap_or_else(|| {
            less.ops.push(op);
            less.notes.push(graph.notes[i]);
            NodeId(less.ops.len() as u32 - 1)
        });
        part[i] = if zero[i] { nothing } else { place[i] };
    }
    less.results = graph.results.iter().map(|r| part[r.index()]).collect();
    Some(less)
}
