//! The reduced form of a robot that takes a function the fewest operations: choices tried one by one, and counted.
//!
//! Which description of a body is cheaper depends on what else needs the same products, so it is not decided by a rule
//! but by counting the finished program. Bodies at the same depth of the tree (the thighs of a quadruped) choose alike.

use crate::compile::{candidate_counts, Optimisations, Options};
use crate::expr::Counts;
use crate::function::{DriveFunction, Function, Robot};
use crate::reduce::{lengths, reduce, Choice};
use crate::scene::{Contacts, Gravity, Scene};
use rustc_hash::{FxHashSet, FxHasher};
use std::hash::{Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};
use straightline_core::reduced::ReducedModel;
use straightline_core::Dd;

/// After so many operations in all programs that were counted a search ends with the best so far: some tenths of a second.
const ENOUGH: usize = 300_000;
/// Units of length that are tried, the most frequent ones.
const UNITS: usize = 24;

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
        // contacts leave torques and H as they are
        let scene = Scene { contacts: Contacts::default(), ..options.scene.clone() };
        let key = format!("{function:?} {scene:?} {optimisations:?}");
        robot.found.or_search(key, || improved(robot, frames, function, options, optimisations))
    };
    match function {
        InverseDynamics | Drive(DriveFunction::InverseDynamics) => {
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
        Drive(DriveFunction::Energy) => robot.clone(),
        Drive(DriveFunction::CompleteModel | DriveFunction::StateSpace | DriveFunction::Power) => {
            robot.reduced_by(&search(BiasForce), &search(MassMatrix))
        }
        ForwardDynamics | Drive(DriveFunction::ForwardDynamics | DriveFunction::Torques) => {
            let (torques, mass_matrix) = (search(BiasForce), search(MassMatrix));
            // articulated bodies share more with frames that turn
            let plain = Choice { adds_angles: optimisations.angle_sums, ..Choice::plain(&robot.model) };
            let pairs =
                [(&torques, &mass_matrix), (&torques, &torques), (&mass_matrix, &mass_matrix), (&plain, &plain)];
            let robots = pairs.map(|(t, h)| robot.reduced_by(t, h));
            let cost = |r: &Robot| price(candidate_counts(r, frames, function, options, optimisations).0);
            robots.into_iter().min_by_key(cost).expect("there are four pairs")
        }
        _ => robot.clone(),
    }
}

/// What is least: operations and instructions with fused multiply-add together, as either may be what a machine does; then
/// instructions.
type Price = (usize, usize);

/// As many instructions a pair of sine and cosine, or a division, weighs; in lanes a pair takes about so long.
const PAIR: usize = 10;

fn price(counts: Counts) -> Price {
    (counts.fma + counts.flops() + 2 * PAIR * (counts.sin_cos + counts.div), counts.fma)
}

/// A search for one function: the best choice so far, and what was tried.
struct Search<'a> {
    /// Its reduced forms are those that were tried last.
    robot: Robot,
    frames: &'a [String],
    function: Function,
    options: &'a Options,
    optimisations: Optimisations,
    best: Choice,
    least: Price,
    /// Hashes of the reduced robots that were tried: many a choice changes nothing for this robot, or leads back.
    tried: FxHashSet<u64>,
    /// Operations that were counted.
    work: usize,
}

impl Search<'_> {
    /// Takes the choice if it saves.
    fn attempt(&mut self, choice: Choice) {
        let reduced = reduce(&self.robot.model, &choice).0;
        if !self.tried.insert(fingerprint(&reduced)) {
            return;
        }
        self.robot.composite.clone_from(&reduced);
        self.robot.reduced = reduced;
        let (counts, work) =
            candidate_counts(&self.robot, self.frames, self.function, self.options, self.optimisations);
        self.work += work;
        let price = price(counts);
        if price < self.least {
            (self.best, self.least) = (choice, price);
        }
    }
}

