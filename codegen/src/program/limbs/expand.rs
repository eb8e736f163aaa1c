//! A template written out: plain operations, once per limb, and which of them are alike.

use super::template::{LaneValue, Template};
use crate::function::Function;
use crate::scene::Scene;
use rustc_hash::FxHashMap;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::{Alike, Constant, Graph, LoopLanes, NodeId, Note, Op, Port, Section};

/// Where a node of the template is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NodePlace {
    /// Once, before the limbs.
    Before,
    /// By the limbs of a kind.
    Limb(usize),
    /// Once, with what the limbs pass on.
    Behind,
}

/// What a node of the template became.
#[derive(Clone, Debug)]
enum Expanded {
    Once(NodeId),
    PerLimb(Vec<NodeId>),
}

struct ExpansionWriter<'a> {
    graph: &'a Graph,
    template: &'a Template,
    out: Graph,
    written: Vec<Option<Expanded>>,
    /// For look-ups only.
    sections: FxHashMap<Section, u32>,
}

/// The program of a function of all limbs. In order: what no limb changes, with the sines of all angles, where limbs are lanes;
/// kind by kind the limbs; then the rest of the robot with the sums of what they pass on.
pub(super) fn written_out(
    graph: &Graph,
    template: &Template,
    model: &Model<Dd>,
    scene: &Scene,
    (function, is_rolled): (Function, bool),
) -> Graph {
    let (wanted, outputs) = scene.select(function, model, 0);
    let places = places(graph, template);
    let inputs: Vec<Port> = graph.inputs[..graph.inputs.len() - 2].to_vec();
    let mut writer = ExpansionWriter {
        graph,
        template,
        out: Graph { inputs, outputs, ..Graph::default() },
        written: vec![None; graph.ops.len()],
        sections: FxHashMap::default(),
    };
    // angles, their sums, and their sines and cosines, of limbs too: the calls take several at once. A rolled loop has its own
    let angles = angles(graph);
    let is_early = |id: NodeId| match graph.op(id) {
        Op::Input(k) => template.of_inputs(k as usize),
        _ => angles[id.index()] && !is_rolled,
    };
    // what a limb takes of inputs and constants may stand before them
    let is_leaf = |id: NodeId| matches!(graph.op(id), Op::Input(_) | Op::Constant(_));
    let (leaves, others): (Vec<NodeId>, Vec<NodeId>) =
        graph.ids().partition(|id| is_leaf(*id) && places[id.index()] == NodePlace::Before);
    for id in leaves.into_iter().chain(others) {
        match places[id.index()] {
            NodePlace::Before => writer.once(id),
            NodePlace::Limb(kind) if is_early(id) => drop(writer.per_limb(id, kind)),
            _ => {}
        }
    }
    for kind in 0..template.first_bodies.len() {
        let mut rows = Vec::new();
        for id in graph.ids().filter(|id| places[id.index()] == NodePlace::Limb(kind)) {
            let more = writer.per_limb(id, kind);
            if !matches!(graph.op(id), Op::Input(_)) {
                rows.extend(more);
            }
        }
        if !rows.is_empty() {
            let lanes = LoopLanes::Limbs(template.first_bodies[kind].clone());
            writer.out.alike.push(Alike { lanes, rows, is_rolled });
        }
    }
    for id in graph.ids().filter(|id| places[id.index()] == NodePlace::Behind) {
        writer.once(id);
    }
    let is_between_limbs = |k: &usize| template.places[*k].is_none();
    let zero = wanted.iter().any(is_between_limbs).then(|| writer.zero());
    let result = |k: &usize| match template.places[*k] {
        Some((result, limb)) => writer.of_limb(graph.results[result], limb),
        None => zero.expect("it was written"),
    };
    let results = wanted.iter().map(result).collect();
    Graph { results, ..writer.out }
}

/// Where each node is computed.
fn places(graph: &Graph, template: &Template) -> Vec<NodePlace> {
    let mut places: Vec<NodePlace> = Vec::with_capacity(graph.ops.len());
    for id in graph.ids() {
        let op = graph.op(id);
        let own = match op {
            Op::Input(k) if k as usize >= template.first_lane => {
                NodePlace::Limb(template.lanes[k as usize - template.first_lane].0)
            }
            Op::Input(k) if k as usize >= template.first_sum => NodePlace::Behind,
            _ => NodePlace::Before,
        };
        let place = op.operands().map(|a| places[a.index()]).fold(own, |a, b| match (a, b) {
            (NodePlace::Before, other) | (other, NodePlace::Before) => other,
            (a, b) => {
                assert!(a == b, "what limbs pass on reaches no other limb");
                a
            }
        });
        places.push(place);
    }
    places
}

/// Which nodes are sines and cosines of inputs and of their sums, or go into them alone.
fn angles(graph: &Graph) -> Vec<bool> {
    let is_angle =
        |a: NodeId| graph.angle_terms(a).iter().all(|t| matches!(graph.op(*t), Op::Input(_) | Op::Constant(_)));
    let mut angles = vec![false; graph.ops.len()];
    for id in graph.ids() {
        angles[id.index()] = match graph.op(id) {
            Op::AngleSum(..) => is_angle(id),
            Op::SinCos(a) => is_angle(a),
            Op::Sin(pair) | Op::Cos(pair) => angles[pair.index()],
            _ => false,
        };
    }
    angles
}

