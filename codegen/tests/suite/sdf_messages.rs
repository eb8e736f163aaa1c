//! What SDF says and the equations do not have: refused with its line, or listed. Whatever the text, nothing panics.

use crate::malformed::{self, read_spoilt};
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Severity, Source};
use straightline_codegen::model::{load, ModelOptions};

/// A robot of which nothing is said.
const PLAIN: &str = "<sdf version=\"1.9\">
<model name=\"m\">
<link name=\"a\"><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
<link name=\"b\"><pose>0 0 1 0 0 0</pose><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
<frame name=\"f\"/>
<joint name=\"j\" type=\"revolute\"><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz></axis></joint>
</model>
</sdf>
";

fn said(text: &str) -> Diagnostics {
    let (model, diagnostics) = load(&Source::new("robot.sdf", text), &ModelOptions::default());
    assert_eq!(model.is_none(), diagnostics.has_errors(), "{diagnostics}\n{text}");
    diagnostics
}

#[test]
fn nothing_is_said_of_a_plain_robot() {
    assert!(said(PLAIN).is_empty(), "{}", said(PLAIN));
}

/// Each row: what stands in place of what, and the one error that is said, with its line.
#[test]
fn what_changes_the_dynamics_and_is_not_read_is_an_error() {
    let (axis, revolute, of_a) = ("<axis><xyz>0 1 0</xyz></axis>", "type=\"revolute\"", "<link name=\"a\">");
    let (pose, inertial, mass) = ("<pose>0 0 1 0 0 0</pose>", "<inertial><mass>", "<mass>1</mass>");
    let frame = "<frame name=\"f\"/>";
    for (old, new, code, line) in [
        ("1.9", "1.5", "sdf-version", 1),
        ("1.9", "2.0", "sdf-version", 1),
        (" version=\"1.9\"", "", "missing-attribute", 1),
        ("<model name=\"m\">", "<model name=\"m\"><static>1</static>", "not-supported-yet", 2),
        ("<model name=\"m\">", "<model name=\"m\" canonical_link=\"c\">", "frame-unknown", 2),
        ("<model name=\"m\">", "<model name=\"m\" placement_frame=\"c\">", "frame-unknown", 2),
        ("<model name=\"m\">", "<model name=\"m\"><include><uri>model://arm</uri></include>", "not-supported-yet", 2),
        ("</sdf>", "<model name=\"n\"><link name=\"a\"/></model></sdf>", "several-models", 8),
        ("</sdf>", "<world name=\"w\"/><world name=\"w\"/></sdf>", "repeated-element", 8),
        (of_a, "<link name=\"a\"><gravity>0</gravity>", "not-supported-yet", 3),
        (of_a, "<link name=\"a\"><kinematic>true</kinematic>", "not-supported-yet", 3),
        (of_a, "<link name=\"a\"><must_be_base_link>1</must_be_base_link>", "not-supported-yet", 3),
        (of_a, "<link name=\"a\"><velocity_decay><linear>0.1</linear></velocity_decay>", "not-supported-yet", 3),
        (of_a, "<link name=\"a\"><pose relative_to=\"c\"/>", "frame-unknown", 3),
        (of_a, "<link name=\"a\"><pose relative_to=\"a\"/>", "frame-cycle", 3),
        (of_a, "<link name=\"a\"><pose frame=\"f\"/>", "not-supported-yet", 3),
        (frame, "<frame name=\"b\"/>", "duplicate-name", 5),
        (inertial, "<inertial auto=\"true\"><mass>", "not-supported-yet", 3),
        (inertial, "<inertial><fluid_added_mass><xx>1</xx></fluid_added_mass><mass>", "not-supported-yet", 3),
        (inertial, "<inertial><pose relative_to=\"b\">0 0 0 0 0 0</pose><mass>", "not-supported-yet", 3),
        (mass, "<mass>heavy</mass>", "not-a-number", 3),
        (mass, "<mass>-1</mass>", "negative-mass", 3),
        (mass, "<mass>1</mass><mass>2</mass>", "repeated-element", 3),
        ("<ixx>1</ixx>", "", "missing-element", 3),
        (pose, "<pose>0 0 1 0 0</pose>", "wrong-count", 4),
        (pose, "<pose rotation_format=\"quat_xyzw\">0 0 1 0 0 0</pose>", "wrong-count", 4),
        (pose, "<pose rotation_format=\"quat_xyzw\">0 0 1 0 0 0 0</pose>", "zero-axis", 4),
        (pose, "<pose rotation_format=\"quat_wxyz\">0 0 1 0 0 0</pose>", "unknown-word", 4),
        (pose, "<pose degrees=\"maybe\">0 0 1 0 0 0</pose>", "unknown-word", 4),
        (pose, "<pose>0 0 1 0 0 0</pose><pose/>", "repeated-element", 4),
        (frame, "<frame name=\"f\" attached_to=\"c\"/>", "frame-unknown", 5),
        (frame, "<frame name=\"f\" attached_to=\"f\"/>", "frame-cycle", 5),
        (revolute, "type=\"spherical\"", "unknown-word", 6),
        (revolute, "type=\"universal\"", "missing-element", 6),
        (revolute, "type=\"screw\"", "missing-element", 6),
        (revolute, "type=\"screw\"><screw_thread_pitch>0</screw_thread_pitch", "not-supported-yet", 6),
        (revolute, "type=\"gearbox\"", "missing-element", 6),
        ("<parent>a</parent>", "<parent>c</parent>", "frame-unknown", 6),
        ("<parent>a</parent>", "<parent>b</parent>", "cycle", 6),
        ("<parent>a</parent>", "", "missing-element", 6),
        ("<child>b</child>", "<child>world</child>", "frame-unknown", 6),
        ("<child>b</child>", "<child>b</child><pose relative_to=\"j\"/>", "frame-cycle", 6),
        (axis, "", "missing-element", 6),
        (axis, "<axis/>", "missing-element", 6),
        (axis, "<axis><xyz>0 0 0</xyz></axis>", "zero-axis", 6),
        (axis, "<axis><xyz expressed_in=\"c\">0 0 1</xyz></axis>", "frame-unknown", 6),
        (axis, "<axis><xyz>0 0 1</xyz><use_parent_model_frame>1</use_parent_model_frame></axis>", "not-supported-yet", 6),
        (axis, "<axis><xyz>0 0 1</xyz><mimic joint=\"a\"/></axis>", "coupling-joint", 6),
        (axis, "<axis><xyz>0 0 1</xyz><mimic/></axis>", "missing-attribute", 6),
        (axis, "<axis><xyz>0 0 1</xyz><dynamics><damping>-1</damping></dynamics></axis>", "negative-effect", 6),
        (
            axis,
            "<axis><xyz>0 0 1</xyz></axis><physics><simbody><must_be_loop_joint>1</must_be_loop_joint></simbody></physics>",
            "not-supported-yet",
            6,
        ),
        (
            "</model>",
            "<joint name=\"k\" type=\"ball\"><parent>a</parent><child>b</child></joint></model>",
            "loops-depend",
            7,
        ),
        ("</model>", "<model name=\"n\"><link name=\"l\"/></model></model>", "two-roots", 7),
    ] {
        let text = PLAIN.replacen(old, new, 1);
        assert_ne!(text, PLAIN, "{old}");
        let diagnostics = said(&text);
        let errors: Vec<(&str, usize)> = diagnostics
            .iter()
            .filter(|d| d.severity == Severity::Error)
            .map(|d| (d.code, d.place.as_ref().map_or(0, |place| place.line)))
            .collect();
        assert_eq!(errors, [(code, line)], "{new}\n{diagnostics}");
    }
}

