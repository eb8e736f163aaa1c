//! MJCF means what MuJoCo makes of it: the same robot as TOML, inertias in closed form, orientations in all notations.

use crate::compare::Disagreement;
use crate::robots::Random;
use std::f64::consts::PI;
use std::path::PathBuf;
use straightline_codegen::description::{self, Description};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_core::algorithms::{inverse_dynamics, mass_matrix};
use straightline_core::model::Model;
use straightline_core::Dd;

/// The model of a text, which nothing is said about but warnings.
fn model_of(name: &str, text: &str) -> Model<Dd> {
    let (model, diagnostics) = load(&Source::new(name, text), &ModelOptions::default());
    model.unwrap_or_else(|| panic!("{diagnostics}\n{text}"))
}

fn described(text: &str) -> Description {
    let mut diagnostics = Diagnostics::new();
    let description = description::read(&Source::new("robot.xml", text), &mut diagnostics);
    assert!(!diagnostics.has_errors(), "{diagnostics}\n{text}");
    description.expect("a text without errors is read")
}

/// A robot in the world, with settings before it.
fn robot(settings: &str, world: &str) -> String {
    format!("<mujoco model=\"robot\">{settings}<worldbody>{world}</worldbody></mujoco>")
}

/// Coordinates, rates and accelerations that no symmetry hides behind.
fn state(model: &Model<Dd>, shift: f64) -> [Vec<Dd>; 3] {
    let own = |n: usize, phase: f64| (0..n).map(|i| Dd::from((1.3 * i as f64 + phase).sin())).collect::<Vec<_>>();
    let mut q = own(model.nq(), 0.4);
    q.iter_mut().for_each(|q| *q += Dd::from(shift));
    model.free_joints().for_each(|joint| joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]));
    [q, own(model.nv(), 1.1), own(model.nv(), 2.3)]
}

/// Both models have the same H and the same torques: to 1e-25 in double-double, or what the inertias were rounded to.
fn same(a: &Model<Dd>, b: &Model<Dd>, bound: f64) {
    assert_eq!((a.nq(), a.nv()), (b.nq(), b.nv()));
    let [q, qd, qdd] = state(a, 0.0);
    let results = |m: &Model<Dd>| [mass_matrix(m, &q), inverse_dynamics(m, &q, &qd, &qdd)];
    for (a, b) in results(a).iter().zip(&results(b)) {
        let scale = a.iter().fold(0.0f64, |most, x| most.max(x.to_f64().abs()));
        for (i, (a, b)) in a.iter().zip(b).enumerate() {
            assert!((*a - *b).to_f64().abs() <= bound * scale, "entry {i}: {} and {}", a.to_f64(), b.to_f64());
        }
    }
}

const INERTIAL: &str = "<inertial pos=\"0.1 -0.2 0.3\" mass=\"2.5\" fullinertia=\"0.3 0.4 0.5 0.01 -0.02 0.03\"/>";

#[test]
fn joints_of_one_body_act_one_after_the_other_at_their_anchors() {
    let mjcf = robot(
        "<compiler angle=\"radian\"/><option gravity=\"1 2 -9\"/>",
        &format!(
            "<body name=\"a\" pos=\"0.5 0.25 -0.125\" quat=\"1 0 0 1\">
               <joint name=\"x\" type=\"slide\" axis=\"1 0 0\"/>
               <joint name=\"turn\" axis=\"0 2 0\" pos=\"0.25 0.5 0.75\"/>
               <joint name=\"tilt\" axis=\"0 0 1\" pos=\"-0.5 0.125 0\"/>{INERTIAL}
               <body name=\"b\" pos=\"0 0.5 0\"><joint name=\"last\" axis=\"1 1 0\"/>{INERTIAL}</body></body>"
        ),
    );
    // the anchors are binary fractions, so that their differences are exact
    let inertia = "mass = 2.5\ninertia = { xx = 0.3, yy = 0.4, zz = 0.5, xy = 0.01, xz = -0.02, yz = 0.03 }";
    let joint = |name: &str, kind: &str, parent: &str, child: &str, axis: &str, origin: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{child}\"\naxis = {axis}\n\
             origin = {{ {origin} }}\n"
        )
    };
    let toml = [
        "[robot]\nname = \"robot\"\ngravity = [1.0, 2.0, -9.0]\n".to_string(),
        ["world", "one", "two"].map(|name| format!("[[link]]\nname = \"{name}\"\n")).concat(),
        format!("[[link]]\nname = \"a\"\ncom = [0.6, -0.325, 0.3]\n{inertia}\n"),
        format!("[[link]]\nname = \"b\"\ncom = [0.1, -0.2, 0.3]\n{inertia}\n"),
        joint("x", "prismatic", "world", "one", "\"x\"", "xyz = [0.5, 0.25, -0.125], rpy_quarter_turns = [0, 0, 1]"),
        joint("turn", "continuous", "one", "two", "\"y\"", "xyz = [0.25, 0.5, 0.75]"),
        joint("tilt", "continuous", "two", "a", "\"z\"", "xyz = [-0.75, -0.375, -0.75]"),
        joint("last", "continuous", "a", "b", "[1.0, 1.0, 0.0]", "xyz = [0.5, 0.375, 0.0]"),
    ];
    // 0.1 + 0.5 is not the f64 0.6
    same(&model_of("robot.xml", &mjcf), &model_of("robot.toml", &toml.concat()), 1e-15);
}

