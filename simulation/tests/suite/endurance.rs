//! Every run ends: in a result whose numbers are finite, or early with what is wrong and what helps.

use crate::common::{arm, at, body, cart, drive, one, plane};
use straightline_core::algorithms::forward_kinematics;
use straightline_core::drive::{Actuator, Drive, Motor, Stage};
use straightline_core::model::{JointEffects, JointKind, Model};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_simulation::command::{Command, Compensation, Controller, Samples};
use straightline_simulation::contact;
use straightline_simulation::drives::Inputs;
use straightline_simulation::motion::Motion;
use straightline_simulation::plant::Plant;
use straightline_simulation::simulate::{simulate, Failure, Method, Run, Settings};

const MOTOR: Motor<f64> = Motor {
    rotor_inertia: 8e-5,
    torque_constant: 0.1,
    emf_constant: 0.1,
    friction: 1e-4,
    resistance: 1.1,
    inductance: Some(2e-3),
};

fn attempt(model: &Model<f64>, command: &Command, q: &[f64], settings: &Settings) -> Result<Run, Failure> {
    let plant = Plant::new(model.clone(), 1e-3);
    let run = simulate(&plant, command, (q, &vec![0.0; model.nv()]), settings, &|_| ());
    if let Ok(run) = &run {
        assert!(run.table.rows.iter().flatten().all(|x| x.is_finite()));
    }
    run
}

/// A failure that names all of this.
#[track_caller]
fn fails(run: Result<Run, Failure>, words: &[&str]) -> Failure {
    let Err(failure) = run else { panic!("it cannot go well: {words:?}") };
    let text = format!("{failure} {}", failure.help.as_deref().unwrap_or_default());
    assert!(words.iter().all(|word| text.contains(word)), "{text}");
    failure
}

fn controlled(model: &Model<f64>, period: f64, gain: f64) -> Command {
    let n = model.nv();
    let motion = Motion::quintic(&[0.0, 1.0], &[vec![0.0; n], vec![0.3; n]]).expect("a motion");
    Command::Controller(Box::new(Controller {
        model: model.clone(),
        compensation: Compensation::None,
        motion,
        stiffness: vec![gain; n],
        damping: vec![0.1 * gain; n],
        saturates: false,
        gives_currents: false,
        period: Some(period),
        feedback: None,
        delay: 0,
    }))
}

#[test]
fn rows_and_computations_without_number_are_refused_at_once() {
    let (model, start) = (arm(), [0.1; 3]);
    let of = |duration: f64, interval: f64| Settings { interval, ..Settings::lasting(duration) };
    fails(attempt(&model, &Command::Free, &start, &of(1e6, 1e-6)), &["1.0e12 rows", "interval"]);
    let failure = fails(attempt(&model, &Command::Free, &start, &of(1e300, 1e-300)), &["1e300 s", "rows", "interval"]);
    assert!(failure.to_string().len() < 150, "no row of zeros: {failure}");
    fails(attempt(&model, &Command::Free, &start, &of(f64::NAN, 0.01)), &["duration", "NaN"]);
    fails(attempt(&model, &Command::Free, &start, &of(1.0, 0.0)), &["interval"]);
    fails(attempt(&model, &Command::Free, &start, &of(-1.0, 0.01)), &["duration"]);
    let command = controlled(&model, 1e-6, 1.0);
    fails(attempt(&model, &command, &start, &of(1e4, 1.0)), &["1.0e10 times", "period", "max_steps"]);
    let command = controlled(&model, f64::INFINITY, 1.0);
    fails(attempt(&model, &command, &start, &of(1.0, 0.01)), &["period"]);
}

#[test]
fn what_would_take_too_many_steps_stops_early_and_says_what_helps() {
    // undamped 1e6 rad/s: a hundred seconds would take some 1e8 steps
    let mut model = arm();
    model.bodies[1].effects.stiffness = 1e12;
    let settings = Settings { duration: 100.0, ..Settings::lasting(1.0) };
    let failure = fails(attempt(&model, &Command::Free, &[0.1; 3], &settings), &["steps", "stiff", "max_steps"]);
    assert!(failure.time < 1.0, "{failure}");
    // damped, so that stability alone holds steps back: that is found out
    for body in &mut model.bodies {
        (body.effects.stiffness, body.effects.damping) = (1e8, 1e8);
    }
    let failure = fails(
        attempt(&model, &Command::Free, &[0.2; 3], &Settings { tolerance: 1e-5, ..settings }),
        &["stability", "method = \"stiff\"", "max_steps"],
    );
    assert!(failure.time < 1.0, "{failure}");
    let stiff = Settings { method: Method::Stiff, tolerance: 1e-6, ..settings };
    let run = attempt(&model, &Command::Free, &[0.2; 3], &stiff).expect("the implicit method does not mind");
    println!("{} steps by the implicit method", run.steps);
    // the end is in sight: the limit itself
    let few = Settings { most_steps: 20, interval: 0.1, tolerance: 1e-12, ..Settings::lasting(1.0) };
    fails(attempt(&arm(), &Command::Free, &[0.1; 3], &few), &["more than 20 steps", "max_steps"]);
}

