//! What a program loses to rounding, beside what the plain equations lose.

use super::{every_scalar, inputs, Disagreement, PlainEquations, PortState, LOSSES};
use straightline_core::algorithms as alg;
use straightline_core::magnitude::Magnitude;
use straightline_core::Dd;
use straightline_graph::expr::{evaluate, Graph};
use straightline_graph::{element_of, EveryScalar, Scalar};

impl PlainEquations<'_> {
    /// Natural scales of what is solved for: |H⁻¹| times those of the forces that make them, given with what the equations are off by; of matrices
    /// column by column.
    pub(super) fn sizes_of_solutions(self, state: &PortState, off: &[Magnitude]) -> Vec<f64> {
        let (bound, _) = self.bound(state);
        let nv = self.robot.model.nv();
        let h = alg::mass_matrix(&bound.model, &bound.arguments[0]);
        let inverse: Vec<f64> =
            alg::Ltdl::factor(&bound.model, &h).inverse().into_iter().map(|x| x.wide.value.hi().abs()).collect();
        let blocks = self.function.outputs(&self.robot.model, 0);
        let (mut sizes, mut forces) = (Vec::new(), off.iter().map(|x| x.size).collect::<Vec<_>>());
        for block in blocks {
            let others = forces.split_off(block.len());
            let columns = block.len() / nv.max(1);
            let entry = |k: usize| {
                (0..nv).map(|j| inverse[k / columns * nv + j] * forces[j * columns + k % columns]).sum::<f64>()
            };
            sizes.extend((0..block.len()).map(entry));
            forces = others;
        }
        sizes
    }
}

/// What a program and the plain equations lose to rounding: of each result the worst of some states, over its natural scale.
pub(super) struct Losses {
    program: Vec<f64>,
    pub plain: Vec<f64>,
    /// What the plain equations lose of the greatest result at least.
    pub of_greatest: f64,
}

impl Losses {
    pub fn new(graph: &Graph) -> Self {
        let none = vec![0.0; graph.results.len()];
        Losses { program: none.clone(), plain: none, of_greatest: f64::INFINITY }
    }

    /// At one more state, rounded to the scalar.
    pub fn add(
        &mut self,
        (graph, scalar): (&Graph, Scalar),
        state: &PortState,
        sizes: &[f64],
        plain: impl Fn(&PortState) -> Vec<EveryScalar>,
    ) {
        let rounded: PortState =
            state.iter().map(|(n, x)| (n.clone(), x.iter().map(|x| Dd::from(scalar.nearest(*x))).collect())).collect();
        let found = evaluate(graph, &every_scalar(&inputs(graph, &rounded)));
        let plain = plain(&rounded);
        let exact: Vec<Dd> = found.iter().map(|x| x.wide.value).collect();
        let greatest = exact.iter().map(|x| x.hi().abs()).fold(0.0, f64::max);
        let mut lost: f64 = 0.0;
        for (plain, exact) in plain.iter().zip(&exact).filter(|_| greatest > 0.0) {
            let off = (Dd::from(plain.in_scalar(scalar)) - *exact).hi().abs() / greatest;
            lost = if off.is_nan() { f64::INFINITY } else { lost.max(off) };
        }
        self.of_greatest = self.of_greatest.min(lost);
        for (k, exact) in exact.into_iter().enumerate().filter(|(k, _)| sizes[*k] > 0.0) {
            let lost = |x: EveryScalar| {
                let off = (Dd::from(x.in_scalar(scalar)) - exact).hi().abs() / sizes[k];
                if off.is_nan() {
                    f64::INFINITY
                } else {
                    off
                }
            };
            self.program[k] = self.program[k].max(lost(found[k]));
            self.plain[k] = self.plain[k].max(lost(plain[k]));
        }
    }

    pub fn compare(self, program: &str, graph: &Graph, scalar: Scalar, least: f64) -> Result<(), Disagreement> {
        let least = match scalar {
            _ if !graph.formats.is_empty() => return Ok(()),
            scalar => least * scalar.epsilon(),
        };
        let is_worse = |k: &usize| self.program[*k] > (LOSSES * self.plain[*k]).max(least);
        match (0..self.program.len()).find(is_worse) {
            None => Ok(()),
            Some(k) => Err(Disagreement {
                program: program.to_string(),
                result: element_of(&graph.outputs, k),
                difference: self.program[k],
                plain: Some(self.plain[k]),
            }),
        }
    }
}
