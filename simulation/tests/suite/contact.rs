//! Simulated contacts against closed forms: when phases change, what impacts and dampers turn into heat, what objects do after
//! they are let go.

use crate::common::{one, plane};
use std::f64::consts::PI;
use straightline_core::algorithms::{Environment, SpringDamper};
use straightline_core::contact::{Contact, Coordinate, Friction, Object, Surface};
use straightline_core::model::{Body, Frame, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_simulation::command::{Command, Samples};
use straightline_simulation::contact::{simulate, ContactEvent, ContactRun, Contacts, Law, Touch};
use straightline_simulation::plant::Plant;
use straightline_simulation::simulate::{Method, Settings};
use Coordinate::Pz;

const G: f64 = 9.81;
const MASS: f64 = 2.0;

fn body(kind: JointKind, parent: Option<usize>, i: usize, placement: Transform<f64>, mass: f64) -> Body<f64> {
    Body {
        name: format!("body{i}"),
        parent,
        joint: Joint { name: format!("joint{i}"), kind, iq: i, iv: i, limits: Limits::default() },
        placement,
        inertia: SpatialInertia::new(mass, Vec3::zero(), Sym3::zero()),
        link_frame: Transform::identity(),
        dense: false,
        effects: JointEffects::none(),
        load: None,
    }
}

fn turned(x: Vec3<f64>, y: Vec3<f64>, z: Vec3<f64>) -> Transform<f64> {
    Transform { rotation: Mat3::from_columns(x, y, z), translation: Vec3::zero() }
}

/// A block of 2 kg that slides along x and z of the world.
fn block() -> Model<f64> {
    let (x, y, z) = (Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::unit_z());
    Model {
        name: "block".into(),
        bodies: vec![
            body(JointKind::Prismatic, None, 0, turned(-z, y, x), 0.0),
            body(JointKind::Prismatic, Some(0), 1, turned(z, y, -x), MASS),
        ],
        gravity: Vec3::new(0.0, 0.0, -G),
        couplings: vec![],
        closure: Default::default(),
        frames: vec![Frame { name: "sole".into(), body: Some(1), placement: Transform::identity() }],
        drives: vec![],
        base_parameters: Default::default(),
    }
}

/// A chain of two links of 1 m about y of the world, that hang at q = 0 and carry their masses at their ends.
fn pendulum(links: usize) -> Model<f64> {
    let (x, y, z) = (Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::unit_z());
    let mut bodies = Vec::new();
    for i in 0..links {
        let below = Transform { rotation: Mat3::identity(), translation: Vec3::new(1.0, 0.0, 0.0) };
        // x of the link downwards, z along y
        let placement = if i == 0 { turned(-z, -x, y) } else { below };
        let mut link = body(JointKind::Revolute, i.checked_sub(1), i, placement, MASS);
        link.inertia = SpatialInertia::new(MASS, Vec3::new(1.0, 0.0, 0.0), Sym3::zero());
        bodies.push(link);
    }
    let end = Transform { rotation: Mat3::identity(), translation: Vec3::new(1.0, 0.0, 0.0) };
    let frames = vec![Frame { name: "end".into(), body: Some(links - 1), placement: end }];
    Model {
        couplings: vec![],
        closure: Default::default(),
        name: "pendulum".into(),
        bodies,
        gravity: Vec3::new(0.0, 0.0, -G),
        frames,
        drives: vec![],
        base_parameters: Default::default(),
    }
}

fn floor(model: &Model<f64>) -> Touch {
    plane("floor", &model.frames[0], Transform::identity())
}

fn settings(duration: f64) -> Settings {
    Settings {
        duration,
        interval: 0.01,
        tolerance: 1e-11,
        method: Method::Adaptive,
        stops_at_limits: true,
        most_steps: 1_000_000,
    }
}

fn run(model: Model<f64>, contacts: &Contacts, command: &Command, start: (&[f64], &[f64]), t: f64) -> ContactRun {
    let plant = Plant::new(model, 1e-3);
    let run = simulate(&plant, contacts, command, start, &settings(t), &|_| ()).unwrap_or_else(|why| panic!("{why}"));
    // so much is missing after integration with an error of 1e-11 per step
    assert!(run.run.balance.relative() < 1e-9, "{:?}", run.run.balance);
    run
}

/// A force along x of the world, over time.
fn push(times: &[f64], forces: &[f64]) -> Command {
    let rows = forces.iter().map(|f| vec![*f, 0.0]).collect();
    Command::Torques(Samples { times: times.to_vec(), rows })
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance, "{what}: {found}, expected {expected}");
}

