//! The leg controller of a quadruped: every joint is a spring and a damper towards where it should be, and the inverse dynamics of the
//! whole robot, base and all, stand in front of them, so that the springs have little to do.
//! ```
//! use straightline_firmware_example::leg::{control_step, Gains, Measured, Solo12, Wanted};
//!
//! let gains = Gains { stiffness: [3.0; 12], damping: [0.1; 12] };
//! let mut measured = Measured { q: [0.0; 19], qd: [0.0; 18] };
//! measured.q[6] = 1.0; // the unit quaternion
//! let wanted = Wanted { q: [0.1; 12], qd: [0.0; 12], qdd: [0.0; 18] };
//! let mut tau = [0.0; 12];
//! control_step(&gains, &wanted, &measured, &mut tau).unwrap();
//!
//! // at rest: the weight of the legs, and 0.1 rad of the springs
//! let mut weight = [0.0; Solo12::NV];
//! Solo12::gravity_force(&measured.q, &mut weight);
//! assert!(tau.iter().zip(&weight[6..]).all(|(tau, w)| (tau - w - 0.3).abs() < 1e-5));
//! ```

use super::{are_within, Fault};
use straightline::control::{stop, Outcome, TorqueLimits};
use straightline::Dynamics;

/// The quadruped: constants and functions of its dynamics, in single precision, made for a Cortex-M4F.
#[derive(Dynamics)]
#[robot(
    "../descriptions/solo12.urdf",
    scalar = "f32",
    functions(inverse_dynamics, gravity_force),
    floating_base,
    target = "cortex-m4f"
)]
pub struct Solo12;

/// Joints of the legs: all but the six velocities of the base.
pub const JOINTS: usize = Solo12::NV - 6;

/// What the drives can do \[N·m\]: 2.7 by its makers.
pub const TORQUE_LIMIT: f32 = 2.7;

/// The motion that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Angles of the joints \[rad\].
    pub q: [f32; JOINTS],
    /// Their speeds \[rad/s\].
    pub qd: [f32; JOINTS],
    /// Accelerations of base and joints, as in `Solo12::inverse_dynamics`.
    pub qdd: [f32; Solo12::NV],
}

/// What the sensors and the estimator of the base say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Position and orientation of the base, angles of the joints, as in `Solo12::inverse_dynamics`.
    pub q: [f32; Solo12::NQ],
    /// Velocities.
    pub qd: [f32; Solo12::NV],
}

/// The springs and dampers of the joints \[N·m/rad, N·m·s/rad\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Springs.
    pub stiffness: [f32; JOINTS],
    /// Dampers.
    pub damping: [f32; JOINTS],
}

/// One step: the torques of the joints \[N·m\] for this millisecond, within [`TORQUE_LIMIT`].
///
/// # Errors
/// [`Fault`], and all torques zero.
#[inline(never)]
pub fn control_step(gains: &Gains, wanted: &Wanted, measured: &Measured, tau: &mut [f32; JOINTS]) -> Result<(), Fault> {
    let [_, _, _, _, _, _, _, angles @ ..] = &measured.q;
    let [_, _, _, _, _, _, speeds @ ..] = &measured.qd;
    if !are_within(angles, &Solo12::LOWER_LIMITS, &Solo12::UPPER_LIMITS) {
        stop(tau);
        return Err(Fault::OutOfRange);
    }
    let mut whole = wanted.qdd;
    Solo12::inverse_dynamics(&measured.q, &measured.qd, &wanted.qdd, &mut whole);
    let [_, _, _, _, _, _, forward @ ..] = &whole;
    for (i, tau) in tau.iter_mut().enumerate() {
        let spring = gains.stiffness[i] * (wanted.q[i] - angles[i]);
        *tau = forward[i] + (spring + gains.damping[i] * (wanted.qd[i] - speeds[i]));
    }
    match (TorqueLimits { greatest: [TORQUE_LIMIT; JOINTS] }).apply(tau) {
        Outcome::NotFinite => Err(Fault::NotFinite),
        Outcome::Within | Outcome::Saturated => Ok(()),
    }
}