#[test]
fn links_between_the_joints_of_a_body_are_no_frames() {
    let text =
        robot("", &format!("<body name=\"a\"><joint/><joint axis=\"1 0 0\"/>{INERTIAL}<site name=\"tip\"/></body>"));
    let model = model_of("robot.xml", &text);
    let frames: Vec<&str> = model.frames.iter().map(|frame| frame.name.as_str()).collect();
    assert_eq!(frames, ["world", "a", "tip"]);
    let joints: Vec<&str> = model.bodies.iter().map(|body| body.joint.name.as_str()).collect();
    assert_eq!(joints, ["a_joint", "a_joint_2"]);
}

#[test]
fn a_reference_shifts_the_coordinate() {
    let at = |reference: &str| {
        let joint = |kind: &str, pos: &str, axis: &str| {
            format!("<joint type=\"{kind}\" pos=\"{pos}\" axis=\"{axis}\" {reference}/>")
        };
        let joints = joint("slide", "0 0 0", "0.6 0 0.8") + &joint("hinge", "0.1 0.2 0.3", "1 2 3");
        let world = format!("<body pos=\"1 2 3\">{joints}{INERTIAL}</body>");
        model_of("robot.xml", &robot("<compiler angle=\"radian\"/>", &world))
    };
    let (plain, shifted) = (at(""), at("ref=\"0.75\""));
    let ([q, qd, qdd], [by, ..]) = (state(&plain, 0.0), state(&plain, 0.75));
    for (a, b) in inverse_dynamics(&plain, &q, &qd, &qdd).iter().zip(inverse_dynamics(&shifted, &by, &qd, &qdd)) {
        assert!((*a - b).to_f64().abs() < 1e-13, "{} and {}", a.to_f64(), b.to_f64());
    }
}

#[test]
fn an_orientation_is_the_same_in_every_notation() {
    let of = |settings: &str, orientation: &str| {
        let world = format!("<body pos=\"0.3 0.1 0\" {orientation}><joint axis=\"1 2 3\"/>{INERTIAL}</body>");
        let model = model_of("robot.xml", &robot(settings, &world));
        model.bodies[0].placement.rotation
    };
    let plain = of("", "quat=\"1 1 1 1\"");
    for (settings, orientation) in [
        ("", "quat=\"-0.5 -0.5 -0.5 -0.5\""),
        ("", "quat=\"0.70710678 0.70710678 0.70710678 0.70710678\""),
        ("", "axisangle=\"2 2 2 120\""),
        ("<compiler angle=\"radian\"/>", "axisangle=\"-1 -1 -1 -2.0943951023931953\""),
        ("", "xyaxes=\"0 3 0 0 1 5\""),
        ("", "euler=\"90 90 0\""),
        ("<compiler angle=\"radian\"/>", "euler=\"1.5707963267948966 1.5707963267948966 0\""),
        ("<compiler eulerseq=\"ZYX\"/>", "euler=\"0 90 90\""),
        ("<compiler eulerseq=\"zyx\"/>", "euler=\"90 0 90\""),
    ] {
        assert_eq!(of(settings, orientation), plain, "{settings} {orientation}");
    }
    // the shortest way from z to y is a quarter turn about −x
    assert_eq!(of("", "zaxis=\"0 4 0\""), of("", "euler=\"-90 0 0\""));
    assert_eq!(of("", "zaxis=\"0 0 -1\""), of("", "euler=\"180 0 0\""));
}

