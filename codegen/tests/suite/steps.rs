//! Displacements and steps of time: every function beside the second author, derivatives of programs in dual numbers, and the order of the methods.

use crate::data::{inputs, numbers, reference_file};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::verify::{bound, verify};
use straightline_codegen::{compile, Function, Scalar, Source};
use straightline_core::algorithms::{difference, integrate};
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::{Dd, Dual};

const ARM: &str = include_str!("../files/arm.toml");
const BRANCHED: &str = include_str!("../files/branched.toml");
const PLANAR: &str = include_str!("../../../robots/descriptions/planar_2r.toml");

/// A body that flies, with a link that turns and one that slides.
const FLYING: &str = r#"
[robot]
name = "flying"

[[link]]
name = "trunk"
mass = 3.0
com = [0.02, -0.01, 0.05]
inertia = { xx = 0.05, yy = 0.06, zz = 0.04, xy = 0.004, xz = -0.003, yz = 0.002 }

[[link]]
name = "leg"
mass = 0.8
com = [0.03, 0.01, -0.2]
inertia = [0.01, 0.011, 0.002]

[[link]]
name = "foot"
mass = 0.3
com = [0.0, 0.02, -0.1]
inertia = [0.002, 0.003, 0.001]

[[joint]]
name = "hip"
kind = "revolute"
parent = "trunk"
child = "leg"
origin = { xyz = [0.1, 0.2, -0.1] }
axis = "y"
limits = { lower = -2.0, upper = 2.0, effort = 100.0, velocity = 10.0 }

[[joint]]
name = "slide"
kind = "prismatic"
parent = "leg"
child = "foot"
origin = { xyz = [0.0, 0.0, -0.4] }
axis = "z"
limits = { lower = -0.2, upper = 0.2, effort = 100.0, velocity = 2.0 }
"#;

const DISPLACEMENTS: [Function; 5] = [
    Function::Integrate,
    Function::Difference,
    Function::IntegrateDerivatives,
    Function::DifferenceDerivatives,
    Function::IntegrateTransport,
];
const STEPS: [Function; 4] =
    [Function::SemiImplicitStep, Function::RungeKuttaStep, Function::StepDerivatives, Function::StepDerivativesRk4];

fn options(floating_base: bool) -> Options {
    Options { model: ModelOptions { floating_base, ..ModelOptions::default() }, ..Options::default() }
}

#[track_caller]
fn agrees(name: &str, text: &str, options: &Options) {
    let source = Source::new(name, text);
    let generated = compile(&source, options).unwrap_or_else(|errors| panic!("{errors}"));
    let verification = verify(&source, &generated, options, (6, 3), || ()).expect("the reference reads the file");
    assert_eq!(verification.functions.len(), options.functions.len());
    assert!(verification.left_out.is_empty(), "{:?}", verification.left_out);
    for (function, worst) in &verification.functions {
        println!("{name} {} {function}: {:.1e}", options.scalar.name(), worst.error);
        assert!(worst.error < bound(options.scalar) / 16.0, "{name}, {function}: {worst:?}");
    }
}

#[test]
fn displacements_are_those_of_the_second_author() {
    for (name, text, floating) in
        [("arm.toml", ARM, true), ("branched.toml", BRANCHED, true), ("planar_2r.toml", PLANAR, false)]
    {
        for scalar in [Scalar::F64, Scalar::F32] {
            agrees(name, text, &Options { functions: DISPLACEMENTS.to_vec(), scalar, ..options(floating) });
        }
    }
}

#[test]
fn steps_are_those_of_the_second_author() {
    for scalar in [Scalar::F64, Scalar::F32] {
        agrees("planar_2r.toml", PLANAR, &Options { functions: STEPS.to_vec(), scalar, ..options(false) });
    }
    agrees("arm.toml", ARM, &Options { functions: STEPS.to_vec(), ..options(false) });
}

#[test]
#[ignore = "slow proof: four times the derivatives of forward dynamics, in one program"]
fn slow_proof_that_steps_of_floating_robots_are_those_of_the_second_author() {
    for scalar in [Scalar::F64, Scalar::F32] {
        agrees("flying.toml", FLYING, &Options { functions: STEPS.to_vec(), scalar, ..options(true) });
    }
}

/// One that stands on the ground, or one that flies.
fn robot(floating: bool) -> &'static str {
    if floating {
        FLYING
    } else {
        PLANAR
    }
}

/// A robot with the program of a function.
fn traced(text: &str, floating: bool, function: Function) -> (Model<Dd>, Graph) {
    let options = options(floating);
    let model = model::load(&Source::new("robot.toml", text), &options.model).0.expect("a robot");
    let graph = program(&Robot::new(model.clone()), &[], function, &options).graph;
    (model, graph)
}

/// A state with forces, at which it moves.
fn state(model: &Model<Dd>, random: &mut Random) -> [Vec<Dd>; 3] {
    let mut any = |n: usize, size: f64| -> Vec<Dd> { (0..n).map(|_| Dd::from(random.symmetric(size))).collect() };
    let mut q = any(model.nq(), 1.0);
    for joint in model.free_joints() {
        joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]);
    }
    [q, any(model.nv(), 1.0), any(model.nv(), 3.0)]
}

