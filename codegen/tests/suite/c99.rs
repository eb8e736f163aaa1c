//! Packages in C99 as C compilers see them: the bits of the programs, at every level of optimisation; no warning, no library, no violation of
//! the rules that they claim. Truth is the interpreter, over the machine's own f32 and f64.

use crate::cross;
use crate::standalone::Folder;
use crate::written::{Shape, Style, Written};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use straightline_codegen::certify::{search, Effort};
use straightline_codegen::choices::{FixedProducts, Lanes, LimbForm, TargetMachine};
use straightline_codegen::compile::checked_package;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::c99::{C99_SOURCE, KERNEL};
use straightline_codegen::emit::package::PackageKind;
use straightline_codegen::emit::rust::c_package::C_ABI;
use straightline_codegen::emit::Generated;
use straightline_codegen::expr::{Graph, Port};
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::scene::{Budget, InputRange, JointRanges, MaxError};
use straightline_codegen::schedule::ScheduleLimits;
use straightline_codegen::{compile, Function, Scalar};
use straightline_core::random::Random;
use straightline_core::trig;

const ARM: &str = include_str!("../files/arm.toml");

/// What both compilers are asked.
const STRICT: [&str; 11] = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wfloat-equal",
    "-Wshadow",
    "-Wundef",
    "-Wstrict-prototypes",
    "-Werror",
];

/// Compilers with options that decide what they may do.
const COMPILATIONS: [(&str, &[&str]); 3] = [("gcc", &["-O0"]), ("gcc", &["-O3"]), ("clang", &["-O2"])];
const FURTHER_COMPILATIONS: [(&str, &[&str]); 3] = [("gcc", &["-O2"]), ("clang", &["-O0"]), ("clang", &["-O3"])];

fn is_there(program: &str) -> bool {
    let found = cross::command(program).is_some();
    if !found {
        eprintln!("skipped: {program} is not there");
    }
    found
}

fn command(program: &str) -> Command {
    cross::command(program).unwrap_or_else(|| panic!("{program} is not there"))
}

/// What a command says on its way to a failure, if it fails.
fn complaint(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    (!output.status.success()).then(|| format!("{command:?}\n{}", String::from_utf8_lossy(&output.stderr)))
}

fn succeeds(command: &mut Command) {
    if let Some(what) = complaint(command) {
        panic!("{what}");
    }
}

fn options_of(scene: &str, options: Options) -> Options {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
    file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(options)
}

