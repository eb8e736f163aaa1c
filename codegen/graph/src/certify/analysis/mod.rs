//! Ranges of all values over a box of inputs, and the error of each result.

mod adjoints;
mod norm;
mod ranges;
mod sharing;
mod state;

use super::format::FloatFormat;
use super::forms::{Atom, AtomForms, Coefficient, FormTerm};
use super::interval::{mul_up, Interval};
use super::norms::{Bounded, GroupId, Groups};
use super::tape::{Enclosure, Norm, Tape, UpperBound};
use crate::expr::{Binary, Graph, NodeId, Op};
use rustc_hash::FxHashMap;
use sharing::Sharing;
use state::BoxState;

/// What is known of a program for forward dynamics, beyond what its operations say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnownSystem {
    /// Ranges of exact values.
    pub values: Vec<(NodeId, Interval)>,
    /// Of a result and a value: the exact adjoint is at most so much.
    pub adjoints: Vec<(NodeId, NodeId, f64)>,
}

/// A graph that is being analysed in a format; what does not depend on the box is found once.
pub struct ErrorAnalysis<'g> {
    graph: &'g Graph,
    format: FloatFormat,
    forms: AtomForms,
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
    state: BoxState,
    /// Per node, what is known of its exact value.
    known: Vec<Option<Interval>>,
    /// Of a result and a node, at most so much is the exact adjoint.
    known_adjoints: FxHashMap<(u32, u32), f64>,
    /// Per node, the greatest local error, where it does not follow from the format: [`ErrorAnalysis::with_errors`].
    given: Option<Vec<f64>>,
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

/// What is bounded of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OfResult {
    /// How far the computed value is from the exact one.
    Error,
    /// Either of them as an absolute value.
    Magnitude,
}

/// Why a result has no certificate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoCertificate {
    /// An input has no range, as the inertial parameters of a payload that is an input.
    Unlimited,
    /// A divisor, or what stands under a root, may vanish in the box.
    Division,
    /// The sign of a computed value may be wrong.
    Sign,
    /// A value may exceed the format, or an angle the domain of sine and cosine.
    Overflow,
}

impl NoCertificate {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            NoCertificate::Unlimited => "an input has no range",
            NoCertificate::Division => "a divisor or the argument of a root may vanish",
            NoCertificate::Sign => "the sign of a computed value may be wrong",
            NoCertificate::Overflow => "a value may overflow, or an angle leave the domain of sine and cosine",
        }
    }
}

impl<'g> ErrorAnalysis<'g> {
    /// Reads a graph.
    pub fn new(graph: &'g Graph, format: FloatFormat) -> Self {
        let live = graph.live();
        let forms = AtomForms::new(graph, &live, &format);
        let mut groups = Groups::default();
        let mut sums = vec![None; graph.ops.len()];
        let mut cancelled = vec![None; graph.ops.len()];
        let mut products = vec![None; graph.ops.len()];
        let mut adjoint_sums = vec![None; graph.ops.len()];
        let sharing = Sharing::new(graph, &live, &forms, &mut groups);
        let is_plain = |id: NodeId| !matches!(graph.op(id), Op::Constant(_) | Op::Sin(_) | Op::Cos(_) | Op::Input(_));
        let one = |id: NodeId| FormTerm { coefficient: Coefficient::One, atom: Atom::Value(id.0), negative: false };
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
        let state = BoxState {
            value: vec![Enclosure::ZERO; n],
            error: vec![UpperBound::ZERO; n],
            total_error: vec![UpperBound::ZERO; n],
            sin_cos: vec![[(Enclosure::ZERO, Enclosure::ZERO); 2]; n],
            adjoint: vec![Enclosure::ZERO; n],
            adjoint_off: vec![UpperBound::ZERO; n],
            ..BoxState::default()
        };
        ErrorAnalysis {
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
            given: None,
            #[cfg(test)]
            broken: None,
        }
    }

    /// Reads a graph that is computed in whatever way: its node k is off by at most `errors[k]` from the operation on computed operands. Of
    /// constants and inputs it is what their conversion loses; sums of angles are formed exactly, and a sine or cosine has what the way to it
    /// loses among its errors, which are all below 2^-20.
    ///
    /// The proof of [`certify`](super) holds for any errors: what it takes of a format are bounds of local errors, which stand here instead.
    pub fn with_errors(graph: &'g Graph, errors: Vec<f64>) -> Self {
        assert_eq!(errors.len(), graph.ops.len(), "an error per node");
        // only what turns of computed sines and cosines stretch is taken of it
        let format = FloatFormat { u: 2f64.powi(-20), trig_ulps: 1.0, ..FloatFormat::of(crate::number::Scalar::F64) };
        ErrorAnalysis { given: Some(errors), ..ErrorAnalysis::new(graph, format) }
    }

