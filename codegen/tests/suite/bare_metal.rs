//! Generated text where there is `core` and nothing else: no call that the compiler's runtime would have to answer, and a·b + c in one
//! rounding by whoever has it.
//!
//! Where `robots/firmware/toolchain` was run, objects for microcontrollers are looked at; elsewhere the text alone is.

use crate::cross;
use crate::standalone::Folder;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use straightline_codegen::choices::{Memory, TargetMachine};
use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::fused;
use straightline_codegen::model::load;
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::schedule::ScheduleLimits;
use straightline_codegen::{Function, Robot, Scalar};
use straightline_core::trig;

const ARM: &str = include_str!("../files/arm.toml");
const TORQUES: [Function; 2] = [Function::InverseDynamics, Function::GravityForce];

fn scratch() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bare_metal");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    folder
}

fn text(scene_text: &str, options: Options) -> String {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", scene_text), &mut diagnostics);
    let options = file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(options);
    compile(&Source::new("arm.toml", ARM), &options).unwrap_or_else(|errors| panic!("{errors}")).text
}

/// Texts with every kind of array that holds values on their way: between parts, in stages, of parameters and of contact modes.
fn texts() -> Vec<String> {
    let base = Options { functions: TORQUES.to_vec(), scalar: Scalar::F32, ..Options::default() };
    let parts = Options { limits: ScheduleLimits { operations: 40 }, ..base.clone() };
    let contact =
        "[[contact]]\nname = \"pen\"\nframe = \"hand\"\nobject = { origin = [0.5, 0.0, 0.2], z = [0.0, 0.0, 1.0] }\n\
                   constrained = [\"pz\"]\n[outputs]\ncontact = [\"forward_dynamics\"]\n";
    let staged = "[outputs]\nstaged = true\n[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"hand\"\n";
    vec![text("", base.clone()), text("", parts), text(staged, base.clone()), text(contact, base)]
}

#[test]
fn plain_functions_fill_no_arrays_with_zeros() {
    for text in texts() {
        let pasted = text.find("\nmod trig {").expect("all of them turn something");
        for line in text[..pasted].lines().filter(|line| !line.contains("pub const ")) {
            assert!(!line.contains("[0.0; "), "`memset` where there are no vector instructions: {line}");
        }
    }
    let kernel = include_str!("../../../runtime/core/src/trig.rs");
    let of_lanes = kernel.split("const BLOCK: usize").next().expect("the text before it");
    assert!(of_lanes.trim_end().ends_with('}') && of_lanes.contains("if $lanes == 1 {"), "one angle after the other");
}

/// What the object of a text for a machine wants from elsewhere; none where there is no `nm`.
fn wanted(text: &str, machine: TargetMachine, memory: Memory, level: &str) -> Option<Vec<String>> {
    static OBJECTS: AtomicUsize = AtomicUsize::new(0);
    let folder = Folder::new(&format!("bare-metal-{}", OBJECTS.fetch_add(1, Ordering::Relaxed)));
    // functions that are small would not be in the object
    let text = text.replace("pub fn ", "#[inline(never)]\npub fn ");
    let given = machine.flags(memory);
    let flags = [
        "--crate-type=rlib",
        "--emit=obj",
        "-Cpanic=abort",
        "-Cembed-bitcode=no",
        "--target",
        machine.row().triple,
        level,
    ];
    let flags: Vec<&str> = flags.into_iter().chain(given.iter().flat_map(|flag| flag.split(' '))).collect();
    let source = format!("#![no_std]\n#![allow(warnings)]\n{text}");
    let object = folder.build_by(&cross::rustc(), "arm", &source, &flags).unwrap_or_else(|error| panic!("{error}"));
    let Ok(output) = Command::new("nm").arg("-u").arg(object).output() else {
        eprintln!("skipped: there is no nm");
        return None;
    };
    // how an error of a parameter prints is `core`'s, and called only by who prints it
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    let names = lines.lines().filter_map(|line| line.split_whitespace().last());
    Some(names.filter(|name| !name.contains("4core3fmt")).map(str::to_string).collect())
}

