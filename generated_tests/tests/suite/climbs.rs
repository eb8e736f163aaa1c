//! The search for worst cases finds them.

use straightline_generated_tests::random::Random;
use straightline_generated_tests::search::Ranges;

#[test]
fn a_climb_finds_a_narrow_peak_that_random_places_miss() {
    let ranges = Ranges(vec![(-1.0, 1.0); 6]);
    let peak = [0.3, -0.7, 0.1, 0.9, -0.2, 0.5];
    let objective = |x: &[f64]| 1.0 / (1.0 + 1e4 * x.iter().zip(&peak).map(|(a, b)| (a - b).powi(2)).sum::<f64>());
    let mut random = Random(1);
    let by_chance = (0..20_000).map(|_| objective(&ranges.anywhere(&mut random))).fold(0.0, f64::max);
    let found = ranges.climb(&mut random, 20_000, objective);
    assert!(found.value > 0.99 && by_chance < 0.1, "{found:?}, by chance {by_chance}");
    assert!(found.at.iter().zip(&ranges.0).all(|(x, (low, high))| low <= x && x <= high));
}

#[test]
fn what_is_no_number_is_the_worst() {
    let found = Ranges(vec![(-1.0, 1.0)]).climb(&mut Random(1), 500, |x| if x[0] > 0.9 { f64::NAN } else { 0.0 });
    assert!(found.value.is_infinite());
}
