//! From links and joints to bodies: fixed joints merged, canonical frames, depth first.

use super::flexible::{self, Carrier};
use super::geometry::{canonical_rotation, compose, point, snap_tensor, turned, unit, vector};
use super::merge::{merge, Part};
use super::{angle, centres_of_mass, check, transform, Assembly, ModelOptions};
use crate::description::flexible::Flexible;
use crate::description::{
    messages, AnchoredJoint, BaseKind, Description, Placement, PoseCoordinate, WrittenInertial, WrittenJoint,
};
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
    pub fn of(joint: &WrittenJoint, tolerance: f64, diagnostics: &mut Diagnostics) -> Option<Seat> {
        let (origin, axis) = match &joint.placement {
            Placement::Vectors(vectors) => return centres_of_mass::seat(vectors, joint, tolerance, diagnostics),
            Placement::Frames { origin, axis } => (origin, axis),
            Placement::Anchored(anchored) => return Seat::anchored(anchored, tolerance),
        };
        let rotation = match joint.kind.value.has_axis() {
            true => canonical_rotation(unit(vector(axis.value))?),
            false => Mat3::identity(),
        };
        Some(Seat {
            in_parent: transform(origin, tolerance),
            canonical: turned(rotation),
            link_frame: turned(rotation.transpose()),
            in_link: Vec3::zero(),
        })
    }

    /// A joint anywhere in the child's link frame: T = T_origin T_anchor M(−reference) M(q) T_anchor⁻¹.
    fn anchored(joint: &AnchoredJoint, tolerance: f64) -> Option<Seat> {
        let AnchoredJoint { origin, anchor, axis, reference } = joint;
        let moved = |translation| Transform { rotation: Mat3::identity(), translation };
        let anchor = vector(anchor.value);
        let rotation = canonical_rotation(unit(vector(axis.value))?);
        let back = match reference {
            None => Transform::identity(),
            Some(PoseCoordinate::Angle(angle)) => {
                let (sin, cos) = angle::read(angle, tolerance).sin_cos;
                turned(Mat3::about_z(-sin, cos))
            }
            Some(PoseCoordinate::Length(length)) => moved(Vec3::unit_z().scale(-Dd::from(length.value))),
        };
        Some(Seat {
            in_parent: compose(&transform(origin, tolerance), &moved(anchor)),
            canonical: compose(&turned(rotation), &back),
            link_frame: compose(&turned(rotation.transpose()), &moved(anchor.map(|x| Dd::ZERO - x))),
            in_link: anchor,
        })
    }
}

/// The bodies so far, while links are added from the root to the tips.
struct Growing<'a> {
    description: &'a Description,
    tolerance: f64,
    bodies: Vec<Body<Dd>>,
    /// Of each body, where the joint that carries it stands in the file.
    joint_places: Vec<Place>,
    /// Of each body, what the links on it add to its inertia.
    parts: Vec<Vec<Part>>,
    /// What carries each link.
    carriers: Vec<Carrier>,
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
    let mut growing = Growing {
        description,
        tolerance,
        bodies: Vec::new(),
        joint_places: Vec::new(),
        parts: Vec::new(),
        carriers: vec![Carrier::rigid(None, Transform::identity()); description.links.len()],
    };
    let is_floating = floats(description, options, diagnostics);
    check::base_damping(description, is_floating, diagnostics);
    let names: Vec<&str> = description.links.iter().map(|link| link.name.value.as_str()).collect();
    let flexible = match options.rigid_links {
        true => Vec::new(),
        false => flexible::chosen(&description.flexible, &options.flexible, &names, diagnostics),
    };
    growing.add_root(tree.root, is_floating, options, diagnostics)?;
    let mut open: Vec<usize> = vec![tree.root];
    // depth first, the joints of a link in the order of the file: a stack takes them in reverse
    let mut above: Vec<Option<usize>> = vec![None; description.links.len()];
    while let Some(link) = open.pop() {
        let mut held_at = Vec3::zero();
        if let Some(j) = above[link] {
            held_at = seats[j].in_link;
            growing.carriers[link] = growing.add_joint(&description.joints[j], &seats[j], tree.parent_of[j]);
        }
        let bends = flexible.iter().copied().find(|flexible| flexible.link.value == names[link]);
        growing.add_link(link, held_at, bends, diagnostics);
        for &j in tree.joints_of[link].iter().rev() {
            above[tree.child_of[j]] = Some(j);
            open.push(tree.child_of[j]);
        }
    }
    growing.finish(diagnostics)
}

