//! Tables of functions: columns stand under each other whatever the names.

use anstream::stdout;
use std::io::{self, Write};

/// How wide the column of these names is, with the space behind it.
pub fn name_width(names: impl IntoIterator<Item = impl AsRef<str>>) -> usize {
    let longest = names.into_iter().map(|name| name.as_ref().chars().count()).max().unwrap_or(0);
    20.max(longest + 2)
}

/// Figures of functions, one per line.
pub struct FunctionTable {
    out: anstream::Stdout,
    width: usize,
}

impl FunctionTable {
    /// Under this title, of these functions.
    pub fn new(title: &str, functions: impl IntoIterator<Item = impl AsRef<str>>) -> io::Result<FunctionTable> {
        let mut out = stdout();
        writeln!(out, "{title}\n")?;
        Ok(FunctionTable { out, width: name_width(functions) })
    }

    /// A line of it: what the columns are, or the figures of a function.
    pub fn row(&mut self, name: &str, columns: &[impl AsRef<str>]) -> io::Result<()> {
        let columns: String = columns.iter().map(|column| format!("{:>12}", column.as_ref())).collect();
        writeln!(self.out, "{name:<width$}{columns}", width = self.width)
    }

    /// What is said below it.
    pub fn foot(mut self, text: &str) -> io::Result<()> {
        writeln!(self.out, "\n{text}")
    }
}
