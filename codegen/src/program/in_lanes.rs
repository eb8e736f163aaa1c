//! Columns that a function solves for as lanes of one loop.
//!
//! Derivatives of forward dynamics solve H x = b for two columns per joint. Traced once for all that are alike
//! ([`lanes`](straightline_graph::lanes)), they take the same operations as apart, in vector instructions, and a fraction of the code.

use crate::choices::ColumnForm;
use crate::equations::bind::is_optional;
use crate::equations::Robot;
use crate::function::Function;
use crate::model::states::lane_samples;
use crate::options::{Optimisations, Options};
use crate::program::passed;
use straightline_graph::expr::{with_short_loops, Graph};
use straightline_graph::pass::{dead_code, order, sums, unread_inputs};

/// Lanes may take so many times the operations of columns apart: what columns share with one another, lanes do not see.
const MORE: f64 = 1.03;
/// This part of the operations is in lanes at least.
const PART: f64 = 0.2;
/// Programs of more operations as traced are not written with columns apart to be compared: that takes most of the time of generation.
const COMPARED: usize = 30_000;

/// Whether lanes are taken without a look at what columns apart would take.
pub(super) fn is_taken_unseen(traced: &Graph, options: &Options) -> bool {
    options.columns == ColumnForm::Lanes || traced.counts().flops() > COMPARED
}

/// Whether a program with lanes is worth more than that with columns apart.
pub(super) fn pays(in_lanes: &Graph, apart: &Graph) -> bool {
    let rows = in_lanes.alike.iter().flat_map(|alike| &alike.rows).filter(|row| in_lanes.op(row[0]).is_counted());
    let [lanes, apart] = [in_lanes, apart].map(|graph| graph.counts().flops() as f64);
    lanes <= MORE * apart && rows.map(Vec::len).sum::<usize>() as f64 >= PART * lanes
}

/// The program of a function with such columns as lanes; `None` where there are none.
pub(super) fn program(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Option<Graph> {
    let is_mixed = options.scene.budgets.get(&function).is_some_and(|budget| budget.mixed_precision);
    // the order for a machine's registers is one of single operations
    let has_order = options.columns == ColumnForm::Auto && options.target.is_some();
    if !function.spec().solves || !optimisations.columns || is_mixed || has_order {
        return None;
    }
    let (method, rules) = (options.forward_dynamics, options.rules_of(optimisations));
    let template = function.trace_in_lanes(robot, frames, method, rules, optimisations.reduced, &options.scene)?;
    let check = |pass, graph| passed(pass, function.name(), graph);
    let template = template.with(|graph| check("columns: traced", graph));
    let template = match optimisations.sums {
        true => template.with(|graph| check("columns: dead code", dead_code(&check("columns: sums", sums(&graph))))),
        false => template,
    };
    // fused products want another order
    let ordered = optimisations.sums && !options.fma && !function.spec().keeps_order;
    let states = ordered.then(|| lane_samples(&robot.model, &template)).flatten();
    let template = match states {
        Some(states) => template.with(|graph| check("columns: order", order(&graph, &states))),
        None => template,
    };
    let graph = check("columns: written out", with_short_loops(template.written_out()));
    Some(check("columns: unread inputs", unread_inputs(graph, is_optional)))
}
