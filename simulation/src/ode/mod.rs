//! The integration of smooth pieces of systems of first order, by an explicit method ([`dormand_prince`]) or an implicit one ([`radau`]).
//!
//! Both are one-step methods of high order: a simulation begins anew at every event and every corner of its command, where a
//! multistep method would fall back to order one. Steps are chosen by error control, a step that leads to a number that is not
//! finite is rejected like one with too great an error, and the steps of a whole simulation are counted ([`Pace`]), so that what
//! would not end in bounded time says so early.

mod dormand_prince;
mod pace;
mod radau;

pub(crate) use pace::Pace;

use crate::simulate::{Failure, Method, Settings};
use std::cell::Cell;
use std::ops::ControlFlow;

/// A system of first order.
pub(crate) trait Equations {
    /// The rates of all states.
    fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]);

    /// What a state is, in words.
    fn quantity(&self, i: usize) -> String;

    /// What is wrong with a state that a step has led to, if anything.
    fn objection(&self, y: &[f64]) -> Option<String>;
}

/// What looks on between steps, and may end the integration.
pub(crate) trait Watch {
    /// After a step; and once before the first one, with no time gone by.
    fn step(&mut self, step: &AcceptedStep) -> ControlFlow<()>;
}

/// An accepted step.
pub(crate) struct AcceptedStep<'a> {
    /// From here \[s\].
    pub t_before: f64,
    /// To here \[s\].
    pub t: f64,
    /// The state there.
    pub y_before: &'a [f64],
    /// The state here.
    pub y: &'a [f64],
    /// In between, by the method's own interpolation.
    pub within: &'a dyn Fn(f64) -> Vec<f64>,
}

/// What a piece of the integration gave.
pub(crate) struct Solved {
    /// The state at its end.
    pub y: Vec<f64>,
    /// Accepted steps.
    pub accepted: usize,
    /// Evaluations of the equations.
    pub evaluations: usize,
}

/// Integrates from a state over a time without corners.
///
/// # Errors
/// The method found no way on, a number is not finite, or there would be too many steps.
pub(crate) fn solve(
    equations: &dyn Equations,
    watch: &mut dyn Watch,
    (start, end): (f64, f64),
    state: &[f64],
    settings: &Settings,
    pace: &Pace,
) -> Result<Solved, Failure> {
    let piece = Piece { equations, start, end, settings, pace, evaluations: Cell::new(0), blame: Cell::new(None) };
    let mut rate = vec![0.0; state.len()];
    piece.check(start, state)?;
    if !piece.rate(start, state, &mut rate) {
        return Err(piece.not_finite(start));
    }
    let still = |_: f64| state.to_vec();
    let first = AcceptedStep { t_before: start, t: start, y_before: state, y: state, within: &still };
    if watch.step(&first).is_break() {
        return Ok(piece.solved(state.to_vec(), 0));
    }
    match settings.method {
        Method::Adaptive => dormand_prince::integrate(&piece, watch, state, rate),
        Method::Stiff => radau::integrate(&piece, watch, state, rate),
    }
}

/// What both methods share of a piece.
struct Piece<'a> {
    equations: &'a dyn Equations,
    start: f64,
    end: f64,
    settings: &'a Settings,
    pace: &'a Pace,
    evaluations: Cell<usize>,
    /// The state whose rate was not finite when that was last so, and when.
    blame: Cell<Option<(usize, f64)>>,
}

