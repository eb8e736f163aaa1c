//! How functions are written.

use crate::emit::Style;
use crate::options::Options;

impl Options {
    /// How functions over lanes and the programs inside types are written.
    pub fn style(&self) -> Style {
        let one_by_one = self.target.is_some_and(|machine| machine.row().is_scalar);
        Style::plain(self.scalar).fused(self.fma).by_caller(self.fma_by_caller).one_by_one(one_by_one)
    }

    /// How plain functions are written.
    pub fn plain_style(&self) -> Style {
        match self.generic {
            true => self.style().generic(),
            false => self.style(),
        }
    }
}
