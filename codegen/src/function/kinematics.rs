//! Where the frames are, and how they move.

use super::spec::Extent::{Frames, Of, Velocities};
use super::spec::{Family, Output, Parts, RobotFunction, Spec};
use super::{Forms, Function, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::model::Frame;
use straightline_core::spatial::{MotionVector, Transform, Vec3};
use straightline_core::Real;

const POSES: Output = Output::new(
    "x",
    &[Frames, Of(12)],
    "per frame of [`FRAME_NAMES`]: position p \\[m\\] (3), then orientation R by rows (9); \
R's columns are the frame's axes",
)
.of_parts(Parts::LinearAngular);
const JACOBIANS: Output = Output::new(
    "j",
    &[Frames, Of(6), Velocities],
    "per frame: 6 rows (3 linear at the frame's origin, 3 angular; world axes) \
of one column per velocity coordinate",
)
.of_parts(Parts::LinearAngular);

pub struct ForwardKinematics;

impl RobotFunction for ForwardKinematics {
    const SPEC: Spec = Spec {
        name: "forward_kinematics",
        summary: "Poses of the frames in the world.",
        aliases: &["FK", "direct kinematics"],
        inputs: &[Quantity::Configuration],
        outputs: &[POSES],
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::forward_kinematics(forms.model, &inputs[0], forms.frames).iter().flat_map(pose).collect()
    }
}

pub struct FrameVelocity;

impl RobotFunction for FrameVelocity {
    const SPEC: Spec = Spec {
        name: "frame_velocity",
        summary: "Velocities of the frames.",
        aliases: &["twist"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new(
            "v",
            &[Frames, Of(6)],
            "per frame: velocity of the origin \\[m/s\\] (3), angular velocity \\[rad/s\\] (3), world axes",
        )
        .of_parts(Parts::LinearAngular)],
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let of = |f: &&Frame<T>| motion(alg::frame_velocity(forms.model, &inputs[0], &inputs[1], f));
        forms.frames.iter().flat_map(of).collect()
    }
}

pub struct FrameAcceleration;

impl RobotFunction for FrameAcceleration {
    const SPEC: Spec = Spec {
        name: "frame_acceleration",
        summary: "Accelerations of the frames, without gravity.",
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[Output::new(
            "a",
            &[Frames, Of(6)],
            "per frame: acceleration of the origin \\[m/s²\\] (3), angular acceleration \\[rad/s²\\] (3), world axes",
        )
        .of_parts(Parts::LinearAngular)],
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let of = |f: &&Frame<T>| motion(alg::frame_acceleration(forms.model, &inputs[0], &inputs[1], &inputs[2], f));
        forms.frames.iter().flat_map(of).collect()
    }
}

pub struct Jacobian;

impl RobotFunction for Jacobian {
    const SPEC: Spec = Spec {
        name: "jacobian",
        summary: "Geometric Jacobians J of the frames: J q̇ is the frame's velocity.",
        aliases: &["geometric Jacobian"],
        inputs: &[Quantity::Configuration],
        outputs: &[JACOBIANS],
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        forms.frames.iter().flat_map(|f| alg::jacobian(forms.model, &inputs[0], f)).collect()
    }
}

pub struct JacobianBias;

impl RobotFunction for JacobianBias {
    const SPEC: Spec = Spec {
        name: "jacobian_bias",
        summary: "J̇ q̇ of the frames: their acceleration for q̈ = 0.",
        aliases: &["Jdot qdot", "velocity product acceleration"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new(
            "a",
            &[Frames, Of(6)],
            "per frame: linear \\[m/s²\\] (3), angular \\[rad/s²\\] (3), world axes",
        )
        .of_parts(Parts::LinearAngular)],
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let of = |f: &&Frame<T>| motion(alg::jacobian_bias(forms.model, &inputs[0], &inputs[1], f));
        forms.frames.iter().flat_map(of).collect()
    }
}

pub struct KinematicsAndJacobian;

impl RobotFunction for KinematicsAndJacobian {
    const SPEC: Spec = Spec {
        name: "kinematics_and_jacobian",
        summary: "Poses and geometric Jacobians of the frames, at the cost of little more than one of them.",
        aliases: &["FK", "geometric Jacobian"],
        inputs: &[Quantity::Configuration],
        outputs: &[POSES, JACOBIANS],
        family: Family::Combination,
        members: &[Function::ForwardKinematics, Function::Jacobian],
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let of = |f: &Function| f.evaluate_on(forms, inputs);
        Self::SPEC.members.iter().flat_map(of).collect()
    }
}

fn pose<T: Real>(x: &Transform<T>) -> Vec<T> {
    x.translation.to_array().into_iter().chain(x.rotation.rows.into_iter().flatten()).collect()
}

/// Linear part first, as robot users expect it.
fn motion<T: Real>(m: MotionVector<T>) -> Vec<T> {
    [m.linear, m.angular].into_iter().flat_map(Vec3::to_array).collect()
}
