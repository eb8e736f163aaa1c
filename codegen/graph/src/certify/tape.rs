//! What an analysis computes from a box, as a list of steps that can be repeated for parts of the box.
//!
//! [`Analysis`](super::Analysis) finds out which of many bounds are the least in a box, and that takes far longer than computing these alone.
//! So a [`Pen`] writes down every operation on the way; [`Tape::new`] keeps those that the bound of one result needs, without minima
//! that hardly ever come from one of their operands, and [`Tape::bounds`] repeats them for [`LANES`] boxes at a time.
//!
//! **Why it holds.** Every step takes enclosures of numbers, or upper bounds, to one of another number, in whatever box: those of a
//! part of the box hold there. The analysis of the whole box has decided three things that steps no longer ask: that no value
//! overflows, no divisor vanishes and every sign is right, and what is zero or one there: true of all its points, and so in each of its parts;
//! which of several bounds are written down as the operands of a minimum: each of them alone is one.
//!
//! **Outward rounding** is x ± (|x| ε + m), m the smallest normal number: |x| ε is an ulp of x at least, so that the sum lies
//! beyond the next number, and m makes up for what is lost below the normal numbers. If anything became infinite
//! or no number in a box, its bound is infinite.

use super::interval::{add_up, mul_up, Interval};
use crate::expr::{Binary, Unary};
use rustc_hash::FxHashMap;

/// An enclosure of a number, and the step that computes it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    pub x: Interval,
    at: u32,
}

/// An upper bound of a number ≥ 0, and the step that computes it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    pub x: f64,
    at: u32,
}

impl Range {
    pub const ZERO: Range = Range { x: Interval::ZERO, at: ZERO };
    pub const ONE: Range = Range { x: Interval::ONE, at: ONE };
}

impl Bound {
    pub const ZERO: Bound = Bound { x: 0.0, at: ZERO };

    /// Whether it was written down at that mark, or later.
    pub fn is_since(self, mark: Mark) -> bool {
        self.at as usize >= mark.0
    }
}

/// The first two steps of all.
const ZERO: u32 = 0;
const ONE: u32 = 1;

/// One operation; operands are indices of earlier steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Step {
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

