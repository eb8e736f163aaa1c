//! What MJCF says and the equations do not have: refused with its line, or listed. Whatever the text, nothing panics.

use crate::malformed::{self, read_spoilt};
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Severity, Source};
use straightline_codegen::model::{load, ModelOptions};

/// A robot of which nothing is said.
const PLAIN: &str = "<mujoco>
<worldbody>
<body name=\"a\"><joint name=\"j\"/><joint name=\"k\" axis=\"1 0 0\"/><geom size=\"0.1\" pos=\"0 0 1\"/></body>
</worldbody>
</mujoco>
";

fn said(text: &str) -> Diagnostics {
    let (model, diagnostics) = load(&Source::new("robot.xml", text), &ModelOptions::default());
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
    let joint = "<joint name=\"j\"/>";
    let geom = "<geom size=\"0.1\" pos=\"0 0 1\"/>";
    let world = "</worldbody>";
    for (old, new, code, line) in [
        (joint, "<joint name=\"j\" type=\"universal\"/>", "unknown-word", 3),
        (joint, "<joint name=\"j\" axis=\"0 0 0\"/>", "zero-axis", 3),
        (joint, "<joint name=\"j\" class=\"legs\"/>", "unknown-word", 3),
        (joint, "<joint name=\"j\" damping=\"1 2\"/>", "not-supported-yet", 3),
        (joint, "<joint name=\"j\" springdamper=\"0.1 -1\"/>", "no-oscillation", 3),
        (joint, "<joint name=\"j\" armature=\"-1\"/>", "negative-effect", 3),
        (joint, "<joint name=\"j\" pos=\"1 2\"/>", "wrong-count", 3),
        (joint, "<joint name=\"k\"/>", "duplicate-name", 3),
        (joint, "<joint name=\"j\"/><freejoint/>", "not-supported-yet", 3),
        (joint, "<frame pos=\"0 0 1\"><joint name=\"j\"/></frame>", "not-supported-yet", 3),
        (joint, "<joint name=\"j\"/><composite/>", "not-supported-yet", 3),
        (joint, "<joint name=\"j\"/><plugin plugin=\"p\"/>", "not-supported-yet", 3),
        (joint, "<joint name=\"j\"/><inertial pos=\"0 0 0\" diaginertia=\"1 1 1\"/>", "missing-attribute", 3),
        (joint, "<joint name=\"j\"/><inertial pos=\"0 0 0\" mass=\"-2\" diaginertia=\"1 1 1\"/>", "negative-mass", 3),
        (joint, "<joint name=\"j\"/><body quat=\"0 0 0 0\"/>", "zero-axis", 3),
        ("<body name=\"a\">", "<body name=\"a\" mocap=\"true\">", "not-supported-yet", 3),
        (joint, "<joint name=\"j\"/><body gravcomp=\"1\"/>", "not-supported-yet", 3),
        (joint, "<joint name=\"j\"/><body euler=\"1 2 3\" quat=\"1 0 0 0\"/>", "written-twice", 3),
        (geom, "<geom type=\"capsule\" size=\"0.1\"/>", "geom-size", 3),
        (geom, "<geom type=\"capsule\" size=\"0.1\" fromto=\"1 2 3 1 2 3\"/>", "geom-size", 3),
        (geom, "<geom size=\"0.1\" fromto=\"0 0 0 1 0 0\"/>", "geom-size", 3),
        (geom, "<geom type=\"mesh\" mesh=\"hull\"/>", "unknown-word", 3),
        (geom, "<geom type=\"mesh\"/>", "missing-attribute", 3),
        (geom, "<geom size=\"1\" shellinertia=\"true\"/>", "not-supported-yet", 3),
        (
            world,
            "<body><freejoint/><geom size=\"1\"/><body><joint name=\"m\"/><geom size=\"1\"/></body></body></worldbody>",
            "not-supported-yet",
            4,
        ),
        (world, "<attach prefix=\"left_\"/></worldbody>", "missing-attribute", 4),
        (world, "<attach model=\"arm\"/></worldbody>", "unknown-word", 4),
        (world, "<attach model=\"m\"/></worldbody><asset><model name=\"m\"/></asset>", "missing-attribute", 4),
        (
            world,
            "<attach model=\"m\"/></worldbody><asset><model name=\"m\" file=\"no such file.xml\"/></asset>",
            "include-failed",
            4,
        ),
        (world, "</worldbody><option density=\"1.2\"/>", "not-supported-yet", 4),
        (
            world,
            "</worldbody><default><joint stiffness=\"1\"/></default><option><flag spring=\"disable\"/></option>",
            "not-supported-yet",
            4,
        ),
        (
            world,
            "</worldbody><default><default class=\"legs\"/><default class=\"legs\"/></default>",
            "duplicate-name",
            4,
        ),
        (world, "</worldbody><compiler coordinate=\"global\"/>", "not-supported-yet", 4),
        (world, "</worldbody><compiler eulerseq=\"xyw\"/>", "unknown-word", 4),
        (world, "</worldbody><include/>", "missing-attribute", 4),
        (world, "</worldbody><include file=\"no such file.xml\"/>", "include-failed", 4),
        (world, "</worldbody><equality><weld body1=\"a\"/></equality>", "loops-depend", 4),
        (world, "</worldbody><equality><weld body2=\"a\"/></equality>", "missing-attribute", 4),
        (world, "</worldbody><equality><weld body1=\"none\"/></equality>", "unknown-link", 4),
        (world, "</worldbody><equality><joint joint1=\"j\" joint2=\"l\"/></equality>", "drive-joint", 4),
        (
            world,
            "</worldbody><equality><joint joint1=\"j\" joint2=\"k\" polycoef=\"0 1 2 0 0\"/></equality>",
            "not-supported-yet",
            4,
        ),
        (world, "</worldbody><tendon><fixed stiffness=\"1\"/></tendon>", "not-supported-yet", 4),
        (world, "</worldbody><actuator><motor joint=\"j\" armature=\"1\"/></actuator>", "not-supported-yet", 4),
        (world, "</worldbody><deformable><flex/></deformable>", "not-supported-yet", 4),
    ] {
        let diagnostics = said(&PLAIN.replace(old, new));
        let errors: Vec<(&str, usize)> = diagnostics
            .iter()
            .filter(|d| d.severity == Severity::Error)
            .map(|d| (d.code, d.place.as_ref().map_or(0, |place| place.line)))
            .collect();
        assert_eq!(errors, [(code, line)], "{new}\n{diagnostics}");
    }
}

