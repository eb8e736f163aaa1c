//! All tests of the package in one binary: it is linked once, and what several files stand on is compiled once.
//! A file is chosen by its name: `cargo test -p straightline-simulation --test suite drives::`.

mod common;
mod contact;
mod contact_drives;
mod drives;
mod endurance;
mod gains;
mod inside;
mod simulation;
