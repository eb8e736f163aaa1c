//! Loops that close in closed form, beside Newton's method.

use crate::data::reference_file;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::{load, ModelOptions};
use straightline_core::closure::{Dyad, DyadWay};
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::Dd;

const FOURBAR: &str = include_str!("../files/fourbar.toml");

/// A crank turns a slider by a rod.
const SLIDER_CRANK: &str = r#"
[robot]
name = "press"
gravity = [0.0, 0.0, -9.81]

[[link]]
name = "frame"

[[link]]
name = "crank"
mass = 0.7
com = [0.04, 0.0, 0.0]
inertia = [0.001, 0.002, 0.002]

[[link]]
name = "rod"
mass = 0.9
com = [0.16, 0.01, 0.0]
inertia = [0.001, 0.011, 0.011]

[[link]]
name = "slider"
mass = 2.5
com = [0.0, 0.0, 0.01]
inertia = [0.004, 0.003, 0.005]

[[joint]]
name = "crank"
kind = "continuous"
parent = "frame"
child = "crank"
axis = "y"

[[joint]]
name = "rod"
kind = "continuous"
parent = "crank"
child = "rod"
origin = { xyz = [0.08, 0.0, 0.0] }
axis = "y"

[[joint]]
name = "slider"
kind = "prismatic"
parent = "frame"
child = "slider"
origin = { xyz = [0.41, 0.0, 0.015] }
axis = "x"
limits = [-0.3, 0.1]

[[frame]]
name = "rod_end"
link = "rod"
xyz = [0.33, 0.0, 0.0]

[[frame]]
name = "slider_pin"
link = "slider"

[[loop]]
name = "pin"
frame = "rod_end"
with = "slider_pin"
"#;

/// A hydraulic cylinder lifts a boom.
const BOOM: &str = r#"
[robot]
name = "boom"
gravity = [0.0, 0.0, -9.81]

[[link]]
name = "chassis"

[[link]]
name = "boom"
mass = 120.0
com = [1.1, 0.0, 0.2]
inertia = [4.0, 60.0, 58.0]

[[link]]
name = "barrel"
mass = 14.0
com = [0.3, 0.0, 0.0]
inertia = [0.05, 0.6, 0.6]

[[link]]
name = "piston"
mass = 9.0
com = [-0.2, 0.0, 0.0]
inertia = [0.02, 0.4, 0.4]

[[joint]]
name = "boom"
kind = "revolute"
parent = "chassis"
child = "boom"
origin = { xyz = [0.1, 0.0, 0.5] }
axis = [0.0, -1.0, 0.0]
limits = [-0.4, 0.9]

[[joint]]
name = "barrel"
kind = "revolute"
parent = "chassis"
child = "barrel"
origin = { xyz = [0.35, 0.0, 0.1] }
axis = [0.0, -1.0, 0.0]
limits = [-1.5, 1.5]

[[joint]]
name = "piston"
kind = "prismatic"
parent = "barrel"
child = "piston"
origin = { xyz = [0.6, 0.0, 0.02] }
axis = "x"
limits = [0.0, 0.8]

[[frame]]
name = "eye"
link = "piston"

[[frame]]
name = "boom_eye"
link = "boom"
xyz = [0.9, 0.0, 0.1]

[[loop]]
name = "cylinder"
frame = "eye"
with = "boom_eye"
determines = ["barrel", "piston"]
"#;

fn robots() -> Vec<(String, Model<Dd>)> {
    let written = [("fourbar", FOURBAR.to_owned()), ("press", SLIDER_CRANK.to_owned()), ("boom", BOOM.to_owned())];
    let other_way = [
        ("rocker leads", format!("{FOURBAR}determines = [\"crank\", \"coupler\"]\n")),
        ("slider leads", format!("{SLIDER_CRANK}determines = [\"crank\", \"rod\"]\n")),
        ("coupler leads", format!("{FOURBAR}determines = [\"crank\", \"rocker\"]\n")),
        ("rod leads", format!("{SLIDER_CRANK}determines = [\"crank\", \"slider\"]\n")),
        ("piston leads", BOOM.replace("\"barrel\", \"piston\"]", "\"boom\", \"barrel\"]")),
        ("barrel leads", BOOM.replace("\"barrel\", \"piston\"]", "\"boom\", \"piston\"]")),
    ];
    let of_text = written.into_iter().chain(other_way).map(|(name, text)| (name.to_owned(), "robot.toml", text));
    let of_reference = ["loop_fourbar", "loop_palletiser", "loop_ankle_float", "loop_leg"].map(|name| {
        let text = std::fs::read_to_string(reference_file(&format!("joints/robots/{name}.xml"))).expect("the data");
        (name.to_owned(), "robot.xml", text)
    });
    let model = |(name, file, text): (String, &str, String)| {
        let (model, said) = load(&Source::new(file, text), &ModelOptions::default());
        let model = model.unwrap_or_else(|| panic!("{name}: {}", said.render()));
        (name, model)
    };
    of_text.chain(of_reference).map(model).collect()
}

