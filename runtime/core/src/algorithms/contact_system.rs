//! The small system of a contact: G = J H⁻¹ Jᵀ, the inverse mass that reactions feel, regularised and solved.
//!
//! With the branch-sparse factor H = Lᵀ D L, G is made of L⁻ᵀ Jᵀ (Featherstone 2008, section 8.4-8.6). For rigid contacts
//! without friction it is symmetric and not negative.
//!
//! **Regularisation.** Rows may be redundant (a flat foot on four points) or vanish (a stretched arm): then G is singular.
//! Each diagonal entry gets a ridge ε G_ii + ε² Σ 1/D: relative to its own row, so that lengths and angles may stand side by
//! side, and never zero, as Σ 1/D of the joints is not. Solving again, for what is left, takes the error on a row with the pivot
//! p from ε/p to (ε/p)², and where rows know of each other once more to (ε/p)³. A pivot is never let below ε/2 of its diagonal, so that rounding cannot make a division by
//! zero. What is returned says how far it went: the least pivot against its diagonal, 1 for rows that do not know of each
//! other, about ε for redundant ones, and the violation that is left.

use super::factor::Ltdl;
use crate::dd::Dd;
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;

/// What a row of the system stands for, with reactions F and the inverse mass G:
/// `inertia` (G F)_i + (`compliance` + ridge) F_i = right side.
#[derive(Clone, Copy, Debug)]
pub(super) enum ContactRow<T> {
    /// (G F)_i is given.
    Rigid,
    /// F_i gives way: m (G F)_i + F_i is given, with m ≥ 0 \[kg\].
    Yielding(T),
}

/// G and its factor.
pub(super) struct ContactSystem<T> {
    /// L⁻ᵀ of the directions in which reactions act.
    half: Vec<Vec<T>>,
    /// D⁻¹ L⁻ᵀ Jᵀ.
    scaled: Vec<Vec<T>>,
    inverse_mass: Vec<Vec<T>>,
    /// The matrix of the system without ridges.
    matrix: Vec<Vec<T>>,
    /// What stands on its diagonal beside: of a row that yields nothing.
    ridges: Vec<T>,
    /// Whether G is all that it is made of, and symmetric.
    pub is_symmetric: bool,
    solver: Solver<T>,
    /// Least pivot against its diagonal entry.
    pub pivot: T,
}

/// L U of a small matrix, no exchange of rows; for a symmetric one U = D Lᵀ.
#[derive(Clone, Debug)]
pub(super) struct Solver<T> {
    lower: Vec<Vec<T>>,
    upper: Vec<Vec<T>>,
    inverse_pivots: Vec<T>,
}

/// The greater of two, by a sign instead of a branch.
fn greater<T: Real>(a: T, b: T) -> T {
    let (sign, half) = ((a - b).sign(), T::constant(Dd::HALF));
    (T::one() + sign) * half * a + (T::one() - sign) * half * b
}

fn lesser<T: Real>(a: T, b: T) -> T {
    -greater(-a, -b)
}

fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::zero(), |sum, (x, y)| sum + *x * *y)
}

impl<T: Real> ContactSystem<T> {
    /// From the rows of J and those in which reactions act, where they are others; `ridge` is ε.
    pub fn new(
        factor: &Ltdl<T>,
        jacobian: &[Vec<T>],
        applied: Option<&[Vec<T>]>,
        rows: &[ContactRow<T>],
        ridge: T,
    ) -> Self {
        T::section("inverse mass of the contact", None);
        let m = jacobian.len();
        let own: Vec<Vec<T>> = jacobian.iter().map(|row| factor.half(row)).collect();
        let scaled: Vec<Vec<T>> = own.iter().map(|y| factor.scaled(y)).collect();
        let half = applied.map_or(own, |rows| rows.iter().map(|row| factor.half(row)).collect());
        let symmetric = applied.is_none() && rows.iter().all(|r| matches!(r, ContactRow::Rigid));
        let mut inverse_mass = vec![vec![T::zero(); m]; m];
        for i in 0..m {
            for j in 0..m {
                let known = applied.is_none() && j < i;
                inverse_mass[i][j] = if known { inverse_mass[j][i] } else { dot(&scaled[i], &half[j]) };
            }
        }
        let mut matrix = inverse_mass.clone();
        let mut ridged = inverse_mass.clone();
        let mut ridges = vec![T::zero(); m];
        let floor = ridge * ridge * factor.mobility();
        for (i, row) in rows.iter().enumerate() {
            match row {
                ContactRow::Rigid => {
                    ridges[i] = ridge * matrix[i][i] + floor;
                    ridged[i][i] = matrix[i][i] + ridges[i];
                }
                ContactRow::Yielding(mass) => {
                    matrix[i].iter_mut().for_each(|g| *g = *mass * *g);
                    matrix[i][i] = matrix[i][i] + T::one();
                    ridged[i].clone_from(&matrix[i]);
                }
            }
        }
        let (solver, pivot) = Solver::new(ridged, symmetric, Some(ridge));
        ContactSystem { half, scaled, inverse_mass, matrix, ridges, is_symmetric: symmetric, solver, pivot }
    }

