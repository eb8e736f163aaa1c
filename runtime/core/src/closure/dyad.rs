//! Loops that close in closed form: a crank brings two points to their distance, a pivot turns one onto the other.
//!
//! A crank is one joint, a hinge or a slide, and a pivot one hinge in a plane, or two whose axes meet. Whichever way the pivot stands, its centre c keeps its
//! distances to what it carries; so the crank alone decides whether the point e that the pivot carries can meet the point g: where |e − c| = |g − c|
//! (subproblems of Paden and Kahan; Murray, Li, Sastry 1994, section 3.2). For a hinge this is A cos δ + B sin δ = C, and
//!
//! ```text
//! sin δ ~ B C − A S,   cos δ ~ A C + B S   with S = ±√(A² + B² − C²)
//! ```
//!
//! with the sign of B in the assembly where the joint stands, and the other one in the other. The angle comes from both, so that from wherever a joint stands
//! it is off by some roundings of one radian at most. Four-bars, slider-cranks, cylinders, and rods with a universal joint are such loops.

use super::{ClosedLoop, LoopGroup, Mechanism};
use crate::algorithms::forward_kinematics;
use crate::dd::Dd;
use crate::model::{BodyId, Frame, Model};
use crate::real::Real;
use crate::spatial::{Transform, Vec3};
use alloc::string::String;
use alloc::vec::Vec;

/// The dependent joints of a loop that closes in closed form.
#[derive(Clone, Debug, PartialEq)]
pub struct Dyad {
    /// The body whose joint brings the points to their distance.
    pub crank: BodyId,
    /// The bodies whose hinges turn one point onto the other: one, or two that follow each other and whose axes meet where the second one stands.
    pub pivot: Vec<BodyId>,
    /// In which of its two assemblies it closes.
    pub way: DyadWay,
}

/// By what moves at its crank, in which assembly a dyad closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DyadWay {
    /// The one in which it stands.
    AsItStands,
    /// The one where B is positive.
    Positive,
    /// The one where B is negative.
    Negative,
}

impl DyadWay {
    /// The sign of B.
    fn sign<T: Real>(self, standing: T) -> T {
        match self {
            DyadWay::AsItStands => side_of(standing),
            DyadWay::Positive => T::one(),
            DyadWay::Negative => -T::one(),
        }
    }
}

/// What a loop looks like, in the axes of the body where its paths part.
struct DyadPose<T> {
    /// Where the pivot stands.
    centre: Vec3<T>,
    /// The point that the pivot carries.
    carried: Vec3<T>,
    /// The point that it has to meet.
    met: Vec3<T>,
    crank: Transform<T>,
    /// Axes of the pivot's hinges.
    axes: Vec<Vec3<T>>,
}

/// Which points a crank moves against each other.
#[derive(Clone, Copy)]
enum CrankSide {
    /// It carries the pivot.
    Before,
    /// The pivot carries it.
    Behind,
    /// It is on the other path.
    Beyond,
}

impl Dyad {
    fn pose<T: Real>(&self, whole: &Model<T>, of: &ClosedLoop<T>, q: &[T]) -> (DyadPose<T>, CrankSide) {
        let alone = Mechanism::new(whole, of);
        let place = |b: BodyId| alone.bodies.iter().position(|own| *own == b).expect("its joints are on the loop");
        let at = |b: BodyId| Frame { name: String::new(), body: Some(place(b)), placement: Transform::identity() };
        let own: Vec<Frame<T>> = self.pivot.iter().chain([&self.crank]).map(|b| at(*b)).collect();
        let frames: Vec<&Frame<T>> = alone.ends.iter().chain(&own).collect();
        let poses = forward_kinematics(&alone.model, &alone.coordinates(whole, &whole.tree_positions(q)), &frames);
        let (ends, rest) = poses.split_at(2);
        let (pivot, crank) = rest.split_at(self.pivot.len());
        let paths = alone.ends.each_ref().map(|end| alone.model.path_to(end.body));
        let last = place(*self.pivot.last().expect("a pivot has hinges"));
        let side = usize::from(paths[1].contains(&last));
        let rank = |b: usize| paths[side].iter().position(|own| *own == b);
        let crank_side = match rank(place(self.crank)) {
            None => CrankSide::Beyond,
            Some(own) if Some(own) < rank(last) => CrankSide::Before,
            Some(_) => CrankSide::Behind,
        };
        let pose = DyadPose {
            centre: pivot[pivot.len() - 1].translation,
            carried: ends[side].translation,
            met: ends[1 - side].translation,
            crank: crank[0],
            axes: pivot.iter().map(|pose| pose.rotation.column(2)).collect(),
        };
        (pose, crank_side)
    }

