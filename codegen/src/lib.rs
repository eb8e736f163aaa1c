//! The compiler of Straightline: from a robot file to straight-line `no_std` Rust.
//!
//! [`compile()`] is the whole pipeline as one pure function; `ARCHITECTURE.md` draws it.
#![forbid(unsafe_code)]

pub mod builder;
pub mod certify;
pub mod choose;
pub mod compile;
pub mod contact;
pub mod description;
pub mod diagnostic;
pub mod emit;
pub mod equivalence;
pub mod expansion;
#[cfg(feature = "cli")]
pub mod experiment;
pub mod export;
pub mod expr;
pub mod forward_method;
pub mod function;
pub mod identifier;
pub mod limbs;
pub mod model;
pub mod output;
pub mod pass;
mod random;
mod range;
pub mod readback;
pub mod reduce;
#[cfg(feature = "verify")]
pub mod reference_input;
pub mod report;
pub mod rounding;
pub mod scene;
pub mod schedule;
pub mod singular;
mod stable;
pub mod stage;
pub mod staged;
pub mod stubs;
pub mod trace;
#[cfg(feature = "verify")]
pub mod verify;
pub mod words;

pub use builder::{compile_robot, Builder};
pub use compile::{compile, Generated, Options};
pub use diagnostic::{Diagnostics, Source};
pub use emit::Scalar;
pub use expr::Grade;
pub use function::{ForwardDynamicsMethod, Function, Robot};

/// Version of the generator, as it stands in generated files.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
