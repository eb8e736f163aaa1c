//! The equations of a robot that touches objects: what is closed, what follows from it, and when that ends.
//!
//! A contact is open, or it is closed and, with friction, slides or sticks. What is closed makes the rows of (20.88), (20.89), or
//! of (20.92)-(20.94) where the object gives way. All of this is smooth until a guard falls to zero: the distance of an open
//! contact, the reaction of a closed one, the speed of one that slides, what friction can hold of one that sticks.

use super::object::{energy_and_heat, front, released, Slots, SLOTS};
use super::{Contacts, Touch};
use crate::plant::{Action, Plant};
use std::ops::Range;
use straightline_core::algorithms::{
    applied_rows, constrained_forward_dynamics, driven_contact_motion, driven_factor, functional_coordinates,
    relative_motion, ContactRows, DrivenMotion, FunctionalCoordinates, Ltdl, RelativeMotion, Support,
};
use straightline_core::contact::{Contact, Coordinate, Object};
use straightline_core::spatial::Vec3;

/// ε of the regularisation in f64.
pub(super) const RIDGE: f64 = 1e-12;
/// An open contact may be this far inside \[m\] before it counts as closing: rounding at a lift-off.
pub(super) const SLACK: f64 = 1e-9;

/// A coordinate that moves less than this per unit of every joint does not move.
const STILL: f64 = 1e-9;

/// Guards of each contact.
pub(super) const GUARDS: usize = 3;

/// How a closed contact moves along the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slip {
    /// Without friction.
    Smooth,
    /// Faster than the speed of its friction law.
    Fast,
    /// Slower than that: where friction can hold it, it sticks.
    Slow,
    /// Not at all.
    Sticks,
}

/// A closed contact: how it slips, and the values at which its coordinates are held, in the order of [`Coordinate::ALL`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closed {
    pub slip: Slip,
    pub held: [f64; 6],
}

/// Per contact: `None` while it is open.
pub(super) type Phases = Vec<Option<Closed>>;

/// A robot among its objects.
pub(super) struct ContactWorld<'a> {
    pub plant: &'a Plant,
    pub contacts: &'a Contacts,
}

/// A state taken apart.
#[derive(Clone, Copy)]
pub(super) struct StateParts<'s> {
    pub q: &'s [f64],
    pub qd: &'s [f64],
}

/// How a contact stands to its object.
pub(super) struct Seen {
    pub contact: Contact<f64>,
    pub motion: RelativeMotion<f64>,
    /// Distance from the object at rest \[m\], and its rate.
    pub s: (f64, f64),
    /// Its second derivative: A for q̈ = 0, and its row of J.
    row: FunctionalCoordinates<f64>,
    /// Distance from the object's front \[m\], and its rate.
    pub gap: (f64, f64),
    normal: Vec3<f64>,
    /// Velocity along the surface \[m/s\].
    slip: Vec3<f64>,
}

impl Seen {
    /// s̈ \[m/s²\].
    pub fn acceleration(&self, qdd: &[f64]) -> f64 {
        self.row.jacobian[0].iter().zip(qdd).map(|(j, a)| j * a).sum::<f64>() + self.row.bias[0]
    }

    /// Where the coordinates of a contact that closes are held: the distance at zero, all others where they are.
    pub fn where_it_closes(&self) -> [f64; 6] {
        let now = functional_coordinates(&self.contact, &self.motion, &Coordinate::ALL).value;
        Coordinate::ALL.map(|c| if c == Coordinate::Pz { 0.0 } else { now[c as usize] })
    }

    /// Where the coordinates of a contact that begins to stick are held: where they are along the surface.
    pub fn where_it_sticks(&self, held: [f64; 6]) -> [f64; 6] {
        let now = self.motion.position;
        let [.., pz, ax, ay, az] = held;
        [now.x, now.y, pz, ax, ay, az]
    }

    pub fn slip_speed(&self) -> f64 {
        self.slip.dot(self.slip).sqrt()
    }

