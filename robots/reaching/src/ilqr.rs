//! Iterative LQR with limits of torques: one sweep linearises the motion, goes backwards over quadratic models, and forwards again
//! (Li and Todorov 2004; with limits Tassa, Mansard and Todorov 2014).
//!
//! Nodes are h apart, and from one to the next goes the semi-implicit Euler step
//!
//! q̇⁺ = q̇ + h q̈(q, q̇, u + d),  q⁺ = q + h q̇⁺.
//!
//! In (q, q̇⁺) in place of (q⁺, q̇⁺) only half of the state changes, δq̇⁺ = F (δq, δq̇) + G δu with F = h ∂q̈/∂(q, q̇) + (0 I) and G = h H⁻¹,
//! which saves more than half of the products of the recursion.

use crate::arm::{panda, TORQUE};
use crate::box_program::minimum;
use crate::task::{halves, Quadratic, State, Task, NX};
use crate::{dot, Joints, Square, NV};

/// Nodes with a torque; one more has none.
pub const NODES: usize = 30;
/// From node to node \[s\].
pub const STEP: f64 = 0.02;

/// Torques and the motion that follows.
#[derive(Clone, Copy, Debug)]
pub struct Trajectory {
    /// States at the nodes.
    pub x: [State; NODES + 1],
    /// Torques from each to the next \[N·m\].
    pub u: [Joints; NODES],
    /// What it costs.
    pub cost: f64,
}

/// What one sweep did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Cost of the torques at hand from the state that was told.
    pub before: f64,
    /// Cost afterwards: never greater.
    pub after: f64,
    /// Part of the step that was taken; zero if none lowered the cost.
    pub part: f64,
    /// Rollouts of the search along the step.
    pub trials: u32,
    /// Torques of all nodes that are at a limit.
    pub at_limits: u32,
}

/// A linear model from a node to the next: δq̇⁺ = F δx + G δu.
#[derive(Clone, Copy, Debug)]
struct Linear {
    f: [State; NV],
    g: Square,
}

/// The solver, with the motion that it improves from sweep to sweep.
#[derive(Clone, Debug)]
pub struct Solver {
    /// The best motion so far.
    pub motion: Trajectory,
    /// Gains K of δu = K δx at the nodes.
    pub gains: [[State; NV]; NODES],
    /// By how much steps are held back: what curvature the costs of torques have more than they have.
    damping: f64,
    trial: Trajectory,
    open: [Joints; NODES],
    linear: [Linear; NODES],
    costs: [Quadratic; NODES + 1],
}

/// By how much predicted decreases have to come true.
const ARMIJO: f64 = 1e-3;
/// Between these steps are held back the more the smaller the parts are that can be taken (Levenberg and Marquardt).
const LEAST_DAMPING: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e6;
/// Parts of the step that are tried, each half of the one before.
const TRIALS: u32 = 5;

impl Solver {
    /// At rest in a configuration, held there by torques against gravity.
    pub fn at_rest(q: &Joints) -> Solver {
        let mut hold = [0.0; NV];
        panda::gravity_force(q, &mut hold);
        let x: State = core::array::from_fn(|i| if i < NV { q[i] } else { 0.0 });
        let motion = Trajectory { x: [x; NODES + 1], u: [hold; NODES], cost: f64::INFINITY };
        let linear = Linear { f: [[0.0; NX]; NV], g: [[0.0; NV]; NV] };
        Solver {
            motion,
            gains: [[[0.0; NX]; NV]; NODES],
            damping: LEAST_DAMPING,
            trial: motion,
            open: [[0.0; NV]; NODES],
            linear: [linear; NODES],
            costs: [Quadratic::ZERO; NODES + 1],
        }
    }

    /// One sweep for the motion from `start`: the motion at hand follows from there under its gains, is linearised, and improved.
    pub fn sweep(&mut self, task: &Task, start: &State) -> Sweep {
        self.roll_out(task, start, 0.0);
        core::mem::swap(&mut self.motion, &mut self.trial);
        let before = self.motion.cost;
        self.linearise(task);
        let nothing = Sweep { before, after: before, part: 0.0, trials: 0, at_limits: 0 };
        let Some([slope, curvature]) = self.recur() else { return nothing };
        let mut part = 1.0;
        for trials in 1..=TRIALS {
            self.roll_out(task, start, part);
            let predicted = part * (slope + 0.5 * part * curvature);
            // a cost that is no number is no better
            if self.trial.cost <= before + ARMIJO * predicted {
                core::mem::swap(&mut self.motion, &mut self.trial);
                let is_at_limit = |(u, most): (&f64, &f64)| u.abs() >= *most;
                let of = |u: &Joints| u.iter().zip(&TORQUE).filter(|pair| is_at_limit(*pair)).count() as u32;
                let at_limits = self.motion.u.iter().map(of).sum();
                let change = if trials == 1 {
                    0.25
                } else if trials == 2 {
                    1.0
                } else {
                    8.0
                };
                self.damping = (change * self.damping).clamp(LEAST_DAMPING, MOST_DAMPING);
                return Sweep { before, after: self.motion.cost, part, trials, at_limits };
            }
            part *= 0.5;
        }
        self.damping = (64.0 * self.damping).min(MOST_DAMPING);
        Sweep { trials: TRIALS, ..nothing }
    }

