//! Rulers for tests of scalars: units in the last place, errors against a truth, and a seeded source of numbers.
#![allow(dead_code)] // every test file uses a part of it

use straightline_core::Dd;

/// A source of numbers; its own number is the seed.
pub struct Random(pub u64);

impl Random {
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        straightline_core::random::split_mix_64(&mut self.0)
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number of 106 random bits, its binary exponent uniform in the range.
    pub fn double_double(&mut self, low_exponent: i32, high_exponent: i32) -> Dd {
        let scale = self.uniform(f64::from(low_exponent), f64::from(high_exponent)).floor().exp2();
        let hi = self.uniform(1.0, 2.0) * scale;
        let sign = if self.bits() & 1 == 0 { 1.0 } else { -1.0 };
        Dd::new(sign * hi, sign * hi * self.uniform(-1.0, 1.0) * 2f64.powi(-53))
    }
}

/// One unit in the last place of an f64 of this size.
pub fn ulp_f64(x: f64) -> f64 {
    let exponent = (x.abs().to_bits() >> 52).max(1);
    f64::from_bits(exponent << 52) * f64::EPSILON
}

/// One unit in the last place of an f32 of this size.
pub fn ulp_f32(x: f64) -> f64 {
    let exponent = (x.abs().to_bits() >> 52).max(1023 - 126);
    f64::from_bits(exponent << 52) * f64::from(f32::EPSILON)
}

/// |computed − truth| in f64 ulp of the truth; infinite if either is NaN.
pub fn error_f64(computed: f64, truth: Dd) -> f64 {
    let error = ((Dd::from(computed) - truth).to_f64() / ulp_f64(truth.to_f64())).abs();
    if error.is_nan() {
        f64::INFINITY
    } else {
        error
    }
}

/// |computed − truth| in f32 ulp of the truth; infinite if either is NaN.
#[inline]
pub fn error_f32(computed: f32, truth: f64) -> f64 {
    let error = ((f64::from(computed) - truth) / ulp_f32(truth)).abs();
    if error.is_nan() {
        f64::INFINITY
    } else {
        error
    }
}

/// The largest error of sin and of cos so far, and where.
#[derive(Clone, Copy, Debug, Default)]
pub struct Worst {
    /// Error of sin [ulp] and its argument.
    pub sin: (f64, f64),
    /// Error of cos [ulp] and its argument.
    pub cos: (f64, f64),
}

impl Worst {
    /// Takes one more argument into account.
    #[inline]
    pub fn add(&mut self, x: f64, sin: f64, cos: f64) {
        if sin > self.sin.0 {
            self.sin = (sin, x);
        }
        if cos > self.cos.0 {
            self.cos = (cos, x);
        }
    }

    /// The larger of the two errors.
    pub fn max(&self) -> f64 {
        self.sin.0.max(self.cos.0)
    }
}

/// Largest errors of a sin-and-cos over the arguments, against double-double.
pub fn worst_f64(f: impl Fn(f64) -> (f64, f64), arguments: impl Iterator<Item = f64>) -> Worst {
    let mut worst = Worst::default();
    for x in arguments {
        let (sin, cos) = f(x);
        let truth = Dd::from(x).sin_cos();
        worst.add(x, error_f64(sin, truth.0), error_f64(cos, truth.1));
    }
    worst
}

/// Largest errors of a sin-and-cos over the arguments, against the f64 functions of `std` (0.01 f32 ulp would need an error of
/// five million f64 ulp).
pub fn worst_f32(f: impl Fn(f32) -> (f32, f32), arguments: impl Iterator<Item = f32>) -> Worst {
    let mut worst = Worst::default();
    for x in arguments {
        let (sin, cos) = f(x);
        let truth = f64::from(x).sin_cos();
        worst.add(f64::from(x), error_f32(sin, truth.0), error_f32(cos, truth.1));
    }
    worst
}

/// The f64 that follow one another around the nearest one to k·π/2, `reach` on either side.
pub fn around_multiple(k: u32, reach: u64) -> impl Iterator<Item = f64> {
    let nearest = (Dd::from(f64::from(k)) * Dd::FRAC_PI_2).to_f64().to_bits();
    (nearest - reach..=nearest + reach).map(f64::from_bits)
}
