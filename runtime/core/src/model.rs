//! The robot as the algorithms see it: a constant tree of rigid bodies in canonical joint frames.
//!
//! **Canonical joint frame.** The frame of body j sits in its joint j: origin on the joint axis, z along it. It is fixed
//! to the body, and at q = 0 it coincides with the joint frame that is fixed to the parent. So every revolute joint turns
//! about its own z, every linear joint slides along it, and what a link frame of the robot file looks like is left to
//! [`Body::link_frame`]. A floating base keeps the root link's own frame.

use crate::base_parameters::BaseParameterSets;
use crate::closure::Closure;
use crate::coupling::Coupling;
use crate::dd::Dd;
use crate::drive::Drive;
pub use crate::joint::JointKind;
use crate::operators::operators;
use crate::real::Real;
use crate::spatial::{SpatialInertia, Sym3, Transform, Vec3};
use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

/// Index of a body in [`Model::bodies`].
pub type BodyId = usize;

/// Range of a joint's coordinate and what its drive can do; infinite where the file says nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Least q \[rad or m\].
    pub lower: f64,
    /// Greatest q \[rad or m\].
    pub upper: f64,
    /// Greatest |q̇| \[rad/s or m/s\].
    pub velocity: f64,
    /// Greatest |τ| \[N·m or N\].
    pub effort: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { lower: f64::NEG_INFINITY, upper: f64::INFINITY, velocity: f64::INFINITY, effort: f64::INFINITY }
    }
}

/// A joint and its place in the coordinate vectors.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The robot file's name of the joint.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// First index into q.
    pub iq: usize,
    /// First index into qd, qdd and tau.
    pub iv: usize,
    /// Ranges of q, q̇ and τ.
    pub limits: Limits,
}

impl Joint {
    /// Its part of q.
    pub fn coordinates<'a, T>(&self, q: &'a [T]) -> &'a [T] {
        &q[self.iq..self.iq + self.kind.nq()]
    }

    /// Its part of qd, qdd or tau.
    pub fn rates<'a, T>(&self, rates: &'a [T]) -> &'a [T] {
        &rates[self.iv..self.iv + self.kind.nv()]
    }

    /// Names of its entries of q (`order` 0), of q̇ and q̈ (1) or of τ (2): its own where it has one coordinate, else `base.x`, `base.y`, ….
    pub fn entry_names(&self, order: usize) -> Vec<String> {
        match self.kind.is_single() {
            true => vec![self.name.clone()],
            false => self.kind.row().entries[order].iter().map(|entry| format!("{}.{entry}", self.name)).collect(),
        }
    }
}

/// What a joint adds to the rigid bodies, on its own coordinate. One of several coordinates has neither dry friction nor a spring; inertia and damping are
/// the same on each of its rates, so that they know no direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointEffects<T> {
    /// Inertia of what turns with the joint and not with the links: rotor inertia times gear ratio squared
    /// \[kg·m² or kg\]; `None` where there is none, which is a cheaper form of the equations.
    #[doc(alias = "armature")]
    pub rotor_inertia: Option<T>,
    /// Viscous friction d, with force d q̇ \[N·m·s/rad or N·s/m\].
    pub damping: T,
    /// Coulomb friction.
    pub coulomb: Coulomb<T>,
    /// Spring stiffness k, with force k (q − q₀) \[N·m/rad or N/m\].
    pub stiffness: T,
    /// Coordinate q₀ at which the spring exerts no force \[rad or m\].
    pub spring_rest: T,
}

/// Coulomb friction of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coulomb<T> {
    /// None.
    Off,
    /// f sgn(q̇) \[N·m or N\]; zero at q̇ = 0.
    Sign(T),
    /// f q̇ / √(q̇² + w²), for equations that must be smooth.
    Smooth {
        /// f \[N·m or N\].
        force: T,
        /// w \[rad/s or m/s\], positive: at this speed friction has reached 1/√2 of f.
        speed: T,
    },
}

impl<T: Real> JointEffects<T> {
    /// A joint that adds nothing.
    pub fn none() -> Self {
        let o = T::zero();
        JointEffects { rotor_inertia: None, damping: o, coulomb: Coulomb::Off, stiffness: o, spring_rest: o }
    }

