//! Registers for the steps of a phase.
//!
//! Steps stay in their order. What has no register left is written to memory when the register is wanted for another number, and the number whose next use
//! is furthest goes (Belády 1966: the fewest loads, as the order is known). Inputs, constants and what other phases need are in memory anyway, and go without a
//! store. An operand that is used once more only, here, is taken from memory by the instruction itself.

use crate::number::Number;
use crate::tape::{Action, Operand, Phase, Tape, TapeStep};
use straightline_graph::expr::Binary;

/// A place in memory: of a frame, which is what a call works on, or of the constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// So many numbers of all lanes from the beginning of the frame.
    Cell(usize),
    /// A constant.
    Constant(usize),
    /// −0, as long as a register.
    MinusZero,
}

/// What an instruction reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A register.
    Register(u8),
    /// Memory.
    Memory(Place),
}

/// An instruction, of all lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction {
    /// Memory to a register.
    Load {
        /// The register.
        to: u8,
        /// The memory.
        from: Place,
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
        b: Source,
    },
    /// A square root.
    Root {
        /// The register of the result.
        to: u8,
        /// Of what.
        of: Source,
    },
    /// A sign changed, by the bits of −0.
    Negation {
        /// The register of the result.
        to: u8,
        /// Of what.
        of: u8,
    },
}

/// The instructions of all phases of a tape, and where its numbers are in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AllocatedTape {
    /// Of each phase.
    pub phases: Vec<Vec<Instruction>>,
    /// How many cells a frame has: inputs first.
    pub cells: usize,
    /// The cell of each value that other phases, calls or results need.
    kept: Vec<Option<usize>>,
}

impl AllocatedTape {
    /// For a machine with so many registers, at least three.
    ///
    /// # Panics
    /// If there are fewer registers.
    pub fn new<T: Number>(tape: &Tape<T>, registers: usize) -> AllocatedTape {
        assert!(registers >= 3, "two operands and a number that waits");
        let mut cells = tape.inputs;
        let mut cell = || {
            cells += 1;
            cells - 1
        };
        let kept: Vec<Option<usize>> = tape.is_kept().into_iter().map(|kept| kept.then(&mut cell)).collect();
        let first_spare = cells;
        let mut all = AllocatedTape { phases: Vec::new(), cells, kept };
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
    pub fn place(&self, operand: Operand) -> Place {
        match operand {
            Operand::Input(k) => Place::Cell(k),
            Operand::Constant(k) => Place::Constant(k),
            Operand::Value(k) => Place::Cell(self.kept[k].expect("what is read from outside is kept")),
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
    held: Vec<Option<Operand>>,
    /// Cells that are free again, and the first that was never used.
    spare: Vec<usize>,
    next_spare: usize,
    /// Cells that the next instruction may read, and that are free behind it: what makes room for its result is stored before it.
    read_last: Vec<usize>,
    instructions: Vec<Instruction>,
}

impl<'a> Allocator<'a> {
    fn new<T: Number>(
        tape: &Tape<T>,
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

    fn index(&self, operand: Operand) -> usize {
        match operand {
            Operand::Input(k) => k,
            Operand::Constant(k) => self.inputs + k,
            Operand::Value(k) => self.inputs + self.constants + k,
        }
    }

    fn register(&self, operand: Operand) -> Option<u8> {
        self.register_of[self.index(operand)]
    }

    fn next_use(&self, operand: Operand) -> Option<usize> {
        self.uses[self.index(operand)].last().copied()
    }

    /// Where an operand is in memory, if it is.
    fn memory(&self, operand: Operand) -> Option<Place> {
        match operand {
            Operand::Input(k) => Some(Place::Cell(k)),
            Operand::Constant(k) => Some(Place::Constant(k)),
            Operand::Value(k) => self.cell_of[k].map(Place::Cell),
        }
    }

    fn expect_memory(&self, operand: Operand) -> Place {
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
        if let (None, Operand::Value(value)) = (self.memory(held), held) {
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
    fn release(&mut self, operand: Operand) {
        let place = self.index(operand);
        if let Some(register) = self.register_of[place].take() {
            self.held[usize::from(register)] = None;
        }
    }

    fn put(&mut self, operand: Operand, register: u8) {
        let place = self.index(operand);
        self.register_of[place] = Some(register);
        self.held[usize::from(register)] = Some(operand);
    }

    /// An operand in a register.
    fn loaded(&mut self, operand: Operand, taken: &[u8]) -> u8 {
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
    fn source(&mut self, operand: Operand, taken: &[u8]) -> Source {
        if let Some(register) = self.register(operand) {
            return Source::Register(register);
        }
        // the last entry is the use that is looked at
        let uses = &self.uses[self.index(operand)];
        let again = uses.len().checked_sub(2).map(|k| uses[k]);
        let held = self.held.iter().enumerate().filter(|(k, _)| !taken.contains(&(*k as u8)));
        let furthest = held.map(|(_, held)| held.map_or(usize::MAX, |h| self.next_use(h).unwrap_or(usize::MAX))).max();
        match again {
            Some(again) if furthest.is_some_and(|furthest| again < furthest) => {
                Source::Register(self.loaded(operand, taken))
            }
            _ => Source::Memory(self.expect_memory(operand)),
        }
    }

    /// An operand was used; what is not used again gives its room back.
    fn used(&mut self, operand: Operand) {
        let place = self.index(operand);
        self.uses[place].pop();
        if !self.uses[place].is_empty() {
            return;
        }
        self.release(operand);
        if let Operand::Value(value) = operand {
            if self.kept[value].is_none() {
                self.read_last.extend(self.cell_of[value].take());
            }
        }
    }

    fn step(&mut self, step: &TapeStep) {
        let instruction: Box<dyn Fn(u8) -> Instruction> = match step.action {
            Action::Binary(op, a, b) => {
                let swaps = op.row().commutes && self.register(a).is_none() && self.register(b).is_some();
                let (first, second) = if swaps { (b, a) } else { (a, b) };
                let a = self.loaded(first, &[]);
                let b = self.source(second, &[a]);
                self.used(first);
                self.used(second);
                Box::new(move |to| Instruction::Binary { op, to, a, b })
            }
            Action::Root(a) => {
                let of = self.source(a, &[]);
                self.used(a);
                Box::new(move |to| Instruction::Root { to, of })
            }
            Action::Negation(a) => {
                let of = self.loaded(a, &[]);
                self.used(a);
                Box::new(move |to| Instruction::Negation { to, of })
            }
        };
        // operands are read before the result is written: it may take their registers
        let to = self.take(&[]);
        self.instructions.push(instruction(to));
        self.spare.append(&mut self.read_last);
        let value = Operand::Value(step.value);
        self.put(value, to);
        if let Some(cell) = self.kept[step.value] {
            self.instructions.push(Instruction::Store { from: to, to: cell });
            self.cell_of[step.value] = Some(cell);
        }
        if self.next_use(value).is_none() {
            self.release(value);
        }
    }
}
