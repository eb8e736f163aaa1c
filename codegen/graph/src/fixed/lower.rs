//! Words from a graph with points.

use super::costs::{unit, Aligned, Known, WordWay};
use super::words::{WordId, WordOp, WordProgram};
use crate::certify::Interval;
use crate::expr::{NodeId, Op};
use rustc_hash::FxHashMap;

/// Points of all values, and how much an error of each counts.
#[derive(Clone, Debug)]
pub(super) struct Points {
    /// Per node.
    pub of: Vec<i32>,
    /// Per node, what an error of 1 is worth \[instructions\].
    pub weight: Vec<f64>,
    /// Per input port.
    pub inputs: Vec<i32>,
    /// Per output port.
    pub outputs: Vec<i32>,
}

/// Words, and what is lost on the way.
pub(super) struct Lowered {
    pub program: WordProgram,
    /// Per node, the greatest local error.
    pub errors: Vec<f64>,
    /// Per result, what bringing it to the point of its port loses.
    pub of_results: Vec<f64>,
    /// Per node, the greatest point at which it stands as a word, in whatever form.
    pub greatest_point: Vec<i32>,
    /// Per word, the node that it belongs to.
    pub node: Vec<NodeId>,
}

struct WordLowering<'k, 'g> {
    known: &'k Known<'g>,
    points: &'k Points,
    lowered: Lowered,
    same: FxHashMap<WordOp, WordId>,
    word_of: Vec<Option<WordId>>,
    node: NodeId,
}

impl WordLowering<'_, '_> {
    fn push(&mut self, word: WordOp) -> WordId {
        if let Some(id) = self.same.get(&word) {
            return *id;
        }
        let id = WordId(self.lowered.program.words.len() as u32);
        self.lowered.program.words.push(word);
        self.lowered.node.push(self.node);
        self.same.insert(word, id);
        id
    }

    fn aligned(&mut self, aligned: Aligned) -> WordId {
        match aligned {
            Aligned::Constant(word) => self.push(WordOp::Constant(word)),
            Aligned::Node(id, shift) => {
                let word = self.word_of[id.index()].expect("operands stand before their users");
                let at = self.points.of[id.index()] + shift.max(0);
                let greatest = &mut self.lowered.greatest_point[id.index()];
                *greatest = (*greatest).max(at);
                match shift {
                    0 => word,
                    1.. => self.push(WordOp::Left(word, shift as u32)),
                    _ => self.push(WordOp::Right(word, shift.unsigned_abs())),
                }
            }
        }
    }

    fn way(&mut self, way: &WordWay) -> WordId {
        match *way {
            WordWay::As(a) => self.aligned(a),
            WordWay::Negative(a) => {
                let a = self.aligned(a);
                self.push(WordOp::Neg(a))
            }
            WordWay::Sum(a, b) => {
                let (a, b) = (self.aligned(a), self.aligned(b));
                self.push(WordOp::Add(a, b))
            }
            WordWay::Difference(a, b) => {
                let (a, b) = (self.aligned(a), self.aligned(b));
                self.push(WordOp::Sub(a, b))
            }
            WordWay::Product(kind, [a, b], after) => {
                let (a, b) = (self.aligned(a), self.aligned(b));
                let product = self.push(WordOp::Mul(kind, a, b));
                match after {
                    0 => product,
                    k => self.push(WordOp::Right(product, k)),
                }
            }
            WordWay::Given => unreachable!("leaves and sines are no operations"),
        }
    }

