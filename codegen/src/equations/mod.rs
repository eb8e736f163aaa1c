//! The equations of every function: from a robot in a scene to expressions.

pub mod bind;
mod drives;
pub mod forward_method;
pub mod reduce;
pub mod robot;
pub(crate) mod traced;

pub use robot::Robot;

use crate::choices::ForwardDynamicsMethod;
use crate::equations::bind::Bound;
use crate::equations::forward_method::MethodChoice;
use crate::function::Function;
use crate::scene::Scene;
use drives::Rigid;
use straightline_core::model::{Frame, Model};
use straightline_core::reduced::ReducedModel;
use straightline_core::spatial::{Transform, Vec3};
use straightline_core::{algorithms as alg, Real};
use straightline_graph::expr::{Graph, RuleSet};
use straightline_graph::trace::{trace, Expr};
use straightline_graph::Scalar;

impl Function {
    /// Its value on the generic runtime: the output scalars in order, for inputs in the order of [`Function::inputs`].
    pub fn evaluate<T: Real>(
        self,
        model: &Model<T>,
        frames: &[&Frame<T>],
        method: ForwardDynamicsMethod,
        inputs: &[Vec<T>],
    ) -> Vec<T> {
        use Function::*;
        let q = &inputs[0];
        let arg = |i: usize| &inputs[i][..];
        match self {
            ForwardKinematics => alg::forward_kinematics(model, q, frames).iter().flat_map(pose).collect(),
            FrameVelocity => frames.iter().flat_map(|f| motion(alg::frame_velocity(model, q, arg(1), f))).collect(),
            FrameAcceleration => {
                frames.iter().flat_map(|f| motion(alg::frame_acceleration(model, q, arg(1), arg(2), f))).collect()
            }
            Jacobian => frames.iter().flat_map(|f| alg::jacobian(model, q, f)).collect(),
            JacobianBias => frames.iter().flat_map(|f| motion(alg::jacobian_bias(model, q, arg(1), f))).collect(),
            InverseDynamics => alg::inverse_dynamics(model, q, arg(1), arg(2)),
            GravityForce => alg::gravity_force(model, q),
            BiasForce => alg::bias_force(model, q, arg(1)),
            VelocityForce => alg::velocity_force(model, q, arg(1)),
            MassMatrix => alg::mass_matrix(model, q),
            ForwardDynamics => match method {
                ForwardDynamicsMethod::Factorisation => alg::forward_dynamics_ltdl(model, q, arg(1), arg(2)),
                _ => alg::forward_dynamics_aba(model, q, arg(1), arg(2)),
            },
            JointWrenches => alg::joint_wrenches(model, q, arg(1), arg(2))
                .into_iter()
                .flat_map(|w| w.force.to_array().into_iter().chain(w.moment.to_array()))
                .collect(),
            Energy => vec![alg::kinetic_energy(model, q, arg(1)), alg::potential_energy(model, q)],
            CentreOfMass => alg::momentum(model, q, &rest(model)).com.to_array().to_vec(),
            Momentum => {
                let m = alg::momentum(model, q, arg(1));
                m.linear.to_array().into_iter().chain(m.angular.to_array()).collect()
            }
            KinematicsAndJacobian => {
                let of = |f: &Function| f.evaluate(model, frames, method, inputs);
                self.members().iter().flat_map(of).collect()
            }
            Drive(function) => function.evaluate(&Rigid { model, reduced: None }, method, inputs),
        }
    }

    /// The same over the reals with fewer operations, for the functions that have such a form.
    pub(crate) fn evaluate_reduced<T: Real>(
        self,
        model: &Model<T>,
        reduced: &ReducedModel<T>,
        composite: &ReducedModel<T>,
        method: ForwardDynamicsMethod,
        inputs: &[Vec<T>],
    ) -> Option<Vec<T>> {
        if !reduced.serves(model) {
            return None;
        }
        use Function::*;
        let q = &inputs[0];
        let bias = || {
            reduced_bias(
                model,
                reduced,
                q,
                &inputs[1],
                &mut Limbs { wrench: &mut |_, _| None, first_moment: &mut |_, _| None },
            )
        };
        let mass_matrix = || {
            let mut h = alg::reduced_mass_matrix(composite, q);
            let nv = model.nv();
            for (i, rotor) in alg::rotor_inertias(model).into_iter().enumerate() {
                h[i * nv + i] = h[i * nv + i] + rotor;
            }
            h
        };
        Some(match self {
            InverseDynamics | GravityForce | BiasForce | VelocityForce => self.reduced_forces(
                model,
                reduced,
                inputs,
                &mut Limbs { wrench: &mut |_, _| None, first_moment: &mut |_, _| None },
            )?,
            MassMatrix => mass_matrix(),
            ForwardDynamics => {
                let drive: Vec<T> = inputs[2].iter().zip(bias()).map(|(tau, h)| *tau - h).collect();
                match method {
                    ForwardDynamicsMethod::Factorisation => alg::Ltdl::factor(model, &mass_matrix()).solve(&drive),
                    _ => alg::solve_articulated(model, q, &drive),
                }
            }
            Drive(function) => function.evaluate(&Rigid { model, reduced: Some((reduced, composite)) }, method, inputs),
            _ => return None,
        })
    }

