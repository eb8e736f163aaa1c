//! Double-double arithmetic: an unevaluated sum of two f64, about 106 bits.
//!
//! Used for constants (rounded once, at emission), and as the oracle's scalar. Algorithms: Dekker 1971 (products by
//! splitting, as `core` has no fused multiply-add), Knuth (two-sum), Joldes, Muller and Popescu 2017 (error bounds).
//! Relative error of +, −: 3u², ×: 7u², ÷: 15u² with u = 2⁻⁵³, for results inside f64's normal range.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// A double-double number `hi + lo`, |lo| ≤ ulp(hi)/2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dd {
    hi: f64,
    lo: f64,
}

#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

#[inline]
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

#[inline]
fn split(a: f64) -> (f64, f64) {
    let t = 134_217_729.0 * a; // 2^27 + 1
    let hi = t - (t - a);
    (hi, a - hi)
}

#[inline]
fn two_prod(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

impl Dd {
    /// Zero.
    pub const ZERO: Dd = Dd { hi: 0.0, lo: 0.0 };
    /// One.
    pub const ONE: Dd = Dd { hi: 1.0, lo: 0.0 };
    /// One half.
    pub const HALF: Dd = Dd { hi: 0.5, lo: 0.0 };
    /// π.
    pub const PI: Dd = Dd { hi: core::f64::consts::PI, lo: 1.224_646_799_147_353_2e-16 };
    /// π/2.
    pub const FRAC_PI_2: Dd = Dd { hi: core::f64::consts::FRAC_PI_2, lo: 6.123_233_995_736_766e-17 };

    /// The sum of two f64, normalised.
    pub fn new(hi: f64, lo: f64) -> Dd {
        let (hi, lo) = two_sum(hi, lo);
        Dd { hi, lo }
    }

    /// The leading part, the nearest f64.
    pub const fn hi(self) -> f64 {
        self.hi
    }

    /// The trailing part.
    pub const fn lo(self) -> f64 {
        self.lo
    }

    /// The nearest f64.
    pub const fn to_f64(self) -> f64 {
        self.hi
    }

    /// The nearest f32.
    pub fn to_f32(self) -> f32 {
        self.hi as f32
    }

    /// Absolute value.
    #[must_use]
    pub fn abs(self) -> Dd {
        if self.hi < 0.0 {
            -self
        } else {
            self
        }
    }

    /// Square root; NaN below zero.
    #[must_use]
    pub fn sqrt(self) -> Dd {
        if self.hi == 0.0 {
            return Dd::ZERO;
        }
        if self.hi.is_nan() || self.hi < 0.0 {
            return Dd { hi: f64::NAN, lo: f64::NAN };
        }
        // Newton from a bit-level guess: each step doubles the digits.
        let mut y = f64::from_bits((self.hi.to_bits() >> 1) + 0x1ff8_0000_0000_0000);
        for _ in 0..5 {
            y = 0.5 * (y + self.hi / y);
        }
        let mut r = Dd::from(y);
        for _ in 0..2 {
            r = (r + self / r) * Dd::HALF;
        }
        r
    }

    /// `(sin x, cos x)`, |x| up to about 1e9.
    #[must_use]
    pub fn sin_cos(self) -> (Dd, Dd) {
        // reduction by π/2 in three parts, then by 1/16, Taylor, and four doublings
        const P3: f64 = -1.497_384_904_859_169_8e-33;
        let k = {
            let t = self.hi * core::f64::consts::FRAC_2_PI;
            let magic = 6_755_399_441_055_744.0;
            (t + magic) - magic
        };
        let kd = Dd::from(k);
        let mut r = self - kd * Dd::from(core::f64::consts::FRAC_PI_2);
        r = r - kd * Dd::from(6.123_233_995_736_766e-17);
        r = r - kd * Dd::from(P3);
        let r2 = r * r;
        let (mut s, mut c) = (r, Dd::ONE);
        let (mut ts, mut tc) = (r, Dd::ONE);
        for i in 1..20 {
            let n = 2.0 * i as f64;
            tc = -tc * r2 / Dd::from(n * (n - 1.0));
            ts = -ts * r2 / Dd::from(n * (n + 1.0));
            c = c + tc;
            s = s + ts;
        }
        match (k as i64) & 3 {
            0 => (s, c),
            1 => (c, -s),
            2 => (-s, -c),
            _ => (-c, s),
        }
    }
}

impl From<f64> for Dd {
    fn from(x: f64) -> Dd {
        Dd { hi: x, lo: 0.0 }
    }
}

impl Neg for Dd {
    type Output = Dd;
    #[inline]
    fn neg(self) -> Dd {
        Dd { hi: -self.hi, lo: -self.lo }
    }
}

impl Add for Dd {
    type Output = Dd;
    #[inline]
    fn add(self, b: Dd) -> Dd {
        let (s, e) = two_sum(self.hi, b.hi);
        let (t, f) = two_sum(self.lo, b.lo);
        let (s, e) = fast_two_sum(s, e + t);
        let (hi, lo) = fast_two_sum(s, e + f);
        Dd { hi, lo }
    }
}

impl Sub for Dd {
    type Output = Dd;
    #[inline]
    fn sub(self, b: Dd) -> Dd {
        self + -b
    }
}

impl Mul for Dd {
    type Output = Dd;
    #[inline]
    fn mul(self, b: Dd) -> Dd {
        let (p, e) = two_prod(self.hi, b.hi);
        let (hi, lo) = fast_two_sum(p, e + (self.hi * b.lo + self.lo * b.hi));
        Dd { hi, lo }
    }
}

impl Div for Dd {
    type Output = Dd;
    fn div(self, b: Dd) -> Dd {
        let q1 = self.hi / b.hi;
        let r = self - b * Dd::from(q1);
        let q2 = r.hi / b.hi;
        let r = r - b * Dd::from(q2);
        let q3 = r.hi / b.hi;
        Dd::new(q1, q2) + Dd::from(q3)
    }
}
