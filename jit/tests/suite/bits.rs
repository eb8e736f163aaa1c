//! All functions of robots of all kinds: machine code, interpreter and graph have the same bits.

use straightline_codegen::compile::{compile_programs, CheckedPrograms};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::emit::fused;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_core::random::Random;
use straightline_graph::expr::evaluate;
use straightline_jit::{BatchLayout, ExecutionMode, Number, Robot};

/// Name, text, and whether the base floats.
pub type TestFile<'a> = (&'a str, &'a str, bool);

pub const ROBOTS: [TestFile<'static>; 4] = [
    ("ur5.urdf", include_str!("../../../generated_tests/count_robots/ur5.urdf"), false),
    ("solo12.urdf", include_str!("../../../generated_tests/count_robots/solo12.urdf"), true),
    ("fourbar.toml", include_str!("../../../codegen/tests/files/fourbar.toml"), false),
    ("ball_chain.toml", include_str!("../../../codegen/tests/files/ball_chain.toml"), false),
];

/// A number as it is made for tests, and as it is compared.
pub trait TestNumber: Number {
    fn of(x: f64) -> Self;
    fn of_bits(bits: u64) -> Self;
    fn is_nan(self) -> bool;
}

impl TestNumber for f64 {
    fn of(x: f64) -> f64 {
        x
    }
    fn of_bits(bits: u64) -> f64 {
        f64::from_bits(bits)
    }
    fn is_nan(self) -> bool {
        f64::is_nan(self)
    }
}

impl TestNumber for f32 {
    fn of(x: f64) -> f32 {
        x as f32
    }
    fn of_bits(bits: u64) -> f32 {
        f32::from_bits(bits as u32)
    }
    fn is_nan(self) -> bool {
        f32::is_nan(self)
    }
}

/// Numbers at the end of what there is.
pub const ENDS: [f64; 8] = [0.0, -0.0, 5e-324, -1e-310, 1e-40, f64::INFINITY, f64::NAN, 1e300];

/// Some number, now and then one at the end of what there is.
pub fn any<T: TestNumber>(random: &mut Random) -> T {
    match random.unit() {
        x if x < 0.03 => T::of(ENDS[((random.unit() * 8.0) as usize).min(7)]),
        _ => T::of(random.symmetric(3.0)),
    }
}

pub fn are_same<T: TestNumber>(found: &[T], wanted: &[T], what: &str) {
    assert_eq!(found.len(), wanted.len(), "{what}");
    for (k, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        let is_same = found.bits() == wanted.bits() || found.is_nan() && wanted.is_nan();
        assert!(is_same, "{what}, {k}: {found:?}, not {wanted:?}");
    }
}

/// The results of one robot's functions in so many states: as batches, and the last of them one by one.
fn same_bits<T: TestNumber>((name, text, floating_base): TestFile<'_>, functions: &[Function], states: usize) {
    let model = ModelOptions { floating_base, ..ModelOptions::default() };
    let options = Options { model, functions: functions.to_vec(), scalar: T::SCALAR, ..Options::default() };
    let compiled = compile_programs(&Source::new(name, text), &options);
    let compiled = compiled.unwrap_or_else(|e| panic!("{}", e.render()));
    same_bits_of::<T>(name, &compiled, states, false);
    same_bits_of::<T>(name, &compiled, states.min(21), true);
}

fn same_bits_of<T: TestNumber>(name: &str, compiled: &CheckedPrograms, states: usize, fma: bool) {
    let here = ExecutionMode::ALL.into_iter().filter(|execution| execution.is_available());
    let robots: Vec<Robot<T>> = here
        .map(|execution| Robot::from_programs(compiled.clone(), fma, execution).unwrap_or_else(|e| panic!("{e}")))
        .collect();
    let mut random = Random(17);
    for (k, program) in compiled.programs.iter().enumerate() {
        let lengths =
            [&program.graph.inputs, &program.graph.outputs].map(|p| p.iter().map(|p| p.len()).collect::<Vec<_>>());
        let some = |n: &usize, random: &mut Random| (0..n * states).map(|_| any(random)).collect();
        let values: Vec<Vec<T>> = lengths[0].iter().map(|n| some(n, &mut random)).collect();
        let state = |i: usize| values.iter().zip(&lengths[0]).map(move |(x, n)| &x[i * n..][..*n]).collect::<Vec<_>>();
        let truth = |inputs: &[T]| match fma {
            false => evaluate(&program.graph, inputs),
            true => {
                let sines = |sum: [T; 2]| {
                    let (sine, cosine) = T::fused_sin_cos([sum]);
                    (sine[0], cosine[0])
                };
                fused::evaluate((&program.graph, &program.schedule), inputs, T::fused, sines)
            }
        };
        let wanted: Vec<Vec<T>> = (0..states).map(|i| truth(&state(i).concat())).collect();
        for robot in &robots {
            let function = &robot.functions()[k];
            let what = format!("{name}, {} in {:?}, fma {fma}, {:?}", function.name(), T::SCALAR, function.execution());
            let rows = |n: &usize| BatchLayout::states_of(*n);
            let mut found: Vec<Vec<T>> = lengths[1].iter().map(|n| vec![T::default(); n * states]).collect();
            let taken: Vec<(&[T], BatchLayout)> =
                values.iter().zip(&lengths[0]).map(|(x, n)| (&x[..], rows(n))).collect();
            let mut made: Vec<(&mut [T], BatchLayout)> =
                found.iter_mut().zip(&lengths[1]).map(|(x, n)| (&mut x[..], rows(n))).collect();
            function.batch(states, &taken, &mut made).unwrap_or_else(|e| panic!("{what}: {e}"));
            for (i, wanted) in wanted.iter().enumerate() {
                let own: Vec<&[T]> = found.iter().zip(&lengths[1]).map(|(x, n)| &x[i * n..][..*n]).collect();
                are_same(&own.concat(), wanted, &format!("{what}, state {i}"));
            }
            let mut runner = function.runner();
            for i in (0..states).rev().take(9) {
                let mut one: Vec<Vec<T>> = lengths[1].iter().map(|n| vec![T::default(); *n]).collect();
                let mut results: Vec<&mut [T]> = one.iter_mut().map(|x| &mut x[..]).collect();
                runner.call(&state(i), &mut results).unwrap_or_else(|e| panic!("{what}: {e}"));
                are_same(&one.concat(), &wanted[i], &format!("{what}, state {i} alone"));
            }
        }
    }
}

