//! What is wanted, as costs of a state and a torque, with gradients and Gauss–Newton Hessians.

use crate::arm::{nearness, panda, points, points_and_slopes, Sphere, HAND, RADII, SPEED, TORQUE};
use crate::{dot, Joints, Square, NV};
use straightline::Real;

/// A state: q \[rad\], then q̇ \[rad/s\].
pub const NX: usize = 2 * NV;
/// Such a state.
pub type State = [f64; NX];

/// Both halves of a state.
pub fn halves(x: &State) -> (Joints, Joints) {
    (core::array::from_fn(|i| x[i]), core::array::from_fn(|i| x[NV + i]))
}

/// What is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// Where the hand is to be \[m\].
    pub goal: [f64; 3],
    /// What is to be kept clear of.
    pub spheres: &'a [Sphere],
    /// Torques that act beside the drives, as an observer knows them \[N·m\].
    pub disturbance: Joints,
    /// How much everything counts.
    pub weights: Weights,
}

/// How much everything counts: costs per second, of the last node in units of time of its own.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// Of the way from the hand to the goal \[1/m\]: w (√(d² + a²) − a).
    pub reach: f64,
    /// a \[m\]: farther away the pull is constant, so that the arm does not throw itself at a far goal.
    pub near: f64,
    /// Of squared speeds \[s²/rad²\].
    pub speed: f64,
    /// Of squared torques beside what holds the arm, as parts of the greatest.
    pub effort: f64,
    /// Of the square of what is missing of a distance to a sphere \[1/m²\].
    pub clear: f64,
    /// The distance that is kept, if it costs nothing else \[m\].
    pub distance: f64,
    /// Of the square of what a joint is beyond its range less a margin \[1/rad²\], and as much of speeds \[s²/rad²\].
    pub range: f64,
    /// The margin of positions \[rad\]; of speeds it is a fifth of the greatest.
    pub margin: f64,
    /// How many seconds the last node stands for.
    pub last: f64,
}

impl Weights {
    /// For an arm of a metre.
    pub const DEFAULT: Weights = Weights {
        reach: 40.0,
        near: 0.05,
        speed: 0.6,
        effort: 4.0,
        clear: 2e4,
        distance: 0.04,
        range: 1000.0,
        margin: 0.1,
        last: 0.5,
    };
}

/// Second order of a cost about a state and a torque: l + gᵀ z + ½ zᵀ H z.
#[derive(Clone, Copy, Debug)]
pub struct Quadratic {
    /// ∂l/∂x.
    pub x: State,
    /// ∂l/∂u.
    pub u: Joints,
    /// ∂²l/∂q².
    pub qq: Square,
    /// The diagonal of ∂²l/∂q̇²; beside it there is nothing.
    pub vv: Joints,
    /// ∂²l/∂u∂q.
    pub uq: Square,
    /// The diagonal of ∂²l/∂u².
    pub uu: Joints,
}

impl Quadratic {
    /// Of nothing.
    pub const ZERO: Quadratic = Quadratic {
        x: [0.0; NX],
        u: [0.0; NV],
        qq: [[0.0; NV]; NV],
        vv: [0.0; NV],
        uq: [[0.0; NV]; NV],
        uu: [0.0; NV],
    };
}

/// By how much x is above zero, with a bend from −w to w in which it is (x + w)² / 4w, and its slope, which is continuous.
fn above(x: f64, width: f64) -> [f64; 2] {
    let part = ((x + width) / (2.0 * width)).clamp(0.0, 1.0);
    // x where the bend is over: its own terms would round
    [if part < 1.0 { width * part * part } else { x }, part]
}

/// By how much x is beyond ± `most`, as [`above`] says, both ends together: of their squares the sum, half its slope, and the sum of the
/// squares of their slopes.
fn beyond(x: f64, most: f64, width: f64) -> [f64; 3] {
    let ([high, rises], [low, falls]) = (above(x - most, width), above(-x - most, width));
    [high * high + low * low, high * rises - low * falls, rises * rises + falls * falls]
}

/// Widths of the bends where costs of ranges begin \[rad, rad/s\], and of distances \[m\].
const WIDTHS: [f64; 3] = [0.05, 0.2, 0.01];

