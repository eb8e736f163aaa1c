//! Joints of an SDF that close loops: links that are the children of two joints, as legs of Cassie have them.

use crate::robots::Random;
use straightline_codegen::diagnostic::{Severity, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, Function, Options};
use straightline_core::algorithms::{inverse_dynamics, mass_matrix};
use straightline_core::model::Model;
use straightline_core::Dd;

fn model_of(name: &str, text: &str) -> Model<Dd> {
    let (model, diagnostics) = load(&Source::new(name, text), &ModelOptions::default());
    model.unwrap_or_else(|| panic!("{diagnostics}\n{text}"))
}

/// The compiled robot gives the torques of the second author, who reads the file by itself.
fn verified(text: &str) {
    let source = Source::new("robot.sdf", text);
    let options = Options { functions: vec![Function::InverseDynamics, Function::MassMatrix], ..Options::default() };
    let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{}", errors.render()));
    let verification = verify(&source, &generated, &options, (3, 1), || ()).unwrap_or_else(|why| panic!("{why}"));
    assert!(verification.passes(), "{:?}", verification.functions);
}

fn errors_of(text: &str) -> Vec<(&'static str, usize)> {
    let (_, diagnostics) = load(&Source::new("robot.sdf", text), &ModelOptions::default());
    let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error);
    errors.map(|d| (d.code, d.place.as_ref().map_or(0, |place| place.line))).collect()
}

/// Both robots have the same joints, H and torques where their loops are closed.
fn same(sdf: &Model<Dd>, mjcf: &Model<Dd>) {
    let names = |model: &Model<Dd>| model.tree_joints().iter().map(|joint| joint.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(sdf), names(mjcf));
    assert_eq!(sdf.nv(), mjcf.nv());
    let q = &sdf.closure.home;
    let rates = |phase: f64| (0..sdf.nv()).map(|i| Dd::from((1.3 * i as f64 + phase).sin())).collect::<Vec<_>>();
    let of = |m: &Model<Dd>| [mass_matrix(m, q), inverse_dynamics(m, q, &rates(0.7), &rates(1.9))];
    for (a, b) in of(sdf).iter().zip(&of(mjcf)) {
        let scale = a.iter().fold(0.0f64, |most, x| most.max(x.to_f64().abs()));
        for (a, b) in a.iter().zip(b) {
            assert!((*a - *b).to_f64().abs() <= 1e-14 * scale, "{} and {}", a.to_f64(), b.to_f64());
        }
    }
}

fn link(name: &str, pose: &str, com: &str) -> String {
    format!(
        "<link name=\"{name}\"><pose>{pose}</pose><inertial><pose>{com} 0 0 0</pose><mass>1.5</mass><inertia><ixx>0.02</ixx><iyy>0.03</iyy><izz>0.025</izz>\
         <ixy>0.001</ixy><ixz>-0.002</ixz><iyz>0.003</iyz></inertia></inertial></link>\n"
    )
}

fn joint(name: &str, kind: &str, [parent, child]: [&str; 2], rest: &str) -> String {
    format!("<joint name=\"{name}\" type=\"{kind}\"><parent>{parent}</parent><child>{child}</child>{rest}</joint>\n")
}

fn robot(parts: &[String]) -> String {
    format!("<sdf version=\"1.9\"><model name=\"robot\">\n{}</model></sdf>\n", parts.concat())
}

const ABOUT_Y: &str = "<axis><xyz>0 1 0</xyz></axis>";
const MASS: &str = "mass=\"1.5\" fullinertia=\"0.02 0.03 0.025 0.001 -0.002 0.003\"";

