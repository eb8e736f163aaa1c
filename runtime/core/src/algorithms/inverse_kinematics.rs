//! A step of inverse kinematics: damped least squares over the joints that are not at their limits, of all steps the one with the least kinetic energy.
//!
//! For rows J with errors e and weights W the step is
//!
//! ```text
//! δq = b + H⁻¹ Jᵀ W (W J H⁻¹ Jᵀ W + λ²)⁻¹ W (e − J b)
//! ```
//!
//! the least of ‖δq − b‖² in kinetic energy plus ‖W (e − J δq)‖²/λ² (Wampler 1986, with H in place of 1). b is where the motions that the task leaves free
//! shall go. Joints that this takes beyond their limits are put there, and what is left of the error is shared by the others: the same equations once more
//! with rows and columns of those joints held (saturation in the null space, Flacco, De Luca and Khatib 2012). Joints that go beyond now stop at the
//! limit. There is no branch: a joint is beyond by the sign of what it exceeds.
//!
//! The factor of H divides by what joints feel; the matrix of the task has no pivot below λ².

use super::factor::Ltdl;
use super::operational_space::TaskRows;
use crate::dd::Dd;
use crate::model::Model;
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;

/// Rows of a Jacobian that shall move by so much.
#[derive(Clone, Debug)]
pub struct WeightedTask<T> {
    /// J, by rows.
    pub jacobian: Vec<Vec<T>>,
    /// e \[m or rad\].
    pub error: Vec<T>,
    /// The diagonal of W.
    pub weight: Vec<T>,
}

/// How far a joint may go.
#[derive(Clone, Copy, Debug)]
pub struct StepLimits<T> {
    /// The least step, where there is one.
    pub lower: Option<T>,
    /// The greatest.
    pub upper: Option<T>,
}

/// What belongs to a coordinate that may be held: 1 where it is free, otherwise 0, and the step that it is held at.
#[derive(Clone, Copy)]
struct Held<T> {
    free: T,
    step: T,
}

impl<T: Real> StepLimits<T> {
    /// A step stopped at the limits, each end by a sign; ½ of each at the end itself, where both are the same.
    fn stop(&self, step: T) -> Held<T> {
        let half = T::constant(Dd::HALF);
        let beyond = |excess: T| (excess.sign() + T::one()) * half;
        let mut held = Held { free: T::one(), step: T::zero() };
        let ends = [self.upper.map(|upper| (step - upper, upper)), self.lower.map(|lower| (lower - step, lower))];
        for (excess, end) in ends.into_iter().flatten() {
            let is_beyond = beyond(excess);
            held = Held { free: held.free - is_beyond, step: held.step + is_beyond * end };
        }
        held
    }
}

/// δq \[rad or m\], nv numbers; for a floating base increments of its pose along its own axes. `mass_matrix` is H, nv × nv, `descent` b, `limits`
/// those of the step of each coordinate that has some.
///
/// Each joint with limits ends within them up to a rounding, wherever it was; a task that needs more is met as far as the others can.
#[doc(alias("damped least squares", "Levenberg-Marquardt", "saturation in the null space"))]
pub fn inverse_kinematics_step<T: Real>(
    model: &Model<T>,
    mass_matrix: &[T],
    task: &WeightedTask<T>,
    (descent, damping): (&[T], T),
    limits: &[Option<StepLimits<T>>],
) -> Vec<T> {
    T::section("step", None);
    let first = free_step(model, mass_matrix, task, (descent, damping));
    if limits.iter().all(Option::is_none) {
        return first;
    }
    T::section("limits", None);
    let moved = Held { free: T::one(), step: T::zero() };
    let held: Vec<Held<T>> =
        limits.iter().zip(&first).map(|(limits, step)| limits.map_or(moved, |l| l.stop(*step))).collect();
    let nv = descent.len();
    // rows and columns of held joints are those of 1
    let entry = |k: usize| {
        let (i, j) = (k / nv, k % nv);
        match (i == j, &limits[i]) {
            (true, None) => mass_matrix[k],
            (true, Some(_)) => held[i].free * mass_matrix[k] + (T::one() - held[i].free),
            (false, _) => held[i].free * held[j].free * mass_matrix[k],
        }
    };
    let mut reduced = vec![T::zero(); nv * nv];
    for (i, j) in (0..nv).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        (reduced[i * nv + j], reduced[j * nv + i]) = (entry(i * nv + j), entry(i * nv + j));
    }
    let base: Vec<T> = held.iter().zip(descent).map(|(held, b)| held.free * *b + held.step).collect();
    let rows = task.jacobian.iter().map(|row| row.iter().zip(&held).map(|(x, held)| *x * held.free).collect());
    let others = WeightedTask { jacobian: rows.collect(), error: left(task, &base), weight: task.weight.clone() };
    T::section("step of the others", None);
    let none = vec![T::zero(); nv];
    let more = free_step(model, &reduced, &others, (&none, damping));
    let stopped = |(k, (base, more)): (usize, (T, T))| {
        let step = base + more;
        limits[k].as_ref().map_or(step, |limits| {
            let Held { free, step: at_end } = limits.stop(step);
            free * step + at_end
        })
    };
    base.into_iter().zip(more).enumerate().map(stopped).collect()
}

/// e − J b.
fn left<T: Real>(task: &WeightedTask<T>, base: &[T]) -> Vec<T> {
    let rest = |(row, error): (&Vec<T>, &T)| row.iter().zip(base).fold(*error, |rest, (x, b)| rest - *x * *b);
    task.jacobian.iter().zip(&task.error).map(rest).collect()
}

/// The step without limits.
fn free_step<T: Real>(
    model: &Model<T>,
    mass_matrix: &[T],
    task: &WeightedTask<T>,
    (descent, damping): (&[T], T),
) -> Vec<T> {
    let factor = Ltdl::factor(model, mass_matrix);
    let weighted = task.jacobian.iter().zip(&task.weight).map(|(row, w)| row.iter().map(|x| *x * *w).collect());
    let rows = TaskRows::new(&factor, weighted.collect());
    let missing: Vec<T> = left(task, descent).into_iter().zip(&task.weight).map(|(e, w)| e * *w).collect();
    let motion = rows.motion_towards(&missing, damping);
    descent.iter().zip(motion).map(|(b, x)| *b + x).collect()
}
