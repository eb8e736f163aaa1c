//! Where the links are: transformation matrices and geometry vectors in the external frame.
//!
//! Section 20.1.2, equation (20.25) and the appendix, (20.100)–(20.111).

use super::{CentreOfMassLink, CentreOfMassTree, ExtendedPosition, ReferenceJoint, ReferenceReal};
use crate::dd::Dd;
use alloc::vec::Vec;
use nalgebra::{Matrix3, Vector3};

/// Position of one link, everything in the external frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkGeometry<T> {
    /// A_j: from frame j to the external frame; (20.9), (20.111).
    #[doc(alias = "A_j")]
    pub rotation: Matrix3<T>,
    /// r_{c,j}: the centre of mass \[m\]; (20.25).
    pub centre_of_mass: Vector3<T>,
    /// e_j: the joint axis. Null for a free link and a ball joint.
    pub e: Vector3<T>,
    /// r_{j,j}: from the joint (S''_j) to the centre of mass \[m\].
    pub r: Vector3<T>,
    /// r'_{j,j}: from S'_j to the centre of mass \[m\]; (20.8).
    pub r_dash: Vector3<T>,
    /// r_{j−1,j}: from S_j (S'_j) to the parent's centre of mass \[m\].
    pub r_parent: Vector3<T>,
}

/// `v / |v|`. The null vector gives NaN.
pub fn unit<T: ReferenceReal>(v: &Vector3<T>) -> Vector3<T> {
    let norm = v.dot(v).sqrt();
    v.map(|x| x / norm)
}

/// The matrix a̲ that performs the vector product, a̲ b = a × b.
#[doc(alias = "underline")]
pub fn skew<T: ReferenceReal>(a: &Vector3<T>) -> Matrix3<T> {
    let o: T = nalgebra::zero();
    //     ⎡  0   −a_z   a_y ⎤
    // a̲ = ⎢ a_z    0   −a_x ⎥                                                                              (20.56)
    //     ⎣−a_y   a_x    0  ⎦
    Matrix3::new(o, -a.z, a.y, a.z, o, -a.x, -a.y, a.x, o)
}

/// A⁰_{j−1,j} of the extended joint. `e_parent` and `r_parent` in the parent's frame, `e` and `r` in frame j; in a
/// specificity, the r vectors are the r* vectors.
#[doc(alias = "extended position")]
pub fn extended_joint<T: ReferenceReal>(
    e_parent: &Vector3<T>,
    r_parent: &Vector3<T>,
    e: &Vector3<T>,
    r: &Vector3<T>,
) -> Matrix3<T> {
    // corrected: the first formula stands wholly in frame j−1 (tildes below), the second wholly in frame j (above)
    // a_j = −e_j × (r_{j−1,j} × e_j) / |…|,    ã_j = ẽ_j × (r̃_{j,j} × ẽ_j) / |…|                                (20.101)
    let a_parent = unit(&-e_parent.cross(&r_parent.cross(e_parent)));
    let a = unit(&e.cross(&r.cross(e)));
    // b_j = e_j × a_j,    b̃_j = ẽ_j × ã_j                                                                       (20.103)
    let b_parent = e_parent.cross(&a_parent);
    let b = e.cross(&a);
    // A⁰_{j−1,j} = [e_j a_j b_j] [ẽ_j ã_j b̃_j]⁻¹                                                                (20.106)
    // (the second matrix is orthogonal: its inverse is its transpose)
    Matrix3::from_columns(&[*e_parent, a_parent, b_parent]) * Matrix3::from_columns(&[*e, a, b]).transpose()
}

/// The vector `v0` rotated about the unit vector `e` by the angle `q` \[rad\].
#[doc(alias = "finite rotation")]
pub fn rodrigues<T: ReferenceReal>(v0: &Vector3<T>, e: &Vector3<T>, q: T) -> Vector3<T> {
    let (sin, cos) = q.sin_cos();
    let one: T = nalgebra::one();
    // corrected: (e · V⁰) e, printed (e × V⁰) e
    // V = V⁰ cos q + (1 − cos q)(e · V⁰) e + e × V⁰ sin q                                                      (20.108)
    v0 * cos + e * ((one - cos) * e.dot(v0)) + e.cross(v0) * sin
}

/// Rotation of a body whose attitude is the unit quaternion (x, y, z, w): from its axes to the external ones.
///
/// The quaternion is normalised first, as the reference data are. Not in the chapter: Rodrigues' formula with
/// (x, y, z) = e sin(q/2), w = cos(q/2).
pub fn quaternion_rotation<T: ReferenceReal>(xyzw: [T; 4]) -> Matrix3<T> {
    let [x, y, z, w] = xyzw;
    let one: T = nalgebra::one();
    let two = one + one;
    let u = skew(&Vector3::new(x, y, z));
    let squares = x * x + y * y + z * z + w * w;
    // V = V⁰ + 2 sin(q/2) cos(q/2) e × V⁰ + 2 sin²(q/2) e × (e × V⁰)
    Matrix3::identity() + (u * w + u * u) * (two / squares)
}

