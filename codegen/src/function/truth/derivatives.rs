//! Derivatives of inverse dynamics, by the second author in dual numbers.

use super::super::derivatives::InverseDynamicsDerivatives;
use super::super::dynamics::{InverseDynamics, MassMatrix};
use super::{Chapter, Truth};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{self, ReferenceJoint};
use straightline_core::{Dd, Dual, Real};

type Moving = Dual<Magnitude, 1>;

impl Truth for InverseDynamicsDerivatives {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let nv = at.qd().len();
        let columns: [Vec<Vec<Magnitude>>; 2] = [
            (0..nv).map(|k| column(at, &along(at, k), &fixed(at.qd()))).collect(),
            (0..nv).map(|k| column(at, &fixed(at.q()), &unit(at.qd(), k))).collect(),
        ];
        let rows = columns.into_iter().flat_map(|columns| {
            let rows = (0..nv).flat_map(|i| columns.iter().map(|column| column[i]).collect::<Vec<_>>());
            rows.collect::<Vec<_>>()
        });
        let others = [MassMatrix::truth(at)?, InverseDynamics::truth(at)?];
        Some(rows.chain(others.into_iter().flatten()).collect())
    }
}

fn fixed(x: &[Magnitude]) -> Vec<Moving> {
    x.iter().map(|x| Dual::fixed(*x)).collect()
}

fn unit(x: &[Magnitude], k: usize) -> Vec<Moving> {
    let mut moving = fixed(x);
    moving[k] = Dual::variable(x[k], 0);
    moving
}

/// How forces change along a direction of q and q̇.
fn column(at: &Chapter<'_>, q: &[Moving], qd: &[Moving]) -> Vec<Magnitude> {
    let tree = at.tree.map(Dual::fixed);
    let mut forces = reference::inverse_dynamics(&tree, q, qd, &fixed(at.qdd()));
    for effect in at.effects {
        forces[effect.iv] += effect.passive(q[effect.iq], qd[effect.iv]);
    }
    forces.iter().map(|force| force.derivatives[0]).collect()
}

/// The configuration as it moves with velocity coordinate `k` alone. A free link's position p moves by R v, its attitude by ½ (u, w) (ω, 0).
fn along(at: &Chapter<'_>, k: usize) -> Vec<Moving> {
    let mut q = fixed(at.q());
    let (zero, half) = (Magnitude::zero(), Magnitude::constant(Dd::HALF));
    for link in &at.tree.links {
        if link.joint != ReferenceJoint::Free {
            if link.iv == k {
                q[link.iq] = Dual::variable(at.q()[link.iq], 0);
            }
            continue;
        }
        let Some(direction) = k.checked_sub(link.iv).filter(|direction| *direction < 6) else { continue };
        let [x, y, z, w] = [3, 4, 5, 6].map(|k| at.q()[link.iq + k]);
        let rates = match direction {
            // columns of the rotation
            0 => [Magnitude::one() - (y * y + z * z) / half, (x * y + z * w) / half, (x * z - y * w) / half],
            1 => [(x * y - z * w) / half, Magnitude::one() - (x * x + z * z) / half, (y * z + x * w) / half],
            2 => [(x * z + y * w) / half, (y * z - x * w) / half, Magnitude::one() - (x * x + y * y) / half],
            _ => [zero; 3],
        };
        let turning = match direction {
            3 => [w, z, -y, -x],
            4 => [-z, w, x, -y],
            5 => [y, -x, w, -z],
            _ => [zero; 4],
        };
        let all = rates.into_iter().chain(turning.map(|x| x * half));
        all.enumerate().for_each(|(i, rate)| q[link.iq + i].derivatives[0] = rate);
    }
    q
}
