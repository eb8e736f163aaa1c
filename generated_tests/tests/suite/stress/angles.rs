//! Angles far away and next to multiples of π/2; speeds from 1e-160 to 1e3.

use super::outcome::{Outcome, Size};
use super::precision::{equations, in_single, torque_error};
use super::robots::Judged;
use std::f64::consts::{FRAC_PI_2, TAU};
use straightline_codegen::Function;
use straightline_core::trig::{sin_cos_f32, sin_cos_f64, DOMAIN_F32, DOMAIN_F64};
use straightline_core::Dd;
use straightline_generated_tests::compiled;
use straightline_generated_tests::programs::{self, cast};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::Expected;

/// Robots whose joints all turn.
const TURNING: [&str; 4] = ["planar2r", "chapter_6r", "ur5", "panda"];

/// |computed − truth| in ulps of the truth's f64 or f32.
fn ulps(computed: f64, truth: Dd, digits: i32) -> f64 {
    let size = truth.to_f64().abs();
    let exponent = (size.to_bits() >> 52) as i32 - 1023;
    (Dd::from(computed) - truth).to_f64().abs() / f64::powi(2.0, exponent - digits + 1)
}

/// Wrong signs count as infinite.
fn kernel_error(x: f64, computed: (f64, f64), digits: i32) -> f64 {
    let truth = Dd::from(x).sin_cos();
    let of = |computed: f64, truth: Dd| match computed.is_sign_negative() == truth.to_f64().is_sign_negative() {
        true => ulps(computed, truth, digits),
        false => f64::INFINITY,
    };
    of(computed.0, truth.0).max(of(computed.1, truth.1))
}

/// A whole number other than zero, even or odd.
fn whole_number(random: &mut Random, size: f64) -> f64 {
    let whole = (2.0 * random.between(-size, size)).round();
    if whole == 0.0 {
        1.0
    } else {
        whole
    }
}

pub fn large_and_near_right_angles(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    let mut random = Random(10);
    let tries = size.pick(20_000, 5_000_000);
    let worst = |error: &mut dyn FnMut() -> f64| (0..tries).map(|_| error()).fold(0.0, f64::max);
    let far = worst(&mut || {
        let x = random.between(-1e6, 1e6);
        kernel_error(x, sin_cos_f64(x), 53)
    });
    outcomes.push(Outcome::new(10, "sine and cosine", "f64, |x| ≤ 1e6, ulp", far, 0.8));
    let far = worst(&mut || {
        let x = random.between(-1e4, 1e4) as f32;
        let (sin, cos) = sin_cos_f32(x);
        kernel_error(f64::from(x), (f64::from(sin), f64::from(cos)), 24)
    });
    outcomes.push(Outcome::new(10, "sine and cosine", "f32, |x| ≤ 1e4, ulp", far, 0.92));
    let near = worst(&mut || {
        let multiple = (whole_number(&mut random, 3e5) * FRAC_PI_2).to_bits();
        let x = f64::from_bits(multiple.wrapping_add(random.bits() % 9).wrapping_sub(4));
        kernel_error(x, sin_cos_f64(x), 53)
    });
    outcomes.push(Outcome::new(11, "sine and cosine", "f64 within 4 floats of k π/2, ulp, signs right", near, 0.8));
    let near = worst(&mut || {
        let multiple = ((whole_number(&mut random, 3e3) * FRAC_PI_2) as f32).to_bits();
        let x = f32::from_bits(multiple.wrapping_add((random.bits() % 9) as u32).wrapping_sub(4));
        let (sin, cos) = sin_cos_f32(x);
        kernel_error(f64::from(x), (f64::from(sin), f64::from(cos)), 24)
    });
    outcomes.push(Outcome::new(11, "sine and cosine", "f32 within 4 floats of k π/2, ulp, signs right", near, 0.92));

    for name in TURNING {
        let judged = Judged::new(name);
        let compiled = compiled::robot(name);
        let (function, states) = (Function::InverseDynamics, size.pick(10, 5000));
        let program = equations(&judged, function);
        let mut error = |test: usize, what: &str, turn: &mut dyn FnMut(f64, &mut Random) -> f64| {
            let mut worst = 0.0f64;
            for _ in 0..states {
                let mut inputs = judged.state(function, &mut random);
                inputs[0].iter_mut().for_each(|q| *q = turn(*q, &mut random));
                let truth = programs::run(&program, &cast(&inputs));
                let tau = compiled.call(function, &inputs);
                worst = worst.max(torque_error(&judged, &inputs, &tau, &truth, f64::EPSILON));
            }
            outcomes.push(Outcome::new(
                test,
                name,
                format!("f64 inverse dynamics, {what}, ulp of natural scale"),
                worst,
                4.0,
            ));
        };
        error(10, "q + 2πk, |q| ≤ 1e6", &mut |q, random| q + TAU * random.between(-1.59e5, 1.59e5).round());
        error(11, "q within 4 floats of k π/2", &mut |q, random| {
            let multiple = (q / FRAC_PI_2).round() * FRAC_PI_2;
            f64::from_bits(multiple.to_bits().wrapping_add(random.bits() % 5))
        });
        // beyond the domain nothing is made up
        let mut made_up = 0;
        for q in [DOMAIN_F64.next_up(), 1e9, 1e300, f64::INFINITY, f64::NAN] {
            let pose = compiled.call(Function::ForwardKinematics, &[vec![q; judged.robot.nv]]);
            made_up += pose[..3].iter().filter(|x| x.is_finite()).count();
        }
        // a coordinate that no angle enters is right at any angle: the height of a planar arm's tip
        let untouched = if name == "planar2r" { 5.0 } else { 0.0 };
        outcomes.push(Outcome::new(10, name, "positions that are no NaN beyond the domain", made_up as f64, untouched));
    }
    assert!(sin_cos_f32(DOMAIN_F32.next_up()).0.is_nan());
    outcomes
}

