//! Values and adjoints as linear forms: Σ ± coefficient · atom.
//!
//! A value's form is what its additions and subtractions sum up, taken apart down to products; the coefficient of a product
//! is its sine or cosine, or its constant. The adjoint of a value v for a result F is ∂F/∂v; its form is the chain rule,
//! Σ over the users u of v of ∂u/∂v · ∂F/∂u. Both kinds rotate: x cos q − y sin q, y cos q + x sin q. That is what
//! [`norms`](super::norms) looks for.

use super::format::Format;
use crate::expr::{Graph, NodeId, Op};

/// A value, an adjoint, or a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Atom {
    /// 1.
    One,
    /// The value of a node.
    Value(u32),
    /// ∂F/∂v of a node v.
    Adjoint(u32),
    /// 1 for the adjoint of the result itself, if it is that node.
    Seed(u32),
}

/// What an atom is multiplied by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Coefficient {
    /// 1.
    One,
    /// The computed sine of that pair.
    Sin(u32),
    /// The computed cosine of that pair.
    Cos(u32),
    /// The value of a node; not a sine or cosine.
    Node(u32),
    /// The exact cosine of a pair's angle: the derivative of its sine.
    ExactCos(u32),
    /// Minus the exact sine of a pair's angle: the derivative of its cosine.
    ExactMinusSin(u32),
    /// 1/b of a division a / b.
    Reciprocal(u32),
    /// −a/b² of a division a / b, by its node.
    MinusQuotient(u32),
    /// 1/(2 √a), by the root's node.
    HalfReciprocal(u32),
}

/// ± coefficient · atom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Term {
    /// What stands before the atom.
    pub coefficient: Coefficient,
    /// The atom.
    pub atom: Atom,
    /// Whether the sign is minus.
    pub negative: bool,
}

impl Term {
    fn signed(self, negative: bool) -> Term {
        Term { negative: self.negative != negative, ..self }
    }
}

/// A sum of terms, sorted.
pub type Form = Vec<Term>;

/// A form that an atom equals up to the rounding errors of some nodes.
#[derive(Clone, Debug, Default)]
pub struct Flat {
    /// The terms.
    pub form: Form,
    /// Nodes whose rounding errors (coefficient ±1) lie between the atom and the form.
    pub slack: Vec<u32>,
}

/// Forms of more terms stay in parts.
const LONGEST: usize = 32;

/// The forms of all atoms of a graph.
#[derive(Clone, Debug)]
pub struct Forms {
    /// Of values, taken apart.
    values: Vec<Flat>,
    /// Of adjoints by the chain rule, one step.
    pub chain: Vec<Form>,
    /// The node that stands for all with its adjoint, up to the sign.
    pub class: Vec<u32>,
    /// Of adjoints, taken apart.
    adjoints: Vec<Form>,
    /// Constants: a number and how far any value of it may be from that.
    constants: Vec<Option<(f64, f64)>>,
}

/// The pair and whether it is the sine.
fn half(graph: &Graph, id: NodeId) -> Option<Coefficient> {
    match graph.op(id) {
        Op::Sin(p) => Some(Coefficient::Sin(p.0)),
        Op::Cos(p) => Some(Coefficient::Cos(p.0)),
        _ => None,
    }
}

impl Forms {
    /// Reads a graph; `live` says which of its nodes count.
    pub fn new(graph: &Graph, live: &[bool], format: &Format) -> Self {
        let constant = |op: &Op| match op {
            Op::Constant(c) => {
                let (range, _) = format.constant(c.value());
                Some((range.lo, range.width()))
            }
            _ => None,
        };
        let mut forms = Forms {
            values: Vec::with_capacity(graph.ops.len()),
            chain: Vec::new(),
            class: Vec::new(),
            adjoints: Vec::new(),
            constants: graph.ops.iter().map(constant).collect(),
        };
        for id in graph.ids() {
            let flat = forms.value(graph, id);
            forms.values.push(flat);
        }
        (forms.chain, forms.class) = chain_rule(graph, live);
        forms.adjoints = vec![Form::new(); graph.ops.len()];
        for id in (0..graph.ops.len() as u32).rev().map(NodeId) {
            // users stand behind the node: their forms are there
            forms.adjoints[id.index()] = forms.adjoint(id.index());
        }
        forms
    }

