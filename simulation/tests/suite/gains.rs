//! Feedback gains: linear models against difference quotients, regulation against closed forms, margins against what they say of loops.

use crate::common::{arm, cart};
use straightline_core::algorithms::forward_dynamics_aba;
use straightline_core::model::{Coulomb, Model};
use straightline_simulation::command::{Command, Compensation, Controller};
use straightline_simulation::gains::{propose, GainDemand, GainProposal, Linear};
use straightline_simulation::motion::Motion;
use straightline_simulation::plant::Plant;
use straightline_simulation::simulate::{simulate, Settings};

fn smooth_arm() -> Model<f64> {
    let mut model = arm();
    model.bodies.iter_mut().for_each(|b| b.effects.coulomb = Coulomb::Off);
    model
}

fn arm_motion() -> Motion {
    Motion::quintic(&[0.0, 0.6], &[vec![0.0, -0.5, 0.3], vec![1.0, 0.4, -0.6]]).unwrap()
}

fn cart_motion() -> Motion {
    Motion::quintic(&[0.0, 0.5], &[vec![0.0], vec![0.2]]).unwrap()
}

/// Against central differences of another algorithm, articulated bodies: h² of third derivatives and ε/h of accelerations near 30.
#[test]
fn the_linear_model_is_the_slope_of_forward_dynamics() {
    let model = smooth_arm();
    let (q, qd, tau) = ([0.3, -0.7, 1.1], [0.8, -1.2, 0.5], [3.0, -8.0, 2.0]);
    let qdd = forward_dynamics_aba(&model, &q, &qd, &tau);
    let found = Linear::about(&model, (&q, &qd, &qdd), &[0, 2]).unwrap();
    let h = 1e-5;
    for k in 0..9 {
        let at = |d: f64| {
            let mut all = [q, qd, tau];
            all[k / 3][k % 3] += d;
            forward_dynamics_aba(&model, &all[0], &all[1], &all[2])
        };
        let (more, less) = (at(h), at(-h));
        for i in 0..3 {
            let slope = (more[i] - less[i]) / (2.0 * h);
            let entry = match k {
                0..=5 => found.a[(3 + i, k)],
                6 => found.b[(3 + i, 0)],
                8 => found.b[(3 + i, 1)],
                _ => continue,
            };
            assert!((entry - slope).abs() < 1e-7 * (1.0 + slope.abs()), "{i} {k}: {entry} {slope}");
        }
        assert!((0..3).all(|i| found.a[(i, k.min(5))] == f64::from(u8::from(k.min(5) == 3 + i))));
    }
}

/// A mass: x⁺ = x + h v + h²/2m τ, v⁺ = v + h/m τ.
#[test]
fn a_mass_is_sampled_as_the_closed_form_says() {
    let about = Linear::about(&cart(), (&[0.1], &[0.3], &[0.0]), &[0]).unwrap();
    let (phi, gamma) = about.sampled(0.02);
    for (found, expected) in
        phi.iter().chain(gamma.iter()).zip([1.0, 0.0, 0.02, 1.0, 0.02 * 0.02 / (2.0 * 2.0), 0.02 / 2.0])
    {
        assert!((found - expected).abs() < 1e-16, "{phi} {gamma}");
    }
}

fn proposal(model: &Model<f64>, motion: &Motion, demand: &GainDemand) -> GainProposal {
    propose(model, motion, demand).unwrap()
}

/// Of a mass m with weights of e, e ω and τ = m ω² e: K = τ/e = m ω², D = √(2 m K + (τ/(e ω))²) = √3 m ω, where the period is short.
#[test]
fn regulation_of_a_mass_is_the_closed_form() {
    let demand = GainDemand { period: 1e-4, ..GainDemand::of(1) };
    let found = proposal(&cart(), &cart_motion(), &demand);
    let (m, omega) = (2.0, std::f64::consts::TAU * 5.0);
    assert!((found.joints[0].inertia.0 - 2.0).abs() < 1e-12 && (found.joints[0].inertia.1 - 2.0).abs() < 1e-12);
    let last = found.schedule.rows.last().unwrap();
    // of a period h gains are off by about h ω = 0.3 %
    assert!((last[0] / (m * omega * omega) - 1.0).abs() < 0.01, "{last:?}");
    assert!((last[1] / (3f64.sqrt() * m * omega) - 1.0).abs() < 0.01, "{last:?}");
    assert!((found.stiffness[0] / (m * omega * omega) - 1.0).abs() < 1e-12);
    assert!((found.damping[0] / (2.0 * m * omega) - 1.0).abs() < 1e-12);
    // nothing of it changes along the motion, as nothing of the mass does
    assert!(found.schedule.rows.iter().all(|row| (row[0] / last[0] - 1.0).abs() < 1e-9));
    let joint = &found.joints[0];
    assert!((joint.frequency.0 - 5.0).abs() < 1e-9 && (joint.ratio.1 - 1.0).abs() < 1e-12);
}

