//! A robot file in another format is the same robot, and what the other format cannot say is listed, all of it and nothing else.

use crate::closing_joints;
use crate::robots::Random;
use crate::sdf::random_sdf;
use crate::two_readings::{chapter_toml, joint_frame_toml, random_robot, urdf};
use crate::written::{Shape, Style, Written};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use straightline_codegen::convert::compare::of_models;
use straightline_codegen::convert::{convert, messages::CODES, written_formats, ConvertOptions};
use straightline_codegen::description::write::FormatWriter;
use straightline_codegen::description::{FileFormat, FORMATS};
use straightline_codegen::diagnostic::{Diagnostics, Severity, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_core::algorithms::{inverse_dynamics, mass_matrix};
use straightline_core::model::Model;
use straightline_core::Dd;

const FOURBAR: &str = include_str!("../files/fourbar.toml");

type Target = (&'static FileFormat, &'static FormatWriter);

fn package() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn target(word: &str) -> Target {
    written_formats().find(|(_, writer)| writer.word == word).expect("the format is written")
}

/// The text in another format, and what is said.
fn converted(source: &Source, (format, writer): Target, options: ConvertOptions) -> (Option<Source>, Diagnostics) {
    let mut said = Diagnostics::new();
    let text = convert(source, format, options, &mut said);
    (text.map(|text| Source::new(&format!("converted.{}", writer.extensions[0]), text)), said)
}

fn model_of(source: &Source, floating_base: bool) -> Model<Dd> {
    let (model, said) = load(source, &ModelOptions { floating_base, ..ModelOptions::default() });
    model.unwrap_or_else(|| panic!("{said}\n{}", source.text()))
}

/// Names of all joints and frames, τ and H of some state are the same, to 1e-14 of the greatest entry. An SDF has `_` in place of `::`, and
/// `_joint` behind the name of a joint that a link has, too.
fn same(what: &str, before: &Model<Dd>, after: &Model<Dd>) {
    let plain = |name: &str| name.replace("::", "_");
    let joints = |m: &Model<Dd>| m.bodies.iter().map(|body| plain(&body.joint.name)).collect::<Vec<_>>();
    let frames = |m: &Model<Dd>| m.frames.iter().map(|frame| plain(&frame.name)).collect::<BTreeSet<_>>();
    let is_same = |(a, b): (&String, &String)| a == b || format!("{a}_joint") == *b;
    let (own, others) = (joints(before), joints(after));
    assert!(own.len() == others.len() && own.iter().zip(&others).all(is_same), "{what}: {own:?} and {others:?}");
    assert!(frames(after).is_superset(&frames(before)), "{what}: {:?} and {:?}", frames(before), frames(after));
    let own = |n: usize, phase: f64| (0..n).map(|i| Dd::from((1.3 * i as f64 + phase).sin())).collect::<Vec<_>>();
    let mut q = own(before.nq(), 0.4);
    // joints that follow have no coordinates among these
    for joint in before.bodies.iter().map(|body| &body.joint).filter(|joint| joint.iq < before.nq()) {
        joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]);
    }
    let (qd, qdd) = (own(before.nv(), 1.1), own(before.nv(), 2.3));
    let results = |m: &Model<Dd>| [mass_matrix(m, &q), inverse_dynamics(m, &q, &qd, &qdd)];
    for (a, b) in results(before).iter().zip(&results(after)) {
        let scale = a.iter().fold(0.0f64, |most, x| most.max(x.to_f64().abs()));
        let off = a.iter().zip(b).map(|(a, b)| (*a - *b).to_f64().abs()).fold(0.0, f64::max);
        assert!(off <= 1e-14 * scale, "{what}: off by {:e} of the greatest entry", off / scale);
    }
}

/// Converts to every format, and from there to every format again. The texts that could be made.
fn there_and_back(name: &str, source: &Source, options: ConvertOptions) -> Vec<(&'static str, String)> {
    let before = model_of(source, options.floating_base);
    let floats = before.bodies.first().is_some_and(|body| body.joint.kind.is_base());
    let mut texts = Vec::new();
    for to in written_formats() {
        let (first, said) = converted(source, to, options);
        let Some(first) = first else {
            assert!(said.iter().any(|d| d.code == "not-in-format"), "{name} to {}: {said}", to.1.word);
            continue;
        };
        let by_option = floats && to.1.floats_by_option;
        if !options.lossy {
            same(&format!("{name} as {}", to.1.word), &before, &model_of(&first, by_option));
        }
        for back in written_formats() {
            let own = ConvertOptions { floating_base: by_option, ..options };
            let (second, said) = converted(&first, back, own);
            let Some(second) = second else {
                assert!(said.iter().any(|d| d.code == "not-in-format"), "{name} to {}: {said}", back.1.word);
                continue;
            };
            if !options.lossy {
                let by_option = floats && back.1.floats_by_option;
                same(&format!("{name} as {}, {}", to.1.word, back.1.word), &before, &model_of(&second, by_option));
            }
        }
        texts.push((to.1.word, first.text().to_string()));
    }
    texts
}

