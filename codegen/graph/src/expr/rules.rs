//! The rewrite rules, a table: name, grade, equation.
//!
//! A rule sees one operation whose operands are already simple and answers with an equal node, or not at all. `Exact`
//! rules give the same bits for all finite inputs, up to the sign of a zero; `Algebraic` ones are equal over the reals
//! and move the rounding. With `Exact` rules alone the generated program is the generic runtime, bit for bit.

use super::{Binary, GraphBuilder, NodeId, Op, Unary};
use crate::number::Scalar;
use straightline_core::{Dd, Real};

/// What a rule promises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// The same bits for all finite inputs, up to the sign of a zero.
    Exact,
    /// Equal over the reals; rounding moves.
    Algebraic,
}

/// In which arithmetic constants are folded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Folding {
    /// As the runtime in this scalar would: every constant and every result rounded to it.
    In(Scalar),
    /// In double-double; rounded once, at emission.
    DoubleDouble,
}

impl Folding {
    /// The value as this arithmetic holds it.
    pub fn round(self, x: Dd) -> Dd {
        match self {
            Folding::In(scalar) => Dd::from(scalar.nearest(x)),
            Folding::DoubleDouble => x,
        }
    }

    /// The value of an operation on constants, as many as it takes.
    fn fold(self, op: Op, a: Dd, b: Dd) -> Dd {
        fn value<T: Real>(op: Op, a: T, b: T) -> T {
            match op {
                Op::Unary(op, _) => op.value(a),
                Op::Binary(op, ..) => op.value(a, b),
                _ => unreachable!("only operations on numbers are folded"),
            }
        }
        match self {
            Folding::In(scalar) => {
                in_scalar!(scalar, T => Dd::from(f64::from(value(op, T::constant(a), T::constant(b)))))
            }
            Folding::DoubleDouble => value(op, a, b),
        }
    }

    /// Sine and cosine of a constant angle, as this arithmetic computes them.
    pub fn sin_cos(self, x: Dd) -> (Dd, Dd) {
        match self {
            Folding::In(scalar) => in_scalar!(scalar, T => {
                let (s, c) = Real::sin_cos(T::constant(x));
                (Dd::from(f64::from(s)), Dd::from(f64::from(c)))
            }),
            Folding::DoubleDouble => x.sin_cos(),
        }
    }
}

/// A rewrite rule.
#[derive(Clone, Copy)]
pub struct Rule {
    /// Short name, as in reports.
    pub name: &'static str,
    /// What it promises.
    pub grade: Grade,
    /// The equation, for people.
    pub equation: &'static str,
    /// The equal node, if the rule fires on this operation.
    pub apply: fn(&mut GraphBuilder, Op) -> Option<NodeId>,
}

impl std::fmt::Debug for Rule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({:?}): {}", self.name, self.grade, self.equation)
    }
}

/// The rules in force, and the arithmetic of constants.
#[derive(Clone, Copy, Debug)]
pub struct RuleSet {
    rules: &'static [Rule],
    folding: Folding,
    short_angles: bool,
}

impl RuleSet {
    /// Only rules that keep every bit of the generic runtime in `folding`'s format.
    pub fn exact(folding: Folding) -> Self {
        RuleSet { rules: &RULES[..EXACT_RULES], folding, short_angles: false }
    }

    /// All rules; constants in double-double.
    pub fn all() -> Self {
        RuleSet { rules: RULES, folding: Folding::DoubleDouble, short_angles: false }
    }

    /// These rules with [parts of angles](RuleSet::angle_parts) that keep their digits where a program runs in f32.
    #[must_use]
    pub fn with_short_angles(self, short_angles: bool) -> Self {
        RuleSet { short_angles, ..self }
    }

    /// A constant angle as terms of a sum: where the program may run in f32, two that f32 has and a rest below 2^-48 of it;
    /// otherwise the two halves of its double-double.
    pub fn angle_parts(&self, angle: Dd) -> Vec<Dd> {
        let short = |x: Dd| Dd::from(f64::from(x.to_f32()));
        let mut parts = match self.short_angles {
            true => {
                let rest = angle - short(angle);
                vec![short(angle), short(rest), rest - short(rest)]
            }
            false => [angle.hi(), angle.lo()].map(Dd::from).to_vec(),
        };
        parts.retain(|x| *x != Dd::ZERO);
        parts
    }

