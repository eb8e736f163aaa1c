//! All tests of the package in one binary: it is linked once, and what several files stand on is compiled once.
//! A file is chosen by its name: `cargo test -p straightline --test suite derive::`.

#[cfg(feature = "derive")]
mod broken;
#[cfg(feature = "derive")]
pub mod derive;
#[cfg(feature = "derive")]
mod rebuild;
