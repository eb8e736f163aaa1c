//! Steps of time under held generalized forces, and their derivatives: discrete dynamics x⁺ = f(x, τ) of x = (q, q̇), ready for optimal control.
//!
//! * Euler's semi-implicit method: q̇⁺ = q̇ + h q̈(q, q̇, τ), q⁺ = q ⊕ h q̇⁺.
//! * The classical method of Runge and Kutta in coordinates of the tangent at q: of u̇ = J_r⁻¹(u) q̇, d/dt q̇ = q̈(q ⊕ u, q̇, τ) from u = 0, with
//!   q⁺ = q ⊕ u⁺ (Munthe-Kaas 1998). Of J_r⁻¹ = 1 + ½ ad + 1/12 ad² − 1/720 ad⁴ … the terms up to the square are taken, which
//!   order four needs: u is of the order of h. Where coordinates are sums of their rates that is 1, and the method the usual one.

use super::solution::Solution;
use super::spec::Extent::{Positions, State, Velocities};
use super::spec::{Divisor, Form, Judged, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::{Dd, Real};

/// What all of them have in common.
const STEP: Spec = Spec {
    inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Force, Quantity::TimeStep],
    solves: true,
    divisor: Divisor::Inertia,
    judged: Judged::ByDerivatives,
    ..Spec::DERIVED
};

const NEXT: [Output; 2] = [
    Output::new("q_next", &[Positions], "configuration after the step \\[rad or m\\]"),
    Output::new("qd_next", &[Velocities], "velocities after the step \\[rad/s or m/s\\]"),
];
const BY_STATE: Output = Output::new(
    "a",
    &[State, State],
    "rows of A = ∂(q, q̇)⁺/∂(q, q̇) at constant τ: increments of q, of a floating base of its pose in its own axes before and after the step, then q̇",
);
const BY_FORCE: Output = Output::new("b", &[State, Velocities], "rows of B = ∂(q, q̇)⁺/∂τ, in the same order");

pub struct SemiImplicitStep;

impl RobotFunction for SemiImplicitStep {
    const SPEC: Spec = Spec {
        name: "semi_implicit_step",
        summary: "A step of time by Euler's semi-implicit method: q̇⁺ = q̇ + h q̈, q⁺ = q ⊕ h q̇⁺.",
        aliases: &["symplectic Euler", "forward step", "discrete dynamics"],
        outputs: &NEXT,
        form: Form::Motion,
        ..STEP
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (_, qdd) = Solution::with_acceleration(forms, inputs);
        euler(forms, inputs, &qdd)
    }
}

pub struct RungeKuttaStep;

impl RobotFunction for RungeKuttaStep {
    const SPEC: Spec = Spec {
        name: "runge_kutta_step",
        summary: "A step of time by the classical method of Runge and Kutta, in coordinates of the tangent.",
        aliases: &["RK4", "Runge-Kutta-Munthe-Kaas", "discrete dynamics"],
        outputs: &NEXT,
        form: Form::Motion,
        substituted_up_to: 0,
        ..STEP
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (q, qd, length) = (&inputs[0], &inputs[1], inputs[3][0]);
        let mut slopes: Vec<[Vec<T>; 2]> = Vec::new();
        for part in parts(length) {
            let before = slopes.last();
            let u = before.map(|k| scaled(&k[0], part));
            let rates = before.map_or_else(|| qd.clone(), |k| sum(qd, &scaled(&k[1], part)));
            let at = u.as_ref().map_or_else(|| q.clone(), |u| alg::integrate(forms.model, q, u));
            let by_u = u.map_or_else(|| rates.clone(), |u| alg::displacement_rate(forms.model, &u, &rates));
            let state = [at, rates, inputs[2].clone()];
            slopes.push([by_u, Solution::with_acceleration(forms, &state).1]);
        }
        let u = mean(&slopes, 0, length);
        [alg::integrate(forms.model, q, &u), sum(qd, &mean(&slopes, 1, length))].concat()
    }
}

pub struct StepDerivatives;

