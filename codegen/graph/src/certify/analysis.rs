//! Ranges of all values over a box of inputs, and the error of each result.

use super::format::Format;
use super::forms::{Atom, Coefficient, Forms, Term};
use super::interval::{add_up, mul_up, Interval};
use super::norms::{Bounded, Factor, GroupId, Groups};
use super::tape::{Bound, Norm, Pen, Range, Tape};
use crate::expr::op::Slope;
use crate::expr::{Binary, Graph, NodeId, Op, Precision, Unary};
use crate::number::Scalar;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// What is known of a program for forward dynamics, beyond what its operations say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Known {
    /// Ranges of exact values.
    pub values: Vec<(NodeId, Interval)>,
    /// Of a result and a value: the exact adjoint is at most so much.
    pub adjoints: Vec<(NodeId, NodeId, f64)>,
}

/// A graph that is being analysed in a format; what does not depend on the box is found once.
pub struct Analysis<'g> {
    graph: &'g Graph,
    format: Format,
    forms: Forms,
    groups: Groups,
    /// Per node, the form of a sum with its groups.
    sums: Vec<Option<Bounded>>,
    /// Per node, the form of a sum in which products have cancelled.
    cancelled: Vec<Option<Bounded>>,
    /// Per node, the group of the factors of a product.
    products: Vec<Option<GroupId>>,
    /// Per node, its adjoint by the chain rule, and taken apart if that has groups.
    adjoint_sums: Vec<Option<(Bounded, Option<Bounded>)>>,
    /// Errors that share an adjoint, and adjoints that share a norm.
    sharing: Sharing,
    /// Nodes that each result needs, users first.
    cones: Vec<(NodeId, Vec<u32>)>,
    state: State,
    /// Per node, what is known of its exact value.
    known: Vec<Option<Interval>>,
    /// Of a result and a node, at most so much is the exact adjoint.
    known_adjoints: FxHashMap<(u32, u32), f64>,
    /// A rule that is wrong on purpose: tests must notice.
    #[cfg(test)]
    pub(super) broken: Option<Broken>,
}

/// What can be wrong with an analysis, for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(not(test), allow(dead_code))]
pub(super) enum Broken {
    /// Constants count as exact.
    Constants,
    /// A turn shrinks.
    Turn,
    /// What is left of a sum in which products cancel counts less than once.
    Cancelled,
    /// One term of the chain rule is forgotten.
    ChainRule,
    /// Errors of a vector count once.
    Team,
    /// Of two halves of a part one is forgotten.
    Part,
    /// Half a turn counts as a whole one.
    HalfTurn,
}

/// Numbers of one box, and of one result.
#[derive(Clone, Default)]
struct State {
    /// Values, rounding included.
    value: Vec<Range>,
    /// Greatest rounding error of each node.
    error: Vec<Bound>,
    /// How far each value may be from the exact one.
    total_error: Vec<Bound>,
    /// Errors of roundings, of all nodes that share an adjoint, at the node that stands for them.
    class_error: Vec<Bound>,
    /// Exact and computed sine and cosine of each pair.
    sin_cos: Vec<[(Range, Range); 2]>,
    /// Adjoints for the result at hand.
    adjoint: Vec<Range>,
    /// How far they may be from those of the exact program; found where something is known of these.
    adjoint_off: Vec<Bound>,
    seed: u32,
    /// Norms of groups, with the round in which they were found; the first is 1.
    norm: Vec<(u64, Bound)>,
    box_round: u64,
    result_round: u64,
    round: u64,
    /// What all of them are computed by.
    pen: Pen,
}

/// Why a result has no certificate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An input has no range, as the inertial parameters of a payload that is an input.
    Unlimited,
    /// A divisor, or what stands under a root, may vanish in the box.
    Division,
    /// The sign of a computed value may be wrong.
    Sign,
    /// A value may exceed the format, or an angle the domain of sine and cosine.
    Overflow,
}

impl Refusal {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Refusal::Unlimited => "an input has no range",
            Refusal::Division => "a divisor or the argument of a root may vanish",
            Refusal::Sign => "the sign of a computed value may be wrong",
            Refusal::Overflow => "a value may overflow, or an angle leave the domain of sine and cosine",
        }
    }
}

/// Ways to bound a norm stay if they come so near to the best one where they are first tried.
const WORTHWHILE: f64 = 1.5;

