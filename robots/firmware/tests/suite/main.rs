//! All tests of the package in one binary: it is linked once, and what several files stand on is compiled once.
//! A file is chosen by its name: `cargo test -p straightline-firmware-example --test suite no_panic::`.

mod closed_loop;
#[allow(dead_code)] // other packages use the rest
mod cross;
mod device;
mod frameworks;
mod no_panic;
