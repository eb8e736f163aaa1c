//! The reduced form of a robot that takes a function the fewest operations: choices tried one by one, and counted.
//!
//! Which description of a body is cheaper depends on what else needs the same products, so it is not decided by a rule
//! but by counting the finished program. Bodies at the same depth of the tree (the thighs of a quadruped) choose alike.

use crate::compile::{optimised, Optimisations, Options};
use crate::function::{Function, Robot};
use crate::reduce::{lengths, reduce, Choice};
use crate::scene::Gravity;
use std::sync::{Arc, Mutex, PoisonError};
use straightline_core::model::BodyId;

/// Beyond so many velocity coordinates nothing is tried: on a chain of 20 joints it takes seconds.
const LARGE: usize = 18;
/// Units of length that are tried, the most frequent ones.
const UNITS: usize = 4;
/// Rounds over all choices; a round without gain is the last.
const ROUNDS: usize = 2;

/// What was found for a robot, by function and scene: searched once, used by every function that shares it.
#[derive(Clone, Debug, Default)]
pub struct Found(Arc<Mutex<Vec<(String, Choice)>>>);

impl Found {
    fn or_search(&self, key: String, search: impl FnOnce() -> Choice) -> Choice {
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, choice)) = known().iter().find(|(k, _)| *k == key) {
            return choice.clone();
        }
        let choice = search();
        known().push((key, choice.clone()));
        choice
    }
}

/// The robot in the reduced forms for this function: for torques those that serve inverse dynamics or the bias
/// force best.
pub fn choose(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Robot {
    use Function::*;
    let search = |function: Function| {
        // the search is for torques or the mass matrix, whatever becomes of forward dynamics
        let optimisations = Optimisations { cheaper: false, ..optimisations };
        let key = format!("{function:?} {:?} {optimisations:?}", options.scene);
        robot.found.or_search(key, || improved(robot, frames, function, options, optimisations))
    };
    match function {
        InverseDynamics => {
            let choice = search(InverseDynamics);
            robot.reduced_by(&choice, &choice)
        }
        BiasForce | VelocityForce | GravityForce => {
            let choice = search(BiasForce);
            robot.reduced_by(&choice, &choice)
        }
        MassMatrix => {
            let choice = search(MassMatrix);
            robot.reduced_by(&choice, &choice)
        }
        ForwardDynamics => {
            let (torques, mass_matrix) = (search(BiasForce), search(MassMatrix));
            // articulated bodies share more with frames that turn
            let plain = Choice::plain(&robot.model);
            let pairs =
                [(&torques, &mass_matrix), (&torques, &torques), (&mass_matrix, &mass_matrix), (&plain, &plain)];
            let robots = pairs.map(|(t, h)| robot.reduced_by(t, h));
            let cost = |r: &Robot| cost(r, frames, function, options, optimisations);
            robots.into_iter().min_by_key(cost).expect("there are four pairs")
        }
        _ => robot.clone(),
    }
}

/// Instructions with fused multiply-add, then operations.
fn cost(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> (usize, usize) {
    let counts = optimised(robot, frames, function, options, optimisations).counts();
    (counts.fma, counts.flops())
}

/// Greedy: every choice at every depth, kept where it saves.
fn improved(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Choice {
    let (reduced, bodies) = (&robot.reduced, &robot.reduced.bodies);
    let mut best = Choice::plain(&robot.model);
    for i in 0..bodies.len() {
        best.stays[i] = reduced.may_stay(i);
    }
    if robot.model.nv() > LARGE {
        return best;
    }
    let price = |choice: &Choice| cost(&robot.reduced_by(choice, choice), frames, function, options, optimisations);
    let mut least = price(&best);
    let mut depth = vec![0; bodies.len()];
    for (i, body) in bodies.iter().enumerate() {
        depth[i] = body.parent.map_or(0, |p| depth[p] + 1);
    }
    let deepest = depth.iter().copied().max().unwrap_or(0);
    let units = match options.scene.gravity == Gravity::Input || !options.scene.parameters.is_empty() {
        // the unit would have to be known where those are made
        true => Vec::new(),
        false => lengths(reduced).into_iter().take(UNITS).collect(),
    };
    type Flags = fn(&mut Choice) -> &mut Vec<bool>;
    let of_frames_and_parameters: [Flags; 5] = [
        |c| &mut c.stays,
        |c| &mut c.regrouped,
        |c| &mut c.vanish_at_parent[0],
        |c| &mut c.vanish_at_parent[1],
        |c| &mut c.vanish_at_parent[2],
    ];
    let of_motion: [Flags; 3] = [|c| &mut c.by_axis_acceleration, |c| &mut c.doubled[0], |c| &mut c.doubled[1]];
    let of_motion: &[Flags] = if function == Function::MassMatrix { &[] } else { &of_motion };
    for _ in 0..ROUNDS {
        let before = least;
        let mut attempt = |choice: Choice| {
            // many a choice changes nothing for this robot
            if reduce(&robot.model, &choice).0 != reduce(&robot.model, &best).0 {
                let price = price(&choice);
                if price < least {
                    (best, least) = (choice, price);
                }
            }
            best.clone()
        };
        let mut current = attempt(Choice { ..Choice::plain(&robot.model) });
        for d in (0..=deepest).rev() {
            let here: Vec<BodyId> = (0..bodies.len()).filter(|i| depth[*i] == d).collect();
            for flag in of_frames_and_parameters.iter().chain(of_motion) {
                let mut turned = current.clone();
                here.iter().for_each(|i| flag(&mut turned)[*i] ^= true);
                current = attempt(turned);
            }
        }
        for unit in &units {
            current = attempt(Choice { unit: *unit, ..current });
        }
        if least == before {
            break;
        }
    }
    best
}
