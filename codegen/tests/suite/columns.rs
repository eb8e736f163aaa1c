//! Columns that functions solve for as lanes of loops: what they compute, when they are taken, and the bits that rustc makes.

use crate::limbs::{assert_bits, hand, limbs_on, link, robot, stool, Differ, Numbers};
use std::path::Path;
use straightline_codegen::choices::{ColumnForm, Lanes, TargetMachine, WrittenEntries};
use straightline_codegen::compile::compile;
use straightline_codegen::expr::{evaluate, LoopLanes};
use straightline_codegen::function::ForwardDynamicsMethod;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::program::{program, TracedProgram};
use straightline_codegen::verify::{bound, verify};
use straightline_codegen::{Function, Grade, Robot, Scalar, Source};
use straightline_core::Dd;

const SOLVING: [Function; 4] = [
    Function::ForwardDynamicsDerivatives,
    Function::ForwardDynamicsDerivativesAtMotion,
    Function::StepDerivatives,
    Function::StepDerivativesRk4,
];

/// An arm of seven joints.
fn arm() -> Source {
    robot(&["<link name=\"base\"/>".to_string(), limbs_on("base", "arm", 1, &["revolute"; 7], Differ::InAll, 71)])
}

/// A body with two legs of six joints, as a humanoid has them.
fn biped() -> Source {
    let base = link("base", &mut Numbers(83), 1.0);
    robot(&[base, limbs_on("base", "leg", 2, &["revolute"; 6], Differ::Mirrored, 89)])
}

fn options(floating_base: bool, columns: ColumnForm) -> Options {
    Options { columns, model: ModelOptions { floating_base, ..ModelOptions::default() }, ..Options::default() }
}

fn made(source: &Source, function: Function, options: &Options) -> TracedProgram {
    let robot = Robot::new(load(source, &options.model).0.expect("a sound file"));
    program(&robot, &[], function, options)
}

/// Of each loop how many columns.
fn loops(program: &TracedProgram) -> Vec<usize> {
    let columns = |lanes: &LoopLanes| match lanes {
        LoopLanes::Columns(columns) => *columns,
        LoopLanes::Limbs(_) => panic!("limbs are apart"),
    };
    program.graph.alike.iter().map(|alike| columns(&alike.lanes)).collect()
}

#[test]
fn lanes_compute_what_columns_apart_do() {
    for (source, floating, functions) in
        [(arm(), false, &SOLVING[..]), (biped(), true, &SOLVING[..1]), (stool(), true, &SOLVING[1..3])]
    {
        for function in functions.iter().copied() {
            let lanes = made(&source, function, &options(floating, ColumnForm::Lanes));
            let apart = made(&source, function, &options(floating, ColumnForm::Apart));
            assert!(!loops(&lanes).is_empty() && loops(&apart).is_empty(), "{}", function.name());
            let inputs: usize = lanes.graph.inputs.iter().map(|port| port.len()).sum();
            let mut n = Numbers(97);
            let x: Vec<Dd> = (0..inputs).map(|_| Dd::from(n.next())).collect();
            let (found, expected) = (evaluate(&lanes.graph, &x), evaluate(&apart.graph, &x));
            let scale = expected.iter().map(|x| x.abs().to_f64()).fold(1.0, f64::max);
            for (a, b) in found.iter().zip(&expected) {
                assert!((*a - *b).abs().to_f64() <= 1e-24 * scale, "{}: {a:?}, not {b:?}", function.name());
            }
        }
    }
}

#[test]
fn lanes_are_what_the_second_author_says() {
    let (bodies, factor) = (ForwardDynamicsMethod::ArticulatedBody, ForwardDynamicsMethod::Factorisation);
    for (source, floating, scalar, function, method) in [
        (arm(), false, Scalar::F64, Function::ForwardDynamicsDerivatives, bodies),
        (hand(), false, Scalar::F32, Function::ForwardDynamicsDerivativesAtMotion, factor),
        (stool(), true, Scalar::F64, Function::StepDerivatives, factor),
    ] {
        let options = options(floating, ColumnForm::Lanes);
        let options = Options { functions: vec![function], scalar, forward_dynamics: method, ..options };
        let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}"));
        assert!(generated.text.contains("for column in "), "{}", function.name());
        let verification = verify(&source, &generated, &options, (4, 7), || ()).expect("the reference reads it");
        let (name, worst) = verification.functions.iter().next().expect("one function");
        assert!(worst.error < bound(scalar), "{name}: {worst:?}");
    }
}

