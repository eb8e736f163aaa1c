//! Programs that bound the errors of another program at the state at hand: `…_error_bound` in generated code.
//!
//! # Running error bounds
//!
//! [`state_bound`] computes every value v̂ again, bit for bit, and beside it e with |v̂ − v| ≤ e, v the value over the real numbers:
//!
//! * v = a ± b: e = e_a + e_b + u |v̂| + t. What rounding adds is at most u |a ± b| and half an ulp, hence at most u |v̂|, and t for underflow.
//! * v = a b: |â b̂ − a b| ≤ |â| |b̂ − b| + |b| |â − a| ⇒ e = |â| e_b + (|b̂| + e_b) e_a + u |v̂| + t.
//! * sine and cosine: the kernel's proven error, and the angle's; constants: the distance to their rounding; −v, inputs: nothing of their own.
//!   (An input below the normal numbers must be given as zero where the machine reads it so.)
//!
//! The bound itself is rounded. It consists of sums and products of numbers ≥ 0, each rounded by a factor of 1 − u at least: n operations
//! lose a factor of 1 − n u at most, so that the last line multiplies by 1 + 2 n u. Products that underflow lose less than t, the
//! fourfold of the smallest normal number, which every operation adds.
//!
//! # Forward dynamics, from its residual
//!
//! Dividing keeps no useful interval, but a solution q̈̂ of H q̈ = τ − b, wherever it comes from, can be checked
//! ([`forward_dynamics_bound`]): with r = τ − ID(q, q̇, q̈̂) the error δ = q̈ − q̈̂ satisfies H δ = r. For any matrix R and M = I − R H,
//! δ = R r + M δ. Let b_i ≥ Σ_j |R_ij| |r_j|, and for weights s_i > 0 let c_i ≥ Σ_j |M_ij| / s_j, both with the running bounds of ID and H and
//! of their own sums. If a = max s_i c_i < 1, then M shrinks the norm max s_i |δ_i|, so that R and H are regular and that norm is at most
//! max s_k b_k / (1 − a); once more in δ = R r + M δ: |δ_i| ≤ b_i + c_i max_k s_k b_k / (1 − a) (Krawczyk; Rump 2010, section 10). A column of
//! H⁻¹ obeys the same with |R_ij| for b_i, and 1/λ ≤ ‖H⁻¹‖₂ ≤ Σ |H⁻¹_ij| bounds the smallest eigenvalue λ of the symmetric H from below.
//! R is what LᵀDL of the computed H gives, s_i the root of its H_ii; neither needs an error bound. Where a ≥ 1 nothing is proven, and
//! all is NaN, by the root of 1 − a.

use super::Format;
use crate::emit::Scalar;
use crate::expr::{Builder, Graph, NodeId, Op, Port, RuleSet};
use straightline_core::Dd;

/// More joints than these make the check of H δ = r too long.
const MOST_JOINTS: usize = 12;

/// A value, and a bound of its error; none if it is exact.
#[derive(Clone, Copy)]
struct Tracked {
    value: NodeId,
    error: Option<NodeId>,
}

/// A program that bounds what another one loses, at the same inputs: an output `…_error` for each output. None for programs with
/// divisions and roots, and where a sign is taken of what is no input.
pub fn state_bound(graph: &Graph, scalar: Scalar) -> Option<Graph> {
    state_bound_in(graph, Format::of(scalar))
}

pub(super) fn state_bound_in(graph: &Graph, format: Format) -> Option<Graph> {
    let mut program = Running::new(graph.inputs.clone(), format);
    let inputs = program.inputs();
    let results = program.follow(graph, &inputs)?;
    let errors = results.iter().map(|r| r.error).collect();
    let outputs = graph.outputs.iter().map(|p| Port::new(&format!("{}_error", p.name), &p.shape)).collect();
    program.finish(outputs, errors)
}

