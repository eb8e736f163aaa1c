//! The front of build scripts: what it writes, and what it tells cargo and people.

use std::fs;
use std::path::PathBuf;
use straightline_codegen::{Builder, Function};

const PENDULUM: &str = r#"
[robot]
name = "pendulum"

[[link]]
name = "world"

[[link]]
name = "bob"
mass = 1.5
com = [0.0, 0.0, -0.4]
inertia = [0.02, 0.02, 0.001]

[[joint]]
name = "pivot"
kind = "continuous"
parent = "world"
child = "bob"
axis = "y"
"#;

fn scratch(name: &str, text: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("straightline-builder-{}-{name}", std::process::id()));
    fs::create_dir_all(&path).unwrap();
    fs::write(path.join("pen.toml"), text).unwrap();
    path
}

#[test]
fn the_output_stands_in_out_dir_and_cargo_knows_what_it_depends_on() {
    let here = scratch("good", PENDULUM);
    let m = Builder::new("pen.toml").functions([Function::GravityForce]).run(&here, &here);
    let generated = m.result.unwrap();
    assert_eq!(fs::read_to_string(here.join("pen.rs")).unwrap(), generated.text);
    assert_eq!(m.cargo, [format!("cargo::rerun-if-changed={}", here.join("pen.toml").display())]);
    assert!(generated.text.contains("pub fn gravity_force(q: &[f64; 1], g: &mut [f64; 1])"));
    assert!(!generated.text.contains("pub fn mass_matrix"));
}

#[test]
fn errors_reach_cargo_in_one_line_each_and_people_with_the_source_line() {
    let here = scratch("bad", &PENDULUM.replace("mass = 1.5", "mass = -1.5").replace("\"bob\"\naxis", "\"bib\"\naxis"));
    let m = Builder::new("pen.toml").run(&here, &here);
    assert_eq!(m.result.unwrap_err().to_string(), "pen.toml: 2 errors");
    let errors: Vec<_> = m.cargo.iter().filter(|l| l.starts_with("cargo::error=pen.toml:")).collect();
    assert_eq!(errors.len(), 2, "{:?}", m.cargo);
    assert!(m.person.contains("--> pen.toml:10:8"), "{}", m.person);
    assert!(!here.join("pen.rs").exists());
}

/// The corners of a tetrahedron.
const HULL: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[test]
fn cargo_knows_the_files_that_a_robot_file_names() {
    let here = scratch("named", PENDULUM);
    let file = |name: &str, text: &str| fs::write(here.join(name), text).unwrap();
    file("hull.obj", HULL);
    file("rod.xml", "<mujocoinclude><geom type=\"mesh\" mesh=\"hull\" density=\"7\"/></mujocoinclude>");
    file("hand.xml", "<mujoco><worldbody><body name=\"hand\"><joint name=\"wrist\"/><geom size=\"0.1\" pos=\"1 0 0\"/></body></worldbody></mujoco>");
    file(
        "arm.xml",
        "<mujoco><asset><mesh name=\"hull\" file=\"hull.obj\"/><model name=\"hand\" file=\"hand.xml\"/></asset><worldbody><body name=\"rod\">\
         <joint name=\"pivot\" axis=\"0 1 0\"/><include file=\"rod.xml\"/><attach model=\"hand\" prefix=\"left_\"/></body></worldbody></mujoco>",
    );
    let run = || Builder::new("arm.xml").functions([Function::GravityForce]).run(&here, &here);
    let first = run();
    let mut watched: Vec<String> =
        first.cargo.iter().filter(|line| line.starts_with("cargo::rerun")).cloned().collect();
    watched.sort();
    let names = ["arm.xml", "hand.xml", "hull.obj", "rod.xml"];
    assert_eq!(watched, names.map(|name| format!("cargo::rerun-if-changed={}", here.join(name).display())));
    // each of them makes the text another one
    let text = first.result.unwrap().text;
    for (name, old, new) in [("hull.obj", "0 0 1", "0 0 2"), ("rod.xml", "7", "8"), ("hand.xml", "0.1", "0.2")] {
        let before = fs::read_to_string(here.join(name)).unwrap();
        file(name, &before.replacen(old, new, 1));
        assert_ne!(run().result.unwrap().text, text, "{name}");
        file(name, &before);
    }
    assert_eq!(run().result.unwrap().text, text);
}

#[test]
fn a_scene_file_says_what_is_wanted_and_is_an_input_of_the_build() {
    let here = scratch("scene", PENDULUM);
    fs::write(here.join("still.toml"), "[outputs]\nfunctions = [\"inverse_dynamics\"]\n[zero]\nqd = true\n").unwrap();
    let m = Builder::new("pen.toml").scene_file("still.toml").run(&here, &here);
    let text = m.result.unwrap().text;
    assert!(text.contains("pub fn inverse_dynamics(q: &[f64; 1], qdd: &[f64; 1], tau: &mut [f64; 1])"), "{text}");
    assert!(!text.contains("pub fn gravity_force"));
    assert_eq!(m.cargo[1], format!("cargo::rerun-if-changed={}", here.join("still.toml").display()));

    fs::write(here.join("still.toml"), "[hold]\njoints = { pivt = 0.0 }\n").unwrap();
    let m = Builder::new("pen.toml").scene_file("still.toml").run(&here, &here);
    assert_eq!(m.result.unwrap_err().to_string(), "still.toml: 1 error");
    assert!(m.cargo[2].starts_with("cargo::error=still.toml:2:12: error: "), "{:?}", m.cargo);

    fs::write(here.join("still.toml"), "[zero]\nqdot = true\n").unwrap();
    let m = Builder::new("pen.toml").scene_file("still.toml").run(&here, &here);
    assert_eq!(m.result.unwrap_err().to_string(), "still.toml: 1 error");
    assert!(m.person.contains("--> still.toml:2:1"), "{}", m.person);
}

#[test]
fn all_that_is_wrong_with_scene_and_robot_is_said_in_one_run() {
    let errors = |robot: &str| -> Vec<String> {
        let here = scratch("both", robot);
        fs::write(here.join("still.toml"), "[zero]\nqdot = true\n[hold]\njoints = { pivt = 0.0 }\n").unwrap();
        let m = Builder::new("pen.toml").scene_file("still.toml").run(&here, &here);
        assert!(!here.join("pen.rs").exists());
        let place =
            |line: &String| line.strip_prefix("cargo::error=").map(|l| l.split(' ').next().unwrap().to_string());
        m.cargo.iter().filter_map(place).collect()
    };
    assert_eq!(errors(PENDULUM), ["still.toml:2:1:", "still.toml:4:12:"]);
    assert_eq!(errors(&PENDULUM.replace("mass = 1.5", "mass = -1.5")), ["pen.toml:10:8:", "still.toml:2:1:"]);
}

#[test]
fn a_missing_file_is_named() {
    let here = scratch("missing", PENDULUM);
    let m = Builder::new("pan.toml").run(&here, &here);
    assert!(m.cargo[1].starts_with("cargo::error=") && m.cargo[1].contains("pan.toml: "), "{:?}", m.cargo);
}
