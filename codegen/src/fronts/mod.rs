//! What users call: a builder for build scripts, and what the derive macro expands to.

pub mod builder;
pub mod expansion;

pub use builder::{compile_robot, Builder};
