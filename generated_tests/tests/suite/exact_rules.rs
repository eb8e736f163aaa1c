//! Bit for bit: under the exact rules generated code is the generic runtime, and compiled code is always its program.

use straightline_codegen::equations::Robot as Loaded;
use straightline_codegen::expr::Grade;
use straightline_codegen::options::Options;
use straightline_codegen::Scalar;
use straightline_codegen::{ForwardDynamicsMethod, Function};
use straightline_core::model::{Frame, Model};
use straightline_core::Real;
use straightline_generated_tests::compiled::{self, Compiled};
use straightline_generated_tests::inputs::{self, ready_to_paste};
use straightline_generated_tests::programs::{self, cast, program};
use straightline_generated_tests::random::{Kind, Random, RandomRobot};
use straightline_generated_tests::reference::{Robot, ROBOTS};
use straightline_generated_tests::written::{Shape, Style};

const STATES: usize = 20;
const METHODS: [ForwardDynamicsMethod; 2] =
    [ForwardDynamicsMethod::ArticulatedBody, ForwardDynamicsMethod::Factorisation];

/// Equal floats are the same bits but for the sign of zero; what is no number equals nothing.
fn assert_same<T: Real + PartialEq>(claim: &str, inputs: &[Vec<f64>], a: &[T], b: &[T]) {
    assert_eq!(a.len(), b.len(), "{claim}");
    if let Some(i) = (0..a.len()).find(|&i| a[i] != b[i]) {
        panic!("{claim}: component {i} is {:?} and {:?}\n{}", a[i], b[i], ready_to_paste(inputs));
    }
}

/// The program under exact rules, interpreted, and the same function on the generic runtime.
fn interpreter_is_runtime<T: Real + PartialEq>(name: &str, loaded: &Loaded, frames: &[String], scalar: Scalar) {
    let model = &loaded.model;
    let numbers: Model<T> = model.cast();
    let list: Vec<&Frame<T>> = frames.iter().map(|f| numbers.frame(f).expect("a frame of the robot")).collect();
    let mut random = Random(1);
    for function in Function::all() {
        let methods = if function == Function::ForwardDynamics { &METHODS[..] } else { &METHODS[..1] };
        for &forward_dynamics in methods {
            let options = Options { grade: Grade::Exact, scalar, forward_dynamics, ..Options::default() };
            let program = program(loaded, frames, function, &options);
            for _ in 0..STATES {
                let inputs = inputs::random(&mut random, model, function);
                let x = cast::<T>(&inputs);
                let runtime = function.evaluate(&numbers, &list, forward_dynamics, &x);
                let claim = format!("{} of {name}, {scalar:?}, {forward_dynamics:?}", function.name());
                assert_same(&claim, &inputs, &programs::run(&program, &x), &runtime);
            }
        }
    }
}

#[test]
fn exact_programs_are_the_generic_runtime_for_all_robots() {
    for robot in ROBOTS.map(Robot::load) {
        let loaded = programs::load(&programs::source(&robot), &programs::options(&robot).model);
        interpreter_is_runtime::<f64>(&robot.name, &loaded, &robot.frames, Scalar::F64);
        interpreter_is_runtime::<f32>(&robot.name, &loaded, &robot.frames, Scalar::F32);
    }
}

#[test]
fn exact_programs_are_the_generic_runtime_for_random_trees() {
    for seed in 0..6 {
        let kind = Kind {
            joints: 8,
            branched: seed % 2 == 0,
            floating: seed % 3 == 0,
            welded: 2,
            right_angled: seed % 3 == 1,
        };
        let robot = RandomRobot::new(&mut Random(100 + seed), kind);
        let loaded = robot.load();
        let name = format!("random robot {seed} {kind:?}");
        interpreter_is_runtime::<f64>(&name, &loaded, &robot.frames(), Scalar::F64);
        interpreter_is_runtime::<f32>(&name, &loaded, &robot.frames(), Scalar::F32);
    }
}

