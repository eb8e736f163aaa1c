//! The complete model of a robot with its drives: H* q̈ + h* = D u (20.72), and ẋ = Ĉ(x) + D̂(x) u (20.81).
//!
//! A rigid drive acts on its joints by τ = Nᵀ r (e − J N q̈), with the row N of its ratios (20.68), its losses r, and e and J
//! as in `actuator.rs`. So H* = H + Nᵀ r J N: still symmetric, and one symmetric factor solves for q̈ whatever the
//! actuators are; the N × N matrix (E − H T F) of (20.80) is never formed. An elastic drive acts by its last spring (20.99), which
//! the state alone gives, and leaves H as it is.
//!
//! **Shafts that do not give way** (T f = 0): (20.80) inverts E − H T F, which is regular however many of the T_j f_j vanish, but there is
//! no J for H*. A rigid drive of that kind says θ̈ = n q̈ of its joint: q̈ there is known, the other rows are solved without that joint, so
//! that nothing is divided by what it feels, and its own row gives the torque. Behind springs such a shaft is a state like others.
//!
//! **Losses** depend on the direction of power M φ̇, and M on the accelerations. The equations are piecewise linear in q̈:
//! the directions are guessed from e, and [`PASSES`] times solved for and corrected.
//!
//! **Rotors on moving links** (optional): beside ½ J θ̇² the kinetic energy of a rotor has J θ̇ (a · ω) with the link's angular
//! velocity ω and the axis a. It puts J (Nᵀ g + gᵀ N) into H*, g = aᵀ J_ω, and a gyroscopic moment J θ̇ ω × a on the link.
//!
//! Longer than 500 lines, as all these forms are made of the private parts of one [`Driven`].

use super::actuator::{current, held_gain, inductive_voltage, input_column, input_gain, saturated, state_derivative};
use super::factor::Ltdl;
use super::jacobian::{jacobian, jacobian_bias};
use super::solve_articulated;
use super::transmission::{giving, last_shaft, taking, DriveState};
use crate::dd::Dd;
use crate::drive::{Actuator, Drive, Rotor};
use crate::model::{Body, BodyId, Frame, Model};
use crate::real::Real;
use crate::spatial::{Mat3, Transform, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// How often the directions of power are corrected. Each is settled when no direction changes any more; in random robots
/// with random motors that took at most as many passes as this.
const PASSES: usize = 4;

/// How the rigid bodies enter the solution.
pub enum Links<'a, T> {
    /// By H, nv × nv, with what [`JointEffects`](crate::model::JointEffects) add on its diagonal.
    MassMatrix(&'a [T]),
    /// By articulated bodies: only where [`drives_are_diagonal`] and nothing is lost.
    Articulated,
}

/// Number of entries of x.
pub fn drive_states<T: Real>(model: &Model<T>) -> usize {
    model.drives.iter().map(Drive::states).sum()
}

/// Whether drives add to the diagonal of H alone: each on one joint, none with a rotor that turns in space.
pub fn drives_are_diagonal<T>(drives: &[Drive<T>]) -> bool {
    drives.iter().all(|d| d.joints.len() <= 1 && d.rotor.is_none())
}

/// A robot and its drives at a state.
pub(super) struct Driven<'a, T> {
    model: &'a Model<T>,
    q: &'a [T],
    drives: &'a [Drive<T>],
    states: Vec<DriveState<T>>,
    spins: Vec<Option<RotorSpin<T>>>,
}

/// A rotor on a moving link.
struct RotorSpin<T> {
    /// g: a · ω per velocity coordinate.
    g: Vec<T>,
    /// a · ω of the link.
    along: T,
    /// a · ω̇ for q̈ = 0.
    bias: T,
    /// J_ωᵀ (ω × a).
    across: Vec<T>,
}

/// What a motion is, of all shafts.
pub(super) struct ShaftMotion<T> {
    /// φ̈ of every drive's last shaft.
    pub phi: Vec<T>,
    /// J a · ω̇ of every rotor on a moving link.
    pub spin: Vec<T>,
    /// What shafts that do not give way put on their joints, per ratio; of other drives zero.
    pub put: Vec<T>,
}