fn times(run: &ContactRun) -> Vec<(f64, &ContactEvent)> {
    run.events.iter().map(|e| (e.time, &e.what)).collect()
}

#[test]
fn a_block_that_falls_bounces_as_newton_says_and_comes_to_rest() {
    let model = block();
    let touch = Touch { restitution: 0.5, ..floor(&model) };
    let run = run(model, &one(touch), &Command::Free, (&[0.0, 1.0], &[0.3, 0.0]), 1.6);
    let fall = (2.0 / G).sqrt();
    let speed = G * fall;
    let mut expected = fall;
    let events = times(&run);
    for (bounce, (time, what)) in events.iter().enumerate().take(8) {
        let before = speed * 0.5f64.powi(bounce as i32);
        close(*time, expected, 1e-9, "time of the bounce");
        let ContactEvent::Bounces { impulse, lost } = what else { panic!("{what:?}") };
        close(*impulse, 1.5 * MASS * before, 1e-8, "impulse");
        close(*lost, 0.5 * MASS * before * before * 0.75, 1e-8, "lost energy");
        expected += before / G;
    }
    // with half of a thousandth of a metre per second it stays
    assert!(matches!(events.last(), Some((_, ContactEvent::Touches { .. }))) && events.len() == 13, "{events:?}");
    close(run.run.q[0], 0.3 * 1.6, 1e-9, "way along the floor");
    close(run.run.q[1], 0.0, 1e-12, "rest");
    let weight = run.run.table.column("F.floor.pz").unwrap();
    close(*weight.last().unwrap(), MASS * G, 1e-9, "weight");
    close(run.run.balance.losses, MASS * G, 1e-8, "all energy is heat in the end");
}

#[test]
fn an_elastic_floor_without_damper_throws_back_after_half_a_period() {
    let mut model = block();
    model.gravity = Vec3::zero();
    let (k, v) = (800.0, 0.6);
    let spring = SpringDamper { stiffness: k, damping: 0.0 };
    let touch = Touch { environment: Some(Environment::Elastic(spring)), ..floor(&model) };
    let run = run(model, &one(touch), &Command::Free, (&[0.0, 0.3], &[0.0, -v]), 1.2);
    let (touches, leaves) = (0.3 / v, 0.3 / v + PI * (MASS / k).sqrt());
    let found = times(&run);
    assert!(matches!(found[..], [(_, ContactEvent::Touches { .. }), (_, ContactEvent::LiftsOff)]), "{found:?}");
    close(found[0].0, touches, 1e-9, "contact");
    close(found[1].0, leaves, 1e-9, "lift-off");
    close(run.run.qd[1], v, 1e-8, "speed");
    let deepest = run.run.table.column("s.floor").unwrap().into_iter().fold(0.0, f64::min);
    let depth = v * (MASS / k).sqrt();
    // rows are 0.01 s apart, 0.2 of the phase: 1 − cos 0.1 at most
    assert!(deepest >= -depth * (1.0 + 1e-9) && deepest <= -depth * 0.1f64.cos(), "depth {deepest}, expected {depth}");
}

