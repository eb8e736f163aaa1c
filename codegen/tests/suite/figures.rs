//! Figures of machine code: beside counts of an emulator, in every front's text, as budgets; and decoders on instructions written by hand.

use crate::cross;
use std::collections::BTreeMap;
use std::path::Path;
use straightline_codegen::choices::machine::InstructionSet;
use straightline_codegen::choices::{Choice, Memory, TargetMachine};
use straightline_codegen::diagnostic::{Diagnostics, Front, Source};
use straightline_codegen::emit::package::PACKAGES;
use straightline_codegen::fronts::expansion::expand;
use straightline_codegen::machine_code::{
    decoded, machine_code, CodeFlow, InstructionClass, MachineFigures, MachineInstruction, ObjectCode, ObjectError,
    RustCompiler,
};
use straightline_codegen::options::{scene_file, GivenOptions, OptionValue, Options};
use straightline_codegen::readback::check;
use straightline_codegen::{compile, Builder, Function, Generated, Lanes, Scalar};

const ARM: &str = include_str!("../files/arm.toml");
const FUNCTIONS: [Function; 4] =
    [Function::InverseDynamics, Function::GravityForce, Function::MassMatrix, Function::ForwardDynamics];

fn robot(name: &str) -> Source {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(name);
    Source::new(name, std::fs::read_to_string(path).expect("the robot is there"))
}

fn arm() -> Source {
    Source::new("arm.toml", ARM)
}

/// Whether rustc has `core` for a machine; says so where it has not.
fn has(machine: TargetMachine) -> bool {
    let triple = machine.row().triple;
    let found = RustCompiler::find(Some(&cross::rustc()))
        .and_then(|rustc| machine_code(&rustc, "#![no_std]\npub fn nothing() {}\n", machine, Memory::Flash));
    match found {
        Ok(_) => true,
        Err(ObjectError::NoTarget(_) | ObjectError::NoCompiler(..)) => {
            eprintln!("skipped: rustc has no target {triple} (rustup target add {triple})");
            false
        }
        Err(other) => panic!("{other}"),
    }
}

fn on(machine: TargetMachine) -> Options {
    Options {
        scalar: Scalar::F32,
        target: Some(machine),
        figures: true,
        functions: FUNCTIONS.to_vec(),
        rustc: Some(cross::rustc()),
        ..Options::default()
    }
}

fn generated(robot: &Source, options: &Options) -> Generated {
    compile(robot, options).unwrap_or_else(|errors| panic!("{errors}"))
}

fn with_scene(options: &Options, text: &str) -> Options {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", text), &mut diagnostics);
    file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(options.clone())
}

fn figures(generated: &Generated, function: Function) -> MachineFigures {
    let report = generated.report.function(function).expect("it was asked for");
    report.machine.clone().expect("figures were asked for")
}

/// The record of the bench of machines: per machine, memory and function the numbers of its columns.
fn recorded() -> BTreeMap<String, Vec<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/benches/machines.tsv");
    let text = std::fs::read_to_string(path).expect("the record is there");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let row = |line: &str| {
        let words: Vec<&str> = line.split('\t').collect();
        let numbers = words[3..].iter().map(|n| n.parse().expect("a number")).collect();
        (words[..3].join(" "), numbers)
    };
    lines.map(row).collect()
}

/// How far instructions are from the counts of an emulator, and the greatest part that they may be off.
///
/// On the Cortex-M4F every instruction is counted. Where sines branch, the longest path is up to 1.7 % longer than the average one; of
/// soft float averages are known, which are up to 4.8 % off.
const DEVIATIONS: [(TargetMachine, Memory, f64); 5] = [
    (TargetMachine::CORTEX_M4F, Memory::Flash, 0.0005),
    (TargetMachine::CORTEX_M4F, Memory::Tcm, 0.0005),
    (TargetMachine::RV32IMAFC, Memory::Flash, 0.017),
    (TargetMachine::CORTEX_M0PLUS, Memory::Flash, 0.048),
    (TargetMachine::RV32IMAC, Memory::Flash, 0.048),
];

