//! The tracing scalar: running an algorithm over [`Expr`] writes its equations down.
//!
//! The graph under construction belongs to the thread: operators have nowhere else to find it. [`trace`] opens one, and
//! closes it again even when the algorithm panics.

use crate::expr::{Graph, GraphBuilder, NodeId, Op, Port, RuleSet, Section};
use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use straightline_core::{Dd, Real};

thread_local! {
    static BUILDER: RefCell<Option<GraphBuilder>> = const { RefCell::new(None) };
}

/// A node of the graph that this thread is tracing.
#[derive(Clone, Copy, Debug)]
pub struct Expr(NodeId);

fn with<R>(f: impl FnOnce(&mut GraphBuilder) -> R) -> R {
    BUILDER.with_borrow_mut(|b| f(b.as_mut().expect("expressions are only made inside `trace`")))
}

/// Runs `algorithm` on symbolic inputs and returns its equations; one slice of expressions per input port, and the
/// output scalars group after group.
pub fn trace(
    rules: RuleSet,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    algorithm: impl FnOnce(&[Vec<Expr>]) -> Vec<Expr>,
) -> Graph {
    let (builder, results) = written(rules, inputs, algorithm);
    builder.finish(outputs, results)
}

/// [`trace`] of an algorithm of which only itself knows how many results it has: they are one port, `results`.
pub fn trace_all(rules: RuleSet, inputs: Vec<Port>, algorithm: impl FnOnce(&[Vec<Expr>]) -> Vec<Expr>) -> Graph {
    let (builder, results) = written(rules, inputs, algorithm);
    builder.finish(vec![Port::new("results", &[results.len()])], results)
}

pub(crate) fn written(
    rules: RuleSet,
    inputs: Vec<Port>,
    algorithm: impl FnOnce(&[Vec<Expr>]) -> Vec<Expr>,
) -> (GraphBuilder, Vec<NodeId>) {
    let mut builder = GraphBuilder::new(rules, inputs.clone());
    let mut next = 0;
    let mut arguments: Vec<Vec<Expr>> = Vec::with_capacity(inputs.len());
    for port in &inputs {
        arguments.push((next..next + port.len() as u32).map(|k| Expr(builder.insert(Op::Input(k)))).collect());
        next += port.len() as u32;
    }
    continued(builder, || algorithm(&arguments).into_iter().map(|e| e.0).collect())
}

/// What `algorithm` adds to a graph that is being made, and what it returns.
pub(crate) fn continued<R>(builder: GraphBuilder, algorithm: impl FnOnce() -> R) -> (GraphBuilder, R) {
    struct Close;
    impl Drop for Close {
        fn drop(&mut self) {
            BUILDER.with_borrow_mut(|b| *b = None);
        }
    }
    BUILDER.with_borrow_mut(|b| {
        assert!(b.is_none(), "a trace is not nested in another");
        *b = Some(builder);
    });
    let _close = Close;
    let results = algorithm();
    (BUILDER.with_borrow_mut(Option::take).expect("the trace that was opened above"), results)
}

impl Expr {
    /// That of a node of the graph that is being made.
    pub(crate) fn of(node: NodeId) -> Expr {
        Expr(node)
    }

    /// That of an operation.
    pub(crate) fn of_op(op: Op) -> Expr {
        Expr(with(|g| g.add(op)))
    }

    /// The node that stands for it in the graph that is being made.
    pub fn node(self) -> NodeId {
        self.0
    }

    /// The value of what is a constant by now: given as one, or folded.
    pub fn as_constant(self) -> Option<Dd> {
        with(|g| g.as_constant(self.0)).map(|c| c.value())
    }
}

impl Add for Expr {
    type Output = Expr;
    fn add(self, b: Expr) -> Expr {
        Expr(with(|g| g.add(Op::add(self.0, b.0))))
    }
}

impl Sub for Expr {
    type Output = Expr;
    fn sub(self, b: Expr) -> Expr {
        Expr(with(|g| g.add(Op::sub(self.0, b.0))))
    }
}

impl Mul for Expr {
    type Output = Expr;
    fn mul(self, b: Expr) -> Expr {
        Expr(with(|g| g.add(Op::mul(self.0, b.0))))
    }
}

impl Div for Expr {
    type Output = Expr;
    fn div(self, b: Expr) -> Expr {
        Expr(with(|g| g.add(Op::div(self.0, b.0))))
    }
}

impl Neg for Expr {
    type Output = Expr;
    fn neg(self) -> Expr {
        Expr(with(|g| g.add(Op::neg(self.0))))
    }
}

impl Real for Expr {
    fn constant(value: Dd) -> Self {
        Expr(with(|g| g.constant(value)))
    }

    fn sin_cos(self) -> (Self, Self) {
        with(|g| {
            if let Some(c) = g.as_constant(self.0) {
                let (s, c) = g.rules().folding().sin_cos(c.value());
                return (Expr(g.constant(s)), Expr(g.constant(c)));
            }
            let pair = g.add(Op::SinCos(self.0));
            (Expr(g.add(Op::Sin(pair))), Expr(g.add(Op::Cos(pair))))
        })
    }

    fn sin_cos_of_sum(angles: &[Self]) -> (Self, Self) {
        with(|g| {
            // constants are one number, as long as an angle
            let constant = |a: &Expr| g.as_constant(a.0).map(|c| c.value());
            let known: Dd = angles.iter().filter_map(constant).fold(Dd::ZERO, |sum, c| sum + c);
            let free: Vec<NodeId> = angles.iter().filter(|a| constant(a).is_none()).map(|a| a.0).collect();
            let Some((first, rest)) = free.split_first() else {
                let (s, c) = g.rules().folding().sin_cos(known);
                return (Expr(g.constant(s)), Expr(g.constant(c)));
            };
            // what was computed, as at a later stage of a step, is rounded already: added as numbers are
            if free.iter().any(|x| !matches!(g.op(*x), Op::Input(_))) {
                let offset = (known.hi() != 0.0).then(|| g.constant(known));
                let angle = rest.iter().copied().chain(offset).fold(*first, |sum, x| g.add(Op::add(sum, x)));
                let pair = g.add(Op::SinCos(angle));
                return (Expr(g.add(Op::Sin(pair))), Expr(g.add(Op::Cos(pair))));
            }
            let parts: Vec<NodeId> = g.rules().angle_parts(known).into_iter().map(|c| g.constant(c)).collect();
            let angle = rest.iter().chain(&parts).fold(*first, |sum, x| g.insert(Op::AngleSum(sum, *x)));
            let pair = g.add(Op::SinCos(angle));
            (Expr(g.add(Op::Sin(pair))), Expr(g.add(Op::Cos(pair))))
        })
    }

    fn sqrt(self) -> Self {
        Expr(with(|g| g.add(Op::sqrt(self.0))))
    }

    fn sign(self) -> Self {
        Expr(with(|g| g.add(Op::sign(self.0))))
    }

    fn named(self, name: &'static str, index: usize, component: &'static str) -> Self {
        with(|g| g.name(self.0, (name, index, component)));
        self
    }

    fn section(phase: &'static str, index: Option<usize>) {
        with(|g| g.section(Section { phase, index }));
    }
}
