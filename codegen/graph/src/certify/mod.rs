//! Certified bounds of errors: |computed − exact| of every result, for all inputs in a box.
//!
//! *Computed* is what the generated function returns, operation by operation in its format (in whatever order of lanes, with or
//! without fused multiply-adds, with subnormal numbers or flushed to zero). *Exact* are the equations that the file describes, over
//! the real numbers: each number of the file is the nearest f64 (half an ulp, 1.1e-16 of it, from the decimal that is written, as for every
//! program that reads the file in f64), each angle what the compiler says that it was taken as.
//!
//! What is certified, and on which premise:
//!
//! * **Rounding** of operations, of sines and cosines, and of every constant from double-double to the format: proven below, for the program at
//!   hand with its constants in double-double.
//! * **The way to the program**: reading, reduction, rewriting and folding compute constants in double-double, to 2^-104 per operation, and call
//!   zero what is below 1e-28 of its terms. Every rounded value of the program counts as off by [`OF_THE_FORM`] of itself besides, some
//!   ten million such roundings: a bound in f64 grows by 1.5e-8 of itself, one in f32 by nothing. The premise, that each step is an identity over
//!   the reals and no parameter of a reduced form is many orders greater than the file's numbers, is tested, not proven: against the second author's
//!   reading of the file in double-double (the tests of certificates in `straightline-generated-tests`).
//!
//! # Why the bound holds
//!
//! **1. Perturbed program.** Let v = op(a, b) be a node, v̂ its computed value. Then v̂ = op(â, b̂) + e with |e| ≤ h, where h follows from
//! the range V of op(â, b̂) ([`format::FloatFormat::rounding`]): half an ulp of the binade below the least power of two ≥ V, plus
//! the smallest normal number for underflow; for sine and cosine the bound that is proven in `trig.rs`; for a constant the distance to
//! its rounding; 0 for sign flips, products with powers of two and inputs. A fused multiply-add drops the error of its product,
//! which lies in the same interval. So computed = F(x, ê) and exact = F(x, 0) for one function F of inputs x and errors e.
//!
//! **2. First order is enough.** On the segment from 0 to ê F is differentiable: F(x, ê) − F(x, 0) = Σ ê_i ∂F/∂e_i (x, θ ê) for one θ in
//! (0, 1) (mean value theorem), and ∂F/∂e_i is the adjoint of node i. With |∂F/∂e_i| ≤ A_i for all x in the box and all |e_j| ≤ h_j,
//! |computed − exact| ≤ Σ A_i h_i. There is no remainder to add: ranges and adjoints are those of the *perturbed* program.
//!
//! **3. Ranges and adjoints** ([`analysis`]): interval arithmetic with outward rounding ([`interval`]), forwards for values, backwards by
//! the chain rule for adjoints; intersected with what the norms of groups give ([`norms`], where each rule has its proof). A value
//! equals its [form](forms) up to the sum of the errors of the nodes between, which is added. Where products cancel (`cancel.rs`), the form is
//! one of the exact value: ranges hold exact values too (all e_j = 0), and computed ones are off by what errors can have added up to, found
//! forwards: |â b̂ − a b| ≤ |â| |b̂ − b| + |b| |â − a|, and so on.
//!
//! **4. Sums of errors.** Nodes with the same adjoint up to its sign (a product and the sum that alone uses it) add their errors first. For
//! adjoints g and errors e of one vector, Σ |g_i| |e_i| ≤ ‖g‖ ‖e‖ (Cauchy-Schwarz), and for two products x c, y s of one adjoint
//! |x c| + |y s| ≤ ‖(x, y)‖ ‖(c, s)‖, so that their errors are at most u times that together. The least of what applies is taken.
//!
//! **5. Subdivision.** A bound for a box is the greatest of the bounds of boxes that cover it ([`Effort::boxes`], [`Effort::time`]).
//!
//! Programs with a division have a bound where the divisor stays off zero in the box; where it may not, there is none: [`NoCertificate`]. Of forward
//! dynamics intervals alone know little: what mechanics knows of pivots, of what is left of H and of accelerations is given, as [`KnownSystem`]. It holds for
//! exact values and adjoints; those of the perturbed program are off by what errors add up to, found as in 3. Where that reaches a pivot,
//! as in f32 on long arms with light tips, there is no bound for a box. There, and for the state at hand, generated programs bound the
//! error: [`companion`], [`residual`], [`columns`]. A bound also proves that no value overflows and none is NaN. Coulomb friction takes the sign of a
//! speed as it is given: where subnormal numbers are read as zero, so is the sign of a subnormal speed.

pub mod analysis;
mod cancel;
pub mod columns;
pub mod companion;
mod congruence;
pub mod format;
pub mod forms;
pub mod interval;
pub mod mixed;
pub mod norms;
mod reactions;
pub mod residual;
mod running;
pub mod search;
pub mod slopes;
mod subdivision;
mod tape;
#[cfg(test)]
mod tests;