/// A program that bounds how far accelerations are from the exact ones: the inputs of forward dynamics and `qdd`, by inverse
/// dynamics and the mass matrix; with a lower bound of the smallest eigenvalue of H. None if these have divisions, take what forward
/// dynamics does not, or have too many joints.
pub fn forward_dynamics_bound(forward: &Graph, inverse: &Graph, mass_matrix: &Graph, scalar: Scalar) -> Option<Graph> {
    let n = inverse.results.len();
    let shape = |ports: &[Port], name: &str| ports.iter().find(|p| p.name == name).map(Port::len);
    if n > MOST_JOINTS || mass_matrix.results.len() != n * n || shape(&inverse.inputs, "qdd") != Some(n) {
        return None;
    }
    if shape(&forward.inputs, "tau") != Some(n) || shape(&forward.inputs, "qdd").is_some() {
        return None;
    }
    let ports: Vec<Port> = forward.inputs.iter().cloned().chain([Port::new("qdd", &[n])]).collect();
    let mut p = Running::new(ports.clone(), Format::of(scalar));
    let all = p.inputs();
    let of = |name: &str| -> Option<Vec<Tracked>> {
        let first: usize = ports.iter().take_while(|p| p.name != name).map(Port::len).sum();
        Some(all[first..first + shape(&ports, name)?].to_vec())
    };
    let inputs_of = |graph: &Graph| -> Option<Vec<Tracked>> {
        let parts: Option<Vec<Vec<Tracked>>> = graph.inputs.iter().map(|p| of(&p.name)).collect();
        Some(parts?.concat())
    };
    let torques = p.follow(inverse, &inputs_of(inverse)?)?;
    let h = p.follow(mass_matrix, &inputs_of(mass_matrix)?)?;
    // |r_j|
    let tau = of("tau")?;
    let residuals: Vec<NodeId> = (0..n)
        .map(|j| {
            let r = p.sum(tau[j], torques[j], true);
            let size = p.absolute(r.value);
            p.plus(size, r.error)
        })
        .collect();
    let computed: Vec<NodeId> = h.iter().map(|x| x.value).collect();
    let inverse = p.inverse(&computed, n);
    let sizes: Vec<NodeId> = inverse.iter().map(|x| p.absolute(*x)).collect();
    // what a product of R with column j can lose: E, and n + 4 roundings
    let u = (n as f64 + 4.0) * p.format.u;
    let losses: Vec<NodeId> = h
        .iter()
        .map(|x| {
            let size = p.absolute(x.value);
            let rounding = p.scaled(u, size);
            let loss = p.plus(rounding, x.error);
            p.plus_tiny(loss)
        })
        .collect();
    // s_i, and 1/s_j
    let weights: Vec<NodeId> = (0..n).map(|i| p.insert(Op::Sqrt(computed[i * n + i]))).collect();
    let one = p.constant(1.0);
    let units: Vec<NodeId> = weights.iter().map(|w| p.insert(Op::Div(one, *w))).collect();
    let mut bounds = Vec::new();
    let mut contractions = Vec::new();
    for i in 0..n {
        let products: Vec<NodeId> = (0..n).map(|j| p.insert(Op::Mul(sizes[i * n + j], residuals[j]))).collect();
        bounds.push(p.total(&products));
        let mut row = Vec::new();
        for j in 0..n {
            // I − R H, and what it may be off by
            let terms: Vec<NodeId> =
                (0..n).map(|k| p.insert(Op::Mul(inverse[i * n + k], computed[k * n + j]))).collect();
            let product = terms.into_iter().reduce(|a, b| p.insert(Op::Add(a, b))).expect("a robot has joints");
            let one = p.constant(if i == j { 1.0 } else { 0.0 });
            let difference = if i == j { p.insert(Op::Sub(one, product)) } else { product };
            let mut entry = vec![p.absolute(difference)];
            entry.extend((0..n).map(|k| p.insert(Op::Mul(sizes[i * n + k], losses[k * n + j]))));
            // the difference from one rounds too
            entry.push(p.constant(4.0 * p.format.u));
            let entry = p.total(&entry);
            row.push(p.insert(Op::Mul(entry, units[j])));
        }
        contractions.push(p.total(&row));
    }
    let slack = p.slack();
    let weighted: Vec<NodeId> = (0..n).map(|i| p.insert(Op::Mul(weights[i], bounds[i]))).collect();
    let most = p.greatest(&weighted);
    let weighted: Vec<NodeId> = (0..n).map(|i| p.insert(Op::Mul(weights[i], contractions[i]))).collect();
    let contraction = p.greatest(&weighted);
    let contraction = p.scaled(slack, contraction);
    let one = p.constant(1.0);
    let left = p.insert(Op::Sub(one, contraction));
    let root = p.insert(Op::Sqrt(left));
    let left = p.insert(Op::Mul(root, root));
    let most = p.insert(Op::Div(most, left));
    // a product of two bounds loses twice; the root, the difference and the quotient 4u of themselves each
    let twice = slack * slack * (1.0 + 64.0 * p.format.u);
    let errors = (0..n).map(|i| {
        let share = p.insert(Op::Mul(contractions[i], most));
        let bound = p.insert(Op::Add(bounds[i], share));
        Some(p.scaled(twice, bound))
    });
    let errors: Vec<Option<NodeId>> = errors.collect();
    // Σ |H⁻¹|, whose columns obey the same with |R_ij| for b_i
    let all = p.total(&sizes);
    let columns: Vec<NodeId> = (0..n)
        .map(|j| {
            let column: Vec<NodeId> = (0..n).map(|i| p.insert(Op::Mul(weights[i], sizes[i * n + j]))).collect();
            p.greatest(&column)
        })
        .collect();
    let columns = p.total(&columns);
    let rows = p.total(&contractions);
    let product = p.insert(Op::Mul(rows, columns));
    let rest = p.insert(Op::Div(product, left));
    let inverse = p.insert(Op::Add(all, rest));
    let eigenvalue = p.insert(Op::Div(one, inverse));
    // downwards, beyond what all bounds go upwards in the end
    let eigenvalue = p.scaled((1.0 - 64.0 * p.format.u) / (twice * slack * slack), eigenvalue);
    let outputs = vec![Port::new("qdd_error", &[n]), Port::new("smallest_eigenvalue", &[1])];
    let errors = errors.into_iter().chain([Some(eigenvalue)]).collect();
    p.finish(outputs, errors)
}

