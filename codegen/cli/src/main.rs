//! The command `straightline`: a thin front over the library.
//!
//! Results go to standard output, diagnostics and progress to standard error, colours and progress to terminals only.
#![forbid(unsafe_code)]

mod arguments;
mod bench;
#[cfg(feature = "simulation")]
mod contact;
mod convert;
#[cfg(feature = "simulation")]
mod figures;
#[cfg_attr(not(feature = "simulation"), allow(dead_code))]
mod files;
#[cfg(feature = "simulation")]
mod gains;
mod given;
#[cfg(feature = "logs")]
mod identify;
#[cfg(feature = "logs")]
mod lerobot;
#[cfg(feature = "logs")]
mod log_files;
#[cfg_attr(not(feature = "logs"), path = "without_logs.rs")]
mod logs;
mod look_up;
mod machine_code;
#[cfg_attr(not(feature = "simulation"), path = "without_simulation.rs")]
mod motion;
#[cfg(feature = "simulation")]
mod motion_arguments;
#[cfg(feature = "simulation")]
mod page;
#[cfg_attr(not(feature = "simulation"), allow(dead_code))]
mod print;
mod query;
#[cfg(feature = "logs")]
mod residuals;
#[cfg(feature = "logs")]
mod residuals_page;
#[cfg(feature = "simulation")]
mod search;
mod table;
#[cfg(feature = "simulation")]
mod view;

use arguments::{
    CheckArguments, CliCommand, CommandLine, Export, Generate, ModelArgs, ProgramArgs, ReportArguments, Verify,
};
use files::read;
use std::io;
use std::path::Path;
use std::process::ExitCode;
use straightline_cli::html;
use straightline_codegen::compile::{checked_package, compile, explain};
use straightline_codegen::diagnostic::{self, codes, Diagnostics, Severity, Source};
use straightline_codegen::emit::c99::C99_SOURCE;
use straightline_codegen::emit::package::PACKAGES;
use straightline_codegen::emit::rust::c_package::C_ABI;
use straightline_codegen::emit::Generated;
use straightline_codegen::options::{check_options, scene_file, Options, SceneFile};
use straightline_codegen::verify::{verify_by, Verification};
use straightline_codegen::{description, identifier, model, output, scene};

/// Why a command ended early; what there is to say was said where it happened, except for [`CommandFailure::Files`].
enum CommandFailure {
    /// The robot file is wrong, or a check failed.
    Input,
    /// Another command did the work, and ended with this.
    Handed(u8),
    /// A file could not be read or written.
    Files(io::Error),
}

impl From<io::Error> for CommandFailure {
    fn from(error: io::Error) -> Self {
        CommandFailure::Files(error)
    }
}

