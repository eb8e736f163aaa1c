//! The object file of the firmware, optimised, asks for nothing: no panic, no `memcpy`, no allocation, no maths library.

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

#[test]
#[ignore = "slow proof: without the workspace's features the compiler of dynamics is built once more"]
fn the_control_step_needs_nothing_from_elsewhere() {
    // a name of its own on every run: cargo would take an object that it has made before as fresh, and not make it
    let object = scratch(&format!("firmware-{}.o", std::process::id()));
    let status = Command::new(env!("CARGO"))
        // the compiler of dynamics runs once here: what optimising it takes is not worth it
        .args(["--config", "profile.dev.package.straightline-codegen.opt-level=0"])
        .args(["--config", "profile.dev.package.straightline-graph.opt-level=0"])
        .args(["rustc", "--quiet", "--offline", "--lib", "--manifest-path"])
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"))
        .args(["--"].iter().chain(&FLAGS))
        .arg(format!("--emit=obj={}", object.display()))
        .status()
        .unwrap();
    assert!(status.success());
    let Some((defined, wanted)) = symbols(&object) else {
        eprintln!("skipped: there is no nm");
        return;
    };
    std::fs::remove_file(&object).unwrap();
    assert!(defined.iter().any(|s| s.contains("control_step")), "the step is not there: {defined:?}");
    assert_eq!(wanted, [""; 0], "undefined symbols");
}

#[test]
fn the_scan_sees_what_it_looks_for() {
    let (source, object) = (scratch("bad.rs"), scratch("bad.o"));
    std::fs::write(
        &source,
        "#![no_std]\n#[inline(never)]\npub fn bad(a: &[f32], i: usize) -> [f32; 400] { [a[i]; 400] }\n\
         #[inline(never)]\npub fn copy(a: &[f32; 400], b: &mut [f32; 400]) { *b = *a; }\n",
    )
    .unwrap();
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let status = Command::new(rustc)
        .args(["--crate-type=rlib", "--crate-name=bad"])
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
    for part in ["panic_bounds_check", "memcpy"] {
        assert!(wanted.iter().any(|s| s.contains(part)), "no {part} in {wanted:?}");
    }
}
