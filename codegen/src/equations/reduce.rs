//! From the model to its reduced form: frames and inertial parameters that take the fewest operations.
//!
//! Both steps are exact over the reals and done in double-double, in closed form: a solution by least squares would let
//! digits of heavy links leak into light ones.

use crate::description::angle;
use rustc_hash::FxHasher;
use std::hash::{Hash, Hasher};
use straightline_core::model::{Body, BodyId, Model};
use straightline_core::reduced::{Meeting, ReducedBody, ReducedJoint, ReducedModel};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::{Dd, Real};

mod frames;
mod regroup;

use frames::*;
use regroup::regroup;

/// Where rounding in double-double ends: smaller entries of rotations, or lengths against the robot's, are zero.
const DUST: f64 = 1e-28;
/// Below this sine two axes are taken as parallel when a frame is chosen; the transform itself stays exact.
const NEARLY_PARALLEL: f64 = 1e-4;

/// So many times as far as the next origin, and so many times the robot's longest lever, the foot of a common normal may be: beyond,
/// axes are so nearly parallel that the lever would cancel.
const FAR: f64 = 10.0;
/// A part of a lever beside an axis sets no direction where it is less than this part of the robot's longest lever.
const BESIDE: f64 = 1e-8;
/// Units of length come from lengths and first moments that are at least this part of the robot's greatest.
const NO_DUST: f64 = 1e-6;

/// What is free in a reduced form; torques depend on none of it.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeTerms {
    /// Bodies that are described in the axes before their joint's turn: [`ReducedBody::stays`].
    pub stays: Vec<bool>,
    /// Bodies whose moment is formed by ε_z: [`ReducedBody::by_axis_acceleration`].
    pub by_axis_acceleration: Vec<bool>,
    /// [`ReducedBody::by_accelerations`].
    pub by_accelerations: [Vec<bool>; 2],
    /// Bodies whose parameters are moved to the parent where the joint cannot tell.
    pub regrouped: Vec<bool>,
    /// [`ReducedBody::doubled`].
    pub doubled: [Vec<bool>; 2],
    /// Of which bodies' mass, axial first moment and axial second moment only so much goes to the parent that there this component
    /// of m c, of m c and of the diagonal of Σ vanishes, instead of all of it.
    pub vanish_at_parent: [Vec<Option<usize>>; 3],
    /// Of which bodies' axial second moment as much stays that Σ_zz = −Σ_xx, or else −Σ_yy: then one principal entry of J vanishes,
    /// which is cheaper where only ε turns the body.
    pub axial_balances: [Vec<bool>; 2],
    /// Bodies for which [`ReducedBody::shares_axis_field`] is turned round.
    pub other_acceleration: Vec<bool>,
    /// [`ReducedBody::turns_sums`].
    pub turns_sums: Vec<bool>,
    /// Tips turned about their axis so that m c_y, Σ_xy or else Σ_yz vanishes.
    pub turned_tips: [Vec<bool>; 3],
    /// Tips whose origin is moved along their axis so that Σ_xz, or else Σ_yz, vanishes.
    pub shifted_tips: [Vec<bool>; 2],
    /// Bodies whose origin is the foot of the common normal with the axis before theirs, instead of with the one behind; behind a
    /// parallel axis, level with the origin there.
    pub origin_at_parent: Vec<bool>,
    /// [`ReducedModel::adds_angles`].
    pub adds_angles: bool,
    /// Then an offset that is no quarter turn is added, too; otherwise the addition theorem takes it. In f32 an offset is three terms,
    /// whose tails take more than the theorem.
    pub adds_offsets: bool,
    /// The unit of length \[m\], for a robot that does not slide.
    pub unit: Dd,
    /// [`ReducedModel::meeting`].
    pub meeting: Meeting,
}

impl FreeTerms {
    /// Khalil and Dombre's parameters, metres, no frame before its turn.
    pub fn plain(model: &Model<Dd>) -> Self {
        let n = model.bodies.len();
        let none = vec![false; n];
        FreeTerms {
            stays: none.clone(),
            by_axis_acceleration: none.clone(),
            by_accelerations: [0; 2].map(|_| none.clone()),
            regrouped: vec![true; n],
            doubled: [none.clone(), none.clone()],
            vanish_at_parent: [0; 3].map(|_| vec![None; n]),
            axial_balances: [0; 2].map(|_| none.clone()),
            other_acceleration: none.clone(),
            turns_sums: none.clone(),
            turned_tips: [0; 3].map(|_| none.clone()),
            shifted_tips: [0; 2].map(|_| none.clone()),
            origin_at_parent: none,
            adds_angles: false,
            adds_offsets: false,
            unit: Dd::ONE,
            meeting: Meeting::default(),
        }
    }

