//! WᵀHW = D + B of a mass matrix: what proves it definite, and bounds solutions with it. The proof is in [`residual`](super::residual).

use super::running::{BrokenProof, Running, Tracked};
use super::FloatFormat;
use crate::expr::{NodeId, Op};

/// A matrix by rows, without its diagonal, where that is one; zeros are none.
pub(super) type Sparse = Vec<Vec<Option<NodeId>>>;

/// Wᵀ H W = D + B.
pub(super) struct Congruence {
    /// L, W below their diagonals of ones.
    lower: Sparse,
    pub inverse: Sparse,
    pub d: Vec<NodeId>,
    /// v.
    units: Vec<NodeId>,
    /// At least |B| v / D.
    shift: Vec<NodeId>,
    /// At least a, and at most 1 − a.
    pub contraction: NodeId,
    pub left: NodeId,
    /// |W D⁻¹ Wᵀ| as computed, once it was asked for.
    direct: Option<Sparse>,
}

/// γ of so many roundings.
pub(super) fn gamma(count: usize, format: FloatFormat) -> f64 {
    let u = count as f64 * format.u;
    // the constant is rounded, too
    (u / (1.0 - u)) * (1.0 + 4.0 * format.u)
}

impl Congruence {
    /// None if a diagonal entry is zero.
    pub fn new(p: &mut Running, h: &[Tracked], n: usize) -> Option<Self> {
        let at = |i: usize, j: usize| h[i.max(j) * n + i.min(j)];
        let (lower, d, order) = factor(p, &at, n)?;
        let inverse = inverse(p, &lower, &order);
        let one = p.constant(1.0);
        let units: Vec<NodeId> = d
            .iter()
            .map(|d| {
                let root = p.insert(Op::sqrt(*d));
                p.insert(Op::div(one, root))
            })
            .collect();
        let mut this =
            Congruence { lower, inverse, d, units, shift: Vec::new(), contraction: one, left: one, direct: None };
        let x = this.up(p, &this.inverse, &this.units);
        let x = p.all_settled(&x);
        let y = this.up(p, &this.lower, &x);
        let y = p.all_settled(&y);
        // what underflows: a product, a quotient times D, at most 4 n of them in any sum
        let all = p.total(&y);
        let all = p.settled(all);
        let inertia = [&[one], &this.d[..]].concat();
        let inertia = p.total(&inertia);
        let floor = p.insert(Op::mul(inertia, all));
        let floor = p.scaled(16.0 * n as f64 * p.format.tiny, floor);
        let four_gamma = 4.0 * gamma(n + 8, p.format);
        let factored: Vec<NodeId> = (0..n)
            .map(|k| {
                let product = p.insert(Op::mul(this.d[k], y[k]));
                let product = p.scaled(four_gamma, product);
                p.insert(Op::add(product, floor))
            })
            .collect();
        let factored = p.all_settled(&factored);
        let mut off = this.down(p, &this.lower, &factored);
        if !p.is_broken(BrokenProof::MassMatrix) {
            for (i, off) in off.iter_mut().enumerate() {
                let errors = (0..n).filter_map(|j| Some((at(i, j).error?, x[j])));
                let errors: Vec<(NodeId, NodeId)> = errors.collect();
                if !errors.is_empty() {
                    let errors = p.dot(&errors);
                    *off = p.insert(Op::add(*off, errors));
                }
            }
        }
        let off = p.all_settled(&off);
        let off = this.down(p, &this.inverse, &off);
        let shift: Vec<NodeId> = (0..n).map(|k| p.over(off[k], this.d[k])).collect();
        this.shift = p.all_settled(&shift);
        let parts: Vec<NodeId> = (0..n).map(|k| p.over(this.shift[k], this.units[k])).collect();
        let most = p.greatest(&parts);
        this.contraction = p.settled(most);
        this.left = remainder(p, this.contraction);
        Some(this)
    }

