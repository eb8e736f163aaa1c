//! Certified bounds of errors, as they stand in the generated file and in reports.

use crate::function::SlopeOf;
use crate::program::nonzeros::NonzeroEntries;
use straightline_graph::certify::slopes::greatest_singular_value;
use straightline_graph::certify::Certificate;
use straightline_graph::expr::Port;

/// Certified bounds of a function's errors, or why there are none.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ErrorReport {
    /// The ranges of the inputs for which they hold, a line per input.
    pub ranges: Vec<String>,
    /// Name of each output and its bounds, in its order.
    pub outputs: Vec<OutputErrors>,
    /// Why there are none.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub refused: Option<&'static str>,
}

/// Bounds of one output.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct OutputErrors {
    /// The output's name in the function's row.
    pub name: String,
    /// Its shape.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub shape: Vec<usize>,
    /// |computed − exact| of each scalar is at most this.
    pub bounds: Vec<f64>,
    /// The absolute value of each scalar is at most this.
    pub magnitudes: Vec<f64>,
    /// Of derivatives: how fast what they are of can change.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub slopes: Option<LipschitzBounds>,
}

/// How fast a function can change with one of its inputs over a box.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct LipschitzBounds {
    /// Of what, as it is written.
    pub of: &'static str,
    /// By which input, by its name.
    pub by: String,
    /// Each entry of the derivative is at most so large, in the order of the output.
    pub entries: Vec<f64>,
    /// Of one matrix: its greatest singular value is at most this.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub norm: Option<f64>,
    /// Why there are none.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub refused: Option<&'static str>,
}

impl LipschitzBounds {
    /// Of a derivative whose entries in an array of that shape are at most so large.
    pub fn new(slope: SlopeOf, shape: &[usize], entries: Vec<f64>) -> Self {
        let norm = (shape.len() == 2).then(|| greatest_singular_value(&entries, shape[1]));
        LipschitzBounds { of: slope.of, by: slope.by.name(), entries, norm, refused: None }
    }

    /// None, and why.
    pub fn refused(slope: SlopeOf, why: &'static str) -> Self {
        LipschitzBounds { of: slope.of, by: slope.by.name(), entries: Vec::new(), norm: None, refused: Some(why) }
    }
}

/// Numbers as a nested array, rounded up to four digits.
impl ErrorReport {
    /// From a certificate over these ranges.
    pub fn new(outputs: &[Port], ranges: Vec<String>, certificate: Certificate) -> Self {
        let mut first = 0;
        let outputs = outputs.iter().map(|port| {
            let of = first..first + port.len();
            first = of.end;
            OutputErrors {
                name: port.name.clone(),
                shape: port.shape.clone(),
                bounds: certificate.errors[of.clone()].to_vec(),
                magnitudes: certificate.magnitudes[of].to_vec(),
                slopes: None,
            }
        });
        ErrorReport { ranges, outputs: outputs.collect(), refused: None }
    }

    /// No bounds, and why.
    pub fn refused(why: &'static str) -> Self {
        ErrorReport { ranges: Vec::new(), outputs: Vec::new(), refused: Some(why) }
    }

    /// Keeps the bounds of what is put out, where that is some entries of a matrix alone.
    pub(crate) fn keep_outputs(&mut self, outputs: &[Port], entries: &[NonzeroEntries]) {
        for (output, port) in self.outputs.iter_mut().zip(outputs).filter(|(output, port)| output.shape != port.shape) {
            let places =
                entries.iter().find(|of| of.output == port.name).map(NonzeroEntries::places).unwrap_or_default();
            let kept = |all: &[f64]| places.iter().map(|k| all[*k]).collect::<Vec<f64>>();
            output.shape.clone_from(&port.shape);
            (output.bounds, output.magnitudes) = (kept(&output.bounds), kept(&output.magnitudes));
            let slopes = output.slopes.iter_mut().filter(|slopes| slopes.refused.is_none());
            slopes.for_each(|slopes| slopes.entries = kept(&slopes.entries));
        }
    }

    /// What all results can be at most, in their order.
    pub fn magnitudes(&self) -> Vec<f64> {
        self.outputs.iter().flat_map(|o| o.magnitudes.iter().copied()).collect()
    }

    /// The bounds of all results, in their order.
    pub fn bounds(&self) -> impl Iterator<Item = f64> + '_ {
        self.outputs.iter().flat_map(|o| o.bounds.iter().copied())
    }
}

/// The least number of four decimal digits that is not below x ≥ 0.
pub fn four_digits(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let text = format!("{x:.3e}");
    let near: f64 = text.parse().expect("a number that was just written");
    if near >= x {
        return near;
    }
    let (digits, exponent) = text.split_once('e').expect("scientific notation has an exponent");
    let digits: f64 = digits.parse().expect("digits");
    let above: f64 = format!("{:.3}e{exponent}", digits + 0.001).parse().expect("a number");
    if above >= x {
        above
    } else {
        x
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::four_digits;

    pub fn bounds_are_rounded_up() {
        for x in [1.0, 1.00001, 9.9999, 1.2344999e-7, 9.999e12, 5e-324, 0.0] {
            let rounded = four_digits(x);
            assert!(rounded >= x && rounded <= x * 1.002, "{x} -> {rounded}");
        }
    }
}
