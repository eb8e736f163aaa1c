//! A log for certain coordinates, in their order, cut where the clock does not run on.

use crate::demand::LogDemand;
use crate::failure::LogError;
use crate::log::{JointLog, LogQuantity};
use std::ops::Range;

/// A step of the clock of so many usual ones is a gap.
pub const GAP: f64 = 3.0;

/// What is greater was not measured, in any unit.
const MOST: f64 = 1e50;

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
    /// Rows that lack a number which is needed, or have one that is not finite or beyond 1e50; they are left out.
    pub incomplete: usize,
    /// Messages whose joints stand in another order than before, or are others.
    pub reordered: usize,
    /// Messages without a time stamp of their own.
    pub unstamped: usize,
    /// Joints of the log that were not asked for.
    pub unknown: Vec<String>,
    /// Joints of the log that others determine, and that are not read.
    pub determined: Vec<String>,
    /// Coordinates without velocity, whose positions are differentiated.
    pub without_velocity: Vec<String>,
    /// Positions that the log does not have, and that forces do not depend on.
    pub without_position: Vec<String>,
    /// Forces that the log does not have, and that need not be measured.
    pub without_effort: Vec<String>,
    /// Topics or columns that were not read.
    pub others: Vec<String>,
}

/// States, row by row complete.
#[derive(Clone, Debug, PartialEq)]
pub struct AlignedLog {
    /// Time stamps \[s\]; they grow within a segment.
    pub times: Vec<f64>,
    /// Positions: per coordinate a column.
    pub q: Vec<Vec<f64>>,
    /// Velocities: per rate a column; empty where the log has none and differences of one position are none.
    pub qd: Vec<Vec<f64>>,
    /// Forces: per rate a column, of zeros where none is measured.
    pub tau: Vec<Vec<f64>>,
    /// Per rate, whether its force is measured.
    pub is_measured: Vec<bool>,
    /// Accelerations, where the log has those of all rates.
    pub qdd: Option<Vec<Vec<f64>>>,
    /// Rows between which the clock runs on without gaps.
    pub segments: Vec<Range<usize>>,
    /// What was met.
    pub report: LogReport,
}

/// The log for these coordinates. Velocities that a log has not are differences of positions, where those of one position are.
///
/// # Errors
/// Joints that the log does not have, or that it has no position or effort of; all of them at once. No row that is complete.
pub fn align(log: &JointLog, demand: &LogDemand) -> Result<AlignedLog, LogError> {
    let of = |quantity: LogQuantity, name: &str| column(log, quantity, name);
    let q: Vec<&[f64]> = demand.positions.iter().map(|of_q| of(LogQuantity::Position, &of_q.name)).collect();
    let rates = |quantity| demand.rates.iter().map(|rate| of(quantity, &rate.velocity)).collect::<Vec<&[f64]>>();
    let (qd, qdd) = (rates(LogQuantity::Velocity), rates(LogQuantity::Acceleration));
    let tau: Vec<&[f64]> = demand.rates.iter().map(|rate| of(LogQuantity::Effort, &rate.effort)).collect();
    complain(log, demand, [&q, &tau])?;
    let has_accelerations = qdd.iter().all(|c| !c.is_empty());
    let mut needed: Vec<&[f64]> = [&q[..], &qd, &tau].concat();
    needed.extend(qdd.iter().filter(|_| has_accelerations));
    needed.retain(|column| !column.is_empty());
    let mut report = report(log, demand, [&q, &qd, &tau]);
    let rows = kept_rows(&log.times, &needed, &mut report);
    if rows.is_empty() {
        let names: Vec<&str> = demand.positions.iter().map(|of_q| of_q.name.as_str()).collect();
        let what = format!("none of {} rows has all positions and efforts of {}", log.times.len(), names.join(", "));
        return Err(LogError::new("", what, "joints that are published on topics of their own cannot be joined"));
    }
    let segments = segments(&log.times, &rows, &mut report);
    let picked = |column: &[f64]| -> Vec<f64> {
        if column.is_empty() {
            Vec::new()
        } else {
            rows.iter().map(|i| column[*i]).collect()
        }
    };
    let or = |column: &[f64], x: f64| if column.is_empty() { vec![x; rows.len()] } else { picked(column) };
    let mut found = AlignedLog {
        times: rows.iter().map(|i| log.times[*i]).collect(),
        q: q.iter().zip(&demand.positions).map(|(column, of_q)| or(column, of_q.else_at.unwrap_or(f64::NAN))).collect(),
        qd: qd.iter().map(|column| picked(column)).collect(),
        tau: tau.iter().map(|column| or(column, 0.0)).collect(),
        is_measured: tau.iter().map(|column| !column.is_empty()).collect(),
        qdd: has_accelerations.then(|| qdd.iter().map(|column| picked(column)).collect()),
        segments,
        report,
    };
    for (rate, qd) in demand.rates.iter().zip(&mut found.qd).filter(|(_, qd)| qd.is_empty()) {
        for (segment, place) in found.segments.iter().flat_map(|segment| rate.position.map(|place| (segment, place))) {
            qd.extend(differences(&found.times[segment.clone()], &found.q[place][segment.clone()]));
        }
    }
    Ok(found)
}