impl<'g> Analysis<'g> {
    /// Reads a graph.
    pub fn new(graph: &'g Graph, format: Format) -> Self {
        let live = graph.live();
        let forms = Forms::new(graph, &live, &format);
        let mut groups = Groups::default();
        let mut sums = vec![None; graph.ops.len()];
        let mut cancelled = vec![None; graph.ops.len()];
        let mut products = vec![None; graph.ops.len()];
        let mut adjoint_sums = vec![None; graph.ops.len()];
        let sharing = Sharing::new(graph, &live, &forms, &mut groups);
        let is_plain = |id: NodeId| !matches!(graph.op(id), Op::Constant(_) | Op::Sin(_) | Op::Cos(_) | Op::Input(_));
        let one = |id: NodeId| Term { coefficient: Coefficient::One, atom: Atom::Value(id.0), negative: false };
        for id in graph.ids().filter(|id| live[id.index()]) {
            let i = id.index();
            match graph.op(id) {
                Op::Binary(Binary::Add | Binary::Sub, ..) => {
                    let (form, _) = forms.flat(Atom::Value(id.0));
                    sums[i] = Some(groups.bounded(form.to_vec()));
                    cancelled[i] = forms.cancelled(id.0).map(|form| groups.bounded(form.to_vec()));
                }
                Op::Binary(Binary::Mul, a, b) if a != b && is_plain(a) && is_plain(b) => {
                    products[i] = Some(groups.group([vec![one(a)], vec![one(b)]]));
                }
                _ => {}
            }
            let form = forms.flat(Atom::Adjoint(id.0)).0.to_vec();
            let (chain, apart) = (groups.bounded(forms.chain[i].clone()), groups.bounded(form));
            adjoint_sums[i] = Some((chain, Some(apart).filter(|a| !a.is_plain())));
        }
        let mut results: Vec<NodeId> = graph.results.clone();
        results.sort_unstable();
        results.dedup();
        let cones = results.into_iter().map(|r| (r, cone(graph, r))).collect();
        let n = graph.ops.len();
        let state = State {
            value: vec![Range::ZERO; n],
            error: vec![Bound::ZERO; n],
            total_error: vec![Bound::ZERO; n],
            sin_cos: vec![[(Range::ZERO, Range::ZERO); 2]; n],
            adjoint: vec![Range::ZERO; n],
            adjoint_off: vec![Bound::ZERO; n],
            ..State::default()
        };
        Analysis {
            graph,
            format,
            forms,
            groups,
            sums,
            cancelled,
            products,
            adjoint_sums,
            sharing,
            cones,
            state,
            known: Vec::new(),
            known_adjoints: FxHashMap::default(),
            #[cfg(test)]
            broken: None,
        }
    }

    /// What is known of exact values and adjoints, wherever it is known from.
    pub(super) fn know(&mut self, known: &Known) {
        self.known.resize(self.graph.ops.len(), None);
        for (id, range) in &known.values {
            let at = &mut self.known[id.index()];
            *at = Some(at.map_or(*range, |before| before.intersect(*range)));
        }
        for (result, id, most) in &known.adjoints {
            let at = self.known_adjoints.entry((result.0, id.0)).or_insert(*most);
            *at = at.min(*most);
        }
    }

    #[cfg(test)]
    pub(super) fn is_broken(&self, what: Broken) -> bool {
        self.broken == Some(what)
    }

    #[cfg(not(test))]
    pub(super) fn is_broken(&self, _what: Broken) -> bool {
        false
    }

    /// Ranges of all values for inputs in a box, and the greatest error of each rounding.
    ///
    /// # Errors
    /// If a value can be no number.
    pub fn ranges(&mut self, inputs: &[Interval]) -> Result<(), Refusal> {
        self.find_ranges(inputs, false)
    }

    /// The same, and all that is computed is written down, for [`Analysis::error_and_tape`].
    pub(super) fn ranges_on_tape(&mut self, inputs: &[Interval]) -> Result<(), Refusal> {
        self.find_ranges(inputs, true)
    }

    fn find_ranges(&mut self, inputs: &[Interval], writes: bool) -> Result<(), Refusal> {
        self.state.pen.start(writes);
        self.state.round += 1;
        self.state.box_round = self.state.round;
        for i in 0..self.graph.ops.len() {
            let (exact, error) = self.exact_range(i, inputs)?;
            let is_constant = matches!(self.graph.ops[i], Op::Constant(_));
            let mut range = if is_constant { exact } else { self.state.pen.widened(exact, error) };
            let carried = self.carried_error(i);
            self.state.total_error[i] = self.state.pen.add_up(carried, error);
            if let Some(form) = self.cancelled[i].take() {
                let mut exact = self.enclosure(&form);
                if self.is_broken(Broken::Cancelled) {
                    let less = self.state.pen.number(0.4 * exact.x.mag());
                    exact = self.state.pen.clipped(exact, less);
                }
                let computed = self.state.pen.widened(exact, self.state.total_error[i]);
                range = self.state.pen.intersect(range, computed);
                self.cancelled[i] = Some(form);
            }
            if let Some(Some(exact)) = self.known.get(i) {
                let pen = &mut self.state.pen;
                let exact = pen.constant(*exact);
                let computed = pen.widened(exact, self.state.total_error[i]);
                range = pen.intersect(range, computed);
            }
            if range.x.mag().is_nan() || range.x.mag() >= self.format.largest {
                return Err(Refusal::Overflow);
            }
            self.state.value[i] = range;
            self.state.error[i] = error;
        }
        self.class_errors();
        Ok(())
    }

    /// How far the errors of its operands take a value from the exact one. Ranges hold both.
    fn carried_error(&mut self, i: usize) -> Bound {
        let State { total_error, value, pen, .. } = &mut self.state;
        let error = |a: NodeId| total_error[a.index()];
        let value = |a: NodeId| value[a.index()];
        match self.graph.ops[i] {
            Op::Input(_) | Op::Constant(_) => Bound::ZERO,
            Op::SinCos(a) | Op::Sin(a) | Op::Cos(a) => error(a),
            Op::AngleSum(a, b) => pen.add_up(error(a), error(b)),
            // |â/b̂ − a/b| ≤ (|â − a| + |a/b| |b̂ − b|) / |b̂|
            Op::Binary(Binary::Div, a, b) => {
                let quotient = pen.over(value(a), value(b));
                let quotient = pen.mag(quotient);
                let shifted = pen.mul_up(quotient, error(b));
                let sum = pen.add_up(error(a), shifted);
                let reciprocal = pen.over(Range::ONE, value(b));
                let reciprocal = pen.mag(reciprocal);
                pen.mul_up(sum, reciprocal)
            }
            Op::Unary(op, a) => {
                carried(pen, op.row().slopes[0], error(a), [value(a); 2], &|pen| pen.unary(op, value(a)))
            }
            Op::Binary(op, a, b) => {
                let v = |pen: &mut Pen| pen.binary(op, value(a), value(b));
                let of_a = carried(pen, op.row().slopes[0], error(a), [value(a), value(b)], &v);
                let of_b = carried(pen, op.row().slopes[1], error(b), [value(b), value(a)], &v);
                pen.add_up(of_a, of_b)
            }
        }
    }

