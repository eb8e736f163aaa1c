//! Certified bounds of rounding errors against the worst that a search finds, on all robots, in both formats.
//!
//! The long search is
//! `cargo test --release -p straightline-codegen --test suite certificates::no_search -- --ignored --nocapture`;
//! the table of the README is printed by the same with `certificates::bounds_of_the_panda`, how long a humanoid takes with `certificates::time_of_a_humanoid`.

use straightline_codegen::certify::{certify, search, Certificate, Effort, Interval};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph, Port};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::input_box::input_box;
use straightline_codegen::program::{optimised, program};
use straightline_codegen::scene::{InputRange as Range, JointRanges, Scene};
use straightline_codegen::{Function, Scalar, Source};
use straightline_core::Dd;

/// Robot files, and whether the base floats.
const ROBOTS: [(&str, bool); 11] = [
    ("planar2r.urdf", false),
    ("chapter_cylindrical.toml", false),
    ("chapter_stanford.toml", false),
    ("chapter_6r.toml", false),
    ("chapter_oblique.toml", false),
    ("puma560.urdf", false),
    ("ur5.urdf", false),
    ("panda.urdf", false),
    ("solo12.urdf", true),
    ("hyq.urdf", true),
    ("simple_humanoid.urdf", true),
];

const BOTH: [Scalar; 2] = [Scalar::F32, Scalar::F64];

/// The functions without division.
const FUNCTIONS: [Function; 13] = [
    Function::ForwardKinematics,
    Function::FrameVelocity,
    Function::FrameAcceleration,
    Function::Jacobian,
    Function::JacobianBias,
    Function::InverseDynamics,
    Function::GravityForce,
    Function::BiasForce,
    Function::VelocityForce,
    Function::MassMatrix,
    Function::JointWrenches,
    Function::Energy,
    Function::Momentum,
];

const FEW_RESULTS: [Function; 4] =
    [Function::InverseDynamics, Function::GravityForce, Function::Energy, Function::Momentum];

struct Case {
    robot: Robot,
    graph: Graph,
    ranges: Vec<Interval>,
}

/// `chosen`: as it is generated; else without the search for the cheapest form, which takes long for large robots.
fn case((file, floating_base): (&str, bool), function: Function, scalar: Scalar, scene: &Scene, chosen: bool) -> Case {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let model = ModelOptions { floating_base, ..ModelOptions::default() };
    let (loaded, complaints) = model::load(&Source::new(file, text), &model);
    let loaded = Robot::new(loaded.unwrap_or_else(|| panic!("{}", complaints.render())));
    let last = loaded.model.frames.last().expect("a robot has frames").name.clone();
    let options = Options { scalar, scene: scene.clone(), frames: vec![last], model, ..Options::default() };
    let plain = Optimisations { chosen: false, ..options.optimisations() };
    let graph = match chosen {
        true => program(&loaded, &options.frames, function, &options).graph,
        false => optimised(&loaded, &options.frames, function, &options, plain),
    };
    let ranges = input_box(&graph.inputs, scene, &loaded.model).expect("every input has a range");
    Case { robot: loaded, graph, ranges }
}

/// |q̇| ≤ `speed`, |q̈| ≤ `acceleration`, q within the limits of the robot file.
fn scene(speed: f64, acceleration: f64) -> Scene {
    let mut scene = Scene::default();
    scene.ranges.qd = JointRanges::All(Range::within(speed));
    scene.ranges.qdd = JointRanges::All(Range::within(acceleration));
    scene
}

fn certificate(case: &Case, scalar: Scalar, boxes: usize) -> Option<Certificate> {
    certify(&case.graph, scalar, &case.ranges, Effort { boxes, ..Effort::default() }).ok()
}

/// Searches; says what was found above a bound.
fn violations(case: &Case, scalar: Scalar, certificate: &Certificate, evaluations: usize) -> Vec<String> {
    let found = search::worst_found(&case.graph, scalar, &case.ranges, evaluations, 1);
    let beyond = found.iter().zip(&certificate.errors).enumerate().filter(|(_, (f, bound))| f.error > **bound);
    beyond.map(|(k, (f, bound))| format!("result {k}: {:e} > {bound:e} at {:?}", f.error, f.inputs)).collect()
}