    /// The assembly in which the loop stands in this configuration.
    pub fn way_at(&self, whole: &Model<f64>, of: &ClosedLoop<f64>, q: &[f64]) -> DyadWay {
        let (pose, side) = self.pose(whole, of, q);
        let slides = whole.bodies[self.crank].joint.kind.slides();
        let b = if slides { pose.sliding(side) } else { pose.turning(side) };
        if b < 0.0 {
            DyadWay::Negative
        } else {
            DyadWay::Positive
        }
    }

    /// Moves the crank, then the pivot from its last hinge on, in the configuration q.
    fn close<T: Real>(&self, whole: &Model<T>, of: &ClosedLoop<T>, q: &mut [T]) {
        let (pose, side) = self.pose(whole, of, q);
        let kind = whole.bodies[self.crank].joint.kind;
        let step = if kind.slides() { pose.slide(side, self.way) } else { pose.turn(side, self.way) };
        let mut add = |body: BodyId, step: T| {
            let own = &mut q[whole.bodies[body].joint.iq];
            *own = *own + step;
            q.to_vec()
        };
        let mut stands = add(self.crank, step);
        if let [_, inner] = self.pivot[..] {
            let (pose, _) = self.pose(whole, of, &stands);
            stands = add(inner, pose.turn_within());
        }
        let (pose, _) = self.pose(whole, of, &stands);
        add(self.pivot[0], pose.turn_onto());
    }
}

impl<T: Real> DyadPose<T> {
    /// The point that a crank moves, the one to which its distance counts, and the square of that.
    fn of_crank(&self, side: CrankSide) -> (Vec3<T>, Vec3<T>, T) {
        let square = |v: Vec3<T>| v.dot(v);
        match side {
            CrankSide::Before => (self.centre, self.met, square(self.carried - self.centre)),
            CrankSide::Behind => (self.carried, self.centre, square(self.met - self.centre)),
            CrankSide::Beyond => (self.met, self.centre, square(self.carried - self.centre)),
        }
    }

    /// By how much a crank that is a hinge turns.
    fn turn(&self, side: CrankSide, way: DyadWay) -> T {
        let (moved, fixed, square) = self.of_crank(side);
        let axis = self.crank.rotation.column(2);
        let apart = moved - fixed;
        let a = self.seen_from_crank(fixed).dot(self.seen_from_crank(moved))
            - axis.dot(self.seen_from_crank(fixed)) * axis.dot(self.seen_from_crank(moved));
        let more = (apart.dot(apart) - square) * T::constant(Dd::HALF);
        turn_to(a, self.turning(side), more, way)
    }

    fn seen_from_crank(&self, point: Vec3<T>) -> Vec3<T> {
        point - self.crank.translation
    }

    /// B of a hinge.
    fn turning(&self, side: CrankSide) -> T {
        let (moved, fixed, _) = self.of_crank(side);
        self.seen_from_crank(fixed).dot(self.crank.rotation.column(2).cross(self.seen_from_crank(moved)))
    }

    /// B of a slide.
    fn sliding(&self, side: CrankSide) -> T {
        let (moved, fixed, _) = self.of_crank(side);
        self.crank.rotation.column(2).dot(moved - fixed)
    }

    /// How far one that is a slide goes: δ² + 2 B δ + 2 C = 0, δ = S − B.
    fn slide(&self, side: CrankSide, way: DyadWay) -> T {
        let (moved, fixed, square) = self.of_crank(side);
        let (apart, b) = (moved - fixed, self.sliding(side));
        let c = apart.dot(apart) - square;
        way.sign(b) * if_positive(b * b - c).sqrt() - b
    }

