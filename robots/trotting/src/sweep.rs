//! One sweep of iterative LQR over contact modes: forwards the motion under the gains at hand, with its slopes at every node, backwards the
//! Riccati recursion. One sweep per period follows the best motion as it moves on (Diehl, Bock and Schlöder 2005, real-time iterations), and
//! slopes come with the motion, so that no function is called twice at a node.
//!
//! Nodes are h apart, and from one to the next goes the semi-implicit Euler step of the mode that holds there
//!
//! q̇⁺ = q̇ + h q̈(q, q̇, u + d),  q⁺ = q ⊕ h q̇⁺.
//!
//! Differences are δx = (δq, δq̇) with the trunk's in its own axes, so that δq⁺ = T δq + h δq̇⁺. T is the identity but for the rows
//! of the trunk, which moves on with v and turns with ω meanwhile: of its place 1 − h ω× by the place and −h v× by the turn, of its turn
//! 1 − h ω× by that.

use crate::gait::STEP;
use crate::quadruped::{
    after, difference, generalized_forces, Difference, Slopes, State, Torques, Velocity, JOINTS, NV, NX,
};
use crate::task::Task;

/// Nodes with torques; one more has none.
pub const NODES: usize = 32;

/// What one sweep did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Cost of the motion that was found forwards.
    pub cost: f64,
    /// By how much the step that was found backwards is to lower it.
    pub fall: f64,
}

/// Feedback about a motion: u = û + K (x ⊖ x̂).
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// Where the motion is at the node, and at the next.
    pub states: [State; 2],
    /// û \[N·m\].
    pub torques: Torques,
    /// K.
    pub gains: [Difference; JOINTS],
}

impl Law {
    /// Torques \[N·m\] at a measured state, a part of the way from the node to the next.
    pub fn at(&self, part: f64, measured: &State) -> Torques {
        // between nodes differences change in proportion
        let [from, to] = self.states.map(|state| difference(measured, &state));
        let off: Difference = core::array::from_fn(|i| from[i] + part * (to[i] - from[i]));
        core::array::from_fn(|i| self.torques[i] + crate::dot(&self.gains[i], &off))
    }
}

/// The solver, with the motion that it improves from sweep to sweep.
#[derive(Clone, Debug)]
pub struct Solver {
    /// States at the nodes.
    pub states: [State; NODES + 1],
    /// Torques from each to the next \[N·m\].
    pub torques: [Torques; NODES],
    /// Steps of the torques that were found backwards.
    steps: [Torques; NODES],
    /// Gains K of δu = K δx.
    pub gains: [[Difference; JOINTS]; NODES],
    /// Motion and forces at the nodes with their slopes.
    pub slopes: [Slopes; NODES],
}

impl Solver {
    /// At rest in a configuration, under torques that nearly hold the robot in the mode of each node.
    pub fn at_rest(state: &State, tasks: &[Task; NODES + 1]) -> Solver {
        Solver {
            states: [*state; NODES + 1],
            torques: core::array::from_fn(|k| tasks[k].hold),
            steps: [[0.0; JOINTS]; NODES],
            gains: [[[0.0; NX]; JOINTS]; NODES],
            slopes: [Slopes::ZERO; NODES],
        }
    }

    /// One sweep for the motion from `start` under a wrench on the trunk. `None` if a quadratic model has no minimum: the motion is no number.
    pub fn sweep(&mut self, tasks: &[Task; NODES + 1], start: &State, wrench: &[f64; 6]) -> Option<Sweep> {
        let cost = self.forwards(tasks, start, wrench);
        let fall = self.backwards(tasks)?;
        Some(Sweep { cost, fall })
    }

    /// The law of the first node, its step in it.
    pub fn law(&self) -> Law {
        let torques = core::array::from_fn(|i| self.torques[0][i] + self.steps[0][i]);
        Law { states: [self.states[0], self.states[1]], torques, gains: self.gains[0] }
    }