    /// Friction per normal force: μ v/√(v² + w²).
    fn tilt(&self) -> Vec3<f64> {
        self.contact.friction.map_or_else(Vec3::zero, |f| {
            self.slip.scale(f.coefficient / (self.slip.dot(self.slip) + f.speed * f.speed).sqrt())
        })
    }
}

/// The rows of all that is closed.
#[derive(Default)]
pub(super) struct Rows {
    pub s: FunctionalCoordinates<f64>,
    pub applied: Vec<Vec<f64>>,
    pub supports: Vec<Support<f64>>,
    /// Rows of each contact, empty of open ones; those of loops come after.
    pub of: Vec<Range<usize>>,
    /// Coordinates of the rows of contacts.
    pub coordinates: Vec<Coordinate>,
    /// Friction per normal force of each contact.
    tilts: Vec<Vec3<f64>>,
}

/// A motion of the robot and its reactions.
pub(super) struct Moved {
    pub qdd: Vec<f64>,
    pub force: Vec<f64>,
    pub rows: Rows,
    /// What the drives do, where there are any.
    pub drives: Option<DrivenMotion<f64>>,
}

/// Normal force and friction of a contact \[N\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pressed {
    pub normal: f64,
    pub tangential: f64,
}

impl<'a> ContactWorld<'a> {
    pub fn nq(&self) -> usize {
        self.plant.model.nq()
    }

    pub fn nv(&self) -> usize {
        self.plant.model.nv()
    }

    /// Place of q̇ in the state.
    pub fn velocities(&self) -> Range<usize> {
        self.nq()..self.nq() + self.nv()
    }

    /// Place of the states of the drives.
    pub fn drive_states(&self) -> Range<usize> {
        let first = self.velocities().end;
        first..first + self.plant.drive_states()
    }

    /// Place of the work in the state; the losses come after it.
    pub fn work(&self) -> usize {
        self.drive_states().end
    }

