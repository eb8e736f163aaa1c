//! Programs that bound the errors of another program at the state at hand: `…_error_bound` in generated code. What holds of them is
//! proven in `running.rs`; of accelerations and reactions, which are checked by their residual, in [`residual`](super::residual).

use super::running::Running;
use super::FloatFormat;
use crate::expr::{Graph, Port};
use crate::number::Scalar;

/// What the output of a bound is called behind the result that it is of.
pub const OF_ERROR: &str = "_error";

/// Which bits the program in question computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bits {
    /// Those of its operations, one by one.
    Plain,
    /// Those or others: it may round less often, as with fused multiply-adds.
    Fused,
}

/// A program that bounds what another one loses, at the same inputs: an output `…_error` for each output. Of a program in mixed precision it
/// is one in f64. Where a divisor may vanish, a root has none, or a sign may be wrong, the bound is NaN.
///
/// # Errors
/// If it would be so long that its own roundings count, or takes parameters in mixed precision.
pub fn state_bound(graph: &Graph, scalar: Scalar, bits: Bits) -> Result<Graph, &'static str> {
    if !graph.formats.is_empty() && graph.inputs.iter().any(|p| p.wrapper.is_some()) {
        return Err("parameters that are inputs are in f32, and the bound of mixed precision is in f64");
    }
    let format = FloatFormat::of_program(graph, scalar);
    let ports = graph.inputs.clone();
    let program = match (graph.formats.is_empty(), bits) {
        (true, Bits::Plain) => Running::new(ports, format),
        (true, Bits::Fused) => Running::of_other_bits(ports, format, format),
        (false, _) => Running::of_other_bits(ports, FloatFormat::of(graph.widest(scalar)), format),
    };
    bound_of(program, graph)
}

pub(super) fn bound_of(mut p: Running, graph: &Graph) -> Result<Graph, &'static str> {
    let inputs = p.inputs();
    let zero = p.constant(0.0);
    let errors = p.follow(graph, &inputs).into_iter().map(|r| r.error.unwrap_or(zero)).collect::<Vec<_>>();
    let errors = p.all_settled(&errors);
    let outputs = graph.outputs.iter().map(|p| Port::new(&format!("{}{OF_ERROR}", p.name), &p.shape)).collect();
    let bound = p.finish(outputs, errors).ok_or("its own roundings would count")?;
    Ok(Graph { sines: graph.sines, ..bound })
}
