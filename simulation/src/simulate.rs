//! Simulation with adaptive steps: the motion that a command makes of a robot.
//!
//! The equations of [`Plant`] are integrated by an explicit method of order 8 with error control, or an implicit one of order 5
//! (Radau IIA) for stiff systems. Where the command is not smooth the integration begins anew, and a joint that reaches the end of its
//! range is located as a root between steps. Every run ends: what would take too many steps or too much memory is refused, and no number of
//! a result is anything but finite.

use crate::command::{Command, Delayed};
use crate::drives::DriveEnergies;
pub use crate::failure::Failure;
use crate::ode::{solve, AcceptedStep, Equations, Pace, Watch};
use crate::plant::{Action, Plant};
use crate::table::DataTable;
use std::ops::ControlFlow;
use straightline_core::algorithms::{kinetic_energy, DrivenMotion};
use straightline_core::model::Limits;

/// Times that are no further apart, as a part of the duration, are the same up to rounding.
pub(crate) const SAME: f64 = 1e-12;

/// Numbers in the table of a result, at most.
pub const MOST_NUMBERS: usize = 20_000_000;

/// How steps are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Explicit Runge-Kutta of order 8 (Dormand and Prince), for smooth motion.
    #[default]
    Adaptive,
    /// Implicit Runge-Kutta of order 5 (Radau IIA, Hairer and Wanner, L-stable), for stiff springs, dampers and drives.
    Stiff,
}

impl Method {
    /// Both with their words.
    pub const WORDS: [(&str, Method); 2] = [("adaptive", Method::Adaptive), ("stiff", Method::Stiff)];
}

/// How a simulation runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Until this time \[s\], from zero, positive.
    pub duration: f64,
    /// From row to row of the result \[s\], positive.
    pub interval: f64,
    /// Error per step that is allowed, relative and absolute.
    pub tolerance: f64,
    /// How steps are made.
    pub method: Method,
    /// Whether it ends where a joint reaches the end of its range.
    pub stops_at_limits: bool,
    /// Steps, rejected ones with them, that a simulation may take; where the end is not in sight, it is given up long before.
    pub most_steps: usize,
}

impl Settings {
    /// Rows every 10 ms, an error of 1e-9 per step, explicit steps, at most a million of them, an end at the joints' ranges.
    pub const fn lasting(duration: f64) -> Settings {
        Settings {
            duration,
            interval: 0.01,
            tolerance: 1e-9,
            method: Method::Adaptive,
            stops_at_limits: true,
            most_steps: 1_000_000,
        }
    }

    /// # Errors
    /// Numbers that no simulation has, or too many rows or steps.
    pub(crate) fn check(&self, columns: usize, period: Option<f64>) -> Result<(), Failure> {
        let numbers =
            [("duration", Some(self.duration)), ("interval", Some(self.interval)), ("tolerance", Some(self.tolerance))];
        for (what, number) in numbers.into_iter().chain([("period of the controller", period)]) {
            if let Some(number) = number.filter(|x| !(x.is_finite() && *x > 0.0)) {
                return Err(Failure::new(0.0, format!("the {what} is {number}, no positive number")));
            }
        }
        let rows = (self.duration / self.interval).floor() + 2.0;
        let most_rows = (MOST_NUMBERS / columns.max(1)).min(self.most_steps).max(2);
        if rows > most_rows as f64 {
            let (duration, interval) = (self.duration, self.interval);
            let why =
                format!("{duration:?} s with a row every {interval:?} s are {rows:.1e} rows of {columns} numbers");
            let least = duration / (most_rows as f64 - 2.0).max(1.0);
            let help =
                format!("at most {most_rows} rows are written: an interval of {least:.1e} s or more, or less time");
            return Err(Failure::new(0.0, why).with_help(&help));
        }
        if let Some(count) = period.map(|p| self.duration / p).filter(|count| *count > self.most_steps as f64) {
            let why = format!("the controller computes {count:.1e} times, and each time takes a step");
            let help = format!(
                "at most {} steps are made: a longer period, less time, or max_steps in [simulation]",
                self.most_steps
            );
            return Err(Failure::new(0.0, why).with_help(&help));
        }
        Ok(())
    }
}

