//! The commands `simulate` and `analyze`.

use crate::arguments::ModelArgs;
use crate::files::{self, read};
pub use crate::motion_arguments::{Analyze, Simulate};
use crate::{contact, options, page, print, Failure};
use anstream::stdout;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;
use straightline_cli::experiment::design::Design;
use straightline_cli::experiment::{self, parameter, parquet, Experiment};
use straightline_codegen::description::{self, Description};
use straightline_codegen::diagnostic::{six_digits, Diagnostic, Diagnostics, Severity};
use straightline_codegen::model::singular::Inertia;
use straightline_codegen::options::{check_options, Options};
use straightline_codegen::program::demand_inertia::demand_inertia_for;
use straightline_codegen::{model, scene};
use straightline_core::model::{Body, Model};
use straightline_core::Dd;
use straightline_simulation::advice::{advise, affordable, Advice};
use straightline_simulation::analysis::{self, Analysis};
use straightline_simulation::command::Command;
use straightline_simulation::drive_analysis::{DriveAnalysis, DriveFigures, Heating};
use straightline_simulation::drives::{further_derivatives, state_of_motion};
use straightline_simulation::html::four_digits;
use straightline_simulation::motion::Motion;
use straightline_simulation::optimize::{self, Sampled};
use straightline_simulation::plant::Plant;
use straightline_simulation::plot::{Line, Plot};
use straightline_simulation::table::Table;
use straightline_simulation::{contact as in_contact, simulate};

/// Size of a plot in pixels.
const PLOT: (u32, u32) = (900, 340);
/// A search takes about a minute at so many instants.
const MOST_SEARCHED: usize = 50_000;

/// The robot of a description in a scene; what is wrong with it goes to `diagnostics`.
fn built_in_full(description: &Description, options: &Options, diagnostics: &mut Diagnostics) -> Option<Model<Dd>> {
    let model = model::build(description, &options.scene.model_options(&options.model), diagnostics);
    let model = model.and_then(|model| scene::apply(model, &options.scene.knowing(&description.drives), diagnostics));
    model.filter(|_| !diagnostics.has_errors())
}

/// The same in f64.
fn built(description: &Description, options: &Options, diagnostics: &mut Diagnostics) -> Option<Model<f64>> {
    built_in_full(description, options, diagnostics).map(|model| model.cast())
}

/// The generated programs of a robot with some of its numbers as run-time parameters.
fn design(description: &Description, options: &Options, paths: &[&str]) -> Result<Design, Failure> {
    let build = |d: &Description| built_in_full(d, options, &mut Diagnostics::new());
    Design::new(description, &build, paths).map_err(|complaint| {
        let mut diagnostics = Diagnostics::new();
        diagnostics.push(*complaint);
        print::diagnostics(&diagnostics, Severity::Warning);
        Failure::Input
    })
}

/// Generated programs at these values of their parameters.
struct At<'a>(&'a Design, Vec<f64>);

/// The generated programs for parameters of which some are numbers of drives: torques of the joints do not depend on these.
struct Programs {
    design: Design,
    /// Which of all parameters the programs take.
    kept: Vec<usize>,
}

impl Programs {
    fn new(description: &Description, options: &Options, paths: &[&str]) -> Result<Programs, Failure> {
        let is_kept = |k: &usize| !parameter::is_of_drive(description, &options.scene.drives, paths[*k]);
        let kept: Vec<usize> = (0..paths.len()).filter(is_kept).collect();
        let design = design(description, options, &kept.iter().map(|k| paths[*k]).collect::<Vec<_>>())?;
        Ok(Programs { design, kept })
    }

    /// The values that the programs take.
    fn kept(&self, values: &[f64]) -> Vec<f64> {
        self.kept.iter().map(|k| values[*k]).collect()
    }

    fn at(&self, values: &[f64]) -> At<'_> {
        At(&self.design, self.kept(values))
    }
}

/// A robot with other numbers in its file and in the drives of its scene.
fn changed(
    description: &Description,
    options: &Options,
    path: &str,
    value: f64,
) -> Result<(Description, Options), Box<Diagnostic>> {
    let (description, drives) = parameter::with_drives(description, &options.scene.drives, path, value)?;
    let mut options = options.clone();
    options.scene.drives = drives;
    Ok((description, options))
}

