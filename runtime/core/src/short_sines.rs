//! Short sines and cosines in single precision, for machines that compute one angle at a time: `core` alone, the same bits on every
//! target.
//!
//! They take half the instructions of those in `trig.rs`, as they promise less: an absolute error, and angles within [`DOMAIN_F32`].
//! Only `+`, `−`, `×` and changes of sign occur, all of them rounded correctly everywhere; a machine whose multiply-accumulate rounds the
//! product (ARM's `VMLA`) gives the same bits, too. The file uses nothing of its crate, so that it can stand as a private module
//! in generated code.
//!
//! 1. **Reduction** in two parts (Cody and Waite 1980): k = x·2/π, rounded by adding 1.5·2^23, |k| ≤ 256. π/2 = P0 + P1 where P0 has 16
//!    bits, so that k·P0 and x − k·P0 are exact. Then y = (x − k·P0) − (k·P1 − tail) is off by its last rounding, at most half an ulp
//!    of y, and by those of k·P1 − tail, of which |k·P1 − tail| < 1/8, and of P1: 2^-29 + 2^-28 + 2^-33 together at most.
//! 2. **Kernels** on |y| ≤ π/4 (and a rounding of k more): minimax polynomials in y² for the absolute error.
//! 3. **Quadrant**: an odd k exchanges the two, further quarter turns change signs.
//!
//! For every float y that can come out of the reduction, the error of the kernel is found by trying it; with the error of y in the direction
//! of the slope, cos y for the sine and sin y for the cosine, the sum is at most 0.78 units in the last place of 1 for any angle of the domain
//! and any tail: [`ERROR_F32`]. The tests try all of these floats, and all angles of the domain.
//!
//! Beyond the domain the results are numbers without meaning; infinities and NaN give NaN.

/// Angles are at most so far from zero \[rad\]: just under 256 quarter turns.
pub const DOMAIN_F32: f32 = 402.0;

/// |computed − exact| is at most this, of sine and cosine alike: below one unit in the last place of 1, 1.2e-7.
pub const ERROR_F32: f64 = 9.3e-8;

/// `(sin x, cos x)`, x in radians, each within [`ERROR_F32`] for |x| ≤ [`DOMAIN_F32`].
#[inline]
#[must_use]
pub fn sin_cos_f32(x: f32) -> (f32, f32) {
    let (k, quadrant) = quarter_turns(x);
    kernel((x - k * P0) - k * P1, quadrant)
}

/// `(sin, cos)` of the sum x + tail, |tail| ≤ ulp(x)/2, each within [`ERROR_F32`] for |x| ≤ [`DOMAIN_F32`].
#[inline]
#[must_use]
pub fn sin_cos_of_sum_f32([x, tail]: [f32; 2]) -> (f32, f32) {
    let (k, quadrant) = quarter_turns(x);
    kernel((x - k * P0) - (k * P1 - tail), quadrant)
}

/// The same of two angles by one call, which loads its constants once: sines and cosines, the bits of [`sin_cos_f32`].
#[inline(always)]
#[must_use]
pub fn sin_cos_lanes_f32([x, y]: [f32; 2]) -> ([f32; 2], [f32; 2]) {
    let Halves([sin_x, cos_x, sin_y, cos_y]) = of_two(x, y);
    ([sin_x, sin_y], [cos_x, cos_y])
}

/// The same of two sums by one call, the bits of [`sin_cos_of_sum_f32`].
#[inline(always)]
#[must_use]
pub fn sin_cos_lanes_of_sums_f32([[x, of_x], [y, of_y]]: [[f32; 2]; 2]) -> ([f32; 2], [f32; 2]) {
    let Halves([sin_x, cos_x, sin_y, cos_y]) = of_two_sums(x, of_x, y, of_y);
    ([sin_x, sin_y], [cos_x, cos_y])
}

/// Sine and cosine of the first angle, then of the second: Arm's calling convention of C has four numbers in registers, Rust's two.
#[repr(C)]
struct Halves([f32; 4]);

#[inline]
extern "C" fn of_two(x: f32, y: f32) -> Halves {
    let [(k, of_x), (l, of_y)] = [quarter_turns(x), quarter_turns(y)];
    let (sin_x, cos_x) = kernel((x - k * P0) - k * P1, of_x);
    let (sin_y, cos_y) = kernel((y - l * P0) - l * P1, of_y);
    Halves([sin_x, cos_x, sin_y, cos_y])
}

#[inline]
extern "C" fn of_two_sums(x: f32, tail_of_x: f32, y: f32, tail_of_y: f32) -> Halves {
    let [(k, of_x), (l, of_y)] = [quarter_turns(x), quarter_turns(y)];
    let (sin_x, cos_x) = kernel((x - k * P0) - (k * P1 - tail_of_x), of_x);
    let (sin_y, cos_y) = kernel((y - l * P0) - (l * P1 - tail_of_y), of_y);
    Halves([sin_x, cos_x, sin_y, cos_y])
}

/// The sum of some angles, rounded, and what the rounding lost: TwoSum (Knuth 1969) one after the other.
///
/// Three are written out: beside a loop, even one of which nothing is left, a compiler puts calls into another order.
#[inline(always)]
#[must_use]
pub fn sum_of_angles_f32<const N: usize>(angles: [f32; N]) -> [f32; 2] {
    let [Some(first), Some(second)] = [angles.first(), angles.get(1)] else {
        return [angles.first().map_or(0.0, |angle| *angle), 0.0];
    };
    // what is lost is never −0, so that the sum of it and +0 would have the same bits
    let [sum, tail] = two_sum(*first, *second);
    let Some(third) = angles.get(2) else { return [sum, tail] };
    let [mut sum, lost] = two_sum(sum, *third);
    let mut tail = tail + lost;
    for angle in angles.iter().skip(3) {
        let [next, lost] = two_sum(sum, *angle);
        (sum, tail) = (next, tail + lost);
    }
    [sum, tail]
}

/// The rounded sum, and what the rounding lost.
#[inline(always)]
fn two_sum(sum: f32, angle: f32) -> [f32; 2] {
    let next = sum + angle;
    let added = next - sum;
    [next, (sum - (next - added)) + (angle - added)]
}

/// 16 bits of π/2.
const P0: f32 = 1.5703125;
/// π/2 − P0, rounded: within 2^-41.
const P1: f32 = 0.0004838268;

/// k, and a word whose last two bits are those of k.
#[inline(always)]
fn quarter_turns(x: f32) -> (f32, u32) {
    const ROUND: f32 = 12_582_912.0; // 1.5·2^23
    let shifted = x * core::f32::consts::FRAC_2_PI + ROUND;
    (shifted - ROUND, shifted.to_bits())
}

/// `(sin, cos)` of y + k·π/2.
#[inline(always)]
fn kernel(y: f32, quadrant: u32) -> (f32, f32) {
    let z = y * y;
    let sin = y + y * z * (-0.16666651 + z * (0.00833197 + z * -0.0001949454));
    let cos = 1.0 + z * (-0.5 + z * (0.041666646 + z * (-0.0013887358 + z * 2.4437297e-5)));
    let (sin, cos) = if quadrant & 1 != 0 { (cos, -sin) } else { (sin, cos) };
    if quadrant & 2 != 0 {
        (-sin, -cos)
    } else {
        (sin, cos)
    }
}
