//! One limb traced for all of its kind.

use crate::equations::bind::BoundRobot;
use crate::equations::Robot;
use crate::function::{Forms, ForwardDynamicsMethod, Function, LimbSums};
use crate::model::limbs::Limbs;
use crate::scene::Scene;
use std::cell::RefCell;
use std::collections::BTreeSet;
use straightline_core::algorithms::Subtree;
use straightline_core::model::{Body, BodyId, Coulomb, JointEffects, Model};
use straightline_core::reduced::{ReducedBody, ReducedModel};
use straightline_core::spatial::{Composite, ForceVector, Mat3, Sym3, Vec3};
use straightline_core::{Dd, Real};
use straightline_graph::expr::{Graph, Op, Port, RuleSet};
use straightline_graph::trace::{trace_all, Expr};

/// Below this relative difference two constants are one: where rounding in double-double ends.
const SAME: f64 = 1e-28;
/// At most so many numbers of a body differ from limb to limb; what constants are folded to takes more.
const NUMBERS: usize = 64;
/// So many numbers a limb passes on at most: a wrench, its first and second moments, and the moments of its velocities.
const SUMS: usize = 27;

/// A value that differs from limb to limb.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum LaneValue {
    /// A constant of each limb.
    Constants(Vec<Dd>),
    /// Of each limb a result of the template that is no limb's.
    Results(Vec<usize>),
}

/// A program in which a limb stands for all of its kind. Its inputs are the function's, then a port `sums` with what all limbs
/// of a kind pass on, then a port `lanes` with the values that differ.
pub(super) struct Template {
    pub graph: Graph,
    /// Of each body of the template the bodies that it stands for, and the kind of limb, where it is a limb's.
    pub bodies: Vec<(Option<usize>, Vec<BodyId>)>,
    /// Of each result of the function the result of the template that stands for it, and which limb's it is; none of entries between limbs, which
    /// are zero.
    pub places: Vec<Option<(usize, usize)>>,
    /// Results of the template that stand for such of the function: the first ones.
    pub own_results: usize,
    /// The first body of each limb, kind by kind.
    pub first_bodies: Vec<Vec<BodyId>>,
    /// First input of `sums`, and of each of them which result all limbs of a kind add up to it.
    pub first_sum: usize,
    pub sums: Vec<Sum>,
    /// First input of `lanes`, and what each of them stands for, with the kind of limb.
    pub first_lane: usize,
    pub lanes: Vec<(usize, LaneValue)>,
}

/// What all limbs of a kind pass on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sum {
    pub kind: usize,
    /// Which input of `sums`, and which result.
    pub input: usize,
    pub result: usize,
}

impl Template {
    /// Number of limbs of a kind.
    pub fn count(&self, kind: usize) -> usize {
        self.first_bodies[kind].len()
    }

    /// Whether this input differs from limb to limb, and is an input or a constant of each.
    pub fn of_inputs(&self, input: usize) -> bool {
        let is_leaf = |k: &usize| matches!(self.graph.op(self.graph.results[*k]), Op::Input(_) | Op::Constant(_));
        match input.checked_sub(self.first_lane).map(|k| &self.lanes[k].1) {
            Some(LaneValue::Results(results)) => results.iter().all(is_leaf),
            Some(LaneValue::Constants(_)) => true,
            None => false,
        }
    }

    /// Results that nobody wants go. `wanted`: results of the function.
    pub fn keep(&mut self, wanted: &[usize]) {
        let kept: BTreeSet<usize> = wanted.iter().filter_map(|k| Some(self.places[*k]?.0)).collect();
        self.drop_results((0..self.own_results).filter(|k| !kept.contains(k)).collect(), kept.first().copied());
    }

    /// Sums, and values of limbs, that no result needs go, and what only they need.
    pub fn drop_unread(&mut self, wanted: &[usize]) {
        let live = self.graph.live();
        let mut read = vec![false; self.first_lane + self.lanes.len()];
        for id in self.graph.ids().filter(|id| live[id.index()]) {
            if let Op::Input(k) = self.graph.op(id) {
                read[k as usize] = true;
            }
        }
        let (kept, dropped): (Vec<Sum>, Vec<Sum>) = self.sums.iter().partition(|s| read[self.first_sum + s.input]);
        self.sums = kept;
        let unread = self.lanes.iter().zip(&read[self.first_lane..]).filter(|(_, read)| !**read);
        let of_lanes = unread.flat_map(|((_, value), _)| match value {
            LaneValue::Constants(_) => Vec::new(),
            LaneValue::Results(results) => results.clone(),
        });
        let results = of_lanes.chain(dropped.iter().map(|s| s.result)).collect();
        self.drop_results(results, wanted.iter().find_map(|k| Some(self.places[*k]?.0)));
    }

