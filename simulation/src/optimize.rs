//! The values of some numbers for which a motion costs least, within ranges and limits.
//!
//! First down the gradient, which generated programs give: L-BFGS with More and Thuente's line search (Nocedal and Wright 2006, chapters 3
//! and 7), each number as the sine of an unbounded one within its range. Limits are kinks and friction has corners, on which that may end
//! early, so that a method without derivatives goes on from there: Nelder and Mead's, on the unit cube of the ranges, begun anew from
//! where it ended until that gains nothing. Both are of the library `argmin`.

use crate::analysis::Analysis;
use crate::drive_analysis::DriveFigures;
use crate::quadrature;
use argmin::core::{CostFunction, Error, Executor, Gradient, State};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::neldermead::NelderMead;
use argmin::solver::quasinewton::LBFGS;
use std::cell::{Cell, RefCell};

/// What is to be least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// The energy that the drives give \[J\].
    Energy,
    /// The root of the sum of the squares of all joints' rms forces: what heats drives.
    Rms,
    /// The greatest peak of all joints by its effort limit, or, without limits, by itself.
    Peak,
    /// The energy that drives take from their supplies \[J\].
    Electrical,
    /// Joule heat in the drives' windings \[J\].
    Heat,
}

impl Objective {
    /// Every one with its word.
    pub const WORDS: [(&str, Objective); 5] = [
        ("energy", Objective::Energy),
        ("rms", Objective::Rms),
        ("peak", Objective::Peak),
        ("electrical", Objective::Electrical),
        ("heat", Objective::Heat),
    ];

    /// Whether it is one of drives, which takes their figures.
    pub fn is_of_drives(self) -> bool {
        matches!(self, Objective::Electrical | Objective::Heat)
    }

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
            Objective::Electrical => of_drives(found, |d| d.energy.0),
            Objective::Heat => of_drives(found, |d| d.joule),
        }
    }

    /// The same with what exceeded limits cost: so much that no gain outweighs them.
    pub fn with_limits(self, found: &Analysis, efforts: &[f64]) -> f64 {
        let beyond = |v: &crate::analysis::Violation| (v.worst - v.limit).abs() / v.limit.abs().max(1e-9);
        let value = self.of(found, efforts);
        value + (1.0 + value) * PENALTY * found.violations.iter().map(beyond).sum::<f64>()
    }
}

/// A sum over all drives; infinite where there are no figures of any.
fn of_drives(found: &Analysis, figure: impl Fn(&DriveFigures) -> f64) -> f64 {
    found.drives.as_ref().map_or(f64::INFINITY, |drives| drives.drives.iter().map(figure).sum())
}

/// A motion at instants, with torques of all joints: what an objective is made of.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<'a> {
    /// Times \[s\], not falling.
    pub times: &'a [f64],
    /// q̇ at these.
    pub qd: &'a [Vec<f64>],
    /// τ at these.
    pub tau: &'a [Vec<f64>],
    /// Effort limits of the joints, infinite where there are none.
    pub efforts: &'a [f64],
}

