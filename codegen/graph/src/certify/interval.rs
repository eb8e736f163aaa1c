//! Intervals of f64 with outward rounding.
//!
//! IEEE 754 rounds +, −, ×, ÷, √ to the nearest number, so the exact result lies strictly between the neighbours of the
//! computed one: every lower end takes one step down, every upper end one step up (`next_down`, `next_up`). This also holds
//! where a result underflows. Ends may become infinite; an end that is not a number becomes infinite.

use straightline_core::trig;

/// A closed interval; empty intervals do not occur.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

/// An upper bound of a + b for numbers that are exact or upper bounds.
pub(super) fn add_up(a: f64, b: f64) -> f64 {
    if a == 0.0 {
        b
    } else if b == 0.0 {
        a
    } else {
        (a + b).next_up()
    }
}

/// An upper bound of a·b for a, b ≥ 0; 0 · ∞ is 0, as a factor that vanishes does so everywhere.
pub(super) fn mul_up(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        0.0
    } else {
        (a * b).next_up()
    }
}

/// An upper bound of √(Σ x²).
pub(super) fn norm_up(parts: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count, mut last) = (0.0, 0, 0.0);
    for x in parts.into_iter().filter(|x| *x != 0.0) {
        sum = add_up(sum, (x * x).next_up());
        count += 1;
        last = x.abs();
    }
    match count {
        0 => 0.0,
        1 => last,
        _ => sum.sqrt().next_up(),
    }
}

impl Interval {
    /// Zero alone.
    pub const ZERO: Interval = Interval { lo: 0.0, hi: 0.0 };
    /// One alone.
    pub const ONE: Interval = Interval { lo: 1.0, hi: 1.0 };
    /// All numbers.
    pub const WHOLE: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// From its ends, in order.
    pub fn new(lo: f64, hi: f64) -> Self {
        debug_assert!(lo <= hi, "{lo} > {hi}");
        Interval { lo, hi }
    }

    /// One number.
    pub fn point(x: f64) -> Self {
        Interval { lo: x, hi: x }
    }

    /// −x … x.
    pub fn around_zero(x: f64) -> Self {
        Interval { lo: -x, hi: x }
    }

    /// Ends as computed, one step outwards.
    fn outward(lo: f64, hi: f64) -> Self {
        if lo.is_nan() || hi.is_nan() {
            return Interval::WHOLE;
        }
        Interval { lo: lo.next_down(), hi: hi.next_up() }
    }

    /// Greatest absolute value.
    pub fn mag(self) -> f64 {
        self.hi.abs().max(self.lo.abs())
    }

    /// Whether zero is in it.
    pub fn has_zero(self) -> bool {
        self.lo <= 0.0 && self.hi >= 0.0
    }

    /// Whether it is zero alone.
    pub fn is_zero(self) -> bool {
        self.lo == 0.0 && self.hi == 0.0
    }

    /// Upper end less lower end, rounded up.
    pub fn width(self) -> f64 {
        (self.hi - self.lo).next_up()
    }

    /// The part of it within ±x: for values that are known to be there.
    #[must_use]
    pub fn clipped(self, x: f64) -> Self {
        // an empty intersection can only come from rounding to the nearest end: keep that end
        let (lo, hi) = (self.lo.max(-x), self.hi.min(x));
        if lo <= hi {
            Interval { lo, hi }
        } else {
            self
        }
    }

    /// The intersection of two enclosures of the same number.
    #[must_use]
    pub fn intersect(self, other: Self) -> Self {
        let (lo, hi) = (self.lo.max(other.lo), self.hi.min(other.hi));
        if lo <= hi {
            Interval { lo, hi }
        } else {
            self
        }
    }

    /// The smallest interval around both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Interval { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// All numbers within `h` of it.
    #[must_use]
    pub fn widened(self, h: f64) -> Self {
        if h == 0.0 {
            self
        } else {
            Interval::outward(self.lo - h, self.hi + h)
        }
    }

