//! Equalities and tendons: joints whose coordinates follow others; what else would bind the motion is refused.

use super::classes::Defaulted;
use super::files::{Attribute, Element};
use super::{vocabulary, Mjcf};
use crate::description::angle::{self, ROUNDING};
use crate::description::geometry::{unit, vector};
use crate::description::{
    messages, AnchoredJoint, Angle, AngleUnit, ClosingJoint, LoopPoints, Noted, Placement, PoseCoordinate, Rotation,
    WrittenCoupling, WrittenJoint, WrittenLink, WrittenLoop, WrittenPose, WrittenTurn,
};
use straightline_core::Dd;

impl<'s> Mjcf<'s> {
    /// Reads the sections of equalities and tendons.
    pub fn read_constraints(&mut self) {
        let [equalities, tendons] = ["equality", "tendon"].map(|name| self.within(name));
        for element in equalities {
            self.read_equality(element, &tendons);
        }
        for element in tendons {
            self.read_tendon(element);
        }
    }

    fn read_equality(&mut self, element: &'s Element, tendons: &[&'s Element]) {
        let given = self.given_outermost(element, "equality");
        if self.flag(&given, "active") == Some(false) {
            self.ignore_as("equality that is not active", element);
            return;
        }
        let help = "remove it, or write `active=\"false\"`";
        match element.name.as_str() {
            "joint" => self.read_coupling(&given),
            "tendon" => self.read_tendon_equality(&given, tendons),
            "connect" => {
                let own = self.read_loop(&given);
                self.robot.loops.extend(own);
            }
            "weld" if self.is_moved_from_outside(element) => {
                let why =
                    "it pulls at a body that is moved from outside, which controls the robot and is no part of it";
                self.refuse(element, "the equality", why, help);
            }
            "weld" => {
                let own = self.read_weld(&given);
                self.robot.loops.extend(own);
            }
            _ => self.refuse(element, "the equality", "it binds the motion", help),
        }
    }

    /// Whether one of its bodies is a `mocap` body.
    fn is_moved_from_outside(&self, equality: &Element) -> bool {
        let names = ["body1", "body2"].map(|name| equality.attribute(name).map(|name| name.value.as_str()));
        let value = |body: &Element, name: &str| body.attribute(name).map(|own| own.value.trim().to_string());
        let mut bodies = self.files.elements.iter().filter(|element| element.name == "body");
        bodies.any(|body| {
            let is_named = names.iter().flatten().any(|name| value(body, "name").as_deref() == Some(name));
            is_named && value(body, "mocap").as_deref() == Some("true")
        })
    }

    /// Two sites that coincide, or a point of the first body and what is there of the second one in the pose of the file.
    fn read_loop(&mut self, given: &Defaulted<'s>) -> Option<WrittenLoop> {
        let (element, owner) = (given.element, "the connection");
        self.check_attributes(element, owner, vocabulary::CONNECT);
        let name = self.name_of(element, "connection");
        let named = |own: &Self, attribute: &Attribute| Noted::new(attribute.value.clone(), own.place(attribute));
        let points = match (element.attribute("site1"), element.attribute("site2")) {
            (Some(one), Some(other)) => LoopPoints::Frames([named(self, one), named(self, other)]),
            _ => {
                for (name, example) in [("body1", "body1=\"...\""), ("anchor", "anchor=\"0 0 0\"")] {
                    if given.attribute(name).is_none() {
                        self.complain_at(element, messages::missing_attribute(owner, name, example));
                        return None;
                    }
                }
                let bodies = ["body1", "body2"].map(|name| element.attribute(name));
                let links = bodies.map(|body| body.filter(|body| body.value != "world").map(|body| named(self, body)));
                LoopPoints::Anchor { links, point: self.vector(given, "anchor", owner, [0.0; 3]) }
            }
        };
        Some(WrittenLoop { name, points, determines: Vec::new(), assembly: None, joint: ClosingJoint::Spherical })
    }

    /// q₁ − ref₁ = a₀ + a₁ (q₂ − ref₂).
    fn read_coupling(&mut self, given: &Defaulted<'s>) {
        let element = given.element;
        let owner = "the equality of joints";
        self.check_attributes(element, owner, vocabulary::EQUALITY);
        let [a0, a1] = self.line(given, owner);
        let joint = self.joint_named(element, "joint1", owner);
        if given.attribute("joint2").is_none() {
            if let Some((joint, _)) = joint {
                self.hold(&joint.value, a0, given);
            }
            return;
        }
        let source = self.joint_named(element, "joint2", owner);
        let (Some((joint, own)), Some((source, other))) = (joint, source) else { return };
        let place = given.attribute("polycoef").map_or_else(|| self.tag(element), |polycoef| self.place(polycoef));
        let offset = own + Dd::from(a0) - Dd::from(a1) * other;
        self.robot.couplings.push(WrittenCoupling {
            joint,
            source,
            ratio: Noted::new(a1, place.clone()),
            offset: Noted::new(offset.to_f64(), place),
        });
    }

    /// Fixes a joint so far from where it is in the pose of the file \[rad or m\].
    fn hold(&mut self, name: &str, displacement: f64, given: &Defaulted<'s>) {
        let Some(k) = self.robot.joints.iter().position(|joint| joint.name.value == name) else { return };
        let WrittenJoint { name, kind, parent, child, placement, .. } = self.robot.joints[k].clone();
        let Placement::Anchored(AnchoredJoint { origin, anchor, axis, .. }) = placement else { return };
        let place = given.attribute("polycoef").map_or_else(|| self.tag(given.element), |own| self.place(own));
        let at = |xyz: [f64; 3], turns: Vec<WrittenTurn>| WrittenPose {
            xyz: Noted::new(xyz, place.clone()),
            rotation: Rotation::Turns(turns),
        };
        let mut poses = vec![origin];
        if displacement != 0.0 && kind.value.kind.is_some_and(|kind| kind.turns()) {
            let (text, unit) = (format!("{displacement:?}"), AngleUnit::Radian);
            let angle = Angle { value: displacement, unit, text, place: place.clone() };
            let turn = WrittenTurn::About { axis: axis.clone(), angle };
            poses.extend([at(anchor.value, Vec::new()), at([0.0; 3], vec![turn])]);
            poses.push(at(anchor.value.map(|x| 0.0 - x), Vec::new()));
        } else if displacement != 0.0 {
            let along = unit(vector(axis.value)).unwrap_or_else(|| vector([0.0; 3]));
            let xyz = along.scale(Dd::from(displacement)).to_array().map(Dd::to_f64);
            poses.push(at(xyz, Vec::new()));
        }
        let last = poses.pop().expect("there is the origin");
        let (mut parent, mut chain) = (parent, Vec::new());
        for pose in poses {
            let next = Noted::new(self.names.made_up(&format!("{}_carrier", name.value)), place.clone());
            self.robot.links.push(WrittenLink { name: next.clone(), inertial: None, is_carrier: true });
            let fixed = Noted::new(self.names.made_up(&format!("{}_fixed", next.value)), place.clone());
            chain.push(WrittenJoint::fixed(fixed, parent, next.clone(), pose));
            parent = next;
        }
        chain.push(WrittenJoint::fixed(name, parent, child, last));
        self.robot.joints.splice(k..=k, chain);
        self.ignore_as("joint that an equality holds", given.element);
    }

    /// a₀ and a₁ of `polycoef`, or a complaint that there is more.
    fn line(&mut self, given: &Defaulted<'s>, owner: &str) -> [f64; 2] {
        let mut line = [0.0, 1.0];
        let Some(attribute) = given.attribute("polycoef") else { return line };
        let Some(numbers) = self.numbers(&format!("polycoef of {owner}"), attribute, 1, 5) else { return line };
        line.iter_mut().zip(&numbers).for_each(|(own, number)| *own = *number);
        if numbers.iter().skip(2).any(|x| *x != 0.0) {
            let help = "write the straight line that is nearest, as in `polycoef=\"0 1 0 0 0\"`";
            let why = "one coordinate would follow another on a curve";
            self.complain(attribute, messages::not_supported_yet(owner, "polycoef", why, help));
        }
        line
    }

    /// A fixed tendon of two joints that keeps its length: c₁ (q₁ − ref₁) + c₂ (q₂ − ref₂) = a₀; the first joint follows.
    fn read_tendon_equality(&mut self, given: &Defaulted<'s>, tendons: &[&'s Element]) {
        let (element, owner) = (given.element, "the equality of tendons");
        let [a0, _] = self.line(given, owner);
        let named = |name: &Attribute| {
            let is_named = |tendon: &&&'s Element| tendon.attribute("name").is_some_and(|own| own.value == name.value);
            tendons.iter().find(is_named).copied()
        };
        let tendon = element.attribute("tendon1").and_then(named);
        let joints = match tendon {
            Some(tendon) if tendon.name == "fixed" && element.attribute("tendon2").is_none() => {
                self.files.children(tendon)
            }
            _ => Vec::new(),
        };
        let &[first, second] = &joints[..] else {
            let help = "write `equality/joint` in its place, or `active=\"false\"`";
            self.refuse(element, owner, "only one fixed tendon of two joints can keep its length", help);
            return;
        };
        let mut end = |joint: &'s Element| {
            let coefficient = self.number(&Defaulted::alone(joint), "coef", owner)?;
            Some((self.joint_named(joint, "joint", owner)?, coefficient))
        };
        let (first, second) = (end(first), end(second));
        let (Some(((joint, own), c1)), Some(((source, other), c2))) = (first, second) else { return };
        if c1.value == 0.0 {
            let help = "leave the joint out of the tendon";
            self.refuse(element, owner, "the coefficient of its first joint is zero", help);
            return;
        }
        let ratio = -Dd::from(c2.value) / Dd::from(c1.value);
        let offset = own + Dd::from(a0) / Dd::from(c1.value) - ratio * other;
        self.robot.couplings.push(WrittenCoupling {
            joint,
            source,
            ratio: Noted::new(ratio.to_f64(), c2.place),
            offset: Noted::new(offset.to_f64(), self.tag(element)),
        });
    }

    /// The joint that an attribute names, with its coordinate in the pose of the file.
    fn joint_named(&mut self, element: &'s Element, name: &str, owner: &str) -> Option<(Noted<String>, Dd)> {
        let Some(attribute) = element.attribute(name) else {
            self.complain_at(element, messages::missing_attribute(owner, name, &format!("{name}=\"...\"")));
            return None;
        };
        let joint = self.robot.joint(&attribute.value);
        let is_single = |kind: straightline_core::joint::JointKind| kind.is_single();
        match joint {
            Some(joint) if joint.kind.value.kind.is_some_and(is_single) => {
                let zero = match self.robot.reference_of(&joint.name.value) {
                    Some(PoseCoordinate::Angle(angle)) => angle::in_radians(angle, ROUNDING),
                    Some(PoseCoordinate::Length(length)) => Dd::from(length.value),
                    None => Dd::ZERO,
                };
                Some((Noted::new(attribute.value.clone(), self.place(attribute)), zero))
            }
            _ => {
                let all = self.robot.joints.iter().filter(|joint| joint.kind.value.kind.is_some_and(is_single));
                let names: Vec<String> = all.map(|joint| joint.name.value.clone()).collect();
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                self.complain(attribute, messages::drive_joint(owner, &attribute.value, names));
                None
            }
        }
    }

    fn read_tendon(&mut self, element: &'s Element) {
        let given = self.given_outermost(element, "tendon");
        let owner = match element.attribute("name") {
            Some(name) => format!("tendon `{}`", name.value),
            None => "a tendon".to_string(),
        };
        for name in ["stiffness", "damping", "frictionloss", "armature", "springyield"] {
            let help = "remove it; springs, dampers and friction act on joints";
            self.refuse_number(&given, name, &owner, "it would act on several joints", help);
        }
        self.ignore_as(&format!("{} tendon", element.name), element);
    }
}
