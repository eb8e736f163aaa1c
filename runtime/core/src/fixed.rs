//! Fixed-point arithmetic in words of 32 bits, in `core` alone: products, sine and cosine.
//!
//! The file uses nothing of its crate, so that it can stand as a private module in generated code. A number x has a binary point f: its word
//! is the integer x·2^f. All operations are integer ones, so the bits are the same on every machine. Sums wrap where they are meant to
//! (angles), nowhere else: that is proven by whoever calls them.
//!
//! # Products
//! Of two words with the points f and g a product has the point f + g − 32. [`wide`] is the high half of the product of 64 bits, which is one
//! instruction where there is one (`mulh`, `smull`); [`long`] keeps lower bits, for a few more. The others are made of products of halves for machines that multiply 32 bits to 32
//! bits only: [`exact`] and [`long_exact`], which are the same numbers, [`full`] without the product of both lower halves, [`half`] without the lower half of its second operand, [`short`] without that of both, [`uneven`] of 24 bits and 8. All of them are rounded
//! down. In units of the last place: [`wide`] and [`exact`] lose less than 1, [`full`] less than 3.
//!
//! # Sine and cosine
//! 1. **Reduction**: n is the angle in quarter turns, rounded; r = angle − n·π/2 in words that wrap, with the point 31: π/2·2^31 is rounded
//!    by 0.27, so r is off by 0.27 n units. n is found from the upper half of the angle and 15 bits of 2/π, which leaves |r| ≤ π/4 + 2^-7 of
//!    all words with points from 24.
//! 2. **Kernels**: sin r = r + r·z·S(z), cos r = 1 − z/2 + z²·D(z), z = r²; S by interpolation in Chebyshev points, D by Remez exchange. The
//!    polynomials are off by 0.04 and 0.2 units of 2^-31. Each product lands at the point of what it is added to.
//! 3. **Quadrant** by masks: an odd n exchanges the two, the second bits of n and of n + 1 give the signs.
//!
//! Results have the point 31 and lie within ±(1 − 2^-31). Errors: [`WIDE_ERROR`], [`EXACT_ERROR`] and [`FULL_ERROR`] for |r| ≤ [`REDUCED`], found on
//! all words there, and [`TURN_ERROR`] per quarter turn of reduction.

