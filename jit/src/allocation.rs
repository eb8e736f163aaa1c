//! Registers for the steps of a phase.
//!
//! Steps stay in their order. What has no register left is written to memory when the register is wanted for another number, and the number whose next use
//! is furthest goes (Belády 1966: the fewest loads, as the order is known). Inputs, constants and what other phases need are in memory anyway, and go without a
//! store. An operand that is used once more only, here, is taken from memory by the instruction itself.

use crate::number::Number;
use crate::tape::{OperationStep, Phase, ProgramTape, TapeAction, TapeOperand};
use straightline_graph::expr::Binary;

/// A place in memory: of a frame, which is what a call works on, or of the constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryPlace {
    /// So many numbers of all lanes from the beginning of the frame.
    Cell(usize),
    /// A constant.
    Constant(usize),
    /// −0, as long as a register.
    MinusZero,
}

/// What an instruction reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadFrom {
    /// A register.
    Register(u8),
    /// Memory.
    Memory(MemoryPlace),
}

/// An instruction, of all lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction {
    /// Memory to a register.
    Load {
        /// The register.
        to: u8,
        /// The memory.
        from: MemoryPlace,
    },
    /// A register to a cell.
    Store {
        /// The register.
        from: u8,
        /// The cell.
        to: usize,
    },
    /// An operation on two numbers.
    Binary {
        /// Which.
        op: Binary,
        /// The register of the result.
        to: u8,
        /// The first operand.
        a: u8,
        /// The second one.
        b: ReadFrom,
    },
    /// A square root.
    Root {
        /// The register of the result.
        to: u8,
        /// Of what.
        of: ReadFrom,
    },
    /// A sign changed, by the bits of −0.
    Negation {
        /// The register of the result.
        to: u8,
        /// Of what.
        of: u8,
    },
    /// A register to another.
    Copy {
        /// The register of the result.
        to: u8,
        /// Of what.
        from: u8,
    },
    /// A product and a sum in one rounding, in the register of an operand.
    Fused {
        /// Which operand the register of the result holds.
        form: FusedForm,
        /// The register of the result, and of that operand.
        to: u8,
        /// A factor.
        a: u8,
        /// The third operand.
        b: ReadFrom,
        /// Whether the product is subtracted.
        negated: bool,
        /// Whether the other term is subtracted.
        minus: bool,
    },
}

/// Which operand of a product and a sum gives its register to the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FusedForm {
    /// The sum's other term: to = ±a·b ± to.
    IntoTerm,
    /// A factor: to = ±a·to ± b.
    IntoFactor,
}

/// The instructions of all phases of a tape, and where its numbers are in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AllocatedProgram {
    /// Of each phase.
    pub phases: Vec<Vec<Instruction>>,
    /// How many cells a frame has: inputs first.
    pub cells: usize,
    /// The cell of each value that other phases, calls or results need.
    kept: Vec<Option<usize>>,
}

impl AllocatedProgram {
    /// For a machine with so many registers, at least four.
    ///
    /// # Panics
    /// If there are fewer registers.
    pub fn new<T: Number>(tape: &ProgramTape<T>, registers: usize) -> AllocatedProgram {
        assert!(registers >= 4, "three operands and a number that waits");
        let mut cells = tape.inputs;
        let mut cell = || {
            cells += 1;
            cells - 1
        };
        let kept: Vec<Option<usize>> = tape.is_kept().into_iter().map(|kept| kept.then(&mut cell)).collect();
        let first_spare = cells;
        let mut all = AllocatedProgram { phases: Vec::new(), cells, kept };
        for phase in &tape.phases {
            let mut allocator = Allocator::new(tape, phase, (&all.kept, first_spare), registers);
            phase.steps.iter().for_each(|step| allocator.step(step));
            all.cells = all.cells.max(allocator.next_spare);
            all.phases.push(allocator.instructions);
        }
        all
    }

    /// Where an operand is for calls, and as a result.
    ///
    /// # Panics
    /// If it is a value that only one phase needs.
    pub fn place(&self, operand: TapeOperand) -> MemoryPlace {
        match operand {
            TapeOperand::Input(k) => MemoryPlace::Cell(k),
            TapeOperand::Constant(k) => MemoryPlace::Constant(k),
            TapeOperand::Value(k) => MemoryPlace::Cell(self.kept[k].expect("what is read from outside is kept")),
        }
    }
}

/// Hands registers out, step after step.
struct Allocator<'a> {
    inputs: usize,
    constants: usize,
    kept: &'a [Option<usize>],
    /// Of each operand, the steps that use it, the next one last.
    uses: Vec<Vec<usize>>,
    /// Of each operand, its register.
    register_of: Vec<Option<u8>>,
    /// Of each value, the cell that holds it.
    cell_of: Vec<Option<usize>>,
    /// What each register holds.
    held: Vec<Option<TapeOperand>>,
    /// Cells that are free again, and the first that was never used.
    spare: Vec<usize>,
    next_spare: usize,
    /// Cells that the next instruction may read, and that are free behind it: what makes room for its result is stored before it.
    read_last: Vec<usize>,
    instructions: Vec<Instruction>,
}

