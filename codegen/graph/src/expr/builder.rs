//! Hash-consing: the only way to make a graph.

use super::rules::RuleSet;
use super::{Constant, Graph, NodeId, Note, Op, Port, Section};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::collections::hash_map::Entry;
use straightline_core::Dd;

/// So many operations a program has, more or less: room for them from the beginning.
const ABOUT: usize = 1000;

/// Adds operations to a graph: equal ones once, and simplified by the rules on the way in.
#[derive(Debug)]
pub struct GraphBuilder {
    graph: Graph,
    /// For look-ups only; never iterated, so that its order cannot reach the output.
    known: FxHashMap<Op, NodeId>,
    rules: RuleSet,
    section: u32,
}

impl GraphBuilder {
    /// An empty graph with these inputs.
    pub fn new(rules: RuleSet, inputs: Vec<Port>) -> Self {
        let graph = Graph { inputs, sections: vec![Section { phase: "", index: None }], ..Graph::default() };
        GraphBuilder { graph, known: FxHashMap::with_capacity_and_hasher(ABOUT, FxBuildHasher), rules, section: 0 }
    }

    /// The rules in force.
    pub fn rules(&self) -> &RuleSet {
        &self.rules
    }

    /// The operation of a node.
    pub fn op(&self, id: NodeId) -> Op {
        self.graph.op(id)
    }

    /// The constant behind a node, if it is one.
    pub fn as_constant(&self, id: NodeId) -> Option<Constant> {
        match self.op(id) {
            Op::Constant(c) => Some(c),
            _ => None,
        }
    }

    /// The node of a constant, rounded first if the rules fold in a number format.
    pub fn constant(&mut self, value: Dd) -> NodeId {
        let value = self.rules.folding().round(value);
        self.insert(Op::Constant(Constant::new(value)))
    }

    /// The node of an operation: a known one, a simpler one, or a new one.
    pub fn add(&mut self, op: Op) -> NodeId {
        for rule in self.rules.rules() {
            if let Some(id) = (rule.apply)(self, op) {
                return id;
            }
        }
        self.insert(op)
    }

    /// The node of an operation if it is there already.
    pub fn find(&self, op: Op) -> Option<NodeId> {
        self.known.get(&op).copied()
    }

    /// The node of this very operation, without rules.
    pub fn insert(&mut self, op: Op) -> NodeId {
        let place = match self.known.entry(op) {
            Entry::Occupied(known) => return *known.get(),
            Entry::Vacant(place) => place,
        };
        let id = NodeId(u32::try_from(self.graph.ops.len()).expect("a graph has fewer than 2^32 nodes"));
        self.graph.ops.push(op);
        self.graph.notes.push(Note { name: None, section: self.section });
        *place.insert(id)
    }

    /// What follows belongs to this section.
    pub fn section(&mut self, section: Section) {
        self.section = match self.graph.sections.iter().rposition(|s| *s == section) {
            Some(i) => i as u32,
            None => {
                self.graph.sections.push(section);
                self.graph.sections.len() as u32 - 1
            }
        };
    }

    /// Names a node, if it has no name yet and is worth one.
    pub fn name(&mut self, id: NodeId, name: (&'static str, usize, &'static str)) {
        let note = &mut self.graph.notes[id.index()];
        if note.name.is_none() && !matches!(self.graph.ops[id.index()], Op::Input(_) | Op::Constant(_)) {
            note.name = Some(name);
        }
    }

    /// The graph with these results.
    pub fn finish(mut self, outputs: Vec<Port>, results: Vec<NodeId>) -> Graph {
        assert_eq!(outputs.iter().map(Port::len).sum::<usize>(), results.len(), "one node per output scalar");
        self.graph.outputs = outputs;
        self.graph.results = results;
        self.graph
    }
}