fn agrees_with_the_emulator(name: &str, tolerance: f64, floats: bool) {
    let rustc = match RustCompiler::find(Some(&cross::rustc())) {
        Ok(rustc) if rustc.version.starts_with("rustc 1.95.0 ") => rustc,
        other => return eprintln!("skipped: the record is of rustc 1.95.0, this is {other:?}"),
    };
    let record = recorded();
    for (machine, memory, most) in DEVIATIONS.into_iter().filter(|(machine, ..)| has(*machine)) {
        let mut options = Options { memory, ..on(machine) };
        (options.model.angle_tolerance, options.model.floating_base) = (tolerance, floats);
        let generated = generated(&robot(&format!("{name}.urdf")), &options);
        for function in FUNCTIONS {
            let found = figures(&generated, function);
            let what = format!("{} {} {name}::{}", machine.row().name, memory.word(), function.name());
            let recorded = &record[&what];
            let instructions = f64::from(found.instructions.unwrap_or_else(|why| panic!("{what}: {why}")));
            let off = instructions / recorded[0] - 1.0;
            println!("{what}: {instructions} instructions, {} counted ({:+.2} %)", recorded[0], 100.0 * off);
            assert!(off.abs() <= most, "{what}: {instructions} instructions, {} were counted", recorded[0]);
            assert_eq!(f64::from(found.flash_bytes), recorded[1], "{what}: bytes of flash ({})", rustc.version);
            // the bench does not know the store that lowers the stack pointer
            let stack = f64::from(found.stack_bytes.expect("it is known"));
            assert!(
                recorded[2] == 0.0 || [0.0, 4.0].contains(&(stack - recorded[2])),
                "{what}: {stack} bytes of stack, {}",
                recorded[2]
            );
        }
    }
}

#[test]
fn figures_of_ur5_agree_with_the_emulator() {
    agrees_with_the_emulator("ur5", 1e-10, false);
}

#[test]
fn figures_of_puma560_agree_with_the_emulator() {
    agrees_with_the_emulator("puma560", 1e-15, false);
}

#[test]
fn figures_of_the_panda_agree_with_the_emulator() {
    agrees_with_the_emulator("panda", 1e-15, false);
}

#[test]
#[ignore = "a minute of compiling"]
fn figures_of_solo12_agree_with_the_emulator() {
    agrees_with_the_emulator("solo12", 1e-15, true);
}

#[test]
fn constants_say_what_the_report_says_and_nothing_else_of_the_text_changes() {
    if !has(TargetMachine::CORTEX_M4F) {
        return;
    }
    let with = generated(&arm(), &on(TargetMachine::CORTEX_M4F));
    let without = generated(&arm(), &Options { figures: false, ..on(TargetMachine::CORTEX_M4F) });
    let found = figures(&with, Function::InverseDynamics);
    let constant = format!(
        "pub const INVERSE_DYNAMICS_FIGURES: Figures = Figures {{ instructions: Some({}), flash_bytes: {}, shared_flash_bytes: {}, \
         stack_bytes: Some({}), model_cycles: Some({}) }};\n",
        found.instructions.expect("it is known"),
        found.flash_bytes,
        found.shared_flash_bytes,
        found.stack_bytes.expect("it is known"),
        found.model_cycles.expect("a model is there"),
    );
    assert!(with.text.contains(&constant), "{constant}\n{}", with.text);
    let doc = "/// What [`inverse_dynamics`] takes on cortex-m4f, code in flash, compiled by rustc ";
    assert!(with.text.contains(doc), "{}", with.text);
    // from the first function on the text is the same
    let code =
        |text: &str| text.split_once("pub fn inverse_dynamics").map(|(_, code)| code.to_string()).expect("functions");
    assert_eq!(code(&with.text), code(&without.text));
    assert!(!without.text.contains("FIGURES") && !without.text.contains("Figures"));
    assert_eq!(check(&with), Ok(()));
    // another number is found by the reader
    let doctored = constant.replace("flash_bytes: ", "flash_bytes: 1");
    let wrong = Generated { text: with.text.replace(&constant, &doctored), ..with.clone() };
    assert!(check(&wrong).is_err());
    // and so is a type with another field
    let wrong = Generated { text: with.text.replace("pub flash_bytes: u32", "pub flash_bytes: u64"), ..with.clone() };
    assert!(check(&wrong).is_err());
    // packages are not what was measured
    assert!(PACKAGES.iter().all(|package| (package.refusal)(&with).is_some()));
    let mut for_machines = PACKAGES.iter().filter(|package| package.is_c);
    assert!(for_machines.all(|package| (package.refusal)(&without).is_none()));
}

