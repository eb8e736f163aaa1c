//! Numbers in columns with names: what goes to files and into plots.

use std::fmt::Write;

/// Columns of equal length with names; the first is time \[s\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataTable {
    /// Names, such as `t` and `q.shoulder`.
    pub names: Vec<String>,
    /// Rows of as many numbers as there are names.
    pub rows: Vec<Vec<f64>>,
}

impl DataTable {
    /// The column of that name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let k = self.names.iter().position(|n| n == name)?;
        Some(self.rows.iter().map(|row| row[k]).collect())
    }

    /// What is wrong with the first number that is not finite, and the time of its row.
    ///
    /// # Errors
    /// There is one.
    pub(crate) fn check(&self) -> Result<(), (f64, String)> {
        self.rows.iter().try_for_each(|row| self.check_row(row))
    }

    /// Looks for a number of one row that is not finite.
    ///
    /// # Errors
    /// As [`check`](DataTable::check).
    pub(crate) fn check_row(&self, row: &[f64]) -> Result<(), (f64, String)> {
        match row.iter().position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(k) => Err((row[0], format!("`{}` is {}, not a finite number", self.names[k], row[k]))),
        }
    }

    /// As CSV, RFC 4180: a header, then a row per line, numbers with all their digits.
    pub fn csv(&self) -> String {
        let quoted = |name: &String| match name.contains([',', '"', '\n', '\r']) {
            true => format!("\"{}\"", name.replace('"', "\"\"")),
            false => name.clone(),
        };
        let mut out = self.names.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
        for row in &self.rows {
            for (k, x) in row.iter().enumerate() {
                let _ = write!(out, "{}{x:?}", if k == 0 { "" } else { "," });
            }
            out.push('\n');
        }
        out
    }
}
