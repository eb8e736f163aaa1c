//! Series in time: how many terms are computed changes none of them.

use straightline_core::{Real, Taylor};

/// Every operation, over constants, too.
fn all<const N: usize>(x: Taylor<f64, N>, y: Taylor<f64, N>) -> [Taylor<f64, N>; 6] {
    let two = Taylor::fixed(2.0);
    let (sine, cosine) = (x * two).sin_cos();
    [x * y - two, x / (y + two), sine - (-cosine), (y * y + two).sqrt(), two * two / two, (x * y).derivative()]
}

#[test]
fn a_series_of_few_terms_is_the_beginning_of_a_longer_one() {
    let (x, y) = ([0.3, -1.2, 0.7, 2.1, -0.4, 0.9], [1.1, 0.2, -0.6, 0.8, 0.5, -1.3]);
    let whole = all::<6>(Taylor::from_derivatives(x), Taylor::from_derivatives(y));
    for terms in 1..6 {
        let some = all::<6>(Taylor::truncated(terms, x), Taylor::truncated(terms, y));
        for (case, (some, whole)) in some.iter().zip(&whole).enumerate() {
            // the last term of a derivative is unknown
            let known = if case == 5 { terms - 1 } else { terms };
            assert_eq!(some.coefficients[..known], whole.coefficients[..known], "case {case}, {terms} terms");
            assert!(some.coefficients[terms..].iter().all(|c| *c == 0.0), "case {case}, {terms} terms");
        }
    }
    assert_eq!(whole[4].derivative_at(0), 2.0);
    assert_eq!(whole[4].coefficients[1..], [0.0; 5]);
}
