//! How the links move: velocities and accelerations of the centres of mass, and their linear forms in q̇ and q̈.
//!
//! Section 20.2.1, equations (20.23)–(20.43). All vectors are in the external frame.

use super::{skew, CentreOfMassTree, LinkGeometry, ReferenceJoint, ReferenceReal};
use alloc::vec::Vec;
use nalgebra::{Matrix3xX, Vector3};

/// Motion of one link, in the external frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkMotion<T> {
    /// ω_j: angular velocity \[rad/s\].
    pub omega: Vector3<T>,
    /// ε_j: angular acceleration \[rad/s²\].
    pub epsilon: Vector3<T>,
    /// v_j: velocity of the centre of mass \[m/s\].
    pub v: Vector3<T>,
    /// w_j: acceleration of the centre of mass \[m/s²\], without gravity.
    pub w: Vector3<T>,
}

impl<T: ReferenceReal> LinkMotion<T> {
    /// The base, which rests.
    fn rest() -> Self {
        let o = Vector3::zeros();
        LinkMotion { omega: o, epsilon: o, v: o, w: o }
    }
}

/// Velocities and accelerations of all links, in the order of the links.
pub fn motion<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    geometry: &[LinkGeometry<T>],
    qd: &[T],
    qdd: &[T],
) -> Vec<LinkMotion<T>> {
    assert_eq!(qd.len(), tree.nv(), "one value per velocity coordinate");
    assert_eq!(qdd.len(), tree.nv(), "one value per velocity coordinate");
    let mut links: Vec<LinkMotion<T>> = Vec::with_capacity(tree.links.len());
    for (link, position) in tree.links.iter().zip(geometry) {
        let parent = link.parent.map_or_else(LinkMotion::rest, |p| links[p].clone());
        let here = match (link.joint, link.shares()) {
            (_, Some(shares)) => one_joint(shares, position, &parent, qd[link.iv], qdd[link.iv]),
            (ReferenceJoint::Ball, _) => ball(position, &parent, &qd[link.iv..link.iv + 3], &qdd[link.iv..link.iv + 3]),
            _ => free(position, &qd[link.iv..link.iv + 6], &qdd[link.iv..link.iv + 6]),
        };
        links.push(here);
    }
    links
}

fn one_joint<T: ReferenceReal>(
    [turns, s]: [T; 2],
    position: &LinkGeometry<T>,
    parent: &LinkMotion<T>,
    qd: T,
    qdd: T,
) -> LinkMotion<T> {
    let LinkGeometry { e, r_dash, r_parent, .. } = position;
    let LinkMotion { omega: omega_parent, epsilon: epsilon_parent, v: v_parent, w: w_parent } = parent;
    let one: T = nalgebra::one();
    let two = one + one;

    // ω_j = ω_{j−1} + q̇_j (1 − s_j) e_j                                                                        (20.23)
    let omega = omega_parent + e * (qd * turns);
    // ε_j = ε_{j−1} + (q̈_j e_j + q̇_j (ω_j × e_j)) (1 − s_j)                                                     (20.24)
    let epsilon = epsilon_parent + (e * qdd + omega.cross(e) * qd) * turns;
    // v_j = v_{j−1} − ω_{j−1} × r_{j−1,j} + ω_j × r'_{j,j} + q̇_j s_j e_j                                        (20.26)
    let v = v_parent - omega_parent.cross(r_parent) + omega.cross(r_dash) + e * (qd * s);
    // w_j = w_{j−1} − ε_{j−1} × r_{j−1,j} − ω_{j−1} × (ω_{j−1} × r_{j−1,j}) + ε_j × r'_{j,j}
    //     + ω_j × (ω_j × r'_{j,j}) + (q̈_j e_j + 2 q̇_j (ω_j × e_j)) s_j                                          (20.27)
    let w = w_parent - epsilon_parent.cross(r_parent) - omega_parent.cross(&omega_parent.cross(r_parent))
        + epsilon.cross(r_dash)
        + omega.cross(&omega.cross(r_dash))
        + (e * qdd + omega.cross(e) * (two * qd)) * s;
    LinkMotion { omega, epsilon, v, w }
}

