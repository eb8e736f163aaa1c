//! The staged form of a robot's functions: typed values for what depends on parameters, on q, on q and q̇.
//!
//! All functions are traced into one program, so that they share what they have in common, and the program is cut by
//! [`cut`](straightline_graph::pass::cut). Around each stage's stored values stands a struct; a later stage borrows the earlier one, so that a value
//! of a stage cannot outlive a change of what it was computed from.

use crate::equations::bind::is_optional;
use crate::equations::Robot;
use crate::function::{ForwardDynamicsMethod, Function, Quantity};
use crate::options::{Optimisations, Options};
use crate::program::choose::choose;
use crate::program::equivalence::{self, Disagreement, Plainer};
use crate::program::passed;
use crate::program::written::{WrittenFunction, WrittenStage, WrittenStages};
use std::collections::BTreeMap;
use straightline_core::Real;
use straightline_graph::expr::{Counts, Graph, Port};
use straightline_graph::pass::cut::{cut, Staged};
use straightline_graph::pass::{dead_code, sums};
use straightline_graph::trace::{trace, Expr};
use straightline_graph::Scalar;

/// Figures of one stage.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct StageReport {
    /// Its type's name.
    pub name: &'static str,
    /// Multiplications.
    pub mul: usize,
    /// Additions and subtractions.
    pub add: usize,
    /// Divisions.
    pub div: usize,
    /// Square roots.
    pub sqrt: usize,
    /// Sine-cosine pairs.
    pub sincos: usize,
    /// Values that it stores.
    pub stored: usize,
}

/// Operations of a function on top of its stages.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Remaining {
    /// Multiplications.
    pub mul: usize,
    /// Additions and subtractions.
    pub add: usize,
    /// Divisions.
    pub div: usize,
    /// Square roots.
    pub sqrt: usize,
}

/// Figures of the staged form.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct StagedReport {
    /// The stages, the rarest first.
    pub stages: Vec<StageReport>,
    /// What is left of each function once its stages are there.
    pub remaining: BTreeMap<&'static str, Remaining>,
    /// What is stored for inverse dynamics, if it is among the functions: H and h, or what the recursion has in common.
    pub inverse_dynamics: Option<&'static str>,
    /// What is stored for forward dynamics, if it is among the functions: the factor of H, or articulated inertias.
    pub forward_dynamics: Option<&'static str>,
}

/// How inverse dynamics is written: the recursion, or H q̈ + h with both from earlier stages.
#[derive(Clone, Copy, PartialEq, Eq)]
enum InverseForm {
    Recursion,
    MassMatrix,
}

/// A stage and its type.
#[derive(Clone, Copy, Debug)]
pub struct StageType {
    /// The identifier of the type; the last stage, which stores nothing, has none.
    pub type_name: &'static str,
    /// The name of its values where others take them.
    pub values: &'static str,
    /// What it is for.
    pub doc: &'static str,
}

const PARAMETERS: StageType =
    StageType { type_name: "Parameters", values: "parameters", doc: "What depends on run-time parameters alone." };
const CONFIGURATION: StageType = StageType {
    type_name: "Configuration",
    values: "configuration",
    doc: "What depends on the configuration q: made once per q, it serves every function of q.",
};
const VELOCITY: StageType = StageType {
    type_name: "Velocity",
    values: "velocity",
    doc: "What depends on q and q̇: made once per q̇, it serves inverse dynamics for many q̈ and forward dynamics for many tau.",
};
const MOTION: StageType = StageType {
    type_name: "Motion",
    values: "motion",
    doc:
        "What depends on a motion: q, q̇, and q̈ or tau. Made once per motion, it serves products along many directions.",
};
const CALL: StageType = StageType { type_name: "", values: "", doc: "" };

/// The programs of a staged form.
pub struct Programs {
    /// The functions, in the order of their programs.
    pub functions: Vec<Function>,
    /// The stages and the functions.
    pub staged: Staged,
    pub(crate) stages: Vec<StageType>,
    form: (InverseForm, ForwardDynamicsMethod),
}

/// Traces and cuts: of the forms that inverse and forward dynamics and the reduced robot have, those with the fewest operations
/// per call, then in the stages, then with the fewest stored values.
///
/// # Errors
/// A function whose programs all differ from its plain equations.
pub fn programs(
    robot: &Robot,
    frames: &[String],
    options: &Options,
) -> Result<(Programs, Option<Plainer>), Disagreement> {
    options.optimisations().first_that_agrees(|optimisations| {
        let made = optimised(robot, frames, options, optimisations);
        equivalence::of_stages(robot, frames, &made.functions, options, &made.staged).map(|()| made)
    })
}