/// What came out.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// `t`, then per joint `q.`, `qd.`, `tau.` and, under a controller, `error.` (reference less measured), then `energy`, `work`
    /// and `losses` \[J\]; of a robot with drives per drive `u.` (after limits), `i.`, `speed.` and `m.` of its actuator before these.
    pub table: DataTable,
    /// The last configuration.
    pub q: Vec<f64>,
    /// The last velocity.
    pub qd: Vec<f64>,
    /// The end of a joint's range where it stopped early.
    pub stop: Option<Stop>,
    /// Where the energy went.
    pub balance: Balance,
    /// Accepted steps.
    pub steps: usize,
    /// Evaluations of the equations of motion.
    pub evaluations: usize,
}

/// A joint at the end of its range.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// When \[s\].
    pub time: f64,
    /// Name of the joint that reached the end of its range.
    pub joint: String,
    /// The limit that it reached \[rad or m\].
    pub limit: f64,
}

/// Where the energy went \[J\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balance {
    /// Kinetic and potential energy, springs and rotors with them, at the beginning.
    pub before: f64,
    /// At the end.
    pub after: f64,
    /// Work of the given forces.
    pub work: f64,
    /// Heat of friction in the joints.
    pub losses: f64,
    /// What the drives took and lost.
    pub drives: DriveEnergies,
    /// The greatest change of kinetic energy on the way.
    pub turnover: f64,
}

impl Run {
    /// Before the first row; the energies and the last state come when it has ended.
    pub(crate) fn beginning(names: Vec<String>) -> Run {
        Run { table: DataTable { names, rows: Vec::new() }, ..Run::default() }
    }

    /// # Errors
    /// A number of the row is not finite.
    pub(crate) fn push(&mut self, row: Vec<f64>) -> Result<(), Failure> {
        self.table.check_row(&row).map_err(|(t, why)| Failure::new(t, why))?;
        self.table.rows.push(row);
        Ok(())
    }

    /// # Errors
    /// The energies are not finite.
    pub(crate) fn end(self) -> Result<Run, Failure> {
        let Balance { before, after, turnover, .. } = self.balance;
        let t = self.table.rows.last().map_or(0.0, |row| row[0]);
        match [before, after, turnover, self.balance.missing()].iter().all(|x| x.is_finite()) {
            true => Ok(self),
            false => Err(Failure::new(t, "the energy is not a finite number".to_string())),
        }
    }
}

impl Balance {
    /// What is missing \[J\]: change of energy + losses − work, those of the drives with them.
    pub fn missing(&self) -> f64 {
        (self.after - self.before) + self.losses + self.drives.lost() - self.work - self.drives.electrical
    }

    /// What is missing against the energies that were turned over.
    pub fn relative(&self) -> f64 {
        let scale = self
            .turnover
            .max(self.work.abs())
            .max(self.losses)
            .max(self.drives.electrical.abs())
            .max(self.drives.lost());
        if scale == 0.0 {
            self.missing().abs()
        } else {
            self.missing().abs() / scale
        }
    }
}

/// Simulates from q, q̇ at time zero, drives with slack springs and without currents; `progress` hears the time as it goes on.
///
/// # Errors
/// The solver found no way on: numbers grew beyond all bounds, or steps became too small.
pub fn simulate(
    plant: &Plant,
    command: &Command,
    (q, qd): (&[f64], &[f64]),
    settings: &Settings,
    progress: &dyn Fn(f64),
) -> Result<Run, Failure> {
    simulate_from(plant, command, plant.state(q, qd), settings, progress)
}