    /// The rules, in the order in which they are tried.
    pub fn rules(&self) -> &'static [Rule] {
        self.rules
    }

    /// The weakest grade among them.
    pub fn grade(&self) -> Grade {
        self.rules.iter().map(|r| r.grade).max().unwrap_or(Grade::Exact)
    }

    /// The arithmetic of constants.
    pub fn folding(&self) -> Folding {
        self.folding
    }
}

/// How many rules at the head of the table are `Exact`.
const EXACT_RULES: usize = 14;

/// All rules: the exact ones first. `x`, `y` are any nodes, `c`, `d` constants, `k` a positive constant.
pub const RULES: &[Rule] = &[
    Rule { name: "fold", grade: Grade::Exact, equation: "c ∘ d = the number", apply: fold },
    Rule { name: "add-zero", grade: Grade::Exact, equation: "x + 0 = x", apply: add_zero },
    Rule { name: "sub-zero", grade: Grade::Exact, equation: "x − 0 = x; 0 − x = −x", apply: sub_zero },
    Rule { name: "sub-self", grade: Grade::Exact, equation: "x − x = 0", apply: sub_self },
    Rule { name: "mul-zero", grade: Grade::Exact, equation: "x · 0 = 0", apply: mul_zero },
    Rule { name: "mul-one", grade: Grade::Exact, equation: "x · 1 = x; x · −1 = −x", apply: mul_one },
    Rule { name: "div-one", grade: Grade::Exact, equation: "x / 1 = x; x / −1 = −x; 0 / x = 0", apply: div_one },
    Rule { name: "neg-neg", grade: Grade::Exact, equation: "−(−x) = x", apply: neg_neg },
    Rule {
        name: "add-neg",
        grade: Grade::Exact,
        equation: "x + (−y) = x − y; (−x) + (−y) = −(x + y); −y may be −k",
        apply: add_neg,
    },
    Rule {
        name: "sub-neg",
        grade: Grade::Exact,
        equation: "x − (−y) = x + y; (−x) − y = −(x + y); −y may be −k",
        apply: sub_neg,
    },
    Rule {
        name: "mul-neg", grade: Grade::Exact, equation: "(−x) · y = −(x · y); (−k) · y = −(k · y)", apply: mul_neg
    },
    Rule {
        name: "div-neg", grade: Grade::Exact, equation: "(−x) / y = −(x / y); x / (−y) = −(x / y)", apply: div_neg
    },
    Rule { name: "commute", grade: Grade::Exact, equation: "y ∘ x = x ∘ y for +, ·", apply: commute },
    Rule {
        name: "sub-flip", grade: Grade::Exact, equation: "y − x = −(x − y), if x − y is there", apply: sub_flip
    },
    Rule { name: "mul-mul", grade: Grade::Algebraic, equation: "c · (d · x) = (c d) · x", apply: mul_mul },
];

fn fold(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    let value = |id: NodeId| b.as_constant(id).map(|c| c.value());
    let (x, y) = match op {
        Op::Unary(_, x) => (value(x)?, Dd::ZERO),
        Op::Binary(_, x, y) => (value(x)?, value(y)?),
        _ => return None,
    };
    let folded = b.rules().folding().fold(op, x, y);
    Some(b.constant(folded))
}

fn is(b: &GraphBuilder, id: NodeId, x: f64) -> bool {
    b.as_constant(id).is_some_and(|c| c.is(x))
}

fn add_zero(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Binary(Binary::Add, x, y) if is(b, y, 0.0) => Some(x),
        Op::Binary(Binary::Add, x, y) if is(b, x, 0.0) => Some(y),
        _ => None,
    }
}

fn sub_zero(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Binary(Binary::Sub, x, y) if is(b, y, 0.0) => Some(x),
        Op::Binary(Binary::Sub, x, y) if is(b, x, 0.0) => Some(b.add(Op::neg(y))),
        _ => None,
    }
}

fn sub_self(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Binary(Binary::Sub, x, y) if x == y => Some(b.constant(Dd::ZERO)),
        _ => None,
    }
}

fn mul_zero(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Binary(Binary::Mul, x, y) if is(b, x, 0.0) || is(b, y, 0.0) => Some(b.constant(Dd::ZERO)),
        _ => None,
    }
}

