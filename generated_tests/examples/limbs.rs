//! What identical limbs as lanes of one body take, and columns that are solved for as lanes of one loop, against each by itself.
//!
//! `cargo run -p straightline-generated-tests --example limbs [FUNCTION…]`; recorded in `record/2026-11-21-limbs.md` and, of columns, in
//! `record/2026-11-26-columns.md`.
//!
//! The functions as they are generated with `limbs` or `columns = "apart"` and `"lanes"`, in one program that first checks that their
//! results agree, then times calls warm and cold; bytes of machine code by `nm -S`.

use straightline_codegen::choices::{ColumnForm, LimbForm};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::{compile, Function, Generated, Options, Source};
use straightline_generated_tests::standalone::{run, Folder};

const ROBOTS: [(&str, &str); 4] = [
    ("panda.urdf", "Panda"),
    ("hyq.urdf", "HyQ"),
    ("solo12.urdf", "Solo12"),
    ("simple_humanoid.urdf", "simple humanoid"),
];

/// A body with so many legs of three joints, left and right ones mirrored.
fn walker(legs: usize) -> String {
    let inertia = |mass: f64, side: f64| {
        format!(
            "<inertial><origin xyz=\"0.01 {} -0.1\"/><mass value=\"{mass}\"/><inertia ixx=\"0.002\" iyy=\"0.003\" \
             izz=\"0.0025\" ixy=\"{}\" ixz=\"0.0002\" iyz=\"{}\"/></inertial>",
            0.02 * side,
            0.0001 * side,
            0.0003 * side
        )
    };
    let mut text = format!("<robot name=\"walker\"><link name=\"base\">{}</link>", inertia(8.0, 1.0));
    for leg in 0..legs {
        let angle = 0.3 + std::f64::consts::TAU * leg as f64 / legs as f64;
        let side = if leg % 2 == 0 { 1.0 } else { -1.0 };
        let mut parent = "base".to_string();
        for (j, axis) in ["1 0 0", "0 1 0", "0 1 0"].into_iter().enumerate() {
            let own = format!("leg{leg}_{j}");
            let origin = match j {
                0 => format!("xyz=\"{} {} 0.01\" rpy=\"0 0 {angle}\"", 0.3 * angle.cos(), 0.3 * angle.sin()),
                _ => format!("xyz=\"0.02 {} -0.2\"", 0.05 * side),
            };
            text += &format!(
                "<link name=\"{own}\">{}</link><joint name=\"{own}_joint\" type=\"continuous\"><parent link=\"{parent}\"/>\
                 <child link=\"{own}\"/><origin {origin}/><axis xyz=\"{axis}\"/></joint>",
                inertia(0.3 + 0.1 * j as f64, side)
            );
            parent = own;
        }
    }
    text + "</robot>"
}

fn generated(text: &str, case: &Case, in_lanes: bool, fma: bool) -> Generated {
    let (limbs, columns) = match (in_lanes, case.is_of_columns) {
        (true, true) => (LimbForm::Apart, ColumnForm::Lanes),
        (true, false) => (LimbForm::Lanes, ColumnForm::Apart),
        (false, _) => (LimbForm::Apart, ColumnForm::Apart),
    };
    let options = Options {
        functions: vec![case.function],
        model: ModelOptions { floating_base: !text.contains("name=\"panda\""), ..ModelOptions::default() },
        limbs,
        columns,
        fma,
        ..Options::default()
    };
    compile(&Source::new("robot.urdf", text.to_string()), &options).unwrap_or_else(|d| panic!("{}", d.render()))
}

/// A function, and what the program has to write of it.
struct Case {
    function: Function,
    /// Whether its columns are lanes, not limbs.
    is_of_columns: bool,
    call: &'static str,
    inputs: &'static str,
    state: &'static str,
    output: &'static str,
    zero: &'static str,
    /// All results of `y`.
    flat: &'static str,
}

const MOTION: &str = "([f64; apart::NQ], [f64; apart::NV], [f64; apart::NV])";
const OF_MOTION: &str =
    "(std::array::from_fn(|_| next()), std::array::from_fn(|_| next()), std::array::from_fn(|_| next()))";