    /// M x for |M| with ones on the diagonal and x ≥ 0.
    pub fn up(&self, p: &mut Running, matrix: &Sparse, x: &[NodeId]) -> Vec<NodeId> {
        let row = |(k, row): (usize, &Vec<Option<NodeId>>)| {
            let others = row.iter().enumerate().filter_map(|(i, entry)| Some((p.absolute((*entry)?), x[i])));
            let others: Vec<(NodeId, NodeId)> = others.collect();
            match others.is_empty() {
                true => x[k],
                false => {
                    let sum = p.dot(&others);
                    p.insert(Op::add(x[k], sum))
                }
            }
        };
        matrix.iter().enumerate().map(row).collect()
    }

    /// Mᵀ x likewise.
    pub fn down(&self, p: &mut Running, matrix: &Sparse, x: &[NodeId]) -> Vec<NodeId> {
        let n = matrix.len();
        let transposed = (0..n).map(|i| (0..n).map(|k| matrix[k][i]).collect()).collect();
        self.up(p, &transposed, x)
    }

    pub fn smallest_eigenvalue(&self, p: &mut Running) -> NodeId {
        let n = self.d.len();
        let one = p.constant(1.0);
        let columns: Vec<NodeId> = (0..n)
            .map(|k| {
                let squares: Vec<NodeId> =
                    self.inverse.iter().filter_map(|row| row[k]).map(|w| p.insert(Op::mul(w, w))).collect();
                let sum = p.total(&[&[one], &squares[..]].concat());
                p.over(sum, self.d[k])
            })
            .collect();
        let sum = p.total(&columns);
        let sum = p.settled(sum);
        let least = p.insert(Op::div(self.left, sum));
        p.scaled(1.0 - 4.0 * p.format.u, least)
    }

    /// An entry of |W D⁻¹ Wᵀ|, as computed.
    fn size(&self, p: &mut Running, i: usize, j: usize) -> Option<NodeId> {
        let one = p.constant(1.0);
        let entry = |i: usize, k: usize| if i == k { Some(one) } else { self.inverse[i][k] };
        let terms: Vec<NodeId> = (0..self.d.len())
            .filter_map(|k| {
                let (a, b) = (entry(i, k)?, entry(j, k)?);
                let scaled = p.insert(Op::div(b, self.d[k]));
                Some(if a == one { scaled } else { p.insert(Op::mul(a, scaled)) })
            })
            .collect();
        let sum = terms.into_iter().reduce(|a, b| p.insert(Op::add(a, b)))?;
        Some(p.absolute(sum))
    }

    /// |W D⁻¹ Wᵀ| r for r ≥ 0, by that matrix as computed.
    pub fn direct(&mut self, p: &mut Running, r: &[NodeId]) -> Vec<NodeId> {
        let n = self.d.len();
        let sizes = match self.direct.take() {
            Some(sizes) => sizes,
            None => (0..n).map(|i| (0..=i).map(|j| self.size(p, i, j)).collect()).collect(),
        };
        let entry = |i: usize, j: usize| sizes[i.max(j)][i.min(j)];
        let products = (0..n).map(|i| (0..n).filter_map(|j| Some((entry(i, j)?, r[j]))).collect());
        let products: Vec<Vec<(NodeId, NodeId)>> = products.collect();
        self.direct = Some(sizes);
        // what the matrix is off by
        let rounding = self.down(p, &self.inverse, r);
        let rounding: Vec<NodeId> = (0..n).map(|k| p.over(rounding[k], self.d[k])).collect();
        let rounding = p.all_settled(&rounding);
        let rounding = self.up(p, &self.inverse, &rounding);
        let gamma = gamma(n + 8, p.format);
        let all = p.total(r);
        let underflow = p.scaled(16.0 * n as f64 * p.format.tiny, all);
        (0..n)
            .map(|i| {
                let off = p.scaled(gamma, rounding[i]);
                let off = p.insert(Op::add(off, underflow));
                let sum = p.dot(&products[i]);
                p.insert(Op::add(sum, off))
            })
            .collect()
    }

    /// What δ is at most, of H δ = r with |r| at most so large: `driven` is |W|ᵀ |r|, and `bounds` what δ is but for B.
    pub fn with_shift(&self, p: &mut Running, bounds: &[NodeId], driven: &[NodeId]) -> Vec<NodeId> {
        let driven = p.all_settled(driven);
        let shifted = self.shifted(p, &driven);
        let sums: Vec<NodeId> = bounds.iter().zip(shifted).map(|(a, b)| p.insert(Op::add(*a, b))).collect();
        p.all_settled(&sums)
    }

