//! Which kernel the sines and cosines of a program are computed by.

use crate::function::Function;
use crate::options::Options;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::{Graph, NodeId, Op, Sines};

/// A program with short sines where its machine computes one angle at a time and every angle is known to be small: by the limits of the robot
/// file or by the ranges of the scene.
pub(super) fn with_sines(graph: Graph, function: Function, model: &Model<Dd>, options: &Options) -> Graph {
    let Some(short) = options.scalar.short_sines().filter(|_| options.wants_short_sines(function)) else {
        return graph;
    };
    let ranges = graph.inputs.iter().flat_map(|port| options.scene.input_ranges(port, model));
    let greatest: Vec<f64> = ranges.map(|range| range.lower.abs().max(range.upper.abs())).collect();
    let of_term = |term: NodeId| match graph.op(term) {
        Op::Input(k) => greatest[k as usize],
        Op::Constant(c) => c.value().hi().abs().next_up(),
        // an angle that is computed: nothing is known of it
        _ => f64::INFINITY,
    };
    let is_small = |op: &Op| match op {
        Op::SinCos(angle) => graph.angle_terms(*angle).into_iter().map(of_term).sum::<f64>() <= short.domain,
        _ => true,
    };
    match graph.ops.iter().all(is_small) {
        true => Graph { sines: Sines::Short, ..graph },
        false => graph,
    }
}
