//! The staged form against the plain functions, on an awkward robot: a tree with a sliding joint and oblique axes.

use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::program::parameter::parameter_program;
use straightline_codegen::program::program;
use straightline_codegen::program::staged::programs;
use straightline_codegen::scene::{Gravity, Parameter, Scene, Selection};
use straightline_codegen::{compile, model, Function, Options, Robot, Source};

const ROBOT: &str = r#"
[robot]
name = "crane"
[[link]]
name = "ground"
[[link]]
name = "mast"
mass = 4.0
com = [0.1, -0.2, 0.3]
inertia = { xx = 0.3, yy = 0.4, zz = 0.5, xy = 0.01, xz = -0.02, yz = 0.03 }
[[link]]
name = "boom"
mass = 2.5
com = [0.4, 0.05, -0.02]
inertia = { xx = 0.1, yy = 0.3, zz = 0.25, xy = -0.02, xz = 0.01, yz = 0.015 }
[[link]]
name = "trolley"
mass = 1.2
com = [0.02, 0.03, -0.2]
inertia = { xx = 0.02, yy = 0.03, zz = 0.015, xy = 0.001, xz = 0.002, yz = -0.003 }
[[link]]
name = "counterweight"
mass = 3.0
com = [-0.3, 0.01, 0.02]
inertia = { xx = 0.05, yy = 0.06, zz = 0.07, xy = 0.002, xz = 0.001, yz = 0.004 }
[[joint]]
name = "slew"
kind = "continuous"
parent = "ground"
child = "mast"
axis = [0.1, 0.2, 1.0]
origin = { xyz = [0.0, 0.1, 0.5], rpy = [0.1, 0.0, 0.3] }
[[joint]]
name = "luff"
kind = "continuous"
parent = "mast"
child = "boom"
axis = "y"
origin = { xyz = [0.2, 0.0, 1.5], rpy = [0.0, 0.4, 0.0] }
[[joint]]
name = "travel"
kind = "prismatic"
parent = "boom"
child = "trolley"
axis = [1.0, 0.1, 0.0]
origin = { xyz = [0.1, 0.0, 0.0], rpy = [0.2, 0.0, -0.1] }
limits = { lower = 0.0, upper = 2.0 }
[[joint]]
name = "balance"
kind = "continuous"
parent = "mast"
child = "counterweight"
axis = "x"
origin = { xyz = [-0.3, 0.1, 1.2], rpy = [0.0, 0.0, 0.7] }
"#;

fn robot() -> Robot {
    let (model, diagnostics) = model::load(&Source::new("crane.toml", ROBOT), &Default::default());
    Robot::new(model.unwrap_or_else(|| panic!("{diagnostics}")))
}

/// The stored values and single inputs by name.
type Values = Vec<(String, Vec<f64>)>;

fn run(graph: &Graph, values: &Values) -> Vec<f64> {
    let input = |name: &String| &values.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no {name}")).1;
    evaluate(graph, &graph.inputs.iter().flat_map(|p| input(&p.name).clone()).collect::<Vec<f64>>())
}

fn state() -> Values {
    let mut x = 0.37;
    let mut next = |n: usize| {
        (0..n)
            .map(|_| {
                x = (x * 997.0_f64 + 0.123).fract();
                2.0 * x - 1.0
            })
            .collect::<Vec<f64>>()
    };
    let names =
        ["q", "qd", "qdd", "tau", "direction_q", "direction_qd", "direction_qdd", "direction_tau", "multiplier"];
    let mut values: Values = names.map(|name| (name.to_string(), next(4))).into();
    values.push(("gravity".into(), vec![0.3, -0.2, -9.7]));
    values
}

fn staged_equals_plain(scene: Scene) {
    staged_functions_equal_plain(Options { scene, ..Options::default() });
}

fn staged_functions_equal_plain(options: Options) {
    let (robot, frames) = (robot(), vec!["trolley".to_string(), "counterweight".to_string()]);
    let staged = programs(&robot, &frames, &options).expect("they agree with their equations").0;
    let mut values = state();
    for parameter in &options.scene.parameters {
        let body = [1.5, 0.1, -0.2, 0.05, 0.02, 0.001, -0.002, 0.03, 0.003, 0.025];
        let parameters = evaluate(&parameter_program(&robot, parameter, &options), &body);
        values.push((parameter.input_name(), parameters));
    }
    for stage in &staged.staged.stages {
        let stored = run(stage, &values);
        values.push((stage.outputs[0].name.clone(), stored));
    }
    for (function, (_, graph)) in staged.functions.iter().zip(&staged.staged.functions) {
        let plain = program(&robot, &frames, *function, &options).graph;
        let (a, b) = (run(graph, &values), run(&plain, &values));
        let size = b.iter().fold(1e-3f64, |m, x| m.max(x.abs()));
        for (a, b) in a.iter().zip(&b) {
            // another order of summation: a few roundings
            assert!((a - b).abs() <= 2e-14 * size, "{}: {a:e} for {b:e}", function.name());
        }
    }
}

