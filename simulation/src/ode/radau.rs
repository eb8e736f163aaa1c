//! The implicit Runge-Kutta method Radau IIA of order 5 with three stages, L-stable: RADAU5 of Hairer and Wanner (Solving Ordinary
//! Differential Equations II, 1996, section IV.8), any number of states.
//!
//! The stages zᵢ = Yᵢ − y follow from simplified Newton steps, transformed so that one real and one complex system of the size of the state
//! are left. The Jacobian is found by differences; of what it couples, only the core is factorised: a state whose rate is another
//! state (q̇) follows from that one, and what nothing depends on (work, heat) follows from all others.

use super::{root_mean_square, AcceptedStep, Piece, Solved, Watch};
use crate::simulate::Failure;
use nalgebra::{Complex, ComplexField, DMatrix, DVector, Dyn, LU};

/// √6.
const ROOT: f64 = 2.449_489_742_783_178;
/// Nodes.
const C: [f64; 2] = [(4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0];
/// Weights of the error estimate.
const ERROR: [f64; 3] = [-(13.0 + 7.0 * ROOT) / 3.0, (-13.0 + 7.0 * ROOT) / 3.0, -1.0 / 3.0];
/// The inverse of the method's matrix has the eigenvalues γ and α ± i β.
const GAMMA: f64 = 3.637_834_252_744_496;
const ALPHA: f64 = 2.681_082_873_627_752;
const BETA: f64 = 3.050_430_199_247_411;
/// To the basis in which it is diagonal, and back.
const T: [[f64; 3]; 3] = [
    [9.123_239_487_089_295e-2, -1.412_552_950_209_542e-1, -3.002_919_410_514_742_4e-2],
    [2.417_179_327_071_07e-1, 2.041_293_522_937_999_4e-1, 3.829_421_127_572_619e-1],
    [9.660_481_826_150_93e-1, 1.0, 0.0],
];
const T_INVERSE: [[f64; 3]; 3] = [
    [4.325_579_890_063_155, 3.391_992_518_158_098_4e-1, 5.417_705_399_358_749e-1],
    [-4.178_718_591_551_905, -3.276_828_207_610_623_7e-1, 4.766_235_545_005_504_4e-1],
    [-5.028_726_349_457_868e-1, 2.571_926_949_855_605, -5.960_392_048_282_249e-1],
];
/// Newton steps, at most.
const NEWTON: usize = 7;
/// The Jacobian is kept while Newton's method converges faster than this.
const KEEPS: f64 = 1e-3;
const SAFETY: f64 = 0.9;

/// Where a state depends on others in a simple way.
struct Pattern {
    /// What is factorised.
    core: Vec<usize>,
    /// (i, j, c): the rate of i is c times state j, which is in the core.
    followers: Vec<(usize, usize, f64)>,
    /// What no rate depends on.
    sums: Vec<usize>,
}

/// ∂f/∂y, row after row.
struct SystemJacobian {
    entries: Vec<f64>,
    n: usize,
    pattern: Pattern,
}

impl SystemJacobian {
    /// By differences; `None` where a rate is not finite.
    fn new(piece: &Piece, t: f64, y: &[f64], rate: &[f64]) -> Option<SystemJacobian> {
        let n = y.len();
        let mut entries = vec![0.0; n * n];
        let (mut moved, mut there) = (y.to_vec(), vec![0.0; n]);
        for j in 0..n {
            // a difference of the state that is no rounded number
            moved[j] = y[j] + (f64::EPSILON * y[j].abs().max(1e-5)).sqrt();
            let mut step = moved[j] - y[j];
            if !piece.rate(t, &moved, &mut there) {
                moved[j] = y[j] - step;
                step = moved[j] - y[j];
                if !piece.rate(t, &moved, &mut there) {
                    return None;
                }
            }
            moved[j] = y[j];
            (0..n).for_each(|i| entries[i * n + j] = (there[i] - rate[i]) / step);
        }
        let pattern = Pattern::new(&entries, n);
        Some(SystemJacobian { entries, n, pattern })
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.n + j]
    }

    /// γ E − J, of the core, with what follows put in; factorised. `None` if it is singular.
    fn factor<F: ComplexField<RealField = f64>>(&self, gamma: F) -> Option<Factor<F>> {
        let Pattern { core, followers, .. } = &self.pattern;
        let place = |state: usize| core.binary_search(&state).ok();
        let mut matrix = DMatrix::from_fn(core.len(), core.len(), |a, b| F::from_real(-self.at(core[a], core[b])));
        for a in 0..core.len() {
            matrix[(a, a)] += gamma.clone();
        }
        for (i, j, c) in followers {
            let Some(b) = place(*j) else { continue };
            for (a, row) in core.iter().enumerate() {
                let through = self.at(*row, *i) * c;
                if through != 0.0 {
                    matrix[(a, b)] -= F::from_real(through) / gamma.clone();
                }
            }
        }
        let lu = matrix.lu();
        lu.is_invertible().then_some(Factor { lu, gamma })
    }

    /// Solves (γ E − J) z = r, in place.
    fn solve<F: ComplexField<RealField = f64>>(&self, factor: &Factor<F>, z: &mut [F]) {
        let Pattern { core, followers, sums } = &self.pattern;
        let gamma = &factor.gamma;
        let mut right = DVector::from_fn(core.len(), |a, _| z[core[a]].clone());
        for (i, ..) in followers {
            let direct = z[*i].clone() / gamma.clone();
            for (a, row) in core.iter().enumerate() {
                let entry = self.at(*row, *i);
                if entry != 0.0 {
                    right[a] += direct.clone() * F::from_real(entry);
                }
            }
        }
        // the factor was tested when it was made
        factor.lu.solve_mut(&mut right);
        core.iter().enumerate().for_each(|(a, row)| z[*row] = right[a].clone());
        for (i, j, c) in followers {
            z[*i] = (z[*i].clone() + z[*j].clone() * F::from_real(*c)) / gamma.clone();
        }
        for s in sums {
            let mut sum = z[*s].clone();
            for j in core.iter().chain(followers.iter().map(|(i, ..)| i)) {
                let entry = self.at(*s, *j);
                if entry != 0.0 {
                    sum += z[*j].clone() * F::from_real(entry);
                }
            }
            z[*s] = sum / gamma.clone();
        }
    }
}

