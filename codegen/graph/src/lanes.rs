//! Columns that are computed alike, traced once for all of them and written out as lanes of one loop.
//!
//! What solves H x = b for many b does the same operations for each b. [`traced`] hands the algorithm a [`Tracer`], and the algorithm says which
//! columns these are. Those with zeros at the same places become the lanes of a loop: the algorithm is traced for one column of inputs that
//! stand for the entries of all of them, and behind the loop stand inputs for what each lane leaves. Passes see such a [`LaneTemplate`] as any
//! graph, so that lanes stay alike whatever passes do. [`LaneTemplate::written_out`] then puts plain operations in the place of those inputs, once
//! per lane, and notes which of them are alike ([`Alike`]): bounds, counts and checks see what is executed, and the text has each operation once.

use crate::expr::{values, Alike, Graph, LoopLanes, NodeId, Note, Op, Port, RuleSet};
use crate::pass::dead_code;
use crate::trace::{written, Expr};
use std::cell::{Cell, RefCell};
use straightline_core::Dd;

/// So few columns are no lanes: half a vector of eight would be empty.
const FEWEST: usize = 4;

/// Finds what is alike while an algorithm is traced.
#[derive(Debug)]
pub struct Tracer {
    /// How many inputs there are.
    inputs: Cell<u32>,
    loops: RefCell<Vec<TracedLoop>>,
}

/// A loop in expressions.
#[derive(Debug)]
struct TracedLoop {
    /// Placeholders of what the lanes take, and per lane what it takes.
    taken: Vec<(NodeId, Vec<Expr>)>,
    /// What the template leaves, and per lane the placeholder of what it leaves.
    left: Vec<(Expr, Vec<NodeId>)>,
}

impl Tracer {
    /// An input that stands for something.
    fn placeholder(&self) -> Expr {
        self.inputs.set(self.inputs.get() + 1);
        Expr::of_op(Op::Input(self.inputs.get() - 1))
    }

    /// `one` of each of these columns.
    pub fn columns(&self, columns: &[Vec<Expr>], one: &dyn Fn(&[Expr]) -> Vec<Expr>) -> Vec<Vec<Expr>> {
        let mut results: Vec<Vec<Expr>> = vec![Vec::new(); columns.len()];
        for lanes in groups(columns) {
            if lanes.len() < FEWEST {
                lanes.iter().for_each(|k| results[*k] = one(&columns[*k]));
                continue;
            }
            let mut taken: Vec<(NodeId, Vec<Expr>)> = Vec::new();
            let entry = |i: usize| {
                let of_lanes: Vec<Expr> = lanes.iter().map(|k| columns[*k][i]).collect();
                if of_lanes.iter().all(|x| x.node() == of_lanes[0].node()) {
                    return of_lanes[0];
                }
                let placeholder = self.placeholder();
                taken.push((placeholder.node(), of_lanes));
                placeholder
            };
            let column: Vec<Expr> = (0..columns[lanes[0]].len()).map(entry).collect();
            let mut left = Vec::new();
            for x in one(&column) {
                if x.as_constant().is_some() {
                    lanes.iter().for_each(|k| results[*k].push(x));
                    continue;
                }
                let of_lanes: Vec<Expr> = lanes.iter().map(|_| self.placeholder()).collect();
                lanes.iter().zip(&of_lanes).for_each(|(k, x)| results[*k].push(*x));
                left.push((x, of_lanes.iter().map(|x| x.node()).collect()));
            }
            self.loops.borrow_mut().push(TracedLoop { taken, left });
        }
        results
    }
}

/// Which columns are lanes of one loop: those with zeros at the same places, so that no lane computes what it need not.
fn groups(columns: &[Vec<Expr>]) -> Vec<Vec<usize>> {
    let is_other = |x: &Expr| x.as_constant() != Some(Dd::ZERO);
    let mut groups: Vec<(Vec<bool>, Vec<usize>)> = Vec::new();
    for (k, column) in columns.iter().enumerate() {
        let pattern: Vec<bool> = column.iter().map(is_other).collect();
        match groups.iter_mut().find(|(other, _)| *other == pattern) {
            Some((_, lanes)) => lanes.push(k),
            None => groups.push((pattern, vec![k])),
        }
    }
    groups.into_iter().map(|(_, lanes)| lanes).collect()
}

