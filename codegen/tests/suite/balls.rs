//! Robots with ball joints: programs, run operation by operation in f64, beside data with 25 digits; all other functions beside the second author; what a
//! ball joint costs beside three revolute joints.

use crate::data::{inputs, numbers, reference_file};
use serde_json::Value;
use std::collections::BTreeMap;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::evaluate;
use straightline_codegen::function::Quantity;
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::program::checked;
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, Function};
use straightline_core::Dd;

/// Files with their robots' rotations as angles of f64: up to a rounding those of the data.
const ROBOTS: [(&str, &str); 3] = [
    ("ball_pendulum", include_str!("../files/ball_pendulum.toml")),
    ("ball_chain", include_str!("../files/ball_chain.toml")),
    ("ball_float", include_str!("../files/ball_float.toml")),
];

fn json(path: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(reference_file(path)).expect("the data")).expect("JSON")
}

fn robot(name: &str, text: &str) -> Robot {
    let source = Source::new(&format!("{name}.toml"), text);
    let (model, said): (_, Diagnostics) = model::load(&source, &ModelOptions::default());
    Robot::new(model.unwrap_or_else(|| panic!("{}", said.render())))
}

/// What is expected of a function, and against what errors are judged; the name of its baseline.
fn expected(
    function: Function,
    state: &Value,
    frames: &[String],
    most_potential: f64,
) -> Vec<(&'static str, Vec<Dd>, Vec<f64>)> {
    let scaled = |name, field: &str, of: &str| {
        let scale = numbers(&state["scale"][of]).iter().map(|x| x.to_f64()).collect();
        vec![(name, numbers(&state[field]), scale)]
    };
    let whole = |name: &'static str, values: Vec<Dd>| {
        let size = values.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        (name, values.clone(), vec![size; values.len()])
    };
    let of_frames = |parts: &[(&'static str, &str)]| {
        let parts = frames.iter().flat_map(|frame| parts.iter().map(move |part| (frame, part)));
        parts.map(|(frame, part)| whole(part.0, numbers(&state["frames"][frame.as_str()][part.1]))).collect()
    };
    match function {
        Function::InverseDynamics => scaled("inverse_dynamics", "tau", "tau"),
        Function::BiasForce => scaled("bias_force", "h", "h"),
        Function::GravityForce => scaled("gravity_force", "g", "g"),
        Function::VelocityForce => scaled("velocity_force", "C", "C"),
        Function::ForwardDynamics => scaled("forward_dynamics", "fd_qdd", "fd"),
        Function::MassMatrix => {
            let h = numbers(&state["H"]);
            let n = h.len().isqrt();
            let diagonal = |i: usize| h[i * (n + 1)].to_f64();
            let bounds = (0..n * n).map(|k| (diagonal(k / n) * diagonal(k % n)).sqrt()).collect();
            vec![("mass_matrix", h, bounds)]
        }
        Function::Energy => {
            let both = vec![numbers(&state["T"])[0], numbers(&state["V"])[0]];
            let scales = vec![both[0].to_f64(), most_potential];
            vec![("energy", both, scales)]
        }
        Function::JointWrenches => {
            state["wrench"].as_array().expect("a list").iter().map(|six| whole("wrench", numbers(six))).collect()
        }
        Function::ForwardKinematics => of_frames(&[("frame_position", "p"), ("frame_rotation", "R")]),
        Function::Jacobian => of_frames(&[("frame_jacobian", "J")]),
        Function::JacobianBias => of_frames(&[("frame_jdqd", "Jdqd")]),
        Function::InverseDynamicsDerivatives if !state["dtau_dq"].is_null() => {
            ["dtau_dq", "dtau_dqd"].map(|field| whole("derivatives", numbers(&state[field]))).to_vec()
        }
        _ => Vec::new(),
    }
}

const FUNCTIONS: [Function; 12] = [
    Function::InverseDynamics,
    Function::BiasForce,
    Function::GravityForce,
    Function::VelocityForce,
    Function::ForwardDynamics,
    Function::MassMatrix,
    Function::Energy,
    Function::JointWrenches,
    Function::ForwardKinematics,
    Function::Jacobian,
    Function::JacobianBias,
    Function::InverseDynamicsDerivatives,
];

