//! Two controllers as they stand in firmware: called 1000 times a second in single precision, `core` only, no allocation, no panic path,
//! time and stack known beforehand. `tests/suite/no_panic.rs` looks into the object files of the host and of a Cortex-M4F for calls;
//! `device/` runs both on the machine.
//!
//! * [`arm`]: computed torque of a Franka Emika Panda;
//! * [`leg`]: the twelve joints of a quadruped, Solo 12, with inverse dynamics of the whole robot in front of joint impedances.
#![no_std]
#![forbid(unsafe_code)]

pub mod arm;
pub mod leg;

/// Why there are no torques to trust; the drives are to be stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A number is not finite: a sensor failed.
    NotFinite,
    /// An angle is beyond the joint's limits, for which the dynamics were made: a sensor failed, or the robot is not where it can be.
    OutOfRange,
}

/// Whether all angles are within these limits; of what is no number: no.
fn are_within<const N: usize>(q: &[f32; N], lower: &[f32; N], upper: &[f32; N]) -> bool {
    q.iter().zip(lower.iter().zip(upper)).all(|(q, (lower, upper))| lower <= q && q <= upper)
}