impl Task<'_> {
    /// What joint i has beyond its ranges less their margins, of the position and of the speed: [`beyond`].
    fn excess(&self, i: usize, x: &State) -> [[f64; 3]; 2] {
        let (low, high) = (panda::LOWER_LIMITS[i], panda::UPPER_LIMITS[i]);
        let half = 0.5 * (high - low) - self.weights.margin;
        [beyond(x[i] - 0.5 * (low + high), half, WIDTHS[0]), beyond(x[NV + i], 0.8 * SPEED[i], WIDTHS[1])]
    }

    /// Cost of a state for so many seconds, and of the torque \[N·m\] that acts there; the last state has none.
    pub fn cost(&self, x: &State, u: Option<&Joints>, seconds: f64) -> f64 {
        let w = &self.weights;
        let (q, qd) = halves(x);
        let at = points(&q);
        let way: [f64; 3] = core::array::from_fn(|i| at[HAND][i] - self.goal[i]);
        let mut cost = w.reach * (Real::sqrt(dot(&way, &way) + w.near * w.near) - w.near);
        cost += 0.5 * w.speed * dot(&qd, &qd);
        for i in 0..NV {
            let [position, speed] = self.excess(i, x);
            cost += 0.5 * w.range * (position[0] + speed[0]);
        }
        for sphere in self.spheres {
            for k in 0..RADII.len() {
                let [missing, _] = above(w.distance - nearness(&at, k, sphere).distance, WIDTHS[2]);
                cost += 0.5 * w.clear * missing * missing;
            }
        }
        if let Some(u) = u {
            let mut g = [0.0; NV];
            panda::gravity_force(&q, &mut g);
            for i in 0..NV {
                let part = (u[i] + self.disturbance[i] - g[i]) / TORQUE[i];
                cost += 0.5 * w.effort * part * part;
            }
        }
        cost * seconds
    }

    /// The same to second order. Of squares of residuals r the Hessian is (∂r)ᵀ ∂r: never negative.
    pub fn quadratic(&self, x: &State, u: Option<&Joints>, seconds: f64) -> Quadratic {
        let w = &self.weights;
        let (q, qd) = halves(x);
        let mut out = Quadratic::ZERO;
        let (at, slopes) = points_and_slopes(&q);
        let way: [f64; 3] = core::array::from_fn(|i| at[HAND][i] - self.goal[i]);
        let pull = seconds * w.reach / Real::sqrt(dot(&way, &way) + w.near * w.near);
        for (row, way) in slopes[HAND].iter().zip(way) {
            out.add_square(row, pull, way);
        }
        for i in 0..NV {
            let [position, speed] = self.excess(i, x);
            let range = seconds * w.range;
            out.x[i] += range * position[1];
            out.qq[i][i] += range * position[2];
            out.x[NV + i] += seconds * w.speed * qd[i] + range * speed[1];
            out.vv[i] += seconds * w.speed + range * speed[2];
        }
        for sphere in self.spheres {
            for k in 0..RADII.len() {
                let near = nearness(&at, k, sphere);
                let [missing, rises] = above(w.distance - near.distance, WIDTHS[2]);
                if rises > 0.0 {
                    // −∂d/∂q = nᵀ ((1 − t) J_k + t J_{k+1})
                    let row: Joints = core::array::from_fn(|j| {
                        let of = |p: usize| (0..3).map(|i| near.normal[i] * slopes[p][i][j]).sum::<f64>();
                        rises * ((1.0 - near.along) * of(k) + near.along * of(k + 1))
                    });
                    out.add_square(&row, seconds * w.clear, missing);
                }
            }
        }
        if let Some(u) = u {
            let (mut stiffness, mut g) = ([[0.0; NV]; NV], [0.0; NV]);
            panda::gravity_derivative(&q, &mut stiffness, &mut g);
            for i in 0..NV {
                // r = (u + d − g(q)) / u_max
                let weight = seconds * w.effort / (TORQUE[i] * TORQUE[i]);
                let off = u[i] + self.disturbance[i] - g[i];
                out.u[i] = weight * off;
                out.uu[i] = weight;
                out.uq[i] = stiffness[i].map(|s| -weight * s);
                let row = stiffness[i].map(|s| -s);
                out.add_square(&row, weight, off);
            }
        }
        out
    }
}

impl Quadratic {
    /// Adds ½ weight r(q)² of a residual with this slope.
    fn add_square(&mut self, slope: &Joints, weight: f64, residual: f64) {
        for i in 0..NV {
            let scaled = weight * slope[i];
            self.x[i] += scaled * residual;
            for j in 0..NV {
                self.qq[i][j] += scaled * slope[j];
            }
        }
    }
}
