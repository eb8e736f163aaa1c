//! What is asked of frames, and how the robot does it: the dynamics of tasks, and steps of inverse kinematics.

use super::derivatives::weighed_slopes;
use super::spec::Extent::{Frames, Of, Velocities};
use super::spec::{Divisor, Family, Form, Judged, Output, Parts, RobotFunction, Spec};
use super::{Forms, Quantity, SelectedRows};
use straightline_core::algorithms::{self as alg, Ltdl, OperationalSpace, StepLimits, TaskRows, WeightedTask};
use straightline_core::model::{Frame, Limits};
use straightline_core::spatial::{MotionVector, Vec3};
use straightline_core::{Dd, Real};

/// What both have in common.
const TASK: Spec = Spec {
    family: Family::Tasks,
    form: Form::Motion,
    solves: true,
    divisor: Divisor::Inertia,
    judged: Judged::ByDerivatives,
    ..Spec::DERIVED
};

pub struct OperationalSpaceDynamics;

impl RobotFunction for OperationalSpaceDynamics {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "operational_space_dynamics",
        summary: "The dynamics of each frame: F = Λ ẍ + μ + p, with the dynamically consistent inverse of its Jacobian J.",
        aliases: &["operational space", "task space inertia", "Khatib", "dynamically consistent inverse", "null space"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Damping],
        outputs: &[
            Output::new(
                "lambda",
                &[Frames, Of(6), Of(6)],
                "per frame: rows of Λ = (J H⁻¹ Jᵀ + λ²)⁻¹ \\[kg, kg·m, kg·m²\\], linear rows at its origin, then angular ones, world axes",
            )
            .of_parts(Parts::LinearAngular),
            Output::new(
                "mu",
                &[Frames, Of(6)],
                "per frame: μ = Λ (J H⁻¹ C q̇ − J̇ q̇) \\[N, N·m\\], with friction and springs of the joints",
            )
            .of_parts(Parts::LinearAngular),
            Output::new("p", &[Frames, Of(6)], "per frame: p = Λ J H⁻¹ g \\[N, N·m\\]").of_parts(Parts::LinearAngular),
            Output::new(
                "j_bar",
                &[Frames, Velocities, Of(6)],
                "per frame: rows of J̄ = H⁻¹ Jᵀ Λ, one per velocity coordinate: q̇ = J̄ ẋ has the least kinetic energy",
            )
            .of_parts(Parts::LinearAngular),
            Output::new(
                "null_space",
                &[Frames, Velocities, Velocities],
                "per frame: rows of N = 1 − J̄ J: N q̇ are motions, and Nᵀ τ forces, that leave the frame alone",
            ),
        ],
        ..TASK
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (q, qd, damping) = (&inputs[0], &inputs[1], inputs[2][0]);
        let passive = alg::passive_force(forms.model, q, qd);
        let velocity: Vec<T> = forms.velocity_force(q, qd).into_iter().zip(passive).map(|(c, p)| c + p).collect();
        let gravity = forms.gravity_force(q);
        let factor = Ltdl::factor(forms.model, &forms.mass_matrix(q));
        let mut blocks: [Vec<T>; 5] = Default::default();
        for frame in forms.frames {
            let (rows, nv) = (forms.rows, qd.len());
            let task = OperationalSpace::new(TaskRows::new(&factor, jacobian_rows(forms, q, frame)), damping);
            let bias: Vec<T> = six(alg::jacobian_bias(forms.model, q, qd, frame));
            let bias: Vec<T> = rows.places().map(|k| bias[k]).collect();
            let rest = vec![T::zero(); bias.len()];
            let inverse = task.inverse();
            let null_space = task.null_space(&inverse);
            blocks[0].extend(spread(
                rows,
                &task.inertia().iter().map(|row| spread_one(rows, row)).collect::<Vec<_>>(),
                6,
            ));
            blocks[1].extend(spread_one(rows, &task.force(&velocity, &bias)));
            blocks[2].extend(spread_one(rows, &task.force(&gravity, &rest)));
            blocks[3].extend((0..nv).flat_map(|i| spread_one(rows, &inverse[i])));
            blocks[4].extend(null_space.concat());
        }
        blocks.concat()
    }
}

pub struct InverseKinematicsStep;