/// Simulates from a state of [`Plant`] at time zero.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_from(
    plant: &Plant,
    command: &Command,
    mut state: Vec<f64>,
    settings: &Settings,
    progress: &dyn Fn(f64),
) -> Result<Run, Failure> {
    let plant = &*plant.solved_by(settings.method);
    let mut run = Run::beginning(names(plant, command));
    let period = command.period();
    settings.check(run.table.names.len(), period)?;
    check_start(plant, &state)?;
    let pace = Pace::new(settings);
    let before = plant.stored(&state);
    let wanted = rows(settings);
    let corners = pieces(command, period, settings.duration);
    let row = |t: f64, state: &[f64], held: Option<&Action>| row(plant, command, t, state, held);
    run.push(row(0.0, &state, None))?;
    let mut delayed = Delayed::of(command);
    for piece in corners.windows(2) {
        let (start, end) = (piece[0], piece[1]);
        let held = period.map(|_| delayed.next(command.action(plant, start, &state)));
        let system = System { plant, command, held: held.as_ref(), progress };
        // rows are ascending; a controller's pieces are many
        let (first, last) = (wanted.partition_point(|t| *t <= start), wanted.partition_point(|t| *t < end));
        let times = [wanted.get(first..last).unwrap_or_default(), &[end]].concat();
        let stops_at_limits = settings.stops_at_limits;
        let mut watch = StateWatch { plant, times: &times, next: 0, stops_at_limits, seen: Vec::new(), stop: None };
        let solved = solve(&system, &mut watch, (start, end), &state, settings, &pace)?;
        for (t, y) in watch.seen.iter().chain(&watch.stop) {
            if is_among(&wanted, *t, settings.duration) || watch.stop.as_ref().is_some_and(|stop| stop.0 == *t) {
                run.push(row(*t, y, held.as_ref()))?;
            }
        }
        run.steps += solved.accepted;
        run.evaluations += solved.evaluations;
        if let Some((t, y)) = watch.stop {
            state = plant.normalised(&y);
            run.stop = Some(nearest_limit(plant, t, &y));
            break;
        }
        state = plant.normalised(&solved.y);
    }
    let (q, qd, work, losses) = plant.split(&state);
    let after = plant.stored(&state);
    let nq = plant.model.nq();
    let kinetic = |row: &Vec<f64>| kinetic_energy(&plant.model, &row[1..=nq], &row[nq + 1..=nq + qd.len()]);
    let (least, most) = run.table.rows.iter().map(kinetic).fold((f64::MAX, 0.0f64), |(l, m), e| (l.min(e), m.max(e)));
    let turnover = most - least;
    run.balance = Balance { before, after, work, losses, drives: plant.drive_energies(&state), turnover };
    (run.q, run.qd) = (q.to_vec(), qd.to_vec());
    run.end()
}

/// Whether the state at the beginning is one that can be gone on from.
pub(crate) fn check_start(plant: &Plant, state: &[f64]) -> Result<(), Failure> {
    let not_finite = plant.objection(state).or_else(|| {
        let i = state.iter().position(|x| !x.is_finite())?;
        Some(format!("{} is {}, not a finite number", plant.quantity(i), state[i]))
    });
    not_finite.map_or(Ok(()), |why| Err(Failure::new(0.0, why)))
}

/// The times of the rows of a result.
pub(crate) fn rows(settings: &Settings) -> Vec<f64> {
    let count = (settings.duration / settings.interval).floor() as usize;
    let mut wanted: Vec<f64> = (0..=count).map(|k| k as f64 * settings.interval).collect();
    if settings.duration - wanted[count] > 1e-9 * settings.duration {
        wanted.push(settings.duration);
    }
    wanted
}

/// Whether a time is one of these ascending ones, up to rounding.
pub(crate) fn is_among(times: &[f64], t: f64, duration: f64) -> bool {
    let next = times.partition_point(|w| t - w > SAME * duration);
    times.get(next).is_some_and(|w| w - t <= SAME * duration)
}

