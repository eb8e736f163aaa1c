//! Equalities and tendons: joints whose coordinates follow others; what else would bind the motion is refused.

use super::classes::Given;
use super::files::Element;
use super::Mjcf;
use crate::description::{messages, Noted, Placement, Reference, WrittenCoupling};
use crate::model::angle::ROUNDING;
use crate::model::angle_in_radians;
use straightline_core::Dd;

impl<'s> Mjcf<'s> {
    /// Reads the sections of equalities and tendons.
    pub fn read_constraints(&mut self, equalities: &[&'s Element], tendons: &[&'s Element]) {
        for element in equalities.iter().flat_map(|section| self.files.children(section)) {
            self.read_equality(element);
        }
        for element in tendons.iter().flat_map(|section| self.files.children(section)) {
            self.read_tendon(element);
        }
    }

    fn read_equality(&mut self, element: &'s Element) {
        let given = self.given(element, "equality", 0);
        if self.flag(&given, "active") == Some(false) {
            self.ignore_as("equality that is not active", element);
            return;
        }
        let help = "remove it, or write `active=\"false\"`";
        match element.name.as_str() {
            "joint" => self.read_coupling(&given),
            "connect" | "weld" => self.refuse(element, "the equality", "it closes a loop of bodies", help),
            _ => self.refuse(element, "the equality", "it binds the motion", help),
        }
    }

    /// q₁ − ref₁ = a₀ + a₁ (q₂ − ref₂).
    fn read_coupling(&mut self, given: &Given<'s>) {
        let element = given.element;
        const KNOWN: &[&str] = &["active", "class", "joint1", "joint2", "name", "polycoef", "solimp", "solref"];
        let owner = "the equality of joints";
        self.check_attributes(element, owner, KNOWN);
        let mut coefficients = vec![0.0, 1.0];
        if let Some(attribute) = given.attribute("polycoef") {
            if let Some(numbers) = self.numbers(&format!("polycoef of {owner}"), attribute, 1, 5) {
                coefficients[..numbers.len().min(2)].copy_from_slice(&numbers[..numbers.len().min(2)]);
                if numbers.iter().skip(2).any(|x| *x != 0.0) {
                    let help = "write the straight line that is nearest, as in `polycoef=\"0 1 0 0 0\"`";
                    self.refuse_attribute(
                        element,
                        "polycoef",
                        owner,
                        "one coordinate would follow another on a curve",
                        help,
                    );
                }
            }
        }
        let joint = self.joint_named(element, "joint1");
        if given.attribute("joint2").is_none() {
            let help = "remove the joint, which fixes it: the pose of its body says where";
            self.refuse(element, owner, "without `joint2` it holds `joint1` where it is", help);
            return;
        }
        let source = self.joint_named(element, "joint2");
        let (Some((joint, own)), Some((source, other))) = (joint, source) else { return };
        let place = given.attribute("polycoef").map_or_else(|| self.tag(element), |polycoef| self.place(polycoef));
        let [a0, a1] = [coefficients[0], coefficients[1]];
        let offset = own + Dd::from(a0) - Dd::from(a1) * other;
        self.robot.couplings.push(WrittenCoupling {
            joint,
            source,
            ratio: Noted::new(a1, place.clone()),
            offset: Noted::new(offset.to_f64(), place),
        });
    }

    /// The joint that an attribute names, with its coordinate in the pose of the file.
    fn joint_named(&mut self, element: &'s Element, name: &str) -> Option<(Noted<String>, Dd)> {
        let owner = "the equality of joints";
        let Some(attribute) = element.attribute(name) else {
            self.complain_at(element, messages::missing_attribute(owner, name, &format!("{name}=\"...\"")));
            return None;
        };
        let joint = self.robot.joint(&attribute.value);
        let is_single = |kind: straightline_core::joint::JointKind| kind.is_single();
        match joint {
            Some(joint) if joint.kind.value.kind.is_some_and(is_single) => {
                let zero = match &joint.placement {
                    Placement::Anchored(anchored) => match &anchored.reference {
                        Some(Reference::Angle(angle)) => angle_in_radians(angle, ROUNDING),
                        Some(Reference::Length(length)) => Dd::from(length.value),
                        None => Dd::ZERO,
                    },
                    _ => Dd::ZERO,
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
        let given = self.given(element, "tendon", 0);
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