#[test]
fn frames_move_what_stands_in_them() {
    let frame = "<frame pos=\"0.1 0.2 0.3\" euler=\"0 30 0\"><frame pos=\"0 0 1\" axisangle=\"1 2 3 50\">";
    let geom = "<geom type=\"box\" size=\"0.1 0.2 0.3\" pos=\"0.3 0 0\"/>";
    let inner = format!(
        "<body name=\"b\" pos=\"0 1 0\"><joint axis=\"0 1 1\"/>{INERTIAL}</body><site name=\"tip\" pos=\"1 0 0\"/>"
    );
    let framed = robot("", &format!("<body name=\"a\"><joint/>{frame}{inner}{geom}</frame></frame></body>"));
    let bodies = frame.replace("frame", "body");
    let nested = robot("", &format!("<body name=\"a\"><joint/>{bodies}{inner}{geom}</body></body></body>"));
    let (framed, nested) = (model_of("robot.xml", &framed), model_of("robot.xml", &nested));
    same(&framed, &nested, 1e-15);
    let tip = |model: &Model<Dd>| model.frames.iter().find(|f| f.name == "tip").expect("it is a site").placement;
    assert_eq!(tip(&framed), tip(&nested));
}

/// Masses and principal moments of solids with density 1000, or of a mass.
#[test]
fn inertias_of_geoms_are_those_of_uniform_solids() {
    let (r, h) = (0.3f64, 0.7f64);
    let cylinder = 1000.0 * PI * r * r * 2.0 * h;
    let ball = 1000.0 * 4.0 / 3.0 * PI * r.powi(3);
    let across = cylinder * (3.0 * r * r + 4.0 * h * h) / 12.0;
    // of two half balls: 2/5 m r² less what Steiner takes, and what it gives at h + 3/8 r
    let caps = ball * (0.4 * r * r - (0.375 * r).powi(2) + (h + 0.375 * r).powi(2));
    let of_box = |m: f64, a: f64, b: f64| m * (a * a + b * b) / 3.0;
    for (geom, mass, moments) in [
        ("type=\"sphere\" size=\"0.3\"", ball, [0.4 * ball * r * r; 3]),
        ("type=\"cylinder\" size=\"0.3 0.7\"", cylinder, [across, across, cylinder * r * r / 2.0]),
        (
            "type=\"capsule\" size=\"0.3 0.7\"",
            cylinder + ball,
            [across + caps, across + caps, cylinder * r * r / 2.0 + 0.4 * ball * r * r],
        ),
        (
            "type=\"capsule\" size=\"0.3\" fromto=\"1 2 3.7 1 2 2.3\"",
            cylinder + ball,
            [across + caps, across + caps, cylinder * r * r / 2.0 + 0.4 * ball * r * r],
        ),
        (
            "type=\"box\" size=\"0.1 0.2 0.3\" mass=\"6\"",
            6.0,
            [of_box(6.0, 0.2, 0.3), of_box(6.0, 0.1, 0.3), of_box(6.0, 0.1, 0.2)],
        ),
        (
            "type=\"ellipsoid\" size=\"0.1 0.2 0.3\" density=\"500\"",
            500.0 * 4.0 / 3.0 * PI * 0.006,
            [0.13, 0.10, 0.05].map(|x| 500.0 * 4.0 / 3.0 * PI * 0.006 * x / 5.0),
        ),
    ] {
        let description = described(&robot("", &format!("<body name=\"a\"><joint/><geom {geom}/></body>")));
        let inertial = description.link("a").and_then(|link| link.inertial.clone()).expect("it has a geom");
        let near = |a: f64, b: f64| assert!((a - b).abs() <= 4e-16 * b.abs() * 4.0, "{geom}: {a} and {b}");
        near(inertial.mass.value, mass);
        let j = inertial.inertia.value;
        [j.xx, j.yy, j.zz].iter().zip(moments).for_each(|(a, b)| near(*a, b));
        assert_eq!([j.xy, j.xz, j.yz], [0.0; 3], "{geom}");
    }
}

