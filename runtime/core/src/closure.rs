//! Closed loops: points of two bodies that stay together, as where a rod ends on a foot, of a hinge with their axes, of a weld whichever way they turn.
//!
//! A robot with loops is the tree that is left where they are cut, moved by fewer velocities. Its configuration q holds the coordinates of all joints but
//! [followers](crate::coupling), and closes the loops. Of its velocities some are independent; those of the other joints, the dependent ones, follow from the
//! loops, as e(q) = 0 holds all the time:
//!
//! ```text
//! J_d ẋ_d + J_i q̇ = 0      ẋ_d = G q̇      ẍ_d = G q̈ + γ      J_d γ = −J̇ ẋ
//! ```
//!
//! Dependent joints stand behind independent ones in all vectors, and with G beneath the identity virtual power gives τ, H and Jacobians as for couplings
//! (constraint embedding; Featherstone 2008, section 8.11). e and its derivatives are taken in the axes of the body where both paths to the points part, so
//! what moves the loop as a whole is not in them. Loops are solved one group after the other, each for as many coordinates as it has equations.

mod dyad;
mod mechanism;
mod plane;

pub use dyad::{Dyad, DyadWay};

use crate::algorithms::{forward_kinematics, frame_acceleration, frame_velocity, jacobian};
use crate::model::{BodyId, Model};
use crate::real::Real;
use crate::spatial::Vec3;
use alloc::borrow::Cow;
use alloc::collections::BTreeSet;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use mechanism::Mechanism;
use plane::PlaneLoop;

/// A point of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopEnd<T> {
    /// The body; `None`: the world.
    pub body: Option<BodyId>,
    /// The point in its canonical frame, or in the world \[m\].
    pub point: Vec3<T>,
}

/// Two points that coincide, and vectors that stay perpendicular.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedLoop<T> {
    /// What messages and reports call it.
    pub name: String,
    /// The points, of different bodies.
    pub ends: [LoopEnd<T>; 2],
    /// Along which the points could part: three directions, or two of a plane mechanism, in the canonical frame of the body where the paths part.
    pub directions: Vec<Vec3<T>>,
    /// Unit vectors in the canonical frames of both ends' bodies, or in the world, that stay perpendicular: two across the axis of a hinge, the three of a
    /// weld, or its one in a plane. With them as columns of R, c = u · v and ċ = (ω₂ − ω₁) · (v × u).
    pub alignments: Vec<[Vec3<T>; 2]>,
}

impl<T: Copy> ClosedLoop<T> {
    /// Number of its equations.
    pub fn equations(&self) -> usize {
        self.directions.len() + self.alignments.len()
    }

    fn map<U: Copy>(&self, f: &mut impl FnMut(T) -> U) -> ClosedLoop<U> {
        let mut vector = |v: Vec3<T>| Vec3::new(f(v.x), f(v.y), f(v.z));
        ClosedLoop {
            name: self.name.clone(),
            ends: self.ends.map(|end| LoopEnd { body: end.body, point: vector(end.point) }),
            directions: self.directions.iter().map(|d| vector(*d)).collect(),
            alignments: self.alignments.iter().map(|pair| pair.map(&mut vector)).collect(),
        }
    }
}

/// Loops that are solved at once, for as many velocities as they have equations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopGroup {
    /// Indices of the loops.
    pub loops: Vec<usize>,
    /// The bodies whose joints these loops determine. Those that fewest loops contain stand first.
    pub dependents: Vec<BodyId>,
    /// How its loop, then the only one, closes in closed form.
    pub dyad: Option<Dyad>,
}

/// What closes a robot's loops.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure<T> {
    /// The loops.
    pub loops: Vec<ClosedLoop<T>>,
    /// Which joints follow from which loops; what a group needs of other dependent joints stands in groups before it.
    pub groups: Vec<LoopGroup>,
    /// A configuration in which all loops are closed: assemblies that can be reached from there are this robot.
    pub home: Vec<T>,
}

impl<T> Default for Closure<T> {
    fn default() -> Self {
        Closure { loops: Vec::new(), groups: Vec::new(), home: Vec::new() }
    }
}

impl<T: Copy> Closure<T> {
    /// Its numbers through `f`.
    pub fn map<U: Copy>(&self, mut f: impl FnMut(T) -> U) -> Closure<U> {
        Closure {
            loops: self.loops.iter().map(|l| l.map(&mut f)).collect(),
            groups: self.groups.clone(),
            home: self.home.iter().map(|x| f(*x)).collect(),
        }
    }
}

