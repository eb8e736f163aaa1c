//! Instructions of x86-64: those that every such machine has (SSE2), AVX and FMA in their VEX encoding, AVX-512 in its EVEX encoding (Intel 64 and IA-32 Architectures
//! Software Developer's Manual, volume 2, 2.1 to 2.7).
//!
//! A function takes the address of its frame in `rdi` and that of its constants in `rsi`, as the System V ABI has it, and uses all vector registers, which belong to whoever is called.

use super::{Format, HostInstructions, SIGNS};
use crate::allocation::{FusedForm, Instruction, MemoryPlace, ReadFrom};
use straightline_graph::expr::Binary;

/// The register that instructions of two operands take on the way.
pub(super) const ON_THE_WAY: u8 = 15;
const FRAME: u8 = 7;
const CONSTANTS: u8 = 6;
const MOVE: u8 = 0x10;
const MOVE_BACK: u8 = 0x11;
const MOVE_WHOLE: u8 = 0x28;
const ROOT: u8 = 0x51;
const XOR: u8 = 0x57;
/// The same of AVX-512 without extensions, of integers.
const XOR_INTEGERS: u8 = 0xEF;
/// Products and sums in one rounding, none subtracted, by which operand the result replaces: two for the other term subtracted, four for the product, one for a
/// number alone.
const MULTIPLY_INTO_TERM: u8 = 0xB8;
const MULTIPLY_INTO_FACTOR: u8 = 0xA8;

impl Format {
    /// What an instruction on these numbers begins with.
    fn prefix(self) -> Prefix {
        match (self.is_vector, self.bytes) {
            (true, 4) => Prefix::None,
            (true, _) => Prefix::P66,
            (false, 4) => Prefix::F3,
            (false, _) => Prefix::F2,
        }
    }

    /// What one on whole registers begins with.
    fn whole(self) -> Prefix {
        if self.bytes == 4 {
            Prefix::None
        } else {
            Prefix::P66
        }
    }
}

/// The prefix of an operation on vectors, or on a number alone: the field `pp` of newer encodings.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Prefix {
    None,
    P66,
    F3,
    F2,
}

/// Where an opcode stands: behind 0F, or behind 0F 38.
#[derive(Clone, Copy, PartialEq, Eq)]
enum OpcodeMap {
    Second = 1,
    Third = 2,
}