/// The times between which everything is smooth, from zero to the end.
pub(crate) fn pieces(command: &Command, period: Option<f64>, duration: f64) -> Vec<f64> {
    let mut times: Vec<f64> = match period {
        Some(period) => (0u64..).map(|k| k as f64 * period).take_while(|t| *t < duration).collect(),
        None => command.corners().into_iter().filter(|t| *t > 0.0 && *t < duration).collect(),
    };
    times.push(0.0);
    times.push(duration);
    times.sort_by(f64::total_cmp);
    times.dedup_by(|b, a| *b - *a <= SAME * duration);
    // the end itself, not what lies within rounding of it
    *times.last_mut().expect("there are two") = duration;
    times
}

/// Columns of every drive.
const DRIVE_COLUMNS: [&str; 4] = ["u", "i", "speed", "m"];
/// Columns of all drives together: [`DriveEnergies`].
const ENERGY_COLUMNS: [&str; DriveEnergies::COUNT] =
    ["electrical", "joule", "motor_friction", "gear_losses", "damper_losses", "conversion"];

pub(crate) fn names(plant: &Plant, command: &Command) -> Vec<String> {
    let joints = plant.model.joints();
    let named = |prefix: &str, order: usize| -> Vec<String> {
        // what loops determine has no velocity of its own
        let own = joints.iter().filter(|joint| order == 0 || joint.iv < plant.model.nv());
        own.flat_map(|joint| joint.entry_names(order)).map(|name| format!("{prefix}.{name}")).collect()
    };
    let mut names = vec!["t".to_string()];
    names.extend(named("q", 0));
    names.extend(named("qd", 1));
    names.extend(named("tau", 2));
    if matches!(command, Command::Controller(_)) {
        let controlled = joints.iter().filter(|joint| joint.kind.is_single() && joint.iv < plant.model.nv());
        names.extend(controlled.map(|joint| format!("error.{}", joint.name)));
    }
    for prefix in if plant.is_driven() { &DRIVE_COLUMNS[..] } else { &[] } {
        names.extend(plant.model.drives.iter().map(|d| format!("{prefix}.{}", d.name)));
    }
    names.extend(["energy", "work", "losses"].map(str::to_string));
    if plant.is_driven() {
        names.extend(ENERGY_COLUMNS.map(str::to_string));
    }
    names
}

fn row(plant: &Plant, command: &Command, t: f64, state: &[f64], held: Option<&Action>) -> Vec<f64> {
    let state = plant.normalised(state);
    let action = held.map_or_else(|| command.action(plant, t, &state), Action::clone);
    let driven = plant.is_driven().then(|| plant.driven(&state, &action));
    row_of(plant, command, (t, &state), action, driven.as_ref())
}

/// A row of the table, from what the drives are known to do.
pub(crate) fn row_of(
    plant: &Plant,
    command: &Command,
    (t, state): (f64, &[f64]),
    action: Action,
    driven: Option<&DrivenMotion<f64>>,
) -> Vec<f64> {
    let (q, qd, work, losses) = plant.split(state);
    let mut tau = action.tau;
    if let Some(driven) = driven {
        tau.iter_mut().zip(&driven.tau).for_each(|(sum, tau)| *sum += tau);
    }
    let mut row = [&[t], q, qd, &tau].concat();
    if let Command::Controller(controller) = command {
        let (r, ..) = controller.motion.at(t);
        row.extend(r.iter().zip(q).map(|(r, q)| r - q));
    }
    let flows = driven.map_or(&[][..], |d| &d.flows);
    row.extend(flows.iter().map(|f| f.voltage));
    row.extend(flows.iter().map(|f| f.current));
    row.extend(flows.iter().map(|f| f.speed));
    row.extend(flows.iter().map(|f| f.torque));
    row.extend([plant.stored(state), work, losses]);
    if driven.is_some() {
        let e = plant.drive_energies(state);
        row.extend([e.electrical, e.joule, e.friction, e.gears, e.dampers, e.conversion]);
    }
    row
}

