//! Axes of joints, with the limits and what acts on each.

use super::Sdf;
use crate::description::reader::Range64;
use crate::description::xml::{children, tag};
use crate::description::{messages, JointDrive, JointLimits, Noted};
use roxmltree::Node;

/// An axis as it is written.
pub(super) struct SdfAxis<'d, 'i> {
    /// Its direction.
    pub xyz: Noted<[f64; 3]>,
    /// The frame that the direction is given in.
    pub frame: usize,
    pub limits: JointLimits,
    pub drive: JointDrive,
    pub mimic: Option<Node<'d, 'i>>,
}

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// Reads an axis of a joint.
    pub fn read_axis(&mut self, element: Node<'d, 'i>, joint: usize, owner: &str) -> SdfAxis<'d, 'i> {
        let owner = &format!("{} of {owner}", element.tag_name().name());
        let [xyz, limit, dynamics, mimic, in_model] =
            self.pick(owner, element, ["xyz", "limit", "dynamics", "mimic", "use_parent_model_frame"]);
        let scope = self.frames[joint].scope;
        let mut frame = joint;
        let mut direction = self.reader.value([0.0, 0.0, 1.0], &tag(element));
        match xyz {
            Some(xyz) => {
                self.check_attributes(owner, xyz, &["expressed_in"]);
                direction = self.vector(xyz, owner).unwrap_or(direction);
                if let Some(name) = self.attribute(xyz, "expressed_in") {
                    frame = self.frame_named(scope, name, owner).unwrap_or(joint);
                }
            }
            None => {
                self.complain(&tag(element), messages::missing_element(owner, "xyz", "<xyz>0 0 1</xyz>"));
                self.robot.has_holes = true;
            }
        }
        if let Some(in_model) = in_model.filter(|in_model| self.is_set(*in_model, owner)) {
            if self.version < 7 {
                frame = self.scopes[scope].frame;
            } else {
                let why = "since SDF 1.7 nothing is read of it, and the axis would be another one";
                self.refuse(in_model, owner, why, "write `<xyz expressed_in=\"__model__\">`");
            }
        }
        let limits = limit.map(|limit| self.read_limits(limit, owner)).unwrap_or_default();
        let drive = dynamics.map(|dynamics| self.read_dynamics(dynamics, owner)).unwrap_or_default();
        SdfAxis { xyz: direction, frame, limits, drive, mimic }
    }

    /// Limits that are none are left out: those without end, and a greatest speed or torque below zero.
    fn read_limits(&mut self, element: Node<'d, 'i>, owner: &str) -> JointLimits {
        let owner = format!("limit of {owner}");
        let names = ["lower", "upper", "velocity", "effort"];
        let found = self.pick(&owner, element, names);
        let mut read = |k: usize| {
            let limit = self.number(found[k]?, &format!("{} {owner}", names[k]), Range64::Limit)?;
            Some(limit).filter(|limit| JointLimits::is_limit(limit.value))
        };
        let (lower, upper) = (read(0), read(1));
        let mut greatest = |k: usize| read(k).filter(|limit| limit.value >= 0.0);
        JointLimits { lower, upper, velocity: greatest(2), effort: greatest(3) }
    }

    fn read_dynamics(&mut self, element: Node<'d, 'i>, owner: &str) -> JointDrive {
        let owner = format!("dynamics of {owner}");
        let [damping, friction, reference, stiffness] =
            self.pick(&owner, element, ["damping", "friction", "spring_reference", "spring_stiffness"]);
        let spring_stiffness = self.number_in(stiffness, &owner);
        let is_sprung = spring_stiffness.as_ref().is_some_and(|stiffness| stiffness.value != 0.0);
        JointDrive {
            damping: self.number_in(damping, &owner),
            friction: self.number_in(friction, &owner),
            spring_rest: self.number_in(reference, &owner).filter(|_| is_sprung),
            spring_stiffness: spring_stiffness.filter(|_| is_sprung),
            ..JointDrive::default()
        }
    }

    /// Complains of a joint that an engine is to treat as the closing one of a loop.
    pub fn check_engine(&mut self, physics: Node<'d, 'i>, owner: &str) {
        let simbody = children(physics).filter(|child| child.tag_name().name() == "simbody");
        for loop_joint in simbody.flat_map(children).filter(|child| child.tag_name().name() == "must_be_loop_joint") {
            if self.is_set(loop_joint, owner) {
                self.refuse(loop_joint, owner, "the links of a robot form a tree", "remove it, or the joint");
            }
        }
    }
}