    fn value(&self, graph: &Graph, id: NodeId) -> Flat {
        let atom = |id: NodeId| Term { coefficient: Coefficient::One, atom: Atom::Value(id.0), negative: false };
        let alone = Flat { form: vec![atom(id)], slack: Vec::new() };
        let joined = |a: NodeId, b: NodeId, minus: bool| {
            let (a, b) = (&self.values[a.index()], &self.values[b.index()]);
            if a.form.len() + b.form.len() > LONGEST {
                return alone.clone();
            }
            let form = a.form.iter().copied().chain(b.form.iter().map(|t| t.signed(minus))).collect();
            let slack = a.slack.iter().chain(&b.slack).copied().chain([id.0]).collect();
            Flat { form: simplified(form), slack }
        };
        match graph.op(id) {
            Op::Neg(a) => {
                let flat = &self.values[a.index()];
                Flat { form: flat.form.iter().map(|t| t.signed(true)).collect(), slack: flat.slack.clone() }
            }
            Op::Add(a, b) => joined(a, b, false),
            Op::Sub(a, b) => joined(a, b, true),
            Op::Mul(a, b) => {
                // the signs of operands come out
                let bare = |mut x: NodeId| {
                    let mut negative = false;
                    while let Op::Neg(y) = graph.op(x) {
                        (x, negative) = (y, !negative);
                    }
                    (x, negative)
                };
                let ((a, s), (b, t)) = (bare(a), bare(b));
                let constant = |x: NodeId| matches!(graph.op(x), Op::Constant(_)).then_some(Coefficient::Node(x.0));
                let (coefficient, other) = match (half(graph, a), half(graph, b), constant(a), constant(b)) {
                    (Some(h), _, _, _) => (h, b),
                    (None, Some(h), _, _) => (h, a),
                    (None, None, Some(c), _) => (c, b),
                    (None, None, None, Some(c)) => (c, a),
                    _ => return alone,
                };
                Flat {
                    form: vec![Term { coefficient, atom: Atom::Value(other.0), negative: s != t }],
                    slack: vec![id.0],
                }
            }
            Op::Sin(p) => Flat {
                form: vec![Term { coefficient: Coefficient::Sin(p.0), atom: Atom::One, negative: false }],
                slack: vec![],
            },
            Op::Cos(p) => Flat {
                form: vec![Term { coefficient: Coefficient::Cos(p.0), atom: Atom::One, negative: false }],
                slack: vec![],
            },
            _ => alone,
        }
    }

    fn adjoint(&self, i: usize) -> Form {
        let mut form = Form::new();
        for t in &self.chain[i] {
            match (t.coefficient, t.atom) {
                (Coefficient::One, Atom::Adjoint(u)) => {
                    form.extend(self.adjoints[u as usize].iter().map(|v| v.signed(t.negative)));
                }
                _ => form.push(*t),
            }
            if form.len() > LONGEST {
                return vec![Term { coefficient: Coefficient::One, atom: Atom::Adjoint(i as u32), negative: false }];
            }
        }
        simplified(form)
    }

    /// A constant: a number, and how far any value of it may be from that.
    pub fn constant(&self, node: u32) -> Option<(f64, f64)> {
        self.constants[node as usize]
    }

    /// What an atom equals.
    pub fn flat(&self, atom: Atom) -> (&[Term], &[u32]) {
        match atom {
            Atom::Value(v) => (&self.values[v as usize].form, &self.values[v as usize].slack),
            Atom::Adjoint(v) => (&self.adjoints[v as usize], &[]),
            Atom::One | Atom::Seed(_) => (&[], &[]),
        }
    }

    /// Whether taking it apart leads anywhere.
    pub fn is_leaf(&self, atom: Atom) -> bool {
        match self.flat(atom).0 {
            [] => true,
            [t] => t.coefficient == Coefficient::One && t.atom == atom,
            _ => false,
        }
    }

