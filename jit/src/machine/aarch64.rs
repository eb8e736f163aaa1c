//! Instructions of aarch64 on its vector registers, alone (d, s) and as vectors (2d, 4s) (Arm Architecture Reference Manual for A-profile architecture, DDI 0487,
//! C4.1 and C7.2).
//!
//! A function takes the address of its frame in `x0` and that of its constants in `x1`, and uses `x9`, as the Procedure Call Standard has it (AAPCS64).
//! The lower halves of `v8` to `v15` belong to who calls: a function that takes them keeps them on the stack. Only loads and stores touch memory; what an instruction would read there
//! comes by way of `v31`.

use super::{Format, SIGNS};
use crate::allocation::{FusedForm, Instruction, MemoryPlace, ReadFrom};
use straightline_graph::expr::Binary;

/// The register that operands take from memory, and sums that grow beside their place: behind all that steps have.
pub(super) const ON_THE_WAY: u8 = 31;
/// So many registers belong to whoever is called.
const FREE: u8 = 23;
const FRAME: u32 = 0;
const CONSTANTS: u32 = 1;
/// What holds the number of a place that is far.
const INDEX: u32 = 9;

/// An instruction of a number alone, and that of vectors: of single precision, which [`DOUBLE`] changes.
type Opcode = [u32; 2];
const ROOT: Opcode = [0x1E21_C000, 0x6EA1_F800];
const NEGATE: Opcode = [0x1E21_4000, 0x6EA0_F800];
/// Vectors go as sixteen bytes, by `orr`.
const COPY: Opcode = [0x1E20_4000, 0x4EA0_1C00];
/// a·b + c of numbers alone; bits of its own change the signs.
const FUSED: u32 = 0x1F00_0000;
/// to + a·b and to − a·b.
const ACCUMULATE: [u32; 2] = [0x4E20_CC00, 0x4EA0_CC00];
/// Of double precision.
const DOUBLE: u32 = 1 << 22;
/// Of loads, which are stores without it.
const LOAD: u32 = 0x0040_0000;
/// movz x9 and movk x9 of the next sixteen bits.
const INDEX_LOW: u32 = 0xD280_0000 | INDEX;
const INDEX_HIGH: u32 = 0xF2A0_0000 | INDEX;
const RETURN: u32 = 0xD65F_03C0;
/// stp of d8 to d15: the first one makes room below the stack pointer.
const SAVE: [u32; 4] = [0x6DBC_27E8, 0x6D01_2FEA, 0x6D02_37EC, 0x6D03_3FEE];
/// ldp of d10 to d15, then of d8 and d9 with the room given back.
const RESTORE: [u32; 4] = [0x6D41_2FEA, 0x6D42_37EC, 0x6D43_3FEE, 0x6CC4_27E8];

/// The instructions of an operation.
fn opcode(op: Binary) -> Opcode {
    match op {
        Binary::Add => [0x1E20_2800, 0x4E20_D400],
        Binary::Sub => [0x1E20_3800, 0x4EA0_D400],
        Binary::Mul => [0x1E20_0800, 0x6E20_DC00],
        Binary::Div => [0x1E20_1800, 0x6E20_FC00],
    }
}

