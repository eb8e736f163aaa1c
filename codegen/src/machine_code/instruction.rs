//! An instruction, as far as figures need it.

use super::{arm64, riscv, thumb};
use crate::choices::machine::InstructionSet;

/// What an instruction does, in the terms of a model of cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionClass {
    /// Integers, moves, comparisons.
    Plain,
    /// An operation of the floating-point unit.
    Float,
    /// A multiply-accumulate there.
    MultiplyAccumulate,
    /// A division there.
    Division,
    /// A square root there.
    SquareRoot,
    /// So many words from memory or into it.
    Transfer(u32),
}

/// Where execution goes after an instruction. Places are bytes from the function's first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeFlow {
    /// To the next one.
    Next,
    /// There.
    Jump(i64),
    /// There or to the next one.
    Branch(i64),
    /// Into a function, which the object names, and back.
    Call,
    /// Back to the caller.
    Return,
    /// Where a register says.
    Indirect,
}

/// An instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MachineInstruction {
    /// Bytes from the function's first.
    pub at: usize,
    /// Its bytes.
    pub size: usize,
    /// What it does.
    pub class: InstructionClass,
    /// What comes next.
    pub flow: CodeFlow,
    /// Bytes of stack that it sets aside; none where the stack pointer becomes something that is not known.
    pub sets_aside: Option<u32>,
}

impl MachineInstruction {
    /// One that does nothing of note.
    pub(super) const fn plain(at: usize, size: usize) -> MachineInstruction {
        MachineInstruction { at, size, class: InstructionClass::Plain, flow: CodeFlow::Next, sets_aside: Some(0) }
    }
}

/// The instructions of a function; `is_data` says of a byte whether it belongs to a constant between them.
pub fn decoded(set: InstructionSet, bytes: &[u8], is_data: &dyn Fn(usize) -> bool) -> Vec<MachineInstruction> {
    match set {
        InstructionSet::Thumb => thumb::decoded(bytes, is_data),
        InstructionSet::RiscV => riscv::decoded(bytes, is_data),
        InstructionSet::Arm64 => arm64::decoded(bytes, is_data),
    }
}

/// The half word at a place; zero behind the end.
pub(super) fn half(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 2).map_or(0, |b| u32::from(u16::from_le_bytes([b[0], b[1]])))
}

/// The word at a place; zero behind the end.
pub(super) fn word(bytes: &[u8], at: usize) -> u32 {
    half(bytes, at) | half(bytes, at + 2) << 16
}

/// The lowest `bits` of a number, with the sign of the highest of them.
pub(super) fn signed(number: u32, bits: u32) -> i64 {
    i64::from((number << (32 - bits)) as i32 >> (32 - bits))
}

/// So many bits of a word, from the one with that number upwards.
pub(super) fn field(word: u32, from: u32, bits: u32) -> u32 {
    word >> from & ((1 << bits) - 1)
}