impl RobotFunction for InverseKinematicsStep {
    const SPEC: Spec = Spec {
        on_loops: true,
        name: "inverse_kinematics_step",
        summary: "A step of inverse kinematics: damped least squares of the least kinetic energy within the limits of the joints.",
        aliases: &["IK", "damped least squares", "Levenberg-Marquardt", "differential inverse kinematics"],
        inputs: &[
            Quantity::Configuration,
            Quantity::PoseError,
            Quantity::TaskWeight,
            Quantity::Damping,
            Quantity::TorqueGain,
        ],
        outputs: &[Output::new(
            "dq",
            &[Velocities],
            "what to add to q \\[rad or m\\]; of a floating base increments of its pose in its own axes",
        )
        .of_parts(Parts::OfTask)],
        ..TASK
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let [q, error, weight] = [0, 1, 2].map(|k| &inputs[k][..]);
        let [damping, gain] = [3, 4].map(|k| inputs[k][0]);
        let mass_matrix = forms.mass_matrix(q);
        let of_rows = |x: &[T]| -> Vec<T> {
            x.chunks(6).take(forms.frames.len()).flat_map(|x| forms.rows.places().map(|k| x[k])).collect()
        };
        let task = WeightedTask {
            jacobian: forms.frames.iter().flat_map(|frame| jacobian_rows(forms, q, frame)).collect(),
            error: of_rows(error),
            weight: of_rows(weight),
        };
        let steepest = Ltdl::factor(forms.model, &mass_matrix).solve(&slope_of_holding_torques(forms, q));
        let descent: Vec<T> = steepest.into_iter().map(|x| -(gain * x)).collect();
        alg::inverse_kinematics_step(forms.model, &mass_matrix, &task, (&descent, damping), &step_limits(forms, q))
    }
}

/// ∂V/∂q of V = ½ Σ (τ/τ_max)² of the torques that hold the robot still, each as a part of its limit: the redundancy of a robot serves to stay clear of the
/// limits of its drives (section 20.5.1). A joint without a limit counts with its torque \[N·m or N\] where none has one, otherwise not; nor does a base.
fn slope_of_holding_torques<T: Real>(forms: &Forms<'_, T>, q: &[T]) -> Vec<T> {
    let (rest, nv) = (forms.rest(), forms.model.nv());
    let weights =
        torque_weights(forms.model.independent_joints().filter(|j| j.kind.is_single()).map(|j| (j.iv, j.limits)), nv);
    let torques = forms.inverse_dynamics(q, &rest, &rest);
    let weighed: Vec<T> = torques.into_iter().zip(weights).map(|(tau, w)| tau * T::constant(w)).collect();
    weighed_slopes(forms, [q, &rest, &rest], &weighed).into_iter().take(nv).collect()
}

/// 1/τ_max² by velocity coordinate, of joints with one coordinate.
fn torque_weights(joints: impl Iterator<Item = (usize, Limits)> + Clone, nv: usize) -> Vec<Dd> {
    let is_limit = |effort: f64| effort > 0.0 && effort.is_finite();
    let some_have = joints.clone().any(|(_, limits)| is_limit(limits.effort));
    let mut weights = vec![Dd::ZERO; nv];
    for (iv, Limits { effort, .. }) in joints {
        weights[iv] = match is_limit(effort) {
            true => Dd::ONE / (Dd::from(effort) * Dd::from(effort)),
            false if some_have => Dd::ZERO,
            false => Dd::ONE,
        };
    }
    weights
}

/// How far each coordinate may step, of joints with one coordinate and limits.
fn step_limits<T: Real>(forms: &Forms<'_, T>, q: &[T]) -> Vec<Option<StepLimits<T>>> {
    let mut all = vec![None; forms.model.nv()];
    for joint in forms.model.independent_joints().filter(|j| j.kind.is_single()) {
        let Limits { lower, upper, .. } = joint.limits;
        let to = |limit: f64| limit.is_finite().then(|| T::constant(Dd::from(limit)) - q[joint.iq]);
        let limits = StepLimits { lower: to(lower), upper: to(upper) };
        all[joint.iv] = (limits.lower.is_some() || limits.upper.is_some()).then_some(limits);
    }
    all
}

/// The rows of the Jacobian of a frame that are asked for.
fn jacobian_rows<T: Real>(forms: &Forms<'_, T>, q: &[T], frame: &Frame<T>) -> Vec<Vec<T>> {
    let all = alg::jacobian(forms.model, q, frame);
    let nv = forms.model.nv();
    forms.rows.places().map(|k| all[k * nv..(k + 1) * nv].to_vec()).collect()
}

fn six<T: Real>(motion: MotionVector<T>) -> Vec<T> {
    [motion.linear, motion.angular].into_iter().flat_map(Vec3::to_array).collect()
}

/// Numbers of the rows that are asked for among six, the others zero.
fn spread_one<T: Real>(rows: SelectedRows, x: &[T]) -> Vec<T> {
    spread(rows, &x.iter().map(|x| vec![*x]).collect::<Vec<_>>(), 1)
}

/// The same of rows of so many numbers.
fn spread<T: Real>(rows: SelectedRows, x: &[Vec<T>], len: usize) -> Vec<T> {
    let mut all = vec![vec![T::zero(); len]; 6];
    rows.places().zip(x).for_each(|(k, x)| all[k].clone_from(x));
    all.concat()
}