/// The high half of a product.
#[inline(always)]
#[must_use]
pub const fn wide(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// A product whose point is less by `by`, fewer than 32.
#[inline(always)]
#[must_use]
pub const fn long(a: i32, b: i32, by: u32) -> i32 {
    ((a as i64 * b as i64) >> by) as i32
}

/// [`wide`] by four products of halves: the same bits.
#[inline(always)]
#[must_use]
pub const fn exact(a: i32, b: i32) -> i32 {
    let (a_low, b_low) = (a & 0xffff, b & 0xffff);
    let low = (a_low as u32).wrapping_mul(b_low as u32) >> 16;
    // neither sum leaves 32 bits: |a|·b_low ≤ 2^15·(2^16 − 1)
    let middle = (a >> 16).wrapping_mul(b_low).wrapping_add(low as i32);
    let further = a_low.wrapping_mul(b >> 16).wrapping_add(middle & 0xffff);
    (a >> 16).wrapping_mul(b >> 16).wrapping_add(middle >> 16).wrapping_add(further >> 16)
}

/// [`long`] by products of halves, 1 to 31 bits to the right: the same bits. Its lower bits are those of the product of 32 bits.
#[inline(always)]
#[must_use]
pub const fn long_exact(a: i32, b: i32, by: u32) -> i32 {
    exact(a, b) << (32 - by) | (a.wrapping_mul(b) as u32 >> by) as i32
}

/// [`wide`] by products of halves, without the product of the lower ones: at most 2 less.
#[inline(always)]
#[must_use]
pub const fn full(a: i32, b: i32) -> i32 {
    half(a, b).wrapping_add((a >> 16).wrapping_mul(b & 0xffff) >> 16)
}

/// The high half of a product with the upper half of `b`.
#[inline(always)]
#[must_use]
pub const fn half(a: i32, b: i32) -> i32 {
    (a >> 16).wrapping_mul(b >> 16).wrapping_add((a & 0xffff).wrapping_mul(b >> 16) >> 16)
}

/// The product of the upper halves.
#[inline(always)]
#[must_use]
pub const fn short(a: i32, b: i32) -> i32 {
    (a >> 16).wrapping_mul(b >> 16)
}

/// The product of the upper 24 bits of `a` and the upper 8 of `b`.
#[inline(always)]
#[must_use]
pub const fn uneven(a: i32, b: i32) -> i32 {
    (a >> 8).wrapping_mul(b >> 24)
}

/// Kernels answer for |r| up to here, in 2^-31: π/4 + 2^-7.
pub const REDUCED: i32 = 1_703_406_929;

/// Greatest error of the kernels with [`wide`], in units of 2^-31.
pub const WIDE_ERROR: f64 = 2.8;

/// Greatest error of the kernels with [`exact`], but for coefficients, in units of 2^-31.
pub const EXACT_ERROR: f64 = 2.9;

/// Greatest error of the kernels with [`full`], in units of 2^-31.
pub const FULL_ERROR: f64 = 7.1;

/// What a quarter turn of reduction adds to them: 0.27 of π/2·2^31, rounded up.
pub const TURN_ERROR: f64 = 0.28;

/// The products of a kernel, those of coefficients aside.
#[derive(Clone, Copy)]
enum Products {
    Wide,
    Exact,
    Full,
}

/// Sine and cosine of r, whose point is 31.
#[inline(always)]
const fn kernel(r: i32, by: Products) -> (i32, i32) {
    macro_rules! times {
        ($a:expr, $b:expr) => {
            match by {
                Products::Wide => wide($a, $b),
                Products::Exact => exact($a, $b),
                Products::Full => full($a, $b),
            }
        };
    }
    // a coefficient is multiplied by z twice more, or by z and r: what it is off by shrinks to a tenth
    macro_rules! inner {
        ($a:expr, $b:expr) => {
            match by {
                Products::Wide => wide($a, $b),
                Products::Exact | Products::Full => full($a, $b),
            }
        };
    }
    // points: z 30, twice that 31; S 36, 35, 34, 33 and z·S 32; D 35, 34, 33 and z·D 32
    let z = times!(r, r);
    let z2 = z << 1;
    let s = inner!(z2, 187_218).wrapping_sub(6_816_986);
    let s = inner!(z2, s).wrapping_add(143_165_550);
    let s = inner!(z2, s).wrapping_sub(1_431_655_764);
    let sin = r.wrapping_add(times!(r, times!(z2, s)));
    let d = inner!(z2, 838_953).wrapping_sub(23_857_927);
    let d = inner!(z2, d).wrapping_add(357_913_719);
    // 1 less what keeps the cosine of words next to zero below 1: a square by halves may be −2
    let one = if matches!(by, Products::Full) { i32::MAX - 2 } else { i32::MAX };
    let cos = one.wrapping_sub(z).wrapping_add(times!(z2, times!(z2, d)));
    (sin, cos)
}

/// Sine and cosine of an angle with the point `BITS`; results have the point 31. Without `TURNS` the angle is within ±[`REDUCED`].
#[inline(always)]
const fn turned<const BITS: u32, const TURNS: bool>(angle: i32, by: Products) -> (i32, i32) {
    if !TURNS {
        return kernel(angle << (31 - BITS), by);
    }
    // 2/π·2^15
    let n = (angle >> 16).wrapping_mul(20_861).wrapping_add(1 << (BITS - 2)) >> (BITS - 1);
    // −π/2·2^31, less 2^32
    let r = (angle << (31 - BITS)).wrapping_add(n.wrapping_mul(921_707_870));
    let (sin, cos) = kernel(r, by);
    let exchanged = (sin ^ cos) & (n & 1).wrapping_neg();
    let (sin, cos) = (sin ^ exchanged, cos ^ exchanged);
    let (minus_sin, minus_cos) = ((n << 30) >> 31, (n.wrapping_add(1) << 30) >> 31);
    ((sin ^ minus_sin).wrapping_sub(minus_sin), (cos ^ minus_cos).wrapping_sub(minus_cos))
}

/// Sine and cosine of an angle with the point `BITS`, 24 to 31, whose products are [`wide`]; results have the point 31. Without `TURNS` the
/// angle is within ±π/4.
#[inline(always)]
#[must_use]
pub const fn sin_cos_wide<const BITS: u32, const TURNS: bool>(angle: i32) -> (i32, i32) {
    turned::<BITS, TURNS>(angle, Products::Wide)
}

/// [`sin_cos_wide`] whose products are [`exact`], those of coefficients [`full`]: one function for all angles with this point, as it is long.
#[inline(never)]
#[must_use]
pub const fn sin_cos_exact<const BITS: u32, const TURNS: bool>(angle: i32) -> (i32, i32) {
    turned::<BITS, TURNS>(angle, Products::Exact)
}

/// [`sin_cos_wide`] whose products are [`full`]: one function for all angles with this point, as it is long.
#[inline(never)]
#[must_use]
pub const fn sin_cos_full<const BITS: u32, const TURNS: bool>(angle: i32) -> (i32, i32) {
    turned::<BITS, TURNS>(angle, Products::Full)
}