impl analysis::Equations for At<'_> {
    fn torques(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
        self.0.torques(q, qd, qdd, &self.1)
    }

    fn wrenches(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<[f64; 6]> {
        self.0.wrenches(q, qd, qdd, &self.1)
    }
}

/// The robot of a file; to be `moved` by forces, its joints have to feel some inertia.
fn robot(path: &Path, args: &ModelArgs, moved: bool) -> Result<(Description, Options, Model<f64>), Failure> {
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
    description.zip(model).map(|(d, model)| (d, options, model)).ok_or(Failure::Input)
}

fn experiment(
    path: &Path,
    model: &Model<f64>,
    controller_model: &Model<f64>,
    are_torques: bool,
) -> Result<Experiment, Failure> {
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
    experiment.ok_or(Failure::Input)
}

fn unreadable(path: &Path, why: &str) -> Failure {
    print::error(&format!("{}: {why}", path.display()));
    Failure::Input
}

/// Writes a table as CSV, or as JSON or Parquet where the file's name says so.
pub fn write_table(path: &Path, table: &Table) -> Result<(), Failure> {
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
pub fn lines<'a>(table: &'a Table, prefix: &str) -> Vec<Line<'a>> {
    let of = |(k, name): (usize, &'a String)| {
        let name = name.strip_prefix(prefix)?;
        Some(Line { name, points: table.rows.iter().map(|row| (row[0], row[k])).collect() })
    };
    table.names.iter().enumerate().filter_map(of).collect()
}

