//! Programs in f32 with some operations in f64.

use crate::equations::Robot;
use crate::options::{Optimisations, Options};
use crate::program::equivalence::{self, Disagreement};
use crate::program::input_box::input_box;
use crate::program::{passed, TracedProgram};
use straightline_graph::certify;
use straightline_graph::expr::NodeId;

/// A program in f32 gets f64 where its budget allows that and its greatest error takes it.
///
/// # Errors
/// If the program differs from the plain equations then.
pub(crate) fn mix_precisions(
    robot: &Robot,
    frames: &[String],
    program: &mut TracedProgram,
    options: &Options,
) -> Result<(), Disagreement> {
    let budget = options.scene.budgets.get(&program.function).filter(|b| b.mixed_precision);
    let Some(most) = budget.and_then(|b| b.max_error.as_ref()) else { return Ok(()) };
    // fused and generic ones were refused with the options
    if options.scalar.wider().is_none() {
        return Ok(());
    }
    // what does not fit is said where bounds are compared with the budget
    let Ok(demand) = most.of_results(&program.graph.outputs) else { return Ok(()) };
    let stored: Vec<NodeId> = program.schedule.parts.iter().flat_map(|p| p.stores.iter().map(|(id, _)| *id)).collect();
    let inputs = input_box(&program.graph.inputs, &options.scene, &robot.model);
    // what has no bound at all is refused where bounds are compared with the budget
    let widened =
        inputs.and_then(|inputs| certify::mixed::widened(&program.graph, options.scalar, &inputs, &demand, &stored));
    // what has none is the program that was checked before
    let Ok(graph) = widened else { return Ok(()) };
    program.graph = passed("mixed precision", program.function.name(), graph);
    let made_by = Optimisations { folding: program.has_folded_constants(options), ..options.optimisations() };
    equivalence::of_function(robot, frames, program.function, options, made_by, &program.graph)
}
