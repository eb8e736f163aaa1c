//! A ball joint: a turn about any axis, ω = ω_p + q̇, with q̇ in the body's own axes.

use super::articulated::{ArticulatedInertia, FreeJoint};
use super::exponential::{exponential, logarithm};
use super::mechanics::WorldMotion;
use super::quaternion::{product, quaternion_to_rotation};
use super::{Descriptor, Dialect, Measure, Mechanics, TwistMap, Word};
use crate::dd::Dd;
use crate::real::Real;
use crate::spatial::{symmetric_product, Composite, ForceVector, Mat3, MotionVector, Sym3, Transform, Vec3};

pub(super) const ROW: Descriptor = Descriptor {
    name: "spherical",
    words: &[
        Word { text: "spherical", has_range: false, dialects: Dialect::FRAMES },
        Word {
            text: "ball",
            has_range: false,
            dialects: &[Dialect::Urdf, Dialect::JointFrames, Dialect::Mjcf, Dialect::Sdf],
        },
    ],
    number: None,
    has_axis: false,
    verb: "turns freely",
    measures: &[Measure::Angle; 3],
    neutral: &[0.0, 0.0, 0.0, 1.0],
    quaternion: Some(0),
    entries: [&["qx", "qy", "qz", "qw"], &["wx", "wy", "wz"], &["mx", "my", "mz"]],
    coordinates: "q = quaternion x y z w (4) of the child link's axes in the joint's;\n\
                  qd = angular velocity against the parent in child-link axes; tau = moment on the child, likewise",
    is_base: false,
    elementary: None,
};

pub(super) struct Spherical;

fn quaternion<T: Real>(q: &[T]) -> [T; 4] {
    [q[0], q[1], q[2], q[3]]
}

/// The first three of these; null where there are none.
fn vector<T: Real>(x: &[T]) -> Vec3<T> {
    x.get(..3).map_or(Vec3::zero(), |x| Vec3::new(x[0], x[1], x[2]))
}

/// As a twist, linear and angular part.
fn turn<T: Real>(v: &[T]) -> [Vec3<T>; 2] {
    [Vec3::zero(), vector(v)]
}

impl<T: Real> Mechanics<T> for Spherical {
    fn motion(&self, q: &[T]) -> Transform<T> {
        Transform { rotation: quaternion_to_rotation(quaternion(q)), translation: Vec3::zero() }
    }

    fn column(&self, k: usize, _: &[T]) -> MotionVector<T> {
        let mut unit = [T::zero(); 3];
        unit[k] = T::one();
        MotionVector { angular: unit.into(), linear: Vec3::zero() }
    }

    fn bracket(&self, k: usize, qd: &[T]) -> Option<[T; 3]> {
        let (x, y, z, o) = (qd[0], qd[1], qd[2], T::zero());
        // ω × e_k
        Some([[o, z, -y], [-z, o, x], [y, -x, o]][k])
    }

    fn add(&self, k: usize, at: MotionVector<T>, _: &[T], rate: T) -> MotionVector<T> {
        let mut w = at.angular.to_array();
        w[k] = w[k] + rate;
        MotionVector { angular: w.into(), ..at }
    }

    fn add_all(&self, at: MotionVector<T>, _: &[T], rates: &[T]) -> MotionVector<T> {
        MotionVector { angular: at.angular + vector(rates), ..at }
    }

    fn along(&self, k: usize, _: &[T], w: &ForceVector<T>) -> T {
        w.moment.to_array()[k]
    }

    fn spin(&self, (w, e): (Vec3<T>, Vec3<T>), [_, qd, qdd]: [&[T]; 3]) -> (Vec3<T>, Vec3<T>) {
        // ω = ω_p + q̇,  ε = ε_p + q̈ + ω_p × q̇
        let qd = vector(qd);
        (w + qd, e + vector(qdd) + w.cross(qd))
    }

    fn acceleration(&self, at: &dyn Fn() -> Vec3<T>, _: [Vec3<T>; 2], _: &Mat3<T>, _: [&[T]; 3]) -> Vec3<T> {
        at()
    }

    fn world_velocity(&self, at: MotionVector<T>, r: &Mat3<T>, [_, qd]: [&[T]; 2]) -> MotionVector<T> {
        MotionVector { angular: at.angular + *r * vector(qd), ..at }
    }

    fn world_acceleration(
        &self,
        (omega, alpha, a): WorldMotion<T>,
        r: &Mat3<T>,
        [_, qd, qdd]: [&[T]; 3],
    ) -> WorldMotion<T> {
        let joint = *r * vector(qd);
        (omega + joint, alpha + *r * vector(qdd) + omega.cross(joint), a)
    }

    fn world_column(&self, k: usize, _: &[T], r: &Mat3<T>, lever: Vec3<T>) -> (Vec3<T>, Vec3<T>) {
        let axis = r.column(k);
        (axis.cross(lever), axis)
    }

