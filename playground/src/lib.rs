//! The compiler in a page for the browser: what `build` makes wasm32 of. The page asks by name and gets JSON ([`request`]); natively the same functions answer
//! the tests, which compare.

#[cfg(target_family = "wasm")]
mod abi;
pub mod base64;
pub mod bench;
pub mod code;
pub mod complaints;
pub mod drives;
pub mod edits;
pub mod module;
pub mod motion;
pub mod request;

pub use request::answer;
