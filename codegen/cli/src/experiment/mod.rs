//! Experiment files: what a robot is to do in a simulation or an analysis. TOML, documented in `SIMULATION.md`.
//!
//! Every complaint has its place, and all come in one run.

pub mod contact;
pub mod design;
pub mod messages;
pub mod parameter;
pub mod parquet;
pub mod samples;

use self::messages as say;
use self::samples::Columns;
use straightline_codegen::description::messages::unknown_frame;
use straightline_codegen::description::reader::{FileReader, Range64};
use straightline_codegen::description::table::{parse, TomlTable};
use straightline_codegen::diagnostic::{Diagnostics, Place, Source};
use straightline_core::algorithms::drive_states;
use straightline_core::drive::Actuator;
use straightline_core::model::{Joint, Model};
use straightline_simulation::cartesian::joint_motion;
use straightline_simulation::command::{Command, Compensation, Controller, Samples};
use straightline_simulation::drives::{further_derivatives, Inputs};
use straightline_simulation::motion::{Motion, NoMotion};
use straightline_simulation::plant::angle_beyond_sines;
use straightline_simulation::simulate::{Method, Settings};
use toml::de::DeValue;

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
}

/// Where files that an experiment names are read from.
pub type ReadFile<'a> = &'a dyn Fn(&str) -> Result<Source, String>;

/// Samples of a path in the world \[s\].
const PATH_INTERVAL: f64 = 0.01;

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
        true => from_toml(source, model, controller_model, read_file, &mut found),
        false => from_samples(source, model, samples_are_torques, &mut found),
    };
    found.sort();
    let sound = !found.has_errors();
    diagnostics.extend(found);
    experiment.filter(|_| sound)
}

/// The joints in the order of their coordinates.
fn joints(model: &Model<f64>) -> Vec<&Joint> {
    let mut joints: Vec<&Joint> = model.bodies.iter().map(|b| &b.joint).collect();
    joints.sort_by_key(|j| j.iv);
    joints
}

fn names(model: &Model<f64>) -> Vec<&str> {
    joints(model).iter().map(|j| j.name.as_str()).collect()
}

/// Numbers per driven joint with zeros for those that are passive; `None` if there are none, or not as many numbers.
fn with_passive(model: &Model<f64>, numbers: &[f64]) -> Option<Vec<f64>> {
    let mut is_passive = vec![false; model.nv()];
    model.bodies.iter().for_each(|b| is_passive[b.joint.iv] = b.is_passive());
    let driven = is_passive.iter().filter(|passive| !**passive).count();
    let mut rest = numbers.iter();
    (driven < model.nv() && numbers.len() == driven && !floats(model))
        .then(|| is_passive.iter().map(|passive| if *passive { 0.0 } else { *rest.next().unwrap_or(&0.0) }).collect())
}

fn floats(model: &Model<f64>) -> bool {
    model.floats()
}

/// Zero, or the nearest that the joints' ranges allow; a base at the origin.
fn zero(model: &Model<f64>) -> Vec<f64> {
    let mut q = vec![0.0; model.nq()];
    for joint in model.bodies.iter().map(|b| &b.joint) {
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
        return Some(Experiment {
            motion: Some(motion),
            command: Command::Free,
            q,
            qd,
            x: None,
            settings,
            coulomb_speed: 1e-3,
        });
    }
    let last = columns.get("t")?.last().copied().unwrap_or(0.0);
    let (command, qd) = (sampled_command(columns, model, &place, diagnostics)?, vec![0.0; model.nv()]);
    Some(Experiment { motion: None, command, q, qd, x: None, settings: Settings::lasting(last), coulomb_speed: 1e-3 })
}