/// The format knows no property of a ball joint but where it stands, and engines of Gazebo read none (`ConstructJoint` of gz-physics).
#[test]
fn what_an_axis_says_of_a_ball_joint_is_listed() {
    let ball = PLAIN.replace("type=\"revolute\"", "type=\"ball\"");
    assert!(said(&ball).is_empty(), "{}", said(&ball));
    let axis = "<axis><xyz>0 1 0</xyz><limit><lower>-1</lower></limit><dynamics><damping>1</damping></dynamics></axis>";
    let text = ball.replace("<axis><xyz>0 1 0</xyz></axis>", axis);
    assert!(said(&text).is_empty(), "{}", said(&text));
    let description = description::read(&Source::new("robot.sdf", text), &mut Diagnostics::new()).expect("it is read");
    assert!(
        description.ignored.iter().any(|ignored| ignored.what == "axis of a ball joint"),
        "{:?}",
        description.ignored
    );
}

#[test]
fn an_inertia_that_is_left_out_is_that_of_the_format_with_a_warning() {
    for (old, new) in [
        ("<mass>1</mass>", ""),
        ("<inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia>", ""),
        ("<inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>", ""),
    ] {
        let text = PLAIN.replacen(old, new, 1);
        assert_eq!(said(&text).iter().map(|d| d.code).collect::<Vec<_>>(), ["default-inertial"], "{text}");
        let read = |text: &str| load(&Source::new("robot.sdf", text), &ModelOptions::default()).0.expect("it is read");
        let inertias = [PLAIN, &text]
            .map(|text| read(text).bodies.iter().map(|body| format!("{:?}", body.inertia)).collect::<Vec<_>>());
        assert_eq!(inertias[0], inertias[1], "{text}");
    }
}

