//! One small program per rule, on which a search comes near the bound; and every rule broken on purpose, which it must notice.

use super::analysis::Broken;
use super::companion::state_bound_in;
use super::search::{computed_at, errors_at, worst_found};
use super::{Analysis, Format, Interval};
use crate::emit::Scalar;
use crate::expr::{Builder, Graph, NodeId, Op, Port, RuleSet};
use straightline_core::Dd;

/// A program of `inputs` numbers with one result.
fn program(inputs: usize, equation: impl FnOnce(&mut Builder, &[NodeId]) -> NodeId) -> Graph {
    let mut b = Builder::new(RuleSet::all(), vec![Port::new("x", &[inputs])]);
    let x: Vec<NodeId> = (0..inputs as u32).map(|k| b.insert(Op::Input(k))).collect();
    let result = equation(&mut b, &x);
    b.finish(vec![Port::new("y", &[1])], vec![result])
}

fn sin_cos(b: &mut Builder, angle: NodeId) -> (NodeId, NodeId) {
    let pair = b.add(Op::SinCos(angle));
    (b.add(Op::Sin(pair)), b.add(Op::Cos(pair)))
}

/// x cos q − y sin q, y cos q + x sin q.
fn turned(b: &mut Builder, x: NodeId, y: NodeId, q: NodeId) -> (NodeId, NodeId) {
    let (s, c) = sin_cos(b, q);
    let mut product = |a, f| b.add(Op::Mul(a, f));
    let (xc, ys, yc, xs) = (product(x, c), product(y, s), product(y, c), product(x, s));
    (b.add(Op::Sub(xc, ys)), b.add(Op::Add(yc, xs)))
}

fn sum_of_two() -> Graph {
    program(2, |b, x| b.add(Op::Add(x[0], x[1])))
}

fn tenth() -> Graph {
    program(1, |b, x| {
        let c = b.constant(Dd::from(0.1));
        b.add(Op::Mul(c, x[0]))
    })
}

fn sine() -> Graph {
    program(1, |b, x| sin_cos(b, x[0]).0)
}

fn square_of_sum() -> Graph {
    program(1, |b, x| {
        let c = b.constant(Dd::ONE);
        let a = b.add(Op::Add(x[0], c));
        b.add(Op::Mul(a, a))
    })
}

/// Five turns of a vector, one component.
fn turns() -> Graph {
    program(7, |b, x| {
        let (mut u, mut v) = (x[0], x[1]);
        for q in &x[2..] {
            (u, v) = turned(b, u, v, *q);
        }
        u
    })
}

/// (x₀ + x₁)(x₂ + x₃) − (x₀ x₂ + x₁ x₂) = (x₀ + x₁) x₃.
fn products_that_cancel() -> Graph {
    program(4, |b, x| {
        let (u, v) = (b.add(Op::Add(x[0], x[1])), b.add(Op::Add(x[2], x[3])));
        let (whole, p, q) = (b.add(Op::Mul(u, v)), b.add(Op::Mul(x[0], x[2])), b.add(Op::Mul(x[1], x[2])));
        let sum = b.add(Op::Add(p, q));
        b.add(Op::Sub(whole, sum))
    })
}

const WIDE: [Interval; 7] = [Interval { lo: -0.7, hi: 0.7 }; 7];

/// The bound and the greatest magnitude of the result.
fn bound(graph: &Graph, format: Format, ranges: &[Interval], broken: Option<Broken>) -> (f64, f64) {
    let mut analysis = Analysis::new(graph, format);
    analysis.broken = broken;
    analysis.ranges(ranges).expect("the program is sound in its box");
    (analysis.error(0), analysis.range(graph.results[0]).mag())
}

