//! How operations are counted.

use super::op::Counted;

/// Operation counts. Sign flips and signs are free; `sin_cos` counts angles. The sum of two angles is an addition; what keeps
/// its rounding error for the argument reduction is counted apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Counts {
    /// Multiplications.
    pub mul: usize,
    /// Additions and subtractions.
    pub add: usize,
    /// Instructions for `mul` and `add` when every a·b ± c is one and the terms of sums are in the order for that, as they are
    /// where fused operations are asked for.
    pub fma: usize,
    /// Divisions.
    pub div: usize,
    /// Square roots.
    pub sqrt: usize,
    /// Additions that carry rounding errors of sums of angles into the reduction of the angle.
    pub tail: usize,
    /// Pairs of sine and cosine.
    #[cfg_attr(feature = "serde", serde(rename = "sincos"))]
    pub sin_cos: usize,
}

impl Counts {
    /// One operation more.
    pub(crate) fn count(&mut self, counted: Counted) {
        match counted {
            Counted::Free => {}
            Counted::Addition => self.add += 1,
            Counted::Multiplication => self.mul += 1,
            Counted::Division => self.div += 1,
            Counted::Root => self.sqrt += 1,
        }
    }

    /// All floating-point operations but sines and cosines.
    pub fn flops(&self) -> usize {
        self.mul + self.add + self.div + self.sqrt
    }
}

/// As many multiplications or additions a division or a square root weighs.
pub const DIVISION: usize = 10;

/// Five additions find what a sum lost, one adds it to what other sums lost.
pub const TAIL: usize = 6;
