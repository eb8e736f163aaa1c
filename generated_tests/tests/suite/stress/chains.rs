//! Chains: long, stretched, folded, with light and heavy tips, with axes that are nearly parallel.
//!
//! Forward errors of the generic runtime, which the generated code equals under exact rules bit for bit.

use super::outcome::{Outcome, Size};
use super::robots::{chain, file, rounded_model, Link, AXES};
use straightline_codegen::equations::forward_method::MethodFigures;
use straightline_codegen::expr::evaluate;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::Function;
use straightline_core::algorithms::{forward_dynamics_aba, forward_dynamics_ltdl, inverse_dynamics};
use straightline_core::model::Model;
use straightline_core::{Dd, Real};
use straightline_generated_tests::programs::load;
use straightline_generated_tests::random::Random;

/// Where the joints of a chain stand.
#[derive(Clone, Copy, Debug)]
enum Pose {
    Anywhere,
    /// Within 0.01 rad of stretched.
    Stretched,
    /// Within 0.01 rad of folded.
    Folded,
}

/// The worst errors of some states, relative to the greatest |q̈|, or for `inverse` to the greatest |tau|, in units u.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    articulated: f64,
    factorised: f64,
    inverse: f64,
}

fn errors<T: Real + Into<f64>>(model: &Model<Dd>, pose: Pose, states: usize, unit: f64) -> Errors {
    let (narrow, wide) = rounded_model::<T>(model);
    let n = model.nv();
    let mut random = Random(n as u64);
    let mut worst = Errors::default();
    let narrowed = |v: &[f64]| -> Vec<T> { v.iter().map(|x| T::constant(Dd::from(*x))).collect() };
    let widened = |v: &[T]| -> Vec<Dd> { v.iter().map(|x| Dd::from((*x).into())).collect() };
    let error = |computed: Vec<T>, truth: Vec<Dd>| {
        let scale = truth.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        let worst = computed.into_iter().zip(truth).map(|(a, b)| (Dd::from(a.into()) - b).to_f64().abs());
        worst.fold(0.0, |m: f64, e| if e.is_finite() { m.max(e) } else { f64::INFINITY }) / scale / unit
    };
    for _ in 0..states {
        let q: Vec<f64> = (0..n)
            .map(|_| match pose {
                Pose::Anywhere => random.between(-3.0, 3.0),
                Pose::Stretched => random.between(-0.01, 0.01),
                Pose::Folded => std::f64::consts::PI + random.between(-0.01, 0.01),
            })
            .collect();
        let (q, qd, qdd) = (narrowed(&q), narrowed(&random.list(n, 1.0)), narrowed(&random.list(n, 3.0)));
        // drives too weak to hold the chain: it swings, as in a simulation
        let tau = narrowed(&random.list(n, 10.0));
        let (wide_q, wide_qd) = (widened(&q), widened(&qd));
        let truth = inverse_dynamics(&wide, &wide_q, &wide_qd, &widened(&qdd));
        worst.inverse = worst.inverse.max(error(inverse_dynamics(&narrow, &q, &qd, &qdd), truth));
        let wide_tau = widened(&tau);
        let articulated = forward_dynamics_aba(&wide, &wide_q, &wide_qd, &wide_tau);
        worst.articulated = worst.articulated.max(error(forward_dynamics_aba(&narrow, &q, &qd, &tau), articulated));
        let factorised = forward_dynamics_ltdl(&wide, &wide_q, &wide_qd, &wide_tau);
        worst.factorised = worst.factorised.max(error(forward_dynamics_ltdl(&narrow, &q, &qd, &tau), factorised));
    }
    worst
}

/// u of f64 and f32.
const UNITS: [f64; 2] = [f64::EPSILON / 2.0, f32::EPSILON as f64 / 2.0];

