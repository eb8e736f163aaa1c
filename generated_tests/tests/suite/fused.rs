//! Fused multiply-add: every sum that counts as fused is, and the results stay as exact as without.

use straightline_codegen::compile::compile;
use straightline_codegen::emit::rust::Rust;
use straightline_codegen::emit::{fused, Target};
use straightline_codegen::options::Options;
use straightline_codegen::schedule::ScheduleLimits;
use straightline_codegen::Function;
use straightline_core::{trig, Dd};
use straightline_generated_tests::bounds::FUSED;
use straightline_generated_tests::compiled::fused_solo12 as solo12;
use straightline_generated_tests::inputs;
use straightline_generated_tests::programs::{self, cast, program};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::Robot;

#[test]
fn every_sum_that_counts_as_fused_is_fused() {
    for robot in ["planar2r", "chapter_oblique", "panda", "solo12"].map(Robot::load).iter() {
        let functions = vec![
            Function::InverseDynamics,
            Function::MassMatrix,
            Function::ForwardDynamics,
            Function::InverseDynamicsDerivatives,
        ];
        let options = Options { functions, fma: true, ..programs::options(robot) };
        let source = programs::source(robot);
        let generated = compile(&source, &options).unwrap_or_else(|d| panic!("{}", d.render()));
        for item in &generated.items {
            let program = programs::of_robot(robot, item.function, &options);
            let counts = program.graph.counts();
            let calls = Rust.routine(&item.routine).matches("fma(").count();
            let fused = counts.mul + counts.add - counts.fma;
            let name = format!("{} of {}", item.function.name(), robot.name);
            match program.schedule.parts.len() {
                1 => assert_eq!(calls, fused, "{name}"),
                // a product that crosses to the next part stands alone
                parts => assert!(calls <= fused && calls + parts * 10 > fused, "{name}: {calls} of {fused}"),
            }
        }
    }
}

#[test]
fn without_the_option_nothing_is_fused() {
    let robot = Robot::load("panda");
    let text = compile(&programs::source(&robot), &programs::options(&robot)).unwrap().text;
    assert!(!text.contains("fma(") && !text.contains("mul_add("));
}

/// Each batch state against the program in double-double; the crate of this test is compiled without the instruction, so
/// that the plain functions stay the unfused ones.
#[test]
fn fused_results_are_as_exact_as_the_others() {
    let robot = Robot::load("solo12");
    // as in the build script
    let options = Options { fma: true, limits: ScheduleLimits { operations: 900 }, ..programs::options(&robot) };
    let loaded = programs::load(&programs::source(&robot), &options.model);
    type Batch = fn(usize, &[f64], &[f64], &[f64], &mut [f64]) -> Result<(), solo12::batch::WrongLength>;
    type Plain = fn(&[f64; 19], &[f64; 18], &[f64; 18], &mut [f64; 18]);
    let subjects: [(Function, Batch, Plain); 2] = [
        (Function::InverseDynamics, solo12::inverse_dynamics_batch_aos, solo12::inverse_dynamics),
        (Function::ForwardDynamics, solo12::forward_dynamics_batch_aos, solo12::forward_dynamics),
    ];
    const N: usize = 40;
    for (function, batch, plain) in subjects {
        let program = program(&loaded, &robot.frames, function, &options);
        let mut random = Random(17);
        let states: Vec<Vec<Vec<f64>>> = (0..N).map(|_| inputs::random(&mut random, &loaded.model, function)).collect();
        let all = |k: usize| states.iter().flat_map(|s| s[k].clone()).collect::<Vec<f64>>();
        let mut found = vec![0.0; N * 18];
        batch(N, &all(0), &all(1), &all(2), &mut found).unwrap();
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("fma") {
            let sin_cos = |x| trig::sin_cos_of_sum_fused_f64(x, f64::mul_add);
            let interpreted = |s: &Vec<Vec<f64>>| {
                fused::evaluate((&program.graph, &program.schedule), &s.concat(), f64::mul_add, sin_cos)
            };
            let interpreted: Vec<f64> = states.iter().flat_map(interpreted).collect();
            assert_eq!(found, interpreted, "{function:?}: what is verified is what runs, bit by bit");
        }
        let (mut differ, mut worst, mut worst_plain) = (0, 0.0_f64, 0.0_f64);
        for (state, found) in states.iter().zip(found.chunks(18)) {
            let truth: Vec<f64> = programs::run::<Dd>(&program, &cast(state)).into_iter().map(|x| x.to_f64()).collect();
            let scale = truth.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let mut alone = [0.0; 18];
            let array = |k: usize| state[k].as_slice().try_into().expect("18 velocities");
            plain(state[0].as_slice().try_into().expect("19 coordinates"), array(1), array(2), &mut alone);
            for ((found, alone), truth) in found.iter().zip(alone).zip(truth) {
                differ += usize::from(*found != alone);
                worst = worst.max((found - truth).abs() / scale);
                worst_plain = worst_plain.max((alone - truth).abs() / scale);
            }
        }
        // fewer roundings, elsewhere: never much worse, and well inside the bar of the plain functions
        assert!(worst <= 3.0 * worst_plain && FUSED.allows(worst), "{function:?}: {worst:e}, plain {worst_plain:e}");
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("fma") && !cfg!(target_feature = "fma") {
            assert!(differ > 0, "{function:?}: nothing was fused");
        }
    }
}
