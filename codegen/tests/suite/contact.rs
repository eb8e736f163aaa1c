//! Contact modes: what they cost, what they leave out, and the generic runtime against what is generated.

use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::Generated;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{self, Grade};
use straightline_codegen::function::ContactFunction;
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::program::contact::{graph, Mode};
use straightline_codegen::scene::contact::{SurfaceItem, UserSurface};
use straightline_codegen::{model, scene};
use straightline_core::algorithms::{Ltdl, Support};
use straightline_core::contact::{Contact, Coordinate, ImplicitSurface, Object, Surface};
use straightline_core::spatial::{Mat3, Transform, Vec3};
use straightline_core::{algorithms as alg, Dd, Real};

fn source(robot: &str) -> Source {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(robot);
    Source::new(robot, std::fs::read_to_string(path).expect("a robot file"))
}

fn options(scene: &str) -> Options {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
    file.unwrap_or_else(|| panic!("{}", diagnostics.render())).into_options(Options::default())
}

fn generated(robot: &str, scene: &str) -> Generated {
    compile(&source(robot), &options(scene)).unwrap_or_else(|d| panic!("{}", d.render()))
}

fn loaded(robot: &str, options: &Options) -> Robot {
    let (model, diagnostics) = model::load(&source(robot), &options.model);
    Robot::new(model.unwrap_or_else(|| panic!("{}", diagnostics.render())))
}

fn surface(frame: &str) -> String {
    format!(
        "[outputs]\nfunctions = [\"forward_dynamics\"]\ncontact = [\"forward_dynamics\"]\n\n[[contact]]\nname = \"pen\"\n\
         frame = \"{frame}\"\nobject = {{ origin = [0.5, 0.1, 0.2], z = [0.1, 0.2, 1.0] }}\nconstrained = [\"pz\"]\n"
    )
}

#[test]
fn a_surface_contact_costs_little_more_than_free_motion() {
    for (robot, frame, most) in
        [("panda.urdf", "panda_hand_tcp", 1.4), ("ur5.urdf", "tool0", 1.6), ("puma560.urdf", "tool0", 1.6)]
    {
        let report = generated(robot, &surface(frame)).report;
        let free = &report.functions["forward_dynamics"];
        let free = free.mul + free.add + free.div + free.sqrt;
        let ratio = report.contact[0].counts.flops() as f64 / free as f64;
        println!("{robot}: {free} operations, in contact {ratio:.3} times as many");
        assert!(ratio <= most, "{robot}: {ratio:.3}");
    }
}

#[test]
fn a_scene_without_contact_has_nothing_of_it() {
    let free = generated("ur5.urdf", "[outputs]\nfunctions = [\"forward_dynamics\"]\n");
    assert!(!free.text.contains("contact") && free.report.contact.is_empty());
    let in_contact = generated("ur5.urdf", &surface("tool0"));
    let function = |text: &str| text[text.rfind("/// Forward dynamics q̈ =").expect("it is there")..].to_string();
    assert_eq!(function(&free.text), function(&in_contact.text), "free motion is what it was");
}

/// q, q̇, tau that no symmetry of the robot hides behind.
fn state(n: usize) -> Vec<f64> {
    let q = (0..n).map(|i| 0.4 + 0.37 * i as f64 - 0.11 * (i * i) as f64);
    let qd = (0..n).map(|i| 0.9 - 0.53 * i as f64 + 0.07 * (i * i) as f64);
    let tau = (0..n).map(|i| 3.0 - 1.7 * i as f64);
    q.chain(qd).chain(tau).collect()
}

