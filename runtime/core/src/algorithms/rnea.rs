//! Inverse dynamics: the recursive Newton-Euler algorithm.
//!
//! In 3-vectors, every body in its canonical frame. Velocities and accelerations go from the base to the tips, forces
//! back: the two sweeps of the chapter's (20.23)-(20.24) and (20.46)-(20.48) (Featherstone 2008, table 5.1 is the same in
//! 6-vectors). Gravity is the acceleration −g of the base. Two choices keep it cheap and exact:
//!
//! - One matrix per body, U = \[ε×\] + \[ω×\]\[ω×\], gives the acceleration of every point of it, a + U r, of the centre
//!   of mass as of the children's joints, and its entries enter the rate of the angular momentum again.
//! - Inertia is taken about the centre of mass. About the joint's origin there are large terms that cancel: on the wrist of
//!   a PUMA 560 they cost two digits.

use super::effects::{passive_force, rotor_forces, with_rotors_of_loops};
use crate::joint::JointPose;
use crate::model::{Body, Load, Model};
use crate::real::Real;
use crate::spatial::{ForceVector, Mat3, SpatialInertia, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// Generalized forces tau \[N·m or N\], `nv` of them, that make the robot move with q, qd, qdd: of the rigid bodies, and
/// what rotors, friction and springs of the joints take.
#[doc(alias = "direct dynamics")]
#[doc(alias = "rnea")]
#[doc(alias("RNEA", "Newton-Euler"))]
pub fn inverse_dynamics<T: Real>(model: &Model<T>, q: &[T], qd: &[T], qdd: &[T]) -> Vec<T> {
    let rigid = rigid_body_forces(model, q, qd, qdd, model.gravity);
    let effects = passive_force(model, q, qd).into_iter().zip(rotor_forces(model, [q, qd, qdd]));
    rigid.into_iter().zip(effects).map(|(f, (passive, rotor))| f + (rotor + passive)).collect()
}

/// Generalized forces \[N·m or N\] that hold the robot at rest against gravity: g(q) = ∂V/∂q. For a floating base the
/// force and the moment on the root link.
#[doc(alias("gravity compensation"))]
pub fn gravity_force<T: Real>(model: &Model<T>, q: &[T]) -> Vec<T> {
    let rest = vec![T::zero(); model.nv()];
    rigid_body_forces(model, q, &rest, &rest, model.gravity)
}

/// h(q, q̇) = C q̇ + g + friction and springs: generalized forces \[N·m or N\] of a motion without q̈, so that tau = H q̈ + h.
#[doc(alias("Coriolis", "nonlinear effects"))]
pub fn bias_force<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    inverse_dynamics(model, q, qd, &vec![T::zero(); model.nv()])
}

/// C(q, q̇) q̇: generalized centrifugal and Coriolis forces \[N·m or N\]: the same recursion without gravity and q̈.
#[doc(alias("Coriolis", "centrifugal"))]
pub fn velocity_force<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let no_acceleration = vec![T::zero(); model.nv()];
    let rigid = rigid_body_forces(model, q, qd, &no_acceleration, Vec3::zero());
    with_rotors_of_loops(model, [q, qd], rigid)
}

fn rigid_body_forces<T: Real>(model: &Model<T>, q: &[T], qd: &[T], qdd: &[T], gravity: Vec3<T>) -> Vec<T> {
    let [q, qd, qdd] = &model.tree_motion([q, qd, qdd]);
    generalized_forces(model, q, &transmitted_wrenches(model, q, qd, qdd, gravity))
}

/// The wrench that each joint, its drive included, exerts on its child: force \[N\] and moment \[N·m\] about the origin of
/// the canonical joint frame (fixed to the child), in the axes of the child's link frame. One per joint, in the order of
/// the velocity coordinates, those that follow others last; for a floating base tau itself, as a wrench.
pub fn joint_wrenches<T: Real>(model: &Model<T>, q: &[T], qd: &[T], qdd: &[T]) -> Vec<ForceVector<T>> {
    let [q, qd, qdd] = &model.tree_motion([q, qd, qdd]);
    let wrenches = transmitted_wrenches(model, q, qd, qdd, model.gravity);
    let in_link_axes = |i: usize| {
        T::section("wrenches", Some(i));
        let r_body_link = &model.bodies[i].link_frame.rotation;
        ForceVector {
            moment: r_body_link.transpose_mul(wrenches[i].moment),
            force: r_body_link.transpose_mul(wrenches[i].force),
        }
    };
    model.bodies_in_order().into_iter().map(in_link_axes).collect()
}

