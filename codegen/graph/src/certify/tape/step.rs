//! One operation on ranges and bounds.

use crate::expr::{Binary, Unary};

/// One operation; operands are indices of earlier steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum TapeStep {
    /// Of the box.
    Input(u32),
    /// By its index.
    Constant(u32),
    Neg(u32),
    Add(u32, u32),
    Mul(u32, u32),
    Square(u32),
    /// Any other operation on a number.
    Unary(Unary, u32),
    /// Any other operation on two numbers.
    Binary(Binary, u32, u32),
    Sine(u32),
    Cosine(u32),
    /// A range, and how far on both sides.
    Widened(u32, u32),
    /// A range, and the magnitude that numbers in it have at most.
    Clipped(u32, u32),
    Intersection(u32, u32),
    Magnitude(u32),
    /// Of bounds, as all that follow.
    Sum(u32, u32),
    Product(u32, u32),
    RootOfBound(u32),
    Least(u32, u32),
    /// Of numbers up to a bound: the ends of this constant are the factor of the binade and what underflow adds.
    Rounding(u32, u32),
}

impl TapeStep {
    pub(super) fn operands(self) -> impl Iterator<Item = u32> {
        use TapeStep::*;
        let (a, b) = match self {
            Input(_) | Constant(_) => (None, None),
            Neg(a) | Square(a) | Unary(_, a) | Sine(a) | Cosine(a) | Magnitude(a) | RootOfBound(a) | Rounding(a, _) => {
                (Some(a), None)
            }
            Add(a, b)
            | Mul(a, b)
            | Binary(_, a, b)
            | Widened(a, b)
            | Clipped(a, b)
            | Intersection(a, b)
            | Sum(a, b)
            | Product(a, b)
            | Least(a, b) => (Some(a), Some(b)),
        };
        a.into_iter().chain(b)
    }

    pub(super) fn map(self, f: impl Fn(u32) -> u32) -> TapeStep {
        use TapeStep::*;
        match self {
            Input(_) | Constant(_) => self,
            Neg(a) => Neg(f(a)),
            Square(a) => Square(f(a)),
            Unary(op, a) => Unary(op, f(a)),
            Sine(a) => Sine(f(a)),
            Cosine(a) => Cosine(f(a)),
            Magnitude(a) => Magnitude(f(a)),
            RootOfBound(a) => RootOfBound(f(a)),
            Rounding(a, k) => Rounding(f(a), k),
            Add(a, b) => Add(f(a), f(b)),
            Mul(a, b) => Mul(f(a), f(b)),
            Binary(op, a, b) => Binary(op, f(a), f(b)),
            Widened(a, b) => Widened(f(a), f(b)),
            Clipped(a, b) => Clipped(f(a), f(b)),
            Intersection(a, b) => Intersection(f(a), f(b)),
            Sum(a, b) => Sum(f(a), f(b)),
            Product(a, b) => Product(f(a), f(b)),
            Least(a, b) => Least(f(a), f(b)),
        }
    }
}
