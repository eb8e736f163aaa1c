//! Displacements of a configuration along its tangent, and how tangents are carried along: what optimisers need to move q, whose quaternion of a
//! floating base is no vector. Nothing of the robot but its joints goes in.

use super::derivatives::SQUARE;
use super::spec::Extent::{Positions, Velocities};
use super::spec::{Output, RobotFunction, Spec};
use super::{Form, Forms, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::Real;

/// What all of them have in common: they are of joints alone.
const OF_JOINTS: Spec = Spec { form: Form::Plain, substituted_up_to: 0, ..Spec::DERIVED };

const DISPLACED: &[Quantity] = &[Quantity::Configuration, Quantity::Displacement];
const APART: &[Quantity] = &[Quantity::Configuration, Quantity::SecondConfiguration];

pub struct Integrate;

impl RobotFunction for Integrate {
    const SPEC: Spec = Spec {
        name: "integrate",
        summary: "Where a displacement leads: q ⊕ v. Joints add; a floating base moves by the exponential of a body twist, through any angle.",
        aliases: &["retraction", "exponential map", "oplus", "manifold integration", "SE(3) exp"],
        inputs: DISPLACED,
        outputs: &[Output::new(
            "q_plus_v",
            &[Positions],
            "q ⊕ v \\[rad or m\\]; the quaternion of a floating base of length one, whatever that of q",
        )],
        ..OF_JOINTS
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::integrate(forms.model, &inputs[0], &inputs[1])
    }
}

pub struct Difference;

impl RobotFunction for Difference {
    const SPEC: Spec = Spec {
        name: "difference",
        summary: "The displacement between configurations: v with q ⊕ v = q₁, of a floating base through at most half a turn.",
        aliases: &["logarithm", "ominus", "configuration error", "SE(3) log"],
        inputs: APART,
        outputs: &[Output::new("v", &[Velocities], "displacement, of the tangent at q \\[rad or m\\]")],
        ..OF_JOINTS
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::difference(forms.model, &inputs[0], &inputs[1])
    }
}

pub struct IntegrateDerivatives;

impl RobotFunction for IntegrateDerivatives {
    const SPEC: Spec = Spec {
        name: "integrate_derivatives",
        summary: "How q ⊕ v moves, in its own tangent, with q and with v.",
        aliases: &["dIntegrate", "right Jacobian", "derivative of the exponential map"],
        inputs: DISPLACED,
        outputs: &[
            Output::new(
                "dintegrate_dq",
                SQUARE,
                "rows of ∂(q ⊕ v)/∂q: of a floating base Ad(exp(−v)), from increments of its pose in its own axes to such; else 1",
            ),
            Output::new("dintegrate_dv", SQUARE, "rows of ∂(q ⊕ v)/∂v: of a floating base the right Jacobian of SE(3); else 1"),
        ],
        ..OF_JOINTS
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let maps = alg::integrate_maps(forms.model, &inputs[1]);
        maps.iter().flat_map(|map| map.matrix(inputs[1].len())).collect()
    }
}

pub struct DifferenceDerivatives;

impl RobotFunction for DifferenceDerivatives {
    const SPEC: Spec = Spec {
        name: "difference_derivatives",
        summary: "How the displacement v with q ⊕ v = q₁ moves with q and with q₁.",
        aliases: &["dDifference", "inverse right Jacobian", "derivative of the logarithm"],
        inputs: APART,
        outputs: &[
            Output::new(
                "ddifference_dq0",
                SQUARE,
                "rows of ∂v/∂q; of a floating base by increments of its pose in its own axes; of joints −1",
            ),
            Output::new("ddifference_dq1", SQUARE, "rows of ∂v/∂q₁, by increments of the tangent there; of joints 1"),
        ],
        ..OF_JOINTS
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let v = alg::difference(forms.model, &inputs[0], &inputs[1]);
        alg::difference_maps(forms.model, &v).iter().flat_map(|map| map.matrix(v.len())).collect()
    }
}

pub struct IntegrateTransport;

impl RobotFunction for IntegrateTransport {
    const SPEC: Spec = Spec {
        name: "integrate_transport",
        summary: "A tangent carried along a displacement: how q ⊕ v moves, in its own tangent, where q or v moves in this direction.",
        aliases: &["dIntegrateTransport", "parallel transport"],
        inputs: &[Quantity::Configuration, Quantity::Displacement, Quantity::ConfigurationDirection],
        outputs: &[
            Output::new("transport_q", &[Velocities], "∂(q ⊕ v)/∂q times the direction \\[rad or m\\]"),
            Output::new("transport_v", &[Velocities], "∂(q ⊕ v)/∂v times the direction \\[rad or m\\]"),
        ],
        ..OF_JOINTS
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::integrate_maps(forms.model, &inputs[1]).iter().flat_map(|map| map.times(&inputs[2], 1)).collect()
    }
}
