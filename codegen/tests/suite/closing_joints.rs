//! Hinges in space and welds that close loops: beside the second author, beside loops that are closed otherwise, in every format that has them.

use crate::loops::{model, state, verified};
use straightline_codegen::convert::{convert, format_of_word, ConvertOptions};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::Function;
use straightline_core::algorithms as alg;
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::Dd;

/// Where each joint of the arm stands in the link before, and its axis.
const ARM: [([f64; 3], [f64; 3]); 7] = [
    ([0.0, 0.0, 0.2], [0.0, 0.0, 1.0]),
    ([0.05, 0.0, 0.25], [0.0, 1.0, 0.2]),
    ([0.3, 0.05, 0.1], [0.1, 1.0, 0.0]),
    ([0.25, 0.0, -0.05], [1.0, 0.0, 0.3]),
    ([0.1, -0.05, -0.2], [0.0, 1.0, -0.4]),
    ([0.05, 0.1, -0.15], [1.0, 0.2, 0.0]),
    ([0.08, 0.0, -0.1], [0.2, -0.3, 1.0]),
];

/// The first joints of the arm, and where the next one would be, held to the ground there as it stands.
pub fn arm(joints: usize, kind: &str) -> Source {
    shifted_arm(joints, kind, 0.0)
}

/// The same, held so far along x from where it stands.
pub fn shifted_arm(joints: usize, kind: &str, shift: f64) -> Source {
    let mut text = "robot = { name = \"arm\", gravity = [0, 0, -9.81] }\n[[link]]\nname = \"ground\"\n".to_string();
    let mut before = "ground".to_string();
    let mut reached = [0.0; 3];
    for (k, (place, axis)) in ARM.iter().enumerate().take(joints) {
        let mass = 2.0 - 0.2 * k as f64;
        text += &format!(
            "[[link]]\nname = \"l{k}\"\nmass = {mass}\ncom = [0.05, 0.02, -0.04]\n\
             inertia = {{ xx = {0}, yy = {1}, zz = {2}, xy = {3} }}\n",
            0.02 * mass,
            0.03 * mass,
            0.015 * mass,
            0.001 * mass
        );
        text += &format!(
            "[[joint]]\nname = \"j{k}\"\nkind = \"continuous\"\nparent = \"{before}\"\nchild = \"l{k}\"\naxis = {axis:?}\n\
             origin = {{ xyz = {place:?} }}\n"
        );
        before = format!("l{k}");
        reached = std::array::from_fn(|i| reached[i] + place[i]);
    }
    let own = ARM.get(joints).map_or([0.0; 3], |next| next.0);
    let held: [f64; 3] = std::array::from_fn(|i| reached[i] + own[i]);
    let held = [held[0] + shift, held[1], held[2]];
    let axis = if kind == "revolute" { format!("axis = {:?}\n", ARM[joints].1) } else { String::new() };
    text += &format!(
        "[[frame]]\nname = \"held\"\nlink = \"{before}\"\nxyz = {own:?}\n\
         [[frame]]\nname = \"holder\"\nlink = \"ground\"\nxyz = {held:?}\n\
         [[loop]]\nname = \"ring\"\nframe = \"held\"\nwith = \"holder\"\nkind = \"{kind}\"\n{axis}"
    );
    Source::new("arm.toml", text)
}

fn plain(source: &Source) -> Model<Dd> {
    model(source, &ModelOptions::default())
}

#[test]
fn a_hinge_takes_five_velocities_and_a_weld_six() {
    for (joints, kind, equations, left) in [(6, "revolute", 5, 1), (7, "fixed", 6, 1), (7, "spherical", 3, 4)] {
        let closed = plain(&arm(joints, kind));
        let own: Vec<usize> = closed.closure.loops.iter().map(|of| of.equations()).collect();
        assert_eq!((own, closed.nv()), (vec![equations], left), "{kind}");
    }
}