#[test]
fn an_object_for_a_cortex_m4_calls_nothing() {
    if cross::program("rustc").is_none() {
        return;
    }
    let of = |text: &str, level: &str| wanted(text, TargetMachine::CORTEX_M4F, Memory::Flash, level);
    for (k, text) in texts().into_iter().enumerate() {
        for level in ["-Copt-level=2", "-Copt-level=3"] {
            let Some(wanted) = of(&text, level) else { return };
            assert_eq!(wanted, [""; 0], "text {k}, {level}");
        }
    }
    // an array of zeros is seen
    let fills = "pub fn fills(x: &mut [f32; 40], y: f32) { *x = [0.0; 40]; x[7] = y; }";
    assert_eq!(of(fills, "-Copt-level=3"), Some(vec!["__aeabi_memclr4".to_string()]));
}

/// Fails where an object of these functions calls what is not its own, but for arithmetic where there is no unit for it.
fn calls_nothing(robot: &str, (machine, memory): (TargetMachine, Memory), functions: &[Function]) {
    if cross::program("rustc").is_none() {
        return;
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(robot);
    let source = Source::new(robot, std::fs::read_to_string(path).expect("the robot is there"));
    let base = Options { scalar: Scalar::F32, target: Some(machine), memory, ..Options::default() };
    let mut options = Options { functions: functions.to_vec(), ..base };
    options.model.floating_base = robot == "hyq.urdf" || robot == "solo12.urdf";
    options.model.angle_tolerance = 1e-10;
    let text = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
    let Some(wanted) = wanted(&text, machine, memory, "-Copt-level=3") else { return };
    let is_counted = |name: &&String| machine.row().registers.is_some() || name.contains("mem");
    let others: Vec<&String> = wanted.iter().filter(is_counted).collect();
    assert_eq!(others, [""; 0], "{robot} for {machine:?}, {memory:?}");
}

/// Robots with many zeros among their results, too.
#[test]
fn objects_of_robots_for_microcontrollers_call_nothing() {
    let functions = [Function::InverseDynamics, Function::MassMatrix, Function::Jacobian, Function::ForwardDynamics];
    for robot in ["ur5.urdf", "solo12.urdf"] {
        for machine in [TargetMachine::CORTEX_M4F, TargetMachine::CORTEX_M0PLUS] {
            calls_nothing(robot, (machine, Memory::Flash), &functions);
        }
    }
}

/// Every function that a file has without being asked, and derivatives.
fn all_functions() -> Vec<Function> {
    let further = [Function::MassMatrixAndGravityForce, Function::InverseDynamicsDerivatives];
    Options::default().functions.into_iter().chain(further).collect()
}

#[test]
#[ignore = "a minute or more: orders of long functions are searched"]
fn long_proof_that_objects_of_all_functions_of_a_quadruped_call_nothing() {
    calls_nothing("solo12.urdf", (TargetMachine::CORTEX_M4F, Memory::Flash), &all_functions());
}

#[test]
#[ignore = "five minutes: orders of long functions are searched for many machines"]
fn objects_of_all_functions_for_all_microcontrollers_call_nothing() {
    let functions = all_functions();
    for robot in ["panda.urdf", "hyq.urdf", "solo12.urdf"] {
        calls_nothing(robot, (TargetMachine::CORTEX_M4F, Memory::Flash), &functions);
        for machine in
            [TargetMachine::CORTEX_M33, TargetMachine::CORTEX_M7, TargetMachine::RV32IMAFC, TargetMachine::RV32IMAC]
        {
            calls_nothing(robot, (machine, Memory::Flash), &Options::default().functions);
        }
    }
}

/// a·b + c in one rounding without an instruction for it: the exact product and sum in parts, the least of them rounded to odd
/// (Boldo and Melquiond 2008). For numbers whose parts do not underflow.
const MUL_ADD: &str = "
pub fn mul_add_f64(a: f64, b: f64, c: f64) -> f64 {
    fn two_sum(a: f64, b: f64) -> (f64, f64) {
        let s = a + b;
        let t = s - a;
        (s, (a - (s - t)) + (b - t))
    }
    fn split(a: f64) -> (f64, f64) {
        let t = 134217729.0 * a;
        let high = t - (t - a);
        (high, a - high)
    }
    let p = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    let e = al * bl - (((p - ah * bh) - al * bh) - ah * bl);
    let (th, tl) = two_sum(c, e);
    let (vh, vl) = two_sum(p, th);
    let (z, rest) = two_sum(tl, vl);
    let odd = match z.to_bits() {
        bits if rest == 0.0 || bits & 1 == 1 => z,
        bits if (rest > 0.0) == (z > 0.0) => f64::from_bits(bits + 1),
        bits => f64::from_bits(bits - 1),
    };
    vh + odd
}
";

fn rustc(arguments: &[&str], file: &Path) {
    let mut rustc = Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string()));
    let built = rustc.current_dir(scratch()).args(["--edition=2021", "-Awarnings", "-Copt-level=1"]).args(arguments);
    let built = built.arg(file).output().expect("rustc runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
}

