//! The commands `simulate` and `analyze`.

use crate::arguments::ModelArgs;
use crate::figures::{print_analysis, print_sweep};
use crate::files::{self, read};
pub use crate::motion_arguments::{Analyze, Simulate};
use crate::search::{optimized, swept};
pub use crate::view::{draw_range, view, ViewArguments};
use crate::{contact, gains, logs, options, page, print, view, CommandFailure};
use anstream::stdout;
use std::io::Write;
use std::path::Path;
use straightline_cli::experiment::equations::by_machine_code;
use straightline_cli::experiment::{self, parquet, Experiment};
use straightline_codegen::description::{self, Description};
use straightline_codegen::diagnostic::{Diagnostic, Diagnostics, Severity};
use straightline_codegen::model::singular::Inertia;
use straightline_codegen::options::{check_options, Options};
use straightline_codegen::program::demand_inertia::demand_inertia_for;
use straightline_codegen::{model, scene};
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_simulation::advice::{advise, affordable, Advice};
use straightline_simulation::analysis::{self, Analysis};
use straightline_simulation::command::Command;
use straightline_simulation::drives::state_of_motion;
use straightline_simulation::motion::Motion;
use straightline_simulation::plant::Plant;
use straightline_simulation::plot::{Line, Plot};
use straightline_simulation::table::DataTable;
use straightline_simulation::{contact as in_contact, simulate};

/// Size of a plot in pixels.
const PLOT: (u32, u32) = (900, 340);

/// The robot of a description in a scene; what is wrong with it goes to `diagnostics`.
pub fn built_in_full(description: &Description, options: &Options, diagnostics: &mut Diagnostics) -> Option<Model<Dd>> {
    let model = model::build(description, &options.scene.model_options(&options.model), diagnostics);
    let model = model.and_then(|model| scene::apply(model, &options.scene.knowing(&description.drives), diagnostics));
    model.filter(|_| !diagnostics.has_errors())
}

/// The same in f64.
pub fn built(description: &Description, options: &Options, diagnostics: &mut Diagnostics) -> Option<Model<f64>> {
    built_in_full(description, options, diagnostics).map(|model| model.cast())
}

/// The robot of a file; to be `moved` by forces, its joints have to feel some inertia.
pub fn robot(path: &Path, args: &ModelArgs, moved: bool) -> Result<(Description, Options, Model<f64>), CommandFailure> {
    let options = options(None, args)?;
    let source = read(path)?;
    let mut diagnostics = Diagnostics::reporting(&options.reporting);
    let description = description::read(&source, &mut diagnostics);
    check_options(&options, &mut diagnostics);
    let model = description.as_ref().and_then(|d| built_in_full(d, &options, &mut diagnostics));
    if let (Some(model), true) = (&model, moved) {
        demand_inertia_for("a simulation is", model, Inertia::WithDrives, &mut diagnostics);
    }
    print::diagnostics(&diagnostics, Severity::Warning);
    let model = model.filter(|_| !diagnostics.has_errors()).map(|model| model.cast());
    description.zip(model).map(|(d, model)| (d, options, model)).ok_or(CommandFailure::Input)
}

pub fn experiment(
    path: &Path,
    model: &Model<f64>,
    controller_model: &Model<f64>,
    are_torques: bool,
) -> Result<Experiment, CommandFailure> {
    let source = match parquet::is_parquet(path) {
        false => read(path)?,
        true => {
            files::note(path);
            parquet::source(path, &path.display().to_string()).map_err(|why| unreadable(path, &why))?
        }
    };
    // files count from the one that names them
    let beside = |name: &str| {
        let file = path.parent().unwrap_or(Path::new("")).join(name);
        files::note(&file);
        parquet::source(&file, &file.display().to_string()).map_err(|why| format!("{}: {why}", file.display()))
    };
    let mut diagnostics = Diagnostics::new();
    let experiment = experiment::read(&source, model, controller_model, are_torques, &beside, &mut diagnostics);
    print::diagnostics(&diagnostics, Severity::Warning);
    experiment.ok_or(CommandFailure::Input)
}

pub fn complained(complaint: Box<Diagnostic>) -> CommandFailure {
    let mut diagnostics = Diagnostics::new();
    diagnostics.push(*complaint);
    print::refused(&diagnostics)
}

pub fn unreadable(path: &Path, why: &str) -> CommandFailure {
    print::failure(format!("{}: {why}", path.display()))
}

/// Columns by name.
pub type Columns = Vec<(String, Vec<f64>)>;

/// The columns of a table.
pub fn columns(table: &DataTable) -> Columns {
    let column = |(k, name): (usize, &String)| (name.clone(), table.rows.iter().map(|row| row[k]).collect());
    table.names.iter().enumerate().map(column).collect()
}

