//! The algorithms of rigid-body dynamics, one file each, generic over the scalar.
//!
//! They take the coordinates as plain slices: q by [`Joint::iq`](crate::model::Joint::iq), and qd, qdd, tau by
//! [`Joint::iv`](crate::model::Joint::iv), in any order of the joints. SI units throughout. Inside, vectors stand in the
//! canonical frame of their body (z along the joint axis) unless the name says otherwise.
//!
//! No scalar is compared and no zero is skipped, so that the same source runs with numbers and writes down equations;
//! what a branch depends on is the structure of the robot alone.
//!
//! ```
//! use straightline_core::algorithms::{bias_force, inverse_dynamics, mass_matrix};
//! use straightline_core::model::{Body, Joint, JointEffects, JointKind, Limits, Model};
//! use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
//!
//! // 2 kg at 0.5 m on a horizontal axis: z of the joint frame along y of the world, x along x
//! let rotation = Mat3 { rows: [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]] };
//! let pendulum = Model {
//!     name: "pendulum".into(),
//!     bodies: vec![Body {
//!         name: "bob".into(),
//!         parent: None,
//!         joint: Joint { name: "hinge".into(), kind: JointKind::Revolute, iq: 0, iv: 0, limits: Limits::default() },
//!         placement: Transform { rotation, translation: Vec3::zero() },
//!         inertia: SpatialInertia::new(2.0, Vec3::new(0.5, 0.0, 0.0), Sym3::zero()),
//!         link_frame: Transform::identity(),
//!         dense: false,
//!         effects: JointEffects::none(),
//!         load: None,
//!     }],
//!     gravity: Vec3::new(0.0, 0.0, -10.0),
//!     couplings: vec![],
//!     closure: Default::default(),
//!     frames: vec![],
//!     drives: vec![],
//!     base_parameters: Default::default(),
//! };
//! let (q, qd, qdd) = ([0.0], [3.0], [4.0]);
//! assert_eq!(mass_matrix(&pendulum, &q), [0.5]); // m l²
//! assert_eq!(bias_force(&pendulum, &q, &qd), [-10.0]); // the weight turns it by +y, the drive must hold by −y
//! assert_eq!(inverse_dynamics(&pendulum, &q, &qd, &qdd), [0.5 * 4.0 - 10.0]);
//! ```
//!
//! | wanted | function |
//! |---|---|
//! | pose, velocity, acceleration of a frame | [`forward_kinematics`], [`frame_velocity`], [`frame_acceleration`] |
//! | Jacobian and J̇q̇ | [`jacobian`](fn@jacobian), [`jacobian_bias`] |
//! | derivatives of the motion of a frame, J̇ | [`frame_derivatives`](fn@frame_derivatives), [`frame_derivatives_in_own_axes`], [`frame_derivatives_at_world_origin`] |
//! | Jᵀ f and its derivative | [`jacobian_hessian_product`] |
//! | dynamics of a task, inverse kinematics | [`OperationalSpace`], [`inverse_kinematics_step`] |
//! | tau of a motion | [`inverse_dynamics`], [`bias_force`], [`gravity_force`], [`velocity_force`] |
//! | reactions in the joints | [`joint_wrenches`] |
//! | H(q) | [`mass_matrix`] |
//! | what a free base makes of gravity and of its own velocity | [`FallingBase`] |
//! | motion under a tau | [`forward_dynamics_aba`], [`forward_dynamics_ltdl`] |
//! | q ⊕ v, its inverse and their derivatives | [`integrate`], [`difference`], [`integrate_maps`], [`difference_maps`] |
//! | energy | [`kinetic_energy`], [`potential_energy`] |
//! | motion under the inputs of drives | [`driven_motion`], [`complete_model`](fn@complete_model), [`state_space`](fn@state_space) |
//! | inputs of drives for a motion | [`driven_inverse`](fn@driven_inverse) |
//! | centre of mass, momentum | [`momentum`](fn@momentum) |
//! | mass and centre of mass behind each joint | [`subtrees`] |
//! | forces, momentum, energy and the support's wrench per unit of the parameters | [`torque_regressor`], [`gravity_regressor`], [`momentum_regressor`], [`energy_regressor`], [`base_wrench_regressor`] |
//! | what moves both | [`centre_of_mass_jacobian`], [`centroidal_map`], [`centroidal_dynamics_derivatives`] |
//! | contact coordinates, (20.83)-(20.87) | [`relative_motion`], [`functional_coordinates`] |
//! | motion and reactions in contact, (20.88)-(20.94) | [`constrained_forward_dynamics`], [`hybrid_inverse_dynamics`], [`Environment`] |
//! | impact, (20.90)-(20.97) | [`impact`](fn@impact) |
//! | how contacts and their forces change with q and q̇ | [`ContactSweep`], [`HeldWrenches`] |
//! | derivatives of motion and reactions in contact, and of impacts | [`ContactFactors`] |
//! | motion and reactions in contact under the inputs of drives | [`driven_contact_motion`] |

