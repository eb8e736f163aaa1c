//! Simulation with adaptive steps: the motion that a command makes of a robot.
//!
//! The equations of [`Plant`] are integrated by an ODE library: an explicit method of order 8 with error control, or an implicit
//! one of order 5 (Radau IIA) for stiff systems. Where the command is not smooth the integration begins anew, and a joint
//! that reaches the end of its range is located as a root between steps.

use crate::command::Command;
use crate::drives::DriveEnergies;
use crate::plant::{Action, Plant};
use crate::solver::{solve, Equations};
use crate::table::Table;
use differential_equations::prelude::*;
use differential_equations::traits::State;
use std::fmt;
use straightline_core::algorithms::{kinetic_energy, DrivenMotion};
use straightline_core::model::{JointKind, Limits};

/// Times that are no further apart, as a part of the duration, are the same up to rounding.
pub(crate) const SAME: f64 = 1e-12;

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
}

/// What came out.
#[derive(Clone, Debug)]
pub struct Run {
    /// `t`, then per joint `q.`, `qd.`, `tau.` and, under a controller, `error.` (reference less measured), then `energy`, `work`
    /// and `losses` \[J\]; of a robot with drives per drive `u.` (after limits), `i.`, `speed.` and `m.` of its actuator before these.
    pub table: Table,
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
    /// The joint.
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
        Run {
            table: Table { names, rows: Vec::new() },
            q: Vec::new(),
            qd: Vec::new(),
            stop: None,
            balance: Balance::default(),
            steps: 0,
            evaluations: 0,
        }
    }
}

impl Balance {
    /// What is missing \[J\]: change of energy + losses − work, those of the drives with them.
    pub fn missing(&self) -> f64 {
        (self.after - self.before) + self.losses + self.drives.lost() - self.work - self.drives.electrical
    }

    /// The same by the energies that were turned over.
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

/// Why there is no result.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// When it went wrong \[s\].
    pub time: f64,
    /// What the solver says.
    pub why: String,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the simulation failed at t = {} s: {}", self.time, self.why)
    }
}

impl std::error::Error for Failure {}

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
    let before = plant.stored(&state);
    let mut run = Run::beginning(names(plant, command));
    let period = command.period();
    let wanted = rows(settings);
    let corners = pieces(command, period, settings.duration);
    let row = |t: f64, state: &[f64], held: Option<&Action>| row(plant, command, t, state, held);
    run.table.rows.push(row(0.0, &state, None));
    for piece in corners.windows(2) {
        let (start, end) = (piece[0], piece[1]);
        let held = period.map(|_| command.action(plant, start, &state));
        let system = System { plant, command, held: held.as_ref(), progress };
        let mut times: Vec<f64> = wanted.iter().copied().filter(|t| *t > start && *t < end).collect();
        times.push(end);
        let watch = Watch { plant, times: &times, next: 0, stops_at_limits: settings.stops_at_limits };
        let solution = solve(&system, watch, (start, end), &state, settings)?;
        for (t, y) in solution.t.iter().zip(&solution.y) {
            let interrupted = *t < end && !times.contains(t);
            if is_among(&wanted, *t, settings.duration) || interrupted {
                run.table.rows.push(row(*t, y, held.as_ref()));
            }
        }
        run.steps += solution.accepted;
        run.evaluations += solution.evaluations;
        if let (Some(y), Some(t)) = (solution.y.last(), solution.t.last()) {
            if !y.iter().all(|x| x.is_finite()) {
                return Err(Failure { time: *t, why: "a number is not finite".to_string() });
            }
            state = plant.normalised(y);
            if solution.interrupted {
                run.stop = Some(nearest_limit(plant, *t, y));
                break;
            }
        }
    }
    let (q, qd, work, losses) = plant.split(&state);
    let after = plant.stored(&state);
    let nq = plant.model.nq();
    let kinetic = |row: &Vec<f64>| kinetic_energy(&plant.model, &row[1..=nq], &row[nq + 1..=nq + qd.len()]);
    let (least, most) = run.table.rows.iter().map(kinetic).fold((f64::MAX, 0.0f64), |(l, m), e| (l.min(e), m.max(e)));
    let turnover = most - least;
    run.balance = Balance { before, after, work, losses, drives: plant.drive_energies(&state), turnover };
    (run.q, run.qd) = (q.to_vec(), qd.to_vec());
    Ok(run)
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
        Some(period) => (0..).map(|k| f64::from(k) * period).take_while(|t| *t < duration).collect(),
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
    let mut joints: Vec<_> = plant.model.bodies.iter().map(|b| &b.joint).collect();
    joints.sort_by_key(|j| j.iv);
    let named = |prefix: &str, of_base: &[&str]| -> Vec<String> {
        let of = |joint: &&straightline_core::model::Joint| match joint.kind {
            JointKind::Floating => of_base.iter().map(|c| format!("{prefix}.{}.{c}", joint.name)).collect(),
            _ => vec![format!("{prefix}.{}", joint.name)],
        };
        joints.iter().flat_map(of).collect()
    };
    let mut names = vec!["t".to_string()];
    names.extend(named("q", &["x", "y", "z", "qx", "qy", "qz", "qw"]));
    names.extend(named("qd", &["vx", "vy", "vz", "wx", "wy", "wz"]));
    names.extend(named("tau", &["fx", "fy", "fz", "mx", "my", "mz"]));
    if matches!(command, Command::Controller(_)) {
        names.extend(named("error", &[]));
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

/// The same of what the drives are known to do.
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
    fn states(&self) -> usize {
        self.plant.states()
    }

    fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]) {
        (self.progress)(t);
        match self.held {
            Some(action) => self.plant.rate(y, action, rate),
            None => self.plant.rate(y, &self.command.action(self.plant, t, y), rate),
        }
    }
}

