//! Double-double arithmetic: an unevaluated sum of two f64, about 106 bits.
//!
//! Used for constants (rounded once, at emission), and as the oracle's scalar. Algorithms: Dekker 1971 (products by
//! splitting, as `core` has no fused multiply-add), Knuth (two-sum), Joldes, Muller and Popescu 2017 (error bounds).
//! Relative error of +, −: 3u², ×: 7u², ÷: 15u² with u = 2⁻⁵³.
//!
//! The bounds hold while the trailing parts are normal numbers (results from about 2⁻⁹⁶⁸) and below overflow. NaN and
//! infinities pass through as in f64; in the last binade before overflow a result may already be infinite or NaN.
//!
//! Longer than 500 lines, as it is one type with its operations and nothing else.

use crate::operators::operators;
use core::fmt;

/// A double-double number `hi + lo`, with `hi` the f64 nearest to the sum.
///
/// Ordered by value; NaN compares with nothing. `Display` writes 31 significant digits, `3.14…e0`, trailing zeros left
/// out, or with a precision, `{:.9}`, that many (up to 30) after the point; the relative error of the text is below 10⁻³⁰.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Dd {
    hi: f64,
    lo: f64,
}

/// `a + b` = sum + error, exactly.
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// [`two_sum`] for |a| ≥ |b|, or a a multiple of b's ulp.
#[inline]
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

/// `a` as two parts of at most 26 bits each (and a sign), rounded in the bits: Dekker's multiplication by 2^27 + 1 would
/// overflow above 2^996.
#[inline]
fn split(a: f64) -> (f64, f64) {
    let hi = f64::from_bits(a.to_bits().wrapping_add(1 << 26) & !((1 << 27) - 1));
    (hi, a - hi)
}