fn robots_in(folder: &Path) -> Vec<PathBuf> {
    let is_robot = |path: &PathBuf| {
        let ends = FORMATS.iter().flat_map(|format| format.extensions).chain(&["xml"]);
        ends.clone().any(|end| path.extension().is_some_and(|own| own == *end))
    };
    let mut found: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("it is a folder").map(|e| e.expect("it can be read").path()).collect();
    found.retain(is_robot);
    found.sort();
    found
}

#[test]
fn every_robot_of_the_repository_is_the_same_in_every_format() {
    let mut written = 0;
    for folder in ["../robots/descriptions", "tests/files", "../generated_tests/reference/joints/robots"] {
        for path in robots_in(&package().join(folder)) {
            let name = path.file_name().expect("it has a name").to_string_lossy().into_owned();
            let source = Source::new(&name, std::fs::read_to_string(&path).expect("robots are texts"));
            if load(&source, &ModelOptions::default()).0.is_none() {
                continue; // closed loops, which are refused
            }
            written += there_and_back(&name, &source, ConvertOptions::default()).len();
            there_and_back(&name, &source, ConvertOptions { lossy: true, ..ConvertOptions::default() });
        }
    }
    assert!(written > 60, "only {written} files were written");
}

#[test]
fn random_robots_of_every_notation_are_the_same_in_every_format() {
    for seed in 0..15 {
        let mut random = Random(seed);
        let (links, floating_base) = (2 + random.below(9), random.below(3) == 0);
        let robot = random_robot(&mut random, links, floating_base);
        let gravity =
            |text: String| text.lines().filter(|line| !line.starts_with("gravity")).collect::<Vec<_>>().join("\n");
        let texts = [
            ("robot.urdf", urdf(&mut random, &robot)),
            ("robot.toml", gravity(joint_frame_toml(&mut random, &robot, floating_base))),
            ("chapter.toml", gravity(chapter_toml(&mut random, links))),
            ("robot.xml", random_mjcf(&mut random, links)),
            ("robot.sdf", random_sdf(&mut random)),
        ];
        for (name, text) in texts {
            let floating_base = floating_base && name == "robot.urdf";
            let options = ConvertOptions { floating_base, ..ConvertOptions::default() };
            there_and_back(&format!("{name}, seed {seed}"), &Source::new(name, text), options);
        }
    }
}

/// `urdfdom`, by which ROS and Pinocchio read, refuses `inf`, and limits without a greatest effort and speed.
#[test]
fn limits_of_urdf_are_numbers_that_other_readers_take() {
    let link = |name: &str| format!("[[link]]\nname = \"{name}\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n");
    let joint = |kind: &str, limits: &str, parent: &str, child: &str| {
        let ends = format!("kind = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{child}\"\naxis = \"z\"");
        format!("{}[[joint]]\nname = \"j_{child}\"\n{ends}\n{limits}\n", link(child))
    };
    let joints = [
        ("prismatic", ""),
        ("prismatic", "limits = { lower = -0.5 }"),
        ("revolute", "limits = { upper = 2.0, effort = 9.0 }"),
        ("revolute", "limits = { lower = -1.0, upper = 2.0, velocity = 3.0 }"),
        ("continuous", "limits = { velocity = 4.0 }"),
        ("continuous", ""),
    ];
    let mut text = format!("[robot]\nname = \"arm\"\n{}", link("l0"));
    for (k, (kind, limits)) in joints.iter().enumerate() {
        text += &joint(kind, limits, &format!("l{k}"), &format!("l{}", k + 1));
    }
    let written = there_and_back("limits", &Source::new("arm.toml", text), ConvertOptions::default());
    let (_, urdf) = written.iter().find(|(to, _)| *to == "urdf").expect("URDF says all of it");
    let limits: Vec<&str> = urdf.lines().map(str::trim).filter(|line| line.starts_with("<limit")).collect();
    let expected = [
        r#"<limit lower="-1e16" upper="1e16" effort="1e16" velocity="1e16"/>"#,
        r#"<limit lower="-0.5" upper="1e16" effort="1e16" velocity="1e16"/>"#,
        r#"<limit lower="-1e16" upper="2" effort="9" velocity="1e16"/>"#,
        r#"<limit lower="-1" upper="2" effort="1e16" velocity="3"/>"#,
        r#"<limit effort="1e16" velocity="4"/>"#,
    ];
    assert_eq!(limits, expected);
}

/// Of a greatest effort below zero the magnitude is read, and written.
#[test]
fn limits_below_zero_are_written_as_they_are_read() {
    let text = "<robot name=\"r\"><link name=\"b\"/><link name=\"l\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>\
                <joint name=\"j\" type=\"revolute\"><parent link=\"b\"/><child link=\"l\"/><limit lower=\"-1\" upper=\"1\" effort=\"-10\" velocity=\"-2\"/></joint></robot>";
    let texts = there_and_back("limits", &Source::new("limits.urdf", text), ConvertOptions::default());
    assert!(texts.len() > 2 && texts.iter().all(|(_, text)| text.contains("10") && !text.contains("effort=\"-")));
}