impl<T> Closure<T> {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// The bodies whose joints are determined by loops.
    pub fn dependents(&self) -> impl Iterator<Item = BodyId> + Clone + '_ {
        self.groups.iter().flat_map(|group| group.dependents.iter().copied())
    }
}

impl<T: Real> Model<T> {
    /// Number of velocity coordinates that are not followers': independent and dependent ones.
    pub fn open_nv(&self) -> usize {
        self.tree_nv() - self.couplings.len()
    }

    /// The bodies from the root to `body`, both included.
    pub(crate) fn path_to(&self, body: Option<BodyId>) -> Vec<BodyId> {
        let mut path: Vec<BodyId> = core::iter::successors(body, |&b| self.bodies[b].parent).collect();
        path.reverse();
        path
    }

    /// The bodies between the ends of a loop, without the one where the paths part.
    pub fn bodies_of_loop(&self, of: &ClosedLoop<T>) -> Vec<BodyId> {
        Mechanism::new(self, of).bodies
    }

    /// The body where the paths to the points of a loop part; `None`: the world.
    pub fn parting(&self, of: &ClosedLoop<T>) -> Option<BodyId> {
        self.bodies_of_loop(of).first().and_then(|b| self.bodies[*b].parent)
    }

    /// The bodies with independent joints that move the joint of a body: its own, the one that it follows, or those that its loops hang on.
    pub fn movers(&self, body: BodyId) -> BTreeSet<BodyId> {
        if let Some(coupling) = self.coupling_of(body) {
            return self.movers(coupling.source);
        }
        let Some(rank) = self.closure.groups.iter().position(|group| group.dependents.contains(&body)) else {
            return BTreeSet::from([body]);
        };
        let group = &self.closure.groups[rank];
        let on_loops = group.loops.iter().flat_map(|l| self.bodies_of_loop(&self.closure.loops[*l]));
        let source = |b: BodyId| self.coupling_of(b).map_or(b, |coupling| coupling.source);
        on_loops.map(source).filter(|b| !group.dependents.contains(b)).flat_map(|b| self.movers(b)).collect()
    }

    /// How far the points of a loop are apart along its directions \[m\], then how far vectors lean from being perpendicular (their cosines), from the
    /// configuration of the tree.
    pub fn gap(&self, of: &ClosedLoop<T>, y: &[T]) -> Vec<T> {
        let alone = Mechanism::new(self, of);
        let frames = alone.ends.each_ref();
        let at = forward_kinematics(&alone.model, &alone.coordinates(self, y), &frames);
        let apart = at[1].translation - at[0].translation;
        let parting = of.directions.iter().map(|direction| direction.dot(apart));
        let leaning = of.alignments.iter().map(|[u, v]| (at[0].rotation * *u).dot(at[1].rotation * *v));
        parting.chain(leaning).collect()
    }

    /// How fast they part, by rows over the velocities that are not followers'.
    pub fn gap_rows(&self, of: &ClosedLoop<T>, y: &[T]) -> Vec<Vec<T>> {
        let alone = Mechanism::new(self, of);
        let own = alone.coordinates(self, y);
        let [one, other] = alone.ends.each_ref().map(|end| jacobian(&alone.model, &own, end));
        let across: Vec<Vec3<T>> = alone.aligned(of, &own).into_iter().map(|[u, v]| v.cross(u)).collect();
        let width = alone.model.tree_nv();
        let mut rows = vec![vec![T::zero(); self.open_nv()]; of.equations()];
        for (&b, body) in alone.bodies.iter().zip(&alone.model.bodies) {
            let (first, ratio) = self.moved_by(b);
            for k in 0..body.joint.kind.nv() {
                let apart = |axis: usize| {
                    let place = axis * width + body.joint.iv + k;
                    other[place] - one[place]
                };
                let column = Vec3::new(apart(0), apart(1), apart(2));
                let mut entries: Vec<T> = of.directions.iter().map(|direction| direction.dot(column)).collect();
                if !across.is_empty() {
                    let turning = Vec3::new(apart(3), apart(4), apart(5));
                    entries.extend(across.iter().map(|across| across.dot(turning)));
                }
                for (row, entry) in rows.iter_mut().zip(entries) {
                    let entry = ratio.map_or(entry, |ratio| ratio * entry);
                    row[first + k] = row[first + k] + entry;
                }
            }
        }
        rows
    }

