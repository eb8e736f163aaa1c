//! From equations to operations in order: the form with the fewest, its passes, and the checks of both.

pub mod choose;
mod columns;
pub mod companion;
pub mod contact;
pub mod demand_inertia;
pub mod equivalence;
pub mod fixed;
mod in_lanes;
pub mod input_box;
pub mod limbs;
pub mod mixed;
pub mod nonzeros;
pub mod parameter;
pub mod pivots;
mod plainer;
pub mod range;
pub mod self_test;
mod sines;
pub mod staged;
pub mod stored;
pub mod written;

use crate::choices::WrittenEntries;
use crate::equations::bind::is_optional;
use crate::equations::forward_method::MethodChoice;
use crate::equations::traced::{candidate, traced};
use crate::equations::Robot;
use crate::function::{Family, Form, Function, Output};
use crate::model::states::samples;
use crate::options::optimisations::FOLDING;
use crate::options::{Optimisations, Options};
use crate::program::choose::price;
use crate::program::equivalence::{Disagreement, Plainer};
use crate::program::nonzeros::NonzeroEntries;
use straightline_graph::expr::{verify, Graph, Port};
use straightline_graph::pass::{dead_code, order, substitute, sums, unread_inputs};
use straightline_graph::schedule::{schedule, Schedule};

/// Values of the greatest program of a robot with closed loops in which values are formed of others, whatever the function.
const SUBSTITUTED_ON_LOOPS: usize = 600;

/// A program between tracing and text.
#[derive(Clone, Debug)]
pub struct TracedProgram {
    /// What it computes.
    pub function: Function,
    /// Its operations.
    pub graph: Graph,
    /// Their order, and the cuts.
    pub schedule: Schedule,
    /// Of forward dynamics whose method was left to the compiler: which, and why.
    pub method: Option<MethodChoice>,
    /// Whether it has another form than it would have had, as that one was wrong.
    pub plainer: Option<Plainer>,
    /// Which entries of its matrix results can be non-zero, where that is written beside it.
    pub entries: Vec<NonzeroEntries>,
}

impl TracedProgram {
    /// A graph in the order in which it is written.
    fn scheduled(function: Function, graph: Graph, options: &Options) -> TracedProgram {
        let schedule = schedule(&graph, options.limits, options.schedule_machine().as_ref());
        TracedProgram { function, graph, schedule, method: None, plainer: None, entries: Vec::new() }
    }

    /// Whether its constants are those of the robot, in double-double: otherwise no bound of its errors is one of the robot.
    pub(crate) fn has_folded_constants(&self, options: &Options) -> bool {
        options.optimisations().folding && self.plainer.as_ref().is_none_or(|plainer| plainer.without != FOLDING)
    }
}

/// Traces and optimises one function of a robot, and checks what came out.
///
/// # Panics
/// If no form of it agrees with its plain equations.
pub fn program(robot: &Robot, frames: &[String], function: Function, options: &Options) -> TracedProgram {
    checked(robot, frames, function, options).unwrap_or_else(|wrong| panic!("{wrong}"))
}

/// The program of a function with the fewest operations that agrees with its plain equations: see [`equivalence`].
///
/// # Errors
/// What was wrong, if none does.
pub fn checked(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
) -> Result<TracedProgram, Disagreement> {
    let robot = &robot.clone().knowing_base_parameters(&[function], &options.scene);
    let ((graph, method), plainer) = options.optimisations().first_that_agrees(|optimisations| {
        let (graph, method) = optimised_with(robot, frames, function, options, optimisations);
        let made = (sines::with_sines(graph, function, &robot.model, options), method);
        equivalence::of_function(robot, frames, function, options, optimisations, &made.0).map(|()| made)
    })?;
    Ok(TracedProgram { method, plainer, ..TracedProgram::scheduled(function, graph, options) })
}

