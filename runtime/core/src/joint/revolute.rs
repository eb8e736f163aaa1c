//! A joint that turns about z by q: ω = ω_p + q̇ z   (20.23).

use super::articulated::{ArticulatedInertia, FreeJoint};
use super::mechanics::WorldMotion;
use super::{Descriptor, JointPose, Measure, Mechanics, Dialect, Word};
use crate::real::Real;
use crate::spatial::{symmetric_product, Composite, ForceVector, Mat3, MotionVector, Sym3, Transform, Vec3};

pub(super) const ROW: Descriptor = Descriptor {
    name: "revolute",
    words: &[
        Word::ranged("revolute", Dialect::NAMED),
        Word { text: "continuous", has_range: false, dialects: Dialect::WITH_FIXED },
        Word::ranged("hinge", &[Dialect::Mjcf]),
    ],
    number: None,
    has_axis: true,
    verb: "turns",
    measures: &[Measure::Angle],
    neutral: &[0.0],
    quaternion: None,
    entries: [&[]; 3],
    coordinates: "",
    is_base: false,
    elementary: Some(Measure::Angle),
};

pub(super) struct Revolute;

impl<T: Real> Mechanics<T> for Revolute {
    fn motion(&self, q: &[T]) -> Transform<T> {
        let (s, c) = q[0].sin_cos();
        Transform { rotation: Mat3::about_z(s, c), translation: Vec3::zero() }
    }

    fn column(&self, _: usize, _: &[T]) -> MotionVector<T> {
        MotionVector { angular: Vec3::unit_z(), linear: Vec3::zero() }
    }

    fn pose(&self, body: usize, placement: &Transform<T>, dense: bool, q: &[T]) -> JointPose<T> {
        let (s, c) = q[0].sin_cos();
        JointPose::turned(placement, (s.named("sin_q", body, ""), c.named("cos_q", body, "")), dense)
    }

    fn add(&self, _: usize, at: MotionVector<T>, _: &[T], rate: T) -> MotionVector<T> {
        let w = at.angular;
        MotionVector { angular: Vec3::new(w.x, w.y, w.z + rate), ..at }
    }

    fn along(&self, _: usize, _: &[T], w: &ForceVector<T>) -> T {
        w.moment.z
    }

    fn spin(&self, (w, e): (Vec3<T>, Vec3<T>), [_, qd, qdd]: [&[T]; 3]) -> (Vec3<T>, Vec3<T>) {
        // ω_j = ω_{j−1} + q̇_j e_j,  ε_j = ε_{j−1} + q̈_j e_j + q̇_j ω_j × e_j   (20.23), (20.24)
        let (qd, qdd) = (qd[0], qdd[0]);
        (Vec3::new(w.x, w.y, w.z + qd), Vec3::new(e.x + w.y * qd, e.y - w.x * qd, e.z + qdd))
    }

    fn acceleration(&self, at: &dyn Fn() -> Vec3<T>, _: [Vec3<T>; 2], _: &Mat3<T>, _: [&[T]; 3]) -> Vec3<T> {
        at()
    }

    fn world_velocity(&self, at: MotionVector<T>, r: &Mat3<T>, [_, qd]: [&[T]; 2]) -> MotionVector<T> {
        MotionVector { angular: at.angular + r.column(2).scale(qd[0]), ..at } // (20.23)
    }

    fn world_acceleration(
        &self,
        (omega, alpha, a): WorldMotion<T>,
        r: &Mat3<T>,
        [_, qd, qdd]: [&[T]; 3],
    ) -> WorldMotion<T> {
        let z = r.column(2);
        let alpha = alpha + z.scale(qdd[0]) + omega.cross(z).scale(qd[0]); // (20.24)
        (omega + z.scale(qd[0]), alpha, a)
    }

    fn world_column(&self, _: usize, _: &[T], r: &Mat3<T>, lever: Vec3<T>) -> (Vec3<T>, Vec3<T>) {
        let z = r.column(2);
        (z.cross(lever), z)
    }

    fn block(&self, composite: &Composite<T>, _: &[T], _: usize, set: &mut dyn FnMut(usize, usize, T)) {
        set(0, 0, composite.second_moment.xx + composite.second_moment.yy);
    }

    fn wrench_back(
        &self,
        _: usize,
        (composite, back): (&Composite<T>, &dyn Fn() -> Composite<T>),
        _: &JointPose<T>,
        _: &[T],
    ) -> ForceVector<T> {
        // f = z × m c,  n = J z = (−Σ_xz, −Σ_yz, Σ_xx + Σ_yy)
        let back = back();
        let (ms, s) = (back.first_moment, back.second_moment);
        let inertia = composite.second_moment.xx + composite.second_moment.yy;
        let force = Vec3::new(-ms.y, ms.x, T::zero());
        ForceVector { moment: Vec3::new(-s.xz, -s.yz, inertia), force }
    }

    fn free(
        &self,
        _: (usize, &[T]),
        inertia: &ArticulatedInertia<T>,
        (rotor, u): (Option<T>, T),
        body: usize,
    ) -> (FreeJoint<T>, ArticulatedInertia<T>) {
        match rotor {
            None => free(inertia, u, body),
            Some(rotor) => {
                let j = &inertia.j;
                let wrench = ForceVector { moment: Vec3::new(j.xz, j.yz, j.zz), force: inertia.h.row(2) };
                inertia.free(wrench, j.zz + rotor, u, body)
            }
        }
    }
}

/// What is felt through a revolute joint about z that is free: I − U Uᵀ / D with U = I z, D = J_zz. Row and column z
/// vanish, and are not computed.
fn free<T: Real>(inertia: &ArticulatedInertia<T>, u: T, b: usize) -> (FreeJoint<T>, ArticulatedInertia<T>) {
    let (j, h, m, o) = (&inertia.j, &inertia.h, &inertia.m, T::zero());
    let per_inertia = (T::one() / j.zz).named("inverse_inertia", b, "");
    let (n, f) = (Vec3::new(j.xz, j.yz, j.zz), h.row(2));
    let n_d = Vec3::new(n.x * per_inertia, n.y * per_inertia, T::one());
    let f_d = f.scale(per_inertia);
    let freed = ArticulatedInertia {
        j: Sym3 { xx: j.xx - n_d.x * n.x, xy: j.xy - n_d.x * n.y, yy: j.yy - n_d.y * n.y, xz: o, yz: o, zz: o },
        h: Mat3 {
            rows: [
                (h.row(0) - f.scale(n_d.x)).to_array(),
                (h.row(1) - f.scale(n_d.y)).to_array(),
                Vec3::zero().to_array(),
            ],
        },
        m: *m - symmetric_product(f_d, f),
    };
    (FreeJoint::new([n, f], [n_d, f_d], (u * per_inertia).named("rate", b, "")), freed)
}
