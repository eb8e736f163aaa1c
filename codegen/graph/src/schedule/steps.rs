//! A program as steps that may change places: what is computed or loaded in one go.
//!
//! * A product of single use is computed with the sum that takes it, whether the machine has an instruction for both or two: beside its sum it waits in
//!   no register, and a search over fewer steps finds more.
//! * Angles have their sines by one call, two of them, where the machine has such a call.
//! * An input is loaded once, where it is first needed; of an array the first four that are needed are loaded together. From then on it is a value
//!   like any other.
//! * A constant is loaded where it is needed, and again if its register was taken: it is no value that waits.

use super::machine::hosts;
use crate::expr::{Graph, NodeId, Op};

/// How many neighbours of an array are loaded together.
const TOGETHER: usize = 4;

/// What is computed or loaded in one go.
#[derive(Default)]
pub(super) struct MachineStep {
    /// The operations, in order; none of a load.
    pub nodes: Vec<NodeId>,
    /// The nodes whose values it takes, once each.
    reads: Vec<usize>,
    /// Those of them that take a register from where they are made to where they are last used: all but constants.
    pub values: Vec<usize>,
    /// The values that it makes for others.
    pub makes: Vec<usize>,
    /// Whether it is a call.
    pub is_call: bool,
}

/// A program as steps that may change places.
pub(super) struct Steps {
    /// The steps, in no order.
    pub steps: Vec<MachineStep>,
    /// Of every node the steps that take its value.
    pub users: Vec<Vec<usize>>,
    /// Of every step those that stand before it.
    pub before: Vec<Vec<usize>>,
    /// Of every step those that stand behind it.
    pub behind: Vec<Vec<usize>>,
    is_constant: Vec<bool>,
    step_of: Vec<usize>,
}

impl Steps {
    pub fn new(graph: &Graph, written: &[NodeId], sines_by_two: bool) -> Steps {
        let host = hosts(graph, written, true);
        let mut made = Steps {
            steps: Vec::new(),
            users: vec![Vec::new(); graph.ops.len()],
            before: Vec::new(),
            behind: Vec::new(),
            is_constant: graph.ops.iter().map(|op| matches!(op, Op::Constant(_))).collect(),
            step_of: vec![usize::MAX; graph.ops.len()],
        };
        // a call that has room for a second angle
        let mut alone: Option<usize> = None;
        for id in written.iter().filter(|id| host[id.index()].is_none()) {
            match graph.op(*id) {
                // a half belongs to its pair, which stands before it
                Op::Sin(pair) | Op::Cos(pair) => {
                    let step = made.step_of[pair.index()];
                    made.steps[step].nodes.push(*id);
                    made.steps[step].makes.push(id.index());
                    made.step_of[id.index()] = step;
                }
                Op::SinCos(angle) if sines_by_two && is_given(graph, angle) => match alone.take() {
                    Some(call) => {
                        made.steps[call].nodes.push(*id);
                        made.step_of[id.index()] = call;
                    }
                    None => {
                        alone = Some(made.steps.len());
                        made.push(step(graph, *id, &host));
                    }
                },
                _ => made.push(step(graph, *id, &host)),
            }
        }
        made.push_loads(graph);
        made.connect();
        made
    }

    fn push(&mut self, step: MachineStep) {
        let makes = step.nodes.iter().map(|id| id.index()).chain(step.makes.iter().copied());
        makes.for_each(|node| self.step_of[node] = self.steps.len());
        self.steps.push(step);
    }

    /// A step for the first inputs of each port that are needed beside calls, and one for each of the others.
    fn push_loads(&mut self, graph: &Graph) {
        let mut is_read = vec![false; graph.ops.len()];
        self.steps.iter().filter(|step| !step.is_call).flat_map(|step| &step.reads).for_each(|a| is_read[*a] = true);
        let mut inputs: Vec<(usize, usize)> = Vec::new();
        for (node, op) in graph.ops.iter().enumerate().filter(|(node, _)| is_read[*node]) {
            if let Op::Input(k) = op {
                inputs.push((*k as usize, node));
            }
        }
        inputs.sort_unstable();
        let (mut end, mut rest) = (0, inputs.as_slice());
        for port in &graph.inputs {
            end += port.len();
            let (of_port, behind) = rest.split_at(rest.partition_point(|(k, _)| *k < end));
            rest = behind;
            let (together, alone) = of_port.split_at(of_port.len().min(TOGETHER));
            for load in std::iter::once(together).chain(alone.chunks(1)).filter(|load| !load.is_empty()) {
                self.push(MachineStep {
                    makes: load.iter().map(|(_, node)| *node).collect(),
                    ..MachineStep::default()
                });
            }
        }
    }

