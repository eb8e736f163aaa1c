//! Drops input ports that nothing reads.

use crate::expr::{Graph, Op, Port};

/// The graph without those of the optional input ports that nothing reads; the inputs are numbered anew.
pub fn unread_inputs(mut graph: Graph, optional: impl Fn(&Port) -> bool) -> Graph {
    let mut starts = Vec::new();
    let mut next = 0;
    for port in &graph.inputs {
        starts.push(next..next + port.len());
        next += port.len();
    }
    let read = |range: &std::ops::Range<usize>| {
        graph.ops.iter().any(|op| matches!(op, Op::Input(k) if range.contains(&(*k as usize))))
    };
    let keep: Vec<bool> = graph.inputs.iter().zip(&starts).map(|(p, r)| !optional(p) || read(r)).collect();
    let mut shift = vec![0u32; next];
    let mut removed = 0u32;
    for (range, keep) in starts.iter().zip(&keep) {
        range.clone().for_each(|k| shift[k] = removed);
        if !keep {
            removed += range.len() as u32;
        }
    }
    for op in &mut graph.ops {
        if let Op::Input(k) = op {
            *k -= shift[*k as usize];
        }
    }
    let mut keep = keep.into_iter();
    graph.inputs.retain(|_| keep.next().expect("one flag per port"));
    graph
}
