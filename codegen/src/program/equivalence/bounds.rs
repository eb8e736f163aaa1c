//! Whether programs that bound another program's errors at a state do: at random states, in the format that they are made for.
//!
//! Errors that a program happens to make are mostly far below what can be proven, so they alone would miss a bound that is too small. What can
//! be proven is Σ |∂y/∂v| u |v| at least, over all values v that are rounded, to first order: adjoints of the program give that without
//! any of the bound's own rules. A bound of accelerations is asked about accelerations that are off by a known amount, too: those of
//! other forces, one after the other, where it is hardly greater than what they are off by, and any others.

use super::{inputs, Disagreement, PortState, States, STATES};
use crate::equations::Robot;
use crate::function::Quantity;
use crate::options::Options;
use std::collections::BTreeMap;
use straightline_core::random::Random;
use straightline_core::Dd;
use straightline_graph::certify::companion::OF_ERROR;
use straightline_graph::certify::search::computed_at;
use straightline_graph::certify::FloatFormat;
use straightline_graph::expr::{evaluate, Graph, NodeId, Op, Port};
use straightline_graph::rounding::backwards;
use straightline_graph::{element_of, Scalar};

/// What is known of a bound to first order it may fall below by so much.
const FIRST_ORDER: f64 = 0.99;
/// Forces are off by so much of the greatest: by far more than rounding, by less than the forces.
const OFF: f64 = 1.0 / 1024.0;
/// Accelerations and reactions are off in any direction by such parts of the greatest.
const ANYWHERE: [f64; 4] = [0.3, 1e-2, 1e-5, 0.3];
/// So many steps towards the smallest eigenvalue: every step gives an upper bound of it.
const STEPS: usize = 20;

/// Whether a program that bounds another's errors bounds those that it makes, and those that it may make.
///
/// # Errors
/// An error that is greater than its bound.
pub(crate) fn of_bound(
    robot: &Robot,
    options: &Options,
    name: &str,
    (graph, bound): (&Graph, &Graph),
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    for _ in 0..STATES {
        let state = short(states.next(&graph.inputs), options.scalar);
        let given = as_f64(&inputs(graph, &state));
        let (found, exact) = (computed_at(graph, options.scalar, &given), evaluate(graph, &inputs(graph, &state)));
        let bounds = computed_at(bound, graph.widest(options.scalar), &as_f64(&inputs(bound, &state)));
        let least = least_provable(graph, options.scalar, &given);
        for k in 0..found.len() {
            let off = (Dd::from(found[k]) - exact[k]).hi().abs();
            holds(name, (&graph.outputs, k), off.max(FIRST_ORDER * least[k]), bounds[k])?;
        }
    }
    Ok(())
}

/// Whether a program that bounds how far accelerations and reactions are from the exact ones does so for those that `graph` finds, and for
/// others; `system`, of a robot without contacts: the equations that they are judged by.
///
/// # Errors
/// As [`of_bound`].
pub(crate) fn of_acceleration_bound(
    robot: &Robot,
    options: &Options,
    name: &str,
    (graph, bound): (&Graph, &Graph),
    system: Option<&Graph>,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    for _ in 0..STATES {
        let state = short(states.next(&graph.inputs), options.scalar);
        let exact = solution(graph, evaluate(graph, &inputs(graph, &state)));
        // where a scene wants some accelerations alone there is nothing to ask about
        let is_there = |p: &Port| state.contains_key(&p.name) || exact.get(&p.name).is_some_and(|x| x.len() == p.len());
        if !bound.inputs.iter().all(is_there) {
            return Ok(());
        }
        let found = computed_at(graph, options.scalar, &as_f64(&inputs(graph, &state)));
        let found = solution(graph, found.into_iter().map(Dd::from).collect());
        let asked = |solution: &PortState| {
            let solution = short(solution.clone(), options.scalar);
            let given: PortState = state.iter().chain(&solution).map(|(n, x)| (n.clone(), x.clone())).collect();
            let bounds = computed_at(bound, options.scalar, &as_f64(&inputs(bound, &given)));
            let bounds = by_port(&bound.outputs, bounds);
            for port in &graph.outputs {
                let (Some(bounds), Some(solution)) =
                    (bounds.get(&format!("{}{OF_ERROR}", port.name)), solution.get(&port.name))
                else {
                    continue;
                };
                for (k, (most, (x, exact))) in bounds.iter().zip(solution.iter().zip(&exact[&port.name])).enumerate() {
                    holds(name, (std::slice::from_ref(port), k), (*x - *exact).hi().abs(), *most)?;
                }
            }
            Ok(bounds)
        };
        let of_found = asked(&found)?;
        for part in ANYWHERE {
            asked(&off_by(part, &found, &mut states.random))?;
        }
        // what forces would have to be off by for accelerations to be off by so much: columns of the inverse mass matrix
        let tau = Quantity::Force.name();
        let Some(forces) = state.get(&tau) else { continue };
        let by = Dd::from(OFF * forces.iter().map(|x| x.hi().abs()).fold(f64::MIN_POSITIVE, f64::max));
        let mut columns = Vec::new();
        for i in 0..forces.len() {
            let mut other = state.clone();
            other.get_mut(&tau).expect("it is there")[i] += by;
            let other = solution(graph, evaluate(graph, &inputs(graph, &other)));
            asked(&other)?;
            let qdd = Quantity::Acceleration.name();
            let column = other.get(&qdd).zip(exact.get(&qdd));
            columns.push(column.map_or(Vec::new(), |(x, y)| {
                x.iter().zip(y).map(|(x, y)| ((*x - *y) / by).to_f64()).collect::<Vec<f64>>()
            }));
        }
        let is_square = columns.iter().all(|c| c.len() == forces.len());
        let Some(system) = system.filter(|_| is_square) else { continue };
        let short_found = short(found, options.scalar);
        let given: PortState = state.iter().chain(&short_found).map(|(n, x)| (n.clone(), x.clone())).collect();
        let least = least_provable(system, options.scalar, &as_f64(&inputs(system, &given)));
        let most = &of_found[&format!("qdd{OF_ERROR}")];
        for (k, most) in most.iter().enumerate() {
            // |H⁻¹| times what the residual may be off by
            let least: f64 = columns.iter().zip(&least).map(|(column, off)| column[k].abs() * off).sum();
            holds(name, (&graph.outputs, k), FIRST_ORDER * least, *most)?;
        }
        if let Some(smallest) = of_found.get("smallest_eigenvalue").map(|x| x[0]) {
            let most = 1.0 / greatest_eigenvalue(&columns);
            if smallest > most {
                let result = "the smallest eigenvalue of the mass matrix".to_string();
                return Err(disagreement(name, result, smallest / most));
            }
        }
    }
    Ok(())
}

