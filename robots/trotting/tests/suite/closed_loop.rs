//! What the controller does with the simulated robot. No clock: a sweep takes as long as it takes.

use straightline::control::Outcome;
use straightline_trotting_example::closed_loop::{run, summary, Feedback, Push, Sample, Scenario, EXAMPLE};
use straightline_trotting_example::controller::Controller;
use straightline_trotting_example::gait::STEP;
use straightline_trotting_example::quadruped::{
    after, generalized_forces, Mode, Slopes, State, JOINTS, NV, STANDING, TORQUE,
};
use straightline_trotting_example::task::Weights;

/// A load, pushes, ground that gives way: the trunk stays on its way, and comes back to it.
#[test]
fn the_trunk_stays_on_its_way_and_comes_back_after_pushes() {
    let found = summary(&EXAMPLE).unwrap();
    assert!(!found.fell(EXAMPLE.duration), "{found:?}");
    assert!(found.most.iter().all(|off| *off < 0.025) && found.lean < 0.02, "{found:?}");
    assert!(found.last.iter().all(|off| off.abs() < 2e-3), "{found:?}");
    // the second push moves it: the claim is not about nothing
    assert!(found.most[1] > 5e-3, "{found:?}");
    assert!(found.torque <= TORQUE && found.saturated == 0, "{found:?}");
    assert!(f64::from(found.outside) < 0.02 * f64::from(found.standing), "{found:?}");
}

/// Where nothing pushes, feet stay where they land, and forces within the cone that is counted on, but for moments of landing.
#[test]
fn feet_stay_where_they_land() {
    let found = summary(&Scenario { pushes: &[], ..EXAMPLE }).unwrap();
    assert!(!found.fell(EXAMPLE.duration) && found.slip < 1e-3, "{found:?}");
    assert!(f64::from(found.outside) < 0.01 * f64::from(found.standing), "{found:?}");
}

/// The same motion and torques with springs of the joints in place of gains: whatever they are, the trunk leans more, and is
/// farther off in the end.
#[test]
fn springs_of_the_joints_are_worse() {
    let gains = summary(&EXAMPLE).unwrap();
    let far = |off: [f64; 3]| off[0].hypot(off[1]);
    for (stiffness, damping) in [(3.0, 0.1), (6.0, 0.2), (12.0, 0.3)] {
        let springs = summary(&Scenario { feedback: Feedback::Joints(stiffness, damping), ..EXAMPLE }).unwrap();
        assert!(springs.lean > 5.0 * gains.lean, "{stiffness}: {springs:?} {gains:?}");
        assert!(far(springs.last) > 5.0 * far(gains.last), "{stiffness}: {springs:?} {gains:?}");
    }
}

/// Derivatives of the reactions are what keeps feet on the ground: pushed by 15 N, over half of what friction holds, the robot falls without
/// the costs that know of them.
#[test]
fn costs_of_cones_hold_the_robot_up() {
    let pushes = EXAMPLE.pushes.iter().map(|push| Push { force: [0.0, 15.0, 0.0], ..*push }).collect::<Vec<_>>();
    let pushed = Scenario { pushes: &pushes, ..EXAMPLE };
    let found = summary(&pushed).unwrap();
    assert!(!found.fell(pushed.duration) && found.most[1] < 0.04, "{found:?}");
    let without = summary(&Scenario { weights: Weights { cone: 0.0, ..Weights::DEFAULT }, ..pushed }).unwrap();
    assert!(without.fell(pushed.duration), "{without:?}");
}

/// The wrench that explains what the model does not is the weight of the load, m g and its moments m g y and m g x, once the robot stands.
#[test]
fn the_wrench_is_the_weight_of_the_load() {
    let mut last: Option<Sample> = None;
    run(&EXAMPLE, |controller, state| controller.sweep(state), |sample| last = Some(*sample)).unwrap();
    let (wrench, [x, y, _]) = (last.unwrap().wrench, EXAMPLE.at);
    let weight = 9.81 * EXAMPLE.load;
    let expected = [0.0, 0.0, -weight, -weight * y, weight * x, 0.0];
    for i in 0..6 {
        assert!((wrench[i] - expected[i]).abs() < 0.02, "{i}: {wrench:?} {expected:?}");
    }
}

/// A robot that is exactly the model but for a wrench, under torques that are not those that were foreseen: a twenty-fifth of the wrench is
/// found in one node, exactly, as q̈ is affine in τ.
#[test]
fn the_wrench_is_found_whatever_torques_acted() {
    let standing = State { q: STANDING, qd: [0.0; NV] };
    let mut controller = Controller::new(EXAMPLE.gait, Weights::DEFAULT, &standing);
    controller.sweep(&standing).unwrap();
    let mut lower = standing;
    lower.q[2] -= 0.01;
    let ([torques, others], wrench) =
        ([&standing, &lower].map(|state| controller.torques(0.0, state).0), [0.5, -0.3, -2.0, 0.1, 0.2, -0.05]);
    assert!((0..JOINTS).any(|i| (torques[i] - others[i]).abs() > 0.1), "{torques:?} {others:?}");
    let tau = generalized_forces(&wrench, &core::array::from_fn(|i| 0.5 * (torques[i] + others[i])));
    let next = after(&standing, &Slopes::of(Mode::Four, &standing, &tau).qdd, STEP);
    controller.sweep(&next).unwrap();
    for i in 0..6 {
        assert!((controller.wrench[i] - 0.04 * wrench[i]).abs() < 1e-9, "{:?}", controller.wrench);
    }
}

#[test]
fn a_state_that_is_no_number_stops_the_drives_and_is_forgotten() {
    let standing = State { q: STANDING, qd: [0.0; NV] };
    let mut controller = Controller::new(EXAMPLE.gait, Weights::DEFAULT, &standing);
    assert!(controller.sweep(&standing).is_some());
    for (entry, wrong) in [(2, f64::NAN), (9, f64::INFINITY), (4, f64::NAN)] {
        let mut state = standing;
        state.q[entry] = wrong;
        assert!(controller.sweep(&state).is_none());
        assert_eq!(controller.torques(0.0, &state), ([0.0; JOINTS], Outcome::NotFinite));
        assert!(controller.sweep(&standing).is_some());
        let (torques, outcome) = controller.torques(0.0, &standing);
        assert!(outcome == Outcome::Within && torques.iter().all(|tau| tau.abs() < 1.5), "{torques:?}");
    }
}
