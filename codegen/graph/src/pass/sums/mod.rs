//! Fewer and better fused additions: sums with all their terms at once.
//!
//! Equal over the reals, so only where rules of grade `Algebraic` are allowed. Four steps, in rounds until none helps:
//!
//! * flatten: (a + b) + c = a + b + c where a + b has no other user; x − x goes;
//!   c x + x = (c + 1) x, where nothing else uses the product: what cancels does so among constants, without rounding;
//! * factor: a b + a c = a (b + c) where neither product has another user: a multiplication less, and no fused
//!   instruction more; a b + a b = a (b + b), where the product fuses;
//! * share: the pair ±x ± y that stands in most sums is added once, for all of them;
//! * order: products without another user come last, so that each of them is one instruction with its addition.
//!
//! Before: any graph that [`verify`](crate::expr::verify()) accepts. After: the same results over the reals, no operation
//! more. Names and sections go with the values that survive.

mod pairs;
mod steps;
mod writer;

use crate::expr::{Binary, Constant, Counts, Graph, GraphBuilder, NodeId, Op, RuleSet, Unary, TAIL};
use rustc_hash::FxHashMap;
use std::rc::Rc;
use straightline_core::Dd;
use writer::SumWriter;

/// More rounds have not been seen to help; this only bounds the time.
const ROUNDS: usize = 6;

/// The graph with its sums taken apart and put together again.
pub fn sums(graph: &Graph) -> Graph {
    graph.expect_plain("sums");
    let mut table = SumTable::read(graph);
    table.simplify();
    table.write(graph)
}

/// What [`sums`] would take: the same counts, without writing the graph. Only what it can change is counted: products and
/// sums, and pairs of sine and cosine.
pub fn count_sums(graph: &Graph) -> Counts {
    let mut table = SumTable::read(graph);
    table.simplify();
    table.counts()
}

/// A value with a sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Term(u32);

impl Term {
    fn new(value: usize, negative: bool) -> Term {
        Term((value as u32) << 1 | u32::from(negative))
    }

    fn value(self) -> usize {
        (self.0 >> 1) as usize
    }

    fn is_negative(self) -> bool {
        self.0 & 1 == 1
    }

    fn signed(self, negative: bool) -> Term {
        Term(self.0 ^ u32::from(negative))
    }
}

/// Signs stand outside: of products, of constants, and of sums, whose first term is positive when they are made.
#[derive(Clone, Debug, PartialEq)]
enum SignedValue {
    Constant(Constant),
    Product(usize, usize),
    Sum(Vec<Term>),
    /// The same as that one.
    Same(Term),
    /// Anything else: the operation, and its operands with their signs.
    Other(Op, [Option<Term>; 2]),
}

/// A graph as sums of many terms.
#[derive(Clone)]
struct SumTable {
    values: Vec<SignedValue>,
    results: Vec<Term>,
    /// Where a value came from: the node whose name and place it has.
    origin: Vec<Option<NodeId>>,
    /// For look-ups only.
    products: FxHashMap<(usize, usize), usize>,
    constants: FxHashMap<Constant, usize>,
    /// What was counted since the last change.
    uses: Option<Rc<Uses>>,
    /// Whether anything is not as it was.
    changed: bool,
}

/// How often each value is used, and the values that are, operands before users.
type Uses = (Vec<u32>, Vec<usize>);

