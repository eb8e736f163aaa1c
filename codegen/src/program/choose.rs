//! The reduced form of a robot that takes a function the fewest operations: choices tried one by one, and counted.
//!
//! Which description of a body is cheaper depends on what else needs the same products, so it is not decided by a rule
//! but by counting the finished program. Bodies at the same depth of the tree (the thighs of a quadruped) choose alike.

mod ways;

use crate::equations::reduce::{is_in_proportion, reduce, FreeTerms};
use crate::equations::traced::candidate;
use crate::equations::Robot;
use crate::function::{Form, Function};
use crate::model::states;
use crate::options::stable::Stable;
use crate::options::{Optimisations, Options};
use crate::scene::{Gravity, Scene, SceneContacts};
use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use std::hash::{Hash, Hasher};
use straightline_core::model::Model;
use straightline_core::reduced::ReducedModel;
use straightline_core::Dd;
use straightline_graph::expr::{Counts, Graph, DIVISION};
use straightline_graph::rounding;
use ways::{moves, Ways};

/// After so many operations in all programs that were counted a search ends with the best so far: some tenths of a second.
const ENOUGH: usize = 300_000;
/// So many more from neighbours of the best, where the search came to its end.
const MORE: usize = 300_000;
/// Neighbours of the best are looked at that cost so much more (half operations).
const SLACK: usize = 16;
/// A form may lose so many times what the plain one does: two samples of the same form come as far apart.
const TOLERATED: f64 = 1.5;
/// The same in f32, which has fewer digits to lose.
const TOLERATED_SINGLE: f64 = 1.25;
/// Values formed of others may lose so many times what they did, all together.
const TOLERATED_LOCALLY: f64 = 1.1;
/// At so many states that is estimated.
const STATES: usize = 4;