impl RobotFunction for StepDerivatives {
    const SPEC: Spec = Spec {
        name: "step_derivatives",
        summary: "A step of time by Euler's semi-implicit method, with its derivatives A by the state and B by τ.",
        aliases: &["discrete linearisation", "transition matrix", "symplectic Euler", "mjd_transitionFD"],
        outputs: &[NEXT[0], NEXT[1], BY_STATE, BY_FORCE],
        ..STEP
    };

    /// Of q̇⁺: h ∂q̈/∂q, 1 + h ∂q̈/∂q̇ and h H⁻¹. q⁺ moves with q by Ad(exp(−h q̇⁺)), with h q̇⁺ by J_r(h q̇⁺).
    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (nv, length) = (inputs[1].len(), inputs[3][0]);
        let (solution, qdd) = Solution::with_acceleration(forms, inputs);
        let next = euler(forms, inputs, &qdd);
        let slopes = solution.derivatives([&inputs[0], &inputs[1], &qdd], None);
        let mut by_all =
            side_by_side(slopes.chunks((nv * nv).max(1)), nv).into_iter().map(|x| x * length).collect::<Vec<T>>();
        add_unit(&mut by_all, nv, 1);
        let displaced = scaled(&by_all, length);
        let carried = carried(forms, &scaled(&next[inputs[0].len()..], length), &displaced, nv);
        [next, blocks(&carried, &by_all, nv)].concat()
    }
}

pub struct StepDerivativesRk4;

impl RobotFunction for StepDerivativesRk4 {
    const SPEC: Spec = Spec {
        name: "step_derivatives_rk4",
        summary: "A step of time by the classical method of Runge and Kutta, in coordinates of the tangent, with its derivatives A by the state and B by τ.",
        aliases: &["RK4", "discrete linearisation", "transition matrix", "Runge-Kutta-Munthe-Kaas"],
        outputs: &[NEXT[0], NEXT[1], BY_STATE, BY_FORCE],
        substituted_up_to: 0,
        ..STEP
    };

    /// By the chain rule, stage by stage. Matrices have a column per increment of q, of q̇ and of τ.
    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (model, q, qd, length) = (forms.model, &inputs[0], &inputs[1], inputs[3][0]);
        let nv = qd.len();
        let none = vec![T::zero(); 3 * nv * nv];
        let unit = |block: usize| {
            let mut unit = none.clone();
            add_unit(&mut unit, nv, block);
            unit
        };
        // slopes of u and of q̇, and how they move
        let (mut slopes, mut moves) = (Vec::<[Vec<T>; 2]>::new(), Vec::<[Vec<T>; 2]>::new());
        for part in parts(length) {
            let before = slopes.last().zip(moves.last());
            let rates = before.map_or_else(|| qd.clone(), |(k, _)| sum(qd, &scaled(&k[1], part)));
            let by_rates = before.map_or_else(|| unit(1), |(_, m)| sum(&unit(1), &scaled(&m[1], part)));
            let u = before.map(|(k, m)| (scaled(&k[0], part), scaled(&m[0], part)));
            let (at, by_q, slope, move_u) = match &u {
                None => (q.clone(), unit(0), rates.clone(), by_rates.clone()),
                Some((u, by_u)) => {
                    let [of_rates, of_u] = alg::displacement_rate_maps(model, u, &rates);
                    let move_u = sum(&of_rates.times(&by_rates, 3 * nv), &of_u.times(by_u, 3 * nv));
                    let by_q = carried(forms, u, by_u, nv);
                    (alg::integrate(model, q, u), by_q, of_rates.times(&rates, 1), move_u)
                }
            };
            let state = [at, rates, inputs[2].clone()];
            let (solution, qdd) = Solution::with_acceleration(forms, &state);
            let of_acceleration = solution.derivatives([&state[0], &state[1], &qdd], None);
            let by_force = unit(2);
            let parts = of_acceleration.chunks((nv * nv).max(1)).zip([&by_q, &by_rates, &by_force]);
            let moved = parts.map(|(matrix, by)| product(matrix, by, nv)).reduce(|a, b| sum(&a, &b));
            slopes.push([slope, qdd]);
            moves.push([move_u, moved.expect("three products")]);
        }
        let u = mean(&slopes, 0, length);
        let next = [alg::integrate(model, q, &u), sum(qd, &mean(&slopes, 1, length))].concat();
        let by_rates = sum(&unit(1), &mean(&moves, 1, length));
        let carried = carried(forms, &u, &mean(&moves, 0, length), nv);
        [next, blocks(&carried, &by_rates, nv)].concat()
    }
}

