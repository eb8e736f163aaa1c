//! sin, cos and square root in `core` alone: straight-line arithmetic, the same bits on every target.
//!
//! The file uses nothing of its crate, so that it can stand as a private module in generated code. It has no table, no
//! branch and no fused multiply-add; a loop over lanes around any of these functions vectorises. Only `+`, `−`, `×`, one
//! `÷` (in the square root) and bit operations occur, all of them rounded correctly everywhere: hence the same bits
//! (but for subnormal numbers where the machine is told to flush them to zero).
//!
//! # sin and cos
//! 1. **Reduction** (Cody and Waite 1980): k = x·2/π, rounded by adding 1.5·2^52 (f32: 2^23), which also leaves k mod 4
//!    in the last bits. π/2 = P1 + P2 + P3 + P4, where P1, P2, P3 are so short that their products with k are exact. The
//!    result y0 + y1 ≈ x − k·π/2 has an error far below an ulp of even the smallest y0 that a float in the domain gives:
//!    sin and cos keep all their digits, and their signs, next to the multiples of π/2.
//! 2. **Kernels** on |y| ≤ π/4: polynomials in z = y² (minimax for the relative error, by Remez exchange; coefficients
//!    rounded one after the other, the later ones fitted again each time).
//! 3. **Quadrant** by masks: an odd k exchanges the two, the second bits of k and of k + 1 give the signs.
//!
//! Outside the domain the result is NaN: an angle of a quarter of a million turns has no digits worth a silent answer.

/// [`sin_cos_f64`] answers for |x| up to here, just under 2^23·π/2; beyond, NaN.
pub const DOMAIN_F64: f64 = 13_176_794.0;

/// [`sin_cos_f32`] answers for |x| up to here, just under 2^13·π/2; beyond, NaN.
pub const DOMAIN_F32: f32 = 12_867.0;

/// How many f64 one vector instruction of the target takes: sets of angles are filled up to a multiple of that, because a
/// vector that is stored in part and read in full waits until the store has left the pipeline.
const LANES_F64: usize = if cfg!(target_feature = "avx512f") {
    8
} else if cfg!(target_feature = "avx") {
    4
} else if cfg!(any(target_feature = "sse2", target_feature = "neon", target_feature = "simd128")) {
    2
} else {
    1
};

/// As [`LANES_F64`], of f32.
const LANES_F32: usize = if LANES_F64 > 1 { 2 * LANES_F64 } else { 1 };

/// [`sin_cos_f64`] of several angles: the same bits, by vector instructions where there are any.
///
/// Inlined, so that sines and cosines stay in registers. Every loop over lanes has a constant number of turns, or it would
/// not become vector instructions: whole blocks first, then the rest.
#[inline(always)]
#[must_use]
pub fn sin_cos_lanes_f64<const N: usize>(x: [f64; N]) -> ([f64; N], [f64; N]) {
    const BLOCK: usize = 8;
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    let (mut sin, mut cos) = ([0.0; BLOCK], [0.0; BLOCK]);
    let mut first = 0;
    while first + BLOCK <= N {
        let mut angle = [0.0; BLOCK];
        angle.copy_from_slice(&x[first..first + BLOCK]);
        for i in 0..BLOCK {
            (sin[i], cos[i]) = sin_cos_f64(angle[i]);
        }
        sines[first..first + BLOCK].copy_from_slice(&sin);
        cosines[first..first + BLOCK].copy_from_slice(&cos);
        first += BLOCK;
    }
    let mut angle = [0.0; BLOCK];
    angle[..N % BLOCK].copy_from_slice(&x[N - N % BLOCK..]);
    for i in 0..(N % BLOCK).next_multiple_of(LANES_F64) {
        (sin[i], cos[i]) = sin_cos_f64(angle[i]);
    }
    sines[N - N % BLOCK..].copy_from_slice(&sin[..N % BLOCK]);
    cosines[N - N % BLOCK..].copy_from_slice(&cos[..N % BLOCK]);
    (sines, cosines)
}