    /// The errors of all nodes that share an adjoint, added up.
    fn class_errors(&mut self) {
        let mut class_error = vec![Bound::ZERO; self.graph.ops.len()];
        let mut error = self.state.error.clone();
        for k in 0..self.sharing.products.len() {
            // |x c| + |y s| ≤ ‖(x, y)‖ ‖(c, s)‖, each product rounded by u of itself at most
            let (a, b, pair, group) = self.sharing.products[k];
            let norm = self.norm(group);
            let (stretch, unit) = (self.stretch(pair), self.unit(a, b));
            let pen = &mut self.state.pen;
            let (stretch, unit, least) = (pen.number(stretch), pen.number(unit), pen.number(4.0 * self.format.tiny));
            let norm = pen.mul_up(stretch, norm);
            let rounding = pen.mul_up(unit, norm);
            let together = pen.add_up(rounding, least);
            let apart = pen.add_up(error[a], error[b]);
            if together.x < apart.x {
                (error[a], error[b]) = (pen.least(together, apart), Bound::ZERO);
            }
        }
        for (i, e) in error.into_iter().enumerate().filter(|(_, e)| e.x > 0.0) {
            let class = self.sharing.class[i];
            class_error[class] = self.state.pen.add_up(class_error[class], e);
        }
        self.state.class_error = class_error;
    }

    /// What rounding node i to its formats can do.
    fn rounding(&mut self, i: usize, range: Range) -> Bound {
        let Precision { computed, held } = self.precision(i);
        let own = self.format;
        let pen = &mut self.state.pen;
        let magnitude = pen.mag(range);
        let mut to = |scalar: Scalar| {
            let format = format_of(own, scalar);
            pen.rounding(magnitude, format.rounding(magnitude.x), 0.5 * format.u, format.tiny)
        };
        let handed_on = to(held);
        if computed == held {
            return handed_on;
        }
        let before = to(computed);
        pen.add_up(handed_on, before)
    }

    /// u of two values that are bounded together.
    fn unit(&self, a: usize, b: usize) -> f64 {
        let [x, y] = [a, b].map(|i| self.precision(i));
        let u = |scalar: Scalar| format_of(self.format, scalar).u;
        if x == y && !x.is_rounded() {
            return u(x.held);
        }
        add_up(self.format.u, u(self.graph.widest(self.format.scalar)))
    }

    fn precision(&self, i: usize) -> Precision {
        self.graph.precision(NodeId(i as u32), self.format.scalar)
    }

    /// What the errors of a node's class are worth for the result of [`Analysis::error`] at hand: the node that stands for the class,
    /// and its greatest adjoint times its errors.
    pub fn shares(&mut self, cone: usize) -> Vec<(NodeId, f64)> {
        self.adjoints(cone);
        let nodes = std::mem::take(&mut self.cones[cone].1);
        let state = &self.state;
        let share = |n: &u32| mul_up(state.adjoint[*n as usize].x.mag(), state.class_error[*n as usize].x);
        let shares = nodes.iter().map(|n| (NodeId(*n), share(n))).filter(|(_, share)| *share > 0.0).collect();
        for &n in &nodes {
            self.state.adjoint[n as usize] = Range::ZERO;
        }
        self.cones[cone].1 = nodes;
        shares
    }

    /// The node that stands for all with the adjoint of a node, up to the sign.
    pub fn class(&self, id: NodeId) -> NodeId {
        NodeId(self.sharing.class[id.index()] as u32)
    }

    /// The greatest rounding error of a node.
    pub fn rounding_error(&self, id: NodeId) -> f64 {
        self.state.error[id.index()].x
    }