#[test]
fn the_compiler_bounds_balances_selects_and_scales_inertias() {
    let inertial = |settings: &str, body: &str| {
        let description = described(&robot(settings, &format!("<body name=\"a\"><joint/>{body}</body>")));
        let inertial = description.link("a").and_then(|link| link.inertial.clone()).expect("it has one");
        let j = inertial.inertia.value;
        (inertial.mass.value, [j.xx, j.yy, j.zz])
    };
    let flat = "<inertial pos=\"0 0 0\" mass=\"2\" diaginertia=\"0.25 0.5 1.5\"/>";
    assert_eq!(inertial("<compiler balanceinertia=\"true\"/>", flat), (2.0, [0.75; 3]));
    assert_eq!(inertial("<compiler boundmass=\"3\" boundinertia=\"0.375\"/>", flat), (3.0, [0.375, 0.5, 1.5]));
    assert_eq!(inertial("<compiler settotalmass=\"8\"/>", flat), (8.0, [1.0, 2.0, 6.0]));
    let geoms = "<geom type=\"box\" size=\"1 1 1\" mass=\"3\" group=\"2\"/><geom size=\"1\" group=\"1\"/>";
    let chosen = "<compiler inertiagrouprange=\"2 5\"/>";
    assert_eq!(inertial(chosen, geoms), (3.0, [2.0; 3]));
    assert_eq!(inertial(chosen, &(flat.to_string() + geoms)).0, 2.0);
    let forced = "<compiler inertiagrouprange=\"2 5\" inertiafromgeom=\"true\"/>";
    assert_eq!(inertial(forced, &(flat.to_string() + geoms)).0, 3.0);
}

#[test]
fn classes_give_what_elements_do_not_say() {
    let defaults = "<default><joint damping=\"1\" armature=\"0.5\"/><geom density=\"10\"/>
        <default class=\"leg\"><joint damping=\"2\" axis=\"0 1 0\"/>
          <default class=\"foot\"><joint damping=\"3\"/></default></default></default>";
    let ball = "<geom size=\"0.1\"/>";
    let text = robot(
        defaults,
        &format!(
            "<body name=\"a\"><joint name=\"a\"/>{ball}
              <body name=\"b\" childclass=\"leg\"><joint name=\"b\"/>{ball}
                <body name=\"c\"><joint name=\"c\" class=\"foot\" armature=\"0.25\"/>{ball}</body></body></body>"
        ),
    );
    let model = model_of("robot.xml", &text);
    let of = |name: &str| {
        let body = model.bodies.iter().find(|body| body.joint.name == name).expect("it is a joint");
        (body.effects.damping.to_f64(), body.effects.rotor_inertia.map(|x| x.to_f64()))
    };
    assert_eq!([of("a"), of("b"), of("c")], [(1.0, Some(0.5)), (2.0, Some(0.5)), (3.0, Some(0.25))]);
}

#[test]
fn joints_have_springs_friction_and_ranges_in_their_own_units() {
    let text = robot(
        "",
        &format!(
            "<body><joint name=\"turn\" range=\"-90 180\" stiffness=\"2\" springref=\"45\" damping=\"0.5\" frictionloss=\"0.1\"/>
             <joint name=\"slide\" type=\"slide\" range=\"-1 2\" stiffness=\"3\" springref=\"0.5\" limited=\"false\"/>{INERTIAL}</body>"
        ),
    );
    let description = described(&text);
    let joint = |name: &str| description.joint(name).expect("it is a joint");
    let value = |x: &Option<description::Noted<f64>>| x.as_ref().map(|x| x.value);
    let turn = joint("turn");
    assert_eq!([value(&turn.limits.lower), value(&turn.limits.upper)], [Some(-PI / 2.0), Some(PI)]);
    assert_eq!(value(&turn.drive.spring_rest), Some(PI / 4.0));
    assert_eq!([value(&turn.drive.damping), value(&turn.drive.friction)], [Some(0.5), Some(0.1)]);
    assert!(turn.kind.value.has_range && !joint("slide").kind.value.has_range);
    assert_eq!(value(&joint("slide").drive.spring_rest), Some(0.5));
}