/// Whether the search finds an error above the bound, or a value beyond the magnitude.
fn is_violated(graph: &Graph, ranges: &[Interval], (bound, magnitude): (f64, f64)) -> bool {
    let found = worst_found(graph, Scalar::F32, ranges, 40_000, 3).remove(0);
    let mut corners = worst_found(graph, Scalar::F32, ranges, 2_000, 5);
    corners.push(found.clone());
    let beyond = |inputs: &[f64]| computed_at(graph, Scalar::F32, inputs)[0].abs() > magnitude;
    found.error > bound || corners.iter().any(|f| beyond(&f.inputs))
}

#[test]
fn a_search_comes_near_the_bound_of_each_rule_and_not_above() {
    // not to a power of two, above which half an ulp doubles
    let unit = [Interval::new(-0.9, 0.9); 2];
    let cases: [(&str, Graph, &[Interval], f64); 5] = [
        ("sum", sum_of_two(), &unit, 1.1),
        ("constant", tenth(), &unit[..1], 1.3),
        ("sine", sine(), &unit[..1], 1.8),
        ("square", square_of_sum(), &[Interval { lo: 0.0, hi: 0.9 }], 1.6),
        ("turns", turns(), &WIDE, 8.0),
    ];
    for (name, graph, ranges, most) in cases {
        for scalar in [Scalar::F32, Scalar::F64] {
            let (bound, _) = bound(&graph, Format::of(scalar), ranges, None);
            let found = worst_found(&graph, scalar, ranges, 20_000, 7).remove(0);
            assert!(found.error <= bound, "{name}: {:e} > {bound:e} at {:?}", found.error, found.inputs);
            assert!(bound <= most * found.error, "{name}, {scalar:?}: {bound:e} is far above {:e}", found.error);
            assert_eq!(errors_at(&graph, scalar, &found.inputs)[0], found.error);
        }
    }
}

#[test]
fn a_bound_with_a_broken_rule_is_violated() {
    let format = Format::of(Scalar::F32);
    // not to a power of two, above which half an ulp doubles
    let unit = [Interval::new(-0.9, 0.9); 2];
    let fraction = [Interval::new(0.0, 0.9)];
    let small_u = Format { u: 0.5 * format.u, ..format };
    assert!(is_violated(&sum_of_two(), &unit, bound(&sum_of_two(), small_u, &unit, None)), "rounding");
    let small_trig = Format { trig_ulps: 0.4, ..format };
    assert!(is_violated(&sine(), &unit[..1], bound(&sine(), small_trig, &unit[..1], None)), "sine");
    let broken = |graph: Graph, ranges: &[Interval], what: Broken| {
        assert!(!is_violated(&graph, ranges, bound(&graph, format, ranges, None)), "{what:?} when sound");
        assert!(is_violated(&graph, ranges, bound(&graph, format, ranges, Some(what))), "{what:?}");
    };
    broken(tenth(), &unit[..1], Broken::Constants);
    broken(square_of_sum(), &fraction, Broken::ChainRule);
    broken(turns(), &WIDE, Broken::Turn);
    broken(products_that_cancel(), &CANCELLING, Broken::Cancelled);
    // 2 sin q − 2 cos q near 45°: nothing rounds but sine and cosine
    let difference = program(1, |b, x| {
        let (s, c) = sin_cos(b, x[0]);
        let two = b.constant(Dd::from(2.0));
        let (s, c) = (b.add(Op::Mul(two, s)), b.add(Op::Mul(two, c)));
        b.add(Op::Sub(s, c))
    });
    broken(difference, &[Interval::new(0.7, 0.87)], Broken::Team);
}

#[test]
fn a_turned_vector_keeps_its_norm() {
    let (_, magnitude) = bound(&turns(), Format::of(Scalar::F32), &WIDE, None);
    // √2 · 0.7, and a few roundings
    assert!((0.9899..0.99).contains(&magnitude), "{magnitude}");
}

const CANCELLING: [Interval; 4] = [
    Interval { lo: -0.9, hi: 0.9 },
    Interval { lo: -0.9, hi: 0.9 },
    Interval { lo: -9.0, hi: 9.0 },
    Interval { lo: -0.1, hi: 0.1 },
];