/// Six joints and a hinge to the ground are the ring of seven joints whose last link a weld holds there: its mass has no part in the dynamics.
#[test]
fn a_weld_behind_a_joint_is_that_joint_as_a_hinge() {
    let (hinged, welded) = (plain(&arm(6, "revolute")), plain(&arm(7, "fixed")));
    let mut random = Random(5);
    for _ in 0..5 {
        let [q, qd, qdd] = state(&hinged, &mut random);
        let mut from = q.clone();
        from.push(Dd::ZERO);
        let (of_weld, gaps) = welded.close_loops(&from, 8);
        assert!(gaps.iter().all(|gap| gap.abs().to_f64() < 1e-28), "{gaps:?}");
        for (a, b) in q.iter().zip(&of_weld) {
            assert!((*a - *b).abs().to_f64() < 1e-26, "{a:?} {b:?}");
        }
        let pairs = [
            (alg::inverse_dynamics(&hinged, &q, &qd, &qdd), alg::inverse_dynamics(&welded, &of_weld, &qd, &qdd)),
            (alg::mass_matrix(&hinged, &q), alg::mass_matrix(&welded, &of_weld)),
            (hinged.embedding(&q).concat(), welded.embedding(&of_weld).concat()[..5].to_vec()),
        ];
        for (a, b) in pairs.iter().flat_map(|(a, b)| a.iter().zip(b)) {
            assert!((*a - *b).abs().to_f64() < 1e-23 * a.abs().to_f64().max(1.0), "{a:?} {b:?}");
        }
    }
}

/// H ẍ + h = S τ + Jᵀ λ of the tree, with the rows of relative velocities in the world: those of the generic Jacobian, not of the loop's equations.
#[test]
fn forces_are_those_of_the_tree_with_multipliers() {
    use straightline_core::model::Frame;
    use straightline_core::spatial::Transform;
    for (source, across) in [(arm(7, "fixed"), None), (arm(6, "revolute"), Some(ARM[6].1))] {
        let closed = plain(&source);
        let mut open = closed.clone();
        open.closure = Default::default();
        let mut random = Random(2);
        let [q, qd, qdd] = state(&closed, &mut random);
        let [y, yd, ydd] = closed.tree_motion([&q, &qd, &qdd]);
        let of_tree = alg::inverse_dynamics(&open, &q, &yd, &ydd);
        let end = closed.closure.loops[0].ends[0];
        let placement = Transform { translation: end.point, ..Transform::identity() };
        let frame = Frame { name: String::new(), body: end.body, placement };
        let rows = alg::jacobian(&open, &y, &frame);
        let all = of_tree.len();
        let row = |k: usize| rows[k * all..(k + 1) * all].to_vec();
        let mut held: Vec<Vec<Dd>> = (0..6).map(row).collect();
        if let Some(axis) = across {
            // the hinge stands in the world: two directions across it
            let [x, y, z] = axis.map(Dd::from);
            let turning = held.split_off(3);
            let sum = |parts: [(Dd, usize); 2]| {
                (0..all).map(|i| parts.iter().fold(Dd::ZERO, |sum, (a, k)| sum + *a * turning[*k][i])).collect()
            };
            held.extend([sum([(y, 0), (-x, 1)]), sum([(z, 0), (-x, 2)])]);
        }
        for row in &held {
            let rate = row.iter().zip(yd.iter()).fold(Dd::ZERO, |sum, (j, x)| sum + *j * *x);
            assert!(rate.abs().to_f64() < 1e-26, "{rate:?}");
        }
        let n = closed.nv();
        let matrix = nalgebra::DMatrix::from_fn(all, all, |i, j| match j.checked_sub(n) {
            None => Dd::from(f64::from(i == j)),
            Some(k) => held[k][i],
        });
        let found = straightline_core::reference::drives::solve_general(matrix, nalgebra::DVector::from_vec(of_tree));
        for (force, found) in alg::inverse_dynamics(&closed, &q, &qd, &qdd).iter().zip(found.iter()) {
            assert!((*force - *found).abs().to_f64() < 1e-24 * force.abs().to_f64().max(1.0), "{force:?} {found:?}");
        }
    }
}

#[test]
fn functions_are_the_second_authors() {
    let few = [Function::InverseDynamics, Function::LoopMotion, Function::LoopJacobian, Function::CloseLoops];
    verified(&arm(7, "fixed"), |f| few.contains(&f));
    verified(&arm(6, "revolute"), |f| few.contains(&f));
    verified(&cut_coupler("fixed"), |f| few.contains(&f));
}

#[test]
#[ignore = "slow proof: all functions of a ring of seven joints"]
fn slow_proof_that_all_functions_of_rings_are_the_second_authors() {
    for source in [arm(7, "fixed"), arm(6, "revolute"), cut_coupler("fixed")] {
        verified(&source, |_| true);
    }
}

const HALF: &str = "mass = 0.4\ncom = [0.1, 0, 0.05]\ninertia = [0.002, 0.003, 0.004]\n";

