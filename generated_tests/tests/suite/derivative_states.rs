//! Derivatives against values with 25 digits: all robots and states of the data, in double-double, f64 and f32.

use super::mutants::escaping;
use std::fmt::Write;
use straightline_codegen::options::Options;
use straightline_codegen::scene::{CoulombForm, Gravity};
use straightline_codegen::{Function, Scalar};
use straightline_core::{Dd, Dual, Real};
use straightline_generated_tests::bounds::DATA;
use straightline_generated_tests::compiled;
use straightline_generated_tests::derivative_data::{
    functions, of_displacements, DerivativeRobot, DerivativeState, ARMS, LEGGED,
};
use straightline_generated_tests::programs::{self, cast};

/// Of the greatest entry of a block, in f64 and in f32; or what Pinocchio loses, if that is more.
const BOUND: f64 = 1e-15;
const BOUND_F32: f64 = 1e-6;
/// What is solved for loses what H costs: so many times what Pinocchio loses, in f32 times how much longer its roundings are.
const SOLVED: f64 = 3.0;
/// The same of second derivatives, which take six times the operations; what Pinocchio's record has of them are differences.
const BOUND_SECOND: f64 = 4e-15;
const BOUND_F32_SECOND: f64 = 4e-6;

/// What f64 may lose of a block of which Pinocchio loses so much.
fn most(function: Function, pinocchio: f64) -> f64 {
    match function.spec().solves {
        true => (SOLVED * pinocchio).max(BOUND),
        false if function == Function::InverseDynamicsHvp => BOUND_SECOND,
        false => pinocchio.max(BOUND),
    }
}

/// What f32 may lose.
fn most_f32(function: Function, block: &str, pinocchio: f64) -> f64 {
    match function.spec().solves {
        true => (SOLVED * pinocchio * (f64::from(f32::EPSILON) / f64::EPSILON)).max(BOUND_F32),
        false if block.starts_with("hvp") => BOUND_F32_SECOND,
        false => BOUND_F32,
    }
}

fn all() -> impl Iterator<Item = DerivativeRobot> {
    ARMS.iter().chain(LEGGED).map(|name| DerivativeRobot::load(name))
}

fn results<T: Real>(robot: &DerivativeRobot, function: Function, options: &Options, state: &DerivativeState) -> Vec<T> {
    results_at(robot, function, options, state, state.inputs(function))
}

fn results_at<T: Real>(
    robot: &DerivativeRobot,
    function: Function,
    options: &Options,
    state: &DerivativeState,
    inputs: Vec<Vec<f64>>,
) -> Vec<T> {
    // one program for all states with a gravity of their own
    let mut options = options.clone();
    let mut inputs = cast::<T>(&inputs);
    if state.kind == "gravity_tilted" {
        options.scene.gravity = Gravity::Input;
        inputs.extend(cast::<T>(&[state.gravity.to_vec()]));
    }
    // a quaternion has length one in all digits, as in the data
    if robot.floating {
        let length = inputs[0][3..7].iter().fold(T::zero(), |sum, x| sum + *x * *x).sqrt();
        inputs[0][3..7].iter_mut().for_each(|x| *x = *x / length);
    }
    let program = robot.program(function, &options);
    // gravity where it is read
    inputs.truncate(program.graph.inputs.len());
    programs::run::<T>(&program, &inputs)
}

/// Each robot, function and block with its worst error; fails where one is beyond its bound.
fn table<T: Real + Into<Dd>>(
    claim: &str,
    robots: &[&str],
    options: impl Fn(&DerivativeRobot) -> Options,
    bound: impl Fn(Function, f64) -> f64,
) {
    let (mut rows, mut failures) = (String::new(), String::new());
    for robot in robots.iter().map(|name| DerivativeRobot::load(name)) {
        for function in functions() {
            let mut worst: Vec<(f64, String)> = vec![(0.0, String::new()); robot.baseline(function).len()];
            for state in &robot.states {
                let results = results::<T>(&robot, function, &options(&robot), state);
                for ((block, own), worst) in state.blocks(function, &results).into_iter().zip(&mut worst) {
                    let error = block.error(own);
                    if error > worst.0 {
                        *worst = (error, format!("{} {}", block.name, state.id));
                    }
                }
            }
            for ((error, place), baseline) in worst.iter().zip(robot.baseline(function)) {
                let most = bound(function, baseline);
                let row = format!("{:<20} {error:9.1e} {most:9.1e} {baseline:9.1e}  {place}", robot.name);
                let _ = writeln!(rows, "{row}");
                if *error > most {
                    let _ = writeln!(failures, "{row}");
                }
            }
        }
    }
    println!("{claim}\n{:<20} {:>9} {:>9} {:>9}  worst in\n{rows}", "robot", "error", "bound", "Pinocchio");
    assert!(failures.is_empty(), "{claim}\n{failures}");
}