    /// The range of an operation on computed operands, before its own rounding, and the bound of that.
    fn exact_range(&mut self, i: usize, inputs: &[Interval]) -> Result<(Range, Bound), Refusal> {
        let format = self.format;
        let v = |this: &Self, a: NodeId| this.state.value[a.index()];
        let rounded = |this: &mut Self, x: Range| Ok((x, this.rounding(i, x)));
        Ok(match self.graph.ops[i] {
            Op::Input(k) => {
                let x = inputs[k as usize];
                // a number below the normal ones may be read as zero
                let subnormal = x.lo < format.tiny && x.hi > -format.tiny && !x.is_zero();
                let error = if subnormal { format.tiny } else { 0.0 };
                (self.state.pen.input(k, x), self.state.pen.number(error))
            }
            Op::Constant(c) => {
                // the range holds both the exact and the rounded value
                let format = format_of(format, self.precision(i).held);
                let (range, error) = format.constant(c.value());
                let error = if self.is_broken(Broken::Constants) { 0.0 } else { error };
                (self.state.pen.constant(range), self.state.pen.number(error))
            }
            Op::Unary(Unary::Sign, a) => {
                let sign = v(self, a).x.sign();
                if sign.has_zero() && !matches!(self.graph.op(a), Op::Input(_)) {
                    return Err(Refusal::Sign);
                }
                (self.state.pen.constant(sign), Bound::ZERO)
            }
            Op::Unary(op, a) => {
                if op == Unary::Sqrt && v(self, a).x.lo <= 0.0 {
                    return Err(Refusal::Division);
                }
                let value = self.state.pen.unary(op, v(self, a));
                if !op.row().is_exact {
                    return rounded(self, value);
                }
                if !self.precision(i).is_rounded() {
                    return Ok((value, Bound::ZERO));
                }
                let magnitude = self.state.pen.mag(value);
                let error = format.rounding(magnitude.x);
                (value, self.state.pen.rounding(magnitude, error, 0.5 * format.u, format.tiny))
            }
            Op::Binary(op, a, b) => {
                if op == Binary::Div && v(self, b).x.has_zero() {
                    return Err(Refusal::Division);
                }
                if op == Binary::Mul && a == b {
                    let square = self.state.pen.square(v(self, a));
                    return rounded(self, square);
                }
                let mut value = self.state.pen.binary(op, v(self, a), v(self, b));
                if self.sums[i].is_some() {
                    value = self.sum(i, value);
                }
                if let Some(group) = self.products[i] {
                    // |a b| ≤ (a² + b²)/2
                    let norm = self.norm(group);
                    let half = self.state.pen.number(0.5);
                    let square = self.state.pen.mul_up(norm, norm);
                    let most = self.state.pen.mul_up(half, square);
                    value = self.state.pen.clipped(value, most);
                }
                let is_single = self.precision(i) == Precision::of(format.scalar);
                let is_shift = op == Binary::Mul && is_single && (self.is_power_of_two(a) || self.is_power_of_two(b));
                match (is_shift, op.row().is_exact) {
                    (true, _) => (value, self.state.pen.number(format.tiny)),
                    (false, true) => (value, Bound::ZERO),
                    (false, false) => return rounded(self, value),
                }
            }
            // formed exactly: what rounding loses goes into the reduction
            Op::AngleSum(a, b) => (self.state.pen.add(v(self, a), v(self, b)), Bound::ZERO),
            Op::SinCos(a) => {
                let angle = v(self, a);
                if angle.x.mag() > format.trig_domain {
                    return Err(Refusal::Overflow);
                }
                let pen = &mut self.state.pen;
                let (sin, cos) = pen.sin_cos(angle);
                let e = pen.number(format.trig_error(1.0));
                self.state.sin_cos[i] = [(sin, cos), (pen.widened(sin, e), pen.widened(cos, e))];
                (angle, Bound::ZERO)
            }
            Op::Sin(p) => self.half(self.state.sin_cos[p.index()][0].0),
            Op::Cos(p) => self.half(self.state.sin_cos[p.index()][0].1),
        })
    }

    /// A sine or cosine, and its error.
    fn half(&mut self, exact: Range) -> (Range, Bound) {
        let magnitude = self.state.pen.mag(exact);
        let error = self.format.trig_error(magnitude.x);
        let unit = (self.format.trig_ulps * self.format.u).next_up();
        (exact, self.state.pen.rounding(magnitude, error, unit, self.format.tiny))
    }

    fn is_power_of_two(&self, id: NodeId) -> bool {
        match self.graph.op(id) {
            Op::Constant(c) => {
                let x = self.format.round(c.value()).abs();
                x.is_normal() && x.to_bits() & ((1 << 52) - 1) == 0
            }
            _ => false,
        }
    }

    /// The range of a sum, from that of its operands and from its form.
    fn sum(&mut self, i: usize, direct: Range) -> Range {
        let sum = self.sums[i].take().expect("sums have forms");
        let enclosure = self.enclosure(&sum);
        self.sums[i] = Some(sum);
        let (_, slack) = self.forms.flat(Atom::Value(i as u32));
        let State { error, pen, .. } = &mut self.state;
        let others = slack.nodes.iter().filter(|n| **n as usize != i);
        let slack = others.fold(Bound::ZERO, |s, n| pen.add_up(s, error[*n as usize]));
        let enclosure = pen.widened(enclosure, slack);
        pen.intersect(direct, enclosure)
    }

    /// A form's range: parts of one angle by their norm where that is less.
    fn enclosure(&mut self, form: &Bounded) -> Range {
        let mut sum = Range::ZERO;
        let mut start = 0;
        for (pair, end, group) in &form.turns {
            let mut part = self.part(&form.form[start..*end], Range::ZERO);
            start = *end;
            if !part.x.is_zero() {
                let norm = self.norm(*group);
                let stretch = self.stretch(*pair);
                let stretch = if self.is_broken(Broken::Turn) { 0.4 * stretch } else { stretch };
                let pen = &mut self.state.pen;
                let stretch = pen.number(stretch);
                let most = pen.mul_up(stretch, norm);
                part = pen.clipped(part, most);
            }
            sum = self.state.pen.add(sum, part);
        }
        for (end, values, atoms) in &form.dots {
            let mut part = self.part(&form.form[start..*end], Range::ZERO);
            start = *end;
            if !part.x.is_zero() {
                let (values, atoms) = (self.norm(*values), self.norm(*atoms));
                let most = self.state.pen.mul_up(values, atoms);
                part = self.state.pen.clipped(part, most);
            }
            sum = self.state.pen.add(sum, part);
        }
        self.part(&form.form[start..], sum)
    }

    /// A sum, and some terms.
    fn part(&mut self, terms: &[Term], mut sum: Range) -> Range {
        for t in terms {
            let term = self.state.term(self.graph, t);
            sum = self.state.pen.add(sum, term);
        }
        sum
    }

    /// T of a pair: s² + c² ≤ T² for the computed sine and cosine, each within an error of the exact one.
    fn stretch(&self, _pair: u32) -> f64 {
        let e = self.format.trig_error(1.0);
        (1.0 + (1.5 * e).next_up()).next_up()
    }

