//! Drives and contacts together: H* q̈ + h* = D u + Jᵀ F, (20.72) with (20.88).
//!
//! Rotors of rigid drives are part of H*, so that they are part of the inverse mass that reactions feel, and of what is struck
//! in an impact; those behind elastic transmissions are not, and go on turning through it. Gears without losses while an impact
//! lasts; otherwise losses follow the direction of power, reactions in it, as without contact. Shafts that do not give way hold their
//! joints against reactions and impacts.

use super::constraint::{constrained_forward_dynamics, ConstrainedMotion, Support};
use super::driven::{times, Driven, DrivenMotion};
use super::factor::Ltdl;
use super::functional::FunctionalCoordinates;
use crate::drive::Actuator;
use crate::model::Model;
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;

/// The rows of what is closed, as of [`constrained_forward_dynamics`].
#[derive(Clone, Copy, Debug)]
pub struct ContactRows<'a, T> {
    /// s, ṡ, J and A.
    pub coordinates: &'a FunctionalCoordinates<T>,
    /// Directions in which reactions act, if other than those of J.
    pub applied: Option<&'a [Vec<T>]>,
    /// What the rows stand on.
    pub supports: &'a [Support<T>],
    /// ε of the regularisation.
    pub ridge: T,
}

/// q̈, F and ẋ under the inputs u, with losses and limits, and what goes on in the drives. `bias` and `mass_matrix` are h(q, q̇) and
/// H, nv × nv, with friction, springs and rotors of the joints themselves.
pub fn driven_contact_motion<T: Real>(
    model: &Model<T>,
    (q, qd, x, u): (&[T], &[T], &[T], &[T]),
    bias: &[T],
    mass_matrix: &[T],
    rows: ContactRows<T>,
) -> (ConstrainedMotion<T>, DrivenMotion<T>) {
    let driven = Driven::new(model, &model.drives, (q, qd, x, u));
    let solve = |losses: &[T]| {
        let mut h = mass_matrix.to_vec();
        driven.add_inertias(&mut h, losses);
        let drive: Vec<T> = driven.free_forces(losses).into_iter().zip(bias).map(|(f, h)| f - *h).collect();
        let ContactRows { coordinates, applied, supports, ridge } = rows;
        if !driven.holds() {
            return constrained_forward_dynamics(&driven.factor(&h), &drive, coordinates, applied, supports, ridge);
        }
        // what is known of q̈ is part of the right-hand sides
        let known = driven.known();
        let drive: Vec<T> = drive.into_iter().zip(times(&h, &known)).map(|(f, x)| f - x).collect();
        let rows = times(&coordinates.jacobian.concat(), &known);
        let bias = coordinates.bias.iter().zip(rows).map(|(a, x)| *a + x).collect();
        let moved = FunctionalCoordinates { bias, ..coordinates.clone() };
        let found = constrained_forward_dynamics(&driven.factor(&h), &drive, &moved, applied, supports, ridge);
        let qdd = found.qdd.iter().zip(&known).map(|(x, known)| *x + *known).collect();
        ConstrainedMotion { qdd, ..found }
    };
    let (motion, losses) = driven.settled(solve, |motion| &motion.qdd);
    let mut taken = Vec::new();
    if driven.holds() {
        let directions = rows.applied.unwrap_or(&rows.coordinates.jacobian);
        let inertial = times(mass_matrix, &motion.qdd);
        let pushed = pushed(directions, &motion.force, bias.len());
        let beside = inertial.into_iter().zip(bias).zip(pushed);
        taken = beside.map(|((inertial, h), push)| inertial + *h - push).collect();
    }
    let drives = driven.finished((x, u), motion.qdd.clone(), &losses, &taken);
    (motion, drives)
}

/// Ĵᵀ F.
fn pushed<T: Real>(directions: &[Vec<T>], force: &[T], nv: usize) -> Vec<T> {
    let along = |i: usize| directions.iter().zip(force).fold(T::zero(), |sum, (row, f)| sum + row[i] * *f);
    (0..nv).map(along).collect()
}