#[test]
fn under_exact_rules_a_contact_mode_is_the_generic_runtime_bit_for_bit() {
    let text = surface("tool0").replace("[\"pz\"]", "[\"px\", \"py\", \"ax\", \"ay\"]");
    let options = Options { grade: Grade::Exact, ..options(&text) };
    let robot = loaded("ur5.urdf", &options);
    let modes = Mode::all(&options.scene);
    let graph = graph(&robot, &options, &modes[0], ContactFunction::ForwardDynamics);
    let state = state(6);
    let found = expr::evaluate::<f64>(&graph, &state);

    let model = robot.model.cast::<f64>();
    let (q, qd, tau) = (&state[..6], &state[6..12], &state[12..]);
    // the object's axes, in double-double and rounded once, as constants are
    let unit = |v: Vec3<Dd>| v.scale(Dd::ONE / v.dot(v).sqrt());
    let d = |x: [f64; 3]| Vec3::from(x.map(Dd::from));
    let exact = |v: Vec3<Dd>| {
        let length = v.dot(v).sqrt();
        v.map(|x| x / length)
    };
    let z = exact(d([0.1, 0.2, 1.0]));
    let x = d([1.0, 0.0, 0.0]);
    let x = exact(x - z.scale(x.dot(z)));
    assert!((unit(x) - x).dot(unit(x) - x).hi() < 1e-50);
    let narrow = |v: Vec3<Dd>| v.map(f64::constant);
    let contact = Contact {
        name: "pen".into(),
        frame: model.frame("tool0").expect("a frame of the robot").clone(),
        axis: Vec3::new(0.0, 0.0, 1.0),
        second_axis: Vec3::new(1.0, 0.0, 0.0),
        object: Object::Fixed(Transform {
            rotation: Mat3::from_columns(narrow(x), narrow(z.cross(x)), narrow(z)),
            translation: Vec3::new(0.5, 0.1, 0.2),
        }),
        surface: Surface::Plane,
        constrained: vec![Coordinate::Px, Coordinate::Py, Coordinate::Ax, Coordinate::Ay],
        free: vec![],
        friction: None,
    };
    let s = alg::constrained_coordinates(&model, &contact, q, qd);
    let factor = Ltdl::factor(&model, &alg::mass_matrix(&model, q));
    let drive: Vec<f64> = tau.iter().zip(alg::bias_force(&model, q, qd)).map(|(t, h)| t - h).collect();
    let motion = alg::constrained_forward_dynamics(&factor, &drive, &s, None, &[Support::Rigid(0.0); 4], 1e-12);
    let expected = [motion.qdd, motion.force, motion.sdd, motion.violation, vec![motion.pivot]].concat();
    assert_eq!(found, expected);
}

/// |p|⁴ = r⁴: a sphere in disguise, far from a distance.
struct Disguised(f64);

impl ImplicitSurface for Disguised {
    fn value<T: Real>(&self, p: Vec3<T>) -> T {
        let square = p.dot(p);
        square * square - T::constant(Dd::from(self.0.powi(4)))
    }
}

#[test]
fn one_sphere_in_three_forms_gives_one_motion() {
    let with = |surface: &str| surface_scene(surface);
    let quadric = "surface = { kind = \"quadric\", matrix = [1, 1, 1], constant = -0.25 }\n";
    let sphere = options(&with("surface = { kind = \"sphere\", radius = 0.5 }\n"));
    let mut user = sphere.clone();
    user.scene.contacts.contacts[0].surface = SurfaceItem::Implicit(UserSurface::new("fourth power", Disguised(0.5)));
    let robot = loaded("ur5.urdf", &sphere);
    // a state on the sphere: its centre is placed there
    let state = state(6);
    let frame = robot.model.cast::<f64>();
    let tip = alg::forward_kinematics(&frame, &state[..6], &[frame.frame("tool0").expect("a frame")])[0].translation;
    let run = |options: &Options| {
        let mut options = options.clone();
        let object = options.scene.contacts.contacts[0].object.as_mut().expect("it does not move");
        object.origin = [tip.x - 0.3, tip.y, tip.z - 0.4];
        let modes = Mode::all(&options.scene);
        let graph = graph(&robot, &options, &modes[0], ContactFunction::ForwardDynamics);
        expr::evaluate::<f64>(&graph, &[&state[..6], &state[12..]].concat())
    };
    let expected = run(&sphere);
    for other in [run(&options(&with(quadric))), run(&user)] {
        let largest = expected[..7].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for (a, b) in expected.iter().zip(&other).take(7) {
            assert!((a - b).abs() <= 1e-9 * largest, "{expected:?}\n{other:?}");
        }
    }
}