    /// An upper bound of the norm of a group.
    fn norm(&mut self, id: GroupId) -> Bound {
        let k = id as usize;
        if self.state.norm.len() <= k {
            self.state.norm.resize(self.groups.groups.len().max(k + 1), (0, Bound::ZERO));
        }
        // a round is either a box's or a result's, and asks for no group of the other kind
        let known = self.state.norm[k];
        if known.0 > 0 && (known.0 == self.state.result_round || known.0 == self.state.box_round) {
            return known.1;
        }
        let current = if self.groups.groups[k].of_adjoints { self.state.result_round } else { self.state.box_round };
        let mut ends = Norm::ZERO;
        for m in self.groups.members(id) {
            let mut sum = Range::ZERO;
            for t in m {
                let term = self.state.term(self.graph, t);
                sum = self.state.pen.add(sum, term);
            }
            let magnitude = self.state.pen.mag(sum);
            self.state.pen.add_square(&mut ends, magnitude);
        }
        let mut best = self.state.pen.root(ends);
        // what is asked for on the way back to itself is answered by its ends
        self.state.norm[k] = (current, best);
        if best.x == 0.0 || self.groups.is_term(id) {
            return best;
        }
        self.groups.bound_members(id);
        let bounded = self.groups.groups[k].bounded.take().expect("made above");
        if !bounded.is_empty() {
            let mut ends = Norm::ZERO;
            for b in &bounded {
                let enclosure = self.enclosure(b);
                let magnitude = self.state.pen.mag(enclosure);
                self.state.pen.add_square(&mut ends, magnitude);
            }
            let clipped = self.state.pen.root(ends);
            best = self.state.pen.least(best, clipped);
            self.state.norm[k].1 = best;
        }
        self.groups.groups[k].bounded = Some(bounded);
        let is_first = self.groups.groups[k].ways.is_none();
        if is_first {
            let state = std::cell::RefCell::new(std::mem::take(&mut self.state));
            self.groups.find_ways(id, &self.forms, &|t| state.borrow_mut().size(self.graph, t));
            self.state = state.into_inner();
        }
        let mut ways = self.groups.groups[k].ways.take().expect("made above");
        let mut bounds = Vec::with_capacity(if is_first { ways.len() } else { 0 });
        for way in &ways {
            let mut slack = Norm::ZERO;
            for s in way.slack.iter() {
                let State { error, total_error, pen, .. } = &mut self.state;
                let rounding = s.nodes.iter().fold(Bound::ZERO, |s, n| pen.add_up(s, error[*n as usize]));
                let all = s.totals.iter().fold(rounding, |s, n| pen.add_up(s, total_error[*n as usize]));
                pen.add_square(&mut slack, all);
            }
            let mut bound = self.state.pen.root(slack);
            for (factor, inner) in way.parts.iter() {
                let factor = match factor {
                    Factor::Turn(pair) => {
                        let stretch = self.stretch(*pair);
                        self.state.pen.number(stretch)
                    }
                    Factor::Matrix(x) => self.state.pen.number(*x),
                    Factor::Coefficient(c) => {
                        let alone = Term { coefficient: *c, atom: Atom::One, negative: false };
                        let value = self.state.term(self.graph, &alone);
                        self.state.pen.mag(value)
                    }
                    Factor::Values(group) => self.norm(*group),
                };
                let inner = self.norm(*inner);
                let part = self.state.pen.mul_up(factor, inner);
                bound = self.state.pen.add_up(bound, part);
                if bound.x >= best.x {
                    break;
                }
            }
            if bound.x < best.x {
                let rest = self.norm(way.rest);
                bound = self.state.pen.add_up(bound, rest);
                best = self.state.pen.least(best, bound);
            }
            if is_first {
                bounds.push(bound.x);
            }
        }
        if is_first {
            // what is far off here will hardly be the best elsewhere, and all are sound
            let mut bounds = bounds.into_iter();
            ways.retain(|_| bounds.next().is_some_and(|b| b <= WORTHWHILE * best.x));
        }
        self.groups.groups[k].ways = Some(ways);
        self.state.norm[k] = (current, best);
        best
    }

    /// Adjoints of all nodes for a result; those of nodes that it does not need stay zero.
    fn adjoints(&mut self, cone: usize) {
        let result = self.cones[cone].0;
        let nodes = std::mem::take(&mut self.cones[cone].1);
        self.state.round += 1;
        self.state.result_round = self.state.round;
        self.state.seed = result.0;
        for &n in &nodes {
            let sums = self.adjoint_sums[n as usize].take().expect("live nodes have adjoints");
            let (chain, apart) = &sums;
            let mut adjoint = if self.is_broken(Broken::ChainRule) && chain.form.len() > 1 {
                self.part(&chain.form[1..], Range::ZERO)
            } else {
                self.enclosure(chain)
            };
            if let Some(apart) = apart {
                let apart = self.enclosure(apart);
                adjoint = self.state.pen.intersect(adjoint, apart);
            }
            if !self.known_adjoints.is_empty() {
                let off = self.adjoint_off(chain);
                self.state.adjoint_off[n as usize] = off;
                if let Some(most) = self.known_adjoints.get(&(result.0, n)) {
                    let pen = &mut self.state.pen;
                    let exact = pen.constant(Interval::around_zero(*most));
                    let perturbed = pen.widened(exact, off);
                    adjoint = pen.intersect(adjoint, perturbed);
                }
            }
            self.adjoint_sums[n as usize] = Some(sums);
            self.state.adjoint[n as usize] = adjoint;
        }
        self.cones[cone].1 = nodes;
    }

