//! What needs the whole robot to be judged: tree, masses and inertias, axes, limits, angles.

use super::geometry::principal_moments;
use super::{angle, doubtful_angles, Assembly, ModelOptions, MOST_LINKS};
use crate::description::{
    messages, AnchoredJoint, Description, FileFormat, JointDrive, JointLimits, JointType, JointVectors, Noted,
    Placement, WrittenJoint,
};
use crate::diagnostic::{Diagnostics, Place};
use crate::model::singular::{singular_joints, Inertia};
use std::collections::HashMap;
use straightline_core::joint::{Dialect, Measure};
use straightline_core::model::{Coulomb, JointEffects, Limits, Model};
use straightline_core::spatial::Sym3;
use straightline_core::Dd;

/// A principal moment may exceed the sum of the others by so much, relatively: the digits of published tensors.
const MOMENT_DIGITS: f64 = 1e-6;
/// A length of an axis further from 1 is worth a warning.
const AXIS_DIGITS: f64 = 1e-3;

/// The tree of links: indices into the description's links and joints.
pub(super) struct Tree {
    /// The root link.
    pub root: usize,
    /// For each link, the joints that it carries, in the file's order.
    pub joints_of: Vec<Vec<usize>>,
    /// For each joint, its parent link.
    pub parent_of: Vec<usize>,
    /// For each joint, its child link.
    pub child_of: Vec<usize>,
}

/// The tree, or complaints why there is none.
pub(super) fn tree(bodies: &Description, diagnostics: &mut Diagnostics) -> Option<Tree> {
    let Description { links, name, .. } = bodies;
    if links.is_empty() {
        if !bodies.has_holes {
            diagnostics.push(messages::no_links(&name.value).at(&name.place));
        }
        return None;
    }
    if links.len() > MOST_LINKS {
        diagnostics.push(messages::too_many_links(links.len(), MOST_LINKS).at(&name.place));
        return None;
    }
    let mut has_holes = bodies.has_holes;
    let link_index = unique("link", links.iter().map(|l| &l.name), diagnostics);
    // the second of two links with one name hangs nowhere
    has_holes |= link_index.len() < links.len();
    unique("joint", bodies.joints.iter().map(|j| &j.name), diagnostics);
    let mut frame_names = unique("frame", bodies.frames.iter().map(|f| &f.name), diagnostics);
    for link in links {
        if let Some(frame) = frame_names.remove(link.name.value.as_str()) {
            let frame = &bodies.frames[frame].name;
            diagnostics.push(
                messages::duplicate_name("frame or link", &frame.value)
                    .at(&frame.place)
                    .related(&link.name.place, "the link"),
            );
        }
    }
    let mut find = |owner: String, link: &Noted<String>, diagnostics: &mut Diagnostics| {
        let found = link_index.get(link.value.as_str()).copied();
        if found.is_none() {
            let known = links.iter().map(|l| l.name.value.as_str());
            diagnostics.push(messages::unknown_link(&owner, &link.value, known).at(&link.place));
            has_holes = true;
        }
        found
    };
    let mut joints_of = vec![Vec::new(); links.len()];
    let mut child_of = vec![0; bodies.joints.len()];
    let mut joint_above: Vec<Option<usize>> = vec![None; links.len()];
    let mut parent_of = vec![0; bodies.joints.len()];
    for (j, joint) in bodies.joints.iter().enumerate() {
        let parent = find(format!("parent of joint `{}`", joint.name.value), &joint.parent, diagnostics);
        let child = find(format!("child of joint `{}`", joint.name.value), &joint.child, diagnostics);
        let (Some(parent), Some(child)) = (parent, child) else { continue };
        if let Some(first) = joint_above[child] {
            let first = &bodies.joints[first];
            diagnostics.push(
                messages::two_parents(&joint.child.value, &first.name.value, &joint.name.value)
                    .at(&joint.child.place)
                    .related(&first.child.place, "the other joint"),
            );
            continue;
        }
        joint_above[child] = Some(j);
        parent_of[j] = parent;
        child_of[j] = child;
        joints_of[parent].push(j);
    }
    for frame in &bodies.frames {
        find(format!("frame `{}`", frame.name.value), &frame.link, diagnostics);
    }
    let roots: Vec<usize> = (0..links.len()).filter(|&l| joint_above[l].is_none()).collect();
    if roots.len() > 1 && !has_holes {
        let names: Vec<&str> = roots.iter().map(|&l| links[l].name.value.as_str()).collect();
        diagnostics.push(messages::two_roots(&names).at(&links[roots[1]].name.place));
    }
    let root = roots.first().copied();
    let tree = Tree { root: root.unwrap_or(0), joints_of, parent_of, child_of };
    cycles(bodies, &tree, &roots, &joint_above, diagnostics);
    root.map(|_| tree)
}

