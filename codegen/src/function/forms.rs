//! A robot in the forms that functions are evaluated on: its own parameters, and reduced ones that take fewer operations.

use super::SelectedRows;
use std::cell::RefCell;
use straightline_core::algorithms as alg;
use straightline_core::model::{Frame, Model};
use straightline_core::reduced::ReducedModel;
use straightline_core::spatial::Vec3;
use straightline_core::Real;

/// How forward dynamics is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ForwardDynamicsMethod {
    /// Whichever takes fewer operations for this robot, unless it loses digits that the other keeps.
    #[default]
    Cheaper,
    /// The bias force, then articulated bodies.
    ArticulatedBody,
    /// The bias force, the mass matrix, and its branch-sparse LᵀDL factor.
    Factorisation,
}

/// A robot as functions see it.
pub struct Forms<'a, T> {
    /// As the robot file has it.
    pub model: &'a Model<T>,
    /// The reduced robot for torques and the one for the mass matrix; `None`: everything by the model.
    pub reduced: Option<[&'a ReducedModel<T>; 2]>,
    /// The frames that are asked for.
    pub frames: &'a [&'a Frame<T>],
    /// The rows of tasks that are asked for.
    pub rows: SelectedRows,
    /// How forward dynamics is computed.
    pub method: ForwardDynamicsMethod,
    /// Limbs in lanes, of the reduced robot.
    pub limbs: Option<RefCell<LimbSums<'a, T>>>,
    /// What computes columns that are alike, if they are to be lanes.
    pub columns: Option<&'a dyn AlikeColumns<T>>,
}

/// Computes columns that are alike: it knows of them what one of them does not.
pub trait AlikeColumns<T> {
    /// `one` of each of these columns.
    fn of(&self, columns: &[Vec<T>], one: &dyn Fn(&[T]) -> Vec<T>) -> Vec<Vec<T>>;
}

/// What the bodies that stand for several limbs each pass on to those that carry them, all limbs together: see
/// [`alg::reduced_inverse_dynamics_with_limbs`], [`alg::reduced_gravity_force_with_limbs`] and
/// [`alg::reduced_inverse_dynamics_derivatives_with_limbs`].
pub struct LimbSums<'a, T> {
    /// Force and moment.
    pub wrench: &'a mut alg::LimbWrenches<'a, T>,
    /// First moment and mass.
    pub first_moment: &'a mut alg::LimbMoments<'a, T>,
    /// Moments of points and of their velocities, and the wrench.
    pub subtree: &'a mut alg::LimbSubtrees<'a, T>,
}