/// A four-bar whose coupler is cut in the middle, where a weld or a joint across its plane holds the halves together.
pub fn cut_coupler(kind: &str) -> Source {
    let link = |name: &str, inertial: &str| format!("[[link]]\nname = \"{name}\"\n{inertial}");
    let joint = |name: &str, parent: &str, xyz: [f64; 3]| {
        format!(
            "[[joint]]\nname = \"to_{name}\"\nkind = \"continuous\"\nparent = \"{parent}\"\nchild = \"{name}\"\naxis = \"y\"\n\
             origin = {{ xyz = {xyz:?} }}\n"
        )
    };
    let bar = "mass = 1\ncom = [0.02, 0, 0.1]\ninertia = [0.01, 0.012, 0.003]\n";
    let text = "robot = { name = \"cut\", gravity = [0, 0, -9.81] }\n".to_string()
        + &link("ground", "")
        + &link("crank", bar)
        + &link("near", HALF)
        + &link("rocker", bar)
        + &link("far", HALF)
        + &joint("crank", "ground", [0.0; 3])
        + &joint("near", "crank", [0.0, 0.0, 0.2])
        + &joint("rocker", "ground", [0.5, 0.0, 0.0])
        + &joint("far", "rocker", [0.0, 0.0, 0.3])
        + "[[frame]]\nname = \"of_near\"\nlink = \"near\"\nxyz = [0.25, 0, 0.05]\n\
           [[frame]]\nname = \"of_far\"\nlink = \"far\"\nxyz = [-0.25, 0, -0.05]\n"
        + &format!("[[loop]]\nname = \"seam\"\nframe = \"of_near\"\nwith = \"of_far\"\nkind = \"{kind}\"\n")
        + if kind == "revolute" { "axis = \"y\"\n" } else { "" };
    Source::new("cut.toml", text)
}

/// The halves are one coupler.
#[test]
fn a_weld_in_a_plane_takes_three_velocities() {
    let cut = plain(&cut_coupler("fixed"));
    assert_eq!((cut.closure.loops[0].equations(), cut.nv()), (3, 1));
    // a hinge across the plane is what points say
    let hinged = plain(&cut_coupler("revolute"));
    let points = plain(&cut_coupler("spherical"));
    assert_eq!(hinged.closure.loops, points.closure.loops);
    let text = cut_coupler("spherical").text().to_string();
    let start = text.find("[[link]]\nname = \"far\"").expect("it is there");
    let end = text.find("[[joint]]").expect("it is there");
    let whole = text.replace(&text[start..end], "");
    let start = whole.find("[[joint]]\nname = \"to_far\"").expect("it is there");
    let whole = whole[..start].to_string()
        + "[[frame]]\nname = \"pin\"\nlink = \"near\"\nxyz = [0.5, 0, 0.1]\n\
           [[frame]]\nname = \"tip\"\nlink = \"rocker\"\nxyz = [0, 0, 0.3]\n\
           [[link]]\nname = \"far\"\n"
        + HALF
        + "[[joint]]\nname = \"seam\"\nkind = \"fixed\"\nparent = \"near\"\nchild = \"far\"\norigin = { xyz = [0.5, 0, 0.1] }\n\
           [[loop]]\nname = \"elbow\"\nframe = \"pin\"\nwith = \"tip\"\n";
    let whole = plain(&Source::new("whole.toml", whole));
    assert_eq!(whole.nv(), 1);
    let mut random = Random(9);
    for _ in 0..5 {
        let [q, qd, qdd] = state(&whole, &mut random);
        let joint =
            |model: &Model<Dd>, name: &str| model.free_joints().find(|joint| joint.name == name).expect(name).iq;
        let mut from = vec![Dd::ZERO; 4];
        for name in ["to_crank", "to_near", "to_rocker"] {
            from[joint(&cut, name)] = q[joint(&whole, name)];
        }
        let (of_cut, gaps) = cut.close_loops(&from, 8);
        assert!(gaps.iter().all(|gap| gap.abs().to_f64() < 1e-28), "{gaps:?}");
        let force = |model: &Model<Dd>, q: &[Dd]| alg::inverse_dynamics(model, q, &qd, &qdd)[0];
        let (a, b) = (force(&whole, &q), force(&cut, &of_cut));
        assert!((a - b).abs().to_f64() < 1e-24 * a.abs().to_f64().max(1.0), "{a:?} {b:?}");
    }
}

/// The robot of a file that `convert` writes.
fn written(source: &Source, format: &str) -> (String, Model<Dd>) {
    let mut said = Diagnostics::new();
    let to = format_of_word(format).expect("a format");
    let text = convert(source, to, ConvertOptions::default(), &mut said).unwrap_or_else(|| panic!("{}", said.render()));
    let read = plain(&Source::new(&format!("written.{format}"), text.clone()));
    (text, read)
}

