//! Modes, swings and ways of feet.

use straightline_trotting_example::gait::{on_its_way, Gait, HALF, PLACES, STEP, SWING};
use straightline_trotting_example::quadruped::{feet, Mode, State, FEET, NV, STANDING};

const GAIT: Gait = Gait { first: 5, swings: 4, speed: [0.3, -0.1] };

#[test]
fn diagonals_swing_in_turn_and_all_feet_stand_before_between_and_after() {
    for node in -10..GAIT.first + GAIT.swings * HALF + 60 {
        let flying = (0..FEET).filter(|foot| GAIT.swing(node, *foot).is_some()).count();
        let since = node - GAIT.first;
        let is_walk = (0..GAIT.swings * HALF).contains(&since);
        assert_eq!(flying, if is_walk && since % HALF < SWING { 2 } else { 0 }, "node {node}");
    }
    let lifts = |k: i64| GAIT.mode(GAIT.first + k * HALF);
    assert_eq!([lifts(0), lifts(1), lifts(2)], [Mode::FallingDiagonal, Mode::RisingDiagonal, Mode::FallingDiagonal]);
}

/// The corners are where the standing robot has its feet: to the 0.1 mm to which its height is written.
#[test]
fn the_standing_robot_has_its_feet_at_the_corners() {
    for (found, expected) in feet(&STANDING).iter().zip(PLACES) {
        assert!((0..3).all(|i| (found[i] - expected[i]).abs() < 1e-4), "{found:?} {expected:?}");
    }
}

#[test]
fn the_trunk_goes_as_fast_as_its_place_changes() {
    for node in GAIT.first - 5..GAIT.first + GAIT.swings * HALF + 5 {
        let ([before, here, after], speed) =
            ([node - 1, node, node + 1].map(|node| GAIT.trunk(node).0), GAIT.trunk(node).1);
        for i in 0..3 {
            let rate = (after[i] - before[i]) / (2.0 * STEP);
            // two per cent of a speed in a node of its ramp
            assert!((rate - speed[i]).abs() < 1e-3, "node {node}: {here:?} {rate} {}", speed[i]);
        }
    }
}

/// A trunk that is off its way, or too fast, takes its footholds along.
#[test]
fn a_foot_lands_under_the_trunk_and_further_where_it_drifts() {
    let mut state = State { q: STANDING, qd: [0.0; NV] };
    let at = |state: &State| GAIT.foothold(1, GAIT.first + SWING, GAIT.first, state);
    let still = at(&state);
    state.qd[1] = 0.2;
    state.q[0] += 0.01;
    let drifting = at(&state);
    assert!((drifting[0] - still[0] - 0.01).abs() < 1e-12 && (drifting[1] - still[1] - 0.2 * 0.15).abs() < 1e-12);
    let (from, to) = (PLACES[1], still);
    assert_eq!(on_its_way(&from, &to, 0.0), from);
    let end = on_its_way(&from, &to, 1.0);
    assert!((end[0] - to[0]).abs() + (end[1] - to[1]).abs() < 1e-12 && (-1e-3..=0.0).contains(&end[2]));
    assert!(on_its_way(&from, &to, 0.5)[2] > 0.03);
}
