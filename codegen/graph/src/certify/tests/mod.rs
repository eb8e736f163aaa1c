//! One small program per rule, on which a search comes near the bound; and every rule broken on purpose, which it must notice.

mod at_a_state;

use super::analysis::{Broken, OfResult};
use super::search::{computed_at, errors_at, worst_found};
use super::tape::Registers;
use super::{certify, subdivision, Effort, ErrorAnalysis, FloatFormat, Interval};
use crate::expr::{Binary, Graph, GraphBuilder, NodeId, Op, Port, RuleSet};
use crate::number::Scalar;
use straightline_core::random::Random;
use straightline_core::Dd;

/// A program of `inputs` numbers with one result.
fn program(inputs: usize, equation: impl FnOnce(&mut GraphBuilder, &[NodeId]) -> NodeId) -> Graph {
    let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[inputs])]);
    let x: Vec<NodeId> = (0..inputs as u32).map(|k| b.insert(Op::Input(k))).collect();
    let result = equation(&mut b, &x);
    b.finish(vec![Port::new("y", &[1])], vec![result])
}

fn sin_cos(b: &mut GraphBuilder, angle: NodeId) -> (NodeId, NodeId) {
    let pair = b.add(Op::SinCos(angle));
    (b.add(Op::Sin(pair)), b.add(Op::Cos(pair)))
}

/// x cos q − y sin q, y cos q + x sin q.
fn turned(b: &mut GraphBuilder, x: NodeId, y: NodeId, q: NodeId) -> (NodeId, NodeId) {
    let (s, c) = sin_cos(b, q);
    let mut product = |a, f| b.add(Op::mul(a, f));
    let (xc, ys, yc, xs) = (product(x, c), product(y, s), product(y, c), product(x, s));
    (b.add(Op::sub(xc, ys)), b.add(Op::add(yc, xs)))
}

fn sum_of_two() -> Graph {
    program(2, |b, x| b.add(Op::add(x[0], x[1])))
}

fn tenth() -> Graph {
    program(1, |b, x| {
        let c = b.constant(Dd::from(0.1));
        b.add(Op::mul(c, x[0]))
    })
}

fn sine() -> Graph {
    program(1, |b, x| sin_cos(b, x[0]).0)
}

fn square_of_sum() -> Graph {
    program(1, |b, x| {
        let c = b.constant(Dd::ONE);
        let a = b.add(Op::add(x[0], c));
        b.add(Op::mul(a, a))
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
        let (u, v) = (b.add(Op::add(x[0], x[1])), b.add(Op::add(x[2], x[3])));
        let (whole, p, q) = (b.add(Op::mul(u, v)), b.add(Op::mul(x[0], x[2])), b.add(Op::mul(x[1], x[2])));
        let sum = b.add(Op::add(p, q));
        b.add(Op::sub(whole, sum))
    })
}

const WIDE: [Interval; 7] = [Interval { lo: -0.7, hi: 0.7 }; 7];

/// The bound and the greatest magnitude of the result.
fn bound(graph: &Graph, format: FloatFormat, ranges: &[Interval], broken: Option<Broken>) -> (f64, f64) {
    let mut analysis = ErrorAnalysis::new(graph, format);
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
            let (bound, _) = bound(&graph, FloatFormat::of(scalar), ranges, None);
            let found = worst_found(&graph, scalar, ranges, 20_000, 7).remove(0);
            assert!(found.error <= bound, "{name}: {:e} > {bound:e} at {:?}", found.error, found.inputs);
            assert!(bound <= most * found.error, "{name}, {scalar:?}: {bound:e} is far above {:e}", found.error);
            assert_eq!(errors_at(&graph, scalar, &found.inputs)[0], found.error);
        }
    }
}

#[test]
fn a_bound_with_a_broken_rule_is_violated() {
    let format = FloatFormat::of(Scalar::F32);
    // not to a power of two, above which half an ulp doubles
    let unit = [Interval::new(-0.9, 0.9); 2];
    let fraction = [Interval::new(0.0, 0.9)];
    let small_u = FloatFormat { u: 0.5 * format.u, ..format };
    assert!(is_violated(&sum_of_two(), &unit, bound(&sum_of_two(), small_u, &unit, None)), "rounding");
    let small_trig = FloatFormat { trig_ulps: 0.4, ..format };
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
        let (s, c) = (b.add(Op::mul(two, s)), b.add(Op::mul(two, c)));
        b.add(Op::sub(s, c))
    });
    broken(difference, &[Interval::new(0.7, 0.87)], Broken::Team);
}

