//! Derivatives of the velocity and the acceleration of a frame, and the rate of its Jacobian.
//!
//! Let coordinate j turn what its joint carries at w and move the frame's origin at l: column (l, w) of the Jacobian. What moves with the joint moves
//! rigidly then, while the body before it stays. With ω, ε of that body, and v, ω°, a, ε° how the frame moves against it, all in world axes,
//!
//! ```text
//! ∂v_F/∂q_j = ω × l + w × v                   ∂a_F/∂q_j = ε × l + ω × (ω × l) + 2 ω × (w × v) + w × a
//! ∂ω_F/∂q_j = w × ω°                          ∂ε_F/∂q_j = ω × (w × ω°) + w × ε°
//! ```
//!
//! This is so of every joint whose motion subspace is constant in the axes of its body, with velocity coordinates of the body's axes held. A joint of one
//! coordinate turns into itself, so that the body behind it can be the one that stays; then ∂v_F/∂q_j = l̇. Motions against a body are summed from
//! the frame inwards: how fast the robot moves as a whole is never added.

use super::kinematics::{lever_of, path_to, world_poses, WorldPose};
use crate::model::{Body, Frame, Model};
use crate::real::Real;
use crate::spatial::{MotionVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// Derivatives of the motion of a frame: each 6 × nv, row-major, rows 0-2 linear, 3-5 angular. The point and the axes are those of the function that
/// gives them.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameDerivativeBlocks<T> {
    /// ∂v/∂q; of a floating base by increments of its pose in its own axes.
    pub dv_dq: Vec<T>,
    /// ∂a/∂q at constant q̇ and q̈.
    pub da_dq: Vec<T>,
    /// ∂a/∂q̇ = ∂v/∂q + J̇.
    pub da_dqd: Vec<T>,
    /// J = ∂v/∂q̇ = ∂a/∂q̈.
    pub jacobian: Vec<T>,
    /// J̇ along the motion.
    pub jacobian_rate: Vec<T>,
}

impl<T: Real> FrameDerivativeBlocks<T> {
    /// Of a frame that stands still.
    pub(super) fn zero(nv: usize) -> Self {
        let none = || vec![T::zero(); 6 * nv];
        FrameDerivativeBlocks { dv_dq: none(), da_dq: none(), da_dqd: none(), jacobian: none(), jacobian_rate: none() }
    }

    /// By the independent velocities, from those of the tree, which stands at y.
    pub(super) fn of_free_joints(self, model: &Model<T>, y: &[T]) -> Self {
        let FrameDerivativeBlocks { dv_dq, da_dq, da_dqd, jacobian, jacobian_rate } = self;
        let blocks = [dv_dq, da_dq, da_dqd, jacobian, jacobian_rate];
        let [dv_dq, da_dq, da_dqd, jacobian, jacobian_rate] = blocks.map(|rows| model.free_columns(y, rows));
        FrameDerivativeBlocks { dv_dq, da_dq, da_dqd, jacobian, jacobian_rate }
    }
}

/// The derivatives of [`frame_velocity`](super::frame_velocity) and [`frame_acceleration`](super::frame_acceleration): in world axes, of the frame's
/// origin, which moves along.
#[doc(alias("getFrameAccelerationDerivatives", "Jdot"))]
pub fn frame_derivatives<T: Real>(
    model: &Model<T>,
    [q, qd, qdd]: [&[T]; 3],
    frame: &Frame<T>,
) -> FrameDerivativeBlocks<T> {
    let [q, qd, qdd] = &model.tree_motion([q, qd, qdd]);
    tree_frame_derivatives(model, [q, qd, qdd], frame).of_free_joints(model, q)
}

