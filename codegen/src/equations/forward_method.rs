//! Which form of forward dynamics a robot gets: the one with fewer operations, unless it loses digits that the other keeps.
//!
//! Articulated bodies and the factorisation of H solve the same equations, but H of a stretched or long chain is
//! ill-conditioned while the recursion is not: Ascher, Pai and Cloutier (1997) call it formulation stiffness. The condition
//! number says little (light wrists have a large one and lose nothing), so both programs are run, in the scalar that they
//! are generated for, against the same equations in double-double. Sines and all arithmetic are the same bits everywhere,
//! so the choice is, too.
//!
//! What is weighed is multiplications and additions one by one, also where they will be fused: the factorisation fuses more of them,
//! but its sums wait for each other. Measured on x86-64 with and without AVX-512, fused and not: quadrupeds (18 coordinates) take 4
//! to 25 % longer by a factorisation with 2 % fewer to 2 % more operations; arms of 6 and 7 joints 1 to 31 % less with 8 to 18 % fewer.

use crate::function::{ForwardDynamicsMethod, Function};
use crate::model::states::{settle, values, Kind, SEED};
use std::fmt;
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::{Dd, Real};
use straightline_graph::expr::{evaluate, Graph, Port, DIVISION};
use straightline_graph::pass::count_sums;
use straightline_graph::Scalar;

/// The factorisation may lose so many times what articulated bodies lose: about half a decimal digit, which is how far two
/// samples of the same quality come apart.
pub const TOLERATED: f64 = 3.0;
/// The same of each acceleration by itself, as a heavy link may hide what the light ones lose; or one rounding of it.
const TOLERATED_OF_ONE: f64 = 8.0;
/// The same of derivatives and each of their blocks, of which it takes about half of the operations: a decimal digit.
const TOLERATED_OF_DERIVATIVES: f64 = 16.0;
/// The factorisation has to save this part of the operations of articulated bodies.
pub const WORTH: f64 = 0.05;
/// Beyond so many velocity coordinates the factorisation is not tried: it takes about n³/6 products more on one branch.
pub const MOST_FOR_FACTORISATION: usize = 40;

/// States of each kind: anywhere in the limits, nearly stretched, near right angles.
const STATES: usize = 6;

/// A form of forward dynamics in figures.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct MethodFigures {
    /// Multiplications and additions.
    pub operations: usize,
    /// Divisions and square roots.
    pub divisions: usize,
    /// The worst error of the states that were tried, over the greatest acceleration of the state; `None`: not tried, as the robot
    /// has run-time parameters or too many joints.
    pub error: Option<f64>,
}

impl MethodFigures {
    fn new(graph: &Graph, error: Option<f64>) -> Self {
        let counts = count_sums(graph);
        MethodFigures { operations: counts.mul + counts.add, divisions: counts.div + counts.sqrt, error }
    }

    /// What it takes, in operations.
    fn cost(&self) -> f64 {
        (self.operations + DIVISION * self.divisions) as f64
    }
}

/// What was chosen, and why.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct MethodChoice {
    /// Whether articulated bodies were chosen.
    pub articulated_bodies: bool,
    /// The articulated bodies.
    pub articulated: MethodFigures,
    /// The factorisation of H; `None`: too large to be tried.
    pub factorisation: Option<MethodFigures>,
}

impl MethodChoice {
    /// What the chosen form takes, such that the least of several choices is wanted.
    pub(crate) fn weight(&self) -> f64 {
        match self.factorisation {
            Some(factorisation) if !self.articulated_bodies => factorisation.cost() / (1.0 - WORTH),
            _ => self.articulated.cost(),
        }
    }

    /// The method.
    pub fn method(&self) -> ForwardDynamicsMethod {
        match self.articulated_bodies {
            true => ForwardDynamicsMethod::ArticulatedBody,
            false => ForwardDynamicsMethod::Factorisation,
        }
    }
}

impl fmt::Display for MethodChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (chosen, other) = match self.articulated_bodies {
            true => ("articulated bodies", "the factorisation of H"),
            false => ("the factorisation of H", "articulated bodies"),
        };
        let Some(factorisation) = self.factorisation else {
            return write!(f, "By {chosen}: {other} is not tried on so many joints.");
        };
        let (mine, others) = match self.articulated_bodies {
            true => (self.articulated, factorisation),
            false => (factorisation, self.articulated),
        };
        let [mine_div, others_div] = [mine, others].map(|x| match x.divisions {
            0 => String::new(),
            1 => " and a division".to_string(),
            n => format!(" and {n} divisions"),
        });
        write!(
            f,
            "By {chosen}: {} multiplications and additions{mine_div} before the last passes, by {other} {}{others_div}",
            mine.operations, others.operations
        )?;
        match (mine.error, others.error) {
            (Some(a), Some(b)) => {
                write!(f, "; worst relative error of {} states {a:.1e}, by {other} {b:.1e}.", 3 * STATES)
            }
            _ => write!(f, "."),
        }
    }
}

