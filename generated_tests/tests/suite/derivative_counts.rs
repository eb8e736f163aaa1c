//! Operations of ∂τ/∂q, ∂τ/∂q̇ and H in one call, and of ∂q̈/∂q, ∂q̈/∂q̇ and H⁻¹, beside what the best published way takes.

use std::path::Path;
use straightline_codegen::choices::ColumnForm;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::function::Form;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::scene::{Scene, Selection};
use straightline_codegen::Function;
use straightline_generated_tests::programs::{self, program};

/// Additions and multiplications that a robot may take, what it takes, and what CasADi takes of Pinocchio's analytic derivatives after
/// common subexpressions (research record of 2026-11-22; without H, and with divisions), of some a neighbouring robot.
#[derive(Clone, Copy)]
struct CountsBeside {
    most: usize,
    record: usize,
    casadi: Option<usize>,
}

#[derive(Clone, Copy)]
struct CountsOf {
    file: &'static str,
    floating: bool,
    inverse: CountsBeside,
    forward: Option<CountsBeside>,
}

const fn counts(most: usize, record: usize, casadi: Option<usize>) -> CountsBeside {
    CountsBeside { most, record, casadi }
}

const fn of(file: &'static str, inverse: CountsBeside, forward: CountsBeside) -> CountsOf {
    CountsOf { file, floating: false, inverse, forward: Some(forward) }
}

const ARMS: [CountsOf; 4] = [
    of("../robots/descriptions/ur5.urdf", counts(764, 704, Some(4960)), counts(1610, 1473, Some(7049))),
    of("../robots/descriptions/puma560.urdf", counts(1104, 1057, Some(4794)), counts(2125, 1938, Some(6676))),
    of("count_robots/iiwa7.urdf", counts(1689, 1642, Some(6508)), counts(3560, 3243, None)),
    of("../robots/descriptions/panda.urdf", counts(2388, 2338, Some(6804)), counts(4510, 4268, Some(9837))),
];

const LARGE: [CountsOf; 4] = [
    of("count_robots/general_6r.urdf", counts(3127, 3109, None), counts(4715, 4559, None)),
    CountsOf {
        floating: true,
        ..of("../robots/descriptions/solo12.urdf", counts(4030, 3940, None), counts(19400, 15017, None))
    },
    CountsOf {
        floating: true,
        ..of("../robots/descriptions/hyq.urdf", counts(6450, 6422, Some(17080)), counts(22200, 17824, Some(37698)))
    },
    CountsOf {
        file: "../robots/descriptions/simple_humanoid.urdf",
        floating: true,
        inverse: counts(17000, 16644, None),
        forward: None,
    },
];

fn count(of: &CountsOf, function: Function, results: &[&str]) -> usize {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(of.file);
    let model = ModelOptions { floating_base: of.floating, ..ModelOptions::default() };
    let robot = programs::load(&programs::file(&path), &model);
    let results = results.iter().map(|name| name.to_string()).collect();
    let scene = Scene {
        outputs: [(function, Selection { results, ..Selection::default() })].into_iter().collect(),
        ..Scene::default()
    };
    // of frames the last one of the file
    let frames = robot.model.frames.last().filter(|_| function.is_per_frame()).map(|frame| frame.name.to_string());
    let frames: Vec<String> = frames.into_iter().collect();
    // as lanes of loops columns take up to 3 % more, and less time
    let options = Options { model, scene, columns: ColumnForm::Apart, ..Options::default() };
    let counts = program(&robot, &frames, function, &options).graph.counts();
    let turns = of.floating && function.spec().form == Form::Plain;
    assert!(counts.div == 0 || function.spec().solves || turns, "{} of {} divides", function.name(), of.file);
    counts.flops()
}

/// Products beside inverse dynamics: along a direction, backwards, and of second order.
#[test]
fn products_take_two_and_a_half_times_inverse_dynamics_and_those_of_second_order_six_times() {
    hold_products(&[
        ("planar2r.urdf", false),
        ("ur5.urdf", false),
        ("puma560.urdf", false),
        ("panda.urdf", false),
        ("chapter_6r.toml", false),
        ("chapter_stanford.toml", false),
        ("chapter_cylindrical.toml", false),
        ("chapter_oblique.toml", false),
        ("solo12.urdf", true),
        ("hyq.urdf", true),
    ]);
}

