//! What explains residual torques: an offset, viscous and Coulomb friction per joint, and a payload; what is left may be contact.

use super::payload::{UnitPayloads, PAYLOAD_PARAMETERS};
use super::ResidualTorques;
use crate::log_states::NamedRate;
use straightline_logs::align::AlignedLog;
use straightline_logs::episodes::{episodes, robust_spread, Episode, EpisodeDemand};
use straightline_logs::fit::{Fitted, LeastSquares};
use straightline_logs::smooth::LowPass;
use straightline_logs::threads::in_threads;

/// What is fitted of each joint: an offset \[N·m or N\], viscous friction \[N·m·s/rad or N·s/m\], Coulomb friction \[N·m or N\].
pub const JOINT_PARAMETERS: [&str; 3] = ["offset", "viscous", "Coulomb"];
const OWN: usize = JOINT_PARAMETERS.len();
const CARRIED: usize = PAYLOAD_PARAMETERS.len();

/// Rows of the log that are fitted, at most.
const MOST_ROWS: usize = 8_000;
/// So many standard errors from zero is a payload.
const SURE: f64 = 5.0;
/// Residuals that are no contact whatever their spread, as a part of the torques' root mean square.
const LEAST_CONTACT: f64 = 1e-3;
/// So many periods of the cut-off from ends of segments smoothing lacks neighbours.
const END: f64 = 3.0;

/// Figures of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFigure {
    /// Root mean square of measured minus model, by inverse dynamics and by the observer \[N·m or N\].
    pub rms: [f64; 2],
    /// Its mean, by inverse dynamics \[N·m or N\].
    pub bias: f64,
    /// What was fitted, in the order of [`JOINT_PARAMETERS`], each with its standard error; nothing of joints with several coordinates.
    pub fitted: Option<[(f64, f64); 3]>,
    /// The part of the mean square that the fit explains.
    pub explained: f64,
    /// When what is left is too far from its median for noise.
    pub episodes: Vec<Episode>,
}

/// What the frame carries beside the model.
#[derive(Clone, Debug, PartialEq)]
pub struct PayloadFigure {
    /// The ten parameters, each with its standard error, infinite where the data cannot tell it.
    pub parameters: [(f64, f64); 10],
    /// The centre of mass in the frame \[m\], each coordinate with its standard error.
    pub centre: [(f64, f64); 3],
    /// Whether it is more than noise; else the friction is fitted without it.
    pub is_found: bool,
}

/// What explains residuals.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// Per rate.
    pub joints: Vec<JointFigure>,
    /// At the frame, if one was asked for.
    pub payload: Option<PayloadFigure>,
    /// Names of parameters that the data cannot tell from others, with the rate's index.
    pub untold: Vec<(Option<usize>, &'static str)>,
    /// Per rate what is left of measured minus model.
    pub left: Vec<Vec<f64>>,
    /// Rows that were fitted.
    pub rows: usize,
}

/// The rows that are fitted: apart from ends, where smoothing has no neighbours, and as far apart as smoothed numbers are independent.
fn fitted_rows(log: &AlignedLog, residuals: &ResidualTorques) -> Vec<usize> {
    let period = log.report.period;
    let (margin, step) = match residuals.cutoff {
        Some(cutoff) if period > 0.0 => (END / cutoff, ((0.25 / (cutoff * period)) as usize).max(1)),
        _ => (0.0, 1),
    };
    let mut rows = Vec::new();
    for segment in &log.segments {
        let (first, last) = (log.times[segment.start], log.times[segment.end - 1]);
        let is_inside = |i: &usize| log.times[*i] >= first + margin && log.times[*i] <= last - margin;
        rows.extend(segment.clone().filter(is_inside).step_by(step));
    }
    let thinned = rows.len().div_ceil(MOST_ROWS).max(1);
    rows.into_iter().step_by(thinned).collect()
}

/// Per joint the sign of its velocity, smoothed as everything else is.
fn signs(log: &AlignedLog, residuals: &ResidualTorques) -> Vec<Vec<f64>> {
    let sign = |x: &f64| if *x == 0.0 { 0.0 } else { x.signum() };
    let one = |qd: &Vec<f64>| -> Vec<f64> {
        let signs: Vec<f64> = qd.iter().map(sign).collect();
        let Some(cutoff) = residuals.cutoff else { return signs };
        let part =
            |s: &std::ops::Range<usize>| LowPass { cutoff }.apply(&log.times[s.clone()], &signs[s.clone()]).values;
        log.segments.iter().flat_map(part).collect()
    };
    let qd = &residuals.motion[1];
    in_threads(qd.len(), |j| one(&qd[j]))
}

/// Torques of one unit of each parameter of the payload, per row and joint.
type CarriedRows = Vec<Vec<[f64; 10]>>;

/// Where parameters stand among the columns of a fit.
struct FitColumns {
    /// Those of the payload, in front.
    payload: usize,
    /// The first of those of each rate that has some of its own.
    own: Vec<Option<usize>>,
    /// All.
    count: usize,
}