#[test]
fn every_kind_of_text_is_measured() {
    if !has(TargetMachine::CORTEX_M4F) {
        return;
    }
    let base = on(TargetMachine::CORTEX_M4F);
    let mut parts = base.clone();
    parts.limits.operations = 100;
    let cases = [
        Options { memory: Memory::Tcm, ..base.clone() },
        Options { also: vec![Scalar::F64], ..base.clone() },
        Options { lanes: Some(Lanes::Standalone), ..base.clone() },
        Options { self_test: true, ..base.clone() },
        parts.clone(),
        with_scene(
            &base,
            "[[parameter]]\nkind = \"payload\"\nname = \"figures\"\nframe = \"hand\"\n[outputs]\nstaged = true\n",
        ),
        with_scene(&base, "[hold]\njoints = { roll = 0.5 }\n"),
        Options { functions: Function::all().collect(), ..base.clone() },
    ];
    for options in cases {
        let generated = generated(&arm(), &options);
        let found = generated.report.functions.values().filter_map(|f| f.machine.as_ref());
        assert_eq!(found.clone().count(), generated.report.functions.len());
        assert!(
            found.clone().all(|f| f.flash_bytes > 4 && f.stack_bytes.is_ok()),
            "{found:?}",
            found = found.collect::<Vec<_>>()
        );
        for other in &generated.others {
            // operations of f64 are by the library, of which no averages are known
            let of_f64 = figures(other, Function::InverseDynamics);
            assert!(of_f64.instructions.is_err_and(|why| why.contains("library")));
            assert!(generated
                .text
                .contains("/// Nothing is said of instructions: it calls functions of the compiler's library"));
        }
    }
    // parts are of the function, and take stack while they are called
    let whole = figures(&generated(&arm(), &base), Function::InverseDynamics);
    let in_parts = figures(&generated(&arm(), &parts), Function::InverseDynamics);
    assert!(in_parts.flash_bytes >= whole.flash_bytes && in_parts.instructions.is_ok(), "{whole:?} {in_parts:?}");
}

#[test]
fn macros_and_build_scripts_have_the_same_constants() {
    if !has(TargetMachine::CORTEX_M4F) {
        return;
    }
    // these take what the environment names
    std::env::set_var("RUSTC", cross::rustc());
    let here = std::env::temp_dir().join(format!("straightline-fronts-of-figures-{}", std::process::id()));
    std::fs::create_dir_all(&here).expect("a folder");
    std::fs::write(here.join("arm.toml"), ARM).expect("a file");
    let text = generated(&arm(), &on(TargetMachine::CORTEX_M4F)).text;
    let constant = text.lines().find(|line| line.starts_with("pub const MASS_MATRIX_FIGURES")).expect("it is there");
    let builder = |figures: bool| {
        let builder = Builder::new("arm.toml").functions(FUNCTIONS).scalar(Scalar::F32).figures(figures);
        builder.target(TargetMachine::CORTEX_M4F).run(&here, &here).result.expect("it is sound").text
    };
    assert_eq!(builder(true), text);
    assert!(!builder(false).contains("Figures"));
    let mut options = GivenOptions::default();
    let words = |word: &str| OptionValue::of_words([word.to_string()]);
    for (name, value) in
        [("scalar", words("f32")), ("target", words("cortex-m4f")), ("figures", OptionValue::Flag(true))]
    {
        options.set(name, value, Front::Derive).expect("an option");
    }
    let (module, items) = expand("arm.toml", None, &[&here], &options).result.expect("it is sound");
    assert!(module.text.contains(constant), "{}", module.text);
    let associated = "pub const MASS_MATRIX_FIGURES: dynamics::Figures = dynamics::MASS_MATRIX_FIGURES;";
    assert!(
        items.contains(associated) && items.contains("/// What [`Self::mass_matrix`] takes on cortex-m4f"),
        "{items}"
    );
    std::fs::remove_dir_all(&here).expect("the folder can be removed");
}

