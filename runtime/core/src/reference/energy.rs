//! Energies, momentum and the common mass centre, summed over the links.
//!
//! Textbook sums over the link motions of (20.23)–(20.26): König's theorem for the kinetic energy.

use super::{geometry, motion, LinkGeometry, LinkMotion, MassCentreTree, Number};
use crate::dd::Dd;
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::Vector3;

/// Momentum of the robot, in the external frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Momentum<T> {
    /// Σ m_j v_j \[kg·m/s\].
    pub linear: Vector3<T>,
    /// Angular momentum about the common mass centre \[kg·m²/s\].
    pub angular_about_mass_centre: Vector3<T>,
    /// Angular momentum about the origin of the external frame \[kg·m²/s\].
    pub angular_about_origin: Vector3<T>,
}

/// Positions and velocities of all links.
fn velocities<T: Number>(tree: &MassCentreTree<T>, q: &[T], qd: &[T]) -> (Vec<LinkGeometry<T>>, Vec<LinkMotion<T>>) {
    let position = geometry(tree, q);
    let motion = motion(tree, &position, qd, &vec![T::constant(Dd::ZERO); tree.nv()]);
    (position, motion)
}

/// A_j J̃_j A_jᵀ ω_j: angular momentum of link j about its own mass centre.
fn spin<T: Number>(tree: &MassCentreTree<T>, j: usize, position: &LinkGeometry<T>, omega: &Vector3<T>) -> Vector3<T> {
    position.rotation * (tree.links[j].inertia * (position.rotation.transpose() * omega))
}

/// Kinetic energy \[J\].
pub fn kinetic_energy<T: Number>(tree: &MassCentreTree<T>, q: &[T], qd: &[T]) -> T {
    let (position, motion) = velocities(tree, q, qd);
    let mut twice: T = nalgebra::zero();
    for (j, link) in tree.links.iter().enumerate() {
        let LinkMotion { v, omega, .. } = &motion[j];
        // 2 T = Σ m_j v_j · v_j + ω_j · A_j J̃_j A_j⁻¹ ω_j
        twice += link.mass * v.dot(v) + omega.dot(&spin(tree, j, &position[j], omega));
    }
    twice * T::constant(Dd::HALF)
}

/// Potential energy of gravity \[J\], zero with all mass centres in the origin; what is fixed to the world is left out.
pub fn potential_energy<T: Number>(tree: &MassCentreTree<T>, q: &[T]) -> T {
    let position = geometry(tree, q);
    // V = −Σ m_j g · r_{c,j}
    let sum = tree
        .links
        .iter()
        .zip(&position)
        .fold(nalgebra::zero::<T>(), |sum, (link, here)| sum + link.mass * tree.gravity.dot(&here.mass_centre));
    -sum
}

/// Mass centre of all moving links \[m\], in the external frame. A robot without mass gives NaN.
pub fn centre_of_mass<T: Number>(tree: &MassCentreTree<T>, q: &[T]) -> Vector3<T> {
    let position = geometry(tree, q);
    common_mass_centre(tree, &position)
}

fn common_mass_centre<T: Number>(tree: &MassCentreTree<T>, position: &[LinkGeometry<T>]) -> Vector3<T> {
    let mut mass: T = nalgebra::zero();
    let mut moment: Vector3<T> = Vector3::zeros();
    for (link, here) in tree.links.iter().zip(position) {
        mass += link.mass;
        moment += here.mass_centre * link.mass;
    }
    moment.map(|x| x / mass)
}

/// Linear and angular momentum of all moving links.
pub fn momentum<T: Number>(tree: &MassCentreTree<T>, q: &[T], qd: &[T]) -> Momentum<T> {
    let (position, motion) = velocities(tree, q, qd);
    let centre = common_mass_centre(tree, &position);
    let o = Vector3::zeros();
    let mut sum = Momentum { linear: o, angular_about_mass_centre: o, angular_about_origin: o };
    for (j, link) in tree.links.iter().enumerate() {
        let linear = motion[j].v * link.mass;
        let own = spin(tree, j, &position[j], &motion[j].omega);
        let r = position[j].mass_centre;
        sum.linear += linear;
        sum.angular_about_mass_centre += own + (r - centre).cross(&linear);
        sum.angular_about_origin += own + r.cross(&linear);
    }
    sum
}
