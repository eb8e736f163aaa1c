//! Motions that excite all parameters of a robot: periodic, within its limits, from rest to rest, of the least condition number that is found.
//!
//! Each joint moves by q = c + Σ a_l (sin lωt − l/N sin Nωt) + b_l (cos lωt − l²/N² cos Nωt), l < N, so that velocity and acceleration vanish at the ends. The logarithm of
//! the condition number of the regressor over a period has the gradient uᵀ (dY) v / σ of its greatest singular value, less that of its least; uᵀ (dY) v comes from the generated
//! program of the regressor, backwards through its operations.

use super::regressor::RegressorModel;
use crate::residual::torques::{evaluated, StateColumns};
use std::f64::consts::{FRAC_PI_2, TAU};
use straightline_core::model::{Joint, Limits};
use straightline_graph::expr::gradient;
use straightline_graph::pass::dead_code;
use straightline_jit::LoadedFunction;
use straightline_logs::condition::MatrixCondition;
use straightline_simulation::optimize::descend;

/// Harmonics of each joint.
const HARMONICS: usize = 8;
/// Coefficients of a joint: its centre, and two of each harmonic but the last.
const PER_JOINT: usize = 1 + 2 * (HARMONICS - 1);
/// Instants of a period at which the regressor is evaluated.
const INSTANTS: usize = 24 * HARMONICS;
/// Random motions that the designed one is held against.
const RANDOM: usize = 31;
/// The best of them from which a search begins.
const STARTS: usize = 3;
/// Searches begin again where they ended, with limits that weigh more.
const WEIGHTS: [f64; 3] = [1.0, 30.0, 1000.0];
/// The part of limits that motions keep to.
const WITHIN: f64 = 0.95;
/// Where a joint has no limits: a quarter turn or so many metres to each side, so many rad/s or m/s.
const NO_LIMITS: [f64; 3] = [FRAC_PI_2, 0.2, 1.5];

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignDemand {
    /// The period \[s\].
    pub duration: f64,
    /// What random motions come from.
    pub seed: u64,
}

/// A motion that excites all parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignedMotion {
    /// Condition number of the regressor over a period, columns in SI units.
    pub condition: f64,
    /// The median of those of random motions of the same form within the same limits.
    pub random: f64,
    /// Joints without a limit of position or velocity, for which one was assumed.
    pub assumed: Vec<String>,
    coefficients: Vec<f64>,
    duration: f64,
}

/// Ranges of joints.
struct JointRoom {
    middle: f64,
    half: f64,
    velocity: f64,
    effort: f64,
}

/// The search.
struct MotionDesign<'a> {
    robot: &'a RegressorModel,
    slopes: [LoadedFunction<f64>; 3],
    rooms: Vec<JointRoom>,
    duration: f64,
}

/// Values and first and second rates at a part of the period of what a joint's coefficients stand for.
fn basis(part: f64, duration: f64) -> [[f64; PER_JOINT]; 3] {
    let w = TAU / duration;
    let mut all = [[0.0; PER_JOINT]; 3];
    all[0][0] = 1.0;
    let most = HARMONICS as f64;
    for l in 1..HARMONICS {
        let n = l as f64;
        let ((s, c), (s1, c1)) = ((TAU * n * part).sin_cos(), (TAU * most * part).sin_cos());
        let share = n / most;
        // in units of what they can come to
        let (of_sine, of_cosine) = (1.0 / (1.0 + share), 1.0 / (1.0 + share * share));
        let sine = [s - share * s1, n * w * (c - c1), -n * w * w * (n * s - most * s1)];
        let cosine = [c - share * share * c1, -n * w * (s - share * s1), -n * n * w * w * (c - c1)];
        for order in 0..3 {
            all[order][2 * l - 1] = sine[order] * of_sine;
            all[order][2 * l] = cosine[order] * of_cosine;
        }
    }
    all
}

/// A motion at parts of the period.
fn motion(coefficients: &[f64], parts: &[f64], duration: f64) -> [StateColumns; 3] {
    let rows: Vec<[[f64; PER_JOINT]; 3]> = parts.iter().map(|part| basis(*part, duration)).collect();
    [0, 1, 2].map(|order| {
        let of_joint = |own: &[f64]| {
            let at = |row: &[[f64; PER_JOINT]; 3]| row[order].iter().zip(own).map(|(f, x)| f * x).sum();
            rows.iter().map(at).collect()
        };
        coefficients.chunks_exact(PER_JOINT).map(of_joint).collect()
    })
}