pub use analysis::{ErrorAnalysis, KnownSystem, NoCertificate};
pub use format::FloatFormat;
pub use interval::Interval;

use crate::expr::{Graph, Port};
use crate::number::Scalar;
use std::time::Duration;

/// What constants of a program may be off by, relative to what they make: 2^-80.
pub const OF_THE_FORM: f64 = 8.271806125530277e-25;

/// How much is spent on a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Boxes that each result's box is cut into at most; 1: the box as it is.
    pub boxes: usize,
    /// How long cutting may take, for all results of a function together; none: as long as it takes. Bounds then differ from run to run, and
    /// from machine to machine; all of them hold.
    pub time: Option<Duration>,
    /// Whether functions for the bound at the state at hand are generated too: [`companion`].
    pub companions: bool,
}

impl Default for Effort {
    fn default() -> Self {
        Effort { boxes: 1, time: None, companions: false }
    }
}

impl Effort {
    /// So many boxes are enough for anyone.
    pub const MOST_BOXES: usize = 100_000;
    /// So many seconds, too.
    pub const MOST_SECONDS: f64 = 86_400.0;

    /// So many boxes, or, where a time \[s\] alone is given, as many as it allows.
    ///
    /// # Panics
    /// If the time is no number from 0 to [`Effort::MOST_SECONDS`].
    pub fn new(boxes: Option<usize>, seconds: Option<f64>, companions: bool) -> Self {
        let unlimited = if seconds.is_some() { Self::MOST_BOXES } else { 1 };
        Effort { boxes: boxes.unwrap_or(unlimited), time: seconds.map(Duration::from_secs_f64), companions }
    }
}

/// Bounds on the results of a program.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Certificate {
    /// Of every output scalar in order: |computed − exact| is at most this, *exact* as in [`certify`](self).
    pub errors: Vec<f64>,
    /// Of every output scalar: what it can be, at most, as an absolute value.
    pub magnitudes: Vec<f64>,
}

impl Certificate {
    /// The greatest of all errors.
    pub fn worst(&self) -> f64 {
        self.errors.iter().fold(0.0, |worst, e| worst.max(*e))
    }
}

/// The bounds of a program's results for inputs in a box, an interval per input scalar.
///
/// # Errors
/// If a value may be no number in that box.
pub fn certify(
    graph: &Graph,
    scalar: Scalar,
    inputs: &[Interval],
    effort: Effort,
) -> Result<Certificate, NoCertificate> {
    certify_with(graph, scalar, inputs, effort, &KnownSystem::default())
}

/// [`certify()`] where something is known of exact values and adjoints.
///
/// # Errors
/// As [`certify`].
pub fn certify_with(
    graph: &Graph,
    scalar: Scalar,
    inputs: &[Interval],
    effort: Effort,
    known: &KnownSystem,
) -> Result<Certificate, NoCertificate> {
    let mut analysis = ErrorAnalysis::new(graph, FloatFormat::of_program(graph, scalar));
    analysis.know(known);
    let mut bounds = subdivision::bounds(&mut analysis, inputs, effort)?;
    // half u of a value, at least, was counted as its rounding
    let of_the_form = (1.0 + 2.0 * OF_THE_FORM / FloatFormat::of(scalar).u).next_up();
    bounds.iter_mut().for_each(|(_, error, _)| *error = interval::mul_up(*error, of_the_form));
    // of nodes, the bound of each result that is that node
    let of = |r| bounds.iter().find(|(node, _, _)| *node == r).expect("every result is a node with a bound");
    Ok(Certificate {
        errors: graph.results.iter().map(|r| of(*r).1).collect(),
        magnitudes: graph.results.iter().map(|r| of(*r).2).collect(),
    })
}

/// A box in words, one line per input: runs of equal ranges are one.
pub fn box_in_words(inputs: &[Port], ranges: &[Interval]) -> Vec<String> {
    let mut lines = Vec::new();
    let mut first = 0;
    for port in inputs {
        let ranges = &ranges[first..first + port.len()];
        first += port.len();
        let words = |r: &Interval| match r.lo == -r.hi {
            true => format!("±{:?}", r.hi),
            false => format!("{:?} to {:?}", r.lo, r.hi),
        };
        let mut start = 0;
        let mut parts = Vec::new();
        for run in ranges.chunk_by(|a, b| a == b) {
            let end = start + run.len();
            let place = match (run.len() == ranges.len(), run.len()) {
                (true, _) => String::new(),
                (false, 1) => format!("[{start}] "),
                (false, _) => format!("[{start}..{end}] "),
            };
            parts.push(format!("{place}{}", words(&run[0])));
            start = end;
        }
        lines.push(format!("{}: {}", port.name, parts.join(", ")));
    }
    lines
}
