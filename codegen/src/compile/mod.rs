//! The pipeline, as one function.

mod figures;
mod prepare;
mod programs;

pub use prepare::examine;

use crate::description::{messages, Description};
use crate::diagnostic::fnv_1a;
use crate::diagnostic::{Diagnostic, Diagnostics, Source};
use crate::emit::generated::generate;
use crate::emit::package::PackageKind;
use crate::emit::Generated;
use crate::equations::Robot;
use crate::function::Function;
use crate::options::Options;
use crate::program::equivalence::Disagreement;
use crate::program::fixed::fixed_functions;
use crate::program::mixed::mix_precisions;
use crate::program::staged::figures;
use crate::program::stored::{NoStore, ProgramStore};
use crate::program::written::WrittenFunction;
use crate::program::{range, TracedProgram};
use crate::report::budget::{self, Measures};
use crate::report::certificates::certificates;
use crate::report::waterfall;
use crate::{readback, scene};
use figures::{with_figures, Compilation};
use prepare::{prepare, Prepared};
use programs::Stored;
use std::sync::OnceLock;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::Scalar;

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
        let figures = figures(&robot, &generated.frames, &options);
        generated.report.staged = Some(figures.map_err(|wrong| only(wrong.error(&robot.model)))?);
    }
    Ok(generated)
}

/// The files of a package, whose names in other languages begin with the prefix, read back as every text is.
///
/// # Errors
/// That the package is not what was compiled, which is an error of ours.
pub fn checked_package(
    kind: &PackageKind,
    generated: &Generated,
    prefix: &str,
) -> Result<Vec<(String, String)>, Diagnostics> {
    let files = (kind.files)(generated, prefix);
    let read = readback::packages::check(kind.name, generated, prefix, &files);
    read.map_err(|mismatch| only(readback::complaint(&mismatch)))?;
    Ok(files)
}

fn compile_and_explain(source: &Source, options: &Options, explained: bool) -> Result<Generated, Diagnostics> {
    let generated = compile_in_one_scalar(source, options, explained)?;
    let other = |scalar: &Scalar| {
        let options = Options { scalar: *scalar, also: Vec::new(), fixed: None, ..options.clone() };
        compile_in_one_scalar(source, &options, explained)
    };
    let others: Result<Vec<Generated>, _> = options.also.iter().map(other).collect();
    readback::checked(generated.with_others(others?))
}

/// Programs without text, of a robot in its scene.
struct Compiling {
    /// The robot without its scene.
    whole: Model<Dd>,
    robot: Robot,
    frames: Vec<String>,
    options: Options,
    /// The options, spelled out for the robot.
    resolved: Options,
    programs: Vec<TracedProgram>,
    diagnostics: Diagnostics,
    hash: u64,
}

fn compiling(source: &Source, options: &Options, store: &dyn ProgramStore) -> Result<Compiling, Diagnostics> {
    let Prepared { description, whole, model, frames, options, resolved, mut diagnostics } = prepare(source, options)?;
    let robot = Robot::new(model).knowing_base_parameters(&resolved.functions, &resolved.scene);
    let is_empty = |f: &Function| f.is_per_frame() && resolved.scene.frames_of(*f, &frames).is_empty();
    let functions: Vec<Function> = resolved.functions.iter().copied().filter(|f| !is_empty(f)).collect();
    let hash = hash(source.text(), &diagnostics, &resolved);
    let of_robot = OnceLock::new();
    let key = |function| {
        let of_robot = of_robot.get_or_init(|| self::hash(source.text(), &diagnostics, &Options::default()));
        let options = Options { functions: vec![function], ..resolved.clone() };
        fnv_1a(of_robot.to_le_bytes().into_iter().chain(options.hashed().bytes()))
    };
    let stored = Stored { store, key: &key };
    let programs = programs::programs(&robot, &frames, &functions, &resolved, &stored);
    let mut programs = programs.map_err(|wrong| only(no_form(&wrong, &robot.model, options.scalar, &description)))?;
    for program in &mut programs {
        if let Err(wrong) = mix_precisions(&robot, &frames, program, &resolved) {
            diagnostics.push(wrong.error(&robot.model));
        }
        if let Some(why) = range::of_program(&robot.model, &program.graph, options.scalar) {
            beyond(&options, program.function.name(), &why, &mut diagnostics);
        }
        if let Some(plainer) = &program.plainer {
            diagnostics.push(plainer.warning(&robot.model));
        }
    }
    Ok(Compiling { whole, robot, frames, options, resolved, programs, diagnostics, hash })
}

