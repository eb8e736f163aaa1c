//! The playground: what the compiler for wasm32 says beside the native one, in node, and the page in Chromium. Without `build`'s result, node or Chromium
//! tests say that they skip.

mod base64;
mod bench;
mod browser;
mod complaints;
mod edits;
mod support;
mod text;
