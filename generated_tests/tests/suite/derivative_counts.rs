//! Operations of ∂τ/∂q, ∂τ/∂q̇ and H in one call, beside what the best published way takes without H.

use std::path::Path;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::scene::{Scene, Selection};
use straightline_codegen::Function;
use straightline_generated_tests::programs::{self, program};

/// Additions and multiplications that a robot may take, what it takes, and what CasADi takes of Pinocchio's analytic derivatives after
/// common subexpressions (research record of 2026-11-22); of a neighbouring robot where marked.
struct CountsOf {
    file: &'static str,
    floating: bool,
    most: usize,
    record: usize,
    casadi: Option<usize>,
}

const fn of(file: &'static str, most: usize, record: usize, casadi: Option<usize>) -> CountsOf {
    CountsOf { file, floating: false, most, record, casadi }
}

const ARMS: [CountsOf; 4] = [
    of("../robots/descriptions/ur5.urdf", 764, 704, Some(4960)),
    of("../robots/descriptions/puma560.urdf", 1104, 1062, Some(4794)),
    of("count_robots/iiwa7.urdf", 1689, 1644, Some(6508)),
    of("../robots/descriptions/panda.urdf", 2388, 2338, Some(6804)),
];

const LARGE: [CountsOf; 4] = [
    of("count_robots/general_6r.urdf", 3127, 3109, None),
    CountsOf { floating: true, ..of("../robots/descriptions/solo12.urdf", 4030, 3940, None) },
    CountsOf { floating: true, ..of("../robots/descriptions/hyq.urdf", 6450, 6422, Some(17080)) },
    CountsOf { floating: true, ..of("../robots/descriptions/simple_humanoid.urdf", 17000, 16644, None) },
];

fn count(of: &CountsOf) -> usize {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(of.file);
    let model = ModelOptions { floating_base: of.floating, ..ModelOptions::default() };
    let robot = programs::load(&programs::file(&path), &model);
    let function = Function::InverseDynamicsDerivatives;
    let results = ["dtau_dq", "dtau_dqd", "h"].map(String::from).to_vec();
    let scene = Scene {
        outputs: [(function, Selection { results, ..Selection::default() })].into_iter().collect(),
        ..Scene::default()
    };
    let counts = program(&robot, &[], function, &Options { model, scene, ..Options::default() }).graph.counts();
    assert_eq!(counts.div, 0, "{}", of.file);
    counts.flops()
}

/// Products beside inverse dynamics: along a direction, backwards, and of second order.
#[test]
fn products_take_two_and_a_half_times_inverse_dynamics_and_those_of_second_order_six_times() {
    let robots = [("ur5", false), ("puma560", false), ("panda", false), ("solo12", true), ("hyq", true)];
    for (name, floating_base) in robots {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../robots/descriptions/{name}.urdf"));
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
        let found = count(of);
        let name = Path::new(of.file).file_stem().expect("a file has a name").to_string_lossy();
        let beside = of.casadi.map_or(String::new(), |casadi| format!(", CasADi {casadi}"));
        println!("{name:<16} {found:6} of {}{beside}", of.most);
        assert!(found <= of.most, "{name}: {found} operations, {} at most", of.most);
        assert_eq!(found, of.record, "{name}: another count than on record");
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