/// Few digits, right angles cut anywhere, dust, masses and units of every size.
#[test]
fn robots_as_people_write_them_are_the_same_in_every_format() {
    for (k, style) in Style::all().into_iter().enumerate() {
        let seed = 300 + k as u64;
        let robot = Written::new(style, Shape::any(&mut crate::written::Random(seed), 6), seed);
        let options = ConvertOptions { floating_base: robot.floating, lossy: false };
        let source = Source::new(robot.file_name(), robot.text());
        there_and_back(&format!("{}, seed {seed}", style.name()), &source, options);
    }
}

/// Bodies with anchors, several joints, references, frames, sites and orientations in all notations; no springs and armatures, which a URDF has
/// no place for.
fn random_mjcf(random: &mut Random, bodies: usize) -> String {
    let mut triple = |size: f64| [0; 3].map(|_| format!("{:?}", random.between(-1.0, 1.0).to_f64() * size)).join(" ");
    let mut text = String::new();
    for k in 0..bodies {
        let turn = match k % 5 {
            0 => format!("quat=\"0.3 {}\"", triple(1.0)),
            1 => format!("euler=\"{}\"", triple(3.0)),
            2 => format!("axisangle=\"{} 0.7\"", triple(1.0)),
            3 => format!("xyaxes=\"1 0.1 0 {}\"", triple(1.0)),
            _ => "euler=\"0 1.5707963267948966 0\"".to_string(),
        };
        text += &format!("<body name=\"b{k}\" pos=\"{}\" {turn}>", triple(1.0));
        for (j, kind) in ["slide", "hinge", "hinge"].iter().enumerate().take(1 + k % 3) {
            let effects = ["damping=\"0.3\"", "frictionloss=\"0.2\" range=\"-1 2\"", ""][j];
            let reference = ["", "ref=\"0.4\""][(k + j) % 2];
            let place = format!("pos=\"{}\" axis=\"{}\"", triple(0.2), triple(2.0));
            text += &format!("<joint name=\"j{k}_{j}\" type=\"{kind}\" {place} {effects} {reference}/>");
        }
        text += &format!(
            "<inertial pos=\"{}\" mass=\"1.5\" diaginertia=\"0.1 0.2 0.25\" quat=\"1 {}\"/>",
            triple(0.1),
            triple(1.0)
        );
        text += &format!("<frame pos=\"{}\"><site name=\"s{k}\" quat=\"0.5 {}\"/>", triple(0.3), triple(1.0));
        if k % 2 == 0 {
            text += "</frame>";
        }
    }
    for k in (0..bodies).rev() {
        text += if k % 2 == 0 { "</body>" } else { "</frame></body>" };
    }
    format!("<mujoco model=\"random\"><compiler angle=\"radian\"/><worldbody>{text}</worldbody></mujoco>")
}

/// A robot with one thing more: in place of `joint`, `link` or `top` of a plain arm in TOML.
fn arm(joint: &str, link: &str, top: &str) -> String {
    format!(
        "[robot]\nname = \"arm\"\n[[link]]\nname = \"base\"\n[[link]]\nname = \"upper\"\nmass = 2.0\ncom = [0.1, 0.0, 0.2]\n\
         inertia = [0.1, 0.2, 0.15]\n{link}\n[[joint]]\nname = \"shoulder\"\nkind = \"continuous\"\nparent = \"base\"\nchild = \"upper\"\n\
         axis = \"y\"\n{joint}\n{top}\n"
    )
}

