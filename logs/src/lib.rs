//! What robots log, and what it says of them.
//!
//! A [`log::JointLog`] is joint names, time stamps and columns of numbers, read from MCAP ([`mcap`]) or CSV ([`csv`]), with nothing repaired.
//! [`align`] puts what is [asked for](demand) into an order, judges the clock, and says what it met. [`smooth`], [`observer`], [`fit`] and [`episodes`] are what
//! residual torques take, [`weighted`] and [`consistent`] what identification does; they know no robot, and [`threads`] spreads columns over processors: model torques and regressors come from the caller.
#![forbid(unsafe_code)]

pub mod align;
pub mod cdr;
pub mod condition;
pub mod consistent;
pub mod csv;
pub mod demand;
pub mod episodes;
mod failure;
pub mod fit;
pub mod joint_state;
pub mod log;
pub mod mcap;
pub mod observer;
pub mod odometry;
mod records;
pub mod smooth;
pub mod threads;
pub mod transforms;
pub mod weighted;

pub use failure::LogError;
