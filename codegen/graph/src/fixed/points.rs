//! Binary points for all values of a program, and the bound of what it loses with them.
//!
//! A value can stand at any point up to its natural one, the greatest at which its range is a word. A product of values at the points f and g
//! comes at f + g − 32, for one instruction; everything else takes shifts. So points are chosen together: from the natural ones, one value or
//! one chain of sums after the other moves to where the program takes the fewest instructions, where an error counts as so many
//! instructions as its part in the errors of results is worth. How much that is follows from the error that is demanded: the cheapest program is
//! taken whose *certified* error meets it. On machines without long products the same choice says which halves of words a product can leave out.

use super::costs::{natural, Known, WordMachine};
use super::lower::{lowered, Lowered, Points};
use super::words::{Product, WordProgram};
use crate::certify::interval::Interval;
use crate::certify::{ErrorAnalysis, NoCertificate};
use crate::expr::{Binary, Graph, NodeId, Op, Unary};
use straightline_core::random::Random;

/// So often ranges and points are found anew, from each other.
const ROUNDS: usize = 6;
/// So often all values are looked at.
const SWEEPS: usize = 12;
/// So many moves of several values are tried per value.
const TRIES: usize = 60;
/// At first moves are made that cost about so many instructions.
const HEAT: f64 = 1.5;
/// So many values move together at most.
const MOST_STEPS: usize = 60;
/// So many weights of errors are tried.
const WEIGHTS: i32 = 12;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedDemand {
    /// Whether the machine has the high half of a product of 32 bits in one instruction.
    pub wide: bool,
    /// The greatest error of a result, as a part of the greatest magnitude in its port.
    pub error: f64,
}

/// A program in fixed point.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedProgram {
    /// Its operations.
    pub words: WordProgram,
    /// The binary point of each input port.
    pub input_bits: Vec<i32>,
    /// The binary point of each output port.
    pub output_bits: Vec<i32>,
    /// Per result, |computed − exact| at most, the conversion of inputs included.
    pub errors: Vec<f64>,
    /// Per result, its greatest magnitude.
    pub magnitudes: Vec<f64>,
    /// Per word, the node of the graph that it is computed for.
    pub node: Vec<NodeId>,
}

/// Why a program has no form in fixed point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoFixedForm {
    /// It has an operation that words do not have.
    Operation(&'static str),
    /// A value has no bound over the box.
    Ranges(NoCertificate),
    /// An angle is too far from zero.
    Angle,
    /// The least error that was reached, as [`FixedDemand::error`].
    Error(f64),
}

impl FixedProgram {
    /// The words of inputs, rounded to nearest.
    pub fn words_of(&self, inputs: &[f64]) -> Vec<i32> {
        let bits = self.words.inputs.iter().zip(&self.input_bits).flat_map(|(p, bits)| vec![*bits; p.len()]);
        inputs.iter().zip(bits).map(|(x, bits)| (x * 2f64.powi(bits)).round_ties_even() as i32).collect()
    }

    /// The numbers that result words stand for.
    pub fn numbers_of(&self, results: &[i32]) -> Vec<f64> {
        let bits = self.words.outputs.iter().zip(&self.output_bits).flat_map(|(p, bits)| vec![*bits; p.len()]);
        results.iter().zip(bits).map(|(x, bits)| f64::from(*x) * 2f64.powi(-bits)).collect()
    }

    /// The greatest error, as a part of the greatest magnitude in its port.
    pub fn worst(&self) -> f64 {
        relative(&self.words.outputs, &self.errors, &self.magnitudes)
    }
}

/// The greatest of errors, as a part of the greatest magnitude in its port.
fn relative(outputs: &[crate::expr::Port], errors: &[f64], magnitudes: &[f64]) -> f64 {
    let (mut first, mut worst) = (0, 0f64);
    for port in outputs {
        let own = first..first + port.len();
        first = own.end;
        let scale = magnitudes[own.clone()].iter().copied().fold(0.0, f64::max);
        let error = errors[own].iter().copied().fold(0.0, f64::max);
        if error > 0.0 {
            worst = worst.max(error / scale);
        }
    }
    worst
}