/// `a·b` = product + error, exactly.
#[inline]
fn two_prod(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

/// 2^n, −1022 ≤ n ≤ 1023.
fn power_of_two(n: i32) -> f64 {
    f64::from_bits(((1023 + n) as u64) << 52)
}

/// 5^n, n < 512, relative error below 25u²; exact up to 5^45.
fn power_of_five(n: u32) -> Dd {
    const SQUARES: [Dd; 9] = [
        Dd { hi: 5.0, lo: 0.0 },
        Dd { hi: 25.0, lo: 0.0 },
        Dd { hi: 625.0, lo: 0.0 },
        Dd { hi: 390_625.0, lo: 0.0 },
        Dd { hi: 152_587_890_625.0, lo: 0.0 },
        Dd { hi: 2.3283064365386964e22, lo: -1_249_407.0 },
        Dd { hi: 5.421010862427522e44, lo: -1.1557822304175851e28 },
        Dd { hi: 2.938735877055719e89, lo: -2.2091796174082778e73 },
        Dd { hi: 8.636168555094445e178, lo: -2.601875490681736e162 },
    ];
    let mut power = Dd::ONE;
    for (bit, &square) in SQUARES.iter().enumerate() {
        if n >> bit & 1 == 1 {
            power = power * square;
        }
    }
    power
}

impl Dd {
    /// Zero.
    pub const ZERO: Dd = Dd { hi: 0.0, lo: 0.0 };
    /// One.
    pub const ONE: Dd = Dd { hi: 1.0, lo: 0.0 };
    /// One half.
    pub const HALF: Dd = Dd { hi: 0.5, lo: 0.0 };
    /// π.
    pub const PI: Dd = Dd { hi: core::f64::consts::PI, lo: 1.2246467991473532e-16 };
    /// π/2.
    pub const FRAC_PI_2: Dd = Dd { hi: core::f64::consts::FRAC_PI_2, lo: 6.123233995736766e-17 };
    const NAN: Dd = Dd { hi: f64::NAN, lo: 0.0 };

    /// The sum of two f64, exact, in any order of size.
    #[inline]
    pub fn new(hi: f64, lo: f64) -> Dd {
        let (s, e) = two_sum(hi, lo);
        if s.is_finite() {
            Dd { hi: s, lo: e }
        } else {
            Dd::from(s)
        }
    }

    /// The number written in decimal: `-12.5`, `.5`, `1e-3`, of any length; `None` if the text is anything else.
    ///
    /// The relative error is below 2⁻¹⁰⁰ from 10⁻²⁹⁰ up, and there is none for integers below 10³⁷. Beyond f64's range the
    /// result is infinite, or zero.
    ///
    /// ```
    /// use straightline_core::Dd;
    /// let pi = Dd::from_decimal("3.14159265358979323846264338327950288").unwrap();
    /// assert!((pi - Dd::PI).abs().to_f64() < 1e-31);
    /// assert_eq!(Dd::from_decimal("3,14"), None);
    /// ```
    pub fn from_decimal(text: &str) -> Option<Dd> {
        let text = text.as_bytes();
        let (negative, unsigned) = match text {
            [b'-', rest @ ..] => (true, rest),
            [b'+', rest @ ..] => (false, rest),
            rest => (false, rest),
        };
        let (mut mantissa, mut exponent) = (0u128, 0i64); // value = mantissa·10^exponent
        let (mut any_digit, mut after_point) = (false, false);
        let mut rest = unsigned;
        while let [byte, tail @ ..] = rest {
            match byte {
                b'0'..=b'9' => {
                    any_digit = true;
                    // what follows the first 37 digits is below 10^-36 of the value
                    if mantissa < 10u128.pow(36) {
                        mantissa = 10 * mantissa + u128::from(byte - b'0');
                        exponent -= i64::from(after_point);
                    } else {
                        exponent += i64::from(!after_point);
                    }
                }
                b'.' if !after_point => after_point = true,
                b'e' | b'E' if any_digit => {
                    exponent = exponent.saturating_add(decimal_exponent(tail)?);
                    rest = &[];
                    break;
                }
                _ => return None,
            }
            rest = tail;
        }
        if !any_digit || !rest.is_empty() {
            return None;
        }
        let magnitude = if mantissa == 0 || exponent < -400 {
            Dd::ZERO
        } else if exponent > 310 {
            Dd::from(f64::INFINITY)
        } else {
            Dd::from_integer(mantissa).times_power_of_ten(exponent as i32)
        };
        Some(if negative { -magnitude } else { magnitude })
    }

    /// The nearest number to an integer below 2^126.
    fn from_integer(n: u128) -> Dd {
        let hi = n as f64;
        Dd { hi, lo: (n as i128 - hi as i128) as f64 }
    }

    /// `self · 10^n`, |n| ≤ 400: the powers of five stay far from overflow, the powers of two are exact.
    fn times_power_of_ten(self, n: i32) -> Dd {
        let two = power_of_two(n);
        let five = power_of_five(n.unsigned_abs());
        if n < 0 {
            (self / five).scaled(two)
        } else {
            // first what makes a subnormal number normal, then what may overflow
            let (early, late) = if self.hi.abs() < 1.0 { (two, 1.0) } else { (1.0, two) };
            (self.scaled(early) * five).scaled(late)
        }
    }

    /// Times a power of two: exact but for underflow.
    fn scaled(self, power_of_two: f64) -> Dd {
        let hi = self.hi * power_of_two;
        Dd { hi, lo: if hi.is_finite() { self.lo * power_of_two } else { 0.0 } }
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

    /// The nearest f32, ties to even: rounded once, from all 106 bits.
    #[inline]
    pub fn to_f32(self) -> f32 {
        if self.lo == 0.0 || !self.hi.is_finite() {
            return self.hi as f32;
        }
        // Round the sum to odd in f64 (cut towards zero, the last bit says that something was cut): a rounding with
        // at least two bits to spare, after which the second rounding is the right one (Boldo and Melquiond 2008).
        let towards_zero = (self.lo < 0.0) != (self.hi < 0.0);
        f64::from_bits((self.hi.to_bits() - u64::from(towards_zero)) | 1) as f32
    }

    /// Absolute value.
    #[must_use]
    pub fn abs(self) -> Dd {
        if self.hi.is_sign_negative() {
            -self
        } else {
            self
        }
    }

    /// Square root, relative error below 4u²; NaN below zero.
    ///
    /// One Newton step from the correctly rounded root s of `hi`: √x = s + (x − s²)/2s, less half the square of the
    /// relative error of s, which is u²/2 (Lefèvre, Louvet, Muller, Picot and Rideau 2023).
    #[must_use]
    pub fn sqrt(self) -> Dd {
        if self.hi == 0.0 || self.hi == f64::INFINITY {
            return self;
        }
        if self.hi < 1e-200 {
            // the error term of s² is exact only where it is not subnormal; negative numbers leave here too
            return if self.hi > 0.0 {
                self.scaled(power_of_two(600)).sqrt().scaled(power_of_two(-300))
            } else {
                Dd::NAN
            };
        }
        let s = crate::trig::sqrt_f64(self.hi);
        let (p, e) = two_prod(s, s);
        let (hi, lo) = fast_two_sum(s, ((self.hi - p) - e + self.lo) / (2.0 * s));
        Dd { hi, lo }
    }

    /// `(sin x, cos x)`, absolute errors below 10⁻³¹, relative ones too where x is an f64; NaN from |x| = 2^23·π/2, which is
    /// 1.3·10⁷, on.
    ///
    /// Cody-Waite reduction by π/2 in three parts of 30 bits, so that their products with k are exact, and a
    /// double-double rest, 2^-203 in all; Taylor series on |r| ≤ π/4, whose terms below 2^-53 need only f64.
    #[must_use]
    pub fn sin_cos(self) -> (Dd, Dd) {
        const LIMIT: f64 = 8_388_608.0 * core::f64::consts::FRAC_PI_2;
        const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5·2^52
        const P1: f64 = 1.5707963276654482;
        const P2: f64 = -8.705515692000731e-10;
        const P3: f64 = -3.503434396954818e-19;
        const P4: Dd = Dd { hi: -1.1351118607522202e-28, lo: 4.916232119866224e-45 };
        if self.hi.is_nan() || self.hi.abs() >= LIMIT {
            return (Dd::NAN, Dd::NAN);
        }
        let shifted = self.hi * core::f64::consts::FRAC_2_PI + ROUND;
        let k = shifted - ROUND;
        // hi − k·P1 is exact (a multiple of 2^-53 below 1); each further difference has an error relative to itself
        let r = Dd::new(self.hi - k * P1, self.lo);
        let r = r - Dd::from(k * P2);
        let r = r - Dd::from(k * P3);
        let r = r - Dd::from(k) * P4;

        let z = r * r;
        let sin = r + r * z * series(z, &SIN_SERIES, &SIN_REST);
        let cos = Dd::ONE - z * Dd::HALF + z * z * series(z, &COS_SERIES, &COS_REST);
        match shifted.to_bits() & 3 {
            0 => (sin, cos),
            1 => (cos, -sin),
            2 => (-sin, -cos),
            _ => (-cos, sin),
        }
    }
}

/// The exponent of a decimal number, `5`, `+5`, `-05`; clamped where no double could tell the difference.
fn decimal_exponent(text: &[u8]) -> Option<i64> {
    let (sign, digits) = match text {
        [b'-', rest @ ..] => (-1, rest),
        [b'+', rest @ ..] => (1, rest),
        rest => (1, rest),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0i64;
    for byte in digits {
        if !byte.is_ascii_digit() {
            return None;
        }
        value = (10 * value + i64::from(byte - b'0')).min(i64::MAX / 20);
    }
    Some(sign * value)
}

/// Horner's rule: `head[0] + head[1] z + … + z^len (rest[0] + rest[1] z + …)`, the rest in f64.
fn series(z: Dd, head: &[Dd], rest: &[f64]) -> Dd {
    let rest = rest.iter().rev().fold(0.0, |sum, c| c + z.hi * sum);
    head.iter().rev().fold(Dd::from(rest), |sum, &c| c + z * sum)
}

/// −1/3!, 1/5!, … −1/15!
const SIN_SERIES: [Dd; 7] = [
    Dd { hi: -0.16666666666666666, lo: -9.25185853854297e-18 },
    Dd { hi: 0.008333333333333333, lo: 1.1564823173178714e-19 },
    Dd { hi: -0.0001984126984126984, lo: -1.7209558293420705e-22 },
    Dd { hi: 2.7557319223985893e-6, lo: -1.858393274046472e-22 },
    Dd { hi: -2.505210838544172e-8, lo: 1.448814070935912e-24 },
    Dd { hi: 1.6059043836821613e-10, lo: 1.2585294588752098e-26 },
    Dd { hi: -7.647163731819816e-13, lo: -7.03872877733453e-30 },
];

/// 1/17!, … −1/27!
const SIN_REST: [f64; 6] = [
    2.8114572543455206e-15,
    -8.22063524662433e-18,
    1.9572941063391263e-20,
    -3.868170170630684e-23,
    6.446950284384474e-26,
    -9.183689863795546e-29,
];

/// 1/4!, −1/6!, … 1/16!
const COS_SERIES: [Dd; 7] = [
    Dd { hi: 0.041666666666666664, lo: 2.3129646346357427e-18 },
    Dd { hi: -0.001388888888888889, lo: 5.300543954373577e-20 },
    Dd { hi: 2.48015873015873e-5, lo: 2.1511947866775882e-23 },
    Dd { hi: -2.755731922398589e-7, lo: -2.3767714622250297e-23 },
    Dd { hi: 2.08767569878681e-9, lo: -1.20734505911326e-25 },
    Dd { hi: -1.1470745597729725e-11, lo: -2.0655512752830745e-28 },
    Dd { hi: 4.779477332387385e-14, lo: 4.399205485834081e-31 },
];

/// −1/18!, … 1/28!
const COS_REST: [f64; 6] = [
    -1.5619206968586225e-16,
    4.110317623312165e-19,
    -8.896791392450574e-22,
    1.6117375710961184e-24,
    -2.4795962632247976e-27,
    3.279889237069838e-30,
];

impl From<f64> for Dd {
    fn from(x: f64) -> Dd {
        Dd { hi: x, lo: 0.0 }
    }
}

operators! { [] Dd:
    Neg neg |a| Dd { hi: -a.hi, lo: -a.lo };
    Add add |a, b| {
        let (s, e) = two_sum(a.hi, b.hi);
        if !s.is_finite() {
            return Dd::from(s);
        }
        let (t, f) = two_sum(a.lo, b.lo);
        let (s, e) = fast_two_sum(s, e + t);
        let (hi, lo) = fast_two_sum(s, e + f);
        Dd { hi, lo }
    };
    Sub sub |a, b| a + -b;
    Mul mul |a, b| {
        let (p, e) = two_prod(a.hi, b.hi);
        if !p.is_finite() {
            return Dd::from(p);
        }
        let (hi, lo) = fast_two_sum(p, e + (a.hi * b.lo + a.lo * b.hi));
        Dd { hi, lo }
    };
    // Long division with three digits of 53 bits.
    Div div |a, b| {
        let q1 = a.hi / b.hi;
        if !q1.is_finite() || !b.hi.is_finite() {
            return Dd::from(q1);
        }
        let r = a - b * Dd::from(q1);
        let q2 = r.hi / b.hi;
        let r = r - b * Dd::from(q2);
        let q3 = r.hi / b.hi;
        Dd::new(q1, q2) + Dd::from(q3)
    };
}

impl fmt::Display for Dd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.hi.is_finite() || self.hi == 0.0 {
            return fmt::Display::fmt(&self.hi, f);
        }
        let places = f.precision().unwrap_or(30).min(30);
        let ten = 10u128.pow(places as u32);
        // value = digits·10^(exponent − places), 10^places ≤ digits < 10^(places + 1). The first exponent, from the binary
        // one (log10 2 = 0.30103), is never too small, and one too large at most, but for subnormal numbers.
        let magnitude = self.abs();
        let binary = (magnitude.hi.to_bits() >> 52) as i32 - 1022;
        let mut exponent = (binary * 30_103).div_euclid(100_000) + 1;
        let mut scaled = magnitude.times_power_of_ten(places as i32 - exponent);
        while scaled < Dd::from_integer(ten) {
            exponent -= 1;
            scaled = magnitude.times_power_of_ten(places as i32 - exponent);
        }
        let mut digits = scaled.round();
        if digits == 10 * ten {
            digits = ten;
            exponent += 1;
        }

        // from the end of the buffer: exponent, digits, point
        let mut text = Backwards { bytes: [0; 48], start: 48 };
        text.number(u128::from(exponent.unsigned_abs()));
        if exponent < 0 {
            text.push(b'-');
        }
        text.push(b'e');
        let mut places = places;
        if f.precision().is_none() {
            while places > 0 && digits.is_multiple_of(10) {
                digits /= 10;
                places -= 1;
            }
        }
        for _ in 0..places {
            text.push(b'0' + (digits % 10) as u8);
            digits /= 10;
        }
        if places > 0 {
            text.push(b'.');
        }
        text.number(digits);
        f.pad_integral(!self.hi.is_sign_negative(), "", text.as_str())
    }
}

impl Dd {
    /// The nearest integer of a number in [0, 2^120].
    fn round(self) -> u128 {
        let Dd { hi, lo } = self + Dd::HALF;
        let whole = hi as i128;
        let below = if whole as f64 == hi { lo as i128 - i128::from((lo as i128 as f64) > lo) } else { 0 };
        (whole + below) as u128
    }
}

/// A text that is written from its end.
struct Backwards {
    bytes: [u8; 48],
    start: usize,
}

impl Backwards {
    fn push(&mut self, byte: u8) {
        self.start -= 1;
        self.bytes[self.start] = byte;
    }

    fn number(&mut self, mut n: u128) {
        loop {
            self.push(b'0' + (n % 10) as u8);
            n /= 10;
            if n == 0 {
                return;
            }
        }
    }

    fn as_str(&self) -> &str {
        core::str::from_utf8(&self.bytes[self.start..]).expect("digits are ASCII")
    }
}

operators!(assign [] Dd);
