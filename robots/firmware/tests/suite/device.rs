//! Both controllers on emulated machines: what they print is what the host prints, to the bit.

use crate::cross;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::choices::{Memory, TargetMachine};

/// The machines, the memory that code is made for, and what runs the program: `run-NAME` of the toolchain.
const MACHINES: [(TargetMachine, Memory, &str); 5] = [
    (TargetMachine::CORTEX_M4F, Memory::Tcm, "mps2"),
    // multiply-accumulate, which rounds the product
    (TargetMachine::CORTEX_M4F, Memory::Flash, "mps2"),
    (TargetMachine::CORTEX_M0PLUS, Memory::Flash, "microbit"),
    (TargetMachine::RV32IMAC, Memory::Flash, "riscv32"),
    (TargetMachine::AARCH64, Memory::Flash, "aarch64"),
];

/// The program, compiled for a machine, or for this one.
fn device(target: Option<(TargetMachine, Memory)>) -> PathBuf {
    let mut cargo = cross::cargo().expect("there is a toolchain");
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    cargo.current_dir(&workspace);
    cargo.args(["build", "--quiet", "--offline", "--profile", "firmware", "-p", "straightline-firmware-device"]);
    let mut folder = std::env::var_os("CARGO_TARGET_DIR").map_or(workspace.join("target"), PathBuf::from);
    if let Some((machine, memory)) = target {
        let platform = machine.row().triple;
        cargo.args(["--target", platform]).env("RUSTFLAGS", machine.flags(memory).join(" "));
        folder.push(platform);
    }
    assert!(cargo.status().unwrap().success());
    folder.join("firmware/straightline-firmware-device")
}

fn printed(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
#[ignore = "slow proof: the firmware is built for five machines"]
fn slow_proof_machines_print_what_the_host_prints() {
    let Some(folder) = cross::program("") else { return };
    let expected = printed(&mut Command::new(device(None)));
    let lines: Vec<&str> = expected.lines().collect();
    assert!(lines.len() == 2 * 10 + 7 + 12 && lines[0].starts_with("arm "), "{expected}");
    for (machine, memory, emulator) in MACHINES {
        let program = device(Some((machine, memory)));
        let found = printed(Command::new(folder.join(format!("run-{emulator}"))).arg(program));
        assert_eq!(found, expected, "{machine:?} {memory:?}");
    }
}