/// The program in words whose certified error over a box of inputs meets a demand, in the fewest instructions.
///
/// # Errors
/// Why there is none.
pub fn fixed(graph: &Graph, inputs: &[Interval], demand: FixedDemand) -> Result<FixedProgram, NoFixedForm> {
    refuse_operations(graph)?;
    // the cheapest sines that serve
    let sines: &[Product] = if demand.wide { &[Product::Wide] } else { &[Product::Full, Product::Exact] };
    let mut found = Err(NoFixedForm::Angle);
    for sines in sines {
        found = with_sines(graph, inputs, demand, *sines);
        if !matches!(found, Err(NoFixedForm::Error(_))) {
            break;
        }
    }
    found
}

fn with_sines(
    graph: &Graph,
    inputs: &[Interval],
    demand: FixedDemand,
    sines: Product,
) -> Result<FixedProgram, NoFixedForm> {
    let mut search = PointSearch::new(graph, inputs, demand, sines)?;
    let finest = search.program(2f64.powi(WEIGHTS))?;
    if finest.worst() > demand.error {
        return Err(NoFixedForm::Error(finest.worst()));
    }
    let mut best = finest;
    // bisection over powers of two, from the weight that gives the least error
    let (mut low, mut high) = (-3 * WEIGHTS, WEIGHTS);
    while high - low > 1 {
        let middle = (low + high).div_euclid(2);
        match search.program(2f64.powi(middle)) {
            Ok(candidate) if candidate.worst() <= demand.error => {
                high = middle;
                best = candidate;
            }
            // where errors count little, ranges may grow without end
            _ => low = middle,
        }
    }
    Ok(best)
}

fn refuse_operations(graph: &Graph) -> Result<(), NoFixedForm> {
    let live = graph.live();
    for id in graph.ids().filter(|id| live[id.index()]) {
        match graph.op(id) {
            Op::Binary(Binary::Div, ..) => return Err(NoFixedForm::Operation("divides")),
            Op::Unary(Unary::Sqrt, _) => return Err(NoFixedForm::Operation("takes roots")),
            Op::Unary(Unary::Sign, _) => return Err(NoFixedForm::Operation("asks for signs")),
            _ => {}
        }
    }
    Ok(())
}

struct PointSearch<'g> {
    known: Known<'g>,
    box_of_inputs: &'g [Interval],
    /// Of computed values.
    ranges: Vec<Interval>,
    /// Per node, how much an error of it moves a result, as a part of the greatest magnitude in its port.
    sensitivity: Vec<f64>,
    users: Vec<Vec<NodeId>>,
    /// Nodes whose points are free.
    free: Vec<NodeId>,
    /// Per node, the output ports that it goes to.
    ports: Vec<Vec<usize>>,
    live: Vec<bool>,
    error: f64,
}

impl<'g> PointSearch<'g> {
    fn new(graph: &'g Graph, inputs: &'g [Interval], demand: FixedDemand, sines: Product) -> Result<Self, NoFixedForm> {
        let live = graph.live();
        let mut users = vec![Vec::new(); graph.ops.len()];
        for id in graph.ids().filter(|id| live[id.index()]) {
            let mut operands: Vec<NodeId> = graph.op(id).operands().collect();
            operands.dedup();
            operands.into_iter().for_each(|a| users[a.index()].push(id));
        }
        let is_free = |id: &NodeId| matches!(graph.op(*id), Op::Unary(..) | Op::Binary(..)) && live[id.index()];
        let free: Vec<NodeId> = graph.ids().filter(is_free).collect();
        let mut ports = vec![Vec::new(); graph.ops.len()];
        let of_results = graph.outputs.iter().enumerate().flat_map(|(k, port)| vec![k; port.len()]);
        graph.results.iter().zip(of_results).for_each(|(r, port)| ports[r.index()].push(port));
        let machine = WordMachine { wide: demand.wide, sines };
        let known = Known { graph, machine, magnitude: Vec::new(), natural: Vec::new() };
        let mut search = PointSearch {
            known,
            box_of_inputs: inputs,
            ranges: Vec::new(),
            sensitivity: vec![0.0; graph.ops.len()],
            users,
            free,
            ports,
            live,
            error: demand.error,
        };
        let exact = search.analysed(vec![0.0; graph.ops.len()])?;
        search.take_ranges(&exact);
        search.weigh(exact);
        Ok(search)
    }