impl Objective {
    /// [`with_limits`](Objective::with_limits), of limits those of effort, from samples, and its derivative by every τ. At a kink that of
    /// one side. Of objectives of drives, which torques alone do not give, only what exceeded limits cost.
    pub fn with_slopes(self, s: Sampled) -> (f64, Vec<Vec<f64>>) {
        let (m, n) = (s.times.len(), s.efforts.len());
        let duration = s.times[m - 1] - s.times[0];
        // of the integrals that an analysis forms
        let weights = quadrature::weights(s.times);
        let weight = |k: usize| weights[k];
        let mut slopes = vec![vec![0.0; n]; m];
        let samples = || (0..m).flat_map(|k| (0..n).map(move |j| (k, j)));
        let value = match self {
            Objective::Energy => samples().fold(0.0, |sum, (k, j)| {
                let power = s.tau[k][j] * s.qd[k][j];
                slopes[k][j] = if power > 0.0 { weight(k) * s.qd[k][j] } else { 0.0 };
                sum + weight(k) * power.max(0.0)
            }),
            Objective::Rms => {
                let squares: f64 = samples().map(|(k, j)| weight(k) * s.tau[k][j] * s.tau[k][j]).sum();
                let value = (squares / duration).sqrt();
                if value > 0.0 {
                    samples().for_each(|(k, j)| slopes[k][j] = weight(k) * s.tau[k][j] / (duration * value));
                }
                value
            }
            Objective::Peak => {
                let scale = |j: usize| if s.efforts[j].is_finite() { s.efforts[j] } else { 1.0 };
                let part = |(k, j): (usize, usize)| s.tau[k][j].abs() / scale(j);
                let worst = samples().max_by(|a, b| part(*a).total_cmp(&part(*b)));
                worst.map_or(0.0, |(k, j)| {
                    slopes[k][j] = s.tau[k][j].signum() / scale(j);
                    part((k, j))
                })
            }
            Objective::Electrical | Objective::Heat => 0.0,
        };
        let mut beyond = 0.0;
        let mut of_limits = Vec::new();
        for (j, effort) in s.efforts.iter().enumerate().filter(|(_, effort)| effort.is_finite()) {
            for sign in [1.0, -1.0] {
                let side = |k: &usize| sign * s.tau[*k][j];
                let Some(k) = (0..m).max_by(|a, b| side(a).total_cmp(&side(b))) else { continue };
                if side(&k) > effort * (1.0 + 1e-12) {
                    beyond += (side(&k) - effort) / effort.max(1e-9);
                    of_limits.push((k, j, sign / effort.max(1e-9)));
                }
            }
        }
        slopes.iter_mut().flatten().for_each(|slope| *slope *= 1.0 + PENALTY * beyond);
        of_limits.into_iter().for_each(|(k, j, slope)| slopes[k][j] += (1.0 + value) * PENALTY * slope);
        (value + (1.0 + value) * PENALTY * beyond, slopes)
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

/// What it costs, beside the value itself, to be beyond a limit by all of it.
const PENALTY: f64 = 1e3;
/// Steps down the gradient, at most.
const STEPS: u64 = 60;
/// Rounds of the method, at most.
const ROUNDS: usize = 6;
/// Iterations of a round, at most.
const ITERATIONS: u64 = 300;

/// Down the gradient from the middle of the ranges, each from its lower to its greater end. `cost` gives value and gradient; what it
/// costs at the end, and how often it was asked.
///
/// # Errors
/// What the library says.
pub fn descend(cost: impl Fn(&[f64]) -> (f64, Vec<f64>), ranges: &[(f64, f64)]) -> Result<Optimum, String> {
    let inside = |z: &[f64]| -> Vec<f64> {
        z.iter().zip(ranges).map(|(z, (low, high))| low + 0.5 * (1.0 + z.sin()) * (high - low)).collect()
    };
    let slope = |z: &[f64], gradient: &[f64]| -> Vec<f64> {
        let of = |((z, (low, high)), g): ((&f64, &(f64, f64)), &f64)| 0.5 * z.cos() * (high - low) * g;
        z.iter().zip(ranges).zip(gradient).map(of).collect()
    };
    let asked = Cell::new(0);
    // the library asks for the value and for the gradient of the same point, one after the other
    let last: RefCell<Option<KnownPoint>> = RefCell::new(None);
    let of_unbounded = |z: &[f64]| {
        let mut last = last.borrow_mut();
        if let Some((_, found)) = last.as_ref().filter(|(at, _)| at == z) {
            return found.clone();
        }
        asked.set(asked.get() + 1);
        let (value, gradient) = cost(&inside(z));
        let found = (value, slope(z, &gradient));
        *last = Some((z.to_vec(), found.clone()));
        found
    };
    let start = vec![0.0; ranges.len()];
    let (first, _) = cost(&inside(&start));
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), 7);
    let solver = solver.with_tolerance_grad(1e-9 * first.abs().max(1e-9)).map_err(|error| error.to_string())?;
    let configured = |state: argmin::core::IterState<_, _, _, _, _, _>| state.param(start.clone()).max_iters(STEPS);
    let run = Executor::new(CostSlope(&of_unbounded), solver).configure(configured).run();
    // where the line search finds no way on there may be a kink: then the start counts, and another method goes on
    let Ok(run) = run else { return Ok(Optimum { point: inside(&start), cost: first, evaluations: asked.get() }) };
    let (state, evaluations) = (run.state, asked.get());
    let point = state.get_best_param().map_or_else(|| inside(&start), |z| inside(z));
    Ok(Optimum { cost: cost(&point).0, point, evaluations })
}

/// A point, and the cost there with its gradient.
type KnownPoint = (Vec<f64>, (f64, Vec<f64>));

/// A cost with its gradient.
type WithGradient<'a> = dyn Fn(&[f64]) -> (f64, Vec<f64>) + 'a;

struct CostSlope<'a>(&'a WithGradient<'a>);

impl CostFunction for CostSlope<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        Ok((self.0)(point).0)
    }
}

impl Gradient for CostSlope<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;
    fn gradient(&self, point: &Vec<f64>) -> Result<Vec<f64>, Error> {
        Ok((self.0)(point).1)
    }
}

/// The least cost within the ranges, each from its lower to its greater end, from the middle of them on; a local minimum.
///
/// # Errors
/// What the library says.
pub fn minimise(cost: impl Fn(&[f64]) -> f64, ranges: &[(f64, f64)]) -> Result<Optimum, String> {
    let middle: Vec<f64> = ranges.iter().map(|(low, high)| 0.5 * (low + high)).collect();
    minimise_from(cost, ranges, &middle, 0.25)
}

