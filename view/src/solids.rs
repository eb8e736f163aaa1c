//! What stands for a robot whose shape is not known: capsules from joint to joint, and how large the whole is.

use crate::poses::world_transforms;
use straightline_core::model::Model;
use straightline_core::spatial::{Transform, Vec3};

/// A capsule is this thick beside the robot's reach, at its base.
const THICKNESS: f64 = 0.034;
/// Tips are no thinner than this part of the base.
const THINNEST: f64 = 0.42;
/// What is nearer than this part of the reach is one point.
const SAME: f64 = 1e-3;

/// The capsules of a body, or of what is fixed to the world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limb {
    /// Where they end; all begin at the origin \[m\].
    pub ends: Vec<Vec3<f64>>,
    /// Their radius \[m\].
    pub radius: f64,
}

/// Points of a body, or of the world, to which something leads: joints of its children, ends of loops, frames fixed to it.
fn points(model: &Model<f64>, body: Option<usize>) -> Vec<Vec3<f64>> {
    let children = model.bodies.iter().filter(|b| b.parent == body && !b.joint.kind.is_base());
    let mut points: Vec<Vec3<f64>> = children.map(|b| b.placement.translation).collect();
    let ends = model.closure.loops.iter().flat_map(|of| &of.ends).filter(|end| end.body == body);
    points.extend(ends.map(|end| end.point));
    // links merged into a body lead nowhere, but those at its tip show how long it is
    if points.is_empty() && body.is_some() {
        let fixed = model.frames.iter().filter(|frame| frame.body == body);
        points.extend(fixed.map(|frame| frame.placement.translation));
    }
    if let (true, Some(b)) = (points.iter().all(|p| p.dot(*p) == 0.0), body) {
        let total = model.bodies[b].total_about_origin();
        if total.mass > 0.0 {
            points.push(total.first_moment.scale(1.0 / total.mass));
        }
    }
    points
}

/// Mass of a body and of all that it carries \[kg\].
fn carried_masses(model: &Model<f64>) -> Vec<f64> {
    let mut masses: Vec<f64> = model.bodies.iter().map(|b| b.total_about_origin().mass.max(0.0)).collect();
    for b in (0..model.bodies.len()).rev() {
        if let Some(parent) = model.bodies[b].parent {
            masses[parent] += masses[b];
        }
    }
    masses
}

/// The capsules of the world, then of each body. What carries little is thin.
pub fn limbs(model: &Model<f64>, reach: f64) -> Vec<Limb> {
    let masses = carried_masses(model);
    let whole = masses.iter().copied().fold(0.0, f64::max);
    let thick = THICKNESS * reach;
    let limb = |body: Option<usize>| {
        let part = body.map_or(1.0, |b| if whole > 0.0 { (masses[b] / whole).sqrt().sqrt() } else { 1.0 });
        let mut ends: Vec<Vec3<f64>> = Vec::new();
        for end in points(model, body) {
            let is_new = |other: &Vec3<f64>| (end - *other).dot(end - *other) > (SAME * reach) * (SAME * reach);
            if is_new(&Vec3::zero()) && ends.iter().all(is_new) {
                ends.push(end);
            }
        }
        Limb { ends, radius: thick * part.max(THINNEST) }
    };
    std::iter::once(limb(None)).chain((0..model.bodies.len()).map(|b| limb(Some(b)))).collect()
}

/// All points of a robot in the world at q: origins of joints, and where capsules end.
pub fn extent(model: &Model<f64>, limbs: &[Limb], q: &[f64]) -> Vec<Vec3<f64>> {
    let mut found = limbs[0].ends.clone();
    if !model.floats() {
        found.push(Vec3::zero());
    }
    for (pose, limb) in world_transforms(model, q).iter().zip(&limbs[1..]) {
        found.push(pose.translation);
        found.extend(limb.ends.iter().map(|end| place(pose, *end)));
    }
    found
}

/// A point of a frame in the world.
fn place(pose: &Transform<f64>, point: Vec3<f64>) -> Vec3<f64> {
    pose.translation + pose.rotation * point
}

/// The longest way along a robot's joints and capsules \[m\], positive.
pub fn reach(model: &Model<f64>, q: &[f64]) -> f64 {
    let length = |v: Vec3<f64>| v.dot(v).sqrt();
    let poses = world_transforms(model, q);
    let mut ways: Vec<f64> = Vec::new();
    let mut longest = 0.0f64;
    for (b, body) in model.bodies.iter().enumerate() {
        let way = match body.parent {
            Some(parent) => ways[parent] + length(poses[b].translation - poses[parent].translation),
            None if body.joint.kind.is_base() => 0.0,
            None => length(poses[b].translation),
        };
        ways.push(way);
        longest = points(model, Some(b)).into_iter().map(|p| way + length(p)).fold(longest.max(way), f64::max);
    }
    if longest > 0.0 && longest.is_finite() {
        longest
    } else {
        1.0
    }
}
