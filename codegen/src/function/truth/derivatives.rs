//! Derivatives of inverse dynamics, by the second author in dual numbers.

use super::super::derivatives::{
    InverseDynamicsDerivatives, InverseDynamicsHvp, InverseDynamicsJvp, InverseDynamicsVjp,
};
use super::super::dynamics::{InverseDynamics, MassMatrix};
use super::super::Quantity;
use super::closed::ClosingReal;
use super::{Chapter, Truth};
use crate::function::by_rows;
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{CentreOfMassTree, ReferenceJoint, ReferenceReal};
use straightline_core::{Dd, Dual, Real};

/// A direction in which q, q̇ and q̈ move: of q along its tangent.
pub(super) type Direction<T> = [Vec<T>; 3];

impl Truth for InverseDynamicsDerivatives {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let nv = at.qd().len();
        let [by_q, by_qd] = [0, 1].map(|block| {
            let column = |k: usize| slopes(at, &at.tree, motion(at), &unit(nv, block, k));
            by_rows(&(0..nv).map(column).collect::<Vec<_>>())
        });
        Some([by_q, by_qd, MassMatrix::truth_of(at)?, InverseDynamics::truth_of(at)?].concat())
    }
}

impl Truth for InverseDynamicsJvp {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(slopes(at, &at.tree, motion(at), &direction(at)))
    }
}

impl Truth for InverseDynamicsVjp {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(weighed_slopes(at, &at.tree, motion(at), at.get(Quantity::Multiplier)))
    }
}

impl Truth for InverseDynamicsHvp {
    /// The gradient at a state that moves along the direction.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let tree = at.tree.map(Dual::<Magnitude, 1>::fixed);
        let moving = moving(at, &at.tree, motion(at), &direction(at));
        let multiplier: Vec<_> = at.get(Quantity::Multiplier).iter().map(|x| Dual::fixed(*x)).collect();
        let slopes = weighed_slopes(at, &tree, moving.each_ref().map(|x| &x[..]), &multiplier);
        Some(slopes.into_iter().map(|slope| slope.derivatives[0]).collect())
    }
}

fn motion<'a>(at: &'a Chapter<'_>) -> [&'a [Magnitude]; 3] {
    [at.q(), at.qd(), at.qdd()]
}

fn direction(at: &Chapter<'_>) -> Direction<Magnitude> {
    [Quantity::ConfigurationDirection, Quantity::VelocityDirection, Quantity::AccelerationDirection]
        .map(|quantity| at.get(quantity).to_vec())
}

/// Coordinate `k` of q, q̇ or q̈ alone.
pub(super) fn unit<T: Real>(nv: usize, block: usize, k: usize) -> Direction<T> {
    let mut direction = [0; 3].map(|_| vec![T::zero(); nv]);
    direction[block][k] = T::one();
    direction
}

/// The derivatives of Σ λ τ by every coordinate of q, q̇ and q̈, one direction after the other.
pub(super) fn weighed_slopes<T: ClosingReal>(
    at: &Chapter<'_>,
    tree: &CentreOfMassTree<T>,
    motion: [&[T]; 3],
    multiplier: &[T],
) -> Vec<T> {
    let nv = motion[1].len();
    let slope = |block: usize, k: usize| {
        let column = slopes(at, tree, motion, &unit(nv, block, k));
        column.into_iter().zip(multiplier).fold(<T as Real>::zero(), |sum, (slope, weight)| sum + slope * *weight)
    };
    (0..3).flat_map(|block| (0..nv).map(move |k| (block, k))).map(|(block, k)| slope(block, k)).collect()
}

/// How forces change along a direction.
pub(super) fn slopes<T: ClosingReal>(
    at: &Chapter<'_>,
    tree: &CentreOfMassTree<T>,
    motion: [&[T]; 3],
    direction: &Direction<T>,
) -> Vec<T> {
    let motion = moving(at, tree, motion, direction);
    let forces = at.forces_on(&tree.map(Dual::fixed), motion.each_ref().map(|x| &x[..]));
    forces.iter().map(|force| force.derivatives[0]).collect()
}

/// A motion as it moves along a direction.
pub(super) fn moving<T: ClosingReal>(
    at: &Chapter<'_>,
    tree: &CentreOfMassTree<T>,
    motion: [&[T]; 3],
    direction: &Direction<T>,
) -> [Vec<Dual<T, 1>>; 3] {
    let rates = configuration_rates(tree, motion[0], &at.rates_on_tree(tree, motion[0], &direction[0]));
    let along =
        |x: &[T], rates: &[T]| x.iter().zip(rates).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] }).collect();
    [along(motion[0], &rates), along(motion[1], &direction[1]), along(motion[2], &direction[2])]
}

/// dq/dt at these velocities. The position of a free link moves by R v, its attitude, as that of a ball joint, by ½ (u, w) (ω, 0).
pub(super) fn configuration_rates<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let mut rates = vec![<T as Real>::zero(); q.len()];
    let half = T::constant(Dd::HALF);
    for link in &tree.links {
        let Some(first) = link.joint.quaternion() else {
            rates[link.iq] = qd[link.iv];
            continue;
        };
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| q[link.iq + first + k]);
        let [ox, oy, oz] = [0, 1, 2].map(|k| qd[link.iv + first + k]);
        let one = <T as Real>::one();
        if link.joint == ReferenceJoint::Free {
            let [vx, vy, vz] = [0, 1, 2].map(|k| qd[link.iv + k]);
            rates[link.iq..link.iq + 3].copy_from_slice(&[
                (one - (y * y + z * z) / half) * vx + (x * y - z * w) / half * vy + (x * z + y * w) / half * vz,
                (x * y + z * w) / half * vx + (one - (x * x + z * z) / half) * vy + (y * z - x * w) / half * vz,
                (x * z - y * w) / half * vx + (y * z + x * w) / half * vy + (one - (x * x + y * y) / half) * vz,
            ]);
        }
        let own = [
            (w * ox + y * oz - z * oy) * half,
            (w * oy + z * ox - x * oz) * half,
            (w * oz + x * oy - y * ox) * half,
            -(x * ox + y * oy + z * oz) * half,
        ];
        rates[link.iq + first..link.iq + first + 4].copy_from_slice(&own);
    }
    rates
}
