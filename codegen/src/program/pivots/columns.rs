//! The columns that forward dynamics and its derivatives solve for: H x = b.

use super::{place, with_accelerations, Sizes, EQUAL, SLACK};
use crate::function::{Extent, ForwardDynamicsMethod, Function, Quantity};
use straightline_core::algorithms::{bias_force, Ltdl};
use straightline_core::model::Model;
use straightline_core::spatial::Vec3;
use straightline_core::{Dd, Real};
use straightline_graph::certify::{ErrorAnalysis, FloatFormat, Interval};
use straightline_graph::expr::{Graph, Op, Port};
use straightline_graph::{EveryScalar, Scalar};

/// What a column is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SolvedFor {
    /// q̈, of b = τ − h.
    Acceleration,
    /// ∂q̈/∂ a coordinate of that quantity, of b = −∂τ/∂ it, or a unit vector where that is τ.
    Slope(Quantity, usize),
}

/// A column at a state.
pub(super) struct ColumnAt {
    pub of: SolvedFor,
    pub x: Vec<Dd>,
    /// At least √(bᵀ H⁻¹ b), in the box.
    pub beta: f64,
    /// ∂b_i/∂q̈_m, negative, by rows; nothing where accelerations are not found on the way, or b does not depend on them.
    pub of_accelerations: Vec<Dd>,
    /// At least Σ √c_m √c_i of their sizes, in the box.
    pub most_of_accelerations: f64,
}

/// Of each result its row, and the column that it is of; none where some result is something else.
pub(super) fn columns_of(function: Function, graph: &Graph, nv: usize) -> Option<Vec<(usize, SolvedFor)>> {
    let of = |port: &Port| -> Option<Vec<(usize, SolvedFor)>> {
        let row = function.spec().outputs.iter().find(|output| output.name == port.name)?;
        match row.slope {
            None if port.shape == [nv] && row.axes == [Extent::Velocities] => {
                Some((0..nv).map(|k| (k, SolvedFor::Acceleration)).collect())
            }
            Some(slope) if port.shape == [nv, nv] => {
                Some((0..nv * nv).map(|k| (k / nv, SolvedFor::Slope(slope.by, k % nv))).collect())
            }
            _ => None,
        }
    };
    let all: Option<Vec<_>> = graph.outputs.iter().map(of).collect();
    all.map(|all| all.concat())
}

/// What is known of columns in a box.
pub(super) struct ColumnBounds {
    /// Each with its β, and with what it takes of accelerations.
    all: Vec<(SolvedFor, f64, f64)>,
    /// Whether accelerations are found on the way.
    finds_accelerations: bool,
}

