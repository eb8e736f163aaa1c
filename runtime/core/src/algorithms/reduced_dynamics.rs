//! Inverse dynamics of a [`ReducedModel`]: Newton-Euler with base inertial parameters.
//!
//! The recursion of `rnea.rs`, about the joints' origins, with three savings. U z, the acceleration field along the joint
//! axis, is the same for both links of a revolute joint, as points on the axis belong to both: so the parent's column is
//! turned instead of the angular acceleration, and the terms with q̇ ω × z never appear. U₃₃ + U₁₁ + U₂₂ = −2 ω² gives
//! U₁₁ without ω_y². And a body that [stays](ReducedBody::stays) is described in the axes before its joint's turn: its U comes
//! from that of its parent by three multiplications, and its constants are turned instead of vectors. The second moment
//! enters as in `rnea.rs`, with Σ_zz = 0 for revolute joints.

use super::reduced_turn::Turn;
use crate::joint::quaternion::rotated_back;
use crate::model::BodyId;
use crate::real::Real;
use crate::reduced::{ReducedBody, ReducedJoint, ReducedModel};
use crate::spatial::{ForceVector, Mat3, Transform, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// Generalized forces tau \[N·m or N\] of a motion: [`inverse_dynamics`](super::inverse_dynamics) of the full robot.
pub fn reduced_inverse_dynamics<T: Real>(model: &ReducedModel<T>, q: &[T], qd: &[T], qdd: &[T]) -> Vec<T> {
    reduced_inverse_dynamics_with_limbs(model, [q, qd, qdd], &mut |_, _| None)
}

/// `of_all(i, wrench)`: force and moment that all limbs for which body `i` stands pass on to their parent, about its origin in the
/// axes in which it is described, where `wrench()` is what body `i` passes on; `None`: body `i` stands for itself.
pub type LimbWrenches<'a, T> = dyn FnMut(BodyId, &dyn Fn() -> ForceVector<T>) -> Option<ForceVector<T>> + 'a;

/// The same of a robot on which some bodies stand for several limbs each.
pub fn reduced_inverse_dynamics_with_limbs<T: Real>(
    model: &ReducedModel<T>,
    [q, qd, qdd]: [&[T]; 3],
    of_all: &mut LimbWrenches<'_, T>,
) -> Vec<T> {
    let (turns, links) = motions(model, q, qd, qdd);
    let mut tau = vec![T::zero(); model.nv()];
    let mut carried = vec![ForceVector::zero(); model.bodies.len()];
    for (i, body) in model.bodies.iter().enumerate().rev() {
        T::section("backward", Some(i));
        let own = links[i].wrench(body, &turns[i]);
        let moment = (own.moment + carried[i].moment).named("moment", i);
        let force = (own.force + carried[i].force).named("force", i);
        along_joint(model, body, &ForceVector { moment, force }, &mut |k, x| tau[k] = x);
        if let Some(p) = body.parent {
            let to_parent = |v| turns[i].described_to_parent(body, v);
            let (f, n) = (to_parent(force), to_parent(moment));
            let arm = links[i].arm;
            let passed_on = || ForceVector { moment: n + arm.cross(f), force: f };
            if let Some(all) = of_all(i, &passed_on) {
                carried[p].force = carried[p].force + all.force;
                carried[p].moment = carried[p].moment + all.moment;
                continue;
            }
            carried[p].force = carried[p].force + f;
            carried[p].moment = carried[p].moment + n + arm.cross(f);
        }
    }
    tau
}

/// The generalized forces that a wrench on a body is to its joint, by velocity coordinate.
pub(super) fn along_joint<T: Real>(
    model: &ReducedModel<T>,
    body: &ReducedBody<T>,
    w: &ForceVector<T>,
    set: &mut dyn FnMut(usize, T),
) {
    match body.kind {
        ReducedJoint::Turn => set(body.iv, w.moment.z),
        ReducedJoint::Slide => set(body.iv, w.force.z),
        ReducedJoint::Ball => w.moment.to_array().into_iter().enumerate().for_each(|(k, x)| set(body.iv + k, x)),
        ReducedJoint::Free => {
            let both = w.force.scale(model.per_unit).to_array().into_iter().chain(w.moment.to_array());
            both.enumerate().for_each(|(k, x)| set(body.iv + k, x));
        }
    }
}

/// How all bodies move: the sweep from the base to the tips.
pub(super) fn motions<T: Real>(
    model: &ReducedModel<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
) -> (Vec<Turn<T>>, Vec<DescribedMotion<T>>) {
    let mut links: Vec<DescribedMotion<T>> = Vec::with_capacity(model.bodies.len());
    let world = DescribedMotion::world(model.gravity);
    let turns = Turn::all(model, q);
    for (i, body) in model.bodies.iter().enumerate() {
        T::section("forward", Some(i));
        let arm = match body.parent {
            Some(p) => turns[p].own_to_described(&model.bodies[p], body.translation),
            None => body.translation,
        };
        let parent = body.parent.map_or(&world, |p| &links[p]);
        links.push(parent.child(i, body, &turns[i], (arm, model.per_unit), [q, qd, qdd]));
    }
    (turns, links)
}

/// How a point and the axes of a frame that a body carries move for q̈ = 0, in the axes in which the body is described.
pub(super) struct CarriedMotion<T> {
    /// ω \[rad/s\].
    pub omega: Vec3<T>,
    /// ε for q̈ = 0 \[rad/s²\].
    pub alpha: Vec3<T>,
    /// Columns: the frame's axes.
    pub axes: Mat3<T>,
    /// The frame's origin in the world \[m\].
    pub position: Vec3<T>,
    /// Acceleration of the frame's origin for q̈ = 0 less gravity, in the model's unit of length per s².
    accel: Vec3<T>,
    /// Gravity in the world, in that unit.
    gravity: Vec3<T>,
    /// Metres per unit of length.
    unit: T,
    /// The bodies from the root to this one, with their turns and the levers from their origins to the frame's, in the axes in
    /// which they are described.
    path: Vec<(ReducedBody<T>, Turn<T>, Vec3<T>)>,
    nv: usize,
}

/// What a direction in the world is to the coordinates.
pub(super) struct DirectionRow<T> {
    /// The direction in the axes in which the frame's body is described.
    pub at_tip: Vec3<T>,
    /// Velocity of the frame's origin along it, per velocity coordinate.
    pub linear: Vec<T>,
    /// Angular velocity of the frame about it, per velocity coordinate.
    pub angular: Vec<T>,
    /// Acceleration of the frame's origin along it for q̈ = 0 \[m/s²\].
    pub acceleration: T,
}

/// The motion of a frame; `placement` \[m\] in the frame of body `carrier`.
pub(super) fn carried_motion<T: Real>(
    model: &ReducedModel<T>,
    q: &[T],
    qd: &[T],
    carrier: BodyId,
    placement: Transform<T>,
) -> CarriedMotion<T> {
    let (turns, links) = motions(model, q, qd, &vec![T::zero(); model.nv()]);
    T::section("contact frame", Some(carrier));
    let unit = T::one() / model.per_unit;
    let (body, turn, link) = (&model.bodies[carrier], &turns[carrier], &links[carrier]);
    let described = |v| turn.own_to_described(body, v);
    let tip_lever = described(placement.translation.scale(model.per_unit));
    let mut path = Vec::new();
    let (mut next, mut lever) = (Some(carrier), tip_lever);
    let mut origin = Vec3::zero();
    while let Some(i) = next {
        let (body, turn) = (&model.bodies[i], &turns[i]);
        path.push((body.clone(), turn.clone(), lever));
        if body.kind == ReducedJoint::Free {
            origin = Vec3::new(q[body.iq], q[body.iq + 1], q[body.iq + 2]);
        }
        lever = links[i].arm + turn.described_to_parent(body, lever);
        next = body.parent;
    }
    path.reverse();
    let columns = [0, 1, 2].map(|k| described(placement.rotation.column(k)));
    CarriedMotion {
        omega: link.spin.omega,
        alpha: link.spin.alpha,
        axes: Mat3::from_columns(columns[0], columns[1], columns[2]),
        position: origin + lever.scale(unit),
        accel: link.accel + link.spin.u * tip_lever,
        gravity: model.gravity,
        unit,
        path,
        nv: model.nv(),
    }
}

impl<T: Real> CarriedMotion<T> {
    /// The rows of a direction in the world.
    pub fn row(&self, direction: Vec3<T>) -> DirectionRow<T> {
        T::section("contact direction", None);
        // scaled by the unit of length, so that constants meet constants
        let in_metres = direction.scale(self.unit);
        let (mut n, mut f) = (direction, in_metres);
        let (mut linear, mut angular) = (vec![T::zero(); self.nv], vec![T::zero(); self.nv]);
        for (body, turn, r) in &self.path {
            let down = |v| turn.parent_to_described(body, v);
            (n, f) = (down(n), down(f));
            let iv = body.iv;
            match body.kind {
                ReducedJoint::Turn => {
                    linear[iv] = r.x * f.y - r.y * f.x; // (r × f) · z
                    angular[iv] = n.z;
                }
                ReducedJoint::Slide => linear[iv] = f.z,
                ReducedJoint::Ball => {
                    let about = r.cross(f).to_array();
                    for (k, (n, about)) in n.to_array().into_iter().zip(about).enumerate() {
                        (linear[iv + k], angular[iv + k]) = (about, n);
                    }
                }
                ReducedJoint::Free => {
                    let about = r.cross(f).to_array();
                    for (k, (n, about)) in n.to_array().into_iter().zip(about).enumerate() {
                        linear[iv + k] = n;
                        linear[iv + 3 + k] = about;
                        angular[iv + 3 + k] = n;
                    }
                }
            }
        }
        DirectionRow { at_tip: n, linear, angular, acceleration: f.dot(self.accel) + in_metres.dot(self.gravity) }
    }
}

/// ω, ε and U of one rigid body, in some axes.
#[derive(Clone, Copy)]
pub(super) struct Spin<T> {
    pub omega: Vec3<T>,
    alpha: Vec3<T>,
    /// U = \[ε×\] + \[ω×\]\[ω×\].
    pub u: Mat3<T>,
    /// U₃₃ − U₂₂, U₁₁ − U₃₃, U₂₂ − U₁₁.
    pub differences: Vec3<T>,
    /// ω_x ω_y.
    pub xy: T,
}

/// How a body moves, in the axes in which it is described.
pub(super) struct DescribedMotion<T> {
    pub spin: Spin<T>,
    /// Acceleration of the origin less gravity.
    pub accel: Vec3<T>,
    /// From the parent's origin to this one, in the axes of the parent's description.
    pub arm: Vec3<T>,
    /// The motion of the base axes, and the sum of the rates of the chain's joints and of the rates' rates.
    base: (Spin<T>, T, T),
}

impl<T: Real> Spin<T> {
    fn zero() -> Self {
        Spin::new(Vec3::zero(), Vec3::zero())
    }

    /// U from ω and ε.
    fn new(omega: Vec3<T>, alpha: Vec3<T>) -> Self {
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
        Spin { omega, alpha, u, differences: Vec3::new(zz - yy, xx - zz, yy - xx), xy }
    }

    /// The same motion in other axes, e = E of these axes in the others.
    fn in_axes(&self, e: &Mat3<T>, permutes: bool) -> Self {
        let (omega, alpha) = (e.transpose_mul(self.omega), e.transpose_mul(self.alpha));
        if !permutes {
            return Spin::new(omega, alpha);
        }
        // E is a signed permutation: entries change places; an odd one turns the differences round
        let [[a, b, c], [d, f, g], [h, k, l]] = e.rows.map(|row| row.map(|x| x * x));
        let parity = a * (f * l - g * k) - b * (d * l - g * h) + c * (d * k - f * h);
        let places = Mat3 { rows: [[a, b, c], [d, f, g], [h, k, l]] };
        Spin {
            omega,
            alpha,
            u: e.transpose() * self.u * *e,
            differences: places.transpose_mul(self.differences).scale(parity),
            xy: omega.x * omega.y,
        }
    }

    /// What turns about z of these axes with rate W and its rate L, still in these axes:
    /// U' = U + L \[z×\] + W (ω zᵀ + z ωᵀ − 2 ω_z 1 …), written out; U' z = U z.
    fn turning(&self, rate: T, rate_rate: T, twice_rate: bool) -> Self {
        let (w, e) = (self.omega, self.alpha);
        let [[u11, u12, u13], [u21, u22, u23], [u31, u32, u33]] = self.u.rows;
        let inward = rate * (w.z + w.z + rate);
        let (x, y) = match twice_rate {
            true => (w.x * (rate + rate), w.y * (rate + rate)),
            false => ((w.x + w.x) * rate, (w.y + w.y) * rate),
        };
        let rows =
            [[u11 - inward, u12 - rate_rate, u13], [u21 + rate_rate, u22 - inward, u23], [u31 + x, u32 + y, u33]];
        let d = self.differences;
        Spin {
            omega: Vec3::new(w.x, w.y, w.z + rate),
            alpha: Vec3::new(e.x + rate * w.y, e.y - rate * w.x, e.z + rate_rate),
            u: Mat3 { rows },
            differences: Vec3::new(d.x + inward, d.y - inward, d.z),
            xy: self.xy,
        }
    }

    /// From U z, which a body shares with its parent, from ω and from ε_z.
    fn along_axis(shared: Vec3<T>, omega: Vec3<T>, alpha_z: T, doubled: [bool; 2]) -> Self {
        let (u13, u23, u33) = (shared.x, shared.y, shared.z);
        let w = omega;
        let (xz, yz, xy) = (w.x * w.z, w.y * w.z, w.x * w.y);
        let (xx, zz) = (w.x * w.x, w.z * w.z);
        // U₁₃ = ω_x ω_z + ε_y,  U₂₃ = ω_y ω_z − ε_x
        let alpha = Vec3::new(yz - u23, u13 - xz, alpha_z);
        let sum = xx + zz;
        let difference = xx - zz;
        let u11 = u33 + difference;
        let twice_z = w.z + w.z;
        let u31 = if doubled[0] { twice_z * w.x - u13 } else { xz - alpha.y };
        let u32 = if doubled[1] { twice_z * w.y - u23 } else { yz + alpha.x };
        let u = Mat3 { rows: [[u11, xy - alpha.z, u13], [xy + alpha.z, -sum, u23], [u31, u32, u33]] };
        let differences = Vec3::new(u33 + sum, difference, -(u11 + sum));
        Spin { omega, alpha, u, differences, xy }
    }
}

impl<T: Real> DescribedMotion<T> {
    fn world(gravity: Vec3<T>) -> Self {
        let rest = Spin::zero();
        DescribedMotion { spin: rest, accel: -gravity, arm: Vec3::zero(), base: (rest, T::zero(), T::zero()) }
    }

    fn child(
        &self,
        i: usize,
        body: &ReducedBody<T>,
        turn: &Turn<T>,
        (arm, per_unit): (Vec3<T>, T),
        [q, qd, qdd]: [&[T]; 3],
    ) -> Self {
        let iv = body.iv;
        let at_rest =
            |spin, accel: Vec3<T>, arm| DescribedMotion { spin, accel, arm, base: (spin, T::zero(), T::zero()) };
        match body.kind {
            ReducedJoint::Turn => {
                let at_joint = turn.parent_to_base(body, self.accel + self.spin.u * arm);
                let (base, rate, rate_rate) = match (turn.continues, self.base) {
                    (true, (base, rate, rate_rate)) => (base, rate + qd[iv], rate_rate + qdd[iv]),
                    (false, _) => (self.spin.in_axes(&body.rotation, body.permutes), qd[iv], qdd[iv]),
                };
                let accel = if body.stays { at_joint } else { turn.base_to_own(at_joint) }.named("accel", i);
                let spin = if body.stays {
                    base.turning(rate, rate_rate, !body.parallel)
                } else {
                    let w = turn.base_to_own(base.omega);
                    let omega = Vec3::new(w.x, w.y, w.z + rate).named("omega", i);
                    if body.shares_axis_field {
                        let shared = match turn.continues {
                            true => base.u.column(2),
                            false => turn.parent_to_base(body, self.spin.u * body.rotation.column(2)),
                        };
                        let alpha_z = (base.alpha.z + rate_rate).named("alpha", i, "z");
                        Spin::along_axis(turn.base_to_own(shared).named("field", i), omega, alpha_z, body.doubled)
                    } else {
                        // ε_j = ε_{j−1} + q̈_j e_j + q̇_j ω_j × e_j   (20.24)
                        let e = turn.base_to_own(base.alpha);
                        let alpha = Vec3::new(e.x + omega.y * rate, e.y - omega.x * rate, e.z + rate_rate);
                        Spin::new(omega, alpha.named("alpha", i))
                    }
                };
                DescribedMotion { spin, accel, arm, base: (base, rate, rate_rate) }
            }
            ReducedJoint::Slide => {
                let q = q[body.iq];
                let spin = self.spin.in_axes(&body.rotation, body.permutes);
                let at_joint = turn.parent_to_base(body, self.accel + self.spin.u * arm);
                // then U z q + 2 q̇ ω × z + q̈ z
                let field = spin.u.column(2).scale(q);
                let (w, twice_qd) = (spin.omega, qd[iv] + qd[iv]);
                let coriolis = Vec3::new(w.y * twice_qd, -(w.x * twice_qd), qdd[iv]);
                let accel = (at_joint + field + coriolis).named("accel", i);
                at_rest(spin, accel, arm + body.rotation.column(2).scale(q))
            }
            ReducedJoint::Ball => {
                let triple = |x: &[T]| Vec3::new(x[iv], x[iv + 1], x[iv + 2]);
                let (rate, rate_rate) = (triple(qd), triple(qdd));
                let carried = turn.parent_to_base(body, self.spin.omega);
                // ε = Rᵀ ε_p + ω̇ + (Rᵀ ω_p) × ω of the joint, in own axes
                let alpha = turn.parent_to_base(body, self.spin.alpha) + rate_rate + carried.cross(rate);
                let accel = turn.parent_to_base(body, self.accel + self.spin.u * arm);
                let spin = Spin::new((carried + rate).named("omega", i), alpha.named("alpha", i));
                at_rest(spin, accel.named("accel", i), arm)
            }
            ReducedJoint::Free => {
                let triple = |x: &[T], k: usize| Vec3::new(x[iv + k], x[iv + k + 1], x[iv + k + 2]);
                let (omega, alpha) = (triple(qd, 3), triple(qdd, 3));
                // v̇ + ω × v − Rᵀ g
                let moving = (triple(qdd, 0) + omega.cross(triple(qd, 0))).scale(per_unit);
                let accel = moving + rotated_back(body.quaternion(q), self.accel);
                at_rest(Spin::new(omega, alpha), accel.named("accel", i), arm)
            }
        }
    }

    /// Force and moment about the origin that this motion takes of the body alone.
    pub fn wrench(&self, body: &ReducedBody<T>, turn: &Turn<T>) -> ForceVector<T> {
        let ms = turn.own_to_described(body, body.first_moment);
        let own = &body.second_moment;
        let s = match turn.angle {
            Some((sin, cos)) if body.stays => own.turned(sin, cos),
            _ => *own,
        };
        let Spin { u, differences: d, alpha, xy, .. } = &self.spin;
        let [[_, u12, u13], [u21, _, u23], [u31, u32, _]] = u.rows;
        let about_axis = match body.by_axis_acceleration {
            // no turn about z changes the trace
            true => alpha.z * (own.xx + own.yy) + *xy * (s.xx - s.yy),
            false => u21 * s.xx - u12 * s.yy,
        };
        let [by_x, by_y] = body.by_accelerations;
        // U₃₂ = U₂₃ + 2 ε_x,  U₃₁ = U₁₃ − 2 ε_y
        let about_x = if by_x { u23 * (s.yy - s.zz) + alpha.x * (s.yy + s.yy) } else { u32 * s.yy - u23 * s.zz };
        let about_y = if by_y { u13 * (s.zz - s.xx) + alpha.y * (s.xx + s.xx) } else { u13 * s.zz - u31 * s.xx };
        let about_axis = about_axis + d.z * s.xy;
        let a = self.accel;
        let of_pairs = match turn.angle {
            // with complex numbers m c = x + i y, Im(conj(m c e^iθ) a) = Im(e^−iθ conj(m c) a), and so for Σ_xz + i Σ_yz and U z
            Some((sin, cos)) if body.stays && body.turns_sums => {
                let own_ms = body.first_moment;
                let along = own_ms.x * a.x + own_ms.y * a.y + own.xz * u13 + own.yz * u23;
                let across = own_ms.x * a.y - own_ms.y * a.x + own.xz * u23 - own.yz * u13;
                cos * across - sin * along
            }
            _ => u23 * s.xz - u13 * s.yz + (ms.x * a.y - ms.y * a.x),
        };
        let moment = Vec3::new(
            about_x + u31 * s.xy - u21 * s.xz + d.x * s.yz + (ms.y * a.z - ms.z * a.y),
            about_y + u12 * s.yz - u32 * s.xy + d.y * s.xz + (ms.z * a.x - ms.x * a.z),
            about_axis + of_pairs,
        );
        ForceVector { moment, force: a.scale(body.mass) + *u * ms }
    }
}
