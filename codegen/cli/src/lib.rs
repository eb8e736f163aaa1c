//! What the command `straightline` has beside the compiler: experiments and their files, and pages.
#![forbid(unsafe_code)]

pub mod experiment;
pub mod html;