/// Errors in f64 and in f32.
fn both(model: &Model<Dd>, pose: Pose, states: usize) -> [(&'static str, Errors); 2] {
    [("f64", errors::<f64>(model, pose, states, UNITS[0])), ("f32", errors::<f32>(model, pose, states, UNITS[1]))]
}

/// Rods about x, y and z in turn.
fn spatial(n: usize) -> Model<Dd> {
    let links: Vec<Link> = (0..n).map(|i| Link::rod(1.0).about(AXES[i % 3])).collect();
    chain(&links)
}

fn lengths(size: Size) -> &'static [usize] {
    size.pick(&[2, 8, 16][..], &[2, 4, 8, 16, 32, 64, 128, 256][..])
}

/// What articulated bodies may lose on n links at random: the bias force's own rounding, n² levers, passes through them.
fn articulated_bound(n: usize) -> f64 {
    200.0 + (n * n) as f64
}

pub fn uniform(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for &n in lengths(size) {
        let states = size.pick(3, if n > 64 { 3 } else { 20 });
        for (scalar, e) in both(&spatial(n), Pose::Anywhere, states) {
            let robot = format!("spatial chain, {n} joints");
            let bound = articulated_bound(n);
            let line =
                |what: &str, value, bound| Outcome::new(4, &robot, format!("{scalar} {what}, u of q̈"), value, bound);
            outcomes.push(line("articulated bodies", e.articulated, bound));
            outcomes.push(line("factorisation", e.factorised, 800.0 + 4.0 * (n as f64).powi(3)));
            outcomes.push(Outcome::new(
                4,
                &robot,
                format!("{scalar} inverse dynamics, u of tau"),
                e.inverse,
                10.0 + n as f64,
            ));
        }
    }
    outcomes
}

pub fn stretched_and_folded(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for &n in size.pick(&[3, 8][..], &[3, 8, 16, 32, 64][..]) {
        let planar = chain(&vec![Link::rod(1.0); n]);
        for (pose, name) in [(Pose::Stretched, "stretched"), (Pose::Folded, "folded")] {
            for (scalar, e) in both(&planar, pose, size.pick(3, 20)) {
                let robot = format!("{name} planar chain, {n} joints");
                let line = |what: &str, value, bound| {
                    Outcome::new(5, &robot, format!("{scalar} {what}, u of q̈"), value, bound)
                };
                outcomes.push(line("articulated bodies", e.articulated, 10.0 * (n + 8) as f64));
                // Featherstone 2004: the condition of H is of order n⁴
                let condition = (n as f64).powi(4);
                outcomes.push(line("factorisation", e.factorised, 100.0 * condition));
            }
        }
    }
    for &n in size.pick(&[8][..], &[3, 8, 16, 24][..]) {
        outcomes.push(chosen(n, size.pick(3, 20)));
    }
    outcomes
}