fn optimised(robot: &Robot, frames: &[String], options: &Options, optimisations: Optimisations) -> Programs {
    let functions: Vec<Function> = options
        .functions
        .iter()
        .copied()
        .filter(|f| !f.is_per_frame() || !options.scene.frames_of(*f, frames).is_empty())
        .collect();
    let forms: Vec<_> = [InverseForm::MassMatrix, InverseForm::Recursion]
        .into_iter()
        .flat_map(|inverse| {
            [ForwardDynamicsMethod::Factorisation, ForwardDynamicsMethod::ArticulatedBody]
                .map(|forward| (inverse, forward))
        })
        .collect();
    let cost = |s: &Staged| {
        let flops = |graphs: &mut dyn Iterator<Item = &Graph>| graphs.map(|g| g.counts().flops()).sum::<usize>();
        let stored: usize = s.stages.iter().map(|g| g.results.len()).sum();
        (flops(&mut s.functions.iter().map(|(_, g)| g)), flops(&mut s.stages.iter()), stored)
    };
    // the form first, then what else there is to choose in it: each by itself takes the time of a trace
    let cuts = |robot: &Robot, form| {
        let (graph, stage_of, stages) = joint_program(robot, frames, (options, optimisations), &functions, form);
        let names: Vec<&str> = stages.iter().map(|s| s.values).collect();
        let blocks_of = |f: &Function| {
            let frames = options.scene.frames_of(*f, frames).len();
            options.scene.select(*f, &robot.model, frames).1.len()
        };
        let blocks: Vec<usize> = functions.iter().map(blocks_of).collect();
        let mut pieces = cut(&graph, &stage_of, &names, &blocks);
        let mut found = Vec::new();
        if optimisations.sums {
            // before the cut, where all terms are in sight, or within its pieces, which keeps stages apart
            let regroup = |graph: &Graph| {
                let graph = passed("stages: sums", "stages", sums(graph));
                passed("stages: dead code", "stages", dead_code(&graph))
            };
            found.push(cut(&regroup(&graph), &stage_of, &names, &blocks));
            let regrouped = |graph: &mut Graph| *graph = regroup(graph);
            pieces.stages.iter_mut().chain(pieces.functions.iter_mut().map(|(_, g)| g)).for_each(regrouped);
        }
        found.push(pieces);
        let best = found.into_iter().min_by_key(cost).expect("the pieces are there");
        (best, stages, form)
    };
    let of_forms = forms.iter().map(|form| cuts(robot, *form));
    let first = of_forms.min_by_key(|(s, _, _)| cost(s)).expect("there are four forms");
    let of_robots = chosen_robots(robot, frames, (options, optimisations), &functions)
        .into_iter()
        .map(|robot| cuts(&robot, first.2));
    let best = of_robots.min_by_key(|(s, _, _)| cost(s)).filter(|(s, _, _)| cost(s) < cost(&first.0));
    let (mut staged, stages, form) = best.unwrap_or(first);
    for graph in staged.stages.iter_mut().chain(staged.functions.iter_mut().map(|(_, g)| g)) {
        *graph = passed("stages: cut", "stages", std::mem::take(graph));
    }
    Programs { functions, staged, stages, form }
}

/// The robot in the reduced forms that serve one of the functions best; none where nothing is to be chosen.
fn chosen_robots(
    robot: &Robot,
    frames: &[String],
    (options, optimisations): (&Options, Optimisations),
    functions: &[Function],
) -> Vec<Robot> {
    use Function::{BiasForce, ForwardDynamics, InverseDynamics, MassMatrix};
    if !(optimisations.chosen && optimisations.reduced && robot.reduced.serves(&robot.model)) {
        return Vec::new();
    }
    let optimisations = Optimisations { chosen: false, ..optimisations };
    let of = [InverseDynamics, BiasForce, MassMatrix, ForwardDynamics].into_iter().filter(|f| functions.contains(f));
    of.map(|f| choose(robot, frames, f, options, optimisations)).collect()
}

impl Programs {
    /// What the module is to compute.
    pub(crate) fn written(self, scalar: Scalar) -> WrittenStages {
        let storing = self.stages.len() - 1;
        let program = |name: &str, graph| WrittenFunction::plain(name, graph, scalar);
        let stage = |(stage, graph): (&StageType, Graph)| WrittenStage {
            type_name: stage.type_name.to_string(),
            values: stage.values.to_string(),
            program: program(&format!("{}_values", stage.values), graph),
        };
        let function = |(f, (own, graph)): (Function, (usize, Graph))| {
            // what the last stage makes is called on the stage before it
            (own.min(storing - 1), program(f.name(), graph))
        };
        WrittenStages {
            stages: self.stages[..storing].iter().zip(self.staged.stages).map(stage).collect(),
            functions: self.functions.into_iter().zip(self.staged.functions).map(function).collect(),
        }
    }
}

/// The figures of the staged form alone.
///
/// # Errors
/// As [`programs`].
pub fn figures(robot: &Robot, frames: &[String], options: &Options) -> Result<StagedReport, Disagreement> {
    programs(robot, frames, options).map(|(programs, _)| report(&programs))
}

