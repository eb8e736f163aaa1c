//! All tests of the package in one binary. A file is chosen by its name: `cargo test -p straightline-view --test suite browser::`.

mod browser;
mod ellipsoid;
mod page;
mod robots;
mod run;
mod shapes;
