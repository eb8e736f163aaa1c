//! The numbers of one box, and of one result.

use super::super::forms::{Atom, Coefficient, FormTerm};
use super::super::interval::Interval;
use super::super::tape::{Enclosure, Pen, UpperBound};
use crate::expr::{Binary, Graph, Op, Unary};

/// Numbers of one box, and of one result.
#[derive(Clone, Default)]
pub(super) struct BoxState {
    /// Values, rounding included.
    pub(super) value: Vec<Enclosure>,
    /// Greatest rounding error of each node.
    pub(super) error: Vec<UpperBound>,
    /// How far each value may be from the exact one.
    pub(super) total_error: Vec<UpperBound>,
    /// Errors of roundings, of all nodes that share an adjoint, at the node that stands for them.
    pub(super) class_error: Vec<UpperBound>,
    /// Exact and computed sine and cosine of each pair.
    pub(super) sin_cos: Vec<[(Enclosure, Enclosure); 2]>,
    /// Adjoints for the result at hand.
    pub(super) adjoint: Vec<Enclosure>,
    /// How far they may be from those of the exact program; found where something is known of these.
    pub(super) adjoint_off: Vec<UpperBound>,
    pub(super) seed: u32,
    /// Norms of groups, with the round in which they were found; the first is 1.
    pub(super) norm: Vec<(u64, UpperBound)>,
    pub(super) box_round: u64,
    pub(super) result_round: u64,
    pub(super) round: u64,
    /// What all of them are computed by.
    pub(super) pen: Pen,
}

impl BoxState {
    /// A sum, and what the errors of a class are worth.
    pub(super) fn add_share(&mut self, sum: UpperBound, class: usize) -> UpperBound {
        let adjoint = self.pen.mag(self.adjoint[class]);
        let share = self.pen.mul_up(adjoint, self.class_error[class]);
        self.pen.add_up(sum, share)
    }

    pub(super) fn term(&mut self, graph: &Graph, t: &FormTerm) -> Enclosure {
        let BoxState { value, adjoint, sin_cos, pen, .. } = self;
        let value = |n: u32| value[n as usize];
        let atom = match t.atom {
            Atom::One => Enclosure::ONE,
            Atom::Value(v) => value(v),
            Atom::Half(v) => {
                let half = pen.constant(Interval::point(0.5));
                pen.mul(value(v), half)
            }
            Atom::Adjoint(v) => adjoint[v as usize],
            Atom::Seed(r) => {
                if r == self.seed {
                    Enclosure::ONE
                } else {
                    Enclosure::ZERO
                }
            }
        };
        if atom.x.is_zero() {
            return atom;
        }
        let factor = match t.coefficient {
            Coefficient::One => Enclosure::ONE,
            Coefficient::Node(n) => value(n),
            Coefficient::Sin(p) => sin_cos[p as usize][1].0,
            Coefficient::Cos(p) => sin_cos[p as usize][1].1,
            Coefficient::ExactCos(p) => sin_cos[p as usize][0].1,
            Coefficient::ExactMinusSin(p) => pen.neg(sin_cos[p as usize][0].0),
            Coefficient::Reciprocal(b) => pen.over(Enclosure::ONE, value(b)),
            Coefficient::MinusQuotient(n) => {
                let Op::Binary(Binary::Div, a, b) = graph.ops[n as usize] else { unreachable!("made for divisions") };
                let square = pen.square(value(b.0));
                let quotient = pen.over(value(a.0), square);
                pen.neg(quotient)
            }
            Coefficient::HalfReciprocal(n) => {
                let Op::Unary(Unary::Sqrt, a) = graph.ops[n as usize] else { unreachable!("made for roots") };
                let root = pen.sqrt(value(a.0));
                let both = pen.add(root, root);
                pen.over(Enclosure::ONE, both)
            }
        };
        let x = pen.mul(factor, atom);
        if t.negative {
            pen.neg(x)
        } else {
            x
        }
    }

    /// How large a term is.
    pub(super) fn size(&mut self, graph: &Graph, t: &FormTerm) -> f64 {
        let mark = self.pen.mark();
        let size = self.term(graph, t).x.mag();
        self.pen.forget(mark);
        size
    }
}
