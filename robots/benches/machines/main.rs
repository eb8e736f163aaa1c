//! What functions cost on a microcontroller: instructions, flash, stack, and the bits of their results.
//!
//! `cargo bench -p straightline-robots --bench machines` compiles the robots' functions in single precision for the machines of [`MACHINES`],
//! runs them in an emulator and compares with `machines.tsv`: it fails where a function takes over 1 % more instructions, where one does
//! not keep its limit (`limits.rs`), or where a machine computes other bits than the others. `MACHINES_UPDATE=1` writes that file anew.
//! Instructions are exact, sines included; an emulator knows no cycles.
//! Flash is the function with its constants and tables, without the sines that functions share; loads and stores are those of the function's text,
//! saving registers included; both, and the stack, are read off the object, with the sines' own stack added. The toolchain is that of
//! `robots/firmware/toolchain`; without it the bench says so and succeeds.

mod c99;
mod derivatives;
mod fixed;
mod limits;
mod looped;
mod rolled;
mod self_tests;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use straightline_codegen::choices::{Memory, TargetMachine};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::{compile, Function, Generated, Scalar};

/// States that every function is run for.
const STATES: u64 = 200;
/// On machines that take a hundred times as long.
const FEW_STATES: u64 = 40;
/// More than that is worse.
const TOLERANCE: f64 = 0.01;

/// The robots: file, tolerance of its right angles, whether it floats.
const ROBOTS: [(&str, f64, bool); 4] =
    [("panda", 1e-15, false), ("ur5", 1e-10, false), ("puma560", 1e-15, false), ("solo12", 1e-15, true)];

const FUNCTIONS: [Function; 5] = [
    Function::InverseDynamics,
    Function::GravityForce,
    Function::MassMatrix,
    Function::ForwardDynamics,
    Function::MassMatrixAndGravityForce,
];

/// The machines that are emulated, the memory that code is made for, and the emulator.
const MACHINES: [(TargetMachine, Memory, Emulator); 5] = [
    (TargetMachine::CORTEX_M4F, Memory::Flash, CORTEX_M4F_BOARD),
    (TargetMachine::CORTEX_M4F, Memory::Tcm, CORTEX_M4F_BOARD),
    (TargetMachine::CORTEX_M0PLUS, Memory::Flash, Emulator { name: "microbit", layout: Some("microbit.x") }),
    (TargetMachine::RV32IMAC, Memory::Flash, Emulator { name: "riscv32", layout: None }),
    (TargetMachine::RV32IMAFC, Memory::Flash, Emulator { name: "riscv32", layout: None }),
];
const CORTEX_M4F_BOARD: Emulator = Emulator { name: "mps2", layout: Some("mps2.x") };

/// What runs the programs of a machine: `run-NAME` of the toolchain, and of a board the layout of its memory.
#[derive(Clone, Copy)]
struct Emulator {
    name: &'static str,
    layout: Option<&'static str>,
}

/// What is known of a function on a machine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Figures {
    instructions: u64,
    flash: u64,
    stack: u64,
    loads_and_stores: u64,
}