/// Torques over time: per joint a column `tau.JOINT` or `JOINT`; joints without one are free.
fn torques(columns: &Columns, model: &Model<f64>, place: &Place, diagnostics: &mut Diagnostics) -> Option<Samples> {
    let times = columns.get("t")?.to_vec();
    let mut rows = vec![vec![0.0; model.nv()]; times.len()];
    let known = names(model);
    for (name, column) in columns.columns.iter().filter(|(name, _)| name != "t") {
        let joint = name.strip_prefix("tau.").unwrap_or(name);
        let Some(joint) = joints(model).into_iter().find(|j| j.name == joint && j.kind.is_single()) else {
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

/// A motion from samples: per joint a column `q.JOINT` or `JOINT`; where all have `qd.` and `qdd.` as well, these count.
fn sampled_motion(
    columns: &Columns,
    model: &Model<f64>,
    place: &Place,
    diagnostics: &mut Diagnostics,
) -> Option<Motion> {
    if floats(model) {
        diagnostics.push(say::base_floats("a motion").at(place));
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

fn from_toml(
    source: &Source,
    model: &Model<f64>,
    controller_model: &Model<f64>,
    read_file: ReadFile,
    diagnostics: &mut Diagnostics,
) -> Option<Experiment> {
    let document = parse(source, diagnostics)?;
    let top = TomlTable { owner: "an experiment".to_string(), table: document.get_ref(), span: 0..0 };
    let mut r = ExperimentReader { reader: FileReader::new(source, diagnostics), model, controller_model, read_file };
    let keys = [&["motion", "controller", "torques", "inputs", "start", "simulation"][..], &contact::TABLES].concat();
    r.reader.check_keys(&top, &keys);
    let table = |r: &mut ExperimentReader, key: &str| r.reader.table_at(&top, key, &format!("[{key}]"));
    let start = table(&mut r, "start");
    if let Some(start) = &start {
        r.reader.check_keys(start, &["q", "qd", "x"]);
    }
    let of_start = |r: &mut ExperimentReader, key: &str, n: usize| {
        let numbers =
            start.as_ref().and_then(|start| r.numbers(start, key, n)).filter(|numbers| !numbers.is_empty())?;
        if let (Some(start), "q") = (&start, key) {
            r.angles(start, &numbers);
        }
        Some(numbers)
    };
    let q = of_start(&mut r, "q", model.nq());
    let qd = of_start(&mut r, "qd", model.nv());
    let x = match &start {
        Some(start) if start.has("x") => r.drive_state(start),
        _ => None,
    };
    let has_motion = top.has("motion");
    let motion = table(&mut r, "motion").and_then(|motion| r.motion(&motion, q.as_deref()));
    let inputs = table(&mut r, "inputs").map(|inputs| r.inputs(&inputs));
    let command = match (table(&mut r, "controller"), table(&mut r, "torques")) {
        (Some(controller), torques) if torques.is_some() || inputs.is_some() => {
            r.reader.complain(&controller.span, say::controller_and_torques());
            None
        }
        (Some(controller), _) => {
            if !has_motion {
                r.reader.complain(&controller.span, say::motion_missing());
            }
            r.controller(&controller, motion.clone())
        }
        (None, torques) => {
            let torques = torques.map(|torques| r.torques(&torques));
            match (inputs, torques) {
                (None, None) => Some(Command::Free),
                (None, Some(torques)) => torques.map(Command::Torques),
                (Some(inputs), None) => inputs.map(|inputs| Command::Inputs(inputs, None)),
                (Some(inputs), Some(torques)) => inputs.zip(torques).map(|(u, tau)| Command::Inputs(u, Some(tau))),
            }
        }
    };
    let from_motion = motion.as_ref().map(|motion| motion.at(motion.times[0]));
    let q = q.or_else(|| from_motion.as_ref().map(|m| m.0.clone())).unwrap_or_else(|| zero(model));
    let qd = qd.or_else(|| from_motion.as_ref().map(|m| m.1.clone())).unwrap_or_else(|| vec![0.0; model.nv()]);
    let last = match (&motion, &command) {
        (Some(motion), _) => motion.duration(),
        (None, Some(Command::Torques(samples) | Command::Inputs(Inputs { samples, .. }, _))) => {
            samples.times.last().copied().unwrap_or(1.0)
        }
        _ => 1.0,
    };
    let (mut settings, mut coulomb_speed) = (Settings::lasting(last), 1e-3);
    if let Some(table) = table(&mut r, "simulation") {
        let keys = ["duration", "interval", "tolerance", "method", "stop_at_limits", "coulomb_speed", "max_steps"];
        r.reader.check_keys(&table, &keys);
        settings.duration = r.number(&table, "duration", settings.duration, (1e-9, 1e6));
        settings.interval = r.number(&table, "interval", settings.interval, (1e-6, 1e6));
        settings.tolerance = r.number(&table, "tolerance", settings.tolerance, (1e-13, 0.1));
        coulomb_speed = r.number(&table, "coulomb_speed", coulomb_speed, (1e-9, 1e3));
        settings.method = r.reader.word_at(&table, "method", &Method::WORDS).map_or(settings.method, |m| m.value);
        if let Some(most) = r.reader.real_at(&table, "max_steps", Range64::Finite) {
            let whole = (1.0..=1e9).contains(&most.value) && most.value.fract() == 0.0;
            match whole {
                true => settings.most_steps = most.value as usize,
                false => {
                    let complaint =
                        say::not_in_range(&table.what("max_steps"), most.value, "a whole number from 1 to 1e9");
                    r.reader.diagnostics.push(complaint.at(&most.place));
                }
            }
        }
        settings.stops_at_limits = r.reader.flag_at(&table, "stop_at_limits").is_none_or(|flag| flag.value);
    }
    let command = command?;
    let x = x.map(|x| without_currents(model, &x, &command.current_inputs(model.drives.len())));
    Some(Experiment { motion, command, q, qd, x, settings, coulomb_speed })
}

/// The state of drives without the currents of those that an amplifier feeds: they are inputs.
fn without_currents(model: &Model<f64>, x: &[f64], are_currents: &[bool]) -> Vec<f64> {
    let mut rest = x;
    let mut kept = Vec::new();
    for (drive, is_current) in model.drives.iter().zip(are_currents) {
        let (own, others) = rest.split_at(drive.states());
        let has_state = matches!(&drive.actuator, Actuator::Motor(m) if m.inductance.is_some());
        kept.extend(own.iter().enumerate().filter(|(i, _)| !(*is_current && has_state && *i == 2)).map(|(_, x)| x));
        rest = others;
    }
    kept
}

struct ExperimentReader<'a> {
    reader: FileReader<'a>,
    model: &'a Model<f64>,
    controller_model: &'a Model<f64>,
    read_file: ReadFile<'a>,
}

impl ExperimentReader<'_> {
    /// A number within a range, or what stands for it.
    fn number(&mut self, table: &TomlTable, key: &str, default: f64, (low, high): (f64, f64)) -> f64 {
        let Some(found) = self.reader.real_at(table, key, Range64::Finite) else { return default };
        if !(low..=high).contains(&found.value) {
            let range = format!("between {low:e} and {high:e}");
            self.reader.diagnostics.push(say::not_in_range(&table.what(key), found.value, &range).at(&found.place));
            return default;
        }
        found.value
    }

    /// One number for all, or an array of `n`. Empty after a complaint; `None` where there is no such key.
    fn numbers(&mut self, table: &TomlTable, key: &str, n: usize) -> Option<Vec<f64>> {
        let (value, span) = table.get(key)?;
        let what = table.what(key);
        match value {
            DeValue::Array(array) => {
                let found = array.len();
                let numbers = self.reader.all_reals_at(table, key, Range64::Finite)?;
                if let Some(all) = with_passive(self.model, &numbers).filter(|all| all.len() == n) {
                    return Some(all);
                }
                if found != n {
                    let names = names(self.model);
                    self.reader.complain(&span, say::one_per_joint(&what, found, &names));
                    return Some(Vec::new());
                }
                Some(numbers)
            }
            _ => self.reader.real_at(table, key, Range64::Finite).map(|x| vec![x.value; n]).or(Some(Vec::new())),
        }
    }

    /// Complains of angles beyond those whose sine has digits.
    fn angles(&mut self, table: &TomlTable, q: &[f64]) {
        if let (Some((joint, angle)), Some((_, span))) = (angle_beyond_sines(self.model, q), table.get("q")) {
            self.reader.complain(&span, say::angle_beyond_sines(joint, angle));
        }
    }

    fn samples(&mut self, table: &TomlTable) -> Option<(Columns, Place)> {
        let file = self.reader.string_at(table, "file")?;
        let source = match (self.read_file)(&file.value) {
            Ok(source) => source,
            Err(why) => {
                self.reader.diagnostics.push(say::not_samples(&why).at(&file.place));
                return None;
            }
        };
        samples::read(&source, self.reader.diagnostics).map(|columns| (columns, file.place))
    }

    fn torques(&mut self, table: &TomlTable) -> Option<Samples> {
        self.reader.check_keys(table, &["file"]);
        self.reader.require(table, "file", "file = \"torques.csv\"");
        let (columns, place) = self.samples(table)?;
        torques(&columns, self.model, &place, self.reader.diagnostics)
    }

    fn inputs(&mut self, table: &TomlTable) -> Option<Inputs> {
        self.reader.check_keys(table, &["file"]);
        self.reader.require(table, "file", "file = \"voltages.csv\"");
        if self.model.drives.is_empty() {
            self.reader.complain(&table.span, say::no_drives("inputs"));
            return None;
        }
        let (columns, place) = self.samples(table)?;
        drive_inputs(&columns, self.model, &place, self.reader.diagnostics)
    }

    /// The state of the drives, all of it.
    fn drive_state(&mut self, start: &TomlTable) -> Option<Vec<f64>> {
        let (_, span) = start.get("x")?;
        let n = drive_states(self.model);
        if n == 0 {
            self.reader.complain(&span, say::no_drives("x"));
            return None;
        }
        let x = self.reader.all_reals_at(start, "x", Range64::Finite)?;
        if x.len() != n {
            let of = |d: &straightline_core::drive::Drive<f64>| format!("{} of {}", d.states(), d.name);
            let states: Vec<String> = self.model.drives.iter().map(of).collect();
            self.reader.complain(&span, say::drive_states(x.len(), n, &states));
            return None;
        }
        Some(x)
    }

    fn motion(&mut self, table: &TomlTable, start: Option<&[f64]>) -> Option<Motion> {
        let keys = ["kind", "file", "frame", "keep_orientation", "speed", "acceleration", "point"];
        self.reader.check_keys(table, &keys);
        if floats(self.model) {
            self.reader.complain(&table.span, say::base_floats("a motion"));
            return None;
        }
        self.reader.require(table, "kind", "kind = \"quintic\"");
        let words = [("cubic", 0), ("quintic", 1), ("trapezoidal", 2), ("samples", 3), ("smooth", 4)];
        let kind = self.reader.word_at(table, "kind", &words)?.value;
        if kind == 3 {
            self.reader.require(table, "file", "file = \"motion.csv\"");
            let (columns, place) = self.samples(table)?;
            return sampled_motion(&columns, self.model, &place, self.reader.diagnostics);
        }
        let frame = match self.reader.string_at(table, "frame") {
            None => None,
            Some(name) => {
                let frame = self.model.frame(&name.value);
                if frame.is_none() {
                    let known = self.model.frames.iter().map(|f| f.name.as_str());
                    self.reader.diagnostics.push(unknown_frame(&name.value, known).at(&name.place));
                    return None;
                }
                frame
            }
        };
        let keeps_orientation = self.reader.flag_at(table, "keep_orientation").is_some_and(|flag| flag.value);
        let (key, n) = if frame.is_some() { ("xyz", 3) } else { ("q", self.model.nv()) };
        let (mut times, mut points) = (Vec::new(), Vec::new());
        let mut wrong = false;
        for (i, point) in self.reader.tables_at(table, "point").into_iter().enumerate() {
            let allowed: &[&str] = if kind == 2 { &[key] } else { &["t", key] };
            self.reader.check_keys(&point, allowed);
            let example = if n == 3 { format!("{key} = [0.3, 0.0, 0.5]") } else { format!("{key} = […]") };
            self.reader.require(&point, key, &example);
            let numbers = match frame {
                Some(_) => self.reader.vector_at(&point, key).map(|xyz| xyz.value.to_vec()),
                None => self.numbers(&point, key, n).filter(|numbers| !numbers.is_empty()),
            };
            if let (None, Some(q)) = (frame, &numbers) {
                self.angles(&point, q);
            }
            if kind != 2 {
                self.reader.require(&point, "t", "t = 1.0");
            }
            let time = match kind {
                2 => Some(i as f64),
                _ => self.reader.real_at(&point, "t", Range64::Finite).map(|t| t.value),
            };
            match (time, numbers) {
                (Some(time), Some(numbers)) => {
                    times.push(time);
                    points.push(numbers);
                }
                _ => wrong = true,
            }
        }
        if wrong {
            return None;
        }
        let motion = match kind {
            0 => Motion::cubic(&times, &points),
            1 => Motion::quintic(&times, &points),
            4 => Motion::smooth(&times, &points),
            _ => {
                let (speed, acceleration) = self.speeds(table, n, frame.is_some())?;
                Motion::trapezoidal(&points, &speed, &acceleration)
            }
        };
        let complain = |reader: &mut FileReader, why: String| reader.complain(&table.span, say::no_motion(&why));
        let motion = match motion {
            Ok(motion) => motion,
            Err(why @ NoMotion::TooFew) => {
                complain(&mut self.reader, format!("{why}: write [[motion.point]] tables"));
                return None;
            }
            Err(why) => {
                complain(&mut self.reader, why.to_string());
                return None;
            }
        };
        let Some(frame) = frame else { return Some(motion) };
        let start = start.map_or_else(|| zero(self.model), <[f64]>::to_vec);
        let path = joint_motion(self.model, frame, &motion, &start, keeps_orientation, PATH_INTERVAL);
        path.map_err(|why| complain(&mut self.reader, why.to_string())).ok()
    }

    /// Greatest speeds and accelerations of a trapezoid: given, or of joints the speeds of the robot file.
    fn speeds(&mut self, table: &TomlTable, n: usize, in_world: bool) -> Option<(Vec<f64>, Vec<f64>)> {
        let speed = self.numbers(table, "speed", n);
        let acceleration = self.numbers(table, "acceleration", n);
        let of_file = || joints(self.model).iter().map(|j| j.limits.velocity).collect::<Vec<f64>>();
        let speed = match (speed, in_world) {
            (Some(speed), _) => speed,
            (None, false) => of_file(),
            (None, true) => vec![f64::INFINITY; n],
        };
        let acceleration = acceleration.unwrap_or_else(|| vec![f64::INFINITY; n]);
        let names = names(self.model);
        for (key, values) in [("speed", &speed), ("acceleration", &acceleration)] {
            if let Some(j) = values.iter().position(|x| !x.is_finite()) {
                let joint = if in_world { "of the frame" } else { names[j] };
                self.reader.complain(&table.span, say::no_limit(joint, key));
                return None;
            }
        }
        (speed.len() == n && acceleration.len() == n).then_some((speed, acceleration))
    }

    fn controller(&mut self, table: &TomlTable, motion: Option<Motion>) -> Option<Command> {
        self.reader.check_keys(table, &["compensation", "stiffness", "damping", "saturate", "period", "amplifier"]);
        let n = self.model.nv();
        let compensation =
            self.reader.word_at(table, "compensation", &Compensation::WORDS).map_or(Compensation::None, |w| w.value);
        self.reader.require(table, "stiffness", "stiffness = 100.0");
        self.reader.require(table, "damping", "damping = 20.0");
        let stiffness = self.numbers(table, "stiffness", n)?;
        let damping = self.numbers(table, "damping", n)?;
        for (key, values) in [("stiffness", &stiffness), ("damping", &damping)] {
            if let Some(bad) = values.iter().find(|x| **x < 0.0) {
                let complaint = say::not_in_range(&table.what(key), *bad, "zero or positive");
                self.reader.complain(&table.span, complaint);
            }
        }
        let saturates = self.reader.flag_at(table, "saturate").is_some_and(|flag| flag.value);
        let period = table.has("period").then(|| self.number(table, "period", 1e-3, (1e-6, 10.0)));
        let words = [("voltage", false), ("current", true)];
        let gives_currents = self.reader.word_at(table, "amplifier", &words).is_some_and(|word| word.value);
        let drives = &self.controller_model.drives;
        if drives.len() != self.model.drives.len() {
            let complaint = say::other_drives(drives.len(), self.model.drives.len());
            self.reader.complain(&table.span, complaint);
            return None;
        }
        if drives.is_empty() {
            if let (true, Some((_, span))) = (table.has("amplifier"), table.get("amplifier")) {
                self.reader.complain(&span, say::no_drives("amplifier"));
            }
        } else if further_derivatives(self.controller_model).is_none() {
            self.reader.complain(&table.span, say::inputs_do_not_follow());
            return None;
        }
        let motion = motion?;
        if stiffness.len() != n || damping.len() != n {
            return None;
        }
        let model = self.controller_model.clone();
        let controller =
            Controller { model, compensation, motion, stiffness, damping, saturates, gives_currents, period };
        Some(Command::Controller(Box::new(controller)))
    }
}
