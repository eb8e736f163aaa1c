//! Every rule of the table: the smallest graph where it fires, and one where it must not.

use straightline_codegen::expr::{rules::RULES, Folding, Grade, GraphBuilder, NodeId, Op, Port, RuleSet};
use straightline_codegen::Scalar;
use straightline_core::Dd;

fn builder(rules: RuleSet) -> (GraphBuilder, NodeId, NodeId) {
    let mut b = GraphBuilder::new(rules, vec![Port::new("x", &[2])]);
    let x = b.insert(Op::Input(0));
    let y = b.insert(Op::Input(1));
    (b, x, y)
}

/// A case: what is built from x and y, and what must come out.
struct Case {
    rule: &'static str,
    fires: fn(&mut GraphBuilder, NodeId, NodeId) -> (Op, Op),
    stays: fn(&mut GraphBuilder, NodeId, NodeId) -> Op,
}

fn c(b: &mut GraphBuilder, x: f64) -> NodeId {
    b.constant(Dd::from(x))
}

fn constant(b: &mut GraphBuilder, x: f64) -> Op {
    let id = c(b, x);
    b.op(id)
}

fn neg(b: &mut GraphBuilder, x: NodeId) -> NodeId {
    b.insert(Op::neg(x))
}

const CASES: &[Case] = &[
    Case {
        rule: "fold",
        fires: |b, _, _| (Op::add(c(b, 2.0), c(b, 3.0)), constant(b, 5.0)),
        stays: |b, x, _| Op::add(x, c(b, 3.0)),
    },
    Case {
        rule: "add-zero",
        fires: |b, x, _| (Op::add(x, c(b, 0.0)), b.op(x)),
        stays: |b, x, _| Op::add(x, c(b, 1.0)),
    },
    Case {
        rule: "sub-zero",
        fires: |b, x, _| (Op::sub(c(b, 0.0), x), Op::neg(x)),
        stays: |b, x, _| Op::sub(c(b, 1.0), x),
    },
    Case { rule: "sub-self", fires: |b, x, _| (Op::sub(x, x), constant(b, 0.0)), stays: |_, x, y| Op::sub(x, y) },
    Case {
        rule: "mul-zero",
        fires: |b, x, _| (Op::mul(x, c(b, 0.0)), constant(b, 0.0)),
        stays: |b, x, _| Op::mul(x, c(b, 2.0)),
    },
    Case {
        rule: "mul-one",
        fires: |b, x, _| (Op::mul(c(b, -1.0), x), Op::neg(x)),
        stays: |b, x, _| Op::mul(x, c(b, 2.0)),
    },
    Case { rule: "div-one", fires: |b, x, _| (Op::div(x, c(b, 1.0)), b.op(x)), stays: |b, x, _| Op::div(c(b, 1.0), x) },
    Case { rule: "neg-neg", fires: |b, x, _| (Op::neg(neg(b, x)), b.op(x)), stays: |_, x, _| Op::neg(x) },
    Case { rule: "add-neg", fires: |b, x, y| (Op::add(x, neg(b, y)), Op::sub(x, y)), stays: |_, x, y| Op::add(x, y) },
    Case { rule: "sub-neg", fires: |b, x, y| (Op::sub(x, neg(b, y)), Op::add(x, y)), stays: |_, x, y| Op::sub(x, y) },
    Case {
        rule: "mul-neg",
        fires: |b, x, _| {
            let product = {
                let two = c(b, 2.0);
                b.insert(Op::mul(x, two))
            };
            (Op::mul(x, c(b, -2.0)), Op::neg(product))
        },
        stays: |_, x, y| Op::mul(x, y),
    },
    Case {
        rule: "div-neg",
        fires: |b, x, y| {
            let quotient = b.insert(Op::div(x, y));
            (Op::div(x, neg(b, y)), Op::neg(quotient))
        },
        stays: |_, x, y| Op::div(x, y),
    },
    Case { rule: "commute", fires: |_, x, y| (Op::mul(y, x), Op::mul(x, y)), stays: |_, x, y| Op::sub(x, y) },
    Case {
        rule: "sub-flip",
        fires: |b, x, y| {
            let d = b.insert(Op::sub(x, y));
            (Op::sub(y, x), Op::neg(d))
        },
        stays: |_, x, y| Op::sub(y, x),
    },
    Case {
        rule: "mul-mul",
        fires: |b, x, _| {
            let two = c(b, 2.0);
            let inner = b.insert(Op::mul(x, two));
            let six = c(b, 6.0);
            (Op::mul(inner, c(b, 3.0)), Op::mul(x, six))
        },
        stays: |b, x, y| {
            let inner = b.insert(Op::mul(x, y));
            Op::mul(inner, c(b, 3.0))
        },
    },
];

