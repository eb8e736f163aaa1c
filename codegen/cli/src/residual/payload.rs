//! What a frame carries in addition: ten parameters that torques are linear in.

use super::torques::StateColumns;
use straightline_core::model::{Frame, JointEffects, Load, Model};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Vec3};

/// Names of the parameters, of a payload in its frame: mass \[kg\], first moments \[kg·m\], second moments ∫ r rᵀ dm \[kg·m²\].
pub const PAYLOAD_PARAMETERS: [&str; 10] =
    ["mass", "m cx", "m cy", "m cz", "∫ xx dm", "∫ xy dm", "∫ xz dm", "∫ yy dm", "∫ yz dm", "∫ zz dm"];

/// The robot without mass, friction and springs, which carries one unit of each parameter in turn at a frame.
#[derive(Clone, Debug)]
pub struct UnitPayloads {
    models: Vec<Model<f64>>,
}

/// One unit of a parameter, in the frame's axes about its origin.
fn unit(k: usize) -> Load<f64> {
    let is = |j: usize| if j == k { 1.0 } else { 0.0 };
    Load {
        mass: is(0),
        first_moment: Vec3::from([is(1), is(2), is(3)]),
        second_moment: Sym3 { xx: is(4), xy: is(5), xz: is(6), yy: is(7), yz: is(8), zz: is(9) },
    }
}

/// A load in a frame, as its body's canonical frame has it: r = t + R r', so that Σ = R Σ' Rᵀ + R h tᵀ + t (R h)ᵀ + m t tᵀ.
fn placed(load: Load<f64>, frame: &Frame<f64>) -> Load<f64> {
    let (rotation, t) = (&frame.placement.rotation, frame.placement.translation);
    let h = *rotation * load.first_moment;
    let turned = *rotation * load.second_moment.to_matrix() * rotation.transpose();
    let second = turned + Mat3::outer(h, t) + Mat3::outer(t, h) + Mat3::outer(t, t.scale(load.mass));
    Load { mass: load.mass, first_moment: h + t.scale(load.mass), second_moment: Sym3::from_matrix(&second) }
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
            model.bodies[body].carry(placed(unit(k), frame));
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
