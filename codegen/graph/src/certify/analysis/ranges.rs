//! Ranges of all values over a box, and the rounding errors of all of them.

use super::super::format::FloatFormat;
use super::super::forms::Atom;
use super::super::interval::{add_up, Interval};
use super::super::tape::{Enclosure, Pen, UpperBound};
use super::state::BoxState;
use super::{Broken, ErrorAnalysis, NoCertificate};
use crate::expr::op::Slope;
use crate::expr::{Binary, NodeId, Op, Precision, Unary};
use crate::number::Scalar;

impl ErrorAnalysis<'_> {
    pub(super) fn find_ranges(&mut self, inputs: &[Interval], writes: bool) -> Result<(), NoCertificate> {
        self.state.pen.start(writes);
        self.state.round += 1;
        self.state.box_round = self.state.round;
        for i in 0..self.graph.ops.len() {
            let (exact, mut error) = self.exact_range(i, inputs)?;
            if let Some(given) = &self.given {
                error = self.state.pen.number(given[i]);
            }
            let is_constant = matches!(self.graph.ops[i], Op::Constant(_));
            let mut range =
                if is_constant && self.given.is_none() { exact } else { self.state.pen.widened(exact, error) };
            let carried = self.carried_error(i);
            self.state.total_error[i] = self.state.pen.add_up(carried, error);
            if let Some(form) = self.cancelled[i].take() {
                let mut exact = self.enclosure(&form);
                if self.is_broken(Broken::Cancelled) {
                    let less = self.state.pen.number(0.4 * exact.x.mag());
                    exact = self.state.pen.clipped(exact, less);
                }
                let computed = self.state.pen.widened(exact, self.state.total_error[i]);
                range = self.state.pen.intersect(range, computed);
                self.cancelled[i] = Some(form);
            }
            if let Some(Some(exact)) = self.known.get(i) {
                let pen = &mut self.state.pen;
                let exact = pen.constant(*exact);
                let computed = pen.widened(exact, self.state.total_error[i]);
                range = pen.intersect(range, computed);
            }
            if range.x.mag().is_nan() || range.x.mag() >= self.format.largest {
                return Err(NoCertificate::Overflow);
            }
            self.state.value[i] = range;
            self.state.error[i] = error;
        }
        self.class_errors();
        Ok(())
    }

    /// How far the errors of its operands take a value from the exact one. Ranges hold both.
    fn carried_error(&mut self, i: usize) -> UpperBound {
        let BoxState { total_error, value, pen, .. } = &mut self.state;
        let error = |a: NodeId| total_error[a.index()];
        let value = |a: NodeId| value[a.index()];
        match self.graph.ops[i] {
            Op::Input(_) | Op::Constant(_) => UpperBound::ZERO,
            Op::SinCos(a) | Op::Sin(a) | Op::Cos(a) => error(a),
            Op::AngleSum(a, b) => pen.add_up(error(a), error(b)),
            // |â/b̂ − a/b| ≤ (|â − a| + |a/b| |b̂ − b|) / |b̂|
            Op::Binary(Binary::Div, a, b) => {
                let quotient = pen.over(value(a), value(b));
                let quotient = pen.mag(quotient);
                let shifted = pen.mul_up(quotient, error(b));
                let sum = pen.add_up(error(a), shifted);
                let reciprocal = pen.over(Enclosure::ONE, value(b));
                let reciprocal = pen.mag(reciprocal);
                pen.mul_up(sum, reciprocal)
            }
            Op::Unary(op, a) => {
                carried(pen, op.row().slopes[0], error(a), [value(a); 2], &|pen| pen.unary(op, value(a)))
            }
            Op::Binary(op, a, b) => {
                let v = |pen: &mut Pen| pen.binary(op, value(a), value(b));
                let of_a = carried(pen, op.row().slopes[0], error(a), [value(a), value(b)], &v);
                let of_b = carried(pen, op.row().slopes[1], error(b), [value(b), value(a)], &v);
                pen.add_up(of_a, of_b)
            }
        }
    }

    /// The errors of all nodes that share an adjoint, added up.
    fn class_errors(&mut self) {
        let mut class_error = vec![UpperBound::ZERO; self.graph.ops.len()];
        let mut error = self.state.error.clone();
        // what follows takes errors that grow with values
        let products = if self.given.is_some() { 0 } else { self.sharing.products.len() };
        for k in 0..products {
            // |x c| + |y s| ≤ ‖(x, y)‖ ‖(c, s)‖, each product rounded by u of itself at most
            let (a, b, pair, group) = self.sharing.products[k];
            let norm = self.norm(group);
            let (stretch, unit) = (self.stretch(pair), self.unit(a, b));
            let pen = &mut self.state.pen;
            let (stretch, unit, least) = (pen.number(stretch), pen.number(unit), pen.number(4.0 * self.format.tiny));
            let norm = pen.mul_up(stretch, norm);
            let rounding = pen.mul_up(unit, norm);
            let together = pen.add_up(rounding, least);
            let apart = pen.add_up(error[a], error[b]);
            if together.x < apart.x {
                (error[a], error[b]) = (pen.least(together, apart), UpperBound::ZERO);
            }
        }
        for (i, e) in error.into_iter().enumerate().filter(|(_, e)| e.x > 0.0) {
            let class = self.sharing.class[i];
            class_error[class] = self.state.pen.add_up(class_error[class], e);
        }
        self.state.class_error = class_error;
    }

    /// What rounding node i to its formats can do.
    fn rounding(&mut self, i: usize, range: Enclosure) -> UpperBound {
        let Precision { computed, held } = self.precision(i);
        let own = self.format;
        let pen = &mut self.state.pen;
        let magnitude = pen.mag(range);
        let mut to = |scalar: Scalar| {
            let format = format_of(own, scalar);
            pen.rounding(magnitude, format.rounding(magnitude.x), 0.5 * format.u, format.tiny)
        };
        let handed_on = to(held);
        if computed == held {
            return handed_on;
        }
        let before = to(computed);
        pen.add_up(handed_on, before)
    }

    /// u of two values that are bounded together.
    fn unit(&self, a: usize, b: usize) -> f64 {
        let [x, y] = [a, b].map(|i| self.precision(i));
        let u = |scalar: Scalar| format_of(self.format, scalar).u;
        if x == y && !x.is_rounded() {
            return u(x.held);
        }
        add_up(self.format.u, u(self.graph.widest(self.format.scalar)))
    }

    fn precision(&self, i: usize) -> Precision {
        self.graph.precision(NodeId(i as u32), self.format.scalar)
    }

    /// The range of an operation on computed operands, before its own rounding, and the bound of that.
    fn exact_range(&mut self, i: usize, inputs: &[Interval]) -> Result<(Enclosure, UpperBound), NoCertificate> {
        let format = self.format;
        let v = |this: &Self, a: NodeId| this.state.value[a.index()];
        let rounded = |this: &mut Self, x: Enclosure| Ok((x, this.rounding(i, x)));
        Ok(match self.graph.ops[i] {
            Op::Input(k) => {
                let x = inputs[k as usize];
                // a number below the normal ones may be read as zero
                let subnormal = x.lo < format.tiny && x.hi > -format.tiny && !x.is_zero();
                let error = if subnormal { format.tiny } else { 0.0 };
                (self.state.pen.input(k, x), self.state.pen.number(error))
            }
            Op::Constant(c) => {
                // the range holds both the exact and the rounded value
                let format = format_of(format, self.precision(i).held);
                let (range, error) = format.constant(c.value());
                let error = if self.is_broken(Broken::Constants) { 0.0 } else { error };
                (self.state.pen.constant(range), self.state.pen.number(error))
            }
            Op::Unary(Unary::Sign, a) => {
                let sign = v(self, a).x.sign();
                if sign.has_zero() && !matches!(self.graph.op(a), Op::Input(_)) {
                    return Err(NoCertificate::Sign);
                }
                (self.state.pen.constant(sign), UpperBound::ZERO)
            }
            Op::Unary(op, a) => {
                if op == Unary::Sqrt && v(self, a).x.lo <= 0.0 {
                    return Err(NoCertificate::Division);
                }
                let value = self.state.pen.unary(op, v(self, a));
                if !op.row().is_exact {
                    return rounded(self, value);
                }
                if !self.precision(i).is_rounded() {
                    return Ok((value, UpperBound::ZERO));
                }
                let magnitude = self.state.pen.mag(value);
                let error = format.rounding(magnitude.x);
                (value, self.state.pen.rounding(magnitude, error, 0.5 * format.u, format.tiny))
            }
            Op::Binary(op, a, b) => return self.exact_binary(i, op, a, b),
            // formed exactly: what rounding loses goes into the reduction
            Op::AngleSum(a, b) => (self.state.pen.add(v(self, a), v(self, b)), UpperBound::ZERO),
            Op::SinCos(a) => {
                let angle = v(self, a);
                if angle.x.mag() > format.trig_domain {
                    return Err(NoCertificate::Overflow);
                }
                let pen = &mut self.state.pen;
                let (sin, cos) = pen.sin_cos(angle);
                let e = pen.number(format.trig_error(1.0));
                self.state.sin_cos[i] = [(sin, cos), (pen.widened(sin, e), pen.widened(cos, e))];
                (angle, UpperBound::ZERO)
            }
            Op::Sin(p) => self.half(self.state.sin_cos[p.index()][0].0),
            Op::Cos(p) => self.half(self.state.sin_cos[p.index()][0].1),
        })
    }

    /// [`ErrorAnalysis::exact_range`] of an operation on two numbers.
    fn exact_binary(
        &mut self,
        i: usize,
        op: Binary,
        a: NodeId,
        b: NodeId,
    ) -> Result<(Enclosure, UpperBound), NoCertificate> {
        let [x, y] = [a, b].map(|a| self.state.value[a.index()]);
        if op == Binary::Div && y.x.has_zero() {
            return Err(NoCertificate::Division);
        }
        if op == Binary::Mul && a == b {
            let square = self.state.pen.square(x);
            return Ok((square, self.rounding(i, square)));
        }
        let mut value = self.state.pen.binary(op, x, y);
        if self.sums[i].is_some() {
            value = self.sum(i, value);
        }
        if let Some(group) = self.products[i] {
            // |a b| ≤ (a² + b²)/2
            let norm = self.norm(group);
            let half = self.state.pen.number(0.5);
            let square = self.state.pen.mul_up(norm, norm);
            let most = self.state.pen.mul_up(half, square);
            value = self.state.pen.clipped(value, most);
        }
        let is_plain = self.precision(i) == Precision::of(self.format.scalar);
        let is_shift = op == Binary::Mul && is_plain && (self.is_power_of_two(a) || self.is_power_of_two(b));
        let error = match (is_shift, op.row().is_exact) {
            (true, _) => self.state.pen.number(self.format.tiny),
            (false, true) => UpperBound::ZERO,
            (false, false) => self.rounding(i, value),
        };
        Ok((value, error))
    }

    /// A sine or cosine, and its error.
    fn half(&mut self, exact: Enclosure) -> (Enclosure, UpperBound) {
        let magnitude = self.state.pen.mag(exact);
        let error = self.format.trig_error(magnitude.x);
        let (unit, absolute) = self.format.trig_parts();
        (exact, self.state.pen.rounding(magnitude, error, unit, absolute))
    }

    fn is_power_of_two(&self, id: NodeId) -> bool {
        match self.graph.op(id) {
            Op::Constant(c) => {
                let x = self.format.round(c.value()).abs();
                x.is_normal() && x.to_bits() & ((1 << 52) - 1) == 0
            }
            _ => false,
        }
    }

    /// The range of a sum, from that of its operands and from its form.
    fn sum(&mut self, i: usize, direct: Enclosure) -> Enclosure {
        let sum = self.sums[i].take().expect("sums have forms");
        let enclosure = self.enclosure(&sum);
        self.sums[i] = Some(sum);
        let (_, slack) = self.forms.flat(Atom::Value(i as u32));
        let BoxState { error, pen, .. } = &mut self.state;
        let others = slack.nodes.iter().filter(|n| **n as usize != i);
        let slack = others.fold(UpperBound::ZERO, |s, n| pen.add_up(s, error[*n as usize]));
        let enclosure = pen.widened(enclosure, slack);
        pen.intersect(direct, enclosure)
    }
}