    /// In the place of results that go stands one that is there anyway.
    fn drop_results(&mut self, dropped: Vec<usize>, wanted: Option<usize>) {
        let Some(wanted) = wanted else { return };
        dropped.into_iter().for_each(|k| self.graph.results[k] = self.graph.results[wanted]);
        self.graph = straightline_graph::pass::dead_code(&self.graph);
    }
}

/// Whether two constants are one as far as double-double can tell.
pub(super) fn same(a: Dd, b: Dd) -> bool {
    a == b || (a - b).abs().hi() <= SAME * a.abs().hi()
}

/// The values that differ from limb to limb, in the order in which they came up.
struct LimbValues<'a> {
    inputs: &'a [Expr],
    values: Vec<(usize, Vec<Expr>)>,
}

impl LimbValues<'_> {
    /// What stands for these values of the limbs of a kind: one of them where they are the same.
    fn value(&mut self, kind: usize, of_limbs: &[Expr]) -> Expr {
        let equal = |a: &Expr, b: &Expr| {
            let constants = a.as_constant().zip(b.as_constant());
            a.node() == b.node() || constants.is_some_and(|(a, b)| same(a, b))
        };
        let opposite = |a: &Expr, b: &Expr| a.as_constant().zip(b.as_constant()).is_some_and(|(a, b)| same(a, -b));
        if of_limbs.iter().all(|x| equal(&of_limbs[0], x)) {
            return of_limbs[0];
        }
        for (k, (other, values)) in self.values.iter().enumerate() {
            let all = |f: &dyn Fn(&Expr, &Expr) -> bool| values.iter().zip(of_limbs).all(|(a, b)| f(a, b));
            if *other == kind && all(&equal) {
                return self.inputs[k];
            }
            if *other == kind && all(&opposite) {
                return -self.inputs[k];
            }
        }
        self.values.push((kind, of_limbs.to_vec()));
        self.inputs[self.values.len() - 1]
    }
}

/// Traces a function of a robot with these limbs, by its reduced form.
pub(super) fn template(robot: &Robot, function: Function, scene: &Scene, limbs: &[Limbs], rules: RuleSet) -> Template {
    let bodies = bodies(&robot.model, limbs);
    let own = scene.ports(function, &robot.model, &[]);
    let first_sum: usize = own.iter().map(Port::len).sum();
    let first_lane = first_sum + SUMS * limbs.len();
    let most = NUMBERS * bodies.iter().filter(|(kind, _)| kind.is_some()).count();
    let more = [Port::new("sums", &[SUMS * limbs.len()]), Port::new("lanes", &[most])];
    let (mut sums, mut lanes) = (Vec::new(), Vec::new());
    let graph = trace_all(rules, own.iter().cloned().chain(more).collect(), |inputs| {
        let (own, more) = inputs.split_at(own.len());
        let bound = scene.bind(function, robot, own);
        let mut table = LimbValues { inputs: &more[1], values: Vec::new() };
        let folded = TemplateRobot::new(&bound, &bodies, &mut table);
        let (mut results, passed_on) = folded.results(function, &bound, &bodies, limbs, &more[0]);
        for (kind, input, value) in passed_on {
            sums.push(Sum { kind, input, result: results.len() });
            results.push(value);
        }
        for (kind, values) in table.values {
            let constants: Option<Vec<Dd>> = values.iter().map(|x| x.as_constant()).collect();
            let value = constants.map(LaneValue::Constants).unwrap_or_else(|| {
                let first = results.len();
                results.extend(&values);
                LaneValue::Results((first..results.len()).collect())
            });
            lanes.push((kind, value));
        }
        results
    });
    let first_bodies = limbs.iter().map(|l| l.bodies.iter().map(|b| b[0]).collect()).collect();
    let (places, own_results) = places(function, &robot.model, &bodies);
    Template { graph, bodies, places, own_results, first_bodies, first_sum, sums, first_lane, lanes }
}