fn surface_scene(surface: &str) -> String {
    // at rest: where ṡ is not zero, s̈ of a distance and of a first-order distance differ
    format!("{}{surface}[zero]\nqd = true\n", self::surface("tool0"))
}

/// The results of a function of the first mode by the name of the output; inputs by name.
fn run(
    options: &Options,
    robot: &Robot,
    function: ContactFunction,
    inputs: &[(&str, &[f64])],
) -> Vec<(String, Vec<f64>)> {
    let modes = Mode::all(&options.scene);
    let graph = graph(robot, options, &modes[0], function);
    let given = graph.inputs.iter().flat_map(|port| {
        let found = inputs.iter().find(|(name, _)| *name == port.name);
        found.unwrap_or_else(|| panic!("the input {} is missing", port.name)).1.to_vec()
    });
    let results = expr::evaluate::<f64>(&graph, &given.collect::<Vec<f64>>());
    let mut rest = &results[..];
    let output = |port: &expr::Port| {
        let (own, after) = rest.split_at(port.len());
        rest = after;
        (port.name.clone(), own.to_vec())
    };
    graph.outputs.iter().map(output).collect()
}

fn result<'a>(results: &'a [(String, Vec<f64>)], name: &str) -> &'a [f64] {
    &results.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no result {name}")).1
}

#[test]
fn drives_for_a_wanted_motion_and_wanted_reactions_make_them() {
    for (robot, frame, n) in [("ur5.urdf", "tool0", 6), ("panda.urdf", "panda_hand_tcp", 7)] {
        let options = options(&surface(frame).replace("contact = [\"forward_dynamics\"]\n", ""));
        let robot = loaded(robot, &options);
        let state = state(n);
        let (q, qd) = (&state[..n], &state[n..2 * n]);
        let (sdd, force, rest) = ([0.3, -0.7, 0.4, 0.2, -0.5], [25.0], vec![0.1; n]);
        let inputs: [(&str, &[f64]); 5] = [("q", q), ("qd", qd), ("qdd", &rest), ("sdd_free", &sdd), ("force", &force)];
        let drives = run(&options, &robot, ContactFunction::InverseDynamics, &inputs);
        let tau = result(&drives, "tau");
        let motion = run(&options, &robot, ContactFunction::ForwardDynamics, &[("q", q), ("qd", qd), ("tau", tau)]);
        assert!((result(&motion, "force")[0] - 25.0).abs() < 1e-9, "{motion:?}");
        assert!(result(&motion, "violation")[0].abs() < 1e-11);
        let free = run(&options, &robot, ContactFunction::FreeCoordinates, &[("q", q), ("qd", qd)]);
        let (j, a, qdd) = (result(&free, "j"), result(&free, "a"), result(&motion, "qdd"));
        for (k, wanted) in sdd.iter().enumerate() {
            let found = a[k] + (0..n).map(|i| j[k * n + i] * qdd[i]).sum::<f64>();
            assert!((found - wanted).abs() < 1e-9, "s̈ {k}: {found} for {wanted}");
        }
    }
}

