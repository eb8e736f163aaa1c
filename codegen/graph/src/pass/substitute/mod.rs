//! Values formed anew from what is there anyway: resubstitution, as in logic synthesis (Mishchenko and Brayton 2006), over the reals.
//!
//! Equal over the reals, so only where rules of grade `Algebraic` are allowed. Where v takes more operations of its own than that, it
//! becomes one of
//!
//! * u or −u, a value that was formed in another way;
//! * c x or x + c, c a constant;
//! * x ∘ y, of two values that others use;
//! * x ∘ p, p = y ∘ z, where p is new and may serve several values.
//!
//! Which of these hold is not derived, by whatever rules, but seen: at random inputs, in double-double. All values are rational in
//! the inputs, sines and cosines; roots and signs count as inputs of their own. Two that agree to 1e-28 at four random states are one,
//! as long as no result of the program sees what they differ by: what is below all digits of a value need not be below those of a result.
//! That finds what follows from distributive laws, from s² + c² = 1 and from constants that fit, however many steps it takes, and
//! nothing that holds for unit quaternions alone. First of all, what is zero there is zero.
//!
//! No sum may have greater terms than the operations that it replaces: that is where digits would go. Whether the program
//! as a whole keeps them, the caller asks (`rounding.rs`).
//!
//! Before: any graph that [`verify`](crate::expr::verify()) accepts. After: the same results over the reals, fewer operations. Values
//! that stay keep their order, names and sections.

mod net;
mod pairs;
mod search;
mod values;
mod zeros;

use super::{count_sums, dead_code, sums};
use crate::expr::{Binary, Counts, Graph, NodeId};
use net::Net;
use search::EqualitySearch;
use straightline_core::Dd;
use values::{is_atom, true_values, values, AtPoints, POINTS};
use zeros::{without, zeros};

/// Two values that agree so well are equal; double-double has 1e-31, of the greatest term. Less well agree those of programs whose constants
/// differ by 1e20: a term that is missed there may be all that another state has.
const EQUAL: f64 = 1e-28;
/// So little of it a result may change.
const UNCHANGED: f64 = 1e-27;
/// The same where there are roots: of differences, which have fewer digits, and at states of several sizes.
const UNCHANGED_WITH_ROOTS: f64 = 1e-15;
/// Values of the greatest graph that is searched once more: that finds little in great ones.
const TWICE: usize = 600;
/// Values that are looked at while moves are tried, in one round: of a program whose values agree by the thousand, the moves that gain
/// little are left; of all others, none.
const WORK: usize = 700_000;

/// The graph with values formed of others where that takes fewer operations and `keeps` is content with the program, its [`sums()`] put
/// together again. A graph of more than so many values stays as it is: of some thousand it takes some tenths of a second.
pub fn substitute(graph: &Graph, largest: usize, keeps: &dyn Fn(&Graph) -> bool) -> Graph {
    graph.expect_plain("substitute");
    let mut graph = without_zeros(graph, keeps).unwrap_or_else(|| graph.clone());
    if graph.ops.len() > largest {
        return graph;
    }
    for _ in 0..if graph.ops.len() > TWICE { 1 } else { 2 } {
        let Some(better) = round(&graph, keeps) else { break };
        graph = dead_code(&sums(&better));
    }
    graph
}

/// The graph without the operations that make zeros, if there are any.
fn without_zeros(graph: &Graph, keeps: &dyn Fn(&Graph) -> bool) -> Option<Graph> {
    let values = values(graph);
    let zero = zeros(graph, &values);
    let less = dead_code(&sums(&without(graph, &zero)?));
    (ExpectedResults::of(graph, &values, &zero).are_those_of(&less) && keeps(&less)).then_some(less)
}

/// One round: all moves that are there, the most gainful first, each taken if it still pays.
fn round(graph: &Graph, keeps: &dyn Fn(&Graph) -> bool) -> Option<Graph> {
    let mut net = Net { ops: graph.ops.clone(), notes: graph.notes.clone() };
    let mut best = count_sums(graph);
    let mut taken = None;
    let search = EqualitySearch::new(graph);
    let expected = ExpectedResults::of(graph, &search.values, &search.zero);
    let mut live = net.live(graph);
    let mut work = 0;
    for found in search.moves() {
        // moves taken before may have left no use of it
        if work > WORK || !found.becomes.iter().any(|b| live[b.value]) {
            continue;
        }
        let tried = net.with(&found);
        let Some(ordered) = tried.ordered(graph) else { continue };
        work += ordered.ops.len();
        let counts = count_sums(&ordered);
        let fewer = price(counts) < price(best) && counts.flops() <= best.flops() && counts.fma <= best.fma;
        if fewer && expected.are_those_of(&ordered) && keeps(&ordered) {
            (net, best, taken) = (tried, counts, Some(ordered));
            live = net.live(graph);
        }
    }
    taken
}

/// The results at random states, but for those that are zero.
struct ExpectedResults {
    /// Roots and signs stand for inputs at the states that values are compared at, in the order of the graph, which changes: where there are
    /// some, the results with true roots are looked at.
    has_roots: bool,
    results: Vec<Option<AtPoints>>,
}

