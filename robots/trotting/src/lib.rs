//! A quadruped that trots: model predictive control of the whole body, over derivatives of its contact modes. The loop is `core` only: no
//! allocation, no library of linear algebra, no solver from elsewhere.
//!
//! | module | holds |
//! |---|---|
//! | [`quadruped`] | the generated dynamics, its contact modes, its configurations and their differences |
//! | [`gait`] | which feet stand when, where they land, and where the trunk is to be |
//! | [`task`] | what is wanted, as a sum of squares: trunk and feet on their ways, forces of the ground within their cones |
//! | [`sweep`] | one sweep: the motion from node to node with its slopes, Riccati recursion backwards |
//! | [`controller`] | a sweep per node, gains every millisecond, a wrench that explains what the model does not |
//! | [`ground`] | the simulated robot on ground that gives way, with friction that slips |
//! | [`closed_loop`] | the controller against the simulated robot, with a load that it does not know, and pushes |
//!
//! `cargo run --release -p straightline-trotting-example` prints how long a sweep takes and draws the motion.
#![no_std]
#![forbid(unsafe_code)]
// indices are those of the equations, several matrices at a time
#![allow(clippy::needless_range_loop)]

pub mod closed_loop;
pub mod controller;
pub mod gait;
pub mod ground;
pub mod quadruped;
pub mod sweep;
pub mod task;

/// a · b.
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// a × b.
fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