fn codes(source: &Source, format: &str) -> Vec<&'static str> {
    let mut said = Diagnostics::new();
    let to = format_of_word(format).expect("a format");
    assert!(convert(source, to, ConvertOptions::default(), &mut said).is_none(), "{format}");
    said.iter().filter(|d| d.severity == straightline_codegen::diagnostic::Severity::Error).map(|d| d.code).collect()
}

#[test]
fn formats_keep_the_joints_that_close_loops() {
    for (source, formats) in [
        (arm(7, "fixed"), &["toml", "mjcf"][..]),
        (arm(6, "revolute"), &["toml", "sdf"]),
        (arm(7, "spherical"), &["toml", "mjcf", "sdf"]),
        (cut_coupler("fixed"), &["toml", "mjcf"]),
        (cut_coupler("revolute"), &["toml", "mjcf", "sdf"]),
    ] {
        let whole = plain(&source);
        for format in formats {
            let (text, read) = written(&source, format);
            assert_eq!(read.closure.loops.len(), 1, "{format}\n{text}");
            let of = |model: &Model<Dd>| model.closure.loops[0].equations();
            assert_eq!((of(&read), read.nv()), (of(&whole), whole.nv()), "{format}\n{text}");
            let mut random = Random(1);
            let [q, qd, qdd] = state(&whole, &mut random);
            let (there, gaps) = read.close_loops(&q, 5);
            assert!(gaps.iter().all(|gap| gap.abs().to_f64() < 1e-15), "{format}: {gaps:?}");
            let pairs = [(&whole, &q), (&read, &there)].map(|(model, q)| alg::inverse_dynamics(model, q, &qd, &qdd));
            for (a, b) in pairs[0].iter().zip(&pairs[1]) {
                assert!((*a - *b).abs().to_f64() < 1e-12 * a.abs().to_f64().max(1.0), "{format}: {a:?} {b:?}\n{text}");
            }
        }
    }
}

#[test]
fn what_a_format_has_no_word_for_is_an_error() {
    assert_eq!(codes(&arm(7, "fixed"), "sdf"), ["not-in-format"]);
    assert_eq!(codes(&arm(6, "revolute"), "mjcf"), ["not-in-format"]);
    // SDF says nothing of which joints are independent, and nothing of joints that stand elsewhere
    let asked = |text: &str| Source::new("asked.toml", arm(7, "spherical").text().to_string() + text);
    assert_eq!(codes(&asked("determines = [\"j0\", \"j1\", \"j2\"]\n"), "sdf"), ["not-in-format"]);
    assert_eq!(codes(&shifted_arm(7, "spherical", 0.01), "sdf"), ["not-in-format"]);
}

const MASS: &str = "mass=\"1.5\" fullinertia=\"0.02 0.03 0.025 0.001 -0.002 0.003\"";

/// Two bodies in a chain, a base that is free, and equalities.
fn mjcf(free: bool, second: &str, equalities: &str) -> Source {
    let joint = if free { "<freejoint/>" } else { "" };
    Source::new(
        "robot.xml",
        format!(
            "<mujoco><worldbody><body name=\"base\" pos=\"0.1 0.2 0.3\" euler=\"10 20 30\">{joint}<inertial pos=\"0 0 0\" {MASS}/>\
             <body name=\"arm\" pos=\"0 0 0.2\" euler=\"0 30 0\"><joint name=\"shoulder\" axis=\"1 0 2\" pos=\"0.01 0.02 0.03\"/>\
             <inertial pos=\"0.1 0 0\" {MASS}/>\
             <body name=\"hand\" pos=\"0.3 0 0\" euler=\"5 6 7\">{second}<inertial pos=\"0.05 0.01 0\" {MASS}/></body></body></body></worldbody>\
             <equality>{equalities}</equality></mujoco>"
        ),
    )
}

