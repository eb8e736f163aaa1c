//! The commands about logs.

pub use crate::identify::{help as help_of_identify, identify, Identify};
pub use crate::log_files::{mcap_bytes, run_columns};
pub use crate::residuals::{help as help_of_residuals, residuals, Residuals};
