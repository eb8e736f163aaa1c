//! The controller in a loop with the simulated robot: a load that the controller does not know, pushes, ground that gives way.

use crate::controller::Controller;
use crate::gait::Gait;
use crate::ground::Robot;
use crate::quadruped::{plant, Feet, Mode, State, Torques, FEET, JOINTS, NV, STANDING, TORQUE};
use crate::sweep::{Law, Sweep};
use crate::task::{within_cone, Weights, FRICTION, LEAST};
use straightline::control::{Outcome, TorqueLimits};
use straightline::Real;

/// Between torques \[s\].
pub const PERIOD: f64 = 1e-3;
/// Torques per node.
pub const TICKS: i64 = 10;
/// Steps of the simulated robot per period.
const SUBSTEPS: u32 = 20;

/// A force at the trunk for a while.
#[derive(Clone, Copy, Debug)]
pub struct Push {
    /// \[s\]
    pub from: f64,
    /// \[s\]
    pub until: f64,
    /// In the world \[N\].
    pub force: [f64; 3],
}

/// What makes torques of the motion that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feedback {
    /// The gains of the recursion, and a sweep from the measured state at every node.
    Gains,
    /// The same motion from the measured state at every node, and its torques alone until the next.
    Torques,
    /// Springs \[N·m/rad\] and dampers \[N·m·s/rad\] of the joints about the motion that the model makes, with its torques: the same
    /// motion and the same torques where nothing disturbs, without a measured trunk.
    Joints(f64, f64),
}

/// What happens.
#[derive(Clone, Copy, Debug)]
pub struct Scenario<'a> {
    /// The gait.
    pub gait: Gait,
    /// What counts how much.
    pub weights: Weights,
    /// What holds the robot to it.
    pub feedback: Feedback,
    /// Mass of the load \[kg\].
    pub load: f64,
    /// Its centre in the trunk's axes \[m\].
    pub at: [f64; 3],
    /// Coulomb's friction of the ground.
    pub friction: f64,
    /// Pushes.
    pub pushes: &'a [Push],
    /// How long \[s\].
    pub duration: f64,
}

/// The scene of the example: 0.3 kg unknown, a trot ahead, a push to the side, and a stop.
pub const EXAMPLE: Scenario<'static> = Scenario {
    gait: Gait { first: 60, swings: 16, speed: [0.25, 0.0] },
    weights: Weights::DEFAULT,
    feedback: Feedback::Gains,
    load: 0.3,
    at: [0.05, -0.03, 0.06],
    friction: 0.6,
    pushes: &[
        Push { from: 0.2, until: 0.3, force: [0.0, 8.0, 0.0] },
        Push { from: 2.3, until: 2.4, force: [0.0, 10.0, 0.0] },
    ],
    duration: 5.0,
};

/// One millisecond.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// When \[s\].
    pub time: f64,
    /// The state.
    pub state: State,
    /// Torques that act \[N·m\].
    pub torques: Torques,
    /// Whether some would have been beyond their limits.
    pub outcome: Outcome,
    /// Forces of the ground \[N\].
    pub forces: Feet,
    /// By how much feet have slipped so far \[m\].
    pub slipped: [f64; FEET],
    /// Feet that are believed to stand.
    pub mode: Mode,
    /// Where the trunk is to be \[m\].
    pub wanted: [f64; 3],
    /// How far the trunk leans: sine of the angle.
    pub lean: f64,
    /// The wrench that the controller explains things by \[N, N·m\].
    pub wrench: [f64; 6],
}

/// What a run was like.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Summary {
    /// Its last millisecond \[s\]: early if the robot fell.
    pub end: f64,
    /// The trunk off its way, ahead, to the left and up, in the end \[m\].
    pub last: [f64; 3],
    /// The most of each.
    pub most: [f64; 3],
    /// The most that the trunk leant: sine of the angle.
    pub lean: f64,
    /// The greatest torque \[N·m\].
    pub torque: f64,
    /// Milliseconds in which torques would have been beyond their limits.
    pub saturated: u32,
    /// Milliseconds of feet that stand, each with more than [`LEAST`].
    pub standing: u32,
    /// Those in which the force is outside the cone that the controller counts on.
    pub outside: u32,
    /// Those in which the foot slips.
    pub slipping: u32,
    /// The most that a foot slips from one swing to the next \[m\].
    pub slip: f64,
    squares: [f64; 3],
    samples: u32,
    before: [f64; FEET],
    stance: [f64; FEET],
}

