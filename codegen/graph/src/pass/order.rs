//! Sums in the order that rounds least.
//!
//! a + b + c rounds a + b and then all of it: what is large is best added last, and terms that cancel are best added to each other.
//! How large terms are is seen at some states. In the recursion of Newton and Euler the acceleration of the base, gravity, is
//! handed from link to link, and at each of them terms of the motion are added to it: as it stands one after the other, each
//! addition rounded at the size of gravity; in this order together, rounded at their own. It is also the order in which the value
//! that everything waits for is needed last.
//!
//! Equal over the reals, so only where rules of grade `Algebraic` are allowed. Before: any graph that
//! [`verify`](crate::expr::verify()) accepts. After: the same sums of the same terms, so as many operations; where a product is to be
//! one instruction with its addition, the order of [`sums`](super::sums()) has fewer of those.

use crate::expr::{Binary, Graph, GraphBuilder, NodeId, Op, RuleSet};

/// Of so many terms all orders are compared.
const ALL_ORDERS: usize = 9;

/// The graph with the terms of each sum in the order that rounds least at these states, given by the value of every node.
pub fn order(graph: &Graph, states: &[Vec<f64>]) -> Graph {
    graph.expect_plain("order");
    let uses = graph.uses();
    // which sum a partial sum, a sign or a product of one user goes to
    let mut inside = vec![false; graph.ops.len()];
    let alone = |a: NodeId| uses[a.index()] == 1;
    for id in graph.ids() {
        if let Op::Binary(Binary::Add | Binary::Sub, a, b) = graph.op(id) {
            for x in [a, b].into_iter().filter(|x| alone(*x)) {
                inside[x.index()] = matches!(graph.op(x), Op::Binary(Binary::Add | Binary::Sub | Binary::Mul, ..));
            }
        }
    }
    let mut writer = OrderWriter {
        graph,
        states,
        inside,
        builder: GraphBuilder::new(RuleSet::all(), graph.inputs.clone()),
        written: vec![None; graph.ops.len()],
    };
    for id in graph.ids().filter(|id| !writer.inside[id.index()]).collect::<Vec<_>>() {
        writer.builder.section(graph.sections[graph.notes[id.index()].section as usize]);
        writer.node(id);
    }
    let results = graph.results.iter().map(|r| writer.node(*r)).collect();
    writer.builder.finish(graph.outputs.clone(), results)
}

struct OrderWriter<'a> {
    graph: &'a Graph,
    states: &'a [Vec<f64>],
    /// Whether a node is written with the sum that alone uses it.
    inside: Vec<bool>,
    builder: GraphBuilder,
    written: Vec<Option<NodeId>>,
}

impl OrderWriter<'_> {
    fn node(&mut self, id: NodeId) -> NodeId {
        if let Some(done) = self.written[id.index()] {
            return done;
        }
        let op = self.graph.op(id);
        let new = match op {
            Op::Binary(Binary::Add | Binary::Sub, ..) => self.sum(id),
            _ => {
                let op = op.map(|a| self.node(a));
                self.builder.insert(op)
            }
        };
        if let Some(name) = self.graph.notes[id.index()].name {
            self.builder.name(new, name);
        }
        self.written[id.index()] = Some(new);
        new
    }

    fn sum(&mut self, id: NodeId) -> NodeId {
        let mut terms = Vec::new();
        self.collect(id, false, true, &mut terms);
        let terms = if terms.len() > 2 { ordered(&terms, self.states) } else { terms };
        // lead with a positive term
        let mut terms: Vec<(NodeId, bool)> = terms;
        let lead = terms.iter().take(2).position(|t| !t.1);
        if lead == Some(1) {
            terms.swap(0, 1);
        }
        // −a − b + c: −(a + b) + c
        let mut turned = lead.is_none();
        let mut sum = self.node(terms[0].0);
        for &(term, negative) in &terms[1..] {
            let node = self.node(term);
            sum = match (turned, negative) {
                (true, true) => self.builder.insert(Op::add(sum, node)),
                (true, false) => {
                    turned = false;
                    self.builder.insert(Op::sub(node, sum))
                }
                (false, true) => self.builder.insert(Op::sub(sum, node)),
                (false, false) => self.builder.insert(Op::add(sum, node)),
            };
        }
        match turned {
            true => self.builder.insert(Op::neg(sum)),
            false => sum,
        }
    }

    /// The terms of a sum with their signs.
    fn collect(&self, id: NodeId, negative: bool, is_root: bool, terms: &mut Vec<(NodeId, bool)>) {
        match self.graph.op(id) {
            Op::Binary(Binary::Add, a, b) if is_root || self.inside[id.index()] => {
                self.collect(a, negative, false, terms);
                self.collect(b, negative, false, terms);
            }
            Op::Binary(Binary::Sub, a, b) if is_root || self.inside[id.index()] => {
                self.collect(a, negative, false, terms);
                self.collect(b, !negative, false, terms);
            }
            _ => terms.push((id, negative)),
        }
    }
}