/// A program in which one lane of each loop stands for all of them. Its inputs are its own, then placeholders: of what the lanes of each loop take and
/// leave. Its results are its own, then what lanes take and what templates of loops leave.
#[derive(Clone, Debug)]
pub struct LaneTemplate {
    /// Its operations.
    pub graph: Graph,
    own_inputs: usize,
    own_results: usize,
    loops: Vec<TemplateLoop>,
}

/// A loop of a template.
#[derive(Clone, Debug)]
struct TemplateLoop {
    lanes: usize,
    /// Inputs that stand for what lanes take, each with the results that they take.
    taken: Vec<(usize, Vec<usize>)>,
    /// Results that stand for what lanes leave, each with the inputs that stand for what they left.
    left: Vec<(usize, Vec<usize>)>,
}

/// [`trace`](crate::trace::trace) of an algorithm that may say what it computes alike; `None` if nothing is.
pub fn traced(
    rules: RuleSet,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    algorithm: impl FnOnce(&[Vec<Expr>], &Tracer) -> Vec<Expr>,
) -> Option<LaneTemplate> {
    let own_inputs: usize = inputs.iter().map(Port::len).sum();
    let tracer = Tracer { inputs: Cell::new(own_inputs as u32), loops: RefCell::default() };
    let (builder, mut results) = written(rules, inputs, |inputs| algorithm(inputs, &tracer));
    let own_results = results.len();
    let input = |id: NodeId| match builder.op(id) {
        Op::Input(k) => k as usize,
        _ => unreachable!("placeholders are inputs"),
    };
    let placeholders = tracer.inputs.get() as usize - own_inputs;
    let mut loops = Vec::new();
    for found in tracer.loops.into_inner() {
        let Some(lanes) = found.taken.first().map(|(_, of_lanes)| of_lanes.len()) else { continue };
        let mut result = |id: NodeId| {
            results.push(id);
            results.len() - 1
        };
        let taken: Vec<_> = found
            .taken
            .iter()
            .map(|(id, of_lanes)| (input(*id), of_lanes.iter().map(|x| result(x.node())).collect()))
            .collect();
        let left: Vec<_> = found
            .left
            .iter()
            .map(|(x, of_lanes)| (result(x.node()), of_lanes.iter().map(|id| input(*id)).collect()))
            .collect();
        loops.push(TemplateLoop { lanes, taken, left });
    }
    let more = results.len() - own_results;
    let outputs = outputs.into_iter().chain([Port::new("lanes", &[more])]).collect();
    let mut graph = builder.finish(outputs, results);
    graph.inputs.push(Port::new("lanes", &[placeholders]));
    let mut template = LaneTemplate { graph, own_inputs, own_results, loops };
    template.drop_unread();
    (!template.loops.is_empty()).then_some(template)
}

impl LaneTemplate {
    /// LoopLanes and results of loops that nothing needs go, and loops of which nothing is left.
    fn drop_unread(&mut self) {
        let graph = &self.graph;
        let mut needed = Needed { graph, live: vec![false; graph.ops.len()], read: vec![false; self.all_inputs()] };
        needed.mark(graph.results[..self.own_results].iter().copied());
        let mut kept: Vec<TemplateLoop> = Vec::new();
        // what an earlier loop leaves may be taken by a later one
        for of in self.loops.iter().rev() {
            let is_read = |lane: &usize| of.left.iter().any(|(_, stand_ins)| needed.read[stand_ins[*lane]]);
            let lanes: Vec<usize> = (0..of.lanes).filter(is_read).collect();
            if lanes.is_empty() {
                continue;
            }
            let of_lanes = |all: &[usize]| lanes.iter().map(|lane| all[*lane]).collect::<Vec<usize>>();
            let left = of.left.iter().filter(|(_, stand_ins)| stand_ins.iter().any(|k| needed.read[*k]));
            let left: Vec<(usize, Vec<usize>)> = left.map(|(result, all)| (*result, of_lanes(all))).collect();
            needed.mark(left.iter().map(|(result, _)| graph.results[*result]));
            let taken = of.taken.iter().filter(|(stand_in, _)| needed.read[*stand_in]);
            let taken: Vec<(usize, Vec<usize>)> = taken.map(|(input, all)| (*input, of_lanes(all))).collect();
            needed.mark(taken.iter().flat_map(|(_, results)| results).map(|k| graph.results[*k]));
            kept.push(TemplateLoop { lanes: lanes.len(), taken, left });
        }
        kept.reverse();
        self.loops = kept;
        self.renumber();
        self.graph = dead_code(&self.graph);
    }