/// Complains of each cycle of joints.
fn cycles(
    bodies: &Description,
    tree: &Tree,
    roots: &[usize],
    joint_above: &[Option<usize>],
    diagnostics: &mut Diagnostics,
) {
    // what no root carries, hangs on a cycle
    let mut reached = vec![false; joint_above.len()];
    let mut open = roots.to_vec();
    while let Some(link) = open.pop() {
        reached[link] = true;
        open.extend(tree.joints_of[link].iter().map(|&j| tree.child_of[j]));
    }
    for start in 0..reached.len() {
        if reached[start] {
            continue;
        }
        let mut path: Vec<usize> = Vec::new();
        let mut link = start;
        while !reached[link] {
            reached[link] = true;
            let Some(joint) = joint_above[link] else { break };
            path.push(joint);
            link = tree.parent_of[joint];
        }
        // the walk ends on the cycle itself, or on what an earlier walk has seen
        let Some(first) = path.iter().position(|&j| tree.child_of[j] == link) else { continue };
        let mut names: Vec<&str> = path[first..].iter().map(|&j| bodies.joints[j].name.value.as_str()).collect();
        names.reverse();
        let place = path[first..].iter().map(|&j| &bodies.joints[j].name.place).min_by_key(|p| p.span.start);
        diagnostics.push(messages::cycle(&names).at(place.unwrap_or(&bodies.name.place)));
    }
}

/// The index of each name; names that are taken are complained of.
pub(super) fn unique<'a>(
    what: &str,
    names: impl Iterator<Item = &'a Noted<String>>,
    diagnostics: &mut Diagnostics,
) -> HashMap<&'a str, usize> {
    let mut index: HashMap<&str, (usize, &Place)> = HashMap::new();
    for (i, name) in names.enumerate() {
        match index.get(name.value.as_str()) {
            Some((_, first)) => {
                let complaint = messages::duplicate_name(what, &name.value).at(&name.place);
                diagnostics.push(complaint.related(first, "the first one"));
            }
            None => {
                index.insert(&name.value, (i, &name.place));
            }
        }
    }
    index.into_iter().map(|(name, (i, _))| (name, i)).collect()
}

/// Mass and inertia of one link.
pub(super) fn inertial(link: &str, mass: &Noted<f64>, inertia: &Noted<Sym3<f64>>, diagnostics: &mut Diagnostics) {
    let j = inertia.value;
    let is_zero = [j.xx, j.xy, j.xz, j.yy, j.yz, j.zz].iter().all(|&x| x == 0.0);
    if mass.value < 0.0 {
        diagnostics.push(messages::negative_mass(link, mass.value).at(&mass.place));
    } else if mass.value == 0.0 && !is_zero {
        diagnostics.push(messages::inertia_without_mass(link).at(&mass.place));
    } else if mass.value > 0.0 && is_zero {
        diagnostics.push(messages::point_mass(link).at(&inertia.place));
    }
    let moments = principal_moments(j);
    let [a, b, c] = moments;
    let slack = MOMENT_DIGITS * c.abs().max(a.abs());
    if a < -slack {
        diagnostics.push(messages::negative_moment(link, moments).at(&inertia.place));
    } else if c > a + b + slack {
        diagnostics.push(messages::triangle_inequality(link, moments).at(&inertia.place));
    }
}

/// The greatest component of an axis; `None` after the complaint that there is none.
fn axis_greatest(what: &str, axis: &Noted<[f64; 3]>, diagnostics: &mut Diagnostics) -> Option<f64> {
    let greatest = axis.value.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if greatest < 1e-100 {
        diagnostics.push(messages::zero_axis(what).at(&axis.place));
        return None;
    }
    Some(greatest)
}

/// The length of an axis.
pub(super) fn axis_length(what: &str, axis: &Noted<[f64; 3]>, diagnostics: &mut Diagnostics) {
    let Some(greatest) = axis_greatest(what, axis, diagnostics) else { return };
    let length = axis.value.iter().map(|x| (x / greatest).powi(2)).sum::<f64>().sqrt() * greatest;
    if (length - 1.0).abs() > AXIS_DIGITS {
        diagnostics.push(messages::axis_length(what, length).at(&axis.place));
    }
}

