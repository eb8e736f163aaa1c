//! What `functions` and `explain` are told.

use clap::Args;

/// What is said below the arguments of `explain`.
pub const EXPLAIN_HELP: &str = "\
Warnings have levels: --allow CODE, --warn CODE and --deny CODE on the command line, allow(\"CODE\") in the derive,
.allow(\"CODE\") in a build script, and in a scene

  [diagnostics]
  allow = [\"CODE\"]

Of these plainer-form says that an optimisation of Straightline failed: it is always said, and can only be denied.

Examples:
  straightline explain
  straightline explain near-right-angle";

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
