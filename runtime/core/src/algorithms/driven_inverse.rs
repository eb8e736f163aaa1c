//! The inputs of drives for a motion of the joints: the inverse problem of the complete model.
//!
//! From the joints back to the actuators: the forces τ(t) of the motion, the torque of the last shaft, then stage by stage
//! θ = n (θ′ + τ/c) and what the shaft takes, at last e = M + J θ̈ and the input that makes it. Every elastic stage takes two
//! derivatives of τ along the path, an inductance one; so q, q̇, q̈ are not enough, and everything runs over
//! [`Taylor`] series in time: the derivatives of the rigid inverse dynamics come out of its own recursion.
//!
//! What the motion does not say is read from the state: θ behind a damped spring, whose stretch follows a differential
//! equation, and the states of linear actuators.

use super::actuator::{actuator_angle, dot, state_rate};
use super::transmission::taking;
use crate::dd::Dd;
use crate::drive::{Actuator, Drive, LinearActuator};
use crate::joint::MOST_COORDINATES;
use crate::model::Model;
use crate::real::Real;
use crate::taylor::Taylor;
use alloc::vec;
use alloc::vec::Vec;

/// The most derivatives of a torque that are computed: fifteen elastic stages one after the other, and an inductance.
pub const MOST_DERIVATIVES: usize = 31;

/// What the inverse problem of a robot needs of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InverseOrders {
    /// How often the forces on the joints are differentiated: derivatives of q up to this plus two are read.
    pub of_torque: usize,
}

/// Whether the state of a drive is read: behind a damped spring, or of a linear actuator.
pub fn reads_states<T>(drives: &[Drive<T>]) -> bool {
    drives.iter().any(|d| matches!(d.actuator, Actuator::Linear(_)) || d.stages.iter().any(|s| s.damping.is_some()))
}

/// What the inverse problem needs; `None` if the inputs do not follow from the motion (ratios that are no regular square
/// matrix, a rotor in space on an elastic drive) or more than [`MOST_DERIVATIVES`] are wanted.
pub fn inverse_orders<T>(drives: &[Drive<T>]) -> Option<InverseOrders> {
    let mut of_torque = 0;
    for drive in drives {
        if drive.shares.is_none() || drive.rotor.is_some() && !drive.stages.is_empty() {
            return None;
        }
        let own = match &drive.actuator {
            Actuator::Motor(m) => usize::from(m.inductance.is_some()),
            Actuator::Linear(a) => a.relative_degree,
        };
        let stages: usize = drive.stages.iter().map(|s| if s.damping.is_some() { 1 } else { 2 }).sum();
        of_torque = of_torque.max(own + stages);
    }
    (of_torque <= MOST_DERIVATIVES).then_some(InverseOrders { of_torque })
}

/// Inputs u and actuator torques M \[N·m\] of a motion, as [`drive_demands`].
pub fn driven_inverse<T: Real, const N: usize>(
    terms: usize,
    model: &Model<T>,
    q: &[T],
    rates: &[&[T]],
    x: &[T],
    torques: impl FnOnce(&Model<Taylor<T, N>>, &[Taylor<T, N>], &[Taylor<T, N>], &[Taylor<T, N>]) -> Vec<Taylor<T, N>>,
) -> (Vec<T>, Vec<T>) {
    drive_demands(terms, model, q, rates, x, torques).into_iter().map(|d| (d.input, d.torque)).unzip()
}