fn search_all_robots(evaluations_per_function: usize) -> usize {
    let mut evaluations = 0;
    for robot in ROBOTS {
        for scalar in BOTH {
            for function in FUNCTIONS {
                // of the largest robot, what has few results
                if robot.0 == "simple_humanoid.urdf" && !FEW_RESULTS.contains(&function) {
                    continue;
                }
                let case = case(robot, function, scalar, &scene(1.0, 2.0), false);
                let Some(certificate) = certificate(&case, scalar, 1) else {
                    panic!("{} of {} has no bound", function.name(), robot.0);
                };
                let found = violations(&case, scalar, &certificate, evaluations_per_function);
                assert!(found.is_empty(), "{} of {} in {scalar:?}:\n{}", function.name(), robot.0, found.join("\n"));
                evaluations += evaluations_per_function;
            }
        }
    }
    evaluations
}

#[test]
fn no_short_search_finds_an_error_above_its_bound() {
    let evaluations = search_all_robots(50);
    assert!(evaluations >= 10_000, "{evaluations}");
}

#[test]
#[ignore = "slow proof: a hundred thousand evaluations"]
fn slow_proof_that_no_search_finds_an_error_above_its_bound() {
    let evaluations = search_all_robots(400);
    assert!(evaluations >= 100_000, "{evaluations}");
}

#[test]
#[ignore = "minutes in release"]
fn no_search_of_ten_million_evaluations_finds_an_error_above_its_bound() {
    assert!(search_all_robots(40_000) >= 10_000_000);
}

/// What the certificate calls exact is the model: the generic runtime in double-double, unoptimised.
#[test]
fn the_truth_of_a_certificate_is_the_model() {
    for robot in [("panda.urdf", false), ("ur5.urdf", false)] {
        let name = robot.0;
        for scalar in BOTH {
            let case = case(robot, Function::InverseDynamics, scalar, &scene(0.5, 1.0), true);
            let bounds = certificate(&case, scalar, 1).expect("inverse dynamics has no division").errors;
            for found in search::worst_found(&case.graph, scalar, &case.ranges, 2_000, 11) {
                let inputs: Vec<Dd> = found.inputs.iter().map(|x| Dd::from(*x)).collect();
                let model = &case.robot.model;
                let (q, rest) = inputs.split_at(model.nq());
                let (qd, qdd) = rest.split_at(model.nv());
                let groups = [q.to_vec(), qd.to_vec(), qdd.to_vec()];
                let method = straightline_codegen::ForwardDynamicsMethod::default();
                let truth = Function::InverseDynamics.evaluate(model, &[], method, &groups);
                let computed = search::computed_at(&case.graph, scalar, &found.inputs);
                let program = evaluate::<Dd>(&case.graph, &inputs);
                for k in 0..truth.len() {
                    let error = (truth[k] - Dd::from(computed[k])).to_f64().abs();
                    assert!(error <= bounds[k], "{name}, {scalar:?}, tau[{k}]: {error:e} > {:e}", bounds[k]);
                    // double-double rounding of both, scaled by what the terms can be
                    assert!((truth[k] - program[k]).to_f64().abs() < 1e-26, "{name}, tau[{k}]");
                }
            }
        }
    }
}

#[test]
fn bounds_are_finite_and_shrink_with_the_box() {
    let of = |robot: &'static str, scene: &Scene, boxes| {
        let case = case((robot, false), Function::InverseDynamics, Scalar::F32, scene, true);
        certificate(&case, Scalar::F32, boxes).expect("inverse dynamics has no division").errors
    };
    let (slow, fast) = (scene(0.5, 1.0), scene(2.0, 10.0));
    let (whole, cut) = (of("ur5.urdf", &slow, 1), of("ur5.urdf", &slow, 4));
    for k in 0..whole.len() {
        assert!(cut[k] <= whole[k], "tau[{k}]: {} {}", whole[k], cut[k]);
    }
    let (slow, fast) = (of("panda.urdf", &slow, 1), of("panda.urdf", &fast, 1));
    for k in 0..slow.len() {
        assert!(slow[k] < fast[k], "tau[{k}]: {} {}", slow[k], fast[k]);
    }
    // the closest published analysis of this box has about 2.5e-2 N·m
    assert!(slow.iter().all(|e| *e <= 4.2e-4), "{slow:?}");
}

