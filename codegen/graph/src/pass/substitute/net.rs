//! Operations in any order, while some become others.

use super::{GraphChange, Operand};
use crate::expr::{Constant, Graph, NodeId, Note, Op};
use rustc_hash::FxHashMap;

/// The operations, in any order.
#[derive(Clone)]
pub(super) struct Net {
    pub(super) ops: Vec<Op>,
    pub(super) notes: Vec<Note>,
}

impl Net {
    pub(super) fn with(&self, found: &GraphChange) -> Net {
        let mut net = self.clone();
        let section = self.notes[found.becomes[0].value].section;
        let push = |net: &mut Net, op: Op| {
            net.ops.push(op);
            net.notes.push(Note { name: None, section });
            NodeId(net.ops.len() as u32 - 1)
        };
        let node = |i: usize| NodeId(i as u32);
        let pair = found.pair.map(|(x, y, form)| push(&mut net, Op::Binary(form.op(), node(x), node(y))));
        for b in &found.becomes {
            let mut becomes = match b.y {
                None => Op::neg(node(b.x)),
                Some((form, y)) => {
                    let y = match y {
                        Operand::Node(y) => node(y),
                        Operand::Constant(c) => push(&mut net, Op::Constant(Constant::new(c))),
                        Operand::Pair => pair.expect("a pair where an operand is one"),
                    };
                    Op::Binary(form.op(), node(b.x), y)
                }
            };
            // −(x ∘ y), and x itself as −(−x): sums dissolves signs
            if b.negative != b.y.is_none() {
                becomes = Op::neg(push(&mut net, becomes));
            }
            net.ops[b.value] = becomes;
        }
        net
    }

    /// Which of the operations the results of the graph need.
    pub(super) fn live(&self, graph: &Graph) -> Vec<bool> {
        let mut live = vec![false; self.ops.len()];
        let mut stack: Vec<usize> = graph.results.iter().map(|r| r.index()).collect();
        while let Some(i) = stack.pop() {
            if !std::mem::replace(&mut live[i], true) {
                stack.extend(self.ops[i].operands().map(NodeId::index));
            }
        }
        live
    }

    /// As a graph, in the order that it was in where that can be; none if a value would need itself.
    pub(super) fn ordered(&self, graph: &Graph) -> Option<Graph> {
        const OPEN: NodeId = NodeId(u32::MAX - 1);
        const UNSEEN: NodeId = NodeId(u32::MAX);
        let live = self.live(graph);
        let mut stack = Vec::new();
        let mut ordered = Graph {
            sections: graph.sections.clone(),
            inputs: graph.inputs.clone(),
            outputs: graph.outputs.clone(),
            ..Graph::default()
        };
        let mut placed = vec![UNSEEN; self.ops.len()];
        let mut known: FxHashMap<Op, NodeId> = FxHashMap::default();
        for root in 0..self.ops.len() {
            if !live[root] || placed[root] != UNSEEN {
                continue;
            }
            stack.push(root);
            while let Some(&i) = stack.last() {
                if placed[i] < OPEN {
                    stack.pop();
                    continue;
                }
                let waits = self.ops[i].operands().map(NodeId::index).find(|a| placed[*a] >= OPEN);
                if let Some(a) = waits {
                    if placed[a] == OPEN {
                        return None;
                    }
                    placed[i] = OPEN;
                    stack.push(a);
                    continue;
                }
                stack.pop();
                let mut place = |i: usize, placed: &mut Vec<NodeId>| {
                    let op = self.ops[i].map(|a| placed[a.index()]);
                    placed[i] = *known.entry(op).or_insert_with(|| {
                        ordered.ops.push(op);
                        ordered.notes.push(self.notes[i]);
                        NodeId(ordered.ops.len() as u32 - 1)
                    });
                };
                place(i, &mut placed);
                if let Op::SinCos(_) = self.ops[i] {
                    // the halves stand right behind their pair
                    let pair = NodeId(i as u32);
                    let is_half = |h: &usize| live[*h] && [Op::Sin(pair), Op::Cos(pair)].contains(&self.ops[*h]);
                    for half in (i + 1..(i + 3).min(self.ops.len())).filter(is_half) {
                        place(half, &mut placed);
                    }
                }
            }
        }
        ordered.results = graph.results.iter().map(|r| placed[r.index()]).collect();
        Some(ordered)
    }
}
