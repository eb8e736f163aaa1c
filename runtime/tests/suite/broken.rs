//! A robot file, a scene or an option that is wrong is one error of the compiler, whatever the code does with the robot.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ARM: &str = include_str!("../../examples/arm.toml");

/// The ways in which people use a type with dynamics: arrays of its lengths, patterns, constants, limits.
const USE: &str = r#"
struct State { q: [f64; Arm::NQ], tau: [f64; Arm::NV] }
const BUDGET: () = assert!(Arm::INVERSE_DYNAMICS_COST.fma < 200);
fn torques(q: &[f64; Arm::NQ]) -> [f64; Arm::NV] {
    let mut tau = [0.0; Arm::NV];
    Arm::inverse_dynamics(q, &[0.0; 3], &[0.0; Arm::NV], &mut tau);
    tau
}
fn main() {
    let () = BUDGET;
    let q = [0.1, -0.2, 0.3];
    let [a, b, c] = torques(&q);
    let mut h = [[0.0; Arm::NV]; Arm::NV];
    Arm::mass_matrix(&q, &mut h);
    assert_eq!(h[0][1], h[1][0]);
    let State { tau, .. } = State { q, tau: [a, b, c] };
    let mut x = [[0.0; 12]; Arm::FRAME_NAMES.len()];
    Arm::forward_kinematics(&q, &mut x);
    for (name, limit) in Arm::JOINT_NAMES.iter().zip(Arm::EFFORT_LIMITS) {
        println!("{name} {limit}");
    }
    let norm: f64 = tau.iter().map(|t| t * t).sum::<f64>().sqrt();
    println!("{norm} {:?} {}", Arm::JOINT_NAMES, x[0][1]);
}
"#;

/// Frames by name, of a file that is there.
const USE_FRAMES: &str = r#"
fn main() {
    let mut x = [[0.0; 12]; Arm::FRAME_NAMES.len()];
    Arm::forward_kinematics(&[0.1, -0.2, 0.3], &mut x);
    let [px, ..] = Arm::pose(&x, Arm::FOREARM).position;
    println!("{px} {:?}", x[Arm::FOREARM]);
}
"#;

/// Lanes and batches.
const USE_LANES: &str = r#"
fn main() {
    let q = [[0.1; 8]; 3];
    let mut g = [[0.0; 8]; Arm::NV];
    Arm::gravity_force_lanes(&q, &mut g);
    Arm::gravity_force_lanes::<8>(&q, &mut g);
    let (many, mut all) = (vec![0.0; 30], vec![0.0; 30]);
    Arm::gravity_force_batch_soa(10, &many, &mut all).unwrap();
    if let Err(wrong) = Arm::gravity_force_batch_aos(10, &many[1..], &mut all) {
        println!("{wrong}");
    }
}
"#;

/// Parameters, stages, further scalars and contact modes of a scene.
const USE_SCENE: &str = r#"
use loaded::staged::{Configuration, Parameters};
struct Robot { tool: loaded::Tool, q: [f64; loaded::NQ] }
fn hold(robot: &Robot) -> Result<[f64; Arm::NV], loaded::Unphysical> {
    let mut g = [0.0; Arm::NV];
    Arm::gravity_force(&robot.q, &robot.tool, &mut g);
    let parameters = Parameters::new(&robot.tool);
    Configuration::new(&parameters, &robot.q).gravity_force(&mut g);
    loaded::contact::pushed::forward_dynamics(&robot.q, &robot.q, &g, &mut [0.0; 3]);
    Ok(g)
}
fn main() {
    let tool = loaded::Tool::new(0.6, [0.05, 0.01, -0.02], [1e-3, 0.0, 0.0, 2e-3, 0.0, 1.5e-3]).unwrap();
    let robot = Robot { tool, q: [0.3, -0.8, 1.1] };
    match hold(&robot) {
        Ok([a, b, c]) => println!("{a} {b} {c}"),
        Err(loaded::Unphysical::NegativeMass) => println!("{}", loaded::GRAVITY_FORCE_COST.mul),
        Err(other) => println!("{other}"),
    }
    loaded::single::gravity_force(&[0.3_f32, -0.8, 1.1], &loaded::single::Tool::NONE, &mut [0.0; 3]);
}
"#;

const SCENE: &str =
    "[outputs]\nstaged = true\n[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"forearm\"\n\
                     [[mode]]\nname = \"pushed\"\ncontacts = []\n";

