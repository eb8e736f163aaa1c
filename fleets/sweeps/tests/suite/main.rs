//! Tests of sweeps, in one binary.

mod sweeps;
