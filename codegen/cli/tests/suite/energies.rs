//! Robots of every kind of joint swing freely, and keep their energy over a hundred thousand steps of the integrator.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// So many steps are taken at least.
const STEPS: f64 = 1e5;

fn reference() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../generated_tests/reference/joints/robots")
}

fn straightline(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_straightline")).args(arguments).output().expect("it runs");
    assert!(output.status.success(), "{arguments:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("a text")
}

/// The robot without friction, held by springs about its pose at zero; a base that floats does so without weight.
fn sprung(file: &Path, folder: &Path) -> String {
    let name = file.file_stem().expect("a name").to_string_lossy();
    let path = folder.join(format!("{name}.toml")).display().to_string();
    let floats = name.ends_with("_float");
    let by_option =
        if floats && file.extension().is_some_and(|end| end == "urdf") { &["--floating-base"][..] } else { &[] };
    let own = file.display().to_string();
    straightline(&[&["convert", &own, &path, "--lossy", "--quiet"], by_option].concat());
    let text = fs::read_to_string(&path).expect("it was written");
    let is_kept = |line: &&str| {
        !["damping", "friction", "spring", "base_damping", "gravity"]
            .iter()
            .any(|key| line.starts_with(&format!("{key} =")))
    };
    let block = |block: &str| {
        let mut text: String = block.lines().filter(is_kept).map(|line| format!("{line}\n")).collect();
        if block.starts_with("[robot]") {
            text += if floats { "gravity = [0, 0, 0]\n" } else { "gravity = [0, 0, -9.81]\n" };
        }
        let is_single =
            ["revolute", "continuous", "prismatic"].iter().any(|kind| block.contains(&format!("kind = \"{kind}\"")));
        if block.starts_with("[[joint]]") && is_single {
            text += "spring = { stiffness = 100 }\n";
        }
        text
    };
    let text: Vec<String> = text.split("\n\n").map(block).collect();
    fs::write(&path, text.join("\n")).expect("it can be written");
    path
}

/// What is missing of the energy at the end, of what was turned over, after so many seconds; and the steps.
fn missing(robot: &str, folder: &Path, seconds: f64) -> (f64, f64) {
    let experiment = folder.join("experiment.toml");
    let text = |velocities: &str| {
        format!("[start]\nqd = {velocities}\n[simulation]\nduration = {seconds:?}\ninterval = {:?}\ntolerance = 1e-12\nstop_at_limits = false\n", seconds / 10.0)
    };
    let path = experiment.display().to_string();
    let simulate = ["simulate", robot, "--input", &path, "--quiet", "--max-steps", "3000000"];
    // how many joints there are is in what is said of too few
    fs::write(&experiment, text("[]")).expect("it can be written");
    let refused = Command::new(env!("CARGO_BIN_EXE_straightline")).args(simulate).output().expect("it runs");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    let joints = said.split("0 numbers for ").nth(1).and_then(|rest| rest.split(' ').next()?.parse().ok());
    let joints: usize = joints.unwrap_or_else(|| panic!("{said}"));
    let velocities: Vec<f64> = (0..joints).map(|k| [0.3, -0.3][k % 2] / (1.0 + 0.3 * k as f64)).collect();
    fs::write(&experiment, text(&format!("{velocities:?}"))).expect("it can be written");
    let said = straightline(&simulate);
    let number = |before: &str, after: &str| {
        let rest = &said[..said.find(after).unwrap_or_else(|| panic!("{said}"))];
        rest[rest.rfind(before).unwrap_or_else(|| panic!("{said}")) + before.len()..]
            .trim()
            .parse::<f64>()
            .expect("a number")
    };
    (number(",", " of what was turned over").abs(), number("s,", " steps"))
}

fn keep_their_energy(is_meant: impl Fn(&str) -> bool) -> usize {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("energies");
    fs::create_dir_all(&folder).expect("a folder");
    let mut files: Vec<PathBuf> =
        fs::read_dir(reference()).expect("it is there").map(|e| e.expect("an entry").path()).collect();
    files.sort();
    files.retain(|file| is_meant(&file.file_stem().expect("a name").to_string_lossy()));
    for file in &files {
        let own = folder.join(file.file_stem().expect("a name"));
        fs::create_dir_all(&own).expect("a folder");
        let robot = sprung(file, &own);
        let few = missing(&robot, &own, 2.0).1;
        let (lost, steps) = missing(&robot, &own, 2.0 * 1.2 * STEPS / few);
        println!("{}: {lost:.1e} of what was turned over is missing after {steps} steps", file.display());
        assert!(steps >= STEPS && lost < 1e-6, "{}: {lost:e} after {steps} steps", file.display());
    }
    files.len()
}

#[test]
#[ignore = "slow proof: a hundred thousand steps of ten robots"]
fn slow_proof_that_energy_is_kept_with_joints_of_every_kind() {
    assert_eq!(keep_their_energy(|name| !name.starts_with("loop_")), 10);
}

#[test]
#[ignore = "takes minutes: a hundred thousand steps of five robots with loops"]
fn energy_is_kept_with_closed_loops() {
    assert_eq!(keep_their_energy(|name| name.starts_with("loop_")), 5);
}
