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
pub(super) const FIRST_ORDER: f64 = 0.99;
/// Forces are off by so much of the greatest, to either side: by far more than rounding, by less than the forces.
pub(super) const OFF: [f64; 2] = [-1.0 / 1048576.0, 1.0 / 1024.0];
/// Accelerations and reactions are off in any direction by such parts of the greatest.
const ANYWHERE: [f64; 4] = [FAR, 1e-2, 1e-5, FAR];
/// From there on bounds are great: by this part a solution is far from what is found.
const FAR: f64 = 0.3;
/// The greatest bound of what is found is such a part of it at most, or so many ulps, where a format is short.
const SMALL: f64 = 1.0 / 1024.0;
const LOST: f64 = 1048576.0;
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
/// others; `system`: the equations that they are judged by.
///
/// # Errors
/// As [`of_bound`].
pub(crate) fn of_acceleration_bound(
    robot: &Robot,
    options: &Options,
    name: &str,
    (graph, bound): (&Graph, &Graph),
    system: &Graph,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    for _ in 0..STATES {
        let at = AccelerationBound::new((name, options.scalar), (graph, bound), states.next(&graph.inputs));
        // where a scene wants some accelerations alone there is nothing to ask about
        let is_whole = |p: &Port| at.exact.get(&p.name).is_some_and(|x| x.len() == p.len());
        let is_there = |p: &Port| at.state.contains_key(&p.name) || is_whole(p);
        if !bound.inputs.iter().all(is_there) {
            return Ok(());
        }
        let of_found = at.of_found(&mut states.random)?;
        let Some(columns) = at.of_forces()? else { continue };
        at.is_provable(system, &of_found, &columns)?;
        if let [port] = &graph.outputs[..] {
            let inverse: Vec<&[f64]> = columns.iter().map(|column| &column[&port.name][..]).collect();
            at.is_definite(of_found.get("smallest_eigenvalue").map(|x| x[0]), &inverse)?;
        }
    }
    Ok(())
}

/// A bound of accelerations and reactions, or of derivatives of accelerations, at a state.
pub(super) struct AccelerationBound<'a> {
    name: &'a str,
    pub graph: &'a Graph,
    bound: &'a Graph,
    scalar: Scalar,
    state: PortState,
    pub exact: PortState,
    /// In the function's own scalar.
    pub found: PortState,
}

/// By ports: what results change by per change of a force.
type Column = BTreeMap<String, Vec<f64>>;

impl<'a> AccelerationBound<'a> {
    /// At a state in its scalar.
    pub fn new(
        (name, scalar): (&'a str, Scalar),
        (graph, bound): (&'a Graph, &'a Graph),
        state: PortState,
    ) -> AccelerationBound<'a> {
        let state = short(state, scalar);
        let given = inputs(graph, &state);
        let exact = solution(graph, evaluate(graph, &given));
        let found = computed_at(graph, scalar, &as_f64(&given));
        let found = solution(graph, found.into_iter().map(Dd::from).collect());
        AccelerationBound { name, graph, bound, scalar, state, exact, found }
    }

    /// What it says of what is found: right, and far below what it says of solutions that are off in any direction, which is right, too.
    pub fn of_found(&self, random: &mut Random) -> Result<BTreeMap<String, Vec<f64>>, Disagreement> {
        let of_found = self.asked(&self.found)?;
        for part in ANYWHERE {
            let of_other = self.asked(&self.off_by(part, random))?;
            if part >= FAR {
                of_found.iter().try_for_each(|(port, bounds)| self.is_small((port, bounds), &of_other[port]))?;
            }
        }
        Ok(of_found)
    }

    /// What it says of a solution, which is right.
    pub fn asked(&self, solution: &PortState) -> Result<BTreeMap<String, Vec<f64>>, Disagreement> {
        let given = self.given(solution);
        let bounds = computed_at(self.bound, self.scalar, &as_f64(&inputs(self.bound, &given)));
        let bounds = by_port(&self.bound.outputs, bounds);
        for port in &self.graph.outputs {
            let Some((bounds, solution)) = self.of(&bounds, port).zip(given.get(&port.name)) else { continue };
            for (k, (most, (x, exact))) in bounds.iter().zip(solution.iter().zip(&self.exact[&port.name])).enumerate() {
                holds(self.name, (std::slice::from_ref(port), k), (*x - *exact).hi().abs(), *most)?;
            }
        }
        Ok(bounds)
    }

    /// The inputs of what judges a solution.
    pub fn given(&self, solution: &PortState) -> PortState {
        self.state.clone().into_iter().chain(short(solution.clone(), self.scalar)).collect()
    }

