//! Least squares over more rows than memory would hold, by orthogonal transformations.
//!
//! Rows are folded block by block into the triangle of a QR factorization, which has what the normal equations have without squaring their condition.
//! At the end columns are pivoted, each in units of its length, and those that others make up are said to be untold instead of being given a number.

use nalgebra::{DMatrix, DVector};

/// Rows that are folded in at once.
const BLOCK: usize = 512;

/// A column that others make up but for this part of its length is not told from them.
const LEAST_PIVOT: f64 = 1e-6;

/// Collects the rows of a fit.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    columns: usize,
    /// Rows of numbers, the right-hand side last: a triangle, then what is not yet folded in.
    rows: Vec<f64>,
    count: usize,
}

/// What a fit found.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Per column its coefficient; zero where the data cannot tell it.
    pub coefficients: Vec<f64>,
    /// Standard errors, as if what is left were white; infinite where the data cannot tell.
    pub errors: Vec<f64>,
    /// Columns that the data cannot tell from others.
    pub untold: Vec<usize>,
    /// Covariance of the coefficients, by rows.
    pub covariance: Vec<f64>,
    /// The root of the mean square of what is left.
    pub rms: f64,
    /// Square of the noise that the errors are made of.
    pub variance: f64,
    /// The rows.
    pub rows: usize,
}

impl LeastSquares {
    /// A fit of so many columns.
    pub fn new(columns: usize) -> LeastSquares {
        LeastSquares { columns, rows: Vec::new(), count: 0 }
    }

    /// Takes a row: the values of the columns, and what they are to add up to.
    pub fn push(&mut self, row: &[f64], value: f64) {
        assert_eq!(row.len(), self.columns, "a number per column");
        self.rows.extend_from_slice(row);
        self.rows.push(value);
        self.count += 1;
        if self.rows.len() >= (self.columns + 1) * (self.columns + 1 + BLOCK) {
            self.fold();
        }
    }

    fn fold(&mut self) {
        let width = self.columns + 1;
        let matrix = DMatrix::from_row_slice(self.rows.len() / width, width, &self.rows);
        let triangle = matrix.qr().r();
        self.rows = triangle.transpose().as_slice().to_vec();
    }

    /// The triangle that the rows come to, and what its columns are to add up to: the same least squares in as many rows as columns.
    pub fn triangle(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (n, mut own) = (self.columns, self.clone());
        own.rows.resize(own.rows.len().max((n + 1) * (n + 1)), 0.0);
        own.fold();
        let triangle = DMatrix::from_row_slice(n + 1, n + 1, &own.rows);
        (triangle.view((0, 0), (n, n)).into_owned(), DVector::from_fn(n, |i, _| triangle[(i, n)]))
    }

    /// The fit; `samples` says how many rows are independent of each other, if these are fewer than there are.
    pub fn finish(mut self, samples: Option<usize>) -> Fitted {
        let n = self.columns;
        if n == 0 || self.count == 0 {
            let (zeros, errors) = (vec![0.0; n], vec![f64::INFINITY; n]);
            return Fitted {
                coefficients: zeros,
                errors,
                untold: (0..n).collect(),
                covariance: vec![0.0; n * n],
                rms: 0.0,
                variance: 0.0,
                rows: self.count,
            };
        }
        // as many rows as columns, at least
        self.rows.resize(self.rows.len().max((n + 1) * (n + 1)), 0.0);
        self.fold();
        let triangle = DMatrix::from_row_slice(n + 1, n + 1, &self.rows);
        let lengths: Vec<f64> = (0..n).map(|k| triangle.column(k).norm()).collect();
        let scaled = DMatrix::from_fn(n, n, |i, k| if lengths[k] > 0.0 { triangle[(i, k)] / lengths[k] } else { 0.0 });
        let side = DVector::from_fn(n, |i, _| triangle[(i, n)]);
        let factors = scaled.col_piv_qr();
        let mut order = DMatrix::from_fn(1, n, |_, k| k as f64);
        factors.p().permute_columns(&mut order);
        let order: Vec<usize> = order.iter().map(|k| *k as usize).collect();
        let (q, r) = (factors.q(), factors.r());
        let rank = (0..n).take_while(|k| r[(*k, *k)].abs() > LEAST_PIVOT).count();
        let projected = q.transpose() * &side;
        let upper = r.view((0, 0), (rank, rank)).into_owned();
        let inverse =
            upper.solve_upper_triangular(&DMatrix::identity(rank, rank)).unwrap_or_else(|| DMatrix::zeros(rank, rank));
        let solution = &inverse * projected.rows(0, rank);
        let left = triangle[(n, n)].powi(2) + projected.rows(rank, n - rank).norm_squared();
        let samples = samples.unwrap_or(self.count).min(self.count);
        let freedom = samples.saturating_sub(rank).max(1) as f64;
        let variance = left / self.count as f64 * samples as f64 / freedom;
        let spread = &inverse * inverse.transpose() * variance;
        let mut found = Fitted {
            coefficients: vec![0.0; n],
            errors: vec![f64::INFINITY; n],
            untold: order[rank..].to_vec(),
            covariance: vec![0.0; n * n],
            rms: (left / self.count as f64).sqrt(),
            variance,
            rows: self.count,
        };
        // each row counts as `samples / count` of one
        let weight = self.count as f64 / samples.max(1) as f64;
        for (i, a) in order[..rank].iter().enumerate() {
            found.coefficients[*a] = solution[i] / lengths[*a];
            found.errors[*a] = (spread[(i, i)] * weight).sqrt() / lengths[*a];
            for (k, b) in order[..rank].iter().enumerate() {
                found.covariance[*a * n + *b] = spread[(i, k)] * weight / (lengths[*a] * lengths[*b]);
            }
        }
        found.untold.sort_unstable();
        found
    }
}
