//! Contacts of a scene: what the robot touches, which coordinates are constrained there, and in which modes.

use crate::function::{ContactFunction, PerContact};
use crate::identifier::snake_case;
use std::fmt;
use std::rc::Rc;
use std::sync::Arc;
use straightline_core::algorithms::{Environment, SpringDamper};
use straightline_core::contact::{Contact, Coordinate, Friction, ImplicitSurface, Normal, Object, Surface};
use straightline_core::model::Frame;
use straightline_core::spatial::{Mat3, Sym3, Transform, Vec3};
use straightline_core::{Dd, Dual, Real};
use straightline_graph::trace::Expr;

/// All contacts of a scene. The default has none, and nothing of a contact is generated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneContacts {
    /// Contacts with objects.
    pub contacts: Vec<ContactItem>,
    /// Loops: frames of the robot that are held together, in every mode.
    pub loops: Vec<LoopItem>,
    /// Modes; none: one per contact, or one of the loops alone.
    pub modes: Vec<ModeItem>,
    /// Baumgarte's stabilisation: frequency \[rad/s\] and damping ratio.
    pub stabilisation: Option<(f64, f64)>,
    /// The functions that are generated for each mode; `None`: all but those that are made for who names them.
    pub functions: Option<Vec<ContactFunction>>,
}

/// A contact of a frame with an object.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactItem {
    /// What modes and messages call it.
    pub name: String,
    /// The frame of the robot.
    pub frame: String,
    /// The tool axis in the frame; `None`: an input.
    pub axis: Option<[f64; 3]>,
    /// Pose of the object in the world; `None`: an input, with velocity and acceleration.
    pub object: Option<ObjectPose>,
    /// Its surface.
    pub surface: SurfaceItem,
    /// s^c.
    pub constrained: Vec<Coordinate>,
    /// s^f.
    pub free: Vec<Coordinate>,
    /// Coulomb friction while it slides: μ, and the speed w \[m/s\] at which it has reached 71 %.
    pub friction: Option<(f64, f64)>,
    /// How the object gives way; `None`: it is rigid.
    pub environment: Option<EnvironmentItem>,
}

/// The pose of an object that does not move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectPose {
    /// Origin in the world \[m\].
    pub origin: [f64; 3],
    /// Direction of Z, the normal of a plane, towards the robot.
    pub z: [f64; 3],
    /// Direction of X, as far as it is perpendicular to Z.
    pub x: [f64; 3],
}

/// The form of a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum SurfaceItem {
    /// Z = 0.
    #[default]
    Plane,
    /// About the origin.
    Sphere {
        /// Radius \[m\].
        radius: f64,
        /// The robot is inside.
        hollow: bool,
    },
    /// About the X axis.
    Cylinder {
        /// Radius \[m\].
        radius: f64,
        /// The robot is inside.
        hollow: bool,
    },
    /// pᵀ A p + 2 b · p + c = 0.
    Quadric {
        /// A: xx, xy, xz, yy, yz, zz.
        matrix: [f64; 6],
        /// b.
        linear: [f64; 3],
        /// c.
        constant: f64,
    },
    /// A function made in code.
    Implicit(UserSurface),
}

/// A user's surface, as the compiler traces it.
#[derive(Clone)]
pub struct UserSurface {
    name: String,
    value: Arc<SurfaceOver<Expr>>,
    moving: Arc<SurfaceOver<Dual<Expr, 1>>>,
}

/// A surface over one scalar.
type SurfaceOver<T> = dyn Fn(Vec3<Normal<T>>) -> Normal<T> + Send + Sync;

impl UserSurface {
    /// From a function over any scalar. The name tells surfaces apart, in the hash of the output too.
    pub fn new(name: impl Into<String>, surface: impl ImplicitSurface + Send + Sync + 'static) -> Self {
        let surface = Arc::new(surface);
        let other = surface.clone();
        UserSurface {
            name: name.into(),
            value: Arc::new(move |p| surface.value(p)),
            moving: Arc::new(move |p| other.value(p)),
        }
    }

    /// What tells it from others.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl PartialEq for UserSurface {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl fmt::Debug for UserSurface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "UserSurface({:?})", self.name)
    }
}

impl SurfaceItem {
    /// The surface over expressions.
    pub fn traced(&self) -> Surface<Expr> {
        match self {
            SurfaceItem::Implicit(user) => {
                let value = user.value.clone();
                Surface::Implicit(Rc::new(move |p| value(p)))
            }
            other => other.over().expect("only a user's surface has a scalar of its own"),
        }
    }