/// A program that is being written.
struct Running {
    b: Builder,
    format: Format,
    ports: Vec<Port>,
    operations: usize,
}

impl Running {
    fn new(ports: Vec<Port>, format: Format) -> Self {
        // no rules: values are to be the same bits
        let b = Builder::new(RuleSet::exact(crate::expr::Folding::DoubleDouble), ports.clone());
        Running { b, format, ports, operations: 0 }
    }

    fn insert(&mut self, op: Op) -> NodeId {
        self.operations += 1;
        self.b.insert(op)
    }

    fn constant(&mut self, x: f64) -> NodeId {
        self.b.constant(Dd::from(x))
    }

    fn inputs(&mut self) -> Vec<Tracked> {
        let count: usize = self.ports.iter().map(Port::len).sum();
        (0..count as u32).map(|k| Tracked { value: self.insert(Op::Input(k)), error: None }).collect()
    }

    /// x · sign x.
    fn absolute(&mut self, x: NodeId) -> NodeId {
        let sign = self.insert(Op::Sign(x));
        self.insert(Op::Mul(x, sign))
    }

    fn scaled(&mut self, factor: f64, x: NodeId) -> NodeId {
        let factor = self.constant(factor);
        self.insert(Op::Mul(factor, x))
    }

    fn plus(&mut self, a: NodeId, b: Option<NodeId>) -> NodeId {
        match b {
            Some(b) => self.insert(Op::Add(a, b)),
            None => a,
        }
    }