fn dyads(model: &Model<Dd>) -> Vec<Option<&Dyad>> {
    model.closure.groups.iter().map(|group| group.dyad.as_ref()).collect()
}

#[test]
fn loops_of_a_crank_and_a_pivot_have_a_closed_form() {
    for (name, model) in robots() {
        assert!(dyads(&model).iter().all(|dyad| dyad.is_some()), "{name}");
        let universal = dyads(&model).iter().flatten().filter(|dyad| dyad.pivot.len() == 2).count();
        let expected = match name.as_str() {
            "loop_ankle_float" => 2,
            "loop_leg" => 1,
            _ => 0,
        };
        assert_eq!(universal, expected, "{name}");
    }
    // both rods turn the foot at once
    let text = std::fs::read_to_string(reference_file("joints/robots/loop_ankle.xml")).expect("the data");
    let (model, _) = load(&Source::new("loop_ankle.xml", text), &ModelOptions::default());
    assert_eq!(dyads(&model.expect("it is read")), [None]);
}

/// A closed configuration near home, by small steps.
fn closed_near_home(model: &Model<Dd>, random: &mut Random, bound: f64) -> Vec<f64> {
    let model = model.cast::<f64>();
    let mut q = model.closure.home.clone();
    for joint in model.independent_joints().filter(|joint| joint.kind.is_single()) {
        q[joint.iq] += random.symmetric(bound);
    }
    model.assembled(&q)
}

#[test]
fn the_closed_form_is_where_newtons_method_ends() {
    for (name, model) in robots() {
        let numbers = model.cast::<f64>();
        let (mut random, mut kept) = (Random(11), 0);
        let ways = |q: &[f64]| -> Vec<DyadWay> {
            let groups = numbers.closure.groups.iter();
            let own =
                groups.map(|group| (group.dyad.as_ref().expect("it has one"), &numbers.closure.loops[group.loops[0]]));
            own.map(|(dyad, of)| dyad.way_at(&numbers, of, q)).collect()
        };
        for _ in 0..50 {
            let q = closed_near_home(&model, &mut random, 0.2);
            let mut from = q.clone();
            for joint in model.dependent_joints() {
                let unit = if joint.kind.slides() { 0.1 } else { 1.0 };
                from[joint.iq] += random.symmetric(0.3 * unit);
            }
            let (found, gaps) = numbers.assemble_loops(&from, 0);
            assert!(gaps.iter().all(|gap| gap.abs() < 1e-14), "{name}: {gaps:?}");
            // in double-double, from there
            let wide: Vec<Dd> = found.iter().map(|x| Dd::from(*x)).collect();
            let (exact, _) = model.close_loops(&wide, 4);
            for (found, exact) in found.iter().zip(&exact) {
                // rounding, divided by how far a dead point is
                assert!((exact.to_f64() - found).abs() < 1e-10, "{name}: {found} {exact:?}");
            }
            // joints that were moved past a dead point stand in the other assembly; near one q is only as exact as the root of its gap
            if ways(&from) == ways(&q) {
                let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-3;
                assert!(found.iter().zip(&q).all(near), "{name}: another assembly, {found:?} {q:?}");
                kept += 1;
            }
        }
        assert!(kept > 10, "{name}: {kept}");
    }
}

/// All the way round, from where the rocker was a quarter of a turn ago.
#[test]
fn a_four_bar_stays_closed_wherever_its_crank_is() {
    let (_, model) = &robots()[0];
    let model = model.cast::<f64>();
    let mut q = model.closure.home.clone();
    let steps = 2000;
    for k in 0..steps {
        q[0] = std::f64::consts::TAU * f64::from(k) / f64::from(steps);
        let (found, gaps) = model.assemble_loops(&q, 0);
        assert!(gaps.iter().all(|gap| gap.abs() < 1e-14), "{k}: {gaps:?}");
        if k % 100 == 0 {
            q = found;
        }
    }
}

