//! Welds: two bodies that keep the pose against each other, and a base that is held where it stands.

use super::classes::Defaulted;
use super::files::{Attribute, Element};
use super::{vocabulary, Mjcf};
use crate::description::{
    messages, ClosingJoint, LoopPoints, NamedFrame, Noted, Rotation, WrittenLoop, WrittenPose, WrittenTurn,
};

impl<'s> Mjcf<'s> {
    /// The body that a weld holds where it stands: one that it welds to the world, without saying where.
    pub fn held_by(&mut self, weld: &'s Element) -> Option<&'s str> {
        let given = self.given_outermost(weld, "equality");
        let relative = given.attribute("relpose").map_or("", |own| own.value.trim());
        let says_where = relative.split_whitespace().skip(3).any(|x| x.parse() != Ok(0.0));
        let is_active = given.attribute("active").is_none_or(|own| own.value.trim() != "false");
        if weld.name != "weld" || !is_active || says_where || weld.attribute("site1").is_some() {
            return None;
        }
        let bodies = ["body1", "body2"].map(|name| weld.attribute(name).map(|own| own.value.as_str()));
        match bodies {
            [Some("world"), Some(body)] | [Some(body), None | Some("world")] => Some(body),
            _ => None,
        }
    }

    /// Whether a weld holds a body that would move freely.
    pub fn is_held(&mut self, body: &Element) -> bool {
        let Some(name) = body.attribute("name") else { return false };
        self.within("equality").into_iter().any(|weld| self.held_by(weld) == Some(&name.value))
    }

    /// A weld; `None` where it holds the base, which then does not move, or after a complaint.
    pub fn read_weld(&mut self, given: &Defaulted<'s>) -> Option<WrittenLoop> {
        let (element, owner) = (given.element, "the weld");
        self.check_attributes(element, owner, vocabulary::WELD);
        if self.held_by(element).is_some_and(|body| self.held.as_deref() == Some(body)) {
            self.ignore_as("weld of a base, which is fixed by it", element);
            return None;
        }
        let name = self.name_of(element, "weld");
        let points = self.points_of_weld(given, &name, owner)?;
        Some(WrittenLoop { name, points, determines: Vec::new(), assembly: None, joint: ClosingJoint::Fixed })
    }

    /// Two sites; a frame of the second body and what is there of the first one in the pose of the file, or where `relpose` says.
    fn points_of_weld(&mut self, given: &Defaulted<'s>, name: &Noted<String>, owner: &str) -> Option<LoopPoints> {
        let element = given.element;
        let named = |own: &Self, attribute: &Attribute| Noted::new(attribute.value.clone(), own.place(attribute));
        if let (Some(one), Some(other)) = (element.attribute("site1"), element.attribute("site2")) {
            return Some(LoopPoints::Frames([named(self, one), named(self, other)]));
        }
        if element.attribute("body1").is_none() {
            self.complain_at(element, messages::missing_attribute(owner, "body1", "body1=\"...\""));
            return None;
        }
        let bodies = ["body1", "body2"].map(|name| element.attribute(name).filter(|body| body.value != "world"));
        let [one, other] = bodies.map(|body| body.map(|body| named(self, body)));
        let anchor = self.vector(given, "anchor", owner, [0.0; 3]);
        let relative = self.some_numbers::<7>(given, "relpose", owner);
        let Some([x, y, z, turn @ ..]) = relative.filter(|numbers| numbers[3..].iter().any(|x| *x != 0.0)) else {
            return Some(LoopPoints::Anchor { links: [other, one], point: anchor });
        };
        let place = given.attribute("relpose").map_or_else(|| self.tag(element), |relpose| self.place(relpose));
        let turns = vec![WrittenTurn::Quaternion(Noted::new(turn, place.clone()))];
        let of_first = WrittenPose { xyz: Noted::new([x, y, z], place.clone()), rotation: Rotation::Turns(turns) };
        let of_second = WrittenPose { xyz: anchor, rotation: Rotation::Turns(Vec::new()) };
        let world = self.robot.ground().map(|world| world.name.clone());
        let (Some(one), Some(other)) = (one.or_else(|| world.clone()), other.or(world)) else {
            let help = "leave it out: the body is then held where it stands";
            self.refuse_attribute(
                element,
                "relpose",
                owner,
                "the world is no part of a robot whose base is free",
                help,
            );
            return None;
        };
        let frames = [(one, of_first), (other, of_second)].map(|(link, pose)| {
            let name = Noted::new(self.names.made_up(&format!("{}_end", name.value)), place.clone());
            self.robot.frames.push(NamedFrame { name: name.clone(), link, pose });
            name
        });
        Some(LoopPoints::Frames(frames))
    }
}
