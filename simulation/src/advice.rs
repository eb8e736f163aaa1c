//! What would have to change so that a limit is kept, and by which factor: the time of a motion, a gear ratio, a motor constant, a mass.
//!
//! Every factor is computed by analysing the changed robot or motion: the one nearest to 1 with which the limit is kept, to three
//! digits, rounded away from 1. What is said of one limit says nothing of the others, and each factor is a remedy by itself.

use crate::analysis::{analyze, Violation};
use crate::motion::Motion;
use std::fmt;
use straightline_core::drive::Actuator;
use straightline_core::model::{BodyId, Model};

/// Instants at which a factor is looked for; it is held against those of the analysis afterwards.
const INSTANTS: f64 = 200.0;
/// From factor to factor, the sixth root of 2, and how far: up to 8 times, or an eighth.
const PER_DOUBLING: i32 = 6;
const DOUBLINGS: i32 = 3;

/// Something that can be changed.
#[derive(Clone, Debug, PartialEq)]
pub enum Lever {
    /// The time that the motion takes.
    Time,
    /// The ratio of a drive, all of its speed over that of the joints.
    GearRatio(usize),
    /// Torque and voltage constant of a drive's motor.
    MotorConstant(usize),
    /// The mass of a body at the end of a chain with what it carries, inertia in proportion.
    Mass(BodyId),
}

/// A remedy.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// What is changed.
    pub lever: Lever,
    /// By this factor.
    pub factor: f64,
    /// That in words.
    pub text: String,
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Lever {
    /// The robot and the motion with this changed by a factor.
    pub fn apply(&self, factor: f64, model: &Model<f64>, motion: &Motion) -> (Model<f64>, Motion) {
        let mut model = model.clone();
        match self {
            Lever::Time => return (model, motion.slowed(factor)),
            Lever::GearRatio(k) => {
                let drive = &mut model.drives[*k];
                match drive.stages.first_mut() {
                    Some(stage) => stage.ratio *= factor,
                    None => {
                        drive.joints.iter_mut().for_each(|(_, ratio)| *ratio *= factor);
                        // the torque on a shaft per force of a joint
                        drive.shares.iter_mut().flatten().for_each(|(_, share)| *share /= factor);
                    }
                }
            }
            Lever::MotorConstant(k) => {
                if let Actuator::Motor(motor) = &mut model.drives[*k].actuator {
                    motor.torque_constant *= factor;
                    motor.emf_constant *= factor;
                }
            }
            Lever::Mass(body) => {
                let body = &mut model.bodies[*body];
                let inertia = &mut body.inertia;
                inertia.mass *= factor;
                inertia.first_moment = inertia.first_moment.scale(factor);
                inertia.second_moment = inertia.second_moment.map(|x| x * factor);
                if let Some(load) = &mut body.load {
                    *load = load.map(|x| x * factor);
                }
            }
        }
        (model, motion.clone())
    }

    fn text(&self, factor: f64, model: &Model<f64>, motion: &Motion) -> String {
        match self {
            Lever::Time => {
                let time = (motion.duration() - motion.times[0]) * factor;
                format!("the motion {factor} times as long ({} s)", digits(time, 4, f64::round))
            }
            Lever::GearRatio(k) => format!("the gear ratio of drive {} times {factor}", model.drives[*k].name),
            Lever::MotorConstant(k) => format!("the motor constant of drive {} times {factor}", model.drives[*k].name),
            Lever::Mass(body) => {
                let body = &model.bodies[*body];
                let mass = body.inertia.mass + body.load.as_ref().map_or(0.0, |load| load.mass);
                let kept = digits(mass * factor, 4, f64::round);
                format!("the mass of {} with what it carries times {factor} ({kept} kg)", body.name)
            }
        }
    }

    /// Factors to be tried, from those near 1 on.
    fn factors(&self) -> Vec<f64> {
        let power = |k: i32| (f64::from(k) / f64::from(PER_DOUBLING)).exp2();
        let steps = 1..=PER_DOUBLING * DOUBLINGS;
        match self {
            Lever::Time => steps.map(power).collect(),
            Lever::Mass(_) => steps.map(|k| power(-k)).chain([0.0]).collect(),
            Lever::GearRatio(_) | Lever::MotorConstant(_) => steps.flat_map(|k| [power(k), power(-k)]).collect(),
        }
    }
}

/// Of how many limits at most it takes no long to ask [`advise`], which takes some hundred analyses for each: none of motions of thousands of
/// samples.
pub fn affordable(motion: &Motion) -> usize {
    let instants = INSTANTS.max(3.0 * motion.times.len() as f64);
    ((3000.0 / instants) as usize).min(6)
}

