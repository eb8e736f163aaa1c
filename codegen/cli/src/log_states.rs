//! The states of a robot in a log: which columns they are made of, and what follows from them.
//!
//! Joints that follow others, or that loops determine, are not asked for: the latter are solved for, row by row. Of a base that floats only the
//! orientation has to be known, and how it moves; what pushes it need not be measured.

use straightline_core::algorithms::difference;
use straightline_core::model::{Joint, Model};
use straightline_logs::align::AlignedLog;
use straightline_logs::demand::{LogDemand, PositionDemand, RateDemand};
use straightline_logs::smooth::derivative_weights;
use straightline_logs::LogError;

/// A rate of a robot, and what its force is called.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedRate {
    /// Its name as a velocity: of its joint, or `base.vx`.
    pub velocity: String,
    /// Its name as a force: of its joint, or `base.fx`.
    pub effort: String,
    /// The unit of its force.
    pub unit: &'static str,
    /// Whether it is the only one of its joint.
    pub is_single: bool,
}

/// The rates of a robot, in their order.
pub fn named_rates(model: &Model<f64>) -> Vec<NamedRate> {
    let of_joint = |joint: &&Joint| -> Vec<NamedRate> {
        let names = joint.entry_names(1).into_iter().zip(joint.entry_names(2));
        let measures = joint.kind.row().measures;
        names
            .zip(measures)
            .map(|((velocity, effort), measure)| {
                let [.., unit] = measure.units();
                NamedRate { velocity, effort, unit, is_single: joint.kind.is_single() }
            })
            .collect()
    };
    independent(model).iter().flat_map(of_joint).collect()
}

/// The coordinates of a robot, in their order: names of columns.
pub fn position_names(model: &Model<f64>) -> Vec<String> {
    model.joints().into_iter().flat_map(|joint| joint.entry_names(0)).collect()
}

/// The joints that no loop determines, in the order of their coordinates.
fn independent(model: &Model<f64>) -> Vec<&Joint> {
    model.joints().into_iter().filter(|joint| joint.iv < model.nv()).collect()
}

/// What of a log the states of a robot take.
pub fn log_demand(model: &Model<f64>) -> LogDemand {
    let mut demand = LogDemand::default();
    for joint in independent(model) {
        if joint.kind.is_single() {
            demand.push_joint(&joint.name);
            continue;
        }
        // nothing depends on where a base is
        let turn = joint.kind.row().quaternion.unwrap_or(0);
        let is_base = joint.kind.is_base();
        let place = |(k, name)| PositionDemand { name, else_at: (is_base && k < turn).then_some(0.0) };
        demand.positions.extend(joint.entry_names(0).into_iter().enumerate().map(place));
        let names = joint.entry_names(1).into_iter().zip(joint.entry_names(2));
        let rate = |(velocity, effort)| RateDemand { velocity, effort, needs_effort: !is_base, position: None };
        demand.rates.extend(names.map(rate));
    }
    let determined = model.tree_joints().into_iter().filter(|joint| joint.iv >= model.nv());
    demand.determined = determined.map(|joint| joint.name.clone()).collect();
    demand
}

/// The log with all that follows from what it has: quaternions of length one that do not jump to their opposite, velocities of joints with several
/// coordinates, joints that loops determine.
///
/// # Errors
/// What the log cannot say, and when.
pub fn with_whole_states(model: &Model<f64>, mut log: AlignedLog) -> Result<AlignedLog, LogError> {
    if independent(model).iter().any(|joint| !joint.kind.is_single()) {
        turn(model, &mut log)?;
        differentiate(model, &mut log)?;
    }
    if !model.closure.is_empty() {
        close(model, &mut log)?;
    }
    Ok(log)
}

/// Brings the quaternion of a joint to length one, row by row; `turned` sees the joint's coordinates after that, and may change them.
///
/// # Errors
/// What `turned` says.
pub(crate) fn normalise<E>(
    joint: &Joint,
    q: &mut [Vec<f64>],
    mut turned: impl FnMut(usize, &mut [f64]) -> Result<(), E>,
) -> Result<(), E> {
    let own = &mut q[joint.iq..joint.iq + joint.kind.nq()];
    for i in 0..own[0].len() {
        let mut now: Vec<f64> = own.iter().map(|column| column[i]).collect();
        joint.kind.normalise(&mut now);
        turned(i, &mut now)?;
        own.iter_mut().zip(now).for_each(|(column, x)| column[i] = x);
    }
    Ok(())
}