#[test]
fn every_function_in_stages_is_the_plain_function() {
    staged_equals_plain(Scene::default());
}

#[test]
fn with_gravity_and_a_payload_as_inputs_there_is_a_stage_before_all() {
    let hook = Parameter::Payload { name: "hook".into(), frame: "trolley".into() };
    let scene = Scene { gravity: Gravity::Input, parameters: vec![hook], ..Scene::default() };
    let programs = programs(&robot(), &[], &Options { scene: scene.clone(), ..Options::default() })
        .expect("they agree with their equations")
        .0;
    assert_eq!(programs.staged.stages.len(), 3);
    assert_eq!(programs.staged.stages[0].counts().sin_cos, 0);
    staged_equals_plain(scene);
}

#[test]
fn a_second_call_costs_a_third_at_most_and_gravity_and_h_nothing() {
    let (robot, options) = (robot(), Options::default());
    let staged = programs(&robot, &[], &options).expect("they agree with their equations").0;
    let left = |f: Function| staged.staged.functions[staged.functions.iter().position(|g| *g == f).unwrap()].1.counts();
    let full = program(&robot, &[], Function::InverseDynamics, &options).graph.counts().flops();
    assert!(left(Function::InverseDynamics).flops() * 100 <= full * 35);
    assert_eq!(left(Function::GravityForce).flops() + left(Function::MassMatrix).flops(), 0);
    assert_eq!(left(Function::ForwardDynamics).sin_cos, 0);
}

/// Of derivatives, too; a scene that leaves some of their blocks out leaves out nothing else. Products along directions begin where the motion is known.
#[test]
fn derivatives_in_stages_are_the_plain_ones() {
    use Function::*;
    let matrices = vec![InverseDynamics, InverseDynamicsDerivatives, ForwardDynamicsDerivatives, CoriolisMatrix];
    staged_functions_equal_plain(Options { functions: matrices.clone(), ..Options::default() });
    let results = vec!["dtau_dq".to_string(), "h".to_string()];
    let selection = Selection { results, ..Selection::default() };
    let outputs = [(InverseDynamicsDerivatives, selection)].into_iter().collect();
    let scene = Scene { outputs, ..Scene::default() };
    staged_functions_equal_plain(Options { functions: matrices, scene, ..Options::default() });

    let functions = vec![InverseDynamics, InverseDynamicsJvp, InverseDynamicsVjp, ForwardDynamicsJvp];
    let options = Options { functions, ..Options::default() };
    staged_functions_equal_plain(options.clone());
    let (made, _) = programs(&robot(), &[], &options).expect("they agree with their equations");
    let names: Vec<&str> = made.staged.stages.iter().map(|stage| stage.outputs[0].name.as_str()).collect();
    assert_eq!(names, ["configuration", "velocity", "motion"]);
    // another direction takes less than all of it
    let plain = program(&robot(), &[], InverseDynamicsJvp, &options).graph.counts().flops();
    let along = made.functions.iter().position(|f| *f == InverseDynamicsJvp).expect("it was asked for");
    let left = made.staged.functions[along].1.counts().flops();
    assert!(left * 10 <= plain * 8, "{left} of {plain}");
    let scene = Scene { staged: true, ..Scene::default() };
    let generated = compile(&Source::new("crane.toml", ROBOT), &Options { scene, ..options });
    let text = generated.unwrap_or_else(|d| panic!("{d}")).text;
    assert!(text.contains("pub struct Motion<'a>"));
}

#[test]
fn inputs_that_nothing_reads_are_left_alone() {
    // the first joint's angle about the vertical is read by no function here
    let functions = vec![Function::InverseDynamics, Function::GravityForce];
    let upright = ROBOT
        .replace("axis = [0.1, 0.2, 1.0]", "axis = \"z\"")
        .replace("rpy = [0.1, 0.0, 0.3]", "rpy = [0.0, 0.0, 0.3]");
    let options = Options { functions, scene: Scene { staged: true, ..Scene::default() }, ..Options::default() };
    let generated = compile(&Source::new("crane.toml", upright), &options).unwrap_or_else(|d| panic!("{d}"));
    assert!(generated.text.contains("pub mod staged"));
}
