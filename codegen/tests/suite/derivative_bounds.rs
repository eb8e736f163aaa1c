//! Certified bounds of derivatives: of their rounding errors, beside what searches find, and of how fast torques and accelerations can change.
//!
//! `cargo test -p straightline-codegen --test suite derivative_bounds:: -- --nocapture` prints what the guide says of them.

use straightline_codegen::certify::slopes::{greatest_singular_value, known_magnitudes, magnitudes};
use straightline_codegen::certify::{certify_with, search, Certificate, Effort, Interval, KnownSystem};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::input_box::input_box;
use straightline_codegen::program::{optimised, program};
use straightline_codegen::report::certificates::known;
use straightline_codegen::scene::{InputRange as Range, JointRanges, Scene};
use straightline_codegen::{Function, Scalar};
use straightline_core::random::Random;

/// A program in its box.
struct Case {
    graph: Graph,
    ranges: Vec<Interval>,
    known: KnownSystem,
    nv: usize,
}

/// q within the limits of the robot file, |q̇| ≤ 0.5, |q̈| ≤ 1: the box of RoboPrec (Yilmaz et al. 2026). |τ| within the file's limits.
fn case(file: &str, function: Function, scalar: Scalar, chosen: bool) -> Case {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let (loaded, complaints) = model::load(&Source::new(file, text), &ModelOptions::default());
    let robot = Robot::new(loaded.unwrap_or_else(|| panic!("{}", complaints.render())));
    let mut scene = Scene::default();
    scene.ranges.qd = JointRanges::All(Range::within(0.5));
    scene.ranges.qdd = JointRanges::All(Range::within(1.0));
    let options = Options { scalar, scene, ..Options::default() };
    // without the search for the cheapest form, which takes long
    let plain = Optimisations { chosen: false, substitutes: false, ..options.optimisations() };
    let graph = match chosen {
        true => program(&robot, &[], function, &options).graph,
        false => optimised(&robot, &[], function, &options, plain),
    };
    let ranges = input_box(&graph.inputs, &options.scene, &robot.model).expect("every input has a range");
    let known = match function.spec().judged.is_by_equations() {
        true => known(&robot, function, &graph, &ranges, &options),
        false => KnownSystem::default(),
    };
    Case { graph, ranges, known, nv: robot.model.nv() }
}

impl Case {
    fn certificate(&self, scalar: Scalar) -> Option<Certificate> {
        certify_with(&self.graph, scalar, &self.ranges, Effort::default(), &self.known).ok()
    }

    /// The greatest number of each output.
    fn greatest(&self, of_results: &[f64]) -> Vec<f64> {
        let mut first = 0;
        let of = self.graph.outputs.iter().map(|port| {
            let own = &of_results[first..first + port.len()];
            first += port.len();
            own.iter().fold(0.0f64, |most, x| most.max(*x))
        });
        of.collect()
    }

    /// Searches for errors above their bounds; the worst found of each result.
    fn search(&self, scalar: Scalar, bounds: &[f64], evaluations: usize, failures: &mut Vec<String>) -> Vec<f64> {
        let found = search::worst_found(&self.graph, scalar, &self.ranges, evaluations, 5);
        for (k, (found, bound)) in found.iter().zip(bounds).enumerate().filter(|(_, (f, bound))| f.error > **bound) {
            failures.push(format!("{k} in {scalar:?}: {:e} > {bound:e} at {:?}", found.error, found.inputs));
        }
        found.iter().map(|found| found.error).collect()
    }

    /// The greatest absolute value of each result that a climb finds in the box, and of each output the greatest singular value, of vectors the size.
    fn steepest(&self, steps: usize) -> (Vec<f64>, Vec<f64>) {
        let mut random = Random(3);
        let all = |inputs: &[f64]| {
            let signed = evaluate::<f64>(&self.graph, inputs);
            let mut all: Vec<f64> = signed.iter().map(|x| x.abs()).collect();
            let mut first = 0;
            for port in &self.graph.outputs {
                all.push(singular_value(&signed[first..first + port.len()], port.shape.last().copied().unwrap_or(1)));
                first += port.len();
            }
            all
        };
        let place = |random: &mut Random, r: &Interval| match random.below(4) {
            0 => r.lo,
            1 => r.hi,
            _ => r.lo + random.unit() * (r.hi - r.lo),
        };
        let mut best: Vec<(f64, Vec<f64>)> = Vec::new();
        for step in 0..steps {
            let inputs: Vec<f64> = match step < steps / 4 {
                true => self.ranges.iter().map(|r| place(&mut random, r)).collect(),
                false => {
                    let mut inputs = best[step % best.len()].1.clone();
                    for _ in 0..1 + random.below(3) {
                        let i = random.below(inputs.len());
                        let r = self.ranges[i];
                        let moved = inputs[i] + (r.hi - r.lo) * random.symmetric(1.0) * (-6.0 * random.unit()).exp();
                        inputs[i] = moved.clamp(r.lo, r.hi);
                    }
                    inputs
                }
            };
            let found = all(&inputs);
            if best.is_empty() {
                best = found.iter().map(|x| (*x, inputs.clone())).collect();
            }
            for (best, found) in best.iter_mut().zip(found).filter(|(best, found)| *found > best.0) {
                *best = (found, inputs.clone());
            }
        }
        let mut most: Vec<f64> = best.into_iter().map(|(x, _)| x).collect();
        let norms = most.split_off(self.graph.results.len());
        (most, norms)
    }
}

