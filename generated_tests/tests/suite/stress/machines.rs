//! The same program on other instruction sets of this machine, and with subnormal numbers flushed to zero.
//!
//! Both need programs of their own: an instruction set is chosen when rustc runs, and the mode of the processor is set by an
//! instruction that Rust holds undefined in the middle of floating-point code, hence in a process that does nothing else, by
//! inline assembly.

use super::outcome::{Outcome, Size};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::{compile, Function, Options, Scalar, Source};
use straightline_generated_tests::standalone::{run, Folder};

/// Robots whose fingerprints are compared.
const ROBOTS: [&str; 2] = ["panda.urdf", "chapter_oblique.toml"];
const FUNCTIONS: [Function; 3] = [Function::InverseDynamics, Function::MassMatrix, Function::ForwardDynamics];

/// The generated code of a robot, and a function that gives a fingerprint (FNV-1a) of all results' bits over random states;
/// it shows each of them to `emit`. Nothing but `core`.
fn kernel(robot: &str, scalar: Scalar, states: usize) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(robot);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    // without gravity nothing hides what becomes of small numbers
    let model = ModelOptions { gravity: Some([0.0; 3]), ..ModelOptions::default() };
    let options = Options { functions: FUNCTIONS.to_vec(), scalar, model, ..Options::default() };
    let generated = compile(&Source::new(robot, text), &options).unwrap_or_else(|d| panic!("{d}"));
    let (n, scalar) = (generated.model.nv(), scalar.name());
    format!(
        r#"mod robot {{
{}
}}
#[inline(never)]
fn fingerprint(emit: &mut dyn FnMut(u64)) -> u64 {{
    let mut seed = 1u64;
    let mut next = || {{
        seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (seed ^ (seed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as {scalar} / (1u64 << 23) as {scalar} - 1.0
    }};
    let mut print = 0xcbf2_9ce4_8422_2325u64;
    for state in 0..{states} {{
        // every other state with nothing but velocities, whose products are subnormal
        let (speed, drive): ({scalar}, {scalar}) = if state % 2 == 0 {{ (3.0, 3.0) }} else {{ ({tiny}, 0.0) }};
        let mut list = |size: {scalar}| {{ let mut x = [0.0; {n}]; x.iter_mut().for_each(|x| *x = size * next()); x }};
        let (q, qd, qdd) = (list(3.0), list(speed), list(drive));
        let (mut tau, mut h, mut x) = ([0.0; {n}], [[0.0; {n}]; {n}], [0.0; {n}]);
        robot::inverse_dynamics(&q, &qd, &qdd, &mut tau);
        robot::mass_matrix(&q, &mut h);
        robot::forward_dynamics(&q, &qd, &qdd, &mut x);
        for y in tau.iter().chain(h.iter().flatten()).chain(&x) {{
            print = (print ^ y.to_bits() as u64).wrapping_mul(0x0100_0000_01b3);
            emit(y.to_bits() as u64);
        }}
    }}
    print
}}
"#,
        generated.text,
        tiny = if scalar == "f32" { "1e-22" } else { "1e-160" },
    )
}

/// The kernel as a program that prints the fingerprint, after `values` and `flush` the results too.
fn program(robot: &str, scalar: Scalar, states: usize) -> String {
    let main = r#"
fn main() {
    let mode = std::env::args().nth(1);
    let flush = mode.as_deref() == Some("flush");
    #[cfg(target_arch = "x86_64")]
    if flush {
        let mode: u32 = 0x1f80 | 0x8040; // all exceptions masked; flush to zero, subnormals are zeros
        // nothing before this line computes with floats, and the process ends after the last
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &mode, options(nostack)) };
    }
    let half = std::hint::black_box(f64::MIN_POSITIVE) * std::hint::black_box(0.5);
    assert_eq!(half == 0.0, flush, "the mode is the one that was asked for");
    let print = fingerprint(&mut |bits| if mode.is_some() { println!("{bits:x}") });
    println!("{print:016x}");
}
"#;
    kernel(robot, scalar, states) + main
}