/// As of three revolute joints in one point, along the link's own axes: all at once, e_j q̇_j is A_j times the relative angular velocity.
fn ball<T: ReferenceReal>(position: &LinkGeometry<T>, parent: &LinkMotion<T>, qd: &[T], qdd: &[T]) -> LinkMotion<T> {
    let LinkGeometry { rotation, r, r_parent, .. } = position;
    let LinkMotion { omega: omega_parent, epsilon: epsilon_parent, v: v_parent, w: w_parent } = parent;
    let own = rotation * Vector3::from_column_slice(qd);
    // ω_j = ω_{j−1} + A_j ω̃,    ε_j = ε_{j−1} + A_j dω̃/dt + ω_j × A_j ω̃
    let omega = omega_parent + own;
    let epsilon = epsilon_parent + rotation * Vector3::from_column_slice(qdd) + omega.cross(&own);
    // (20.26) and (20.27) with s_j = 0
    let v = v_parent - omega_parent.cross(r_parent) + omega.cross(r);
    let w = w_parent - epsilon_parent.cross(r_parent) - omega_parent.cross(&omega_parent.cross(r_parent))
        + epsilon.cross(r)
        + omega.cross(&omega.cross(r));
    LinkMotion { omega, epsilon, v, w }
}

fn free<T: ReferenceReal>(position: &LinkGeometry<T>, qd: &[T], qdd: &[T]) -> LinkMotion<T> {
    let LinkGeometry { rotation, r, .. } = position;
    let root_velocity = rotation * Vector3::new(qd[0], qd[1], qd[2]);
    // ω_0 = A_0 ω̃_0,  and as ω × ω = 0:  ε_0 = A_0 dω̃_0/dt
    let omega = rotation * Vector3::new(qd[3], qd[4], qd[5]);
    let epsilon = rotation * Vector3::new(qdd[3], qdd[4], qdd[5]);
    // v_0 = A_0 ṽ + ω_0 × r
    let v = root_velocity + omega.cross(r);
    // w_0 = A_0 dṽ/dt + ω_0 × A_0 ṽ + ε_0 × r + ω_0 × (ω_0 × r)
    let w = rotation * Vector3::new(qdd[0], qdd[1], qdd[2])
        + omega.cross(&root_velocity)
        + epsilon.cross(r)
        + omega.cross(&omega.cross(r));
    LinkMotion { omega, epsilon, v, w }
}

/// The linear forms of one link's motion: ω = Λ q̇, v = Ξ q̇, ε = Λ q̈ + Γ, w = Ξ q̈ + Δ; (20.32)–(20.39).
#[derive(Clone, Debug, PartialEq)]
pub struct LinearForms<T: ReferenceReal> {
    /// Λ^j, 3 × n.
    pub lambda: Matrix3xX<T>,
    /// Γ^j, 3 × 1.
    pub gamma: Vector3<T>,
    /// Ξ^j, 3 × n.
    pub xi: Matrix3xX<T>,
    /// Δ^j, 3 × 1.
    pub delta: Vector3<T>,
    /// ω_j \[rad/s\], on which Γ and Δ depend.
    pub omega: Vector3<T>,
}

/// Λ, Γ, Ξ, Δ of all links, in the order of the links.
pub fn linear_forms<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    geometry: &[LinkGeometry<T>],
    qd: &[T],
) -> Vec<LinearForms<T>> {
    let n = tree.nv();
    assert_eq!(qd.len(), n, "one value per velocity coordinate");
    let mut links: Vec<LinearForms<T>> = Vec::with_capacity(tree.links.len());
    for (link, position) in tree.links.iter().zip(geometry) {
        let parent = link.parent.map_or_else(|| base_forms(n), |p| links[p].clone());
        let here = match (link.joint, link.shares()) {
            (_, Some(shares)) => one_joint_forms(shares, position, &parent, link.iv, qd[link.iv]),
            (ReferenceJoint::Ball, _) => ball_forms(position, &parent, link.iv, &qd[link.iv..link.iv + 3]),
            _ => free_forms(position, parent, link.iv, &qd[link.iv..link.iv + 6]),
        };
        links.push(here);
    }
    links
}

/// The base rests: Λ⁰ = 0, Γ⁰ = 0, Ξ⁰ = 0, Δ⁰ = 0.
fn base_forms<T: ReferenceReal>(n: usize) -> LinearForms<T> {
    let o = Vector3::zeros();
    LinearForms { lambda: Matrix3xX::zeros(n), gamma: o, xi: Matrix3xX::zeros(n), delta: o, omega: o }
}

