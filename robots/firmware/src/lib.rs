//! The torque controller of an arm, as it stands in firmware: called 1000 times a second, `core` only, no allocation, no
//! panic path (`tests/suite/no_panic.rs` looks into the object file for one), time and stack known beforehand.
//!
//! Computed torque: what the motion takes by the dynamics of the arm, plus what the deviation asks for. `tests/suite/closed_loop.rs` runs it
//! against a simulated arm.
//! ```
//! use straightline_firmware_example::{control_step, Gains, Measured, Ur5, Wanted};
//!
//! let gains = Gains { stiffness: [400.0; 6], damping: [40.0; 6] };
//! let wanted = Wanted { q: [0.0, -1.2, 1.4, 0.1, 0.2, 0.3], qd: [0.0; 6], qdd: [0.0; 6] };
//! let measured = Measured { q: wanted.q, qd: [0.0; 6] };
//! let mut tau = [0.0; Ur5::NV];
//! control_step(&gains, &wanted, &measured, &mut tau).unwrap();
//!
//! // on the spot, at rest: the weight alone, up to the rounding of f32
//! let mut weight = [0.0; Ur5::NV];
//! Ur5::gravity_force(&wanted.q, &mut weight);
//! assert!(tau.iter().zip(weight).all(|(t, w)| (t - w).abs() < 1e-4));
//! ```
#![no_std]
#![forbid(unsafe_code)]

use straightline::control::{computed_torque, Outcome, Reference, TorqueLimits};
use straightline::Dynamics;

/// The arm: constants and functions of its dynamics, in single precision.
#[derive(Dynamics)]
#[robot(
    "../descriptions/ur5.urdf",
    scalar = "f32",
    functions(inverse_dynamics, gravity_force),
    // the file writes π/2 with twelve digits
    angle_tolerance = 1e-10
)]
pub struct Ur5;

/// What the drives can do \[N·m\]; the robot file states no real limits.
pub const TORQUE_LIMITS: [f32; Ur5::NV] = [150.0, 150.0, 150.0, 28.0, 28.0, 28.0];

// The step must fit into a tenth of its millisecond on a processor of 100 MHz with a multiply-add per clock, loads and
// stores three times over: a robot file that outgrows this fails the build here.
const _: () = assert!(Ur5::INVERSE_DYNAMICS_COST.fma < 2500);

/// The motion that is asked for.
pub type Wanted = Reference<f32, { Ur5::NV }>;
/// What the sensors say.
pub type Measured = straightline::control::Measured<f32, { Ur5::NV }>;
/// How deviations die out: every joint like q̈ + damping q̇ + stiffness q = 0 \[1/s, 1/s²\].
pub type Gains = straightline::control::Gains<f32, { Ur5::NV }>;

/// Why there are no torques to trust; the drives are to be stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A number is not finite: a sensor failed, or an angle is outside of the domain of the sine.
    NotFinite,
}

/// One step: the torques \[N·m\] for this millisecond, within [`TORQUE_LIMITS`].
///
/// # Errors
/// [`Fault`], and all torques zero.
#[inline(never)]
pub fn control_step(
    gains: &Gains,
    wanted: &Wanted,
    measured: &Measured,
    tau: &mut [f32; Ur5::NV],
) -> Result<(), Fault> {
    *tau = computed_torque(wanted, measured, gains, Ur5::inverse_dynamics);
    match (TorqueLimits { greatest: TORQUE_LIMITS }).apply(tau) {
        Outcome::NotFinite => Err(Fault::NotFinite),
        Outcome::Within | Outcome::Saturated => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: Gains = Gains { stiffness: [400.0; 6], damping: [40.0; 6] };
    const WANTED: Wanted =
        Wanted { q: [0.3, -1.2, 1.4, 0.1, 0.2, 0.3], qd: [0.1, 0.2, -0.3, 0.4, 0.5, -0.6], qdd: [1.0; 6] };

    #[test]
    fn torques_stay_within_the_limits() {
        let mut tau = [0.0; 6];
        let far = Measured { q: [-3.0, 1.0, -1.0, 2.0, -2.0, 3.0], qd: [5.0; 6] };
        control_step(&GAINS, &WANTED, &far, &mut tau).unwrap();
        assert!(tau.iter().zip(TORQUE_LIMITS).all(|(t, limit)| t.abs() <= limit), "{tau:?}");
        assert!(tau.iter().zip(TORQUE_LIMITS).any(|(t, limit)| t.abs() == limit), "{tau:?}");
    }

    #[test]
    fn a_broken_sensor_stops_the_drives() {
        let mut tau = [1.0; 6];
        for bad in [f32::NAN, f32::INFINITY, 1e6] {
            let measured = Measured { q: [0.0, 0.0, bad, 0.0, 0.0, 0.0], qd: [0.0; 6] };
            assert_eq!(control_step(&GAINS, &WANTED, &measured, &mut tau), Err(Fault::NotFinite));
            assert_eq!(tau, [0.0; 6]);
        }
    }
}
