//! Constrained motion: accelerations and reactions of a robot in contact, (20.88)-(20.89), and what belongs to it.
//!
//! ```text
//! H q̈ + h = τ + Jᵀ F,    J q̈ + A = s̈*
//! ```
//!
//! with s̈* = 0 or what pulls a drift back (Baumgarte 1972). A contact that slides with Coulomb friction has its reaction act
//! along Ĵ = J − μ v_t/√(v_t² + w²) · J_t instead of J; one on a [yielding](super::Environment) object feels what the object does.
//! Reactions are positive along their coordinates: on a surface a positive one pushes the robot off.

use super::contact_system::{ContactRow, ContactSystem};
use super::factor::Ltdl;
use super::functional::{FunctionalCoordinates, RelativeMotion};
use crate::contact::{Contact, Coordinate};
use crate::real::Real;
use crate::spatial::Vec3;
use alloc::vec::Vec;

/// What a contact stands on: its row of the equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support<T> {
    /// s̈ = s̈* \[m/s² or 1/s²\].
    Rigid(T),
    /// F = −(m s̈ + load): a mass m ≥ 0 \[kg\] that moves with the contact, and the force \[N\] of what holds it.
    Yielding {
        /// m \[kg\].
        mass: T,
        /// Force that the object takes at this s and ṡ \[N\].
        load: T,
    },
}

/// A motion in contact.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstrainedMotion<T> {
    /// q̈ \[rad/s² or m/s²\].
    pub qdd: Vec<T>,
    /// F by constrained coordinate \[N or N·m\].
    pub force: Vec<T>,
    /// s̈^c = J q̈ + A by constrained coordinate.
    pub sdd: Vec<T>,
    /// s̈^c less what it should be, by constrained coordinate; of a yielding one zero.
    pub violation: Vec<T>,
    /// Least pivot against its diagonal entry: 1 for independent rows, about ε for redundant ones.
    pub pivot: T,
}

/// q̈ and F.   (20.88), (20.89)
///
/// `drive` is τ − h; `applied` the directions in which the reactions act, if other than those of J; `ridge` the ε of the
/// regularisation: each reaction is softened by ε of the inverse mass that it feels, and the error that this makes is
/// refined away: once for a single row, twice for more. 1e-12 in f64, 1e-6 in f32.
pub fn constrained_forward_dynamics<T: Real>(
    factor: &Ltdl<T>,
    drive: &[T],
    constrained: &FunctionalCoordinates<T>,
    applied: Option<&[Vec<T>]>,
    supports: &[Support<T>],
    ridge: T,
) -> ConstrainedMotion<T> {
    let rows: Vec<ContactRow<T>> = supports.iter().map(row_of).collect();
    let system = ContactSystem::new(factor, &constrained.jacobian, applied, &rows, ridge);
    motion_of(&system, factor, drive, constrained, supports)
}

/// The same with the system of the contacts at hand.
pub(super) fn motion_of<T: Real>(
    system: &ContactSystem<T>,
    factor: &Ltdl<T>,
    drive: &[T],
    constrained: &FunctionalCoordinates<T>,
    supports: &[Support<T>],
) -> ConstrainedMotion<T> {
    let half = factor.half(drive);
    // s̈ without reactions
    let free: Vec<T> = system.response(&half).into_iter().zip(&constrained.bias).map(|(x, a)| x + *a).collect();
    let right = free.iter().zip(supports).map(|(free, support)| match *support {
        Support::Rigid(wanted) => wanted - *free,
        Support::Yielding { mass, load } => -(load + mass * *free),
    });
    let force = system.solve(&right.collect::<Vec<T>>());
    let qdd = factor.finish(system.add_reactions(half, &force));
    let qdd: Vec<T> = qdd.into_iter().enumerate().map(|(i, x)| x.named("acceleration", i, "")).collect();
    T::section("acceleration of the contact", None);
    let sdd: Vec<T> = constrained.jacobian.iter().zip(&constrained.bias).map(|(row, a)| dot(row, &qdd) + *a).collect();
    let violation = sdd.iter().zip(supports).map(|(sdd, support)| match support {
        Support::Rigid(wanted) => *sdd - *wanted,
        Support::Yielding { .. } => T::zero(),
    });
    ConstrainedMotion { violation: violation.collect(), qdd, force, sdd, pivot: system.pivot }
}

pub(super) fn row_of<T: Real>(support: &Support<T>) -> ContactRow<T> {
    match *support {
        Support::Rigid(_) => ContactRow::Rigid,
        Support::Yielding { mass, .. } => ContactRow::Yielding(mass),
    }
}

fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::zero(), |sum, (x, y)| sum + *x * *y)
}

