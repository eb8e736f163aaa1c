//! The command line, and what it says in the library's terms: one file, so that all commands are seen together.

use crate::convert::ConvertArguments;
use crate::given::{possible, Given};
use clap::builder::TypedValueParser;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, Parser, Subcommand};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use straightline_codegen::description::names_of_formats;
use straightline_codegen::emit::package::PACKAGES;
use straightline_codegen::identifier::is_prefix;
use straightline_codegen::options::table::OptionGroup;
use straightline_codegen::options::GivenOptions;
use straightline_codegen::Function;

pub use crate::bench::Bench;
pub use crate::logs::{Identify, Residuals};
use crate::look_up::EXPLAIN_HELP;
pub use crate::look_up::{Explain, Functions};
pub use crate::motion::{Analyze, Simulate, ViewArguments};
pub use crate::query::Query;

pub const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  the robot file is wrong, or a check failed
  2  the command line is wrong
  3  a file could not be read or written";

/// Compiles robot dynamics: from a robot file to straight-line, allocation-free, no_std Rust.
#[derive(Debug, Parser)]
#[command(name = "straightline", version, max_term_width = 110, after_help = format!("\
Examples:
  straightline check panda.urdf
  straightline convert panda.urdf panda.xml
  straightline generate panda.urdf -o src/panda.rs
  straightline report panda.urdf
  straightline verify panda.urdf
  straightline export panda.urdf -o panda-c --c-abi

{EXIT_CODES}"))]
pub struct CommandLine {
    #[command(subcommand)]
    pub command: CliCommand,
}

