//! Experiment files in TOML.

use super::messages as say;
use super::samples::{self, Columns};
use super::{contact, drive_inputs, gains, names, sampled_motion, torques, zero, Experiment, ReadFile, COULOMB_SPEED};
use straightline_codegen::description::messages::unknown_frame;
use straightline_codegen::description::reader::{FileReader, Range64};
use straightline_codegen::description::table::{parse, TomlTable};
use straightline_codegen::diagnostic::{Diagnostics, Place, Source};
use straightline_core::algorithms::drive_states;
use straightline_core::drive::Actuator;
use straightline_core::model::Model;
use straightline_simulation::cartesian::joint_motion;
use straightline_simulation::command::{Command, Compensation, Controller, Samples};
use straightline_simulation::drives::{further_derivatives, Inputs};
use straightline_simulation::motion::{Motion, NoMotion};
use straightline_simulation::plant::angle_beyond_sines;
use straightline_simulation::simulate::{Method, Settings};
use toml::de::DeValue;

/// Samples of a path in the world \[s\].
const PATH_INTERVAL: f64 = 0.01;
/// How often loops are closed by Newton's method from where the file has them.
const CLOSINGS: usize = 16;
/// The kind of motion that says by itself when it is where.
const TRAPEZOIDAL: usize = 2;

/// Numbers per driven joint with zeros for those that are passive; `None` if there are none, or not as many numbers.
fn with_passive(model: &Model<f64>, numbers: &[f64]) -> Option<Vec<f64>> {
    let mut is_passive = vec![false; model.nv()];
    model.independently_jointed().for_each(|b| is_passive[b.joint.iv] = b.is_passive());
    let driven = is_passive.iter().filter(|passive| !**passive).count();
    let mut rest = numbers.iter();
    (driven < model.nv() && numbers.len() == driven && !model.floats())
        .then(|| is_passive.iter().map(|passive| if *passive { 0.0 } else { *rest.next().unwrap_or(&0.0) }).collect())
}

pub(super) fn read(
    source: &Source,
    model: &Model<f64>,
    controller_model: &Model<f64>,
    read_file: ReadFile,
    diagnostics: &mut Diagnostics,
) -> Option<Experiment> {
    let document = parse(source, diagnostics)?;
    let top = TomlTable { owner: "an experiment".to_string(), table: document.get_ref(), span: 0..0 };
    let mut r = ExperimentReader { reader: FileReader::new(source, diagnostics), model, controller_model, read_file };
    let keys =
        [&["motion", "controller", "torques", "inputs", "start", "simulation", "gains"][..], &contact::TABLES].concat();
    r.reader.check_keys(&top, &keys);
    let [q, qd, x] = r.table(&top, "start").map_or([None, None, None], |start| r.start(&start));
    let motion = r.table(&top, "motion").and_then(|motion| r.motion(&motion, q.as_deref()));
    let command = r.command(&top, motion.as_ref());
    let last = match (&motion, &command) {
        (Some(motion), _) => motion.duration(),
        (None, Some(Command::Torques(samples) | Command::Inputs(Inputs { samples, .. }, _))) => {
            samples.times.last().copied().unwrap_or(1.0)
        }
        _ => 1.0,
    };
    let (mut settings, mut coulomb_speed) = (Settings::lasting(last), COULOMB_SPEED);
    if let Some(table) = r.table(&top, "simulation") {
        r.simulation(&table, &mut settings, &mut coulomb_speed);
    }
    let period = command.as_ref().and_then(Command::period);
    let gains = r.table(&top, "gains").map(|gains| r.gains(&gains, period));
    let command = command?;
    let from_motion = motion.as_ref().map(|motion| motion.at(motion.times[0]));
    let q = q.or_else(|| from_motion.as_ref().map(|m| m.0.clone())).unwrap_or_else(|| zero(model));
    let qd = qd.or_else(|| from_motion.as_ref().map(|m| m.1.clone())).unwrap_or_else(|| vec![0.0; model.nv()]);
    let x = x.map(|x| without_currents(model, &x, &command.current_inputs(model.drives.len())));
    Some(Experiment { motion, command, q, qd, x, settings, coulomb_speed, gains })
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

pub(super) struct ExperimentReader<'a> {
    pub(super) reader: FileReader<'a>,
    pub(super) model: &'a Model<f64>,
    controller_model: &'a Model<f64>,
    read_file: ReadFile<'a>,
}

