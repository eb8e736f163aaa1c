//! What the tests of the reference stand on.

pub mod data;
pub mod robots;
