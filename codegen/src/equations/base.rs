//! The base parameters of a robot, exactly: how many there are, and what each is made of.
//!
//! Forces of a motion follow from the energies T and V, so that a combination of parameters has no effect if its T vanishes and its V is constant (Gautier and
//! Khalil 1990). In a tree such a combination, with body j the outermost that it is about, stays one if joint j stands still: there body j is a part of
//! its parent. So it says of the parameters of body j alone that their energies are, wherever joint j is and however fast, those of the same parameters
//! welded to the parent at q_j = 0. Per body this is the null space of a few columns, sampled at random states in double-double; whatever has
//! to do with axes that are parallel, vertical or cross, with sliding joints and with a base that stands, comes out of the numbers.
//! Each combination of the null space moves to the parent by that weld, in closed form, from the tips to the base.
//!
//! For the wrench on the support the same is so of the wrench in place of the energies.

mod followers;

use crate::equations::reduce::longest_lever;
use crate::scene::{Gravity, Scene};
use straightline_core::algorithms as alg;
use straightline_core::base_parameters::{
    BaseParameter, BaseParameterKind, BaseParameterSets, JointParameter, PER_BODY,
};
use straightline_core::closure::Closure;
use straightline_core::model::{BodyId, Load, Model};
use straightline_core::random::Random;
use straightline_core::spatial::{Transform, Vec3};
use straightline_core::Dd;

/// Of the states that energies are sampled at.
const SEED: u64 = 0xbb67_ae85_84ca_a73b;
/// So many states: two rows each for at most thirteen columns.
const STATES: usize = 20;
/// So many for the wrench on the support: six rows each.
const SUPPORT_STATES: usize = 6;
/// What is left of a column that is so much less than the column is nothing; rounding leaves 1e-29.
const NOTHING: f64 = 1e-21;
/// A factor or a share that is so much less than what it is made of is nothing.
const DUST: f64 = 1e-24;
/// In this order parameters of a body are kept where there is a choice: m, m c_z and Σ_zz go, as is usual.
const KEPT_FIRST: [usize; PER_BODY] = [4, 7, 5, 6, 8, 1, 2, 3, 9, 0];

/// The base parameters of a robot whose reduced frames have these poses in its canonical ones, and what its scene makes inputs.
pub(crate) fn find(model: &Model<Dd>, frames: &[Transform<Dd>], scene: &Scene) -> BaseParameterSets {
    let joint_parameters = model.base_parameters.joint_parameters.clone();
    // whose joints all have coordinates of their own, in motions of those that follow others
    let tree = Model { couplings: Vec::new(), closure: Closure::default(), ..model.clone() };
    let any_gravity = scene.gravity == Gravity::Input;
    let states = states(model, any_gravity, STATES);
    let search = BaseSearch { model: &tree, coupled: model, frames, any_gravity, states, joint_parameters };
    let of_forces = search.grouped(&search.by_energies(), &search.joint_parameters);
    let of_support = search.grouped(&search.by_support(), &[]);
    let told_apart = |found: Vec<BaseParameter>, regressor: OfMotion<'_>, rows: usize| {
        search.with_rows(search.told_apart(found, regressor, rows), regressor, rows)
    };
    BaseParameterSets {
        of_forces: told_apart(of_forces, &|model, motion| alg::torque_regressor(model, motion), model.nv()),
        of_support: told_apart(of_support, &|model, motion| alg::base_wrench_regressor(model, motion), 6),
        of_scene: of_scene(model, scene),
        joint_parameters: search.joint_parameters,
    }
}

/// The parameters of bodies that are inputs, in their frames.
fn of_scene(model: &Model<Dd>, scene: &Scene) -> Vec<BaseParameter> {
    let mut found = Vec::new();
    for parameter in &scene.parameters {
        let Some((frame, body)) = parameter.frame().and_then(|f| model.frame(f)).and_then(|f| Some((f, f.body?)))
        else {
            continue;
        };
        let path = std::iter::successors(Some(body), |b| model.bodies[*b].parent);
        let of_joint = |b: BodyId| (0..model.bodies[b].joint.kind.nv()).map(move |k| model.moved_by(b).0 + k);
        let mut rows: Vec<usize> = path.flat_map(of_joint).collect();
        rows.sort_unstable();
        rows.dedup();
        found.extend(link_units().iter().enumerate().map(|(entry, unit)| {
            let kind = BaseParameterKind::Inertia { entry, unit: unit.seen_from(&frame.placement) };
            BaseParameter { body, kind, rows: rows.clone(), terms: Vec::new() }
        }));
    }
    found
}

