//! The model of a Cortex-M4F that chooses orders, beside what rustc makes of the text: no number of it is fitted to a program.

use crate::cross;
use std::path::Path;
use straightline_codegen::choices::{Memory, TargetMachine};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::machine_code::{machine_code, RustCompiler};
use straightline_codegen::options::Options;
use straightline_codegen::{compile, Function, Scalar};

/// The record and the errors below are of this compiler; another one gives registers in another way.
const COMPILER: &str = "rustc 1.95.0 ";

const FUNCTIONS: [Function; 9] = [
    Function::InverseDynamics,
    Function::GravityForce,
    Function::BiasForce,
    Function::MassMatrix,
    Function::ForwardDynamics,
    Function::MassMatrixAndGravityForce,
    Function::Energy,
    Function::Momentum,
    Function::InverseDynamicsDerivatives,
];

/// That compiler, if it has the machine; says so where it has not.
fn compiler() -> Option<RustCompiler> {
    let machine = TargetMachine::CORTEX_M4F;
    let text = "#![no_std]\npub fn nothing() {}\n";
    let found = RustCompiler::find(Some(&cross::rustc())).ok().filter(|rustc| rustc.version.starts_with(COMPILER));
    let found = found.filter(|rustc| machine_code(rustc, text, machine, Memory::Flash).is_ok());
    if found.is_none() {
        eprintln!("skipped: no {COMPILER}with the target {}", machine.row().triple);
    }
    found
}

/// Relative errors of instructions, bytes of flash and cycles of every function \[%\].
fn errors(name: &str, floats: bool, memory: Memory) -> Option<Vec<[f64; 3]>> {
    compiler()?;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(name);
    let robot = Source::new(name, std::fs::read_to_string(path).expect("the robot is there"));
    let mut options = Options {
        scalar: Scalar::F32,
        target: Some(TargetMachine::CORTEX_M4F),
        memory,
        figures: true,
        functions: FUNCTIONS.to_vec(),
        rustc: Some(cross::rustc()),
        ..Options::default()
    };
    options.model.angle_tolerance = 1e-10;
    options.model.floating_base = floats;
    let generated = compile(&robot, &options).unwrap_or_else(|errors| panic!("{errors}"));
    let mut found = Vec::new();
    for (function, report) in &generated.report.functions {
        let estimate = report.estimate.unwrap_or_else(|| panic!("{function} has no estimate"));
        let real = report.machine.as_ref().expect("figures were asked for");
        let instructions = real.instructions.expect("it is known");
        // cycles of filling memory are of the compiler's library
        let cycles = real.model_cycles.map_or(estimate.cycles as f64, f64::from);
        let pairs = [
            (estimate.instructions, f64::from(instructions)),
            (estimate.flash_bytes, f64::from(real.flash_bytes)),
            (estimate.cycles, cycles),
        ];
        println!(
            "{name} {memory:?} {function}: instructions {} of {instructions}, flash {} of {}, stack {} of {:?}, cycles {} of {cycles}",
            estimate.instructions, estimate.flash_bytes, real.flash_bytes, estimate.stack_bytes, real.stack_bytes, estimate.cycles
        );
        found.push(pairs.map(|(estimate, real)| 100.0 * (estimate as f64 / real - 1.0)));
    }
    Some(found)
}

/// The median and the greatest of the magnitudes of a column.
fn spread(errors: &[[f64; 3]], column: usize) -> [f64; 2] {
    let mut all: Vec<f64> = errors.iter().map(|error| error[column].abs()).collect();
    all.sort_by(f64::total_cmp);
    [all[all.len() / 2], all[all.len() - 1]]
}

/// Holds the spreads of instructions, flash and cycles to what was found, rounded up.
fn holds(robots: &[(&str, bool)], memory: Memory, most: [[f64; 2]; 3]) {
    let found: Option<Vec<_>> = robots.iter().map(|(name, floats)| errors(name, *floats, memory)).collect();
    let Some(found) = found.map(|found| found.concat()) else { return };
    for (column, (what, most)) in ["instructions", "bytes of flash", "cycles"].into_iter().zip(most).enumerate() {
        let [median, worst] = spread(&found, column);
        println!("{memory:?}, {what}: median {median:.2} %, worst {worst:.2} % of {} functions", found.len());
        assert!(median <= most[0] && worst <= most[1], "{what}: median {median:.2} %, worst {worst:.2} %");
    }
}

const ARMS: [(&str, bool); 3] = [("ur5.urdf", false), ("puma560.urdf", false), ("panda.urdf", false)];
/// Of which no order was looked at while the model was made.
const OTHERS: [(&str, bool); 2] = [("planar2r.urdf", false), ("hyq.urdf", true)];

#[test]
fn arms_from_flash_are_estimated_before_rustc() {
    holds(&ARMS, Memory::Flash, [[0.7, 3.0], [1.5, 6.5], [0.9, 4.0]]);
}

#[test]
#[ignore = "a minute of compiling"]
fn other_robots_and_code_without_delay_are_estimated_before_rustc() {
    holds(&OTHERS, Memory::Flash, [[1.5, 3.6], [2.5, 10.0], [1.5, 4.5]]);
    holds(&ARMS, Memory::Tcm, [[1.5, 4.5], [1.5, 4.5], [3.5, 6.0]]);
}

#[test]
fn a_pair_of_sine_and_cosine_takes_41_instructions_and_48_in_place_without_multiply_accumulate_and_two_take_74() {
    let Some(rustc) = compiler() else { return };
    let kernel = straightline_core::sources::SHORT_SINES.replace("#[inline]", "#[no_mangle]");
    let text = format!("#![no_std]\n{}", kernel.replace("//!", "//"));
    let instructions = |function: &str, memory: Memory| {
        let code = machine_code(&rustc, &text, TargetMachine::CORTEX_M4F, memory).unwrap_or_else(|e| panic!("{e}"));
        let figures = code.figures(&[function.to_string()], TargetMachine::CORTEX_M4F, memory);
        figures.expect("it is there")[0].instructions
    };
    assert_eq!(instructions("sin_cos_f32", Memory::Flash), Ok(41));
    // in place it has no frame: push, mov, pop
    assert_eq!(instructions("sin_cos_f32", Memory::Tcm), Ok(48 + 3));
    assert_eq!(instructions("of_two", Memory::Flash), Ok(74));
    assert_eq!(instructions("of_two_sums", Memory::Flash), Ok(77));
}
