//! The algorithms of rigid-body dynamics, one file each, generic over the scalar.
//!
//! They take the coordinates as plain slices: q by [`Joint::iq`](crate::model::Joint::iq), and qd, qdd, tau by
//! [`Joint::iv`](crate::model::Joint::iv), in any order of the joints. SI units throughout. Inside, vectors stand in the
//! canonical frame of their body (z along the joint axis) unless the name says otherwise.
//!
//! No scalar is compared and no zero is skipped, so that the same source runs with numbers and writes down equations;
//! what a branch depends on is the structure of the robot alone.
//!
//! | wanted | function |
//! |---|---|
//! | pose, velocity, acceleration of a frame | [`forward_kinematics`], [`frame_velocity`], [`frame_acceleration`] |
//! | Jacobian and J̇q̇ | [`jacobian`](fn@jacobian), [`jacobian_bias`] |
//! | tau of a motion | [`inverse_dynamics`], [`bias_force`], [`gravity_force`], [`velocity_force`] |
//! | reactions in the joints | [`joint_wrenches`] |
//! | H(q) | [`mass_matrix`] |
//! | motion under a tau | [`forward_dynamics_aba`], [`forward_dynamics_ltdl`] |
//! | energy | [`kinetic_energy`], [`potential_energy`] |
//! | mass centre, momentum | [`momentum`](fn@momentum) |

mod aba;
mod crba;
mod energy;
mod factor;
mod jacobian;
mod joint;
mod kinematics;
mod momentum;
mod rnea;
mod velocity;

pub use aba::{forward_dynamics_aba, solve_articulated};
pub use crba::mass_matrix;
pub use energy::{kinetic_energy, potential_energy};
pub use factor::{forward_dynamics_ltdl, Ltdl};
pub use jacobian::{jacobian, jacobian_bias};
pub use joint::composing_pays;
pub use kinematics::{forward_kinematics, frame_acceleration, frame_velocity};
pub use momentum::{momentum, Momentum};
pub use rnea::{bias_force, gravity_force, inverse_dynamics, joint_wrenches, velocity_force};
