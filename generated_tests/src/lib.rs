//! Truth x inputs x bound: what tests every generated function.
//!
//! This library holds the material of the tests: the [bounds], the [reference data](mod@reference), the [`compiled`] functions of all
//! robots, [`programs`] as the compiler makes them, the [contact_cases], [robots with drives](drives), [random robots](random) written
//! for both authors, [robots as people write them](written), and a [`search`] for the worst case.
//! The tests themselves are in `tests/`, one file per kind of claim.
#![forbid(unsafe_code)]

pub mod bounds;
pub mod compiled;
pub mod contact_cases;
pub mod derivative_data;
pub mod drives;
pub mod inputs;
pub mod made;
pub mod programs;
pub mod random;
pub mod reference;
pub mod roll_pitch_yaw;
pub mod search;
pub mod standalone;
pub mod written;