/// The same by all velocity coordinates of the tree, at a motion of the tree.
pub(super) fn tree_frame_derivatives<T: Real>(
    model: &Model<T>,
    [q, qd, qdd]: [&[T]; 3],
    frame: &Frame<T>,
) -> FrameDerivativeBlocks<T> {
    let nv = model.tree_nv();
    let mut all = FrameDerivativeBlocks::zero(nv);
    let poses = world_poses(model, q);
    let path = path_to(model, frame.body);
    let spins = spins_along(model, &poses, &path, [q, qd, qdd]);
    let (mut lever, mut behind) = (lever_of(&poses, frame), RelativeMotionOfFrame::none());
    for (at, &b) in path.iter().enumerate().rev() {
        T::section("frame derivatives", Some(b));
        let (joint, pose) = (&model.bodies[b].joint, &poses[b]);
        let (mechanics, own) = (joint.kind.mechanics(), joint.coordinates(q));
        let before = behind.with_joint((&model.bodies[b], pose), [q, qd, qdd], lever);
        let inner = at.checked_sub(1).map_or((Vec3::zero(), Vec3::zero()), |at| spins[at]);
        let (spin, against) = match joint.kind.nv() {
            1 => (spins[at], &behind),
            _ => (inner, &before),
        };
        for k in 0..joint.kind.nv() {
            let (linear, angular) = mechanics.world_column(k, own, &pose.rotation, lever);
            let column = MotionVector { linear, angular };
            let [by_velocity, by_acceleration] = against.turned_by(&column, spin);
            // what the body carries turns with it, and moves against it
            let omega = spins[at].0;
            let rate = MotionVector {
                linear: omega.cross(linear) + angular.cross(behind.velocity.linear),
                angular: omega.cross(angular),
            };
            let place = (joint.iv + k, nv);
            set(&mut all.jacobian, place, &column);
            set(&mut all.jacobian_rate, place, &rate);
            set(&mut all.dv_dq, place, &by_velocity);
            set(&mut all.da_dq, place, &by_acceleration);
            let sum =
                MotionVector { linear: by_velocity.linear + rate.linear, angular: by_velocity.angular + rate.angular };
            set(&mut all.da_dqd, place, &sum);
        }
        lever = lever + pose.lever;
        behind = before;
    }
    all
}

/// Column `k` of six rows.
pub(super) fn set<T: Real>(rows: &mut [T], (k, nv): (usize, usize), column: &MotionVector<T>) {
    let entries = column.linear.to_array().into_iter().chain(column.angular.to_array());
    entries.enumerate().for_each(|(row, value)| rows[row * nv + k] = value);
}

/// ω and ε of the bodies of a path, in world axes.
fn spins_along<T: Real>(
    model: &Model<T>,
    poses: &[WorldPose<T>],
    path: &[usize],
    [q, qd, qdd]: [&[T]; 3],
) -> Vec<(Vec3<T>, Vec3<T>)> {
    let (mut omega, mut alpha) = (Vec3::zero(), Vec3::zero());
    let of = |&b: &usize| {
        T::section("spin", Some(b));
        let joint = &model.bodies[b].joint;
        let own = [joint.coordinates(q), joint.rates(qd), joint.rates(qdd)];
        let at = (omega, alpha, Vec3::zero());
        (omega, alpha, _) = joint.kind.mechanics().world_acceleration(at, &poses[b].rotation, own);
        (omega, alpha) = (omega.named("omega", b), alpha.named("alpha", b));
        (omega, alpha)
    };
    path.iter().map(of).collect()
}

/// How the frame moves against a body, as seen from there, in world axes.
struct RelativeMotionOfFrame<T> {
    velocity: MotionVector<T>,
    acceleration: MotionVector<T>,
}

impl<T: Real> RelativeMotionOfFrame<T> {
    /// Against the body that carries it.
    fn none() -> Self {
        let none = || MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
        RelativeMotionOfFrame { velocity: none(), acceleration: none() }
    }

    /// Against the parent of that body.
    fn with_joint(&self, (body, pose): (&Body<T>, &WorldPose<T>), [q, qd, qdd]: [&[T]; 3], lever: Vec3<T>) -> Self {
        let joint = &body.joint;
        let [speed, rate] = joint.kind.mechanics().rates([joint.coordinates(q), joint.rates(qd), joint.rates(qdd)]);
        let turned =
            |m: MotionVector<T>| MotionVector { angular: pose.rotation * m.angular, linear: pose.rotation * m.linear };
        let (speed, rate) = (turned(speed), turned(rate));
        let (omega, MotionVector { angular: spin, linear: v }) = (speed.angular, self.velocity);
        let linear = rate.linear
            + omega.cross(speed.linear + omega.cross(lever) + (v + v))
            + rate.angular.cross(lever)
            + self.acceleration.linear;
        RelativeMotionOfFrame {
            velocity: MotionVector { linear: v + speed.linear + omega.cross(lever), angular: spin + omega },
            acceleration: MotionVector {
                linear,
                angular: self.acceleration.angular + rate.angular + omega.cross(spin),
            },
        }
    }

    /// How velocity and acceleration of the frame change where a coordinate moves it like this, against a body with these ω and ε.
    fn turned_by(&self, column: &MotionVector<T>, (omega, alpha): (Vec3<T>, Vec3<T>)) -> [MotionVector<T>; 2] {
        let MotionVector { linear: l, angular: w } = *column;
        let (v, spin) = (w.cross(self.velocity.linear), w.cross(self.velocity.angular));
        let velocity = MotionVector { linear: omega.cross(l) + v, angular: spin };
        let acceleration = MotionVector {
            linear: alpha.cross(l) + omega.cross(velocity.linear + v) + w.cross(self.acceleration.linear),
            angular: omega.cross(spin) + w.cross(self.acceleration.angular),
        };
        [velocity, acceleration]
    }
}
