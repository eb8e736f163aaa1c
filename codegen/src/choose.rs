//! The reduced form of a robot that takes a function the fewest operations: choices tried one by one, and counted.
//!
//! Which description of a body is cheaper depends on what else needs the same products, so it is not decided by a rule
//! but by counting the finished program. Bodies at the same depth of the tree (the thighs of a quadruped) choose alike.

use crate::compile::{candidate_counts, Forms, Optimisations, Options};
use crate::emit::Scalar;
use crate::expr::{Counts, Graph};
use crate::forward_method;
use crate::function::{DriveFunction, Function, Robot};
use crate::reduce::{lengths, reduce, Choice};
use crate::rounding;
use crate::scene::{Contacts, Gravity, Scene};
use rustc_hash::{FxHashMap, FxHasher};
use std::hash::{Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};
use straightline_core::reduced::ReducedModel;
use straightline_core::Dd;

/// After so many operations in all programs that were counted a search ends with the best so far: some tenths of a second.
const ENOUGH: usize = 300_000;
/// So many more from neighbours of the best, where the search came to its end.
const MORE: usize = 300_000;
/// A form may lose so many times what the plain one does: two samples of the same form come as far apart.
const TOLERATED: f64 = 1.75;
/// The same in f32, which has fewer digits to lose.
const TOLERATED_SINGLE: f64 = 1.25;
/// At so many states that is estimated.
const STATES: usize = 4;
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

/// Of what is not wanted at any price.
const NEVER: Price = (usize::MAX, usize::MAX);

fn price(counts: Counts) -> Price {
    (counts.fma + counts.flops() + 2 * PAIR * (counts.sin_cos + counts.div), counts.fma)
}

/// A search for one function, and what was tried.
struct Search<'a> {
    /// Its reduced forms are those that were tried last.
    robot: Robot,
    frames: &'a [String],
    function: Function,
    options: &'a Options,
    optimisations: Optimisations,
    /// What the reduced robots cost that were tried, by their hashes: many a choice changes nothing for this robot, or leads back.
    tried: FxHashMap<u64, Price>,
    /// Operations that were counted.
    work: usize,
    /// What the plain form loses to rounding, or the bodies' own parameters if that is less, once it was asked for; `None` in it:
    /// nobody knows.
    plain_error: Option<Option<[f64; 2]>>,
}

impl Search<'_> {
    /// The reduced robot of a choice is looked at from here on, and known by this hash.
    fn set(&mut self, choice: &Choice) -> u64 {
        let reduced = reduce(&self.robot.model, choice).0;
        let hash = fingerprint(&reduced);
        self.robot.composite.clone_from(&reduced);
        self.robot.reduced = reduced;
        hash
    }

    /// What a choice costs, if it is worth a look: it was not tried before, is cheaper than that, and keeps its digits.
    fn attempt(&mut self, choice: &Choice, least: Price) -> Option<Price> {
        let hash = self.set(choice);
        if self.tried.contains_key(&hash) {
            return None;
        }
        let (counts, graph) = self.counted();
        let mut cost = price(counts);
        if cost < least && !self.keeps_digits(&graph) {
            cost = NEVER;
        }
        self.tried.insert(hash, cost);
        (cost < least).then_some(cost)
    }

    fn counted(&mut self) -> (Counts, Graph) {
        let counted = candidate_counts(&self.robot, self.frames, self.function, self.options, self.optimisations);
        self.work += counted.1.ops.len();
        counted
    }

    /// Whether these equations lose about as little as those of the plain form, and those of the bodies' own parameters.
    fn keeps_digits(&mut self, graph: &Graph) -> bool {
        let plain = match self.plain_error {
            Some(known) => known,
            None => {
                let (composite, reduced) = (self.robot.composite.clone(), self.robot.reduced.clone());
                self.set(&Choice::plain(&self.robot.model));
                let (_, plain) = self.counted();
                let of_bodies = Optimisations { reduced: false, ..self.optimisations };
                let (_, of_bodies) = candidate_counts(&self.robot, self.frames, self.function, self.options, of_bodies);
                let both = self.error(&plain).zip(self.error(&of_bodies));
                let plain = both.map(|(a, b)| [a[0].min(b[0]), a[1].min(b[1])]);
                (self.robot.composite, self.robot.reduced) = (composite, reduced);
                self.plain_error = Some(plain);
                plain
            }
        };
        let pair = plain.and_then(|plain| self.error(graph).zip(Some(plain)));
        let times = match self.options.scalar {
            Scalar::F64 => TOLERATED,
            Scalar::F32 => TOLERATED_SINGLE,
        };
        pair.is_none_or(|(mine, plain)| (0..2).all(|k| mine[k] <= times * plain[k]))
    }

    /// What equations lose to rounding, at about rest and as fast as the joints may move.
    fn error(&self, graph: &Graph) -> Option<[f64; 2]> {
        let states = |fast| forward_method::states(&self.robot.model, &graph.inputs, STATES, fast);
        let (slow, fast) = states(false).zip(states(true))?;
        Some([slow, fast].map(|states| rounding::estimate(graph, &states)))
    }

    /// Greedy: every choice at every depth, kept where it saves, until none does or enough was tried.
    fn descend(&mut self, from: (Choice, Price), enough: usize, ways: &Ways) -> (Choice, Price) {
        let (mut best, mut least) = from;
        let deepest = ways.depth.iter().copied().max().unwrap_or(0);
        loop {
            let before = least;
            for d in (0..=deepest).rev() {
                for change in &ways.moves {
                    let changed = ways.moved(&best, change, d);
                    if let Some(price) = self.attempt(&changed, least) {
                        (best, least) = (changed, price);
                    }
                }
                if self.work > enough {
                    return (best, least);
                }
            }
            for unit in ways.units(&self.robot, &best) {
                let changed = Choice { unit, ..best.clone() };
                if let Some(price) = self.attempt(&changed, least) {
                    (best, least) = (changed, price);
                }
            }
            if least == before {
                return (best, least);
            }
        }
    }
}

