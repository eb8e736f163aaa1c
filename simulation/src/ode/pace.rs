//! The steps of a whole simulation: how many there are, and whether the end is in sight.

use crate::simulate::{Failure, Method, Settings};
use std::cell::Cell;

/// Steps from one look ahead to the next.
const WINDOW: usize = 4096;
/// Looks ahead, one after the other, that have to find the end out of reach.
const LOOKS: usize = 3;
/// By how much what is foreseen may be wrong: the hardest part of a motion can be a short one. Where the explicit method is held
/// back by stability, and not by the motion, it stays so.
const MARGIN: f64 = 20.0;

/// The steps of a simulation.
pub(crate) struct Pace {
    most: usize,
    duration: f64,
    method: Method,
    used: Cell<usize>,
    /// Steps and time at the last look ahead.
    last: Cell<(usize, f64)>,
    looks: Cell<usize>,
    /// Whether the explicit method is held back by stability.
    is_stiff: Cell<bool>,
    /// The step that the implicit method would make next \[s\].
    pub next: Cell<Option<f64>>,
}

impl Pace {
    pub fn new(settings: &Settings) -> Pace {
        Pace {
            most: settings.most_steps,
            duration: settings.duration,
            method: settings.method,
            used: Cell::new(0),
            last: Cell::new((0, 0.0)),
            looks: Cell::new(0),
            is_stiff: Cell::new(false),
            next: Cell::new(None),
        }
    }

    /// The explicit method finds that stability holds its steps back, or that it does not.
    pub fn finds_stiffness(&self, is_stiff: bool) {
        self.is_stiff.set(is_stiff);
    }

    /// Before a step from time `t` on, whether the one before was accepted or not.
    ///
    /// # Errors
    /// There are too many steps already, or there will be.
    pub fn count(&self, t: f64) -> Result<(), Failure> {
        let used = self.used.get() + 1;
        self.used.set(used);
        let most = self.most;
        if used > most {
            return Err(self.failure(t, format!("more than {most} steps")));
        }
        let (since, from) = self.last.get();
        if used < since + WINDOW {
            return Ok(());
        }
        self.last.set((used, t));
        let left = self.duration - t;
        let foreseen = used as f64 + (used - since) as f64 * left / (t - from).max(f64::MIN_POSITIVE);
        let margin = if self.is_stiff.get() { 1.0 } else { MARGIN };
        let looks = if foreseen > margin * most as f64 { self.looks.get() + 1 } else { 0 };
        self.looks.set(looks);
        match looks < LOOKS {
            true => Ok(()),
            false => {
                let why =
                    format!("the last {WINDOW} steps took it {:.1e} s further, and {left} s are left: ", t - from);
                Err(self.failure(t, why + &format!("some {foreseen:.0e} steps, more than {most}")))
            }
        }
    }

    fn failure(&self, t: f64, why: String) -> Failure {
        let more = "or allow more: max_steps in [simulation], --max-steps";
        let slower = "a smaller duration, a greater tolerance, or a softer spring takes fewer";
        match (self.method, self.is_stiff.get()) {
            (Method::Adaptive, true) => {
                let why = why + "; stability holds its steps back, not the motion";
                Failure::new(t, why).with_help(&format!("choose method = \"stiff\" in [simulation], {more}"))
            }
            (Method::Adaptive, false) => Failure::new(t, why).with_help(&format!(
                "choose method = \"stiff\" in [simulation] if something is stiff, {more}; {slower}"
            )),
            (Method::Stiff, _) => Failure::new(t, why).with_help(&format!("{slower}, {more}")),
        }
    }
}