/// One joint by itself.
pub(super) fn joint(joint: &WrittenJoint, format: &FileFormat, diagnostics: &mut Diagnostics) {
    let name = &joint.name.value;
    if joint.kind.value.is_free() {
        diagnostics.push(messages::floating_joint(name).at(&joint.kind.place));
    }
    if joint.kind.value.between_links().is_none() {
        return;
    }
    match &joint.placement {
        _ if !joint.kind.value.has_axis() => {}
        // a file of this kind has axes of any length
        Placement::Anchored(AnchoredJoint { axis, .. }) => {
            axis_greatest(&format!("axis of joint `{name}`"), axis, diagnostics);
        }
        Placement::Frames { axis, .. } => axis_length(&format!("axis of joint `{name}`"), axis, diagnostics),
        Placement::Vectors(JointVectors { e_parent, e, .. }) => {
            axis_length(&format!("`e_next` of link `{}`", joint.parent.value), e_parent, diagnostics);
            axis_length(&format!("`e` of link `{}`", joint.child.value), e, diagnostics);
        }
    }
    limits(&joint.name, joint.kind.value, &joint.limits, format, diagnostics);
    drive(&joint.name, &joint.drive, diagnostics);
    of_one_coordinate(joint, format, diagnostics);
}

/// Loops that hold all their joints still: bodies that can move in no way are one.
pub(super) fn loops_move(model: &Model<Dd>, description: &Description, diagnostics: &mut Diagnostics) {
    for group in &model.closure.groups {
        if group.dependents.iter().any(|b| !model.movers(*b).is_empty()) {
            continue;
        }
        let joints = group.dependents.iter().map(|b| model.bodies[*b].joint.name.as_str());
        let own = &description.loops[group.loops[0]].name;
        diagnostics.push(messages::loop_locked(&own.value, joints).at(&own.place));
    }
}

/// The damping of a base, which floats where it is damped.
pub(super) fn base_damping(description: &Description, is_floating: bool, diagnostics: &mut Diagnostics) {
    match &description.base_damping {
        Some(damping) if damping.value < 0.0 => {
            diagnostics.push(messages::negative_base_damping(damping.value).at(&damping.place));
        }
        Some(damping) if damping.value != 0.0 && !is_floating => {
            diagnostics.push(messages::damped_base_stands(damping.value).at(&damping.place));
        }
        _ => {}
    }
}

/// What only a joint of one coordinate has: limits, dry friction, a rotor behind a gear and a spring. Damping and an armature act on every rate alike; what
/// SDF says of an axis it says of no ball joint.
fn of_one_coordinate(joint: &WrittenJoint, format: &FileFormat, diagnostics: &mut Diagnostics) {
    let kind = joint.kind.value;
    if kind.between_links().is_none_or(|kind| kind.is_single()) {
        return;
    }
    let of_one =
        |(what, _): &(&str, &Noted<f64>)| format.dialect == Dialect::Sdf || !["damping", "an armature"].contains(what);
    for (what, value) in joint.of_one_coordinate().into_iter().filter(of_one) {
        let complaint = messages::several_coordinates(&joint.name.value, kind.word, what);
        diagnostics.push(complaint.at(&value.place));
    }
}

/// What the drive of a joint that moves adds.
pub(super) fn drive(joint: &Noted<String>, drive: &JointDrive, diagnostics: &mut Diagnostics) {
    let name = &joint.value;
    for (what, value) in [
        ("damping", &drive.damping),
        ("friction", &drive.friction),
        ("rotor_inertia", &drive.rotor_inertia),
        ("armature", &drive.armature),
        ("the spring's stiffness", &drive.spring_stiffness),
    ] {
        if let Some(value) = value.as_ref().filter(|v| v.value < 0.0) {
            diagnostics.push(messages::negative_effect(name, what, value.value).at(&value.place));
        }
    }
    if let (Some(_), Some(armature)) = (&drive.rotor_inertia, &drive.armature) {
        let owner = format!("joint `{name}`");
        diagnostics.push(messages::written_twice(&owner, "rotor_inertia", "armature").at(&armature.place));
    }
    match (&drive.gear_ratio, &drive.rotor_inertia) {
        (Some(ratio), _) if ratio.value == 0.0 => {
            diagnostics.push(messages::gear_ratio_zero(name).at(&ratio.place));
        }
        (Some(ratio), None) => diagnostics.push(messages::gear_ratio_alone(name).at(&ratio.place)),
        _ => {}
    }
}

/// The same as the model has it: a rotor of inertia J on a gear of ratio N has ½ J (N q̇)², as if J N² sat on the joint.
pub(super) fn model_effects(drive: &JointDrive) -> JointEffects<Dd> {
    let or_zero = |value: &Option<Noted<f64>>| value.as_ref().map_or(Dd::ZERO, |v| Dd::from(v.value));
    let ratio = drive.gear_ratio.as_ref().map_or(Dd::ONE, |v| Dd::from(v.value));
    let rotor_inertia = or_zero(&drive.rotor_inertia) * ratio * ratio + or_zero(&drive.armature);
    let friction = or_zero(&drive.friction);
    JointEffects {
        rotor_inertia: (rotor_inertia != Dd::ZERO).then_some(rotor_inertia),
        damping: or_zero(&drive.damping),
        coulomb: if friction == Dd::ZERO { Coulomb::Off } else { Coulomb::Sign(friction) },
        stiffness: or_zero(&drive.spring_stiffness),
        spring_rest: or_zero(&drive.spring_rest),
    }
}