/// The numbers of a name; empty where there are none.
fn column<'a>(log: &'a JointLog, quantity: LogQuantity, name: &str) -> &'a [f64] {
    let place = log.joints.iter().position(|known| known == name);
    place.map_or(&[][..], |place| log.column(quantity, place))
}

/// What is missing, all at once.
fn complain(log: &JointLog, demand: &LogDemand, [q, tau]: [&[&[f64]]; 2]) -> Result<(), LogError> {
    let positions =
        q.iter().zip(&demand.positions).filter(|(column, of_q)| column.is_empty() && of_q.else_at.is_none());
    let efforts = tau.iter().zip(&demand.rates).filter(|(column, rate)| column.is_empty() && rate.needs_effort);
    let missing = positions
        .map(|(_, of_q)| (LogQuantity::Position, &of_q.name))
        .chain(efforts.map(|(_, rate)| (LogQuantity::Effort, &rate.effort)));
    let mut complaints: Vec<String> = Vec::new();
    for (quantity, name) in missing {
        let complaint = match log.joints.contains(name) {
            true => format!("the log has no {} of joint `{name}`", quantity.name()),
            false => format!("joint `{name}` is not in the log"),
        };
        if !complaints.contains(&complaint) {
            complaints.push(complaint);
        }
    }
    if complaints.is_empty() {
        return Ok(());
    }
    let help = match log.joints.is_empty() {
        true => "the log has no joints".to_string(),
        false => format!("the log has the joints {}", log.joints.join(", ")),
    };
    Err(LogError::new("", complaints.join("\n  "), help))
}

/// What there is to say before rows are looked at.
fn report(log: &JointLog, demand: &LogDemand, [q, qd, tau]: [&[&[f64]]; 3]) -> LogReport {
    let lacking = |columns: &[&[f64]], names: &mut dyn Iterator<Item = &String>| -> Vec<String> {
        columns.iter().zip(names).filter(|(column, _)| column.is_empty()).map(|(_, name)| name.clone()).collect()
    };
    let (determined, unknown) = log
        .joints
        .iter()
        .filter(|name| !demand.has(name))
        .cloned()
        .partition(|name: &String| demand.determined.contains(name));
    LogReport {
        rows: log.times.len(),
        reordered: log.reordered,
        unstamped: log.unstamped,
        unknown,
        determined,
        without_position: lacking(q, &mut demand.positions.iter().map(|of_q| &of_q.name)),
        without_velocity: lacking(qd, &mut demand.rates.iter().map(|rate| &rate.velocity)),
        without_effort: lacking(tau, &mut demand.rates.iter().map(|rate| &rate.effort)),
        others: log.others.iter().map(|t| t.name.clone()).collect(),
        ..LogReport::default()
    }
}

/// Whether a number can be one of a robot; squares of others are none.
fn is_plausible(x: f64) -> bool {
    x.abs() <= MOST
}

/// Rows that are complete, without those whose stamp is that of the row before.
fn kept_rows(times: &[f64], needed: &[&[f64]], report: &mut LogReport) -> Vec<usize> {
    let mut rows: Vec<usize> = Vec::with_capacity(times.len());
    for (i, t) in times.iter().enumerate() {
        if !t.is_finite() || needed.iter().any(|column| !is_plausible(column[i])) {
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
