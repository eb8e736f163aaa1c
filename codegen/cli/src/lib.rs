//! What the command `straightline` has beside the compiler: experiments and their files, and pages.
#![forbid(unsafe_code)]

#[cfg(feature = "logs")]
pub mod base_motion;
#[cfg(feature = "simulation")]
pub mod experiment;
pub mod html;
#[cfg(feature = "logs")]
pub mod identification;
#[cfg(feature = "logs")]
pub mod log_states;
#[cfg(feature = "logs")]
pub mod residual;