/// A motion under gravity.
struct SampledMotion {
    motion: [Vec<Dd>; 3],
    /// That of all joints of the tree.
    of_tree: [Vec<Dd>; 3],
    gravity: Vec3<Dd>,
}

fn states(model: &Model<Dd>, any_gravity: bool, count: usize) -> Vec<SampledMotion> {
    let (lever, mut random) = (longest_lever(model), Random(SEED));
    let mut state = || {
        let mut motion = [model.nq(), model.nv(), model.nv()].map(|n| vec![Dd::ZERO; n]);
        for joint in model.free_joints() {
            let unit = if joint.kind.slides() { lever } else { 1.0 };
            let mut put =
                |to: &mut [Dd], bound: f64| to.iter_mut().for_each(|x| *x = Dd::from(random.symmetric(bound)));
            put(&mut motion[0][joint.iq..joint.iq + joint.kind.nq()], 3.0 * unit);
            if joint.iv >= model.nv() {
                continue; // loops determine it
            }
            put(&mut motion[1][joint.iv..joint.iv + joint.kind.nv()], unit);
            put(&mut motion[2][joint.iv..joint.iv + joint.kind.nv()], unit);
        }
        for joint in model.free_joints() {
            joint.kind.normalise(&mut motion[0][joint.iq..joint.iq + joint.kind.nq()]);
        }
        let gravity = match any_gravity {
            true => Vec3::from([0; 3].map(|_| Dd::from(random.symmetric(10.0)))),
            false => model.gravity,
        };
        let of_tree = model.tree_motion(motion.each_ref().map(|x| &x[..])).map(|x| x.into_owned());
        SampledMotion { motion, of_tree, gravity }
    };
    (0..count).map(|_| state()).collect()
}

/// Of one body: for each of its parameters, and then of its joint's, that is no base parameter, the factors of those that take its place.
struct Dependence {
    kept: Vec<usize>,
    dependent: Vec<(usize, Vec<(usize, Dd)>)>,
}

struct BaseSearch<'a> {
    /// The tree.
    model: &'a Model<Dd>,
    /// The robot, whose joints may follow others.
    coupled: &'a Model<Dd>,
    frames: &'a [Transform<Dd>],
    /// Gravity has any direction.
    any_gravity: bool,
    states: Vec<SampledMotion>,
    joint_parameters: Vec<JointParameter>,
}

