//! 3-vectors and 3×3 matrices, and what rigid bodies are made of, over any [`Real`](crate::Real).
//!
//! Spatial quantities are pairs of 3-vectors, angular part first. Nothing here skips a zero: what is structurally zero is
//! the compiler's business.

#[cfg_attr(not(feature = "alloc"), allow(dead_code))] // without models nothing is swept
mod composite;
mod matrix;
mod rigid;
mod vector;

pub use composite::Composite;
pub use matrix::{Mat3, Sym3};
pub(crate) use rigid::symmetric_product;
pub use rigid::{ForceVector, MotionVector, SpatialInertia, Transform};
pub use vector::Vec3;