/// Remedies for a limit that a motion exceeds, each by itself; none where nothing that is known here would help.
pub fn advise(model: &Model<f64>, motion: &Motion, interval: f64, violation: &Violation) -> Vec<Advice> {
    let coarse = ((motion.duration() - motion.times[0]) / INSTANTS).max(interval);
    let levers = levers(model, violation);
    let found = levers.into_iter().filter_map(|lever| {
        // a longer motion is looked at no more often
        let of_search = |factor: f64| if lever == Lever::Time { coarse * factor } else { coarse };
        let keeps = |factor: f64, interval: f64| {
            let (model, motion) = lever.apply(factor, model, motion);
            let same = |v: &Violation| v.joint == violation.joint && v.what == violation.what;
            analyze(&model, &motion, interval).is_ok_and(|found| !found.violations.iter().any(same))
        };
        let factor =
            nearest(&lever.factors(), |factor| keeps(factor, of_search(factor)), |factor| keeps(factor, interval))?;
        let text = lever.text(factor, model, motion);
        Some(Advice { lever, factor, text })
    });
    found.collect()
}

/// What can help to keep a limit.
fn levers(model: &Model<f64>, violation: &Violation) -> Vec<Lever> {
    let mut levers = Vec::new();
    if violation.what != "position" {
        levers.push(Lever::Time);
    }
    let mut moved: Vec<BodyId> = Vec::new();
    if let Some(k) = model.drives.iter().position(|d| d.name == violation.joint && is_of_drive(violation.what)) {
        if matches!(model.drives[k].actuator, Actuator::Motor(_)) {
            levers.extend([Lever::GearRatio(k), Lever::MotorConstant(k)]);
        }
        moved.extend(model.drives[k].joints.iter().map(|(body, _)| *body));
    } else {
        moved.extend(model.bodies.iter().position(|b| b.joint.name == violation.joint));
    }
    if ["position", "speed", "motor speed"].contains(&violation.what) {
        return levers;
    }
    // the last bodies of the chains that the joint moves
    let is_last = |id: BodyId| model.bodies.iter().all(|b| b.parent != Some(id));
    let is_moved = |mut id: BodyId| loop {
        if moved.contains(&id) {
            return true;
        }
        match model.bodies[id].parent {
            Some(parent) => id = parent,
            None => return false,
        }
    };
    levers.extend((0..model.bodies.len()).filter(|id| is_last(*id) && is_moved(*id)).map(Lever::Mass));
    levers
}

/// Whether a limit is one of drives.
fn is_of_drive(what: &str) -> bool {
    ["voltage", "current", "motor speed", "rms current", "winding temperature"].contains(&what)
}

/// The factor nearest to 1 that is right, to three digits: between the first one of the list that is and 1 by bisection, then away from 1
/// until `for_certain` says so, too.
fn nearest(factors: &[f64], is_right: impl Fn(f64) -> bool, for_certain: impl Fn(f64) -> bool) -> Option<f64> {
    let mut good = factors.iter().copied().find(|f| is_right(*f))?;
    let mut bad = 1.0;
    while (good - bad).abs() > 2e-4 * bad.max(good) {
        let middle = 0.5 * (good + bad);
        match is_right(middle) {
            true => good = middle,
            false => bad = middle,
        }
    }
    let away = if good > 1.0 { f64::ceil } else { f64::floor };
    let mut factor = digits(good, 3, away);
    for _ in 0..6 {
        if for_certain(factor) {
            return Some(factor);
        }
        factor = digits(if good > 1.0 { factor * 1.003 } else { factor * 0.997 }, 3, away);
    }
    None
}

/// A number with so many digits, rounded by `round`.
fn digits(x: f64, count: i32, round: fn(f64) -> f64) -> f64 {
    if x == 0.0 {
        return 0.0;
    }
    let scale = 10f64.powi(count - 1 - x.abs().log10().floor() as i32);
    // a division by a power of ten leaves the decimal number itself
    let whole = round(x * scale);
    format!("{:.*}", (scale.log10().round().max(0.0)) as usize, whole / scale).parse().unwrap_or(whole / scale)
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn digits_are_rounded_away_from_one() {
        assert_eq!(digits(1.2341, 3, f64::ceil), 1.24);
        assert_eq!(digits(0.12399, 3, f64::floor), 0.123);
        assert_eq!(digits(15.03, 3, f64::ceil), 15.1);
        assert_eq!(digits(1234.5, 3, f64::round), 1230.0);
        assert_eq!(nearest(&[2.0, 4.0], |f| f > 1.5, |f| f > 1.5), Some(1.51));
        assert_eq!(nearest(&[0.5, 0.25], |f| f < 0.4, |f| f < 0.4), Some(0.399));
        assert_eq!(nearest(&[2.0], |_| false, |_| true), None);
    }
}
