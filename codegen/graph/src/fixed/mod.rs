//! Fixed point: programs of integers of 32 bits, for machines without floating point.
//!
//! A value x with the binary point f is held as the integer x·2^f, rounded; f may be anything, also negative. Points are
//! [chosen](points) per value from the certified ranges of all values over a box of inputs, so that no integer overflows, few have to be
//! shifted and results lose little. What comes out is a [program of words](words), whose interpreter gives the bits that any machine gives.
//!
//! # Why nothing overflows
//! Ranges are those of the *computed* values ([`ErrorAnalysis::with_errors`](crate::certify::ErrorAnalysis::with_errors): exact values and what all errors before them add up to). Each is
//! below 2^31 − 1 at its value's point, and at every point that a value is shifted to. Words wrap in reductions of angles alone.
//!
//! # Why the errors hold
//! Beside its operation on computed operands, a node of the graph is off by its *local* error: products and shifts round down, by less than a unit in
//! their last place; constants are rounded where they are used, per use; sines have the error of their kernel and of the reduction;
//! inputs were rounded to nearest when they were converted. [`certify`](crate::certify) takes such errors in place of those of a format, and
//! its proof holds as it stands.

pub mod points;
pub mod words;

mod costs;
mod lower;
#[cfg(test)]
mod tests;

pub use points::{fixed, FixedDemand, FixedProgram, NoFixedForm};
pub use words::{Product, WordId, WordOp, WordProgram};
