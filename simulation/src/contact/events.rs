//! What happens between phases: impacts, lift-offs, sticking and slipping, and what keeps constraints closed.

use super::object::{let_go, SLOTS};
use super::state::{Closed, ContactWorld, Phases, Rows, Seen, Slip, StateParts, GUARDS, RIDGE, SLACK};
use super::{ContactEvent, Event};
use crate::plant::Action;
use straightline_core::algorithms::{driven_jump, impact, projection, FunctionalCoordinates, Struck, Support};
use straightline_core::contact::Coordinate;

/// Slower than this \[m/s\] an open contact that stands on its object is at rest there.
const AT_REST: f64 = 1e-9;

/// What an impact did.
struct Blow {
    /// Along the distance, or what is largest \[N·s or N·m·s\].
    impulse: f64,
    /// Energy that is gone \[J\].
    lost: f64,
}

impl ContactWorld<'_> {
    /// Every row that is not on an object that gives way.
    fn rigid(rows: &Rows) -> FunctionalCoordinates<f64> {
        let kept: Vec<usize> = (0..rows.s.len()).filter(|i| matches!(rows.supports[*i], Support::Rigid(_))).collect();
        let of = |list: &[f64]| kept.iter().map(|i| list[*i]).collect();
        FunctionalCoordinates {
            value: of(&rows.s.value),
            rate: of(&rows.s.rate),
            jacobian: kept.iter().map(|i| rows.s.jacobian[*i].clone()).collect(),
            bias: of(&rows.s.bias),
        }
    }

    /// The greatest |s| of what is closed and rigid \[m, or cosine\].
    pub fn violation(&self, t: f64, state: &[f64], phases: &Phases) -> f64 {
        let s = Self::rigid(&self.rows(state, &self.see_all(t, state), phases));
        s.value.iter().fold(0.0f64, |m, x| m.max(x.abs()))
    }

    /// Brings positions and velocities back onto rigid constraints, so often at most; gives how far they are off after it \[m, or
    /// cosine\].
    pub fn project(&self, t: f64, state: &mut Vec<f64>, phases: &Phases, times: usize) -> f64 {
        let nq = self.nq();
        let largest = |s: &FunctionalCoordinates<f64>| s.value.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let rigid = |state: &[f64]| Self::rigid(&self.rows(state, &self.see_all(t, state), phases));
        let mut s = rigid(state);
        if s.is_empty() {
            return 0.0;
        }
        for _ in 0..times {
            let dq = projection(&self.factor(&state[..nq]), &s, &s.value, RIDGE);
            let change = self.plant.configuration_rate(&state[..nq], &dq);
            state[..nq].iter_mut().zip(change.iter()).for_each(|(q, d)| *q += d);
            *state = self.plant.normalised(state);
            s = rigid(state);
            if largest(&s) < 1e-14 {
                break;
            }
        }
        let struck = vec![Struck::Rigid; s.len()];
        let factor = self.factor(&state[..nq]);
        let still = impact(&factor, &state[self.velocities()], &s, None, &struck, 0.0, RIDGE);
        self.jump(state, &still.dqd, (&s.jacobian, &still.impulse));
        largest(&s)
    }

    /// q̇ jumps, and what turns with the joints, under impulses in these directions.
    fn jump(&self, state: &mut [f64], dqd: &[f64], (directions, impulses): (&[Vec<f64>], &[f64])) {
        if self.plant.is_driven() {
            let (model, q) = (&self.plant.model, &state[..self.nq()]);
            let inertial = |row: &[f64]| row.iter().zip(dqd).map(|(h, x)| h * x).sum::<f64>();
            let mut held: Vec<f64> = self.plant.equations().mass_matrix(q).chunks(dqd.len()).map(inertial).collect();
            for (row, impulse) in directions.iter().zip(impulses) {
                held.iter_mut().zip(row).for_each(|(sum, j)| *sum -= j * impulse);
            }
            let dx = driven_jump(model, q, dqd, &held);
            state[self.drive_states()].iter_mut().zip(dx).for_each(|(x, d)| *x += d);
        }
        state[self.velocities()].iter_mut().zip(dqd).for_each(|(v, d)| *v += d);
    }

    /// Contact `closing` closes, or begins to stick, in the phases `after`.
    fn blow(
        &self,
        t: f64,
        state: &mut [f64],
        (before, after): (&Phases, &Phases),
        closing: usize,
        restitution: f64,
    ) -> Blow {
        let seen = self.see_all(t, state);
        let rows = self.rows(state, &seen, after);
        let mut struck = vec![Struck::Rigid; rows.s.len()];
        for (k, seen) in seen.iter().enumerate() {
            let Some(object) = &self.touches()[k].environment else { continue };
            for i in rows.of[k].clone().filter(|i| rows.coordinates[*i] == Coordinate::Pz) {
                // what is closed already moves with its object
                let velocity = if before[k].is_none() { seen.s.1 - seen.gap.1 } else { seen.s.1 };
                struck[i] = Struck::Mass { mass: object.struck_mass(), velocity };
            }
        }
        let StateParts { q, qd, .. } = self.parts(state);
        let blow = impact(&self.factor(q), qd, &rows.s, Some(&rows.applied), &struck, restitution, RIDGE);
        let energy = self.energy(t, state, before);
        let given = self.power_of_objects(state, &seen, &rows, &blow.impulse);
        let work = self.work();
        self.jump(state, &blow.dqd, (&rows.applied, &blow.impulse));
        let own = rows.of[closing].clone();
        if restitution > 0.0 {
            // it leaves again, and so does the mass that it has struck
            let mut slots = self.slots(state, closing);
            if let Some(i) = own.clone().find(|i| matches!(struck[*i], Struck::Mass { .. })) {
                slots[1] = blow.struck_velocity[i];
            }
            self.set_slots(state, closing, slots);
        }
        let now = if restitution > 0.0 { before } else { after };
        let lost = energy - self.energy(t, state, now) + given;
        state[work] += given;
        state[work + 1] += lost;
        let of = |i: usize| blow.impulse[i];
        let along = own.clone().find(|i| rows.coordinates[*i] == Coordinate::Pz).map(of);
        let impulse = along.unwrap_or_else(|| own.map(of).fold(0.0, |m: f64, x| if x.abs() > m.abs() { x } else { m }));
        Blow { impulse, lost }
    }

    /// The robot meets an object.
    fn strike(&self, t: f64, state: &mut [f64], phases: &mut Phases, k: usize) -> ContactEvent {
        let touch = &self.touches()[k];
        let seen = self.see(t, state, k);
        let slip = match touch.contact.friction {
            None => Slip::Smooth,
            Some(friction) if seen.slip_speed() > friction.speed => Slip::Fast,
            Some(_) => Slip::Slow,
        };
        let mut after = phases.clone();
        after[k] = Some(Closed { slip, held: seen.where_it_closes() });
        // slower than this it comes to rest: bounces that come ever faster have an end
        let bounces = -seen.gap.1 * touch.restitution > self.contacts.rest_speed;
        let restitution = if bounces { touch.restitution } else { 0.0 };
        let Blow { impulse, lost } = self.blow(t, state, (phases, &after), k, restitution);
        if bounces {
            return ContactEvent::Bounces { impulse, lost };
        }
        *phases = after;
        ContactEvent::Touches { impulse, lost }
    }

    fn open(&self, state: &mut [f64], seen: &Seen, phases: &mut Phases, k: usize) -> ContactEvent {
        if let Some(object) = &self.touches()[k].environment {
            let slots = let_go(object, seen.s, self.slots(state, k));
            self.set_slots(state, k, slots);
        }
        phases[k] = None;
        ContactEvent::LiftsOff
    }

    fn stick(&self, t: f64, state: &mut [f64], phases: &mut Phases, k: usize) -> ContactEvent {
        let mut after = phases.clone();
        if let Some(closed) = &mut after[k] {
            *closed = Closed { slip: Slip::Sticks, held: self.see(t, state, k).where_it_sticks(closed.held) };
        }
        self.blow(t, state, (phases, &after), k, 0.0);
        *phases = after;
        ContactEvent::Sticks
    }

    /// A guard has fallen: its place among all.
    pub fn fallen(&self, t: f64, state: &mut [f64], phases: &mut Phases, guard: usize) -> Option<ContactEvent> {
        let (k, which) = (guard / GUARDS, guard % GUARDS);
        let seen = self.see(t, state, k);
        let Some(closed) = &mut phases[k] else { return Some(self.strike(t, state, phases, k)) };
        match (closed.slip, which) {
            (_, 0) => Some(self.open(state, &seen, phases, k)),
            (Slip::Fast, _) => {
                closed.slip = Slip::Slow;
                None
            }
            (Slip::Slow, 1) => {
                closed.slip = Slip::Fast;
                None
            }
            (Slip::Slow, _) => Some(self.stick(t, state, phases, k)),
            (Slip::Sticks, _) => {
                closed.slip = Slip::Slow;
                Some(ContactEvent::Slides)
            }
            (Slip::Smooth, _) => None,
        }
    }

    /// What cannot last an instant: reactions that pull, contacts that are pressed together though open, friction that holds
    /// what slides slowly or does not hold what sticks. One after the other; `None` if that finds no end.
    pub fn settle(&self, t: f64, state: &mut Vec<f64>, phases: &mut Phases, action: &Action) -> Option<Vec<Event>> {
        let mut events = Vec::new();
        for _ in 0..8 * (phases.len() + 1) {
            match self.unsettled(t, state, phases, action) {
                None => return Some(events),
                Some((k, what)) => {
                    events.extend(what.map(|what| Event { time: t, contact: self.name(k), what }));
                }
            }
        }
        None
    }

    pub fn name(&self, k: usize) -> String {
        self.touches()[k].contact.name.clone()
    }

    /// Changes the first thing that cannot last.
    fn unsettled(
        &self,
        t: f64,
        state: &mut Vec<f64>,
        phases: &mut Phases,
        action: &Action,
    ) -> Option<(usize, Option<ContactEvent>)> {
        *state = self.plant.normalised(state);
        let seen = self.see_all(t, state);
        let moved = self.moved(state, self.rows(state, &seen, phases), action);
        let count = phases.len();
        // the reaction that pulls most
        let pulls = |k: usize| {
            let touch = &self.touches()[k];
            let may = touch.environment.is_none() && !touch.stays;
            let pushes = touch.contact.constrained.contains(&Coordinate::Pz);
            phases[k].filter(|_| may && pushes).map_or(0.0, |_| self.pressed(k, &seen[k], &moved).normal)
        };
        let most = (0..count).map(|k| (k, pulls(k))).min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((k, _)) = most.filter(|(_, force)| *force < 0.0) {
            // not by rounding: opened, it would rise
            let mut opened = phases.clone();
            opened[k] = None;
            let risen = self.moved(state, self.rows(state, &seen, &opened), action);
            if seen[k].acceleration(&risen.qdd) > AT_REST {
                return Some((k, Some(self.open(state, &seen[k], phases, k))));
            }
        }
        for k in 0..count {
            let (touch, at) = (&self.touches()[k], &seen[k]);
            let Some(closed) = phases[k] else {
                if at.gap.0 > SLACK {
                    continue;
                }
                let free = at.acceleration(&moved.qdd);
                let rests = at.gap.1.abs() <= AT_REST && touch.environment.is_none() && free < -AT_REST;
                let pushes = touch.contact.constrained.contains(&Coordinate::Pz);
                let is_inside = at.gap.0 < -2.0 * SLACK && at.gap.1 <= AT_REST;
                if at.gap.1 < -AT_REST || (rests && pushes) || is_inside {
                    let what = self.strike(t, state, phases, k);
                    return Some((k, Some(what)));
                }
                continue;
            };
            let Some(friction) = touch.contact.friction else { continue };
            match closed.slip {
                Slip::Slow if self.excess(k, &seen, state, phases, action) < 0.0 => {
                    return Some((k, Some(self.stick(t, state, phases, k))));
                }
                Slip::Fast if at.slip_speed() <= friction.speed => {
                    phases[k] = Some(Closed { slip: Slip::Slow, ..closed });
                    return Some((k, None));
                }
                _ => {}
            }
        }
        None
    }
}

/// Coordinates of objects in a state, all at rest.
pub(super) fn objects_at_rest(touches: usize) -> Vec<f64> {
    vec![0.0; SLOTS * touches]
}
