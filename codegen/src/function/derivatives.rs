//! Derivatives of inverse dynamics: matrices, and products with directions and multipliers.

use super::closed_derivatives::{add, ClosedSlopes};
use super::spec::Extent::Velocities;
use super::spec::{Form, InLanes, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::algorithms::{self as alg, DerivativeBlocks};
use straightline_core::model::Model;
use straightline_core::reduced::ReducedModel;
use straightline_core::reverse::{Recorded, Recording};
use straightline_core::spatial::Vec3;
use straightline_core::{Dual, Real};

pub(super) const SQUARE: &[super::Extent] = &[Velocities, Velocities];

pub struct InverseDynamicsDerivatives;

impl RobotFunction for InverseDynamicsDerivatives {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "inverse_dynamics_derivatives",
        summary: "Inverse dynamics τ with its derivatives ∂τ/∂q, ∂τ/∂q̇ and H = ∂τ/∂q̈.",
        aliases: &["RNEA derivatives", "computeRNEADerivatives", "linearised inverse dynamics"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[
            Output::new(
                "dtau_dq",
                SQUARE,
                "rows of ∂τ/∂q \\[N·m/rad, N/m\\]; of a floating base by increments of its pose in its own axes",
            )
            .slope_with_friction("τ", Quantity::Configuration),
            Output::new("dtau_dqd", SQUARE, "rows of ∂τ/∂q̇ \\[N·m·s/rad, N·s/m\\]")
                .slope_with_friction("τ", Quantity::Velocity),
            Output::new("h", SQUARE, "rows of H = ∂τ/∂q̈, both triangles \\[kg·m², kg·m, kg\\]")
                .symmetric()
                .slope_with_friction("τ", Quantity::Acceleration),
            Output::new("tau", &[Velocities], "generalized forces \\[N·m or N\\]"),
        ],
        in_lanes: InLanes::WhereFaster(2),
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let all = forms.inverse_dynamics_derivatives([&inputs[0], &inputs[1], &inputs[2]]);
        [all.dtau_dq, all.dtau_dqd, all.mass_matrix, all.tau].concat()
    }
}

pub struct InverseDynamicsJvp;

impl RobotFunction for InverseDynamicsJvp {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "inverse_dynamics_jvp",
        summary: "The derivative of inverse dynamics along a direction: ∂τ/∂q u + ∂τ/∂q̇ w + H a.",
        aliases: &["JVP", "directional derivative", "tangent"],
        inputs: &[
            Quantity::Configuration,
            Quantity::Velocity,
            Quantity::Acceleration,
            Quantity::ConfigurationDirection,
            Quantity::VelocityDirection,
            Quantity::AccelerationDirection,
        ],
        outputs: &[Output::new("jvp", &[Velocities], "how fast generalized forces change \\[N·m or N\\]")],
        form: Form::InverseDynamics,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let motion = moving(forms.model, inputs);
        forms.over(Dual::fixed, |forms| {
            let forces = forms.inverse_dynamics(&motion[0], &motion[1], &motion[2]);
            forces.into_iter().map(|force| force.derivatives[0]).collect()
        })
    }
}

pub struct InverseDynamicsVjp;

impl RobotFunction for InverseDynamicsVjp {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "inverse_dynamics_vjp",
        summary: "Multipliers times the derivatives of inverse dynamics: (∂τ/∂q)ᵀ λ, (∂τ/∂q̇)ᵀ λ and H λ.",
        aliases: &["VJP", "adjoint", "gradient of torques", "backpropagation"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration, Quantity::Multiplier],
        outputs: &[
            Output::new(
                "vjp_q",
                &[Velocities],
                "(∂τ/∂q)ᵀ λ; of a floating base by increments of its pose in its own axes",
            ),
            Output::new("vjp_qd", &[Velocities], "(∂τ/∂q̇)ᵀ λ"),
            Output::new("vjp_qdd", &[Velocities], "H λ"),
        ],
        form: Form::InverseDynamics,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        weighed_slopes(forms, [0, 1, 2].map(|k| &inputs[k][..]), &inputs[3])
    }
}

pub struct InverseDynamicsHvp;

impl RobotFunction for InverseDynamicsHvp {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "inverse_dynamics_hvp",
        summary: "How multipliers times the derivatives of inverse dynamics change along a direction: the Hessian of λ·τ times it.",
        aliases: &["HVP", "Hessian-vector product", "second-order derivatives"],
        inputs: &[
            Quantity::Configuration,
            Quantity::Velocity,
            Quantity::Acceleration,
            Quantity::ConfigurationDirection,
            Quantity::VelocityDirection,
            Quantity::AccelerationDirection,
            Quantity::Multiplier,
        ],
        outputs: &[
            Output::new(
                "hvp_q",
                &[Velocities],
                "of (∂τ/∂q)ᵀ λ; of a floating base of its components along body-fixed directions, which turn with it",
            ),
            Output::new("hvp_qd", &[Velocities], "of (∂τ/∂q̇)ᵀ λ"),
            Output::new("hvp_qdd", &[Velocities], "of H λ"),
        ],
        form: Form::InverseDynamics,
        ..Spec::DERIVED
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let motion = moving(forms.model, inputs);
        let multiplier: Vec<Dual<T, 1>> = inputs[6].iter().map(|x| Dual::fixed(*x)).collect();
        let motion = motion.each_ref().map(|x| &x[..]);
        let slopes = forms.over(Dual::fixed, |forms| weighed_slopes(forms, motion, &multiplier));
        slopes.into_iter().map(|slope| slope.derivatives[0]).collect()
    }
}

