//! Springs and dampers that are made of how a joint is to swing, as numbers.

use crate::description::{Description, Noted};
use straightline_core::model::Model;
use straightline_core::Dd;

/// Writes the numbers that the model has in the place of what they are made of.
pub(super) fn by_numbers(robot: &mut Description, model: &Model<Dd>) {
    for joint in &mut robot.joints {
        let Some(oscillation) = joint.drive.oscillation.take() else { continue };
        let Some(body) = model.bodies.iter().find(|body| body.joint.name == joint.name.value) else { continue };
        let number = |x: Dd| Some(Noted::new(x.to_f64(), oscillation.place.clone()));
        (joint.drive.spring_stiffness, joint.drive.damping) =
            (number(body.effects.stiffness), number(body.effects.damping));
    }
}
