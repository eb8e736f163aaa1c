//! Experiment files: what a robot is to do in a simulation or an analysis. TOML, documented in `SIMULATION.md`.
//!
//! Every complaint has its place, and all come in one run.

pub mod contact;
pub mod design;
pub mod equations;
mod gains;
pub mod messages;
pub mod parameter;
pub mod parquet;
pub mod samples;
mod toml;

use self::messages as say;
use self::samples::Columns;
use straightline_codegen::diagnostic::{Diagnostic, Diagnostics, Place, Source};
use straightline_core::drive::Actuator;
use straightline_core::model::Model;
use straightline_simulation::command::{Command, Samples};
use straightline_simulation::drives::Inputs;
use straightline_simulation::gains::GainDemand;
use straightline_simulation::motion::Motion;
use straightline_simulation::plant::angle_beyond_sines;
use straightline_simulation::simulate::Settings;

/// An experiment.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// The motion that it prescribes, if any.
    pub motion: Option<Motion>,
    /// What drives the robot.
    pub command: Command,
    /// Configuration at the beginning.
    pub q: Vec<f64>,
    /// Velocity at the beginning.
    pub qd: Vec<f64>,
    /// State of the drives at the beginning, if the file gives it.
    pub x: Option<Vec<f64>>,
    /// How it is simulated.
    pub settings: Settings,
    /// Speed at which Coulomb friction has reached 71 % \[rad/s or m/s\], where it is not smooth already.
    pub coulomb_speed: f64,
    /// What is wanted of feedback gains, if anything.
    pub gains: Option<GainDemand>,
}

/// Where files that an experiment names are read from.
pub type ReadFile<'a> = &'a dyn Fn(&str) -> Result<Source, String>;

/// Speed of smooth friction, unless the file says it \[rad/s or m/s\].
const COULOMB_SPEED: f64 = 1e-3;

/// Reads an experiment: a TOML file, or samples: of torques if `samples_are_torques`, else of a motion. Complaints go to
/// `diagnostics`; `None` after errors.
pub fn read(
    source: &Source,
    model: &Model<f64>,
    controller_model: &Model<f64>,
    samples_are_torques: bool,
    read_file: ReadFile,
    diagnostics: &mut Diagnostics,
) -> Option<Experiment> {
    let mut found = Diagnostics::new();
    found.add_source(source);
    let experiment = match source.path().ends_with(".toml") {
        true => toml::read(source, model, controller_model, read_file, &mut found),
        false => from_samples(source, model, samples_are_torques, &mut found),
    };
    found.sort();
    let sound = !found.has_errors();
    diagnostics.extend(found);
    experiment.filter(|_| sound)
}

fn names(model: &Model<f64>) -> Vec<&str> {
    model.joints().iter().map(|j| j.name.as_str()).collect()
}

/// The names of the joints that have velocities, in their order.
fn moving(model: &Model<f64>) -> Vec<&str> {
    model.joints().iter().filter(|j| j.iv < model.nv()).map(|j| j.name.as_str()).collect()
}

/// Zero, or the nearest that the joints' ranges allow; a base at the origin. Of a robot with loops the configuration in which the compiler closed them.
fn zero(model: &Model<f64>) -> Vec<f64> {
    if !model.closure.is_empty() {
        return model.closure.home.clone();
    }
    let mut q = vec![0.0; model.nq()];
    for joint in model.free_joints() {
        for (q, neutral) in q[joint.iq..].iter_mut().zip(joint.kind.row().neutral) {
            *q = neutral.max(joint.limits.lower).min(joint.limits.upper);
        }
    }
    q
}

fn from_samples(
    source: &Source,
    model: &Model<f64>,
    are_torques: bool,
    diagnostics: &mut Diagnostics,
) -> Option<Experiment> {
    let columns = samples::read(source, diagnostics)?;
    let place = source.place(0..0);
    let q = zero(model);
    if !are_torques {
        let motion = sampled_motion(&columns, model, &place, diagnostics)?;
        let (q, qd, _) = motion.at(motion.times[0]);
        let settings = Settings::lasting(motion.duration());
        let motion = Some(motion);
        return Some(Experiment {
            motion,
            command: Command::Free,
            q,
            qd,
            x: None,
            settings,
            coulomb_speed: COULOMB_SPEED,
            gains: None,
        });
    }
    let last = columns.get("t")?.last().copied().unwrap_or(0.0);
    let (command, qd) = (sampled_command(columns, model, &place, diagnostics)?, vec![0.0; model.nv()]);
    let settings = Settings::lasting(last);
    Some(Experiment { motion: None, command, q, qd, x: None, settings, coulomb_speed: COULOMB_SPEED, gains: None })
}

/// Torques over time: per joint a column `tau.JOINT` or `JOINT`; joints without one are free.
fn torques(columns: &Columns, model: &Model<f64>, place: &Place, diagnostics: &mut Diagnostics) -> Option<Samples> {
    let times = columns.get("t")?.to_vec();
    let mut rows = vec![vec![0.0; model.nv()]; times.len()];
    let known = moving(model);
    for (name, column) in columns.columns.iter().filter(|(name, _)| name != "t") {
        let joint = name.strip_prefix("tau.").unwrap_or(name);
        let Some(joint) = model.independent_joints().find(|j| j.name == joint && j.kind.is_single()) else {
            diagnostics.push(say::column_unknown(name, &known).at(place));
            continue;
        };
        rows.iter_mut().zip(column).for_each(|(row, x)| row[joint.iv] = *x);
    }
    Some(Samples { times, rows })
}

