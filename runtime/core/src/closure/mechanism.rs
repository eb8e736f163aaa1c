//! A loop as a robot of its own.

use super::{ClosedLoop, Closure};
use crate::algorithms::forward_kinematics;
use crate::model::{Body, BodyId, Frame, Joint, Model};
use crate::real::Real;
use crate::spatial::{Mat3, Transform, Vec3};
use alloc::string::String;
use alloc::vec::Vec;

/// A loop alone: the bodies on both paths from the one where they part, as a robot that stands there.
pub(super) struct Mechanism<T> {
    pub model: Model<T>,
    /// Its bodies in the whole robot.
    pub bodies: Vec<BodyId>,
    pub ends: [Frame<T>; 2],
}

impl<T: Real> Mechanism<T> {
    pub fn new(whole: &Model<T>, of: &ClosedLoop<T>) -> Self {
        let [mut one, mut other] = of.ends.map(|end| whole.path_to(end.body));
        let common = one.iter().zip(&other).take_while(|(a, b)| a == b).count();
        let bodies: Vec<BodyId> = one.drain(common..).chain(other.drain(common..)).collect();
        let place = |body: Option<BodyId>| body.and_then(|body| bodies.iter().position(|b| *b == body));
        let (mut iq, mut iv) = (0, 0);
        let mut own = Vec::with_capacity(bodies.len());
        for &b in &bodies {
            let body = &whole.bodies[b];
            let joint = Joint { iq, iv, ..body.joint.clone() };
            (iq, iv) = (iq + joint.kind.nq(), iv + joint.kind.nv());
            own.push(Body { parent: place(body.parent), joint, ..body.clone() });
        }
        let ends = of.ends.map(|end| Frame {
            name: String::new(),
            body: place(end.body),
            placement: Transform { rotation: Mat3::identity(), translation: end.point },
        });
        let model = Model {
            name: String::new(),
            bodies: own,
            couplings: Vec::new(),
            closure: Closure::default(),
            gravity: Vec3::zero(),
            frames: Vec::new(),
            drives: Vec::new(),
            base_parameters: Default::default(),
        };
        Mechanism { model, bodies, ends }
    }

    pub fn coordinates(&self, whole: &Model<T>, y: &[T]) -> Vec<T> {
        self.bodies.iter().flat_map(|b| whole.bodies[*b].joint.coordinates(y)).copied().collect()
    }

    pub fn rates(&self, whole: &Model<T>, rates: &[T]) -> Vec<T> {
        self.bodies.iter().flat_map(|b| whole.bodies[*b].joint.rates(rates)).copied().collect()
    }

    /// The vectors that stay perpendicular, in the axes of the body where the paths part, from coordinates of its own.
    pub fn aligned(&self, of: &ClosedLoop<T>, own: &[T]) -> Vec<[Vec3<T>; 2]> {
        if of.alignments.is_empty() {
            return Vec::new();
        }
        let at = forward_kinematics(&self.model, own, &self.ends.each_ref());
        of.alignments.iter().map(|[u, v]| [at[0].rotation * *u, at[1].rotation * *v]).collect()
    }
}
