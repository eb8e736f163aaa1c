//! What users call: a builder for build scripts, and what the derive macro expands to.

pub mod builder;
pub mod expansion;
mod frames;
pub mod stubs;

pub use builder::{compile_robot, Builder};