impl FitColumns {
    fn of(log: &AlignedLog, residuals: &ResidualTorques, has_payload: bool) -> FitColumns {
        let payload = if has_payload { CARRIED } else { 0 };
        let mut count = payload;
        let place = |(rate, is_measured): (&NamedRate, &bool)| {
            let has_own = rate.is_single && *is_measured;
            let first = count;
            count += if has_own { OWN } else { 0 };
            has_own.then_some(first)
        };
        let own = residuals.rates.iter().zip(&log.is_measured).map(place).collect();
        FitColumns { payload, own, count }
    }

    /// Rates whose rows say something of what is fitted.
    fn rates<'a>(&'a self, log: &'a AlignedLog) -> impl Iterator<Item = usize> + 'a {
        (0..self.own.len()).filter(|j| log.is_measured[*j] && (self.payload > 0 || self.own[*j].is_some()))
    }

    /// The rate of a column, if it is not the payload's, and which parameter it is.
    fn named(&self, column: usize) -> (Option<usize>, &'static str) {
        let of = |place: &Option<usize>| place.is_some_and(|first| (first..first + OWN).contains(&column));
        match self.own.iter().position(of) {
            None => (None, PAYLOAD_PARAMETERS[column]),
            Some(rate) => (Some(rate), JOINT_PARAMETERS[(column - self.payload) % OWN]),
        }
    }
}

/// A fit, and what it leaves.
struct ExplainedFit {
    found: Fitted,
    columns: FitColumns,
    payload: Option<PayloadFigure>,
    left: Vec<Vec<f64>>,
}

/// Explains residuals by friction, and by a payload where units of it are given.
pub fn explain(log: &AlignedLog, residuals: &ResidualTorques, payload: Option<&UnitPayloads>) -> Explanation {
    let mut rows = fitted_rows(log, residuals);
    let signs = signs(log, residuals);
    let [q, qd, qdd] = &residuals.motion;
    let mut carried: Option<CarriedRows> =
        payload.map(|units| in_threads(rows.len(), |n| units.rows([q, qd, qdd], rows[n])));
    let mut solved = solve(log, residuals, &signs, &rows, carried.as_ref());
    // somebody's hand is neither friction nor payload: what is far from all else is left out, and all else fitted again
    let met: Vec<Episode> = in_threads(qd.len(), |j| episodes_of(log, residuals, j, &solved.left[j])).concat();
    let around = residuals.cutoff.map_or(0.0, |cutoff| 1.0 / cutoff);
    let is_quiet = |t: f64| met.iter().all(|e| t < e.from - around || t > e.to + around);
    let quiet: Vec<bool> = rows.iter().map(|i| is_quiet(log.times[*i])).collect();
    let count = quiet.iter().filter(|is_quiet| **is_quiet).count();
    if count < rows.len() && 2 * count > rows.len() {
        let mut kept = quiet.iter();
        rows.retain(|_| kept.next().is_some_and(|k| *k));
        if let Some(carried) = &mut carried {
            let mut kept = quiet.iter();
            carried.retain(|_| kept.next().is_some_and(|k| *k));
        }
        solved = solve(log, residuals, &signs, &rows, carried.as_ref());
    }
    let ExplainedFit { found, columns, payload, left } = solved;
    let joints = in_threads(qd.len(), |j| joint_figure(log, residuals, j, (&found, &columns), &left[j]));
    let untold = found.untold.iter().map(|k| columns.named(*k)).collect();
    Explanation { joints, payload, untold, left, rows: rows.len() }
}

/// Fits these rows, without a payload if that is no more than noise.
fn solve(
    log: &AlignedLog,
    residuals: &ResidualTorques,
    signs: &[Vec<f64>],
    rows: &[usize],
    carried: Option<&CarriedRows>,
) -> ExplainedFit {
    let mut columns = FitColumns::of(log, residuals, carried.is_some());
    let mut found = fitted(log, residuals, &columns, (rows, carried), signs);
    let payload = carried.map(|_| payload_figure(&found));
    let used = carried.filter(|_| payload.as_ref().is_some_and(|figure| figure.is_found));
    if carried.is_some() && used.is_none() {
        columns = FitColumns::of(log, residuals, false);
        found = fitted(log, residuals, &columns, (rows, None), signs);
    }
    let left = left_over(log, residuals, (rows, used), (&found.coefficients, &columns), signs);
    ExplainedFit { found, columns, payload, left }
}

/// One fit of all joints: the columns of the payload, if any, then those of each joint.
fn fitted(
    log: &AlignedLog,
    residuals: &ResidualTorques,
    columns: &FitColumns,
    (rows, carried): (&[usize], Option<&CarriedRows>),
    signs: &[Vec<f64>],
) -> Fitted {
    // joints are as noisy as they are strong: each counts in units of its own residual
    let scales: Vec<f64> = in_threads(residuals.direct.len(), |j| robust_spread(&residuals.direct[j]).1.max(1e-12));
    let mut squares = LeastSquares::new(columns.count);
    let mut row = vec![0.0; columns.count];
    for (n, i) in rows.iter().enumerate() {
        for j in columns.rates(log) {
            row.fill(0.0);
            if let Some(carried) = carried {
                row[..CARRIED].copy_from_slice(&carried[n][j]);
            }
            if let Some(own) = columns.own[j] {
                row[own..own + OWN].copy_from_slice(&[1.0, residuals.motion[1][j][*i], signs[j][*i]]);
            }
            row.iter_mut().for_each(|x| *x /= scales[j]);
            squares.push(&row, residuals.direct[j][*i] / scales[j]);
        }
    }
    squares.finish(None)
}

