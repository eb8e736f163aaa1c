//! What inverse dynamics is at rest and without accelerations, with its derivatives, and the Coriolis matrix.

use super::derivatives::{along, SQUARE};
use super::spec::Extent::Velocities;
use super::spec::{Form, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::reduced::{ReducedJoint, ReducedModel};
use straightline_core::{Dual, Real};

pub struct GravityDerivative;

impl RobotFunction for GravityDerivative {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "gravity_derivative",
        summary: "Gravity forces g(q) with their derivative ∂g/∂q: the stiffness that gravity gives the joints.",
        aliases: &["computeGeneralizedGravityDerivatives", "gravity Hessian", "gravitational stiffness"],
        inputs: &[Quantity::Configuration],
        outputs: &[
            Output::new(
                "dg_dq",
                SQUARE,
                "rows of ∂g/∂q \\[N·m/rad, N/m\\], symmetric; of a floating base by increments of its pose in its own axes, and not symmetric there",
            )
            .symmetric()
            .slope("g", Quantity::Configuration),
            Output::new("g", &[Velocities], "generalized forces \\[N·m or N\\]"),
        ],
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (q, model, rest) = (&inputs[0], forms.model, forms.rest());
        let nv = rest.len();
        let Some(torques) = forms.with_columns() else {
            let wide = model.map(Dual::<T, 1>::fixed);
            let columns: Vec<_> = (0..nv).map(|k| alg::gravity_force(&wide, &along(model, q, k))).collect();
            let entry = |k: usize| columns[k % nv][k / nv].derivatives[0];
            return [(0..nv * nv).map(entry).collect(), alg::gravity_force(model, q)].concat();
        };
        let mut all = forms.rigid_derivatives(torques, [q, &rest, &rest]);
        // the Hessian of potential energy
        if rates_are_of_coordinates(torques) {
            for (i, j) in (0..nv).flat_map(|i| (0..i).map(move |j| (i, j))) {
                all.dtau_dq[j * nv + i] = all.dtau_dq[i * nv + j];
            }
        }
        [all.dtau_dq, all.tau].concat()
    }
}

pub struct BiasDerivatives;

impl RobotFunction for BiasDerivatives {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "bias_derivatives",
        summary: "Bias forces h(q, q̇) with their derivatives ∂h/∂q and ∂h/∂q̇.",
        aliases: &["derivatives of nonlinear effects"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[
            Output::new(
                "dh_dq",
                SQUARE,
                "rows of ∂h/∂q \\[N·m/rad, N/m\\]; of a floating base by increments of its pose in its own axes",
            )
            .slope_with_friction("h", Quantity::Configuration),
            Output::new("dh_dqd", SQUARE, "rows of ∂h/∂q̇ \\[N·m·s/rad, N·s/m\\]")
                .slope_with_friction("h", Quantity::Velocity),
            Output::new("h", &[Velocities], "generalized forces \\[N·m or N\\]"),
        ],
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let all = forms.inverse_dynamics_derivatives([&inputs[0], &inputs[1], &forms.rest()]);
        [all.dtau_dq, all.dtau_dqd, all.tau].concat()
    }
}

pub struct CoriolisMatrix;

impl RobotFunction for CoriolisMatrix {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "coriolis_matrix",
        summary: "The Coriolis matrix C(q, q̇) with Ḣ = C + Cᵀ, of Christoffel's symbols, and Ḣ.",
        aliases: &["computeCoriolisMatrix", "Christoffel symbols", "rate of the mass matrix"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[
            Output::new("c", SQUARE, "rows of C \\[N·m·s/rad, N·s/m\\]: C q̇ are velocity forces, Ḣ − 2 C is skew"),
            Output::new("h_dot", SQUARE, "rows of Ḣ = dH/dt along q̇, both triangles \\[kg·m²/s, kg·m/s, kg/s\\]")
                .symmetric(),
        ],
        ..Spec::DERIVED
    };

    /// Where velocities are rates of coordinates C = ½ ∂h/∂q̇, which is linear in q̇: ∂h/∂q̇ at half of it.
    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (q, qd) = (&inputs[0], &inputs[1]);
        let (nv, rest) = (qd.len(), forms.rest());
        let of_loops = forms.closed([q, qd, &rest]).map(|closed| closed.coriolis_matrix());
        let c = of_loops.unwrap_or_else(|| match forms.with_columns().filter(|form| rates_are_of_coordinates(form)) {
            Some(torques) => {
                let half: Vec<T> = qd.iter().map(|rate| *rate * T::constant(straightline_core::Dd::HALF)).collect();
                forms.rigid_derivatives(torques, [q, &half, &rest]).dtau_dqd
            }
            None => alg::coriolis_matrix(forms.model, q, qd),
        });
        // one triangle, so that both are the same to the bit
        let rate = |i: usize, j: usize| c[i * nv + j] + c[j * nv + i];
        let h_dot = (0..nv * nv).map(|k| rate((k / nv).max(k % nv), (k / nv).min(k % nv))).collect();
        [c.clone(), h_dot].concat()
    }
}

pub struct CoriolisTransposeForce;

impl RobotFunction for CoriolisTransposeForce {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "coriolis_transpose_force",
        summary: "Cᵀ(q, q̇) q̇ = Ḣ q̇ − C q̇: what an observer of generalized momentum integrates.",
        aliases: &["momentum observer", "collision detection", "disturbance observer"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new("f", &[Velocities], "generalized forces \\[N·m or N\\]")],
        form: Form::Plain,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        match forms.closed([&inputs[0], &inputs[1], &forms.rest()]) {
            Some(closed) => closed.coriolis_transpose_force(),
            None => alg::coriolis_transpose_force(forms.model, &inputs[0], &inputs[1]),
        }
    }
}

/// Whether velocities are the rates of coordinates, as without a floating base.
fn rates_are_of_coordinates<T>(form: &ReducedModel<T>) -> bool {
    form.bodies.iter().all(|body| body.kind != ReducedJoint::Free)
}