    /// By how much the last of two hinges turns: until the carried point is as far along the first one's axis as the one that it meets.
    fn turn_within(&self) -> T {
        let (outer, inner) = (self.axes[0], self.axes[1]);
        let (carried, met) = (self.carried - self.centre, self.met - self.centre);
        turn_to(
            outer.dot(carried) - outer.dot(inner) * inner.dot(carried),
            outer.dot(inner.cross(carried)),
            outer.dot(met - carried),
            DyadWay::AsItStands,
        )
    }

    /// By how much the first hinge turns: the carried point onto the one that it meets.
    fn turn_onto(&self) -> T {
        let axis = self.axes[0];
        let (carried, met) = (self.carried - self.centre, self.met - self.centre);
        let cos = carried.dot(met) - axis.dot(carried) * axis.dot(met);
        let sin = axis.dot(carried.cross(met));
        angle_of(sin, cos)
    }
}

/// δ of A cos δ + B sin δ = A + `more`. Where nothing solves it, δ stays finite.
fn turn_to<T: Real>(a: T, b: T, more: T, way: DyadWay) -> T {
    // A² + B² − C², without the difference of squares of which A is the greater part of both
    let square = b * b - more * (more + a + a);
    let (c, s) = (a + more, way.sign(b) * if_positive(square).sqrt());
    angle_of(b * c - a * s, a * c + b * s)
}

/// 1, or −1 below zero.
fn side_of<T: Real>(x: T) -> T {
    (x.sign() + x.sign() + T::one()).sign()
}

/// The angle of a direction: tan(δ/2) = sin/(1 + cos) on the side where cos is positive, where that does not cancel, and π less it on the other.
fn angle_of<T: Real>(sin: T, cos: T) -> T {
    let side = side_of(cos);
    let acute = twice_arc_tangent(sin / (side * cos + (cos * cos + sin * sin).sqrt()));
    let straight = (T::one() - side) * side_of(sin) * T::constant(Dd::PI * Dd::HALF);
    side * acute + straight
}

/// The number, or 0 in place of a negative one.
fn if_positive<T: Real>(x: T) -> T {
    x * (T::one() + x.sign()) * T::constant(Dd::HALF)
}

/// So often an angle is halved before its series: its tangent, 1 at most, is then at most tan π/16.
const HALVINGS: i32 = 2;
/// Terms of the series: the next one would be 3e-20 of the first.
const TERMS: u32 = 13;

/// 2 atan t, by tan(x/2) = tan x/(1 + √(1 + tan² x)) and the series of Gregory.
fn twice_arc_tangent<T: Real>(t: T) -> T {
    let halved = (0..HALVINGS).fold(t, |t, _| t / (T::one() + (T::one() + t * t).sqrt()));
    let square = halved * halved;
    let coefficient = |k: u32| {
        let sign = if k.is_multiple_of(2) { Dd::ONE } else { -Dd::ONE };
        T::constant(sign / Dd::from(f64::from(2 * k + 1)))
    };
    let series = (0..TERMS - 1).rev().fold(coefficient(TERMS - 1), |sum, k| coefficient(k) + square * sum);
    halved * series * T::constant(Dd::from(f64::from(1 << (HALVINGS + 1))))
}

impl<T: Real> Model<T> {
    /// As [`Model::close_loops`], but in closed form where a group of loops has one.
    pub fn assemble_loops(&self, q: &[T], steps: usize) -> (Vec<T>, Vec<T>) {
        let mut q = q.to_vec();
        for group in &self.closure.groups {
            match &group.dyad {
                Some(dyad) => dyad.close(self, self.only_loop(group), &mut q),
                None => (0..steps).for_each(|_| self.step_loops(group, &mut q)),
            }
        }
        let gaps = self.gaps(&q);
        (q, gaps)
    }

    fn only_loop(&self, group: &LoopGroup) -> &ClosedLoop<T> {
        &self.closure.loops[group.loops[0]]
    }
}
