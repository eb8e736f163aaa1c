//! The numbers that programs are executed in.

use crate::function::CompiledHere;
use straightline_core::{trig, Real};
use straightline_graph::Scalar;

/// A floating-point number that the machine has vectors of.
pub trait Number: Real + Default + Send + Sync + CompiledHere + 'static {
    /// Its name among those of the compiler.
    const SCALAR: Scalar;
    /// Its length in bytes, which is that of its units in memory.
    const BYTES: usize = size_of::<Self>();

    /// Its bits, by which constants are told apart.
    fn bits(self) -> u64;
    /// −0, whose bits change a sign.
    fn minus_zero() -> Self;
    /// a·b + c in one rounding.
    fn fused(a: Self, b: Self, c: Self) -> Self;
    /// The sines and cosines of fused texts, of several sums in two pieces.
    fn fused_sin_cos<const N: usize>(sums: [[Self; 2]; N]) -> ([Self; N], [Self; N]);
}

impl Number for f64 {
    const SCALAR: Scalar = Scalar::F64;

    fn bits(self) -> u64 {
        self.to_bits()
    }

    fn minus_zero() -> f64 {
        -0.0
    }

    #[inline(always)]
    fn fused(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }

    #[inline(always)]
    fn fused_sin_cos<const N: usize>(sums: [[f64; 2]; N]) -> ([f64; N], [f64; N]) {
        trig::sin_cos_lanes_of_sums_fused_f64(sums, f64::mul_add)
    }
}

impl Number for f32 {
    const SCALAR: Scalar = Scalar::F32;

    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }

    fn minus_zero() -> f32 {
        -0.0
    }

    #[inline(always)]
    fn fused(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }

    #[inline(always)]
    fn fused_sin_cos<const N: usize>(sums: [[f32; 2]; N]) -> ([f32; N], [f32; N]) {
        trig::sin_cos_lanes_of_sums_fused_f32(sums, f32::mul_add)
    }
}
