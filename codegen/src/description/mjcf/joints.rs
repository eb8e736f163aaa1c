//! Joints: several in one body act one after the other, the first one outermost.
//!
//! With the joint k at p_k in the body: T = T_body A_1 … A_n, A_k = Trans(p_k) M_k(q_k − ref_k) Trans(−p_k).

use super::bodies::Contents;
use super::classes::Defaulted;
use super::files::Element;
use super::{vocabulary, Mjcf};
use crate::description::{
    messages, AnchoredJoint, JointDrive, JointLimits, JointType, Noted, Placement, PoseCoordinate, WrittenJoint,
    WrittenLink, WrittenOscillation, WrittenPose,
};
use straightline_core::joint::Dialect;

/// What a free joint may not have: of a damper its six rates have the same.
const OF_FREE: &[&str] = &["stiffness", "frictionloss", "armature", "springdamper"];
/// What a ball joint may not have: of a damper and an armature its three rates have the same.
const OF_BALL: &[&str] = &["stiffness", "frictionloss", "springdamper"];

impl<'s> Mjcf<'s> {
    /// The joints of a body between links, after complaints about others.
    pub fn joints_in(
        &mut self,
        contents: &Contents<'s>,
        owner: &str,
        is_base: bool,
        moving: usize,
    ) -> Vec<Defaulted<'s>> {
        let mut joints = Vec::new();
        let all = contents.of("joint").into_iter().chain(contents.of("freejoint"));
        let written: Vec<(&'s Element, usize, bool)> =
            all.map(|joint| (joint.element, joint.class, contents.is_displaced(joint))).collect();
        let is_alone = written.len() == 1;
        for (element, class, is_displaced) in written {
            if is_displaced {
                let help = "write the joint outside of `<frame>`, with `pos` and `axis` in the body";
                self.refuse(element, owner, "its position and axis would be those in a frame", help);
            }
            let given = match element.name.as_str() {
                "freejoint" => Defaulted::alone(element),
                _ => self.given(element, "joint", class),
            };
            let is_free =
                element.name == "freejoint" || given.attribute("type").is_some_and(|t| t.value.trim() == "free");
            if !is_free {
                joints.push(given);
                continue;
            }
            if self.held.as_ref() == Some(&contents.link().value) && is_alone {
                self.ignore_as("free joint of a body that is welded to the world", element);
                continue;
            }
            let damping = self.read_free(&given, owner);
            if is_base {
                self.robot.base_damping = damping;
            }
            if !is_base || !is_alone {
                let why = match (is_base, moving) {
                    (true, _) => "the body has further joints".to_string(),
                    (_, 2..) => format!("{moving} bodies of the world move: a robot has one root that can be free"),
                    _ => "only a body of the world can move freely".to_string(),
                };
                let help = "leave the other bodies out that move, or remove the joint: the body is then fixed";
                self.refuse(element, owner, &why, help);
            }
        }
        joints
    }

    /// What a free joint says beside that: its damping.
    fn read_free(&mut self, given: &Defaulted<'s>, owner: &str) -> Option<Noted<f64>> {
        let owner = format!("the free joint of {owner}");
        for name in OF_FREE {
            let help = "remove it, or write `<freejoint/>`, which takes no defaults";
            self.refuse_number(given, name, &owner, "it would act on a body that moves freely", help);
        }
        if let Some("true") = self.word(given, "align", &["true", "false", "auto"]) {
            let help = "remove it: coordinates are then those of the body frame as it is written";
            self.refuse_attribute(given.element, "align", &owner, "the frame of the body would be another one", help);
        }
        self.first_number(given, "damping", &owner)
    }

