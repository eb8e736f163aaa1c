//! The bounds of rounding errors of every program.

use crate::equations::Robot;
use crate::function::{Function, Judged, Quantity, SlopeOf};
use crate::options::{Optimisations, Options};
use crate::program::companion::ROUNDED;
use crate::program::input_box::input_box;
use crate::program::{optimised, pivots, TracedProgram};
use crate::report::errors::{ErrorReport, LipschitzBounds};
use crate::scene::Scene;
use std::collections::BTreeMap;
use straightline_core::model::Coulomb;
use straightline_graph::certify::{self, Effort, KnownSystem};
use straightline_graph::expr::{Graph, Port};

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
            true => known(robot, p.function, &p.graph, &inputs, options),
            false => KnownSystem::default(),
        };
        Some(match certify::certify_with(&p.graph, options.scalar, &inputs, effort, &known) {
            Ok(certificate) => {
                let mut report = ErrorReport::new(outputs, ranges, certificate);
                if outputs.iter().any(|port| slope_of(p.function, port).is_some()) {
                    let magnitudes = magnitudes(&p.graph, options, &inputs, (effort, &known));
                    let magnitudes = magnitudes.unwrap_or_else(|| report.magnitudes());
                    // of exact values, which computed ones may be far from
                    let exact = certify::slopes::known_magnitudes(&p.graph, &known);
                    let magnitudes: Vec<f64> = magnitudes.into_iter().zip(exact).map(|(a, b)| a.min(b)).collect();
                    add_slopes(&mut report, p.function, robot, &magnitudes);
                }
                report
            }
            Err(refusal) => ErrorReport { ranges, ..ErrorReport::refused(refusal.words()) },
        })
    };
    programs.iter().map(of).collect()
}

/// What an output is the derivative of.
fn slope_of(function: Function, port: &Port) -> Option<SlopeOf> {
    function.spec().outputs.iter().find(|output| output.name == port.name).and_then(|output| output.slope)
}

/// What results can be at most, from a box that is cut; none where it is not, as the certificate has them then.
fn magnitudes(
    graph: &Graph,
    options: &Options,
    inputs: &[certify::Interval],
    (effort, known): (Effort, &KnownSystem),
) -> Option<Vec<f64>> {
    let is_cut = effort.boxes > 1;
    is_cut.then(|| certify::slopes::magnitudes(graph, options.scalar, inputs, effort, known).ok()).flatten()
}

/// How fast functions can change, by the greatest values of their derivatives.
fn add_slopes(report: &mut ErrorReport, function: Function, robot: &Robot, magnitudes: &[f64]) {
    const FRICTION: &str = "dry friction jumps where a joint reverses";
    let has_dry_friction = robot.model.bodies.iter().any(|body| match body.effects.coulomb {
        Coulomb::Sign(force) => force.to_f64() != 0.0,
        Coulomb::Off | Coulomb::Smooth { .. } => false,
    });
    let mut first = 0;
    for output in &mut report.outputs {
        let of = first..first + output.magnitudes.len();
        first = of.end;
        let row = function.spec().outputs.iter().find(|row| row.name == output.name);
        output.slopes = row.and_then(|row| row.slope).map(|slope| {
            match has_dry_friction && slope.feels_friction && slope.by == Quantity::Velocity {
                true => LipschitzBounds::refused(slope, FRICTION),
                false => LipschitzBounds::new(slope, &output.shape, magnitudes[of].to_vec()),
            }
        });
    }
}

/// What mechanics knows of the values of forward dynamics and of its derivatives: [`pivots`].
pub fn known(
    robot: &Robot,
    function: Function,
    graph: &Graph,
    inputs: &[certify::Interval],
    options: &Options,
) -> KnownSystem {
    if !pivots::is_arm(&robot.model, function, graph) {
        return KnownSystem::default();
    }
    // whole matrices, whatever the scene wants of them
    let scene = Scene { outputs: BTreeMap::new(), by_columns: false, ..options.scene.clone() };
    let options = &Options { scene, ..options.clone() };
    let all = options.optimisations();
    let plain = Optimisations { chosen: false, limbs: false, columns: false, substitutes: false, ..all };
    let of = |function| optimised(robot, &[], function, options, plain);
    let (mass_matrix, torques) = (of(Function::MassMatrix), of(Function::InverseDynamics));
    let slopes = (function.spec().judged == Judged::ByColumns).then(|| of(Function::InverseDynamicsDerivatives));
    let sizes = pivots::Sizes::of(&mass_matrix, &torques, slopes.as_ref(), &options.scene, &robot.model);
    sizes.map_or_else(|_| KnownSystem::default(), |sizes| pivots::known(&robot.model, function, graph, inputs, &sizes))
}