    /// How their parting and leaning accelerate where no joint does: J̇ ẋ \[m/s² or 1/s²\].
    fn gap_drift(&self, of: &ClosedLoop<T>, y: &[T], rates: &[T]) -> Vec<T> {
        let alone = Mechanism::new(self, of);
        let (q, qd) = (alone.coordinates(self, y), alone.rates(self, rates));
        let rest = vec![T::zero(); qd.len()];
        let [one, other] = alone.ends.each_ref().map(|end| frame_acceleration(&alone.model, &q, &qd, &rest, end));
        let apart = other.linear - one.linear;
        let mut drift: Vec<T> = of.directions.iter().map(|direction| direction.dot(apart)).collect();
        if !of.alignments.is_empty() {
            let [turn, other_turn] =
                alone.ends.each_ref().map(|end| frame_velocity(&alone.model, &q, &qd, end).angular);
            let (turning, apart) = (other_turn - turn, other.angular - one.angular);
            let of_pair = |[u, v]: [Vec3<T>; 2]| {
                let across_rate = other_turn.cross(v).cross(u) + v.cross(turn.cross(u));
                v.cross(u).dot(apart) + across_rate.dot(turning)
            };
            drift.extend(alone.aligned(of, &q).into_iter().map(of_pair));
        }
        drift
    }

    /// The velocity coordinates that a group determines.
    fn coordinates_of(&self, group: &LoopGroup) -> Vec<usize> {
        let joints = group.dependents.iter().map(|b| &self.bodies[*b].joint);
        joints.flat_map(|joint| joint.iv..joint.iv + joint.kind.nv()).collect()
    }

    /// The loop of a group that is one loop of hinges in a plane.
    fn plane_loop(&self, group: &LoopGroup, y: &[T]) -> Option<(usize, PlaneLoop<T>)> {
        let [l] = group.loops[..] else { return None };
        Some((l, PlaneLoop::new(self, &self.closure.loops[l], y)?))
    }

    /// −J̇ ẋ of a loop's equations, a number to a row.
    fn drift_of(&self, of: &ClosedLoop<T>, y: &[T], yd: &[T]) -> Vec<Vec<T>> {
        let drift = match PlaneLoop::new(self, of, y) {
            Some(plane) => plane.drift(yd),
            None => self.gap_drift(of, y, yd).into_iter().map(|x| -x).collect(),
        };
        drift.into_iter().map(|x| vec![x]).collect()
    }

    /// Solves the groups one after the other for the dependent part of some vectors over the velocities, of which the independent part is given: rows times
    /// vector is what `right` says. Vectors stand by rows, one number of each to a row.
    fn solved(&self, y: &[T], mut known: Vec<Vec<T>>, right: impl Fn(usize) -> Vec<Vec<T>>) -> Vec<Vec<T>> {
        let width = known.first().map_or(0, Vec::len);
        known.resize(self.open_nv(), vec![T::zero(); width]);
        for group in &self.closure.groups {
            let unknown = self.coordinates_of(group);
            if let Some((l, plane)) = self.plane_loop(group, y) {
                plane.solve(&unknown, &mut known, right(l));
                continue;
            }
            let (mut square, mut sides) = (Vec::new(), Vec::new());
            for &l in &group.loops {
                T::section("loop", None);
                for (row, mut side) in self.gap_rows(&self.closure.loops[l], y).iter().zip(right(l)) {
                    for (k, entry) in row.iter().enumerate().filter(|(k, _)| !unknown.contains(k)) {
                        side.iter_mut().zip(&known[k]).for_each(|(side, x)| *side = *side - *entry * *x);
                    }
                    square.push(unknown.iter().map(|k| row[*k]).collect());
                    sides.push(side);
                }
            }
            for (k, row) in unknown.into_iter().zip(solve(square, sides)) {
                known[k] = row;
            }
        }
        known
    }

    /// The rows of G of the dependent velocities, each over the independent ones.
    pub fn embedding(&self, y: &[T]) -> Vec<Vec<T>> {
        if self.closure.is_empty() {
            return Vec::new();
        }
        let nv = self.nv();
        let unit = |i: usize| (0..nv).map(|k| if i == k { T::one() } else { T::zero() }).collect();
        let right = |l: usize| vec![vec![T::zero(); nv]; self.closure.loops[l].equations()];
        self.solved(y, (0..nv).map(unit).collect(), right).split_off(nv)
    }

