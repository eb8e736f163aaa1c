//! Text: from programs to source that a person would defend in review.
//!
//! Programs are [lowered](lower) to functions of statements and expressions ([`module`]), which know no language; a [`Target`] writes
//! them. Rust is the first ([`rust`]), with all that stands around functions in a Rust file.

pub mod c99;
mod contact;
mod doc;
mod error_bound;
pub mod generated;
pub mod gpu;
pub mod lower;
pub mod module;
pub mod package;
mod parameter;
pub mod rust;
mod staged;
mod style;
pub mod target;

pub use generated::{Generated, Provenance};
pub use lower::{fused, Lowering, Names};
pub use module::{Item, Routine};
pub use target::Target;

use straightline_graph::Scalar;

/// How a function is computed: over one state or over lanes of states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// The scalar type.
    pub scalar: Scalar,
    /// Whether every scalar of inputs and outputs is an array over `N` lanes.
    pub lanes: bool,
    /// Whether a·b + c is one operation where the machine has it: [`rust::fused::module`].
    pub fused: bool,
    /// Whether that operation is `crate::mul_add_f64` of the crate around the output, not that of `std`.
    pub fused_by_caller: bool,
    /// Whether the function takes any `T: straightline::Real` in place of `scalar`.
    pub generic: bool,
    /// Whether it is for a machine that stores one number after the other.
    pub one_by_one: bool,
}

impl Style {
    /// One state.
    pub fn plain(scalar: Scalar) -> Self {
        Style { scalar, lanes: false, fused: false, fused_by_caller: false, generic: false, one_by_one: false }
    }

    /// With a·b + c as one operation, or without.
    pub fn fused(self, fused: bool) -> Self {
        Style { fused, ..self }
    }

    /// With that operation from the crate around the output.
    pub fn by_caller(self, fused_by_caller: bool) -> Self {
        Style { fused_by_caller, ..self }
    }

    /// In any scalar; in it nothing is fused.
    pub fn generic(self) -> Self {
        Style { generic: true, fused: false, ..self }
    }

    /// For a machine that stores one number after the other, or not.
    pub fn one_by_one(self, one_by_one: bool) -> Self {
        Style { one_by_one, ..self }
    }

    /// `N` states at once.
    pub fn lanes(self) -> Self {
        Style { lanes: true, ..self }
    }
}
