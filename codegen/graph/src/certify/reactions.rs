//! The small system of a contact, N φ = c − κ J H⁻¹ r, solved with bounds. The proof is in [`residual`](super::residual); each function follows one
//! of its equations from top to bottom, and is as long as that.

use super::congruence::{gamma, remainder, Congruence, Sparse};
use super::running::{BrokenProof, Running, Tracked};
use crate::expr::{NodeId, Op};

/// A contact: what is left, and its rows.
pub(super) struct ReactionRows<'a> {
    pub residual: &'a [Tracked],
    pub missing: &'a [Tracked],
    pub j: Vec<Vec<Tracked>>,
    pub applied: Vec<Vec<Tracked>>,
    pub mass: &'a [Tracked],
    pub yielding: &'a [bool],
}

/// Bounds of the errors of reactions, and what they do to accelerations.
pub(super) struct Reactions {
    /// |φ|, settled.
    pub bounds: Vec<NodeId>,
    /// |Q φ|.
    pub accelerations: Vec<NodeId>,
    /// |V̂|ᵀ |φ|.
    pub driven: Vec<NodeId>,
    /// At most the smallest singular value of N.
    pub smallest: NodeId,
}

impl ReactionRows<'_> {
    /// J W.
    fn turned(p: &mut Running, rows: &[Vec<Tracked>], w: &Sparse) -> Vec<Vec<Option<Tracked>>> {
        let n = w.len();
        let mut entry = |row: &Vec<Tracked>, k: usize| {
            let others = (0..n).filter_map(|i| Some((row[i], Running::exact(w[i][k]?))));
            let others: Vec<(Tracked, Tracked)> = others.collect();
            let sum = p.scalar_product(others);
            let (own, is_zero) = (row[k], p.is_zero(row[k]));
            match sum {
                Some(sum) if is_zero => Some(sum),
                Some(sum) => Some(p.sum(own, sum)),
                None if is_zero => None,
                None => Some(own),
            }
        };
        rows.iter().map(|row| (0..n).map(|k| entry(row, k)).collect()).collect()
    }

    /// N φ = right, and what φ does to accelerations. One piece: the steps of the proof share all of their values.
    pub fn reactions(&self, p: &mut Running, h: &Congruence) -> Reactions {
        let (n, m) = (h.d.len(), self.missing.len());
        let d: Vec<Tracked> = h.d.iter().map(|d| Running::exact(*d)).collect();
        let exact = |rows: &[Vec<Tracked>]| -> Vec<Vec<Tracked>> {
            rows.iter().map(|row| row.iter().map(|x| Running::exact(x.value)).collect()).collect()
        };
        let (j, applied) = match p.is_broken(BrokenProof::Jacobian) {
            true => (exact(&self.j), exact(&self.applied)),
            false => (self.j.clone(), self.applied.clone()),
        };
        let own = ReactionRows::turned(p, &j, &h.inverse);
        let hat = ReactionRows::turned(p, &applied, &h.inverse);
        // V̂/D, and norms by D^-½
        let scaled: Vec<Vec<Option<Tracked>>> =
            hat.iter().map(|row| row.iter().zip(&d).map(|(x, d)| x.map(|x| p.quotient(x, *d))).collect()).collect();
        let norms = |p: &mut Running, rows: &[Vec<Option<Tracked>>]| -> Vec<NodeId> {
            let norms = rows.iter().map(|row| norm(p, row, &h.d)).collect::<Vec<NodeId>>();
            p.all_settled(&norms)
        };
        let (own_norms, hat_norms) = (norms(p, &own), norms(p, &hat));
        let off = p.over(h.contraction, h.left);
        let off = p.settled(off);
        // b = Wᵀ r
        let turned: Vec<Option<Tracked>> = ReactionRows::turned(p, &[self.residual.to_vec()], &h.inverse).remove(0);
        let residual_norm = norm(p, &turned, &h.d);
        let residual_norm = p.settled(residual_norm);
        let turned: Vec<Option<Tracked>> =
            turned.into_iter().zip(&d).map(|(b, d)| b.map(|b| p.quotient(b, *d))).collect();

        let mut matrix: Vec<Vec<Tracked>> = Vec::new();
        let mut right: Vec<NodeId> = Vec::new();
        let zero = Running::exact(p.constant(0.0));
        let one = Running::exact(p.constant(1.0));
        let dot = |p: &mut Running, a: &[Option<Tracked>], b: &[Option<Tracked>]| {
            p.scalar_product(a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?)))).unwrap_or(zero)
        };
        for i in 0..m {
            let share = |p: &mut Running, norm: NodeId| {
                let product = p.times(own_norms[i], norm);
                let product = p.settled(product);
                let product = p.times(product, off);
                p.settled(product)
            };
            let row: Vec<Tracked> = (0..m)
                .map(|k| {
                    let felt = dot(p, &own[i], &scaled[k]);
                    let by = share(p, hat_norms[k]);
                    let felt = p.widened(felt, Some(by));
                    match (self.yielding[i], i == k) {
                        (false, _) => felt,
                        (true, false) => self.of_mass(p, i, felt),
                        (true, true) => {
                            let product = self.of_mass(p, i, felt);
                            p.sum(one, product)
                        }
                    }
                })
                .collect();
            matrix.push(row);
            let response = dot(p, &own[i], &turned);
            let by = share(p, residual_norm);
            let response = p.widened(response, Some(by));
            let response = if self.yielding[i] { self.of_mass(p, i, response) } else { response };
            let missing = p.difference(self.missing[i], response);
            right.push(p.magnitude(missing));
        }
        let right = p.all_settled(&right);
        let solved = solve(p, &matrix, &right, &own_norms);

        // Q = W D⁻¹ V̂ᵀ
        let all = p.total(&right);
        let (all, tiny) = (p.settled(all), p.constant(16.0 * m as f64 * p.format.tiny));
        let mut accelerations = Vec::new();
        for i in 0..n {
            let mut parts: Vec<(NodeId, NodeId)> = vec![(tiny, all)];
            let row: Vec<Tracked> = (0..m)
                .map(|k| {
                    let others = (0..n).filter_map(|c| Some((Running::exact(h.inverse[i][c]?), scaled[k][c]?)));
                    let others = p.scalar_product(others.collect::<Vec<_>>());
                    match (scaled[k][i], others) {
                        (Some(own), Some(others)) => p.sum(own, others),
                        (own, others) => own.or(others).unwrap_or(zero),
                    }
                })
                .collect();
            for (l, right) in right.iter().enumerate() {
                let terms: Vec<NodeId> =
                    (0..m).map(|k| p.insert(Op::mul(row[k].value, solved.inverse[k * m + l]))).collect();
                let sum = terms.into_iter().reduce(|a, b| p.insert(Op::add(a, b))).expect("there is a row");
                parts.push((p.absolute(sum), *right));
            }
            for (k, x) in row.into_iter().enumerate() {
                let size = p.absolute(x.value);
                parts.push((size, solved.loose[k]));
                if let Some(e) = x.error {
                    parts.push((p.settled(e), solved.bounds[k]));
                }
            }
            accelerations.push(p.dot(&parts));
        }
        let driven = (0..n).map(|k| {
            let parts: Vec<(NodeId, NodeId)> = hat
                .iter()
                .zip(&solved.bounds)
                .filter_map(|(row, bound)| {
                    let size = p.magnitude(row[k]?);
                    Some((p.settled(size), *bound))
                })
                .collect();
            if parts.is_empty() {
                zero.value
            } else {
                p.dot(&parts)
            }
        });
        let driven = driven.collect();
        Reactions { bounds: solved.bounds, accelerations, driven, smallest: solved.smallest }
    }

    /// m x.
    fn of_mass(&self, p: &mut Running, i: usize, x: Tracked) -> Tracked {
        match p.is_zero(self.mass[i]) {
            true => self.mass[i],
            false => p.product(self.mass[i], x),
        }
    }
}