impl<'a, T: Real> Driven<'a, T> {
    pub(super) fn new(model: &'a Model<T>, drives: &'a [Drive<T>], (q, qd, x, u): (&'a [T], &[T], &[T], &[T])) -> Self {
        T::section("drives", None);
        let mut first = 0;
        let states = drives.iter().zip(u).map(|(drive, u)| {
            let own = &x[first..first + drive.states()];
            first += drive.states();
            DriveState::new(model, drive, q, qd, own, *u)
        });
        let states = states.collect();
        let spins = drives.iter().map(|d| d.rotor.map(|r| RotorSpin::new(model, &r, q, qd))).collect();
        Driven { model, q, drives, states, spins }
    }

    fn nv(&self) -> usize {
        self.model.nv()
    }

    /// The joints of a drive: velocity coordinate and ratio.
    fn row(&self, k: usize) -> impl Iterator<Item = (usize, T)> + '_ {
        self.drives[k].joints.iter().map(|(body, n)| (self.model.bodies[*body].joint.iv, *n))
    }

    /// Inertia that turns with the actuator of an elastic drive, which gives way.
    pub(super) fn first_shaft(&self, k: usize) -> T {
        self.states[k].actuator_inertia + self.drives[k].stages[0].inertia
    }

    /// What the drives add to H: Nᵀ r J N, and of rotors on moving links.
    pub(super) fn add_inertias(&self, h: &mut [T], losses: &[T]) {
        let nv = self.nv();
        let mut add = |i: usize, j: usize, x: T| h[i * nv + j] = h[i * nv + j] + x;
        for (k, state) in self.states.iter().enumerate() {
            let reflected = losses[k] * state.inertia;
            let row: Vec<(usize, T)> = self.row(k).collect();
            for (i, a) in &row {
                for (j, b) in &row {
                    add(*i, *j, *a * *b * reflected);
                }
            }
            let (Some(spin), Some(rotor)) = (&self.spins[k], &self.drives[k].rotor) else { continue };
            if self.drives[k].stages.is_empty() {
                for (i, n) in &row {
                    for (j, g) in spin.g.iter().enumerate() {
                        add(*i, j, rotor.inertia * *n * *g);
                        add(j, *i, rotor.inertia * *n * *g);
                    }
                }
            } else if self.states[k].held.is_none() {
                // θ̈ is free: what is left of J θ̈ (a · ω̇) when it is eliminated
                let less = -(rotor.inertia * rotor.inertia / self.first_shaft(k));
                for (i, a) in spin.g.iter().enumerate() {
                    for (j, b) in spin.g.iter().enumerate() {
                        add(i, j, less * *a * *b);
                    }
                }
            }
        }
    }

    /// What the drives put on the joints while q̈ = 0: Nᵀ r e and springs, less gyroscopic moments.
    pub(super) fn free_forces(&self, losses: &[T]) -> Vec<T> {
        let mut forces = vec![T::zero(); self.nv()];
        for (k, state) in self.states.iter().enumerate() {
            for (i, n) in self.row(k) {
                forces[i] = forces[i] + n * (losses[k] * state.free);
            }
            let (Some(spin), Some(rotor)) = (&self.spins[k], &self.drives[k].rotor) else { continue };
            for (force, across) in forces.iter_mut().zip(&spin.across) {
                *force = *force - rotor.inertia * state.actuator_speed * *across;
            }
            if self.drives[k].stages.is_empty() {
                for (i, n) in self.row(k) {
                    forces[i] = forces[i] - n * (rotor.inertia * spin.bias);
                }
            } else {
                let theta = state.shaft_acceleration(&self.drives[k], 0, rotor.inertia * spin.bias);
                for (force, g) in forces.iter_mut().zip(&spin.g) {
                    *force = *force - rotor.inertia * theta * *g;
                }
            }
        }
        forces
    }

    /// Losses at accelerations of the last shafts; `None`: at none.
    fn losses(&self, phi: Option<&[T]>) -> Vec<T> {
        let of = |(k, state): (usize, &DriveState<T>)| {
            let torque = phi.map_or(state.free, |phi| state.free - state.inertia * phi[k]);
            giving(self.drives[k].efficiency, torque, state.speed)
        };
        self.states.iter().enumerate().map(of).collect()
    }

    /// φ̈ of the last shafts and J a · ω̇.
    pub(super) fn motion(&self, qdd: &[T]) -> ShaftMotion<T> {
        let phi = (0..self.drives.len()).map(|k| sum(self.row(k).map(|(i, n)| n * qdd[i])));
        let spin = |k: usize| match (&self.spins[k], &self.drives[k].rotor) {
            (Some(spin), Some(rotor)) => {
                rotor.inertia * (spin.bias + sum(spin.g.iter().zip(qdd).map(|(g, qdd)| *g * *qdd)))
            }
            _ => T::zero(),
        };
        let put = vec![T::zero(); self.drives.len()];
        ShaftMotion { phi: phi.collect(), spin: (0..self.drives.len()).map(spin).collect(), put }
    }

