//! The gait: which feet stand at a node, where the others are on their ways, and where the trunk is to be.
//!
//! Time is counted in nodes of [`STEP`]. Diagonal pairs swing in turn, with all feet down for a while in between; a walk has a first and a last
//! node, before and after which all feet stand.

use crate::quadruped::{Feet, Mode, State, FEET, STANDING};

/// From node to node \[s\].
pub const STEP: f64 = 0.01;
/// Nodes of a swing.
pub const SWING: i64 = 16;
/// Nodes of a swing and of the stance on four feet that follows.
pub const HALF: i64 = 20;
/// By how much a foot is lifted \[m\].
const LIFT: f64 = 0.04;
/// By how much below the ground its way ends \[m\]: it comes down before it is believed to stand.
const PRESS: f64 = 0.0005;
/// The part of a swing after which a foot is above where it lands: what comes down early must not be dragged.
const THERE: f64 = 0.8;
/// Seconds of speed that a foothold goes after: √(z/g) for a trunk at the height z, a pendulum's.
const CAPTURE: f64 = 0.15;
/// The trunk speeds up and slows down for so many nodes.
const RAMP: f64 = 40.0;

/// A walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gait {
    /// Its first node, at which two feet lift.
    pub first: i64,
    /// Its swings.
    pub swings: i64,
    /// How fast the trunk goes in between, ahead and to the left \[m/s\].
    pub speed: [f64; 2],
}

/// A foot on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// From 0 where it lifts to 1 where it lands.
    pub part: f64,
    /// The node at which it lands.
    pub lands: i64,
}

impl Gait {
    /// The mode from a node to the next.
    pub fn mode(&self, node: i64) -> Mode {
        let since = node - self.first;
        if since < 0 || since >= self.swings * HALF || since % HALF >= SWING {
            Mode::Four
        } else if (since / HALF) % 2 == 0 {
            Mode::FallingDiagonal
        } else {
            Mode::RisingDiagonal
        }
    }

    /// Where a foot is on its way at a node; `None` on the ground.
    pub fn swing(&self, node: i64, foot: usize) -> Option<Swing> {
        if self.mode(node).stands(foot) {
            return None;
        }
        let since = (node - self.first) % HALF;
        Some(Swing { part: since as f64 / SWING as f64, lands: node - since + SWING })
    }

    /// Place \[m\] and velocity \[m/s\] of the trunk's way at a node, at the height of [`STANDING`].
    pub fn trunk(&self, node: i64) -> ([f64; 3], [f64; 3]) {
        let (from, until) = (self.first as f64, (self.first + self.swings * HALF) as f64);
        let ([far, fast], [back, slow]) = [from, until - RAMP].map(|t| ramp((node as f64 - t) / RAMP)).into();
        let (way, rate) = (STEP * RAMP * (far - back), fast - slow);
        let along = |i: usize, x: f64| if i < 2 { self.speed[i] * x } else { 0.0 };
        (core::array::from_fn(|i| STANDING[i] + along(i, way)), core::array::from_fn(|i| along(i, rate)))
    }

    /// Where a foot lands that lifts with the trunk in such a state: its corner of the trunk half a swing later, and as much farther as the
    /// trunk is away from its way, and as a pendulum of its height goes on by its speed.
    pub fn foothold(&self, foot: usize, lands: i64, node: i64, measured: &State) -> [f64; 3] {
        let (ahead, _) = self.trunk(lands + HALF / 2);
        let (wanted, speed) = self.trunk(node);
        let axes = crate::quadruped::axes(&measured.q);
        let corner = CORNERS[foot];
        core::array::from_fn(|i| {
            let velocity: f64 = (0..3).map(|k| axes[k][i] * measured.qd[k]).sum();
            let off = measured.q[i] - wanted[i] + CAPTURE * (velocity - speed[i]);
            if i < 2 {
                ahead[i] + corner[i] + off.clamp(-0.1, 0.1)
            } else {
                0.0
            }
        })
    }
}

/// The integral of a smooth step from 0 to 1 \[in ramps\], and the step.
fn ramp(x: f64) -> [f64; 2] {
    let s = x.clamp(0.0, 1.0);
    [s * s * s * (1.0 - 0.5 * s) + (x - 1.0).max(0.0), s * s * (3.0 - 2.0 * s)]
}

/// Feet of the standing robot from the middle of the trunk \[m\].
const CORNERS: [[f64; 2]; FEET] = [[0.1946, 0.14695], [0.1946, -0.14695], [-0.1946, 0.14695], [-0.1946, -0.14695]];

/// Where the feet of the standing robot are.
pub const PLACES: Feet = {
    let mut places = [[0.0; 3]; FEET];
    let mut foot = 0;
    while foot < FEET {
        places[foot] = [CORNERS[foot][0], CORNERS[foot][1], 0.0];
        foot += 1;
    }
    places
};

/// Where a foot is on its way from a place to another.
pub fn on_its_way(from: &[f64; 3], to: &[f64; 3], part: f64) -> [f64; 3] {
    let [_, along] = ramp(part / THERE);
    let up = 64.0 * part * part * part * (1.0 - part) * (1.0 - part) * (1.0 - part);
    let [_, down] = ramp(part);
    core::array::from_fn(|i| {
        let way = from[i] + along * (to[i] - from[i]);
        if i < 2 {
            way
        } else {
            way + LIFT * up - PRESS * down
        }
    })
}
