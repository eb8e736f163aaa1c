//! Passes: each takes a graph and returns a graph that computes the same results.

mod dead_code;

pub use dead_code::dead_code;