impl ExperimentReader<'_> {
    fn table<'a, 'd>(&mut self, top: &TomlTable<'a, 'd>, key: &str) -> Option<TomlTable<'a, 'd>> {
        self.reader.table_at(top, key, &format!("[{key}]"))
    }

    /// q, q̇ and the state of the drives at the beginning.
    fn start(&mut self, start: &TomlTable) -> [Option<Vec<f64>>; 3] {
        self.reader.check_keys(start, &["q", "qd", "x"]);
        let given = |numbers: &Vec<f64>| !numbers.is_empty();
        let q = self.numbers(start, "q", self.model.nq()).filter(given);
        let q = q.map(|q| self.model.close_loops(&q, CLOSINGS).0);
        q.iter().for_each(|q| self.angles(start, q));
        let qd = self.numbers(start, "qd", self.model.nv()).filter(given);
        [q, qd, self.drive_state(start)]
    }

    /// What drives the robot.
    fn command(&mut self, top: &TomlTable, motion: Option<&Motion>) -> Option<Command> {
        let inputs = self.table(top, "inputs").map(|inputs| self.inputs(&inputs));
        match (self.table(top, "controller"), self.table(top, "torques")) {
            (Some(controller), torques) if torques.is_some() || inputs.is_some() => {
                self.reader.complain(&controller.span, say::controller_and_torques());
                None
            }
            (Some(controller), _) => {
                if !top.has("motion") {
                    self.reader.complain(&controller.span, say::motion_missing());
                }
                self.controller(&controller, motion.cloned())
            }
            (None, torques) => {
                let torques = torques.map(|torques| self.torques(&torques));
                match (inputs, torques) {
                    (None, None) => Some(Command::Free),
                    (None, Some(torques)) => torques.map(Command::Torques),
                    (Some(inputs), None) => inputs.map(|inputs| Command::Inputs(inputs, None)),
                    (Some(inputs), Some(torques)) => inputs.zip(torques).map(|(u, tau)| Command::Inputs(u, Some(tau))),
                }
            }
        }
    }

    /// How it is simulated.
    fn simulation(&mut self, table: &TomlTable, settings: &mut Settings, coulomb_speed: &mut f64) {
        let keys = ["duration", "interval", "tolerance", "method", "stop_at_limits", "coulomb_speed", "max_steps"];
        self.reader.check_keys(table, &keys);
        for (key, number, range) in [
            ("duration", &mut settings.duration, (1e-9, 1e6)),
            ("interval", &mut settings.interval, (1e-6, 1e6)),
            ("tolerance", &mut settings.tolerance, (1e-13, 0.1)),
            ("coulomb_speed", coulomb_speed, (1e-9, 1e3)),
        ] {
            *number = self.number(table, key, *number, range);
        }
        settings.method = self.reader.word_at(table, "method", &Method::WORDS).map_or(settings.method, |m| m.value);
        if let Some(most) = self.reader.real_at(table, "max_steps", Range64::Finite) {
            match (1.0..=1e9).contains(&most.value) && most.value.fract() == 0.0 {
                true => settings.most_steps = most.value as usize,
                false => {
                    let range = "a whole number from 1 to 1e9";
                    let complaint = say::not_in_range(&table.what("max_steps"), most.value, range);
                    self.reader.diagnostics.push(complaint.at(&most.place));
                }
            }
        }
        settings.stops_at_limits = self.reader.flag_at(table, "stop_at_limits").is_none_or(|flag| flag.value);
    }

    /// A number within a range, or what stands for it.
    pub(super) fn number(&mut self, table: &TomlTable, key: &str, default: f64, (low, high): (f64, f64)) -> f64 {
        let Some(found) = self.reader.real_at(table, key, Range64::Finite) else { return default };
        if !(low..=high).contains(&found.value) {
            let range = format!("between {low:e} and {high:e}");
            self.reader.diagnostics.push(say::not_in_range(&table.what(key), found.value, &range).at(&found.place));
            return default;
        }
        found.value
    }

    /// One number for all, or an array of `n`. Empty after a complaint; `None` where there is no such key.
    pub(super) fn numbers(&mut self, table: &TomlTable, key: &str, n: usize) -> Option<Vec<f64>> {
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
                    let order = usize::from(key != "q");
                    let joints =
                        self.model.joints().into_iter().filter(|joint| order == 0 || joint.iv < self.model.nv());
                    let entries: Vec<String> = joints.flat_map(|joint| joint.entry_names(order)).collect();
                    self.reader.complain(&span, say::one_per_joint(&what, found, &entries));
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
        self.samples_at(table, "file")
    }

    /// What the file of this key holds.
    fn samples_at(&mut self, table: &TomlTable, key: &str) -> Option<(Columns, Place)> {
        let file = self.reader.string_at(table, key)?;
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
        if let Some(complaint) = super::unmovable(self.model, "a motion") {
            self.reader.complain(&table.span, complaint);
            return None;
        }
        self.reader.require(table, "kind", "kind = \"quintic\"");
        let words = [("cubic", 0), ("quintic", 1), ("trapezoidal", TRAPEZOIDAL), ("samples", 3), ("smooth", 4)];
        let kind = self.reader.word_at(table, "kind", &words)?.value;
        if kind == 3 {
            self.reader.require(table, "file", "file = \"motion.csv\"");
            let (columns, place) = self.samples(table)?;
            return sampled_motion(&columns, self.model, &place, self.reader.diagnostics);
        }
        let frame = match self.reader.string_at(table, "frame") {
            None => None,
            Some(name) => {
                let known = self.model.frames.iter().map(|f| f.name.as_str());
                let complaint = || unknown_frame(&name.value, known).at(&name.place);
                let frame = self.model.frame(&name.value);
                Some(frame.or_else(|| {
                    self.reader.diagnostics.push(complaint());
                    None
                })?)
            }
        };
        let keeps_orientation = self.reader.flag_at(table, "keep_orientation").is_some_and(|flag| flag.value);
        let (times, points) = self.points(table, kind == TRAPEZOIDAL, frame.is_some())?;
        let motion = match kind {
            0 => Motion::cubic(&times, &points),
            1 => Motion::quintic(&times, &points),
            4 => Motion::smooth(&times, &points),
            _ => {
                let n = if frame.is_some() { 3 } else { self.model.nv() };
                let (speed, acceleration) = self.speeds(table, n, frame.is_some())?;
                Motion::trapezoidal(&points, &speed, &acceleration)
            }
        };
        let motion = motion.map_err(|why| match why {
            NoMotion::TooFew => format!("{why}: write [[motion.point]] tables"),
            why => why.to_string(),
        });
        let motion = motion.and_then(|motion| {
            let Some(frame) = frame else { return Ok(motion) };
            let start = start.map_or_else(|| zero(self.model), <[f64]>::to_vec);
            let path = joint_motion(self.model, frame, &motion, &start, keeps_orientation, PATH_INTERVAL);
            path.map_err(|why| why.to_string())
        });
        motion.map_err(|why| self.reader.complain(&table.span, say::no_motion(&why))).ok()
    }

    /// The points that a motion goes through, with their times: joints, or positions in the world.
    fn points(&mut self, table: &TomlTable, counts: bool, in_world: bool) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
        let (key, example) = match in_world {
            true => ("xyz", "xyz = [0.3, 0.0, 0.5]"),
            false if self.model.nv() == 3 => ("q", "q = [0.3, 0.0, 0.5]"),
            false => ("q", "q = […]"),
        };
        let (mut times, mut points) = (Vec::new(), Vec::new());
        let mut wrong = false;
        for (i, point) in self.reader.tables_at(table, "point").into_iter().enumerate() {
            let allowed: &[&str] = if counts { &[key] } else { &["t", key] };
            self.reader.check_keys(&point, allowed);
            self.reader.require(&point, key, example);
            let numbers = match in_world {
                true => self.reader.vector_at(&point, key).map(|xyz| xyz.value.to_vec()),
                false => self.numbers(&point, key, self.model.nv()).filter(|numbers| !numbers.is_empty()),
            };
            if let (false, Some(q)) = (in_world, &numbers) {
                self.angles(&point, q);
            }
            let time = match counts {
                true => Some(i as f64),
                false => {
                    self.reader.require(&point, "t", "t = 1.0");
                    self.reader.real_at(&point, "t", Range64::Finite).map(|t| t.value)
                }
            };
            match (time, numbers) {
                (Some(time), Some(numbers)) => {
                    times.push(time);
                    points.push(numbers);
                }
                _ => wrong = true,
            }
        }
        (!wrong).then_some((times, points))
    }

    /// Greatest speeds and accelerations of a trapezoid: given, or of joints the speeds of the robot file.
    fn speeds(&mut self, table: &TomlTable, n: usize, in_world: bool) -> Option<(Vec<f64>, Vec<f64>)> {
        let speed = self.numbers(table, "speed", n);
        let acceleration = self.numbers(table, "acceleration", n);
        let of_file = || self.model.joints().iter().map(|j| j.limits.velocity).collect::<Vec<f64>>();
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
        let keys = ["compensation", "stiffness", "damping", "gains", "saturate", "period", "delay", "amplifier"];
        self.reader.check_keys(table, &keys);
        let n = self.model.nv();
        let compensation =
            self.reader.word_at(table, "compensation", &Compensation::WORDS).map_or(Compensation::None, |w| w.value);
        let feedback = match self.gains_of_file(table, compensation) {
            Some(feedback) => Some(feedback?),
            None => {
                self.reader.require(table, "stiffness", "stiffness = 100.0");
                self.reader.require(table, "damping", "damping = 20.0");
                None
            }
        };
        let mut of = |key: &str| match feedback {
            Some(_) => Some(vec![0.0; n]),
            None => self.numbers(table, key, n),
        };
        let (stiffness, damping) = (of("stiffness")?, of("damping")?);
        for (key, values) in [("stiffness", &stiffness), ("damping", &damping)] {
            if let Some(bad) = values.iter().find(|x| **x < 0.0) {
                let complaint = say::not_in_range(&table.what(key), *bad, "zero or positive");
                self.reader.complain(&table.span, complaint);
            }
        }
        let saturates = self.reader.flag_at(table, "saturate").is_some_and(|flag| flag.value);
        let period = table.has("period").then(|| self.number(table, "period", 1e-3, (1e-6, 10.0)));
        let delay = self.delay(table);
        if let (true, None, Some((_, span))) = (delay > 0, period, table.get("delay")) {
            self.reader.complain(&span, say::delay_without_period());
        }
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
        let controller = Controller {
            model,
            compensation,
            motion,
            stiffness,
            damping,
            feedback,
            saturates,
            gives_currents,
            period,
            delay,
        };
        Some(Command::Controller(Box::new(controller)))
    }

    /// Gains over time, where a controller has a file of them; `None` inside after a complaint.
    fn gains_of_file(&mut self, table: &TomlTable, compensation: Compensation) -> Option<Option<Samples>> {
        let (_, span) = table.get("gains")?;
        if let Some(key) = ["stiffness", "damping"].into_iter().find(|key| table.has(key)) {
            self.reader.complain(&span, say::gains_and(key));
        }
        if compensation == Compensation::ComputedTorque {
            self.reader.complain(&span, say::gains_and("computed_torque"));
        }
        let (columns, place) = match self.samples_at(table, "gains") {
            Some(found) => found,
            None => return Some(None),
        };
        Some(gains::schedule(&columns, self.model, &place, self.reader.diagnostics))
    }
}