fn drawn(plot: &Plot) -> Result<String, Failure> {
    plot.svg(PLOT).map_err(|why| {
        print::error(&format!("the plot cannot be drawn: {why}"));
        Failure::Input
    })
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

pub fn simulate(a: &Simulate) -> Result<(), Failure> {
    let (_, options, model) = robot(&a.robot, &a.model, true)?;
    let controller_model = match &a.controller_robot {
        None => model.clone(),
        Some(path) => {
            let other = robot(path, &a.model, false)?.2;
            if other.nv() != model.nv() {
                let (path, robot) = (path.display(), a.robot.display());
                print::error(&format!("{path} has {} velocities, {robot} has {}", other.nv(), model.nv()));
                return Err(Failure::Input);
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
    let plant = Plant::new(model, experiment.coulomb_speed).with_current_inputs(&currents);
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
        write_table(path, &run.table)?;
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
        files::write(path, &drawn(&plot)?)?;
    }
    print_run(&plant, &run)
}

pub fn failed(failure: &simulate::Failure) -> Failure {
    print::error(&failure.to_string());
    failure.help.iter().for_each(|help| print::help(help));
    Failure::Input
}

/// Why a motion has no figures.
fn not_analysed(failure: &simulate::Failure) -> Failure {
    print::error(&format!("the motion cannot be analysed: at t = {:?} s {}", failure.time, failure.why));
    failure.help.iter().for_each(|help| print::help(help));
    Failure::Input
}

pub fn print_run(plant: &Plant, run: &simulate::Run) -> Result<(), Failure> {
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

pub fn analyze(a: &Analyze) -> Result<(), Failure> {
    let (description, options, model) = robot(&a.robot, &a.model, false)?;
    let Some(motion) = experiment(&a.motion, &model, &model, false)?.motion else {
        print::error(&format!("{} prescribes no motion", a.motion.display()));
        print::help("write a table [motion]");
        return Err(Failure::Input);
    };
    let found = analysis::analyze(&model, &motion, a.interval).map_err(|failure| not_analysed(&failure))?;
    if let Some(path) = &a.output {
        write_table(path, &joined(&found))?;
    }
    let swept = match &a.sweep {
        None => Vec::new(),
        Some(sweep) => swept(&description, &options, sweep, &motion, a.interval)?,
    };
    let advice = advised(&model, &motion, a.interval, &found);
    if let Some(path) = &a.html {
        files::write(path, &page::page(a, &model, &motion, (&found, &advice), &swept))?;
    }
    print_analysis(&model, &motion, &found, &advice)?;
    if let Some(sweep) = &a.sweep {
        print_sweep(sweep, &swept)?;
    }
    match a.optimize.is_empty() {
        true => Ok(()),
        false => optimized(a, &description, &options, &motion),
    }
}

/// The robot file with these values of the parameters that are optimised; what is wrong is printed.
fn with(a: &Analyze, description: &Description, options: &Options, values: &[f64]) -> Result<Model<f64>, Failure> {
    let (mut description, mut options) = (description.clone(), options.clone());
    let mut diagnostics = Diagnostics::new();
    for (range, value) in a.optimize.iter().zip(values) {
        match changed(&description, &options, &range.path, *value) {
            Ok(changed) => (description, options) = changed,
            Err(complaint) => diagnostics.push(*complaint),
        }
    }
    let model = if diagnostics.has_errors() { None } else { built(&description, &options, &mut diagnostics) };
    model.ok_or_else(|| {
        print::diagnostics(&diagnostics, Severity::Error);
        Failure::Input
    })
}

/// Looks for the best values and prints them beside those of the robot file.
fn optimized(a: &Analyze, description: &Description, options: &Options, motion: &Motion) -> Result<(), Failure> {
    // both ends of all ranges must be robots, so that everything between them is one
    let ends = |end: fn(&(f64, f64)) -> f64| a.optimize.iter().map(|r| end(&r.ends)).collect::<Vec<f64>>();
    with(a, description, options, &ends(|e| e.0))?;
    with(a, description, options, &ends(|e| e.1))?;
    let states = analysis::states(motion, a.interval);
    if states.len() > MOST_SEARCHED {
        let instants = states.len();
        print::error(&format!("a search runs through the motion hundreds of times, which has {instants} instants"));
        print::help(&format!(
            "at most {MOST_SEARCHED} instants are searched: a greater --interval, or a shorter motion"
        ));
        return Err(Failure::Input);
    }
    let paths: Vec<&str> = a.optimize.iter().map(|range| range.path.as_str()).collect();
    let programs = Programs::new(description, options, &paths)?;
    let mut diagnostics = Diagnostics::new();
    let Some(model) = built(description, options, &mut diagnostics) else { return Err(Failure::Input) };
    if a.minimize.is_of_drives() && drive_analysis_is_missing(&model) {
        print::error(
            "what drives take cannot be minimised: the robot has no drives whose inputs follow from its motion",
        );
        print::help("drives are tables [[drive]] of the robot file or of a scene: --scene");
        return Err(Failure::Input);
    }
    let progress = print::spinner("optimising");
    let mut bodies: Vec<_> = model.bodies.iter().collect();
    bodies.sort_by_key(|b| b.joint.iv);
    let effort = |b: &&Body<f64>| if b.is_passive() { f64::INFINITY } else { b.joint.limits.effort };
    let efforts: Vec<f64> = bodies.iter().map(effort).collect();
    let ranges: Vec<(f64, f64)> = a.optimize.iter().map(|r| r.ends).collect();
    let (times, qd): (Vec<f64>, Vec<Vec<f64>>) = states.iter().map(|(t, [_, qd, _])| (*t, qd.clone())).unzip();
    let by_gradient = |p: &[f64]| {
        let of_design = programs.kept(p);
        let design = &programs.design;
        let tau: Vec<Vec<f64>> =
            states.iter().map(|(_, [q, qd, qdd])| design.torques(q, qd, qdd, &of_design)).collect();
        let sampled = Sampled { times: &times, qd: &qd, tau: &tau, efforts: &efforts };
        let (cost, slopes) = a.minimize.with_slopes(sampled);
        let mut gradient = vec![0.0; p.len()];
        for ((_, [q, qd, qdd]), seed) in states.iter().zip(&slopes).filter(|(_, s)| s.iter().any(|x| *x != 0.0)) {
            let more = design.gradient(q, qd, qdd, &of_design, seed);
            programs.kept.iter().zip(more).for_each(|(k, x)| gradient[*k] += x);
        }
        (cost, gradient)
    };
    // limits of drives count, too, which takes the drives of each robot
    let of_values = |values: &[f64]| {
        let at = programs.at(values);
        let found = match model.drives.is_empty() {
            true => analysis::analyze_by(&model, &at, motion, a.interval),
            false => match with(a, description, options, values) {
                Ok(model) => analysis::analyze_by(&model, &at, motion, a.interval),
                Err(_) => return f64::INFINITY,
            },
        };
        found.map_or(f64::INFINITY, |found| a.minimize.with_limits(&found, &efforts))
    };
    // what drives take does not follow from torques alone: differences along each number
    let by_difference = |p: &[f64]| {
        let slope = |k: usize| {
            let h = 1e-4 * (ranges[k].1 - ranges[k].0);
            let ends = [(p[k] - h).max(ranges[k].0), (p[k] + h).min(ranges[k].1)];
            let [low, high] = ends.map(|x| of_values(&[&p[..k], &[x], &p[k + 1..]].concat()));
            (high - low) / (ends[1] - ends[0])
        };
        (of_values(p), (0..p.len()).map(slope).collect::<Vec<f64>>())
    };
    let downhill = match a.minimize.is_of_drives() || programs.kept.len() < ranges.len() {
        true => optimize::descend(by_difference, &ranges),
        false => optimize::descend(by_gradient, &ranges),
    };
    let best = downhill.and_then(|downhill| {
        let best = optimize::minimise_from(of_values, &ranges, &downhill.point, 0.02)?;
        Ok((downhill, best))
    });
    progress.finish_and_clear();
    let (downhill, best) = best.map_err(|why| {
        print::error(&format!("no optimum was found: {why}"));
        Failure::Input
    })?;
    let as_written = analysis::analyze(&model, motion, a.interval).map_err(|failure| not_analysed(&failure))?;
    let as_written = a.minimize.with_limits(&as_written, &efforts);
    if !as_written.is_finite() {
        print::error(&format!("what is to be least is {as_written} of the robot file itself, not a finite number"));
        return Err(Failure::Input);
    }
    let mut out = stdout().lock();
    let (steps, analyses) = (downhill.evaluations, best.evaluations);
    writeln!(out, "\nbest values after {steps} evaluations along the gradient and {analyses} analyses:")?;
    for (range, value) in a.optimize.iter().zip(&best.point) {
        writeln!(out, "  {} = {value:.6} (from {} to {})", range.path, range.ends.0, range.ends.1)?;
    }
    let word = optimize::Objective::WORDS.iter().find(|w| w.1 == a.minimize).map_or("", |w| w.0);
    writeln!(out, "{word} {:.6}, as the robot file is {as_written:.6}", best.cost)?;
    Ok(())
}

fn drive_analysis_is_missing(model: &Model<f64>) -> bool {
    model.drives.is_empty() || further_derivatives(model).is_none()
}

fn joined(found: &Analysis) -> Table {
    let beside = |table: Table, other: &Table| Table {
        names: [&table.names[..], &other.names[1..]].concat(),
        rows: table.rows.iter().zip(&other.rows).map(|(a, b)| [&a[..], &b[1..]].concat()).collect(),
    };
    let joints = beside(found.table.clone(), &found.wrenches);
    found.drives.iter().fold(joints, |table, drives| beside(table, &drives.table))
}

/// One value of a sweep, with what it leads to.
pub type Swept = (f64, Analysis);

/// The motion of robots with other numbers, in parallel.
fn swept(
    description: &Description,
    options: &Options,
    sweep: &parameter::Sweep,
    motion: &Motion,
    interval: f64,
) -> Result<Vec<Swept>, Failure> {
    let mut models = Vec::new();
    for &value in &sweep.values {
        let (changed, in_scene) = changed(description, options, &sweep.path, value).map_err(|complaint| {
            let mut diagnostics = Diagnostics::new();
            diagnostics.push(*complaint);
            print::diagnostics(&diagnostics, Severity::Warning);
            Failure::Input
        })?;
        let mut diagnostics = Diagnostics::new();
        let Some(model) = built(&changed, &in_scene, &mut diagnostics) else {
            print::error(&format!("{} = {value}:", sweep.path));
            print::diagnostics(&diagnostics, Severity::Error);
            return Err(Failure::Input);
        };
        models.push((value, model));
    }
    let programs = Programs::new(description, options, &[&sweep.path])?;
    let bar = print::bar("sweeping", models.len() as u64);
    let (next, results) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(models.len());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((value, model)) = models.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let found = analysis::analyze_by(model, &programs.at(&[*value]), motion, interval);
                    results.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((*value, found));
                    bar.inc(1);
                }
            });
        }
    });
    bar.finish_and_clear();
    let mut results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let place = |value: f64| sweep.values.iter().position(|v| *v == value);
    results.sort_by_key(|(value, _)| place(*value));
    let sound = |(value, found): (f64, Result<Analysis, simulate::Failure>)| {
        found.map(|found| (value, found)).map_err(|failure| {
            print::error(&format!("{} = {value}:", sweep.path));
            not_analysed(&failure)
        })
    };
    results.into_iter().map(sound).collect()
}

