//! The scalar: the one trait with many implementors.
//!
//! The algorithms are written over [`Real`], which has no comparisons: whatever runs over it is straight-line for a given
//! model, so the same source computes with numbers and writes down equations.

use crate::dd::Dd;
use crate::{short_sines, trig};
use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A scalar without comparisons.
pub trait Real:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The constant, rounded once to this scalar's format.
    fn constant(value: Dd) -> Self;

    /// `(sin x, cos x)` of an angle in radians.
    fn sin_cos(self) -> (Self, Self);

    /// The sum of some angles, at least one, and what its rounding loses: TwoSum (Knuth 1969) one after the other.
    #[inline(always)]
    fn sum_of_angles(angles: &[Self]) -> [Self; 2] {
        let (mut sum, mut tail) = (angles[0], Self::zero());
        for &angle in &angles[1..] {
            let next = sum + angle;
            let added = next - sum;
            tail = tail + ((sum - (next - added)) + (angle - added));
            sum = next;
        }
        [sum, tail]
    }

    /// `(sin, cos)` of a [sum](Real::sum_of_angles) and its tail, up to the square of the tail.
    #[inline(always)]
    fn sin_cos_of_pair([sum, tail]: [Self; 2]) -> (Self, Self) {
        let (sin, cos) = sum.sin_cos();
        (sin + tail * cos, cos - tail * sin)
    }

    /// `(sin, cos)` of the sum of some angles as if it were formed exactly, which it is up to the square of a rounding.
    #[inline(always)]
    fn sin_cos_of_sum(angles: &[Self]) -> (Self, Self) {
        match angles {
            [angle] => angle.sin_cos(),
            angles => Self::sin_cos_of_pair(Self::sum_of_angles(angles)),
        }
    }

    /// As [`Real::sin_cos_of_sum`], by the [short sines](crate::short_sines) where the format has them.
    #[inline(always)]
    fn short_sin_cos_of_sum(angles: &[Self]) -> (Self, Self) {
        Self::sin_cos_of_sum(angles)
    }

    /// [`Real::sin_cos`] of several angles: the same bits, faster where numbers have vector instructions.
    #[inline(always)]
    fn sin_cos_lanes<const N: usize>(angles: [Self; N]) -> ([Self; N], [Self; N]) {
        let (mut sines, mut cosines) = ([Self::zero(); N], [Self::zero(); N]);
        for (i, angle) in angles.iter().enumerate() {
            (sines[i], cosines[i]) = angle.sin_cos();
        }
        (sines, cosines)
    }

    /// [`Real::sin_cos_of_pair`] of several sums: the same bits, faster where numbers have vector instructions.
    #[inline(always)]
    fn sin_cos_lanes_of_pairs<const N: usize>(sums: [[Self; 2]; N]) -> ([Self; N], [Self; N]) {
        let (mut sines, mut cosines) = ([Self::zero(); N], [Self::zero(); N]);
        for (i, sum) in sums.iter().enumerate() {
            (sines[i], cosines[i]) = Self::sin_cos_of_pair(*sum);
        }
        (sines, cosines)
    }

    /// Of a scalar that knows how numbers change what a [turn](Real::turned_about) by this angle takes of it: how the angle changes, its value being
    /// zero. Nothing of others.
    #[inline(always)]
    fn turning(self) -> Option<Self> {
        None
    }

    /// (x cos − y sin, y cos + x sin), and how that changes with the angle if `turning` is its [sum](Real::turning): by a quarter turn of the result,
    /// d(R v) = R dv + dα × R v, where products with dsin = cos dα and dcos = −sin dα would take four operations more.
    #[must_use]
    #[inline(always)]
    fn turned_about([x, y]: [Self; 2], (sin, cos): (Self, Self), _turning: Option<Self>) -> [Self; 2] {
        [x * cos - y * sin, y * cos + x * sin]
    }

    /// Square root; NaN below zero.
    fn sqrt(self) -> Self;

    /// −1, 0 or 1 as the number is below, at or above zero; NaN for NaN.
    fn sign(self) -> Self;

    /// Zero.
    fn zero() -> Self {
        Self::constant(Dd::ZERO)
    }

    /// One.
    fn one() -> Self {
        Self::constant(Dd::ONE)
    }

    /// Gives the value a readable name, such as `omega`, body 3, component `"x"`: for scalars that write equations down.
    /// Numbers ignore it.
    #[must_use]
    #[inline(always)]
    fn named(self, _name: &'static str, _index: usize, _component: &'static str) -> Self {
        self
    }

    /// Says that what follows belongs to one phase of an algorithm and, where there is one, to one body: for scalars
    /// that write equations down. Numbers ignore it.
    #[inline(always)]
    fn section(_phase: &'static str, _body: Option<usize>) {}
}

/// A floating-point number of the machine, by its functions in `trig.rs`.
macro_rules! machine {
    ($($T:ident $rounded:ident $sin_cos:ident $of_sum:ident $lanes:ident $lanes_of_sums:ident $sqrt:ident $sign:ident $($short:ident)?,)+) => {$(
        impl Real for $T {
            #[inline]
            fn constant(value: Dd) -> Self {
                value.$rounded()
            }
            #[inline]
            fn zero() -> Self {
                0.0
            }
            #[inline]
            fn one() -> Self {
                1.0
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                trig::$sin_cos(self)
            }
            #[inline(always)]
            fn sin_cos_of_pair(sum: [Self; 2]) -> (Self, Self) {
                trig::$of_sum(sum)
            }
            #[inline(always)]
            fn sin_cos_lanes<const N: usize>(angles: [Self; N]) -> ([Self; N], [Self; N]) {
                trig::$lanes(angles)
            }
            #[inline(always)]
            fn sin_cos_lanes_of_pairs<const N: usize>(sums: [[Self; 2]; N]) -> ([Self; N], [Self; N]) {
                trig::$lanes_of_sums(sums)
            }
            $(fn $short(angles: &[Self]) -> (Self, Self) {
                match angles {
                    [angle] => short_sines::sin_cos_f32(*angle),
                    angles => short_sines::sin_cos_of_sum_f32(Self::sum_of_angles(angles)),
                }
            })?
            #[inline]
            fn sqrt(self) -> Self {
                trig::$sqrt(self)
            }
            #[inline]
            fn sign(self) -> Self {
                trig::$sign(self)
            }
        }
    )+};
}

machine! {
    f64 to_f64 sin_cos_f64 sin_cos_of_sum_f64 sin_cos_lanes_f64 sin_cos_lanes_of_sums_f64 sqrt_f64 sign_f64,
    f32 to_f32 sin_cos_f32 sin_cos_of_sum_f32 sin_cos_lanes_f32 sin_cos_lanes_of_sums_f32 sqrt_f32 sign_f32 short_sin_cos_of_sum,
}

impl Real for Dd {
    #[inline]
    fn constant(value: Dd) -> Self {
        value
    }
    fn sin_cos(self) -> (Self, Self) {
        Dd::sin_cos(self)
    }
    fn sqrt(self) -> Self {
        Dd::sqrt(self)
    }
    fn sign(self) -> Self {
        Dd::from(trig::sign_f64(self.hi()))
    }
}