/// The component of each joint's wrench along the joint: the generalized forces, by velocity coordinate   (20.50)
fn generalized_forces<T: Real>(model: &Model<T>, q: &[T], wrenches: &[ForceVector<T>]) -> Vec<T> {
    let mut tau = vec![T::zero(); model.tree_nv()];
    for (body, w) in model.bodies.iter().zip(wrenches) {
        let (joint, mechanics) = (&body.joint, body.joint.kind.mechanics());
        for k in 0..joint.kind.nv() {
            tau[joint.iv + k] = mechanics.along(k, joint.coordinates(q), w);
        }
    }
    model.free_forces(q, tau)
}

/// How one body moves, in its own axes.
pub(super) struct BodyMotion<T> {
    /// ω \[rad/s\].
    omega: Vec3<T>,
    /// ε \[rad/s²\].
    alpha: Vec3<T>,
    /// Acceleration of the frame's origin less gravity, a − g \[m/s²\].
    accel: Vec3<T>,
    /// U of this ω and ε.
    field: AccelerationField<T>,
}

/// U = \[ε×\] + \[ω×\]\[ω×\]: how acceleration varies over a rigid body \[1/s²\].
struct AccelerationField<T> {
    u: Mat3<T>,
    /// ω_x², ω_y², ω_z².
    squares: Vec3<T>,
    /// ω_y ω_z, ω_x ω_z, ω_x ω_y.
    products: Vec3<T>,
}

impl<T: Real> AccelerationField<T> {
    fn new(omega: Vec3<T>, alpha: Vec3<T>) -> Self {
        let w = omega;
        let squares = Vec3::new(w.x * w.x, w.y * w.y, w.z * w.z);
        let (xy, xz, yz) = (w.x * w.y, w.x * w.z, w.y * w.z);
        let u = Mat3 {
            rows: [
                [-(squares.y + squares.z), xy - alpha.z, xz + alpha.y],
                [xy + alpha.z, -(squares.x + squares.z), yz - alpha.x],
                [xz - alpha.y, yz + alpha.x, -(squares.x + squares.y)],
            ],
        };
        AccelerationField { u, squares, products: Vec3::new(yz, xz, xy) }
    }

    /// Rate of the angular momentum about the centre of mass, J ε + ω × J ω. Written out, every entry of J meets one
    /// number, and those of the products of inertia are entries of U: 15 multiplications where the vectors take 24.
    fn moment(&self, alpha: Vec3<T>, inertia: &SpatialInertia<T>) -> Vec3<T> {
        let [[_, u12, u13], [u21, _, u23], [u31, u32, _]] = self.u.rows;
        let (j, d) = (&inertia.inertia_com, inertia.anisotropy_com);
        let (squares, products) = (self.squares, self.products);
        Vec3::new(
            j.xx * alpha.x + d.x * products.x + j.xz * u21 - j.xy * u31 + j.yz * (squares.y - squares.z),
            j.yy * alpha.y + d.y * products.y + j.xy * u32 - j.yz * u12 + j.xz * (squares.z - squares.x),
            j.zz * alpha.z + d.z * products.z + j.yz * u13 - j.xz * u23 + j.xy * (squares.x - squares.y),
        )
    }
}

