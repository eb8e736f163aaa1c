//! Contacts: which coordinates of a frame of the robot against an object are constrained, and by what.
//!
//! The handbook chapter's functional coordinates, (20.83)-(20.87): six numbers that say where a frame of the robot is against
//! an object's frame, some of which a contact constrains. Lengths are in m; a coordinate of an axis is a cosine.

use crate::dd::Dd;
use crate::jet::Jet;
use crate::model::Frame;
use crate::real::Real;
use crate::spatial::{MotionVector, Sym3, Transform, Vec3};
use alloc::rc::Rc;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// One of the six functional coordinates of a frame against an object with axes X, Y, Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Coordinate {
    /// Position of the frame's origin along X \[m\].
    Px,
    /// Position along Y \[m\].
    Py,
    /// Position along Z, or on a curved surface the distance from it \[m\].
    Pz,
    /// Tool axis · X; on a curved surface · X without its part along the normal.
    Ax,
    /// Tool axis · Y; on a curved surface · Y without its part along the normal.
    Ay,
    /// Second axis of the tool · Y: the turn about Z.
    Az,
}

impl Coordinate {
    /// All six, in order.
    pub const ALL: [Coordinate; 6] =
        [Coordinate::Px, Coordinate::Py, Coordinate::Pz, Coordinate::Ax, Coordinate::Ay, Coordinate::Az];

    /// Its name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Coordinate::Px => "px",
            Coordinate::Py => "py",
            Coordinate::Pz => "pz",
            Coordinate::Ax => "ax",
            Coordinate::Ay => "ay",
            Coordinate::Az => "az",
        }
    }
}

/// Variables of a functional coordinate: position, tool axis, second axis of the tool, in object axes.
pub type Functional<T> = Jet<T, 9>;
/// A functional coordinate with derivatives by the position once more, for normals.
pub type Normal<T> = Jet<Functional<T>, 3>;

/// A user's surface φ(p) = 0 over any scalar; φ > 0 on the robot's side, ∇φ ≠ 0 where contacts happen.
pub trait ImplicitSurface {
    /// φ at a point in object axes \[m\]; any unit, as φ is divided by |∇φ|.
    fn value<T: Real>(&self, point: Vec3<T>) -> T;
}

/// The form of the object's surface, in the object's frame.
#[derive(Clone)]
pub enum Surface<T> {
    /// The plane Z = 0, the robot above.
    Plane,
    /// |p| = r about the origin; no normal at the centre.
    Sphere {
        /// r \[m\].
        radius: T,
        /// The robot is inside.
        hollow: bool,
    },
    /// √(y² + z²) = r about the object's X axis; no normal on the axis.
    Cylinder {
        /// r \[m\].
        radius: T,
        /// The robot is inside.
        hollow: bool,
    },
    /// φ = pᵀ A p + 2 b · p + c = 0, the robot where φ > 0.
    Quadric {
        /// A.
        matrix: Sym3<T>,
        /// b.
        linear: Vec3<T>,
        /// c.
        constant: T,
    },
    /// A user's function.
    Implicit(Rc<dyn Fn(Vec3<Normal<T>>) -> Normal<T>>),
}

impl<T: Real + 'static> Surface<T> {
    /// A user's surface.
    pub fn implicit(surface: impl ImplicitSurface + 'static) -> Self {
        Surface::Implicit(Rc::new(move |p| surface.value(p)))
    }
}

impl<T: fmt::Debug> fmt::Debug for Surface<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Surface::Plane => f.write_str("Plane"),
            Surface::Sphere { radius, hollow } => write!(f, "Sphere({radius:?}, {hollow})"),
            Surface::Cylinder { radius, hollow } => write!(f, "Cylinder({radius:?}, {hollow})"),
            Surface::Quadric { matrix, linear, constant } => write!(f, "Quadric({matrix:?}, {linear:?}, {constant:?})"),
            Surface::Implicit(_) => f.write_str("Implicit"),
        }
    }
}

/// How the object moves: by a law that the robot cannot change, or with a body of the robot.
#[derive(Clone, Debug)]
pub enum Object<T> {
    /// Not at all: its pose in the world.
    Fixed(Transform<T>),
    /// As given.
    Moving(ObjectMotion<T>),
    /// It is a frame of the robot: a loop.
    OnRobot(Frame<T>),
}

/// Pose, velocity and acceleration of an object in the world, vectors in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectMotion<T> {
    /// Pose; columns of the rotation are X, Y, Z.
    pub pose: Transform<T>,
    /// Of the origin \[m/s\], and angular \[rad/s\].
    pub velocity: MotionVector<T>,
    /// Of the origin \[m/s²\], and angular \[rad/s²\].
    pub acceleration: MotionVector<T>,
}

/// Coulomb friction of a contact that slides: a force μ F against v / √(v² + w²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction<T> {
    /// μ.
    pub coefficient: T,
    /// w \[m/s\], positive: at this speed friction has reached 1/√2 of μ F.
    pub speed: T,
}

