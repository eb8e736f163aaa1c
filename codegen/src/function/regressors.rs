//! Regressors, and the base parameters that their columns belong to.

use super::solution::Solution;
use super::spec::Extent::{self, Of, RegressorEntries, Velocities};
use super::spec::{Divisor, Form, Judged, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::base_parameters::{BaseParameter, JointParameter};
use straightline_core::reduced::ReducedModel;
use straightline_core::spatial::Vec3;
use straightline_core::Real;

const PER_VELOCITY: &[Extent] = &[Velocities, Extent::BaseParameters];
const PER_SCENE_PARAMETER: &[Extent] = &[Velocities, Extent::SceneParameters];

/// What all regressors have in common.
const REGRESSOR: Spec = Spec { form: Form::Regressor, ..Spec::DERIVED };

impl<T: Real> Forms<'_, T> {
    /// Y of the bodies, in this gravity.
    fn inertial_regressor(&self, motion: [&[T]; 3], gravity: Vec3<T>) -> Vec<T> {
        match self.reduced {
            Some([reduced, _]) => {
                let reduced = ReducedModel { gravity, ..reduced.clone() };
                let (model, [q, qd, qdd]) = (self.model, &self.model.tree_motion(motion));
                let columns = model.of_tree(&model.base_parameters.of_forces);
                model.free_rows(q, alg::reduced_inertial_regressor(&reduced, &columns, [q, qd, qdd]), columns.len())
            }
            None => alg::inertial_regressor(self.model, &self.model.base_parameters.of_forces, motion, gravity),
        }
    }

    /// Y with what joints add.
    fn torque_regressor(&self, motion: [&[T]; 3]) -> Vec<T> {
        let mut y = self.inertial_regressor(motion, self.model.gravity);
        alg::put_joint_columns(self.model, motion, &JointParameter::EVERY, &mut y);
        y
    }
}

pub struct TorqueRegressor;

impl RobotFunction for TorqueRegressor {
    const SPEC: Spec = Spec {
        name: "torque_regressor",
        summary: "The regressor Y(q, q̇, q̈) of inverse dynamics: τ = Y β with the base parameters β, but for what joints add without a column.",
        aliases: &["computeJointTorqueRegressor", "identification matrix", "dynamic parameters", "adaptive control"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[Output::new(
            "y",
            PER_VELOCITY,
            "rows of Y \\[N·m or N per unit of each base parameter\\], of one column per base parameter",
        )],
        ..REGRESSOR
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        forms.torque_regressor([&inputs[0], &inputs[1], &inputs[2]])
    }
}

pub struct TorqueRegressorEntries;

impl RobotFunction for TorqueRegressorEntries {
    const SPEC: Spec = Spec {
        name: "torque_regressor_entries",
        summary: "The entries of the regressor Y(q, q̇, q̈) of inverse dynamics that are not zero everywhere.",
        aliases: &["sparse regressor", "identification"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[Output::new(
            "y",
            &[RegressorEntries],
            "entries of Y, column by column, whose places are [`BASE_REGRESSOR_ROWS`] and [`BASE_REGRESSOR_COLUMNS`]",
        )],
        ..REGRESSOR
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let y = forms.torque_regressor([&inputs[0], &inputs[1], &inputs[2]]);
        let columns = &forms.model.base_parameters.of_forces;
        let entries = columns.iter().enumerate().flat_map(|(k, column)| column.rows.iter().map(move |row| (*row, k)));
        entries.map(|(row, k)| y[row * columns.len() + k]).collect()
    }
}

pub struct GravityRegressor;

impl RobotFunction for GravityRegressor {
    const SPEC: Spec = Spec {
        name: "gravity_regressor",
        summary: "The regressor Y(q) of gravity forces: g = Y β with the base parameters β.",
        aliases: &["computeStaticRegressor", "gravity identification"],
        inputs: &[Quantity::Configuration],
        outputs: &[Output::new(
            "y",
            PER_VELOCITY,
            "rows of Y \\[N·m or N per unit of each base parameter\\]; columns of what gravity does not depend on are zero",
        )],
        ..REGRESSOR
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let rest = forms.rest();
        forms.inertial_regressor([&inputs[0], &rest, &rest], forms.model.gravity)
    }
}

pub struct MomentumRegressor;

impl RobotFunction for MomentumRegressor {
    const SPEC: Spec = Spec {
        name: "momentum_regressor",
        summary: "The regressor Y(q, q̇) of the generalized momentum: H q̇ = Y β with the base parameters β.",
        aliases: &["filtered regressor", "momentum observer", "identification without accelerations"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new(
            "y",
            PER_VELOCITY,
            "rows of Y \\[N·m·s or N·s per unit of each base parameter\\], of one column per base parameter",
        )],
        ..REGRESSOR
    };