#[test]
fn products_that_cancel_leave_no_range_behind() {
    let (_, magnitude) = bound(&products_that_cancel(), Format::of(Scalar::F32), &CANCELLING, None);
    // 1.8 · 0.1, and roundings of products up to 16; without cancelling 33
    assert!((0.18..0.1801).contains(&magnitude), "{magnitude}");
}

#[test]
fn what_may_be_no_number_has_no_bound() {
    let quotient = program(2, |b, x| b.add(Op::Div(x[0], x[1])));
    let refused = |ranges: &[Interval]| Analysis::new(&quotient, Format::of(Scalar::F32)).ranges(ranges).err();
    assert_eq!(refused(&[Interval::ONE, Interval::new(-1.0, 1.0)]), Some(super::Refusal::Division));
    assert_eq!(refused(&[Interval::ONE, Interval::new(0.5, 1.0)]), None);
    let huge = [Interval::point(1e30), Interval::new(1e-10, 1.0)];
    assert_eq!(refused(&huge), Some(super::Refusal::Overflow));
    let angle = Analysis::new(&sine(), Format::of(Scalar::F32)).ranges(&[Interval::new(0.0, 2e4)]).err();
    assert_eq!(angle, Some(super::Refusal::Overflow), "beyond the domain of sine and cosine");
}

#[test]
fn intervals_hold_what_they_must() {
    // every operation on the ends and the middle lies inside, with double-double as the truth
    let ranges = [(-3.0, -0.1), (-1.0, 2.0), (0.3, 0.7), (1e-9, 1e9), (2.0, 2.0)];
    for (a, b) in ranges.iter().flat_map(|a| ranges.iter().map(move |b| (*a, *b))) {
        let (x, y) = (Interval::new(a.0, a.1), Interval::new(b.0, b.1));
        for (u, v) in [(a.0, b.0), (a.1, b.0), (0.5 * (a.0 + a.1), b.1)] {
            let holds = |i: Interval, t: Dd| Dd::from(i.lo) <= t && t <= Dd::from(i.hi);
            let (u, v) = (Dd::from(u), Dd::from(v));
            assert!(holds(x + y, u + v) && holds(x - y, u - v) && holds(x * y, u * v) && holds(x.square(), u * u));
            assert!(y.has_zero() || holds(x.over(y), u / v));
            let ((s, c), (sin, cos)) = (u.sin_cos(), x.sin_cos());
            assert!(x.mag() > 1e6 || (holds(sin, s) && holds(cos, c)), "{x:?} at {u}");
        }
    }
}

/// Whether the bound at the state where a search finds the worst error lies below that error.
fn is_violated_at_a_state(graph: &Graph, ranges: &[Interval], format: Format) -> bool {
    let bound = state_bound_in(graph, format).expect("the program has no division");
    let found = worst_found(graph, Scalar::F32, ranges, 20_000, 3).remove(0);
    found.error > computed_at(&bound, Scalar::F32, &found.inputs)[0]
}

#[test]
fn a_bound_at_a_state_holds_and_with_broken_numbers_does_not() {
    let format = Format::of(Scalar::F32);
    let unit = [Interval::new(-0.9, 0.9); 2];
    for (name, graph, ranges) in [
        ("sum", sum_of_two(), &unit[..]),
        ("constant", tenth(), &unit[..1]),
        ("sine", sine(), &unit[..1]),
        ("square", square_of_sum(), &unit[..1]),
        ("turns", turns(), &WIDE),
        ("cancelling", products_that_cancel(), &CANCELLING),
    ] {
        assert!(!is_violated_at_a_state(&graph, ranges, format), "{name}");
    }
    assert!(is_violated_at_a_state(&sum_of_two(), &unit, Format { u: 0.5 * format.u, ..format }), "rounding");
    assert!(is_violated_at_a_state(&sine(), &unit[..1], Format { trig_ulps: 0.3, ..format }), "sine");
}
