//! The tests of the package: one binary.