/// What a motion asks of every drive: `rates` holds q̇ and all further derivatives that [`inverse_orders`] asks for, `torques` makes
/// τ of series q, q̇, q̈, each of so many `terms`, at most N. Limits are not applied: what comes out is what the motion takes.
///
/// `torques` is called once, with the model over series.
pub fn drive_demands<T: Real, const N: usize>(
    terms: usize,
    model: &Model<T>,
    q: &[T],
    rates: &[&[T]],
    x: &[T],
    torques: impl FnOnce(&Model<Taylor<T, N>>, &[Taylor<T, N>], &[Taylor<T, N>], &[Taylor<T, N>]) -> Vec<Taylor<T, N>>,
) -> Vec<Demand<T>> {
    let over_series: Model<Taylor<T, N>> = model.map(Taylor::fixed);
    let along = |first: usize| -> Vec<Taylor<T, N>> {
        (0..model.nv())
            .map(|i| Taylor::truncated(terms, rates[first.min(rates.len())..].iter().map(|r| r[i])))
            .collect()
    };
    let (qd, qdd) = (along(0), along(1));
    let q = positions(terms, model, q, &qd);
    let mut tau = torques(&over_series, &q, &qd, &qdd);
    subtract_rotors(&over_series, &q, &qd, &qdd, &mut tau);
    T::section("drives", None);
    let mut demands = Vec::new();
    let mut first = 0;
    for (drive, original) in over_series.drives.iter().zip(&model.drives) {
        let own = &x[first.min(x.len())..(first + drive.states()).min(x.len())];
        first += drive.states();
        demands.push(drive_input(terms, (&over_series, drive, original), [&q, &qd, &qdd], &tau, own));
    }
    demands
}

/// What a motion asks of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Demand<T> {
    /// u \[V, or the unit of u\].
    pub input: T,
    /// M that the actuator puts out \[N·m\].
    pub torque: T,
    /// Of a motor \[A\].
    pub current: Option<T>,
    /// Angle \[rad\] and speed \[rad/s\] of all shafts, from that of the actuator to the last one.
    pub shafts: Vec<[T; 2]>,
}

/// q as a series: its rates are q̇, but for a floating base, whose position and quaternion follow from (v, ω) in its own
/// axes: ṗ = R v, and q̇ = ½ q ∘ (ω, 0).
fn positions<T: Real, const N: usize>(
    terms: usize,
    model: &Model<T>,
    q: &[T],
    qd: &[Taylor<T, N>],
) -> Vec<Taylor<T, N>> {
    let mut series: Vec<Taylor<T, N>> = q.iter().map(|q| Taylor::truncated(terms, [*q])).collect();
    for joint in model.free_joints() {
        let own = joint.iq..joint.iq + joint.kind.nq();
        for k in 1..terms {
            let per = T::constant(Dd::ONE / Dd::from(k as f64));
            let mut rates = [Taylor::fixed(T::zero()); MOST_COORDINATES];
            let rates = &mut rates[..own.len()];
            joint.kind.configuration_rate(joint.coordinates(&series), joint.rates(qd), rates);
            for (x, rate) in series[own.clone()].iter_mut().zip(rates) {
                x.coefficients[k] = rate.coefficients[k - 1] * per;
            }
        }
    }
    series
}

/// What rotors on moving links take from the joints beside J θ̈, as in `driven.rs`: J (Nᵀ (a · ω̇) + J_ωᵀ (θ̈ a + θ̇ ω × a)).
fn subtract_rotors<S: Real>(model: &Model<S>, q: &[S], qd: &[S], qdd: &[S], tau: &mut [S]) {
    for drive in &model.drives {
        let Some(rotor) = &drive.rotor else { continue };
        let terms = super::driven::rotor_forces(model, drive, rotor, (q, qd, qdd));
        tau.iter_mut().zip(terms).for_each(|(tau, term)| *tau = *tau - term);
    }
}