    /// The same of r alone.
    pub fn solution(&mut self, p: &mut Running, r: &[NodeId]) -> Vec<NodeId> {
        let bounds = self.direct(p, r);
        let driven = self.down(p, &self.inverse, r);
        self.with_shift(p, &bounds, &driven)
    }

    /// |W| D⁻¹ |B| |z| for (D + B) z = b, of |b|.
    pub fn shifted(&self, p: &mut Running, b: &[NodeId]) -> Vec<NodeId> {
        let parts: Vec<NodeId> = (0..b.len())
            .map(|k| {
                let part = p.over(b[k], self.d[k]);
                p.over(part, self.units[k])
            })
            .collect();
        let most = p.greatest(&parts);
        let most = p.over(most, self.left);
        let most = p.settled(most);
        let shifts: Vec<NodeId> = self.shift.iter().map(|s| p.times(*s, most)).collect();
        let shifts = p.all_settled(&shifts);
        self.up(p, &self.inverse, &shifts)
    }
}

/// At most 1 − a, for what is at least a; NaN below zero.
pub(super) fn remainder(p: &mut Running, contraction: NodeId) -> NodeId {
    let one = p.constant(1.0);
    let left = p.insert(Op::sub(one, contraction));
    let left = p.positive(left);
    p.scaled(1.0 - 8.0 * p.format.u, left)
}

/// L, D, and the order in which coordinates were eliminated: those that fewest others are coupled to first, which are the tips of a
/// tree (Featherstone 2008, table 6.3), so that no zero is filled in.
fn factor(p: &mut Running, h: &dyn Fn(usize, usize) -> Tracked, n: usize) -> Option<(Sparse, Vec<NodeId>, Vec<usize>)> {
    let mut a: Sparse =
        (0..n).map(|i| (0..=i).map(|j| Some(h(i, j)).filter(|x| !p.is_zero(*x)).map(|x| x.value)).collect()).collect();
    let mut lower: Sparse = vec![vec![None; n]; n];
    let mut d = vec![None; n];
    let mut order = Vec::new();
    let mut left: Vec<usize> = (0..n).collect();
    while !left.is_empty() {
        let coupled = |k: usize| left.iter().filter(|i| **i != k && a[k.max(**i)][k.min(**i)].is_some()).count();
        let k = left.iter().copied().min_by_key(|k| (coupled(*k), n - k)).expect("some are left");
        let pivot = a[k][k]?;
        left.retain(|i| *i != k);
        let near: Vec<(usize, NodeId)> = left.iter().filter_map(|i| Some((*i, a[k.max(*i)][k.min(*i)]?))).collect();
        for &(i, x) in &near {
            let factor = p.insert(Op::div(x, pivot));
            lower[k][i] = Some(factor);
            for &(j, y) in near.iter().filter(|(j, _)| *j <= i) {
                let product = p.insert(Op::mul(y, factor));
                a[i][j] = Some(match a[i][j] {
                    Some(x) => p.insert(Op::sub(x, product)),
                    None => p.insert(Op::neg(product)),
                });
            }
        }
        d[k] = Some(pivot);
        order.push(k);
    }
    Some((lower, d.into_iter().collect::<Option<Vec<NodeId>>>()?, order))
}

/// W with L W = 1.
fn inverse(p: &mut Running, lower: &Sparse, order: &[usize]) -> Sparse {
    let n = lower.len();
    let mut w: Sparse = vec![vec![None; n]; n];
    for &k in order.iter().rev() {
        for j in 0..n {
            let mut sum = lower[k][j];
            for i in (0..n).filter(|i| *i != j) {
                let (Some(l), Some(x)) = (lower[k][i], w[i][j]) else { continue };
                let product = p.insert(Op::mul(l, x));
                sum = Some(match sum {
                    Some(sum) => p.insert(Op::add(sum, product)),
                    None => product,
                });
            }
            w[k][j] = sum.map(|sum| p.insert(Op::neg(sum)));
        }
    }
    w
}