    fn plus_tiny(&mut self, a: NodeId) -> NodeId {
        let tiny = self.constant(4.0 * self.format.tiny);
        self.insert(Op::Add(a, tiny))
    }

    /// The greatest of numbers ≥ 0: (x + y + |x − y|)/2.
    fn greatest(&mut self, parts: &[NodeId]) -> NodeId {
        let greater = |a: NodeId, b: NodeId| {
            let (sum, difference) = (self.insert(Op::Add(a, b)), self.insert(Op::Sub(a, b)));
            let difference = self.absolute(difference);
            let twice = self.insert(Op::Add(sum, difference));
            self.scaled(0.5, twice)
        };
        let most = parts.iter().copied().reduce(greater).expect("there is a part");
        self.plus_tiny(most)
    }

    /// Of numbers ≥ 0.
    fn total(&mut self, parts: &[NodeId]) -> NodeId {
        let sum = parts.iter().copied().reduce(|a, b| self.insert(Op::Add(a, b))).expect("there is a part");
        self.plus_tiny(sum)
    }

    /// u |v̂| + t, and what else there is.
    fn rounded(&mut self, value: NodeId, others: Option<NodeId>) -> Tracked {
        let size = self.absolute(value);
        let own = self.scaled(self.format.u, size);
        let own = self.plus_tiny(own);
        Tracked { value, error: Some(self.plus(own, others)) }
    }

    fn sum(&mut self, a: Tracked, b: Tracked, minus: bool) -> Tracked {
        let op = if minus { Op::Sub(a.value, b.value) } else { Op::Add(a.value, b.value) };
        let value = self.insert(op);
        let others = match (a.error, b.error) {
            (Some(x), Some(y)) => Some(self.insert(Op::Add(x, y))),
            (x, y) => x.or(y),
        };
        self.rounded(value, others)
    }

    fn product(&mut self, a: Tracked, b: Tracked) -> Tracked {
        let value = self.insert(Op::Mul(a.value, b.value));
        let mut others = None;
        if let Some(e) = b.error {
            let size = self.absolute(a.value);
            others = Some(self.insert(Op::Mul(size, e)));
        }
        if let Some(e) = a.error {
            let size = self.absolute(b.value);
            let size = self.plus(size, b.error);
            let carried = self.insert(Op::Mul(size, e));
            others = Some(self.plus(carried, others));
        }
        self.rounded(value, others)
    }

    /// The values of a program once more, each with its error.
    fn follow(&mut self, graph: &Graph, inputs: &[Tracked]) -> Option<Vec<Tracked>> {
        let live = graph.live();
        let mut nodes: Vec<Option<Tracked>> = vec![None; graph.ops.len()];
        for (i, op) in graph.ops.iter().enumerate().filter(|(i, _)| live[*i]) {
            let of = |a: NodeId| nodes[a.index()].expect("operands stand before their users");
            let tracked = match *op {
                Op::Input(k) => inputs[k as usize],
                Op::Constant(c) => {
                    let (_, error) = self.format.constant(c.value());
                    let value = self.b.insert(*op);
                    let error = (error != 0.0).then(|| self.constant(error));
                    Tracked { value, error }
                }
                Op::Neg(a) => Tracked { value: self.insert(Op::Neg(of(a).value)), ..of(a) },
                Op::Add(a, b) => self.sum(of(a), of(b), false),
                Op::Sub(a, b) => self.sum(of(a), of(b), true),
                Op::Mul(a, b) => self.product(of(a), of(b)),
                Op::Sign(a) if of(a).error.is_none() => {
                    Tracked { value: self.insert(Op::Sign(of(a).value)), error: None }
                }
                // exact sums of inputs and constants, and what is exact with them
                Op::AngleSum(a, b) => {
                    let error = match (of(a).error, of(b).error) {
                        (Some(x), Some(y)) => Some(self.insert(Op::Add(x, y))),
                        (x, y) => x.or(y),
                    };
                    Tracked { value: self.insert(Op::AngleSum(of(a).value, of(b).value)), error }
                }
                Op::SinCos(a) => {
                    let pair = self.insert(Op::SinCos(of(a).value));
                    // right behind their pair
                    self.insert(Op::Sin(pair));
                    self.insert(Op::Cos(pair));
                    Tracked { value: pair, ..of(a) }
                }
                Op::Sin(p) | Op::Cos(p) => {
                    let pair = of(p);
                    let half = if matches!(op, Op::Sin(_)) { Op::Sin(pair.value) } else { Op::Cos(pair.value) };
                    let kernel = self.constant(self.format.trig_error(1.0));
                    Tracked { value: self.insert(half), error: Some(self.plus(kernel, pair.error)) }
                }
                Op::Div(..) | Op::Sqrt(_) | Op::Sign(_) => return None,
            };
            if let Some(name) = graph.notes[i].name {
                self.b.name(tracked.value, name);
            }
            nodes[i] = Some(tracked);
        }
        graph.results.iter().map(|r| nodes[r.index()]).collect()
    }