/// q, q̇ and what stands behind them in the inputs, as they move along the direction behind it.
pub(super) fn moving<T: Real>(model: &Model<T>, inputs: &[Vec<T>]) -> [Vec<Dual<T, 1>>; 3] {
    let rates = model.configuration_rate(&inputs[0], &inputs[3]);
    [with_rates(&inputs[0], &rates), with_rates(&inputs[1], &inputs[4]), with_rates(&inputs[2], &inputs[5])]
}

/// Coordinate `k` alone.
pub(super) fn unit<T: Real>(nv: usize, k: usize) -> Vec<T> {
    (0..nv).map(|i| if i == k { T::one() } else { T::zero() }).collect()
}

/// Numbers that move at these rates.
pub(crate) fn with_rates<T: Real>(x: &[T], rates: &[T]) -> Vec<Dual<T, 1>> {
    x.iter().zip(rates).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] }).collect()
}

/// (∂τ/∂q)ᵀ λ, (∂τ/∂q̇)ᵀ λ and H λ, backwards through the equations.
pub(super) fn weighed_slopes<T: Real>(forms: &Forms<'_, T>, motion: [&[T]; 3], multiplier: &[T]) -> Vec<T> {
    let recording = Recording::new();
    let [q, qd, qdd] = motion.map(|x| x.iter().map(|x| recording.variable(*x)).collect::<Vec<_>>());
    let forces = forms.over(Recorded::fixed, |forms| forms.inverse_dynamics(&q, &qd, &qdd));
    let weighed: Vec<_> = forces.into_iter().zip(multiplier.iter().copied()).collect();
    let slopes = recording.gradient(&weighed);
    let [by_q, by_qd, by_qdd] = [q, qd, qdd].map(|x| x.into_iter().map(|x| slopes.by(x)).collect::<Vec<T>>());
    [along_tangent(forms.model, motion[0], &by_q), by_qd, by_qdd].concat()
}

impl<T: Real> Forms<'_, T> {
    /// The same robot over another scalar, without frames and limbs in lanes.
    pub(super) fn over<U: Real, R>(&self, f: impl Fn(T) -> U + Copy, run: impl FnOnce(&Forms<'_, U>) -> R) -> R {
        let model = self.model.map(f);
        let reduced = self.reduced.map(|forms| forms.map(|form| form.map(f)));
        let reduced = reduced.as_ref().map(|[torques, composite]| [torques, composite]);
        let (rows, method) = (self.rows, self.method);
        run(&Forms { model: &model, reduced, frames: &[], rows, method, limbs: None, columns: None })
    }

    /// τ = H q̈ + h and its derivatives.
    pub fn inverse_dynamics_derivatives(&self, motion: [&[T]; 3]) -> DerivativeBlocks<T> {
        let Some(torques) = self.with_columns() else { return by_directions(self.model, motion) };
        let rigid = self.rigid_derivatives(torques, motion);
        let mut all = DerivativeBlocks {
            mass_matrix: self.with_rotors(motion[0], rigid.mass_matrix),
            tau: self.with_effects(rigid.tau, motion),
            ..rigid
        };
        let nv = self.model.nv();
        if !self.model.closure.is_empty() {
            let effects = ClosedSlopes::new(self.model, motion).effects();
            add(&mut all.dtau_dq, &effects.by_configuration);
            add(&mut all.dtau_dqd, &effects.by_velocity);
            return all;
        }
        let [by_q, by_qd] = passive_slopes(self.model, motion[0], motion[1]);
        for (i, (by_q, by_qd)) in by_q.into_iter().zip(by_qd).enumerate() {
            all.dtau_dq[i * nv + i] = all.dtau_dq[i * nv + i] + by_q;
            all.dtau_dqd[i * nv + i] = all.dtau_dqd[i * nv + i] + by_qd;
        }
        all
    }
}