fn main() -> ExitCode {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let cross = std::env::var_os("STRAIGHTLINE_CROSS").map_or_else(|| here.join("../target/cross"), PathBuf::from);
    if !cross.join("complete").exists() {
        println!(
            "skipped: there is no toolchain for microcontrollers ({}); robots/firmware/toolchain makes it",
            cross.display()
        );
        return ExitCode::SUCCESS;
    }
    let folder = std::env::temp_dir().join(format!("straightline-machines-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let cross = std::fs::canonicalize(cross).expect("it is there");
    let result = measured(&Bench { here, cross, folder: folder.clone() });
    std::fs::remove_dir_all(&folder).expect("the folder can be removed");
    result
}

fn measured(bench: &Bench) -> ExitCode {
    let Some(plugin) = bench.plugin() else {
        println!("skipped: there is no C compiler for the emulator's counter");
        return ExitCode::SUCCESS;
    };
    let mut found: BTreeMap<String, Figures> = BTreeMap::new();
    let mut bits: BTreeMap<u64, String> = BTreeMap::new();
    let mut differ = false;
    let functions: Vec<(String, String)> =
        ROBOTS.iter().flat_map(|(robot, ..)| FUNCTIONS.map(|f| mangled(robot, f.name()))).collect();
    for (machine, memory, emulator) in MACHINES {
        let states = if machine.row().registers.is_some() { STATES } else { FEW_STATES };
        let source = bench.source(machine, memory, states, "#![no_std]\n#![no_main]\n");
        let program = bench.linked(machine, memory, emulator, &source, &[]);
        let (output, counts) = bench.run(&program, emulator, &plugin, &functions);
        let expected =
            bits.entry(states).or_insert_with(|| bench.on_the_host(&bench.source(machine, memory, states, "")));
        if *expected != output {
            println!("{machine:?}, {memory:?}: other bits than the host's\n{output}\n{expected}");
            differ = true;
        }
        let objects = bench.figures_of(&program, &functions);
        for (name, instructions) in counts {
            let own = objects.get(&name).copied().unwrap_or_default();
            let memory = if memory == Memory::Flash { "flash" } else { "tcm" };
            let figures = Figures { instructions: instructions / states, ..own };
            found.insert(format!("{}\t{memory}\t{name}", machine.row().name), figures);
        }
        let (is_the_same, of_rolled) = bench.rolled((machine, memory), emulator, states, &plugin);
        differ |= !is_the_same;
        found.extend(of_rolled);
    }
    differ |= !bench.self_tests_agree();
    let (agree, of_c99) = bench.c99(&bits[&STATES], CORTEX_M4F_BOARD, &plugin);
    differ |= !agree;
    found.extend(of_c99.into_iter().map(|(name, figures)| (format!("cortex-m4f\tflash\t{name}"), figures)));
    let (agree, of_derivatives) = bench.derivatives(CORTEX_M4F_BOARD, &plugin);
    differ |= !agree;
    found.extend(of_derivatives);
    let (of_fixed, agree) = bench.fixed(&plugin);
    differ |= !agree;
    found.extend(of_fixed);
    let looped = bench.looped(CORTEX_M4F_BOARD, &plugin);
    for (robot, [_, figures]) in &looped {
        found.insert(format!("cortex-m4f\tflash\t{robot}::inverse_dynamics, loop in C"), *figures);
    }
    let exceeded = limits::exceeded(&found);
    exceeded.iter().for_each(|what| println!("{what}"));
    let fails = differ || !exceeded.is_empty();
    let record = bench.here.join("benches/machines.tsv");
    let head = format!(
        "# machine, memory, function: instructions, bytes of flash, bytes of stack, loads and stores; {}\n",
        bench.compiler()
    );
    if std::env::var_os("MACHINES_UPDATE").is_some() {
        let mut text = head;
        for (name, f) in &found {
            writeln!(text, "{name}\t{}\t{}\t{}\t{}", f.instructions, f.flash, f.stack, f.loads_and_stores)
                .expect("a string takes text");
        }
        std::fs::write(&record, text).expect("the record can be written");
        return if fails { ExitCode::FAILURE } else { ExitCode::SUCCESS };
    }
    let text = std::fs::read_to_string(&record).expect("the record stands beside this bench");
    let same_compiler = text.starts_with(&head);
    if !same_compiler {
        println!("the record is of another compiler than {}: figures only", bench.compiler());
    }
    let recorded: BTreeMap<&str, u64> = text
        .lines()
        .filter_map(|line| {
            let name = line.splitn(4, '\t').take(3).map(str::len).sum::<usize>() + 2;
            let instructions = line.get(name..)?.trim().split('\t').next()?.parse().ok()?;
            Some((&line[..name], instructions))
        })
        .collect();
    let mut worse = false;
    println!("| machine | memory | function | recorded | instructions | flash B | stack B | loads and stores |\n|---|---|---|---|---|---|---|---|");
    for (name, f) in &found {
        let before = recorded.get(name.as_str()).copied();
        worse |= before.is_none_or(|before| f.instructions as f64 > before as f64 * (1.0 + TOLERANCE));
        let before = before.map_or("-".to_string(), |n| n.to_string());
        println!(
            "| {} | {before} | {} | {} | {} | {} |",
            name.replace('\t', " | "),
            f.instructions,
            f.flash,
            f.stack,
            f.loads_and_stores
        );
    }
    println!("\n| inverse dynamics, Cortex-M4F, flash | generated | loop in C | times |\n|---|---|---|---|");
    for (robot, [own, other]) in &looped {
        let [own, other] = [own, other].map(|figures| figures.instructions);
        println!("| {robot} | {own} | {other} | {:.2} |", other as f64 / own as f64);
    }
    if worse && same_compiler {
        println!("more instructions than recorded: if it pays elsewhere, record it by MACHINES_UPDATE=1");
    }
    match fails || (worse && same_compiler) {
        true => ExitCode::FAILURE,
        false => ExitCode::SUCCESS,
    }
}

struct Bench<'a> {
    here: &'a Path,
    cross: PathBuf,
    folder: PathBuf,
}

impl Bench<'_> {
    fn compiler(&self) -> String {
        let output = Command::new(self.cross.join("rustc")).arg("--version").output().expect("rustc runs");
        String::from_utf8_lossy(&output.stdout).trim().to_string()
    }

    /// The counter of instructions; none without a C compiler.
    fn plugin(&self) -> Option<PathBuf> {
        let library = self.folder.join("count.so");
        let source = self.here.join("benches/machines/count.c");
        let done =
            Command::new("cc").args(["-O2", "-shared", "-fPIC", "-o"]).arg(&library).arg(source).status().ok()?;
        done.success().then_some(library)
    }

    fn options(&self, robot: &str, target: TargetMachine, memory: Memory) -> Options {
        let (_, tolerance, floats) = ROBOTS.into_iter().find(|(name, ..)| *name == robot).expect("a robot of the list");
        let mut options = Options {
            functions: FUNCTIONS.to_vec(),
            scalar: Scalar::F32,
            target: Some(target),
            memory,
            ..Options::default()
        };
        (options.model.angle_tolerance, options.model.floating_base) = (tolerance, floats);
        options
    }

    fn of_options(&self, robot: &str, options: &Options) -> Generated {
        let name = format!("{robot}.urdf");
        let file = std::fs::read_to_string(self.here.join("descriptions").join(&name)).expect("the robot is there");
        compile(&Source::new(&name, file), options).unwrap_or_else(|errors| panic!("{errors}"))
    }

    /// What is made of a robot for a machine.
    fn compiled(&self, robot: &str, machine: TargetMachine, memory: Memory) -> Generated {
        self.of_options(robot, &self.options(robot, machine, memory))
    }

    /// The modules of all robots, and what runs them.
    fn source(&self, machine: TargetMachine, memory: Memory, states: u64, head: &str) -> String {
        let mut text = format!("{head}#![allow(warnings)]\n");
        let mut runs = String::new();
        for (robot, ..) in ROBOTS {
            let generated = self.compiled(robot, machine, memory);
            writeln!(text, "pub mod {robot} {{\n{}}}", generated.text).expect("a string takes text");
            writeln!(runs, "    run! {{ {robot} }}").expect("a string takes text");
        }
        text + &harness(&names(), &runs, "", states)
    }

    /// A program for a machine, with these objects.
    fn linked(
        &self,
        machine: TargetMachine,
        memory: Memory,
        emulator: Emulator,
        source: &str,
        objects: &[PathBuf],
    ) -> PathBuf {
        let device = self.here.join("firmware/device");
        let source = source.replace("STARTUP", &device.join("src/startup.rs").display().to_string());
        let file = self.folder.join("machine.rs");
        std::fs::write(&file, source).expect("a file can be written");
        let program = self.folder.join("machine.elf");
        let mut rustc = Command::new(self.cross.join("rustc"));
        rustc.args([
            "--edition=2021",
            "--crate-name=machine",
            "-Copt-level=3",
            "-Cpanic=abort",
            "-Ccodegen-units=1",
            "--cap-lints=allow",
        ]);
        rustc.args(["--target", machine.row().triple]);
        machine.flags(memory).iter().for_each(|flag| {
            rustc.args(flag.split(' '));
        });
        if let Some(layout) = emulator.layout {
            rustc.arg(format!("-Clink-arg=-T{}", device.join("memory").join(layout).display()));
        }
        rustc.args(objects.iter().map(|object| format!("-Clink-arg={}", object.display())));
        let output = rustc.arg("-o").args([&program, &file]).output().expect("rustc runs");
        assert!(output.status.success(), "{machine:?}: {}", String::from_utf8_lossy(&output.stderr));
        program
    }

    /// What a program prints, and how many instructions each of these functions took in all; by their names, with what is in their symbols.
    fn run(
        &self,
        program: &Path,
        emulator: Emulator,
        plugin: &Path,
        functions: &[(String, String)],
    ) -> (String, Vec<(String, u64)>) {
        let roots: String = functions.iter().map(|(_, symbol)| format!(",root={symbol}")).collect();
        let mut run = Command::new(self.cross.join(format!("run-{}", emulator.name)));
        let output = run.arg(program).arg("-plugin").arg(format!("{}{roots}", plugin.display())).output();
        let output = output.expect("the emulator runs");
        let (lines, counts) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{lines}\n{counts}");
        let of = |symbol: &str| {
            let line = counts.lines().find(|line| line.ends_with(&format!(" {symbol}")));
            let count = line.and_then(|line| line.split(' ').next()).and_then(|n| n.parse().ok());
            count.unwrap_or_else(|| panic!("{symbol} was not counted: {counts}"))
        };
        (lines.into_owned(), functions.iter().map(|(name, symbol)| (name.clone(), of(symbol))).collect())
    }

    /// The same program on this machine: what it prints.
    fn on_the_host(&self, source: &str) -> String {
        self.on_the_host_by(source, &["-Copt-level=2"])
    }

    fn on_the_host_by(&self, source: &str, flags: &[&str]) -> String {
        let startup = "mod startup { pub fn say(name: &str, number: u32) { println!(\"{name} {number:08x}\"); } }\nfn main() { run() }\n";
        let source = source.replace("#[path = \"STARTUP\"]\nmod startup;\n", startup);
        let (file, program) = (self.folder.join("host.rs"), self.folder.join("host"));
        std::fs::write(&file, source).expect("a file can be written");
        let mut rustc = Command::new(self.cross.join("rustc"));
        let output =
            rustc.args(["--edition=2021", "--cap-lints=allow"]).args(flags).arg("-o").args([&program, &file]).output();
        let output = output.expect("rustc runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&Command::new(program).output().expect("it runs").stdout).into_owned()
    }

    /// Flash, stack, and loads and stores of every function, where the disassembler knows the machine.
    fn figures_of(&self, program: &Path, functions: &[(String, String)]) -> BTreeMap<String, Figures> {
        let output = Command::new(self.cross.join("arm-none-eabi-objdump")).args(["-d", "-t"]).arg(program).output();
        let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
        let mut of_symbols: BTreeMap<&str, Figures> = BTreeMap::new();
        let (mut current, mut tables) = ("", Vec::new());
        // kernels of sines that a function calls
        let mut called: BTreeSet<(&str, &str)> = BTreeSet::new();
        for line in text.lines() {
            // `00002ae0 <name>:` or `00002ae0 g     F .text  00000204 name`
            if let Some(name) = line.strip_suffix(">:").and_then(|line| line.split_once('<')) {
                current = name.1;
            } else if let Some((_, size)) = line.split_once(" F .text\t") {
                let mut words = size.split_whitespace();
                if let (Some(size), Some(name)) = (words.next(), words.last()) {
                    of_symbols.entry(name).or_default().flash = u64::from_str_radix(size, 16).unwrap_or(0);
                }
            } else if let Some((_, size)) = line.split_once(" O ").and_then(|(_, table)| table.split_once('\t')) {
                // tables of constants are objects by themselves
                let mut words = size.split_whitespace();
                if let (Some(size), Some(name)) = (words.next(), words.last()) {
                    tables.push((name, u64::from_str_radix(size, 16).unwrap_or(0)));
                }
            } else {
                let mut words = line.split('\t').skip(2);
                let (Some(operation), operands) = (words.next(), words.next().unwrap_or("")) else { continue };
                if let Some((_, kernel)) = operands.split_once('<').filter(|(_, to)| to.contains("short_sines")) {
                    called.insert((current, kernel.trim().trim_end_matches('>')));
                }
                let figures = of_symbols.entry(current).or_default();
                let is_access =
                    ["vldr", "vstr", "ldr", "str", "vldm", "vstm", "ldm", "stm", "vpush", "vpop", "push", "pop"];
                figures.loads_and_stores +=
                    u64::from(is_access.iter().any(|access| operation.trim().starts_with(access)));
                figures.stack += set_aside(operation.trim(), operands);
            }
        }
        let of_sines = |function: &str| {
            let kernels = called.range((function, "")..).take_while(|(of, _)| *of == function);
            kernels.map(|(_, kernel)| of_symbols.get(kernel).map_or(0, |f| f.stack)).max().unwrap_or(0)
        };
        let figures = functions.iter().filter_map(|(name, symbol)| {
            // the shortest: one function's name may begin another's
            let all = of_symbols.iter().filter(|(of, _)| of.contains(symbol) && !of.contains("harness"));
            let (of, found) = all.min_by_key(|(of, _)| of.len())?;
            let of_tables: u64 = tables.iter().filter(|(of, _)| of.contains(symbol)).map(|(_, size)| size).sum();
            let (flash, stack) = (found.flash + of_tables, found.stack + of_sines(of));
            Some((name.clone(), Figures { flash, stack, ..*found }))
        });
        figures.collect()
    }
}

fn names() -> Vec<&'static str> {
    ROBOTS.iter().map(|(robot, ..)| *robot).collect()
}