    /// The motion a node later; the last node stays, with its torques and without feedback that knows its mode.
    pub fn shift(&mut self) {
        self.states.rotate_left(1);
        self.states[NODES] = self.states[NODES - 1];
        self.torques.rotate_left(1);
        self.steps.rotate_left(1);
        self.gains.rotate_left(1);
        (self.steps[NODES - 1], self.gains[NODES - 1]) = ([0.0; JOINTS], [[0.0; NX]; JOINTS]);
        self.torques[NODES - 1] = self.torques[NODES - 2];
    }

    /// u = û + k + K (x ⊖ x̂) from node to node.
    fn forwards(&mut self, tasks: &[Task; NODES + 1], start: &State, wrench: &[f64; 6]) -> f64 {
        let (mut state, mut cost) = (*start, 0.0);
        for k in 0..NODES {
            let off = difference(&state, &self.states[k]);
            for i in 0..JOINTS {
                self.torques[k][i] += self.steps[k][i] + crate::dot(&self.gains[k][i], &off);
            }
            let u = &self.torques[k];
            self.slopes[k] = Slopes::of(tasks[k].mode, &state, &generalized_forces(wrench, u));
            cost += tasks[k].cost(&state, Some((u, &self.slopes[k])), STEP);
            self.states[k] = state;
            state = after(&state, &self.slopes[k].qdd, STEP);
        }
        self.states[NODES] = state;
        cost + tasks[NODES].cost(&state, None, tasks[NODES].weights.last)
    }

    /// The steps k and the gains K, and by how much the cost is to fall.
    fn backwards(&mut self, tasks: &[Task; NODES + 1]) -> Option<f64> {
        let mut after = tasks[NODES].quadratic(&self.states[NODES], None, tasks[NODES].weights.last);
        let mut fall = 0.0;
        for k in (0..NODES).rev() {
            let slopes = &self.slopes[k];
            let mut cost = tasks[k].quadratic(&self.states[k], Some((&self.torques[k], slopes)), STEP);
            let (a, b) = linear(&self.states[k + 1].qd, slopes);
            // Q_x = l_x + Aᵀ v, Q_u = l_u + Bᵀ v, Q_xx = l_xx + Aᵀ V A, Q_ux = l_ux + Bᵀ V A, Q_uu = l_uu + Bᵀ V B
            let (va, vb) = (product(&after.xx, &a), product(&after.xx, &b));
            add_transposed(&mut cost.xx, &a, &va);
            add_transposed(&mut cost.ux, &b, &va);
            add_transposed(&mut cost.uu, &b, &vb);
            for r in 0..NX {
                cost.x.iter_mut().zip(&a[r]).for_each(|(x, a)| *x += a * after.x[r]);
                cost.u.iter_mut().zip(&b[r]).for_each(|(u, b)| *u += b * after.x[r]);
            }
            let factor = Factor::new(&cost.uu)?;
            let mut step = cost.u.map(|x| [-x]);
            factor.solve(&mut step);
            let mut gains = cost.ux.map(|row| row.map(|x| -x));
            factor.solve(&mut gains);
            // V = Q_xx + Q_xu K, v = Q_x + Q_xu k
            for r in 0..JOINTS {
                let [s] = step[r];
                fall -= 0.5 * cost.u[r] * s;
                let row = cost.ux[r];
                cost.x.iter_mut().zip(&row).for_each(|(x, q)| *x += q * s);
                for i in 0..NX {
                    cost.xx[i].iter_mut().zip(&gains[r]).for_each(|(h, g)| *h += row[i] * g);
                }
            }
            symmetric(&mut cost.xx);
            (self.steps[k], self.gains[k]) = (step.map(|[x]| x), gains);
            after = cost;
        }
        Some(fall)
    }
}

