//! Objects that are touched: those that move as told, and those that give way, in contact and after it.
//!
//! In contact the models of Figure 20.15 are those of [`Environment`]. What has been let go moves on by itself: masses swing on
//! their springs, and a surface without mass returns as its spring and damper let it, k y + b ẏ = 0, or at once where b = 0.
//! The robot meets it again where it then is.

use straightline_core::algorithms::{Environment, SpringDamper};
use straightline_core::contact::ObjectMotion;
use straightline_core::spatial::{Mat3, MotionVector, Transform, Vec3};

/// How an object moves, whatever the robot does: p(t) = p₀ + v t + a sin(2π f t), turning with a constant ω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Pose at t = 0.
    pub pose: Transform<f64>,
    /// v \[m/s\] in the world.
    pub velocity: Vec3<f64>,
    /// ω \[rad/s\] in the world.
    pub spin: Vec3<f64>,
    /// a \[m\] in the world.
    pub amplitude: Vec3<f64>,
    /// f \[Hz\].
    pub frequency: f64,
}

impl Law {
    /// Pose, velocity and acceleration at a time \[s\].
    pub fn at(&self, t: f64) -> ObjectMotion<f64> {
        let circular = std::f64::consts::TAU * self.frequency;
        let (sin, cos) = (circular * t).sin_cos();
        let translation = self.pose.translation + self.velocity.scale(t) + self.amplitude.scale(sin);
        ObjectMotion {
            pose: Transform { rotation: turn(self.spin.scale(t)) * self.pose.rotation, translation },
            velocity: MotionVector { angular: self.spin, linear: self.velocity + self.amplitude.scale(circular * cos) },
            acceleration: MotionVector {
                angular: Vec3::zero(),
                linear: self.amplitude.scale(-circular * circular * sin),
            },
        }
    }
}

/// The rotation by a vector: its length is the angle \[rad\] (Rodrigues).
fn turn(by: Vec3<f64>) -> Mat3<f64> {
    let angle = by.dot(by).sqrt();
    if angle == 0.0 {
        return Mat3::identity();
    }
    let axis = by.scale(1.0 / angle);
    let (sin, cos) = angle.sin_cos();
    let column = |v: Vec3<f64>| v.scale(cos) + axis.cross(v).scale(sin) + axis.scale((1.0 - cos) * axis.dot(v));
    let unit = |k: usize| Vec3::from([0, 1, 2].map(|i| f64::from(u8::from(i == k))));
    Mat3::from_columns(column(unit(0)), column(unit(1)), column(unit(2)))
}

/// Coordinates of an object that gives way, along the contact's normal from where it rests: its front y with ẏ, read while
/// nothing touches it, and what lies behind it, e with ė. Of an object elastic on both sides y is how far the tool's side is pressed in.
pub(super) type Slots = [f64; 4];
/// Their number.
pub(super) const SLOTS: usize = 4;

/// Rate of a surface without mass, k y + b ẏ = 0; without a damper it is back at once.
fn relaxing(spring: SpringDamper<f64>, y: f64) -> (f64, f64) {
    match spring.damping > 0.0 {
        true => (y, -spring.stiffness / spring.damping * y),
        false => (0.0, 0.0),
    }
}

fn spring_force(spring: SpringDamper<f64>, x: f64, rate: f64) -> f64 {
    spring.stiffness * x + spring.damping * rate
}

/// Front and rate of an object that nothing touches: where the robot meets it.
pub(super) fn front(object: &Environment<f64>, [y, yd, e, ed]: Slots) -> (f64, f64) {
    match *object {
        Environment::Elastic(spring) => relaxing(spring, y),
        Environment::Mass { mass: 0.0, support } => relaxing(support, y),
        Environment::Cushioned { front, .. } | Environment::TwoMasses { front_mass: 0.0, front, .. } => {
            let (stretch, rate) = relaxing(front, y - e);
            (e + stretch, ed + rate)
        }
        Environment::Mass { .. } | Environment::TwoMasses { .. } => (y, yd),
        Environment::BothSides { tool, surface } => {
            let ((pressed, rate), (own, own_rate)) = (relaxing(tool, y), relaxing(surface, e));
            (own - pressed, own_rate - rate)
        }
    }
}

/// The rates of the coordinates of an object that nothing touches.
pub(super) fn released(object: &Environment<f64>, slots: Slots) -> Slots {
    let [y, yd, e, ed] = slots;
    match *object {
        Environment::Elastic(spring) => [relaxing(spring, y).1, 0.0, 0.0, 0.0],
        Environment::Mass { mass: 0.0, support } => [relaxing(support, y).1, 0.0, 0.0, 0.0],
        Environment::Mass { mass, support } => [yd, -spring_force(support, y, yd) / mass, 0.0, 0.0],
        Environment::Cushioned { mass, support, .. }
        | Environment::TwoMasses { front_mass: 0.0, mass, support, .. } => {
            // a front without mass bears no force
            [front(object, slots).1, 0.0, ed, -spring_force(support, e, ed) / mass]
        }
        Environment::TwoMasses { front_mass, front, mass, support } => {
            let between = spring_force(front, y - e, yd - ed);
            [yd, -between / front_mass, ed, (between - spring_force(support, e, ed)) / mass]
        }
        Environment::BothSides { tool, surface } => [relaxing(tool, y).1, 0.0, relaxing(surface, e).1, 0.0],
    }
}

/// The coordinates when the robot at s, ṡ lets go.
pub(super) fn let_go(object: &Environment<f64>, (s, sd): (f64, f64), [.., e, ed]: Slots) -> Slots {
    match object {
        Environment::BothSides { .. } => [e - s, 0.0, e, 0.0],
        _ => [s, sd, e, ed],
    }
}

/// Energy \[J\] of masses and springs, and power \[W\] that its dampers turn into heat; `touched`: s and ṡ of the contact.
pub(super) fn energy_and_heat(object: &Environment<f64>, touched: Option<(f64, f64)>, slots: Slots) -> (f64, f64) {
    let [y, _, e, ed] = slots;
    let (at, rate) = touched.unwrap_or_else(|| front(object, slots));
    let stored = |spring: SpringDamper<f64>, x: f64| 0.5 * spring.stiffness * x * x;
    let lost = |spring: SpringDamper<f64>, rate: f64| spring.damping * rate * rate;
    let moving = |mass: f64, v: f64| 0.5 * mass * v * v;
    match *object {
        Environment::Elastic(spring) => (stored(spring, at), lost(spring, rate)),
        Environment::Mass { mass, support } => (moving(mass, rate) + stored(support, at), lost(support, rate)),
        Environment::Cushioned { mass, support, front } => {
            (moving(mass, ed) + stored(support, e) + stored(front, at - e), lost(support, ed) + lost(front, rate - ed))
        }
        Environment::TwoMasses { front_mass, front, mass, support } => (
            moving(front_mass, rate) + moving(mass, ed) + stored(support, e) + stored(front, at - e),
            lost(support, ed) + lost(front, rate - ed),
        ),
        Environment::BothSides { tool, surface } => match touched {
            Some((s, sd)) => {
                let own = object.motion((s, sd), (e, ed)).velocity;
                (stored(tool, s - e) + stored(surface, e), lost(tool, sd - own) + lost(surface, own))
            }
            None => {
                let (pressed, own) = (relaxing(tool, y), relaxing(surface, e));
                (stored(tool, pressed.0) + stored(surface, own.0), lost(tool, pressed.1) + lost(surface, own.1))
            }
        },
    }
}
