//! Sums whose bits do not depend on the order of their terms.
//!
//! A sum is an integer, in units of 2⁻⁶³. A term is cut to it once, towards zero, which is a matter of the term alone; integers are then added exactly. So sums of
//! parts come together in any order, in any number, on any machine.

use crate::failure;
use datafusion::error::Result;

/// Units in 1, as a factor: a power of two, so that scaling is exact.
const UNITS: f64 = 9_223_372_036_854_775_808.0;
/// Terms are less.
const GREATEST: f64 = UNITS / 2.0;
/// Bytes of a sum.
const BYTES: usize = 16;

/// Some sums.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExactSums(Vec<i128>);

impl ExactSums {
    /// So many, of nothing.
    pub fn zero(count: usize) -> ExactSums {
        ExactSums(vec![0; count])
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Adds a term to a sum.
    ///
    /// # Errors
    /// The term is not finite or exceeds 4.6e18, or the sum would exceed 1.8e19.
    pub fn add(&mut self, sum: usize, term: f64, argument: &str) -> Result<()> {
        if term.is_nan() || term.abs() >= GREATEST {
            return Err(failure::beyond_sums(argument, term));
        }
        // both parts are exact: the whole one has no fraction, the other begins below it
        let whole = term as i64;
        let fraction = ((term - whole as f64) * UNITS) as i64;
        let units = (i128::from(whole) << 63) + i128::from(fraction);
        self.0[sum] = self.0[sum].checked_add(units).ok_or_else(failure::sums_overflow)?;
        Ok(())
    }

    /// Adds those of other terms.
    ///
    /// # Errors
    /// They are of other sums, or a sum would exceed 1.8e19.
    pub fn merge(&mut self, others: &ExactSums) -> Result<()> {
        if self.len() != others.len() {
            return Err(failure::other_state());
        }
        for (sum, other) in self.0.iter_mut().zip(&others.0) {
            *sum = sum.checked_add(*other).ok_or_else(failure::sums_overflow)?;
        }
        Ok(())
    }

    /// A sum, rounded once.
    pub fn rounded(&self, sum: usize) -> f64 {
        self.0[sum] as f64 / UNITS
    }

    /// As they travel.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(|sum| sum.to_le_bytes()).collect()
    }

    /// As they came.
    ///
    /// # Errors
    /// They are of other sums.
    pub fn from_bytes(bytes: &[u8]) -> Result<ExactSums> {
        match bytes.as_chunks::<BYTES>() {
            (sums, []) => Ok(ExactSums(sums.iter().map(|sum| i128::from_le_bytes(*sum)).collect())),
            _ => Err(failure::other_state()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(terms: &[f64]) -> ExactSums {
        let mut sums = ExactSums::zero(1);
        terms.iter().for_each(|term| sums.add(0, *term, "effort").expect("a term that fits"));
        sums
    }

    #[test]
    fn what_cancels_leaves_the_rest() {
        assert_eq!(sum(&[1e18, 0.1, -1e18]).rounded(0), 0.1);
        assert_eq!(sum(&[-2.75, 0.5]).rounded(0), -2.25);
    }

    #[test]
    fn terms_of_any_order_give_the_same_integer() {
        let terms = [0.1, -7.3e5, 2.0_f64.powi(-40), 1.0 / 3.0, 6.02e11, -0.1];
        let mut backwards = terms;
        backwards.reverse();
        assert_eq!(sum(&terms), sum(&backwards));
        let mut merged = sum(&terms[3..]);
        merged.merge(&ExactSums::from_bytes(&sum(&terms[..3]).to_bytes()).expect("sums")).expect("sums of as many");
        assert_eq!(merged, sum(&terms));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        for term in [f64::NAN, f64::INFINITY, -5e18] {
            assert!(ExactSums::zero(1).add(0, term, "effort").is_err(), "{term}");
        }
        let mut sums = ExactSums::zero(1);
        let fits = (0..8).take_while(|_| sums.add(0, 4.5e18, "effort").is_ok()).count();
        assert_eq!(fits, 4);
        assert!(sums.merge(&sums.clone()).is_err());
        assert!(sums.merge(&ExactSums::zero(2)).is_err());
        assert!(ExactSums::from_bytes(&[0; 17]).is_err());
    }
}