/// √Σ (|x_k| + e_k)²/D_k.
fn norm(p: &mut Running, row: &[Option<Tracked>], d: &[NodeId]) -> NodeId {
    let mut squares = vec![p.constant(0.0)];
    for (x, d) in row.iter().zip(d) {
        let Some(x) = x else { continue };
        let size = p.magnitude(*x);
        let size = p.settled(size);
        let square = p.insert(Op::mul(size, size));
        squares.push(p.over(square, *d));
    }
    let sum = p.total(&squares);
    p.insert(Op::sqrt(sum))
}

/// N φ = right, solved.
struct SolvedReactions {
    /// R', by rows.
    inverse: Vec<NodeId>,
    /// |φ|, settled.
    bounds: Vec<NodeId>,
    /// |M φ| and what products with R' lose, relative to what they multiply; settled.
    loose: Vec<NodeId>,
    /// At most the smallest singular value.
    smallest: NodeId,
}

/// Of |right|; 1/`scales` are the units of φ. One piece, as [`ReactionRows::reactions`].
fn solve(p: &mut Running, matrix: &[Vec<Tracked>], right: &[NodeId], scales: &[NodeId]) -> SolvedReactions {
    let m = matrix.len();
    let values: Vec<NodeId> = matrix.iter().flatten().map(|x| x.value).collect();
    let inverse = dense_inverse(p, &values, m);
    let sizes: Vec<NodeId> = inverse.iter().map(|x| p.absolute(*x)).collect();
    let one = p.constant(1.0);
    let units: Vec<NodeId> = scales.iter().map(|s| p.insert(Op::div(one, *s))).collect();
    let gamma = gamma(m + 4, p.format);
    // what a product of R' with column j can lose: the errors of N, and m + 4 roundings
    let losses: Vec<NodeId> = matrix
        .iter()
        .flatten()
        .map(|x| {
            let size = p.absolute(x.value);
            let rounding = p.scaled(gamma, size);
            match x.error {
                Some(e) => p.insert(Op::add(rounding, e)),
                None => rounding,
            }
        })
        .collect();
    let losses = p.all_settled(&losses);
    let mut contractions = Vec::new();
    for i in 0..m {
        let mut row = Vec::new();
        for j in 0..m {
            // 1 − R' N, and what it may be off by
            let terms: Vec<NodeId> = (0..m).map(|k| p.insert(Op::mul(inverse[i * m + k], values[k * m + j]))).collect();
            let product = terms.into_iter().reduce(|a, b| p.insert(Op::add(a, b))).expect("there is a row");
            let difference = if i == j { p.insert(Op::sub(one, product)) } else { product };
            let mut entry = vec![p.absolute(difference)];
            entry.extend((0..m).map(|k| p.insert(Op::mul(sizes[i * m + k], losses[k * m + j]))));
            entry.push(p.constant(4.0 * p.format.u));
            let entry = p.total(&entry);
            row.push((entry, units[j]));
        }
        contractions.push(p.dot(&row));
    }
    let contractions = p.all_settled(&contractions);
    let relative: Vec<NodeId> = (0..m).map(|i| p.over(contractions[i], units[i])).collect();
    let contraction = p.greatest(&relative);
    let contraction = p.settled(contraction);
    let left = remainder(p, contraction);

    let direct: Vec<NodeId> = (0..m)
        .map(|i| {
            let products: Vec<(NodeId, NodeId)> = (0..m).map(|j| (sizes[i * m + j], right[j])).collect();
            p.dot(&products)
        })
        .collect();
    let direct = p.all_settled(&direct);
    let relative: Vec<NodeId> = (0..m).map(|i| p.over(direct[i], units[i])).collect();
    let most = p.greatest(&relative);
    let most = p.over(most, left);
    let most = p.settled(most);
    let mut bounds = Vec::new();
    let mut loose = Vec::new();
    for i in 0..m {
        let share = p.times(contractions[i], most);
        bounds.push(p.insert(Op::add(direct[i], share)));
        let lost = p.scaled(gamma, direct[i]);
        loose.push(p.insert(Op::add(share, lost)));
    }
    let (bounds, loose) = (p.all_settled(&bounds), p.all_settled(&loose));

    // Σ |N⁻¹|, whose columns obey the same with those of |R'| for |R' N φ|
    let all = p.total(&sizes);
    let columns: Vec<NodeId> = (0..m)
        .map(|j| {
            let column: Vec<NodeId> = (0..m).map(|i| p.over(sizes[i * m + j], units[i])).collect();
            p.greatest(&column)
        })
        .collect();
    let columns = p.total(&columns);
    let columns = p.settled(columns);
    let rows = p.total(&contractions);
    let product = p.times(rows, columns);
    let rest = p.over(product, left);
    let sum = p.insert(Op::add(all, rest));
    let sum = p.settled(sum);
    let smallest = p.insert(Op::div(one, sum));
    let smallest = p.scaled(1.0 - 4.0 * p.format.u, smallest);
    SolvedReactions { inverse, bounds, loose, smallest }
}

