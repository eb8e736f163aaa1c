//! Joints that nothing resists: where every form of forward dynamics would divide by zero.
//!
//! A joint has a motion of its own if, with the joints beyond it free, it still feels some inertia: the pivot of its row when
//! the mass matrix is eliminated from the tips to the base (Featherstone 2008, section 6.5), which is also the divisor of the
//! articulated-body algorithm. Whether it vanishes at all configurations, and not at some, is asked at three of them that
//! have nothing in common with right angles. Links without mass, point masses on the joint axis, wrists about a point
//! mass and coaxial joints without an inertia between them are found alike.
//!
//! What vanishes is said against the inertia that the joint would feel with what it moves at arm's length: with a point mass on an oblique
//! axis H itself has nothing but rounding in its place. And what stands against the robot's own as 1e-28 to 1 is dust in place of a zero.

use crate::model::geometry::principal_moments;
use straightline_core::algorithms::{complete_model, drive_states, forward_kinematics, mass_matrix};
use straightline_core::joint::Measure;
use straightline_core::model::{Body, BodyId, Frame, Model};
use straightline_core::spatial::Transform;
use straightline_core::Dd;

/// A pivot is zero if so much smaller than the inertia of what its joint moves. Double-double has 1e-32; a mass ratio of
/// 1e-12 between neighbours leaves about 1e-12.
const VANISHED: f64 = 1e-22;

/// A pivot is dust if so much smaller than the inertia of the whole robot: masses as 1e20 to 1 are meant.
const DUST: f64 = 1e-28;

/// The golden ratio's fraction: multiples of it, wrapped, are never near each other.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Which inertia is divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inertia {
    /// H: links, and rotors that joints have as a number.
    OfLinks,
    /// H*: drives, too; joints whose drives do not give way are not divided by.
    WithDrives,
}

/// The bodies whose joints nothing resists at any configuration; of joints that share one lack, the one nearest to the tips.
pub fn singular_joints(model: &Model<Dd>, inertia: Inertia) -> Vec<BodyId> {
    if each_feels_its_own_link(model, inertia) {
        return Vec::new();
    }
    let mut always = vanished_pivots(model, inertia, &generic_configuration(model, 1));
    for seed in 2..=3 {
        let here = match always.is_empty() {
            true => return Vec::new(),
            false => vanished_pivots(model, inertia, &generic_configuration(model, seed)),
        };
        always.retain(|body| here.contains(body));
    }
    always
}

/// The joint that, with the joints beyond it free, feels the least part of the inertia that it moves, and that part.
pub(crate) fn weakest_joint(model: &Model<Dd>) -> Option<(BodyId, f64)> {
    let mut least: Option<(BodyId, f64)> = None;
    eliminate(model, Inertia::OfLinks, &generic_configuration(model, 1), &mut |body, part| {
        if least.is_none_or(|(_, other)| part < other) {
            least = Some((body, part));
        }
    });
    least
}

/// Whether every joint feels enough by the one link that it moves, whatever comes behind: the links beyond it, free, add to a pivot and take
/// nothing away, if no inertia is negative. Elimination takes the cube of the number of joints, of a chain of thousands hours; this the square.
fn each_feels_its_own_link(model: &Model<Dd>, inertia: Inertia) -> bool {
    let has_more =
        inertia == Inertia::WithDrives && !model.drives.is_empty() || model.bodies.iter().any(|b| b.load.is_some());
    if has_more || !model.is_tree() {
        return false;
    }
    // H itself is at most the natural inertia and the rotor; what is near the bound is left to elimination
    const MARGIN: f64 = 100.0;
    let scales = natural_inertias(model, &generic_configuration(model, 1));
    let rotor = |body: &Body<Dd>| body.effects.rotor_inertia.map_or(0.0, Dd::to_f64);
    let most = |body: &Body<Dd>| scales[body.joint.iv] + rotor(body);
    let greatest = model.bodies.iter().map(most).fold(0.0, f64::max);
    model.bodies.iter().all(|body| {
        let own = &body.inertia;
        let (mass, com, tensor) = (own.mass.to_f64(), own.com.map(Dd::to_f64), own.inertia_com.map(Dd::to_f64));
        let link = match body.joint.kind.elementary() {
            None => return false,
            Some(Measure::Length) => mass,
            Some(Measure::Angle) => tensor.zz + mass * (com.x * com.x + com.y * com.y),
        };
        let is_sound = mass >= 0.0 && rotor(body) >= 0.0 && principal_moments(tensor)[0] >= 0.0;
        is_sound && link + rotor(body) > MARGIN * (VANISHED * most(body) + DUST * greatest)
    })
}

/// Angles and lengths within ±2; a floating base in the world's place, which its inertia does not depend on.
fn generic_configuration(model: &Model<Dd>, seed: usize) -> Vec<Dd> {
    let mut q: Vec<Dd> =
        (0..model.nq()).map(|i| Dd::from(4.0 * ((i * 3 + seed) as f64 * GOLDEN).fract() - 2.0)).collect();
    for joint in model.free_joints().filter(|j| j.kind.is_base()) {
        let neutral = joint.kind.row().neutral;
        q[joint.iq..].iter_mut().zip(neutral).for_each(|(q, neutral)| *q = Dd::from(*neutral));
    }
    q
}