    /// J H⁻¹ b, from L⁻ᵀ b.
    pub fn response(&self, half_of_b: &[T]) -> Vec<T> {
        self.scaled.iter().map(|row| dot(row, half_of_b)).collect()
    }

    /// G F.
    pub fn response_to(&self, force: &[T]) -> Vec<T> {
        self.inverse_mass.iter().map(|row| dot(row, force)).collect()
    }

    /// F for these right sides, refined: once for a single row, whose pivot is its diagonal, twice for more.
    pub fn solve(&self, right: &[T]) -> Vec<T> {
        T::section("reactions", None);
        let mut x = self.solver.solve(right);
        for _ in 0..if right.len() > 1 { 2 } else { 1 } {
            let left: Vec<T> = right.iter().zip(&self.matrix).map(|(b, row)| *b - dot(row, &x)).collect();
            let added = self.solver.solve(&left);
            x = x.into_iter().zip(added).map(|(x, d)| x + d).collect();
        }
        x.into_iter().enumerate().map(|(i, x)| x.named("reaction", i, "")).collect()
    }

    /// The same for many right sides: refined once. What a first solution x leaves is the ridge of each row times x, without forming G x, so
    /// that the error on a row with the pivot p is (ε/p)²; without ridges there is nothing to refine.
    pub fn solve_one_of_many(&self, right: &[T]) -> Vec<T> {
        T::section("changes of reactions", None);
        let x = self.solver.solve(right);
        let left: Vec<T> = x.iter().zip(&self.ridges).map(|(x, ridge)| *ridge * *x).collect();
        let added = self.solver.solve(&left);
        x.into_iter().zip(added).map(|(x, d)| x + d).collect()
    }

    /// Adds the reactions to L⁻ᵀ b.
    pub fn add_reactions(&self, half_of_b: Vec<T>, force: &[T]) -> Vec<T> {
        self.half
            .iter()
            .zip(force)
            .fold(half_of_b, |sum, (row, f)| sum.into_iter().zip(row).map(|(y, w)| y + *w * *f).collect())
    }
}

impl<T: Real> Solver<T> {
    /// With the least pivot against its diagonal entry. With a `ridge` ε pivots are never below ε/2 of it.
    pub fn new(mut a: Vec<Vec<T>>, symmetric: bool, ridge: Option<T>) -> (Self, T) {
        let m = a.len();
        let diagonal: Vec<T> = (0..m).map(|i| a[i][i]).collect();
        let (mut inverse_pivots, mut least) = (Vec::with_capacity(m), T::one());
        let mut lower = vec![vec![T::zero(); m]; m];
        for k in 0..m {
            // the first is the diagonal itself
            let pivot = match ridge {
                Some(ridge) if k > 0 => {
                    let pivot = greater(a[k][k], diagonal[k] * ridge * T::constant(Dd::HALF));
                    least = lesser(least, pivot / diagonal[k]);
                    pivot
                }
                _ => a[k][k],
            };
            let inverse = T::one() / pivot;
            inverse_pivots.push(inverse);
            for i in k + 1..m {
                lower[i][k] = a[i][k] * inverse;
                for j in if symmetric { k + 1..i + 1 } else { k + 1..m } {
                    let above = if symmetric { a[j][k] } else { a[k][j] };
                    a[i][j] = a[i][j] - lower[i][k] * above;
                }
            }
        }
        // of a symmetric one D Lᵀ stands in the columns
        let above = |k: usize, j: usize| if symmetric { a[j][k] } else { a[k][j] };
        let upper = (0..m).map(|k| (0..m).map(|j| if j > k { above(k, j) } else { T::zero() }).collect()).collect();
        (Solver { lower, upper, inverse_pivots }, least)
    }

    /// The inverse of a symmetric matrix: one triangle by substitution, the other as it is symmetric.
    pub fn inverse(&self) -> Vec<Vec<T>> {
        let m = self.inverse_pivots.len();
        let mut inverse = vec![vec![T::zero(); m]; m];
        for k in 0..m {
            // rows above k of L⁻¹ e_k are zero, and x above k is known
            let mut x: Vec<T> = vec![T::zero(); m];
            x[k] = T::one();
            for i in k + 1..m {
                x[i] = (k..i).fold(T::zero(), |sum, j| sum - self.lower[i][j] * x[j]);
            }
            for i in (k..m).rev() {
                let right = (i + 1..m).fold(x[i], |sum, j| sum - self.upper[i][j] * x[j]);
                x[i] = right * self.inverse_pivots[i];
                (inverse[i][k], inverse[k][i]) = (x[i], x[i]);
            }
        }
        inverse
    }

    /// x of these right sides.
    pub fn solve(&self, right: &[T]) -> Vec<T> {
        let (m, mut x) = (right.len(), right.to_vec());
        for i in 0..m {
            for k in 0..i {
                x[i] = x[i] - self.lower[i][k] * x[k];
            }
        }
        for i in (0..m).rev() {
            for k in i + 1..m {
                x[i] = x[i] - self.upper[i][k] * x[k];
            }
            x[i] = x[i] * self.inverse_pivots[i];
        }
        x
    }
}
