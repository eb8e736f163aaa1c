//! Which entries of matrices can be non-zero, and functions that write no others: against the full ones, on a small tree.

use straightline_codegen::certify::Effort;
use straightline_codegen::choices::{Lanes, LimbForm, WrittenEntries};
use straightline_codegen::compile::{checked_package, compile};
use straightline_codegen::emit::package::PACKAGES;
use straightline_codegen::expr::{evaluate, Grade, Graph};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::program::program;
use straightline_codegen::scene::{Scene, Selection};
use straightline_codegen::{model, Function, Generated, Options, Robot, Source};
use straightline_core::random::Random;

/// A mast that turns, with two arms.
const ROBOT: &str = r#"
[robot]
name = "crane"
[[link]]
name = "ground"
[[link]]
name = "mast"
mass = 4.0
com = [0.1, -0.2, 0.3]
inertia = { xx = 0.3, yy = 0.4, zz = 0.5, xy = 0.01, xz = -0.02, yz = 0.03 }
[[link]]
name = "boom"
mass = 2.5
com = [0.4, 0.05, -0.02]
inertia = { xx = 0.1, yy = 0.3, zz = 0.25, xy = -0.02, xz = 0.01, yz = 0.015 }
[[link]]
name = "counterweight"
mass = 3.0
com = [-0.3, 0.01, 0.02]
inertia = { xx = 0.05, yy = 0.06, zz = 0.07, xy = 0.002, xz = 0.001, yz = 0.004 }
[[joint]]
name = "slew"
kind = "continuous"
parent = "ground"
child = "mast"
axis = "z"
[[joint]]
name = "luff"
kind = "continuous"
parent = "mast"
child = "boom"
axis = "y"
origin = { xyz = [0.2, 0.1, 1.5] }
[[joint]]
name = "balance"
kind = "continuous"
parent = "mast"
child = "counterweight"
axis = "x"
origin = { xyz = [-0.3, 0.1, 1.2], rpy = [0.0, 0.0, 0.7] }
"#;

const FUNCTIONS: [Function; 5] = [
    Function::Jacobian,
    Function::MassMatrix,
    Function::InverseDynamicsDerivatives,
    Function::ForwardDynamicsDerivatives,
    Function::CoriolisMatrix,
];

fn asked(functions: &[Function]) -> Options {
    Options { functions: functions.to_vec(), ..Options::default() }
}

fn generated(options: Options) -> Generated {
    let options = Options { frames: vec!["boom".to_string()], ..options };
    compile(&Source::new("crane.toml", ROBOT), &options).unwrap_or_else(|d| panic!("{d}"))
}

fn graph(generated: &Generated, function: Function) -> &Graph {
    let mut programs = generated.programs.functions.iter();
    &programs.find(|program| program.name == function.name()).expect("it was asked for").graph
}

fn results(graph: &Graph, random: &mut Random) -> Vec<f64> {
    let count: usize = graph.inputs.iter().map(|port| port.len()).sum();
    let inputs: Vec<f64> = (0..count).map(|_| random.symmetric(1.0)).collect();
    evaluate(graph, &inputs)
}

/// The numbers of an output.
fn block<'a>(graph: &Graph, results: &'a [f64], output: &str) -> &'a [f64] {
    let at = graph.outputs.iter().position(|port| port.name == output).expect("it is an output");
    let first: usize = graph.outputs[..at].iter().map(|port| port.len()).sum();
    &results[first..first + graph.outputs[at].len()]
}

