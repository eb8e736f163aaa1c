//! What the sweeps of the algorithms ask of a joint.
//!
//! Everything follows from the pose of the body in the joint's frame and from the motion subspace S: the body moves against its parent with
//! S q̇, as angular velocity and velocity of its origin, in its own axes. A joint overrides what its own form does with
//! fewer operations.

use super::articulated::{ArticulatedInertia, FreeJoint};
use super::{JointPose, TwistMap};
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

    /// [S q̇, S_k], in the joint's coordinates: what the rate along q̇ and the derivative by an increment of coordinate k, taken in the other order,
    /// differ by. `None` where they commute, and of a floating base, with which all turns.
    fn bracket(&self, _k: usize, _qd: &[T]) -> Option<[T; 3]> {
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
    /// the body's axes. `at` is formed when it is called: what is computed first stands first in programs.
    fn acceleration(
        &self,
        at: &dyn Fn() -> Vec3<T>,
        [w, omega]: [Vec3<T>; 2],
        _field: &Mat3<T>,
        coordinates: [&[T]; 3],
    ) -> Vec3<T> {
        let [joint, rate] = self.rates(coordinates);
        // v̇_J + (2 ω_p + ω_J) × v_J
        rate.linear + (w + omega).cross(joint.linear) + at()
    }

    /// ω and velocity of the origin in world axes with those of the joint added; the columns of `r` are the body's axes.
    fn world_velocity(&self, at: MotionVector<T>, r: &Mat3<T>, [q, qd]: [&[T]; 2]) -> MotionVector<T> {
        let [joint, _] = self.rates([q, qd, &[]]);
        let linear = at.linear + *r * joint.linear;
        MotionVector { linear, angular: at.angular + *r * joint.angular }
    }

    /// ω, ε and the acceleration of the origin in world axes with those of the joint added.
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
        (composite, _back): (&Composite<T>, &dyn Fn() -> Composite<T>),
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

    /// q ⊕ v: where the displacement v, of the tangent at q, leads.
    fn integrate(&self, q: &[T], v: &[T], to: &mut [T]) {
        to.iter_mut().zip(q.iter().zip(v)).for_each(|(to, (q, v))| *to = *q + *v);
    }

    /// The displacement v with q ⊕ v = q₁, the shortest one.
    fn difference(&self, q: &[T], q1: &[T], v: &mut [T]) {
        v.iter_mut().zip(q1.iter().zip(q)).for_each(|(v, (q1, q))| *v = *q1 - *q);
    }

    /// How q ⊕ v, in its own tangent, moves with q and with v; `None`: as they do, coordinate by coordinate.
    fn integrate_maps(&self, _v: &[T]) -> Option<[TwistMap<T>; 2]> {
        None
    }

    /// How v of q ⊕ v = q₁ moves with q and with q₁; `None`: as they do, against the one and with the other.
    fn difference_maps(&self, _v: &[T]) -> Option<[TwistMap<T>; 2]> {
        None
    }

    /// What makes u̇ of q̇ where q ⊕ u moves with q̇, up to the fourth power of u; how that depends on u; `None`: they are the same.
    fn displacement_rate(&self, _u: &[T], _qd: &[T]) -> Option<[TwistMap<T>; 2]> {
        None
    }

    /// The change of q in the time `h` at constant q̇.
    fn displacement(&self, _q: &[T], qd: &[T], h: T, change: &mut [T]) {
        change.iter_mut().zip(qd).for_each(|(change, qd)| *change = *qd * h);
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    extern crate std;
    use super::*;
    use crate::joint::{JointKind, KINDS};
    use crate::spatial::Sym3;
    use std::vec::Vec;

    /// A joint of which nothing is known but its pose and its motion subspace.
    struct PosedJoint(JointKind);

    impl Mechanics<f64> for PosedJoint {
        fn motion(&self, q: &[f64]) -> Transform<f64> {
            self.0.mechanics().motion(q)
        }

        fn column(&self, k: usize, q: &[f64]) -> MotionVector<f64> {
            self.0.mechanics().column(k, q)
        }
    }

    fn vector(k: usize) -> Vec3<f64> {
        let x = |i: usize| ((k * 3 + i) as f64 * 0.618).fract() * 2.0 - 0.9;
        Vec3::new(x(0), x(1), x(2))
    }

    fn twist(k: usize) -> MotionVector<f64> {
        MotionVector { angular: vector(k), linear: vector(k + 1) }
    }

    fn numbers(vectors: &[Vec3<f64>]) -> Vec<f64> {
        vectors.iter().flat_map(|v| v.to_array()).collect()
    }

    /// Everything that sweeps ask of a joint that carries some bodies, as one list.
    fn answers(joint: &dyn Mechanics<f64>, kind: JointKind, q: &[f64]) -> Vec<f64> {
        let (nv, mut all) = (kind.nv(), Vec::new());
        let qd: Vec<f64> = (0..nv).map(|k| 0.3 - 0.2 * k as f64).collect();
        let qdd: Vec<f64> = (0..nv).map(|k| 0.7 * k as f64 - 0.4).collect();
        let r = Mat3::about_z(0.6, 0.8);
        let second_moment = Sym3 { xx: 2.0, xy: 0.1, xz: -0.3, yy: 1.5, yz: 0.2, zz: 1.2 };
        let bodies = Composite { mass: 2.5, first_moment: vector(4), second_moment };
        let placement = Transform { rotation: Mat3::about_z(0.28, 0.96), translation: vector(2) };
        let pose = joint.pose(0, &placement, false, q);
        let wrench = ForceVector { moment: vector(5), force: vector(6) };
        all.extend(numbers(&[pose.to_parent(vector(1)), pose.wrench_to_parent(&wrench).moment]));
        let moved = pose.motion_to_child(&twist(3));
        all.extend(numbers(&[moved.angular, moved.linear]));
        for k in 0..nv {
            let added = joint.add(k, twist(7), q, 0.4);
            let (linear, angular) = joint.world_column(k, q, &r, vector(8));
            all.extend(numbers(&[added.angular, added.linear, linear, angular]));
            all.push(joint.along(k, q, &wrench));
            let back = pose.composite_back(&bodies);
            let column = joint.wrench_back(k, (&bodies, &|| back), &pose, q);
            let column = pose.placed_wrench(&column);
            all.extend(numbers(&[column.moment, column.force]));
            let inertia = ArticulatedInertia::of_body(&bodies);
            for rotor in [None, Some(0.5)] {
                let (free, rest) = joint.free((k, q), &inertia, (rotor, 1.3), 0);
                let felt = rest.wrench_of(&twist(9));
                all.extend(numbers(&[free.moment_per_inertia, free.force_per_inertia, felt.moment, felt.force]));
                all.push(free.rate);
            }
        }
        let mut block = std::vec![0.0; nv * nv];
        joint.block(&bodies, q, nv, &mut |i, j, x| (block[i * nv + j], block[j * nv + i]) = (x, x));
        all.extend(block);
        let added = joint.add_all(twist(1), q, &qd);
        let v = joint.world_velocity(twist(2), &r, [q, &qd]);
        let (omega, alpha, a) = joint.world_acceleration((vector(3), vector(4), vector(5)), &r, [q, &qd, &qdd]);
        let (w, e) = joint.spin((vector(6), vector(7)), [q, &qd, &qdd]);
        all.extend(numbers(&[added.angular, added.linear, v.angular, v.linear, omega, alpha, a, w, e]));
        // without the field, by which a joint that slides takes the acceleration from its frame's origin
        let field = Mat3 { rows: [[0.0; 3]; 3] };
        let own = joint.acceleration(&|| vector(8), [vector(6), w], &field, [q, &qd, &qdd]);
        all.extend(numbers(&[own]));
        all
    }

    #[test]
    fn what_a_joint_does_in_a_form_of_its_own_follows_from_its_pose_and_its_motion_subspace() {
        for kind in KINDS {
            let mut q = kind.row().neutral.to_vec();
            q.iter_mut().enumerate().for_each(|(k, q)| *q += 0.4 - 0.15 * k as f64);
            kind.normalise(&mut q);
            let (own, plain) = (answers(kind.mechanics(), *kind, &q), answers(&PosedJoint(*kind), *kind, &q));
            assert_eq!(own.len(), plain.len());
            for (i, (own, plain)) in own.iter().zip(&plain).enumerate() {
                assert!((own - plain).abs() < 1e-14, "{}: answer {i} is {own}, not {plain}", kind.row().name);
            }
        }
    }
}