#[test]
fn a_mode_may_stick_or_slide_on_several_contacts_and_a_loop_may_close() {
    // an arm whose hand slides on a table by friction while its slider is held to a point of the hand's frame's axis
    let scene = r#"
[outputs]
functions = []

[[contact]]
name = "table"
frame = "tool0"
object = { origin = [0.4, 0.0, 0.1], z = [0.0, 0.0, 1.0] }
constrained = ["pz"]
friction = { coefficient = 0.3 }

[[contact]]
name = "wall"
frame = "wrist_1_link"
object = { origin = [0.4, 0.4, 0.1], z = [0.0, -1.0, 0.0] }
constrained = ["pz"]

[[mode]]
name = "sliding"
contacts = ["table", "wall"]

[[mode]]
name = "sticking"
contacts = ["table"]
sticking = ["table"]

[stabilisation]
frequency = 40.0
"#;
    let generated = generated("ur5.urdf", scene);
    for text in [
        "pub enum Mode",
        "Sliding,",
        "Sticking,",
        "[&str; 2] = [\"table.pz\", \"wall.pz\"]",
        "[&str; 3] = [\"table.px\", \"table.py\", \"table.pz\"]",
        "pub const MOST_CONSTRAINED: usize = 3;",
    ] {
        assert!(generated.text.contains(text), "{text} is missing");
    }
    let options = options(scene);
    let robot = loaded("ur5.urdf", &options);
    let state = state(6);
    let (q, qd, tau) = (&state[..6], &state[6..12], &state[12..]);
    let motion = run(&options, &robot, ContactFunction::ForwardDynamics, &[("q", q), ("qd", qd), ("tau", tau)]);
    let coordinates = run(&options, &robot, ContactFunction::ConstrainedCoordinates, &[("q", q), ("qd", qd)]);
    // Baumgarte's s̈, whatever friction does
    for k in 0..2 {
        let (s, sd) = (result(&coordinates, "s")[k], result(&coordinates, "sd")[k]);
        let wanted = -80.0 * sd - 1600.0 * s;
        let found = result(&motion, "sdd")[k];
        assert!((found - wanted).abs() < 1e-9 * wanted.abs(), "{found} for {wanted}");
    }
}

#[test]
fn what_sticks_is_not_pulled_to_the_origin_and_what_gives_way_not_to_the_surface() {
    let text = |mode: &str, more: &str| {
        surface("tool0")
            .replace("contact = [\"forward_dynamics\"]\n", "")
            .replace("[\"pz\"]\n", &format!("[\"pz\"]\n{more}\n{mode}"))
    };
    let state = state(6);
    let (q, qd, tau) = (&state[..6], &state[6..12], &state[12..]);
    let mode =
        "[[mode]]\nname = \"still\"\ncontacts = [\"pen\"]\nsticking = [\"pen\"]\n[stabilisation]\nfrequency = 40.0\n";
    let sticking = options(&text(mode, "friction = { coefficient = 0.3 }"));
    let robot = loaded("ur5.urdf", &sticking);
    let motion = run(&sticking, &robot, ContactFunction::ForwardDynamics, &[("q", q), ("qd", qd), ("tau", tau)]);
    let found = run(&sticking, &robot, ContactFunction::ConstrainedCoordinates, &[("q", q), ("qd", qd)]);
    let (s, sd) = (result(&found, "s"), result(&found, "sd"));
    for (k, square) in [(0, 0.0), (1, 0.0), (2, 1600.0)] {
        let wanted = -80.0 * sd[k] - square * s[k];
        let sdd = result(&motion, "sdd")[k];
        assert!((sdd - wanted).abs() < 1e-9 * wanted.abs(), "{k}: {sdd} for {wanted}");
    }
    // J dq: the distance is taken away, the place on the surface stays
    let corrected = |options: &Options, robot: &Robot| {
        let dq = run(options, robot, ContactFunction::Projection, &[("q", q)]);
        let found = run(options, robot, ContactFunction::ConstrainedCoordinates, &[("q", q), ("qd", qd)]);
        let rows = result(&found, "j").chunks(6).map(|row| row.iter().zip(result(&dq, "dq")).map(|(j, d)| j * d).sum());
        (rows.collect::<Vec<f64>>(), result(&found, "s").to_vec())
    };
    let (moved, s) = corrected(&sticking, &robot);
    assert!(moved[0].abs() < 1e-9 && moved[1].abs() < 1e-9 && (moved[2] + s[2]).abs() < 1e-9, "{moved:?} {s:?}");
    let soft = options(&text("", "environment = { kind = \"elastic\", stiffness = 1e4, damping = 10.0 }"));
    let dq = run(&soft, &loaded("ur5.urdf", &soft), ContactFunction::Projection, &[("q", q)]);
    assert_eq!(result(&dq, "dq"), [0.0; 6]);
}

