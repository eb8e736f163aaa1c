//! Bodies: from the world outwards, each with what stands in it.
//!
//! A body is a link. The frames around bodies and sites are links without mass on fixed joints, so that no pose is computed here.

use super::classes::Defaulted;
use super::files::Element;
use super::{vocabulary, Mjcf};
use crate::description::angle::{self, transform};
use crate::description::geometry::compose;
use crate::description::{BaseKind, NamedFrame, Noted, WrittenJoint, WrittenLink, WrittenPose};
use straightline_core::spatial::Transform;
use straightline_core::Dd;

/// What stands in a body.
pub(super) struct Content<'s> {
    /// The element.
    pub element: &'s Element,
    /// The class of what names none.
    pub class: usize,
    /// The frame around it.
    frame: Option<usize>,
}

/// A `<frame>`.
struct FrameAround<'s> {
    element: &'s Element,
    pose: WrittenPose,
    around: Option<usize>,
    /// The link that stands for it, once it is needed.
    link: Option<Noted<String>>,
}

/// What stands in a body, in the order of the file, and the frames around it.
pub(super) struct Contents<'s> {
    all: Vec<Content<'s>>,
    frames: Vec<FrameAround<'s>>,
    /// The link of the body.
    link: Noted<String>,
}

impl<'s> Contents<'s> {
    /// The link of the body.
    pub fn link(&self) -> &Noted<String> {
        &self.link
    }

    /// The elements of a name.
    pub fn of(&self, name: &str) -> Vec<&Content<'s>> {
        self.all.iter().filter(|content| content.element.name == name).collect()
    }

    /// The pose of what stands in an element, in the body.
    pub fn pose_around(&self, content: &Content) -> Transform<Dd> {
        let mut pose = Transform::identity();
        let mut next = content.frame;
        while let Some(frame) = next {
            let frame = &self.frames[frame];
            pose = compose(&transform(&frame.pose, angle::ROUNDING), &pose);
            next = frame.around;
        }
        pose
    }

    /// Whether an element stands in a frame that is not the body's.
    pub fn is_displaced(&self, content: &Content) -> bool {
        let mut next = content.frame;
        while let Some(frame) = next {
            let frame = &self.frames[frame];
            if !frame.pose.is_identity() {
                return true;
            }
            next = frame.around;
        }
        false
    }
}

/// A body that is still to be read.
struct Open<'s> {
    element: &'s Element,
    class: usize,
    /// The link that carries it.
    parent: Noted<String>,
    /// The next name around it that the file gives: made-up names are made of it, so that they do not grow with the depth.
    around: String,
}

impl<'s> Mjcf<'s> {
    /// Reads the bodies of the world.
    pub fn read_world(&mut self) {
        let sections = self.files.sections(0, "worldbody");
        let Some(first) = sections.first() else { return };
        let place = self.tag(first);
        let world = Noted::new(self.names.made_up("world"), place.clone());
        let mut contents = Contents { all: Vec::new(), frames: Vec::new(), link: world.clone() };
        for section in &sections {
            self.add_contents(section, self.classes.outermost[0], &mut contents);
        }
        let moving: Vec<&'s Element> = contents
            .of("body")
            .iter()
            .map(|body| body.element)
            .filter(|body| !self.joints_within(body).is_empty())
            .collect();
        let (objects, moving) = self.objects_and_robots(moving);
        let free = moving.iter().filter(|body| self.free_joint(body).is_some()).count();
        let base = if free == 1 && moving.len() == 1 { moving.first().copied() } else { None };
        let held = base.filter(|base| self.is_held(base));
        self.held = held.and_then(|base| base.attribute("name")).map(|name| name.value.clone());
        let base = base.filter(|_| held.is_none());
        match base {
            Some(base) => {
                let place = self.free_joint(base).map_or_else(|| self.tag(base), |joint| self.tag(joint));
                self.robot.base = Some(Noted::new(BaseKind::Floating, place));
            }
            None => {
                self.robot.base = Some(Noted::new(BaseKind::Fixed, place));
                self.robot.links.push(WrittenLink { name: world, inertial: None, is_carrier: false });
            }
        }
        if base.is_none() {
            self.add_sites(&mut contents);
        } else {
            contents.of("site").iter().for_each(|site| self.ignore_as("site of the world", site.element));
        }
        contents.of("geom").iter().for_each(|geom| self.ignore_as("geom of the world", geom.element));
        self.refuse_others(&contents, "the world", &["joint", "freejoint", "inertial"]);
        let mut open = self.bodies_of_world(&mut contents, base, &objects);
        while let Some(body) = open.pop() {
            let is_base = base.is_some_and(|base| std::ptr::eq(base, body.element));
            let inner = self.read_body(body, is_base, moving.len());
            open.extend(inner);
        }
    }