/// The robot in the reduced forms for this function: for torques those that serve inverse dynamics or the bias
/// force best.
pub fn choose(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Robot {
    let chosen = chosen(robot, frames, function, options, optimisations);
    #[cfg(feature = "internals")]
    let chosen = crate::program::equivalence::sabotage::formed(chosen);
    chosen
}

fn chosen(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Robot {
    use Function::{BiasForce, InverseDynamics, InverseDynamicsDerivatives, MassMatrix};
    let search_from = |function: Function, known: &[FreeTerms]| {
        // the search is for torques or the mass matrix, whatever becomes of forward dynamics
        let optimisations = Optimisations { cheaper: false, ..optimisations };
        // contacts leave torques and H as they are
        let scene = Scene { contacts: SceneContacts::default(), ..options.scene.clone() };
        let key = ((function, scene), optimisations, options.scalar).stable_text();
        robot.found.or_search(key, || improved(robot, frames, function, options, optimisations, known))
    };
    let search = |function| search_from(function, &[]);
    let both = |choice: FreeTerms| robot.reduced_by(&choice, &choice);
    match function.spec().form {
        Form::Plain => robot.clone(),
        Form::Regressor => both(search(function)),
        Form::InverseDynamics => both(search(InverseDynamics)),
        Form::BiasForce => both(search(BiasForce)),
        Form::MassMatrix => both(search(MassMatrix)),
        Form::Derivatives => {
            let known = [search(InverseDynamics), search(MassMatrix)];
            // what is solved for afterwards is the same in any form
            let torques = if function.spec().solves { InverseDynamicsDerivatives } else { function };
            both(search_from(torques, &known))
        }
        Form::Both | Form::Motion => {
            let (torques, mass_matrix) = (search(BiasForce), search(MassMatrix));
            let mut pairs = vec![(&torques, &mass_matrix), (&torques, &torques), (&mass_matrix, &mass_matrix)];
            // articulated bodies share more with frames that turn
            let plain = plain(robot, options, optimisations);
            pairs.extend((function.spec().form == Form::Motion).then_some((&plain, &plain)));
            let robots: Vec<Robot> = pairs.into_iter().map(|(t, h)| robot.reduced_by(t, h)).collect();
            // one of the pairs, with the method that it gets, not a step on the way to something else
            let cost = |r: &Robot| {
                let (counts, _, method) = candidate(r, frames, function, options, optimisations);
                let other = (counts.flops() + DIVISION * (counts.div + counts.sqrt)) as f64;
                method.map_or(other, |m| m.weight()) + (PAIR * counts.sin_cos + counts.tail) as f64
            };
            let costs: Vec<f64> = robots.iter().map(cost).collect();
            let least = (0..robots.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).expect("there are pairs");
            robots[least].clone()
        }
    }
}

/// What is least: operations and instructions with fused multiply-add together, as either may be what a machine does; then
/// instructions. What keeps the digits of sums of angles weighs half: it is executed, but before the sines, which wait for the
/// longest sum anyway.
pub(crate) type Price = (usize, usize);

/// As many instructions a pair of sine and cosine weighs; in lanes it takes about so long.
const PAIR: usize = 10;

/// Of what is not wanted at any price.
const NEVER: Price = (usize::MAX, usize::MAX);

/// What operations cost.
pub(crate) fn price(counts: Counts) -> Price {
    let apart = 2 * (PAIR * counts.sin_cos + DIVISION * counts.div) + counts.tail;
    (counts.fma + counts.flops() + apart, counts.fma)
}

/// Whether equations lose hardly more than these; where run-time parameters are inputs nobody knows, and what is local must do.
pub(crate) fn keeps_digits_of<'g>(model: &'g Model<Dd>, graph: &'g Graph) -> impl Fn(&Graph) -> bool + 'g {
    let states = [false, true].map(|fast| states::states(model, &graph.inputs, STATES, fast));
    let before = states.each_ref().map(|s| {
        s.as_ref().map(|s| {
            let scales = rounding::scales(graph, s);
            (rounding::estimate(graph, s, &scales), scales)
        })
    });
    move |graph| {
        let mut both = states.iter().zip(&before);
        both.all(|(s, before)| {
            s.as_ref()
                .zip(before.as_ref())
                .is_none_or(|(s, (before, scales))| rounding::estimate(graph, s, scales) <= TOLERATED_LOCALLY * before)
        })
    }
}

/// What the plain form loses, and the scales of its outputs.
#[derive(Clone)]
struct PlainError {
    lost: f64,
    scales: Vec<f64>,
}

/// A search for one function, and what was tried.
struct FormSearch<'a> {
    /// Its reduced forms are those that were tried last.
    robot: Robot,
    frames: &'a [String],
    function: Function,
    options: &'a Options,
    optimisations: Optimisations,
    /// What the reduced robots cost that were tried, by their hashes: many a choice changes nothing for this robot, or leads back.
    tried: FxHashMap<u64, Price>,
    /// The hashes of the reduced robots of choices, by theirs.
    reduced: FxHashMap<u64, u64>,
    /// Operations that were counted.
    work: usize,
    /// What the plain form loses to rounding, or the bodies' own parameters if that is less, once it was asked for, and what it is compared
    /// with; `None` in it: nobody knows.
    plain_error: Option<Option<[PlainError; 2]>>,
}

impl FormSearch<'_> {
    /// By which hash the reduced robot of a choice is known.
    fn hash(&mut self, choice: &FreeTerms) -> u64 {
        let known = self.reduced.get(&choice.fingerprint()).copied();
        known.unwrap_or_else(|| self.set(choice))
    }

    /// The reduced robot of a choice is looked at from here on, and known by this hash.
    fn set(&mut self, choice: &FreeTerms) -> u64 {
        let reduced = reduce(&self.robot.model, choice).0;
        let hash = fingerprint(&reduced);
        self.reduced.insert(choice.fingerprint(), hash);
        self.robot.composite.clone_from(&reduced);
        self.robot.reduced = reduced;
        hash
    }

    /// What a choice costs, if it is worth a look: it was not tried before, is cheaper than that, and keeps its digits.
    fn attempt(&mut self, choice: &FreeTerms, least: Price) -> Option<Price> {
        let known = self.reduced.get(&choice.fingerprint());
        if known.is_some_and(|hash| self.tried.contains_key(hash)) {
            return None;
        }
        let hash = self.set(choice);
        if self.tried.contains_key(&hash) {
            return None;
        }
        let mut cost = NEVER;
        if is_in_proportion(&self.robot.model, &self.robot.reduced) {
            let (counts, graph) = self.counted();
            cost = price(counts);
            if cost < least && !self.keeps_digits(&graph) {
                cost = NEVER;
            }
        }
        self.tried.insert(hash, cost);
        (cost < least).then_some(cost)
    }

    fn counted(&mut self) -> (Counts, Graph) {
        let (counts, graph, _) = candidate(&self.robot, self.frames, self.function, self.options, self.optimisations);
        self.work += graph.ops.len();
        (counts, graph)
    }

    /// Whether these equations lose about as little as those of the plain form, and those of the bodies' own parameters.
    fn keeps_digits(&mut self, graph: &Graph) -> bool {
        let plain = match &self.plain_error {
            Some(known) => known.clone(),
            None => {
                let (composite, reduced) = (self.robot.composite.clone(), self.robot.reduced.clone());
                self.set(&FreeTerms::plain(&self.robot.model));
                let (_, plain) = self.counted();
                let of_bodies = Optimisations { reduced: false, ..self.optimisations };
                let (_, of_bodies, _) = candidate(&self.robot, self.frames, self.function, self.options, of_bodies);
                let states = self.states_of(&of_bodies);
                let plain = states.map(|states| {
                    states.map(|states| {
                        let scales = rounding::scales(&of_bodies, &states);
                        let lost = [&plain, &of_bodies].map(|graph| rounding::estimate(graph, &states, &scales));
                        PlainError { lost: lost[0].min(lost[1]), scales }
                    })
                });
                (self.robot.composite, self.robot.reduced) = (composite, reduced);
                self.plain_error = Some(plain.clone());
                plain
            }
        };
        let pair = plain.and_then(|plain| self.error(graph, &plain).zip(Some(plain)));
        let times = if self.options.scalar.is_short() { TOLERATED_SINGLE } else { TOLERATED };
        pair.is_none_or(|(mine, plain)| (0..2).all(|k| mine[k] <= times * plain[k].lost))
    }

    /// What equations lose to rounding, at about rest and as fast as the joints may move.
    fn error(&self, graph: &Graph, plain: &[PlainError; 2]) -> Option<[f64; 2]> {
        let states = self.states_of(graph)?;
        Some([0, 1].map(|k| rounding::estimate(graph, &states[k], &plain[k].scales)))
    }

    /// States of a program: at about rest, and as fast as the joints may move.
    fn states_of(&self, graph: &Graph) -> Option<[Vec<Vec<f64>>; 2]> {
        let states = |fast| states::states(&self.robot.model, &graph.inputs, STATES, fast);
        states(false).zip(states(true)).map(|(slow, fast)| [slow, fast])
    }

    /// Greedy: where fields and wrenches meet, by themselves; the frames hardly matter for that.
    fn met(&mut self, from: (FreeTerms, Price), ways: &Ways) -> (FreeTerms, Price) {
        let mut best = from;
        loop {
            let before = best.1;
            for meeting in ways.meetings(best.0.meeting) {
                let changed = FreeTerms { meeting, ..best.0.clone() };
                if let Some(price) = self.attempt(&changed, best.1) {
                    best = (changed, price);
                }
            }
            if best.1 == before {
                return best;
            }
        }
    }

    /// Greedy: every choice at every depth, kept where it saves, until none does or enough was tried; of the choices the first ones.
    fn descend(&mut self, from: (FreeTerms, Price), enough: usize, ways: &Ways, among: usize) -> (FreeTerms, Price) {
        let (mut best, mut least) = from;
        loop {
            let before = least;
            for d in (0..=ways.deepest()).rev() {
                for change in &ways.moves[..among] {
                    let changed = ways.moved(&best, change, d);
                    if let Some(price) = self.attempt(&changed, least) {
                        (best, least) = (changed, price);
                    }
                }
                if self.work > enough {
                    return (best, least);
                }
            }
            let units = ways.units(&self.robot, &best).into_iter().map(|unit| FreeTerms { unit, ..best.clone() });
            let other_angles = FreeTerms { adds_angles: !best.adds_angles, ..best.clone() };
            let meetings = ways.meetings(best.meeting).into_iter().map(|meeting| FreeTerms { meeting, ..best.clone() });
            let whole: Vec<FreeTerms> = units.chain(ways.angle_sums.then_some(other_angles)).chain(meetings).collect();
            for changed in whole {
                if let Some(price) = self.attempt(&changed, least) {
                    (best, least) = (changed, price);
                }
            }
            if least == before {
                return (best, least);
            }
        }
    }

    /// Greedy again from neighbours of the best, one change away and hardly dearer; origins first, which move many parameters at once.
    fn around(&mut self, mut best: (FreeTerms, Price), enough: usize, ways: &Ways) -> (FreeTerms, Price) {
        let mut left: FxHashSet<u64> = FxHashSet::default();
        'better: loop {
            // whether it is no origin, what it costs, and which change at which depth it is
            let mut neighbours: Vec<(bool, Price, usize, usize)> = Vec::new();
            for d in 0..=ways.deepest() {
                for (k, change) in ways.moves.iter().enumerate() {
                    let hash = self.hash(&ways.moved(&best.0, change, d));
                    let Some(price) = self.tried.get(&hash).copied().filter(|price| *price < NEVER) else { continue };
                    let origin = ways.origins == Some(k);
                    if origin || price.0 <= best.1 .0.saturating_add(SLACK) {
                        neighbours.push((!origin, price, d, k));
                    }
                }
            }
            neighbours.sort_unstable();
            for (_, price, d, k) in neighbours {
                if self.work >= enough {
                    return best;
                }
                let moved = ways.moved(&best.0, &ways.moves[k], d);
                let hash = self.hash(&moved);
                if !left.insert(hash) {
                    continue;
                }
                let found = self.descend((moved, price), enough, ways, ways.moves.len());
                if found.1 < best.1 {
                    best = found;
                    continue 'better;
                }
            }
            return best;
        }
    }
}