#[test]
fn fused_text_needs_core_alone_and_has_the_fused_bits() {
    let options =
        Options { functions: vec![Function::InverseDynamics], fma: true, fma_by_caller: true, ..Options::default() };
    let source = Source::new("arm.toml", ARM);
    let text = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
    assert!(!text.contains("extern crate") && !text.contains("std::"), "{text}");

    let robot = Robot::new(load(&source, &options.model).0.expect("the arm is sound"));
    let (nq, nv) = (robot.model.nq(), robot.model.nv());
    let states: Vec<Vec<f64>> =
        (0..20).map(|s| (0..nq + 2 * nv).map(|k| ((s * 31 + k * 7) as f64 * 0.618).sin() * 2.0).collect()).collect();
    let library = scratch().join("arm_on_core.rs");
    std::fs::write(&library, format!("#![no_std]\n#![forbid(unsafe_code)]\n{MUL_ADD}\npub mod arm {{\n{text}\n}}\n"))
        .unwrap();
    rustc(&["--crate-type=rlib", "--crate-name=arm_on_core"], &library);
    let main = scratch().join("fused_main.rs");
    let program_text = format!(
        "fn main() {{\n    for x in {states:?} {{\n        let (q, qd, qdd) = (&x[..{nq}], &x[{nq}..{0}], &x[{0}..]);\n        \
         let mut tau = [0.0; {nv}];\n        arm_on_core::arm::inverse_dynamics(q.try_into().unwrap(), qd.try_into().unwrap(), \
         qdd.try_into().unwrap(), &mut tau);\n        println!(\"{{tau:?}}\");\n    }}\n}}\n",
        nq + nv
    );
    std::fs::write(&main, program_text).unwrap();
    rustc(&["--crate-name=fused_main", "--extern", "arm_on_core=libarm_on_core.rlib"], &main);
    let output = Command::new(scratch().join("fused_main")).output().expect("the program runs");
    let printed = String::from_utf8(output.stdout).expect("text");
    let program = program(&robot, &[], Function::InverseDynamics, &options);
    let sin_cos = |x| trig::sin_cos_of_sum_fused_f64(x, f64::mul_add);
    let mut differs_from_plain = false;
    for (state, line) in states.iter().zip(printed.lines()) {
        let run = (&program.graph, &program.schedule);
        assert_eq!(line, format!("{:?}", fused::evaluate(run, state, f64::mul_add, sin_cos)), "at {state:?}");
        let plain = fused::evaluate(run, state, |a, b, c| a * b + c, trig::sin_cos_of_sum_f64);
        differs_from_plain |= line != format!("{plain:?}");
    }
    assert_eq!(printed.lines().count(), states.len());
    assert!(differs_from_plain, "one rounding is not two");
}

#[test]
fn fused_text_asks_for_std_only_where_there_is_an_operating_system() {
    let options = Options { functions: TORQUES.to_vec(), fma: true, ..Options::default() };
    let text = compile(&Source::new("arm.toml", ARM), &options).unwrap_or_else(|errors| panic!("{errors}")).text;
    let before = text.split("extern crate std;").next().expect("a text before it");
    assert!(before.trim_end().ends_with("#[cfg(not(target_os = \"none\"))]"), "{before}");
    let file = scratch().join("fused_by_std.rs");
    std::fs::write(&file, format!("#![no_std]\n#![forbid(unsafe_code)]\n{text}")).unwrap();
    rustc(&["--crate-type=lib", "--emit=metadata"], &file);
}