    /// Every number through `f`.
    pub fn map<U>(&self, mut f: impl FnMut(T) -> U) -> JointEffects<U> {
        JointEffects {
            rotor_inertia: self.rotor_inertia.map(&mut f),
            damping: f(self.damping),
            coulomb: match self.coulomb {
                Coulomb::Off => Coulomb::Off,
                Coulomb::Sign(x) => Coulomb::Sign(f(x)),
                Coulomb::Smooth { force, speed } => Coulomb::Smooth { force: f(force), speed: f(speed) },
            },
            stiffness: f(self.stiffness),
            spring_rest: f(self.spring_rest),
        }
    }
}

/// Inertia by its ten linear parameters about the origin of the canonical frame: what a body carries besides its own, such
/// as a payload known at run time only. Forces are linear in it, which they are not in a centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load<T> {
    /// m \[kg\].
    pub mass: T,
    /// m c \[kg·m\].
    pub first_moment: Vec3<T>,
    /// Σ = ∫ r rᵀ dm about the origin \[kg·m²\].
    pub second_moment: Sym3<T>,
}

impl<T: Real> Load<T> {
    /// Every number through `f`.
    pub fn map<U>(&self, mut f: impl FnMut(T) -> U) -> Load<U> {
        Load {
            mass: f(self.mass),
            first_moment: self.first_moment.map(&mut f),
            second_moment: self.second_moment.map(f),
        }
    }
}

operators! { [T: Real] Load<T>:
    Add add |a, other| Load {
        mass: a.mass + other.mass,
        first_moment: a.first_moment + other.first_moment,
        second_moment: a.second_moment + other.second_moment,
    };
    Sub sub |a, other| Load {
        mass: a.mass - other.mass,
        first_moment: a.first_moment - other.first_moment,
        second_moment: a.second_moment - other.second_moment,
    };
}

/// A moving body with the joint that carries it. Links that are fixed to it are merged in.
#[derive(Clone, Debug, PartialEq)]
pub struct Body<T> {
    /// The robot file's name of the link that the joint moves.
    pub name: String,
    /// The body it moves against; `None`: the world.
    pub parent: Option<BodyId>,
    /// What carries it.
    pub joint: Joint,
    /// Pose of the joint frame (q = 0) in the parent's canonical frame, or in the world.
    pub placement: Transform<T>,
    /// Inertia in the canonical frame.
    pub inertia: SpatialInertia<T>,
    /// Pose of the link's own frame, as the robot file has it, in the canonical frame.
    pub link_frame: Transform<T>,
    /// The rotation of the placement has few zeros, so that it pays to multiply it out with the joint's. A property of
    /// the robot, not of the scalar, so that numbers and equations take the same form: set it to
    /// [`composing_pays`](crate::algorithms::composing_pays)`(parent, &placement.rotation)`.
    pub dense: bool,
    /// What the joint adds on its own coordinate.
    pub effects: JointEffects<T>,
    /// What the body carries besides its own inertia.
    pub load: Option<Load<T>>,
}

impl<T: Real> Body<T> {
    /// The ten linear parameters of all that the body is and carries, about the origin of the canonical frame.
    pub fn total_about_origin(&self) -> Load<T> {
        let i = &self.inertia;
        let own = Load { mass: i.mass, first_moment: i.first_moment, second_moment: i.second_moment };
        self.load.map_or(own, |load| own + load)
    }

    /// Lets the body carry this, too.
    pub fn carry(&mut self, more: Load<T>) {
        self.load = Some(self.load.map_or(more, |load| load + more));
    }
}

impl Body<f64> {
    /// Whether nothing drives its joint and a spring holds it: joints of flexible links and of elastic supports.
    pub fn is_passive(&self) -> bool {
        self.joint.limits.effort == 0.0 && self.effects.stiffness > 0.0
    }
}

/// A named frame that outputs may be asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame<T> {
    /// What functions of frames are asked for it by.
    pub name: String,
    /// The body that carries it; `None`: the world.
    pub body: Option<BodyId>,
    /// Its pose in the body's canonical frame, or in the world.
    pub placement: Transform<T>,
}

impl<T: Real> Frame<T> {
    /// Its numbers through `f`.
    pub fn map<U: Real>(&self, f: impl FnMut(T) -> U) -> Frame<U> {
        Frame { name: self.name.clone(), body: self.body, placement: self.placement.map(f) }
    }
}

