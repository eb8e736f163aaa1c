//! All tests of the package in one binary: it is linked once, and what several files stand on is compiled once.
//! A file is chosen by its name: `cargo test -p straightline-cli --test suite report::`.

#[path = "../../../tests/suite/chain.rs"]
mod chain;
mod command_line;
mod diagnostics;
mod drive_parameters;
mod energies;
mod export;
#[cfg(feature = "parquet")]
mod fuzz;
#[cfg(feature = "logs")]
mod identify;
mod in_c;
#[cfg(all(feature = "logs", feature = "parquet"))]
mod lerobot;
#[cfg(feature = "logs")]
mod logged;
#[cfg(feature = "parquet")]
mod machine_code;
#[path = "../../../../generated_tests/src/made.rs"]
mod made;
mod optimal_control;
mod options;
#[cfg(feature = "parquet")]
mod parquet;
mod report;
#[cfg(feature = "logs")]
mod residuals;
mod simulation;
mod view;
#[cfg(feature = "logs")]
mod whole_states;