/// The last joint, whose bound is the farthest from what is found. The scheduled search, which finds more, holds all to 20.
#[test]
fn forty_boxes_bring_the_bound_of_the_panda_near_the_worst_found() {
    let mut case = case(("panda.urdf", false), Function::InverseDynamics, Scalar::F32, &scene(0.5, 1.0), true);
    case.graph.results = case.graph.results.split_off(6);
    case.graph.outputs = vec![Port::new("tau", &[1])];
    let of = |boxes| certificate(&case, Scalar::F32, boxes).expect("inverse dynamics has no division").errors[0];
    let found = worst_of_searches(&case, Scalar::F32, 70_000)[0];
    let (before, after) = (of(1) / found, of(40) / found);
    println!("certified/found {before:.1}, in forty boxes {after:.1}");
    assert!(after < before && after >= 1.0, "{before} {after}");
    // 20, and what a search of minutes finds more than this one
    assert!(after <= 26.0, "{after}");
}

/// Bounds from many boxes are played from a tape, of angles that turn twice once: no search may see the difference.
#[test]
fn no_search_finds_an_error_above_a_bound_from_boxes() {
    for robot in [("panda.urdf", false), ("ur5.urdf", false), ("chapter_stanford.toml", false), ("solo12.urdf", true)] {
        for scalar in BOTH {
            let case = case(robot, Function::InverseDynamics, scalar, &scene(0.5, 1.0), false);
            let [whole, cut] = [1, 60].map(|boxes| certificate(&case, scalar, boxes).expect("no division"));
            let found = violations(&case, scalar, &cut, 4_000);
            assert!(found.is_empty(), "{} in {scalar:?}:\n{}", robot.0, found.join("\n"));
            assert!(cut.errors.iter().zip(&whole.errors).all(|(cut, whole)| cut <= whole));
            assert!(cut.errors != whole.errors && cut.magnitudes == whole.magnitudes);
        }
    }
}

/// A time budget stops the same search early: nothing is lost of what is proven without it.
#[test]
fn a_time_budget_gives_a_bound_whenever_it_ends() {
    let case = case(("ur5.urdf", false), Function::InverseDynamics, Scalar::F32, &scene(0.5, 1.0), true);
    let of = |effort| certify(&case.graph, Scalar::F32, &case.ranges, effort).expect("no division").errors;
    let (whole, cut) = (of(Effort::default()), of(Effort::new(Some(4), None, false)));
    let none = of(Effort { time: Some(std::time::Duration::ZERO), ..Effort::new(Some(4), None, false) });
    let ample = of(Effort::new(Some(4), Some(3600.0), false));
    assert_eq!((&none, &ample), (&whole, &cut));
    assert!(whole != cut);
}

/// f64 rounds as f32 does, 2^29 times finer: bounds scale with it.
#[test]
fn bounds_scale_with_the_format() {
    let robot = ("panda.urdf", false);
    let of = |scalar| {
        let case = case(robot, Function::GravityForce, scalar, &Scene::default(), true);
        certificate(&case, scalar, 1).expect("gravity forces have no division").errors
    };
    for (k, (single, double)) in of(Scalar::F32).into_iter().zip(of(Scalar::F64)).enumerate() {
        let ratio = single / double;
        // constants happen to be nearer to one format than to the other
        assert!(double == 0.0 || (2f64.powi(28)..2f64.powi(30)).contains(&ratio), "g[{k}]: {ratio:e}");
    }
}

/// The worst error of each result that seven searches find; they see more than a long one.
fn worst_of_searches(case: &Case, scalar: Scalar, evaluations: usize) -> Vec<f64> {
    let searches = (1..=7).map(|seed| search::worst_found(&case.graph, scalar, &case.ranges, evaluations / 7, seed));
    let found: Vec<_> = searches.collect();
    (0..case.graph.results.len()).map(|k| found.iter().map(|f| f[k].error).fold(0.0, f64::max)).collect()
}

