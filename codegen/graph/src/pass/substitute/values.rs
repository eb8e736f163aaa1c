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
    let mut any = || -> AtPoints {
        std::array::from_fn(|_| {
            let size = 0.3 + 2.0 * random.unit();
            Dd::new(if random.below(2) == 0 { size } else { -size }, 0.0)
        })
    };
    let inputs: usize = graph.inputs.iter().map(|p| p.len()).sum();
    let inputs: Vec<AtPoints> = (0..inputs).map(|_| any()).collect();
    let atoms: Vec<Option<AtPoints>> = graph.ops.iter().map(|op| is_atom(op).then(&mut any)).collect();
    let points: [Vec<Dd>; POINTS] = std::array::from_fn(|k| {
        let inputs: Vec<Dd> = inputs.iter().map(|x| x[k]).collect();
        values_by(graph, &inputs, |id, _| atoms[id.index()].map(|x| x[k]), of_rounded_sum)
    });
    (0..graph.ops.len()).map(|i| std::array::from_fn(|k| points[k][i])).collect()
}
