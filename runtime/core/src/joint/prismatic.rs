//! A joint that slides along z by q.

use super::articulated::{ArticulatedInertia, FreeJoint};
use super::mechanics::WorldMotion;
use super::{Descriptor, JointPose, Measure, Mechanics, Dialect, Word};
use crate::real::Real;
use crate::spatial::{symmetric_product, Composite, ForceVector, Mat3, MotionVector, Sym3, Transform, Vec3};

pub(super) const ROW: Descriptor = Descriptor {
    name: "prismatic",
    words: &[
        Word::ranged("linear", &[Dialect::CentresOfMass]),
        Word::ranged("prismatic", Dialect::NAMED),
        Word::ranged("slide", &[Dialect::Mjcf]),
    ],
    number: None,
    has_axis: true,
    verb: "slides",
    measures: &[Measure::Length],
    neutral: &[0.0],
    quaternion: None,
    entries: [&[]; 3],
    coordinates: "",
    is_base: false,
    elementary: Some(Measure::Length),
};

pub(super) struct Prismatic;

impl<T: Real> Mechanics<T> for Prismatic {
    fn motion(&self, q: &[T]) -> Transform<T> {
        Transform { translation: Vec3::new(T::zero(), T::zero(), q[0]), ..Transform::identity() }
    }

    fn column(&self, _: usize, _: &[T]) -> MotionVector<T> {
        MotionVector { angular: Vec3::zero(), linear: Vec3::unit_z() }
    }

    fn pose(&self, _: usize, placement: &Transform<T>, dense: bool, q: &[T]) -> JointPose<T> {
        JointPose::slid(placement, q[0], dense)
    }

    fn add(&self, _: usize, at: MotionVector<T>, _: &[T], rate: T) -> MotionVector<T> {
        let v = at.linear;
        MotionVector { linear: Vec3::new(v.x, v.y, v.z + rate), ..at }
    }

    fn along(&self, _: usize, _: &[T], w: &ForceVector<T>) -> T {
        w.force.z
    }

    fn spin(&self, of_parent: (Vec3<T>, Vec3<T>), _: [&[T]; 3]) -> (Vec3<T>, Vec3<T>) {
        of_parent
    }

    fn acceleration(
        &self,
        at: &dyn Fn() -> Vec3<T>,
        [_, omega]: [Vec3<T>; 2],
        field: &Mat3<T>,
        [q, qd, qdd]: [&[T]; 3],
    ) -> Vec3<T> {
        // the joint frame's, then U z q + 2 q̇ ω × z + q̈ z
        let at = at();
        let along_z = field.column(2).scale(q[0]);
        let twice_qd = qd[0] + qd[0];
        let coriolis = Vec3::new(omega.y * twice_qd, -(omega.x * twice_qd), qdd[0]);
        at + along_z + coriolis
    }

    fn world_velocity(&self, at: MotionVector<T>, r: &Mat3<T>, [_, qd]: [&[T]; 2]) -> MotionVector<T> {
        MotionVector { linear: at.linear + r.column(2).scale(qd[0]), ..at }
    }

    fn world_acceleration(
        &self,
        (omega, alpha, a): WorldMotion<T>,
        r: &Mat3<T>,
        [_, qd, qdd]: [&[T]; 3],
    ) -> WorldMotion<T> {
        let z = r.column(2);
        (omega, alpha, a + z.scale(qdd[0]) + omega.cross(z).scale(qd[0] + qd[0])) // (20.27)
    }

    fn world_column(&self, _: usize, _: &[T], r: &Mat3<T>, _: Vec3<T>) -> (Vec3<T>, Vec3<T>) {
        (r.column(2), Vec3::zero())
    }

    fn block(&self, composite: &Composite<T>, _: &[T], _: usize, set: &mut dyn FnMut(usize, usize, T)) {
        set(0, 0, composite.mass);
    }

    fn wrench_back(&self, _: usize, (composite, _): (&Composite<T>, &dyn Fn() -> Composite<T>), _: &JointPose<T>, _: &[T]) -> ForceVector<T> {
        // f = M z,  n = m c × z
        let ms = composite.first_moment;
        let force = Vec3::new(T::zero(), T::zero(), composite.mass);
        ForceVector { moment: Vec3::new(ms.y, -ms.x, T::zero()), force }
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
                let m = &inertia.m;
                let wrench = ForceVector { moment: inertia.h.column(2), force: Vec3::new(m.xz, m.yz, m.zz) };
                inertia.free(wrench, m.zz + rotor, u, body)
            }
        }
    }
}

/// What is felt through the joint where it is free: I − U Uᵀ / D with U = I z, D = M_zz. Row and column z of the force part vanish, and
/// are not computed.
fn free<T: Real>(inertia: &ArticulatedInertia<T>, u: T, b: usize) -> (FreeJoint<T>, ArticulatedInertia<T>) {
    let (j, h, m, o) = (&inertia.j, &inertia.h, &inertia.m, T::zero());
    let per_inertia = (T::one() / m.zz).named("inverse_inertia", b, "");
    let (n, f) = (h.column(2), Vec3::new(m.xz, m.yz, m.zz));
    let n_d = n.scale(per_inertia);
    let f_d = Vec3::new(f.x * per_inertia, f.y * per_inertia, T::one());
    let freed = ArticulatedInertia {
        j: *j - symmetric_product(n_d, n),
        h: Mat3::from_columns(h.column(0) - n.scale(f_d.x), h.column(1) - n.scale(f_d.y), Vec3::zero()),
        m: Sym3 { xx: m.xx - f_d.x * f.x, xy: m.xy - f_d.x * f.y, yy: m.yy - f_d.y * f.y, xz: o, yz: o, zz: o },
    };
    (FreeJoint::new([n, f], [n_d, f_d], (u * per_inertia).named("rate", b, "")), freed)
}