    /// Velocities that are not followers', from the independent ones.
    pub(crate) fn open_rates<'a>(&self, y: &[T], rates: &'a [T]) -> Cow<'a, [T]> {
        if self.closure.is_empty() {
            return Cow::Borrowed(rates);
        }
        let dependent = self.embedding(y);
        Cow::Owned(rates.iter().copied().chain(dependent.iter().map(|row| sum_of_products(row, rates))).collect())
    }

    /// γ of the dependent accelerations G q̈ + γ, from the configuration and the velocities of the tree.
    pub fn embedding_bias(&self, y: &[T], yd: &[T]) -> Vec<T> {
        if self.closure.is_empty() {
            return Vec::new();
        }
        let right = |l: usize| self.drift_of(&self.closure.loops[l], y, yd);
        let all = self.solved(y, vec![vec![T::zero()]; self.nv()], right);
        all.into_iter().skip(self.nv()).map(|row| row[0]).collect()
    }

    /// Rows of forces over the independent velocities, from such over all that are not followers'.
    pub(crate) fn independent_rows(&self, y: &[T], mut rows: Vec<T>, width: usize) -> Vec<T> {
        let nv = self.nv();
        for (d, ratios) in self.embedding(y).iter().enumerate() {
            for (i, ratio) in ratios.iter().enumerate() {
                for k in 0..width {
                    rows[i * width + k] = rows[i * width + k] + *ratio * rows[(nv + d) * width + k];
                }
            }
        }
        rows.truncate(nv * width);
        rows
    }

    /// Moves the dependent joints of q by Newton's method until the loops close, from where q has them, in so many steps; then how far the points of
    /// each loop are apart along its directions \[m\], and how far vectors lean (their cosines).
    pub fn close_loops(&self, q: &[T], steps: usize) -> (Vec<T>, Vec<T>) {
        let mut q = q.to_vec();
        for group in &self.closure.groups {
            (0..steps).for_each(|_| self.step_loops(group, &mut q));
        }
        let gaps = self.gaps(&q);
        (q, gaps)
    }

    fn gaps(&self, q: &[T]) -> Vec<T> {
        let y = self.tree_positions(q);
        self.closure.loops.iter().flat_map(|of| self.gap(of, &y)).collect()
    }

    /// One step of Newton's method for the loops of a group.
    fn step_loops(&self, group: &LoopGroup, q: &mut [T]) {
        let y = self.tree_positions(q).into_owned();
        let unknown = self.coordinates_of(group);
        let loops = || group.loops.iter().map(|l| &self.closure.loops[*l]);
        let square = loops().flat_map(|of| self.gap_rows(of, &y));
        let square = square.map(|row| unknown.iter().map(|k| row[*k]).collect()).collect();
        let gaps = loops().flat_map(|of| self.gap(of, &y)).map(|gap| vec![-gap]).collect();
        let step: Vec<T> = solve(square, gaps).into_iter().map(|row| row[0]).collect();
        let mut first = 0;
        for joint in group.dependents.iter().map(|b| &self.bodies[*b].joint) {
            let (from, to) = (joint.iq, joint.iq + joint.kind.nq());
            let (own, after) = (q[from..to].to_vec(), first + joint.kind.nv());
            joint.kind.mechanics().integrate(&own, &step[first..after], &mut q[from..to]);
            first = after;
        }
    }
}

/// Into so many displacements the way from home to a configuration is cut.
const ASSEMBLY_STEPS: usize = 32;
/// So far \[rad or m\] a dependent joint goes in one of them, and so near loops come \[m\], or the way ends there: a singular pose is near.
const LONGEST_STEP: f64 = 0.4;
const CLOSED: f64 = 1e-9;
/// What rounding leaves open [m], and so many of Newton's steps from less than [`CLOSED`] on.
const LEFT_BY_ROUNDING: f64 = 2e-15;
const LAST_STEPS: usize = 2;
/// Newton's steps from one row of a motion to the next, and how near loops have to come then \[m\].
const STEPS_ALONG_MOTIONS: usize = 20;
const CLOSED_ALONG_MOTIONS: f64 = 1e-6;

impl Model<f64> {
    fn is_closed(&self, q: &[f64], within: f64) -> bool {
        self.gaps(q).iter().all(|gap| gap.abs() < within)
    }

