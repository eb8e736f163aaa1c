//! Derivatives: dual numbers through generic functions, gradients that the compiler writes, and the certificate of one.
//!
//! Truth: differences in double-double, (8 (f(x+h) − f(x−h)) − (f(x+2h) − f(x−2h))) / (12 h) with h = 1e-6: a fifth derivative times
//! h⁴/30 is 1e-25 of it, and so are 32 digits over h. They share nothing with dual numbers and with adjoints but the program.

use super::outcome::{Outcome, Size};
use super::robots::{ranges, Judged};
use straightline::{Dual, Real};
use straightline_codegen::certify::{certify, Effort, Interval};
use straightline_codegen::expr::{evaluate, gradient, Graph};
use straightline_codegen::options::Options;
use straightline_codegen::program::input_box::input_box;
use straightline_codegen::program::program;
use straightline_codegen::scene::{InputRange as Range, JointRanges, Scene};
use straightline_codegen::{Function, Scalar};
use straightline_core::model::JointKind;
use straightline_core::Dd;
use straightline_generated_tests::compiled::generic_ur5 as ur5;
use straightline_generated_tests::programs;
use straightline_generated_tests::random::Random;

const STEP: f64 = 1e-6;

/// States that are hard to differentiate at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    Limits,
    /// Stretched, all axes of the wrist aligned, within 1e-8 rad.
    Singular,
    /// |q| ≤ 1e6 rad of joints that turn, |q̇| ≤ 1e3 rad/s.
    Far,
}

const PLACES: [(Place, &str); 3] =
    [(Place::Limits, "in limits"), (Place::Singular, "1e-8 rad from stretched"), (Place::Far, "|q| ≤ 1e6, |q̇| ≤ 1e3")];

/// Flat inputs q, q̇ and a third group of an arm.
fn state(judged: &Judged, function: Function, place: Place, random: &mut Random) -> Vec<f64> {
    let mut x = ranges(judged.model(), function).anywhere(random);
    let n = judged.robot.nv;
    match place {
        Place::Limits => {}
        Place::Singular => x[..n].iter_mut().for_each(|q| *q = random.between(-1e-8, 1e-8)),
        Place::Far => {
            let turning = judged.model().free_joints().filter(|j| j.kind == JointKind::Revolute);
            turning.for_each(|joint| x[joint.iq] = random.between(-1e6, 1e6));
            x[n..2 * n].iter_mut().for_each(|qd| *qd = random.between(-1e3, 1e3));
        }
    }
    x
}

/// All derivatives of the results by input `j`.
fn differences(graph: &Graph, x: &[f64], j: usize) -> Vec<Dd> {
    let at = |steps: f64| {
        let mut moved: Vec<Dd> = x.iter().map(|x| Dd::from(*x)).collect();
        moved[j] += Dd::from(steps) * Dd::from(STEP);
        evaluate::<Dd>(graph, &moved)
    };
    let [up, down, up2, down2] = [1.0, -1.0, 2.0, -2.0].map(at);
    let slope =
        |i: usize| (Dd::from(8.0) * (up[i] - down[i]) - (up2[i] - down2[i])) / (Dd::from(12.0) * Dd::from(STEP));
    (0..up.len()).map(slope).collect()
}

/// The greatest |computed − truth| over the greatest |truth|, in `unit`.
fn error(computed: &[f64], truth: &[Dd], unit: f64) -> f64 {
    let greatest = truth.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
    let off = computed.iter().zip(truth).map(|(c, t)| (Dd::from(*c) - *t).to_f64().abs());
    off.fold(0.0, |m: f64, e| if e.is_finite() { m.max(e) } else { f64::INFINITY }) / greatest / unit
}

type OverDual = fn(&[Dual<f64, 6>; 6], &[Dual<f64, 6>; 6], &[Dual<f64, 6>; 6], &mut [Dual<f64, 6>; 6]);

/// All derivatives by q, q̇ and q̈ or tau, group by group.
fn by_dual_numbers(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    let judged = Judged::new("ur5");
    let subjects: [(Function, OverDual, f64); 2] = [
        (Function::InverseDynamics, ur5::inverse_dynamics::<Dual<f64, 6>>, 200.0),
        (Function::ForwardDynamics, ur5::forward_dynamics::<Dual<f64, 6>>, 200.0),
    ];
    for ((function, call, bound), (place, where_)) in subjects.into_iter().flat_map(|s| PLACES.map(|p| (s, p))) {
        let graph = programs::of_robot(&judged.robot, function, &programs::options(&judged.robot)).graph;
        let mut random = Random(23);
        let mut worst = 0.0f64;
        for _ in 0..size.pick(2, 300) {
            let x = state(&judged, function, place, &mut random);
            for group in 0..3 {
                let dual: [[Dual<f64, 6>; 6]; 3] = std::array::from_fn(|g| {
                    std::array::from_fn(|k| match g == group {
                        true => Dual::variable(x[6 * g + k], k),
                        false => Dual::fixed(x[6 * g + k]),
                    })
                });
                let mut y = [Dual::zero(); 6];
                call(&dual[0], &dual[1], &dual[2], &mut y);
                let computed: Vec<f64> = (0..6).flat_map(|j| y.map(|y| y.derivatives[j])).collect();
                let truth: Vec<Dd> = (0..6).flat_map(|j| differences(&graph, &x, 6 * group + j)).collect();
                worst = worst.max(error(&computed, &truth, f64::EPSILON / 2.0));
            }
        }
        let what = format!("f64 dual numbers, {}, {where_}, u of the greatest derivative", function.name());
        outcomes.push(Outcome::new(23, "ur5", what, worst, bound));
    }
    outcomes
}