/// What runs these robots.
fn harness(robots: &[&str], runs: &str, externs: &str, states: u64) -> String {
    let calls: String = robots.iter().map(|robot| format!("    harness::{robot}();\n")).collect();
    let text = include_str!("harness.rs").replace("    ROBOTS\n", runs).replace("    EXTERNS\n", externs);
    format!("{}\nfn run() {{\n{calls}}}\n", text.replace("STATES", &states.to_string()))
}

/// `panda::inverse_dynamics`, and what is in its symbol.
fn mangled(robot: &str, function: &str) -> (String, String) {
    (format!("{robot}::{function}"), format!("{}{robot}{}{function}", robot.len(), function.len()))
}

/// Bytes of stack that an instruction takes.
fn set_aside(operation: &str, operands: &str) -> u64 {
    let listed = || operands.split_once('{').map_or("", |(_, list)| list.trim_end_matches('}'));
    let number = |register: &str| register.trim().trim_start_matches(['d', 's']).parse::<u64>().unwrap_or(0);
    let registers: u64 = match () {
        () if operation.starts_with("vpush") => {
            let count = listed()
                .split(',')
                .map(|r| r.split_once('-').map_or(1, |(a, b)| number(b) - number(a) + 1))
                .sum::<u64>();
            2 * count
        }
        () if operation.starts_with("push") || (operation.starts_with("stmdb") && operands.starts_with("sp!")) => {
            listed().split(',').count() as u64
        }
        () => 0,
    };
    let below = operation.starts_with("sub") && operands.starts_with("sp");
    let bytes =
        operands.split_once('#').map_or("", |(_, n)| n.split(|c: char| !c.is_ascii_digit()).next().unwrap_or(""));
    4 * registers + if below { bytes.parse().unwrap_or(0) } else { 0 }
}
