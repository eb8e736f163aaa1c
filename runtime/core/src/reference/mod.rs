//! The chapter's own formulation of robot dynamics: the second author, who tests the first.
//!
//! Source: the handbook chapter *Robot Dynamics*, sections 20.1, 20.2, 20.5.2 and 20.5.3 and its appendix, equations
//! (20.1)–(20.61), (20.83)–(20.97) and (20.100)–(20.111); equation numbers in this module are the chapter's. Its misprints are corrected where they occur,
//! and every correction says so. Link frames sit in the centres of mass, all vectors of motion and force are expressed in
//! the external immobile frame, rotations come from Rodrigues' formula, forces from D'Alembert's principle, and the
//! equations of motion from the matrices Λ, Γ, Ξ, Δ. Nothing of [`crate::algorithms`] or [`crate::spatial`] is used:
//! only the scalars and nalgebra's products.
//!
//! Two generalisations, both marked where they occur: the chain becomes a tree (the index j − 1 becomes the parent of j,
//! a sum over k = j … n a sum over the links that joint j carries), and the first link may float ([`ReferenceJoint::Free`]).
//!
//! The chapter calls *direct dynamics* what is called inverse dynamics today, and the reverse; names here are today's,
//! and the chapter's are aliases for the search.
//!
//! Conventions of the outputs: `tau` = `H q̈ + h`; wrenches are about the joint point, in child-link axes; Jacobians and
//! poses are in world axes, rows 1–3 linear; a free link has q = (x, y, z, qx, qy, qz, qw), q̇ = (v, ω) and τ = (F, M) in
//! root-link axes at the root link's origin.
//!
//! ```
//! use nalgebra::{Matrix3, Vector3};
//! use straightline_core::reference::{inverse_dynamics, CentreOfMassLink, CentreOfMassTree, ExtendedPosition, ReferenceJoint, SharedCoordinate};
//!
//! // a pendulum about the world's z axis: 2 kg, its centre of mass 0.5 m from the joint
//! let link = CentreOfMassLink {
//!     name: "rod".into(),
//!     parent: None,
//!     joint: ReferenceJoint::Revolute,
//!     iq: 0,
//!     iv: 0,
//!     shared: None,
//!     mass: 2.0,
//!     inertia: Matrix3::from_diagonal(&Vector3::new(0.0, 0.1, 0.1)),
//!     e: Vector3::z(),
//!     e_parent: Vector3::z(),
//!     r: Vector3::new(0.5, 0.0, 0.0),
//!     r_parent: Vector3::zeros(),
//!     extended: ExtendedPosition::Matrix(Matrix3::identity()),
//! };
//! let gravity = Vector3::new(0.0, -10.0, 0.0);
//! let pendulum = CentreOfMassTree { name: "pendulum".into(), gravity, links: vec![link], frames: vec![] };
//! // τ = (J + m r²) q̈ + m g r cos q
//! let tau = inverse_dynamics(&pendulum, &[0.0], &[0.0], &[5.0]);
//! assert_eq!(tau[0], (0.1 + 2.0 * 0.25) * 5.0 + 2.0 * 10.0 * 0.5);
//! ```

mod contact;
mod displacement;
pub mod drives;
mod dynamics;
mod energy;
mod frames;
mod geometry;
mod kinematics;
mod scalar;
mod solve;
mod tree;

pub use contact::{
    at_rest, constrained_motion, environment_impact, environment_motion, functional_coordinate, rigid_impact,
    Component, ContactFrames, Derivatives,
};
pub use displacement::{displaced, displacement, increment};
pub use dynamics::{
    bias_force, dalembert_inverse_dynamics, equations_of_motion, forward_dynamics, forward_natural_scale,
    gravity_force, inverse_dynamics, joint_loads, joint_wrenches, mass_matrix, natural_scale, velocity_force,
    EquationsOfMotion, JointLoad,
};
pub use energy::{centre_of_mass, kinetic_energy, momentum, potential_energy, ReferenceMomentum};
pub use frames::{frame_acceleration, frame_jacobian, frame_jacobian_bias, frame_pose, frame_velocity, FramePose};
pub use geometry::{extended_joint, geometry, quaternion_rotation, rodrigues, skew, unit, LinkGeometry};
pub use kinematics::{linear_forms, motion, LinearForms, LinkMotion};
pub use scalar::ReferenceReal;
pub use solve::solve_symmetric;
pub use tree::{
    CentreOfMassFrame, CentreOfMassLink, CentreOfMassTree, ExtendedPosition, ReferenceJoint, SharedCoordinate,
};
