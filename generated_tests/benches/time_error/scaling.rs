//! Scaling: operations, time, error and compile time of chains of 2 … 128 joints.

use crate::chart::{self, Curve, Curves};
use crate::{record, write};
use serde_json::json;
use std::fmt::Write;
use std::time::Instant;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::program::program;
use straightline_codegen::{compile, expr, ForwardDynamicsMethod, Function, Options, Scalar, Source};
use straightline_core::{Dd, Real};
use straightline_generated_tests::programs;
use straightline_generated_tests::random::Random;
use straightline_generated_tests::standalone::{run as run_program, Folder};

const JOINTS: [usize; 7] = [2, 4, 8, 16, 32, 64, 128];

/// What is measured: its name, the function, the method, up to how many joints. The factor of H takes n³/6 products, at 128 joints
/// minutes of rustc.
const KINDS: [(&str, Function, ForwardDynamicsMethod, usize); 5] = [
    ("gravity forces", Function::GravityForce, ForwardDynamicsMethod::Cheaper, 128),
    ("inverse dynamics", Function::InverseDynamics, ForwardDynamicsMethod::Cheaper, 128),
    ("forward dynamics, articulated bodies", Function::ForwardDynamics, ForwardDynamicsMethod::ArticulatedBody, 128),
    ("forward dynamics, factorisation", Function::ForwardDynamics, ForwardDynamicsMethod::Factorisation, 64),
    ("mass matrix", Function::MassMatrix, ForwardDynamicsMethod::Cheaper, 128),
];

/// Rods of half a metre about x, y and z in turn.
fn chain(n: usize) -> Source {
    let mut text = String::from("[robot]\nname = \"chain\"\n[[link]]\nname = \"link0\"\n");
    for i in 0..n {
        let axis = ["z", "y", "x"][i % 3];
        let _ = writeln!(
            text,
            "[[link]]\nname = \"link{0}\"\nmass = 1.0\ncom = [0.25, 0.03125, 0.0]\ninertia = [0.001, 0.015625, 0.015]\n[[joint]]\n\
             name = \"joint{0}\"\nkind = \"continuous\"\nparent = \"link{i}\"\nchild = \"link{0}\"\norigin = {{ xyz = [0.5, 0.0, 0.0] }}\n\
             axis = \"{axis}\"",
            i + 1
        );
    }
    Source::new("chain.toml", text)
}

/// The worst error of some states, over the greatest result of each.
fn error<T: Real + Into<f64>>(graph: &expr::Graph, states: usize) -> f64 {
    let inputs: usize = graph.inputs.iter().map(|p| p.len()).sum();
    let mut random = Random(inputs as u64);
    let mut worst = 0.0f64;
    for _ in 0..states {
        let x: Vec<T> = random.list(inputs, 2.0).into_iter().map(|x| T::constant(Dd::from(x))).collect();
        let truth = expr::evaluate(graph, &x.iter().map(|x| Dd::from((*x).into())).collect::<Vec<_>>());
        let scale = truth.iter().map(|t| t.to_f64().abs()).fold(0.0, f64::max);
        for (y, t) in expr::evaluate(graph, &x).into_iter().zip(truth) {
            worst = worst.max((Dd::from(y.into()) - t).to_f64().abs() / scale);
        }
    }
    worst
}

/// Best nanoseconds per call, of code compiled for this processor, and the seconds that generation and rustc took.
fn time(
    folder: &Folder,
    source: &Source,
    options: &Options,
    function: Function,
    lengths: &[usize],
    shape: &[usize],
) -> (f64, [f64; 2]) {
    let start = Instant::now();
    let generated = compile(source, options).unwrap_or_else(|d| panic!("{d}"));
    let generation = start.elapsed().as_secs_f64();
    let arguments: Vec<String> = (0..lengths.len()).map(|i| format!("&x{i}[k]")).collect();
    let made: String = lengths
        .iter()
        .enumerate()
        .map(|(i, n)| {
            format!("let x{i}: Vec<[f64; {n}]> = (0..64).map(|_| std::array::from_fn(|_| next())).collect();\n")
        })
        .collect();
    let zero = shape.iter().rev().fold("0.0".to_string(), |inner, n| format!("[{inner}; {n}]"));
    let text = format!(
        "#![allow(warnings)]\nmod robot {{\n{}\n}}\nfn main() {{\n    let mut seed = 1u64;\n    let mut next = || {{ seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1); (seed >> 40) as f64 / 4194304.0 - 2.0 }};\n    \
         {made}\n    let mut y = {zero};\n    let mut run = |n: usize| {{ let t = std::time::Instant::now(); for i in 0..n {{ let k = std::hint::black_box(i % 64); robot::{}({}, &mut y); std::hint::black_box(&y); }} t.elapsed().as_nanos() as f64 / n as f64 }};\n    \
         let n = (3e6 / run(64)) as usize + 1;\n    println!(\"{{}}\", (0..12).map(|_| run(n)).fold(1e18, f64::min));\n}}\n",
        generated.text,
        function.name(),
        arguments.join(", ")
    );
    let start = Instant::now();
    let program = folder.build("scaling", &text, &["-Ctarget-cpu=native"]).unwrap_or_else(|e| panic!("{e}"));
    let rustc = start.elapsed().as_secs_f64();
    let ns = run_program(&program, &[]).unwrap_or_else(|e| panic!("{e}")).trim().parse().expect("a number");
    (ns, [generation, rustc])
}

