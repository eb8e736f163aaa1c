//! What drives a simulated robot: torques over time, inputs of its drives, or a controller.

use crate::drives::{demands, without_dampers, ForcesOnJoints, Inputs};
use crate::motion::Motion;
use crate::plant::{Action, Plant};
use std::collections::VecDeque;
use straightline_core::algorithms::{gravity_force, inverse_dynamics};
use straightline_core::model::Model;

/// What gives the generalized forces.
#[derive(Clone, Debug)]
pub enum Command {
    /// None: the robot moves freely.
    Free,
    /// Over time, linear in between, constant before the first and after the last row.
    Torques(Samples),
    /// Inputs of the drives over time, and torques beside them.
    Inputs(Inputs, Option<Samples>),
    /// A controller.
    Controller(Box<Controller>),
}

impl Command {
    /// Time from one computation of a controller to the next \[s\]; `None`: continuous.
    pub fn period(&self) -> Option<f64> {
        match self {
            Command::Controller(controller) => controller.period,
            _ => None,
        }
    }

    /// What acts at time `t` \[s\] on a robot in this state. Drives that nobody commands have the input zero: motors are shorted.
    pub fn action(&self, plant: &Plant, t: f64, state: &[f64]) -> Action {
        let (q, qd, ..) = plant.split(state);
        match self {
            Command::Controller(controller) if plant.is_driven() => {
                Action { tau: vec![0.0; qd.len()], u: controller.inputs(t, q, qd, plant.x(state)) }
            }
            Command::Inputs(inputs, _) => Action { tau: self.torques(t, q, qd), u: inputs.samples.at(t) },
            _ => Action { tau: self.torques(t, q, qd), u: vec![0.0; plant.model.drives.len()] },
        }
    }

    /// Generalized forces \[N·m or N\] at time `t` \[s\] and state (q, q̇) of a robot without drives.
    pub fn torques(&self, t: f64, q: &[f64], qd: &[f64]) -> Vec<f64> {
        match self {
            Command::Free | Command::Inputs(_, None) => vec![0.0; qd.len()],
            Command::Torques(samples) | Command::Inputs(_, Some(samples)) => samples.at(t),
            Command::Controller(controller) => controller.torques(t, q, qd),
        }
    }

    /// Of every drive whether its input is a current.
    pub fn current_inputs(&self, drives: usize) -> Vec<bool> {
        match self {
            Command::Inputs(inputs, _) => inputs.are_currents.clone(),
            Command::Controller(controller) => vec![controller.gives_currents; drives],
            Command::Free | Command::Torques(_) => vec![false; drives],
        }
    }

    /// Times at which the forces are not smooth, in order.
    pub fn corners(&self) -> Vec<f64> {
        match self {
            Command::Free => Vec::new(),
            Command::Torques(samples) => samples.times.clone(),
            Command::Inputs(inputs, torques) => {
                let mut times = inputs.samples.times.clone();
                times.extend(torques.iter().flat_map(|s| &s.times));
                times
            }
            Command::Controller(controller) => controller.motion.corners(),
        }
    }
}

/// Rows over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Times \[s\], each later than the one before; at least one.
    pub times: Vec<f64>,
    /// A row per time.
    pub rows: Vec<Vec<f64>>,
}

impl Samples {
    /// The row at time `t`, linear between rows.
    pub fn at(&self, t: f64) -> Vec<f64> {
        let after = self.times.partition_point(|time| *time <= t);
        if after == 0 || after == self.times.len() {
            return self.rows[after.saturating_sub(1)].clone();
        }
        let (t0, t1) = (self.times[after - 1], self.times[after]);
        let fraction = (t - t0) / (t1 - t0);
        let between = |(a, b): (&f64, &f64)| a + fraction * (b - a);
        self.rows[after - 1].iter().zip(&self.rows[after]).map(between).collect()
    }
}

/// How a controller uses the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compensation {
    /// Not at all: K e + D ė.
    None,
    /// g(q) + K e + D ė.
    Gravity,
    /// τ(r, ṙ, r̈) + K e + D ė, r the reference.
    FeedForward,
    /// τ(q, q̇, r̈ + D ė + K e).
    ComputedTorque,
}

impl Compensation {
    /// Every one with its word.
    pub const WORDS: [(&str, Compensation); 4] = [
        ("none", Compensation::None),
        ("gravity", Compensation::Gravity),
        ("feed_forward", Compensation::FeedForward),
        ("computed_torque", Compensation::ComputedTorque),
    ];
}

/// A joint controller that follows a motion.
#[derive(Clone, Debug)]
pub struct Controller {
    /// The robot as the controller knows it: not always the one that is driven.
    pub model: Model<f64>,
    /// How it uses the model.
    pub compensation: Compensation,
    /// The reference.
    pub motion: Motion,
    /// K per joint: \[N·m/rad or N/m\], of computed torque \[1/s²\].
    pub stiffness: Vec<f64>,
    /// D per joint: \[N·m·s/rad or N·s/m\], of computed torque \[1/s\].
    pub damping: Vec<f64>,
    /// Gains of every joint to every other one over time, in place of both: n rows of 2n, [`GainProposal::schedule`](crate::gains::GainProposal).
    pub feedback: Option<Samples>,
    /// Whether forces stay within the joints' effort limits. Drives have limits of their own, which always hold.
    pub saturates: bool,
    /// Whether it commands motors by currents; otherwise by voltages.
    pub gives_currents: bool,
    /// Time from one computation to the next \[s\], forces held in between; `None`: continuous.
    pub period: Option<f64>,
    /// Periods that pass before what was computed acts; until then what is computed first does.
    pub delay: usize,
}

