//! Robots in motion, on the host: prescribed [`motion`]s, [`mod@simulate`]d ones, and what they ask of joints and drives ([`analysis`]).
//!
//! Everything runs over the generic numeric runtime of `straightline-core`, `Model<f64>` in and plain tables of numbers out; what
//! files say, and where they are wrong, is the command line's business.
#![forbid(unsafe_code)]

pub mod advice;
pub mod analysis;
pub mod cartesian;
pub mod command;
pub mod contact;
pub mod drive_analysis;
pub mod drives;
mod failure;
pub mod gains;
pub mod html;
mod layout;
pub mod motion;
mod ode;
pub mod optimize;
pub mod panel;
pub mod plant;
pub mod plot;
mod quadrature;
pub mod simulate;
pub mod table;
