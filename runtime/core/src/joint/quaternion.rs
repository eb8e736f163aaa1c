//! Unit quaternions (x, y, z, w): the orientation of a floating base, or of what a ball joint carries.

use crate::dd::Dd;
use crate::real::Real;
use crate::spatial::{Mat3, Vec3};

/// The rotation matrix (body to world) of a unit quaternion (x, y, z, w). Not normalised here: an error of the norm goes
/// into the result to first order, and there is no root and no division.
pub fn quaternion_to_rotation<T: Real>(q: [T; 4]) -> Mat3<T> {
    let [x, y, z, _] = q;
    rotation_of_products(q, [x + x, y + y, z + z])
}

/// The same of √2 times a unit quaternion, whose products are twice those of that.
pub fn scaled_quaternion_to_rotation<T: Real>(q: [T; 4]) -> Mat3<T> {
    let [x, y, z, _] = q;
    rotation_of_products(q, [x, y, z])
}

/// From the products of a quaternion with another vector part.
fn rotation_of_products<T: Real>([x, y, z, w]: [T; 4], [x2, y2, z2]: [T; 3]) -> Mat3<T> {
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

/// A unit quaternion of a rotation matrix, from the greatest of its squares 4 w² − 1 = tr R, 4 x² − 1 = R_xx − R_yy − R_zz, … (Shepperd 1978).
pub fn rotation_to_quaternion(rotation: &Mat3<Dd>) -> [Dd; 4] {
    let r = |i: usize, k: usize| rotation.rows[i % 3][k % 3];
    let about = |i: usize| r(i, i) - r(i + 1, i + 1) - r(i + 2, i + 2);
    let squares = [about(0), about(1), about(2), r(0, 0) + r(1, 1) + r(2, 2)];
    let greatest = (0..4).fold(0, |best, k| if squares[k].hi() > squares[best].hi() { k } else { best });
    // 2 of that component, by which products with the others are divided; it is at least 1
    let twice = (Dd::ONE + squares[greatest]).sqrt();
    let per = Dd::HALF / twice;
    let across = |i: usize| (r(i + 2, i + 1) - r(i + 1, i + 2)) * per;
    let mut q = [Dd::ZERO; 4];
    q[greatest] = twice * Dd::HALF;
    match greatest {
        3 => (0..3).for_each(|i| q[i] = across(i)),
        i => {
            for k in [i + 1, i + 2] {
                q[k % 3] = (r(i, k) + r(k, i)) * per;
            }
            q[3] = across(i);
        }
    }
    q
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

#[cfg(test)]
mod tests {
    use super::*;

    /// One of each component is the greatest, half turns among them.
    #[test]
    fn a_rotation_has_its_quaternion() {
        let about = [[0.1, -0.2, 0.3, 0.9], [0.8, 0.1, -0.3, 0.2], [0.1, -0.9, 0.2, 0.0], [0.3, 0.2, 0.7, -0.1]];
        for q in about.map(|q| q.map(Dd::from)) {
            let length = q.iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
            let q = q.map(|x| x / length);
            let found = rotation_to_quaternion(&quaternion_to_rotation(q));
            let sign = if found.iter().zip(&q).fold(Dd::ZERO, |sum, (a, b)| sum + *a * *b).hi() < 0.0 {
                -Dd::ONE
            } else {
                Dd::ONE
            };
            for (found, x) in found.iter().zip(&q) {
                assert!((*found * sign - *x).abs().hi() < 1e-30, "{found:?} for {q:?}");
            }
        }
    }
}
