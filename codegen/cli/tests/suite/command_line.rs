//! The command's contract: what it prints where, and with which code it ends.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ARM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../runtime/examples/arm.toml");

struct Run {
    code: i32,
    out: String,
    err: String,
}

fn straightline(arguments: &[&str]) -> Run {
    let output = Command::new(env!("CARGO_BIN_EXE_straightline")).args(arguments).output().unwrap();
    Run {
        code: output.status.code().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("command_line").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn names(path: &Path) -> Vec<String> {
    fs::read_dir(path).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn check_tells_a_fresh_file_from_a_stale_one() {
    let directory = scratch("check");
    let file = directory.join("arm.rs");
    let file = file.to_str().unwrap();
    let generate = ["generate", ARM, "-o", file];
    let check = ["generate", ARM, "-o", file, "--check"];

    let missing = straightline(&check);
    assert_eq!((missing.code, missing.out.as_str()), (1, ""));
    assert!(missing.err.contains("does not exist"), "{}", missing.err);
    assert_eq!(straightline(&generate).code, 0);
    assert_eq!(straightline(&check).code, 0);
    assert_eq!(fs::read_to_string(file).unwrap(), straightline(&["generate", ARM]).out);

    fs::write(file, "// edited").unwrap();
    let stale = straightline(&check);
    assert_eq!(stale.code, 1);
    assert!(stale.err.contains("is stale") && stale.err.contains("help: run the same command"), "{}", stale.err);
    assert_eq!(fs::read_to_string(file).unwrap(), "// edited");
    assert_eq!(names(&directory), ["arm.rs"]);
}

#[test]
fn figures_without_a_compiler_or_a_machine_end_with_1_and_say_what_to_do() {
    let arguments = ["generate", ARM, "--scalar", "f32", "--target", "cortex-m4f", "--figures"];
    let output =
        Command::new(env!("CARGO_BIN_EXE_straightline")).args(arguments).env("RUSTC", "/nowhere/rustc").output();
    let output = output.unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{said}");
    assert!(said.contains("error[no-machine-code]") && said.contains("`/nowhere/rustc` cannot be run"), "{said}");
    assert!(said.contains("help: install rustc, or name it by the environment variable RUSTC"), "{said}");
    let without = straightline(&["generate", ARM, "--figures"]);
    assert_eq!((without.code, without.out.as_str()), (1, ""));
    assert!(without.err.contains("error[target-missing]: `figures` is read off machine code"), "{}", without.err);
}

#[test]
fn a_wrong_robot_file_ends_with_1_and_writes_nothing() {
    let directory = scratch("wrong");
    let robot = directory.join("arm.toml");
    fs::write(&robot, fs::read_to_string(ARM).unwrap().replace("mass = 2.5", "mass = -2.5")).unwrap();
    let (robot, output) = (robot.to_str().unwrap(), directory.join("arm"));
    let output = output.to_str().unwrap();
    for arguments in [
        &["generate", robot, "-o", output][..],
        &["export", robot, "-o", output, "--c-abi"],
        &["report", robot],
        &["verify", robot],
        &["check", robot],
    ] {
        let run = straightline(arguments);
        assert_eq!(run.code, 1, "{arguments:?}");
        assert!(run.err.contains("error[negative-mass]") && run.err.contains("| mass = -2.5"), "{}", run.err);
        assert!(!run.err.contains('\x1b'), "no colours where there is no terminal");
        assert_eq!(names(&directory), ["arm.toml"], "{arguments:?}");
    }
}

#[test]
fn an_unknown_frame_or_joint_is_an_error_of_the_input() {
    let run = straightline(&["generate", ARM, "--frame", "fore_arm"]);
    assert_eq!((run.code, run.out.as_str()), (1, ""));
    assert!(run.err.contains("fore_arm") && run.err.contains("forearm"), "{}", run.err);
    let run = straightline(&["report", ARM, "--joint-order", "yaw,shoulder"]);
    assert_eq!((run.code, run.out.as_str()), (1, ""));
    assert!(run.err.contains("elbow"), "{}", run.err);
}

#[test]
fn check_says_which_angles_are_taken_as_exact() {
    let directory = scratch("angles");
    let robot = directory.join("arm.toml");
    let text = fs::read_to_string(ARM).unwrap().replace("rpy_quarter_turns = [1.0", "rpy = [1.5707963267948966");
    fs::write(&robot, text).unwrap();
    let robot = robot.to_str().unwrap();
    let run = straightline(&["check", ARM, robot]);
    assert_eq!((run.code, run.err.as_str()), (0, ""));
    assert!(run.out.contains("roll of the origin of joint `elbow`: 1.5707963267948966 as π/2, -6.1e-17 rad off"));
    let literal = straightline(&["check", robot, "--angle-tolerance", "0"]);
    assert!(!literal.out.contains("taken as exact"), "{}", literal.out);
}

#[test]
fn usage_ends_with_2_and_files_with_3() {
    assert_eq!(straightline(&["generate"]).code, 2);
    assert_eq!(straightline(&["generate", ARM, "--scalar", "f16"]).code, 2);
    assert_eq!(straightline(&["generate", "/nowhere/arm.toml"]).code, 3);
    let run = straightline(&["generate", ARM, "-o", "/nowhere/arm.rs"]);
    assert_eq!(run.code, 3);
    assert!(run.err.starts_with("error: /nowhere/arm.rs: "), "{}", run.err);

    let directory = scratch("theirs");
    fs::write(directory.join("thesis.tex"), "").unwrap();
    assert_eq!(straightline(&["export", ARM, "-o", directory.to_str().unwrap(), "--c-abi"]).code, 3);
    assert_eq!(names(&directory), ["thesis.tex"]);
}

#[test]
fn help_shows_examples_and_exit_codes() {
    for arguments in
        [&["--help"][..], &["generate", "--help"], &["export", "--help"], &["convert", "--help"], &["verify", "--help"]]
    {
        let run = straightline(arguments);
        assert_eq!(run.code, 0);
        assert!(run.out.contains("Examples:") && run.out.contains("Exit codes:"), "{}", run.out);
    }
}

#[test]
fn the_report_is_json_for_programs() {
    let run = straightline(&["report", ARM, "--json", "--function", "inverse_dynamics"]);
    let report: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(report["robot"], "arm");
    let functions = report["functions"].as_object().unwrap();
    assert_eq!(functions.keys().collect::<Vec<_>>(), ["inverse_dynamics"]);
    for key in ["mul", "add", "fma", "div", "sqrt", "sincos", "max_live", "lines"] {
        assert!(functions["inverse_dynamics"][key].is_u64(), "{key}");
    }
    assert_eq!(functions["inverse_dynamics"]["sincos"], 2);
}

#[test]
fn the_report_is_a_page_for_people() {
    let directory = scratch("page");
    let page = directory.join("arm.html");
    let run = straightline(&["report", ARM, "--html", page.to_str().unwrap()]);
    assert_eq!((run.code, run.out.as_str()), (0, ""), "{}", run.err);
    assert!(fs::read_to_string(&page).unwrap().starts_with("<!DOCTYPE html>"));
    assert_eq!(names(&directory), ["arm.html"]);
    let nowhere = straightline(&["report", ARM, "--html", "/nowhere/arm.html"]);
    assert_eq!(nowhere.code, 3, "{}", nowhere.err);
    assert_eq!(straightline(&["report", ARM, "--html", "a.html", "--json"]).code, 2);
}

#[test]
fn an_exceeded_budget_fails_and_writes_nothing() {
    let directory = scratch("budget");
    let scene = directory.join("scene.toml");
    fs::write(&scene, "[budget.gravity_force]\nmax_flops = 3\n[budget.inverse_dynamics]\nmax_flops = 4\n").unwrap();
    let output = directory.join("arm.rs");
    let (scene, output) = (scene.to_str().unwrap(), output.to_str().unwrap());
    let run = straightline(&["generate", ARM, "--scene", scene, "-o", output]);
    assert_eq!((run.code, run.out.as_str()), (1, ""));
    assert_eq!(run.err.matches("error[over-budget]").count(), 2, "{}", run.err);
    assert!(run.err.contains("the budget is 3") && run.err.contains("what would save most"), "{}", run.err);
    assert_eq!(names(&directory), ["scene.toml"]);
}

#[test]
fn verify_finds_roundings_only() {
    for options in [&[][..], &["--floating-base"], &["--scalar", "f32"], &["--rules", "exact"]] {
        let run = straightline(&[&["verify", ARM, "--states", "20", "--seed", "7", "--json"], options].concat());
        assert_eq!(run.code, 0, "{}", run.err);
        let verification: serde_json::Value = serde_json::from_str(&run.out).unwrap();
        let functions = verification["functions"].as_object().unwrap();
        assert_eq!(functions.len(), 15);
        let unit = if options.contains(&"f32") { 2f64.powi(-24) } else { 2f64.powi(-53) };
        for (name, worst) in functions {
            // three joints: a few dozen roundings
            assert!(worst["error"].as_f64().unwrap() < 64.0 * unit, "{name}: {worst}");
        }
    }
}

/// A comparison of nothing is no proof: it ends as one that failed, whatever is printed.
#[test]
fn verify_fails_where_nothing_is_compared() {
    let robots = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots");
    let [robot, scene] =
        ["descriptions/planar_2r.toml", "scenes/planar_2r_elastic.toml"].map(|file| format!("{robots}/{file}"));
    let one =
        ["verify", &robot, "--scene", &scene, "--states", "3", "--function", "driven_forward_dynamics_derivatives"];
    for json in [&[][..], &["--json"]] {
        let run = straightline(&[&one, json].concat());
        assert_eq!(run.code, 1, "{}", run.err);
        let why = "no function was compared: the reference has no formulation of driven_forward_dynamics_derivatives";
        assert!(run.err.contains(why), "{}", run.err);
    }
    let two = [&one[..], &["--function", "inverse_dynamics"]].concat();
    let run = straightline(&two);
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(run.out.contains("has no formulation of driven_forward_dynamics_derivatives"), "{}", run.out);
}

/// What has an engine of queries is a command of its own, whose words, results and end are those of `query`.
#[cfg(unix)]
#[test]
fn query_is_handed_on() {
    use std::os::unix::fs::PermissionsExt;
    let here = scratch("query");
    let query = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_straightline"));
        command.arg("query").args(words).env("PATH", &here).output().unwrap()
    };
    let missing = query(&["SELECT 1"]);
    let said = String::from_utf8(missing.stderr).unwrap();
    assert_eq!(missing.status.code(), Some(1));
    assert!(
        said.contains("there is no command `straightline-query`") && said.contains("--path fleets/query"),
        "{said}"
    );

    let stub = here.join("straightline-query");
    fs::write(&stub, "#!/bin/sh\nfor word in \"$@\"; do echo \"<$word>\"; done\necho why >&2\nexit $#\n").unwrap();
    fs::set_permissions(&stub, fs::Permissions::from_mode(0o755)).unwrap();
    for words in [&[][..], &["--robots", "a b", "SELECT 'x'", "--", "-q"], &["--help"]] {
        let handed = query(words);
        assert_eq!(handed.status.code(), Some(words.len() as i32));
        let expected: String = words.iter().map(|word| format!("<{word}>\n")).collect();
        assert_eq!(String::from_utf8(handed.stdout).unwrap(), expected);
        assert_eq!(String::from_utf8(handed.stderr).unwrap(), "why\n");
    }
}

#[test]
fn bench_measures_every_function_without_a_compiler() {
    for more in [&["--scalar", "f64"][..], &["--scalar", "f32"], &["--fma"]] {
        let run = straightline(&[&["bench", ARM, "--states", "3", "--json"], more].concat());
        assert_eq!(run.code, 0, "{}", run.err);
        let report: serde_json::Value = serde_json::from_str(&run.out).unwrap();
        for time in ["milliseconds_to_load", "milliseconds_to_load_kept"] {
            assert!(report[time].as_f64().unwrap() > 0.0, "{}", run.out);
        }
        let functions = report["functions"].as_object().unwrap();
        assert_eq!(functions.len(), 15);
        for (name, f) in functions {
            for time in ["nanoseconds_per_call", "nanoseconds_per_state"] {
                assert!(f[time].as_f64().unwrap() > 0.0, "{name}: {f}");
            }
            assert!(f["error"].as_f64().unwrap() <= report["bound"].as_f64().unwrap(), "{name}: {f}");
        }
    }
    let run = straightline(&["bench", ARM, "--states", "3", "--function", "mass_matrix"]);
    assert_eq!(run.code, 0, "{}", run.err);
    let row = run.out.lines().find(|line| line.starts_with("mass_matrix")).expect("a line of the function");
    assert_eq!(row.split_whitespace().count(), 7, "{}", run.out);
    // what is made as quickly is not kept
    let quick =
        straightline(&["bench", ARM, "--states", "3", "--function", "mass_matrix", "--optimise", "quick", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&quick.out).unwrap();
    assert!(report["milliseconds_to_load_kept"].is_null(), "{}", quick.out);
    assert_eq!(straightline(&["bench", "nowhere.urdf"]).code, 3);
}

#[test]
fn a_scene_reaches_every_command_and_the_command_line_wins() {
    let directory = scratch("scene");
    let scene = directory.join("still.toml");
    let scene = scene.to_str().unwrap();
    let text =
        "[outputs]\nfunctions = [\"inverse_dynamics\", \"energy\"]\n[zero]\nqd = true\n[numbers]\nscalar = \"f32\"\n";
    fs::write(scene, text).unwrap();

    let generated = straightline(&["generate", ARM, "--scene", scene]);
    assert_eq!(generated.code, 0, "{}", generated.err);
    assert!(generated.out.contains("pub fn inverse_dynamics(q: &[f32; 3], qdd: &[f32; 3], tau: &mut [f32; 3])"));
    assert!(!generated.out.contains("pub fn mass_matrix"));
    let wins = ["generate", ARM, "--scene", scene, "--function", "gravity_force", "--scalar", "f64"];
    let generated = straightline(&wins);
    assert!(generated.out.contains("pub fn gravity_force(q: &[f64; 3]") && !generated.out.contains("pub fn energy"));
    assert_eq!(straightline(&["check", ARM, "--scene", scene]).code, 0);
    assert_eq!(straightline(&["verify", ARM, "--scene", scene, "--states", "5"]).code, 0);

    fs::write(scene, "[hold]\njoints = { elbo = 0.1 }\n").unwrap();
    for command in ["generate", "report", "check"] {
        let run = straightline(&[command, ARM, "--scene", scene]);
        assert_eq!(run.code, 1);
        assert!(run.err.contains("did you mean `elbow`?") && run.err.contains("still.toml:2:12"), "{}", run.err);
    }
    fs::write(scene, "[hold]\ngravity = \"input\"\n").unwrap();
    let twice = straightline(&["report", ARM, "--scene", scene, "--gravity", "0,0,-1.62"]);
    assert!(twice.code == 1 && twice.err.contains("gravity is given by the scene and by an option"), "{}", twice.err);
    assert_eq!(straightline(&["report", ARM, "--scene", "nowhere.toml"]).code, 3);
}

#[test]
fn no_command_writes_over_what_it_reads() {
    let directory = scratch("inputs");
    let text = fs::read_to_string(ARM).unwrap();
    let (robot, scene) = (directory.join("arm.toml"), directory.join("scene.toml"));
    fs::write(&robot, &text).unwrap();
    fs::write(&scene, "[zero]\nqd = true\n").unwrap();
    let inside = directory.join("../inputs/arm.toml");
    let mut commands = vec![
        vec!["generate", robot.to_str().unwrap(), "-o", robot.to_str().unwrap()],
        vec!["generate", robot.to_str().unwrap(), "-o", inside.to_str().unwrap()],
        vec!["report", robot.to_str().unwrap(), "--html", robot.to_str().unwrap()],
        vec!["convert", robot.to_str().unwrap(), robot.to_str().unwrap()],
        vec!["generate", robot.to_str().unwrap(), "--scene", scene.to_str().unwrap(), "-o", scene.to_str().unwrap()],
    ];
    let link = directory.join("link.rs");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&robot, &link).unwrap();
        commands.push(vec!["generate", robot.to_str().unwrap(), "-o", link.to_str().unwrap()]);
    }
    for command in commands {
        let run = straightline(&command);
        assert_eq!(run.code, 3, "{command:?}: {}", run.err);
        assert!(run.err.contains("this is the input") && run.err.contains("nothing was written"), "{}", run.err);
        assert_eq!(fs::read_to_string(&robot).unwrap(), text, "{command:?}");
        assert_eq!(fs::read_to_string(&scene).unwrap(), "[zero]\nqd = true\n", "{command:?}");
    }
}

#[test]
fn convert_writes_the_same_robot_or_nothing() {
    let directory = scratch("convert");
    let path = |name: &str| directory.join(name).to_str().unwrap().to_string();
    let [mjcf, urdf, back] = ["arm.xml", "arm.urdf", "back.toml"].map(path);
    assert_eq!(straightline(&["convert", ARM, &mjcf, "-q"]).code, 0);
    assert_eq!(straightline(&["convert", &mjcf, &urdf, "-q", "--lossy"]).code, 0);
    assert_eq!(straightline(&["convert", &urdf, &back, "-q"]).code, 0);
    for robot in [&mjcf, &urdf, &back] {
        assert_eq!(straightline(&["check", robot]).code, 0, "{robot}");
    }
    // refused, with the list of what is lost: nothing is written
    let spring = path("spring.toml");
    fs::write(&spring, fs::read_to_string(ARM).unwrap().replacen("axis =", "spring = { stiffness = 2.0 }\naxis =", 1))
        .unwrap();
    let refused = straightline(&["convert", &spring, &path("spring.urdf")]);
    assert_eq!((refused.code, refused.out.as_str()), (1, ""));
    assert!(refused.err.contains("error[not-in-format]: URDF has no place for springs"), "{}", refused.err);
    assert!(!names(&directory).contains(&"spring.urdf".to_string()));
    assert_eq!(straightline(&["convert", &spring, &path("spring.urdf"), "--lossy"]).code, 0);
    // no format, and one that is said
    let nameless = straightline(&["convert", ARM, &path("arm.txt")]);
    assert_eq!(nameless.code, 1);
    assert!(nameless.err.contains("the name says no format") && nameless.err.contains("`.mjcf`"), "{}", nameless.err);
    assert_eq!(straightline(&["convert", ARM, &path("arm.txt"), "--to", "mjcf", "-q"]).code, 0);
    assert_eq!(straightline(&["convert", ARM, &path("arm.txt"), "--to", "sdif"]).code, 2);
    assert_eq!(straightline(&["convert", "nowhere.urdf", &path("arm.xml")]).code, 3);
    // what a file includes is read, too
    let (whole, part) = (path("whole.xml"), path("part.xml"));
    let body = "<body><joint/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/></body>";
    fs::write(&whole, "<mujoco><worldbody><include file=\"part.xml\"/></worldbody></mujoco>").unwrap();
    fs::write(&part, format!("<mujocoinclude>{body}</mujocoinclude>")).unwrap();
    let over = straightline(&["convert", &whole, &part]);
    assert!(over.code == 3 && over.err.contains("this is the input"), "{}", over.err);
    assert!(fs::read_to_string(&part).unwrap().starts_with("<mujocoinclude>"));
}

#[test]
fn a_second_export_leaves_what_is_not_its_own() {
    let directory = scratch("twice");
    let package = directory.join("package");
    let export = |functions: &[&str]| {
        let mut arguments = vec!["export", ARM, "--c-abi", "-o", package.to_str().unwrap()];
        functions.iter().for_each(|f| arguments.extend(["--function", f]));
        let run = straightline(&arguments);
        assert_eq!(run.code, 0, "{}", run.err);
    };
    export(&["gravity_force", "mass_matrix"]);
    fs::create_dir(package.join(".git")).unwrap();
    fs::write(package.join(".git/HEAD"), "ref: refs/heads/main").unwrap();
    fs::write(package.join("src/mine.rs"), "// mine").unwrap();
    export(&["gravity_force"]);
    assert_eq!(fs::read_to_string(package.join(".git/HEAD")).unwrap(), "ref: refs/heads/main");
    assert_eq!(fs::read_to_string(package.join("src/mine.rs")).unwrap(), "// mine");
    assert!(!package.join("src/dynamics/mass_matrix.rs").exists(), "it is no longer part of the package");
    assert!(package.join("src/dynamics/gravity_force.rs").exists());
}

#[test]
fn robots_of_any_name_export_a_package_that_cargo_takes() {
    let directory = scratch("named");
    let text = fs::read_to_string(ARM).unwrap();
    for (k, name) in ["(2R)", "[7dof]", "\u{440}\u{443}\u{43a}\u{430}", "-", "test"].into_iter().enumerate() {
        let (robot, package) = (directory.join(format!("{k}.toml")), directory.join(format!("{k}")));
        fs::write(&robot, text.replacen("name = \"arm\"", &format!("name = \"{name}\""), 1)).unwrap();
        let run = straightline(&[
            "export",
            robot.to_str().unwrap(),
            "--c-abi",
            "--function",
            "gravity_force",
            "-o",
            package.to_str().unwrap(),
        ]);
        assert_eq!(run.code, 0, "{name}: {}", run.err);
        // reads the manifest, and compiles nothing
        let cargo = Command::new(env!("CARGO"))
            .args(["metadata", "--offline", "--no-deps", "--format-version=1", "--manifest-path"])
            .arg(package.join("Cargo.toml"))
            .output()
            .unwrap();
        assert!(cargo.status.success(), "{name}: {}", String::from_utf8_lossy(&cargo.stderr));
    }
}

/// A file that is not written yet to its end takes the command long, and no time of the processor.
#[cfg(unix)]
#[test]
fn what_takes_long_says_so() {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline"));
    let command = command.args(["check", "/dev/stdin"]).stdin(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.stdout(Stdio::null()).spawn().unwrap();
    let mut said = String::new();
    BufReader::new(child.stderr.take().unwrap()).read_line(&mut said).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(said, "5 s gone by: checking\n");
}