/// The bodies of the template in the order of the robot's: those of no limb, and the first limb's of every kind.
fn bodies<T>(model: &Model<T>, limbs: &[Limbs]) -> Vec<(Option<usize>, Vec<BodyId>)> {
    let mut bodies = Vec::new();
    for i in 0..model.bodies.len() {
        let place = limbs.iter().enumerate().find_map(|(kind, l)| {
            let of_limb = |limb: &Vec<BodyId>| limb.iter().position(|b| *b == i);
            l.bodies.iter().enumerate().find_map(|(m, limb)| Some((kind, m, of_limb(limb)?)))
        });
        match place {
            None => bodies.push((None, vec![i])),
            Some((kind, 0, place)) => {
                bodies.push((Some(kind), limbs[kind].bodies.iter().map(|limb| limb[place]).collect()));
            }
            Some(_) => {}
        }
    }
    bodies
}

/// The robot of the template.
struct TemplateRobot {
    model: Model<Expr>,
    reduced: ReducedModel<Expr>,
    arguments: Vec<Vec<Expr>>,
}

impl TemplateRobot {
    fn new(
        bound: &BoundRobot<Expr>,
        bodies: &[(Option<usize>, Vec<BodyId>)],
        table: &mut LimbValues<'_>,
    ) -> TemplateRobot {
        let place = |i: BodyId| bodies.iter().position(|(_, b)| b[0] == i).expect("a limb's carrier is no limb's");
        let mut folded = TemplateRobot {
            model: Model { bodies: Vec::new(), ..bound.model.clone() },
            reduced: ReducedModel { bodies: Vec::new(), ..bound.reduced.clone() },
            arguments: vec![Vec::new(); bound.arguments.len()],
        };
        let (mut iq, mut iv) = (0, 0);
        for (kind, of) in bodies {
            let reduced: Vec<&ReducedBody<Expr>> = of.iter().map(|i| &bound.reduced.bodies[*i]).collect();
            let full: Vec<&Body<Expr>> = of.iter().map(|i| &bound.model.bodies[*i]).collect();
            let parent = reduced[0].parent.map(place);
            let mut value = |of_limbs: &[Expr]| kind.map_or(of_limbs[0], |kind| table.value(kind, of_limbs));
            let body = merged_body(&reduced, parent, (iq, iv), &mut value);
            let effects: Vec<&JointEffects<Expr>> = full.iter().map(|b| &b.effects).collect();
            let effects = merged_effects(&effects, &mut value);
            for (k, (values, arguments)) in folded.arguments.iter_mut().zip(&bound.arguments).enumerate() {
                // the first is q, which has as many entries as coordinates
                let (count, first): (usize, fn(&ReducedBody<Expr>) -> usize) = match k {
                    0 => (body.kind.nq(), |b| b.iq),
                    _ => (body.kind.nv(), |b| b.iv),
                };
                for k in 0..count {
                    let of_limbs: Vec<Expr> = reduced.iter().map(|b| arguments[first(b) + k]).collect();
                    values.push(value(&of_limbs));
                }
            }
            let mut own = full[0].clone();
            (own.joint.iq, own.joint.iv, own.parent, own.effects) = (iq, iv, parent, effects);
            (iq, iv) = (iq + body.kind.nq(), iv + body.kind.nv());
            folded.model.bodies.push(own);
            folded.reduced.bodies.push(body);
        }
        // what one limb cannot do, none does
        for i in 0..folded.reduced.bodies.len() {
            let may = folded.reduced.may_stay(i);
            let body = &mut folded.reduced.bodies[i];
            body.stays &= may;
            body.turns_sums &= body.stays;
        }
        folded
    }