    /// Adds the joints of a body, with a link without mass between each and the next.
    pub fn add_joints(
        &mut self,
        (body, element): (&Noted<String>, &'s Element),
        parent: Noted<String>,
        pose: WrittenPose,
        joints: Vec<Defaulted<'s>>,
    ) {
        if joints.is_empty() {
            self.add_fixed(body, parent, pose, element);
            return;
        }
        let (mut parent, mut origin) = (parent, pose);
        let last = joints.len() - 1;
        for (k, given) in joints.into_iter().enumerate() {
            let name = self.name_of(given.element, &format!("{}_joint", body.value));
            let child = if k == last {
                body.clone()
            } else {
                let link = Noted::new(self.names.made_up(&format!("{}_carrier", name.value)), name.place.clone());
                self.robot.links.push(WrittenLink { name: link.clone(), inertial: None, is_carrier: true });
                link
            };
            let next = WrittenPose::identity(name.place.clone());
            match self.read_joint(&given, name, parent.clone(), child.clone(), origin.clone()) {
                Some(joint) => self.add_joint(joint, given.element),
                None => {
                    self.robot.has_holes = true;
                    self.add_fixed(&child, parent, origin, given.element);
                }
            }
            (parent, origin) = (child, next);
        }
    }

    /// A joint that is not free.
    fn read_joint(
        &mut self,
        given: &Defaulted<'s>,
        name: Noted<String>,
        parent: Noted<String>,
        child: Noted<String>,
        origin: WrittenPose,
    ) -> Option<WrittenJoint> {
        let owner = format!("joint `{}`", name.value);
        self.check_attributes(given.element, &owner, vocabulary::JOINT);
        let kind = self.kind(given, &owner)?;
        let anchor = self.vector(given, "pos", &owner, [0.0; 3]);
        let is_single = kind.kind.is_some_and(|kind| kind.is_single());
        if !is_single {
            for name in OF_BALL {
                let help = "remove it, or write three hinges in its place";
                self.refuse_number(given, name, &owner, "it would act on a joint with several coordinates", help);
            }
            if self.is_limited(given, "limited", "range") {
                self.ignore_as("range of a ball joint", given.element);
            }
            let axis = Noted::new([0.0, 0.0, 1.0], name.place.clone());
            let placement = Placement::Anchored(AnchoredJoint { origin, anchor, axis, reference: None });
            let drive = JointDrive {
                damping: self.first_number(given, "damping", &owner),
                armature: self.number(given, "armature", &owner),
                ..JointDrive::default()
            };
            let limits = JointLimits::default();
            let kind = Noted::new(kind, name.place.clone());
            return Some(WrittenJoint { name, kind, parent, child, placement, limits, drive });
        }
        let turns = kind.kind.is_some_and(|kind| kind.turns());
        let axis = self.vector(given, "axis", &owner, [0.0, 0.0, 1.0]);
        let reference = self.number(given, "ref", &owner).filter(|x| x.value != 0.0).map(|x| match turns {
            true => PoseCoordinate::Angle(self.angle(x.value, given.attribute("ref").expect("it was read"))),
            false => PoseCoordinate::Length(x),
        });
        let (has_range, limits) = self.limits(given, &owner, turns);
        let drive = self.drive(given, &owner, turns);
        let place = given.attribute("type").map_or_else(|| name.place.clone(), |t| self.place(t));
        let kind = Noted::new(JointType { has_range, ..kind }, place);
        let placement = Placement::Anchored(AnchoredJoint { origin, anchor, axis, reference });
        Some(WrittenJoint { name, kind, parent, child, placement, limits, drive })
    }

    /// How a joint moves: the table of joints has the words.
    fn kind(&mut self, given: &Defaulted<'s>, owner: &str) -> Option<JointType> {
        let known: Vec<(&'static str, JointType)> = JointType::words(Dialect::Mjcf);
        let word = match given.attribute("type") {
            None => "hinge",
            Some(_) => self.word(given, "type", &["hinge", "slide", "ball", "free"])?,
        };
        let kind = known.into_iter().find(|(text, kind)| *text == word && !kind.is_free()).map(|(_, kind)| kind);
        if kind.is_none() {
            let help = "write three hinges in one body, or remove it: the body is then fixed";
            let complaint = messages::not_supported_yet(owner, word, "a joint has one coordinate", help);
            match given.attribute("type") {
                Some(attribute) => self.complain(attribute, complaint),
                None => self.complain_at(given.element, complaint),
            }
        }
        kind
    }

    /// Whether the coordinate has a range, and the ranges.
    fn limits(&mut self, given: &Defaulted<'s>, owner: &str, turns: bool) -> (bool, JointLimits) {
        let mut limits = JointLimits::default();
        let has_range = self.is_limited(given, "limited", "range");
        if let (true, Some(attribute)) = (has_range, given.attribute("range")) {
            if let Some([lower, upper]) = self.some_numbers::<2>(given, "range", owner) {
                let place = self.place(attribute);
                let limit = |x: f64| Noted::new(if turns { self.radians(x, attribute) } else { x }, place.clone());
                (limits.lower, limits.upper) = (Some(limit(lower)), Some(limit(upper)));
            }
        }
        if self.is_limited(given, "actuatorfrclimited", "actuatorfrcrange") {
            if let (Some([lower, upper]), Some(attribute)) =
                (self.some_numbers::<2>(given, "actuatorfrcrange", owner), given.attribute("actuatorfrcrange"))
            {
                limits.effort = Some(Noted::new(lower.abs().max(upper.abs()), self.place(attribute)));
            }
        }
        (has_range, limits)
    }

    /// Whether a range holds: because it is said so, or by itself.
    pub fn is_limited(&mut self, given: &Defaulted<'s>, word: &str, range: &str) -> bool {
        match self.word(given, word, &["true", "false", "auto"]) {
            Some("true") => true,
            Some("false") => false,
            _ => self.settings[given.element.scope].autolimits && given.attribute(range).is_some(),
        }
    }

    fn drive(&mut self, given: &Defaulted<'s>, owner: &str, turns: bool) -> JointDrive {
        let help = "remove it: springs are linear";
        self.refuse_number(given, "springyield", owner, "the spring would yield", help);
        let oscillation = self.oscillation(given, owner);
        // both are made of an oscillation, where one is given
        let [stiffness, damping] = match &oscillation {
            Some(_) => [None, None],
            None => ["stiffness", "damping"].map(|name| self.first_number(given, name, owner)),
        };
        let is_sprung = oscillation.is_some() || stiffness.as_ref().is_some_and(|k| k.value != 0.0);
        let rest = self.number(given, "springref", owner).filter(|_| is_sprung);
        JointDrive {
            damping,
            friction: self.number(given, "frictionloss", owner),
            armature: self.number(given, "armature", owner),
            spring_rest: rest.zip(given.attribute("springref")).map(|(rest, attribute)| {
                Noted::new(if turns { self.radians(rest.value, attribute) } else { rest.value }, rest.place)
            }),
            spring_stiffness: stiffness,
            oscillation,
            ..JointDrive::default()
        }
    }

    /// What a joint's spring and damper are to be made of: zeros say nothing, and MuJoCo takes no other pair than a positive one.
    fn oscillation(&mut self, given: &Defaulted<'s>, owner: &str) -> Option<WrittenOscillation> {
        let [time_constant, damping_ratio] = self.some_numbers(given, "springdamper", owner)?;
        let attribute = given.attribute("springdamper")?;
        if [time_constant, damping_ratio] == [0.0; 2] {
            return None;
        }
        if time_constant <= 0.0 || damping_ratio <= 0.0 {
            self.complain(attribute, messages::no_oscillation(owner, [time_constant, damping_ratio]));
            return None;
        }
        Some(WrittenOscillation { time_constant, damping_ratio, place: self.place(attribute) })
    }

    /// The first of several numbers, where those after it are zero.
    fn first_number(&mut self, given: &Defaulted<'s>, name: &str, owner: &str) -> Option<Noted<f64>> {
        let attribute = given.attribute(name)?;
        let numbers = self.numbers(&format!("{name} of {owner}"), attribute, 1, 8)?;
        if numbers[1..].iter().any(|x| *x != 0.0) {
            let help = "write its first number alone";
            self.refuse_number(given, name, owner, "the force would not be linear", help);
        }
        Some(Noted::new(numbers[0], self.place(attribute)))
    }
}
