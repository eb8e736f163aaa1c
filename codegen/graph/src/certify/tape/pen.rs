//! What computes ranges and bounds, and writes down how.

use super::super::interval::{add_up, mul_up, Interval};
use super::step::TapeStep;
use super::{Enclosure, UpperBound, ZERO};
use crate::expr::{Binary, Unary};

/// What is so much above another bound in the whole box is not expected to be the least in any part.
const FAR: f64 = 1.5;

/// A place among the steps.
#[derive(Clone, Copy, Debug)]
pub(in crate::certify) struct Mark(pub(super) usize);

/// Computes, and writes down what it computes, if it is told to.
#[derive(Clone, Debug, Default)]
pub(in crate::certify) struct Pen {
    pub(super) writes: bool,
    pub(super) steps: Vec<TapeStep>,
    pub(super) constants: Vec<Interval>,
}

impl Pen {
    /// From here on, writes or does not; what was written before is gone.
    pub fn start(&mut self, writes: bool) {
        self.writes = writes;
        self.constants.clear();
        self.steps.clear();
        self.constant(Interval::ZERO);
        self.constant(Interval::ONE);
    }

    pub fn mark(&self) -> Mark {
        Mark(self.steps.len())
    }

    /// Forgets what was written since.
    pub fn forget(&mut self, mark: Mark) {
        self.steps.truncate(mark.0);
    }

    #[inline]
    fn write(&mut self, step: TapeStep) -> u32 {
        if !self.writes {
            return ZERO;
        }
        self.steps.push(step);
        u32::try_from(self.steps.len() - 1).expect("steps are forgotten after each result")
    }

    fn write_constant(&mut self, x: Interval) -> u32 {
        if !self.writes {
            return ZERO;
        }
        let index = self.index(x);
        self.write(TapeStep::Constant(index))
    }

    fn index(&mut self, x: Interval) -> u32 {
        // the same few numbers again and again
        let near = self.constants.len().saturating_sub(4);
        let known = self.constants[near..].iter().position(|c| *c == x);
        let index = known.map_or(self.constants.len(), |k| near + k);
        if known.is_none() {
            self.constants.push(x);
        }
        index as u32
    }

    pub fn input(&mut self, k: u32, x: Interval) -> Enclosure {
        Enclosure { x, at: self.write(TapeStep::Input(k)) }
    }

    /// A range that does not depend on the box.
    pub fn constant(&mut self, x: Interval) -> Enclosure {
        Enclosure { x, at: self.write_constant(x) }
    }

    /// A bound that does not depend on the box.
    pub fn number(&mut self, x: f64) -> UpperBound {
        if x == 0.0 {
            return UpperBound::ZERO;
        }
        UpperBound { x, at: self.write_constant(Interval::point(x)) }
    }

    pub fn neg(&mut self, a: Enclosure) -> Enclosure {
        if a.x.is_zero() {
            return a;
        }
        Enclosure { x: -a.x, at: self.write(TapeStep::Neg(a.at)) }
    }

    #[inline]
    pub fn add(&mut self, a: Enclosure, b: Enclosure) -> Enclosure {
        if a.x.is_zero() {
            return b;
        }
        if b.x.is_zero() {
            return a;
        }
        Enclosure { x: a.x + b.x, at: self.write(TapeStep::Add(a.at, b.at)) }
    }

    pub fn sub(&mut self, a: Enclosure, b: Enclosure) -> Enclosure {
        let minus = self.neg(b);
        self.add(a, minus)
    }

    #[inline]
    pub fn mul(&mut self, a: Enclosure, b: Enclosure) -> Enclosure {
        if a.x.is_zero() || b.x == Interval::ONE {
            return a;
        }
        if b.x.is_zero() || a.x == Interval::ONE {
            return b;
        }
        Enclosure { x: a.x * b.x, at: self.write(TapeStep::Mul(a.at, b.at)) }
    }

    pub fn square(&mut self, a: Enclosure) -> Enclosure {
        Enclosure { x: a.x.square(), at: self.write(TapeStep::Square(a.at)) }
    }

    pub fn over(&mut self, a: Enclosure, b: Enclosure) -> Enclosure {
        self.binary(Binary::Div, a, b)
    }

    pub fn sqrt(&mut self, a: Enclosure) -> Enclosure {
        self.unary(Unary::Sqrt, a)
    }

    pub fn unary(&mut self, op: Unary, a: Enclosure) -> Enclosure {
        match op {
            Unary::Neg => self.neg(a),
            op => Enclosure { x: op.range(a.x), at: self.write(TapeStep::Unary(op, a.at)) },
        }
    }