/// Crank, coupler and rocker; the rocker is the child of the coupler's joint and of one on the world.
fn four_bar(closing: &str) -> String {
    robot(&[
        link("crank", "0 0 0 0 0 0", "0.05 0.01 0.1"),
        link("coupler", "0 0 0.2 0 0 0", "0.2 -0.02 0.03"),
        link("rocker", "0.5 0 0.3 0 0 0", "0.01 0 -0.1"),
        joint("drive", "revolute", ["world", "crank"], ABOUT_Y),
        joint("knee", "revolute", ["crank", "coupler"], ABOUT_Y),
        joint("elbow", "revolute", ["coupler", "rocker"], ABOUT_Y),
        closing.to_string(),
    ])
}

#[test]
fn a_hinge_closes_a_loop_in_its_plane() {
    let on_the_world = |axis: &str| {
        joint("stand", "revolute", ["world", "rocker"], axis).replace("<axis>", "<pose>0.1 0 -0.3 0 0 0</pose><axis>")
    };
    let sdf = model_of("robot.sdf", &four_bar(&on_the_world(ABOUT_Y)));
    let mjcf = format!(
        "<mujoco><option gravity=\"0 0 -9.81\"/><worldbody><body name=\"crank\"><joint name=\"drive\" axis=\"0 1 0\"/><inertial pos=\"0.05 0.01 0.1\" {MASS}/>
         <body name=\"coupler\" pos=\"0 0 0.2\"><joint name=\"knee\" axis=\"0 1 0\"/><inertial pos=\"0.2 -0.02 0.03\" {MASS}/>
         <body name=\"rocker\" pos=\"0.5 0 0.1\"><joint name=\"elbow\" axis=\"0 1 0\"/><inertial pos=\"0.01 0 -0.1\" {MASS}/></body></body></body></worldbody>
         <equality><connect name=\"stand\" body1=\"rocker\" anchor=\"0.1 0 -0.3\"/></equality></mujoco>"
    );
    assert_eq!(sdf.nv(), 1);
    verified(&four_bar(&on_the_world(ABOUT_Y)));
    same(&sdf, &model_of("robot.xml", &mjcf));
    // the other way round it is the same hinge
    let turned = on_the_world("<axis><xyz>0 -2 0</xyz></axis>");
    assert_eq!(model_of("robot.sdf", &four_bar(&turned)), sdf);
}

/// A shin and a rod on a thigh: the rod hangs on a ball joint, and the heel is the child of both. The ball joint closes the loop, and the rod hangs on the heel.
#[test]
fn a_ball_joint_closes_a_loop_in_space_whichever_joint_comes_first() {
    let parts = |rod: &str| {
        robot(&[
            link("thigh", "0 0 1 0 0 0", "0.02 0.01 -0.2"),
            link("shin", "0 0 0.6 0 0 0", "0.01 0.03 -0.2"),
            link("tarsus", "0.05 0 0.35 0 0 0", "0.02 0.01 -0.1"),
            link("heel", "0 0 0.2 0 0 0", "-0.05 0.02 0"),
            link("rod", "-0.1 0.05 0.25 0 0 0", "0.01 0 0.3"),
            joint("hip", "revolute", ["world", "thigh"], "<axis><xyz>1 0 0</xyz></axis>"),
            joint("knee", "revolute", ["thigh", "shin"], ABOUT_Y),
            joint("ankle", "revolute", ["shin", "tarsus"], ABOUT_Y),
            joint(
                "spring",
                "revolute",
                ["tarsus", "heel"],
                "<axis><xyz>0 1 0</xyz><dynamics><spring_stiffness>900</spring_stiffness></dynamics></axis>",
            ),
            rod.to_string(),
        ])
    };
    let ball = joint("hang", "ball", ["thigh", "rod"], "<pose>0.05 0.02 0.7 0 0 0</pose><axis><xyz>0 0 1</xyz></axis>");
    let hinge =
        joint("pin", "revolute", ["rod", "heel"], "<pose>-0.1 0.05 0.05 0 0 0</pose><axis><xyz>0.6 0.8 0</xyz></axis>");
    let sdf = model_of("robot.sdf", &parts(&(ball.clone() + &hinge)));
    assert_eq!(sdf.nv(), 2);
    verified(&parts(&(ball.clone() + &hinge)));
    // the rod as the child of the heel, about the axis turned round
    let mjcf = format!(
        "<mujoco><option gravity=\"0 0 -9.81\"/><worldbody><body name=\"thigh\" pos=\"0 0 1\"><joint name=\"hip\" axis=\"1 0 0\"/><inertial pos=\"0.02 0.01 -0.2\" {MASS}/>
         <body name=\"shin\" pos=\"0 0 -0.4\"><joint name=\"knee\" axis=\"0 1 0\"/><inertial pos=\"0.01 0.03 -0.2\" {MASS}/>
         <body name=\"tarsus\" pos=\"0.05 0 -0.25\"><joint name=\"ankle\" axis=\"0 1 0\"/><inertial pos=\"0.02 0.01 -0.1\" {MASS}/>
         <body name=\"heel\" pos=\"-0.05 0 -0.15\"><joint name=\"spring\" axis=\"0 1 0\" stiffness=\"900\"/><inertial pos=\"-0.05 0.02 0\" {MASS}/>
         <body name=\"rod\" pos=\"-0.1 0.05 0.05\"><joint name=\"pin\" axis=\"-0.6 -0.8 0\"/><inertial pos=\"0.01 0 0.3\" {MASS}/></body></body></body></body></body></worldbody>
         <equality><connect name=\"hang\" body1=\"rod\" body2=\"thigh\" anchor=\"0.05 0.02 0.7\"/></equality></mujoco>"
    );
    same(&sdf, &model_of("robot.xml", &mjcf));
    same(&model_of("robot.sdf", &parts(&(hinge + &ball))), &sdf);
}