/// s̈* = −2 ζ ω ṡ − ω² s: a drift dies out with the frequency ω \[rad/s\] and the damping ratio ζ (Baumgarte 1972).
pub fn baumgarte<T: Real>(constrained: &FunctionalCoordinates<T>, frequency: T, damping: T) -> Vec<T> {
    let (square, twice) = (frequency * frequency, damping * frequency);
    let twice = twice + twice;
    constrained.value.iter().zip(&constrained.rate).map(|(s, sd)| -(twice * *sd + square * *s)).collect()
}

/// The change of coordinates, or of velocities, that takes `residual` (s, or ṡ) away to first order and costs the least
/// kinetic energy: −H⁻¹ Jᵀ G⁻¹ s. By velocity coordinate.
pub fn projection<T: Real>(
    factor: &Ltdl<T>,
    constrained: &FunctionalCoordinates<T>,
    residual: &[T],
    ridge: T,
) -> Vec<T> {
    let rows: Vec<ContactRow<T>> = residual.iter().map(|_| ContactRow::Rigid).collect();
    let system = ContactSystem::new(factor, &constrained.jacobian, None, &rows, ridge);
    let multipliers = system.solve(&residual.iter().map(|s| -*s).collect::<Vec<T>>());
    let rest = alloc::vec![T::zero(); constrained.jacobian.first().map_or(0, Vec::len)];
    factor.finish(system.add_reactions(factor.half(&rest), &multipliers))
}

/// τ for a wanted motion along free coordinates and wanted reactions along the constrained ones: hybrid feed-forward.
///
/// `inverse` is H q̈₀ + h of the joint accelerations that are wanted where the task leaves freedom, `qdd` those; of the
/// motions that keep the constraints and have s̈^f as wanted the one nearest to q̈₀ in kinetic energy is taken. Its
/// multipliers x give H (q̈ − q̈₀) = Jᵀ x, so that τ = H q̈₀ + h + Jᵀ x − J_cᵀ F. Both in the order constrained, then free.
pub fn hybrid_inverse_dynamics<T: Real>(
    factor: &Ltdl<T>,
    inverse: &[T],
    qdd: &[T],
    (constrained, free): (&FunctionalCoordinates<T>, &FunctionalCoordinates<T>),
    wanted: &[T],
    force: &[T],
    ridge: T,
) -> (Vec<T>, T) {
    let all = constrained.clone().and(free.clone());
    let rows: Vec<ContactRow<T>> = wanted.iter().map(|_| ContactRow::Rigid).collect();
    let system = ContactSystem::new(factor, &all.jacobian, None, &rows, ridge);
    let missing = all.jacobian.iter().zip(&all.bias).zip(wanted).map(|((j, a), w)| *w - *a - dot(j, qdd));
    let multipliers = system.solve(&missing.collect::<Vec<T>>());
    let tau = (0..inverse.len()).map(|i| {
        let motion = all.jacobian.iter().zip(&multipliers).fold(inverse[i], |sum, (row, x)| sum + row[i] * *x);
        constrained.jacobian.iter().zip(force).fold(motion, |sum, (row, f)| sum - row[i] * *f)
    });
    (tau.collect(), system.pivot)
}

/// The rows in which the reactions of a sliding contact act: that of its distance is tilted by friction,
/// Ĵ = J − μ v_t/√(v_t² + w²) · J_t. Below the root stands a sum of squares with w > 0.
pub fn applied_rows<T: Real>(
    contact: &Contact<T>,
    motion: &RelativeMotion<T>,
    constrained: &FunctionalCoordinates<T>,
) -> Vec<Vec<T>> {
    let mut rows = constrained.jacobian.clone();
    let Some((k, tilt)) = friction_tilt(contact, motion) else { return rows };
    for (i, entry) in rows[k].iter_mut().enumerate() {
        let along = tilt.iter().zip(&motion.jacobian).fold(T::zero(), |sum, (d, row)| sum + *d * row[i]);
        *entry = *entry - along;
    }
    rows
}

/// Of a contact that slides the place of its distance among the constrained coordinates, and μ v_t/√(v_t² + w²).
pub(super) fn friction_tilt<T: Real>(contact: &Contact<T>, motion: &RelativeMotion<T>) -> Option<(usize, [T; 3])> {
    let (Some(friction), Some(k)) = (contact.friction, contact.constrained.iter().position(|c| *c == Coordinate::Pz))
    else {
        return None;
    };
    T::section("friction", None);
    let n = contact.surface.normal(motion.position);
    let v = motion.velocity;
    let slip: Vec3<T> = v - n.scale(n.dot(v));
    let speed = (slip.dot(slip) + friction.speed * friction.speed).sqrt();
    Some((k, slip.scale(friction.coefficient / speed).to_array()))
}