#[test]
#[ignore = "slow proof: programs of some ten thousand operations are searched"]
fn slow_proof_that_products_of_a_humanoid_take_as_many_times_inverse_dynamics() {
    hold_products(&[("simple_humanoid.urdf", true)]);
}

fn hold_products(robots: &[(&str, bool)]) {
    for (name, floating_base) in robots.iter().copied() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../robots/descriptions/{name}"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let model = ModelOptions { floating_base, ..ModelOptions::default() };
        let robot = programs::load(&Source::new(name, text), &model);
        let options = Options { model, ..Options::default() };
        let flops = |function| program(&robot, &[], function, &options).graph.counts().flops() as f64;
        let whole = flops(Function::InverseDynamics);
        for (function, most) in [
            (Function::InverseDynamicsJvp, 2.6),
            (Function::InverseDynamicsVjp, 2.6),
            (Function::InverseDynamicsHvp, 6.5),
        ] {
            let times = flops(function) / whole;
            println!("{name:<16} {:<24} {times:5.2} times", function.name());
            assert!(times <= most, "{} of {name}: {times} times, {most} at most", function.name());
        }
    }
}

fn hold(robots: &[CountsOf]) {
    for of in robots {
        let name = Path::new(of.file).file_stem().expect("a file has a name").to_string_lossy();
        let inverse = (Function::InverseDynamicsDerivatives, &["dtau_dq", "dtau_dqd", "h"][..], of.inverse);
        let forward = of.forward.map(|counts| (Function::ForwardDynamicsDerivatives, &[][..], counts));
        for (function, results, CountsBeside { most, record, casadi }) in [inverse].into_iter().chain(forward) {
            let found = count(of, function, results);
            let beside = casadi.map_or(String::new(), |casadi| format!(", CasADi {casadi}"));
            println!("{name:<16} {:<32} {found:6} of {most}{beside}", function.name());
            assert!(found <= most, "{} of {name}: {found} operations, {most} at most", function.name());
            assert_eq!(found, record, "{} of {name}: another count than on record", function.name());
        }
    }
}

#[test]
fn derivatives_of_arms_take_fewer_operations_than_ever_published() {
    hold(&ARMS);
}

#[test]
#[ignore = "slow proof: programs of some ten thousand operations are searched"]
fn slow_proof_that_derivatives_of_large_robots_take_few_operations() {
    hold(&LARGE);
}

fn hold_records<const N: usize>(functions: [Function; N], records: [[usize; N]; 4]) {
    let found = ARMS.each_ref().map(|of| functions.map(|function| count(of, function, &[])));
    ARMS.iter().zip(&found).for_each(|(of, found)| println!("{:<40} {found:?}", of.file));
    assert_eq!(found, records);
}

/// Of forward dynamics: along a direction, backwards, and of second order.
#[test]
fn products_with_derivatives_of_forward_dynamics_take_what_is_on_record() {
    use Function::{ForwardDynamicsHvp, ForwardDynamicsJvp, ForwardDynamicsVjp};
    let records = [[746, 728, 1799], [990, 965, 2267], [1487, 1454, 3188], [2099, 2067, 4573]];
    hold_records([ForwardDynamicsJvp, ForwardDynamicsVjp, ForwardDynamicsHvp], records);
}

/// Operations on record of what is at rest, without accelerations, or by velocities alone.
#[test]
fn derivatives_of_gravity_and_bias_forces_and_coriolis_matrices_take_what_is_on_record() {
    use Function::{BiasDerivatives, CoriolisMatrix, CoriolisTransposeForce, GravityDerivative};
    let functions = [GravityDerivative, BiasDerivatives, CoriolisMatrix, CoriolisTransposeForce];
    let records = [[34, 671, 304, 302], [38, 1007, 459, 247], [121, 1600, 782, 372], [197, 2300, 1148, 524]];
    hold_records(functions, records);
}