/// Twenty times what a straightforward evaluation of the data's own numbers loses, or 1e-14 of the scale.
#[test]
fn programs_of_robots_with_balls_lose_a_few_roundings_beside_the_data() {
    let baseline = json("joints/baseline_float.json");
    let mut worst: BTreeMap<(&str, &str), (f64, String)> = BTreeMap::new();
    for (name, text) in ROBOTS {
        let (robot, file) = (robot(name, text), json(&format!("joints/states/{name}.json")));
        let frames: Vec<String> =
            file["frames"].as_array().expect("a list").iter().map(|x| x.as_str().expect("a name").into()).collect();
        let states = || file["states"].as_array().expect("a list").iter();
        let most_potential = states().map(|state| numbers(&state["V"])[0].to_f64().abs()).fold(0.0, f64::max);
        for function in FUNCTIONS {
            let program =
                checked(&robot, &frames, function, &Options::default()).unwrap_or_else(|wrong| panic!("{wrong}"));
            assert!(program.plainer.is_none(), "{} of {name} is in a plainer form", function.name());
            // in the gravity of the file
            for state in states().filter(|state| state["gravity"].is_null()) {
                let of = |quantity: &Quantity| match quantity {
                    Quantity::Configuration => inputs(&state["q"]),
                    Quantity::Velocity => inputs(&state["qd"]),
                    Quantity::Acceleration => inputs(&state["qdd"]),
                    Quantity::Force => inputs(&state["fd_tau"]),
                    other => panic!("the data hold no {other:?}"),
                };
                let given: Vec<f64> = function.spec().inputs.iter().flat_map(of).map(Dd::to_f64).collect();
                let mut found = evaluate(&program.graph, &given).into_iter();
                for (output, values, scales) in expected(function, state, &frames, most_potential) {
                    for ((expected, scale), found) in values.iter().zip(scales).zip(&mut found) {
                        let error = (Dd::from(found) - *expected).abs().to_f64();
                        let error = if error == 0.0 { 0.0 } else { error / scale };
                        let entry = worst.entry((name, output)).or_default();
                        if error.is_nan() || error > entry.0 {
                            *entry = (error, format!("{} {}", state["id"], state["kind"]));
                        }
                    }
                }
            }
        }
    }
    for ((robot, output), (error, state)) in &worst {
        println!("{robot:14} {output:18} {error:8.1e}  {state}");
        let most = 20.0 * baseline["robots"][robot][output]["scaled"].as_f64().unwrap_or(0.0);
        assert!(*error <= most.max(1e-14), "{output} of {robot}: {error:e} of the scale in {state}");
    }
    assert_eq!(worst.len(), 3 * 13);
}

#[test]
fn all_functions_of_robots_with_balls_are_the_second_authors() {
    // a chain is a slow proof
    verified(&ROBOTS[..1]);
}

#[test]
#[ignore = "slow proof: all functions of three robots"]
fn slow_proof_that_all_functions_of_all_robots_with_balls_are_the_second_authors() {
    verified(&ROBOTS);
}

fn verified(robots: &[(&str, &str)]) {
    for (name, text) in robots {
        let source = Source::new(&format!("{name}.toml"), *text);
        let functions: Vec<Function> =
            Function::all().filter(|f| !f.spec().family.is_of_drives() && f.spec().members.is_empty()).collect();
        let options = Options { functions, ..Options::default() };
        let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{}", errors.render()));
        let verification = verify(&source, &generated, &options, (3, 1), || ()).unwrap_or_else(|why| panic!("{why}"));
        assert!(verification.passes(), "{name}: {:?}", verification.functions);
    }
}

/// The same robot with three revolute joints about x, y and z in the place of each ball joint.
fn with_three_for_each(text: &str) -> String {
    let mut out = Vec::new();
    for block in text.split("\n[[") {
        if !block.contains("kind = \"spherical\"") {
            out.push(block.to_string());
            continue;
        }
        let value = |key: &str| block.lines().find_map(|line| line.strip_prefix(&format!("{key} = "))).expect("a key");
        let [name, parent, child] = ["name", "parent", "child"].map(|key| value(key).trim_matches('"').to_string());
        let links = [parent, format!("{name}_0"), format!("{name}_1"), child];
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let origin = if k == 0 { format!("origin = {}\n", value("origin")) } else { String::new() };
            let (above, below) = (&links[k], &links[k + 1]);
            if k < 2 {
                out.push(format!("link]]\nname = \"{below}\"\n"));
            }
            out.push(format!(
                "joint]]\nname = \"{name}_{axis}\"\nkind = \"continuous\"\nparent = \"{above}\"\nchild = \"{below}\"\naxis = \"{axis}\"\n{origin}"
            ));
        }
    }
    out.join("\n[[")
}

/// Three revolute joints have a reduced form besides, of their own and of all joints beside them, and so the most that can be said is a ratio.
#[test]
fn a_ball_joint_takes_about_as_many_operations_as_three_revolute_joints_and_no_sines() {
    for (name, text) in ROBOTS {
        let counts = |text: &str| {
            let robot = robot(name, text);
            let program = checked(&robot, &[], Function::InverseDynamics, &Options::default());
            program.unwrap_or_else(|wrong| panic!("{wrong}")).graph.counts()
        };
        let (ball, three) = (counts(text), counts(&with_three_for_each(text)));
        let ratio = ball.flops() as f64 / three.flops() as f64;
        let [sines, of_three] = [ball.sin_cos, three.sin_cos];
        println!("{name:14} {} operations, {sines} sines; {}, {of_three}: {ratio:.3}", ball.flops(), three.flops());
        assert!(ratio <= 1.22, "{name}: {ratio}");
        assert_eq!(of_three - sines, 3 * text.matches("\"spherical\"").count());
    }
}
