//! Machines: what each set of instructions has, a row per set, and how functions are written in it, a file per kind of machine.
//!
//! Nowhere else is asked what a machine has. Functions are written on every machine for every other; executed is what [`InstructionsRow::is_here`].

use crate::allocation::Instruction;

pub mod aarch64;
pub mod x86;

/// Whether this machine is one of x86-64 with all of these.
#[cfg(target_arch = "x86_64")]
macro_rules! x86_has {
    ($($extension:tt)*) => { true $(&& std::arch::is_x86_feature_detected!($extension))* };
}
#[cfg(not(target_arch = "x86_64"))]
macro_rules! x86_has {
    ($($extension:tt)*) => {
        false
    };
}
#[cfg(target_arch = "x86_64")]
pub(crate) use x86_has;

/// Instructions that come together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum HostInstructions {
    /// What every x86-64 has.
    Sse2,
    /// Instructions of three operands, vectors of 32 bytes.
    Avx,
    /// Twice the registers, vectors of 64 bytes.
    Avx512,
    /// What every aarch64 with numbers has.
    Neon,
}

/// What is known of a set of instructions.
#[derive(Debug)]
pub struct InstructionsRow {
    /// What its functions are called.
    pub name: &'static str,
    /// Registers of numbers that steps may take: without those that the machine's file keeps for itself.
    pub registers: usize,
    /// Bytes of a vector.
    pub vector_bytes: usize,
    /// Whether this machine has it.
    pub is_here: fn() -> bool,
    /// Whether this machine has products and sums in one rounding beside it.
    pub fuses: fn() -> bool,
    /// The bytes of a function.
    pub function: fn(&[Instruction], Format) -> Vec<u8>,
}

const SSE2: InstructionsRow = InstructionsRow {
    name: "machine code of x86-64",
    registers: x86::ON_THE_WAY as usize,
    vector_bytes: 16,
    is_here: || x86_has!(),
    fuses: || false,
    function: x86::function,
};
const AVX: InstructionsRow = InstructionsRow {
    name: "machine code of x86-64 with AVX",
    registers: 16,
    vector_bytes: 32,
    is_here: || x86_has!("avx"),
    fuses: || x86_has!("fma"),
    function: x86::function,
};
const AVX512: InstructionsRow = InstructionsRow {
    name: "machine code of x86-64 with AVX-512",
    registers: 32,
    vector_bytes: 64,
    is_here: || x86_has!("avx512f" "avx512vl"),
    fuses: || true,
    function: x86::function,
};
const NEON: InstructionsRow = InstructionsRow {
    name: "machine code of aarch64",
    registers: aarch64::ON_THE_WAY as usize,
    vector_bytes: 16,
    // where programs may clean caches themselves, as `native` does
    is_here: || cfg!(all(target_arch = "aarch64", target_feature = "neon", unix)),
    fuses: || true,
    function: aarch64::function,
};

impl HostInstructions {
    /// All, the fastest of each kind of machine first.
    pub const ALL: [HostInstructions; 4] =
        [HostInstructions::Avx512, HostInstructions::Avx, HostInstructions::Sse2, HostInstructions::Neon];

    /// What is known of it.
    pub fn row(self) -> &'static InstructionsRow {
        match self {
            HostInstructions::Sse2 => &SSE2,
            HostInstructions::Avx => &AVX,
            HostInstructions::Avx512 => &AVX512,
            HostInstructions::Neon => &NEON,
        }
    }
}

/// Numbers of a format, alone or as many as a vector holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// The instructions.
    pub set: HostInstructions,
    /// Bytes of a number: four or eight.
    pub bytes: usize,
    /// Whether they are vectors.
    pub is_vector: bool,
}

impl Format {
    /// How many states are computed at once.
    pub fn lanes(self) -> usize {
        match self.is_vector {
            true => self.set.row().vector_bytes / self.bytes,
            false => 1,
        }
    }
}

/// So many times −0 stand before the constants: what instructions on whole registers read of it.
pub const SIGNS: usize = 4;
