//! The robot as a system of first order: state (q, q̇), and beside it the work of drives and the losses.
//!
//! The state vector is \[q | q̇ | x | W | L | D\]: x the states of the drives, W the work of the generalized forces that are given, L
//! what friction in the joints has turned into heat, and D, of a robot with drives, the [`DriveEnergies`], all in J, so that stored
//! energy − W + L − electrical + lost is constant, which measures a simulation.

use crate::drives::{slack_state, smooth_losses, DriveEnergies};
use crate::layout::StateLayout;
use crate::simulate::Method;
use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;
use straightline_core::algorithms::{
    bias_force, drive_energy, driven_motion, forward_dynamics_aba, kinetic_energy, mass_matrix, potential_energy,
    DrivenMotion, Links,
};
use straightline_core::drive::Actuator;
use straightline_core::model::{Coulomb, Joint, JointEffects, Model};
use straightline_core::trig::DOMAIN_F64;

/// A robot that is simulated.
#[derive(Clone, Debug)]
pub struct Plant {
    /// The robot.
    pub model: Model<f64>,
    /// Of every drive whether its input is a current.
    currents: Vec<bool>,
    /// Of the model.
    layout: StateLayout,
    /// What computes its motion; none: the generic runtime.
    equations: Option<Arc<dyn MotionEquations>>,
}

/// The equations of motion of a robot.
pub trait MotionEquations: fmt::Debug + Send + Sync {
    /// q̈ under generalized forces τ \[N·m or N\].
    fn forward_dynamics(&self, q: &[f64], qd: &[f64], tau: &[f64]) -> Vec<f64>;
    /// The generalized forces of gravity, of Coriolis and centrifugal forces, and of what the joints have of their own \[N·m or N\].
    fn bias_force(&self, q: &[f64], qd: &[f64]) -> Vec<f64>;
    /// H, row by row.
    fn mass_matrix(&self, q: &[f64]) -> Vec<f64>;
}

/// By the generic runtime.
impl MotionEquations for Model<f64> {
    fn forward_dynamics(&self, q: &[f64], qd: &[f64], tau: &[f64]) -> Vec<f64> {
        forward_dynamics_aba(self, q, qd, tau)
    }

    fn bias_force(&self, q: &[f64], qd: &[f64]) -> Vec<f64> {
        bias_force(self, q, qd)
    }

    fn mass_matrix(&self, q: &[f64]) -> Vec<f64> {
        mass_matrix(self, q)
    }
}

/// What acts on a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Action {
    /// Generalized forces beside those of the drives \[N·m or N\].
    pub tau: Vec<f64>,
    /// Inputs of the drives \[V, A, or the unit of u\].
    pub u: Vec<f64>,
}

impl Plant {
    /// From a model. Coulomb friction that jumps with the sign of q̇ is taken as smooth with this speed w \[rad/s or m/s\]: no
    /// equation of motion is left at rest otherwise.
    pub fn new(mut model: Model<f64>, coulomb_speed: f64) -> Plant {
        for body in &mut model.bodies {
            if let Coulomb::Sign(force) = body.effects.coulomb {
                body.effects.coulomb = match force == 0.0 {
                    true => Coulomb::Off,
                    false => Coulomb::Smooth { force, speed: coulomb_speed },
                };
            }
        }
        for drive in &mut model.drives {
            smooth_losses(drive, coulomb_speed);
        }
        let currents = vec![false; model.drives.len()];
        let layout = StateLayout::new(&model);
        Plant { model, currents, layout, equations: None }
    }

    /// The same with amplifiers that keep up a current, as far as the voltage allows: the inputs of these drives are in A, and their
    /// inductances, which such an amplifier overcomes, are neglected.
    #[must_use]
    pub fn with_current_inputs(mut self, are_currents: &[bool]) -> Plant {
        for ((drive, is_current), of) in self.currents.iter_mut().zip(are_currents).zip(&mut self.model.drives) {
            if let (true, Actuator::Motor(motor)) = (*is_current, &mut of.actuator) {
                *drive = true;
                motor.inductance = None;
            }
        }
        self.layout = StateLayout::new(&self.model);
        self
    }