/// Brings quaternions to length one, on the side of the row before.
fn turn(model: &Model<f64>, log: &mut AlignedLog) -> Result<(), LogError> {
    for joint in independent(model) {
        let Some(first) = joint.kind.row().quaternion else { continue };
        let mut before = joint.kind.row().neutral[first..].to_vec();
        normalise(joint, &mut log.q, |i, now| {
            if now.iter().any(|x| !x.is_finite()) {
                let what = format!("the quaternion of {} has no length", joint.name);
                let place = format!("t = {:?} s", log.times[i]);
                return Err(LogError::new(place, what, "write unit quaternions x, y, z, w"));
            }
            let now = &mut now[first..];
            let along: f64 = now.iter().zip(&before).map(|(x, y)| x * y).sum();
            now.iter_mut().for_each(|x| *x *= along.signum());
            before.copy_from_slice(now);
            Ok(())
        })?;
    }
    Ok(())
}

/// Velocities of joints with several coordinates, where the log has none: derivatives of parabolas through displacements from three neighbours.
fn differentiate(model: &Model<f64>, log: &mut AlignedLog) -> Result<(), LogError> {
    for joint in independent(model).into_iter().filter(|joint| !joint.kind.is_single()) {
        let own = joint.iv..joint.iv + joint.kind.nv();
        if log.qd[own.clone()].iter().all(|column| !column.is_empty()) {
            continue;
        }
        let names = joint.entry_names(0);
        if let Some(name) = names.iter().find(|name| log.report.without_position.contains(name)) {
            let what = format!(
                "the log has neither the velocity of {} nor `{name}`, of which it could be the derivative",
                joint.name
            );
            let help = format!("give it {}, or {}", joint.entry_names(1).join(", "), names.join(", "));
            return Err(LogError::new("", what, help));
        }
        let mut rates = vec![Vec::with_capacity(log.times.len()); joint.kind.nv()];
        for segment in log.segments.clone() {
            for i in segment.clone() {
                let velocity = slope(model, log, segment.clone(), i);
                rates.iter_mut().zip(&velocity[own.clone()]).for_each(|(column, x)| column.push(*x));
            }
        }
        log.qd[own].iter_mut().zip(rates).for_each(|(column, found)| *column = found);
    }
    Ok(())
}

/// The velocity of a row, by its neighbours in a segment.
fn slope(model: &Model<f64>, log: &AlignedLog, segment: std::ops::Range<usize>, i: usize) -> Vec<f64> {
    let width = segment.len().min(3);
    let first = i.saturating_sub(1).clamp(segment.start, segment.end - width);
    let near = first..first + width;
    let configuration = |k: usize| -> Vec<f64> { log.q.iter().map(|column| column[k]).collect() };
    let here = configuration(i);
    let weights = derivative_weights(&log.times[near.clone()], log.times[i]);
    let mut sum = vec![0.0; model.nv()];
    for (weight, k) in weights.iter().zip(near) {
        // rows of a log without what loops determine: only free joints are asked for
        let way = difference(model, &here, &configuration(k));
        sum.iter_mut().zip(way).for_each(|(x, way)| *x += weight * way);
    }
    sum
}

/// Solves for what loops determine, each row from the one before it.
fn close(model: &Model<f64>, log: &mut AlignedLog) -> Result<(), LogError> {
    let known = log.q.len();
    log.q.resize(model.nq(), vec![0.0; log.times.len()]);
    for segment in log.segments.clone() {
        let mut before: Option<Vec<f64>> = None;
        for i in segment {
            let mut q: Vec<f64> = log.q.iter().map(|column| column[i]).collect();
            let from = before.take().unwrap_or_else(|| model.assembled(&q));
            q[known..].copy_from_slice(&from[known..]);
            let Some(closed) = model.closed_from(q, &from) else {
                let what = format!("the loops of {} cannot be closed", model.name);
                let help =
                    "positions of the independent joints are not those of this robot, or not in its branch of assembly";
                return Err(LogError::new(format!("t = {:?} s", log.times[i]), what, help));
            };
            log.q[known..].iter_mut().zip(&closed[known..]).for_each(|(column, x)| column[i] = *x);
            before = Some(closed);
        }
    }
    Ok(())
}
