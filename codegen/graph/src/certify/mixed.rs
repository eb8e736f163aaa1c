//! Mixed precision: a wider format, f64, for those operations of a program in a short one, f32, that a demanded bound needs, and no others.
//!
//! Operations go in classes: all that share an adjoint, as a sum with its products does, are computed in f64 together and rounded once.
//! From the bound of the program in f32, each class has a share of each result's error; class by class, what takes most off the
//! results that are too far off, per operation, goes to f64. The shares are an estimate. What counts is the bound of the program that comes
//! out, by the same analysis as any other; where it is above the demand, the choice is made again for a lower one.
//!
//! A value in f64 is either used in f64 alone or rounded to f32 for all its users, so that each node still has one error.

use super::{ErrorAnalysis, FloatFormat, Interval, NoCertificate};
use crate::expr::{Graph, NodeId, Op, Precision};
use crate::number::Scalar;

/// So often a choice is made.
const ATTEMPTS: usize = 6;

/// The program in a scalar with the [wider](Scalar::wider) one where the demanded bounds, one per result, need it; `stored`: nodes whose values
/// are handed on in the scalar. A program that needs none comes back as it is; if no choice meets the demand, the best one found.
///
/// # Errors
/// If a value may be no number in that box.
pub fn widened(
    graph: &Graph,
    scalar: Scalar,
    inputs: &[Interval],
    demand: &[f64],
    stored: &[NodeId],
) -> Result<Graph, NoCertificate> {
    let Some(wider) = scalar.wider() else { return Ok(graph.clone()) };
    let mut analysis = ErrorAnalysis::new(graph, FloatFormat::of(scalar));
    analysis.ranges(inputs)?;
    let mut results = Vec::new();
    for k in 0..analysis.results() {
        let node = analysis.result(k);
        let bounds = graph.results.iter().zip(demand).filter(|(r, _)| **r == node);
        let demand = bounds.fold(f64::INFINITY, |least, (_, d)| least.min(*d));
        let error = analysis.error(k);
        results.push(MixedOutcome { demand, error, shares: analysis.shares(k) });
    }
    if results.iter().all(|r| r.error <= r.demand) {
        return Ok(graph.clone());
    }
    let classes = Classes::new(graph, &analysis, stored);
    let (mut aim, mut best) = (1.0, (f64::INFINITY, graph.clone()));
    for _ in 0..ATTEMPTS {
        let wide = classes.choose(&results, aim);
        let candidate = Graph { formats: classes.formats(&wide, [scalar, wider]), ..graph.clone() };
        let mut analysis = ErrorAnalysis::new(&candidate, FloatFormat::of(scalar));
        analysis.ranges(inputs)?;
        let beyond = (0..analysis.results()).map(|k| analysis.error(k) / results[k].demand).fold(0.0, f64::max);
        if beyond < best.0 {
            best = (beyond, candidate);
        }
        if beyond <= 1.0 || wide.iter().zip(&classes.may).all(|(wide, may)| wide == may) {
            break;
        }
        aim /= 1.02 * beyond;
    }
    Ok(best.1)
}

/// How many operations of a program in this scalar are computed in the wider one.
pub fn wide_operations(graph: &Graph, scalar: Scalar) -> usize {
    let is_operation = |id: &NodeId| graph.op(*id).is_polynomial() && graph.op(*id).is_counted();
    graph.ids().filter(|id| graph.precision(*id, scalar).computed != scalar && is_operation(id)).count()
}

/// What a result may lose, what it loses in f32, and by which classes.
struct MixedOutcome {
    demand: f64,
    error: f64,
    shares: Vec<(NodeId, f64)>,
}

struct Classes<'g> {
    graph: &'g Graph,
    /// Per node, the node that stands for its class.
    class: Vec<usize>,
    /// Per class, its nodes that can be in f64.
    members: Vec<Vec<usize>>,
    /// Per node, whether it can.
    may: Vec<bool>,
    /// Per node, those that use it.
    users: Vec<Vec<usize>>,
    /// Per node, whether it is handed on in f32.
    stored: Vec<bool>,
    /// Per node, its rounding error in f32.
    error: Vec<f64>,
}