#[test]
fn exact_programs_are_the_generic_runtime_for_robots_as_written() {
    use Style::{Digits, Exported, Ratios, Round, Tiny, Units};
    for (k, style) in [Digits(1), Digits(3), Digits(16), Exported, Round, Tiny, Ratios, Units].into_iter().enumerate() {
        let shape = Shape { joints: 2 + k % 3, fixed: 3, branched: k % 2 == 0, floating: k % 3 == 0, sliding: 4 };
        let robot = RandomRobot::as_written(style, shape, k as u64);
        let (loaded, name) = (robot.load(), format!("{style:?}, {shape:?}, seed {k}"));
        interpreter_is_runtime::<f64>(&name, &loaded, &robot.frames(), Scalar::F64);
        // where masses are as 1 to 1e±20, f32 has no numbers for them
        if style != Ratios {
            interpreter_is_runtime::<f32>(&name, &loaded, &robot.frames(), Scalar::F32);
        }
    }
}

fn compiled_is_runtime<T: Real + PartialEq>(all: &[Compiled<T>]) {
    let mut random = Random(2);
    for compiled in all.iter().filter(|c| c.exact) {
        let robot = Robot::load(compiled.robot);
        let loaded = programs::load(&programs::source(&robot), &programs::options(&robot).model);
        let numbers: Model<T> = loaded.model.cast();
        let frames: Vec<&Frame<T>> = robot.frames.iter().map(|f| numbers.frame(f).expect("a frame")).collect();
        for function in Function::all() {
            // of the two methods the build script took the cheaper: compiled code is one of them, bit for bit, everywhere
            let methods = if function == Function::ForwardDynamics { &METHODS[..] } else { &METHODS[..1] };
            let matches = |method: &ForwardDynamicsMethod, random: &mut Random| {
                (0..STATES).try_for_each(|_| {
                    let inputs = inputs::random(random, &loaded.model, function);
                    let x = cast::<T>(&inputs);
                    let (a, b) = (compiled.call(function, &x), function.evaluate(&numbers, &frames, *method, &x));
                    match a == b {
                        true => Ok(()),
                        false => Err(format!("compiled {a:?}, runtime {b:?}\n{}", ready_to_paste(&inputs))),
                    }
                })
            };
            let results: Vec<_> = methods.iter().map(|m| matches(m, &mut random)).collect();
            assert!(results.iter().any(Result::is_ok), "{} of {}: {results:?}", function.name(), robot.name);
        }
    }
}

#[test]
fn compiled_exact_code_is_the_generic_runtime() {
    compiled_is_runtime(compiled::F64);
    compiled_is_runtime(compiled::F32);
}

/// Robots that take long to compile again.
const LARGE: [&str; 2] = ["hyq", "simple_humanoid"];

fn compiled_is_program<T: Real + PartialEq>(all: &[Compiled<T>], scalar: Scalar, large: bool) {
    let mut random = Random(3);
    for compiled in all.iter().filter(|c| LARGE.contains(&c.robot) == large) {
        let robot = Robot::load(compiled.robot);
        let grade = if compiled.exact { Grade::Exact } else { Grade::Algebraic };
        let options = Options { scalar, grade, ..programs::options(&robot) };
        let loaded = programs::load(&programs::source(&robot), &options.model);
        for function in Function::all() {
            let program = program(&loaded, &robot.frames, function, &options);
            for _ in 0..STATES {
                let inputs = inputs::random(&mut random, &loaded.model, function);
                let x = cast::<T>(&inputs);
                let claim = format!("compiled and interpreted {} of {}, {grade:?}", function.name(), robot.name);
                assert_same(&claim, &inputs, &compiled.call(function, &x), &programs::run(&program, &x));
            }
        }
    }
}

#[test]
#[ignore = "slow proof: compiles with every set of rules"]
fn slow_proof_that_compiled_code_is_its_program_under_any_rules() {
    compiled_is_program(compiled::F64, Scalar::F64, false);
    compiled_is_program(compiled::F32, Scalar::F32, false);
}

#[test]
#[ignore = "slow proof: large robots"]
fn slow_proof_that_compiled_code_of_large_robots_is_its_program() {
    compiled_is_program(compiled::F64, Scalar::F64, true);
    compiled_is_program(compiled::F32, Scalar::F32, true);
}
