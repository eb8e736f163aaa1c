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
use crate::operators::operators;
use crate::real::Real;

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

operators! { [T: Real, const N: usize] Dual<T, N>:
    Add add |a, b| a.zip(b, a.value + b.value, |da, db| da + db);
    Sub sub |a, b| a.zip(b, a.value - b.value, |da, db| da - db);
    // (ab)' = a' b + a b'
    Mul mul |a, b| a.zip(b, a.value * b.value, |da, db| da * b.value + a.value * db);
    // (a/b)' = (a' − (a/b) b')/b
    Div div |a, b| {
        let value = a.value / b.value;
        a.zip(b, value, |da, db| (da - value * db) / b.value)
    };
    Neg neg |a| Dual { value: -a.value, derivatives: a.derivatives.map(|d| -d) };
}

/// Of so many angles at most a sum is formed by the scalar of the values.
const MOST_ANGLES: usize = 32;

impl<T: Real, const N: usize> Real for Dual<T, N> {
    fn constant(value: Dd) -> Self {
        Dual::fixed(T::constant(value))
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    /// Of the values as their scalar has it: one that writes equations down has an operation for it. Of more than 32 angles step by step.
    fn sin_cos_of_sum(angles: &[Self]) -> (Self, Self) {
        let mut values = [T::zero(); MOST_ANGLES];
        let Some(values) = values.get_mut(..angles.len()) else {
            return Self::sin_cos_of_pair(Self::sum_of_angles(angles));
        };
        values.iter_mut().zip(angles).for_each(|(value, angle)| *value = angle.value);
        let (sin, cos) = T::sin_cos_of_sum(values);
        // for its derivatives
        let angle =
            angles.iter().skip(1).fold(angles[0], |sum, angle| Dual { derivatives: (sum + *angle).derivatives, ..sum });
        (angle.chain(sin, cos), angle.chain(cos, -sin))
    }

    fn sin_cos_of_pair([sum, tail]: [Self; 2]) -> (Self, Self) {
        let (sin, cos) = T::sin_cos_of_pair([sum.value, tail.value]);
        let angle = sum + tail; // for its derivatives
        (angle.chain(sin, cos), angle.chain(cos, -sin))
    }

    fn turning(self) -> Option<Self> {
        Some(Dual { value: self.value.turning().unwrap_or_else(T::zero), ..self })
    }

    /// With (X, Y) = R (x, y): dX = (R d(x, y))₁ − Y dα, dY = (R d(x, y))₂ + X dα.
    fn turned_about([x, y]: [Self; 2], (sin, cos): (Self, Self), turning: Option<Self>) -> [Self; 2] {
        let Some(turning) = turning else { return [x * cos - y * sin, y * cos + x * sin] };
        let turned = |x: T, y: T| T::turned_about([x, y], (sin.value, cos.value), Some(turning.value));
        let [x_turned, y_turned] = turned(x.value, y.value);
        let changes: [[T; 2]; N] = core::array::from_fn(|k| {
            let [dx, dy] = turned(x.derivatives[k], y.derivatives[k]);
            [dx - y_turned * turning.derivatives[k], dy + x_turned * turning.derivatives[k]]
        });
        [
            Dual { value: x_turned, derivatives: changes.map(|change| change[0]) },
            Dual { value: y_turned, derivatives: changes.map(|change| change[1]) },
        ]
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
