//! Functional coordinates of a contact, their Jacobian and their adjoint vector: (20.83)-(20.87).
//!
//! Everything about the motion of the robot's frame against the object is put into six rows first, along and about the
//! object's axes X, Y, Z: ṗ, ω of the frame against the object as J q̇, and their rates for q̈ = 0, with the object's own
//! motion where it has one (s = s(q, t)). The coordinates are then functions of position and axes in the object's frame, and
//! a [`Jet`](crate::jet::Jet) differentiates them: no differences, no second formula for the adjoint vector.
//!
//! [`relative_motion`] works on the [`Model`], in world axes. [`reduced_relative_motion`] works along the path of one
//! contact in a [`ReducedModel`], where inverse dynamics has the accelerations already.

use super::jacobian::{jacobian, jacobian_bias};
use super::kinematics::{forward_kinematics, frame_velocity};
use super::reduced_dynamics::carried_motion;
use crate::contact::{Contact, Coordinate, Functional, Object, ObjectMotion};
use crate::model::{BodyId, Frame, Model};
use crate::real::Real;
use crate::reduced::ReducedModel;
use crate::spatial::{Mat3, MotionVector, Transform, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// A frame against an object, all in the object's axes.
#[derive(Clone, Debug)]
pub struct RelativeMotion<T> {
    /// Rotation from the frame to the object: its columns are the frame's axes.
    pub rotation: Mat3<T>,
    /// Position of the frame's origin \[m\].
    pub position: Vec3<T>,
    /// ṗ \[m/s\].
    pub velocity: Vec3<T>,
    /// p̈ for q̈ = 0 \[m/s²\].
    pub acceleration: Vec3<T>,
    /// ω of the frame against the object \[rad/s\].
    pub angular_velocity: Vec3<T>,
    /// Rate of its components for q̈ = 0 \[rad/s²\].
    pub angular_acceleration: Vec3<T>,
    /// Six rows of nv: ∂ṗ/∂q̇, then ∂ω/∂q̇.
    pub jacobian: [Vec<T>; 6],
}

/// Constrained or free coordinates of one contact or of several: s, ṡ, and s̈ = J q̈ + A.
#[derive(Clone, Debug, PartialEq)]
pub struct FunctionalCoordinates<T> {
    /// s \[m, or cosine\].
    pub value: Vec<T>,
    /// ṡ \[m/s or 1/s\]; where the object moves J q̇ and its part.
    pub rate: Vec<T>,
    /// J: a row of nv per coordinate.
    pub jacobian: Vec<Vec<T>>,
    /// A \[m/s² or 1/s²\]: s̈ for q̈ = 0.
    #[doc(alias = "adjoint vector")]
    pub bias: Vec<T>,
}

impl<T> Default for FunctionalCoordinates<T> {
    fn default() -> Self {
        FunctionalCoordinates { value: Vec::new(), rate: Vec::new(), jacobian: Vec::new(), bias: Vec::new() }
    }
}

impl<T> FunctionalCoordinates<T> {
    /// How many they are.
    pub fn len(&self) -> usize {
        self.value.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.value.is_empty()
    }

    /// With those of another contact after them.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.value.extend(other.value);
        self.rate.extend(other.rate);
        self.jacobian.extend(other.jacobian);
        self.bias.extend(other.bias);
        self
    }
}

/// Those of the six coordinates of a contact that are named, from the motion of its frame.   (20.83)-(20.86)
pub fn functional_coordinates<T: Real>(
    contact: &Contact<T>,
    motion: &RelativeMotion<T>,
    coordinates: &[Coordinate],
) -> FunctionalCoordinates<T> {
    T::section("functional coordinates", None);
    let place = PlaceOnSurface::new(contact, motion);
    let mut found = FunctionalCoordinates::default();
    for coordinate in coordinates {
        let s = place.coordinate(*coordinate);
        let nv = motion.jacobian[0].len();
        let entry = |i: usize| {
            let terms = s.weights.iter().zip(&motion.jacobian).map(|(w, row)| *w * row[i]);
            terms.fold(T::zero(), |sum, x| sum + x)
        };
        found.value.push(s.value);
        found.rate.push(s.rate);
        found.jacobian.push((0..nv).map(entry).collect());
        found.bias.push(s.second);
    }
    found
}

/// One functional coordinate, before the robot's own come in.
pub(super) struct WeighedCoordinate<T> {
    /// s.
    pub value: T,
    /// ṡ.
    pub rate: T,
    /// s̈ at the accelerations of the motion.
    pub second: T,
    /// ∂ṡ/∂(ṗ, ω): ṡ is this times ṗ and ω.
    pub weights: [T; 6],
}

/// Where the frame of a contact is on its surface: what all of its coordinates have in common.
pub(super) struct PlaceOnSurface<T> {
    p: Vec3<Functional<T>>,
    a: Vec3<Functional<T>>,
    b: Vec3<Functional<T>>,
    /// The two axes alone.
    axes: [Vec3<T>; 2],
    distance: Functional<T>,
    normal: Vec3<Functional<T>>,
}

