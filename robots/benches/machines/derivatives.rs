//! Derivatives of inverse dynamics on a Cortex-M4F: stiffness ∂τ/∂q, damping ∂τ/∂q̇, inertia H and torques in one call.

use super::{harness, mangled, names, Bench, Emulator, Figures, ROBOTS, STATES};
use std::fmt::Write;
use std::path::Path;
use straightline_codegen::choices::{Memory, TargetMachine};
use straightline_codegen::options::Options;
use straightline_codegen::Function;

impl Bench<'_> {
    /// Whether their bits are the host's, and their figures by machine, memory and function.
    pub(super) fn derivatives(&self, emulator: Emulator, plugin: &Path) -> (bool, Vec<(String, Figures)>) {
        let (machine, memory) = (TargetMachine::CORTEX_M4F, Memory::Flash);
        let function = Function::InverseDynamicsDerivatives;
        let source = |head: &str| {
            let (mut text, mut runs) = (format!("{head}#![allow(warnings)]\n"), String::new());
            for (robot, ..) in ROBOTS {
                let options = Options { functions: vec![function], ..self.options(robot, machine, memory) };
                writeln!(text, "pub mod {robot} {{\n{}}}", self.of_options(robot, &options).text)
                    .expect("a string takes text");
                writeln!(runs, "    run_derivatives! {{ {robot} }}").expect("a string takes text");
            }
            text + &harness(&names(), &runs, "", STATES)
        };
        let program = self.linked(machine, memory, emulator, &source("#![no_std]\n#![no_main]\n"), &[]);
        let functions = ROBOTS.map(|(robot, ..)| mangled(robot, function.name()));
        let (output, counts) = self.run(&program, emulator, plugin, &functions);
        let expected = self.on_the_host(&source(""));
        if expected != output {
            println!("derivatives, cortex-m4f: other bits than the host's\n{output}\n{expected}");
        }
        let own = self.figures_of(&program, &functions);
        let figures = counts.into_iter().map(|(name, instructions)| {
            let own = own.get(&name).copied().unwrap_or_default();
            (format!("cortex-m4f\tflash\t{name}"), Figures { instructions: instructions / STATES, ..own })
        });
        (expected == output, figures.collect())
    }
}
