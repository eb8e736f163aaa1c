//! Mixed precision: a demanded error is met with less than all operations in f64, and the text computes what was analysed.

use straightline_codegen::certify::companion::{state_bound, Bits};
use straightline_codegen::certify::{certify, mixed, search, Effort, Interval};
use straightline_codegen::compile::compile;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::Graph;
use straightline_codegen::options::Options;
use straightline_codegen::program::input_box::input_box;
use straightline_codegen::program::program;
use straightline_codegen::scene::{Budget, InputRange as Range, JointRanges, MaxError, Scene};
use straightline_codegen::{model, Function, Scalar, Source};

const FUNCTION: Function = Function::InverseDynamics;

fn ur5() -> Source {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions/ur5.urdf");
    Source::new("ur5.urdf", std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

fn options(max_error: f64) -> Options {
    let mut scene = Scene::default();
    scene.ranges.qd = JointRanges::All(Range::within(0.5));
    scene.ranges.qdd = JointRanges::All(Range::within(1.0));
    let budget = Budget { max_error: Some(MaxError::All(max_error)), mixed_precision: true, ..Budget::default() };
    scene.budgets.insert(FUNCTION, budget);
    Options { scalar: Scalar::F32, functions: vec![FUNCTION], scene, ..Options::default() }
}

/// The function in f32 alone, and the box of its inputs.
fn in_single() -> (Graph, Vec<Interval>) {
    let options = options(1.0);
    let (loaded, complaints) = model::load(&ur5(), &options.model);
    let robot = Robot::new(loaded.unwrap_or_else(|| panic!("{}", complaints.render())));
    let graph = program(&robot, &[], FUNCTION, &options).graph;
    let ranges = input_box(&graph.inputs, &options.scene, &robot.model).expect("every input has a range");
    (graph, ranges)
}

#[test]
fn a_demanded_error_is_met_with_less_than_all_operations_in_f64() {
    let (graph, ranges) = in_single();
    let bounds = |graph: &Graph| certify(graph, Scalar::F32, &ranges, Effort::default()).expect("no division").errors;
    let single = bounds(&graph);
    let worst = single.iter().copied().fold(0.0, f64::max);
    let all = graph.counts().flops();
    let mut before = 0;
    for part in [1.0, 0.8, 0.6, 0.4] {
        let demand = vec![part * worst; single.len()];
        let mixed = mixed::widened(&graph, Scalar::F32, &ranges, &demand, &[]).expect("no division");
        let (double, errors) = (mixed::wide_operations(&mixed, Scalar::F32), bounds(&mixed));
        println!("{part} of {worst:e}: {double} of {all} operations in f64");
        assert!(errors.iter().all(|e| *e <= demand[0]), "{part}: {errors:?} > {:e}", demand[0]);
        assert!(double >= before && double < all, "{part}: {double} of {all}, before {before}");
        assert_eq!(double == 0, part == 1.0, "{part}");
        before = double;
        let found = search::worst_found(&mixed, Scalar::F32, &ranges, 6_000, 3);
        for (k, f) in found.iter().enumerate() {
            assert!(f.error <= errors[k], "{part}, tau[{k}]: {:e} > {:e} at {:?}", f.error, errors[k], f.inputs);
        }
        // that f64 is spent where it counts: what a search finds shrinks too
        if part == 0.4 {
            let alone = search::worst_found(&graph, Scalar::F32, &ranges, 6_000, 3);
            let most = |found: &[search::WorstFound]| found.iter().map(|f| f.error).fold(0.0, f64::max);
            assert!(most(&found) < 0.8 * most(&alone), "{:e} {:e}", most(&found), most(&alone));
        }
    }
}

/// Each result has a budget of its own: f64 goes where the tight one is, and what none meets is said result by result.
#[test]
fn a_budget_by_result_is_met_result_by_result() {
    let single = errors_in_single();
    let mut wanted: Vec<f64> = single.iter().map(|e| 2.0 * e).collect();
    wanted[5] = 0.5 * single[5];
    let by_result = |max_error: MaxError, mixed_precision: bool| {
        let mut options = options(1.0);
        let budget = Budget { max_error: Some(max_error), mixed_precision, ..Budget::default() };
        options.scene.budgets.insert(FUNCTION, budget);
        compile(&ur5(), &options)
    };
    let named = MaxError::Outputs(vec![("tau".to_string(), MaxError::Each(wanted.clone()))]);
    let generated = by_result(named, true).unwrap_or_else(|e| panic!("{}", e.render()));
    let errors = generated.report.functions["inverse_dynamics"].errors.as_ref().expect("errors were bounded");
    assert!(errors.bounds().zip(&wanted).all(|(bound, most)| bound <= *most), "{errors:?}");
    assert!(generated.text.contains("operations are in f64"), "nothing in f64");
    let refused = by_result(MaxError::Each(wanted), false).expect_err("f32 alone does not meet it").render();
    assert!(refused.contains("`tau[5]` of `inverse_dynamics` is bounded by"), "{refused}");
    let two = single.iter().enumerate().map(|(k, e)| if k < 2 { 0.5 * e } else { 2.0 * e }).collect();
    let refused = by_result(MaxError::Each(two), false).expect_err("f32 alone does not meet it").render();
    assert!(refused.contains("2 results") && refused.contains("`tau[0]`") && refused.contains("`tau[1]`"), "{refused}");
}

/// The bound at a state is one of the program in mixed precision, not of one in f32.
#[test]
fn the_bound_at_a_state_knows_what_is_in_f64() {
    let (graph, ranges) = in_single();
    let demand: Vec<f64> = errors_in_single().iter().map(|e| 0.4 * e).collect();
    let mixed = mixed::widened(&graph, Scalar::F32, &ranges, &demand, &[]).expect("no division");
    let bound = state_bound(&mixed, Scalar::F32, Bits::Plain).expect("the program is short");
    let of_single = state_bound(&graph, Scalar::F32, Bits::Plain).expect("the program is short");
    let mut less = 0;
    for seed in 0..20 {
        for found in search::worst_found(&mixed, Scalar::F32, &ranges, 300, seed) {
            let errors = search::errors_at(&mixed, Scalar::F32, &found.inputs);
            let bounds = search::computed_at(&bound, Scalar::F64, &found.inputs);
            let single = search::computed_at(&of_single, Scalar::F32, &found.inputs);
            for k in 0..errors.len() {
                assert!(errors[k] <= bounds[k], "tau[{k}]: {:e} > {:e} at {:?}", errors[k], bounds[k], found.inputs);
                less += usize::from(bounds[k] < 0.8 * single[k]);
            }
        }
    }
    // of 20 seeds, six results and six states
    assert!(less > 360, "{less}");
}

/// The errors of the function in f32 alone.
fn errors_in_single() -> Vec<f64> {
    let (graph, ranges) = in_single();
    certify(&graph, Scalar::F32, &ranges, Effort::default()).expect("no division").errors
}

/// The worst error of the function in f32 alone.
fn worst_in_single() -> f64 {
    errors_in_single().into_iter().fold(0.0, f64::max)
}

/// The generated text, compiled and run, gives the bits that the analysis is about.
#[test]
fn the_text_computes_what_was_analysed() {
    let demand = 0.7 * worst_in_single();
    let options = options(demand);
    let generated = compile(&ur5(), &options).unwrap_or_else(|e| panic!("{}", e.render()));
    assert!(
        generated.text.contains("f64::from(") && generated.text.contains("operations are in f64"),
        "nothing in f64"
    );
    let robot = Robot::new(generated.model.clone());
    let plain = program(&robot, &generated.frames, FUNCTION, &options).graph;
    let ranges = input_box(&plain.inputs, &options.scene, &robot.model).expect("every input has a range");
    let mixed = mixed::widened(&plain, Scalar::F32, &ranges, &[demand; 6], &[]).expect("no division");
    let input: Vec<f64> = (0..18).map(|k| f64::from((0.3 + 0.17 * k as f32).sin() * 0.5)).collect();
    let expected: Vec<u32> =
        search::computed_at(&mixed, Scalar::F32, &input).into_iter().map(|x| (x as f32).to_bits()).collect();
    let numbers = |of: &[f64]| of.iter().map(|x| format!("{:?}", *x as f32)).collect::<Vec<_>>().join(", ");
    let main = format!(
        "#![allow(dead_code)]\n{}\nfn main() {{ let mut tau = [0.0f32; 6]; inverse_dynamics(&[{}], &[{}], &[{}], &mut tau); \
         for t in tau {{ println!(\"{{}}\", t.to_bits()); }} }}\n",
        generated.text,
        numbers(&input[..6]),
        numbers(&input[6..12]),
        numbers(&input[12..]),
    );
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("mixed");
    std::fs::create_dir_all(&folder).expect("a folder for the program");
    let (source, binary) = (folder.join("main.rs"), folder.join("main"));
    std::fs::write(&source, main).expect("the program is written");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let mut command = std::process::Command::new(rustc);
    command.args(["--edition", "2021", "-O", "-o"]).arg(&binary).arg(&source);
    let compiled = command.output().expect("rustc runs");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = std::process::Command::new(&binary).output().expect("the program runs");
    let bits: Vec<u32> = String::from_utf8_lossy(&ran.stdout).lines().map(|l| l.parse().expect("a number")).collect();
    assert_eq!(bits, expected);
}

/// From all in f32 to all in f64: constants stand in f32 beside values that are made f64, and the like.
#[test]
fn every_budget_is_met_or_said_to_be_too_tight() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions/planar_2r.toml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let robot = Source::new("planar_2r.toml", text);
    let mut met = 0;
    for max_error in [1.2e-5, 4e-6, 3e-6, 2.5e-6, 2.2e-6, 1.8e-6, 1.5e-6, 1e-6] {
        match compile(&robot, &options(max_error)) {
            Ok(_) => met += 1,
            Err(said) => {
                assert!(said.iter().all(|d| d.code == "error-over-budget"), "{max_error:e}: {}", said.render())
            }
        }
    }
    assert!((4..8).contains(&met), "{met} of 8");
}