impl<T: Real> PlaceOnSurface<T> {
    pub fn new(contact: &Contact<T>, motion: &RelativeMotion<T>) -> Self {
        let variables = |k: usize, x: Vec3<T>, rate: Vec3<T>, second: Vec3<T>| {
            Vec3::new(
                Functional::variable(k, x.x, rate.x, second.x),
                Functional::variable(k + 1, x.y, rate.y, second.y),
                Functional::variable(k + 2, x.z, rate.z, second.z),
            )
        };
        // an axis u of the frame: u̇ = ω × u,  ü = ε × u + ω × u̇
        let (omega, epsilon) = (motion.angular_velocity, motion.angular_acceleration);
        let axis = |k: usize, u: Vec3<T>| {
            let u = motion.rotation * u;
            let rate = omega.cross(u);
            (variables(k, u, rate, epsilon.cross(u) + omega.cross(rate)), u)
        };
        let p = variables(0, motion.position, motion.velocity, motion.acceleration);
        let (a, a_value) = axis(3, contact.axis);
        let (b, b_value) = axis(6, contact.second_axis);
        let (distance, normal) = contact.surface.distance_and_normal(p);
        PlaceOnSurface { p, a, b, axes: [a_value, b_value], distance, normal }
    }

    pub fn coordinate(&self, coordinate: Coordinate) -> WeighedCoordinate<T> {
        let PlaceOnSurface { p, a, b, axes: [a_value, b_value], distance, normal } = self;
        let tangential = |x: Functional<T>, n: Functional<T>| x - a.dot(*normal) * n;
        let s = match coordinate {
            Coordinate::Px => p.x,
            Coordinate::Py => p.y,
            Coordinate::Pz => *distance,
            Coordinate::Ax => tangential(a.x, normal.x),
            Coordinate::Ay => tangential(a.y, normal.y),
            Coordinate::Az => b.y,
        };
        let part = |k: usize| Vec3::new(s.gradient[k], s.gradient[k + 1], s.gradient[k + 2]);
        // δu = δφ × u: ∂s/∂u · δu = (u × ∂s/∂u) · δφ
        let (along, about) = (part(0), a_value.cross(part(3)) + b_value.cross(part(6)));
        let ([x, y, z], [u, v, w]) = (along.to_array(), about.to_array());
        WeighedCoordinate { value: s.value, rate: s.rate, second: s.second, weights: [x, y, z, u, v, w] }
    }
}

/// s^c of a contact on the generic runtime.   (20.86)
pub fn constrained_coordinates<T: Real>(
    model: &Model<T>,
    contact: &Contact<T>,
    q: &[T],
    qd: &[T],
) -> FunctionalCoordinates<T> {
    functional_coordinates(contact, &relative_motion(model, contact, q, qd), &contact.constrained)
}

/// What a frame of the robot, or an object, does in the world.
pub(super) struct InWorld<T> {
    pub pose: Transform<T>,
    pub velocity: MotionVector<T>,
    /// For q̈ = 0, or at the accelerations that are meant.
    pub acceleration: MotionVector<T>,
    /// 6 rows of nv, linear first; none for what the robot does not move, or where it is not asked for.
    pub jacobian: Option<Vec<T>>,
}

fn frame_in_world<T: Real>(model: &Model<T>, frame: &Frame<T>, q: &[T], qd: &[T]) -> InWorld<T> {
    InWorld {
        pose: forward_kinematics(model, q, &[frame])[0],
        velocity: frame_velocity(model, q, qd, frame),
        acceleration: jacobian_bias(model, q, qd, frame),
        jacobian: Some(jacobian(model, q, frame)),
    }
}

/// The motion of a contact's frame against its object.
pub fn relative_motion<T: Real>(model: &Model<T>, contact: &Contact<T>, q: &[T], qd: &[T]) -> RelativeMotion<T> {
    let robot = frame_in_world(model, &contact.frame, q, qd);
    let object = match &contact.object {
        Object::Fixed(pose) => Err(*pose),
        Object::Moving(ObjectMotion { pose, velocity, acceleration }) => {
            Ok(InWorld { pose: *pose, velocity: *velocity, acceleration: *acceleration, jacobian: None })
        }
        Object::OnRobot(frame) => Ok(frame_in_world(model, frame, q, qd)),
    };
    between(&robot, &object)
}

