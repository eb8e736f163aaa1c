//! Ranges of all values over a box of inputs, and the error of each result.

use super::format::Format;
use super::forms::{Atom, Coefficient, Forms, Term};
use super::interval::{add_up, mul_up, norm_up, Interval};
use super::norms::{Bounded, Factor, GroupId, Groups};
use crate::emit::Scalar;
use crate::expr::{Graph, NodeId, Op, Width};

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
    /// Per node, its adjoint by the chain rule, and taken apart, with its groups.
    adjoint_sums: Vec<Option<(Bounded, Bounded)>>,
    /// Errors that share an adjoint, and adjoints that share a norm.
    sharing: Sharing,
    /// Nodes that each result needs, users first.
    cones: Vec<(NodeId, Vec<u32>)>,
    state: State,
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
}

/// Numbers of one box, and of one result.
#[derive(Clone, Default)]
struct State {
    /// Values, rounding included.
    value: Vec<Interval>,
    /// Greatest rounding error of each node.
    error: Vec<f64>,
    /// How far each value may be from the exact one.
    total_error: Vec<f64>,
    /// Errors of roundings, of all nodes that share an adjoint, at the node that stands for them.
    class_error: Vec<f64>,
    /// Exact and computed sine and cosine of each pair.
    sin_cos: Vec<[(Interval, Interval); 2]>,
    /// Adjoints for the result at hand.
    adjoint: Vec<Interval>,
    seed: u32,
    /// Norms of groups, with the round in which they were found.
    norm: Vec<(u64, f64)>,
    box_round: u64,
    result_round: u64,
    round: u64,
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
                Op::Add(..) | Op::Sub(..) => {
                    let (form, _) = forms.flat(Atom::Value(id.0));
                    sums[i] = Some(groups.bounded(form.to_vec()));
                    cancelled[i] = forms.cancelled(id.0).map(|form| groups.bounded(form.to_vec()));
                }
                Op::Mul(a, b) if a != b && is_plain(a) && is_plain(b) => {
                    products[i] = Some(groups.group([vec![one(a)], vec![one(b)]]));
                }
                _ => {}
            }
            let form = forms.flat(Atom::Adjoint(id.0)).0.to_vec();
            adjoint_sums[i] = Some((groups.bounded(forms.chain[i].clone()), groups.bounded(form)));
        }
        let mut results: Vec<NodeId> = graph.results.clone();
        results.sort_unstable();
        results.dedup();
        let cones = results.into_iter().map(|r| (r, cone(graph, r))).collect();
        let n = graph.ops.len();
        let state = State {
            value: vec![Interval::ZERO; n],
            error: vec![0.0; n],
            total_error: vec![0.0; n],
            sin_cos: vec![[(Interval::ZERO, Interval::ZERO); 2]; n],
            adjoint: vec![Interval::ZERO; n],
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
            #[cfg(test)]
            broken: None,
        }
    }

    #[cfg(test)]
    fn is_broken(&self, what: Broken) -> bool {
        self.broken == Some(what)
    }

    #[cfg(not(test))]
    fn is_broken(&self, _what: Broken) -> bool {
        false
    }

    /// Ranges of all values for inputs in a box, and the greatest error of each rounding.
    ///
    /// # Errors
    /// If a value can be no number.
    pub fn ranges(&mut self, inputs: &[Interval]) -> Result<(), Refusal> {
        self.state.round += 1;
        self.state.box_round = self.state.round;
        for i in 0..self.graph.ops.len() {
            let (exact, error) = self.exact_range(i, inputs)?;
            let mut range = if matches!(self.graph.ops[i], Op::Constant(_)) { exact } else { exact.widened(error) };
            self.state.total_error[i] = add_up(self.carried_error(i), error);
            if let Some(form) = self.cancelled[i].take() {
                let mut exact = self.enclosure(&form);
                if self.is_broken(Broken::Cancelled) {
                    exact = exact.clipped(0.4 * exact.mag());
                }
                range = range.intersect(exact.widened(self.state.total_error[i]));
                self.cancelled[i] = Some(form);
            }
            if range.mag().is_nan() || range.mag() >= self.format.largest {
                return Err(Refusal::Overflow);
            }
            self.state.value[i] = range;
            self.state.error[i] = error;
        }
        self.class_errors();
        Ok(())
    }

    /// How far the errors of its operands take a value from the exact one. Ranges hold both.
    fn carried_error(&self, i: usize) -> f64 {
        let error = |a: NodeId| self.state.total_error[a.index()];
        let value = |a: NodeId| self.state.value[a.index()];
        match self.graph.ops[i] {
            // the sign of an input, or of what is off zero
            Op::Input(_) | Op::Constant(_) | Op::Sign(_) => 0.0,
            Op::Neg(a) | Op::SinCos(a) | Op::Sin(a) | Op::Cos(a) => error(a),
            Op::Add(a, b) | Op::Sub(a, b) | Op::AngleSum(a, b) => add_up(error(a), error(b)),
            // |â b̂ − a b| ≤ |â| |b̂ − b| + |b| |â − a|
            Op::Mul(a, b) => add_up(mul_up(value(a).mag(), error(b)), mul_up(value(b).mag(), error(a))),
            // |â/b̂ − a/b| ≤ (|â − a| + |a/b| |b̂ − b|) / |b̂|
            Op::Div(a, b) => {
                let quotient = value(a).over(value(b)).mag();
                mul_up(add_up(error(a), mul_up(quotient, error(b))), Interval::ONE.over(value(b)).mag())
            }
            // |√â − √a| = |â − a| / (√â + √a)
            Op::Sqrt(a) => {
                let root = value(a).sqrt();
                mul_up(error(a), Interval::ONE.over(root + root).mag())
            }
        }
    }

    /// The errors of all nodes that share an adjoint, added up.
    fn class_errors(&mut self) {
        let mut class_error = vec![0.0; self.graph.ops.len()];
        let mut error = self.state.error.clone();
        for k in 0..self.sharing.products.len() {
            // |x c| + |y s| ≤ ‖(x, y)‖ ‖(c, s)‖, each product rounded by u of itself at most
            let (a, b, pair, group) = self.sharing.products[k];
            let norm = mul_up(self.stretch(pair), self.norm(group));
            let together = add_up(mul_up(self.unit(a, b), norm), 4.0 * self.format.tiny);
            if together < add_up(error[a], error[b]) {
                (error[a], error[b]) = (together, 0.0);
            }
        }
        for (i, e) in error.into_iter().enumerate().filter(|(_, e)| *e > 0.0) {
            let class = self.sharing.class[i];
            class_error[class] = add_up(class_error[class], e);
        }
        self.state.class_error = class_error;
    }

    /// What rounding node i to its width can do, up to a magnitude.
    fn rounding(&self, i: usize, magnitude: f64) -> f64 {
        let double = || Format::of(Scalar::F64).rounding(magnitude);
        match self.graph.width(NodeId(i as u32)) {
            Width::Single => self.format.rounding(magnitude),
            Width::Double => double(),
            Width::Rounded => add_up(self.format.rounding(magnitude), double()),
        }
    }

    /// u of two values that are bounded together.
    fn unit(&self, a: usize, b: usize) -> f64 {
        let double = Format::of(Scalar::F64).u;
        match [a, b].map(|i| self.graph.width(NodeId(i as u32))) {
            [Width::Single, Width::Single] => self.format.u,
            [Width::Double, Width::Double] => double,
            _ => add_up(self.format.u, double),
        }
    }

    /// What the errors of a node's class are worth for the result of [`Analysis::error`] at hand: the node that stands for the class,
    /// and its greatest adjoint times its errors.
    pub fn shares(&mut self, cone: usize) -> Vec<(NodeId, f64)> {
        self.adjoints(cone);
        let nodes = std::mem::take(&mut self.cones[cone].1);
        let share = |n: &u32| mul_up(self.state.adjoint[*n as usize].mag(), self.state.class_error[*n as usize]);
        let shares = nodes.iter().map(|n| (NodeId(*n), share(n))).filter(|(_, share)| *share > 0.0).collect();
        for &n in &nodes {
            self.state.adjoint[n as usize] = Interval::ZERO;
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
        self.state.error[id.index()]
    }

    /// The range of an operation on computed operands, before its own rounding, and the bound of that.
    fn exact_range(&mut self, i: usize, inputs: &[Interval]) -> Result<(Interval, f64), Refusal> {
        let format = self.format;
        let v = |state: &State, a: NodeId| state.value[a.index()];
        let rounded = |x: Interval, this: &Self| (x, this.rounding(i, x.mag()));
        Ok(match self.graph.ops[i] {
            Op::Input(k) => {
                let x = inputs[k as usize];
                // a number below the normal ones may be read as zero
                let subnormal = x.lo < format.tiny && x.hi > -format.tiny && !x.is_zero();
                (x, if subnormal { format.tiny } else { 0.0 })
            }
            Op::Constant(c) => {
                // the range holds both the exact and the rounded value
                let format = match self.graph.width(NodeId(i as u32)) {
                    Width::Double => Format::of(Scalar::F64),
                    _ => format,
                };
                let (range, error) = format.constant(c.value());
                (range, if self.is_broken(Broken::Constants) { 0.0 } else { error })
            }
            Op::Neg(a) => {
                let x = v(&self.state, a);
                let is_rounded = self.graph.width(NodeId(i as u32)) == Width::Rounded;
                (-x, if is_rounded { format.rounding(x.mag()) } else { 0.0 })
            }
            Op::Add(a, b) => {
                let sum = self.sum(i, v(&self.state, a) + v(&self.state, b));
                rounded(sum, self)
            }
            Op::Sub(a, b) => {
                let sum = self.sum(i, v(&self.state, a) - v(&self.state, b));
                rounded(sum, self)
            }
            Op::Mul(a, b) => {
                if a == b {
                    return Ok(rounded(v(&self.state, a).square(), self));
                }
                let (x, y) = (v(&self.state, a), v(&self.state, b));
                let mut product = x * y;
                if let Some(group) = self.products[i] {
                    // |a b| ≤ (a² + b²)/2
                    let norm = self.norm(group);
                    product = product.clipped((0.5 * mul_up(norm, norm)).next_up());
                }
                let is_single = self.graph.width(NodeId(i as u32)) == Width::Single;
                let exact = is_single && (self.is_power_of_two(a) || self.is_power_of_two(b));
                if exact {
                    (product, format.tiny)
                } else {
                    rounded(product, self)
                }
            }
            Op::Div(a, b) => {
                if v(&self.state, b).has_zero() {
                    return Err(Refusal::Division);
                }
                rounded(v(&self.state, a).over(v(&self.state, b)), self)
            }
            Op::Sqrt(a) => {
                if v(&self.state, a).lo <= 0.0 {
                    return Err(Refusal::Division);
                }
                rounded(v(&self.state, a).sqrt(), self)
            }
            Op::Sign(a) => {
                let x = v(&self.state, a);
                let is_input = matches!(self.graph.op(a), Op::Input(_));
                match () {
                    () if x.lo > 0.0 => (Interval::ONE, 0.0),
                    () if x.hi < 0.0 => (-Interval::ONE, 0.0),
                    () if is_input => (Interval { lo: -1.0, hi: 1.0 }, 0.0),
                    () => return Err(Refusal::Sign),
                }
            }
            // formed exactly: what rounding loses goes into the reduction
            Op::AngleSum(a, b) => (v(&self.state, a) + v(&self.state, b), 0.0),
            Op::SinCos(a) => {
                let angle = v(&self.state, a);
                if angle.mag() > format.trig_domain {
                    return Err(Refusal::Overflow);
                }
                let (sin, cos) = angle.sin_cos();
                let e = format.trig_error(1.0);
                self.state.sin_cos[i] = [(sin, cos), (sin.widened(e), cos.widened(e))];
                (angle, 0.0)
            }
            Op::Sin(p) => {
                let (sin, _) = self.state.sin_cos[p.index()][0];
                (sin, format.trig_error(sin.mag()))
            }
            Op::Cos(p) => {
                let (_, cos) = self.state.sin_cos[p.index()][0];
                (cos, format.trig_error(cos.mag()))
            }
        })
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
    fn sum(&mut self, i: usize, direct: Interval) -> Interval {
        let Some(sum) = self.sums[i].take() else { return direct };
        let enclosure = self.enclosure(&sum);
        self.sums[i] = Some(sum);
        let (_, slack) = self.forms.flat(Atom::Value(i as u32));
        let others = slack.nodes.iter().filter(|n| **n as usize != i);
        let slack = others.fold(0.0, |s, n| add_up(s, self.state.error[*n as usize]));
        direct.intersect(enclosure.widened(slack))
    }

    /// A form's range: parts of one angle by their norm where that is less.
    fn enclosure(&mut self, form: &Bounded) -> Interval {
        let terms: Vec<Interval> = form.form.iter().map(|t| self.term(t)).collect();
        let mut sum = Interval::ZERO;
        let mut done = vec![false; terms.len()];
        for (pair, members, group) in &form.turns {
            let mut part = Interval::ZERO;
            for k in members {
                done[*k] = true;
                part = part + terms[*k];
            }
            if !part.is_zero() {
                let norm = self.norm(*group);
                let norm = if self.is_broken(Broken::Turn) { 0.4 * norm } else { norm };
                part = part.clipped(mul_up(self.stretch(*pair), norm));
            }
            sum = sum + part;
        }
        for (members, values, atoms) in &form.dots {
            let mut part = Interval::ZERO;
            for k in members {
                done[*k] = true;
                part = part + terms[*k];
            }
            if !part.is_zero() {
                let norm = mul_up(self.norm(*values), self.norm(*atoms));
                part = part.clipped(norm);
            }
            sum = sum + part;
        }
        terms.into_iter().zip(done).filter(|(_, done)| !done).fold(sum, |sum, (term, _)| sum + term)
    }

    /// T of a pair: s² + c² ≤ T² for the computed sine and cosine, each within an error of the exact one.
    fn stretch(&self, _pair: u32) -> f64 {
        let e = self.format.trig_error(1.0);
        (1.0 + (1.5 * e).next_up()).next_up()
    }

    fn term(&self, t: &Term) -> Interval {
        let value = |n: u32| self.state.value[n as usize];
        let atom = match t.atom {
            Atom::One => Interval::ONE,
            Atom::Value(v) => value(v),
            Atom::Half(v) => value(v) * Interval::point(0.5),
            Atom::Adjoint(v) => self.state.adjoint[v as usize],
            Atom::Seed(r) => {
                if r == self.state.seed {
                    Interval::ONE
                } else {
                    Interval::ZERO
                }
            }
        };
        if atom.is_zero() {
            return atom;
        }
        let x = match t.coefficient {
            Coefficient::One => atom,
            Coefficient::Node(n) => value(n) * atom,
            Coefficient::Sin(p) => self.state.sin_cos[p as usize][1].0 * atom,
            Coefficient::Cos(p) => self.state.sin_cos[p as usize][1].1 * atom,
            Coefficient::ExactCos(p) => self.state.sin_cos[p as usize][0].1 * atom,
            Coefficient::ExactMinusSin(p) => -self.state.sin_cos[p as usize][0].0 * atom,
            Coefficient::Reciprocal(b) => Interval::ONE.over(value(b)) * atom,
            Coefficient::MinusQuotient(n) => {
                let Op::Div(a, b) = self.graph.ops[n as usize] else { unreachable!("made for divisions") };
                -(value(a.0).over(value(b.0).square())) * atom
            }
            Coefficient::HalfReciprocal(n) => {
                let Op::Sqrt(a) = self.graph.ops[n as usize] else { unreachable!("made for roots") };
                let root = value(a.0).sqrt();
                Interval::ONE.over(root + root) * atom
            }
        };
        if t.negative {
            -x
        } else {
            x
        }
    }

    /// An upper bound of the norm of a group.
    fn norm(&mut self, id: GroupId) -> f64 {
        let k = id as usize;
        if self.state.norm.len() <= k {
            self.state.norm.resize(self.groups.groups.len().max(k + 1), (0, 0.0));
        }
        let current = if self.groups.groups[k].of_adjoints { self.state.result_round } else { self.state.box_round };
        if self.state.norm[k].0 == current {
            return self.state.norm[k].1;
        }
        let mut best = norm_up(self.groups.groups[k].members.iter().map(|m| {
            let mut sum = Interval::ZERO;
            for t in m {
                sum = sum + self.term(t);
            }
            sum.mag()
        }));
        // what is asked for on the way back to itself is answered by its ends
        self.state.norm[k] = (current, best);
        let alone = matches!(self.groups.groups[k].members.as_slice(), [m] if m.len() == 1);
        if best == 0.0 || alone {
            return best;
        }
        self.groups.bound_members(id);
        let bounded = self.groups.groups[k].bounded.take().expect("made above");
        if bounded.iter().any(|b| !(b.turns.is_empty() && b.dots.is_empty())) {
            let ends: Vec<f64> = bounded.iter().map(|b| self.enclosure(b).mag()).collect();
            best = best.min(norm_up(ends));
            self.state.norm[k].1 = best;
        }
        self.groups.groups[k].bounded = Some(bounded);
        let is_first = self.groups.groups[k].ways.is_none();
        if is_first {
            let mut groups = std::mem::take(&mut self.groups);
            groups.find_ways(id, &self.forms, &|t| self.term(t).mag());
            self.groups = groups;
        }
        let mut ways = self.groups.groups[k].ways.take().expect("made above");
        let mut bounds = Vec::with_capacity(ways.len());
        for way in &ways {
            let errors = way.slack.iter().map(|s| {
                let rounding = s.nodes.iter().fold(0.0, |s, n| add_up(s, self.state.error[*n as usize]));
                s.totals.iter().fold(rounding, |s, n| add_up(s, self.state.total_error[*n as usize]))
            });
            let mut bound = norm_up(errors);
            for (factor, inner) in &way.parts {
                let factor = match factor {
                    Factor::Turn(pair) => self.stretch(*pair),
                    Factor::Matrix(x) => *x,
                    Factor::Coefficient(c) => {
                        self.term(&Term { coefficient: *c, atom: Atom::One, negative: false }).mag()
                    }
                    Factor::Values(group) => self.norm(*group),
                };
                bound = add_up(bound, mul_up(factor, self.norm(*inner)));
                if bound >= best {
                    break;
                }
            }
            if bound < best {
                bound = add_up(bound, self.norm(way.rest));
                best = best.min(bound);
            }
            bounds.push(bound);
        }
        if is_first {
            // what is far off here will hardly be the best elsewhere, and all are sound
            let mut bounds = bounds.into_iter();
            ways.retain(|_| bounds.next().is_some_and(|b| b <= WORTHWHILE * best));
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
                chain.form[1..].iter().fold(Interval::ZERO, |sum, t| sum + self.term(t))
            } else {
                self.enclosure(chain)
            };
            if !(apart.turns.is_empty() && apart.dots.is_empty()) {
                adjoint = adjoint.intersect(self.enclosure(apart));
            }
            self.adjoint_sums[n as usize] = Some(sums);
            self.state.adjoint[n as usize] = adjoint;
        }
        self.cones[cone].1 = nodes;
    }

    /// The range of a node's value, over the box of [`Analysis::ranges`].
    pub fn range(&self, id: NodeId) -> Interval {
        self.state.value[id.index()]
    }

    /// How many results are distinct nodes.
    pub fn results(&self) -> usize {
        self.cones.len()
    }

    /// The node of a distinct result.
    pub fn result(&self, k: usize) -> NodeId {
        self.cones[k].0
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
        self.adjoints(cone);
        let nodes = std::mem::take(&mut self.cones[cone].1);
        let mut sum = 0.0;
        let mut grouped: Vec<usize> = Vec::new();
        for &n in &nodes {
            let class = n as usize;
            if self.state.class_error[class] == 0.0 {
                continue;
            }
            match self.sharing.team[class] {
                Some(team) => grouped.push(team),
                None => sum = add_up(sum, mul_up(self.state.adjoint[class].mag(), self.state.class_error[class])),
            }
        }
        grouped.sort_unstable();
        grouped.dedup();
        for team in grouped {
            let (classes, group) = self.sharing.teams[team].clone();
            let one_by_one = classes
                .iter()
                .fold(0.0, |s, c| add_up(s, mul_up(self.state.adjoint[*c].mag(), self.state.class_error[*c])));
            let active = classes.iter().filter(|c| !self.state.adjoint[**c].is_zero());
            let mut errors = norm_up(active.map(|c| self.state.class_error[*c]));
            if self.sharing.halves[team] {
                errors = errors.min(self.format.pair_error());
            }
            let together = mul_up(self.norm(group), errors);
            let together = if self.is_broken(Broken::Team) { 0.5 * together } else { together };
            sum = add_up(sum, one_by_one.min(together));
        }
        for &n in &nodes {
            self.state.adjoint[n as usize] = Interval::ZERO;
        }
        self.cones[cone].1 = nodes;
        sum
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
                let members = &groups.groups[*group as usize].members;
                let alone = members.iter().map(|m| match m[..] {
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
            groups.team.resize(n, None);
            classes.iter().for_each(|c| groups.team[*c] = Some(teams.len() as u32));
            teams.push((classes, group));
        }
        // turning products by adjoint and pair
        type Products = [Vec<(usize, Term)>; 2];
        let mut turning: std::collections::BTreeMap<(usize, u32), Products> = std::collections::BTreeMap::new();
        for i in (0..n).filter(|i| live[*i] && matches!(graph.ops[*i], Op::Mul(..))) {
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
