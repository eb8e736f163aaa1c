//! A scene changes the robot as it says, and nothing else: in double-double, against the robot without the scene.

use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::scene_file;
use straightline_codegen::scene::{self, Base, CoulombForm, Effects, Gravity, Payload, Scene};
use straightline_codegen::{compile, Function, Options};
use straightline_core::algorithms::*;
use straightline_core::model::{self, Body, Joint, JointKind, Model};
use straightline_core::spatial::Vec3;
use straightline_core::Dd;

/// Of the largest entry: some hundred operations of mixed signs in double-double, whose unit is 1e-32.
const DD: f64 = 1e-28;

/// Six joints on two branches, axes oblique, a slide in the middle and one at an end, every joint with effects; in an order
/// of their own in the coordinates.
const ROBOT: &str = include_str!("../files/branched.toml");
const ORDER: [&str; 6] = ["elbow", "shoulder", "grip", "wrist", "slide", "head"];

fn options() -> ModelOptions {
    ModelOptions { joint_order: Some(ORDER.map(str::to_string).to_vec()), ..ModelOptions::default() }
}

fn model_of(text: &str, options: &ModelOptions) -> Model<Dd> {
    let (model, diagnostics) = load(&Source::new("robot.toml", text), options);
    model.unwrap_or_else(|| panic!("{diagnostics}"))
}

fn applied(model: &Model<Dd>, scene: &Scene) -> Model<Dd> {
    let mut diagnostics = Diagnostics::new();
    let model = scene::apply(model.clone(), scene, &mut diagnostics);
    assert!(diagnostics.is_empty(), "{diagnostics}");
    model.expect("no error was said")
}

fn locked(joints: &[(&str, f64)]) -> Scene {
    Scene { locked: joints.iter().map(|(name, q)| (name.to_string(), *q)).collect(), ..Scene::default() }
}