/// [`sin_cos_of_sum_f64`] of several sums: the same bits, by vector instructions where there are any; as
/// [`sin_cos_lanes_f64`].
#[inline(always)]
#[must_use]
pub fn sin_cos_lanes_of_sums_f64<const N: usize>(x: [[f64; 2]; N]) -> ([f64; N], [f64; N]) {
    const BLOCK: usize = 8;
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    let (mut sin, mut cos) = ([0.0; BLOCK], [0.0; BLOCK]);
    let mut first = 0;
    while first + BLOCK <= N {
        let (mut sum, mut tail) = ([0.0; BLOCK], [0.0; BLOCK]);
        for i in 0..BLOCK {
            [sum[i], tail[i]] = x[first + i];
        }
        for i in 0..BLOCK {
            (sin[i], cos[i]) = sin_cos_of_sum_f64([sum[i], tail[i]]);
        }
        sines[first..first + BLOCK].copy_from_slice(&sin);
        cosines[first..first + BLOCK].copy_from_slice(&cos);
        first += BLOCK;
    }
    let (mut sum, mut tail) = ([0.0; BLOCK], [0.0; BLOCK]);
    for i in 0..N % BLOCK {
        [sum[i], tail[i]] = x[N - N % BLOCK + i];
    }
    for i in 0..(N % BLOCK).next_multiple_of(LANES_F64) {
        (sin[i], cos[i]) = sin_cos_of_sum_f64([sum[i], tail[i]]);
    }
    sines[N - N % BLOCK..].copy_from_slice(&sin[..N % BLOCK]);
    cosines[N - N % BLOCK..].copy_from_slice(&cos[..N % BLOCK]);
    (sines, cosines)
}

/// [`sin_cos_f32`] of several angles: the same bits, by vector instructions where there are any; as [`sin_cos_lanes_f64`].
#[inline(always)]
#[must_use]
pub fn sin_cos_lanes_f32<const N: usize>(x: [f32; N]) -> ([f32; N], [f32; N]) {
    const BLOCK: usize = 16;
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    let (mut sin, mut cos) = ([0.0; BLOCK], [0.0; BLOCK]);
    let mut first = 0;
    while first + BLOCK <= N {
        let mut angle = [0.0; BLOCK];
        angle.copy_from_slice(&x[first..first + BLOCK]);
        for i in 0..BLOCK {
            (sin[i], cos[i]) = sin_cos_f32(angle[i]);
        }
        sines[first..first + BLOCK].copy_from_slice(&sin);
        cosines[first..first + BLOCK].copy_from_slice(&cos);
        first += BLOCK;
    }
    let mut angle = [0.0; BLOCK];
    angle[..N % BLOCK].copy_from_slice(&x[N - N % BLOCK..]);
    for i in 0..(N % BLOCK).next_multiple_of(LANES_F32) {
        (sin[i], cos[i]) = sin_cos_f32(angle[i]);
    }
    sines[N - N % BLOCK..].copy_from_slice(&sin[..N % BLOCK]);
    cosines[N - N % BLOCK..].copy_from_slice(&cos[..N % BLOCK]);
    (sines, cosines)
}

/// `(sin x, cos x)`, x in radians, within 0.797 ulp for |x| ≤ [`DOMAIN_F64`]; NaN beyond, for infinities and for NaN.
///
/// Odd in sin and even in cos to the bit, sin(−0) = −0, sin x = x for tiny x.
#[inline]
#[must_use]
pub fn sin_cos_f64(x: f64) -> (f64, f64) {
    sin_cos_of_sum_f64([x, 0.0])
}

/// The sum of some angles, rounded, and what the rounding lost: TwoSum (Knuth 1969) one after the other.
#[inline(always)]
#[must_use]
pub fn sum_of_angles_f64<const N: usize>(angles: [f64; N]) -> [f64; 2] {
    let (mut sum, mut tail) = (angles[0], 0.0);
    for angle in &angles[1..] {
        let next = sum + angle;
        let added = next - sum;
        tail += (sum - (next - added)) + (angle - added);
        sum = next;
    }
    [sum, tail]
}

