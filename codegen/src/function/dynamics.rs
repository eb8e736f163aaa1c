//! Forces to motion and motion to forces: inverse and forward dynamics, and what they are made of.

use super::solution::{net_force, Solution};
use super::spec::Extent::{Joints, Of, Velocities};
use super::spec::{Divisor, Family, Form, InLanes, Judged, Output, Parts, RobotFunction, Spec};
use super::{Forms, Function, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::spatial::Vec3;
use straightline_core::Real;

const GRAVITY_FORCE: Output = Output::new("g", &[Velocities], "generalized forces \\[N·m or N\\]");
const MASS_MATRIX: Output =
    Output::new("h", &[Velocities, Velocities], "rows of H, both triangles \\[kg·m², kg·m, kg\\]")
        .of_parts(Parts::Diagonal)
        .symmetric();

pub struct InverseDynamics;

impl RobotFunction for InverseDynamics {
    const SPEC: Spec = Spec {
        name: "inverse_dynamics",
        summary: "Inverse dynamics τ = H(q) q̈ + h(q, q̇): the generalized forces that a motion takes.",
        aliases: &["RNEA", "ID", "Newton-Euler", "computed torque"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[Output::new("tau", &[Velocities], "generalized forces \\[N·m or N\\]")],
        form: Form::InverseDynamics,
        in_lanes: InLanes::WhereFaster(3),
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        forms.inverse_dynamics(&inputs[0], &inputs[1], &inputs[2])
    }
}

pub struct GravityForce;

impl RobotFunction for GravityForce {
    const SPEC: Spec = Spec {
        name: "gravity_force",
        summary: "Gravity forces g(q): the generalized forces that hold the robot still.",
        aliases: &["gravity compensation", "generalized gravity"],
        inputs: &[Quantity::Configuration],
        outputs: &[GRAVITY_FORCE],
        form: Form::BiasForce,
        in_lanes: InLanes::WhereAsked,
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        forms.gravity_force(&inputs[0])
    }
}

pub struct BiasForce;

impl RobotFunction for BiasForce {
    const SPEC: Spec = Spec {
        name: "bias_force",
        summary: "Bias forces h(q, q̇): Coriolis, centrifugal and gravity forces.",
        aliases: &["nonlinear effects", "NLE", "Coriolis"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new("h", &[Velocities], "generalized forces \\[N·m or N\\]")],
        form: Form::BiasForce,
        in_lanes: InLanes::WhereFaster(3),
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        forms.bias_force(&inputs[0], &inputs[1])
    }
}

pub struct VelocityForce;

impl RobotFunction for VelocityForce {
    const SPEC: Spec = Spec {
        name: "velocity_force",
        summary: "Velocity forces C(q, q̇) q̇: Coriolis and centrifugal forces, without gravity.",
        aliases: &["Coriolis", "centrifugal"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new("c", &[Velocities], "generalized forces \\[N·m or N\\]")],
        form: Form::BiasForce,
        in_lanes: InLanes::WhereFaster(3),
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        forms.velocity_force(&inputs[0], &inputs[1])
    }
}

pub struct MassMatrix;

impl RobotFunction for MassMatrix {
    const SPEC: Spec = Spec {
        name: "mass_matrix",
        summary: "The mass matrix H(q), symmetric.",
        aliases: &["CRBA", "inertia matrix", "joint space inertia", "JSIM"],
        inputs: &[Quantity::Configuration],
        outputs: &[MASS_MATRIX],
        form: Form::MassMatrix,
        substituted_up_to: 3000,
        judged: Judged::ByInertias,
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        forms.mass_matrix(&inputs[0])
    }
}

pub struct MassMatrixAndGravityForce;

impl RobotFunction for MassMatrixAndGravityForce {
    const SPEC: Spec = Spec {
        name: "mass_matrix_and_gravity_force",
        summary: "The mass matrix H(q) and the gravity forces g(q), which share sines and composite bodies.",
        aliases: &["CRBA with gravity compensation"],
        inputs: &[Quantity::Configuration],
        outputs: &[MASS_MATRIX, GRAVITY_FORCE],
        family: Family::Combination,
        members: &[Function::MassMatrix, Function::GravityForce],
        form: Form::Both,
        substituted_up_to: 3000,
        judged: Judged::ByInertias,
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        [forms.mass_matrix(&inputs[0]), forms.gravity_force(&inputs[0])].concat()
    }
}

pub struct ForwardDynamics;

impl RobotFunction for ForwardDynamics {
    const SPEC: Spec = Spec {
        name: "forward_dynamics",
        summary: "Forward dynamics q̈ = H(q)⁻¹ (τ − h(q, q̇)): the motion that generalized forces cause.",
        aliases: &["ABA", "FD", "articulated body"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Force],
        outputs: &[Output::new("qdd", &[Velocities], "accelerations \\[rad/s² or m/s²\\]")],
        form: Form::Motion,
        solves: true,
        substituted_up_to: 3000,
        keeps_order: true,
        divisor: Divisor::Inertia,
        judged: Judged::ByResidual,
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let net = net_force(forms, inputs);
        Solution::new(forms, &inputs[0]).of(&net)
    }

    fn residual<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>], found: &[T]) -> Vec<T> {
        let takes = forms.inverse_dynamics(&inputs[0], &inputs[1], found);
        takes.into_iter().zip(&inputs[2]).map(|(takes, tau)| takes - *tau).collect()
    }
}

pub struct JointWrenches;

impl RobotFunction for JointWrenches {
    const SPEC: Spec = Spec {
        name: "joint_wrenches",
        summary: "Forces and moments that each joint carries, drive included.",
        aliases: &["constraint forces", "joint reactions"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[Output::new(
            "w",
            &[Joints, Of(6)],
            "per joint, in the order of qd: force \\[N\\] (3), moment about the joint's origin \\[N·m\\] (3), \
from parent to child, in the child link's axes",
        )
        .of_parts(Parts::LinearAngular)],
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let wrenches = alg::joint_wrenches(forms.model, &inputs[0], &inputs[1], &inputs[2]).into_iter();
        wrenches.flat_map(|w| [w.force, w.moment]).flat_map(Vec3::to_array).collect()
    }
}
