//! Base parameters: what of a robot's inertial parameters, and of its joints', forces tell apart.
//!
//! Forces of a motion are linear in the ten inertial parameters of every body, but not every combination of them has an effect: mass on the axis of a
//! revolute joint belongs to the links on both of its sides. What is left is a least set of combinations, the *base parameters* (Gautier and Khalil 1990;
//! Mayeda, Yoshida and Osuka 1990). Each is written as a direction of one body's ten parameters: forces are the sum of base parameters times
//! what the robot would take if one body had a unit of that direction and all else were without mass.

use crate::dd::Dd;
use crate::model::{BodyId, Coulomb, JointEffects, Load, Model};
use crate::real::Real;
use crate::spatial::{Sym3, Transform, Vec3};
use alloc::vec::Vec;

/// Parameters of a rigid body: m, m c (3), Σ (6).
pub const PER_BODY: usize = 10;

/// The base parameters of a robot: those of its bodies in the order of the bodies, then those of its joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BaseParameterSets {
    /// What generalized forces tell apart.
    pub of_forces: Vec<BaseParameter>,
    /// What the wrench on the support tells apart, or that of a floating base.
    pub of_support: Vec<BaseParameter>,
    /// What of joints is among the parameters.
    pub joint_parameters: Vec<JointParameter>,
    /// Ten of every body whose inertia a scene makes an input: m, m c and I about the origin, and in the axes, of its frame. They are no base parameters: each of them
    /// stands for itself.
    pub of_scene: Vec<BaseParameter>,
}

impl BaseParameter {
    /// Its value, of the parameters of links and joints.
    pub fn value(&self, of: &[Dd]) -> Dd {
        self.terms.iter().fold(Dd::ZERO, |sum, (place, factor)| sum + *factor * of[*place])
    }
}

impl Model<Dd> {
    /// What base parameters are made of: ten numbers of the link behind every joint, in the order of the joints, then what joints add.
    pub fn link_parameters(&self) -> Vec<Dd> {
        let bodies: Vec<_> = self.bodies_in_order().into_iter().map(|b| &self.bodies[b]).collect();
        let of_links = bodies
            .iter()
            .flat_map(|body| body.total_about_origin().seen_from(&body.link_frame.inverse()).to_inertial_parameters());
        let single = || bodies.iter().filter(|body| body.joint.kind.is_single());
        let kinds = self.base_parameters.joint_parameters.iter();
        of_links.chain(kinds.flat_map(|kind| single().map(|body| kind.value(&body.effects)))).collect()
    }
}

/// A parameter that forces are linear in.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseParameter {
    /// The body that has it, or whose joint it belongs to.
    pub body: BodyId,
    /// What it is.
    pub kind: BaseParameterKind,
    /// The rows of the regressor in which it stands: velocity coordinates whose forces depend on it, in their order.
    pub rows: Vec<usize>,
    /// What it is made of: indices into the ten parameters (m, m c, I about the link's origin: xx, xy, xz, yy, yz, zz) of the link behind every joint, in
    /// the order of the joints and in the axes of the links, then into the joints' parameters, kind by kind; with factors.
    pub terms: Vec<(usize, Dd)>,
}

/// What a base parameter is.
#[derive(Clone, Debug, PartialEq)]
pub enum BaseParameterKind {
    /// One of a body's inertial parameters, with all that is grouped with it.
    Inertia {
        /// Which of m, m c_x, m c_y, m c_z, Σ_xx, Σ_xy, Σ_xz, Σ_yy, Σ_yz, Σ_zz in the frame of the reduced robot.
        entry: usize,
        /// A unit of it about the origin, and in the axes, of the body's canonical frame.
        unit: Load<Dd>,
    },
    /// What a joint adds on its own coordinate.
    Joint(JointParameter),
}

/// What a joint of one coordinate adds on it, as a parameter: a force in proportion to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum JointParameter {
    /// Inertia of the rotor \[kg·m² or kg\], times q̈.
    RotorInertia,
    /// Viscous friction \[N·m·s/rad or N·s/m\], times q̇.
    Damping,
    /// Coulomb friction \[N·m or N\], times sgn q̇ or its smooth form.
    Coulomb,
    /// A constant force \[N·m or N\].
    Offset,
    /// Stiffness of the spring \[N·m/rad or N/m\], times q − q₀.
    Stiffness,
}

impl JointParameter {
    /// All of them, with their words in scenes and symbols in names.
    pub const ALL: [(JointParameter, &'static str, &'static str); 5] = [
        (JointParameter::RotorInertia, "rotor_inertia", "J"),
        (JointParameter::Damping, "damping", "d"),
        (JointParameter::Coulomb, "coulomb", "f"),
        (JointParameter::Offset, "offset", "o"),
        (JointParameter::Stiffness, "stiffness", "k"),
    ];

    /// All of them.
    pub const EVERY: [JointParameter; 5] = {
        let [a, b, c, d, e] = JointParameter::ALL;
        [a.0, b.0, c.0, d.0, e.0]
    };