/// Three matrices and a list.
const SQUARES: &str =
    "([[f64; apart::NV]; apart::NV], [[f64; apart::NV]; apart::NV], [[f64; apart::NV]; apart::NV], [f64; apart::NV])";
const NO_SQUARES: &str =
    "([[0.0; apart::NV]; apart::NV], [[0.0; apart::NV]; apart::NV], [[0.0; apart::NV]; apart::NV], [0.0; apart::NV])";

const CASES: [Case; 4] = [
    Case {
        function: Function::InverseDynamics,
        is_of_columns: false,
        call: "(&x.0, &x.1, &x.2, y)",
        inputs: MOTION,
        state: OF_MOTION,
        output: "[f64; apart::NV]",
        zero: "[0.0; apart::NV]",
        flat: "y.to_vec()",
    },
    Case {
        function: Function::GravityForce,
        is_of_columns: false,
        call: "(x, y)",
        inputs: "[f64; apart::NQ]",
        state: "std::array::from_fn(|_| next())",
        output: "[f64; apart::NV]",
        zero: "[0.0; apart::NV]",
        flat: "y.to_vec()",
    },
    Case {
        function: Function::InverseDynamicsDerivatives,
        is_of_columns: false,
        call: "(&x.0, &x.1, &x.2, &mut y.0, &mut y.1, &mut y.2, &mut y.3)",
        inputs: MOTION,
        state: OF_MOTION,
        output: SQUARES,
        zero: NO_SQUARES,
        flat: "[y.0.as_flattened(), y.1.as_flattened(), y.2.as_flattened(), &y.3].concat()",
    },
    Case {
        function: Function::ForwardDynamicsDerivatives,
        is_of_columns: true,
        call: "(&x.0, &x.1, &x.2, &mut y.3, &mut y.0, &mut y.1, &mut y.2)",
        inputs: MOTION,
        state: OF_MOTION,
        output: SQUARES,
        zero: NO_SQUARES,
        flat: "[y.0.as_flattened(), y.1.as_flattened(), y.2.as_flattened(), &y.3].concat()",
    },
];

const PROGRAM: &str = r#"
use std::{hint::black_box, time::Instant};

#[no_mangle]
#[inline(never)]
pub fn limbs_apart(x: &Inputs, y: &mut Output) {
    apart::CALL
}

#[no_mangle]
#[inline(never)]
pub fn limbs_lanes(x: &Inputs, y: &mut Output) {
    lanes::CALL
}

fn main() {
    const STATES: usize = 1024;
    let mut seed = 1u64;
    let mut next = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1);
        (seed >> 40) as f64 / 8388608.0 - 1.0
    };
    let states: Vec<Inputs> = (0..STATES).map(|_| STATE).collect();
    let (mut y, mut z): (Output, Output) = (ZERO, ZERO);
    for x in &states {
        limbs_apart(x, &mut y);
        limbs_lanes(x, &mut z);
        let [y, z] = [&y, &z].map(|y| FLAT);
        let scale = y.iter().fold(0.0f64, |m, t| m.max(t.abs()));
        assert!(y.iter().zip(&z).all(|(a, b)| (a - b).abs() < 1e-12 * scale), "{y:?} {z:?}");
    }
    let functions = [limbs_apart as fn(&Inputs, &mut Output), limbs_lanes];
    // warm: calls that may overlap, best of rounds that take turns
    let mut best = [f64::INFINITY; 2];
    for _ in 0..200 {
        for (i, f) in functions.into_iter().enumerate() {
            let start = Instant::now();
            states.iter().for_each(|x| {
                f(black_box(x), &mut y);
                black_box(&y);
            });
            best[i] = best[i].min(start.elapsed().as_nanos() as f64 / STATES as f64);
        }
    }
    // cold: 16 MB of other data touched before each call
    let mut other = vec![1u8; 16 << 20];
    let mut cold = [const { Vec::new() }; 2];
    for x in &states[..400] {
        for (i, f) in functions.into_iter().enumerate() {
            other.iter_mut().step_by(64).for_each(|x| *x = x.wrapping_add(1));
            black_box(&other);
            let start = Instant::now();
            f(black_box(x), &mut y);
            black_box(&y);
            cold[i].push(start.elapsed().as_nanos());
        }
    }
    cold.iter_mut().for_each(|times| times.sort_unstable());
    println!("{:.0} {:.0} {} {}", best[0], best[1], cold[0][200], cold[1][200]);
}
"#;

