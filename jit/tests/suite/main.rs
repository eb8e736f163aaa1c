//! Machine code beside the interpreter and beside the graph that both come from.

mod allocation;
mod bits;
mod calls;
mod emulated;
mod emulator;
mod encoding;
mod encoding_aarch64;
mod inside;
mod packing;
mod store;
