//! What is wanted, as a sum of squares: the trunk on its way and level, the feet in the air on theirs, joints and speeds moderate, torques near
//! those that hold the robot up, forces of the ground within their cones.

use crate::dot;
use crate::gait::{on_its_way, Gait};
use crate::quadruped::{
    axes, feet, feet_slopes, holding, in_trunk, Difference, Feet, Mode, Slopes, State, Torques, Velocity, FEET, JOINTS,
    NV, NX, STANDING, TORQUE,
};
use straightline::Real;

/// Weights of squares; costs are per second.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// Of the trunk's place \[1/m²\].
    pub place: f64,
    /// Of its height \[1/m²\].
    pub height: f64,
    /// Of its turn \[1/rad²\].
    pub level: f64,
    /// Of its velocities \[s²/m²\] and \[s²/rad²\].
    pub speed: [f64; 2],
    /// Of the joints' angles from those of the standing robot \[1/rad²\], and of their speeds \[s²/rad²\].
    pub joints: [f64; 2],
    /// Of what a foot in the air is away from its way \[1/m²\].
    pub feet: f64,
    /// Of torques beside those that hold \[1/(N·m)²\].
    pub effort: f64,
    /// Of what torques have above [`MODERATE`] \[1/(N·m)²\].
    pub limit: f64,
    /// Of forces outside their cones \[1/N²\].
    pub cone: f64,
    /// How many seconds the last node stands for.
    pub last: f64,
}

impl Weights {
    /// For a robot of this size.
    pub const DEFAULT: Weights = Weights {
        place: 300.0,
        height: 2000.0,
        level: 300.0,
        speed: [20.0, 5.0],
        joints: [3.0, 0.03],
        feet: 2e4,
        effort: 1.0,
        limit: 100.0,
        cone: 2.0,
        last: 0.15,
    };
}

/// The friction that the controller counts on.
pub const FRICTION: f64 = 0.5;
/// The least force on a foot that stands \[N\].
pub const LEAST: f64 = 1.0;
/// From here on torques cost more \[N·m\].
pub const MODERATE: f64 = 0.85 * TORQUE;
/// Widths of the bends where costs begin: of forces \[N\], of torques \[N·m\].
const WIDTHS: [f64; 2] = [0.5, 0.1];

/// What is wanted at one node.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// Place of the trunk \[m\].
    pub place: [f64; 3],
    /// Its velocity \[m/s\], in the world.
    pub velocity: [f64; 3],
    /// Feet on the ground.
    pub mode: Mode,
    /// Where the others are to be \[m\].
    pub feet: Feet,
    /// Torques that hold the standing robot.
    pub hold: Torques,
    /// Weights.
    pub weights: Weights,
}

/// Second order of a cost about a state and torques: l + gᵀ z + ½ zᵀ H z.
#[derive(Clone, Copy, Debug)]
pub struct Quadratic {
    /// ∂l/∂x.
    pub x: Difference,
    /// ∂l/∂u.
    pub u: Torques,
    /// ∂²l/∂x².
    pub xx: [Difference; NX],
    /// ∂²l/∂u∂x.
    pub ux: [Difference; JOINTS],
    /// ∂²l/∂u².
    pub uu: [Torques; JOINTS],
}

impl Quadratic {
    /// Of nothing.
    pub const ZERO: Quadratic = Quadratic {
        x: [0.0; NX],
        u: [0.0; JOINTS],
        xx: [[0.0; NX]; NX],
        ux: [[0.0; NX]; JOINTS],
        uu: [[0.0; JOINTS]; JOINTS],
    };

    /// Adds ½ weight r² of a residual with these slopes by the first part of the state: Gauss and Newton, never negative.
    fn add<const N: usize>(&mut self, weight: f64, residual: f64, by_x: &[f64; N]) {
        for i in 0..N {
            let scaled = weight * by_x[i];
            if scaled != 0.0 {
                self.x[i] += scaled * residual;
                self.xx[i].iter_mut().zip(by_x).for_each(|(h, s)| *h += scaled * s);
            }
        }
    }