/// Actions on their way from a computer to the robot.
#[derive(Debug)]
pub(crate) struct Delayed {
    waiting: VecDeque<Action>,
    periods: usize,
}

impl Delayed {
    /// As a command says.
    pub(crate) fn of(command: &Command) -> Delayed {
        let periods = match command {
            Command::Controller(controller) => controller.delay,
            _ => 0,
        };
        Delayed { waiting: VecDeque::new(), periods }
    }

    /// What acts when this was computed.
    pub(crate) fn next(&mut self, computed: Action) -> Action {
        while self.waiting.len() < self.periods {
            self.waiting.push_back(computed.clone());
        }
        self.waiting.push_back(computed.clone());
        self.waiting.pop_front().unwrap_or(computed)
    }
}

impl Controller {
    /// Generalized forces \[N·m or N\] at time `t` \[s\] and state (q, q̇); none on passive joints.
    pub fn torques(&self, t: f64, q: &[f64], qd: &[f64]) -> Vec<f64> {
        let (r, rd, rdd) = self.motion.at(t);
        let answer = self.answer(t, (&r, &rd), (q, qd));
        let added = |tau: Vec<f64>| tau.iter().zip(&answer).map(|(a, b)| a + b).collect::<Vec<f64>>();
        let mut tau = match self.compensation {
            Compensation::None => answer,
            Compensation::Gravity => added(gravity_force(&self.model, q)),
            Compensation::FeedForward => added(inverse_dynamics(&self.model, &r, &rd, &rdd)),
            Compensation::ComputedTorque => inverse_dynamics(&self.model, q, qd, &added(rdd)),
        };
        if self.saturates {
            for joint in self.model.independent_joints() {
                let most = joint.limits.effort;
                tau[joint.iv] = tau[joint.iv].clamp(-most, most);
            }
        }
        self.leave_passive(&mut tau);
        tau
    }

    /// K e + D ė, of passive joints nothing.
    fn answer(&self, t: f64, (r, rd): (&[f64], &[f64]), (q, qd): (&[f64], &[f64])) -> Vec<f64> {
        let less = |(a, b): (&f64, &f64)| a - b;
        let errors: Vec<f64> = r.iter().zip(q).map(less).chain(rd.iter().zip(qd).map(less)).collect();
        let n = q.len();
        let mut answer: Vec<f64> = match &self.feedback {
            None => (0..n).map(|i| self.stiffness[i] * errors[i] + self.damping[i] * errors[n + i]).collect(),
            Some(feedback) => {
                let gains = feedback.at(t);
                gains.chunks(2 * n).map(|row| row.iter().zip(&errors).map(|(k, e)| k * e).sum()).collect()
            }
        };
        self.leave_passive(&mut answer);
        answer
    }

    fn leave_passive(&self, forces: &mut [f64]) {
        self.model.independently_jointed().filter(|b| b.is_passive()).for_each(|b| forces[b.joint.iv] = 0.0);
    }

    /// Inputs of the drives \[V or A\] at time `t` \[s\] and state (q, q̇, x): the inverse of robot and drives, dampers of elastic stages
    /// left out, for the same forces and motions as [`torques`](Controller::torques). Feed-forward and computed torque know the further
    /// derivatives of the reference that elastic stages and inductances take.
    pub fn inputs(&self, t: f64, q: &[f64], qd: &[f64], x: &[f64]) -> Vec<f64> {
        let model = without_dampers(&self.model);
        let mut rates = self.motion.derivatives(t);
        let r = rates.remove(0);
        let answer = self.answer(t, (&r, &rates[0]), (q, qd));
        let still = || vec![vec![0.0; qd.len()]; rates.len()];
        let asked = match self.compensation {
            Compensation::None => demands(&model, q, &still(), x, ForcesOnJoints::Only(&answer)),
            Compensation::Gravity => demands(&model, q, &still(), x, ForcesOnJoints::Motion(&answer)),
            Compensation::FeedForward => demands(&model, &r, &rates, x, ForcesOnJoints::Motion(&answer)),
            Compensation::ComputedTorque => {
                rates[0] = qd.to_vec();
                rates[1].iter_mut().zip(&answer).for_each(|(rdd, answer)| *rdd += answer);
                demands(&model, q, &rates, x, ForcesOnJoints::Motion(&vec![0.0; qd.len()]))
            }
        };
        let of = |d: straightline_core::algorithms::Demand<f64>| match d.current {
            Some(current) if self.gives_currents => current,
            _ => d.input,
        };
        asked.into_iter().map(of).collect()
    }
}
