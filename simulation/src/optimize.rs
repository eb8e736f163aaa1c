//! The values of some numbers for which a motion costs least, within ranges and limits.
//!
//! Limits are kinks and friction has corners, so that a method without derivatives is used: Nelder and Mead's, of the library
//! `argmin`, on the unit cube of the ranges, begun anew from where it ended until that gains nothing.

use crate::analysis::Analysis;
use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::neldermead::NelderMead;

/// What is to be least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// The energy that the drives give \[J\].
    Energy,
    /// The root of the sum of the squares of all joints' rms forces: what heats drives.
    Rms,
    /// The greatest peak of all joints by its effort limit, or, without limits, by itself.
    Peak,
}

impl Objective {
    /// Every one with its word.
    pub const WORDS: [(&str, Objective); 3] =
        [("energy", Objective::Energy), ("rms", Objective::Rms), ("peak", Objective::Peak)];

    /// Its value for a motion; `efforts` are the joints' effort limits, infinite where there are none.
    pub fn of(self, found: &Analysis, efforts: &[f64]) -> f64 {
        let joints = &found.joints;
        match self {
            Objective::Energy => joints.iter().map(|j| j.given).sum(),
            Objective::Rms => joints.iter().map(|j| j.rms * j.rms).sum::<f64>().sqrt(),
            Objective::Peak => {
                let part = |(j, effort): (&crate::analysis::JointFigures, &f64)| match effort.is_finite() {
                    true => j.peak.0 / effort,
                    false => j.peak.0,
                };
                joints.iter().zip(efforts).map(part).fold(0.0, f64::max)
            }
        }
    }

    /// The same with what exceeded limits cost: so much that no gain outweighs them.
    pub fn with_limits(self, found: &Analysis, efforts: &[f64]) -> f64 {
        let beyond = |v: &crate::analysis::Violation| (v.worst - v.limit).abs() / v.limit.abs().max(1e-9);
        let value = self.of(found, efforts);
        value + (1.0 + value) * 1e3 * found.violations.iter().map(beyond).sum::<f64>()
    }
}

/// A point and what it costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimum {
    /// The values, each within its range.
    pub point: Vec<f64>,
    /// The cost there.
    pub cost: f64,
    /// Evaluations of the cost.
    pub evaluations: u64,
}

/// Rounds of the method, at most.
const ROUNDS: usize = 6;
/// Iterations of a round, at most.
const ITERATIONS: u64 = 300;

/// The least cost within the ranges, each from its lower to its greater end, from the middle of them on; a local minimum.
///
/// # Errors
/// What the library says.
pub fn minimise(cost: impl Fn(&[f64]) -> f64, ranges: &[(f64, f64)]) -> Result<Optimum, String> {
    let inside = |unit: &[f64]| -> Vec<f64> {
        unit.iter().zip(ranges).map(|(u, (low, high))| low + u.clamp(0.0, 1.0) * (high - low)).collect()
    };
    // outside of the cube the cost of its nearest point, and more with the distance
    let of_cube = |unit: &[f64]| {
        let outside: f64 = unit.iter().map(|u| (u - u.clamp(0.0, 1.0)).abs()).sum();
        let inner = cost(&inside(unit));
        if outside == 0.0 {
            inner
        } else {
            inner + (1.0 + inner.abs()) * outside
        }
    };
    let mut best = Optimum { point: vec![0.5; ranges.len()], cost: f64::INFINITY, evaluations: 0 };
    for round in 0..ROUNDS {
        let edge = 0.25 / (1 + round) as f64;
        let corner = |k: usize| {
            let mut corner = best.point.clone();
            corner[k] += if corner[k] > 0.5 { -edge } else { edge };
            corner
        };
        let simplex = std::iter::once(best.point.clone()).chain((0..ranges.len()).map(corner)).collect();
        let solver = NelderMead::new(simplex).with_sd_tolerance(1e-12).map_err(|error| error.to_string())?;
        let run = Executor::new(Cost(&of_cube), solver).configure(|state| state.max_iters(ITERATIONS)).run();
        let state = run.map_err(|error| error.to_string())?.state;
        best.evaluations += state.get_func_counts().get("cost_count").copied().unwrap_or(0);
        let (Some(point), found) = (state.get_best_param(), state.get_best_cost()) else { break };
        let gain = best.cost - found;
        if found < best.cost {
            best.point = point.iter().map(|u| u.clamp(0.0, 1.0)).collect();
            best.cost = found;
        }
        if gain <= 1e-9 * found.abs() {
            break;
        }
    }
    let point = inside(&best.point);
    Ok(Optimum { cost: cost(&point), point, evaluations: best.evaluations })
}

struct Cost<'a>(&'a dyn Fn(&[f64]) -> f64);

impl CostFunction for Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        Ok((self.0)(point))
    }
}