#[test]
fn no_number_of_a_result_is_anything_but_finite() {
    let settings = Settings::lasting(1.0);
    for (torque, words) in [(1e300, "the"), (f64::NAN, "to_cart"), (f64::INFINITY, "to_cart")] {
        let torques = Command::Torques(Samples { times: vec![0.0], rows: vec![vec![torque]] });
        for method in [Method::Adaptive, Method::Stiff] {
            fails(attempt(&cart(), &torques, &[0.0], &Settings { method, ..settings }), &[words]);
        }
    }
    // no digits are left of the sine
    for angle in [1e8, 1e300, f64::NAN] {
        fails(attempt(&arm(), &Command::Free, &[0.1, angle, 0.1], &settings), &["to_upper"]);
    }
    // a joint that turns there
    let mut model = arm();
    model.bodies.iter_mut().for_each(|b| b.effects = JointEffects::none());
    let torques = Command::Torques(Samples { times: vec![0.0], rows: vec![vec![1e9, 0.0, 0.0]] });
    let most = Settings { most_steps: 20_000, ..settings };
    for method in [Method::Adaptive, Method::Stiff] {
        fails(attempt(&model, &torques, &[0.1; 3], &Settings { method, ..most }), &["steps"]);
    }
    // gains and masses of all sizes end in finite numbers or in words
    for size in [1e-300, 1e-30, 1e30, 1e300] {
        let settings = Settings { most_steps: 20_000, ..Settings::lasting(0.1) };
        let _ = attempt(&arm(), &controlled(&arm(), 0.01, size), &[0.1; 3], &settings);
        let mut heavy = arm();
        heavy.bodies[2].inertia.mass *= size;
        let _ = attempt(&heavy, &Command::Free, &[0.1; 3], &settings);
    }
}

/// A body of a quarter kilogram and 20 cm, asymmetric.
fn link(name: &str, parent: Option<usize>, i: usize, placement: Transform<f64>) -> straightline_core::model::Body<f64> {
    let mut body = body(name, parent, JointKind::Revolute, i, placement);
    body.inertia = SpatialInertia::new(
        0.25,
        Vec3::new(0.1, 0.01, -0.005),
        Sym3 { xx: 2e-4, xy: 2e-5, xz: -1e-5, yy: 9e-4, yz: 3e-5, zz: 8e-4 },
    );
    body
}

/// Axes that turn by a quarter from joint to joint.
fn across() -> Mat3<f64> {
    Mat3 { rows: [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]] }
}

fn tree(parents: &[Option<usize>]) -> Model<f64> {
    let mut model = arm();
    let place = |parent: &Option<usize>| at(across(), if parent.is_some() { 0.2 } else { 0.0 });
    model.bodies = (0..parents.len()).map(|i| link(&format!("b{i}"), parents[i], i, place(&parents[i]))).collect();
    model.frames.clear();
    model
}

/// A motor behind a spring at every joint.
fn elastic(model: &mut Model<f64>, stiffness: f64) {
    let stage = Stage { ratio: 60.0, stiffness, damping: Some(1e-3 * stiffness), inertia: 2e-6, efficiency: None };
    let of = |i: usize| {
        let mut drive = drive(&format!("d{i}"), MOTOR, &[(i, 1.0)]);
        drive.stages = vec![stage];
        drive.input_limit = Some(24.0);
        drive
    };
    model.drives = (0..model.bodies.len()).map(of).collect::<Vec<Drive<f64>>>();
}

fn voltages(n: usize) -> Command {
    let times: Vec<f64> = (0..=4).map(|k| 0.25 * f64::from(k)).collect();
    let row = |t: &f64| (0..n).map(|i| 8.0 * (2.0 * t + i as f64).sin()).collect();
    let rows = times.iter().map(row).collect();
    Command::Inputs(Inputs { samples: Samples { times, rows }, are_currents: vec![false; n] }, None)
}