/// Every row of every writer: a robot of which it is said, and of which nothing else is, with whom it is about and whether it is an error.
#[test]
fn what_a_format_cannot_say_is_listed_and_nothing_else() {
    let second = "[[link]]\nname = \"fore\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\n";
    let fixed = "[[joint]]\nname = \"weld\"\nkind = \"fixed\"\nparent = \"upper\"\nchild = \"fore\"\n";
    let elbow =
        "[[joint]]\nname = \"elbow\"\nkind = \"continuous\"\nparent = \"upper\"\nchild = \"fore\"\naxis = \"x\"\n";
    let coupling = "[[coupling]]\njoint = \"elbow\"\nfollows = \"shoulder\"\n";
    let motor = "motor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-5 }";
    let beside = "<mujoco><worldbody><body name=\"a\"><joint name=\"j\" pos=\"0 0 1\"/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/></body></worldbody></mujoco>";
    let several =
        beside.replace("<joint name=\"j\" pos=\"0 0 1\"/>", "<joint name=\"i\"/><joint name=\"j\" axis=\"1 0 0\"/>");
    let shown = "<robot name=\"arm\"><link name=\"base\"/><link name=\"upper\"><visual/><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>\
                 <joint name=\"j\" type=\"continuous\"><parent link=\"base\"/><child link=\"upper\"/></joint></robot>";
    // links and joints of a four-bar with names of their own
    let closed = ["[[link]]\nname = \"", "parent = \"", "child = \"", "link = \""].iter();
    let closed = closed.fold(FOURBAR.to_string(), |text, key| text.replace(key, &format!("{key}body_")));
    // and links in place of its frames
    let with_links = ["coupler_pin", "rocker_pin", "tool"].iter().fold(closed.clone(), |text, name| {
        let link = format!("[[link]]\nname = \"{name}\"\n[[joint]]\nname = \"{name}_fixed\"\nkind = \"fixed\"\nchild = \"{name}\"\nparent");
        text.replace(&format!("[[frame]]\nname = \"{name}\"\nlink"), &link)
    });
    let with_links = with_links.replace("\nxyz =", "\norigin.xyz =");
    let ring = |joints: usize, kind: &str| closing_joints::arm(joints, kind).text().to_string();
    let rows: Vec<(&str, &str, String, &str, &str)> = vec![
        ("closed loops", "urdf", with_links, "loop `pin` (line 81)", "not-in-format"),
        ("closed loops", "mjcf", closed.clone(), "loop `pin` (line 69)", "said-otherwise"),
        (
            "assemblies of closed loops by name",
            "mjcf",
            closed.replace("[[loop]]\n", "[[loop]]\nassembly = \"mirrored\"\n"),
            "loop `pin` (line 69)",
            "not-in-format",
        ),
        (
            "closed loops whose joints are not at zero where they close",
            "sdf",
            closing_joints::shifted_arm(7, "spherical", 0.01).text().to_string(),
            "loop `ring` (line 97)",
            "not-in-format",
        ),
        ("closed loops", "sdf", ring(7, "spherical"), "loop `ring` (line 97)", "said-otherwise"),
        (
            "closed loops whose last joint is a hinge that does not lie across their plane",
            "mjcf",
            ring(6, "revolute"),
            "loop `ring` (line 85)",
            "not-in-format",
        ),
        ("closed loops whose last joint is a weld", "sdf", ring(7, "fixed"), "loop `ring` (line 97)", "not-in-format"),
        (
            "closed loops whose last joint is a hinge, of robots with ball joints",
            "sdf",
            ring(6, "revolute")
                .replace("\"continuous\"\nparent = \"l4\"", "\"spherical\"\nparent = \"l4\"")
                .replace("axis = [1.0, 0.2, 0.0]\n", ""),
            "loop `ring` (line 84)",
            "not-in-format",
        ),
        (
            "which joints closed loops determine",
            "sdf",
            ring(7, "spherical") + "determines = [\"j0\", \"j1\", \"j2\"]\n",
            "loop `ring` (line 97)",
            "not-in-format",
        ),
        (
            "assemblies of closed loops by name",
            "sdf",
            closing_joints::cut_coupler("spherical").text().to_string() + "assembly = \"mirrored\"\n",
            "loop `seam` (line 65)",
            "not-in-format",
        ),
        ("springs", "urdf", arm("spring = { stiffness = 3.0 }", "", ""), "joint `shoulder` (line 17)", "not-in-format"),
        (
            "rotors, gears and armatures",
            "urdf",
            arm("armature = 0.1", "", ""),
            "joint `shoulder` (line 17)",
            "not-in-format",
        ),
        (
            "rotors, gears and armatures",
            "urdf",
            arm("rotor_inertia = 0.1\ngear_ratio = 9", "", ""),
            "joint `shoulder` (line 17)",
            "not-in-format",
        ),
        (
            "the direction or size of gravity",
            "urdf",
            arm("", "", "")
                .replace("\n[[link]]\nname = \"base\"", "\ngravity = [0, 0, -1.62]\n[[link]]\nname = \"base\""),
            "[0.0, 0.0, -1.62] (line 3)",
            "not-in-format",
        ),
        (
            "drives",
            "urdf",
            arm("", "", &format!("[[drive]]\njoint = \"shoulder\"\n{motor}")),
            "drive `shoulder` (line 19)",
            "not-in-format",
        ),
        (
            "drives",
            "mjcf",
            arm("", "", &format!("[[drive]]\njoint = \"shoulder\"\n{motor}")),
            "drive `shoulder` (line 19)",
            "not-in-format",
        ),
        (
            "rotors, gears and armatures",
            "sdf",
            arm("armature = 0.1", "", ""),
            "joint `shoulder` (line 17)",
            "not-in-format",
        ),
        (
            "drives",
            "sdf",
            arm("", "", &format!("[[drive]]\njoint = \"shoulder\"\n{motor}")),
            "drive `shoulder` (line 19)",
            "not-in-format",
        ),
        (
            "links that bend",
            "sdf",
            arm("", "flexible = { to = [0, 0, 0.5], bending = 9.0 }", ""),
            "link `upper` (line 10)",
            "not-in-format",
        ),
        (
            "limits from 10¹⁶ on",
            "sdf",
            arm("limits = { effort = 1e16 }", "", ""),
            "joint `shoulder` (line 17)",
            "left-out",
        ),
        (
            "limits from 10¹⁶ on",
            "urdf",
            arm("limits = { effort = 1e16 }", "", ""),
            "joint `shoulder` (line 17)",
            "left-out",
        ),
        (
            "names that are words of SDF",
            "sdf",
            arm("", "", "").replace("upper", "__upper__"),
            "link `__upper__` (line 6)",
            "left-out",
        ),
        (
            "hold `::`",
            "sdf",
            arm("", "", "").replace("upper", "left::upper"),
            "link `left::upper` (line 6)",
            "left-out",
        ),
        (
            "belong to a joint and a link",
            "sdf",
            arm("", "", "").replace("shoulder", "upper"),
            "joint `upper` (line 12)",
            "left-out",
        ),
        (
            "moving bodies without mass",
            "sdf",
            arm("", "", &format!("{second}{elbow}"))
                .replace("mass = 2.0\ncom = [0.1, 0.0, 0.2]\ninertia = [0.1, 0.2, 0.15]", ""),
            "link `upper` (line 6)",
            "left-out",
        ),
        (
            "inertias that no body has",
            "sdf",
            arm("", "", &format!("[[link]]\nname = \"fore\"\nmass = 0.0\ninertia = [0, 0.35, 0]\n{fixed}")),
            "link `fore` (line 21)",
            "left-out",
        ),
        (
            "inertias that no body has",
            "sdf",
            arm("", "", "").replace("0.2, 0.15]", "0.2, 0.4]"),
            "link `upper` (line 9)",
            "left-out",
        ),
        (
            "the mass of the world",
            "sdf",
            arm("", "", "")
                .replace("name = \"base\"\n", "name = \"world\"\nmass = 1.0\ninertia = [1, 1, 1]\n")
                .replace("parent = \"base\"", "parent = \"world\""),
            "link `world` (line 5)",
            "said-otherwise",
        ),
        ("bodies with several joints", "sdf", several.clone(), "link `i_carrier` (line 1)", "said-otherwise"),
        (
            "links without mass on fixed joints",
            "sdf",
            arm("", "", &format!("[[link]]\nname = \"fore\"\n{fixed}")),
            "link `fore` (line 19)",
            "said-otherwise",
        ),
        ("things that the dynamics do not need", "sdf", shown.to_string(), "visual (line 1)", "said-otherwise"),
        (
            "links that bend",
            "urdf",
            arm("", "flexible = { to = [0, 0, 0.5], bending = 9.0 }", ""),
            "link `upper` (line 10)",
            "not-in-format",
        ),
        (
            "links that bend",
            "mjcf",
            arm("", "flexible = { to = [0, 0, 0.5], bending = 9.0 }", ""),
            "link `upper` (line 10)",
            "not-in-format",
        ),
        (
            "ball joints",
            "urdf",
            arm("", "", "").replace("continuous", "ball"),
            "joint `shoulder` (line 12)",
            "left-out",
        ),
        (
            "damping of floating bases",
            "urdf",
            arm("", "", "")
                .replace("name = \"arm\"", "name = \"arm\"\nbase = \"floating\"\nbase_damping = 0.5")
                .replace("name = \"base\"\n", "name = \"base\"\nmass = 1.0\ninertia = [1, 1, 1]\n"),
            "robot `arm` (line 4)",
            "not-in-format",
        ),
        (
            "damping of floating bases",
            "sdf",
            arm("", "", "")
                .replace("name = \"arm\"", "name = \"arm\"\nbase = \"floating\"\nbase_damping = 0.5")
                .replace("name = \"base\"\n", "name = \"base\"\nmass = 1.0\ninertia = [1, 1, 1]\n"),
            "robot `arm` (line 4)",
            "not-in-format",
        ),
        (
            "damping of ball joints",
            "sdf",
            arm("damping = 0.5", "", "").replace("continuous", "ball"),
            "joint `shoulder` (line 17)",
            "not-in-format",
        ),
        (
            "floating bases",
            "urdf",
            arm("", "", "")
                .replace("name = \"arm\"", "name = \"arm\"\nbase = \"floating\"")
                .replace("name = \"base\"\n", "name = \"base\"\nmass = 1.0\ninertia = [1, 1, 1]\n"),
            "robot `arm` (line 3)",
            "said-otherwise",
        ),
        ("bodies with several joints", "urdf", several.clone(), "link `i_carrier` (line 1)", "said-otherwise"),
        ("bodies with several joints", "toml", several, "link `i_carrier` (line 1)", "said-otherwise"),
        ("joints beside the frames of their links", "urdf", beside.to_string(), "joint `j` (line 1)", "said-otherwise"),
        ("joints beside the frames of their links", "toml", beside.to_string(), "joint `j` (line 1)", "said-otherwise"),
        (
            "frames",
            "urdf",
            arm("", "", "[[frame]]\nname = \"tool\"\nlink = \"upper\""),
            "frame `tool` (line 19)",
            "said-otherwise",
        ),
        ("things that the dynamics do not need", "urdf", shown.to_string(), "visual (line 1)", "said-otherwise"),
        ("things that the dynamics do not need", "mjcf", shown.to_string(), "visual (line 1)", "said-otherwise"),
        ("things that the dynamics do not need", "toml", shown.to_string(), "visual (line 1)", "said-otherwise"),
        (
            "velocity limits",
            "mjcf",
            arm("limits = { velocity = 3.0 }", "", ""),
            "joint `shoulder` (line 17)",
            "left-out",
        ),
        (
            "ranges with one end",
            "mjcf",
            arm("limits = { lower = -1.0 }", "", "").replace("continuous", "revolute"),
            "joint `shoulder` (line 12)",
            "left-out",
        ),
        (
            "effort limits of zero",
            "mjcf",
            arm("limits = { effort = 0.0 }", "", ""),
            "joint `shoulder` (line 17)",
            "left-out",
        ),
        (
            "moving bodies without mass",
            "mjcf",
            arm("", "", &format!("{second}{elbow}"))
                .replace("mass = 2.0\ncom = [0.1, 0.0, 0.2]\ninertia = [0.1, 0.2, 0.15]", ""),
            "link `upper` (line 6)",
            "left-out",
        ),
        (
            "inertias that no body has",
            "mjcf",
            arm("", "", "").replace("0.2, 0.15]", "0.2, 0.4]"),
            "link `upper` (line 9)",
            "left-out",
        ),
        (
            "rotors and gears",
            "mjcf",
            arm("rotor_inertia = 0.1\ngear_ratio = 9", "", ""),
            "joint `shoulder` (line 17)",
            "said-otherwise",
        ),
        (
            "the mass of the world",
            "mjcf",
            arm("", "", "")
                .replace("name = \"base\"\n", "name = \"world\"\nmass = 1.0\ninertia = [1, 1, 1]\n")
                .replace("parent = \"base\"", "parent = \"world\""),
            "link `world` (line 5)",
            "said-otherwise",
        ),
        (
            "names of fixed joints",
            "mjcf",
            arm("", "", &format!("{second}{fixed}")),
            "joint `weld` (line 23)",
            "said-otherwise",
        ),
        (
            "couplings",
            "mjcf",
            arm("", "", &format!("{second}{elbow}{coupling}")),
            "joint `elbow` (line 29)",
            "said-otherwise",
        ),
    ];
    let mut seen: BTreeSet<(&str, &str)> = BTreeSet::new();
    for (what, word, text, whom, code) in &rows {
        let source = Source::new(if text.starts_with('<') { "arm.xml" } else { "arm.toml" }, text.clone());
        let (text, said) = converted(&source, target(word), ConvertOptions::default());
        // of a damped base it is said, too, that it floats
        // and of a loop with a name of its assembly, that it is one
        let is_beside = |code: &str| {
            let beside = [
                "damping of floating bases",
                "assemblies of closed loops by name",
                "which joints closed loops determine",
            ];
            beside.contains(what) && code == "said-otherwise"
        };
        let of_conversion: Vec<_> = said.iter().filter(|d| CODES.contains(&d.code) && !is_beside(d.code)).collect();
        assert_eq!(of_conversion.len(), 1, "{what}, {word}: {said}");
        let complaint = of_conversion[0];
        assert_eq!((complaint.code, complaint.detail.as_str()), (*code, *whom), "{what}, {word}: {said}");
        assert!(complaint.title.contains(what), "{what}, {word}: {said}");
        assert_eq!(text.is_none(), complaint.severity == Severity::Error, "{what}, {word}");
        // what is refused can be left out
        let (text, said) =
            converted(&source, target(word), ConvertOptions { lossy: true, ..ConvertOptions::default() });
        assert!(text.is_some(), "{what}, {word}: {said}");
        seen.insert((what, word));
    }
    for (_, writer) in written_formats() {
        for loss in writer.losses {
            let is_seen = seen.iter().any(|(what, word)| loss.what.contains(what) && *word == writer.word);
            assert!(is_seen, "no robot with {} for {}", loss.what, writer.word);
        }
    }
}