/// Chooses between two programs of the same function; with the factorisation only where there is one.
pub fn choose(
    model: &Model<Dd>,
    function: Function,
    scalar: Scalar,
    articulated: &Graph,
    factorised: Option<&Graph>,
) -> MethodChoice {
    let Some(factorised) = factorised else {
        let articulated = MethodFigures::new(articulated, None);
        return MethodChoice { articulated_bodies: true, articulated, factorisation: None };
    };
    let is_derivative = function.spec().family.is_of_blocks();
    // entries of a matrix go together: an entry that happens to be small is nothing by itself
    let together: Vec<usize> = match is_derivative {
        true => articulated.outputs.iter().map(Port::len).collect(),
        false => vec![1; articulated.results.len()],
    };
    let errors = errors(model, scalar, (articulated, factorised), &together);
    let tolerated = match is_derivative {
        true => [TOLERATED_OF_DERIVATIVES; 2],
        false => [TOLERATED, TOLERATED_OF_ONE],
    };
    let keeps_digits = errors.as_ref().is_none_or(|[a, f]| f.keeps_digits_of(a, scalar, tolerated));
    let [of_articulated, of_factorised] = errors.map_or([None; 2], |errors| errors.map(|e| Some(e.worst)));
    let articulated = MethodFigures::new(articulated, of_articulated);
    let factorisation = MethodFigures::new(factorised, of_factorised);
    let cheaper = factorisation.cost() < (1.0 - WORTH) * articulated.cost();
    MethodChoice { articulated_bodies: !(cheaper && keeps_digits), articulated, factorisation: Some(factorisation) }
}

/// What a program loses at some states.
#[derive(Default)]
struct Errors {
    /// The worst error, over the greatest acceleration of its state.
    worst: f64,
    /// Of each acceleration, or block of derivatives, the worst error, as it is, and the greatest value.
    each: Vec<[f64; 2]>,
}

impl Errors {
    fn add<T: Real + Into<f64>>(&mut self, found: Vec<T>, exact: Vec<Dd>, together: &[usize]) {
        let scale = exact.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        self.each.resize(together.len(), [0.0; 2]);
        let group = together.iter().enumerate().flat_map(|(k, n)| std::iter::repeat_n(k, *n));
        for ((x, truth), k) in found.into_iter().zip(exact).zip(group) {
            let [worst, greatest] = &mut self.each[k];
            let error = (Dd::from(x.into()) - truth).to_f64().abs();
            // what is no number, is as wrong as can be
            let error = if error.is_finite() { error } else { f64::INFINITY };
            let relative = error / scale;
            self.worst = if relative.is_finite() { self.worst.max(relative) } else { f64::INFINITY };
            (*worst, *greatest) = (worst.max(error), greatest.max(truth.to_f64().abs()));
        }
    }

    fn keeps_digits_of(&self, other: &Errors, scalar: Scalar, [of_all, of_one]: [f64; 2]) -> bool {
        let keeps = |([f, greatest], [a, _]): (&[f64; 2], &[f64; 2])| *f <= of_one * a.max(scalar.epsilon() * greatest);
        self.worst <= of_all * other.worst && self.each.iter().zip(&other.each).all(keeps)
    }
}

/// What both programs lose; `None` where a run-time parameter is an input: there is no one robot to try.
fn errors(model: &Model<Dd>, scalar: Scalar, forms: (&Graph, &Graph), together: &[usize]) -> Option<[Errors; 2]> {
    let (articulated, factorised) = forms;
    if articulated.inputs.iter().chain(&factorised.inputs).any(|port| port.wrapper.is_some()) {
        return None;
    }
    Some(in_scalar!(scalar, T => errors_in::<T>(model, forms, together)))
}

fn errors_in<T: Real + Into<f64>>(
    model: &Model<Dd>,
    (articulated, factorised): (&Graph, &Graph),
    together: &[usize],
) -> [Errors; 2] {
    let mut errors = [Errors::default(), Errors::default()];
    let mut random = Random(SEED);
    let kinds = [Kind::Anywhere, Kind::Stretched, Kind::RightAngled];
    for kind in kinds.into_iter().cycle().take(3 * STATES) {
        // both were traced with the same ports
        let ports = &articulated.inputs;
        let mut inputs: Vec<Vec<f64>> = ports.iter().map(|port| values(model, port, kind, &mut random)).collect();
        settle(model, ports, &mut inputs, &mut random);
        let rounded: Vec<T> = inputs.into_iter().flatten().map(|x| T::constant(Dd::from(x))).collect();
        let wide: Vec<Dd> = rounded.iter().map(|x| Dd::from((*x).into())).collect();
        for (graph, errors) in [articulated, factorised].into_iter().zip(&mut errors) {
            errors.add(evaluate(graph, &rounded), evaluate(graph, &wide), together);
        }
    }
    errors
}