    /// The motion from `start` with this part of the step into `trial`: u = û + part k + K (x − x̂), within the limits.
    fn roll_out(&mut self, task: &Task, start: &State, part: f64) {
        let mut x = *start;
        let mut cost = 0.0;
        for k in 0..NODES {
            let off: State = core::array::from_fn(|i| x[i] - self.motion.x[k][i]);
            let u: Joints = core::array::from_fn(|i| {
                let asked = self.motion.u[k][i] + part * self.open[k][i] + dot(&self.gains[k][i], &off);
                asked.max(-TORQUE[i]).min(TORQUE[i])
            });
            cost += task.cost(&x, Some(&u), STEP);
            (self.trial.x[k], self.trial.u[k]) = (x, u);
            x = after(&x, &u, &task.disturbance, STEP);
        }
        self.trial.x[NODES] = x;
        self.trial.cost = cost + task.cost(&x, None, task.weights.last);
    }

    /// Dynamics and costs about the motion.
    fn linearise(&mut self, task: &Task) {
        for k in 0..NODES {
            let (x, u) = (&self.motion.x[k], &self.motion.u[k]);
            let (q, qd) = halves(x);
            let tau: Joints = core::array::from_fn(|i| u[i] + task.disturbance[i]);
            let (mut qdd, mut by_q, mut by_qd, mut inverse) =
                ([0.0; NV], [[0.0; NV]; NV], [[0.0; NV]; NV], [[0.0; NV]; NV]);
            panda::forward_dynamics_derivatives(&q, &qd, &tau, &mut qdd, &mut by_q, &mut by_qd, &mut inverse);
            let linear = &mut self.linear[k];
            for i in 0..NV {
                for j in 0..NV {
                    linear.f[i][j] = STEP * by_q[i][j];
                    linear.f[i][NV + j] = STEP * by_qd[i][j];
                    linear.g[i][j] = STEP * inverse[i][j];
                }
                linear.f[i][NV + i] += 1.0;
            }
            self.costs[k] = task.quadratic(x, Some(u), STEP);
        }
        self.costs[NODES] = task.quadratic(&self.motion.x[NODES], None, task.weights.last);
    }

    /// Backwards over the nodes: the steps k and the gains K. The slope and the curvature of the cost along the whole step; `None` if a
    /// quadratic model has no minimum.
    fn recur(&mut self) -> Option<[f64; 2]> {
        let last = &self.costs[NODES];
        let mut p = last.x;
        let mut value = [[0.0; NX]; NX];
        add_state_costs(&mut value, last);
        let (mut slope, mut curvature) = (0.0, 0.0);
        for k in (0..NODES).rev() {
            let (linear, cost) = (&self.linear[k], &self.costs[k]);
            let after = InVelocity::of(&value, &p);
            // Y = V_vq (I 0) + V_vv F;  Q_ux = l_ux + G Y,  Q_uu = l_uu + G V_vv G, as G is symmetric
            let mut y = product(&after.vv, &linear.f);
            for i in 0..NV {
                for j in 0..NV {
                    y[i][j] += after.qv[j][i];
                }
            }
            let mut by_state = product(&linear.g, &y);
            let mut by_torque = product(&linear.g, &product(&after.vv, &linear.g));
            let mut gradient = cost.u;
            for i in 0..NV {
                gradient[i] += dot(&linear.g[i], &after.v);
                by_torque[i][i] += (1.0 + self.damping) * cost.uu[i];
                for j in 0..NV {
                    by_state[i][j] += cost.uq[i][j];
                }
            }
            let u = &self.motion.u[k];
            let (low, high) = (core::array::from_fn(|i| -TORQUE[i] - u[i]), core::array::from_fn(|i| TORQUE[i] - u[i]));
            let (step, factor) = minimum(&by_torque, &gradient, &low, &high, &[0.0; NV])?;
            let gains = factor.solved(by_state).map(|row| row.map(|x| -x));
            slope += dot(&gradient, &step);
            curvature += (0..NV).map(|i| step[i] * dot(&by_torque[i], &step)).sum::<f64>();
            // V = Q_xx + Q_xu K and v = Q_x + Q_xu k, where what a limit holds has no gain
            let mut next = product_transposed(&linear.f, &y);
            let own = product(&after.qv, &linear.f);
            for i in 0..NV {
                for j in 0..NX {
                    next[i][j] += own[i][j];
                }
                for j in 0..NV {
                    next[i][j] += after.qq[i][j];
                }
            }
            add_state_costs(&mut next, cost);
            let mut towards = cost.x;
            for i in 0..NV {
                towards[i] += after.q[i];
                for j in 0..NX {
                    towards[j] += linear.f[i][j] * after.v[i] + by_state[i][j] * step[i];
                }
            }
            add_product_transposed(&mut next, &by_state, &gains);
            symmetric(&mut next);
            (value, p) = (next, towards);
            (self.open[k], self.gains[k]) = (step, gains);
        }
        Some([slope, curvature])
    }