/// A hash of all numbers and switches.
fn fingerprint(reduced: &ReducedModel<Dd>) -> u64 {
    let mut hasher = FxHasher::default();
    for body in &reduced.bodies {
        let switches = [body.stays, body.turns_sums, body.shares_axis_field, body.by_axis_acceleration];
        (switches, body.doubled).hash(&mut hasher);
        body.by_accelerations.hash(&mut hasher);
        body.phase.is_some().hash(&mut hasher);
    }
    (reduced.adds_angles, reduced.meeting).hash(&mut hasher);
    let _ = reduced.map(|x| {
        (x.hi().to_bits(), x.lo().to_bits()).hash(&mut hasher);
        x
    });
    hasher.finish()
}

/// Khalil and Dombre's parameters, with sums of angles where they may be.
fn plain(robot: &Robot, options: &Options, optimisations: Optimisations) -> FreeTerms {
    let adds_offsets = !options.scalar.is_short();
    FreeTerms { adds_angles: optimisations.angle_sums, adds_offsets, ..FreeTerms::plain(&robot.model) }
}

/// The cheapest form that greedy steps lead to, from the plain form and, for a robot of few joints, from neighbours of what
/// was found: origins that move for many parameters at once.
fn improved(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
    known: &[FreeTerms],
) -> FreeTerms {
    let (reduced, bodies) = (&robot.reduced, &robot.reduced.bodies);
    let plain = plain(robot, options, optimisations);
    let forms = optimisations.forms;
    let stays = (0..bodies.len()).map(|i| forms.stays && reduced.may_stay(i)).collect();
    let first = FreeTerms { stays, ..plain.clone() };
    let mut search = FormSearch {
        robot: robot.clone(),
        frames,
        function,
        options,
        optimisations,
        tried: FxHashMap::default(),
        reduced: FxHashMap::default(),
        work: 0,
        plain_error: None,
    };
    let mut depth = vec![0; bodies.len()];
    for (i, body) in bodies.iter().enumerate() {
        depth[i] = body.parent.map_or(0, |p| depth[p] + 1);
    }
    // the unit would have to be known where gravity or parameters are made
    let is_regressor = function.spec().form == Form::Regressor;
    let has_known_frames = options.scene.has_loads() || is_regressor;
    let fixed_unit = !forms.unit || options.scene.gravity == Gravity::Input || has_known_frames;
    let origins = (forms.origins && !has_known_frames).then_some(usize::from(forms.stays));
    let ((moves, major), angle_sums) = (moves(options, forms, function), optimisations.angle_sums);
    let meets = matches!(function.spec().form, Form::Derivatives | Form::Regressor);
    let ways = Ways { moves, major, origins, depth, fixed_unit, angle_sums, meets };
    let mut best = (plain, NEVER);
    for choice in [first, best.0.clone()].iter().chain(known) {
        if let Some(price) = search.attempt(choice, best.1) {
            best = (choice.clone(), price);
        }
    }
    best = search.met(best, &ways);
    best = search.descend(best, ENOUGH, &ways, ways.major);
    let enough = if search.work > ENOUGH { search.work } else { search.work + MORE };
    // what saves little by itself comes later, so that it is not in the way of what saves much
    best = search.descend(best, enough, &ways, ways.moves.len());
    let (choice, _) = search.around(best, enough, &ways);
    search.set(&choice);
    assert!(
        is_in_proportion(&search.robot.model, &search.robot.reduced),
        "{}: a reduced form has numbers out of proportion to the robot's own",
        search.robot.model.name
    );
    choice
}
