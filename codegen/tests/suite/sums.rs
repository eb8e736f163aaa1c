//! The steps of the pass over sums: the smallest graph where each fires, one where it must not, and the same results.

use straightline_codegen::expr::{evaluate, verify, Binary, Counts, Graph, GraphBuilder, NodeId, Op, Port, RuleSet};
use straightline_codegen::pass::{dead_code, sums};
use straightline_core::Dd;

/// The graph of these results over the inputs a, b, c, d, e.
fn graph(build: impl FnOnce(&mut GraphBuilder, [NodeId; 5]) -> Vec<NodeId>) -> Graph {
    let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[5])]);
    let inputs = std::array::from_fn(|k| b.insert(Op::Input(k as u32)));
    let results = build(&mut b, inputs);
    b.finish(vec![Port::new("y", &[results.len()])], results)
}

/// Counts before and after, the results being the same over the reals.
fn before_and_after(graph: &Graph) -> (Counts, Counts) {
    let after = dead_code(&sums(graph));
    verify(&after).unwrap();
    let inputs = [0.3, -1.7, 2.9, 0.45, -5.1].map(Dd::from);
    for (got, expected) in evaluate(&after, &inputs).into_iter().zip(evaluate(graph, &inputs)) {
        assert!((got - expected).abs().hi() < 1e-28, "{got:?} is not {expected:?}");
    }
    (graph.counts(), after.counts())
}

#[test]
fn products_come_last_so_that_each_fuses() {
    let g = graph(|g, [a, b, c, d, e]| {
        let (ab, cd) = (g.add(Op::mul(a, b)), g.add(Op::mul(c, d)));
        let products = g.add(Op::add(ab, cd));
        vec![g.add(Op::add(e, products))]
    });
    let (before, after) = before_and_after(&g);
    // both count the best order, which only one of them has
    assert_eq!((before, before.fma), (after, 2));
    assert_eq!((fused_as_it_stands(&g), fused_as_it_stands(&dead_code(&sums(&g)))), (1, 2));
}

/// Additions that take a product of no other user in, in the order as it stands.
fn fused_as_it_stands(graph: &Graph) -> usize {
    let uses = graph.uses();
    let fuses = |a: NodeId| matches!(graph.op(a), Op::Binary(Binary::Mul, ..)) && uses[a.index()] == 1;
    graph
        .ops
        .iter()
        .filter(|op| matches!(op, Op::Binary(Binary::Add | Binary::Sub, ..)) && op.operands().any(fuses))
        .count()
}

#[test]
fn a_common_factor_is_taken_out_of_products_without_another_user() {
    let g = graph(|g, [a, b, c, ..]| {
        let (ab, ac) = (g.add(Op::mul(a, b)), g.add(Op::mul(a, c)));
        vec![g.add(Op::sub(ab, ac))]
    });
    let (before, after) = before_and_after(&g);
    assert_eq!((before.mul, after.mul), (2, 1));
    assert_eq!(before.fma, after.fma);
}

#[test]
fn multiples_of_one_value_meet_in_their_constants() {
    let g = graph(|g, [a, b, c, ..]| {
        let ab = g.add(Op::mul(a, b));
        let [most, more] = [0.98, -3.0].map(|x| g.constant(Dd::from(x)));
        let (x, y) = (g.add(Op::mul(most, ab)), g.add(Op::mul(more, c)));
        let rest = g.add(Op::sub(ab, x));
        let sum = g.add(Op::add(rest, y));
        vec![g.add(Op::add(sum, c))]
    });
    let (before, after) = before_and_after(&g);
    // 0.02 a b − 2 c
    assert_eq!((before.mul, before.add, after.mul, after.add), (3, 3, 3, 1));
}

#[test]
fn a_multiple_with_another_user_stays() {
    let g = graph(|g, [a, b, ..]| {
        let half = g.constant(Dd::from(0.7));
        let product = g.add(Op::mul(half, a));
        let sum = g.add(Op::add(a, product));
        vec![g.add(Op::add(sum, b)), product]
    });
    let (before, after) = before_and_after(&g);
    assert_eq!((before.mul, before.add), (after.mul, after.add));
}

#[test]
fn a_product_with_another_user_keeps_its_factors() {
    let g = graph(|g, [a, b, c, ..]| {
        let (ab, ac) = (g.add(Op::mul(a, b)), g.add(Op::mul(a, c)));
        vec![g.add(Op::sub(ab, ac)), ab]
    });
    let (before, after) = before_and_after(&g);
    assert_eq!(before, after);
}

#[test]
fn a_pair_in_two_sums_is_added_once_whatever_its_sign() {
    let g = graph(|g, [a, b, c, d, _]| {
        let first = g.add(Op::sub(a, c));
        let first = g.add(Op::sub(first, b));
        let second = g.add(Op::add(d, b));
        vec![first, g.add(Op::sub(second, a))]
    });
    let (before, after) = before_and_after(&g);
    assert_eq!((before.add, after.add), (4, 3));
}

#[test]
fn pairs_of_other_relative_sign_are_not_shared() {
    let g = graph(|g, [a, b, c, d, _]| {
        let first = g.add(Op::add(a, c));
        let first = g.add(Op::add(first, b));
        let second = g.add(Op::sub(d, b));
        vec![first, g.add(Op::add(second, a))]
    });
    let (before, after) = before_and_after(&g);
    assert_eq!(before, after);
}

#[test]
fn opposites_in_a_sum_go() {
    let g = graph(|g, [a, b, c, ..]| {
        let sum = g.add(Op::add(a, b));
        let more = g.add(Op::add(sum, c));
        vec![g.add(Op::sub(more, a))]
    });
    let (_, after) = before_and_after(&g);
    assert_eq!(after.add, 1);
}

#[test]
fn a_sum_of_negatives_costs_no_operation_more() {
    let g = graph(|g, [a, b, c, d, e]| {
        let ab = g.add(Op::mul(a, b));
        let n = g.add(Op::neg(ab));
        let sum = g.add(Op::sub(n, c));
        let de = g.add(Op::mul(d, e));
        vec![g.add(Op::sub(sum, de)), g.add(Op::div(sum, a))]
    });
    let (before, after) = before_and_after(&g);
    assert!(after.flops() <= before.flops() && after.fma <= before.fma, "{before:?} {after:?}");
}

#[test]
fn a_product_added_twice_is_one_product_that_fuses() {
    let g = graph(|g, [a, b, c, ..]| {
        let ab = g.add(Op::mul(a, b));
        let twice = g.add(Op::add(ab, ab));
        vec![g.add(Op::sub(twice, c))]
    });
    let (before, after) = before_and_after(&g);
    assert_eq!((before.fma, after.fma), (3, 2));
    assert_eq!(before.flops(), after.flops());
}
