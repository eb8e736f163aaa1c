//! States of a robot at which programs are tried: the one sampler. Choices between forms follow from its numbers, so that their order is part of
//! what is generated.

#[cfg(feature = "verify")]
pub(crate) mod drives;

use crate::function::Quantity;
use std::collections::BTreeMap;
use straightline_core::drive::Drive;
use straightline_core::model::{Joint, Model};
use straightline_core::random::Random;
use straightline_core::Dd;
use straightline_graph::expr::{Graph, Port};
use straightline_graph::lanes::LaneTemplate;

/// Of the numbers that states are made of.
pub(crate) const SEED: u64 = 0x9e37_79b9_7f4a_7c15;
/// What is no quantity of the robot is tried within ± so much.
const TRIED: f64 = 10.0;
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
const NO_LIMIT: f64 = 1e6;

/// What stands for each input, by name.
pub(crate) type InputState<T> = BTreeMap<String, Vec<T>>;

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

/// As many states beside one another, of inputs by themselves: of each an array, state after state.
pub fn random_inputs(model: &Model<Dd>, inputs: &[Port], count: usize) -> Vec<Vec<f64>> {
    let mut random = Random(SEED);
    let mut all: Vec<Vec<f64>> = vec![Vec::new(); inputs.len()];
    for _ in 0..count {
        for (port, x) in inputs.iter().zip(&mut all) {
            x.extend(of_port(model, port, false, &mut random));
        }
    }
    all
}

/// One of these states, of one port.
pub(crate) fn of_port(model: &Model<Dd>, port: &Port, fast: bool, random: &mut Random) -> Vec<f64> {
    let mut x = values(model, port, Kind::Anywhere, random);
    match Quantity::of(port) {
        Some(Quantity::Velocity) if fast && port.len() == model.nv() => {
            for joint in model.independent_joints().filter(|j| j.kind.is_single()) {
                x[joint.iv] *= within(joint.limits.velocity, FAST);
            }
        }
        Some(Quantity::Acceleration) if !fast => x.iter_mut().for_each(|x| *x *= SLOW),
        _ => {}
    }
    x
}

/// Where a robot stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Within the limits of its joints.
    Anywhere,
    /// Nearly at zero.
    Stretched,
    /// Near multiples of a right angle.
    RightAngled,
}

/// Values of an input port.
pub(crate) fn values(model: &Model<Dd>, port: &Port, kind: Kind, random: &mut Random) -> Vec<f64> {
    let len = port.len();
    match Quantity::of(port) {
        Some(quantity) if quantity.is_configuration() && len == model.nq() => configuration(model, kind, random),
        Some(Quantity::Gravity) => vec![0.3, -0.2, -9.81],
        quantity => {
            let (least, most) = quantity.map_or((-TRIED, TRIED), Quantity::tried);
            (0..len).map(|_| 0.5 * (least + most) + random.symmetric(0.5 * (most - least))).collect()
        }
    }
}

fn configuration(model: &Model<Dd>, kind: Kind, random: &mut Random) -> Vec<f64> {
    let mut q = vec![0.0; model.nq()];
    for joint in model.free_joints() {
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
                Kind::Anywhere => anywhere,
                Kind::Stretched => near,
                Kind::RightAngled => (anywhere / quarter).round() * quarter + near,
            }
            .clamp(lower.min(upper), upper.max(lower));
        }
    }
    assembled(model, q)
}

/// The configuration nearest to these independent coordinates that the robot's own assembly reaches.
pub(crate) fn assembled(model: &Model<Dd>, q: Vec<f64>) -> Vec<f64> {
    match model.closure.is_empty() {
        true => q,
        false => model.cast::<f64>().assembled(&q),
    }
}

/// Mass, centre of mass and inertia about it of a body that may be.
pub(crate) fn body(random: &mut Random) -> [Vec<f64>; 3] {
    let mut any = |least: f64, most: f64| least + (most - least) * random.unit();
    let mass = any(0.1, 3.0);
    let com = (0..3).map(|_| any(-0.2, 0.2)).collect();
    let [xx, yy, zz] = [0; 3].map(|_| any(0.02, 0.03));
    let [xy, xz, yz] = [0; 3].map(|_| any(-0.004, 0.004));
    [vec![mass], com, vec![xx, xy, xz, yy, yz, zz]]
}

/// One such body: mass, centre of mass, and inertia about it (xx, xy, xz, yy, yz, zz).
pub(crate) const BODY: [f64; 10] = [1.5, 0.02, -0.03, 0.05, 0.021, 0.001, -0.002, 0.024, 0.0015, 0.028];

/// Angle and speed of the last shaft of a drive.
fn last_shaft(model: &Model<Dd>, drive: &Drive<Dd>, q: &[f64], qd: &[f64]) -> [f64; 2] {
    let sum = |y: &[f64], index: fn(&Joint) -> usize| -> f64 {
        drive.joints.iter().map(|(body, n)| n.to_f64() * y[index(&model.bodies[*body].joint)]).sum()
    };
    [sum(q, |j| j.iq), sum(qd, |j| j.iv)]
}

/// Turns the shafts of elastic transmissions to where their springs are hardly stretched, as they are while a robot moves.
pub(crate) fn settle(model: &Model<Dd>, ports: &[Port], values: &mut [Vec<f64>], random: &mut Random) {
    let place = |quantity| ports.iter().position(|port| Quantity::of(port) == Some(quantity));
    let places = [Quantity::Configuration, Quantity::Velocity, Quantity::DriveState].map(place);
    let [Some(q), Some(qd), Some(x)] = places else { return };
    let mut first = 0;
    for drive in &model.drives {
        let own = drive.actuator.states();
        let mut shaft = last_shaft(model, drive, &values[q], &values[qd]);
        for (k, stage) in drive.stages.iter().enumerate().rev() {
            shaft = shaft.map(|y| stage.ratio.to_f64() * (y + random.symmetric(STRETCH)));
            let at = if k == 0 { first } else { first + own + 2 * (k - 1) };
            values[x][at..at + 2].copy_from_slice(&shaft);
        }
        first += drive.states();
    }
}

/// States of each kind whose values [`samples`] gives: at about rest, where weights rule, and as fast as the joints may move.
const SAMPLES: usize = 8;

/// The values of all nodes at some states; `None` where a run-time parameter is an input.
pub fn samples(model: &Model<Dd>, graph: &Graph) -> Option<Vec<Vec<f64>>> {
    let at = |fast| states(model, &graph.inputs, SAMPLES, fast);
    let (slow, fast) = at(false).zip(at(true))?;
    Some(slow.iter().chain(&fast).map(|x| straightline_graph::expr::values(graph, x)).collect())
}

/// The same of a template of lanes, lane after lane.
pub(crate) fn lane_samples(model: &Model<Dd>, template: &LaneTemplate) -> Option<Vec<Vec<f64>>> {
    let at = |fast| states(model, template.inputs(), SAMPLES, fast);
    let (slow, fast) = at(false).zip(at(true))?;
    Some(slow.iter().chain(&fast).enumerate().map(|(lane, x)| template.values(x, lane)).collect())
}