/// The operations of one function of a robot, with these optimisations only.
pub fn optimised(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Graph {
    let robot = &robot.clone().knowing_base_parameters(&[function], &options.scene);
    optimised_with(robot, frames, function, options, optimisations).0
}

/// The same, with the choice of the method where one was made.
fn optimised_with(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> (Graph, Option<MethodChoice>) {
    // packed matrices follow no loop over limbs
    let is_packed =
        options.entries == WrittenEntries::Nonzeros && function.spec().outputs.iter().any(Output::is_by_columns);
    if optimisations.limbs && !is_packed {
        if let Some(graph) = limbs::program(robot, frames, function, options, optimisations) {
            return (graph, None);
        }
    }
    let optimisations = Optimisations { limbs: false, ..optimisations };
    let check = |pass, graph| passed(pass, function.name(), graph);
    let optimisations = Optimisations { columns: optimisations.columns && !is_packed, ..optimisations };
    let finished = |robot: &Robot, options: &Options, optimisations: Optimisations| {
        let (traced, choice) = traced(robot, frames, function, options, optimisations);
        let method = choice.map_or(options.forward_dynamics, |choice| choice.method());
        let by_method = Options { forward_dynamics: method, ..options.clone() };
        let in_lanes = in_lanes::program(robot, frames, function, &by_method, optimisations);
        if let Some(in_lanes) = in_lanes.as_ref().filter(|_| in_lanes::is_taken_unseen(&traced, options)) {
            return (in_lanes.clone(), choice);
        }
        let graph = check("dead code", dead_code(&check("traced", traced)));
        let graph = check("unread inputs", unread_inputs(graph, is_optional));
        let graph = match optimisations.sums {
            true => check("dead code", dead_code(&check("sums", sums(&graph)))),
            false => graph,
        };
        // what dependent joints move is formed of few values in many ways; how loops close is not
        let is_moved = !robot.model.closure.is_empty() && function.spec().family != Family::Loops;
        let of_loops = if is_moved { SUBSTITUTED_ON_LOOPS } else { 0 };
        let largest = function.spec().substituted_up_to.max(of_loops);
        let graph = match optimisations.substitutes && largest > 0 {
            true => check("substitute", substitute(&graph, largest, &choose::keeps_digits_of(&robot.model, &graph))),
            false => graph,
        };
        if let Some(in_lanes) = in_lanes.filter(|in_lanes| in_lanes::pays(in_lanes, &graph)) {
            return (in_lanes, choice);
        }
        // fused products want another order
        let ordered = optimisations.sums && !options.fma && !function.spec().keeps_order;
        let graph = match ordered.then(|| samples(&robot.model, &graph)).flatten() {
            Some(states) => check("order", order(&graph, &states)),
            None => graph,
        };
        (graph, choice)
    };
    if !(optimisations.chosen && optimisations.reduced && robot.reduced.serves(&robot.model)) {
        return finished(robot, options, optimisations);
    }
    let chosen = choose::choose(robot, frames, function, options, Optimisations { chosen: false, ..optimisations });
    let (graph, choice) = finished(&chosen, options, optimisations);
    // by the bodies' own parameters in their own frames, where those have more zeros; the method stays
    let same_method = choice.map_or(options.forward_dynamics, |choice| choice.method());
    let same_method = Options { forward_dynamics: same_method, ..options.clone() };
    let of_bodies = Optimisations { reduced: false, ..optimisations };
    let has_bodies_form = matches!(function.spec().family, Family::Robot | Family::Derivatives);
    if has_bodies_form && !matches!(function.spec().form, Form::Plain | Form::Derivatives | Form::Regressor) {
        let (counts, ..) = candidate(robot, frames, function, &same_method, of_bodies);
        if price(counts) < price(graph.counts()) {
            return (finished(robot, &same_method, of_bodies).0, choice);
        }
    }
    (graph, choice)
}

/// What [`simplified`] calls its passes of equations that results are judged by.
pub(crate) const OF_SYSTEM: [&str; 4] =
    ["system: traced", "system: dead code", "system: unread inputs", "system: sums"];

/// Equations as they were traced without what no result needs, without inputs that are not read and need not be, and with fewer sums.
pub(crate) fn simplified(
    (program, [as_traced, dead, unread, fewer]): (&str, [&'static str; 4]),
    traced: Graph,
    unused: impl Fn(&Port) -> bool,
    optimisations: Optimisations,
) -> Graph {
    let check = |pass, graph| passed(pass, program, graph);
    let graph = check(dead, dead_code(&check(as_traced, traced)));
    let graph = check(unread, unread_inputs(graph, unused));
    match optimisations.sums {
        true => check(dead, dead_code(&check(fewer, sums(&graph)))),
        false => graph,
    }
}

/// What a pass made, if it kept what graphs promise.
pub(crate) fn passed(pass: &'static str, program: &str, graph: Graph) -> Graph {
    #[cfg(feature = "internals")]
    let graph = equivalence::sabotage::applied(pass, graph);
    verify(&graph).unwrap_or_else(|broken| panic!("{program}: the pass `{pass}` broke the graph: {broken}"));
    graph
}