    /// The analysis of the graph with these local errors.
    fn analysed(&self, errors: Vec<f64>) -> Result<ErrorAnalysis<'g>, NoFixedForm> {
        let mut analysis = ErrorAnalysis::with_errors(self.known.graph, errors);
        analysis.ranges(self.box_of_inputs).map_err(NoFixedForm::Ranges)?;
        Ok(analysis)
    }

    fn take_ranges(&mut self, analysis: &ErrorAnalysis) {
        let graph = self.known.graph;
        self.ranges = graph.ids().map(|id| analysis.range(id)).collect();
        self.known.magnitude = self.ranges.iter().map(|r| r.mag()).collect();
        self.known.natural = self.known.magnitude.iter().map(|m| natural(*m)).collect();
        for id in graph.ids().filter(|id| matches!(graph.op(*id), Op::Sin(_) | Op::Cos(_))) {
            // computed ones are less than 1: `straightline_core::fixed`
            self.known.natural[id.index()] = 31;
        }
    }

    fn weigh(&mut self, mut analysis: ErrorAnalysis) {
        let graph = self.known.graph;
        let scales = self.scales();
        for k in 0..analysis.results() {
            let node = analysis.result(k);
            let of = graph.results.iter().zip(&scales).filter(|(r, _)| **r == node);
            let scale = of.fold(f64::INFINITY, |least, (_, scale)| least.min(*scale));
            let moves = analysis.sensitivities(k);
            for id in graph.ids().filter(|_| scale > 0.0) {
                let own = moves[analysis.class(id).index()] / scale;
                let all = &mut self.sensitivity[id.index()];
                *all = all.max(own);
            }
        }
    }

    /// Per result, the greatest magnitude in its port.
    fn scales(&self) -> Vec<f64> {
        let graph = self.known.graph;
        let mut results = graph.results.iter();
        let of_port = |port: &crate::expr::Port| {
            let own: Vec<f64> = results.by_ref().take(port.len()).map(|r| self.known.magnitude[r.index()]).collect();
            let most = own.iter().copied().fold(0.0, f64::max);
            vec![most; own.len()]
        };
        graph.outputs.iter().flat_map(of_port).collect()
    }

    /// The program of a choice in which errors count so much.
    fn program(&mut self, weight: f64) -> Result<FixedProgram, NoFixedForm> {
        for _ in 0..ROUNDS {
            let points = self.points(weight);
            let Some(lowered) = lowered(&self.known, &points, &self.ranges) else { return Err(NoFixedForm::Angle) };
            let mut analysis = self.analysed(lowered.errors.clone())?;
            let fits = |id: &NodeId| {
                let is_sine = matches!(self.known.graph.op(*id), Op::Sin(_) | Op::Cos(_));
                let is_word = !matches!(self.known.graph.op(*id), Op::Constant(_) | Op::AngleSum(..) | Op::SinCos(_));
                !self.live[id.index()]
                    || is_sine
                    || !is_word
                    || natural(analysis.range(*id).mag()) >= lowered.greatest_point[id.index()]
            };
            if self.known.graph.ids().all(|id| fits(&id)) {
                return Ok(self.certified(&mut analysis, lowered, &points));
            }
            // what errors add to ranges
            self.take_ranges(&analysis);
        }
        Err(NoFixedForm::Ranges(NoCertificate::Overflow))
    }

    fn certified(&self, analysis: &mut ErrorAnalysis, lowered: Lowered, points: &Points) -> FixedProgram {
        let bounds: Vec<(NodeId, f64)> =
            (0..analysis.results()).map(|k| (analysis.result(k), analysis.error(k))).collect();
        let of = |r: &NodeId| bounds.iter().find(|(node, _)| node == r).expect("every result has a bound").1;
        let results = &self.known.graph.results;
        let errors = results.iter().zip(&lowered.of_results).map(|(r, own)| (of(r) + own) * (1.0 + 1e-9));
        FixedProgram {
            errors: errors.collect(),
            magnitudes: results.iter().map(|r| analysis.range(*r).mag()).collect(),
            input_bits: points.inputs.clone(),
            output_bits: points.outputs.clone(),
            words: lowered.program,
            node: lowered.node,
        }
    }

    /// Points of least cost, where an error of all that is demanded costs `weight` instructions per value.
    fn points(&self, weight: f64) -> Points {
        let graph = self.known.graph;
        let worth = weight / self.error;
        let natural = &self.known.natural;
        let mut points = Points {
            of: natural.clone(),
            weight: self.sensitivity.iter().map(|s| s * worth).collect(),
            inputs: Vec::new(),
            outputs: Vec::new(),
        };
        // of a port all alike
        let mut first = 0;
        for port in &graph.inputs {
            let own = first as u32..(first + port.len()) as u32;
            first = own.end as usize;
            let of = |id: &NodeId| matches!(graph.op(*id), Op::Input(k) if own.contains(&k)) && self.live[id.index()];
            let bits = graph.ids().filter(of).map(|id| natural[id.index()]).min().unwrap_or(0).min(31);
            points.inputs.push(bits);
            graph.ids().filter(of).for_each(|id| points.of[id.index()] = bits);
        }
        let mut results = graph.results.iter();
        for port in &graph.outputs {
            let bits = results.by_ref().take(port.len()).map(|r| match graph.op(*r) {
                Op::Constant(c) => super::costs::natural(c.value().to_f64().abs()),
                _ => natural[r.index()],
            });
            points.outputs.push(bits.min().unwrap_or(0).min(31));
        }
        self.first_points(&mut points);
        if !self.free.is_empty() {
            self.anneal(&mut points);
        }
        for _ in 0..SWEEPS {
            if !self.sweep(&mut points) {
                break;
            }
        }
        points
    }

    /// Points that fit, forwards: products where they come, sums at the coarsest of their operands.
    fn first_points(&self, points: &mut Points) {
        let graph = self.known.graph;
        for id in &self.free {
            let i = id.index();
            let of = |a: NodeId| match graph.op(a) {
                Op::Constant(_) => None,
                _ => Some(points.of[a.index()]),
            };
            let most = match graph.op(*id) {
                Op::Binary(Binary::Add | Binary::Sub, a, b) => {
                    [a, b].into_iter().filter_map(of).min().unwrap_or(points.of[i])
                }
                Op::Binary(Binary::Mul, a, b) => match (of(a), of(b)) {
                    (Some(a), Some(b)) => a + b - 32,
                    _ => points.of[i],
                },
                _ => points.of[i],
            };
            let most = most.min(points.of[i]);
            let fits = |bits: &i32| self.known.best(*id, *bits, &points.of, 0.0).is_some();
            points.of[i] = (most - 40..=most).rev().find(fits).unwrap_or(most);
        }
    }

    /// Cost and error of a node at the points at hand, what its use as a result costs included.
    fn price(&self, id: NodeId, points: &Points) -> f64 {
        let weight = points.weight[id.index()];
        let Some(own) = self.known.best(id, points.of[id.index()], &points.of, weight) else { return f64::INFINITY };
        let mut sum = own.cost + weight * own.error;
        for port in &self.ports[id.index()] {
            match self.known.aligned(id, points.outputs[*port], &points.of) {
                Some((_, cost, error)) => sum += cost + weight * error,
                None => return f64::INFINITY,
            }
        }
        sum
    }

    /// Moves single values to where they and their users cost least; whether any was moved.
    fn sweep(&self, points: &mut Points) -> bool {
        let mut moved = false;
        for id in self.free.iter().rev().chain(&self.free) {
            let mut best = (0.0, 0);
            for by in [-6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6] {
                let gain = self.gain(&[(*id, by)], points);
                if gain > best.0 + 1e-9 {
                    best = (gain, by);
                }
            }
            points.of[id.index()] += best.1;
            moved |= best.1 != 0;
        }
        moved
    }

    /// What it saves to move these values, a step each.
    fn gain(&self, steps: &[(NodeId, i32)], points: &mut Points) -> f64 {
        let mut touched: Vec<NodeId> = steps.iter().map(|(id, _)| *id).collect();
        touched.extend(steps.iter().flat_map(|(id, _)| self.users[id.index()].iter().copied()));
        touched.sort_unstable();
        touched.dedup();
        let price = |points: &Points| touched.iter().map(|id| self.price(*id, points)).sum::<f64>();
        let before = price(points);
        steps.iter().for_each(|(id, by)| points.of[id.index()] += by);
        let after = price(points);
        steps.iter().for_each(|(id, by)| points.of[id.index()] -= by);
        before - after
    }

    /// Moves values together that stand aligned, as far as chance says; ever less against the gain.
    fn anneal(&self, points: &mut Points) {
        let mut random = Random(1);
        let tries = TRIES * self.free.len();
        for k in 0..tries {
            let heat = HEAT * (1.0 - k as f64 / tries as f64);
            let seed = self.free[random.below(self.free.len())];
            let by = [-2, -1, 1, 2][random.below(4)];
            let follow = [0.0, 0.5, 0.9, 1.0][random.below(4)];
            let steps = self.region(seed, by, follow, points, &mut random);
            let gain = self.gain(&steps, points);
            if gain > 0.0 || gain > heat * random.unit().max(1e-12).ln() {
                steps.iter().for_each(|(id, by)| points.of[id.index()] += by);
            }
        }
    }

    /// A value and, with this chance each, those that have to move along so that what is aligned stays so.
    fn region(&self, seed: NodeId, by: i32, follow: f64, points: &Points, random: &mut Random) -> Vec<(NodeId, i32)> {
        let graph = self.known.graph;
        let is_free = |id: NodeId| matches!(graph.op(id), Op::Unary(..) | Op::Binary(..));
        let mut steps = vec![(seed, by)];
        let mut next = 0;
        while next < steps.len() && steps.len() < MOST_STEPS {
            let (id, _) = steps[next];
            next += 1;
            let around = self.users[id.index()].iter().copied().chain([id]);
            for user in around.filter(|user| is_free(*user)) {
                let step = |id: NodeId| steps.iter().find(|(other, _)| *other == id).map(|(_, by)| *by);
                let wanted = match graph.op(user) {
                    Op::Binary(Binary::Mul, a, b) if !self.is_constant(a) && !self.is_constant(b) => {
                        let [of_a, of_b, own] = [a, b, user].map(|id| points.of[id.index()]);
                        if of_a + of_b - 32 != own {
                            continue;
                        }
                        match (step(a), step(b), step(user)) {
                            (of_a, of_b, None) => Some((user, of_a.unwrap_or(0) + of_b.unwrap_or(0))),
                            (None, of_b, Some(own)) if is_free(a) && (random.unit() < 0.5 || !is_free(b)) => {
                                Some((a, own - of_b.unwrap_or(0)))
                            }
                            (of_a, None, Some(own)) if is_free(b) => Some((b, own - of_a.unwrap_or(0))),
                            _ => None,
                        }
                    }
                    // the constant moves
                    Op::Binary(Binary::Mul, ..) => None,
                    op => {
                        let own = points.of[user.index()];
                        let aligned: Vec<NodeId> = op
                            .operands()
                            .filter(|a| is_free(*a) && points.of[a.index()] == own)
                            .chain([user])
                            .collect();
                        let by = aligned.iter().find_map(|id| step(*id));
                        by.and_then(|by| Some((*aligned.iter().find(|id| step(**id).is_none())?, by)))
                    }
                };
                if let Some((id, by)) = wanted.filter(|(_, by)| *by != 0) {
                    if random.unit() < follow {
                        steps.push((id, by));
                    }
                }
            }
        }
        steps
    }

    fn is_constant(&self, id: NodeId) -> bool {
        matches!(self.known.graph.op(id), Op::Constant(_))
    }
}