/// Torques and inputs of drives from the columns of one file: those of drives begin with `u.` or `i.`.
fn sampled_command(
    columns: Columns,
    model: &Model<f64>,
    place: &Place,
    diagnostics: &mut Diagnostics,
) -> Option<Command> {
    let is_input = |name: &str| !model.drives.is_empty() && INPUT_PREFIXES.iter().any(|p| name.starts_with(p));
    let of = |wants_inputs: bool| Columns {
        columns: columns.columns.iter().filter(|(n, _)| n == "t" || is_input(n) == wants_inputs).cloned().collect(),
    };
    let (inputs, others) = (of(true), of(false));
    let torques = match others.columns.len() {
        1 => None,
        _ => Some(torques(&others, model, place, diagnostics)?),
    };
    match inputs.columns.len() {
        1 => torques.map(Command::Torques).or(Some(Command::Free)),
        _ => Some(Command::Inputs(drive_inputs(&inputs, model, place, diagnostics)?, torques)),
    }
}

/// How columns of drives begin: voltages, or whatever the inputs are, and currents.
const INPUT_PREFIXES: [&str; 2] = ["u.", "i."];

/// Inputs of drives over time: per drive a column `u.DRIVE`, `DRIVE` (volts, or the input's unit) or `i.DRIVE` (amperes, of a motor);
/// drives without one have the input zero.
fn drive_inputs(columns: &Columns, model: &Model<f64>, place: &Place, diagnostics: &mut Diagnostics) -> Option<Inputs> {
    let times = columns.get("t")?.to_vec();
    let mut rows = vec![vec![0.0; model.drives.len()]; times.len()];
    let mut are_currents = vec![false; model.drives.len()];
    let mut given = are_currents.clone();
    let known: Vec<&str> = model.drives.iter().map(|d| d.name.as_str()).collect();
    for (name, column) in columns.columns.iter().filter(|(name, _)| name != "t") {
        let current = name.strip_prefix("i.");
        let drive = current.or(name.strip_prefix("u.")).unwrap_or(name);
        let Some(k) = known.iter().position(|n| *n == drive) else {
            diagnostics.push(say::column_of_no_drive(name, &known).at(place));
            continue;
        };
        if current.is_some() && !matches!(model.drives[k].actuator, Actuator::Motor(_)) {
            diagnostics.push(say::current_without_motor(drive).at(place));
        }
        if given[k] {
            diagnostics.push(say::two_inputs(drive).at(place));
        }
        (given[k], are_currents[k]) = (true, current.is_some());
        rows.iter_mut().zip(column).for_each(|(row, x)| row[k] = *x);
    }
    Some(Inputs { samples: Samples { times, rows }, are_currents })
}

/// Why no motion is given by a number per joint; `None` of robots whose joints all have one.
fn unmovable(model: &Model<f64>, what: &str) -> Option<Diagnostic> {
    if model.floats() {
        return Some(say::base_floats(what));
    }
    if let Some(joint) = model.dependent_joints().next() {
        return Some(say::determined_moving(what, &joint.name));
    }
    let other = model.bodies.iter().map(|body| &body.joint).find(|joint| !joint.kind.is_single())?;
    Some(say::several_moving(what, &other.name, other.kind.row().name))
}

/// A motion from samples: per joint a column `q.JOINT` or `JOINT`; where all have `qd.` and `qdd.` as well, these count.
fn sampled_motion(
    columns: &Columns,
    model: &Model<f64>,
    place: &Place,
    diagnostics: &mut Diagnostics,
) -> Option<Motion> {
    if let Some(complaint) = unmovable(model, "a motion") {
        diagnostics.push(complaint.at(place));
        return None;
    }
    let times = columns.get("t")?;
    let column = |prefix: &str, joint: &str| columns.get(&format!("{prefix}.{joint}"));
    let mut q = Vec::new();
    let rest = vec![0.0; times.len()];
    let is_passive = |joint: &str| model.bodies.iter().any(|b| b.joint.name == joint && b.is_passive());
    for joint in names(model) {
        let given = column("q", joint).or_else(|| columns.get(joint));
        match given.or_else(|| is_passive(joint).then_some(&rest[..])) {
            Some(values) => q.push(values),
            None => diagnostics.push(say::column_missing(joint, &columns.names()).at(place)),
        }
    }
    if q.len() < model.nv() {
        return None;
    }
    let rows = |columns: &[&[f64]]| -> Vec<Vec<f64>> {
        (0..times.len()).map(|k| columns.iter().map(|column| column[k]).collect()).collect()
    };
    let all = |prefix: &str| names(model).into_iter().map(|j| column(prefix, j)).collect::<Option<Vec<_>>>();
    if let Some((joint, angle)) = rows(&q).iter().find_map(|q| angle_beyond_sines(model, q)) {
        diagnostics.push(say::angle_beyond_sines(joint, angle).at(place));
        return None;
    }
    let motion = match (all("qd"), all("qdd")) {
        (Some(qd), Some(qdd)) => {
            let knots = rows(&q).into_iter().zip(rows(&qd)).zip(rows(&qdd)).map(|((q, qd), qdd)| (q, qd, qdd));
            Motion::sampled(times, &knots.collect::<Vec<_>>())
        }
        _ => Motion::cubic(times, &rows(&q)),
    };
    motion.map_err(|why| diagnostics.push(say::no_motion(&why.to_string()).at(place))).ok()
}