#[test]
fn couplings_and_greatest_forces_are_read() {
    let joints = "<joint name=\"p\" ref=\"0.5\" type=\"slide\"/><joint name=\"q\" type=\"slide\" axis=\"1 0 0\"/>";
    let beside = "<equality><joint joint1=\"p\" joint2=\"q\" polycoef=\"0.25 -2 0 0 0\"/><tendon tendon1=\"t\"/></equality>
        <tendon><fixed name=\"t\"><joint joint=\"q\" coef=\"2\"/><joint joint=\"p\" coef=\"-1\"/></fixed></tendon>
        <actuator><motor joint=\"p\" gear=\"-3\" ctrlrange=\"-2 1\"/><general joint=\"p\" gainprm=\"5\" ctrlrange=\"-1 1\"/>
        <position joint=\"q\" kp=\"100\" forcerange=\"-7 8\"/></actuator>";
    let text = format!("<mujoco>{beside}<worldbody><body>{joints}{INERTIAL}</body></worldbody></mujoco>");
    let description = described(&text);
    let couplings: Vec<_> = description
        .couplings
        .iter()
        .map(|c| (c.joint.value.as_str(), c.source.value.as_str(), c.ratio.value, c.offset.value))
        .collect();
    // p − 0.5 = 0.25 − 2 q, and 2 q − (p − 0.5) = 0
    assert_eq!(couplings, [("p", "q", -2.0, 0.75), ("q", "p", 0.5, -0.25)]);
    let effort = |name: &str| description.joint(name).and_then(|joint| joint.limits.effort.clone()).map(|x| x.value);
    assert_eq!([effort("p"), effort("q")], [Some(11.0), Some(8.0)]);
}

#[test]
fn a_free_body_is_a_floating_base() {
    let leg = format!("<body><joint name=\"hip\" axis=\"1 0 0\"/>{INERTIAL}</body>");
    let text = robot(
        "",
        &format!("<geom type=\"plane\"/><body name=\"base\" pos=\"0 0 3\"><freejoint/>{INERTIAL}{leg}</body>"),
    );
    let model = model_of("robot.xml", &text);
    assert_eq!((model.nq(), model.nv()), (8, 7));
    assert_eq!(model.bodies[0].name, "base");
}

/// A folder of its own for the files of a test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("straightline-mjcf-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("there is room for a test");
    folder
}

#[test]
fn files_are_included_where_they_are_named() {
    let folder = folder("include");
    let file = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("it can be written");
    file("defaults.xml", "<mujocoinclude><default><joint damping=\"4\"/></default></mujocoinclude>");
    file("arm.xml", &format!("<mujocoinclude><body name=\"arm\"><joint name=\"j\"/>{INERTIAL}</body></mujocoinclude>"));
    let text = "<mujoco><include file=\"defaults.xml\"/><worldbody><include file=\"arm.xml\"/></worldbody></mujoco>";
    let path = folder.join("robot.xml");
    let model = model_of(&path.to_string_lossy(), text);
    assert_eq!(model.bodies[0].effects.damping.to_f64(), 4.0);
    std::fs::remove_dir_all(&folder).expect("it was made here");
}

