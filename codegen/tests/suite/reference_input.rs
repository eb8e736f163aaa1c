//! The second reading of the robot files: through it, the reference gives the data of all robots to their last digits.

use crate::data::{inputs, numbers, reference_file};
use nalgebra::Vector3;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use straightline_codegen::description::{self, Description};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_core::reference::{
    bias_force, forward_dynamics, forward_natural_scale, frame_jacobian, frame_jacobian_bias, frame_pose,
    gravity_force, inverse_dynamics, joint_wrenches, kinetic_energy, mass_matrix, potential_energy, velocity_force,
    CentreOfMassTree,
};
use straightline_core::Dd;

/// Half a unit in the last of 25 digits.
const DIGITS: f64 = 5.0001e-25;
/// What double-double may lose against the scale of the terms.
const ROUNDING: f64 = 1e-27;

fn read(path: &Path) -> Description {
    let text = fs::read_to_string(path).expect("a robot file");
    let mut diagnostics = Diagnostics::default();
    description::read(&Source::new("robot", text), &mut diagnostics).expect("a robot of the reference data")
}

fn largest(values: &[Dd]) -> f64 {
    values.iter().fold(0.0, |m: f64, x| m.max(x.abs().hi()))
}

/// Worst excess over the bound, per quantity.
#[derive(Default)]
struct Worst(BTreeMap<&'static str, (f64, String)>);

impl Worst {
    fn compare(&mut self, what: &'static str, state: &Value, computed: &[Dd], expected: &[Dd], scale: f64) {
        assert_eq!(computed.len(), expected.len(), "{what} of {}", state["id"]);
        for (a, b) in computed.iter().zip(expected) {
            let error = (*a - *b).abs().hi();
            let excess = if error == 0.0 { 0.0 } else { error / (DIGITS * b.abs().hi() + ROUNDING * scale) };
            let worst = self.0.entry(what).or_default();
            if excess > worst.0 || excess.is_nan() {
                *worst = (excess, state["id"].to_string());
            }
        }
    }

    fn compare_group(&mut self, what: &'static str, state: &Value, computed: &[Dd], expected: &Value) {
        let expected = numbers(expected);
        self.compare(what, state, computed, &expected, largest(&expected));
    }
}

fn compare_state(worst: &mut Worst, tree: &CentreOfMassTree<Dd>, state: &Value) {
    let (q, qd, qdd) = (inputs(&state["q"]), inputs(&state["qd"]), inputs(&state["qdd"]));
    let mut tree = tree.clone();
    if let Some(gravity) = state.get("gravity") {
        tree.gravity = Vector3::from_column_slice(&inputs(gravity));
    }
    let mut scaled = |what, computed: &[Dd], scale| {
        worst.compare(what, state, computed, &numbers(&state[what]), largest(&numbers(&state["scale"][scale])));
    };
    scaled("tau", inverse_dynamics(&tree, &q, &qd, &qdd).as_slice(), "tau");
    scaled("h", bias_force(&tree, &q, &qd).as_slice(), "h");
    scaled("g", gravity_force(&tree, &q).as_slice(), "g");
    scaled("C", velocity_force(&tree, &q, &qd).as_slice(), "C");
    scaled("V", &[potential_energy(&tree, &q)], "g");
    let drives = inputs(&state["fd_tau"]);
    let scale = largest(forward_natural_scale(&tree, &q, &qd, &drives).as_slice());
    let qdd_there = forward_dynamics(&tree, &q, &qd, &drives);
    worst.compare("fd_qdd", state, qdd_there.as_slice(), &numbers(&state["fd_qdd"]), scale);
    worst.compare_group("T", state, &[kinetic_energy(&tree, &q, &qd)], &state["T"]);
    worst.compare_group("wrench", state, &joint_wrenches(&tree, &q, &qd, &qdd).concat(), &state["wrench"]);
    if let Some(expected) = state.get("H") {
        worst.compare_group("H", state, mass_matrix(&tree, &q).as_slice(), expected);
    }
    let frames = state.get("frames").and_then(Value::as_object);
    for (name, expected) in frames.into_iter().flatten() {
        let frame = tree.frame(name).expect("every link has a frame");
        let pose = frame_pose(&tree, frame, &q);
        worst.compare_group("p", state, pose.position.as_slice(), &expected["p"]);
        worst.compare_group("R", state, pose.rotation.transpose().as_slice(), &expected["R"]);
        worst.compare_group("J", state, frame_jacobian(&tree, frame, &q).transpose().as_slice(), &expected["J"]);
        worst.compare_group("Jdqd", state, frame_jacobian_bias(&tree, frame, &q, &qd).as_slice(), &expected["Jdqd"]);
    }
}

#[test]
fn the_reference_gives_the_data_of_every_robot() {
    let parse = |path: &str| -> Value {
        let text = fs::read_to_string(reference_file(path)).expect("a file of the reference data");
        serde_json::from_str(&text).expect("JSON")
    };
    for robot in parse("robots.json").as_array().expect("a list of robots") {
        let name = robot["name"].as_str().expect("a name");
        let file = robot.get("urdf").or(robot.get("toml")).and_then(Value::as_str).expect("a description");
        // the numbers of the file are literal in the data
        let floating_base = robot["floating"] == true;
        let options = ModelOptions { floating_base, angle_tolerance: 0.0, ..ModelOptions::default() };
        let data = parse(&format!("states/{name}.json"));
        let description = read(&reference_file(&format!("robots/{file}")));
        let mut tree = centre_of_mass_tree(&description, &options).expect("a tree of links");
        tree.gravity = Vector3::from_column_slice(&inputs(&data["gravity"]));
        // depth first in the file's order, as the data
        let joints = data["joints"].as_array().expect("a list of joints");
        let children: Vec<&str> = joints.iter().filter_map(|joint| joint["child"].as_str()).collect();
        let links: Vec<&str> = tree.links.iter().map(|link| link.name.as_str()).collect();
        assert_eq!(links, children, "{name}");
        let mut worst = Worst::default();
        for state in data["states"].as_array().expect("a list of states") {
            compare_state(&mut worst, &tree, state);
        }
        println!("{name}: {:?}", worst.0);
        for (what, (excess, state)) in &worst.0 {
            assert!(*excess <= 1.0, "{what} of {state}: {excess:.3} times the bound");
        }
    }
}