    /// A hash of all that is chosen.
    pub(crate) fn fingerprint(&self) -> u64 {
        let FreeTerms {
            stays,
            by_axis_acceleration,
            by_accelerations,
            regrouped,
            doubled,
            vanish_at_parent,
            axial_balances,
            other_acceleration,
            turns_sums,
            turned_tips,
            shifted_tips,
            origin_at_parent,
            adds_angles,
            adds_offsets,
            unit,
            meeting,
        } = self;
        let mut hasher = FxHasher::default();
        (stays, by_axis_acceleration, by_accelerations, regrouped, doubled, vanish_at_parent).hash(&mut hasher);
        (axial_balances, other_acceleration, turns_sums, turned_tips, shifted_tips).hash(&mut hasher);
        (origin_at_parent, adds_angles, adds_offsets, meeting).hash(&mut hasher);
        (unit.hi().to_bits(), unit.lo().to_bits()).hash(&mut hasher);
        hasher.finish()
    }
}

/// Least sine, or part of the robot's longest lever, by which a parameter that vanishes may be divided.
const WORTH: f64 = 0.02;

/// The longest lever of a robot \[m\]: from a joint to the next, or to a centre of mass. What is long and what is short is said against it.
pub fn longest_lever(model: &Model<Dd>) -> f64 {
    // where the base stands makes no difference
    let to_joints = model.bodies.iter().filter(|b| b.parent.is_some()).map(|b| b.placement.translation);
    let longest = to_joints.chain(model.bodies.iter().map(|b| b.inertia.com)).map(norm).fold(0.0, f64::max);
    match longest > 0.0 {
        true => longest,
        false => 1.0,
    }
}

fn norm(v: Vec3<Dd>) -> f64 {
    v.to_array().into_iter().map(Dd::hi).fold(0.0, f64::hypot)
}

/// The reduced robot, and the pose of each of its frames in the body's canonical frame.
pub fn reduce(model: &Model<Dd>, choice: &FreeTerms) -> (ReducedModel<Dd>, Vec<Transform<Dd>>) {
    let identity = || vec![Transform::identity(); model.bodies.len()];
    let FreeTerms { adds_angles, meeting, .. } = *choice;
    let empty = ReducedModel { bodies: Vec::new(), gravity: model.gravity, per_unit: Dd::ONE, adds_angles, meeting };
    if model.bodies.iter().any(|body| ReducedJoint::of(body.joint.kind).is_none()) {
        return (empty, identity());
    }
    let lever = longest_lever(model);
    let regauge = choose_frames(model, lever, choice);
    let mut bodies: Vec<ReducedBody<Dd>> =
        model.bodies.iter().enumerate().map(|(i, b)| in_new_frame(model, &regauge, i, b)).collect();
    for i in (0..bodies.len()).filter(|i| is_tip(model, *i)) {
        turn_tip(&mut bodies[i], [0, 1, 2].map(|k| choice.turned_tips[k][i]));
        shift_tip(&mut bodies[i], lever, [0, 1].map(|k| choice.shifted_tips[k][i]));
    }
    for i in (0..bodies.len()).rev().filter(|i| choice.regrouped[*i]) {
        let balances = [0, 1].map(|k| choice.axial_balances[k][i]);
        regroup(&mut bodies, i, lever, [0, 1, 2].map(|k| choice.vanish_at_parent[k][i]), balances);
    }
    let mut reduced = ReducedModel { bodies, ..empty };
    for i in 0..reduced.bodies.len() {
        reduced.bodies[i].stays = choice.stays[i] && reduced.may_stay(i);
        let body = &mut reduced.bodies[i];
        if adds_angles && choice.adds_offsets && body.kind == ReducedJoint::Turn {
            (body.offset, body.phase) = apart(body.offset);
        }
        body.turns_sums = choice.turns_sums[i] && body.stays;
        body.shares_axis_field ^= choice.other_acceleration[i] && body.kind == ReducedJoint::Turn;
        body.by_axis_acceleration = choice.by_axis_acceleration[i] && body.kind != ReducedJoint::Slide;
        body.by_accelerations = [0, 1].map(|k| choice.by_accelerations[k][i] && body.kind != ReducedJoint::Slide);
        let derived = body.kind == ReducedJoint::Turn && body.shares_axis_field && !body.stays;
        body.doubled = [0, 1].map(|k| choice.doubled[k][i] && derived);
    }
    (in_unit(reduced, choice.unit), regauge)
}

