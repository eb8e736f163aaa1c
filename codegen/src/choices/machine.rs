//! Machines that code can be made for: a row each.
//!
//! A row changes how the same numbers are computed, never which numbers they should be: the kernel of sines, and the order of operations.
//! Bits stay equal on all machines for one set of options.

use super::Choice;
use straightline_graph::schedule::{CycleModel, ScheduleMachine};

/// What is known of a machine.
pub struct MachineRow {
    /// The word that asks for it.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub doc: &'static str,
    /// What rustc calls the platform.
    pub triple: &'static str,
    /// What rustc calls the processor, for `-C target-cpu`.
    pub cpu: &'static str,
    /// What rustc is told besides so that it keeps the order of the text, where that was measured to pay.
    pub for_order: &'static [&'static str],
    /// What rustc is told besides where code runs from flash: fewer instructions, of which each takes longer.
    pub for_flash: &'static [&'static str],
    /// What GCC is told in the text, so that it keeps the order.
    pub for_order_in_c: &'static [&'static str],
    /// How many numbers of single precision its registers hold; none without a floating-point unit.
    pub registers: Option<usize>,
    /// The memories for which rustc makes one instruction of a product and a sum, which rounds both.
    pub accumulates: &'static [Memory],
    /// Whether it computes one angle at a time, so that short sines pay.
    pub is_scalar: bool,
    /// The memories from which a call has the short sines of two angles, as four numbers come back in registers.
    pub sines_by_two: &'static [Memory],
    /// How its machine code is read; none: it is not.
    pub code: Option<InstructionSet>,
    /// Instructions that functions of the compiler's library take for a number, on average; none are known of a library that is not here.
    pub library: &'static [(&'static str, f64)],
    /// A model of its cycles; none where its manual gives no times of instructions.
    pub cycles: Option<CycleModel>,
}

/// How machine code is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Arm's of 16 and 32 bits.
    Thumb,
    /// RISC-V of 32 bits, with compressed instructions.
    RiscV,
    /// Arm's of 64-bit processors.
    Arm64,
}

/// Cortex-M4 Technical Reference Manual (Arm 100166), tables 3-1 and 7-1; of the 1 to 3 cycles that filling the pipeline takes, 2. Flash as in an
/// STM32G474 at 170 MHz (RM0440): 8 bytes, and four wait states.
const CYCLES_OF_CORTEX_M4: CycleModel = CycleModel {
    float: 1.0,
    multiply_accumulate: 3.0,
    division: 14.0,
    square_root: 14.0,
    taken: 2.0,
    flash_bytes_per_cycle: 8.0 / 5.0,
};

/// Of a library that was not measured nothing is known.
const NOT_MEASURED: &[(&str, f64)] = &[];

/// Averages that give the instructions of `robots/benches/machines.tsv` (rustc 1.95.0) by least squares of relative errors; divisions are too few there
/// to tell, so that one counts as two products. Filling memory is of six arrays of 36 to 48 bytes.
const OF_CORTEX_M0PLUS: &[(&str, f64)] = &[
    ("__aeabi_fadd", 99.0),
    ("__aeabi_fsub", 115.0),
    ("__aeabi_fmul", 112.0),
    ("__aeabi_fdiv", 224.0),
    ("__aeabi_memclr4", 134.0),
];
/// The same.
const OF_RV32IMAC: &[(&str, f64)] =
    &[("__addsf3", 62.0), ("__subsf3", 68.0), ("__mulsf3", 48.0), ("__divsf3", 96.0), ("memset", 74.0)];
/// Of the same arrays, where there is a floating-point unit.
const OF_CORTEX_M4F: &[(&str, f64)] = &[("__aeabi_memclr4", 36.8)];
/// The same.
const OF_RV32IMAFC: &[(&str, f64)] = &[("memset", 42.8)];

/// Multiply-accumulate that rounds the product, which LLVM leaves out on processors where it takes as long as the two.
const MULTIPLY_ACCUMULATE: &[&str] = &["-C target-feature=-slowfpvmlx"];