    pub fn binary(&mut self, op: Binary, a: Enclosure, b: Enclosure) -> Enclosure {
        match op {
            Binary::Add => self.add(a, b),
            Binary::Sub => self.sub(a, b),
            Binary::Mul => self.mul(a, b),
            op => Enclosure { x: op.range(a.x, b.x), at: self.write(TapeStep::Binary(op, a.at, b.at)) },
        }
    }

    pub fn sin_cos(&mut self, a: Enclosure) -> (Enclosure, Enclosure) {
        let (sin, cos) = a.x.sin_cos();
        (
            Enclosure { x: sin, at: self.write(TapeStep::Sine(a.at)) },
            Enclosure { x: cos, at: self.write(TapeStep::Cosine(a.at)) },
        )
    }

    pub fn widened(&mut self, a: Enclosure, h: UpperBound) -> Enclosure {
        if h.x == 0.0 {
            return a;
        }
        Enclosure { x: a.x.widened(h.x), at: self.write(TapeStep::Widened(a.at, h.at)) }
    }

    pub fn clipped(&mut self, a: Enclosure, magnitude: UpperBound) -> Enclosure {
        if magnitude.x > FAR * a.x.mag() {
            return a;
        }
        Enclosure { x: a.x.clipped(magnitude.x), at: self.write(TapeStep::Clipped(a.at, magnitude.at)) }
    }

    pub fn intersect(&mut self, a: Enclosure, b: Enclosure) -> Enclosure {
        let wide = Interval { lo: a.x.lo - FAR * a.x.mag(), hi: a.x.hi + FAR * a.x.mag() };
        if b.x.lo < wide.lo && wide.hi < b.x.hi {
            return a;
        }
        Enclosure { x: a.x.intersect(b.x), at: self.write(TapeStep::Intersection(a.at, b.at)) }
    }

    pub fn mag(&mut self, a: Enclosure) -> UpperBound {
        if a.x.is_zero() {
            return UpperBound::ZERO;
        }
        UpperBound { x: a.x.mag(), at: self.write(TapeStep::Magnitude(a.at)) }
    }

    #[inline]
    pub fn add_up(&mut self, a: UpperBound, b: UpperBound) -> UpperBound {
        if a.x == 0.0 {
            return b;
        }
        if b.x == 0.0 {
            return a;
        }
        UpperBound { x: add_up(a.x, b.x), at: self.write(TapeStep::Sum(a.at, b.at)) }
    }

    #[inline]
    pub fn mul_up(&mut self, a: UpperBound, b: UpperBound) -> UpperBound {
        if a.x == 0.0 || b.x == 0.0 {
            return UpperBound::ZERO;
        }
        UpperBound { x: mul_up(a.x, b.x), at: self.write(TapeStep::Product(a.at, b.at)) }
    }

    pub fn least(&mut self, a: UpperBound, b: UpperBound) -> UpperBound {
        if a.x > FAR * b.x {
            return b;
        }
        if b.x > FAR * a.x {
            return a;
        }
        UpperBound { x: a.x.min(b.x), at: self.write(TapeStep::Least(a.at, b.at)) }
    }

    /// √(a² + …) of what is added one by one to [`UpperBound::ZERO`].
    pub fn add_square(&mut self, norm: &mut Norm, a: UpperBound) {
        if a.x != 0.0 {
            let square = UpperBound { x: (a.x * a.x).next_up(), at: self.write(TapeStep::Product(a.at, a.at)) };
            norm.sum = self.add_up(norm.sum, square);
            norm.last = a;
            norm.count += 1;
        }
    }

    pub fn root(&mut self, norm: Norm) -> UpperBound {
        match norm.count {
            0 | 1 => norm.last,
            _ => UpperBound { x: norm.sum.x.sqrt().next_up(), at: self.write(TapeStep::RootOfBound(norm.sum.at)) },
        }
    }

    /// `error`: what rounding numbers up to `magnitude` loses, `factor` times their binade and `tiny`.
    pub fn rounding(&mut self, magnitude: UpperBound, error: f64, factor: f64, tiny: f64) -> UpperBound {
        if !self.writes || magnitude.x == 0.0 {
            return UpperBound { x: error, at: ZERO };
        }
        let constant = self.index(Interval { lo: factor, hi: tiny });
        UpperBound { x: error, at: self.write(TapeStep::Rounding(magnitude.at, constant)) }
    }
}

/// A sum of squares.
#[derive(Clone, Copy, Debug)]
pub(in crate::certify) struct Norm {
    sum: UpperBound,
    last: UpperBound,
    count: usize,
}

impl Norm {
    pub const ZERO: Norm = Norm { sum: UpperBound::ZERO, last: UpperBound::ZERO, count: 0 };
}