pub fn robot(name: &str) -> Source {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(name);
    Source::new(name, std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

/// A package on disk, with the programs that it is to compute.
struct Package {
    folder: Folder,
    generated: Generated,
    source: PathBuf,
}

impl Package {
    fn new(name: &str, robot: &Source, options: &Options) -> Package {
        let generated = compile(robot, options).unwrap_or_else(|errors| panic!("{}\n{errors}", robot.text()));
        Package::of(name, generated, "robot")
    }

    fn of(name: &str, generated: Generated, prefix: &str) -> Package {
        assert_eq!((C99_SOURCE.refusal)(&generated), None);
        let folder = Folder::new(name);
        let files = checked_package(&C99_SOURCE, &generated, prefix).unwrap_or_else(|errors| panic!("{errors}"));
        for (file, text) in files {
            std::fs::write(folder.file(&file), text).expect("it can be written");
        }
        let source = folder.file(&format!("{}_dynamics.c", prefix.to_lowercase()));
        Package { folder, generated, source }
    }

    fn text(&self) -> String {
        std::fs::read_to_string(&self.source).expect("it was written")
    }

    /// The functions that C can call: names in C, and their programs.
    fn programs(&self) -> Vec<(String, &Graph, Scalar)> {
        let programs = &self.generated.programs;
        let of_robot = programs.functions.iter().map(|p| (format!("robot_{}", p.name), &p.graph, p.scalar));
        let of_modes = programs.modes.iter().flat_map(|mode| {
            let name = |p: &str| format!("robot_contact_{}_{p}", mode.identifier);
            mode.functions.iter().map(move |p| (name(&p.name), &p.graph, p.scalar))
        });
        of_robot.chain(of_modes).collect()
    }

    /// An object of the source, which takes nothing from elsewhere.
    fn object(&self, compiler: &str, flags: &[&str]) -> PathBuf {
        let object = self.folder.file(&format!("{compiler}{}.o", flags.concat()));
        let strict = if flags.iter().any(|flag| flag.starts_with("-std")) { &STRICT[1..] } else { &STRICT[..] };
        succeeds(command(compiler).args(strict).args(flags).arg("-c").arg(&self.source).arg("-o").arg(&object));
        object
    }

    /// How many numbers of all functions at random states are not those of their programs.
    fn differences(&self, compiler: &str, flags: &[&str], states: usize) -> Vec<String> {
        let object = self.object(compiler, flags);
        let undefined = Command::new("nm").arg("-u").arg(&object).output().expect("nm runs");
        assert_eq!(String::from_utf8_lossy(&undefined.stdout).trim(), "", "{compiler} {flags:?} wants a library");
        let programs = self.programs();
        let (main, program) = (self.folder.file("main.c"), object.with_extension("out"));
        std::fs::write(&main, caller(&self.source, &programs, states)).expect("it can be written");
        succeeds(command(compiler).args(["-std=c99", "-O1"]).arg(&main).arg(&object).arg("-o").arg(&program));
        let (given, truth) = numbers(&programs, states);
        let (input, output) = (self.folder.file("given"), self.folder.file("computed"));
        std::fs::write(&input, given).expect("it can be written");
        succeeds(Command::new(&program).args([&input, &output]));
        let computed = std::fs::read(&output).expect("the program wrote it");
        differences(&computed, &truth)
    }

    /// Every compilation gives the bits of the programs.
    fn is_right(&self, states: usize) {
        self.is_right_by(&COMPILATIONS, states);
    }

    fn is_right_by(&self, compilations: &[(&str, &[&str])], states: usize) {
        for (compiler, flags) in compilations.iter().filter(|(compiler, _)| is_there(compiler)) {
            let found = self.differences(compiler, flags, states);
            assert!(found.is_empty(), "{compiler} {flags:?}: {} numbers differ: {}", found.len(), found[0]);
        }
    }
}

/// A number that a program computes, with what it is.
pub struct True {
    what: String,
    pub value: f64,
    scalar: Scalar,
}

/// What computed bytes have else than they should; that a number is none is all that is asked of one that is none.
pub fn differences(computed: &[u8], truth: &[True]) -> Vec<String> {
    let mut at = 0;
    let mut found = Vec::new();
    for True { what, value, scalar } in truth {
        let bytes = &computed[at..at + scalar.bytes()];
        at += scalar.bytes();
        let x = match scalar {
            Scalar::F64 => f64::from_le_bytes(bytes.try_into().expect("8 bytes")),
            Scalar::F32 => f64::from(f32::from_le_bytes(bytes.try_into().expect("4 bytes"))),
        };
        if x.to_bits() != value.to_bits() && !(x.is_nan() && value.is_nan()) {
            found.push(format!("{what} is {x:e}, not {value:e}"));
        }
    }
    assert_eq!(at, computed.len(), "as many numbers as the programs have");
    found
}

/// The inputs of states for all functions as bytes, and what the interpreter makes of them.
pub fn numbers(programs: &[(String, &Graph, Scalar)], states: usize) -> (Vec<u8>, Vec<True>) {
    let mut random = Random(7);
    let (mut given, mut truth) = (Vec::new(), Vec::new());
    for (name, graph, scalar) in programs {
        let count: usize = graph.inputs.iter().map(Port::len).sum();
        for state in 0..states {
            // beside states as they are met: far ones, zeros of both signs, and some that have no answer
            let size = [1.5, 3.0, 3.0, 3.0, 1e3, 1e-3, 3e4, 1e30][random.below(8)];
            let number = |random: &mut Random| match random.below(40) {
                0 => 0.0,
                1 => -0.0,
                _ => scalar.rounded(random.symmetric(size)),
            };
            let inputs: Vec<f64> = (0..count).map(|_| number(&mut random)).collect();
            for x in &inputs {
                match scalar {
                    Scalar::F64 => given.extend(x.to_le_bytes()),
                    Scalar::F32 => given.extend((*x as f32).to_le_bytes()),
                }
            }
            let results = search::computed_at(graph, *scalar, &inputs);
            let what = |k: usize| format!("{name}, state {state}, result {k} of {inputs:?}");
            truth.extend(results.iter().enumerate().map(|(k, x)| True { what: what(k), value: *x, scalar: *scalar }));
        }
    }
    (given, truth)
}

/// A program that reads inputs, calls every function, and writes outputs.
fn caller(source: &Path, programs: &[(String, &Graph, Scalar)], states: usize) -> String {
    let header = source.with_extension("h");
    let mut text = format!(
        "#include <stdio.h>\n#include \"{}\"\nint main(int n, char **files) {{\n    FILE *in = fopen(files[1], \"rb\"), *out = fopen(files[2], \"wb\");\n    \
         size_t done = 0;\n    if (n != 3 || !in || !out || robot_arithmetic_check() != 0) return 1;\n",
        header.display()
    );
    for (name, graph, scalar) in programs {
        let ports = || graph.inputs.iter().map(|p| (p, true)).chain(graph.outputs.iter().map(|p| (p, false)));
        let _ = writeln!(text, "    for (int state = 0; state < {states}; state++) {{");
        for (port, _) in ports() {
            let _ = writeln!(text, "        static {} {}[{}];", scalar.c_name(), port.name, port.len().max(1));
        }
        for (port, _) in ports().filter(|(_, is_input)| *is_input) {
            let _ = writeln!(text, "        done += fread({0}, sizeof *{0}, {1}, in);", port.name, port.len());
        }
        let names: Vec<&str> = ports().map(|(port, _)| port.name.as_str()).collect();
        let _ = writeln!(text, "        {name}({});", names.join(", "));
        for (port, _) in ports().filter(|(_, is_input)| !is_input) {
            let _ = writeln!(text, "        done += fwrite({0}, sizeof *{0}, {1}, out);", port.name, port.len());
        }
        text.push_str("    }\n");
    }
    text + "    return fclose(out) || done == 0;\n}\n"
}

/// Functions of every kind: with sines, roots and divisions, in parts, over limbs.
const FUNCTIONS: [Function; 4] =
    [Function::InverseDynamics, Function::MassMatrix, Function::ForwardDynamics, Function::ForwardKinematics];

fn in_scalar(scalar: Scalar) -> Options {
    Options { scalar, functions: FUNCTIONS.to_vec(), ..Options::default() }
}

#[test]
fn random_robots_have_the_bits_of_their_programs() {
    for seed in 0..4u64 {
        let shape = Shape::any(&mut crate::written::Random(seed), 4);
        let written = Written::new(Style::all()[seed as usize % Style::all().len()], shape, seed);
        let options = in_scalar([Scalar::F64, Scalar::F32][seed as usize % 2]);
        let robot = Source::new(written.file_name(), written.text());
        let Ok(generated) = compile(&robot, &options) else { continue };
        Package::of(&format!("c99-random-{seed}"), generated, "robot").is_right(100);
    }
}

/// Derivatives, products with them, regressors and tasks, which are made for who names them.
#[test]
fn derivatives_and_regressors_have_the_bits_of_their_programs() {
    let functions = vec![
        Function::InverseDynamicsDerivatives,
        Function::InverseDynamicsVjp,
        Function::InverseDynamicsHvp,
        Function::ForwardDynamicsDerivatives,
        Function::CentroidalDerivatives,
        Function::InverseKinematicsStep,
        Function::StepDerivatives,
        Function::TorqueRegressor,
    ];
    for scalar in [Scalar::F64, Scalar::F32] {
        let options = Options { functions: functions.clone(), ..in_scalar(scalar) };
        Package::new(&format!("c99-derivatives-{}", scalar.name()), &Source::new("arm.toml", ARM), &options)
            .is_right(100);
    }
}

/// Robots of any shape and style with all functions: `cargo test --release -p straightline-codegen --test suite c99:: -- --ignored`.
#[test]
#[ignore = "a minute or more: compiles 40 robots with all functions six times"]
fn long_proof_many_random_robots_have_the_bits_of_their_programs() {
    let mut compiled = 0;
    for seed in 100..118u64 {
        let mut random = crate::written::Random(seed);
        let shape = Shape::any(&mut random, 5);
        let written = Written::new(Style::all()[seed as usize % Style::all().len()], shape, seed);
        let options = Options {
            scalar: [Scalar::F64, Scalar::F32][seed as usize % 2],
            limits: ScheduleLimits { operations: [60, 400, 12_000][seed as usize % 3] },
            limbs: if seed % 5 == 0 { LimbForm::Lanes } else { LimbForm::default() },
            ..Options::default()
        };
        let Ok(generated) = compile(&Source::new(written.file_name(), written.text()), &options) else { continue };
        let package = Package::of(&format!("c99-many-{seed}"), generated, "robot");
        package.is_right(100);
        package.is_right_by(&FURTHER_COMPILATIONS, 100);
        compiled += 1;
    }
    assert!(compiled > 13, "{compiled} of 18 robots are robots");
}

#[test]
fn long_functions_in_parts_and_limbs_in_loops_have_the_bits_of_their_programs() {
    let limits = ScheduleLimits { operations: 150 };
    for scalar in [Scalar::F64, Scalar::F32] {
        let functions = vec![Function::InverseDynamics, Function::ForwardDynamics];
        let mut options = Options { limits, limbs: LimbForm::Lanes, functions, ..in_scalar(scalar) };
        options.model.floating_base = true;
        let package = Package::new(&format!("c99-limbs-{}", scalar.name()), &robot("hyq.urdf"), &options);
        let text = package.text();
        assert!(text.contains("for (uint32_t limb = 0U;") && text.contains("_part2("), "{text}");
        assert_eq!(
            text.contains("double") || text.contains("int64") || text.contains("INT64"),
            scalar == Scalar::F64,
            "of f32 nothing is wider"
        );
        package.is_right(20);
    }
    // rolled: a row of constants per leg, and short sines in the loop
    for scalar in [Scalar::F64, Scalar::F32] {
        let functions = vec![Function::InverseDynamics, Function::GravityForce];
        let target = Some(TargetMachine::CORTEX_M4F);
        let mut options = Options { limbs: LimbForm::Rolled, functions, target, ..in_scalar(scalar) };
        options.model.floating_base = true;
        let package = Package::new(&format!("c99-rolled-{}", scalar.name()), &robot("hyq.urdf"), &options);
        assert!(package.text().contains("tau[8U + (3U * limb)] = "), "{}", package.text());
        package.is_right(20);
    }
    // angles of parallel joints are sums
    let package = Package::new("c99-ur5", &robot("ur5.urdf"), &Options { limits, ..in_scalar(Scalar::F32) });
    assert!(package.text().contains("robot_next_angle_f32(robot_first_angle_f32(q[1]), q[2])"), "{}", package.text());
    package.is_right(100);
}

const SCENE: &str = "[outputs]\nfunctions = [\"gravity_force\", \"forward_dynamics\"]\ncontact = [\"forward_dynamics\", \"impact\"]\n\
     [[parameter]]\nkind = \"payload\"\nname = \"why\"\nframe = \"hand\"\n[[parameter]]\nkind = \"payload\"\nname = \"turn\"\nframe = \"hand\"\n\
     [[contact]]\nname = \"pen\"\nframe = \"hand\"\nobject = \"input\"\nconstrained = [\"pz\"]\nfriction = { coefficient = 0.3, speed = 0.015 }\n\
     [[mode]]\nname = \"writing\"\ncontacts = [\"pen\"]\n";

#[test]
fn parameters_contacts_and_bounds_have_the_bits_of_their_programs() {
    for scalar in [Scalar::F64, Scalar::F32] {
        let options = Options { scalar, ..Options::default() };
        let package = Package::new(
            &format!("c99-scene-{}", scalar.name()),
            &Source::new("arm.toml", ARM),
            &options_of(SCENE, options),
        );
        let text = package.text();
        for name in ["robot_contact_writing_impact(", "int robot_why_new("] {
            assert!(text.contains(name), "{name}: {text}");
        }
        package.is_right(100);
    }
    let effort = Effort { companions: true, ..Effort::default() };
    let functions = vec![Function::GravityForce, Function::InverseDynamics];
    let options = Options { certify: Some(effort), functions, ..Options::default() };
    let package = Package::new("c99-bounds", &Source::new("arm.toml", ARM), &options);
    assert!(package.text().contains("void robot_gravity_force_error_bound("), "{}", package.text());
    package.is_right(100);
}

#[test]
fn short_sines_have_the_bits_of_their_program() {
    let target = Some(TargetMachine::CORTEX_M4F);
    for name in ["panda.urdf", "ur5.urdf"] {
        let package =
            Package::new(&format!("c99-short-{name}"), &robot(name), &Options { target, ..in_scalar(Scalar::F32) });
        assert!(package.text().contains("_short_sin_cos_f32(") && !package.text().contains("robot_sin_cos_f32("));
        package.is_right(100);
    }
}

#[test]
fn mixed_precision_has_the_bits_of_its_program() {
    let mut options = Options { scalar: Scalar::F32, functions: vec![Function::InverseDynamics], ..Options::default() };
    options.scene.ranges.qd = JointRanges::All(InputRange::within(0.5));
    options.scene.ranges.qdd = JointRanges::All(InputRange::within(1.0));
    // the least of these budgets that can be met takes operations in f64
    let generated = (0..20).find_map(|k| {
        let most = MaxError::All(2e-5 * 1.2f64.powi(k));
        let budget = Budget { max_error: Some(most), mixed_precision: true, ..Budget::default() };
        options.scene.budgets.insert(Function::InverseDynamics, budget);
        compile(&robot("ur5.urdf"), &options).ok()
    });
    let package = Package::of("c99-mixed", generated.expect("one can be met"), "robot");
    let text = package.text();
    assert!(text.contains("const double t") && text.contains("(float)(") && text.contains("(double)"), "{text}");
    package.is_right(100);
}

/// GCC fuses unless the source says otherwise; Clang fuses within expressions. What both do with the source as it is is in [`Package::is_right`].
#[test]
fn contracted_and_rearranged_compilations_have_the_same_bits_or_are_refused() {
    let package = Package::new("c99-contracted", &robot("ur5.urdf"), &in_scalar(Scalar::F64));
    let fused: &[&[&str]] = &[
        &["-std=c99", "-O2", "-mfma"],
        &["-std=gnu17", "-O3", "-mfma"],
        &["-std=gnu99", "-O2", "-mfma", "-ffp-contract=on"],
        &["-std=c99", "-O2", "-mfma", "-ffp-contract=off"],
        &["-std=gnu17", "-O3", "-march=x86-64-v3"],
    ];
    let of_gcc: &[&[&str]] =
        &[&["-std=gnu17", "-O2", "-mfma", "-ffp-contract=fast"], &["-std=c99", "-O3", "-mfma", "-ffp-contract=fast"]];
    let refused: &[&[&str]] = &[
        &["-ffast-math"],
        &["-Ofast"],
        &["-ffinite-math-only"],
        &["-mfpmath=387"],
        &["-ffast-math", "-fno-finite-math-only"],
    ];
    let of_clang = [
        &[][..],
        &["-O2", "-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"],
        &["-O2", "-freciprocal-math"],
    ];
    for compiler in ["gcc", "clang"].into_iter().filter(|compiler| is_there(compiler)) {
        if !cfg!(target_arch = "x86_64")
            || !std::fs::read_to_string("/proc/cpuinfo").is_ok_and(|text| text.contains(" fma "))
        {
            eprintln!("skipped: this machine has no fused multiply-add");
            return;
        }
        let more = if compiler == "gcc" { of_gcc } else { &of_clang[1..] };
        for flags in fused.iter().chain(more) {
            assert_eq!(package.differences(compiler, flags, 20), [""; 0], "{compiler} {flags:?}");
        }
        for flags in refused {
            if compiler == "clang" && (flags.contains(&"-mfpmath=387") || flags.len() > 1) {
                // has no such mode; and what is left of -ffast-math no macro says
                continue;
            }
            let mut command = command(compiler);
            let refusal = complaint(command.args(*flags).arg("-fsyntax-only").arg(&package.source));
            assert!(refusal.is_some_and(|what| what.contains("#error")), "{compiler} {flags:?}");
        }
    }
    // what no text can turn off, it finds at run time
    for compiler in ["clang"].into_iter().filter(|compiler| is_there(compiler)) {
        let main = package.folder.file("check.c");
        let text = "#include \"robot_dynamics.h\"\nint main(void) { return robot_arithmetic_check(); }\n";
        std::fs::write(&main, text).expect("it can be written");
        for (flag, code) in [("-ffp-contract=off", 0), ("-ffp-contract=fast", 1)] {
            let program = package.folder.file("check");
            let flags = ["-O2", "-mfma", flag, "-o"];
            succeeds(command(compiler).args(flags).args([&program, &main, &package.source]));
            assert_eq!(Command::new(&program).status().expect("it runs").code(), Some(code), "{flag}");
        }
    }
}

/// A comparison that finds nothing would prove nothing: without its pragmas, and with an operation changed, the source has other bits.
#[test]
fn sources_that_compute_something_else_are_found() {
    if !is_there("gcc") {
        return;
    }
    let package = Package::new("c99-controls", &robot("ur5.urdf"), &in_scalar(Scalar::F64));
    let text = package.text();
    let (kernel, functions) = text.split_at(text.find("void robot_mass_matrix(").expect("it is there"));
    let literal = format!("{kernel}{}", functions.replacen(" * 0.", " * 0.0", 1));
    let swapped = format!("{kernel}{}", functions.replacen(" + (", " - (", 1));
    for (what, broken, flags) in [
        ("an operation", swapped, &["-O2"][..]),
        ("a constant", literal, &["-O2"]),
        ("contraction", text.replace("\"fp-contract=off\", ", ""), &["-O2", "-std=gnu17", "-mfma"]),
    ] {
        if what == "contraction" && !std::fs::read_to_string("/proc/cpuinfo").is_ok_and(|text| text.contains(" fma ")) {
            continue;
        }
        assert_ne!(broken, text, "{what}");
        // the check at the start of the program is a control of its own
        let broken = broken
            .replace("return robot_arithmetic_check_f64();", "(void)robot_arithmetic_check_f64();\n    return 0;");
        std::fs::write(&package.source, &broken).expect("it can be written");
        assert!(!package.differences("gcc", flags, 20).is_empty(), "{what}");
    }
}

/// The constructors, and the header for C++, with `std::array` and with arrays.
#[test]
fn cpp_and_c_make_run_time_parameters_and_are_told_why_they_cannot_be() {
    let package = Package::new("c99-made", &Source::new("arm.toml", ARM), &options_of(SCENE, Options::default()));
    let main = package.folder.file("main.cpp");
    let n = package.generated.parameters[0].scalars;
    let text = format!(
        r#"#include "robot_dynamics.hpp"
#include <limits>
namespace robot = robot_dynamics;
int main() {{
    static_assert(robot::nq == 3 && robot::nv == 3, "sizes are constants");
    std::array<double, 3> q = {{{{0.3, -0.8, 1.1}}}}, com = {{{{0.1, 0.02, -0.05}}}}, g, other;
    std::array<double, 6> inertia = {{{{1e-3, 0, 0, 2e-3, 0, 1.5e-3}}}}, impossible = {{{{1e-3, 0, 0, 1e-3, 0, 3e-3}}}};
    robot::why_type why = {{}}, turn = {{}};
    if (robot::why_new(-1.0, com, inertia, why) != 2 || robot::why_new(0.0, com, inertia, why) != 3) return 1;
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    if (robot::why_new(nan, com, inertia, why) != 1 || robot::why_new(inf, com, inertia, why) != 1) return 2;
    if (robot::why_new(1.0, com, impossible, why) != 4) return 3;
    for (double x : why) if (x != 0) return 4;
    robot::gravity_force(q, why, turn, g);
    if (robot::why_new(0.7, com, inertia, why) != 0 || why[0] == 0) return 5;
    robot::gravity_force(q, why, turn, other);
    if (g == other) return 6;
    double plain_q[3] = {{0.3, -0.8, 1.1}}, plain_why[{n}], plain_turn[{n}] = {{0}}, plain_g[3];
    for (std::size_t i = 0; i < {n}; i++) plain_why[i] = why[i];
    robot::gravity_force(plain_q, plain_why, plain_turn, plain_g);
    for (std::size_t i = 0; i < 3; i++) if (plain_g[i] != other[i]) return 7;
    return robot::arithmetic_check();
}}
"#
    );
    std::fs::write(&main, text).expect("it can be written");
    for (c, cpp) in [("gcc", "g++"), ("clang", "clang++")].into_iter().filter(|(c, cpp)| is_there(c) && is_there(cpp)) {
        let (object, program) = (package.object(c, &["-O2"]), package.folder.file("cpp"));
        for standard in ["-std=c++11", "-std=c++17", "-std=c++20"] {
            let strict = [standard, "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"];
            succeeds(command(cpp).args(strict).arg(&main).arg(&object).arg("-o").arg(&program));
            assert_eq!(Command::new(&program).status().expect("it runs").code(), Some(0), "{cpp} {standard}");
        }
        // an array of another length is no argument
        let short =
            "#include \"robot_dynamics.hpp\"\nint main() { std::array<double, 2> q{}; robot_dynamics::why_type w{}; \
                     std::array<double, 3> g; robot_dynamics::gravity_force(q, w, w, g); }\n";
        let wrong = package.folder.file("short.cpp");
        std::fs::write(&wrong, short).expect("it can be written");
        assert!(complaint(command(cpp).args(["-std=c++11", "-fsyntax-only"]).arg(&wrong)).is_some());
    }
}

/// What a constructor makes has the bits of its program, and nothing of a drive that cannot be is made.
#[test]
fn constructors_compute_their_programs() {
    for scalar in [Scalar::F64, Scalar::F32] {
        let options = options_of(SCENE, Options { scalar, ..Options::default() });
        let package =
            Package::new(&format!("c99-constructor-{}", scalar.name()), &Source::new("arm.toml", ARM), &options);
        let given: Vec<f64> =
            [0.7, 0.1, 0.02, -0.05, 0.031, 0.002, -0.003, 0.042, 0.001, 0.025].map(|x| scalar.rounded(x)).into();
        let program = &package.generated.programs.parameters[0].program;
        let made = search::computed_at(&program.graph, scalar, &given);
        let t = scalar.c_name();
        let list = |x: &[f64]| x.iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(", ");
        let text = format!(
            "#include <string.h>\n#include \"robot_dynamics.h\"\nint main(void) {{\n    static const double g[10] = {{{}}}, m[{n}] = {{{}}};\n    \
             {t} com[3], inertia[6], made[{n}], is[{n}];\n    for (int i = 0; i < 3; i++) com[i] = ({t})g[1 + i];\n    \
             for (int i = 0; i < 6; i++) inertia[i] = ({t})g[4 + i];\n    for (int i = 0; i < {n}; i++) is[i] = ({t})m[i];\n    \
             return robot_why_new(({t})g[0], com, inertia, made) || memcmp(made, is, sizeof is);\n}}\n",
            list(&given),
            list(&made),
            n = made.len(),
        );
        let main = package.folder.file("made.c");
        std::fs::write(&main, text).expect("it can be written");
        for compiler in ["gcc", "clang"].into_iter().filter(|compiler| is_there(compiler)) {
            let (object, program) = (package.object(compiler, &["-O2"]), package.folder.file("made"));
            succeeds(command(compiler).arg("-std=c99").arg(&main).arg(&object).arg("-o").arg(&program));
            assert_eq!(Command::new(&program).status().expect("it runs").code(), Some(0), "{compiler}");
        }
    }
}

/// A checksum of what the kernel makes of a million numbers, the same steps in Rust and in C.
macro_rules! checksum_of_kernel {
    ($name:ident, $t:ty, $bits:ty, $sin_cos:ident, $of_sum:ident, $sum:ident, $sqrt:ident, $sign:ident, $domain:expr $(, $short:expr)?) => {
        fn $name(count: usize) -> u64 {
            let mut random = Random(5);
            let mut hash = 0xcbf2_9ce4_8422_2325u64;
            let mut take = |x: $t| hash = (hash ^ x.to_bits() as u64).wrapping_mul(0x0000_0100_0000_01b3);
            let edge = $domain.to_bits();
            let special: [$t; 12] = [
                0.0,
                -0.0,
                <$t>::MIN_POSITIVE,
                <$t>::MAX,
                <$t>::INFINITY,
                -<$t>::INFINITY,
                <$t>::from_bits(1),
                -1.0,
                $domain,
                <$t>::from_bits(edge + 1),
                -<$t>::from_bits(edge - 1),
                <$t>::from_bits(<$t>::INFINITY.to_bits() + 1),
            ];
            for k in 0..count {
                let x = match k % 3 {
                    _ if k < special.len() => special[k],
                    0 => <$t>::from_bits(random.bits() as $bits),
                    1 => (random.bits() >> 40) as $t / 4096.0 - 2048.0,
                    _ => (random.bits() >> 40) as $t / 4194304.0 - 2.0,
                };
                let (s, c) = trig::$sin_cos(x);
                take(s);
                take(c);
                let (s, c) = trig::$of_sum(trig::$sum([x, x * 0.3, 1.0]));
                // of a sum that is none, only that it is none is said
                take(if s.is_nan() { 1.0 } else { s });
                take(if c.is_nan() { 1.0 } else { c });
                $(let (s, c) = $short(x);
                take(if s.is_nan() { 1.0 } else { s });
                take(if c.is_nan() { 1.0 } else { c });)?
                take(trig::$sqrt(x));
                take(trig::$sign(x));
            }
            hash
        }
    };
}
checksum_of_kernel!(
    checksum_f64,
    f64,
    u64,
    sin_cos_f64,
    sin_cos_of_sum_f64,
    sum_of_angles_f64,
    sqrt_f64,
    sign_f64,
    trig::DOMAIN_F64
);
checksum_of_kernel!(
    checksum_f32,
    f32,
    u32,
    sin_cos_f32,
    sin_cos_of_sum_f32,
    sum_of_angles_f32,
    sqrt_f32,
    sign_f32,
    trig::DOMAIN_F32,
    straightline_core::short_sines::sin_cos_f32
);

/// The same in C, behind the kernel.
fn checksum_in_c(scalar: Scalar, count: usize) -> String {
    let domain = if scalar == Scalar::F64 { trig::DOMAIN_F64 } else { f64::from(trig::DOMAIN_F32) };
    let [min, max] = [scalar.tiny(), scalar.largest()].map(|x| scalar.literal(x) + scalar.c_suffix());
    let infinity = if scalar == Scalar::F64 { "UINT64_C(0x7ff0000000000000)" } else { "UINT32_C(0x7f800000)" };
    let text = r#"
static uint64_t state = 5, hash = UINT64_C(0xcbf29ce484222325);
static uint64_t next(void) {
    uint64_t z = (state += UINT64_C(0x9e3779b97f4a7c15));
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}
static void take(T x) { hash = (hash ^ robot_to_bits_NAME(x)) * UINT64_C(0x100000001b3); }
int main(void) {
    const T domain = DOMAIN;
    const BITS edge = robot_to_bits_NAME(domain);
    const T special[12] = {
        0, -ZERO, MIN, MAX, robot_from_bits_NAME(INFINITE), -robot_from_bits_NAME(INFINITE), robot_from_bits_NAME(1), -1, domain,
        robot_from_bits_NAME(edge + 1), -robot_from_bits_NAME(edge - 1), robot_from_bits_NAME(INFINITE + 1) };
    for (int k = 0; k < COUNT; k++) {
        T x;
        if (k < 12) x = special[k];
        else if (k % 3 == 0) x = robot_from_bits_NAME((BITS)next());
        else if (k % 3 == 1) x = (T)(next() >> 40) / 4096 - 2048;
        else x = (T)(next() >> 40) / 4194304 - 2;
        const robot_turn_NAME one = robot_sin_cos_NAME(x);
        take(one.sine);
        take(one.cosine);
        const robot_angle_NAME sum = robot_next_angle_NAME(robot_next_angle_NAME(robot_first_angle_NAME(x), x * POINT3), 1);
        const robot_turn_NAME of_sum = robot_sin_cos_of_sum_NAME(sum);
        take(of_sum.sine == of_sum.sine ? of_sum.sine : 1);
        take(of_sum.cosine == of_sum.cosine ? of_sum.cosine : 1);
        SHORT
        take(robot_sqrt_NAME(x));
        take(robot_sign_NAME(x));
    }
    printf("%llu\n", (unsigned long long)hash);
    return robot_arithmetic_check_NAME();
}
"#;
    let bits = format!("uint{}_t", 8 * scalar.bytes());
    let short = "const robot_turn_f32 brief = robot_short_sin_cos_f32(x);\n        take(brief.sine == brief.sine ? brief.sine : 1);\n        \
                 take(brief.cosine == brief.cosine ? brief.cosine : 1);";
    let words = [
        ("SHORT", if scalar == Scalar::F32 { short.to_string() } else { String::new() }),
        ("NAME", scalar.name().to_string()),
        ("DOMAIN", scalar.literal(domain) + scalar.c_suffix()),
        ("MIN", min),
        ("MAX", max),
        ("INFINITE", infinity.to_string()),
        ("POINT3", scalar.literal(0.3) + scalar.c_suffix()),
        ("ZERO", scalar.literal(0.0) + scalar.c_suffix()),
        ("BITS", bits),
        ("COUNT", count.to_string()),
        ("T ", format!("{} ", scalar.c_name())),
        ("(T)", format!("({})", scalar.c_name())),
    ];
    let text = words.iter().fold(text.to_string(), |text, (word, by)| text.replace(word, by));
    // all of the kernel, as a text that would use all of it
    let pragma = "#if defined(__clang__)\n#pragma STDC FP_CONTRACT OFF\n#else\n#pragma GCC optimize(\"fp-contract=off\")\n#endif\n";
    format!("#include <stdbool.h>\n#include <stdint.h>\n#include <stdio.h>\n{pragma}{KERNEL}{text}")
}

#[test]
fn the_kernel_in_c_has_the_bits_of_that_in_rust() {
    const COUNT: usize = 1_000_000;
    let folder = Folder::new("c99-kernel");
    for (scalar, truth) in [(Scalar::F64, checksum_f64(COUNT)), (Scalar::F32, checksum_f32(COUNT))] {
        let text = checksum_in_c(scalar, COUNT);
        let sum = |name: &str, text: &str, compiler: &str, flags: &[&str]| {
            let (source, program) = (folder.file(&format!("{name}.c")), folder.file(name));
            std::fs::write(&source, text).expect("it can be written");
            // all of the kernel is more than is used
            let unused = ["-Wno-unused-function", "-Wno-unknown-pragmas", "-o"];
            succeeds(command(compiler).args(["-std=c99"]).args(flags).args(unused).args([&program, &source]));
            let output = Command::new(&program).output().expect("it runs");
            String::from_utf8_lossy(&output.stdout).trim().parse::<u64>().expect("a checksum")
        };
        for (compiler, flags) in
            COMPILATIONS.iter().chain(&FURTHER_COMPILATIONS).filter(|(compiler, _)| is_there(compiler))
        {
            assert_eq!(sum("kernel", &text, compiler, flags), truth, "{} {compiler} {flags:?}", scalar.name());
        }
        // a last digit of a coefficient is seen
        let broken = text.replace("0.00833333333333304 ", "0.00833333333333303 ").replace("0.00833338F", "0.00833339F");
        assert!(broken != text);
        if is_there("gcc") {
            assert_ne!(sum("broken", &broken, "gcc", &["-O2"]), truth);
        }
    }
}

#[test]
fn names_from_robot_files_cannot_become_c() {
    let hostile =
        ["a*/\n#error x", "x??/", "http://\\", "\u{440}\u{443}\u{43a}\u{430} \"q\" %s", "int", "a\u{0}b\u{202e}"];
    for (k, name) in hostile.into_iter().enumerate() {
        let quoted: String = name
            .chars()
            .map(|c| match c {
                '"' | '\\' => format!("\\{c}"),
                c if c.is_control() => format!("\\u{:04X}", u32::from(c)),
                c => c.to_string(),
            })
            .collect();
        let text = ARM.replacen("name = \"arm\"", &format!("name = \"{quoted}\""), 1);
        let text =
            text.replace("\"hand\"", &format!("\"{quoted} hand\"")).replacen("\"j1\"", &format!("\"{quoted}\""), 1);
        let options = Options { functions: vec![Function::GravityForce], ..Options::default() };
        let generated =
            compile(&Source::new("arm.toml", text.as_str()), &options).unwrap_or_else(|e| panic!("{text}\n{e}"));
        let prefix = straightline_codegen::identifier::prefix(&generated.model.name);
        let joint = generated.model.joints()[0].name.replace('\0', "");
        let package = Package::of(&format!("c99-names-{k}"), generated, &prefix);
        let library = format!("{}_dynamics", prefix.to_lowercase());
        let expected: String = joint.bytes().map(|b| format!("{b}, ")).collect();
        let main = package.folder.file("main.c");
        std::fs::write(
            &main,
            format!(
                "#include \"{library}.h\"\nint main(void) {{\n    const unsigned char is[] = {{{expected}0}};\n    \
                 const char *name = {prefix}_joint_name(0);\n    if ({prefix}_joint_name(-1) || {prefix}_joint_name({prefix}_joint_count())) return 2;\n    \
                 for (unsigned i = 0; i < sizeof is; i++) if ((unsigned char)name[i] != is[i]) return 1;\n    return 0;\n}}\n"
            ),
        )
        .expect("it can be written");
        for compiler in ["gcc", "clang"].into_iter().filter(|compiler| is_there(compiler)) {
            let (object, program) = (package.object(compiler, &["-O1"]), package.folder.file("names"));
            succeeds(command(compiler).args(STRICT).args(["-o"]).args([&program, &main, &object]));
            assert_eq!(Command::new(&program).status().expect("it runs").code(), Some(0), "{name:?}");
        }
        if is_there("g++") {
            let header = package.folder.file("header.cpp");
            std::fs::write(&header, format!("#include \"{library}.hpp\"\n")).expect("it can be written");
            succeeds(command("g++").args(["-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]).arg(&header));
        }
    }
}

#[test]
fn what_c99_cannot_have_is_refused_with_a_remedy() {
    let of = |options: Options| compile(&Source::new("arm.toml", ARM), &options).unwrap_or_else(|e| panic!("{e}"));
    let base = || Options { functions: vec![Function::GravityForce], ..Options::default() };
    let refusal = |kind: &PackageKind, options: Options| (kind.refusal)(&of(options));
    let staged = options_of("[outputs]\nfunctions = [\"gravity_force\"]\nstaged = true\n", base());
    let mut fixed = Options { fixed: Some(FixedProducts::Wide), ..base() };
    fixed.scene.ranges.q = JointRanges::All(InputRange::within(2.0));
    for (options, word) in [
        (Options { generic: true, ..base() }, "`generic`"),
        (Options { fma: true, ..base() }, "`fma`"),
        (Options { lanes: Some(Lanes::Standalone), ..base() }, "`lanes`"),
        (Options { also: vec![Scalar::F32], ..base() }, "`--scalar`"),
        (staged, "`staged`"),
        (Options { self_test: true, ..base() }, "`self_test`"),
        (fixed, "`fixed`"),
    ] {
        let [_, help] = refusal(&C99_SOURCE, options.clone()).unwrap_or_else(|| panic!("{word} is not refused"));
        assert!(help.contains(word), "{help}");
        let is_of_both = ["`generic`", "`--scalar`", "`staged`", "`self_test`", "`fixed`"].contains(&word);
        assert_eq!(refusal(&C_ABI, options).is_some(), is_of_both, "{word}");
    }
    assert_eq!(refusal(&C99_SOURCE, base()), None);
    assert_eq!(refusal(&C_ABI, Options { fma: true, ..base() }), None);
}

/// The source by Clang for microcontrollers: no warning, and where there is a unit for floating point no call.
#[test]
fn clang_compiles_packages_for_microcontrollers() {
    if !is_there("clang") {
        return;
    }
    let options = Options { limits: ScheduleLimits { operations: 200 }, ..in_scalar(Scalar::F32) };
    let package = Package::new("c99-targets", &Source::new("arm.toml", ARM), &options);
    for (target, has_unit) in [
        (&["--target=thumbv7em-none-eabihf", "-mcpu=cortex-m4"][..], true),
        (&["--target=thumbv8m.main-none-eabihf", "-mcpu=cortex-m33"], true),
        (&["--target=riscv32-none-elf", "-march=rv32imafc", "-mabi=ilp32f"], true),
        (&["--target=aarch64-none-elf"], true),
        (&["--target=thumbv6m-none-eabi", "-mcpu=cortex-m0plus"], false),
        (&["--target=riscv32-none-elf", "-march=rv32imac", "-mabi=ilp32"], false),
    ] {
        for level in ["-O1", "-O3"] {
            let flags: Vec<&str> = target.iter().copied().chain(["-ffreestanding", level]).collect();
            let object = package.object("clang", &flags);
            let undefined = Command::new("nm").arg("-u").arg(&object).output().expect("nm runs");
            let undefined = String::from_utf8_lossy(&undefined.stdout).into_owned();
            // arithmetic by software, where there is no unit
            let is_arithmetic = |name: &str| name.starts_with("__") && !name.contains("mem");
            let names: Vec<&str> = undefined.lines().map(|line| line.trim_start_matches(" U ").trim()).collect();
            let own = names.iter().map(|name| name.trim_start_matches("U "));
            let others: Vec<&str> = own.filter(|name| has_unit || !is_arithmetic(name)).collect();
            assert_eq!(others, [""; 0], "{flags:?}");
        }
    }
}

/// Rules that the documentation of a package says are not kept; 2.5 and `unusedFunction` are about what is for others.
const DEVIATIONS: [&str; 2] = ["misra-c2012-19.2", "misra-c2012-2.5"];

/// What cppcheck's addon says of a source, rule by rule.
fn violations(source: &Path) -> Vec<String> {
    // what headers of a compiler define
    let defined = [
        "__STDC_VERSION__=199901L",
        "__GNUC__=12",
        "FLT_RADIX=2",
        "FLT_MANT_DIG=24",
        "FLT_MAX_EXP=128",
        "FLT_EVAL_METHOD=0",
        "DBL_MANT_DIG=53",
        "DBL_MAX_EXP=1024",
        "UINT64_C(x)=x##ULL",
        "UINT32_C(x)=x##U",
        "NULL=((void*)0)",
    ];
    let output = command("cppcheck")
        .args([
            "--addon=misra",
            "--enable=all",
            "--quiet",
            "--std=c99",
            "--suppress=missingIncludeSystem",
            "--suppress=unusedFunction",
        ])
        .args(defined.map(|d| format!("-D{d}")))
        .args(["--template={line}: {id} {message}"])
        .arg(source)
        .output()
        .expect("cppcheck runs");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    text.lines().filter(|line| line.contains(": misra")).map(str::to_string).collect()
}

#[test]
fn the_rules_that_are_claimed_are_kept() {
    if !is_there("cppcheck") {
        return;
    }
    let scene = SCENE.replace(", \"forward_dynamics\"]\ncontact", "]\ncontact").replace(", \"impact\"", "");
    let options = options_of(&scene, Options { limits: ScheduleLimits { operations: 200 }, ..Options::default() });
    let arm = Package::new("c99-misra", &Source::new("arm.toml", ARM), &options);
    let limbs = Options { limbs: LimbForm::Lanes, functions: vec![Function::BiasForce], ..in_scalar(Scalar::F32) };
    let legs = Package::new("c99-misra-limbs", &robot("hyq.urdf"), &limbs);
    let rolled = Options { limbs: LimbForm::Rolled, ..limbs };
    let rolled = Package::new("c99-misra-rolled", &robot("hyq.urdf"), &rolled);
    for package in [&arm, &legs, &rolled] {
        let found = violations(&package.source);
        assert!(found.iter().any(|line| line.contains("misra-c2012-19.2")), "the addon found nothing: {found:?}");
        let other: Vec<&String> =
            found.iter().filter(|line| !DEVIATIONS.iter().any(|rule| line.contains(rule))).collect();
        assert!(other.is_empty(), "{other:#?}");
    }
    // and the addon sees what is broken
    let text = arm.text().replacen("    return why;\n", "    if (why) return 7;\n    return why;\n", 1);
    std::fs::write(&arm.source, text).expect("it can be written");
    let found = violations(&arm.source).join("\n");
    assert!(found.contains("misra-c2012-14.4"), "{found}");
}
