//! What `functions` and `explain` are told.

use clap::Args;

#[derive(Debug, Args)]
pub struct Functions {
    /// A word of the name, of the summary, or another name, such as `RNEA`
    pub word: Option<String>,
}

#[derive(Debug, Args)]
pub struct Explain {
    /// The code, as it stands in `warning[near-right-angle]`
    pub code: Option<String>,
}