mod aba;
mod actuator;
mod centroidal;
mod constraint;
mod contact_derivatives;
mod contact_motion;
mod contact_system;
mod coriolis;
mod crba;
mod driven;
mod driven_contact;
mod driven_inverse;
mod effects;
mod energy;
mod environment;
mod factor;
mod falling_base;
mod frame_derivatives;
mod frame_twist_derivatives;
mod functional;
mod impact;
mod inverse_kinematics;
mod jacobian;
mod jacobian_hessian;
mod kinematics;
mod momentum;
mod operational_space;
mod reduced_derivatives;
mod reduced_dynamics;
mod reduced_gravity;
mod reduced_mass_matrix;
mod reduced_regressor;
mod reduced_turn;
mod regressor;
mod rnea;
mod subtree;
mod tangent;
mod transmission;
mod velocity;

pub use crate::joint::composing_pays;
pub use aba::{forward_dynamics_aba, solve_articulated};
pub use centroidal::{
    centre_of_mass_jacobian, centroidal_derivatives, centroidal_dynamics_derivatives, centroidal_map, CentroidalBlocks,
    CentroidalDynamicsBlocks,
};
pub use constraint::{
    applied_rows, baumgarte, constrained_forward_dynamics, hybrid_inverse_dynamics, projection, ConstrainedMotion,
    Support,
};
pub use contact_derivatives::{ContactFactors, MotionChange};
pub use contact_motion::{ContactSweep, HeldWrenches, MovedContact, Moving};
pub use coriolis::{coriolis_matrix, coriolis_transpose_force};
pub use crba::mass_matrix;
pub use driven::{
    complete_model, drive_energy, drive_power, drive_states, drive_torques, driven_motion, drives_are_diagonal,
    state_space, DriveFlow, DrivenMotion, Links,
};
pub use driven_contact::{drive_inertia, driven_contact_motion, driven_factor, driven_jump, ContactRows};
pub use driven_inverse::{
    drive_demands, driven_inverse, inverse_orders, reads_states, Demand, InverseOrders, MOST_DERIVATIVES,
};
pub use effects::{add_rotors, passive_force, rotor_forces, rotor_inertias, with_rotors_of_loops};
pub use energy::{kinetic_energy, potential_energy};
pub use environment::{Environment, EnvironmentMotion, SpringDamper};
pub use factor::{forward_dynamics_ltdl, BranchResponses, Ltdl};
pub use falling_base::FallingBase;
pub use frame_derivatives::{frame_derivatives, FrameDerivativeBlocks};
pub use frame_twist_derivatives::{frame_derivatives_at_world_origin, frame_derivatives_in_own_axes};
pub use functional::{
    constrained_coordinates, functional_coordinates, reduced_relative_motion, relative_motion, FunctionalCoordinates,
    RelativeMotion,
};
pub use impact::{impact, Impact, Struck};
pub use inverse_kinematics::{inverse_kinematics_step, StepLimits, WeightedTask};
pub use jacobian::{jacobian, jacobian_bias};
pub use jacobian_hessian::{jacobian_hessian_product, ForceOnFrame};
pub use kinematics::{forward_kinematics, frame_acceleration, frame_velocity};
pub use momentum::{momentum, CentroidalMomentum};
pub use operational_space::{OperationalSpace, TaskRows};
pub use reduced_derivatives::{
    reduced_inverse_dynamics_derivatives, reduced_inverse_dynamics_derivatives_with_limbs, DerivativeBlocks,
    LimbSubtrees, Subtree,
};
pub use reduced_dynamics::{reduced_inverse_dynamics, reduced_inverse_dynamics_with_limbs, LimbWrenches};
pub use reduced_gravity::{reduced_gravity_force, reduced_gravity_force_with_limbs, LimbMoments};
pub use reduced_mass_matrix::reduced_mass_matrix;
pub use reduced_regressor::reduced_inertial_regressor;
pub use regressor::{
    base_wrench_regressor, energy_regressor, gravity_regressor, inertial_regressor, momentum_regressor,
    put_joint_columns, support_wrenches, torque_regressor, unit_energies,
};
pub use rnea::{bias_force, gravity_force, inverse_dynamics, joint_wrenches, velocity_force};
pub use subtree::{subtrees, CarriedMass};
pub use tangent::{
    difference, difference_maps, displacement_rate, displacement_rate_maps, integrate, integrate_maps, TangentMap,
};

use crate::model::Body;
use crate::spatial::Composite;
use crate::Real;

/// What a body is and carries.
fn composite_of<T: Real>(body: &Body<T>) -> Composite<T> {
    let total = body.total_about_origin();
    Composite { mass: total.mass, first_moment: total.first_moment, second_moment: total.second_moment }
}
