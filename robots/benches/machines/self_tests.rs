//! Self-tests on every machine: the hashes of ten thousand evaluations of each function, which are the same on all of them.

use super::{Bench, Emulator, CORTEX_M4F_BOARD, MACHINES, ROBOTS};
use std::fmt::Write;
use std::process::Command;
use straightline_codegen::choices::{Memory, TargetMachine};
use straightline_codegen::options::Options;

const EVALUATIONS: u32 = 10_000;

/// The machines that are emulated besides.
const FURTHER: [(TargetMachine, Memory, Emulator); 4] = [
    (TargetMachine::CORTEX_M3, Memory::Flash, Emulator { name: "mps2-m3", ..CORTEX_M4F_BOARD }),
    (TargetMachine::CORTEX_M33, Memory::Flash, Emulator { name: "mps2-m33", layout: Some("mps2-m33.x") }),
    (TargetMachine::CORTEX_M7, Memory::Tcm, Emulator { name: "mps2-m7", ..CORTEX_M4F_BOARD }),
    (TargetMachine::AARCH64, Memory::Flash, Emulator { name: "aarch64", layout: None }),
];

/// Whether this machine runs what is compiled for x86-64-v3.
fn has_x86_64_v3() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}

impl Bench<'_> {
    /// Whether all machines say the same, and that it is what the generated file expects.
    pub(super) fn self_tests_agree(&self) -> bool {
        let machines = || MACHINES.into_iter().chain(FURTHER);
        let (mut agree, mut hashes) = (true, 0);
        // robot by robot: a small machine has room for one
        for (robot, ..) in ROBOTS {
            // one text for all machines: that of the first
            let source = self.self_test(robot, MACHINES[0].0, MACHINES[0].1);
            let expected = self.on_the_host(&source);
            if has_x86_64_v3() {
                let of_v3 = self.on_the_host_by(&source, &["-Ctarget-cpu=x86-64-v3", "-Copt-level=3"]);
                if of_v3 != expected {
                    println!("self-test of {robot} on x86-64-v3:\n{of_v3}\non the host:\n{expected}");
                    agree = false;
                }
            }
            hashes += expected.lines().count();
            if expected.is_empty() || expected.lines().any(|line| line.starts_with("fails")) {
                println!("the self-test of {robot} fails on the host:\n{expected}");
                agree = false;
            }
            for (machine, memory, emulator) in machines() {
                let source = format!("#![no_std]\n#![no_main]\n{source}");
                let program = self.linked(machine, memory, emulator, &source, &[]);
                let mut run = Command::new(self.cross.join(format!("run-{}", emulator.name)));
                let output = run.arg(program).output().expect("the emulator runs");
                let found = String::from_utf8_lossy(&output.stdout);
                if !output.status.success() || found != expected {
                    println!("self-test of {robot} on {machine:?}, {memory:?}:\n{found}\non the host:\n{expected}");
                    agree = false;
                }
            }
        }
        let further = if has_x86_64_v3() { ", also as x86-64-v3" } else { "" };
        println!(
            "{hashes} hashes of {EVALUATIONS} evaluations on {} machines and the host{further}",
            machines().count()
        );
        agree
    }

    /// A robot with all functions and its self-test, and what says its hashes.
    fn self_test(&self, robot: &str, machine: TargetMachine, memory: Memory) -> String {
        let options = self.options(robot, machine, memory);
        let functions = Options::default().functions;
        let generated = self.of_options(robot, &Options { functions, self_test: true, ..options });
        let mut text = "#![allow(warnings)]\n#[path = \"STARTUP\"]\nmod startup;\n".to_string();
        writeln!(text, "pub mod {robot} {{\n{}}}", generated.text).expect("a string takes text");
        text + &format!(
            "fn run() {{
    if let Err(function) = {robot}::self_test() {{
        startup::say(\"fails\", 0);
        startup::say(function, 0);
    }}
    for (function, hash) in {robot}::self_test_hashes({EVALUATIONS}) {{
        startup::say(function, (hash >> 32) as u32 ^ hash as u32);
    }}
}}
"
        )
    }
}