struct Factor<F: ComplexField> {
    lu: LU<F, Dyn, Dyn>,
    gamma: F,
}

impl Pattern {
    fn new(entries: &[f64], n: usize) -> Pattern {
        let at = |i: usize, j: usize| entries[i * n + j];
        let sums: Vec<usize> = (0..n).filter(|j| (0..n).all(|i| at(i, *j) == 0.0)).collect();
        let (mut followers, mut leads, mut follows) = (Vec::new(), vec![false; n], vec![false; n]);
        for i in (0..n).filter(|i| sums.binary_search(i).is_err()) {
            let mut nonzero = (0..n).filter(|j| at(i, *j) != 0.0);
            if let (Some(j), None) = (nonzero.next(), nonzero.next()) {
                if j != i && !follows[j] && !leads[i] {
                    followers.push((i, j, at(i, j)));
                    (leads[j], follows[i]) = (true, true);
                }
            }
        }
        let core = (0..n).filter(|i| !follows[*i] && sums.binary_search(i).is_err()).collect();
        Pattern { core, followers, sums }
    }
}

/// What stays from step to step.
struct Stages {
    z: [Vec<f64>; 3],
    /// z in the basis in which the method is diagonal.
    w: [Vec<f64>; 3],
}

/// Integrates until the end or until someone who watches stops it. One loop, longer than 80 lines: acceptance, step length, Jacobian and
/// factors are decided by one another, and what a part of it would take and give back is longer than the part.
pub(super) fn integrate(
    piece: &Piece,
    watch: &mut dyn Watch,
    state: &[f64],
    mut rate: Vec<f64>,
) -> Result<Solved, Failure> {
    let n = state.len();
    // the error estimate is of order 3: asked for so much, the result is about as good as the tolerance says (RADAU5)
    let tolerance = 0.1 * piece.settings.tolerance.powf(2.0 / 3.0);
    let newton_tolerance = (10.0 * f64::EPSILON / tolerance).max(tolerance.sqrt().min(0.03));
    let scales = |y: &[f64]| -> Vec<f64> { y.iter().map(|y| piece.scale(tolerance, *y)).collect() };
    let (mut t, mut y) = (piece.start, state.to_vec());
    let mut scale = scales(&y);
    let carried = piece.pace.next.get().map(|h| h.min(piece.most()));
    let mut h = carried.unwrap_or_else(|| piece.first_step(5.0, tolerance, &y, &rate));
    let mut stages = Stages { z: [0; 3].map(|_| vec![0.0; n]), w: [0; 3].map(|_| vec![0.0; n]) };
    let mut jacobian: Option<SystemJacobian> = None;
    // factors with the step that they are for
    let mut factors: Option<(f64, Factor<f64>, Factor<Complex<f64>>)> = None;
    let mut is_new = false;
    let (mut accepted, mut was_rejected, mut extrapolates) = (0, false, true);
    // the step before: its length, its error and its stages
    let mut before: Option<(f64, f64, [Vec<f64>; 3])> = None;
    let mut convergence = 1.0f64;
    while t < piece.end {
        piece.pace.count(t)?;
        let left = piece.end - t;
        let is_last = h >= left * (1.0 - 1e-12);
        if piece.vanishes(h) && !is_last {
            if was_rejected {
                return Err(piece.no_step(t));
            }
            h = piece.least();
            was_rejected = true;
            continue;
        }
        let h_now = if is_last { left } else { h };
        // half the step, with a Jacobian of this state
        let shorter = |factor: f64, h: &mut f64, was_rejected: &mut bool| -> Result<(), Failure> {
            if is_last && piece.vanishes(h_now) {
                return Err(piece.no_step(t));
            }
            (*h, *was_rejected) = (h_now * factor, true);
            Ok(())
        };
        if jacobian.is_none() {
            jacobian = SystemJacobian::new(piece, t, &y, &rate);
            (is_new, factors) = (true, None);
        }
        let Some(j) = &jacobian else { return Err(piece.not_finite(t)) };
        if factors.as_ref().is_none_or(|(of, ..)| *of != h_now) {
            let real = j.factor(GAMMA / h_now);
            let complex = j.factor(Complex::new(ALPHA / h_now, BETA / h_now));
            let Some((real, complex)) = real.zip(complex) else {
                shorter(0.5, &mut h, &mut was_rejected)?;
                jacobian = jacobian.filter(|_| is_new);
                continue;
            };
            factors = Some((h_now, real, complex));
        }
        let Some((_, real, complex)) = &factors else { continue };
        let t_new = if is_last { piece.end } else { t + h_now };
        predict(&mut stages, before.as_ref().filter(|_| extrapolates).map(|(h, _, z)| (h_now / h, z)));
        let newton =
            newton(piece, (t, h_now), &y, (j, real, complex), &mut stages, (&scale, newton_tolerance), convergence);
        let (iterations, rate_of_convergence) = match newton {
            Newton::Converges { iterations, theta, eta } => {
                convergence = eta;
                (iterations, theta)
            }
            Newton::Fails { factor } => {
                shorter(factor, &mut h, &mut was_rejected)?;
                jacobian = jacobian.filter(|_| is_new);
                (extrapolates, convergence) = (false, 1.0);
                continue;
            }
        };
        let is_hard = before.is_none() || was_rejected;
        let error = error(piece, (t, h_now), (&y, &rate), (j, real), &stages.z, &scale, is_hard);
        // (8.21): a little less the more Newton steps it took
        let safety = SAFETY.min(SAFETY * (1 + 2 * NEWTON) as f64 / (iterations + 2 * NEWTON) as f64);
        let mut quotient = (error.powf(0.25) / safety).clamp(0.125, 5.0);
        let new: Vec<f64> = y.iter().zip(&stages.z[2]).map(|(y, z)| y + z).collect();
        let mut rate_new = vec![0.0; n];
        if error >= 1.0 || !piece.rate(t_new, &new, &mut rate_new) {
            let factor = if before.is_none() { 0.1 } else { 1.0 / quotient.max(1.1) };
            shorter(factor, &mut h, &mut was_rejected)?;
            jacobian = jacobian.filter(|_| is_new);
            continue;
        }
        accepted += 1;
        piece.check(t_new, &new)?;
        if let Some((h_before, error_before, _)) = &before {
            // Gustafsson's controller
            let predicted = (h_before / h_now) * (error * error / error_before).powf(0.25) / SAFETY;
            quotient = quotient.max(predicted.clamp(0.125, 5.0));
        }
        let [z1, z2, z3] = &stages.z;
        let within = |at: f64| {
            let s = (at - t) / h_now;
            (0..n).map(|i| y[i] + collocation(s, [z1[i], z2[i], z3[i]])).collect()
        };
        let step = AcceptedStep { t_before: t, t: t_new, y_before: &y, y: &new, within: &within };
        let is_interrupted = watch.step(&step).is_break();
        before = Some((h_now, error.max(1e-2), stages.z.clone()));
        let mut h_new = h_now / quotient;
        if was_rejected {
            h_new = h_new.min(h_now);
        }
        // a step that the end has cut says nothing against longer ones
        h_new = h_new.max(if h_now < h && !was_rejected { h } else { 0.0 });
        piece.pace.next.set(Some(h_new));
        if is_interrupted {
            return Ok(piece.solved(new, accepted));
        }
        (was_rejected, extrapolates) = (false, true);
        (t, y, rate) = (t_new, new, rate_new);
        scale = scales(&y);
        let keeps = rate_of_convergence <= KEEPS;
        if !keeps {
            jacobian = None;
        }
        is_new = false;
        // a little longer is not worth another factorisation
        h = if keeps && (1.0..=1.2).contains(&(h_new / h_now)) { h_now } else { h_new.min(piece.most()) };
    }
    Ok(piece.solved(y, accepted))
}