#[derive(Debug, Subcommand)]
pub enum CliCommand {
    /// Write the dynamics of a robot as Rust source
    #[command(after_help = format!("\
Examples:
  straightline generate panda.urdf -o src/panda.rs
  straightline generate panda.urdf -o src/panda.rs --check     # in CI: is the committed file up to date?
  straightline generate arm.urdf --scalar f32 --function inverse_dynamics --function gravity_force
  straightline generate solo12.urdf --floating-base --frame FL_FOOT --frame FR_FOOT -o solo12.rs
  straightline generate panda.urdf --lanes standalone --function inverse_dynamics -o src/panda.rs

{EXIT_CODES}"))]
    Generate(Generate),
    /// Count the operations of every function, and say what each optimisation and each item of a scene saves
    #[command(after_help = format!("\
Examples:
  straightline report panda.urdf
  straightline report panda.urdf --json --function inverse_dynamics
  straightline report panda.urdf --scene panda_gravity.toml
  straightline report panda.urdf --html panda.html

{EXIT_CODES}"))]
    Report(ReportArguments),
    /// Read robot files and say what is wrong, doubtful or worth knowing in them
    #[command(after_help = format!("\
Examples:
  straightline check panda.urdf
  straightline check robots/*.urdf --angle-tolerance 1e-4

{EXIT_CODES}"))]
    Check(CheckArguments),
    /// Write a robot file in another format
    #[command(after_help = crate::convert::help())]
    Convert(ConvertArguments),
    /// Compare the generated program with an independent formulation of the dynamics, on random states
    #[command(after_help = format!("\
Runs the program as it is compiled, operation by operation in the scalar's arithmetic, and the dynamics of the
handbook chapter, from centres of mass, in double-double (32 digits); prints the worst error of every function,
divided by its natural scale, the sum of the moduli of the terms that the value is made of.

Examples:
  straightline verify panda.urdf
  straightline verify solo12.urdf --floating-base --states 1000 --seed 7 --json

{EXIT_CODES}"))]
    Verify(Verify),
    /// Measure every function on this machine, by machine code that is made at once: rustc is not needed
    #[command(after_help = crate::bench::help())]
    Bench(Bench),
    /// Simulate a robot under torques or a controller
    #[command(after_help = format!("\
The experiment is a TOML file (codegen/SIMULATION.md), or CSV, JSON or Parquet samples of torques.
Results: t, q, qd, tau, energies.

Examples:
  straightline simulate panda.urdf --input swing.toml --output swing.csv --svg swing.svg
  straightline simulate panda.urdf --scene panda_payload.toml --input track.toml --output track.json

{EXIT_CODES}"))]
    Simulate(Simulate),
    /// What a motion asks of joints and drives: torques, power, energy, limits
    #[command(after_help = format!("\
The motion is a TOML file (codegen/SIMULATION.md), or CSV, JSON or Parquet samples of the joints.

Examples:
  straightline analyze panda.urdf --motion reach.toml --html reach.html
  straightline analyze panda.urdf --motion samples.csv --output figures.csv
  straightline analyze panda.urdf --motion reach.toml --sweep panda_link7.mass=0.5:3:11
  straightline analyze arm.toml --motion pick.toml --optimize elbow.spring_stiffness=0:50 --minimize energy

{EXIT_CODES}"))]
    Analyze(Analyze),
    /// Draw a robot in motion: a page for the browser, complete in one file
    View(ViewArguments),
    /// What a robot's log says beside the model: residual torques, friction, payload, contact
    #[command(after_help = crate::logs::help_of_residuals())]
    Residuals(Residuals),
    /// The numbers of a robot that its logs tell: inertias, friction, rotors, with intervals, and the robot file with them
    #[command(after_help = crate::logs::help_of_identify())]
    Identify(Identify),
    /// SQL over logs of many robots, by the command straightline-query (the folder fleets of a clone)
    #[command(disable_help_flag = true)]
    Query(Query),
    /// Write a self-contained package for other languages
    #[command(after_help = format!("\
With `--c-abi` the directory becomes a Rust package without dependencies; `cargo build --release` in it gives a shared
and a static library, and include/ holds the C header, usable from C and C++. With `--c99` it holds a source and a
header in C99 that need no library and compute the same bits, and a header for C++11.

Examples:
  straightline export panda.urdf -o panda-c --c-abi && cargo build --release --manifest-path panda-c/Cargo.toml
  straightline export panda.urdf -o panda-c99 --c99 --scalar f32 && cc -std=c99 -O2 -c panda-c99/panda_dynamics.c
  straightline export hyq.urdf -o hyq-c --c-abi --floating-base --prefix hyq --frame lf_foot --frame rf_foot

{EXIT_CODES}"))]
    Export(Export),
    /// List the functions, or those that a word is about: their names, summaries, and what else they are called
    #[command(after_help = "\
Examples:
  straightline functions
  straightline functions RNEA")]
    Functions(Functions),
    /// Say what a complaint's code stands for, or list all codes
    #[command(after_help = EXPLAIN_HELP)]
    Explain(Explain),
}

impl CliCommand {
    /// How the command reads robots, if it does.
    pub fn model(&self) -> Option<&ModelArgs> {
        Some(match self {
            CliCommand::Generate(a) => &a.model,
            CliCommand::Report(a) => &a.model,
            CliCommand::Check(a) => &a.model,
            CliCommand::Verify(a) => &a.model,
            CliCommand::Bench(a) => &a.model,
            CliCommand::Simulate(a) => return a.model(),
            CliCommand::Analyze(a) => return a.model(),
            CliCommand::View(a) => return a.model(),
            CliCommand::Residuals(a) => return a.model(),
            CliCommand::Identify(a) => return a.model(),
            CliCommand::Export(a) => &a.model,
            CliCommand::Convert(_) | CliCommand::Query(_) | CliCommand::Functions(_) | CliCommand::Explain(_) => {
                return None
            }
        })
    }

    /// Whether warnings and progress are left out.
    pub fn is_quiet(&self) -> bool {
        match self {
            CliCommand::Convert(a) => a.quiet,
            // the command that does it says what it does
            CliCommand::Query(_) => true,
            other => other.model().is_some_and(ModelArgs::is_quiet),
        }
    }

    /// What it does, in a word.
    pub fn doing(&self) -> &'static str {
        match self {
            CliCommand::Generate(_) => "generating",
            CliCommand::Report(_) => "reporting",
            CliCommand::Check(_) => "checking",
            CliCommand::Convert(_) => "converting",
            CliCommand::Verify(_) => "verifying",
            CliCommand::Bench(_) => "measuring",
            CliCommand::Simulate(_) => "simulating",
            CliCommand::Analyze(_) => "analysing",
            CliCommand::View(_) => "drawing",
            CliCommand::Residuals(_) => "reading a log",
            CliCommand::Identify(_) => "identifying",
            CliCommand::Query(_) => "querying",
            CliCommand::Export(_) => "exporting",
            CliCommand::Functions(_) | CliCommand::Explain(_) => "looking up",
        }
    }
}

/// What the argument `ROBOT` is.
pub fn robot_file() -> String {
    format!("The robot file: {}", names_of_formats())
}

#[derive(Debug, Args)]
pub struct Generate {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// Where to write; without it, standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Write nothing; exit with 1 if FILE is not what would be written
    #[arg(long, requires = "output")]
    pub check: bool,
    #[command(flatten)]
    pub program: ProgramArgs,
    #[command(flatten)]
    pub model: ModelArgs,
}

#[derive(Debug, Args)]
pub struct ReportArguments {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// As JSON: {"robot": …, "functions": {"inverse_dynamics": {"mul": …, "plain": …, "full": …, "savings": […]}}}
    #[arg(long)]
    pub json: bool,
    /// As a page for the browser, complete in one file
    #[arg(long, value_name = "FILE", conflicts_with = "json")]
    pub html: Option<PathBuf>,
    /// Where to draw the robot, each joint moving through its range, as `straightline view` does
    #[arg(long, value_name = "FILE")]
    pub view: Option<PathBuf>,
    #[command(flatten)]
    pub program: ProgramArgs,
    #[command(flatten)]
    pub model: ModelArgs,
}

#[derive(Debug, Args)]
pub struct CheckArguments {
    #[arg(required = true, value_name = "ROBOT", help = robot_file())]
    pub robots: Vec<PathBuf>,
    #[command(flatten)]
    pub model: ModelArgs,
}

#[derive(Debug, Args)]
pub struct Verify {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// Number of random states: inside the limits, the base of a floating robot anywhere
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub states: u32,
    /// Seed of the random states
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// As JSON: {"robot": …, "bound": …, "functions": {"inverse_dynamics": {"error": …, "state": …}}}
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub program: ProgramArgs,
    #[command(flatten)]
    pub model: ModelArgs,
}

#[derive(Debug, Args)]
pub struct Export {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// The directory to write: new, empty, or an earlier export, whose files are replaced; others stay
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// The kind of package
    #[arg(long = "as", value_name = "KIND", value_parser = packages(), required_unless_present_any = ["c_abi", "c99"])]
    pub kind: Option<String>,
    /// Short for `--as c-abi`
    #[arg(long, conflicts_with_all = ["kind", "c99"])]
    pub c_abi: bool,
    /// Short for `--as c99`
    #[arg(long, conflicts_with = "kind")]
    pub c99: bool,
    /// How the C names begin [default: the robot's name]
    #[arg(long, value_parser = |text: &str| {
        is_prefix(text).then(|| text.to_string()).ok_or("up to 64 letters, digits and _ only, and no digit in front")
    })]
    pub prefix: Option<String>,
    #[command(flatten)]
    pub program: ProgramArgs,
    #[command(flatten)]
    pub model: ModelArgs,
}

/// The kinds of packages.
fn packages() -> impl TypedValueParser<Value = String> {
    possible(PACKAGES.iter().map(|p| (p.name, p.doc)).collect())
}

/// What is generated, and how.
pub type ProgramArgs = Given<{ OptionGroup::Program as u8 }>;

/// How the robot file is read.
#[derive(Debug, Args)]
pub struct ModelArgs {
    #[command(flatten)]
    given: Given<{ OptionGroup::Model as u8 }>,
    /// A scene (TOML): what is wanted of the robot, and what is held; everything else is skipped. Options given here count before its own
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    levels: Given<{ OptionGroup::Reporting as u8 }>,
    /// Say no warnings, show no progress
    #[arg(short, long)]
    quiet: bool,
}

impl ModelArgs {
    /// The options that are given, with those of a program.
    pub fn settings(&self, program: Option<&ProgramArgs>) -> GivenOptions {
        let mut settings = program.map(|program| program.settings.clone()).unwrap_or_default();
        settings.extend(&self.given.settings);
        settings.extend(&self.levels.settings);
        settings
    }

    /// Whether warnings and progress are left out.
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }
}

impl CommandLine {
    /// Reads these arguments.
    ///
    /// # Errors
    /// All that is wrong with them, each once: after a complaint about one, the others are read without it, or as it was
    /// meant. Also a request for help.
    pub fn read(mut given: Vec<OsString>) -> Result<CommandLine, Vec<clap::Error>> {
        let mut complaints = Vec::new();
        loop {
            let error = match CommandLine::try_parse_from(&given) {
                Ok(line) if complaints.is_empty() => return Ok(line),
                Ok(_) => return Err(complaints),
                Err(error) => by_its_name_here(error),
            };
            let further = without(&given, &error);
            complaints.push(error);
            match further.filter(|further| *further != given) {
                Some(further) => given = further,
                None => return Err(complaints),
            }
        }
    }
}

/// Prints complaints, the usage behind the last one, and ends; help is no failure.
pub fn exit(complaints: Vec<clap::Error>) -> ! {
    if let [only] = &complaints[..] {
        only.exit();
    }
    for (k, error) in complaints.iter().enumerate() {
        let text = error.to_string();
        let end = ["\nUsage:", "\nFor more information"].iter().filter_map(|word| text.find(word)).min();
        let is_last = k + 1 == complaints.len();
        anstream::eprintln!("{}\n", text[..end.filter(|_| !is_last).unwrap_or(text.len())].trim_end());
    }
    std::process::exit(2)
}

/// A complaint about a function says what it is called here if it is known by another name: RNEA is `inverse_dynamics`.
fn by_its_name_here(mut error: clap::Error) -> clap::Error {
    let is_about_functions = matches!(
        error.get(ContextKind::InvalidArg),
        Some(ContextValue::String(argument)) if argument.split(' ').next() == Some("--function")
    );
    let called = match error.get(ContextKind::InvalidValue) {
        Some(ContextValue::String(value)) if is_about_functions => Function::called(value),
        _ => None,
    };
    if let Some(function) = called {
        error.insert(ContextKind::SuggestedValue, ContextValue::String(function.name().to_string()));
    }
    error
}

/// The arguments without what the complaint is about, or with what was meant there; `None` where that is not known.
fn without(given: &[OsString], error: &clap::Error) -> Option<Vec<OsString>> {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let argument = text(ContextKind::InvalidArg)?.split([' ', '=', '[']).next()?;
    let at = |word: &str| given.iter().position(|given| given == word);
    let mut rest = given.to_vec();
    match error.kind() {
        ErrorKind::InvalidValue | ErrorKind::ValueValidation => {
            let value = text(ContextKind::InvalidValue)?;
            if let Some(joined) = at(&format!("{argument}={value}")) {
                rest.remove(joined);
            } else {
                let pair = given.windows(2).position(|pair| pair[0] == argument && pair[1] == value)?;
                rest.drain(pair..pair + 2);
            }
        }
        ErrorKind::UnknownArgument => match text(ContextKind::SuggestedArg) {
            Some(meant) => {
                let index = given.iter().position(|g| g.to_string_lossy().split('=').next() == Some(argument))?;
                rest[index] = given[index].to_string_lossy().replacen(argument, meant, 1).into();
            }
            None => {
                let index = at(argument)?;
                rest.remove(index);
                // its value goes with it; a file may be the robot
                let is_value = |next: &OsString| !next.to_string_lossy().starts_with('-') && !Path::new(next).exists();
                if rest.get(index).is_some_and(is_value) {
                    rest.remove(index);
                }
            }
        },
        _ => return None,
    }
    Some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn all_that_is_wrong_with_the_arguments_is_said_at_once() {
        let given = "straightline generate arm.urdf --function inverse_dynamic --scaler f46 --allow near-right-angel --function RNEA --gravity 1,2";
        let complaints = CommandLine::read(given.split(' ').map(OsString::from).collect()).unwrap_err();
        let said: Vec<String> = complaints.iter().map(ToString::to_string).collect();
        let parts = ["'inverse_dynamic'", "'--scalar'", "f64, f32", "`near-right-angle`", "'RNEA'", "0,0,-1.62"];
        assert_eq!(said.len(), parts.len(), "{said:?}");
        for part in parts {
            assert_eq!(said.iter().filter(|text| text.contains(part)).count(), 1, "{part}: {said:?}");
        }
    }

    #[test]
    fn a_value_of_an_option_that_is_not_there_hides_no_complaint() {
        for given in
            ["arm.urdf --lamda 3 --scalr f32", "--lamda 3 --scalr f32 arm.urdf", "--lamda Cargo.toml --scalr f32"]
        {
            let given = ["straightline", "generate"].into_iter().chain(given.split(' '));
            let complaints = CommandLine::read(given.map(OsString::from).collect()).unwrap_err();
            let said: Vec<String> = complaints.iter().map(ToString::to_string).collect();
            assert!(said.len() == 2 && said[0].contains("'--lamda'") && said[1].contains("'--scalar'"), "{said:?}");
        }
    }

    #[test]
    fn a_function_known_by_another_name_is_suggested() {
        for (alias, name) in [("RNEA", "'inverse_dynamics'"), ("crba", "'mass_matrix'"), ("ABA", "'forward_dynamics'")]
        {
            let given = ["straightline", "generate", "arm.urdf", "--function", alias].map(OsString::from);
            let [complaint] = &CommandLine::read(given.to_vec()).unwrap_err()[..] else { panic!("one complaint") };
            let said = complaint.to_string();
            let tip = said.lines().find(|line| line.contains("tip:")).unwrap_or_else(|| panic!("{said}"));
            assert!(tip.contains(name), "{said}");
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        CommandLine::command().debug_assert();
    }

    #[test]
    fn gravity_may_point_down() {
        let line = CommandLine::parse_from(["straightline", "check", "a.urdf", "--gravity", "-1,0,-9.81"]);
        let CliCommand::Check(check) = line.command else { panic!("check was asked for") };
        let mut options = straightline_codegen::Options::default();
        check.model.settings(None).apply(&mut options);
        assert_eq!(options.model.gravity, Some([-1.0, 0.0, -9.81]));
    }

    #[test]
    fn wrong_values_are_refused_with_what_is_right() {
        for (arguments, right) in [
            (&["generate", "a", "--function", "inverse_dynamic"][..], "inverse_dynamics"),
            (&["generate", "a", "--scalar", "f16"], "f64, f32"),
            (&["generate", "a", "--lanes=8"], "standalone, runtime"),
            (&["generate", "a", "--gravity", "1,2"], "0,0,-1.62"),
            (&["generate", "a", "--check"], "--output"),
            (&["export", "a", "-o", "b"], "--as"),
            (&["export", "a", "-o", "b", "--c-abi", "--c99"], "--c99"),
            (&["export", "a", "-o", "b", "--c99", "--as", "c99"], "--as"),
            (&["export", "a", "-o", "b", "--c-abi", "--prefix", "a-b"], "no digit in front"),
        ] {
            let error = CommandLine::try_parse_from([&["straightline"], arguments].concat()).unwrap_err();
            assert!(error.to_string().contains(right), "{error}");
            assert_eq!(error.exit_code(), 2);
        }
    }
}