    /// The joints whose acceleration is known: drive, velocity coordinate, ratio.
    fn held(&self) -> impl Iterator<Item = (usize, usize, T)> + '_ {
        let joint = |drive: &Drive<T>| drive.held_joint().map(|(body, n)| (self.model.bodies[body].joint.iv, n));
        self.drives.iter().enumerate().filter_map(move |(k, drive)| joint(drive).map(|(i, n)| (k, i, n)))
    }

    /// Whether the actuator of a drive does not give way.
    pub(super) fn is_unyielding(&self, k: usize) -> bool {
        self.states[k].held.is_some()
    }

    /// Whether there are such joints.
    pub(super) fn holds(&self) -> bool {
        self.held().next().is_some()
    }

    /// q̈ of the joints whose acceleration is known, of all others zero.
    pub(super) fn known(&self) -> Vec<T> {
        let mut qdd = vec![T::zero(); self.nv()];
        for (k, i, n) in self.held() {
            qdd[i] = self.states[k].held.unwrap_or_else(T::zero) / n;
        }
        qdd
    }

    /// What shafts that do not give way put on their joints, from the forces that all joints take, and those that the other drives put there.
    pub(super) fn put(&self, taken: &[T], others: &[T]) -> Vec<T> {
        let mut put = vec![T::zero(); self.drives.len()];
        for (k, i, n) in self.held() {
            put[k] = (taken[i] - others[i]) / n;
        }
        put
    }

    /// x with H* x = `right` but for the coordinates in which x is `known`.
    pub(super) fn solve_but(&self, factor: &Ltdl<T>, h: &[T], known: &[T], right: &[T]) -> Vec<T> {
        if !self.holds() {
            return factor.solve(right);
        }
        let right: Vec<T> = right.iter().zip(times(h, known)).map(|(f, x)| *f - x).collect();
        factor.solve(&right).into_iter().zip(known).map(|(x, known)| x + *known).collect()
    }

    /// q̈ and the losses that go with it.
    fn solve(&self, bias: &[T], links: &Links<T>) -> (Vec<T>, Vec<T>) {
        self.settled(|losses| self.solve_with(bias, links, losses), |qdd| qdd)
    }

    /// What `solve` finds with losses that fit the accelerations in it, and these losses.
    pub(super) fn settled<R>(&self, solve: impl Fn(&[T]) -> R, qdd: impl Fn(&R) -> &[T]) -> (R, Vec<T>) {
        let lossy = self.drives.iter().any(|d| d.efficiency.is_some());
        let mut losses = self.losses(None);
        let mut found = solve(&losses);
        for _ in 0..if lossy { PASSES } else { 0 } {
            losses = self.losses(Some(&self.motion(qdd(&found)).phi));
            found = solve(&losses);
        }
        (found, losses)
    }

    fn solve_with(&self, bias: &[T], links: &Links<T>, losses: &[T]) -> Vec<T> {
        let right: Vec<T> = self.free_forces(losses).into_iter().zip(bias).map(|(f, h)| f - *h).collect();
        match links {
            Links::MassMatrix(h) => {
                let mut h = h.to_vec();
                self.add_inertias(&mut h, losses);
                self.solve_but(&self.factor(&h), &h, &self.known(), &right)
            }
            Links::Articulated => {
                let mut model = self.model.clone();
                for (k, state) in self.states.iter().enumerate() {
                    for (body, n) in &self.drives[k].joints {
                        if self.drives[k].is_inertia_free() {
                            continue;
                        }
                        let reflected = *n * *n * (losses[k] * state.inertia);
                        let own = &mut model.bodies[*body].effects.rotor_inertia;
                        *own = Some(own.map_or(reflected, |o| o + reflected));
                    }
                }
                solve_articulated(&model, self.q, &right)
            }
        }
    }

    pub(super) fn factor(&self, h: &[T]) -> Ltdl<T> {
        let held: Vec<usize> = self.held().map(|(_, i, _)| i).collect();
        Ltdl::factor_holding(self.model, h, &held, joins_branches(self.model, self.drives))
    }

    /// ẋ of a drive for its part of the state, given the motion of the shafts.
    fn state_derivative(&self, k: usize, x: &[T], u: T, motion: &ShaftMotion<T>) -> Vec<T> {
        let (drive, state) = (&self.drives[k], &self.states[k]);
        let (acceleration, torque) = (self.actuator_acceleration(k, motion), self.actuator_torque(k, motion));
        let mut rates = state_derivative(drive, x, (state.actuator_speed, acceleration), torque, u);
        for stage in 1..drive.stages.len() {
            rates.push(state.stages[stage].speed);
            rates.push(state.shaft_acceleration(drive, stage, T::zero()));
        }
        rates
    }
}

