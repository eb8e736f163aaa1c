//! Drives of a robot that moves: their inputs, their states, and where their power goes.

use crate::command::Samples;
use straightline_core::algorithms::{
    drive_demands, inverse_dynamics, inverse_orders, reads_states, Demand, MOST_DERIVATIVES,
};
use straightline_core::drive::{Actuator, Drive};
use straightline_core::model::Model;
use straightline_core::Taylor;

/// Inputs of drives over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs {
    /// Per drive, linear in between.
    pub samples: Samples,
    /// Of every drive whether its numbers are currents \[A\] that an amplifier keeps up as far as its voltage allows.
    pub are_currents: Vec<bool>,
}

/// The heat and the losses of all drives of a robot over a simulation \[J\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriveEnergies {
    /// What came in: electrical, or from the shafts of linear actuators.
    pub electrical: f64,
    /// Joule heat.
    pub joule: f64,
    /// Friction in the motors.
    pub friction: f64,
    /// Losses of gears.
    pub gears: f64,
    /// Dampers of elastic stages.
    pub dampers: f64,
    /// What motors with C_E ≠ C_M turn into nothing.
    pub conversion: f64,
}

impl DriveEnergies {
    /// How many numbers they are.
    pub const COUNT: usize = 6;

    /// From numbers in the order of the fields.
    pub fn from_slice(numbers: &[f64]) -> DriveEnergies {
        let [electrical, joule, friction, gears, dampers, conversion] =
            std::array::from_fn(|k| numbers.get(k).copied().unwrap_or(0.0));
        DriveEnergies { electrical, joule, friction, gears, dampers, conversion }
    }

    /// All that is lost.
    pub fn lost(&self) -> f64 {
        self.joule + self.friction + self.gears + self.dampers + self.conversion
    }
}

/// The state x of drives at rest in their transmissions: springs slack, no current, shafts turning with the joints.
pub fn slack_state(model: &Model<f64>, q: &[f64], qd: &[f64]) -> Vec<f64> {
    let mut x = Vec::new();
    for drive in &model.drives {
        let shafts = slack_shafts(model, drive, q, qd);
        x.extend(state_of(drive, &shafts, 0.0));
    }
    x
}

/// Angle and speed of every shaft of a drive whose springs are slack, from the actuator's on.
fn slack_shafts(model: &Model<f64>, drive: &Drive<f64>, q: &[f64], qd: &[f64]) -> Vec<[f64; 2]> {
    let joint = |body: usize| &model.bodies[body].joint;
    let last = drive
        .joints
        .iter()
        .fold([0.0; 2], |[angle, speed], (body, n)| [angle + n * q[joint(*body).iq], speed + n * qd[joint(*body).iv]]);
    let mut shafts = vec![last];
    for stage in drive.stages.iter().rev() {
        let behind = shafts[shafts.len() - 1];
        shafts.push(behind.map(|x| x * stage.ratio));
    }
    shafts.reverse();
    shafts
}

/// The state of a drive from its shafts and its current. A linear actuator gets the smallest state with that shaft: T x = θ̇, and
/// P x = θ where it has a row P.
fn state_of(drive: &Drive<f64>, shafts: &[[f64; 2]], current: f64) -> Vec<f64> {
    let [angle, speed] = shafts[0];
    let mut x = match &drive.actuator {
        Actuator::Motor(m) => [angle, speed].into_iter().chain(m.inductance.map(|_| current)).collect(),
        Actuator::Linear(a) => match &a.position {
            Some(p) => smallest(&[(&a.t, speed), (p, angle)]),
            None => smallest(&[(&a.t, speed)]),
        },
    };
    x.extend(shafts.iter().take(drive.stages.len()).skip(1).flatten());
    x
}

/// The smallest x with a · x = b for these rows, one or two: Σ λ a with the Gram matrix of the rows; parallel rows count once.
fn smallest(rows: &[(&Vec<f64>, f64)]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (a, b) = rows[0];
    let aa = dot(a, a);
    let mut x: Vec<f64> = a.iter().map(|a| a * b / aa).collect();
    if let Some((p, c)) = rows.get(1) {
        // what P has beside T
        let along = dot(p, a) / aa;
        let rest: Vec<f64> = p.iter().zip(a).map(|(p, a)| p - along * a).collect();
        let size = dot(&rest, &rest);
        if size > 1e-24 * dot(p, p) {
            let lambda = (c - dot(p, &x)) / size;
            x.iter_mut().zip(&rest).for_each(|(x, r)| *x += lambda * r);
        }
    }
    x
}

