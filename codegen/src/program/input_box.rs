//! The box of a program's inputs: what bounds on rounding errors are computed for.

use crate::scene::Scene;
use straightline_core::joint::Measure;
use straightline_core::model::Model;
use straightline_graph::certify::{Interval, Refusal};
use straightline_graph::expr::Port;

/// Where neither the scene nor the robot file limits an input: angles within π, slides and positions within 10 m, speeds within
/// 10 rad/s or m/s, accelerations within 100 rad/s² or m/s², forces within 1000 N·m or N, gravity within 10 m/s² per component.
const DEFAULTS: [(&str, f64); 4] = [("qd", 10.0), ("qdd", 100.0), ("tau", 1000.0), ("gravity", 10.0)];
const SLIDE: f64 = 10.0;

/// The box of a program's inputs in a scene, an interval per input scalar: the scene's ranges, the robot file's limits, and where
/// there is neither, defaults.
///
/// # Errors
/// If an input is neither (an inertial parameter).
pub fn input_box<T>(inputs: &[Port], scene: &Scene, model: &Model<T>) -> Result<Vec<Interval>, Refusal> {
    let mut all = Vec::new();
    for port in inputs {
        let mut ranges = scene.input_ranges(port, model);
        if port.name == "q" {
            for joint in model.bodies.iter().map(|b| &b.joint) {
                let own = ranges[joint.iq..].iter_mut().zip(joint.kind.measures());
                own.for_each(|(r, measure)| {
                    limit(r, if measure == Measure::Angle { std::f64::consts::PI } else { SLIDE })
                });
            }
        } else {
            let bound = DEFAULTS.iter().find(|(name, _)| *name == port.name).ok_or(Refusal::Unlimited)?.1;
            ranges.iter_mut().for_each(|r| limit(r, bound));
        }
        all.extend(ranges.into_iter().map(|r| Interval { lo: r.lower, hi: r.upper }));
    }
    Ok(all)
}

/// Infinite ends become this far from zero, or from the other end.
fn limit(range: &mut crate::scene::Interval, bound: f64) {
    if range.lower == f64::NEG_INFINITY {
        range.lower = (-bound).min(range.upper - bound);
    }
    if range.upper == f64::INFINITY {
        range.upper = bound.max(range.lower + bound);
    }
}
