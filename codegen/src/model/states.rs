//! States of a robot at which programs are tried.

use straightline_core::model::{Joint, Model};
use straightline_core::random::Random;
use straightline_core::Dd;
use straightline_graph::expr::{Graph, Port};

/// Of the numbers that states are made of.
pub(crate) const SEED: u64 = 0x9e37_79b9_7f4a_7c15;
/// How near \[rad or m\].
const NEAR: f64 = 0.02;
/// How far \[rad, rad/s\] springs of transmissions are stretched.
const STRETCH: f64 = 1e-3;
/// A joint without a limit of its speed moves so fast \[rad/s or m/s\], if it does.
const FAST: f64 = 10.0;
/// Accelerations at about rest, as a part of others.
const SLOW: f64 = 0.2;
/// A joint without limits is tried within ± so much.
const RANGE: f64 = std::f64::consts::PI;
/// A limit beyond this is none \[rad, m, rad/s or m/s\].
pub(crate) const NO_LIMIT: f64 = 1e6;

/// A limit, or what is tried without one.
fn within(limit: f64, other: f64) -> f64 {
    if limit.abs() <= NO_LIMIT {
        limit
    } else {
        other
    }
}

/// Inputs anywhere in the limits, the same everywhere: at about rest, where weights rule, or as fast as the joints allow.
/// `None` where a run-time parameter is an input.
pub(crate) fn states(model: &Model<Dd>, inputs: &[Port], count: usize, fast: bool) -> Option<Vec<Vec<f64>>> {
    if inputs.iter().any(|port| port.wrapper.is_some()) {
        return None;
    }
    let mut random = Random(SEED);
    Some((0..count).map(|_| inputs.iter().flat_map(|port| of_port(model, port, fast, &mut random)).collect()).collect())
}

/// One of these states, of one port.
pub(crate) fn of_port(model: &Model<Dd>, port: &Port, fast: bool, random: &mut Random) -> Vec<f64> {
    let mut x = values(model, &port.name, port.len(), 0, random);
    let rates = port.name == "qd" && port.len() == model.nv();
    for joint in model.bodies.iter().map(|b| &b.joint).filter(|j| fast && rates && j.kind.is_single()) {
        x[joint.iv] *= within(joint.limits.velocity, FAST);
    }
    if port.name == "qdd" && !fast {
        x.iter_mut().for_each(|x| *x *= SLOW);
    }
    x
}

/// Values of an input port; `kind` 0: anywhere, 1: nearly stretched, 2: near right angles.
pub(crate) fn values(model: &Model<Dd>, port: &str, len: usize, kind: usize, random: &mut Random) -> Vec<f64> {
    match port {
        "q" if len == model.nq() => {
            let mut q = vec![0.0; len];
            for joint in model.bodies.iter().map(|b| &b.joint) {
                if let Some(first) = joint.kind.row().quaternion {
                    let quaternion: Vec<f64> = (0..4).map(|_| random.symmetric(1.0)).collect();
                    let norm = quaternion.iter().map(|x| x * x).sum::<f64>();
                    let norm = straightline_core::trig::sqrt_f64(norm);
                    (0..first).for_each(|k| q[joint.iq + k] = random.symmetric(1.0));
                    (0..4).for_each(|k| q[joint.iq + first + k] = quaternion[k] / norm);
                    continue;
                }
                for q in &mut q[joint.iq..joint.iq + joint.kind.nq()] {
                    let (lower, upper) = (within(joint.limits.lower, -RANGE), within(joint.limits.upper, RANGE));
                    let anywhere = lower + (upper - lower) * (0.5 + random.symmetric(0.5));
                    let quarter = std::f64::consts::FRAC_PI_2;
                    let near = random.symmetric(NEAR);
                    *q = match kind {
                        0 => anywhere,
                        1 => near,
                        _ => (anywhere / quarter).round() * quarter + near,
                    }
                    .clamp(lower.min(upper), upper.max(lower));
                }
            }
            q
        }
        "gravity" => vec![0.3, -0.2, -9.81],
        "qd" => (0..len).map(|_| random.symmetric(1.0)).collect(),
        // drives of the size of the weights
        _ => (0..len).map(|_| random.symmetric(10.0)).collect(),
    }
}

/// Turns the shafts of elastic transmissions to where their springs are hardly stretched, as they are while a robot moves.
pub(crate) fn settle(model: &Model<Dd>, groups: &mut [(&str, Vec<f64>)], random: &mut Random) {
    let named = |name: &str, groups: &[(&str, Vec<f64>)]| groups.iter().find(|g| g.0 == name).map(|g| g.1.clone());
    let (Some(q), Some(qd), Some(mut x)) = (named("q", groups), named("qd", groups), named("x", groups)) else {
        return;
    };
    let mut first = 0;
    for drive in &model.drives {
        let own = drive.actuator.states();
        let sum = |y: &[f64], index: fn(&Joint) -> usize| -> f64 {
            drive.joints.iter().map(|(body, n)| n.to_f64() * y[index(&model.bodies[*body].joint)]).sum()
        };
        let mut shaft = [sum(&q, |j| j.iq), sum(&qd, |j| j.iv)];
        for (k, stage) in drive.stages.iter().enumerate().rev() {
            shaft = shaft.map(|y| stage.ratio.to_f64() * (y + random.symmetric(STRETCH)));
            let at = if k == 0 { first } else { first + own + 2 * (k - 1) };
            x[at..at + 2].copy_from_slice(&shaft);
        }
        first += drive.states();
    }
    groups.iter_mut().filter(|g| g.0 == "x").for_each(|g| g.1.clone_from(&x));
}

/// States of each kind whose values [`samples`] gives: at about rest, where weights rule, and as fast as the joints may move.
const SAMPLES: usize = 8;

/// The values of all nodes at some states; `None` where a run-time parameter is an input.
pub fn samples(model: &Model<Dd>, graph: &Graph) -> Option<Vec<Vec<f64>>> {
    let at = |fast| states(model, &graph.inputs, SAMPLES, fast);
    let (slow, fast) = at(false).zip(at(true))?;
    Some(slow.iter().chain(&fast).map(|x| straightline_graph::expr::values(graph, x)).collect())
}