    /// q with what loops determine, looked for by Newton's method from where it was `before`; `None` where loops do not close to a micrometre.
    pub fn closed_from(&self, mut q: Vec<f64>, before: &[f64]) -> Option<Vec<f64>> {
        for joint in self.dependent_joints() {
            let own = joint.iq..joint.iq + joint.kind.nq();
            q[own.clone()].copy_from_slice(&before[own]);
        }
        let (q, _) = self.close_loops(&q, STEPS_ALONG_MOTIONS);
        self.is_closed(&q, CLOSED_ALONG_MOTIONS).then_some(q)
    }

    /// The configuration that is reached from [home](Closure::home) on the way to these independent coordinates: theirs, or the last one before loops can no
    /// longer be closed.
    pub fn assembled(&self, q: &[f64]) -> Vec<f64> {
        let mut at = self.closure.home.clone();
        // a base stands anywhere
        for joint in self.independent_joints().filter(|joint| joint.kind.is_base()) {
            let own = joint.iq..joint.iq + joint.kind.nq();
            at[own.clone()].copy_from_slice(&q[own]);
        }
        let way = crate::algorithms::difference(self, &at, q);
        let step: Vec<f64> = way.iter().map(|x| x / ASSEMBLY_STEPS as f64).collect();
        for _ in 0..ASSEMBLY_STEPS {
            let next = crate::algorithms::integrate(self, &at, &step);
            let goes_far = |body: BodyId| {
                let joint = &self.bodies[body].joint;
                let ends = joint.coordinates(&next).iter().zip(joint.coordinates(&at));
                ends.into_iter().any(|(to, from)| (to - from).abs() >= LONGEST_STEP)
            };
            if !self.is_closed(&next, CLOSED)
                || next.iter().any(|x| !x.is_finite())
                || self.closure.dependents().any(goes_far)
            {
                break;
            }
            at = next;
        }
        // displacements of loops of many joints leave gaps
        match self.is_closed(&at, LEFT_BY_ROUNDING) {
            true => at,
            false => self.close_loops(&at, LAST_STEPS).0,
        }
    }
}

fn sum_of_products<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::zero(), |sum, (a, b)| sum + *a * *b)
}

/// A X = B of a square A by rows, without branches: up to two unknowns by determinants, more by making the columns orthogonal one after the other, B's too,
/// which is as stable as Householder's way (Björck 1967).
fn solve<T: Real>(a: Vec<Vec<T>>, b: Vec<Vec<T>>) -> Vec<Vec<T>> {
    match &a[..] {
        [] => Vec::new(),
        [row] => vec![b[0].iter().map(|x| *x / row[0]).collect()],
        [one, other] => {
            let inverse = T::one() / (one[0] * other[1] - one[1] * other[0]);
            let of = |p: T, r: T, q: T, s: T| (p * s - r * q) * inverse;
            let sides = || b[0].iter().zip(&b[1]);
            vec![
                sides().map(|(x, y)| of(*x, *y, one[1], other[1])).collect(),
                sides().map(|(x, y)| of(one[0], other[0], *x, *y)).collect(),
            ]
        }
        _ => by_orthogonal_columns(a, b),
    }
}

fn by_orthogonal_columns<T: Real>(a: Vec<Vec<T>>, b: Vec<Vec<T>>) -> Vec<Vec<T>> {
    let (n, width) = (a.len(), b[0].len());
    let column = |k: usize| a.iter().zip(&b).map(move |(a, b)| if k < n { a[k] } else { b[k - n] }).collect();
    let mut columns: Vec<Vec<T>> = (0..n + width).map(column).collect();
    let mut r = vec![vec![T::zero(); n + width]; n];
    for k in 0..n {
        let (done, rest) = columns.split_at_mut(k + 1);
        let own = &done[k];
        let inverse = T::one() / sum_of_products(own, own);
        for (j, other) in rest.iter_mut().enumerate() {
            let part = sum_of_products(own, other) * inverse;
            r[k][k + 1 + j] = part;
            other.iter_mut().zip(own).for_each(|(x, own)| *x = *x - part * *own);
        }
    }
    let mut x = vec![vec![T::zero(); width]; n];
    for k in (0..n).rev() {
        for j in 0..width {
            let known = (k + 1..n).fold(r[k][n + j], |sum, i| sum - r[k][i] * x[i][j]);
            x[k][j] = known;
        }
    }
    x
}
