//! Dual numbers: a value and its derivatives in `N` directions, by the rules of calculus, exact but for rounding.
//!
//! Any function over [`Real`] has its derivatives this way: seed an input with [`Dual::variable`], read [`Dual::derivatives`].
//! `Dual<Dual<f64, 1>, 1>` has second derivatives. For checks, and for derivatives in few directions.
//!
//! ```
//! use straightline_core::{Dual, Real};
//! let x = Dual::<f64, 1>::variable(0.3, 0);
//! let (sin, _) = x.sin_cos();
//! assert_eq!(sin.derivatives, [Real::sin_cos(0.3).1]);
//! ```

use crate::dd::Dd;
use crate::real::Real;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T, const N: usize> {
    /// The value.
    pub value: T,
    /// Its derivatives in `N` directions.
    pub derivatives: [T; N],
}

impl<T: Real, const N: usize> Dual<T, N> {
    /// A number that depends on nothing.
    pub fn fixed(value: T) -> Self {
        Dual { value, derivatives: [T::zero(); N] }
    }

    /// The variable of direction `k`; for `k` not below `N` a fixed number.
    pub fn variable(value: T, k: usize) -> Self {
        Dual { value, derivatives: core::array::from_fn(|i| if i == k { T::one() } else { T::zero() }) }
    }

    /// f(self), given f and f' there.
    fn chain(self, value: T, slope: T) -> Self {
        Dual { value, derivatives: self.derivatives.map(|d| slope * d) }
    }

    fn zip(self, b: Self, value: T, f: impl Fn(T, T) -> T) -> Self {
        Dual { value, derivatives: core::array::from_fn(|i| f(self.derivatives[i], b.derivatives[i])) }
    }
}

impl<T: Real, const N: usize> Add for Dual<T, N> {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        self.zip(b, self.value + b.value, |da, db| da + db)
    }
}

impl<T: Real, const N: usize> Sub for Dual<T, N> {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self.zip(b, self.value - b.value, |da, db| da - db)
    }
}

#[allow(clippy::suspicious_arithmetic_impl)] // (ab)' = a' b + a b'
impl<T: Real, const N: usize> Mul for Dual<T, N> {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        self.zip(b, self.value * b.value, |da, db| da * b.value + self.value * db)
    }
}

#[allow(clippy::suspicious_arithmetic_impl)] // (a/b)' = (a' − (a/b) b')/b
impl<T: Real, const N: usize> Div for Dual<T, N> {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        self.zip(b, value, |da, db| (da - value * db) / b.value)
    }
}

impl<T: Real, const N: usize> Neg for Dual<T, N> {
    type Output = Self;
    fn neg(self) -> Self {
        Dual { value: -self.value, derivatives: self.derivatives.map(|d| -d) }
    }
}

impl<T: Real, const N: usize> Real for Dual<T, N> {
    fn constant(value: Dd) -> Self {
        Dual::fixed(T::constant(value))
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    fn sin_cos_of_pair([sum, tail]: [Self; 2]) -> (Self, Self) {
        let (sin, cos) = T::sin_cos_of_pair([sum.value, tail.value]);
        let angle = sum + tail; // for its derivatives
        (angle.chain(sin, cos), angle.chain(cos, -sin))
    }

    /// At zero the slope is infinite.
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, T::one() / (root + root))
    }

    /// The slope is zero, also at the jump.
    fn sign(self) -> Self {
        Dual::fixed(self.value.sign())
    }
}
