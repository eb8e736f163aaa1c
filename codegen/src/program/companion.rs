//! Programs that bound rounding errors at the state at hand.

use crate::equations::Robot;
use crate::function::{ContactFunction, Function, Judged};
use crate::options::Options;
use crate::program::columns::SolvedColumns;
use crate::program::contact::{checked_system, Mode};
use crate::program::equivalence::{self, Disagreement, Plainer};
use crate::program::passed;
use straightline_graph::certify::columns::column_bound;
use straightline_graph::certify::companion::{state_bound, Bits};
use straightline_graph::certify::residual::acceleration_bound;
use straightline_graph::expr::Graph;
use straightline_graph::pass::dead_code;

/// Why programs by exact rules alone have no bounds: their exact values are not those of the robot.
pub(crate) const ROUNDED: &str =
    "its constants are rounded one by one, as the generic runtime holds them: what that does to the robot is not bounded";

/// Whether programs for the bounds at the state at hand are asked for.
pub fn wants_companions(options: &Options) -> bool {
    options.certify.is_some_and(|effort| effort.companions)
}

/// Which bits the functions of these options compute.
pub fn bits(options: &Options) -> Bits {
    if options.fma {
        Bits::Fused
    } else {
        Bits::Plain
    }
}

/// The program that bounds a function's rounding errors at the state at hand.
///
/// # Errors
/// Why there is none.
///
/// # Panics
/// If no form of the equations that accelerations are judged by agrees with the plain ones, or what was made is no bound.
pub fn companion(robot: &Robot, function: Function, graph: &Graph, options: &Options) -> Result<Graph, &'static str> {
    checked_companion(robot, function, graph, options).unwrap_or_else(|wrong| panic!("{wrong}")).0
}

/// A bound at a state, or why there is none.
pub(crate) type StateBound = Result<Graph, &'static str>;

/// The same, checked, and whether the equations that it is made of are plainer than they were to be.
///
/// # Errors
/// What was wrong.
pub(crate) fn checked_companion(
    robot: &Robot,
    function: Function,
    graph: &Graph,
    options: &Options,
) -> Result<(StateBound, Option<Plainer>), Disagreement> {
    match function.spec().judged {
        Judged::ByResidual => of_accelerations(robot, options, &Mode::alone(), function.name(), graph),
        // packed results are no columns
        Judged::ByColumns => match SolvedColumns::of(robot, function, options).filter(|c| c.outputs == graph.outputs) {
            Some(columns) => match of_columns(robot, options, (function, &columns), graph)? {
                (Err(_), _) => of_errors(robot, options, function.name(), graph, bits(options)),
                made => Ok(made),
            },
            None => of_errors(robot, options, function.name(), graph, bits(options)),
        },
        Judged::ByScale | Judged::ByInertias | Judged::ByDerivatives => {
            of_errors(robot, options, function.name(), graph, bits(options))
        }
    }
}

/// The output of bounds that are made of equations which results solve.
const EIGENVALUE: &str = "smallest_eigenvalue";

/// Whether a bound takes the results themselves, and judges them by the equations that they solve.
pub(crate) fn is_by_equations(bound: &Graph) -> bool {
    bound.outputs.iter().any(|port| port.name == EIGENVALUE)
}

/// The program that bounds the errors of a contact function at the state at hand, and whether the equations that it is made of are plainer
/// than they were to be.
///
/// # Errors
/// What was wrong with it.
pub(crate) fn bound(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    function: ContactFunction,
    graph: &Graph,
) -> Result<(StateBound, Option<Plainer>), Disagreement> {
    if !options.optimisations().folding {
        return Ok((Err(ROUNDED), None));
    }
    let name = format!("{}::{}", mode.identifier, function.name());
    match function.spec().judged {
        Judged::ByResidual => of_accelerations(robot, options, mode, &name, graph),
        _ => of_errors(robot, options, &name, graph, bits(options)),
    }
}

/// The program that bounds what the operations of another one lose.
fn of_errors(
    robot: &Robot,
    options: &Options,
    name: &str,
    graph: &Graph,
    bits: Bits,
) -> Result<(StateBound, Option<Plainer>), Disagreement> {
    let bound = state_bound(graph, options.scalar, bits).map(|bound| finished_bound(name, bound));
    bound.iter().try_for_each(|bound| equivalence::of_bound(robot, options, name, (graph, bound)))?;
    Ok((bound, None))
}

/// The program that bounds errors of accelerations and reactions by what they leave of the equations.
fn of_accelerations(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    name: &str,
    graph: &Graph,
) -> Result<(StateBound, Option<Plainer>), Disagreement> {
    let ((system, yielding), plainer) = checked_system(robot, options, mode)?;
    let bound = acceleration_bound(&system, &yielding, options.scalar).map(|bound| finished_bound(name, bound));
    bound
        .iter()
        .try_for_each(|bound| equivalence::of_acceleration_bound(robot, options, name, (graph, bound), &system))?;
    Ok((bound, plainer))
}

/// The program that bounds errors of derivatives of accelerations by what each column leaves of the equations that it solves.
fn of_columns(
    robot: &Robot,
    options: &Options,
    (function, columns): (Function, &SolvedColumns),
    graph: &Graph,
) -> Result<(StateBound, Option<Plainer>), Disagreement> {
    let name = function.name();
    let (system, plainer) = columns.checked_system(robot, function, options)?;
    let bound = column_bound(&system, options.scalar).map(|bound| finished_bound(name, bound));
    bound.iter().try_for_each(|bound| equivalence::of_column_bound(robot, options, name, (graph, bound), &system))?;
    Ok((bound, plainer))
}

/// A bound without what no result needs.
fn finished_bound(program: &str, bound: Graph) -> Graph {
    passed("bound: dead code", program, dead_code(&passed("bound: traced", program, bound)))
}
