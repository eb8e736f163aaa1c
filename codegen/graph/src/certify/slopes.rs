//! How fast a function can change over a box: bounds of its derivatives, which are results of a program, and of their matrices.
//!
//! A box is convex, so for all x, y in it f(x) − f(y) = M (x − y) with M the mean of the derivatives on the way (fundamental theorem of
//! calculus): what bounds each entry of the derivative in the box bounds that of M, and what bounds a norm of all matrices with such entries
//! is a Lipschitz constant of f.

use super::interval::{add_up, mul_up};
use super::{subdivision, Effort, ErrorAnalysis, FloatFormat, Interval, KnownSystem, NoCertificate};
use crate::expr::{Graph, NodeId, Op};
use crate::number::Scalar;

/// Steps towards the greatest singular value: whatever they find, the bound holds.
const STEPS: usize = 60;

/// What each result can be at most as an absolute value, computed or exact, for inputs in a box that is cut as [`Effort`] says; in the order of
/// results.
///
/// # Errors
/// If a value may be no number in that box.
pub fn magnitudes(
    graph: &Graph,
    scalar: Scalar,
    inputs: &[Interval],
    effort: Effort,
    known: &KnownSystem,
) -> Result<Vec<f64>, NoCertificate> {
    let mut analysis = ErrorAnalysis::new(graph, FloatFormat::of_program(graph, scalar));
    analysis.know(known);
    let of_nodes = subdivision::magnitudes(&mut analysis, inputs, effort)?;
    let of = |r| of_nodes.iter().find(|(node, _)| *node == r).expect("every result is a node with a bound").1;
    Ok(graph.results.iter().map(|r| of(*r)).collect())
}

/// What each exact result can be at most by what is known of it, and where nothing is, any number.
pub fn known_magnitudes(graph: &Graph, known: &KnownSystem) -> Vec<f64> {
    let of = |result: &NodeId| match graph.op(*result) {
        Op::Constant(c) => c.value().hi().abs().next_up(),
        _ => {
            let facts = known.values.iter().filter(|(node, _)| node == result);
            facts.map(|(_, range)| range.mag()).fold(f64::INFINITY, f64::min)
        }
    };
    graph.results.iter().map(of).collect()
}

/// At least the greatest singular value of every matrix whose entries, row by row, are at most these in size.
///
/// |M| ≤ B gives ‖M x‖ ≤ ‖B |x|‖, so that ‖M‖ ≤ ‖B‖ = √ρ(BᵀB); and for every v > 0 the spectral radius of a matrix A ≥ 0 is at most
/// max (A v)_i/v_i (Collatz and Wielandt; Horn and Johnson 2013, theorem 8.1.26). v is what powers of A make of ones.
pub fn greatest_singular_value(entries: &[f64], columns: usize) -> f64 {
    if entries.iter().any(|x| !x.is_finite()) {
        return f64::INFINITY;
    }
    if columns == 0 {
        return 0.0;
    }
    // B v and Bᵀ B v, rounded up
    let squared = |v: &[f64]| {
        let rows =
            entries.chunks(columns).map(|row| row.iter().zip(v).fold(0.0, |sum, (b, v)| add_up(sum, mul_up(*b, *v))));
        let mut out = vec![0.0; columns];
        for (row, size) in entries.chunks(columns).zip(rows) {
            out.iter_mut().zip(row).for_each(|(sum, b)| *sum = add_up(*sum, mul_up(*b, size)));
        }
        out
    };
    let mut v = vec![1.0; columns];
    let mut least = f64::INFINITY;
    for _ in 0..STEPS {
        let next = squared(&v);
        let ratios = next.iter().zip(&v).map(|(next, v)| if *next == 0.0 { 0.0 } else { (next / v).next_up() });
        least = ratios.fold(0.0, f64::max).min(least);
        let greatest = next.iter().fold(0.0, |most: f64, x| most.max(*x));
        if greatest == 0.0 || !greatest.is_finite() {
            break;
        }
        // every entry stays above zero
        v = next.iter().map(|x| (x / greatest).max(1e-9)).collect();
    }
    if least == 0.0 {
        0.0
    } else {
        least.sqrt().next_up()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_of_a_norm_is_that_of_the_matrix_itself_where_all_entries_have_one_sign() {
        // of [3 0; 4 5]: √45, √5
        let found = greatest_singular_value(&[3.0, 0.0, 4.0, 5.0], 2);
        assert!(found >= 45f64.sqrt() && found <= 45f64.sqrt() * (1.0 + 1e-8), "{found}");
        // a row and a column
        let found = greatest_singular_value(&[3.0, 4.0, 12.0], 3);
        assert!((13.0..13.0 + 1e-7).contains(&found), "{found}");
        let found = greatest_singular_value(&[3.0, 4.0, 12.0], 1);
        assert!((13.0..13.0 + 1e-7).contains(&found), "{found}");
    }

    #[test]
    fn blocks_that_do_not_meet_have_the_norm_of_the_greater_one() {
        let found = greatest_singular_value(&[2.0, 0.0, 0.0, 0.0, 7.0, 0.0, 0.0, 0.0, 0.0], 3);
        assert!((7.0..7.0 + 1e-7).contains(&found), "{found}");
        assert_eq!(greatest_singular_value(&[0.0; 6], 3), 0.0);
        assert_eq!(greatest_singular_value(&[], 0), 0.0);
        assert_eq!(greatest_singular_value(&[1.0, f64::INFINITY], 2), f64::INFINITY);
    }
}