#[test]
fn patterns_have_the_entries_that_are_not_always_zero() {
    let (whole, with) =
        (generated(asked(&FUNCTIONS)), generated(Options { entries: WrittenEntries::Patterns, ..asked(&FUNCTIONS) }));
    let mut zeros = 0;
    for function in FUNCTIONS {
        let found = &with.report.function(function).expect("it was asked for").entries;
        assert!(whole.report.function(function).expect("it was asked for").entries.is_empty());
        assert!(!found.is_empty(), "{}", function.name());
        let graph = graph(&whole, function);
        let mut random = Random(4);
        let states: Vec<Vec<f64>> = (0..3).map(|_| results(graph, &mut random)).collect();
        for of in found {
            assert!(!of.is_triangle);
            let places = of.places();
            for k in 0..block(graph, &states[0], &of.output).len() {
                let is_ever = states.iter().any(|results| block(graph, results, &of.output)[k] != 0.0);
                assert_eq!(places.contains(&k), is_ever, "{} {}: {k}", function.name(), of.output);
                zeros += usize::from(!is_ever);
            }
            let rows = of.row_starts.len() - 1;
            let name = format!("{}_{}", function.name().to_uppercase(), of.output.to_uppercase());
            let starts = format!("pub const {name}_ROW_STARTS: [usize; {}] = {:?};", rows + 1, of.row_starts);
            let columns = format!("pub const {name}_COLUMNS: [usize; {}] = {:?};", places.len(), of.columns);
            assert!(with.text.contains(&starts) && with.text.contains(&columns), "{name}");
        }
    }
    // joints on two branches
    assert!(zeros >= 2 * 4, "{zeros}");
}

/// Whatever is written beside them, and in whatever form: each compilation reads its text back.
#[test]
fn nonzeros_are_the_entries_of_the_full_functions_and_of_symmetric_ones_one_triangle() {
    let staged = Scene { staged: true, ..Scene::default() };
    let by_columns = Scene { by_columns: true, ..Scene::default() };
    let some = || asked(&[Function::Jacobian, Function::MassMatrix, Function::InverseDynamicsDerivatives]);
    let all = [
        asked(&FUNCTIONS),
        Options { grade: Grade::Exact, self_test: true, ..asked(&FUNCTIONS) },
        Options { lanes: Some(Lanes::Standalone), ..some() },
        Options { scene: staged, generic: true, ..some() },
        Options { scene: by_columns, ..some() },
    ];
    for options in all {
        let whole = generated(options.clone());
        let (grade, functions) = (options.grade, options.functions.clone());
        let packed = generated(Options { entries: WrittenEntries::Nonzeros, ..options });
        for function in functions {
            let found = &packed.report.function(function).expect("it was asked for").entries;
            let (of_whole, of_packed) = (graph(&whole, function), graph(&packed, function));
            let (a, b) = (results(of_whole, &mut Random(9)), results(of_packed, &mut Random(9)));
            assert_eq!(of_whole.counts(), of_packed.counts());
            for of in found {
                let full = block(of_whole, &a, &of.output);
                let kept: Vec<f64> = of.places().into_iter().map(|k| full[k]).collect();
                assert_eq!(kept, block(of_packed, &b, &of.output), "{} {}", function.name(), of.output);
                // articulated bodies give each column of H⁻¹ by itself
                let is_symmetric = ["h", "h_inverse", "h_dot"].contains(&of.output.as_str());
                let is_one = of.output != "h_inverse" || grade == Grade::Algebraic;
                assert_eq!(of.is_triangle, is_symmetric && is_one, "{} {}", function.name(), of.output);
            }
        }
    }
}