impl ExpectedResults {
    /// Of a graph with these values, of which some are zero.
    fn of(graph: &Graph, values: &[AtPoints], zero: &[bool]) -> ExpectedResults {
        let known = |values: &[AtPoints]| -> Vec<Option<AtPoints>> {
            graph.results.iter().map(|r| (!zero[r.index()]).then_some(values[r.index()])).collect()
        };
        let has_roots = graph.ops.iter().any(is_atom);
        let results = if has_roots { known(&true_values(graph)) } else { known(values) };
        ExpectedResults { has_roots, results }
    }

    /// Whether another program has them.
    fn are_those_of(&self, graph: &Graph) -> bool {
        let (values, part) = match self.has_roots {
            true => (true_values(graph), UNCHANGED_WITH_ROOTS),
            false => (values(graph), UNCHANGED),
        };
        // a root of a negative number is none before and after
        let unchanged =
            |a: Dd, b: Dd| (a.hi().is_nan() && b.hi().is_nan()) || (a - b).abs().hi() <= part * a.abs().hi();
        let same = |(before, r): (&Option<AtPoints>, &NodeId)| {
            let after = &values[r.index()];
            before.is_none_or(|before| (0..POINTS).all(|k| unchanged(before[k], after[k])))
        };
        self.results.iter().zip(&graph.results).all(same)
    }
}

/// Operations and instructions with fused multiply-add, as either may be what a machine does.
fn price(counts: Counts) -> usize {
    counts.flops() + counts.fma
}

/// How two values make one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum PairForm {
    Sum,
    Difference,
    Product,
}

impl PairForm {
    fn op(self) -> Binary {
        match self {
            PairForm::Sum => Binary::Add,
            PairForm::Difference => Binary::Sub,
            PairForm::Product => Binary::Mul,
        }
    }

    fn of(self, x: &AtPoints, y: &AtPoints) -> AtPoints {
        let op = self.op();
        std::array::from_fn(|k| op.value(x[k], y[k]))
    }
}

/// An operand of what a value becomes.
#[derive(Clone, Copy, Debug)]
enum Operand {
    Node(usize),
    Constant(Dd),
    /// The pair of the move.
    Pair,
}

/// What a value becomes: ± x, or ± (x ∘ y).
#[derive(Clone, Copy, Debug)]
struct Becomes {
    value: usize,
    x: usize,
    y: Option<(PairForm, Operand)>,
    negative: bool,
}

/// Two values that make one that is not there yet.
type NewPair = (usize, usize, PairForm);

/// A change of the graph.
struct GraphChange {
    gain: usize,
    pair: Option<NewPair>,
    becomes: Vec<Becomes>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{Binary, GraphBuilder, NodeId, Op, Port, RuleSet};

