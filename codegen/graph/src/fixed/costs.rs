//! How a value is computed at a point from operands at theirs, what it costs, and what it loses.

use super::words::Product;
use crate::certify::Interval;
use crate::expr::{Binary, Constant, Graph, NodeId, Op, Unary};
use straightline_core::fixed::{EXACT_ERROR, FULL_ERROR, REDUCED, TURN_ERROR, WIDE_ERROR};
use straightline_core::Dd;

/// Points beyond these serve nobody.
const MOST_BITS: i32 = 60;
/// Values stay this far below 2^31, relatively: what ranges may grow by when errors are known.
const MARGIN: f64 = 1e-6;

/// An operand, brought to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Aligned {
    /// A value, shifted to the left by so many bits; to the right where it is less than 0.
    Node(NodeId, i32),
    /// A constant as a word.
    Constant(i32),
}

/// How a value is computed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum WordWay {
    /// The operand as it is.
    As(Aligned),
    /// Its negative.
    Negative(Aligned),
    /// a + b.
    Sum(Aligned, Aligned),
    /// a − b.
    Difference(Aligned, Aligned),
    /// A product, shifted to the right.
    Product(Product, [Aligned; 2], u32),
    /// An input, a sine or a cosine.
    Given,
}

/// A way with what it costs \[instructions\], and how far the value may be from that of the operation on these operands.
#[derive(Clone, Debug)]
pub(super) struct Priced {
    pub way: WordWay,
    pub cost: f64,
    pub error: f64,
}

/// What operations on a machine cost \[instructions\].
#[derive(Clone, Copy, Debug)]
pub(super) struct WordMachine {
    /// Whether it has the high half of products of 32 bits.
    pub wide: bool,
    /// The products of its sines.
    pub sines: Product,
}

impl WordMachine {
    /// A product; the halves of a constant are constants.
    fn product(self, product: Product) -> f64 {
        match product {
            Product::Wide => 1.0,
            Product::Long(_) => 5.0,
            Product::Exact => 17.0,
            Product::LongExact(_) => 22.0,
            Product::Full => 12.0,
            Product::Half => 7.0,
            Product::Short | Product::Uneven => 3.0,
        }
    }

    /// The product that is shifted by so many bits.
    fn long(self, by: u32) -> Product {
        if self.wide {
            Product::Long(by)
        } else {
            Product::LongExact(by)
        }
    }

    /// The products that it has, long ones aside.
    fn products(self) -> &'static [Product] {
        match self.wide {
            true => &[Product::Wide],
            false => &[Product::Exact, Product::Full, Product::Half, Product::Short, Product::Uneven],
        }
    }

    /// The error of a sine or cosine of an angle that turns at most so far \[rad\], and whether it has to be reduced.
    pub fn sine(self, angle: Interval) -> (f64, bool) {
        let reduced = f64::from(REDUCED - 2) * unit(31);
        let kernel = match self.sines {
            Product::Full => FULL_ERROR,
            Product::Exact => EXACT_ERROR,
            _ => WIDE_ERROR,
        };
        if angle.mag() <= reduced - 2f64.powi(-14) {
            return (kernel * unit(31), false);
        }
        // the nearest quarter turn, computed to 2^-15 of a turn and to the upper half of the angle
        let turns = (angle.mag() / std::f64::consts::FRAC_PI_2 + 0.51).floor();
        ((kernel + TURN_ERROR * turns) * unit(31), true)
    }
}

/// The unit in the last place at a point.
pub(super) fn unit(bits: i32) -> f64 {
    2f64.powi(-bits)
}

/// What so many of the lowest bits of a word at a point are worth, at most.
fn left_out(bits: u32, point: i32) -> f64 {
    if bits == 0 {
        0.0
    } else {
        unit(point - bits as i32)
    }
}

/// The greatest point at which a value within `magnitude` is a word.
pub(super) fn natural(magnitude: f64) -> i32 {
    let most = magnitude * (1.0 + MARGIN);
    let fits = |bits: &i32| most <= (2f64.powi(31) - 2.0) * unit(*bits);
    (-MOST_BITS..=MOST_BITS).rev().find(fits).unwrap_or(-MOST_BITS)
}

/// A constant at a point, and its error; none if it is no word there.
fn word(c: Dd, bits: i32) -> Option<(i32, f64)> {
    let scaled = (c * Dd::from(2f64.powi(bits))).to_f64().round();
    if scaled.abs() > 2f64.powi(31) - 1.0 {
        return None;
    }
    // a difference of double-doubles is exact to far below its rounding
    let error = (Dd::from(scaled * unit(bits)) - c).to_f64().abs() * (1.0 + 1e-9);
    Some((scaled as i32, error))
}

