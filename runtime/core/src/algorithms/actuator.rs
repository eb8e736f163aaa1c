//! Actuators: the torque of a shaft that does not accelerate, and the derivative of the state (handbook chapter, 20.3).
//!
//! Whatever the actuator, its shaft puts out M = e − J θ̈: e is what it would put out without acceleration, J an inertia. Of
//! a motor these are C_M i − B θ̇ and the rotor's inertia (20.62). Of ẋ = C x + f M + d u with θ̈ = T ẋ,
//! T f M = θ̈ − T (C x + d u), so J = −1/(T f) and e = J T (C x + d u). That is why the complete model stays symmetric. Where T f = 0,
//! θ̈ = T (C x + d u) is all that there is, and M follows from the motion.

use crate::dd::Dd;
use crate::drive::{Actuator, Drive, LinearActuator, Motor};
use crate::real::Real;
use alloc::vec::Vec;

/// e and J of M = e − J θ̈ \[N·m, kg·m²\].
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeTorque<T> {
    pub torque: T,
    pub inertia: T,
}

/// The number between −`limit` and `limit` next to x.
///
/// (1 − w) x + w limit sgn x with w = 0, ½, 1 as |x| is below, at or above the limit: a choice without a branch, exact on
/// both sides, and at the limit, where the two are equal, too.
pub(super) fn saturated<T: Real>(x: T, limit: Option<T>) -> T {
    let Some(limit) = limit else { return x };
    let sign = x.sign();
    let beyond = step(x * sign - limit);
    x * (T::one() - beyond) + limit * sign * beyond
}

/// 0, ½ or 1 as x is below, at or above zero.
fn step<T: Real>(x: T) -> T {
    (x.sign() + T::one()) * T::constant(Dd::HALF)
}

/// θ̇ of the actuator's shaft; the shaft speed φ̇ where the transmission is rigid.
pub(super) fn actuator_speed<T: Real>(drive: &Drive<T>, x: &[T], phi_dot: T) -> T {
    match &drive.actuator {
        _ if drive.stages.is_empty() => phi_dot,
        Actuator::Motor(_) => x[1],
        Actuator::Linear(a) => dot(&a.t, x),
    }
}

/// θ of the actuator's shaft where the transmission is elastic.
pub(super) fn actuator_angle<T: Real>(drive: &Drive<T>, x: &[T]) -> T {
    match &drive.actuator {
        Actuator::Motor(_) => x[0],
        Actuator::Linear(a) => dot(a.position.as_ref().expect("an elastic transmission knows its angle"), x),
    }
}

/// The current of a motor \[A\]; under a current limit a motor without inductance takes no more.
pub(super) fn current<T: Real>(motor: &Motor<T>, drive: &Drive<T>, x: &[T], speed: T, u: T) -> T {
    match motor.inductance {
        Some(_) => x[2],
        // (20.66)
        None => {
            let unlimited = (saturated(u, drive.input_limit) - motor.emf_constant * speed) / motor.resistance;
            saturated(unlimited, drive.current_limit)
        }
    }
}

/// L di/dt \[V\] of a motor with inductance, (20.63); zero while the current is at its limit and would go beyond.
pub(super) fn inductive_voltage<T: Real>(motor: &Motor<T>, drive: &Drive<T>, x: &[T], speed: T, u: T) -> T {
    let i = x[2];
    let voltage = saturated(u, drive.input_limit) - motor.resistance * i - motor.emf_constant * speed;
    let Some(limit) = drive.current_limit else { return voltage };
    let sign = i.sign();
    let grows = step(voltage * sign);
    let beyond = match drive.soft_current {
        None => step(i * sign - limit),
        // 0 to 1 over the last part before the limit
        Some(part) => {
            let half = T::constant(Dd::HALF);
            saturated((i * sign - limit) / (part * limit) + half, Some(half)) + half
        }
    };
    voltage * (T::one() - beyond * grows)
}

