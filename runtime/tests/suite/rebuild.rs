//! A package that uses the derive is built again when its robot file changes: right, wrong, and right again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const MAIN: &str = r#"
use straightline::Dynamics;

#[derive(Dynamics)]
#[robot("robot/arm.toml", functions(mass_matrix))]
struct Arm;

fn main() {
    println!("{:?}", Arm::EFFORT_LIMITS);
}
"#;

/// A package of its own that depends on this workspace by path. It stays between runs, so that its dependencies are
/// compiled once.
fn package() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let package = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rebuild");
    for directory in ["src", "robot"] {
        fs::create_dir_all(package.join(directory)).unwrap();
    }
    let manifest = format!(
        "[package]\nname = \"rebuild\"\nversion = \"0.1.0\"\nedition = \"2021\"\n\n\
         [dependencies]\nstraightline = {{ path = {here:?} }}\n\n[profile.dev]\ndebug = false\n\n[workspace]\n"
    );
    fs::write(package.join("Cargo.toml"), manifest).unwrap();
    // the versions that are here, so that nothing is fetched
    fs::copy(here.join("../Cargo.lock"), package.join("Cargo.lock")).unwrap();
    package
}

fn run(package: &Path, robot: &str) -> Output {
    run_program(package, MAIN, robot)
}

fn run_program(package: &Path, main: &str, robot: &str) -> Output {
    fs::write(package.join("src/main.rs"), main).unwrap();
    fs::write(package.join("robot/arm.toml"), robot).unwrap();
    Command::new(env!("CARGO"))
        .args(["run", "--offline", "--manifest-path"])
        .arg(package.join("Cargo.toml"))
        .env("CARGO_TARGET_DIR", package.join("target"))
        .output()
        .unwrap()
}

#[test]
#[ignore = "slow proof: cargo builds the compiler of dynamics once more, for a package of its own"]
fn a_robot_file_that_changes_is_compiled_again() {
    let package = package();
    let robot = include_str!("../../examples/arm.toml");
    let printed = |output: &Output| String::from_utf8_lossy(&output.stdout).trim().to_string();
    let said = |output: &Output| String::from_utf8_lossy(&output.stderr).to_string();

    let first = run(&package, robot);
    assert_eq!(printed(&first), "[inf, 80.0, 40.0]", "{}", said(&first));

    let wrong = run(&package, &robot.replace("mass = 2.5", "mass = -2.5"));
    assert!(!wrong.status.success());
    // the compiler's error stands at the attribute and shows the robot file's line
    for part in ["negative-mass", "robot/arm.toml:", "mass = -2.5", "--> src/main.rs:5:9"] {
        assert!(said(&wrong).contains(part), "no `{part}` in:\n{}", said(&wrong));
    }

    let stronger = run(&package, &robot.replace("effort = 80.0", "effort = 90.0"));
    assert_eq!(printed(&stronger), "[inf, 90.0, 40.0]", "{}", said(&stronger));

    // a scene in the attribute: its errors stand at the words, all in one run
    let scene = "scene(zero(qdot = true), hold(gravity = \"nought\"))";
    let main = MAIN.replace("functions(mass_matrix)", scene);
    let wrong = run_program(&package, &main, robot);
    for part in ["[zero] has no key `qdot`", "--> src/main.rs:5:38", "qd, qdd, joints_at_rest", "--> src/main.rs:5:67"]
    {
        assert!(said(&wrong).contains(part), "no `{part}` in:\n{}", said(&wrong));
    }
}
