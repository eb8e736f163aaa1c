//! The operations: a row of a table each.
//!
//! A program's node is a leaf (an input or a constant), an operation that makes a number of one or two numbers, or belongs to an angle: sums
//! of angles and pairs of sine and cosine are no numbers, and have rules of their own. Of an operation on numbers the tables below say all
//! that passes ask: how it is computed, in any scalar and over intervals, its derivatives, what rounds, what it costs, how it is written.
//!
//! # Another operation
//!
//! `Exp` or `Min` is one row, and a method of [`Real`] and of [`Interval`] of that name where they have none. It is then traced, folded,
//! counted, evaluated, differentiated, scheduled and written; sums, factors and values formed anew leave it as a value of its own.
//! What is particular to it, and where:
//!
//! * algebra, if it has any: a rule (`rules.rs`);
//! * where it is defined at all, and a bound of the errors of operands that is better than derivatives give, if there is one:
//!   `certify/analysis`; the program that bounds its error at a state: `certify/running.rs`, where the compiler asks for it;
//! * how its text is read back: `readback` of the compiler, which has no text from this table, so that it can be wrong in one place only;
//! * how it is counted, if not as one of those there are: [`Counted`] and [`Counts`](super::Counts);
//! * a [`Slope`] that no other operation has: its product there, and its range in `certify/analysis`.

use super::NodeId;
use crate::certify::Interval;
use straightline_core::{Dd, Real};

/// What is known of an operation on numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OpRow {
    /// What people call it.
    pub name: &'static str,
    /// How it is written.
    pub text: Text,
    /// What a use of it adds to [counts](super::Counts).
    pub counted: Counted,
    /// Whether its result is as exact as its operands.
    pub is_exact: bool,
    /// What kind of function of its operands it is.
    pub kind: OpKind,
    /// Whether operands may change places: the same bits.
    pub commutes: bool,
    /// The derivatives by the operands, in order.
    pub slopes: &'static [Slope],
}

impl OpRow {
    /// Whether it is written as a call of a function.
    pub const fn is_a_call(&self) -> bool {
        matches!(self.text, Text::Call(_))
    }
}

/// How an operation is written in languages with the usual operators; which bind the more tightly, the later they stand here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Text {
    /// Between its operands, as + is.
    Sum(&'static str),
    /// Between its operands, as · is.
    Product(&'static str),
    /// Before its operand.
    Sign(&'static str),
    /// A function.
    Call(&'static str),
}

/// Which of the [counts](super::Counts) an operation belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    /// Changes of sign and signs.
    Free,
    /// An addition or subtraction.
    Addition,
    /// A multiplication.
    Multiplication,
    /// A division.
    Division,
    /// A square root.
    Root,
}

/// What kind of function of its operands an operation is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum OpKind {
    /// A polynomial.
    Polynomial,
    /// A quotient of polynomials: with poles.
    Rational,
    /// Any other.
    Other,
}

/// The derivative of an operation by one of its operands, in terms of these and of its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slope {
    /// 0.
    Zero,
    /// 1.
    One,
    /// −1.
    MinusOne,
    /// The other operand.
    Other,
    /// 1/b of the other operand b.
    Reciprocal,
    /// −v/b of the value v and the operand b itself.
    MinusQuotient,
    /// 1/(2 v) of the value v.
    HalfReciprocal,
}

impl Slope {
    /// What an adjoint of the value hands on to the operand, of which the other one is `other` (itself, where there is none); none if it
    /// is zero.
    pub fn times<T: Real>(self, adjoint: T, operand: T, other: T, value: T) -> Option<T> {
        match self {
            Slope::Zero => None,
            Slope::One => Some(adjoint),
            Slope::MinusOne => Some(-adjoint),
            Slope::Other => Some(adjoint * other),
            Slope::Reciprocal => Some(adjoint / other),
            Slope::MinusQuotient => Some(-(adjoint / operand * value)),
            Slope::HalfReciprocal => Some(adjoint * T::constant(Dd::HALF) / value),
        }
    }
}