/// The motion of a frame against an object, which may be at rest in a pose.
pub(super) fn between<T: Real>(robot: &InWorld<T>, object: &Result<InWorld<T>, Transform<T>>) -> RelativeMotion<T> {
    let robot_rows = robot.jacobian.as_deref().unwrap_or(&[]);
    let nv = robot_rows.len() / 6;
    let pose = object.as_ref().map_or_else(|fixed| *fixed, |moving| moving.pose);
    let lever = robot.pose.translation - pose.translation;
    let mut difference = MotionVector { angular: robot.velocity.angular, linear: robot.velocity.linear };
    let mut acceleration = MotionVector { angular: robot.acceleration.angular, linear: robot.acceleration.linear };
    let in_object = |v: Vec3<T>| pose.rotation.transpose_mul(v);
    let mut spin = None;
    if let Ok(object) = object {
        let (w, e) = (object.velocity.angular, object.acceleration.angular);
        // v − v_o − ω_o × d,  ω − ω_o
        difference.linear = difference.linear - object.velocity.linear - w.cross(lever);
        difference.angular = difference.angular - w;
        // a − a_o − ε_o × d − ω_o × (ω_o × d),  ε − ε_o
        let carried = e.cross(lever) + w.cross(w.cross(lever));
        acceleration.linear = acceleration.linear - object.acceleration.linear - carried;
        acceleration.angular = acceleration.angular - e;
        spin = Some(in_object(w));
    }
    let (velocity, angular_velocity) = (in_object(difference.linear), in_object(difference.angular));
    let (mut linear, mut angular) = (in_object(acceleration.linear), in_object(acceleration.angular));
    if let Some(w) = spin {
        // the axes turn: (Rᵀ u)˙ = Rᵀ u̇ − (Rᵀ ω_o) × Rᵀ u, twice for the position
        let coriolis = w.cross(velocity);
        linear = linear - (coriolis + coriolis);
        angular = angular - w.cross(angular_velocity);
    }
    let column =
        |rows: &[T], i: usize, k: usize| Vec3::new(rows[k * nv + i], rows[(k + 1) * nv + i], rows[(k + 2) * nv + i]);
    let mut jacobian = [(); 6].map(|()| vec![T::zero(); nv]);
    for i in 0..nv {
        let (mut v, mut w) = (column(robot_rows, i, 0), column(robot_rows, i, 3));
        if let Ok(InWorld { jacobian: Some(rows), .. }) = object {
            let w_object = column(rows, i, 3);
            v = v - column(rows, i, 0) - w_object.cross(lever);
            w = w - w_object;
        }
        let both = in_object(v).to_array().into_iter().chain(in_object(w).to_array());
        both.zip(&mut jacobian).for_each(|(x, row)| row[i] = x);
    }
    RelativeMotion {
        rotation: pose.rotation.transpose() * robot.pose.rotation,
        position: in_object(lever),
        velocity,
        acceleration: linear,
        angular_velocity,
        angular_acceleration: angular,
        jacobian,
    }
}

/// The same from a reduced robot, for an object that no body carries; `None` for others. `placement`: the contact's frame in
/// the frame of its body `body` there, in metres.
pub fn reduced_relative_motion<T: Real>(
    model: &ReducedModel<T>,
    contact: &Contact<T>,
    (body, placement): (BodyId, Transform<T>),
    q: &[T],
    qd: &[T],
) -> Option<RelativeMotion<T>> {
    let moving = match &contact.object {
        Object::Fixed(pose) => ObjectMotion { pose: *pose, velocity: zero(), acceleration: zero() },
        Object::Moving(motion) => *motion,
        Object::OnRobot(_) => return None,
    };
    let carried = carried_motion(model, q, qd, body, placement);
    // X, Y, Z in the axes of each body on the path: they make rows, and at the tip components
    let axes = [0, 1, 2].map(|k| moving.pose.rotation.column(k));
    let [x, y, z] = axes.map(|axis| carried.row(axis));
    let components = |v: Vec3<T>| Vec3::new(x.at_tip.dot(v), y.at_tip.dot(v), z.at_tip.dot(v));
    let in_object = |v: Vec3<T>| moving.pose.rotation.transpose_mul(v);
    let [a, b, c] = [0, 1, 2].map(|k| components(carried.axes.column(k)));
    let (w, e) = (in_object(moving.velocity.angular), in_object(moving.acceleration.angular));
    let position = in_object(carried.position - moving.pose.translation);
    let speed = |row: &[T]| row.iter().zip(qd).fold(T::zero(), |sum, (j, qd)| sum + *j * *qd);
    let robot_v = Vec3::new(speed(&x.linear), speed(&y.linear), speed(&z.linear));
    let velocity = robot_v - in_object(moving.velocity.linear) - w.cross(position);
    let angular_velocity = components(carried.omega) - w;
    let coriolis = w.cross(velocity);
    let object_a = in_object(moving.acceleration.linear) + e.cross(position) + w.cross(w.cross(position));
    let robot_a = Vec3::new(x.acceleration, y.acceleration, z.acceleration);
    Some(RelativeMotion {
        rotation: Mat3::from_columns(a, b, c),
        position,
        velocity,
        acceleration: robot_a - object_a - (coriolis + coriolis),
        angular_velocity,
        angular_acceleration: components(carried.alpha) - e - w.cross(angular_velocity),
        jacobian: [x.linear, y.linear, z.linear, x.angular, y.angular, z.angular],
    })
}

fn zero<T: Real>() -> MotionVector<T> {
    MotionVector { angular: Vec3::zero(), linear: Vec3::zero() }
}
