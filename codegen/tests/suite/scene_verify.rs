//! The program of every scene against the whole robot, held where the scene holds it, as the second author computes it.
//!
//! Scenes of one kind share the functions among them: each has every sixth, and the next scene the next sixth. Every function of every
//! scene is a slow proof.

use super::effects::ARM;
use std::sync::atomic::{AtomicUsize, Ordering};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::scene_file;
use straightline_codegen::verify::{bound, verify};
use straightline_codegen::{compile, Function, Options};

const BRANCHED: &str = include_str!("../files/branched.toml");
const CHAIN: &str = include_str!("../files/chain.toml");

/// Which functions are tried in a scene that does not say it.
enum Tried {
    All,
    /// A sixth of them, by the number of the scene.
    Sixth(AtomicUsize),
}

impl Tried {
    fn sixth() -> Tried {
        Tried::Sixth(AtomicUsize::new(0))
    }

    fn of(&self, functions: impl Iterator<Item = Function>) -> Vec<Function> {
        match self {
            Tried::All => functions.collect(),
            Tried::Sixth(scene) => functions.skip(scene.fetch_add(1, Ordering::Relaxed) % 6).step_by(6).collect(),
        }
    }
}

#[track_caller]
fn agrees(tried: &Tried, robot: &str, text: &str) {
    agree(tried.of(Function::all()), robot, text, 20);
}

#[track_caller]
fn agree(functions: Vec<Function>, robot: &str, text: &str, states: u32) {
    let (source, mut diagnostics) = (Source::new("robot.toml", robot), Diagnostics::new());
    let file = scene_file::read(&Source::new("scene.toml", text), &mut diagnostics);
    let plain = Options { functions, ..Options::default() };
    let options = file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(plain);
    let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{text}\n{errors}"));
    let verification = verify(&source, &generated, &options, (states, 7), || ()).expect("the reference reads the file");
    assert_eq!(verification.functions.len(), generated.items.len());
    for (name, worst) in &verification.functions {
        assert!(worst.error < bound(options.scalar) / 8.0, "{text}\n{name}: {worst:?}");
    }
}

fn held(tried: &Tried) {
    agrees(tried, BRANCHED, "[hold]\ngravity = \"zero\"");
    agrees(tried, BRANCHED, "[hold]\ngravity = \"input\"\njoints = { elbow = 0.4, wrist = -0.7 }");
    agrees(tried, BRANCHED, "[hold]\ngravity = [1.0, 2.0, -3.0]\njoints = { shoulder = 0.3, slide = 0.2 }");
    agrees(tried, BRANCHED, "[hold]\nbase = \"floating\"\njoints = { head = 0.4, grip = 0.05, slide = -0.1 }");
    // without forward dynamics, which is left out only where all functions are asked for
    agrees(&Tried::All, BRANCHED, "[hold]\nbase = \"moving\"\njoints = { elbow = 1.5707963267948966 }");
    agrees(tried, &BRANCHED.replace("[robot]", "[robot]\nbase = \"floating\""), "[hold]\nbase = \"fixed\"");
}

fn known_to_be_zero(tried: &Tried) {
    agrees(tried, BRANCHED, "[zero]\nqd = true");
    agrees(tried, BRANCHED, "[zero]\nqdd = true\njoints_at_rest = [\"elbow\", \"head\"]\n[hold]\nbase = \"floating\"");
    agrees(tried, BRANCHED, "[zero]\nqd = true\nqdd = true\n[hold]\njoints = { slide = 0.1 }");
}