/// The state after so many steps of a method.
fn after(graph: &Graph, model: &Model<Dd>, [q, qd, tau]: &[Vec<Dd>; 3], count: usize, time: f64) -> [Vec<Dd>; 2] {
    let length = vec![Dd::from(time / count as f64)];
    (0..count).fold([q.clone(), qd.clone()], |[q, qd], _| {
        let next = evaluate(graph, &[q, qd, tau.clone(), length.clone()].concat());
        let (q, qd) = next.split_at(model.nq());
        [q.to_vec(), qd.to_vec()]
    })
}

/// How much the error of a method falls where steps are halved.
fn order(function: Function, floating: bool) -> f64 {
    let (model, graph) = traced(robot(floating), floating, function);
    let state = state(&model, &mut Random(4));
    let time = 0.02;
    let apart = |a: &[Vec<Dd>; 2], b: &[Vec<Dd>; 2]| -> f64 {
        let rates = a[1].iter().zip(&b[1]).map(|(a, b)| *a - *b);
        difference(&model, &a[0], &b[0]).into_iter().chain(rates).map(|x| x.to_f64().abs()).fold(0.0, f64::max)
    };
    let [coarse, half, quarter] = [4, 8, 16].map(|count| after(&graph, &model, &state, count, time));
    (apart(&coarse, &half) / apart(&half, &quarter)).log2()
}

#[test]
fn methods_have_their_order_on_the_ground_and_in_the_air() {
    for floating in [false, true] {
        let [euler, runge_kutta] = [Function::SemiImplicitStep, Function::RungeKuttaStep].map(|f| order(f, floating));
        assert!((euler - 1.0).abs() < 0.1, "{floating}: {euler}");
        assert!((runge_kutta - 4.0).abs() < 0.2, "{floating}: {runge_kutta}");
    }
}

/// A and B are the derivatives of the step without derivatives, in dual numbers through its program.
fn hold_derivatives(text: &str, floating: bool, step: Function, derivatives: Function) {
    let (model, graph) = traced(text, floating, step);
    let (_, with_derivatives) = traced(text, floating, derivatives);
    let state = state(&model, &mut Random(9));
    let (nq, nv, length) = (model.nq(), model.nv(), Dd::from(0.03));
    let found = evaluate(&with_derivatives, &[state.concat(), vec![length]].concat());
    let next = evaluate(&graph, &[state.concat(), vec![length]].concat());
    for (found, next) in found.iter().zip(&next) {
        assert!((*found - *next).to_f64().abs() < 1e-26, "{found:?}, {next:?}");
    }
    let (a, b) = found[nq + nv..].split_at(4 * nv * nv);
    for k in 0..3 * nv {
        let mut unit = vec![Dd::ZERO; 3 * nv];
        unit[k] = Dd::ONE;
        let rates = [model.configuration_rate(&state[0], &unit[..nv]), unit[nv..].to_vec()].concat();
        let along = state.concat().into_iter().zip(rates).map(|(value, rate)| Dual { value, derivatives: [rate] });
        let moving: Vec<Dual<Dd, 1>> = along.chain([Dual::fixed(length)]).collect();
        let next: Vec<Dual<Dd, 1>> = evaluate(&graph, &moving);
        // increments of q⁺: the displacement from it, as it moves
        let (dual, still) = (model.map(Dual::<Dd, 1>::fixed), next[..nq].iter().map(|x| Dual::fixed(x.value)));
        let increments = difference(&dual, &still.collect::<Vec<_>>(), &next[..nq]);
        let expected = increments.into_iter().chain(next[nq..].iter().copied()).map(|x| x.derivatives[0]);
        for (i, expected) in expected.enumerate() {
            let found = if k < 2 * nv { a[i * 2 * nv + k] } else { b[i * nv + k - 2 * nv] };
            let off = (found - expected).to_f64().abs();
            assert!(off < 1e-24, "{} row {i}, column {k}: {found:?}, {expected:?}", derivatives.name());
        }
    }
}

#[test]
fn derivatives_of_steps_are_those_of_steps() {
    for floating in [false, true] {
        hold_derivatives(robot(floating), floating, Function::SemiImplicitStep, Function::StepDerivatives);
        hold_derivatives(robot(floating), floating, Function::RungeKuttaStep, Function::StepDerivativesRk4);
    }
    hold_derivatives(ARM, false, Function::SemiImplicitStep, Function::StepDerivatives);
}

/// What a program integrates is what the runtime does.
#[test]
fn a_program_integrates_as_the_runtime_does() {
    let (model, graph) = traced(ARM, true, Function::Integrate);
    let mut random = Random(6);
    for size in [1e-9, 0.1, 2.0, 9.0] {
        let [q, ..] = state(&model, &mut random);
        let v: Vec<Dd> = (0..model.nv()).map(|_| Dd::from(random.symmetric(size))).collect();
        let found = evaluate(&graph, &[q.clone(), v.clone()].concat());
        for (found, expected) in found.iter().zip(integrate(&model, &q, &v)) {
            assert!((*found - expected).to_f64().abs() < 1e-28, "{size}: {found:?}, {expected:?}");
        }
        assert_eq!(found.len(), model.nq());
    }
}

