//! Equations that derivatives of accelerations are judged by, and bounds that are made of them.

use super::bounds::{as_f64, by_port, holds, least_provable, AccelerationBound, FIRST_ORDER, OFF};
use super::{agreeing, compare, difference, inputs, of_ports, with_sizes, Disagreement, PortState, States, STATES};
use crate::equations::reduce::longest_lever;
use crate::equations::Robot;
use crate::function::{Forms, ForwardDynamicsMethod, Function};
use crate::options::Options;
use crate::program::columns::SolvedColumns;
use straightline_core::algorithms::Ltdl;
use straightline_core::magnitude::Magnitude;
use straightline_core::Dd;
use straightline_graph::certify::columns::ColumnSystem;
use straightline_graph::expr::{evaluate, Graph};

/// Whether what is left of the equations is what the plain equations leave.
///
/// # Errors
/// As [`of_function`](super::of_function).
pub(crate) fn of_column_system(
    robot: &Robot,
    options: &Options,
    (function, columns): (Function, &SolvedColumns),
    graph: &Graph,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    let ports = columns.ports(robot, function, options);
    let own = options.scene.ports(function, &robot.model, &[]).len();
    for _ in 0..STATES {
        let state = states.next(&ports);
        let given = of_ports(&ports, &state);
        let (given, of_results) = given.split_at(own);
        let mut bound = options.scene.bind(function, robot, given);
        with_sizes(&mut bound.model, longest_lever(&robot.model));
        let forms = Forms::plain(&bound.model, &[], ForwardDynamicsMethod::ArticulatedBody);
        let plain = columns.left(function, &forms, &bound, &of_results.concat());
        let found = evaluate(graph, &inputs(graph, &state));
        let off = found.into_iter().zip(plain).map(|(found, plain)| difference(found, plain.wide));
        let off: Vec<Magnitude> = off.collect();
        compare(&format!("{}_error_bound", function.name()), &graph.outputs, &off, agreeing(options))?;
    }
    Ok(())
}

/// Whether a program that bounds how far derivatives of accelerations are from the exact ones does so for those that `graph` finds, and for others.
///
/// # Errors
/// As [`of_bound`](super::of_bound).
pub(crate) fn of_column_bound(
    robot: &Robot,
    options: &Options,
    name: &str,
    (graph, bound): (&Graph, &Graph),
    system: &ColumnSystem,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    let nv = robot.model.nv();
    for _ in 0..STATES {
        let state = states.next(&graph.inputs);
        let at = AccelerationBound::new((name, options.scalar), (graph, bound), state);
        let of_found = at.of_found(&mut states.random)?;
        // what the equations may be off by, times the inverse of H
        let given = inputs(&system.graph, &at.given(&at.found));
        let least = least_provable(&system.graph, options.scalar, &as_f64(&given));
        let all = evaluate(&system.graph, &given);
        let factor = Ltdl::factor(&robot.model, &all[all.len() - nv * nv..]);
        let unit = |k: usize| (0..nv).map(|i| if i == k { Dd::ONE } else { Dd::ZERO }).collect::<Vec<Dd>>();
        let inverse: Vec<Vec<Dd>> = (0..nv).map(|k| factor.solve(&unit(k))).collect();
        for (equation, off) in (0..nv).flat_map(|k| OFF.map(|off| (k, off))) {
            for is_own in [true, false] {
                let is_asked = |k: usize| (system.finds_accelerations && k == 0) == is_own;
                let columns = (0..system.columns.len()).filter(|k| is_asked(*k));
                at.asked(&one_equation_off(&at, system, columns, (&inverse, equation, off)))?;
            }
        }
        let inverse: Vec<Vec<f64>> = inverse.iter().map(|row| as_f64(row)).collect();
        let bounds: Vec<f64> =
            graph.outputs.iter().flat_map(|port| at.of(&of_found, port).cloned()).flatten().collect();
        for column in &system.columns {
            for (row, k) in inverse.iter().zip(column) {
                let least: f64 = row.iter().zip(column).map(|(x, k)| x.abs() * least[*k]).sum();
                holds(name, (&graph.outputs, *k), FIRST_ORDER * least, bounds[*k])?;
            }
        }
        let inverse: Vec<&[f64]> = inverse.iter().map(|row| &row[..]).collect();
        at.is_definite(of_found.get("smallest_eigenvalue").map(|x| x[0]), &inverse)?;
    }
    Ok(())
}

/// The exact results with one equation of each of these columns off, by what moves the column by such a part of itself: what bounds it is hardly
/// greater than what it is off by.
fn one_equation_off(
    at: &AccelerationBound<'_>,
    system: &ColumnSystem,
    columns: impl Iterator<Item = usize>,
    (inverse, equation, off): (&[Vec<Dd>], usize, f64),
) -> PortState {
    let ports = &at.graph.outputs;
    let mut all: Vec<Dd> = ports.iter().flat_map(|port| at.exact[&port.name].iter().copied()).collect();
    let greatest = |x: &mut dyn Iterator<Item = Dd>| x.map(|x| x.hi().abs()).fold(0.0, f64::max);
    let of_all = greatest(&mut all.iter().copied());
    for k in columns {
        let (column, moved) = (&system.columns[k], &inverse[(equation + k) % inverse.len()]);
        let own = greatest(&mut column.iter().map(|k| all[*k]));
        let size = if own > 0.0 { own } else { of_all };
        let by = Dd::from(off * size / greatest(&mut moved.iter().copied()));
        column.iter().zip(moved).for_each(|(k, x)| all[*k] += *x * by);
    }
    by_port(ports, all)
}
