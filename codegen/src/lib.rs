//! The compiler of Straightline: from a robot file to straight-line `no_std` Rust.
#![forbid(unsafe_code)]

pub mod description;
pub mod diagnostic;
pub mod emit;
pub mod expr;
pub mod model;
pub mod pass;
pub mod reference_input;
pub mod schedule;
pub mod trace;

/// Version of the generator, as it stands in generated files.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