impl<'a> Allocator<'a> {
    fn new<T: Number>(
        tape: &ProgramTape<T>,
        phase: &Phase,
        (kept, next_spare): (&'a [Option<usize>], usize),
        registers: usize,
    ) -> Allocator<'a> {
        let (inputs, constants) = (tape.inputs, tape.constants.len());
        let operands = inputs + constants + tape.values;
        let mut cell_of = kept.to_vec();
        // what the phase makes is in no cell before it is made
        phase.steps.iter().for_each(|step| cell_of[step.value] = None);
        let mut all = Allocator {
            inputs,
            constants,
            kept,
            uses: vec![Vec::new(); operands],
            register_of: vec![None; operands],
            cell_of,
            held: vec![None; registers],
            spare: Vec::new(),
            next_spare,
            read_last: Vec::new(),
            instructions: Vec::new(),
        };
        for (k, step) in phase.steps.iter().enumerate().rev() {
            step.action.operands().for_each(|operand| {
                let place = all.index(operand);
                all.uses[place].push(k);
            });
        }
        all
    }

    fn index(&self, operand: TapeOperand) -> usize {
        match operand {
            TapeOperand::Input(k) => k,
            TapeOperand::Constant(k) => self.inputs + k,
            TapeOperand::Value(k) => self.inputs + self.constants + k,
        }
    }

    fn register(&self, operand: TapeOperand) -> Option<u8> {
        self.register_of[self.index(operand)]
    }

    fn next_use(&self, operand: TapeOperand) -> Option<usize> {
        self.uses[self.index(operand)].last().copied()
    }

    /// Where an operand is in memory, if it is.
    fn memory(&self, operand: TapeOperand) -> Option<MemoryPlace> {
        match operand {
            TapeOperand::Input(k) => Some(MemoryPlace::Cell(k)),
            TapeOperand::Constant(k) => Some(MemoryPlace::Constant(k)),
            TapeOperand::Value(k) => self.cell_of[k].map(MemoryPlace::Cell),
        }
    }

    fn expect_memory(&self, operand: TapeOperand) -> MemoryPlace {
        self.memory(operand).expect("what is in no register is in memory")
    }

    /// A register for another number, none of `taken`.
    fn take(&mut self, taken: &[u8]) -> u8 {
        if let Some(free) = self.held.iter().position(Option::is_none) {
            return free as u8;
        }
        let waits = |register: &u8| {
            let held = self.held[usize::from(*register)].expect("no register is free");
            self.next_use(held).unwrap_or(usize::MAX)
        };
        let candidates = (0..self.held.len() as u8).filter(|register| !taken.contains(register));
        let furthest = candidates.max_by_key(waits).expect("there are more registers than operands");
        let held = self.held[usize::from(furthest)].expect("no register is free");
        if let (None, TapeOperand::Value(value)) = (self.memory(held), held) {
            let cell = self.spare.pop().unwrap_or_else(|| {
                self.next_spare += 1;
                self.next_spare - 1
            });
            self.cell_of[value] = Some(cell);
            self.instructions.push(Instruction::Store { from: furthest, to: cell });
        }
        self.release(held);
        furthest
    }

    /// Its register, if it has one, is free.
    fn release(&mut self, operand: TapeOperand) {
        let place = self.index(operand);
        if let Some(register) = self.register_of[place].take() {
            self.held[usize::from(register)] = None;
        }
    }

    fn put(&mut self, operand: TapeOperand, register: u8) {
        let place = self.index(operand);
        self.register_of[place] = Some(register);
        self.held[usize::from(register)] = Some(operand);
    }

    /// An operand in a register.
    fn loaded(&mut self, operand: TapeOperand, taken: &[u8]) -> u8 {
        if let Some(register) = self.register(operand) {
            return register;
        }
        let from = self.expect_memory(operand);
        let to = self.take(taken);
        self.instructions.push(Instruction::Load { to, from });
        self.put(operand, to);
        to
    }

    /// An operand where it is; in a register, if it is used again before what all registers hold.
    fn source(&mut self, operand: TapeOperand, taken: &[u8]) -> ReadFrom {
        if let Some(register) = self.register(operand) {
            return ReadFrom::Register(register);
        }
        // the last entry is the use that is looked at
        let uses = &self.uses[self.index(operand)];
        let again = uses.len().checked_sub(2).map(|k| uses[k]);
        let held = self.held.iter().enumerate().filter(|(k, _)| !taken.contains(&(*k as u8)));
        let furthest = held.map(|(_, held)| held.map_or(usize::MAX, |h| self.next_use(h).unwrap_or(usize::MAX))).max();
        match again {
            Some(again) if furthest.is_some_and(|furthest| again < furthest) => {
                ReadFrom::Register(self.loaded(operand, taken))
            }
            _ => ReadFrom::Memory(self.expect_memory(operand)),
        }
    }