impl<T: Real> Forms<'_, T> {
    /// Of the bodies by a reduced robot, which is a tree whose joints all have coordinates of their own.
    pub(super) fn rigid_derivatives(&self, torques: &ReducedModel<T>, motion: [&[T]; 3]) -> DerivativeBlocks<T> {
        let (model, [q, qd, qdd]) = (self.model, &self.model.tree_motion(motion));
        let of_tree: [&[T]; 3] = [q, qd, qdd];
        let all =
            self.with_limbs(|l| alg::reduced_inverse_dynamics_derivatives_with_limbs(torques, of_tree, l.subtree));
        if !model.closure.is_empty() {
            return ClosedSlopes::new(model, motion).of_forces(q, all);
        }
        DerivativeBlocks {
            tau: model.free_forces(q, all.tau),
            mass_matrix: model.free_symmetric(q, all.mass_matrix),
            dtau_dq: model.free_square(q, all.dtau_dq),
            dtau_dqd: model.free_square(q, all.dtau_dqd),
        }
    }

    /// ∂(H x)/∂q of an x that is held, by rows: what inverse dynamics does at rest, without gravity.
    pub(crate) fn inertial_slopes(&self, q: &[T], x: &[T]) -> Vec<T> {
        if let Some(torques) = self.with_columns() {
            let weightless = ReducedModel { gravity: Vec3::zero(), ..torques.clone() };
            return self.rigid_derivatives(&weightless, [q, &self.rest(), x]).dtau_dq;
        }
        let nv = self.model.nv();
        let wide = self.model.map(Dual::<T, 1>::fixed);
        let mut slopes = vec![T::zero(); nv * nv];
        for k in 0..nv {
            let h = alg::mass_matrix(&wide, &along(self.model, q, k));
            for (i, row) in h.chunks(nv).enumerate() {
                slopes[i * nv + k] = row.iter().zip(x).fold(T::zero(), |sum, (h, x)| sum + h.derivatives[0] * *x);
            }
        }
        slopes
    }
}

/// Of friction and springs of each joint, which know its own coordinate alone: by q, and by q̇.
fn passive_slopes<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> [Vec<T>; 2] {
    let wide = model.map(Dual::<T, 2>::fixed);
    let seeded = |x: &[T], k: usize| x.iter().map(|x| Dual::variable(*x, k)).collect::<Vec<_>>();
    let forces = alg::passive_force(&wide, &seeded(q, 0), &seeded(qd, 1));
    [0, 1].map(|k| forces.iter().map(|force| force.derivatives[k]).collect())
}

/// The derivatives of a robot as its file has it, one direction after the other in dual numbers.
fn by_directions<T: Real>(model: &Model<T>, [q, qd, qdd]: [&[T]; 3]) -> DerivativeBlocks<T> {
    let nv = model.nv();
    let wide = model.map(Dual::<T, 1>::fixed);
    let fixed = |x: &[T]| x.iter().map(|x| Dual::fixed(*x)).collect::<Vec<_>>();
    let column = |q: &[Dual<T, 1>], qd: &[Dual<T, 1>]| alg::inverse_dynamics(&wide, q, qd, &fixed(qdd));
    let (mut dtau_dq, mut dtau_dqd) = (vec![T::zero(); nv * nv], vec![T::zero(); nv * nv]);
    for k in 0..nv {
        let of_q = column(&along(model, q, k), &fixed(qd));
        let mut rates = fixed(qd);
        rates[k] = Dual::variable(qd[k], 0);
        let of_qd = column(&fixed(q), &rates);
        for i in 0..nv {
            (dtau_dq[i * nv + k], dtau_dqd[i * nv + k]) = (of_q[i].derivatives[0], of_qd[i].derivatives[0]);
        }
    }
    let (mass_matrix, tau) = (alg::mass_matrix(model, q), alg::inverse_dynamics(model, q, qd, qdd));
    DerivativeBlocks { dtau_dq, dtau_dqd, mass_matrix, tau }
}

/// Derivatives by q as those by increments along the tangent.
fn along_tangent<T: Real>(model: &Model<T>, q: &[T], by_q: &[T]) -> Vec<T> {
    let column = |k: usize| {
        let rates = along(model, q, k).into_iter().map(|x| x.derivatives[0]);
        rates.zip(by_q).fold(T::zero(), |sum, (rate, slope)| sum + rate * *slope)
    };
    (0..model.nv()).map(column).collect()
}

/// The configuration as it moves with velocity coordinate `k` alone.
pub(crate) fn along<T: Real>(model: &Model<T>, q: &[T], k: usize) -> Vec<Dual<T, 1>> {
    if !model.closure.is_empty() {
        return with_rates(q, &model.configuration_rate(q, &unit(model.nv(), k)));
    }
    let mut moving: Vec<Dual<T, 1>> = q.iter().map(|x| Dual::fixed(*x)).collect();
    for joint in model.free_joints() {
        let (places, coordinates) = (joint.iq..joint.iq + joint.kind.nq(), joint.iv..joint.iv + joint.kind.nv());
        if !coordinates.contains(&k) {
            continue;
        }
        let unit: Vec<T> = coordinates.map(|c| if c == k { T::one() } else { T::zero() }).collect();
        let mut rate = vec![T::zero(); places.len()];
        joint.kind.configuration_rate(joint.coordinates(q), &unit, &mut rate);
        moving[places].iter_mut().zip(rate).for_each(|(x, rate)| x.derivatives[0] = rate);
    }
    moving
}
