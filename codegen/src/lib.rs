//! The compiler of Straightline: from a robot file to straight-line `no_std` Rust.
//!
//! [`compile()`] is the whole pipeline as one pure function; `ARCHITECTURE.md` draws it.
#![forbid(unsafe_code)]

pub mod builder;
pub mod choose;
pub mod compile;
pub mod contact;
pub mod description;
pub mod diagnostic;
pub mod emit;
pub mod equivalence;
pub mod expansion;
pub mod export;
pub mod forward_method;
pub mod function;
pub mod identifier;
pub mod input_box;
pub mod limbs;
pub mod model;
pub mod output;
pub mod pivots;
mod range;
pub mod readback;
pub mod reduce;
#[cfg(feature = "verify")]
pub mod reference_input;
pub mod report;
pub mod scene;
pub mod singular;
pub mod stable;
pub mod staged;
pub mod stubs;
#[cfg(feature = "verify")]
pub mod verify;
pub mod words;

pub use builder::{compile_robot, Builder};
pub use compile::{compile, Generated, Options};
pub use diagnostic::{Diagnostics, Source};
pub use emit::Scalar;
pub use function::{ForwardDynamicsMethod, Function, Robot};
pub use straightline_graph::expr::Grade;
pub use straightline_graph::{certify, expr, pass, rounding, schedule, trace};

/// What the tests break inside the compiler. As unit tests they would be a second build of it, as long as the first.
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod internals {
    pub use crate::equivalence::mutants::{
        a_broken_pass_never_reaches_the_text, a_wrong_form_of_the_robot_gives_way_to_a_plainer_one,
        every_kind_of_program_goes_through_the_passes_that_are_broken,
        robots_as_people_write_them_keep_their_cheapest_form, thousands_of_broken_passes_never_reach_the_text,
    };
}

/// Version of the generator, as it stands in generated files.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