    /// The same, whose motion these compute. They are of the [`model`](Plant::model).
    #[must_use]
    pub fn moved_by(self, equations: Arc<dyn MotionEquations>) -> Plant {
        Plant { equations: Some(equations), ..self }
    }

    /// What computes its motion.
    pub(crate) fn equations(&self) -> &dyn MotionEquations {
        match &self.equations {
            Some(equations) => equations.as_ref(),
            None => &self.model,
        }
    }

    /// The same with limits of currents that implicit steps find a solution at: an inductive current is slowed down over the last
    /// hundredth before its limit.
    #[must_use]
    pub fn with_soft_limits(mut self) -> Plant {
        for drive in &mut self.model.drives {
            drive.soft_current = Some(0.01);
        }
        self
    }

    /// The plant that a method integrates: with soft limits where its steps are implicit.
    pub(crate) fn solved_by(&self, method: Method) -> Cow<'_, Plant> {
        match method {
            Method::Adaptive => Cow::Borrowed(self),
            Method::Stiff => Cow::Owned(self.clone().with_soft_limits()),
        }
    }

    /// What an entry of the state is, in words.
    pub(crate) fn quantity(&self, i: usize) -> String {
        let (nq, nv) = (self.model.nq(), self.model.nv());
        let joint = |of: &dyn Fn(&Joint) -> std::ops::Range<usize>| {
            let found = self.model.free_joints().find(|j| of(j).contains(&i));
            found.map_or(String::new(), |j| format!("joint `{}`", j.name))
        };
        if i < nq {
            return format!("the position of {}", joint(&|j| j.iq..j.iq + j.kind.nq()));
        }
        if i < nq + nv {
            return format!("the velocity of {}", joint(&|j| nq + j.iv..nq + j.iv + j.kind.nv()));
        }
        let mut rest = i - nq - nv;
        for drive in &self.model.drives {
            match rest < drive.states() {
                true => return format!("state {} of drive `{}`", rest + 1, drive.name),
                false => rest -= drive.states(),
            }
        }
        "an energy".to_string()
    }

    /// What is wrong with a state, if anything: angles beyond those whose sine has digits, loops that do not close.
    pub(crate) fn objection(&self, state: &[f64]) -> Option<String> {
        let far = angle_beyond_sines(&self.model, state).map(|(joint, q)| {
            format!(
                "joint `{joint}` is at {q} rad: beyond {DOMAIN_F64} rad, two million turns, a sine has no digits left"
            )
        });
        far.or_else(|| self.open_loop(state))
    }

    /// A loop whose points do not meet near the state, in words.
    fn open_loop(&self, state: &[f64]) -> Option<String> {
        let model = &self.model;
        if model.closure.is_empty() {
            return None;
        }
        let y = model.tree_positions(&configuration(model, &state[..model.nq()])).into_owned();
        model.closure.loops.iter().find_map(|of| {
            let apart = model.gap(of, &y).iter().map(|gap| gap * gap).sum::<f64>().sqrt();
            // NaN, too
            let closes = apart < CLOSED;
            (!closes).then(|| format!("loop `{}` cannot be closed: its points are {apart:.3e} m apart", of.name))
        })
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        let of_drives = if self.is_driven() { DriveEnergies::COUNT } else { 0 };
        self.layout.nq + self.layout.nv + self.drive_states() + 2 + of_drives
    }

    /// Whether the robot has drives.
    pub fn is_driven(&self) -> bool {
        !self.model.drives.is_empty()
    }

    /// Number of entries of x.
    pub fn drive_states(&self) -> usize {
        self.layout.drives
    }

    /// The state vector of a configuration and a velocity; drives have slack springs and no currents.
    pub fn state(&self, q: &[f64], qd: &[f64]) -> Vec<f64> {
        self.state_with(q, qd, &slack_state(&self.model, q, qd))
    }

    /// The state vector of a configuration, a velocity and a state of the drives.
    pub fn state_with(&self, q: &[f64], qd: &[f64], x: &[f64]) -> Vec<f64> {
        let mut state = [q, qd, x].concat();
        state.resize(self.states(), 0.0);
        state
    }

    /// q, q̇, work and losses of a state.
    pub fn split<'a>(&self, state: &'a [f64]) -> (&'a [f64], &'a [f64], f64, f64) {
        let (q, rest) = state.split_at(self.layout.nq);
        let (qd, rest) = rest.split_at(self.layout.nv);
        let energies = &rest[self.drive_states()..];
        (q, qd, energies[0], energies[1])
    }

    /// x of a state.
    pub fn x<'a>(&self, state: &'a [f64]) -> &'a [f64] {
        let first = self.layout.nq + self.layout.nv;
        &state[first..first + self.drive_states()]
    }

    /// What the drives of a state have taken and lost.
    pub fn drive_energies(&self, state: &[f64]) -> DriveEnergies {
        DriveEnergies::from_slice(&state[self.layout.nq + self.layout.nv + self.drive_states() + 2..])
    }

    /// All energy that is stored in a state \[J\]: [`energy`](Plant::energy), and rotors, transmissions and inductances of drives.
    pub fn stored(&self, state: &[f64]) -> f64 {
        let (q, qd, ..) = self.split(state);
        let of_drives = if self.is_driven() { drive_energy(&self.model, (q, qd, self.x(state))) } else { [0.0; 3] };
        self.energy(q, qd) + of_drives.iter().sum::<f64>()
    }

    /// The motion of robot and drives, and what goes on in these.
    pub fn driven(&self, state: &[f64], action: &Action) -> DrivenMotion<f64> {
        let (q, qd, ..) = self.split(state);
        let (q, x) = (self.configuration(q), self.x(state));
        let u = self.inputs(qd, x, &action.u);
        let bias = self.equations().bias_force(&q, qd);
        let bias: Vec<f64> = bias.iter().zip(&action.tau).map(|(h, tau)| h - tau).collect();
        let h = self.equations().mass_matrix(&q);
        driven_motion(&self.model, (&q, qd, x, &u), &bias, &Links::MassMatrix(&h))
    }

    /// Inputs with currents as the voltages that keep them up, R i + C_E θ̇.
    pub(crate) fn inputs(&self, qd: &[f64], x: &[f64], u: &[f64]) -> Vec<f64> {
        let mut first = 0;
        let of = |(k, u): (usize, &f64)| {
            let drive = &self.model.drives[k];
            let own = &x[first..first + drive.states()];
            first += drive.states();
            let (true, Actuator::Motor(motor)) = (self.currents[k], &drive.actuator) else { return *u };
            let speed = match drive.stages.is_empty() {
                true => drive.joints.iter().map(|(body, n)| n * qd[self.model.bodies[*body].joint.iv]).sum::<f64>(),
                false => own[1],
            };
            motor.resistance * u + motor.emf_constant * speed
        };
        u.iter().enumerate().map(of).collect()
    }

    /// Kinetic and potential energy \[J\], those of rotors and springs with them.
    pub fn energy(&self, q: &[f64], qd: &[f64]) -> f64 {
        kinetic_energy(&self.model, q, qd) + potential_energy(&self.model, q)
    }

    /// Power that friction turns into heat \[W\]: Σ (d q̇ + f(q̇)) q̇.
    pub fn losses(&self, q: &[f64], qd: &[f64]) -> f64 {
        match self.layout.loses {
            true => joint_friction(&self.model, q, qd),
            false => 0.0,
        }
    }

    /// The time derivative of the state.
    pub fn rate(&self, state: &[f64], action: &Action, rate: &mut [f64]) {
        let (nq, nv) = (self.layout.nq, self.layout.nv);
        let (q, qd, ..) = self.split(state);
        let q = self.configuration(q);
        rate[..nq].copy_from_slice(&self.configuration_rate(&q, qd));
        let after = nq + nv + self.drive_states();
        if self.is_driven() {
            let motion = self.driven(state, action);
            rate[nq..nq + nv].copy_from_slice(&motion.qdd);
            rate[nq + nv..after].copy_from_slice(&motion.xd);
            rate[after + 2..].fill(0.0);
            for flow in motion.flows {
                rate[after + 2..].iter_mut().zip(flow.powers()).for_each(|(sum, power)| *sum += power);
            }
        } else {
            rate[nq..nq + nv].copy_from_slice(&self.equations().forward_dynamics(&q, qd, &action.tau));
        }
        rate[after] = action.tau.iter().zip(qd).map(|(tau, qd)| tau * qd).sum();
        rate[after + 1] = self.losses(&q, qd);
    }

    /// dq/dt: q̇ of joints; of a floating base R v and ½ quaternion ∘ ω, of a ball joint the latter.
    pub(crate) fn configuration_rate<'a>(&self, q: &[f64], qd: &'a [f64]) -> Cow<'a, [f64]> {
        if self.layout.is_plain {
            return Cow::Borrowed(qd);
        }
        let mut rate = vec![0.0; self.layout.nq];
        let qd = self.model.tree_rates(&self.model.tree_positions(q), qd);
        for joint in self.model.free_joints() {
            let own = &mut rate[joint.iq..joint.iq + joint.kind.nq()];
            joint.kind.configuration_rate(joint.coordinates(q), joint.rates(&qd), own);
        }
        Cow::Owned(rate)
    }

    /// The state with quaternions of length one and loops that are closed.
    pub fn normalised(&self, state: &[f64]) -> Vec<f64> {
        let (q, rest) = state.split_at(self.layout.nq);
        [&self.configuration(q), rest].concat()
    }

    /// q with quaternions of length one and loops that are closed.
    fn configuration<'a>(&self, q: &'a [f64]) -> Cow<'a, [f64]> {
        match self.layout.is_plain {
            true => Cow::Borrowed(q),
            false => Cow::Owned(configuration(&self.model, q)),
        }
    }
}