pub fn run() {
    let folder = Folder::new("scaling");
    let mut rows = Vec::new();
    let new = |name: String, colour, dashed| Curve { name, colour, dashed, points: Vec::new() };
    let mut operations: Vec<Curve> = KINDS.iter().enumerate().map(|(i, k)| new(k.0.into(), i, false)).collect();
    let mut times: Vec<Curve> = KINDS.iter().enumerate().map(|(i, k)| new(k.0.into(), i, false)).collect();
    let mut builds: Vec<Curve> = KINDS.iter().enumerate().map(|(i, k)| new(k.0.into(), i, false)).collect();
    let mut errors: Vec<Curve> = Vec::new();
    for (i, kind) in KINDS.iter().enumerate().filter(|(i, _)| *i != 0 && *i != 4) {
        errors.push(new(format!("{}, f64", kind.0), i, false));
        errors.push(new(format!("{}, f32", kind.0), i, true));
    }
    let mut text = String::from(
        "# Scaling with the number of joints\n\n`cargo bench -p straightline-generated-tests --bench time_error -- scaling`\n\n\
         Chains of rods about x, y and z in turn. Time: f64, warm, compiled for the processor, best of 12. Errors: worst of 50 random\n\
         states over the greatest result of the state. Generation: seconds from the robot file to the source, search for the cheapest form\n\
         included. rustc: seconds to compile a program of that function, of which an empty one takes the first tenths.\n\n\
         | joints | function | mul | add | sincos | ns | error f64 | error f32 | generation, s | rustc, s |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    for n in JOINTS {
        let source = chain(n);
        let robot = programs::load(&source, &ModelOptions::default());
        for (i, (name, function, method, most)) in KINDS.into_iter().enumerate() {
            if n > most {
                continue;
            }
            let options = Options { functions: vec![function], forward_dynamics: method, ..Options::default() };
            let double = program(&robot, &[], function, &options).graph;
            let single = program(&robot, &[], function, &Options { scalar: Scalar::F32, ..options.clone() }).graph;
            let counts = double.counts();
            let (e64, e32) = (error::<f64>(&double, 50), error::<f32>(&single, 50));
            let lengths: Vec<usize> = double.inputs.iter().map(|p| p.len()).collect();
            let (ns, [generation, rustc]) =
                time(&folder, &source, &options, function, &lengths, &double.outputs[0].shape);
            let _ = writeln!(
                text,
                "| {n} | {name} | {} | {} | {} | {ns:.0} | {e64:.1e} | {e32:.1e} | {generation:.2} | {rustc:.1} |",
                counts.mul, counts.add, counts.sin_cos
            );
            rows.push(
                json!({"joints": n, "function": name, "mul": counts.mul, "add": counts.add, "sincos": counts.sin_cos,
                             "ns": ns, "error_f64": e64, "error_f32": e32, "generation_s": generation, "rustc_s": rustc}),
            );
            let n = n as f64;
            operations[i].points.push((n, counts.flops() as f64));
            times[i].points.push((n, ns));
            builds[i].points.push((n, 1e9 * (generation + rustc)));
            for (curve, e) in [("f64", e64), ("f32", e32)] {
                let name = format!("{name}, {curve}");
                if let Some(curve) = errors.iter_mut().find(|c| c.name == name) {
                    curve.points.push((n, e));
                }
            }
            println!(
                "{n} {name}: {} operations, {ns:.0} ns, {e64:.1e}, {e32:.1e}, {generation:.2} s, rustc {rustc:.1} s",
                counts.flops()
            );
        }
    }
    let joints = |x: &f64| format!("{x}");
    let chart =
        |title, y, y_format, curves| Curves { title, x: "joints", x_base: 2.0, y, x_format: &joints, y_format, curves };
    let charts = [
        chart("Chains of 2 … 128 joints: operations", "multiplications and additions", &chart::power, &operations),
        chart("Time per evaluation, f64, warm", "time", &chart::time, &times),
        chart("Time to compile", "time of generation and rustc", &chart::time, &builds),
        chart("Worst error of 50 random states", "error over the greatest result", &chart::power, &errors),
    ];
    chart::curves(&charts, &record("2026-11-22-time-error-scaling.svg"));
    write("2026-11-22-time-error-scaling.md", &text);
    write("2026-11-22-time-error-scaling.json", &(serde_json::to_string(&rows).expect("plain values") + "\n"));
}
