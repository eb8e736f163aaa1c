//! What the tests of the reference stand on.

pub mod chapter;
pub mod compare;
pub mod data;
pub mod mjcf;
pub mod robots;

#[path = "../../../../../generated_tests/src/roll_pitch_yaw.rs"]
#[allow(dead_code)] // other tests use it
mod roll_pitch_yaw;

#[path = "../../../../../generated_tests/src/written/mod.rs"]
#[allow(dead_code, unused_imports)] // other tests use the rest
pub mod written;
