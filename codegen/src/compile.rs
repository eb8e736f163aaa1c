//! The pipeline, as one function.

use crate::choose::{self, choose, price};
use crate::contact;
use crate::description::drives::Drive;
use crate::description::{self, messages, Description};
use crate::diagnostic::{Diagnostic, Diagnostics, Reporting, Source};
use crate::emit::{self, Item, Lanes, Provenance, Scalar, Style};
use crate::equivalence::{self, Disagreement, Plainer};
use crate::forward_method::{self, MethodChoice};
use crate::function::{ForwardDynamicsMethod, Function, Robot};
use crate::input_box::input_box;
use crate::limbs::{self, LimbForm};
use crate::model;
use crate::pivots;
use crate::range;
use crate::readback::{self, DriveNumbers, ParameterProgram, Programs};
use crate::report::budget::{self, Measures};
use crate::report::errors::{ErrorReport, ROUNDED};
use crate::report::waterfall::{self, Waterfall};
use crate::report::{FunctionReport, Report};
use crate::scene::free_drive::FreeDrive;
use crate::scene::{self, constructed, is_optional, Parameter, Scene};
use crate::singular;
use crate::stable::{fnv_1a, Stable};
use crate::staged::{self, staged};
use std::collections::BTreeMap;
use std::fmt::Write;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::certify::companion::Bits;
use straightline_graph::certify::{self, Effort, Known};
use straightline_graph::expr::{verify, Counts, Folding, Grade, Graph, NodeId, Port, RuleSet, Section};
use straightline_graph::pass::{count_sums, dead_code, order, substitute, sums, unread_inputs};
use straightline_graph::schedule::{schedule, Limits, Schedule};
use straightline_graph::trace::trace;

/// What to generate, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// The functions, without repetition.
    pub functions: Vec<Function>,
    /// The frames of the functions that answer per frame; none: the tips of the robot.
    pub frames: Vec<String>,
    /// The scalar type.
    pub scalar: Scalar,
    /// Other scalar types: for each a module with the same items ([`Scalar::module`]).
    pub also: Vec<Scalar>,
    /// Whether functions over lanes and batches of states stand beside the plain ones.
    pub lanes: Option<Lanes>,
    /// Whether a·b + c is one operation, with one rounding, where the machine has it.
    pub fma: bool,
    /// Whether that operation comes from the crate around the output, as `crate::mul_add_f64` (of f32 `crate::mul_add_f32`): the
    /// output needs `core` alone then.
    pub fma_by_caller: bool,
    /// Whether plain functions take any scalar that is a `straightline::Real`; lanes, batches and stages keep `scalar`.
    pub generic: bool,
    /// The weakest rules allowed: with [`Grade::Exact`] the output is the generic runtime bit for bit.
    pub grade: Grade,
    /// How forward dynamics is computed.
    pub forward_dynamics: ForwardDynamicsMethod,
    /// How identical limbs are computed.
    pub limbs: LimbForm,
    /// How long one function may be.
    pub limits: Limits,
    /// How the robot file is read.
    pub model: crate::model::ModelOptions,
    /// What is wanted and what is held.
    pub scene: Scene,
    /// Whether rounding errors are bounded, and how much is spent on it; a budget of an error bounds them, too.
    pub certify: Option<Effort>,
    /// What becomes of warnings, and in whose words they are said: nothing of what is generated.
    pub reporting: Reporting,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            functions: Function::all().collect(),
            frames: Vec::new(),
            scalar: Scalar::F64,
            also: Vec::new(),
            lanes: None,
            fma: false,
            fma_by_caller: false,
            generic: false,
            grade: Grade::Algebraic,
            forward_dynamics: ForwardDynamicsMethod::default(),
            limbs: LimbForm::default(),
            limits: Limits::default(),
            model: crate::model::ModelOptions::default(),
            scene: Scene::default(),
            certify: None,
            reporting: Reporting::default(),
        }
    }
}

impl Options {
    /// The same options, whose scene knows the drives of a robot file as far as it names them. What is wrong with the file is said elsewhere.
    #[must_use]
    pub fn knowing(&self, source: &Source) -> Options {
        if !self.scene.parameters.iter().any(|p| !p.is_load()) {
            return self.clone();
        }
        let description = description::read(source, &mut Diagnostics::new());
        self.knowing_drives(description.as_ref().map_or(&[], |d| &d.drives))
    }

    /// The same with the drives as they were read.
    fn knowing_drives(&self, drives: &[Drive]) -> Options {
        Options { scene: self.scene.knowing(drives), ..self.clone() }
    }