/// The inverse of a matrix by elimination without exchange of rows, as good as rounding allows.
fn dense_inverse(p: &mut Running, matrix: &[NodeId], m: usize) -> Vec<NodeId> {
    let (zero, one) = (p.constant(0.0), p.constant(1.0));
    let mut a: Vec<Vec<NodeId>> = matrix.chunks(m).map(<[NodeId]>::to_vec).collect();
    let mut b: Vec<Vec<NodeId>> = (0..m).map(|i| (0..m).map(|j| if i == j { one } else { zero }).collect()).collect();
    for k in 0..m {
        let inverse = p.insert(Op::div(one, a[k][k]));
        for j in 0..m {
            a[k][j] = p.insert(Op::mul(a[k][j], inverse));
            if b[k][j] != zero {
                b[k][j] = if b[k][j] == one { inverse } else { p.insert(Op::mul(b[k][j], inverse)) };
            }
        }
        let (row, inverse_row) = (a[k].clone(), b[k].clone());
        for i in (0..m).filter(|i| *i != k) {
            let factor = a[i][k];
            for (x, y) in a[i].iter_mut().zip(&row).skip(k + 1) {
                let product = p.insert(Op::mul(factor, *y));
                *x = p.insert(Op::sub(*x, product));
            }
            for (x, y) in b[i].iter_mut().zip(&inverse_row).filter(|(_, y)| **y != zero) {
                let product = p.insert(Op::mul(factor, *y));
                *x = if *x == zero { p.insert(Op::neg(product)) } else { p.insert(Op::sub(*x, product)) };
            }
        }
    }
    b.concat()
}
