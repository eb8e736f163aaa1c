//! How vectors cross the joints of a [`ReducedModel`], and by which angle.
//!
//! A chain of parallel joints turns about one direction. Its *base axes* are those that the first of them has before it
//! turns; a body that [stays](ReducedBody::stays) is described in them, one that does not in its own axes, which the sum of
//! the angles turns from the base axes. Sine and cosine of the sum come from the sum as if it were formed exactly, as a
//! rounded sum would lose |q| ε, which is all of the fraction for angles of many turns; or from those of its terms by the
//! addition theorem.

use crate::joint::quaternion::quaternion_to_rotation;
use crate::real::Real;
use crate::reduced::{ReducedBody, ReducedJoint, ReducedModel};
use crate::spatial::{Mat3, Vec3};
use alloc::vec::Vec;

/// From the axes in which a body is described to those in which its parent is.
#[derive(Clone)]
pub(super) struct Turn<T> {
    /// Sine and cosine of the angle from the base axes to the body's own; none for joints that do not turn so.
    pub angle: Option<(T, T)>,
    /// How that angle changes, for scalars that ask.
    turning: Option<T>,
    /// Whether the base axes are those of the parent, which is described in them too.
    pub continues: bool,
    /// The terms of the angle besides constant offsets, and sine and cosine of those, where angles are added.
    sum: (Vec<T>, (T, T)),
    /// Rotation of a floating base or a ball joint, from the body's own axes, which are its base axes, to those of its joint.
    pub free: Option<Mat3<T>>,
}

impl<T: Real> Turn<T> {
    /// Of all bodies.
    pub fn all(model: &ReducedModel<T>, q: &[T]) -> Vec<Self> {
        T::section("sines and cosines", None);
        let mut turns: Vec<Turn<T>> = Vec::with_capacity(model.bodies.len());
        for (i, body) in model.bodies.iter().enumerate() {
            let none = || (Vec::new(), (T::zero(), T::one()));
            let turn = match body.kind {
                ReducedJoint::Turn => {
                    let continued = body.parent.filter(|p| body.parallel && model.bodies[*p].stays);
                    let (mut sum, mut angle) = (none(), None);
                    if model.adds_angles {
                        let (mut terms, offset) = continued.map_or_else(none, |p| turns[p].sum.clone());
                        let name = if terms.is_empty() { ("sin_q", "cos_q") } else { ("sin_sum", "cos_sum") };
                        terms.push(q[body.iq]);
                        terms.extend(body.phase);
                        let (s, c) = T::sin_cos_of_sum(&terms);
                        let offset = sum_of_angles(offset, body.offset);
                        angle = Some(sum_of_angles((s.named(name.0, i, ""), c.named(name.1, i, "")), offset));
                        sum = (terms, offset);
                    }
                    let angle = angle.unwrap_or_else(|| {
                        let own = own_angle(i, body, q);
                        match continued.and_then(|p| turns[p].angle) {
                            Some(before) => sum_of_angles(own, before),
                            None => own,
                        }
                    });
                    let before = continued.and_then(|p| turns[p].turning);
                    let terms = [Some(q[body.iq]), body.phase].into_iter().flatten().filter_map(T::turning);
                    let turning = before.into_iter().chain(terms).reduce(|sum, term| sum + term);
                    Turn { angle: Some(angle), turning, continues: continued.is_some(), sum, free: None }
                }
                ReducedJoint::Slide => Turn { angle: None, turning: None, continues: false, sum: none(), free: None },
                ReducedJoint::Free | ReducedJoint::Ball => {
                    let rotation = quaternion_to_rotation(body.quaternion(q));
                    Turn { angle: None, turning: None, continues: false, sum: none(), free: Some(rotation) }
                }
            };
            turns.push(turn);
        }
        turns
    }

    /// From the axes of the parent's description to the base axes.
    pub fn parent_to_base(&self, body: &ReducedBody<T>, v: Vec3<T>) -> Vec3<T> {
        match (&self.free, self.continues) {
            (Some(r), _) => r.transpose_mul(body.rotation.transpose_mul(v)),
            (None, true) => v,
            (None, false) => body.rotation.transpose_mul(v),
        }
    }

    /// From the base axes to those of the parent's description.
    pub fn base_to_parent(&self, body: &ReducedBody<T>, v: Vec3<T>) -> Vec3<T> {
        match (&self.free, self.continues) {
            (Some(r), _) => body.rotation * (*r * v),
            (None, true) => v,
            (None, false) => body.rotation * v,
        }
    }

    /// From the base axes to the body's own.
    pub fn base_to_own(&self, v: Vec3<T>) -> Vec3<T> {
        self.angle.map_or(v, |(s, c)| v.turned_about((-s, c), self.turning.map(|x| -x)))
    }

    /// From the axes in which the body is described to the base axes.
    pub fn described_to_base(&self, body: &ReducedBody<T>, v: Vec3<T>) -> Vec3<T> {
        match self.angle {
            Some(angle) if !body.stays => v.turned_about(angle, self.turning),
            _ => v,
        }
    }

    /// From the axes in which the body is described to those in which its parent is.
    pub fn described_to_parent(&self, body: &ReducedBody<T>, v: Vec3<T>) -> Vec3<T> {
        self.base_to_parent(body, self.described_to_base(body, v))
    }

    /// The way back.
    pub fn parent_to_described(&self, body: &ReducedBody<T>, v: Vec3<T>) -> Vec3<T> {
        let base = self.parent_to_base(body, v);
        if body.stays {
            base
        } else {
            self.base_to_own(base)
        }
    }

    /// A constant vector of the body, in the axes in which it is described.
    pub fn own_to_described(&self, body: &ReducedBody<T>, v: Vec3<T>) -> Vec3<T> {
        match self.angle {
            Some(angle) if body.stays => v.turned_about(angle, self.turning),
            _ => v,
        }
    }
}

/// Sine and cosine of the angle by which a revolute joint has turned, offsets included.
pub(super) fn own_angle<T: Real>(i: usize, body: &ReducedBody<T>, q: &[T]) -> (T, T) {
    let (s, c) = match body.phase {
        Some(phase) => T::sin_cos_of_sum(&[q[body.iq], phase]),
        None => q[body.iq].sin_cos(),
    };
    sum_of_angles((s.named("sin_q", i, ""), c.named("cos_q", i, "")), body.offset)
}

/// Sine and cosine of α + β.
fn sum_of_angles<T: Real>((sa, ca): (T, T), (sb, cb): (T, T)) -> (T, T) {
    (sa * cb + ca * sb, ca * cb - sa * sb)
}