/// What is said of a program whose numbers the scalar does not have.
fn beyond(options: &Options, program: &str, why: &str, diagnostics: &mut Diagnostics) {
    let complaint = scene::messages::program_beyond_scalar(program, options.scalar.name(), why);
    options.scene.places.complain("options.scalar", complaint, diagnostics);
}

/// The programs of all functions that are wanted, checked as those of texts are, for what executes them without a text.
#[derive(Clone, Debug)]
pub struct CheckedPrograms {
    /// One per function, in their order.
    pub programs: Vec<TracedProgram>,
    /// The robot in its scene.
    pub model: Model<Dd>,
    /// The frames of the functions that answer per frame.
    pub frames: Vec<String>,
    /// What is doubtful or worth knowing.
    pub warnings: Diagnostics,
}

/// From the text of a robot file to the programs of its dynamics.
///
/// # Errors
/// As [`compile`], but for budgets.
pub fn compile_programs(source: &Source, options: &Options) -> Result<CheckedPrograms, Diagnostics> {
    compile_programs_by(source, options, &NoStore)
}

/// The same, where programs that a store has are not made again. They are checked again.
///
/// # Errors
/// As [`compile_programs`].
pub fn compile_programs_by(
    source: &Source,
    options: &Options,
    store: &dyn ProgramStore,
) -> Result<CheckedPrograms, Diagnostics> {
    let Compiling { robot, frames, programs, mut diagnostics, .. } = compiling(source, options, store)?;
    diagnostics.sort();
    match diagnostics.has_errors() {
        true => Err(diagnostics),
        false => Ok(CheckedPrograms { programs, model: robot.model, frames, warnings: diagnostics }),
    }
}

fn compile_in_one_scalar(source: &Source, options: &Options, explained: bool) -> Result<Generated, Diagnostics> {
    let compiling = compiling(source, options, &NoStore)?;
    let Compiling { whole, robot, frames, options, resolved, mut programs, mut diagnostics, hash } = compiling;
    let measures: Vec<(Function, Measures)> =
        programs.iter().map(|p| (p.function, Measures::of(p, options.scalar))).collect();
    budget::check(&whole, &frames, &measures, &options, &mut diagnostics);
    let mut certificates = certificates(&robot, &programs, &resolved);
    budget::check_errors(programs.iter().zip(&certificates), &resolved, &mut diagnostics);
    for (program, errors) in programs.iter_mut().zip(&mut certificates) {
        program.choose_entries(&resolved);
        errors.iter_mut().for_each(|errors| errors.keep_outputs(&program.graph.outputs, &program.entries));
    }
    let fixed = fixed_functions(&robot, &programs, &resolved, &mut diagnostics);
    if diagnostics.has_errors() {
        diagnostics.sort();
        return Err(diagnostics);
    }
    let waterfalls = match explained {
        true => {
            let stops = waterfall::stops(&whole, &options.scene);
            let of = |p: &TracedProgram| waterfall::waterfall(&stops, &frames, p.function, &resolved, p.graph.counts());
            programs.iter().map(|p| Some(of(p))).collect()
        }
        false => vec![None; programs.len()],
    };
    let programs = programs.into_iter().zip(waterfalls).zip(certificates).map(|((p, w), c)| (p, w, c)).collect();
    let model = robot.model.clone();
    let generated = generate(robot, frames, programs, diagnostics, &resolved, source.path(), hash);
    let generated = generated.map_err(|wrong| only(wrong.error(&model)))?;
    // what has a program of its own is asked above, all else here
    let why = |p: &WrittenFunction| Some((p.name.clone(), range::of_constants(&p.graph, p.scalar)?));
    let first = generated.programs.all().find_map(why);
    match first {
        None => {
            let compilation = Compilation { source, options: &options, whole: &whole };
            Ok(with_figures(generated, &compilation)?.with_fixed(fixed))
        }
        Some((program, why)) => {
            let mut diagnostics = generated.warnings;
            beyond(&options, &program, &why, &mut diagnostics);
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

/// Over everything that the output depends on: the robot file and those that it names, and the options.
fn hash(text: &str, said: &Diagnostics, options: &Options) -> u64 {
    let sums: String = said.named_files().map(|(_, sum)| format!("{sum:016x}\0")).collect();
    fnv_1a([text, "\0", &sums, crate::VERSION, "\0", &options.hashed()].concat().bytes())
}
