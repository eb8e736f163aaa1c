//! Robots for the tests: asymmetric, of all kinds of joints.

use straightline_core::coupling::Coupling;
use straightline_core::joint::FLOATING_BASE;
use straightline_core::model::{Body, Frame, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};

/// A body of 2 kg whose joint is placed so in its parent; `indices` are the first ones of its coordinates and of its velocities.
pub fn body(
    name: &str,
    parent: Option<usize>,
    kind: JointKind,
    indices: (usize, usize),
    placement: Transform<f64>,
) -> Body<f64> {
    let limits = Limits { lower: -1.2, upper: 2.1, velocity: 3.0, effort: 40.0 };
    let limits = if kind.is_single() { limits } else { Limits::default() };
    Body {
        name: name.into(),
        parent,
        joint: Joint { name: format!("to_{name}"), kind, iq: indices.0, iv: indices.1, limits },
        placement,
        inertia: SpatialInertia::new(
            2.0,
            Vec3::new(0.18, 0.05, -0.02),
            Sym3 { xx: 0.004, xy: 0.0012, xz: -0.001, yy: 0.016, yz: 0.0013, zz: 0.0145 },
        ),
        link_frame: Transform::identity(),
        dense: false,
        effects: JointEffects::none(),
        load: None,
    }
}

pub fn at(rotation: Mat3<f64>, x: f64, y: f64, z: f64) -> Transform<f64> {
    Transform { rotation, translation: Vec3::new(x, y, z) }
}

/// Turns y of the parent into z of the joint.
pub fn across() -> Mat3<f64> {
    Mat3 { rows: [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]] }
}

pub fn robot(name: &str, bodies: Vec<Body<f64>>, frames: Vec<Frame<f64>>) -> Model<f64> {
    Model {
        name: name.into(),
        bodies,
        couplings: vec![],
        closure: Default::default(),
        gravity: Vec3::new(0.0, 0.0, -9.81),
        frames,
        drives: vec![],
        base_parameters: Default::default(),
    }
}

/// Turns about a column, turns about a shoulder, slides along the upper arm, and a wrist that turns freely; a finger follows the shoulder.
pub fn arm() -> Model<f64> {
    let mut bodies = vec![
        body("column", None, JointKind::Revolute, (0, 0), at(Mat3::identity(), 0.0, 0.1, 0.3)),
        body("upper", Some(0), JointKind::Revolute, (1, 1), at(across(), 0.05, 0.0, 0.2)),
        body("slide", Some(1), JointKind::Prismatic, (2, 2), at(across(), 0.4, 0.02, 0.0)),
        body("hand", Some(2), JointKind::Spherical, (3, 3), at(across(), 0.1, 0.0, 0.15)),
        body("finger", Some(3), JointKind::Revolute, (7, 6), at(Mat3::identity(), 0.12, 0.03, 0.0)),
    ];
    (bodies[2].joint.limits.lower, bodies[2].joint.limits.upper) = (-0.1, 0.17);
    let tip = Frame { name: "tip".into(), body: Some(4), placement: at(across(), 0.1, 0.0, 0.02) };
    let mut arm = robot("arm", bodies, vec![tip]);
    arm.couplings = vec![Coupling { body: 4, source: 1, ratio: -0.5, offset: 0.2 }];
    arm
}

/// A trunk that floats, with two legs; some names are attacks on a page.
pub fn hostile() -> Model<f64> {
    let names = ["</script><img src=x onerror=alert(1)>", "<!--<script>", "leg \u{202e}& \"two\" '\u{2028}"];
    let bodies = vec![
        body(names[0], None, FLOATING_BASE, (0, 0), Transform::identity()),
        body(names[1], Some(0), JointKind::Revolute, (7, 6), at(across(), 0.3, 0.15, 0.0)),
        body(names[2], Some(0), JointKind::Revolute, (8, 7), at(across(), -0.3, -0.12, 0.05)),
    ];
    let frame =
        Frame { name: "</SCRIPT ><b>foot</b>".into(), body: Some(1), placement: at(Mat3::identity(), 0.0, 0.0, 0.3) };
    robot("</title><img src=x onerror=alert(2)>", bodies, vec![frame])
}
