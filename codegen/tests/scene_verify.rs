//! The program of every scene against the whole robot, held where the scene holds it, as the second author computes it.

use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::verify::{bound, verify};
use straightline_codegen::{compile, scene, Options};

const BRANCHED: &str = include_str!("files/branched.toml");
const CHAIN: &str = include_str!("files/chain.toml");

#[track_caller]
fn agrees(robot: &str, text: &str) {
    let (source, mut diagnostics) = (Source::new("robot.toml", robot), Diagnostics::new());
    let file = scene::read(&Source::new("scene.toml", text), &mut diagnostics);
    let options = file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(Options::default());
    let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{text}\n{errors}"));
    let verification = verify(&source, &generated, &options, (20, 7), || ()).expect("the reference reads the file");
    assert_eq!(verification.functions.len(), generated.items.len());
    for (name, worst) in &verification.functions {
        assert!(worst.error < bound(options.scalar) / 8.0, "{text}\n{name}: {worst:?}");
    }
}

#[test]
fn held() {
    agrees(BRANCHED, "[hold]\ngravity = \"zero\"");
    agrees(BRANCHED, "[hold]\ngravity = \"input\"\njoints = { elbow = 0.4, wrist = -0.7 }");
    agrees(BRANCHED, "[hold]\ngravity = [1.0, 2.0, -3.0]\njoints = { shoulder = 0.3, slide = 0.2 }");
    agrees(BRANCHED, "[hold]\nbase = \"floating\"\njoints = { head = 0.4, grip = 0.05, slide = -0.1 }");
    agrees(BRANCHED, "[hold]\nbase = \"moving\"\njoints = { elbow = 1.5707963267948966 }");
    agrees(&BRANCHED.replace("[robot]", "[robot]\nbase = \"floating\""), "[hold]\nbase = \"fixed\"");
}

#[test]
fn known_to_be_zero() {
    agrees(BRANCHED, "[zero]\nqd = true");
    agrees(BRANCHED, "[zero]\nqdd = true\njoints_at_rest = [\"elbow\", \"head\"]\n[hold]\nbase = \"floating\"");
    agrees(BRANCHED, "[zero]\nqd = true\nqdd = true\n[hold]\njoints = { slide = 0.1 }");
}

#[test]
fn effects() {
    agrees(BRANCHED, "[effects]\nrotor_inertia = false\nsprings = false");
    agrees(BRANCHED, "[effects]\ncoulomb = \"off\"\ndamping = false");
    agrees(BRANCHED, "[effects]\ncoulomb = \"smooth\"\ncoulomb_speed = 0.3\n[hold]\njoints = { elbow = 0.5 }");
}

const LOADS: &str = r#"
[[payload]]
name = "box"
frame = "camera"
mass = 1.25
com = [0.03, -0.02, 0.07]
inertia = { xx = 0.011, yy = 0.009, zz = 0.006, xy = 0.001, xz = -0.0005, yz = 0.0007 }

[[payload]]
name = "hat"
frame = "eye"
mass = 0.5
"#;

#[test]
fn payloads_and_parameters() {
    agrees(BRANCHED, LOADS);
    agrees(BRANCHED, &format!("{LOADS}\n[hold]\njoints = {{ wrist = 0.4, slide = 0.1 }}"));
    let tool = "[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"camera\"\n";
    let link = "[[parameter]]\nkind = \"link\"\nlink = \"fore\"\n";
    agrees(BRANCHED, tool);
    let hand = "[[parameter]]\nkind = \"link\"\nlink = \"hand\"\n";
    agrees(BRANCHED, &format!("{LOADS}{tool}{hand}\n[hold]\njoints = {{ grip = 0.1 }}"));
    agrees(BRANCHED, &format!("{LOADS}{tool}{link}\n[hold]\nbase = \"floating\"\ngravity = \"input\""));
    agrees(
        BRANCHED,
        &format!("{tool}{link}\n[hold]\njoints = {{ slide = 0.3, wrist = 0.2 }}\n[numbers]\nscalar = \"f32\""),
    );
}

#[test]
fn selected() {
    let text = "[outputs]\nmass_matrix = { part = \"diagonal\" }\njacobian = { joints = [\"head\", \"elbow\"], part = \"angular\" }
        inverse_dynamics = { joints = [\"grip\"] }\nforward_kinematics = { frames = [\"eye\", \"camera\"], part = \"linear\" }
        joint_wrenches = { joints = [\"wrist\", \"head\"], part = \"linear\" }\nforward_dynamics = { joints = [\"wrist\"] }\n";
    agrees(BRANCHED, text);
    agrees(BRANCHED, &format!("{text}\n[hold]\njoints = {{ shoulder = 0.5, slide = 0.1 }}"));
    agrees(BRANCHED, &format!("{text}\n[hold]\nbase = \"floating\"\njoints = {{ slide = 0.1 }}"));
}

#[test]
fn a_chain_in_the_chapters_notation() {
    let payload = "[[payload]]\nname = \"box\"\nframe = \"tip\"\nmass = 0.7\ncom = [0.02, 0.05, -0.03]\ninertia = [0.002, 0.003, 0.0025]";
    agrees(CHAIN, payload);
    agrees(CHAIN, &format!("{payload}\n[hold]\njoints = {{ turn = 0.3 }}"));
}
