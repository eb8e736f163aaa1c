//! Rows `[[dh]]`: products of the four matrices of each row, in both conventions, and a published arm.

use crate::robots::Random;
use straightline_codegen::diagnostic::{Severity, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_core::algorithms::{forward_kinematics, inverse_dynamics, mass_matrix};
use straightline_core::model::Model;
use straightline_core::Dd;

type Matrix = [[f64; 4]; 4];

fn times(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Turned by an angle about x or z, and moved along it.
fn screw(axis: usize, angle: f64, length: f64) -> Matrix {
    let (s, c) = angle.sin_cos();
    match axis {
        0 => [[1.0, 0.0, 0.0, length], [0.0, c, -s, 0.0], [0.0, s, c, 0.0], [0.0, 0.0, 0.0, 1.0]],
        _ => [[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, length], [0.0, 0.0, 0.0, 1.0]],
    }
}

/// A row with numbers that are not special.
struct Row {
    slides: bool,
    /// a, α, d, θ.
    numbers: [f64; 4],
}

fn rows(random: &mut Random) -> Vec<Row> {
    let row =
        |random: &mut Random| Row { slides: random.below(3) == 0, numbers: [0; 4].map(|_| random.number().to_f64()) };
    (0..5).map(|_| row(random)).collect()
}

fn toml(convention: &str, rows: &[Row]) -> String {
    let row = |(k, row): (usize, &Row)| {
        let [a, alpha, d, theta] = row.numbers;
        let kind = if row.slides { "prismatic" } else { "revolute" };
        format!(
            "[[dh]]\nname = \"q{k}\"\nkind = \"{kind}\"\na = {a:?}\nalpha = {alpha:?}\nd = {d:?}\ntheta = {theta:?}\nlimits = [-9, 9]\n\
             mass = {:?}\ncom = [0.1, -0.2, 0.3]\ninertia = [0.3, 0.4, 0.5]\n",
            1.0 + k as f64
        )
    };
    let rows: String = rows.iter().enumerate().map(row).collect();
    format!("[robot]\nname = \"arm\"\ndh = \"{convention}\"\n{rows}")
}

fn model_of(text: &str) -> Model<Dd> {
    let (model, diagnostics) = load(&Source::new("arm.toml", text), &ModelOptions::default());
    model.unwrap_or_else(|| panic!("{diagnostics}\n{text}"))
}

#[test]
fn frames_stand_where_the_matrices_of_the_rows_lead() {
    for seed in 1..=40 {
        let random = &mut Random(seed);
        let rows = rows(random);
        let q: Vec<f64> = rows.iter().map(|_| 2.0 * random.number().to_f64()).collect();
        for convention in ["standard", "modified"] {
            let model = model_of(&toml(convention, &rows));
            let mut pose = screw(0, 0.0, 0.0);
            for (k, row) in rows.iter().enumerate() {
                let [a, alpha, d, theta] = row.numbers;
                let (turn, slide) = if row.slides { (0.0, q[k]) } else { (q[k], 0.0) };
                let (about_z, about_x) = (screw(2, theta + turn, d + slide), screw(0, alpha, a));
                let step = if convention == "standard" { times(about_z, about_x) } else { times(about_x, about_z) };
                pose = times(pose, step);
                let frame = model.frame(&format!("link{}", k + 1)).expect("links have the numbers of their rows");
                let q: Vec<Dd> = q.iter().map(|q| Dd::from(*q)).collect();
                let found = forward_kinematics(&model, &q, &[frame])[0];
                for (i, row) in pose.iter().take(3).enumerate() {
                    let entries = [found.rotation.rows[i].as_slice(), &[found.translation.to_array()[i]]].concat();
                    for (x, y) in entries.iter().zip(row) {
                        assert!(
                            (x.to_f64() - y).abs() < 1e-14,
                            "seed {seed}, {convention}, link {k}: {} and {y}",
                            x.to_f64()
                        );
                    }
                }
            }
        }
    }
}

/// The same arm, with joint frames: the frame of a link stands behind its row.
#[test]
fn masses_are_those_of_links_in_their_frames() {
    let rows = [
        Row { slides: false, numbers: [0.25, 0.5, 0.125, 0.75] },
        Row { slides: true, numbers: [0.5, -1.0, 0.375, 0.25] },
    ];
    let link = |name: &str, mass: f64| {
        format!("[[link]]\nname = \"{name}\"\nmass = {mass:?}\ncom = [0.1, -0.2, 0.3]\ninertia = [0.3, 0.4, 0.5]\n")
    };
    let joint = |name: &str, kind: &str, [parent, child]: [&str; 2], origin: &str| {
        let limits = if kind == "fixed" { "" } else { "axis = \"z\"\nlimits = [-9, 9]\n" };
        format!("[[joint]]\nname = \"{name}\"\nkind = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{child}\"\norigin = {{ {origin} }}\n{limits}")
    };
    let bare = |name: &str| format!("[[link]]\nname = \"{name}\"\n");
    let [z1, x1] = ["xyz = [0, 0, 0.125], rpy = [0, 0, 0.75]", "xyz = [0.25, 0, 0], rpy = [0.5, 0, 0]"];
    let [z2, x2] = ["xyz = [0, 0, 0.375], rpy = [0, 0, 0.25]", "xyz = [0.5, 0, 0], rpy = [-1.0, 0, 0]"];
    let links = bare("base") + &bare("c1") + &bare("c2") + &link("link1", 1.0) + &link("link2", 2.0);
    let standard = joint("q0", "revolute", ["base", "c1"], z1)
        + &joint("f1", "fixed", ["c1", "link1"], x1)
        + &joint("q1", "prismatic", ["link1", "c2"], z2)
        + &joint("f2", "fixed", ["c2", "link2"], x2);
    let modified = joint("f1", "fixed", ["base", "c1"], x1)
        + &joint("q0", "revolute", ["c1", "link1"], z1)
        + &joint("f2", "fixed", ["link1", "c2"], x2)
        + &joint("q1", "prismatic", ["c2", "link2"], z2);
    for (convention, joints) in [("standard", standard), ("modified", modified)] {
        let plain = model_of(&format!("[robot]\nname = \"arm\"\n{links}{joints}"));
        let model = model_of(&toml(convention, &rows));
        let [q, qd, qdd] = [0.3, 1.1, 2.0].map(|phase: f64| [phase.sin(), phase.cos()].map(Dd::from));
        assert_eq!(mass_matrix(&plain, &q), mass_matrix(&model, &q), "{convention}");
        assert_eq!(inverse_dynamics(&plain, &q, &qd, &qdd), inverse_dynamics(&model, &q, &qd, &qdd), "{convention}");
        let frames: Vec<&str> = model.frames.iter().map(|frame| frame.name.as_str()).collect();
        assert_eq!(frames, ["base", "link1", "link2"]);
    }
}

/// PUMA 560 with Craig's lengths (Introduction to Robotics, 3.7), of which he gives the tip in closed form.
#[test]
fn the_puma_reaches_where_its_closed_form_says() {
    let (a2, a3, d3, d4) = (0.4318, 0.0203, 0.1245, 0.4318);
    let rows = [(0.0, 0, 0.0), (0.0, -1, 0.0), (a2, 0, d3), (a3, -1, d4), (0.0, 1, 0.0), (0.0, -1, 0.0)];
    let mut text = "[robot]\nname = \"puma\"\ndh = \"modified\"\n".to_string();
    for (a, alpha, d) in rows {
        text += &format!("[[dh]]\nkind = \"continuous\"\na = {a:?}\nalpha_quarter_turns = {alpha}\nd = {d:?}\nmass = 1\ninertia = [1, 1, 1]\n");
    }
    let model = model_of(&text);
    let q = [0.4f64, -0.7, 1.1, 0.3, -0.9, 2.0];
    let ([s1, s2, ..], [c1, c2, ..]) = (q.map(f64::sin), q.map(f64::cos));
    let (s23, c23) = (q[1] + q[2]).sin_cos();
    let across = a2 * c2 + a3 * c23 - d4 * s23;
    let expected = [c1 * across - d3 * s1, s1 * across + d3 * c1, -a3 * s23 - a2 * s2 - d4 * c23];
    let tip = forward_kinematics(&model, &q.map(Dd::from), &[model.frame("link6").expect("it has six links")])[0];
    for (found, expected) in tip.translation.to_array().iter().zip(expected) {
        assert!((found.to_f64() - expected).abs() < 1e-15, "{} and {expected}", found.to_f64());
    }
    // right angles are exact: a turn that is none costs nothing
    let zeros = |body: usize| {
        model.bodies[body].placement.rotation.rows.as_flattened().iter().filter(|x| **x == Dd::ZERO).count()
    };
    assert_eq!((0..6).map(zeros).collect::<Vec<_>>(), [6; 6]);
}

#[test]
fn rows_can_branch_and_stand_beside_joints() {
    let text = "[robot]\nname = \"tree\"\ndh = \"standard\"\nbase = \"floating\"\n[[link]]\nname = \"trunk\"\nmass = 3\ninertia = [1, 1, 1]\n
        [[dh]]\nname = \"left\"\nlink = \"hand\"\nparent = \"trunk\"\nkind = \"continuous\"\nd = 0.5\nalpha_deg = 90\nmass = 1\ninertia = [1, 1, 1]
        [[dh]]\nname = \"right\"\nparent = \"trunk\"\nkind = \"prismatic\"\ntheta_turns = 0.25\nlimits = [0, 1]\nmass = 1\ninertia = [1, 1, 1]\ndamping = 2
        [[frame]]\nname = \"tool\"\nlink = \"hand\"\nxyz = [0.0, 0.0, 0.1]\n";
    let model = model_of(text);
    let joints: Vec<_> = model.bodies.iter().map(|body| (body.joint.name.as_str(), body.parent)).collect();
    assert_eq!(joints, [("root_joint", None), ("left", Some(0)), ("right", Some(0))]);
    assert_eq!(model.bodies[2].effects.damping, Dd::from(2.0));
    assert!(model.frame("tool").is_some() && model.frame("link2").is_some());
}

#[test]
fn what_a_row_lacks_is_said_with_its_line() {
    let good = "[robot]\nname = \"arm\"\ndh = \"standard\"\n[[dh]]\nkind = \"continuous\"\na = 1.0\nmass = 1.0\ninertia = [1, 1, 1]\n";
    let said = |text: &str| {
        let (_, diagnostics) = load(&Source::new("arm.toml", text), &ModelOptions::default());
        let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error);
        errors.map(|d| (d.code, d.place.as_ref().map_or(0, |place| place.line))).collect::<Vec<_>>()
    };
    assert_eq!(said(good), []);
    for (old, new, code, line) in [
        ("dh = \"standard\"\n", "", "missing-key", 1),
        ("standard", "classic", "unknown-word", 3),
        ("kind = \"continuous\"\n", "", "missing-key", 4),
        ("continuous", "ball", "unknown-word", 5),
        ("a = 1.0", "a = \"1\"", "wrong-type", 6),
        ("a = 1.0", "r = 1.0", "unknown-key", 6),
        ("a = 1.0", "alpha = 1.0\nalpha_deg = 2.0", "written-twice", 7),
        ("mass = 1.0\n", "", "missing-key", 4),
        ("a = 1.0", "parent = \"trunk\"", "unknown-link", 6),
    ] {
        assert_eq!(said(&good.replace(old, new)), [(code, line)], "{new}");
    }
}
