//! Derivatives of forward dynamics. q̈ obeys H q̈ + h = τ, so that its derivatives are those of inverse dynamics at q̈, solved for:
//! ∂q̈/∂x = −H⁻¹ ∂τ/∂x, and none of them goes through the solution. Of a free base all is computed in free fall ([`FallingBase`]), where nine columns need
//! no solution.

use super::derivatives::{moving, weighed_slopes, with_rates, SQUARE};
use super::dynamics::ForwardDynamics;
use super::solution::{by_rows, Solution};
use super::spec::Extent::Velocities;
use super::spec::{Divisor, Form, Judged, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::algorithms::FallingBase;
use straightline_core::{Dual, Real};

const BY_POSITION: Output = Output::new(
    "dqdd_dq",
    SQUARE,
    "rows of ∂q̈/∂q at constant τ \\[1/s²; with sliding joints also 1/(m·s²), m/s²\\]; of a floating base by increments of its pose in its own axes",
)
.slope_with_friction("q̈", Quantity::Configuration);
const BY_VELOCITY: Output =
    Output::new("dqdd_dqd", SQUARE, "rows of ∂q̈/∂q̇ at constant τ \\[1/s; with sliding joints also 1/(m·s), m/s\\]")
        .slope_with_friction("q̈", Quantity::Velocity);
const INVERSE: Output =
    Output::new("h_inverse", SQUARE, "rows of H⁻¹ = ∂q̈/∂τ, both triangles \\[1/(kg·m²), 1/(kg·m), 1/kg\\]")
        .symmetric()
        .slope_with_friction("q̈", Quantity::Force);

/// What all of them have in common.
const SOLVED: Spec = Spec { solves: true, divisor: Divisor::Inertia, judged: Judged::ByColumns, ..Spec::DERIVED };

pub struct ForwardDynamicsDerivatives;

impl RobotFunction for ForwardDynamicsDerivatives {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "forward_dynamics_derivatives",
        summary: "Forward dynamics q̈ with its derivatives ∂q̈/∂q, ∂q̈/∂q̇ and H⁻¹ = ∂q̈/∂τ.",
        aliases: &["ABA derivatives", "computeABADerivatives", "linearised forward dynamics", "computeMinverse"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Force],
        outputs: &[
            Output::new("qdd", &[Velocities], "accelerations \\[rad/s² or m/s²\\]"),
            BY_POSITION,
            BY_VELOCITY,
            INVERSE,
        ],
        ..SOLVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let of = |forms: &Forms<'_, T>, inputs: &[Vec<T>], base: Option<&FallingBase<T>>| {
            let (solution, qdd) = Solution::with_acceleration(forms, inputs);
            let derivatives = solution.derivatives([&inputs[0], &inputs[1], &qdd], base);
            let qdd = base.map_or(qdd.clone(), |base| base.in_world(&qdd));
            [qdd, derivatives].concat()
        };
        let Some(base) = FallingBase::of(forms.model, &inputs[0], &inputs[1]) else { return of(forms, inputs, None) };
        let inputs = [inputs[0].clone(), base.at_rest(&inputs[1]), base.damped(&inputs[2])];
        forms.weightless(|forms| of(forms, &inputs, Some(&base)))
    }

    fn residual<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>], found: &[T]) -> Vec<T> {
        let (qdd, derivatives) = found.split_at(inputs[1].len());
        let off = ForwardDynamics::residual(forms, inputs, qdd);
        [off, left_by_columns(forms, [&inputs[0], &inputs[1], qdd], derivatives)].concat()
    }
}

pub struct ForwardDynamicsDerivativesAtMotion;

impl RobotFunction for ForwardDynamicsDerivativesAtMotion {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "forward_dynamics_derivatives_at_motion",
        summary: "Derivatives ∂q̈/∂q, ∂q̈/∂q̇ and H⁻¹ = ∂q̈/∂τ of forward dynamics where q̈ is known.",
        aliases: &["derivatives from accelerations"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[BY_POSITION, BY_VELOCITY, INVERSE],
        ..SOLVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (q, qd, qdd) = (&inputs[0], &inputs[1], &inputs[2]);
        match FallingBase::of(forms.model, q, qd) {
            None => Solution::new(forms, q).derivatives([q, qd, qdd], None),
            Some(base) => forms.weightless(|forms| {
                Solution::new(forms, q).derivatives([q, &base.at_rest(qd), &base.falling(qdd)], Some(&base))
            }),
        }
    }

