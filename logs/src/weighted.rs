//! Fits of several measured quantities at once: each counts in units of what is left of it, instants far from all else are left out, and errors hold for
//! noise of any colour.

use crate::episodes::robust_spread;
use crate::fit::{Fitted, LeastSquares};
use nalgebra::{DMatrix, DVector};

/// An instant further from the fit than so many robust standard deviations is no noise.
const FAR: f64 = 6.0;
/// Residuals below this part of the values' root mean square are rounding.
const LEAST_NOISE: f64 = 1e-9;
/// Outputs below this part of the greatest root mean square are as good as zero.
const AT_REST: f64 = 1e-3;
/// Weights and what is left out follow from what the fit before left.
const ROUNDS: usize = 4;

/// Instants in their order at equal steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitBlock {
    /// Per instant and output a number per column.
    pub rows: Vec<f64>,
    /// Per instant and output what they are to add up to.
    pub values: Vec<f64>,
}

/// What is fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct FitData {
    /// Coefficients that are looked for.
    pub columns: usize,
    /// Quantities that are measured at every instant.
    pub outputs: usize,
    /// The instants.
    pub blocks: Vec<FitBlock>,
}

/// A fit of several quantities.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightedFit {
    /// Coefficients; their errors and covariance hold for noise whose values at neighbouring instants depend on each other.
    pub fitted: Fitted,
    /// Per output the standard deviation of what is left.
    pub noise: Vec<f64>,
    /// Least squares with the same solution, in units of the noise.
    pub triangle: DMatrix<f64>,
    /// What its columns are to add up to.
    pub side: DVector<f64>,
    /// How much greater the squares of errors are than they would be if noise were white, in the mean over columns that are told.
    pub inflation: f64,
    /// Instants that are fitted.
    pub instants: usize,
    /// Instants that were left out, as they are far from all else.
    pub far: usize,
}

impl FitData {
    /// Instants.
    pub fn instants(&self) -> usize {
        self.blocks.iter().map(|block| block.values.len()).sum::<usize>() / self.outputs.max(1)
    }

    /// What coefficients leave, block by block, per instant and output.
    pub fn left(&self, coefficients: &[f64]) -> Vec<Vec<f64>> {
        let of_row =
            |(row, value): (&[f64], &f64)| value - row.iter().zip(coefficients).map(|(y, x)| y * x).sum::<f64>();
        let of_block =
            |block: &FitBlock| block.rows.chunks_exact(self.columns).zip(&block.values).map(of_row).collect();
        self.blocks.iter().map(of_block).collect()
    }

    /// Per output the root of the mean square of what coefficients leave.
    pub fn rms(&self, coefficients: &[f64]) -> Vec<f64> {
        let (mut sums, left) = (vec![0.0; self.outputs], self.left(coefficients));
        for (k, x) in left.iter().flat_map(|block| block.iter().enumerate()) {
            sums[k % self.outputs] += x * x;
        }
        let instants = self.instants().max(1) as f64;
        sums.iter().map(|sum| (sum / instants).sqrt()).collect()
    }

    /// The fit in which the coefficients of some columns are held at zero.
    pub fn fit_holding(&self, held: &[usize], lags: usize) -> WeightedFit {
        if held.is_empty() {
            return self.fit(lags);
        }
        let (n, kept): (usize, Vec<usize>) = (self.columns, (0..self.columns).filter(|k| !held.contains(k)).collect());
        let fit = self.of_columns(&kept).fit(lags);
        let few = &fit.fitted;
        let mut whole =
            Fitted { coefficients: vec![0.0; n], errors: vec![0.0; n], covariance: vec![0.0; n * n], ..few.clone() };
        for (i, a) in kept.iter().enumerate() {
            (whole.coefficients[*a], whole.errors[*a]) = (few.coefficients[i], few.errors[i]);
            for (k, b) in kept.iter().enumerate() {
                whole.covariance[a * n + b] = few.covariance[i * kept.len() + k];
            }
        }
        whole.untold.iter_mut().for_each(|k| *k = kept[*k]);
        let column = |c: usize| kept.iter().position(|own| *own == c);
        let triangle =
            DMatrix::from_fn(fit.triangle.nrows(), n, |i, c| column(c).map_or(0.0, |k| fit.triangle[(i, k)]));
        WeightedFit { fitted: whole, triangle, ..fit }
    }

