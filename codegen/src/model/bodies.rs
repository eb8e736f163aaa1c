//! From links and joints to bodies: fixed joints merged, canonical frames, depth first.

use super::flexible::{self, Carrier};
use super::geometry::{canonical_rotation, compose, point, snap_tensor, turned, unit, vector};
use super::merge::{merge, Part};
use super::{angle, centres_of_mass, check, transform, Assembly, ModelOptions};
use crate::description::{messages, BaseKind, Description, Placement, WrittenInertial, WrittenJoint};
use crate::diagnostic::{Diagnostics, Place};
use std::collections::BTreeMap;
use straightline_core::algorithms::composing_pays;
use straightline_core::joint::FLOATING_BASE;
use straightline_core::model::{Body, BodyId, Frame, Joint, JointEffects, Limits};
use straightline_core::spatial::{Mat3, SpatialInertia, Transform, Vec3};
use straightline_core::Dd;

/// Where a joint stands between the frames of its links.
pub(super) struct Seat {
    /// Pose of a joint frame in the parent's link frame.
    pub in_parent: Transform<Dd>,
    /// Pose of the canonical frame in that.
    pub canonical: Transform<Dd>,
    /// Pose of the child's link frame in the canonical frame at q = 0.
    pub link_frame: Transform<Dd>,
    /// The joint in the child's link frame.
    pub in_link: Vec3<Dd>,
}

impl Seat {
    /// As the file says it; `None` after a complaint.
    fn of(joint: &WrittenJoint, tolerance: f64, diagnostics: &mut Diagnostics) -> Option<Seat> {
        let (origin, axis) = match &joint.placement {
            Placement::Vectors(vectors) => return centres_of_mass::seat(vectors, joint, tolerance, diagnostics),
            Placement::Frames { origin, axis } => (origin, axis),
        };
        let rotation = match joint.kind.value.between_links() {
            Some(_) => canonical_rotation(unit(vector(axis.value))?),
            None => Mat3::identity(),
        };
        Some(Seat {
            in_parent: transform(origin, tolerance),
            canonical: turned(rotation),
            link_frame: turned(rotation.transpose()),
            in_link: Vec3::zero(),
        })
    }
}

pub(super) fn assemble(
    description: &Description,
    options: &ModelOptions,
    tolerance: f64,
    diagnostics: &mut Diagnostics,
) -> Option<Assembly> {
    for link in &description.links {
        if let Some(WrittenInertial { mass, inertia, .. }) = &link.inertial {
            check::inertial(&link.name.value, mass, inertia, diagnostics);
        }
    }
    let mut seats = Vec::new();
    for joint in &description.joints {
        check::joint(joint, description.format, diagnostics);
        seats.extend(Seat::of(joint, tolerance, diagnostics));
    }
    let tree = check::tree(description, diagnostics)?;
    if diagnostics.has_errors() {
        return None;
    }
    let is_floating = floats(description, options, diagnostics);

    let mut bodies: Vec<Body<Dd>> = Vec::new();
    let mut joint_places: Vec<Place> = Vec::new();
    let mut parts: Vec<Vec<Part>> = Vec::new();
    let mut carriers = vec![Carrier::rigid(None, Transform::identity()); description.links.len()];
    let names: Vec<&str> = description.links.iter().map(|link| link.name.value.as_str()).collect();
    let flexible = match options.rigid_links {
        true => Vec::new(),
        false => flexible::chosen(&description.flexible, &options.flexible, &names, diagnostics),
    };
    if is_floating {
        let root = &description.links[tree.root].name;
        let joint =
            Joint { name: root_joint_name(description), kind: FLOATING_BASE, iq: 0, iv: 0, limits: Limits::default() };
        bodies.push(new_body(&root.value, None, joint, Transform::identity(), Transform::identity()));
        joint_places.push(root.place.clone());
        parts.push(Vec::new());
        carriers[tree.root] = Carrier::rigid(Some(0), Transform::identity());
    }
    match options.support.as_ref().filter(|_| !options.rigid_links) {
        Some(support) if is_floating => {
            diagnostics.push(messages::support_floats().at(&support.place.place));
        }
        Some(support) => {
            let elastic = flexible::support(support, names[tree.root], diagnostics)?;
            let base = elastic.last().map(|body| body.link_frame)?;
            carriers[tree.root] = Carrier::rigid(Some(elastic.len() - 1), base);
            for body in elastic {
                bodies.push(body);
                joint_places.push(support.place.place.clone());
                parts.push(Vec::new());
            }
        }
        None => {}
    }
    let mut open: Vec<usize> = vec![tree.root];
    // depth first, the joints of a link in the order of the file: a stack takes them in reverse
    let mut above: Vec<Option<usize>> = vec![None; description.links.len()];
    while let Some(link_index) = open.pop() {
        let mut held_at = Vec3::zero();
        if let Some(j) = above[link_index] {
            let joint = &description.joints[j];
            let seat = &seats[j];
            held_at = seat.in_link;
            let parent = carriers[tree.parent_of[j]].at(seat.in_parent.translation);
            let x_parent_joint = compose(&parent.1, &seat.in_parent);
            let (body, x_body_link) = match joint.kind.value.between_links() {
                None => (parent.0, x_parent_joint),
                Some(kind) => {
                    let placement = compose(&x_parent_joint, &seat.canonical);
                    let model_joint = Joint {
                        name: joint.name.value.clone(),
                        kind,
                        iq: 0,
                        iv: 0,
                        limits: check::model_limits(joint.kind.value, &joint.limits),
                    };
                    let effects = check::model_effects(&joint.drive);
                    let body = new_body(&joint.child.value, parent.0, model_joint, placement, seat.link_frame);
                    bodies.push(Body { effects, ..body });
                    joint_places.push(joint.name.place.clone());
                    parts.push(Vec::new());
                    (Some(bodies.len() - 1), seat.link_frame)
                }
            };
            carriers[link_index] = Carrier::rigid(body, x_body_link);
        }
        let (body, x_body_link) = carriers[link_index].first();
        let inertial = description.links[link_index].inertial.as_ref();
        match flexible.iter().find(|flexible| flexible.link.value == names[link_index]) {
            None => {
                if let (Some(body), Some(inertial)) = (body, inertial) {
                    parts[body].push(part(inertial, &x_body_link, tolerance));
                }
            }
            Some(flexible) => {
                let whole = inertial.map(|inertial| part(inertial, &Transform::identity(), tolerance));
                let (carrier, next) = ((body, x_body_link), bodies.len());
                if let Some(cut) = flexible::cut(flexible, carrier, held_at, whole, next, diagnostics) {
                    if let (Some(body), Some(first)) = (body, cut.first) {
                        let Part { mass, com, inertia_com } = first;
                        parts[body].push(Part::placed(mass, com, inertia_com, &x_body_link));
                    }
                    for (body, part) in cut.bodies {
                        bodies.push(body);
                        joint_places.push(flexible.link.place.clone());
                        parts.push(part.into_iter().collect());
                    }
                    carriers[link_index] = cut.carrier;
                }
            }
        }
        for &j in tree.joints_of[link_index].iter().rev() {
            above[tree.child_of[j]] = Some(j);
            open.push(tree.child_of[j]);
        }
    }
    for (body, parts) in bodies.iter_mut().zip(&parts) {
        body.inertia = merge(parts);
    }
    if diagnostics.has_errors() {
        return None;
    }
    zero_masses(description, &bodies, &carriers, diagnostics);

    let mut links = BTreeMap::new();
    let mut frames = Vec::new();
    for (link, carrier) in description.links.iter().zip(carriers) {
        let (body, placement) = carrier.first();
        links.insert(link.name.value.clone(), carrier);
        frames.push(Frame { name: link.name.value.clone(), body, placement });
    }
    let mut carried = Vec::new();
    for frame in &description.frames {
        let (body, x_body_link) = links.get(&frame.link.value)?.at(vector(frame.pose.xyz.value));
        let placement = compose(&x_body_link, &transform(&frame.pose, tolerance));
        frames.push(Frame { name: frame.name.value.clone(), body, placement });
        carried.push((frame.name.value.clone(), Carrier::rigid(body, placement)));
    }
    links.extend(carried);
    Some(Assembly { bodies, joint_places, frames, links })
}