    /// n = J ε.
    fn block(&self, composite: &Composite<T>, _: &[T], _: usize, set: &mut dyn FnMut(usize, usize, T)) {
        let j = composite.second_moment.second_moment_to_inertia();
        for (row, column, value) in [(0, 0, j.xx), (0, 1, j.xy), (0, 2, j.xz), (1, 1, j.yy), (1, 2, j.yz), (2, 2, j.zz)]
        {
            set(row, column, value);
        }
    }

    fn free(
        &self,
        (k, _): (usize, &[T]),
        inertia: &ArticulatedInertia<T>,
        (rotor, u): (Option<T>, T),
        body: usize,
    ) -> (FreeJoint<T>, ArticulatedInertia<T>) {
        match rotor {
            None => free(k, inertia, u, body),
            Some(rotor) => {
                let moment = inertia.j.to_matrix().column(k);
                let own = moment.to_array()[k];
                inertia.free(ForceVector { moment, force: inertia.h.row(k) }, own + rotor, u, body)
            }
        }
    }

    /// ½ q ∘ (ω, 0).
    fn configuration_rate(&self, q: &[T], qd: &[T], rate: &mut [T]) {
        let ([x, y, z, w], [a, b, c]) = (quaternion(q), [qd[0], qd[1], qd[2]]);
        let half = T::constant(Dd::HALF);
        rate.copy_from_slice(&[
            (w * a + y * c - z * b) * half,
            (w * b + z * a - x * c) * half,
            (w * c + x * b - y * a) * half,
            -(x * a + y * b + z * c) * half,
        ]);
    }

    /// R exp v; of a quaternion of length one, whatever that of q.
    fn integrate(&self, q: &[T], v: &[T], to: &mut [T]) {
        let quaternion = quaternion(q);
        let inverse = T::one() / quaternion.iter().fold(T::zero(), |sum, x| sum + *x * *x).sqrt();
        let (_, turned) = exponential(turn(v));
        to.copy_from_slice(&product(&quaternion.map(|x| x * inverse), &turned));
    }

    fn difference(&self, q: &[T], q1: &[T], v: &mut [T]) {
        let [_, angular] = logarithm((Vec3::zero(), quaternion(q)), (Vec3::zero(), quaternion(q1)));
        v.copy_from_slice(&angular.to_array());
    }

    fn integrate_maps(&self, v: &[T]) -> Option<[TwistMap<T>; 2]> {
        Some(TwistMap::of_exponential(turn(v)))
    }

    fn difference_maps(&self, v: &[T]) -> Option<[TwistMap<T>; 2]> {
        Some(TwistMap::of_logarithm(turn(v)))
    }

    fn displacement_rate(&self, u: &[T], qd: &[T]) -> Option<[TwistMap<T>; 2]> {
        let u = turn(u);
        Some([TwistMap::rate_of_logarithm(u), TwistMap::slope_of_rate(u, turn(qd))])
    }

    /// Turned by the Cayley map, q ∘ (1 + a)/|1 + a| squared with a = h ω/4.
    fn displacement(&self, q: &[T], qd: &[T], h: T, change: &mut [T]) {
        let quarter = h * T::constant(Dd::from(0.25));
        let [ax, ay, az] = [qd[0], qd[1], qd[2]].map(|omega| omega * quarter);
        let square = ax * ax + ay * ay + az * az;
        let norm = T::one() / (T::one() + square);
        // q ∘ (1 + a)², less q: 1 goes out before anything is rounded
        let two = norm + norm;
        change.copy_from_slice(&product(&quaternion(q), &[two * ax, two * ay, two * az, -(two * square)]));
    }
}

/// What is felt through the joint where its axis k is free: I − U Uᵀ / D with U = I e_k, D = J_kk. Row and column k of the moment part
/// vanish, and are not computed.
fn free<T: Real>(k: usize, inertia: &ArticulatedInertia<T>, u: T, b: usize) -> (FreeJoint<T>, ArticulatedInertia<T>) {
    let (j, h, m) = (&inertia.j, &inertia.h, &inertia.m);
    let (n, f) = (j.to_matrix().column(k), h.row(k));
    let own = n.to_array();
    let per_inertia = (T::one() / own[k]).named("inverse_inertia", b, "");
    let mut n_d = n.scale(per_inertia).to_array();
    n_d[k] = T::one();
    let f_d = f.scale(per_inertia);
    let moment = |row: usize, column: usize, entry: T| {
        if row == k || column == k {
            T::zero()
        } else {
            entry - n_d[row] * own[column]
        }
    };
    let row = |i: usize| if i == k { Vec3::zero() } else { h.row(i) - f.scale(n_d[i]) }.to_array();
    let freed = ArticulatedInertia {
        j: Sym3 {
            xx: moment(0, 0, j.xx),
            xy: moment(0, 1, j.xy),
            xz: moment(0, 2, j.xz),
            yy: moment(1, 1, j.yy),
            yz: moment(1, 2, j.yz),
            zz: moment(2, 2, j.zz),
        },
        h: Mat3 { rows: [row(0), row(1), row(2)] },
        m: *m - symmetric_product(f_d, f),
    };
    (FreeJoint::new([n, f], [n_d.into(), f_d], (u * per_inertia).named("rate", b, "")), freed)
}