/// `(sin, cos)` of the sum x + tail, |tail| ≤ ulp(x), as [`sin_cos_f64`] and within 2^-85 more: the tail goes into the
/// argument reduction, so that far angles keep their digits. NaN for |x| > [`DOMAIN_F64`].
#[inline]
#[must_use]
pub fn sin_cos_of_sum_f64([x, tail]: [f64; 2]) -> (f64, f64) {
    const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5·2^52
    const P1: f64 = 1.570796325802803; // 30 bits
    const P2: f64 = 9.920935791635221e-10; // 30 bits
    const P3: f64 = 5.17018297889025e-19; // 30 bits
    const P4: f64 = 2.9038559739793605e-28; // 53 bits; the sum is π/2 within 2^-145
    const SIGN: u64 = 1 << 63;

    // k is the nearest integer to x·2/π, |k| ≤ 2^23
    let shifted = x * core::f64::consts::FRAC_2_PI + ROUND;
    let quadrant = shifted.to_bits();
    let k = shifted - ROUND;

    // r0 is exact: a multiple of 2^-53 below 1. e1 and the error in y1 come from two-sums, which may be fast ones since
    // their first operand is a multiple of the second one's ulp. Where y0 is tiny r1 is exact, so e1 = 0 and t is exact.
    let r0 = x - k * P1;
    let w = k * P2;
    let r1 = r0 - w;
    let e1 = (r0 - r1) - w;
    let t = (k * P3 - e1) - tail;
    let y0 = r1 - t;
    let y1 = ((r1 - y0) - t) - k * P4;

    let (sin, cos) = kernel_f64(y0, y1);
    // the last sum of the kernel loses the sign of −0: y0 has it
    let sin = sin.to_bits() | (y0.to_bits() & SIGN);
    let cos = cos.to_bits();
    let exchange = (sin ^ cos) & 0u64.wrapping_sub(quadrant & 1);
    let sin = sin ^ exchange ^ ((quadrant & 2) << 62);
    let cos = cos ^ exchange ^ ((quadrant.wrapping_add(1) & 2) << 62);
    // all ones, a NaN, if |x| > DOMAIN or x is NaN: bits of positive floats are ordered as the floats are
    let outside = ((DOMAIN_F64.to_bits() as i64 - (x.to_bits() & !SIGN) as i64) >> 63) as u64;
    (f64::from_bits(sin | outside), f64::from_bits(cos | outside))
}

/// `(sin y, cos y)` of y = y0 + y1, |y| ≤ π/4 (and a rounding of k more), |y1| ≤ ulp(y0)/2.
///
/// sin y = y0 + (y0·z·S(z) + y1·cos y), where the parenthesis is at most 0.11 |y0|. Approximation error 2^-63.2. At π/4,
/// where it is worst, the roundings of z, y0·z, S, their product and the two sums are 0.064 + 0.041 + 0.061 + 0.063 +
/// 0.063 + 0.5 ulp of the result at most: with the small terms 0.797 ulp.
///
/// cos y = 1 − y²/2 + z²·C(z). Approximation error 2^-63.9. A rounded y² would cost 0.25 ulp; with y = a + b, a of 26
/// bits, a² and the error of 1 − a²/2 are exact, the rest b·(y0 + a) is small. In all 0.605 ulp at most.
#[inline]
fn kernel_f64(y0: f64, y1: f64) -> (f64, f64) {
    const S: [f64; 7] = [
        -0.16666666666666666,
        0.00833333333333304,
        -0.00019841269840959285,
        2.7557319071880108e-6,
        -2.5052070283413337e-8,
        1.605422047840546e-10,
        -7.384541077267838e-13,
    ];
    const C: [f64; 6] = [
        0.041666666666666595,
        -0.0013888888888873342,
        2.480158728900208e-5,
        -2.755731421703886e-7,
        2.0875705396029103e-9,
        -1.135874923991542e-11,
    ];
    let z = y0 * y0;
    let s = S[0] + z * (S[1] + z * (S[2] + z * (S[3] + z * (S[4] + z * (S[5] + z * S[6])))));
    let c = C[0] + z * (C[1] + z * (C[2] + z * (C[3] + z * (C[4] + z * C[5]))));

    let a = f64::from_bits(y0.to_bits() & !0x7ff_ffff);
    let b = (y0 - a) + y1;
    let half_aa = 0.5 * a * a;
    let lead = 1.0 - half_aa;
    let rest = ((1.0 - lead) - half_aa) - 0.5 * b * (y0 + a);
    let cos = lead + (rest + z * z * c);
    (y0 + (y0 * z * s + y1 * cos), cos)
}