#[test]
fn what_no_points_can_say_closes_no_loop() {
    let closing = |kind: &str, axis: &str| four_bar(&joint("stand", kind, ["world", "rocker"], axis));
    for (text, expected) in [
        (closing("revolute", "<axis><xyz>1 0 0</xyz></axis>"), ("loop-locked", 8)),
        (closing("prismatic", "<axis><xyz>1 0 0</xyz></axis>"), ("two-parents", 8)),
        (
            closing("revolute", "<axis><xyz>0 1 0</xyz><dynamics><damping>1</damping></dynamics></axis>"),
            ("not-supported-yet", 8),
        ),
    ] {
        assert_eq!(errors_of(&text), [expected], "{text}");
    }
}

/// Five links, joined at random by joints of every kind, to themselves and to the world, too: a robot, or else an error.
#[test]
fn however_links_are_joined_there_is_a_robot_or_an_error() {
    let mut robots = 0;
    for seed in 0..80 {
        let mut random = Random(seed);
        let names = ["world", "a", "b", "c", "d", "e"];
        let mut parts: Vec<String> = (1..6)
            .map(|k| link(names[k], &format!("0.{k} 0.1 {} 0.{k} 0 0.3", 0.1 * k as f64), "0.02 0.01 0.1"))
            .collect();
        for k in 0..4 + random.below(4) {
            let kind = ["revolute", "ball", "revolute", "fixed", "prismatic", "universal", "ball"][random.below(7)];
            let axis = [ABOUT_Y, "<axis><xyz>1 0 1</xyz></axis>"][random.below(2)];
            let axes =
                if kind == "universal" { axis.to_string() + "<axis2><xyz>0 0 1</xyz></axis2>" } else { axis.into() };
            let ends = [names[random.below(6)], names[1 + random.below(5)]];
            parts.push(joint(&format!("j{k}"), kind, ends, &axes));
        }
        let text = robot(&parts);
        let (model, diagnostics) = load(&Source::new("robot.sdf", text.clone()), &ModelOptions::default());
        assert_eq!(model.is_none(), diagnostics.has_errors(), "seed {seed}: {diagnostics}\n{text}");
        robots += usize::from(model.is_some());
    }
    assert!(robots > 0, "none of them is a robot");
}
