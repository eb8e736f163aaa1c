//! Frames: links, joints, models and those that are only that, with the scopes in which names mean them, and what carries each.

use super::poses::PoseStep;
use super::{Sdf, DEEPEST};
use crate::description::xml::{children, tag, Span};
use crate::description::{messages, NamedFrame, Noted};
use roxmltree::Node;
use std::collections::BTreeMap;

/// The frame of the world.
pub(super) const WORLD: usize = 0;

/// What a frame belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameKind {
    World,
    Model,
    Link,
    Joint,
    Plain,
}

impl FrameKind {
    fn of(element: &str) -> Option<FrameKind> {
        match element {
            "model" => Some(FrameKind::Model),
            "link" => Some(FrameKind::Link),
            "joint" => Some(FrameKind::Joint),
            "frame" => Some(FrameKind::Plain),
            _ => None,
        }
    }
}

/// A frame that poses can be given in.
pub(super) struct SdfFrame<'d, 'i> {
    pub kind: FrameKind,
    pub element: Node<'d, 'i>,
    /// Its name in its scope; once all are known, in the robot.
    pub name: Noted<String>,
    /// The scope that its name stands in.
    pub scope: usize,
    /// The scope that it opens.
    pub inner: Option<usize>,
    /// It, or a model around it, does not move.
    pub is_static: bool,
    /// The frame that its steps begin in.
    pub parent: usize,
    /// From there to it.
    pub steps: Vec<PoseStep>,
    /// How many frames stand between it and the world.
    pub depth: usize,
    /// The link that carries it, or the world.
    pub body: usize,
}

impl SdfFrame<'_, '_> {
    pub fn is_model(&self) -> bool {
        self.kind == FrameKind::Model
    }
}

