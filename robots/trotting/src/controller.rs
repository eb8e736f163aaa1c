//! The controller: a sweep per node, torques whenever they are asked for, and a wrench on the trunk that explains what the model does not.
//!
//! A sweep takes its time. What it finds from the state at a node acts from the next node on, for which the state is foreseen by the model;
//! until then the law of the sweep before acts.

use crate::dot;
use crate::gait::{Gait, STEP};
use crate::quadruped::{after, feet, generalized_forces, Feet, Slopes, State, Torques, Velocity, FEET, JOINTS, TORQUE};
use crate::sweep::{Factor, Law, Solver, Sweep, NODES};
use crate::task::{Task, Weights};
use straightline::control::{Outcome, TorqueLimits};

/// Part of what a node does not explain that the wrench takes over: a quarter of a second to follow.
const FOLLOWS: f64 = 0.04;
/// The wrench is at most this much \[N, N·m\].
const WRENCH: [f64; 6] = [5.0, 5.0, 8.0, 1.0, 1.0, 1.0];
/// Sweeps before the first step, from rest.
const FIRST_SWEEPS: u32 = 20;

/// What was foreseen from the last node.
#[derive(Clone, Copy, Debug)]
struct Foreseen {
    qd: Velocity,
    tau: Velocity,
    slopes: Slopes,
}

/// The controller.
#[derive(Clone, Debug)]
pub struct Controller {
    /// The gait that it follows.
    pub gait: Gait,
    /// What counts how much.
    pub weights: Weights,
    /// The node that is now.
    pub node: i64,
    /// A force on the trunk and a moment about its origin, in its axes \[N, N·m\], that nobody told the model about.
    pub wrench: [f64; 6],
    /// What acts from this node to the next.
    pub law: Law,
    /// Where feet stand, or lifted \[m\].
    pub places: Feet,
    next: Law,
    solver: Solver,
    foreseen: Option<Foreseen>,
    /// The sum of torques since the last node, and their number.
    sum: (Torques, u32),
}

impl Controller {
    /// Of a robot that stands at rest; node 0 is now.
    pub fn new(gait: Gait, weights: Weights, measured: &State) -> Self {
        let places = feet(&measured.q);
        let tasks = tasks(&gait, 0, measured, &places, weights);
        let solver = Solver::at_rest(measured, &tasks);
        let law = solver.law();
        let mut out = Controller {
            gait,
            weights,
            node: 0,
            wrench: [0.0; 6],
            law,
            places,
            next: law,
            solver,
            foreseen: None,
            sum: ([0.0; JOINTS], 0),
        };
        for _ in 0..FIRST_SWEEPS {
            out.solver.sweep(&tasks, measured, &out.wrench);
        }
        (out.law, out.next) = (out.solver.law(), out.solver.law());
        out
    }

    /// The state that the motion has at this node, as it was foreseen.
    pub fn foreseen_state(&self) -> State {
        self.next.states[0]
    }

    /// At a node, to be called once per [`STEP`]: the law of the sweep before acts from now on, and the one for the next node is found.
    /// `None` if it could not be, as what is measured is no number, or the motion from there: then the law stays.
    pub fn sweep(&mut self, measured: &State) -> Option<Sweep> {
        self.law = self.next;
        // of NaN and of infinities the product with zero is NaN
        if !measured.q.iter().chain(&measured.qd).all(|x| x * 0.0 == 0.0) {
            (self.foreseen, self.sum) = (None, ([0.0; JOINTS], 0));
            self.solver.shift();
            self.node += 1;
            return None;
        }
        self.explain(measured);
        let mode = self.gait.mode(self.node);
        let now = feet(&measured.q);
        for foot in (0..FEET).filter(|foot| mode.stands(*foot)) {
            self.places[foot] = now[foot];
        }
        let torques = self.law.at(0.0, measured);
        let tau = generalized_forces(&self.wrench, &torques);
        let slopes = Slopes::of(mode, measured, &tau);
        self.foreseen = Some(Foreseen { qd: measured.qd, tau, slopes });
        let start = after(measured, &slopes.qdd, STEP);
        self.solver.shift();
        self.node += 1;
        let tasks = tasks(&self.gait, self.node, &start, &self.places, self.weights);
        let sweep = self.solver.sweep(&tasks, &start, &self.wrench);
        match sweep {
            Some(_) => self.next = self.solver.law(),
            None => self.solver = Solver::at_rest(&start, &tasks),
        }
        sweep
    }

    /// The torques \[N·m\] of this instant, within [`TORQUE`]: a part of the way from the node to the next.
    pub fn torques(&mut self, part: f64, measured: &State) -> (Torques, Outcome) {
        let mut tau = self.law.at(part, measured);
        let outcome = TorqueLimits { greatest: [TORQUE; JOINTS] }.apply(&mut tau);
        self.sum.0.iter_mut().zip(tau).for_each(|(sum, tau)| *sum += tau);
        self.sum.1 += 1;
        (tau, outcome)
    }

    /// What the trunk did since the last node beside what was foreseen, as a wrench: of q̈ = q̈₀ + ∂q̈/∂τ Δτ, which is exact, the trunk's rows
    /// are solved for what acts on the trunk.
    fn explain(&mut self, measured: &State) {
        let (sum, count) = core::mem::replace(&mut self.sum, ([0.0; JOINTS], 0));
        let Some(Foreseen { qd, tau, slopes }) = self.foreseen.take() else { return };
        if count == 0 {
            return;
        }
        // torques were not those that were foreseen: feedback acts in between
        let change: Torques = core::array::from_fn(|i| sum[i] / f64::from(count) - tau[6 + i]);
        let mut off: [[f64; 1]; 6] = core::array::from_fn(|i| {
            let by_torques: [f64; JOINTS] = core::array::from_fn(|k| slopes.dqdd_dtau[i][6 + k]);
            [(measured.qd[i] - qd[i]) / STEP - slopes.qdd[i] - dot(&by_torques, &change)]
        });
        let mobility: [[f64; 6]; 6] = core::array::from_fn(|i| core::array::from_fn(|k| slopes.dqdd_dtau[i][k]));
        let Some(factor) = Factor::new(&mobility) else { return };
        factor.solve(&mut off);
        for i in 0..6 {
            self.wrench[i] = (self.wrench[i] + FOLLOWS * off[i][0]).clamp(-WRENCH[i], WRENCH[i]);
        }
    }
}

/// What is wanted at the nodes from this one on.
fn tasks(gait: &Gait, node: i64, measured: &State, places: &Feet, weights: Weights) -> [Task; NODES + 1] {
    core::array::from_fn(|k| Task::at(gait, node + k as i64, node, measured, places, weights))
}
