//! One sweep: its linear models and its factor.

use crate::slopes::{moved, state};
use straightline_trotting_example::gait::{Gait, PLACES, STEP};
use straightline_trotting_example::quadruped::{
    after, difference, generalized_forces, Difference, Mode, Slopes, State, Torques, Velocity, JOINTS, NV, NX, STANDING,
};
use straightline_trotting_example::sweep::{linear, Factor, Solver, NODES};
use straightline_trotting_example::task::{Task, Weights};

/// A and B against central differences of a whole step. What A leaves out is of the second order in the way of a step, h² |q̇|², of the pose
/// alone, and the part h |q̇| of what B has there.
#[test]
fn a_step_is_linear_as_a_and_b_say() {
    let (state, h) = (state(), 1e-6);
    let tau: Velocity = core::array::from_fn(|i| if i < 6 { 0.0 } else { 0.8 * (1.1 * i as f64).sin() });
    for mode in [Mode::Four, Mode::FallingDiagonal, Mode::RisingDiagonal] {
        let step = |state: &State, tau: &Velocity| after(state, &Slopes::of(mode, state, tau).qdd, STEP);
        let slopes = Slopes::of(mode, &state, &tau);
        let next = step(&state, &tau);
        let (a, b) = linear(&next.qd, &slopes);
        for j in 0..NX {
            let ends = [h, -h].map(|d| difference(&step(&moved(&state, j, d), &tau), &next));
            for i in 0..NX {
                let slope = (ends[0][i] - ends[1][i]) / (2.0 * h);
                let allowed = 5e-4 + 1e-6 * slope.abs();
                assert!((a[i][j] - slope).abs() < allowed, "{mode:?} A[{i}][{j}]: {} {slope}", a[i][j]);
            }
        }
        for j in 0..JOINTS {
            let ends = [h, -h].map(|d| {
                let mut tau = tau;
                tau[6 + j] += d;
                difference(&step(&state, &tau), &next)
            });
            let slopes: Difference = core::array::from_fn(|i| (ends[0][i] - ends[1][i]) / (2.0 * h));
            let most = slopes[..6].iter().fold(0.0f64, |most, slope| most.max(slope.abs()));
            for i in 0..NX {
                let allowed = if i < 6 { 0.02 * most } else { 1e-6 * (1.0 + slopes[i].abs()) };
                assert!((b[i][j] - slopes[i]).abs() < allowed, "{mode:?} B[{i}][{j}]: {} {}", b[i][j], slopes[i]);
            }
        }
    }
}

#[test]
fn a_factor_solves_and_knows_what_is_not_positive() {
    let matrix = [[4.0, 1.0, -0.5], [1.0, 3.0, 0.2], [-0.5, 0.2, 1.0]];
    let mut b = [[1.0], [-2.0], [0.5]];
    Factor::new(&matrix).unwrap().solve(&mut b);
    for (row, right) in matrix.iter().zip([1.0, -2.0, 0.5]) {
        let left: f64 = row.iter().zip(b).map(|(a, [x])| a * x).sum();
        assert!((left - right).abs() < 1e-14, "{left} {right}");
    }
    assert!(Factor::new(&[[1.0, 2.0], [2.0, 1.0]]).is_none() && Factor::new(&[[f64::NAN]]).is_none());
}

/// From a robot that is off its way, through a swing and a landing: sweeps settle, and where they have, no torque lowers the cost.
#[test]
fn sweeps_settle_where_no_torque_lowers_the_cost() {
    let gait = Gait { first: 4, swings: 4, speed: [0.2, 0.0] };
    let mut start = State { q: STANDING, qd: [0.0; NV] };
    (start.q[1], start.q[2], start.qd[0], start.qd[4]) = (0.01, start.q[2] - 0.005, 0.1, -0.2);
    let wrench = [0.3, -0.5, -2.0, 0.05, 0.1, 0.02];
    let tasks: [Task; NODES + 1] =
        core::array::from_fn(|k| Task::at(&gait, k as i64, 0, &start, &PLACES, Weights::DEFAULT));
    let mut solver = Solver::at_rest(&start, &tasks);
    let first = solver.sweep(&tasks, &start, &wrench).unwrap();
    let mut last = first;
    for _ in 0..60 {
        last = solver.sweep(&tasks, &start, &wrench).unwrap();
    }
    assert!(last.cost < 0.5 * first.cost && last.fall < 1e-9 * last.cost, "{first:?} {last:?}");
    let cost = |torques: &[Torques; NODES]| {
        let (mut state, mut cost) = (start, 0.0);
        for (task, u) in tasks.iter().zip(torques) {
            let slopes = Slopes::of(task.mode, &state, &generalized_forces(&wrench, u));
            cost += task.cost(&state, Some((u, &slopes)), STEP);
            state = after(&state, &slopes.qdd, STEP);
        }
        cost + tasks[NODES].cost(&state, None, Weights::DEFAULT.last)
    };
    let least = cost(&solver.torques);
    assert!((least - last.cost).abs() < 1e-12 * least, "{least} {last:?}");
    for (k, i) in [(0, 2), (3, 0), (8, 5), (15, 7), (22, 10), (31, 3)] {
        let [less, more] = [-0.01, 0.01].map(|d| {
            let mut torques = solver.torques;
            torques[k][i] += d;
            cost(&torques)
        });
        assert!(less > least && more > least, "{k} {i}: {less} {least} {more}");
    }
}