/// The scheduler of LLVM moves operations for their latencies, and values into memory; the order of the text is made for the registers.
const KEPT_ORDER: &[&str] = &["-C llvm-args=-enable-misched=false"];

/// The same of GCC, which has a scheduler before its registers on Arm.
const KEPT_ORDER_IN_C: &[&str] = &["no-schedule-insns"];

/// Machines, with the constants that stand for them.
macro_rules! machines {
    ($($(#[$about:meta])* $NAME:ident { $($row:tt)* })+) => {
        impl TargetMachine {
            $($(#[$about])*
            pub const $NAME: TargetMachine = TargetMachine(&MachineRow { $($row)* });)+

            /// All of them.
            pub const ALL: &'static [TargetMachine] = &[$(TargetMachine::$NAME),+];
        }
    };
}

machines! {
    /// Arm Cortex-M0+: no floating-point unit.
    CORTEX_M0PLUS {
        name: "cortex-m0plus",
        doc: "Arm Cortex-M0+: no floating-point unit",
        triple: "thumbv6m-none-eabi",
        cpu: "cortex-m0plus",
        for_order: &[],
        for_order_in_c: &[],
        for_flash: &[],
        registers: None,
        accumulates: &[],
        is_scalar: true,
        sines_by_two: &[],
        code: Some(InstructionSet::Thumb),
        library: OF_CORTEX_M0PLUS,
        cycles: None,
    }
    /// Arm Cortex-M3: no floating-point unit.
    CORTEX_M3 {
        name: "cortex-m3",
        doc: "Arm Cortex-M3: no floating-point unit",
        triple: "thumbv7m-none-eabi",
        cpu: "cortex-m3",
        for_order: &[],
        for_order_in_c: &[],
        for_flash: &[],
        registers: None,
        accumulates: &[],
        is_scalar: true,
        sines_by_two: &[],
        code: Some(InstructionSet::Thumb),
        library: NOT_MEASURED,
        cycles: None,
    }
    /// Arm Cortex-M4 with a floating-point unit of single precision.
    CORTEX_M4F {
        name: "cortex-m4f",
        doc: "Arm Cortex-M4 with a floating-point unit of single precision",
        triple: "thumbv7em-none-eabihf",
        cpu: "cortex-m4",
        for_order: KEPT_ORDER,
        for_order_in_c: KEPT_ORDER_IN_C,
        for_flash: MULTIPLY_ACCUMULATE,
        registers: Some(32),
        accumulates: &[Memory::Flash],
        is_scalar: true,
        sines_by_two: &[Memory::Flash],
        code: Some(InstructionSet::Thumb),
        library: OF_CORTEX_M4F,
        cycles: Some(CYCLES_OF_CORTEX_M4),
    }
    /// Arm Cortex-M7.
    CORTEX_M7 {
        name: "cortex-m7",
        doc: "Arm Cortex-M7",
        triple: "thumbv7em-none-eabihf",
        cpu: "cortex-m7",
        for_order: &[],
        for_order_in_c: &[],
        for_flash: &[],
        registers: Some(32),
        accumulates: &[Memory::Flash, Memory::Tcm],
        is_scalar: true,
        sines_by_two: &[Memory::Flash],
        code: Some(InstructionSet::Thumb),
        library: NOT_MEASURED,
        cycles: None,
    }
    /// Arm Cortex-M33 with a floating-point unit of single precision.
    CORTEX_M33 {
        name: "cortex-m33",
        doc: "Arm Cortex-M33 with a floating-point unit of single precision",
        triple: "thumbv8m.main-none-eabihf",
        cpu: "cortex-m33",
        for_order: &[],
        for_order_in_c: &[],
        for_flash: MULTIPLY_ACCUMULATE,
        registers: Some(32),
        accumulates: &[Memory::Flash],
        is_scalar: true,
        sines_by_two: &[Memory::Flash],
        code: Some(InstructionSet::Thumb),
        library: NOT_MEASURED,
        cycles: None,
    }
    /// RISC-V of 32 bits without a floating-point unit.
    RV32IMAC {
        name: "rv32imac",
        doc: "RISC-V of 32 bits without a floating-point unit",
        triple: "riscv32imac-unknown-none-elf",
        cpu: "generic-rv32",
        for_order: &[],
        for_order_in_c: &[],
        for_flash: &[],
        registers: None,
        accumulates: &[],
        is_scalar: true,
        sines_by_two: &[],
        code: Some(InstructionSet::RiscV),
        library: OF_RV32IMAC,
        cycles: None,
    }
    /// RISC-V of 32 bits with a floating-point unit of single precision.
    RV32IMAFC {
        name: "rv32imafc",
        doc: "RISC-V of 32 bits with a floating-point unit of single precision",
        triple: "riscv32imafc-unknown-none-elf",
        cpu: "generic-rv32",
        for_order: KEPT_ORDER,
        for_order_in_c: &[],
        for_flash: &[],
        registers: Some(32),
        accumulates: &[],
        is_scalar: true,
        sines_by_two: &[],
        code: Some(InstructionSet::RiscV),
        library: OF_RV32IMAFC,
        cycles: None,
    }
    /// Arm of 64 bits, with vectors of 128 bits.
    AARCH64 {
        name: "aarch64",
        doc: "Arm of 64 bits, with vectors of 128 bits",
        triple: "aarch64-unknown-none",
        cpu: "generic",
        for_order: &[],
        for_order_in_c: &[],
        for_flash: &[],
        registers: Some(32),
        accumulates: &[],
        is_scalar: false,
        sines_by_two: &[],
        code: Some(InstructionSet::Arm64),
        library: NOT_MEASURED,
        cycles: None,
    }
    /// x86 of 64 bits with AVX2.
    X86_64_V3 {
        name: "x86-64-v3",
        doc: "x86 of 64 bits with AVX2",
        triple: "x86_64-unknown-linux-gnu",
        cpu: "x86-64-v3",
        for_order: &[],
        for_order_in_c: &[],
        for_flash: &[],
        registers: Some(16),
        accumulates: &[],
        is_scalar: false,
        sines_by_two: &[],
        code: None,
        library: NOT_MEASURED,
        cycles: None,
    }
}

/// A machine that code is made for.
#[derive(Clone, Copy)]
pub struct TargetMachine(&'static MachineRow);

impl TargetMachine {
    /// What is known of it.
    pub fn row(self) -> &'static MachineRow {
        self.0
    }

    /// What an order of operations is chosen for, where its registers hold numbers.
    pub fn for_schedules(self, memory: Memory) -> Option<ScheduleMachine> {
        self.0.registers.map(|registers| ScheduleMachine {
            registers,
            accumulates: self.0.accumulates.contains(&memory),
            is_in_flash: memory == Memory::Flash,
            sines_by_two: self.0.sines_by_two.contains(&memory),
            cycles: self.0.cycles,
        })
    }

    /// What rustc is told beside `--target`.
    pub fn flags(self, memory: Memory) -> Vec<String> {
        let of_memory = if memory == Memory::Flash { self.0.for_flash } else { &[] };
        let cpu = format!("-C target-cpu={}", self.0.cpu);
        let besides = self.0.for_order.iter().chain(of_memory);
        [cpu].into_iter().chain(besides.map(|flag| (*flag).to_string())).collect()
    }
}

impl PartialEq for TargetMachine {
    fn eq(&self, other: &TargetMachine) -> bool {
        self.0.name == other.0.name
    }
}

impl std::fmt::Debug for TargetMachine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0.name)
    }
}

impl Choice for TargetMachine {
    const WHAT: &'static str = "machine";
    fn words() -> Vec<(&'static str, &'static str, Self)> {
        TargetMachine::ALL.iter().map(|machine| (machine.0.name, machine.0.doc, *machine)).collect()
    }
}

/// The memory that code runs from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Memory {
    /// Fetching takes time: the fewest bytes.
    #[default]
    Flash,
    /// Fetching takes none: the least time of the instructions themselves.
    Tcm,
}
