//! From phase to phase.

use super::events::objects_at_rest;
use super::object::SLOTS;
use super::state::{Closed, ContactWorld, Phases, Slip, GUARDS};
use super::{Contacts, Event};
use crate::command::{Command, Delayed};
use crate::ode::{solve, AcceptedStep, Equations, Pace, Watch};
use crate::plant::{Action, Plant};
use crate::simulate::{self, Balance, Failure, Run, Settings, SAME};
use std::ops::ControlFlow;
use straightline_core::algorithms::kinetic_energy;
use straightline_core::contact::Coordinate;

/// Events between two rows of the result, at most.
const MOST_EVENTS: usize = 1000;
/// Halvings in the search for an instant: down to the last bits of the time.
const HALVINGS: usize = 60;
/// How far a closed contact or a loop may be off at the beginning, after it was brought there \[m, or cosine\].
const CLOSED: f64 = 1e-9;

/// What came out.
#[derive(Clone, Debug)]
pub struct ContactRun {
    /// Its table has, beside those of every simulation, per contact `s.` (distance from the object at rest), `F.` with the
    /// coordinate, of contacts with friction `friction.`, `phase.` (0 open, 1 closed, 2 sticks), of objects that give way `front.`,
    /// and `kinetic`, `objects` (their energy). `energy` holds all.
    pub run: Run,
    /// Changes of phase, in order.
    pub events: Vec<Event>,
    /// The greatest |s| of a closed rigid constraint in a row of the result \[m, or cosine\].
    pub drift: f64,
}

/// Simulates from q, q̇ at time zero; `progress` hears the time as it goes on. Where closed contacts or loops do not hold at the
/// beginning the robot is brought there, to the nearest state in kinetic energy.
///
/// # Errors
/// The solver found no way on; contacts that cannot be closed, or objects that the robot is in, at the beginning; phases that
/// exclude each other.
pub fn simulate(
    plant: &Plant,
    contacts: &Contacts,
    command: &Command,
    (q, qd): (&[f64], &[f64]),
    settings: &Settings,
    progress: &dyn Fn(f64),
) -> Result<ContactRun, Failure> {
    simulate_from(plant, contacts, command, plant.state(q, qd), settings, progress)
}

/// Simulates from a state of [`Plant`] at time zero; where the robot has to be brought to its contacts, the springs of its
/// transmissions keep their stretch.
///
/// # Errors
/// As [`simulate()`].
pub fn simulate_from(
    plant: &Plant,
    contacts: &Contacts,
    command: &Command,
    start: Vec<f64>,
    settings: &Settings,
    progress: &dyn Fn(f64),
) -> Result<ContactRun, Failure> {
    let plant = &*plant.solved_by(settings.method);
    let system = ContactWorld { plant, contacts };
    let state = plant.normalised(&[start, objects_at_rest(contacts.touches.len())].concat());
    let pace = Pace::new(settings);
    let mut going = Going { system, command, settings, progress, pace, state, phases: Vec::new(), events: Vec::new() };
    let mut run = Run::beginning(going.names());
    let period = command.period();
    settings.check(run.table.names.len(), period)?;
    simulate::check_start(plant, &going.state[..plant.states()])?;
    let before = going.start()?;
    let mut drift = 0.0f64;
    let rows = simulate::rows(settings);
    let mut ends = [&simulate::pieces(command, period, settings.duration)[..], &rows].concat();
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|b, a| *b - *a <= SAME * settings.duration);
    let (mut held, mut delayed) = (None, Delayed::of(command));
    let mut next_computation = 0.0;
    run.push(going.row(0.0, None))?;
    for piece in ends.windows(2) {
        let (mut t, end) = (piece[0], piece[1]);
        if let Some(period) = period.filter(|_| t >= next_computation - SAME * settings.duration) {
            held = Some(delayed.next(going.action(t, &going.state, None)));
            next_computation += period;
        }
        let mut count = 0;
        while t < end {
            let reached = going.piece(t, end, held.as_ref(), &mut run)?;
            t = reached.time;
            if run.stop.is_some() {
                break;
            }
            count += usize::from(reached.has_event);
            if count > MOST_EVENTS {
                return Err(refused(t, format!("more than {MOST_EVENTS} events between two rows")));
            }
        }
        if simulate::is_among(&rows, t, settings.duration) || run.stop.is_some() {
            drift = drift.max(going.drift(t));
            run.push(going.row(t, held.as_ref()))?;
        }
        if run.stop.is_some() {
            break;
        }
    }
    let t = run.table.rows.last().map_or(0.0, |row| row[0]);
    let after = going.system.energy(t, &going.state, &going.phases);
    let (q, qd, work, losses) = plant.split(&going.state);
    let kinetic = run.table.column("kinetic").unwrap_or_default();
    let (least, most) = kinetic.iter().fold((f64::MAX, 0.0f64), |(l, h), e| (l.min(*e), h.max(*e)));
    // what comes after the plant's states are the objects'
    let drives = plant.drive_energies(&going.state[..plant.states()]);
    run.balance = Balance { before, after, work, losses, drives, turnover: most - least };
    (run.q, run.qd) = (q.to_vec(), qd.to_vec());
    Ok(ContactRun { run: run.end()?, events: going.events, drift })
}