/// Operations of a robot file's program.
fn operations(file: &str, floating: bool, function: Function) -> usize {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../").to_string() + file;
    let text = std::fs::read_to_string(path).expect("a robot file");
    let source = Source::new(if file.ends_with("toml") { "robot.toml" } else { "robot.urdf" }, text);
    let options = options(floating);
    let model = model::load(&source, &options.model).0.expect("a robot");
    program(&Robot::new(model), &[], function, &options).graph.counts().flops()
}

#[test]
#[ignore = "prints what tests of counts have on record"]
fn operations_of_steps_and_displacements() {
    for function in DISPLACEMENTS {
        let [on_the_ground, free] = [("ur5", false), ("hyq", true)]
            .map(|(robot, floating)| operations(&format!("robots/descriptions/{robot}.urdf"), floating, function));
        println!("{}: {on_the_ground} of a UR5, {free} of HyQ", function.name());
    }
    for function in STEPS {
        for robot in [
            "robots/descriptions/ur5",
            "robots/descriptions/puma560",
            "generated_tests/count_robots/iiwa7",
            "robots/descriptions/panda",
        ] {
            println!("{robot} {}: {}", function.name(), operations(&format!("{robot}.urdf"), false, function));
        }
    }
}

/// Beside values with 25 digits, in double-double and in f64: errors over the greatest entry of a block.
fn hold_data(robot: &str, floating: bool) {
    let file = std::fs::read_to_string(reference_file(&format!("derivatives/{robot}.json"))).expect("the data");
    let file: serde_json::Value = serde_json::from_str(&file).expect("JSON");
    let text = std::fs::read_to_string(reference_file(&format!("robots/{robot}.urdf"))).expect("a robot");
    let mut options = options(floating);
    // in the data angles count as they are written
    options.model.angle_tolerance = 0.0;
    let model = model::load(&Source::new("robot.urdf", text), &options.model).0.expect("a robot");
    let graph = program(&Robot::new(model.clone()), &[], Function::StepDerivatives, &options).graph;
    let mut worst = [0.0f64; 2];
    for state in file["states"].as_array().expect("a list").iter().filter(|s| s["kind"] != "gravity_tilted") {
        let length: f64 =
            state["step_derivatives"]["dt"].as_str().and_then(|text| text.parse().ok()).expect("a number");
        let mut given: Vec<Vec<Dd>> = ["q", "qd", "tau"].map(|name| inputs(&state[name])).to_vec();
        if floating {
            model.bodies[0].joint.kind.normalise(&mut given[0][..7]);
        }
        given.push(vec![Dd::from(length)]);
        let given = given.concat();
        let short: Vec<f64> = given.iter().map(|x| x.to_f64()).collect();
        let found: [Vec<Dd>; 2] =
            [evaluate(&graph, &given), evaluate(&graph, &short).into_iter().map(Dd::from).collect()];
        let mut first = 0;
        for block in ["q_next", "qd_next", "A", "B"] {
            let expected = numbers(&state["step_derivatives"][block]);
            let greatest = expected.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
            for (found, worst) in found.iter().zip(&mut worst) {
                for (found, expected) in found[first..].iter().zip(&expected) {
                    *worst = worst.max((*found - *expected).to_f64().abs() / greatest);
                }
            }
            first += expected.len();
        }
        assert_eq!(first, found[0].len());
    }
    println!("{robot}: {:.1e} in double-double, {:.1e} in f64", worst[0], worst[1]);
    // f64 loses what the inertia's factor costs: Pinocchio 5.4e-13 of A of HyQ
    assert!(worst[0] < 1e-19 && worst[1] < 1e-12, "{robot}: {worst:?}");
}

#[test]
fn steps_and_their_derivatives_are_those_of_the_data() {
    hold_data("planar2r", false);
    hold_data("ur5", false);
}

#[test]
#[ignore = "slow proof: a program of twenty thousand operations"]
fn slow_proof_that_steps_of_a_floating_robot_are_those_of_the_data() {
    hold_data("solo12", true);
}

/// What a factor that multiplies, or adds the same, would lose of small displacements.
#[test]
fn small_differences_keep_their_digits_in_f64() {
    let (model, graph) = traced(ARM, true, Function::Difference);
    let mut random = Random(12);
    for size in [1e-13, 1e-9, 1e-5, 0.1, 1.5] {
        let [q, ..] = state(&model, &mut random);
        let v: Vec<Dd> = (0..model.nv()).map(|_| Dd::from(random.symmetric(size))).collect();
        let short: Vec<f64> = [&q[..], &integrate(&model, &q, &v)].concat().iter().map(|x| x.to_f64()).collect();
        let exact = evaluate(&graph, &short.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
        let greatest = exact.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        for (found, exact) in evaluate(&graph, &short).into_iter().zip(exact) {
            let off = (Dd::from(found) - exact).to_f64().abs();
            assert!(off <= 12.0 * f64::EPSILON * greatest, "{size}: {found}, {exact:?}");
        }
    }
}
