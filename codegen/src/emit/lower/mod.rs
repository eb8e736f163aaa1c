//! From a schedule to statements.
//!
//! No algebra happens here. A program becomes one function, or a few when it is long; values get the names that the
//! algorithm gave them; every section of the algorithm is a block under a comment.

mod body;
mod copies;
pub mod fused;
mod limbs;
mod names;
mod rolled;
mod zeros;

pub use names::Names;

use super::module::{Access, Expression, Ports, Routine, RoutineParameter, Statement};
use super::target::{Scope, Target};
use super::Style;
use body::body;
use straightline_graph::expr::{Graph, NodeId, Op, Port, Section};
use straightline_graph::schedule::{ProgramPart, Schedule};

/// How programs become functions of a language.
#[derive(Clone, Copy)]
pub struct Lowering<'a> {
    /// Over what, and in which operations.
    pub style: Style,
    /// The language, which is asked for what it calls things, and how long its texts are.
    pub target: &'a dyn Target,
    /// The comment above a section's block.
    pub title: &'a dyn Fn(Section) -> String,
}

impl Lowering<'_> {
    /// The public function of a program; `doc` stands above it, line by line.
    pub fn routine(&self, graph: &Graph, schedule: &Schedule, name: &str, doc: &str) -> Routine {
        let ports = Ports { inputs: graph.inputs.clone(), outputs: graph.outputs.clone() };
        let scheduled = schedule.parts.iter().flat_map(|p| p.nodes.iter().copied());
        let is_read = read_inputs(graph, scheduled.chain(graph.results.iter().copied()));
        let inputs =
            is_read.iter().enumerate().map(|(port, is_read)| RoutineParameter::Input { port, is_read: *is_read });
        let outputs = (0..graph.outputs.len()).map(|port| RoutineParameter::Output { port });
        let mut routine = Routine {
            name: name.to_string(),
            doc: doc.to_string(),
            access: Access::Public,
            style: self.style,
            parameters: inputs.chain(outputs).collect(),
            ports,
            body: Vec::new(),
            parts: Vec::new(),
        };
        if let [part] = schedule.parts.as_slice() {
            routine.body = body(graph, part, self.scope(&routine.ports), self);
            return routine;
        }
        // in parts: the public function calls them one after the other
        let filler = first_read(graph, &is_read, self.style).unwrap_or(Expression::Zero);
        routine.body.push(Statement::Live { slots: schedule.slots, filler });
        routine.body.extend((0..schedule.parts.len()).map(Statement::Part));
        for (k, part) in schedule.parts.iter().enumerate() {
            routine.parts.push(Routine {
                name: format!("{name}_part{}", k + 1),
                doc: String::new(),
                access: Access::Part,
                style: self.style,
                parameters: parameters_of(graph, part, schedule.slots),
                body: body(graph, part, self.scope(&routine.ports), self),
                ports: routine.ports.clone(),
                parts: Vec::new(),
            });
        }
        routine
    }

    fn scope<'p>(&self, ports: &'p Ports) -> Scope<'p> {
        Scope { style: self.style, ports }
    }
}

/// What a part reads and writes.
fn parameters_of(graph: &Graph, part: &ProgramPart, slots: usize) -> Vec<RoutineParameter> {
    let is_read = read_inputs(graph, nodes_of(graph, part));
    let inputs = (0..is_read.len()).filter(|port| is_read[*port]);
    let mut parameters: Vec<RoutineParameter> =
        inputs.map(|port| RoutineParameter::Input { port, is_read: true }).collect();
    if !(part.loads.is_empty() && part.stores.is_empty()) {
        parameters.push(RoutineParameter::Live { slots, is_written: !part.stores.is_empty() });
    }
    let mut is_written = vec![false; graph.outputs.len()];
    part.results.iter().for_each(|r| is_written[port_of(&graph.outputs, *r).0] = true);
    let outputs = (0..is_written.len()).filter(|port| is_written[*port]);
    parameters.extend(outputs.map(|port| RoutineParameter::Output { port }));
    parameters
}

/// What a part computes, and the results that it stores.
fn nodes_of<'a>(graph: &'a Graph, part: &'a ProgramPart) -> impl Iterator<Item = NodeId> + 'a {
    part.nodes.iter().copied().chain(part.results.iter().map(|r| graph.results[*r]))
}

/// Which input ports these nodes read.
fn read_inputs(graph: &Graph, nodes: impl Iterator<Item = NodeId>) -> Vec<bool> {
    let mut is_read = vec![false; graph.inputs.len()];
    nodes.for_each(|id| {
        for a in graph.op(id).operands().flat_map(|a| graph.angle_terms(a)).chain([id]) {
            if let Op::Input(k) = graph.op(a) {
                is_read[port_of(&graph.inputs, k as usize).0] = true;
            }
        }
    });
    is_read
}

/// The first number of the inputs that are read anyway: what an array of a function of one state holds before its elements are computed.
/// An array of zeros would be filled by a call of `memset` where there are no vector instructions.
fn first_read(graph: &Graph, is_read: &[bool], style: Style) -> Option<Expression> {
    let mut plain = graph.inputs.iter().zip(is_read).map(|(p, is_read)| *is_read && p.wrapper.is_none());
    let port = plain.position(|is_plain| is_plain).filter(|_| !style.lanes && !style.generic)?;
    Some(Expression::Input { port, at: 0 })
}

/// The port that holds flat index `k`, and the index inside it.
pub(in crate::emit) fn port_of(ports: &[Port], mut k: usize) -> (usize, usize) {
    for (i, p) in ports.iter().enumerate() {
        if k < p.len() {
            return (i, k);
        }
        k -= p.len();
    }
    unreachable!("verified graphs have a port for every scalar")
}