#[test]
fn a_tree_of_thirty_driven_joints_has_room_in_the_implicit_method() {
    // a trunk of six, four limbs of six
    let parents: Vec<Option<usize>> = (0..30)
        .map(|i: usize| match i {
            0 => None,
            1..6 => Some(i - 1),
            _ if i.is_multiple_of(6) => Some(5),
            _ => Some(i - 1),
        })
        .collect();
    let mut model = tree(&parents);
    elastic(&mut model, 5e3);
    let q: Vec<f64> = (0..30).map(|i| 0.3 * f64::from(i).sin()).collect();
    let settings =
        Settings { method: Method::Stiff, tolerance: 1e-6, stops_at_limits: false, ..Settings::lasting(0.1) };
    let plant = Plant::new(model, 1e-3);
    assert!(plant.states() > 128, "{}", plant.states());
    let run =
        simulate(&plant, &voltages(30), (&q, &[0.0; 30]), &settings, &|_| ()).unwrap_or_else(|why| panic!("{why}"));
    println!("{} steps, {} evaluations, {:?}", run.steps, run.evaluations, run.balance);
    assert!(run.balance.relative() < 1e-4 && run.balance.drives.joule > 1e-3, "{:?}", run.balance);
}

#[test]
fn a_chain_of_thirty_links_falls_to_the_end() {
    let chain: Vec<Option<usize>> = (0..30usize).map(|i| i.checked_sub(1)).collect();
    let mut model = tree(&chain);
    let q: Vec<f64> = (0..30).map(|i| 0.2 * f64::from(i).cos()).collect();
    let settings = Settings { tolerance: 1e-6, stops_at_limits: false, ..Settings::lasting(0.3) };
    for method in [Method::Adaptive, Method::Stiff] {
        let run =
            attempt(&model, &Command::Free, &q, &Settings { method, ..settings }).unwrap_or_else(|e| panic!("{e}"));
        println!("{method:?}: {} steps, {} evaluations, {:e}", run.steps, run.evaluations, run.balance.relative());
        assert!(run.balance.relative() < 1e-4, "{method:?} {:?}", run.balance);
    }
    // springs of 1e6 N·m/rad, between rotors and links of 1e-3 kg·m²
    elastic(&mut model, 1e6);
    let stiff = Settings { method: Method::Stiff, duration: 0.1, ..settings };
    let run = attempt(&model, &voltages(30), &q, &stiff).unwrap_or_else(|e| panic!("{e}"));
    println!("driven: {} steps, {} evaluations, {:e}", run.steps, run.evaluations, run.balance.relative());
    assert!(run.balance.relative() < 1e-4, "{:?}", run.balance);
}

#[test]
fn elastic_drives_in_contact_go_through_at_every_tolerance() {
    let mut model = arm();
    elastic(&mut model, 2e3);
    for drive in &mut model.drives {
        let Actuator::Motor(motor) = &mut drive.actuator else { panic!("motors") };
        motor.inductance = Some(2e-4);
    }
    let q = [0.3, -0.4, 0.5];
    let tip = forward_kinematics(&model, &q, &[&model.frames[0]])[0].translation;
    let below = Transform { rotation: Mat3::identity(), translation: Vec3::new(tip.x, tip.y, tip.z - 0.05) };
    let contacts = one(plane("floor", &model.frames[0], below));
    let plant = Plant::new(model, 1e-3);
    let mut steps = 0;
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9] {
        let method = Method::Stiff;
        let settings = Settings { method, tolerance, stops_at_limits: false, ..Settings::lasting(0.6) };
        let run = contact::simulate(&plant, &contacts, &voltages(3), (&q, &[0.0; 3]), &settings, &|_| ())
            .unwrap_or_else(|why| panic!("tolerance {tolerance:e}: {why}"));
        let (balance, events) = (&run.run.balance, &run.events);
        println!("{tolerance:e}: {} steps, {} events, {:e}", run.run.steps, events.len(), balance.relative());
        assert!(!events.is_empty() && balance.relative() < 1e2 * tolerance.powf(0.8), "{tolerance:e}: {balance:?}");
        assert!(run.run.steps > steps, "a smaller tolerance takes more steps");
        steps = run.run.steps;
    }
}
