//! The controller in a loop with a simulated arm: a tool that the controller does not know, and pushes at the hand.
//!
//! Every millisecond a state is measured. What is computed from it acts one millisecond later, as a computer takes its time: until then the
//! state is foreseen by the model under the torques that act.

use crate::arm::{clearance, plant, points, points_and_slopes, Points, Sphere, HAND};
use crate::ilqr::{after, Solver, Sweep, STEP};
use crate::observer::Observer;
use crate::task::{State, Task, Weights, NX};
use crate::{Joints, NV};
use straightline::integrate::{self, Step};

/// Between measurements \[s\].
pub const PERIOD: f64 = 1e-3;
/// Steps of the simulated arm per period.
const SUBSTEPS: u32 = 4;

/// A goal of the hand, from a time on.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// \[s\]
    pub from: f64,
    /// \[m\]
    pub hand: [f64; 3],
}

/// A force at the hand for a while.
#[derive(Clone, Copy, Debug)]
pub struct Push {
    /// \[s\]
    pub from: f64,
    /// \[s\]
    pub until: f64,
    /// In the world \[N\].
    pub force: [f64; 3],
}

/// What happens.
#[derive(Clone, Copy, Debug)]
pub struct Scenario<'a> {
    /// Where the arm starts, at rest \[rad\].
    pub start: Joints,
    /// Goals, the earliest first, which begins at zero.
    pub goals: &'a [Goal],
    /// What is in the way.
    pub spheres: &'a [Sphere],
    /// Pushes.
    pub pushes: &'a [Push],
    /// Mass of the tool that the controller does not know \[kg\], 5 cm beyond the point that reaches.
    pub tool: f64,
    /// How long \[s\].
    pub duration: f64,
}

/// The scene of the example: three goals among three spheres, half a kilogram unknown, and a push.
pub const EXAMPLE: Scenario<'static> = Scenario {
    start: [0.0, -0.8, 0.0, -2.3, 0.0, 1.6, 0.8],
    goals: &[
        Goal { from: 0.0, hand: [0.35, 0.48, 0.35] },
        Goal { from: 1.6, hand: [0.42, -0.45, 0.55] },
        Goal { from: 3.4, hand: [0.52, 0.12, 0.22] },
    ],
    spheres: &[
        Sphere { centre: [0.55, 0.28, 0.50], radius: 0.10 },
        Sphere { centre: [0.62, 0.0, 0.52], radius: 0.09 },
        Sphere { centre: [0.50, -0.28, 0.30], radius: 0.10 },
    ],
    pushes: &[Push { from: 4.6, until: 4.7, force: [0.0, 40.0, 25.0] }],
    tool: 0.5,
    duration: 6.0,
};

/// One millisecond.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// When \[s\].
    pub time: f64,
    /// The measured state.
    pub x: State,
    /// Torques that act \[N·m\].
    pub tau: Joints,
    /// Where the points of the arm are \[m\].
    pub points: Points,
    /// Goal of the hand \[m\].
    pub goal: [f64; 3],
    /// Least distance between arm and spheres \[m\].
    pub clearance: f64,
    /// What the sweep of this millisecond did.
    pub sweep: Sweep,
}

/// Runs a scenario. Sweeps are made by `sweep`, which may take their time; every millisecond is shown to `see`.
///
/// # Errors
/// The tool's numbers are of no rigid body.
pub fn run(
    scenario: &Scenario,
    mut sweep: impl FnMut(&mut Solver, &Task, &State) -> Sweep,
    mut see: impl FnMut(&Sample),
) -> Result<(), plant::Unphysical> {
    let tool = plant::Tool::new(scenario.tool, [0.0, 0.0, 0.05], [0.0; 6])?;
    let forearm = plant::PandaLink5::new(
        1.225946,
        [-0.011953, 0.041065, -0.038437],
        [0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627],
    )?;
    let mut state = integrate::State { q: scenario.start, qd: [0.0; NV] };
    let mut solver = Solver::at_rest(&scenario.start);
    let mut tau = solver.motion.u[0];
    let mut observer = Observer::new(50.0);
    let step = Step::of(PERIOD / f64::from(SUBSTEPS));
    for k in 0..(scenario.duration / PERIOD) as u32 {
        let time = f64::from(k) * PERIOD;
        let x: State = core::array::from_fn(|i| if i < NV { state.q[i] } else { state.qd[i - NV] });
        let goal = scenario.goals.iter().rev().find(|goal| goal.from <= time).map_or([0.0; 3], |goal| goal.hand);
        observer.step(&state.q, &state.qd, &tau, PERIOD);
        let disturbance = observer.disturbance;
        let task = Task { goal, spheres: scenario.spheres, disturbance, weights: Weights::DEFAULT };
        let foreseen: State = after(&x, &tau, &disturbance, PERIOD);
        solver.shift(PERIOD / STEP);
        let sweep = sweep(&mut solver, &task, &foreseen);
        let points = points(&state.q);
        let clearance = clearance(&points, scenario.spheres);
        see(&Sample { time, x, tau, points, goal, clearance, sweep });
        let push = scenario.pushes.iter().find(|push| push.from <= time && time < push.until);
        let force = push.map_or([0.0; 3], |push| push.force);
        for _ in 0..SUBSTEPS {
            let acceleration = |_: f64, q: &Joints, qd: &Joints, qdd: &mut Joints| {
                // τ + Jᵀ F
                let slopes = points_and_slopes(q).1[HAND];
                let all = core::array::from_fn(|j| tau[j] + (0..3).map(|i| slopes[i][j] * force[i]).sum::<f64>());
                plant::forward_dynamics(q, qd, &all, &tool, &forearm, qdd);
            };
            let change = step.runge_kutta_4(0.0, &state, acceleration);
            state.add(&change, 0);
        }
        tau = solver.motion.u[0];
    }
    Ok(())
}

/// Sweeps for the motion from rest until the cost falls by less than `part` of itself: how many, and the solver.
pub fn converged(task: &Task, start: &Joints, part: f64) -> (Solver, u32) {
    let mut solver = Solver::at_rest(start);
    let x: State = core::array::from_fn(|i| if i < NX / 2 { start[i] } else { 0.0 });
    for count in 1..=500 {
        let Sweep { before, after, .. } = solver.sweep(task, &x);
        if before - after <= part * before {
            return (solver, count);
        }
    }
    (solver, 500)
}