/// A hash of all numbers and switches.
fn fingerprint(reduced: &ReducedModel<Dd>) -> u64 {
    let mut hasher = FxHasher::default();
    for body in &reduced.bodies {
        let switches = [body.stays, body.by_axis_acceleration, body.doubled[0], body.doubled[1]];
        switches.hash(&mut hasher);
        body.phase.is_some().hash(&mut hasher);
    }
    reduced.adds_angles.hash(&mut hasher);
    let _ = reduced.map(|x| {
        (x.hi().to_bits(), x.lo().to_bits()).hash(&mut hasher);
        x
    });
    hasher.finish()
}

/// Greedy: every choice at every depth, kept where it saves, until none does or enough was tried.
fn improved(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Choice {
    let (reduced, bodies) = (&robot.reduced, &robot.reduced.bodies);
    let plain = Choice { adds_angles: optimisations.angle_sums, ..Choice::plain(&robot.model) };
    let forms = optimisations.forms;
    let stays = (0..bodies.len()).map(|i| forms.stays && reduced.may_stay(i)).collect();
    let first = Choice { stays, ..plain.clone() };
    let mut search = Search {
        robot: robot.clone(),
        frames,
        function,
        options,
        optimisations,
        best: first.clone(),
        least: (usize::MAX, usize::MAX),
        tried: FxHashSet::default(),
        work: 0,
    };
    search.attempt(first);
    search.attempt(plain);
    let mut depth = vec![0; bodies.len()];
    for (i, body) in bodies.iter().enumerate() {
        depth[i] = body.parent.map_or(0, |p| depth[p] + 1);
    }
    let deepest = depth.iter().copied().max().unwrap_or(0);
    // the unit would have to be known where gravity or parameters are made
    let fixed_unit = !forms.unit || options.scene.gravity == Gravity::Input || !options.scene.parameters.is_empty();
    // so would the frames in which parameters are given
    let fixed_frames = !options.scene.parameters.is_empty();
    type Flags = fn(&mut Choice) -> &mut Vec<bool>;
    let all: [(bool, Flags); 11] = [
        (forms.stays, |c| &mut c.stays),
        (forms.origins && !fixed_frames, |c| &mut c.origin_at_parent),
        (forms.tips && !fixed_frames, |c| &mut c.turned_tips[0]),
        (forms.tips && !fixed_frames, |c| &mut c.turned_tips[1]),
        (forms.parameters, |c| &mut c.regrouped),
        (forms.parameters, |c| &mut c.vanish_at_parent[0]),
        (forms.parameters, |c| &mut c.vanish_at_parent[1]),
        (forms.parameters, |c| &mut c.vanish_at_parent[2]),
        (forms.rotations, |c| &mut c.by_axis_acceleration),
        (forms.rotations, |c| &mut c.doubled[0]),
        (forms.rotations, |c| &mut c.doubled[1]),
    ];
    let flags: Vec<Flags> = all.into_iter().filter(|(free, _)| *free).map(|(_, flag)| flag).collect();
    let units_of = |choice: &Choice| match fixed_unit {
        true => Vec::new(),
        false => lengths(&reduce(&robot.model, &Choice { unit: Dd::ONE, ..choice.clone() }).0),
    };
    let turn = |choice: &mut Choice, flag: Flags, d: usize| {
        (0..bodies.len()).filter(|i| depth[*i] == d).for_each(|i| flag(choice)[i] ^= true);
    };
    loop {
        let before = search.least;
        for d in (0..=deepest).rev() {
            for flag in &flags {
                let mut turned = search.best.clone();
                turn(&mut turned, *flag, d);
                search.attempt(turned);
            }
            if search.work > ENOUGH {
                return search.best;
            }
        }
        for unit in units_of(&search.best).into_iter().take(UNITS) {
            search.attempt(Choice { unit, ..search.best.clone() });
        }
        if search.least == before {
            return search.best;
        }
    }
}