#[test]
fn headers_of_c_have_the_patterns() {
    let with =
        generated(Options { entries: WrittenEntries::Nonzeros, ..asked(&[Function::MassMatrix, Function::Jacobian]) });
    for kind in PACKAGES.iter().filter(|kind| kind.is_c) {
        let files = checked_package(kind, &with, "crane").unwrap_or_else(|d| panic!("{d}"));
        let header = &files.iter().find(|(name, _)| name.ends_with(".h")).expect("there is a header").1;
        let of = &with.report.function(Function::MassMatrix).expect("it was asked for").entries[0];
        let columns = of.columns.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let text = format!("static const int CRANE_MASS_MATRIX_H_COLUMNS[{}] = {{{columns}}};", of.columns.len());
        assert!(header.contains(&text), "{text}\n{header}");
        assert!(header.contains(&format!("crane_mass_matrix(const double q[3], double h[{}]);", of.columns.len())));
        let folder = std::env::temp_dir().join(format!("straightline-entries-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder can be made");
        std::fs::write(folder.join("crane_dynamics.h"), header).expect("a file can be written");
        let mut cc = std::process::Command::new("cc");
        cc.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only", "crane_dynamics.h"]);
        let compiled = cc.current_dir(&folder).output().expect("there is a compiler of C");
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        std::fs::remove_dir_all(folder).expect("the folder is ours");
    }
}

/// Where limbs are lanes or turns of a loop, too.
#[test]
fn limbs_write_the_entries_that_can_be_non_zero() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions/solo12.urdf");
    let source = Source::new("solo12.urdf", std::fs::read_to_string(path).expect("a file can be read"));
    for limbs in [LimbForm::Lanes, LimbForm::Rolled] {
        let model = ModelOptions { floating_base: true, ..ModelOptions::default() };
        let functions = vec![Function::InverseDynamics, Function::MassMatrix];
        let options = Options { limbs, functions, entries: WrittenEntries::Nonzeros, model, ..Options::default() };
        let generated = compile(&source, &options).unwrap_or_else(|d| panic!("{d}"));
        let of = &generated.report.function(Function::MassMatrix).expect("it was asked for").entries[0];
        // a base of six, and four legs of three that do not meet: one triangle of each
        assert!(of.is_triangle && of.columns.len() <= 21 + 4 * (18 + 6), "{}", of.columns.len());
    }
}

/// Bounds are those of the entries that are written.
#[test]
fn certified_bounds_are_those_of_the_entries() {
    let options = Options { certify: Some(Effort::default()), ..asked(&FUNCTIONS) };
    let (whole, packed) =
        (generated(options.clone()), generated(Options { entries: WrittenEntries::Nonzeros, ..options }));
    for function in FUNCTIONS {
        let [a, b] = [&whole, &packed].map(|g| g.report.function(function).expect("it was asked for"));
        let (Some(of_whole), Some(of_packed)) = (&a.errors, &b.errors) else { panic!("bounds were asked for") };
        assert_eq!(of_whole.refused, of_packed.refused);
        for (whole, packed) in of_whole.outputs.iter().zip(&of_packed.outputs) {
            let Some(of) = b.entries.iter().find(|of| of.output == whole.name) else { continue };
            let kept = |all: &[f64]| of.places().into_iter().map(|k| all[k]).collect::<Vec<f64>>();
            assert_eq!((&whole.name, kept(&whole.bounds)), (&packed.name, packed.bounds.clone()));
            let slopes = whole.slopes.iter().zip(&packed.slopes);
            slopes.for_each(|(a, b)| assert_eq!((kept(&a.entries), a.norm), (b.entries.clone(), b.norm)));
        }
    }
}

/// K, D and H in one call have the bits of each alone.
#[test]
fn matrices_together_have_the_bits_of_each_alone_under_exact_rules() {
    let (model, complaints) = model::load(&Source::new("crane.toml", ROBOT), &Default::default());
    let robot = Robot::new(model.unwrap_or_else(|| panic!("{complaints}")));
    for (function, all) in [
        (Function::InverseDynamicsDerivatives, &["dtau_dq", "dtau_dqd", "h", "tau"][..]),
        (Function::ForwardDynamicsDerivatives, &["qdd", "dqdd_dq", "dqdd_dqd", "h_inverse"]),
    ] {
        let of = |results: &[&str]| {
            let results = results.iter().map(|name| name.to_string()).collect();
            let outputs = [(function, Selection { results, ..Selection::default() })].into_iter().collect();
            let scene = Scene { outputs, ..Scene::default() };
            program(&robot, &[], function, &Options { grade: Grade::Exact, scene, ..Options::default() }).graph
        };
        let together = of(&[]);
        for name in all {
            let alone = of(&[name]);
            for seed in 0..10 {
                let mut random = Random(seed);
                let state: Vec<f64> = (0..9).map(|_| random.symmetric(2.0)).collect();
                let at = |graph: &Graph| evaluate::<f64>(graph, &state[..graph.inputs.iter().map(|p| p.len()).sum()]);
                let (whole, own) = (at(&together), at(&alone));
                // the same bits but for the sign of zero
                assert_eq!(block(&together, &whole, name), &own[..], "{} {name}", function.name());
            }
        }
    }
}
