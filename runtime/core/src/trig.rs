//! sin, cos and square root in `core` alone: straight-line arithmetic, the same bits on every target.
//!
//! The file uses nothing of its crate, so that it can stand as a private module in generated code. It has no table and no
//! branch; a loop over lanes around any of these functions vectorises. Only `+`, `−`, `×`, one `÷` (in the square root) and
//! bit operations occur, all of them rounded correctly everywhere: hence the same bits (but for subnormal numbers where the
//! machine is told to flush them to zero). Functions with `fused` in their names take a·b + c in one rounding from their
//! caller, as `core` does not have it: a third fewer instructions, other bits.
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

/// [`sin_cos_f32`] answers for |x| up to here, just under 2^15·π/2; beyond, NaN.
pub const DOMAIN_F32: f32 = 51_471.0;

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

/// A kernel over lanes: inlined, so that sines and cosines stay in registers. Every loop over lanes has a constant number of
/// turns, or it would not become vector instructions: whole blocks first, then the rest.
macro_rules! in_lanes {
    ($(#[$doc:meta])* $name:ident, $scalar:ty, $block:literal, $lanes:ident, $one:ident $(, $fma:ident)?) => {
        $(#[$doc])*
        #[inline(always)]
        #[must_use]
        pub fn $name<const N: usize>(
            x: [$scalar; N]
            $(, $fma: impl Fn($scalar, $scalar, $scalar) -> $scalar + Copy)?
        ) -> ([$scalar; N], [$scalar; N]) {
            if $lanes == 1 {
                // no vectors: arrays that are filled later would begin as calls of `memset`
                let both = x.map(|x| $one(x $(, $fma)?));
                return (both.map(|(sin, _)| sin), both.map(|(_, cos)| cos));
            }
            const BLOCK: usize = $block;
            let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
            let (mut sin, mut cos) = ([0.0; BLOCK], [0.0; BLOCK]);
            let mut first = 0;
            while first + BLOCK <= N {
                let mut angle = [0.0; BLOCK];
                angle.copy_from_slice(&x[first..first + BLOCK]);
                for i in 0..BLOCK {
                    (sin[i], cos[i]) = $one(angle[i] $(, $fma)?);
                }
                sines[first..first + BLOCK].copy_from_slice(&sin);
                cosines[first..first + BLOCK].copy_from_slice(&cos);
                first += BLOCK;
            }
            let mut angle = [0.0; BLOCK];
            angle[..N % BLOCK].copy_from_slice(&x[N - N % BLOCK..]);
            for i in 0..(N % BLOCK).next_multiple_of($lanes) {
                (sin[i], cos[i]) = $one(angle[i] $(, $fma)?);
            }
            sines[N - N % BLOCK..].copy_from_slice(&sin[..N % BLOCK]);
            cosines[N - N % BLOCK..].copy_from_slice(&cos[..N % BLOCK]);
            (sines, cosines)
        }
    };
}

/// A kernel of sums over lanes, as [`in_lanes`].
macro_rules! sums_in_lanes {
    ($(#[$doc:meta])* $name:ident, $scalar:ty, $block:literal, $lanes:ident, $one:ident $(, $fma:ident)?) => {
        $(#[$doc])*
        #[inline(always)]
        #[must_use]
        pub fn $name<const N: usize>(
            x: [[$scalar; 2]; N]
            $(, $fma: impl Fn($scalar, $scalar, $scalar) -> $scalar + Copy)?
        ) -> ([$scalar; N], [$scalar; N]) {
            if $lanes == 1 {
                let both = x.map(|x| $one(x $(, $fma)?));
                return (both.map(|(sin, _)| sin), both.map(|(_, cos)| cos));
            }
            const BLOCK: usize = $block;
            let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
            let (mut sin, mut cos) = ([0.0; BLOCK], [0.0; BLOCK]);
            let mut first = 0;
            while first + BLOCK <= N {
                let (mut sum, mut tail) = ([0.0; BLOCK], [0.0; BLOCK]);
                for i in 0..BLOCK {
                    [sum[i], tail[i]] = x[first + i];
                }
                for i in 0..BLOCK {
                    (sin[i], cos[i]) = $one([sum[i], tail[i]] $(, $fma)?);
                }
                sines[first..first + BLOCK].copy_from_slice(&sin);
                cosines[first..first + BLOCK].copy_from_slice(&cos);
                first += BLOCK;
            }
            let (mut sum, mut tail) = ([0.0; BLOCK], [0.0; BLOCK]);
            for i in 0..N % BLOCK {
                [sum[i], tail[i]] = x[N - N % BLOCK + i];
            }
            for i in 0..(N % BLOCK).next_multiple_of($lanes) {
                (sin[i], cos[i]) = $one([sum[i], tail[i]] $(, $fma)?);
            }
            sines[N - N % BLOCK..].copy_from_slice(&sin[..N % BLOCK]);
            cosines[N - N % BLOCK..].copy_from_slice(&cos[..N % BLOCK]);
            (sines, cosines)
        }
    };
}

in_lanes! {
    /// [`sin_cos_f64`] of several angles: the same bits, by vector instructions where there are any.
    sin_cos_lanes_f64, f64, 8, LANES_F64, sin_cos_f64
}
in_lanes! {
    /// [`sin_cos_f32`] of several angles: the same bits, by vector instructions where there are any.
    sin_cos_lanes_f32, f32, 16, LANES_F32, sin_cos_f32
}
sums_in_lanes! {
    /// [`sin_cos_of_sum_f64`] of several sums: the same bits, by vector instructions where there are any.
    sin_cos_lanes_of_sums_f64, f64, 8, LANES_F64, sin_cos_of_sum_f64
}
sums_in_lanes! {
    /// [`sin_cos_of_sum_f32`] of several sums: the same bits, by vector instructions where there are any.
    sin_cos_lanes_of_sums_f32, f32, 16, LANES_F32, sin_cos_of_sum_f32
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

/// As [`sum_of_angles_f64`].
#[inline(always)]
#[must_use]
pub fn sum_of_angles_f32<const N: usize>(angles: [f32; N]) -> [f32; 2] {
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

/// The minimax coefficients of [`kernel_f64`], of S(z) and C(z).
const SINE_F64: [f64; 7] = [
    -0.16666666666666666,
    0.00833333333333304,
    -0.00019841269840959285,
    2.7557319071880108e-6,
    -2.5052070283413337e-8,
    1.605422047840546e-10,
    -7.384541077267838e-13,
];
const COSINE_F64: [f64; 6] = [
    0.041666666666666595,
    -0.0013888888888873342,
    2.480158728900208e-5,
    -2.755731421703886e-7,
    2.0875705396029103e-9,
    -1.135874923991542e-11,
];

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
    const S: [f64; 7] = SINE_F64;
    const C: [f64; 6] = COSINE_F64;
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
    sin_cos_of_sum_f32([x, 0.0])
}

/// `(sin, cos)` of the sum x + tail, |tail| ≤ ulp(x), as [`sin_cos_f32`] and within 2^-32 more: the tail goes into the
/// argument reduction, so that far angles keep their digits. NaN for |x| > [`DOMAIN_F32`].
#[inline]
#[must_use]
pub fn sin_cos_of_sum_f32([x, tail]: [f32; 2]) -> (f32, f32) {
    const ROUND: f32 = 12_582_912.0; // 1.5·2^23
    const P0: f32 = 1.5703125; // 8 bits
    const P1: f32 = 0.00048351288; // 9 bits
    const P2: f32 = 3.138557e-7; // 9 bits
    const P3: f32 = 6.070877e-11; // 9 bits
    const P4: f32 = 6.223372e-14; // 24 bits; the sum is π/2 within 2^-68
    const SIGN: u32 = 1 << 31;

    let shifted = x * core::f32::consts::FRAC_2_PI + ROUND;
    let quadrant = shifted.to_bits();
    let k = shifted - ROUND;

    // As in f64, with one part more, since k of 15 bits leaves only 9 bits to a part. Both differences in r0 are exact:
    // multiples of 2^-24, the second below 1, the first below 2^24 of its own last place.
    let r0 = (x - k * P0) - k * P1;
    let w = k * P2;
    let r1 = r0 - w;
    let e1 = (r0 - r1) - w;
    let t = (k * P3 - e1) - tail;
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

/// The minimax coefficients of [`kernel_f32`], of S(z) and C(z).
const SINE_F32: [f32; 4] = [-0.16666667, 0.00833338, -0.00019853064, 2.83251e-6];
const COSINE_F32: [f32; 3] = [0.041666646, -0.001388731, 2.4432327e-5];

/// `(sin y, cos y)` of y = y0 + y1, |y| ≤ π/4 + 0.0031, as [`kernel_f64`]. Approximation errors: sin 2^-32.5, cos 2^-32.9.
/// The roundings bound sin by 0.801 ulp and cos by 0.617; all floats in the domain were tried: 0.771 ulp.
#[inline]
fn kernel_f32(y0: f32, y1: f32) -> (f32, f32) {
    const S: [f32; 4] = SINE_F32;
    const C: [f32; 3] = COSINE_F32;
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

// With fused multiply-add: what follows is not part of generated code that does not fuse.

in_lanes! {
    /// [`sin_cos_fused_f64`] of several angles, as [`sin_cos_lanes_f64`].
    sin_cos_lanes_fused_f64, f64, 8, LANES_F64, sin_cos_fused_f64, fma
}
in_lanes! {
    /// [`sin_cos_fused_f32`] of several angles, as [`sin_cos_lanes_f32`].
    sin_cos_lanes_fused_f32, f32, 16, LANES_F32, sin_cos_fused_f32, fma
}
sums_in_lanes! {
    /// [`sin_cos_of_sum_fused_f64`] of several sums, as [`sin_cos_lanes_of_sums_f64`].
    sin_cos_lanes_of_sums_fused_f64, f64, 8, LANES_F64, sin_cos_of_sum_fused_f64, fma
}
sums_in_lanes! {
    /// [`sin_cos_of_sum_fused_f32`] of several sums, as [`sin_cos_lanes_of_sums_f32`].
    sin_cos_lanes_of_sums_fused_f32, f32, 16, LANES_F32, sin_cos_of_sum_fused_f32, fma
}

/// [`sin_cos_f64`] with fused multiply-add: within 0.74 ulp in the same domain, other bits. `fma` is a·b + c in one rounding.
///
/// Odd in sin and even in cos to the bit, sin(−0) = −0, sin x = x for tiny x.
#[inline(always)]
#[must_use]
pub fn sin_cos_fused_f64(x: f64, fma: impl Fn(f64, f64, f64) -> f64 + Copy) -> (f64, f64) {
    sin_cos_of_sum_fused_f64([x, 0.0], fma)
}

/// [`sin_cos_of_sum_f64`] with fused multiply-add, as [`sin_cos_fused_f64`].
#[inline(always)]
#[must_use]
pub fn sin_cos_of_sum_fused_f64([x, tail]: [f64; 2], fma: impl Fn(f64, f64, f64) -> f64 + Copy) -> (f64, f64) {
    const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5·2^52
    const P1: f64 = core::f64::consts::FRAC_PI_2; // 53 bits
    const P2: f64 = 6.12323399409214e-17; // 30 bits
    const P3: f64 = 1.6446256941113456e-26; // 30 bits
    const P4: f64 = -4.7891979590619914e-36; // 53 bits; the sum is π/2 within 2^-172
    const SIGN: u64 = 1 << 63;

    let shifted = fma(x, core::f64::consts::FRAC_2_PI, ROUND);
    let quadrant = shifted.to_bits();
    let k = shifted - ROUND;

    // r0 is exact: a multiple of 2^-53 below 1. So are r0 − r1, e1 and k·P3; the rest is as without fusing.
    let r0 = fma(-k, P1, x);
    let r1 = fma(-k, P2, r0);
    let e1 = fma(-k, P2, r0 - r1);
    let t = fma(k, P3, -e1) - tail;
    let y0 = r1 - t;
    let y1 = fma(-k, P4, (r1 - y0) - t);
    // a NaN here is one in both results
    let y0 = if x.abs() <= DOMAIN_F64 { y0 } else { f64::NAN };

    let (sin, cos) = kernel_fused_f64(y0, y1, fma);
    let sin = sin.to_bits() | (y0.to_bits() & SIGN);
    let cos = cos.to_bits();
    let exchange = (sin ^ cos) & 0u64.wrapping_sub(quadrant & 1);
    let sin = sin ^ exchange ^ ((quadrant & 2) << 62);
    let cos = cos ^ exchange ^ ((quadrant.wrapping_add(1) & 2) << 62);
    (f64::from_bits(sin), f64::from_bits(cos))
}

/// [`kernel_f64`] with fused multiply-add. The error of 1 − y²/2, product and all, comes from one more such operation. Of
/// sin the roundings of z, y0·z, S and the two sums at π/4 are 0.064 + 0.041 + 0.061 + 0.063 + 0.5 ulp at most; y1 times 1 − y²/2 for cos y
/// costs 0.008, S before its last rounding 0.003: 0.74. Of cos they are 0.5 and a few small ones.
#[inline(always)]
fn kernel_fused_f64(y0: f64, y1: f64, fma: impl Fn(f64, f64, f64) -> f64 + Copy) -> (f64, f64) {
    const S: [f64; 7] = SINE_F64;
    const C: [f64; 6] = COSINE_F64;
    let z = y0 * y0;
    let s = fma(z, fma(z, fma(z, fma(z, fma(z, fma(z, S[6], S[5]), S[4]), S[3]), S[2]), S[1]), S[0]);
    let c = fma(z, fma(z, fma(z, fma(z, fma(z, C[5], C[4]), C[3]), C[2]), C[1]), C[0]);

    let half = 0.5 * y0;
    let lead = fma(-half, y0, 1.0);
    let rest = fma(-y0, y1, fma(-half, y0, 1.0 - lead));
    let cos = lead + fma(z * z, c, rest);
    (y0 + fma(y0 * z, s, y1 * lead), cos)
}

/// [`sin_cos_f32`] with fused multiply-add: within the same error in the same domain, other bits. `fma` is a·b + c in one
/// rounding.
///
/// Odd in sin and even in cos to the bit, sin(−0) = −0, sin x = x for tiny x.
#[inline(always)]
#[must_use]
pub fn sin_cos_fused_f32(x: f32, fma: impl Fn(f32, f32, f32) -> f32 + Copy) -> (f32, f32) {
    sin_cos_of_sum_fused_f32([x, 0.0], fma)
}

/// [`sin_cos_of_sum_f32`] with fused multiply-add, as [`sin_cos_fused_f32`].
#[inline(always)]
#[must_use]
pub fn sin_cos_of_sum_fused_f32([x, tail]: [f32; 2], fma: impl Fn(f32, f32, f32) -> f32 + Copy) -> (f32, f32) {
    const ROUND: f32 = 12_582_912.0; // 1.5·2^23
    const P1: f32 = 1.5707962; // 24 bits, below π/2, so that P2 is positive and −0 stays what it is
    const P2: f32 = 7.54979e-8; // 24 bits
    const P3: f32 = -1.7151245e-15; // 24 bits; the sum is π/2 within 2^-76
    const SIGN: u32 = 1 << 31;

    let shifted = fma(x, core::f32::consts::FRAC_2_PI, ROUND);
    let quadrant = shifted.to_bits();
    let k = shifted - ROUND;

    // r0 is exact, a multiple of 2^-24 below 1; so are the error of the product w and that of the difference r1
    let r0 = fma(-k, P1, x);
    let w = k * P2;
    let r1 = r0 - w;
    let e1 = (r0 - r1) - w;
    let t = (fma(k, P3, fma(k, P2, -w)) - e1) - tail;
    let y0 = r1 - t;
    let y1 = (r1 - y0) - t;
    // a NaN here is one in both results
    let y0 = if x.abs() <= DOMAIN_F32 { y0 } else { f32::NAN };

    let (sin, cos) = kernel_fused_f32(y0, y1, fma);
    let sin = sin.to_bits() | (y0.to_bits() & SIGN);
    let cos = cos.to_bits();
    let exchange = (sin ^ cos) & 0u32.wrapping_sub(quadrant & 1);
    let sin = sin ^ exchange ^ ((quadrant & 2) << 30);
    let cos = cos ^ exchange ^ ((quadrant.wrapping_add(1) & 2) << 30);
    (f32::from_bits(sin), f32::from_bits(cos))
}

/// [`kernel_f32`] with fused multiply-add, as [`kernel_fused_f64`].
#[inline(always)]
fn kernel_fused_f32(y0: f32, y1: f32, fma: impl Fn(f32, f32, f32) -> f32 + Copy) -> (f32, f32) {
    const S: [f32; 4] = SINE_F32;
    const C: [f32; 3] = COSINE_F32;
    let z = y0 * y0;
    let s = fma(z, fma(z, fma(z, S[3], S[2]), S[1]), S[0]);
    let c = fma(z, fma(z, C[2], C[1]), C[0]);

    let half = 0.5 * y0;
    let lead = fma(-half, y0, 1.0);
    let rest = fma(-y0, y1, fma(-half, y0, 1.0 - lead));
    let cos = lead + fma(z * z, c, rest);
    (y0 + fma(y0 * z, s, y1 * lead), cos)
}