    /// The same of these columns alone.
    fn of_columns(&self, kept: &[usize]) -> FitData {
        let block = |block: &FitBlock| FitBlock {
            rows: block.rows.chunks_exact(self.columns).flat_map(|row| kept.iter().map(|k| row[*k])).collect(),
            values: block.values.clone(),
        };
        FitData { columns: kept.len(), blocks: self.blocks.iter().map(block).collect(), ..*self }
    }

    /// The fit. Noise at instants up to `lags` apart may depend on each other.
    pub fn fit(&self, lags: usize) -> WeightedFit {
        let mut noise = self.rms(&vec![0.0; self.columns]);
        let greatest = noise.iter().fold(f64::MIN_POSITIVE.sqrt(), |most: f64, x| most.max(*x));
        let least: Vec<f64> = noise.iter().map(|x| LEAST_NOISE * x.max(AT_REST * greatest)).collect();
        // of an output that is zero all the time, as that of a joint without a drive, the first weight is none that hides all others
        noise.iter_mut().for_each(|x| *x = x.max(AT_REST * greatest));
        noise.iter_mut().zip(&least).for_each(|(x, least)| *x = x.max(*least));
        let mut used: Vec<Vec<bool>> =
            self.blocks.iter().map(|block| vec![true; block.values.len() / self.outputs]).collect();
        let mut squares = self.squares(&noise, &used);
        let mut fitted = squares.clone().finish(None);
        for _ in 1..ROUNDS {
            let left = self.left(&fitted.coefficients);
            used = self.near(&left, &least, lags);
            noise = self.spread(&left, &used, fitted.coefficients.len() - fitted.untold.len());
            noise.iter_mut().zip(&least).for_each(|(x, least)| *x = x.max(*least));
            squares = self.squares(&noise, &used);
            fitted = squares.clone().finish(None);
        }
        let (triangle, side) = squares.triangle();
        let left = self.left(&fitted.coefficients);
        let inflation = self.colour(&mut fitted, &left, (&noise, &used), lags);
        let instants = used.iter().flatten().filter(|used| **used).count();
        WeightedFit { fitted, noise, triangle, side, inflation, instants, far: self.instants() - instants }
    }

    fn squares(&self, noise: &[f64], used: &[Vec<bool>]) -> LeastSquares {
        let mut squares = LeastSquares::new(self.columns);
        let mut row = vec![0.0; self.columns];
        for (block, used) in self.blocks.iter().zip(used) {
            let rows = block.rows.chunks_exact(self.columns).zip(&block.values).enumerate();
            for (k, (own, value)) in rows.filter(|(k, _)| used[k / self.outputs]) {
                let scale = 1.0 / noise[k % self.outputs];
                row.iter_mut().zip(own).for_each(|(x, y)| *x = y * scale);
                squares.push(&row, value * scale);
            }
        }
        squares
    }

    /// The instants whose residuals are noise in all outputs, and whose neighbours' are.
    fn near(&self, left: &[Vec<f64>], least: &[f64], lags: usize) -> Vec<Vec<bool>> {
        let of_output =
            |j: usize| left.iter().flat_map(|b| b.iter().skip(j).step_by(self.outputs).copied()).collect::<Vec<f64>>();
        let bounds: Vec<f64> = (0..self.outputs).map(|j| FAR * robust_spread(&of_output(j)).1.max(least[j])).collect();
        let of_block = |block: &Vec<f64>| {
            let is_far = |instant: &[f64]| instant.iter().zip(&bounds).any(|(x, bound)| x.abs() > *bound);
            let far: Vec<bool> = block.chunks_exact(self.outputs).map(is_far).collect();
            let around = |k: usize| k.saturating_sub(lags)..(k + lags + 1).min(far.len());
            (0..far.len()).map(|k| !far[around(k)].contains(&true)).collect()
        };
        let near: Vec<Vec<bool>> = left.iter().map(of_block).collect();
        // a fit that most instants are far from tells nothing of what is far
        let count = near.iter().flatten().filter(|near| **near).count();
        match 2 * count > self.instants() {
            true => near,
            false => near.iter().map(|block| vec![true; block.len()]).collect(),
        }
    }