    /// Its word in scenes.
    pub fn word(self) -> &'static str {
        JointParameter::ALL.iter().find(|row| row.0 == self).map_or("", |row| row.1)
    }

    /// Its symbol in names of base parameters.
    pub fn symbol(self) -> &'static str {
        JointParameter::ALL.iter().find(|row| row.0 == self).map_or("", |row| row.2)
    }

    /// The force of a unit of it, at this motion of the joint.
    pub fn force<T: Real>(self, effects: &JointEffects<T>, [q, qd, qdd]: [T; 3]) -> T {
        match self {
            JointParameter::RotorInertia => qdd,
            JointParameter::Damping => qd,
            JointParameter::Coulomb => match effects.coulomb {
                // under the root a sum of squares with w > 0
                Coulomb::Smooth { speed, .. } => qd / (qd * qd + speed * speed).sqrt(),
                Coulomb::Off | Coulomb::Sign(_) => qd.sign(),
            },
            JointParameter::Offset => T::one(),
            JointParameter::Stiffness => q - effects.spring_rest,
        }
    }

    /// Its energy per unit, twice; `None` of forces that take or give work for good.
    pub fn twice_energy<T: Real>(self, effects: &JointEffects<T>, [q, qd]: [T; 2]) -> Option<T> {
        match self {
            JointParameter::RotorInertia => Some(qd * qd),
            JointParameter::Damping | JointParameter::Coulomb => None,
            JointParameter::Offset => Some(q + q),
            JointParameter::Stiffness => {
                let stretch = q - effects.spring_rest;
                Some(stretch * stretch)
            }
        }
    }

    /// Its value.
    pub fn value(self, effects: &JointEffects<Dd>) -> Dd {
        match self {
            JointParameter::RotorInertia => effects.rotor_inertia.unwrap_or(Dd::ZERO),
            JointParameter::Damping => effects.damping,
            JointParameter::Coulomb => match effects.coulomb {
                Coulomb::Off => Dd::ZERO,
                Coulomb::Sign(force) | Coulomb::Smooth { force, .. } => force,
            },
            JointParameter::Offset => Dd::ZERO,
            JointParameter::Stiffness => effects.stiffness,
        }
    }
}

impl<T: Real> JointEffects<T> {
    /// The same without what belongs to this parameter.
    #[must_use]
    pub fn without(self, parameter: JointParameter) -> Self {
        match parameter {
            JointParameter::RotorInertia => JointEffects { rotor_inertia: None, ..self },
            JointParameter::Damping => JointEffects { damping: T::zero(), ..self },
            JointParameter::Coulomb => JointEffects { coulomb: Coulomb::Off, ..self },
            // no file has one
            JointParameter::Offset => self,
            JointParameter::Stiffness => JointEffects { stiffness: T::zero(), ..self },
        }
    }
}

impl<T: Real> Load<T> {
    /// m, m c, Σ (xx, xy, xz, yy, yz, zz).
    pub fn to_array(self) -> [T; PER_BODY] {
        let (c, s) = (self.first_moment, self.second_moment);
        [self.mass, c.x, c.y, c.z, s.xx, s.xy, s.xz, s.yy, s.yz, s.zz]
    }

    /// From these.
    pub fn from_array(x: [T; PER_BODY]) -> Self {
        Load {
            mass: x[0],
            first_moment: Vec3::new(x[1], x[2], x[3]),
            second_moment: Sym3 { xx: x[4], xy: x[5], xz: x[6], yy: x[7], yz: x[8], zz: x[9] },
        }
    }

    /// m, m c, I about the origin (xx, xy, xz, yy, yz, zz).
    pub fn to_inertial_parameters(self) -> [T; PER_BODY] {
        Load { second_moment: self.second_moment.second_moment_to_inertia(), ..self }.to_array()
    }

    /// From these.
    pub fn from_inertial_parameters(x: [T; PER_BODY]) -> Self {
        let load = Load::from_array(x);
        Load { second_moment: load.second_moment.inertia_to_second_moment(), ..load }
    }

    /// The same about another origin in other axes, of a frame in which this one's has the pose `pose`.
    #[must_use]
    pub fn seen_from(&self, pose: &Transform<T>) -> Self {
        let (m, p) = (self.mass, pose.translation);
        let f = pose.rotation * self.first_moment;
        let s = self.second_moment.rotated(&pose.rotation);
        // Σ' = R Σ Rᵀ + p (R m c)ᵀ + (R m c) pᵀ + m p pᵀ
        let second_moment = Sym3 {
            xx: s.xx + (p.x * f.x + p.x * f.x) + m * p.x * p.x,
            xy: s.xy + (p.x * f.y + p.y * f.x) + m * p.x * p.y,
            xz: s.xz + (p.x * f.z + p.z * f.x) + m * p.x * p.z,
            yy: s.yy + (p.y * f.y + p.y * f.y) + m * p.y * p.y,
            yz: s.yz + (p.y * f.z + p.z * f.y) + m * p.y * p.z,
            zz: s.zz + (p.z * f.z + p.z * f.z) + m * p.z * p.z,
        };
        Load { mass: m, first_moment: f + p.scale(m), second_moment }
    }

    /// One of them is one, the others zero.
    pub fn unit(entry: usize) -> Self {
        Load::from_array(core::array::from_fn(|k| if k == entry { T::one() } else { T::zero() }))
    }
}
