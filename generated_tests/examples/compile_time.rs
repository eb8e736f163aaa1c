//! How long generation and rustc take, over the number of joints: random trees and chains, all functions.
//!
//! `cargo run --release -p straightline-generated-tests --example compile_time [JOINTS…]`

use std::process::Command;
use std::time::Instant;
use straightline_codegen::{compile, Options, Source};
use straightline_generated_tests::random::{Kind, Random, RandomRobot};

fn main() {
    let mut joints: Vec<usize> = std::env::args().skip(1).map(|a| a.parse().expect("a number of joints")).collect();
    if joints.is_empty() {
        joints = vec![5, 10, 20, 40];
    }
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let folder = std::env::temp_dir().join(format!("straightline-compile-time-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the generated code");
    println!("| joints | shape | operations | lines | generation | rustc -O | µs of rustc per operation |");
    println!("|---|---|---|---|---|---|---|");
    for n in joints {
        for tree in [true, false] {
            let kind = Kind { joints: n, branched: tree, floating: tree, welded: n / 5, right_angled: true };
            let robot = RandomRobot::new(&mut Random(40 + n as u64), kind);
            let start = Instant::now();
            let generated = compile(
                &Source::new("random.urdf", robot.urdf()),
                &Options { model: robot.options(), ..Options::default() },
            );
            let generated = generated.unwrap_or_else(|complaints| panic!("{complaints}"));
            let generation = start.elapsed();
            let (source, output) = (folder.join("robot.rs"), folder.join("librobot.rlib"));
            std::fs::write(&source, format!("#![no_std]\n{}", generated.text)).expect("the code can be written");
            let start = Instant::now();
            let done = Command::new(&rustc)
                .args(["--edition", "2021", "--crate-type", "rlib", "-O", "-o"])
                .args([&output, &source])
                .status()
                .expect("rustc can be run");
            let compilation = start.elapsed();
            assert!(done.success(), "the generated code compiles");
            let operations: usize = generated.report.functions.values().map(|f| f.mul + f.add + f.div).sum();
            println!(
                "| {n} | {} | {operations} | {} | {:.2} s | {:.1} s | {:.0} |",
                if tree { "tree" } else { "chain" },
                generated.text.lines().count(),
                generation.as_secs_f64(),
                compilation.as_secs_f64(),
                compilation.as_secs_f64() * 1e6 / operations as f64,
            );
        }
    }
    std::fs::remove_dir_all(&folder).expect("the folder can be removed");
}
