//! The package of C99 on a microcontroller: the same functions through the C compiler for it, with the bits that the host's Rust gives.

use super::{harness, names, Bench, Emulator, Figures, FUNCTIONS, ROBOTS, STATES};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::choices::{Memory, TargetMachine};
use straightline_codegen::emit::c99::C99_SOURCE;
use straightline_codegen::Generated;

/// The compilers of C, whose figures are those of the first, and what each is told of the target.
const C_COMPILERS: [(&str, &[&str]); 2] = [("arm-none-eabi-gcc", &[]), ("clang", &["--target=thumbv7em-none-eabihf"])];
/// The processor's own; the source itself keeps products and sums apart.
const FLAGS: [&str; 9] = [
    "-std=c99",
    "-O2",
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfloat-abi=hard",
    "-mfpu=fpv4-sp-d16",
    "-ffreestanding",
    "-Wall",
    "-Werror",
];

impl Bench<'_> {
    /// Whether the functions of the packages say what is expected by each compiler, and their figures by their names, of the first.
    pub(super) fn c99(&self, expected: &str, emulator: Emulator, plugin: &Path) -> (bool, Vec<(String, Figures)>) {
        let (machine, memory) = (TargetMachine::CORTEX_M4F, Memory::Flash);
        let mut text = "#![no_std]\n#![no_main]\n#![allow(warnings)]\n".to_string();
        let (mut runs, mut functions) = (String::new(), Vec::new());
        let packages = ROBOTS.map(|(robot, ..)| (robot, self.compiled(robot, machine, memory)));
        for (robot, generated) in &packages {
            text.push_str(&module(robot, generated));
            writeln!(runs, "    run! {{ {robot} }}").expect("a string takes text");
            functions
                .extend(FUNCTIONS.map(|f| (format!("{robot}::{} in C99", f.name()), format!("{robot}_{}", f.name()))));
        }
        let source = text + &harness(&names(), &runs, "", STATES);
        let (mut agree, mut figures) = (true, Vec::new());
        for compiler in C_COMPILERS {
            let objects: Vec<PathBuf> =
                packages.iter().map(|(robot, generated)| self.object_of_c99(compiler, robot, generated)).collect();
            let program = self.linked(machine, memory, emulator, &source, &objects);
            let (output, counts) = self.run(&program, emulator, plugin, &functions);
            if output != expected {
                println!("C99 by {}, cortex-m4f: other bits than the host's Rust\n{output}", compiler.0);
                agree = false;
            }
            if figures.is_empty() {
                let own = self.figures_of(&program, &functions);
                figures.extend(counts.into_iter().map(|(name, instructions)| {
                    let own = own.get(&name).copied().unwrap_or_default();
                    (name, Figures { instructions: instructions / STATES, ..own })
                }));
            }
        }
        (agree, figures)
    }

    fn object_of_c99(&self, (name, target): (&str, &[&str]), robot: &str, generated: &Generated) -> PathBuf {
        for (name, text) in (C99_SOURCE.files)(generated, robot) {
            std::fs::write(self.folder.join(name), text).expect("a file can be written");
        }
        let [source, object] = ["c", "o"].map(|ending| self.folder.join(format!("{robot}_dynamics.{ending}")));
        let mut compiler = Command::new(self.cross.join(name));
        compiler.args(target).args(FLAGS).args(["-c", "-o"]).args([&object, &source]);
        let output = compiler.output().expect("a C compiler runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        object
    }
}

/// A module with the names and types of generated Rust, whose functions are those of the package.
fn module(robot: &str, generated: &Generated) -> String {
    let model = &generated.model;
    let (mut externs, mut functions) = (String::new(), String::new());
    for function in FUNCTIONS {
        let name = function.name();
        let list = |of: &dyn Fn(String, &str, bool) -> String| -> String {
            let ports = [(function.inputs(model, 0), false), (function.outputs(model, 0), true)];
            let all = ports.iter().flat_map(|(ports, is_output)| ports.iter().map(move |port| (port, *is_output)));
            let one = |(port, is_output): (&straightline_codegen::expr::Port, bool)| {
                let array = port.shape.iter().rev().fold("f32".to_string(), |inner, n| format!("[{inner}; {n}]"));
                of(array, &port.name, is_output)
            };
            all.map(one).collect()
        };
        let pointers =
            list(&|_, name, is_output| format!("{name}: *{} f32, ", if is_output { "mut" } else { "const" }));
        let references =
            list(&|array, name, is_output| format!("{name}: &{}{array}, ", if is_output { "mut " } else { "" }));
        let handed = list(&|_, name, is_output| match is_output {
            true => format!("core::ptr::from_mut({name}).cast(), "),
            false => format!("{name}.as_ptr(), "),
        });
        writeln!(externs, "        fn {robot}_{name}({pointers});").expect("a string takes text");
        // SAFETY of the call: the header of the package has arrays of these shapes
        writeln!(functions, "    pub fn {name}({references}) {{ unsafe {{ {robot}_{name}({handed}) }} }}")
            .expect("a string takes text");
    }
    let (nq, nv) = (model.nq(), model.nv());
    format!(
        "pub mod {robot} {{\n    pub const NQ: usize = {nq};\n    pub const NV: usize = {nv};\n    extern \"C\" {{\n{externs}    }}\n{functions}}}\n"
    )
}
