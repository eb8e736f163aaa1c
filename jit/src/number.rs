//! The numbers that programs are executed in.

use straightline_core::Real;
use straightline_graph::Scalar;

/// A floating-point number that the machine has vectors of.
pub trait Number: Real + Default + Send + Sync + 'static {
    /// Its name among those of the compiler.
    const SCALAR: Scalar;
    /// Its length in bytes, which is that of its units in memory.
    const BYTES: usize = size_of::<Self>();

    /// Its bits, by which constants are told apart.
    fn bits(self) -> u64;
    /// −0, whose bits change a sign.
    fn minus_zero() -> Self;
}

impl Number for f64 {
    const SCALAR: Scalar = Scalar::F64;

    fn bits(self) -> u64 {
        self.to_bits()
    }

    fn minus_zero() -> f64 {
        -0.0
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
}