#[test]
fn every_rule_of_the_table_has_a_case() {
    let names: Vec<_> = RULES.iter().map(|r| r.name).collect();
    let cases: Vec<_> = CASES.iter().map(|c| c.rule).collect();
    assert_eq!(names, cases);
}

#[test]
fn every_rule_fires_on_its_smallest_graph() {
    for case in CASES {
        let (mut b, x, y) = builder(RuleSet::all());
        let (op, expected) = (case.fires)(&mut b, x, y);
        let rule = RULES.iter().find(|r| r.name == case.rule).unwrap();
        let id = (rule.apply)(&mut b, op).unwrap_or_else(|| panic!("{} did not fire", case.rule));
        assert_eq!(b.op(id), expected, "{}", case.rule);
    }
}

#[test]
fn no_rule_fires_where_it_must_not() {
    for case in CASES {
        let (mut b, x, y) = builder(RuleSet::all());
        let op = (case.stays)(&mut b, x, y);
        let rule = RULES.iter().find(|r| r.name == case.rule).unwrap();
        assert_eq!((rule.apply)(&mut b, op), None, "{}", case.rule);
    }
}

#[test]
fn the_exact_rule_set_holds_exact_rules_only_and_all_of_them() {
    let exact = RuleSet::exact(Folding::In(Scalar::F64));
    assert!(exact.rules().iter().all(|r| r.grade == Grade::Exact));
    assert_eq!(exact.rules().len(), RULES.iter().filter(|r| r.grade == Grade::Exact).count());
}

#[test]
fn constants_fold_as_the_number_format_would() {
    let sum = |rules| {
        let mut b = GraphBuilder::new(rules, vec![]);
        let (x, y) = (b.constant(Dd::from(0.1)), b.constant(Dd::from(0.2)));
        let id = b.add(Op::add(x, y));
        b.as_constant(id).unwrap().value()
    };
    assert_eq!(sum(RuleSet::exact(Folding::In(Scalar::F64))), Dd::from(0.1 + 0.2));
    assert_eq!(sum(RuleSet::exact(Folding::In(Scalar::F32))), Dd::from(f64::from(0.1f32 + 0.2f32)));
    assert_eq!(sum(RuleSet::all()), Dd::from(0.1) + Dd::from(0.2));
    assert_ne!(sum(RuleSet::all()), Dd::from(0.1 + 0.2));
}

/// `Exact` means the same bits: random operands through each exact rule, with and without it.
#[test]
fn exact_rules_keep_every_bit() {
    let values = [0.0, 1.0, -1.0, 0.1, -0.3, 1e300, -7e-300, 3.5e17, -2.0, 5e-324];
    let ops: [fn(NodeId, NodeId) -> Op; 4] = [Op::add, Op::sub, Op::mul, Op::div];
    let plain = |op: usize, a: f64, b: f64| match op {
        0 => a + b,
        1 => a - b,
        2 => a * b,
        _ => a / b,
    };
    let mut checked = 0;
    for k in values {
        for (i, make) in ops.iter().enumerate() {
            for (sign_x, sign_y) in [(false, false), (true, false), (false, true), (true, true)] {
                for against_constant in [false, true] {
                    let (mut b, x, y) = builder(RuleSet::exact(Folding::In(Scalar::F64)));
                    let left = if sign_x { b.add(Op::neg(x)) } else { x };
                    let right = if against_constant { c(&mut b, k) } else { y };
                    let right = if sign_y { b.add(Op::neg(right)) } else { right };
                    let id = b.add(make(left, right));
                    let graph = b.finish(vec![Port::new("out", &[1])], vec![id]);
                    for u in values {
                        for v in values {
                            let (l, r) = (if sign_x { -u } else { u }, if against_constant { k } else { v });
                            let expected = plain(i, l, if sign_y { -r } else { r });
                            if !expected.is_finite() {
                                continue;
                            }
                            let got = straightline_codegen::expr::evaluate(&graph, &[u, v])[0];
                            assert!(got == expected, "{u:e} {v:e} {k:e} op {i}: {got:e} for {expected:e}");
                            checked += 1;
                        }
                    }
                }
            }
        }
    }
    assert!(checked > 20_000, "{checked}");
}