const HEAD: [&str; 10] =
    ["joint", "peak", "at [s]", "rms", "speed", "power [W]", "given [J]", "taken [J]", "force [N]", "moment [N·m]"];

fn figures(found: &Analysis) -> Vec<Vec<String>> {
    let row = |j: &analysis::JointFigures| {
        let number = |x: f64| format!("{x:.4}");
        let unit = |x: f64| format!("{x:.4} {}", j.unit);
        let (peak, at) = j.peak;
        let (force, moment) = j.carried;
        vec![
            j.name.clone(),
            unit(peak),
            number(at),
            unit(j.rms),
            number(j.speed),
            number(j.power),
            number(j.given),
            number(j.taken),
            number(force),
            number(moment),
        ]
    };
    found.joints.iter().map(row).collect()
}

const DRIVE_HEAD: [&str; 12] = [
    "drive",
    "input",
    "current [A]",
    "rms [A]",
    "speed [1/s]",
    "torque [N·m]",
    "power [W]",
    "taken [J]",
    "given back",
    "heat [J]",
    "winding [°C]",
    "settled [°C]",
];

fn drive_figures(drives: &DriveAnalysis) -> Vec<Vec<String>> {
    let row = |d: &DriveFigures| {
        let number = |x: f64| format!("{x:.4}");
        let of = |heat: fn(&Heating) -> f64| d.heating.as_ref().map_or("-".to_string(), |h| format!("{:.2}", heat(h)));
        let numbers =
            [d.input.0, d.current.0, d.rms_current, d.speed, d.torque, d.power, d.energy.0, d.energy.1, d.joule];
        let heats = [of(|h| h.peak), of(|h| h.settled.0)];
        std::iter::once(d.name.clone()).chain(numbers.map(number)).chain(heats).collect()
    };
    drives.drives.iter().map(row).collect()
}

