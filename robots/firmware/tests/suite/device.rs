//! Both controllers on emulated machines: what they print is what the host prints, to the bit.

use crate::cross;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The machines: platform, flags of rustc, and what runs the program, before its path.
const MACHINES: [(&str, &str, &[&str]); 5] = [
    ("thumbv7em-none-eabihf", "-C target-cpu=cortex-m4", &BOARD_M4),
    // multiply-accumulate, which rounds the product
    ("thumbv7em-none-eabihf", "-C target-cpu=cortex-m4 -C target-feature=-slowfpvmlx", &BOARD_M4),
    ("thumbv6m-none-eabi", "", &["qemu-system-arm", "-M", "microbit", "-kernel"]),
    ("riscv32imac-unknown-none-elf", "", &["qemu-riscv32"]),
    ("aarch64-unknown-none", "", &["qemu-aarch64"]),
];
const BOARD_M4: [&str; 4] = ["qemu-system-arm", "-M", "mps2-an386", "-kernel"];
/// How boards print.
const SEMIHOSTING: [&str; 9] = [
    "-nographic",
    "-monitor",
    "none",
    "-serial",
    "none",
    "-chardev",
    "stdio,id=s0",
    "-semihosting-config",
    "enable=on,target=native,chardev=s0",
];

/// The program, compiled for a platform, or for this one.
fn device(target: Option<(&str, &str)>) -> PathBuf {
    let mut cargo = cross::cargo().expect("there is a toolchain");
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    cargo.current_dir(&workspace);
    cargo.args(["build", "--quiet", "--offline", "--profile", "firmware", "-p", "straightline-firmware-device"]);
    let mut folder = std::env::var_os("CARGO_TARGET_DIR").map_or(workspace.join("target"), PathBuf::from);
    if let Some((target, flags)) = target {
        cargo.args(["--target", target]).env("RUSTFLAGS", flags);
        folder.push(target);
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
    for (target, flags, emulator) in MACHINES {
        let program = device(Some((target, flags)));
        let mut command = Command::new(folder.join(emulator[0]));
        if emulator.len() > 1 {
            command.args(SEMIHOSTING);
        }
        let found = printed(command.args(&emulator[1..]).arg(&program));
        assert_eq!(found, expected, "{target} {flags}");
    }
}
