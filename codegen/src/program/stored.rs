//! Programs that were made before: found by what they were made of, and checked as those are that are made now.

use crate::equations::bind::is_optional;
use crate::equations::Robot;
use crate::function::Function;
use crate::options::Options;
use crate::program::{equivalence, TracedProgram};
use straightline_graph::expr::{verify, Graph, Sines};

/// Keeps the graphs of programs, such as on a disk, for who compiles the same robot again.
///
/// What it finds is trusted in nothing: it is taken only if it keeps what graphs promise, has the inputs and results of the function, and
/// agrees with the plain equations of the robot, in double-double and in its own scalar.
pub trait ProgramStore: Sync {
    /// Whether it ever has anything: otherwise no key is made.
    fn keeps(&self) -> bool {
        true
    }

    /// The graph that was kept by that key.
    fn find(&self, key: u64) -> Option<Graph>;

    /// Keeps a graph.
    fn keep(&self, key: u64, graph: &Graph);
}

/// Keeps nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoStore;

impl ProgramStore for NoStore {
    fn keeps(&self) -> bool {
        false
    }

    fn find(&self, _: u64) -> Option<Graph> {
        None
    }

    fn keep(&self, _: u64, _: &Graph) {}
}

/// The program of a graph that was kept, if it is one of this function. Why forward dynamics has its method is not kept.
pub(crate) fn accepted(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    graph: Graph,
) -> Option<TracedProgram> {
    let robot = &robot.clone().knowing_base_parameters(&[function], &options.scene);
    let is_plain = graph.formats.is_empty() && (graph.sines == Sines::Precise || options.wants_short_sines(function));
    if !is_plain || verify(&graph).is_err() {
        return None;
    }
    let ports = options.scene.ports(function, &robot.model, frames);
    let (_, outputs) = options.scene.select(function, &robot.model, options.scene.frames_of(function, frames).len());
    let taken = ports.iter().filter(|port| graph.inputs.contains(port) || !is_optional(port));
    if !taken.eq(&graph.inputs) || outputs != graph.outputs {
        return None;
    }
    equivalence::of_function(robot, frames, function, options, options.optimisations(), &graph).ok()?;
    Some(TracedProgram::scheduled(function, graph, options))
}
