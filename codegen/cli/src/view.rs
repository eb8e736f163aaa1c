//! The command `view`: a robot in motion as a page for the browser.

use crate::arguments::{robot_file, ModelArgs, EXIT_CODES};
use crate::motion::{columns, experiment, joined, not_analysed, robot, unreadable};
use crate::{files, logs, print, CommandFailure};
use clap::Args;
use std::path::{Path, PathBuf};
use straightline_cli::experiment::{parquet, samples};
use straightline_codegen::diagnostic::{Diagnostics, Severity};
use straightline_core::model::Model;
use straightline_simulation::analysis::analyze;
use straightline_simulation::html::four_digits;
use straightline_simulation::table::DataTable;
use straightline_view::{page, urdf_look, ViewFailure, ViewedLook, ViewedRun};

/// Time between instants of a motion that is analysed, at most \[s\].
const INTERVAL: f64 = 0.01;

/// What `view` is told.
#[derive(Debug, Args)]
#[command(after_help = format!("\
RUN is what `simulate`, `analyze` or `residuals` writes (CSV, JSON or Parquet), or a log in MCAP: the columns q.JOINT move the robot, all columns are
plotted, and forces and torques are drawn as arrows. A motion in TOML (codegen/SIMULATION.md) is analysed first.
Without RUN each joint moves through its range in turn.

Examples:
  straightline view panda.urdf -o panda.html
  straightline simulate panda.urdf --input swing.toml --output swing.csv && straightline view panda.urdf swing.csv -o swing.html
  straightline view panda.urdf reach.toml -o reach.html
  straightline view solo12.urdf --floating-base -o solo12.html

{EXIT_CODES}"))]
pub struct ViewArguments {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// The run: what `simulate`, `analyze` or `residuals` wrote as CSV, JSON or Parquet, a log in MCAP or a folder of LeRobot, or a motion in TOML [default: each joint moves through its range]
    pub run: Option<PathBuf>,
    /// Where to write the page
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    #[command(flatten)]
    pub model: ModelArgs,
}

impl ViewArguments {
    /// How it reads the robot.
    pub fn model(&self) -> Option<&ModelArgs> {
        Some(&self.model)
    }
}

pub fn view(a: &ViewArguments) -> Result<(), CommandFailure> {
    let Some(path) = &a.run else { return draw_range(&a.output, &a.robot, &a.model) };
    let (_, _, model) = robot(&a.robot, &a.model, false)?;
    let run = match path.extension().is_some_and(|e| e == "toml") {
        true => prescribed(path, &model)?,
        false => of_file(path, &model)?,
    };
    written(&a.output, &a.robot, &model, &run, Some(path))
}

/// Draws a robot each of whose joints moves through its range.
pub fn draw_range(output: &Path, file: &Path, args: &ModelArgs) -> Result<(), CommandFailure> {
    let (_, _, model) = robot(file, args, false)?;
    written(output, file, &model, &ViewedRun::tour(&model), None)
}

/// Draws what a table says of a robot's motion, which came of this file.
pub fn draw(
    output: &Path,
    robot: &Path,
    model: &Model<f64>,
    (file, table): (&Path, &DataTable),
) -> Result<(), CommandFailure> {
    let run = ViewedRun::of_columns(model, &columns(table)).map_err(|failures| refused(Some(file), &failures))?;
    written(output, robot, model, &run, Some(file))
}

fn written(
    output: &Path,
    robot: &Path,
    model: &Model<f64>,
    run: &ViewedRun,
    of: Option<&Path>,
) -> Result<(), CommandFailure> {
    let file = |path: &Path| path.file_name().map(|name| name.to_string_lossy().to_string()).unwrap_or_default();
    let mut facts = vec![("Robot file", file(robot))];
    facts.extend(of.map(|path| ("Run", file(path))));
    if let [first, .., last] = run.times[..] {
        facts.push(("Duration", format!("{} s", four_digits(last - first))));
    }
    facts.push(("Drawn by", format!("straightline {}", straightline_codegen::VERSION)));
    let page = page(model, &look(robot, model)?, run, &facts).map_err(|failures| refused(of, &failures))?;
    files::write(output, &page)
}

/// What a URDF says of the robot's looks. Meshes are looked for beside the robot file, and in the packages whose folders it lies in.
fn look(robot: &Path, model: &Model<f64>) -> Result<ViewedLook, CommandFailure> {
    let source = files::read(robot)?;
    let whole = std::path::absolute(robot)?;
    let folder = whole.parent().unwrap_or(Path::new(""));
    let read = |name: &str| {
        let inside =
            ["package://", "model://", "file://"].iter().find_map(|scheme| name.strip_prefix(scheme)).unwrap_or(name);
        let of_package = inside.split_once('/').map_or("", |(_, rest)| rest);
        let places = folder.ancestors().flat_map(|at| [at.join(inside), at.join(of_package)]);
        let found = places.filter(|path| path.is_file()).find_map(|path| std::fs::read(path).ok());
        found.ok_or_else(|| "there is no such file at the robot file or above it".to_string())
    };
    Ok(urdf_look(source.text(), model, &read))
}

/// The columns of a file.
fn of_file(path: &Path, model: &Model<f64>) -> Result<ViewedRun, CommandFailure> {
    if path.is_dir() || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")) {
        let columns = logs::run_columns(path, model)?;
        return ViewedRun::of_columns(model, &columns).map_err(|failures| refused(Some(path), &failures));
    }
    let source = match parquet::is_parquet(path) {
        false => files::read(path)?,
        true => {
            files::note(path);
            parquet::source(path, &path.display().to_string()).map_err(|why| unreadable(path, &why))?
        }
    };
    let mut diagnostics = Diagnostics::new();
    let columns = samples::table(&source, &mut diagnostics);
    print::diagnostics(&diagnostics, Severity::Warning);
    let columns = columns.ok_or(CommandFailure::Input)?.columns;
    ViewedRun::of_columns(model, &columns).map_err(|failures| refused(Some(path), &failures))
}

/// The motion of a file with what it asks of the joints.
fn prescribed(path: &Path, model: &Model<f64>) -> Result<ViewedRun, CommandFailure> {
    let Some(motion) = experiment(path, model, model, false)?.motion else {
        let help = ["write a table [motion], or let `straightline simulate` write a run"];
        return Err(print::failure_with(format!("{} prescribes no motion", path.display()), &help));
    };
    let found = analyze(model, &motion, INTERVAL).map_err(|failure| not_analysed(&failure))?;
    ViewedRun::of_columns(model, &columns(&joined(&found))).map_err(|failures| refused(Some(path), &failures))
}

/// Says all of these.
fn refused(path: Option<&Path>, failures: &[ViewFailure]) -> CommandFailure {
    for ViewFailure { what, help } in failures {
        let file = path.map_or_else(String::new, |path| format!("{}: ", path.display()));
        print::failure_with(format!("{file}{what}"), &[help]);
    }
    CommandFailure::Input
}