    /// What moves beside a robot and has nothing to do with its dynamics, and what may be the robot. Objects are bodies that move freely, and beside a robot that
    /// floats and has several joints those that have one.
    fn objects_and_robots(&self, moving: Vec<&'s Element>) -> (Vec<&'s Element>, Vec<&'s Element>) {
        let joints = |body: &'s Element| self.joints_within(body).len();
        let all = moving.iter().copied();
        let (floating, held): (Vec<_>, Vec<_>) = all.partition(|body| self.free_joint(body).is_some());
        let (mut objects, floating): (Vec<_>, Vec<_>) = floating.into_iter().partition(|body| joints(body) == 1);
        let is_robot = floating.len() == 1 && joints(floating[0]) > 2;
        let (small, held): (Vec<_>, Vec<_>) = held.into_iter().partition(|body| is_robot && joints(body) == 1);
        objects.extend(small);
        let robots = [floating, held].concat();
        match robots.is_empty() {
            true => (Vec::new(), moving),
            false => (objects, robots),
        }
    }

    /// The bodies of the world that are read, the first one last: only `base` if there is one, and no objects.
    fn bodies_of_world(
        &mut self,
        contents: &mut Contents<'s>,
        base: Option<&'s Element>,
        objects: &[&'s Element],
    ) -> Vec<Open<'s>> {
        let mut left_out: Vec<(&'s Element, &str)> = Vec::new();
        contents.all.retain(|content| {
            let element = content.element;
            let why = match base {
                _ if element.name != "body" => None,
                _ if objects.iter().any(|object| std::ptr::eq(*object, element)) => {
                    Some("body that moves beside the robot")
                }
                Some(base) if !std::ptr::eq(base, element) => Some("body that does not move"),
                _ => None,
            };
            left_out.extend(why.map(|why| (element, why)));
            why.is_none()
        });
        for (element, why) in left_out {
            if let Some(total) = self.settings[0].total_mass.take() {
                let help = "remove `settotalmass`, or the bodies that are not of the robot";
                let complaint = crate::description::messages::not_supported_yet(
                    "the compiler",
                    "settotalmass",
                    "the mass of bodies would count that are left out",
                    help,
                );
                self.reader.say(&total.place, complaint);
            }
            self.ignore_as(why, element);
        }
        match base {
            Some(_) => self.bodies_at(contents, "world", |_, contents, _| contents.link.clone()),
            None => self.bodies_in(contents, "world"),
        }
    }

    /// The bodies in a body, the first one last.
    fn bodies_in(&mut self, contents: &mut Contents<'s>, around: &str) -> Vec<Open<'s>> {
        self.bodies_at(contents, around, Self::link_of_frame)
    }

    fn bodies_at(
        &mut self,
        contents: &mut Contents<'s>,
        around: &str,
        parent: impl Fn(&mut Self, &mut Contents<'s>, Option<usize>) -> Noted<String>,
    ) -> Vec<Open<'s>> {
        let bodies: Vec<(&'s Element, usize, Option<usize>)> =
            contents.of("body").iter().map(|body| (body.element, body.class, body.frame)).collect();
        let mut open = Vec::new();
        for (element, class, frame) in bodies {
            let parent = parent(self, contents, frame);
            open.push(Open { element, class, parent, around: around.to_string() });
        }
        open.reverse();
        open
    }

    /// Reads a body; the bodies in it.
    fn read_body(&mut self, body: Open<'s>, is_base: bool, moving: usize) -> Vec<Open<'s>> {
        let Open { element, class, parent, around } = body;
        let name = self.name_of(element, &format!("{around}_body"));
        let around = if element.attribute("name").is_some() { name.value.clone() } else { around };
        let owner = format!("body `{}`", name.value);
        self.check_attributes(element, &owner, vocabulary::BODY);
        let given = Defaulted::alone(element);
        let help = "remove it: gravity then acts on the body";
        self.refuse_number(&given, "gravcomp", &owner, "a force would hold the body up", help);
        let is_mocap = self.flag(&given, "mocap") == Some(true);
        if is_mocap {
            self.ignore_as("mocap", element);
        }
        let class = element.attribute("childclass").and_then(|class| self.class(class)).unwrap_or(class);
        let pose = self.pose(&given, &owner);
        let mut contents = Contents { all: Vec::new(), frames: Vec::new(), link: name.clone() };
        self.add_contents(element, class, &mut contents);
        let joints = self.joints_in(&contents, &owner, is_base, moving);
        if is_mocap && !joints.is_empty() {
            let help = "remove it, or the joints of the body";
            self.refuse_attribute(
                element,
                "mocap",
                &owner,
                "such a body is moved from outside, and joints move it",
                help,
            );
        }
        if is_base {
            // the pose of a free body is its coordinate
        } else {
            self.add_joints((&name, element), parent, pose, joints);
        }
        let inertial = self.read_inertia(element, &contents, &owner);
        self.robot.links.push(WrittenLink { name, inertial, is_carrier: false });
        self.add_sites(&mut contents);
        self.refuse_others(&contents, &owner, &[]);
        self.bodies_in(&mut contents, &around)
    }

    /// Refuses or skips what is read nowhere.
    fn refuse_others(&mut self, contents: &Contents<'s>, owner: &str, not_here: &[&str]) {
        for Content { element, .. } in &contents.all {
            match element.name.as_str() {
                name if not_here.contains(&name) => self.refuse(element, owner, "the world does not move", "remove it"),
                "body" | "joint" | "freejoint" | "inertial" | "geom" | "site" => {}
                "camera" | "light" => self.ignore(element),
                "replicate" | "composite" | "flexcomp" => {
                    let help = "load the model with MuJoCo and save it: the saved file has the bodies themselves";
                    self.refuse(element, owner, "bodies would be made of it", help);
                }
                "plugin" => self.refuse(element, owner, "it could act on the body", "remove it"),
                _ => self.skip(element, owner, &["body", "joint", "freejoint", "inertial", "geom", "site", "frame"]),
            }
        }
    }

    /// Adds what stands in an element, that in frames as if they were not there.
    fn add_contents(&mut self, element: &'s Element, class: usize, contents: &mut Contents<'s>) {
        let mut open: Vec<(&'s Element, usize, Option<usize>)> = Vec::new();
        let files = self.files;
        let within = |element, class, frame| files.children(element).into_iter().rev().map(move |e| (e, class, frame));
        open.extend(within(element, class, None));
        while let Some((element, class, frame)) = open.pop() {
            if element.name == "attach" {
                self.check_attributes(element, "an attachment", vocabulary::ATTACH);
                match files.attached(element) {
                    Some(others) => {
                        open.extend(others.into_iter().rev().map(|e| (e, self.classes.outermost[e.scope], frame)));
                    }
                    None => self.complain_of_attached(element),
                }
                continue;
            }
            if element.name != "frame" {
                contents.all.push(Content { element, class, frame });
                continue;
            }
            self.check_attributes(element, "a frame", vocabulary::FRAME);
            let pose = self.pose(&Defaulted::alone(element), "a frame");
            let class = element.attribute("childclass").and_then(|class| self.class(class)).unwrap_or(class);
            contents.frames.push(FrameAround { element, pose, around: frame, link: None });
            open.extend(within(element, class, Some(contents.frames.len() - 1)));
        }
    }

    /// A body that is to be attached, and is not there; other mistakes have been told where the model was to be read.
    fn complain_of_attached(&mut self, element: &'s Element) {
        let (Some(body), Some(known)) = (element.attribute("body"), self.files.attached_bodies(element)) else {
            return;
        };
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        self.complain(body, crate::description::messages::unknown_word("body of <attach>", &body.value, &known));
    }

    /// The link that stands for a frame in a body, which it makes if there is none yet.
    fn link_of_frame(&mut self, contents: &mut Contents<'s>, frame: Option<usize>) -> Noted<String> {
        let mut chain = Vec::new();
        let mut next = frame;
        while let Some(frame) = next {
            chain.push(frame);
            next = contents.frames[frame].around;
        }
        let mut link = contents.link.clone();
        for frame in chain.into_iter().rev() {
            let FrameAround { element, pose, link: own, .. } = &contents.frames[frame];
            if let Some(own) = own {
                link = own.clone();
            } else if !pose.is_identity() {
                let (element, pose) = (*element, pose.clone());
                let is_named = element.attribute("name").is_some();
                let name = self.name_of(element, &format!("{}_frame", contents.link.value));
                self.robot.links.push(WrittenLink { name: name.clone(), inertial: None, is_carrier: !is_named });
                self.add_fixed(&name, link, pose, element);
                contents.frames[frame].link = Some(name.clone());
                link = name;
            }
        }
        link
    }

    /// Adds a fixed joint.
    pub fn add_fixed(
        &mut self,
        child: &Noted<String>,
        parent: Noted<String>,
        origin: WrittenPose,
        element: &'s Element,
    ) {
        let name = Noted::new(self.names.made_up(&format!("{}_fixed", child.value)), child.place.clone());
        self.add_joint(WrittenJoint::fixed(name, parent, child.clone(), origin), element);
    }

    /// Adds the sites of a body as frames.
    fn add_sites(&mut self, contents: &mut Contents<'s>) {
        let sites: Vec<(&'s Element, usize, Option<usize>)> =
            contents.of("site").iter().map(|site| (site.element, site.class, site.frame)).collect();
        for (element, class, frame) in sites {
            let Some(name) = element.attribute("name").filter(|name| !name.value.trim().is_empty()) else {
                self.ignore_as("site without a name", element);
                continue;
            };
            let given = self.given(element, "site", class);
            let owner = format!("site `{}`", name.value);
            if given.attribute("fromto").is_some() {
                self.ignore_as("site with `fromto`", element);
                continue;
            }
            let is_taken = self.links.contains(&name.value);
            let own = if is_taken { self.names.made_up(&format!("{}_site", name.value)) } else { name.value.clone() };
            let name = Noted::new(own, self.place(name));
            let pose = self.pose(&given, &owner);
            let link = self.link_of_frame(contents, frame);
            self.robot.frames.push(NamedFrame { name, link, pose });
        }
    }

    /// The joints of a body and of those in it.
    fn joints_within(&self, body: &'s Element) -> Vec<&'s Element> {
        let mut open = vec![body];
        let mut joints = Vec::new();
        while let Some(element) = open.pop() {
            if ["joint", "freejoint"].contains(&element.name.as_str()) {
                joints.push(element);
            }
            open.extend(self.files.children(element));
            open.extend(self.files.attached(element).into_iter().flatten());
        }
        joints
    }

    /// The free joint of a body.
    fn free_joint(&self, body: &'s Element) -> Option<&'s Element> {
        let mut open = self.files.children(body);
        while let Some(element) = open.pop() {
            let is_free =
                element.name == "joint" && element.attribute("type").is_some_and(|t| t.value.trim() == "free");
            if is_free || element.name == "freejoint" {
                return Some(element);
            }
            if element.name == "frame" {
                open.extend(self.files.children(element));
            }
        }
        None
    }
}
