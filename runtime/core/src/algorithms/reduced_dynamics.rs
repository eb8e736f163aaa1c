//! Inverse dynamics of a [`ReducedModel`]: Newton-Euler with base inertial parameters.
//!
//! The recursion of `rnea.rs`, about the joints' origins, with two savings. U z, the acceleration field along the joint
//! axis, is the same for both links of a revolute joint, as points on the axis belong to both: so the parent's column is
//! turned instead of the angular acceleration, and the terms with q̇ ω × z never appear. And U₃₃ + U₁₁ + U₂₂ = −2 ω² gives
//! U₁₁ without ω_y². The second moment enters as in `rnea.rs`, with Σ_zz = 0 for revolute joints.

use super::joint::quaternion_to_rotation;
use crate::model::JointKind;
use crate::real::Real;
use crate::reduced::{ReducedBody, ReducedModel};
use crate::spatial::{ForceVector, Mat3, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// Generalized forces tau \[N·m or N\] of a motion: [`inverse_dynamics`](super::inverse_dynamics) of the full robot.
pub fn reduced_inverse_dynamics<T: Real>(model: &ReducedModel<T>, q: &[T], qd: &[T], qdd: &[T]) -> Vec<T> {
    let mut links: Vec<Link<T>> = Vec::with_capacity(model.bodies.len());
    let world = Link::world(model.gravity);
    T::section("sines and cosines", None);
    let turns: Vec<Turn<T>> = model.bodies.iter().enumerate().map(|(i, b)| Turn::new(i, b, q)).collect();
    for (i, body) in model.bodies.iter().enumerate() {
        T::section("forward", Some(i));
        let parent = body.parent.map_or(&world, |p| &links[p]);
        links.push(parent.child(i, body, &turns[i], [q, qd, qdd]));
    }

    let mut tau = vec![T::zero(); model.nv()];
    let mut carried = vec![ForceVector::zero(); model.bodies.len()];
    for (i, body) in model.bodies.iter().enumerate().rev() {
        T::section("backward", Some(i));
        let own = links[i].wrench(body);
        let moment = (own.moment + carried[i].moment).named("moment", i);
        let force = (own.force + carried[i].force).named("force", i);
        match body.kind {
            JointKind::Revolute => tau[body.iv] = moment.z,
            JointKind::Prismatic => tau[body.iv] = force.z,
            JointKind::Floating => {
                for (k, x) in force.to_array().into_iter().chain(moment.to_array()).enumerate() {
                    tau[body.iv + k] = x;
                }
            }
        }
        if let Some(p) = body.parent {
            let (f, n) = (turns[i].to_parent(body, force), turns[i].to_parent(body, moment));
            let arm = links[i].arm;
            carried[p].force = carried[p].force + f;
            carried[p].moment = carried[p].moment + n + arm.cross(f);
        }
    }
    tau
}

/// Sine and cosine of the angle by which a body is turned, offset included; for a floating base its rotation.
enum Turn<T> {
    None,
    Angle(T, T),
    Free(Mat3<T>),
}

impl<T: Real> Turn<T> {
    fn new(i: usize, body: &ReducedBody<T>, q: &[T]) -> Self {
        let (s0, c0) = body.offset;
        match body.kind {
            JointKind::Revolute => {
                let (s, c) = q[body.iq].sin_cos();
                let (s, c) = (s.named("sin_q", i, ""), c.named("cos_q", i, ""));
                Turn::Angle(s * c0 + c * s0, c * c0 - s * s0)
            }
            JointKind::Prismatic => Turn::None,
            JointKind::Floating => {
                let k = body.iq + 3;
                Turn::Free(quaternion_to_rotation([q[k], q[k + 1], q[k + 2], q[k + 3]]))
            }
        }
    }

    /// Parent axes to body axes.
    fn to_child(&self, body: &ReducedBody<T>, v: Vec3<T>) -> Vec3<T> {
        match self {
            Turn::None => {
                let (s0, c0) = body.offset;
                body.rotation.transpose_mul(v).turned(-s0, c0)
            }
            Turn::Angle(s, c) => body.rotation.transpose_mul(v).turned(-*s, *c),
            Turn::Free(r) => r.transpose_mul(v),
        }
    }

    /// Body axes to parent axes.
    fn to_parent(&self, body: &ReducedBody<T>, v: Vec3<T>) -> Vec3<T> {
        match self {
            Turn::None => {
                let (s0, c0) = body.offset;
                body.rotation * v.turned(s0, c0)
            }
            Turn::Angle(s, c) => body.rotation * v.turned(*s, *c),
            Turn::Free(r) => *r * v,
        }
    }
}

/// How a body moves, in its own axes.
struct Link<T> {
    omega: Vec3<T>,
    alpha: Vec3<T>,
    /// U = \[ε×\] + \[ω×\]\[ω×\].
    u: Mat3<T>,
    /// U₃₃ − U₂₂, U₁₁ − U₃₃, U₂₂ − U₁₁.
    differences: Vec3<T>,
    /// Acceleration of the origin less gravity.
    accel: Vec3<T>,
    /// From the parent's origin to this one, in the parent's axes.
    arm: Vec3<T>,
}

impl<T: Real> Link<T> {
    fn world(gravity: Vec3<T>) -> Self {
        let o = Vec3::zero();
        Link::moving(o, o, -gravity, o)
    }

    /// U from ω and ε.
    fn moving(omega: Vec3<T>, alpha: Vec3<T>, accel: Vec3<T>, arm: Vec3<T>) -> Self {
        let w = omega;
        let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
        let (xy, xz, yz) = (w.x * w.y, w.x * w.z, w.y * w.z);
        let u = Mat3 {
            rows: [
                [-(yy + zz), xy - alpha.z, xz + alpha.y],
                [xy + alpha.z, -(xx + zz), yz - alpha.x],
                [xz - alpha.y, yz + alpha.x, -(xx + yy)],
            ],
        };
        Link { omega, alpha, u, differences: Vec3::new(zz - yy, xx - zz, yy - xx), accel, arm }
    }

    fn child(&self, i: usize, body: &ReducedBody<T>, turn: &Turn<T>, [q, qd, qdd]: [&[T]; 3]) -> Self {
        let iv = body.iv;
        let arm = body.translation;
        let w = turn.to_child(body, self.omega);
        match body.kind {
            JointKind::Revolute => {
                let accel = turn.to_child(body, self.accel + self.u * arm).named("accel", i);
                let omega = Vec3::new(w.x, w.y, w.z + qd[iv]).named("omega", i);
                if body.shares_axis_field {
                    let alpha_z = (body.rotation.column(2).dot(self.alpha) + qdd[iv]).named("alpha", i, "z");
                    self.along_axis(i, body, turn, omega, alpha_z, accel)
                } else {
                    // ε_j = ε_{j−1} + q̈_j e_j + q̇_j ω_j × e_j   (20.24)
                    let e = turn.to_child(body, self.alpha);
                    let (qd, qdd) = (qd[iv], qdd[iv]);
                    let alpha = Vec3::new(e.x + omega.y * qd, e.y - omega.x * qd, e.z + qdd).named("alpha", i);
                    Link::moving(omega, alpha, accel, arm)
                }
            }
            JointKind::Prismatic => {
                let q = q[body.iq];
                let at_joint = turn.to_child(body, self.accel + self.u * arm);
                let moving = Link::moving(w, turn.to_child(body, self.alpha), at_joint, arm);
                // then U z q + 2 q̇ ω × z + q̈ z
                let field = moving.u.column(2).scale(q);
                let twice_qd = qd[iv] + qd[iv];
                let coriolis = Vec3::new(w.y * twice_qd, -(w.x * twice_qd), qdd[iv]);
                let accel = (at_joint + field + coriolis).named("accel", i);
                Link { accel, arm: arm + body.rotation.column(2).scale(q), ..moving }
            }
            JointKind::Floating => {
                let triple = |x: &[T], k: usize| Vec3::new(x[iv + k], x[iv + k + 1], x[iv + k + 2]);
                let (omega, alpha) = (triple(qd, 3), triple(qdd, 3));
                // v̇ + ω × v − Rᵀ g
                let accel = triple(qdd, 0) + omega.cross(triple(qd, 0)) + turn.to_child(body, self.accel);
                Link::moving(omega, alpha, accel.named("accel", i), arm)
            }
        }
    }

    /// U of a child from U z, which it shares with its parent, from ω and from ε_z.
    fn along_axis(
        &self,
        i: usize,
        body: &ReducedBody<T>,
        turn: &Turn<T>,
        omega: Vec3<T>,
        alpha_z: T,
        accel: Vec3<T>,
    ) -> Self {
        let shared = turn.to_child(body, self.u * body.rotation.column(2)).named("field", i);
        let (u13, u23, u33) = (shared.x, shared.y, shared.z);
        let w = omega;
        let (xz, yz, xy) = (w.x * w.z, w.y * w.z, w.x * w.y);
        let (xx, zz) = (w.x * w.x, w.z * w.z);
        // U₁₃ = ω_x ω_z + ε_y,  U₂₃ = ω_y ω_z − ε_x
        let alpha = Vec3::new(yz - u23, u13 - xz, alpha_z);
        let sum = xx + zz;
        let difference = xx - zz;
        let u11 = u33 + difference;
        let u = Mat3 { rows: [[u11, xy - alpha.z, u13], [xy + alpha.z, -sum, u23], [xz - alpha.y, yz + alpha.x, u33]] };
        let differences = Vec3::new(u33 + sum, difference, -(u11 + sum));
        Link { omega, alpha, u, differences, accel, arm: body.translation }
    }

    /// Force and moment about the origin that this motion takes of the body alone.
    fn wrench(&self, body: &ReducedBody<T>) -> ForceVector<T> {
        let (s, ms, d) = (&body.second_moment, body.first_moment, self.differences);
        let [[_, u12, u13], [u21, _, u23], [u31, u32, _]] = self.u.rows;
        let moment = Vec3::new(
            u32 * s.yy - u23 * s.zz + u31 * s.xy - u21 * s.xz + d.x * s.yz,
            u13 * s.zz - u31 * s.xx + u12 * s.yz - u32 * s.xy + d.y * s.xz,
            u21 * s.xx - u12 * s.yy + u23 * s.xz - u13 * s.yz + d.z * s.xy,
        );
        ForceVector { moment: moment + ms.cross(self.accel), force: self.accel.scale(body.mass) + self.u * ms }
    }
}
