//! Where bodies stand, as the page takes it: positions and unit quaternions in single precision.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use straightline_core::algorithms::forward_kinematics;
use straightline_core::model::{Frame, Model};
use straightline_core::spatial::{Mat3, Transform};

/// Pose of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewedPose {
    /// Its origin \[m\].
    pub position: [f64; 3],
    /// Its axes: unit quaternion x, y, z, w.
    pub turn: [f64; 4],
}

impl From<&Transform<f64>> for ViewedPose {
    fn from(of: &Transform<f64>) -> ViewedPose {
        ViewedPose { position: of.translation.to_array(), turn: quaternion(&of.rotation) }
    }
}

impl ViewedPose {
    /// Position and quaternion, rounded.
    pub fn in_single_precision(&self) -> [f32; 7] {
        let ([x, y, z], [i, j, k, w]) = (self.position, self.turn);
        [x, y, z, i, j, k, w].map(|number| number as f32)
    }
}

fn quaternion(of: &Mat3<f64>) -> [f64; 4] {
    let [a, b, c] = of.rows;
    let matrix = Matrix3::new(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    [turn.i, turn.j, turn.k, turn.w]
}

/// Poses in the world of the canonical frames of all bodies, at these coordinates.
pub(crate) fn world_transforms(model: &Model<f64>, q: &[f64]) -> Vec<Transform<f64>> {
    let of = |b: usize| Frame { name: String::new(), body: Some(b), placement: Transform::identity() };
    let frames: Vec<Frame<f64>> = (0..model.bodies.len()).map(of).collect();
    forward_kinematics(model, q, &frames.iter().collect::<Vec<_>>())
}

/// Poses in the world of the frames of a model, in its order, at these coordinates (`model.nq()` of them).
pub fn frame_poses(model: &Model<f64>, q: &[f64]) -> Vec<ViewedPose> {
    forward_kinematics(model, q, &model.frames.iter().collect::<Vec<_>>()).iter().map(ViewedPose::from).collect()
}

/// Poses in the world of the canonical frames of all bodies, at these coordinates (`model.nq()` of them).
pub fn world_poses(model: &Model<f64>, q: &[f64]) -> Vec<ViewedPose> {
    world_transforms(model, q).iter().map(ViewedPose::from).collect()
}
