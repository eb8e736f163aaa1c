//! generated_tests.