/// Starting values of the stages: the polynomial of the step before, gone on with.
fn predict(stages: &mut Stages, before: Option<(f64, &[Vec<f64>; 3])>) {
    let n = stages.z[0].len();
    for i in 0..n {
        let z = before.map_or([0.0; 3], |(ratio, z)| {
            let z = [z[0][i], z[1][i], z[2][i]];
            [C[0], C[1], 1.0].map(|c| collocation(1.0 + c * ratio, z) - z[2])
        });
        for k in 0..3 {
            stages.z[k][i] = z[k];
            stages.w[k][i] = (0..3).map(|l| T_INVERSE[k][l] * z[l]).sum();
        }
    }
}

/// The polynomial of degree 3 that is zero at 0 and zᵢ at the nodes.
fn collocation(s: f64, z: [f64; 3]) -> f64 {
    let [c1, c2] = C;
    s * (z[0] * (s - c2) * (s - 1.0) / (c1 * (c1 - c2) * (c1 - 1.0))
        + z[1] * (s - c1) * (s - 1.0) / (c2 * (c2 - c1) * (c2 - 1.0))
        + z[2] * (s - c1) * (s - c2) / ((1.0 - c1) * (1.0 - c2)))
}

enum Newton {
    Converges { iterations: usize, theta: f64, eta: f64 },
    Fails { factor: f64 },
}

