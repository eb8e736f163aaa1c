//! Generated text where there is `core` and nothing else: no call that the compiler's runtime would have to answer.
//!
//! With `STRAIGHTLINE_THUMB=DIR` the object for a Cortex-M4 is looked at: DIR holds `rustc` and a `sysroot` with `core` for
//! thumbv7em-none-eabihf. Without it, the text alone is.

use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::compile::{compile, Options};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::{Function, Scalar};

const ARM: &str = include_str!("files/arm.toml");
const TORQUES: [Function; 2] = [Function::InverseDynamics, Function::GravityForce];

fn scratch() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bare_metal");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    folder
}

#[test]
fn sines_are_computed_one_after_the_other_where_there_are_no_vectors() {
    let kernel = include_str!("../../runtime/core/src/trig.rs");
    let of_lanes = kernel.split("const BLOCK: usize").next().expect("the text before it");
    assert!(of_lanes.trim_end().ends_with('}') && of_lanes.contains("if $lanes == 1 {"), "arrays begin with `memset`");
}

/// The symbols that an object wants from elsewhere.
fn wanted(object: &Path) -> Option<String> {
    let output = Command::new("nm").arg("-u").arg(object).output().ok()?;
    // how an error of a parameter prints is `core`'s, and called only by who prints it
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    Some(text.lines().filter(|line| !line.contains("4core3fmt")).collect())
}

#[test]
fn an_object_for_a_cortex_m4_calls_nothing() {
    let Some(directory) = std::env::var_os("STRAIGHTLINE_THUMB").map(PathBuf::from) else {
        eprintln!("skipped: STRAIGHTLINE_THUMB names no compiler for thumbv7em-none-eabihf");
        return;
    };
    let options = Options { functions: TORQUES.to_vec(), scalar: Scalar::F32, ..Options::default() };
    let text = compile(&Source::new("arm.toml", ARM), &options).unwrap_or_else(|errors| panic!("{errors}")).text;
    let (file, object) = (scratch().join("thumb.rs"), scratch().join("thumb.o"));
    // functions that are small would not be in the object
    let text = text.replace("pub fn ", "#[inline(never)]\npub fn ");
    std::fs::write(&file, format!("#![no_std]\n#![allow(warnings)]\n{text}")).expect("a file");
    for level in ["2", "3"] {
        let built = Command::new(directory.join("rustc"))
            .arg(format!("--sysroot={}", directory.join("sysroot").display()))
            .args(["--edition=2021", "--crate-type=rlib", "--crate-name=arm", "--target=thumbv7em-none-eabihf"])
            .args(["-Cpanic=abort", "-Ccodegen-units=1", "-Cembed-bitcode=no", "-Ctarget-cpu=cortex-m4"])
            .arg(format!("-Copt-level={level}"))
            .arg(format!("--emit=obj={}", object.display()))
            .arg(&file)
            .output()
            .expect("the compiler runs");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        let Some(wanted) = wanted(&object) else {
            eprintln!("skipped: there is no nm");
            return;
        };
        assert_eq!(wanted, "", "opt-level {level}");
    }
}
