//! Operation counts, recorded, and not above those of others.
//!
//! `golden/operation_counts.snap` holds the counts of plain tracing for the ten robots of `count_robots/`; a change there is
//! a change of what users get. The bounds are the counts of unrolling the 3-vector Newton-Euler recursion in the
//! file's own frames, and of CasADi SX on the textbook algorithms (spatial algebra, `cse()`); mul / add (fma), where fma
//! counts every a·b ± c as one. Constants parameters, gravity along z, no friction, no rotors.

use std::fmt::Write;
use std::path::Path;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::expr::Counts;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_generated_tests::programs::{self, program};

/// What a robot may take: mul, add and fma of inverse dynamics by plain unrolling; mul, add of the mass matrix, and mul,
/// add, div of forward dynamics by CasADi.
struct Bounds {
    robot: &'static str,
    floating: bool,
    inverse_dynamics: [usize; 3],
    mass_matrix: Option<[usize; 2]>,
    forward_dynamics: Option<[usize; 3]>,
}

const fn fixed(
    robot: &'static str,
    inverse_dynamics: [usize; 3],
    mass_matrix: [usize; 2],
    forward_dynamics: [usize; 3],
) -> Bounds {
    let (mass_matrix, forward_dynamics) = (Some(mass_matrix), Some(forward_dynamics));
    Bounds { robot, floating: false, inverse_dynamics, mass_matrix, forward_dynamics }
}

const fn only_inverse(robot: &'static str, inverse_dynamics: [usize; 3]) -> Bounds {
    Bounds { robot, floating: false, inverse_dynamics, mass_matrix: None, forward_dynamics: None }
}

const ROBOTS: [Bounds; 10] = [
    fixed("puma560_armstrong", [269, 191, 316], [333, 229], [760, 594, 91]),
    fixed("stanford_paul", [228, 163, 271], [227, 152], [585, 464, 89]),
    fixed("ur5", [249, 172, 288], [455, 300], [875, 659, 91]),
    fixed("iiwa7", [368, 269, 441], [548, 418], [1090, 899, 122]),
    fixed("panda", [479, 375, 587], [612, 500], [1234, 1052, 139]),
    only_inverse("puma560_general_inertia", [395, 308, 483]),
    only_inverse("stanford_general_inertia", [359, 285, 445]),
    only_inverse("general_6r", [530, 393, 631]),
    Bounds { floating: true, ..fixed("solo12", [906, 719, 1134], [1596, 1257], [3332, 2802, 270]) },
    Bounds { floating: true, ..fixed("go1", [1054, 868, 1330], [1468, 1218], [3386, 2966, 278]) },
];

fn counts(bounds: &Bounds, function: Function) -> Counts {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("count_robots/{}.urdf", bounds.robot));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let options = ModelOptions { floating_base: bounds.floating, ..ModelOptions::default() };
    let robot = programs::load(&Source::new(bounds.robot, text), &options);
    program(&robot, &[], function, &Options::default()).graph.counts()
}

const FUNCTIONS: [Function; 6] = [
    Function::InverseDynamics,
    Function::BiasForce,
    Function::GravityForce,
    Function::MassMatrix,
    Function::ForwardDynamics,
    Function::JointWrenches,
];

#[test]
fn operation_counts_are_those_on_record() {
    let mut table = format!(
        "{:<25} {:<18} {:>5} {:>5} {:>5} {:>4} {:>4} {:>7} {:>4}\n",
        "robot", "function", "mul", "add", "fma", "div", "sqrt", "sin_cos", "tail"
    );
    for bounds in &ROBOTS {
        for function in FUNCTIONS {
            let Counts { mul, add, fma, div, sqrt, tail, sin_cos } = counts(bounds, function);
            let name = function.name();
            let _ = writeln!(
                table,
                "{:<25} {name:<18} {mul:5} {add:5} {fma:5} {div:4} {sqrt:4} {sin_cos:7} {tail:4}",
                bounds.robot
            );
        }
    }
    println!("{table}");
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../../golden");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_snapshot!("operation_counts", table));
}

#[test]
fn inverse_dynamics_takes_no_more_than_plain_unrolling() {
    let mut above = String::new();
    for bounds in &ROBOTS {
        let c = counts(bounds, Function::InverseDynamics);
        let [mul, add, fma] = bounds.inverse_dynamics;
        if c.mul > mul || c.add > add || c.fma > fma {
            let _ = writeln!(above, "{}: {}/{} ({}), not {mul}/{add} ({fma})", bounds.robot, c.mul, c.add, c.fma);
        }
    }
    assert!(above.is_empty(), "inverse dynamics\n{above}");
}

#[test]
fn mass_matrix_and_forward_dynamics_take_no_more_than_casadi() {
    let mut above = String::new();
    for bounds in &ROBOTS {
        if let Some([mul, add]) = bounds.mass_matrix {
            let c = counts(bounds, Function::MassMatrix);
            if c.mul > mul || c.add > add {
                let _ = writeln!(above, "mass matrix of {}: {}/{}, not {mul}/{add}", bounds.robot, c.mul, c.add);
            }
        }
        if let Some([mul, add, div]) = bounds.forward_dynamics {
            let c = counts(bounds, Function::ForwardDynamics);
            if c.mul > mul || c.add > add || c.div > div {
                let (m, a, d) = (c.mul, c.add, c.div);
                let _ = writeln!(above, "forward dynamics of {}: {m}/{a} +{d}, not {mul}/{add} +{div}", bounds.robot);
            }
        }
    }
    assert!(above.is_empty(), "{above}");
}

/// What all published techniques together take: mul, add, div, sin_cos. A sum of angles
/// counts as one addition on both sides; what keeps its digits here, and is lost there, is counted apart.
#[test]
fn the_best_known_counts_are_reached() {
    let goals = [
        ("stanford_paul", Function::InverseDynamics, [113, 89, 0, 3], Some(129)),
        ("panda", Function::InverseDynamics, [269, 263, 0, 6], Some(328)),
        ("puma560_armstrong", Function::InverseDynamics, [142, 123, 0, 4], Some(169)),
        ("ur5", Function::InverseDynamics, [121, 101, 0, 5], Some(142)),
        ("iiwa7", Function::InverseDynamics, [187, 171, 0, 5], Some(225)),
        ("solo12", Function::InverseDynamics, [538, 512, 0, 12], Some(664)),
        ("puma560_armstrong", Function::MassMatrix, [73, 67, 0, 4], None),
        ("ur5", Function::MassMatrix, [44, 51, 0, 5], None),
        ("iiwa7", Function::MassMatrix, [123, 102, 0, 5], Some(159)),
        ("panda", Function::MassMatrix, [182, 169, 0, 6], Some(241)),
        ("ur5", Function::ForwardDynamics, [192, 166, 5, 5], None),
        ("iiwa7", Function::ForwardDynamics, [406, 371, 5, 5], None),
        ("panda", Function::ForwardDynamics, [563, 518, 6, 6], None),
    ];
    let mut above = String::new();
    for (robot, function, [mul, add, div, sin_cos], fma) in goals {
        let bounds = ROBOTS.iter().find(|b| b.robot == robot).expect("a robot of the table");
        let c = counts(bounds, function);
        if c.mul > mul || c.add > add || c.div > div || c.sin_cos > sin_cos || fma.is_some_and(|f| c.fma > f) {
            let _ = writeln!(above, "{robot}, {}: {c:?}, not {mul}/{add} {fma:?} +{div}", function.name());
        }
    }
    assert!(above.is_empty(), "{above}");
}
