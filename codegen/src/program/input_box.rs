//! The box of a program's inputs: what bounds on rounding errors are computed for.

use crate::function::Quantity;
use crate::scene::Scene;
use straightline_core::joint::Measure;
use straightline_core::model::Model;
use straightline_graph::certify::{Interval, NoCertificate};
use straightline_graph::expr::Port;

/// Where neither the scene nor the robot file limits a coordinate: angles within π, slides and positions within 10 m.
fn default_range(measure: Measure) -> f64 {
    match measure {
        Measure::Angle => std::f64::consts::PI,
        Measure::Length => 10.0,
    }
}

/// The box of a program's inputs in a scene, an interval per input scalar: the scene's ranges, the robot file's limits, and where
/// there is neither, defaults.
///
/// # Errors
/// If an input is neither (an inertial parameter).
pub fn input_box<T>(inputs: &[Port], scene: &Scene, model: &Model<T>) -> Result<Vec<Interval>, NoCertificate> {
    let mut all = Vec::new();
    for port in inputs {
        let mut ranges = scene.input_ranges(port, model);
        let quantity = Quantity::of(port).ok_or(NoCertificate::Unlimited)?;
        if quantity.is_configuration() {
            for joint in model.free_joints() {
                let own = ranges[joint.iq..].iter_mut().zip(joint.kind.measures());
                own.for_each(|(r, measure)| limit(r, default_range(measure)));
            }
        } else {
            let bound = quantity.default_bound().ok_or(NoCertificate::Unlimited)?;
            ranges.iter_mut().for_each(|r| limit(r, bound));
        }
        all.extend(ranges.into_iter().map(|r| Interval { lo: r.lower, hi: r.upper }));
    }
    Ok(all)
}

/// Infinite ends become this far from zero, or from the other end.
fn limit(range: &mut crate::scene::InputRange, bound: f64) {
    if range.lower == f64::NEG_INFINITY {
        range.lower = (-bound).min(range.upper - bound);
    }
    if range.upper == f64::INFINITY {
        range.upper = bound.max(range.lower + bound);
    }
}
