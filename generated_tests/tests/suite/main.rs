//! All tests of the package in one binary: it is linked once, and what several files stand on is compiled once.
//! A file is chosen by its name: `cargo test -p straightline-generated-tests --test suite bytes::`.

mod bounds;
mod bytes;
mod climbs;
mod closed_forms;
mod combinations;
mod contact_forms;
mod contact_generated;
mod contact_runtime;
mod count_accuracy;
mod derivative_counts;
mod derivative_states;
mod determinism;
mod driven_derivatives;
mod driven_physics;
mod driven_robots;
mod drives;
mod exact_rules;
mod frame_conventions;
mod fused;
mod generic;
mod golden;
mod identities;
mod joint_states;
mod lanes;
mod limbs;
mod mutants;
mod notations;
mod operation_counts;
mod random_trees;
mod reference_states;
mod scene_counts;
mod scenes;
mod stress;
