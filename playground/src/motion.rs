//! The motion that is shown: every joint swings about the middle of its range, one a little behind the other, for ever. So a period has a mean and a
//! root of the mean square that a motor has to bear.

use straightline_core::model::{Joint, Model};
use straightline_core::Real;

/// Most that a joint turns to each side \[rad\].
const MOST_TURN: f64 = 0.6;
/// Most that it slides \[m\].
const MOST_SLIDE: f64 = 0.1;
/// Which part of its range it swings through to each side, at most.
const PART: f64 = 0.3;
/// By how much a joint is behind the one before it \[rad\].
const BEHIND: f64 = 0.9;
/// Rows of a period: between these, so that a page shows all.
const ROWS: [usize; 2] = [60, 180];
/// Characters that a page has for its rows at most; longer runs would be thinned.
const MOST_CHARACTERS: usize = 300_000;

/// Instants of a motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SwingRows {
    /// Times \[s\].
    pub times: Vec<f64>,
    /// q, q̇ and q̈ of each.
    pub states: Vec<[Vec<f64>; 3]>,
}

/// How a joint swings: middle, amplitude, phase.
struct JointSwing<'a> {
    joint: &'a Joint,
    middle: f64,
    amplitude: f64,
    phase: f64,
}

fn swing(joint: &Joint, k: usize) -> JointSwing<'_> {
    let most = if joint.kind.slides() { MOST_SLIDE } else { MOST_TURN };
    let limits = joint.limits;
    let (lower, upper) = (limits.lower, limits.upper);
    let amplitude = (PART * (upper - lower)).clamp(0.0, most);
    let amplitude = if amplitude.is_finite() { amplitude } else { most };
    // as near to where it does nothing as its range allows
    let middle = 0f64.max(lower + amplitude).min(upper - amplitude);
    JointSwing { joint, middle, amplitude, phase: BEHIND * k as f64 }
}

/// A period of so many seconds, its end included, for a page of so many columns. Robots with closed loops stand still, as joints with several
/// coordinates do.
pub fn rows(model: &Model<f64>, period: f64, columns: usize) -> SwingRows {
    let swings: Vec<JointSwing> = match model.closure.is_empty() {
        true => {
            model.independent_joints().filter(|j| j.kind.is_single()).enumerate().map(|(k, j)| swing(j, k)).collect()
        }
        false => Vec::new(),
    };
    let characters = (4 * (7 * model.bodies.len() + columns) + 8) * 4 / 3;
    let count = (MOST_CHARACTERS / characters).clamp(ROWS[0], ROWS[1] + 1);
    let start = model.neutral();
    let rate = std::f64::consts::TAU / period;
    let mut rows = SwingRows::default();
    for row in 0..count {
        let t = period * row as f64 / (count - 1) as f64;
        let (mut q, mut qd, mut qdd) = (start.clone(), vec![0.0; model.nv()], vec![0.0; model.nv()]);
        for JointSwing { joint, middle, amplitude, phase } in &swings {
            // the sines of generated code: the same on every machine
            let (sin, cos) = Real::sin_cos(rate * t - phase);
            q[joint.iq] = middle + amplitude * sin;
            qd[joint.iv] = amplitude * rate * cos;
            qdd[joint.iv] = -amplitude * rate * rate * sin;
        }
        rows.times.push(t);
        rows.states.push([q, qd, qdd]);
    }
    rows
}
