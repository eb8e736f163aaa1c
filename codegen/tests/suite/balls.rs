//! Robots with ball joints: the forms of their programs, all functions beside the second author, and what a ball joint costs beside three revolute joints.

use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::program::checked;
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, Function};

/// Files with their robots' rotations as angles of f64: up to a rounding those of the data.
pub const ROBOTS: [(&str, &str); 3] = [
    ("ball_pendulum", include_str!("../files/ball_pendulum.toml")),
    ("ball_chain", include_str!("../files/ball_chain.toml")),
    ("ball_float", include_str!("../files/ball_float.toml")),
];

pub fn robot(name: &str, text: &str) -> Robot {
    let source = Source::new(&format!("{name}.toml"), text);
    let (model, said): (_, Diagnostics) = model::load(&source, &ModelOptions::default());
    Robot::new(model.unwrap_or_else(|| panic!("{}", said.render())))
}

const FUNCTIONS: [Function; 12] = [
    Function::InverseDynamics,
    Function::BiasForce,
    Function::GravityForce,
    Function::VelocityForce,
    Function::ForwardDynamics,
    Function::MassMatrix,
    Function::Energy,
    Function::JointWrenches,
    Function::ForwardKinematics,
    Function::Jacobian,
    Function::JacobianBias,
    Function::InverseDynamicsDerivatives,
];

/// What they lose is a test of the generated code (`joint_states::`).
#[test]
fn programs_of_robots_with_balls_are_in_no_plainer_form() {
    for (name, text) in ROBOTS {
        let robot = robot(name, text);
        let frames: Vec<String> = robot.model.frames.iter().map(|frame| frame.name.clone()).collect();
        for function in FUNCTIONS {
            let program =
                checked(&robot, &frames, function, &Options::default()).unwrap_or_else(|wrong| panic!("{wrong}"));
            assert!(program.plainer.is_none(), "{} of {name} is in a plainer form", function.name());
        }
    }
}

#[test]
fn all_functions_of_robots_with_balls_are_the_second_authors() {
    // a chain is a slow proof
    verified(&ROBOTS[..1]);
}

#[test]
#[ignore = "slow proof: all functions of three robots"]
fn slow_proof_that_all_functions_of_all_robots_with_balls_are_the_second_authors() {
    verified(&ROBOTS);
}

fn verified(robots: &[(&str, &str)]) {
    for (name, text) in robots {
        let source = Source::new(&format!("{name}.toml"), *text);
        let functions: Vec<Function> =
            Function::all().filter(|f| !f.spec().family.is_of_drives() && f.spec().members.is_empty()).collect();
        let options = Options { functions, ..Options::default() };
        let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{}", errors.render()));
        let verification = verify(&source, &generated, &options, (3, 1), || ()).unwrap_or_else(|why| panic!("{why}"));
        assert!(verification.passes(), "{name}: {:?}", verification.functions);
    }
}

/// The same robot with three revolute joints about x, y and z in the place of each ball joint.
fn with_three_for_each(text: &str) -> String {
    let mut out = Vec::new();
    for block in text.split("\n[[") {
        if !block.contains("kind = \"spherical\"") {
            out.push(block.to_string());
            continue;
        }
        let value = |key: &str| block.lines().find_map(|line| line.strip_prefix(&format!("{key} = "))).expect("a key");
        let [name, parent, child] = ["name", "parent", "child"].map(|key| value(key).trim_matches('"').to_string());
        let links = [parent, format!("{name}_0"), format!("{name}_1"), child];
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let origin = if k == 0 { format!("origin = {}\n", value("origin")) } else { String::new() };
            let (above, below) = (&links[k], &links[k + 1]);
            if k < 2 {
                out.push(format!("link]]\nname = \"{below}\"\n"));
            }
            out.push(format!(
                "joint]]\nname = \"{name}_{axis}\"\nkind = \"continuous\"\nparent = \"{above}\"\nchild = \"{below}\"\naxis = \"{axis}\"\n{origin}"
            ));
        }
    }
    out.join("\n[[")
}

/// A sine and its cosine are no operations here, and a ball joint has none.
#[test]
fn a_ball_joint_takes_about_as_many_operations_as_three_revolute_joints_and_no_sines() {
    for (name, text) in ROBOTS {
        let counts = |text: &str| {
            let robot = robot(name, text);
            let program = checked(&robot, &[], Function::InverseDynamics, &Options::default());
            program.unwrap_or_else(|wrong| panic!("{wrong}")).graph.counts()
        };
        let (ball, three) = (counts(text), counts(&with_three_for_each(text)));
        let ratio = ball.flops() as f64 / three.flops() as f64;
        let [sines, of_three] = [ball.sin_cos, three.sin_cos];
        println!("{name:14} {} operations, {sines} sines; {}, {of_three}: {ratio:.3}", ball.flops(), three.flops());
        assert!(ratio <= 1.15, "{name}: {ratio}");
        assert_eq!(of_three - sines, 3 * text.matches("\"spherical\"").count());
    }
}
