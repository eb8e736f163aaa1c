//! Bounds at the state at hand: they hold, and without one of their parts they do not.

use super::super::columns::{self, ColumnSystem, MASS_MATRIX};
use super::super::companion;
use super::super::residual::{bound_of, OUTPUTS};
use super::super::running::{BrokenProof, Running};
use super::super::search::{computed_at, errors_at, worst_found};
use super::super::{FloatFormat, Interval};
use super::{products_that_cancel, program, sine, square_of_sum, sum_of_two, tenth, turns, CANCELLING, WIDE};
use crate::expr::{Binary, Graph, GraphBuilder, NodeId, Op, Port, RuleSet};
use crate::number::Scalar;
use straightline_core::Dd;

/// Whether the bound at the state where a search finds the worst error lies below that error.
fn is_violated_at_a_state(graph: &Graph, ranges: &[Interval], format: FloatFormat) -> bool {
    let bound = companion::bound_of(Running::new(graph.inputs.clone(), format), graph).expect("the program is short");
    let found = worst_found(graph, Scalar::F32, ranges, 20_000, 3).remove(0);
    found.error > computed_at(&bound, Scalar::F32, &found.inputs)[0]
}

#[test]
fn a_bound_at_a_state_holds_and_with_broken_numbers_does_not() {
    let format = FloatFormat::of(Scalar::F32);
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
    assert!(is_violated_at_a_state(&sum_of_two(), &unit, FloatFormat { u: 0.5 * format.u, ..format }), "rounding");
    assert!(is_violated_at_a_state(&sine(), &unit[..1], FloatFormat { trig_ulps: 0.3, ..format }), "sine");
}

/// 1/(x₀ x₁ − x₂ x₃) x₄.
fn quotient() -> Graph {
    program(5, |b, x| {
        let (p, q) = (b.add(Op::mul(x[0], x[1])), b.add(Op::mul(x[2], x[3])));
        let divisor = b.add(Op::sub(p, q));
        b.add(Op::div(x[4], divisor))
    })
}

/// Of one coordinate with one rigid contact: H = x₀ x₁ − x₂ x₃, J = x₄ x₅ − x₆ x₇, forces x₈ and a bias x₉.
fn one_coordinate() -> Graph {
    let ports = vec![Port::new("x", &[10]), Port::new("qdd", &[1]), Port::new("force", &[1])];
    let mut b = GraphBuilder::new(RuleSet::all(), ports);
    let x: Vec<NodeId> = (0..12).map(|k| b.insert(Op::Input(k))).collect();
    let mut difference = |k: usize| {
        let (p, q) = (b.add(Op::mul(x[k], x[k + 1])), b.add(Op::mul(x[k + 2], x[k + 3])));
        b.add(Op::sub(p, q))
    };
    let (h, j) = (difference(0), difference(4));
    let (inertia, reaction, response) = (b.add(Op::mul(h, x[10])), b.add(Op::mul(j, x[11])), b.add(Op::mul(j, x[10])));
    let driven = b.add(Op::add(x[8], reaction));
    let residual = b.add(Op::sub(driven, inertia));
    let sdd = b.add(Op::add(response, x[9]));
    let (missing, zero) = (b.add(Op::neg(sdd)), b.constant(Dd::ZERO));
    let outputs = OUTPUTS.iter().map(|name| Port::new(name, if *name == "h" { &[1, 1] } else { &[1] })).collect();
    b.finish(outputs, vec![residual, missing, h, j, j, zero])
}

/// Of one coordinate: H = x₀ x₁ − x₂ x₃, H q̈ = x₈, and H x + (x₄ x₅ − x₆ x₇) q̈ = 0.
fn one_column() -> ColumnSystem {
    let ports = vec![Port::new("x", &[9]), Port::new("qdd", &[1]), Port::new("dqdd_dq", &[1, 1])];
    let mut b = GraphBuilder::new(RuleSet::all(), ports);
    let x: Vec<NodeId> = (0..11).map(|k| b.insert(Op::Input(k))).collect();
    let mut difference = |k: usize| {
        let (p, q) = (b.add(Op::mul(x[k], x[k + 1])), b.add(Op::mul(x[k + 2], x[k + 3])));
        b.add(Op::sub(p, q))
    };
    let (h, k) = (difference(0), difference(4));
    let (inertia, slope, driven) = (b.add(Op::mul(h, x[9])), b.add(Op::mul(h, x[10])), b.add(Op::mul(k, x[9])));
    let (of_acceleration, of_slope) = (b.add(Op::sub(inertia, x[8])), b.add(Op::add(slope, driven)));
    let outputs = vec![Port::new("qdd", &[1]), Port::new("dqdd_dq", &[1, 1]), Port::new(MASS_MATRIX, &[1, 1])];
    let graph = b.finish(outputs, vec![of_acceleration, of_slope, h]);
    ColumnSystem { graph, columns: vec![vec![0], vec![1]], finds_accelerations: true }
}