/// However far the joints have to go: turns by nearly half a turn, starts in the other assembly.
#[test]
fn loops_close_from_wherever_their_joints_are() {
    for (name, model) in robots() {
        let model = model.cast::<f64>();
        let home = &model.closure.home;
        let mut random = Random(41);
        let mut worst = (0.0, Vec::new());
        for _ in 0..3000 {
            let mut q = home.clone();
            for b in model.closure.dependents() {
                let joint = &model.bodies[b].joint;
                let far = if joint.kind.slides() { 1.0 } else { 3.2 };
                q[joint.iq] += random.symmetric(far);
            }
            let gaps = model.assemble_loops(&q, 5).1;
            let gap = gaps.iter().fold(0.0, |most: f64, gap| most.max(gap.abs()));
            if gap > worst.0 || gap.is_nan() {
                worst = (gap, q);
            }
        }
        println!("{name:24} {:.1e} m", worst.0);
        assert!(worst.0 < 1e-14, "{name}: {} m from {:?}", worst.0, worst.1);
    }
}

/// Each assembly is kept, also from its dead point.
#[test]
fn the_assembly_is_the_one_in_which_q_stands() {
    let (_, model) = &robots()[0];
    let model = model.cast::<f64>();
    let home = model.closure.home.clone();
    // the coupler turned over
    let mut over = home.clone();
    let mut seen = Vec::new();
    for turned in [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, -0.5, -1.0, -1.5, -2.0, -2.5, -3.0] {
        over[1] = home[1] + turned;
        let (found, gaps) = model.assemble_loops(&over, 0);
        assert!(gaps.iter().all(|gap| gap.abs() < 1e-14), "{turned}: {gaps:?}");
        let place = [found[1].sin(), found[1].cos(), found[2].sin(), found[2].cos()];
        let is_known = |known: &[f64; 4]| known.iter().zip(&place).all(|(a, b)| (a - b).abs() < 1e-12);
        if !seen.iter().any(is_known) {
            seen.push(place);
        }
        let again = model.assemble_loops(&found, 0).0;
        assert!(again.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-14), "{turned}");
    }
    assert_eq!(seen.len(), 2);
}

/// Where no configuration closes the loop, numbers stay finite, and the gap says so.
#[test]
fn loops_that_cannot_close_leave_a_gap() {
    for (name, model) in robots().into_iter().filter(|(name, _)| name == "slider leads" || name == "piston leads") {
        let model = model.cast::<f64>();
        let mut q = model.closure.home.clone();
        let leading = model.independent_joints().next().expect("one leads").iq;
        q[leading] += 5.0;
        let (found, gaps) = model.assemble_loops(&q, 0);
        assert!(found.iter().all(|x| x.is_finite()), "{name}: {found:?}");
        assert!(gaps.iter().any(|gap| gap.abs() > 1.0), "{name}: {gaps:?}");
    }
}

fn four_bar(more: &str) -> Model<f64> {
    let (model, said) = load(&Source::new("fourbar.toml", format!("{FOURBAR}{more}")), &ModelOptions::default());
    model.unwrap_or_else(|| panic!("{}", said.render())).cast()
}

/// By name a loop closes in one assembly from wherever its joints are.
#[test]
fn an_assembly_has_a_name() {
    let standing = four_bar("");
    let [drawn, mirrored] = ["drawn", "mirrored"].map(|name| four_bar(&format!("assembly = \"{name}\"\n")));
    assert_eq!(drawn.closure.home, standing.closure.home);
    assert_eq!(mirrored.closure.home[0], standing.closure.home[0]);
    assert!((mirrored.closure.home[2] - standing.closure.home[2]).abs() > 0.1);
    // whole turns are none
    let placed = |q: &[f64]| q.iter().flat_map(|x| [x.sin(), x.cos()]).collect::<Vec<f64>>();
    for k in 0..40 {
        let at = |model: &Model<f64>, guess: f64| {
            let mut q = model.closure.home.clone();
            q[0] += 0.02 * f64::from(k);
            (q[1], q[2]) = (q[1] + guess, q[2] - 0.7 * guess);
            let (found, gaps) = model.assemble_loops(&q, 0);
            assert!(gaps.iter().all(|gap| gap.abs() < 1e-14), "{k}: {gaps:?}");
            placed(&found)
        };
        for model in [&drawn, &mirrored] {
            let expected = at(model, 0.0);
            for guess in [0.4, 1.3, 2.2, 3.1, -0.9, -1.8, -2.7] {
                let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-13;
                let found = at(model, guess);
                assert!(found.iter().zip(&expected).all(near), "{k}, {guess}: {found:?} {expected:?}");
            }
        }
        assert!((at(&drawn, 0.0)[4] - at(&mirrored, 0.0)[4]).abs() > 0.1, "{k}");
    }
}
