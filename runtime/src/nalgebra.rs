//! Arrays of generated functions as types of nalgebra, and back (feature `nalgebra`).
//!
//! Vectors are the same array (`as_ref` and `as_mut` of nalgebra say so up to sixteen entries, [`as_array`] of any size);
//! matrices are rows there and columns here, so they are copied.
//! ```
//! use nalgebra::{Isometry3, SMatrix, SVector};
//! use straightline::nalgebra::{as_array, as_array_mut, matrix};
//! use straightline::{Dynamics, Pose};
//!
//! #[derive(Dynamics)]
//! #[robot("examples/arm.toml", functions(gravity_force, forward_kinematics, jacobian))]
//! struct Arm;
//!
//! let q = SVector::<f64, { Arm::NQ }>::new(0.1, 0.2, 0.3);
//! let mut g = SVector::<f64, { Arm::NV }>::zeros();
//! Arm::gravity_force(as_array(&q), as_array_mut(&mut g));
//!
//! let mut poses = [[0.0; 12]; 1];
//! Arm::forward_kinematics(as_array(&q), &mut poses);
//! let forearm = Isometry3::from(Arm::pose(&poses, Arm::FOREARM));
//! assert_eq!(forearm.translation.vector.as_slice(), &poses[0][..3]);
//! let back = Pose::from(&forearm);
//! assert!((0..9).all(|i| (back.rotation[i / 3][i % 3] - poses[0][3 + i]).abs() < 1e-15));
//!
//! // a force of 10 N upwards at the forearm's frame, in joint torques: Jᵀ f
//! let mut jacobians = [[[0.0; Arm::NV]; 6]; 1];
//! Arm::jacobian(as_array(&q), &mut jacobians);
//! let j: SMatrix<f64, 6, { Arm::NV }> = matrix(&jacobians[Arm::FOREARM]);
//! let tau = j.transpose() * SVector::from([0.0, 0.0, 10.0, 0.0, 0.0, 0.0]);
//! assert_eq!(tau[0], 0.0); // the yaw joint feels nothing of it
//! ```

use crate::Pose;
use ::nalgebra::{Isometry3, Matrix3, RealField, Rotation3, SMatrix, SVector, Scalar, UnitQuaternion, Vector3};

/// A vector as the array that it is.
pub fn as_array<T, const N: usize>(vector: &SVector<T, N>) -> &[T; N] {
    &vector.data.0[0]
}

/// A vector as the array that it is.
pub fn as_array_mut<T, const N: usize>(vector: &mut SVector<T, N>) -> &mut [T; N] {
    &mut vector.data.0[0]
}

/// The matrix of these rows.
pub fn matrix<T: Scalar + Copy, const R: usize, const C: usize>(rows: &[[T; C]; R]) -> SMatrix<T, R, C> {
    SMatrix::from_fn(|i, j| rows[i][j])
}

/// The rows of a matrix.
pub fn rows<T: Scalar + Copy, const R: usize, const C: usize>(matrix: &SMatrix<T, R, C>) -> [[T; C]; R] {
    core::array::from_fn(|i| core::array::from_fn(|j| matrix[(i, j)]))
}

impl<T: RealField + Copy> From<Pose<T>> for Isometry3<T> {
    /// The rotation as the unit quaternion of it.
    fn from(pose: Pose<T>) -> Self {
        let rotation = Rotation3::from_matrix_unchecked(matrix(&pose.rotation));
        Isometry3::from_parts(Vector3::from(pose.position).into(), UnitQuaternion::from_rotation_matrix(&rotation))
    }
}

impl<T: RealField + Copy> From<&Isometry3<T>> for Pose<T> {
    fn from(isometry: &Isometry3<T>) -> Self {
        let rotation: Matrix3<T> = isometry.rotation.to_rotation_matrix().into_inner();
        Pose { position: *as_array(&isometry.translation.vector), rotation: rows(&rotation) }
    }
}
