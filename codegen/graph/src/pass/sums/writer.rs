//! Back to a graph.

use super::{SignedValue, SumTable, Term};
use crate::expr::{Graph, GraphBuilder, NodeId, Note, Op};

/// Back to a graph.
pub(super) struct SumWriter<'a> {
    pub(super) table: &'a SumTable,
    pub(super) graph: &'a Graph,
    pub(super) uses: Vec<u32>,
    pub(super) builder: GraphBuilder,
    /// The node of a value, and whether it is the value's negative.
    pub(super) written: Vec<Option<(NodeId, bool)>>,
}

impl SumWriter<'_> {
    /// The node of a value, and whether it is the value's negative.
    pub(super) fn value(&mut self, value: usize) -> (NodeId, bool) {
        if let Some(done) = self.written[value] {
            return done;
        }
        let written = match &self.table.values[value] {
            SignedValue::Constant(c) => (self.builder.insert(Op::Constant(*c)), false),
            SignedValue::Product(..) => {
                let [a, b] = self.table.factors(value);
                let ((a, s), (b, t)) = (self.term(a), self.term(b));
                (self.builder.insert(Op::mul(a.min(b), a.max(b))), s != t)
            }
            SignedValue::Sum(_) => self.sum(&self.table.terms(value).collect::<Vec<_>>()),
            SignedValue::Same(_) => unreachable!("terms are resolved"),
            SignedValue::Other(op, operands) => {
                let operands: Vec<NodeId> = operands.iter().flatten().map(|t| self.signed(*t)).collect();
                let mut given = operands.into_iter();
                let op = op.map(|_| given.next().expect("as many operands as before"));
                let node = self.builder.insert(op);
                if let Op::SinCos(_) = op {
                    // the halves stand right behind the pair
                    self.builder.insert(Op::Sin(node));
                    self.builder.insert(Op::Cos(node));
                }
                (node, false)
            }
        };
        self.written[value] = Some(written);
        if let Some(Note { name: Some(name), .. }) = self.table.origin[value].map(|id| self.graph.notes[id.index()]) {
            if !written.1 {
                self.builder.name(written.0, name);
            }
        }
        written
    }

    fn term(&mut self, term: Term) -> (NodeId, bool) {
        let term = self.table.resolved(term);
        let (node, negative) = self.value(term.value());
        (node, negative != term.is_negative())
    }

    /// The node of a term, negated if need be.
    pub(super) fn signed(&mut self, term: Term) -> NodeId {
        let term = self.table.resolved(term);
        if let SignedValue::Constant(c) = &self.table.values[term.value()] {
            let c = c.value();
            return self.builder.constant(if term.is_negative() { -c } else { c });
        }
        match self.term(term) {
            (node, false) => node,
            (node, true) => self.builder.insert(Op::neg(node)),
        }
    }

    /// Terms that are not fused first, then the products that are.
    fn sum(&mut self, terms: &[Term]) -> (NodeId, bool) {
        let fuses = |t: &Term| self.table.is_product(*t) && self.uses[t.value()] == 1;
        let (products, rest): (Vec<Term>, Vec<Term>) = terms.iter().partition(|t| fuses(t));
        let rest: Vec<(NodeId, bool)> = rest.into_iter().map(|t| self.term(t)).collect();
        let mut left = rest;
        // a product is written where it is added
        let mut waiting = products.into_iter();
        if left.len() < 2 {
            left.extend(waiting.next().map(|t| self.term(t)));
        }
        if left.len() < 2 {
            left.extend(waiting.next().map(|t| self.term(t)));
        }
        // lead with a positive term, or turn all signs
        let lead = left.iter().position(|t| !t.1);
        let turned = lead.is_none();
        let (mut sum, _) = left.remove(lead.unwrap_or(0));
        let mut add = |builder: &mut GraphBuilder, (node, negative): (NodeId, bool)| {
            sum = builder.insert(match negative != turned {
                true => Op::sub(sum, node),
                false => Op::add(sum, node),
            });
        };
        for t in left {
            add(&mut self.builder, t);
        }
        for t in waiting {
            let t = self.term(t);
            add(&mut self.builder, t);
        }
        (sum, turned)
    }
}