#[test]
fn a_mass_that_is_struck_moves_on_after_lift_off_and_is_met_where_it_then_is() {
    let mut model = block();
    model.gravity = Vec3::zero();
    let (me, k, v) = (0.5, 300.0, 1.0);
    let environment = Environment::Mass { mass: me, support: SpringDamper { stiffness: k, damping: 0.0 } };
    let touch = Touch { environment: Some(environment), ..floor(&model) };
    let run = run(model, &one(touch), &Command::Free, (&[0.0, 0.1], &[0.0, -v]), 0.6);
    let found = times(&run);
    // plastic: both go on with m v/(m + m_e), swing for half a period together, and part where the spring begins to pull
    let together = MASS * v / (MASS + me);
    let ContactEvent::Touches { impulse, lost } = *found[0].1 else { panic!("{found:?}") };
    close(impulse, me * together, 1e-9, "impulse");
    close(lost, 0.5 * MASS * v * v - 0.5 * (MASS + me) * together * together, 1e-9, "lost energy");
    close(found[1].0, 0.1 + PI * ((MASS + me) / k).sqrt(), 1e-9, "lift-off");
    assert!(matches!(found[1].1, ContactEvent::LiftsOff) && found.len() == 2, "{found:?}");
    close(run.run.qd[1], together, 1e-8, "speed after it");
    // the mass swings alone
    let (t, front) = (run.run.table.column("t").unwrap(), run.run.table.column("front.floor").unwrap());
    let w = (k / me).sqrt();
    let free: Vec<f64> = t.iter().zip(&front).filter(|(t, _)| **t > found[1].0).map(|(_, y)| *y).collect();
    let first = t.iter().find(|t| **t > found[1].0).unwrap() - found[1].0;
    for (i, y) in free.iter().enumerate() {
        close(*y, together / w * (w * (first + 0.01 * i as f64)).sin(), 1e-7, "swing");
    }
}

#[test]
fn every_environment_balances_through_contact_and_lift_off() {
    let spring = |stiffness, damping| SpringDamper { stiffness, damping };
    let environments = [
        Environment::Elastic(spring(4e3, 30.0)),
        Environment::Mass { mass: 1.7, support: spring(4e3, 30.0) },
        Environment::Cushioned { mass: 1.7, support: spring(4e3, 30.0), front: spring(9e3, 12.0) },
        Environment::TwoMasses { front_mass: 0.4, front: spring(9e3, 12.0), mass: 1.7, support: spring(4e3, 30.0) },
        Environment::BothSides { tool: spring(9e3, 12.0), surface: spring(4e3, 30.0) },
    ];
    for environment in environments {
        let model = block();
        let touch = Touch { environment: Some(environment), ..floor(&model) };
        let run = run(model, &one(touch), &Command::Free, (&[0.0, 0.2], &[0.0, 0.0]), 3.0);
        let ups = run.events.iter().filter(|e| e.what == ContactEvent::LiftsOff).count();
        let downs = run.events.iter().filter(|e| matches!(e.what, ContactEvent::Touches { .. })).count();
        assert!(ups >= 1 && downs == ups + 1, "{environment:?}: {:?}", run.events);
        // it has come to rest on the springs, and what is missing of its energy is heat
        let pressed = run.run.table.column("F.floor.pz").unwrap();
        close(*pressed.last().unwrap(), MASS * G, 1e-2 * MASS * G, "weight");
    }
}

/// A floor with friction μ = 0.3, full above 1e-4 m/s.
fn rough(model: &Model<f64>) -> Touch {
    let mut touch = floor(model);
    touch.contact.friction = Some(Friction { coefficient: 0.3, speed: 1e-4 });
    Touch { closed: true, ..touch }
}