    /// How far an adjoint of the perturbed program may be from that of the exact one, from those of its users:
    /// |c̃ ã − c a| ≤ |c̃| |ã − a| + |a| |c̃ − c|.
    fn adjoint_off(&mut self, chain: &Bounded) -> Bound {
        let mut sum = Bound::ZERO;
        for t in &*chain.form {
            let (Atom::Adjoint(_) | Atom::Seed(_)) = t.atom else { unreachable!("adjoints come from adjoints") };
            let of_user = self.state.term(self.graph, &Term { coefficient: Coefficient::One, ..*t });
            let alone = Term { coefficient: t.coefficient, atom: Atom::One, negative: false };
            let coefficient = self.state.term(self.graph, &alone);
            let coefficient_off = self.coefficient_off(t.coefficient);
            let State { pen, adjoint_off, .. } = &mut self.state;
            if let Atom::Adjoint(u) = t.atom {
                let coefficient = pen.mag(coefficient);
                let part = pen.mul_up(coefficient, adjoint_off[u as usize]);
                sum = pen.add_up(sum, part);
            }
            let of_user = pen.mag(of_user);
            let part = pen.mul_up(of_user, coefficient_off);
            sum = pen.add_up(sum, part);
        }
        sum
    }

    /// How far a coefficient of the perturbed program may be from the exact one.
    fn coefficient_off(&mut self, coefficient: Coefficient) -> Bound {
        let kernel = self.format.trig_error(1.0);
        let State { pen, value, total_error, .. } = &mut self.state;
        let off = |n: u32| total_error[n as usize];
        let reciprocal = |b: NodeId, pen: &mut Pen| {
            let reciprocal = pen.over(Range::ONE, value[b.index()]);
            pen.mag(reciprocal)
        };
        match coefficient {
            Coefficient::One => Bound::ZERO,
            Coefficient::Node(n) => off(n),
            Coefficient::Sin(p) | Coefficient::Cos(p) => {
                let kernel = pen.number(kernel);
                pen.add_up(kernel, off(p))
            }
            Coefficient::ExactCos(p) | Coefficient::ExactMinusSin(p) => off(p),
            // |1/b̃ − 1/b| = |b̃ − b|/|b̃ b|
            Coefficient::Reciprocal(b) => {
                let r = reciprocal(NodeId(b), pen);
                let square = pen.mul_up(r, r);
                pen.mul_up(square, off(b))
            }
            // |ã/b̃² − a/b²| ≤ |ã − a|/b̃² + |a| |b̃ − b| |b̃ + b|/(b̃ b)²
            Coefficient::MinusQuotient(n) => {
                let Op::Binary(Binary::Div, a, b) = self.graph.ops[n as usize] else {
                    unreachable!("made for divisions")
                };
                let r = reciprocal(b, pen);
                let square = pen.mul_up(r, r);
                let two = pen.number(2.0);
                let size = pen.mag(value[a.index()]);
                let shifted = pen.mul_up(two, size);
                let shifted = pen.mul_up(shifted, r);
                let shifted = pen.mul_up(shifted, off(b.0));
                let sum = pen.add_up(off(a.0), shifted);
                pen.mul_up(square, sum)
            }
            // nothing is known of programs with roots
            Coefficient::HalfReciprocal(_) => pen.number(f64::INFINITY),
        }
    }

    /// The range of a node's value, over the box of [`Analysis::ranges`].
    pub fn range(&self, id: NodeId) -> Interval {
        self.state.value[id.index()].x
    }

    /// How many results are distinct nodes.
    pub fn results(&self) -> usize {
        self.cones.len()
    }

    /// The node of a distinct result.
    pub fn result(&self, k: usize) -> NodeId {
        self.cones[k].0
    }

    /// Which inputs are angles of which nothing but the sine and cosine is taken, or those of their sums.
    pub(super) fn turning_inputs(&self) -> Vec<usize> {
        let is_input = |id: NodeId| matches!(self.graph.op(id), Op::Input(_));
        let turns = |op: &Op| matches!(op, Op::SinCos(_) | Op::AngleSum(..));
        let inputs = self.graph.ids().filter(|id| is_input(*id) && !self.graph.results.contains(id));
        let other_uses: std::collections::BTreeSet<NodeId> =
            self.graph.ops.iter().filter(|op| !turns(op)).flat_map(|op| op.operands()).collect();
        let angles = inputs.filter(|id| !other_uses.contains(id));
        angles
            .map(|id| if let Op::Input(k) = self.graph.op(id) { k as usize } else { unreachable!("it is an input") })
            .collect()
    }

    /// Which inputs a distinct result depends on.
    pub fn inputs_of(&self, k: usize) -> Vec<usize> {
        let inputs = self.cones[k].1.iter().filter_map(|n| match self.graph.ops[*n as usize] {
            Op::Input(i) => Some(i as usize),
            _ => None,
        });
        inputs.collect()
    }

    /// The greatest error of a distinct result, over the box of [`Analysis::ranges`].
    pub fn error(&mut self, cone: usize) -> f64 {
        self.error_bound(cone).x
    }

    /// The same after [`Analysis::ranges_on_tape`], and the steps by which it is found. `samples`: parts of the box, as [`Tape::new`] takes them.
    pub(super) fn error_and_tape(&mut self, cone: usize, samples: &[&[Interval]]) -> (f64, Tape) {
        let mark = self.state.pen.mark();
        let error = self.error_bound(cone);
        let tape = Tape::new(&self.state.pen, error, samples);
        self.state.pen.forget(mark);
        // norms of values that only this result has asked for are written anew for the next one
        self.state.norm.iter_mut().filter(|(_, norm)| norm.is_since(mark)).for_each(|(round, _)| *round = 0);
        (error.x, tape)
    }

