//! Figures of generated functions on their machine: the text is compiled by rustc for it, and the object is read.
//!
//! Straight-line code executes every instruction once, so that the instructions of a call are those of the function, of the functions
//! that it calls as often as it calls them, and nothing else has to be known. Where there are branches (a sine on a machine without
//! conditional moves) the longest path counts, so that what is said is a bound; where there is a loop the number is not known, and that is said.

mod arm64;
mod instruction;
mod object_file;
mod path;
mod riscv;
mod rustc;
mod thumb;

pub use instruction::{decoded, CodeFlow, InstructionClass, MachineInstruction};
pub use object_file::ObjectCode;
pub use rustc::{machine_code, ObjectError, RustCompiler};

/// What a function takes on the machine that code is made for.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct MachineFigures {
    /// Instructions per call on the longest path, callees included; or why that is not known.
    #[cfg_attr(feature = "serde", serde(serialize_with = "known_alone"))]
    pub instructions: Result<u32, &'static str>,
    /// Bytes of flash: the function, its parts, and the constants that it alone uses; not the kernel of sines.
    pub flash_bytes: u32,
    /// Bytes of flash that it shares with other functions: the kernel of sines, and constants.
    pub shared_flash_bytes: u32,
    /// Bytes of stack at its deepest, callees included but for functions of the compiler's library; or why that is not known.
    #[cfg_attr(feature = "serde", serde(serialize_with = "known_alone"))]
    pub stack_bytes: Result<u32, &'static str>,
    /// Cycles per call by the model of the machine's row, for the memory that code runs from; or why there are none.
    #[cfg_attr(feature = "serde", serde(serialize_with = "known_alone"))]
    pub model_cycles: Result<u32, &'static str>,
}

#[cfg(feature = "serde")]
fn known_alone<S: serde::Serializer>(figure: &Result<u32, &'static str>, serializer: S) -> Result<S::Ok, S::Error> {
    serde::Serialize::serialize(&figure.ok(), serializer)
}