/// The box of the half lengths 0.1, 0.2, 0.3 about (1, 2, 3).
/// Two arms of one file, of other units and classes than the file that attaches them, one of them a part of the model.
#[test]
fn models_are_attached_where_they_are_named() {
    let here = folder("attached");
    let arm = "<mujoco model=\"arm\"><compiler angle=\"radian\" autolimits=\"false\"/>
        <default><joint damping=\"0.3\"/><default class=\"heavy\"><geom density=\"2000\"/></default></default>
        <worldbody><geom size=\"1\"/><body name=\"upper\" euler=\"0.1 0.2 0.3\"><joint name=\"shoulder\" axis=\"0 1 0\"/>
        <geom class=\"heavy\" size=\"0.1\" pos=\"0.1 0 0\"/><site name=\"elbow\" pos=\"0.3 0 0\"/><body name=\"fore\" pos=\"0.3 0 0\">
        <joint name=\"bend\" axis=\"0 0 1\"/><geom size=\"0.05\" pos=\"0.1 0.1 0\"/></body></body></worldbody>
        <equality><joint joint1=\"bend\" joint2=\"shoulder\" polycoef=\"0 2 0 0 0\"/></equality>
        <actuator><motor joint=\"shoulder\" ctrlrange=\"-3 3\" ctrllimited=\"true\"/></actuator></mujoco>";
    std::fs::write(here.join("arm.xml"), arm).expect("it can be written");
    let text = "<mujoco model=\"robot\"><default><joint damping=\"9\"/><default class=\"heavy\"><geom density=\"1\"/></default></default>
        <asset><model name=\"arm\" file=\"arm.xml\"/></asset>
        <worldbody><body name=\"torso\"><joint name=\"yaw\" axis=\"0 0 1\"/><geom size=\"0.2\" pos=\"0.1 0 0\"/>
        <frame pos=\"0 0.2 0\" euler=\"90 0 0\"><attach model=\"arm\" body=\"upper\" prefix=\"left_\"/></frame>
        <frame pos=\"0 -0.2 0\"><attach model=\"arm\" prefix=\"right_\"/></frame></body></worldbody></mujoco>";
    let path = here.join("robot.xml");
    let attached = model_of(&path.to_string_lossy(), text);
    // the same in one file; the ball of the world of the right arm is a part of the torso
    let body = |prefix: &str| {
        format!(
            "<body name=\"{prefix}upper\" euler=\"0.1 0.2 0.3\"><joint name=\"{prefix}shoulder\" axis=\"0 1 0\" damping=\"0.3\"/>
            <geom density=\"2000\" size=\"0.1\" pos=\"0.1 0 0\"/><site name=\"{prefix}elbow\" pos=\"0.3 0 0\"/>
            <body name=\"{prefix}fore\" pos=\"0.3 0 0\"><joint name=\"{prefix}bend\" axis=\"0 0 1\" damping=\"0.3\"/>
            <geom size=\"0.05\" pos=\"0.1 0.1 0\"/></body></body>"
        )
    };
    let coupling =
        |prefix: &str| format!("<joint joint1=\"{prefix}bend\" joint2=\"{prefix}shoulder\" polycoef=\"0 2 0 0 0\"/>");
    let plain = format!(
        "<mujoco model=\"robot\"><compiler angle=\"radian\"/><worldbody><body name=\"torso\">
        <joint name=\"yaw\" axis=\"0 0 1\" damping=\"9\"/><geom size=\"0.2\" pos=\"0.1 0 0\"/><geom size=\"1\" pos=\"0 -0.2 0\"/>
        <frame pos=\"0 0.2 0\" euler=\"{half_pi} 0 0\">{left}</frame><frame pos=\"0 -0.2 0\">{right}</frame></body></worldbody>
        <equality>{}{}</equality></mujoco>",
        coupling("left_"),
        coupling("right_"),
        half_pi = PI / 2.0,
        left = body("left_"),
        right = body("right_"),
    );
    let plain = model_of("plain.xml", &plain);
    let names = |model: &Model<Dd>| model.joints().iter().map(|joint| joint.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&attached), ["yaw", "left_shoulder", "right_shoulder"]);
    assert_eq!(names(&attached), names(&plain));
    same(&attached, &plain, 1e-15);
    let effort =
        |name: &str| attached.joints().iter().find(|joint| joint.name == name).expect("it is there").limits.effort;
    assert_eq!([effort("left_shoulder"), effort("right_shoulder")], [3.0, 3.0]);
    assert!(attached.frame("left_elbow").is_some() && attached.frame("right_elbow").is_some());
    std::fs::remove_dir_all(&here).expect("it was made here");
}