/// Writes what a robot did, as a log with the poses of its frames where the file's name ends in .mcap, or else as any table.
pub fn write_run(path: &Path, table: &DataTable, model: &Model<f64>) -> Result<(), CommandFailure> {
    match path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")) {
        true => files::write(path, &logs::mcap_bytes(table, model)?),
        false => write_table(path, table),
    }
}

/// Writes a table as CSV, or as JSON or Parquet where the file's name says so.
pub fn write_table(path: &Path, table: &DataTable) -> Result<(), CommandFailure> {
    if parquet::is_parquet(path) {
        files::write(path, &parquet::bytes(table).map_err(|why| unreadable(path, &why))?)?;
        return Ok(());
    }
    let text = match path.extension().is_some_and(|e| e == "json") {
        true => {
            let columns = table.names.iter().enumerate().map(|(k, name)| {
                let numbers = table.rows.iter().map(|row| serde_json::Value::from(row[k])).collect();
                (name.clone(), serde_json::Value::Array(numbers))
            });
            serde_json::Value::Object(columns.collect()).to_string() + "\n"
        }
        false => table.csv(),
    };
    files::write(path, &text)?;
    Ok(())
}

/// The columns whose names begin so, as lines over time.
pub fn lines<'a>(table: &'a DataTable, prefix: &str) -> Vec<Line<'a>> {
    let of = |(k, name): (usize, &'a String)| {
        let name = name.strip_prefix(prefix)?;
        Some(Line { name, points: table.rows.iter().map(|row| (row[0], row[k])).collect() })
    };
    table.names.iter().enumerate().filter_map(of).collect()
}

pub fn undrawn(why: String) -> CommandFailure {
    print::failure(format!("the plot cannot be drawn: {why}"))
}

/// The state at the beginning: drives as the file says, else, where the robot starts in the motion that a controller follows, as that
/// motion has them, else with slack springs and without currents.
fn start(plant: &Plant, experiment: &Experiment) -> Vec<f64> {
    let (q, qd) = (&experiment.q[..], &experiment.qd[..]);
    let x = experiment.x.clone().or_else(|| match &experiment.command {
        Command::Controller(controller) if plant.is_driven() => {
            let first = controller.motion.times[0];
            let (r, rd, _) = controller.motion.at(first);
            (r == q && rd == qd).then(|| state_of_motion(&plant.model, &controller.motion, first)).flatten()
        }
        _ => None,
    });
    x.map_or_else(|| plant.state(q, qd), |x| plant.state_with(q, qd, &x))
}

pub fn simulate(a: &Simulate) -> Result<(), CommandFailure> {
    let (_, options, model) = robot(&a.robot, &a.model, true)?;
    let controller_model = match &a.controller_robot {
        None => model.clone(),
        Some(path) => {
            let other = robot(path, &a.model, false)?.2;
            if other.nv() != model.nv() {
                let (path, robot) = (path.display(), a.robot.display());
                let text = format!("{path} has {} velocities, {robot} has {}", other.nv(), model.nv());
                return Err(print::failure(text));
            }
            other
        }
    };
    let mut experiment = experiment(&a.input, &model, &controller_model, true)?;
    if let Some(most) = a.max_steps {
        experiment.settings.most_steps = most;
    }
    let contacts = contact::read(&a.input, &model, &options.scene.contacts)?;
    let currents = experiment.command.current_inputs(model.drives.len());
    let plant = by_machine_code(Plant::new(model, experiment.coulomb_speed).with_current_inputs(&currents));
    let bar = print::bar("simulating", 1000);
    let duration = experiment.settings.duration;
    let how_far = print::Progress::new();
    let progress = |t: f64| {
        bar.set_position((t / duration * 1000.0) as u64);
        how_far.say(|| format!("simulating, at t = {t:.3e} s of {duration} s"));
    };
    if !contacts.is_empty() {
        let (settings, start) = (&experiment.settings, start(&plant, &experiment));
        let run = in_contact::simulate_from(&plant, &contacts, &experiment.command, start, settings, &progress);
        bar.finish_and_clear();
        return contact::finish(a, &plant, &contacts, run);
    }
    let run = simulate::simulate_from(
        &plant,
        &experiment.command,
        start(&plant, &experiment),
        &experiment.settings,
        &progress,
    );
    bar.finish_and_clear();
    let run = run.map_err(|failure| failed(&failure))?;
    if let Some(path) = &a.output {
        write_run(path, &run.table, &plant.model)?;
    }
    if let Some(path) = &a.view {
        view::draw(path, &a.robot, &plant.model, (&a.input, &run.table))?;
    }
    if let Some(path) = &a.svg {
        let is_controlled = matches!(experiment.command, Command::Controller(_));
        let (prefix, title) = if is_controlled { ("error.", "tracking errors") } else { ("q.", "coordinates") };
        let mut lines = lines(&run.table, prefix);
        if is_controlled {
            // no controller leads what is passive
            let is_passive = |name: &str| plant.model.bodies.iter().any(|b| b.is_passive() && b.joint.name == name);
            lines.retain(|line| !is_passive(line.name));
        }
        let plot = Plot { title, axes: ("t [s]", "rad or m"), lines, levels: Vec::new() };
        files::write(path, &plot.svg(PLOT).map_err(undrawn)?)?;
    }
    print_run(&plant, &run)
}

