//! Several functions in one call, and matrices by columns: the same numbers as the plain functions, at other places or for
//! fewer operations.

use straightline_codegen::function::Family;
use straightline_codegen::options::Options;
use straightline_codegen::program::TracedProgram;
use straightline_codegen::scene::{Scene, Selection};
use straightline_codegen::Function;
use straightline_generated_tests::programs::{of_robot, options, run};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::{Robot, ROBOTS};

/// The program of a function in a scene, and its results at an asymmetric configuration.
fn results(robot: &Robot, function: Function, scene: Scene) -> (TracedProgram, Vec<f64>) {
    let program = of_robot(robot, function, &Options { scene, ..options(robot) });
    let mut random = Random(7);
    let q = random.configuration(program.graph.inputs[0].len(), robot.floating);
    let values = run(&program, &[q]);
    (program, values)
}

#[test]
fn several_functions_in_one_call_give_the_same_for_fewer_operations() {
    let combinations: Vec<Function> = Function::known().filter(|f| f.spec().family == Family::Combination).collect();
    assert!(combinations.len() > 1);
    for (robot, function) in ROBOTS.map(Robot::load).iter().flat_map(|r| combinations.iter().map(move |f| (r, *f))) {
        let (all, values) = results(robot, function, Scene::default());
        let members = function.spec().members.iter().map(|f| results(robot, *f, Scene::default()));
        let (members, alone): (Vec<TracedProgram>, Vec<Vec<f64>>) = members.unzip();
        let alone = alone.concat();
        assert_eq!(values.len(), alone.len());
        // sums may be taken in another order, where that lets them share more
        let largest = values.iter().fold(1.0, |a: f64, b| a.max(b.abs()));
        for (here, alone) in values.iter().zip(&alone) {
            assert!((here - alone).abs() <= 8.0 * f64::EPSILON * largest, "{}: {here:e} {alone:e}", robot.name);
        }
        // a pair of sine and cosine for some twenty operations
        let cost = |p: &TracedProgram| p.graph.counts().flops() + 20 * p.graph.counts().sin_cos;
        let apart: usize = members.iter().map(cost).sum();
        assert!(cost(&all) < apart, "{} {}: {} in place of {apart}", robot.name, function.name(), cost(&all));
    }
}

#[test]
fn a_matrix_by_columns_is_the_transposed_one() {
    for robot in ROBOTS.map(Robot::load) {
        let by_columns = Scene { by_columns: true, ..Scene::default() };
        let (program, rows) = results(&robot, Function::Jacobian, Scene::default());
        let (_, columns) = results(&robot, Function::Jacobian, by_columns.clone());
        let [frames, six, nv] = program.graph.outputs[0].shape[..] else { panic!("a Jacobian per frame") };
        for (f, k, i) in (0..frames).flat_map(|f| (0..six).flat_map(move |k| (0..nv).map(move |i| (f, k, i)))) {
            assert_eq!(rows[(f * six + k) * nv + i], columns[(f * nv + i) * six + k], "{}", robot.name);
        }
        // of H, symmetric as a whole, the columns of one joint
        let last = robot.joints.last().expect("a robot has joints").clone();
        let one = Selection { joints: vec![last], ..Selection::default() };
        let scene = Scene { outputs: [(Function::MassMatrix, one)].into(), ..Scene::default() };
        let (_, rows) = results(&robot, Function::MassMatrix, scene.clone());
        let (program, column) = results(&robot, Function::MassMatrix, Scene { by_columns: true, ..scene });
        assert_eq!(program.graph.outputs[0].shape, [1, nv]);
        assert_eq!(rows, column, "{}: one column has no order of rows and columns", robot.name);
    }
}