    pub fn of<'b>(&self, bounds: &'b BTreeMap<String, Vec<f64>>, port: &Port) -> Option<&'b Vec<f64>> {
        bounds.get(&format!("{}{OF_ERROR}", port.name))
    }

    /// Whether bounds of what is found are far below both what it is and what bounds it far from there: one that takes a wrong part for what
    /// is left of the equations is great where nothing is left, and too small where the two are nearly the same.
    fn is_small(&self, (port, bounds): (&String, &[f64]), of_other: &[f64]) -> Result<(), Disagreement> {
        let Some(found) = port.strip_suffix(OF_ERROR).and_then(|port| self.found.get(port)) else { return Ok(()) };
        let greatest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0, f64::max);
        let size = greatest(&mut found.iter().map(|x| x.hi().abs())).max(greatest(&mut of_other.iter().copied()));
        let part = greatest(&mut bounds.iter().copied()) / size;
        let most = (LOST * FloatFormat::of(self.scalar).u).max(SMALL);
        match part > most {
            true => Err(disagreement(self.name, format!("the size of `{port}`"), part / most)),
            false => Ok(()),
        }
    }

    /// What it says of solutions for other forces, and what accelerations and reactions change by with each: without contact the columns of
    /// the inverse mass matrix. None where no forces are given.
    fn of_forces(&self) -> Result<Option<Vec<Column>>, Disagreement> {
        let tau = Quantity::Force.name();
        let Some(forces) = self.state.get(&tau) else { return Ok(None) };
        let most = forces.iter().map(|x| x.hi().abs()).fold(f64::MIN_POSITIVE, f64::max);
        let mut columns = Vec::new();
        for i in 0..forces.len() {
            let mut column = Column::new();
            for off in OFF {
                let by = Dd::from(off * most);
                let mut other = self.state.clone();
                other.get_mut(&tau).expect("it is there")[i] += by;
                let other = solution(self.graph, evaluate(self.graph, &inputs(self.graph, &other)));
                self.asked(&other)?;
                let change = |(port, x): (String, Vec<Dd>)| {
                    let change = x.iter().zip(&self.exact[&port]).map(|(x, exact)| ((*x - *exact) / by).to_f64());
                    let change = change.collect();
                    (port, change)
                };
                column = other.into_iter().map(change).collect();
            }
            columns.push(column);
        }
        Ok(Some(columns))
    }

    /// Whether it is at least what can be proven: what the equations of motion at what is found may be off by, times the columns.
    fn is_provable(
        &self,
        system: &Graph,
        of_found: &BTreeMap<String, Vec<f64>>,
        columns: &[Column],
    ) -> Result<(), Disagreement> {
        // these equations come first
        let least = least_provable(system, self.scalar, &as_f64(&inputs(system, &self.given(&self.found))));
        for port in &self.graph.outputs {
            let Some(bounds) = self.of(of_found, port) else { continue };
            for (k, most) in bounds.iter().enumerate() {
                let least: f64 =
                    columns.iter().zip(&least).map(|(column, off)| column[&port.name][k].abs() * off).sum();
                holds(self.name, (std::slice::from_ref(port), k), FIRST_ORDER * least, *most)?;
            }
        }
        Ok(())
    }

    /// Whether the smallest eigenvalue of the mass matrix, which is known where its inverse is, is at least what it says.
    pub fn is_definite(&self, smallest: Option<f64>, inverse: &[&[f64]]) -> Result<(), Disagreement> {
        let is_square = inverse.iter().all(|column| column.len() == inverse.len());
        let Some(smallest) = smallest.filter(|_| is_square) else { return Ok(()) };
        let most = 1.0 / greatest_eigenvalue(inverse);
        match smallest > most {
            true => {
                let result = "the smallest eigenvalue of the mass matrix".to_string();
                Err(disagreement(self.name, result, smallest / most))
            }
            false => Ok(()),
        }
    }

    /// All numbers that are found off by up to a part of the greatest of their port, or of all where a port is zero.
    fn off_by(&self, part: f64, random: &mut Random) -> PortState {
        let greatest = |x: &[Dd]| x.iter().map(|x| x.hi().abs()).fold(0.0, f64::max);
        let of_all = self.found.values().map(|x| greatest(x)).fold(0.0, f64::max);
        let off = |x: &Vec<Dd>, random: &mut Random| {
            let own = greatest(x);
            let most = if own > 0.0 { own } else { of_all };
            x.iter().map(|x| *x + Dd::from(part * most * random.symmetric(1.0))).collect()
        };
        self.found.iter().map(|(name, x)| (name.clone(), off(x, random))).collect()
    }
}

/// Of a symmetric matrix, from below.
fn greatest_eigenvalue(columns: &[&[f64]]) -> f64 {
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
pub(super) fn holds(name: &str, (outputs, k): (&[Port], usize), off: f64, most: f64) -> Result<(), Disagreement> {
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

pub(super) fn as_f64(numbers: &[Dd]) -> Vec<f64> {
    numbers.iter().map(|x| x.to_f64()).collect()
}

/// The results of a program by the ports that they belong to.
pub(super) fn by_port<T>(ports: &[Port], results: Vec<T>) -> BTreeMap<String, Vec<T>> {
    let mut results = results.into_iter();
    ports.iter().map(|port| (port.name.clone(), results.by_ref().take(port.len()).collect())).collect()
}

fn solution(graph: &Graph, results: Vec<Dd>) -> PortState {
    by_port(&graph.outputs, results)
}

/// The least that can be proven of each result's error at these inputs without knowing how values happen to be rounded, to first order.
pub(super) fn least_provable(graph: &Graph, scalar: Scalar, given: &[f64]) -> Vec<f64> {
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