    /// The state is that of the plant, then the coordinates of the objects.
    pub fn parts<'s>(&self, state: &'s [f64]) -> StateParts<'s> {
        let (q, qd, ..) = self.plant.split(state);
        StateParts { q, qd }
    }

    pub fn slots(&self, state: &[f64], k: usize) -> Slots {
        let first = self.plant.states() + SLOTS * k;
        [0, 1, 2, 3].map(|i| state[first + i])
    }

    pub fn set_slots(&self, state: &mut [f64], k: usize, slots: Slots) {
        let first = self.plant.states() + SLOTS * k;
        state[first..first + SLOTS].copy_from_slice(&slots);
    }

    pub fn touches(&self) -> &'a [Touch] {
        &self.contacts.touches
    }

    /// The contact with its object where that is at a time.
    fn placed(&self, k: usize, t: f64) -> Contact<f64> {
        let touch = &self.touches()[k];
        let mut contact = touch.contact.clone();
        if let Some(law) = &touch.law {
            contact.object = Object::Moving(law.at(t));
        }
        contact
    }

    pub fn see(&self, t: f64, state: &[f64], k: usize) -> Seen {
        let StateParts { q, qd, .. } = self.parts(state);
        let contact = self.placed(k, t);
        let motion = relative_motion(&self.plant.model, &contact, q, qd);
        let row = functional_coordinates(&contact, &motion, &[Coordinate::Pz]);
        let s = (row.value[0], row.rate[0]);
        let object = self.touches()[k].environment.as_ref();
        let (front, front_rate) = object.map_or((0.0, 0.0), |object| front(object, self.slots(state, k)));
        let normal = contact.surface.normal(motion.position);
        let slip = motion.velocity - normal.scale(normal.dot(motion.velocity));
        Seen { gap: (s.0 - front, s.1 - front_rate), s, row, normal, slip, contact, motion }
    }

    pub fn see_all(&self, t: f64, state: &[f64]) -> Vec<Seen> {
        (0..self.touches().len()).map(|k| self.see(t, state, k)).collect()
    }

    /// Rows of what is closed.
    pub fn rows(&self, state: &[f64], seen: &[Seen], phases: &Phases) -> Rows {
        let StateParts { q, qd, .. } = self.parts(state);
        let mut rows = Rows::default();
        for (k, (seen, phase)) in seen.iter().zip(phases).enumerate() {
            let first = rows.s.len();
            let Some(closed) = phase else {
                rows.of.push(first..first);
                rows.tilts.push(Vec3::zero());
                continue;
            };
            let mut contact = seen.contact.clone();
            let sticks = closed.slip == Slip::Sticks;
            // a direction in which nothing moves, as of a planar arm, needs no force: it would be rounding over rounding
            let moves = |k: usize| seen.motion.jacobian[k].iter().any(|j| j.abs() > STILL);
            let also = |c: &Coordinate| match c {
                Coordinate::Px => sticks && moves(0),
                Coordinate::Py => sticks && moves(1),
                _ => false,
            };
            contact.constrained.retain(|c| !also(c));
            contact.constrained.extend(Coordinate::ALL.iter().filter(|c| also(c)));
            contact.constrained.sort();
            contact.friction = contact.friction.filter(|_| matches!(closed.slip, Slip::Fast | Slip::Slow));
            rows.tilts.push(if contact.friction.is_some() { seen.tilt() } else { Vec3::zero() });
            let mut s = functional_coordinates(&contact, &seen.motion, &contact.constrained);
            rows.applied.extend(applied_rows(&contact, &seen.motion, &s));
            let distance = contact.constrained.iter().position(|c| *c == Coordinate::Pz);
            for (i, c) in contact.constrained.iter().enumerate() {
                s.value[i] -= closed.held[*c as usize];
            }
            for i in 0..s.len() {
                let support = match self.touches()[k].environment.as_ref().filter(|_| distance == Some(i)) {
                    Some(object) => {
                        let [.., e, ed] = self.slots(state, k);
                        object.support((s.value[i], s.rate[i]), (e, ed))
                    }
                    None => Support::Rigid(self.pulled_back(s.value[i], s.rate[i])),
                };
                rows.supports.push(support);
            }
            rows.coordinates.extend(&contact.constrained);
            rows.s = std::mem::take(&mut rows.s).and(s);
            rows.of.push(first..rows.s.len());
        }
        for a_loop in &self.contacts.loops {
            let motion = relative_motion(&self.plant.model, a_loop, q, qd);
            let s = functional_coordinates(a_loop, &motion, &a_loop.constrained);
            rows.applied.extend(s.jacobian.clone());
            rows.supports.extend(s.value.iter().zip(&s.rate).map(|(s, sd)| Support::Rigid(self.pulled_back(*s, *sd))));
            rows.s = std::mem::take(&mut rows.s).and(s);
        }
        rows
    }

    /// Baumgarte's s̈.
    fn pulled_back(&self, s: f64, sd: f64) -> f64 {
        self.contacts.stabilisation.map_or(0.0, |(w, zeta)| -2.0 * zeta * w * sd - w * w * s)
    }

    /// The factor of H, rotors of rigid drives in it.
    pub fn factor(&self, q: &[f64]) -> Ltdl<f64> {
        let (model, h) = (&self.plant.model, self.plant.equations().mass_matrix(q));
        match self.plant.is_driven() {
            true => driven_factor(model, q, &h),
            false => Ltdl::factor(model, &h),
        }
    }

    /// q̈ and F under what acts.
    pub fn moved(&self, state: &[f64], rows: Rows, action: &Action) -> Moved {
        let (model, StateParts { q, qd, .. }) = (&self.plant.model, self.parts(state));
        let bias = self.plant.equations().bias_force(q, qd);
        let applied = Some(rows.applied.as_slice());
        if self.plant.is_driven() {
            let x = self.plant.x(state);
            let u = self.plant.inputs(qd, x, &action.u);
            let bias: Vec<f64> = bias.iter().zip(&action.tau).map(|(h, tau)| h - tau).collect();
            let of = ContactRows { coordinates: &rows.s, applied, supports: &rows.supports, ridge: RIDGE };
            let h = self.plant.equations().mass_matrix(q);
            let (found, drives) = driven_contact_motion(model, (q, qd, x, &u), &bias, &h, of);
            return Moved { qdd: found.qdd, force: found.force, rows, drives: Some(drives) };
        }
        let drive: Vec<f64> = action.tau.iter().zip(bias).map(|(tau, h)| tau - h).collect();
        let found = constrained_forward_dynamics(&self.factor(q), &drive, &rows.s, applied, &rows.supports, RIDGE);
        Moved { qdd: found.qdd, force: found.force, rows, drives: None }
    }

    /// Power that moving objects give, reactions or impulses being F: what F does on the robot, less what it does on the way
    /// between robot and object.
    pub fn power_of_objects(&self, state: &[f64], seen: &[Seen], rows: &Rows, force: &[f64]) -> f64 {
        let qd = self.parts(state).qd;
        let times = |row: &[f64]| row.iter().zip(qd).map(|(j, v)| j * v).sum::<f64>();
        let mut power = 0.0;
        for (k, seen) in seen.iter().enumerate().filter(|(k, _)| self.touches()[*k].law.is_some()) {
            for i in rows.of[k].clone() {
                power -= force[i] * (rows.s.rate[i] - times(&rows.s.jacobian[i]));
                if rows.coordinates[i] == Coordinate::Pz {
                    let robot = Vec3::from([0, 1, 2].map(|c| times(&seen.motion.jacobian[c])));
                    power += force[i] * rows.tilts[k].dot(seen.motion.velocity - robot);
                }
            }
        }
        power
    }

    /// Heat of friction in contacts and of the objects' dampers \[W\].
    fn heat(&self, state: &[f64], seen: &[Seen], moved: &Moved, phases: &Phases) -> f64 {
        let mut heat = 0.0;
        for (k, seen) in seen.iter().enumerate() {
            heat += self.pressed(k, seen, moved).normal * moved.rows.tilts[k].dot(seen.slip);
            if let Some(object) = &self.touches()[k].environment {
                heat += energy_and_heat(object, phases[k].map(|_| seen.s), self.slots(state, k)).1;
            }
        }
        heat
    }

    /// Energy of robot and objects \[J\].
    pub fn energy(&self, t: f64, state: &[f64], phases: &Phases) -> f64 {
        self.plant.stored(state) + self.energy_of_objects(t, state, phases)
    }

    /// Energy of masses and springs of objects \[J\].
    pub fn energy_of_objects(&self, t: f64, state: &[f64], phases: &Phases) -> f64 {
        let of = |k: usize| {
            let object = self.touches()[k].environment.as_ref()?;
            let touched = phases[k].map(|_| self.see(t, state, k).s);
            Some(energy_and_heat(object, touched, self.slots(state, k)).0)
        };
        (0..self.touches().len()).filter_map(of).sum()
    }

    /// The time derivative of the state.
    pub fn rate(&self, t: f64, state: &[f64], phases: &Phases, action: &Action, rate: &mut [f64]) {
        let state = &self.plant.normalised(state);
        let StateParts { q, qd, .. } = self.parts(state);
        let seen = self.see_all(t, state);
        let moved = self.moved(state, self.rows(state, &seen, phases), action);
        let work = self.work();
        rate[..self.nq()].copy_from_slice(&self.plant.configuration_rate(q, qd));
        rate[self.velocities()].copy_from_slice(&moved.qdd);
        let given: f64 = action.tau.iter().zip(qd).map(|(tau, qd)| tau * qd).sum();
        rate[work] = given + self.power_of_objects(state, &seen, &moved.rows, &moved.force);
        rate[work + 1] = self.plant.losses(q, qd) + self.heat(state, &seen, &moved, phases);
        if let Some(drives) = &moved.drives {
            rate[self.drive_states()].copy_from_slice(&drives.xd);
            let energies = &mut rate[work + 2..self.plant.states()];
            energies.fill(0.0);
            for flow in &drives.flows {
                energies.iter_mut().zip(flow.powers()).for_each(|(sum, power)| *sum += power);
            }
        }
        for (k, seen) in seen.iter().enumerate() {
            let slots = self.slots(state, k);
            let rates = match (&self.touches()[k].environment, phases[k]) {
                (None, _) => [0.0; SLOTS],
                (Some(object), None) => released(object, slots),
                (Some(object), Some(_)) => {
                    let own = object.motion(seen.s, (slots[2], slots[3]));
                    [0.0, 0.0, own.velocity, own.acceleration]
                }
            };
            self.set_slots(rate, k, rates);
        }
    }

    /// The force of a closed contact along the normal and along the surface.
    pub fn pressed(&self, k: usize, seen: &Seen, moved: &Moved) -> Pressed {
        let mut vector = Vec3::zero();
        for i in moved.rows.of[k].clone() {
            let f = moved.force[i];
            match moved.rows.coordinates[i] {
                Coordinate::Px => vector = vector + Vec3::from([f, 0.0, 0.0]),
                Coordinate::Py => vector = vector + Vec3::from([0.0, f, 0.0]),
                Coordinate::Pz => vector = vector + (seen.normal - moved.rows.tilts[k]).scale(f),
                _ => {}
            }
        }
        let normal = vector.dot(seen.normal);
        let along = vector - seen.normal.scale(normal);
        Pressed { normal, tangential: along.dot(along).sqrt() }
    }

    /// Guards of a contact, positive while its phase lasts; infinite for those that it has not. An open contact that stands on its
    /// object has not risen yet: for it the second one counts.
    fn guards(
        &self,
        k: usize,
        seen: &[Seen],
        state: &[f64],
        moved: &Moved,
        phases: &Phases,
        action: &Action,
    ) -> [f64; GUARDS] {
        let (touch, at) = (&self.touches()[k], &seen[k]);
        let never = f64::INFINITY;
        let Some(closed) = phases[k] else { return [at.gap.0, at.gap.0 + 3.0 * SLACK, never] };
        let pressed = self.pressed(k, at, moved);
        let (coefficient, speed) = touch.contact.friction.map_or((0.0, 0.0), |f| (f.coefficient, f.speed));
        let ends = match touch.contact.constrained.contains(&Coordinate::Pz) {
            _ if touch.stays => never,
            true => pressed.normal,
            false => -at.s.0,
        };
        match closed.slip {
            Slip::Smooth => [ends, never, never],
            Slip::Fast => [ends, at.slip_speed() - speed, never],
            Slip::Slow => [ends, 2.0 * speed - at.slip_speed(), self.excess(k, seen, state, phases, action)],
            Slip::Sticks => [ends, coefficient * pressed.normal - pressed.tangential, never],
        }
    }

    /// What friction lacks to hold a contact that slides slowly \[N\]: negative where it sticks.
    pub fn excess(&self, k: usize, seen: &[Seen], state: &[f64], phases: &Phases, action: &Action) -> f64 {
        let mut held = phases.clone();
        if let Some(closed) = &mut held[k] {
            closed.slip = Slip::Sticks;
            closed.held = seen[k].where_it_sticks(closed.held);
        }
        let moved = self.moved(state, self.rows(state, seen, &held), action);
        let pressed = self.pressed(k, &seen[k], &moved);
        pressed.tangential - self.touches()[k].contact.friction.map_or(0.0, |f| f.coefficient) * pressed.normal
    }

    /// The guards of all contacts.
    pub fn all_guards(&self, t: f64, state: &[f64], phases: &Phases, action: &Action) -> Vec<f64> {
        let state = &self.plant.normalised(state);
        let seen = self.see_all(t, state);
        let moved = self.moved(state, self.rows(state, &seen, phases), action);
        (0..seen.len()).flat_map(|k| self.guards(k, &seen, state, &moved, phases, action)).collect()
    }
}
