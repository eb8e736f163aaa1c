//! The compiler.

pub mod description;
pub mod diagnostic;
