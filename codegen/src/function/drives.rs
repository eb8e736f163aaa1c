//! The functions of a robot with drives: motors and other actuators, transmissions.

use super::spec::Extent::{DriveStates, Drives, Of, Velocities};
use super::spec::{Divisor, Family, Form, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::algorithms::{Links, MOST_DERIVATIVES};
use straightline_core::model::Model;
use straightline_core::{Real, Taylor};

pub struct DrivenForwardDynamics;

impl RobotFunction for DrivenForwardDynamics {
    const SPEC: Spec = Spec {
        name: "driven_forward_dynamics",
        summary:
            "The motion that the inputs of the drives make: the complete model (20.72), (20.78) of robot and drives.",
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::DriveState, Quantity::DriveInput],
        outputs: &[
            Output::new("qdd", &[Velocities], "accelerations \\[rad/s² or m/s²\\]"),
            Output::new("xd", &[DriveStates], "derivative of the drives' state, in the order of x"),
        ],
        family: Family::Drives,
        form: Form::Motion,
        solves: true,
        divisor: Divisor::InertiaWithDrives,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let motion = with_links(forms, inputs, |at, bias, links| alg::driven_motion(forms.model, at, bias, links));
        [motion.qdd, motion.xd].concat()
    }
}

pub struct DrivenInverseDynamics;

impl RobotFunction for DrivenInverseDynamics {
    const SPEC: Spec = Spec {
        name: "driven_inverse_dynamics",
        summary: "The inputs of the generalized forces that a motion takes, whatever their limits.",
        aliases: &["feedforward", "flatness"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[
            Output::new("u", &[Drives], "inputs \\[V, or as in the robot file\\]"),
            Output::new("m", &[Drives], "torques that the actuators put out \\[N·m\\]"),
        ],
        family: Family::Drives,
        inputs_depend: true,
        form: Form::InverseDynamics,
        ..Spec::DEFAULT
    };

    /// And every robot's drives have an inverse that takes so few derivatives.
    fn is_of<T: Real>(model: &Model<T>) -> bool {
        model.closure.is_empty() && !model.drives.is_empty() && alg::inverse_orders(&model.drives).is_some()
    }

    /// Derivatives that the motion must have, and the state where it is read.
    fn further_inputs<T: Real>(model: &Model<T>) -> Vec<Quantity> {
        let orders = alg::inverse_orders(&model.drives).map_or(0, |o| o.of_torque);
        let state = alg::reads_states(&model.drives).then_some(Quantity::DriveState);
        (3..3 + orders).map(Quantity::HigherRate).chain(state).collect()
    }

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let terms = match alg::inverse_orders(&forms.model.drives).map_or(0, |o| o.of_torque) {
            0 => 1,
            1..=3 => 4,
            4..=7 => 8,
            8..=15 => 16,
            _ => MOST_DERIVATIVES + 1,
        };
        let (rates, x) = match alg::reads_states(&forms.model.drives) {
            true => (&inputs[1..inputs.len() - 1], &inputs[inputs.len() - 1][..]),
            false => (&inputs[1..], &[][..]),
        };
        let rates: Vec<&[T]> = rates.iter().map(Vec::as_slice).collect();
        let torques = |model: &Model<Series<T>>, q: &[Series<T>], qd: &[Series<T>], qdd: &[Series<T>]| {
            let reduced = forms.reduced.map(|both| both.map(|r| r.map(Taylor::fixed)));
            let reduced = reduced.as_ref().map(|[torques, h]| [torques, h]);
            Forms { reduced, ..Forms::plain(model, &[], forms.method) }.inverse_dynamics(q, qd, qdd)
        };
        let (u, m) = alg::driven_inverse(terms, forms.model, &inputs[0], &rates, x, torques);
        [u, m].concat()
    }
}

pub struct DriveTorques;

impl RobotFunction for DriveTorques {
    const SPEC: Spec = Spec {
        name: "drive_torques",
        summary: "The torques of the drives under their inputs.",
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::DriveState, Quantity::DriveInput],
        outputs: &[
            Output::new("tau", &[Velocities], "generalized forces on the joints \\[N·m or N\\]"),
            Output::new("m", &[Drives], "torques that the actuators put out \\[N·m\\]"),
        ],
        family: Family::Drives,
        form: Form::Motion,
        solves: true,
        divisor: Divisor::InertiaWithDrives,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (tau, m) = with_links(forms, inputs, |at, bias, links| alg::drive_torques(forms.model, at, bias, links));
        [tau, m].concat()
    }
}

pub struct CompleteModel;

