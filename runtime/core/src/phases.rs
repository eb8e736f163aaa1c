//! The phases of a contact task as one simulation: approach, impact, contact, lift-off, in steps of fixed length.
//!
//! A mode lasts while its guards are positive: the distance from the surface, the reaction, the margin of friction. Each step is
//! one of Runge and Kutta's, of fourth order; where a guard falls to zero inside a step, the step is halved until the
//! instant is known to 2⁻⁴⁸ of it, the task says what happens there (an impact, another mode), and the rest of the step
//! follows in the new mode. No allocation, no recursion, and so many evaluations at most per step that their number is known.
//!
//! ```
//! use straightline_core::phases::{ContactTask, Simulation};
//!
//! /// A ball that falls on a floor and bounces with e = 0.5; x = (height, velocity).
//! struct Ball;
//! impl ContactTask<2, 1> for Ball {
//!     type Mode = ();
//!     fn rate(&mut self, _: (), _: f64, x: &[f64; 2]) -> [f64; 2] {
//!         [x[1], -10.0]
//!     }
//!     fn guards(&mut self, _: (), _: f64, x: &[f64; 2]) -> [f64; 1] {
//!         [x[0]]
//!     }
//!     fn event(&mut self, _: (), _: usize, _: f64, x: &mut [f64; 2]) {
//!         *x = [0.0, -0.5 * x[1]];
//!     }
//! }
//! let mut ball = Simulation { time: 0.0, mode: (), state: [5.0, 0.0] };
//! for _ in 0..150 {
//!     ball.step(&mut Ball, 0.01).unwrap();
//! }
//! // one second down with 10 m/s, half a second up from there: 5 t − 5 t²
//! assert!((ball.state[0] - 1.25).abs() < 1e-12 && ball.state[1].abs() < 1e-12);
//! ```

/// What a simulation needs of a task with a state of N numbers and G guards.
pub trait ContactTask<const N: usize, const G: usize> {
    /// Which contacts are closed.
    type Mode: Copy;

    /// ẋ in a mode at a time \[s\].
    fn rate(&mut self, mode: Self::Mode, time: f64, state: &[f64; N]) -> [f64; N];

    /// Numbers that are positive while the mode lasts; infinite for those that play no part in it.
    fn guards(&mut self, mode: Self::Mode, time: f64, state: &[f64; N]) -> [f64; G];

    /// What happens when a guard has fallen to zero: the next mode, and what jumps in the state.
    fn event(&mut self, mode: Self::Mode, guard: usize, time: f64, state: &mut [f64; N]) -> Self::Mode;

    /// After every whole step: against drift.
    fn after_step(&mut self, _mode: Self::Mode, _time: f64, _state: &mut [f64; N]) {}
}

/// A simulation at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simulation<M, const N: usize> {
    /// t \[s\].
    pub time: f64,
    /// Which contacts are closed.
    pub mode: M,
    /// x.
    pub state: [f64; N],
}

/// Why a step did not come to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfinished {
    /// More events within one step than [`MOST_EVENTS`]: bounces that come ever faster, or modes that exclude each other.
    TooManyEvents,
    /// A number of the state is not finite.
    NotFinite,
}

impl core::fmt::Display for Unfinished {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Unfinished::TooManyEvents => "too many events within one step",
            Unfinished::NotFinite => "the state is not finite",
        })
    }
}

/// Events within one step.
pub const MOST_EVENTS: usize = 8;
/// Halvings of a step in search of an event.
const HALVINGS: usize = 48;

impl<M: Copy, const N: usize> Simulation<M, N> {
    /// Goes on by `length` \[s\]. Gives the number of events on the way.
    ///
    /// A guard counts from the first step, or rest of a step after an event, at whose beginning it is positive.
    ///
    /// # Errors
    /// The simulation stays where the last event, or the step before, has left it.
    pub fn step<const G: usize>(
        &mut self,
        task: &mut impl ContactTask<N, G, Mode = M>,
        length: f64,
    ) -> Result<usize, Unfinished> {
        let end = self.time + length;
        let mut rest = length;
        for events in 0..=MOST_EVENTS {
            let before = task.guards(self.mode, self.time, &self.state);
            let fallen = |task: &mut _, x: &[f64; N], h: f64| fallen(task, self, &before, x, h);
            let whole = advanced(task, self, rest);
            if !whole.iter().all(|x| x.is_finite()) {
                return Err(Unfinished::NotFinite);
            }
            let Some(mut guard) = fallen(task, &whole, rest) else {
                (self.state, self.time) = (whole, end);
                task.after_step(self.mode, self.time, &mut self.state);
                return Ok(events);
            };
            // none has fallen at `low`, one has at `high`
            let (mut low, mut high, mut state) = (0.0, rest, whole);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                let there = advanced(task, self, middle);
                match fallen(task, &there, middle) {
                    Some(first) => (high, state, guard) = (middle, there, first),
                    None => low = middle,
                }
            }
            if events == MOST_EVENTS {
                return Err(Unfinished::TooManyEvents);
            }
            (self.state, self.time) = (state, self.time + high);
            self.mode = task.event(self.mode, guard, self.time, &mut self.state);
            rest -= high;
        }
        Err(Unfinished::TooManyEvents)
    }
}

/// The first guard that was positive and is so no more after the step of length h.
fn fallen<T: ContactTask<N, G>, const N: usize, const G: usize>(
    task: &mut T,
    from: &Simulation<T::Mode, N>,
    before: &[f64; G],
    state: &[f64; N],
    h: f64,
) -> Option<usize> {
    let now = task.guards(from.mode, from.time + h, state);
    (0..G).find(|&k| before[k] > 0.0 && now[k] <= 0.0)
}

/// One step of the classical Runge-Kutta method.
fn advanced<T: ContactTask<N, G>, const N: usize, const G: usize>(
    task: &mut T,
    from: &Simulation<T::Mode, N>,
    h: f64,
) -> [f64; N] {
    let Simulation { time, mode, state } = from;
    let along = |k: &[f64; N], h: f64| core::array::from_fn(|i| state[i] + h * k[i]);
    let k1 = task.rate(*mode, *time, state);
    let k2 = task.rate(*mode, time + 0.5 * h, &along(&k1, 0.5 * h));
    let k3 = task.rate(*mode, time + 0.5 * h, &along(&k2, 0.5 * h));
    let k4 = task.rate(*mode, time + h, &along(&k3, h));
    core::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}