#[test]
fn lanes_are_taken_where_they_cost_hardly_more() {
    let function = Function::ForwardDynamicsDerivatives;
    let auto = options(false, ColumnForm::Auto);
    let of = |source: &Source, options: &Options| made(source, function, options);
    let (taken, apart) = (of(&arm(), &auto), of(&arm(), &options(false, ColumnForm::Apart)));
    assert_eq!(loops(&taken).len(), 1);
    let [lanes, plain] = [&taken, &apart].map(|program| program.graph.counts().flops());
    assert!(lanes as f64 <= 1.03 * plain as f64, "{lanes} beside {plain}");
    // what takes more is apart unless it is asked for; so are columns of which fewer than four are alike
    let two =
        robot(&["<link name=\"base\"/>".to_string(), limbs_on("base", "arm", 1, &["revolute"; 2], Differ::InAll, 7)]);
    assert!(loops(&of(&two, &auto)).is_empty());
    assert!(loops(&of(&two, &options(false, ColumnForm::Lanes))).iter().all(|lanes| *lanes >= 4));
    // what has an order for a machine, packed matrices, exact rules, and functions that solve for one column
    let others = [
        Options { target: Some(TargetMachine::CORTEX_M4F), scalar: Scalar::F32, ..auto.clone() },
        Options { entries: WrittenEntries::Nonzeros, ..auto.clone() },
        Options { grade: Grade::Exact, ..auto.clone() },
    ];
    others.iter().for_each(|options| assert!(loops(&of(&arm(), options)).is_empty()));
    assert!(loops(&made(&arm(), Function::ForwardDynamics, &auto)).is_empty());
    // an arm that hangs on the floor has a column of zeros, and its loop one lane less
    let counts = loops(&of(&arm(), &options(false, ColumnForm::Lanes)));
    assert!(counts.iter().all(|lanes| *lanes <= 14), "{counts:?}");
}

/// Longer programs are cut, but no loop is.
#[test]
fn parts_begin_and_end_outside_of_loops() {
    let mut options = options(true, ColumnForm::Lanes);
    options.limits.operations = 300;
    let program = made(&biped(), Function::ForwardDynamicsDerivatives, &options);
    let stretch = program.graph.stretches();
    assert!(program.schedule.parts.len() > 2);
    for k in 0..program.graph.alike.len() {
        let has = |part: &&straightline_codegen::schedule::ProgramPart| {
            part.nodes.iter().any(|id| stretch[id.index()] == Some(k))
        };
        assert_eq!(program.schedule.parts.iter().filter(has).count(), 1);
    }
}

/// A caller of the function, which prints all results of these states.
fn caller(text: &str, function: Function, states: &[Vec<f64>], program: &TracedProgram, scalar: &str) -> String {
    let graph = &program.graph;
    let mut at = 0;
    let mut arguments = Vec::new();
    for port in &graph.inputs {
        arguments.push(format!("x[{at}..{}].try_into().unwrap()", at + port.len()));
        at += port.len();
    }
    let zero = |shape: &[usize]| shape.iter().rev().fold("0.0".to_string(), |of, n| format!("[{of}; {n}]"));
    let declared: Vec<String> =
        graph.outputs.iter().map(|port| format!("let mut {} = {};", port.name, zero(&port.shape))).collect();
    let flat = |port: &straightline_codegen::expr::Port| {
        let flattened = ".as_flattened()".repeat(port.shape.len() - 1);
        format!("for y in {}{flattened} {{ print!(\"{{y:e}} \"); }}", port.name)
    };
    let outputs: Vec<String> = graph.outputs.iter().map(|port| format!("&mut {}", port.name)).collect();
    format!(
        "mod robot {{\n{text}\n}}\nfn main() {{\n    for x in {states:?} {{\n        let x = x.map(|x: f64| x as {scalar});\n        \
         {}\n        robot::{}({}, {});\n        {}\n        println!();\n    }}\n}}\n",
        declared.join(" "),
        function.name(),
        arguments.join(", "),
        outputs.join(", "),
        graph.outputs.iter().map(flat).collect::<Vec<_>>().join(" ")
    )
}

/// Every bit of what rustc makes of the loops is that of the program, in one part and in several, fused and not.
#[test]
fn compiled_lanes_have_the_bits_of_their_program() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("columns");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let fused = cfg!(target_arch = "x86_64") && std::arch::is_x86_feature_detected!("fma");
    let function = Function::ForwardDynamicsDerivatives;
    let lanes = |floating| Options { functions: vec![function], ..options(floating, ColumnForm::Lanes) };
    let mut in_parts = lanes(true);
    in_parts.limits.operations = 300;
    let mut by_columns = lanes(false);
    by_columns.scene.by_columns = true;
    let cases = [
        ("arm", arm(), lanes(false)),
        ("arm_by_columns", arm(), by_columns),
        ("biped", biped(), in_parts),
        ("hand", hand(), Options { scalar: Scalar::F32, lanes: Some(Lanes::Standalone), ..lanes(false) }),
        ("fused_arm", arm(), Options { fma: true, ..lanes(false) }),
    ];
    for (name, source, options) in cases.into_iter().filter(|(_, _, o)| fused || !o.fma) {
        let program = made(&source, function, &options);
        let inputs: usize = program.graph.inputs.iter().map(|port| port.len()).sum();
        let mut n = Numbers(61);
        let states: Vec<Vec<f64>> = (0..4).map(|_| (0..inputs).map(|_| 2.0 * n.next()).collect()).collect();
        let text = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
        assert!(text.contains("for column in "), "{name} is written as a loop");
        // results go to their matrices by loops, too: in C's order along rows, in Fortran's along columns
        let is_copy = |line: &&str| line.starts_with("dqdd_dq[") && line.contains("column]") && line.contains(" = y");
        let copies: Vec<&str> = text.lines().map(str::trim).filter(is_copy).collect();
        assert!(!copies.is_empty(), "{name}");
        for copy in copies {
            let outer = copy.split(']').next().expect("a place");
            assert_eq!(outer.contains("column"), options.scene.by_columns, "{name}: {copy}");
        }
        let main = caller(&text, function, &states, &program, options.scalar.name());
        assert_bits(&folder, (name, main), &program, &options, &states);
    }
}
