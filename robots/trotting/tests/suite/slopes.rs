//! Derivatives of contact modes and of costs, against differences.

use straightline::integrate::Step;
use straightline_trotting_example::gait::Gait;
use straightline_trotting_example::quadruped::{
    feet, generalized_forces, holding, Mode, Slopes, State, Torques, Velocity, FEET, JOINTS, NV, NX, STANDING,
};
use straightline_trotting_example::task::{Task, Weights};

const MODES: [Mode; 3] = [Mode::Four, Mode::FallingDiagonal, Mode::RisingDiagonal];

/// A trunk that is turned about all axes; everything moves.
pub fn state() -> State {
    let mut q = STANDING;
    q[3..7].copy_from_slice(&[0.1, -0.2, 0.3, (1.0f64 - 0.14).sqrt()]);
    for i in 0..JOINTS {
        q[7 + i] += 0.1 * (1.7 * i as f64 + 0.4).sin();
    }
    State { q, qd: core::array::from_fn(|i| 0.6 * (2.3 * i as f64 + 0.9).cos()) }
}

fn tau() -> Velocity {
    core::array::from_fn(|i| if i < 6 { 0.4 * (i as f64 - 2.0) } else { 1.2 * (1.1 * i as f64).sin() })
}

/// The state with its k-th entry moved by d, of the pose in the trunk's axes.
pub fn moved(state: &State, k: usize, d: f64) -> State {
    let mut out = *state;
    if k < NV {
        let unit: Velocity = core::array::from_fn(|i| if i == k { d } else { 0.0 });
        let change = Step::of(1.0).displacement(&state.q, &unit, 1.0);
        out.q.iter_mut().zip(change).for_each(|(q, d)| *q += d);
    } else {
        out.qd[k - NV] += d;
    }
    out
}

/// Central differences: h² of third derivatives, and ε/h of values near a thousand.
fn close(found: f64, slope: f64, scale: f64, what: &str) {
    assert!((found - slope).abs() < 2e-6 * (scale + slope.abs()), "{what}: {found} {slope}");
}

#[test]
fn all_blocks_are_the_slopes_of_motion_and_forces() {
    let (state, tau, h) = (state(), tau(), 1e-5);
    for mode in MODES {
        let found = Slopes::of(mode, &state, &tau);
        let scale = 1.0 + found.qdd.iter().chain(&found.force).fold(0.0f64, |most, x| most.max(x.abs()));
        for k in 0..NX + NV {
            let at = |d: f64| match k {
                0..NX => Slopes::of(mode, &moved(&state, k, d), &tau),
                _ => {
                    let mut tau = tau;
                    tau[k - NX] += d;
                    Slopes::of(mode, &state, &tau)
                }
            };
            let (up, down) = (at(h), at(-h));
            let (by, by_force) = match k / NV {
                0 => (&found.dqdd_dq, &found.dforce_dq),
                1 => (&found.dqdd_dqd, &found.dforce_dqd),
                _ => (&found.dqdd_dtau, &found.dforce_dtau),
            };
            for i in 0..NV {
                let slope = (up.qdd[i] - down.qdd[i]) / (2.0 * h);
                close(by[i][k % NV], slope, scale, &format!("{mode:?} q̈[{i}] by {k}"));
            }
            for i in 0..3 * FEET {
                let slope = (up.force[i] - down.force[i]) / (2.0 * h);
                close(by_force[i][k % NV], slope, scale, &format!("{mode:?} F[{i}] by {k}"));
            }
        }
    }
}

/// Feet that stand are pushed, those in the air are not; forces and weight make the motion of the whole: of a robot that is held nearly at
/// rest they carry it.
#[test]
fn feet_that_stand_carry_the_robot() {
    for mode in MODES {
        let hold = holding(mode, &STANDING);
        let tau = generalized_forces(&[0.0; 6], &hold);
        let found = Slopes::of(mode, &State { q: STANDING, qd: [0.0; NV] }, &tau);
        let up: f64 = (0..FEET).map(|foot| found.force[3 * foot + 2]).sum();
        // 2.5 kg; legs that hang move a little
        assert!((up - 2.5 * 9.81).abs() < 0.5, "{mode:?}: {up}");
        for foot in 0..FEET {
            let force = &found.force[3 * foot..3 * foot + 3];
            assert!(if mode.stands(foot) { force[2] > 3.0 } else { force == [0.0; 3] }, "{mode:?} {force:?}");
        }
    }
}

/// The gradient of a cost in which every term is there: forces outside their cones, torques beyond what is moderate, feet off their ways.
#[test]
fn the_gradient_is_that_of_the_cost() {
    let (state, h) = (state(), 1e-6);
    let u: Torques = core::array::from_fn(|i| 2.5 * (1.1 * i as f64).sin());
    let gait = Gait { first: 0, swings: 3, speed: [0.3, 0.1] };
    for (node, mode) in [(-1, Mode::Four), (5, Mode::FallingDiagonal), (25, Mode::RisingDiagonal)] {
        let task = Task::at(&gait, node, node, &state, &feet(&state.q), Weights::DEFAULT);
        assert_eq!(task.mode, mode);
        let cost = |state: &State, u: &Torques| {
            let slopes = Slopes::of(mode, state, &generalized_forces(&[0.0; 6], u));
            (task.cost(state, Some((u, &slopes)), 1.3), task.quadratic(state, Some((u, &slopes)), 1.3))
        };
        let (value, found) = cost(&state, &u);
        for k in 0..NX + JOINTS {
            let at = |d: f64| {
                let mut u = u;
                if k >= NX {
                    u[k - NX] += d;
                }
                cost(&if k < NX { moved(&state, k, d) } else { state }, &u).0
            };
            let slope = (at(h) - at(-h)) / (2.0 * h);
            // the velocity that is wanted turns with the trunk, of which the slope is left out
            let left_out = if (3..6).contains(&k) { 1.3 * Weights::DEFAULT.speed[0] } else { 0.0 };
            let by = if k < NX { found.x[k] } else { found.u[k - NX] };
            assert!((by - slope).abs() < left_out + 1e-5 * (value + slope.abs()), "{mode:?} {k}: {by} {slope}");
        }
        let tame = Task { weights: Weights { cone: 0.0, limit: 0.0, feet: 0.0, ..Weights::DEFAULT }, ..task };
        let slopes = Slopes::of(mode, &state, &generalized_forces(&[0.0; 6], &u));
        assert!(task.cost(&state, Some((&u, &slopes)), 1.3) > 1.5 * tame.cost(&state, Some((&u, &slopes)), 1.3));
    }
}
