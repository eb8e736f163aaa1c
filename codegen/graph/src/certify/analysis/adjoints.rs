//! Adjoints of a result, and how far those of the perturbed program may be from the exact ones.

use super::super::forms::{Atom, Coefficient, FormTerm};
use super::super::interval::Interval;
use super::super::norms::Bounded;
use super::super::tape::{Enclosure, Pen, UpperBound};
use super::state::BoxState;
use super::{Broken, ErrorAnalysis};
use crate::expr::{Binary, NodeId, Op};

impl ErrorAnalysis<'_> {
    /// Adjoints of all nodes for a result; those of nodes that it does not need stay zero.
    pub(super) fn adjoints(&mut self, cone: usize) {
        let result = self.cones[cone].0;
        let nodes = std::mem::take(&mut self.cones[cone].1);
        self.state.round += 1;
        self.state.result_round = self.state.round;
        self.state.seed = result.0;
        for &n in &nodes {
            let sums = self.adjoint_sums[n as usize].take().expect("live nodes have adjoints");
            let (chain, apart) = &sums;
            let mut adjoint = if self.is_broken(Broken::ChainRule) && chain.form.len() > 1 {
                self.part(&chain.form[1..], Enclosure::ZERO)
            } else {
                self.enclosure(chain)
            };
            if let Some(apart) = apart {
                let apart = self.enclosure(apart);
                adjoint = self.state.pen.intersect(adjoint, apart);
            }
            if !self.known_adjoints.is_empty() {
                let off = self.adjoint_off(chain);
                self.state.adjoint_off[n as usize] = off;
                if let Some(most) = self.known_adjoints.get(&(result.0, n)) {
                    let pen = &mut self.state.pen;
                    let exact = pen.constant(Interval::around_zero(*most));
                    let perturbed = pen.widened(exact, off);
                    adjoint = pen.intersect(adjoint, perturbed);
                }
            }
            self.adjoint_sums[n as usize] = Some(sums);
            self.state.adjoint[n as usize] = adjoint;
        }
        self.cones[cone].1 = nodes;
    }

    /// How far an adjoint of the perturbed program may be from that of the exact one, from those of its users:
    /// |c̃ ã − c a| ≤ |c̃| |ã − a| + |a| |c̃ − c|.
    fn adjoint_off(&mut self, chain: &Bounded) -> UpperBound {
        let mut sum = UpperBound::ZERO;
        for t in &*chain.form {
            let (Atom::Adjoint(_) | Atom::Seed(_)) = t.atom else { unreachable!("adjoints come from adjoints") };
            let of_user = self.state.term(self.graph, &FormTerm { coefficient: Coefficient::One, ..*t });
            let alone = FormTerm { coefficient: t.coefficient, atom: Atom::One, negative: false };
            let coefficient = self.state.term(self.graph, &alone);
            let coefficient_off = self.coefficient_off(t.coefficient);
            let BoxState { pen, adjoint_off, .. } = &mut self.state;
            if let Atom::Adjoint(u) = t.atom {
                let coefficient = pen.mag(coefficient);
                let part = pen.mul_up(coefficient, adjoint_off[u as usize]);
                sum = pen.add_up(sum, part);
            }
            let of_user = pen.mag(of_user);
            let part = pen.mul_up(of_user, coefficient_off);
            sum = pen.add_up(sum, part);
        }
        sum
    }

    /// How far a coefficient of the perturbed program may be from the exact one.
    fn coefficient_off(&mut self, coefficient: Coefficient) -> UpperBound {
        let kernel = self.format.trig_error(1.0);
        let BoxState { pen, value, total_error, .. } = &mut self.state;
        let off = |n: u32| total_error[n as usize];
        let reciprocal = |b: NodeId, pen: &mut Pen| {
            let reciprocal = pen.over(Enclosure::ONE, value[b.index()]);
            pen.mag(reciprocal)
        };
        match coefficient {
            Coefficient::One => UpperBound::ZERO,
            Coefficient::Node(n) => off(n),
            Coefficient::Sin(p) | Coefficient::Cos(p) => {
                let kernel = pen.number(kernel);
                pen.add_up(kernel, off(p))
            }
            Coefficient::ExactCos(p) | Coefficient::ExactMinusSin(p) => off(p),
            // |1/b̃ − 1/b| = |b̃ − b|/|b̃ b|
            Coefficient::Reciprocal(b) => {
                let r = reciprocal(NodeId(b), pen);
                let square = pen.mul_up(r, r);
                pen.mul_up(square, off(b))
            }
            // |ã/b̃² − a/b²| ≤ |ã − a|/b̃² + |a| |b̃ − b| |b̃ + b|/(b̃ b)²
            Coefficient::MinusQuotient(n) => {
                let Op::Binary(Binary::Div, a, b) = self.graph.ops[n as usize] else {
                    unreachable!("made for divisions")
                };
                let r = reciprocal(b, pen);
                let square = pen.mul_up(r, r);
                let two = pen.number(2.0);
                let size = pen.mag(value[a.index()]);
                let shifted = pen.mul_up(two, size);
                let shifted = pen.mul_up(shifted, r);
                let shifted = pen.mul_up(shifted, off(b.0));
                let sum = pen.add_up(off(a.0), shifted);
                pen.mul_up(square, sum)
            }
            // nothing is known of programs with roots
            Coefficient::HalfReciprocal(_) => pen.number(f64::INFINITY),
        }
    }
}
