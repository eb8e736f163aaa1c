#![allow(dead_code)] // each test takes what it needs
//! Robots for the tests: asymmetric, with effects in every joint; motors, and planes to touch.

use straightline_core::contact::{Contact, Coordinate, Object, Surface};
use straightline_core::drive::{Actuator, Drive, Motor, Rating};
use straightline_core::model::{Body, Coulomb, Frame, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_simulation::contact::{Contacts, Touch};

pub fn body(name: &str, parent: Option<usize>, kind: JointKind, i: usize, placement: Transform<f64>) -> Body<f64> {
    Body {
        name: name.into(),
        parent,
        joint: Joint { name: format!("to_{name}"), kind, iq: i, iv: i, limits: Limits::default() },
        placement,
        inertia: SpatialInertia::new(
            2.0,
            Vec3::new(0.3, 0.05, -0.02),
            Sym3 { xx: 0.02, xy: 0.002, xz: -0.001, yy: 0.05, yz: 0.003, zz: 0.045 },
        ),
        link_frame: Transform::identity(),
        dense: false,
        effects: JointEffects::none(),
        load: None,
    }
}

pub fn at(rotation: Mat3<f64>, x: f64) -> Transform<f64> {
    Transform { rotation, translation: Vec3::new(x, 0.0, 0.0) }
}

/// 2 kg on a slide along x of the world.
pub fn cart() -> Model<f64> {
    let along_x = Mat3 { rows: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
    let bodies = vec![body("cart", None, JointKind::Prismatic, 0, at(along_x, 0.0))];
    Model {
        name: "cart".into(),
        bodies,
        gravity: Vec3::new(0.0, 0.0, -9.81),
        couplings: vec![],
        closure: Default::default(),
        frames: vec![],
        drives: vec![],
        base_parameters: Default::default(),
    }
}

/// Three joints about skew axes, with rotors, friction and springs.
pub fn arm() -> Model<f64> {
    let across = Mat3 { rows: [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]] };
    let mut bodies = vec![
        body("column", None, JointKind::Revolute, 0, at(Mat3::identity(), 0.0)),
        body("upper", Some(0), JointKind::Revolute, 1, at(across, 0.1)),
        body("fore", Some(1), JointKind::Revolute, 2, at(Mat3::identity(), 0.5)),
    ];
    for (i, body) in bodies.iter_mut().enumerate() {
        body.effects = JointEffects {
            rotor_inertia: Some(0.1 + 0.05 * i as f64),
            damping: 0.2,
            coulomb: Coulomb::Smooth { force: 0.3, speed: 0.05 },
            stiffness: if i == 1 { 4.0 } else { 0.0 },
            spring_rest: 0.2,
        };
    }
    let tip = Frame { name: "tip".into(), body: Some(2), placement: at(Mat3::identity(), 0.4) };
    Model {
        name: "arm".into(),
        bodies,
        gravity: Vec3::new(0.0, 0.0, -9.81),
        couplings: vec![],
        closure: Default::default(),
        frames: vec![tip],
        drives: vec![],
        base_parameters: Default::default(),
    }
}

/// A motor that drives these joints by these ratios, without anything else.
pub fn drive(name: &str, motor: Motor<f64>, joints: &[(usize, f64)]) -> Drive<f64> {
    Drive {
        name: name.into(),
        actuator: Actuator::Motor(motor),
        stages: vec![],
        shaft_inertia: None,
        efficiency: None,
        joints: joints.to_vec(),
        shares: None,
        input_limit: None,
        current_limit: None,
        soft_current: None,
        rotor: None,
        rating: Rating::none(),
    }
}

/// A contact of a frame with the plane z = 0 of `object`, rigid and without friction, open at the beginning.
pub fn plane(name: &str, frame: &Frame<f64>, object: Transform<f64>) -> Touch {
    Touch {
        contact: Contact {
            name: name.into(),
            frame: frame.clone(),
            axis: Vec3::unit_z(),
            second_axis: Vec3::new(1.0, 0.0, 0.0),
            object: Object::Fixed(object),
            surface: Surface::Plane,
            constrained: vec![Coordinate::Pz],
            free: vec![],
            friction: None,
        },
        environment: None,
        law: None,
        restitution: 0.0,
        closed: false,
        stays: false,
    }
}

/// That contact alone.
pub fn one(touch: Touch) -> Contacts {
    Contacts { touches: vec![touch], loops: vec![], stabilisation: None, projects: true, rest_speed: 1e-3 }
}