/// Every operation there is, with a range for each input: √((x₀ + 2)²) / (x₁ + 3) cos x₂ + x₀ x₁ 0.1 − sin(x₁ + x₂) x₀.
fn all_operations() -> (Graph, [Interval; 3]) {
    let graph = program(3, |b, x| {
        let (two, three, tenth) = (b.constant(Dd::from(2.0)), b.constant(Dd::from(3.0)), b.constant(Dd::from(0.1)));
        let (u, v) = (b.add(Op::add(x[0], two)), b.add(Op::add(x[1], three)));
        let square = b.insert(Op::mul(u, u));
        let root = b.insert(Op::sqrt(square));
        let quotient = b.add(Op::div(root, v));
        let (_, c) = sin_cos(b, x[2]);
        let angle = b.insert(Op::AngleSum(x[1], x[2]));
        let (s, _) = sin_cos(b, angle);
        let (first, product, last) = (b.add(Op::mul(quotient, c)), b.add(Op::mul(x[0], x[1])), b.add(Op::mul(s, x[0])));
        let second = b.add(Op::mul(product, tenth));
        let sum = b.add(Op::add(first, second));
        b.add(Op::sub(sum, last))
    });
    (graph, [Interval::new(-0.9, 0.7), Interval::new(-0.3, 0.9), Interval::new(-3.0, 1.1)])
}

/// The bounds of a tape in parts of the box, at all depths: never below what a search finds there, and near those of an analysis of the part.
#[test]
fn what_is_played_for_a_part_is_what_an_analysis_of_it_finds() {
    let (operations, ranges) = all_operations();
    let cases: [(&str, Graph, &[Interval]); 4] = [
        ("operations", operations, &ranges),
        ("square", square_of_sum(), &[Interval { lo: 0.0, hi: 0.9 }]),
        ("turns", turns(), &WIDE),
        ("cancelling", products_that_cancel(), &CANCELLING),
    ];
    for (name, graph, ranges) in cases {
        let format = FloatFormat::of(Scalar::F32);
        let mut analysis = ErrorAnalysis::new(&graph, format);
        analysis.ranges_on_tape(ranges).expect("the program is sound in its box");
        let samples = subdivision::samples(ranges);
        let samples: Vec<&[Interval]> = samples.iter().map(Vec::as_slice).collect();
        let (whole, tape) = analysis.bound_and_tape(OfResult::Error, 0, &samples);
        assert_eq!(whole, bound(&graph, format, ranges, None).0, "{name}: writing changes nothing");
        let mut random = Random(5);
        for depth in 0..40 {
            let mut part = ranges.to_vec();
            for _ in 0..depth {
                let x = &mut part[random.below(ranges.len())];
                let middle = 0.5 * (x.lo + x.hi);
                *x = if random.below(2) == 0 { Interval::new(x.lo, middle) } else { Interval::new(middle, x.hi) };
            }
            let played = tape.bounds(&[&part], &mut Registers::default())[0];
            let found = worst_found(&graph, Scalar::F32, &part, 300, depth).remove(0);
            assert!(found.error <= played, "{name}: {:e} > {played:e} at {:?}", found.error, found.inputs);
            let analysed = bound(&graph, format, &part, None).0;
            // minima without what was not the least elsewhere
            assert!((0.9..1.3).contains(&(played / analysed)), "{name}: {played:e}, not {analysed:e} in {part:?}");
        }
    }
}

#[test]
fn parts_cover_the_box() {
    let effort = Effort { boxes: 16, ..Effort::default() };
    let of = |graph: &Graph, ranges: &[Interval], broken: Option<Broken>| {
        let mut analysis = ErrorAnalysis::new(graph, FloatFormat::of(Scalar::F32));
        analysis.broken = broken;
        let (_, error, magnitude) =
            subdivision::bounds(&mut analysis, ranges, effort).expect("it is sound in its box")[0];
        (error, magnitude)
    };
    let (operations, ranges) = all_operations();
    for (graph, ranges) in [(operations, &ranges[..]), (turns(), &WIDE), (products_that_cancel(), &CANCELLING)] {
        let whole = bound(&graph, FloatFormat::of(Scalar::F32), ranges, None);
        let cut = of(&graph, ranges, None);
        assert!(cut.0 <= whole.0 && cut.1 == whole.1);
        assert!(!is_violated(&graph, ranges, cut));
    }
    // its error is greatest at the lower end, which a search with a part forgotten does not see
    let falling = program(1, |b, x| {
        let c = b.constant(Dd::ONE);
        let a = b.add(Op::sub(c, x[0]));
        b.add(Op::mul(a, a))
    });
    let fraction = [Interval::new(0.0, 0.9)];
    assert!(!is_violated(&falling, &fraction, of(&falling, &fraction, None)));
    assert!(is_violated(&falling, &fraction, of(&falling, &fraction, Some(Broken::Part))));
}