/// Bytes of machine code of the functions of a module of a program, and of the one that calls them.
fn code_bytes(program: &std::path::Path, module: &str) -> usize {
    let output = std::process::Command::new("nm").arg("-S").arg(program).output().expect("binutils are there");
    let text = String::from_utf8_lossy(&output.stdout).to_string();
    let is_own = |name: &str| name == format!("limbs_{module}") || name.contains(&format!("{}{module}", module.len()));
    let size = |line: &str| -> Option<usize> {
        let [_, size, _, name] = line.split_whitespace().collect::<Vec<_>>().try_into().ok()?;
        is_own(name).then(|| usize::from_str_radix(size, 16).expect("a size in hexadecimal digits"))
    };
    text.lines().filter_map(size).sum()
}

fn main() {
    let folder = Folder::new("limbs");
    let files = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions");
    println!(
        "| robot, function | instructions | mul, add | in lanes | ns | in lanes | cold | in lanes | bytes | in lanes |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let of_files = ROBOTS
        .map(|(file, name)| (std::fs::read_to_string(files.join(file)).expect("the file is there"), name.to_string()));
    let walkers = [3, 5, 6].map(|legs| (walker(legs), format!("{legs} legs")));
    for (text, name) in of_files.into_iter().chain(walkers) {
        for case in CASES {
            let Case { function, call, inputs, state, output, zero, flat, .. } = case;
            // an arm has no limbs that are alike
            let is_of_robot = case.is_of_columns || name != "Panda";
            if !is_of_robot || !(wanted.is_empty() || wanted.iter().any(|name| *name == function.name())) {
                continue;
            }
            for (instructions, fma, flags) in [
                ("any x86-64", false, vec![]),
                ("AVX2", true, vec!["-Ctarget-cpu=x86-64-v3"]),
                ("this machine's", false, vec!["-Ctarget-cpu=native"]),
                ("this machine's, fused", true, vec!["-Ctarget-cpu=native"]),
            ] {
                let both = [false, true].map(|in_lanes| generated(&text, &case, in_lanes, fma));
                let source = format!(
                    "#![allow(warnings)]\nmod apart {{\n{}\n}}\nmod lanes {{\n{}\n}}\ntype Inputs = {inputs};\n\
                     type Output = {output};\n{}",
                    both[0].text,
                    both[1].text,
                    PROGRAM
                        .replace("CALL", &format!("{}{call}", function.name()))
                        .replace("STATE)", &format!("{state})"))
                        .replace("ZERO", zero)
                        .replace("FLAT", flat)
                );
                let program = folder.build("limbs", &source, &flags).unwrap_or_else(|e| panic!("{e}"));
                let printed = run(&program, &[]).unwrap_or_else(|e| panic!("{e}"));
                let [apart, lanes, cold, cold_lanes] =
                    printed.split_whitespace().collect::<Vec<_>>().try_into().expect("four figures");
                let [bytes, bytes_lanes] = ["apart", "lanes"].map(|module| code_bytes(&program, module));
                let [counts, counts_lanes] = both.each_ref().map(|g| {
                    let report = g.report.function(function).expect("it was generated");
                    format!("{}, {}", report.mul, report.add)
                });
                println!(
                    "| {name}, {} | {instructions} | {counts} | {counts_lanes} | {apart} | {lanes} | {cold} | \
                     {cold_lanes} | {bytes} | {bytes_lanes} |",
                    function.name()
                );
            }
        }
    }
}
