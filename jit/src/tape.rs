//! A program as a list of operations, in phases: what machine code and interpreter are made of.
//!
//! The order is that of the program's [`Schedule`]. Sines, cosines and signs are no instructions: they are computed between two phases by the functions that
//! compiled texts call, for all lanes at once. A phase is what can be computed before the next of these: an operation belongs to the phase behind
//! the last call that it needs, so that there are as few as can be.

use crate::number::Number;
use std::collections::HashMap;
use straightline_graph::expr::{Binary, Graph, NodeId, Op, Unary};
use straightline_graph::schedule::Schedule;

/// Where an operand comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operand {
    /// The input of that flat index.
    Input(usize),
    /// An entry of [`Tape::constants`].
    Constant(usize),
    /// What a step or a call makes.
    Value(usize),
}

/// An operation that is an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Of two numbers.
    Binary(Binary, Operand, Operand),
    /// √a.
    Root(Operand),
    /// −a.
    Negation(Operand),
}

impl Action {
    /// The operands, in order.
    pub fn operands(self) -> impl Iterator<Item = Operand> {
        let (a, b) = match self {
            Action::Binary(_, a, b) => (a, Some(b)),
            Action::Root(a) | Action::Negation(a) => (a, None),
        };
        std::iter::once(a).chain(b)
    }
}

/// An operation and the value that it makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TapeStep {
    /// What is done.
    pub action: Action,
    /// The value.
    pub value: usize,
}

/// What is computed between phases.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Call {
    /// Sine and cosine of the sum of these angles: two values.
    SinCos {
        /// The terms, at least one.
        angles: Vec<Operand>,
        /// The values of sine and cosine.
        values: [usize; 2],
    },
    /// The sign of a number.
    Sign {
        /// The number.
        of: Operand,
        /// The value.
        value: usize,
    },
}

impl Call {
    /// The operands, in order.
    pub fn operands(&self) -> &[Operand] {
        match self {
            Call::SinCos { angles, .. } => angles,
            Call::Sign { of, .. } => std::slice::from_ref(of),
        }
    }

    /// The values that it makes.
    pub fn values(&self) -> &[usize] {
        match self {
            Call::SinCos { values, .. } => values,
            Call::Sign { value, .. } => std::slice::from_ref(value),
        }
    }
}

/// Calls, and the operations that need no later ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Phase {
    /// Computed first; none in the first phase.
    pub calls: Vec<Call>,
    /// Then these, in order.
    pub steps: Vec<TapeStep>,
}

/// A program in numbers of one format.
#[derive(Clone, Debug, PartialEq)]
pub struct Tape<T> {
    /// How many scalars go in.
    pub inputs: usize,
    /// The constants, each once.
    pub constants: Vec<T>,
    /// How many values are made.
    pub values: usize,
    /// One after the other.
    pub phases: Vec<Phase>,
    /// What is put out.
    pub results: Vec<Operand>,
}

impl<T: Number> Tape<T> {
    /// The tape of a program whose values are all in this format.
    ///
    /// # Panics
    /// If the program is in mixed precision.
    pub fn new(graph: &Graph, schedule: &Schedule) -> Tape<T> {
        assert!(graph.formats.is_empty(), "a tape is in one format");
        let mut writer = TapeWriter {
            graph,
            tape: Tape {
                inputs: graph.inputs.iter().map(|port| port.len()).sum(),
                constants: Vec::new(),
                values: 0,
                phases: vec![Phase::default()],
                results: Vec::new(),
            },
            constants: HashMap::new(),
            operands: vec![None; graph.ops.len()],
            phase_of: Vec::new(),
        };
        schedule.parts.iter().flat_map(|part| &part.nodes).for_each(|id| writer.write(*id));
        writer.tape.results = graph.results.iter().map(|id| writer.operand(*id)).collect();
        writer.tape
    }