    /// Per output the standard deviation of what is left, of which the fit has taken its share.
    fn spread(&self, left: &[Vec<f64>], used: &[Vec<bool>], told: usize) -> Vec<f64> {
        let (mut sums, mut count) = (vec![0.0; self.outputs], 0);
        for (block, used) in left.iter().zip(used) {
            for (instant, _) in block.chunks_exact(self.outputs).zip(used).filter(|(_, used)| **used) {
                sums.iter_mut().zip(instant).for_each(|(sum, x)| *sum += x * x);
                count += 1;
            }
        }
        let share = told as f64 / self.outputs as f64;
        let freedom = (count as f64 - share).max(1.0);
        sums.iter().map(|sum| (sum / freedom).sqrt()).collect()
    }

    /// Puts errors into a fit that hold for noise as what is left has it, of any colour and common to several outputs: A M A, where A is the inverse of the
    /// squares of the rows y, and M the sum of y ρ y over instants up to so many lags apart and all outputs, with the correlation ρ of the noise. How much greater the
    /// squares of errors become.
    fn colour(
        &self,
        fitted: &mut Fitted,
        left: &[Vec<f64>],
        (noise, used): (&[f64], &[Vec<bool>]),
        lags: usize,
    ) -> f64 {
        let n = self.columns;
        // in full up to half of the lags, less and less beyond: far ones are chance more than noise
        let weight = |lag: usize| (2.0 * (1.0 - lag as f64 / (lags + 1) as f64)).min(1.0);
        let weighed = |all: &[DMatrix<f64>]| all.iter().enumerate().map(|(lag, x)| x * weight(lag)).collect::<Vec<_>>();
        let white = DMatrix::from_row_slice(n, n, &fitted.covariance);
        let inverse = &white / fitted.variance.max(f64::MIN_POSITIVE);
        let mut rows: Vec<NoisyRows> =
            self.blocks.iter().zip(used).map(|(block, used)| self.noisy_rows(block, (noise, used))).collect();
        let mut correlation: Vec<DMatrix<f64>> =
            (0..=lags).map(|lag| self.correlation(left, (noise, used), lag)).collect();
        let taken = {
            let weighed = weighed(&correlation);
            rows.iter_mut().for_each(|rows| rows.spread_by(&weighed));
            self.taken(&rows, &inverse, used, lags)
        };
        correlation.iter_mut().zip(taken).for_each(|(correlation, taken)| *correlation += taken);
        let weighed = weighed(&correlation);
        rows.iter_mut().for_each(|rows| rows.spread_by(&weighed));
        let covariance = &inverse * middle(&rows, n) * &inverse;
        let (mut ratio, mut count) = (0.0, 0);
        for k in (0..n).filter(|k| !fitted.untold.contains(k)) {
            // noise of little correlation can come out negative by chance; half of white is the least that is believed
            let own = covariance[(k, k)].max(0.5 * inverse[(k, k)]);
            fitted.errors[k] = own.sqrt();
            if inverse[(k, k)] > 0.0 {
                ratio += own / inverse[(k, k)];
                count += 1;
            }
        }
        fitted.covariance = covariance.transpose().as_slice().to_vec();
        if count > 0 {
            ratio / f64::from(count)
        } else {
            1.0
        }
    }

    fn noisy_rows(&self, block: &FitBlock, (noise, used): (&[f64], &[bool])) -> NoisyRows {
        let n = self.columns;
        let of_output = |(j, unit): (usize, &f64)| {
            let row = |k: usize| &block.rows[(k * self.outputs + j) * n..][..n];
            DMatrix::from_fn(used.len(), n, |k, c| if used[k] { row(k)[c] / unit } else { 0.0 })
        };
        NoisyRows { rows: noise.iter().enumerate().map(of_output).collect(), spread: Vec::new() }
    }

