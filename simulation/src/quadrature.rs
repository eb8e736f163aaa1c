//! Integrals over the instants of an analysis.

/// The weights of ∫ y dt over these ascending instants: Simpson's rule on every piece between two instants at one time (knots of the
/// motion, where y may jump), of order 4, where its instants are equally spaced and odd in number; the trapezoidal rule elsewhere.
pub(crate) fn weights(times: &[f64]) -> Vec<f64> {
    let mut weights = vec![0.0; times.len()];
    let mut first = 0;
    for last in 1..=times.len() {
        if last < times.len() && times[last] > times[last - 1] {
            continue;
        }
        let (steps, length) = (last - 1 - first, times[last - 1] - times[first]);
        let h = length / steps.max(1) as f64;
        let even = |k: usize| (times[k + 1] - times[k] - h).abs() <= 1e-6 * h;
        match steps >= 2 && steps % 2 == 0 && (first..last - 1).all(even) {
            true => (0..=steps).for_each(|k| {
                let part = if k == 0 || k == steps { 1.0 } else { 2.0 * (1 + k % 2) as f64 };
                weights[first + k] += h / 3.0 * part;
            }),
            false => (first..last - 1).for_each(|k| {
                let half = 0.5 * (times[k + 1] - times[k]);
                weights[k] += half;
                weights[k + 1] += half;
            }),
        }
        first = last;
    }
    weights
}

/// ∫ y dt by [`weights`].
pub(crate) fn integral(times: &[f64], y: impl Fn(usize) -> f64) -> f64 {
    weights(times).iter().enumerate().map(|(k, w)| w * y(k)).sum()
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn cubics_on_even_pieces_and_lines_on_all_others_are_exact() {
        // a jump at 1, then a piece that is not equally spaced
        let times = [0.0f64, 0.25, 0.5, 0.75, 1.0, 1.0, 1.1, 1.4, 2.0];
        let y = |k: usize| if k < 5 { times[k].powi(3) } else { 3.0 - times[k] };
        assert!((integral(&times, y) - (0.25 + 1.5)).abs() < 1e-15);
        assert_eq!(integral(&[0.3], |_| 1.0), 0.0);
    }
}