impl ExpansionWriter<'_> {
    fn push(&mut self, op: Op, note: Note, limb: usize) -> NodeId {
        let section = self.graph.sections[note.section as usize];
        let body = |i: usize| self.template.bodies[i].1[limb.min(self.template.bodies[i].1.len() - 1)];
        let section = Section { index: section.index.map(body), ..section };
        let name = note.name.map(|(quantity, i, component)| (quantity, body(i), component));
        self.push_in(section, op, name)
    }

    fn push_in(&mut self, section: Section, op: Op, name: Option<(&'static str, usize, &'static str)>) -> NodeId {
        let next = self.out.sections.len() as u32;
        let place = *self.sections.entry(section).or_insert(next);
        if place == next {
            self.out.sections.push(section);
        }
        let id = NodeId(self.out.ops.len() as u32);
        self.out.ops.push(op);
        self.out.notes.push(Note { name, section: place });
        id
    }

    fn zero(&mut self) -> NodeId {
        let section = Section { phase: "between limbs", index: None };
        self.push_in(section, Op::Constant(Constant::new(Dd::ZERO)), None)
    }

    /// Node `id` of the template as limb `limb` has it.
    fn of_limb(&self, id: NodeId, limb: usize) -> NodeId {
        match self.written[id.index()].as_ref().expect("operands are written before their users") {
            Expanded::Once(node) => *node,
            Expanded::PerLimb(nodes) => nodes[limb],
        }
    }

    /// Writes what is computed once.
    fn once(&mut self, id: NodeId) {
        let note = self.graph.notes[id.index()];
        let op = self.graph.op(id);
        let node = match op {
            Op::Input(k) if k as usize >= self.template.first_sum => self.sum(k as usize - self.template.first_sum),
            _ => {
                let op = op.map(|a| self.of_limb(a, 0));
                self.push(op, note, 0)
            }
        };
        self.written[id.index()] = Some(Expanded::Once(node));
    }

    /// Writes what each limb computes, with both halves of a sine-cosine pair beside it; the rows.
    fn per_limb(&mut self, id: NodeId, kind: usize) -> Vec<Vec<NodeId>> {
        if self.written[id.index()].is_some() {
            return Vec::new();
        }
        if let Op::Input(lane) = self.graph.op(id) {
            let lane = lane as usize - self.template.first_lane;
            let nodes = (0..self.template.count(kind)).map(|limb| self.lane(lane, limb, id)).collect();
            self.written[id.index()] = Some(Expanded::PerLimb(nodes));
            return Vec::new();
        }
        let halves = (id.0 + 1..id.0 + 3).map(NodeId);
        let is_half = |h: &NodeId| matches!(self.graph.ops.get(h.index()), Some(Op::Sin(p) | Op::Cos(p)) if *p == id);
        let together: Vec<NodeId> = [id].into_iter().chain(halves.filter(is_half)).collect();
        let mut rows: Vec<Vec<NodeId>> = vec![Vec::new(); together.len()];
        for limb in 0..self.template.count(kind) {
            for (k, member) in together.iter().enumerate() {
                let op = self.graph.op(*member).map(|a| if a == id { rows[0][limb] } else { self.of_limb(a, limb) });
                let node = self.push(op, self.graph.notes[member.index()], limb);
                rows[k].push(node);
            }
        }
        for (member, row) in together.iter().zip(&rows) {
            self.written[member.index()] = Some(Expanded::PerLimb(row.clone()));
        }
        rows
    }

    /// A value of a limb that comes from outside.
    fn lane(&mut self, lane: usize, limb: usize, id: NodeId) -> NodeId {
        match &self.template.lanes[lane].1 {
            LaneValue::Constants(values) => {
                let op = Op::Constant(Constant::new(values[limb]));
                self.push(op, self.graph.notes[id.index()], limb)
            }
            LaneValue::Results(results) => self.of_limb(self.graph.results[results[limb]], 0),
        }
    }

    /// The sum of what the limbs of a kind pass on: by halves, so that as few as possible wait for one another.
    fn sum(&mut self, input: usize) -> NodeId {
        let sum = self.template.sums.iter().find(|s| s.input == input).expect("sums that are read have their limbs");
        let (kind, result) = (sum.kind, self.graph.results[sum.result]);
        let mut terms: Vec<NodeId> = (0..self.template.count(kind)).map(|limb| self.of_limb(result, limb)).collect();
        while terms.len() > 1 {
            let pairs = terms.chunks(2).map(|pair| match pair {
                [a, b] => self.push_in(Section { phase: "sums over limbs", index: None }, Op::add(*a, *b), None),
                _ => pair[0],
            });
            terms = pairs.collect();
        }
        terms[0]
    }
}