    /// The same over expressions that move.
    pub fn traced_moving(&self) -> Surface<Dual<Expr, 1>> {
        match self {
            SurfaceItem::Implicit(user) => {
                let value = user.moving.clone();
                Surface::Implicit(Rc::new(move |p| value(p)))
            }
            other => other.over().expect("only a user's surface has a scalar of its own"),
        }
    }

    /// The surface over a scalar; `None` for a user's, which is a function over expressions.
    pub fn over<T: Real>(&self) -> Option<Surface<T>> {
        let c = |x: f64| T::constant(Dd::from(x));
        Some(match self {
            SurfaceItem::Plane => Surface::Plane,
            SurfaceItem::Sphere { radius, hollow } => Surface::Sphere { radius: c(*radius), hollow: *hollow },
            SurfaceItem::Cylinder { radius, hollow } => Surface::Cylinder { radius: c(*radius), hollow: *hollow },
            SurfaceItem::Quadric { matrix, linear, constant } => {
                let [xx, xy, xz, yy, yz, zz] = matrix.map(c);
                let linear = Vec3::from(linear.map(c));
                Surface::Quadric { matrix: Sym3 { xx, xy, xz, yy, yz, zz }, linear, constant: c(*constant) }
            }
            SurfaceItem::Implicit(_) => return None,
        })
    }
}

fn constant<T: Real>(v: Vec3<Dd>) -> Vec3<T> {
    v.map(T::constant)
}

fn unit(v: Vec3<Dd>) -> Vec3<Dd> {
    let length = v.dot(v).sqrt();
    v.map(|x| x / length)
}

impl ObjectPose {
    /// Columns X, Y, Z: X = x made perpendicular to Z and normalised, Y = Z × X.
    pub fn over<T: Real>(&self) -> Transform<T> {
        let (z, x) = (unit(Vec3::from(self.z.map(Dd::from))), Vec3::from(self.x.map(Dd::from)));
        let x = unit(x - z.scale(x.dot(z)));
        Transform {
            rotation: Mat3::from_columns(constant(x), constant(z.cross(x)), constant(z)),
            translation: constant(Vec3::from(self.origin.map(Dd::from))),
        }
    }
}

/// The tool axis, normalised, and across it the one of the frame's axes that is farthest from it, next in cyclic order of z.
pub fn tool_axes<T: Real>(axis: [f64; 3]) -> (Vec3<T>, Vec3<T>) {
    let a = unit(Vec3::from(axis.map(Dd::from)));
    let least = (0..3).min_by(|i, j| axis[*i].abs().total_cmp(&axis[*j].abs())).unwrap_or(0);
    let mut farthest = [Dd::ZERO; 3];
    farthest[least] = Dd::ONE;
    let farthest = Vec3::from(farthest);
    let b = unit(farthest - a.scale(farthest.dot(a)));
    (constant(a), constant(b))
}

impl EnvironmentItem {
    /// The model with these numbers, in the order of [`EnvironmentKind::keys`].
    pub fn over<T: Real>(&self, values: &[T]) -> Environment<T> {
        let at = |key: &str| {
            let k = self.kind.keys().iter().position(|k| *k == key);
            values[k.expect("a key of this kind")]
        };
        let spring = |prefix: &str| SpringDamper {
            stiffness: at(&format!("{prefix}stiffness")),
            damping: at(&format!("{prefix}damping")),
        };
        match self.kind {
            EnvironmentKind::Elastic => Environment::Elastic(spring("")),
            EnvironmentKind::Mass => Environment::Mass { mass: at("mass"), support: spring("") },
            EnvironmentKind::Cushioned => {
                Environment::Cushioned { mass: at("mass"), support: spring(""), front: spring("front_") }
            }
            EnvironmentKind::TwoMasses => Environment::TwoMasses {
                front_mass: at("front_mass"),
                front: spring("front_"),
                mass: at("mass"),
                support: spring(""),
            },
            EnvironmentKind::BothSides => Environment::BothSides { tool: spring("tool_"), surface: spring("") },
        }
    }
}

/// How an object gives way along the distance, by the letters of the chapter's Figure 20.15.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentItem {
    /// Which model.
    pub kind: EnvironmentKind,
    /// Its numbers in the order of [`EnvironmentKind::keys`]; `None`: an input.
    pub values: Option<Vec<f64>>,
}

/// A model of an object that gives way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvironmentKind {
    /// (b) Spring and damper without mass.
    Elastic,
    /// (c) A mass on them.
    Mass,
    /// (d) The same behind another spring and damper.
    Cushioned,
    /// (e) Two masses.
    TwoMasses,
    /// Tool and surface elastic, without mass.
    BothSides,
}