impl<'a, T: Real> Forms<'a, T> {
    /// By the model alone.
    pub fn plain(model: &'a Model<T>, frames: &'a [&'a Frame<T>], method: ForwardDynamicsMethod) -> Self {
        Forms { model, reduced: None, frames, rows: SelectedRows::ALL, method, limbs: None, columns: None }
    }

    pub(super) fn with_limbs<R>(&self, f: impl FnOnce(&mut LimbSums<'_, T>) -> R) -> R {
        match &self.limbs {
            Some(limbs) => f(&mut limbs.borrow_mut()),
            None => {
                f(&mut LimbSums { wrench: &mut |_, _| None, first_moment: &mut |_, _| None, subtree: &mut |_, _| None })
            }
        }
    }

    /// `one` of each of these columns, which are computed alike.
    pub(super) fn columns(&self, columns: &[Vec<T>], one: &dyn Fn(&[T]) -> Vec<T>) -> Vec<Vec<T>> {
        match self.columns {
            Some(alike) => alike.of(columns, one),
            None => columns.iter().map(|column| one(column)).collect(),
        }
    }

    /// τ = H q̈ + h.
    pub fn inverse_dynamics(&self, q: &[T], qd: &[T], qdd: &[T]) -> Vec<T> {
        let Some([torques, _]) = self.reduced else { return alg::inverse_dynamics(self.model, q, qd, qdd) };
        self.with_effects(self.rigid_forces(torques, [q, qd, qdd]), [q, qd, qdd])
    }

    /// The reduced robot that derivatives have a structured form on.
    pub(super) fn with_columns(&self) -> Option<&'a ReducedModel<T>> {
        self.reduced.map(|[torques, _]| torques).filter(|torques| torques.has_columns())
    }

    /// Forces of the bodies by a reduced robot, which is a tree whose joints all have coordinates of their own.
    fn rigid_forces(&self, torques: &ReducedModel<T>, motion: [&[T]; 3]) -> Vec<T> {
        let [q, qd, qdd] = &self.model.tree_motion(motion);
        let of_tree = self.with_limbs(|l| alg::reduced_inverse_dynamics_with_limbs(torques, [q, qd, qdd], l.wrench));
        self.model.free_forces(q, of_tree)
    }

    /// Forces of the bodies with those that rotors, friction and springs of the joints take.
    pub(super) fn with_effects(&self, rigid: Vec<T>, [q, qd, qdd]: [&[T]; 3]) -> Vec<T> {
        let passive = alg::passive_force(self.model, q, qd);
        let rotors = alg::rotor_forces(self.model, [q, qd, qdd]).into_iter();
        rigid.into_iter().zip(rotors.zip(passive)).map(|(f, (r, p))| f + (r + p)).collect()
    }

    /// The mass matrix of the bodies with the inertia of the joints' rotors.
    pub(super) fn with_rotors(&self, q: &[T], mut h: Vec<T>) -> Vec<T> {
        alg::add_rotors(self.model, q, &mut h);
        h
    }

    /// g(q).
    pub fn gravity_force(&self, q: &[T]) -> Vec<T> {
        match self.reduced {
            Some([torques, _]) => {
                let q = &*self.model.tree_positions(q);
                let of_tree = self.with_limbs(|l| alg::reduced_gravity_force_with_limbs(torques, q, l.first_moment));
                self.model.free_forces(q, of_tree)
            }
            None => alg::gravity_force(self.model, q),
        }
    }

    /// h(q, q̇).
    pub fn bias_force(&self, q: &[T], qd: &[T]) -> Vec<T> {
        let Some([torques, _]) = self.reduced else { return alg::bias_force(self.model, q, qd) };
        let rigid = self.rigid_forces(torques, [q, qd, &self.rest()]);
        if !self.model.closure.is_empty() {
            return self.with_effects(rigid, [q, qd, &self.rest()]);
        }
        let passive = alg::passive_force(self.model, q, qd);
        rigid.into_iter().zip(passive).map(|(f, p)| f + p).collect()
    }

    /// C(q, q̇) q̇.
    pub fn velocity_force(&self, q: &[T], qd: &[T]) -> Vec<T> {
        let Some([torques, _]) = self.reduced else { return alg::velocity_force(self.model, q, qd) };
        let weightless = ReducedModel { gravity: Vec3::zero(), ..torques.clone() };
        let rigid = self.rigid_forces(&weightless, [q, qd, &self.rest()]);
        alg::with_rotors_of_loops(self.model, [q, qd], rigid)
    }

    /// The same robot without gravity, frames and limbs in lanes.
    pub(super) fn weightless<R>(&self, run: impl FnOnce(&Forms<'_, T>) -> R) -> R {
        let model = Model { gravity: Vec3::zero(), ..self.model.clone() };
        let weightless = |form: &ReducedModel<T>| ReducedModel { gravity: Vec3::zero(), ..form.clone() };
        let reduced = self.reduced.map(|forms| forms.map(weightless));
        let reduced = reduced.as_ref().map(|[torques, composite]| [torques, composite]);
        let (rows, method, columns) = (self.rows, self.method, self.columns);
        run(&Forms { model: &model, reduced, frames: &[], rows, method, limbs: None, columns })
    }

    /// H(q), by rows.
    pub fn mass_matrix(&self, q: &[T]) -> Vec<T> {
        let Some([_, composite]) = self.reduced else { return alg::mass_matrix(self.model, q) };
        let y = &*self.model.tree_positions(q);
        let of_tree = alg::reduced_mass_matrix(composite, y);
        self.with_rotors(q, self.model.free_symmetric(y, of_tree))
    }

    /// Whether accelerations are solved for by the factor of H: what follows another joint or from a loop is no body that is free at its own.
    pub(super) fn factorises(&self) -> bool {
        self.method == ForwardDynamicsMethod::Factorisation || !self.model.is_tree()
    }

    /// q̇ = 0 or q̈ = 0.
    pub fn rest(&self) -> Vec<T> {
        vec![T::zero(); self.model.nv()]
    }
}