/// What the generated program of a stretched chain loses, whichever form the compiler chose: it says which, and why.
fn chosen(n: usize, states: usize) -> Outcome {
    let robot = load(&file(&vec![Link::rod(1.0); n]), &ModelOptions::default());
    let options = Options::default();
    let program = program(&robot, &[], Function::ForwardDynamics, &options);
    let method = program.method.expect("the choice is the compiler's");
    let (mut random, mut worst) = (Random(n as u64), 0.0f64);
    for _ in 0..states {
        let q = (0..n).map(|_| random.between(-0.01, 0.01)).collect();
        let inputs: Vec<f64> = [q, random.list(n, 1.0), random.list(n, 10.0)].concat();
        let truth = evaluate(&program.graph, &inputs.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
        let scale = truth.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        for (x, t) in evaluate(&program.graph, &inputs).into_iter().zip(truth) {
            let error = (Dd::from(x) - t).to_f64().abs() / scale / UNITS[0];
            worst = if error.is_finite() { worst.max(error) } else { f64::INFINITY };
        }
    }
    let form = if method.articulated_bodies { "articulated bodies" } else { "the factorisation" };
    let errors = |f: MethodFigures| f.error.map_or("not tried".to_string(), |e| format!("{:.0} u", e / UNITS[0]));
    let other = match method.factorisation {
        Some(factorisation) => {
            format!("worst seen {}, of the factorisation {}", errors(method.articulated), errors(factorisation))
        }
        None => "the other is not tried on so many joints".to_string(),
    };
    let what = format!("f64 generated, by {form} ({other}), u of q̈");
    // the factorisation may lose three times what articulated bodies do
    Outcome::new(5, format!("stretched planar chain, {n} joints"), what, worst, 3.0 * 10.0 * (n + 8) as f64)
}

pub fn light_tips(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    let ratios = size.pick(&[0.03125][..], &[0.5, 0.125, 0.03125][..]);
    for &ratio in ratios {
        let links: Vec<Link> =
            (0..8).map(|i| Link::rod(1.0).about(AXES[i % 3]).times(f64::powi(ratio, i as i32))).collect();
        for (scalar, e) in both(&chain(&links), Pose::Anywhere, size.pick(5, 100)) {
            let robot = format!("8 links, each {ratio} of the one before: tip {:.0e}", f64::powi(ratio, 7));
            for (what, value) in [("articulated bodies", e.articulated), ("factorisation", e.factorised)] {
                outcomes.push(Outcome::new(6, &robot, format!("{scalar} {what}, u of q̈"), value, 1000.0));
            }
        }
    }
    outcomes
}

pub fn heavy_tips(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for exponent in size.pick(vec![3, 6], vec![1, 2, 3, 4, 5, 6]) {
        let factor = f64::powi(10.0, exponent);
        let mut links: Vec<Link> = (0..6).map(|i| Link::rod(1.0).about(AXES[i % 3])).collect();
        links[5] = links[5].clone().times(factor);
        for (scalar, e) in both(&chain(&links), Pose::Anywhere, size.pick(5, 100)) {
            let robot = format!("6 links, tip 1e{exponent} times heavier");
            // tau is rounded relative to the tip's weight, and the light links feel that: u times the ratio is the problem's
            let bound = 300.0 * factor;
            for (what, value) in [("articulated bodies", e.articulated), ("factorisation", e.factorised)] {
                outcomes.push(Outcome::new(7, &robot, format!("{scalar} {what}, u of q̈"), value, bound));
            }
            let lost = format!("{scalar} digits lost by articulated bodies");
            outcomes.push(Outcome::new(7, &robot, lost, e.articulated.max(1.0).log10(), bound.log10()));
        }
    }
    outcomes
}

pub fn nearly_parallel_axes(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for exponent in size.pick(vec![4, 12], vec![1, 2, 4, 6, 8, 10, 12, 15]) {
        let tilt = f64::powi(10.0, -exponent);
        let links: Vec<Link> =
            (0..6).map(|i| Link::rod(1.0).about([if i % 2 == 0 { tilt } else { -tilt }, tilt, 1.0])).collect();
        // a wrist whose first and last axes nearly meet again
        let mut wrist: Vec<Link> = (0..6).map(|i| Link::rod(1.0).about(AXES[i % 2])).collect();
        wrist[4].offset = [0.0; 3];
        wrist[5] = wrist[5].clone().about([tilt, 1.0, tilt]);
        wrist[5].offset = [0.0; 3];
        for (links, name) in [(links, "6 axes"), (wrist, "wrist")] {
            for (scalar, e) in both(&chain(&links), Pose::Anywhere, size.pick(4, 100)) {
                let robot = format!("{name}, 1e-{exponent} rad from parallel");
                outcomes.push(Outcome::new(9, &robot, format!("{scalar} inverse dynamics, u of tau"), e.inverse, 30.0));
                outcomes.push(Outcome::new(
                    9,
                    &robot,
                    format!("{scalar} articulated bodies, u of q̈"),
                    e.articulated,
                    3000.0,
                ));
            }
        }
    }
    outcomes
}
