//! Contacts of robots with drives: what rotors do in an impact, and where the energy of driven arms in contact goes.

use crate::common::{arm, cart, drive, one, plane};
use straightline_core::algorithms::{forward_kinematics, Environment, SpringDamper};
use straightline_core::contact::Friction;
use straightline_core::drive::{Drive, Efficiency, Motor, Rotor, Stage};
use straightline_core::model::{Frame, Model};
use straightline_core::spatial::{Mat3, Transform, Vec3};
use straightline_simulation::command::{Command, Samples};
use straightline_simulation::contact::{simulate, ContactEvent, ContactRun, Touch};
use straightline_simulation::drives::Inputs;
use straightline_simulation::plant::Plant;
use straightline_simulation::simulate::{Method, Settings};

/// kg, of the cart.
const MASS: f64 = 2.0;
/// kg·m², of the rotor.
const ROTOR: f64 = 3e-4;
/// rad/m.
const RATIO: f64 = 90.0;

const MOTOR: Motor<f64> = Motor {
    rotor_inertia: ROTOR,
    torque_constant: 0.1,
    emf_constant: 0.1,
    friction: 1e-4,
    resistance: 1.2,
    inductance: Some(2e-3),
};

/// A motor that only turns: nothing resists and nothing drives it.
const LOOSE: Motor<f64> = Motor { torque_constant: 0.0, emf_constant: 0.0, friction: 0.0, inductance: None, ..MOTOR };

fn stage(ratio: f64, stiffness: f64, damping: f64) -> Stage<f64> {
    Stage { ratio, stiffness, damping: Some(damping), inertia: 0.0, efficiency: None }
}

/// A contact of a frame with a plane through `origin` whose normal is `z`.
fn wall(frame: &Frame<f64>, origin: Vec3<f64>, z: Vec3<f64>, x: Vec3<f64>) -> Touch {
    plane("plane", frame, Transform { rotation: Mat3::from_columns(x, z.cross(x), z), translation: origin })
}

fn run(
    model: Model<f64>,
    touch: Touch,
    command: &Command,
    start: (&[f64], &[f64]),
    t: f64,
    method: Method,
) -> ContactRun {
    let plant = Plant::new(model, 1e-3);
    let settings = Settings {
        duration: t,
        interval: 0.01,
        tolerance: 1e-11,
        method,
        stops_at_limits: false,
        most_steps: 1_000_000,
    };
    simulate(&plant, &one(touch), command, start, &settings, &|_| ()).unwrap_or_else(|why| panic!("{why}"))
}

/// The cart runs with 0.5 m/s into a wall at x = 0.2 m.
fn crash(drive: Drive<f64>, touch: impl Fn(Touch) -> Touch) -> ContactRun {
    let mut model = cart();
    let nose = Frame { name: "nose".into(), body: Some(0), placement: Transform::identity() };
    model.frames = vec![nose.clone()];
    model.drives = vec![drive];
    let wall = wall(&nose, Vec3::new(0.2, 0.0, 0.0), Vec3::new(-1.0, 0.0, 0.0), Vec3::unit_z());
    let run = run(model, touch(wall), &Command::Free, (&[0.0], &[0.5]), 0.6, Method::Adaptive);
    assert!(run.run.balance.relative() < 1e-9, "{:?}", run.run.balance);
    run
}

#[test]
fn a_rotor_behind_a_rigid_gear_is_struck_and_one_behind_a_spring_is_not() {
    let reflected = RATIO * RATIO * ROTOR;
    let rigid = crash(drive("x", LOOSE, &[(0, RATIO)]), |wall| wall);
    let ContactEvent::Touches { impulse, lost } = rigid.events[0].what else { panic!("{:?}", rigid.events) };
    assert!((rigid.events[0].time - 0.4).abs() < 1e-9);
    assert!((impulse - (MASS + reflected) * 0.5).abs() < 1e-9, "{impulse}");
    assert!((lost - 0.125 * (MASS + reflected)).abs() < 1e-9, "{lost}");
    // bounced back, rotor and all
    let back = crash(drive("x", LOOSE, &[(0, RATIO)]), |wall| Touch { restitution: 0.6, ..wall });
    assert!((back.run.qd[0] + 0.3).abs() < 1e-9, "{:?}", back.run.qd);
    let speed = back.run.table.column("speed.x").expect("a drive has a speed");
    assert!((speed.last().expect("rows") + 0.3 * RATIO).abs() < 1e-7, "the shaft turns with the cart");

    let mut elastic = drive("x", LOOSE, &[(0, 1.0)]);
    elastic.stages = vec![stage(RATIO, 4000.0, 0.0)];
    let soft = crash(elastic, |wall| wall);
    let ContactEvent::Touches { impulse, lost } = soft.events[0].what else { panic!("{:?}", soft.events) };
    assert!((impulse - MASS * 0.5).abs() < 1e-9, "{impulse}");
    assert!((lost - 0.125 * MASS).abs() < 1e-9, "{lost}");
    // the rotor turns on, is stopped by the spring after a quarter of its period, and then pulls the cart off the wall
    let period = std::f64::consts::TAU * (reflected / 4000.0).sqrt();
    let pushed = soft.run.table.column("F.plane.pz").expect("a reaction");
    let greatest = pushed.iter().fold(0.0f64, |m, f| m.max(*f));
    assert!(greatest <= 0.5 * (4000.0 * reflected).sqrt() * (1.0 + 1e-9), "{greatest}");
    assert_eq!(soft.events[1].what, ContactEvent::LiftsOff);
    assert!((soft.events[1].time - 0.4 - 0.5 * period).abs() < 1e-8, "{:?} {period}", soft.events);
}