/// In the data angles count as they are written.
fn as_written(robot: &DerivativeRobot) -> Options {
    let mut options = robot.options();
    options.model.angle_tolerance = 0.0;
    options
}

#[test]
fn derivatives_are_those_of_the_data_to_their_last_digits() {
    table::<Dd>("double-double", ARMS, as_written, |_, _| DATA.most);
}

#[test]
fn derivatives_in_f64_lose_no_more_than_pinocchio() {
    table::<f64>("f64", ARMS, DerivativeRobot::options, most);
}

#[test]
#[ignore = "slow proof: programs of some ten thousand operations are searched"]
fn slow_proof_that_derivatives_of_legged_robots_are_those_of_the_data() {
    table::<Dd>("double-double", LEGGED, as_written, |_, _| DATA.most);
    table::<f64>("f64", LEGGED, DerivativeRobot::options, most);
    in_f32_keep_six_digits(LEGGED);
}

/// Ḣ is given, and C by its product with q̇: the data leave open which C it is.
fn hold_coriolis_matrix<T: Real + Into<Dd>>(options: impl Fn(&DerivativeRobot) -> Options, most: f64) {
    let function = Function::CoriolisMatrix;
    for robot in all() {
        let mut worst = 0.0f64;
        for state in &robot.states {
            let inputs = state.inputs(Function::BiasDerivatives);
            let qd = cast::<T>(&inputs)[1].clone();
            let results = results_at::<T>(&robot, function, &options(&robot), state, inputs);
            let (c, h_dot) = results.split_at(qd.len() * qd.len());
            let row = |row: &[T]| row.iter().zip(&qd).fold(T::zero(), |sum, (c, rate)| sum + *c * *rate);
            let product: Vec<T> = c.chunks(qd.len()).map(row).collect();
            let [c_qd, rate] = state.coriolis();
            for (block, own) in [(c_qd, &product[..]), (rate, h_dot)] {
                let error = block.error(own);
                worst = worst.max(error);
                assert!(error <= most, "{} in {}: {error:e}", block.name, state.id);
            }
            // Ḣ = C + Cᵀ: Ḣ − 2 C is skew
            let greatest = c.iter().chain(h_dot).fold(0.0f64, |most, x| most.max((*x).into().to_f64().abs()));
            for (i, rate) in h_dot.iter().enumerate() {
                let transposed = c[i % qd.len() * qd.len() + i / qd.len()];
                let left: Dd = (*rate - c[i] - transposed).into();
                assert!(left.to_f64().abs() <= most * greatest, "Ḣ − C − Cᵀ in {}: {}", state.id, left.to_f64());
            }
        }
        println!("{:<20} {worst:.1e}", robot.name);
    }
}

#[test]
fn the_coriolis_matrix_times_velocities_and_the_rate_of_the_mass_matrix_are_those_of_the_data() {
    hold_coriolis_matrix::<Dd>(as_written, DATA.most);
    // the product with q̇ is rounded, too
    hold_coriolis_matrix::<f64>(DerivativeRobot::options, 2.0 * BOUND);
}

/// A few roundings: an exponential of an angle and a square root.
const DISPLACED: f64 = 9.0;

/// Displacements of any size, whose quaternions count as they are written.
fn hold_displacements<T: Real + Into<Dd>>(most: f64) {
    let mut asked = 0;
    for robot in LEGGED.iter().map(|name| DerivativeRobot::load(name)) {
        for function in of_displacements() {
            let program = robot.program(function, &as_written(&robot));
            for state in &robot.displacements {
                let found = programs::run::<T>(&program, &cast::<T>(&state.inputs(function)));
                for (block, own) in state.blocks(function, &found) {
                    let error = block.error(own);
                    assert!(error <= most, "{} in {} ({}): {error:e}", block.name, state.id, state.kind);
                    asked += 1;
                }
            }
        }
    }
    assert_eq!(asked, 2 * 16 * 6);
}