/// The greatest singular value, from below: by powers of MᵀM.
fn singular_value(matrix: &[f64], columns: usize) -> f64 {
    let mut v: Vec<f64> = (0..columns).map(|k| 1.0 + 0.1 * k as f64).collect();
    let mut found = 0.0f64;
    for _ in 0..12 {
        let size = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if size == 0.0 {
            break;
        }
        v.iter_mut().for_each(|x| *x /= size);
        let image: Vec<f64> = matrix.chunks(columns).map(|row| row.iter().zip(&v).map(|(m, v)| m * v).sum()).collect();
        found = found.max(image.iter().map(|x| x * x).sum::<f64>().sqrt());
        v = (0..columns).map(|j| matrix.chunks(columns).zip(&image).map(|(row, y)| row[j] * y).sum()).collect();
    }
    found
}

fn words(numbers: &[f64]) -> String {
    numbers.iter().map(|x| format!("{x:.1e}")).collect::<Vec<_>>().join(" ")
}

/// RoboPrec has about 2.5e5 for the Panda in f32, and 5e-4 in f64.
#[test]
fn derivatives_of_inverse_dynamics_have_bounds_that_say_something_and_no_search_finds_more() {
    let mut failures = Vec::new();
    for (file, most) in [("panda.urdf", [2.6e-4, 3.5e-5, 1.4e-5, 1.7e-4]), ("ur5.urdf", [3.5e-5, 1.2e-5, 5e-6, 3.4e-5])]
    {
        let function = Function::InverseDynamicsDerivatives;
        for (scalar, finer) in [(Scalar::F32, 1.0), (Scalar::F64, 2f64.powi(29))] {
            let case = case(file, function, scalar, true);
            let start = std::time::Instant::now();
            let certificate = case.certificate(scalar).expect("nothing is divided by");
            let time = start.elapsed().as_secs_f64();
            let found = case.search(scalar, &certificate.errors, 4_000, &mut failures);
            let bounds = case.greatest(&certificate.errors);
            println!(
                "{file}, {}, {time:.2} s: K, D, H, τ at most {}; found {}",
                scalar.name(),
                words(&bounds),
                words(&case.greatest(&found))
            );
            let too_great = bounds.iter().zip(most).filter(|(bound, most)| **bound > most / finer * 1.05);
            failures.extend(too_great.map(|(bound, _)| format!("{file}, {scalar:?}: {bound:e}")));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// What is made of derivatives, and regressors, which are polynomials in sines as torques are: bounds that no search exceeds, and of which a part
/// is found.
#[test]
fn products_regressors_and_centroidal_maps_have_bounds() {
    use Function::{
        BiasDerivatives, CentreOfMassJacobian, CentroidalDerivatives, CentroidalMapRate, CoriolisMatrix,
        CoriolisTransposeForce, EnergyRegressor, GravityDerivative, InverseDynamicsHvp, InverseDynamicsJvp,
        InverseDynamicsVjp, MomentumRegressor, TorqueRegressor,
    };
    let mut failures = Vec::new();
    for function in [
        InverseDynamicsJvp,
        InverseDynamicsVjp,
        InverseDynamicsHvp,
        GravityDerivative,
        BiasDerivatives,
        CoriolisMatrix,
        CoriolisTransposeForce,
        CentreOfMassJacobian,
        CentroidalMapRate,
        CentroidalDerivatives,
        TorqueRegressor,
        MomentumRegressor,
        EnergyRegressor,
    ] {
        for scalar in [Scalar::F32, Scalar::F64] {
            let case = case("ur5.urdf", function, scalar, false);
            let Some(certificate) = case.certificate(scalar) else {
                failures.push(format!("{} has none", function.name()));
                continue;
            };
            let found = case.search(scalar, &certificate.errors, 1_000, &mut failures);
            let (bounds, found) = (case.greatest(&certificate.errors), case.greatest(&found));
            println!("{}, {}: at most {}; found {}", function.name(), scalar.name(), words(&bounds), words(&found));
            for (bound, found) in bounds.iter().zip(found) {
                // a block of ones and zeros is exact
                if *bound > 1000.0 * found {
                    failures.push(format!("{}, {scalar:?}: {bound:e}, found {found:e}", function.name()));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// No derivative in the box is above its bound, and cut boxes bring bounds near the greatest that is found.
#[test]
fn torques_change_no_faster_than_their_lipschitz_constants() {
    let mut failures = Vec::new();
    for (file, boxes, near) in [("planar2r.urdf", 200, 1.02), ("ur5.urdf", 60, 10.0), ("panda.urdf", 60, 20.0)] {
        let case = case(file, Function::InverseDynamicsDerivatives, Scalar::F64, false);
        let (found, norms) = case.steepest(4_000);
        let of = |boxes| {
            let effort = Effort { boxes, ..Effort::default() };
            magnitudes(&case.graph, Scalar::F64, &case.ranges, effort, &case.known).expect("nothing is divided by")
        };
        let (whole, cut) = (of(1), of(boxes));
        let mut first = 0;
        for (port, norm) in case.graph.outputs.iter().zip(norms) {
            let own = first..first + port.len();
            first = own.end;
            for k in own.clone() {
                if found[k] > cut[k] || cut[k] > whole[k] {
                    failures.push(format!("{file} {}: {:e} {:e} {:e}", port.name, found[k], cut[k], whole[k]));
                }
            }
            if port.shape.len() == 2 {
                let bounds = [&whole, &cut].map(|all| greatest_singular_value(&all[own.clone()], port.shape[1]));
                println!("{file}, {}: norm {norm:.3e}, at most {}", port.name, words(&bounds));
                if norm > bounds[1] || bounds[1] > near * norm {
                    failures.push(format!("{file} {}: {norm:e} {bounds:?}", port.name));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Derivatives of accelerations, over the same box: what mechanics knows of the equations that each column solves.
#[test]
fn derivatives_of_forward_dynamics_have_bounds_over_a_box() {
    let mut failures = Vec::new();
    for function in [Function::ForwardDynamicsDerivativesAtMotion, Function::ForwardDynamicsDerivatives] {
        for (file, in_f32) in [("planar2r.urdf", true), ("ur5.urdf", true)] {
            for scalar in [Scalar::F64, Scalar::F32] {
                let case = case(file, function, scalar, false);
                let start = std::time::Instant::now();
                let certificate = case.certificate(scalar);
                let time = start.elapsed().as_secs_f64();
                let Some(certificate) = certificate else {
                    println!("{file}, {}, {}: none", function.name(), scalar.name());
                    if scalar == Scalar::F64 || in_f32 {
                        failures.push(format!("{file}, {} in {scalar:?} has no bound", function.name()));
                    }
                    continue;
                };
                let found = case.search(scalar, &certificate.errors, 500, &mut failures);
                let (steepest, _) = case.steepest(500);
                let beyond = steepest.iter().zip(&certificate.magnitudes).filter(|(found, most)| found > most);
                failures.extend(beyond.map(|(f, most)| format!("{file}, {}: {f:e} > {most:e}", function.name())));
                println!(
                    "{file}, {}, {}, {} coordinates, {time:.2} s: at most {}; found {}; magnitudes {}; found {}",
                    function.name(),
                    scalar.name(),
                    case.nv,
                    words(&case.greatest(&certificate.errors)),
                    words(&case.greatest(&found)),
                    words(&case.greatest(&certificate.magnitudes)),
                    words(&case.greatest(&steepest)),
                );
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// What mechanics knows of exact derivatives bounds them on robots of which rounding errors add up to more than they are.
#[test]
fn accelerations_change_no_faster_than_their_lipschitz_constants() {
    let mut failures = Vec::new();
    for (file, most) in [("ur5.urdf", [5e3, 2e3, 68.0]), ("panda.urdf", [2e5, 1.6e4, 480.0])] {
        let case = case(file, Function::ForwardDynamicsDerivativesAtMotion, Scalar::F64, false);
        let certificate = case.certificate(Scalar::F64).expect("pivots stay off zero");
        let known = known_magnitudes(&case.graph, &case.known);
        let bounds: Vec<f64> = certificate.magnitudes.iter().zip(&known).map(|(a, b)| a.min(*b)).collect();
        let (found, norms) = case.steepest(4_000);
        let beyond = found.iter().zip(&bounds).filter(|(found, bound)| found > bound);
        failures.extend(beyond.map(|(found, bound)| format!("{file}: {found:e} > {bound:e}")));
        let (of_bounds, of_found) = (case.greatest(&bounds), case.greatest(&found));
        println!("{file}: ∂q̈/∂q, ∂q̈/∂q̇, H⁻¹ at most {}; found {}", words(&of_bounds), words(&of_found));
        let mut first = 0;
        for ((port, norm), most) in case.graph.outputs.iter().zip(norms).zip(most) {
            let own = first..first + port.len();
            first = own.end;
            let bound = greatest_singular_value(&bounds[own.clone()], port.shape[1]);
            println!("{file}, {}: norm {norm:.3e}, at most {bound:.3e}", port.name);
            let entry = bounds[own].iter().fold(0.0, |most: f64, x| most.max(*x));
            if norm > bound || entry > most {
                failures.push(format!("{file}, {}: {norm:e} {bound:e} {entry:e}", port.name));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