#[test]
fn machines_whose_code_is_not_read_say_flash_alone() {
    let machine = TargetMachine::X86_64_V3;
    if !has(machine) {
        return;
    }
    let found = figures(&generated(&arm(), &on(machine)), Function::InverseDynamics);
    assert!(found.flash_bytes > 100 && found.instructions.is_err() && found.stack_bytes.is_err());
    // and the budget of the stack stays one of values, which is looked at
    let scene = |most: usize| {
        with_scene(
            &Options { figures: false, ..on(machine) },
            &format!("[budget.inverse_dynamics]\nmax_stack_bytes = {most}\n"),
        )
    };
    assert!(compile(&arm(), &scene(1_000_000)).is_ok() && compile(&arm(), &scene(8)).is_err());
}

#[test]
fn a_budget_holds_at_the_measured_figure_and_fails_one_below() {
    if !has(TargetMachine::CORTEX_M4F) {
        return;
    }
    let plain = Options { functions: vec![Function::InverseDynamics], ..on(TargetMachine::CORTEX_M4F) };
    let found = figures(&generated(&arm(), &plain), Function::InverseDynamics);
    let options = Options { figures: false, ..plain };
    for (key, takes) in [
        ("max_instructions", found.instructions.expect("it is known")),
        ("max_flash_bytes", found.flash_bytes),
        ("max_stack_bytes", found.stack_bytes.expect("it is known")),
    ] {
        let budget = |most: u32| with_scene(&options, &format!("[budget.inverse_dynamics]\n{key} = {most}\n"));
        let held = generated(&arm(), &budget(takes));
        assert!(!held.text.contains("FIGURES"), "constants are asked for by `figures`");
        let errors = compile(&arm(), &budget(takes - 1)).expect_err("one below what it takes");
        let text = errors.render();
        let place = format!("scene.toml:2:{}", key.len() + 4);
        assert!(text.contains(&place) && text.contains(&format!(" {takes} ")), "{place}\n{text}");
        let saves = text.split_once("what would save most: ").unwrap_or_else(|| panic!("{text}")).1;
        let (what, number) = saves.split_once(" (−").expect("what, and how much");
        let saved: u32 = number.split_once(')').expect("a number").0.parse().expect("a number");
        // the first advice is worth what it says
        let advice = match what.strip_prefix("joint ").and_then(|rest| rest.strip_suffix(" locked")) {
            Some(joint) => format!("[hold]\njoints = {{ {joint} = 0.0 }}\n"),
            None if what == "q̇ = 0" => "[zero]\nqd = true\n".to_string(),
            None if what == "no gravity" => "[hold]\ngravity = [0.0, 0.0, 0.0]\n".to_string(),
            None => "[zero]\nqdd = true\n".to_string(),
        };
        let follows = |most: u32| with_scene(&options, &format!("{advice}[budget.inverse_dynamics]\n{key} = {most}\n"));
        assert!(compile(&arm(), &follows(takes - saved)).is_ok(), "{key}: {text}");
        assert!(compile(&arm(), &follows(takes - saved - 1)).is_err(), "{key}: {text}");
    }
}

#[test]
fn without_rustc_or_its_target_there_is_a_remedy_and_no_folder_is_left() {
    let mut options = on(TargetMachine::CORTEX_M4F);
    options.rustc = Some("/nowhere/rustc".into());
    let text = compile(&arm(), &options).expect_err("no compiler").render();
    assert!(text.contains("error[no-machine-code]") && text.contains("`/nowhere/rustc` cannot be run"), "{text}");
    // a program that is no compiler
    options.rustc = Some("true".into());
    let text = compile(&arm(), &options).expect_err("no compiler").render();
    assert!(text.contains("`true` cannot be run: `--version` says"), "{text}");
    let error = ObjectError::NoTarget("thumbv7em-none-eabihf");
    assert_eq!(error.remedy(), "rustup target add thumbv7em-none-eabihf");
    let Ok(rustc) = RustCompiler::find(Some(&cross::rustc())) else { return eprintln!("skipped: there is no rustc") };
    let wrong = machine_code(&rustc, "no Rust", TargetMachine::X86_64_V3, Memory::Flash);
    assert!(matches!(wrong, Err(ObjectError::Refused(_) | ObjectError::NoTarget(_))), "{wrong:?}");
    let own = format!("straightline-figures-{}-", std::process::id());
    let left = std::fs::read_dir(std::env::temp_dir()).expect("there is one").flatten();
    // other tests of this process may be compiling
    let name = format!("{own}0");
    let left: Vec<_> = left.filter(|entry| *entry.file_name() == *name).collect();
    assert!(left.len() <= 1, "{left:?}");
}

