//! Robots with drives as a build script makes them and rustc compiles them: the bits of the interpreter, and the motion that the generic
//! runtime finds.

use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::Function;
use straightline_codegen::Function::{CompleteModel, DriveTorques, DrivenForwardDynamics};
use straightline_core::algorithms as alg;
use straightline_core::model::Model;
use straightline_generated_tests::bounds::DRIVE;
use straightline_generated_tests::drives::blocks;
use straightline_generated_tests::random::Random;
use straightline_robots::{planar_2r_elastic, planar_2r_geared};

/// The same robot through the compiler as a library.
fn compiled(scene_text: &str) -> (Options, Robot) {
    let scene = scene_file::read(&Source::new("drives.toml", scene_text), &mut Diagnostics::new()).expect("a scene");
    let options = scene.into_options(Options { frames: vec!["tip".to_string()], ..Options::default() });
    let text = include_str!("../../../robots/descriptions/planar_2r.toml");
    let generated = compile(&Source::new("planar_2r.toml", text), &options).unwrap_or_else(|d| panic!("{d}"));
    (options, Robot::new(generated.model))
}

/// What compiled functions give, one list per function, beside the interpreter's.
fn compare(
    (options, robot): &(Options, Robot),
    inputs: &[(&str, &[f64])],
    compiled: &[(Function, Vec<f64>)],
    what: &str,
) {
    for (function, values) in compiled {
        let graph = program(robot, &[], *function, options).graph;
        assert_eq!(*values, blocks::<f64>(&graph, inputs).concat(), "{what}, {function:?}, {inputs:?}");
    }
    let model: Model<f64> = robot.model.cast();
    let named = |name: &str| inputs.iter().find(|(n, _)| *n == name).expect("an input").1;
    let (q, qd) = (named("q"), named("qd"));
    let (h, bias) = (alg::mass_matrix(&model, q), alg::bias_force(&model, q, qd));
    let motion = alg::driven_motion(&model, (q, qd, named("x"), named("u")), &bias, &alg::Links::MassMatrix(&h));
    let expected = [motion.qdd, motion.xd].concat();
    let size = expected.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (a, b) in compiled[0].1.iter().zip(&expected) {
        assert!(a == b || DRIVE.allows((a - b).abs() / size), "{what}: {:?} and {expected:?}", compiled[0].1);
    }
}

/// Random states of one of the modules, which have the same functions over arrays of their own sizes.
macro_rules! states_of {
    ($arm:ident, $scene:literal) => {{
        let robot = compiled(include_str!(concat!("../../../robots/scenes/", $scene)));
        let mut random = Random(3);
        for _ in 0..50 {
            let q: [f64; $arm::NQ] = std::array::from_fn(|_| random.between(-2.0, 2.0));
            let qd: [f64; $arm::NV] = std::array::from_fn(|_| random.between(-3.0, 3.0));
            let x: [f64; $arm::NX] = std::array::from_fn(|_| random.between(-5.0, 5.0));
            let u: [f64; $arm::NU] = std::array::from_fn(|_| random.between(-30.0, 30.0));
            let (mut qdd, mut xd) = ([0.0; $arm::NV], [0.0; $arm::NX]);
            $arm::driven_forward_dynamics(&q, &qd, &x, &u, &mut qdd, &mut xd);
            let (mut tau, mut m) = ([0.0; $arm::NV], [0.0; $arm::NU]);
            $arm::drive_torques(&q, &qd, &x, &u, &mut tau, &mut m);
            let (mut h, mut bias, mut d) = ([[0.0; $arm::NV]; $arm::NV], [0.0; $arm::NV], [[0.0; $arm::NU]; $arm::NV]);
            $arm::complete_model(&q, &qd, &x, &mut h, &mut bias, &mut d);
            let found = [
                (DrivenForwardDynamics, [&qdd[..], &xd].concat()),
                (DriveTorques, [tau, m].concat()),
                (CompleteModel, [&h.concat()[..], &bias, &d.concat()].concat()),
            ];
            let inputs: [(&str, &[f64]); 4] = [("q", &q), ("qd", &qd), ("x", &x), ("u", &u)];
            compare(&robot, &inputs, &found, stringify!($arm));
        }
    }};
}

#[test]
fn compiled_drives_have_the_bits_of_the_interpreter_and_the_motion_of_the_runtime() {
    states_of!(planar_2r_geared, "planar_2r_drives.toml");
    states_of!(planar_2r_elastic, "planar_2r_elastic.toml");
}
