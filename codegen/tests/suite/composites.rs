//! Joints that are read as several: the same robot as with the single joints written out, and closed forms.

use straightline_codegen::description::composite::COMPOSITES;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::{load, ModelOptions};
use straightline_core::algorithms::{forward_kinematics, inverse_dynamics, mass_matrix};
use straightline_core::joint::Dialect;
use straightline_core::model::Model;
use straightline_core::Dd;

const LINKS: &str = r#"
[robot]
name = "cart"
gravity = [0.0, 0.0, -9.81]

[[link]]
name = "ground"

[[link]]
name = "cart"
mass = 4.5
com = [0.03, -0.02, 0.11]
inertia = { xx = 0.21, yy = 0.18, zz = 0.3, xy = 0.01, xz = -0.02, yz = 0.015 }
"#;

fn robot(joints: &str) -> Model<Dd> {
    let (model, diagnostics) = load(&Source::new("cart.toml", format!("{LINKS}\n{joints}")), &ModelOptions::default());
    assert!(!diagnostics.has_errors(), "{diagnostics}\n{joints}");
    model.expect("a robot without errors")
}

fn joint(name: &str, kind: &str, ends: [&str; 2], further: &str) -> String {
    let [parent, child] = ends;
    format!("[[joint]]\nname = \"{name}\"\nkind = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{child}\"\n{further}\n")
}

/// A composite joint, and the single joints that it stands for: name, kind, axis.
fn chain(parts: &[(&str, &str, &str)], origin: &str) -> String {
    let link = |k: usize| match k {
        0 => "ground".to_string(),
        k if k == parts.len() => "cart".to_string(),
        k => format!("c{k}"),
    };
    let carriers = (1..parts.len()).map(|k| format!("[[link]]\nname = \"c{k}\"\n"));
    let joints = parts.iter().enumerate().map(|(k, (name, kind, axis))| {
        let origin = if k == 0 { origin } else { "" };
        let limits = if *kind == "prismatic" { "limits = { lower = -inf, upper = inf }\n" } else { "" };
        joint(name, kind, [&link(k), &link(k + 1)], &format!("axis = {axis}\n{origin}{limits}"))
    });
    carriers.chain(joints).collect()
}

#[test]
fn a_composite_joint_is_the_single_joints_that_it_stands_for() {
    let origin = "origin = { xyz = [0.3, -0.1, 0.5], rpy_deg = [20, -35, 50] }\n";
    let coupling = "[[coupling]]\njoint = \"base_slide\"\nfollows = \"base\"\nratio = 0.004\n";
    let cases = [
        (
            "planar",
            "axis = \"z\"\n",
            chain(
                &[
                    ("base_x", "prismatic", "\"x\""),
                    ("base_y", "prismatic", "\"y\""),
                    ("base_theta", "continuous", "\"z\""),
                ],
                origin,
            ),
        ),
        (
            "planar",
            "axis = \"-x\"\n",
            chain(
                &[
                    ("base_x", "prismatic", "\"z\""),
                    ("base_y", "prismatic", "\"y\""),
                    ("base_theta", "continuous", "\"-x\""),
                ],
                origin,
            ),
        ),
        (
            "translation",
            "",
            chain(
                &[("base_x", "prismatic", "\"x\""), ("base_y", "prismatic", "\"y\""), ("base_z", "prismatic", "\"z\"")],
                origin,
            ),
        ),
        (
            "universal",
            "axis = \"x\"\naxis2 = [0, 1, 0.2]\n",
            chain(&[("base_1", "continuous", "\"x\""), ("base_2", "continuous", "[0, 1, 0.2]")], origin),
        ),
        (
            "cylindrical",
            "axis = [1, 2, 2]\n",
            chain(&[("base_slide", "prismatic", "[1, 2, 2]"), ("base_turn", "continuous", "[1, 2, 2]")], origin),
        ),
        (
            "helical",
            "axis = \"y\"\npitch = 0.004\n",
            chain(&[("base", "continuous", "\"y\""), ("base_slide", "prismatic", "\"y\"")], origin) + coupling,
        ),
    ];
    let mut seen = Vec::new();
    for (kind, further, single) in cases {
        seen.push(kind);
        let composite = robot(&joint("base", kind, ["ground", "cart"], &format!("{further}{origin}")));
        let written = robot(&single);
        let names = |model: &Model<Dd>| model.joints().iter().map(|j| j.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&composite), names(&written), "{kind}");
        assert_eq!(composite.couplings, written.couplings, "{kind}");
        let frames: Vec<&str> = composite.frames.iter().map(|frame| frame.name.as_str()).collect();
        assert_eq!(frames, ["ground", "cart"], "{kind}: links between are no frames");
        let wide = |k: usize| (0..composite.nv()).map(|i| Dd::from(0.7 - 0.3 * (i + k) as f64)).collect::<Vec<_>>();
        let [q, qd, qdd] = [0, 1, 2].map(wide);
        assert_eq!(inverse_dynamics(&composite, &q, &qd, &qdd), inverse_dynamics(&written, &q, &qd, &qdd), "{kind}");
        assert_eq!(mass_matrix(&composite, &q), mass_matrix(&written, &q), "{kind}");
        let pose = |model: &Model<Dd>| forward_kinematics(model, &q, &[model.frame("cart").expect("the link")]);
        assert_eq!(pose(&composite), pose(&written), "{kind}");
    }
    // those that SDF alone has are tried by robots in that format
    let mut all = COMPOSITES.iter().filter(|composite| composite.dialects.contains(&Dialect::JointFrames));
    assert!(all.all(|composite| seen.contains(&composite.word)), "every composite is tried");
}

