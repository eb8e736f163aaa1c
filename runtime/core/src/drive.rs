//! What drives the joints: actuators, and the transmissions between them and the joints (handbook chapter, section 20.3
//! and 20.5.4).
//!
//! **Chain of a drive.** The actuator turns shaft 0 by θ₀. Elastic stages, if any, stand between shafts: stage k takes the
//! torque of shaft k over a gear of ratio n_k and a spring with a damper to shaft k + 1. The last shaft, at φ, is geared to
//! the joints without play: φ = Σ n_j q_j. A rigid transmission has no stage, and φ = θ₀. Gears and friction losses are
//! those of the chapter.
//!
//! **State.** x holds, drive by drive: of a motor θ, θ̇ and, with an inductance, the current i, (20.65), (20.67); of a linear
//! actuator its own state; then angle and speed of every shaft between two stages. Where the transmission is rigid, θ and
//! θ̇ of a motor are functions of q and q̇ and are not read from x.

use crate::model::BodyId;
use crate::real::Real;
use crate::spatial::Vec3;
use alloc::string::String;
use alloc::vec::Vec;

/// An actuator with its transmission.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive<T> {
    /// Name in messages and in the columns of simulations.
    pub name: String,
    /// What makes the torque.
    pub actuator: Actuator<T>,
    /// Elastic stages from the actuator towards the joints; none: a rigid transmission.
    pub stages: Vec<Stage<T>>,
    /// Inertia of the gears on the last shaft, about it, beside the actuator's own \[kg·m²\]; `None`: none.
    pub shaft_inertia: Option<T>,
    /// Losses between the last shaft and the joints.
    pub efficiency: Option<Efficiency<T>>,
    /// The joints and the speed of the last shaft per speed of each \[1 or rad/m\].
    pub joints: Vec<(BodyId, T)>,
    /// Torque of the last shaft per force of each joint, for the inverse problem: a row of the inverse of the transposed
    /// matrix of ratios. `None` if a motion does not say what the drive does.
    pub shares: Option<Vec<(BodyId, T)>>,
    /// Greatest |u| that reaches the actuator \[V, or the unit of u\].
    pub input_limit: Option<T>,
    /// Greatest |i| \[A\].
    pub current_limit: Option<T>,
    /// Part of the limit within which an inductive current is slowed down gradually, for implicit integrators, which find no solution
    /// where a derivative jumps. `None`: it stops at the limit.
    pub soft_current: Option<T>,
    /// A rotor on a moving link whose turning in space counts.
    pub rotor: Option<Rotor<T>>,
    /// What it bears: no part of the equations.
    pub rating: Rating<T>,
}

/// What an actuator bears.
#[derive(Clone, Debug, PartialEq)]
pub struct Rating<T> {
    /// Greatest speed \[rad/s\].
    pub speed: Option<T>,
    /// Greatest root of the mean square of the current \[A\].
    pub continuous_current: Option<T>,
    /// How it heats.
    pub thermal: Option<Thermal<T>>,
}

/// A motor that heats as two bodies: its winding, and its housing between that and the air.
#[derive(Clone, Debug, PartialEq)]
pub struct Thermal<T> {
    /// Thermal resistance from winding to housing \[K/W\].
    pub winding_housing: T,
    /// Thermal resistance from housing to air \[K/W\].
    pub housing_ambient: T,
    /// Thermal time constant of the winding \[s\].
    pub winding_time: T,
    /// Thermal time constant of the housing \[s\].
    pub housing_time: T,
    /// Temperature of the air \[°C\].
    pub ambient: T,
    /// Greatest temperature of the winding \[°C\].
    pub limit: Option<T>,
}

impl<T: Real> Rating<T> {
    /// Nothing is known.
    pub fn none() -> Self {
        Rating { speed: None, continuous_current: None, thermal: None }
    }