#[test]
fn what_slides_sticks_when_it_has_stopped_and_slides_again_when_pushed_harder_than_friction() {
    let model = block();
    let contacts = one(rough(&model));
    // pushed with 20 N/s from one second on
    let command = push(&[0.0, 1.0, 2.0], &[0.0, 0.0, 20.0]);
    let run = run(model, &contacts, &command, (&[0.0, 0.0], &[0.8, 0.0]), 1.6);
    let stop = 0.8 / (0.3 * G);
    let slide = 1.0 + 0.3 * MASS * G / 20.0;
    let found = times(&run);
    assert!(matches!(found[..], [(_, ContactEvent::Sticks), (_, ContactEvent::Slides)]), "{found:?}");
    // the smooth law is weaker near rest: w/(μ g) times a small number
    close(found[0].0, stop, 1e-3, "stop");
    close(found[1].0, slide, 1e-6, "break-away");
    let way = 0.8 * 0.8 / (2.0 * 0.3 * G);
    let at = run.run.table.column("q.joint0").unwrap();
    close(at[100], way, 1e-5, "way");
    // x = c t³/(6 m) from there, as friction takes what was needed to break away
    // but begins more weakly, some w long
    let way = 20.0 / 6.0 / MASS * (1.6 - slide).powi(3);
    close(run.run.q[0] - at[100], way, 10.0 * 1e-4 * (1.6 - slide), "way after it");
}

#[test]
fn a_belt_carries_a_block_along_and_pays_for_it() {
    let model = block();
    let law = Law {
        pose: Transform::identity(),
        velocity: Vec3::new(0.5, 0.0, 0.0),
        spin: Vec3::zero(),
        amplitude: Vec3::zero(),
        frequency: 0.0,
    };
    let contacts = one(Touch { law: Some(law), ..rough(&model) });
    let run = run(model, &contacts, &Command::Free, (&[0.0, 0.0], &[0.0, 0.0]), 0.5);
    let found = times(&run);
    assert!(matches!(found[..], [(_, ContactEvent::Sticks)]), "{found:?}");
    close(found[0].0, 0.5 / (0.3 * G), 1e-3, "carried along");
    close(run.run.qd[0], 0.5, 1e-9, "speed of the belt");
    // half of the belt's work is heat
    close(run.run.balance.work, MASS * 0.25, 1e-4, "work");
    close(run.run.balance.losses, 0.5 * MASS * 0.25, 1e-4, "heat");
}

#[test]
fn a_shaking_table_throws_a_block_when_it_falls_faster_than_free() {
    let model = block();
    let (a, f) = (0.004, 10.0);
    let law = Law {
        pose: Transform::identity(),
        velocity: Vec3::zero(),
        spin: Vec3::zero(),
        amplitude: Vec3::new(0.0, 0.0, a),
        frequency: f,
    };
    let contacts = one(Touch { law: Some(law), closed: true, ..floor(&model) });
    let run = run(model, &contacts, &Command::Free, (&[0.0, 0.0], &[0.0, 0.0]), 0.06);
    let w = 2.0 * PI * f;
    let leaves = (G / (a * w * w)).asin() / w;
    close(run.events[0].time, leaves, 1e-9, "lift-off at −a ω² sin ω t = −g");
    assert_eq!(run.events[0].what, ContactEvent::LiftsOff);
}

#[test]
fn a_bead_in_a_hollow_sphere_is_a_pendulum() {
    // the block on the inside of a sphere of 1 m about (0, 0, 1), and a pendulum of 1 m
    let angle = 0.7f64;
    let model = block();
    let mut touch = Touch { closed: true, ..floor(&model) };
    touch.contact.surface = Surface::Sphere { radius: 1.0, hollow: true };
    touch.contact.object =
        Object::Fixed(Transform { rotation: Mat3::identity(), translation: Vec3::new(0.0, 0.0, 1.0) });
    let start = [angle.sin(), 1.0 - angle.cos()];
    let bead = run(model, &one(touch), &Command::Free, (&start, &[0.0, 0.0]), 10.0);
    assert!(bead.events.is_empty() && bead.drift < 1e-12, "{:?} {:.1e}", bead.events, bead.drift);
    // x = sin q down to the sign of the joint's axis
    let swing = run(pendulum(1), &Contacts::default(), &Command::Free, (&[angle], &[0.0]), 10.0);
    let (x, q) = (bead.run.table.column("q.joint0").unwrap(), swing.run.table.column("q.joint0").unwrap());
    for (x, q) in x.iter().zip(&q) {
        close(*x, q.sin(), 1e-7, "ten seconds of a pendulum");
    }
    assert!(bead.run.balance.missing().abs() < 1e-10 * MASS * G, "{:?}", bead.run.balance);
}

