//! The tests of the package: one binary.

mod closed_loop;
mod gait;
mod slopes;