    fn map<U: Real>(&self, mut g: impl FnMut(T) -> U) -> Rating<U> {
        Rating {
            speed: self.speed.map(&mut g),
            continuous_current: self.continuous_current.map(&mut g),
            thermal: self.thermal.as_ref().map(|t| Thermal {
                winding_housing: g(t.winding_housing),
                housing_ambient: g(t.housing_ambient),
                winding_time: g(t.winding_time),
                housing_time: g(t.housing_time),
                ambient: g(t.ambient),
                limit: t.limit.map(&mut g),
            }),
        }
    }
}

/// What makes the torque of a drive.
#[derive(Clone, Debug, PartialEq)]
pub enum Actuator<T> {
    /// A permanent-magnet DC motor.
    Motor(Motor<T>),
    /// Any linear actuator.
    Linear(LinearActuator<T>),
}

/// A permanent-magnet DC motor: J θ̈ = C_M i − B θ̇ − M and u = R i + L i̇ + C_E θ̇, (20.62), (20.63), (20.66).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor<T> {
    /// J \[kg·m²\].
    pub rotor_inertia: T,
    /// C_M \[N·m/A\].
    pub torque_constant: T,
    /// C_E \[V·s/rad\].
    pub emf_constant: T,
    /// B \[N·m·s/rad\].
    pub friction: T,
    /// R \[Ω\].
    pub resistance: T,
    /// L \[H\]; `None`: neglected, the current follows at once.
    pub inductance: Option<T>,
}

/// ẋ = C x + f M + d u (20.74) with the shaft's acceleration θ̈ = T ẋ, in which M is the torque that the shaft puts out.
///
/// Where T f ≠ 0, −1/(T f) is the inertia of the shaft, which H* (20.73) takes up. Where T f = 0, as (20.80) allows, there is none: the
/// shaft moves by θ̈ = T (C x + d u) whatever its load, and M is what that takes. Then the joint that it drives rigidly has θ̈ = n q̈ in place
/// of its row of H* q̈ + h* = D u.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearActuator<T> {
    /// C, n × n by rows.
    pub c: Vec<T>,
    /// f.
    pub f: Vec<T>,
    /// d.
    pub d: Vec<T>,
    /// T: θ̇ = T x.
    pub t: Vec<T>,
    /// The row P with θ = P x, for an elastic transmission.
    pub position: Option<Vec<T>>,
    /// Least r with T Cʳ d ≠ 0: how often θ̈ is to be differentiated until u appears.
    pub relative_degree: usize,
    /// Whether T f = 0: the shaft does not give way to its load.
    pub is_unyielding: bool,
}

/// A gear, then a spring with a damper: τ = c (θ/n − θ′) + d (θ̇/n − θ̇′) (20.99) on the next shaft θ′.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage<T> {
    /// n: speed before the gear over speed behind it.
    pub ratio: T,
    /// c \[N·m/rad\].
    pub stiffness: T,
    /// d \[N·m·s/rad\]; `None`: no damper.
    pub damping: Option<T>,
    /// I′ + I″/n² (20.98): inertia of the gears on the shaft before the stage \[kg·m²\].
    pub inertia: T,
    /// Losses of the gear.
    pub efficiency: Option<Efficiency<T>>,
}

/// Losses of a gear: the torque behind it is η′ times what it would be without losses while the motion goes in the
/// direction of the drive, 1/η″ times that while it goes against it, and the same at zero power, where there is no loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Efficiency<T> {
    /// η′, above 0, at most 1.
    pub forward: T,
    /// η″, above 0, at most 1.
    pub backward: T,
    /// Speed w \[rad/s\] of the shaft before the gear: v/√(v² + w²) stands for the sign of its speed v. `None`: the sign itself,
    /// under which a gear may stick and no equation of motion is left.
    pub speed: Option<T>,
}

impl<T: Real> Efficiency<T> {
    /// Every number through `g`.
    pub fn map<U: Real>(&self, mut g: impl FnMut(T) -> U) -> Efficiency<U> {
        Efficiency { forward: g(self.forward), backward: g(self.backward), speed: self.speed.map(g) }
    }
}