    /// By how much the fit makes the correlation of what is left smaller than that of the noise, at each lag: noise that looks like what the rows say is fitted, and
    /// rows are slow, as noise behind a low-pass is. With the noise's covariance Σ and P = Y A Yᵀ that is P Σ + Σ P − P Σ P, in the mean over instants.
    fn taken(&self, rows: &[NoisyRows], inverse: &DMatrix<f64>, used: &[Vec<bool>], lags: usize) -> Vec<DMatrix<f64>> {
        let half = inverse * middle(rows, self.columns) * inverse * 0.5;
        let mut sums = vec![DMatrix::<f64>::zeros(self.outputs, self.outputs); lags + 1];
        let mut counts = vec![0_usize; lags + 1];
        for (block, used) in rows.iter().zip(used) {
            let of_output = |(y, spread): (&DMatrix<f64>, &DMatrix<f64>)| {
                let mut shares = spread * inverse - y * &half;
                (0..used.len()).filter(|k| !used[*k]).for_each(|k| shares.row_mut(k).fill(0.0));
                shares
            };
            let shares: Vec<DMatrix<f64>> = block.rows.iter().zip(&block.spread).map(of_output).collect();
            for lag in 0..=lags.min(used.len().saturating_sub(1)) {
                let products = |now: &DMatrix<f64>, before: &DMatrix<f64>| {
                    now.rows(lag, used.len() - lag).dot(&before.rows(0, used.len() - lag))
                };
                for (i, k) in (0..self.outputs).flat_map(|i| (0..self.outputs).map(move |k| (i, k))) {
                    sums[lag][(i, k)] += products(&block.rows[i], &shares[k]) + products(&shares[i], &block.rows[k]);
                }
                counts[lag] += (lag..used.len()).filter(|k| used[*k] && used[k - lag]).count();
            }
        }
        sums.into_iter().zip(counts).map(|(sum, count)| sum / count.max(1) as f64).collect()
    }

    /// The correlation of what is left of each output with that of each so many instants before.
    fn correlation(&self, left: &[Vec<f64>], (noise, used): (&[f64], &[Vec<bool>]), lag: usize) -> DMatrix<f64> {
        let (mut sums, mut count) = (DMatrix::zeros(self.outputs, self.outputs), 0_usize);
        for (block, used) in left.iter().zip(used) {
            let at = |k: usize, j: usize| block[k * self.outputs + j] / noise[j];
            for k in (lag..used.len()).filter(|k| used[*k] && used[k - lag]) {
                for i in 0..self.outputs {
                    (0..self.outputs).for_each(|j| sums[(i, j)] += at(k, i) * at(k - lag, j));
                }
                count += 1;
            }
        }
        sums / count.max(1) as f64
    }
}

/// The rows of a block in units of the noise, zero where they are not used: per output a matrix, and what the noise's covariance makes of it.
struct NoisyRows {
    rows: Vec<DMatrix<f64>>,
    spread: Vec<DMatrix<f64>>,
}

impl NoisyRows {
    /// Σ Y, by the correlation at each lag.
    fn spread_by(&mut self, correlation: &[DMatrix<f64>]) {
        let outputs = self.rows.len();
        let (instants, n) = self.rows.first().map_or((0, 0), DMatrix::shape);
        self.spread = vec![DMatrix::<f64>::zeros(instants, n); outputs];
        for (lag, rho) in correlation.iter().enumerate().filter(|(lag, _)| *lag < instants) {
            for (i, k) in (0..outputs).flat_map(|i| (0..outputs).map(move |k| (i, k))) {
                let rho = rho[(i, k)];
                for c in 0..n {
                    let column = self.rows[k].column(c);
                    let ahead = self.rows[i].column(c);
                    for t in lag..instants {
                        self.spread[i][(t, c)] += rho * column[t - lag];
                        if lag > 0 {
                            self.spread[k][(t - lag, c)] += rho * ahead[t];
                        }
                    }
                }
            }
        }
    }
}

/// Yᵀ Σ Y, over all blocks.
fn middle(rows: &[NoisyRows], columns: usize) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(columns, columns);
    for (y, spread) in rows.iter().flat_map(|block| block.rows.iter().zip(&block.spread)) {
        sum.gemm_tr(1.0, y, spread, 1.0);
    }
    sum
}
