//! The condition number of least squares, and the directions that make it.

use crate::fit::LeastSquares;

/// The greatest and the least singular value of a matrix W, with their directions.
#[derive(Clone, Debug, PartialEq)]
pub struct MatrixCondition {
    /// The greatest, then the least.
    pub values: [f64; 2],
    /// Of each the right direction v, a number per column.
    pub right: [Vec<f64>; 2],
    /// Of each the left direction u = W v / σ, a number per row.
    pub left: [Vec<f64>; 2],
}

impl MatrixCondition {
    /// Of a matrix by rows, with at least as many rows as columns; `None` where its columns depend on each other, or it is empty.
    pub fn of(rows: &[f64], columns: usize) -> Option<MatrixCondition> {
        let mut squares = LeastSquares::new(columns);
        rows.chunks_exact(columns).for_each(|row| squares.push(row, 0.0));
        let found = squares.triangle().0.svd(false, true);
        let transposed = found.v_t?;
        let order = |a: &usize, b: &usize| found.singular_values[*a].total_cmp(&found.singular_values[*b]);
        let [greatest, least] = [(0..columns).max_by(order)?, (0..columns).min_by(order)?];
        let values = [greatest, least].map(|k| found.singular_values[k]);
        if values[1].is_nan() || values[1] <= 1e-13 * values[0] {
            return None;
        }
        let right = [greatest, least].map(|k| transposed.row(k).iter().copied().collect::<Vec<f64>>());
        let left = [0, 1].map(|k| {
            let along = |row: &[f64]| row.iter().zip(&right[k]).map(|(y, v)| y * v).sum::<f64>() / values[k];
            rows.chunks_exact(columns).map(along).collect()
        });
        Some(MatrixCondition { values, right, left })
    }

    /// The condition number.
    pub fn number(&self) -> f64 {
        self.values[0] / self.values[1]
    }
}
