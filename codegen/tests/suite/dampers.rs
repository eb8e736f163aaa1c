//! Dampers of ball joints and of bodies that move freely, and springs and dampers that are made of how a joint is to swing: as MuJoCo has them, by all functions,
//! in every format that can say them.

use crate::robots::Random;
use straightline_codegen::convert::{convert, format_of_word, ConvertOptions};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, Function, Options};
use straightline_core::algorithms::{inverse_dynamics, mass_matrix};
use straightline_core::model::{JointEffects, Model};
use straightline_core::Dd;

/// A torso that floats and is damped, with a tail on two springs, an arm on a damped ball joint, and a leg.
const WAGGING: &str = include_str!("../files/wagging.xml");

fn model_of(text: &str) -> Model<Dd> {
    let (model, diagnostics) = load(&Source::new("wagging.xml", text), &ModelOptions::default());
    model.unwrap_or_else(|| panic!("{diagnostics}\n{text}"))
}

/// The code and the line of the one error that is said of a text.
fn error_of(name: &str, text: &str) -> (&'static str, usize) {
    let (model, diagnostics) = load(&Source::new(name, text), &ModelOptions::default());
    assert!(model.is_none(), "{text}");
    let mut errors = diagnostics.iter().filter(|d| d.severity == straightline_codegen::diagnostic::Severity::Error);
    let error = errors.next().expect("an error");
    assert!(errors.next().is_none(), "{diagnostics}");
    (error.code, error.place.as_ref().map_or(0, |place| place.line))
}

#[test]
fn every_rate_of_a_damped_joint_feels_the_same_damper_and_armature() {
    let damped = model_of(WAGGING);
    let mut plain = damped.clone();
    for body in plain.bodies.iter_mut().filter(|body| !body.joint.kind.is_single()) {
        body.effects = JointEffects::none();
    }
    let mut random = Random(7);
    let mut numbers = |n: usize| (0..n).map(|_| random.number()).collect::<Vec<Dd>>();
    let [mut q, qd, qdd] = [numbers(damped.nq()), numbers(damped.nv()), numbers(damped.nv())];
    damped.free_joints().for_each(|joint| joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]));
    let forces = [&damped, &plain].map(|model| inverse_dynamics(model, &q, &qd, &qdd));
    let inertias = [&damped, &plain].map(|model| mass_matrix(model, &q));
    for body in &damped.bodies {
        let [damping, armature] = match body.joint.name.as_str() {
            "root_joint" => [0.7, 0.0],
            "ball" => [0.4, 0.05],
            _ => [0.0; 2],
        }
        .map(Dd::from);
        for k in body.joint.iv..body.joint.iv + body.joint.kind.nv() {
            let force = damping * qd[k] + armature * qdd[k];
            assert!((forces[0][k] - forces[1][k] - force).abs().to_f64() < 1e-28, "{} {k}", body.joint.name);
            let at = k * damped.nv() + k;
            assert!((inertias[0][at] - inertias[1][at] - armature).abs().to_f64() < 1e-28, "{} {k}", body.joint.name);
        }
    }
}

/// Numbers of MuJoCo 4.0.0: `jnt_stiffness` and `dof_damping` of this file.
#[test]
fn springs_and_dampers_of_a_swing_are_those_of_mujoco() {
    let model = model_of(WAGGING);
    for (name, stiffness, damping) in [
        ("wag", 9.267424964502474, 0.9082076465212426),
        ("stretch", 118.40118309102262, 11.840118309102262),
        ("hip", 3.0, 4.0),
    ] {
        let body = model.bodies.iter().find(|body| body.joint.name == name).expect("a joint");
        let found = [body.effects.stiffness, body.effects.damping].map(Dd::to_f64);
        for (found, expected) in found.into_iter().zip([stiffness, damping]) {
            assert!((found / expected - 1.0).abs() < 1e-13, "{name}: {found} and {expected}");
        }
    }
    let rest = model.bodies.iter().find(|body| body.joint.name == "wag").expect("a joint").effects.spring_rest;
    assert_eq!(rest, Dd::from(0.3));
}