/// The order in which the sum of (partial sum)² is least, each state over the squares of its terms.
fn ordered(terms: &[(NodeId, bool)], states: &[Vec<f64>]) -> Vec<(NodeId, bool)> {
    let n = terms.len();
    let signed = |state: &Vec<f64>| -> Vec<f64> {
        let value = |t: &(NodeId, bool)| if t.1 { -state[t.0.index()] } else { state[t.0.index()] };
        let values: Vec<f64> = terms.iter().map(value).collect();
        let size = values.iter().map(|x| x * x).sum::<f64>().sqrt();
        values.into_iter().map(|x| if size > 0.0 { x / size } else { 0.0 }).collect()
    };
    // a state at which a term is beyond the numbers says nothing of an order
    let states: Vec<Vec<f64>> = states.iter().map(signed).filter(|s| s.iter().all(|x| x.is_finite())).collect();
    if n > ALL_ORDERS {
        let size = |k: usize| states.iter().map(|s| s[k] * s[k]).sum::<f64>();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| size(*a).total_cmp(&size(*b)));
        return order.into_iter().map(|k| terms[k]).collect();
    }
    // per set of terms what its sum rounds, and the least of all that lead there, with the last term
    let sets = 1usize << n;
    let of_set = |set: usize| -> f64 {
        let sum = |s: &Vec<f64>| (0..n).filter(|k| set >> k & 1 == 1).map(|k| s[k]).sum::<f64>();
        states.iter().map(|s| sum(s).powi(2)).sum()
    };
    let mut least = vec![(f64::INFINITY, 0); sets];
    for set in 1..sets {
        let own = if set.count_ones() > 1 { of_set(set) } else { 0.0 };
        for last in (0..n).filter(|k| set >> k & 1 == 1) {
            let before = if set.count_ones() > 1 { least[set ^ 1 << last].0 } else { 0.0 };
            // the later term last where it makes no difference
            if own + before <= least[set].0 {
                least[set] = (own + before, last);
            }
        }
    }
    let mut order = Vec::with_capacity(n);
    let mut set = sets - 1;
    while set != 0 {
        let last = least[set].1;
        order.push(terms[last]);
        set ^= 1 << last;
    }
    order.reverse();
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{verify, Folding, Port};

    /// ((x₀ ± x₁) ± x₂) ± …, and the values of all its nodes.
    fn chain(values: &[f64], negative: &[bool]) -> (Graph, Vec<f64>) {
        let inputs = vec![Port::new("x", &[values.len()])];
        let mut builder = GraphBuilder::new(RuleSet::exact(Folding::In(crate::number::Scalar::F64)), inputs);
        let terms: Vec<NodeId> = (0..values.len()).map(|k| builder.insert(Op::Input(k as u32))).collect();
        let mut all = values.to_vec();
        let mut sum = terms[0];
        for k in 1..values.len() {
            let before = all[sum.index()];
            sum = builder.insert(if negative[k] { Op::sub(sum, terms[k]) } else { Op::add(sum, terms[k]) });
            all.push(if negative[k] { before - values[k] } else { before + values[k] });
        }
        (builder.finish(vec![Port::new("y", &[1])], vec![sum]), all)
    }

    #[test]
    fn what_is_large_is_added_last() {
        let (graph, values) = chain(&[1e3, 1.0, -1.5], &[false; 3]);
        let ordered = order(&graph, &[values]);
        verify(&ordered).expect("a graph as before");
        let [.., last] = ordered.ops[..] else { panic!("it has operations") };
        let large = ordered.ids().find(|id| ordered.op(*id) == Op::Input(0)).expect("the large term");
        assert!(last.operands().any(|a| a == large), "{ordered:?}");
        assert_eq!(ordered.counts(), graph.counts());
    }

    #[test]
    fn states_beyond_the_numbers_say_nothing() {
        let x = [1e3, 1.0, -1.5, 2.5];
        let (graph, values) = chain(&x, &[false; 4]);
        let alone = order(&graph, std::slice::from_ref(&values));
        for beyond in [f64::NAN, f64::INFINITY, 1e300] {
            let mut wild = values.clone();
            wild[1] = beyond;
            wild[2] = -beyond;
            let [only, beside] = [vec![wild.clone()], vec![values.clone(), wild]].map(|states| order(&graph, &states));
            verify(&only).expect("a graph as before");
            assert_eq!(only.counts(), graph.counts());
            assert_eq!(beside.ops, alone.ops, "{beyond}");
        }
    }

    #[test]
    fn what_cancels_is_added_to_each_other() {
        // 1e16 + 1 − 1e16: nothing is left of the one in this order
        let (x, negative) = ([1e16, 1.0, 1e16], [false, false, true]);
        let (graph, values) = chain(&x, &negative);
        let ordered = order(&graph, &[values]);
        assert_eq!(crate::expr::evaluate::<f64>(&graph, &x), [0.0]);
        assert_eq!(crate::expr::evaluate::<f64>(&ordered, &x), [1.0]);
    }

    #[test]
    fn many_terms_and_all_signs_keep_their_sum() {
        let mut random = straightline_core::random::Random(5);
        for n in 2..14 {
            let x: Vec<f64> = (0..n).map(|_| (random.unit() * 64.0).round() - 32.0).collect();
            let negative: Vec<bool> = (0..n).map(|k| k > 0 && random.unit() < 0.5).collect();
            let (graph, values) = chain(&x, &negative);
            let ordered = order(&graph, &[values]);
            verify(&ordered).expect("a graph as before");
            // whole numbers: exact in any order
            assert_eq!(crate::expr::evaluate::<f64>(&ordered, &x), crate::expr::evaluate::<f64>(&graph, &x));
            assert_eq!(ordered.counts(), graph.counts());
        }
    }
}