/// Levers and inertial parameters of a reduced robot are at most so many times the robot's own.
const PROPORTION: f64 = 1e4;

/// Whether the numbers of a reduced robot are in proportion to the robot's own, however its frames and parameters were moved; a lever more
/// for each moment. Otherwise torques would be what is left of numbers that cancel.
pub fn is_in_proportion(model: &Model<Dd>, reduced: &ReducedModel<Dd>) -> bool {
    let lever = longest_lever(model);
    let sum = |of: &dyn Fn(&Body<Dd>) -> f64| model.bodies.iter().map(of).sum::<f64>();
    let mass = sum(&|b| b.inertia.mass.hi());
    let inertia = sum(&|b| {
        let i = b.inertia.inertia_com;
        let norm = [i.xx, i.yy, i.zz, i.xy, i.xy, i.xz, i.xz, i.yz, i.yz].map(Dd::hi).into_iter().fold(0.0, f64::hypot);
        // the trace, but of tensors that are taken as written and belong to no rigid body
        norm.max(i.xx.hi() + i.yy.hi() + i.zz.hi())
    }) + mass * lever * lever;
    // lengths in metres again
    let metre = reduced.per_unit.hi();
    reduced.bodies.iter().zip(&model.bodies).all(|(body, old)| {
        let stands = if old.parent.is_none() { norm(old.placement.translation) } else { 0.0 };
        let s = body.second_moment;
        let second_moment = [s.xx, s.xy, s.xz, s.yy, s.yz, s.zz].map(Dd::hi).into_iter().fold(0.0, f64::hypot);
        [
            (norm(body.translation) / metre, lever + stands),
            (body.mass.hi().abs() * metre * metre, mass),
            (norm(body.first_moment) * metre, mass * lever),
            (second_moment, inertia),
        ]
        .into_iter()
        .all(|(found, own)| found <= PROPORTION * own)
    })
}

fn is_tip(model: &Model<Dd>, i: BodyId) -> bool {
    model.bodies.iter().all(|b| b.parent != Some(i))
}

/// Turns the frame of a tip about its axis so that m c_y, Σ_xy or else Σ_yz vanishes; the joint's offset takes it back.
fn turn_tip(body: &mut ReducedBody<Dd>, vanishes: [bool; 3]) {
    if body.kind != ReducedJoint::Turn {
        return;
    }
    let (ms, s) = (body.first_moment, body.second_moment);
    let along = |x: Dd, y: Dd| {
        let r = (x * x + y * y).sqrt();
        (y / r, x / r)
    };
    let (sin, cos) = if vanishes[0] && ms.y != Dd::ZERO {
        along(ms.x, ms.y)
    } else if vanishes[1] && s.xy != Dd::ZERO {
        // tan 2φ = 2 Σ_xy / (Σ_xx − Σ_yy), φ within an eighth of a turn
        let (x, y) = ((s.xx - s.yy).abs(), s.xy + s.xy);
        let (sin2, cos2) = along(x, if (s.xx - s.yy).hi() < 0.0 { -y } else { y });
        let half = Dd::from(0.5);
        let cos = ((Dd::ONE + cos2) * half).sqrt();
        (sin2 * half / cos, cos)
    } else if vanishes[2] && s.yz != Dd::ZERO {
        along(s.xz, s.yz)
    } else {
        return;
    };
    // own axes turned by φ: vectors by −φ
    body.first_moment = ms.turned(-sin, cos);
    body.second_moment = s.turned(-sin, cos);
    if vanishes[0] && ms.y != Dd::ZERO {
        body.first_moment.y = Dd::ZERO;
    } else if vanishes[1] && s.xy != Dd::ZERO {
        body.second_moment.xy = Dd::ZERO;
    } else {
        body.second_moment.yz = Dd::ZERO;
    }
    let (s0, c0) = body.offset;
    body.offset = (special(s0 * cos + c0 * sin), special(c0 * cos - s0 * sin));
}