/// A mass m on a slide feels m: k = m / (T ζ)² and d = 2 m / T, whatever another joint that follows it moves.
#[test]
fn a_swing_knows_no_couplings() {
    let text = "<mujoco><worldbody><body><joint name=\"s\" type=\"slide\" springdamper=\"0.25 2\"/><geom size=\"0.1\" mass=\"3\"/></body>
        <body><joint name=\"t\" type=\"slide\"/><geom size=\"0.1\" mass=\"8\"/></body></worldbody>
        <equality><joint joint1=\"t\" joint2=\"s\" polycoef=\"0 2 0 0 0\"/></equality></mujoco>";
    let effects = model_of(text).bodies[0].effects;
    assert_eq!([effects.stiffness, effects.damping].map(Dd::to_f64), [12.0, 24.0]);
}

#[test]
fn all_dynamics_of_damped_robots_are_the_second_authors() {
    let functions = vec![
        Function::InverseDynamics,
        Function::ForwardDynamics,
        Function::MassMatrix,
        Function::BiasForce,
        Function::InverseDynamicsDerivatives,
        Function::ForwardDynamicsDerivatives,
        Function::Energy,
    ];
    let options = Options { functions, ..Options::default() };
    let source = Source::new("wagging.xml", WAGGING);
    let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{}", errors.render()));
    let verification = verify(&source, &generated, &options, (3, 1), || ()).unwrap_or_else(|why| panic!("{why}"));
    assert!(verification.passes(), "{:?}", verification.functions);
}

/// `convert` compares the model of what it wrote with that of the file, number by number; SDF and URDF have no place for some of them.
#[test]
fn dampers_are_written_in_formats_that_have_them() {
    let source = Source::new("wagging.xml", WAGGING);
    for (word, lost) in [
        ("mjcf", vec![]),
        ("toml", vec![]),
        ("urdf", vec!["damping of floating bases", "springs"]),
        ("sdf", vec!["damping of floating bases", "damping of ball joints"]),
    ] {
        let format = format_of_word(word).expect("a format");
        let mut said = Diagnostics::new();
        let text = convert(&source, format, ConvertOptions::default(), &mut said);
        assert_eq!(text.is_some(), lost.is_empty(), "{word}: {said}");
        for what in lost {
            assert!(said.iter().any(|d| d.code == "not-in-format" && d.line().contains(what)), "{word}: {said}");
        }
    }
}

#[test]
fn dampers_that_nothing_has_are_refused_with_their_line() {
    let damped = |base: &str| {
        format!(
            "[robot]\nname = \"r\"\n{base}\n[[link]]\nname = \"a\"\nmass = 1.0\ninertia = [1, 1, 1]\n[[link]]\nname = \"b\"\nmass = 1.0\n\
             inertia = [1, 1, 1]\n[[joint]]\nname = \"j\"\nkind = \"spherical\"\nparent = \"a\"\nchild = \"b\"\ndamping = 0.5\n"
        )
    };
    let mjcf = |old: &str, new: &str| {
        assert!(WAGGING.contains(old), "{old}");
        WAGGING.replace(old, new)
    };
    let rows = [
        ("r.toml", damped("base = \"fixed\"\nbase_damping = 0.1"), ("damped-base-stands", 4)),
        ("r.toml", damped("base = \"floating\"\nbase_damping = -0.1"), ("negative-effect", 4)),
        ("r.toml", damped("").replace("damping = 0.5", "damping = -0.5"), ("negative-effect", 17)),
        ("r.toml", damped("").replace("damping = 0.5", "friction = 0.5"), ("several-coordinates", 17)),
        ("r.xml", mjcf("damping=\"0.7\"", "damping=\"-0.7\""), ("negative-effect", 5)),
        ("r.xml", mjcf("damping=\"0.7\"", "armature=\"0.7\""), ("not-supported-yet", 5)),
        ("r.xml", mjcf("damping=\"0.4\"", "stiffness=\"0.4\""), ("not-supported-yet", 16)),
        ("r.xml", mjcf("damping=\"0.4\"", "springdamper=\"1 1\""), ("not-supported-yet", 16)),
        ("r.xml", mjcf("springdamper=\"0 0\"", "springdamper=\"-1 -1\""), ("no-oscillation", 20)),
        ("r.xml", mjcf("springdamper=\"0 0\"", "springdamper=\"0.1 0\""), ("no-oscillation", 20)),
        ("r.xml", mjcf("springdamper=\"0 0\"", "springdamper=\"0.1\""), ("wrong-count", 20)),
        ("r.xml", mjcf("springdamper=\"0.05 1\"", "springdamper=\"1e-30 1\""), ("no-oscillation", 11)),
    ];
    for (name, text, expected) in rows {
        assert_eq!(error_of(name, &text), expected, "{text}");
    }
}
