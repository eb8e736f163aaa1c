//! Packages of generated code for who does not write Rust: a row each. What reads one back is a row of `readback::packages`.

use super::c99::opencl::OPENCL;
use super::c99::C99_SOURCE;
use super::gpu::ptx::PTX;
use super::rust::c_package::C_ABI;
use super::Generated;

/// A kind of package.
#[derive(Clone, Copy)]
pub struct PackageKind {
    /// The word that asks for it.
    pub name: &'static str,
    /// What is in it.
    pub doc: &'static str,
    /// Whether C calls its functions, on the machine that the scene names.
    pub is_c: bool,
    /// Why there is none of a robot: what is wrong, and what helps.
    pub refusal: fn(&Generated) -> Option<[&'static str; 2]>,
    /// Its files, by their paths inside it. Names that other code could have begin with the prefix, an identifier.
    pub files: fn(&Generated, &str) -> Vec<(String, String)>,
}

/// Why there is no package of what Rust alone has.
pub(super) fn rust_alone(generated: &Generated) -> Option<[&'static str; 2]> {
    match () {
        () if generated.plain_style.generic => Some(NO_GENERIC),
        () if generated.programs.self_test.is_some() => Some(NO_SELF_TEST),
        () if !generated.fixed.is_empty() => Some(NO_FIXED),
        () if generated.rustc.is_some() => Some(NO_FIGURES),
        () if !generated.others.is_empty() || generated.staged.is_some() => Some(ONE_SCALAR),
        () => None,
    }
}

const NO_GENERIC: [&str; 2] =
    ["packages have no generic functions", "leave out `generic`; `scalar` says which numbers their functions take"];

const ONE_SCALAR: [&str; 2] = [
    "a package has one scalar type, and no stages: other languages could not tell a stage that is out of date",
    "say which with `--scalar`, and leave `staged` out of the scene",
];

const NO_FIXED: [&str; 2] =
    ["packages have no functions in fixed point", "leave out `fixed`; `generate` writes them in Rust"];

const NO_FIGURES: [&str; 2] = [
    "figures of machine code are of the Rust text by itself, not of a package",
    "leave out `figures`; a file of Rust has them (`straightline generate`)",
];

const NO_SELF_TEST: [&str; 2] =
    ["a package has no self-test", "leave out `self_test`; a file of Rust has it (`straightline generate`)"];

/// All kinds.
pub static PACKAGES: &[PackageKind] = &[C_ABI, C99_SOURCE, OPENCL, PTX];