/// Whether a bound of q̈ or of its derivative lies below an error, at states where H is a difference of nearly equal numbers.
fn is_violated_by_columns(broken: Option<BrokenProof>) -> bool {
    let system = one_column();
    let mut p = Running::new(system.graph.inputs.clone(), FloatFormat::of(Scalar::F32));
    p.broken = broken;
    let bound = columns::bound_of(p, &system).expect("the program is short");
    let mut random = straightline_core::random::Random(1);
    let single = |x: f64| f64::from(x as f32);
    let (mut violated, mut proven) = (false, 0);
    for k in 0..3000 {
        let near = 0.1f64.powi(k % 5);
        let mut pair = || {
            let [a, b, c] = [0; 3].map(|_| single(1.0 + random.unit()));
            [a, b, c, single(a * b / c * (1.0 - near * random.unit()))]
        };
        let state = [&pair()[..], &pair()[..], &[single(random.unit())]].concat();
        let of = |qdd: Dd, slope: Dd| {
            let exact: Vec<Dd> = state.iter().map(|x| Dd::from(*x)).chain([qdd, slope]).collect();
            crate::expr::evaluate::<Dd>(&system.graph, &exact)
        };
        let h = of(Dd::ZERO, Dd::ZERO)[2];
        if h.to_f64() <= 0.0 {
            continue;
        }
        let qdd = -of(Dd::ZERO, Dd::ZERO)[0] / h;
        let slope = -of(qdd, Dd::ZERO)[1] / h;
        let wrong = Dd::from([0.0, 0.5][k as usize / 5 % 2]);
        // the derivative that belongs to a wrong acceleration, or is wrong by itself
        let candidate = match k as usize / 10 % 2 {
            0 => [qdd + wrong, -of(qdd + wrong, Dd::ZERO)[1] / h],
            _ => [qdd, slope + wrong],
        };
        let candidate = candidate.map(|x| single(x.to_f64()));
        let bounds = computed_at(&bound, Scalar::F32, &[&state[..], &candidate].concat());
        let errors = [qdd, slope].into_iter().zip(candidate).map(|(t, c)| (t - Dd::from(c)).to_f64().abs());
        violated |= errors.zip(&bounds).any(|(e, bound)| e > *bound);
        proven += usize::from(bounds.iter().all(|b| !b.is_nan()));
    }
    assert!(proven > 1000, "{proven}");
    violated
}

#[test]
fn bounds_of_columns_hold_and_without_one_of_their_parts_do_not() {
    assert!(!is_violated_by_columns(None));
    for broken in [BrokenProof::Residual, BrokenProof::Accelerations] {
        assert!(is_violated_by_columns(Some(broken)), "{broken:?}");
    }
}

/// Whether a bound of q̈ or F lies below an error, at states where H and J are differences of nearly equal numbers.
fn is_violated_by_solutions(broken: Option<BrokenProof>) -> bool {
    let system = one_coordinate();
    let mut p = Running::new(system.inputs.clone(), FloatFormat::of(Scalar::F32));
    p.broken = broken;
    let bound = bound_of(p, &system, &[false]).expect("the program is short");
    let mut seed = 1u64;
    let mut unit = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f64 / f64::from(1 << 24)
    };
    let single = |x: f64| f64::from(x as f32);
    let (mut violated, mut proven) = (false, 0);
    for k in 0..3000 {
        // from nothing to all but the last digits
        let near = 0.1f64.powi(k % 5);
        let mut pair = |sign: f64| {
            let (a, b) = (1.0 + unit(), 1.0 + unit());
            let c = 1.0 + unit();
            [single(a), single(b), single(c), single(a * b / c * (1.0 - sign * near * unit()))]
        };
        let state = [&pair(1.0)[..], &pair(1.0)[..], &[single(unit()), single(unit())]].concat();
        let mut exact: Vec<Dd> = state.iter().map(|x| Dd::from(*x)).collect();
        exact.extend([Dd::ZERO; 2]);
        let values = crate::expr::evaluate::<Dd>(&system, &exact);
        // J q̈ = missing, H q̈ = residual + J F
        let (h, j) = (values[2], values[3]);
        if h.to_f64() <= 0.0 || j.to_f64() == 0.0 {
            continue;
        }
        let qdd = values[1] / j;
        let force = (h * qdd - values[0]) / j;
        let wrong = Dd::from([0.0, 0.5][k as usize / 5 % 2]);
        // a reaction that is wrong, and the acceleration that belongs to it; or no solution at all
        let candidate = match k as usize / 10 % 2 {
            0 => [qdd + wrong * j / h, force + wrong].map(|x| single(x.to_f64())),
            _ => [0.0; 2],
        };
        let inputs = [&state[..], &candidate].concat();
        let bounds = computed_at(&bound, Scalar::F32, &inputs);
        let errors = [qdd, force].into_iter().zip(candidate).map(|(t, c)| (t - Dd::from(c)).to_f64().abs());
        violated |= errors.zip(&bounds).any(|(e, bound)| e > *bound);
        proven += usize::from(bounds.iter().all(|b| !b.is_nan()));
    }
    assert!(proven > 1000, "{proven}");
    violated
}

