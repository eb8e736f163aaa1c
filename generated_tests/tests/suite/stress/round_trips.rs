//! Inverse and forward dynamics against each other and against truth: the compiled functions of all robots.

use super::outcome::{Outcome, Size};
use super::robots::Judged;
use straightline_codegen::Function;
use straightline_core::reference::forward_natural_scale;
use straightline_core::Dd;
use straightline_generated_tests::compiled;
use straightline_generated_tests::programs::{self, cast};
use straightline_generated_tests::random::Random;

const U: f64 = f64::EPSILON / 2.0;

fn robots(size: Size) -> Vec<Judged> {
    let names = compiled::all_rules().map(|c| c.robot);
    let large = ["simple_humanoid", "hyq"];
    names.filter(|name| size == Size::Full || !large.contains(name)).map(Judged::new).collect()
}

pub fn inverse_then_forward(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for judged in robots(size) {
        let (name, compiled) = (&judged.robot.name, compiled::robot(&judged.robot.name));
        let exact = programs::of_robot(&judged.robot, Function::ForwardDynamics, &programs::options(&judged.robot));
        let mut random = Random(judged.robot.nv as u64);
        let (mut back, mut forward, mut relative) = (0.0f64, 0.0f64, 0.0f64);
        for _ in 0..size.pick(3, 200) {
            let inputs = judged.state(Function::InverseDynamics, &mut random);
            let tau = compiled.call(Function::InverseDynamics, &inputs);
            let [q, qd, qdd] = <[Vec<f64>; 3]>::try_from(inputs).expect("three groups");
            let scale = forward_natural_scale(&judged.tree, &q, &qd, &tau);
            let inputs = [q, qd, tau];
            let computed = compiled.call(Function::ForwardDynamics, &inputs);
            let truth: Vec<Dd> = programs::run(&exact, &cast::<Dd>(&inputs));
            let greatest = truth.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
            for i in 0..computed.len() {
                let error = (Dd::from(computed[i]) - truth[i]).to_f64().abs();
                back = back.max((computed[i] - qdd[i]).abs() / scale[i] / U);
                forward = forward.max(error / scale[i] / U);
                relative = relative.max(error / greatest);
            }
        }
        outcomes.push(Outcome::new(1, name, "f64 q̈ → tau → q̈, u of natural scale", back, 10.0));
        outcomes.push(Outcome::new(2, name, "f64 forward dynamics, u of natural scale", forward, 10.0));
        outcomes.push(Outcome::new(2, name, "f64 forward dynamics, of q̈", relative, 1e-10));
    }
    outcomes
}

pub fn gravity_compensation(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for judged in robots(size) {
        let (name, compiled) = (&judged.robot.name, compiled::robot(&judged.robot.name));
        let mut random = Random(3);
        let mut worst = 0.0f64;
        for _ in 0..size.pick(5, 1000) {
            let q = judged.state(Function::GravityForce, &mut random).remove(0);
            let g = compiled.call(Function::GravityForce, std::slice::from_ref(&q));
            let rest = vec![0.0; judged.robot.nv];
            let qdd = compiled.call(Function::ForwardDynamics, &[q, rest, g]);
            worst = qdd.iter().fold(worst, |m, x| if x.is_nan() { f64::INFINITY } else { m.max(x.abs()) });
        }
        outcomes.push(Outcome::new(3, name, "f64 |q̈| under tau = g(q), rad/s² or m/s²", worst, 1e-10));
    }
    outcomes
}
