//! Kinds of joints: one file each, and a row of this table.
//!
//! A file `joint/NAME.rs` has two halves. Its [`Descriptor`] says what others need to know of the joint without its mechanics: how many
//! coordinates, what they are called and measured in, which words of a robot file mean it. Its `Mechanics` are the pose of the
//! joint and its motion subspace, from which every sweep follows by default; where a joint's own form takes fewer operations the file
//! writes that form.
//!
//! Nobody outside asks which kind a joint is: it asks for a column of its row.

#![cfg_attr(not(feature = "alloc"), allow(dead_code))] // without models nothing is swept

#[macro_use]
mod descriptor;
mod articulated;
mod exponential;
mod mechanics;
mod pose;
pub(crate) mod quaternion;

#[cfg(feature = "alloc")]
pub(crate) use articulated::{ArticulatedInertia, FreeJoint};
pub use descriptor::{words, Descriptor, Dialect, Measure, Word, FLOATING_BASE, KINDS, MOST_COORDINATES};
pub(crate) use exponential::TwistMap;
pub(crate) use mechanics::Mechanics;
#[cfg(feature = "alloc")]
pub use pose::composing_pays;
pub(crate) use pose::JointPose;

joints! {
    /// Turns about z by q \[rad\]; also a continuous joint.
    revolute::Revolute,
    /// Slides along z by q \[m\].
    #[doc(alias = "linear")]
    prismatic::Prismatic,
    /// The root body, free in the world. q = (x, y, z, qx, qy, qz, qw): position and orientation (a unit quaternion) of
    /// the root link in the world; qd = (v, ω): velocity of the root link's origin and angular velocity, in root-link
    /// axes; qdd the componentwise derivative of qd; tau the force and the moment about that origin, in root-link axes.
    /// It has no parent, and q says all about its pose: its placement and link frame are the identity.
    floating::Floating,
    /// Turns about any axis. q = (x, y, z, w): unit quaternion of the child link's axes in those of the joint; qd: angular velocity against the
    /// parent, in child-link axes; qdd the componentwise derivative of qd; tau the moment on the child, in child-link axes.
    #[doc(alias = "ball")]
    spherical::Spherical,
}
