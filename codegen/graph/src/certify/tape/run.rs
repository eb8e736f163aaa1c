//! The steps for several boxes at a time. The loop over them is one long function: an arm for each kind of step.

use super::super::interval::Interval;
use super::step::TapeStep;
use super::{BoxLanes, Registers, Tape, LANES};

impl Tape {
    /// Computes all steps. One piece: a table of an arm per kind of step.
    pub(super) fn run(&self, boxes: &[&[Interval]], registers: &mut Registers) {
        const NONE: (BoxLanes, BoxLanes) = ([0.0; LANES], [0.0; LANES]);
        registers.ends.resize(self.steps.len().max(registers.ends.len()), NONE);
        for (i, step) in self.steps.iter().enumerate() {
            let (known, rest) = registers.ends.split_at_mut(i);
            let out = &mut rest[0];
            let at = |k: u32| &known[k as usize];
            match *step {
                TapeStep::Input(k) => {
                    for l in 0..LANES {
                        let x = boxes[l.min(boxes.len() - 1)][k as usize];
                        (out.0[l], out.1[l]) = (x.lo, x.hi);
                    }
                }
                TapeStep::Constant(k) => {
                    let x = self.constants[k as usize];
                    *out = ([x.lo; LANES], [x.hi; LANES]);
                }
                TapeStep::Neg(a) => {
                    let (lo, hi) = at(a);
                    for l in 0..LANES {
                        (out.0[l], out.1[l]) = (-hi[l], -lo[l]);
                    }
                }
                TapeStep::Add(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        (out.0[l], out.1[l]) = (down(a.0[l] + b.0[l]), up(a.1[l] + b.1[l]));
                    }
                }
                TapeStep::Mul(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        let ends = [a.0[l] * b.0[l], a.0[l] * b.1[l], a.1[l] * b.0[l], a.1[l] * b.1[l]];
                        out.0[l] = down(least(least(ends[0], ends[1]), least(ends[2], ends[3])));
                        out.1[l] = up(most(most(ends[0], ends[1]), most(ends[2], ends[3])));
                    }
                }
                TapeStep::Square(a) => each(out, at(a), |x| x.square()),
                TapeStep::Binary(op, a, b) => {
                    let b = at(b);
                    let mut l = 0;
                    each(out, at(a), |x| {
                        l += 1;
                        op.range(x, Interval { lo: b.0[l - 1], hi: b.1[l - 1] })
                    });
                }
                TapeStep::Unary(op, a) => each(out, at(a), |x| op.range(x)),
                TapeStep::Sine(a) => each(out, at(a), |x| x.sin_cos().0),
                TapeStep::Cosine(a) => each(out, at(a), |x| x.sin_cos().1),
                TapeStep::Widened(a, h) => {
                    let (a, h) = (at(a), at(h));
                    for l in 0..LANES {
                        (out.0[l], out.1[l]) = (down(a.0[l] - h.1[l]), up(a.1[l] + h.1[l]));
                    }
                }
                TapeStep::Clipped(a, x) => {
                    let (a, x) = (at(a), at(x));
                    for l in 0..LANES {
                        let (lo, hi) = (most(a.0[l], -x.1[l]), least(a.1[l], x.1[l]));
                        let is_empty = lo > hi;
                        out.0[l] = if is_empty { a.0[l] } else { lo };
                        out.1[l] = if is_empty { a.1[l] } else { hi };
                    }
                }
                TapeStep::Intersection(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        let (lo, hi) = (most(a.0[l], b.0[l]), least(a.1[l], b.1[l]));
                        let is_empty = lo > hi;
                        out.0[l] = if is_empty { a.0[l] } else { lo };
                        out.1[l] = if is_empty { a.1[l] } else { hi };
                    }
                }
                TapeStep::Magnitude(a) => {
                    let a = at(a);
                    for l in 0..LANES {
                        out.1[l] = most(-a.0[l], a.1[l]);
                    }
                    out.0 = [0.0; LANES];
                }
                TapeStep::Sum(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        out.1[l] = up(a.1[l] + b.1[l]);
                    }
                    out.0 = [0.0; LANES];
                }
                TapeStep::Product(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        out.1[l] = up(a.1[l] * b.1[l]);
                    }
                    out.0 = [0.0; LANES];
                }
                TapeStep::RootOfBound(a) => {
                    let a = at(a);
                    for l in 0..LANES {
                        out.1[l] = up(a.1[l].sqrt());
                    }
                    out.0 = [0.0; LANES];
                }
                TapeStep::Least(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        out.1[l] = least(a.1[l], b.1[l]);
                    }
                    out.0 = [0.0; LANES];
                }
                TapeStep::Rounding(a, k) => {
                    let (a, k) = (at(a), self.constants[k as usize]);
                    for l in 0..LANES {
                        out.1[l] = up(k.lo * binade(a.1[l]) + k.hi);
                    }
                    out.0 = [0.0; LANES];
                }
            }
        }
    }
}

pub(super) fn each(out: &mut (BoxLanes, BoxLanes), a: &(BoxLanes, BoxLanes), mut f: impl FnMut(Interval) -> Interval) {
    for l in 0..LANES {
        let x = f(Interval { lo: a.0[l], hi: a.1[l] });
        (out.0[l], out.1[l]) = (x.lo, x.hi);
    }
}

#[inline]
pub(super) fn up(x: f64) -> f64 {
    x + (x.abs() * f64::EPSILON + f64::MIN_POSITIVE)
}

#[inline]
pub(super) fn down(x: f64) -> f64 {
    x - (x.abs() * f64::EPSILON + f64::MIN_POSITIVE)
}

/// One instruction each; what is no number is found out afterwards.
#[inline]
pub(super) fn least(a: f64, b: f64) -> f64 {
    if a < b {
        a
    } else {
        b
    }
}

#[inline]
pub(super) fn most(a: f64, b: f64) -> f64 {
    if a > b {
        a
    } else {
        b
    }
}

/// The least power of two that is at least x ≥ 0, or the smallest normal number.
#[inline]
pub(super) fn binade(x: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    let x = most(x, f64::MIN_POSITIVE);
    let below = f64::from_bits(x.to_bits() & EXPONENT);
    if below == x {
        x
    } else {
        2.0 * below
    }
}