/// By Jury's criterion a mass with K and D, sampled and held, is stable up to D = 2 m / h. The phase margin of the continuous loop with
/// the delay of the hold, h/2, is that of the sampled one where the period is short.
#[test]
fn margins_of_a_mass_are_the_closed_form() {
    for (period, bound) in [(2e-3, 0.01), (2e-4, 0.001)] {
        let demand = GainDemand { period, ..GainDemand::of(1) };
        let found = proposal(&cart(), &cart_motion(), &demand);
        let (k, d, m) = (found.stiffness[0], found.damping[0], 2.0);
        let margins = found.joints[0].margins[0].unwrap();
        // stiffness takes a part of it: exactly 2 m / (h D) where the eigenvalue −1 is
        assert!((margins.gain.1 / (2.0 * m / (period * d)) - 1.0).abs() < 1e-6, "{margins:?}");
        assert_eq!(margins.gain.0, 0.0);
        // |L| = 1: ω² = (D² + √(D⁴ + 4 m² K²)) / 2m²
        let square = (d * d + (d.powi(4) + 4.0 * m * m * k * k).sqrt()) / (2.0 * m * m);
        let crossing = square.sqrt();
        let phase = (d * crossing / k).atan() - crossing * period / 2.0;
        assert!((margins.phase - phase).abs() < bound, "{} {phase}", margins.phase);
    }
}

#[test]
fn both_kinds_of_gains_follow_better_than_torques_alone_and_die_out() {
    let (model, motion) = (arm(), arm_motion());
    let found = proposal(&model, &motion, &GainDemand::of(3));
    let none =
        Controller { stiffness: vec![0.0; 3], damping: vec![0.0; 3], ..found.controller(&model, &motion, false) };
    let follow = |controller: Controller| found.followed(&model, controller).unwrap();
    let (alone, per_joint, lqr) = (
        follow(none),
        follow(found.controller(&model, &motion, false)),
        follow(found.controller(&model, &motion, true)),
    );
    for k in 0..3 {
        let rms = [&alone, &per_joint, &lqr].map(|t| t.figures(k).1);
        assert!(rms[1] < 0.5 * rms[0] && rms[2] < 0.5 * rms[0], "{k}: {rms:?}");
        // by the end the first error of a hundredth is gone, up to what ten per cent more mass take
        assert!(
            lqr.errors[k].last().unwrap().abs() < 5e-3 && lqr.errors[k][0].abs() > 9e-3,
            "{:?}",
            lqr.errors[k].last()
        );
    }
    // entries beside the diagonal are there: the joints are coupled
    let row = &found.schedule.rows[0];
    assert!(row[1].abs() > 1e-3 * row[0] || row[2].abs() > 1e-3 * row[0], "{row:?}");
    let table = found.table(&model);
    assert_eq!(table.names.len(), 1 + 3 * 6);
    assert_eq!(table.column("K.to_upper.qd.to_fore").unwrap()[0], row[6 + 3 + 2]);
}

/// What is computed acts a period later: from rest, one period of the first torques, then those of the state at the beginning.
#[test]
fn torques_wait_for_as_many_periods_as_are_told() {
    let motion = Motion::quintic(&[0.0, 1.0], &[vec![0.0], vec![0.0]]).unwrap();
    let of = |delay: usize| {
        let controller = Controller {
            model: cart(),
            compensation: Compensation::None,
            motion: motion.clone(),
            stiffness: vec![8.0],
            damping: vec![0.0],
            feedback: None,
            saturates: false,
            gives_currents: false,
            period: Some(0.1),
            delay,
        };
        let settings = Settings { interval: 0.1, ..Settings::lasting(0.5) };
        let command = Command::Controller(Box::new(controller));
        simulate(&Plant::new(cart(), 1e-3), &command, (&[1.0], &[0.0]), &settings, &|_| ()).unwrap().table.rows
    };
    for delay in [0, 1, 2] {
        let rows = of(delay);
        let (mut x, mut v) = (1.0f64, 0.0f64);
        let mut seen = vec![];
        for k in 0..5usize {
            seen.push(x);
            let tau = -8.0 * seen[k.saturating_sub(delay)];
            x += 0.1 * v + 0.005 * tau / 2.0;
            v += 0.1 * tau / 2.0;
            assert!((rows[k + 1][1] - x).abs() < 1e-9, "{delay} {k}: {} {x}", rows[k + 1][1]);
        }
    }
}

#[test]
fn what_cannot_be_held_is_said() {
    // a joint that nothing drives and no spring holds
    let mut model = smooth_arm();
    model.bodies[2].joint.limits.effort = 0.0;
    let demand = GainDemand { period: 1e-6, ..GainDemand::of(3) };
    let failure = propose(&model, &arm_motion(), &demand).unwrap_err();
    assert!(failure.why.contains("steps") && failure.help.unwrap().contains("a longer period"));
    let mut driven = cart();
    driven.drives = vec![crate::common::drive(
        "motor",
        straightline_core::drive::Motor {
            resistance: 1.0,
            inductance: None,
            torque_constant: 0.1,
            emf_constant: 0.1,
            rotor_inertia: 1e-4,
            friction: 0.0,
        },
        &[(0, 10.0)],
    )];
    let failure = propose(&driven, &cart_motion(), &GainDemand::of(1)).unwrap_err();
    assert!(failure.why.contains("the robot has drives"), "{failure}");
}
