//! What a program loses to rounding, beside what the plain equations lose.

use super::{every_scalar, inputs, of_ports, Disagreement, PortState, LOSSES};
use crate::equations::Robot;
use crate::function::{ForwardDynamicsMethod, Function};
use crate::options::Options;
use straightline_core::algorithms::Ltdl;
use straightline_core::magnitude::Magnitude;
use straightline_core::{Dd, Real};
use straightline_graph::expr::{evaluate, Graph};
use straightline_graph::{element_of, EveryScalar, Scalar};

/// Natural scales of accelerations: |H⁻¹| times those of the forces that make them, given with what the equations of motion are off by.
pub(super) fn sizes_of_accelerations(
    robot: &Robot,
    options: &Options,
    state: &PortState,
    off: &[Magnitude],
) -> Vec<f64> {
    let ports = options.scene.ports(Function::ForwardDynamics, &robot.model);
    let bound = options.scene.bind(Function::ForwardDynamics, robot, &of_ports(&ports, state));
    let h = Function::MassMatrix.evaluate(&bound.model, &[], ForwardDynamicsMethod::ArticulatedBody, &bound.arguments);
    let factor = Ltdl::factor(&bound.model, &h);
    let mut sizes = vec![0.0; off.len()];
    for (j, force) in off.iter().enumerate() {
        let mut unit = vec![EveryScalar::zero(); off.len()];
        unit[j] = EveryScalar::one();
        let column = factor.solve(&unit);
        sizes.iter_mut().zip(column).for_each(|(size, x)| *size += x.wide.value.hi().abs() * force.size);
    }
    sizes
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