impl Piece<'_> {
    /// The rates of all states; `false` if one of them is not finite.
    fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]) -> bool {
        self.evaluations.set(self.evaluations.get() + 1);
        if !self.are_finite(t, y) {
            return false;
        }
        self.equations.rate(t, y, rate);
        self.are_finite(t, rate)
    }

    /// Whether numbers at a time are finite; the first that is not is to blame.
    fn are_finite(&self, t: f64, numbers: &[f64]) -> bool {
        // all of them, in vectors: nearly always they are
        if numbers.iter().fold(true, |finite, x| finite & x.is_finite()) {
            return true;
        }
        let first = numbers.iter().position(|x| !x.is_finite());
        self.blame.set(first.map(|i| (i, t)));
        false
    }

    /// Whether a step so short is lost in the rounding of the time.
    fn vanishes(&self, h: f64) -> bool {
        0.1 * h <= f64::EPSILON * self.end.abs()
    }

    /// A step that is just not lost.
    fn least(&self) -> f64 {
        20.0 * f64::EPSILON * self.end.abs()
    }

    /// The error that is allowed of a state.
    fn scale(&self, tolerance: f64, y: f64) -> f64 {
        tolerance + tolerance * y.abs()
    }

    /// A step that is likely to be right at the beginning (Hairer, Nørsett and Wanner 1993, section II.4).
    fn first_step(&self, order: f64, tolerance: f64, y: &[f64], rate: &[f64]) -> f64 {
        let most = self.most();
        let norm = |x: &dyn Fn(usize) -> f64| {
            let square = |i: usize| (x(i) / self.scale(tolerance, y[i])).powi(2);
            ((0..y.len()).map(square).sum::<f64>() / y.len().max(1) as f64).sqrt()
        };
        let (size, speed) = (norm(&|i| y[i]), norm(&|i| rate[i]));
        let h = if size < 1e-5 || speed < 1e-5 { 1e-6 } else { 0.01 * size / speed }.min(most);
        let ahead: Vec<f64> = y.iter().zip(rate).map(|(y, r)| y + h * r).collect();
        let mut later = vec![0.0; y.len()];
        if !self.rate(self.start + h, &ahead, &mut later) {
            return 1e-3 * h;
        }
        let bend = norm(&|i| later[i] - rate[i]) / h;
        let greatest = speed.max(bend);
        let by_order = if greatest <= 1e-15 { (1e-3 * h).max(1e-6) } else { (0.01 / greatest).powf(1.0 / order) };
        (100.0 * h).min(by_order).min(most)
    }

    /// The longest step: interpolation between steps is not under error control, and rows are interpolated.
    fn most(&self) -> f64 {
        self.settings.interval.min(self.end - self.start)
    }

    fn check(&self, t: f64, y: &[f64]) -> Result<(), Failure> {
        if let Some(i) = y.iter().position(|x| !x.is_finite()) {
            let why = format!("{} is {}, not a finite number", self.equations.quantity(i), y[i]);
            return Err(Failure::new(t, why));
        }
        self.equations.objection(y).map_or(Ok(()), |why| Err(Failure::new(t, why)))
    }

    /// What is to be said where no step is short enough.
    fn no_step(&self, t: f64) -> Failure {
        match self.blame.get() {
            Some((_, when)) if (when - t).abs() <= 1e-9 * self.end.abs() => self.not_finite(t),
            _ => {
                let help = "a greater coulomb_speed or another tolerance in [simulation] may help";
                Failure::new(
                    t,
                    "steps become too small: the motion is not smooth there, or forces are beyond all measure"
                        .to_string(),
                )
                .with_help(help)
            }
        }
    }

    fn not_finite(&self, t: f64) -> Failure {
        let (i, when) = self.blame.get().unwrap_or((0, t));
        let why = format!("{} leaves the finite numbers at t = {when:?} s", self.equations.quantity(i));
        Failure::new(t, why)
            .with_help("are masses, stiffnesses, gains and the start of a size that the robot can have?")
    }

    fn solved(&self, y: Vec<f64>, accepted: usize) -> Solved {
        Solved { y, accepted, evaluations: self.evaluations.get() }
    }
}