/// Whether the base floats, by file or option.
fn floats(description: &Description, options: &ModelOptions, diagnostics: &mut Diagnostics) -> bool {
    match &description.base {
        Some(base) if base.value == BaseKind::Fixed && options.floating_base => {
            diagnostics.push(messages::floating_by_option().at(&base.place));
            true
        }
        Some(base) => base.value == BaseKind::Floating || options.floating_base,
        None => options.floating_base,
    }
}

/// `root_joint`, or with underscores before it where the file has a joint of that name.
fn root_joint_name(description: &Description) -> String {
    let mut name = "root_joint".to_string();
    while description.joints.iter().any(|j| j.name.value == name) {
        name.insert(0, '_');
    }
    name
}

fn new_body(
    name: &str,
    parent: Option<BodyId>,
    joint: Joint,
    placement: Transform<Dd>,
    link_frame: Transform<Dd>,
) -> Body<Dd> {
    let dense = composing_pays(parent, &placement.rotation);
    Body {
        name: name.to_string(),
        parent,
        joint,
        placement,
        inertia: SpatialInertia::zero(),
        link_frame,
        dense,
        effects: JointEffects::none(),
        load: None,
    }
}

fn part(inertial: &WrittenInertial, x_body_link: &Transform<Dd>, tolerance: f64) -> Part {
    let r_body_inertial = compose(x_body_link, &turned(angle::rotation(&inertial.rotation, tolerance))).rotation;
    Part {
        mass: Dd::from(inertial.mass.value),
        com: point(x_body_link, vector(inertial.com.value)),
        inertia_com: snap_tensor(inertial.inertia.value.map(Dd::from).rotated(&r_body_inertial)),
    }
}

/// Warns of links whose mass is written as zero while nothing of their body has any, but what they carry has.
fn zero_masses(description: &Description, bodies: &[Body<Dd>], carriers: &[Carrier], diagnostics: &mut Diagnostics) {
    let mut carries_mass = vec![false; bodies.len()];
    for (id, body) in bodies.iter().enumerate().rev() {
        if let Some(parent) = body.parent {
            carries_mass[parent] |= carries_mass[id] || body.inertia.mass != Dd::ZERO;
        }
    }
    for (link, carrier) in description.links.iter().zip(carriers) {
        let (Some(body), Some(inertial)) = (carrier.first().0, &link.inertial) else { continue };
        let s = bodies[body].inertia.second_moment_com;
        let has_inertia = [s.xx, s.yy, s.zz].iter().any(|x| *x != Dd::ZERO);
        let is_link_of_joint = bodies[body].name == link.name.value;
        if is_link_of_joint && bodies[body].inertia.mass == Dd::ZERO && !has_inertia && carries_mass[body] {
            diagnostics.push(messages::zero_mass(&link.name.value).at(&inertial.mass.place));
        }
    }
}
