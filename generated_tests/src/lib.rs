//! Truth x inputs x bound: what proves every generated function.
//!
//! This library holds the material of the tests: the [reference data](mod@reference), the [`compiled`] functions of all
//! robots, [`programs`] as the compiler makes them, and the [contact_cases], [random robots](random) written for both authors.
//! The tests themselves are in `tests/`, one file per kind of claim.
#![forbid(unsafe_code)]

pub mod compiled;
pub mod contact_cases;
pub mod inputs;
pub mod programs;
pub mod random;
pub mod reference;
pub mod second_author;
