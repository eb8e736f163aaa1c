//! Dynamic environment: what the object does where the robot touches it, (20.92)-(20.94) and Figure 20.15.
//!
//! Each model is a mass that moves with the contact, if any, and a load: F = −(m s̈ + load). s is measured from where the
//! object is at rest, negative in contact; F is positive where the object is pressed, and the contact lifts off when F
//! changes sign. Corrected: (20.92) printed H q̈ − h.

use super::constraint::Support;
use crate::real::Real;

/// A spring with a damper beside it: k x + b ẋ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringDamper<T> {
    /// k \[N/m\].
    pub stiffness: T,
    /// b \[N·s/m\].
    pub damping: T,
}

impl<T: Real> SpringDamper<T> {
    fn force(&self, x: T, rate: T) -> T {
        self.stiffness * x + self.damping * rate
    }
}

/// The object at a contact, by the letters of Figure 20.15.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Environment<T> {
    /// (b) An elastic surface without mass.
    Elastic(SpringDamper<T>),
    /// (c) A mass on a spring and a damper; also an object on an elastic support.
    Mass {
        /// m_e \[kg\].
        mass: T,
        /// Between mass and ground.
        support: SpringDamper<T>,
    },
    /// (d) The same with a spring and a damper in front, which may as well be the tool's: two deformations, no impact.
    Cushioned {
        /// m_e \[kg\], positive.
        mass: T,
        /// Between mass and ground.
        support: SpringDamper<T>,
        /// Between contact and mass.
        front: SpringDamper<T>,
    },
    /// (e) Two masses.
    TwoMasses {
        /// At the contact \[kg\].
        front_mass: T,
        /// Between the masses.
        front: SpringDamper<T>,
        /// Behind \[kg\], positive.
        mass: T,
        /// Between the mass behind and ground.
        support: SpringDamper<T>,
    },
    /// Tool and surface both elastic, without mass. The sum of the dampings is positive.
    BothSides {
        /// Of the robot's side.
        tool: SpringDamper<T>,
        /// Of the object's side.
        surface: SpringDamper<T>,
    },
}

/// How the object's own coordinate moves: the mass behind in (d) and (e), the object's surface in `BothSides`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentMotion<T> {
    /// Its velocity \[m/s\].
    pub velocity: T,
    /// Its acceleration \[m/s²\]; in `BothSides`, which has none, zero.
    pub acceleration: T,
}

impl<T: Real> Environment<T> {
    /// What the contact stands on at s, ṡ \[m, m/s\] and the object's own coordinate e, ė (read where there is one).
    pub fn support(&self, (s, sd): (T, T), (e, ed): (T, T)) -> Support<T> {
        match self {
            Environment::Elastic(surface) => Support::Yielding { mass: T::zero(), load: surface.force(s, sd) },
            // m_e s̈ = −F − k s − b ṡ                                                                          (20.94)
            Environment::Mass { mass, support } => Support::Yielding { mass: *mass, load: support.force(s, sd) },
            Environment::Cushioned { front, .. } => {
                Support::Yielding { mass: T::zero(), load: front.force(s - e, sd - ed) }
            }
            Environment::TwoMasses { front_mass, front, .. } => {
                Support::Yielding { mass: *front_mass, load: front.force(s - e, sd - ed) }
            }
            Environment::BothSides { tool, .. } => {
                let ed = self.motion((s, sd), (e, ed)).velocity;
                Support::Yielding { mass: T::zero(), load: tool.force(s - e, sd - ed) }
            }
        }
    }

    /// The motion of the object's own coordinate; of (b) and (c), which have none but the contact's, zero.
    pub fn motion(&self, (s, sd): (T, T), (e, ed): (T, T)) -> EnvironmentMotion<T> {
        match self {
            Environment::Elastic(_) | Environment::Mass { .. } => {
                EnvironmentMotion { velocity: T::zero(), acceleration: T::zero() }
            }
            Environment::Cushioned { mass, support, front } | Environment::TwoMasses { front, mass, support, .. } => {
                // m ë = k₁ (s − e) + b₁ (ṡ − ė) − k₂ e − b₂ ė
                let acceleration = (front.force(s - e, sd - ed) - support.force(e, ed)) / *mass;
                EnvironmentMotion { velocity: ed, acceleration }
            }
            Environment::BothSides { tool, surface } => {
                // one force through both: k_t (s − e) + b_t (ṡ − ė) = k_s e + b_s ė
                let left = tool.force(s - e, sd) - surface.stiffness * e;
                EnvironmentMotion { velocity: left / (tool.damping + surface.damping), acceleration: T::zero() }
            }
        }
    }

    /// Whether the object has a coordinate of its own besides the contact's.
    pub fn has_own_coordinate(&self) -> bool {
        !matches!(self, Environment::Elastic(_) | Environment::Mass { .. })
    }

    /// The mass that an impact strikes \[kg\]; zero where none makes the contact stiff.
    pub fn struck_mass(&self) -> T {
        match self {
            Environment::Mass { mass, .. } | Environment::TwoMasses { front_mass: mass, .. } => *mass,
            _ => T::zero(),
        }
    }
}