#[test]
fn right_angles_and_digits_are_those_of_the_file() {
    let text = arm("origin = { xyz = [0.1, 1e-7, 123456.789], rpy_quarter_turns = [1, 0, -1] }", "", "");
    let source = Source::new("arm.toml", text);
    for (word, parts) in [
        ("toml", &["xyz = [0.1, 1e-7, 123456.789], rpy_quarter_turns = [1, 0, -1]"][..]),
        ("urdf", &["xyz=\"0.1 1e-7 123456.789\" rpy=\"1.5707963267948966 0 -1.5707963267948966\""]),
        ("mjcf", &["pos=\"0.1 1e-7 123456.789\" euler=\"1.5707963267948966 0 -1.5707963267948966\""]),
    ] {
        let (text, said) = converted(&source, target(word), ConvertOptions::default());
        let text = text.unwrap_or_else(|| panic!("{said}"));
        parts.iter().for_each(|part| assert!(text.text().contains(part), "{part}\n{}", text.text()));
    }
    // a quaternion of right angles
    let mjcf = "<mujoco><worldbody><body name=\"a\" quat=\"0.5 0.5 0.5 0.5\"><joint name=\"j\"/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/></body></worldbody></mujoco>";
    let (text, said) = converted(&Source::new("a.xml", mjcf), target("toml"), ConvertOptions::default());
    let text = text.unwrap_or_else(|| panic!("{said}"));
    assert!(text.text().contains("rpy_deg = [90, 0, 90]"), "{}", text.text());
}

