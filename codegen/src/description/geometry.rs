//! Constant frames in double-double, with zeros and ones kept exact.

use straightline_core::spatial::{Mat3, Sym3, Transform, Vec3};
use straightline_core::Dd;

/// Products of exact rotations are off by a few 1e-32.
const ROTATION_DUST: f64 = 1e-30;
/// What cancels to less, relative to its terms, is zero.
const RELATIVE_DUST: f64 = 1e-28;

/// `x`, or exactly 0 or ±1 where it is that up to rounding.
fn snap_entry(x: Dd) -> Dd {
    if x.abs().to_f64() < ROTATION_DUST {
        Dd::ZERO
    } else if (x - Dd::ONE).abs().to_f64() < ROTATION_DUST {
        Dd::ONE
    } else if (x + Dd::ONE).abs().to_f64() < ROTATION_DUST {
        -Dd::ONE
    } else {
        x
    }
}

/// `x`, or exactly 0 where it is that up to rounding of terms as large as `scale`.
fn snap_sum(x: Dd, scale: f64) -> Dd {
    if x.abs().to_f64() <= RELATIVE_DUST * scale {
        Dd::ZERO
    } else {
        x
    }
}

pub(crate) fn snap_rotation(r: Mat3<Dd>) -> Mat3<Dd> {
    r.map(snap_entry)
}

pub(crate) fn snap_vector(v: Vec3<Dd>, scale: f64) -> Vec3<Dd> {
    v.map(|x| snap_sum(x, scale))
}

pub(crate) fn snap_tensor(j: Sym3<Dd>) -> Sym3<Dd> {
    let scale = [j.xx, j.xy, j.xz, j.yy, j.yz, j.zz].iter().fold(0.0f64, |m, x| m.max(x.abs().to_f64()));
    j.map(|x| snap_sum(x, scale))
}

/// The greatest magnitude of a component.
pub(crate) fn magnitude(v: Vec3<Dd>) -> f64 {
    v.to_array().iter().fold(0.0, |m, x| m.max(x.abs().to_f64()))
}

pub(crate) fn vector(v: [f64; 3]) -> Vec3<Dd> {
    Vec3::from(v.map(|x| Dd::from(x) + Dd::ZERO))
}

/// The pose of c in a, from that of b in a and that of c in b.
pub(crate) fn compose(x_ab: &Transform<Dd>, x_bc: &Transform<Dd>) -> Transform<Dd> {
    let x = x_ab.compose(x_bc);
    let scale = magnitude(x_ab.translation).max(magnitude(x_bc.translation));
    Transform { rotation: snap_rotation(x.rotation), translation: snap_vector(x.translation, scale) }
}

/// A point of frame b in frame a.
pub(crate) fn point(x_ab: &Transform<Dd>, p: Vec3<Dd>) -> Vec3<Dd> {
    let scale = magnitude(x_ab.translation).max(magnitude(p));
    snap_vector(x_ab.translation + x_ab.rotation * p, scale)
}

/// A pure rotation.
pub(crate) fn turned(rotation: Mat3<Dd>) -> Transform<Dd> {
    Transform { rotation, translation: Vec3::zero() }
}

/// The unit vector along `v`; `None` for the null vector.
pub(crate) fn unit(v: Vec3<Dd>) -> Option<Vec3<Dd>> {
    let greatest = magnitude(v);
    if greatest < 1e-100 {
        return None;
    }
    // scaled first, so that no square leaves f64's range
    let v = v.map(|x| x / Dd::from(greatest));
    let length = v.dot(v).sqrt();
    Some(v.map(|x| snap_entry(x / length)))
}

/// The canonical frame of a joint with unit axis `axis`, both in the joint frame of the file: columns are its axes, the
/// third is `axis`. For a coordinate axis a permutation with signs, cyclic for a positive one; otherwise x stands
/// perpendicular to the axis and to a coordinate axis, so that at least one entry is zero.
pub(crate) fn canonical_rotation(axis: Vec3<Dd>) -> Mat3<Dd> {
    let (o, i) = (Dd::ZERO, Dd::ONE);
    let (x, y, z) = (Vec3::new(i, o, o), Vec3::new(o, i, o), Vec3::new(o, o, i));
    if axis == z {
        return Mat3 { rows: [[i, o, o], [o, i, o], [o, o, i]] };
    }
    if axis == x {
        return Mat3::from_columns(y, z, x);
    }
    if axis == y {
        return Mat3::from_columns(z, x, y);
    }
    let a = axis.to_array();
    let coordinate = [x, y, z];
    if a.iter().filter(|c| **c == o).count() == 2 {
        // −x: (z, y, −x), −y: (x, z, −y), −z: (y, x, −z)
        let k = a.iter().position(|c| *c != o).unwrap_or(2);
        return Mat3::from_columns(coordinate[(k + 2) % 3], coordinate[(k + 1) % 3], axis);
    }
    let least = (0..3).rev().min_by(|&p, &q| a[p].abs().to_f64().total_cmp(&a[q].abs().to_f64())).unwrap_or(2);
    let first = if a[least] == o {
        coordinate[least]
    } else {
        let across = coordinate[least].cross(axis);
        let length = across.dot(across).sqrt();
        let mut first = across.map(|c| c / length).to_array();
        first[least] = o;
        Vec3::from(first)
    };
    snap_rotation(Mat3::from_columns(first, axis.cross(first), axis))
}

