//! All tests of the package in one binary: it is linked once, and what several files stand on is compiled once.
//! A file is chosen by its name: `cargo test -p straightline-core --test suite trig::`.

mod algorithms;
mod balls;
mod contact;
mod dd;
mod dual;
mod integrate;
mod measure;
mod reduced_rates;
mod reference;
mod short_sines;
mod support;
mod tangent;
mod taylor;
mod trig;
mod two_authors;