/// Names that a format must escape, and one that XML cannot hold.
#[test]
fn names_come_back_whatever_they_are() {
    for name in ["a \\\"b\\\" <c> & 'd'", "größe/λ", "two\\nlines\\tand\\\\more", "ends in _fixed_fixed"] {
        let text = arm("", "", "").replace("upper", name).replace("shoulder", name);
        for to in written_formats() {
            let (text, said) = converted(&Source::new("arm.toml", text.clone()), to, ConvertOptions::default());
            assert!(text.is_some(), "{}: {said}", to.1.word);
        }
    }
    let (text, said) = converted(
        &Source::new("arm.toml", arm("", "", "").replace("upper", "\\u0001")),
        target("urdf"),
        ConvertOptions::default(),
    );
    assert!(text.is_none() && said.iter().any(|d| d.code == "not-as-read"), "{said}");
}

/// `convert_messages/CODE.*` is the smallest file that causes the message CODE in the format that stands here, `CODE.txt` all that is said of it.
/// `UPDATE_EXPECTED=1 cargo test -p straightline-codegen --test suite convert::` rewrites the texts; read the difference.
#[test]
fn every_message_has_its_exact_text() {
    let folder = package().join("tests/convert_messages");
    let chapter =
        FORMATS.iter().rev().find(|format| format.write.is_none()).expect("there is a format that is read alone");
    for code in CODES {
        let format = match *code {
            "not-written" => chapter,
            "not-in-format" | "not-as-read" => target("urdf").0,
            _ => target("mjcf").0,
        };
        let ends = ["toml", "urdf"].map(|end| format!("{code}.{end}"));
        let name = ends.iter().find(|name| folder.join(name).exists()).unwrap_or_else(|| panic!("no file for {code}"));
        let source = Source::new(name, std::fs::read_to_string(folder.join(name)).expect("it is a text"));
        let mut said = Diagnostics::new();
        let text = convert(&source, format, ConvertOptions::default(), &mut said);
        assert_eq!(text.is_none(), said.has_errors(), "{code}: {said}");
        assert!(said.iter().any(|d| d.code == *code), "{code}: not said, but\n{said}");
        let path = folder.join(format!("{code}.txt"));
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            std::fs::write(&path, said.render()).expect("the folder of messages can be written");
        }
        assert_eq!(std::fs::read_to_string(&path).unwrap_or_default(), said.render(), "{code}");
    }
}