/// The bytes of a function of these instructions.
///
/// # Panics
/// If a frame or the constants are longer than two gigabytes.
pub fn function(instructions: &[Instruction], format: Format) -> Vec<u8> {
    let mut writer = Writer { bytes: Vec::new(), format };
    for instruction in instructions {
        match format.set {
            HostInstructions::Sse2 => writer.of_two(*instruction),
            HostInstructions::Avx | HostInstructions::Avx512 => writer.of_three(*instruction),
            HostInstructions::Neon => unreachable!("its functions are written by its own row"),
        }
    }
    if format.set != HostInstructions::Sse2 {
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

/// Bit `k` of a register's number.
fn bit(register: u8, k: u8) -> u8 {
    register >> k & 1
}

struct Writer {
    bytes: Vec<u8>,
    format: Format,
}

impl Writer {
    /// An instruction where the result has a register of its own.
    fn of_three(&mut self, instruction: Instruction) {
        let (prefix, whole) = (self.format.prefix(), self.format.whole());
        match instruction {
            Instruction::Load { to, from } => self.encoded(prefix, MOVE, (to, 0), ReadFrom::Memory(from)),
            Instruction::Store { from, to } => {
                self.encoded(prefix, MOVE_BACK, (from, 0), ReadFrom::Memory(MemoryPlace::Cell(to)));
            }
            Instruction::Binary { op, to, a, b } => self.encoded(prefix, opcode(op), (to, a), b),
            // of a number alone the rest of the register comes from the second one; of vectors there is none
            Instruction::Root { to, of } if self.format.is_vector => self.encoded(prefix, ROOT, (to, 0), of),
            Instruction::Root { to, of } => self.encoded(prefix, ROOT, (to, to), of),
            Instruction::Copy { to, from } => self.encoded(Prefix::None, MOVE_WHOLE, (to, 0), ReadFrom::Register(from)),
            Instruction::Fused { form, to, a, b, negated, minus } => {
                let first = if form == FusedForm::IntoTerm { MULTIPLY_INTO_TERM } else { MULTIPLY_INTO_FACTOR };
                let signs = 4 * u8::from(negated) + 2 * u8::from(minus);
                let opcode = first + signs + u8::from(!self.format.is_vector);
                self.of_map(OpcodeMap::Third, Prefix::P66, opcode, (to, a), b);
            }
            // of a number alone, too, on whole registers
            Instruction::Negation { to, of } => {
                let sign = ReadFrom::Memory(MemoryPlace::MinusZero);
                match self.format.set {
                    HostInstructions::Avx512 => self.evex(OpcodeMap::Second, Prefix::P66, XOR_INTEGERS, (to, of), sign),
                    _ => self.encoded(whole, XOR, (to, of), sign),
                }
            }
        }
    }

    /// An instruction where the result takes the register of the first operand.
    fn of_two(&mut self, instruction: Instruction) {
        let prefix = self.format.prefix();
        match instruction {
            Instruction::Load { to, from } => self.legacy(prefix, MOVE, to, ReadFrom::Memory(from)),
            Instruction::Store { from, to } => {
                self.legacy(prefix, MOVE_BACK, from, ReadFrom::Memory(MemoryPlace::Cell(to)))
            }
            Instruction::Binary { op, to, a, b } => {
                let b = match b {
                    ReadFrom::Register(b) if b == to && a != to => {
                        self.copy(ON_THE_WAY, b);
                        ReadFrom::Register(ON_THE_WAY)
                    }
                    other => self.aligned(other),
                };
                self.copy(to, a);
                self.legacy(prefix, opcode(op), to, b);
            }
            Instruction::Root { to, of } => {
                let of = self.aligned(of);
                self.legacy(prefix, ROOT, to, of);
            }
            Instruction::Copy { to, from } => self.copy(to, from),
            Instruction::Fused { .. } => unreachable!("what has no instruction for it is not asked for it"),
            Instruction::Negation { to, of } => {
                self.legacy(self.format.whole(), MOVE, ON_THE_WAY, ReadFrom::Memory(MemoryPlace::MinusZero));
                self.copy(to, of);
                self.legacy(self.format.whole(), XOR, to, ReadFrom::Register(ON_THE_WAY));
            }
        }
    }

    /// What a vector instruction of two operands may read: in memory only what begins at multiples of a vector, which nothing here does.
    fn aligned(&mut self, source: ReadFrom) -> ReadFrom {
        match source {
            ReadFrom::Memory(_) if self.format.is_vector => {
                self.legacy(self.format.prefix(), MOVE, ON_THE_WAY, source);
                ReadFrom::Register(ON_THE_WAY)
            }
            other => other,
        }
    }

    fn copy(&mut self, to: u8, from: u8) {
        if to != from {
            self.legacy(Prefix::None, MOVE_WHOLE, to, ReadFrom::Register(from));
        }
    }

    /// An instruction of two operands.
    fn legacy(&mut self, prefix: Prefix, opcode: u8, to: u8, b: ReadFrom) {
        match prefix {
            Prefix::None => {}
            Prefix::P66 => self.bytes.push(0x66),
            Prefix::F3 => self.bytes.push(0xF3),
            Prefix::F2 => self.bytes.push(0xF2),
        }
        let extended = bit(to, 3) << 2 | if let ReadFrom::Register(b) = b { bit(b, 3) } else { 0 };
        if extended != 0 {
            self.bytes.push(0x40 | extended);
        }
        self.bytes.extend([0x0F, opcode]);
        self.operand(to, b, 1);
    }

    /// An instruction of the second map of opcodes.
    fn encoded(&mut self, prefix: Prefix, opcode: u8, registers: (u8, u8), b: ReadFrom) {
        self.of_map(OpcodeMap::Second, prefix, opcode, registers, b);
    }

    /// An instruction with a VEX prefix, or an EVEX prefix where registers or vectors ask for it: `to` and, where there are three operands, `a` are registers.
    fn of_map(&mut self, map: OpcodeMap, prefix: Prefix, opcode: u8, (to, a): (u8, u8), b: ReadFrom) {
        let is_far = |register: u8| register >= 16;
        let is_wide = self.format.set == HostInstructions::Avx512 && self.format.is_vector;
        if is_wide || is_far(to) || is_far(a) || matches!(b, ReadFrom::Register(b) if is_far(b)) {
            return self.evex(map, prefix, opcode, (to, a), b);
        }
        let base = if let ReadFrom::Register(register) = b { bit(register, 3) } else { 0 };
        // the third map says of its numbers how long they are
        let is_double = u8::from(map == OpcodeMap::Third && self.format.bytes == 8);
        let last = is_double << 7 | (!a & 15) << 3 | u8::from(self.format.is_vector) << 2 | prefix as u8;
        match (base, map) {
            (0, OpcodeMap::Second) => self.bytes.extend([0xC5, (bit(to, 3) ^ 1) << 7 | last]),
            _ => {
                let registers = (bit(to, 3) ^ 1) << 7 | 1 << 6 | (base ^ 1) << 5;
                self.bytes.extend([0xC4, registers | map as u8, last]);
            }
        }
        self.bytes.push(opcode);
        self.operand(to, b, 1);
    }

    fn evex(&mut self, map: OpcodeMap, prefix: Prefix, opcode: u8, (to, a): (u8, u8), b: ReadFrom) {
        // bits of registers are inverted
        let [x, base] = match b {
            ReadFrom::Register(register) => [bit(register, 4) ^ 1, bit(register, 3) ^ 1],
            ReadFrom::Memory(_) => [1, 1],
        };
        // a copy of whole registers is one of single precision
        let is_double = u8::from(self.format.bytes == 8 && opcode != MOVE_WHOLE);
        let length = if self.format.is_vector { 2 } else { 0 };
        self.bytes.extend([
            0x62,
            (bit(to, 3) ^ 1) << 7 | x << 6 | base << 5 | (bit(to, 4) ^ 1) << 4 | map as u8,
            is_double << 7 | (!a & 15) << 3 | 4 | prefix as u8,
            length << 5 | (bit(a, 4) ^ 1) << 3,
            opcode,
        ]);
        // short distances count in what is read: a vector, a number, or, on whole registers, sixteen bytes
        let is_whole = opcode == XOR_INTEGERS && !self.format.is_vector;
        self.operand(to, b, if is_whole { 16 } else { self.format.lanes() * self.format.bytes });
    }

    /// The last operand, with the other register's bits; short distances count in `unit` bytes.
    fn operand(&mut self, to: u8, b: ReadFrom, unit: usize) {
        let reg = (to & 7) << 3;
        match b {
            ReadFrom::Register(register) => self.bytes.push(0xC0 | reg | register & 7),
            ReadFrom::Memory(place) => self.address(reg, place, unit as i32),
        }
    }

    fn address(&mut self, reg: u8, place: MemoryPlace, unit: i32) {
        let (base, at) = match place {
            MemoryPlace::Cell(at) => (FRAME, at),
            MemoryPlace::MinusZero => (CONSTANTS, 0),
            // behind −0, which may be read as a whole register of sixteen bytes
            MemoryPlace::Constant(at) => (CONSTANTS, at + SIGNS),
        };
        let step = self.format.lanes() * self.format.bytes;
        let displacement = i32::try_from(at * step).expect("a frame is shorter than two gigabytes");
        match i8::try_from(displacement / unit) {
            Ok(short) if displacement % unit == 0 => self.bytes.extend([0x40 | reg | base, short as u8]),
            _ => {
                self.bytes.push(0x80 | reg | base);
                self.bytes.extend(displacement.to_le_bytes());
            }
        }
    }
}
