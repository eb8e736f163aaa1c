//! Unit quaternions (x, y, z, w): the orientation of a floating base, or of what a ball joint carries.

use crate::dd::Dd;
use crate::real::Real;
use crate::spatial::{Mat3, Vec3};

/// The rotation matrix (body to world) of a unit quaternion (x, y, z, w). Not normalised here: an error of the norm goes
/// into the result to first order, and there is no root and no division.
pub fn quaternion_to_rotation<T: Real>([x, y, z, w]: [T; 4]) -> Mat3<T> {
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, yy, zz) = (x * x2, y * y2, z * z2);
    let (xy, xz, yz) = (x * y2, x * z2, y * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    let one = T::one();
    Mat3 {
        rows: [
            [one - (yy + zz), xy - wz, xz + wy],
            [xy + wz, one - (xx + zz), yz - wx],
            [xz - wy, yz + wx, one - (xx + yy)],
        ],
    }
}

/// Rᵀ v for the rotation of a unit quaternion, without R: v + w t + t × u with t = 2 v × u and u = (x, y, z). Where v has one
/// component this takes what one row of R would, and fewer doublings.
pub fn rotated_back<T: Real>([x, y, z, w]: [T; 4], v: Vec3<T>) -> Vec3<T> {
    let u = Vec3::new(x, y, z);
    let t = (v + v).cross(u);
    v + t.cross(u) + t.scale(w)
}

/// 1/|q|. Newton's iteration for 1/√n from 1, three times: an error of 1e-2 of the length is gone.
pub fn inverse_length<T: Real>(quaternion: &[T]) -> T {
    let square = quaternion.iter().fold(T::zero(), |sum, x| sum + *x * *x);
    let (half, three) = (T::constant(Dd::HALF), T::constant(Dd::from(3.0)));
    let mut inverse = T::one();
    for _ in 0..3 {
        inverse = half * inverse * (three - square * inverse * inverse);
    }
    inverse
}

/// Product of quaternions (x, y, z, w).
pub fn product<T: Real>(a: &[T; 4], b: &[T; 4]) -> [T; 4] {
    let ([ax, ay, az, aw], [bx, by, bz, bw]) = (*a, *b);
    [
        aw * bx + ax * bw + (ay * bz - az * by),
        aw * by + ay * bw + (az * bx - ax * bz),
        aw * bz + az * bw + (ax * by - ay * bx),
        aw * bw - (ax * bx + ay * by + az * bz),
    ]
}

/// |q|² R(q) v: for quaternions of length one R v.
pub fn rotated<T: Real>(q: &[T; 4], v: &[T; 3]) -> [T; 3] {
    let [x, y, z, w] = *q;
    let conjugate = [-x, -y, -z, w];
    let [rx, ry, rz, _] = product(&product(q, &[v[0], v[1], v[2], T::zero()]), &conjugate);
    [rx, ry, rz]
}