/// Moves the origin of a tip along its axis so that Σ_xz, or else Σ_yz, vanishes.
fn shift_tip(body: &mut ReducedBody<Dd>, lever: f64, vanishes: [bool; 2]) {
    if body.kind != ReducedJoint::Turn {
        return;
    }
    let (m, ms, s) = (body.mass, body.first_moment, body.second_moment);
    // as for parameters that vanish at the parent: never by a small divisor
    let far = |x: Dd| x.abs().hi() > WORTH * lever * m.hi();
    let height = match vanishes {
        [true, _] if far(ms.x) => s.xz / ms.x,
        [_, true] if far(ms.y) => s.yz / ms.y,
        _ => return,
    };
    // r' = r − h z
    let moved = |k: Dd| if k.abs().hi() <= DUST * s.zz.hi() { Dd::ZERO } else { k };
    body.translation = body.translation + body.rotation.column(2).scale(height);
    body.first_moment.z = ms.z - height * m;
    let zz = s.zz - height * (ms.z + ms.z - height * m);
    body.second_moment = Sym3 { xz: moved(s.xz - height * ms.x), yz: moved(s.yz - height * ms.y), zz, ..s };
}

/// A turn by its sine and cosine, as a quarter turn or as an angle.
fn apart((s, c): (Dd, Dd)) -> ((Dd, Dd), Option<Dd>) {
    if s * c == Dd::ZERO {
        return ((s, c), None);
    }
    // one step of Newton's method on sin(φ − φ₀) = 0 from the angle in f64, which every machine has to have: the last digits are left of it
    let near = Dd::from(angle::of_point(s.hi(), c.hi()));
    let (sin, cos) = near.sin_cos();
    ((Dd::ZERO, Dd::ONE), Some(near + (s * cos - c * sin)))
}

/// The same robot with lengths in another unit: p / L, g / L, m c · L, M L². The second moment and all torques stay, as
/// long as no joint slides.
fn in_unit(mut reduced: ReducedModel<Dd>, unit: Dd) -> ReducedModel<Dd> {
    if unit == Dd::ONE {
        return reduced;
    }
    assert!(reduced.bodies.iter().all(|b| b.kind != ReducedJoint::Slide), "a unit of length is for turning joints");
    for body in &mut reduced.bodies {
        body.translation = body.translation.map(|x| if is_about(x.abs(), unit) { Real::sign(x) } else { x / unit });
        body.first_moment = body.first_moment.scale(unit);
        let mass = body.mass * unit * unit;
        body.mass = mass;
    }
    reduced.gravity = reduced.gravity.map(|x| x / unit);
    reduced.per_unit = Dd::ONE / unit;
    reduced
}

/// Units of length that make a number one, each once, the most frequent first: lengths between joints, then of gravity and
/// first moments. What is as small as dust against the robot, whose longest lever is given, is no unit.
pub fn lengths(reduced: &ReducedModel<Dd>, lever: f64) -> Vec<Dd> {
    let mut found: Vec<(Dd, usize)> = Vec::new();
    if reduced.bodies.iter().any(|b| b.kind == ReducedJoint::Slide) {
        return Vec::new();
    }
    let bodies = || reduced.bodies.iter();
    let above = |least: f64| move |x: &Dd| x.abs().hi() > least;
    let between = bodies().flat_map(|b| b.translation.to_array()).filter(above(NO_DUST * lever));
    let gravity = reduced.gravity.to_array();
    let most = gravity.iter().map(|x| x.abs().hi()).fold(0.0, f64::max);
    let heaviest = bodies().map(|b| norm(b.first_moment)).fold(0.0, f64::max);
    let moments = bodies().flat_map(|b| b.first_moment.to_array()).filter(above(NO_DUST * heaviest));
    let all = between.chain(gravity.into_iter().filter(above(NO_DUST * most))).chain(moments.map(|x| Dd::ONE / x));
    for x in all.map(Dd::abs) {
        match found.iter_mut().find(|(y, _)| is_about(x, *y)) {
            Some((_, times)) => *times += 1,
            None => found.push((x, 1)),
        }
    }
    found.sort_by_key(|(_, times)| std::cmp::Reverse(*times));
    found.into_iter().map(|(x, _)| x).collect()
}

