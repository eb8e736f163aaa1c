//! Where joints stand, as another format has it.
//!
//! A joint that stands anywhere in the frame of its link has the pose of that frame in the parent's at q = 0, its own place and its axis. One that
//! stands at the frame of the link that it moves needs a link there: `LINK_at_joint`, without mass, on which the link itself is fixed, so that
//! masses and frames keep their numbers.

use crate::description::reader::FreeNames;
use crate::description::write::{of_length_one, pose_of, FormatWriter, JointForm};
use crate::description::{AnchoredJoint, Description, Noted, Placement, WrittenJoint, WrittenLink, WrittenPose};
use crate::diagnostic::{Diagnostics, Place};
use crate::model::angle::{transform, ROUNDING};
use crate::model::geometry::{compose, vector};
use crate::model::pose_at_zero;
use straightline_core::spatial::{Mat3, Transform};
use straightline_core::Dd;

/// The same robot with its joints as a format has them, and its frames; `None`: a joint stands nowhere.
pub fn formed(robot: &Description, writer: &FormatWriter) -> Option<Description> {
    let mut formed = robot.clone();
    for joint in &mut formed.joints {
        joint.placement = anywhere(joint)?;
    }
    let mut names = RobotNames::of(robot);
    if writer.joints == JointForm::AtFrames {
        at_frames(&mut formed, &mut names);
    }
    if writer.frames_are_links {
        for frame in std::mem::take(&mut formed.frames) {
            let own = names.joints.made_up(&format!("{}_fixed", frame.name.value));
            formed.links.push(WrittenLink { name: frame.name.clone(), inertial: None, is_carrier: false });
            formed.joints.push(WrittenJoint::fixed(Noted::assumed(own), frame.link, frame.name, frame.pose));
        }
    }
    Some(formed)
}

/// Names of links and frames, and of joints.
pub(super) struct RobotNames {
    pub(super) links: FreeNames,
    joints: FreeNames,
}

impl RobotNames {
    pub(super) fn of(robot: &Description) -> RobotNames {
        let mut names = RobotNames { links: FreeNames::default(), joints: FreeNames::default() };
        let links = robot.links.iter().map(|link| &link.name).chain(robot.frames.iter().map(|frame| &frame.name));
        names.links.take(links.map(|name| name.value.clone()));
        names.joints.take(robot.joints.iter().map(|joint| joint.name.value.clone()));
        names
    }
}

/// A joint by the frames of its links, with the joint anywhere in them; a fixed one by frames alone.
fn anywhere(joint: &WrittenJoint) -> Option<Placement> {
    let (anchor, axis) = match &joint.placement {
        Placement::Frames { .. } if joint.kind.value.between_links().is_none() => return Some(joint.placement.clone()),
        Placement::Frames { origin, axis } => {
            let anchor = Noted::assumed([0.0; 3]);
            let axis = if joint.kind.value.has_axis() { axis.clone() } else { Noted::assumed([0.0, 0.0, 1.0]) };
            let origin = origin.clone();
            return Some(Placement::Anchored(AnchoredJoint { origin, anchor, axis, reference: None }));
        }
        Placement::Anchored(AnchoredJoint { reference: None, .. }) => return Some(joint.placement.clone()),
        Placement::Anchored(AnchoredJoint { anchor, axis, .. }) => (anchor.value, axis.value),
        Placement::Vectors(vectors) => (vectors.r.value.map(|x| 0.0 - x), vectors.e.value),
    };
    let pose = pose_at_zero(joint, ROUNDING, &mut Diagnostics::new())?;
    let [anchor, axis] = [anchor, axis].map(Noted::assumed);
    Some(Placement::Anchored(AnchoredJoint { origin: pose_of(&pose), anchor, axis, reference: None }))
}

/// Brings joints to frames of links.
fn at_frames(robot: &mut Description, names: &mut RobotNames) {
    let mut joints = Vec::new();
    for mut joint in std::mem::take(&mut robot.joints) {
        let Placement::Anchored(AnchoredJoint { mut origin, anchor, axis, .. }) = joint.placement else {
            joints.push(joint);
            continue;
        };
        let axis = Noted::assumed(of_length_one(axis.value));
        let anchor = anchor.value;
        let mut fixed = None;
        if anchor != [0.0; 3] {
            let at_joint = Transform { rotation: Mat3::identity(), translation: vector(anchor) };
            let moved = compose(&transform(&origin, ROUNDING), &at_joint);
            origin.xyz = Noted::assumed(moved.translation.to_array().map(Dd::to_f64));
            let link = Noted::assumed(names.links.made_up(&format!("{}_at_joint", joint.child.value)));
            robot.links.push(WrittenLink { name: link.clone(), inertial: None, is_carrier: false });
            let own = names.joints.made_up(&format!("{}_fixed", joint.child.value));
            let child = std::mem::replace(&mut joint.child, link.clone());
            let back =
                WrittenPose { xyz: Noted::assumed(anchor.map(|x| 0.0 - x)), ..WrittenPose::identity(Place::none()) };
            fixed = Some(WrittenJoint::fixed(Noted::assumed(own), link, child, back));
        }
        joint.placement = Placement::Frames { origin, axis };
        joints.push(joint);
        joints.extend(fixed);
    }
    robot.joints = joints;
}
