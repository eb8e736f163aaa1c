//! The object file of the firmware, optimised, asks for nothing: no panic, no `memcpy`, no allocation, no maths library.

use crate::cross;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Rust's choice of code generation for firmware.
const FLAGS: [&str; 7] = [
    "-Copt-level=3",
    "-Cpanic=abort",
    "-Ccodegen-units=1",
    "-Cdebuginfo=0",
    "-Cdebug-assertions=off",
    "-Coverflow-checks=off",
    "-Cembed-bitcode=no",
];

/// Symbols that an object file defines and those that it wants from elsewhere; `None` where there is no `nm`.
fn symbols(object: &Path) -> Option<(Vec<String>, Vec<String>)> {
    let output = Command::new("nm").arg(object).output().ok()?;
    assert!(output.status.success(), "nm: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let (wanted, defined): (Vec<_>, Vec<_>) = text
        .lines()
        .filter_map(|line| {
            let mut words = line.split_whitespace().rev();
            Some((words.next()?.to_string(), words.next()? == "U"))
        })
        .partition(|(_, wanted)| *wanted);
    let names = |list: Vec<(String, bool)>| list.into_iter().map(|(name, _)| name).collect();
    Some((names(defined), names(wanted)))
}

fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// The platforms whose objects are asked, and the compiler for each: this one, and the microcontrollers with a floating-point unit.
const MICROCONTROLLERS: [&str; 3] =
    ["thumbv7em-none-eabihf", "thumbv8m.main-none-eabihf", "riscv32imafc-unknown-none-elf"];

/// The object file of the firmware for a platform.
fn firmware(target: Option<&str>) -> PathBuf {
    // a name of its own on every run: cargo would take an object that it has made before as fresh, and not make it
    let object = scratch(&format!("firmware-{}-{}.o", target.unwrap_or("host"), std::process::id()));
    let mut cargo = match target {
        None => Command::new(env!("CARGO")),
        Some(_) => cross::cargo().expect("there is a toolchain"),
    };
    cargo
        .args(["rustc", "--quiet", "--offline", "--profile", "firmware", "--lib", "--manifest-path"])
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"));
    if let Some(target) = target {
        cargo.args(["--target", target]);
    }
    cargo.args(["--", "-Cembed-bitcode=no"]).arg(format!("--emit=obj={}", object.display()));
    assert!(cargo.status().unwrap().success());
    object
}

fn asks_for_nothing(target: Option<&str>) {
    let object = firmware(target);
    let Some((defined, wanted)) = symbols(&object) else {
        eprintln!("skipped: there is no nm");
        return;
    };
    std::fs::remove_file(&object).unwrap();
    for step in ["3arm12control_step", "3leg12control_step"] {
        assert!(defined.iter().any(|s| s.contains(step)), "{step} is not there: {defined:?}");
    }
    assert_eq!(wanted, [""; 0], "undefined symbols, {target:?}");
}

#[test]
#[ignore = "slow proof: without the workspace's features the compiler of dynamics is built once more"]
fn slow_proof_control_steps_need_nothing_from_elsewhere() {
    asks_for_nothing(None);
}

/// Neither a panic nor an operation by software: each would be a call of something that is not there.
#[test]
#[ignore = "slow proof: the firmware is built for three machines"]
fn slow_proof_control_steps_need_nothing_from_elsewhere_on_microcontrollers() {
    if cross::cargo().is_none() {
        return;
    }
    MICROCONTROLLERS.iter().for_each(|target| asks_for_nothing(Some(target)));
}

#[test]
fn the_scan_sees_what_it_looks_for() {
    sees_what_it_looks_for("bad", std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()), None);
}

#[test]
fn the_scan_sees_what_it_looks_for_on_a_microcontroller() {
    if let Some(rustc) = cross::program("rustc") {
        sees_what_it_looks_for("bad_m4", rustc.into(), Some("thumbv7em-none-eabihf"));
    }
}

fn sees_what_it_looks_for(name: &str, rustc: std::ffi::OsString, target: Option<&str>) {
    let (source, object) = (scratch(&format!("{name}.rs")), scratch(&format!("{name}.o")));
    std::fs::write(
        &source,
        "#![no_std]\n#[inline(never)]\npub fn bad(a: &[f32], i: usize) -> [f32; 400] { [a[i]; 400] }\n\
         #[inline(never)]\npub fn copy(a: &[f32; 400], b: &mut [f32; 400]) { *b = *a; }\n\
         #[inline(never)]\npub fn wide(a: &f64, b: &mut f64) { *b = *b * *a; }\n",
    )
    .unwrap();
    let mut rustc = Command::new(rustc);
    if let Some(target) = target {
        rustc.args(["--target", target]);
    }
    let status = rustc
        // a name of its own: rustc writes more than the object, and tests run side by side
        .args(["--crate-type=rlib", "--crate-name"])
        .arg(name)
        .arg(format!("--out-dir={}", scratch("").display()))
        .args(FLAGS)
        .arg(format!("--emit=obj={}", object.display()))
        .arg(&source)
        .status()
        .unwrap();
    assert!(status.success());
    let Some((_, wanted)) = symbols(&object) else {
        eprintln!("skipped: there is no nm");
        return;
    };
    let of_target: &[&str] = if target.is_some() {
        &["panic_bounds_check", "__aeabi_memcpy", "__aeabi_dmul"]
    } else {
        &["panic_bounds_check", "memcpy"]
    };
    for part in of_target {
        assert!(wanted.iter().any(|s| s.contains(part)), "no {part} in {wanted:?}");
    }
}
