//! The arm: generated functions, the manufacturer's limits, and capsules that hold the links.

use crate::{dot, length, Joints, NV};

straightline::dynamics! {
    /// The Panda as the controller knows it.
    #[allow(clippy::all)]
    pub mod panda = "../descriptions/panda.urdf",
        functions(
            forward_dynamics, forward_dynamics_derivatives, gravity_derivative, gravity_force, forward_kinematics,
            kinematics_and_jacobian, mass_matrix_and_gravity_force, coriolis_transpose_force
        ),
        frames("panda_link2", "panda_link4", "panda_link6", "panda_link7", "panda_hand_tcp")
}

straightline::dynamics! {
    /// The Panda that is simulated: its tool and its forearm are parameters.
    #[allow(clippy::all)]
    pub mod plant = "../descriptions/panda.urdf", scene = "../scenes/panda_plant.toml"
}

/// Frames between which the capsules lie.
pub const POINTS: usize = panda::FRAME_NAMES.len();
/// The point of the hand that is to reach.
pub const HAND: usize = POINTS - 1;
/// Greatest torques \[N·m\]: <https://frankaemika.github.io/docs/control_parameters.html>; the robot file has none.
pub const TORQUE: Joints = [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0];
/// Greatest speeds \[rad/s\], from there.
pub const SPEED: Joints = [2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61];
/// Radii of the capsules from each point to the next one \[m\]: upper arm, forearm, wrist, hand.
pub const RADII: [f64; POINTS - 1] = [0.08, 0.075, 0.07, 0.05];

/// Positions of the points in the world \[m\].
pub type Points = [[f64; 3]; POINTS];

/// Where the points are.
pub fn points(q: &Joints) -> Points {
    let mut poses = [[0.0; 12]; POINTS];
    panda::forward_kinematics(q, &mut poses);
    poses.map(|pose| [pose[0], pose[1], pose[2]])
}

/// Where the points are, and ∂/∂q of that: rows x, y, z \[m/rad\].
pub fn points_and_slopes(q: &Joints) -> (Points, [[Joints; 3]; POINTS]) {
    let (mut poses, mut jacobians) = ([[0.0; 12]; POINTS], [[[0.0; NV]; 6]; POINTS]);
    panda::kinematics_and_jacobian(q, &mut poses, &mut jacobians);
    (poses.map(|pose| [pose[0], pose[1], pose[2]]), jacobians.map(|rows| [rows[0], rows[1], rows[2]]))
}

/// A sphere that nothing of the arm may touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre in the world \[m\].
    pub centre: [f64; 3],
    /// \[m\]
    pub radius: f64,
}

/// How near a capsule is to a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearness {
    /// Between the surfaces \[m\]; negative where they overlap.
    pub distance: f64,
    /// From the axis of the capsule towards the centre, of length one.
    pub normal: [f64; 3],
    /// Where on the axis, from 0 at its first point to 1 at its second one.
    pub along: f64,
}

/// Capsule k, from point k to the next one, and a sphere. The distance has a continuous gradient: where the nearest point of the axis moves
/// along the axis it does so across the normal, and at its ends it stands still.
pub fn nearness(points: &Points, k: usize, sphere: &Sphere) -> Nearness {
    let (from, to) = (&points[k], &points[k + 1]);
    let axis: [f64; 3] = core::array::from_fn(|i| to[i] - from[i]);
    let way: [f64; 3] = core::array::from_fn(|i| sphere.centre[i] - from[i]);
    // no axis is a point: the frames are apart by design of the arm
    let along = (dot(&way, &axis) / dot(&axis, &axis)).clamp(0.0, 1.0);
    let off: [f64; 3] = core::array::from_fn(|i| way[i] - along * axis[i]);
    let far = length(&off);
    Nearness { distance: far - RADII[k] - sphere.radius, normal: off.map(|x| x / far), along }
}

/// The least distance between the arm and the spheres \[m\].
pub fn clearance(points: &Points, spheres: &[Sphere]) -> f64 {
    let of =
        |sphere: &Sphere| (0..RADII.len()).map(|k| nearness(points, k, sphere).distance).fold(f64::INFINITY, f64::min);
    spheres.iter().map(of).fold(f64::INFINITY, f64::min)
}
