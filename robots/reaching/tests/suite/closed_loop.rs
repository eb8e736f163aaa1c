//! What the controller does with a simulated arm. No clock: a sweep takes as long as it takes.

use straightline_reaching_example::arm::{panda, HAND, SPEED, TORQUE};
use straightline_reaching_example::closed_loop::{run, Goal, Push, Sample, Scenario, EXAMPLE};
use straightline_reaching_example::NV;

fn samples(scenario: &Scenario) -> Vec<Sample> {
    let mut samples = Vec::new();
    run(scenario, |solver, task, x| solver.sweep(task, x), |sample| samples.push(*sample)).unwrap();
    samples
}

fn away(sample: &Sample) -> f64 {
    (0..3).map(|i| (sample.points[HAND][i] - sample.goal[i]).powi(2)).sum::<f64>().sqrt()
}

/// Torques, ranges and speeds, at every millisecond.
fn keeps_limits(samples: &[Sample]) {
    for Sample { time, x, tau, .. } in samples {
        for i in 0..NV {
            assert!(tau[i].abs() <= TORQUE[i], "t = {time}: torque {i} is {}", tau[i]);
            assert!(
                (panda::LOWER_LIMITS[i]..=panda::UPPER_LIMITS[i]).contains(&x[i]),
                "t = {time}: joint {i} is at {}",
                x[i]
            );
            assert!(x[NV + i].abs() <= SPEED[i], "t = {time}: joint {i} turns at {}", x[NV + i]);
        }
    }
}

#[test]
fn the_hand_reaches_every_goal_and_the_arm_touches_no_sphere() {
    let samples = samples(&EXAMPLE);
    keeps_limits(&samples);
    let nearest = samples.iter().map(|s| s.clearance).fold(f64::INFINITY, f64::min);
    assert!(nearest > 0.01, "{nearest} m from a sphere");
    for (k, goal) in EXAMPLE.goals.iter().enumerate() {
        let until = EXAMPLE.goals.get(k + 1).map_or(EXAMPLE.duration, |next| next.from);
        let last = samples.iter().rfind(|s| (goal.from..until).contains(&s.time)).unwrap();
        // the tool that nobody told the controller about is no offset: the observer knows its weight
        assert!(away(last) < 2e-3, "goal {}: {} m away", k + 1, away(last));
    }
}

/// Without spheres the hand passes where they were: they are in the way, and it is the cost of nearness that keeps the arm away.
#[test]
fn spheres_are_in_the_way() {
    let straight = samples(&Scenario { spheres: &[], tool: 0.0, pushes: &[], ..EXAMPLE });
    let nearest = straight
        .iter()
        .map(|s| straightline_reaching_example::arm::clearance(&s.points, EXAMPLE.spheres))
        .fold(f64::INFINITY, f64::min);
    assert!(nearest < -0.02, "{nearest} m");
}

#[test]
fn a_push_at_the_hand_is_answered_and_dies_out() {
    let (goals, pushes) =
        ([Goal { from: 0.0, hand: [0.5, 0.1, 0.4] }], [Push { from: 1.2, until: 1.3, force: [30.0, -40.0, 20.0] }]);
    let scenario = Scenario { goals: &goals, pushes: &pushes, spheres: &[], duration: 2.5, ..EXAMPLE };
    let samples = samples(&scenario);
    keeps_limits(&samples);
    let at = |t: f64| away(samples.iter().find(|s| s.time >= t).unwrap());
    let worst = samples.iter().filter(|s| s.time > 1.2).map(away).fold(0.0, f64::max);
    assert!(at(1.19) < 3e-3, "before the push {} m", at(1.19));
    assert!(worst > 5e-3, "the push does nothing: {worst} m");
    assert!(at(2.49) < 2e-3 && at(2.49) < 0.3 * worst, "{worst} m, in the end {} m", at(2.49));
}
