//! The wrenches that belong to one joint: of the momentum of its unit rate, and of what its position and its rate change.

use super::subtree::Subtree;
use super::MotionSweep;
use crate::model::BodyId;
use crate::real::Real;
use crate::reduced::ReducedJoint;
use crate::spatial::{ForceVector, Vec3};

/// About an origin on the way from the joint to the base, over the links behind the joint; y is the velocity of points per unit rate of the joint.
#[derive(Clone)]
pub(super) struct Column<T> {
    /// ∫ y dm and ∫ r × y dm.
    pub momentum: ForceVector<T>,
    /// 2 ∫ ṙ × y dm, ṙ the velocity against the origin.
    pub convected: Vec3<T>,
    /// ∫ ÿ dm and ∫ (r × ÿ + y × a) dm.
    pub by_position: ForceVector<T>,
    /// 2 ∫ ẏ dm and 2 ∫ r × ẏ dm.
    pub by_rate: ForceVector<T>,
}

impl<T: Real> Column<T> {
    /// At the joint's own origin, in the axes in which its body is described.
    pub fn new(sweep: &MotionSweep<'_, T>, i: BodyId, subtree: &Subtree<T>) -> Self {
        match sweep.body(i).kind {
            ReducedJoint::Turn => Column::of_turn(sweep, i, subtree),
            ReducedJoint::Slide => Column::of_slide(sweep, i, subtree),
            ReducedJoint::Free => unreachable!("a floating base has columns of its own"),
            ReducedJoint::Ball => unreachable!("robots with ball joints have no structured columns"),
        }
    }

    /// y = z × r, ẏ = (ω × z) × r + z × ṙ, ÿ = U' r + 2 (ω × z) × r° + z × r̈ with U' = U \[z×\] − \[z×\] U beside what is relative to the body.
    fn of_turn(sweep: &MotionSweep<'_, T>, i: BodyId, subtree: &Subtree<T>) -> Self {
        let link = &sweep.links[i];
        let (w, a) = (link.spin.omega, link.accel);
        let [[_, _, u13], [_, _, u23], [u31, u32, _]] = link.spin.u.rows;
        // U₂₂ − U₁₁ and 2 ω_x ω_y
        let (difference, xy2) = (link.spin.differences.z, link.spin.xy + link.spin.xy);
        let (m, h, s) = (subtree.composite.mass, subtree.composite.first_moment, subtree.composite.second_moment);
        let (n, v) = (&subtree.spread.rows, subtree.drift);
        let two = |x: T| x + x;
        let (wx, wy, wz) = (two(w.x), two(w.y), two(w.z));
        let f = subtree.wrench;
        let momentum =
            ForceVector { force: Vec3::new(-h.y, h.x, T::zero()), moment: Vec3::new(-s.xz, -s.yz, s.xx + s.yy) };
        let along = two(n[0][0] + n[1][1]);
        let convected = Vec3::new(
            wy * s.xx - wx * s.xy - two(n[2][0]),
            wy * s.xy - wx * s.yy - two(n[2][1]),
            wy * s.xz - wx * s.yz + along,
        );
        let by_rate = ForceVector {
            force: Vec3::new(-(wz * h.x) - two(v.y), -(wz * h.y) + two(v.x), wx * h.x + wy * h.y),
            moment: Vec3::new(
                (wx * s.xy + wy * s.yy + wz * s.yz) - two(n[0][2]),
                -(wx * s.xx + wy * s.xy + wz * s.xz) - two(n[1][2]),
                along,
            ),
        };
        // of U', of points that move against the body, of z × ∫ r × a dm and z × A
        let turned = Vec3::new(
            u13 * s.zz - u31 * s.yy + u32 * s.xy - difference * s.xz + xy2 * s.yz,
            u23 * s.zz - u32 * s.xx + difference * s.yz + u31 * s.xy + xy2 * s.xz,
            difference * (s.xx - s.yy) - u13 * s.xz - u23 * s.yz - two(xy2) * s.xy,
        );
        let relative = Vec3::new(
            wy * (n[1][1] + n[2][2]) + wx * n[0][1],
            -(wx * (n[0][0] + n[2][2])) - wy * n[1][0],
            wx * n[2][1] - wy * n[2][0],
        );
        let by_position = ForceVector {
            force: Vec3::new(
                xy2 * h.x + difference * h.y + u23 * h.z - wx * v.z - (f.force.y - m * a.y),
                difference * h.x - xy2 * h.y - u13 * h.z - wy * v.z + (f.force.x - m * a.x),
                u32 * h.x - u31 * h.y + wy * v.y + wx * v.x,
            ),
            moment: Vec3::new(
                turned.x + relative.x - f.moment.y + h.z * a.x,
                turned.y + relative.y + f.moment.x + h.z * a.y,
                turned.z + relative.z - (h.x * a.x + h.y * a.y),
            ),
        };
        Column { momentum, convected, by_position, by_rate }
    }

    /// y = z, ẏ = ω × z, ÿ = U z.
    fn of_slide(sweep: &MotionSweep<'_, T>, i: BodyId, subtree: &Subtree<T>) -> Self {
        let spin = &sweep.links[i].spin;
        let (w, field) = (spin.omega, spin.u.column(2));
        let (m, h, o) = (subtree.composite.mass, subtree.composite.first_moment, T::zero());
        let force = subtree.wrench.force;
        // v × z, and twice the change of z by time
        let by_axis = |v: Vec3<T>| Vec3::new(v.y, -v.x, o);
        let turning = by_axis(w + w);
        let drift = w.cross(h) + subtree.drift;
        Column {
            momentum: ForceVector { force: Vec3::new(o, o, m), moment: by_axis(h) },
            convected: by_axis(drift + drift),
            by_position: ForceVector { force: field.scale(m), moment: h.cross(field) - by_axis(force) },
            by_rate: ForceVector { force: turning.scale(m), moment: h.cross(turning) },
        }
    }

    /// ∂τ_i/∂q̇_i of the joint itself.
    pub fn own_rate(&self, kind: ReducedJoint) -> T {
        match kind {
            ReducedJoint::Turn => self.by_rate.moment.z,
            ReducedJoint::Slide | ReducedJoint::Free | ReducedJoint::Ball => self.by_rate.force.z,
        }
    }

    /// About the origin of the parent of `below`, from that of `below`.
    pub fn to_parent(&self, sweep: &MotionSweep<'_, T>, below: BodyId) -> Self {
        let momentum = sweep.wrench_to_parent(below, &self.momentum);
        let arm_rate = sweep.arm_rate(below);
        Column {
            convected: sweep.to_parent(below, self.convected) + (arm_rate + arm_rate).cross(momentum.force),
            by_position: sweep.wrench_to_parent(below, &self.by_position),
            by_rate: sweep.wrench_to_parent(below, &self.by_rate),
            momentum,
        }
    }
}
