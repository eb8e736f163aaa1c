//! Contact modes as rustc compiles them, in f64 and in f32: every environment of Figure 20.15 with objects that move, curved surfaces,
//! friction that slides and sticks, impact with restitution, a loop. Truth is the full system of all unknowns, by the second author.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use straightline_codegen::compile::compile;
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_core::reference::drives::solve_general;
use straightline_core::reference::{
    bias_force, functional_coordinate, mass_matrix, CentreOfMassTree, Component, ContactFrames, Derivatives,
};
use straightline_core::Dd;

/// What is asked of f64, of scale; and as many units in the last place of f32.
const ROUNDED: f64 = 1e-12;
const SINGLE: f64 = 1e-12 * (1u64 << 29) as f64;
const N: usize = 6;
const STATES: usize = 4;
/// Friction, and radii of curved surfaces.
const MU: f64 = 0.375;
const SPEED: f64 = 0.015625;
const RADIUS: f64 = 0.25;

/// Numbers of an environment: as the scene names them.
struct Kind {
    name: &'static str,
    values: &'static [f64],
    has_own: bool,
}

const KINDS: [Kind; 5] = [
    Kind { name: "elastic", values: &[500.0, 12.0], has_own: false },
    Kind { name: "mass", values: &[1.5, 500.0, 12.0], has_own: false },
    Kind { name: "cushioned", values: &[1.5, 500.0, 12.0, 800.0, 7.0], has_own: true },
    Kind { name: "two_masses", values: &[1.5, 500.0, 12.0, 800.0, 7.0, 0.25], has_own: true },
    Kind { name: "both_sides", values: &[500.0, 12.0, 800.0, 7.0], has_own: true },
];

fn scene() -> String {
    let mut text = String::from(
        "[outputs]\nfunctions = []\ncontact = [\"forward_dynamics\", \"impact\"]\n[numbers]\nscalar = [\"f64\", \"f32\"]\n",
    );
    let mut contact = |name: &str, more: &str| {
        let _ = writeln!(
            text,
            "[[contact]]\nname = \"{name}\"\nframe = \"tool0\"\nobject = \"input\"\nconstrained = [\"pz\"]\n{more}"
        );
    };
    for kind in &KINDS {
        contact(kind.name, &format!("environment = {{ kind = \"{}\", parameters = \"input\" }}", kind.name));
    }
    contact("sphere", &format!("surface = {{ kind = \"sphere\", radius = {RADIUS} }}"));
    contact("cylinder", &format!("surface = {{ kind = \"cylinder\", radius = {RADIUS} }}"));
    contact("rough", &format!("friction = {{ coefficient = {MU}, speed = {SPEED} }}"));
    for name in KINDS.iter().map(|k| k.name).chain(["sphere", "cylinder", "rough"]) {
        let _ = writeln!(text, "[[mode]]\nname = \"{name}\"\ncontacts = [\"{name}\"]");
    }
    text + "[[mode]]\nname = \"sticking\"\ncontacts = [\"rough\"]\nsticking = [\"rough\"]\n"
}

/// Generated modules for a robot file in a scene.
fn generated(name: &str, text: String, scene: &str) -> String {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
    let options = file.unwrap_or_else(|| panic!("{}", diagnostics.render())).into_options(Options::default());
    compile(&Source::new(name, text), &options).unwrap_or_else(|d| panic!("{}", d.render())).text
}

/// Lines of numbers by their first words, as a program of these sources prints them.
fn printed(name: &str, source: &str) -> BTreeMap<String, Vec<f64>> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("contact_compiled");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let (file, program) = (folder.join(format!("{name}.rs")), folder.join(name));
    std::fs::write(&file, source).expect("the program can be written");
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let built = Command::new(rustc)
        .args(["--edition", "2021", "-C", "opt-level=1", "-A", "warnings", "-o"])
        .args([&program, &file])
        .output()
        .expect("rustc runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let output = Command::new(&program).output().expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let line = |line: &str| {
        let (key, rest) = line.split_once(':').expect("key: numbers");
        (key.to_string(), rest.split_whitespace().map(|x| x.parse().expect("a number")).collect())
    };
    String::from_utf8(output.stdout).expect("text").lines().map(line).collect()
}