impl Growing<'_> {
    /// Adds a body with what is on it, and the place of its joint; its index.
    fn push(&mut self, body: Body<Dd>, place: &Place, parts: Vec<Part>) -> BodyId {
        self.bodies.push(body);
        self.joint_places.push(place.clone());
        self.parts.push(parts);
        self.bodies.len() - 1
    }

    /// Adds the joints between the world and the root link: none, a free one, or the springs of a support.
    fn add_root(
        &mut self,
        root: usize,
        is_floating: bool,
        options: &ModelOptions,
        diagnostics: &mut Diagnostics,
    ) -> Option<()> {
        let name = &self.description.links[root].name;
        if is_floating {
            let own = root_joint_name(self.description);
            let joint = Joint { name: own, kind: FLOATING_BASE, iq: 0, iv: 0, limits: Limits::default() };
            let damping = self.description.base_damping.as_ref().map_or(0.0, |damping| damping.value);
            let effects = JointEffects { damping: Dd::from(damping), ..JointEffects::none() };
            let body = new_body(&name.value, None, joint, Transform::identity(), Transform::identity());
            let body = Body { effects, ..body };
            let body = self.push(body, &name.place, Vec::new());
            self.carriers[root] = Carrier::rigid(Some(body), Transform::identity());
        }
        match options.support.as_ref().filter(|_| !options.rigid_links) {
            Some(support) if is_floating => {
                diagnostics.push(messages::support_floats().at(&support.place.place));
            }
            Some(support) => {
                let elastic = flexible::support(support, &name.value, diagnostics)?;
                let base = elastic.last().map(|body| body.link_frame)?;
                self.carriers[root] = Carrier::rigid(Some(elastic.len() - 1), base);
                for body in elastic {
                    self.push(body, &support.place.place, Vec::new());
                }
            }
            None => {}
        }
        Some(())
    }

    /// Adds a joint on a link, with its body if it moves; what carries its child.
    fn add_joint(&mut self, joint: &WrittenJoint, seat: &Seat, parent: usize) -> Carrier {
        let parent = self.carriers[parent].at(seat.in_parent.translation);
        let x_parent_joint = compose(&parent.1, &seat.in_parent);
        let Some(kind) = joint.kind.value.between_links() else {
            return Carrier::rigid(parent.0, x_parent_joint);
        };
        let placement = compose(&x_parent_joint, &seat.canonical);
        let limits = check::model_limits(joint.kind.value, &joint.limits);
        let model_joint = Joint { name: joint.name.value.clone(), kind, iq: 0, iv: 0, limits };
        let body = new_body(&joint.child.value, parent.0, model_joint, placement, seat.link_frame);
        let body = Body { effects: check::model_effects(&joint.drive), ..body };
        Carrier::rigid(Some(self.push(body, &joint.name.place, Vec::new())), seat.link_frame)
    }

    /// Adds a link to the body that carries it, or the bodies that it is cut into where it bends.
    fn add_link(&mut self, link: usize, held_at: Vec3<Dd>, bends: Option<&Flexible>, diagnostics: &mut Diagnostics) {
        let (body, x_body_link) = self.carriers[link].first();
        let inertial = self.description.links[link].inertial.as_ref();
        let Some(flexible) = bends else {
            if let (Some(body), Some(inertial)) = (body, inertial) {
                self.parts[body].push(part(inertial, &x_body_link, self.tolerance));
            }
            return;
        };
        let whole = inertial.map(|inertial| part(inertial, &Transform::identity(), self.tolerance));
        let (carrier, next) = ((body, x_body_link), self.bodies.len());
        let Some(cut) = flexible::cut(flexible, carrier, held_at, whole, next, diagnostics) else { return };
        if let (Some(body), Some(first)) = (body, cut.first) {
            let Part { mass, com, inertia_com } = first;
            self.parts[body].push(Part::placed(mass, com, inertia_com, &x_body_link));
        }
        for (body, part) in cut.bodies {
            self.push(body, &flexible.link.place, part.into_iter().collect());
        }
        self.carriers[link] = cut.carrier;
    }

    /// The bodies with all that is on them, and the frames of links and those that the file names.
    fn finish(mut self, diagnostics: &mut Diagnostics) -> Option<Assembly> {
        let Growing { description, tolerance, .. } = self;
        for (body, parts) in self.bodies.iter_mut().zip(&self.parts) {
            body.inertia = merge(parts);
        }
        if diagnostics.has_errors() {
            return None;
        }
        zero_masses(description, &self.bodies, &self.carriers, diagnostics);
        let mut links = BTreeMap::new();
        let mut frames = Vec::new();
        for (link, carrier) in description.links.iter().zip(self.carriers) {
            let (body, placement) = carrier.first();
            links.insert(link.name.value.clone(), carrier);
            if link.is_carrier {
                continue;
            }
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
        Some(Assembly { bodies: self.bodies, joint_places: self.joint_places, frames, links })
    }
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
