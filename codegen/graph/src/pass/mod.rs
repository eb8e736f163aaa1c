//! Passes: each takes a graph and returns a graph that computes the same results.

pub mod cut;
mod dead_code;
mod order;
mod substitute;
mod sums;
mod unread_inputs;

pub use dead_code::dead_code;
pub use order::order;
pub use substitute::substitute;
pub use sums::{count_sums, sums};
pub use unread_inputs::unread_inputs;