    fn connect(&mut self) {
        let count = self.steps.len();
        (self.before, self.behind) = (vec![Vec::new(); count], vec![Vec::new(); count]);
        for (k, step) in self.steps.iter_mut().enumerate() {
            step.values = step.reads.iter().copied().filter(|a| !self.is_constant[*a]).collect();
            for a in &step.reads {
                self.users[*a].push(k);
                let maker = self.step_of[*a];
                if maker != usize::MAX && !self.before[k].contains(&maker) {
                    self.before[k].push(maker);
                    self.behind[maker].push(k);
                }
            }
        }
        for step in &mut self.steps {
            step.makes.retain(|node| !self.users[*node].is_empty());
        }
    }

    /// The steps of these operations in their order, each where its last operation stands, each load before the first that takes it.
    pub fn order(&self, nodes: &[NodeId]) -> Vec<usize> {
        let ends = nodes.iter().filter_map(|id| {
            let step = self.step_of[id.index()];
            let end =
                if self.steps[step].is_call { self.steps[step].nodes.first() } else { self.steps[step].nodes.last() };
            (end == Some(id)).then_some(step)
        });
        self.with_loads_late(ends)
    }

    /// The same order, each load before the first step that takes it: where the text reads it first.
    pub fn with_loads_late(&self, order: impl IntoIterator<Item = usize>) -> Vec<usize> {
        let mut placed = vec![false; self.steps.len()];
        let mut late = Vec::with_capacity(self.steps.len());
        for step in order.into_iter().filter(|step| !self.steps[*step].nodes.is_empty()) {
            for load in self.before[step].iter().filter(|before| self.steps[**before].nodes.is_empty()) {
                if !std::mem::replace(&mut placed[*load], true) {
                    late.push(*load);
                }
            }
            late.push(step);
        }
        late
    }

    /// The operations of these steps.
    pub fn nodes(&self, order: &[usize]) -> Vec<NodeId> {
        order.iter().flat_map(|step| self.steps[*step].nodes.iter().copied()).collect()
    }
}

/// Whether an angle is a sum of inputs, which are there wherever it is needed.
fn is_given(graph: &Graph, angle: NodeId) -> bool {
    graph.angle_terms(angle).into_iter().all(|term| matches!(graph.op(term), Op::Input(_)))
}

/// Which calls of sines take the angle of the next one along, in this order: of calls that stand together, the first, the third, …
pub(super) fn calls_of_two(graph: &Graph, order: &[NodeId]) -> Vec<bool> {
    let mut takes_next = vec![false; graph.ops.len()];
    let mut last: Option<NodeId> = None;
    for id in order {
        match graph.op(*id) {
            Op::Sin(_) | Op::Cos(_) => {}
            Op::SinCos(_) => match last.take() {
                Some(first) => takes_next[first.index()] = true,
                None => last = Some(*id),
            },
            _ => last = None,
        }
    }
    takes_next
}

/// The step that an operation ends.
fn step(graph: &Graph, id: NodeId, host: &[Option<NodeId>]) -> MachineStep {
    let mut step = MachineStep { is_call: matches!(graph.op(id), Op::SinCos(_)), ..MachineStep::default() };
    for a in graph.op(id).operands() {
        if host[a.index()] == Some(id) {
            step.nodes.push(a);
            step.reads.extend(graph.op(a).operands().map(NodeId::index));
        } else if step.is_call {
            // what a call takes of the inputs it does not keep
            let kept = graph.angle_terms(a).into_iter().filter(|term| !matches!(graph.op(*term), Op::Input(_)));
            step.reads.extend(kept.map(NodeId::index));
        } else {
            step.reads.push(a.index());
        }
    }
    step.nodes.push(id);
    if !step.is_call {
        step.makes.push(id.index());
    }
    step.reads.sort_unstable();
    step.reads.dedup();
    step
}

/// How many of so many registers a call leaves as they are.
pub(super) fn kept_by_calls(registers: usize) -> usize {
    registers.div_ceil(2)
}
