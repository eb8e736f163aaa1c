//! Transmissions: gears with losses, elastic stages one after the other (handbook chapter, (20.68), (20.69), (20.98), (20.99)).

use super::actuator::{actuator_angle, actuator_speed, free_torque, held_acceleration};
use crate::drive::{Drive, Efficiency};
use crate::model::Model;
use crate::real::Real;
use alloc::vec::Vec;

/// What a drive does in a state, before anything accelerates.
#[derive(Clone, Debug)]
pub(super) struct DriveState<T> {
    /// φ̇ of the last shaft \[rad/s\].
    pub speed: T,
    /// Torque that reaches the last shaft while it does not accelerate \[N·m\].
    pub free: T,
    /// Inertia on the last shaft \[kg·m²\].
    pub inertia: T,
    /// θ̇ of the actuator's shaft \[rad/s\].
    pub actuator_speed: T,
    /// The actuator's torque at θ̈ = 0, and its inertia.
    pub actuator_torque: T,
    /// The actuator's own inertia J.
    pub actuator_inertia: T,
    /// θ̈ of the actuator's shaft, if it does not give way.
    pub held: Option<T>,
    /// The elastic stages.
    pub stages: Vec<StageState<T>>,
}

/// An elastic stage in a state.
#[derive(Clone, Debug)]
pub(super) struct StageState<T> {
    /// τ of the spring and damper on the next shaft \[N·m\].
    pub torque: T,
    /// Torque that it takes from the shaft before \[N·m\].
    pub taken: T,
    /// θ̇ of the shaft before.
    pub speed: T,
    /// Stretch θ/n − θ′ \[rad\] and its rate.
    pub stretch: (T, T),
}

impl<T: Real> DriveState<T> {
    /// Of a drive at its part of x and its input.
    pub fn new(model: &Model<T>, drive: &Drive<T>, q: &[T], qd: &[T], x: &[T], u: T) -> Self {
        let phi_dot = last_shaft(model, drive, qd, |joint| joint.1);
        let speed = actuator_speed(drive, x, phi_dot);
        let own = free_torque(drive, x, speed, u);
        let mut state = DriveState {
            speed: phi_dot,
            free: own.torque,
            // what turns with a shaft that does not give way is that shaft's load
            inertia: match drive.held_joint() {
                Some(_) => T::zero(),
                None => drive.shaft_inertia.map_or(own.inertia, |gears| own.inertia + gears),
            },
            actuator_speed: speed,
            actuator_torque: own.torque,
            actuator_inertia: own.inertia,
            held: held_acceleration(drive, x, u),
            stages: Vec::new(),
        };
        if drive.stages.is_empty() {
            return state;
        }
        let phi = last_shaft(model, drive, q, |joint| joint.0);
        let mut before = (actuator_angle(drive, x), speed);
        let mut rest = &x[drive.actuator.states()..];
        for (k, stage) in drive.stages.iter().enumerate() {
            let behind = if k + 1 < drive.stages.len() { (rest[0], rest[1]) } else { (phi, phi_dot) };
            rest = rest.get(2..).unwrap_or(&[]);
            // τ = c (θ/n − θ′) + d (θ̇/n − θ̇′)   (20.99)
            let stretch = (before.0 / stage.ratio - behind.0, before.1 / stage.ratio - behind.1);
            let elastic = stage.stiffness * stretch.0;
            let torque = stage.damping.map_or(elastic, |d| elastic + d * stretch.1);
            let taken = torque / stage.ratio * taking(stage.efficiency, torque, (before.1, Some(stage.ratio)));
            state.stages.push(StageState { torque, taken, speed: before.1, stretch });
            before = behind;
        }
        state.free = state.stages.last().expect("there is a stage").torque;
        state.inertia = drive.shaft_inertia.unwrap_or_else(T::zero);
        state
    }

    /// θ̈ of the shaft before stage k, (20.98) with (20.62); `spin` is what the link's turning adds to the actuator's.
    pub fn shaft_acceleration(&self, drive: &Drive<T>, k: usize, spin: T) -> T {
        if let (0, Some(held)) = (k, self.held) {
            return held;
        }
        let (driving, inertia) = match k {
            0 => (self.actuator_torque - spin, self.actuator_inertia + drive.stages[0].inertia),
            _ => (self.stages[k - 1].torque, drive.stages[k].inertia),
        };
        (driving - self.stages[k].taken) / inertia
    }
}

/// Σ n_j y_j over the joints of a drive, y = q or q̇.
pub(super) fn last_shaft<T: Real>(
    model: &Model<T>,
    drive: &Drive<T>,
    values: &[T],
    index: impl Fn((usize, usize)) -> usize,
) -> T {
    let at = |body: usize| {
        let joint = &model.bodies[body].joint;
        values[index((joint.iq, joint.iv))]
    };
    let terms = drive.joints.iter().map(|(body, ratio)| *ratio * at(*body));
    terms.reduce(|sum, x| sum + x).unwrap_or_else(T::zero)
}

/// What a gear makes of a torque that drives it, beside its ratio: η′, 1, 1/η″ for a power above, at and below zero. Power is
/// that of `torque` at the speed of the shaft before the gear.
pub(super) fn giving<T: Real>(efficiency: Option<Efficiency<T>>, torque: T, speed: T) -> T {
    match efficiency {
        None => T::one(),
        Some(e) => chosen(direction(&e, torque, (speed, None)), e.forward, T::one() / e.backward),
    }
}

/// The reverse: what a gear must be driven by, for the torque behind it. The speed is that of the shaft before the gear, with the
/// ratio whose sign says how the shaft behind it turns.
pub(super) fn taking<T: Real>(efficiency: Option<Efficiency<T>>, torque: T, speed: (T, Option<T>)) -> T {
    match efficiency {
        None => T::one(),
        Some(e) => chosen(direction(&e, torque, speed), T::one() / e.forward, e.backward),
    }
}

/// The sign of the power of a torque, smooth in the speed where the efficiency says so. Under the root stands a sum of squares
/// with w > 0.
fn direction<T: Real>(efficiency: &Efficiency<T>, torque: T, (speed, ratio): (T, Option<T>)) -> T {
    let of_speed = efficiency.speed.map_or(speed.sign(), |w| speed / (speed * speed + w * w).sqrt());
    let sign = torque.sign() * of_speed;
    ratio.map_or(sign, |ratio| sign * ratio.sign())
}

/// `above`, 1, `below` for s = 1, 0, −1, without a branch: the factors of the other two are exactly zero. In between the parabola
/// through the three, which is below 1 for s > 0 and above for s < 0 if `above` < 1 < `below`, or the other way round: no gear gives energy.
fn chosen<T: Real>(s: T, above: T, below: T) -> T {
    let half = T::constant(crate::dd::Dd::HALF);
    let square = s * s;
    above * ((square + s) * half) + below * ((square - s) * half) + (T::one() - square)
}
