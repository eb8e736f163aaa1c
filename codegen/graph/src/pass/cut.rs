//! Cuts one program by what its values depend on: what changes rarely is computed once and stored.
//!
//! Every input port belongs to a stage, 0 changing least often; a value belongs to the latest stage among its inputs. A
//! stage's program computes all values of that stage which anything later needs, or which are results, and stores them;
//! so no operation is ever done twice, and what is stored is only what crosses: a change of sign is free and crosses by its
//! operand.

use crate::expr::{Graph, NodeId, Op, Port, Unary};
use crate::pass::{dead_code, unread_inputs};

/// A program cut into stages.
#[derive(Clone, Debug)]
pub struct Staged {
    /// Per stage: inputs are the stored values of earlier stages and the stage's own ports; the output is what is stored.
    pub stages: Vec<Graph>,
    /// Per function: the stage that it belongs to, and the program that makes it from stored
    /// values and, for the last stage, the inputs of that stage.
    pub functions: Vec<(usize, Graph)>,
}

/// Cuts `graph`; `stage_of` gives the stage of each input port, `names` the name of each stage's stored values, `blocks`
/// how many output ports each function has. The last stage stores nothing: its inputs belong to single calls.
pub fn cut(graph: &Graph, stage_of: &[usize], names: &[&str], blocks: &[usize]) -> Staged {
    graph.expect_plain("cut");
    let stages = names.len();
    let last = stages - 1;
    let mut stage_of_scalar = Vec::new();
    graph.inputs.iter().zip(stage_of).for_each(|(p, s)| stage_of_scalar.extend(vec![*s; p.len()]));
    // stage of every node; constants belong to none
    let mut stage: Vec<Option<usize>> = Vec::with_capacity(graph.ops.len());
    for op in &graph.ops {
        stage.push(match op {
            Op::Input(k) => Some(stage_of_scalar[*k as usize]),
            _ => op.operands().filter_map(|a| stage[a.index()]).max(),
        });
    }
    let live = graph.live();
    let free = |id: NodeId| match graph.op(id) {
        Op::Unary(Unary::Neg, a) => a,
        _ => id,
    };
    // what each stage stores: read by a later stage, or a result
    let mut stored: Vec<Vec<NodeId>> = vec![Vec::new(); stages];
    let mut store = |id: NodeId| {
        let id = free(id);
        if let Some(s) = stage[id.index()].filter(|s| *s < last) {
            stored[s].push(id);
        }
    };
    for id in graph.ids().filter(|id| live[id.index()]) {
        for a in graph.op(id).operands() {
            if stage[a.index()] < stage[id.index()] {
                store(a);
            }
        }
    }
    graph.results.iter().for_each(|r| store(*r));
    for list in &mut stored {
        list.sort_unstable();
        list.dedup();
    }

    let values = |s: usize| Port::new(names[s], &[stored[s].len()]);
    let cutter = |own: usize, results: &[NodeId], outputs: Vec<Port>| {
        let given = |s: usize| (values(s), stored[s].iter().map(|id| Some(*id)).collect());
        let mut inputs: Vec<(Port, Vec<Option<NodeId>>)> = (0..own.min(last)).map(given).collect();
        let mut next = 0;
        for (port, s) in graph.inputs.iter().zip(stage_of) {
            let scalars: Vec<u32> = (next..next + port.len() as u32).collect();
            next += port.len() as u32;
            if *s == own {
                let node = |k: u32| graph.ids().find(|id| graph.op(*id) == Op::Input(k));
                inputs.push((port.clone(), scalars.iter().map(|k| node(*k)).collect()));
            }
        }
        extract(graph, inputs, results, outputs)
    };
    let programs = (0..last).map(|s| cutter(s, &stored[s], vec![values(s)])).collect();
    let mut functions = Vec::new();
    let mut first = 0;
    let mut ports = &graph.outputs[..];
    for count in blocks {
        let (own_ports, rest) = ports.split_at(*count);
        ports = rest;
        let length: usize = own_ports.iter().map(Port::len).sum();
        let results = &graph.results[first..first + length];
        first += length;
        let own = results.iter().filter_map(|r| stage[r.index()]).max().unwrap_or(0);
        // a result of a storing stage is only copied: that is the work of the stage after it
        let reader = if own < last { own + 1 } else { own };
        functions.push((own, unread_inputs(cutter(reader, results, own_ports.to_vec()), |_| true)));
    }
    Staged { stages: programs, functions }
}

/// The part of a graph that makes `results` when the nodes of `inputs` are given.
///
/// A scalar of `inputs` without a node is one that nothing reads.
fn extract(graph: &Graph, inputs: Vec<(Port, Vec<Option<NodeId>>)>, results: &[NodeId], outputs: Vec<Port>) -> Graph {
    const NONE: NodeId = NodeId(u32::MAX);
    let mut part = Graph { sections: graph.sections.clone(), outputs, ..Graph::default() };
    let mut new_id = vec![NONE; graph.ops.len()];
    let mut k = 0;
    for (port, nodes) in inputs {
        for id in nodes {
            // a node that two ports give comes from the first, its own scalar stays unread
            if let Some(id) = id.filter(|id| new_id[id.index()] == NONE) {
                new_id[id.index()] = NodeId(part.ops.len() as u32);
                part.ops.push(Op::Input(k));
                part.notes.push(crate::expr::Note { name: None, ..graph.notes[id.index()] });
            }
            k += 1;
        }
        part.inputs.push(port);
    }
    let mut needed = vec![false; graph.ops.len()];
    results.iter().for_each(|r| needed[r.index()] = true);
    for i in (0..graph.ops.len()).rev() {
        if needed[i] && new_id[i] == NONE {
            graph.ops[i].operands().for_each(|a| needed[a.index()] = true);
        }
    }
    for id in graph.ids().filter(|id| needed[id.index()]) {
        if new_id[id.index()] == NONE {
            new_id[id.index()] = NodeId(part.ops.len() as u32);
            part.ops.push(graph.op(id).map(|a| new_id[a.index()]));
            part.notes.push(graph.notes[id.index()]);
        }
    }
    part.results = results.iter().map(|r| new_id[r.index()]).collect();
    dead_code(&part)
}