    /// A form with its atoms of coefficient one taken apart, and the nodes whose rounding lies between.
    pub fn flattened(&self, form: &[Term]) -> Flat {
        let mut flat = Flat::default();
        for t in form {
            let (inner, slack) = self.flat(t.atom);
            if t.coefficient == Coefficient::One && !inner.is_empty() && flat.form.len() + inner.len() <= 2 * LONGEST {
                flat.form.extend(inner.iter().map(|u| u.signed(t.negative)));
                flat.slack.extend(slack);
            } else {
                flat.form.push(*t);
            }
        }
        flat.form = simplified(flat.form);
        flat
    }
}

/// Sorted; a term and its opposite go.
pub fn simplified(mut form: Form) -> Form {
    form.sort_unstable();
    let mut kept: Form = Vec::with_capacity(form.len());
    for t in form {
        match kept.last() {
            Some(last) if *last == t.signed(true) => {
                kept.pop();
            }
            _ => kept.push(t),
        }
    }
    kept
}

/// The same form with the sign of its first term turned to plus.
pub fn canonical(form: Form) -> Form {
    match form.first() {
        Some(t) if t.negative => form.into_iter().map(|t| t.signed(true)).collect(),
        _ => form,
    }
}

/// −form.
pub fn negated(form: &[Term]) -> Form {
    form.iter().map(|t| t.signed(true)).collect()
}

/// For each node, Σ over its users of partial derivative times adjoint, and the node that has the same adjoint up to its sign:
/// the sum, say, that alone uses it.
fn chain_rule(graph: &Graph, live: &[bool]) -> (Vec<Form>, Vec<u32>) {
    let n = graph.ops.len();
    let mut chain = vec![Form::new(); n];
    for r in &graph.results {
        let seed = Term { coefficient: Coefficient::One, atom: Atom::Seed(r.0), negative: false };
        if !chain[r.index()].contains(&seed) {
            chain[r.index()].push(seed);
        }
    }
    let mut same: Vec<(u32, bool)> = (0..n as u32).map(|i| (i, false)).collect();
    // users stand behind what they use
    for id in (0..n as u32).rev().map(NodeId).filter(|id| live[id.index()]) {
        if let [Term { coefficient: Coefficient::One, atom: Atom::Adjoint(user), negative }] = chain[id.index()][..] {
            same[id.index()] = (user, negative);
        }
        let (atom, sign) = (Atom::Adjoint(same[id.index()].0), same[id.index()].1);
        let mut uses = |a: NodeId, coefficient: Coefficient, negative: bool| {
            chain[a.index()].push(Term { coefficient, atom, negative: negative != sign });
        };
        let factor = |x: NodeId| half(graph, x).unwrap_or(Coefficient::Node(x.0));
        match graph.op(id) {
            Op::Input(_) | Op::Constant(_) | Op::Sign(_) => {}
            Op::Neg(a) => uses(a, Coefficient::One, true),
            Op::Add(a, b) => {
                uses(a, Coefficient::One, false);
                uses(b, Coefficient::One, false);
            }
            Op::Sub(a, b) => {
                uses(a, Coefficient::One, false);
                uses(b, Coefficient::One, true);
            }
            Op::Mul(a, b) => {
                uses(a, factor(b), false);
                uses(b, factor(a), false);
            }
            Op::Div(a, b) => {
                uses(a, Coefficient::Reciprocal(b.0), false);
                uses(b, Coefficient::MinusQuotient(id.0), false);
            }
            Op::Sqrt(a) => uses(a, Coefficient::HalfReciprocal(id.0), false),
            Op::AngleSum(a, b) => {
                uses(a, Coefficient::One, false);
                uses(b, Coefficient::One, false);
            }
            Op::SinCos(a) => uses(a, Coefficient::One, false),
            Op::Sin(p) => uses(p, Coefficient::ExactCos(p.0), false),
            Op::Cos(p) => uses(p, Coefficient::ExactMinusSin(p.0), false),
        }
    }
    (chain, same.into_iter().map(|(user, _)| user).collect())
}
