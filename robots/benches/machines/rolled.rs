//! A quadruped whose legs are turns of a loop, beside the same with each leg by itself: `solo12_rolled::inverse_dynamics`.

use super::{harness, mangled, Bench, Emulator, Figures};
use std::path::Path;
use straightline_codegen::choices::{LimbForm, Memory, TargetMachine};
use straightline_codegen::options::Options;
use straightline_codegen::Function;

const ROBOT: &str = "solo12";
/// Those of the harness that can have legs in a loop.
const FUNCTIONS: [Function; 2] = [Function::InverseDynamics, Function::GravityForce];

impl Bench<'_> {
    /// Whether its bits are the host's, and its figures by machine, memory and function.
    pub(super) fn rolled(
        &self,
        (machine, memory): (TargetMachine, Memory),
        emulator: Emulator,
        states: u64,
        plugin: &Path,
    ) -> (bool, Vec<(String, Figures)>) {
        let options = Options { limbs: LimbForm::Rolled, ..self.options(ROBOT, machine, memory) };
        let text = self.of_options(ROBOT, &options).text;
        let source = |head: &str| {
            let runs = format!("    run! {{ {ROBOT} }}\n");
            format!("{head}#![allow(warnings)]\npub mod {ROBOT} {{\n{text}}}\n") + &harness(&[ROBOT], &runs, "", states)
        };
        let program = self.linked(machine, memory, emulator, &source("#![no_std]\n#![no_main]\n"), &[]);
        let named = |f: Function| {
            let (_, symbol) = mangled(ROBOT, f.name());
            (format!("{ROBOT}_rolled::{}", f.name()), symbol)
        };
        let functions = FUNCTIONS.map(named);
        let (output, counts) = self.run(&program, emulator, plugin, &functions);
        let expected = self.on_the_host(&source(""));
        if expected != output {
            println!("{machine:?}, {memory:?}, rolled: other bits than the host's\n{output}\n{expected}");
        }
        let own = self.figures_of(&program, &functions);
        let word = if memory == Memory::Flash { "flash" } else { "tcm" };
        let figures = counts.into_iter().map(|(name, instructions)| {
            let own = own.get(&name).copied().unwrap_or_default();
            let figures = Figures { instructions: instructions / states, ..own };
            (format!("{}\t{word}\t{name}", machine.row().name), figures)
        });
        (expected == output, figures.collect())
    }
}