#[test]
fn displacements_and_their_derivatives_are_those_of_the_data() {
    hold_displacements::<Dd>(DATA.most);
    hold_displacements::<f64>(DISPLACED * f64::EPSILON);
}

/// What carries one tangent along is the matrix that carries all.
#[test]
fn transport_is_the_product_with_the_derivatives() {
    for robot in LEGGED.iter().map(|name| DerivativeRobot::load(name)) {
        let program = |function| robot.program(function, &robot.options());
        let [maps, transport] = [Function::IntegrateDerivatives, Function::IntegrateTransport].map(program);
        for state in &robot.displacements {
            let mut inputs = cast::<Dd>(&state.inputs(Function::IntegrateDerivatives));
            let maps = programs::run(&maps, &inputs);
            let nv = inputs[1].len();
            let direction: Vec<Dd> = (0..nv).map(|k| Dd::from(0.7 - 0.3 * k as f64)).collect();
            let product = |row: &[Dd]| row.iter().zip(&direction).fold(Dd::ZERO, |sum, (x, y)| sum + *x * *y);
            let expected: Vec<Dd> = maps.chunks(nv).map(product).collect();
            inputs.push(direction.clone());
            let found = programs::run(&transport, &inputs);
            assert_eq!(found.len(), 2 * nv);
            for (found, expected) in found.iter().zip(expected) {
                assert!((*found - expected).to_f64().abs() < 1e-28, "{}: {found:?}, {expected:?}", state.id);
            }
        }
    }
}

/// Of robots with a fixed base, whose velocities are rates of coordinates: D + Dᵀ = 2 Ḣ, K − Kᵀ = ½ d/dt (D − Dᵀ) along the motion, and K is symmetric at
/// rest; D without damping, K and D = ∂τ/∂q, ∂τ/∂q̇. The rate of D is that of its program in dual numbers.
#[test]
fn derivatives_have_the_symmetries_of_lagrangian_mechanics() {
    let half = Dd::from(0.5);
    for robot in all().filter(|robot| !robot.floating) {
        let mut options = robot.options();
        (options.scene.effects.damping, options.scene.effects.coulomb) = (false, CoulombForm::Off);
        let program = |function| robot.program(function, &options);
        let [of_motion, of_bias, of_inertia] =
            [Function::InverseDynamicsDerivatives, Function::BiasDerivatives, Function::CoriolisMatrix].map(program);
        for state in robot.states.iter().filter(|state| state.kind != "gravity_tilted") {
            let inputs = cast::<Dd>(&state.inputs(Function::InverseDynamicsDerivatives));
            let [q, qd, qdd] = [0, 1, 2].map(|k| &inputs[k][..]);
            let (nv, rest) = (qd.len(), vec![Dd::ZERO; qd.len()]);
            let along = |x: &[Dd], rate: &[Dd]| -> Vec<Dual<Dd, 1>> {
                x.iter().zip(rate).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] }).collect()
            };
            let k = programs::run(&of_motion, &inputs);
            let at_rest = programs::run(&of_motion, &[q.to_vec(), rest.clone(), rest]);
            let d = programs::run(&of_bias, &[along(q, qd), along(qd, qdd)]).split_off(nv * nv);
            let h_dot = programs::run(&of_inertia, &[q.to_vec(), qd.to_vec()]).split_off(nv * nv);
            let greatest = |x: &[Dd]| x.iter().map(|x| x.to_f64().abs()).fold(1e-3, f64::max);
            for (i, j) in (0..nv).flat_map(|i| (0..nv).map(move |j| (i * nv + j, j * nv + i))) {
                let hold = |off: Dd, scale: f64, identity: &str| {
                    assert!(off.to_f64().abs() <= 1e-24 * scale, "{identity} in {}: {off:?}", state.id);
                };
                hold(d[i].value + d[j].value - (h_dot[i] + h_dot[i]), greatest(&h_dot), "D + Dᵀ = 2 Ḣ");
                let rate = (d[i].derivatives[0] - d[j].derivatives[0]) * half;
                hold(k[i] - k[j] - rate, greatest(&k[..nv * nv]), "K − Kᵀ = ½ d/dt (D − Dᵀ)");
                hold(at_rest[i] - at_rest[j], greatest(&at_rest[..nv * nv]), "K is symmetric at rest");
            }
        }
    }
}