/// q ⊕ h q̇⁺ and q̇⁺ = q̇ + h q̈.
fn euler<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>], qdd: &[T]) -> Vec<T> {
    let length = inputs[3][0];
    let rates = sum(&inputs[1], &scaled(qdd, length));
    [alg::integrate(forms.model, &inputs[0], &scaled(&rates, length)), rates].concat()
}

/// How far from the state each of the four slopes is taken, along the one before: the first at the state itself.
fn parts<T: Real>(length: T) -> [T; 4] {
    let half = length * T::constant(Dd::HALF);
    [T::zero(), half, half, length]
}

/// h/6 (k₁ + 2 k₂ + 2 k₃ + k₄).
fn mean<T: Real>(slopes: &[[Vec<T>; 2]], of: usize, length: T) -> Vec<T> {
    let sixth = length * T::constant(Dd::ONE / Dd::from(6.0));
    let k = |stage: usize, i: usize| slopes[stage][of][i];
    let entry = |i: usize| {
        let middle = k(1, i) + k(2, i);
        sixth * ((k(0, i) + k(3, i)) + (middle + middle))
    };
    (0..slopes[0][of].len()).map(entry).collect()
}

/// How q ⊕ u moves with the increments of the columns, where u moves like this: Ad(exp(−u)) on q itself and J_r(u).
fn carried<T: Real>(forms: &Forms<'_, T>, u: &[T], by_u: &[T], nv: usize) -> Vec<T> {
    let [of_q, of_u] = alg::integrate_maps(forms.model, u);
    let mut all = of_u.times(by_u, 3 * nv);
    for (row, own) in all.chunks_mut((3 * nv).max(1)).zip(of_q.matrix(nv).chunks(nv.max(1))) {
        row.iter_mut().zip(own).for_each(|(x, own)| *x = *x + *own);
    }
    all
}

/// A and B by rows, from the rows of q and of q̇.
fn blocks<T: Real>(by_q: &[T], by_rates: &[T], nv: usize) -> Vec<T> {
    let rows = || [by_q, by_rates].into_iter().flat_map(move |rows| rows.chunks((3 * nv).max(1)));
    let by_state = rows().flat_map(|row| &row[..2 * nv]);
    by_state.chain(rows().flat_map(|row| &row[2 * nv..])).copied().collect()
}

/// Square matrices beside each other, by rows.
fn side_by_side<'a, T: Real + 'a>(matrices: impl Iterator<Item = &'a [T]>, nv: usize) -> Vec<T> {
    let all: Vec<&[T]> = matrices.collect();
    (0..nv).flat_map(|i| all.iter().flat_map(move |matrix| &matrix[i * nv..(i + 1) * nv])).copied().collect()
}

/// Adds the unit matrix to one of three square matrices beside each other.
fn add_unit<T: Real>(matrix: &mut [T], nv: usize, block: usize) {
    for i in 0..nv {
        let entry = &mut matrix[i * 3 * nv + block * nv + i];
        *entry = *entry + T::one();
    }
}

/// A square matrix times one of 3 nv columns.
fn product<T: Real>(matrix: &[T], by: &[T], nv: usize) -> Vec<T> {
    let entry = |i: usize, k: usize| {
        (1..nv).fold(matrix[i * nv] * by[k], |sum, j| sum + matrix[i * nv + j] * by[j * 3 * nv + k])
    };
    (0..nv).flat_map(|i| (0..3 * nv).map(move |k| (i, k))).map(|(i, k)| entry(i, k)).collect()
}

pub(super) fn sum<T: Real>(a: &[T], b: &[T]) -> Vec<T> {
    a.iter().zip(b).map(|(a, b)| *a + *b).collect()
}

fn scaled<T: Real>(x: &[T], k: T) -> Vec<T> {
    x.iter().map(|x| *x * k).collect()
}
