//! Residual torques of a log: measured minus model, and what explains them.
//!
//! Two ways: the observer of momentum, which takes no acceleration, and inverse dynamics of accelerations that the log has. Where it has none, the
//! equation of momentum is smoothed without phase, and momentum differentiated after that. What is left is explained by friction per joint and a payload at a frame, by one fit of all joints, since either alone would take on
//! what belongs to the other.

mod explain;
pub mod payload;
pub mod torques;

pub use explain::{explain, Explanation, JointFigure, PayloadFigure, JOINT_PARAMETERS};

use self::torques::{StateColumns, TorqueModel};
use crate::log_states::{named_rates, normalise, NamedRate};
use std::convert::Infallible;
use straightline_logs::align::AlignedLog;
use straightline_logs::observer::Observer;
use straightline_logs::smooth::LowPass;
use straightline_logs::threads::in_threads;

/// Residual torques of all rows of a log.
#[derive(Clone, Debug)]
pub struct ResidualTorques {
    /// What they are called.
    pub rates: Vec<NamedRate>,
    /// The cut-off of smoothing \[Hz\]; `None` where the log has accelerations and nothing is smoothed.
    pub cutoff: Option<f64>,
    /// The gain of the observer \[1/s\].
    pub gain: f64,
    /// Positions, velocities and accelerations that the model was given.
    pub motion: [StateColumns; 3],
    /// Measured minus model by inverse dynamics \[N·m or N\], per rate; where no force is measured, minus what the surroundings exert.
    pub direct: StateColumns,
    /// Measured minus model by the observer \[N·m or N\], per rate; it follows within 1/gain.
    pub observed: StateColumns,
}

/// The cut-off of smoothing where none is given: 10 Hz, or less where the log has fewer than 60 rows a second.
pub fn usual_cutoff(period: f64) -> f64 {
    match period > 0.0 {
        true => (1.0 / (6.0 * period)).min(10.0),
        false => 10.0,
    }
}

/// Residual torques of a log of whole states.
pub fn residual_torques(model: &TorqueModel, log: &AlignedLog, cutoff: f64) -> ResidualTorques {
    let rates = named_rates(&model.model);
    let gain = 2.0 * std::f64::consts::PI * cutoff;
    let (momentum, force) = momentum_and_force(model, log);
    let observed = observed(log, [&momentum, &force], Observer { gain });
    let Some(qdd) = &log.qdd else {
        let filter = LowPass { cutoff };
        let ((mut q, _), (qd, qdd)) = (smoothed(log, &log.q, filter), smoothed(log, &log.qd, filter));
        for joint in model.model.free_joints().filter(|joint| joint.kind.row().quaternion.is_some()) {
            let Ok(()) = normalise::<Infallible>(joint, &mut q, |_, _| Ok(()));
        }
        // LP τ − LP (d/dt p − f): what is smoothed is linear in what is measured, so that a fast motion leaves nothing behind
        let ((mut direct, _), (_, growth)) = (smoothed(log, &force, filter), smoothed(log, &momentum, filter));
        subtract(&mut direct, &growth);
        return ResidualTorques { rates, cutoff: Some(cutoff), gain, motion: [q, qd, qdd], direct, observed };
    };
    let motion = [log.q.clone(), log.qd.clone(), qdd.clone()];
    let mut direct = log.tau.clone();
    subtract(&mut direct, &model.inverse_dynamics([&motion[0], &motion[1], &motion[2]]));
    ResidualTorques { rates, cutoff: None, gain, motion, direct, observed }
}

fn subtract(from: &mut StateColumns, what: &StateColumns) {
    for (from, what) in from.iter_mut().zip(what) {
        from.iter_mut().zip(what).for_each(|(x, y)| *x -= y);
    }
}

/// Columns smoothed within the segments of a log, and their derivatives.
fn smoothed(log: &AlignedLog, columns: &StateColumns, filter: LowPass) -> (StateColumns, StateColumns) {
    let one = |column: &Vec<f64>| {
        let (mut values, mut rates) = (Vec::with_capacity(column.len()), Vec::with_capacity(column.len()));
        for segment in &log.segments {
            let found = filter.apply(&log.times[segment.clone()], &column[segment.clone()]);
            values.extend(found.values);
            rates.extend(found.rates);
        }
        (values, rates)
    };
    in_threads(columns.len(), |k| one(&columns[k])).into_iter().unzip()
}

/// p = H q̇, and what lets it grow, τ + f.
fn momentum_and_force(model: &TorqueModel, log: &AlignedLog) -> (StateColumns, StateColumns) {
    let mut force = model.force_on_momentum(&log.q, &log.qd);
    for (force, tau) in force.iter_mut().zip(&log.tau) {
        force.iter_mut().zip(tau).for_each(|(f, tau)| *f += tau);
    }
    (model.momentum(&log.q, &log.qd), force)
}

fn observed(log: &AlignedLog, [momentum, force]: [&StateColumns; 2], observer: Observer) -> StateColumns {
    in_threads(momentum.len(), |j| {
        let (p, f) = (&momentum[j], &force[j]);
        let of = |s: &std::ops::Range<usize>| observer.residuals(&log.times[s.clone()], &p[s.clone()], &f[s.clone()]);
        log.segments.iter().flat_map(of).collect()
    })
}