/// Inputs of f32 are others than those of the data: beside the same program in double-double.
#[test]
fn derivatives_in_f32_keep_six_digits() {
    in_f32_keep_six_digits(ARMS);
}

fn in_f32_keep_six_digits(robots: &[&str]) {
    for robot in robots.iter().map(|name| DerivativeRobot::load(name)) {
        let options = Options { scalar: Scalar::F32, ..robot.options() };
        for function in functions() {
            // angles of 1e6 have no digit of a turn left in f32
            for state in robot.states.iter().filter(|s| s.kind != "far_angle_1e6" && s.kind != "gravity_tilted") {
                let program = robot.program(function, &options);
                let short: Vec<Vec<f64>> =
                    state.inputs(function).iter().map(|x| x.iter().map(|x| f64::from(*x as f32)).collect()).collect();
                let exact = programs::run::<Dd>(&program, &cast(&short));
                let found: Vec<f64> =
                    programs::run::<f32>(&program, &cast(&short)).into_iter().map(f64::from).collect();
                let exact = state.blocks(function, &exact);
                let blocks = state.blocks(function, &found).into_iter().zip(exact).zip(robot.baseline(function));
                for (((mut block, found), (_, exact)), pinocchio) in blocks {
                    block.values = exact.to_vec();
                    let error = block.error(found);
                    let most = most_f32(function, block.name, pinocchio);
                    assert!(error <= most, "{} {} in {}: {error:e}", robot.name, block.name, state.id);
                }
            }
        }
    }
}

#[test]
fn compiled_derivatives_are_those_of_the_data() {
    let mut asked = 0;
    for robot in all() {
        let compiled = compiled::robot(&robot.name);
        for function in functions().filter(|f| compiled.has(*f)) {
            for state in robot.states.iter().filter(|state| state.kind != "gravity_tilted") {
                let results = compiled.call(function, &state.inputs(function));
                let blocks = state.blocks(function, &results);
                for ((block, own), pinocchio) in blocks.into_iter().zip(robot.baseline(function)) {
                    let error = block.error(own);
                    let most = most(function, pinocchio);
                    assert!(error <= most, "{} {} in {}: {error:e}", robot.name, block.name, state.id);
                    asked += 1;
                }
            }
        }
    }
    assert!(asked >= 2 * 7 * 4, "{asked}");
}

/// Every operation that is another one in a program, and changes a result, is seen in the data.
fn faults_are_seen(robot: &str, functions: impl Iterator<Item = Function>) {
    let robot = DerivativeRobot::load(robot);
    let states: Vec<_> = robot.states.iter().filter(|state| state.kind != "gravity_tilted").collect();
    for function in functions {
        let graph = robot.program(function, &as_written(&robot)).graph;
        let none = vec![Dd::ZERO; graph.results.len()];
        let (inputs, expected): (Vec<_>, Vec<_>) = states
            .iter()
            .map(|state| {
                let blocks = state.blocks(function, &none).into_iter().map(|(block, _)| block);
                (cast::<Dd>(&state.inputs(function)).concat(), blocks.collect::<Vec<_>>())
            })
            .unzip();
        let (all, escaped) = escaping(&graph, &inputs, |k, found| {
            let mut found = found;
            expected[k].iter().any(|block| {
                let (own, others) = found.split_at(block.values.len());
                found = others;
                block.error(own) > DATA.most
            })
        });
        println!("{} of {}: {all} mutants change a result, {} escape", function.name(), robot.name, escaped.len());
        assert!(all > 10, "{}: {all}", function.name());
        assert!(escaped.is_empty(), "{}: {}", function.name(), escaped.join("\n"));
    }
}

#[test]
fn a_fault_in_derivatives_is_seen() {
    faults_are_seen("planar2r", functions());
    faults_are_seen("ur5", [Function::InverseDynamicsDerivatives, Function::BiasDerivatives].into_iter());
}

#[test]
#[ignore = "slow proof: a hundred thousand mutants"]
fn slow_proof_that_a_fault_in_derivatives_is_seen() {
    faults_are_seen("ur5", functions());
    faults_are_seen("chapter_cylindrical", functions());
}