pub const DYNAMICS: [Function; 5] = [
    Function::InverseDynamics,
    Function::ForwardDynamics,
    Function::MassMatrix,
    Function::ForwardKinematics,
    Function::Energy,
];

#[test]
fn dynamics_have_the_bits_of_their_programs() {
    let [ur5, solo, fourbar, balls] = ROBOTS;
    same_bits::<f64>(ur5, &DYNAMICS, 50);
    same_bits::<f32>(ur5, &DYNAMICS[..2], 50);
    same_bits::<f64>(fourbar, &DYNAMICS[..2], 50);
    same_bits::<f32>(balls, &DYNAMICS, 50);
    same_bits::<f64>(solo, &DYNAMICS[..1], 50);
}

/// Angles that are computed, and signs: more than one phase.
#[test]
fn functions_with_calls_in_between_have_them_too() {
    let named = |name: &str| Function::known().find(|f| f.name() == name).expect("there is such a function");
    let [ur5, solo, fourbar, balls] = ROBOTS;
    same_bits::<f64>(fourbar, &[named("close_loops"), named("loop_jacobian")], 50);
    let steps = [named("integrate"), named("semi_implicit_step")];
    same_bits::<f64>(solo, &steps[..1], 20);
    same_bits::<f64>(balls, &steps, 20);
    let rubbing = ur5.1.replacen("</joint>", "<dynamics friction=\"0.3\" damping=\"0.1\"/></joint>", 3);
    same_bits::<f64>(("rubbing.urdf", &rubbing, false), &DYNAMICS[..2], 50);
}

/// A tree of joints of all kinds that turn or slide, with numbers that are round or not.
pub fn random_robot(random: &mut Random) -> String {
    let mut below = |n: usize| ((random.unit() * n as f64) as usize).min(n - 1);
    let joints = 1 + below(9);
    const INERTIA: &str =
        "<mass value=\"1.3\"/><inertia ixx=\"0.03\" iyy=\"0.04\" izz=\"0.05\" ixy=\"0.001\" ixz=\"0\" iyz=\"0.002\"/></inertial></link>";
    let mut text = format!("<robot name=\"random\"><link name=\"l0\"><inertial>{INERTIA}");
    for k in 1..=joints {
        let kind = ["continuous", "continuous", "continuous", "prismatic"][below(4)];
        let parent = if below(3) == 0 { below(k) } else { k - 1 };
        let mut number = |most: f64| match below(3) {
            0 => 0.0,
            1 => (below(19) as f64 - 9.0) / 10.0 * most,
            _ => (below(2_000_001) as f64 / 1e6 - 1.0) * most,
        };
        let [x, y, z] = [0; 3].map(|_| number(0.5));
        let [roll, pitch, yaw] = [0; 3].map(|_| number(1.5));
        let [cx, cy, cz] = [0; 3].map(|_| number(0.1));
        let axis = ["1 0 0", "0 1 0", "0 0 1", "0.6 0 0.8"][below(4)];
        let limit =
            if kind == "prismatic" { "<limit lower=\"-1\" upper=\"1\" effort=\"9\" velocity=\"9\"/>" } else { "" };
        text += &format!(
            "<joint name=\"j{k}\" type=\"{kind}\"><parent link=\"l{parent}\"/><child link=\"l{k}\"/><axis xyz=\"{axis}\"/>{limit}\
             <origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/></joint><link name=\"l{k}\"><inertial><origin xyz=\"{cx} {cy} {cz}\"/>{INERTIA}"
        );
    }
    text + "</robot>"
}

fn random_robots_have_the_bits_of_their_programs(count: usize, seed: u64) {
    let mut random = Random(seed);
    for _ in 0..count {
        let (text, floats) = (random_robot(&mut random), random.unit() < 0.3);
        same_bits::<f64>(("random.urdf", &text, floats), &[Function::InverseDynamics, Function::ForwardDynamics], 21);
        same_bits::<f32>(("random.urdf", &text, floats), &[Function::MassMatrix], 9);
    }
}

#[test]
fn random_robots_have_them_too() {
    random_robots_have_the_bits_of_their_programs(4, 3);
}

#[test]
#[ignore = "long proof: 500 robots, minutes"]
fn long_proof_that_500_random_robots_have_the_bits_of_their_programs() {
    random_robots_have_the_bits_of_their_programs(500, 11);
}

#[test]
#[ignore = "long proof: every function of four robots, minutes"]
fn long_proof_that_every_function_has_the_bits_of_its_program() {
    for robot in ROBOTS {
        let options = ModelOptions { floating_base: robot.2, ..ModelOptions::default() };
        let model = load(&Source::new(robot.0, robot.1), &options).0.expect("it is a robot");
        let is_there = |f: &Function| f.is_of(&model) && !f.is_of_scene_parameters() && f.spec().members.is_empty();
        let all: Vec<Function> = Function::all().filter(is_there).collect();
        same_bits::<f64>(robot, &all, 50);
        same_bits::<f32>(robot, &all, 10);
    }
}
