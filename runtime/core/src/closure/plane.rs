//! Plane loops of hinges, in the velocities of links instead of joints.
//!
//! The vectors ℓ_k from joint to joint along both paths of such a loop close, and each turns with the sum ω_k of the joints' velocities up to it:
//!
//! ```text
//! Σ ω_k × ℓ_k = 0      Σ (α_k × ℓ_k − ω_k² ℓ_k) = 0
//! ```
//!
//! With ω_k of the dependent joints' links as unknowns, joints before them move nothing behind them, so that what is crossed are the links themselves: a
//! four-bar takes the three products ℓ_i × ℓ_j of the textbooks (Freudenstein 1955).

use super::{solve, ClosedLoop, Mechanism};
use crate::model::{BodyId, Frame, Model};
use crate::real::Real;
use crate::spatial::{Transform, Vec3};
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

/// A link between two joints of a loop, or a joint and the point.
struct PlaneLink<T> {
    /// The velocity coordinate of the joint that carries it.
    iv: usize,
    axis: Vec3<T>,
    /// From this joint to the next one, or to the point; of the first path, the other way.
    vector: Vec3<T>,
}

/// A loop whose joints are all hinges about parallel axes.
pub(super) struct PlaneLoop<T> {
    paths: [Vec<PlaneLink<T>>; 2],
    directions: [Vec3<T>; 2],
}

impl<T: Real> PlaneLoop<T> {
    /// `None` of other loops, and of those with joints that follow others.
    pub fn new(whole: &Model<T>, of: &ClosedLoop<T>, y: &[T]) -> Option<Self> {
        let ([one, other], []) = (&of.directions[..], &of.alignments[..]) else { return None };
        let alone = Mechanism::new(whole, of);
        let is_hinge = |b: &BodyId| whole.bodies[*b].joint.kind.turns() && whole.coupling_of(*b).is_none();
        if !alone.bodies.iter().all(is_hinge) {
            return None;
        }
        let at = |b| Frame { name: String::new(), body: Some(b), placement: Transform::identity() };
        let frames: Vec<Frame<T>> = (0..alone.bodies.len()).map(at).collect();
        let poses = crate::algorithms::forward_kinematics(
            &alone.model,
            &alone.coordinates(whole, y),
            &frames.iter().collect::<Vec<_>>(),
        );
        let link = |end: &Frame<T>, path: &[BodyId], k: usize| {
            let rotation = poses[path[k]].rotation;
            let along = match path.get(k + 1) {
                Some(next) => alone.model.bodies[*next].placement.translation,
                None => end.placement.translation,
            };
            let iv = whole.bodies[alone.bodies[path[k]]].joint.iv;
            PlaneLink { iv, axis: rotation.column(2), vector: rotation * along }
        };
        let mut paths = alone.ends.each_ref().map(|end| {
            let path = alone.model.path_to(end.body);
            (0..path.len()).map(|k| link(end, &path, k)).collect::<Vec<_>>()
        });
        paths[0].iter_mut().for_each(|link| link.vector = -link.vector);
        Some(PlaneLoop { paths, directions: [*one, *other] })
    }

    fn in_plane(&self, v: Vec3<T>) -> [T; 2] {
        self.directions.map(|direction| direction.dot(v))
    }

    /// −J̇ ẋ of its two equations, from the velocities of the tree: Σ ω_k² ℓ_k.
    pub fn drift(&self, rates: &[T]) -> Vec<T> {
        let mut sum = Vec3::zero();
        for path in &self.paths {
            let mut rate = T::zero();
            for (k, link) in path.iter().enumerate() {
                let turned = if k == 0 { rate } else { rate * same_way(link.axis, path[k - 1].axis) };
                rate = turned + rates[link.iv];
                sum = sum + link.vector.scale(rate * rate);
            }
        }
        self.in_plane(sum).to_vec()
    }

    /// Solves for the rows of `known` that are `unknown`: rows of the equations times vectors are `sides`.
    pub fn solve(&self, unknown: &[usize], known: &mut [Vec<T>], mut sides: Vec<Vec<T>>) {
        T::section("loop", None);
        let mut square = vec![vec![T::zero(); unknown.len()]; 2];
        for path in &self.paths {
            let mut reach = Vec3::zero();
            for link in path.iter().rev() {
                reach = link.vector + reach;
                let column = self.in_plane(link.axis.cross(reach));
                match unknown.iter().position(|iv| *iv == link.iv) {
                    Some(place) => {
                        square.iter_mut().zip(column).for_each(|(row, entry)| row[place] = entry);
                        reach = Vec3::zero();
                    }
                    None => {
                        for (side, entry) in sides.iter_mut().zip(column) {
                            side.iter_mut().zip(&known[link.iv]).for_each(|(side, x)| *side = *side - entry * *x);
                        }
                    }
                }
            }
        }
        let of_links = solve(square, sides);
        for path in &self.paths {
            // how the link before turns, by its own axis
            let mut before: Option<(Vec3<T>, Vec<T>)> = None;
            for link in path {
                let carried = before.as_ref().map(|(axis, rate)| {
                    let way = same_way(link.axis, *axis);
                    rate.iter().map(|x| *x * way).collect::<Vec<T>>()
                });
                let place = unknown.iter().position(|iv| *iv == link.iv);
                let own = match (place, &carried) {
                    (Some(place), None) => of_links[place].clone(),
                    (Some(place), Some(carried)) => {
                        of_links[place].iter().zip(carried).map(|(all, carried)| *all - *carried).collect()
                    }
                    (None, _) => known[link.iv].clone(),
                };
                let turned = match (place, carried) {
                    (Some(place), _) => of_links[place].clone(),
                    (None, Some(carried)) => carried.into_iter().zip(&own).map(|(a, b)| a + *b).collect(),
                    (None, None) => own.clone(),
                };
                known[link.iv] = own;
                before = Some((link.axis, turned));
            }
        }
    }
}

/// 1, or −1 where parallel axes point against each other.
fn same_way<T: Real>(one: Vec3<T>, other: Vec3<T>) -> T {
    one.dot(other).sign()
}