/// A contact of a frame of the robot with an object.
#[derive(Clone, Debug)]
pub struct Contact<T> {
    /// What generated modules and inputs are called by.
    pub name: String,
    /// The frame on the robot: its origin touches.
    pub frame: Frame<T>,
    /// Tool axis, a unit vector in the frame.
    pub axis: Vec3<T>,
    /// Second axis, a unit vector in the frame, perpendicular to the tool axis.
    pub second_axis: Vec3<T>,
    /// What it touches.
    pub object: Object<T>,
    /// The surface there.
    pub surface: Surface<T>,
    /// s^c.
    pub constrained: Vec<Coordinate>,
    /// s^f: of the others, those that are wanted.
    pub free: Vec<Coordinate>,
    /// Friction while it slides; against motion along X and Y of the object.
    pub friction: Option<Friction<T>>,
}

impl<T: Real> Surface<T> {
    /// Signed distance of a point \[m\], to first order: φ / |∇φ|, which on the surface has the derivatives of the distance.
    /// With the unit normal.
    pub(crate) fn distance_and_normal(&self, p: Vec3<Functional<T>>) -> (Functional<T>, Vec3<Functional<T>>) {
        let c = |x: T| Functional::still(x);
        let (zero, one) = (c(T::zero()), c(T::one()));
        let round = |v: Vec3<Functional<T>>, radius: T, hollow: bool| {
            let length = v.dot(v).sqrt();
            let (distance, normal) = (length - c(radius), v.scale(one / length));
            match hollow {
                true => (-distance, -normal),
                false => (distance, normal),
            }
        };
        match self {
            Surface::Plane => (p.z, Vec3::new(zero, zero, one)),
            Surface::Sphere { radius, hollow } => round(p, *radius, *hollow),
            Surface::Cylinder { radius, hollow } => round(Vec3::new(zero, p.y, p.z), *radius, *hollow),
            Surface::Quadric { matrix, linear, constant } => {
                let (a, b) = (matrix.map(c), linear.map(c));
                let half_gradient = a * p + b;
                let value = p.dot(half_gradient + b) + c(*constant);
                first_order(value, half_gradient.scale(c(T::constant(Dd::from(2.0)))))
            }
            Surface::Implicit(surface) => {
                let variable = |k: usize, x: Functional<T>| Normal::variable(k, x, zero, zero);
                let value = surface(Vec3::new(variable(0, p.x), variable(1, p.y), variable(2, p.z)));
                first_order(value.value, Vec3::from(value.gradient))
            }
        }
    }
}

impl<T: Real> Surface<T> {
    /// Unit normal at a point \[m\] in object axes, towards the robot.
    pub fn normal(&self, point: Vec3<T>) -> Vec3<T> {
        self.distance_and_normal(point.map(Functional::still)).1.map(|n| n.value)
    }
}

/// φ / |∇φ| and ∇φ / |∇φ|.
fn first_order<T: Real>(value: Functional<T>, gradient: Vec3<Functional<T>>) -> (Functional<T>, Vec3<Functional<T>>) {
    let inverse = Functional::still(T::one()) / gradient.dot(gradient).sqrt();
    (value * inverse, gradient.scale(inverse))
}

impl<T: Real> Contact<T> {
    /// The same contact over another scalar: every number through `f`.
    ///
    /// # Panics
    /// For a user's surface, which is a function over one scalar.
    pub fn map<U: Real>(&self, mut f: impl FnMut(T) -> U) -> Contact<U> {
        let motion = |m: &MotionVector<T>, f: &mut dyn FnMut(T) -> U| MotionVector {
            angular: m.angular.map(&mut *f),
            linear: m.linear.map(&mut *f),
        };
        let frame = |x: &Frame<T>, f: &mut dyn FnMut(T) -> U| Frame {
            name: x.name.clone(),
            body: x.body,
            placement: x.placement.map(&mut *f),
        };
        let f = &mut f;
        Contact {
            name: self.name.clone(),
            frame: frame(&self.frame, f),
            axis: self.axis.map(&mut *f),
            second_axis: self.second_axis.map(&mut *f),
            object: match &self.object {
                Object::Fixed(pose) => Object::Fixed(pose.map(&mut *f)),
                Object::Moving(m) => Object::Moving(ObjectMotion {
                    pose: m.pose.map(&mut *f),
                    velocity: motion(&m.velocity, f),
                    acceleration: motion(&m.acceleration, f),
                }),
                Object::OnRobot(x) => Object::OnRobot(frame(x, f)),
            },
            surface: match &self.surface {
                Surface::Plane => Surface::Plane,
                Surface::Sphere { radius, hollow } => Surface::Sphere { radius: f(*radius), hollow: *hollow },
                Surface::Cylinder { radius, hollow } => Surface::Cylinder { radius: f(*radius), hollow: *hollow },
                Surface::Quadric { matrix, linear, constant } => Surface::Quadric {
                    matrix: matrix.map(&mut *f),
                    linear: linear.map(&mut *f),
                    constant: f(*constant),
                },
                Surface::Implicit(_) => unreachable!("a user's surface is given over the scalar that it is wanted in"),
            },
            constrained: self.constrained.clone(),
            free: self.free.clone(),
            friction: self.friction.map(|x| Friction { coefficient: f(x.coefficient), speed: f(x.speed) }),
        }
    }
}
