//! Robots that touch objects, on the host: approach, impact, contact with what is rigid or gives way, lift-off.
//!
//! Each phase is smooth and integrated as everything else ([`crate::simulate`]); where it ends, that is a
//! root of the distance s, of the reaction F, or of the speed along the surface, is found on the method's own interpolation
//! between two steps, and the phase is integrated anew up to there. An impact, (20.90)-(20.91) or with the object's mass
//! (20.95)-(20.97), or another set of closed contacts follows. Any set of contacts may be closed; which one it is follows from
//! the motion.

mod events;
mod object;
mod run;
mod state;

pub use object::Law;
pub use run::{simulate, simulate_from, ContactRun};

use std::fmt;
use straightline_core::algorithms::Environment;
use straightline_core::contact::Contact;

/// A contact that the robot can make.
#[derive(Clone, Debug)]
pub struct Touch {
    /// Its coordinates, its object and its surface.
    pub contact: Contact<f64>,
    /// How the object gives way; `None`: not at all.
    pub environment: Option<Environment<f64>>,
    /// How the object moves, where it does: in place of the contact's pose.
    pub law: Option<Law>,
    /// e of Newton's restitution, 0 for plastic impacts.
    pub restitution: f64,
    /// Whether it is closed at the beginning.
    pub closed: bool,
    /// Whether it pulls as well as it pushes, once closed.
    pub stays: bool,
}

/// All contacts of a simulation.
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// With objects.
    pub touches: Vec<Touch>,
    /// Frames of the robot that are held together.
    pub loops: Vec<Contact<f64>>,
    /// Baumgarte's stabilisation: frequency \[rad/s\] and damping ratio.
    pub stabilisation: Option<(f64, f64)>,
    /// Whether positions and velocities are brought back onto rigid constraints at every row of the result and every event.
    pub projects: bool,
    /// A rebound slower than this is none \[m/s\]: bounces that come ever faster have an end.
    pub rest_speed: f64,
}

impl Contacts {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.touches.is_empty() && self.loops.is_empty()
    }
}

/// A change of phase.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When \[s\].
    pub time: f64,
    /// Of which contact.
    pub contact: String,
    /// What happens.
    pub what: ContactEvent,
}

/// What happens at an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactEvent {
    /// It closes.
    Touches {
        /// Impulse along the distance, or the greatest one \[N·s or N·m·s\].
        impulse: f64,
        /// Energy that turns into heat \[J\].
        lost: f64,
    },
    /// It meets the object and leaves it again.
    Bounces {
        /// As of `Touches`.
        impulse: f64,
        /// As of `Touches`.
        lost: f64,
    },
    /// It opens.
    LiftsOff,
    /// It slides no more.
    Sticks,
    /// It sticks no more.
    Slides,
}

impl fmt::Display for ContactEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ContactEvent::Touches { impulse, lost } => write!(f, "touches, impulse {impulse:.3e}, {lost:.3e} J lost"),
            ContactEvent::Bounces { impulse, lost } => write!(f, "bounces, impulse {impulse:.3e}, {lost:.3e} J lost"),
            ContactEvent::LiftsOff => f.write_str("lifts off"),
            ContactEvent::Sticks => f.write_str("sticks"),
            ContactEvent::Slides => f.write_str("slides"),
        }
    }
}