    /// A pair of sine and cosine, its error, and where each term of the angle comes from.
    fn pair(&mut self, angle: NodeId, ranges: &[Interval]) -> Option<(WordId, f64)> {
        let terms = self.known.graph.angle_terms(angle);
        let bits = angle_point(self.known, &terms, &self.points.of)?;
        let mut error = 0.0;
        let mut sum: Option<WordId> = None;
        for term in terms {
            let (aligned, _, off) = self.known.aligned(term, bits, &self.points.of)?;
            error += off;
            let word = self.aligned(aligned);
            sum = Some(sum.map_or(word, |sum| self.push(WordOp::Add(sum, word))));
        }
        let range = ranges[angle.index()].widened(error);
        let (of_kernel, turns) = self.known.machine.sine(range);
        let word = self.push(WordOp::SinCos(sum?, bits as u32, turns));
        Some((word, error + of_kernel))
    }
}

/// The point at which the terms of an angle are added.
fn angle_point(known: &Known, terms: &[NodeId], points: &[i32]) -> Option<i32> {
    let value = |id: &NodeId| match known.graph.op(*id) {
        Op::Constant(c) => c.value().to_f64().abs(),
        _ => known.magnitude[id.index()],
    };
    let most = super::costs::natural(terms.iter().map(value).sum());
    let is_constant = |id: &&NodeId| matches!(known.graph.op(**id), Op::Constant(_));
    let finest = terms.iter().filter(|id| !is_constant(id)).map(|id| points[id.index()]).max();
    let bits = finest.unwrap_or(31).min(31).min(most).max(24);
    (WordProgram::has_sines_at(bits) && bits <= most).then_some(bits)
}

/// The words of a graph with these points; none if something does not fit.
pub(super) fn lowered(known: &Known, points: &Points, ranges: &[Interval]) -> Option<Lowered> {
    let graph = known.graph;
    let n = graph.ops.len();
    let live = graph.live();
    let program = WordProgram {
        inputs: graph.inputs.clone(),
        outputs: graph.outputs.clone(),
        sines: known.machine.sines,
        ..WordProgram::default()
    };
    let lowered = Lowered {
        program,
        errors: vec![0.0; n],
        of_results: Vec::new(),
        greatest_point: points.of.clone(),
        node: Vec::new(),
    };
    let mut lowering =
        WordLowering { known, points, lowered, same: FxHashMap::default(), word_of: vec![None; n], node: NodeId(0) };
    for id in graph.ids().filter(|id| live[id.index()]) {
        lowering.node = id;
        let bits = points.of[id.index()];
        let word = match graph.op(id) {
            // where they are used; and formed where their sine is
            Op::Constant(_) | Op::AngleSum(..) => continue,
            Op::Input(k) => {
                // rounded to nearest when it was converted
                lowering.lowered.errors[id.index()] = 0.5 * unit(bits);
                lowering.push(WordOp::Input(k))
            }
            Op::SinCos(angle) => {
                let (pair, error) = lowering.pair(angle, ranges)?;
                for half in graph.ids().filter(|half| matches!(graph.op(*half), Op::Sin(p) | Op::Cos(p) if p == id)) {
                    lowering.lowered.errors[half.index()] = error;
                }
                pair
            }
            Op::Sin(pair) => {
                let pair = lowering.word_of[pair.index()].expect("pairs stand before their halves");
                lowering.push(WordOp::Sin(pair))
            }
            Op::Cos(pair) => {
                let pair = lowering.word_of[pair.index()].expect("pairs stand before their halves");
                lowering.push(WordOp::Cos(pair))
            }
            Op::Unary(..) | Op::Binary(..) => {
                let priced = known.best(id, bits, &points.of, points.weight[id.index()])?;
                lowering.lowered.errors[id.index()] = priced.error;
                lowering.way(&priced.way)
            }
        };
        lowering.word_of[id.index()] = Some(word);
    }
    let mut results = graph.results.iter();
    for (port, bits) in graph.outputs.iter().zip(&points.outputs) {
        for result in results.by_ref().take(port.len()) {
            lowering.node = *result;
            let (aligned, _, error) = known.aligned(*result, *bits, &points.of)?;
            let word = lowering.aligned(aligned);
            lowering.lowered.program.results.push(word);
            lowering.lowered.of_results.push(error);
        }
    }
    Some(lowering.lowered)
}