    fn residual<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>], found: &[T]) -> Vec<T> {
        left_by_columns(forms, [&inputs[0], &inputs[1], &inputs[2]], found)
    }
}

pub struct ForwardDynamicsJvp;

impl RobotFunction for ForwardDynamicsJvp {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "forward_dynamics_jvp",
        summary: "The derivative of forward dynamics along a direction: ∂q̈/∂q u + ∂q̈/∂q̇ w + H⁻¹ t.",
        aliases: &["JVP", "directional derivative", "tangent"],
        inputs: &[
            Quantity::Configuration,
            Quantity::Velocity,
            Quantity::Force,
            Quantity::ConfigurationDirection,
            Quantity::VelocityDirection,
            Quantity::ForceDirection,
        ],
        outputs: &[Output::new("jvp", &[Velocities], "how fast accelerations change \\[rad/s² or m/s²\\]")],
        form: Form::Motion,
        ..SOLVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (solution, qdd) = Solution::with_acceleration(forms, inputs);
        solution.acceleration_rate(inputs, &qdd)
    }

    fn residual<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>], found: &[T]) -> Vec<T> {
        let (_, qdd) = Solution::with_acceleration(forms, inputs);
        let takes = torque_rate(forms, inputs, &with_rates(&qdd, found));
        takes.into_iter().zip(&inputs[5]).map(|(takes, rate)| takes - *rate).collect()
    }
}

pub struct ForwardDynamicsVjp;

impl RobotFunction for ForwardDynamicsVjp {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "forward_dynamics_vjp",
        summary: "Multipliers times the derivatives of forward dynamics: (∂q̈/∂q)ᵀ λ, (∂q̈/∂q̇)ᵀ λ and H⁻¹ λ.",
        aliases: &["VJP", "adjoint", "gradient of accelerations", "backpropagation"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Force, Quantity::Multiplier],
        outputs: &[
            Output::new(
                "vjp_q",
                &[Velocities],
                "(∂q̈/∂q)ᵀ λ; of a floating base by increments of its pose in its own axes",
            ),
            Output::new("vjp_qd", &[Velocities], "(∂q̈/∂q̇)ᵀ λ"),
            Output::new("vjp_tau", &[Velocities], "H⁻¹ λ"),
        ],
        form: Form::Motion,
        judged: Judged::ByDerivatives,
        ..SOLVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (solution, qdd) = Solution::with_acceleration(forms, inputs);
        let by_force = solution.of(&inputs[3]);
        let slopes = weighed_slopes(forms, [&inputs[0], &inputs[1], &qdd], &by_force);
        let others = slopes.into_iter().take(2 * by_force.len()).map(|slope| -slope).collect();
        [others, by_force].concat()
    }
}

pub struct ForwardDynamicsHvp;

impl RobotFunction for ForwardDynamicsHvp {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "forward_dynamics_hvp",
        summary: "How multipliers times the derivatives of forward dynamics change along a direction: the Hessian of λ·q̈ times it.",
        aliases: &["HVP", "Hessian-vector product", "second-order derivatives"],
        inputs: &[
            Quantity::Configuration,
            Quantity::Velocity,
            Quantity::Force,
            Quantity::ConfigurationDirection,
            Quantity::VelocityDirection,
            Quantity::ForceDirection,
            Quantity::Multiplier,
        ],
        outputs: &[
            Output::new(
                "hvp_q",
                &[Velocities],
                "of (∂q̈/∂q)ᵀ λ; of a floating base of its components along body-fixed directions, which turn with it",
            ),
            Output::new("hvp_qd", &[Velocities], "of (∂q̈/∂q̇)ᵀ λ"),
            Output::new("hvp_tau", &[Velocities], "of H⁻¹ λ"),
        ],
        form: Form::Motion,
        judged: Judged::ByDerivatives,
        ..SOLVED
    };

    /// (∂q̈/∂q)ᵀ λ = −Kᵀ μ, (∂q̈/∂q̇)ᵀ λ = −Dᵀ μ and μ = H⁻¹ λ, where q̈ and μ move with the rest: H μ = λ stays.
    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (solution, qdd) = Solution::with_acceleration(forms, inputs);
        let moving = {
            let rates = solution.acceleration_rate(inputs, &qdd);
            let [q, qd, _] = moving(forms.model, inputs);
            [q, qd, with_rates(&qdd, &rates)]
        };
        let (nv, by_force) = (qdd.len(), solution.of(&inputs[6]));
        let slopes = |rate: &[T]| -> Vec<T> {
            let multiplier = with_rates(&by_force, rate);
            let motion = moving.each_ref().map(|x| &x[..]);
            let slopes = forms.over(Dual::fixed, |forms| weighed_slopes(forms, motion, &multiplier));
            slopes.into_iter().map(|slope| -slope.derivatives[0]).collect()
        };
        let rate = solution.of(&slopes(&forms.rest())[2 * nv..]);
        let others = slopes(&rate).into_iter().take(2 * nv).collect();
        [others, rate].concat()
    }
}

