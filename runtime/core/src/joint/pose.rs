//! Where a body stands against its parent, and how vectors, wrenches and tensors cross the joint.
//!
//! The pose of a body in its parent's frame is a constant placement (E, p) followed by the joint's own motion. That of a turn R_z(q) and
//! of a slide q z stay apart from the placement, as vectors cross them with fewer operations: R = E R_z(q). That of any other
//! joint is part of the placement.

use crate::dd::Dd;
#[cfg(feature = "alloc")]
use crate::model::Body;
use crate::real::Real;
use crate::spatial::{Composite, ForceVector, Mat3, MotionVector, Sym3, Transform, Vec3};
#[cfg(feature = "alloc")]
use alloc::vec::Vec;

/// Whether E R_z(q) should be multiplied out once, rather than R_z and E be applied to every vector one after the other:
/// the value of [`Body::dense`](crate::model::Body::dense), from the exact E.
///
/// Counts the multiplications of five vectors, as many as inverse dynamics takes through a joint. A zero or ±1 in E is
/// free; a body on the world never composes, because there E meets constants.
pub fn composing_pays(parent: Option<usize>, rotation: &Mat3<Dd>) -> bool {
    const VECTORS: usize = 5;
    let is_free = |x: Dd| x == Dd::ZERO || x.abs() == Dd::ONE;
    let (mut compose, mut composed, mut separate) = (0, 0, 4);
    for row in &rotation.rows {
        let factors = row.iter().filter(|x| !is_free(**x)).count();
        let factors_xy = row[..2].iter().filter(|x| !is_free(**x)).count();
        let turns = row[..2].iter().any(|x| *x != Dd::ZERO);
        separate += factors;
        compose += 2 * factors_xy;
        composed += factors - factors_xy + if turns { 2 } else { 0 };
    }
    parent.is_some() && compose + VECTORS * composed < VECTORS * separate
}

/// Pose of a body in its parent's frame at one configuration.
#[derive(Clone, Debug)]
pub(crate) struct JointPose<T> {
    /// E; of joints that neither turn nor slide along z R itself.
    pub placement: Mat3<T>,
    /// p: origin of the joint frame in the parent's frame \[m\]; of joints that neither turn nor slide that of the body.
    pub translation: Vec3<T>,
    /// How far the body has slid along z \[m\], for a prismatic joint.
    pub slide: Option<T>,
    /// (sin q, cos q), for a revolute joint.
    pub turn: Option<(T, T)>,
    /// R as one matrix, where that is the cheaper form.
    composed: Option<Mat3<T>>,
    /// [`Body::dense`](crate::model::Body::dense).
    pub dense: bool,
}

impl<T: Real> JointPose<T> {
    /// Where a joint has turned the body about z by the angle with this (sin, cos).
    pub fn turned(placement: &Transform<T>, (s, c): (T, T), dense: bool) -> Self {
        let composed = dense.then(|| turn_columns(&placement.rotation, s, c));
        let (placement, translation) = (placement.rotation, placement.translation);
        JointPose { placement, translation, slide: None, turn: Some((s, c)), composed, dense }
    }

    /// Where a joint has slid the body along z by this \[m\].
    pub fn slid(placement: &Transform<T>, slide: T, dense: bool) -> Self {
        let (placement, translation) = (placement.rotation, placement.translation);
        JointPose { placement, translation, slide: Some(slide), turn: None, composed: None, dense }
    }

    /// Where a joint has moved the body to this pose in the joint's frame.
    pub fn moved(placement: &Transform<T>, moved: &Transform<T>) -> Self {
        let Transform { rotation, translation } = placement.compose(moved);
        JointPose { placement: rotation, translation, slide: None, turn: None, composed: None, dense: true }
    }

    /// All poses of a model, by body.
    #[cfg(feature = "alloc")]
    pub fn all(bodies: &[Body<T>], q: &[T]) -> Vec<Self> {
        T::section("sines and cosines", None);
        let pose = |(i, body): (usize, &Body<T>)| {
            body.joint.kind.mechanics().pose(i, &body.placement, body.dense, body.joint.coordinates(q))
        };
        bodies.iter().enumerate().map(pose).collect()
    }

    /// The same rotation with another translation.
    pub fn with_translation(&self, translation: Vec3<T>) -> Self {
        JointPose { translation, ..self.clone() }
    }

    /// R v: child axes to parent axes.
    pub fn to_parent(&self, v: Vec3<T>) -> Vec3<T> {
        match (&self.composed, self.turn) {
            (Some(r), _) => *r * v,
            (None, Some((s, c))) => self.placement * v.turned(s, c),
            (None, None) => self.placement * v,
        }
    }