/// How many derivatives of q beside q̇ and q̈ the inputs for a motion take, of a robot whose drives' dampers are left out; `None` if the
/// inputs do not follow from the motion.
pub fn further_derivatives(model: &Model<f64>) -> Option<usize> {
    inverse_orders(&without_dampers(model).drives).map(|orders| orders.of_torque)
}

/// The robot without the dampers of elastic stages. Behind a damped spring θ̇ follows a differential equation whose solution settles
/// within d/c, milliseconds as a rule; without the damper θ follows from the motion alone.
pub fn without_dampers(model: &Model<f64>) -> Model<f64> {
    let mut model = model.clone();
    for stage in model.drives.iter_mut().flat_map(|d| &mut d.stages) {
        stage.damping = None;
    }
    model
}

/// What a motion asks of all drives of a robot from [`without_dampers`]: `rates` are q̇, q̈ and further derivatives, as many as there
/// are, `x` the state of the drives, which is read of linear actuators alone, and `added` forces beside those of the motion \[N·m or N\].
///
/// # Panics
/// If [`further_derivatives`] is `None`.
pub fn demands(
    model: &Model<f64>,
    q: &[f64],
    rates: &[Vec<f64>],
    x: &[f64],
    added: ForcesOnJoints,
) -> Vec<Demand<f64>> {
    fn over<const N: usize>(
        model: &Model<f64>,
        q: &[f64],
        rates: &[Vec<f64>],
        x: &[f64],
        added: ForcesOnJoints,
    ) -> Vec<Demand<f64>> {
        let rates: Vec<&[f64]> = rates.iter().map(Vec::as_slice).collect();
        drive_demands::<f64, N>(N, model, q, &rates, x, |model, q, qd, qdd| match added {
            ForcesOnJoints::Motion(forces) => {
                let motion = inverse_dynamics(model, q, qd, qdd).into_iter().zip(forces);
                motion.map(|(tau, f)| tau + Taylor::fixed(*f)).collect()
            }
            ForcesOnJoints::Only(forces) => forces.iter().map(|f| Taylor::fixed(*f)).collect(),
        })
    }
    let x = if reads_states(&model.drives) { x } else { &[] };
    match inverse_orders(&model.drives).expect("the inputs follow from the motion").of_torque {
        0 => over::<1>(model, q, rates, x, added),
        1..=3 => over::<4>(model, q, rates, x, added),
        4..=7 => over::<8>(model, q, rates, x, added),
        8..=15 => over::<16>(model, q, rates, x, added),
        _ => over::<{ MOST_DERIVATIVES + 1 }>(model, q, rates, x, added),
    }
}

/// The forces that drives are to put on the joints \[N·m or N\].
#[derive(Clone, Copy, Debug)]
pub enum ForcesOnJoints<'a> {
    /// Those of the motion, and these.
    Motion(&'a [f64]),
    /// These alone.
    Only(&'a [f64]),
}

/// The state of drives that do what is asked of them.
pub fn state_of_demands(model: &Model<f64>, demands: &[Demand<f64>]) -> Vec<f64> {
    let of =
        |(drive, demand): (&Drive<f64>, &Demand<f64>)| state_of(drive, &demand.shafts, demand.current.unwrap_or(0.0));
    model.drives.iter().zip(demands).flat_map(of).collect()
}

/// The speed of every shaft before a gear that loses power, relative to the speed of the joints: where losses change their direction
/// smoothly.
pub(crate) fn smooth_losses(drive: &mut Drive<f64>, joint_speed: f64) {
    let mut speed = joint_speed * drive.joints.iter().map(|(_, n)| n.abs()).fold(0.0, f64::max);
    let smooth = |efficiency: &mut Option<straightline_core::drive::Efficiency<f64>>, speed: f64| {
        if let Some(efficiency) = efficiency {
            efficiency.speed.get_or_insert(speed);
        }
    };
    smooth(&mut drive.efficiency, speed);
    for stage in drive.stages.iter_mut().rev() {
        speed *= stage.ratio.abs();
        smooth(&mut stage.efficiency, speed);
    }
}

/// The state of drives without dampers in a motion at time `t` \[s\]; `None` if it does not follow from the motion.
pub fn state_of_motion(model: &Model<f64>, motion: &crate::motion::Motion, t: f64) -> Option<Vec<f64>> {
    further_derivatives(model)?;
    let mut rates = motion.derivatives(t);
    let q = rates.remove(0);
    let undamped = without_dampers(model);
    let slack = slack_state(model, &q, &rates[0]);
    let none = vec![0.0; model.nv()];
    Some(state_of_demands(model, &demands(&undamped, &q, &rates, &slack, ForcesOnJoints::Motion(&none))))
}