#[test]
fn a_misspelt_gravity_is_a_warning() {
    let diagnostics = said(&PLAIN.replace("</worldbody>", "</worldbody><option gravty=\"0 0 0\"/>"));
    assert_eq!(diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["unknown-attribute"], "{diagnostics}");
}

#[test]
fn a_default_that_is_wrong_is_complained_of_once() {
    let text = PLAIN.replace("<worldbody>", "<default><joint damping=\"high\"/></default><worldbody>");
    let diagnostics = said(&text);
    assert_eq!(diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["not-a-number"], "{diagnostics}");
}

#[test]
fn what_the_dynamics_do_not_need_is_listed() {
    let text = PLAIN.replace(
        "</worldbody>",
        "<body name=\"swings\"><joint type=\"ball\" range=\"0 60\"/><geom size=\"0.1\"/></body>
         <light/><camera/><camera/></worldbody><sensor><gyro/></sensor><contact/><keyframe/><visual/><tendon><spatial/></tendon>
         <actuator><adhesion body=\"a\"/></actuator>",
    );
    let mut diagnostics = Diagnostics::new();
    let description = description::read(&Source::new("robot.xml", text), &mut diagnostics).expect("it is read");
    assert!(diagnostics.is_empty(), "{diagnostics}");
    let ignored: Vec<(&str, usize)> = description.ignored.iter().map(|i| (i.what.as_str(), i.count)).collect();
    let expected = [
        "light",
        "camera",
        "range of a ball joint",
        "spatial tendon",
        "actuator adhesion",
        "sensor",
        "contact",
        "keyframe",
        "visual",
    ];
    assert_eq!(ignored, expected.map(|what| (what, if what == "camera" { 2 } else { 1 })));
}

#[test]
fn a_model_that_attaches_itself_is_refused() {
    let folder = std::env::temp_dir().join(format!("straightline-mjcf-{}-attached", std::process::id()));
    std::fs::create_dir_all(&folder).expect("there is room for a test");
    let path = folder.join("robot.xml");
    let attach =
        "<attach model=\"self\" prefix=\"a_\"/></worldbody><asset><model name=\"self\" file=\"robot.xml\"/></asset>";
    let text = PLAIN.replace("</worldbody>", attach);
    std::fs::write(&path, &text).expect("it can be written");
    let (model, diagnostics) = load(&Source::new(&path.to_string_lossy(), text), &ModelOptions::default());
    assert!(model.is_none());
    assert_eq!(diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["include-failed"], "{diagnostics}");
    // a body that is not there
    std::fs::write(folder.join("arm.xml"), PLAIN).expect("it can be written");
    let attach = "<attach model=\"arm\" prefix=\"l_\" body=\"b\"/></worldbody><asset><model name=\"arm\" file=\"arm.xml\"/></asset>";
    let text = PLAIN.replace("</worldbody>", attach);
    let (_, diagnostics) = load(&Source::new(&path.to_string_lossy(), text), &ModelOptions::default());
    let said = diagnostics.to_string();
    assert!(said.contains("body of <attach>: `b` is unknown") && said.contains("known: a"), "{said}");
    std::fs::remove_dir_all(&folder).expect("it was made here");
}