fn parts(count: usize) -> Vec<f64> {
    (0..count).map(|i| i as f64 / count as f64).collect()
}

impl DesignedMotion {
    /// The motion at a rate \[Hz\] over a period, both ends included: times, and per joint q, q̇ and q̈.
    pub fn sampled(&self, rate: f64) -> (Vec<f64>, [StateColumns; 3]) {
        let count = (self.duration * rate).round().max(1.0);
        let parts: Vec<f64> = (0..=count as usize).map(|i| i as f64 / count).collect();
        (parts.iter().map(|part| part * self.duration).collect(), motion(&self.coefficients, &parts, self.duration))
    }
}

/// Designs a motion.
///
/// # Errors
/// A joint has several coordinates, the robot cannot hold itself within its limits of effort, or no motion tells all parameters apart.
pub fn designed(robot: &RegressorModel, demand: DesignDemand) -> Result<DesignedMotion, String> {
    if let Some(joint) = robot.model.joints().into_iter().find(|joint| !joint.kind.is_single()) {
        return Err(format!("motions are designed for joints of one coordinate, and `{}` has several", joint.name));
    }
    let (rooms, assumed) = rooms(robot);
    let design = MotionDesign::of(robot, rooms, demand.duration);
    let mut random = demand.seed;
    let mut starts: Vec<(f64, Vec<f64>)> = Vec::new();
    for _ in 0..RANDOM {
        let drawn = design.drawn(&mut random);
        let inside = design.inside(drawn).ok_or("the robot cannot hold itself within its limits of effort")?;
        starts.push((design.condition(&inside), inside));
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let median = starts[RANDOM / 2].0;
    let mut best = starts[0].clone();
    for (_, start) in starts.iter().take(STARTS).filter(|(condition, _)| condition.is_finite()) {
        let mut at = start.clone();
        for weight in WEIGHTS {
            let ranges: Vec<(f64, f64)> = design.units().zip(&at).map(|(unit, x)| (x - unit, x + unit)).collect();
            at = descend(|x| design.cost(x, weight), &ranges)?.point;
        }
        let Some(inside) = design.inside(at) else { continue };
        let condition = design.condition(&inside);
        if condition < best.0 {
            best = (condition, inside);
        }
    }
    if !best.0.is_finite() {
        return Err("no motion was found that tells all parameters apart".to_string());
    }
    Ok(DesignedMotion { condition: best.0, random: median, assumed, coefficients: best.1, duration: demand.duration })
}

/// Where joints may be, and the names of those for which something was assumed.
fn rooms(robot: &RegressorModel) -> (Vec<JointRoom>, Vec<String>) {
    let mut assumed = Vec::new();
    let rooms = robot.exact.joints().into_iter().map(|joint| {
        let Limits { lower, upper, velocity, effort } = with_followers(robot, joint);
        let free = if joint.kind.slides() { NO_LIMITS[1] } else { NO_LIMITS[0] };
        let has_range = lower.is_finite() && upper.is_finite() && upper > lower && upper - lower < 2.0 * TAU;
        // zeros are what some files write for none
        let has_velocity = velocity.is_finite() && velocity > 0.0;
        if !has_range || !has_velocity {
            assumed.push(joint.name.clone());
        }
        JointRoom {
            middle: if has_range { 0.5 * (lower + upper) } else { 0.0 },
            half: if has_range { 0.5 * (upper - lower) } else { free },
            velocity: if has_velocity { velocity } else { NO_LIMITS[2] },
            effort: if effort.is_finite() && effort > 0.0 { effort } else { f64::INFINITY },
        }
    });
    (rooms.collect(), assumed)
}

/// The limits of a joint by which it and those that follow it keep theirs.
fn with_followers(robot: &RegressorModel, joint: &Joint) -> Limits {
    let bodies = &robot.model.bodies;
    let followers =
        robot.model.couplings.iter().filter(|c| bodies[c.source].joint.name == joint.name && c.ratio != 0.0);
    followers.fold(joint.limits, |limits, coupling| {
        let own = bodies[coupling.body].joint.limits;
        let [a, b] = [own.lower, own.upper].map(|end| (end - coupling.offset) / coupling.ratio);
        // zeros are what some files write for none
        let has_velocity = own.velocity > 0.0;
        let velocity = if has_velocity { own.velocity / coupling.ratio.abs() } else { f64::INFINITY };
        let most = if limits.velocity > 0.0 { limits.velocity } else { f64::INFINITY };
        Limits {
            lower: limits.lower.max(a.min(b)),
            upper: limits.upper.min(a.max(b)),
            velocity: most.min(velocity),
            ..limits
        }
    })
}

/// A limit, and by how much a number exceeds it: in units of it, with the slope by the number.
fn beyond(x: f64, limit: f64) -> Option<(f64, f64)> {
    let ratio = x.abs() / (WITHIN * limit);
    (ratio > 1.0).then(|| (ratio - 1.0, x.signum() / (WITHIN * limit)))
}

impl<'a> MotionDesign<'a> {
    fn of(robot: &'a RegressorModel, rooms: Vec<JointRoom>, duration: f64) -> MotionDesign<'a> {
        let graph = robot.torque_regressor();
        let slopes = ["q", "qd", "qdd"].map(|of| LoadedFunction::of_graph("slope", &dead_code(&gradient(graph, of))));
        MotionDesign { robot, slopes, rooms, duration }
    }

    /// Coefficients of this size move a joint through its room.
    fn units(&self) -> impl Iterator<Item = f64> + '_ {
        self.rooms.iter().flat_map(|room| (0..PER_JOINT).map(|k| if k == 0 { 0.3 * room.half } else { room.half }))
    }

    /// Coefficients by chance.
    fn drawn(&self, random: &mut u64) -> Vec<f64> {
        let mut next = || {
            *random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let mut found: Vec<f64> = self.units().map(|unit| unit * next()).collect();
        found.chunks_exact_mut(PER_JOINT).zip(&self.rooms).for_each(|(own, room)| own[0] += room.middle);
        found
    }

    /// The same motion, smaller and closer to the middle until it is within all limits; `None` where efforts are not even then.
    fn inside(&self, mut coefficients: Vec<f64>) -> Option<Vec<f64>> {
        let parts = parts(4 * INSTANTS);
        for (own, room) in coefficients.chunks_exact_mut(PER_JOINT).zip(&self.rooms) {
            let limit = WITHIN * room.half;
            own[0] = own[0].clamp(room.middle - 0.9 * limit, room.middle + 0.9 * limit);
            let [q, qd, _] = motion(own, &parts, self.duration);
            let most = |column: &[f64], about: f64| column.iter().fold(0.0, |most: f64, x| most.max((x - about).abs()));
            let position = (limit - (own[0] - room.middle).abs()) / most(&q[0], own[0]).max(f64::MIN_POSITIVE);
            let velocity = WITHIN * room.velocity / most(&qd[0], 0.0).max(f64::MIN_POSITIVE);
            let scale = position.min(velocity).min(1.0);
            own[1..].iter_mut().for_each(|x| *x *= scale);
        }
        for _ in 0..40 {
            let states = motion(&coefficients, &parts, self.duration);
            let torques = self.torques(&self.regressor(&states, parts.len()), parts.len());
            let is_inside = torques
                .iter()
                .enumerate()
                .all(|(k, tau)| beyond(*tau, self.rooms[k % self.rooms.len()].effort).is_none());
            if is_inside {
                return Some(coefficients);
            }
            for (own, room) in coefficients.chunks_exact_mut(PER_JOINT).zip(&self.rooms) {
                own[0] = room.middle + 0.9 * (own[0] - room.middle);
                own[1..].iter_mut().for_each(|x| *x *= 0.9);
            }
        }
        None
    }

    /// Rows of the regressor, state by state.
    fn regressor(&self, [q, qd, qdd]: &[StateColumns; 3], count: usize) -> Vec<f64> {
        let by_entry = self.robot.torque_rows([q, qd, qdd], count);
        let entries = by_entry.len() / count;
        (0..count).flat_map(|s| (0..entries).map(move |e| (s, e))).map(|(s, e)| by_entry[e * count + s]).collect()
    }

    /// Efforts by the robot file, state by state.
    fn torques(&self, rows: &[f64], count: usize) -> Vec<f64> {
        let columns = rows.len() / (count * self.rooms.len());
        rows.chunks_exact(columns).map(|row| row.iter().zip(&self.robot.nominal).map(|(y, x)| y * x).sum()).collect()
    }

    fn condition(&self, coefficients: &[f64]) -> f64 {
        let rows = self.regressor(&motion(coefficients, &parts(INSTANTS), self.duration), INSTANTS);
        MatrixCondition::of(&rows, self.robot.nominal.len()).map_or(f64::INFINITY, |found| found.number())
    }

    /// The logarithm of the condition number, and what limits are exceeded, with the gradient by the coefficients.
    fn cost(&self, coefficients: &[f64], weight: f64) -> (f64, Vec<f64>) {
        let (parts, joints, columns) = (parts(INSTANTS), self.rooms.len(), self.robot.nominal.len());
        let states = motion(coefficients, &parts, self.duration);
        let rows = self.regressor(&states, INSTANTS);
        let Some(found) = MatrixCondition::of(&rows, columns) else {
            // far above all that are, without a slope that would lead on
            return (100.0, vec![0.0; coefficients.len()]);
        };
        let mut value = found.number().ln();
        let each = weight / INSTANTS as f64;
        let mut seeds = vec![0.0; INSTANTS * joints * columns];
        for (row, (own, tau)) in seeds.chunks_exact_mut(columns).zip(self.torques(&rows, INSTANTS)).enumerate() {
            for (c, seed) in own.iter_mut().enumerate() {
                *seed = found.left[0][row] * found.right[0][c] / found.values[0]
                    - found.left[1][row] * found.right[1][c] / found.values[1];
            }
            if let Some((over, slope)) = beyond(tau, self.rooms[row % joints].effort) {
                value += each * over * over;
                own.iter_mut().zip(&self.robot.nominal).for_each(|(seed, x)| *seed += 2.0 * each * over * slope * x);
            }
        }
        let mut slopes = self.slopes_of(&states, &seeds);
        for (j, room) in self.rooms.iter().enumerate() {
            for s in 0..INSTANTS {
                let limits = [(states[0][j][s] - room.middle, room.half), (states[1][j][s], room.velocity)];
                for (order, (x, limit)) in limits.into_iter().enumerate() {
                    if let Some((over, slope)) = beyond(x, limit) {
                        value += each * over * over;
                        slopes[order][j * INSTANTS + s] += 2.0 * each * over * slope;
                    }
                }
            }
        }
        let mut gradient = vec![0.0; coefficients.len()];
        for (s, part) in parts.iter().enumerate() {
            for (order, row) in basis(*part, self.duration).iter().enumerate() {
                for (j, own) in gradient.chunks_exact_mut(PER_JOINT).enumerate() {
                    let slope = slopes[order][j * INSTANTS + s];
                    own.iter_mut().zip(row).for_each(|(g, f)| *g += slope * f);
                }
            }
        }
        (value, gradient)
    }

    /// Σ seed ∂Y by q, q̇ and q̈: joint by joint a number per state.
    fn slopes_of(&self, [q, qd, qdd]: &[StateColumns; 3], seeds: &[f64]) -> [Vec<f64>; 3] {
        let entries = seeds.len() / INSTANTS;
        let by_entry: StateColumns =
            (0..entries).map(|e| (0..INSTANTS).map(|s| seeds[s * entries + e]).collect()).collect();
        self.slopes.each_ref().map(|function| evaluated(function, &[q, qd, qdd, &by_entry], 0..INSTANTS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use straightline_codegen::diagnostic::Source;
    use straightline_codegen::options::Options;

    /// Within limits and beyond them, against central differences.
    #[test]
    fn the_gradient_is_that_of_differences() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/descriptions/planar_2r.toml");
        let source = Source::new(path, std::fs::read_to_string(path).expect("the robot file"));
        let robot = RegressorModel::load(&source, &Options::default()).expect("the robot can be loaded");
        let (mut rooms, _) = rooms(&robot);
        rooms.iter_mut().for_each(|room| (room.velocity, room.effort) = (2.0, 12.0));
        let design = MotionDesign::of(&robot, rooms, 4.0);
        let at = design.drawn(&mut 7);
        let (value, found) = design.cost(&at, 10.0);
        assert!(value > design.condition(&at).ln() + 1e-3, "limits are exceeded: {value}");
        for (k, found) in found.iter().enumerate() {
            let h = 1e-5;
            let shifted = |by: f64| {
                let mut at = at.clone();
                at[k] += by;
                design.cost(&at, 10.0).0
            };
            let wanted = (shifted(h) - shifted(-h)) / (2.0 * h);
            assert!((found - wanted).abs() < 1e-5 * (1.0 + wanted.abs()), "{k}: {found} {wanted}");
        }
    }
}