#[test]
fn a_helical_joint_moves_its_pitch_in_a_turn() {
    // 5 mm in a turn: 4.5 kg that turn with 0.3 kg·m² and a little about the axis of a spindle
    let screw = "[[joint]]\nname = \"screw\"\nkind = \"helical\"\nparent = \"ground\"\nchild = \"cart\"\naxis = \"z\"\nlead = 0.005\nlimits = { lower = 0.0, upper = 200.0 }\ndamping = 0.1\n";
    let model = robot(screw);
    assert_eq!((model.nq(), model.nv(), model.bodies.len()), (1, 1, 2));
    assert_eq!(model.joints()[0].limits.upper, 200.0);
    let pitch = 0.005 / std::f64::consts::TAU;
    let turns = Dd::from(4.0 * std::f64::consts::TAU);
    let pose = forward_kinematics(&model, &[turns], &[model.frame("cart").expect("the link")])[0];
    assert!((pose.translation.z.to_f64() - 0.02).abs() < 1e-15);
    let about_axis = 0.3 + 4.5 * (0.03 * 0.03 + 0.02 * 0.02);
    let h = mass_matrix(&model, &[turns])[0].to_f64();
    assert!((h - (about_axis + 4.5 * pitch * pitch)).abs() < 1e-15 * h);
    // weight on the spindle, friction of the turn
    let tau = inverse_dynamics(&model, &[turns], &[Dd::from(2.0)], &[Dd::ZERO])[0].to_f64();
    assert!((tau - (4.5 * 9.81 * pitch + 0.2)).abs() < 1e-15);
}

#[test]
fn a_planar_joint_of_a_urdf_moves_across_its_axis() {
    let urdf = r#"<robot name="cart"><link name="ground"/><link name="cart"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.2"/></inertial></link>
        <joint name="base" type="planar"><parent link="ground"/><child link="cart"/><axis xyz="0 0 1"/></joint></robot>"#;
    let (model, diagnostics) = load(&Source::new("cart.urdf", urdf), &ModelOptions::default());
    assert!(diagnostics.is_empty(), "{diagnostics}");
    let model = model.expect("a robot");
    let names: Vec<&str> = model.joints().iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["base_x", "base_y", "base_theta"]);
    let q = [1.0, 2.0, 0.0].map(Dd::from);
    let h: Vec<f64> = mass_matrix(&model, &q).into_iter().map(|x| x.to_f64()).collect();
    let expected = [2.0, 0.0, 0.0, 0.0, 2.0, 0.2, 0.0, 0.2, 0.2 + 2.0 * 0.01];
    assert!(h.iter().zip(expected).all(|(h, x)| (h - x).abs() < 1e-16), "{h:?}");
}