/// The first joint whose angle \[rad\] is beyond those whose sine has digits, and that angle.
pub fn angle_beyond_sines<'a>(model: &'a Model<f64>, q: &[f64]) -> Option<(&'a str, f64)> {
    let turning = model.free_joints().filter(|j| j.kind.turns());
    let mut angles = turning.map(|j| (j.name.as_str(), q[j.iq]));
    angles.find(|(_, q)| q.is_nan() || q.abs() > DOMAIN_F64)
}

/// Power that friction in the joints turns into heat \[W\]: Σ (d q̇ + f(q̇)) q̇.
pub(crate) fn joint_friction(model: &Model<f64>, q: &[f64], qd: &[f64]) -> f64 {
    let loss = |(v, e): (f64, &JointEffects<f64>)| {
        let coulomb = match e.coulomb {
            Coulomb::Off => 0.0,
            Coulomb::Sign(force) => force * v.abs(),
            Coulomb::Smooth { force, speed } => force * v * v / (v * v + speed * speed).sqrt(),
        };
        e.damping * v * v + coulomb
    };
    let rates = model.tree_rates(&model.tree_positions(q), qd);
    model.bodies.iter().flat_map(|b| b.joint.rates(&rates).iter().map(|v| loss((*v, &b.effects)))).sum()
}

/// How often loops are closed: what a step of integration leaves open is small, and each time squares it.
const CLOSINGS: usize = 2;
/// What is left of it where a loop is closed \[m\].
const CLOSED: f64 = 1e-9;

/// q with quaternions of length one and loops that are closed.
fn configuration(model: &Model<f64>, q: &[f64]) -> Vec<f64> {
    let mut q = q.to_vec();
    for joint in model.free_joints() {
        joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]);
    }
    match model.closure.is_empty() {
        true => q,
        false => model.close_loops(&q, CLOSINGS).0,
    }
}