impl<'g> Classes<'g> {
    fn new(graph: &'g Graph, analysis: &ErrorAnalysis, stored_nodes: &[NodeId]) -> Self {
        let n = graph.ops.len();
        let live = graph.live();
        let mut users = vec![Vec::new(); n];
        let mut stored = vec![false; n];
        for id in graph.ids().filter(|id| live[id.index()]) {
            graph.op(id).operands().for_each(|a| users[a.index()].push(id.index()));
        }
        graph.results.iter().chain(stored_nodes).for_each(|id| stored[id.index()] = true);
        let can = |i: usize| live[i] && graph.ops[i].is_polynomial();
        let class: Vec<usize> = graph.ids().map(|id| analysis.class(id).index()).collect();
        let mut members = vec![Vec::new(); n];
        (0..n).filter(|i| can(*i)).for_each(|i| members[class[i]].push(i));
        let error = graph.ids().map(|id| analysis.rounding_error(id)).collect();
        Classes { graph, class, members, may: (0..n).map(can).collect(), users, stored, error }
    }

    fn is_wide(&self, i: usize, wide: &[bool]) -> bool {
        let kept = !self.stored[i] && !self.users[i].is_empty() && self.users[i].iter().all(|u| wide[*u]);
        kept && (wide[i] || matches!(self.graph.ops[i], Op::Constant(_)))
    }

    fn formats(&self, wide: &[bool], [scalar, wider]: [Scalar; 2]) -> Vec<Precision> {
        let format = |i: usize| match (self.is_wide(i, wide), wide[i]) {
            (true, _) => Precision::of(wider),
            (false, true) => Precision { computed: wider, held: scalar },
            (false, false) => Precision::of(scalar),
        };
        (0..wide.len()).map(format).collect()
    }

    /// Errors of each class, with these nodes in f64.
    fn errors(&self, wide: &[bool]) -> Vec<f64> {
        let mut errors = vec![0.0; self.class.len()];
        for i in (0..wide.len()).filter(|i| !self.is_wide(*i, wide)) {
            errors[self.class[i]] += self.error[i];
        }
        errors
    }

    /// The nodes to be in f64 so that each result keeps to `aim` times its demand, by the shares.
    fn choose(&self, results: &[MixedOutcome], aim: f64) -> Vec<bool> {
        let n = self.class.len();
        let mut wide = vec![false; n];
        let whole = self.errors(&wide);
        // per result, what an error of a class counts, and what all classes make together
        let weights: Vec<(Vec<f64>, f64)> = results
            .iter()
            .map(|r| {
                let total: f64 = r.shares.iter().map(|(_, share)| share).sum();
                let mut weight = vec![0.0; n];
                // vectors are bounded together: shares add up to more than the error
                r.shares.iter().for_each(|(c, share)| {
                    weight[c.index()] =
                        if whole[c.index()] > 0.0 { share / whole[c.index()] * r.error / total } else { 0.0 }
                });
                (weight, r.demand * aim)
            })
            .collect();
        let mut errors = whole;
        loop {
            let needs: Vec<f64> = weights
                .iter()
                .map(|(w, demand)| {
                    let error: f64 = w.iter().zip(&errors).map(|(w, e)| w * e).sum();
                    if error > *demand {
                        1.0 / demand
                    } else {
                        0.0
                    }
                })
                .collect();
            if needs.iter().all(|need| *need == 0.0) {
                return wide;
            }
            let worth: Vec<f64> =
                (0..n).map(|c| weights.iter().zip(&needs).map(|((w, _), need)| w[c] * need).sum()).collect();
            let mut best: Option<(f64, Vec<bool>)> = None;
            for members in self.members.iter().filter(|m| m.iter().any(|i| !wide[*i])) {
                let mut candidate = wide.clone();
                let cost = members.iter().filter(|i| !wide[**i]).count();
                members.iter().for_each(|i| candidate[*i] = true);
                // errors change at the members and at what they use
                let touched = members.iter().flat_map(|i| self.graph.ops[*i].operands().map(NodeId::index).chain([*i]));
                let mut touched: Vec<usize> = touched.collect();
                touched.sort_unstable();
                touched.dedup();
                let freed = touched.into_iter().filter(|i| self.is_wide(*i, &candidate) && !self.is_wide(*i, &wide));
                let gain: f64 = freed.map(|i| worth[self.class[i]] * self.error[i]).sum();
                let score = gain / cost as f64;
                if score > best.as_ref().map_or(0.0, |(most, _)| *most) {
                    best = Some((score, candidate));
                }
            }
            let Some((_, candidate)) = best else { return self.may.clone() };
            wide = candidate;
            errors = self.errors(&wide);
        }
    }
}