impl BaseSearch<'_> {
    /// What generalized forces tell apart of each body, with what its joint adds.
    fn by_energies(&self) -> Vec<Dependence> {
        let lever = Dd::from(longest_lever(self.model));
        let mut columns: Vec<Vec<[Vec<Dd>; 2]>> = vec![Vec::new(); self.model.bodies.len()];
        for SampledMotion { of_tree: [q, qd, _], gravity, .. } in &self.states {
            let model = Model { gravity: *gravity, ..self.model.clone() };
            // rows of V beside those of T
            let weight = gravity.to_array().into_iter().map(Dd::abs).fold(Dd::ZERO, |sum, x| sum + x);
            let weight = if weight.to_f64() > 0.0 { lever / weight } else { Dd::ONE };
            let [moving, welded] = [false, true].map(|welded| alg::unit_energies(&model, q, qd, welded));
            for (b, (moving, welded)) in moving.iter().zip(&welded).enumerate() {
                let (whole, welded) = (self.in_reduced(b, moving), self.in_reduced(b, welded));
                let change = whole.iter().zip(&welded).map(|(x, y)| [x[0] - y[0], x[1] - y[1]]).collect::<Vec<_>>();
                let joint = self.joint_energies(b, q, qd);
                let own = &mut columns[b];
                own.resize(PER_BODY + joint.len(), Default::default());
                let all = whole.into_iter().zip(change).chain(joint.into_iter().map(|x| (x, x)));
                for (column, (whole, change)) in own.iter_mut().zip(all) {
                    column[0].extend([change[0], change[1] * weight]);
                    column[1].extend([whole[0], whole[1] * weight]);
                }
            }
        }
        columns.iter().map(|columns| dependence(columns, of_body(columns))).collect()
    }

    /// What the wrench on the support tells apart of each body.
    fn by_support(&self) -> Vec<Dependence> {
        let units: Vec<Vec<BaseParameter>> = (0..self.model.bodies.len()).map(|b| self.units(b)).collect();
        let mut columns: Vec<Vec<[Vec<Dd>; 2]>> = vec![vec![Default::default(); PER_BODY]; units.len()];
        for SampledMotion { of_tree: motion, gravity, .. } in &self.states[..SUPPORT_STATES] {
            let model = Model { gravity: *gravity, ..self.model.clone() };
            let wrenches = |motion: &[Vec<Dd>; 3], columns: &[BaseParameter]| {
                let of = alg::support_wrenches(&model, motion.each_ref().map(|x| &x[..]), columns);
                of.into_iter().map(|w| [w.force.to_array(), w.moment.to_array()].concat()).collect::<Vec<_>>()
            };
            let all = wrenches(motion, &units.concat());
            for (b, body) in self.model.bodies.iter().enumerate() {
                let joint = &body.joint;
                let mut held = motion.clone();
                let neutral = joint.kind.row().neutral.iter().map(|x| Dd::from(*x));
                held[0][joint.iq..joint.iq + joint.kind.nq()].iter_mut().zip(neutral).for_each(|(q, x)| *q = x);
                (1..3).for_each(|k| held[k][joint.iv..joint.iv + joint.kind.nv()].fill(Dd::ZERO));
                // a base is no part of what carries it, and what stands on the world is told from it by its weight
                let welded = match body.parent {
                    Some(_) => wrenches(&held, &units[b]),
                    None => vec![vec![Dd::ZERO; 6]; PER_BODY],
                };
                for (k, column) in columns[b].iter_mut().enumerate() {
                    let whole = &all[b * PER_BODY + k];
                    column[0].extend(whole.iter().zip(&welded[k]).map(|(x, y)| *x - *y));
                    column[1].extend(whole);
                }
            }
        }
        columns.iter().map(|columns| dependence(columns, of_body(columns))).collect()
    }

    /// Per unit of the parameters in the reduced frame, from those in the canonical one.
    fn in_reduced(&self, body: BodyId, canonical: &[[Dd; 2]; PER_BODY]) -> Vec<[Dd; 2]> {
        let of = |entry: usize| {
            let unit = Load::unit(entry).seen_from(&self.frames[body]).to_array();
            let products = unit.into_iter().zip(canonical);
            products.fold([Dd::ZERO; 2], |sum, (x, energy)| [0, 1].map(|row| sum[row] + x * energy[row]))
        };
        (0..PER_BODY).map(of).collect()
    }

    /// T and V per unit of what the joint adds, as far as it has energies: the others are told apart anyway, by their own rows.
    fn joint_energies(&self, body: BodyId, q: &[Dd], qd: &[Dd]) -> Vec<[Dd; 2]> {
        let (joint, effects) = (&self.model.bodies[body].joint, &self.model.bodies[body].effects);
        let of = |kind: &JointParameter| match kind.twice_energy(effects, [q[joint.iq], qd[joint.iv]]) {
            Some(twice) if *kind == JointParameter::RotorInertia => [twice * Dd::HALF, Dd::ZERO],
            Some(twice) => [Dd::ZERO, twice * Dd::HALF],
            None => [Dd::ZERO; 2],
        };
        let own = self.joint_parameters.iter().filter(|kind| has_energy(**kind) && joint.kind.is_single());
        own.map(of).collect()
    }

    /// The parameters of a body in its reduced frame.
    fn units(&self, body: BodyId) -> Vec<BaseParameter> {
        let of = |entry: usize| {
            let unit = Load::unit(entry).seen_from(&self.frames[body]);
            let kind = BaseParameterKind::Inertia { entry, unit };
            BaseParameter { body, kind, rows: Vec::new(), terms: Vec::new() }
        };
        (0..PER_BODY).map(of).collect()
    }

    /// The pose of a body's reduced frame in its parent's where its joint is neutral.
    fn weld(&self, body: BodyId, parent: BodyId) -> Transform<Dd> {
        let Self { model, frames, .. } = self;
        let joint = &model.bodies[body].joint;
        let neutral: Vec<Dd> = joint.kind.row().neutral.iter().map(|x| Dd::from(*x)).collect();
        let at_joint = model.bodies[body].placement.compose(&joint.kind.motion(&neutral));
        self.settled(&frames[parent].inverse().compose(&at_joint).compose(&frames[body]))
    }

    /// A pose with exact zeros where double-double cannot tell.
    fn settled(&self, pose: &Transform<Dd>) -> Transform<Dd> {
        let lever = longest_lever(self.model);
        let dusted = |x: Dd| if x.abs().to_f64() < DUST * lever { Dd::ZERO } else { x };
        Transform { rotation: pose.rotation.map(settled), translation: pose.translation.map(dusted) }
    }

    /// The parameters that are left, with all that is grouped with them.
    fn grouped(&self, dependences: &[Dependence], joint_parameters: &[JointParameter]) -> Vec<BaseParameter> {
        let Self { model, .. } = self;
        let (places, lever) = (FilePlaces::new(model), longest_lever(model));
        let with_energy: Vec<JointParameter> = joint_parameters.iter().copied().filter(|k| has_energy(*k)).collect();
        // of every body the ten parameters in its reduced frame, and those of its joint, as sums of what the file has
        let mut forms: Vec<Vec<ParameterSum>> = (0..model.bodies.len())
            .map(|b| {
                let to_reduced = self.settled(&self.frames[b].inverse().compose(&model.bodies[b].link_frame));
                let of_link = link_units().map(|unit| unit.seen_from(&to_reduced).to_array());
                let own = (0..PER_BODY).map(|entry| {
                    let mut form = ParameterSum::new();
                    (0..PER_BODY).for_each(|c| form.add(places.of_link(b, c), of_link[c][entry]));
                    form
                });
                let of_joint =
                    with_energy.iter().map(|kind| ParameterSum::of(places.of_joint(joint_parameters, *kind, b)));
                own.chain(of_joint.filter(|_| model.bodies[b].joint.kind.is_single())).collect()
            })
            .collect();
        for (b, body) in model.bodies.iter().enumerate().rev() {
            let weld = body.parent.map(|parent| (parent, self.weld(b, parent)));
            for (dependent, factors) in &dependences[b].dependent {
                let amount = forms[b][*dependent].clone();
                // of the direction that has no effect but at the parent: one of it, and less of those that take its place
                let mut direction = [Dd::ZERO; PER_BODY];
                if *dependent < PER_BODY {
                    direction[*dependent] = Dd::ONE;
                }
                for (kept, factor) in factors {
                    forms[b][*kept].add_scaled(&amount, *factor);
                    if *kept < PER_BODY {
                        direction[*kept] = -*factor;
                    }
                }
                let Some((parent, pose)) = &weld else { continue };
                let at_parent = Load::from_array(direction).seen_from(pose).to_array();
                (0..PER_BODY).for_each(|entry| forms[*parent][entry].add_scaled(&amount, at_parent[entry]));
            }
        }
        let mut found = Vec::new();
        for (b, dependence) in dependences.iter().enumerate() {
            let mut kept: Vec<usize> = dependence.kept.iter().copied().filter(|entry| *entry < PER_BODY).collect();
            kept.sort_unstable();
            for entry in kept {
                let unit = Load::unit(entry).seen_from(&self.frames[b]);
                let kind = BaseParameterKind::Inertia { entry, unit };
                found.push(BaseParameter {
                    body: b,
                    kind,
                    rows: Vec::new(),
                    terms: forms[b][entry].terms(&places, lever, entry),
                });
            }
        }
        for kind in joint_parameters {
            let with_energy = with_energy.iter().position(|k| k == kind);
            for b in places.single.iter().copied() {
                let place = with_energy.map(|k| PER_BODY + k);
                if place.is_some_and(|place| !dependences[b].kept.contains(&place)) {
                    continue;
                }
                let terms = match place {
                    Some(place) => forms[b][place].terms(&places, lever, place),
                    None => vec![(places.of_joint(joint_parameters, *kind, b), Dd::ONE)],
                };
                found.push(BaseParameter { body: b, kind: BaseParameterKind::Joint(*kind), rows: Vec::new(), terms });
            }
        }
        found
    }

    /// The same with the rows in which they stand: where the regressor is not zero at some state.
    fn with_rows(&self, mut found: Vec<BaseParameter>, regressor: OfMotion<'_>, rows: usize) -> Vec<BaseParameter> {
        const TRIED: usize = 3;
        found.iter_mut().for_each(|parameter| parameter.rows = (0..rows).collect());
        let columns = found.len();
        let mut greatest = vec![0.0_f64; rows * columns];
        let base =
            BaseParameterSets { of_forces: found.clone(), of_support: found.clone(), ..BaseParameterSets::default() };
        for SampledMotion { motion, gravity, .. } in &self.states[..TRIED] {
            let model = Model { gravity: *gravity, base_parameters: base.clone(), ..self.coupled.clone() };
            let y = regressor(&model, motion.each_ref().map(|x| &x[..]));
            greatest.iter_mut().zip(&y).for_each(|(greatest, y)| *greatest = greatest.max(y.to_f64().abs()));
        }
        for (k, parameter) in found.iter_mut().enumerate() {
            let of_column = |row: usize| greatest[row * columns + k];
            let most = (0..rows).map(of_column).fold(0.0, f64::max);
            parameter.rows = (0..rows).filter(|row| of_column(*row) > NOTHING * most).collect();
        }
        found
    }
}