/// What a motion asks of one drive.
fn drive_input<T: Real, const N: usize>(
    terms: usize,
    (model, drive, original): (&Model<Taylor<T, N>>, &Drive<Taylor<T, N>>, &Drive<T>),
    [q, qd, qdd]: [&[Taylor<T, N>]; 3],
    tau: &[Taylor<T, N>],
    x: &[T],
) -> Demand<T> {
    type Shaft<T, const N: usize> = [Taylor<T, N>; 3];
    let o = Taylor::fixed(T::zero());
    let sum = |row: &[(usize, Taylor<T, N>)], y: &[Taylor<T, N>], is_q: bool| {
        let index = |body: usize| if is_q { model.bodies[body].joint.iq } else { model.bodies[body].joint.iv };
        row.iter().map(|(body, n)| *n * y[index(*body)]).reduce(|a, b| a + b).unwrap_or(o)
    };
    let joints = &drive.joints;
    let mut shaft: Shaft<T, N> = [sum(joints, q, true), sum(joints, qd, false), sum(joints, qdd, false)];
    let given = sum(drive.shares.as_ref().expect("the inverse problem has a solution"), tau, false);
    let mut shafts = vec![[shaft[0].coefficients[0], shaft[1].coefficients[0]]];
    // the torque of the last shaft, and what the gear behind it takes for it
    let taken = given * taking(drive.efficiency, given, (shaft[1], None));
    let mut load = drive.shaft_inertia.map_or(taken, |gears| taken + gears * shaft[2]);
    for (k, stage) in drive.stages.iter().enumerate().rev() {
        let behind = shaft;
        shaft = match (stage.damping, k) {
            // τ = c (θ/n − θ′)
            (None, _) => {
                let theta = stage.ratio * (behind[0] + load / stage.stiffness);
                [theta, theta.derivative(), theta.derivative().derivative()]
            }
            // θ̇ = n (θ̇′ + (τ − c (θ/n − θ′)) / d), from the θ of now
            (Some(damping), _) => {
                let now = match k {
                    0 => actuator_angle(original, x),
                    _ => x[drive.actuator.states() + 2 * (k - 1)],
                };
                let mut theta = Taylor::truncated(terms, [now]);
                let rate = |theta: Taylor<T, N>| {
                    let slack = load - stage.stiffness * (theta / stage.ratio - behind[0]);
                    stage.ratio * (behind[1] + slack / damping)
                };
                for k in 1..terms {
                    let per = T::constant(Dd::ONE / Dd::from(k as f64));
                    theta.coefficients[k] = rate(theta).coefficients[k - 1] * per;
                }
                let speed = rate(theta);
                [theta, speed, speed.derivative()]
            }
        };
        load = load / stage.ratio * taking(stage.efficiency, load, (shaft[1], Some(stage.ratio)))
            + stage.inertia * shaft[2];
        shafts.push([shaft[0].coefficients[0], shaft[1].coefficients[0]]);
    }
    shafts.reverse();
    let mut current = None;
    let input = match &drive.actuator {
        Actuator::Motor(m) => {
            // C_M i = M + J θ̈ + B θ̇   (20.62), u = R i + L i̇ + C_E θ̇   (20.63)
            let i = (load + m.rotor_inertia * shaft[2] + m.friction * shaft[1]) / m.torque_constant;
            current = Some(i.coefficients[0]);
            let held = m.resistance * i + m.emf_constant * shaft[1];
            m.inductance.map_or(held, |l| held + l * i.derivative()).coefficients[0]
        }
        Actuator::Linear(_) => match &original.actuator {
            Actuator::Linear(a) => linear_input(a, shaft[2], load, x),
            Actuator::Motor(_) => unreachable!("both are the same drive"),
        },
    };
    Demand { input, torque: load.coefficients[0], current, shafts }
}

/// u from the r-th derivative of θ̈ = T ẋ: T Cʳ d u = θ̈⁽ʳ⁾ − T Cʳ⁺¹ x − Σ_{m ≤ r} T Cʳ⁻ᵐ f M⁽ᵐ⁾.
fn linear_input<T: Real, const N: usize>(
    a: &LinearActuator<T>,
    acceleration: Taylor<T, N>,
    torque: Taylor<T, N>,
    x: &[T],
) -> T {
    let r = a.relative_degree;
    // T Cᵏ b
    let power = |b: &[T], k: usize| {
        let mut v = b.to_vec();
        for _ in 0..k {
            v = state_rate(a, &v);
        }
        dot(&a.t, &v)
    };
    let mut rest = acceleration.derivative_at(r) - power(x, r + 1);
    for m in 0..=r {
        rest = rest - power(&a.f, r - m) * torque.derivative_at(m);
    }
    rest / power(&a.d, r)
}
