//! Tests of the command, in one binary.

mod command;