/// √(Σ xᵢ²/n).
fn root_mean_square(x: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = x.len().max(1) as f64;
    (x.map(|x| x * x).sum::<f64>() / n).sqrt()
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    /// A system from a closure.
    struct Of<F>(F);

    impl<F: Fn(f64, &[f64], &mut [f64])> Equations for Of<F> {
        fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]) {
            (self.0)(t, y, rate);
        }

        fn quantity(&self, i: usize) -> String {
            format!("state {i}")
        }

        fn objection(&self, _: &[f64]) -> Option<String> {
            None
        }
    }

    /// Keeps the states in the middle of steps.
    #[derive(Default)]
    struct Middles(Vec<(f64, Vec<f64>)>);

    impl Watch for Middles {
        fn step(&mut self, step: &AcceptedStep) -> ControlFlow<()> {
            if step.t > step.t_before {
                let middle = 0.4 * step.t_before + 0.6 * step.t;
                self.0.push((middle, (step.within)(middle)));
                for (t, y) in [(step.t_before, step.y_before), (step.t, step.y)] {
                    let there = (step.within)(t);
                    let apart = there.iter().zip(y).map(|(a, b)| (a - b).abs() / (1.0 + b.abs()));
                    let apart = apart.fold(0.0, f64::max);
                    assert!(apart < 1e-9 || step.y[1].abs() > 1e3, "interpolation meets both ends: {apart:e}");
                }
            }
            ControlFlow::Continue(())
        }
    }

    fn settings(method: Method, tolerance: f64, end: f64) -> Settings {
        Settings { method, tolerance, interval: end, ..Settings::lasting(end) }
    }

    fn run(f: impl Fn(f64, &[f64], &mut [f64]), y: &[f64], settings: &Settings) -> Result<(Solved, Middles), Failure> {
        let mut middles = Middles::default();
        let end = settings.duration;
        let solved = solve(&Of(f), &mut middles, (0.0, end), y, settings, &Pace::new(settings))?;
        Ok((solved, middles))
    }

    /// Two bodies on an ellipse of eccentricity 0.3, (x, y, vx, vy), and a sum that nothing depends on.
    fn orbit(_: f64, y: &[f64], rate: &mut [f64]) {
        let r3 = (y[0] * y[0] + y[1] * y[1]).powf(1.5);
        rate.copy_from_slice(&[y[2], y[3], -y[0] / r3, -y[1] / r3, y[2] * y[2]]);
    }

    pub fn steps_grow_with_the_tolerance_as_the_order_says() {
        let start = [0.7, 0.0, 0.0, (1.3f64 / 0.7).sqrt(), 0.0];
        for (method, tolerances, order) in [(Method::Adaptive, [1e-9, 1e-12], 8.0), (Method::Stiff, [1e-6, 1e-9], 5.0)]
        {
            let [coarse, fine] = tolerances.map(|tolerance| {
                let (solved, middles) =
                    run(orbit, &start, &settings(method, tolerance, std::f64::consts::TAU)).unwrap();
                let off = (0..4).map(|i| (solved.y[i] - start[i]).abs()).fold(0.0, f64::max);
                let energy = |y: &[f64]| 0.5 * (y[2] * y[2] + y[3] * y[3]) - 1.0 / (y[0] * y[0] + y[1] * y[1]).sqrt();
                let between = middles.0.iter().map(|(_, y)| (energy(y) - energy(&start)).abs()).fold(0.0, f64::max);
                println!("{method:?} {tolerance:e}: {} steps, off {off:e}, in steps {between:e}", solved.accepted);
                assert!(off < 1e3 * tolerance, "{method:?}: {off:e}");
                // interpolation of order 7, and of order 3
                assert!(between < if method == Method::Adaptive { 1e4 * tolerance } else { tolerance.powf(0.5) });
                (off, solved.accepted as f64)
            });
            let measured = (coarse.0 / fine.0).ln() / (fine.1 / coarse.1).ln();
            assert!(measured > order - 1.5, "{method:?}: order {measured}");
        }
    }

    pub fn the_implicit_method_takes_stiff_systems_of_any_size_in_few_steps() {
        // van der Pol with μ = 1e6 in the time μ t (Hairer and Wanner 1996, IV.10): y(2) = 1.706167732170483
        let van_der_pol = |_: f64, y: &[f64], rate: &mut [f64]| {
            (rate[0], rate[1]) = (y[1], ((1.0 - y[0] * y[0]) * y[1] - y[0]) * 1e6);
        };
        let (solved, _) = run(van_der_pol, &[2.0, -0.66], &settings(Method::Stiff, 1e-7, 2.0)).unwrap();
        println!("{} steps: {:?}", solved.accepted, solved.y);
        assert!((solved.y[0] - 1.706_167_732_170_483).abs() < 1e-5 && solved.accepted < 1500);
        // heat on a rod of 200 pieces: slowest mode e^{−π² t}
        let heat = |_: f64, y: &[f64], rate: &mut [f64]| {
            let n = y.len();
            let at = |i: usize| if i == 0 || i == n + 1 { 0.0 } else { y[i - 1] };
            (1..=n).for_each(|i| rate[i - 1] = (at(i - 1) - 2.0 * at(i) + at(i + 1)) * ((n + 1) * (n + 1)) as f64);
        };
        let n = 200;
        let mode = |i: usize| (std::f64::consts::PI * (i + 1) as f64 / (n + 1) as f64).sin();
        let rod: Vec<f64> = (0..n).map(mode).collect();
        let (solved, _) = run(heat, &rod, &settings(Method::Stiff, 1e-7, 0.1)).unwrap();
        let eigenvalue = (2.0 * (std::f64::consts::PI / 201.0).cos() - 2.0) * 201.0 * 201.0;
        assert!((solved.y[80] - rod[80] * (0.1 * eigenvalue).exp()).abs() < 1e-6 && solved.accepted < 100);
    }

    pub fn what_leaves_the_finite_numbers_is_named() {
        // 1/(1 − t) has no value at t = 1
        let pole = |_: f64, y: &[f64], rate: &mut [f64]| (rate[0], rate[1]) = (1.0, y[1] * y[1]);
        let hole = |_: f64, y: &[f64], rate: &mut [f64]| (rate[0], rate[1]) = (1.0, (0.5 - y[0]).sqrt());
        for method in [Method::Adaptive, Method::Stiff] {
            let failure = run(pole, &[0.0, 1.0], &settings(method, 1e-8, 2.0)).err().expect("there is no way on");
            assert!((failure.time - 1.0).abs() < 1e-3, "{method:?}: {failure}");
            let failure = run(hole, &[0.0, 0.0], &settings(method, 1e-8, 2.0)).err().expect("there is no way on");
            assert!(failure.why.contains("state 1") && (failure.time - 0.5).abs() < 1e-3, "{method:?}: {failure}");
        }
    }
}