/// ±2^j of a power of two: whether it is negative, and j.
fn power_of_two(c: Constant) -> Option<(bool, i32)> {
    let x = c.value().to_f64();
    let is_power = c.is(x) && x.is_normal() && x.to_bits() & ((1 << 52) - 1) == 0;
    is_power.then(|| (x < 0.0, (x.to_bits() >> 52 & 0x7ff) as i32 - 1023))
}

/// What is known of the values of a graph.
pub(super) struct Known<'g> {
    pub graph: &'g Graph,
    pub machine: WordMachine,
    /// The greatest absolute value, of exact and computed ones.
    pub magnitude: Vec<f64>,
    /// The greatest point at which it is a word.
    pub natural: Vec<i32>,
}

impl Known<'_> {
    fn constant(&self, id: NodeId) -> Option<Constant> {
        match self.graph.op(id) {
            Op::Constant(c) => Some(c),
            _ => None,
        }
    }

    /// An operand at a point: with its cost and error; none if it does not fit there.
    pub fn aligned(&self, id: NodeId, bits: i32, points: &[i32]) -> Option<(Aligned, f64, f64)> {
        if let Some(c) = self.constant(id) {
            let (word, error) = word(c.value(), bits)?;
            return Some((Aligned::Constant(word), 0.0, error));
        }
        let shift = bits - points[id.index()];
        match shift {
            0 => Some((Aligned::Node(id, 0), 0.0, 0.0)),
            // less than a unit
            ..=-32 => Some((Aligned::Constant(0), 0.0, self.magnitude[id.index()])),
            -31..=-1 => Some((Aligned::Node(id, shift), 1.0, unit(bits))),
            1..=31 if self.natural[id.index()] >= bits => Some((Aligned::Node(id, shift), 1.0, 0.0)),
            _ => None,
        }
    }

    /// The best way of a node to a point, where an error counts so much; none if there is none.
    pub fn best(&self, id: NodeId, bits: i32, points: &[i32], weight: f64) -> Option<Priced> {
        if bits > self.natural[id.index()] {
            return None;
        }
        let one = |a: NodeId, negative: bool| {
            let (a, cost, error) = self.aligned(a, bits, points)?;
            let (way, more) = if negative { (WordWay::Negative(a), 1.0) } else { (WordWay::As(a), 0.0) };
            Some(Priced { way, cost: cost + more, error })
        };
        match self.graph.op(id) {
            Op::Unary(Unary::Neg, a) => one(a, true),
            Op::Binary(Binary::Add, a, b) if a == b => self.doubled(a, (false, 1), bits, points),
            Op::Binary(op @ (Binary::Add | Binary::Sub), a, b) => {
                let (a, cost_a, error_a) = self.aligned(a, bits, points)?;
                let (b, cost_b, error_b) = self.aligned(b, bits, points)?;
                let way = if op == Binary::Add { WordWay::Sum(a, b) } else { WordWay::Difference(a, b) };
                Some(Priced { way, cost: 1.0 + cost_a + cost_b, error: error_a + error_b })
            }
            Op::Binary(Binary::Mul, a, b) => match (self.constant(a), self.constant(b)) {
                (Some(c), _) => self.scaled(c, b, bits, points, weight),
                (_, Some(c)) => self.scaled(c, a, bits, points, weight),
                _ => self.product([a, b], bits, points, weight),
            },
            _ => Some(Priced { way: WordWay::Given, cost: 0.0, error: 0.0 }),
        }
    }

    /// The best of products that come to a point as far as `ways` says.
    fn least(weight: f64, ways: impl Iterator<Item = Priced>) -> Option<Priced> {
        let worth = |p: &Priced| p.cost + weight * p.error;
        ways.min_by(|a, b| worth(a).total_cmp(&worth(b)))
    }

    /// A constant times a value.
    fn scaled(&self, c: Constant, a: NodeId, bits: i32, points: &[i32], weight: f64) -> Option<Priced> {
        let point = points[a.index()];
        if let Some(power) = power_of_two(c) {
            return self.doubled(a, power, bits, points);
        }
        let magnitude = self.magnitude[a.index()];
        let room = self.natural[a.index()] - point;
        let long = self.scaled_long(c, a, bits, point);
        // the fewest bits to the left with which the constant is a word
        let Some(left) = (0..=room.clamp(0, 31)).find(|left| word(c.value(), bits + 32 - point - left).is_some())
        else {
            return long;
        };
        let at = bits + 32 - point - left;
        let (exact, off) = word(c.value(), at)?;
        let last = unit(bits);
        let ways = self.machine.products().iter().flat_map(|kind| {
            let cost = self.machine.product(*kind) + f64::from(left > 0);
            let loss = kind.loss() * last;
            kind.orders().iter().filter_map(move |order| {
                let [of_value, of_constant] = order.map(|k| kind.leaves_out()[k]);
                // a constant is rounded to what is read of it
                let (word, off) = match of_constant {
                    0 => (exact, off),
                    out => {
                        let (short, off) = word(c.value(), at - out as i32)?;
                        (i32::try_from(i64::from(short) << out).ok()?, off)
                    }
                };
                let error = off * magnitude + left_out(of_value, point + left) * c.value().to_f64().abs();
                let factors = [Aligned::Node(a, left), Aligned::Constant(word)];
                let way = WordWay::Product(*kind, order.map(|k| factors[k]), 0);
                Some(Priced { way, cost, error: error + loss })
            })
        });
        Self::least(weight, ways.chain(long))
    }

    /// A value times ±2^j: the same word, at the point less j.
    fn doubled(&self, a: NodeId, (negative, j): (bool, i32), bits: i32, points: &[i32]) -> Option<Priced> {
        let shift = bits - (points[a.index()] - j);
        let (aligned, cost, error) = match shift {
            0 => (Aligned::Node(a, 0), 0.0, 0.0),
            ..=-32 => (Aligned::Constant(0), 0.0, self.magnitude[a.index()] * 2f64.powi(j)),
            -31..=-1 => (Aligned::Node(a, shift), 1.0, unit(bits)),
            // it fits as the value does
            1..=31 => (Aligned::Node(a, shift), 1.0, 0.0),
            _ => return None,
        };
        let (way, more) = if negative { (WordWay::Negative(aligned), 1.0) } else { (WordWay::As(aligned), 0.0) };
        Some(Priced { way, cost: cost + more, error })
    }

    /// A constant times a value, with more than the high half of the product.
    fn scaled_long(&self, c: Constant, a: NodeId, bits: i32, point: i32) -> Option<Priced> {
        let at = natural(c.value().to_f64().abs());
        let by = u32::try_from(point + at - bits).ok().filter(|by| (1..32).contains(by))?;
        let (word, off) = word(c.value(), at)?;
        let long = self.machine.long(by);
        Some(Priced {
            way: WordWay::Product(long, [Aligned::Node(a, 0), Aligned::Constant(word)], 0),
            cost: self.machine.product(long),
            error: unit(bits) + off * self.magnitude[a.index()],
        })
    }

    /// A product of two values.
    fn product(&self, [a, b]: [NodeId; 2], bits: i32, points: &[i32], weight: f64) -> Option<Priced> {
        let [pa, pb] = [a, b].map(|id| points[id.index()]);
        let beyond = pa + pb - 32 - bits;
        let long = u32::try_from(pa + pb - bits).ok().filter(|by| (1..32).contains(by));
        let long = long.map(|by| self.machine.long(by)).map(|long| Priced {
            way: WordWay::Product(long, [Aligned::Node(a, 0), Aligned::Node(b, 0)], 0),
            cost: self.machine.product(long),
            error: unit(bits),
        });
        let room = |id: NodeId, point: i32| (self.natural[id.index()] - point).max(0);
        let left_a = (-beyond).clamp(0, room(a, pa));
        let left_b = (-beyond - left_a).clamp(0, if a == b { 0 } else { room(b, pb) });
        if beyond + left_a + left_b < 0 || beyond > 31 {
            return long;
        }
        let after = beyond.max(0) as u32;
        let shifts = [left_a > 0, left_b > 0, after > 0].into_iter().filter(|s| *s).count() as f64;
        let factors = [Aligned::Node(a, left_a), Aligned::Node(b, left_b)];
        let lower = |of: usize, out: u32| {
            let (other, point) = if of == 0 { (b, pa + left_a) } else { (a, pb + left_b) };
            left_out(out, point) * self.magnitude[other.index()]
        };
        let rounding = if after > 0 { unit(bits) } else { 0.0 };
        let last = unit(bits + beyond.max(0));
        let ways = self.machine.products().iter().flat_map(|kind| {
            kind.orders().iter().map(move |order| {
                let left_out = order.iter().zip(kind.leaves_out()).map(|(of, out)| lower(*of, out));
                Priced {
                    way: WordWay::Product(*kind, order.map(|k| factors[k]), after),
                    cost: self.machine.product(*kind) + shifts,
                    error: kind.loss() * last + rounding + left_out.sum::<f64>(),
                }
            })
        });
        Self::least(weight, ways.chain(long))
    }
}
