//! Poses, Jacobians and accelerations of frames that are fixed to links.
//!
//! From the linear forms Λ, Γ, Ξ, Δ of section 20.2.1, carried from the centre of mass C_j to the frame's origin P by the
//! vector ρ = C_j P. World axes, linear part first.

use super::{geometry, linear_forms, skew, CentreOfMassFrame, CentreOfMassTree, LinkGeometry, ReferenceReal};
use crate::dd::Dd;
use alloc::vec;
use nalgebra::{DVector, Matrix3, Matrix6xX, Vector3, Vector6};

/// Pose of a frame in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct FramePose<T> {
    /// Its origin \[m\].
    #[doc(alias = "tip")]
    pub position: Vector3<T>,
    /// Columns: its axes.
    pub rotation: Matrix3<T>,
}

/// ρ = C_j P in the external frame.
fn offset<T: ReferenceReal>(frame: &CentreOfMassFrame<T>, link: &LinkGeometry<T>) -> Vector3<T> {
    link.rotation * frame.position
}

/// Where the frame is.
pub fn frame_pose<T: ReferenceReal>(tree: &CentreOfMassTree<T>, frame: &CentreOfMassFrame<T>, q: &[T]) -> FramePose<T> {
    match frame.link {
        None => FramePose { position: frame.position, rotation: frame.rotation },
        Some(j) => {
            let link = &geometry(tree, q)[j];
            FramePose { position: link.centre_of_mass + offset(frame, link), rotation: link.rotation * frame.rotation }
        }
    }
}

/// Geometric Jacobian of the frame at its origin, 6 × n.
pub fn frame_jacobian<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    frame: &CentreOfMassFrame<T>,
    q: &[T],
) -> Matrix6xX<T> {
    let n = tree.nv();
    let mut jacobian = Matrix6xX::zeros(n);
    if let Some(j) = frame.link {
        let links = geometry(tree, q);
        let rest = vec![T::constant(Dd::ZERO); n];
        let forms = &linear_forms(tree, &links, &rest)[j];
        // v_P = v_j + ω_j × ρ = (Ξ^j − ρ̲ Λ^j) q̇,    ω_P = Λ^j q̇
        let rho = offset(frame, &links[j]);
        jacobian.fixed_rows_mut::<3>(0).copy_from(&(&forms.xi - skew(&rho) * &forms.lambda));
        jacobian.fixed_rows_mut::<3>(3).copy_from(&forms.lambda);
    }
    jacobian
}

/// J̇ q̇ of the frame: its linear and angular acceleration for q̈ = 0.
pub fn frame_jacobian_bias<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    frame: &CentreOfMassFrame<T>,
    q: &[T],
    qd: &[T],
) -> Vector6<T> {
    let mut bias = Vector6::zeros();
    if let Some(j) = frame.link {
        let links = geometry(tree, q);
        let forms = &linear_forms(tree, &links, qd)[j];
        let rho = offset(frame, &links[j]);
        // w_P = w_j + ε_j × ρ + ω_j × (ω_j × ρ), and for q̈ = 0: w_j = Δ^j, ε_j = Γ^j
        let linear = forms.delta + forms.gamma.cross(&rho) + forms.omega.cross(&forms.omega.cross(&rho));
        bias.fixed_rows_mut::<3>(0).copy_from(&linear);
        bias.fixed_rows_mut::<3>(3).copy_from(&forms.gamma);
    }
    bias
}

/// Linear velocity of the frame's origin and its angular velocity: J q̇.
pub fn frame_velocity<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    frame: &CentreOfMassFrame<T>,
    q: &[T],
    qd: &[T],
) -> Vector6<T> {
    frame_jacobian(tree, frame, q) * DVector::from_column_slice(qd)
}

/// Linear acceleration of the frame's origin and its angular acceleration: J q̈ + J̇ q̇.
pub fn frame_acceleration<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    frame: &CentreOfMassFrame<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
) -> Vector6<T> {
    frame_jacobian(tree, frame, q) * DVector::from_column_slice(qdd) + frame_jacobian_bias(tree, frame, q, qd)
}
