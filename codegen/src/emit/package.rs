//! Packages of generated code for who does not write Rust: a row each.

use super::c99::C99_SOURCE;
use super::rust::c_package::C_ABI;
use super::Generated;

/// A kind of package.
#[derive(Clone, Copy)]
pub struct PackageKind {
    /// The word that asks for it.
    pub name: &'static str,
    /// What is in it.
    pub doc: &'static str,
    /// Why there is none of a robot: what is wrong, and what helps.
    pub refusal: fn(&Generated) -> Option<[&'static str; 2]>,
    /// Its files, by their paths inside it. Names that other code could have begin with the prefix, an identifier.
    pub files: fn(&Generated, &str) -> Vec<(String, String)>,
}

/// Why packages have no functions in fixed point.
pub(super) const NO_FIXED: [&str; 2] =
    ["packages have no functions in fixed point", "leave out `fixed`; `generate` writes them in Rust"];

/// Why packages have no figures of machine code.
pub(super) const NO_FIGURES: [&str; 2] = [
    "figures of machine code are of the Rust text by itself, not of a package",
    "leave out `figures`; a file of Rust has them (`straightline generate`)",
];

/// Why packages of C refuse a self-test.
pub(super) const NO_SELF_TEST: [&str; 2] =
    ["a package of C has no self-test", "leave out `self_test`; a file of Rust has it (`straightline generate`)"];

/// All kinds.
pub static PACKAGES: &[PackageKind] = &[C_ABI, C99_SOURCE];
