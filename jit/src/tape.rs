//! A program as a list of operations, in phases: what machine code and interpreter are made of.
//!
//! The order is that of the program's [`Schedule`]. Sines, cosines and signs are no instructions: they are computed between two phases by the functions that
//! compiled texts call, for all lanes at once. A phase is what can be computed before the next of these: an operation belongs to the phase behind
//! the last call that it needs, so that there are as few as can be.

use crate::number::Number;
use std::collections::HashMap;
use straightline_codegen::emit::fused::{fusions, Fused};
use straightline_graph::expr::{Binary, Graph, NodeId, Op, Unary};
use straightline_graph::schedule::Schedule;

/// Where an operand comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TapeOperand {
    /// The input of that flat index.
    Input(usize),
    /// An entry of [`ProgramTape::constants`].
    Constant(usize),
    /// What a step or a call makes.
    Value(usize),
}

/// An operation that is an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TapeAction {
    /// Of two numbers.
    Binary(Binary, TapeOperand, TapeOperand),
    /// √a.
    Root(TapeOperand),
    /// −a.
    Negation(TapeOperand),
    /// ±x·y ± c in one rounding.
    Fused {
        /// The factors.
        factors: [TapeOperand; 2],
        /// Whether the product is subtracted.
        negated: bool,
        /// The other term.
        other: TapeOperand,
        /// Whether that is subtracted.
        minus: bool,
    },
}

impl TapeAction {
    /// The operands, in order.
    pub fn operands(self) -> impl Iterator<Item = TapeOperand> {
        let all = match self {
            TapeAction::Binary(_, a, b) => [Some(a), Some(b), None],
            TapeAction::Root(a) | TapeAction::Negation(a) => [Some(a), None, None],
            TapeAction::Fused { factors: [x, y], other, .. } => [Some(x), Some(y), Some(other)],
        };
        all.into_iter().flatten()
    }
}

/// An operation and the value that it makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OperationStep {
    /// What is done.
    pub action: TapeAction,
    /// The value.
    pub value: usize,
}

/// What is computed between phases.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CallBetween {
    /// Sine and cosine of the sum of these angles: two values.
    SinCos {
        /// The terms, at least one.
        angles: Vec<TapeOperand>,
        /// The values of sine and cosine.
        values: [usize; 2],
    },
    /// The sign of a number.
    Sign {
        /// The number.
        of: TapeOperand,
        /// The value.
        value: usize,
    },
}

impl CallBetween {
    /// The operands, in order.
    pub fn operands(&self) -> &[TapeOperand] {
        match self {
            CallBetween::SinCos { angles, .. } => angles,
            CallBetween::Sign { of, .. } => std::slice::from_ref(of),
        }
    }

    /// The values that it makes.
    pub fn values(&self) -> &[usize] {
        match self {
            CallBetween::SinCos { values, .. } => values,
            CallBetween::Sign { value, .. } => std::slice::from_ref(value),
        }
    }
}

/// Calls, and the operations that need no later ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Phase {
    /// Computed first; none in the first phase.
    pub calls: Vec<CallBetween>,
    /// Then these, in order.
    pub steps: Vec<OperationStep>,
}

/// A program in numbers of one format.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramTape<T> {
    /// How many scalars go in.
    pub inputs: usize,
    /// The constants, each once.
    pub constants: Vec<T>,
    /// How many values are made.
    pub values: usize,
    /// One after the other.
    pub phases: Vec<Phase>,
    /// What is put out.
    pub results: Vec<TapeOperand>,
    /// Whether products go into sums in one rounding, and sines are those that take them so.
    pub fused: bool,
}

impl<T: Number> ProgramTape<T> {
    /// The tape of a program whose values are all in this format; fused where its fused text is.
    ///
    /// # Panics
    /// If the program is in mixed precision.
    pub fn new(graph: &Graph, schedule: &Schedule, fused: bool) -> ProgramTape<T> {
        assert!(graph.formats.is_empty(), "a tape is in one format");
        let mut writer = TapeWriter {
            graph,
            tape: ProgramTape {
                inputs: graph.inputs.iter().map(|port| port.len()).sum(),
                constants: Vec::new(),
                values: 0,
                phases: vec![Phase::default()],
                results: Vec::new(),
                fused,
            },
            constants: HashMap::new(),
            operands: vec![None; graph.ops.len()],
            phase_of: Vec::new(),
        };
        for part in &schedule.parts {
            let (sums, absorbed) = if fused { fusions(graph, part) } else { (Vec::new(), Vec::new()) };
            for id in part.nodes.iter().filter(|id| !absorbed.get(id.index()).is_some_and(|absorbed| *absorbed)) {
                match sums.get(id.index()).copied().flatten() {
                    Some(sum) => writer.write_fused(*id, sum),
                    None => writer.write(*id),
                }
            }
        }
        writer.tape.results = graph.results.iter().map(|id| writer.operand(*id)).collect();
        writer.tape
    }