/// The kernel as a program for a Cortex-M4F without an operating system: it says the fingerprint by semihosting.
const BARE: &str = r##"
use core::arch::{asm, global_asm};
global_asm!(r#"
.section .vector_table,"a",%progbits
.word __stack_top
.word Reset
.word Hang
.word Hang
.word Hang
.word Hang
.word Hang
.text
.thumb_func
.global Reset
Reset:
  ldr r0, =0xE000ED88
  ldr r1, [r0]
  orr r1, r1, #(0xF << 20)
  str r1, [r0]
  dsb
  isb
  bl rust_main
  b .
.thumb_func
Hang: b .
"#);
unsafe fn host(op: u32, arg: usize) { asm!("bkpt #0xAB", inout("r0") op => _, in("r1") arg, options(nostack)); }
#[no_mangle]
pub extern "C" fn rust_main() -> ! {
    let print = fingerprint(&mut |_| ());
    for i in (0..16).rev() {
        let c = b"0123456789abcdef"[((print >> (4 * i)) & 15) as usize];
        unsafe { host(0x03, &c as *const u8 as usize) };
    }
    unsafe { host(0x18, 0x20026) };
    loop {}
}
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! { loop {} }
"##;

/// Where the sections of that program go.
const LINKER_SCRIPT: &str =
    "MEMORY { FLASH (rx): ORIGIN = 0x0, LENGTH = 4M  RAM (rwx): ORIGIN = 0x20000000, LENGTH = 4M }
__stack_top = ORIGIN(RAM) + LENGTH(RAM);
ENTRY(Reset)
SECTIONS {
 .text : { KEEP(*(.vector_table)) *(.text .text.*) *(.rodata .rodata.*) } > FLASH
 .data : { *(.data .data.*) } > RAM AT> FLASH
 .bss (NOLOAD): { *(.bss .bss.* COMMON) } > RAM
 /DISCARD/ : { *(.ARM.exidx*) *(.ARM.extab*) }
}
";

/// Fingerprints of an emulated Cortex-M4F (32-bit, hardware f32, software f64) against this machine's.
///
/// `toolchain` is a folder with a `rustc` whose `sysroot` holds `core` for thumbv7em-none-eabihf, with `rust-lld` and
/// `qemu-system-arm`.
pub fn microcontroller(toolchain: &std::path::Path) -> Vec<Outcome> {
    let folder = Folder::new("microcontroller");
    let script = folder.file("link.x");
    std::fs::write(&script, LINKER_SCRIPT).expect("the folder can be written");
    let command = |program: &std::path::Path, arguments: &[String]| {
        let output = std::process::Command::new(program).args(arguments).output();
        let output = output.unwrap_or_else(|e| panic!("{}: {e}", program.display()));
        assert!(output.status.success(), "{}: {}", program.display(), String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).trim().to_string()
    };
    let mut outcomes = Vec::new();
    for (robot, scalar) in ROBOTS.iter().flat_map(|r| [(r, Scalar::F64), (r, Scalar::F32)]) {
        let states = 50;
        let host = folder.build("host", &program(robot, scalar, states), &[]).unwrap_or_else(|e| panic!("{e}"));
        let expected = run(&host, &[]).unwrap_or_else(|e| panic!("{e}")).trim().to_string();
        let (text, binary) = (folder.file("bare.rs"), folder.file("bare"));
        let source = format!("#![no_std]\n#![no_main]\n{}{BARE}", kernel(robot, scalar, states));
        std::fs::write(&text, source).expect("the folder can be written");
        let flags = format!(
            "--edition 2021 --sysroot={0}/sysroot --target thumbv7em-none-eabihf -C linker={0}/rust-lld -C linker-flavor=ld.lld \
             -C link-arg=-T{1} -C target-cpu=cortex-m4 -C opt-level=3 -C panic=abort -o {2} {3}",
            toolchain.display(),
            script.display(),
            binary.display(),
            text.display()
        );
        let words = |line: &str| line.split_whitespace().map(str::to_string).collect::<Vec<_>>();
        command(&toolchain.join("rustc"), &words(&flags));
        let emulator = format!(
            "-M mps2-an386 -nographic -monitor none -serial none -chardev stdio,id=s0 -semihosting-config \
             enable=on,target=native,chardev=s0 -kernel {}",
            binary.display()
        );
        let said = command(&toolchain.join("qemu-system-arm"), &words(&emulator));
        let what = format!("{}: Cortex-M4F, emulated, other bits than x86-64 ({said}, {expected})", scalar.name());
        outcomes.push(Outcome::new(22, *robot, what, f64::from(u8::from(said != expected)), 0.0));
    }
    outcomes
}

/// What the processor can do, from the least on.
fn levels() -> Vec<&'static str> {
    let mut levels = vec!["x86-64"];
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            levels.push("x86-64-v3");
        }
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
            levels.push("x86-64-v4");
        }
    }
    levels
}