fn mul_one(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Binary(Binary::Mul, x, y) if is(b, y, 1.0) => Some(x),
        Op::Binary(Binary::Mul, x, y) if is(b, x, 1.0) => Some(y),
        Op::Binary(Binary::Mul, x, y) if is(b, y, -1.0) => Some(b.add(Op::neg(x))),
        Op::Binary(Binary::Mul, x, y) if is(b, x, -1.0) => Some(b.add(Op::neg(y))),
        _ => None,
    }
}

fn div_one(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Binary(Binary::Div, x, y) if is(b, y, 1.0) => Some(x),
        Op::Binary(Binary::Div, x, y) if is(b, y, -1.0) => Some(b.add(Op::neg(x))),
        Op::Binary(Binary::Div, x, _) if is(b, x, 0.0) => Some(x),
        _ => None,
    }
}

fn neg_neg(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Unary(Unary::Neg, x) => match b.op(x) {
            Op::Unary(Unary::Neg, y) => Some(y),
            _ => None,
        },
        _ => None,
    }
}

fn add_neg(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    let Op::Binary(Binary::Add, x, y) = op else { return None };
    let ((u, s), (v, t)) = (without_sign(b, x), without_sign(b, y));
    match (s, t) {
        (true, true) => {
            let sum = b.add(Op::add(u, v));
            Some(b.add(Op::neg(sum)))
        }
        (true, false) => Some(b.add(Op::sub(v, u))),
        (false, true) => Some(b.add(Op::sub(u, v))),
        (false, false) => None,
    }
}

fn sub_neg(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    let Op::Binary(Binary::Sub, x, y) = op else { return None };
    let ((u, s), (v, t)) = (without_sign(b, x), without_sign(b, y));
    match (s, t) {
        (true, true) => Some(b.add(Op::sub(v, u))),
        (true, false) => {
            let sum = b.add(Op::add(u, v));
            Some(b.add(Op::neg(sum)))
        }
        (false, true) => Some(b.add(Op::add(u, v))),
        (false, false) => None,
    }
}

/// `x` without its sign, and whether it had one: a negation or a negative constant.
fn without_sign(b: &mut GraphBuilder, x: NodeId) -> (NodeId, bool) {
    match b.op(x) {
        Op::Unary(Unary::Neg, y) => (y, true),
        Op::Constant(c) if c.is_negative() => (b.constant(-c.value()), true),
        _ => (x, false),
    }
}

fn mul_neg(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    let Op::Binary(Binary::Mul, x, y) = op else { return None };
    let ((x, s), (y, t)) = (without_sign(b, x), without_sign(b, y));
    if !(s || t) {
        return None;
    }
    let product = b.add(Op::mul(x, y));
    Some(if s != t { b.add(Op::neg(product)) } else { product })
}

fn div_neg(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    let Op::Binary(Binary::Div, x, y) = op else { return None };
    let ((x, s), (y, t)) = (without_sign(b, x), without_sign(b, y));
    if !(s || t) {
        return None;
    }
    let quotient = b.add(Op::div(x, y));
    Some(if s != t { b.add(Op::neg(quotient)) } else { quotient })
}

fn commute(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Binary(f, x, y) if f.row().commutes && y < x => Some(b.add(Op::Binary(f, y, x))),
        _ => None,
    }
}

fn sub_flip(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    match op {
        Op::Binary(Binary::Sub, x, y) => {
            let flipped = b.find(Op::sub(y, x))?;
            Some(b.add(Op::neg(flipped)))
        }
        _ => None,
    }
}

fn mul_mul(b: &mut GraphBuilder, op: Op) -> Option<NodeId> {
    let Op::Binary(Binary::Mul, x, y) = op else { return None };
    let (c, inner) = match (b.as_constant(x), b.as_constant(y)) {
        (Some(c), None) => (c, y),
        (None, Some(c)) => (c, x),
        _ => return None,
    };
    let Op::Binary(Binary::Mul, u, v) = b.op(inner) else { return None };
    let (d, w) = match (b.as_constant(u), b.as_constant(v)) {
        (Some(d), _) => (d, v),
        (_, Some(d)) => (d, u),
        _ => return None,
    };
    let k = b.constant(c.value() * d.value());
    Some(b.add(Op::mul(k, w)))
}
