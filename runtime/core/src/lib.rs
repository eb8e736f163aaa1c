//! What both sides of Straightline stand on: scalars ([`Real`], [`Dd`]), spatial algebra, the robot [`model`], and the
//! dynamics [`algorithms`], written once and generic over the scalar.
//!
//! With `f64` the algorithms are the generic numeric runtime; with the compiler's tracing scalar they are its equations;
//! with double-double [`Dd`] they are an oracle. The feature `reference` adds a second author: the handbook chapter's
//! own formulation, which shares nothing with the algorithms but the scalars.
#![no_std]
#![forbid(unsafe_code)]
#[cfg(feature = "alloc")]
extern crate alloc;

#[cfg(feature = "alloc")]
pub mod algorithms;
#[cfg(feature = "alloc")]
pub mod base_parameters;
pub mod batch;
#[cfg(feature = "alloc")]
pub mod closure;
#[cfg(feature = "alloc")]
pub mod contact;
pub mod control;
#[cfg(feature = "alloc")]
pub mod coupling;
pub mod dd;
#[cfg(feature = "alloc")]
pub mod drive;
pub mod dual;
pub mod fixed;
pub mod integrate;
pub mod jet;
pub mod joint;
pub mod magnitude;
#[cfg(feature = "alloc")]
pub mod model;
mod operators;
pub mod phases;
pub mod random;
pub mod real;
#[cfg(feature = "alloc")]
pub mod reduced;
#[cfg(feature = "reference")]
pub mod reference;
#[cfg(feature = "alloc")]
pub mod reverse;
pub mod short_sines;
pub mod sources;
pub mod spatial;
pub mod taylor;
pub mod trig;

pub use dd::Dd;
pub use dual::Dual;
pub use real::Real;
pub use taylor::Taylor;