    /// Values that are needed outside the phase that makes them, by a call or as a result: they have to be in memory.
    pub fn is_kept(&self) -> Vec<bool> {
        let mut kept = vec![false; self.values];
        let mut keep = |operand: &Operand| {
            if let Operand::Value(value) = operand {
                kept[*value] = true;
            }
        };
        self.results.iter().for_each(&mut keep);
        let mut made_in = vec![0; self.values];
        for (k, phase) in self.phases.iter().enumerate() {
            for call in &phase.calls {
                call.operands().iter().for_each(&mut keep);
                call.values().iter().for_each(|value| {
                    made_in[*value] = k;
                    keep(&Operand::Value(*value));
                });
            }
            phase.steps.iter().for_each(|step| made_in[step.value] = k);
        }
        for (k, phase) in self.phases.iter().enumerate() {
            let operands = phase.steps.iter().flat_map(|step| step.action.operands());
            operands.filter(|o| matches!(o, Operand::Value(v) if made_in[*v] < k)).for_each(|o| keep(&o));
        }
        kept
    }
}

/// Puts the nodes of a graph on a tape.
struct TapeWriter<'a, T> {
    graph: &'a Graph,
    tape: Tape<T>,
    constants: HashMap<u64, usize>,
    /// What stands for each node that was written.
    operands: Vec<Option<Operand>>,
    /// The phase that makes each value.
    phase_of: Vec<usize>,
}

impl<T: Number> TapeWriter<'_, T> {
    fn operand(&mut self, id: NodeId) -> Operand {
        match (self.graph.op(id), self.operands[id.index()]) {
            (_, Some(operand)) => operand,
            (Op::Input(k), _) => Operand::Input(k as usize),
            (Op::Constant(c), _) => self.constant(T::constant(c.value())),
            (op, None) => panic!("a schedule has operands before their users: {op:?}"),
        }
    }

    fn constant(&mut self, constant: T) -> Operand {
        let constants = &mut self.tape.constants;
        let place = *self.constants.entry(constant.bits()).or_insert_with(|| {
            constants.push(constant);
            constants.len() - 1
        });
        Operand::Constant(place)
    }

    fn fresh(&mut self, phase: usize) -> usize {
        self.phase_of.push(phase);
        self.tape.values += 1;
        self.tape.values - 1
    }

    /// The first phase in which all of them are known.
    fn after(&self, operands: impl IntoIterator<Item = Operand>) -> usize {
        let of = |operand| if let Operand::Value(value) = operand { self.phase_of[value] } else { 0 };
        operands.into_iter().map(of).max().unwrap_or(0)
    }

    fn call(&mut self, phase: usize, call: Call) {
        if self.tape.phases.len() <= phase {
            self.tape.phases.resize_with(phase + 1, Phase::default);
        }
        self.tape.phases[phase].calls.push(call);
    }

    fn write(&mut self, id: NodeId) {
        let made = match self.graph.op(id) {
            Op::Input(_) | Op::Constant(_) | Op::AngleSum(..) => return,
            Op::SinCos(angle) => {
                let angles: Vec<Operand> = self.graph.angle_terms(angle).into_iter().map(|a| self.operand(a)).collect();
                let phase = self.after(angles.iter().copied()) + 1;
                let values = [self.fresh(phase), self.fresh(phase)];
                self.call(phase, Call::SinCos { angles, values });
                Operand::Value(values[0])
            }
            Op::Sin(pair) => self.operand(pair),
            Op::Cos(pair) => match self.operand(pair) {
                Operand::Value(sine) => Operand::Value(sine + 1),
                other => unreachable!("a pair of sine and cosine is a value: {other:?}"),
            },
            Op::Unary(Unary::Sign, a) => {
                let of = self.operand(a);
                let phase = self.after([of]) + 1;
                let value = self.fresh(phase);
                self.call(phase, Call::Sign { of, value });
                Operand::Value(value)
            }
            Op::Unary(Unary::Sqrt, a) => {
                let action = Action::Root(self.operand(a));
                self.step(action)
            }
            Op::Unary(Unary::Neg, a) => {
                let action = Action::Negation(self.operand(a));
                self.step(action)
            }
            Op::Binary(op, a, b) => {
                let action = Action::Binary(op, self.operand(a), self.operand(b));
                self.step(action)
            }
        };
        self.operands[id.index()] = Some(made);
    }

    fn step(&mut self, action: Action) -> Operand {
        let phase = self.after(action.operands());
        let value = self.fresh(phase);
        self.tape.phases[phase].steps.push(TapeStep { action, value });
        Operand::Value(value)
    }
}