    /// Without results that no loop has any more.
    fn renumber(&mut self) {
        let mut results = self.graph.results[..self.own_results].to_vec();
        for of in &mut self.loops {
            for k in of.taken.iter_mut().flat_map(|(_, k)| k).chain(of.left.iter_mut().map(|(k, _)| k)) {
                results.push(self.graph.results[*k]);
                *k = results.len() - 1;
            }
        }
        *self.graph.outputs.last_mut().expect("the port of lanes") =
            Port::new("lanes", &[results.len() - self.own_results]);
        self.graph.results = results;
    }

    /// The values of all nodes at these inputs: in loops those of this lane.
    pub fn values(&self, inputs: &[f64], lane: usize) -> Vec<f64> {
        let mut all = inputs.to_vec();
        all.resize(self.all_inputs(), 0.0);
        for of in &self.loops {
            let before = values(&self.graph, &all);
            let of_lane = |all: &mut Vec<f64>, lane: usize| {
                of.taken.iter().for_each(|(k, results)| all[*k] = before[self.graph.results[results[lane]].index()]);
            };
            for lane in 0..of.lanes {
                of_lane(&mut all, lane);
                let at = values(&self.graph, &all);
                of.left.iter().for_each(|(result, k)| all[k[lane]] = at[self.graph.results[*result].index()]);
            }
            of_lane(&mut all, lane % of.lanes);
        }
        values(&self.graph, &all)
    }

    /// How many numbers its own inputs and those that stand for something have.
    fn all_inputs(&self) -> usize {
        self.own_inputs + self.graph.inputs.last().map_or(0, Port::len)
    }

    /// Its own inputs.
    pub fn inputs(&self) -> &[Port] {
        &self.graph.inputs[..self.graph.inputs.len() - 1]
    }

    /// The same of another graph that computes the same results.
    #[must_use]
    pub fn with(self, pass: impl FnOnce(Graph) -> Graph) -> LaneTemplate {
        LaneTemplate { graph: pass(self.graph), ..self }
    }

    /// The program in plain operations, with the rows of each loop one after the other.
    pub fn written_out(&self) -> Graph {
        let graph = &self.graph;
        let mut stand_ins: Vec<Option<StandIn>> = vec![None; self.all_inputs()];
        for (k, of) in self.loops.iter().enumerate() {
            of.taken.iter().for_each(|(input, _)| stand_ins[*input] = Some(StandIn::Taken(k)));
            for (result, placeholders) in &of.left {
                for (lane, input) in placeholders.iter().enumerate() {
                    stand_ins[*input] = Some(StandIn::Left { of: k, lane, result: *result });
                }
            }
        }
        // in which loop a node lies, or behind how many of them
        let mut places: Vec<NodeStage> = Vec::with_capacity(graph.ops.len());
        for op in &graph.ops {
            let own = match op {
                Op::Input(k) => match stand_ins[*k as usize] {
                    Some(StandIn::Taken(of)) => NodeStage::In(of),
                    Some(StandIn::Left { of, .. }) => NodeStage::Behind(of + 1),
                    None => NodeStage::Behind(0),
                },
                _ => NodeStage::Behind(0),
            };
            places.push(op.operands().map(|a| places[a.index()]).fold(own, NodeStage::and));
        }
        let (inputs, outputs) = (&graph.inputs[..graph.inputs.len() - 1], &graph.outputs[..graph.outputs.len() - 1]);
        let mut writer = LaneWriter {
            graph,
            stand_ins,
            out: Graph {
                inputs: inputs.to_vec(),
                outputs: outputs.to_vec(),
                sections: graph.sections.clone(),
                ..Graph::default()
            },
            written: vec![Vec::new(); graph.ops.len()],
        };
        for stage in 0..=self.loops.len() {
            graph.ids().filter(|id| places[id.index()] == NodeStage::Behind(stage)).for_each(|id| writer.write(id, 1));
            let Some(of) = self.loops.get(stage) else { continue };
            let mut rows = Vec::new();
            for id in graph.ids().filter(|id| places[id.index()] == NodeStage::In(stage)) {
                match graph.op(id) {
                    Op::Input(input) => {
                        let (_, results) = of.taken.iter().find(|(k, _)| *k == input as usize).expect("it is taken");
                        let of_lanes = results.iter().map(|k| writer.written[graph.results[*k].index()][0]);
                        writer.written[id.index()] = of_lanes.collect();
                    }
                    _ => {
                        writer.write(id, of.lanes);
                        rows.push(writer.written[id.index()].clone());
                    }
                }
            }
            if !rows.is_empty() && of.lanes >= FEWEST {
                writer.out.alike.push(Alike { lanes: LoopLanes::Columns(of.lanes), rows, is_rolled: false });
            }
        }
        let results = graph.results[..self.own_results].iter().map(|id| writer.written[id.index()][0]).collect();
        Graph { results, sines: graph.sines, ..writer.out }
    }
}

