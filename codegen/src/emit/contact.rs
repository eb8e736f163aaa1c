//! The functions of contact modes, before they are text.

use super::doc::of_contact;
use super::error_bound::error_bound;
use super::module::{Item, ModeModule};
use super::Lowering;
use crate::equations::Robot;
use crate::options::Options;
use crate::program::companion::{bound, wants_companions};
use crate::program::contact::{programs, Mode, ModeProgram};
use crate::program::equivalence::{Disagreement, Plainer};
use crate::program::written::{WrittenFunction, WrittenMode};
use crate::report::ContactReport;
use straightline_graph::schedule::schedule;

/// All modes.
#[derive(Default)]
pub(super) struct ContactModule {
    /// Their functions.
    pub modes: Vec<ModeModule>,
    /// The figures of their functions.
    pub reports: Vec<ContactReport>,
    /// Functions that are computed more plainly than they were to be.
    pub plainer: Vec<Plainer>,
    /// What they are to compute.
    pub programs: Vec<WrittenMode>,
}

/// All modes of a scene.
///
/// # Errors
/// A function whose programs all differ from its plain equations.
pub(super) fn contact(robot: &Robot, options: &Options, lowering: Lowering<'_>) -> Result<ContactModule, Disagreement> {
    let mut out = ContactModule::default();
    for mode in &Mode::all(&options.scene) {
        let (mut items, mut functions) = (Vec::new(), Vec::new());
        for ModeProgram { function, graph, plainer } in programs(robot, options, mode)? {
            out.plainer.extend(plainer);
            let counts = graph.counts();
            let doc = format!(
                "{}\n{} mul, {} add, {} div, {} sqrt, {} pairs of sine and cosine.\n",
                of_contact(function, (mode, &options.scene), &graph),
                counts.mul,
                counts.add,
                counts.div,
                counts.sqrt,
                counts.sin_cos
            );
            let (name, schedule) =
                (function.name(), schedule(&graph, options.limits, options.schedule_machine().as_ref()));
            let mut of_state = None;
            if wants_companions(options) {
                let (bound, plainer) = bound(robot, options, mode, function, &graph)?;
                out.plainer.extend(plainer);
                let names = (name, function.spec().judged);
                of_state = Some(error_bound(bound, names, &graph, (options, lowering.target), &mut functions));
            }
            out.reports.push(ContactReport::new(&mode.identifier, name, counts));
            items.push(Item::new((function, name, &doc), (&graph, &schedule), of_state, (options, lowering)));
            functions.push(WrittenFunction::asked_for(name, graph, options));
        }
        let (constrained, free) = (mode.constrained_names(), mode.free_names());
        out.programs.push(WrittenMode {
            identifier: mode.identifier.clone(),
            coordinates: [constrained.clone(), free.clone()],
            functions,
        });
        let (identifier, name) = (mode.identifier.clone(), mode.name.clone());
        out.modes.push(ModeModule { identifier, name, constrained, free, items });
    }
    Ok(out)
}