#[test]
fn two_walls_are_met_one_after_the_other() {
    let model = block();
    let wall = |name: &str, at: f64, z: Vec3<f64>, x: Vec3<f64>| {
        let mut touch = floor(&model);
        touch.contact.name = name.into();
        touch.contact.object = Object::Fixed(Transform {
            rotation: Mat3::from_columns(x, z.cross(x), z),
            translation: Vec3::new(at, 0.0, 0.0),
        });
        touch
    };
    let (x, z) = (Vec3::new(1.0, 0.0, 0.0), Vec3::unit_z());
    let contacts = Contacts { touches: vec![wall("floor", 0.0, z, x), wall("wall", 0.5, -x, z)], ..one(floor(&model)) };
    let command = push(&[0.0, 0.6, 0.7, 2.0], &[4.0, 4.0, -4.0, -4.0]);
    let run = run(block(), &contacts, &command, (&[0.0, 0.1], &[0.5, 0.0]), 1.0);
    let names: Vec<(&str, bool)> =
        run.events.iter().map(|e| (e.contact.as_str(), matches!(e.what, ContactEvent::Touches { .. }))).collect();
    assert_eq!(names, [("floor", true), ("wall", true), ("wall", false)], "{:?}", run.events);
    close(run.events[0].time, (0.2 / G).sqrt(), 1e-9, "floor");
    close(run.events[1].time, (-0.5 + (0.25f64 + 4.0 * 0.5).sqrt()) / 2.0, 1e-9, "wall: 0.5 t + t² = 0.5");
    close(run.events[2].time, 0.65, 1e-9, "the push turns round");
}

#[test]
fn a_loop_that_is_open_at_the_beginning_is_closed_or_refused() {
    let mut model = pendulum(2);
    // the end held on a rail along x, 1.2 m below
    model.frames.push(Frame {
        name: "rail".into(),
        body: None,
        placement: Transform { rotation: Mat3::identity(), translation: Vec3::new(0.0, 0.0, -1.2) },
    });
    let rail = Contact {
        name: "rail".into(),
        object: Object::OnRobot(model.frames[1].clone()),
        constrained: vec![Pz],
        ..floor(&model).contact
    };
    let contacts = Contacts { loops: vec![rail.clone()], touches: vec![], ..one(floor(&model)) };
    let run = run(model.clone(), &contacts, &Command::Free, (&[0.5, 0.6], &[0.0, 0.0]), 2.0);
    assert!(run.drift < 1e-12, "{:.1e}", run.drift);
    let far = Contact {
        object: Object::Fixed(Transform { translation: Vec3::new(0.0, 0.0, -5.0), ..Transform::identity() }),
        ..rail
    };
    let contacts = Contacts { loops: vec![far], ..contacts };
    let plant = Plant::new(model, 1e-3);
    let refused = simulate(&plant, &contacts, &Command::Free, (&[0.5, 0.6], &[0.0, 0.0]), &settings(1.0), &|_| ());
    assert!(refused.unwrap_err().why.contains("cannot be closed"));
}

#[test]
fn what_begins_inside_an_object_is_refused() {
    let model = block();
    let contacts = one(floor(&model));
    let plant = Plant::new(model, 1e-3);
    let refused = simulate(&plant, &contacts, &Command::Free, (&[0.0, -0.1], &[0.0; 2]), &settings(1.0), &|_| ());
    let why = refused.unwrap_err().why;
    assert!(why.contains("floor") && why.contains("1.000e-1 m inside"), "{why}");
}
