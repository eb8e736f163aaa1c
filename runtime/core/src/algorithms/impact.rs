//! Impact: velocities and impulses when a contact closes, (20.90)-(20.91) and (20.95)-(20.97).
//!
//! ```text
//! H Δq̇ = Ĵᵀ I,    ṡ'' = −e ṡ'
//! ```
//!
//! e = 0 is the chapter's plastic impact. Where the object has a mass m_e that is free to give way, ṡ is against it, and
//! m_e (ṡ_e'' − ṡ_e') = −I. Corrected: (20.97) printed m_e Δṡ = −F Δt, which with (20.95), (20.96) has only the zero
//! solution; it is the mass's own velocity that changes, and after a plastic impact it is the contact's. With friction the
//! impulse is tilted as the reaction of a contact that slides all through the impact.

use super::contact_system::{ContactRow, ContactSystem};
use super::factor::Ltdl;
use super::functional::FunctionalCoordinates;
use crate::dd::Dd;
use crate::real::Real;
use alloc::vec::Vec;

/// What a contact hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Struck<T> {
    /// A rigid object, or one whose motion is given.
    Rigid,
    /// A mass m_e ≥ 0 \[kg\] that moves along the coordinate with ṡ_e' \[m/s\] before; none at all makes no impact.
    Mass {
        /// m_e \[kg\].
        mass: T,
        /// ṡ_e' \[m/s\].
        velocity: T,
    },
}

/// What an impact does.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact<T> {
    /// Δq̇ \[rad/s or m/s\].
    pub dqd: Vec<T>,
    /// I = F Δt by constrained coordinate \[N·s or N·m·s\].
    pub impulse: Vec<T>,
    /// Δṡ of the contact \[m/s or 1/s\].
    pub dsd: Vec<T>,
    /// ṡ_e'' of the masses that are struck, by constrained coordinate \[m/s\]; of a rigid object zero.
    pub struck_velocity: Vec<T>,
    /// Kinetic energy that robot, rotors of its drives and struck masses lose \[J\]. Where a shaft does not give way, so that its joint goes on
    /// through the impact, the shaft's work in it counts: negative, if it puts more into the robot than is lost.
    pub energy_loss: T,
    /// As of [`ConstrainedMotion`](super::ConstrainedMotion).
    pub pivot: T,
}

/// Δq̇ and I for a coefficient of restitution e, 0 for a plastic impact.
pub fn impact<T: Real>(
    factor: &Ltdl<T>,
    qd: &[T],
    constrained: &FunctionalCoordinates<T>,
    applied: Option<&[Vec<T>]>,
    struck: &[Struck<T>],
    restitution: T,
    ridge: T,
) -> Impact<T> {
    let rows: Vec<ContactRow<T>> = struck.iter().map(row_struck).collect();
    let system = ContactSystem::new(factor, &constrained.jacobian, applied, &rows, ridge);
    blow_of(&system, factor, qd, constrained, (applied, struck), restitution)
}

/// The row of what a contact hits.
pub(super) fn row_struck<T: Real>(struck: &Struck<T>) -> ContactRow<T> {
    match *struck {
        Struck::Rigid => ContactRow::Rigid,
        Struck::Mass { mass, .. } => ContactRow::Yielding(mass),
    }
}

/// The same with the system of the contacts at hand.
pub(super) fn blow_of<T: Real>(
    system: &ContactSystem<T>,
    factor: &Ltdl<T>,
    qd: &[T],
    constrained: &FunctionalCoordinates<T>,
    (applied, struck): (Option<&[Vec<T>]>, &[Struck<T>]),
    restitution: T,
) -> Impact<T> {
    let relative: Vec<T> = constrained
        .rate
        .iter()
        .zip(struck)
        .map(|(sd, s)| match *s {
            Struck::Rigid => *sd,
            Struck::Mass { velocity, .. } => *sd - velocity,
        })
        .collect();
    let turned_round = T::one() + restitution;
    // G I = −(1 + e) ṡ,  or with a mass m_e G I + I = −(1 + e) m_e (ṡ − ṡ_e)
    let right = relative.iter().zip(struck).map(|(v, s)| match *s {
        Struck::Rigid => -(turned_round * *v),
        Struck::Mass { mass, .. } => -(turned_round * mass * *v),
    });
    let impulse = system.solve(&right.collect::<Vec<T>>());
    let rest = alloc::vec![T::zero(); qd.len()];
    let dqd = factor.finish(system.add_reactions(factor.half(&rest), &impulse));
    T::section("after the impact", None);
    let dsd = system.response_to(&impulse);
    let half = T::constant(Dd::HALF);
    let mean: Vec<T> = qd.iter().zip(&dqd).map(|(qd, d)| *qd + half * *d).collect();
    // T' − T'' = −Δq̇ᵀ H (q̇' + q̇'')/2 = −Σ I_i ĵ_i · (q̇' + q̇'')/2, and of a mass I (ṡ_e' + ṡ_e'')/2
    let directions = applied.unwrap_or(&constrained.jacobian);
    let mut energy_loss = T::zero();
    let mut struck_velocity = Vec::with_capacity(struck.len());
    for i in 0..impulse.len() {
        let of_contact = directions[i].iter().zip(&mean).fold(T::zero(), |sum, (j, v)| sum + *j * *v);
        let mut of_both = of_contact;
        struck_velocity.push(match struck[i] {
            Struck::Rigid => T::zero(),
            Struck::Mass { velocity, .. } => {
                let after = constrained.rate[i] + dsd[i] + restitution * relative[i];
                of_both = of_contact - half * (velocity + after);
                after
            }
        });
        energy_loss = energy_loss - impulse[i] * of_both;
    }
    // what holds a joint i in its motion gives R = (H Δq̇ − Ĵᵀ I)_i, and does the work R q̇_i
    for (i, inertial) in factor.on_held(&dqd) {
        let pushed = directions.iter().zip(&impulse).fold(T::zero(), |sum, (row, force)| sum + row[i] * *force);
        energy_loss = energy_loss - (inertial - pushed) * qd[i];
    }
    Impact { dqd, impulse, dsd, struck_velocity, energy_loss, pivot: system.pivot }
}