/// A_{j−1,j}: from frame j to the parent's frame, at the joint's coordinate.
#[doc(alias = "A_{j-1,j}")]
fn relative_rotation<T: ReferenceReal>(link: &CentreOfMassLink<T>, q: T) -> Matrix3<T> {
    // A linear joint is turned by the constant angle α_j, a revolute one by q_j.
    let (extended, alpha) = match &link.extended {
        ExtendedPosition::Matrix(extended) => (*extended, T::constant(Dd::ZERO)),
        ExtendedPosition::ByVectors { r_star, r_parent_star, alpha } => {
            let r = r_star.unwrap_or(link.r);
            let r_parent = r_parent_star.unwrap_or(link.r_parent);
            (extended_joint(&link.e_parent, &r_parent, &link.e, &r), *alpha)
        }
    };
    let [turns, _] = link.joint.shares().expect("a free link has no extended position");
    let angle = if link.joint == ReferenceJoint::Linear { alpha } else { q * turns };
    // A⁰_{j−1,j} = [V⁰_{j1} V⁰_{j2} V⁰_{j3}]                                                                   (20.107)
    let v0 = |k: usize| extended.column(k).into_owned();
    let v = |k: usize| rodrigues(&v0(k), &link.e_parent, angle);
    // A_{j−1,j} = [V_{j1} V_{j2} V_{j3}]                                                                       (20.109)
    Matrix3::from_columns(&[v(0), v(1), v(2)])
}

/// Positions of all links at the coordinates `q`, in the order of the links.
pub fn geometry<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T]) -> Vec<LinkGeometry<T>> {
    assert_eq!(q.len(), tree.nq(), "one value per position coordinate");
    let mut links: Vec<LinkGeometry<T>> = Vec::with_capacity(tree.links.len());
    for link in &tree.links {
        let (parent_rotation, parent_centre_of_mass) = match link.parent {
            Some(p) => (links[p].rotation, links[p].centre_of_mass),
            None => (Matrix3::identity(), Vector3::zeros()),
        };
        let here = match (link.joint, link.joint.shares()) {
            (_, Some([_, s])) => one_joint(link, (link.own_coordinate(q), s), &parent_rotation, &parent_centre_of_mass),
            (ReferenceJoint::Ball, _) => ball(link, &q[link.iq..link.iq + 4], &parent_rotation, &parent_centre_of_mass),
            _ => free(link, &q[link.iq..link.iq + 7]),
        };
        links.push(here);
    }
    links
}

fn one_joint<T: ReferenceReal>(
    link: &CentreOfMassLink<T>,
    (q, s): (T, T),
    parent_rotation: &Matrix3<T>,
    parent_centre_of_mass: &Vector3<T>,
) -> LinkGeometry<T> {
    // A_j = A_{0,1} A_{1,2} … A_{j−1,j}                                                                        (20.111)
    let rotation = parent_rotation * relative_rotation(link, q);
    // a_j = A_j ã_j                                                                                             (20.9)
    let e = rotation * link.e;
    let r = rotation * link.r;
    let r_parent = parent_rotation * link.r_parent;
    // r'_{j,j} = r_{j,j} + s_j q_j e_j                                                                          (20.8)
    let r_dash = r + e * (s * q);
    // r_{c,j} = r_{c,j−1} − r_{j−1,j} + r'_{j,j}                                                                (20.25)
    let centre_of_mass = parent_centre_of_mass - r_parent + r_dash;
    LinkGeometry { rotation, centre_of_mass, e, r, r_dash, r_parent }
}

fn ball<T: ReferenceReal>(
    link: &CentreOfMassLink<T>,
    q: &[T],
    parent_rotation: &Matrix3<T>,
    parent_centre_of_mass: &Vector3<T>,
) -> LinkGeometry<T> {
    let ExtendedPosition::Matrix(extended) = &link.extended else { panic!("a ball joint has no axis to extend along") };
    let rotation = parent_rotation * extended * quaternion_rotation([q[0], q[1], q[2], q[3]]);
    let (r, r_parent) = (rotation * link.r, parent_rotation * link.r_parent);
    // r_{c,j} = r_{c,j−1} − r_{j−1,j} + r_{j,j}, as (20.25) with s_j = 0
    let centre_of_mass = parent_centre_of_mass - r_parent + r;
    LinkGeometry { rotation, centre_of_mass, e: Vector3::zeros(), r, r_dash: r, r_parent }
}

fn free<T: ReferenceReal>(link: &CentreOfMassLink<T>, q: &[T]) -> LinkGeometry<T> {
    let rotation = quaternion_rotation([q[3], q[4], q[5], q[6]]);
    let r = rotation * link.r;
    let root_point = Vector3::new(q[0], q[1], q[2]);
    LinkGeometry {
        rotation,
        centre_of_mass: root_point + r,
        e: Vector3::zeros(),
        r,
        r_dash: r,
        r_parent: Vector3::zeros(),
    }
}