    /// Forces that accelerate the robot to these velocities from rest.
    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let rest = forms.rest();
        let motion = [&inputs[0][..], &rest, &inputs[1]];
        let mut y = forms.inertial_regressor(motion, Vec3::zero());
        alg::put_joint_columns(forms.model, motion, &[JointParameter::RotorInertia], &mut y);
        y
    }
}

pub struct EnergyRegressor;

impl RobotFunction for EnergyRegressor {
    const SPEC: Spec = Spec {
        name: "energy_regressor",
        summary: "The regressor Y(q, q̇) of kinetic and potential energy: T = Y₀ β, and V = Y₁ β but for a constant.",
        aliases: &["computeKineticEnergyRegressor", "computePotentialEnergyRegressor", "power identification"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new(
            "y",
            &[Of(2), Extent::BaseParameters],
            "rows of T and V \\[J per unit of each base parameter\\]; to V comes what base parameters leave out, which is constant",
        )],
        form: Form::Plain,
        ..REGRESSOR
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::energy_regressor(forms.model, &inputs[0], &inputs[1])
    }
}

pub struct BaseWrenchRegressor;

impl RobotFunction for BaseWrenchRegressor {
    const SPEC: Spec = Spec {
        name: "base_wrench_regressor",
        summary: "The regressor of the wrench that the moving bodies take of their support, or of a floating base.",
        aliases: &["root link identification", "force plate", "base dynamics"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[Output::new(
            "y",
            &[Of(6), Extent::SupportParameters],
            "rows of force (3) and moment (3) about the world's origin in its axes \\[N, N·m per unit of each support parameter\\]; of a floating base \
about the root link's origin in its axes",
        )],
        form: Form::Plain,
        ..REGRESSOR
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::base_wrench_regressor(forms.model, [&inputs[0], &inputs[1], &inputs[2]])
    }
}

pub struct BaseParameters;

impl RobotFunction for BaseParameters {
    const SPEC: Spec = Spec {
        name: "base_parameters",
        summary: "The base parameters β that forces tell apart, of the inertial parameters of the links.",
        aliases: &["identifiable parameters", "minimal parameters", "barycentric parameters"],
        inputs: &[Quantity::LinkParameters],
        outputs: &[Output::new(
            "beta",
            &[Extent::BaseParameters],
            "base parameters, in the order of [`BASE_PARAMETER_NAMES`] \\[kg, kg·m, kg·m²; of joints as their parameters\\]",
        )],
        form: Form::Plain,
        ..REGRESSOR
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        sums(&forms.model.base_parameters.of_forces, &inputs[0])
    }
}

pub struct SupportParameters;

impl RobotFunction for SupportParameters {
    const SPEC: Spec = Spec {
        name: "support_parameters",
        summary: "The parameters that the wrench on the support tells apart, of the inertial parameters of the links.",
        aliases: &["identifiable parameters", "force plate"],
        inputs: &[Quantity::LinkParameters],
        outputs: &[Output::new(
            "beta",
            &[Extent::SupportParameters],
            "support parameters, in the order of [`SUPPORT_PARAMETER_NAMES`] \\[kg, kg·m, kg·m²\\]",
        )],
        form: Form::Plain,
        ..REGRESSOR
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        sums(&forms.model.base_parameters.of_support, &inputs[0])
    }
}

pub struct ParameterDerivatives;

impl RobotFunction for ParameterDerivatives {
    const SPEC: Spec = Spec {
        name: "parameter_derivatives",
        summary: "Derivatives ∂τ/∂π and ∂q̈/∂π by the inertial parameters π of the bodies that a scene makes inputs.",
        aliases: &["payload sensitivity", "parameter sensitivity", "payload estimation"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[
            Output::new(
                "dtau_dpi",
                PER_SCENE_PARAMETER,
                "rows of ∂τ/∂π at constant q̈, of ten columns per body: m, m c (3), I (xx, xy, xz, yy, yz, zz) about the origin and in the axes of its frame",
            ),
            Output::new("dqdd_dpi", PER_SCENE_PARAMETER, "rows of ∂q̈/∂π at constant τ, at the q̈ that is given"),
        ],
        form: Form::Plain,
        solves: true,
        divisor: Divisor::Inertia,
        judged: Judged::ByColumns,
        ..Spec::DERIVED
    };

    /// H ∂q̈/∂π = −∂τ/∂π.
    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let by_force = forms.scene_regressor(inputs);
        let nv = forms.model.nv();
        let columns = forms.model.base_parameters.of_scene.len();
        let solution = Solution::new(forms, &inputs[0]);
        let mut by_motion = by_force.clone();
        let right = |k: usize| (0..nv).map(|i| -by_force[i * columns + k]).collect::<Vec<T>>();
        for (k, column) in solution.of_all(&(0..columns).map(right).collect::<Vec<_>>()).into_iter().enumerate() {
            column.into_iter().enumerate().for_each(|(i, x)| by_motion[i * columns + k] = x);
        }
        [by_force, by_motion].concat()
    }

    /// Of the first block the difference from the plain equations themselves.
    fn residual<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>], found: &[T]) -> Vec<T> {
        let by_force = forms.scene_regressor(inputs);
        let nv = forms.model.nv();
        let columns = forms.model.base_parameters.of_scene.len();
        let h = alg::mass_matrix(forms.model, &inputs[0]);
        let (of_force, of_motion) = found.split_at(by_force.len());
        let off = of_force.iter().zip(&by_force).map(|(a, b)| *a - *b);
        let left = (0..nv * columns).map(|at| {
            let (i, k) = (at / columns, at % columns);
            (0..nv).fold(by_force[at], |sum, j| sum + h[i * nv + j] * of_motion[j * columns + k])
        });
        off.chain(left).collect()
    }
}

impl<T: Real> Forms<'_, T> {
    fn scene_regressor(&self, inputs: &[Vec<T>]) -> Vec<T> {
        let columns = &self.model.base_parameters.of_scene;
        alg::inertial_regressor(self.model, columns, [&inputs[0], &inputs[1], &inputs[2]], self.model.gravity)
    }
}

/// The parameters, of what they are made of.
fn sums<T: Real>(parameters: &[BaseParameter], of: &[T]) -> Vec<T> {
    let sum = |parameter: &BaseParameter| {
        let mut terms = parameter.terms.iter().map(|(place, factor)| T::constant(*factor) * of[*place]);
        let first = terms.next().unwrap_or_else(T::zero);
        terms.fold(first, |sum, term| sum + term)
    };
    parameters.iter().map(sum).collect()
}