    /// Rᵀ v: parent axes to child axes.
    pub fn to_child(&self, v: Vec3<T>) -> Vec3<T> {
        match (&self.composed, self.turn) {
            (Some(r), _) => r.transpose_mul(v),
            (None, Some((s, c))) => self.placement.transpose_mul(v).turned(-s, c),
            (None, None) => self.placement.transpose_mul(v),
        }
    }

    /// The rotation of the child in the axes that `r_parent` turns the parent's into: r_parent R.
    pub fn rotation_after(&self, r_parent: &Mat3<T>) -> Mat3<T> {
        match (self.turn, &self.composed) {
            // (r_parent E) R_z: with a dense E as cheap as r_parent (E R_z), else cheaper
            (Some((s, c)), _) => turn_columns(&(*r_parent * self.placement), s, c),
            (None, Some(r)) => *r_parent * *r,
            (None, None) => *r_parent * self.placement,
        }
    }

    /// The rotation of the parent in the axes that `r_child` turns the child's into: r_child Rᵀ.
    #[cfg(feature = "alloc")]
    pub fn rotation_before(&self, r_child: &Mat3<T>) -> Mat3<T> {
        let turned_back = match self.turn {
            // (E R_z)ᵀ = R_zᵀ Eᵀ
            Some((s, c)) => turn_columns(r_child, -s, c),
            None => *r_child,
        };
        turned_back * self.placement.transpose()
    }

    /// Angular velocity and velocity of the origin that the parent's motion alone gives the child, in child axes.
    pub fn motion_to_child(&self, parent: &MotionVector<T>) -> MotionVector<T> {
        let angular = self.to_child(parent.angular);
        let v = self.to_child(parent.linear + parent.angular.cross(self.translation));
        let linear = match self.slide {
            Some(q) => Vec3::new(v.x + angular.y * q, v.y - angular.x * q, v.z), // + ω × q z
            None => v,
        };
        MotionVector { angular, linear }
    }

    /// Bodies as one, in axes that the joint has turned or slid back.
    pub fn composite_back(&self, composite: &Composite<T>) -> Composite<T> {
        match (self.turn, self.slide) {
            (Some(turn), _) => composite.turned(turn),
            (None, Some(slide)) => composite.slid(slide),
            (None, None) => *composite,
        }
    }

    /// A wrench on the child, in axes that the joint has turned back; not for joints that slide along z.
    pub fn wrench_back(&self, w: &ForceVector<T>) -> ForceVector<T> {
        match self.turn {
            Some((s, c)) => ForceVector { moment: w.moment.turned(s, c), force: w.force.turned(s, c) },
            None => *w,
        }
    }

    /// A wrench on the child about the child's origin, as a wrench on the parent about the parent's origin.
    pub fn wrench_to_parent(&self, w: &ForceVector<T>) -> ForceVector<T> {
        let moment = match self.slide {
            Some(q) => w.moment + Vec3::new(-(q * w.force.y), q * w.force.x, T::zero()), // q z × F
            None => w.moment,
        };
        let force = self.to_parent(w.force);
        ForceVector { moment: self.to_parent(moment) + self.translation.cross(force), force }
    }

    /// A wrench on the child that the joint has turned or slid back already, as a wrench on the parent.
    pub fn placed_wrench(&self, w: &ForceVector<T>) -> ForceVector<T> {
        let force = self.placement * w.force;
        ForceVector { moment: self.placement * w.moment + self.translation.cross(force), force }
    }

    /// E S Eᵀ of a symmetric matrix that has been turned by the joint already.
    pub fn placed(&self, s: Sym3<T>) -> Sym3<T> {
        if self.dense {
            // E (S − S_zz 1) Eᵀ + S_zz 1, its last entry from the trace, which no rotation changes
            let (xx, yy) = (s.xx - s.zz, s.yy - s.zz);
            let reduced = Sym3 { xx, yy, zz: T::zero(), ..s };
            let r = conjugated(&self.placement, &reduced);
            Sym3 { xx: r.xx + s.zz, yy: r.yy + s.zz, zz: s.zz + (xx + yy - r.xx - r.yy), ..r }
        } else {
            conjugated(&self.placement, &s)
        }
    }
}

/// E S Eᵀ.
fn conjugated<T: Real>(e: &Mat3<T>, s: &Sym3<T>) -> Sym3<T> {
    let es = *e * s.to_matrix();
    let entry = |i: usize, j: usize| es.row(i).dot(e.row(j));
    Sym3 { xx: entry(0, 0), xy: entry(0, 1), xz: entry(0, 2), yy: entry(1, 1), yz: entry(1, 2), zz: entry(2, 2) }
}

/// A R_z(q).
fn turn_columns<T: Real>(a: &Mat3<T>, s: T, c: T) -> Mat3<T> {
    Mat3 { rows: a.rows.map(|[x, y, z]| [x * c + y * s, y * c - x * s, z]) }
}