/// What a robot's regressor is at q, q̇, q̈.
type OfMotion<'a> = &'a dyn Fn(&Model<Dd>, [&[Dd]; 3]) -> Vec<Dd>;

/// Whether T or V depends on it.
fn has_energy(kind: JointParameter) -> bool {
    !matches!(kind, JointParameter::Damping | JointParameter::Coulomb)
}

/// The order in which a body's columns are kept.
fn of_body(columns: &[[Vec<Dd>; 2]]) -> impl Iterator<Item = usize> {
    KEPT_FIRST.into_iter().chain(PER_BODY..columns.len())
}

/// Which of some columns depend on the others, those kept first that are named first; each column with what it is the change of.
fn dependence(columns: &[[Vec<Dd>; 2]], kept_first: impl Iterator<Item = usize>) -> Dependence {
    let dot = |a: &[Dd], b: &[Dd]| a.iter().zip(b).fold(Dd::ZERO, |sum, (a, b)| sum + *a * *b);
    let greatest = |column: &[Dd]| column.iter().map(|x| x.abs().to_f64()).fold(0.0, f64::max);
    let mut found = Dependence { kept: Vec::new(), dependent: Vec::new() };
    // orthogonal directions of unit length, and what each is of the columns that were kept
    let mut basis: Vec<(Vec<Dd>, Vec<Dd>)> = Vec::new();
    let scale = |k: usize| greatest(&columns[k][1]);
    for k in kept_first {
        if scale(k) == 0.0 {
            found.dependent.push((k, Vec::new()));
            continue;
        }
        let per = Dd::ONE / Dd::from(scale(k));
        let mut left: Vec<Dd> = columns[k][0].iter().map(|x| *x * per).collect();
        let mut shares = vec![Dd::ZERO; found.kept.len()];
        // twice, as once leaves what rounding left
        for _ in 0..2 {
            for (direction, made_of) in &basis {
                let along = dot(&left, direction);
                left.iter_mut().zip(direction).for_each(|(x, d)| *x -= along * *d);
                shares.iter_mut().zip(made_of).for_each(|(share, part)| *share += along * *part);
            }
        }
        if greatest(&left) > NOTHING {
            let length = dot(&left, &left).sqrt();
            let direction = left.iter().map(|x| *x / length).collect();
            let mut made_of: Vec<Dd> = shares.iter().map(|share| -*share / length).collect();
            made_of.push(Dd::ONE / length);
            basis.push((direction, made_of));
            found.kept.push(k);
            continue;
        }
        let factors = found.kept.iter().zip(shares).filter_map(|(kept, share)| {
            let share = settled(share);
            (share != Dd::ZERO).then(|| (*kept, settled(share * Dd::from(scale(k)) / Dd::from(scale(*kept)))))
        });
        found.dependent.push((k, factors.collect()));
    }
    found
}

