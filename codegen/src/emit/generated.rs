//! What the compiler makes of a robot file: from programs to text.

use super::contact::{contact, ContactModule};
use super::doc::{self, lanes_doc, lanes_name};
use super::error_bound::error_bound;
use super::module::{Item, ModeModule, ParameterType, StagedModule, StateCertificate};
use super::parameter::parameter_types;
use super::staged::staged;
use super::{rust, Lowering, Routine, Style};
use crate::choices::{Lanes, Memory, TargetMachine, WrittenEntries};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::equations::Robot;
use crate::function::Function;
use crate::identifier::file_name;
use crate::machine_code::MachineFigures;
use crate::options::Options;
use crate::program::companion::{checked_companion, wants_companions, ROUNDED};
use crate::program::equivalence::Disagreement;
use crate::program::fixed::FixedFunction;
use crate::program::nonzeros::NonzeroEntries;
use crate::program::self_test::SelfTest;
use crate::program::written::{AllWritten, WrittenFunction};
use crate::program::TracedProgram;
use crate::report::errors::ErrorReport;
use crate::report::waterfall::Waterfall;
use crate::report::{FunctionReport, Report};
use crate::scene::{self, Parameter, Scene};
use std::collections::BTreeMap;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::{Graph, Section};
use straightline_graph::schedule::{Schedule, ScheduleLimits};
use straightline_graph::{certify, Scalar};

/// Where a file came from, for its header.
#[derive(Clone, Debug)]
pub struct Provenance {
    /// Path of the robot file, as the user wrote it.
    pub source: String,
    /// Hash of everything that the output depends on.
    pub hash: u64,
    /// What the reader of the file should know: special angles taken as exact, warnings.
    pub remarks: Vec<String>,
    /// The ranges of inputs that a scene states, a line each.
    pub ranges: Vec<String>,
}

/// What the compiler makes of a robot file.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The robot.
    pub model: Model<Dd>,
    /// The frames of the functions that answer per frame.
    pub frames: Vec<String>,
    /// The source: items without inner attributes, for `include!`, a module, or a file of its own.
    pub text: String,
    /// The functions of that source, one by one.
    pub items: Vec<Item>,
    /// The types of its run-time parameters.
    pub parameters: Vec<ParameterType>,
    /// Its functions in stages, where they are asked for.
    pub staged: Option<StagedModule>,
    /// Its functions in contact, mode by mode.
    pub contact: Vec<ModeModule>,
    /// The scalar type.
    pub scalar: Scalar,
    /// The same in the other scalar types that were asked for; [`Generated::text`] has them as modules.
    pub others: Vec<Generated>,
    /// The same over integers, where that is asked for; [`Generated::text`] has them as the module `fixed`.
    pub fixed: Vec<FixedFunction>,
    /// How its functions over lanes are written.
    pub style: Style,
    /// How its plain functions are written.
    pub plain_style: Style,
    /// Whether functions over lanes and batches stand beside the plain ones.
    pub lanes: Option<Lanes>,
    /// How long the parts of its functions may be.
    pub limits: ScheduleLimits,
    /// The machine that it is made for.
    pub target: Option<TargetMachine>,
    /// The memory that it runs from there.
    pub memory: Memory,
    /// The rustc that figures of machine code are of, where they stand in the text.
    pub rustc: Option<String>,
    /// Where it came from.
    pub provenance: Provenance,
    /// Its figures.
    pub report: Report,
    /// What was assumed on the way.
    pub warnings: Diagnostics,
    /// What its text is to compute: [`readback`](crate::readback) compares.
    pub programs: AllWritten,
}

impl Generated {
    /// Whether a function calls the kernel of sines, cosines and roots.
    pub fn calls_kernel(&self) -> bool {
        self.items.iter().any(Item::calls_kernel)
            || self.parameters.iter().any(|p| p.constructor.calls_kernel())
            || self.staged.as_ref().is_some_and(StagedModule::calls_kernel)
            || self.contact.iter().flat_map(|mode| &mode.items).any(Item::calls_kernel)
    }

