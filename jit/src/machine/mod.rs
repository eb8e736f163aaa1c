//! Instructions of machines: a file per set of them.

pub mod x86;