    /// Values that are needed outside the phase that makes them, by a call or as a result: they have to be in memory.
    pub fn is_kept(&self) -> Vec<bool> {
        let mut kept = vec![false; self.values];
        let mut keep = |operand: &TapeOperand| {
            if let TapeOperand::Value(value) = operand {
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
                    keep(&TapeOperand::Value(*value));
                });
            }
            phase.steps.iter().for_each(|step| made_in[step.value] = k);
        }
        for (k, phase) in self.phases.iter().enumerate() {
            let operands = phase.steps.iter().flat_map(|step| step.action.operands());
            operands.filter(|o| matches!(o, TapeOperand::Value(v) if made_in[*v] < k)).for_each(|o| keep(&o));
        }
        kept
    }
}

/// Puts the nodes of a graph on a tape.
struct TapeWriter<'a, T> {
    graph: &'a Graph,
    tape: ProgramTape<T>,
    constants: HashMap<u64, usize>,
    /// What stands for each node that was written.
    operands: Vec<Option<TapeOperand>>,
    /// The phase that makes each value.
    phase_of: Vec<usize>,
}

impl<T: Number> TapeWriter<'_, T> {
    fn operand(&mut self, id: NodeId) -> TapeOperand {
        match (self.graph.op(id), self.operands[id.index()]) {
            (_, Some(operand)) => operand,
            (Op::Input(k), _) => TapeOperand::Input(k as usize),
            (Op::Constant(c), _) => self.constant(T::constant(c.value())),
            (op, None) => panic!("a schedule has operands before their users: {op:?}"),
        }
    }

    fn constant(&mut self, constant: T) -> TapeOperand {
        let constants = &mut self.tape.constants;
        let place = *self.constants.entry(constant.bits()).or_insert_with(|| {
            constants.push(constant);
            constants.len() - 1
        });
        TapeOperand::Constant(place)
    }

    fn fresh(&mut self, phase: usize) -> usize {
        self.phase_of.push(phase);
        self.tape.values += 1;
        self.tape.values - 1
    }

    /// The first phase in which all of them are known.
    fn after(&self, operands: impl IntoIterator<Item = TapeOperand>) -> usize {
        let of = |operand| if let TapeOperand::Value(value) = operand { self.phase_of[value] } else { 0 };
        operands.into_iter().map(of).max().unwrap_or(0)
    }

    fn call(&mut self, phase: usize, call: CallBetween) {
        if self.tape.phases.len() <= phase {
            self.tape.phases.resize_with(phase + 1, Phase::default);
        }
        self.tape.phases[phase].calls.push(call);
    }

    fn write(&mut self, id: NodeId) {
        let made = match self.graph.op(id) {
            Op::Input(_) | Op::Constant(_) | Op::AngleSum(..) => return,
            Op::SinCos(angle) => {
                let angles: Vec<TapeOperand> =
                    self.graph.angle_terms(angle).into_iter().map(|a| self.operand(a)).collect();
                let phase = self.after(angles.iter().copied()) + 1;
                let values = [self.fresh(phase), self.fresh(phase)];
                self.call(phase, CallBetween::SinCos { angles, values });
                TapeOperand::Value(values[0])
            }
            Op::Sin(pair) => self.operand(pair),
            Op::Cos(pair) => match self.operand(pair) {
                TapeOperand::Value(sine) => TapeOperand::Value(sine + 1),
                other => unreachable!("a pair of sine and cosine is a value: {other:?}"),
            },
            Op::Unary(Unary::Sign, a) => {
                let of = self.operand(a);
                let phase = self.after([of]) + 1;
                let value = self.fresh(phase);
                self.call(phase, CallBetween::Sign { of, value });
                TapeOperand::Value(value)
            }
            Op::Unary(Unary::Sqrt, a) => {
                let action = TapeAction::Root(self.operand(a));
                self.step(action)
            }
            Op::Unary(Unary::Neg, a) => {
                let action = TapeAction::Negation(self.operand(a));
                self.step(action)
            }
            Op::Binary(op, a, b) => {
                let action = TapeAction::Binary(op, self.operand(a), self.operand(b));
                self.step(action)
            }
        };
        self.operands[id.index()] = Some(made);
    }

    fn write_fused(&mut self, id: NodeId, sum: Fused) {
        let Fused { negated, factors: (x, y), other: (other, minus) } = sum;
        let factors = [self.operand(x), self.operand(y)];
        let action = TapeAction::Fused { factors, negated, other: self.operand(other), minus };
        self.operands[id.index()] = Some(self.step(action));
    }

    fn step(&mut self, action: TapeAction) -> TapeOperand {
        let phase = self.after(action.operands());
        let value = self.fresh(phase);
        self.tape.phases[phase].steps.push(OperationStep { action, value });
        TapeOperand::Value(value)
    }
}