/// The same of what moves: a frame and the robot as a whole.
#[test]
fn derivatives_of_frames_and_of_centroidal_momentum_take_what_is_on_record() {
    use Function::{CentreOfMassJacobian, CentroidalDerivatives, CentroidalMap, CentroidalMapRate, FrameDerivatives};
    let functions = [FrameDerivatives, CentreOfMassJacobian, CentroidalMap, CentroidalMapRate, CentroidalDerivatives];
    let records = [
        [542, 68, 334, 847, 2981],
        [376, 83, 296, 824, 2709],
        [877, 142, 431, 1178, 3976],
        [889, 201, 551, 1437, 4678],
    ];
    hold_records(functions, records);
}

/// The same of a frame's twist, along its own axes and at the world's origin.
#[test]
fn derivatives_of_twists_of_frames_take_what_is_on_record() {
    use Function::{FrameDerivativesAtWorldOrigin, FrameDerivativesInOwnAxes};
    hold_records(
        [FrameDerivativesInOwnAxes, FrameDerivativesAtWorldOrigin],
        [[874, 606], [571, 627], [921, 918], [959, 928]],
    );
}

/// What is asked of a frame, and what each joint carries.
#[test]
fn tasks_and_subtrees_take_what_is_on_record() {
    use Function::{InverseKinematicsStep, JacobianHessianProduct, OperationalSpaceDynamics, SubtreeCentresOfMass};
    let functions = [JacobianHessianProduct, SubtreeCentresOfMass, OperationalSpaceDynamics, InverseKinematicsStep];
    let records = [[218, 199, 2144, 1994], [170, 219, 2077, 1798], [422, 450, 3167, 2842], [446, 557, 3566, 3115]];
    hold_records(functions, records);
}

/// The same of steps of time, with and without their derivatives.
#[test]
fn steps_of_time_take_what_is_on_record() {
    use Function::{RungeKuttaStep, SemiImplicitStep, StepDerivatives};
    let functions = [SemiImplicitStep, StepDerivatives, RungeKuttaStep];
    hold_records(functions, [[388, 1676, 1525], [481, 2140, 1990], [764, 3514, 3126], [1042, 4546, 4248]]);
}

#[test]
#[ignore = "slow proof: four times the derivatives of forward dynamics, in one program"]
fn slow_proof_that_derivatives_of_steps_of_order_four_take_what_is_on_record() {
    hold_records([Function::StepDerivativesRk4], [[13359], [15413], [24839], [28549]]);
}

/// Displacements of a robot with a fixed base are sums; of a free root alone they take what is on record.
#[test]
fn displacements_take_what_is_on_record() {
    use Function::{Difference, DifferenceDerivatives, Integrate, IntegrateDerivatives, IntegrateTransport};
    let functions = [Integrate, Difference, IntegrateDerivatives, DifferenceDerivatives, IntegrateTransport];
    let free =
        CountsOf { floating: true, ..of("../robots/descriptions/hyq.urdf", counts(0, 0, None), counts(0, 0, None)) };
    let found = [ARMS[0], free].each_ref().map(|of| functions.map(|function| count(of, function, &[])));
    println!("{found:?}");
    assert_eq!(found, [[6, 6, 0, 0, 0], [216, 257, 259, 331, 355]]);
}

/// Operations of the regressors of inverse dynamics and of gravity, in base parameters, beside what was to be reached (research record of 2026-11-22).
fn hold_regressors(of: &CountsOf, most: usize, records: [usize; 2]) {
    let found = [Function::TorqueRegressor, Function::GravityRegressor].map(|function| count(of, function, &[]));
    println!("{:<40} {found:?} of {most}", of.file);
    assert!(found[0] <= most, "{}: {} operations, {most} at most", of.file, found[0]);
    assert_eq!(found, records, "{}: another count than on record", of.file);
}

#[test]
fn regressors_of_arms_take_few_operations() {
    hold_regressors(&ARMS[0], 855, [525, 48]);
    hold_regressors(&ARMS[3], 1147, [1057, 130]);
}

#[test]
#[ignore = "slow proof: programs of some ten thousand operations are searched"]
fn slow_proof_that_regressors_of_legged_robots_take_few_operations() {
    hold_regressors(&LARGE[2], 3475, [3252, 546]);
}
