//! Programs of numbers: graphs of operations, the passes that make them cheaper, their order, and what they lose to rounding.
//!
//! Nothing here knows what is computed.
#![forbid(unsafe_code)]

#[macro_use]
mod number;

pub mod certify;
pub mod expr;
pub mod fixed;
pub mod lanes;
pub mod pass;
pub mod rounding;
pub mod schedule;
pub mod trace;

pub use expr::port_text::{element, element_of};
pub use number::{EveryScalar, Scalar};