/// A number in (−1, 1) for each k, the same on every machine.
fn number(k: usize) -> Dd {
    let x = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    Dd::from((x >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
}

#[track_caller]
fn agree(actual: &[Dd], expected: &[Dd], what: &str) {
    assert_eq!(actual.len(), expected.len(), "{what}");
    let scale = expected.iter().fold(1.0f64, |m, x| m.max(x.abs().to_f64()));
    for (i, (a, e)) in actual.iter().zip(expected).enumerate() {
        let error = (*a - *e).abs().to_f64() / scale;
        assert!(error <= DD, "{what}: entry {i}: {a:?} is not {e:?}: {error:e}");
    }
}

/// The state of a robot whose joints move, and the same of the whole robot with the others held.
struct States {
    moving: [Vec<Dd>; 3],
    whole: [Vec<Dd>; 3],
    /// For each velocity coordinate of the first, that of the second.
    index: Vec<usize>,
}

fn states(whole: &Model<Dd>, moving: &Model<Dd>, held: &[(&str, f64)]) -> States {
    let joint = |m: &Model<Dd>, name: &str| -> Joint {
        m.bodies.iter().map(|b| b.joint.clone()).find(|j| j.name == name).expect("the joint is there")
    };
    let [q, qd, qdd] = [0, 100, 200].map(|k| (0..moving.nv()).map(|i| number(k + i)).collect::<Vec<_>>());
    let mut all = [(); 3].map(|()| vec![Dd::ZERO; whole.nv()]);
    let mut index = vec![0; moving.nv()];
    for j in moving.free_joints() {
        let in_whole = joint(whole, &j.name);
        index[j.iv] = in_whole.iv;
        all[0][in_whole.iq] = q[j.iq];
        (all[1][in_whole.iv], all[2][in_whole.iv]) = (qd[j.iv], qdd[j.iv]);
    }
    for (name, value) in held {
        all[0][joint(whole, name).iq] = Dd::from(*value);
    }
    States { moving: [q, qd, qdd], whole: all, index }
}

#[track_caller]
fn a_locked_robot_is_the_whole_one_held(held: &[(&str, f64)]) {
    let whole = model_of(ROBOT, &options());
    let model = applied(&whole, &locked(held));
    assert_eq!(model.nv(), whole.nv() - held.len());
    let names: Vec<&str> = ORDER.into_iter().filter(|name| !held.iter().any(|(h, _)| h == name)).collect();
    let mut in_order: Vec<&Joint> = model.free_joints().collect();
    in_order.sort_by_key(|j| j.iv);
    assert_eq!(in_order.iter().map(|j| j.name.as_str()).collect::<Vec<_>>(), names, "the order of the others is kept");

    let States { moving: [q, qd, qdd], whole: [wq, wqd, wqdd], index } = states(&whole, &model, held);
    let pick = |all: Vec<Dd>| index.iter().map(|i| all[*i]).collect::<Vec<_>>();
    agree(&inverse_dynamics(&model, &q, &qd, &qdd), &pick(inverse_dynamics(&whole, &wq, &wqd, &wqdd)), "tau");
    agree(&gravity_force(&model, &q), &pick(gravity_force(&whole, &wq)), "g");
    agree(&bias_force(&model, &q, &qd), &pick(bias_force(&whole, &wq, &wqd)), "h");
    let h = mass_matrix(&whole, &wq);
    let rows: Vec<Dd> = index.iter().flat_map(|i| index.iter().map(|j| h[*i * whole.nv() + *j])).collect();
    agree(&mass_matrix(&model, &q), &rows, "H");
    let tau = inverse_dynamics(&model, &q, &qd, &qdd);
    agree(&forward_dynamics_aba(&model, &q, &qd, &tau), &qdd, "q̈");
    for (a, b) in model.frames.iter().zip(&whole.frames) {
        assert_eq!(a.name, b.name);
        let of = |m: &Model<Dd>, f: &model::Frame<Dd>, q: &[Dd], qd: &[Dd], qdd: &[Dd]| {
            let (x, v) = (&forward_kinematics(m, q, &[f])[0], frame_velocity(m, q, qd, f));
            let a = frame_acceleration(m, q, qd, qdd, f);
            let vectors = [x.translation, v.linear, v.angular, a.linear, a.angular];
            let rotation = x.rotation.rows.into_iter().flatten();
            vectors.into_iter().flat_map(Vec3::to_array).chain(rotation).collect::<Vec<_>>()
        };
        agree(&of(&model, a, &q, &qd, &qdd), &of(&whole, b, &wq, &wqd, &wqdd), &a.name);
    }
}

#[test]
fn a_locked_revolute_joint() {
    a_locked_robot_is_the_whole_one_held(&[("elbow", 0.4)]);
}

#[test]
fn a_locked_slide() {
    a_locked_robot_is_the_whole_one_held(&[("slide", 0.125)]);
}

#[test]
fn the_last_joint_locked() {
    a_locked_robot_is_the_whole_one_held(&[("grip", 0.02)]);
}

#[test]
fn several_joints_locked_in_a_row() {
    a_locked_robot_is_the_whole_one_held(&[("elbow", -0.7), ("slide", 0.2), ("wrist", 1.1)]);
}

#[test]
fn the_root_joint_locked() {
    a_locked_robot_is_the_whole_one_held(&[("shoulder", 0.3)]);
}

#[test]
fn all_but_one_locked() {
    let held = [("shoulder", 0.3), ("elbow", 0.2), ("wrist", -0.5), ("grip", 0.01), ("head", 0.6)];
    a_locked_robot_is_the_whole_one_held(&held);
}

#[test]
fn a_joint_locked_at_a_right_angle_keeps_the_frames_square() {
    // 1.5707963267948966 is 6e-17 less than π/2
    let text =
        ROBOT.replace("axis = [0.1, 1.0, -0.3]", "axis = \"y\"").replace("axis = [0.2, 0.3, 1.0]", "axis = \"z\"");
    let model = applied(&model_of(&text, &options()), &locked(&[("elbow", std::f64::consts::FRAC_PI_2)]));
    let slide = model.bodies.iter().find(|b| b.joint.name == "slide").expect("the slide moves");
    let is_square = |x: &Dd| *x == Dd::ZERO || x.abs() == Dd::ONE;
    assert!(slide.placement.rotation.rows.iter().flatten().all(is_square), "{:?}", slide.placement.rotation);
}

#[test]
fn a_payload_is_a_link_on_a_fixed_joint() {
    let link = r#"
[[link]]
name = "load"
mass = 1.25
com = [0.03, -0.02, 0.07]
inertia = { xx = 0.011, yy = 0.009, zz = 0.006, xy = 0.001, xz = -0.0005, yz = 0.0007 }

[[joint]]
name = "weld"
kind = "fixed"
parent = "hand"
child = "load"
origin = { xyz = [0.02, -0.05, 0.08], rpy_deg = [20, 40, -10] }
"#;
    let rebuilt = model_of(&format!("{ROBOT}{link}"), &options());
    let payload = Payload {
        name: "load".into(),
        frame: "camera".into(),
        mass: 1.25,
        com: [0.03, -0.02, 0.07],
        inertia: [0.011, 0.001, -0.0005, 0.009, 0.0007, 0.006],
    };
    for held in [&[][..], &[("wrist", 0.5), ("elbow", 0.25)]] {
        let scene = locked(held);
        let with = Scene { payloads: vec![payload.clone()], ..scene.clone() };
        let (a, b) = (applied(&model_of(ROBOT, &options()), &with), applied(&rebuilt, &scene));
        let state = |k| (0..a.nv()).map(|i| number(k + i)).collect::<Vec<_>>();
        let (q, qd, qdd) = (state(1), state(2), state(3));
        agree(&inverse_dynamics(&a, &q, &qd, &qdd), &inverse_dynamics(&b, &q, &qd, &qdd), "tau");
        agree(&mass_matrix(&a, &q), &mass_matrix(&b, &q), "H");
        let energies = |m: &Model<Dd>| [kinetic_energy(m, &q, &qd), potential_energy(m, &q)];
        agree(&energies(&a), &energies(&b), "energy");
    }
}

#[test]
fn a_floating_robot_on_a_fixed_base_is_the_fixed_robot() {
    let floating = model_of(ROBOT, &ModelOptions { floating_base: true, ..options() });
    let fixed = applied(&floating, &Scene { base: Base::Fixed, ..Scene::default() });
    assert_eq!(fixed, model_of(ROBOT, &options()));
}

#[test]
fn a_base_on_a_given_motion_is_a_floating_base_without_its_own_forces() {
    let scene = Scene { base: Base::Moving, ..Scene::default() };
    let functions = vec![Function::InverseDynamics, Function::GravityForce];
    let options = Options { functions, scene, model: options(), ..Options::default() };
    let generated = compile(&Source::new("robot.toml", ROBOT), &options).unwrap_or_else(|d| panic!("{d}"));
    assert_eq!(generated.model.bodies[0].joint.kind, JointKind::Floating);
    for item in &generated.items {
        assert_eq!(item.outputs()[0].shape, [6], "{}", item.function.name());
    }
}

#[test]
fn gravity_and_effects_are_as_the_scene_says() {
    let whole = model_of(ROBOT, &options());
    let effects_of = |effects: Effects| -> Vec<model::JointEffects<Dd>> {
        let scene = Scene { effects, ..Scene::default() };
        applied(&whole, &scene).bodies.iter().map(|b| b.effects).collect()
    };
    let of_robot = |change: fn(&mut Body<Dd>)| {
        let mut model = whole.clone();
        model.bodies.iter_mut().for_each(change);
        model.bodies.iter().map(|b| b.effects).collect::<Vec<_>>()
    };
    let all = Effects::default();
    assert_eq!(effects_of(all), of_robot(|_| ()));
    assert_eq!(effects_of(Effects { rotor_inertia: false, ..all }), of_robot(|b| b.effects.rotor_inertia = None));
    assert_eq!(effects_of(Effects { damping: false, ..all }), of_robot(|b| b.effects.damping = Dd::ZERO));
    let no_springs = of_robot(|b| (b.effects.stiffness, b.effects.spring_rest) = (Dd::ZERO, Dd::ZERO));
    assert_eq!(effects_of(Effects { springs: false, ..all }), no_springs);
    let off = of_robot(|b| b.effects.coulomb = model::Coulomb::Off);
    assert_eq!(effects_of(Effects { coulomb: CoulombForm::Off, ..all }), off);
    let smooth = of_robot(|b| {
        if let model::Coulomb::Sign(force) = b.effects.coulomb {
            b.effects.coulomb = model::Coulomb::Smooth { force, speed: Dd::from(0.05) };
        }
    });
    assert_eq!(effects_of(Effects { coulomb: CoulombForm::Smooth(0.05), ..all }), smooth);
    assert!(smooth.iter().any(|e| e.coulomb == model::Coulomb::Off), "a joint without friction stays without");

    let moon = applied(&whole, &Scene { gravity: Gravity::Constant([0.5, 0.0, -1.62]), ..Scene::default() });
    assert_eq!(moon.gravity, Vec3::from([0.5, 0.0, -1.62].map(Dd::from)));
}

#[test]
#[ignore = "slow proof: compiles every scene of the robots"]
fn slow_proof_that_every_example_compiles_for_its_robot_without_a_word() {
    let robots = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
    let read = |path: &std::path::Path| {
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("");
        Source::from_bytes(name, std::fs::read(path).expect("the file can be read"))
    };
    let mut count = 0;
    for entry in std::fs::read_dir(robots.join("scenes")).expect("the folder of scenes is there") {
        let path = entry.expect("the folder can be read").path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let scene = read(&path);
        let robot = match scene.path() {
            path if path.starts_with("panda") => "panda.urdf",
            path if path.starts_with("planar_2r") => "planar_2r.toml",
            path if path.starts_with("ur5") => "ur5.urdf",
            _ => "solo12.urdf",
        };
        let mut diagnostics = Diagnostics::new();
        let file = scene_file::read(&scene, &mut diagnostics).unwrap_or_else(|| panic!("{diagnostics}"));
        // of whole robots, one function is enough
        let plain = Options { functions: vec![Function::InverseDynamics], ..Options::default() };
        let options = file.into_options(plain);
        let generated = compile(&read(&robots.join("descriptions").join(robot)), &options);
        let generated = generated.unwrap_or_else(|diagnostics| panic!("{diagnostics}"));
        diagnostics.extend(generated.warnings);
        assert!(diagnostics.is_empty(), "{diagnostics}");
        assert_eq!(generated.items.len(), options.functions.len(), "{}", scene.path());
        count += 1;
    }
    assert!(count >= 10);
}

#[test]
fn scenes_in_code_are_checked_as_those_in_files() {
    let robot = model_of(ROBOT, &options());
    let codes = |scene: &Scene| {
        let mut diagnostics = Diagnostics::new();
        let model = scene::apply(robot.clone(), scene, &mut diagnostics);
        assert_eq!(model.is_none(), diagnostics.has_errors());
        diagnostics.iter().map(|d| d.code).collect::<Vec<_>>()
    };
    assert_eq!(codes(&locked(&[("elbow", 0.1), ("elbow", 0.2)])), ["locked-twice"]);
    assert_eq!(codes(&locked(&[("elbow", f64::NAN)])), ["not-in-range"]);
    let smooth = Effects { coulomb: CoulombForm::Smooth(f64::NAN), ..Effects::default() };
    assert_eq!(codes(&Scene { effects: smooth, ..Scene::default() }), ["not-in-range"]);
    let gravity = Gravity::Constant([0.0, f64::INFINITY, 0.0]);
    assert_eq!(codes(&Scene { gravity, ..Scene::default() }), ["not-in-range"]);
    let payload =
        Payload { name: "p".into(), frame: "camera".into(), mass: 1.0, com: [0.0; 3], inertia: [f64::NAN; 6] };
    assert_eq!(codes(&Scene { payloads: vec![payload], ..Scene::default() }), ["unphysical-body"]);
}

/// Output depends on what a scene says, not on where its file stands.
#[test]
fn a_scene_gives_the_same_bytes_wherever_its_file_stands() {
    let [robot, text] = ["descriptions/planar_2r.toml", "scenes/planar_2r_elastic.toml"].map(|file| {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots").join(file);
        std::fs::read_to_string(path).expect("a file of the repository")
    });
    let at = |folder: &str| {
        let source = Source::new(&format!("{folder}/planar_2r.toml"), robot.clone());
        let file = Source::new(&format!("{folder}/scene.toml"), text.clone());
        let mut diagnostics = Diagnostics::new();
        let file = scene_file::read(&file, &mut diagnostics).expect("a scene of the repository");
        let functions = vec![Function::GravityForce];
        let options = Options { functions, ..Default::default() };
        compile(&source, &file.into_options(options)).expect("it compiles").text
    };
    assert!(at("here") == at("/somewhere/else"));
}