/// A robot: bodies in topological order (parents first), gravity, named frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Model<T> {
    /// The robot's name.
    pub name: String,
    /// The moving bodies; a parent stands before its children.
    pub bodies: Vec<Body<T>>,
    /// Joints whose coordinates follow those of others.
    pub couplings: Vec<Coupling<T>>,
    /// What closes its loops.
    pub closure: Closure<T>,
    /// Acceleration due to gravity in the world \[m/s²\].
    pub gravity: Vec3<T>,
    /// All frames of the robot: one per link of the file, and what was added.
    pub frames: Vec<Frame<T>>,
    /// What drives the joints, in the order of the inputs u.
    pub drives: Vec<Drive<T>>,
    /// The parameters that columns of regressors belong to; empty where nobody looked for them.
    pub base_parameters: BaseParameterSets,
}

impl<T: Real> Model<T> {
    /// Number of configuration coordinates; joints that follow others have none.
    pub fn nq(&self) -> usize {
        self.tree_nq() - self.couplings.len()
    }

    /// Number of velocity coordinates; joints that follow others or from loops have none.
    pub fn nv(&self) -> usize {
        let dependent: usize = self.closure.dependents().map(|b| self.bodies[b].joint.kind.nv()).sum();
        self.tree_nv() - self.couplings.len() - dependent
    }

    /// dq/dt at these velocities: q̇ itself of most joints, of a floating base R v and ½ q ∘ ω.
    pub fn configuration_rate(&self, q: &[T], qd: &[T]) -> Vec<T> {
        let mut rates = vec![T::zero(); q.len()];
        let qd = self.open_rates(&self.tree_positions(q), qd);
        for joint in self.free_joints() {
            let own = &mut rates[joint.iq..joint.iq + joint.kind.nq()];
            joint.kind.configuration_rate(joint.coordinates(q), joint.rates(&qd), own);
        }
        rates
    }

    /// The joints that have coordinates in q, in the order of these: those that loops determine last.
    pub fn joints(&self) -> Vec<&Joint> {
        let mut joints: Vec<&Joint> = self.free_joints().collect();
        joints.sort_by_key(|joint| joint.iv);
        joints
    }

    /// Coordinates q at which joints do nothing, or the nearest within their ranges; of a robot with loops those in which these were closed.
    pub fn neutral(&self) -> Vec<T> {
        if !self.closure.is_empty() {
            return self.closure.home.clone();
        }
        let mut q = vec![T::zero(); self.nq()];
        for joint in self.free_joints() {
            for (q, neutral) in q[joint.iq..].iter_mut().zip(joint.kind.row().neutral) {
                *q = T::constant(neutral.max(joint.limits.lower).min(joint.limits.upper).into());
            }
        }
        q
    }

    /// Whether its base floats.
    pub fn floats(&self) -> bool {
        self.bodies.iter().any(|b| b.joint.kind.is_base())
    }

    /// The frame of that name.
    pub fn frame(&self, name: &str) -> Option<&Frame<T>> {
        self.frames.iter().find(|f| f.name == name)
    }

    /// The same robot over another scalar: every number through `f`.
    pub fn map<U: Real>(&self, mut f: impl FnMut(T) -> U) -> Model<U> {
        Model {
            name: self.name.clone(),
            bodies: self
                .bodies
                .iter()
                .map(|b| Body {
                    name: b.name.clone(),
                    parent: b.parent,
                    joint: b.joint.clone(),
                    placement: b.placement.map(&mut f),
                    inertia: b.inertia.map(&mut f),
                    link_frame: b.link_frame.map(&mut f),
                    dense: b.dense,
                    effects: b.effects.map(&mut f),
                    load: b.load.map(|l| l.map(&mut f)),
                })
                .collect(),
            couplings: self.couplings.iter().map(|c| c.map(&mut f)).collect(),
            closure: self.closure.map(&mut f),
            gravity: self.gravity.map(&mut f),
            frames: self.frames.iter().map(|x| x.map(&mut f)).collect(),
            drives: self.drives.iter().map(|d| d.map(&mut f)).collect(),
            base_parameters: self.base_parameters.clone(),
        }
    }
}

impl Model<Dd> {
    /// The same robot with every number rounded once to another scalar.
    pub fn cast<U: Real>(&self) -> Model<U> {
        self.map(U::constant)
    }
}