/// That a plainer form was taken is a failure of ours, which nothing silences.
const ALWAYS_SAID: &str = "`plainer-form` is always said: it cannot be set to `allow`";
const QUARTER_TURN: &str = "rpy_quarter_turns = [1.0, 0.0, 0.0]";
/// The same turn with six digits.
const CUT: &str = "rpy = [1.570796, 0.0, 0.0]";

/// Name, attribute, what follows, robot file, scene file, number of errors, and what they say.
type Case = (&'static str, &'static str, &'static str, String, String, &'static [&'static str]);

fn cases() -> Vec<Case> {
    let arm = |old: &str, new: &str| {
        assert!(ARM.contains(old), "the arm has `{old}`");
        ARM.replacen(old, new, 1)
    };
    let right = || ARM.to_string();
    let none = String::new;
    vec![
        ("missing", r#""robot/none.toml""#, USE, none(), none(), &["there is no robot file `robot/none.toml`"]),
        ("syntax", r#""robot/syntax.toml""#, USE, arm("mass = 2.5", "mass = = 2.5"), none(), &["toml-syntax"]),
        ("key", r#""robot/key.toml""#, USE, arm("mass = 2.5", "maas = 2.5"), none(), &["did you mean `mass`?"]),
        ("frames", r#""robot/frames.toml""#, USE_FRAMES, arm("mass = 2.5", "mass = -2.5"), none(), &["negative-mass"]),
        ("mass", r#""robot/mass.toml""#, USE, arm("mass = 2.5", "mass = -2.5"), none(), &["negative-mass"]),
        (
            "inertia",
            r#""robot/inertia.toml", deny("triangle-inequality")"#,
            USE,
            ARM.lines()
                .map(|line| {
                    if line.starts_with("inertia") {
                        "inertia = { xx = 0.5, yy = 0.01, zz = 0.01 }\n".into()
                    } else {
                        format!("{line}\n")
                    }
                })
                .collect(),
            none(),
            &["triangle-inequality"],
        ),
        ("frame", r#""robot/frame.toml", frames("forarm")"#, USE, right(), none(), &["did you mean `forearm`?"]),
        ("option", r#""robot/option.toml", flaoting_base"#, USE, right(), none(), &["did you mean `floating_base`?"]),
        (
            "function",
            r#""robot/function.toml", functions(inverse_dynamic, mass_matrix, RNEA)"#,
            USE,
            right(),
            none(),
            &["`inverse_dynamic`; did you mean `inverse_dynamics`?", "`RNEA`; did you mean `inverse_dynamics`?"],
        ),
        (
            "lanes",
            r#""robot/none.toml", functions(gravity_force), lanes = "runtime""#,
            USE_LANES,
            none(),
            none(),
            &["no robot file"],
        ),
        (
            "inline",
            r#""robot/inline.toml", module = "loaded", scene(outputs(staged = true), zero(qdot = true),
                parameter(kind = "payload", name = "tool", frame = "forearm"), mode(name = "pushed", contacts = []))"#,
            USE_SCENE,
            right(),
            none(),
            &["[zero] has no key `qdot`", "has no contact"],
        ),
        (
            "scene_syntax",
            r#""robot/scene_syntax.toml", module = "loaded", scene = "robot/scene_syntax_scene.toml""#,
            USE_SCENE,
            right(),
            SCENE.replace("staged = true", "staged ="),
            &["toml-syntax"],
        ),
        (
            "all_at_once",
            r#""robot/all_at_once.toml", frams("forearm"), scalar = "f46", allow("near-right-angel"), rules = "exact""#,
            USE,
            arm("mass = 2.5", "mass = -2.5"),
            none(),
            &["did you mean `frames`?", "did you mean `f64`?", "did you mean `near-right-angle`?", "negative-mass"],
        ),
        ("firm", r#""robot/firm.toml", allow("plainer-form")"#, USE, right(), none(), &[ALWAYS_SAID]),
        (
            "firm_scene",
            r#""robot/firm_scene.toml", scene(diagnostics(allow = ["plainer-form"]))"#,
            USE,
            right(),
            none(),
            &[ALWAYS_SAID],
        ),
        (
            "cut_angle",
            r#""robot/cut_angle.toml", deny("near-right-angle")"#,
            USE,
            arm(QUARTER_TURN, CUT),
            none(),
            &["near-right-angle"],
        ),
    ]
}

/// A folder with the layout of a package.
fn package(name: &str) -> PathBuf {
    let package = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    for directory in ["src/bin", "robot"] {
        fs::create_dir_all(package.join(directory)).unwrap();
    }
    package
}

/// What rustc says of `src/bin/NAME.rs`, with the library and the macros that cargo has built for this test: a package by `cargo check`
/// would have the compiler of dynamics built once more.
fn said_of(package: &Path, name: &str, main: &str) -> String {
    let file = format!("src/bin/{name}.rs");
    fs::write(package.join(&file), main).unwrap();
    let built = std::env::current_exe().unwrap().parent().unwrap().to_path_buf();
    let age = |path: &PathBuf| fs::metadata(path).and_then(|m| m.modified()).unwrap();
    let is_library = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("libstraightline-") && name.ends_with(".rlib")
    };
    let files = fs::read_dir(&built).unwrap().map(|entry| entry.unwrap().path());
    let library = files.filter(is_library).max_by_key(age).expect("this test depends on the library");
    let output = Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string()))
        .args(["--edition=2021", "--crate-type=bin", "--emit=metadata", "--crate-name", name, &file, "--extern"])
        .arg(format!("straightline={}", library.display()))
        .arg(format!("-Ldependency={}", built.display()))
        .args(["--out-dir", "."])
        .env("CARGO_MANIFEST_DIR", package)
        .current_dir(package)
        .output()
        .unwrap();
    String::from_utf8_lossy(&output.stderr).to_string()
}

/// A program whose derive has this attribute, and what the compiler says of it.
fn checked(package: &Path, name: &str, attribute: &str, uses: &str) -> String {
    said_of(
        package,
        name,
        &format!("use straightline::Dynamics;\n\n#[derive(Dynamics)]\n#[robot({attribute})]\nstruct Arm;\n{uses}"),
    )
}

#[test]
fn what_is_wrong_is_said_once_and_every_use_compiles() {
    let package = package("broken");
    let mut wrong = String::new();
    for (name, attribute, uses, robot, scene, expected) in cases() {
        fs::write(package.join(format!("robot/{name}.toml")), robot).unwrap();
        fs::write(package.join(format!("robot/{name}_scene.toml")), scene).unwrap();
        let said = checked(&package, name, attribute, uses);
        let is_own = |line: &&str| line.starts_with("error") && !line.starts_with("error: aborting");
        let errors = said.lines().filter(is_own).count();
        let missing: Vec<&&str> = expected.iter().filter(|part| said.matches(**part).count() == 0).collect();
        if errors != expected.len() || !missing.is_empty() {
            wrong +=
                &format!("--- {name}: {errors} errors instead of {}, without {missing:?}\n{said}\n", expected.len());
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// The attribute and its scene say what becomes of a warning; `deny` is among the errors above.
#[test]
fn warnings_of_the_derive_have_levels() {
    let package = package("levels");
    fs::write(package.join("robot/arm.toml"), ARM.replacen(QUARTER_TURN, CUT, 1)).unwrap();
    let uses = "fn main() {\n    println!(\"{}\", Arm::NV);\n}\n";
    for (name, attribute, warnings) in [
        ("said", "", 1),
        ("warned", r#", warn("near-right-angle")"#, 1),
        ("others", r#", allow("axis-length")"#, 1),
        ("allowed", r#", allow("near-right-angle")"#, 0),
        ("all", r#", allow("warnings")"#, 0),
        ("allowed_by_scene", r#", scene(diagnostics(allow = ["near-right-angle"]))"#, 0),
        ("mended", ", angle_tolerance = 1e-6", 0),
    ] {
        let attribute = format!(r#""robot/arm.toml", functions(gravity_force){attribute}"#);
        let said = checked(&package, name, &attribute, uses);
        assert_eq!(said.matches("near-right-angle").count(), warnings, "{name}: {said}");
        assert!(!said.contains("error"), "{name}: {said}");
        assert_eq!(said.contains("`angle_tolerance = 1e-6` takes"), warnings > 0, "{name}: {said}");
    }
}

/// A module by the other macro.
#[test]
fn a_module_of_a_broken_robot_is_one_error_too() {
    let package = package("broken_module");
    let main = "straightline::dynamics! {\n    pub mod arm = \"robot/none.toml\", functions(mass_matrix), generic,\n}\n\
                fn main() {\n    let mut h = [[0.0; arm::NV]; arm::NV];\n    arm::mass_matrix(&[0.1, 0.2, 0.3], &mut h);\n    \
                arm::mass_matrix::<f64>(&[0.1, 0.2, 0.3], &mut h);\n    println!(\"{}\", h[0][0] + 1.0);\n}\n";
    let said = said_of(&package, "module", main);
    assert_eq!(said.matches("\nerror").count() + usize::from(said.starts_with("error")), 2, "{said}");
    assert!(said.contains("there is no robot file `robot/none.toml`") && said.contains("aborting due to"), "{said}");
}
