//! Derivatives of the motion that the inputs of drives make.
//!
//! q̈ obeys H q̈ + h = τ(q, q̇, x, u, q̈), the forces of the drives. Along a direction H dq̈ + (dH q̈ + dh) = dτ: the equations of the drives in
//! dual numbers, with H as it is and a bias force that moves by ∂(H q̈ + h)/∂q or ∂(H q̈ + h)/∂q̇ at the q̈ that was found. So the links enter by
//! the structured derivatives of inverse dynamics, and no factor of H is differentiated.

use super::derivatives::{along, with_rates, SQUARE};
use super::drives::with_links;
use super::solution::by_rows;
use super::spec::Extent::{DriveStates, Drives, Velocities};
use super::spec::{Divisor, Family, Form, Output, RobotFunction, Spec};
use super::{Extent, Forms, Quantity};
use straightline_core::algorithms::{self as alg, DrivenMotion, Links};
use straightline_core::{Dual, Real};

const RATES: &[Extent] = &[DriveStates, Velocities];

pub struct DrivenForwardDynamicsDerivatives;

impl RobotFunction for DrivenForwardDynamicsDerivatives {
    const SPEC: Spec = Spec {
        name: "driven_forward_dynamics_derivatives",
        summary: "The motion that the inputs of the drives make, and the rates of the drives' states, with their derivatives by q, q̇, x and u.",
        aliases: &["linearised drives", "linearisation by voltages", "actuator dynamics derivatives"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::DriveState, Quantity::DriveInput],
        outputs: &[
            Output::new("qdd", &[Velocities], "accelerations \\[rad/s² or m/s²\\]"),
            Output::new("xd", &[DriveStates], "derivative of the drives' state, in the order of x"),
            Output::new(
                "dqdd_dq",
                SQUARE,
                "rows of ∂q̈/∂q \\[1/s²\\]; of a floating base by increments of its pose in its own axes",
            ),
            Output::new("dqdd_dqd", SQUARE, "rows of ∂q̈/∂q̇ \\[1/s\\]"),
            Output::new("dqdd_dx", &[Velocities, DriveStates], "rows of ∂q̈/∂x, one column per state"),
            Output::new("dqdd_du", &[Velocities, Drives], "rows of ∂q̈/∂u \\[rad/(s²·V), or as in the robot file\\]"),
            Output::new("dxd_dq", RATES, "rows of ∂ẋ/∂q"),
            Output::new("dxd_dqd", RATES, "rows of ∂ẋ/∂q̇"),
            Output::new("dxd_dx", &[DriveStates, DriveStates], "rows of ∂ẋ/∂x"),
            Output::new("dxd_du", &[DriveStates, Drives], "rows of ∂ẋ/∂u"),
        ],
        family: Family::DriveDerivatives,
        form: Form::Derivatives,
        solves: true,
        divisor: Divisor::InertiaWithDrives,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let [q, qd, x, u] = inputs else { panic!("the row says q, qd, x, u") };
        let motion = with_links(forms, inputs, |at, bias, links| alg::driven_motion(forms.model, at, bias, links));
        let of_links = forms.inverse_dynamics_derivatives([q, qd, &motion.qdd]);
        let (nv, bias, h) = (qd.len(), forms.bias_force(q, qd), forms.mass_matrix(q));
        // how q̈ and ẋ change where the state moves so, and with it the bias force
        let slopes = |at: [Vec<Dual<T, 1>>; 4], of_bias: Vec<T>| -> [Vec<T>; 2] {
            let bias = with_rates(&bias, &of_bias);
            let h: Vec<Dual<T, 1>> = h.iter().map(|x| Dual::fixed(*x)).collect();
            forms.over(Dual::fixed, |forms| {
                let [q, qd, x, u] = &at;
                let DrivenMotion { qdd, xd, .. } =
                    alg::driven_motion(forms.model, (q, qd, x, u), &bias, &Links::MassMatrix(&h));
                [qdd, xd].map(|x| x.into_iter().map(|x| x.derivatives[0]).collect())
            })
        };
        let held = || [q, qd, x, u].map(|x| x.iter().map(|x| Dual::fixed(*x)).collect::<Vec<_>>());
        // ∂q̈ and ∂ẋ by one of the inputs, by rows
        let block = |place: usize, of_links: Option<&[T]>| -> [Vec<T>; 2] {
            let n = if place == 0 { nv } else { inputs[place].len() };
            let column = |k: usize| {
                let mut at = held();
                match place {
                    0 => at[0] = along(forms.model, q, k),
                    _ => at[place][k] = Dual::variable(inputs[place][k], 0),
                }
                slopes(at, (0..nv).map(|i| of_links.map_or(T::zero(), |rows| rows[i * n + k])).collect())
            };
            let (of_qdd, of_xd): (Vec<_>, Vec<_>) = (0..n).map(|k| column(k).into()).unzip();
            [by_rows(&of_qdd), by_rows(&of_xd)]
        };
        let blocks =
            [block(0, Some(&of_links.dtau_dq)), block(1, Some(&of_links.dtau_dqd)), block(2, None), block(3, None)];
        let of = |k: usize| blocks.iter().flat_map(move |block| block[k].iter().copied());
        [motion.qdd.clone(), motion.xd.clone(), of(0).collect(), of(1).collect()].concat()
    }
}