/// `equality/joint` without a second joint: the body stands so far from its pose in the file.
#[test]
fn a_joint_that_an_equality_holds_is_fixed() {
    let wrist = "<joint name=\"wrist\" axis=\"0 1 1\" pos=\"0 0.05 0\" ref=\"20\" damping=\"2\" range=\"-90 90\"/>";
    let held = plain(&mjcf(false, wrist, "<joint joint1=\"wrist\" polycoef=\"0.3 0 0 0 0\"/>"));
    assert_eq!(held.nv(), 1);
    let free = plain(&mjcf(false, wrist, ""));
    let at = Dd::from(0.3) + Dd::from(20.0) * (Dd::PI / Dd::from(180.0));
    let (q, still) = (Dd::from(0.7), Dd::ZERO);
    let [qd, qdd] = [Dd::from(1.3), Dd::from(-2.1)];
    let of_held = alg::inverse_dynamics(&held, &[q], &[qd], &[qdd]);
    let of_free = alg::inverse_dynamics(&free, &[q, at], &[qd, still], &[qdd, still]);
    assert!((of_held[0] - of_free[0]).abs().to_f64() < 1e-26, "{of_held:?} {of_free:?}");
    // a slide, and one that is held in the pose of the file
    let slide = "<joint name=\"wrist\" type=\"slide\" axis=\"0 3 4\"/>";
    let held = plain(&mjcf(false, slide, "<joint joint1=\"wrist\" polycoef=\"0.05 1 0 0 0\"/>"));
    let free = plain(&mjcf(false, slide, ""));
    let of_held = alg::inverse_dynamics(&held, &[q], &[qd], &[qdd]);
    let of_free = alg::inverse_dynamics(&free, &[q, Dd::from(0.05)], &[qd, still], &[qdd, still]);
    assert!((of_held[0] - of_free[0]).abs().to_f64() < 1e-16, "{of_held:?} {of_free:?}");
    let held = plain(&mjcf(false, wrist, "<joint joint1=\"wrist\"/>"));
    assert_eq!(held.bodies, plain(&mjcf(false, "", "")).bodies);
}

#[test]
fn a_base_that_is_welded_to_the_world_does_not_move() {
    let fixed = plain(&mjcf(false, "", ""));
    for weld in ["<weld body1=\"base\"/>", "<weld body1=\"world\" body2=\"base\" anchor=\"0.1 0 0\"/>"] {
        assert_eq!(plain(&mjcf(true, "", weld)).bodies, fixed.bodies, "{weld}");
    }
    assert_eq!(plain(&mjcf(true, "", "<weld body1=\"base\" active=\"false\"/>")).nv(), 7);
}

/// A weld by the pose that bodies have in the file, by that pose as numbers, and by sites is one weld.
#[test]
fn welds_say_where_in_three_ways() {
    let chain = |equality: &str| {
        let mut text = "<mujoco><worldbody>".to_string();
        let mut at = [0.0; 3];
        for (k, (place, axis)) in ARM.iter().enumerate() {
            let numbers = |v: &[f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
            text += &format!(
                "<body name=\"l{k}\" pos=\"{}\"><joint name=\"j{k}\" axis=\"{}\"/><inertial pos=\"0.05 0.02 -0.04\" {MASS}/>",
                numbers(place),
                numbers(axis)
            );
            at = std::array::from_fn(|i| at[i] + place[i]);
        }
        text += "<site name=\"held\" pos=\"0.1 0 0\"/>";
        text += &"</body>".repeat(ARM.len());
        let held = [at[0] + 0.1, at[1], at[2]];
        text += &format!("<site name=\"holder\" pos=\"{} {} {}\"/></worldbody>", held[0], held[1], held[2]);
        let relative = format!("{} {} {}", held[0], held[1], held[2]);
        text += &format!("<equality>{}</equality></mujoco>", equality.replace("HELD", &relative));
        plain(&Source::new("ring.xml", text))
    };
    let robots = [
        "<weld body1=\"l6\"/>",
        "<weld body1=\"world\" body2=\"l6\" anchor=\"0.1 0 0\" relpose=\"HELD 1 0 0 0\"/>",
        "<weld body1=\"l6\" body2=\"world\" anchor=\"HELD\" relpose=\"0.1 0 0 2 0 0 0\"/>",
        "<weld site1=\"held\" site2=\"holder\"/>",
    ]
    .map(chain);
    let mut random = Random(4);
    let [q, qd, qdd] = state(&robots[0], &mut random);
    let forces = robots.each_ref().map(|robot| {
        assert_eq!(robot.nv(), 1);
        let (q, gaps) = robot.close_loops(&q, 3);
        assert!(gaps.iter().all(|gap| gap.abs().to_f64() < 1e-15), "{gaps:?}");
        alg::inverse_dynamics(robot, &q, &qd, &qdd)[0].to_f64()
    });
    assert!(forces.iter().all(|force| (force - forces[0]).abs() < 1e-12 * forces[0].abs()), "{forces:?}");
    // what no robot has
    let (none, said) = load(&mjcf(true, "", "<weld body1=\"hand\"/>"), &ModelOptions::default());
    assert!(none.is_none() && said.has_errors(), "{said}");
}
