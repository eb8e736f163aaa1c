//! Instructions of x86-64 with AVX, in their VEX encoding (Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2, 2.3).
//!
//! A function takes the address of its frame in `rdi` and that of its constants in `rsi`, as the System V ABI has it, and uses all sixteen vector registers, which belong to whoever is called.

use crate::allocation::{Instruction, Place, Source};
use straightline_graph::expr::Binary;

/// Registers of vectors.
pub const REGISTERS: usize = 16;
/// Bytes of a vector.
const VECTOR: usize = 32;
const FRAME: u8 = 7;
const CONSTANTS: u8 = 6;
/// So many times −0 stand before the constants: what instructions on whole registers read of it.
pub const SIGNS: usize = 4;
const MOVE: u8 = 0x10;
const MOVE_BACK: u8 = 0x11;
const ROOT: u8 = 0x51;
const XOR: u8 = 0x57;

/// Numbers of a format, alone or as many as a vector holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Bytes of a number: four or eight.
    pub bytes: usize,
    /// Whether they are vectors.
    pub is_vector: bool,
}

impl Format {
    /// How many states are computed at once.
    pub fn lanes(self) -> usize {
        match self.is_vector {
            true => VECTOR / self.bytes,
            false => 1,
        }
    }

    /// The field `pp` of operations on these numbers: none, 66, F3 or F2.
    fn prefix(self) -> u8 {
        match (self.is_vector, self.bytes) {
            (true, 4) => 0,
            (true, _) => 1,
            (false, 4) => 2,
            (false, _) => 3,
        }
    }
}

/// The bytes of a function of these instructions.
///
/// # Panics
/// If a frame or the constants are longer than two gigabytes.
pub fn function(instructions: &[Instruction], format: Format) -> Vec<u8> {
    let mut writer = Writer { bytes: Vec::new(), format };
    instructions.iter().for_each(|instruction| writer.instruction(*instruction));
    if format.is_vector {
        writer.bytes.extend([0xC5, 0xF8, 0x77]); // vzeroupper
    }
    writer.bytes.push(0xC3); // ret
    writer.bytes
}

/// The byte of an operation's opcode.
fn opcode(op: Binary) -> u8 {
    match op {
        Binary::Add => 0x58,
        Binary::Mul => 0x59,
        Binary::Sub => 0x5C,
        Binary::Div => 0x5E,
    }
}

struct Writer {
    bytes: Vec<u8>,
    format: Format,
}

impl Writer {
    fn instruction(&mut self, instruction: Instruction) {
        let prefix = self.format.prefix();
        match instruction {
            Instruction::Load { to, from } => self.encoded(prefix, MOVE, (to, 0), Source::Memory(from)),
            Instruction::Store { from, to } => {
                self.encoded(prefix, MOVE_BACK, (from, 0), Source::Memory(Place::Cell(to)));
            }
            Instruction::Binary { op, to, a, b } => self.encoded(prefix, opcode(op), (to, a), b),
            // of a number alone the rest of the register comes from the second one; of vectors there is none
            Instruction::Root { to, of } if self.format.is_vector => self.encoded(prefix, ROOT, (to, 0), of),
            Instruction::Root { to, of } => self.encoded(prefix, ROOT, (to, to), of),
            // of a number alone, too, on whole registers
            Instruction::Negation { to, of } => {
                let whole = if self.format.bytes == 4 { 0 } else { 1 };
                self.encoded(whole, XOR, (to, of), Source::Memory(Place::MinusZero));
            }
        }
    }

    /// An instruction with a VEX prefix: `to` and, where there are three operands, `a` are registers.
    fn encoded(&mut self, prefix: u8, opcode: u8, (to, a): (u8, u8), b: Source) {
        let high = |register: u8| register >> 3 & 1;
        let base = match b {
            Source::Register(register) => high(register),
            Source::Memory(_) => 0,
        };
        let length = u8::from(self.format.is_vector);
        let last = (!a & 15) << 3 | length << 2 | prefix;
        match base {
            0 => self.bytes.extend([0xC5, (high(to) ^ 1) << 7 | last]),
            _ => self.bytes.extend([0xC4, (high(to) ^ 1) << 7 | 0x41, last]),
        }
        self.bytes.push(opcode);
        let reg = (to & 7) << 3;
        match b {
            Source::Register(register) => self.bytes.push(0xC0 | reg | register & 7),
            Source::Memory(place) => self.address(reg, place),
        }
    }

    fn address(&mut self, reg: u8, place: Place) {
        let (base, at) = match place {
            Place::Cell(at) => (FRAME, at),
            Place::MinusZero => (CONSTANTS, 0),
            // behind −0, which may be read as a whole vector of sixteen bytes
            Place::Constant(at) => (CONSTANTS, at + SIGNS),
        };
        let step = self.format.lanes() * self.format.bytes;
        let displacement = i32::try_from(at * step).expect("a frame is shorter than two gigabytes");
        match i8::try_from(displacement) {
            Ok(short) => self.bytes.extend([0x40 | reg | base, short as u8]),
            Err(_) => {
                self.bytes.push(0x80 | reg | base);
                self.bytes.extend(displacement.to_le_bytes());
            }
        }
    }
}
