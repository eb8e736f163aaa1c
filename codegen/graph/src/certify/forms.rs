//! Values and adjoints as linear forms: Σ ± coefficient · atom.
//!
//! A value's form is what its additions and subtractions sum up, taken apart down to products; the coefficient of a product
//! is its sine or cosine, or its constant. The adjoint of a value v for a result F is ∂F/∂v; its form is the chain rule,
//! Σ over the users u of v of ∂u/∂v · ∂F/∂u. Both kinds rotate: x cos q − y sin q, y cos q + x sin q. That is what
//! [`norms`](super::norms) looks for.

use super::cancel::cancelled;
use super::format::FloatFormat;
use crate::expr::op::Slope;
use crate::expr::{Binary, Graph, NodeId, Op, Unary};

/// A value, an adjoint, or a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Atom {
    /// 1.
    One,
    /// The value of a node.
    Value(u32),
    /// Half the value of a node.
    Half(u32),
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
pub struct FormTerm {
    /// What stands before the atom.
    pub coefficient: Coefficient,
    /// The atom.
    pub atom: Atom,
    /// Whether the sign is minus.
    pub negative: bool,
}

impl FormTerm {
    fn signed(self, negative: bool) -> FormTerm {
        FormTerm { negative: self.negative != negative, ..self }
    }
}

/// A sum of terms, sorted.
pub type LinearForm = Vec<FormTerm>;

/// A form that an atom equals up to the rounding errors of some nodes.
#[derive(Clone, Debug, Default)]
pub struct Flat {
    /// The terms.
    pub form: LinearForm,
    /// What lies between the atom and the form.
    pub slack: Slack,
}

/// Errors between computed values and a form of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slack {
    /// Nodes whose rounding errors count, once each.
    pub nodes: Vec<u32>,
    /// Nodes that count with all that lies between them and their exact values.
    pub totals: Vec<u32>,
}

impl Slack {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty() && self.totals.is_empty()
    }

    fn of_nodes(nodes: Vec<u32>) -> Slack {
        Slack { nodes, totals: Vec::new() }
    }

    fn extend(&mut self, other: &Slack) {
        self.nodes.extend(&other.nodes);
        self.totals.extend(&other.totals);
    }
}

/// How far values are taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// Down to products.
    Products,
    /// Down to components of vectors that have a name.
    Names,
    /// As [`Depth::Names`], and sums in which products cancel without these.
    Cancelled,
}

impl Flat {
    /// A value as itself.
    fn alone(id: NodeId) -> Flat {
        let term = FormTerm { coefficient: Coefficient::One, atom: Atom::Value(id.0), negative: false };
        Flat { form: vec![term], slack: Slack::default() }
    }
}

/// Forms of more terms stay in parts.
const LONGEST: usize = 32;

/// The forms of all atoms of a graph.
#[derive(Clone, Debug)]
pub struct AtomForms {
    /// Of values, taken apart.
    values: Vec<Flat>,
    /// Of values, taken apart down to components of vectors that have a name.
    named: Vec<Flat>,
    /// Of exact values, what is left where products cancel.
    cancelled: Vec<Option<LinearForm>>,
    /// Of adjoints by the chain rule, one step.
    pub chain: Vec<LinearForm>,
    /// The node that stands for all with its adjoint, up to the sign.
    pub class: Vec<u32>,
    /// Of adjoints, taken apart.
    adjoints: Vec<LinearForm>,
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

impl AtomForms {
    /// Reads a graph; `live` says which of its nodes count.
    pub fn new(graph: &Graph, live: &[bool], format: &FloatFormat) -> Self {
        let constant = |op: &Op| match op {
            Op::Constant(c) => {
                let (range, _) = format.constant(c.value());
                Some((range.lo, range.width()))
            }
            _ => None,
        };
        let mut forms = AtomForms {
            values: Vec::with_capacity(graph.ops.len()),
            named: Vec::with_capacity(graph.ops.len()),
            cancelled: cancelled(graph, live),
            chain: Vec::new(),
            class: Vec::new(),
            adjoints: Vec::new(),
            constants: graph.ops.iter().map(constant).collect(),
        };
        for id in graph.ids() {
            let flat = forms.value(graph, id, |a| forms.values[a.index()].clone());
            forms.values.push(flat);
            let flat = forms.value(graph, id, |a| match graph.notes[a.index()].name {
                Some((_, _, "x" | "y" | "z")) => Flat::alone(a),
                _ => forms.named[a.index()].clone(),
            });
            forms.named.push(flat);
        }
        (forms.chain, forms.class) = chain_rule(graph, live);
        forms.adjoints = vec![LinearForm::new(); graph.ops.len()];
        for id in (0..graph.ops.len() as u32).rev().map(NodeId) {
            // users stand behind the node: their forms are there
            forms.adjoints[id.index()] = forms.adjoint(id.index());
        }
        forms
    }