/// `(sin x, cos x)`, x in radians, within 0.771 ulp for |x| ≤ [`DOMAIN_F32`]; NaN beyond, for infinities and for NaN.
///
/// No f64 inside: made for single-precision floating-point units.
/// Odd in sin and even in cos to the bit, sin(−0) = −0, sin x = x for tiny x.
#[inline]
#[must_use]
pub fn sin_cos_f32(x: f32) -> (f32, f32) {
    const ROUND: f32 = 12_582_912.0; // 1.5·2^23
    const P0: f32 = 1.5703125; // 8 bits
    const P1: f32 = 0.0004837513; // 11 bits
    const P2: f32 = 7.5495336e-8; // 11 bits
    const P3: f32 = 2.563283e-12; // 11 bits
    const P4: f32 = 6.123_234e-17; // 24 bits; the sum is π/2 within 2^-78
    const SIGN: u32 = 1 << 31;

    let shifted = x * core::f32::consts::FRAC_2_PI + ROUND;
    let quadrant = shifted.to_bits();
    let k = shifted - ROUND;

    // As in f64, with one part more, since k of 13 bits leaves only 11 bits to a part. Both differences in r0 are exact:
    // multiples of 2^-24, the second below 1, the first below 2^24 of its own last place.
    let r0 = (x - k * P0) - k * P1;
    let w = k * P2;
    let r1 = r0 - w;
    let e1 = (r0 - r1) - w;
    let t = k * P3 - e1;
    let y0 = r1 - t;
    let y1 = ((r1 - y0) - t) - k * P4;

    let (sin, cos) = kernel_f32(y0, y1);
    let sin = sin.to_bits() | (y0.to_bits() & SIGN);
    let cos = cos.to_bits();
    let exchange = (sin ^ cos) & 0u32.wrapping_sub(quadrant & 1);
    let sin = sin ^ exchange ^ ((quadrant & 2) << 30);
    let cos = cos ^ exchange ^ ((quadrant.wrapping_add(1) & 2) << 30);
    let outside = ((DOMAIN_F32.to_bits() as i32 - (x.to_bits() & !SIGN) as i32) >> 31) as u32;
    (f32::from_bits(sin | outside), f32::from_bits(cos | outside))
}

/// `(sin y, cos y)` of y = y0 + y1, |y| ≤ π/4 + 0.0008, as [`kernel_f64`]. Approximation errors: sin 2^-32.5, cos 2^-32.9.
/// The roundings bound sin by 0.798 ulp and cos by 0.615; all floats in the domain were tried: 0.771 ulp.
#[inline]
fn kernel_f32(y0: f32, y1: f32) -> (f32, f32) {
    const S: [f32; 4] = [-0.16666667, 0.00833338, -0.00019853064, 2.83251e-6];
    const C: [f32; 3] = [0.041666646, -0.001388731, 2.4432327e-5];
    let z = y0 * y0;
    let s = S[0] + z * (S[1] + z * (S[2] + z * S[3]));
    let c = C[0] + z * (C[1] + z * C[2]);

    let a = f32::from_bits(y0.to_bits() & !0xfff); // 12 bits
    let b = (y0 - a) + y1;
    let half_aa = 0.5 * a * a;
    let lead = 1.0 - half_aa;
    let rest = ((1.0 - lead) - half_aa) - 0.5 * b * (y0 + a);
    let cos = lead + (rest + z * z * c);
    (y0 + (y0 * z * s + y1 * cos), cos)
}