impl<T: Real> RotorSpin<T> {
    fn new(model: &Model<T>, rotor: &Rotor<T>, q: &[T], qd: &[T]) -> Self {
        let frame = axis_frame(rotor);
        let nv = model.nv();
        let j = jacobian(model, q, &frame);
        let pose = super::forward_kinematics(model, q, &[&frame])[0];
        let axis = pose.rotation * rotor.axis;
        let column = |i: usize| Vec3::new(j[3 * nv + i], j[4 * nv + i], j[5 * nv + i]);
        let omega = super::frame_velocity(model, q, qd, &frame).angular;
        let across = omega.cross(axis);
        RotorSpin {
            g: (0..nv).map(|i| axis.dot(column(i))).collect(),
            along: axis.dot(omega),
            bias: axis.dot(jacobian_bias(model, q, qd, &frame).angular),
            across: (0..nv).map(|i| across.dot(column(i))).collect(),
        }
    }
}

/// Forces that a rotor on a moving link puts on the joints in a motion, beside Nᵀ J θ̈:
/// −J (Nᵀ (a · ω̇) + J_ωᵀ (θ̈ a + θ̇ ω × a)), of a rigid drive.
pub(super) fn rotor_forces<T: Real>(
    model: &Model<T>,
    drive: &Drive<T>,
    rotor: &Rotor<T>,
    (q, qd, qdd): (&[T], &[T], &[T]),
) -> Vec<T> {
    let spin = RotorSpin::new(model, rotor, q, qd);
    let speed = last_shaft(model, drive, qd, |joint| joint.1);
    let acceleration = last_shaft(model, drive, qdd, |joint| joint.1);
    let along = spin.bias + sum(spin.g.iter().zip(qdd).map(|(g, qdd)| *g * *qdd));
    let mut forces: Vec<T> = spin
        .g
        .iter()
        .zip(&spin.across)
        .map(|(g, across)| -(rotor.inertia * (acceleration * *g + speed * *across)))
        .collect();
    for (body, n) in &drive.joints {
        let force = &mut forces[model.bodies[*body].joint.iv];
        *force = *force - rotor.inertia * *n * along;
    }
    forces
}

fn axis_frame<T: Real>(rotor: &Rotor<T>) -> Frame<T> {
    let placement = Transform { rotation: Mat3::identity(), translation: Vec3::zero() };
    Frame { name: alloc::string::String::new(), body: Some(rotor.body), placement }
}

/// H x, of rows as long as x.
pub(super) fn times<T: Real>(h: &[T], x: &[T]) -> Vec<T> {
    h.chunks(x.len()).map(|row| sum(row.iter().zip(x).map(|(h, x)| *h * *x))).collect()
}

fn sum<T: Real>(terms: impl Iterator<Item = T>) -> T {
    terms.reduce(|sum, x| sum + x).unwrap_or_else(T::zero)
}

/// Whether a drive joins coordinates that do not stand on one branch, so that H* has entries where H has zeros.
fn joins_branches<T: Real>(model: &Model<T>, drives: &[Drive<T>]) -> bool {
    let path = |body: BodyId| core::iter::successors(Some(body), |b: &BodyId| model.bodies[*b].parent);
    let is_before = |a: BodyId, b: BodyId| path(b).any(|x| x == a);
    drives.iter().any(|d| {
        let bodies: Vec<BodyId> = d.joints.iter().map(|j| j.0).chain(d.rotor.map(|r| r.body)).collect();
        bodies.iter().any(|a| bodies.iter().any(|b| !is_before(*a, *b) && !is_before(*b, *a)))
    })
}

/// The motion of a robot with drives, and what goes on in them.
#[derive(Clone, Debug, PartialEq)]
pub struct DrivenMotion<T> {
    /// q̈ \[rad/s² or m/s²\].
    pub qdd: Vec<T>,
    /// ẋ.
    pub xd: Vec<T>,
    /// Forces on the joints \[N·m or N\], with which H q̈ + h = τ.
    pub tau: Vec<T>,
    /// Per drive.
    pub flows: Vec<DriveFlow<T>>,
}