    /// The motion a little later, `part` of a node: between nodes it is linear, behind the last one nothing changes.
    pub fn shift(&mut self, part: f64) {
        for k in 0..NODES {
            let next = if k + 1 < NODES { self.motion.u[k + 1] } else { self.motion.u[k] };
            for i in 0..NV {
                self.motion.u[k][i] += part * (next[i] - self.motion.u[k][i]);
            }
            for i in 0..NX {
                self.motion.x[k][i] += part * (self.motion.x[k + 1][i] - self.motion.x[k][i]);
            }
        }
    }
}

/// The state one step of `h` later under torques u and d \[N·m\].
pub fn after(x: &State, u: &Joints, d: &Joints, h: f64) -> State {
    let (q, qd) = halves(x);
    let tau: Joints = core::array::from_fn(|i| u[i] + d[i]);
    let mut qdd = [0.0; NV];
    panda::forward_dynamics(&q, &qd, &tau, &mut qdd);
    let next: Joints = core::array::from_fn(|i| qd[i] + h * qdd[i]);
    core::array::from_fn(|i| if i < NV { q[i] + h * next[i] } else { next[i - NV] })
}

/// A value V, v of (q⁺, q̇⁺) as one of (q, q̇⁺): q⁺ = q + h q̇⁺.
struct InVelocity {
    qq: Square,
    qv: Square,
    vv: Square,
    q: Joints,
    v: Joints,
}

impl InVelocity {
    fn of(value: &[State; NX], p: &State) -> InVelocity {
        let block =
            |i: usize, j: usize| -> Square { core::array::from_fn(|r| core::array::from_fn(|c| value[i + r][j + c])) };
        let (qq, mut qv, mut vv) = (block(0, 0), block(0, NV), block(NV, NV));
        for i in 0..NV {
            for j in 0..NV {
                vv[i][j] += STEP * (qv[i][j] + qv[j][i] + STEP * qq[i][j]);
            }
        }
        for i in 0..NV {
            for j in 0..NV {
                qv[i][j] += STEP * qq[i][j];
            }
        }
        let (q, v) = halves(p);
        InVelocity { qq, qv, vv, q, v: core::array::from_fn(|i| v[i] + STEP * q[i]) }
    }
}

fn add_state_costs(value: &mut [State; NX], cost: &Quadratic) {
    for i in 0..NV {
        for j in 0..NV {
            value[i][j] += cost.qq[i][j];
        }
        value[NV + i][NV + i] += cost.vv[i];
    }
}

/// A B.
fn product<const M: usize>(a: &Square, b: &[[f64; M]; NV]) -> [[f64; M]; NV] {
    let mut out = [[0.0; M]; NV];
    for i in 0..NV {
        for k in 0..NV {
            let a = a[i][k];
            out[i].iter_mut().zip(&b[k]).for_each(|(x, b)| *x += a * b);
        }
    }
    out
}

/// Fᵀ Y.
fn product_transposed(f: &[State; NV], y: &[State; NV]) -> [State; NX] {
    let mut out = [[0.0; NX]; NX];
    add_product_transposed(&mut out, f, y);
    out
}

fn add_product_transposed(out: &mut [State; NX], f: &[State; NV], y: &[State; NV]) {
    for k in 0..NV {
        for i in 0..NX {
            let f = f[k][i];
            out[i].iter_mut().zip(&y[k]).for_each(|(x, y)| *x += f * y);
        }
    }
}

/// Rounding makes a value unsymmetric, and what is not symmetric grows.
fn symmetric(value: &mut [State; NX]) {
    for i in 0..NX {
        for j in 0..i {
            let mean = 0.5 * (value[i][j] + value[j][i]);
            (value[i][j], value[j][i]) = (mean, mean);
        }
    }
}