/// Σ λ_k ∂r_k/∂q for random λ, as the search of `straightline analyze` uses it.
fn by_adjoints(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    let names = size.pick(&["chapter_oblique", "ur5"][..], &["chapter_oblique", "ur5", "panda"][..]);
    for (name, (place, where_)) in names.iter().flat_map(|name| PLACES.map(|p| (name, p))) {
        let judged = Judged::new(name);
        let n = judged.robot.nv;
        for (function, bound) in [(Function::InverseDynamics, 300.0), (Function::ForwardDynamics, 2000.0)] {
            let graph = programs::of_robot(&judged.robot, function, &programs::options(&judged.robot)).graph;
            let program = gradient(&graph, "q");
            let mut random = Random(29);
            let mut worst = [0.0f64; 2];
            for _ in 0..size.pick(2, 200) {
                let x = state(&judged, function, place, &mut random);
                let x: Vec<f64> = x.into_iter().map(|x| f64::from(x as f32)).collect();
                let lambda: Vec<f64> = random.list(n, 1.0).into_iter().map(|x| f64::from(x as f32)).collect();
                let weighted = |d: Vec<Dd>| d.into_iter().zip(&lambda).fold(Dd::ZERO, |s, (d, l)| s + d * Dd::from(*l));
                let truth: Vec<Dd> = (0..n).map(|j| weighted(differences(&graph, &x, j))).collect();
                let inputs = [&x[..], &lambda].concat();
                worst[0] = worst[0].max(error(&evaluate::<f64>(&program, &inputs), &truth, f64::EPSILON / 2.0));
                // beyond the domain of f32's sines nothing is promised
                if place != Place::Far {
                    let narrow: Vec<f32> = inputs.iter().map(|x| *x as f32).collect();
                    let computed: Vec<f64> = evaluate::<f32>(&program, &narrow).into_iter().map(f64::from).collect();
                    worst[1] = worst[1].max(error(&computed, &truth, f64::from(f32::EPSILON) / 2.0));
                }
            }
            for (scalar, value) in ["f64", "f32"].into_iter().zip(worst).filter(|w| w.1 > 0.0) {
                let what = format!("{scalar} gradient of {}, {where_}, u of the greatest entry", function.name());
                outcomes.push(Outcome::new(23, *name, what, value, bound));
            }
        }
    }
    outcomes
}

/// The proven bound of every ∂tau_k/∂q_j of the Panda in f32, in the box of RoboPrec (|q̇| ≤ 0.5, |q̈| ≤ 1), and what random states give.
fn certified(size: Size) -> Vec<Outcome> {
    let judged = Judged::new("panda");
    let mut scene = Scene::default();
    scene.ranges.qd = JointRanges::All(Range::within(0.5));
    scene.ranges.qdd = JointRanges::All(Range::within(1.0));
    let options = Options { scalar: Scalar::F32, scene: scene.clone(), ..Options::default() };
    let graph = program(&judged.loaded, &[], Function::InverseDynamics, &options).graph;
    let program = gradient(&graph, "q");
    let ranges = input_box(&graph.inputs, &scene, judged.model()).expect("every input has a range");
    let (mut random, mut bound, mut nearest) = (Random(31), 0.0f64, 0.0f64);
    for k in 0..judged.robot.nv {
        let seed = (0..judged.robot.nv).map(|i| f64::from(u8::from(i == k)));
        let all: Vec<Interval> = ranges.iter().copied().chain(seed.map(|x| Interval { lo: x, hi: x })).collect();
        let certificate = certify(&program, Scalar::F32, &all, Effort::default()).expect("a program without division");
        bound = certificate.errors.iter().copied().fold(bound, f64::max);
        for _ in 0..size.pick(20, 5000) {
            let x: Vec<f32> = all.iter().map(|r| random.between(r.lo, r.hi) as f32).collect();
            let exact = evaluate::<Dd>(&program, &x.iter().map(|x| Dd::from(f64::from(*x))).collect::<Vec<_>>());
            for ((found, exact), bound) in evaluate::<f32>(&program, &x).iter().zip(exact).zip(&certificate.errors) {
                nearest = nearest.max((Dd::from(f64::from(*found)) - exact).to_f64().abs() / bound);
            }
        }
    }
    let line = |what: &str, value: f64, bound: f64| Outcome::new(23, "panda", what, value, bound);
    vec![
        line("f32 ∂tau/∂q, |q̇| ≤ 0.5, |q̈| ≤ 1: greatest certified bound of an entry, N·m/rad", bound, 2e-3),
        line("the same: greatest error of random states over its bound", nearest, 1.0),
    ]
}

pub fn derivatives(size: Size) -> Vec<Outcome> {
    [by_dual_numbers(size), by_adjoints(size), certified(size)].concat()
}
