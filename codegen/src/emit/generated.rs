//! What the compiler makes of a robot file: from programs to text.

use crate::choices::Lanes;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::emit::error_bound::error_bound_text;
use crate::emit::parameter::parameter_types;
use crate::emit::staged::staged;
use crate::emit::{self, Item, Provenance, Style};
use crate::equations::Robot;
use crate::function::Judged;
use crate::identifier::file_name;
use crate::options::Options;
use crate::program::companion::{checked_companion, wants_companions, ROUNDED};
use crate::program::equivalence::Disagreement;
use crate::program::written::{AllWritten, Written};
use crate::program::Program;
use crate::report::errors::ErrorReport;
use crate::report::waterfall::Waterfall;
use crate::report::{FunctionReport, Report};
use crate::scene::{self, Parameter};
use std::collections::BTreeMap;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::Section;
use straightline_graph::{certify, Scalar};

/// What the compiler makes of a robot file.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The robot.
    pub model: Model<Dd>,
    /// The frames of the functions that answer per frame.
    pub frames: Vec<String>,
    /// The source: items without inner attributes, for `include!`, a module, or a file of its own.
    pub text: String,
    /// The types of its run-time parameters.
    pub types: String,
    /// The functions of that source, one by one.
    pub items: Vec<Item>,
    /// The scalar type.
    pub scalar: Scalar,
    /// The same in the other scalar types that were asked for; [`Generated::text`] has them as modules.
    pub others: Vec<Generated>,
    /// How its functions over lanes are written.
    pub style: Style,
    /// How its plain functions are written.
    pub plain_style: Style,
    /// Whether functions over lanes and batches stand beside the plain ones.
    pub lanes: Option<Lanes>,
    /// Where it came from.
    pub provenance: Provenance,
    /// Its figures.
    pub report: Report,
    /// What was assumed on the way.
    pub warnings: Diagnostics,
    /// What its text is to compute: [`readback`](crate::readback) compares.
    pub programs: AllWritten,
}

/// The rest of the pipeline: from programs to text.
#[allow(clippy::too_many_arguments)]
pub(crate) fn generate(
    robot: Robot,
    frames: Vec<String>,
    programs: Vec<(Program, Option<Waterfall>, Option<ErrorReport>)>,
    mut warnings: Diagnostics,
    options: &Options,
    path: &str,
    hash: u64,
) -> Result<Generated, Disagreement> {
    let model = &robot.model;
    let title = |section: Section| match section.index {
        Some(i) => format!("{}, body {}: {}", section.phase, i + 1, model.bodies[i].name),
        None => section.phase.to_string(),
    };
    let mut items = Vec::new();
    let mut functions = BTreeMap::new();
    let mut written = AllWritten::default();
    for (program, waterfall, errors) in programs {
        let Program { function, graph, schedule, method, .. } = &program;
        let mut doc = function.doc(&graph.inputs, &options.scene);
        if let Some(method) = method {
            doc.push_str(&format!("\n{method}\n"));
        }
        if !graph.formats.is_empty() {
            let wide = certify::mixed::wide_operations(graph, options.scalar);
            let (all, wider) = (graph.counts().flops(), graph.widest(options.scalar).name());
            doc.push_str(&format!("\n{wide} of its {all} operations are in {wider}: what its error budget takes.\n"));
        }
        let mut text = emit::function(graph, schedule, function.name(), &doc, options.plain_style(), &title);
        let figures = FunctionReport::new(&program, options.scalar, text.text.lines().count());
        if wants_companions(options) {
            let (bound, plainer) = match program.has_folded_constants(options) {
                true => checked_companion(&robot, *function, graph, options)?,
                false => (Err(ROUNDED), None),
            };
            plainer.iter().for_each(|p| warnings.push(p.warning(model)));
            let by_residual = function.spec().judged == Judged::ByResidual;
            let bound = error_bound_text(bound, (function.name(), by_residual), graph, options, &mut written.functions);
            text.text.push('\n');
            text.text.push_str(&bound.text);
            text.uses_sin_cos |= bound.uses_sin_cos;
            text.uses_sqrt |= bound.uses_sqrt;
        }
        functions.insert(function.name(), FunctionReport { waterfall, errors, ..figures });
        let Program { function, graph, schedule, .. } = program;
        let (inputs, outputs) = (graph.inputs.clone(), graph.outputs.clone());
        let mut item = Item { function, inputs, outputs, doc, text, lanes: String::new() };
        if let Some(lanes) = options.lanes {
            item.lanes = emit::batch::lanes(&item, (&graph, &schedule), options.style(), lanes, &title);
        }
        items.push(item);
        written.functions.push(Written {
            name: function.name().to_string(),
            graph,
            scalar: options.scalar,
            generic: options.generic,
            lanes: options.lanes.is_some(),
        });
    }
    let crate::emit::contact::ContactModule { text: contact_text, reports: contact, plainer, programs: modes } =
        crate::emit::contact::module(&robot, options, &title)?;
    written.modes = modes;
    plainer.iter().for_each(|p| warnings.push(p.warning(model)));
    let staged = options.scene.staged.then(|| staged(&robot, &frames, options, &title)).transpose()?;
    let (staged_text, staged_report) = match staged {
        Some((text, report, plainer, programs)) => {
            written.staged = Some(programs);
            plainer.iter().for_each(|p| warnings.push(p.warning(model)));
            (text, Some(report))
        }
        None => (String::new(), None),
    };
    let report = Report {
        robot: model.name.clone(),
        nq: model.nq(),
        nv: model.nv(),
        scalar: options.scalar.name(),
        functions,
        staged: staged_report,
        contact,
    };
    // the file's name, not its path: the same bytes on every machine
    let name = file_name(path).to_string();
    let remark = |d: &Diagnostic| match &d.place {
        Some(place) => format!("{} (line {} of {})", d.title, place.line, file_name(&place.file)),
        None => d.title.clone(),
    };
    let remarks = warnings.iter().map(remark).collect();
    let ranges = scene::ranges_in_words(&options.scene, model);
    let provenance = Provenance { source: name.clone(), hash, remarks, ranges };
    let takes = |parameter: &Parameter| {
        let name = parameter.type_name();
        let ports = || items.iter().flat_map(|item| &item.inputs);
        ports().any(|port| port.wrapper.as_ref() == Some(&name))
            || (staged_text.clone() + &contact_text).contains(&format!("&{name}"))
    };
    let generic = if options.generic { emit::GENERIC } else { "" };
    let types = parameter_types(&robot, options, &takes, &mut written.parameters)? + &staged_text + &contact_text;
    let before = generic.to_string() + &types;
    let text = emit::file(model, &frames, &items, &report, &provenance, options.style(), &before, options.lanes);
    Ok(Generated {
        model: robot.model,
        frames,
        text,
        types,
        items,
        scalar: options.scalar,
        others: Vec::new(),
        style: options.style(),
        plain_style: options.plain_style(),
        lanes: options.lanes,
        provenance,
        report,
        warnings,
        programs: written,
    })
}