/// What is written is compared with what was meant: a robot that differs in one number, one name or one place is told.
#[test]
fn the_comparison_finds_what_differs() {
    let robot = arm(
        "origin = { xyz = [0.1, 0.2, 0.3], rpy = [0.1, 0.2, 0.3] }\nlimits = { velocity = 3.0, effort = 2.0 }\ndamping = 0.1\nfriction = 0.2\narmature = 0.3\n\
         spring = { stiffness = 5.0, rest = 0.5 }",
        "",
        "[[link]]\nname = \"fore\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\n[[joint]]\nname = \"elbow\"\nkind = \"continuous\"\nparent = \"upper\"\n\
         child = \"fore\"\naxis = \"x\"\n[[coupling]]\njoint = \"elbow\"\nfollows = \"shoulder\"\nratio = 2.0\n[[frame]]\nname = \"tool\"\nlink = \"fore\"\nxyz = [0.1, 0, 0]",
    );
    let model = |text: &str| model_of(&Source::new("arm.toml", text), false);
    let wanted = model(&robot);
    assert_eq!(of_models(&wanted, &wanted), None);
    for (old, new, part) in [
        ("name = \"arm\"", "name = \"leg\"", "is called `leg`"),
        ("[[link]]\nname = \"base\"", "gravity = [0, 0, -9.810001]\n[[link]]\nname = \"base\"", "gravity"),
        ("mass = 2.0", "mass = 2.00000000000002", "the mass"),
        ("com = [0.1, 0.0, 0.2]", "com = [0.1, 1e-14, 0.2]", "the centre of mass"),
        ("[0.1, 0.2, 0.15]", "[0.1, 0.2, 0.15000000000001]", "the inertia"),
        ("xyz = [0.1, 0.2, 0.3]", "xyz = [0.1, 0.20000000000001, 0.3]", "stands elsewhere"),
        ("rpy = [0.1, 0.2, 0.3]", "rpy = [0.1, 0.20000000000001, 0.3]", "stands elsewhere"),
        ("name = \"shoulder\"", "name = \"shouldr\"", "name, kind"),
        ("velocity = 3.0", "velocity = 3.0000000000000004", "limits"),
        ("damping = 0.1", "damping = 0.10000000000000002", "friction or spring"),
        ("friction = 0.2", "friction = 0.20000000000000004", "friction or spring"),
        ("armature = 0.3", "armature = 0.300000000000003", "rotor"),
        ("rest = 0.5", "rest = 0.5000000000000001", "friction or spring"),
        ("ratio = 2.0", "ratio = 2.0000000000000004", "couplings"),
        ("name = \"tool\"", "name = \"tol\"", "no frame `tool`"),
        ("xyz = [0.1, 0, 0]", "xyz = [0.1, 1e-14, 0]", "frame `tool`"),
        ("kind = \"continuous\"\nparent = \"upper\"", "kind = \"prismatic\"\nparent = \"upper\"", "name, kind"),
    ] {
        assert_eq!(robot.matches(old).count(), 1, "{old}");
        let text = robot.replace(old, new).replace(
            "follows = \"shoulder\"",
            if new.contains("shouldr") { "follows = \"shouldr\"" } else { "follows = \"shoulder\"" },
        );
        let difference = of_models(&wanted, &model(&text));
        assert!(difference.as_ref().is_some_and(|difference| difference.contains(part)), "{old}: {difference:?}");
    }
}