fn refused(time: f64, why: String) -> Failure {
    Failure::new(time, why)
}

/// A simulation at an instant.
struct Going<'a> {
    system: ContactWorld<'a>,
    command: &'a Command,
    settings: &'a Settings,
    progress: &'a dyn Fn(f64),
    pace: Pace,
    state: Vec<f64>,
    phases: Phases,
    events: Vec<Event>,
}

/// Where a piece has ended.
struct Reached {
    time: f64,
    has_event: bool,
}

impl Going<'_> {
    fn action(&self, t: f64, state: &[f64], held: Option<&Action>) -> Action {
        held.map_or_else(|| self.command.action(self.system.plant, t, state), Action::clone)
    }

    /// Closes what is closed at the beginning; gives the energy there.
    fn start(&mut self) -> Result<f64, Failure> {
        let touches = self.system.touches();
        let close = |touch: &super::Touch| {
            let slip = if touch.contact.friction.is_some() { Slip::Slow } else { Slip::Smooth };
            // where it is closed from the beginning, all its coordinates are zero
            touch.closed.then_some(Closed { slip, held: [0.0; 6] })
        };
        self.phases = touches.iter().map(close).collect();
        let as_given = self.state.clone();
        let off = self.system.project(0.0, &mut self.state, &self.phases, 100);
        if off.is_nan() || off > CLOSED {
            let why = "the contacts and loops that are closed at the beginning cannot be closed from there";
            return Err(refused(0.0, format!("{why}: {off:.1e} m, or cosine, is left")));
        }
        if self.system.plant.is_driven() {
            // springs of the transmissions keep their stretch where the robot has been brought
            let slack = |state: &[f64]| {
                let (q, qd, ..) = self.system.plant.split(state);
                self.system.plant.state(q, qd)
            };
            let (before, after) = (slack(&as_given), slack(&self.state));
            for i in self.system.drive_states() {
                self.state[i] = as_given[i] + (after[i] - before[i]);
            }
        }
        for (k, touch) in touches.iter().enumerate() {
            let seen = self.system.see(0.0, &self.state, k);
            if let Some(closed) = &mut self.phases[k] {
                let fast = touch.contact.friction.is_some_and(|f| seen.slip_speed() > f.speed);
                closed.slip = if fast { Slip::Fast } else { closed.slip };
            } else if touch.contact.constrained.contains(&Coordinate::Pz) && seen.gap.0 < -1e-6 {
                let (name, depth) = (self.system.name(k), -seen.gap.0);
                let why = format!("contact {name} is {depth:.3e} m inside its object at the beginning");
                return Err(refused(0.0, why));
            }
        }
        let energy = self.system.energy(0.0, &self.state, &self.phases);
        Ok(energy)
    }

    /// Goes on until `end`, or until a phase ends before.
    fn piece(&mut self, t: f64, end: f64, held: Option<&Action>, run: &mut Run) -> Result<Reached, Failure> {
        if self.system.contacts.projects {
            self.system.project(t, &mut self.state, &self.phases, 1);
        }
        let action = self.action(t, &self.state, held);
        let settled = self.system.settle(t, &mut self.state, &mut self.phases, &action);
        let Some(settled) = settled else {
            return Err(refused(t, "contacts exclude each other: none of their phases lasts".to_string()));
        };
        self.events.extend(settled);
        let begins = &self.state;
        let first = self.guards(t, begins, held);
        let watched = |end: f64, watches: bool, run: &mut Run| {
            Watched { going: self, held, first: &first }.solve((t, end), begins, watches, run)
        };
        let SolverProgress { last, fallen } = watched(end, true, run)?;
        let Some((guard, mut time)) = fallen else {
            self.state = self.system.plant.normalised(&last);
            return Ok(Reached { time: end, has_event: false });
        };
        // the state there as exactly as everywhere, not by interpolation, and the instant once more from it
        let at = |time: f64, run: &mut Run| match time - t > 1e-13 * end.max(1.0) {
            true => Ok(watched(time, false, run)?.last),
            false => Ok::<_, Failure>(begins.clone()),
        };
        let better = time - self.newton(time, &at(time, run)?, guard, held);
        if better > t && better < end {
            time = better;
        }
        let state = self.system.plant.normalised(&at(time, run)?);
        self.state = state;
        match guard {
            Guard::Contact(guard) => {
                let what = self.system.fallen(time, &mut self.state, &mut self.phases, guard);
                self.events.extend(what.map(|what| Event { time, contact: self.system.name(guard / GUARDS), what }));
            }
            Guard::Limit => run.stop = Some(simulate::nearest_limit(self.system.plant, time, &self.state)),
        }
        Ok(Reached { time, has_event: true })
    }

    /// The guards of all contacts.
    fn guards(&self, t: f64, state: &[f64], held: Option<&Action>) -> Vec<f64> {
        self.system.all_guards(t, state, &self.phases, &self.action(t, state, held))
    }

    /// g/ġ of a guard at a state, ġ from the rate of the state: by how much its root is missed \[s\].
    fn newton(&self, t: f64, state: &[f64], guard: Guard, held: Option<&Action>) -> f64 {
        let value = |t: f64, y: &[f64]| match guard {
            // the second guard of an open contact stands for the first
            Guard::Contact(k) if k % GUARDS == 1 && self.phases[k / GUARDS].is_none() => self.guards(t, y, held)[k - 1],
            Guard::Contact(k) => self.guards(t, y, held)[k],
            Guard::Limit => simulate::distance(self.system.plant, y),
        };
        let watched = Watched { going: self, held, first: &[] };
        let (mut rate, h) = (vec![0.0; state.len()], 1e-7);
        watched.rate(t, state, &mut rate);
        let along = |h: f64| state.iter().zip(&rate).map(|(y, r)| y + h * r).collect::<Vec<f64>>();
        let slope = (value(t + h, &along(h)) - value(t - h, &along(-h))) / (2.0 * h);
        let step = value(t, state) / slope;
        // interpolation misses by little: whatever else comes out, a guard that only grazes zero, is none of Newton's business
        if step.abs() < 1e-5 {
            step
        } else {
            0.0
        }
    }

    /// The greatest |s| of what is closed and rigid.
    fn drift(&self, t: f64) -> f64 {
        self.system.violation(t, &self.state, &self.phases)
    }

    fn names(&self) -> Vec<String> {
        let mut names = simulate::names(self.system.plant, self.command);
        for touch in self.system.touches() {
            let name = &touch.contact.name;
            names.push(format!("s.{name}"));
            names.extend(touch.contact.constrained.iter().map(|c| format!("F.{name}.{}", c.name())));
            if touch.contact.friction.is_some() {
                names.push(format!("friction.{name}"));
            }
            if touch.environment.is_some() {
                names.push(format!("front.{name}"));
            }
            names.push(format!("phase.{name}"));
        }
        names.extend(["kinetic".to_string(), "objects".to_string()]);
        names
    }

    fn row(&self, t: f64, held: Option<&Action>) -> Vec<f64> {
        let system = &self.system;
        let objects = system.energy_of_objects(t, &self.state, &self.phases);
        let seen = system.see_all(t, &self.state);
        let action = self.action(t, &self.state, held);
        let moved = system.moved(&self.state, system.rows(&self.state, &seen, &self.phases), &action);
        let mut row = simulate::row_of(system.plant, self.command, (t, &self.state), action, moved.drives.as_ref());
        if let Some(energy) = simulate::names(system.plant, self.command).iter().position(|name| name == "energy") {
            row[energy] += objects;
        }
        for (k, touch) in system.touches().iter().enumerate() {
            let own = moved.rows.of[k].clone();
            let force = |c: &Coordinate| own.clone().find(|i| moved.rows.coordinates[*i] == *c).map(|i| moved.force[i]);
            row.push(seen[k].s.0);
            row.extend(touch.contact.constrained.iter().map(|c| force(c).unwrap_or(0.0)));
            if touch.contact.friction.is_some() {
                row.push(system.pressed(k, &seen[k], &moved).tangential);
            }
            if touch.environment.is_some() {
                let closed = self.phases[k].is_some();
                row.push(if closed { seen[k].s.0 } else { seen[k].s.0 - seen[k].gap.0 });
            }
            row.push(match self.phases[k] {
                None => 0.0,
                Some(Closed { slip: Slip::Sticks, .. }) => 2.0,
                Some(_) => 1.0,
            });
        }
        let (q, qd, ..) = system.plant.split(&self.state);
        row.extend([kinetic_energy(&system.plant.model, q, qd), objects]);
        row
    }
}

