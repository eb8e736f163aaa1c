//! What derivatives of accelerations leave of the equations that they solve, column by column: what their bounds at a state are made of.

use crate::equations::bind::{is_optional, BoundRobot};
use crate::equations::Robot;
use crate::function::{Forms, ForwardDynamicsMethod, Function, Quantity, SelectedRows};
use crate::options::{Optimisations, Options};
use crate::program::equivalence::{self, Disagreement, Plainer};
use crate::program::{simplified, OF_SYSTEM};
use std::collections::BTreeMap;
use straightline_core::Real;
use straightline_graph::certify::columns::{ColumnSystem, MASS_MATRIX};
use straightline_graph::expr::Port;
use straightline_graph::trace::trace;

/// The results of a function that a scene wants, as columns that are solved for.
pub(crate) struct SolvedColumns {
    /// Of each, its place among all results of the function.
    wanted: Vec<usize>,
    pub outputs: Vec<Port>,
    columns: Vec<Vec<usize>>,
    finds_accelerations: bool,
    /// How many results the function has.
    all: usize,
}

impl SolvedColumns {
    /// None where a result is something else, where a column is wanted in parts, or where accelerations are found on the way and no result.
    pub fn of(robot: &Robot, function: Function, options: &Options) -> Option<SolvedColumns> {
        let nv = robot.model.nv();
        let (wanted, outputs) = options.scene.select(function, &robot.model, 0);
        let rows = function.spec().outputs;
        let blocks = function.outputs(&robot.model, 0);
        let finds_accelerations = rows[0].name == Quantity::Acceleration.name();
        let mut columns: BTreeMap<(usize, usize), Vec<(usize, usize)>> = BTreeMap::new();
        for (at, k) in wanted.iter().enumerate() {
            let (mut block, mut within) = (0, *k);
            while within >= blocks[block].len() {
                within -= blocks[block].len();
                block += 1;
            }
            let (row, column) = match blocks[block].shape[..] {
                [n] if n == nv && block == 0 && finds_accelerations => (within, 0),
                [n, m] if [n, m] == [nv; 2] && rows[block].slope.is_some() => (within / nv, within % nv),
                _ => return None,
            };
            columns.entry((block, column)).or_default().push((row, at));
        }
        let is_found = columns.first_key_value().is_some_and(|((block, _), _)| *block == 0);
        if finds_accelerations && !is_found {
            return None;
        }
        let in_order = |mut column: Vec<(usize, usize)>| {
            column.sort_unstable();
            (column.len() == nv).then(|| column.into_iter().map(|(_, at)| at).collect())
        };
        let columns: Option<Vec<Vec<usize>>> = columns.into_values().map(in_order).collect();
        let all = blocks.iter().map(Port::len).sum();
        columns.map(|columns| SolvedColumns { wanted, outputs, columns, finds_accelerations, all })
    }

    /// All that the equations take: the inputs of the function, and what it finds.
    pub fn ports(&self, robot: &Robot, function: Function, options: &Options) -> Vec<Port> {
        [options.scene.ports(function, &robot.model, &[]), self.outputs.clone()].concat()
    }

    /// What is left of the equations, and H behind it.
    pub fn left<T: Real>(
        &self,
        function: Function,
        forms: &Forms<'_, T>,
        bound: &BoundRobot<T>,
        found: &[T],
    ) -> Vec<T> {
        let mut whole = vec![T::zero(); self.all];
        self.wanted.iter().zip(found).for_each(|(k, x)| whole[*k] = *x);
        let left = function.residual(forms, &bound.arguments, &whole);
        let mass_matrix = Function::MassMatrix.evaluate_on(forms, &bound.arguments[..1]);
        self.wanted.iter().map(|k| left[*k]).chain(mass_matrix).collect()
    }

    /// The equations, by these optimisations.
    fn system(
        &self,
        robot: &Robot,
        function: Function,
        options: &Options,
        optimisations: Optimisations,
    ) -> ColumnSystem {
        let nv = robot.model.nv();
        let own = options.scene.ports(function, &robot.model, &[]).len();
        let outputs = [&self.outputs[..], &[Port::new(MASS_MATRIX, &[nv, nv])]].concat();
        let rules = options.rules_of(optimisations);
        let traced = trace(rules, self.ports(robot, function, options), outputs, |inputs| {
            let (given, found) = inputs.split_at(own);
            let bound = options.scene.bind(function, robot, given);
            let method = ForwardDynamicsMethod::Factorisation;
            let forms = bound.forms(optimisations.reduced, &[], SelectedRows::ALL, method);
            self.left(function, &forms, &bound, &found.concat())
        });
        let is_velocity = |port: &Port| Quantity::of(port) == Some(Quantity::Velocity);
        let unused = |port: &Port| is_optional(port) || is_velocity(port);
        let graph = simplified(("the equations of derivatives", OF_SYSTEM), traced, unused, optimisations);
        ColumnSystem { graph, columns: self.columns.clone(), finds_accelerations: self.finds_accelerations }
    }

    /// The equations in the form with the fewest operations that agrees with the plain ones.
    ///
    /// # Errors
    /// What was wrong, if none does.
    pub fn checked_system(
        &self,
        robot: &Robot,
        function: Function,
        options: &Options,
    ) -> Result<(ColumnSystem, Option<Plainer>), Disagreement> {
        options.optimisations().first_that_agrees(|optimisations| {
            let made = self.system(robot, function, options, optimisations);
            equivalence::of_column_system(robot, options, (function, self), &made.graph).map(|()| made)
        })
    }
}
