//! Poses as they are written, and the steps that lead from one frame to another: up the tree of poses against them, and down with them.

use super::frames::{FrameKind, SdfFrame, WORLD};
use super::Sdf;
use crate::description::xml::{children, tag};
use crate::description::{messages, Angle, AngleUnit, Noted, Rotation, WrittenPose, WrittenTurn};
use roxmltree::Node;

/// Steps between frames of one file: what is more was not written by hand.
const MOST_STEPS: usize = 100_000;

/// From one frame to the next.
#[derive(Clone, Debug)]
pub(super) struct PoseStep {
    pub pose: WrittenPose,
    /// Against the pose, from the frame that it places to the one that it is given in.
    pub is_back: bool,
}

impl PoseStep {
    fn reversed(&self) -> PoseStep {
        PoseStep { pose: self.pose.clone(), is_back: !self.is_back }
    }

    /// As poses one after the other: T⁻¹ = Rot(R⁻¹) Trans(−p). Those that move nothing are left out.
    pub fn poses(&self) -> Vec<WrittenPose> {
        let WrittenPose { xyz, rotation } = &self.pose;
        let place = xyz.place.clone();
        let poses = match self.is_back {
            false => vec![self.pose.clone()],
            true => vec![
                WrittenPose { rotation: reversed(rotation), ..WrittenPose::identity(place.clone()) },
                WrittenPose {
                    xyz: Noted::new(xyz.value.map(|x| 0.0 - x), place.clone()),
                    ..WrittenPose::identity(place)
                },
            ],
        };
        poses.into_iter().filter(|pose| !pose.is_identity()).collect()
    }

    /// The turn of it.
    pub fn turn(&self) -> WrittenPose {
        let WrittenPose { xyz, rotation } = &self.pose;
        let rotation = if self.is_back { reversed(rotation) } else { rotation.clone() };
        WrittenPose { rotation, ..WrittenPose::identity(xyz.place.clone()) }
    }
}

/// The turns of a rotation, one after the other: R = Rz(yaw) Ry(pitch) Rx(roll).
pub(super) fn turns(rotation: &Rotation) -> Vec<WrittenTurn> {
    match rotation {
        Rotation::Turns(turns) => turns.clone(),
        Rotation::RollPitchYaw(angles) => {
            let about = |k: usize| {
                let axis = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
                WrittenTurn::About { axis: Noted::new(axis, angles[k].place.clone()), angle: angles[k].clone() }
            };
            [2, 1, 0].into_iter().filter(|k| angles[*k].value != 0.0).map(about).collect()
        }
    }
}

