//! The firmware's step at 1 kHz in single precision, in a loop with a simulated arm in double precision.

use straightline::integrate::{State, Step};
use straightline_firmware_example::arm::{control_step, Gains, Measured, Wanted, TORQUE_LIMITS};
use straightline_robots::panda;

const GAINS: Gains = Gains { stiffness: [400.0; 7], damping: [40.0; 7] };
const FROM: [f64; 7] = [0.0, -0.9, 0.3, -2.3, -0.3, 1.9, 0.2];
const TO: [f64; 7] = [0.8, -0.3, -0.4, -1.6, 0.4, 1.2, 1.0];
/// Time of the motion \[s\].
const TIME: f64 = 1.2;

/// From rest to rest by a polynomial of degree five, and rest after it.
fn wanted(t: f64) -> Wanted {
    let x = (t / TIME).min(1.0);
    let (s, sd, sdd) = (
        x * x * x * (10.0 + x * (6.0 * x - 15.0)),
        30.0 * x * x * (1.0 - x) * (1.0 - x) / TIME,
        60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (TIME * TIME),
    );
    let along = |k: f64, from: f64| std::array::from_fn(|i| (from * FROM[i] + k * (TO[i] - FROM[i])) as f32);
    Wanted { q: along(s, 1.0), qd: along(sd, 0.0), qdd: along(sdd, 0.0) }
}

#[test]
fn the_arm_follows_a_fast_motion_within_a_milliradian() {
    // starts a little off
    let mut state = State { q: FROM.map(|q| q + 0.02), qd: [0.0; 7] };
    let step = Step::of(2.5e-4);
    let (mut worst, mut greatest) = (0.0f64, 0.0f64);
    for millisecond in 0..1500 {
        let t = f64::from(millisecond) * 1e-3;
        let (reference, mut tau) = (wanted(t), [0.0; 7]);
        let measured = Measured { q: state.q.map(|x| x as f32), qd: state.qd.map(|x| x as f32) };
        control_step(&GAINS, &reference, &measured, &mut tau).unwrap();
        assert!(tau.iter().zip(TORQUE_LIMITS).all(|(tau, limit)| tau.abs() <= limit));
        let drive = tau.map(f64::from);
        for _ in 0..4 {
            let change = step.runge_kutta_4(0.0, &state, |_, q, qd, qdd| panda::forward_dynamics(q, qd, &drive, qdd));
            state.add(&change, 0);
        }
        let now = wanted(t + 1e-3);
        let error = state.q.iter().zip(now.q).fold(0.0f64, |m, (q, r)| m.max((q - f64::from(r)).abs()));
        greatest = greatest.max(error);
        // the first error is gone like (1 + 20 t) exp(−20 t): below 1e-5 after 0.5 s
        if t > 0.5 {
            worst = worst.max(error);
        }
    }
    // torques are held for a millisecond: half of that is what the arm is late
    assert!(worst < 1e-3, "{worst}");
    assert!((0.015..0.025).contains(&greatest), "{greatest}");
}