/// The factor of H*, without losses: for impacts and projections.
pub fn driven_factor<T: Real>(model: &Model<T>, q: &[T], mass_matrix: &[T]) -> Ltdl<T> {
    let (states, inputs) = (vec![T::zero(); super::drive_states(model)], vec![T::zero(); model.drives.len()]);
    let rest = vec![T::zero(); model.nv()];
    let driven = Driven::new(model, &model.drives, (q, &rest, &states, &inputs));
    let mut h = mass_matrix.to_vec();
    driven.add_inertias(&mut h, &vec![T::one(); model.drives.len()]);
    driven.factor(&h)
}

/// H* − H, nv × nv, without losses: what the drives add to the mass matrix for impacts and projections.
pub fn drive_inertia<T: Real>(model: &Model<T>, q: &[T]) -> Vec<T> {
    let (states, inputs) = (vec![T::zero(); super::drive_states(model)], vec![T::zero(); model.drives.len()]);
    let rest = vec![T::zero(); model.nv()];
    let driven = Driven::new(model, &model.drives, (q, &rest, &states, &inputs));
    let mut added = vec![T::zero(); model.nv() * model.nv()];
    driven.add_inertias(&mut added, &vec![T::one(); model.drives.len()]);
    added
}

/// What a jump Δq̇ does to the states of the drives: shafts of rigid drives jump with the joints, those of elastic ones only as far
/// as their rotors turn with a link in space. By entry of x. Shafts that do not give way do not jump, but what they hold against may reach
/// their other states: `held` is the impulse H Δq̇ − Ĵᵀ I that the joints take beside contacts, which is read for those alone.
pub fn driven_jump<T: Real>(model: &Model<T>, q: &[T], dqd: &[T], held: &[T]) -> Vec<T> {
    let (states, inputs) = (vec![T::zero(); super::drive_states(model)], vec![T::zero(); model.drives.len()]);
    let rest = vec![T::zero(); model.nv()];
    let driven = Driven::new(model, &model.drives, (q, &rest, &states, &inputs));
    // linear in the accelerations, which stand for their integrals
    let mut jump = driven.motion_per_input(dqd);
    if driven.holds() {
        // beside what the others take: (H* − H) Δq̇
        let ideal = vec![T::one(); model.drives.len()];
        let mut added = vec![T::zero(); model.nv() * model.nv()];
        driven.add_inertias(&mut added, &ideal);
        let others: Vec<T> = times(&added, dqd).into_iter().map(|x| -x).collect();
        jump.put = driven.put(held, &others);
    }
    let mut changes = Vec::new();
    for (k, drive) in model.drives.iter().enumerate() {
        let speed = match drive.stages.is_empty() {
            true => jump.phi[k],
            false if driven.is_unyielding(k) => T::zero(),
            false => -(jump.spin[k] / driven.first_shaft(k)),
        };
        let mut own = vec![T::zero(); drive.states()];
        match &drive.actuator {
            Actuator::Motor(_) => own[1] = speed,
            // ẋ = … + f M: the impulse of M is what holds the shaft
            Actuator::Linear(a) if a.is_unyielding => {
                let impulse = if drive.stages.is_empty() { jump.put[k] } else { jump.spin[k] };
                own.iter_mut().zip(&a.f).for_each(|(x, f)| *x = *f * impulse);
            }
            // that makes T Δx = Δθ̇; T f is not zero, its inverse is an inertia
            Actuator::Linear(a) => {
                let gain = a.t.iter().zip(&a.f).fold(T::zero(), |sum, (t, f)| sum + *t * *f);
                own.iter_mut().zip(&a.f).for_each(|(x, f)| *x = *f * (speed / gain));
            }
        }
        changes.extend(own);
    }
    changes
}