/// All functions in one program; the stage of each of its input ports; the stages.
fn joint_program(
    robot: &Robot,
    frames: &[String],
    (options, optimisations): (&Options, Optimisations),
    functions: &[Function],
    (inverse, forward): (InverseForm, ForwardDynamicsMethod),
) -> (Graph, Vec<usize>, Vec<StageType>) {
    let scene = &options.scene;
    let mut ports: Vec<Port> = Vec::new();
    for port in functions.iter().flat_map(|f| scene.ports(*f, &robot.model, frames)) {
        if !ports.contains(&port) {
            ports.push(port);
        }
    }
    let has_parameters = ports.iter().any(is_optional);
    // a motion is a stage of its own where something is asked of it again and again
    let has_directions = ports.iter().filter_map(Quantity::of).any(Quantity::is_of_call);
    let stages: Vec<StageType> = has_parameters
        .then_some(PARAMETERS)
        .into_iter()
        .chain([CONFIGURATION, VELOCITY])
        .chain(has_directions.then_some(MOTION))
        .chain([CALL])
        .collect();
    let first = usize::from(has_parameters);
    let stage_of = |port: &Port| match Quantity::of(port) {
        _ if is_optional(port) => 0,
        Some(Quantity::Configuration) => first,
        Some(Quantity::Velocity) => first + 1,
        Some(quantity) if has_directions && quantity.is_of_call() => first + 3,
        _ => first + 2,
    };
    let stage_of = ports.iter().map(stage_of).collect();
    let selected: Vec<(Vec<usize>, Vec<Port>)> =
        functions.iter().map(|f| scene.select(*f, &robot.model, scene.frames_of(*f, frames).len())).collect();
    let outputs = selected.iter().flat_map(|(_, ports)| ports.clone()).collect();
    let names: Vec<String> = ports.iter().map(|p| p.name.clone()).collect();
    let graph = trace(options.rules_of(optimisations), ports, outputs, |inputs| {
        let argument =
            |name: &String| inputs[names.iter().position(|n| n == name).expect("ports are the union")].clone();
        let equations = |function: Function| {
            let own: Vec<Vec<Expr>> =
                scene.ports(function, &robot.model, frames).iter().map(|p| argument(&p.name)).collect();
            let frames = scene.frames_of(function, frames);
            function.equations(robot, frames, forward, optimisations.reduced, scene, &own)
        };
        let mut results = Vec::new();
        for (function, (wanted, _)) in functions.iter().zip(&selected) {
            let all = if *function == Function::InverseDynamics && inverse == InverseForm::MassMatrix {
                let (h, bias) = (equations(Function::MassMatrix), equations(Function::BiasForce));
                let nv = bias.len();
                // what the scene knows to be at rest is so here, too
                let own: Vec<Vec<Expr>> =
                    scene.ports(*function, &robot.model, frames).iter().map(|p| argument(&p.name)).collect();
                let qdd = scene.bind(*function, robot, &own).arguments[2].clone();
                Expr::section("inverse dynamics, H q̈ + h", None);
                let row = |i: usize| (0..nv).fold(bias[i], |sum, j| sum + h[i * nv + j] * qdd[j]);
                (0..nv).map(row).collect()
            } else {
                equations(*function)
            };
            results.extend(wanted.iter().map(|k| all[*k]));
        }
        results
    });
    let graph = dead_code(&passed("stages: traced", "stages", graph));
    (passed("stages: dead code", "stages", graph), stage_of, stages)
}

pub(crate) fn report(programs: &Programs) -> StagedReport {
    let Programs { functions, staged, stages, form } = programs;
    let has = |function: Function| functions.contains(&function);
    let of = |stage: &StageType, graph: &Graph| {
        let Counts { mul, add, div, sqrt, sin_cos, .. } = graph.counts();
        StageReport { name: stage.type_name, mul, add, div, sqrt, sincos: sin_cos, stored: graph.results.len() }
    };
    let left = |graph: &Graph| {
        let Counts { mul, add, div, sqrt, .. } = graph.counts();
        Remaining { mul, add, div, sqrt }
    };
    StagedReport {
        stages: stages.iter().zip(&staged.stages).map(|(s, g)| of(s, g)).collect(),
        remaining: functions.iter().zip(&staged.functions).map(|(f, (_, g))| (f.name(), left(g))).collect(),
        inverse_dynamics: has(Function::InverseDynamics).then_some(match form.0 {
            InverseForm::MassMatrix => "H and h",
            InverseForm::Recursion => "what its recursion has in common",
        }),
        forward_dynamics: has(Function::ForwardDynamics).then_some(match form.1 {
            ForwardDynamicsMethod::Factorisation => "the factor of H",
            _ => "articulated inertias",
        }),
    }
}