    /// The same of a residual that torques change, too.
    fn add_with_torques(&mut self, weight: f64, residual: f64, by_x: &Difference, by_u: &Torques) {
        self.add(weight, residual, by_x);
        for i in 0..JOINTS {
            let scaled = weight * by_u[i];
            self.u[i] += scaled * residual;
            self.ux[i].iter_mut().zip(by_x).for_each(|(h, s)| *h += scaled * s);
            self.uu[i].iter_mut().zip(by_u).for_each(|(h, s)| *h += scaled * s);
        }
    }

    /// The same of the difference i, or of its entry itself.
    fn add_entry(&mut self, weight: f64, residual: f64, i: usize) {
        self.x[i] += weight * residual;
        self.xx[i][i] += weight;
    }
}

/// By how much x is above zero, with a bend from −w to w in which it is (x + w)² / 4w, and its slope, which is continuous.
pub fn above(x: f64, width: f64) -> [f64; 2] {
    let part = ((x + width) / (2.0 * width)).clamp(0.0, 1.0);
    // x where the bend is over: its own terms would round
    [if part < 1.0 { width * part * part } else { x }, part]
}

impl Task {
    /// At a node of a gait, where feet have these places, or lifted from there.
    pub fn at(gait: &Gait, node: i64, now: i64, measured: &State, places: &Feet, weights: Weights) -> Task {
        let (place, velocity) = gait.trunk(node);
        let feet = core::array::from_fn(|foot| match gait.swing(node, foot) {
            None => places[foot],
            Some(swing) => {
                let lands = |at: i64| gait.foothold(foot, at, now, measured);
                // from where it lifted or stands, or where the swing ends that it is on now
                let from = match gait.swing(now, foot) {
                    Some(present) if present.lands != swing.lands => lands(present.lands),
                    _ => places[foot],
                };
                on_its_way(&from, &lands(swing.lands), swing.part)
            }
        });
        let mode = gait.mode(node);
        Task { place, velocity, mode, feet, hold: holding(mode, &STANDING), weights }
    }

    /// Cost of a state for so many seconds, and of torques \[N·m\] and the forces of the ground \[N\]; the last state has none.
    pub fn cost(&self, state: &State, motion: Option<(&Torques, &Slopes)>, seconds: f64) -> f64 {
        let mut cost = 0.0;
        self.each_of_state(state, |weight, r, _| cost += 0.5 * weight * r * r);
        if let Some((u, slopes)) = motion {
            self.each_of_motion(u, slopes, |weight, r, _, _| cost += 0.5 * weight * r * r);
        }
        cost * seconds
    }

    /// The same to second order.
    pub fn quadratic(&self, state: &State, motion: Option<(&Torques, &Slopes)>, seconds: f64) -> Quadratic {
        let mut out = Quadratic::ZERO;
        self.each_of_state(state, |weight, r, by| match by {
            By::Entry(i) => out.add_entry(weight * seconds, r, i),
            By::Pose(row) => out.add(weight * seconds, r, row),
        });
        if let Some((u, slopes)) = motion {
            self.each_of_motion(u, slopes, |weight, r, by_x, by_u| match by_x {
                Some(by_x) => out.add_with_torques(weight * seconds, r, by_x, by_u),
                None => {
                    for i in 0..JOINTS {
                        out.u[i] += weight * seconds * r * by_u[i];
                        out.uu[i][i] += weight * seconds * by_u[i] * by_u[i];
                    }
                }
            });
        }
        out
    }

