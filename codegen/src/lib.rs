//! The compiler of Straightline: from a robot file to straight-line `no_std` Rust.
//!
//! [`compile()`] is the whole pipeline as one pure function; `ARCHITECTURE.md` draws it.
#![forbid(unsafe_code)]

#[macro_use]
extern crate straightline_graph;

pub mod choices;
pub mod compile;
pub mod convert;
pub mod description;
pub mod diagnostic;
pub mod emit;
pub mod equations;
pub mod fronts;
pub mod function;
pub mod identifier;
pub mod machine_code;
pub mod model;
pub mod options;
pub mod output;
pub mod program;
pub mod readback;
pub mod report;
pub mod scene;
#[cfg(feature = "verify")]
pub mod verify;

pub use choices::{Fusion, Lanes, LimbForm};
pub use compile::compile;
pub use diagnostic::{Diagnostics, Source};
pub use emit::Generated;
pub use equations::Robot;
pub use fronts::{compile_robot, Builder};
pub use function::{ForwardDynamicsMethod, Function};
pub use options::Options;
pub use straightline_graph::expr::Grade;
pub use straightline_graph::{certify, element_of, expr, fixed, pass, rounding, schedule, trace, Scalar};

/// What tests see of the inside of the compiler, and break in it (`tests/suite/inside.rs`, `mutants.rs`). As unit tests they would be a second
/// build of it, as long as the first.
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod internals {
    pub use crate::choices::tests as choices;
    pub use crate::description::angle::tests as description_angle;
    pub use crate::description::geometry::tests as description_geometry;
    pub use crate::description::write::rotations::tests as description_write_rotations;
    pub use crate::diagnostic::codes::tests as diagnostic_codes;
    pub use crate::diagnostic::levels::tests as diagnostic_levels;
    pub use crate::emit::c99::kernel::tests as emit_c99_kernel;
    pub use crate::emit::c99::tests as emit_c99;
    pub use crate::emit::rust::stubs::tests as emit_rust_stubs;
    pub use crate::emit::rust::tests as emit_rust;
    pub use crate::function::aliases::tests as function_aliases;
    pub use crate::function::quantity::tests as function_quantity;
    pub use crate::identifier::tests as identifier;
    pub use crate::options::stable::tests as options_stable;
    pub use crate::output::tests as output;
    pub use crate::program::equivalence::mutants::{
        a_broken_pass_never_reaches_the_text, a_wrong_form_of_the_robot_gives_way_to_a_plainer_one,
        broken_passes_never_reach_the_text, every_kind_of_program_goes_through_the_passes_that_are_broken,
        robots_as_people_write_them_keep_their_cheapest_form,
    };
    pub use crate::readback::c99::around::tests as readback_c99_around;
    pub use crate::readback::c99::tokens::tests as readback_c99_tokens;
    pub use crate::readback::packages::tests as readback_packages;
    pub use crate::readback::tokens::tests as readback_tokens;
    pub use crate::report::errors::tests as report_errors;
}

/// Version of the generator, as it stands in generated files.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A hash of the sources of this compiler: builds of different ones may make different programs, also where they have the same version.
pub const SOURCES: &str = env!("STRAIGHTLINE_SOURCES");