/// The minimum that is found from a point on, which the first simplex leaves by so much of each range.
///
/// # Errors
/// As [`minimise`], or no cost was found that is a finite number.
pub fn minimise_from(
    cost: impl Fn(&[f64]) -> f64,
    ranges: &[(f64, f64)],
    start: &[f64],
    reach: f64,
) -> Result<Optimum, String> {
    let inside = |unit: &[f64]| -> Vec<f64> {
        unit.iter().zip(ranges).map(|(u, (low, high))| low + u.clamp(0.0, 1.0) * (high - low)).collect()
    };
    // outside of the cube the cost of its nearest point, and more with the distance
    let asked = Cell::new(0);
    let of_cube = |unit: &[f64]| {
        asked.set(asked.get() + 1);
        let outside: f64 = unit.iter().map(|u| (u - u.clamp(0.0, 1.0)).abs()).sum();
        let inner = cost(&inside(unit));
        // what is no number compares with nothing, and is no better than anything
        let inner = if inner.is_nan() { f64::INFINITY } else { inner };
        if outside == 0.0 {
            inner
        } else {
            inner + (1.0 + inner.abs()) * outside
        }
    };
    let unit = start.iter().zip(ranges).map(|(x, (low, high))| ((x - low) / (high - low)).clamp(0.0, 1.0));
    let mut best = Optimum { point: unit.collect(), cost: f64::INFINITY, evaluations: 0 };
    for round in 0..ROUNDS {
        let edge = reach / (1 + round) as f64;
        let corner = |k: usize| {
            let mut corner = best.point.clone();
            corner[k] += if corner[k] > 0.5 { -edge } else { edge };
            corner
        };
        let simplex = std::iter::once(best.point.clone()).chain((0..ranges.len()).map(corner)).collect();
        let solver = NelderMead::new(simplex).with_sd_tolerance(1e-12).map_err(|error| error.to_string())?;
        let run = Executor::new(MotionCost(&of_cube), solver).configure(|state| state.max_iters(ITERATIONS)).run();
        let state = run.map_err(|error| error.to_string())?.state;
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
    let cost = cost(&point);
    match cost.is_finite() {
        true => Ok(Optimum { cost, point, evaluations: asked.get() }),
        false => Err(format!("what is to be least is {cost}, not a finite number, wherever it was looked for")),
    }
}

struct MotionCost<'a>(&'a dyn Fn(&[f64]) -> f64);

impl CostFunction for MotionCost<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        Ok((self.0)(point))
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn slopes_are_those_of_differences() {
        let times = [0.0, 0.1, 0.3, 0.3, 0.7];
        let qd: Vec<Vec<f64>> = (0..5).map(|k| vec![(k as f64).sin() - 0.3, 0.5 - 0.2 * k as f64]).collect();
        let tau: Vec<Vec<f64>> = (0..5).map(|k| vec![2.0 * (1.3 * k as f64).cos(), 0.7 * k as f64 - 1.1]).collect();
        for objective in Objective::WORDS.map(|w| w.1) {
            // without limits, with both joints beyond theirs, and with one
            for efforts in [[f64::INFINITY; 2], [1.5, 1.0], [5.0, 1.2]] {
                let at = |tau: &[Vec<f64>]| {
                    objective.with_slopes(Sampled { times: &times, qd: &qd, tau, efforts: &efforts })
                };
                let (value, slopes) = at(&tau);
                for k in 0..5 {
                    for j in 0..2 {
                        let moved = |h: f64| {
                            let mut tau = tau.clone();
                            tau[k][j] += h;
                            at(&tau).0
                        };
                        let expected = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                        // rounding of the value by the step, and the step by itself
                        let allowed = 1e-9 * value + 1e-5 * expected.abs() + 1e-9;
                        let apart = (slopes[k][j] - expected).abs();
                        assert!(apart < allowed, "{objective:?} {efforts:?} {k} {j}: {} and {expected}", slopes[k][j]);
                    }
                }
            }
        }
    }

    pub fn it_goes_down_into_a_valley_and_to_the_end_of_a_range() {
        // Rosenbrock's valley, with the minimum at (1, 1)
        let valley = |x: &[f64]| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            (a * a + 100.0 * b * b, vec![-2.0 * a - 400.0 * b * x[0], 200.0 * b])
        };
        let found = descend(valley, &[(-1.5, 2.0), (-1.0, 3.0)]).expect("it is smooth");
        assert!(found.cost < 1e-6 && (found.point[0] - 1.0).abs() < 1e-2, "{found:?}");
        let slope = |x: &[f64]| (2.0 * x[0], vec![2.0]);
        let found = descend(slope, &[(0.5, 6.0)]).expect("it is smooth");
        assert!((found.point[0] - 0.5).abs() < 1e-3, "{found:?}");
        // with a kink in the way another method goes on
        let kink = |x: &[f64]| ((x[0] - 3.0).abs(), vec![(x[0] - 3.0).signum()]);
        let first = descend(kink, &[(0.5, 6.0)]).expect("it ends");
        let found = minimise_from(|x| kink(x).0, &[(0.5, 6.0)], &first.point, 0.02).expect("it ends");
        assert!((found.point[0] - 3.0).abs() < 1e-6, "{found:?}");
    }

    pub fn what_has_no_finite_cost_has_no_optimum() {
        for cost in [f64::INFINITY, f64::NAN] {
            let why = minimise(|_| cost, &[(0.0, 1.0), (2.0, 3.0)]).expect_err("none is best");
            assert!(why.contains("not a finite number"), "{why}");
        }
    }
}
