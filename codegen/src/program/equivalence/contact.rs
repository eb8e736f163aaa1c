//! Programs of contact modes, against the plain equations of the same mode.

use super::{agreeing, compare, difference, every_scalar, inputs, with_sizes, Disagreement, States, STATES};
use crate::equations::reduce::longest_lever;
use crate::equations::Robot;
use crate::function::ContactFunction;
use crate::options::Options;
use crate::program::contact;
use straightline_core::magnitude::Magnitude;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::{evaluate, Graph, Port};
use straightline_graph::{EveryScalar, Scalar};

/// What is solved for counts as so many times what it loses in f64, over the rounding of f64: another form may lose more.
const SOLVED: f64 = 1e3;
/// So much [`nudge`] moves axes and, of the longest lever, origins.
const NUDGE: f64 = 1e-26;

/// Whether the program of a contact function says what its plain equations say; `plain`: the same function traced by exact rules, for
/// surfaces that have a scalar of their own.
///
/// # Errors
/// As [`of_function`].
pub(crate) fn of_contact(
    robot: &Robot,
    options: &Options,
    mode: &contact::Mode,
    function: ContactFunction,
    graph: &Graph,
    plain: &dyn Fn() -> Graph,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    let ports = contact::ports(robot, options, mode, function);
    let (prepare, lever) = (falling(robot), longest_lever(&robot.model));
    for _ in 0..STATES {
        let state = states.next(&ports);
        let given = |port: &Port| every_scalar(&state[&port.name]);
        let by_numbers = contact::evaluate(robot, options, mode, function, &given, &prepare);
        let of_another = contact::evaluate(robot, options, mode, function, &given, &|model| {
            nudge(model, lever);
            None
        });
        let truth = by_numbers.unwrap_or_else(|| {
            let plain = plain();
            evaluate(&plain, &every_scalar(&inputs(&plain, &state)))
        });
        let found = evaluate(graph, &inputs(graph, &state));
        let most = solved_size(&truth, of_another.as_deref());
        let off = found.into_iter().zip(truth).map(|(found, plain)| difference(found, plain.wide));
        let off: Vec<Magnitude> = off.map(|x| Magnitude { size: x.size.min(most), ..x }).collect();
        let name = format!("{}::{}", mode.identifier, function.name());
        compare(&name, &graph.outputs, &off, agreeing(options))?;
    }
    Ok(())
}

/// How large results may count that are solved for. [`Magnitude`] takes the worst of every pivot, one after the other, and tells nothing where
/// there are many; what the same equations lose in f64, at inputs that are hardly rounded, is what they are made of, or what they change by for
/// `another` robot, as next to nothing that is not zero keeps its digits in f64. All results count together: some are zero by their equations.
fn solved_size(truth: &[EveryScalar], another: Option<&[EveryScalar]>) -> f64 {
    let size = |k: usize| {
        let value = truth[k].wide.value;
        let off = |x: Dd, by: f64| (value - x).hi().abs() / by;
        let changed = another.map_or(0.0, |another| off(another[k].wide.value, NUDGE));
        value.hi().abs() + off(Dd::from(truth[k].in_scalar(Scalar::F64)), f64::EPSILON) + changed
    };
    let sizes: Vec<f64> = (0..truth.len()).map(size).collect();
    match sizes.iter().all(|x| x.is_finite()) {
        true => SOLVED * sizes.into_iter().fold(0.0, f64::max),
        false => f64::INFINITY,
    }
}

/// Another robot, by far less than its numbers are known: axes and origins, of which forms of a robot keep so much.
fn nudge(model: &mut Model<EveryScalar>, lever: f64) {
    let mut sign = 1.0;
    let mut nudged = |x: EveryScalar, size: f64| {
        sign = -sign;
        x + EveryScalar::wide_alone(Dd::from(sign * NUDGE * size))
    };
    let places =
        model.bodies.iter_mut().map(|b| &mut b.placement).chain(model.frames.iter_mut().map(|f| &mut f.placement));
    for place in places {
        place.rotation = place.rotation.map(|x| nudged(x, 1.0));
        place.translation = place.translation.map(|x| nudged(x, lever));
    }
}

/// Numbers of their natural sizes, and what is added to accelerations of contact points and taken away again.
fn falling(robot: &Robot) -> impl Fn(&mut Model<EveryScalar>) -> Option<EveryScalar> {
    let lever = longest_lever(&robot.model);
    move |model| {
        with_sizes(model, lever);
        // every component of a vector has its length as size
        Some(EveryScalar::wide_alone(Dd::from(model.gravity.x.wide.size)))
    }
}

/// Whether what is left of the equations of a mode, by which accelerations and reactions are judged, is what the plain equations leave;
/// `plain` as in [`of_contact`].
///
/// # Errors
/// As [`of_function`].
pub(crate) fn of_system(
    robot: &Robot,
    options: &Options,
    mode: &contact::Mode,
    graph: &Graph,
    plain: &dyn Fn() -> Graph,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    let ports = contact::system_ports(robot, options, mode);
    let prepare = falling(robot);
    let name = match mode.identifier.is_empty() {
        true => "forward_dynamics_error_bound".to_string(),
        false => format!("{}::forward_dynamics_error_bound", mode.identifier),
    };
    for _ in 0..STATES {
        let state = states.next(&ports);
        let given = |port: &Port| every_scalar(&state[&port.name]);
        let by_numbers = contact::evaluate_system(robot, options, mode, &given, &prepare);
        let truth = by_numbers.unwrap_or_else(|| {
            let plain = plain();
            evaluate(&plain, &every_scalar(&inputs(&plain, &state)))
        });
        let found = evaluate(graph, &inputs(graph, &state));
        let off = found.into_iter().zip(truth).map(|(found, plain)| difference(found, plain.wide));
        let off: Vec<Magnitude> = off.collect();
        compare(&name, &graph.outputs, &off, agreeing(options))?;
    }
    Ok(())
}