/// Square root, correctly rounded; NaN below zero, ±0 and +∞ are their own roots.
///
/// x = m·4^e with m in [1, 4). Three Newton steps give 1/√m from a guess that is linear in the bits (3.5 % → 3e-11), one
/// Heron step gives √m, which lands within one ulp (the divisor is at least 1). Its 53 bits as an integer n are then
/// made right exactly: n is the nearest one if and only if −n < M − n² ≤ n for the integer M = m·2^104, and that
/// difference is small enough to be computed modulo 2^64.
#[inline]
#[must_use]
pub fn sqrt_f64(x: f64) -> f64 {
    const FRACTION: u64 = (1 << 52) - 1;
    const TWO_54: f64 = 18_014_398_509_481_984.0;
    // subnormals are lifted into the normal range by 2^54
    let lift = x < f64::MIN_POSITIVE;
    let bits = (x * if lift { TWO_54 } else { 1.0 }).to_bits();
    let exponent = (bits >> 52) + 1; // biased by 1024, an even number
    let odd = exponent & 1;
    let m = f64::from_bits((bits & FRACTION) | ((1023 + odd) << 52));

    let mut inverse = f64::from_bits(0x5fe6_eb50_c7b5_37a9 - (m.to_bits() >> 1));
    let half = 0.5 * m;
    inverse = inverse * (1.5 - half * inverse * inverse);
    inverse = inverse * (1.5 - half * inverse * inverse);
    inverse = inverse * (1.5 - half * inverse * inverse);
    let root = m * inverse;
    let root = 0.5 * (root + m / root);

    let n = root.to_bits() - (1022 << 52);
    let mantissa = (bits & FRACTION) | (1 << 52);
    let rest = (mantissa << (52 + odd)).wrapping_sub(n.wrapping_mul(n)) as i64;
    let n = n.wrapping_add((rest > n as i64) as u64).wrapping_sub((rest <= -(n as i64)) as u64);
    let biased = (exponent >> 1) + 511 - if lift { 27 } else { 0 };
    // the addition lets a mantissa that was rounded up to 2^53 carry into the exponent
    let root = f64::from_bits((biased << 52).wrapping_add(n.wrapping_sub(1 << 52)));
    if x > 0.0 && x < f64::INFINITY {
        root
    } else if x < 0.0 {
        f64::NAN
    } else {
        x
    }
}

/// Square root, correctly rounded; NaN below zero, ±0 and +∞ are their own roots. No f64 inside.
///
/// As [`sqrt_f64`], with two Newton steps (3.5 % → 5e-6), 24 bits, M = m·2^46 and differences modulo 2^32.
#[inline]
#[must_use]
pub fn sqrt_f32(x: f32) -> f32 {
    const FRACTION: u32 = (1 << 23) - 1;
    const TWO_24: f32 = 16_777_216.0;
    let lift = x < f32::MIN_POSITIVE;
    let bits = (x * if lift { TWO_24 } else { 1.0 }).to_bits();
    let exponent = (bits >> 23) + 1; // biased by 128, an even number
    let odd = exponent & 1;
    let m = f32::from_bits((bits & FRACTION) | ((127 + odd) << 23));

    let mut inverse = f32::from_bits(0x5f37_59df - (m.to_bits() >> 1));
    let half = 0.5 * m;
    inverse = inverse * (1.5 - half * inverse * inverse);
    inverse = inverse * (1.5 - half * inverse * inverse);
    let root = m * inverse;
    let root = 0.5 * (root + m / root);

    let n = root.to_bits() - (126 << 23);
    let mantissa = (bits & FRACTION) | (1 << 23);
    let rest = (mantissa << (23 + odd)).wrapping_sub(n.wrapping_mul(n)) as i32;
    let n = n.wrapping_add((rest > n as i32) as u32).wrapping_sub((rest <= -(n as i32)) as u32);
    let biased = (exponent >> 1) + 63 - if lift { 12 } else { 0 };
    let root = f32::from_bits((biased << 23).wrapping_add(n.wrapping_sub(1 << 23)));
    if x > 0.0 && x < f32::INFINITY {
        root
    } else if x < 0.0 {
        f32::NAN
    } else {
        x
    }
}

/// −1, 0 or 1 as x is below, at or above zero; NaN for NaN.
#[inline]
#[must_use]
pub fn sign_f64(x: f64) -> f64 {
    let above = f64::from(u8::from(x > 0.0));
    let below = f64::from(u8::from(x < 0.0));
    if x.is_nan() {
        x
    } else {
        above - below
    }
}

/// −1, 0 or 1 as x is below, at or above zero; NaN for NaN.
#[inline]
#[must_use]
pub fn sign_f32(x: f32) -> f32 {
    let above = f32::from(u8::from(x > 0.0));
    let below = f32::from(u8::from(x < 0.0));
    if x.is_nan() {
        x
    } else {
        above - below
    }
}
