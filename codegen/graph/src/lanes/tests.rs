//! Lanes beside columns apart.

use super::{traced, LaneTemplate, Tracer};
use crate::expr::{evaluate, verify, Graph, LoopLanes, Port, RuleSet};
use crate::pass::{dead_code, sums};
use crate::trace::{trace, Expr};
use straightline_core::{Dd, Real};

/// Columns of x by columns, with a zero in the first entry of all but the last, times something of y, entry after entry.
fn columns(x: &[Expr], zeros: usize) -> Vec<Vec<Expr>> {
    let column = |(k, of): (usize, &[Expr])| {
        let entry = |(i, x): (usize, &Expr)| if i == 0 && k < zeros { Expr::zero() } else { *x };
        of.iter().enumerate().map(entry).collect()
    };
    x.chunks(3).enumerate().map(column).collect()
}

fn one(y: &[Expr], column: &[Expr]) -> Vec<Expr> {
    let a = y[0] * column[0] + y[1] * column[1];
    let b = y[1] * a - column[2];
    vec![a, b, y[0] + y[1], y[0] * b]
}

/// Two loops, the second of what the first leaves and of what lies between them; `wanted` of their results, and one that is neither's.
fn algorithm(inputs: &[Vec<Expr>], zeros: usize, wanted: &[usize], tracer: Option<&Tracer>) -> Vec<Expr> {
    let (x, y) = (&inputs[0], &inputs[1]);
    let all = |columns: &[Vec<Expr>]| match tracer {
        Some(tracer) => tracer.columns(columns, &|column| one(y, column)),
        None => columns.iter().map(|column| one(y, column)).collect(),
    };
    let first = all(&columns(x, zeros));
    let between: Vec<Vec<Expr>> = first.iter().map(|of| vec![of[0] * of[1] + y[0], of[3], -of[1]]).collect();
    let results: Vec<Expr> = all(&between).into_iter().chain(first).flatten().chain([y[0] - x[2]]).collect();
    wanted.iter().map(|k| results[*k]).collect()
}

const LANES: usize = 5;
/// Of two loops four results per lane, and one more.
const RESULTS: usize = 2 * 4 * LANES + 1;

fn ports() -> Vec<Port> {
    vec![Port::new("x", &[3 * LANES]), Port::new("y", &[2])]
}

fn in_lanes(zeros: usize, wanted: &[usize]) -> Option<LaneTemplate> {
    let outputs = vec![Port::new("z", &[wanted.len()])];
    traced(RuleSet::all(), ports(), outputs, |inputs, tracer| algorithm(inputs, zeros, wanted, Some(tracer)))
}

fn apart(zeros: usize, wanted: &[usize]) -> Graph {
    let outputs = vec![Port::new("z", &[wanted.len()])];
    dead_code(&trace(RuleSet::all(), ports(), outputs, |inputs| algorithm(inputs, zeros, wanted, None)))
}

fn inputs() -> Vec<Dd> {
    (0..3 * LANES + 2).map(|k| Dd::from(((k * 37 + 11) % 29) as f64 / 7.0 - 2.0)).collect()
}

fn assert_agree(graph: &Graph, other: &Graph) {
    verify(graph).expect("what a graph promises");
    let (found, expected) = (evaluate(graph, &inputs()), evaluate(other, &inputs()));
    assert_eq!(found.len(), expected.len());
    for (k, (a, b)) in found.iter().zip(&expected).enumerate() {
        assert!((*a - *b).abs().to_f64() <= 1e-28 * b.abs().to_f64().max(1.0), "result {k}: {a:?}, not {b:?}");
    }
}

#[test]
fn lanes_compute_what_columns_apart_do() {
    let all: Vec<usize> = (0..RESULTS).collect();
    for pass in [|graph: Graph| graph, |graph: Graph| dead_code(&sums(&dead_code(&graph)))] {
        let graph = in_lanes(0, &all).expect("five columns are alike").with(pass).written_out();
        assert_agree(&graph, &apart(0, &all));
        let lanes: Vec<&LoopLanes> = graph.alike.iter().map(|alike| &alike.lanes).collect();
        assert_eq!(lanes, [&LoopLanes::Columns(LANES); 2]);
    }
}

#[test]
fn lanes_take_no_operation_that_columns_apart_do_not() {
    for zeros in [0, 4, LANES] {
        let wanted: Vec<usize> = (0..RESULTS).collect();
        let graph = in_lanes(zeros, &wanted).expect("four columns are alike").written_out();
        assert_eq!(graph.counts(), apart(zeros, &wanted).counts(), "{zeros}");
        assert_agree(&graph, &apart(zeros, &wanted));
    }
    // the second loop takes all five whatever the zeros of the first are
    let graph = in_lanes(4, &(0..RESULTS).collect::<Vec<_>>()).expect("four columns are alike").written_out();
    let lanes: Vec<usize> = graph.alike.iter().map(|alike| alike.lanes.count()).collect();
    assert_eq!(lanes, [4, LANES]);
}

#[test]
fn what_nobody_wants_is_not_computed() {
    // of the second loop one result of one lane; of that lane the first loop is needed alone
    let graph = in_lanes(0, &[4 * 2 + 1]).expect("a lane is left").written_out();
    assert_agree(&graph, &apart(0, &[4 * 2 + 1]));
    assert_eq!(graph.counts(), apart(0, &[4 * 2 + 1]).counts());
    // none of either
    assert!(in_lanes(0, &[RESULTS - 1]).is_none());
    // the first loop's second results alone: the fourth of its rows is not needed
    let wanted: Vec<usize> = (0..LANES).map(|lane| 4 * LANES + 4 * lane + 1).collect();
    let graph = in_lanes(0, &wanted).expect("five columns are alike").written_out();
    assert_eq!((graph.alike.len(), graph.counts()), (1, apart(0, &wanted).counts()));
}

#[test]
fn values_are_those_of_the_lane() {
    let all: Vec<usize> = (0..RESULTS).collect();
    let template = in_lanes(0, &all).expect("five columns are alike");
    let x: Vec<f64> = inputs().iter().map(|x| x.to_f64()).collect();
    let expected = evaluate(&apart(0, &all), &x);
    for lane in 0..LANES {
        let values = template.values(&x, lane);
        let found = |result: usize| values[template.graph.results[result].index()];
        all.iter().for_each(|k| assert_eq!(found(*k), expected[*k]));
        // what the template of the second loop leaves is what the lane does
        let last = template.loops.last().expect("there are two");
        let of_template: Vec<f64> = last.left.iter().map(|(result, _)| found(*result)).collect();
        assert_eq!(of_template, expected[4 * lane..4 * lane + 4]);
    }
}
