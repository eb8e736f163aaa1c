//! Compensated sums of a turning base; integrators on generated dynamics stand in `robots/tests/integrate.rs`.

use straightline_core::integrate::{Compensated, State, Step};

/// A body turns at a constant rate: after the time t its quaternion is (a sin(ω t/2), cos(ω t/2)).
#[test]
fn compensated_sums_keep_the_attitude_in_single_precision() {
    let free = |_: f32, _: &[f32; 7], _: &[f32; 6], qdd: &mut [f32; 6]| *qdd = [0.0; 6];
    // a step and a rate that f32 has, about an axis with three components: 2/7, 3/7, 6/7
    let (step, rate) = (Step::of(0.5f32.powi(13)), 1.75f32);
    let axis = [2.0, 3.0, 6.0].map(|x: f64| x / 7.0);
    let omega = [0.5f32, 0.75, 1.5];
    let start = State { q: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0f32], qd: [0.0, 0.0, 0.0, omega[0], omega[1], omega[2]] };
    let (mut plain, mut compensated) = (start, Compensated::new(start));
    let steps = 100_000;
    for _ in 0..steps {
        let change = step.runge_kutta_4(0.0, &plain, free);
        plain.add(&change, 0);
        let change = step.runge_kutta_4(0.0, &compensated.state, free);
        compensated.add(&change, 0);
    }
    let half = 0.5 * f64::from(rate) * f64::from(step.length) * f64::from(steps);
    let truth = [axis[0] * half.sin(), axis[1] * half.sin(), axis[2] * half.sin(), half.cos()];
    let error = |q: &[f32; 7]| (0..4).map(|i| (f64::from(q[3 + i]) - truth[i]).abs()).fold(0.0, f64::max);
    let (plain, compensated) = (error(&plain.q), error(&compensated.state.q));
    println!("{plain:e} {compensated:e}");
    // the rates of 21 rad are rounded by 6e-8 each, one way
    assert!(compensated < 3e-6 && plain > 20.0 * compensated, "{plain:e} {compensated:e}");
}
