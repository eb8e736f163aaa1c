//! What the tests of the reference stand on.

pub mod chapter;
pub mod compare;
pub mod data;
pub mod robots;
