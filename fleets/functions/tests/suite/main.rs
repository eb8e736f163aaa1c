//! Tests of the functions, in one binary.

mod addresses;
mod equations;
mod helpers;
mod lists;
mod many;
mod messages;
mod rows;
