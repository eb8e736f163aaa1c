//! Certified bounds of accelerations over boxes: arms have them, and what they rest on holds at states anywhere in the box.
//!
//! The table of the record is printed by
//! `cargo test --release -p straightline-codegen --test suite forward_dynamics_bounds:: -- --ignored --nocapture`.

use straightline_codegen::certify::{certify_with, search, Certificate, Effort, Interval, KnownSystem};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::input_box::input_box;
use straightline_codegen::program::{optimised, pivots, program};
use straightline_codegen::report::certificates::known;
use straightline_codegen::scene::{InputRange as Range, JointRanges, Scene};
use straightline_codegen::{Function, Scalar};
use straightline_core::Dd;

/// Arms, and whether they have a bound in f32 with slow joints, and with joints as fast as 10 rad/s or m/s.
const ARMS: [(&str, [bool; 2]); 8] = [
    ("planar2r.urdf", [true, true]),
    ("chapter_cylindrical.toml", [true, true]),
    ("chapter_stanford.toml", [true, true]),
    ("chapter_6r.toml", [true, true]),
    ("chapter_oblique.toml", [false, false]),
    ("puma560.urdf", [true, true]),
    ("ur5.urdf", [true, true]),
    ("panda.urdf", [false, false]),
];

struct Case {
    graph: Graph,
    ranges: Vec<Interval>,
    known: KnownSystem,
}

/// q within the limits of the robot file, |q̇| ≤ `speed`, |τ| within the file's limits.
fn case(file: &str, scalar: Scalar, speed: f64, chosen: bool) -> Case {
    case_of(Function::ForwardDynamics, file, scalar, speed, chosen)
}

fn case_of(function: Function, file: &str, scalar: Scalar, speed: f64, chosen: bool) -> Case {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let (loaded, complaints) = model::load(&Source::new(file, text), &ModelOptions::default());
    let robot = Robot::new(loaded.unwrap_or_else(|| panic!("{}", complaints.render())));
    let mut scene = Scene::default();
    scene.ranges.qd = JointRanges::All(Range::within(speed));
    let options = Options { scalar, scene, ..Options::default() };
    // without the search for the cheapest form, which takes long
    let plain = Optimisations { chosen: false, ..options.optimisations() };
    let graph = match chosen {
        true => program(&robot, &[], function, &options).graph,
        false => optimised(&robot, &[], function, &options, plain),
    };
    let ranges = input_box(&graph.inputs, &options.scene, &robot.model).expect("every input has a range");
    let known = known(&robot, function, &graph, &ranges, &options);
    Case { graph, ranges, known }
}

fn certificate(case: &Case, scalar: Scalar) -> Option<Certificate> {
    certify_with(&case.graph, scalar, &case.ranges, Effort::default(), &case.known).ok()
}

#[test]
#[ignore = "slow proof: certifies and searches every arm in both scalars"]
fn slow_proof_that_every_arm_has_bounds_of_its_accelerations_and_no_search_finds_more() {
    for (file, in_f32) in ARMS {
        for scalar in [Scalar::F64, Scalar::F32] {
            let case = case(file, scalar, 0.5, false);
            let Some(certificate) = certificate(&case, scalar) else {
                assert!(scalar == Scalar::F32 && !in_f32[0], "{file} has no bound in {scalar:?}");
                continue;
            };
            let found = search::worst_found(&case.graph, scalar, &case.ranges, 100, 3);
            for (k, (found, bound)) in found.iter().zip(&certificate.errors).enumerate() {
                assert!(found.error <= *bound, "{file}, {scalar:?}: {k}, {:e} > {bound:e}", found.error);
            }
            let magnitudes = certificate.magnitudes.iter();
            // a chain of seven with light links between: errors may add up to all of what is left of H on the way
            if scalar == Scalar::F64 && file != "panda.urdf" {
                let digits = certificate.errors.iter().zip(magnitudes).map(|(e, m)| e / m).fold(0.0, f64::max);
                assert!(digits < 1e-8, "{file}: {digits:e} of what accelerations can be");
            }
        }
    }
}

