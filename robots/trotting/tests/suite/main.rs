//! The tests of the package: one binary.
// indices are those of the equations, several matrices at a time
#![allow(clippy::needless_range_loop)]

mod closed_loop;
mod gait;
mod slopes;
mod sweep;