impl RobotFunction for CompleteModel {
    const SPEC: Spec = Spec {
        name: "complete_model",
        summary: "The complete model H* q̈ + h* = D u (20.72), (20.73), without losses and limits, at the currents and \
shaft states of x; of a shaft that does not give way, the row of its joint is its own equation n q̈ = T (C x + d u).",
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::DriveState],
        outputs: &[
            Output::new(
                "h_star",
                &[Velocities, Velocities],
                "rows of H*, symmetric but for such rows \\[kg·m², kg·m, kg\\]",
            )
            .symmetric(),
            Output::new("bias", &[Velocities], "h* \\[N·m or N\\]"),
            Output::new("d", &[Velocities, Drives], "rows of D, one per velocity coordinate \\[N·m/V\\]"),
        ],
        family: Family::Drives,
        form: Form::Both,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let at = (&inputs[0][..], &inputs[1][..], &inputs[2][..]);
        let (h, bias, d) =
            alg::complete_model(forms.model, at, &forms.bias_force(at.0, at.1), &forms.mass_matrix(at.0));
        [h, bias, d].concat()
    }
}

pub struct StateSpace;

impl RobotFunction for StateSpace {
    const SPEC: Spec = Spec {
        name: "state_space",
        summary: "The drives' state equation ẋ = Ĉ(x) + D̂(x) u (20.81), without losses and limits.",
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::DriveState],
        outputs: &[
            Output::new("c_hat", &[DriveStates], "Ĉ, in the order of x"),
            Output::new("d_hat", &[DriveStates, Drives], "rows of D̂, one per state, one column per drive"),
        ],
        family: Family::Drives,
        form: Form::Both,
        divisor: Divisor::InertiaWithDrives,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let at = (&inputs[0][..], &inputs[1][..], &inputs[2][..]);
        let (c, d) = alg::state_space(forms.model, at, &forms.bias_force(at.0, at.1), &forms.mass_matrix(at.0));
        [c, d].concat()
    }
}

pub struct DrivePower;

impl RobotFunction for DrivePower {
    const SPEC: Spec = Spec {
        name: "drive_power",
        summary: "Where the power of the drives goes.",
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::DriveState, Quantity::DriveInput],
        outputs: &[Output::new(
            "p",
            &[Of(7)],
            "\\[W\\]: electrical input, Joule heat, friction in motors, losses of gears, \
dampers of elastic stages, friction in joints, and \
(C_E − C_M) i θ̇, which is zero for a consistent motor",
        )],
        family: Family::Drives,
        form: Form::Both,
        solves: true,
        divisor: Divisor::InertiaWithDrives,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        with_links(forms, inputs, |at, bias, links| alg::drive_power(forms.model, at, bias, links)).to_vec()
    }
}

pub struct DriveEnergy;

impl RobotFunction for DriveEnergy {
    const SPEC: Spec = Spec {
        name: "drive_energy",
        summary: "Energy stored in the drives, beside that of the bodies.",
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::DriveState],
        outputs: &[Output::new(
            "e",
            &[Of(3)],
            "\\[J\\]: kinetic of rotors and gears, elastic of transmissions, magnetic of motors",
        )],
        family: Family::Drives,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::drive_energy(forms.model, (&inputs[0], &inputs[1], &inputs[2])).to_vec()
    }
}

/// Whether articulated bodies can solve for the motion: drives add to the diagonal of H, and nothing is lost.
pub(crate) fn may_be_articulated<T: Real>(model: &Model<T>) -> bool {
    alg::drives_are_diagonal(&model.drives)
        && model.drives.iter().all(|d| d.efficiency.is_none() && d.held_joint().is_none())
}

/// Series of any wanted number of terms: one type, so that the algorithms are compiled once over series and not once per order.
type Series<T> = Taylor<T, { MOST_DERIVATIVES + 1 }>;

/// q, q̇, x, u.
type DrivenState<'a, T> = (&'a [T], &'a [T], &'a [T], &'a [T]);

/// What is solved with the links' inertia by the method that serves this robot.
pub(super) fn with_links<T: Real, R>(
    forms: &Forms<'_, T>,
    inputs: &[Vec<T>],
    solve: impl FnOnce(DrivenState<'_, T>, &[T], &Links<'_, T>) -> R,
) -> R {
    let [q, qd, x, u] = inputs else { panic!("functions that solve take q, qd, x, u") };
    let is_articulated = !forms.factorises() && may_be_articulated(forms.model);
    let h = if is_articulated { Vec::new() } else { forms.mass_matrix(q) };
    let links = if is_articulated { Links::Articulated } else { Links::MassMatrix(&h) };
    solve((q, qd, x, u), &forms.bias_force(q, qd), &links)
}
