//! What a frame carries in addition: ten parameters that torques are linear in.

use super::torques::StateColumns;
use straightline_core::model::{JointEffects, Load, Model};
use straightline_core::spatial::SpatialInertia;

/// Names of the parameters, of a payload in its frame: mass \[kg\], first moments \[kg·m\], second moments ∫ r rᵀ dm \[kg·m²\].
pub const PAYLOAD_PARAMETERS: [&str; 10] =
    ["mass", "m cx", "m cy", "m cz", "∫ xx dm", "∫ xy dm", "∫ xz dm", "∫ yy dm", "∫ yz dm", "∫ zz dm"];

/// The robot without mass, friction and springs, which carries one unit of each parameter in turn at a frame.
#[derive(Clone, Debug)]
pub struct UnitPayloads {
    models: Vec<Model<f64>>,
}

impl UnitPayloads {
    /// At a frame of the robot; `None` where nothing that moves carries it.
    pub fn at(model: &Model<f64>, frame: &str) -> Option<UnitPayloads> {
        let frame = model.frame(frame)?;
        let body = frame.body?;
        let mut bare = model.clone();
        for body in &mut bare.bodies {
            body.inertia = SpatialInertia::zero();
            body.effects = JointEffects::none();
            body.load = None;
        }
        let carrying = |k: usize| {
            let mut model = bare.clone();
            model.bodies[body].carry(Load::unit(k).seen_from(&frame.placement));
            model
        };
        Some(UnitPayloads { models: (0..PAYLOAD_PARAMETERS.len()).map(carrying).collect() })
    }

    /// Torques per unit of each parameter in one state: a row of ten per coordinate.
    pub fn rows(&self, motion: [&StateColumns; 3], state: usize) -> Vec<[f64; 10]> {
        let [q, qd, qdd] = motion.map(|columns| columns.iter().map(|c| c[state]).collect::<Vec<f64>>());
        let mut rows = vec![[0.0; 10]; qd.len()];
        for (k, model) in self.models.iter().enumerate() {
            let torques = straightline_core::algorithms::inverse_dynamics(model, &q, &qd, &qdd);
            rows.iter_mut().zip(torques).for_each(|(row, torque)| row[k] = torque);
        }
        rows
    }
}

/// The frame that payloads are looked for at unless one is named: the link of the last body.
pub fn last_link(model: &Model<f64>) -> Option<&str> {
    let body = model.bodies.last()?;
    model.frames.iter().find(|frame| frame.name == body.name).map(|frame| frame.name.as_str())
}
