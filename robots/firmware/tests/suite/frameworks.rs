//! The sketches for embassy and RTIC are linked for their microcontroller, and the controller is in them.

use crate::cross;
use std::path::Path;
use std::process::Command;

#[test]
#[ignore = "minutes: embassy, RTIC and the compiler of dynamics are built"]
fn sketches_for_frameworks_are_linked() {
    let Some(nm) = cross::program("arm-none-eabi-nm") else { return };
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let target = here.join("../../target/frameworks");
    for name in ["embassy", "rtic"] {
        let folder = here.join("frameworks").join(name);
        let cargo = |arguments: &[&str]| {
            let mut cargo = cross::cargo().expect("there is a toolchain");
            cargo.args(arguments).args(["--locked", "--quiet"]).current_dir(&folder).env("CARGO_TARGET_DIR", &target);
            let output = cargo.output().unwrap();
            (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
        };
        let (is_fetched, said) = cargo(&["fetch"]);
        if !is_fetched {
            assert!(!said.contains("lock file"), "{name}: its Cargo.lock is of other dependencies\n{said}");
            eprintln!("skipped: what {name} depends on cannot be fetched\n{said}");
            continue;
        }
        let (is_built, said) = cargo(&["build", "--release"]);
        assert!(is_built, "{name}\n{said}");
        let program = target.join(format!("thumbv7em-none-eabihf/release/straightline-{name}-sketch"));
        let symbols = Command::new(&nm).args(["--defined-only"]).arg(program).output().unwrap();
        let symbols = String::from_utf8(symbols.stdout).unwrap();
        for wanted in ["3arm12control_step", "short_sines", " Reset"] {
            assert!(symbols.contains(wanted), "{name}: {wanted} is not there");
        }
    }
}