/// The limits of a joint that moves.
pub(super) fn limits(
    joint: &Noted<String>,
    kind: JointType,
    limits: &JointLimits,
    format: &FileFormat,
    diagnostics: &mut Diagnostics,
) {
    let name = &joint.value;
    if kind.has_range {
        let same = JointType::words(format.dialect).into_iter().find(|(_, t)| t.kind == kind.kind && t.has_range);
        let word = same.map_or(kind.word, |(word, _)| word);
        match (&limits.lower, &limits.upper) {
            (None, None) => {
                diagnostics.push(messages::limits_missing(name, word, format.limits).at(&joint.place));
            }
            (Some(lower), Some(upper)) if lower.value > upper.value => {
                let complaint = messages::limits_reversed(name, lower.value, upper.value).at(&lower.place);
                diagnostics.push(complaint);
            }
            _ => {}
        }
    }
    for (what, limit) in [("velocity", &limits.velocity), ("effort", &limits.effort)] {
        if let Some(limit) = limit.as_ref().filter(|l| l.value < 0.0) {
            diagnostics.push(messages::negative_limit(name, what, limit.value).at(&limit.place));
        }
    }
}

/// The limits as the model has them.
pub(super) fn model_limits(kind: JointType, limits: &JointLimits) -> Limits {
    let or = |limit: &Option<Noted<f64>>, default: f64| limit.as_ref().map_or(default, |l| l.value);
    Limits {
        lower: if kind.has_range { or(&limits.lower, f64::NEG_INFINITY) } else { f64::NEG_INFINITY },
        upper: if kind.has_range { or(&limits.upper, f64::INFINITY) } else { f64::INFINITY },
        velocity: or(&limits.velocity, f64::INFINITY).abs(),
        effort: or(&limits.effort, f64::INFINITY).abs(),
    }
}

/// Angles that are near a right angle and not taken as one, and angles of a million radians.
pub(super) fn angles(description: &Description, options: &ModelOptions, diagnostics: &mut Diagnostics) {
    for (what, written) in description.angles() {
        let greatest = angle::radians(written).to_f64();
        if greatest.abs() > angle::GREATEST_ANGLE {
            diagnostics.push(messages::out_of_range(&what, greatest, angle::GREATEST_ANGLE).at(&written.place));
        }
    }
    // who takes every angle literally does so on purpose
    let doubtful = if options.angle_tolerance > 0.0 { doubtful_angles(description, options) } else { Vec::new() };
    let farthest = doubtful.iter().max_by(|a, b| a.deviation.abs().total_cmp(&b.deviation.abs()));
    if let Some(farthest) = farthest {
        diagnostics.push(messages::near_right_angle(doubtful.len(), farthest.deviation).at(&doubtful[0].place));
    }
}

/// Whether something moves.
pub(super) fn motion(assembly: &Assembly, description: &Description, diagnostics: &mut Diagnostics) {
    if assembly.bodies.is_empty() && !diagnostics.has_errors() {
        diagnostics.push(messages::nothing_moves(&description.name.value).at(&description.name.place));
    }
}

/// Whether every joint feels some inertia.
pub(super) fn singular(model: &Model<Dd>, joint_places: &[Place], diagnostics: &mut Diagnostics) {
    for id in singular_joints(model, Inertia::OfLinks) {
        diagnostics.push(
            messages::singular_joint(&model.bodies[id].joint.name, what_is_missing(model, id)).at(&joint_places[id]),
        );
    }
}

/// What the links that a joint moves lack, in words.
fn what_is_missing(model: &Model<Dd>, id: usize) -> &'static str {
    let bodies = &model.bodies;
    let is_moved = |mut body: usize| loop {
        match bodies[body].parent {
            _ if body == id => break true,
            Some(parent) => body = parent,
            None => break false,
        }
    };
    let moved = || (id..bodies.len()).filter(|b| is_moved(*b)).map(|b| &bodies[b]);
    let has_mass = moved().any(|b| b.inertia.mass.to_f64() > 0.0);
    let has_inertia = moved().any(|b| {
        let s = b.inertia.second_moment_com;
        [s.xx, s.yy, s.zz, s.xy, s.xz, s.yz].iter().any(|x| x.to_f64() != 0.0)
    });
    match bodies[id].joint.kind.row().measures.contains(&Measure::Length) {
        true if !has_mass => "mass",
        false if !has_mass && !has_inertia => "mass",
        _ if moved().count() == 1 => "inertia about its axis",
        _ => "inertia that is left where the joints beyond it are free",
    }
}