/// The rotation about the unit vector `e`: Rodrigues' formula, (20.108) with the dot product.
pub(crate) fn about(e: Vec3<Dd>, (sin, cos): (Dd, Dd)) -> Mat3<Dd> {
    let turn = |v: Vec3<Dd>| v.scale(cos) + e.scale((Dd::ONE - cos) * e.dot(v)) + e.cross(v).scale(sin);
    let (o, i) = (Dd::ZERO, Dd::ONE);
    let columns = [Vec3::new(i, o, o), Vec3::new(o, i, o), Vec3::new(o, o, i)].map(turn);
    snap_rotation(Mat3::from_columns(columns[0], columns[1], columns[2]))
}

/// The principal moments of a tensor, ascending: cyclic Jacobi rotations, to 1e-14 of its greatest entry.
pub(crate) fn principal_moments(j: Sym3<f64>) -> [f64; 3] {
    let mut a = [[j.xx, j.xy, j.xz], [j.xy, j.yy, j.yz], [j.xz, j.yz, j.zz]];
    let scale = a.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
    if scale == 0.0 {
        return [0.0; 3];
    }
    a = a.map(|row| row.map(|x| x / scale));
    for _ in 0..30 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() < 1e-300 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (of_p, of_q) = (a[p], a[q]);
            a[p] = [0, 1, 2].map(|k| c * of_p[k] - s * of_q[k]);
            a[q] = [0, 1, 2].map(|k| s * of_p[k] + c * of_q[k]);
        }
    }
    // what is left of a zero moment is rounding
    let mut moments = [a[0][0], a[1][1], a[2][2]].map(|x| if x.abs() < 1e-14 { 0.0 } else { x * scale });
    moments.sort_by(f64::total_cmp);
    moments
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    fn determinant(r: &Mat3<Dd>) -> f64 {
        r.column(0).cross(r.column(1)).dot(r.column(2)).to_f64()
    }

    pub fn canonical_frames_are_rotations_with_z_along_the_axis() {
        let mut axes: Vec<[f64; 3]> = Vec::new();
        for x in [-1.0, -0.3, 0.0, 0.2, 1.0] {
            for y in [-2.0, 0.0, 0.5] {
                for z in [-1.0, 0.0, 0.2, 1.0] {
                    axes.push([x, y, z]);
                }
            }
        }
        for axis in axes.into_iter().filter(|a| *a != [0.0; 3]) {
            let axis = unit(vector(axis)).expect("not zero");
            let r = canonical_rotation(axis);
            assert_eq!(r.column(2), axis);
            assert!((determinant(&r) - 1.0).abs() < 1e-30, "{axis:?}");
            let gram = r.transpose() * r;
            assert_eq!(snap_rotation(gram), Mat3::identity(), "{axis:?}");
            let zeros = r.rows.iter().flatten().filter(|x| **x == Dd::ZERO).count();
            let in_axis = axis.to_array().iter().filter(|x| **x == Dd::ZERO).count();
            assert_eq!(zeros, [1, 4, 6][in_axis], "{axis:?}");
        }
    }

    pub fn principal_moments_of_a_turned_tensor() {
        let e = unit(vector([0.3, -0.5, 0.8])).expect("not zero");
        let turn = about(e, Dd::from(0.7).sin_cos());
        let j = Sym3 { xx: 0.1, yy: 0.5, zz: 0.55, xy: 0.0, xz: 0.0, yz: 0.0 }.map(Dd::from).rotated(&turn);
        let moments = principal_moments(j.map(|x| x.to_f64()));
        for (found, expected) in moments.iter().zip([0.1, 0.5, 0.55]) {
            assert!((found - expected).abs() < 1e-15, "{moments:?}");
        }
    }
}