/// How torques change along the direction behind q, q̇ and τ in the inputs, if accelerations change like this.
fn torque_rate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>], qdd: &[Dual<T, 1>]) -> Vec<T> {
    let [q, qd, _] = moving(forms.model, inputs);
    forms.over(Dual::fixed, |forms| {
        let forces = forms.inverse_dynamics(&q, &qd, qdd);
        forces.into_iter().map(|force| force.derivatives[0]).collect()
    })
}

/// What H X + ∂τ/∂q, H Y + ∂τ/∂q̇ and H Z − 1 leave.
fn left_by_columns<T: Real>(forms: &Forms<'_, T>, motion: [&[T]; 3], found: &[T]) -> Vec<T> {
    let nv = motion[1].len();
    let at = forms.inverse_dynamics_derivatives(motion);
    let unit: Vec<T> = (0..nv * nv).map(|k| if k % (nv + 1) == 0 { -T::one() } else { T::zero() }).collect();
    let of = |(found, right): (&[T], Vec<T>)| {
        let entry = |k: usize| {
            let (i, j) = (k / nv, k % nv);
            (0..nv).fold(right[k], |sum, l| sum + at.mass_matrix[i * nv + l] * found[l * nv + j])
        };
        (0..nv * nv).map(entry).collect::<Vec<T>>()
    };
    found.chunks(nv * nv).zip([at.dtau_dq, at.dtau_dqd, unit]).flat_map(of).collect()
}

impl<T: Real> Solution<'_, '_, T> {
    /// How it changes along the direction behind these inputs.
    fn acceleration_rate(&self, inputs: &[Vec<T>], qdd: &[T]) -> Vec<T> {
        let held: Vec<Dual<T, 1>> = qdd.iter().map(|x| Dual::fixed(*x)).collect();
        let takes = torque_rate(self.forms, inputs, &held);
        let left: Vec<T> = inputs[5].iter().zip(takes).map(|(rate, takes)| *rate - takes).collect();
        self.of(&left)
    }

    /// ∂q̈/∂q, ∂q̈/∂q̇ and H⁻¹ of a motion, by rows; of a free base the motion is that in free fall.
    pub(super) fn derivatives(&self, motion: [&[T]; 3], base: Option<&FallingBase<T>>) -> Vec<T> {
        let nv = motion[1].len();
        let mut of_torques = self.forms.inverse_dynamics_derivatives(motion);
        if let Some(base) = base {
            base.leave_out(&mut of_torques);
        }
        let column = |slopes: &[T], k: usize| (0..nv).map(|i| -slopes[i * nv + k]).collect::<Vec<T>>();
        let columns = [&of_torques.dtau_dq, &of_torques.dtau_dqd].map(|slopes| (0..nv).map(|k| column(slopes, k)));
        let solved = self.of_coordinates(&columns.into_iter().flatten().collect::<Vec<_>>());
        let (by_position, by_velocity) = solved.split_at(nv);
        let (mut by_position, mut by_velocity) = (by_rows(by_position), by_rows(by_velocity));
        if let Some(base) = base {
            base.complete(&mut by_position, &mut by_velocity);
        }
        [by_position, by_velocity, self.inverse()].concat()
    }
}