/// What results of a template need.
struct Needed<'a> {
    graph: &'a Graph,
    live: Vec<bool>,
    /// Which inputs are read.
    read: Vec<bool>,
}

impl Needed<'_> {
    fn mark(&mut self, results: impl Iterator<Item = NodeId>) {
        results.for_each(|id| self.live[id.index()] = true);
        for (k, op) in self.graph.ops.iter().enumerate().rev() {
            if !self.live[k] {
                continue;
            }
            op.operands().for_each(|a| self.live[a.index()] = true);
            if let Op::Input(input) = op {
                self.read[*input as usize] = true;
            }
        }
    }
}

/// What an input of a template stands for.
#[derive(Clone, Copy, Debug)]
enum StandIn {
    /// What the lanes of a loop take.
    Taken(usize),
    /// What a lane left.
    Left { of: usize, lane: usize, result: usize },
}

/// Where a node of a template is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NodeStage {
    /// By each lane of a loop.
    In(usize),
    /// Once, behind so many loops.
    Behind(usize),
}

impl NodeStage {
    fn and(self, other: NodeStage) -> NodeStage {
        match (self, other) {
            (NodeStage::Behind(a), NodeStage::Behind(b)) => NodeStage::Behind(a.max(b)),
            (NodeStage::In(a), NodeStage::Behind(b)) | (NodeStage::Behind(b), NodeStage::In(a)) => {
                assert!(b <= a, "a lane takes nothing of later loops");
                NodeStage::In(a)
            }
            (NodeStage::In(a), NodeStage::In(b)) => {
                assert!(a == b, "lanes of two loops meet behind them");
                NodeStage::In(a)
            }
        }
    }
}

struct LaneWriter<'a> {
    graph: &'a Graph,
    stand_ins: Vec<Option<StandIn>>,
    out: Graph,
    /// Of each node what it became: one node, or one per lane.
    written: Vec<Vec<NodeId>>,
}

impl LaneWriter<'_> {
    fn push(&mut self, op: Op, note: Note) -> NodeId {
        self.out.ops.push(op);
        self.out.notes.push(note);
        NodeId(self.out.ops.len() as u32 - 1)
    }

    /// A node, once for each lane.
    fn write(&mut self, id: NodeId, lanes: usize) {
        let (op, note) = (self.graph.op(id), self.graph.notes[id.index()]);
        if let Op::Input(k) = op {
            match self.stand_ins[k as usize] {
                Some(StandIn::Left { lane, result, .. }) => {
                    let of_lanes = &self.written[self.graph.results[result].index()];
                    self.written[id.index()] = vec![of_lanes[lane.min(of_lanes.len() - 1)]];
                    return;
                }
                Some(StandIn::Taken(_)) => return,
                None => {}
            }
        }
        for lane in 0..lanes {
            let of_lane = |a: NodeId| {
                let all = &self.written[a.index()];
                all[lane.min(all.len() - 1)]
            };
            let node = self.push(op.map(of_lane), note);
            self.written[id.index()].push(node);
        }
    }
}

#[cfg(test)]
mod tests;