    /// How much a result of [`ErrorAnalysis::ranges`] can move with each node, at most, relative to it; 0 where it does not depend on it.
    pub fn sensitivities(&mut self, cone: usize) -> Vec<f64> {
        self.adjoints(cone);
        let nodes = std::mem::take(&mut self.cones[cone].1);
        let mut all = vec![0.0; self.graph.ops.len()];
        for &n in &nodes {
            all[n as usize] = self.state.adjoint[n as usize].x.mag();
        }
        for &n in &nodes {
            self.state.adjoint[n as usize] = Enclosure::ZERO;
        }
        self.cones[cone].1 = nodes;
        all
    }

    /// What is known of exact values and adjoints, wherever it is known from.
    pub(super) fn know(&mut self, known: &KnownSystem) {
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
    pub fn ranges(&mut self, inputs: &[Interval]) -> Result<(), NoCertificate> {
        self.find_ranges(inputs, false)
    }

    /// [`ErrorAnalysis::ranges`], and all that is computed is written down, for [`ErrorAnalysis::bound_and_tape`].
    pub(super) fn ranges_on_tape(&mut self, inputs: &[Interval]) -> Result<(), NoCertificate> {
        self.find_ranges(inputs, true)
    }

    /// What the errors of a node's class are worth for the result of [`ErrorAnalysis::error`] at hand: the node that stands for the class,
    /// and its greatest adjoint times its errors.
    pub fn shares(&mut self, cone: usize) -> Vec<(NodeId, f64)> {
        self.adjoints(cone);
        let nodes = std::mem::take(&mut self.cones[cone].1);
        let state = &self.state;
        let share = |n: &u32| mul_up(state.adjoint[*n as usize].x.mag(), state.class_error[*n as usize].x);
        let shares = nodes.iter().map(|n| (NodeId(*n), share(n))).filter(|(_, share)| *share > 0.0).collect();
        for &n in &nodes {
            self.state.adjoint[n as usize] = Enclosure::ZERO;
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

    /// The range of a node's value, over the box of [`ErrorAnalysis::ranges`].
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

    /// The greatest error of a distinct result, over the box of [`ErrorAnalysis::ranges`].
    pub fn error(&mut self, cone: usize) -> f64 {
        self.error_bound(cone).x
    }

    /// What is bounded of a result after [`ErrorAnalysis::ranges_on_tape`], and the steps by which it is found. `samples`: parts of the box, as
    /// [`Tape::new`] takes them.
    pub(super) fn bound_and_tape(&mut self, bounded: OfResult, cone: usize, samples: &[&[Interval]]) -> (f64, Tape) {
        let mark = self.state.pen.mark();
        let bound = match bounded {
            OfResult::Error => self.error_bound(cone),
            OfResult::Magnitude => {
                let value = self.state.value[self.cones[cone].0.index()];
                self.state.pen.mag(value)
            }
        };
        let tape = Tape::new(&self.state.pen, bound, samples);
        self.state.pen.forget(mark);
        // norms of values that only this result has asked for are written anew for the next one
        self.state.norm.iter_mut().filter(|(_, norm)| norm.is_since(mark)).for_each(|(round, _)| *round = 0);
        (bound.x, tape)
    }

    fn error_bound(&mut self, cone: usize) -> UpperBound {
        self.adjoints(cone);
        let nodes = std::mem::take(&mut self.cones[cone].1);
        let mut sum = UpperBound::ZERO;
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
            let mut one_by_one = UpperBound::ZERO;
            let mut errors = Norm::ZERO;
            for c in classes {
                one_by_one = self.state.add_share(one_by_one, *c);
                if !self.state.adjoint[*c].x.is_zero() {
                    self.state.pen.add_square(&mut errors, self.state.class_error[*c]);
                }
            }
            let mut errors = self.state.pen.root(errors);
            if self.sharing.halves[team] && self.given.is_none() {
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
            self.state.adjoint[n as usize] = Enclosure::ZERO;
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