impl Summary {
    /// One millisecond more.
    pub fn add(&mut self, sample: &Sample) {
        let off: [f64; 3] = core::array::from_fn(|i| sample.state.q[i] - sample.wanted[i]);
        (self.end, self.last) = (sample.time, off);
        self.samples += 1;
        for i in 0..3 {
            self.most[i] = self.most[i].max(off[i].abs());
            self.squares[i] += off[i] * off[i];
        }
        self.lean = self.lean.max(sample.lean);
        self.torque = sample.torques.iter().fold(self.torque, |most, tau| most.max(tau.abs()));
        self.saturated += u32::from(sample.outcome != Outcome::Within);
        for foot in 0..FEET {
            let slipped = sample.slipped[foot] - self.before[foot];
            self.before[foot] = sample.slipped[foot];
            if !sample.mode.stands(foot) {
                self.stance[foot] = 0.0;
            } else if sample.forces[foot][2] > LEAST {
                self.standing += 1;
                self.outside += u32::from(within_cone(&sample.forces[foot], FRICTION) < 0.0);
                // what is less is rounding
                self.slipping += u32::from(slipped > 1e-9);
                self.stance[foot] += slipped;
                self.slip = self.slip.max(self.stance[foot]);
            }
        }
    }

    /// The root of the mean of squares: the trunk off its way, ahead, to the left and up \[m\].
    pub fn off(&self) -> [f64; 3] {
        self.squares.map(|sum| Real::sqrt(sum / f64::from(self.samples.max(1))))
    }

    /// Whether the robot fell before the time was over \[s\].
    pub fn fell(&self, duration: f64) -> bool {
        self.end < duration - 2.0 * PERIOD
    }
}

/// A run, with a sweep at every node.
///
/// # Errors
/// As [`run`].
pub fn summary(scenario: &Scenario) -> Result<Summary, plant::Unphysical> {
    let mut out = Summary::default();
    run(scenario, |controller, state| controller.sweep(state), |sample| out.add(sample))?;
    Ok(out)
}

/// Torques \[N·m\] of springs and dampers about the motion of a law.
fn by_joints(law: &Law, part: f64, measured: &State, stiffness: f64, damping: f64) -> (Torques, Outcome) {
    let between = |of: &dyn Fn(&State) -> f64| of(&law.states[0]) + part * (of(&law.states[1]) - of(&law.states[0]));
    let mut tau: Torques = core::array::from_fn(|i| {
        let (angle, speed) = (between(&|x| x.q[7 + i]), between(&|x| x.qd[6 + i]));
        law.torques[i] + stiffness * (angle - measured.q[7 + i]) + damping * (speed - measured.qd[6 + i])
    });
    let outcome = TorqueLimits { greatest: [TORQUE; JOINTS] }.apply(&mut tau);
    (tau, outcome)
}

/// Runs a scenario. Sweeps are made by `sweep`, which may take their time; every millisecond is shown to `see`. It ends early where the robot
/// has fallen: the trunk leans by more than half a right angle.
///
/// # Errors
/// The load's numbers are of no rigid body.
pub fn run(
    scenario: &Scenario,
    mut sweep: impl FnMut(&mut Controller, &State) -> Option<Sweep>,
    mut see: impl FnMut(&Sample),
) -> Result<(), plant::Unphysical> {
    let load = plant::Load::new(scenario.load, scenario.at, [0.0; 6])?;
    let start = State { q: STANDING, qd: [0.0; NV] };
    let mut robot = Robot::new(start, scenario.friction, load);
    let mut controller = Controller::new(scenario.gait, scenario.weights, &start);
    let h = PERIOD / f64::from(SUBSTEPS);
    for k in 0..(scenario.duration / PERIOD) as i64 {
        let time = k as f64 * PERIOD;
        let measured = robot.state;
        if k % TICKS == 0 {
            // without a measured trunk the motion follows from itself
            let is_blind = matches!(scenario.feedback, Feedback::Joints(..));
            let known = if is_blind { controller.foreseen_state() } else { measured };
            sweep(&mut controller, &known);
        }
        let part = (k % TICKS) as f64 / TICKS as f64;
        let (torques, outcome) = match scenario.feedback {
            Feedback::Gains => controller.torques(part, &measured),
            Feedback::Torques => {
                let foreseen = controller.law.states[0];
                controller.torques(0.0, &foreseen)
            }
            Feedback::Joints(stiffness, damping) => by_joints(&controller.law, part, &measured, stiffness, damping),
        };
        let push = scenario.pushes.iter().find(|push| push.from <= time && time < push.until);
        let force = push.map_or([0.0; 3], |push| push.force);
        for _ in 0..SUBSTEPS {
            robot.step(h, &torques, &force);
        }
        let node = k / TICKS;
        let (from, to) = (scenario.gait.trunk(node).0, scenario.gait.trunk(node + 1).0);
        let sample = Sample {
            time,
            state: measured,
            torques,
            outcome,
            forces: robot.forces,
            slipped: robot.slipped,
            mode: scenario.gait.mode(node),
            wanted: core::array::from_fn(|i| from[i] + part * (to[i] - from[i])),
            lean: robot.lean(),
            wrench: controller.wrench,
        };
        see(&sample);
        if sample.lean > 0.7 {
            break;
        }
    }
    Ok(())
}
