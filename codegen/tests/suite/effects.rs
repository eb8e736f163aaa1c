//! Rotor inertia, friction and springs of a robot file are part of its dynamics, in all notations.

use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, Options};
use straightline_core::algorithms::{inverse_dynamics, mass_matrix};
use straightline_core::model::{Coulomb, JointEffects, Model};
use straightline_core::Dd;

/// Two oblique joints and a slide; every joint has other effects.
pub(super) const ARM: &str = r#"
[robot]
name = "arm"

[[link]]
name = "base"

[[link]]
name = "upper"
mass = 2.5
com = [0.02, 0.01, 0.2]
inertia = { xx = 0.02, yy = 0.021, zz = 0.004, xy = 0.001 }

[[link]]
name = "fore"
mass = 1.5
com = [0.0, -0.03, 0.1]
inertia = { xx = 0.01, yy = 0.009, zz = 0.002, yz = -0.0004 }

[[link]]
name = "rod"
mass = 0.4
com = [0.01, 0.0, 0.1]
inertia = [0.001, 0.0012, 0.0002]

[[joint]]
name = "shoulder"
kind = "revolute"
parent = "base"
child = "upper"
origin = { xyz = [0.0, 0.0, 0.3] }
axis = [0.1, 1.0, 0.2]
limits = [-2.0, 2.0]
rotor_inertia = 1e-4
gear_ratio = -100
damping = 0.5
friction = 0.25

[[joint]]
name = "elbow"
kind = "revolute"
parent = "upper"
child = "fore"
origin = { xyz = [0.05, 0.0, 0.4], rpy_deg = [10, 20, 30] }
axis = "y"
limits = [-2.0, 2.0]
armature = 0.3
spring = { stiffness = 12.0, rest = 0.5 }

[[joint]]
name = "slide"
kind = "prismatic"
parent = "fore"
child = "rod"
axis = "z"
limits = [0.0, 0.3]
rotor_inertia = 2e-5
gear_ratio = 600.0
friction = 1.5
spring = { stiffness = 80.0 }
"#;

fn model_of(name: &str, text: &str) -> Model<Dd> {
    let (model, diagnostics) = load(&Source::new(name, text), &ModelOptions::default());
    model.unwrap_or_else(|| panic!("{diagnostics}"))
}

fn number(x: f64) -> Dd {
    Dd::from(x)
}

#[test]
fn the_keys_of_joints_are_the_effects_of_bodies() {
    let model = model_of("arm.toml", ARM);
    let none = JointEffects::none();
    let expected = [
        JointEffects {
            rotor_inertia: Some(number(1e-4) * number(1e4)),
            damping: number(0.5),
            coulomb: Coulomb::Sign(number(0.25)),
            ..none
        },
        JointEffects { rotor_inertia: Some(number(0.3)), stiffness: number(12.0), spring_rest: number(0.5), ..none },
        JointEffects {
            rotor_inertia: Some(number(2e-5) * number(600.0) * number(600.0)),
            coulomb: Coulomb::Sign(number(1.5)),
            stiffness: number(80.0),
            ..none
        },
    ];
    for (body, expected) in model.bodies.iter().zip(expected) {
        assert_eq!(body.effects, expected, "{}", body.joint.name);
    }
}

#[test]
fn zeros_are_no_effects() {
    let zeros = "damping = 0\nfriction = 0\nrotor_inertia = 0.0\ngear_ratio = 50\nspring = { stiffness = 0 }\n";
    let model = model_of("chain.toml", &(include_str!("../files/chain.toml").to_string() + zeros));
    assert_eq!(model.bodies.last().map(|body| body.effects), Some(JointEffects::none()));
}

#[test]
fn dynamics_of_a_urdf_are_used() {
    let urdf = |dynamics: &str| {
        format!(
            r#"<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial>
      <origin xyz="0.1 0 0.2"/><mass value="2.5"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.004"/>
    </inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>{dynamics}
    <limit lower="-2" upper="2" velocity="3" effort="40"/>
  </joint>
</robot>"#
        )
    };
    let (plain, with) = (urdf(""), urdf(r#"<dynamics damping="0.75" friction="0.5"/>"#));
    let tau = |text: &str| {
        let state = [0.3, -1.5, 2.0].map(number);
        inverse_dynamics(&model_of("arm.urdf", text), &state[..1], &state[1..2], &state[2..])[0]
    };
    // 0.75 · (−1.5) + 0.5 · sgn(−1.5)
    assert!((tau(&with) - tau(&plain) - number(-1.625)).abs().to_f64() < 1e-30);
}

#[test]
fn a_chain_in_the_chapters_notation_has_the_same_keys() {
    let chain = include_str!("../files/chain.toml");
    let with = chain.to_string() + "armature = 0.25\ndamping = 2.0\nspring = { stiffness = 3.0, rest = -0.1 }\n";
    let (plain, with) = (model_of("chain.toml", chain), model_of("chain.toml", &with));
    let (n, last) = (plain.nv(), plain.nv() - 1);
    let [q, qd, qdd] = [0.2, 0.7, -1.1].map(|x| vec![number(x); n]);
    let (a, b) = (inverse_dynamics(&plain, &q, &qd, &qdd), inverse_dynamics(&with, &q, &qd, &qdd));
    let added = number(0.25) * qdd[0] + number(2.0) * qd[0] + number(3.0) * (q[0] - number(-0.1));
    assert!((b[last] - a[last] - added).abs().to_f64() < 1e-29);
    assert_eq!(b[..last], a[..last]);
    let inertia = mass_matrix(&with, &q)[n * n - 1] - mass_matrix(&plain, &q)[n * n - 1];
    assert!((inertia - number(0.25)).abs().to_f64() < 1e-30);
}

#[test]
fn the_program_has_the_effects_that_the_second_reading_finds() {
    let (source, options) = (Source::new("arm.toml", ARM), Options::default());
    let generated = compile(&source, &options).unwrap_or_else(|diagnostics: Diagnostics| panic!("{diagnostics}"));
    let verification = verify(&source, &generated, &options, (50, 1), || ()).expect("the reference reads the file");
    for (name, worst) in &verification.functions {
        assert!(worst.error < 1e-14, "{name}: {worst:?}");
    }
}