fn payload_figure(found: &Fitted) -> PayloadFigure {
    let parameters: [(f64, f64); 10] = std::array::from_fn(|k| (found.coefficients[k], found.errors[k]));
    let mass = parameters[0].0;
    let n = found.coefficients.len();
    let centre = std::array::from_fn(|k| {
        let c = parameters[1 + k].0 / mass;
        // of a quotient: (σ_h² − 2 c σ_hm + c² σ_m²) / m²
        let of = |a: usize, b: usize| found.covariance[a * n + b];
        let variance = (of(1 + k, 1 + k) - 2.0 * c * of(1 + k, 0) + c * c * of(0, 0)) / (mass * mass);
        match parameters[0].1.is_finite() && parameters[1 + k].1.is_finite() {
            true => (c, variance.max(0.0).sqrt()),
            false => (c, f64::INFINITY),
        }
    });
    let is_found =
        parameters[..4].iter().any(|(x, error)| error.is_finite() && x.abs() > SURE * error && x.abs() > 1e-6);
    PayloadFigure { parameters, centre, is_found }
}

/// What is left of the residuals; between rows that were fitted the payload's torques follow straight lines.
fn left_over(
    log: &AlignedLog,
    residuals: &ResidualTorques,
    (rows, carried): (&[usize], Option<&CarriedRows>),
    (coefficients, columns): (&[f64], &FitColumns),
    signs: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let of_joint = |j: usize| -> Vec<f64> {
        let own = columns.own[j].map_or(&[0.0; OWN][..], |own| &coefficients[own..own + OWN]);
        let torque = |n: usize| -> f64 {
            carried.map_or(0.0, |rows| rows[n][j].iter().zip(coefficients).map(|(y, x)| y * x).sum())
        };
        let torques: Vec<f64> = (0..rows.len()).map(torque).collect();
        let mut n = 0;
        let left = |i: usize| {
            while n + 2 < rows.len() && rows[n + 1] < i {
                n += 1;
            }
            let payload = match rows.len() {
                0 => 0.0,
                1 => torques[0],
                _ => {
                    let (from, to) = (log.times[rows[n]], log.times[rows[n + 1]]);
                    let part = if to > from { ((log.times[i] - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
                    torques[n] + part * (torques[n + 1] - torques[n])
                }
            };
            residuals.direct[j][i] - payload - own[0] - own[1] * residuals.motion[1][j][i] - own[2] * signs[j][i]
        };
        (0..log.times.len()).map(left).collect()
    };
    in_threads(residuals.direct.len(), of_joint)
}

fn joint_figure(
    log: &AlignedLog,
    residuals: &ResidualTorques,
    j: usize,
    (found, columns): (&Fitted, &FitColumns),
    left: &[f64],
) -> JointFigure {
    let direct = &residuals.direct[j];
    let (all, rest) = (square(direct), square(left));
    JointFigure {
        rms: [all.sqrt(), square(&residuals.observed[j]).sqrt()],
        bias: direct.iter().sum::<f64>() / direct.len().max(1) as f64,
        fitted: columns.own[j].map(|own| std::array::from_fn(|k| (found.coefficients[own + k], found.errors[own + k]))),
        explained: if all > 0.0 { 1.0 - rest / all } else { 0.0 },
        episodes: episodes_of(log, residuals, j, left),
    }
}

fn square(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64
}

/// The episodes of a joint, but for those at ends, where smoothing has no neighbours.
fn episodes_of(log: &AlignedLog, residuals: &ResidualTorques, j: usize, left: &[f64]) -> Vec<Episode> {
    // where no force is measured all that is left is one
    if !log.is_measured[j] {
        return Vec::new();
    }
    let spread = robust_spread(left);
    let least = LEAST_CONTACT * square(&log.tau[j]).sqrt().max(1e-6);
    let wave = residuals.cutoff.map_or(0.0, |cutoff| 1.0 / cutoff);
    // half a period of the cut-off: what is shorter is where friction changes its sign, a sample early or late
    let usual = EpisodeDemand::default();
    let demand = EpisodeDemand { duration: usual.duration.max(0.5 * wave), ..usual };
    let in_segment = |s: &std::ops::Range<usize>| {
        let times = &log.times[s.clone()];
        let (first, last) = (times[0] + END * wave, times[times.len() - 1] - END * wave);
        let inside = times.partition_point(|t| *t < first)..times.partition_point(|t| *t <= last);
        let inside = inside.start..inside.end.max(inside.start);
        episodes(&times[inside.clone()], &left[s.clone()][inside], spread, least, demand)
    };
    log.segments.iter().flat_map(in_segment).collect()
}
