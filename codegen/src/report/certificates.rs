//! The bounds of rounding errors of every program.

use crate::equations::Robot;
use crate::function::Function;
use crate::options::{Optimisations, Options};
use crate::program::companion::ROUNDED;
use crate::program::input_box::input_box;
use crate::program::{optimised, pivots, TracedProgram};
use crate::report::errors::ErrorReport;
use straightline_graph::certify::{self, Effort, KnownSystem};
use straightline_graph::expr::Graph;

/// The bounds of rounding errors of every program, where they are asked for.
pub(crate) fn certificates(robot: &Robot, programs: &[TracedProgram], options: &Options) -> Vec<Option<ErrorReport>> {
    let of = |p: &TracedProgram| {
        let budgeted = options.scene.budgets.get(&p.function).is_some_and(|b| b.max_error.is_some());
        let effort = options.certify.or(budgeted.then(Effort::default))?;
        let outputs = &p.graph.outputs;
        if !p.has_folded_constants(options) {
            return Some(ErrorReport::refused(ROUNDED));
        }
        let inputs = match input_box(&p.graph.inputs, &options.scene, &robot.model) {
            Ok(inputs) => inputs,
            Err(refusal) => return Some(ErrorReport::refused(refusal.words())),
        };
        let ranges = certify::box_in_words(&p.graph.inputs, &inputs);
        let known = match p.function.spec().judged.is_by_equations() {
            true => known(robot, &p.graph, &inputs, options),
            false => KnownSystem::default(),
        };
        Some(match certify::certify_with(&p.graph, options.scalar, &inputs, effort, &known) {
            Ok(certificate) => ErrorReport::new(outputs, ranges, certificate),
            Err(refusal) => ErrorReport { ranges, ..ErrorReport::refused(refusal.words()) },
        })
    };
    programs.iter().map(of).collect()
}

/// What mechanics knows of the values of forward dynamics: [`pivots`].
pub fn known(robot: &Robot, graph: &Graph, inputs: &[certify::Interval], options: &Options) -> KnownSystem {
    if !pivots::is_arm(&robot.model, graph) {
        return KnownSystem::default();
    }
    let all = options.optimisations();
    let plain = Optimisations { chosen: false, limbs: false, substitutes: false, ..all };
    let of = |function| optimised(robot, &[], function, options, plain);
    let (mass_matrix, torques) = (of(Function::MassMatrix), of(Function::InverseDynamics));
    let sizes = pivots::Sizes::of(&mass_matrix, &torques, &options.scene, &robot.model);
    sizes.map_or_else(|_| KnownSystem::default(), |sizes| pivots::known(&robot.model, graph, inputs, &sizes))
}