    /// Residuals of the state, with their weights and slopes.
    fn each_of_state(&self, state: &State, mut each: impl FnMut(f64, f64, By)) {
        let (w, State { q, qd }) = (&self.weights, state);
        let axes = axes(q);
        for i in 0..3 {
            // ∂p/∂δ = R
            let row: [f64; 3] = core::array::from_fn(|k| axes[k][i]);
            each(if i < 2 { w.place } else { w.height }, q[i] - self.place[i], By::Pose(&pose_row(&row, 0)));
            // of twice the quaternion's vector v: w 1 + v×
            let v = [q[3], q[4], q[5]];
            let mut turn = crate::cross(&core::array::from_fn(|k| f64::from(u8::from(k == i))), &v);
            turn[i] += q[6];
            each(w.level, 2.0 * v[i], By::Pose(&pose_row(&turn, 3)));
        }
        let velocity = in_trunk(q, &self.velocity);
        for i in 0..3 {
            each(w.speed[0], qd[i] - velocity[i], By::Entry(NV + i));
            each(w.speed[1], qd[3 + i], By::Entry(NV + 3 + i));
        }
        for i in 6..NV {
            each(w.joints[0], q[i + 1] - STANDING[i + 1], By::Entry(i));
            each(w.joints[1], qd[i], By::Entry(NV + i));
        }
        if self.mode == Mode::Four {
            return;
        }
        let (places, slopes) = (feet(q), feet_slopes(q));
        for foot in (0..FEET).filter(|foot| !self.mode.stands(*foot)) {
            for i in 0..3 {
                each(w.feet, places[foot][i] - self.feet[foot][i], By::Pose(&slopes[foot][i]));
            }
        }
    }

    /// Residuals of torques and of forces of the ground, with their weights and slopes by state and torques; none by the state of what is
    /// torques alone, which are apart from each other.
    fn each_of_motion(
        &self,
        u: &Torques,
        slopes: &Slopes,
        mut each: impl FnMut(f64, f64, Option<&Difference>, &Torques),
    ) {
        let w = &self.weights;
        for i in 0..JOINTS {
            let unit = |x: f64| core::array::from_fn(|k| if k == i { x } else { 0.0 });
            each(w.effort, u[i] - self.hold[i], None, &unit(1.0));
            let ([high, rises], [low, falls]) = (above(u[i] - MODERATE, WIDTHS[1]), above(-u[i] - MODERATE, WIDTHS[1]));
            if high > 0.0 || low > 0.0 {
                each(w.limit, high - low, None, &unit(rises + falls));
            }
        }
        for foot in (0..FEET).filter(|foot| self.mode.stands(*foot)) {
            let [x, y, z] = [0, 1, 2].map(|i| slopes.force[3 * foot + i]);
            // √(x² + y²) − μ z, smooth at zero: a ten thousandth of a newton squared is no force
            let across = Real::sqrt(x * x + y * y + 1e-4);
            for (residual, by) in
                [(across - FRICTION * z, [x / across, y / across, -FRICTION]), (LEAST - z, [0.0, 0.0, -1.0])]
            {
                let [missing, rises] = above(residual, WIDTHS[0]);
                if rises == 0.0 {
                    continue;
                }
                let rows = |of: &[Velocity; 3 * FEET], k: usize| -> f64 {
                    rises * (0..3).map(|i| by[i] * of[3 * foot + i][k]).sum::<f64>()
                };
                let by_x = core::array::from_fn(|k| match k {
                    0..NV => rows(&slopes.dforce_dq, k),
                    _ => rows(&slopes.dforce_dqd, k - NV),
                });
                let by_u = core::array::from_fn(|k| rows(&slopes.dforce_dtau, 6 + k));
                each(w.cone, missing, Some(&by_x), &by_u);
            }
        }
    }
}

/// What a residual of the state depends on.
enum By<'a> {
    /// One entry of the difference, as it is.
    Entry(usize),
    /// The configuration.
    Pose(&'a Velocity),
}

fn pose_row(part: &[f64; 3], first: usize) -> Velocity {
    core::array::from_fn(|k| if (first..first + 3).contains(&k) { part[k - first] } else { 0.0 })
}

/// By how much a force of the ground is within its cone: μ F_z − √(F_x² + F_y²) \[N\].
pub fn within_cone(force: &[f64; 3], friction: f64) -> f64 {
    friction * force[2] - Real::sqrt(dot(&[force[0], force[1]], &[force[0], force[1]]))
}