/// Numbers that f32 has as well, from −1 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 44) as f64 / f64::from(1 << 19) - 1.0
    }

    fn list<const K: usize>(&mut self, scale: f64) -> [f64; K] {
        [0.0; K].map(|_| scale * self.next())
    }
}

/// What the functions are given.
#[derive(Clone, Debug)]
struct State {
    q: [f64; N],
    qd: [f64; N],
    tau: [f64; N],
    /// Origin, X, Y, Z.
    pose: [[f64; 3]; 4],
    /// Linear, angular.
    velocity: [[f64; 3]; 2],
    acceleration: [[f64; 3]; 2],
    own: [f64; 2],
    struck: f64,
}

/// With axes of the object that both formats have exactly, as no others of length one are.
fn state(random: &mut Numbers, k: usize) -> State {
    let axes = [
        [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    ];
    let [x, y, z] = axes[k % 3];
    State {
        q: random.list(2.0),
        qd: random.list(1.0),
        tau: random.list(20.0),
        pose: [random.list(0.5), x, y, z],
        velocity: [random.list(0.5), random.list(0.5)],
        acceleration: [random.list(1.0), random.list(1.0)],
        own: random.list(0.125),
        struck: random.next(),
    }
}

/// The program: every mode at every state in both scalars.
fn program(module: &str, states: &[State]) -> String {
    let mut text = format!(
        "mod ur5 {{\n{module}\n}}\nfn show(key: &str, parts: &[&[f64]]) {{\n    print!(\"{{key}}:\");\n    \
        for x in parts.concat() {{ print!(\" {{x:e}}\"); }}\n    println!();\n}}\n"
    );
    let mut calls = String::new();
    for (scalar, path) in [("f64", "ur5::contact"), ("f32", "ur5::single::contact")] {
        for (k, s) in states.iter().enumerate() {
            let _ = writeln!(
                calls,
                "{{ type T = {scalar}; let (q, qd, tau): ([T; 6], [T; 6], [T; 6]) = ({:?}, {:?}, {:?});\n\
                 let (pose, velocity, acceleration): ([[T; 3]; 4], [[T; 3]; 2], [[T; 3]; 2]) = ({:?}, {:?}, {:?});\n\
                 let (own, struck): ([T; 2], [T; 1]) = ({:?}, [{:?}]);\nlet wide = |x: &[T]| x.iter().map(|x| *x as f64).collect::<Vec<f64>>();",
                s.q, s.qd, s.tau, s.pose, s.velocity, s.acceleration, s.own, s.struck
            );
            let mut motion = |mode: &str, m: usize, more: &str, has_own: bool| {
                let rates = if has_own { ", &mut rates" } else { "" };
                let _ = writeln!(
                    calls,
                    "{{ let (mut a, mut f, mut s, mut v, mut p, mut rates) = ([0.0 as T; 6], [0.0 as T; {m}], [0.0 as T; {m}], \
                     [0.0 as T; {m}], [0.0 as T; 1], [0.0 as T; 2]);\n\
                     {path}::{mode}::forward_dynamics(&q, &qd, &tau, &pose, &velocity, &acceleration{more}, &mut a, &mut f, &mut s, \
                     &mut v, &mut p{rates});\nshow(\"{scalar} {k} {mode}\", &[&wide(&a), &wide(&f), &wide(&s), &wide(&rates)]); }}"
                );
            };
            for kind in &KINDS {
                let own = if kind.has_own { ", &own" } else { "" };
                motion(kind.name, 1, &format!(", &{:?}{own}", kind.values), kind.has_own);
            }
            for (mode, m) in [("sphere", 1), ("cylinder", 1), ("rough", 1), ("sticking", 3)] {
                motion(mode, m, "", false);
            }
            for mode in ["mass", "two_masses", "rough"] {
                let kind = KINDS.iter().find(|kind| kind.name == mode);
                let (given, after) = match kind {
                    Some(kind) => (format!(", &{:?}, &struck", kind.values), ", &mut after"),
                    None => (String::new(), ""),
                };
                let _ = writeln!(
                    calls,
                    "{{ let (mut d, mut i, mut ds, mut l, mut p, mut after) = ([0.0 as T; 6], [0.0 as T], [0.0 as T], [0.0 as T], \
                     [0.0 as T], [0.0 as T]);\n{path}::{mode}::impact(&q, &qd, &pose, &velocity{given}, &[0.4], &mut d, &mut i, &mut ds, \
                     &mut l, &mut p{after});\nshow(\"{scalar} {k} {mode} impact\", &[&wide(&d), &wide(&i), &wide(&ds), &wide(&after), &wide(&l)]); }}"
                );
            }
            calls.push_str("}\n");
        }
    }
    let _ = writeln!(text, "fn main() {{\n{calls}}}");
    text
}

/// A row of the full system, G q̈ + c F = right, and the directions in which its reaction acts.
struct Row {
    s: Derivatives<Dd>,
    applied: DVector<Dd>,
    /// Mass that moves with it and its load; `None`: rigid.
    yields: Option<(Dd, Dd)>,
}

/// What a mode gives: q̈, F, s̈ and the rates of the object's own coordinate.
struct Truth {
    qdd: Vec<Dd>,
    force: Vec<Dd>,
    sdd: Vec<Dd>,
    own: [Dd; 2],
    /// What F and q̈ are made of, for rounding.
    scale: [f64; 2],
}

/// The robot by the second author.
fn tree(text: &str) -> CentreOfMassTree<Dd> {
    let mut diagnostics = Diagnostics::new();
    let read = description::read(&Source::new("ur5.urdf", text), &mut diagnostics).expect("a robot");
    centre_of_mass_tree(&read, &Options::default().model).expect("a tree")
}

fn wide(v: [f64; 3]) -> Vector3<Dd> {
    Vector3::from(v.map(Dd::from))
}

fn coordinate(tree: &CentreOfMassTree<Dd>, s: &State, component: Component) -> Derivatives<Dd> {
    let frames = ContactFrames {
        frame: tree.frame("tool0").expect("a frame").clone(),
        axes: [Vector3::z(), Vector3::x()].map(|v: Vector3<f64>| v.map(Dd::from)),
        origin: wide(s.pose[0]),
        object: Matrix3::from_columns(&[wide(s.pose[1]), wide(s.pose[2]), wide(s.pose[3])]),
        motion: [s.velocity[0], s.velocity[1], s.acceleration[0], s.acceleration[1]].map(wide),
        radius: Dd::from(RADIUS),
    };
    functional_coordinate(tree, &frames, &s.q.map(Dd::from), &s.qd.map(Dd::from), component)
}

/// Friction tilts the row of the distance from a plane: Ĵ = J − μ v/√(v² + w²) · J along the plane.
fn tilted(tree: &CentreOfMassTree<Dd>, s: &State) -> DVector<Dd> {
    let [x, y, z] = [0, 1, 2].map(|k| coordinate(tree, s, Component::Position(k)));
    let length = (x.sd * x.sd + y.sd * y.sd + Dd::from(SPEED) * Dd::from(SPEED)).sqrt();
    let share = Dd::from(MU) / length;
    z.jacobian - (x.jacobian * (share * x.sd) + y.jacobian * (share * y.sd))
}

/// Mass and load at s, ṡ, and ė, ë of the object's own coordinate, as Figure 20.15 has them.
fn law(kind: &Kind, (s, sd): (Dd, Dd), own: [f64; 2]) -> ((Dd, Dd), [Dd; 2]) {
    let v: Vec<Dd> = kind.values.iter().map(|x| Dd::from(*x)).collect();
    let ([e, ed], o) = (own.map(Dd::from), Dd::ZERO);
    match kind.name {
        "elastic" => ((o, v[0] * s + v[1] * sd), [o; 2]),
        "mass" => ((v[0], v[1] * s + v[2] * sd), [o; 2]),
        "cushioned" | "two_masses" => {
            let front = v[3] * (s - e) + v[4] * (sd - ed);
            let mass = if kind.name == "two_masses" { v[5] } else { o };
            ((mass, front), [ed, (front - v[1] * e - v[2] * ed) / v[0]])
        }
        _ => {
            // the same force through tool and surface
            let rate = (v[2] * (s - e) + v[3] * sd - v[0] * e) / (v[1] + v[3]);
            ((o, v[2] * (s - e) + v[3] * (sd - rate)), [rate, o])
        }
    }
}

/// (H −Ĵᵀ; m J or J, 1 or 0) of all unknowns.
fn solved(h: &DMatrix<Dd>, rows: &[Row], of_robot: &DVector<Dd>, of_rows: &[Dd]) -> (Vec<Dd>, Vec<Dd>) {
    let (n, m) = (h.nrows(), rows.len());
    let mut a = DMatrix::from_element(n + m, n + m, Dd::ZERO);
    let mut b = DVector::from_element(n + m, Dd::ZERO);
    a.view_mut((0, 0), (n, n)).copy_from(h);
    b.rows_mut(0, n).copy_from(of_robot);
    for (i, row) in rows.iter().enumerate() {
        for j in 0..n {
            a[(j, n + i)] = -row.applied[j];
            a[(n + i, j)] = row.yields.map_or(Dd::ONE, |(mass, _)| mass) * row.s.jacobian[j];
        }
        a[(n + i, n + i)] = if row.yields.is_some() { Dd::ONE } else { Dd::ZERO };
        b[n + i] = of_rows[i];
    }
    let x = solve_general(a, b);
    (x.as_slice()[..n].to_vec(), x.as_slice()[n..].to_vec())
}

fn truth(tree: &CentreOfMassTree<Dd>, s: &State, mode: &str) -> Truth {
    let (q, qd) = (s.q.map(Dd::from), s.qd.map(Dd::from));
    let h = mass_matrix(tree, &q);
    let drive = DVector::from_column_slice(&s.tau.map(Dd::from)) - bias_force(tree, &q, &qd);
    let rigid = |component| {
        let s = coordinate(tree, s, component);
        Row { applied: s.jacobian.clone(), s, yields: None }
    };
    let mut own = [Dd::ZERO; 2];
    let rows: Vec<Row> = match mode {
        "sphere" => vec![rigid(Component::Sphere)],
        "cylinder" => vec![rigid(Component::Cylinder)],
        "rough" => vec![Row { applied: tilted(tree, s), ..rigid(Component::Position(2)) }],
        "sticking" => (0..3).map(|k| rigid(Component::Position(k))).collect(),
        _ => {
            let kind = KINDS.iter().find(|k| k.name == mode).expect("a mode");
            let row = rigid(Component::Position(2));
            let (yields, rates) = law(kind, (row.s.s, row.s.sd), s.own);
            own = rates;
            vec![Row { yields: Some(yields), ..row }]
        }
    };
    // J q̈ = −A,  or m (J q̈ + A) + F = −load
    let right: Vec<Dd> = rows
        .iter()
        .map(|row| match row.yields {
            None => -row.s.adjoint,
            Some((mass, load)) => -(load + mass * row.s.adjoint),
        })
        .collect();
    let (qdd, force) = solved(&h, &rows, &drive, &right);
    let sdd = rows.iter().map(|row| row.s.jacobian.iter().zip(&qdd).fold(row.s.adjoint, |sum, (j, x)| sum + *j * *x));
    let sdd: Vec<Dd> = sdd.collect();
    // what accelerates a robot of so small and so large inertias in the end: the largest of all its parts
    let fall = solve_general(h.clone(), drive).iter().fold(0.0f64, |m, x| m.max(x.abs().hi()));
    let spring = if rows[0].yields.is_some() { 1e3 } else { 0.0 };
    let largest = force.iter().fold(spring, |m: f64, f| m.max(f.abs().hi()));
    let moved = rows.iter().map(|row| solve_general(h.clone(), row.applied.clone()));
    let moved = moved.fold(0.0f64, |m, x| x.iter().fold(m, |m, x| m.max(x.abs().hi())));
    Truth { qdd, force, sdd, own, scale: [fall + moved * largest, largest] }
}

/// Δq̇, I, Δṡ and the velocity of what is struck, with e = 0.4; the energy that goes.
fn blow(tree: &CentreOfMassTree<Dd>, s: &State, mode: &str) -> (Vec<Dd>, [Dd; 4]) {
    let q = s.q.map(Dd::from);
    let (h, e) = (mass_matrix(tree, &q), Dd::from(0.4));
    let row = coordinate(tree, s, Component::Position(2));
    let kind = KINDS.iter().find(|k| k.name == mode);
    let mass = kind.map(|kind| Dd::from(if mode == "mass" { kind.values[0] } else { kind.values[5] }));
    let applied = if mode == "rough" { tilted(tree, s) } else { row.jacobian.clone() };
    let struck = mass.map_or(Dd::ZERO, |_| Dd::from(s.struck));
    let approach = row.sd - struck;
    // ṡ'' = −e ṡ' on what is rigid; m_e (ṡ_e'' − ṡ_e') = −I and ṡ'' − ṡ_e'' = −e (ṡ' − ṡ_e') on a mass
    let right = -((Dd::ONE + e) * approach) * mass.unwrap_or(Dd::ONE);
    let rows = [Row { s: row.clone(), applied: applied.clone(), yields: mass.map(|m| (m, Dd::ZERO)) }];
    let (dqd, impulse) = solved(&h, &rows, &DVector::from_element(N, Dd::ZERO), &[right]);
    let ds = row.jacobian.iter().zip(&dqd).fold(Dd::ZERO, |sum, (j, x)| sum + *j * *x);
    let after = mass.map_or(Dd::ZERO, |_| row.sd + ds + e * approach);
    // kinetic energy before less after
    let half = |v: &DVector<Dd>| (v.transpose() * &h * v)[(0, 0)] * Dd::HALF;
    let before = DVector::from_column_slice(&s.qd.map(Dd::from));
    let then = &before + DVector::from_column_slice(&dqd);
    let of_mass = mass.map_or(Dd::ZERO, |m| m * Dd::HALF * (struck * struck - after * after));
    let lost = half(&before) - half(&then) + of_mass;
    (dqd, [impulse[0], ds, after, lost])
}

#[test]
fn compiled_modes_are_the_full_system_of_the_second_author() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions/ur5.urdf");
    let text = std::fs::read_to_string(file).expect("a robot file");
    let tree = tree(&text);
    let mut random = Numbers(20);
    let states: Vec<State> = (0..STATES).map(|k| state(&mut random, k)).collect();
    let found = printed("modes", &program(&generated("ur5.urdf", text, &scene()), &states));
    let mut worst = BTreeMap::<(&str, &str), f64>::new();
    for (scalar, bound) in [("f64", ROUNDED), ("f32", SINGLE)] {
        for (k, s) in states.iter().enumerate() {
            let mut compare = |mode: &'static str, what: &str, found: &[f64], expected: &[Dd], scale: f64| {
                let largest = expected.iter().fold(scale, |m: f64, x| m.max(x.abs().hi()));
                for (a, b) in found.iter().zip(expected) {
                    let error = (Dd::from(*a) - *b).abs().hi() / largest;
                    assert!(error <= bound, "{scalar} {mode} {what}: {error:.1e} of {largest:.1e} at {s:?}");
                    let entry = worst.entry((scalar, mode)).or_default();
                    *entry = entry.max(error);
                }
            };
            let names = ["sphere", "cylinder", "rough", "sticking"];
            for mode in KINDS.iter().map(|kind| kind.name).chain(names) {
                let found = &found[&format!("{scalar} {k} {mode}")];
                let t = truth(&tree, s, mode);
                let m = t.force.len();
                assert_eq!(found.len(), N + 2 * m + 2);
                compare(mode, "q̈", &found[..N], &t.qdd, t.scale[0]);
                compare(mode, "F", &found[N..N + m], &t.force, t.scale[1]);
                compare(mode, "s̈", &found[N + m..N + 2 * m], &t.sdd, t.scale[0]);
                compare(mode, "ė, ë", &found[N + 2 * m..], &t.own, 1e3);
            }
            for mode in ["mass", "two_masses", "rough"] {
                let found = &found[&format!("{scalar} {k} {mode} impact")];
                let (dqd, rest) = blow(&tree, s, mode);
                let largest = dqd.iter().fold(1.0, |m: f64, x| m.max(x.abs().hi()));
                compare(mode, "Δq̇", &found[..N], &dqd, 0.0);
                compare(mode, "I, Δṡ, ṡ_e, loss", &found[N..], &rest, largest);
            }
        }
    }
    for ((scalar, mode), error) in worst {
        println!("{scalar} {mode}: {error:.1e} of scale");
    }
}