/// A and B of δx⁺ = A δx + B δu about a node, after which the trunk moves with q̇⁺.
pub fn linear(qd: &Velocity, slopes: &Slopes) -> ([Difference; NX], [Torques; NX]) {
    let (mut a, mut b) = ([[0.0; NX]; NX], [[0.0; JOINTS]; NX]);
    for i in 0..NV {
        for j in 0..NV {
            let same = f64::from(u8::from(i == j));
            let (by_q, by_qd) = (STEP * slopes.dqdd_dq[i][j], same + STEP * slopes.dqdd_dqd[i][j]);
            (a[NV + i][j], a[NV + i][NV + j]) = (by_q, by_qd);
            (a[i][j], a[i][NV + j]) = (same + STEP * by_q, STEP * by_qd);
        }
        for j in 0..JOINTS {
            let by = STEP * slopes.dqdd_dtau[i][6 + j];
            (b[NV + i][j], b[i][j]) = (by, STEP * by);
        }
    }
    let (v, w) = ([qd[0], qd[1], qd[2]], [qd[3], qd[4], qd[5]]);
    for j in 0..3 {
        let unit = core::array::from_fn(|k| f64::from(u8::from(k == j)));
        let (turned, carried) = (crate::cross(&w, &unit), crate::cross(&v, &unit));
        for i in 0..3 {
            a[i][j] -= STEP * turned[i];
            a[3 + i][3 + j] -= STEP * turned[i];
            a[i][3 + j] -= STEP * carried[i];
        }
    }
    (a, b)
}

/// V B of a square V.
fn product<const M: usize>(v: &[Difference; NX], b: &[[f64; M]; NX]) -> [[f64; M]; NX] {
    let mut out = [[0.0; M]; NX];
    for i in 0..NX {
        for k in 0..NX {
            let v = v[i][k];
            out[i].iter_mut().zip(&b[k]).for_each(|(x, b)| *x += v * b);
        }
    }
    out
}

/// Adds Bᵀ Y.
fn add_transposed<const L: usize, const M: usize>(out: &mut [[f64; M]; L], b: &[[f64; L]; NX], y: &[[f64; M]; NX]) {
    for k in 0..NX {
        for i in 0..L {
            let b = b[k][i];
            out[i].iter_mut().zip(&y[k]).for_each(|(x, y)| *x += b * y);
        }
    }
}

/// Rounding makes a value unsymmetric, and what is not symmetric grows.
fn symmetric(value: &mut [Difference; NX]) {
    for i in 0..NX {
        for j in 0..i {
            let mean = 0.5 * (value[i][j] + value[j][i]);
            (value[i][j], value[j][i]) = (mean, mean);
        }
    }
}

/// The lower triangle L of a positive definite matrix L Lᵀ, with one over its diagonal in place of that.
#[derive(Clone, Copy, Debug)]
pub struct Factor<const N: usize>([[f64; N]; N]);

impl<const N: usize> Factor<N> {
    /// `None` if the matrix is not positive definite.
    pub fn new(matrix: &[[f64; N]; N]) -> Option<Self> {
        let mut l = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let rest = matrix[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
                l[i][j] = if i > j {
                    rest * l[j][j]
                } else if rest > 0.0 {
                    1.0 / straightline::Real::sqrt(rest)
                } else {
                    return None;
                };
            }
        }
        Some(Factor(l))
    }

    /// Replaces right-hand sides, which stand in the columns of b, by the solutions.
    pub fn solve<const M: usize>(&self, b: &mut [[f64; M]; N]) {
        for i in 0..N {
            for k in 0..i {
                let (l, above) = (self.0[i][k], b[k]);
                b[i].iter_mut().zip(above).for_each(|(x, y)| *x -= l * y);
            }
            b[i].iter_mut().for_each(|x| *x *= self.0[i][i]);
        }
        for i in (0..N).rev() {
            for k in i + 1..N {
                let (l, below) = (self.0[k][i], b[k]);
                b[i].iter_mut().zip(below).for_each(|(x, y)| *x -= l * y);
            }
            b[i].iter_mut().for_each(|x| *x *= self.0[i][i]);
        }
    }
}
