//! What the sweeps of the algorithms ask of a joint.
//!
//! Everything follows from the pose of the body in the joint's frame and from the motion subspace S: the body moves against its parent with
//! S q̇, as angular velocity and velocity of its origin, in its own axes. A joint overrides what its own form does with
//! fewer operations.

use super::articulated::{ArticulatedInertia, FreeJoint};
use super::JointPose;
use crate::real::Real;
use crate::spatial::{Composite, ForceVector, Mat3, MotionVector, Transform, Vec3};

/// ω, ε and the acceleration of a body's origin, in world axes.
pub(crate) type WorldMotion<T> = (Vec3<T>, Vec3<T>, Vec3<T>);

/// The mechanics of a kind of joint. `q`, `qd`, `qdd` are its own coordinates alone.
pub(crate) trait Mechanics<T: Real> {
    /// Pose of the body in the joint's frame.
    fn motion(&self, q: &[T]) -> Transform<T>;

    /// Column k of S: how the body moves per unit of velocity coordinate k, in its own axes.
    fn column(&self, k: usize, q: &[T]) -> MotionVector<T>;

    /// Ṡ q̇: what of the rate of S q̇, component by component, is left at q̈ = 0. Null where S is constant.
    fn bias(&self, _q: &[T], _qd: &[T]) -> Option<MotionVector<T>> {
        None
    }

    /// The pose in the parent's frame, from the placement of the joint.
    fn pose(&self, _body: usize, placement: &Transform<T>, _dense: bool, q: &[T]) -> JointPose<T> {
        JointPose::moved(placement, &self.motion(q))
    }

    /// A motion of the body with that of velocity coordinate k added.
    fn add(&self, k: usize, at: MotionVector<T>, q: &[T], rate: T) -> MotionVector<T> {
        let s = self.column(k, q);
        MotionVector { angular: at.angular + s.angular.scale(rate), linear: at.linear + s.linear.scale(rate) }
    }

    /// What a wrench on the body does along velocity coordinate k.
    fn along(&self, k: usize, q: &[T], w: &ForceVector<T>) -> T {
        let s = self.column(k, q);
        s.angular.dot(w.moment) + s.linear.dot(w.force)
    }

    /// A motion of the body with S times these rates added.
    fn add_all(&self, at: MotionVector<T>, q: &[T], rates: &[T]) -> MotionVector<T> {
        rates.iter().enumerate().fold(at, |at, (k, rate)| self.add(k, at, q, *rate))
    }

    /// S q̇ and its rate, component by component.
    fn rates(&self, [q, qd, qdd]: [&[T]; 3]) -> [MotionVector<T>; 2] {
        let none = MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
        let rate = self.add_all(none, q, qdd);
        let rate = match self.bias(q, qd) {
            Some(bias) => MotionVector { angular: rate.angular + bias.angular, linear: rate.linear + bias.linear },
            None => rate,
        };
        [self.add_all(none, q, qd), rate]
    }

    /// ω and ε of the body, from those of its parent in the body's axes.
    fn spin(&self, (w, e): (Vec3<T>, Vec3<T>), coordinates: [&[T]; 3]) -> (Vec3<T>, Vec3<T>) {
        let [joint, rate] = self.rates(coordinates);
        // ω = ω_p + ω_J,  ε = ε_p + ω̇_J + ω_p × ω_J
        (w + joint.angular, e + rate.angular + w.cross(joint.angular))
    }

    /// Acceleration of the body's origin: from that of the parent's point there, and ω of parent and body and U of the body, all in
    /// the body's axes.
    fn acceleration(&self, at: Vec3<T>, [w, omega]: [Vec3<T>; 2], _field: &Mat3<T>, coordinates: [&[T]; 3]) -> Vec3<T> {
        let [joint, rate] = self.rates(coordinates);
        // v̇_J + (2 ω_p + ω_J) × v_J
        rate.linear + (w + omega).cross(joint.linear) + at
    }

    /// ω and velocity of the origin in world axes with those of the joint added; the columns of `r` are the body's axes.
    fn world_velocity(&self, at: MotionVector<T>, r: &Mat3<T>, [q, qd]: [&[T]; 2]) -> MotionVector<T> {
        let [joint, _] = self.rates([q, qd, &[]]);
        let linear = at.linear + *r * joint.linear;
        MotionVector { linear, angular: at.angular + *r * joint.angular }
    }

    /// The same with accelerations.
    fn world_acceleration(&self, at: WorldMotion<T>, r: &Mat3<T>, coordinates: [&[T]; 3]) -> WorldMotion<T> {
        let ((omega, alpha, a), [joint, rate]) = (at, self.rates(coordinates));
        let w = r.transpose_mul(omega);
        let a = a + *r * (rate.linear + (w + w + joint.angular).cross(joint.linear));
        let alpha = alpha + *r * (rate.angular + w.cross(joint.angular));
        (omega + *r * joint.angular, alpha, a)
    }

    /// Column k of the Jacobian in world axes, (linear, angular), of a point at `lever` from the body's origin.
    fn world_column(&self, k: usize, q: &[T], r: &Mat3<T>, lever: Vec3<T>) -> (Vec3<T>, Vec3<T>) {
        let s = self.column(k, q);
        let angular = *r * s.angular;
        (*r * s.linear + angular.cross(lever), angular)
    }

    /// Sᵀ I S of all that the joint moves, in `count` coordinates: the block of the mass matrix, each entry given once.
    fn block(&self, composite: &Composite<T>, q: &[T], count: usize, set: &mut dyn FnMut(usize, usize, T)) {
        for k in 0..count {
            let wrench = composite.wrench_of(&self.column(k, q));
            (0..=k).for_each(|row| set(row, k, self.along(row, q, &wrench)));
        }
    }

    /// I S_k of all that the joint moves, in axes that the joint has turned or slid back; `back`: the same bodies in those axes.
    fn wrench_back(
        &self,
        k: usize,
        [composite, _back]: [&Composite<T>; 2],
        pose: &JointPose<T>,
        q: &[T],
    ) -> ForceVector<T> {
        pose.wrench_back(&composite.wrench_of(&self.column(k, q)))
    }

    /// What is felt through the joint where velocity coordinate k is free, driven with `u` against the wrench on the body, with a rotor
    /// or without.
    fn free(
        &self,
        (k, q): (usize, &[T]),
        inertia: &ArticulatedInertia<T>,
        (rotor, u): (Option<T>, T),
        body: usize,
    ) -> (FreeJoint<T>, ArticulatedInertia<T>) {
        let wrench = inertia.wrench_of(&self.column(k, q));
        let own = self.along(k, q, &wrench);
        inertia.free(wrench, rotor.map_or(own, |rotor| own + rotor), u, body)
    }

    /// q̈ of a root that nothing holds in any direction, under a wrench and the drives; `None`: the root is held in some.
    fn solve_root(&self, _: &ArticulatedInertia<T>, _: &ForceVector<T>, _drive: &[T]) -> Option<[T; 6]> {
        None
    }

    /// dq/dt.
    fn configuration_rate(&self, _q: &[T], qd: &[T], rate: &mut [T]) {
        rate.copy_from_slice(qd);
    }

    /// The change of q in the time `h` at constant q̇.
    fn displacement(&self, _q: &[T], qd: &[T], h: T, change: &mut [T]) {
        change.iter_mut().zip(qd).for_each(|(change, qd)| *change = *qd * h);
    }
}
