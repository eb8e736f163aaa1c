//! The functions that bound rounding errors at a state.

use crate::emit::module::StateCertificate;
use crate::emit::target::Target;
use crate::emit::{Lowering, Style};
use crate::function::Judged;
use crate::options::Options;
use crate::program::companion::{is_by_equations, StateBound};
use crate::program::written::WrittenFunction;
use crate::report::errors::{ErrorReport, OutputErrors};
use std::fmt::Write;
use straightline_graph::expr::Graph;
use straightline_graph::schedule::schedule;

/// What a caller must know of a bound at a state.
const OF_STATE: &str = "Inputs below the normal numbers are to be given as zero where the machine reads them so.";

/// The function `…_error_bound`, or why there is none.
pub(super) fn error_bound(
    bound: StateBound,
    (name, judged): (&str, Judged),
    graph: &Graph,
    (options, target): (&Options, &dyn Target),
    written: &mut Vec<WrittenFunction>,
) -> StateCertificate {
    let scalar = graph.widest(options.scalar);
    let bound = bound.map_err(|why| format!("No `{name}_error_bound`: {why}."))?;
    let solved = match judged {
        _ if !is_by_equations(&bound) => None,
        Judged::ByColumns => Some("derivatives of accelerations, and accelerations themselves,"),
        _ => Some("accelerations and reactions,"),
    };
    let mut doc = match solved {
        None => format!(
            "How far the results of [`{name}`] can be from the exact values by rounding, at these inputs: certified for this state, \
             whatever the ranges of the inputs. NaN where nothing is certified: a divisor that may vanish, or a sign that may be wrong."
        ),
        Some(solved) => format!(
            "How far {solved} from [`{name}`] or wherever else, can be from the exact ones at these inputs: \
             certified by what they leave of the equations.\n\n`smallest_eigenvalue`: what the smallest eigenvalue of the mass matrix is \
             at least. Where rounding is too coarse for a proof, the results that depend on it are NaN: ask `is_nan()` before use."
        ),
    };
    if bound.outputs.iter().any(|p| p.name == "smallest_contact_eigenvalue") {
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
    let lowering = Lowering { style: Style::plain(scalar), target, title: &|_| String::new() };
    let name = format!("{name}_error_bound");
    let routine =
        lowering.routine(&bound, &schedule(&bound, options.limits, options.schedule_machine().as_ref()), &name, &doc);
    written.push(WrittenFunction::plain(&name, bound, scalar));
    Ok(routine)
}

impl ErrorReport {
    /// The name of an output's constant.
    pub fn constant_name(&self, function: &str, output: &OutputErrors) -> String {
        let output = if self.outputs.len() == 1 { String::new() } else { format!("_{}", output.name.to_uppercase()) };
        format!("{}{output}_ERROR_BOUND", function.to_uppercase())
    }
}

impl OutputErrors {
    /// The names of the constants of Lipschitz bounds: of the entries, and of the norm.
    pub fn lipschitz_names(&self, function: &str) -> [String; 2] {
        let name = format!("{}_{}_LIPSCHITZ", function.to_uppercase(), self.name.to_uppercase());
        [name.clone(), format!("{name}_NORM")]
    }
}