/// The bytes of a function of these instructions.
///
/// # Panics
/// If a frame or the constants have more than 2³² numbers.
pub fn function(instructions: &[Instruction], format: Format) -> Vec<u8> {
    let mut writer = A64Writer { words: Vec::new(), format };
    let saves = instructions.iter().filter_map(written).any(|register| (FREE..ON_THE_WAY).contains(&register));
    if saves {
        writer.words.extend(SAVE);
    }
    instructions.iter().for_each(|instruction| writer.write(*instruction));
    if saves {
        writer.words.extend(RESTORE);
    }
    writer.words.push(RETURN);
    writer.words.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// The register that an instruction writes.
fn written(instruction: &Instruction) -> Option<u8> {
    match *instruction {
        Instruction::Load { to, .. }
        | Instruction::Binary { to, .. }
        | Instruction::Root { to, .. }
        | Instruction::Negation { to, .. }
        | Instruction::Copy { to, .. }
        | Instruction::Fused { to, .. } => Some(to),
        Instruction::Store { .. } => None,
    }
}

/// The field of a register: those that belong to who calls come last.
fn field(register: u8) -> u32 {
    u32::from(match register {
        0..8 | ON_THE_WAY => register,
        8..FREE => register + 8,
        _ => register - FREE + 8,
    })
}

struct A64Writer {
    words: Vec<u32>,
    format: Format,
}

impl A64Writer {
    fn write(&mut self, instruction: Instruction) {
        match instruction {
            Instruction::Load { to, from } => self.access(LOAD, to, from),
            Instruction::Store { from, to } => self.access(0, from, MemoryPlace::Cell(to)),
            Instruction::Binary { op, to, a, b } => {
                let b = self.source(b);
                let word = self.of_numbers(opcode(op)) | field(b) << 16 | field(a) << 5 | field(to);
                self.words.push(word);
            }
            Instruction::Root { to, of } => {
                let of = self.source(of);
                self.of_one(ROOT, to, of);
            }
            Instruction::Negation { to, of } => self.of_one(NEGATE, to, of),
            Instruction::Copy { to, from } => self.copy(to, from),
            Instruction::Fused { form, to, a, b, negated, minus } => {
                let b = self.source(b);
                match (self.format.is_vector, form) {
                    (false, FusedForm::IntoTerm) => self.fused(to, [a, b, to], [negated, minus]),
                    (false, FusedForm::IntoFactor) => self.fused(to, [a, to, b], [negated, minus]),
                    (true, _) => self.fused_vectors((form, to), [a, b], [negated, minus]),
                }
            }
        }
    }

    /// ±a·b ± c of numbers alone, in a register of its own: the last bit says whether the signs differ.
    fn fused(&mut self, to: u8, [a, b, c]: [u8; 3], [negated, minus]: [bool; 2]) {
        let signs = u32::from(minus) << 21 | u32::from(negated != minus) << 15;
        self.words.push(FUSED | self.double() | signs | field(b) << 16 | field(c) << 10 | field(a) << 5 | field(to));
    }

    /// The same of vectors, whose sums replace their term: it changes its sign before.
    fn fused_vectors(&mut self, (form, to): (FusedForm, u8), [a, b]: [u8; 2], [negated, minus]: [bool; 2]) {
        match form {
            FusedForm::IntoTerm => {
                if minus {
                    self.of_one(NEGATE, to, to);
                }
                // and so has a factor that is in its register
                let changes = [a, b].iter().filter(|factor| minus && **factor == to).count();
                self.accumulate(to, [a, b], negated != (changes == 1));
            }
            FusedForm::IntoFactor => {
                match minus {
                    true => self.of_one(NEGATE, ON_THE_WAY, b),
                    false => self.copy(ON_THE_WAY, b),
                }
                self.accumulate(ON_THE_WAY, [a, to], negated);
                self.copy(to, ON_THE_WAY);
            }
        }
    }

    /// to ± a·b of vectors.
    fn accumulate(&mut self, to: u8, [a, b]: [u8; 2], negated: bool) {
        let word = ACCUMULATE[usize::from(negated)] | self.double();
        self.words.push(word | field(b) << 16 | field(a) << 5 | field(to));
    }

    /// An instruction on numbers of the format.
    fn of_numbers(&self, opcode: Opcode) -> u32 {
        opcode[usize::from(self.format.is_vector)] | self.double()
    }

    fn double(&self) -> u32 {
        if self.format.bytes == 8 {
            DOUBLE
        } else {
            0
        }
    }

    /// One of a single operand.
    fn of_one(&mut self, opcode: Opcode, to: u8, of: u8) {
        self.words.push(self.of_numbers(opcode) | field(of) << 5 | field(to));
    }

    fn copy(&mut self, to: u8, from: u8) {
        match self.format.is_vector {
            _ if to == from => {}
            true => self.words.push(COPY[1] | field(from) << 16 | field(from) << 5 | field(to)),
            false => self.of_one(COPY, to, from),
        }
    }

    /// An operand in a register.
    fn source(&mut self, source: ReadFrom) -> u8 {
        match source {
            ReadFrom::Register(register) => register,
            ReadFrom::Memory(place) => {
                self.access(LOAD, ON_THE_WAY, place);
                ON_THE_WAY
            }
        }
    }

    /// A load or a store: of the first places with the number of the place in the instruction, of others with it in a register.
    fn access(&mut self, direction: u32, register: u8, place: MemoryPlace) {
        let (base, at) = match place {
            MemoryPlace::Cell(at) => (FRAME, at),
            MemoryPlace::MinusZero => (CONSTANTS, 0),
            MemoryPlace::Constant(at) => (CONSTANTS, at + SIGNS),
        };
        let at = u32::try_from(at).expect("a frame has fewer than 2³² numbers");
        // places are counted in what is read
        let store = match (self.format.is_vector, self.format.bytes) {
            (true, _) => 0x3D80_0000,
            (false, 8) => 0xFD00_0000,
            (false, _) => 0xBD00_0000,
        };
        let registers = direction | base << 5 | field(register);
        if at < 1 << 12 {
            return self.words.push(store | registers | at << 10);
        }
        self.words.push(INDEX_LOW | (at & 0xFFFF) << 5);
        if at >> 16 != 0 {
            self.words.push(INDEX_HIGH | (at >> 16) << 5);
        }
        // [base, x9, lsl of the length]
        self.words.push((store - (1 << 24) + (1 << 21)) | 0x7800 | registers | INDEX << 16);
    }
}