/// What goes on in a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveFlow<T> {
    /// Torque M that the actuator puts out \[N·m\].
    pub torque: T,
    /// Speed θ̇ of the actuator \[rad/s\].
    pub speed: T,
    /// What lies on the motor, after all limits \[V\]; the input of a linear actuator.
    pub voltage: T,
    /// Current of a motor \[A\]; zero of a linear actuator.
    pub current: T,
    /// Power \[W\] that comes in: electrical, or what the shaft of a linear actuator puts out.
    pub electrical: T,
    /// Joule heat R i² \[W\].
    pub joule: T,
    /// Friction in the motor B θ̇² \[W\].
    pub friction: T,
    /// Losses of the gears \[W\].
    pub gears: T,
    /// Dampers of elastic stages \[W\].
    pub dampers: T,
    /// What a motor with C_E ≠ C_M turns into nothing, (C_E − C_M) i θ̇ \[W\].
    pub conversion: T,
}

impl<T> DriveFlow<T> {
    /// The powers \[W\]: electrical, Joule heat, friction, gears, dampers, conversion.
    pub fn powers(self) -> [T; 6] {
        [self.electrical, self.joule, self.friction, self.gears, self.dampers, self.conversion]
    }
}

/// q̈ and ẋ under the inputs u, with losses and limits, and what goes on in the drives: all from one solution. `bias` is h(q, q̇) with
/// friction and springs of the joints.
pub fn driven_motion<T: Real>(
    model: &Model<T>,
    (q, qd, x, u): (&[T], &[T], &[T], &[T]),
    bias: &[T],
    links: &Links<T>,
) -> DrivenMotion<T> {
    let driven = Driven::new(model, &model.drives, (q, qd, x, u));
    let (qdd, losses) = driven.solve(bias, links);
    let taken = match links {
        Links::MassMatrix(h) if driven.holds() => {
            times(h, &qdd).into_iter().zip(bias).map(|(inertial, h)| inertial + *h).collect()
        }
        _ => Vec::new(),
    };
    driven.finished((x, u), qdd, &losses, &taken)
}

impl<T: Real> Driven<'_, T> {
    /// What goes on in the drives at accelerations with their losses. `taken` is what the joints take from all drives, which is read where
    /// a shaft does not give way.
    pub(super) fn finished(&self, (x, u): (&[T], &[T]), qdd: Vec<T>, losses: &[T], taken: &[T]) -> DrivenMotion<T> {
        let of_others = self.holds().then(|| self.forces(&qdd, losses));
        let mut motion = self.motion(&qdd);
        if let Some(others) = &of_others {
            motion.put = self.put(taken, others);
        }
        let (mut xd, mut flows) = (Vec::new(), Vec::new());
        for (k, drive) in self.drives.iter().enumerate() {
            let own = &x[xd.len()..xd.len() + drive.states()];
            flows.push(self.flow(k, own, u[k], &motion, losses[k]));
            xd.extend(self.state_derivative(k, own, u[k], &motion));
        }
        let mut tau = of_others.unwrap_or_else(|| self.forces(&qdd, losses));
        for (_, i, _) in self.held() {
            tau[i] = taken[i];
        }
        DrivenMotion { tau, qdd, xd, flows }
    }
}

