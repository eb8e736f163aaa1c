//! Where a body stands against its parent, and how vectors, wrenches and tensors cross the joint.
//!
//! The pose of a body in its parent's frame is a constant placement (E, p) followed by the joint's own motion: a turn
//! R_z(q), a slide q z, or, for a floating base, all of q. So the rotation from child to parent is R = E R_z(q).

use crate::dd::Dd;
use crate::model::{Body, BodyId, JointKind};
use crate::real::Real;
use crate::spatial::{ForceVector, Mat3, Sym3, Vec3};
use alloc::vec::Vec;

/// Whether E R_z(q) should be multiplied out once, rather than R_z and E be applied to every vector one after the other:
/// the value of [`Body::dense`], from the exact E.
///
/// Counts the multiplications of five vectors, as many as inverse dynamics takes through a joint. A zero or ±1 in E is
/// free; a body on the world never composes, because there E meets constants.
pub fn composing_pays(parent: Option<BodyId>, rotation: &Mat3<Dd>) -> bool {
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
pub(super) struct JointPose<T> {
    /// E, or the unit matrix for a floating base.
    pub placement: Mat3<T>,
    /// p: origin of the joint frame in the parent's frame \[m\], for a floating base that of the body.
    pub translation: Vec3<T>,
    /// How far the body has slid along z \[m\], for a prismatic joint.
    pub slide: Option<T>,
    /// (sin q, cos q), for a revolute joint.
    pub turn: Option<(T, T)>,
    /// R as one matrix, where that is the cheaper form.
    composed: Option<Mat3<T>>,
    /// [`Body::dense`].
    pub dense: bool,
}

impl<T: Real> JointPose<T> {
    pub fn new(i: BodyId, body: &Body<T>, q: &[T]) -> Self {
        let (iq, placement, translation) = (body.joint.iq, body.placement.rotation, body.placement.translation);
        let dense = body.dense;
        match body.joint.kind {
            JointKind::Revolute => {
                let (s, c) = q[iq].sin_cos();
                let (s, c) = (s.named("sin_q", i, ""), c.named("cos_q", i, ""));
                let composed = dense.then(|| turn_columns(&placement, s, c));
                JointPose { placement, translation, slide: None, turn: Some((s, c)), composed, dense }
            }
            JointKind::Prismatic => {
                JointPose { placement, translation, slide: Some(q[iq]), turn: None, composed: None, dense }
            }
            JointKind::Floating => JointPose {
                placement: Mat3::identity(),
                translation: Vec3::new(q[iq], q[iq + 1], q[iq + 2]),
                slide: None,
                turn: None,
                composed: Some(quaternion_to_rotation([q[iq + 3], q[iq + 4], q[iq + 5], q[iq + 6]])),
                dense: true,
            },
        }
    }

    /// All poses of a model, by body.
    pub fn all(bodies: &[Body<T>], q: &[T]) -> Vec<Self> {
        T::section("sines and cosines", None);
        let pose = |(i, body)| JointPose::new(i, body, q);
        bodies.iter().enumerate().map(pose).collect()
    }

    /// The slide, or zero for a joint that has none.
    pub fn slide_or_zero(&self) -> T {
        self.slide.unwrap_or_else(T::zero)
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

/// The rotation matrix (body to world) of a unit quaternion (x, y, z, w). Not normalised here: an error of the norm goes
/// into the result to first order, and there is no root and no division.
pub(super) fn quaternion_to_rotation<T: Real>([x, y, z, w]: [T; 4]) -> Mat3<T> {
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, yy, zz) = (x * x2, y * y2, z * z2);
    let (xy, xz, yz) = (x * y2, x * z2, y * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    let one = T::one();
    Mat3 {
        rows: [
            [one - (yy + zz), xy - wz, xz + wy],
            [xy + wz, one - (xx + zz), yz - wx],
            [xz - wy, yz + wx, one - (xx + yy)],
        ],
    }
}

/// Rᵀ v for the rotation of a unit quaternion, without R: v + w t + t × u with t = 2 v × u and u = (x, y, z). Where v has one
/// component this takes what one row of R would, and fewer doublings.
pub(super) fn rotated_back<T: Real>([x, y, z, w]: [T; 4], v: Vec3<T>) -> Vec3<T> {
    let u = Vec3::new(x, y, z);
    let t = (v + v).cross(u);
    v + t.cross(u) + t.scale(w)
}
