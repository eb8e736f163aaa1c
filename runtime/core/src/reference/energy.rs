//! Energies, momentum and the common centre of mass, summed over the links.
//!
//! Textbook sums over the link motions of (20.23)–(20.26): König's theorem for the kinetic energy.

use super::{geometry, motion, CentreOfMassTree, LinkGeometry, LinkMotion, ReferenceReal};
use crate::dd::Dd;
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::Vector3;

/// Momentum of the robot, in the external frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceMomentum<T> {
    /// Σ m_j v_j \[kg·m/s\].
    pub linear: Vector3<T>,
    /// Angular momentum about the common centre of mass \[kg·m²/s\].
    pub angular_about_centre_of_mass: Vector3<T>,
    /// Angular momentum about the origin of the external frame \[kg·m²/s\].
    pub angular_about_origin: Vector3<T>,
}

/// Positions and velocities of all links.
fn velocities<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    q: &[T],
    qd: &[T],
) -> (Vec<LinkGeometry<T>>, Vec<LinkMotion<T>>) {
    let position = geometry(tree, q);
    let motion = motion(tree, &position, qd, &vec![T::constant(Dd::ZERO); tree.nv()]);
    (position, motion)
}

/// A_j J̃_j A_jᵀ ω_j: angular momentum of link j about its own centre of mass.
fn spin<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    j: usize,
    position: &LinkGeometry<T>,
    omega: &Vector3<T>,
) -> Vector3<T> {
    position.rotation * (tree.links[j].inertia * (position.rotation.transpose() * omega))
}

/// Kinetic energy \[J\].
pub fn kinetic_energy<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T]) -> T {
    let (position, motion) = velocities(tree, q, qd);
    let mut twice: T = nalgebra::zero();
    for (j, link) in tree.links.iter().enumerate() {
        let LinkMotion { v, omega, .. } = &motion[j];
        // 2 T = Σ m_j v_j · v_j + ω_j · A_j J̃_j A_j⁻¹ ω_j
        twice += link.mass * v.dot(v) + omega.dot(&spin(tree, j, &position[j], omega));
    }
    twice * T::constant(Dd::HALF)
}

/// Potential energy of gravity \[J\], zero with all centres of mass in the origin; what is fixed to the world is left out.
pub fn potential_energy<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T]) -> T {
    let position = geometry(tree, q);
    // V = −Σ m_j g · r_{c,j}
    let sum = tree
        .links
        .iter()
        .zip(&position)
        .fold(nalgebra::zero::<T>(), |sum, (link, here)| sum + link.mass * tree.gravity.dot(&here.centre_of_mass));
    -sum
}

/// Centre of mass of all moving links \[m\], in the external frame. A robot without mass gives NaN.
pub fn centre_of_mass<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T]) -> Vector3<T> {
    let position = geometry(tree, q);
    common_centre_of_mass(tree, &position)
}

fn common_centre_of_mass<T: ReferenceReal>(tree: &CentreOfMassTree<T>, position: &[LinkGeometry<T>]) -> Vector3<T> {
    let mut mass: T = nalgebra::zero();
    let mut moment: Vector3<T> = Vector3::zeros();
    for (link, here) in tree.links.iter().zip(position) {
        mass += link.mass;
        moment += here.centre_of_mass * link.mass;
    }
    moment.map(|x| x / mass)
}

/// Linear and angular momentum of all moving links.
pub fn momentum<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T]) -> ReferenceMomentum<T> {
    let (position, motion) = velocities(tree, q, qd);
    let centre = common_centre_of_mass(tree, &position);
    let o = Vector3::zeros();
    let mut sum = ReferenceMomentum { linear: o, angular_about_centre_of_mass: o, angular_about_origin: o };
    for (j, link) in tree.links.iter().enumerate() {
        let linear = motion[j].v * link.mass;
        let own = spin(tree, j, &position[j], &motion[j].omega);
        let r = position[j].centre_of_mass;
        sum.linear += linear;
        sum.angular_about_centre_of_mass += own + (r - centre).cross(&linear);
        sum.angular_about_origin += own + r.cross(&linear);
    }
    sum
}
