//! All that a body carries, about its origin: moments of its points, the same of their velocities relative to the body, and the wrench of the motion.

use super::super::reduced_dynamics::along_joint;
use super::super::reduced_mass_matrix::{of_body, rotated};
use super::{LimbSubtrees, MotionSweep};
use crate::model::BodyId;
use crate::real::Real;
use crate::reduced::ReducedJoint;
use crate::spatial::{Composite, ForceVector, Mat3, Vec3};
use alloc::vec::Vec;

/// In the axes in which the body is described.
#[derive(Clone, Debug)]
pub struct Subtree<T> {
    /// As one rigid body.
    pub composite: Composite<T>,
    /// ∫ r° rᵀ dm, r° the velocity relative to the body.
    pub spread: Mat3<T>,
    /// ∫ r° dm.
    pub drift: Vec3<T>,
    /// ∫ a dm and ∫ r × a dm, a the acceleration less gravity.
    pub wrench: ForceVector<T>,
}

impl<T: Real> Subtree<T> {
    /// Of all bodies; torques on the way.
    pub(super) fn all(sweep: &MotionSweep<'_, T>, tau: &mut [T], of_all: &mut LimbSubtrees<'_, T>) -> Vec<Self> {
        let own = |i: BodyId| Subtree::own(sweep, i);
        let mut all: Vec<Self> = (0..sweep.model.bodies.len()).map(own).collect();
        for i in (0..all.len()).rev() {
            T::section("backward", Some(i));
            let body = sweep.body(i);
            along_joint(sweep.model, body, &all[i].wrench, &mut |k, x| tau[k] = x);
            let Some(parent) = body.parent else { continue };
            let passed_on = || all[i].to_parent(sweep, i);
            let carried = of_all(i, &passed_on).unwrap_or_else(passed_on);
            let onto = &mut all[parent];
            onto.composite = onto.composite.plus(&carried.composite).named(parent);
            onto.spread = onto.spread + carried.spread;
            onto.drift = onto.drift + carried.drift;
            onto.wrench = onto.wrench + carried.wrench;
        }
        all
    }

    fn own(sweep: &MotionSweep<'_, T>, i: BodyId) -> Self {
        let (body, turn) = (sweep.body(i), &sweep.turns[i]);
        let o = [T::zero(); 3];
        Subtree {
            composite: of_body(body, turn),
            spread: Mat3 { rows: [o; 3] },
            drift: Vec3::zero(),
            wrench: sweep.links[i].wrench(body, turn),
        }
    }

    /// About the origin of the body's parent, relative to it, in its axes.
    fn to_parent(&self, sweep: &MotionSweep<'_, T>, i: BodyId) -> Self {
        let (body, turn, arm) = (sweep.body(i), &sweep.turns[i], sweep.links[i].arm);
        let (mut composite, mut spread, mut drift) = (self.composite, self.spread, self.drift);
        if let (Some((sin, cos)), false) = (turn.angle, body.stays) {
            composite = composite.turned((sin, cos));
            (spread, drift) = (spread.turned(sin, cos), drift.turned(sin, cos));
        }
        let rate = sweep.qd[body.iv];
        let (h, s, o) = (composite.first_moment, composite.second_moment, T::zero());
        match body.kind {
            // points move by q̇ z × r more against the parent
            ReducedJoint::Turn => {
                drift = drift + Vec3::new(-(rate * h.y), rate * h.x, o);
                let x = [-(rate * s.xy), -(rate * s.yy), -(rate * s.yz)];
                let y = [rate * s.xx, rate * s.xy, rate * s.xz];
                spread = spread + Mat3 { rows: [x, y, [o; 3]] };
            }
            // by q̇ z
            ReducedJoint::Slide => {
                drift = drift + Vec3::new(o, o, rate * composite.mass);
                spread = spread + Mat3 { rows: [[o; 3], [o; 3], [rate * h.x, rate * h.y, rate * h.z]] };
            }
            ReducedJoint::Free => unreachable!("a floating base has no parent"),
            ReducedJoint::Ball => unreachable!("robots with ball joints have no structured columns"),
        }
        let first_moment = turn.base_to_parent(body, composite.first_moment);
        let drift = turn.base_to_parent(body, drift);
        let (second_moment, spread) = match turn.continues {
            true => (composite.second_moment, spread),
            false => {
                let e = &body.rotation;
                (rotated(e, composite.second_moment, body.permutes), *e * spread * e.transpose())
            }
        };
        Subtree {
            composite: Composite::moved(composite.mass, (first_moment, second_moment), arm),
            // ∫ r° (d + r)ᵀ dm
            spread: spread + Mat3::outer(drift, arm),
            drift,
            wrench: sweep.wrench_to_parent(i, &self.wrench),
        }
    }
}