impl<T: Real> Driven<'_, T> {
    /// Forces on the joints: those at q̈ = 0 less what accelerates rotors, (H* − H) q̈.
    fn forces(&self, qdd: &[T], losses: &[T]) -> Vec<T> {
        let (nv, mut tau) = (self.nv(), self.free_forces(losses));
        let mut added = vec![T::zero(); nv * nv];
        self.add_inertias(&mut added, losses);
        for (i, tau) in tau.iter_mut().enumerate() {
            *tau = *tau - sum((0..nv).map(|j| added[i * nv + j] * qdd[j]));
        }
        tau
    }

    /// θ̈ of an actuator's shaft.
    fn actuator_acceleration(&self, k: usize, motion: &ShaftMotion<T>) -> T {
        match self.drives[k].stages.is_empty() {
            true => motion.phi[k],
            false => self.states[k].shaft_acceleration(&self.drives[k], 0, motion.spin[k]),
        }
    }

    /// M that an actuator puts out.
    fn actuator_torque(&self, k: usize, motion: &ShaftMotion<T>) -> T {
        let (drive, state) = (&self.drives[k], &self.states[k]);
        if drive.held_joint().is_some() {
            let carried = self.carried(k, motion);
            return drive.shaft_inertia.map_or(carried, |gears| carried + gears * motion.phi[k]);
        }
        if let (Some(held), Some(stage)) = (state.held, drive.stages.first()) {
            return state.stages[0].taken + stage.inertia * held + motion.spin[k];
        }
        state.actuator_torque - state.actuator_inertia * self.actuator_acceleration(k, motion)
    }

    /// The torque before the gears of a shaft that does not give way, losses in them.
    fn carried(&self, k: usize, motion: &ShaftMotion<T>) -> T {
        motion.put[k] * taking(self.drives[k].efficiency, motion.put[k], (self.states[k].speed, None))
    }

    /// What goes on in a drive, with its part of the state and its losses.
    fn flow(&self, k: usize, x: &[T], u: T, motion: &ShaftMotion<T>, losses: T) -> DriveFlow<T> {
        let (drive, state, o) = (&self.drives[k], &self.states[k], T::zero());
        let speed = state.actuator_speed;
        let torque = self.actuator_torque(k, motion);
        let [mut joule, mut friction, mut gears, mut dampers, mut conversion, mut i] = [o; 6];
        let mut voltage = saturated(u, drive.input_limit);
        let mut electrical = torque * speed;
        if let Actuator::Motor(m) = &drive.actuator {
            i = current(m, drive, x, speed, u);
            let held = m.resistance * i + m.emf_constant * speed;
            voltage = match (m.inductance, drive.current_limit) {
                (Some(_), Some(_)) => held + inductive_voltage(m, drive, x, speed, u),
                (None, Some(_)) => held,
                (_, None) => voltage,
            };
            electrical = voltage * i;
            joule = m.resistance * i * i;
            friction = m.friction * speed * speed;
            conversion = (m.emf_constant - m.torque_constant) * i * speed;
        }
        for (stage, at) in drive.stages.iter().zip(&state.stages) {
            gears = gears + (at.taken - at.torque / stage.ratio) * at.speed;
            if let Some(d) = stage.damping {
                dampers = dampers + d * at.stretch.1 * at.stretch.1;
            }
        }
        gears = match drive.held_joint() {
            Some(_) => gears + (self.carried(k, motion) - motion.put[k]) * state.speed,
            None => {
                let carried = state.free - state.inertia * motion.phi[k];
                gears + carried * (T::one() - losses) * state.speed
            }
        };
        DriveFlow { torque, speed, voltage, current: i, electrical, joule, friction, gears, dampers, conversion }
    }
}

/// Forces τ on the joints \[N·m or N\], with which H q̈ + h = τ, and torques M that the actuators put out \[N·m\].
pub fn drive_torques<T: Real>(
    model: &Model<T>,
    at: (&[T], &[T], &[T], &[T]),
    bias: &[T],
    links: &Links<T>,
) -> (Vec<T>, Vec<T>) {
    let motion = driven_motion(model, at, bias, links);
    (motion.tau, motion.flows.into_iter().map(|flow| flow.torque).collect())
}

/// H*, h* and D of H* q̈ + h* = D u (20.72), (20.73), without losses and limits; h* and D hold for the currents and the other
/// states in x. `bias` and `mass_matrix` are h and H. The row of a joint that a shaft drives which does not give way is that shaft's own
/// equation n q̈ = T (C x + d u); all others are symmetric among themselves.
pub fn complete_model<T: Real>(
    model: &Model<T>,
    (q, qd, x): (&[T], &[T], &[T]),
    bias: &[T],
    mass_matrix: &[T],
) -> (Vec<T>, Vec<T>, Vec<T>) {
    let drives: Vec<Drive<T>> = model.drives.iter().map(Drive::ideal).collect();
    let at_rest = vec![T::zero(); drives.len()];
    let driven = Driven::new(model, &drives, (q, qd, x, &at_rest));
    let ideal = vec![T::one(); drives.len()];
    let mut h_star = mass_matrix.to_vec();
    driven.add_inertias(&mut h_star, &ideal);
    let mut bias: Vec<T> = driven.free_forces(&ideal).into_iter().zip(bias).map(|(f, h)| *h - f).collect();
    let (mut gains, nv, m) = (driven.input_matrix(), model.nv(), drives.len());
    for (k, i, n) in driven.held() {
        h_star[i * nv..(i + 1) * nv].fill(T::zero());
        h_star[i * nv + i] = n;
        bias[i] = -driven.states[k].held.unwrap_or_else(T::zero);
        gains[i * m..(i + 1) * m].fill(T::zero());
        gains[i * m + k] = held_gain(&drives[k].actuator).unwrap_or_else(T::zero);
    }
    (h_star, bias, gains)
}