    /// x², of one and the same x.
    #[must_use]
    pub fn square(self) -> Self {
        let (a, b) = (self.lo.abs(), self.hi.abs());
        let low = if self.has_zero() { 0.0 } else { (a.min(b) * a.min(b)).next_down().max(0.0) };
        Interval { lo: low, hi: (a.max(b) * a.max(b)).next_up() }
    }

    /// The quotient; all numbers if the divisor may vanish.
    #[must_use]
    pub fn over(self, b: Self) -> Self {
        if b.has_zero() {
            return Interval::WHOLE;
        }
        let ends = [self.lo / b.lo, self.lo / b.hi, self.hi / b.lo, self.hi / b.hi];
        if ends.iter().any(|x| x.is_nan()) {
            return Interval::WHOLE;
        }
        Interval::outward(
            ends.into_iter().fold(f64::INFINITY, f64::min),
            ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// The root of the numbers in it that have one.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = Interval::outward(self.lo.max(0.0).sqrt(), self.hi.max(0.0).sqrt());
        Interval { lo: root.lo.max(0.0), hi: root.hi }
    }

    /// The signs of the numbers in it.
    #[must_use]
    pub fn sign(self) -> Self {
        match self {
            Interval { lo, .. } if lo > 0.0 => Interval::ONE,
            Interval { hi, .. } if hi < 0.0 => -Interval::ONE,
            _ => Interval { lo: -1.0, hi: 1.0 },
        }
    }

    /// Sines and cosines of the angles in it.
    ///
    /// At the ends the kernel's values, which are within an ulp, two steps outwards; between them the extremes that lie
    /// within 1e-8 of the interval. Angles beyond 1e6 get −1 … 1.
    pub fn sin_cos(self) -> (Self, Self) {
        const WHOLE: Interval = Interval { lo: -1.0, hi: 1.0 };
        const SLACK: f64 = 1e-8;
        let is_wide = |x: f64, most: f64| x.is_nan() || x > most;
        if is_wide(self.width(), 6.25) || is_wide(self.mag(), 1e6) {
            return (WHOLE, WHOLE);
        }
        let ((s0, c0), (s1, c1)) = (trig::sin_cos_f64(self.lo), trig::sin_cos_f64(self.hi));
        // whether the interval comes near `at` + 2kπ
        let meets = |at: f64| {
            let turns = (self.lo - SLACK - at) / core::f64::consts::TAU;
            let next = at + turns.ceil() * core::f64::consts::TAU;
            next <= self.hi + SLACK || self.lo - SLACK >= next
        };
        let range = |a: f64, b: f64, top: f64| {
            let (lo, hi) = (a.min(b).next_down().next_down(), a.max(b).next_up().next_up());
            let lo = if meets(top + core::f64::consts::PI) { -1.0 } else { lo.max(-1.0) };
            let hi = if meets(top) { 1.0 } else { hi.min(1.0) };
            Interval { lo, hi }
        };
        (range(s0, s1, core::f64::consts::FRAC_PI_2), range(c0, c1, 0.0))
    }
}

impl std::ops::Add for Interval {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        if self.is_zero() {
            b
        } else if b.is_zero() {
            self
        } else {
            Interval::outward(self.lo + b.lo, self.hi + b.hi)
        }
    }
}

impl std::ops::Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Interval { lo: -self.hi, hi: -self.lo }
    }
}

impl std::ops::Sub for Interval {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl std::ops::Div for Interval {
    type Output = Self;
    /// As [`Interval::over`].
    fn div(self, b: Self) -> Self {
        self.over(b)
    }
}

impl std::ops::Mul for Interval {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        if self.is_zero() || b.is_zero() {
            return Interval::ZERO;
        }
        if self == Interval::ONE {
            return b;
        }
        if b == Interval::ONE {
            return self;
        }
        let ends = [self.lo * b.lo, self.lo * b.hi, self.hi * b.lo, self.hi * b.hi];
        if ends.iter().any(|x| x.is_nan()) {
            return Interval::WHOLE;
        }
        Interval::outward(
            ends[0].min(ends[1]).min(ends[2].min(ends[3])),
            ends[0].max(ends[1]).max(ends[2].max(ends[3])),
        )
    }
}