impl Step {
    fn operands(self) -> impl Iterator<Item = u32> {
        use Step::*;
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

    fn map(self, f: impl Fn(u32) -> u32) -> Step {
        use Step::*;
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

/// What is so much above another bound in the whole box is not expected to be the least in any part.
const FAR: f64 = 1.5;

/// A place among the steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark(usize);

/// Computes, and writes down what it computes, if it is told to.
#[derive(Clone, Debug, Default)]
pub(super) struct Pen {
    writes: bool,
    steps: Vec<Step>,
    constants: Vec<Interval>,
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
    fn write(&mut self, step: Step) -> u32 {
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
        self.write(Step::Constant(index))
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

    pub fn input(&mut self, k: u32, x: Interval) -> Range {
        Range { x, at: self.write(Step::Input(k)) }
    }

    /// A range that does not depend on the box.
    pub fn constant(&mut self, x: Interval) -> Range {
        Range { x, at: self.write_constant(x) }
    }

    /// A bound that does not depend on the box.
    pub fn number(&mut self, x: f64) -> Bound {
        if x == 0.0 {
            return Bound::ZERO;
        }
        Bound { x, at: self.write_constant(Interval::point(x)) }
    }

    pub fn neg(&mut self, a: Range) -> Range {
        if a.x.is_zero() {
            return a;
        }
        Range { x: -a.x, at: self.write(Step::Neg(a.at)) }
    }

    #[inline]
    pub fn add(&mut self, a: Range, b: Range) -> Range {
        if a.x.is_zero() {
            return b;
        }
        if b.x.is_zero() {
            return a;
        }
        Range { x: a.x + b.x, at: self.write(Step::Add(a.at, b.at)) }
    }

    pub fn sub(&mut self, a: Range, b: Range) -> Range {
        let minus = self.neg(b);
        self.add(a, minus)
    }

    #[inline]
    pub fn mul(&mut self, a: Range, b: Range) -> Range {
        if a.x.is_zero() || b.x == Interval::ONE {
            return a;
        }
        if b.x.is_zero() || a.x == Interval::ONE {
            return b;
        }
        Range { x: a.x * b.x, at: self.write(Step::Mul(a.at, b.at)) }
    }

    pub fn square(&mut self, a: Range) -> Range {
        Range { x: a.x.square(), at: self.write(Step::Square(a.at)) }
    }

    pub fn over(&mut self, a: Range, b: Range) -> Range {
        self.binary(Binary::Div, a, b)
    }

    pub fn sqrt(&mut self, a: Range) -> Range {
        self.unary(Unary::Sqrt, a)
    }

    pub fn unary(&mut self, op: Unary, a: Range) -> Range {
        match op {
            Unary::Neg => self.neg(a),
            op => Range { x: op.range(a.x), at: self.write(Step::Unary(op, a.at)) },
        }
    }

    pub fn binary(&mut self, op: Binary, a: Range, b: Range) -> Range {
        match op {
            Binary::Add => self.add(a, b),
            Binary::Sub => self.sub(a, b),
            Binary::Mul => self.mul(a, b),
            op => Range { x: op.range(a.x, b.x), at: self.write(Step::Binary(op, a.at, b.at)) },
        }
    }

    pub fn sin_cos(&mut self, a: Range) -> (Range, Range) {
        let (sin, cos) = a.x.sin_cos();
        (Range { x: sin, at: self.write(Step::Sine(a.at)) }, Range { x: cos, at: self.write(Step::Cosine(a.at)) })
    }

    pub fn widened(&mut self, a: Range, h: Bound) -> Range {
        if h.x == 0.0 {
            return a;
        }
        Range { x: a.x.widened(h.x), at: self.write(Step::Widened(a.at, h.at)) }
    }

    pub fn clipped(&mut self, a: Range, magnitude: Bound) -> Range {
        if magnitude.x > FAR * a.x.mag() {
            return a;
        }
        Range { x: a.x.clipped(magnitude.x), at: self.write(Step::Clipped(a.at, magnitude.at)) }
    }

    pub fn intersect(&mut self, a: Range, b: Range) -> Range {
        let wide = Interval { lo: a.x.lo - FAR * a.x.mag(), hi: a.x.hi + FAR * a.x.mag() };
        if b.x.lo < wide.lo && wide.hi < b.x.hi {
            return a;
        }
        Range { x: a.x.intersect(b.x), at: self.write(Step::Intersection(a.at, b.at)) }
    }

    pub fn mag(&mut self, a: Range) -> Bound {
        if a.x.is_zero() {
            return Bound::ZERO;
        }
        Bound { x: a.x.mag(), at: self.write(Step::Magnitude(a.at)) }
    }

    #[inline]
    pub fn add_up(&mut self, a: Bound, b: Bound) -> Bound {
        if a.x == 0.0 {
            return b;
        }
        if b.x == 0.0 {
            return a;
        }
        Bound { x: add_up(a.x, b.x), at: self.write(Step::Sum(a.at, b.at)) }
    }

    #[inline]
    pub fn mul_up(&mut self, a: Bound, b: Bound) -> Bound {
        if a.x == 0.0 || b.x == 0.0 {
            return Bound::ZERO;
        }
        Bound { x: mul_up(a.x, b.x), at: self.write(Step::Product(a.at, b.at)) }
    }

    pub fn least(&mut self, a: Bound, b: Bound) -> Bound {
        if a.x > FAR * b.x {
            return b;
        }
        if b.x > FAR * a.x {
            return a;
        }
        Bound { x: a.x.min(b.x), at: self.write(Step::Least(a.at, b.at)) }
    }

    /// √(a² + …) of what is added one by one to [`Bound::ZERO`].
    pub fn add_square(&mut self, norm: &mut Norm, a: Bound) {
        if a.x != 0.0 {
            let square = Bound { x: (a.x * a.x).next_up(), at: self.write(Step::Product(a.at, a.at)) };
            norm.sum = self.add_up(norm.sum, square);
            norm.last = a;
            norm.count += 1;
        }
    }

    pub fn root(&mut self, norm: Norm) -> Bound {
        match norm.count {
            0 | 1 => norm.last,
            _ => Bound { x: norm.sum.x.sqrt().next_up(), at: self.write(Step::RootOfBound(norm.sum.at)) },
        }
    }

    /// `error`: what rounding numbers up to `magnitude` loses, `factor` times their binade and `tiny`.
    pub fn rounding(&mut self, magnitude: Bound, error: f64, factor: f64, tiny: f64) -> Bound {
        if !self.writes || magnitude.x == 0.0 {
            return Bound { x: error, at: ZERO };
        }
        let constant = self.index(Interval { lo: factor, hi: tiny });
        Bound { x: error, at: self.write(Step::Rounding(magnitude.at, constant)) }
    }
}

/// A sum of squares.
#[derive(Clone, Copy, Debug)]
pub(super) struct Norm {
    sum: Bound,
    last: Bound,
    count: usize,
}

impl Norm {
    pub const ZERO: Norm = Norm { sum: Bound::ZERO, last: Bound::ZERO, count: 0 };
}

/// So many boxes at a time.
pub(super) const LANES: usize = 8;

/// One number per box.
pub(super) type Lanes = [f64; LANES];

/// The steps of one result's bound.
#[derive(Clone, Debug)]
pub(super) struct Tape {
    steps: Vec<Step>,
    constants: Vec<Interval>,
}

/// What steps have computed: lower and upper ends.
#[derive(Clone, Debug, Default)]
pub(super) struct Registers {
    ends: Vec<(Lanes, Lanes)>,
}

impl Tape {
    /// The steps that a bound needs. `samples`: parts of the box. Of a minimum that is the same operand in all of them, the others go.
    pub fn new(pen: &Pen, bound: Bound, samples: &[&[Interval]]) -> Tape {
        let mut tape = Tape { steps: Vec::new(), constants: pen.constants.clone() };
        if !pen.writes {
            return tape;
        }
        let mut is_needed = vec![false; pen.steps.len()];
        is_needed[bound.at as usize] = true;
        for at in (0..pen.steps.len()).rev() {
            if is_needed[at] {
                pen.steps[at].operands().for_each(|a| is_needed[a as usize] = true);
            }
        }
        let needed = (0..pen.steps.len()).filter(|at| is_needed[*at]);
        tape.steps = compacted(needed.map(|at| (at as u32, pen.steps[at])), &tape.constants);
        tape.prune(samples);
        tape
    }

    fn prune(&mut self, samples: &[&[Interval]]) {
        // per step: which of its operands made a difference
        let mut matters = vec![[false; 2]; self.steps.len()];
        let mut registers = Registers::default();
        for boxes in samples.chunks(LANES) {
            self.run(boxes, &mut registers);
            let ends = &registers.ends;
            for (i, step) in self.steps.iter().enumerate() {
                for l in 0..boxes.len() {
                    let at = |k: u32| (ends[k as usize].0[l], ends[k as usize].1[l]);
                    match *step {
                        Step::Least(a, b) => {
                            matters[i][0] |= at(a).1 < at(b).1;
                            matters[i][1] |= at(b).1 < at(a).1;
                        }
                        Step::Clipped(a, _) => matters[i][1] |= at(i as u32) != at(a),
                        Step::Intersection(a, b) => {
                            matters[i][0] |= at(i as u32) != at(b);
                            matters[i][1] |= at(i as u32) != at(a);
                        }
                        _ => matters[i] = [true; 2],
                    }
                }
            }
        }
        let mut same: Vec<u32> = (0..self.steps.len() as u32).collect();
        for (i, step) in self.steps.iter().enumerate() {
            match (*step, matters[i]) {
                (Step::Least(_, b) | Step::Intersection(_, b), [false, true]) => same[i] = same[b as usize],
                (Step::Least(a, _) | Step::Intersection(a, _) | Step::Clipped(a, _), [_, false]) => {
                    same[i] = same[a as usize];
                }
                _ => {}
            }
        }
        let Some(result) = same.last() else { return };
        let steps: Vec<Step> = self.steps.iter().map(|s| s.map(|a| same[a as usize])).collect();
        let mut is_needed = vec![false; steps.len()];
        is_needed[*result as usize] = true;
        for i in (0..=*result as usize).rev() {
            if is_needed[i] {
                steps[i].operands().for_each(|a| is_needed[a as usize] = true);
            }
        }
        let kept = steps.iter().enumerate().filter(|(i, _)| is_needed[*i]).map(|(i, s)| (i as u32, *s));
        self.steps = compacted(kept.collect::<Vec<_>>().into_iter(), &self.constants);
    }

    /// The bounds in these boxes; infinite where nothing is known.
    pub fn bounds(&self, boxes: &[&[Interval]], registers: &mut Registers) -> Lanes {
        self.run(boxes, registers);
        let Some(last) = registers.ends[..self.steps.len()].last() else { return [f64::INFINITY; LANES] };
        let mut bounds = last.1;
        // 0 as long as all is finite
        let mut odd = [0.0; LANES];
        for (lo, hi) in &registers.ends[..self.steps.len()] {
            for l in 0..LANES {
                odd[l] += lo[l] * 0.0 + hi[l] * 0.0;
            }
        }
        for l in 0..LANES {
            if odd[l] != 0.0 {
                bounds[l] = f64::INFINITY;
            }
        }
        bounds
    }

    fn run(&self, boxes: &[&[Interval]], registers: &mut Registers) {
        const NONE: (Lanes, Lanes) = ([0.0; LANES], [0.0; LANES]);
        registers.ends.resize(self.steps.len().max(registers.ends.len()), NONE);
        for (i, step) in self.steps.iter().enumerate() {
            let (known, rest) = registers.ends.split_at_mut(i);
            let out = &mut rest[0];
            let at = |k: u32| &known[k as usize];
            match *step {
                Step::Input(k) => {
                    for l in 0..LANES {
                        let x = boxes[l.min(boxes.len() - 1)][k as usize];
                        (out.0[l], out.1[l]) = (x.lo, x.hi);
                    }
                }
                Step::Constant(k) => {
                    let x = self.constants[k as usize];
                    *out = ([x.lo; LANES], [x.hi; LANES]);
                }
                Step::Neg(a) => {
                    let (lo, hi) = at(a);
                    for l in 0..LANES {
                        (out.0[l], out.1[l]) = (-hi[l], -lo[l]);
                    }
                }
                Step::Add(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        (out.0[l], out.1[l]) = (down(a.0[l] + b.0[l]), up(a.1[l] + b.1[l]));
                    }
                }
                Step::Mul(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        let ends = [a.0[l] * b.0[l], a.0[l] * b.1[l], a.1[l] * b.0[l], a.1[l] * b.1[l]];
                        out.0[l] = down(least(least(ends[0], ends[1]), least(ends[2], ends[3])));
                        out.1[l] = up(most(most(ends[0], ends[1]), most(ends[2], ends[3])));
                    }
                }
                Step::Square(a) => each(out, at(a), |x| x.square()),
                Step::Binary(op, a, b) => {
                    let b = at(b);
                    let mut l = 0;
                    each(out, at(a), |x| {
                        l += 1;
                        op.range(x, Interval { lo: b.0[l - 1], hi: b.1[l - 1] })
                    });
                }
                Step::Unary(op, a) => each(out, at(a), |x| op.range(x)),
                Step::Sine(a) => each(out, at(a), |x| x.sin_cos().0),
                Step::Cosine(a) => each(out, at(a), |x| x.sin_cos().1),
                Step::Widened(a, h) => {
                    let (a, h) = (at(a), at(h));
                    for l in 0..LANES {
                        (out.0[l], out.1[l]) = (down(a.0[l] - h.1[l]), up(a.1[l] + h.1[l]));
                    }
                }
                Step::Clipped(a, x) => {
                    let (a, x) = (at(a), at(x));
                    for l in 0..LANES {
                        let (lo, hi) = (most(a.0[l], -x.1[l]), least(a.1[l], x.1[l]));
                        let is_empty = lo > hi;
                        out.0[l] = if is_empty { a.0[l] } else { lo };
                        out.1[l] = if is_empty { a.1[l] } else { hi };
                    }
                }
                Step::Intersection(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        let (lo, hi) = (most(a.0[l], b.0[l]), least(a.1[l], b.1[l]));
                        let is_empty = lo > hi;
                        out.0[l] = if is_empty { a.0[l] } else { lo };
                        out.1[l] = if is_empty { a.1[l] } else { hi };
                    }
                }
                Step::Magnitude(a) => {
                    let a = at(a);
                    for l in 0..LANES {
                        out.1[l] = most(-a.0[l], a.1[l]);
                    }
                    out.0 = [0.0; LANES];
                }
                Step::Sum(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        out.1[l] = up(a.1[l] + b.1[l]);
                    }
                    out.0 = [0.0; LANES];
                }
                Step::Product(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        out.1[l] = up(a.1[l] * b.1[l]);
                    }
                    out.0 = [0.0; LANES];
                }
                Step::RootOfBound(a) => {
                    let a = at(a);
                    for l in 0..LANES {
                        out.1[l] = up(a.1[l].sqrt());
                    }
                    out.0 = [0.0; LANES];
                }
                Step::Least(a, b) => {
                    let (a, b) = (at(a), at(b));
                    for l in 0..LANES {
                        out.1[l] = least(a.1[l], b.1[l]);
                    }
                    out.0 = [0.0; LANES];
                }
                Step::Rounding(a, k) => {
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

/// Steps with their former indices, in order, with one for equal ones; operands by the indices among them.
fn compacted(steps: impl Iterator<Item = (u32, Step)>, constants: &[Interval]) -> Vec<Step> {
    let mut kept: Vec<Step> = Vec::new();
    let mut places: Vec<u32> = Vec::new();
    let mut known: FxHashMap<Step, u32> = FxHashMap::default();
    let mut numbers: FxHashMap<(u64, u64), u32> = FxHashMap::default();
    for (at, step) in steps {
        let mut step = step.map(|a| places[a as usize]);
        // equal constants by the first of them
        if let Step::Constant(k) = &mut step {
            let x = constants[*k as usize];
            *k = *numbers.entry((x.lo.to_bits(), x.hi.to_bits())).or_insert(*k);
        }
        let place = *known.entry(step).or_insert_with(|| {
            kept.push(step);
            kept.len() as u32 - 1
        });
        places.resize(at as usize, u32::MAX);
        places.push(place);
    }
    kept
}

fn each(out: &mut (Lanes, Lanes), a: &(Lanes, Lanes), mut f: impl FnMut(Interval) -> Interval) {
    for l in 0..LANES {
        let x = f(Interval { lo: a.0[l], hi: a.1[l] });
        (out.0[l], out.1[l]) = (x.lo, x.hi);
    }
}

#[inline]
fn up(x: f64) -> f64 {
    x + (x.abs() * f64::EPSILON + f64::MIN_POSITIVE)
}

#[inline]
fn down(x: f64) -> f64 {
    x - (x.abs() * f64::EPSILON + f64::MIN_POSITIVE)
}

/// One instruction each; what is no number is found out afterwards.
#[inline]
fn least(a: f64, b: f64) -> f64 {
    if a < b {
        a
    } else {
        b
    }
}

#[inline]
fn most(a: f64, b: f64) -> f64 {
    if a > b {
        a
    } else {
        b
    }
}

/// The least power of two that is at least x ≥ 0, or the smallest normal number.
#[inline]
fn binade(x: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    let x = most(x, f64::MIN_POSITIVE);
    let below = f64::from_bits(x.to_bits() & EXPONENT);
    if below == x {
        x
    } else {
        2.0 * below
    }
}
