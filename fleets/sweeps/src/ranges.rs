//! The numbers of a robot file that a sweep draws, and between which ends: `panda_link7.mass=0.5:3, elbow.friction=0:2`.

use crate::failure;
use datafusion::error::Result;
use std::ops::Range;
use straightline_cli::experiment::parameter::{self, ParameterRange};
use straightline_codegen::diagnostic::{Diagnostic, Source};
use straightline_core::random::Random;

/// The name of the text in messages.
const NAME: &str = "ranges";

/// Ranges, and where they stand in their text.
#[derive(Debug)]
pub struct SweptRanges {
    /// In the order of the text.
    pub list: Vec<ParameterRange>,
    places: Vec<Range<usize>>,
    source: Source,
}

impl SweptRanges {
    /// Reads `PATH=from:to`, several with commas between them.
    ///
    /// # Errors
    /// What is wrong with the text, and where.
    pub fn read(text: &str) -> Result<SweptRanges> {
        let source = Source::new(NAME, text);
        let (mut list, mut places) = (Vec::<ParameterRange>::new(), Vec::new());
        let mut at = 0;
        for part in text.split(',') {
            let own = part.trim();
            let start = at + (part.len() - part.trim_start().len());
            let place = start..start + own.len();
            at += part.len() + 1;
            let complain = |wrong| failure::at_range(&source, place.clone(), wrong);
            let range = parameter::parse_range(own).map_err(|be| complain(failure::no_range(&be)))?;
            if list.iter().any(|other| other.path == range.path) {
                return Err(complain(failure::drawn_twice(&range.path)));
            }
            list.push(range);
            places.push(place);
        }
        Ok(SweptRanges { list, places, source })
    }

    /// What is wrong with one of them, with its place.
    pub fn complaint(&self, range: usize, wrong: Diagnostic) -> datafusion::error::DataFusionError {
        failure::at_range(&self.source, self.places[range].clone(), wrong)
    }

    /// The numbers of a sample, each in \[from, to): a matter of the seed and of the sample's place in the sweep alone, so that parts of a sweep are drawn
    /// anywhere, in any order.
    pub fn drawn(&self, seed: u64, sample: u64) -> Vec<f64> {
        // the seed is hashed before the sample joins it, or seed 3 and sample 5 would be seed 5 and sample 3
        let mut random = Random(Random(Random(seed).bits() ^ sample).bits());
        let draw = |range: &ParameterRange| range.ends.0 + (range.ends.1 - range.ends.0) * random.unit();
        self.list.iter().map(draw).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_different_seeds_and_places_differ_and_fill_their_range() {
        let ranges = SweptRanges::read("a.mass=1:3, b.friction=-2:2").expect("ranges");
        let mut drawn = Vec::new();
        for seed in 0..40 {
            for sample in 0..250 {
                let numbers = ranges.drawn(seed, sample);
                assert_eq!(numbers, ranges.drawn(seed, sample));
                drawn.push([numbers[0], numbers[1]]);
            }
        }
        for (k, (from, to)) in [(1.0, 3.0), (-2.0, 2.0)].into_iter().enumerate() {
            let mut own: Vec<f64> = drawn.iter().map(|numbers| (numbers[k] - from) / (to - from)).collect();
            assert!(own.iter().all(|x| (0.0..1.0).contains(x)));
            own.sort_by(f64::total_cmp);
            assert!(own.windows(2).all(|pair| pair[0] < pair[1]), "two of ten thousand samples are one");
            // Kolmogorov and Smirnov: of even numbers one in 10⁷ tries is farther off
            let n = own.len() as f64;
            let off = own.iter().enumerate().fold(0.0, |most: f64, (i, x)| most.max((x - i as f64 / n).abs()));
            assert!(off < 2.9 / n.sqrt(), "{off}");
        }
        let product: f64 = drawn.iter().map(|[a, b]| (a - 2.0) * b / 2.0).sum::<f64>() / drawn.len() as f64;
        // independent numbers: a third each, so that the mean product is a third over √n off, five times that at most
        assert!(product.abs() < 5.0 / 3.0 / (drawn.len() as f64).sqrt(), "{product}");
    }
}