pub fn this_machine(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    if !cfg!(target_arch = "x86_64") {
        return vec![Outcome::new(22, "this machine", "is no x86-64: nothing to compare", 0.0, 0.0)];
    }
    let folder = Folder::new("machines");
    let robots = size.pick(&ROBOTS[1..], &ROBOTS[..]);
    for (robot, scalar) in robots.iter().flat_map(|r| [(r, Scalar::F64), (r, Scalar::F32)]) {
        let source = program(robot, scalar, size.pick(100, 20_000));
        let mut fingerprints: Vec<String> = Vec::new();
        for level in levels() {
            let flags = [format!("-Ctarget-cpu={level}")];
            let program = folder
                .build("kernel", &source, &flags.each_ref().map(String::as_str))
                .unwrap_or_else(|e| panic!("{e}"));
            fingerprints.push(run(&program, &[]).unwrap_or_else(|e| panic!("{e}")));
            if level != "x86-64" {
                continue;
            }
            let values = |mode: &str| -> Vec<f64> {
                let text = run(&program, &[mode]).unwrap_or_else(|e| panic!("{e}"));
                let mut lines: Vec<&str> = text.lines().collect();
                lines.pop();
                let bits = lines.iter().map(|line| u64::from_str_radix(line, 16).expect("hexadecimal bits"));
                bits.map(
                    |b| if scalar == Scalar::F32 { f64::from(f32::from_bits(b as u32)) } else { f64::from_bits(b) },
                )
                .collect()
            };
            // per state and function the greatest result is the scale
            let (kept, flushed) = (values("values"), values("flush"));
            let changed = kept.iter().zip(&flushed).filter(|(a, b)| a != b).count();
            let worst = kept.iter().zip(&flushed).map(|(a, b)| (a - b).abs()).fold(0.0, |m: f64, e| {
                if e.is_finite() {
                    m.max(e)
                } else {
                    f64::INFINITY
                }
            });
            let least = if scalar == Scalar::F32 { f64::from(f32::MIN_POSITIVE) } else { f64::MIN_POSITIVE };
            let what = format!("{} flushed to zero against kept ({changed} of {} results differ), greatest difference over the least normal number", scalar.name(), kept.len());
            outcomes.push(Outcome::new(13, *robot, what, worst / least, 1e7));
        }
        let others = fingerprints.iter().filter(|f| **f != fingerprints[0]).count();
        let what = format!(
            "{}: of {} other bits than x86-64 (fingerprint {})",
            scalar.name(),
            levels().join(", "),
            fingerprints[0].trim()
        );
        outcomes.push(Outcome::new(22, *robot, what, others as f64, 0.0));
    }
    outcomes
}
