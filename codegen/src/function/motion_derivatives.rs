//! Derivatives of the motion of frames, and of the robot as a whole: centre of mass and centroidal momentum.

use super::closed_derivatives::{NumbersAtOrigin, NumbersAtWorldOrigin, NumbersInOwnAxes};
use super::spec::Extent::{Frames, Joints, Of, Velocities};
use super::spec::{Divisor, Form, Output, RobotFunction, Spec};
use super::{Extent, Forms, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::model::Frame;
use straightline_core::Real;

const PER_FRAME: &[Extent] = &[Frames, Of(6), Velocities];
const SIX_ROWS: &[Extent] = &[Of(6), Velocities];
const MAP: Output = Output::new(
    "a",
    SIX_ROWS,
    "rows of A: linear \\[kg, kg·m\\] (3), angular about the centre of mass \\[kg·m, kg·m²\\] (3), world axes, of one column per velocity \
coordinate",
);

/// What functions of frames share.
const OF_FRAMES: Spec = Spec {
    inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
    form: Form::Plain,
    ..Spec::DERIVED
};

/// The blocks of a function of frames, whose first says which six rows they have.
const fn frame_outputs(dv_dq: &'static str) -> [Output; 5] {
    [
        Output::new("dv_dq", PER_FRAME, dv_dq).slope("v", Quantity::Configuration),
        Output::new("da_dq", PER_FRAME, "per frame: the same of ∂a/∂q at constant q̇ and q̈ \\[1/s²; m/s²\\]")
            .slope("a", Quantity::Configuration),
        Output::new("da_dqd", PER_FRAME, "per frame: the same of ∂a/∂q̇ = ∂v/∂q + J̇ \\[1/s; m/s\\]")
            .slope("a", Quantity::Velocity),
        Output::new("j", PER_FRAME, "per frame: the same of J = ∂v/∂q̇ = ∂a/∂q̈ \\[1; m\\]")
            .slope("v", Quantity::Velocity),
        Output::new("j_dot", PER_FRAME, "per frame: the same of J̇ along the motion \\[1/s; m/s\\]"),
    ]
}

pub struct FrameDerivatives;

impl RobotFunction for FrameDerivatives {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "frame_derivatives",
        summary: "Derivatives of the velocities and accelerations of the frames, with their Jacobians J and J̇.",
        aliases: &["getFrameAccelerationDerivatives", "computeJointJacobiansTimeVariation", "Jdot"],
        outputs: &frame_outputs(
            "per frame: 6 rows (3 linear of the origin, which moves along, 3 angular; world axes) of ∂v/∂q \\[1/s; of the origin by a turn m/s\\]; \
of a floating base by increments of its pose in its own axes",
        ),
        ..OF_FRAMES
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        of_frames(forms, |frame| match forms.closed(motion(inputs)) {
            Some(closed) => closed.of_frame::<NumbersAtOrigin>(frame),
            None => alg::frame_derivatives(forms.model, motion(inputs), frame),
        })
    }
}

pub struct FrameDerivativesInOwnAxes;

impl RobotFunction for FrameDerivativesInOwnAxes {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "frame_derivatives_in_own_axes",
        summary: "Derivatives of the twists of the frames along their own axes and of the rates of these numbers, with J and J̇.",
        aliases: &["LOCAL", "body twist", "body Jacobian", "getFrameAccelerationDerivatives", "Jdot"],
        outputs: &frame_outputs(
            "per frame: 6 rows (3 linear of the origin, 3 angular; the frame's own axes, which move along) of ∂v/∂q \\[1/s; of the origin by a turn m/s\\]; \
of a floating base by increments of its pose in its own axes",
        ),
        ..OF_FRAMES
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        of_frames(forms, |frame| match forms.closed(motion(inputs)) {
            Some(closed) => closed.of_frame::<NumbersInOwnAxes>(frame),
            None => alg::frame_derivatives_in_own_axes(forms.model, motion(inputs), frame),
        })
    }
}

pub struct FrameDerivativesAtWorldOrigin;

impl RobotFunction for FrameDerivativesAtWorldOrigin {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "frame_derivatives_at_world_origin",
        summary: "Derivatives of the twists of the frames at the world's origin and of the rates of these numbers, with J and J̇.",
        aliases: &["WORLD", "spatial twist", "spatial Jacobian", "getFrameAccelerationDerivatives", "Jdot"],
        outputs: &frame_outputs(
            "per frame: 6 rows (3 linear of what moves with it through the world's origin, 3 angular; world axes) of ∂v/∂q \\[1/s; of points by a turn m/s\\]; \
of a floating base by increments of its pose in its own axes",
        ),
        ..OF_FRAMES
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        of_frames(forms, |frame| match forms.closed(motion(inputs)) {
            Some(closed) => closed.of_frame::<NumbersAtWorldOrigin>(frame),
            None => alg::frame_derivatives_at_world_origin(forms.model, motion(inputs), frame),
        })
    }
}

fn motion<T>(inputs: &[Vec<T>]) -> [&[T]; 3] {
    [&inputs[0], &inputs[1], &inputs[2]]
}

