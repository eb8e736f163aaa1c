//! Sources of this package that the compiler pastes into its output, which then depends on `core` alone. They stand here so that the
//! compiler finds them wherever it is built.

/// [`crate::trig`].
pub const TRIG: &str = include_str!("trig.rs");
/// [`crate::short_sines`].
pub const SHORT_SINES: &str = include_str!("short_sines.rs");
/// [`crate::fixed`].
pub const FIXED: &str = include_str!("fixed.rs");
/// [`crate::batch`].
pub const BATCH: &str = include_str!("batch.rs");