/// A factor, exactly 0 or a half of a whole number where double-double cannot tell.
fn settled(x: Dd) -> Dd {
    let near = Dd::from((x.to_f64() * 2.0).round() * 0.5);
    match (x - near).abs().to_f64() < DUST * near.to_f64().abs().max(1.0) {
        true => near,
        false => x,
    }
}

/// The ten parameters of a link about its origin, m, m c and I, one at a time.
fn link_units() -> [Load<Dd>; PER_BODY] {
    core::array::from_fn(|c| match c {
        0..4 => Load::unit(c),
        _ => {
            let i = Load::<Dd>::unit(c).second_moment;
            Load { second_moment: i.inertia_to_second_moment(), ..Load::from_array([Dd::ZERO; PER_BODY]) }
        }
    })
}

/// Of which moment of mass an inertial parameter is.
fn order(entry: usize) -> i32 {
    match entry {
        0 => 0,
        1..4 => 1,
        _ => 2,
    }
}

/// Where parameters of the file stand in one list.
struct FilePlaces {
    /// The rank of each body's joint.
    rank: Vec<usize>,
    /// Bodies with joints of one coordinate, in the order of the joints.
    single: Vec<BodyId>,
}

impl FilePlaces {
    fn new(model: &Model<Dd>) -> FilePlaces {
        let mut order: Vec<BodyId> = (0..model.bodies.len()).collect();
        order.sort_by_key(|b| model.bodies[*b].joint.iv);
        let mut rank = vec![0; order.len()];
        order.iter().enumerate().for_each(|(k, b)| rank[*b] = k);
        let single = order.into_iter().filter(|b| model.bodies[*b].joint.kind.is_single()).collect();
        FilePlaces { rank, single }
    }