/// What is to be said of drives beside their figures and limits.
pub fn drive_remarks(model: &Model<f64>, found: &Analysis) -> Vec<String> {
    let Some(drives) = &found.drives else {
        return match model.drives.is_empty() {
            true => Vec::new(),
            false => vec!["the inputs of the drives do not follow from a motion: figures of joints only".to_string()],
        };
    };
    let heats = |d: &DriveFigures| {
        let after = d.heating?.limit_after?;
        Some(format!("{}: the motion over and over again brings the winding to its limit after {after:.1} s", d.name))
    };
    let mut remarks: Vec<String> = drives.drives.iter().filter_map(heats).collect();
    if let Some(jump) = drives.jump {
        let mut joints: Vec<_> = model.bodies.iter().map(|b| &b.joint).collect();
        joints.sort_by_key(|j| j.iv);
        let (joint, order, time) = (&joints[jump.coordinate].name, jump.order, jump.time);
        remarks.push(format!(
            "t = {time:.6} s: derivative {order} of {joint} jumps, and drives cannot follow: choose a motion of kind `smooth`"
        ));
    }
    remarks
}

/// Where the work of the drives went.
fn books(found: &Analysis) -> String {
    let (given, change, friction) = (found.given(), found.energy_change, found.friction);
    let turned: f64 = found.joints.iter().map(|j| j.given + j.taken).sum();
    let open = match found.missing() {
        missing if missing.abs() <= 1e-9 * turned => String::new(),
        missing => format!(" ({missing:.1e} J is left by the integrals over these instants: --interval)"),
    };
    format!(
        "drives give {given:.6} J: energy changes by {change:.6} J, friction in the joints takes {friction:.6} J{open}"
    )
}

/// Limits that are exceeded, and what would keep the first ones of each kind.
pub fn violations(found: &Analysis, advice: &[Vec<Advice>]) -> Vec<String> {
    let line = |(k, v): (usize, &analysis::Violation)| {
        let analysis::Violation { time, joint, what, limit, worst } = v;
        let line = format!("t = {time:.6} s: {what} of {joint} leaves {limit}, worst {worst:.6}");
        let remedies: Vec<String> = advice.get(k).into_iter().flatten().map(Advice::to_string).collect();
        match remedies.is_empty() {
            true => line,
            false => format!("{line}; each by itself would keep it: {}", remedies.join(", or ")),
        }
    };
    found.violations.iter().enumerate().map(line).collect()
}

