//! Where the frames of the reduced robot stand.

use super::*;

/// For each body the pose of its new frame in its canonical one: turned about z and shifted along it; for a prismatic
/// joint the origin may be anywhere.
///
/// A floating base and a body on a ball joint keep theirs, as their rates are along its axes.
///
/// From the tips to the base: x along the common normal to the axis of the first child with the most descendants, the
/// origin at the normal's foot.
pub(super) fn choose_frames(model: &Model<Dd>, lever: f64, choice: &FreeTerms) -> Vec<Transform<Dd>> {
    let n = model.bodies.len();
    let mut size = vec![1usize; n];
    for i in (0..n).rev() {
        if let Some(p) = model.bodies[i].parent {
            size[p] += size[i];
        }
    }
    let primary = |i: BodyId| {
        let children = (i + 1..n).filter(|c| model.bodies[*c].parent == Some(i));
        children.max_by_key(|c| (size[*c], usize::MAX - c))
    };
    let mut chosen = vec![Transform::identity(); n];
    for i in (0..n).rev() {
        let body = &model.bodies[i];
        if keeps_frame(body) {
            continue;
        }
        chosen[i] = match primary(i) {
            // no axis to go by: as it stands, level with the ball
            Some(c) if model.bodies[c].joint.kind.turns_freely() => {
                let p = model.bodies[c].placement.translation;
                pose_about_z(body, (Dd::ONE, Dd::ZERO), p.z, Some(p), lever)
            }
            Some(c) => {
                let before = foot_before(model, body, lever).filter(|_| choice.origin_at_parent[i]);
                along_common_normal(body, &model.bodies[c], &chosen[c], before, lever)
            }
            None => tip_frame(model, body, lever),
        };
    }
    // behind a parallel axis: level with the origin there, so that the arm has one component less
    for (i, body) in model.bodies.iter().enumerate() {
        let turns = |b: &Body<Dd>| b.joint.kind.turns();
        let Some(p) = body.parent.filter(|p| turns(body) && turns(&model.bodies[*p])) else { continue };
        let u = body.placement.rotation.column(2);
        let parallel = (u.x * u.x + u.y * u.y).hi() < NEARLY_PARALLEL * NEARLY_PARALLEL;
        if parallel && (is_tip(model, i) || choice.origin_at_parent[i]) {
            let (to, from) = (chosen[p].translation.z, body.placement.translation.z);
            let height = dusted((to - from) / u.z, to.abs().hi() + from.abs().hi());
            if height.abs().hi() <= FAR * lever {
                chosen[i].translation = Vec3::new(Dd::ZERO, Dd::ZERO, height);
            }
        }
    }
    chosen
}

/// Whether a body keeps its frame, as its joint has no axis but rates along those of the body.
fn keeps_frame(body: &Body<Dd>) -> bool {
    body.joint.kind.is_base() || body.joint.kind.turns_freely()
}

/// How high on its axis a revolute body has the foot of the common normal with the axis of a revolute joint before it.
pub(super) fn foot_before(model: &Model<Dd>, body: &Body<Dd>, lever: f64) -> Option<Dd> {
    let turns = |b: &Body<Dd>| b.joint.kind.turns();
    let parent = body.parent.map(|p| &model.bodies[p])?;
    let (p, u) = (body.placement.translation, body.placement.rotation.column(2));
    let sine2 = u.x * u.x + u.y * u.y;
    // foot on {p + s u} of the common normal with the parent's z axis: (p + s u) · (u − u_z z) = 0
    let foot = || -(p.dot(u) - p.z * u.z) / sine2;
    let found = (turns(body) && turns(parent) && sine2.hi() > NEARLY_PARALLEL * NEARLY_PARALLEL).then(foot);
    found.filter(|height| !is_far(*height, p, lever))
}

/// Whether a height on an axis is far beyond the way to the next origin, or beyond the robot's longest lever.
pub(super) fn is_far(height: Dd, way: Vec3<Dd>, longest: f64) -> bool {
    height.abs().hi() > FAR * norm(way).min(longest)
}