/// What a flag switches off and the file does not have is not missed.
#[test]
fn flags_that_change_nothing_are_read() {
    for flag in ["constraint", "equality", "frictionloss", "passive", "spring", "damper"] {
        let option = format!("</worldbody><option><flag {flag}=\"disable\"/></option>");
        assert!(said(&PLAIN.replace("</worldbody>", &option)).is_empty(), "{flag}");
    }
}

#[test]
fn a_file_that_includes_itself_is_refused() {
    let folder = std::env::temp_dir().join(format!("straightline-mjcf-{}-cycle", std::process::id()));
    std::fs::create_dir_all(&folder).expect("there is room for a test");
    let path = folder.join("robot.xml");
    let text = PLAIN.replace("</worldbody>", "</worldbody><include file=\"robot.xml\"/>");
    std::fs::write(&path, &text).expect("it can be written");
    let (model, diagnostics) = load(&Source::new(&path.to_string_lossy(), text), &ModelOptions::default());
    assert!(model.is_none());
    assert_eq!(diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["include-failed"], "{diagnostics}");
    std::fs::remove_dir_all(&folder).expect("it was made here");
}

/// Text of most that is read.
const RICH: &str = "<?xml version=\"1.0\"?><!-- a robot --><mujoco model=\"r\"><compiler eulerseq=\"zXy\" settotalmass=\"3\" boundinertia=\"1\"/>
<option gravity=\"0 0 -9\"><flag gravity=\"enable\"/></option><default><joint damping=\"1\"/><default class=\"c\"><geom mass=\"1\"/></default></default>
<asset><mesh name=\"m\" file=\"m.stl\"/></asset><worldbody><body childclass=\"c\" pos=\"1 2 3\" euler=\"1 2 3\"><joint name=\"j\" range=\"-1 1\" ref=\"3\"/>
<joint type=\"slide\" axis=\"1 2 3\" name=\"k\"/><frame zaxis=\"1 2 3\"><geom type=\"box\" size=\"1 2 3\"/><body axisangle=\"1 2 3 4\"><joint name=\"l\"/>
<inertial pos=\"0 0 0\" mass=\"1\" fullinertia=\"1 1 1 0 0 0\"/><site name=\"s\" xyaxes=\"1 2 0 -1 1 3\"/></body></frame><geom size=\".1\" fromto=\"0 0 0 1 1 1\"
type=\"capsule\"/></body></worldbody><tendon><fixed name=\"t\"><joint joint=\"j\" coef=\"1\"/><joint joint=\"k\" coef=\"2\"/></fixed></tendon>
<equality><joint joint1=\"l\" joint2=\"k\" polycoef=\"0 1\"/><tendon tendon1=\"t\"/></equality><actuator><motor joint=\"j\" ctrlrange=\"-1 1\"/></actuator></mujoco>";

const ODD: [&str; 17] = [
    "nan", "-1", "0", "1e308", "1e-308", "inf", "\"", "true", "ball", "free", "", "body", "frame", "include", "é", "<",
    "/>",
];

#[test]
fn spoilt_texts_do_not_panic() {
    assert!(!said(RICH).has_errors(), "{}", said(RICH));
    read_spoilt("robot.xml", RICH, &ODD, 0, 600);
}

#[test]
#[ignore = "slow proof: fifty thousand texts"]
fn slow_proof_that_fifty_thousand_spoilt_texts_do_not_panic() {
    read_spoilt("robot.xml", RICH, &ODD, 1_000_000, 50_000);
}

#[test]
fn no_number_is_read_without_meaning() {
    let changed = malformed::no_number_is_read_without_meaning(
        "robot.xml",
        RICH,
        &['"', ' ', '-', '.'],
        &["version=\"", "version=\"1."],
    );
    assert!(changed > 40, "{changed}");
}

#[test]
fn deep_bodies_and_frames_are_read_without_recursion() {
    let depth = 20_000;
    let bodies = format!("{}{}", "<body><geom size=\"1\"/>".repeat(depth), "</body>".repeat(depth));
    let frames = format!("{}{}", "<frame pos=\"0 0 1\">".repeat(depth), "</frame>".repeat(depth));
    let _ = said(&PLAIN.replace("</worldbody>", &format!("{bodies}{frames}</worldbody>")));
}