fn effects(tried: &Tried) {
    agrees(tried, BRANCHED, "[effects]\nrotor_inertia = false\nsprings = false");
    agrees(tried, BRANCHED, "[effects]\ncoulomb = \"off\"\ndamping = false");
    agrees(tried, BRANCHED, "[effects]\ncoulomb = \"smooth\"\ncoulomb_speed = 0.3\n[hold]\njoints = { elbow = 0.5 }");
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

fn payloads_and_parameters(tried: &Tried) {
    agrees(tried, BRANCHED, LOADS);
    agrees(tried, BRANCHED, &format!("{LOADS}\n[hold]\njoints = {{ wrist = 0.4, slide = 0.1 }}"));
    let tool = "[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"camera\"\n";
    let link = "[[parameter]]\nkind = \"link\"\nlink = \"fore\"\n";
    agrees(tried, BRANCHED, tool);
    let hand = "[[parameter]]\nkind = \"link\"\nlink = \"hand\"\n";
    agrees(tried, BRANCHED, &format!("{LOADS}{tool}{hand}\n[hold]\njoints = {{ grip = 0.1 }}"));
    agrees(tried, BRANCHED, &format!("{LOADS}{tool}{link}\n[hold]\nbase = \"floating\"\ngravity = \"input\""));
    agrees(
        tried,
        BRANCHED,
        &format!("{tool}{link}\n[hold]\njoints = {{ slide = 0.3, wrist = 0.2 }}\n[numbers]\nscalar = \"f32\""),
    );
}

fn selected(tried: &Tried) {
    let text = "[outputs]\nmass_matrix = { part = \"diagonal\" }\njacobian = { joints = [\"head\", \"elbow\"], part = \"angular\" }
        inverse_dynamics = { joints = [\"grip\"] }\nforward_kinematics = { frames = [\"eye\", \"camera\"], part = \"linear\" }
        joint_wrenches = { joints = [\"wrist\", \"head\"], part = \"linear\" }\nforward_dynamics = { joints = [\"wrist\"] }\n";
    agrees(tried, BRANCHED, text);
    agrees(tried, BRANCHED, &format!("{text}\n[hold]\njoints = {{ shoulder = 0.5, slide = 0.1 }}"));
    agrees(tried, BRANCHED, &format!("{text}\n[hold]\nbase = \"floating\"\njoints = {{ slide = 0.1 }}"));
}

fn a_chain_in_the_chapters_notation(tried: &Tried) {
    let payload = "[[payload]]\nname = \"box\"\nframe = \"tip\"\nmass = 0.7\ncom = [0.02, 0.05, -0.03]\ninertia = [0.002, 0.003, 0.0025]";
    agrees(tried, CHAIN, payload);
    agrees(tried, CHAIN, &format!("{payload}\n[hold]\njoints = {{ turn = 0.3 }}"));
}

/// What is made when it is named, each for one of the first scenes.
const DERIVATIVES: [Function; 6] = [
    Function::ForwardDynamicsVjp,
    Function::InverseDynamicsDerivatives,
    Function::InverseDynamicsVjp,
    Function::ForwardDynamicsDerivatives,
    Function::InverseDynamicsJvp,
    Function::ForwardDynamicsJvp,
];

/// With friction, springs and rotors: as they are, in other forms, and with joints held, loads carried and inertias as inputs.
fn derivatives(tried: &Tried) {
    let agrees = |robot: &str, text: &str| agree(tried.of(DERIVATIVES.into_iter()), robot, text, 6);
    let tool = "[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"rod\"\n";
    let link = "[[parameter]]\nkind = \"link\"\nlink = \"fore\"\n";
    let loads = LOADS.replace("camera", "rod").replace("eye", "fore");
    agrees(ARM, "[effects]\ncoulomb = \"smooth\"\ncoulomb_speed = 0.3\n");
    agrees(ARM, &format!("{loads}\n[hold]\njoints = {{ elbow = 0.4 }}\ngravity = \"input\""));
    agrees(ARM, &format!("{tool}{link}\n[hold]\njoints = {{ slide = 0.2 }}"));
    agrees(ARM, &format!("{link}\n[hold]\njoints = {{ shoulder = -0.4 }}"));
    agrees(ARM, &format!("{loads}{tool}\n[effects]\nsprings = false\n[numbers]\nscalar = \"f32\""));
    agrees(CHAIN, "[effects]\ndamping = false\n[hold]\ngravity = [1.0, 2.0, -3.0]");
    // those take long
    if matches!(tried, Tried::All) {
        agrees(ARM, "[zero]\nqd = true\n[hold]\njoints = { elbow = -0.6 }");
        let mass = "name = \"base\"\nmass = 3.5\ncom = [0.02, -0.01, 0.1]\ninertia = [0.04, 0.05, 0.06]\n";
        let held = "[hold]\nbase = \"floating\"\njoints = { shoulder = -0.4, slide = 0.1 }";
        agrees(&ARM.replacen("name = \"base\"\n", mass, 1), &format!("{link}\n{held}"));
    }
}

macro_rules! kinds {
    ($($kind:ident),*) => {$(
        mod $kind {
            #[test]
            fn a_sixth_of_the_functions_agree() {
                super::$kind(&super::Tried::sixth());
            }

            #[test]
            #[ignore = "slow proof: every function of every scene"]
            fn slow_proof_that_every_function_agrees() {
                super::$kind(&super::Tried::All);
            }
        }
    )*};
}

kinds!(
    held,
    known_to_be_zero,
    effects,
    payloads_and_parameters,
    selected,
    a_chain_in_the_chapters_notation,
    derivatives
);
