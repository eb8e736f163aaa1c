//! Real and awkward robot files load, and mean what they say.

use std::path::PathBuf;
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Severity, Source};
use straightline_codegen::model::{load, special_angles, FrameOption, ModelOptions};
use straightline_core::model::{Frame, JointKind, Model};
use straightline_core::spatial::{Mat3, Vec3};
use straightline_core::Dd;

const AWKWARD: &str = include_str!("../files/awkward.urdf");
const ARM: &str = include_str!("../files/arm.toml");
const CHAIN: &str = include_str!("../files/chain.toml");
const SDF: &str = include_str!("../files/arm.sdf");
const DH: &str = include_str!("../files/dh.toml");

fn model_of(path: &str, text: &str, options: &ModelOptions) -> (Model<Dd>, Diagnostics) {
    let (model, diagnostics) = load(&Source::new(path, text), options);
    (model.unwrap_or_else(|| panic!("{path} does not load:\n{diagnostics}")), diagnostics)
}

fn codes(diagnostics: &Diagnostics) -> Vec<&'static str> {
    diagnostics.iter().map(|d| d.code).collect()
}

fn vector(v: Vec3<Dd>) -> [f64; 3] {
    v.to_array().map(Dd::to_f64)
}

fn matrix(m: &Mat3<Dd>) -> [[f64; 3]; 3] {
    m.rows.map(|row| row.map(Dd::to_f64))
}

/// The robot files of a folder of the workspace.
fn files(folder: &str) -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(folder);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("the folder can be read").path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "urdf" || e == "toml"));
    paths.sort();
    paths
}

/// Drake's rotors, with a prefix that is declared and with one that is not, as TOML has them.
#[test]
fn rotors_of_transmissions_are_read() {
    let urdf = |top: &str, transmission: &str| {
        format!(
            "<robot name=\"r\"{top}><link name=\"b\"/><link name=\"l\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>\
             <joint name=\"j\" type=\"continuous\"><parent link=\"b\"/><child link=\"l\"/></joint>{transmission}</robot>"
        )
    };
    let actuator =
        "<actuator name=\"m\"><drake:rotor_inertia value=\"2e-4\"/><drake:gear_ratio value=\"50\"/></actuator>";
    let transmission = format!("<transmission><type>transmission_interface/SimpleTransmission</type><joint name=\"j\"><hardwareInterface>effort</hardwareInterface></joint>{actuator}</transmission>");
    for top in ["", " xmlns:drake=\"http://drake.mit.edu\""] {
        let (model, said) = model_of("drake.urdf", &urdf(top, &transmission), &ModelOptions::default());
        let rotor = model.bodies[0].effects.rotor_inertia.expect("it has one").to_f64();
        assert!((rotor - 0.5).abs() < 1e-15 && codes(&said).is_empty(), "{rotor} {said}");
    }
    let without = transmission.replace(actuator, "");
    let (model, _) = model_of("plain.urdf", &urdf("", &without), &ModelOptions::default());
    assert_eq!(model.bodies[0].effects.rotor_inertia, None);
    for (old, new, code) in [
        ("name=\"j\"", "name=\"i\"", "unknown-word"),
        ("<joint name", "<joint name=\"j\"/><joint name", "not-supported-yet"),
        ("2e-4", "heavy", "not-a-number"),
    ] {
        let source = Source::new("drake.urdf", urdf("", &transmission.replacen(old, new, 1)));
        let (model, said) = load(&source, &ModelOptions::default());
        assert!(model.is_none() && codes(&said).contains(&code), "{new}: {said}");
    }
}