    /// The results over the joints of the template, and what limbs pass on: kind, input of `sums`, value.
    #[allow(clippy::type_complexity)]
    fn results(
        &self,
        function: Function,
        bound: &BoundRobot<Expr>,
        bodies: &[(Option<usize>, Vec<BodyId>)],
        limbs: &[Limbs],
        sums: &[Expr],
    ) -> (Vec<Expr>, Vec<(usize, usize, Expr)>) {
        let passed_on = std::cell::RefCell::new(Vec::new());
        // the first body of a limb that something carries
        let kind_of = |i: BodyId| bodies[i].0.filter(|kind| limbs[*kind].bodies[0][0] == bodies[i].1[0]);
        let total = |kind: usize, place: usize, x: Expr| {
            // what is zero for every limb needs no sum
            if x.as_constant() == Some(Dd::ZERO) {
                return x;
            }
            let input = SUMS * kind + place;
            passed_on.borrow_mut().push((kind, input, x));
            sums[input]
        };
        let numbers = |kind: usize, first: usize, numbers: &[Expr]| -> Vec<Expr> {
            numbers.iter().enumerate().map(|(k, x)| total(kind, first + k, *x)).collect()
        };
        let vector = |kind: usize, first: usize, v: Vec3<Expr>| {
            let all = numbers(kind, first, &v.to_array());
            Vec3::new(all[0], all[1], all[2])
        };
        let mass = |kind: usize| {
            let masses = limbs[kind].bodies.iter().flatten().map(|b| bound.reduced.bodies[*b].mass);
            masses.reduce(|sum, m| sum + m).expect("a limb has bodies")
        };
        let mut wrench = |i: BodyId, wrench: &dyn Fn() -> ForceVector<Expr>| {
            let (kind, own) = (kind_of(i)?, wrench());
            Some(ForceVector { moment: vector(kind, 0, own.moment), force: vector(kind, 3, own.force) })
        };
        let mut first_moment = |i: BodyId, first_moment: &dyn Fn() -> Vec3<Expr>| {
            let kind = kind_of(i)?;
            Some((vector(kind, 0, first_moment()), mass(kind)))
        };
        let mut subtree = |i: BodyId, subtree: &dyn Fn() -> Subtree<Expr>| {
            let (kind, own) = (kind_of(i)?, subtree());
            let s = own.composite.second_moment;
            let [xx, xy, xz, yy, yz, zz]: [Expr; 6] =
                numbers(kind, 9, &[s.xx, s.xy, s.xz, s.yy, s.yz, s.zz]).try_into().expect("as many as were given");
            let mut row = 15;
            let spread = own.spread.rows.map(|of_row| {
                let all = numbers(kind, row, &of_row);
                row += 3;
                [all[0], all[1], all[2]]
            });
            Some(Subtree {
                wrench: ForceVector {
                    moment: vector(kind, 0, own.wrench.moment),
                    force: vector(kind, 3, own.wrench.force),
                },
                composite: Composite {
                    mass: mass(kind),
                    first_moment: vector(kind, 6, own.composite.first_moment),
                    second_moment: Sym3 { xx, xy, xz, yy, yz, zz },
                },
                spread: Mat3 { rows: spread },
                drift: vector(kind, 24, own.drift),
            })
        };
        let forms = Forms {
            reduced: Some([&self.reduced, &self.reduced]),
            limbs: Some(RefCell::new(LimbSums {
                wrench: &mut wrench,
                first_moment: &mut first_moment,
                subtree: &mut subtree,
            })),
            ..Forms::plain(&self.model, &[], ForwardDynamicsMethod::default())
        };
        (function.evaluate_on(&forms, &self.arguments), passed_on.take())
    }
}

/// A body for those of several limbs.
fn merged_body(
    of: &[&ReducedBody<Expr>],
    parent: Option<BodyId>,
    (iq, iv): (usize, usize),
    value: &mut dyn FnMut(&[Expr]) -> Expr,
) -> ReducedBody<Expr> {
    let mut merged = |f: &dyn Fn(&ReducedBody<Expr>) -> Expr| value(&of.iter().map(|b| f(b)).collect::<Vec<_>>());
    let all = |f: fn(&ReducedBody<Expr>) -> bool| of.iter().all(|b| f(b));
    let entry = |r: usize, c: usize| move |b: &ReducedBody<Expr>| b.rotation.rows[r][c];
    let rotation = Mat3 { rows: [0, 1, 2].map(|r| [0, 1, 2].map(|c| merged(&entry(r, c)))) };
    let offset = (merged(&|b| b.offset.0), merged(&|b| b.offset.1));
    let has_phase = of.iter().any(|b| b.phase.is_some());
    let phase = has_phase.then(|| merged(&|b| b.phase.unwrap_or_else(Expr::zero)));
    let component = |v: Vec3<Expr>, k: usize| v.to_array()[k];
    let mut vector = |f: fn(&ReducedBody<Expr>) -> Vec3<Expr>| {
        let [x, y, z] = [0, 1, 2].map(|k| merged(&|b| component(f(b), k)));
        Vec3::new(x, y, z)
    };
    let (translation, first_moment) = (vector(|b| b.translation), vector(|b| b.first_moment));
    let second_moment = Sym3 {
        xx: merged(&|b| b.second_moment.xx),
        xy: merged(&|b| b.second_moment.xy),
        xz: merged(&|b| b.second_moment.xz),
        yy: merged(&|b| b.second_moment.yy),
        yz: merged(&|b| b.second_moment.yz),
        zz: merged(&|b| b.second_moment.zz),
    };
    ReducedBody {
        parent,
        iq,
        iv,
        rotation,
        offset,
        phase,
        translation,
        mass: merged(&|b| b.mass),
        first_moment,
        second_moment,
        permutes: all(|b| b.permutes),
        parallel: all(|b| b.parallel),
        ..of[0].clone()
    }
}