/// Ĉ(x) and D̂(x), number of states × number of drives, of ẋ = Ĉ + D̂ u (20.81), (20.82), without losses and limits.
pub fn state_space<T: Real>(
    model: &Model<T>,
    (q, qd, x): (&[T], &[T], &[T]),
    bias: &[T],
    mass_matrix: &[T],
) -> (Vec<T>, Vec<T>) {
    let drives: Vec<Drive<T>> = model.drives.iter().map(Drive::ideal).collect();
    let (m, nv) = (drives.len(), model.nv());
    let at_rest = vec![T::zero(); m];
    let driven = Driven::new(model, &drives, (q, qd, x, &at_rest));
    let ideal = vec![T::one(); m];
    let mut h_star = mass_matrix.to_vec();
    driven.add_inertias(&mut h_star, &ideal);
    let factor = driven.factor(&h_star);
    let right: Vec<T> = driven.free_forces(&ideal).into_iter().zip(bias).map(|(f, h)| f - *h).collect();
    let qdd = driven.solve_but(&factor, &h_star, &driven.known(), &right);
    // what joints take beyond what the drives give that do yield: H* q̈ less the right-hand side
    let put = |qdd: &[T], right: &[T]| match driven.holds() {
        true => driven.put(&times(&h_star, qdd), right),
        false => vec![T::zero(); m],
    };
    let motion = ShaftMotion { put: put(&qdd, &right), ..driven.motion(&qdd) };
    let gains = driven.input_matrix();
    let column = |k: usize| (0..nv).map(|i| gains[i * m + k]).collect::<Vec<T>>();
    // motions of the shafts per unit of each input
    let per_input = |k: usize| {
        let mut known = vec![T::zero(); nv];
        for (_, i, n) in driven.held().filter(|held| held.0 == k) {
            known[i] = held_gain(&drives[k].actuator).unwrap_or_else(T::zero) / n;
        }
        let qdd = driven.solve_but(&factor, &h_star, &known, &column(k));
        ShaftMotion { put: put(&qdd, &column(k)), ..driven.motion_per_input(&qdd) }
    };
    let per_input: Vec<ShaftMotion<T>> = (0..m).map(per_input).collect();
    let (mut drift, mut gain): (Vec<T>, Vec<T>) = (Vec::new(), Vec::new());
    for (k, drive) in drives.iter().enumerate() {
        let own = &x[drift.len()..drift.len() + drive.states()];
        drift.extend(driven.state_derivative(k, own, T::zero(), &motion));
        let columns: Vec<Vec<T>> = (0..m).map(|l| driven.state_per_input(k, l, &per_input[l])).collect();
        for row in 0..drive.states() {
            gain.extend(columns.iter().map(|c| c[row]));
        }
    }
    (drift, gain)
}

impl<T: Real> Driven<'_, T> {
    /// D: forces on the joints per input, nv × number of drives.
    fn input_matrix(&self) -> Vec<T> {
        let (m, nv) = (self.drives.len(), self.nv());
        let mut d = vec![T::zero(); nv * m];
        for (k, drive) in self.drives.iter().enumerate() {
            let gain = input_gain(&drive.actuator);
            if drive.stages.is_empty() {
                for (i, n) in self.row(k) {
                    d[i * m + k] = d[i * m + k] + n * gain;
                }
            } else if let (Some(spin), Some(rotor)) = (&self.spins[k], &drive.rotor) {
                let theta = held_gain(&drive.actuator).unwrap_or_else(|| gain / self.first_shaft(k));
                for (i, g) in spin.g.iter().enumerate() {
                    d[i * m + k] = d[i * m + k] - rotor.inertia * theta * *g;
                }
            }
        }
        d
    }

    /// As [`Driven::motion`], of a difference of accelerations.
    pub(super) fn motion_per_input(&self, qdd: &[T]) -> ShaftMotion<T> {
        let motion = self.motion(qdd);
        let spin = motion.spin.into_iter().enumerate().map(|(k, x)| match (&self.spins[k], &self.drives[k].rotor) {
            (Some(spin), Some(rotor)) => x - rotor.inertia * spin.bias,
            _ => x,
        });
        ShaftMotion { spin: spin.collect(), ..motion }
    }

    /// ∂ẋ of drive k per input l, whose motion of the shafts is `motion`.
    fn state_per_input(&self, k: usize, l: usize, motion: &ShaftMotion<T>) -> Vec<T> {
        let (drive, state) = (&self.drives[k], &self.states[k]);
        let (own, o) = (k == l, T::zero());
        let gain = if own { input_gain(&drive.actuator) } else { o };
        let held = held_gain(&drive.actuator);
        let acceleration = match (drive.stages.is_empty(), held) {
            (true, _) => motion.phi[k],
            (false, Some(held)) => {
                if own {
                    held
                } else {
                    o
                }
            }
            (false, None) => (gain - motion.spin[k]) / self.first_shaft(k),
        };
        let mut rates = match own {
            true => input_column(&drive.actuator),
            false => vec![o; drive.actuator.states()],
        };
        match &drive.actuator {
            Actuator::Motor(_) => rates[1] = acceleration,
            Actuator::Linear(a) => {
                let torque = match (drive.stages.first(), held) {
                    (_, None) => gain - state.actuator_inertia * acceleration,
                    (Some(stage), _) => stage.inertia * acceleration + motion.spin[k],
                    (None, _) => motion.put[k] + drive.shaft_inertia.map_or(o, |gears| gears * acceleration),
                };
                rates.iter_mut().zip(&a.f).for_each(|(rate, f)| *rate = *rate + *f * torque);
            }
        }
        rates.resize(drive.states(), o);
        rates
    }
}