/// All numbers off by up to a part of the greatest of their port.
fn off_by(part: f64, solution: &PortState, random: &mut Random) -> PortState {
    let off = |x: &Vec<Dd>, random: &mut Random| {
        let most = x.iter().map(|x| x.hi().abs()).fold(0.0, f64::max);
        x.iter().map(|x| *x + Dd::from(part * most * random.symmetric(1.0))).collect()
    };
    solution.iter().map(|(name, x)| (name.clone(), off(x, random))).collect()
}

/// Of a symmetric matrix, from below.
fn greatest_eigenvalue(columns: &[Vec<f64>]) -> f64 {
    let mut x = vec![1.0; columns.len()];
    let mut quotient = 0.0;
    for _ in 0..STEPS {
        let mut y = vec![0.0; x.len()];
        for (column, x) in columns.iter().zip(&x) {
            column.iter().zip(&mut y).for_each(|(c, y)| *y += c * x);
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        quotient = dot(&x, &y) / dot(&x, &x);
        let size = straightline_core::trig::sqrt_f64(dot(&y, &y));
        x = y.into_iter().map(|y| y / size).collect();
    }
    quotient
}

/// An error of a result against its bound; a bound that is no number promises nothing.
fn holds(name: &str, (outputs, k): (&[Port], usize), off: f64, most: f64) -> Result<(), Disagreement> {
    match off > most {
        true => Err(disagreement(name, format!("the error of {}", element_of(outputs, k)), off / most)),
        false => Ok(()),
    }
}

fn disagreement(name: &str, result: String, difference: f64) -> Disagreement {
    Disagreement { program: format!("{name}_error_bound"), result, difference, plain: None }
}

fn short(state: PortState, scalar: Scalar) -> PortState {
    let number = |x: Dd| Dd::from(scalar.nearest(x));
    state.into_iter().map(|(n, x)| (n, x.into_iter().map(number).collect())).collect()
}

fn as_f64(numbers: &[Dd]) -> Vec<f64> {
    numbers.iter().map(|x| x.to_f64()).collect()
}

/// The results of a program by the ports that they belong to.
fn by_port<T>(ports: &[Port], results: Vec<T>) -> BTreeMap<String, Vec<T>> {
    let mut results = results.into_iter();
    ports.iter().map(|port| (port.name.clone(), results.by_ref().take(port.len()).collect())).collect()
}

fn solution(graph: &Graph, results: Vec<Dd>) -> PortState {
    by_port(&graph.outputs, results)
}

/// The least that can be proven of each result's error at these inputs without knowing how values happen to be rounded, to first order.
fn least_provable(graph: &Graph, scalar: Scalar, given: &[f64]) -> Vec<f64> {
    let is_number = |id: &NodeId| !matches!(graph.op(*id), Op::SinCos(_) | Op::AngleSum(..));
    let numbers: Vec<NodeId> = graph.ids().filter(is_number).collect();
    let mut values = vec![0.0; graph.ops.len()];
    let computed = computed_at(&Graph { results: numbers.clone(), ..graph.clone() }, scalar, given);
    numbers.iter().zip(computed).for_each(|(id, x)| values[id.index()] = x);
    let format = FloatFormat::of(scalar);
    let own: Vec<f64> = graph
        .ids()
        .map(|id| {
            let of_width = FloatFormat::of(graph.precision(id, scalar).held);
            match graph.op(id) {
                Op::Constant(c) => of_width.constant(c.value()).1,
                // half an ulp, whatever the kernel
                Op::Sin(_) | Op::Cos(_) => 0.5 * format.u * values[id.index()].abs(),
                op if op.row().is_some_and(|row| !row.is_exact) => of_width.u * values[id.index()].abs(),
                _ => 0.0,
            }
        })
        .collect();
    graph.results.iter().map(|result| swept(graph, *result, &values, &own)).collect()
}

/// Σ |adjoint| · own error. What angles are off by is counted with the robot's numbers alone: leaving it out asks for less.
fn swept(graph: &Graph, result: NodeId, values: &[f64], own: &[f64]) -> f64 {
    let mut adjoints = vec![0.0; result.index() + 1];
    adjoints[result.index()] = 1.0;
    let mut sum = 0.0;
    backwards(graph, values, &mut adjoints, |i, adjoint| sum += adjoint.abs() * own[i]);
    sum
}