impl ColumnBounds {
    /// Of the columns of these results. `accelerations`: within what accelerations stay where they are found on the way. None where a bound is
    /// missing.
    pub fn new(
        model: &Model<Dd>,
        results: &[(usize, SolvedFor)],
        (beta, free): (f64, &[f64]),
        (sizes, accelerations): (&Sizes<'_>, Option<Vec<Interval>>),
    ) -> Option<ColumnBounds> {
        let nv = model.nv();
        let finds_accelerations = accelerations.is_some();
        let mut all: Vec<(SolvedFor, f64, f64)> = Vec::new();
        if finds_accelerations {
            all.push((SolvedFor::Acceleration, beta, 0.0));
        }
        let wanted = |by: Quantity| results.iter().any(|(_, of)| matches!(of, SolvedFor::Slope(q, _) if *q == by));
        let root = |k: usize| free[k].sqrt();
        if wanted(Quantity::Force) {
            all.extend((0..nv).map(|c| (SolvedFor::Slope(Quantity::Force, c), root(c) * (1.0 + SLACK), 0.0)));
        }
        if !(wanted(Quantity::Configuration) || wanted(Quantity::Velocity)) {
            return Some(ColumnBounds { all, finds_accelerations });
        }
        let (graph, scene) = sizes.slopes?;
        let ranges = with_accelerations(graph, scene, model, accelerations.as_deref()).ok()?;
        let at_accelerations = place(graph, Quantity::Acceleration);
        let mut analysis = ErrorAnalysis::new(graph, FloatFormat::of(Scalar::F64));
        analysis.ranges(&ranges).ok()?;
        let magnitudes: Vec<f64> = graph.results.iter().map(|r| analysis.range(*r).mag()).collect();
        // by result of the program: at least Σ √c_m |∂ result/∂q̈_m|
        let node = |input: usize| graph.ops.iter().position(|op| *op == Op::Input(input as u32));
        let mut of_accelerations = vec![0.0; graph.results.len()];
        if finds_accelerations {
            for cone in 0..analysis.results() {
                let sensitivities = analysis.sensitivities(cone);
                let of_joint = |(m, at): (usize, usize)| node(at).map_or(0.0, |node| root(m) * sensitivities[node]);
                let sum: f64 = at_accelerations.clone().enumerate().map(of_joint).sum();
                let result = analysis.result(cone);
                let same = graph.results.iter().zip(&mut of_accelerations).filter(|(r, _)| **r == result);
                same.for_each(|(_, of)| *of = sum);
            }
        }
        let slopes = [Quantity::Configuration, Quantity::Velocity].into_iter().enumerate();
        for (block, by) in slopes.filter(|(_, by)| wanted(*by)) {
            for c in 0..nv {
                let entry = |i: usize| block * nv * nv + i * nv + c;
                let sum = |of: &[f64]| (0..nv).map(|i| root(i) * of[entry(i)]).sum::<f64>() * (1.0 + SLACK);
                all.push((SolvedFor::Slope(by, c), sum(&magnitudes), sum(&of_accelerations)));
            }
        }
        Some(ColumnBounds { all, finds_accelerations })
    }

    /// The columns at a state of a program, of its inputs and the values of its nodes; none where its results are others.
    pub fn at(
        &self,
        model: &Model<Dd>,
        graph: &Graph,
        (inputs, of_nodes): (&[Dd], &[Dd]),
        (h, results): (&[Dd], &[(usize, SolvedFor)]),
    ) -> Option<Vec<ColumnAt>> {
        let nv = model.nv();
        let mut model = model.clone();
        if let [x, y, z] = inputs[place(graph, Quantity::Gravity)] {
            model.gravity = Vec3::new(x, y, z);
        }
        // what a scene knows to be at rest is no input
        let given = |quantity: Quantity, count: usize| match inputs[place(graph, quantity)].to_vec() {
            none if none.is_empty() => vec![Dd::ZERO; count],
            given => given,
        };
        let (q, qd) = (given(Quantity::Configuration, model.nq()), given(Quantity::Velocity, nv));
        let factor = Ltdl::factor(&model, h);
        let qdd = match self.finds_accelerations {
            false => given(Quantity::Acceleration, nv),
            true => {
                let bias = bias_force(&model, &q, &qd);
                let net = given(Quantity::Force, nv).into_iter().zip(bias).map(|(tau, h)| tau - h);
                factor.solve(&net.collect::<Vec<Dd>>())
            }
        };
        // in every scalar, in which all functions are compiled anyway: once more in double-double they take as long to build again
        let in_every_scalar: Model<EveryScalar> = model.cast();
        let slopes_at = |qdd: &[Dd]| -> Vec<Dd> {
            let motion = [&q, &qd, qdd].map(|x| x.iter().copied().map(EveryScalar::constant).collect());
            let method = ForwardDynamicsMethod::default();
            let slopes = Function::InverseDynamicsDerivatives.evaluate(&in_every_scalar, &[], method, &motion);
            slopes.into_iter().map(|x| x.wide.value).collect()
        };
        let needs_slopes =
            self.all.iter().any(|(of, ..)| matches!(of, SolvedFor::Slope(by, _) if *by != Quantity::Force));
        let slopes = if needs_slopes { slopes_at(&qdd) } else { Vec::new() };
        // ∂τ/∂q is linear in q̈
        let steps: Vec<Vec<Dd>> = (0..nv)
            .filter(|_| needs_slopes && self.finds_accelerations)
            .map(|m| {
                let mut moved = qdd.clone();
                moved[m] += Dd::ONE;
                slopes_at(&moved)
            })
            .collect();
        let column = |(of, beta, most): &(SolvedFor, f64, f64)| {
            let mut of_accelerations = Vec::new();
            let x = match *of {
                SolvedFor::Acceleration => qdd.clone(),
                SolvedFor::Slope(Quantity::Force, c) => {
                    factor.solve(&(0..nv).map(|i| if i == c { Dd::ONE } else { Dd::ZERO }).collect::<Vec<_>>())
                }
                SolvedFor::Slope(by, c) => {
                    let block = if by == Quantity::Configuration { 0 } else { nv * nv };
                    let entry = |i: usize| block + i * nv + c;
                    if by == Quantity::Configuration {
                        let of = |k: usize| steps.get(k % nv).map(|step| step[entry(k / nv)] - slopes[entry(k / nv)]);
                        of_accelerations = (0..nv * nv).filter_map(of).collect();
                    }
                    factor.solve(&(0..nv).map(|i| -slopes[entry(i)]).collect::<Vec<_>>())
                }
            };
            ColumnAt { of: *of, x, beta: *beta, of_accelerations, most_of_accelerations: *most }
        };
        let columns: Vec<ColumnAt> = self.all.iter().map(column).collect();
        agree(graph, of_nodes, &columns, results).then_some(columns)
    }
}

/// Whether the results of a program are those of the columns. A column that vanishes is compared with its neighbours: here it is rounding noise.
fn agree(graph: &Graph, of_nodes: &[Dd], columns: &[ColumnAt], results: &[(usize, SolvedFor)]) -> bool {
    let quantity = |of: SolvedFor| match of {
        SolvedFor::Acceleration => None,
        SolvedFor::Slope(by, _) => Some(by),
    };
    let greatest = |of: SolvedFor| {
        let alike = columns.iter().filter(|column| quantity(column.of) == quantity(of));
        alike.flat_map(|column| &column.x).map(|x| x.to_f64().abs()).fold(0.0, f64::max)
    };
    graph.results.iter().zip(results).all(|(node, (k, of))| {
        columns
            .iter()
            .find(|column| column.of == *of)
            .is_some_and(|column| (of_nodes[node.index()] - column.x[*k]).to_f64().abs() <= EQUAL * greatest(*of))
    })
}