/// What would keep the limits that are exceeded first.
fn advised(model: &Model<f64>, motion: &Motion, interval: f64, found: &Analysis) -> Vec<Vec<Advice>> {
    found.violations.iter().take(affordable(motion)).map(|v| advise(model, motion, interval, v)).collect()
}

fn print_analysis(
    model: &Model<f64>,
    motion: &Motion,
    found: &Analysis,
    advice: &[Vec<Advice>],
) -> Result<(), Failure> {
    let mut out = stdout().lock();
    writeln!(out, "{}: {} s, {} instants\n", model.name, motion.duration(), found.table.rows.len())?;
    let names = model.bodies.iter().map(|b| &b.joint.name).chain(model.drives.iter().map(|d| &d.name));
    let width = names.map(|name| name.chars().count()).max().unwrap_or(5).max(5);
    let line = |row: &mut dyn Iterator<Item = &str>| -> String {
        let cell = |(k, cell): (usize, &str)| if k == 0 { format!("{cell:<width$}") } else { format!("{cell:>14}") };
        row.enumerate().map(cell).collect()
    };
    writeln!(out, "{}", line(&mut HEAD.iter().copied()))?;
    for row in figures(found) {
        writeln!(out, "{}", line(&mut row.iter().map(String::as_str)))?;
    }
    if let Some(drives) = &found.drives {
        writeln!(out, "\n{}", line(&mut DRIVE_HEAD.iter().copied()))?;
        for row in drive_figures(drives) {
            writeln!(out, "{}", line(&mut row.iter().map(String::as_str)))?;
        }
    }
    for remark in drive_remarks(model, found) {
        writeln!(out, "{remark}")?;
    }
    writeln!(out, "\n{}", books(found))?;
    match found.violations.is_empty() {
        true => writeln!(out, "within all limits")?,
        false => writeln!(out, "limits exceeded, the first one first:\n  {}", violations(found, advice).join("\n  "))?,
    }
    Ok(())
}

fn print_sweep(sweep: &parameter::Sweep, swept: &[Swept]) -> Result<(), Failure> {
    let mut out = stdout().lock();
    let has_drives = swept.iter().any(|(_, found)| found.drives.is_some());
    let of_drives = if has_drives { format!("{:>16}{:>12}", "electrical [J]", "heat [J]") } else { String::new() };
    let gap = if has_drives { " ".repeat(28) } else { String::new() };
    // every joint's peak under its name
    let names: Vec<String> = swept
        .first()
        .map_or_else(Vec::new, |(_, found)| found.joints.iter().map(|j| format!("{} [{}]", j.name, j.unit)).collect());
    let heads: String = names.iter().map(|name| format!("  {name:>12}")).collect();
    let width = sweep.path.chars().count().max(14);
    writeln!(out, "\n{:<width$}{:>14}{:>14}{gap}{:>12}  peaks:", "", "", "", "")?;
    writeln!(out, "{:<width$}{:>14}{:>14}{of_drives}{:>12}{heads}", sweep.path, "given [J]", "taken [J]", "exceeded")?;
    for (value, found) in swept {
        let sum = |f: fn(&analysis::JointFigures) -> f64| found.joints.iter().map(f).sum::<f64>();
        let peak = |(name, j): (&String, &analysis::JointFigures)| {
            format!("  {:>1$}", four_digits(j.peak.0), name.chars().count().max(12))
        };
        let peaks: String = names.iter().zip(&found.joints).map(peak).collect();
        let (given, taken) = (sum(|j| j.given), sum(|j| j.taken));
        let exceeded = found.violations.len();
        let of_drives = found.drives.as_ref().map_or(String::new(), |drives| {
            let sum = |f: fn(&DriveFigures) -> f64| drives.drives.iter().map(f).sum::<f64>();
            format!("{:>16.4}{:>12.4}", sum(|d| d.energy.0), sum(|d| d.joule))
        });
        // one between two ends has as many digits as f64 has
        let value = six_digits(*value);
        writeln!(out, "{value:<width$}{given:>14.4}{taken:>14.4}{of_drives}{exceeded:>12}{peaks}")?;
    }
    Ok(())
}
