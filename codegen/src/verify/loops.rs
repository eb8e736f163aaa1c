//! Closed loops in the reference's terms: frames whose origins coincide.

use super::reference_input::radians;
use crate::description::{ClosingJoint, Description, LoopPoints, Noted, PoseCoordinate};
use crate::function::truth::{ClosedLoops, ClosedMeeting, Turning};
use crate::model::ModelOptions;
use nalgebra::{Matrix3, Vector3};
use straightline_core::model::Model;
use straightline_core::reference::{frame_pose, CentreOfMassFrame, CentreOfMassTree};
use straightline_core::Dd;

/// The loops of a file whose tree is numbered as the model; `None` if the model has none.
pub(super) fn closed_loops(
    description: &Description,
    options: &ModelOptions,
    tree: &CentreOfMassTree<Dd>,
    model: &Model<Dd>,
) -> Result<Option<ClosedLoops>, String> {
    if model.closure.is_empty() {
        return Ok(None);
    }
    let q = pose_of_file(description, options, tree, model);
    let mut meetings = Vec::new();
    for (written, of) in description.loops.iter().zip(&model.closure.loops) {
        let ends = match &written.points {
            LoopPoints::Frames([one, other]) => [at(tree, Some(one))?, at(tree, Some(other))?],
            LoopPoints::Anchor { links: [one, other], point } => {
                let [x, y, z] = point.value.map(Dd::from);
                let (one, other) = (at(tree, one.as_ref())?, at(tree, other.as_ref())?);
                let one = CentreOfMassFrame { position: one.position + one.rotation * Vector3::new(x, y, z), ..one };
                let met = frame_pose(tree, &one, &q).position;
                let pose = frame_pose(tree, &other, &q);
                let own = pose.rotation.transpose() * (met - pose.position);
                [one, CentreOfMassFrame { position: other.position + other.rotation * own, ..other }]
            }
        };
        // in their plane points are all that holds hinges
        let turning = match &written.joint {
            _ if of.alignments.is_empty() => Turning::Free,
            ClosingJoint::Spherical => Turning::Free,
            ClosingJoint::Revolute(axis) => Turning::About(Vector3::from(axis.value.map(Dd::from))),
            ClosingJoint::Fixed => Turning::None,
        };
        meetings.push(ClosedMeeting { ends, turning });
    }
    let equations = model.closure.loops.iter().map(|of| of.equations()).sum();
    Ok(Some(ClosedLoops { meetings, independent: model.nv(), equations }))
}

fn at(tree: &CentreOfMassTree<Dd>, name: Option<&Noted<String>>) -> Result<CentreOfMassFrame<Dd>, String> {
    let world = CentreOfMassFrame {
        name: String::new(),
        link: None,
        position: Vector3::from_element(Dd::ZERO),
        rotation: Matrix3::from_fn(|i, j| if i == j { Dd::ONE } else { Dd::ZERO }),
    };
    let Some(name) = name else { return Ok(world) };
    tree.frame(&name.value).cloned().ok_or_else(|| format!("the reference has no frame `{}`", name.value))
}

/// The coordinates in the pose that the file shows.
fn pose_of_file(
    description: &Description,
    options: &ModelOptions,
    tree: &CentreOfMassTree<Dd>,
    model: &Model<Dd>,
) -> Vec<Dd> {
    let mut q = vec![Dd::ZERO; tree.nq()];
    for (link, first) in tree.links.iter().filter_map(|link| Some((link, link.joint.quaternion()?))) {
        q[link.iq + first + 3] = Dd::ONE;
    }
    for joint in model.free_joints() {
        match description.reference_of(&joint.name) {
            Some(PoseCoordinate::Angle(angle)) => q[joint.iq] = radians(angle, options),
            Some(PoseCoordinate::Length(length)) => q[joint.iq] = Dd::from(length.value),
            None => {}
        }
    }
    q
}