/// The effects of a joint for those of several limbs.
fn merged_effects(of: &[&JointEffects<Expr>], value: &mut dyn FnMut(&[Expr]) -> Expr) -> JointEffects<Expr> {
    let mut merged = |f: &dyn Fn(&JointEffects<Expr>) -> Expr| value(&of.iter().map(|e| f(e)).collect::<Vec<_>>());
    let friction = |e: &JointEffects<Expr>| match e.coulomb {
        Coulomb::Off => Expr::zero(),
        Coulomb::Sign(force) | Coulomb::Smooth { force, .. } => force,
    };
    let coulomb = match of[0].coulomb {
        Coulomb::Off => Coulomb::Off,
        Coulomb::Sign(_) => Coulomb::Sign(merged(&friction)),
        Coulomb::Smooth { speed, .. } => Coulomb::Smooth { force: merged(&friction), speed },
    };
    let has_rotor = of.iter().any(|e| e.rotor_inertia.is_some());
    JointEffects {
        rotor_inertia: has_rotor.then(|| merged(&|e| e.rotor_inertia.unwrap_or_else(Expr::zero))),
        damping: merged(&|e| e.damping),
        coulomb,
        stiffness: merged(&|e| e.stiffness),
        spring_rest: merged(&|e| e.spring_rest),
    }
}

/// What stands for a velocity coordinate of the robot.
#[derive(Clone, Copy)]
struct CoordinatePlace {
    /// A coordinate of the template.
    coordinate: usize,
    /// The kind of limb and which limb it is, where it is a limb's.
    limb: Option<(usize, usize)>,
}

/// Of each velocity coordinate of the robot what stands for it, and how many the template has.
fn coordinates(model: &Model<Dd>, bodies: &[(Option<usize>, Vec<BodyId>)]) -> (Vec<CoordinatePlace>, usize) {
    let mut coordinates = vec![CoordinatePlace { coordinate: 0, limb: None }; model.nv()];
    let mut next = 0;
    for (kind, of) in bodies {
        let nv = model.bodies[of[0]].joint.kind.nv();
        for (limb, body) in of.iter().enumerate() {
            for k in 0..nv {
                let place = CoordinatePlace { coordinate: next + k, limb: kind.map(|kind| (kind, limb)) };
                coordinates[model.bodies[*body].joint.iv + k] = place;
            }
        }
        next += nv;
    }
    (coordinates, next)
}

/// Of each result of a function, lists and matrices over velocity coordinates, the result of the template that stands for it with its limb,
/// and how many such results the template has. What belongs to two limbs is zero.
fn places(
    function: Function,
    model: &Model<Dd>,
    bodies: &[(Option<usize>, Vec<BodyId>)],
) -> (Vec<Option<(usize, usize)>>, usize) {
    let (of, count) = coordinates(model, bodies);
    let limb = |place: CoordinatePlace| place.limb.map_or(0, |(_, limb)| limb);
    let (mut places, mut first) = (Vec::new(), 0);
    for block in function.outputs(model, 0) {
        match block.shape[..] {
            [_] => places.extend(of.iter().map(|place| Some((first + place.coordinate, limb(*place))))),
            _ => {
                let entry = |row: CoordinatePlace, column: CoordinatePlace| match (row.limb, column.limb) {
                    (Some(a), Some(b)) if a != b => None,
                    _ => {
                        let own = if row.limb.is_some() { limb(row) } else { limb(column) };
                        Some((first + row.coordinate * count + column.coordinate, own))
                    }
                };
                places.extend(of.iter().flat_map(|row| of.iter().map(|column| entry(*row, *column))));
            }
        }
        first += if block.shape.len() == 1 { count } else { count * count };
    }
    (places, first)
}
