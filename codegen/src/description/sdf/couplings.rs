//! Joints whose coordinates follow those of others: by `mimic` and by gears.

use super::axes::SdfAxis;
use super::frames::FrameKind;
use super::joints::{part_name, SdfJoint};
use super::Sdf;
use crate::description::angle::{self, ROUNDING};
use crate::description::composite::PartAxis;
use crate::description::geometry::{magnitude, unit, vector};
use crate::description::xml::{children, tag};
use crate::description::{messages, JointType, Noted, WrittenCoupling};
use roxmltree::Node;
use straightline_core::joint::Dialect;
use straightline_core::spatial::Vec3;
use straightline_core::Dd;

/// Axes as far apart \[rad\] are not those of one joint: what numbers with a few digits can be off.
const PARALLEL: f64 = 1e-9;

/// A joint that does nothing but turn about an axis.
pub(super) struct TurningJoint {
    pub name: Noted<String>,
    /// What carries it, and the link that it moves.
    pub bodies: [usize; 2],
    /// Its direction, and the frame that this is given in.
    pub axis: ([f64; 3], usize),
}

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// Adds what couples a joint to others.
    pub fn add_couplings(&mut self, joint: &SdfJoint<'d, 'i>) {
        let Some(kind) = &joint.kind else {
            self.add_gear(joint);
            return;
        };
        for (k, axis) in joint.axes.iter().enumerate() {
            let Some(mimic) = axis.mimic else { continue };
            let own = part_name(&joint.name, suffix(kind.value, k));
            let coupling = self.read_mimic(joint, &own, mimic);
            self.robot.couplings.extend(coupling);
        }
    }

    /// q = multiplier (q_leader − reference) + offset.
    fn read_mimic(
        &mut self,
        joint: &SdfJoint<'d, 'i>,
        own: &Noted<String>,
        mimic: Node<'d, 'i>,
    ) -> Option<WrittenCoupling> {
        let owner = format!("mimic of joint `{}`", own.value);
        self.check_attributes(&owner, mimic, &["joint", "axis"]);
        let [multiplier, offset, reference] = self.pick(&owner, mimic, ["multiplier", "offset", "reference"]);
        let mut number = |element: Option<Node<'d, 'i>>, otherwise: f64| match element {
            Some(_) => self.number_in(element, &owner),
            None => Some(self.reader.value(otherwise, &tag(mimic))),
        };
        let (ratio, offset, reference) = (number(multiplier, 1.0), number(offset, 0.0), number(reference, 0.0));
        let Some((name, span)) = self.attribute(mimic, "joint") else {
            let complaint = messages::missing_attribute(&owner, "joint", "<mimic joint=\"...\">");
            self.complain(&tag(mimic), complaint);
            return None;
        };
        let axis = match self.attribute(mimic, "axis") {
            Some((word, span)) => {
                let word = self.reader.value(word.to_string(), &span);
                self.reader.word(&format!("axis of {owner}"), &word, &[("axis", 0), ("axis2", 1)])?
            }
            None => 0,
        };
        let scope = self.frames[joint.frame].scope;
        let leader = self.frame_named(scope, (name, span.clone()), &owner)?;
        if self.frames[leader].kind != FrameKind::Joint {
            let joints = self.frames_of(FrameKind::Joint);
            let joints: Vec<String> = joints.iter().map(|joint| self.frames[*joint].name.value.clone()).collect();
            let complaint = messages::coupling_joint(&own.value, name, joints.iter().map(String::as_str));
            self.complain(&span, complaint);
            return None;
        }
        let word = self.frames[leader].element.attribute("type").unwrap_or("");
        let kind = JointType::words(Dialect::Sdf).into_iter().find(|(known, _)| *known == word.trim());
        let leader = part_name(&self.frames[leader].name, kind.map_or("", |(_, kind)| suffix(kind, axis)));
        let source = self.reader.value(leader.value, &span);
        let (ratio, offset, reference) = (ratio?, offset?, reference?);
        let shift = Dd::from(offset.value) - Dd::from(ratio.value) * Dd::from(reference.value);
        Some(WrittenCoupling { joint: own.clone(), source, ratio, offset: Noted::new(shift.to_f64(), offset.place) })
    }

    /// θ₂ = −g θ₁, with the turns θ₁ of the parent about `axis` and θ₂ of the child about `axis2`, both against the reference body.
    fn add_gear(&mut self, joint: &SdfJoint<'d, 'i>) {
        let (element, owner) = (self.frames[joint.frame].element, self.owner_of(joint.frame));
        let named = |name: &str| children(element).find(|child| child.tag_name().name() == name);
        let (ratio, reference) = (named("gearbox_ratio"), named("gearbox_reference_body"));
        let Some(reference) = reference else {
            let example = "<gearbox_reference_body>...</gearbox_reference_body>";
            self.complain(&tag(element), messages::missing_element(&owner, "gearbox_reference_body", example));
            return;
        };
        let ratio = match ratio {
            Some(_) => self.number_in(ratio, &owner),
            None => Some(self.reader.value(1.0, &tag(element))),
        };
        let scope = self.frames[joint.frame].scope;
        let name = self.text(reference);
        let reference = self.frame_named(scope, name, &format!("gearbox_reference_body of {owner}"));
        let (Some(ratio), Some(reference)) = (ratio, reference) else { return };
        let reference = self.frames[reference].body;
        let [parent, child] = joint.bodies;
        let mut turns = |link: usize, axis: &SdfAxis<'d, 'i>| self.turn_of([reference, link], axis);
        let ends = (turns(parent, &joint.axes[0]), turns(child, &joint.axes[1]));
        let (Some((source, first)), Some((follower, second))) = ends else {
            let why = "a gear couples two joints that turn its links against the reference body, about its axes";
            let help = "write such joints, or `<mimic>` in the joint that follows";
            let complaint = messages::not_supported_yet(&owner, "gearbox", why, help);
            self.complain(&joint.name.place.span, complaint);
            return;
        };
        self.robot.couplings.push(WrittenCoupling {
            joint: follower,
            source,
            ratio: Noted::new(-ratio.value * first * second, ratio.place.clone()),
            offset: Noted::new(0.0, ratio.place),
        });
    }

    /// The joint between two bodies that turns about an axis, and the sign of its coordinate.
    fn turn_of(&mut self, bodies: [usize; 2], axis: &SdfAxis<'d, 'i>) -> Option<(Noted<String>, f64)> {
        let found = self.turning.iter().find(|joint| joint.bodies == bodies)?;
        let (name, own) = (found.name.clone(), found.axis);
        let a = unit(self.in_world(own.0, own.1))?;
        let b = unit(self.in_world(axis.xyz.value, axis.frame))?;
        (magnitude(a.cross(b)) < PARALLEL).then(|| (name, if a.dot(b) > Dd::ZERO { 1.0 } else { -1.0 }))
    }

    /// A direction in the axes of the world, as the file places the links.
    fn in_world(&mut self, direction: [f64; 3], frame: usize) -> Vec3<Dd> {
        let path = self.path(super::WORLD, frame);
        path.iter().rev().fold(vector(direction), |v, step| angle::rotation(&step.turn().rotation, ROUNDING) * v)
    }
}

/// What stands behind the name of a joint for its first or second axis.
fn suffix(kind: JointType, axis: usize) -> &'static str {
    let Some(composite) = kind.composite else { return "" };
    let is_second = |along: PartAxis| matches!(along, PartAxis::SecondAxis);
    let part = composite.of.parts.iter().find(|part| is_second(part.along) == (axis == 1));
    part.map_or("", |part| part.suffix)
}
