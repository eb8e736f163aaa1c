//! All values at random inputs.

use crate::expr::op::OpKind;
use crate::expr::{of_rounded_sum, values_by, Graph, Op};
use straightline_core::random::Random;
use straightline_core::Dd;

/// Random states.
pub(super) const POINTS: usize = 4;

pub(super) type AtPoints = [Dd; POINTS];

/// Whether a value counts as an input of its own: it is not rational in its operands.
pub(super) fn is_atom(op: &Op) -> bool {
    op.row().is_some_and(|row| row.kind == OpKind::Other)
}

/// All values at random inputs; roots and signs are random themselves.
pub(super) fn values(graph: &Graph) -> Vec<AtPoints> {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let mut any = || random_numbers(&mut random);
    let inputs: Vec<AtPoints> = (0..input_count(graph)).map(|_| any()).collect();
    let atoms: Vec<Option<AtPoints>> = graph.ops.iter().map(|op| is_atom(op).then(&mut any)).collect();
    at_points(graph, |k| {
        let inputs: Vec<Dd> = inputs.iter().map(|x| x[k]).collect();
        values_by(graph, &inputs, |id, _| atoms[id.index()].map(|x| x[k]), of_rounded_sum)
    })
}

/// Sizes of the inputs that [`true_values`] are of: where the great terms of a polynomial hide the small ones at one size, they do not at another.
const SIZES: [f64; POINTS] = [1.0, 0.0625, 0.00390625, 0.000244140625];

/// All values at random inputs of four sizes, roots and signs as they are: of numbers below zero a root is none.
pub(super) fn true_values(graph: &Graph) -> Vec<AtPoints> {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let inputs: Vec<AtPoints> = (0..input_count(graph)).map(|_| random_numbers(&mut random)).collect();
    at_points(graph, |k| {
        let inputs: Vec<Dd> = inputs.iter().map(|x| x[k] * Dd::from(SIZES[k])).collect();
        values_by(graph, &inputs, |_, _| None, of_rounded_sum)
    })
}

fn input_count(graph: &Graph) -> usize {
    graph.inputs.iter().map(|p| p.len()).sum()
}

/// Of size 0.3 to 2.3.
fn random_numbers(random: &mut Random) -> AtPoints {
    std::array::from_fn(|_| {
        let size = 0.3 + 2.0 * random.unit();
        Dd::new(if random.below(2) == 0 { size } else { -size }, 0.0)
    })
}

/// The values of each operation, by those of all operations at each point.
fn at_points(graph: &Graph, at: impl Fn(usize) -> Vec<Dd>) -> Vec<AtPoints> {
    let points: [Vec<Dd>; POINTS] = std::array::from_fn(at);
    (0..graph.ops.len()).map(|i| std::array::from_fn(|k| points[k][i])).collect()
}