#[test]
fn what_the_dynamics_do_not_need_is_listed() {
    let text = PLAIN
        .replacen("<link name=\"a\">", "<link name=\"a\"><visual name=\"v\"/><visual name=\"w\"/><collision name=\"c\"/><sensor/>", 1)
        .replace("</model>", "<plugin name=\"p\"/><self_collide>1</self_collide></model>")
        .replace("<model name=\"m\">", "<world name=\"w\"><light/><model name=\"ground\"><static>true</static><link name=\"l\"/></model><model name=\"m\">")
        .replace("</sdf>", "</world></sdf>");
    let mut diagnostics = Diagnostics::new();
    let description = description::read(&Source::new("robot.sdf", text), &mut diagnostics).expect("it is read");
    assert!(diagnostics.is_empty(), "{diagnostics}");
    let ignored: Vec<(&str, usize)> = description.ignored.iter().map(|i| (i.what.as_str(), i.count)).collect();
    let expected = ["light", "plugin", "self_collide", "static model", "visual", "collision", "sensor"];
    assert_eq!(ignored, expected.map(|what| (what, if what == "visual" { 2 } else { 1 })));
}

/// Text of most that is read.
const RICH: &str = "<?xml version='1.0'?><!-- a robot --><sdf version='1.11'><world name='w'><gravity>0 0 -9</gravity><frame name='o'><pose>1 2 3 0 0 0</pose></frame>
<model name='m' canonical_link='a' placement_frame='f'><pose degrees='true' relative_to='o'>1 2 3 90 0 0</pose>
<link name='a'><inertial><mass>1</mass><pose>0 0 1 0 0 0</pose><inertia><ixx>1</ixx><ixy>0</ixy><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
<frame name='f' attached_to='n::b'><pose relative_to='a' rotation_format='quat_xyzw'>0 0 1 0 0 1 1</pose></frame>
<model name='n'><pose>1 0 0 0 0 0</pose><link name='b'><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
<link name='c'><pose relative_to='b'>1 0 0 0 0 0</pose><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
<joint name='k' type='prismatic'><parent>b</parent><child>c</child><pose relative_to='__model__'>1 1 1 1 1 1</pose><axis><xyz>0 0 1</xyz></axis></joint></model>
<joint name='j' type='universal'><parent>world</parent><child>a</child><axis><xyz>1 0 0</xyz></axis><axis2><xyz expressed_in='n'>0 1 0</xyz></axis2></joint>
<joint name='l' type='revolute'><parent>a</parent><child>f</child><axis><xyz expressed_in='n::b'>0 1 0</xyz><limit><lower>-1e16</lower><upper>2</upper></limit>
<dynamics><damping>1</damping><spring_stiffness>1</spring_stiffness></dynamics><mimic joint='j' axis='axis2'><multiplier>2</multiplier></mimic></axis></joint>
<joint name='s' type='screw'><parent>n::c</parent><child>d</child><screw_thread_pitch>1</screw_thread_pitch><axis><xyz>0 0 1</xyz></axis></joint>
<link name='d'><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link></model></world></sdf>";

const ODD: [&str; 21] = [
    "nan",
    "-1",
    "0",
    "1e308",
    "1e-308",
    "inf",
    "\"",
    "true",
    "ball",
    "world",
    "",
    "model",
    "frame",
    "__model__",
    "a",
    "n::b",
    "é",
    "<",
    "/>",
    "gearbox",
    "1.6",
];

#[test]
fn spoilt_texts_do_not_panic() {
    assert!(!said(RICH).has_errors(), "{}", said(RICH));
    read_spoilt("robot.sdf", RICH, &ODD, 0, 800);
}

#[test]
#[ignore = "slow proof: fifty thousand texts"]
fn slow_proof_that_fifty_thousand_spoilt_texts_do_not_panic() {
    read_spoilt("robot.sdf", RICH, &ODD, 1_000_000, 50_000);
}

#[test]
fn no_number_is_read_without_meaning() {
    let changed = malformed::no_number_is_read_without_meaning("robot.sdf", RICH, &['>', ' ', '-'], &["version='"]);
    assert!(changed > 60, "{changed}");
}

#[test]
fn deep_models_and_long_chains_of_frames_end_soon() {
    let (depth, long) = (20_000, 30_000);
    let models = format!("{}{}", "<model name=\"n\">".repeat(depth), "</model>".repeat(depth));
    let frames: String = (1..long)
        .map(|k| format!("<frame name=\"g{k}\"><pose relative_to=\"g{}\">1 0 0 0 0 0</pose></frame>", k - 1))
        .collect();
    for more in [models, format!("<frame name=\"g0\"/>{frames}")] {
        let start = std::time::Instant::now();
        let diagnostics = said(&PLAIN.replace("</model>", &format!("{more}</model>")));
        assert!(diagnostics.has_errors() && start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
    }
}