    /// The reduced form of the functions to which a limb adds a wrench on the body that carries it, and the forces on its own joints.
    pub(crate) fn reduced_forces<T: Real>(
        self,
        model: &Model<T>,
        reduced: &ReducedModel<T>,
        inputs: &[Vec<T>],
        limbs: &mut Limbs<'_, T>,
    ) -> Option<Vec<T>> {
        use Function::*;
        let q = &inputs[0];
        Some(match self {
            InverseDynamics => {
                let motion = [&q[..], &inputs[1], &inputs[2]];
                let rigid = alg::reduced_inverse_dynamics_with_limbs(reduced, motion, limbs.wrench);
                let passive = alg::passive_force(model, q, &inputs[1]);
                let rotors = alg::rotor_inertias(model).into_iter().zip(&inputs[2]).map(|(i, qdd)| i * *qdd);
                rigid.into_iter().zip(rotors.zip(passive)).map(|(f, (r, p))| f + (r + p)).collect()
            }
            GravityForce => alg::reduced_gravity_force_with_limbs(reduced, q, limbs.first_moment),
            BiasForce => reduced_bias(model, reduced, q, &inputs[1], limbs),
            VelocityForce => {
                let weightless = ReducedModel { gravity: Vec3::zero(), ..reduced.clone() };
                let motion = [&q[..], &inputs[1], &rest(model)];
                alg::reduced_inverse_dynamics_with_limbs(&weightless, motion, limbs.wrench)
            }
            _ => return None,
        })
    }

    /// All its results over expressions, in a scene; inside a trace. `reduced`: by the reduced robot, where it serves.
    pub fn equations(
        self,
        robot: &Robot,
        frames: &[String],
        method: ForwardDynamicsMethod,
        reduced: bool,
        scene: &Scene,
        inputs: &[Vec<Expr>],
    ) -> Vec<Expr> {
        let bound = scene.bind(self, robot, inputs);
        let Bound { model, reduced: for_torques, composite, arguments } = &bound;
        let by_reduced =
            reduced.then(|| self.evaluate_reduced(model, for_torques, composite, method, arguments)).flatten();
        by_reduced.unwrap_or_else(|| {
            let frame = |name: &String| model.frame(name).expect("frames were checked against the model");
            self.evaluate(model, &frames.iter().map(frame).collect::<Vec<_>>(), method, arguments)
        })
    }

    /// Its equations for a robot in a scene, and for [`ForwardDynamicsMethod::Cheaper`] which form of forward dynamics that
    /// is and why: see [`forward_method`]. `reduced`: the reduced robot serves the functions that it
    /// can, and rounding moves.
    #[allow(clippy::too_many_arguments)]
    pub fn trace(
        self,
        robot: &Robot,
        frames: &[String],
        method: ForwardDynamicsMethod,
        rules: RuleSet,
        scalar: Scalar,
        reduced: bool,
        scene: &Scene,
    ) -> (Graph, Option<MethodChoice>) {
        let frames = scene.frames_of(self, frames);
        let (wanted, outputs) = scene.select(self, &robot.model, frames.len());
        let trace_with = |method| {
            trace(rules, scene.ports(self, &robot.model), outputs.clone(), |inputs| {
                let results = self.equations(robot, frames, method, reduced, scene, inputs);
                wanted.iter().map(|k| results[*k]).collect()
            })
        };
        let has_two_forms = match self {
            Function::Drive(f) => f.solves() && drives::may_be_articulated(&robot.model),
            _ => self == Function::ForwardDynamics,
        };
        match method {
            ForwardDynamicsMethod::Cheaper if has_two_forms => {
                let articulated = trace_with(ForwardDynamicsMethod::ArticulatedBody);
                let factorised = (robot.model.nv() <= forward_method::MOST_FOR_FACTORISATION)
                    .then(|| trace_with(ForwardDynamicsMethod::Factorisation));
                let choice = forward_method::choose(&robot.model, scalar, &articulated, factorised.as_ref());
                let graph = match factorised {
                    Some(factorised) if !choice.articulated_bodies => factorised,
                    _ => articulated,
                };
                (graph, Some(choice))
            }
            _ => (trace_with(method), None),
        }
    }
}

/// What the bodies that stand for several limbs each pass on to those that carry them, all limbs together: see
/// [`alg::reduced_inverse_dynamics_with_limbs`] and [`alg::reduced_gravity_force_with_limbs`].
pub(crate) struct Limbs<'a, T> {
    /// Force and moment.
    pub wrench: &'a mut alg::LimbWrenches<'a, T>,
    /// First moment and mass.
    pub first_moment: &'a mut alg::LimbMoments<'a, T>,
}

/// Bias forces by the reduced robot.
fn reduced_bias<T: Real>(
    model: &Model<T>,
    reduced: &ReducedModel<T>,
    q: &[T],
    qd: &[T],
    limbs: &mut Limbs<'_, T>,
) -> Vec<T> {
    let rigid = alg::reduced_inverse_dynamics_with_limbs(reduced, [q, qd, &rest(model)], limbs.wrench);
    let passive = alg::passive_force(model, q, qd);
    rigid.into_iter().zip(passive).map(|(f, p)| f + p).collect()
}

/// q̇ = 0 or q̈ = 0.
fn rest<T: Real>(model: &Model<T>) -> Vec<T> {
    vec![T::zero(); model.nv()]
}

fn pose<T: Real>(x: &Transform<T>) -> Vec<T> {
    x.translation.to_array().into_iter().chain(x.rotation.rows.into_iter().flatten()).collect()
}

/// Linear part first, as robot users expect it.
fn motion<T: Real>(m: straightline_core::spatial::MotionVector<T>) -> Vec<T> {
    let both: [Vec3<T>; 2] = [m.linear, m.angular];
    both.into_iter().flat_map(Vec3::to_array).collect()
}