/// All keys of drives and of flexible links, as far as one robot can have them.
#[test]
fn drives_and_links_that_bend_come_back() {
    let elbow = "[[link]]\nname = \"fore\"\nmass = 1.0\ncom = [0.2, 0, 0]\ninertia = [0.01, 0.1, 0.1]\n\
                 flexible = { from = [0.01, 0, 0], to = [0.5, 0, 0], segments = 2, bending = { y = 40.0, z = 30.0 }, torsion = 7.0, damping = 0.001 }\n\
                 [[joint]]\nname = \"elbow\"\nkind = \"continuous\"\nparent = \"upper\"\nchild = \"fore\"\naxis = \"x\"\n";
    let motor = "torque_constant = 0.05, emf_constant = 0.06, resistance = 1.2, inductance = 5e-4, rotor_inertia = 1e-5, friction = 2e-5";
    let thermal = "{ winding_housing = 2.0, housing_ambient = 3.0, winding_time = 20.0, housing_time = 900.0, ambient = 20.0, limit = 120.0 }";
    let first = format!(
        "[[drive]]\njoint = \"shoulder\"\nratio = -100.0\nmotor = {{ {motor}, thermal = {thermal} }}\nefficiency = {{ forward = 0.8, backward = 0.65 }}\n\
         limits = {{ input = 24.0, current = 6.0, continuous_current = 3.0, speed = 500.0 }}\n"
    );
    let stages = "[{ ratio = 2.5, stiffness = 90.0, damping = 0.01, input_inertia = 2e-6, output_inertia = 8e-6, efficiency = 0.9 }, { ratio = 100.0, input_inertia = 1e-5 }]";
    let second = format!(
        "[[drive]]\nname = \"both\"\njoints = {{ elbow = 50.0, shoulder = 20.0 }}\nmotor = {{ torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-5 }}\n\
         stages = {stages}\nrotor = {{ link = \"upper\", axis = [0.0, 0.6, 0.8], inertia = 2e-5 }}\n"
    );
    let third = "[[drive]]\nname = \"hydraulic\"\njoint = \"elbow\"\nactuator = { C = [[0, 1], [0, -2]], f = [0, -10], d = [0, 5], T = [0, 1], position = [1, 0] }\n";
    for drives in [vec![first.as_str()], vec![&second], vec![third], vec![&first, third]] {
        let source = Source::new("arm.toml", arm("", "", &format!("{elbow}{}", drives.concat())));
        let (text, said) = converted(&source, target("toml"), ConvertOptions::default());
        let text = text.unwrap_or_else(|| panic!("{said}\n{}", source.text()));
        assert_eq!(model_of(&source, false).drives, model_of(&text, false).drives);
        assert!(!said.iter().any(|d| CODES.contains(&d.code)), "{said}");
    }
    for bends in ["{ to = [0, 0, 0.5], bending = 120.0 }", "{ to = [0.1, 0, 0.5], torsion = 9.0, segments = 3 }"] {
        let source = Source::new("arm.toml", arm("", &format!("flexible = {bends}"), ""));
        let (text, said) = converted(&source, target("toml"), ConvertOptions::default());
        assert!(text.is_some(), "{said}");
    }
}