/// What has fallen.
#[derive(Clone, Copy)]
enum Guard {
    Contact(usize),
    /// A joint is at the end of its range.
    Limit,
}

/// What the solver has shown.
struct SolverProgress {
    last: Vec<f64>,
    fallen: Option<(Guard, f64)>,
}

/// A phase under the solver.
struct Watched<'a, 'b> {
    going: &'a Going<'b>,
    held: Option<&'a Action>,
    /// The guards at the beginning.
    first: &'a [f64],
}

impl Equations for Watched<'_, '_> {
    fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]) {
        let Going { system, progress, phases, .. } = self.going;
        progress(t);
        system.rate(t, y, phases, &self.going.action(t, y, self.held), rate);
    }

    fn quantity(&self, i: usize) -> String {
        let plant = self.going.system.plant;
        match i < plant.states() {
            true => plant.quantity(i),
            false => format!("the object of contact `{}`", self.going.system.name((i - plant.states()) / SLOTS)),
        }
    }

    fn objection(&self, y: &[f64]) -> Option<String> {
        self.going.system.plant.objection(y)
    }
}

impl Watched<'_, '_> {
    /// The guards, and that of the joints' ranges. What stands a little inside its object at the beginning of a phase, by
    /// rounding, falls from there.
    fn values(&self, t: f64, y: &[f64]) -> Vec<f64> {
        let Going { system, settings, phases, .. } = self.going;
        let mut values = self.going.guards(t, y, self.held);
        for (k, _) in phases.iter().enumerate().filter(|(_, phase)| phase.is_none()) {
            values[GUARDS * k + 1] -= self.first[GUARDS * k].min(0.0);
        }
        if settings.stops_at_limits {
            values.push(simulate::distance(system.plant, y));
        }
        values
    }