    fn error_bound(&mut self, cone: usize) -> Bound {
        self.adjoints(cone);
        let nodes = std::mem::take(&mut self.cones[cone].1);
        let mut sum = Bound::ZERO;
        let mut grouped: Vec<usize> = Vec::new();
        for &n in &nodes {
            let class = n as usize;
            if self.state.class_error[class].x == 0.0 {
                continue;
            }
            match self.sharing.team[class] {
                Some(team) => grouped.push(team),
                None => sum = self.state.add_share(sum, class),
            }
        }
        grouped.sort_unstable();
        grouped.dedup();
        for team in grouped {
            let group = self.sharing.teams[team].1;
            let classes = &self.sharing.teams[team].0;
            let mut one_by_one = Bound::ZERO;
            let mut errors = Norm::ZERO;
            for c in classes {
                one_by_one = self.state.add_share(one_by_one, *c);
                if !self.state.adjoint[*c].x.is_zero() {
                    self.state.pen.add_square(&mut errors, self.state.class_error[*c]);
                }
            }
            let mut errors = self.state.pen.root(errors);
            if self.sharing.halves[team] {
                let pair = self.state.pen.number(self.format.pair_error());
                errors = self.state.pen.least(errors, pair);
            }
            let norm = self.norm(group);
            let mut together = self.state.pen.mul_up(norm, errors);
            if self.is_broken(Broken::Team) {
                let half = self.state.pen.number(0.5);
                together = self.state.pen.mul_up(half, together);
            }
            let least = self.state.pen.least(one_by_one, together);
            sum = self.state.pen.add_up(sum, least);
        }
        for &n in &nodes {
            self.state.adjoint[n as usize] = Range::ZERO;
        }
        self.cones[cone].1 = nodes;
        sum
    }
}

/// The format of a scalar, where an analysis is made in this one.
fn format_of(own: Format, scalar: Scalar) -> Format {
    if scalar == own.scalar {
        own
    } else {
        Format::of(scalar)
    }
}

/// What the error of an operand does to a value: |f(â) − f(a)| ≤ sup |f′| |â − a|, as ranges hold computed operands and exact ones. Of
/// products |â b̂ − a b| ≤ |â| |b̂ − b| + |b| |â − a|, of roots |√â − √a| = |â − a|/(√â + √a).
fn carried(
    pen: &mut Pen,
    slope: Slope,
    error: Bound,
    [operand, other]: [Range; 2],
    value: &dyn Fn(&mut Pen) -> Range,
) -> Bound {
    let slope = match slope {
        Slope::Zero => return Bound::ZERO,
        Slope::One | Slope::MinusOne => return error,
        Slope::Other => other,
        Slope::Reciprocal => pen.over(Range::ONE, other),
        Slope::MinusQuotient => {
            let value = value(pen);
            pen.over(value, operand)
        }
        Slope::HalfReciprocal => {
            let value = value(pen);
            let both = pen.add(value, value);
            pen.over(Range::ONE, both)
        }
    };
    let slope = pen.mag(slope);
    pen.mul_up(slope, error)
}

impl State {
    /// A sum, and what the errors of a class are worth.
    fn add_share(&mut self, sum: Bound, class: usize) -> Bound {
        let adjoint = self.pen.mag(self.adjoint[class]);
        let share = self.pen.mul_up(adjoint, self.class_error[class]);
        self.pen.add_up(sum, share)
    }

    fn term(&mut self, graph: &Graph, t: &Term) -> Range {
        let State { value, adjoint, sin_cos, pen, .. } = self;
        let value = |n: u32| value[n as usize];
        let atom = match t.atom {
            Atom::One => Range::ONE,
            Atom::Value(v) => value(v),
            Atom::Half(v) => {
                let half = pen.constant(Interval::point(0.5));
                pen.mul(value(v), half)
            }
            Atom::Adjoint(v) => adjoint[v as usize],
            Atom::Seed(r) => {
                if r == self.seed {
                    Range::ONE
                } else {
                    Range::ZERO
                }
            }
        };
        if atom.x.is_zero() {
            return atom;
        }
        let factor = match t.coefficient {
            Coefficient::One => Range::ONE,
            Coefficient::Node(n) => value(n),
            Coefficient::Sin(p) => sin_cos[p as usize][1].0,
            Coefficient::Cos(p) => sin_cos[p as usize][1].1,
            Coefficient::ExactCos(p) => sin_cos[p as usize][0].1,
            Coefficient::ExactMinusSin(p) => pen.neg(sin_cos[p as usize][0].0),
            Coefficient::Reciprocal(b) => pen.over(Range::ONE, value(b)),
            Coefficient::MinusQuotient(n) => {
                let Op::Binary(Binary::Div, a, b) = graph.ops[n as usize] else { unreachable!("made for divisions") };
                let square = pen.square(value(b.0));
                let quotient = pen.over(value(a.0), square);
                pen.neg(quotient)
            }
            Coefficient::HalfReciprocal(n) => {
                let Op::Unary(Unary::Sqrt, a) = graph.ops[n as usize] else { unreachable!("made for roots") };
                let root = pen.sqrt(value(a.0));
                let both = pen.add(root, root);
                pen.over(Range::ONE, both)
            }
        };
        let x = pen.mul(factor, atom);
        if t.negative {
            pen.neg(x)
        } else {
            x
        }
    }