/// At states anywhere in the box, its corners too, exact values and adjoints are where mechanics has them.
#[test]
fn what_is_known_of_values_and_adjoints_holds_everywhere_in_the_box() {
    for (file, _) in ARMS {
        hold_everywhere(file, &case(file, Scalar::F64, 2.0, false), 8);
    }
}

/// The same of the derivatives of accelerations, found on the way or given.
#[test]
fn what_is_known_of_derivatives_holds_everywhere_in_the_box() {
    for function in [Function::ForwardDynamicsDerivatives, Function::ForwardDynamicsDerivativesAtMotion] {
        for file in ["planar2r.urdf", "ur5.urdf"] {
            hold_everywhere(file, &case_of(function, file, Scalar::F64, 2.0, false), 4);
        }
    }
}

fn hold_everywhere(file: &str, case: &Case, states: usize) {
    let (values, adjoints) = (case.known.values.len(), case.known.adjoints.len());
    assert!(values > 5 && adjoints > values, "{file}: {values} and {adjoints}");
    let mut probe = case.graph.clone();
    probe.results = case.graph.ids().collect();
    let mut seed = 5u64;
    let mut unit = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    for _ in 0..states {
        let place = |r: &Interval| match unit() {
            x if x < 0.1 => r.lo,
            x if x < 0.2 => r.hi,
            x if x < 0.3 => 0.0f64.clamp(r.lo, r.hi),
            _ => r.lo + unit() * (r.hi - r.lo),
        };
        let inputs: Vec<f64> = case.ranges.iter().map(place).collect();
        let at = evaluate::<Dd>(&probe, &inputs.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
        for (id, range) in &case.known.values {
            let x = at[id.index()].to_f64();
            assert!(range.lo <= x && x <= range.hi, "{file}: {x:e} is not in {range:?} at {inputs:?}");
        }
        for result in &case.graph.results {
            let of = pivots::adjoints(&case.graph, &at, *result);
            for (_, id, most) in case.known.adjoints.iter().filter(|(r, _, _)| r == result) {
                let x = of[id.index()].to_f64().abs();
                assert!(x <= *most, "{file}: {x:e} > {most:e} at {inputs:?}");
            }
        }
    }
}

/// What is known makes the difference: without, pivots may vanish.
#[test]
fn intervals_alone_give_no_bound() {
    let case = case("puma560.urdf", Scalar::F64, 0.5, false);
    assert!(certificate(&case, Scalar::F64).is_some());
    assert!(certify_with(&case.graph, Scalar::F64, &case.ranges, Effort::default(), &KnownSystem::default()).is_err());
}

#[test]
#[ignore = "prints the table of the record: minutes in release"]
fn bounds_of_arms() {
    for (file, in_f32) in ARMS {
        for (speed, has_f32) in [0.5, 10.0].into_iter().zip(in_f32) {
            for scalar in [Scalar::F64, Scalar::F32] {
                let case = case(file, scalar, speed, true);
                let start = std::time::Instant::now();
                let certificate = certificate(&case, scalar);
                let time = start.elapsed().as_secs_f64();
                assert!(certificate.is_some() || (scalar == Scalar::F32 && !has_f32), "{file}");
                let Some(certificate) = certificate else {
                    println!("{file}, {}, {speed}: none", scalar.name());
                    continue;
                };
                let words = |x: &[f64]| x.iter().map(|x| format!("{x:.1e}")).collect::<Vec<_>>().join(" ");
                let found = search::worst_found(&case.graph, scalar, &case.ranges, 20_000, 3);
                let found: Vec<f64> = found.iter().map(|f| f.error).collect();
                println!(
                    "{file}, {}, {speed}, {time:.2} s: {}; found {}; at most {}",
                    scalar.name(),
                    words(&certificate.errors),
                    words(&found),
                    words(&certificate.magnitudes)
                );
            }
        }
    }
}