#[test]
fn what_is_no_object_is_refused() {
    assert!(ObjectCode::read(b"", None).is_err());
    assert!(ObjectCode::read(b"\x7fELF and nothing else", Some(InstructionSet::Thumb)).is_err());
    let rustc = RustCompiler::find(Some(&cross::rustc()));
    let Ok(rustc) = rustc else { return eprintln!("skipped: there is no rustc") };
    if has(TargetMachine::X86_64_V3) {
        let text = "#![no_std]\n#[no_mangle]\npub fn twice(x: u32) -> u32 { 2 * x }\n";
        let code = machine_code(&rustc, text, TargetMachine::X86_64_V3, Memory::Flash).expect("it compiles");
        let of = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
            code.figures(&names, TargetMachine::X86_64_V3, Memory::Flash)
        };
        assert!(of(&["twice"]).is_some() && of(&["twice", "thrice"]).is_none());
    }
}

#[test]
fn a_loop_has_no_number_of_instructions_and_a_branch_counts_its_longer_side() {
    let Ok(rustc) = RustCompiler::find(Some(&cross::rustc())) else { return eprintln!("skipped: there is no rustc") };
    let of = |machine: TargetMachine, text: &str| {
        let text = format!("#![no_std]\n#[no_mangle]\n{text}");
        let code = machine_code(&rustc, &text, machine, Memory::Flash).unwrap_or_else(|e| panic!("{e}"));
        code.figures(&["f".to_string()], machine, Memory::Flash).expect("it is there").remove(0)
    };
    for machine in
        [TargetMachine::CORTEX_M4F, TargetMachine::RV32IMAFC, TargetMachine::CORTEX_M0PLUS, TargetMachine::AARCH64]
    {
        if !has(machine) {
            continue;
        }
        let looped = of(machine, "pub fn f(x: &mut [u32; 40]) { let mut k = 1; while k < 40 { x[k] = x[k - 1].wrapping_mul(x[k] + 1); k += 1; if x[k - 1] == 7 { return; } } }\n");
        assert_eq!(looped.instructions, Err("it has a loop"), "{machine:?}");
        let long = of(machine, "pub fn f(x: u32, y: &mut u32) { if x == 3 { for k in 1..20 { unsafe { core::ptr::write_volatile(y, k) } } } }\n");
        let count = long.instructions.expect("no loop is left");
        assert!((20..60).contains(&count), "{machine:?}: {count}");
        let indirect = of(machine, "pub fn f(x: fn()) { x(); x() }\n");
        assert_eq!(indirect.instructions, Err("it jumps to where a register says"), "{machine:?}");
        let frame = of(machine, "pub fn f(x: fn(&mut [u32; 300])) { let mut y = [1; 300]; x(&mut y) }\n");
        let stack = frame.stack_bytes.expect("frames are known");
        assert!((1200..1300).contains(&stack), "{machine:?}: {stack}");
        let large = of(machine, "pub fn f(x: fn(&mut [u32; 3000])) { let mut y = [1; 3000]; x(&mut y) }\n");
        let stack = large.stack_bytes.expect("large frames are known");
        assert!((12000..12100).contains(&stack), "{machine:?}: {stack}");
    }
}

fn thumb(halves: &[u16]) -> Vec<MachineInstruction> {
    let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
    decoded(InstructionSet::Thumb, &bytes, &|_| false)
}