/// A table of operations on so many operands. `of` makes the one on given nodes, `value` its value in any scalar,
/// and its range where operands are intervals.
macro_rules! operations {
    ($(#[$about:meta])* $Table:ident($($operand:ident),+):
     $($(#[$doc:meta])* $Name:ident {
        of: $of:ident($($node:ident),+), text: $text:ident($written:literal), counted: $counted:ident, is_exact: $is_exact:literal, kind: $kind:ident,
        commutes: $commutes:literal, slopes: [$($slope:ident),+], value: $value:expr $(,)?
     })+) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub enum $Table {
            $($(#[$doc])* $Name,)+
        }

        impl $Table {
            /// All of them.
            pub const ALL: &'static [$Table] = &[$($Table::$Name),+];

            /// What is known of it.
            #[inline]
            pub const fn row(self) -> &'static OpRow {
                const ROWS: &[OpRow] = &[$(OpRow {
                    name: stringify!($of),
                    text: Text::$text($written),
                    counted: Counted::$counted,
                    is_exact: $is_exact,
                    kind: OpKind::$kind,
                    commutes: $commutes,
                    slopes: &[$(Slope::$slope),+],
                }),+];
                &ROWS[self as usize]
            }

            /// The value on these operands, in their scalar.
            #[inline]
            pub fn value<T: Real>(self, $($operand: T),+) -> T {
                match self {
                    $($Table::$Name => $value,)+
                }
            }

            /// The range of its values, rounded outwards, of operands in these ranges.
            #[inline]
            pub fn range(self, $($operand: Interval),+) -> Interval {
                match self {
                    $($Table::$Name => $value,)+
                }
            }
        }

        impl super::Op {
            $($(#[$doc])* pub const fn $of($($node: NodeId),+) -> Self {
                super::Op::$Table($Table::$Name, $($node),+)
            })+
        }
    };
}

operations! {
    /// The operations on one number.
    Unary(a):
    /// −a.
    Neg {
        of: neg(a), text: Sign("-"), counted: Free, is_exact: true, kind: Polynomial, commutes: false,
        slopes: [MinusOne], value: -a,
    }
    /// √a.
    Sqrt {
        of: sqrt(a), text: Call("sqrt"), counted: Root, is_exact: false, kind: Other, commutes: false,
        slopes: [HalfReciprocal], value: a.sqrt(),
    }
    /// −1, 0 or 1.
    Sign {
        of: sign(a), text: Call("sign"), counted: Free, is_exact: true, kind: Other, commutes: false,
        slopes: [Zero], value: a.sign(),
    }
}

operations! {
    /// The operations on two numbers.
    Binary(a, b):
    /// a + b.
    Add {
        of: add(a, b), text: Sum("+"), counted: Addition, is_exact: false, kind: Polynomial, commutes: true,
        slopes: [One, One], value: a + b,
    }
    /// a − b.
    Sub {
        of: sub(a, b), text: Sum("-"), counted: Addition, is_exact: false, kind: Polynomial, commutes: false,
        slopes: [One, MinusOne], value: a - b,
    }
    /// a · b.
    Mul {
        of: mul(a, b), text: Product("*"), counted: Multiplication, is_exact: false, kind: Polynomial, commutes: true,
        slopes: [Other, Other], value: a * b,
    }
    /// a / b.
    Div {
        of: div(a, b), text: Product("/"), counted: Division, is_exact: false, kind: Rational, commutes: false,
        slopes: [Reciprocal, MinusQuotient], value: a / b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: [f64; 2] = [0.7, -1.9];
    const STEP: f64 = 1e-9;

    /// In double-double, against central differences.
    fn is_slope(slope: Slope, operands: [Dd; 2], k: usize, value: &dyn Fn([Dd; 2]) -> Dd) -> bool {
        let at = |step: f64| {
            let mut moved = operands;
            moved[k] += Dd::from(step);
            value(moved)
        };
        let expected = (at(STEP) - at(-STEP)) / Dd::from(2.0 * STEP);
        let found = slope.times(Dd::ONE, operands[k], operands[1 - k], value(operands)).unwrap_or(Dd::ZERO);
        (found - expected).to_f64().abs() < 1e-15
    }

    /// Graphs are vectors and hash maps of these.
    #[test]
    fn a_node_takes_no_more_room_than_its_constant_and_a_word() {
        assert_eq!(size_of::<super::super::Op>(), 24);
    }

    #[test]
    fn slopes_are_those_of_values() {
        let [x, y] = AT.map(Dd::from);
        for op in Unary::ALL {
            assert_eq!(op.row().slopes.len(), 1, "{op:?}");
            assert!(is_slope(op.row().slopes[0], [x, x], 0, &|[x, _]| op.value(x)), "{op:?}");
        }
        for op in Binary::ALL {
            assert_eq!(op.row().slopes.len(), 2, "{op:?}");
            for (k, slope) in op.row().slopes.iter().enumerate() {
                assert!(is_slope(*slope, [x, y], k, &|[x, y]| op.value(x, y)), "{op:?} by operand {k}");
            }
        }
    }

    #[test]
    fn ranges_hold_values_and_commuting_keeps_the_bits() {
        let mut random = straightline_core::random::Random(7);
        for _ in 0..1000 {
            let mut any = || {
                let (a, b) = (random.symmetric(3.0), random.symmetric(3.0));
                (Interval::new(a.min(b), a.max(b)), a + (b - a) * random.unit())
            };
            let ((u, x), (v, y)) = (any(), any());
            let holds = |range: Interval, value: f64| value.is_nan() || (range.lo <= value && value <= range.hi);
            for op in Unary::ALL {
                assert!(holds(op.range(u), op.value(x)), "{op:?} {x}");
            }
            for op in Binary::ALL {
                assert!(holds(op.range(u, v), op.value(x, y)), "{op:?} {x} {y}");
                assert!(!op.row().commutes || op.value(x, y).to_bits() == op.value(y, x).to_bits(), "{op:?}");
            }
        }
    }
}
