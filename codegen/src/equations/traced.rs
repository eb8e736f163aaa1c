//! The equations of one function as a graph, before any pass.

use crate::equations::forward_method::MethodChoice;
use crate::equations::Robot;
use crate::function::{ForwardDynamicsMethod, Function};
use crate::options::{Optimisations, Options};
use straightline_graph::expr::{Counts, Graph};
use straightline_graph::pass::count_sums;

/// The equations of one function, by these optimisations of the form of the robot and of the rules.
pub(crate) fn traced(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> (Graph, Option<MethodChoice>) {
    let method = match options.forward_dynamics {
        ForwardDynamicsMethod::Cheaper if !optimisations.cheaper => ForwardDynamicsMethod::ArticulatedBody,
        method => method,
    };
    let rules = options.rules_of(optimisations);
    function.trace(robot, frames, method, rules, options.scalar, optimisations.reduced, &options.scene)
}

/// What [`optimised`](crate::program::optimised) would take for a robot in the reduced forms that it is in, the equations as traced, and the method of forward
/// dynamics that was chosen: without writing the graph, for a search over many forms.
pub(crate) fn candidate(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> (Counts, Graph, Option<MethodChoice>) {
    let (graph, method) = traced(robot, frames, function, options, optimisations);
    let counts = if optimisations.sums { count_sums(&graph) } else { graph.counts() };
    (counts, graph, method)
}
