//! What was generated, in numbers.

use crate::expr::Counts;
use crate::function::Function;
use crate::staged::StagedReport;
use std::collections::BTreeMap;

/// Figures of one generated function.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct FunctionReport {
    /// Multiplications.
    pub mul: usize,
    /// Additions and subtractions.
    pub add: usize,
    /// Instructions for `mul` and `add` when every a·b ± c is one.
    pub fma: usize,
    /// Divisions.
    pub div: usize,
    /// Square roots.
    pub sqrt: usize,
    /// Sine-cosine pairs of distinct angles.
    pub sincos: usize,
    /// Most values alive at once, inputs and constants not counted.
    pub max_live: usize,
    /// Bytes of values handed from part to part; 0 for a function in one part.
    pub carried_bytes: usize,
    /// Functions of bounded size that it was cut into.
    pub parts: usize,
    /// Lines of source.
    pub lines: usize,
}

impl FunctionReport {
    /// From a program's counts.
    pub fn new(counts: Counts, max_live: usize, carried_bytes: usize, parts: usize, lines: usize) -> Self {
        let Counts { mul, add, fma, div, sqrt, sin_cos } = counts;
        FunctionReport { mul, add, fma, div, sqrt, sincos: sin_cos, max_live, carried_bytes, parts, lines }
    }
}

/// Figures of everything that was generated for a robot.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct Report {
    /// The robot's name.
    pub robot: String,
    /// Number of configuration coordinates.
    pub nq: usize,
    /// Number of velocity coordinates.
    pub nv: usize,
    /// The scalar type of the functions.
    pub scalar: &'static str,
    /// Name of each function and its figures.
    pub functions: BTreeMap<&'static str, FunctionReport>,
    /// Figures of the staged form, if it was generated.
    #[cfg_attr(feature = "cli", serde(skip_serializing_if = "Option::is_none"))]
    pub staged: Option<StagedReport>,
}

impl Report {
    /// The figures of a function, if it was generated.
    pub fn function(&self, function: Function) -> Option<&FunctionReport> {
        self.functions.get(function.name())
    }
}
