//! Straightline: robot dynamics as straight-line code.
#![no_std]
#![forbid(unsafe_code)]
pub use straightline_core::Real;
