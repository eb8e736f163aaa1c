//! What states in blocks of eight take, against slices of states, and what a flag of LLVM is worth.
//!
//! `cargo run -p straightline-generated-tests --example blocks`; recorded in `record/2026-11-26-peers-derivatives.md`.
//!
//! Derivatives as they are generated with `--lanes standalone --fma`, compiled for this machine: `…_lanes::<8>` over 62 blocks, and
//! `…_batch_soa` over as many states. Nanoseconds per state, best of 300 rounds. The flag lets LLVM tell more than 250 numbers apart, so that loops
//! over lanes of large functions become vector instructions. Without `prefer-256-bit` LLVM uses registers of 512 bits where the machine has them.

use straightline_codegen::choices::Lanes;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::{compile, Function, Options, Source};
use straightline_generated_tests::standalone::{run, Folder};

const PROGRAM: &str = r#"
use std::{hint::black_box, time::Instant};

const BLOCKS: usize = 62;
const STATES: usize = 8 * BLOCKS;
type Block<const K: usize> = [[f64; 8]; K];
type Square = [[[f64; 8]; robot::NV]; robot::NV];

#[derive(Clone)]
struct Results {
    squares: [Square; 3],
    list: Block<{ robot::NV }>,
}

fn main() {
    let mut seed = 1u64;
    let mut next = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1);
        (seed >> 40) as f64 / 8388608.0 - 1.0
    };
    let qs: Vec<Block<{ robot::NQ }>> = (0..BLOCKS).map(|_| std::array::from_fn(|_| std::array::from_fn(|_| next()))).collect();
    let mut others = || -> Vec<Block<{ robot::NV }>> {
        (0..BLOCKS).map(|_| std::array::from_fn(|_| std::array::from_fn(|_| next()))).collect()
    };
    let (qds, forces) = (others(), others());
    let zero = Results { squares: [[[[0.0; 8]; robot::NV]; robot::NV]; 3], list: [[0.0; 8]; robot::NV] };
    let mut results = vec![zero; BLOCKS];
    let slices = |width: usize| -> Vec<f64> { (0..STATES * width).map(|k| 0.001 * (k % 997) as f64).collect() };
    let (q, qd, force) = (slices(robot::NQ), slices(robot::NV), slices(robot::NV));
    let mut squares = [(); 3].map(|()| slices(robot::NV * robot::NV));
    let mut list = slices(robot::NV);
    let mut best = [f64::INFINITY; 2];
    for _ in 0..300 {
        let start = Instant::now();
        for (k, y) in results.iter_mut().enumerate() {
            let [a, b, c] = &mut y.squares;
            robot::LANES
        }
        black_box(&results);
        best[0] = best[0].min(start.elapsed().as_nanos() as f64 / STATES as f64);
        let start = Instant::now();
        let [a, b, c] = &mut squares;
        robot::BATCH.expect("as many as there are");
        black_box((&squares, &list));
        best[1] = best[1].min(start.elapsed().as_nanos() as f64 / STATES as f64);
    }
    println!("{:.0} {:.0}", best[0], best[1]);
}
"#;

fn main() {
    let folder = Folder::new("blocks");
    let files = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions");
    println!("| robot, function | blocks | slices | blocks, with the flag | slices, with the flag | blocks, 512 bits, too | slices, 512 bits, too |");
    println!("|---|---|---|---|---|---|---|");
    for (file, floating_base) in [("ur5.urdf", false), ("panda.urdf", false), ("hyq.urdf", true)] {
        let text = std::fs::read_to_string(files.join(file)).expect("the file is there");
        for (function, order) in [
            (Function::InverseDynamicsDerivatives, "a, b, c, LIST"),
            (Function::ForwardDynamicsDerivatives, "LIST, a, b, c"),
        ] {
            let options = Options {
                functions: vec![function],
                model: ModelOptions { floating_base, ..ModelOptions::default() },
                lanes: Some(Lanes::Standalone),
                fma: true,
                ..Options::default()
            };
            let generated = compile(&Source::new(file, text.clone()), &options).unwrap_or_else(|d| panic!("{d}"));
            let name = function.name();
            let lanes =
                format!("{name}_lanes::<8>(&qs[k], &qds[k], &forces[k], {});", order.replace("LIST", "&mut y.list"));
            let batch = format!("{name}_batch_soa(STATES, &q, &qd, &force, {})", order.replace("LIST", "&mut list"));
            let program = PROGRAM.replace("LANES", &lanes).replace("BATCH", &batch);
            let source = format!("#![allow(warnings)]\nmod robot {{\n{}\n}}\n{program}", generated.text);
            let flags = [
                "-Ctarget-cpu=native",
                "-Cllvm-args=-alias-set-saturation-threshold=100000",
                "-Ctarget-feature=-prefer-256-bit",
            ];
            let figures = [1, 2, 3].map(|count| {
                let program = folder.build("blocks", &source, &flags[..count]).unwrap_or_else(|e| panic!("{e}"));
                run(&program, &[]).unwrap_or_else(|e| panic!("{e}")).trim().replace(' ', " | ")
            });
            println!("| {}, {name} | {} |", file.trim_end_matches(".urdf"), figures.join(" | "));
        }
    }
}