/// Whether double-double cannot tell two positive numbers apart.
fn is_about(x: Dd, y: Dd) -> bool {
    (x - y).abs().hi() < DUST * y.hi()
}

/// A body with its inertia in its new frame, and its joint between new frames.
fn in_new_frame(model: &Model<Dd>, frames: &[Transform<Dd>], i: BodyId, body: &Body<Dd>) -> ReducedBody<Dd> {
    let own = &frames[i];
    let from_parent = match body.parent {
        Some(p) => frames[p].inverse(),
        None => Transform::identity(),
    };
    let joint = from_parent.compose(&body.placement).compose(own);
    let terms = [from_parent, body.placement, *own].map(|x| norm(x.translation)).iter().sum::<f64>();
    let inertia = &body.inertia;
    let r = own.rotation.transpose();
    let com = own.rotation.transpose_mul(inertia.com - own.translation);
    let moved = SpatialInertia::new(inertia.mass, com, inertia.inertia_com.rotated(&r));
    let rotation = joint.rotation.map(special);
    let (rotation, offset) = match body.joint.kind.slides() || body.joint.kind.turns_freely() {
        true => (rotation, (Dd::ZERO, Dd::ONE)),
        false => split_turn(&rotation),
    };
    let permutes = rotation.rows.iter().flatten().all(|x| *x == Dd::ZERO || x.abs() == Dd::ONE);
    let revolute = |b: &Body<Dd>| b.joint.kind.turns();
    let parallel = revolute(body) && body.parent.is_some_and(|p| revolute(&model.bodies[p]));
    let parent_turns = body.parent.is_some_and(|p| model.bodies[p].parent.is_some());
    ReducedBody {
        parent: body.parent,
        kind: ReducedJoint::of(body.joint.kind).expect("the reduced form is written for this joint"),
        iq: body.joint.iq,
        iv: body.joint.iv,
        rotation,
        offset,
        phase: None,
        translation: joint.translation.map(|x| dusted(x, terms)),
        mass: moved.mass,
        first_moment: moved.first_moment,
        second_moment: moved.second_moment,
        shares_axis_field: permutes || !parent_turns,
        permutes,
        parallel: parallel && rotation == Mat3::identity(),
        stays: false,
        turns_sums: false,
        by_axis_acceleration: false,
        by_accelerations: [false; 2],
        doubled: [false; 2],
    }
}

/// R = E R_z(θ₀): the turn about z that leaves E with the fewest entries, E = R_z(a) R_x(α), if that is exact.
fn split_turn(r: &Mat3<Dd>) -> (Mat3<Dd>, (Dd, Dd)) {
    let z = r.column(2);
    let sine = (z.x * z.x + z.y * z.y).sqrt();
    let none = (Dd::ZERO, Dd::ONE);
    if sine.hi() < DUST {
        // E = 1 or a half turn about x
        let flip = if z.z.hi() > 0.0 { Dd::ONE } else { -Dd::ONE };
        let x = r.row(0);
        let e = Mat3 { rows: [[Dd::ONE, Dd::ZERO, Dd::ZERO], [Dd::ZERO, flip, Dd::ZERO], [Dd::ZERO, Dd::ZERO, flip]] };
        // first row of E R_z(θ₀): (cos, −sin, 0)
        return (e, (special(-x.y), special(x.x)));
    }
    if sine.hi() < NEARLY_PARALLEL {
        return (*r, none);
    }
    // third row of R: (sin α sin θ₀, sin α cos θ₀, cos α); the sign of sin α such that θ₀ is within a quarter turn
    let row = r.row(2);
    let sign = if row.y.hi() < -DUST || (row.y.hi().abs() <= DUST && row.x.hi() < 0.0) { -Dd::ONE } else { Dd::ONE };
    let (s0, c0) = (special(row.x / (sine * sign)), special(row.y / (sine * sign)));
    // E = R R_z(−θ₀)
    let rz = Mat3 { rows: [[c0, s0, Dd::ZERO], [-s0, c0, Dd::ZERO], [Dd::ZERO, Dd::ZERO, Dd::ONE]] };
    ((*r * rz).map(special), (s0, c0))
}