impl SumTable {
    fn read(graph: &Graph) -> SumTable {
        let mut table = SumTable {
            values: Vec::with_capacity(graph.ops.len()),
            results: Vec::new(),
            origin: Vec::with_capacity(graph.ops.len()),
            products: FxHashMap::default(),
            constants: FxHashMap::default(),
            uses: None,
            changed: false,
        };
        let live = graph.live();
        let mut term_of = vec![Term(u32::MAX); graph.ops.len()];
        for id in graph.ids().filter(|id| live[id.index()]) {
            let t = |a: NodeId| term_of[a.index()];
            let term = match graph.op(id) {
                Op::Unary(Unary::Neg, a) => t(a).signed(true),
                Op::Constant(c) => table.constant(c.value()),
                Op::Binary(Binary::Mul, a, b) => table.product(t(a), t(b), Some(id)),
                Op::Binary(Binary::Add, a, b) => table.push(SignedValue::Sum(vec![t(a), t(b)]), Some(id)),
                Op::Binary(Binary::Sub, a, b) => table.push(SignedValue::Sum(vec![t(a), t(b).signed(true)]), Some(id)),
                op => {
                    let mut operands = [None; 2];
                    op.operands().zip(&mut operands).for_each(|(a, place)| *place = Some(t(a)));
                    table.push(SignedValue::Other(op, operands), Some(id))
                }
            };
            term_of[id.index()] = term;
        }
        table.results = graph.results.iter().map(|r| term_of[r.index()]).collect();
        table
    }

    /// The steps, in rounds until none helps.
    fn simplify(&mut self) {
        for round in 0..ROUNDS {
            self.changed = false;
            self.flatten();
            self.double();
            if self.factor() {
                self.flatten();
            }
            // what is as it was has been shared
            if round > 0 && !self.changed {
                break;
            }
            self.share();
        }
    }

    fn push(&mut self, value: SignedValue, origin: Option<NodeId>) -> Term {
        self.uses = None;
        self.values.push(value);
        self.origin.push(origin);
        Term::new(self.values.len() - 1, false)
    }

    fn constant(&mut self, c: Dd) -> Term {
        let negative = c.hi() < 0.0;
        let key = Constant::new(if negative { -c } else { c });
        if let Some(value) = self.constants.get(&key) {
            return Term::new(*value, negative);
        }
        let value = self.push(SignedValue::Constant(key), None).value();
        self.constants.insert(key, value);
        Term::new(value, negative)
    }

    fn product(&mut self, a: Term, b: Term, origin: Option<NodeId>) -> Term {
        let (a, b) = (self.resolved(a), self.resolved(b));
        let key = (a.value().min(b.value()), a.value().max(b.value()));
        let negative = a.is_negative() != b.is_negative();
        if let Some(value) = self.products.get(&key) {
            return Term::new(*value, negative);
        }
        let value = self.push(SignedValue::Product(key.0, key.1), origin).value();
        self.products.insert(key, value);
        Term::new(value, negative)
    }

    fn resolved(&self, mut term: Term) -> Term {
        while let SignedValue::Same(t) = self.values[term.value()] {
            term = t.signed(term.is_negative());
        }
        term
    }

    /// Both factors of a product.
    fn factors(&self, product: usize) -> [Term; 2] {
        let SignedValue::Product(a, b) = self.values[product] else { unreachable!("a product has two factors") };
        [a, b].map(|v| self.resolved(Term::new(v, false)))
    }