/// Blocks of all frames, one block after the other.
fn of_frames<T: Real>(
    forms: &Forms<'_, T>,
    derivatives: impl Fn(&Frame<T>) -> alg::FrameDerivativeBlocks<T>,
) -> Vec<T> {
    let all: Vec<_> = forms.frames.iter().map(|frame| derivatives(frame)).collect();
    let block =
        |of: fn(&alg::FrameDerivativeBlocks<T>) -> &Vec<T>| all.iter().flat_map(of).copied().collect::<Vec<T>>();
    [
        block(|of| &of.dv_dq),
        block(|of| &of.da_dq),
        block(|of| &of.da_dqd),
        block(|of| &of.jacobian),
        block(|of| &of.jacobian_rate),
    ]
    .concat()
}

pub struct CentreOfMassJacobian;

impl RobotFunction for CentreOfMassJacobian {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "centre_of_mass_jacobian",
        summary: "The Jacobian of the centre of mass of the moving bodies.",
        aliases: &["COM Jacobian", "jacobianCenterOfMass", "center of mass"],
        inputs: &[Quantity::Configuration],
        outputs: &[Output::new(
            "j",
            &[Of(3), Velocities],
            "rows of J, world axes \\[m/rad, m/m\\]: J q̇ is the velocity of the centre of mass",
        )],
        form: Form::Plain,
        divisor: Divisor::Mass,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::centre_of_mass_jacobian(forms.model, &inputs[0])
    }
}

pub struct SubtreeCentresOfMass;

impl RobotFunction for SubtreeCentresOfMass {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "subtree_centres_of_mass",
        summary: "What each joint carries, its link included: masses, centres of mass and their Jacobians.",
        aliases: &["subtree COM", "jacobianSubtreeCenterOfMass", "center of mass", "subtree_com"],
        inputs: &[Quantity::Configuration],
        outputs: &[
            Output::new("mass", &[Joints], "per joint: mass \\[kg\\]"),
            Output::new("p", &[Joints, Of(3)], "per joint: position of the centre of mass in the world \\[m\\]"),
            Output::new(
                "j",
                &[Joints, Of(3), Velocities],
                "per joint: rows of J, world axes \\[m/rad, m/m\\]: J q̇ is the velocity of that centre",
            ),
        ],
        form: Form::Plain,
        divisor: Divisor::MassOfEach,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let all = alg::subtrees(forms.model, &inputs[0]);
        let mut results: Vec<T> = all.iter().map(|subtree| subtree.mass).collect();
        results.extend(all.iter().flat_map(|subtree| subtree.centre.to_array()));
        results.extend(all.into_iter().flat_map(|subtree| subtree.jacobian));
        results
    }
}

pub struct CentroidalMap;

impl RobotFunction for CentroidalMap {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "centroidal_map",
        summary: "The centroidal momentum map A(q): h = A q̇ is the momentum about the centre of mass.",
        aliases: &["centroidal momentum matrix", "CMM", "computeCentroidalMap", "ccrba"],
        inputs: &[Quantity::Configuration],
        outputs: &[MAP],
        form: Form::Plain,
        divisor: Divisor::Mass,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::centroidal_map(forms.model, &inputs[0])
    }
}

pub struct CentroidalMapRate;

impl RobotFunction for CentroidalMapRate {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "centroidal_map_rate",
        summary: "The centroidal momentum map A(q) and its rate Ȧ(q, q̇): ḣ = A q̈ + Ȧ q̇.",
        aliases: &["centroidal momentum matrix", "computeCentroidalMapTimeVariation", "dccrba"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[MAP, Output::new("a_dot", SIX_ROWS, "rows of Ȧ, as those of A \\[kg/s, kg·m/s, kg·m²/s\\]")],
        form: Form::Plain,
        divisor: Divisor::Mass,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        if let Some(closed) = forms.closed([&inputs[0], &inputs[1], &forms.rest()]) {
            return [alg::centroidal_map(forms.model, &inputs[0]), closed.centroidal_map_rate()].concat();
        }
        let all = alg::centroidal_derivatives(forms.model, &inputs[0], &inputs[1]);
        [all.map, all.rate].concat()
    }
}

pub struct CentroidalDerivatives;

impl RobotFunction for CentroidalDerivatives {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "centroidal_derivatives",
        summary: "Centroidal momentum h and its rate ḣ with their derivatives by q, q̇ and q̈.",
        aliases: &["computeCentroidalDynamicsDerivatives", "centroidal dynamics"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[
            Output::new("h", &[Of(6)], "linear \\[kg·m/s\\] (3), angular about the centre of mass \\[kg·m²/s\\] (3), world axes"),
            Output::new("h_dot", &[Of(6)], "its rate, without gravity: linear \\[N\\] (3), angular \\[N·m\\] (3)"),
            Output::new(
                "dh_dq",
                SIX_ROWS,
                "rows of ∂h/∂q, the centre of mass moving along; of a floating base by increments of its pose in its own axes",
            )
            .slope("h", Quantity::Configuration),
            Output::new("dhdot_dq", SIX_ROWS, "rows of ∂ḣ/∂q at constant q̇ and q̈")
                .slope("ḣ", Quantity::Configuration),
            Output::new("dhdot_dqd", SIX_ROWS, "rows of ∂ḣ/∂q̇ = ∂h/∂q + Ȧ")
                .slope("ḣ", Quantity::Velocity),
            MAP,
        ],
        form: Form::Plain,
        divisor: Divisor::Mass,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let all = match forms.closed(motion(inputs)) {
            Some(closed) => closed.centroidal(),
            None => alg::centroidal_dynamics_derivatives(forms.model, motion(inputs)),
        };
        [all.momentum, all.momentum_rate, all.dh_dq, all.dhdot_dq, all.dhdot_dqd, all.map].concat()
    }
}