    /// Whether there is more than constants and functions of one scalar, which are all that a type can have associated: types of
    /// parameters and stages, or further scalars.
    pub fn needs_a_module(&self) -> bool {
        let has_types =
            !self.fixed.is_empty() || !self.parameters.is_empty() || self.staged.is_some() || !self.contact.is_empty();
        has_types || !self.others.is_empty()
    }

    /// The same in further scalar types, as modules of the text.
    #[must_use]
    pub fn with_others(mut self, others: Vec<Generated>) -> Generated {
        self.text.extend(others.iter().map(rust::scalar_module));
        Generated { others, ..self }
    }

    /// The same with figures of machine code per function, which the text has as constants where the compiler is said.
    #[must_use]
    pub(crate) fn with_figures(
        mut self,
        figures: Vec<(&'static str, MachineFigures)>,
        rustc: Option<String>,
    ) -> Generated {
        for (name, figures) in figures {
            self.report.functions.entry(name).and_modify(|f| f.machine = Some(figures));
        }
        self.rustc = rustc;
        match self.rustc.is_some() {
            true => Generated { text: rust::file(&self), ..self },
            false => self,
        }
    }

    /// The same in fixed point, as a module of the text.
    #[must_use]
    pub(crate) fn with_fixed(mut self, fixed: Vec<FixedFunction>) -> Generated {
        if !fixed.is_empty() {
            self.text.push_str(&rust::fixed_module(&fixed));
        }
        Generated { fixed, ..self }
    }
}

/// A function of the robot, in all its forms; what is plainer than it was to be is among the warnings.
fn item(
    robot: &Robot,
    program: &TracedProgram,
    (options, lowering): (&Options, Lowering<'_>),
    warnings: &mut Diagnostics,
    written: &mut Vec<WrittenFunction>,
) -> Result<Item, Disagreement> {
    let TracedProgram { function, graph, schedule, method, .. } = program;
    let mut doc = function.doc(&graph.inputs, &options.scene);
    if let Some(method) = method {
        doc.push_str(&format!("\n{method}\n"));
    }
    if !graph.formats.is_empty() {
        let wide = certify::mixed::wide_operations(graph, options.scalar);
        let (all, wider) = (graph.counts().flops(), graph.widest(options.scalar).name());
        doc.push_str(&format!("\n{wide} of its {all} operations are in {wider}: what its error budget takes.\n"));
    }
    doc.push_str(&doc::of_entries(*function, &program.entries, options));
    let mut of_state = None;
    if wants_companions(options) {
        let (bound, plainer) = match program.has_folded_constants(options) {
            true => checked_companion(robot, *function, graph, options)?,
            false => (Err(ROUNDED), None),
        };
        plainer.iter().for_each(|p| warnings.push(p.warning(&robot.model)));
        of_state = Some(error_bound(
            bound,
            (function.name(), function.spec().judged),
            graph,
            (options, lowering.target),
            written,
        ));
    }
    let named = (*function, function.name(), &doc[..]);
    Ok(Item::new(named, (graph, schedule), of_state, (options, lowering)))
}

impl<F> Item<F> {
    /// A function with its name and documentation, in the forms that are asked for.
    pub(super) fn new(
        (function, name, doc): (F, &str, &str),
        (graph, schedule): (&Graph, &Schedule),
        bound: Option<StateCertificate>,
        (options, lowering): (&Options, Lowering<'_>),
    ) -> Item<F> {
        let plain = Lowering { style: options.plain_style(), ..lowering };
        let routine = plain.routine(graph, schedule, name, doc);
        let text = lowering.target.routine(&routine);
        let lanes = options.lanes.map(|_| in_lanes(name, (graph, schedule), lowering));
        Item { function, routine, text, bound, lanes }
    }
}

/// The body of a function over lanes: the public function, or one that is also told whether to fuse.
fn in_lanes(name: &str, (graph, schedule): (&Graph, &Schedule), lowering: Lowering<'_>) -> Routine {
    let lowering = Lowering { style: lowering.style.lanes(), ..lowering };
    let public = lanes_name(name);
    match lowering.style.fused {
        false => lowering.routine(graph, schedule, &public, &lanes_doc(name)),
        true => {
            let doc = format!("[`{public}`], fused as the caller says.");
            lowering.routine(graph, schedule, &format!("{name}_in_lanes"), &doc).private()
        }
    }
}

/// The rest of the pipeline: from programs to text.
#[allow(clippy::too_many_arguments)]
pub(crate) fn generate(
    robot: Robot,
    frames: Vec<String>,
    programs: Vec<(TracedProgram, Option<Waterfall>, Option<ErrorReport>)>,
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
    let lowering = Lowering { style: options.style(), target: &rust::Rust, title: &title };
    let mut items = Vec::new();
    let mut functions = BTreeMap::new();
    let mut written = AllWritten::default();
    let entries = packed_entries(&programs, options);
    for (program, waterfall, errors) in programs {
        let item = item(&robot, &program, (options, lowering), &mut warnings, &mut written.functions)?;
        let figures = FunctionReport::new(&program, options, item.text.lines().count());
        functions.insert(program.function.name(), FunctionReport { waterfall, errors, ..figures });
        items.push(item);
        written.functions.push(WrittenFunction::asked_for(program.function.name(), program.graph, options));
    }
    let ContactModule { modes, reports, plainer, programs } = contact(&robot, options, lowering)?;
    written.modes = programs;
    plainer.iter().for_each(|p| warnings.push(p.warning(model)));
    let staged = options.scene.staged.then(|| staged(&robot, &frames, &entries, (options, lowering))).transpose()?;
    let staged = staged.map(|(module, report, plainer, programs)| {
        written.staged = Some(programs);
        plainer.iter().for_each(|p| warnings.push(p.warning(model)));
        (module, report)
    });
    let (staged, staged_report) = staged.unzip();
    let report = Report {
        robot: model.name.clone(),
        nq: model.nq(),
        nv: model.nv(),
        scalar: options.scalar.name(),
        functions,
        staged: staged_report,
        contact: reports,
    };
    let provenance = provenance(model, &options.scene, (path, hash), &warnings);
    let takes = |parameter: &Parameter| {
        let name = parameter.type_name();
        let of_contact = modes.iter().flat_map(|mode| &mode.items).flat_map(Item::inputs);
        let mut ports = items.iter().flat_map(Item::inputs).chain(of_contact);
        ports.any(|port| port.wrapper.as_ref() == Some(&name)) || staged.as_ref().is_some_and(|s| s.takes(&name))
    };
    let parameters;
    (parameters, written.parameters) = parameter_types(&robot, options, &takes, lowering)?;
    written.self_test = options.self_test.then(|| SelfTest::new(&written, &options.scene, model, options.scalar));
    let generated = Generated {
        model: robot.model,
        frames,
        text: String::new(),
        items,
        parameters,
        staged,
        contact: modes,
        scalar: options.scalar,
        others: Vec::new(),
        fixed: Vec::new(),
        style: options.style(),
        plain_style: options.plain_style(),
        lanes: options.lanes,
        limits: options.limits,
        target: options.target,
        memory: options.memory,
        rustc: None,
        provenance,
        report,
        warnings,
        programs: written,
    };
    Ok(Generated { text: rust::file(&generated), ..generated })
}

/// Of functions that put out some entries of their matrices alone: which.
fn packed_entries<X, Y>(
    programs: &[(TracedProgram, X, Y)],
    options: &Options,
) -> BTreeMap<Function, Vec<NonzeroEntries>> {
    match options.entries {
        WrittenEntries::Nonzeros => programs.iter().map(|(p, ..)| (p.function, p.entries.clone())).collect(),
        WrittenEntries::All | WrittenEntries::Patterns => BTreeMap::new(),
    }
}

/// Where the file comes from.
fn provenance(model: &Model<Dd>, scene: &Scene, (path, hash): (&str, u64), warnings: &Diagnostics) -> Provenance {
    let remark = |d: &Diagnostic| match &d.place {
        Some(place) => format!("{} (line {} of {})", d.title, place.line, file_name(&place.file)),
        None => d.title.clone(),
    };
    Provenance {
        // the file's name, not its path: the same bytes on every machine
        source: file_name(path).to_string(),
        hash,
        remarks: warnings.iter().map(remark).collect(),
        ranges: scene::ranges_in_words(scene, model),
    }
}