    fn solve(&self, times: (f64, f64), from: &[f64], watches: bool, run: &mut Run) -> Result<SolverProgress, Failure> {
        let mut looks = GuardWatch { of: self, armed: Vec::new(), watches, fallen: None };
        let solved = solve(self, &mut looks, times, from, self.going.settings, &self.going.pace)?;
        run.steps += solved.accepted;
        run.evaluations += solved.evaluations;
        Ok(SolverProgress { last: solved.y, fallen: looks.fallen })
    }
}

/// Looks between steps for the first guard that falls.
struct GuardWatch<'a, 'b, 'c> {
    of: &'a Watched<'b, 'c>,
    /// Guards that have been positive.
    armed: Vec<bool>,
    watches: bool,
    fallen: Option<(Guard, f64)>,
}

impl Watch for GuardWatch<'_, '_, '_> {
    fn step(&mut self, step: &AcceptedStep) -> ControlFlow<()> {
        if !self.watches {
            return ControlFlow::Continue(());
        }
        let AcceptedStep { t_before, t, y, within, .. } = *step;
        let now = self.of.values(t, y);
        let first_fallen = |armed: &[bool], values: &[f64]| {
            (0..values.len()).find(|i| armed.get(*i) == Some(&true) && values[*i] <= 0.0)
        };
        let arms = |armed: Vec<bool>| (0..now.len()).map(|i| armed.get(i) == Some(&true) || now[i] > 0.0).collect();
        let Some(mut guard) = first_fallen(&self.armed, &now).filter(|_| t > t_before) else {
            self.armed = arms(std::mem::take(&mut self.armed));
            return ControlFlow::Continue(());
        };
        let (mut low, mut high) = (t_before, t);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            match first_fallen(&self.armed, &self.of.values(middle, &within(middle))) {
                Some(first) => (high, guard) = (middle, first),
                None => low = middle,
            }
        }
        let limit = GUARDS * self.of.going.phases.len();
        let guard = if guard == limit { Guard::Limit } else { Guard::Contact(guard) };
        self.fallen = Some((guard, high));
        ControlFlow::Break(())
    }
}