#[test]
fn thumb_instructions_are_what_the_manual_says() {
    use InstructionClass::{Division, Float, MultiplyAccumulate, Plain, SquareRoot, Transfer};
    // by `arm-none-eabi-as`: halves, class, bytes of stack
    let cases: [(&[u16], InstructionClass, u32); 22] = [
        (&[0xb5f0], Transfer(5), 20),               // push {r4-r7, lr}
        (&[0xb430], Transfer(2), 8),                // push {r4, r5}
        (&[0xb08a], Plain, 40),                     // sub sp, #40
        (&[0xb00a], Plain, 0),                      // add sp, #40
        (&[0xe92d, 0x4ff0], Transfer(9), 36),       // push.w {r4-r11, lr}
        (&[0xf84d, 0x8d04], Transfer(1), 4),        // str.w r8, [sp, #-4]!
        (&[0xed2d, 0x8b10], Transfer(16), 64),      // vpush {d8-d15}
        (&[0xed2d, 0x8a01], Transfer(1), 4),        // vpush {s16}
        (&[0xecbd, 0x8b10], Transfer(16), 0),       // vpop {d8-d15}
        (&[0xf5ad, 0x7d00], Plain, 512),            // sub.w sp, sp, #512
        (&[0xf2ad, 0x5d14], Plain, 1300),           // subw sp, sp, #1300
        (&[0xed90, 0x8a01], Transfer(1), 0),        // vldr s16, [r0, #4]
        (&[0xed90, 0x8b02], Transfer(2), 0),        // vldr d8, [r0, #8]
        (&[0xec90, 0x0a04], Transfer(4), 0),        // vldmia r0, {s0-s3}
        (&[0xee00, 0x2a01], MultiplyAccumulate, 0), // vmla.f32 s4, s0, s2
        (&[0xee51, 0x0a02], MultiplyAccumulate, 0), // vnmls.f32 s1, s2, s4
        (&[0xeea0, 0x2a01], MultiplyAccumulate, 0), // vfma.f32 s4, s0, s2
        (&[0xee20, 0x1a00], Float, 0),              // vmul.f32 s2, s0, s0
        (&[0xee32, 0x1a01], Float, 0),              // vadd.f32 s2, s4, s2
        (&[0xee80, 0x0a01], Division, 0),           // vdiv.f32 s0, s0, s2
        (&[0xeeb1, 0x0ac0], SquareRoot, 0),         // vsqrt.f32 s0, s0
        (&[0xeeb1, 0x1a40], Float, 0),              // vneg.f32 s2, s0
    ];
    for (halves, class, stack) in cases {
        let found = thumb(halves);
        assert_eq!(found.len(), 1, "{halves:04x?}");
        assert_eq!((found[0].class, found[0].sets_aside), (class, Some(stack)), "{halves:04x?}");
        assert_eq!(found[0].flow, CodeFlow::Next, "{halves:04x?}");
    }
    let flow = |halves: &[u16]| thumb(halves)[0].flow;
    assert_eq!(flow(&[0xbd80]), CodeFlow::Return); // pop {r7, pc}
    assert_eq!(flow(&[0xe8bd, 0x8ff0]), CodeFlow::Return); // pop.w {r4-r11, pc}
    assert_eq!(flow(&[0x4770]), CodeFlow::Return); // bx lr
    assert_eq!(flow(&[0x4718]), CodeFlow::Indirect); // bx r3
    assert_eq!(flow(&[0xf7ff, 0xfffe]), CodeFlow::Call); // bl
    assert_eq!(flow(&[0xd001]), CodeFlow::Branch(6)); // beq
    assert_eq!(flow(&[0xe7fe]), CodeFlow::Jump(0)); // b .
    assert_eq!(flow(&[0xb108]), CodeFlow::Branch(6)); // cbz r0
    assert_eq!(flow(&[0xf000, 0xb801]), CodeFlow::Jump(6)); // b.w
    assert_eq!(flow(&[0xf000, 0x8001]), CodeFlow::Branch(6)); // beq.w
    assert_eq!(flow(&[0xe8df, 0xf000]), CodeFlow::Indirect); // tbb [pc, r0]
                                                             // it eq; bxeq lr: to the end, or on
    assert_eq!(thumb(&[0xbf08, 0x4770, 0x2000])[1].flow, CodeFlow::Branch(6));
    // a frame that no instruction holds: ldr r7, [pc, #0]; add sp, r7; its constant is no instruction
    let bytes = [0x00, 0x4f, 0xbd, 0x44, 0x70, 0x47, 0, 0];
    let bytes = [&bytes[..4], &(-2000i32).to_le_bytes()].concat();
    let found = decoded(InstructionSet::Thumb, &bytes, &|at| at >= 4);
    assert_eq!(found.iter().map(|i| i.sets_aside).collect::<Vec<_>>(), [Some(0), Some(2000)]);
    // movw r4, #0x2ee0; sub.w sp, sp, r4; and from a register that nobody knows
    assert_eq!(thumb(&[0xf642, 0x64e0, 0xebad, 0x0d04])[1].sets_aside, Some(12000));
    assert_eq!(thumb(&[0xebad, 0x0d04])[0].sets_aside, None);
    assert_eq!(thumb(&[0x46a5])[0].sets_aside, None); // mov sp, r4
}

