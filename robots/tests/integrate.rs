//! Integrators on generated dynamics: orders of convergence, energy, quaternions, rounding.

use straightline_core::integrate::{Change, Compensated, State, Step, Uneven};
use straightline_core::joint::FLOATING_BASE;
use straightline_robots::{planar_2r, solo12};

type Arm = State<f64, 2, 2>;

const ARM: Arm = State { q: [0.4, -0.9], qd: [1.5, -0.7] };

/// The arm falls, with a torque that depends on time.
fn arm(t: f64, q: &[f64; 2], qd: &[f64; 2], qdd: &mut [f64; 2]) {
    planar_2r::forward_dynamics(q, qd, &[(3.0 * t).sin(), 0.2], qdd);
}

/// The arm falls, and nothing drives it.
fn free_arm(_t: f64, q: &[f64; 2], qd: &[f64; 2], qdd: &mut [f64; 2]) {
    planar_2r::forward_dynamics(q, qd, &[0.0; 2], qdd);
}

/// The robot tumbles in the air with its legs loose.
fn walker(_t: f64, q: &[f64; 19], qd: &[f64; 18], qdd: &mut [f64; 18]) {
    solo12::forward_dynamics(q, qd, &[0.0; 18], qdd);
}

fn tumbling() -> State<f64, 19, 18> {
    let mut state = State { q: [0.0; 19], qd: [0.0; 18] };
    state.q[3..7].copy_from_slice(&[0.5, -0.5, 0.1, 0.7]); // length one
    for (i, q) in state.q[7..].iter_mut().enumerate() {
        *q = 0.3 * (i as f64 + 1.0).sin();
    }
    for (i, qd) in state.qd.iter_mut().enumerate() {
        *qd = (2.0 * i as f64 + 0.5).cos();
    }
    state
}

/// The state after `time` in so many steps.
fn run<const NQ: usize, const NV: usize>(
    start: State<f64, NQ, NV>,
    time: f64,
    steps: usize,
    method: impl Fn(&Step<f64>, f64, &State<f64, NQ, NV>) -> Change<f64, NQ, NV>,
) -> State<f64, NQ, NV> {
    let step = Step::of(time / steps as f64);
    let mut state = Compensated::new(start);
    for k in 0..steps {
        let change = method(&step, k as f64 * step.length, &state.state);
        state.add(&change, 0);
    }
    state.state
}

fn distance<const NQ: usize, const NV: usize>(a: &State<f64, NQ, NV>, b: &State<f64, NQ, NV>) -> f64 {
    let entries = a.q.iter().zip(&b.q).chain(a.qd.iter().zip(&b.qd));
    entries.fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

/// By how much the error falls when steps are halved, as a power of two.
fn order<const NQ: usize, const NV: usize>(
    start: State<f64, NQ, NV>,
    truth: &State<f64, NQ, NV>,
    (time, steps): (f64, usize),
    method: impl Fn(&Step<f64>, f64, &State<f64, NQ, NV>) -> Change<f64, NQ, NV>,
) -> f64 {
    let error = |steps| distance(&run(start, time, steps, &method), truth);
    (error(steps) / error(2 * steps)).log2()
}

#[track_caller]
fn close(found: f64, order: f64) {
    assert!((found - order).abs() < 0.3, "{found} is not {order}");
}

#[test]
fn every_method_has_its_order_on_an_arm() {
    let truth = run(ARM, 0.5, 4000, |s, t, x| s.runge_kutta_4(t, x, arm));
    close(order(ARM, &truth, (0.5, 100), |s, t, x| s.runge_kutta_4(t, x, arm)), 4.0);
    close(order(ARM, &truth, (0.5, 200), |s, t, x| s.semi_implicit_euler(t, x, arm)), 1.0);
    close(order(ARM, &truth, (0.5, 100), |s, t, x| s.implicit_midpoint(t, x, 6, arm)), 2.0);
    let truth = run(ARM, 0.5, 4000, |s, t, x| s.runge_kutta_4(t, x, free_arm));
    let implicit = |s: &Step<f64>, _: f64, x: &Arm| {
        s.implicit_euler(x, &[0.0; 2], &[0.0; 2], planar_2r::mass_matrix, |q, qd, f| {
            planar_2r::bias_force(q, qd, f);
            *f = f.map(|f| -f);
        })
    };
    close(order(ARM, &truth, (0.5, 200), implicit), 1.0);
}

#[test]
fn every_method_has_its_order_on_a_tumbling_robot() {
    let start = tumbling();
    let truth = run(start, 0.1, 1000, |s, t, x| s.runge_kutta_4(t, x, walker));
    close(order(start, &truth, (0.1, 30), |s, t, x| s.runge_kutta_4(t, x, walker)), 4.0);
    close(order(start, &truth, (0.1, 50), |s, t, x| s.implicit_midpoint(t, x, 6, walker)), 2.0);
    close(order(start, &truth, (0.1, 200), |s, t, x| s.semi_implicit_euler(t, x, walker)), 1.0);
}

#[test]
fn midpoint_steps_keep_energy() {
    let energy = |x: &Arm| {
        let mut e = [0.0; 2];
        planar_2r::energy(&x.q, &x.qd, &mut e);
        e[0] + e[1]
    };
    let before = energy(&ARM);
    // a double pendulum; the error comes and goes with h² and does not grow with time
    let error = |seconds: f64| {
        let end = run(ARM, seconds, (seconds * 1000.0) as usize, |s, t, x| s.implicit_midpoint(t, x, 5, free_arm));
        (energy(&end) - before).abs()
    };
    let (early, late) = (error(1.0), error(20.0));
    assert!(early < 1e-3 && late < 1e-3, "{early:e} {late:e}");
    let end = run(ARM, 20.0, 20_000, |s, t, x| s.runge_kutta_4(t, x, free_arm));
    assert!((energy(&end) - before).abs() < 1e-6, "{:e}", energy(&end) - before);
}

#[test]
fn quaternions_stay_unit_quaternions_and_a_constant_turn_is_the_exponential() {
    let mut state = tumbling();
    let step = Step::of(1e-3);
    for k in 0..1000 {
        let change = step.semi_implicit_euler(f64::from(k) * 1e-3, &state, walker);
        state.add(&change, 0);
        let length: f64 = state.q[3..7].iter().map(|x| x * x).sum();
        // rounding of four squares and a product
        assert!((length - 1.0).abs() < 1e-15, "step {k}: {length}");
    }
    // no acceleration: about a fixed axis by ω t, along a circle in the world
    let omega = [0.6, -0.8, 1.2];
    let (norm, time) = (omega.iter().map(|w| w * w).sum::<f64>().sqrt(), 2.0);
    let start = State { q: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], qd: [1.0, 0.0, 0.0, omega[0], omega[1], omega[2]] };
    let at_rest = |_: f64, _: &[f64; 7], _: &[f64; 6], qdd: &mut [f64; 6]| *qdd = [0.0; 6];
    let end = run(start, time, 2000, |s, t, x| s.semi_implicit_euler(t, x, at_rest));
    let (s, c) = (0.5 * norm * time).sin_cos();
    for (k, expected) in [omega[0] / norm * s, omega[1] / norm * s, omega[2] / norm * s, c].into_iter().enumerate() {
        // Cayley's map for the exponential: (|ω| h)² / 12 of the angle
        assert!((end.q[3 + k] - expected).abs() < 5e-7, "{:?}", end.q);
    }
    let exact = run(start, time, 2000, |s, t, x| s.runge_kutta_4(t, x, at_rest));
    assert!(distance(&end, &exact) < 1e-6, "{end:?} {exact:?}");
}

