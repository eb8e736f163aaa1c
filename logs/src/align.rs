//! A log for certain joints, in their order, cut where the clock does not run on.

use crate::failure::LogError;
use crate::log::{JointLog, LogQuantity};
use std::ops::Range;

/// A step of the clock of so many usual ones is a gap.
pub const GAP: f64 = 3.0;

/// What was met on the way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogReport {
    /// Rows of the log.
    pub rows: usize,
    /// Rows that are left.
    pub kept: usize,
    /// The usual step of the clock, the median \[s\].
    pub period: f64,
    /// The longest step between rows that belong together \[s\].
    pub longest: f64,
    /// Rows with the time stamp of the row before, which are left out.
    pub duplicates: usize,
    /// Where the clock jumps back: the time before \[s\], and how far \[s\].
    pub jumps: Vec<(f64, f64)>,
    /// Gaps: the times before and after \[s\].
    pub gaps: Vec<(f64, f64)>,
    /// Rows that lack a number which is needed, or have one that is not finite; they are left out.
    pub incomplete: usize,
    /// Messages whose joints stand in another order than before, or are others.
    pub reordered: usize,
    /// Messages without a time stamp of their own.
    pub unstamped: usize,
    /// Joints of the log that were not asked for.
    pub unknown: Vec<String>,
    /// Joints without velocity, whose positions are differentiated.
    pub without_velocity: Vec<String>,
    /// Topics or columns that were not read.
    pub others: Vec<String>,
}

/// Joint states, row by row complete.
#[derive(Clone, Debug, PartialEq)]
pub struct AlignedLog {
    /// Time stamps \[s\]; they grow within a segment.
    pub times: Vec<f64>,
    /// Positions: per joint a column.
    pub q: Vec<Vec<f64>>,
    /// Velocities.
    pub qd: Vec<Vec<f64>>,
    /// Efforts.
    pub tau: Vec<Vec<f64>>,
    /// Accelerations, where the log has those of all joints.
    pub qdd: Option<Vec<Vec<f64>>>,
    /// Rows between which the clock runs on without gaps.
    pub segments: Vec<Range<usize>>,
    /// What was met.
    pub report: LogReport,
}

/// The log for these joints. Positions and efforts are needed; velocities that a log has not are differences of positions.
///
/// # Errors
/// Joints that the log does not have, or that it has no position or effort of; all of them at once. No row that is complete.
pub fn align(log: &JointLog, joints: &[&str]) -> Result<AlignedLog, LogError> {
    let places = found(log, joints)?;
    let of = |quantity: LogQuantity| -> Vec<&[f64]> { places.iter().map(|k| log.column(quantity, *k)).collect() };
    let [q, qd, tau, qdd] = LogQuantity::ALL.map(of);
    let has_all = |columns: &[&[f64]]| columns.iter().all(|c| !c.is_empty());
    let has_accelerations = has_all(&qdd);
    let mut needed: Vec<&[f64]> = [&q[..], &tau].concat();
    needed.extend(qd.iter().filter(|c| !c.is_empty()));
    needed.extend(qdd.iter().filter(|_| has_accelerations));
    let mut report = LogReport {
        rows: log.times.len(),
        reordered: log.reordered,
        unstamped: log.unstamped,
        unknown: log.joints.iter().filter(|j| !joints.contains(&j.as_str())).cloned().collect(),
        without_velocity: joints.iter().zip(&qd).filter(|(_, c)| c.is_empty()).map(|(j, _)| j.to_string()).collect(),
        others: log.others.iter().map(|t| t.name.clone()).collect(),
        ..LogReport::default()
    };
    let rows = kept_rows(&log.times, &needed, &mut report);
    if rows.is_empty() {
        let what = format!("none of {} rows has all positions and efforts of {}", log.times.len(), joints.join(", "));
        return Err(LogError::new("", what, "joints that are published on topics of their own cannot be joined"));
    }
    let segments = segments(&log.times, &rows, &mut report);
    let picked = |columns: &[&[f64]]| -> Vec<Vec<f64>> {
        columns.iter().map(|c| if c.is_empty() { Vec::new() } else { rows.iter().map(|i| c[*i]).collect() }).collect()
    };
    let mut found = AlignedLog {
        times: rows.iter().map(|i| log.times[*i]).collect(),
        q: picked(&q),
        qd: picked(&qd),
        tau: picked(&tau),
        qdd: has_accelerations.then(|| picked(&qdd)),
        segments,
        report,
    };
    for (q, qd) in found.q.iter().zip(&mut found.qd).filter(|(_, qd)| qd.is_empty()) {
        for segment in &found.segments {
            qd.extend(differences(&found.times[segment.clone()], &q[segment.clone()]));
        }
    }
    Ok(found)
}