/// Two cranks of 1 m, 2 m apart, and a coupler of 2 m between them, in the x-y plane: a parallelogram.
const LINKAGE: &str = r#"
[robot]
name = "linkage"
gravity = [0.0, -9.81, 0.0]
[[link]]
name = "base"
[[link]]
name = "crank"
mass = 2.0
com = [0.45, 0.03, 0.0]
inertia = [0.02, 0.05, 0.06]
[[link]]
name = "coupler"
mass = 1.7
com = [0.9, 0.05, 0.0]
inertia = [0.02, 0.05, 0.06]
[[link]]
name = "rocker"
mass = 1.4
com = [0.45, 0.03, 0.0]
inertia = [0.02, 0.05, 0.06]
[[joint]]
name = "first"
kind = "continuous"
parent = "base"
child = "crank"
axis = "z"
[[joint]]
name = "second"
kind = "continuous"
parent = "crank"
child = "coupler"
origin = { xyz = [1.0, 0.0, 0.0] }
axis = "z"
[[joint]]
name = "third"
kind = "continuous"
parent = "base"
child = "rocker"
origin = { xyz = [2.0, 0.0, 0.0] }
axis = "z"
[[frame]]
name = "coupler_end"
link = "coupler"
xyz = [2.0, 0.0, 0.0]
[[frame]]
name = "rocker_end"
link = "rocker"
xyz = [1.0, 0.0, 0.0]
"#;

