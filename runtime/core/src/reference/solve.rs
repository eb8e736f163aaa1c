//! Dense solution of a symmetric positive definite system, for q̈ = H⁻¹(τ − h).

use super::ReferenceReal;
use nalgebra::{DMatrix, DVector};

/// `x` of `a x = b` by `a = L D Lᵀ`, for a symmetric positive definite `a`; only the lower triangle is read.
///
/// The pivots d_j are quotients of leading principal minors, so they are positive for a positive definite `a`, and no
/// exchange of rows is needed; a singular `a` gives infinities or NaN.
#[doc(alias = "Cholesky")]
pub fn solve_symmetric<T: ReferenceReal>(a: &DMatrix<T>, b: &DVector<T>) -> DVector<T> {
    let n = b.len();
    assert_eq!(a.shape(), (n, n), "a square matrix of the order of the right-hand side");
    let mut l = a.clone();
    let mut d = b.clone();
    for j in 0..n {
        // d_j = a_jj − Σ_{k<j} l_jk² d_k
        d[j] = (0..j).fold(a[(j, j)], |sum, k| sum - l[(j, k)] * l[(j, k)] * d[k]);
        // l_ij = (a_ij − Σ_{k<j} l_ik l_jk d_k) / d_j
        for i in j + 1..n {
            l[(i, j)] = (0..j).fold(a[(i, j)], |sum, k| sum - l[(i, k)] * l[(j, k)] * d[k]) / d[j];
        }
    }
    let mut x = b.clone();
    for i in 0..n {
        x[i] = (0..i).fold(x[i], |sum, k| sum - l[(i, k)] * x[k]);
    }
    for i in 0..n {
        x[i] /= d[i];
    }
    for i in (0..n).rev() {
        x[i] = (i + 1..n).fold(x[i], |sum, k| sum - l[(k, i)] * x[k]);
    }
    x
}