/// Names that mean frames.
pub(super) struct SdfScope {
    /// The frame of its model or of the world.
    pub frame: usize,
    pub names: BTreeMap<String, usize>,
    /// The frames in it, in the order of the file.
    pub frames: Vec<usize>,
}

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// Finds all frames of the world.
    pub fn collect_frames(&mut self, around: Node<'d, 'i>) -> Option<()> {
        let name = self.reader.value("world".to_string(), &tag(around));
        self.add_scope(around, FrameKind::World, name, 0, false);
        let mut open = vec![(around, 0, 0)];
        while let Some((element, scope, depth)) = open.pop() {
            if depth > DEEPEST {
                self.complain(&tag(element), messages::too_complex("models in each other", DEEPEST));
                return None;
            }
            let (is_world, is_static) = (depth == 0, self.frames[self.scopes[scope].frame].is_static);
            let owner = self.owner_of(self.scopes[scope].frame);
            for child in children(element) {
                let name = child.tag_name().name();
                let kind = FrameKind::of(name).filter(|kind| !is_world || *kind != FrameKind::Link);
                match kind {
                    Some(FrameKind::Model) => {
                        let Some(name) = self.name_in(child, name) else { continue };
                        let is_static = is_static || self.is_static(child);
                        if let Some(inner) = self.add_scope(child, FrameKind::Model, name, scope, is_static) {
                            open.push((child, inner, depth + 1));
                        }
                    }
                    Some(kind) => {
                        let Some(name) = self.name_in(child, name) else { continue };
                        self.add_frame(child, kind, name, scope, is_static);
                    }
                    None => self.read_beside(child, &owner, is_world),
                }
            }
        }
        Some(())
    }

    /// What stands in a world or model and is no frame.
    fn read_beside(&mut self, element: Node<'d, 'i>, owner: &str, is_world: bool) {
        let help = "write the model itself in its place; `gz sdf -p FILE` prints a file with all that it includes";
        match element.tag_name().name() {
            "include" => {
                let uri = children(element).find(|child| child.tag_name().name() == "uri");
                let uri = uri.map_or("", |uri| self.text(uri).0);
                let why = format!("models are not looked for elsewhere: `{}`", crate::diagnostic::wording::cut(uri));
                self.refuse(element, owner, &why, help);
            }
            "population" => self.refuse(element, owner, "models would be made of it", help),
            "gravity" if is_world => {}
            "pose" | "static" if !is_world => {}
            _ => self.skip(owner, element, &["model", "link", "joint", "frame", "pose", "static", "include"]),
        }
    }

    /// The name of an element, or a complaint.
    fn name_in(&mut self, element: Node<'d, 'i>, what: &str) -> Option<Noted<String>> {
        let name = match element.attribute_node("name") {
            Some(name) => self.reader.name(what, name.value(), &name.range_value()),
            None => {
                let example = format!("<{what} name=\"...\">");
                self.complain(&tag(element), messages::missing_attribute(&format!("a {what}"), "name", &example));
                None
            }
        };
        self.robot.has_holes |= name.is_none();
        name
    }

    fn is_static(&mut self, model: Node<'d, 'i>) -> bool {
        let element = children(model).find(|child| child.tag_name().name() == "static");
        element.is_some_and(|element| self.is_set(element, "a model"))
    }

    /// Adds a model or the world with its scope, if its name is free.
    fn add_scope(
        &mut self,
        element: Node<'d, 'i>,
        kind: FrameKind,
        name: Noted<String>,
        scope: usize,
        is_static: bool,
    ) -> Option<usize> {
        let inner = self.scopes.len();
        let frame = self.add_frame(element, kind, name, scope, is_static)?;
        self.frames[frame].inner = Some(inner);
        self.scopes.push(SdfScope { frame, names: BTreeMap::new(), frames: Vec::new() });
        Some(inner)
    }

    /// Adds a frame, if its name is free.
    fn add_frame(
        &mut self,
        element: Node<'d, 'i>,
        kind: FrameKind,
        name: Noted<String>,
        scope: usize,
        is_static: bool,
    ) -> Option<usize> {
        let index = self.frames.len();
        let taken = self.scopes.get(scope).and_then(|scope| scope.names.get(&name.value)).copied();
        let is_joint = |frame: usize| self.frames[frame].kind == FrameKind::Joint;
        // up to 1.6 a joint could have the name of something else, and was no frame
        let is_old = self.version < 7 && taken.is_some_and(|taken| is_joint(taken) != (kind == FrameKind::Joint));
        if let Some(first) = taken.filter(|_| !is_old) {
            let complaint = messages::duplicate_name("frame", &name.value);
            let complaint = complaint.related(&self.frames[first].name.place, "the first one");
            self.complain(&name.place.span.clone(), complaint);
            self.robot.has_holes = true;
            return None;
        }
        if kind != FrameKind::World {
            self.scopes[scope].frames.push(index);
            if taken.is_none() || kind != FrameKind::Joint {
                self.scopes[scope].names.insert(name.value.clone(), index);
            }
        }
        let (inner, parent, steps, depth, body) = (None, WORLD, Vec::new(), 0, WORLD);
        self.frames.push(SdfFrame { kind, element, name, scope, inner, is_static, parent, steps, depth, body });
        Some(index)
    }

    /// How complaints call a frame.
    pub fn owner_of(&self, frame: usize) -> String {
        let name = &self.frames[frame].name.value;
        match self.frames[frame].kind {
            FrameKind::World => "the world".to_string(),
            FrameKind::Plain => format!("frame `{name}`"),
            FrameKind::Model => format!("model `{name}`"),
            FrameKind::Link => format!("link `{name}`"),
            FrameKind::Joint => format!("joint `{name}`"),
        }
    }

    /// Gives frames their names in the robot: those of the models around them, but for the robot itself, before their own.
    pub fn name_frames(&mut self) {
        // a scope stands behind the one around it
        for scope in 0..self.scopes.len() {
            let around = self.scopes[scope].frame;
            let before = match around == WORLD || around == self.model {
                true => String::new(),
                false => format!("{}::", self.frames[around].name.value),
            };
            for frame in self.scopes[scope].frames.clone() {
                let own = &mut self.frames[frame].name.value;
                own.insert_str(0, &before);
                self.names.take([own.clone()]);
            }
        }
    }

    /// The frame that a name means in a scope: `a::b` is b in the model a, and `__model__` the frame of the model itself.
    pub fn resolve(&self, mut scope: usize, mut name: &str) -> Option<usize> {
        loop {
            let SdfScope { frame, names, .. } = &self.scopes[scope];
            match name {
                "__model__" if *frame != WORLD => return Some(*frame),
                "world" if *frame == WORLD => return Some(WORLD),
                _ => {}
            }
            if let Some(found) = names.get(name) {
                return Some(*found);
            }
            let (first, rest) = name.split_once("::")?;
            scope = self.frames[*names.get(first)?].inner?;
            name = rest;
        }
    }

    /// The frame that a name means, or a complaint.
    pub fn frame_named(&mut self, scope: usize, (name, span): (&str, Span), owner: &str) -> Option<usize> {
        let found = self.resolve(scope, name);
        if found.is_none() {
            let known: Vec<String> = self.scopes[scope].names.keys().cloned().collect();
            let model = self.owner_of(self.scopes[scope].frame);
            let complaint = messages::frame_unknown(owner, name, &model, known.iter().map(String::as_str));
            self.complain(&span, complaint);
        }
        found
    }

    /// Finds the link that carries each frame, or the world.
    pub fn attach_frames(&mut self) {
        let mut next: Vec<usize> = (0..self.frames.len()).map(|frame| self.attached_to(frame)).collect();
        let mut is_known = vec![false; next.len()];
        for start in 0..next.len() {
            let mut path = Vec::new();
            let mut at = start;
            while !is_known[at] && !self.is_carrying(at) {
                is_known[at] = true;
                path.push(at);
                at = next[at];
            }
            if path.contains(&at) {
                let frame = &self.frames[at];
                let complaint = messages::frame_cycle(&frame.name.value, "is attached to itself, by way of others");
                let place = frame.name.place.span.clone();
                self.complain(&place, complaint);
                next[at] = WORLD;
                at = WORLD;
            }
            let body = if is_known[at] { self.frames[at].body } else { at };
            is_known[at] = true;
            self.frames[at].body = body;
            path.into_iter().for_each(|frame| self.frames[frame].body = body);
        }
    }

    /// Whether a frame is a link or the world, which are attached to nothing.
    fn is_carrying(&self, frame: usize) -> bool {
        let SdfFrame { kind, is_static, .. } = self.frames[frame];
        frame == WORLD || (kind == FrameKind::Link && !is_static)
    }

    /// What a frame is attached to; itself if it is a link or the world.
    fn attached_to(&mut self, frame: usize) -> usize {
        let SdfFrame { kind, element, scope, inner, is_static, .. } = self.frames[frame];
        let owner = self.owner_of(frame);
        let around = self.scopes[scope].frame;
        if is_static || kind == FrameKind::World {
            return WORLD;
        }
        match kind {
            FrameKind::Link => frame,
            FrameKind::Joint => self.end_of(frame, "child").unwrap_or(WORLD),
            FrameKind::Model => match (self.attribute(element, "canonical_link"), inner) {
                (Some(name), Some(inner)) => self.frame_named(inner, name, &owner).unwrap_or(WORLD),
                (_, Some(inner)) => {
                    let own = || self.scopes[inner].frames.iter().copied();
                    let link = own().find(|frame| self.frames[*frame].kind == FrameKind::Link);
                    link.or_else(|| own().find(|frame| self.frames[*frame].is_model())).unwrap_or(WORLD)
                }
                _ => WORLD,
            },
            _ => match self.attribute(element, "attached_to") {
                Some(name) => self.frame_named(scope, name, &owner).unwrap_or(WORLD),
                None => around,
            },
        }
    }

    /// Adds the frames that are only that.
    pub fn add_frames(&mut self, has_world: bool) {
        let mut plain: Vec<usize> =
            (0..self.frames.len()).filter(|frame| self.frames[*frame].kind == FrameKind::Plain).collect();
        plain.sort_by_key(|frame| self.frames[*frame].element.range().start);
        for frame in plain {
            let SdfFrame { element, body, .. } = self.frames[frame];
            if body == WORLD && !has_world {
                self.reader.ignore("frame of the world", &tag(element));
                continue;
            }
            let name = self.frames[frame].name.clone();
            let pieces = self.pieces(body, frame);
            let link = self.frames[body].name.clone();
            let (link, pose) = self.add_chain(link, pieces, &name);
            self.robot.frames.push(NamedFrame { name, link, pose });
        }
    }
}