    /// The optimisations that these options allow.
    pub fn optimisations(&self) -> Optimisations {
        let algebraic = self.grade == Grade::Algebraic;
        // one method for all scenes of a robot, where bits count
        let cheaper = algebraic && self.forward_dynamics == ForwardDynamicsMethod::Cheaper;
        Optimisations {
            folding: algebraic,
            algebraic,
            reduced: algebraic,
            sums: algebraic,
            chosen: algebraic,
            forms: if algebraic { Forms::ALL } else { Forms::default() },
            angle_sums: algebraic,
            cheaper,
            limbs: algebraic && self.limbs != LimbForm::Apart,
            substitutes: algebraic,
        }
    }

    /// How functions over lanes and the programs inside types are written.
    pub fn style(&self) -> Style {
        Style::plain(self.scalar).fused(self.fma).by_caller(self.fma_by_caller)
    }

    /// How plain functions are written.
    pub fn plain_style(&self) -> Style {
        match self.generic {
            true => self.style().generic(),
            false => self.style(),
        }
    }

    /// The rewrite rules that these options allow.
    pub fn rules(&self) -> RuleSet {
        self.rules_of(self.optimisations())
    }

    pub(crate) fn rules_of(&self, optimisations: Optimisations) -> RuleSet {
        optimisations.rules(self.scalar).with_short_angles(self.generic || self.scalar == Scalar::F32)
    }
}

/// What [`program`] does beyond writing the equations down, one by one, so that each can be weighed. Without any of them a
/// program is the generic runtime unrolled: equal subexpressions once, no products with zero and one, nothing that no
/// result needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Optimisations {
    /// Constants are folded in double-double, so that what is zero or one is exactly that.
    pub folding: bool,
    /// Rules that are equal over the reals only.
    pub algebraic: bool,
    /// The reduced robot where it serves: frames along common normals, inertial parameters regrouped.
    pub reduced: bool,
    /// Sums with all their terms at once: [`sums`].
    pub sums: bool,
    /// Of the forms that the reduced robot has, those with the fewest operations: [`choose`](choose()).
    pub chosen: bool,
    /// What is free in those forms.
    pub forms: Forms,
    /// Among those forms ones with sums of angles, whose rounding errors go into the reduction of the angle.
    pub angle_sums: bool,
    /// The cheaper of the two forms of forward dynamics.
    pub cheaper: bool,
    /// Identical limbs as lanes of one body, where the options have them so: [`limbs`].
    pub limbs: bool,
    /// Values of the mass matrix, and of forward dynamics, formed of others that are there anyway: [`substitute`].
    pub substitutes: bool,
}

/// What [`choose`](choose()) may choose, one by one, so that each can be weighed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Forms {
    /// Tips and chains of parallel joints are described in axes that do not turn.
    pub stays: bool,
    /// Origins are at either foot of the common normals.
    pub origins: bool,
    /// Tips are turned so that a parameter vanishes.
    pub tips: bool,
    /// Inertial parameters vanish here or at the parent, or are not moved.
    pub parameters: bool,
    /// The equations of a body's rotation have several forms.
    pub rotations: bool,
    /// The unit of length is one that makes a number one.
    pub unit: bool,
}

impl Forms {
    /// All of them.
    pub const ALL: Forms =
        Forms { stays: true, origins: true, tips: true, parameters: true, rotations: true, unit: true };
}

impl Optimisations {
    /// From none of them to these, one more at each step, with its words.
    pub fn steps(self) -> Vec<(&'static str, Optimisations)> {
        let mut now = Optimisations::default();
        let mut steps = Vec::new();
        let mut step = |what, on: bool, switch: fn(&mut Optimisations)| {
            if on {
                switch(&mut now);
                steps.push((what, now));
            }
        };
        step(FOLDING, self.folding, |o| o.folding = true);
        step("algebraic rules", self.algebraic, |o| o.algebraic = true);
        step("reduced robot: frames and inertial parameters", self.reduced, |o| o.reduced = true);
        step("sums with all their terms at once", self.sums, |o| o.sums = true);
        step("forms of the reduced robot chosen by counting", self.chosen, |o| {
            (o.chosen, o.forms) = (true, Forms::ALL)
        });
        step("angles of parallel joints added", self.chosen && self.angle_sums, |o| o.angle_sums = true);
        step("the cheaper form of forward dynamics", self.cheaper, |o| o.cheaper = true);
        step("identical limbs as lanes of one body", self.limbs, |o| o.limbs = true);
        step("values formed of others that are there", self.substitutes, |o| o.substitutes = true);
        steps
    }

    /// Without any of them but exact folding: the equations as they are.
    pub(crate) fn plain(self) -> Optimisations {
        Optimisations { folding: self.folding, ..Optimisations::default() }
    }

    /// Plainer and plainer, each with what was left out last.
    fn plainer(self) -> Vec<(&'static str, Optimisations)> {
        let mut now = self;
        let mut found = vec![("", now)];
        let mut step = |what, off: fn(&mut Optimisations)| {
            let before = now;
            off(&mut now);
            if now != before {
                found.push((what, now));
            }
        };
        step("identical limbs as lanes of one body", |o| o.limbs = false);
        step("values formed of others that are there", |o| o.substitutes = false);
        step("sums with all their terms at once", |o| o.sums = false);
        step("forms of the reduced robot", |o| (o.chosen, o.forms, o.angle_sums) = (false, Forms::default(), false));
        step("the reduced robot", |o| o.reduced = false);
        step("algebraic rules and the cheaper form of forward dynamics", |o| *o = o.plain());
        step(FOLDING, |o| o.folding = false);
        found
    }

