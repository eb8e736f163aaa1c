//! Drives and contacts together: H* q̈ + h* = D u + Jᵀ F, (20.72) with (20.88).
//!
//! Rotors of rigid drives are part of H*, so that they are part of the inverse mass that reactions feel, and of what is struck
//! in an impact; those behind elastic transmissions are not, and go on turning through it. Gears without losses while an impact
//! lasts; otherwise losses follow the direction of power, reactions in it, as without contact.

use super::constraint::{constrained_forward_dynamics, ConstrainedMotion, Support};
use super::driven::{Driven, DrivenMotion};
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
        constrained_forward_dynamics(&driven.factor(&h), &drive, coordinates, applied, supports, ridge)
    };
    let (motion, losses) = driven.settled(solve, |motion| &motion.qdd);
    let drives = driven.finished((x, u), motion.qdd.clone(), &losses);
    (motion, drives)
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

/// What a jump Δq̇ does to the states of the drives: shafts of rigid drives jump with the joints, those of elastic ones only as far
/// as their rotors turn with a link in space. By entry of x.
pub fn driven_jump<T: Real>(model: &Model<T>, q: &[T], dqd: &[T]) -> Vec<T> {
    let (states, inputs) = (vec![T::zero(); super::drive_states(model)], vec![T::zero(); model.drives.len()]);
    let rest = vec![T::zero(); model.nv()];
    let driven = Driven::new(model, &model.drives, (q, &rest, &states, &inputs));
    // linear in the accelerations, which stand for their integrals
    let jump = driven.motion_per_input(dqd);
    let mut changes = Vec::new();
    for (k, drive) in model.drives.iter().enumerate() {
        let speed = match drive.stages.is_empty() {
            true => jump.phi[k],
            false => -(jump.spin[k] / driven.first_shaft(k)),
        };
        let mut own = vec![T::zero(); drive.states()];
        match &drive.actuator {
            Actuator::Motor(_) => own[1] = speed,
            // ẋ = … + f M: the impulse of M that makes T Δx = Δθ̇; T f is not zero, its inverse is an inertia
            Actuator::Linear(a) => {
                let gain = a.t.iter().zip(&a.f).fold(T::zero(), |sum, (t, f)| sum + *t * *f);
                own.iter_mut().zip(&a.f).for_each(|(x, f)| *x = *f * (speed / gain));
            }
        }
        changes.extend(own);
    }
    changes
}
