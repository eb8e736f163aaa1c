//! Smoothing, the observer, fits and episodes against closed forms.

use super::common::Noise;
use straightline_logs::episodes::{episodes, robust_spread, EpisodeDemand};
use straightline_logs::fit::LeastSquares;
use straightline_logs::observer::Observer;
use straightline_logs::smooth::LowPass;

fn times(count: usize, step: f64) -> Vec<f64> {
    (0..count).map(|i| i as f64 * step).collect()
}

#[test]
fn a_sine_at_the_cut_off_keeps_its_phase_and_is_down_by_3_db() {
    let t = times(8000, 1e-3);
    for (hertz, wanted) in [(20.0, 0.5_f64.sqrt()), (2.0, 1.0 / (1.0 + (2.0_f64.sqrt() - 1.0) * 1e-4)), (100.0, 0.0032)]
    {
        let wave = |t: &f64| (std::f64::consts::TAU * hertz * t).sin();
        let values: Vec<f64> = t.iter().map(wave).collect();
        let found = LowPass { cutoff: 20.0 }.apply(&t, &values);
        let inside = 2000..6000;
        let sum = |f: &dyn Fn(usize) -> f64| inside.clone().map(f).sum::<f64>() / inside.len() as f64 * 2.0;
        let gain = sum(&|i| found.values[i] * values[i]);
        let quadrature = sum(&|i| found.values[i] * (std::f64::consts::TAU * hertz * t[i]).cos());
        assert!((gain - wanted).abs() < 1e-3 && quadrature.abs() < 1e-6, "{hertz} Hz: {gain}, {quadrature}");
        // the derivative of what is smoothed
        let rate = sum(&|i| found.rates[i] * (std::f64::consts::TAU * hertz * t[i]).cos());
        assert!((rate - gain * std::f64::consts::TAU * hertz).abs() < 0.02 * rate.abs() + 1e-3, "{hertz} Hz: {rate}");
    }
}

#[test]
fn straight_lines_pass_unchanged_to_their_ends_at_uneven_steps_too() {
    let mut noise = Noise(3);
    let uneven: Vec<f64> = times(500, 2e-3).iter().map(|t| t + 3e-4 * noise.uniform()).collect();
    for t in [times(500, 2e-3), uneven] {
        let line: Vec<f64> = t.iter().map(|t| 3.0 - 7.0 * t).collect();
        let found = LowPass { cutoff: 15.0 }.apply(&t, &line);
        assert!(found.values.iter().zip(&line).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!(found.rates.iter().all(|rate| (rate + 7.0).abs() < 1e-6), "{:?}", &found.rates[..9]);
    }
}

/// A pendulum of its own: p = h(q) q̇ with a motion in closed form, and the torque that it takes plus what is hidden.
fn pendulum(t: &[f64], hidden: impl Fn(f64) -> f64) -> [Vec<f64>; 2] {
    let h = |q: f64| 0.7 + 0.3 * q.cos();
    let at = |t: &f64| {
        let (q, qd) = (1.2 * (2.1 * t).sin(), 1.2 * 2.1 * (2.1 * t).cos());
        let qdd = -1.2 * 2.1 * 2.1 * (2.1 * t).sin();
        // ṗ = h q̈ + h' q̇² = τ + f without what is hidden
        let rate = h(q) * qdd - 0.3 * q.sin() * qd * qd;
        (h(q) * qd, rate + hidden(*t))
    };
    let rows: Vec<(f64, f64)> = t.iter().map(at).collect();
    [rows.iter().map(|r| r.0).collect(), rows.iter().map(|r| r.1).collect()]
}

#[test]
fn the_observer_is_silent_without_noise_and_follows_what_is_hidden() {
    let observer = Observer { gain: 30.0 };
    let mut noise = Noise(8);
    let uneven: Vec<f64> = times(4000, 1e-3).iter().map(|t| t + 2e-4 * noise.uniform()).collect();
    for t in [times(4000, 1e-3), uneven] {
        let [p, force] = pendulum(&t, |_| 0.0);
        let residual = observer.residuals(&t, &p, &force);
        let most = residual.iter().fold(0.0_f64, |most, r| most.max(r.abs()));
        assert!(most < 1e-10, "{most}");
        // a push of 2 N·m from 1 s on: 1 − exp(−K (t − 1)) of it
        let [p, force] = pendulum(&t, |t| if t > 1.0 { 2.0 } else { 0.0 });
        let residual = observer.residuals(&t, &p, &force);
        for (t, r) in t.iter().zip(&residual).filter(|(t, _)| (**t - 1.0).abs() > 0.01) {
            let wanted = if *t > 1.0 { 2.0 * (1.0 - (-30.0 * (t - 1.0)).exp()) } else { 0.0 };
            assert!((r - wanted).abs() < 0.04, "{t}: {r}, {wanted}");
        }
    }
}

#[test]
fn a_fit_of_many_rows_finds_coefficients_errors_and_what_cannot_be_told() {
    let (mut noise, mut squares, wanted) = (Noise(21), LeastSquares::new(5), [2.0, -0.5, 1e-3, 0.0, 40.0]);
    for _ in 0..20_000 {
        let x = [noise.uniform(), 1.0, 1e3 * noise.uniform()];
        // the fourth is the sum of the first two; the fifth is never excited
        let row = [x[0], x[1], x[2], x[0] + x[1], 0.0];
        squares.push(&row, row.iter().zip(wanted).map(|(a, b)| a * b).sum::<f64>() + 0.1 * noise.uniform());
    }
    let found = squares.finish(None);
    assert_eq!(found.untold.len(), 2);
    assert!(found.untold.contains(&4));
    // what is told and what is not predict the same
    for row in [[1.0, 0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0, 0.0], [0.0, 0.0, 1000.0, 0.0, 0.0]] {
        let of = |c: &[f64]| row.iter().zip(c).map(|(a, b)| a * b).sum::<f64>();
        assert!((of(&found.coefficients) - of(&wanted)).abs() < 5e-3, "{found:?}");
    }
    // uniform noise of ±0.1 has the standard deviation 0.1/√3
    assert!((found.rms - 0.1 / 3.0_f64.sqrt()).abs() < 1e-3, "{}", found.rms);
    // and a column of ±1000 the error σ / (1000 √(N/3))
    let error = found.rms / (1000.0 * (20_000.0_f64 / 3.0).sqrt());
    assert!((found.errors[2] / error - 1.0).abs() < 0.02, "{:?} {error}", found.errors);
}

#[test]
fn fewer_rows_than_columns_leave_columns_untold() {
    let mut squares = LeastSquares::new(3);
    squares.push(&[1.0, 2.0, 0.5], 4.0);
    let found = squares.finish(None);
    assert_eq!(found.untold.len(), 2);
    assert_eq!(LeastSquares::new(2).finish(None).untold, [0, 1]);
}

#[test]
fn a_push_is_an_episode_and_noise_is_none() {
    let mut noise = Noise(4);
    let t = times(10_000, 1e-3);
    let mut residual: Vec<f64> = t.iter().map(|_| 0.2 + 0.1 * (0..6).map(|_| noise.uniform()).sum::<f64>()).collect();
    let of = |r: &[f64]| episodes(&t, r, robust_spread(r), 0.0, EpisodeDemand::default());
    assert_eq!(of(&residual), []);
    residual[4000..4250].iter_mut().for_each(|r| *r -= 3.0);
    residual[9000] = 50.0; // a single row is no contact
    let found = of(&residual);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        (found[0].from - 4.0).abs() < 0.002 && (found[0].to - 4.249).abs() < 0.002 && found[0].peak < -2.5,
        "{found:?}"
    );
}