pub fn speeds(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for name in ["planar2r", "chapter_stanford", "panda", "solo12"] {
        let judged = Judged::new(name);
        let function = Function::InverseDynamics;
        let program = equations(&judged, function);
        let mut random = Random(12);
        for speed in [1e3, 1e-3, 1e-20, 1e-160] {
            let mut worst = 0.0f64;
            for _ in 0..size.pick(10, 2000) {
                let mut inputs = judged.state(function, &mut random);
                let n = judged.robot.nv;
                inputs[1] = random.list(n, speed);
                let truth = programs::run(&program, &cast(&inputs));
                let tau = compiled::robot(name).call(function, &inputs);
                worst = worst.max(torque_error(&judged, &inputs, &tau, &truth, f64::EPSILON));
            }
            outcomes.push(Outcome::new(
                12,
                name,
                format!("f64 inverse dynamics, |q̇| ≤ {speed:.0e}, ulp of natural scale"),
                worst,
                4.0,
            ));
        }
        // velocity forces alone scale with the square: what is left of them without gravity
        let velocity = equations(&judged, Function::VelocityForce);
        for speed in [1e3, 1e-20, 1e-100] {
            let mut worst = 0.0f64;
            for _ in 0..size.pick(10, 2000) {
                let mut inputs = judged.state(Function::VelocityForce, &mut random);
                inputs[1] = random.list(judged.robot.nv, speed);
                let truth: Vec<Dd> = programs::run(&velocity, &cast(&inputs));
                let mut expected = Expected { values: Vec::new(), scales: Vec::new() };
                expected.append_uniform(truth);
                let (error, _) = expected.worst(&compiled::robot(name).call(Function::VelocityForce, &inputs));
                worst = worst.max(error / (f64::EPSILON / 2.0));
            }
            outcomes.push(Outcome::new(
                12,
                name,
                format!("f64 velocity forces, |q̇| ≤ {speed:.0e}, u of the greatest"),
                worst,
                300.0,
            ));
        }
        let Some(single) = compiled::F32.iter().find(|c| !c.exact && c.robot == name) else { continue };
        for speed in [1e3, 1e-20, 1e-30] {
            let mut worst = 0.0f64;
            for _ in 0..size.pick(10, 2000) {
                let mut inputs = judged.state(function, &mut random);
                inputs[1] = random.list(judged.robot.nv, speed);
                let inputs = in_single(&inputs);
                let truth = programs::run(&program, &cast(&inputs));
                let tau: Vec<f64> = single.call(function, &cast::<f32>(&inputs)).into_iter().map(f64::from).collect();
                worst = worst.max(torque_error(&judged, &inputs, &tau, &truth, f64::from(f32::EPSILON)));
            }
            outcomes.push(Outcome::new(
                12,
                name,
                format!("f32 inverse dynamics, |q̇| ≤ {speed:.0e}, ulp of natural scale"),
                worst,
                4.0,
            ));
        }
    }
    outcomes
}