pub fn failed(failure: &simulate::Failure) -> CommandFailure {
    print::failure_with(failure.to_string(), failure.help.as_slice())
}

/// Why a motion has no figures.
pub fn not_analysed(failure: &simulate::Failure) -> CommandFailure {
    let text = format!("the motion cannot be analysed: at t = {:?} s {}", failure.time, failure.why);
    print::failure_with(text, failure.help.as_slice())
}

pub fn print_run(plant: &Plant, run: &simulate::Run) -> Result<(), CommandFailure> {
    let mut out = stdout().lock();
    let balance = run.balance;
    let last = run.table.rows.last().map_or(0.0, |row| row[0]);
    writeln!(out, "{}: {last} s, {} steps, {} evaluations", plant.model.name, run.steps, run.evaluations)?;
    if let Some(stop) = &run.stop {
        writeln!(out, "stopped at {} s: joint {} reaches its limit {}", stop.time, stop.joint, stop.limit)?;
    }
    writeln!(out, "energy [J]: {:.9} before, {:.9} after", balance.before, balance.after)?;
    match plant.is_driven() {
        false => writeln!(out, "work of the drives {:.9}, heat of friction {:.9}", balance.work, balance.losses)?,
        true => {
            let e = balance.drives;
            writeln!(out, "electrical input {:.9}, work of other forces {:.9}", e.electrical, balance.work)?;
            writeln!(
                out,
                "Joule heat {:.9}, friction in motors {:.9}, in joints {:.9}",
                e.joule, e.friction, balance.losses
            )?;
            writeln!(
                out,
                "losses of gears {:.9}, of dampers {:.9}, of conversion {:.9}",
                e.gears, e.dampers, e.conversion
            )?;
        }
    }
    writeln!(out, "missing {:.2e}, {:.2e} of what was turned over", balance.missing(), balance.relative())?;
    Ok(())
}

pub fn analyze(a: &Analyze) -> Result<(), CommandFailure> {
    let (description, options, model) = robot(&a.robot, &a.model, false)?;
    let experiment = experiment(&a.motion, &model, &model, false)?;
    let Some(motion) = experiment.motion.clone() else {
        let text = format!("{} prescribes no motion", a.motion.display());
        return Err(print::failure_with(text, &["write a table [motion]"]));
    };
    let found = analysis::analyze(&model, &motion, a.interval).map_err(|failure| not_analysed(&failure))?;
    if let Some(path) = &a.output {
        write_run(path, &joined(&found), &model)?;
    }
    if let Some(path) = &a.view {
        view::draw(path, &a.robot, &model, (&a.motion, &joined(&found)))?;
    }
    let swept = match &a.sweep {
        None => Vec::new(),
        Some(sweep) => swept(&description, &options, sweep, &motion, a.interval)?,
    };
    let advice = advised(&model, &motion, a.interval, &found);
    let proposed = gains::proposed(a, &model, &motion, &experiment)?;
    if let Some(path) = &a.html {
        files::write(path, &page::page(a, &model, &motion, (&found, &advice), &swept, proposed.as_ref()))?;
    }
    print_analysis(&model, &motion, &found, &advice)?;
    if let Some(proposed) = &proposed {
        gains::print(proposed, a)?;
    }
    if let Some(sweep) = &a.sweep {
        print_sweep(sweep, &swept)?;
    }
    match a.optimize.is_empty() {
        true => Ok(()),
        false => optimized(a, &description, &options, &motion),
    }
}

/// All figures of an analysis over time.
pub fn joined(found: &Analysis) -> DataTable {
    let beside = |table: DataTable, other: &DataTable| DataTable {
        names: [&table.names[..], &other.names[1..]].concat(),
        rows: table.rows.iter().zip(&other.rows).map(|(a, b)| [&a[..], &b[1..]].concat()).collect(),
    };
    let joints = beside(found.table.clone(), &found.wrenches);
    found.drives.iter().fold(joints, |table, drives| beside(table, &drives.table))
}

/// What would keep the limits that are exceeded first.
fn advised(model: &Model<f64>, motion: &Motion, interval: f64, found: &Analysis) -> Vec<Vec<Advice>> {
    found.violations.iter().take(affordable(motion)).map(|v| advise(model, motion, interval, v)).collect()
}