/// Everything at once: inductance, losses and a rotor in space; a differential of a rigid drive and of an elastic one; limits.
fn driven_arm() -> Model<f64> {
    let mut model = arm();
    let losses = |forward, backward| Some(Efficiency { forward, backward, speed: None });
    let mut shoulder = drive("shoulder", MOTOR, &[(0, 40.0)]);
    shoulder.efficiency = losses(0.8, 0.7);
    shoulder.rotor = Some(Rotor { body: 0, axis: Vec3::new(0.6, 0.0, 0.8), inertia: ROTOR });
    let mut left = drive("left", Motor { inductance: None, ..MOTOR }, &[(1, 40.0), (2, 30.0)]);
    left.efficiency = losses(0.85, 0.85);
    left.input_limit = Some(20.0);
    let mut right = drive("right", MOTOR, &[(1, 1.1), (2, -0.9)]);
    right.stages = vec![Stage { inertia: 2e-5, efficiency: losses(0.9, 0.9), ..stage(40.0, 900.0, 2.0) }];
    right.shaft_inertia = Some(5e-3);
    model.drives = vec![shoulder, left, right];
    model
}

/// The arm falls with its tip on a plane 5 cm below, under voltages that swing.
fn lands(change: impl Fn(Touch) -> Touch, method: Method) -> ContactRun {
    let model = driven_arm();
    let q = [0.3, -0.4, 0.5];
    let tip = forward_kinematics(&model, &q, &[&model.frames[0]])[0].translation;
    let below = Vec3::new(tip.x, tip.y, tip.z - 0.05);
    let touch = wall(&model.frames[0], below, Vec3::unit_z(), Vec3::new(1.0, 0.0, 0.0));
    let times: Vec<f64> = (0..=20).map(|k| 0.05 * f64::from(k)).collect();
    let volts = |t: &f64| vec![6.0 * (5.0 * t).sin(), 3.0 * (7.0 * t).cos(), -5.0 * (3.0 * t).sin()];
    let samples = Samples { rows: times.iter().map(volts).collect(), times };
    let command = Command::Inputs(Inputs { samples, are_currents: vec![false; 3] }, None);
    run(model, change(touch), &command, (&q, &[0.0; 3]), 1.0, method)
}

#[test]
fn a_driven_arm_in_contact_keeps_its_books() {
    let spring = |stiffness, damping| SpringDamper { stiffness, damping };
    let rough = |mut touch: Touch| {
        touch.contact.friction = Some(Friction { coefficient: 0.3, speed: 0.01 });
        touch
    };
    let soft = |touch: Touch| Touch {
        environment: Some(Environment::Mass { mass: 0.7, support: spring(3e3, 20.0) }),
        ..touch
    };
    for (name, found) in [
        ("rigid and rough", lands(rough, Method::Adaptive)),
        ("a mass on a spring", lands(soft, Method::Adaptive)),
        ("a mass on a spring, implicit", lands(soft, Method::Stiff)),
    ] {
        let balance = &found.run.balance;
        println!("{name}: {:?}\n  {:.1e} of {:?}", found.events, balance.relative(), balance.drives);
        assert!(
            found.events.iter().any(|e| matches!(e.what, ContactEvent::Touches { .. })),
            "{name}: {:?}",
            found.events
        );
        // every effect took part
        let d = balance.drives;
        assert!([d.joule, d.friction, d.gears, d.dampers].iter().all(|x| *x > 1e-6), "{name}: {d:?}");
        // 1e-11 per step was asked for
        assert!(balance.relative() < 1e-9, "{name}: {balance:?}");
        assert!(found.drift < 1e-12, "{name}: {:.1e}", found.drift);
    }
}
