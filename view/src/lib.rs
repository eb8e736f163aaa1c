//! Robots in motion as pages for the browser: one file of HTML that needs no network, drawn by WebGL2.
//!
//! The page shows capsules between the joints, the joints themselves, inertia ellipsoids ([`ellipsoid`]), what the robot looks like ([`urdf_look`]), frames, and forces and torques as
//! arrows where the run has them; beside them the run's columns over time. Poses come from the kinematics of `straightline-core`; the page
//! interpolates between them and computes nothing of the robot itself.
//!
//! ```
//! use straightline_core::model::{Body, Joint, JointEffects, JointKind, Limits, Model};
//! use straightline_core::spatial::{SpatialInertia, Sym3, Transform, Vec3};
//! use straightline_view::{page, ViewedLook, ViewedRun};
//!
//! let inertia = Sym3 { xx: 0.02, xy: 0.0, xz: 0.0, yy: 0.03, yz: 0.0, zz: 0.015 };
//! let bob = Body {
//!     name: "bob".into(),
//!     parent: None,
//!     joint: Joint { name: "pivot".into(), kind: JointKind::Revolute, iq: 0, iv: 0, limits: Limits::default() },
//!     placement: Transform::identity(),
//!     inertia: SpatialInertia::new(2.0, Vec3::new(0.3, 0.0, 0.1), inertia),
//!     link_frame: Transform::identity(),
//!     dense: false,
//!     effects: JointEffects::none(),
//!     load: None,
//! };
//! let model = Model {
//!     name: "pendulum".into(),
//!     bodies: vec![bob],
//!     couplings: vec![],
//!     closure: Default::default(),
//!     gravity: Vec3::new(0.0, 0.0, -9.81),
//!     frames: vec![],
//!     drives: vec![],
//!     base_parameters: Default::default(),
//! };
//! let facts = [("Robot file", "pendulum.toml".to_string())];
//! let html = page(&model, &ViewedLook::default(), &ViewedRun::tour(&model), &facts).unwrap();
//! assert!(html.starts_with("<!DOCTYPE html>"));
//! ```

mod charts;
pub mod ellipsoid;
mod html;
mod mesh;
mod poses;
mod run;
mod shapes;
mod solids;
mod tour;

pub use html::{page, FIELD_OF_VIEW};
pub use mesh::Triangle;
pub use poses::{frame_poses, world_poses, ViewedPose};
pub use run::{ViewFailure, ViewedRun};
pub use shapes::{urdf_look, ShapeForm, ViewedLook, ViewedShape};