/// A rotor that turns in space with the link that carries it: its spin θ̇ about the axis couples to the link's ω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotor<T> {
    /// The body that carries it. Its inertia holds the rotor's, as of a body that does not turn.
    pub body: BodyId,
    /// The axis, a unit vector in the body's canonical frame.
    pub axis: Vec3<T>,
    /// Moment of inertia about the axis \[kg·m²\].
    pub inertia: T,
}

impl<T: Real> Drive<T> {
    /// Number of entries of x.
    pub fn states(&self) -> usize {
        self.actuator.states() + 2 * self.stages.len().saturating_sub(1)
    }

    /// Whether nothing turns with the joints alone, so that H stays as it is.
    pub fn is_inertia_free(&self) -> bool {
        !self.stages.is_empty() && self.shaft_inertia.is_none()
    }

    /// The joint that moves as the actuator's state says whatever its load, with its ratio: that of an unyielding actuator with a
    /// rigid transmission, of which there is one.
    pub fn held_joint(&self) -> Option<(BodyId, T)> {
        match (&self.actuator, &self.stages[..], &self.joints[..]) {
            (Actuator::Linear(a), [], [joint]) if a.is_unyielding => Some(*joint),
            _ => None,
        }
    }

    /// The same drive without losses and limits, which is affine in x and u.
    #[must_use]
    pub fn ideal(&self) -> Self {
        let stages = self.stages.iter().map(|s| Stage { efficiency: None, ..*s }).collect();
        Drive { stages, efficiency: None, input_limit: None, current_limit: None, ..self.clone() }
    }

    /// Every number through `g`.
    pub fn map<U: Real>(&self, mut g: impl FnMut(T) -> U) -> Drive<U> {
        let stage = |s: &Stage<T>, g: &mut dyn FnMut(T) -> U| Stage {
            ratio: g(s.ratio),
            stiffness: g(s.stiffness),
            damping: s.damping.map(&mut *g),
            inertia: g(s.inertia),
            efficiency: s.efficiency.map(|e| e.map(&mut *g)),
        };
        Drive {
            name: self.name.clone(),
            actuator: self.actuator.map(&mut g),
            stages: self.stages.iter().map(|s| stage(s, &mut g)).collect(),
            shaft_inertia: self.shaft_inertia.map(&mut g),
            efficiency: self.efficiency.map(|e| e.map(&mut g)),
            joints: self.joints.iter().map(|(b, n)| (*b, g(*n))).collect(),
            shares: self.shares.as_ref().map(|row| row.iter().map(|(b, n)| (*b, g(*n))).collect()),
            input_limit: self.input_limit.map(&mut g),
            current_limit: self.current_limit.map(&mut g),
            soft_current: self.soft_current.map(&mut g),
            rotor: self.rotor.map(|r| Rotor { body: r.body, axis: r.axis.map(&mut g), inertia: g(r.inertia) }),
            rating: self.rating.map(&mut g),
        }
    }
}

impl<T: Real> Actuator<T> {
    /// Number of its states: 3 or 2 of a motor.
    pub fn states(&self) -> usize {
        match self {
            Actuator::Motor(m) => 2 + usize::from(m.inductance.is_some()),
            Actuator::Linear(a) => a.f.len(),
        }
    }

    fn map<U: Real>(&self, g: &mut impl FnMut(T) -> U) -> Actuator<U> {
        match self {
            Actuator::Motor(m) => Actuator::Motor(Motor {
                rotor_inertia: g(m.rotor_inertia),
                torque_constant: g(m.torque_constant),
                emf_constant: g(m.emf_constant),
                friction: g(m.friction),
                resistance: g(m.resistance),
                inductance: m.inductance.map(&mut *g),
            }),
            Actuator::Linear(a) => {
                let mut all = |row: &Vec<T>| row.iter().map(|x| g(*x)).collect::<Vec<U>>();
                Actuator::Linear(LinearActuator {
                    c: all(&a.c),
                    f: all(&a.f),
                    d: all(&a.d),
                    t: all(&a.t),
                    position: a.position.as_ref().map(all),
                    relative_degree: a.relative_degree,
                    is_unyielding: a.is_unyielding,
                })
            }
        }
    }
}