/// A hash of all numbers and switches.
fn fingerprint(reduced: &ReducedModel<Dd>) -> u64 {
    let mut hasher = FxHasher::default();
    for body in &reduced.bodies {
        let switches = [body.stays, body.by_axis_acceleration, body.doubled[0], body.doubled[1]];
        switches.hash(&mut hasher);
        body.by_accelerations.hash(&mut hasher);
        body.phase.is_some().hash(&mut hasher);
    }
    reduced.adds_angles.hash(&mut hasher);
    let _ = reduced.map(|x| {
        (x.hi().to_bits(), x.lo().to_bits()).hash(&mut hasher);
        x
    });
    hasher.finish()
}

/// A change of one body's form; made again, it is taken back.
type Move = Box<dyn Fn(&mut Choice, usize)>;

fn moves(options: &Options, forms: Forms) -> Vec<Move> {
    type Flags = fn(&mut Choice) -> &mut Vec<bool>;
    // the frames in which parameters are given would have to be known where they are made
    let frames = options.scene.parameters.is_empty();
    let all: [(bool, Flags); 13] = [
        (forms.stays, |c| &mut c.stays),
        (forms.origins && frames, |c| &mut c.origin_at_parent),
        (forms.tips && frames, |c| &mut c.turned_tips[0]),
        (forms.tips && frames, |c| &mut c.turned_tips[1]),
        (forms.tips && frames, |c| &mut c.turned_tips[2]),
        (forms.tips && frames, |c| &mut c.shifted_tips[0]),
        (forms.tips && frames, |c| &mut c.shifted_tips[1]),
        (forms.parameters, |c| &mut c.regrouped),
        (forms.rotations, |c| &mut c.by_axis_acceleration),
        (forms.rotations, |c| &mut c.by_accelerations[0]),
        (forms.rotations, |c| &mut c.by_accelerations[1]),
        (forms.rotations, |c| &mut c.doubled[0]),
        (forms.rotations, |c| &mut c.doubled[1]),
    ];
    let flips = all.into_iter().filter(|(free, _)| *free);
    let mut moves: Vec<Move> =
        flips.map(|(_, flag)| Box::new(move |c: &mut Choice, i: usize| flag(c)[i] ^= true) as Move).collect();
    for (kind, component) in (0..9).map(|k| (k / 3, k % 3)).filter(|_| forms.parameters) {
        moves.push(Box::new(move |c: &mut Choice, i: usize| {
            let vanishes = &mut c.vanish_at_parent[kind][i];
            *vanishes = if *vanishes == Some(component) { None } else { Some(component) };
        }));
    }
    moves
}

/// What may change.
struct Ways {
    moves: Vec<Move>,
    /// How many joints stand before each body.
    depth: Vec<usize>,
    fixed_unit: bool,
}

impl Ways {
    fn moved(&self, choice: &Choice, change: &Move, depth: usize) -> Choice {
        let mut changed = choice.clone();
        (0..self.depth.len()).filter(|i| self.depth[*i] == depth).for_each(|i| change(&mut changed, i));
        changed
    }

    fn units(&self, robot: &Robot, choice: &Choice) -> Vec<Dd> {
        if self.fixed_unit {
            return Vec::new();
        }
        let mut units = lengths(&reduce(&robot.model, &Choice { unit: Dd::ONE, ..choice.clone() }).0);
        units.truncate(UNITS);
        units
    }
}

/// The cheapest form that greedy steps lead to, from the plain form and, for a robot of few joints, from neighbours of what
/// was found: origins that move for many parameters at once.
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
        tried: FxHashMap::default(),
        work: 0,
        plain_error: None,
    };
    let mut depth = vec![0; bodies.len()];
    for (i, body) in bodies.iter().enumerate() {
        depth[i] = body.parent.map_or(0, |p| depth[p] + 1);
    }
    let deepest = depth.iter().copied().max().unwrap_or(0);
    // the unit would have to be known where gravity or parameters are made
    let fixed_unit = !forms.unit || options.scene.gravity == Gravity::Input || !options.scene.parameters.is_empty();
    let ways = Ways { moves: moves(options, forms), depth, fixed_unit };
    let mut best = (plain, NEVER);
    for choice in [first, best.0.clone()] {
        if let Some(price) = search.attempt(&choice, best.1) {
            best = (choice, price);
        }
    }
    best = search.descend(best, ENOUGH, &ways);
    let enough = if search.work > ENOUGH { search.work } else { search.work + MORE };
    let origins: Move = Box::new(|c, i| c.origin_at_parent[i] ^= true);
    for d in (0..=deepest).filter(|_| forms.origins && options.scene.parameters.is_empty()) {
        if search.work >= enough {
            break;
        }
        let moved = ways.moved(&best.0, &origins, d);
        let hash = search.set(&moved);
        let Some(price) = search.tried.get(&hash).copied().filter(|price| *price < NEVER) else { continue };
        let found = search.descend((moved, price), enough, &ways);
        if found.1 < best.1 {
            best = found;
        }
    }
    best.0
}