    /// The program of some results of four inputs, before and after.
    fn programs(results: impl Fn(&mut GraphBuilder, [NodeId; 4]) -> Vec<NodeId>) -> [Graph; 2] {
        let mut builder = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[4])]);
        let x = [0, 1, 2, 3].map(|k| builder.insert(Op::Input(k)));
        let results = results(&mut builder, x);
        let before = builder.finish(vec![Port::new("z", &[results.len()])], results);
        let after = substitute(&before, 3000, &|_| true);
        crate::expr::verify(&after).expect("a pass keeps what graphs promise");
        let x = [0.7, -1.3, 2.9, 0.4].map(Dd::from);
        let [a, b] = [&before, &after].map(|graph| crate::expr::evaluate(graph, &x));
        assert!(a.iter().zip(&b).all(|(a, b)| (*a - *b).abs().hi() <= 1e-28 * a.abs().hi()), "{a:?} {b:?}");
        [before, after]
    }

    fn flops(programs: &[Graph; 2]) -> [usize; 2] {
        programs.each_ref().map(|graph| graph.counts().flops())
    }

    /// (x + y)² − x² − y² = x y + x y, with x y at hand.
    #[test]
    fn what_is_there_already_is_not_computed_in_another_way() {
        let programs = programs(|b, [x, y, z, _]| {
            let [xx, yy] = [x, y].map(|v| b.add(Op::mul(v, v)));
            let sum = b.add(Op::add(x, y));
            let square = b.add(Op::mul(sum, sum));
            let rest = b.add(Op::sub(square, xx));
            let twice = b.add(Op::sub(rest, yy));
            let product = b.add(Op::mul(x, y));
            let last = b.add(Op::mul(product, z));
            vec![twice, product, last, xx, yy]
        });
        assert_eq!(flops(&programs), [8, 5]);
    }

    /// s (s x) + c (c x) = x, a rule that is in no table.
    #[test]
    fn squares_of_sine_and_cosine_add_to_one() {
        let programs = programs(|b, [q, x, ..]| {
            let pair = b.add(Op::SinCos(q));
            let halves = [Op::Sin(pair), Op::Cos(pair)].map(|half| b.add(half));
            let turned = halves.map(|half| b.add(Op::mul(half, x)));
            let back = [0, 1].map(|k| b.add(Op::mul(halves[k], turned[k])));
            let sum = b.add(Op::add(back[0], back[1]));
            vec![turned[0], turned[1], sum]
        });
        assert_eq!(flops(&programs), [5, 2]);
    }

    /// x z w and y z w share z w.
    #[test]
    fn a_new_value_may_serve_two() {
        let programs = programs(|b, [x, y, z, w]| {
            let of = [x, y].map(|v| {
                let product = b.add(Op::mul(v, z));
                b.add(Op::mul(product, w))
            });
            of.to_vec()
        });
        assert_eq!(flops(&programs), [4, 3]);
    }

    /// y z w = (y / x) (x z w) takes an operation less, and is no number where x is zero.
    #[test]
    fn no_value_gets_a_quotient_that_it_did_not_need() {
        let [_, after] = programs(|b, [x, y, z, w]| {
            let quotient = b.add(Op::div(y, x));
            let of = [x, y].map(|v| {
                let product = b.add(Op::mul(v, z));
                b.add(Op::mul(product, w))
            });
            vec![quotient, of[0], of[1]]
        });
        let quotient =
            after.ids().find(|id| matches!(after.op(*id), Op::Binary(Binary::Div, ..))).expect("it is a result");
        assert_eq!(after.uses()[quotient.index()], 1);
    }

    /// x y as the difference of two numbers of its size, and of two that are a thousand times as great.
    #[test]
    fn no_value_becomes_the_difference_of_greater_ones() {
        let [graph, _] = programs(|b, [x, y, ..]| vec![b.add(Op::mul(x, y))]);
        let search = EqualitySearch::new(&graph);
        let product = graph.results[0].index();
        let times = |k: f64| search.values[product].map(|v| v * Dd::from(k));
        assert!(search.keeps(product, PairForm::Difference, &times(2.0), &times(1.0)));
        assert!(!search.keeps(product, PairForm::Difference, &times(1001.0), &times(1000.0)));
        assert!(search.keeps(product, PairForm::Product, &times(1000.0), &times(0.001)));
    }

    /// ((x + y)² − x² − 2 x y − y²) z + w = w.
    #[test]
    fn what_is_zero_everywhere_is_not_computed() {
        let programs = programs(|b, [x, y, z, w]| {
            let [xx, yy, xy] = [(x, x), (y, y), (x, y)].map(|(u, v)| b.add(Op::mul(u, v)));
            let sum = b.add(Op::add(x, y));
            let square = b.add(Op::mul(sum, sum));
            let rest = [xx, xy, xy, yy].into_iter().fold(square, |rest, term| b.add(Op::sub(rest, term)));
            let product = b.add(Op::mul(rest, z));
            vec![b.add(Op::add(product, w)), b.add(Op::sub(product, w)), rest]
        });
        assert_eq!(flops(&programs), [12, 0]);
    }

    /// y / ((x + y) z − x z − y z): infinite or no number, before and after.
    /// 1 + t⁴ with t = 1e7 x is t⁴ to 28 digits where x is about one, and something else near zero.
    #[test]
    fn what_great_terms_hide_at_one_size_is_seen_at_another() {
        let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[3])]);
        let [x, y, z] = [0, 1, 2].map(|k| b.insert(Op::Input(k)));
        let [great, one] = [1e7, 1.0].map(|c| b.constant(Dd::from(c)));
        let t = b.add(Op::mul(x, great));
        let t2 = b.add(Op::mul(t, t));
        let t4 = b.add(Op::mul(t2, t2));
        let sum = b.add(Op::add(t4, one));
        let y2 = b.add(Op::mul(y, y));
        let root = b.add(Op::sqrt(y2));
        let results = [(sum, z), (t4, root)].map(|(u, v)| b.add(Op::mul(u, v)));
        let before = b.finish(vec![Port::new("z", &[2])], results.to_vec());
        let after = substitute(&before, 3000, &|_| true);
        let at = |graph: &Graph| crate::expr::evaluate(graph, &[1e-9, -1.3, 0.7].map(Dd::from))[0];
        assert!((at(&before) - at(&after)).abs().hi() <= 1e-28, "{:?} {:?}", at(&before), at(&after));
    }

    #[test]
    fn nothing_is_divided_by_a_zero_that_was_found() {
        let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[3])]);
        let [x, y, z] = [0, 1, 2].map(|k| b.insert(Op::Input(k)));
        let sum = b.add(Op::add(x, y));
        let [left, xz, yz] = [sum, x, y].map(|v| b.add(Op::mul(v, z)));
        let rest = [xz, yz].into_iter().fold(left, |rest, term| b.add(Op::sub(rest, term)));
        let result = b.add(Op::div(y, rest));
        let before = b.finish(vec![Port::new("z", &[1])], vec![result]);
        let after = substitute(&before, 3000, &|_| true);
        assert_eq!(after.counts().flops(), before.counts().flops());
    }
}