#[test]
fn bounds_of_solutions_hold_and_without_one_of_their_parts_do_not() {
    assert!(!is_violated_by_solutions(None));
    for broken in [BrokenProof::Residual, BrokenProof::MassMatrix, BrokenProof::Jacobian, BrokenProof::Reactions] {
        assert!(is_violated_by_solutions(Some(broken)), "{broken:?}");
    }
}

#[test]
fn quotients_roots_and_signs_have_bounds_at_a_state_or_none() {
    let format = FloatFormat::of(Scalar::F32);
    let ranges = [1.0, 1.0, 1.0, 1.0, 1.0].map(|x| Interval::new(x, x + 0.01));
    let holds = |graph: &Graph, broken: Option<BrokenProof>| {
        let mut p = Running::new(graph.inputs.clone(), format);
        p.broken = broken;
        let bound = companion::bound_of(p, graph).expect("the program is short");
        let count = graph.inputs[0].len();
        let mut random = worst_found(graph, Scalar::F32, &ranges[..count], 3_000, 1);
        for seed in 2..200 {
            random.extend(worst_found(graph, Scalar::F32, &ranges[..count], 20, seed));
        }
        random.iter().all(|found| {
            let (error, bound) =
                (errors_at(graph, Scalar::F32, &found.inputs)[0], computed_at(&bound, Scalar::F32, &found.inputs)[0]);
            bound.is_nan() || error.is_nan() || error <= bound
        })
    };
    assert!(holds(&quotient(), None));
    assert!(!holds(&quotient(), Some(BrokenProof::Divisor)));
    let root = program(2, |b, x| {
        let difference = b.add(Op::sub(x[0], x[1]));
        let square = b.add(Op::mul(difference, x[0]));
        b.add(Op::sqrt(square))
    });
    assert!(holds(&root, None));
    // at a zero that may as well be none
    let bound = companion::bound_of(Running::new(quotient().inputs, format), &quotient()).expect("it is short");
    let third = f64::from(1.0f32 / 3.0);
    assert!(computed_at(&bound, Scalar::F32, &[third, third, third, third, 1.0])[0].is_nan());
    let sign = program(4, |b, x| {
        let (p, q) = (b.add(Op::mul(x[0], x[1])), b.add(Op::mul(x[2], x[3])));
        let difference = b.add(Op::sub(p, q));
        b.add(Op::sign(difference))
    });
    let bound = companion::bound_of(Running::new(sign.inputs.clone(), format), &sign).expect("it is short");
    assert!(computed_at(&bound, Scalar::F32, &[third, third, third, third])[0].is_nan());
    assert_eq!(computed_at(&bound, Scalar::F32, &[2.0, third, third, third])[0], 0.0);
}

/// What fuses products with sums, as machines with one instruction for that may, keeps to the bound that allows for other bits.
#[test]
fn fused_sums_keep_to_the_bound_for_other_bits() {
    let graph = turns();
    let p = Running::of_other_bits(graph.inputs.clone(), FloatFormat::of(Scalar::F32), FloatFormat::of(Scalar::F32));
    let bound = companion::bound_of(p, &graph).expect("the program is short");
    for seed in 0..200 {
        let found = worst_found(&graph, Scalar::F32, &WIDE, 20, seed).remove(0);
        let inputs: Vec<f32> = found.inputs.iter().map(|x| *x as f32).collect();
        // products of f32 are exact in f64, and the sum is rounded once
        let mut values: Vec<f64> = Vec::new();
        for op in &graph.ops {
            let product = |a: NodeId| match graph.op(a) {
                Op::Binary(Binary::Mul, x, y) => values[x.index()] * values[y.index()],
                _ => values[a.index()],
            };
            let v = |a: NodeId| values[a.index()];
            let halves = |pair: NodeId| match graph.op(pair) {
                Op::SinCos(a) => straightline_core::Real::sin_cos(v(a) as f32),
                _ => unreachable!("halves belong to pairs"),
            };
            let x = match *op {
                Op::Input(k) => f64::from(inputs[k as usize]),
                Op::Binary(Binary::Mul, a, b) => f64::from(v(a) as f32 * v(b) as f32),
                Op::Binary(Binary::Add, a, b) => f64::from((product(a) + v(b)) as f32),
                Op::Binary(Binary::Sub, a, b) => f64::from((product(a) - v(b)) as f32),
                Op::SinCos(_) => 0.0,
                Op::Sin(pair) => f64::from(halves(pair).0),
                Op::Cos(pair) => f64::from(halves(pair).1),
                _ => unreachable!("turns have no other operations"),
            };
            values.push(x);
        }
        let exact: Vec<Dd> = found.inputs.iter().map(|x| Dd::from(*x)).collect();
        let truth = crate::expr::evaluate::<Dd>(&graph, &exact)[0];
        let error = (Dd::from(values[graph.results[0].index()]) - truth).to_f64().abs();
        let bound = computed_at(&bound, Scalar::F32, &found.inputs)[0];
        assert!(error <= bound, "{error:e} > {bound:e} at {:?}", found.inputs);
    }
}
