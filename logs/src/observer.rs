//! The observer of generalized momentum: residual torques without accelerations (De Luca and Mattone 2003).
//!
//! p = H q̇ grows by ṗ = τ + f(q, q̇), f = Cᵀq̇ − g − friction and springs, if the model is right. With s = p − ∫ (τ + f) dt the residual follows
//! ṙ = K (ṡ − r), exactly so for an s that is a straight line from sample to sample. The integral is that of the polynomial through six neighbours, of
//! any steps: by trapezia the integral of a fast motion would be off by more than what is looked for.

/// How fast the residual follows \[1/s\]: K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer {
    /// K \[1/s\]: its time constant is 1/K, its cut-off K / 2π Hz.
    pub gain: f64,
}

impl Observer {
    /// Residuals of one coordinate over stamps that grow: measured minus model, of its momentum p and of τ + f; at rest on zero at the first stamp.
    pub fn residuals(&self, times: &[f64], momentum: &[f64], force: &[f64]) -> Vec<f64> {
        let steps = integrals(times, force);
        let mut found = Vec::with_capacity(times.len());
        let mut r = 0.0;
        for i in 0..times.len() {
            if i > 0 {
                let step = times[i] - times[i - 1];
                let stays = (-self.gain * step).exp();
                // what drives in addition to the model has the sign of measured minus model: the momentum does not grow as τ says
                let slope = (steps[i - 1] - (momentum[i] - momentum[i - 1])) / step;
                r = stays * r + (1.0 - stays) * slope;
            }
            found.push(r);
        }
        found
    }
}

/// Neighbours of a step that its integral is made of.
const WIDTH: usize = 6;

/// Integrals from each stamp to the next of the polynomials through up to six neighbours.
pub(crate) fn integrals(times: &[f64], values: &[f64]) -> Vec<f64> {
    let n = times.len();
    let width = n.min(WIDTH);
    // weights per length of the step, of the nodes in units of it
    let (mut nodes, mut known) = ([0.0; WIDTH], (usize::MAX, [f64::NAN; WIDTH], [0.0; WIDTH]));
    let mut found = Vec::with_capacity(n.saturating_sub(1));
    for i in 0..n.saturating_sub(1) {
        let first = (i + 1).saturating_sub(width / 2).min(n - width);
        let step = times[i + 1] - times[i];
        nodes[..width].iter_mut().zip(&times[first..]).for_each(|(node, t)| *node = (t - times[i]) / step);
        // stamps at equal steps differ by rounding
        let is_same = known.0 == i - first && nodes[..width].iter().zip(&known.1).all(|(a, b)| (a - b).abs() <= 1e-9);
        if !is_same {
            known = (i - first, nodes, integral_weights(&nodes[..width]));
        }
        let sum: f64 = known.2[..width].iter().zip(&values[first..]).map(|(w, x)| w * x).sum();
        found.push(step * sum);
    }
    found
}

/// Weights of the integral from 0 to 1 of the polynomial through values at these nodes.
fn integral_weights(nodes: &[f64]) -> [f64; WIDTH] {
    let weight = |i: usize| {
        let mut coefficients = vec![1.0];
        for (j, node) in nodes.iter().enumerate().filter(|(j, _)| *j != i) {
            let scale = 1.0 / (nodes[i] - nodes[j]);
            // (x − node) · polynomial
            let mut next = vec![0.0; coefficients.len() + 1];
            for (k, c) in coefficients.iter().enumerate() {
                next[k + 1] += scale * c;
                next[k] -= scale * node * c;
            }
            coefficients = next;
        }
        coefficients.iter().enumerate().map(|(k, c)| c / (k + 1) as f64).sum::<f64>()
    };
    std::array::from_fn(|i| if i < nodes.len() { weight(i) } else { 0.0 })
}