impl<T: Real> BodyMotion<T> {
    /// The wrench about the origin that this motion takes of a load: m a + U (m c), and vee(U Σ − (U Σ)ᵀ) + m c × a.
    pub fn wrench_of(&self, load: &Load<T>) -> ForceVector<T> {
        let (u, s) = (self.field.u, load.second_moment.to_matrix());
        let us = u * s;
        let spin =
            Vec3::new(us.rows[2][1] - us.rows[1][2], us.rows[0][2] - us.rows[2][0], us.rows[1][0] - us.rows[0][1]);
        ForceVector {
            moment: spin + load.first_moment.cross(self.accel),
            force: self.accel.scale(load.mass) + u * load.first_moment,
        }
    }

    /// The world, at rest but for gravity.
    fn of_world(gravity: Vec3<T>) -> Self {
        let (omega, alpha) = (Vec3::zero(), Vec3::zero());
        BodyMotion { omega, alpha, accel: -gravity, field: AccelerationField::new(omega, alpha) }
    }

    /// The motion of `body`, which joint `pose` carries, from that of its parent.
    fn of_child(&self, i: usize, body: &Body<T>, pose: &JointPose<T>, [q, qd, qdd]: [&[T]; 3]) -> Self {
        let (joint, mechanics) = (&body.joint, body.joint.kind.mechanics());
        let own = [joint.coordinates(q), joint.rates(qd), joint.rates(qdd)];
        let (w, e) = (pose.to_child(self.omega), pose.to_child(self.alpha));
        let (omega, alpha) = mechanics.spin((w, e), own);
        let omega = omega.named("omega", i);
        let alpha = alpha.named("alpha", i);
        let field = AccelerationField::new(omega, alpha);
        let at = || pose.to_child(self.accel + self.field.u * pose.translation);
        let accel = mechanics.acceleration(&at, [w, omega], &field.u, own);
        BodyMotion { omega, alpha, accel: accel.named("accel", i), field }
    }
}

/// Where all bodies stand against their parents, and how they move: the sweep from the base to the tips.
pub(super) fn motions<T: Real>(
    model: &Model<T>,
    motion: [&[T]; 3],
    gravity: Vec3<T>,
) -> (Vec<JointPose<T>>, Vec<BodyMotion<T>>) {
    let poses = JointPose::all(&model.bodies, motion[0]);
    let world = BodyMotion::of_world(gravity);
    let mut motions: Vec<BodyMotion<T>> = Vec::with_capacity(model.bodies.len());
    for (i, body) in model.bodies.iter().enumerate() {
        T::section("forward", Some(i));
        let parent = body.parent.map_or(&world, |p| &motions[p]);
        motions.push(parent.of_child(i, body, &poses[i], motion));
    }
    (poses, motions)
}

/// The wrench through each joint onto its child, by body: about the origin and in the axes of the canonical frame.
fn transmitted_wrenches<T: Real>(
    model: &Model<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    gravity: Vec3<T>,
) -> Vec<ForceVector<T>> {
    let (poses, motions) = motions(model, [q, qd, qdd], gravity);

    // −(G + F_I) = m (w_c − g) = m a + U (m c)                  (20.44), (20.46)
    // −M_I = J ε + ω × J ω, and about the joint + c × F         (20.45), (20.48)
    let own_wrench = |i: usize| {
        let (motion, inertia) = (&motions[i], &model.bodies[i].inertia);
        let force = motion.accel.scale(inertia.mass) + motion.field.u * inertia.first_moment;
        let moment = motion.field.moment(motion.alpha, inertia) + inertia.com.cross(force);
        let own = ForceVector { moment, force };
        match &model.bodies[i].load {
            None => own,
            Some(load) => own + motion.wrench_of(load),
        }
    };
    // F_S = Σ −(G + F_I),  M_S = Σ −(M_I + r × (G + F_I)), child by child   (20.47), (20.48)
    let mut from_children = vec![ForceVector::zero(); model.bodies.len()];
    for (i, body) in model.bodies.iter().enumerate().rev() {
        T::section("backward", Some(i));
        let w = own_wrench(i) + from_children[i];
        let w = ForceVector { moment: w.moment.named("moment", i), force: w.force.named("force", i) };
        if let Some(parent) = body.parent {
            from_children[parent] = from_children[parent] + poses[i].wrench_to_parent(&w);
        }
        from_children[i] = w;
    }
    from_children
}
