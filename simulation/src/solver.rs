//! The integration of one smooth piece by the ODE library: the choice of its method, room for the state, tolerances, failures.

use crate::simulate::{Failure, Method, Settings};
use differential_equations::prelude::*;
use differential_equations::traits::State;

/// Steps of one piece, at most.
const MOST_STEPS: usize = 10_000_000;
/// States that the implicit method has room for.
const MOST_STATES: usize = 128;
/// What stands for a rate that is no number: so great that the step is rejected. The library takes the error of a step as small
/// where it is no number.
const BEYOND: f64 = 1e100;

/// A system of first order.
pub(crate) trait Equations {
    /// Number of states.
    fn states(&self) -> usize;

    /// The rates of all states.
    fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]);
}

/// What looks on between steps, whatever holds the state; the states of [`Equations`] are the first of its components.
pub(crate) trait Watch:
    Solout<f64, Vec<f64>>
    + Solout<f64, [f64; 16]>
    + Solout<f64, [f64; 32]>
    + Solout<f64, [f64; 64]>
    + Solout<f64, [f64; MOST_STATES]>
{
}

impl<W> Watch for W where
    W: Solout<f64, Vec<f64>>
        + Solout<f64, [f64; 16]>
        + Solout<f64, [f64; 32]>
        + Solout<f64, [f64; 64]>
        + Solout<f64, [f64; MOST_STATES]>
{
}

/// What a piece of the integration gave.
pub(crate) struct Solved {
    /// Times of the states that the watch kept.
    pub t: Vec<f64>,
    /// Those states.
    pub y: Vec<Vec<f64>>,
    /// Whether the watch ended it.
    pub interrupted: bool,
    /// Accepted steps.
    pub accepted: usize,
    /// Evaluations of the equations.
    pub evaluations: usize,
}

impl Solved {
    /// From what the library gives, of which the first `states` components count.
    fn of<Y: State<f64> + AsRef<[f64]>>(solution: &Solution<f64, Y>, states: usize) -> Solved {
        Solved {
            interrupted: matches!(solution.status, Status::Interrupted),
            accepted: solution.steps.accepted,
            evaluations: solution.evals.function,
            t: solution.t.clone(),
            y: solution.y.iter().map(|y| y.as_ref()[..states].to_vec()).collect(),
        }
    }
}

/// Integrates from a state over a time without corners.
///
/// # Errors
/// The method found no way on, or has no room for so many states.
pub(crate) fn solve<E: Equations, W: Watch>(
    equations: &E,
    watch: W,
    (start, end): (f64, f64),
    state: &[f64],
    settings: &Settings,
) -> Result<Solved, Failure> {
    let tolerances = vec![settings.tolerance; MOST_STATES.max(state.len())];
    let equations = Within(equations);
    // interpolation between steps is not under error control: steps are no longer than rows are apart
    macro_rules! solved {
        ($method:expr, $state:expr) => {{
            // one tolerance per component: the implicit method adapts a common one once for each of them
            let method = $method.rtol(tolerances.clone()).atol(tolerances);
            let method = method.h_max(settings.interval).max_steps(MOST_STEPS);
            let solution = IVP::ode(&equations, start, end, $state).solout(watch).method(method).solve();
            solution.map(|s| Solved::of(&s, state.len())).map_err(|error| failure(error, start))
        }};
    }
    macro_rules! implicit {
        ($room:expr) => {{
            let mut padded = [0.0; $room];
            padded[..state.len()].copy_from_slice(state);
            solved!(ImplicitRungeKutta::radau5().max_rejects(MOST_STEPS), padded)
        }};
    }
    match (settings.method, state.len()) {
        (Method::Adaptive, _) => solved!(ExplicitRungeKutta::dop853(), state.to_vec()),
        (Method::Stiff, ..=16) => implicit!(16),
        (Method::Stiff, ..=32) => implicit!(32),
        (Method::Stiff, ..=64) => implicit!(64),
        (Method::Stiff, ..=MOST_STATES) => implicit!(MOST_STATES),
        (Method::Stiff, n) => {
            let why = format!("{n} states are more than the {MOST_STATES} that the method `stiff` takes");
            Err(Failure { time: start, why })
        }
    }
}

/// Equations as the library takes them.
struct Within<'a, E>(&'a E);

impl<E: Equations> Within<'_, E> {
    fn rate(&self, t: f64, y: &[f64], rate: &mut [f64]) {
        self.0.rate(t, y, rate);
        rate.iter_mut().filter(|x| !x.is_finite()).for_each(|x| *x = BEYOND);
    }
}

impl<E: Equations> ODE<f64, Vec<f64>> for Within<'_, E> {
    fn diff(&self, t: f64, y: &Vec<f64>, dydt: &mut Vec<f64>) {
        self.rate(t, y, dydt);
    }
}

/// With room for N states, of which the first are used: the implicit method takes no state of a size that is known at run time
/// only.
impl<E: Equations, const N: usize> ODE<f64, [f64; N]> for Within<'_, E> {
    fn diff(&self, t: f64, y: &[f64; N], dydt: &mut [f64; N]) {
        let n = self.0.states();
        dydt[n..].fill(0.0);
        self.rate(t, &y[..n], &mut dydt[..n]);
    }
}

/// What the solver says of a piece that began at `start` \[s\].
fn failure<Y: State<f64>>(error: Error<f64, Y>, start: f64) -> Failure {
    let (time, why) = match error {
        Error::MaxSteps { t, .. } => (t, format!("more than {MOST_STEPS} steps")),
        Error::StepSize { t, .. } => (t, "steps become too small: the motion is not smooth there".to_string()),
        Error::Stiffness { t, .. } => (t, "the equations are stiff: choose the method `stiff`".to_string()),
        Error::LinearAlgebra { t, msg, .. } => (t, msg),
        Error::BadInput { msg } => (start, msg),
        other => (start, format!("{other:?}")),
    };
    Failure { time, why }
}