/// Keeps the states at wanted times, and ends where a joint reaches the end of its range.
struct Watch<'a> {
    plant: &'a Plant,
    times: &'a [f64],
    next: usize,
    stops_at_limits: bool,
}

impl Watch<'_> {
    fn distance(&self, y: &[f64]) -> f64 {
        distance(self.plant, y)
    }
}

impl<Y: State<f64> + AsRef<[f64]>> Solout<f64, Y> for Watch<'_> {
    fn solout<I>(
        &mut self,
        t: f64,
        t_before: f64,
        y: &Y,
        y_before: &Y,
        interpolator: &mut I,
        solution: &mut Solution<f64, Y>,
    ) -> ControlFlag<f64, Y>
    where
        I: Interpolation<f64, Y> + ?Sized,
    {
        let mut end = t;
        let leaves = self.stops_at_limits && self.distance(y_before.as_ref()) > 0.0 && self.distance(y.as_ref()) <= 0.0;
        if leaves {
            // between steps by the method's own interpolation: bisection to the last bit of the time
            let (mut within, mut beyond) = (t_before, t);
            for _ in 0..60 {
                let middle = 0.5 * (within + beyond);
                match interpolator.interpolate(middle) {
                    Ok(state) if self.distance(state.as_ref()) > 0.0 => within = middle,
                    _ => beyond = middle,
                }
            }
            end = beyond;
        }
        while let Some(&wanted) = self.times.get(self.next).filter(|wanted| **wanted <= end) {
            let state = if wanted == t { Ok(y.clone()) } else { interpolator.interpolate(wanted) };
            if let Ok(state) = state {
                solution.push(wanted, state);
            }
            self.next += 1;
        }
        if !leaves {
            return ControlFlag::Continue;
        }
        if let Ok(state) = interpolator.interpolate(end) {
            solution.push(end, state);
        }
        ControlFlag::Terminate
    }
}

/// The least distance of a joint to the end of its range; negative beyond it.
pub(crate) fn distance(plant: &Plant, y: &[f64]) -> f64 {
    distances(plant, y).map(|(distance, ..)| distance).fold(f64::MAX, f64::min)
}

/// Of every joint that has limits: how far it is from the nearer one, its name, and that limit.
fn distances<'a>(plant: &'a Plant, y: &'a [f64]) -> impl Iterator<Item = (f64, &'a str, f64)> {
    let joints = plant.model.bodies.iter().map(|b| &b.joint).filter(|j| j.kind != JointKind::Floating);
    joints.map(|joint| {
        let (q, Limits { lower, upper, .. }) = (y[joint.iq], joint.limits);
        let (limit, distance) = if q - lower < upper - q { (lower, q - lower) } else { (upper, upper - q) };
        (if distance.is_finite() { distance } else { f64::MAX }, joint.name.as_str(), limit)
    })
}

pub(crate) fn nearest_limit(plant: &Plant, time: f64, y: &[f64]) -> Stop {
    let nearest = distances(plant, y).min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, joint, limit) = nearest.unwrap_or((0.0, "", 0.0));
    Stop { time, joint: joint.to_string(), limit }
}