/// The format of a scalar, where an analysis is made in this one.
fn format_of(own: FloatFormat, scalar: Scalar) -> FloatFormat {
    if scalar == own.scalar {
        own
    } else {
        FloatFormat::of(scalar)
    }
}

/// What the error of an operand does to a value: |f(â) − f(a)| ≤ sup |f′| |â − a|, as ranges hold computed operands and exact ones. Of
/// products |â b̂ − a b| ≤ |â| |b̂ − b| + |b| |â − a|, of roots |√â − √a| = |â − a|/(√â + √a).
fn carried(
    pen: &mut Pen,
    slope: Slope,
    error: UpperBound,
    [operand, other]: [Enclosure; 2],
    value: &dyn Fn(&mut Pen) -> Enclosure,
) -> UpperBound {
    let slope = match slope {
        Slope::Zero => return UpperBound::ZERO,
        Slope::One | Slope::MinusOne => return error,
        Slope::Other => other,
        Slope::Reciprocal => pen.over(Enclosure::ONE, other),
        Slope::MinusQuotient => {
            let value = value(pen);
            pen.over(value, operand)
        }
        Slope::HalfReciprocal => {
            let value = value(pen);
            let both = pen.add(value, value);
            pen.over(Enclosure::ONE, both)
        }
    };
    let slope = pen.mag(slope);
    pen.mul_up(slope, error)
}
