//! The root body, free in the world.

use super::articulated::ArticulatedInertia;
use super::exponential::{exponential, logarithm};
use super::quaternion::{product, quaternion_to_rotation, rotated, rotated_back};
use super::{Descriptor, Dialect, Measure, Mechanics, TwistMap, Word};
use crate::dd::Dd;
use crate::real::Real;
use crate::spatial::{Composite, ForceVector, MotionVector, Transform, Vec3};
use Measure::{Angle, Length};

pub(super) const ROW: Descriptor = Descriptor {
    name: "floating",
    words: &[
        Word { text: "floating", has_range: false, dialects: Dialect::FRAMES },
        Word { text: "free", has_range: false, dialects: &[Dialect::Mjcf] },
    ],
    number: None,
    has_axis: false,
    verb: "moves freely",
    measures: &[Length, Length, Length, Angle, Angle, Angle],
    neutral: &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    quaternion: Some(3),
    entries: [
        &["x", "y", "z", "qx", "qy", "qz", "qw"],
        &["vx", "vy", "vz", "wx", "wy", "wz"],
        &["fx", "fy", "fz", "mx", "my", "mz"],
    ],
    coordinates: "q = position (3) and quaternion x y z w (4) of the root link in the world;\n\
                  qd = linear and angular velocity in root-link axes; tau = force and moment, likewise",
    is_base: true,
    elementary: None,
};

pub(super) struct Floating;

fn orientation<T: Real>(q: &[T]) -> [T; 4] {
    [q[3], q[4], q[5], q[6]]
}

fn position<T: Real>(q: &[T]) -> Vec3<T> {
    Vec3::new(q[0], q[1], q[2])
}

/// Linear and angular part.
fn twist<T: Real>(v: &[T]) -> [Vec3<T>; 2] {
    [Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5])]
}

impl<T: Real> Mechanics<T> for Floating {
    fn motion(&self, q: &[T]) -> Transform<T> {
        Transform { rotation: quaternion_to_rotation(orientation(q)), translation: Vec3::new(q[0], q[1], q[2]) }
    }

    fn column(&self, k: usize, _: &[T]) -> MotionVector<T> {
        let mut unit = [T::zero(); 3];
        unit[k % 3] = T::one();
        match k {
            0..3 => MotionVector { angular: Vec3::zero(), linear: unit.into() },
            _ => MotionVector { angular: unit.into(), linear: Vec3::zero() },
        }
    }

    fn add_all(&self, at: MotionVector<T>, _: &[T], rates: &[T]) -> MotionVector<T> {
        let vector = |k: usize| rates.get(k..k + 3).map_or(Vec3::zero(), |v| Vec3::new(v[0], v[1], v[2]));
        MotionVector { angular: at.angular + vector(3), linear: at.linear + vector(0) }
    }

    fn along(&self, k: usize, _: &[T], w: &ForceVector<T>) -> T {
        let part = if k < 3 { w.force } else { w.moment };
        part.to_array()[k % 3]
    }

    /// f = M v̇ + ε × m c,  n = m c × v̇ + J ε.
    fn block(&self, composite: &Composite<T>, _: &[T], _: usize, set: &mut dyn FnMut(usize, usize, T)) {
        let (ms, s) = (composite.first_moment, composite.second_moment);
        let j = s.second_moment_to_inertia();
        for k in 0..3 {
            set(k, k, composite.mass);
        }
        // row v_i, column ω_k: (e_k × m c)_i
        set(0, 4, ms.z);
        set(0, 5, -ms.y);
        set(1, 3, -ms.z);
        set(1, 5, ms.x);
        set(2, 3, ms.y);
        set(2, 4, -ms.x);
        for (row, column, value) in [(0, 0, j.xx), (0, 1, j.xy), (0, 2, j.xz), (1, 1, j.yy), (1, 2, j.yz), (2, 2, j.zz)]
        {
            set(3 + row, 3 + column, value);
        }
    }

