//! Joints by vectors from joint to centre of mass, in canonical joint frames: 20.1.2 and the appendix.
//!
//! Frame j is fixed to link j with its origin in the centre of mass C_j; frame 0 is the world. At q_j = 0 the pose of frame j
//! in frame j−1 follows from A⁰_{j−1,j} and the vectors to the joint: S_j = −r_{j−1,j} in frame j−1, and C_j = S_j + r_{j,j}.
//! The canonical frame of joint j stands in S_j (S''_j for a linear joint) with z along e_j. Vectors are as in the file:
//! `e`, `r`, `r_star` of link j in frame j (tilde above), `e_next`, … of link j−1 in frame j−1 (tilde below).

use super::angle;
use super::bodies::Seat;
use super::geometry::{
    about, canonical_rotation, compose, magnitude, snap_rotation, snap_vector, turned, unit, vector,
};
use crate::description::{messages, JointVectors, Noted, WrittenJoint};
use crate::diagnostic::Diagnostics;
use straightline_core::spatial::{Mat3, Transform, Vec3};
use straightline_core::Dd;

/// A vector is parallel with the axis if the part of it across is relatively smaller.
const PARALLEL: f64 = 1e-9;

/// The joint between frames j−1 and j, by A_{j−1,j} at q_j = 0; `None` after a complaint.
///
/// ```text
/// a_j = −e_j × (r_{j−1,j} × e_j) / |…|  in frame j−1,   a_j = e_j × (r_{j,j} × e_j) / |…|  in frame j     (20.101)
/// b_j = e_j × a_j                                                                                        (20.102)
/// A⁰_{j−1,j} = [e_j a_j b_j] [ẽ_j ã_j b̃_j]ᵀ                                                             (20.106)
/// ```
///
/// The second matrix of (20.106) is orthogonal, so its inverse is its transpose. A linear joint is turned by α_j about e_j
/// for good: (20.108) with α_j for q_j.
pub(super) fn seat(
    vectors: &JointVectors,
    joint: &WrittenJoint,
    tolerance: f64,
    diagnostics: &mut Diagnostics,
) -> Option<Seat> {
    let JointVectors { e_parent, r_parent, r_parent_star, e, r, r_star, alpha } = vectors;
    let [below, owner] = [&joint.parent, &joint.child].map(|link| format!("link `{}`", link.value));
    let lower = across(&owner, ("r", r), ("e", e), ("r_star", r_star), diagnostics);
    let upper = across(&below, ("r_next", r_parent), ("e_next", e_parent), ("r_next_star", r_parent_star), diagnostics);
    let ((e_link, a_link), (e_previous, minus_a_previous)) = (lower?, upper?);
    let a_previous = -minus_a_previous;
    let in_previous = Mat3::from_columns(e_previous, a_previous, e_previous.cross(a_previous));
    let in_link = Mat3::from_columns(e_link, a_link, e_link.cross(a_link));
    let extended = snap_rotation(in_previous * in_link.transpose());
    let slides = joint.kind.value.kind.is_some_and(|kind| kind.slides());
    let turn = match alpha {
        Some(alpha) if slides => about(e_previous, angle::read(alpha, tolerance).sin_cos),
        _ => Mat3::identity(),
    };
    let r_previous_link = compose(&turned(turn), &turned(extended)).rotation;
    let r_link_canonical = canonical_rotation(unit(e_link)?);
    let r_canonical_link = r_link_canonical.transpose();
    let r = vector(r.value);
    let com = snap_vector(r_canonical_link * r, magnitude(r));
    Some(Seat {
        in_parent: Transform {
            rotation: snap_rotation(r_previous_link * r_link_canonical),
            translation: -vector(r_parent.value),
        },
        canonical: Transform::identity(),
        link_frame: Transform { rotation: r_canonical_link, translation: com },
        in_link: -r,
    })
}

/// The unit vectors e, and along the part of r (or of r*) across it: e × (r × e) / |…| = (r − (e·r) e) / |…|.
fn across(
    owner: &str,
    (r_key, r): (&str, &Noted<[f64; 3]>),
    (e_key, e): (&str, &Noted<[f64; 3]>),
    (star_key, star): (&str, &Option<Noted<[f64; 3]>>),
    diagnostics: &mut Diagnostics,
) -> Option<(Vec3<Dd>, Vec3<Dd>)> {
    let e_unit = unit(vector(e.value))?;
    let used = star.as_ref().unwrap_or(r);
    // scaled to length 1 first, so that the threshold is relative
    let part = unit(vector(used.value)).map(|r| e_unit.cross(r.cross(e_unit)));
    match part.filter(|part| magnitude(*part) > PARALLEL).and_then(|part| unit(snap_vector(part, 1.0))) {
        Some(a) => Some((e_unit, a)),
        None => {
            let complaint = messages::specificity(owner, r_key, e_key, star_key, star.is_some());
            diagnostics.push(complaint.at(&used.place));
            None
        }
    }
}