    /// How large a term is.
    fn size(&mut self, graph: &Graph, t: &Term) -> f64 {
        let mark = self.pen.mark();
        let size = self.term(graph, t).x.mag();
        self.pen.forget(mark);
        size
    }
}

/// The nodes that a result needs, users first.
fn cone(graph: &Graph, result: NodeId) -> Vec<u32> {
    let mut needed = vec![false; result.index() + 1];
    needed[result.index()] = true;
    let mut nodes = Vec::new();
    for i in (0..=result.index()).rev() {
        if needed[i] {
            nodes.push(i as u32);
            graph.ops[i].operands().for_each(|a| needed[a.index()] = true);
        }
    }
    nodes
}

/// Which nodes have the same adjoint, and which adjoints belong to one vector.
struct Sharing {
    /// The node that stands for all with its adjoint, up to the sign.
    class: Vec<usize>,
    /// Products x cos q and y sin q with one adjoint, the pair, and the group of x and y.
    products: Vec<(usize, usize, u32, GroupId)>,
    /// The team of a class.
    team: Vec<Option<usize>>,
    /// Classes whose adjoints are bounded together, and their group.
    teams: Vec<(Vec<usize>, GroupId)>,
    /// Whether a team is the sine and cosine of one angle, and their errors are no others.
    halves: Vec<bool>,
}

impl Sharing {
    fn new(graph: &Graph, live: &[bool], forms: &Forms, groups: &mut Groups) -> Self {
        let n = graph.ops.len();
        let class: Vec<usize> = forms.class.iter().map(|c| *c as usize).collect();
        let mut candidates: Vec<Vec<usize>> = Vec::new();
        // vectors by their names
        let mut named: std::collections::BTreeMap<(&str, usize), Vec<usize>> = std::collections::BTreeMap::new();
        for i in (0..n).filter(|i| live[*i]) {
            if let Some((name, index, component)) = graph.notes[i].name {
                if matches!(component, "x" | "y" | "z") {
                    named.entry((name, index)).or_default().push(class[i]);
                }
            }
        }
        candidates.extend(named.into_values());
        // pairs that turn together
        for i in (0..n).filter(|i| live[*i]) {
            let bounded = groups.bounded(forms.chain[i].clone());
            for (_, _, group) in &bounded.turns {
                let alone = groups.members(*group).map(|m| match m[..] {
                    [Term { coefficient: Coefficient::One, atom: Atom::Adjoint(u), .. }] => Some(class[u as usize]),
                    _ => None,
                });
                if let Some(pair) = alone.collect::<Option<Vec<usize>>>() {
                    candidates.push(pair);
                }
            }
        }
        // sine and cosine of one angle
        for i in (0..n).filter(|i| live[*i] && matches!(graph.ops[*i], Op::SinCos(_))) {
            let halves = (i + 1..(i + 3).min(n)).filter(|h| graph.ops[*h].operands().any(|a| a.index() == i));
            candidates.push(halves.map(|h| class[h]).collect());
        }
        let mut team = vec![None; n];
        let mut teams = Vec::new();
        for mut classes in candidates {
            classes.sort_unstable();
            classes.dedup();
            classes.retain(|c| team[*c].is_none());
            if classes.len() < 2 {
                continue;
            }
            let adjoint = |c: &usize| {
                vec![Term { coefficient: Coefficient::One, atom: Atom::Adjoint(*c as u32), negative: false }]
            };
            let group = groups.group(classes.iter().map(adjoint));
            classes.iter().for_each(|c| team[*c] = Some(teams.len()));
            let of_nodes = Arc::make_mut(&mut groups.team);
            of_nodes.resize(n, None);
            classes.iter().for_each(|c| of_nodes[*c] = Some(teams.len() as u32));
            teams.push((classes, group));
        }
        // turning products by adjoint and pair
        type Products = [Vec<(usize, Term)>; 2];
        let mut turning: std::collections::BTreeMap<(usize, u32), Products> = std::collections::BTreeMap::new();
        for i in (0..n).filter(|i| live[*i] && matches!(graph.ops[*i], Op::Binary(Binary::Mul, ..))) {
            if let ([t], _) = forms.flat(Atom::Value(i as u32)) {
                match t.coefficient {
                    Coefficient::Sin(p) => turning.entry((class[i], p)).or_default()[0].push((i, *t)),
                    Coefficient::Cos(p) => turning.entry((class[i], p)).or_default()[1].push((i, *t)),
                    _ => {}
                }
            }
        }
        let mut products = Vec::new();
        for ((_, pair), [sines, cosines]) in turning {
            for ((a, x), (b, y)) in sines.iter().zip(&cosines) {
                let bare = |t: &Term| vec![Term { coefficient: Coefficient::One, ..*t }];
                products.push((*a, *b, pair, groups.group([bare(x), bare(y)])));
            }
        }
        // errors at a half's adjoint are its own, unless another node shares that adjoint
        let mut alone = vec![0u32; n];
        (0..n).filter(|i| live[*i]).for_each(|i| alone[class[i]] += 1);
        let is_half = |c: &usize| matches!(graph.ops[*c], Op::Sin(_) | Op::Cos(_)) && alone[*c] == 1;
        let pair = |c: &usize| graph.ops[*c].operands().next();
        let halves = teams.iter().map(|(classes, _): &(Vec<usize>, GroupId)| {
            classes.len() == 2 && classes.iter().all(is_half) && pair(&classes[0]) == pair(&classes[1])
        });
        let halves = halves.collect();
        Sharing { class, products, team, teams, halves }
    }
}