#[test]
fn one_turn_of_an_angle_stands_for_all() {
    let effort = Effort { boxes: 64, ..Effort::default() };
    let of = |graph: &Graph, ranges: &[Interval], broken: Option<Broken>| {
        let mut analysis = ErrorAnalysis::new(graph, FloatFormat::of(Scalar::F32));
        analysis.broken = broken;
        let (_, error, magnitude) =
            subdivision::bounds(&mut analysis, ranges, effort).expect("it is sound in its box")[0];
        (error, magnitude)
    };
    // (1 + sin x)²: greatest near π/2 and 5π/2, which half a turn from 3.2 does not meet
    let raised = program(1, |b, x| {
        let c = b.constant(Dd::ONE);
        let (s, _) = sin_cos(b, x[0]);
        let a = b.add(Op::add(s, c));
        b.add(Op::mul(a, a))
    });
    let turns = [Interval::new(3.2, 16.0)];
    let once = [Interval::new(3.2, 3.2 + 6.3)];
    assert_eq!(of(&raised, &turns, None).0, of(&raised, &once, None).0);
    assert!(!is_violated(&raised, &turns, of(&raised, &turns, None)));
    assert!(is_violated(&raised, &turns, of(&raised, &turns, Some(Broken::HalfTurn))));
    // x sin x does not repeat itself
    let growing = program(1, |b, x| {
        let (s, _) = sin_cos(b, x[0]);
        b.add(Op::mul(s, x[0]))
    });
    let turns = [Interval::new(0.1, 16.0)];
    assert!(!is_violated(&growing, &turns, of(&growing, &turns, None)));
    assert!(of(&growing, &turns, None).0 > 2.0 * of(&growing, &[Interval::new(0.1, 6.4)], None).0);
}

/// Results are refined by threads: which takes which changes no bit.
#[test]
fn bounds_from_boxes_are_the_same_every_time() {
    let mut graph = turns();
    let last = graph.results[0].0;
    graph.results = (8..=last)
        .map(NodeId)
        .filter(|id| matches!(graph.op(*id), Op::Binary(Binary::Add | Binary::Sub, ..)))
        .collect();
    graph.outputs = vec![Port::new("y", &[graph.results.len()])];
    let effort = Effort { boxes: 50, ..Effort::default() };
    let of = || certify(&graph, Scalar::F32, &WIDE, effort).expect("it is sound in its box");
    let first = of();
    assert!(graph.results.len() > 4);
    (0..5).for_each(|_| assert_eq!(of(), first));
}

#[test]
fn a_turned_vector_keeps_its_norm() {
    let (_, magnitude) = bound(&turns(), FloatFormat::of(Scalar::F32), &WIDE, None);
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
    let (_, magnitude) = bound(&products_that_cancel(), FloatFormat::of(Scalar::F32), &CANCELLING, None);
    // 1.8 · 0.1, and roundings of products up to 16; without cancelling 33
    assert!((0.18..0.1801).contains(&magnitude), "{magnitude}");
}

#[test]
fn what_may_be_no_number_has_no_bound() {
    let quotient = program(2, |b, x| b.add(Op::div(x[0], x[1])));
    let refused =
        |ranges: &[Interval]| ErrorAnalysis::new(&quotient, FloatFormat::of(Scalar::F32)).ranges(ranges).err();
    assert_eq!(refused(&[Interval::ONE, Interval::new(-1.0, 1.0)]), Some(super::NoCertificate::Division));
    assert_eq!(refused(&[Interval::ONE, Interval::new(0.5, 1.0)]), None);
    let huge = [Interval::point(1e30), Interval::new(1e-10, 1.0)];
    assert_eq!(refused(&huge), Some(super::NoCertificate::Overflow));
    let angle = ErrorAnalysis::new(&sine(), FloatFormat::of(Scalar::F32)).ranges(&[Interval::new(0.0, 6e4)]).err();
    assert_eq!(angle, Some(super::NoCertificate::Overflow), "beyond the domain of sine and cosine");
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