/// Where the joints stand in the log.
fn found(log: &JointLog, joints: &[&str]) -> Result<Vec<usize>, LogError> {
    let mut complaints = Vec::new();
    let mut places = Vec::new();
    for joint in joints {
        let Some(place) = log.joints.iter().position(|name| name == joint) else {
            complaints.push(format!("joint `{joint}` is not in the log"));
            continue;
        };
        for quantity in [LogQuantity::Position, LogQuantity::Effort] {
            if log.column(quantity, place).is_empty() {
                complaints.push(format!("the log has no {} of joint `{joint}`", quantity.name()));
            }
        }
        places.push(place);
    }
    match complaints.is_empty() {
        true => Ok(places),
        false => {
            let help = match log.joints.is_empty() {
                true => "the log has no joints".to_string(),
                false => format!("the log has the joints {}", log.joints.join(", ")),
            };
            Err(LogError::new("", complaints.join("\n  "), help))
        }
    }
}

/// Rows that are complete, without those whose stamp is that of the row before.
fn kept_rows(times: &[f64], needed: &[&[f64]], report: &mut LogReport) -> Vec<usize> {
    let mut rows: Vec<usize> = Vec::with_capacity(times.len());
    for (i, t) in times.iter().enumerate() {
        if !t.is_finite() || needed.iter().any(|column| !column[i].is_finite()) {
            report.incomplete += 1;
        } else if rows.last().is_some_and(|last| times[*last] == *t) {
            report.duplicates += 1;
        } else {
            rows.push(i);
        }
    }
    report.kept = rows.len();
    rows
}

/// Cuts rows where the clock jumps back or leaves a gap.
fn segments(times: &[f64], rows: &[usize], report: &mut LogReport) -> Vec<Range<usize>> {
    let steps: Vec<f64> = rows.windows(2).map(|pair| times[pair[1]] - times[pair[0]]).collect();
    let mut forward: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    forward.sort_by(f64::total_cmp);
    report.period = forward.get(forward.len() / 2).copied().unwrap_or(0.0);
    let (mut segments, mut first) = (Vec::new(), 0);
    for (k, step) in steps.iter().enumerate() {
        let (before, after) = (times[rows[k]], times[rows[k + 1]]);
        if *step <= 0.0 {
            report.jumps.push((before, -step));
        } else if *step > GAP * report.period {
            report.gaps.push((before, after));
        } else {
            report.longest = report.longest.max(*step);
            continue;
        }
        segments.push(first..k + 1);
        first = k + 1;
    }
    segments.push(first..rows.len());
    segments
}

/// Derivatives by parabolas through three neighbours.
fn differences(times: &[f64], values: &[f64]) -> Vec<f64> {
    let n = times.len();
    let at = |i: usize| {
        if n < 3 {
            return if n == 2 { (values[1] - values[0]) / (times[1] - times[0]) } else { 0.0 };
        }
        let k = i.clamp(1, n - 2);
        crate::smooth::derivative_weights(&times[k - 1..k + 2], times[i])
            .iter()
            .zip(&values[k - 1..k + 2])
            .map(|(w, x)| w * x)
            .sum()
    };
    (0..n).map(at).collect()
}