/// Where the power goes \[W\]: electrical input, Joule heat, friction in the motors, losses of gears, dampers of elastic stages,
/// friction in the joints, and what motors with C_E ≠ C_M turn into nothing, (C_E − C_M) i θ̇. Electrical input of a
/// linear actuator is what its shaft puts out.
pub fn drive_power<T: Real>(
    model: &Model<T>,
    (q, qd, x, u): (&[T], &[T], &[T], &[T]),
    bias: &[T],
    links: &Links<T>,
) -> [T; 7] {
    let motion = driven_motion(model, (q, qd, x, u), bias, links);
    let mut powers = [T::zero(); 6];
    for flow in motion.flows {
        powers.iter_mut().zip(flow.powers()).for_each(|(sum, power)| *sum = *sum + power);
    }
    let [electrical, joule, friction, gears, dampers, conversion] = powers;
    let rates = &*model.tree_rates(&model.tree_positions(q), qd);
    let of_rate = |(body, qd): (&Body<T>, T)| super::effects::friction_force(&body.effects, qd) * qd;
    let moving = model.bodies.iter().flat_map(|body| body.joint.rates(rates).iter().map(move |qd| (body, *qd)));
    [electrical, joule, friction, gears, dampers, sum(moving.map(of_rate)), conversion]
}

/// Energy \[J\] of the drives: kinetic of rotors and gears, of the springs of elastic stages, of the motors' inductances. Of a
/// linear actuator only gears and springs count.
pub fn drive_energy<T: Real>(model: &Model<T>, (q, qd, x): (&[T], &[T], &[T])) -> [T; 3] {
    let at_rest = vec![T::zero(); model.drives.len()];
    let driven = Driven::new(model, &model.drives, (q, qd, x, &at_rest));
    let (mut kinetic, mut elastic, mut magnetic) = (T::zero(), T::zero(), T::zero());
    let mut first = 0;
    for (k, drive) in model.drives.iter().enumerate() {
        let (state, own) = (&driven.states[k], &x[first..first + drive.states()]);
        first += drive.states();
        let mut spinning = |inertia: T, speed: T| kinetic = kinetic + inertia * speed * speed;
        if let Actuator::Motor(m) = &drive.actuator {
            spinning(m.rotor_inertia, state.actuator_speed);
            if let Some(l) = m.inductance {
                magnetic = magnetic + l * own[2] * own[2];
            }
        }
        if let Some(inertia) = drive.shaft_inertia {
            spinning(inertia, state.speed);
        }
        for (stage, at) in drive.stages.iter().zip(&state.stages) {
            spinning(stage.inertia, at.speed);
            elastic = elastic + stage.stiffness * at.stretch.0 * at.stretch.0;
        }
        if let (Some(spin), Some(rotor)) = (&driven.spins[k], &drive.rotor) {
            let once = rotor.inertia * state.actuator_speed * spin.along;
            kinetic = kinetic + once + once;
        }
    }
    [kinetic, elastic, magnetic].map(|twice| twice * T::constant(Dd::HALF))
}
