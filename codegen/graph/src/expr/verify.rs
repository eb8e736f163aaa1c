//! What every graph must be, checked between passes.

use super::{Graph, NodeId, Op, Sines};

/// Checks that operands stand before users, that inputs and results exist, that only `Sin` and `Cos` use a `SinCos`,
/// that there is a result per output scalar and a note per node, and that rows for several limbs have the same operation for each.
///
/// # Errors
/// The first broken promise, in words.
pub fn verify(graph: &Graph) -> Result<(), String> {
    let n = graph.ops.len();
    let inputs: usize = graph.inputs.iter().map(|p| p.len()).sum();
    if graph.notes.len() != n {
        return Err(format!("{} notes for {n} nodes", graph.notes.len()));
    }
    for (i, op) in graph.ops.iter().enumerate() {
        for a in op.operands() {
            if a.index() >= i {
                return Err(format!("node {i} ({op:?}) uses a later node"));
            }
            let pair = matches!(graph.op(a), Op::SinCos(_));
            if pair != matches!(op, Op::Sin(_) | Op::Cos(_)) {
                return Err(format!("node {i} ({op:?}) mixes a sine-cosine pair and a number"));
            }
        }
        for a in op.operands().filter(|a| matches!(graph.op(*a), Op::AngleSum(..))) {
            if !matches!(op, Op::AngleSum(..) | Op::SinCos(_)) {
                return Err(format!("node {i} ({op:?}) takes the sum of angles {} for a number", a.index()));
            }
        }
        if let Op::AngleSum(a, b) = op {
            let is_angle = |a: NodeId| matches!(graph.op(a), Op::Input(_) | Op::Constant(_) | Op::AngleSum(..));
            if !(is_angle(*a) && is_angle(*b)) {
                return Err(format!("node {i} adds something that is neither an input nor a constant to an angle"));
            }
        }
        if let Op::Input(k) = op {
            if *k as usize >= inputs {
                return Err(format!("node {i} reads input {k} of {inputs}"));
            }
        }
        if graph.notes[i].section as usize >= graph.sections.len() {
            return Err(format!("node {i} lies in a section that does not exist"));
        }
    }
    for (row, lanes) in graph.alike.iter().flat_map(|alike| alike.rows.iter().map(|row| (row, alike.lanes.count()))) {
        let op = |id: &NodeId| graph.ops.get(id.index()).copied();
        let is_alike = |id: &NodeId| op(id).zip(op(&row[0])).is_some_and(|(a, b)| a.is_alike(b));
        if row.len() != lanes || !row.iter().all(is_alike) {
            return Err(format!("the row {row:?} is not the same operation for {lanes} lanes"));
        }
    }
    if graph.sines == Sines::Short && !graph.formats.is_empty() {
        return Err("short sines in mixed precision".to_string());
    }
    let outputs: usize = graph.outputs.iter().map(|p| p.len()).sum();
    if graph.results.len() != outputs {
        return Err(format!("{} results for {outputs} output scalars", graph.results.len()));
    }
    match graph.results.iter().find(|r| r.index() >= n || matches!(graph.op(**r), Op::SinCos(_) | Op::AngleSum(..))) {
        Some(r) => Err(format!("result {r:?} is not a number")),
        None => Ok(()),
    }
}
