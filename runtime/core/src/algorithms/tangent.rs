//! Displacements of a configuration along its tangent, and how tangents are carried along them.
//!
//! q ⊕ v adds v to the coordinates of most joints; a floating base it moves by the exponential of the body twist v = (linear, angular), M exp v, through any angle,
//! and a ball joint it turns, R exp v. `difference` is the inverse, through at most half a turn. Derivatives by q are by increments of the tangent (a base: of its
//! pose in its own axes), and so are those of configurations.

use crate::joint::TwistMap;
use crate::model::{Joint, Model};
use crate::spatial::Vec3;
use crate::Real;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

/// q ⊕ v. Quaternions are taken as of length one, whatever their length but zero, and come out so. Joints that loops determine go along G v, and from
/// there in two steps of Newton's to where the loops close.
pub fn integrate<T: Real>(model: &Model<T>, q: &[T], v: &[T]) -> Vec<T> {
    let to = open_integrate(model, q, &model.open_rates(&model.tree_positions(q), v));
    match model.closure.is_empty() {
        true => to,
        false => model.close_loops(&to, STEPS_ALONG_LOOPS).0,
    }
}

/// How often loops are closed by Newton's method where a displacement has led: each step squares what is left, which is of the square of the displacement.
const STEPS_ALONG_LOOPS: usize = 2;

fn open_integrate<T: Real>(model: &Model<T>, q: &[T], v: &[T]) -> Vec<T> {
    let mut to = vec![T::zero(); q.len()];
    for joint in model.free_joints() {
        let own = &mut to[joint.iq..joint.iq + joint.kind.nq()];
        joint.kind.mechanics().integrate(joint.coordinates(q), joint.rates(v), own);
    }
    to
}

/// v of q ⊕ v = q₁, the shortest one: a base or a ball joint turns by at most π. Quaternions q and −q are the same.
pub fn difference<T: Real>(model: &Model<T>, q: &[T], q1: &[T]) -> Vec<T> {
    let mut v = vec![T::zero(); model.nv()];
    for joint in model.independent_joints() {
        let own = &mut v[joint.iv..joint.iv + joint.kind.nv()];
        joint.kind.mechanics().difference(joint.coordinates(q), joint.coordinates(q1), own);
    }
    v
}

/// A linear map of the tangent: joint by joint, the same number on the diagonal for most.
#[derive(Clone, Debug)]
pub struct TangentMap<T> {
    others: T,
    /// Of joints with others: the places of their rates, which are a twist, linear before angular, or a turn alone.
    twists: Vec<(Range<usize>, TwistMap<T>)>,
}

impl<T: Real> TangentMap<T> {
    /// The products with the columns of a matrix by rows, `columns` of them; of a vector with one.
    pub fn times(&self, matrix: &[T], columns: usize) -> Vec<T> {
        let mut product: Vec<T> = matrix.iter().map(|x| self.others * *x).collect();
        for (rates, map) in &self.twists {
            for k in 0..columns {
                let vector = |first: usize| {
                    let [x, y, z] = [0, 1, 2].map(|i| matrix[(first + i) * columns + k]);
                    Vec3::new(x, y, z)
                };
                let mut put = |first: usize, moved: Vec3<T>| {
                    let moved = moved.to_array().into_iter().enumerate();
                    moved.for_each(|(i, x)| product[(first + i) * columns + k] = x);
                };
                let (first, after) = (rates.start, rates.end - 3);
                if first == after {
                    put(first, map.apply_to_turn(vector(first)));
                } else {
                    let [linear, angular] = map.apply([vector(first), vector(after)]);
                    put(first, linear);
                    put(after, angular);
                }
            }
        }
        product
    }

    /// By rows, for so many velocity coordinates.
    pub fn matrix(&self, nv: usize) -> Vec<T> {
        let unit: Vec<T> = (0..nv * nv).map(|k| if k % (nv + 1) == 0 { T::one() } else { T::zero() }).collect();
        self.times(&unit, nv)
    }
}

/// Two maps of a robot from those of its joints.
fn maps<T: Real>(
    model: &Model<T>,
    others: [T; 2],
    of_joint: impl Fn(&Joint) -> Option<[TwistMap<T>; 2]>,
) -> [TangentMap<T>; 2] {
    let places = |joint: &Joint| joint.iv..joint.iv + joint.kind.nv();
    let own = |k: usize| model.free_joints().filter_map(|joint| Some((places(joint), of_joint(joint)?[k]))).collect();
    [0, 1].map(|k| TangentMap { others: others[k], twists: own(k) })
}

/// How q ⊕ v moves, in its own tangent, with q and with v: Ad(exp(−v)) and J_r(v) of a base or a ball joint, 1 of other joints.
pub fn integrate_maps<T: Real>(model: &Model<T>, v: &[T]) -> [TangentMap<T>; 2] {
    maps(model, [T::one(); 2], |joint| joint.kind.mechanics().integrate_maps(joint.rates(v)))
}

/// How v of q ⊕ v = q₁ moves with q and with q₁: −J_r⁻¹(−v) and J_r⁻¹(v) of a base or a ball joint, ∓ 1 of other joints.
pub fn difference_maps<T: Real>(model: &Model<T>, v: &[T]) -> [TangentMap<T>; 2] {
    maps(model, [-T::one(), T::one()], |joint| joint.kind.mechanics().difference_maps(joint.rates(v)))
}

/// u̇ where q ⊕ u, q held, moves with q̇: J_r⁻¹(u) q̇ of a base or a ball joint up to the square of ad, of which the next term is ad⁴/720.
pub fn displacement_rate<T: Real>(model: &Model<T>, u: &[T], qd: &[T]) -> Vec<T> {
    displacement_rate_maps(model, u, qd)[0].times(qd, 1)
}

/// How [`displacement_rate`] changes with q̇ and with u.
pub fn displacement_rate_maps<T: Real>(model: &Model<T>, u: &[T], qd: &[T]) -> [TangentMap<T>; 2] {
    let of_joint = |joint: &Joint| joint.kind.mechanics().displacement_rate(joint.rates(u), joint.rates(qd));
    maps(model, [T::one(), T::zero()], of_joint)
}