    fn of_link(&self, body: BodyId, entry: usize) -> usize {
        PER_BODY * self.rank[body] + entry
    }

    fn of_joint(&self, kinds: &[JointParameter], kind: JointParameter, body: BodyId) -> usize {
        let kind = kinds.iter().position(|k| *k == kind).unwrap_or(0);
        let joint = self.single.iter().position(|b| *b == body).unwrap_or(0);
        PER_BODY * self.rank.len() + kind * self.single.len() + joint
    }
}

/// A sum of parameters of the file with factors, and how large the terms of each factor were.
#[derive(Clone, Default)]
struct ParameterSum(std::collections::BTreeMap<usize, (Dd, f64)>);

impl ParameterSum {
    fn new() -> Self {
        ParameterSum::default()
    }

    fn of(place: usize) -> Self {
        ParameterSum([(place, (Dd::ONE, 1.0))].into_iter().collect())
    }

    fn add(&mut self, place: usize, factor: Dd) {
        self.add_sized(place, factor, factor.to_f64().abs());
    }

    fn add_sized(&mut self, place: usize, factor: Dd, size: f64) {
        let own = self.0.entry(place).or_insert((Dd::ZERO, 0.0));
        *own = (own.0 + factor, own.1.max(size));
    }

    fn add_scaled(&mut self, other: &ParameterSum, factor: Dd) {
        if factor != Dd::ZERO {
            let times = factor.to_f64().abs();
            other.0.iter().for_each(|(place, (x, size))| self.add_sized(*place, *x * factor, size * times));
        }
    }

    /// Its terms, without those that are what rounding left: of terms that cancel, or of powers of the lever.
    fn terms(&self, places: &FilePlaces, lever: f64, entry: usize) -> Vec<(usize, Dd)> {
        let least = |place: usize, size: f64| match place < PER_BODY * places.rank.len() && entry < PER_BODY {
            true => size.max(lever.powi(order(entry) - order(place % PER_BODY))),
            false => size,
        };
        let all = self.0.iter().map(|(place, (factor, size))| (*place, *factor, least(*place, *size)));
        all.filter(|(_, factor, size)| factor.to_f64().abs() > DUST * size).map(|(k, x, _)| (k, x)).collect()
    }
}
