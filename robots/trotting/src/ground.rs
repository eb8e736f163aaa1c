//! The simulated robot on ground that gives way: nothing here knows of contact modes.
//!
//! Under a foot that is d deep the ground pushes by k d + c ḋ, never pulls, and holds it by a spring and a damper along the ground about an
//! anchor, by μ times that at most; what is more drags the anchor, and the foot has slipped by as much.

use crate::dot;
use crate::quadruped::{axes, in_trunk, plant, Feet, State, Torques, Velocity, FEET, NV};
use straightline::integrate::Step;
use straightline::Real;

/// Springs of the ground, up and along \[N/m\].
const STIFFNESS: f64 = 2e4;
/// Dampers \[N·s/m\].
const DAMPING: f64 = 30.0;

/// The robot and the ground under it.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Its state.
    pub state: State,
    /// Forces of the ground on the feet \[N\].
    pub forces: Feet,
    /// By how much each foot has slipped \[m\], all together.
    pub slipped: [f64; FEET],
    /// Coulomb's friction.
    friction: f64,
    anchors: [Option<[f64; 2]>; FEET],
    load: plant::Load,
}

impl Robot {
    /// With a load in its trunk.
    pub fn new(state: State, friction: f64, load: plant::Load) -> Robot {
        Robot { state, forces: [[0.0; 3]; FEET], slipped: [0.0; FEET], friction, anchors: [None; FEET], load }
    }

    /// A time h \[s\] later, under torques of the joints \[N·m\] and a force at the trunk's origin, in the world \[N\].
    pub fn step(&mut self, h: f64, torques: &Torques, push: &[f64; 3]) {
        let State { q, qd } = &self.state;
        let (mut places, mut slopes) = ([[0.0; 3]; FEET], [[[0.0; NV]; 3]; FEET]);
        plant::forward_kinematics(q, &mut places);
        plant::jacobian(q, &mut slopes);
        let trunk = in_trunk(q, push);
        let mut tau: Velocity = core::array::from_fn(|i| match i {
            0..3 => trunk[i],
            3..6 => 0.0,
            _ => torques[i - 6],
        });
        for foot in 0..FEET {
            let velocity = slopes[foot].map(|row| dot(&row, qd));
            let (force, anchor, slipped) = self.ground(&places[foot], &velocity, self.anchors[foot]);
            (self.forces[foot], self.anchors[foot]) = (force, anchor);
            self.slipped[foot] += slipped;
            for i in 0..NV {
                tau[i] += (0..3).map(|k| slopes[foot][k][i] * force[k]).sum::<f64>();
            }
        }
        let change = Step::of(h).semi_implicit_euler(0.0, &self.state, |_, q, qd, qdd: &mut Velocity| {
            plant::forward_dynamics(q, qd, &tau, &self.load, qdd);
        });
        self.state.add(&change, 0);
    }

    /// The force on a foot, where its anchor is then, and by how much that was dragged \[m\].
    fn ground(
        &self,
        place: &[f64; 3],
        velocity: &[f64; 3],
        anchor: Option<[f64; 2]>,
    ) -> ([f64; 3], Option<[f64; 2]>, f64) {
        let up = -STIFFNESS * place[2] - DAMPING * velocity[2];
        if place[2] >= 0.0 || up <= 0.0 {
            return ([0.0; 3], None, 0.0);
        }
        let from = anchor.unwrap_or([place[0], place[1]]);
        let mut along: [f64; 2] = core::array::from_fn(|i| STIFFNESS * (from[i] - place[i]) - DAMPING * velocity[i]);
        let (asked, most) = (Real::sqrt(dot(&along, &along)), self.friction * up);
        if asked <= most {
            return ([along[0], along[1], up], Some(from), 0.0);
        }
        along = along.map(|x| x * most / asked);
        let to: [f64; 2] = core::array::from_fn(|i| place[i] + (along[i] + DAMPING * velocity[i]) / STIFFNESS);
        let dragged: [f64; 2] = core::array::from_fn(|i| to[i] - from[i]);
        ([along[0], along[1], up], Some(to), Real::sqrt(dot(&dragged, &dragged)))
    }

    /// How far the trunk leans \[rad\], the sine of it: of its Z axis from the world's.
    pub fn lean(&self) -> f64 {
        let [x, y, _] = axes(&self.state.q)[2];
        Real::sqrt(x * x + y * y)
    }
}
