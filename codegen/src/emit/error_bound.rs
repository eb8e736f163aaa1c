//! The functions and constants of rounding errors as text.

use crate::emit::{self, number, Style};
use crate::options::Options;
use crate::program::written::Written;
use crate::report::errors::{four_digits, ErrorReport, OutputErrors};
use std::fmt::Write;
use straightline_graph::expr::{Graph, Port};
use straightline_graph::schedule::schedule;
use straightline_graph::Scalar;

/// What a caller must know of a bound at a state.
const OF_STATE: &str = "Inputs below the normal numbers are to be given as zero where the machine reads them so.";

/// The source of `…_error_bound`, or a comment that says why there is none.
pub(crate) fn error_bound_text(
    bound: Result<Graph, &'static str>,
    (name, by_residual): (&str, bool),
    graph: &Graph,
    options: &Options,
    written: &mut Vec<Written>,
) -> emit::FunctionText {
    let scalar = graph.widest(options.scalar);
    let bound = match bound {
        Ok(bound) => bound,
        Err(why) => return emit::FunctionText::remark(&format!("No `{name}_error_bound`: {why}.")),
    };
    let mut doc = match by_residual {
        false => format!(
            "How far the results of [`{name}`] can be from the exact values by rounding, at these inputs: certified for this state, \
             whatever the ranges of the inputs. NaN where nothing is certified: a divisor that may vanish, or a sign that may be wrong."
        ),
        true => format!(
            "How far accelerations and reactions, from [`{name}`] or wherever else, can be from the exact ones at these inputs: \
             certified by what they leave of the equations.\n\n`smallest_eigenvalue`: what the smallest eigenvalue of the mass matrix is \
             at least. Where rounding is too coarse for a proof, the results that depend on it are NaN: ask `is_nan()` before use."
        ),
    };
    if by_residual && bound.outputs.iter().any(|p| p.name == "smallest_contact_eigenvalue") {
        doc.push_str(
            " `smallest_contact_eigenvalue` is that of the inverse mass J H⁻¹ Jᵀ that reactions feel (where objects give way or contacts \
             slide with friction, the smallest singular value of the matrix of reactions); redundant contacts have no proof.",
        );
    }
    let _ = write!(doc, "\n\n{OF_STATE}");
    if options.generic {
        let _ = write!(doc, " Of [`{name}`] in `{}`.", scalar.name());
    }
    if !graph.formats.is_empty() {
        let (wider, scalar) = (scalar.name(), options.scalar.name());
        let _ = write!(doc, " In {wider}, of the function in {scalar}: convert its inputs.");
    }
    let schedule = schedule(&bound, options.limits);
    let name = format!("{name}_error_bound");
    let text = emit::function(&bound, &schedule, &name, &doc, Style::plain(scalar), &|_| String::new());
    written.push(Written { name, graph: bound, scalar, generic: false, lanes: false });
    text
}

impl ErrorReport {
    /// The constants of a function in the generated file.
    pub fn constants(&self, function: &str) -> String {
        let mut out = String::new();
        if let Some(refused) = self.refused {
            let _ = writeln!(out, "// No certified bound of the errors of {function}: {refused}.");
        }
        for output in &self.outputs {
            let name = self.constant_name(function, output);
            let _ = writeln!(
                out,
                "/// Certified bound of the errors of [`{function}`]: how far `{}` can be from the exact dynamics of the robot file.\n///\n\
                 /// Numbers of the file are the nearest f64; angles that were taken as exact are exact.",
                output.name
            );
            let _ = writeln!(out, "///\n/// It holds for all inputs in these ranges:");
            for line in &self.ranges {
                let _ = writeln!(out, "/// * {}", line.replace('[', "\\[").replace(']', "\\]"));
            }
            let kind = Port::new(&output.name, &output.shape);
            let kind = crate::emit::array_type(&kind, crate::emit::Scalar::F64);
            let mut bounds = output.bounds.iter();
            let values = nested(&output.shape, &mut bounds);
            let _ = writeln!(out, "#[allow(clippy::all)]\npub const {name}: {kind} = {values};");
        }
        out
    }

    /// The name of an output's constant.
    pub fn constant_name(&self, function: &str, output: &OutputErrors) -> String {
        let output = if self.outputs.len() == 1 { String::new() } else { format!("_{}", output.name.to_uppercase()) };
        format!("{}{output}_ERROR_BOUND", function.to_uppercase())
    }
}

fn nested<'a>(shape: &[usize], numbers: &mut impl Iterator<Item = &'a f64>) -> String {
    match shape.split_first() {
        None => numbers.next().map_or(String::new(), |x| number(four_digits(*x), Scalar::F64)),
        Some((n, rest)) => {
            let parts: Vec<String> = (0..*n).map(|_| nested(rest, numbers)).collect();
            format!("[{}]", parts.join(", "))
        }
    }
}
