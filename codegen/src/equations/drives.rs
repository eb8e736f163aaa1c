//! The equations of a robot with drives.

use crate::choices::ForwardDynamicsMethod;
use crate::function::DriveFunction::{self, *};
use straightline_core::algorithms::{Links, MOST_DERIVATIVES};
use straightline_core::model::Model;
use straightline_core::reduced::ReducedModel;
use straightline_core::{algorithms as alg, Real, Taylor};

impl DriveFunction {
    /// Its value: all blocks, one after the other.
    pub(super) fn evaluate<T: Real>(
        self,
        rigid: &Rigid<T>,
        method: ForwardDynamicsMethod,
        inputs: &[Vec<T>],
    ) -> Vec<T> {
        let model = rigid.model;
        let arg = |i: usize| &inputs[i][..];
        let q = arg(0);
        if self == InverseDynamics {
            return inverse(rigid, inputs);
        }
        let bias = || rigid.bias(q, arg(1));
        let at = || (q, arg(1), arg(2), arg(3));
        let h: Vec<T>;
        let links = match method {
            ForwardDynamicsMethod::Factorisation => {
                h = if self.solves() { rigid.mass_matrix(q) } else { Vec::new() };
                Links::MassMatrix(&h)
            }
            _ if !self.solves() => Links::Articulated,
            _ if may_be_articulated(model) => Links::Articulated,
            _ => {
                h = rigid.mass_matrix(q);
                Links::MassMatrix(&h)
            }
        };
        match self {
            ForwardDynamics => {
                let motion = alg::driven_motion(model, at(), &bias(), &links);
                [motion.qdd, motion.xd].concat()
            }
            Torques => {
                let (tau, m) = alg::drive_torques(model, at(), &bias(), &links);
                [tau, m].concat()
            }
            CompleteModel => {
                let (h, bias, d) = alg::complete_model(model, (q, arg(1), arg(2)), &bias(), &rigid.mass_matrix(q));
                [h, bias, d].concat()
            }
            StateSpace => {
                let (c, d) = alg::state_space(model, (q, arg(1), arg(2)), &bias(), &rigid.mass_matrix(q));
                [c, d].concat()
            }
            Power => alg::drive_power(model, at(), &bias(), &links).to_vec(),
            Energy => alg::drive_energy(model, (q, arg(1), arg(2))).to_vec(),
            InverseDynamics => unreachable!("it has other inputs"),
        }
    }
}

/// Whether articulated bodies can solve for the motion: drives add to the diagonal of H, and nothing is lost.
pub(super) fn may_be_articulated<T: Real>(model: &Model<T>) -> bool {
    alg::drives_are_diagonal(&model.drives)
        && model.drives.iter().all(|d| d.efficiency.is_none() && d.held_joint().is_none())
}

/// The rigid bodies, by the plain or by the reduced form.
pub(super) struct Rigid<'a, T> {
    pub model: &'a Model<T>,
    /// For torques, and for the mass matrix.
    pub reduced: Option<(&'a ReducedModel<T>, &'a ReducedModel<T>)>,
}

impl<T: Real> Rigid<'_, T> {
    fn bias(&self, q: &[T], qd: &[T]) -> Vec<T> {
        match self.reduced {
            None => alg::bias_force(self.model, q, qd),
            Some((torques, _)) => {
                let rigid = alg::reduced_inverse_dynamics(torques, q, qd, &vec![T::zero(); qd.len()]);
                sum(rigid, alg::passive_force(self.model, q, qd))
            }
        }
    }

    fn mass_matrix(&self, q: &[T]) -> Vec<T> {
        let Some((_, composite)) = self.reduced else { return alg::mass_matrix(self.model, q) };
        let mut h = alg::reduced_mass_matrix(composite, q);
        let nv = self.model.nv();
        for (i, rotor) in alg::rotor_inertias(self.model).into_iter().enumerate() {
            h[i * nv + i] = h[i * nv + i] + rotor;
        }
        h
    }

    fn inverse_dynamics(&self, q: &[T], qd: &[T], qdd: &[T]) -> Vec<T> {
        let Some((torques, _)) = self.reduced else { return alg::inverse_dynamics(self.model, q, qd, qdd) };
        let rigid = alg::reduced_inverse_dynamics(torques, q, qd, qdd);
        let rotors = alg::rotor_inertias(self.model).into_iter().zip(qdd).map(|(i, qdd)| i * *qdd).collect();
        sum(rigid, sum(rotors, alg::passive_force(self.model, q, qd)))
    }
}

fn sum<T: Real>(a: Vec<T>, b: Vec<T>) -> Vec<T> {
    a.into_iter().zip(b).map(|(a, b)| a + b).collect()
}

/// The inverse problem over series of as many terms as it takes, rounded up; what is too much is never wanted.
fn inverse<T: Real>(rigid: &Rigid<T>, inputs: &[Vec<T>]) -> Vec<T> {
    match alg::inverse_orders(&rigid.model.drives).map_or(0, |o| o.of_torque) {
        0 => inverse_over::<T, 1>(rigid, inputs),
        1..=3 => inverse_over::<T, 4>(rigid, inputs),
        4..=7 => inverse_over::<T, 8>(rigid, inputs),
        8..=15 => inverse_over::<T, 16>(rigid, inputs),
        _ => inverse_over::<T, { MOST_DERIVATIVES + 1 }>(rigid, inputs),
    }
}

fn inverse_over<T: Real, const N: usize>(rigid: &Rigid<T>, inputs: &[Vec<T>]) -> Vec<T> {
    let reads_states = alg::reads_states(&rigid.model.drives);
    let (rates, x) = match reads_states {
        true => (&inputs[1..inputs.len() - 1], &inputs[inputs.len() - 1][..]),
        false => (&inputs[1..], &[][..]),
    };
    let rates: Vec<&[T]> = rates.iter().map(Vec::as_slice).collect();
    let (u, m) = alg::driven_inverse::<T, N>(rigid.model, &inputs[0], &rates, x, |model, q, qd, qdd| {
        let reduced = rigid.reduced.map(|(torques, h)| (torques.map(Taylor::fixed), h.map(Taylor::fixed)));
        Rigid { model, reduced: reduced.as_ref().map(|(a, b)| (a, b)) }.inverse_dynamics(q, qd, qdd)
    });
    [u, m].concat()
}