#[test]
#[ignore = "prints the table of the README: minutes in release"]
fn bounds_of_the_panda() {
    let robot = ("panda.urdf", false);
    for (name, scene) in [("|qd| <= 0.5, |qdd| <= 1", scene(0.5, 1.0)), ("|qd| <= 2.4, |qdd| <= 15", scene(2.4, 15.0))]
    {
        let case = case(robot, Function::InverseDynamics, Scalar::F32, &scene, true);
        let timed = |effort: Effort| {
            let start = std::time::Instant::now();
            let bounds = certify(&case.graph, Scalar::F32, &case.ranges, effort).expect("no division").errors;
            (bounds, start.elapsed().as_secs_f64())
        };
        let (bounds, one_pass) = timed(Effort::default());
        let (cut, forty) = timed(Effort::new(Some(40), None, false));
        let (second, limited) = timed(Effort::new(None, Some(1.0), false));
        let found = worst_of_searches(&case, Scalar::F32, 7_000_000);
        let is_slow = name.starts_with("|qd| <= 0.5");
        for (k, error) in found.iter().enumerate() {
            let (whole, forty) = (bounds[k] / error, cut[k] / error);
            assert!(whole <= if is_slow { 26.0 } else { 75.0 }, "tau[{k}]: {whole}");
            assert!(!is_slow || forty <= 20.0, "tau[{k}]: {forty} with 40 boxes");
            assert!(!is_slow || second[k] / error <= 20.0, "tau[{k}]: {} in a second", second[k] / error);
        }
        println!("Panda, inverse dynamics, f32, {name} [N·m]");
        println!("one pass {one_pass:.3} s, 40 boxes {forty:.3} s, time budget of 1 s {limited:.3} s");
        println!("joint  certified    40 boxes     1 s          found        certified/found");
        for (k, error) in found.into_iter().enumerate() {
            println!(
                "{:<6} {:<12.2e} {:<12.2e} {:<12.2e} {error:<12.2e} {:.1}, {:.1}, {:.1}",
                k + 1,
                bounds[k],
                cut[k],
                second[k],
                bounds[k] / error,
                cut[k] / error,
                second[k] / error
            );
        }
    }
}

/// Least of five: other work on the machine only adds.
#[test]
#[ignore = "measures a time: in release, on a machine that does nothing else"]
fn time_of_a_humanoid() {
    let case = case(("simple_humanoid.urdf", true), Function::InverseDynamics, Scalar::F32, &scene(0.5, 1.0), false);
    let mut least = f64::INFINITY;
    for _ in 0..5 {
        let start = std::time::Instant::now();
        let bounds = certificate(&case, Scalar::F32, 1).expect("inverse dynamics has no division").errors;
        least = least.min(start.elapsed().as_secs_f64());
        assert!(bounds.iter().all(|e| e.is_finite()));
    }
    println!("humanoid of {} coordinates, inverse dynamics, f32, one pass: {least:.3} s", case.robot.model.nv());
    assert!(least <= 1.0, "{least} s");
}

#[test]
#[ignore = "prints certified/found of all robots: minutes in release"]
fn ratios_of_all_robots() {
    for robot in ROBOTS {
        for scalar in BOTH {
            for (name, scene) in [("slow", scene(0.5, 1.0)), ("full", scene(2.4, 15.0))] {
                let case = case(robot, Function::InverseDynamics, scalar, &scene, robot.0 != "simple_humanoid.urdf");
                let start = std::time::Instant::now();
                let bounds = certificate(&case, scalar, 1).expect("inverse dynamics has no division").errors;
                let time = start.elapsed().as_secs_f64();
                let found = worst_of_searches(&case, scalar, 2_000 * case.graph.results.len());
                let ratios: Vec<String> = bounds.iter().zip(found).map(|(b, f)| format!("{:.0}", b / f)).collect();
                println!("{}, {}, {name}, {time:.2} s: {}", robot.0, scalar.name(), ratios.join(" "));
            }
        }
    }
}