#[test]
fn riscv_and_arm64_instructions_are_what_their_manuals_say() {
    use InstructionClass::{Division, Float, MultiplyAccumulate, SquareRoot, Transfer};
    let riscv = |words: &[u32]| {
        let halves = words.iter().flat_map(|w| match w & 3 {
            3 => vec![*w as u16, (*w >> 16) as u16],
            _ => vec![*w as u16],
        });
        let bytes: Vec<u8> = halves.flat_map(u16::to_le_bytes).collect();
        decoded(InstructionSet::RiscV, &bytes, &|_| false)
    };
    let stack = |words: &[u32]| riscv(words).last().expect("one").sets_aside;
    assert_eq!(stack(&[0xf801_0113]), Some(128)); // addi sp, sp, -128
    assert_eq!(stack(&[0x0801_0113]), Some(0)); // addi sp, sp, 128
    assert_eq!(stack(&[0x7139]), Some(64)); // c.addi16sp sp, -64
    assert_eq!(stack(&[0x6121]), Some(0)); // c.addi16sp sp, 64
    assert_eq!(stack(&[0x1161]), Some(8)); // c.addi sp, -8
    assert_eq!(stack(&[0x650d, 0x40a1_0133]), Some(0x3000)); // c.lui a0, 3; sub sp, sp, a0
    assert_eq!(stack(&[0x40a1_0133]), None);
    let classes: Vec<InstructionClass> =
        riscv(&[0x1005_7553, 0x1805_7553, 0x5805_7553, 0x58c5_f543, 0x0005_2503, 0xc602])
            .iter()
            .map(|i| i.class)
            .collect();
    // fmul.s, fdiv.s, fsqrt.s, fmadd.s, lw, c.swsp
    assert_eq!(classes, [Float, Division, SquareRoot, MultiplyAccumulate, Transfer(1), Transfer(1)]);
    let flow = |word: u32| riscv(&[word])[0].flow;
    assert_eq!(flow(0x8082), CodeFlow::Return); // ret
    assert_eq!(flow(0x0000_8067), CodeFlow::Return);
    assert_eq!(flow(0x9502), CodeFlow::Indirect); // c.jalr a0
    assert_eq!(flow(0x0005_0463), CodeFlow::Branch(8)); // beq a0, zero, 8
    assert_eq!(flow(0xfe05_0ee3), CodeFlow::Branch(-4)); // beq a0, zero, -4
    assert_eq!(flow(0xc501), CodeFlow::Branch(8)); // c.beqz a0, 8
    assert_eq!(flow(0xa021), CodeFlow::Jump(8)); // c.j 8
    assert_eq!(flow(0x0080_006f), CodeFlow::Jump(8)); // j 8
    let arm64 = |word: u32| decoded(InstructionSet::Arm64, &word.to_le_bytes(), &|_| false)[0];
    assert_eq!(arm64(0xd101_03ff).sets_aside, Some(64)); // sub sp, sp, #64
    assert_eq!(arm64(0xd140_07ff).sets_aside, Some(4096)); // sub sp, sp, #1, lsl #12
    assert_eq!(arm64(0x9101_03ff).sets_aside, Some(0)); // add sp, sp, #64
    assert_eq!(arm64(0xa9bf_7bfd).sets_aside, Some(16)); // stp x29, x30, [sp, #-16]!
    assert_eq!(arm64(0x6dbc_3bef).sets_aside, Some(64)); // stp d15, d14, [sp, #-64]!
    assert_eq!(arm64(0xf81f_0ffe).sets_aside, Some(16)); // str x30, [sp, #-16]!
    assert_eq!(arm64(0xd65f_03c0).flow, CodeFlow::Return);
    assert_eq!(arm64(0x9400_0002).flow, CodeFlow::Call);
    assert_eq!(arm64(0x1400_0002).flow, CodeFlow::Jump(8));
    assert_eq!(arm64(0x5400_0041).flow, CodeFlow::Branch(8));
    assert_eq!(arm64(0xd63f_0000).flow, CodeFlow::Indirect);
}