/// The equations of motion under a command, or under forces that are held.
struct System<'a> {
    plant: &'a Plant,
    command: &'a Command,
    held: Option<&'a Action>,
    progress: &'a dyn Fn(f64),
}

impl Equations for System<'_> {
    fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]) {
        (self.progress)(t);
        match self.held {
            Some(action) => self.plant.rate(y, action, rate),
            None => self.plant.rate(y, &self.command.action(self.plant, t, y), rate),
        }
    }

    fn quantity(&self, i: usize) -> String {
        self.plant.quantity(i)
    }

    fn objection(&self, y: &[f64]) -> Option<String> {
        self.plant.objection(y)
    }
}

/// Keeps the states at wanted times, and ends where a joint reaches the end of its range.
struct StateWatch<'a> {
    plant: &'a Plant,
    times: &'a [f64],
    next: usize,
    stops_at_limits: bool,
    /// The states at wanted times.
    seen: Vec<(f64, Vec<f64>)>,
    /// Where it ended.
    stop: Option<(f64, Vec<f64>)>,
}

impl Watch for StateWatch<'_> {
    fn step(&mut self, step: &AcceptedStep) -> ControlFlow<()> {
        let AcceptedStep { t_before, t, y_before, y, within } = *step;
        let mut end = t;
        // a joint that begins beyond its range does not leave it
        let watched: Vec<bool> = distances(self.plant, y_before).map(|(distance, ..)| distance > 0.0).collect();
        let inside = |y: &[f64]| {
            let mut all = distances(self.plant, y).zip(&watched);
            all.all(|((distance, ..), is_watched)| !is_watched || distance > 0.0)
        };
        let leaves = self.stops_at_limits && !inside(y);
        if leaves {
            // between steps by the method's own interpolation: bisection to the last bit of the time
            let (mut low, mut high) = (t_before, t);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                match inside(&within(middle)) {
                    true => low = middle,
                    false => high = middle,
                }
            }
            end = high;
        }
        let at = |time: f64| if time == t { y.to_vec() } else { within(time) };
        while let Some(&wanted) = self.times.get(self.next).filter(|wanted| **wanted <= end) {
            self.seen.push((wanted, at(wanted)));
            self.next += 1;
        }
        if !leaves {
            return ControlFlow::Continue(());
        }
        if self.seen.last().is_some_and(|(time, _)| *time == end) {
            self.seen.pop();
        }
        self.stop = Some((end, at(end)));
        ControlFlow::Break(())
    }
}

/// The least distance of a joint to the end of its range; negative beyond it.
pub(crate) fn distance(plant: &Plant, y: &[f64]) -> f64 {
    distances(plant, y).map(|(distance, ..)| distance).fold(f64::MAX, f64::min)
}

/// Of every joint that has limits: how far it is from the nearer one, its name, and that limit.
fn distances<'a>(plant: &'a Plant, y: &'a [f64]) -> impl Iterator<Item = (f64, &'a str, f64)> {
    let joints = plant.model.free_joints().filter(|j| j.kind.is_single());
    joints.map(|joint| {
        let (q, Limits { lower, upper, .. }) = (y[joint.iq], joint.limits);
        let (limit, distance) = if q - lower < upper - q { (lower, q - lower) } else { (upper, upper - q) };
        (if distance.is_finite() { distance } else { f64::MAX }, joint.name.as_str(), limit)
    })
}

pub(crate) fn nearest_limit(plant: &Plant, time: f64, y: &[f64]) -> Stop {
    // one that began far beyond is not the one that has just come to its end
    let nearest = distances(plant, y).min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    let (_, joint, limit) = nearest.unwrap_or((0.0, "", 0.0));
    Stop { time, joint: joint.to_string(), limit }
}
