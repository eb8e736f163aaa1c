//! All tests of the package in one binary: it is linked once, and what several files stand on is compiled once.
//! A file is chosen by its name: `cargo test -p straightline-codegen --test suite rules::`.

mod acceleration_bounds;
mod as_written;
mod balls;
mod bare_metal;
mod base_parameter_names;
mod budgets;
mod builder;
mod c99;
mod c99_readback;
mod certificates;
mod certificates_of_robots;
mod chain;
mod closing_joints;
mod columns;
mod companions;
mod composites;
mod contact;
mod contact_compiled;
mod contact_derivatives;
mod convert;
mod convert_sdf;
mod dampers;
mod derivative_bounds;
mod dh;
mod driven_contact_derivatives;
mod dyads;
mod effects;
mod elastic_inverse;
mod entries;
mod estimates;
mod expansion;
mod figures;
mod fixed;
mod flexible;
mod flexible_derivatives;
mod forward_dynamics;
mod forward_dynamics_bounds;
mod frame_conventions;
mod gpu;
mod guide;
mod inside;
mod layers;
mod lets;
mod limbs;
mod loop_bounds;
mod loops;
mod machines;
mod malformed;
mod messages;
mod mixed;
mod mjcf;
mod mjcf_messages;
mod modes;
mod mutants;
mod names;
mod options;
mod outlining;
mod paired_constants;
mod parameter_derivatives;
mod ptx_machine;
mod random_joints;
mod ranges;
mod readback;
mod reduced_forms;
mod reference_input;
mod regressors;
mod regressors_of_followers;
mod renumber;
mod robot_files;
mod robots_as_written;
mod rolled;
mod rules;
mod scene;
mod scene_messages;
mod scene_verify;
mod scenes_as_written;
mod scope;
mod sdf;
mod sdf_loops;
mod sdf_messages;
mod self_test;
mod staged;
mod steps;
mod stores;
mod sums;
mod tasks;
mod truth;
mod two_readings;
mod unyielding;
mod words;

#[path = "../../../runtime/core/tests/suite/support/compare.rs"]
mod compare;
#[path = "../../../robots/firmware/tests/suite/cross.rs"]
#[allow(dead_code)] // other packages use the rest
mod cross;
#[path = "../../../runtime/core/tests/suite/support/data.rs"]
mod data;
#[path = "../../../runtime/core/tests/suite/support/robots.rs"]
mod robots;
#[path = "../../../generated_tests/src/roll_pitch_yaw.rs"]
mod roll_pitch_yaw;
#[path = "../../../generated_tests/src/standalone.rs"]
mod standalone;
#[path = "../../../generated_tests/src/written/mod.rs"]
#[allow(dead_code, unused_imports)] // other packages use the rest
mod written;