impl EnvironmentKind {
    /// All of them, with their words in scene files.
    pub const WORDS: [(&'static str, EnvironmentKind); 5] = [
        ("elastic", EnvironmentKind::Elastic),
        ("mass", EnvironmentKind::Mass),
        ("cushioned", EnvironmentKind::Cushioned),
        ("two_masses", EnvironmentKind::TwoMasses),
        ("both_sides", EnvironmentKind::BothSides),
    ];

    /// The keys of its numbers \[kg, N/m, N·s/m\].
    pub fn keys(self) -> &'static [&'static str] {
        match self {
            EnvironmentKind::Elastic => &["stiffness", "damping"],
            EnvironmentKind::Mass => &["mass", "stiffness", "damping"],
            EnvironmentKind::Cushioned => &["mass", "stiffness", "damping", "front_stiffness", "front_damping"],
            EnvironmentKind::TwoMasses => {
                &["mass", "stiffness", "damping", "front_stiffness", "front_damping", "front_mass"]
            }
            EnvironmentKind::BothSides => &["stiffness", "damping", "tool_stiffness", "tool_damping"],
        }
    }

    /// Those of them that must be positive, for a division by them.
    pub fn positive(self) -> &'static [&'static str] {
        match self {
            EnvironmentKind::Elastic | EnvironmentKind::Mass => &[],
            EnvironmentKind::Cushioned | EnvironmentKind::TwoMasses => &["mass"],
            EnvironmentKind::BothSides => &["tool_damping"],
        }
    }
}

/// Two frames of the robot that are held together.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopItem {
    /// What messages call it.
    pub name: String,
    /// A frame.
    pub frame: String,
    /// The frame that it is held to, whose axes count as the object's.
    pub with: String,
    /// Coordinates that are held.
    pub constrained: Vec<Coordinate>,
}

impl LoopItem {
    /// The loop over a scalar, of these two frames.
    pub fn over<T: Real>(&self, frame: Frame<T>, with: Frame<T>) -> Contact<T> {
        let (axis, second_axis) = tool_axes([0.0, 0.0, 1.0]);
        Contact {
            name: self.name.clone(),
            frame,
            axis,
            second_axis,
            object: Object::OnRobot(with),
            surface: Surface::Plane,
            constrained: self.constrained.clone(),
            free: vec![],
            friction: None,
        }
    }
}

/// Contacts that are closed together.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeItem {
    /// What the scene calls it; generated code has the identifier made of it.
    pub name: String,
    /// Names of the contacts.
    pub contacts: Vec<String>,
    /// Those of them that stick: their positions along X and Y are constrained as well, and friction is what holds them.
    pub sticking: Vec<String>,
}

impl SceneContacts {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty() && self.loops.is_empty() && self.modes.is_empty()
    }

    /// The modes, those that go without saying too.
    pub fn all_modes(&self) -> Vec<ModeItem> {
        if !self.modes.is_empty() {
            return self.modes.clone();
        }
        if self.contacts.is_empty() && !self.loops.is_empty() {
            return vec![ModeItem { name: "closed".to_string(), contacts: vec![], sticking: vec![] }];
        }
        let alone =
            |c: &ContactItem| ModeItem { name: c.name.clone(), contacts: vec![c.name.clone()], sticking: vec![] };
        self.contacts.iter().map(alone).collect()
    }

    /// The functions that somebody named.
    pub fn named(&self) -> impl Iterator<Item = ContactFunction> + '_ {
        self.functions.iter().flatten().copied()
    }

    /// The functions that are wanted, in order.
    pub fn wanted(&self) -> Vec<ContactFunction> {
        let is_wanted = |f: &ContactFunction| match &self.functions {
            Some(wanted) => wanted.contains(f),
            None => !f.spec().is_by_name,
        };
        ContactFunction::ALL.iter().copied().filter(is_wanted).collect()
    }
}

/// What stands behind a contact's name in the names of the inputs that are its own.
const PORTS: [&str; 5] = ["axes", "pose", "velocity", "acceleration", "environment"];

impl ContactItem {
    /// Its friction over a scalar.
    pub fn friction_over<T: Real>(&self) -> Option<Friction<T>> {
        let number = |x: f64| T::constant(Dd::from(x));
        self.friction.map(|(coefficient, speed)| Friction { coefficient: number(coefficient), speed: number(speed) })
    }

    /// Its name as the beginning of identifiers: those of [`ContactItem::port_names`].
    pub fn identifier(&self) -> String {
        snake_case(&self.name)
    }

    /// The names that inputs and results of its own have, as far as its modes have them.
    pub fn port_names(&self) -> impl Iterator<Item = String> {
        let name = self.identifier();
        let of_functions = ContactFunction::ports().filter(|port| port.per != PerContact::No).map({
            let name = name.clone();
            move |port| port.name_for(&name)
        });
        PORTS.iter().map(move |what| format!("{name}_{what}")).chain(of_functions)
    }
}
