//! Other masses, inertias and losses of joints in a robot file, in which everything else stays as it is written.

use super::{compare, lose, messages, written, ConvertOptions};
use crate::description::write::edits::edited;
use crate::description::{self, Description, JointDrive, Noted, WrittenInertial};
use crate::diagnostic::{Diagnostics, Source};
use straightline_core::spatial::{Mat3, Sym3};

/// What a link is to have.
#[derive(Clone, Debug, PartialEq)]
pub struct NewInertial {
    /// The link.
    pub link: String,
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the link's frame \[m\].
    pub com: [f64; 3],
    /// Inertia about the centre of mass in the link's axes \[kg·m²\].
    pub inertia: Sym3<f64>,
}

/// What a joint is to have; what is `None` stays.
#[derive(Clone, Debug, PartialEq)]
pub struct NewEffects {
    /// The joint.
    pub joint: String,
    /// Viscous friction \[N·m·s/rad or N·s/m\].
    pub damping: Option<f64>,
    /// Coulomb friction \[N·m or N\].
    pub friction: Option<f64>,
    /// Inertia of the rotor on the joint's own coordinate \[kg·m² or kg\].
    pub rotor_inertia: Option<f64>,
}

/// New numbers of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NewNumbers {
    /// Of links that have an inertial.
    pub links: Vec<NewInertial>,
    /// Of joints.
    pub joints: Vec<NewEffects>,
}

/// The text of a robot file with new numbers. URDF and TOML keep everything else to the byte; other formats are written anew. The text is read back and
/// compared with the robot that was meant. What the format has no place for is an error; `None` after one.
pub fn renumbered(source: &Source, numbers: &NewNumbers, diagnostics: &mut Diagnostics) -> Option<String> {
    let was = description::read(source, diagnostics)?;
    let mut robot = was.clone();
    numbers.put_into(&mut robot);
    let Some(writer) = was.format.write else {
        diagnostics.push(messages::not_written(was.format.name));
        return None;
    };
    let Some(edits) = writer.edits else {
        return written(robot, was.format, ConvertOptions::default(), diagnostics);
    };
    for loss in writer.losses.iter().filter(|loss| (loss.find)(&was).is_empty()) {
        lose(loss, was.format, false, &mut robot, diagnostics);
    }
    if diagnostics.has_errors() {
        return None;
    }
    let text = edited(source.text(), edits(source, [&was, &robot]));
    match compare::difference(&robot, &text, was.format, writer) {
        None => Some(text),
        Some(difference) => {
            diagnostics.push(messages::not_as_read(was.format.name, &difference).at(&robot.name.place));
            None
        }
    }
}

impl NewNumbers {
    fn put_into(&self, robot: &mut Description) {
        for new in &self.links {
            let link = robot.links.iter_mut().find(|link| link.name.value == new.link);
            if let Some(inertial) = link.and_then(|link| link.inertial.as_mut()) {
                new.put_into(inertial);
            }
        }
        for new in &self.joints {
            if let Some(joint) = robot.joints.iter_mut().find(|joint| joint.name.value == new.joint) {
                new.put_into(&mut joint.drive);
            }
        }
    }
}

impl NewInertial {
    /// The inertia in the axes that the file has.
    fn put_into(&self, inertial: &mut WrittenInertial) {
        let turn = inertial.turn();
        inertial.mass.value = self.mass;
        inertial.com.value = self.com;
        let is_turned = turn != Mat3::identity();
        inertial.inertia.value = if is_turned { self.inertia.rotated(&turn.transpose()) } else { self.inertia };
    }
}

impl NewEffects {
    fn put_into(&self, drive: &mut JointDrive) {
        let put = |place: &mut Option<Noted<f64>>, value: Option<f64>| match (place, value) {
            (Some(was), Some(value)) => was.value = value,
            (place @ None, Some(value)) if value != 0.0 => *place = Some(Noted::assumed(value)),
            _ => {}
        };
        put(&mut drive.damping, self.damping);
        put(&mut drive.friction, self.friction);
        match (&drive.armature, &drive.rotor_inertia) {
            (None, Some(_)) => {
                let ratio = drive.gear_ratio.as_ref().map_or(1.0, |ratio| ratio.value);
                put(&mut drive.rotor_inertia, self.rotor_inertia.map(|inertia| inertia / (ratio * ratio)));
            }
            _ => put(&mut drive.armature, self.rotor_inertia),
        }
    }
}