/// What each coordinate would feel at least with all that its joint moves at a distance from it, at q: masses, and moments about the
/// joint's origin of the masses and of the bodies themselves, whatever the axis. By velocity coordinate.
fn natural_inertias(model: &Model<Dd>, q: &[Dd]) -> Vec<f64> {
    let bodies = &model.bodies;
    let frame = |b: BodyId| Frame { name: String::new(), body: Some(b), placement: Transform::identity() };
    let frames: Vec<Frame<Dd>> = (0..bodies.len()).map(frame).collect();
    let poses = forward_kinematics(model, q, &frames.iter().collect::<Vec<_>>());
    let mut scales = vec![0.0; model.nv()];
    let of_loops = model.embedding(&model.tree_positions(q));
    for (b, body) in bodies.iter().enumerate() {
        let inertia = &body.inertia;
        let mass = inertia.mass.to_f64().abs();
        let own = inertia.second_moment_com;
        let own: f64 = [own.xx, own.yy, own.zz].iter().map(|x| 2.0 * x.to_f64().abs()).sum();
        let centre = poses[b].rotation * inertia.com + poses[b].translation;
        for carrier in std::iter::successors(Some(b), |&c| bodies[c].parent) {
            let joint = &bodies[carrier].joint;
            let arm = centre - poses[carrier].translation;
            let moment = mass * arm.dot(arm).to_f64() + own;
            let (first, ratio) = model.moved_by(carrier);
            let square = ratio.map_or(1.0, |ratio| ratio.to_f64() * ratio.to_f64());
            for (k, measure) in joint.kind.row().measures.iter().enumerate() {
                let own = square * if *measure == Measure::Length { mass } else { moment };
                match (first + k).checked_sub(model.nv()) {
                    None => scales[first + k] += own,
                    Some(dependent) => {
                        let ratios = of_loops[dependent].iter().map(|x| x.to_f64());
                        scales.iter_mut().zip(ratios).for_each(|(scale, ratio)| *scale += own * ratio * ratio);
                    }
                }
            }
        }
    }
    scales
}

/// The bodies with a vanished pivot at q.
fn vanished_pivots(model: &Model<Dd>, inertia: Inertia, q: &[Dd]) -> Vec<BodyId> {
    eliminate(model, inertia, q, &mut |_, _| {})
}

/// H eliminated from the tips to the base; a row without a pivot is left out, as if its joint were held. Those bodies come back; `tell` gets
/// every body with a pivot of it, as a part of the inertia that its joint moves.
fn eliminate(model: &Model<Dd>, inertia: Inertia, q: &[Dd], tell: &mut dyn FnMut(BodyId, f64)) -> Vec<BodyId> {
    let nv = model.nv();
    let mut h = mass_matrix(model, q);
    let mut held = Vec::new();
    let with_drives = inertia == Inertia::WithDrives && !model.drives.is_empty();
    if with_drives {
        let (rest, x) = (vec![Dd::ZERO; nv], vec![Dd::ZERO; drive_states(model)]);
        h = complete_model(model, (q, &rest, &x), &rest, &h).0;
        held = model.drives.iter().filter_map(|d| d.held_joint()).map(|(b, _)| model.bodies[b].joint.iv).collect();
    }
    let scales = natural_inertias(model, q);
    let sizes: Vec<f64> = (0..nv).map(|i| scales[i].max(h[i * nv + i].to_f64().abs())).collect();
    let is_linear: Vec<bool> = linear_coordinates(model);
    let greatest = |linear: bool| {
        let alike = sizes.iter().zip(&is_linear).zip(0..nv).filter(|((_, l), i)| **l == linear && !held.contains(i));
        alike.map(|((size, _), _)| *size).fold(0.0, f64::max)
    };
    let of_robot = [greatest(false), greatest(true)];
    let is_gone = |pivot: Dd, k: usize| {
        let pivot = pivot.to_f64().abs();
        pivot <= VANISHED * sizes[k] || pivot <= DUST * of_robot[usize::from(is_linear[k])]
    };
    // the coordinates of a body and of all that carry it, those of the body itself last; drives, loops and joints that follow may couple branches
    let joins_branches = with_drives || !model.is_tree();
    let is_free = |b: &BodyId| model.coupling_of(*b).is_none() && !model.is_dependent(*b);
    let chain = |body: BodyId| {
        let bodies: Vec<BodyId> = match joins_branches {
            true => (0..=body).rev().filter(is_free).collect(),
            false => std::iter::successors(Some(body), |&b| model.bodies[b].parent).collect(),
        };
        let coordinates = bodies.iter().flat_map(|b| {
            let joint = &model.bodies[*b].joint;
            (joint.iv..joint.iv + joint.kind.nv()).rev()
        });
        let mut coordinates: Vec<usize> = coordinates.collect();
        coordinates.reverse();
        coordinates
    };
    let mut found = Vec::new();
    for body in (0..model.bodies.len()).rev().filter(is_free) {
        let mut rows = chain(body);
        for _ in 0..model.bodies[body].joint.kind.nv() {
            let k = rows.pop().expect("a body's chain has its own coordinates");
            if held.contains(&k) {
                continue;
            }
            let pivot = h[k * nv + k];
            tell(body, pivot.to_f64().abs() / sizes[k]);
            if is_gone(pivot, k) {
                if !found.contains(&body) {
                    found.push(body);
                }
                continue;
            }
            for &i in rows.iter().filter(|i| !held.contains(i)) {
                let factor = h[k * nv + i] / pivot;
                for &j in &rows {
                    h[i * nv + j] = h[i * nv + j] - factor * h[k * nv + j];
                }
            }
        }
    }
    found.sort_unstable();
    found
}

/// Which coordinates are lengths.
fn linear_coordinates(model: &Model<Dd>) -> Vec<bool> {
    let mut linear = vec![false; model.nv()];
    for joint in model.independent_joints() {
        let measures = joint.kind.row().measures;
        linear[joint.iv..].iter_mut().zip(measures).for_each(|(l, measure)| *l = *measure == Measure::Length);
    }
    linear
}