    /// The form of a value, from those of its operands.
    fn value(&self, graph: &Graph, id: NodeId, of: impl Fn(NodeId) -> Flat) -> Flat {
        let alone = Flat::alone(id);
        let joined = |a: NodeId, b: NodeId, minus: bool| {
            let (a, b) = (of(a), of(b));
            if a.form.len() + b.form.len() > LONGEST {
                return alone.clone();
            }
            let form = a.form.iter().copied().chain(b.form.iter().map(|t| t.signed(minus))).collect();
            let mut slack = Slack::of_nodes(vec![id.0]);
            slack.extend(&a.slack);
            slack.extend(&b.slack);
            Flat { form: simplified(form), slack }
        };
        match graph.op(id) {
            Op::Unary(Unary::Neg, a) => {
                let flat = of(a);
                Flat { form: negated(&flat.form), slack: flat.slack }
            }
            Op::Binary(Binary::Add, a, b) => joined(a, b, false),
            Op::Binary(Binary::Sub, a, b) => joined(a, b, true),
            Op::Binary(Binary::Mul, a, b) => {
                // the signs of operands come out
                let bare = |mut x: NodeId| {
                    let mut negative = false;
                    while let Op::Unary(Unary::Neg, y) = graph.op(x) {
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
                    form: vec![FormTerm { coefficient, atom: Atom::Value(other.0), negative: s != t }],
                    slack: Slack::of_nodes(vec![id.0]),
                }
            }
            Op::Sin(p) => Flat {
                form: vec![FormTerm { coefficient: Coefficient::Sin(p.0), atom: Atom::One, negative: false }],
                slack: Slack::default(),
            },
            Op::Cos(p) => Flat {
                form: vec![FormTerm { coefficient: Coefficient::Cos(p.0), atom: Atom::One, negative: false }],
                slack: Slack::default(),
            },
            _ => alone,
        }
    }

    fn adjoint(&self, i: usize) -> LinearForm {
        let mut form = LinearForm::new();
        for t in &self.chain[i] {
            match (t.coefficient, t.atom) {
                (Coefficient::One, Atom::Adjoint(u)) => {
                    form.extend(self.adjoints[u as usize].iter().map(|v| v.signed(t.negative)));
                }
                _ => form.push(*t),
            }
            if form.len() > LONGEST {
                return vec![FormTerm {
                    coefficient: Coefficient::One,
                    atom: Atom::Adjoint(i as u32),
                    negative: false,
                }];
            }
        }
        simplified(form)
    }

    /// A constant: a number, and how far any value of it may be from that.
    pub fn constant(&self, node: u32) -> Option<(f64, f64)> {
        self.constants[node as usize]
    }

    /// What an atom equals.
    pub fn flat(&self, atom: Atom) -> (&[FormTerm], &Slack) {
        const NONE: &Slack = &Slack { nodes: Vec::new(), totals: Vec::new() };
        match atom {
            Atom::Value(v) => (&self.values[v as usize].form, &self.values[v as usize].slack),
            Atom::Adjoint(v) => (&self.adjoints[v as usize], NONE),
            Atom::One | Atom::Half(_) | Atom::Seed(_) => (&[], NONE),
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

    /// What is left of a sum, over exact values, where products cancel.
    pub fn cancelled(&self, node: u32) -> Option<&LinearForm> {
        self.cancelled[node as usize].as_ref()
    }

    /// A form with its atoms of coefficient one taken apart, and the errors between.
    pub fn flattened(&self, form: &[FormTerm], depth: Depth) -> Flat {
        let mut flat = Flat::default();
        for t in form {
            let exact = match t.atom {
                Atom::Value(v) if depth == Depth::Cancelled && t.coefficient == Coefficient::One => self.cancelled(v),
                _ => None,
            };
            if let (Some(form), Atom::Value(v)) = (exact, t.atom) {
                flat.form.extend(form.iter().map(|u| u.signed(t.negative)));
                flat.slack.totals.push(v);
                continue;
            }
            let (inner, slack) = match t.atom {
                Atom::Value(v) if depth != Depth::Products => {
                    (&self.named[v as usize].form[..], &self.named[v as usize].slack)
                }
                _ => self.flat(t.atom),
            };
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
pub fn simplified(mut form: LinearForm) -> LinearForm {
    form.sort_unstable();
    let mut kept: LinearForm = Vec::with_capacity(form.len());
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
pub fn canonical(form: LinearForm) -> LinearForm {
    match form.first() {
        Some(t) if t.negative => form.into_iter().map(|t| t.signed(true)).collect(),
        _ => form,
    }
}

/// −form.
pub fn negated(form: &[FormTerm]) -> LinearForm {
    form.iter().map(|t| t.signed(true)).collect()
}

/// For each node, Σ over its users of partial derivative times adjoint, and the node that has the same adjoint up to its sign:
/// the sum, say, that alone uses it.
fn chain_rule(graph: &Graph, live: &[bool]) -> (Vec<LinearForm>, Vec<u32>) {
    let n = graph.ops.len();
    let mut chain = vec![LinearForm::new(); n];
    for r in &graph.results {
        let seed = FormTerm { coefficient: Coefficient::One, atom: Atom::Seed(r.0), negative: false };
        if !chain[r.index()].contains(&seed) {
            chain[r.index()].push(seed);
        }
    }
    let mut same: Vec<(u32, bool)> = (0..n as u32).map(|i| (i, false)).collect();
    // users stand behind what they use
    for id in (0..n as u32).rev().map(NodeId).filter(|id| live[id.index()]) {
        if let [FormTerm { coefficient: Coefficient::One, atom: Atom::Adjoint(user), negative }] = chain[id.index()][..]
        {
            same[id.index()] = (user, negative);
        }
        let (atom, sign) = (Atom::Adjoint(same[id.index()].0), same[id.index()].1);
        let mut uses = |a: NodeId, coefficient: Coefficient, negative: bool| {
            chain[a.index()].push(FormTerm { coefficient, atom, negative: negative != sign });
        };
        let mut by_slope = |slope: Slope, a: NodeId, other: NodeId| match slope {
            Slope::Zero => {}
            Slope::One => uses(a, Coefficient::One, false),
            Slope::MinusOne => uses(a, Coefficient::One, true),
            Slope::Other => uses(a, half(graph, other).unwrap_or(Coefficient::Node(other.0)), false),
            Slope::Reciprocal => uses(a, Coefficient::Reciprocal(other.0), false),
            Slope::MinusQuotient => uses(a, Coefficient::MinusQuotient(id.0), false),
            Slope::HalfReciprocal => uses(a, Coefficient::HalfReciprocal(id.0), false),
        };
        match graph.op(id) {
            Op::Input(_) | Op::Constant(_) => {}
            Op::Unary(op, a) => by_slope(op.row().slopes[0], a, a),
            Op::Binary(op, a, b) => {
                by_slope(op.row().slopes[0], a, b);
                by_slope(op.row().slopes[1], b, a);
            }
            Op::AngleSum(a, b) => [a, b].into_iter().for_each(|a| uses(a, Coefficient::One, false)),
            Op::SinCos(a) => uses(a, Coefficient::One, false),
            Op::Sin(p) => uses(p, Coefficient::ExactCos(p.0), false),
            Op::Cos(p) => uses(p, Coefficient::ExactMinusSin(p.0), false),
        }
    }
    (chain, same.into_iter().map(|(user, _)| user).collect())
}
