//! Zero-phase low-pass and derivatives.
//!
//! A Butterworth filter of order two runs forward and backward over samples at equal steps, so that no phase is left and the magnitude is that of
//! order four, down by 3 dB at the cut-off. Each end is continued by its mirror image through the last point.

use std::f64::consts::{PI, SQRT_2};

/// Steps that differ less, as a part of the step, are equal.
const EQUAL: f64 = 1e-4;

/// The low-pass at this cut-off \[Hz\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    /// \[Hz\]
    pub cutoff: f64,
}

/// One column over stamps that grow: as it is smoothed, and the derivative of that.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothed {
    /// The values.
    pub values: Vec<f64>,
    /// Their derivatives by time.
    pub rates: Vec<f64>,
}

/// Whether stamps are at equal steps.
fn is_uniform(times: &[f64], step: f64) -> bool {
    times.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() <= EQUAL * step)
}

impl LowPass {
    /// Smoothes a column. Stamps that are not at equal steps are brought to their mean step by straight lines, and back; where the cut-off is above
    /// a third of the sampling, nothing is smoothed.
    pub fn apply(&self, times: &[f64], values: &[f64]) -> Smoothed {
        let n = times.len();
        if n < 2 {
            return Smoothed { values: values.to_vec(), rates: vec![0.0; n] };
        }
        let step = (times[n - 1] - times[0]) / (n - 1) as f64;
        if is_uniform(times, step) {
            let values = self.filtered(values, step);
            let rates = rates(&values, step);
            return Smoothed { values, rates };
        }
        let grid: Vec<f64> = (0..n).map(|i| times[0] + step * i as f64).collect();
        let filtered = self.filtered(&between(times, values, &grid), step);
        let slopes = rates(&filtered, step);
        Smoothed { values: between(&grid, &filtered, times), rates: between(&grid, &slopes, times) }
    }

    /// Values at equal steps \[s\].
    pub fn filtered(&self, values: &[f64], step: f64) -> Vec<f64> {
        // two passes are down by 3 dB where one is by 1.5 dB
        let cutoff = self.cutoff / (SQRT_2 - 1.0).powf(0.25);
        let relative = cutoff * step;
        let n = values.len();
        if relative > 1.0 / 3.0 || n < 2 {
            return values.to_vec();
        }
        let k = (PI * relative).tan();
        let norm = 1.0 / (1.0 + SQRT_2 * k + k * k);
        let (b, a) =
            ([k * k * norm, 2.0 * k * k * norm], [2.0 * (k * k - 1.0) * norm, (1.0 - SQRT_2 * k + k * k) * norm]);
        // five periods, after which what the filter remembers of its start is lost in rounding
        let pad = ((5.0 / relative).ceil() as usize).min(n - 1);
        let mut run = Vec::with_capacity(n + 2 * pad);
        run.extend((1..=pad).rev().map(|i| 2.0 * values[0] - values[i]));
        run.extend_from_slice(values);
        run.extend((1..=pad).map(|i| 2.0 * values[n - 1] - values[n - 1 - i]));
        pass(&mut run, b, a);
        run.reverse();
        pass(&mut run, b, a);
        run.reverse();
        run[pad..pad + n].to_vec()
    }
}

/// One pass of y = (b₀ + b₁ z⁻¹ + b₀ z⁻²) / (1 + a₁ z⁻¹ + a₂ z⁻²) x, at rest on the first value.
fn pass(values: &mut [f64], [b0, b1]: [f64; 2], [a1, a2]: [f64; 2]) {
    let first = values[0];
    let mut z2 = (b0 - a2) * first;
    let mut z1 = (b1 - a1) * first + z2;
    for x in values {
        let y = b0 * *x + z1;
        z1 = b1 * *x - a1 * y + z2;
        z2 = b0 * *x - a2 * y;
        *x = y;
    }
}

/// Derivatives at equal steps, by quartics through five neighbours.
fn rates(values: &[f64], step: f64) -> Vec<f64> {
    let n = values.len();
    let width = n.min(5);
    let nodes: Vec<f64> = (0..width).map(|i| i as f64 * step).collect();
    let weights: Vec<Vec<f64>> = nodes.iter().map(|at| derivative_weights(&nodes, *at)).collect();
    let at = |i: usize| {
        let first = i.saturating_sub(width / 2).min(n - width);
        weights[i - first].iter().zip(&values[first..first + width]).map(|(w, x)| w * x).sum()
    };
    let Some([a, b, c, d, e]) = weights.get(2).and_then(|middle| <[f64; 5]>::try_from(&middle[..]).ok()) else {
        return (0..n).map(at).collect();
    };
    let middle = values.windows(5).map(|v| a * v[0] + b * v[1] + c * v[2] + d * v[3] + e * v[4]);
    (0..2).map(at).chain(middle).chain((n - 2..n).map(at)).collect()
}

/// Weights of the derivative at `at` of the polynomial through values at these nodes.
pub fn derivative_weights(nodes: &[f64], at: f64) -> Vec<f64> {
    // l_i' = Σ_{j≠i} 1/(x_i − x_j) Π_{k≠i,j} (x − x_k)/(x_i − x_k)
    let n = nodes.len();
    let others = move |i: usize, j: usize| (0..n).filter(move |k| *k != i && *k != j);
    let part = |i: usize, j: usize| {
        let product: f64 = others(i, j).map(|k| (at - nodes[k]) / (nodes[i] - nodes[k])).product();
        product / (nodes[i] - nodes[j])
    };
    (0..n).map(|i| (0..n).filter(|j| *j != i).map(|j| part(i, j)).sum()).collect()
}

/// Values at other stamps, by straight lines; both stamps grow.
fn between(times: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let mut k = 0;
    let value = |t: &f64| {
        while k + 2 < times.len() && times[k + 1] < *t {
            k += 1;
        }
        let part = ((t - times[k]) / (times[k + 1] - times[k])).clamp(0.0, 1.0);
        values[k] + part * (values[k + 1] - values[k])
    };
    at.iter().map(value).collect()
}