/// Simplified Newton steps.
fn newton(
    piece: &Piece,
    (t, h): (f64, f64),
    y: &[f64],
    (jacobian, real, complex): (&SystemJacobian, &Factor<f64>, &Factor<Complex<f64>>),
    stages: &mut Stages,
    (scale, tolerance): (&[f64], f64),
    convergence: f64,
) -> Newton {
    let n = y.len();
    let mut eta = convergence.max(f64::EPSILON).powf(0.8);
    let (mut theta, mut last_ratio, mut last_size) = (KEEPS, 0.0f64, 0.0f64);
    let mut rates = [0; 3].map(|_| vec![0.0; n]);
    let (mut first, mut pair) = (vec![0.0; n], vec![Complex::new(0.0, 0.0); n]);
    let mut stage = vec![0.0; n];
    for iteration in 1..=NEWTON {
        for (k, c) in [C[0], C[1], 1.0].into_iter().enumerate() {
            (0..n).for_each(|i| stage[i] = y[i] + stages.z[k][i]);
            if !piece.rate(t + c * h, &stage, &mut rates[k]) {
                return Newton::Fails { factor: 0.5 };
            }
        }
        for i in 0..n {
            let f = [rates[0][i], rates[1][i], rates[2][i]];
            let of = |row: [f64; 3]| row[0] * f[0] + row[1] * f[1] + row[2] * f[2];
            let w = Complex::new(stages.w[1][i], stages.w[2][i]);
            first[i] = of(T_INVERSE[0]) - GAMMA / h * stages.w[0][i];
            pair[i] = Complex::new(of(T_INVERSE[1]), of(T_INVERSE[2])) - Complex::new(ALPHA / h, BETA / h) * w;
        }
        jacobian.solve(real, &mut first);
        jacobian.solve(complex, &mut pair);
        let squares =
            |i: usize| (first[i] * first[i] + pair[i].re * pair[i].re + pair[i].im * pair[i].im) / scale[i] / scale[i];
        let size = ((0..n).map(squares).sum::<f64>() / (3 * n) as f64).sqrt();
        if !size.is_finite() {
            return Newton::Fails { factor: 0.5 };
        }
        if iteration > 1 && iteration < NEWTON {
            let ratio = size / last_size;
            theta = if iteration == 2 { ratio } else { (ratio * last_ratio).sqrt() };
            last_ratio = ratio;
            if theta >= 0.99 {
                return Newton::Fails { factor: 0.5 };
            }
            eta = theta / (1.0 - theta);
            let rest = (NEWTON - 1 - iteration) as i32;
            let expected = eta * size * theta.powi(rest) / tolerance;
            if expected >= 1.0 {
                let power = -1.0 / f64::from(4 + rest);
                return Newton::Fails { factor: 0.8 * expected.clamp(1e-4, 20.0).powf(power) };
            }
        }
        last_size = size.max(f64::EPSILON);
        for i in 0..n {
            stages.w[0][i] += first[i];
            stages.w[1][i] += pair[i].re;
            stages.w[2][i] += pair[i].im;
            let w = [stages.w[0][i], stages.w[1][i], stages.w[2][i]];
            (0..3).for_each(|k| stages.z[k][i] = T[k][0] * w[0] + T[k][1] * w[1] + T[k][2] * w[2]);
        }
        if eta * size <= tolerance {
            return Newton::Converges { iterations: iteration, theta, eta };
        }
    }
    Newton::Fails { factor: 0.5 }
}