    fn solve_root(&self, inertia: &ArticulatedInertia<T>, w: &ForceVector<T>, drive: &[T]) -> Option<[T; 6]> {
        let force = Vec3::new(drive[0], drive[1], drive[2]);
        let moment = Vec3::new(drive[3], drive[4], drive[5]);
        Some(inertia.solve(force - w.force, moment - w.moment))
    }

    /// ṗ = R v, and of the quaternion ½ q ∘ (ω, 0).
    fn configuration_rate(&self, q: &[T], qd: &[T], rate: &mut [T]) {
        let ([x, y, z, w], [a, b, c]) = (orientation(q), [qd[3], qd[4], qd[5]]);
        let half = T::constant(Dd::HALF);
        // R v = v + w t + s × t with t = 2 s × v
        let v = Vec3::new(qd[0], qd[1], qd[2]);
        let s = Vec3::new(x, y, z);
        let t = s.cross(v) + s.cross(v);
        let p = v + t.scale(w) + s.cross(t);
        rate.copy_from_slice(&[
            p.x,
            p.y,
            p.z,
            (w * a + y * c - z * b) * half,
            (w * b + z * a - x * c) * half,
            (w * c + x * b - y * a) * half,
            -(x * a + y * b + z * c) * half,
        ]);
    }

    /// M exp v; of a quaternion of length one, whatever that of q.
    fn integrate(&self, q: &[T], v: &[T], to: &mut [T]) {
        let quaternion = orientation(q);
        let inverse = T::one() / quaternion.iter().fold(T::zero(), |sum, x| sum + *x * *x).sqrt();
        let [x, y, z, w] = quaternion.map(|x| x * inverse);
        let (moved, turned) = exponential(twist(v));
        let moved = position(q) + rotated_back([-x, -y, -z, w], moved);
        to[..3].copy_from_slice(&moved.to_array());
        to[3..].copy_from_slice(&product(&[x, y, z, w], &turned));
    }

    fn difference(&self, q: &[T], q1: &[T], v: &mut [T]) {
        let [linear, angular] = logarithm((position(q), orientation(q)), (position(q1), orientation(q1)));
        v[..3].copy_from_slice(&linear.to_array());
        v[3..].copy_from_slice(&angular.to_array());
    }

    fn integrate_maps(&self, v: &[T]) -> Option<[TwistMap<T>; 2]> {
        Some(TwistMap::of_exponential(twist(v)))
    }

    fn difference_maps(&self, v: &[T]) -> Option<[TwistMap<T>; 2]> {
        Some(TwistMap::of_logarithm(twist(v)))
    }

    fn displacement_rate(&self, u: &[T], qd: &[T]) -> Option<[TwistMap<T>; 2]> {
        let u = twist(u);
        Some([TwistMap::rate_of_logarithm(u), TwistMap::slope_of_rate(u, twist(qd))])
    }

    /// Turned by the Cayley map, q ∘ (1 + a)/|1 + a| squared with a = h ω/4.
    fn displacement(&self, q: &[T], qd: &[T], h: T, change: &mut [T]) {
        let quarter = h * T::constant(Dd::from(0.25));
        let [ax, ay, az] = [qd[3], qd[4], qd[5]].map(|omega| omega * quarter);
        let square = ax * ax + ay * ay + az * az;
        let norm = T::one() / (T::one() + square);
        let quaternion = orientation(q);
        // q ∘ (1 + a)², less q: 1 goes out before anything is rounded
        let two = norm + norm;
        let turned = product(&quaternion, &[two * ax, two * ay, two * az, -(two * square)]);
        // the base moves in its axes at the middle of the step: q ∘ (1 + a), whose square of length is 1/norm
        let middle = product(&quaternion, &[ax, ay, az, T::one()]);
        let velocity = rotated(&middle, &[qd[0], qd[1], qd[2]]);
        change[..3].copy_from_slice(&velocity.map(|v| v * norm * h));
        change[3..].copy_from_slice(&turned);
    }
}