/// A ball that lies beside a robot is no part of it, nor is a door beside a walker; two balls are no robot, and two walkers two.
#[test]
fn what_moves_freely_beside_a_robot_is_left_out() {
    let arm = format!("<body name=\"arm\"><joint name=\"j\" axis=\"0 1 0\"/>{INERTIAL}</body>");
    let ball = "<body name=\"ball\"><freejoint/><geom size=\"0.1\"/></body>";
    same(
        &model_of("a.xml", &robot("", &format!("{ball}{arm}{ball}").replacen("ball", "other", 1))),
        &model_of("b.xml", &robot("", &arm)),
        0.0,
    );
    // beside a robot that floats, too
    let walker = format!("<body name=\"walker\"><freejoint/>{INERTIAL}{arm}</body>");
    same(&model_of("a.xml", &robot("", &format!("{walker}{ball}"))), &model_of("b.xml", &robot("", &walker)), 0.0);
    // and what has one joint of its own beside a robot with several, with its actuator
    let leg = format!("<body><joint name=\"knee\" axis=\"0 1 0\"/>{INERTIAL}</body>");
    let walker = walker.replace("</body></body>", &format!("</body>{leg}</body>"));
    let door = format!("<body name=\"door\" pos=\"0 0 20\"><joint name=\"hinge\"/>{INERTIAL}</body>");
    let motors = "<actuator><motor joint=\"j\"/><motor joint=\"hinge\"/></actuator>";
    same(
        &model_of("a.xml", &robot(motors, &format!("{door}{walker}{ball}"))),
        &model_of("b.xml", &robot("", &walker)),
        0.0,
    );
    let two = door.replace("</body>", &format!("{leg}</body>")).replace("knee", "latch");
    let other = ["walker", "arm", "j", "knee"]
        .iter()
        .fold(walker.clone(), |text, name| text.replace(&format!("\"{name}\""), &format!("\"other_{name}\"")));
    let refused =
        [format!("{ball}{}", ball.replace("ball", "other")), format!("{walker}{two}"), walker.clone() + &other];
    for bodies in refused {
        let (model, diagnostics) = load(&Source::new("c.xml", robot("", &bodies)), &ModelOptions::default());
        assert!(model.is_none() && diagnostics.iter().all(|d| d.code == "not-supported-yet"), "{diagnostics}");
    }
}

fn faces() -> ([[f64; 3]; 8], [[usize; 3]; 12]) {
    let sign = |i: usize, bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let corners = std::array::from_fn(|i| [1.0 + 0.1 * sign(i, 0), 2.0 + 0.2 * sign(i, 1), 3.0 + 0.3 * sign(i, 2)]);
    let faces = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    (corners, faces)
}

#[test]
fn meshes_have_the_inertia_of_what_they_enclose() {
    let folder = folder("mesh");
    let (corners, faces) = faces();
    let row = |word: &str, numbers: [String; 3]| format!("{word} {}\n", numbers.join(" "));
    let vertices: String = corners.iter().map(|v| row("v", v.map(|x| x.to_string()))).collect();
    let obj = faces.iter().fold(vertices, |text, face| text + &row("f", face.map(|i| format!("{}/1", i + 1))));
    let mut stl = vec![b' '; 80];
    stl.extend((faces.len() as u32).to_le_bytes());
    for face in faces {
        stl.extend([0u8; 12]);
        face.iter().flat_map(|i| corners[*i]).for_each(|x| stl.extend((x as f32).to_le_bytes()));
        stl.extend([0u8; 2]);
    }
    std::fs::write(folder.join("box.obj"), obj).expect("it can be written");
    std::fs::write(folder.join("box.stl"), stl).expect("it can be written");
    let joints = "<joint axis=\"1 2 3\"/><joint axis=\"3 -1 1\"/><joint axis=\"0 1 0\"/>";
    let with = |geom: &str, file: &str| {
        let assets = format!("<compiler meshdir=\".\"/><asset><mesh name=\"m\" file=\"{file}\"/></asset>");
        let text = robot(&assets, &format!("<body>{joints}<geom {geom}/></body>"));
        model_of(&folder.join("robot.xml").to_string_lossy(), &text)
    };
    let solid = with("type=\"box\" size=\"0.1 0.2 0.3\" pos=\"1 2 3\"", "box.obj");
    // corners are f32 in both formats
    let mesh = |file: &str| with("type=\"mesh\" mesh=\"m\"", file);
    same(&solid, &mesh("box.stl"), 1e-6);
    same(&mesh("box.stl"), &mesh("box.obj"), 1e-14);
    // a box of which a corner is pushed in: parts of its volume have the other sign, seen from the centroid of its surface
    let mut lines: Vec<String> =
        std::fs::read_to_string(folder.join("box.obj")).expect("it is there").lines().map(str::to_string).collect();
    lines[0] = "v 1.05 2.1 3.15".to_string();
    std::fs::write(folder.join("dent.obj"), lines.join("\n")).expect("it can be written");
    let dented = |compiler: &str, mesh: &str| {
        let assets =
            format!("<compiler meshdir=\".\" {compiler}/><asset><mesh name=\"m\" file=\"dent.obj\" {mesh}/></asset>");
        let text = robot(&assets, &format!("<body>{joints}<geom type=\"mesh\" mesh=\"m\"/></body>"));
        model_of(&folder.join("robot.xml").to_string_lossy(), &text)
    };
    let mass = |model: &Model<Dd>| model.bodies.last().expect("a body").inertia.mass.to_f64();
    let (exact, legacy) = (dented("", "inertia=\"exact\""), dented("", ""));
    assert!((mass(&legacy) / mass(&exact) - 1.0).abs() > 1e-3, "{} {}", mass(&legacy), mass(&exact));
    same(&exact, &dented("exactmeshinertia=\"true\"", ""), 1e-14);
    same(&legacy, &dented("exactmeshinertia=\"true\"", "inertia=\"legacy\""), 1e-14);
    std::fs::remove_dir_all(&folder).expect("it was made here");
}

