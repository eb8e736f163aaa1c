//! Programs that check derivatives of accelerations by what each column leaves of its equations: `forward_dynamics_derivatives_error_bound` in
//! generated code.
//!
//! A column x of ∂q̈/∂q, ∂q̈/∂q̇ or H⁻¹ solves H x = b, of b = −∂τ/∂q_c or −∂τ/∂q̇_c at the exact q̈, or a unit vector. Wherever x comes from, r = H x − b has
//! a running bound (`running.rs`), and the error δ of x obeys H δ = r: by the congruence of H that proves accelerations
//! ([`residual`](super::residual), without contact). Where q̈ is a result, too, it is a column of its own, of b = τ − h, and H q̈ + h − τ bounds
//! how far it is off. The other columns are then followed with q̈ that uncertain: their r is that at the exact q̈, which b belongs to.
//!
//! Bounds of what a program loses on its way multiply along a chain; these grow with the condition of H once.

use super::companion::OF_ERROR;
use super::congruence::Congruence;
use super::residual::MOST_OPERATIONS;
use super::running::{BrokenProof, Running, Tracked};
use super::FloatFormat;
use crate::expr::{Graph, NodeId, Port};
use crate::number::Scalar;

/// The name of the last output of a system: H.
pub const MASS_MATRIX: &str = "h";

/// What results leave of the equations that they solve.
#[derive(Clone, Debug)]
pub struct ColumnSystem {
    /// Its inputs are those of a function and, by the same names, its results; its outputs what results leave, and H behind them.
    pub graph: Graph,
    /// Of each column that is solved for, which of those outputs are its own, in the order of coordinates. All outputs but H are in one.
    pub columns: Vec<Vec<usize>>,
    /// Whether the first column is of accelerations, which the others depend on.
    pub finds_accelerations: bool,
}

impl ColumnSystem {
    /// Where the accelerations that are found stand among the inputs.
    fn found(&self) -> std::ops::Range<usize> {
        let Some(result) = self.graph.outputs.first().filter(|_| self.finds_accelerations) else { return 0..0 };
        let mut first = 0;
        for port in &self.graph.inputs {
            if port.name == result.name {
                return first..first + port.len();
            }
            first += port.len();
        }
        unreachable!("every result is an input of its equations")
    }
}

/// A program that bounds how far derivatives of accelerations, and accelerations where they are found, are from the exact ones: an output
/// `…_error` for each, and `smallest_eigenvalue` of the mass matrix. Where nothing is proven, all is NaN.
///
/// # Errors
/// If it would be too long.
pub fn column_bound(system: &ColumnSystem, scalar: Scalar) -> Result<Graph, &'static str> {
    bound_of(Running::new(system.graph.inputs.clone(), FloatFormat::of(scalar)), system)
}

pub(super) fn bound_of(mut p: Running, system: &ColumnSystem) -> Result<Graph, &'static str> {
    const TOO_LONG: &str = "it would be too long";
    let ColumnSystem { graph, columns, .. } = system;
    let (mass_matrix, blocks) = graph.outputs.split_last().expect("a system has a mass matrix");
    assert_eq!(mass_matrix.name, MASS_MATRIX, "a system ends with it");
    let n = mass_matrix.shape[0];
    if n.pow(2) * (n + 4 * columns.len()) > 4 * MOST_OPERATIONS {
        return Err(TOO_LONG);
    }
    let mut inputs = p.inputs();
    let all = p.follow(graph, &inputs);
    let (left, h) = all.split_at(all.len() - n * n);
    let mut congruence = Congruence::new(&mut p, h, n).ok_or("a diagonal entry of the mass matrix is zero")?;
    let eigenvalue = congruence.smallest_eigenvalue(&mut p);
    let mut of_column = |p: &mut Running, left: &[Tracked], column: &[usize]| {
        let known = column.iter().map(|k| match p.is_broken(BrokenProof::Residual) {
            true => Running::exact(left[*k].value),
            false => left[*k],
        });
        let known: Vec<Tracked> = known.collect();
        let sizes: Vec<NodeId> = known.into_iter().map(|r| p.magnitude(r)).collect();
        let sizes = p.all_settled(&sizes);
        congruence.solution(p, &sizes)
    };
    let mut bounds: Vec<Option<NodeId>> = vec![None; left.len()];
    let found = system.found();
    let (own, others) = columns.split_at(usize::from(system.finds_accelerations));
    let mut again = left.to_vec();
    for column in own {
        let errors = of_column(&mut p, left, column);
        column.iter().zip(&errors).for_each(|(k, error)| bounds[*k] = Some(*error));
        if !p.is_broken(BrokenProof::Accelerations) {
            inputs[found.clone()].iter_mut().zip(errors).for_each(|(input, error)| input.error = Some(error));
            again = p.follow(graph, &inputs);
        }
    }
    for column in others {
        let errors = of_column(&mut p, &again, column);
        column.iter().zip(errors).for_each(|(k, error)| bounds[*k] = Some(error));
    }
    if p.operations() > 4 * MOST_OPERATIONS {
        return Err(TOO_LONG);
    }
    let of_error = |port: &Port| Port::new(&format!("{}{OF_ERROR}", port.name), &port.shape);
    let outputs = blocks.iter().map(of_error).chain([Port::new("smallest_eigenvalue", &[1])]).collect();
    let bounds = bounds.into_iter().map(|bound| bound.expect("every result is in a column"));
    let bound = p.finish(outputs, bounds.chain([eigenvalue]).collect()).ok_or(TOO_LONG)?;
    match bound.counts().flops() > MOST_OPERATIONS {
        true => Err(TOO_LONG),
        false => Ok(bound),
    }
}