/// The error of a step by what is allowed, (8.19), (8.20).
fn error(
    piece: &Piece,
    (t, h): (f64, f64),
    (y, rate): (&[f64], &[f64]),
    (jacobian, real): (&SystemJacobian, &Factor<f64>),
    z: &[Vec<f64>; 3],
    scale: &[f64],
    is_hard: bool,
) -> f64 {
    let n = y.len();
    let ends: Vec<f64> = (0..n).map(|i| (0..3).map(|k| ERROR[k] / h * z[k][i]).sum()).collect();
    let solved = |rate: &[f64]| {
        let mut error: Vec<f64> = rate.iter().zip(&ends).map(|(rate, end)| rate + end).collect();
        jacobian.solve(real, &mut error);
        error
    };
    let size = |error: &[f64]| {
        let size = root_mean_square((0..n).map(|i| error[i] / scale[i]));
        if size.is_nan() {
            f64::INFINITY
        } else {
            size.max(1e-10)
        }
    };
    let first = solved(rate);
    if size(&first) < 1.0 || !is_hard {
        return size(&first);
    }
    let moved: Vec<f64> = y.iter().zip(&first).map(|(y, e)| y + e).collect();
    let mut there = vec![0.0; n];
    match piece.rate(t, &moved, &mut there) {
        true => size(&solved(&there)),
        false => f64::INFINITY,
    }
}
