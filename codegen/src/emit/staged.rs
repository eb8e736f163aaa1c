//! The functions in stages, before they are text.

use super::module::StagedModule;
use super::{Lowering, Routine};
use crate::equations::Robot;
use crate::function::Function;
use crate::options::Options;
use crate::program::equivalence::{Disagreement, Plainer};
use crate::program::nonzeros::{packed, NonzeroEntries};
use crate::program::staged::{programs, report, StagedReport};
use crate::program::written::WrittenStages;
use std::collections::BTreeMap;
use straightline_graph::expr::{Graph, Port};
use straightline_graph::schedule::schedule;

/// The module `staged`, its figures, what is plainer, and its programs; of functions with `entries` these alone are put out.
///
/// # Errors
/// As [`programs`].
pub(super) fn staged(
    robot: &Robot,
    frames: &[String],
    entries: &BTreeMap<Function, Vec<NonzeroEntries>>,
    (options, lowering): (&Options, Lowering<'_>),
) -> Result<(StagedModule, StagedReport, Option<Plainer>, WrittenStages), Disagreement> {
    let (mut programs, plainer) = programs(robot, frames, options)?;
    for (function, (_, graph)) in programs.functions.iter().zip(&mut programs.staged.functions) {
        if let Some(entries) = entries.get(function) {
            *graph = packed(graph, entries);
        }
    }
    let private = |graph: &Graph, name: &str, doc: &str| {
        lowering
            .routine(graph, &schedule(graph, options.limits, options.schedule_machine().as_ref()), name, doc)
            .private()
    };
    let storing = programs.stages.iter().take(programs.stages.len() - 1).zip(&programs.staged.stages);
    let values = storing.map(|(stage, graph)| {
        let doc = format!("The values of a [`{}`].", stage.type_name);
        private(graph, &format!("{}_values", stage.values), &doc)
    });
    let functions = programs.functions.iter().zip(&programs.staged.functions);
    let module = StagedModule {
        stages: programs.stages.clone(),
        values: values.collect(),
        functions: functions.map(|(f, (s, graph))| (*f, *s, private(graph, f.name(), f.summary()))).collect(),
    };
    let report = report(&programs);
    Ok((module, report, plainer, programs.written(options.scalar)))
}

impl StagedModule {
    fn routines(&self) -> impl Iterator<Item = &Routine> {
        self.values.iter().chain(self.functions.iter().map(|(_, _, routine)| routine))
    }

    /// Whether a function calls the kernel of sines, cosines and roots.
    pub fn calls_kernel(&self) -> bool {
        self.routines().any(Routine::calls_kernel)
    }

    /// Whether a function takes a parameter of that type.
    pub fn takes(&self, type_name: &str) -> bool {
        let takes = |p: &Port| p.wrapper.as_deref() == Some(type_name);
        self.routines().any(|r| r.ports.inputs.iter().any(takes))
    }
}
