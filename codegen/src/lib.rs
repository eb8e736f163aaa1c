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

/// What the tests break inside the compiler. As unit tests they would be a second build of it, as long as the first.
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod internals {
    pub use crate::program::equivalence::mutants::{
        a_broken_pass_never_reaches_the_text, a_wrong_form_of_the_robot_gives_way_to_a_plainer_one,
        broken_passes_never_reach_the_text, every_kind_of_program_goes_through_the_passes_that_are_broken,
        robots_as_people_write_them_keep_their_cheapest_form,
    };
}

/// Version of the generator, as it stands in generated files.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A hash of the sources of this compiler: builds of different ones may make different programs, also where they have the same version.
pub const SOURCES: &str = env!("STRAIGHTLINE_SOURCES");
