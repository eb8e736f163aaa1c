//! Chains of fixed joints, with links without mass between them.

use super::poses::{turns, PoseStep};
use super::Sdf;
use crate::description::{Angle, Noted, Rotation, WrittenJoint, WrittenLink, WrittenPose, WrittenTurn};

/// Adds a pose to those before it: a turn alone joins the turn before it.
pub(super) fn push(poses: &mut Vec<WrittenPose>, pose: WrittenPose) {
    if pose.is_identity() {
        return;
    }
    match poses.last_mut().filter(|_| pose.xyz.value == [0.0; 3]) {
        Some(last) => {
            let joined = [turns(&last.rotation), turns(&pose.rotation)].concat();
            last.rotation = Rotation::Turns(joined);
        }
        None => poses.push(pose),
    }
}

impl Sdf<'_, '_, '_> {
    /// The poses from one frame to another, one after the other.
    pub fn pieces(&mut self, from: usize, to: usize) -> Vec<WrittenPose> {
        let mut pieces = Vec::new();
        for pose in self.path(from, to).iter().flat_map(PoseStep::poses) {
            push(&mut pieces, pose);
        }
        pieces
    }

    /// Adds the turn from the axes of one frame to those of another.
    pub fn push_turn(&mut self, pieces: &mut Vec<WrittenPose>, from: usize, to: usize) {
        for step in self.path(from, to) {
            push(pieces, step.turn());
        }
    }

    /// Adds links on fixed joints for all poses but the last; the last link, and that pose in it.
    pub fn add_chain(
        &mut self,
        mut link: Noted<String>,
        mut pieces: Vec<WrittenPose>,
        of: &Noted<String>,
    ) -> (Noted<String>, WrittenPose) {
        let last = pieces.pop().unwrap_or_else(|| WrittenPose::identity(of.place.clone()));
        for pose in pieces {
            let next = self.add_carrier(of);
            self.add_fixed(link, next.clone(), pose);
            link = next;
        }
        (link, self.said_once(last))
    }

    /// Adds a link without mass.
    pub fn add_carrier(&mut self, of: &Noted<String>) -> Noted<String> {
        let name = Noted::new(self.names.made_up(&format!("{}_carrier", of.value)), of.place.clone());
        self.robot.links.push(WrittenLink { name: name.clone(), inertial: None, is_carrier: true });
        name
    }

    /// Adds a fixed joint that the file does not have.
    pub fn add_fixed(&mut self, parent: Noted<String>, child: Noted<String>, pose: WrittenPose) {
        let name = Noted::new(self.names.made_up(&format!("{}_fixed", child.value)), child.place.clone());
        let origin = self.said_once(pose);
        self.robot.joints.push(WrittenJoint::fixed(name, parent, child, origin));
    }

    /// The pose, with no text for angles that another pose has: they are one angle of the file.
    fn said_once(&mut self, mut pose: WrittenPose) -> WrittenPose {
        let mut once = |angle: &mut Angle| {
            if angle.value != 0.0 && !self.angles.insert(angle.place.span.start) {
                angle.text.clear();
            }
        };
        match &mut pose.rotation {
            Rotation::RollPitchYaw(angles) => angles.iter_mut().for_each(once),
            Rotation::Turns(turns) => turns.iter_mut().for_each(|turn| {
                if let WrittenTurn::About { angle, .. } = turn {
                    once(angle);
                }
            }),
        }
        pose
    }
}