/// R⁻¹.
fn reversed(rotation: &Rotation) -> Rotation {
    let back = |turn: WrittenTurn| match turn {
        WrittenTurn::About { axis, angle } => {
            WrittenTurn::About { axis, angle: Angle { value: 0.0 - angle.value, ..angle } }
        }
        WrittenTurn::Quaternion(q) => {
            let [w, x, y, z] = q.value;
            WrittenTurn::Quaternion(Noted::new([w, 0.0 - x, 0.0 - y, 0.0 - z], q.place))
        }
        other => other,
    };
    Rotation::Turns(turns(rotation).into_iter().rev().map(back).collect())
}

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// The pose in an element; frames coincide where it has none.
    pub fn pose_in(&mut self, element: Node<'d, 'i>, owner: &str) -> (Option<Node<'d, 'i>>, WrittenPose) {
        let mut found = None;
        for pose in children(element).filter(|child| child.tag_name().name() == "pose") {
            match found {
                None => found = Some(pose),
                Some(_) => self.complain(&tag(pose), messages::repeated_element(owner, "pose")),
            }
        }
        let pose = match found {
            Some(pose) => self.pose(pose, &format!("pose of {owner}")),
            None => WrittenPose::identity(self.reader.place(&tag(element))),
        };
        (found, pose)
    }

    /// Three lengths, and three angles or a quaternion.
    fn pose(&mut self, element: Node<'d, 'i>, owner: &str) -> WrittenPose {
        self.check_attributes(owner, element, &["relative_to", "frame", "degrees", "rotation_format"]);
        let (text, span) = self.text(element);
        let mut pose = WrittenPose::identity(self.reader.place(&span));
        let in_degrees = match self.attribute(element, "degrees") {
            Some((word, span)) => self.flag(&format!("degrees of {owner}"), word, &span),
            None => false,
        };
        let format = match self.attribute(element, "rotation_format") {
            Some((word, span)) => {
                let word = self.reader.value(word.to_string(), &span);
                let known = [("euler_rpy", false), ("quat_xyzw", true)];
                self.reader.word(&format!("rotation_format of {owner}"), &word, &known).unwrap_or(false)
            }
            None => false,
        };
        if text.is_empty() {
            return pose;
        }
        let counts = if format { (7..=7, "seven numbers") } else { (6..=6, "six numbers") };
        let Some(numbers) = self.numbers(element, owner, counts) else { return pose };
        pose.xyz.value = [0, 1, 2].map(|i| numbers[i].0);
        if format {
            let [x, y, z, w] = [3, 4, 5, 6].map(|i| numbers[i].0);
            if [x, y, z, w].iter().all(|x| x.abs() < 1e-100) {
                self.complain(&numbers[3].2, messages::zero_axis(&format!("the quaternion of {owner}")));
                return pose;
            }
            let q = self.reader.value([w, x, y, z], &numbers[3].2);
            pose.rotation = Rotation::Turns(vec![WrittenTurn::Quaternion(q)]);
        } else {
            let unit = if in_degrees { AngleUnit::Degree } else { AngleUnit::Radian };
            pose.rotation = Rotation::RollPitchYaw([3, 4, 5].map(|i| {
                let (value, text, span) = &numbers[i];
                Angle { value: *value, unit, text: text.to_string(), place: self.reader.place(span) }
            }));
        }
        pose
    }

    /// Reads where every frame stands, in which other one.
    pub fn place_frames(&mut self) {
        for frame in 1..self.frames.len() {
            let SdfFrame { element, scope, .. } = self.frames[frame];
            let owner = self.owner_of(frame);
            let (element, pose) = self.pose_in(element, &owner);
            let named = element.and_then(|element| self.relative_to(element, &owner));
            let parent = match named {
                Some(name) => self.frame_named(scope, name, &format!("pose of {owner}")),
                None => self.default_frame(frame),
            };
            self.frames[frame].parent = parent.unwrap_or(WORLD);
            self.frames[frame].steps = vec![PoseStep { pose, is_back: false }];
        }
        self.break_cycles();
        // the models in a model stand behind it
        for frame in (1..self.frames.len()).rev() {
            self.place_by_frame(frame);
        }
        for frame in 1..self.frames.len() {
            let mut path = Vec::new();
            let mut at = frame;
            while at != WORLD && self.frames[at].depth == 0 {
                path.push(at);
                at = self.frames[at].parent;
            }
            let mut depth = self.frames[at].depth;
            for frame in path.into_iter().rev() {
                depth += 1;
                self.frames[frame].depth = depth;
            }
        }
    }

    /// The frame that a pose says it is given in.
    fn relative_to(&mut self, pose: Node<'d, 'i>, owner: &str) -> Option<(&'d str, crate::description::xml::Span)> {
        let old = self.attribute(pose, "frame");
        match (self.attribute(pose, "relative_to"), old) {
            (Some(name), _) => Some(name),
            // the name that it had up to 1.6
            (None, Some(name)) if self.version < 7 => Some(name),
            (None, Some((_, span))) => {
                let why = "since SDF 1.7 nothing is read of it, and the pose would be given in another frame";
                let help = "write `relative_to` in its place";
                self.complain(&span, messages::not_supported_yet(&format!("pose of {owner}"), "frame", why, help));
                None
            }
            (None, None) => None,
        }
    }

    /// The frame that a pose is given in where it does not say.
    fn default_frame(&mut self, frame: usize) -> Option<usize> {
        let SdfFrame { kind, element, scope, .. } = self.frames[frame];
        let around = self.scopes[scope].frame;
        match kind {
            FrameKind::Joint => self.end_of(frame, "child"),
            FrameKind::Plain => match self.attribute(element, "attached_to") {
                Some(name) => self.frame_named(scope, name, &self.owner_of(frame)),
                None => Some(around),
            },
            _ => Some(around),
        }
    }

    /// Complains of frames that are placed in each other.
    fn break_cycles(&mut self) {
        let mut is_known = vec![false; self.frames.len()];
        is_known[WORLD] = true;
        for start in 1..self.frames.len() {
            let mut path = Vec::new();
            let mut at = start;
            while !is_known[at] {
                is_known[at] = true;
                path.push(at);
                at = self.frames[at].parent;
            }
            if path.contains(&at) {
                let name = &self.frames[at].name;
                let complaint = messages::frame_cycle(&name.value, "is placed in itself, by way of others");
                let span = name.place.span.clone();
                self.complain(&span, complaint);
                self.frames[at].parent = WORLD;
            }
        }
    }

    /// Where a model says the pose of one of its frames instead of its own: T_model = T_frame T_model,frame⁻¹.
    fn place_by_frame(&mut self, model: usize) {
        let SdfFrame { element, inner: Some(inner), .. } = self.frames[model] else { return };
        let Some(name) = self.attribute(element, "placement_frame") else { return };
        let owner = format!("placement_frame of {}", self.owner_of(model));
        let Some(frame) = self.frame_named(inner, name, &owner) else { return };
        let mut back = Vec::new();
        let mut at = frame;
        while at != model && at != WORLD {
            back.extend(self.frames[at].steps.iter().rev().map(PoseStep::reversed));
            at = self.frames[at].parent;
        }
        self.frames[model].steps.extend(back);
    }

    /// The steps from one frame to another.
    pub fn path(&mut self, from: usize, to: usize) -> Vec<PoseStep> {
        let (mut up, mut down) = (Vec::new(), Vec::new());
        let (mut a, mut b) = (from, to);
        while a != b && self.steps <= MOST_STEPS {
            let is_up = self.frames[a].depth >= self.frames[b].depth;
            let SdfFrame { steps, parent, .. } = &self.frames[if is_up { a } else { b }];
            self.steps += steps.len();
            match is_up {
                true => {
                    up.extend(steps.iter().rev().map(PoseStep::reversed));
                    a = *parent;
                }
                false => {
                    down.extend(steps.iter().rev().cloned());
                    b = *parent;
                }
            }
        }
        if self.steps > MOST_STEPS {
            let span = self.frames[to].name.place.span.clone();
            self.complain(&span, messages::too_complex("steps between frames", MOST_STEPS));
            return Vec::new();
        }
        down.reverse();
        up.extend(down);
        up
    }
}