#[test]
fn a_compiled_parallelogram_turns_as_its_closed_form() {
    let scene = "[outputs]\nfunctions = []\ncontact = [\"forward_dynamics\"]\n[numbers]\nscalar = [\"f64\", \"f32\"]\n[[loop]]\nname = \
                 \"hinge\"\nframe = \"coupler_end\"\nwith = \"rocker_end\"\nconstrained = [\"px\", \"py\"]\n";
    let module = generated("linkage.toml", LINKAGE.to_string(), scene);
    let (angle, speed, tau) = (0.8125f64, 1.25, [2.0, 0.0, -0.5]);
    let mut calls = String::new();
    for (scalar, path) in [("f64", "linkage::contact"), ("f32", "linkage::single::contact")] {
        let _ = writeln!(
            calls,
            "{{ type T = {scalar}; let (mut a, mut f, mut s, mut v, mut p) = ([0.0 as T; 3], [0.0 as T; 2], [0.0 as T; 2], [0.0 as T; 2], \
             [0.0 as T]);\n{path}::closed::forward_dynamics(&[{angle:?}, -{angle:?}, {angle:?}], &[{speed:?}, -{speed:?}, {speed:?}], \
             &{tau:?}, &mut a, &mut f, &mut s, &mut v, &mut p);\nprintln!(\"{scalar}: {{:e}} {{:e}} {{:e}}\", a[0], a[1], a[2]); }}"
        );
    }
    let found = printed("linkage", &format!("mod linkage {{\n{module}\n}}\nfn main() {{\n{calls}}}\n"));
    // the cranks turn about their axes, the coupler goes along a circle of 1 m
    let (inertia, com) = (0.06, 0.45 * 0.45 + 0.03 * 0.03);
    let total = 2.0 * inertia + 3.4 * com + 1.7;
    let lever = 0.45 * angle.cos() - 0.03 * angle.sin();
    let expected = (tau[0] - tau[1] + tau[2] - 9.81 * (3.4 * lever + 1.7 * angle.cos())) / total;
    for (scalar, bound) in [("f64", ROUNDED), ("f32", SINGLE)] {
        for (qdd, sign) in found[scalar].iter().zip([1.0, -1.0, 1.0]) {
            assert!((qdd - sign * expected).abs() <= bound * expected.abs(), "{scalar}: {qdd} for {expected}");
        }
    }
}