    /// The terms of a sum.
    fn terms(&self, sum: usize) -> impl Iterator<Item = Term> + '_ {
        let SignedValue::Sum(terms) = &self.values[sum] else { unreachable!("a sum has terms") };
        terms.iter().map(|t| self.resolved(*t))
    }

    fn is_product(&self, t: Term) -> bool {
        matches!(self.values[t.value()], SignedValue::Product(..))
    }

    /// How often each value is used by what the results need, and those values, operands before users.
    fn uses(&mut self) -> Rc<Uses> {
        let found = self.uses.take().unwrap_or_else(|| Rc::new(self.counted_uses()));
        self.uses = Some(Rc::clone(&found));
        found
    }

    fn counted_uses(&self) -> Uses {
        let mut uses = vec![0; self.values.len()];
        let mut order = Vec::with_capacity(self.values.len());
        // a value, and which of its operands is next
        let mut stack: Vec<(usize, usize)> = Vec::new();
        for r in &self.results {
            let root = self.resolved(*r).value();
            uses[root] += 1;
            if uses[root] == 1 {
                stack.push((root, 0));
            }
            'values: while let Some((value, first)) = stack.pop() {
                let two: [Term; 2];
                let operands: &[Term] = match &self.values[value] {
                    SignedValue::Sum(terms) => terms,
                    SignedValue::Product(a, b) => {
                        two = [a, b].map(|v| Term::new(*v, false));
                        &two
                    }
                    SignedValue::Other(_, operands) => {
                        two = operands.map(|t| t.unwrap_or(Term(0)));
                        &two[..operands.iter().flatten().count()]
                    }
                    SignedValue::Same(t) => std::slice::from_ref(t),
                    SignedValue::Constant(_) => &[],
                };
                for (k, t) in operands.iter().enumerate().skip(first) {
                    let operand = self.resolved(*t).value();
                    uses[operand] += 1;
                    if uses[operand] > 1 {
                        continue;
                    }
                    if matches!(self.values[operand], SignedValue::Constant(_) | SignedValue::Other(_, [None, None])) {
                        order.push(operand);
                        continue;
                    }
                    stack.extend([(value, k + 1), (operand, 0)]);
                    continue 'values;
                }
                order.push(value);
            }
        }
        (uses, order)
    }

    fn set(&mut self, v: usize, value: SignedValue) {
        if self.values[v] != value {
            self.uses = None;
            self.values[v] = value;
            self.changed = true;
        }
    }

    /// As [`Graph::counts`] of what [`SumTable::write`] makes: n products of one user and a rest are n fused instructions.
    fn counts(&mut self) -> Counts {
        let found = self.uses();
        let (uses, order) = &*found;
        let mut counts = Counts::default();
        let mut fused = 0;
        for v in order.iter().copied() {
            match &self.values[v] {
                SignedValue::Product(..) => counts.mul += 1,
                SignedValue::Sum(_) => {
                    let additions = self.terms(v).count() - 1;
                    let products = self.terms(v).filter(|t| uses[t.value()] == 1 && self.is_product(*t)).count();
                    counts.add += additions;
                    fused += products.min(additions);
                }
                SignedValue::Other(Op::SinCos(_), [Some(angle), _]) => {
                    counts.sin_cos += 1;
                    let sum =
                        matches!(self.values[self.resolved(*angle).value()], SignedValue::Other(Op::AngleSum(..), _));
                    counts.tail += usize::from(sum);
                }
                SignedValue::Other(Op::AngleSum(..), _) => {
                    counts.add += 1;
                    counts.tail += TAIL;
                }
                SignedValue::Other(op, _) => op.row().into_iter().for_each(|row| counts.count(row.counted)),
                SignedValue::Constant(_) | SignedValue::Same(_) => {}
            }
        }
        counts.fma = counts.mul + counts.add - fused;
        counts
    }

    fn write(&self, graph: &Graph) -> Graph {
        let (uses, order) = self.counted_uses();
        // in the order of the original; what has a single user goes to it
        let mut roots: Vec<(NodeId, usize)> = order
            .iter()
            .filter(|v| uses[**v] > 1 || !matches!(self.values[**v], SignedValue::Product(..) | SignedValue::Sum(_)))
            .filter_map(|v| self.origin[*v].map(|id| (id, *v)))
            .collect();
        let results = graph.results.iter().zip(&self.results).map(|(id, t)| (*id, self.resolved(*t).value()));
        roots.extend(results);
        roots.sort_unstable();
        let mut writer = SumWriter {
            table: self,
            graph,
            uses,
            builder: GraphBuilder::new(RuleSet::all(), graph.inputs.clone()),
            written: vec![None; self.values.len()],
        };
        for (id, value) in roots {
            writer.builder.section(graph.sections[graph.notes[id.index()].section as usize]);
            writer.value(value);
        }
        let results: Vec<NodeId> = self.results.iter().map(|t| writer.signed(*t)).collect();
        writer.builder.finish(graph.outputs.clone(), results)
    }
}