/// Mass and centre of mass that MuJoCo 4.0.0 has: of a skew box by faces of four corners, three of which the other diagonal divides, in coordinates of f32.
#[test]
fn the_shorter_diagonal_divides_faces_of_four_corners() {
    let folder = folder("quads");
    let obj = "v 0 0 0\nv 0.01 -0.02 0.12\nv -0.01 0.11 0.02\nv 0.02 0.09 0.1\nv 0.11 0.02 -0.01\nv 0.09 0.01 0.08\nv 0.1 0.12 0.01\nv 0.13 0.1 0.09\n\
               f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n";
    std::fs::write(folder.join("skew.obj"), obj).expect("it can be written");
    let assets = "<asset><mesh name=\"m\" file=\"skew.obj\" inertia=\"exact\"/></asset>";
    let text = robot(assets, "<body><joint/><geom type=\"mesh\" mesh=\"m\" density=\"1000\"/></body>");
    let model = model_of(&folder.join("robot.xml").to_string_lossy(), &text);
    let inertia = &model.bodies.last().expect("a body").inertia;
    let com = inertia.com.to_array().map(|x| x.to_f64());
    let expected = [0.056520013150520874, 0.054418564453605996, 0.0475759149924373];
    let off = com
        .iter()
        .zip(expected)
        .fold((inertia.mass.to_f64() - 0.9660000052911534).abs(), |most, (a, b)| most.max((a - b).abs()));
    assert!(off < 1e-14, "off by {off:e}: {:e} kg at {com:?}", inertia.mass.to_f64());
    std::fs::remove_dir_all(&folder).expect("it was made here");
}

#[test]
fn both_readings_of_mjcf_agree() {
    let joint = "<joint type=\"hinge\" axis=\"1 -2 0.5\" pos=\"0.1 0.3 -0.2\" ref=\"20\"/>";
    let slide = "<joint type=\"slide\" axis=\"-1 0.2 0.5\" pos=\"0.3 0.1 0.2\" ref=\"0.4\"/>";
    let capsule = "<geom type=\"capsule\" size=\"0.1\" fromto=\"0.1 0.2 0.3 -0.3 0.4 0.1\"/>";
    let text = robot(
        "<compiler eulerseq=\"zXy\"/>",
        &format!(
            "<site name=\"mark\" pos=\"1 2 3\" zaxis=\"1 2 -3\"/>
             <body name=\"a\" pos=\"1 0.5 2\" euler=\"10 20 30\">{joint}{slide}{joint}{capsule}
               <frame pos=\"0.2 0.1 0\" quat=\"1 2 -3 4\">
                 <body name=\"b\" axisangle=\"1 2 3 40\">{slide}{INERTIAL}<site name=\"tip\" xyaxes=\"1 2 3 3 2 1\"/></body></frame>
               <body name=\"link1\" pos=\"0 0 1\" zaxis=\"0 0 -2\">{joint}{capsule}
                 <body name=\"d\" zaxis=\"0.3 -0.2 0.1\">{INERTIAL}</body></body></body>"
        ),
    );
    let mut disagreement = Disagreement::default();
    let source = Source::new("robot.xml", text);
    crate::two_readings::compare_source(&mut disagreement, "mjcf", &source, &ModelOptions::default(), &mut Random(7));
    disagreement.judge();
}
