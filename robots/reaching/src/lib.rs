//! A Panda that reaches among obstacles: model predictive control, a thousand times a second, by iterative LQR over generated
//! derivatives. The loop is `core` only: no allocation, no library of linear algebra, no solver from elsewhere.
//!
//! | module | holds |
//! |---|---|
//! | [`arm`] | the generated dynamics, what the drives can do, capsules around the links |
//! | [`task`] | what is wanted, as a sum of squares: the hand at its goal, the arm clear of spheres, within its ranges |
//! | [`box_program`] | quadratic programs of seven torques between their limits |
//! | [`ilqr`] | one sweep: linearise 30 nodes, Riccati recursion backwards, rollouts forwards |
//! | [`observer`] | what forces nobody told the model about, by generalized momentum |
//! | [`closed_loop`] | the controller against a simulated arm with a tool that it does not know, and pushes |
//!
//! `cargo run --release -p straightline-reaching-example` prints how long a sweep takes and draws the motion.
#![no_std]
#![forbid(unsafe_code)]
// indices are those of the equations, several matrices at a time
#![allow(clippy::needless_range_loop)]

pub mod arm;
pub mod box_program;
pub mod closed_loop;
pub mod ilqr;
pub mod observer;
pub mod task;

use straightline::Real;

/// Joints of the arm.
pub const NV: usize = arm::panda::NV;

/// A vector with an entry per joint.
pub type Joints = [f64; NV];
/// A matrix with a row and a column per joint.
pub type Square = [[f64; NV]; NV];

/// a · b.
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Length of a vector of space, a tenth of a nanometre at least, so that it divides.
fn length(v: &[f64; 3]) -> f64 {
    Real::sqrt(dot(v, v) + 1e-20)
}
