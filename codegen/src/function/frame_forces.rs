//! What forces on frames do to the joints, and how that changes with q.

use super::derivatives::SQUARE;
use super::spec::Extent::Velocities;
use super::spec::{Form, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::algorithms::{self as alg, ForceOnFrame};
use straightline_core::spatial::Vec3;
use straightline_core::Real;

pub struct JacobianHessianProduct;

impl RobotFunction for JacobianHessianProduct {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "jacobian_hessian_product",
        summary: "Generalized forces Jᵀ f of forces on the frames, and their derivative by q at held f.",
        aliases: &["kinematic Hessian", "geometric stiffness", "getJointKinematicHessian", "derivative of contact forces"],
        inputs: &[Quantity::Configuration, Quantity::Wrench],
        outputs: &[
            Output::new("jt_f", &[Velocities], "Jᵀ f, all frames together \\[N·m or N\\]"),
            Output::new(
                "djtf_dq",
                SQUARE,
                "rows of ∂(Jᵀ f)/∂q \\[N·m/rad, N/m\\], symmetric without moments; of a floating base by increments of its pose in its own axes, and not \
symmetric there",
            ),
        ],
        form: Form::Plain,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let vector = |f: &[T]| Vec3::new(f[0], f[1], f[2]);
        let loaded = forms.frames.iter().zip(inputs[1].chunks(6));
        let forces: Vec<ForceOnFrame<'_, T>> =
            loaded.map(|(frame, f)| ForceOnFrame { frame, force: vector(f), moment: vector(&f[3..]) }).collect();
        let [jt_f, slopes] = alg::jacobian_hessian_product(forms.model, &inputs[0], &forces);
        let rest = forms.rest();
        let of_loops = forms.closed([&inputs[0], &rest, &rest]).map(|closed| closed.of_frame_forces(&forces));
        [jt_f, of_loops.unwrap_or(slopes)].concat()
    }
}
