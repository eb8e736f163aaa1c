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

/// What modules test of themselves, for `tests/suite/inside.rs`. As unit tests they would be a second build of the package.
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod internals {
    pub use crate::advice::tests as advice;
    pub use crate::gains::linear::tests as gains_linear;
    pub use crate::gains::margins::tests as gains_margins;
    pub use crate::motion::tests as motion;
    pub use crate::ode::tests as ode;
    pub use crate::optimize::tests as optimize;
    pub use crate::panel::tests as panel;
    pub use crate::plot::tests as plot;
    pub use crate::quadrature::tests as quadrature;
}