    /// The inverse of a symmetric matrix by LᵀDL, as good as rounding allows.
    fn inverse(&mut self, h: &[NodeId], n: usize) -> Vec<NodeId> {
        let mut h = h.to_vec();
        // (Featherstone 2008, table 6.3) for a tree of any shape: below the diagonal L, on it D
        for k in (0..n).rev() {
            for i in (0..k).rev() {
                let a = self.insert(Op::Div(h[k * n + i], h[k * n + k]));
                for j in 0..=i {
                    let product = self.insert(Op::Mul(h[k * n + j], a));
                    h[i * n + j] = self.insert(Op::Sub(h[i * n + j], product));
                }
                h[k * n + i] = a;
            }
        }
        // column c of H⁻¹ solves Lᵀ x = e_c, D y = x, L z = y
        let (zero, one) = (self.constant(0.0), self.constant(1.0));
        let mut inverse = vec![zero; n * n];
        for c in 0..n {
            let mut x: Vec<Option<NodeId>> = (0..n).map(|i| (i == c).then_some(one)).collect();
            for i in (0..n).rev() {
                let Some(xi) = x[i] else { continue };
                for j in 0..i {
                    let product = if xi == one { h[i * n + j] } else { self.insert(Op::Mul(h[i * n + j], xi)) };
                    x[j] = Some(match x[j] {
                        Some(xj) => self.insert(Op::Sub(xj, product)),
                        None => self.insert(Op::Neg(product)),
                    });
                }
            }
            let mut y: Vec<Option<NodeId>> = Vec::with_capacity(n);
            for (i, xi) in x.into_iter().enumerate() {
                let mut sum = xi.map(|xi| self.insert(Op::Div(xi, h[i * n + i])));
                for (j, yj) in y.clone().into_iter().enumerate() {
                    let Some(yj) = yj else { continue };
                    let product = self.insert(Op::Mul(h[i * n + j], yj));
                    sum = Some(match sum {
                        Some(sum) => self.insert(Op::Sub(sum, product)),
                        None => self.insert(Op::Neg(product)),
                    });
                }
                y.push(sum);
            }
            for (i, yi) in y.into_iter().enumerate() {
                inverse[i * n + c] = yi.unwrap_or(zero);
            }
        }
        inverse
    }

    /// What the roundings of the bounds themselves are worth so far.
    fn slack(&self) -> f64 {
        1.0 + 2.0 * self.operations as f64 * self.format.u
    }

    fn finish(mut self, outputs: Vec<Port>, errors: Vec<Option<NodeId>>) -> Option<Graph> {
        let slack = self.slack();
        if slack > 1.5 {
            return None;
        }
        let zero = self.constant(0.0);
        let results = errors.into_iter().map(|e| e.map_or(zero, |e| self.scaled(slack, e))).collect();
        Some(self.b.finish(outputs, results))
    }
}
