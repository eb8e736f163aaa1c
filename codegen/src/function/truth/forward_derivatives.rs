//! Derivatives of forward dynamics, by the second author: those of inverse dynamics in dual numbers, solved for.

use super::super::dynamics::ForwardDynamics;
use super::super::forward_derivatives::{
    ForwardDynamicsDerivatives, ForwardDynamicsDerivativesAtMotion, ForwardDynamicsHvp, ForwardDynamicsJvp,
    ForwardDynamicsVjp,
};
use super::super::Quantity;
use super::derivatives::{moving, slopes, unit, weighed_slopes, Direction};
use super::{solved, Chapter, Truth};
use crate::function::by_rows;
use nalgebra::{DMatrix, DVector};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference;
use straightline_core::{Dd, Dual, Real};

impl Truth for ForwardDynamicsDerivatives {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let system = MovingJoints::new(at);
        Some([ForwardDynamics::truth_of(at)?, system.derivatives(&system.acceleration(at))].concat())
    }
}

impl Truth for ForwardDynamicsDerivativesAtMotion {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(MovingJoints::new(at).derivatives(at.qdd()))
    }
}

impl Truth for ForwardDynamicsJvp {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let system = MovingJoints::new(at);
        let rates = system.acceleration_rate(&system.acceleration(at));
        Some(system.of_moving(&rates))
    }
}

impl Truth for ForwardDynamicsVjp {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let system = MovingJoints::new(at);
        let (qdd, by_force) = (system.acceleration(at), system.solved(at.get(Quantity::Multiplier)));
        let slopes = weighed_slopes(at, &at.tree, [at.q(), at.qd(), &qdd], &by_force);
        Some(system.gradient(&slopes.into_iter().map(|slope| -slope).collect::<Vec<_>>(), &by_force))
    }
}

impl Truth for ForwardDynamicsHvp {
    /// The gradient where q̈ and the multiplier of torques move, too.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let system = MovingJoints::new(at);
        let (qdd, by_force) = (system.acceleration(at), system.solved(at.get(Quantity::Multiplier)));
        let rates = system.acceleration_rate(&qdd);
        let tree = at.tree.map(Dual::<Magnitude, 1>::fixed);
        let motion = moving(at, &at.tree, [at.q(), at.qd(), &qdd], &system.direction(rates));
        let change = |rate: &[Magnitude]| -> Vec<Magnitude> {
            let multiplier = by_force.iter().zip(rate).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] });
            let multiplier: Vec<_> = multiplier.collect();
            let slopes = weighed_slopes(at, &tree, motion.each_ref().map(|x| &x[..]), &multiplier);
            slopes.into_iter().map(|slope| -slope.derivatives[0]).collect()
        };
        let nv = qdd.len();
        let rate = system.solved(&change(&vec![Magnitude::zero(); nv])[2 * nv..]);
        Some(system.gradient(&change(&rate), &rate))
    }
}

/// The joints that move, of which accelerations are solved for.
pub(super) struct MovingJoints<'a, 'b> {
    at: &'a Chapter<'b>,
    /// Their velocity coordinates.
    pub moving: Vec<usize>,
    /// H of them.
    pub h: DMatrix<Magnitude>,
}

impl<'a, 'b> MovingJoints<'a, 'b> {
    pub fn new(at: &'a Chapter<'b>) -> Self {
        MovingJoints::at(at, at.q())
    }

    /// At another configuration.
    pub fn at(at: &'a Chapter<'b>, q: &[Magnitude]) -> Self {
        let all: Vec<usize> = (0..at.qd().len()).collect();
        let moving = at.moving.unwrap_or(&all).to_vec();
        let h = at.inertia_at(q);
        let h = h.select_rows(&moving).select_columns(&moving);
        MovingJoints { at, moving, h }
    }

    /// H⁻¹ b, of the joints that move alone.
    pub fn response(&self, right: &DVector<Magnitude>) -> DVector<Magnitude> {
        solved(&self.h, right, reference::solve_symmetric::<Dd>)
    }

    /// H⁻¹ b of the joints that move, and zeros.
    pub fn solved(&self, right: &[Magnitude]) -> Vec<Magnitude> {
        let own = DVector::from_vec(self.of_moving(right));
        let mut whole = vec![Magnitude::zero(); self.at.qd().len()];
        let x = solved(&self.h, &own, reference::solve_symmetric::<Dd>);
        self.moving.iter().zip(x.iter()).for_each(|(i, x)| whole[*i] = *x);
        whole
    }

    /// How many velocity coordinates there are, with those of joints that are held.
    pub(super) fn all(&self) -> usize {
        self.at.qd().len()
    }

    pub fn of_moving(&self, x: &[Magnitude]) -> Vec<Magnitude> {
        self.moving.iter().map(|i| x[*i]).collect()
    }

    pub(super) fn acceleration(&self, at: &Chapter<'_>) -> Vec<Magnitude> {
        self.acceleration_of(at.q(), at.qd())
    }

    /// Of another motion, under the forces of the state.
    pub(super) fn acceleration_of(&self, q: &[Magnitude], qd: &[Magnitude]) -> Vec<Magnitude> {
        let at = self.at;
        let bias = at.forces_on(&at.tree, [q, qd, &vec![Magnitude::zero(); qd.len()]]);
        let net: Vec<Magnitude> = at.get(Quantity::Force).iter().zip(bias.iter()).map(|(tau, h)| *tau - *h).collect();
        self.solved(&net)
    }

    /// ∂q̈/∂q, ∂q̈/∂q̇ and H⁻¹ by rows.
    pub(super) fn derivatives(&self, qdd: &[Magnitude]) -> Vec<Magnitude> {
        let (at, nv) = (self.at, self.at.qd().len());
        let motion = [at.q(), at.qd(), qdd];
        let column = |block: usize, k: usize| -> Vec<Magnitude> {
            let right: Vec<Magnitude> = match block {
                2 => (0..nv).map(|i| if i == k { Magnitude::one() } else { Magnitude::zero() }).collect(),
                _ => slopes(at, &at.tree, motion, &unit(nv, block, k)).into_iter().map(|x| -x).collect(),
            };
            self.of_moving(&self.solved(&right))
        };
        let rows = |block: usize| by_rows(&self.moving.iter().map(|k| column(block, *k)).collect::<Vec<_>>());
        (0..3).flat_map(rows).collect()
    }

    /// Along the direction of the state.
    fn acceleration_rate(&self, qdd: &[Magnitude]) -> Vec<Magnitude> {
        let at = self.at;
        let held = vec![Magnitude::zero(); qdd.len()];
        let takes = slopes(at, &at.tree, [at.q(), at.qd(), qdd], &self.direction(held));
        let net: Vec<_> = at.get(Quantity::ForceDirection).iter().zip(takes).map(|(t, takes)| *t - takes).collect();
        self.solved(&net)
    }

    /// The direction of the state, in which accelerations change like this.
    fn direction(&self, qdd: Vec<Magnitude>) -> Direction<Magnitude> {
        let of = |quantity| self.at.get(quantity).to_vec();
        [of(Quantity::ConfigurationDirection), of(Quantity::VelocityDirection), qdd]
    }

    /// By q and q̇ of the joints that move, then by τ.
    fn gradient(&self, slopes: &[Magnitude], by_force: &[Magnitude]) -> Vec<Magnitude> {
        let nv = by_force.len();
        [&slopes[..nv], &slopes[nv..2 * nv], by_force].into_iter().flat_map(|x| self.of_moving(x)).collect()
    }
}
