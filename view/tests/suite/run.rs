//! Runs from the columns of files, and the motion of a robot without a run.

use super::robots::{arm, hostile};
use straightline_view::ViewedRun;

fn columns(of: &[(&str, &[f64])]) -> Vec<(String, Vec<f64>)> {
    of.iter().map(|(name, numbers)| (name.to_string(), numbers.to_vec())).collect()
}

/// As `simulate` writes the arm.
fn simulated() -> Vec<(String, Vec<f64>)> {
    columns(&[
        ("t", &[0.0, 0.5]),
        ("q.to_column", &[0.1, 0.2]),
        ("q.to_upper", &[0.3, -0.4]),
        ("q.to_slide", &[0.05, 0.06]),
        ("q.to_hand.qx", &[0.0, 3.0]),
        ("q.to_hand.qy", &[0.0, 0.0]),
        ("q.to_hand.qz", &[0.0, 4.0]),
        ("q.to_hand.qw", &[2.0, 0.0]),
        ("tau.to_upper", &[7.0, 8.0]),
    ])
}

#[test]
fn columns_of_a_simulation_are_coordinates_and_quaternions_have_length_one() {
    let run = ViewedRun::of_columns(&arm(), &simulated()).unwrap();
    assert_eq!(run.configurations, [[0.1, 0.3, 0.05, 0.0, 0.0, 0.0, 1.0], [0.2, -0.4, 0.06, 0.6, 0.0, 0.8, 0.0]]);
    assert_eq!(run.columns.len(), simulated().len() - 1, "all but the time are plotted");
}

#[test]
fn joints_may_be_named_without_a_prefix() {
    let mut given = simulated();
    given[2].0 = "to_upper".into();
    assert_eq!(ViewedRun::of_columns(&arm(), &given).unwrap().configurations[1][1], -0.4);
}

#[test]
fn all_that_is_missing_is_said_at_once() {
    let mut given = simulated();
    given.retain(|(name, _)| name != "q.to_column" && name != "q.to_hand.qz");
    let failures = ViewedRun::of_columns(&arm(), &given).unwrap_err();
    let said: Vec<String> = failures.iter().map(ToString::to_string).collect();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(["`q.to_column`", "`q.to_hand.qz`", "`q.to_slide`"].iter().all(|name| said[0].contains(name)), "{said:?}");
    let failures = ViewedRun::of_columns(&arm(), &columns(&[("x", &[1.0])])).unwrap_err();
    assert!(failures[0].what.contains("`t`"), "{failures:?}");
}

#[test]
fn a_run_without_its_base_is_drawn_with_a_still_one_and_says_so() {
    let names = hostile().bodies.iter().map(|body| body.joint.name.clone()).collect::<Vec<_>>();
    let given = columns(&[
        ("t", &[0.0, 1.0]),
        (&format!("q.{}", names[1]), &[0.1, 0.2]),
        (&format!("q.{}", names[2]), &[0.3, 0.4]),
    ]);
    let run = ViewedRun::of_columns(&hostile(), &given).unwrap();
    assert_eq!(run.configurations[1], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.2, 0.4]);
    assert!(run.notes[0].contains("says nothing of the base"), "{:?}", run.notes);
}

#[test]
fn numbers_that_cannot_be_drawn_are_refused() {
    let with = |name: &str, k: usize, value: f64| {
        let mut given = simulated();
        given.iter_mut().find(|(n, _)| n == name).unwrap().1[k] = value;
        ViewedRun::of_columns(&arm(), &given).unwrap_err()[0].to_string()
    };
    assert!(with("t", 1, -0.5).contains("time goes from 0.0 s to -0.5 s"));
    assert!(with("tau.to_upper", 1, f64::NAN).contains("at t = 0.5 s `tau.to_upper` is NaN"));
    assert!(with("q.to_hand.qw", 0, 0.0).contains("the quaternion of to_hand has no length"));
}

#[test]
fn without_a_run_every_joint_reaches_both_limits_in_its_turn() {
    let arm = arm();
    let run = ViewedRun::tour(&arm);
    // three single coordinates and a ball's three, two seconds each
    assert_eq!(*run.times.last().unwrap(), 12.0);
    for k in [0, 1] {
        let ends = |worst: f64, f: fn(f64, f64) -> f64| run.configurations.iter().map(|q| q[k]).fold(worst, f);
        assert_eq!((ends(9.0, f64::min), ends(-9.0, f64::max)), (-1.2, 2.1));
    }
    let moving = |q: &[f64]| (0..4).filter(|k| q[*k].abs() > 1e-12).count();
    assert!(run.configurations.iter().filter(|q| q[3..7] == [0.0, 0.0, 0.0, 1.0]).all(|q| moving(q) <= 1));
    let turned = run.configurations.iter().map(|q| q[6]).fold(1.0, f64::min);
    assert!((turned - 0.5f64.sqrt()).abs() < 1e-12, "a quarter turn is an angle of π/4 in the quaternion: {turned}");
    assert_eq!(run.configurations.last(), run.configurations.first());
}
