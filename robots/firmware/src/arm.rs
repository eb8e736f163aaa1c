//! The torque controller of an arm: what the motion takes by the dynamics of the arm, plus what the deviation asks for.
//! `tests/suite/closed_loop.rs` runs it against a simulated arm.
//! ```
//! use straightline_firmware_example::arm::{control_step, Gains, Measured, Panda, Wanted};
//!
//! let gains = Gains { stiffness: [400.0; 7], damping: [40.0; 7] };
//! let wanted = Wanted { q: [0.0, -0.8, 0.0, -2.2, 0.0, 1.6, 0.8], qd: [0.0; 7], qdd: [0.0; 7] };
//! let measured = Measured { q: wanted.q, qd: [0.0; 7] };
//! let mut tau = [0.0; Panda::NV];
//! control_step(&gains, &wanted, &measured, &mut tau).unwrap();
//!
//! // on the spot, at rest: the weight alone, up to the rounding of f32
//! let mut weight = [0.0; Panda::NV];
//! Panda::gravity_force(&wanted.q, &mut weight);
//! assert!(tau.iter().zip(weight).all(|(t, w)| (t - w).abs() < 1e-4));
//! ```

use super::{are_within, Fault};
use straightline::control::{computed_torque, stop, Outcome, Reference, TorqueLimits};
use straightline::Dynamics;

/// The arm: constants and functions of its dynamics, in single precision, made for a Cortex-M4F.
#[derive(Dynamics)]
#[robot(
    "../descriptions/panda.urdf",
    scalar = "f32",
    functions(inverse_dynamics, gravity_force),
    target = "cortex-m4f"
)]
pub struct Panda;

/// What the drives can do \[N·m\], by the manufacturer; the robot file states no real limits.
pub const TORQUE_LIMITS: [f32; Panda::NV] = [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0];

// The step must fit into a tenth of its millisecond on a processor of 100 MHz with a multiply-add per clock, loads and
// stores three times over: a robot file that outgrows this fails the build here.
const _: () = assert!(Panda::INVERSE_DYNAMICS_COST.fma < 2500);

/// The motion that is asked for.
pub type Wanted = Reference<f32, { Panda::NV }>;
/// What the sensors say.
pub type Measured = straightline::control::Measured<f32, { Panda::NV }>;
/// How deviations die out: every joint like q̈ + damping q̇ + stiffness q = 0 \[1/s, 1/s²\].
pub type Gains = straightline::control::Gains<f32, { Panda::NV }>;

/// One step: the torques \[N·m\] for this millisecond, within [`TORQUE_LIMITS`].
///
/// # Errors
/// [`Fault`], and all torques zero.
#[inline(never)]
pub fn control_step(
    gains: &Gains,
    wanted: &Wanted,
    measured: &Measured,
    tau: &mut [f32; Panda::NV],
) -> Result<(), Fault> {
    *tau = [measured.q[0]; Panda::NV];
    if !are_within(&measured.q, &Panda::LOWER_LIMITS, &Panda::UPPER_LIMITS) {
        stop(tau);
        return Err(Fault::OutOfRange);
    }
    *tau = computed_torque(wanted, measured, gains, Panda::inverse_dynamics);
    match (TorqueLimits { greatest: TORQUE_LIMITS }).apply(tau) {
        Outcome::NotFinite => Err(Fault::NotFinite),
        Outcome::Within | Outcome::Saturated => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: Gains = Gains { stiffness: [400.0; 7], damping: [40.0; 7] };
    const WANTED: Wanted =
        Wanted { q: [0.3, -0.8, 0.4, -2.1, 0.2, 1.6, 0.3], qd: [0.1, 0.2, -0.3, 0.4, 0.5, -0.6, 0.7], qdd: [1.0; 7] };

    #[test]
    fn torques_stay_within_the_limits() {
        let mut tau = [0.0; 7];
        let far = Measured { q: [-2.0, 1.0, -1.0, -0.2, -2.0, 3.0, 2.0], qd: [5.0; 7] };
        control_step(&GAINS, &WANTED, &far, &mut tau).unwrap();
        assert!(tau.iter().zip(TORQUE_LIMITS).all(|(t, limit)| t.abs() <= limit), "{tau:?}");
        assert!(tau.iter().zip(TORQUE_LIMITS).any(|(t, limit)| t.abs() == limit), "{tau:?}");
    }

    #[test]
    fn a_broken_sensor_stops_the_drives() {
        for (bad, fault) in
            [(f32::NAN, Fault::OutOfRange), (f32::INFINITY, Fault::OutOfRange), (2.9, Fault::OutOfRange)]
        {
            let mut tau = [1.0; 7];
            let mut measured = Measured { q: WANTED.q, qd: [0.0; 7] };
            measured.q[2] = bad;
            assert_eq!(control_step(&GAINS, &WANTED, &measured, &mut tau), Err(fault));
            assert_eq!(tau, [0.0; 7]);
        }
        let (mut tau, mut measured) = ([1.0; 7], Measured { q: WANTED.q, qd: [0.0; 7] });
        measured.qd[4] = f32::NAN;
        assert_eq!(control_step(&GAINS, &WANTED, &measured, &mut tau), Err(Fault::NotFinite));
        assert_eq!(tau, [0.0; 7]);
    }
}