fn main() -> ExitCode {
    let command = CommandLine::read(std::env::args_os().collect())
        .unwrap_or_else(|complaints| arguments::exit(complaints))
        .command;
    print::be_quiet(command.is_quiet());
    print::watch(command.doing());
    let done = match command {
        CliCommand::Generate(a) => generate(&a),
        CliCommand::Report(a) => report(&a),
        CliCommand::Check(a) => check(&a),
        CliCommand::Convert(a) => convert::convert_file(&a),
        CliCommand::Verify(a) => verify(&a),
        CliCommand::Bench(a) => bench::bench(&a),
        CliCommand::Export(a) => export(&a),
        CliCommand::Simulate(a) => motion::simulate(&a),
        CliCommand::Analyze(a) => motion::analyze(&a),
        CliCommand::View(a) => motion::view(&a),
        CliCommand::Residuals(a) => logs::residuals(&a),
        CliCommand::Identify(a) => logs::identify(&a),
        CliCommand::Query(a) => query::query(&a),
        CliCommand::Functions(a) => print::functions(a.word.as_deref()).map_err(CommandFailure::Files),
        CliCommand::Explain(a) => explain_code(a.code.as_deref()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(CommandFailure::Input) => ExitCode::from(1),
        Err(CommandFailure::Handed(code)) => ExitCode::from(code),
        // the reader of a pipe had enough: not a failure of ours
        Err(CommandFailure::Files(error)) if error.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(CommandFailure::Files(error)) => {
            print::error(&error.to_string());
            ExitCode::from(3)
        }
    }
}

/// What the command line and the scene that it names say; what is wrong with the scene is said when it is used.
fn options(program: Option<&ProgramArgs>, model: &ModelArgs) -> Result<Options, CommandFailure> {
    let file = model.scene.as_deref().map(read).transpose()?;
    let file = file.as_ref().map_or_else(SceneFile::default, scene_file::read_partly);
    Ok(file.with(&model.settings(program), Options::default()))
}

/// Compiles, and prints errors and warnings; notes are for `check`.
fn compiled(robot: &Path, program: &ProgramArgs, model: &ModelArgs) -> Result<(Generated, Options), CommandFailure> {
    compiled_by(compile, robot, program, model)
}

fn compiled_by(
    compile: fn(&Source, &Options) -> Result<Generated, Diagnostics>,
    robot: &Path,
    program: &ProgramArgs,
    model: &ModelArgs,
) -> Result<(Generated, Options), CommandFailure> {
    let options = options(Some(program), model)?;
    let source = read(robot)?;
    let progress = print::spinner(&format!("compiling {}", source.path()));
    let result = compile(&source, &options);
    progress.finish_and_clear();
    match result {
        Ok(generated) => {
            print::diagnostics(&generated.warnings, Severity::Warning);
            Ok((generated, options))
        }
        Err(diagnostics) => Err(print::refused(&diagnostics)),
    }
}

/// What a code stands for, or all codes.
fn explain_code(code: Option<&str>) -> Result<(), CommandFailure> {
    let Some(code) = code else { return Ok(print::codes(codes::ALL)?) };
    match codes::find(code) {
        Some(found) => Ok(print::codes(std::slice::from_ref(found))?),
        None => {
            let complaint = diagnostic::messages::unknown_code(code);
            Err(print::failure_with(complaint.title, &[complaint.help]))
        }
    }
}

fn generate(a: &Generate) -> Result<(), CommandFailure> {
    let (generated, _) = compiled(&a.robot, &a.program, &a.model)?;
    let Some(path) = &a.output else { return Ok(print::text(&generated.text)?) };
    if !a.check {
        files::write(path, &generated.text)?;
        return Ok(());
    }
    let (file, robot) = (path.display(), a.robot.display());
    let help = ["run the same command without --check and commit the file"];
    match std::fs::read(path) {
        Ok(old) if old == generated.text.as_bytes() => Ok(()),
        Ok(_) => {
            Err(print::failure_with(format!("{file} is stale: it is not what {robot} and these options give"), &help))
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            Err(print::failure_with(format!("{file} does not exist"), &help))
        }
        Err(e) => Err(io::Error::new(e.kind(), format!("{file}: {e}")).into()),
    }
}

fn report(a: &ReportArguments) -> Result<(), CommandFailure> {
    let (generated, options) = compiled_by(explain, &a.robot, &a.program, &a.model)?;
    if let Some(path) = &a.view {
        motion::draw_range(path, &a.robot, &a.model)?;
    }
    if let Some(path) = &a.html {
        files::write(path, &html::page(&read(&a.robot)?, &options, &generated))?;
        return Ok(());
    }
    Ok(if a.json { print::json(&generated.report) } else { print::report(&generated.report) }?)
}

fn check(a: &CheckArguments) -> Result<(), CommandFailure> {
    let options = options(None, &a.model)?;
    let model_options = options.scene.model_options(&options.model);
    let mut wrong = false;
    for robot in &a.robots {
        let source = read(robot)?;
        let mut diagnostics = Diagnostics::reporting(&options.reporting);
        let description = description::read(&source, &mut diagnostics);
        let model = description.as_ref().and_then(|d| model::build(d, &model_options, &mut diagnostics));
        check_options(&options, &mut diagnostics);
        let model = model.and_then(|model| scene::apply(model, &options.scene, &mut diagnostics));
        model::finish(&mut diagnostics);
        print::diagnostics(&diagnostics, Severity::Note);
        print::verdict(source.path(), model.as_ref(), &diagnostics)?;
        if let Some(description) = &description {
            let special = model::special_angles(description, &model_options);
            print::notes(description, &special, &model::doubtful_angles(description, &model_options))?;
        }
        wrong |= diagnostics.has_errors();
    }
    match wrong {
        true => Err(CommandFailure::Input),
        false => Ok(()),
    }
}

/// Compares the programs of a robot, run by machine code, with the second author in so many states from this seed.
fn verified(
    robot: &Path,
    (generated, options): &(Generated, Options),
    (states, seed): (u32, u64),
) -> Result<Verification, CommandFailure> {
    let source = read(robot)?;
    let progress = print::bar("verifying", states.into());
    let robot = (&generated.model, &generated.frames[..]);
    let tick = || progress.inc(1);
    let verified =
        verify_by(&source, robot, options, (states, seed), &|program| machine_code::run(program, options), tick);
    progress.finish_and_clear();
    verified.map_err(|what| print::failure(format!("{}: {what}", source.path())))
}

fn verify(a: &Verify) -> Result<(), CommandFailure> {
    let compiled = compiled(&a.robot, &a.program, &a.model)?;
    let verification = verified(&a.robot, &compiled, (a.states, a.seed))?;
    if a.json { print::json(&verification) } else { print::verification(&verification) }?;
    match verification.failure() {
        None => Ok(()),
        Some(why) => Err(print::failure(why)),
    }
}

fn export(a: &Export) -> Result<(), CommandFailure> {
    let (generated, _) = compiled(&a.robot, &a.program, &a.model)?;
    let short = if a.c99 { C99_SOURCE.name } else { C_ABI.name };
    let name = a.kind.as_deref().unwrap_or(short);
    let kind = PACKAGES.iter().find(|p| p.name == name).unwrap_or(&C_ABI);
    if let Some([wrong, help]) = (kind.refusal)(&generated) {
        return Err(print::failure_with(wrong, &[help]));
    }
    let prefix = a.prefix.clone().unwrap_or_else(|| identifier::prefix(&generated.model.name));
    let files = checked_package(kind, &generated, &prefix).map_err(|wrong| print::refused(&wrong))?;
    output::write_directory(&a.output, &files)?;
    Ok(())
}