    /// An operand was used; what is not used again gives its room back.
    fn used(&mut self, operand: TapeOperand) {
        let place = self.index(operand);
        self.uses[place].pop();
        if !self.uses[place].is_empty() {
            return;
        }
        self.release(operand);
        if let TapeOperand::Value(value) = operand {
            if self.kept[value].is_none() {
                self.read_last.extend(self.cell_of[value].take());
            }
        }
    }

    /// Whether an operand is used by this step alone from now on; `others` are the other operands of the step.
    fn ends_here(&self, operand: TapeOperand, others: [TapeOperand; 2]) -> bool {
        self.uses[self.index(operand)].len() == 1 && !others.contains(&operand)
    }

    /// A product and a sum: the register of its result, in which one of the operands has been.
    fn fused(&mut self, [x, y]: [TapeOperand; 2], other: TapeOperand, [negated, minus]: [bool; 2]) -> u8 {
        let gives = |all: &Self, operand, others| all.register(operand).filter(|_| all.ends_here(operand, others));
        let used = |all: &mut Self| [x, y, other].into_iter().for_each(|operand| all.used(operand));
        let term = gives(self, other, [x, y]);
        // a term that stays in its register is copied, unless a factor gives its own
        let factors = [(x, y), (y, x)];
        let factor = match term.is_none() && self.register(other).is_some() {
            true => factors.into_iter().find_map(|(f, g)| Some((gives(self, f, [g, other])?, g))),
            false => None,
        };
        if let Some((to, factor)) = factor {
            let a = self.loaded(factor, &[to, self.register(other).expect("it stays")]);
            let b = self.source(other, &[to, a]);
            used(self);
            self.instructions.push(Instruction::Fused { form: FusedForm::IntoFactor, to, a, b, negated, minus });
            return to;
        }
        let mut taken: Vec<u8> = term.into_iter().collect();
        let (first, second) = if self.register(x).is_none() { (y, x) } else { (x, y) };
        let a = self.loaded(first, &taken);
        taken.push(a);
        let b = self.source(second, &taken);
        taken.extend(if let ReadFrom::Register(b) = b { Some(b) } else { None });
        let to = match term {
            Some(register) => register,
            None => {
                let from = self.register(other);
                taken.extend(from);
                let to = self.take(&taken);
                self.instructions.push(match from {
                    Some(from) => Instruction::Copy { to, from },
                    None => Instruction::Load { to, from: self.expect_memory(other) },
                });
                to
            }
        };
        used(self);
        self.instructions.push(Instruction::Fused { form: FusedForm::IntoTerm, to, a, b, negated, minus });
        to
    }

    fn step(&mut self, step: &OperationStep) {
        let to = match step.action {
            TapeAction::Fused { factors, negated, other, minus } => self.fused(factors, other, [negated, minus]),
            action => self.plain(action),
        };
        self.spare.append(&mut self.read_last);
        let value = TapeOperand::Value(step.value);
        self.put(value, to);
        if let Some(cell) = self.kept[step.value] {
            self.instructions.push(Instruction::Store { from: to, to: cell });
            self.cell_of[step.value] = Some(cell);
        }
        if self.next_use(value).is_none() {
            self.release(value);
        }
    }

    /// An operation whose result has a register of its own: which.
    fn plain(&mut self, action: TapeAction) -> u8 {
        let instruction: Box<dyn Fn(u8) -> Instruction> = match action {
            TapeAction::Binary(op, a, b) => {
                let swaps = op.row().commutes && self.register(a).is_none() && self.register(b).is_some();
                let (first, second) = if swaps { (b, a) } else { (a, b) };
                let a = self.loaded(first, &[]);
                let b = self.source(second, &[a]);
                self.used(first);
                self.used(second);
                Box::new(move |to| Instruction::Binary { op, to, a, b })
            }
            TapeAction::Root(a) => {
                let of = self.source(a, &[]);
                self.used(a);
                Box::new(move |to| Instruction::Root { to, of })
            }
            TapeAction::Negation(a) => {
                let of = self.loaded(a, &[]);
                self.used(a);
                Box::new(move |to| Instruction::Negation { to, of })
            }
            TapeAction::Fused { .. } => unreachable!("its result has the register of an operand"),
        };
        // operands are read before the result is written: it may take their registers
        let to = self.take(&[]);
        self.instructions.push(instruction(to));
        to
    }
}
