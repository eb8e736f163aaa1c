//! Derivatives of the motion that the inputs of drives make in a contact mode, over any scalar.
//!
//! q̈, F and ẋ obey H q̈ + h = τ(q, q̇, x, u, q̈) + Ĵᵀ F and J q̈ + A = s̈. Along a direction these are the equations of drives and contacts in dual numbers,
//! with H, J and Ĵ as they are, a bias force that moves by ∂(H q̈ + h) − ∂(Ĵᵀ F), and an adjoint vector that moves by ∂(J q̈ + A), at the q̈ and F that were
//! found. So links enter by the structured derivatives of inverse dynamics, contacts by their sweeps, and no factor of H is differentiated.

use super::derivatives::{fixed, slopes, FoundMotion, MovedContacts};
use super::equations::{supports, Added, CommonEquations, DrivenContacts, Footing};
use crate::function::{along, by_rows, with_rates, Function};
use straightline_core::algorithms::{ContactRows, FunctionalCoordinates};
use straightline_core::model::Model;
use straightline_core::{algorithms as alg, Dual, Real};

/// The equations along a direction.
struct MovingMotion<'a, T: Real> {
    equations: &'a CommonEquations<'a, T>,
    model: Model<Dual<T, 1>>,
    bias: Vec<T>,
    mass_matrix: Vec<Dual<T, 1>>,
    applied: Option<Vec<Vec<Dual<T, 1>>>>,
    /// q, q̇, x and u, which do not move.
    held: [Vec<Dual<T, 1>>; 4],
}

/// How things change along a direction.
struct DrivenChange<T> {
    /// q̈, ẋ and F.
    of: [Vec<T>; 3],
    /// The rates of each object's own coordinate.
    own_rates: Vec<Vec<T>>,
}

impl<T: Real> MovingMotion<'_, T> {
    /// Where the state moves so, and with it what the links need and the contacts.
    fn change(
        &self,
        [q, qd, x, u]: &[Vec<Dual<T, 1>>; 4],
        of_bias: &[T],
        moved: &MovedContacts<'_, T>,
        inputs: &Added<Dual<T, 1>>,
    ) -> DrivenChange<T> {
        let CommonEquations { constrained, options, epsilon, .. } = self.equations;
        let footings: Vec<&Footing<Dual<T, 1>>> = moved.footings.iter().collect();
        let of_contacts = moved.constrained();
        let (supports, own_rates) = supports(&footings, &of_contacts, options, inputs);
        let coordinates = FunctionalCoordinates {
            jacobian: constrained.jacobian.iter().map(|row| fixed(row)).collect(),
            bias: with_rates(&constrained.bias, &moved.along),
            ..of_contacts
        };
        let rows = ContactRows {
            coordinates: &coordinates,
            applied: self.applied.as_deref(),
            supports: &supports,
            ridge: Dual::fixed(*epsilon),
        };
        let bias = with_rates(&self.bias, of_bias);
        let (motion, drives) = alg::driven_contact_motion(&self.model, (q, qd, x, u), &bias, &self.mass_matrix, rows);
        DrivenChange {
            of: [slopes(&motion.qdd), slopes(&drives.xd), slopes(&motion.force)],
            own_rates: own_rates.iter().map(|list| slopes(list)).collect(),
        }
    }
}

impl<T: Real> CommonEquations<'_, T> {
    /// q̈, ẋ, F, and their derivatives by q, q̇, x, u and the objects' own coordinates.
    pub fn driven_forward_dynamics_derivatives(&self) -> Vec<Vec<T>> {
        let (nv, model, arguments) = (self.nv(), &self.bound.model, &self.bound.arguments);
        let DrivenContacts { bias, mass_matrix, applied, motion, drives, own_rates } = self.driven_motion();
        let found = FoundMotion { x: &motion.qdd, force: &motion.force, is_motion: true };
        let ([by_position, by_velocity], at_rest) = self.all_moved(&found);
        let of_links = self
            .of_robot(Function::InverseDynamicsDerivatives, &[self.q().clone(), self.qd().clone(), motion.qdd.clone()]);
        let moving = MovingMotion {
            equations: self,
            model: model.map(Dual::fixed),
            bias,
            mass_matrix: fixed(&mass_matrix),
            applied: applied.map(|rows| rows.iter().map(|row| fixed(row)).collect()),
            held: [0, 1, 2, 3].map(|k| fixed(&arguments[k])),
        };
        let inputs = self.held_inputs();
        let at_rest_bias = vec![T::zero(); nv];
        // the state where number k of q, q̇, x or u moves
        let moved_at = |place: usize, k: usize| {
            let mut at = moving.held.clone();
            match place {
                0 => at[0] = along(model, self.q(), k),
                _ => at[place][k] = Dual::variable(arguments[place][k], 0),
            }
            at
        };
        let by_state = |place: usize, moved: &[MovedContacts<'_, T>]| -> Vec<DrivenChange<T>> {
            let column = |(k, moved): (usize, &MovedContacts<'_, T>)| {
                let of_bias: Vec<T> = (0..nv).map(|i| of_links[(place * nv + i) * nv + k] - moved.pushed[i]).collect();
                moving.change(&moved_at(place, k), &of_bias, moved, &inputs)
            };
            moved.iter().enumerate().map(column).collect()
        };
        let by_drives = |place: usize| -> Vec<DrivenChange<T>> {
            let column = |k: usize| moving.change(&moved_at(place, k), &at_rest_bias, &at_rest, &inputs);
            (0..arguments[place].len()).map(column).collect()
        };
        let columns = [by_state(0, &by_position), by_state(1, &by_velocity), by_drives(2), by_drives(3)];
        let by_own: Vec<[DrivenChange<T>; 2]> = self
            .inputs_of_own_coordinates(&inputs)
            .into_iter()
            .map(|of_two| of_two.map(|inputs| moving.change(&moving.held, &at_rest_bias, &at_rest, &inputs)))
            .collect();
        let mut results = vec![motion.qdd.clone(), drives.xd, motion.force.clone()];
        for of in 0..3 {
            results.extend(columns.iter().map(|columns| block(columns, |change| &change.of[of])));
        }
        results.push(vec![motion.pivot]);
        let own = own_rates.len();
        results.extend(own_rates);
        for of in 0..3 {
            results.extend(by_own.iter().map(|columns| block(columns, |change| &change.of[of])));
        }
        for columns in &columns[..2] {
            results.extend((0..own).map(|c| block(columns, |change| &change.own_rates[c])));
        }
        results.extend(by_own.iter().enumerate().map(|(c, columns)| block(columns, |change| &change.own_rates[c])));
        results
    }
}

/// Derivatives by rows.
fn block<T: Copy>(columns: &[DrivenChange<T>], of: impl Fn(&DrivenChange<T>) -> &Vec<T>) -> Vec<T> {
    by_rows(&columns.iter().map(|change| of(change).clone()).collect::<Vec<_>>())
}