#[test]
fn drives_in_contact_are_the_robot_of_the_drives_with_the_reactions_on_it() {
    let path = |name: &str| format!("{}/../robots/scenes/{name}", env!("CARGO_MANIFEST_DIR"));
    for scene in ["planar_2r_drives.toml", "planar_2r_elastic.toml"] {
        let text = std::fs::read_to_string(path(scene)).expect("a scene");
        let contact = "[outputs]\nfunctions = []\n[[contact]]\nname = \"wall\"\nframe = \"tip\"\nobject = { origin = [0.4, 0.0, 0.1], z = \
                       [-1.0, 0.0, 0.3] }\nconstrained = [\"pz\"]\n";
        let options = options(&(text + contact));
        let mut diagnostics = Diagnostics::new();
        let (model, _) = model::load(&source("planar_2r.toml"), &options.scene.model_options(&options.model));
        let model = scene::apply(model.expect("a robot"), &options.scene, &mut diagnostics).expect("a scene");
        let robot = Robot::new(model);
        let model = robot.model.cast::<f64>();
        let n = alg::drive_states(&model);
        let (q, qd, u) = ([0.3, -0.7], [0.4, -0.9], [7.0, -4.0]);
        let x: Vec<f64> = (0..n).map(|k| [29.7, 35.0, 1.2, -69.0, -88.0, 0.7][k % 6]).collect();
        let inputs: [(&str, &[f64]); 4] = [("q", &q), ("qd", &qd), ("x", &x), ("u", &u)];
        let motion = run(&options, &robot, ContactFunction::DrivenForwardDynamics, &inputs);
        let found = run(&options, &robot, ContactFunction::ConstrainedCoordinates, &inputs);
        let (j, a, force) = (result(&found, "j"), result(&found, "a"), result(&motion, "force")[0]);
        let qdd = result(&motion, "qdd");
        let sdd = j[0] * qdd[0] + j[1] * qdd[1] + a[0];
        assert!(sdd.abs() < 1e-9 * (j[0] * qdd[0]).abs() && force.abs() > 1.0, "{scene}: {sdd}");
        // the reaction given as a force beside, by the function without contact
        let h = alg::bias_force(&model, &q, &qd);
        let with_reaction: Vec<f64> = (0..2).map(|i| h[i] - j[i] * force).collect();
        let mass_matrix = alg::mass_matrix(&model, &q);
        let links = alg::Links::MassMatrix(&mass_matrix);
        let expected = alg::driven_motion(&model, (&q, &qd, &x, &u), &with_reaction, &links);
        for (a, b) in qdd.iter().chain(result(&motion, "xd")).zip(expected.qdd.iter().chain(&expected.xd)) {
            assert!((a - b).abs() <= 1e-10 * b.abs().max(1.0), "{scene}: {a} for {b}");
        }
        // H* Δq̇ = Jᵀ I
        let (h_star, ..) = alg::complete_model(&model, (&q, &qd, &x), &h, &mass_matrix);
        let blow = run(&options, &robot, ContactFunction::Impact, &[("q", &q), ("qd", &qd), ("restitution", &[0.3])]);
        let (dqd, impulse) = (result(&blow, "dqd"), result(&blow, "impulse")[0]);
        for i in 0..2 {
            let momentum = h_star[2 * i] * dqd[0] + h_star[2 * i + 1] * dqd[1];
            assert!((momentum - j[i] * impulse).abs() < 1e-10 * impulse.abs(), "{scene}");
        }
        let sd = result(&found, "sd")[0];
        assert!((j[0] * dqd[0] + j[1] * dqd[1] + 1.3 * sd).abs() < 1e-10);
    }
}