/// The frame of `body` with x along the common normal of its axis and its child's, and the origin at the normal's foot, or
/// at another height.
pub(super) fn along_common_normal(
    body: &Body<Dd>,
    child: &Body<Dd>,
    child_frame: &Transform<Dd>,
    other_height: Option<Dd>,
    lever: f64,
) -> Transform<Dd> {
    let to_child = child.placement.compose(child_frame);
    let (u, p) = (to_child.rotation.column(2), to_child.translation);
    let sine2 = u.x * u.x + u.y * u.y;
    let slides = child.joint.kind.slides();
    let (x_axis, height) = if sine2.hi() > NEARLY_PARALLEL * NEARLY_PARALLEL {
        // z × u; the foot on z of the common normal of {h z} and {p + s u}; the line of a sliding joint may be anywhere
        let foot = (p.z - u.z * p.dot(u)) / sine2;
        let height = if slides || is_far(foot - p.z, p, lever) { p.z } else { foot };
        (unit_xy(-u.y, u.x), height)
    } else if (p.x * p.x + p.y * p.y).hi() > (BESIDE * lever).powi(2) && !slides {
        (unit_xy(p.x, p.y), p.z)
    } else {
        // on one line: as the child's, so that nothing turns
        let x = to_child.rotation.column(0);
        (unit_xy(x.x, x.y), p.z)
    };
    pose_about_z(body, x_axis, other_height.unwrap_or(height), Some(p), lever)
}

/// A tip's frame: on the foot of the common normal with the axis before it, and turned so that no constant turn remains.
pub(super) fn tip_frame(model: &Model<Dd>, body: &Body<Dd>, lever: f64) -> Transform<Dd> {
    let (r, p) = (body.placement.rotation, body.placement.translation);
    let u = r.column(2);
    let sine2 = u.x * u.x + u.y * u.y;
    if body.parent.is_none_or(|p| keeps_frame(&model.bodies[p])) {
        return Transform::identity();
    }
    if sine2.hi() > NEARLY_PARALLEL * NEARLY_PARALLEL {
        // foot on {p + s u} of the common normal with the parent's z axis: (p + s u) · (u − u_z z) = 0
        let foot = -(p.dot(u) - p.z * u.z) / sine2;
        let s = if is_far(foot, p, lever) { -(p.z * u.z) } else { foot };
        // x so that it is the parent's common normal, z × u, in own axes
        let x = r.transpose_mul(Vec3::new(-u.y, u.x, Dd::ZERO));
        pose_about_z(body, unit_xy(x.x, x.y), s, None, lever)
    } else {
        // parallel: in the plane of the parent's origin, axes as the parent's
        let x = r.row(0);
        pose_about_z(body, unit_xy(x.x, x.y), -(p.z * u.z), None, lever)
    }
}

/// Turned about z, and moved along it unless that is out of proportion to the robot's longest lever.
pub(super) fn pose_about_z(
    body: &Body<Dd>,
    (c, s): (Dd, Dd),
    height: Dd,
    child_origin: Option<Vec3<Dd>>,
    lever: f64,
) -> Transform<Dd> {
    let z = Vec3::unit_z();
    let x = Vec3::new(c, s, Dd::ZERO);
    let rotation = Mat3::from_columns(x, z.cross(x), z);
    let translation = match body.joint.kind.slides() {
        // anywhere: where the child is, so that its arm vanishes
        true => child_origin.unwrap_or(Vec3::zero()),
        _ if height.abs().hi() > FAR * lever => Vec3::zero(),
        _ => {
            let terms = norm(child_origin.unwrap_or(body.placement.translation));
            Vec3::new(Dd::ZERO, Dd::ZERO, dusted(height, terms))
        }
    };
    Transform { rotation, translation }
}

/// A direction in the x-y plane, of length one, special values exact.
pub(super) fn unit_xy(x: Dd, y: Dd) -> (Dd, Dd) {
    let length = (x * x + y * y).sqrt();
    (special(x / length), special(y / length))
}

/// An entry of a rotation: exactly 0 or ±1 where double-double cannot tell.
pub(super) fn special(x: Dd) -> Dd {
    for exact in [Dd::ZERO, Dd::ONE, -Dd::ONE] {
        if (x - exact).abs().hi() < DUST {
            return exact;
        }
    }
    x
}

/// A sum of terms of this size: exactly 0 where double-double cannot tell.
pub(super) fn dusted(x: Dd, size: f64) -> Dd {
    if x.abs().hi() < DUST * size {
        Dd::ZERO
    } else {
        x
    }
}
