//! One sweep: its linear models and its factor.

use crate::slopes::{moved, state};
use straightline_trotting_example::gait::STEP;
use straightline_trotting_example::quadruped::{
    after, difference, Difference, Mode, Slopes, State, Velocity, JOINTS, NX,
};
use straightline_trotting_example::sweep::{linear, Factor};

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