    /// What `make` makes by the first of these that it is content with; all of them, then plainer ones.
    ///
    /// # Errors
    /// What was wrong at first, if it is content with none; or what the plainest loses to rounding.
    pub(crate) fn first_that_agrees<T>(
        self,
        mut make: impl FnMut(Optimisations) -> Result<T, Disagreement>,
    ) -> Result<(T, Option<Plainer>), Disagreement> {
        let (mut first, mut last) = (None, None);
        for (without, optimisations) in self.plainer() {
            // what is left is the generic runtime, which has no more digits
            if without == FOLDING && last.as_ref().is_some_and(Disagreement::is_of_the_robot) {
                break;
            }
            match make(optimisations) {
                Ok(made) => return Ok((made, first.map(|disagreement| Plainer { disagreement, without }))),
                Err(disagreement) => {
                    first.get_or_insert_with(|| disagreement.clone());
                    last = Some(disagreement);
                }
            }
        }
        // the plainest form against the plain equations in the same scalar: that says most of the robot
        let of_digits = last.filter(|disagreement| disagreement.plain.is_some());
        Err(of_digits.or(first).expect("all of them were tried"))
    }

    pub(crate) fn rules(self, scalar: Scalar) -> RuleSet {
        match (self.algebraic, self.folding, scalar) {
            (true, _, _) => RuleSet::all(),
            (false, true, _) => RuleSet::exact(Folding::DoubleDouble),
            (false, false, Scalar::F64) => RuleSet::exact(Folding::F64),
            (false, false, Scalar::F32) => RuleSet::exact(Folding::F32),
        }
    }
}

/// What even equations as they are have, unless rules are exact.
pub(crate) const FOLDING: &str = "constants folded in double-double";

/// A program between tracing and text.
#[derive(Clone, Debug)]
pub struct Program {
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
}

impl Program {
    /// Whether its constants are those of the robot, in double-double: otherwise no bound of its errors is one of the robot.
    fn has_folded_constants(&self, options: &Options) -> bool {
        options.optimisations().folding && self.plainer.as_ref().is_none_or(|plainer| plainer.without != FOLDING)
    }
}

/// Traces and optimises one function of a robot, and checks what came out.
///
/// # Panics
/// If no form of it agrees with its plain equations.
pub fn program(robot: &Robot, frames: &[String], function: Function, options: &Options) -> Program {
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
) -> Result<Program, Disagreement> {
    let ((graph, method), plainer) = options.optimisations().first_that_agrees(|optimisations| {
        let made = optimised_with(robot, frames, function, options, optimisations);
        equivalence::of_function(robot, frames, function, options, optimisations, &made.0).map(|()| made)
    })?;
    let schedule = schedule(&graph, options.limits);
    Ok(Program { function, graph, schedule, method, plainer })
}

