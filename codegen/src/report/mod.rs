//! What was generated, in numbers.

pub mod budget;
pub mod certificates;
pub mod errors;
pub mod waterfall;

use crate::equations::forward_method::MethodChoice;
use crate::function::Function;
use crate::machine_code::MachineFigures;
use crate::options::Options;
use crate::program::nonzeros::NonzeroEntries;
use crate::program::staged::StagedReport;
use crate::program::TracedProgram;
use budget::Measures;
use errors::ErrorReport;
use std::collections::BTreeMap;
use straightline_graph::expr::Counts;
use straightline_graph::schedule::ProgramEstimate;
use waterfall::Waterfall;

/// Figures of one generated function.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
    /// Additions that carry rounding errors of sums of angles into their sine-cosine pairs.
    pub tail: usize,
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
    /// Bytes of values on the stack, as far as known before rustc.
    pub stack_bytes: usize,
    /// Bytes of machine code, estimated for x86-64.
    pub code_bytes: usize,
    /// What it takes on its machine by a model, before rustc: where sines are short ones, and the model was compared with that machine's code.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub estimate: Option<ProgramEstimate>,
    /// What it takes on its machine, where that is asked for.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub machine: Option<MachineFigures>,
    /// Of forward dynamics: which method was chosen, and why.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub method: Option<MethodChoice>,
    /// Bounds of its rounding errors, where they were asked for.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub errors: Option<ErrorReport>,
    /// Which entries of its matrix results can be non-zero, where that is written beside it.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub entries: Vec<NonzeroEntries>,
    /// How it came to these counts: where it was asked for, and where a scene skips something.
    #[cfg_attr(feature = "serde", serde(flatten, skip_serializing_if = "Option::is_none"))]
    pub waterfall: Option<Waterfall>,
}

/// Figures of one function of a contact mode.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ContactReport {
    /// The mode.
    pub mode: String,
    /// The function.
    pub function: &'static str,
    /// Its operations.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub counts: Counts,
}

impl ContactReport {
    /// From the operations of a program.
    pub fn new(mode: &str, function: &'static str, counts: Counts) -> Self {
        ContactReport { mode: mode.to_string(), function, counts }
    }
}

impl FunctionReport {
    /// From a program and its number of lines.
    pub fn new(program: &TracedProgram, options: &Options, lines: usize) -> Self {
        let scalar = options.scalar;
        let is_compared = options.target.is_some_and(|machine| machine.row().cycles.is_some());
        let Counts { mul, add, fma, div, sqrt, tail, sin_cos } = program.graph.counts();
        let Measures { stack_bytes, code_bytes, live, .. } = Measures::of(program, scalar);
        FunctionReport {
            mul,
            add,
            fma,
            div,
            sqrt,
            tail,
            sincos: sin_cos,
            max_live: live,
            carried_bytes: program.schedule.slots * scalar.bytes(),
            parts: program.schedule.parts.len(),
            lines,
            stack_bytes,
            code_bytes,
            estimate: program.schedule.estimate.filter(|_| is_compared),
            machine: None,
            method: program.method,
            errors: None,
            entries: program.entries.clone(),
            waterfall: None,
        }
    }

    /// Multiplications, additions, divisions and square roots.
    pub fn flops(&self) -> usize {
        self.mul + self.add + self.div + self.sqrt
    }
}

/// Figures of everything that was generated for a robot.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub staged: Option<StagedReport>,
    /// The functions of contact modes, in the order of the file.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub contact: Vec<ContactReport>,
}

impl Report {
    /// The figures of a function, if it was generated.
    pub fn function(&self, function: Function) -> Option<&FunctionReport> {
        self.functions.get(function.name())
    }
}