fn one_joint_forms<T: ReferenceReal>(
    [turns, s]: [T; 2],
    position: &LinkGeometry<T>,
    parent: &LinearForms<T>,
    j: usize,
    qd: T,
) -> LinearForms<T> {
    let LinkGeometry { e, r_dash, r_parent, .. } = position;
    let LinearForms {
        lambda: lambda_parent,
        gamma: gamma_parent,
        xi: xi_parent,
        delta: delta_parent,
        omega: omega_parent,
    } = parent;
    let one: T = nalgebra::one();
    let two = one + one;
    let omega = omega_parent + e * (qd * turns); // (20.23)

    // λ_k^j = λ_k^{j−1}, k = 1, …, j−1
    // λ_j^j = (1 − s_j) e_j                                                                                    (20.40)
    let mut lambda = lambda_parent.clone();
    // of a coordinate that joints before share, to what they make
    lambda.set_column(j, &(lambda_parent.column(j) + e * turns));
    // γ^j = γ^{j−1} + q̇_j (ω_j × e_j) (1 − s_j)                                                                 (20.41)
    let gamma = gamma_parent + omega.cross(e) * (qd * turns);
    // ξ_k^j = ξ_k^{j−1} − λ_k^{j−1} × r_{j−1,j} + λ_k^j × r'_{j,j}, k = 1, …, j−1
    // ξ_j^j = e_j s_j + λ_j^j × r'_{j,j}                                                                       (20.42)
    let mut xi = xi_parent.clone();
    for k in 0..xi.ncols() {
        let lambda_k = lambda.column(k).into_owned();
        let lambda_k_parent = lambda_parent.column(k).into_owned();
        let xi_k = xi_parent.column(k) - lambda_k_parent.cross(r_parent) + lambda_k.cross(r_dash);
        xi.set_column(k, &if k == j { xi_k + e * s } else { xi_k });
    }
    // δ^j = δ^{j−1} − γ^{j−1} × r_{j−1,j} + γ^j × r'_{j,j} − ω_{j−1} × (ω_{j−1} × r_{j−1,j})
    //     + ω_j × (ω_j × r'_{j,j}) + 2 ω_j × e_j s_j q̇_j                                                        (20.43)
    let delta = delta_parent - gamma_parent.cross(r_parent) + gamma.cross(r_dash)
        - omega_parent.cross(&omega_parent.cross(r_parent))
        + omega.cross(&omega.cross(r_dash))
        + omega.cross(e) * (two * s * qd);
    LinearForms { lambda, gamma, xi, delta, omega }
}

fn ball_forms<T: ReferenceReal>(
    position: &LinkGeometry<T>,
    parent: &LinearForms<T>,
    iv: usize,
    qd: &[T],
) -> LinearForms<T> {
    let LinkGeometry { rotation, r, r_parent, .. } = position;
    let own = rotation * Vector3::from_column_slice(qd);
    let omega = parent.omega + own;
    // Λ^j: that of the parent, and A_j in its own columns
    let mut lambda = parent.lambda.clone();
    lambda.fixed_view_mut::<3, 3>(0, iv).copy_from(rotation);
    // γ^j = γ^{j−1} + ω_j × A_j ω̃
    let gamma = parent.gamma + omega.cross(&own);
    // Ξ^j = Ξ^{j−1} + r̲_{j−1,j} Λ^{j−1} − r̲_{j,j} Λ^j
    let xi = &parent.xi + skew(r_parent) * &parent.lambda - skew(r) * &lambda;
    // (20.43) with s_j = 0
    let delta = parent.delta - parent.gamma.cross(r_parent) + gamma.cross(r)
        - parent.omega.cross(&parent.omega.cross(r_parent))
        + omega.cross(&omega.cross(r));
    LinearForms { lambda, gamma, xi, delta, omega }
}

fn free_forms<T: ReferenceReal>(
    position: &LinkGeometry<T>,
    base: LinearForms<T>,
    iv: usize,
    qd: &[T],
) -> LinearForms<T> {
    let LinkGeometry { rotation, r, .. } = position;
    let root_velocity = rotation * Vector3::new(qd[0], qd[1], qd[2]);
    let omega = rotation * Vector3::new(qd[3], qd[4], qd[5]);
    let LinearForms { mut lambda, mut xi, .. } = base;
    // Λ⁰ = [0 | A_0],    Ξ⁰ = [A_0 | −r̲ A_0]
    lambda.fixed_view_mut::<3, 3>(0, iv + 3).copy_from(rotation);
    xi.fixed_view_mut::<3, 3>(0, iv).copy_from(rotation);
    xi.fixed_view_mut::<3, 3>(0, iv + 3).copy_from(&(-skew(r) * rotation));
    // Γ⁰ = 0,    Δ⁰ = ω_0 × A_0 ṽ + ω_0 × (ω_0 × r)
    let delta = omega.cross(&root_velocity) + omega.cross(&omega.cross(r));
    LinearForms { lambda, gamma: Vector3::zeros(), xi, delta, omega }
}