/// The operations of one function of a robot, with these optimisations only.
pub fn optimised(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Graph {
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
    if optimisations.limbs {
        if let Some(graph) = limbs::program(robot, frames, function, options, optimisations) {
            return (graph, None);
        }
    }
    let optimisations = Optimisations { limbs: false, ..optimisations };
    let check = |pass, graph| passed(pass, function.name(), graph);
    let finished = |robot: &Robot, options: &Options, optimisations: Optimisations| {
        let (traced, choice) = traced(robot, frames, function, options, optimisations);
        let graph = check("dead code", dead_code(&check("traced", traced)));
        let graph = check("unread inputs", unread_inputs(graph, is_optional));
        let graph = match optimisations.sums {
            true => check("dead code", dead_code(&check("sums", sums(&graph)))),
            false => graph,
        };
        // joint torques gain an operation of two hundred
        let gains = matches!(function, Function::MassMatrix | Function::ForwardDynamics);
        let graph = match optimisations.substitutes && gains {
            true => check("substitute", substitute(&graph, &choose::keeps_digits_of(&robot.model, &graph))),
            false => graph,
        };
        // fused products want another order; forward dynamics takes 6 to 9 % longer in this one, and its digits go elsewhere
        let ordered = optimisations.sums && !options.fma && function != Function::ForwardDynamics;
        let graph = match ordered.then(|| forward_method::samples(&robot.model, &graph)).flatten() {
            Some(states) => check("order", order(&graph, &states)),
            None => graph,
        };
        (graph, choice)
    };
    if !(optimisations.chosen && optimisations.reduced && robot.reduced.serves(&robot.model)) {
        return finished(robot, options, optimisations);
    }
    let chosen = choose(robot, frames, function, options, Optimisations { chosen: false, ..optimisations });
    let (graph, choice) = finished(&chosen, options, optimisations);
    // by the bodies' own parameters in their own frames, where those have more zeros; the method stays
    let same_method = choice.map_or(options.forward_dynamics, |choice| choice.method());
    let same_method = Options { forward_dynamics: same_method, ..options.clone() };
    let of_bodies = Optimisations { reduced: false, ..optimisations };
    if function.has_reduced_form() {
        let (counts, ..) = candidate(robot, frames, function, &same_method, of_bodies);
        if price(counts) < price(graph.counts()) {
            return (finished(robot, &same_method, of_bodies).0, choice);
        }
    }
    (graph, choice)
}

/// What a pass made, if it kept what graphs promise.
pub(crate) fn passed(pass: &'static str, program: &str, graph: Graph) -> Graph {
    #[cfg(feature = "internals")]
    let graph = equivalence::sabotage::applied(pass, graph);
    verify(&graph).unwrap_or_else(|broken| panic!("{program}: the pass `{pass}` broke the graph: {broken}"));
    graph
}

/// The equations of one function, by these optimisations of the form of the robot and of the rules.
fn traced(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> (Graph, Option<MethodChoice>) {
    let method = match options.forward_dynamics {
        ForwardDynamicsMethod::Cheaper if !optimisations.cheaper => ForwardDynamicsMethod::ArticulatedBody,
        method => method,
    };
    let rules = options.rules_of(optimisations);
    function.trace(robot, frames, method, rules, options.scalar, optimisations.reduced, &options.scene)
}

/// What [`optimised`] would take for a robot in the reduced forms that it is in, the equations as traced, and the method of forward
/// dynamics that was chosen: without writing the graph, for a search over many forms.
pub(crate) fn candidate(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> (Counts, Graph, Option<MethodChoice>) {
    let (graph, method) = traced(robot, frames, function, options, optimisations);
    let counts = if optimisations.sums { count_sums(&graph) } else { graph.counts() };
    (counts, graph, method)
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
    /// What its text is to compute: [`readback`] compares.
    pub programs: Programs,
}

/// From the text of a robot file to the text of its dynamics. Where a scene skips something, the report says how much.
///
/// # Errors
/// Everything that is wrong with the file or the options, at once; or the budgets that are exceeded.
pub fn compile(source: &Source, options: &Options) -> Result<Generated, Diagnostics> {
    compile_and_explain(source, options, !options.scene.is_empty())
}

/// The same, with a report that says what every optimisation is worth, and with the figures of the staged form: for people
/// and programs that ask for it, because every step is compiled.
///
/// # Errors
/// As [`compile`].
pub fn explain(source: &Source, options: &Options) -> Result<Generated, Diagnostics> {
    let mut generated = compile_and_explain(source, options, true)?;
    if generated.report.staged.is_none() && !generated.items.is_empty() {
        let robot = Robot::new(generated.model.clone());
        let options = options.knowing(source);
        let options = Options { scene: options.scene.resolved(&robot.model), ..options };
        let figures = staged::figures(&robot, &generated.frames, &options);
        generated.report.staged = Some(figures.map_err(|wrong| only(wrong.error(&robot.model)))?);
    }
    Ok(generated)
}

fn compile_and_explain(source: &Source, options: &Options, explained: bool) -> Result<Generated, Diagnostics> {
    let mut generated = compile_in_one_scalar(source, options, explained)?;
    for &scalar in &options.also {
        let options = Options { scalar, also: Vec::new(), ..options.clone() };
        let other = compile_in_one_scalar(source, &options, explained)?;
        generated.text.push_str(&emit::scalar_module(scalar, &other.text));
        generated.others.push(other);
    }
    readback::checked(generated)
}

/// What is wrong with the file or the options, without compiling: all that [`compile`] would say but what only the finished
/// programs tell, such as exceeded budgets.
pub fn examine(source: &Source, options: &Options) -> Diagnostics {
    match prepare(source, options) {
        Ok(prepared) => prepared.diagnostics,
        Err(diagnostics) => diagnostics,
    }
}

/// A robot in its scene, and options that fit it.
struct Prepared {
    /// What the file says.
    description: Description,
    /// The robot without its scene.
    whole: Model<Dd>,
    model: Model<Dd>,
    frames: Vec<String>,
    /// The options, whose scene knows the drives of the file.
    options: Options,
    /// The same, spelled out for the robot.
    resolved: Options,
    /// Warnings.
    diagnostics: Diagnostics,
}

/// Reads and checks everything.
fn prepare(source: &Source, options: &Options) -> Result<Prepared, Diagnostics> {
    let mut diagnostics = Diagnostics::reporting(&options.reporting);
    let (mut description, mut options) = (description::read(source, &mut diagnostics), options.clone());
    for drives in description.iter_mut().map(|d| &mut d.drives).chain([&mut options.scene.drives]) {
        range::leave_out_lost_limits(drives, &options.scene.parameters, options.scalar);
    }
    let options = &options.knowing_drives(description.as_ref().map_or(&[], |d| &d.drives));
    let build = |d: &Description| model::build(d, &options.scene.model_options(&options.model), &mut diagnostics);
    let whole = description.as_ref().and_then(build);
    model::finish(&mut diagnostics);
    scene::check_options(options, &mut diagnostics);
    let model = whole.clone().and_then(|whole| scene::apply(whole, &options.scene, &mut diagnostics));
    if options.scalar == Scalar::F32 && !diagnostics.has_errors() {
        description.iter().for_each(|d| range::of_robot(d, &options.scene, options.scalar, &mut diagnostics));
    }
    let of_frames = model.as_ref().or(whole.as_ref());
    let frames = of_frames.map(|m| choose_frames(m, &options.frames, &mut diagnostics)).unwrap_or_default();
    let functions = of_frames.map(|m| Function::wanted(&options.functions, m)).unwrap_or_default();
    for (function, model) in functions.iter().filter_map(|f| Some((f, of_frames?))).filter(|(f, m)| !f.is_of(*m)) {
        let complaint = scene::messages::function_not_of_robot(function.name(), model.drives.is_empty());
        let path = match options.scene.outputs.contains_key(function) {
            true => format!("outputs.{}", function.name()),
            false => "outputs.functions".to_string(),
        };
        options.scene.places.complain(&path, complaint, &mut diagnostics);
    }
    if options.limbs == LimbForm::Lanes && model.as_ref().is_some_and(|model| limbs::limbs(model).is_empty()) {
        options.scene.places.complain("outputs.limbs", scene::messages::no_identical_limbs(), &mut diagnostics);
    }
    diagnostics.sort();
    let (Some(description), Some(whole), Some(model), false) = (description, whole, model, diagnostics.has_errors())
    else {
        return Err(diagnostics);
    };
    let resolved = Options { scene: options.scene.resolved(&model), functions, ..options.clone() };
    singular::demand_inertia(&model, &resolved, &mut diagnostics);
    match diagnostics.has_errors() {
        true => {
            diagnostics.sort();
            Err(diagnostics)
        }
        false => Ok(Prepared { description, whole, model, frames, options: options.clone(), resolved, diagnostics }),
    }
}

fn compile_in_one_scalar(source: &Source, options: &Options, explained: bool) -> Result<Generated, Diagnostics> {
    let Prepared { description, whole, model, frames, options, resolved, mut diagnostics } = prepare(source, options)?;
    let hash = hash(source.text(), &resolved);
    let robot = Robot::new(model);
    let is_empty = |f: &Function| f.is_per_frame() && resolved.scene.frames_of(*f, &frames).is_empty();
    let programs = resolved.functions.iter().filter(|f| !is_empty(f));
    let programs: Result<Vec<Program>, _> = programs.map(|f| checked(&robot, &frames, *f, &resolved)).collect();
    let mut programs = programs.map_err(|wrong| only(no_form(&wrong, &robot.model, options.scalar, &description)))?;
    let beyond = |program: &str, why: &str, diagnostics: &mut Diagnostics| {
        let complaint = scene::messages::program_beyond_scalar(program, options.scalar.name(), why);
        options.scene.places.complain("numbers.scalar", complaint, diagnostics);
    };
    for program in &mut programs {
        if let Err(wrong) = mix_precisions(&robot, &frames, program, &resolved) {
            diagnostics.push(wrong.error(&robot.model));
        }
        if let Some(why) = range::of_program(&robot.model, &program.graph, options.scalar) {
            beyond(program.function.name(), &why, &mut diagnostics);
        }
        if let Some(plainer) = &program.plainer {
            diagnostics.push(plainer.warning(&robot.model));
        }
    }
    let measures: Vec<(Function, Measures)> =
        programs.iter().map(|p| (p.function, Measures::of(p, options.scalar))).collect();
    budget::check(&whole, &frames, &measures, &options, &mut diagnostics);
    let certificates = certificates(&robot, &programs, &resolved);
    budget::check_errors(programs.iter().zip(&certificates), &resolved, &mut diagnostics);
    if diagnostics.has_errors() {
        diagnostics.sort();
        return Err(diagnostics);
    }
    let waterfalls = match explained {
        true => {
            let stops = waterfall::stops(&whole, &options.scene);
            let of = |p: &Program| waterfall::waterfall(&stops, &frames, p.function, &resolved, p.graph.counts());
            programs.iter().map(|p| Some(of(p))).collect()
        }
        false => vec![None; programs.len()],
    };
    let programs = programs.into_iter().zip(waterfalls).zip(certificates).map(|((p, w), c)| (p, w, c)).collect();
    let model = robot.model.clone();
    let generated = generate(robot, frames, programs, diagnostics, &resolved, source.path(), hash);
    let generated = generated.map_err(|wrong| only(wrong.error(&model)))?;
    // what has a program of its own is asked above, all else here
    let why = |p: &readback::Program| Some((p.name.clone(), range::of_constants(&p.graph, p.scalar)?));
    let first = generated.programs.all().find_map(why);
    match first {
        None => Ok(generated),
        Some((program, why)) => {
            let mut diagnostics = generated.warnings;
            beyond(&program, &why, &mut diagnostics);
            Err(diagnostics)
        }
    }
}

/// What is said of a function of which no form agrees.
fn no_form(wrong: &Disagreement, model: &Model<Dd>, scalar: Scalar, description: &Description) -> Diagnostic {
    let Some((body, part)) = wrong.beyond_digits(model, scalar) else { return wrong.error(model) };
    let (joint, link) = (&model.bodies[body].joint.name, &model.bodies[body].name);
    let complaint = messages::inertia_beyond_digits(&wrong.program, scalar.name(), joint, part);
    match description.place_of(joint, link) {
        Some(place) => complaint.at(place),
        None => complaint,
    }
}

fn only(error: Diagnostic) -> Diagnostics {
    let mut all = Diagnostics::default();
    all.push(error);
    all
}

/// The rest of the pipeline: from programs to text.
#[allow(clippy::too_many_arguments)]
fn generate(
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
    let mut written = Programs::default();
    for (program, waterfall, errors) in programs {
        let Program { function, graph, schedule, method, .. } = &program;
        let mut doc = function.doc(&graph.inputs, &options.scene);
        if let Some(method) = method {
            doc.push_str(&format!("\n{method}\n"));
        }
        if !graph.widths.is_empty() {
            let (double, all) = (certify::mixed::double_operations(graph), graph.counts().flops());
            doc.push_str(&format!("\n{double} of its {all} operations are in f64: what its error budget takes.\n"));
        }
        let mut text = emit::function(graph, schedule, function.name(), &doc, options.plain_style(), &title);
        let figures = FunctionReport::new(&program, options.scalar, text.text.lines().count());
        if wants_companions(options) {
            let (bound, plainer) = match program.has_folded_constants(options) {
                true => checked_companion(&robot, *function, graph, options)?,
                false => (Err(ROUNDED), None),
            };
            plainer.iter().for_each(|p| warnings.push(p.warning(model)));
            let by_residual = *function == Function::ForwardDynamics;
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
        written.functions.push(readback::Program {
            name: function.name().to_string(),
            graph,
            scalar: options.scalar,
            generic: options.generic,
            lanes: options.lanes.is_some(),
        });
    }
    let crate::contact::ContactModule { text: contact_text, reports: contact, plainer, programs: modes } =
        crate::contact::module(&robot, options, &title)?;
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

/// The bounds of rounding errors of every program, where they are asked for.
fn certificates(robot: &Robot, programs: &[Program], options: &Options) -> Vec<Option<ErrorReport>> {
    let of = |p: &Program| {
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
        let known = match p.function {
            Function::ForwardDynamics => known(robot, &p.graph, &inputs, options),
            _ => Known::default(),
        };
        Some(match certify::certify_with(&p.graph, options.scalar, &inputs, effort, &known) {
            Ok(certificate) => ErrorReport::new(outputs, ranges, certificate),
            Err(refusal) => ErrorReport { ranges, ..ErrorReport::refused(refusal.words()) },
        })
    };
    programs.iter().map(of).collect()
}

/// What mechanics knows of the values of forward dynamics: [`pivots`].
pub fn known(robot: &Robot, graph: &Graph, inputs: &[certify::Interval], options: &Options) -> Known {
    if !pivots::is_arm(&robot.model, graph) {
        return Known::default();
    }
    let all = options.optimisations();
    let plain = Optimisations { chosen: false, limbs: false, substitutes: false, ..all };
    let of = |function| optimised(robot, &[], function, options, plain);
    let (mass_matrix, torques) = (of(Function::MassMatrix), of(Function::InverseDynamics));
    let sizes = pivots::Sizes::of(&mass_matrix, &torques, &options.scene, &robot.model);
    sizes.map_or_else(|_| Known::default(), |sizes| pivots::known(&robot.model, graph, inputs, &sizes))
}

/// A program in f32 gets f64 where its budget allows that and its greatest error takes it.
///
/// # Errors
/// If the program differs from the plain equations then.
pub(crate) fn mix_precisions(
    robot: &Robot,
    frames: &[String],
    program: &mut Program,
    options: &Options,
) -> Result<(), Disagreement> {
    let budget = options.scene.budgets.get(&program.function).filter(|b| b.mixed_precision);
    let Some(most) = budget.and_then(|b| b.max_error.as_ref()) else { return Ok(()) };
    // fused and generic ones were refused with the options
    if options.scalar != Scalar::F32 {
        return Ok(());
    }
    // what does not fit is said where bounds are compared with the budget
    let Ok(demand) = most.of_results(&program.graph.outputs) else { return Ok(()) };
    let stored: Vec<NodeId> = program.schedule.parts.iter().flat_map(|p| p.stores.iter().map(|(id, _)| *id)).collect();
    let inputs = input_box(&program.graph.inputs, &options.scene, &robot.model);
    // what has no bound at all is refused where bounds are compared with the budget
    let widened = inputs.and_then(|inputs| certify::mixed::widened(&program.graph, &inputs, &demand, &stored));
    // what has none is the program that was checked before
    let Ok(graph) = widened else { return Ok(()) };
    program.graph = passed("mixed precision", program.function.name(), graph);
    let made_by = Optimisations { folding: program.has_folded_constants(options), ..options.optimisations() };
    equivalence::of_function(robot, frames, program.function, options, made_by, &program.graph)
}

/// Whether programs for the bounds at the state at hand are asked for.
pub fn wants_companions(options: &Options) -> bool {
    options.certify.is_some_and(|effort| effort.companions)
}

/// Which bits the functions of these options compute.
pub fn bits(options: &Options) -> Bits {
    if options.fma {
        Bits::Fused
    } else {
        Bits::Plain
    }
}

/// The program that bounds a function's rounding errors at the state at hand.
///
/// # Errors
/// Why there is none.
///
/// # Panics
/// If no form of the equations that accelerations are judged by agrees with the plain ones, or what was made is no bound.
pub fn companion(robot: &Robot, function: Function, graph: &Graph, options: &Options) -> Result<Graph, &'static str> {
    checked_companion(robot, function, graph, options).unwrap_or_else(|wrong| panic!("{wrong}")).0
}

/// A bound at a state, or why there is none.
pub(crate) type StateBound = Result<Graph, &'static str>;

/// The same, checked, and whether the equations that it is made of are plainer than they were to be.
///
/// # Errors
/// What was wrong.
pub(crate) fn checked_companion(
    robot: &Robot,
    function: Function,
    graph: &Graph,
    options: &Options,
) -> Result<(StateBound, Option<Plainer>), Disagreement> {
    let name = function.name();
    if function != Function::ForwardDynamics {
        let bound = certify::companion::state_bound(graph, options.scalar, bits(options));
        let bound = bound.map(|bound| finished_bound(name, bound));
        bound.iter().try_for_each(|bound| equivalence::of_bound(robot, options, name, (graph, bound)))?;
        return Ok((bound, None));
    }
    let ((system, _), plainer) = contact::checked_system(robot, options, &contact::Mode::alone())?;
    let bound = certify::residual::acceleration_bound(&system, &[], options.scalar);
    let bound = bound.map(|bound| finished_bound(name, bound));
    bound.iter().try_for_each(|bound| {
        equivalence::of_acceleration_bound(robot, options, name, (graph, bound), Some(&system))
    })?;
    Ok((bound, plainer))
}

/// A bound without what no result needs.
pub(crate) fn finished_bound(program: &str, bound: Graph) -> Graph {
    passed("bound: dead code", program, dead_code(&passed("bound: traced", program, bound)))
}

/// What a caller must know of a bound at a state.
const OF_STATE: &str = "Inputs below the normal numbers are to be given as zero where the machine reads them so.";

/// The source of `…_error_bound`, or a comment that says why there is none.
pub(crate) fn error_bound_text(
    bound: Result<Graph, &'static str>,
    (name, by_residual): (&str, bool),
    graph: &Graph,
    options: &Options,
    written: &mut Vec<readback::Program>,
) -> emit::FunctionText {
    let scalar = match graph.widths.is_empty() {
        true => options.scalar,
        false => Scalar::F64,
    };
    let bound = match bound {
        Ok(bound) => bound,
        Err(why) => return emit::FunctionText::remark(&format!("No `{name}_error_bound`: {why}.")),
    };
    let mut doc = match by_residual {
        false => format!(
            "How far the results of [`{name}`] can be from the exact values by rounding, at these inputs: certified for this state, \
             whatever the ranges of the inputs. NaN where nothing is certified: a divisor that may vanish, or a sign that may be wrong."
        ),
        true => format!(
            "How far accelerations and reactions, from [`{name}`] or wherever else, can be from the exact ones at these inputs: \
             certified by what they leave of the equations.\n\n`smallest_eigenvalue`: what the smallest eigenvalue of the mass matrix is \
             at least. Where rounding is too coarse for a proof, the results that depend on it are NaN: ask `is_nan()` before use."
        ),
    };
    if by_residual && bound.outputs.iter().any(|p| p.name == "smallest_contact_eigenvalue") {
        doc.push_str(
            " `smallest_contact_eigenvalue` is that of the inverse mass J H⁻¹ Jᵀ that reactions feel (where objects give way or contacts \
             slide with friction, the smallest singular value of the matrix of reactions); redundant contacts have no proof.",
        );
    }
    let _ = write!(doc, "\n\n{OF_STATE}");
    if options.generic {
        let _ = write!(doc, " Of [`{name}`] in `{}`.", scalar.name());
    }
    if !graph.widths.is_empty() {
        doc.push_str(" In f64, of the function in f32: convert its inputs.");
    }
    let schedule = schedule(&bound, options.limits);
    let name = format!("{name}_error_bound");
    let text = emit::function(&bound, &schedule, &name, &doc, Style::plain(scalar), &|_| String::new());
    written.push(readback::Program { name, graph: bound, scalar, generic: false, lanes: false });
    text
}

/// The program of a parameter's constructor: from mass \[kg\], mass centre \[m\] and inertia about it \[kg·m²\] (xx, xy, xz,
/// yy, yz, zz) in the parameter's frame, or from the free numbers of a drive, to the scalars that the functions take.
pub fn parameter_program(robot: &Robot, parameter: &Parameter, options: &Options) -> Graph {
    let outputs = vec![Port::new("parameters", &[parameter.scalars(&robot.model)])];
    let name = parameter.input_name();
    let traced = trace(options.rules(), parameter.given(), outputs, |x| constructed(robot, parameter, x));
    passed("parameter: dead code", &name, dead_code(&passed("parameter: traced", &name, traced)))
}

/// The last part of a path.
pub fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// The same, if it makes what the functions take.
///
/// # Errors
/// If it does not.
pub(crate) fn checked_parameter(
    robot: &Robot,
    parameter: &Parameter,
    options: &Options,
) -> Result<Graph, Disagreement> {
    let graph = parameter_program(robot, parameter, options);
    equivalence::of_parameter(robot, parameter, options, &graph).map(|()| graph)
}

/// The types of those run-time parameters that something takes, with what they share.
fn parameter_types(
    robot: &Robot,
    options: &Options,
    takes: &dyn Fn(&Parameter) -> bool,
    written: &mut Vec<ParameterProgram>,
) -> Result<String, Disagreement> {
    let parameters = options.scene.parameters.iter().filter(|p| p.is_of(&robot.model) && takes(p));
    let mut types = String::new();
    for p in parameters {
        let graph = checked_parameter(robot, p, options)?;
        let (schedule, name) = (schedule(&graph, options.limits), p.input_name());
        let drive = FreeDrive::new(p, &robot.model);
        let doc = match &drive {
            None => "The parameters about the origins, and in the axes, of the frames that the equations use.",
            Some(_) => "The numbers of the drive that the equations use.",
        };
        let private = format!("{name}_parameters");
        let constructor = emit::function(&graph, &schedule, &private, doc, options.style(), &|_| String::new());
        let program = readback::Program { name: private, graph, scalar: options.scalar, generic: false, lanes: false };
        let scalars = p.scalars(&robot.model);
        let (text, numbers) = match drive {
            None => {
                let frame = p.frame().unwrap_or_default();
                (emit::parameter::body(&name, &p.type_name(), frame, scalars, &constructor, options.scalar), None)
            }
            Some(drive) => {
                let numbers = DriveNumbers { nominal: drive.values(&drive.nominal()), numbers: drive.numbers };
                let names = (&name[..], &p.type_name()[..], p.name());
                (emit::parameter::drive(names, &numbers, &constructor, options.scalar), Some(numbers))
            }
        };
        written.push(ParameterProgram { type_name: p.type_name(), program, numbers });
        types.push_str(&text);
    }
    let is_there = |drive: bool| written.iter().any(|p| p.numbers.is_some() == drive);
    let checks = [(false, emit::parameter::check as fn(Scalar) -> String), (true, emit::parameter::check_drive)];
    let checks = checks.into_iter().filter(|(drive, _)| is_there(*drive)).map(|(_, text)| text(options.scalar));
    Ok(checks.collect::<String>() + &types)
}

/// The frames asked for, or the tips of the robot: the last frame on every body that carries no other.
fn choose_frames(model: &Model<Dd>, asked: &[String], diagnostics: &mut Diagnostics) -> Vec<String> {
    if asked.is_empty() {
        let carries = |i: usize| model.bodies.iter().any(|b| b.parent == Some(i));
        let last_on = |i: usize| model.frames.iter().rev().find(|f| f.body == Some(i)).map(|f| f.name.clone());
        return (0..model.bodies.len()).filter(|i| !carries(*i)).filter_map(last_on).collect();
    }
    for name in asked.iter().filter(|name| model.frame(name).is_none()) {
        diagnostics.push(messages::unknown_frame(name, model.frames.iter().map(|f| f.name.as_str())));
    }
    asked.to_vec()
}

/// Over everything that the output depends on.
fn hash(text: &str, options: &Options) -> u64 {
    fnv_1a([text, "\0", crate::VERSION, "\0", &options.stable_text()].concat().bytes())
}