#[test]
fn a_base_may_stand_anywhere_among_the_joints() {
    // a joint before the base and one after: as if each were alone
    let q = [0.5, 1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8, -0.4];
    let qd = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
    let (q_base, qd_base) = ([1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8], [0.2, 0.3, 0.4, 0.5, 0.6, 0.7]);
    let alone: [f64; 7] = Step::of(0.01).displacement(&q_base, &qd_base, 0.01);
    let together: [f64; 9] =
        Step { length: 0.01, joints: &[Uneven { kind: FLOATING_BASE, first: 1 }] }.displacement(&q, &qd, 0.01);
    assert_eq!(together[1..8], alone);
    assert_eq!([together[0], together[8]], [0.1 * 0.01, 0.8 * 0.01]);
}

#[test]
fn stiff_dampers_and_springs_need_no_small_steps() {
    // H q̈ + d q̇ + k q = 0 with d/H near 1e6 s⁻¹ and k/d = 1 s⁻¹: after the first instant q = exp(−t)
    let (d, k) = ([2e6, 1e6], [2e6, 1e6]);
    let mut state = State { q: [1.0, -0.5], qd: [0.0; 2] };
    let step = Step::of(0.01);
    for _ in 0..100 {
        let change = step.implicit_euler(
            &state,
            &d,
            &k,
            |_q, h| *h = [[2.0, 0.3], [0.3, 1.0]],
            |q, qd, f| *f = std::array::from_fn(|i| -d[i] * qd[i] - k[i] * q[i]),
        );
        state.add(&change, 0);
    }
    // Euler's own error at this step: h/2 of what there is
    for (q, start) in state.q.iter().zip([1.0, -0.5]) {
        assert!((q - start * (-1.0_f64).exp()).abs() < 0.006, "{:?}", state.q);
    }
}

#[test]
fn compensated_sums_lose_nothing_in_single_precision() {
    // a fall with 100 000 small steps: what is lost to rounding is lost at every step
    let fall = |_: f32, _: &[f32; 1], _: &[f32; 1], qdd: &mut [f32; 1]| qdd[0] = -9.81;
    let step = Step::of(1e-5_f32);
    let start = State { q: [10.0_f32], qd: [0.3] };
    let (mut plain, mut compensated) = (start, Compensated::new(start));
    for k in 0..100_000 {
        let t = k as f32 * 1e-5;
        let change = step.implicit_midpoint(t, &plain, 1, fall);
        plain.add(&change, 0);
        let change = step.implicit_midpoint(t, &compensated.state, 1, fall);
        compensated.add(&change, 0);
    }
    let error = |q: f32| (f64::from(q) - (10.0 + 0.3 - 0.5 * 9.81)).abs();
    let (plain, compensated) = (error(plain.q[0]), error(compensated.state.q[0]));
    // the step itself is off by 2^-25 of its length, which moves all by 5e-7; then a few units in the last place of 10
    assert!(compensated < 3e-6 && plain > 20.0 * compensated, "{plain:e} {compensated:e}");
}
