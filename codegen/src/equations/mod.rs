//! The equations of every function: from a robot in a scene to expressions.

mod base;
pub mod bind;
pub mod forward_method;
pub mod reduce;
pub mod robot;
pub(crate) mod traced;

pub use robot::Robot;

use crate::equations::forward_method::MethodChoice;
use crate::function::{may_be_articulated, AlikeColumns, Family, Forms, ForwardDynamicsMethod, Function};
use crate::scene::Scene;
use straightline_core::model::Frame;
use straightline_graph::expr::{Graph, RuleSet};
use straightline_graph::lanes::{self, LaneTemplate, Tracer};
use straightline_graph::trace::{trace, Expr};
use straightline_graph::Scalar;

impl AlikeColumns<Expr> for Tracer {
    fn of(&self, columns: &[Vec<Expr>], one: &dyn Fn(&[Expr]) -> Vec<Expr>) -> Vec<Vec<Expr>> {
        self.columns(columns, one)
    }
}

impl Function {
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
        self.equations_with(robot, frames, method, reduced, scene, inputs, None)
    }

    /// The same, where columns that are alike are computed by what is given.
    #[allow(clippy::too_many_arguments)]
    fn equations_with(
        self,
        robot: &Robot,
        frames: &[String],
        method: ForwardDynamicsMethod,
        reduced: bool,
        scene: &Scene,
        inputs: &[Vec<Expr>],
        columns: Option<&dyn AlikeColumns<Expr>>,
    ) -> Vec<Expr> {
        let bound = scene.bind(self, robot, inputs);
        let frame = |name: &String| bound.model.frame(name).expect("frames were checked against the model");
        let frames: Vec<&Frame<Expr>> = frames.iter().map(frame).collect();
        let forms = Forms { columns, ..bound.forms(reduced, &frames, scene.rows_of(self), method) };
        self.evaluate_on(&forms, &bound.arguments)
    }

    /// Its equations by this method of forward dynamics, with columns that are computed alike as lanes of loops; `None` if there are none.
    pub(crate) fn trace_in_lanes(
        self,
        robot: &Robot,
        frames: &[String],
        method: ForwardDynamicsMethod,
        rules: RuleSet,
        reduced: bool,
        scene: &Scene,
    ) -> Option<LaneTemplate> {
        let ports = scene.ports(self, &robot.model, frames);
        let frames = scene.frames_of(self, frames);
        let (wanted, outputs) = scene.select(self, &robot.model, frames.len());
        lanes::traced(rules, ports, outputs, |inputs, tracer| {
            let results = self.equations_with(robot, frames, method, reduced, scene, inputs, Some(tracer));
            wanted.iter().map(|k| results[*k]).collect()
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
        let ports = scene.ports(self, &robot.model, frames);
        let frames = scene.frames_of(self, frames);
        let (wanted, outputs) = scene.select(self, &robot.model, frames.len());
        let trace_with = |method| {
            trace(rules, ports.clone(), outputs.clone(), |inputs| {
                let results = self.equations(robot, frames, method, reduced, scene, inputs);
                wanted.iter().map(|k| results[*k]).collect()
            })
        };
        let has_two_forms = self.spec().solves
            && robot.model.is_tree()
            && match self.spec().family {
                Family::Drives | Family::DriveDerivatives => may_be_articulated(&robot.model),
                // rows of Jacobians need the factor
                Family::Tasks => false,
                Family::Robot | Family::Combination | Family::Derivatives | Family::Loops => true,
            };
        match method {
            ForwardDynamicsMethod::Cheaper if has_two_forms => {
                let articulated = trace_with(ForwardDynamicsMethod::ArticulatedBody);
                let factorised = (robot.model.nv() <= forward_method::MOST_FOR_FACTORISATION)
                    .then(|| trace_with(ForwardDynamicsMethod::Factorisation));
                let choice = forward_method::choose(&robot.model, self, scalar, &articulated, factorised.as_ref());
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