/// e and J of a drive's actuator in a state.
pub(super) fn free_torque<T: Real>(drive: &Drive<T>, x: &[T], speed: T, u: T) -> FreeTorque<T> {
    match &drive.actuator {
        Actuator::Motor(m) => {
            let i = current(m, drive, x, speed, u);
            FreeTorque { torque: m.torque_constant * i - m.friction * speed, inertia: m.rotor_inertia }
        }
        Actuator::Linear(a) if a.is_unyielding => FreeTorque { torque: T::zero(), inertia: T::zero() },
        Actuator::Linear(a) => {
            let inertia = equivalent_inertia(a);
            FreeTorque { torque: inertia * loadless_acceleration(a, drive, x, u), inertia }
        }
    }
}

/// T (C x + d u): θ̈ of a shaft without load.
fn loadless_acceleration<T: Real>(a: &LinearActuator<T>, drive: &Drive<T>, x: &[T], u: T) -> T {
    dot(&a.t, &state_rate(a, x)) + dot(&a.t, &a.d) * saturated(u, drive.input_limit)
}

/// θ̈ of an actuator whose shaft does not give way, in a state; of others `None`.
pub(super) fn held_acceleration<T: Real>(drive: &Drive<T>, x: &[T], u: T) -> Option<T> {
    match &drive.actuator {
        Actuator::Linear(a) if a.is_unyielding => Some(loadless_acceleration(a, drive, x, u)),
        _ => None,
    }
}

/// ∂θ̈/∂u of an actuator whose shaft does not give way; of others `None`.
pub(super) fn held_gain<T: Real>(actuator: &Actuator<T>) -> Option<T> {
    match actuator {
        Actuator::Linear(a) if a.is_unyielding => Some(dot(&a.t, &a.d)),
        _ => None,
    }
}

/// ∂e/∂u: torque per input of an actuator without limits.
pub(super) fn input_gain<T: Real>(actuator: &Actuator<T>) -> T {
    match actuator {
        Actuator::Motor(m) if m.inductance.is_some() => T::zero(),
        Actuator::Motor(m) => m.torque_constant / m.resistance,
        Actuator::Linear(a) if a.is_unyielding => T::zero(),
        Actuator::Linear(a) => equivalent_inertia(a) * dot(&a.t, &a.d),
    }
}

/// ∂ẋ/∂u at a held shaft torque: d of (20.64) and (20.74); of θ̈ what the torque does comes with M.
pub(super) fn input_column<T: Real>(actuator: &Actuator<T>) -> Vec<T> {
    let o = T::zero();
    match actuator {
        Actuator::Motor(Motor { inductance: Some(l), .. }) => alloc::vec![o, o, T::one() / *l],
        Actuator::Motor(_) => alloc::vec![o, o],
        Actuator::Linear(a) => a.d.clone(),
    }
}

/// ẋ of the actuator, given its shaft's speed and acceleration and the torque M that it puts out.
pub(super) fn state_derivative<T: Real>(
    drive: &Drive<T>,
    x: &[T],
    (speed, acceleration): (T, T),
    torque: T,
    u: T,
) -> Vec<T> {
    match &drive.actuator {
        Actuator::Motor(m) => {
            let electric = m.inductance.map(|l| inductive_voltage(m, drive, x, speed, u) / l);
            [speed, acceleration].into_iter().chain(electric).collect()
        }
        Actuator::Linear(a) => {
            let u = saturated(u, drive.input_limit);
            let rate = state_rate(a, x).into_iter().zip(a.f.iter().zip(&a.d));
            rate.map(|(cx, (f, d))| cx + *f * torque + *d * u).collect()
        }
    }
}

/// C x.
pub(super) fn state_rate<T: Real>(a: &LinearActuator<T>, x: &[T]) -> Vec<T> {
    a.c.chunks(a.f.len()).map(|row| dot(row, x)).collect()
}

/// J = −1/(T f) of a shaft that gives way: T f is not zero.
fn equivalent_inertia<T: Real>(a: &LinearActuator<T>) -> T {
    -(T::one() / dot(&a.t, &a.f))
}

/// Σ a_i b_i.
pub(super) fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).map(|(a, b)| *a * *b).reduce(|sum, x| sum + x).unwrap_or_else(T::zero)
}
