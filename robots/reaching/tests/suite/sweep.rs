//! One sweep: its derivatives, its decrease, its limits.

use straightline_reaching_example::arm::{points, Sphere, HAND, TORQUE};
use straightline_reaching_example::closed_loop::{converged, EXAMPLE};
use straightline_reaching_example::ilqr::Solver;
use straightline_reaching_example::task::{State, Task, Weights, NX};
use straightline_reaching_example::NV;

fn task() -> Task<'static> {
    Task {
        goal: EXAMPLE.goals[0].hand,
        spheres: EXAMPLE.spheres,
        disturbance: [0.4, -1.0, 0.2, 0.3, -0.1, 0.05, 0.02],
        weights: Weights::DEFAULT,
    }
}

/// A state near a sphere, with a joint near its limit and one that turns too fast.
const X: State = [0.35, 0.1, 0.2, -1.9, 2.85, 1.6, 0.8, 0.3, -0.2, 2.1, 0.4, -0.5, 0.6, -0.7];
const U: [f64; NV] = [3.0, -20.0, 5.0, 12.0, 1.0, -2.0, 0.5];

/// Gradients against central differences, whose error is ε/h of values near a hundred and h² of third derivatives.
#[test]
fn the_gradient_is_that_of_the_cost() {
    let near = [Sphere { centre: [0.45, 0.2, 0.55], radius: 0.1 }];
    let task = Task { spheres: &near, ..task() };
    let found = task.quadratic(&X, Some(&U), 1.3);
    let h = 1e-6;
    for i in 0..NX {
        let at = |d: f64| {
            let mut x = X;
            x[i] += d;
            task.cost(&x, Some(&U), 1.3)
        };
        let slope = (at(h) - at(-h)) / (2.0 * h);
        assert!((found.x[i] - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{i}: {} {slope}", found.x[i]);
    }
    for i in 0..NV {
        let at = |d: f64| {
            let mut u = U;
            u[i] += d;
            task.cost(&X, Some(&u), 1.3)
        };
        let slope = (at(h) - at(-h)) / (2.0 * h);
        assert!((found.u[i] - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{i}: {} {slope}", found.u[i]);
    }
    // all parts of the cost are there: near a sphere, beyond the margins of a joint and of a speed
    assert!(task.cost(&X, None, 1.0) > Task { spheres: &[], ..task }.cost(&X, None, 1.0) + 0.1);
    assert!(found.vv[2] > found.vv[0] && found.qq[4][4] > 100.0);
}

/// The cost that the backward recursion foresees along a small step is what the rollout finds: its derivative is exact, whatever
/// the curvature leaves out.
#[test]
fn cost_falls_from_sweep_to_sweep_until_it_is_least() {
    let (task, start) = (task(), EXAMPLE.start);
    let x: State = core::array::from_fn(|i| if i < NV { start[i] } else { 0.0 });
    let mut solver = Solver::at_rest(&start);
    let mut last = f64::INFINITY;
    for _ in 0..40 {
        let sweep = solver.sweep(&task, &x);
        assert!(sweep.after <= sweep.before && sweep.before <= last * (1.0 + 1e-12), "{sweep:?} {last}");
        last = sweep.after;
    }
    let (solver, sweeps) = converged(&task, &start, 1e-9);
    assert!(sweeps < 200, "{sweeps} sweeps");
    // least: no torque that may move lowers it
    let cost = |k: usize, i: usize, d: f64| {
        let mut u = solver.motion.u;
        u[k][i] += d;
        let (mut x, mut cost) = (x, 0.0);
        for u in &u {
            cost += task.cost(&x, Some(u), straightline_reaching_example::ilqr::STEP);
            x = straightline_reaching_example::ilqr::after(
                &x,
                u,
                &task.disturbance,
                straightline_reaching_example::ilqr::STEP,
            );
        }
        cost + task.cost(&x, None, task.weights.last)
    };
    for (k, i) in [(0, 0), (0, 3), (5, 1), (12, 2), (20, 5), (29, 6)] {
        if solver.motion.u[k][i].abs() < TORQUE[i] {
            // a thousandth of the greatest torque
            let d = 1e-3 * TORQUE[i];
            let (less, here, more) = (cost(k, i, -d), cost(k, i, 0.0), cost(k, i, d));
            assert!(less > here - 1e-7 * here && more > here - 1e-7 * here, "{k} {i}: {less} {here} {more}");
        }
    }
}

/// With weak drives the way is farther than they can go at once: torques lie at their limits, never beyond, and the cost falls all the same.
#[test]
fn torques_stay_within_their_limits_where_these_hold() {
    let far =
        Task { goal: [-0.4, 0.5, 0.5], spheres: &[], weights: Weights { reach: 4000.0, ..Weights::DEFAULT }, ..task() };
    let x: State = core::array::from_fn(|i| if i < NV { EXAMPLE.start[i] } else { 0.0 });
    let mut solver = Solver::at_rest(&EXAMPLE.start);
    let first = solver.sweep(&far, &x);
    let mut most = 0;
    let mut last = first;
    for _ in 0..30 {
        last = solver.sweep(&far, &x);
        most = most.max(last.at_limits);
        assert!(solver.motion.u.iter().all(|u| u.iter().zip(TORQUE).all(|(u, most)| u.abs() <= most)));
    }
    assert!(most > 0 && last.after < 0.9 * first.before, "{most} {first:?} {last:?}");
    let hand = |x: &State| points(&core::array::from_fn(|i| x[i]))[HAND];
    assert!(hand(&solver.motion.x[30])[0] < hand(&x)[0] - 0.1);
}