#[test]
fn published_robots_load() {
    for folder in ["robots/descriptions", "generated_tests/count_robots"] {
        for path in files(folder) {
            let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("").to_string();
            let source = Source::from_bytes(&name, std::fs::read(&path).expect("the file can be read"));
            for floating_base in [false, true] {
                let options = ModelOptions { floating_base, ..ModelOptions::default() };
                if floating_base && name.starts_with("chapter") {
                    continue;
                }
                let (model, diagnostics) = load(&source, &options);
                let model = model.unwrap_or_else(|| panic!("{name}:\n{diagnostics}"));
                assert!(model.nv() >= 2, "{name}");
                for transform in
                    model.bodies.iter().map(|b| &b.placement).chain(model.frames.iter().map(|f| &f.placement))
                {
                    let gram = transform.rotation.transpose() * transform.rotation;
                    for (i, row) in gram.rows.iter().enumerate() {
                        for (j, entry) in row.iter().enumerate() {
                            let delta = if i == j { Dd::ONE } else { Dd::ZERO };
                            assert!((*entry - delta).abs().to_f64() < 1e-30, "{name}: no rotation");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn published_puma_loads_with_warnings() {
    let path = files("robots/descriptions").into_iter().find(|p| p.ends_with("puma560.urdf")).expect("it is there");
    let text = std::fs::read_to_string(path).expect("the file can be read");
    let (_, diagnostics) = model_of("puma560.urdf", &text, &ModelOptions::default());
    assert_eq!(codes(&diagnostics), ["inertia-without-mass", "triangle-inequality", "triangle-inequality"]);
}

#[test]
fn an_awkward_urdf_means_what_it_says() {
    let (model, diagnostics) = model_of("awkward.urdf", AWKWARD, &ModelOptions::default());
    assert_eq!(codes(&diagnostics), ["axis-length"], "{diagnostics}");
    assert_eq!(model.name, "awkward-ärm");
    let joints: Vec<_> = model.bodies.iter().map(|b| (b.joint.name.as_str(), b.name.as_str(), b.parent)).collect();
    assert_eq!(joints, [("shoulder", "upper", None), ("elbow", "fore", Some(0))]);
    let elbow = &model.bodies[1];
    assert_eq!((elbow.joint.limits.lower, elbow.joint.limits.upper), (-0.5, 2.0));
    assert_eq!((elbow.joint.limits.velocity, elbow.joint.limits.effort), (2.5, 30.0));
    // the axis of the shoulder is the default, x; that of the elbow −y
    assert_eq!(matrix(&model.bodies[0].placement.rotation), [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(model.frame("fore").map(|f| f.body), Some(Some(1)));
    let names: Vec<&str> = model.frames.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["upper", "tool", "fore", "base_link"]);
    assert_eq!(model.bodies[0].inertia.mass.to_f64(), 2.5);
}

#[test]
fn what_is_skipped_is_listed() {
    let mut diagnostics = Diagnostics::new();
    let description =
        description::read(&Source::new("awkward.urdf", AWKWARD), &mut diagnostics).expect("it can be read");
    let ignored: Vec<_> = description.ignored.iter().map(|i| (i.what.as_str(), i.count, i.place.line)).collect();
    assert_eq!(
        ignored,
        [
            ("gazebo", 1, 5),
            ("calibration", 1, 15),
            ("safety_controller", 1, 16),
            ("material", 1, 18),
            ("visual", 2, 20),
            ("collision", 1, 26),
            ("controller_gazebo_ros", 1, 37),
            ("transmission", 1, 40),
            ("ros2_control", 1, 41),
        ]
    );
}

#[test]
fn formats_are_told_apart_by_their_text() {
    for (path, text, format) in [
        ("a.urdf", AWKWARD, "URDF"),
        ("a.toml", AWKWARD, "URDF"),
        ("a", AWKWARD, "URDF"),
        ("a.toml", ARM, "TOML with joint frames"),
        ("a", ARM, "TOML with joint frames"),
        ("a.toml", CHAIN, "TOML with centres of mass"),
        ("a.xml", SDF, "SDF"),
        ("a", DH, "TOML with joint frames"),
    ] {
        let description = description::read(&Source::new(path, text), &mut Diagnostics::new()).expect("it can be read");
        assert_eq!(description.format.name, format, "{path}");
    }
}

#[test]
fn joint_frame_toml_means_what_it_says() {
    let (model, diagnostics) = model_of("arm.toml", ARM, &ModelOptions::default());
    assert_eq!(codes(&diagnostics), ["point-mass"], "{diagnostics}");
    let kinds: Vec<JointKind> = model.bodies.iter().map(|b| b.joint.kind).collect();
    assert_eq!(kinds, [JointKind::Revolute, JointKind::Prismatic, JointKind::Revolute]);
    // a quarter turn about x, then z along y: z of the shoulder along the world's z
    assert_eq!(model.bodies[0].placement.rotation.column(2), Vec3::new(Dd::ZERO, Dd::ZERO, Dd::ONE));
    // camera merged into hand
    let hand = &model.bodies[2];
    assert_eq!(hand.inertia.mass, Dd::from(0.4) + Dd::from(0.1));
    assert_eq!(model.frame("camera").and_then(|f| f.body), Some(2));
    assert_eq!(model.frame("tool").and_then(|f| f.body), Some(2));
    assert_eq!(model.gravity.z.to_f64(), -9.81);
}

#[test]
fn right_angles_leave_exact_zeros_and_ones() {
    let (model, _) = model_of("arm.toml", ARM, &ModelOptions::default());
    let Some(Frame { placement, .. }) = model.frame("tool") else { panic!("there is a frame `tool`") };
    for entry in placement.rotation.rows.as_flattened() {
        assert!([0.0, 1.0, -1.0].contains(&entry.to_f64()) && entry.lo() == 0.0, "{entry:?}");
    }
    for (name, frame) in model.frames.iter().map(|f| (&f.name, f)) {
        for x in frame.placement.translation.to_array() {
            assert!(x == Dd::ZERO || x.abs().to_f64() > 1e-3, "{name}: dust {x:?}");
            assert!(x != Dd::ZERO || x.to_f64().is_sign_positive(), "{name}: -0");
        }
    }
}

#[test]
fn centre_of_mass_toml_means_what_it_says() {
    let (model, diagnostics) = model_of("chain.toml", CHAIN, &ModelOptions::default());
    assert!(diagnostics.is_empty(), "{diagnostics}");
    let names: Vec<_> = model.bodies.iter().map(|b| (b.joint.name.as_str(), b.name.as_str())).collect();
    assert_eq!(names, [("turn", "column"), ("joint2", "link2")]);
    // S_1 = −r_{0,1}
    assert_eq!(vector(model.bodies[0].placement.translation), [0.0, 0.0, 0.1]);
    // the link frame stands in the centre of mass
    assert_eq!(model.bodies[0].link_frame.translation, model.bodies[0].inertia.com);
    let frames: Vec<&str> = model.frames.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(frames, ["base", "column", "link2", "tip"]);
}

#[test]
fn a_floating_base_is_the_first_body() {
    let options = ModelOptions { floating_base: true, ..ModelOptions::default() };
    let (model, _) = model_of("awkward.urdf", AWKWARD, &options);
    let root = &model.bodies[0];
    assert_eq!(
        (root.joint.name.as_str(), root.name.as_str(), root.joint.kind),
        ("root_joint", "base_link", JointKind::Floating)
    );
    assert_eq!((model.nq(), model.nv()), (9, 8));
    assert_eq!((model.bodies[1].joint.iq, model.bodies[1].joint.iv), (7, 6));
    assert_eq!(root.inertia.mass.to_f64(), 10.0);
    let in_file = ARM.replace("base = \"fixed\"", "base = \"floating\"");
    assert_eq!(model_of("arm.toml", &in_file, &ModelOptions::default()).0.nv(), 9);
}

/// A link without mass that carries the robot on a floating joint is the world, as Pinocchio has it; one that stands elsewhere, or carries more, is not.
#[test]
fn a_floating_joint_on_the_world_is_a_floating_base() {
    let ground = "<link name=\"ground\"/><joint name=\"free\" type=\"floating\"><parent link=\"ground\"/><child link=\"base_link\"/>";
    let on_ground = |rest: &str| AWKWARD.replace("</robot>", &format!("{ground}{rest}</robot>"));
    let options = ModelOptions { floating_base: true, ..ModelOptions::default() };
    let (by_option, _) = model_of("awkward.urdf", AWKWARD, &options);
    for rest in ["</joint>", "<origin xyz=\"0 0 0\" rpy=\"0 0 0\"/></joint>"] {
        let (by_file, _) = model_of("awkward.urdf", &on_ground(rest), &ModelOptions::default());
        assert_eq!(by_file, by_option);
    }
    for rest in [
        "<origin xyz=\"0 0 0.1\"/></joint>",
        "</joint><link name=\"post\"/><joint name=\"fix\" type=\"fixed\"><parent link=\"ground\"/><child link=\"post\"/></joint>",
    ] {
        let (model, diagnostics) = load(&Source::new("awkward.urdf", on_ground(rest)), &ModelOptions::default());
        assert!(model.is_none() && diagnostics.to_string().contains("error[floating-joint]"), "{diagnostics}");
    }
}

#[test]
fn joints_stand_in_the_order_that_is_asked_for() {
    let order = |names: &[&str]| Some(names.iter().map(|n| n.to_string()).collect());
    let options = ModelOptions { joint_order: order(&["roll", "shoulder", "lift"]), ..ModelOptions::default() };
    let (model, _) = model_of("arm.toml", ARM, &options);
    let indices: Vec<_> = model.bodies.iter().map(|b| (b.joint.name.as_str(), b.joint.iv)).collect();
    assert_eq!(indices, [("shoulder", 1), ("lift", 2), ("roll", 0)]);
    let options =
        ModelOptions { floating_base: true, joint_order: order(&["elbow", "shoulder"]), ..ModelOptions::default() };
    let (model, _) = model_of("awkward.urdf", AWKWARD, &options);
    let indices: Vec<_> = model.bodies.iter().map(|b| (b.joint.iq, b.joint.iv)).collect();
    assert_eq!(indices, [(0, 0), (8, 7), (7, 6)]);
}

#[test]
fn frames_can_be_added() {
    let frame = FrameOption { name: "probe".into(), link: "tool".into(), xyz: [0.0, 0.0, 0.05], rpy: [0.0; 3] };
    let options = ModelOptions { frames: vec![frame], ..ModelOptions::default() };
    let (model, _) = model_of("awkward.urdf", AWKWARD, &options);
    let at = |name: &str| model.frame(name).map(|f| vector(f.placement.translation));
    // both lie on the z axis of the last link, so their distances from the joint add up
    let length = |v: Option<[f64; 3]>| v.map(|v| v.iter().map(|x| x * x).sum::<f64>().sqrt());
    assert!((length(at("probe")).unwrap_or(0.0) - 0.15).abs() < 1e-15);
    assert_eq!(length(at("tool")), Some(0.1));
}

#[test]
fn right_angles_within_rounding_are_taken_as_exact_and_reported() {
    let text = AWKWARD.replace("rpy=\"0 0 0\"", "rpy=\"1.5707963267948966 0 -1.570796\"");
    let options = ModelOptions::default();
    let (_, diagnostics) = model_of("awkward.urdf", &text, &options);
    assert_eq!(codes(&diagnostics), ["axis-length", "near-right-angle"]);
    let description = description::read(&Source::new("awkward.urdf", text), &mut diagnostics.clone()).expect("read");
    let reported = special_angles(&description, &options);
    assert_eq!(reported.len(), 1);
    assert_eq!((reported[0].text.as_str(), reported[0].taken_as.as_str()), ("1.5707963267948966", "π/2"));
    assert_eq!(reported[0].what, "roll of the origin of joint `elbow`");
    assert!((reported[0].deviation + 6.1e-17).abs() < 1e-18);
    let wider = ModelOptions { angle_tolerance: 1e-6, ..options };
    assert_eq!(special_angles(&description, &wider).len(), 2);
    let literal = ModelOptions { angle_tolerance: 0.0, ..ModelOptions::default() };
    assert!(special_angles(&description, &literal).is_empty());
}

#[test]
fn all_complaints_come_in_one_run() {
    let text = AWKWARD
        .replace("value=\" 2.5 \"", "value=\"-2.5\"")
        .replace("xyz=\"0 -2e0 0\"", "xyz=\"0 0 0\"")
        .replace("<child link=\"fore\"/>", "<child link=\"for\"/>")
        .replace("izz=\"0.002\"", "izz=\"two\"")
        .replace("type='continuous'", "type='continous'");
    let (model, diagnostics) = load(&Source::new("awkward.urdf", text), &ModelOptions::default());
    assert!(model.is_none());
    let errors: Vec<_> = diagnostics
        .iter()
        .filter(|d| d.severity == Severity::Error)
        .map(|d| (d.code, d.place.as_ref().map_or(0, |p| p.line)))
        .collect();
    assert_eq!(
        errors,
        [("zero-axis", 9), ("unknown-link", 10), ("negative-mass", 24), ("unknown-word", 28), ("not-a-number", 35)]
    );
}

#[test]
fn merged_inertia_is_that_of_the_two_bodies() {
    // two point masses on one body: about their common centre they have m1 m2 / (m1 + m2) d²
    let text = r#"
        [robot]
        name = "two"
        [[link]]
        name = "base"
        [[link]]
        name = "a"
        mass = 2.0
        com = [0.0, 0.0, 0.25]
        inertia = [0.0, 0.0, 0.0]
        [[link]]
        name = "b"
        mass = 1.0
        inertia = [0.0, 0.0, 0.0]
        [[joint]]
        name = "turn"
        kind = "continuous"
        parent = "base"
        child = "a"
        axis = "z"
        [[joint]]
        name = "weld"
        kind = "fixed"
        parent = "a"
        child = "b"
        origin = { xyz = [0.5, 0.0, 0.25] }
    "#;
    let (model, _) = model_of("two.toml", text, &ModelOptions::default());
    let inertia = &model.bodies[0].inertia;
    assert_eq!(inertia.mass.to_f64(), 3.0);
    assert!((inertia.com.x.to_f64() - 0.5 / 3.0).abs() < 1e-16 && inertia.com.y == Dd::ZERO);
    let sigma = inertia.second_moment_com;
    assert!((sigma.xx.to_f64() - 2.0 / 3.0 * 0.25).abs() < 1e-16);
    for zero in [sigma.yy, sigma.zz, sigma.xy, sigma.xz, sigma.yz] {
        assert!(zero.abs().to_f64() < 1e-30, "{zero:?}");
    }
}

#[test]
fn the_next_joint_stands_where_its_vectors_say() {
    let (model, _) = model_of("chain.toml", CHAIN, &ModelOptions::default());
    // S_1 → C_1 is r_{1,1} = (0.2, 0, 0), C_1 → S_2 is −r_{1,2} = (0.2, 0, 0), in the axes of link 1
    let link = &model.bodies[0].link_frame;
    let s2_in_link = link.rotation.transpose_mul(model.bodies[1].placement.translation);
    assert_eq!(vector(s2_in_link), [0.4, 0.0, 0.0]);
    // the tip is 0.2 from the centre of mass of link 2
    let tip = model.frame("tip").map(|f| f.placement.translation - model.bodies[1].inertia.com);
    assert!(tip.is_some_and(|d| (d.dot(d).sqrt() - Dd::from(0.2)).abs().to_f64() < 1e-30));
}
