//! All tests of the package in one binary.

mod columns;
mod common;
mod hostile;
mod identification;
mod numbers;
mod python;
mod ros;
