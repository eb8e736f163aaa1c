//! Keeps what the results need, in the same order.

use crate::expr::{Graph, NodeId, Op};

/// The graph without nodes that no result needs. Both halves of a sine-cosine pair stay beside the pair.
pub fn dead_code(graph: &Graph) -> Graph {
    graph.expect_plain("dead_code");
    let live = graph.live();
    let mut new_id = vec![NodeId(u32::MAX); graph.ops.len()];
    let mut kept = Graph {
        sections: graph.sections.clone(),
        inputs: graph.inputs.clone(),
        outputs: graph.outputs.clone(),
        ..Graph::default()
    };
    let mut keep = |id: NodeId, new_id: &mut Vec<NodeId>| {
        let new = NodeId(kept.ops.len() as u32);
        kept.ops.push(graph.op(id).map(|a| new_id[a.index()]));
        kept.notes.push(graph.notes[id.index()]);
        new_id[id.index()] = new;
    };
    for id in graph.ids().filter(|id| live[id.index()]) {
        match graph.op(id) {
            // placed with its pair
            Op::Sin(_) | Op::Cos(_) => {}
            Op::SinCos(_) => {
                keep(id, &mut new_id);
                for half in [Op::Sin(id), Op::Cos(id)] {
                    // the builder puts the halves right behind the pair
                    if let Some(h) = (id.0 + 1..id.0 + 3)
                        .map(NodeId)
                        .find(|h| graph.ops.get(h.index()) == Some(&half) && live[h.index()])
                    {
                        keep(h, &mut new_id);
                    }
                }
            }
            _ => keep(id, &mut new_id),
        }
    }
    kept.results = graph.results.iter().map(|r| new_id[r.index()]).collect();
    kept
}
