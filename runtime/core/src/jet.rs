//! Numbers that carry their derivatives: a scalar that differentiates what is written over [`Real`], exactly.
//!
//! A [`Jet`] is the value of a function along a motion: with its gradient by N variables, its first and its second
//! derivative by time. Products, quotients and roots follow the rules of calculus, so there is no step and no cancellation:
//! with f(x(t)), ḟ = ∇f · ẋ and f̈ = ∇f · ẍ + ẋᵀ ∇²f ẋ. Jets nest: over `Jet<Jet<T, 9>, 3>` a function gets derivatives of its
//! own gradient.

use crate::dd::Dd;
use crate::operators::operators;
use crate::real::Real;

/// A value with its gradient by N variables and two derivatives by time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet<T, const N: usize> {
    /// f.
    pub value: T,
    /// ∂f/∂x_k.
    pub gradient: [T; N],
    /// ḟ.
    pub rate: T,
    /// f̈.
    pub second: T,
}

impl<T: Real, const N: usize> Jet<T, N> {
    /// What does not change.
    pub fn still(value: T) -> Self {
        Jet { value, gradient: [T::zero(); N], rate: T::zero(), second: T::zero() }
    }

    /// Variable `k` at a value, with its own two derivatives by time.
    pub fn variable(k: usize, value: T, rate: T, second: T) -> Self {
        let mut gradient = [T::zero(); N];
        gradient[k] = T::one();
        Jet { value, gradient, rate, second }
    }

    /// f(x) of an outer function with value, first and second derivative at x.
    fn outer(self, value: T, first: T, second: T) -> Self {
        Jet {
            value,
            gradient: self.gradient.map(|g| first * g),
            rate: first * self.rate,
            second: first * self.second + second * self.rate * self.rate,
        }
    }

    fn both(self, b: Self, f: impl Fn(T, T) -> T) -> Self {
        Jet {
            value: f(self.value, b.value),
            gradient: core::array::from_fn(|k| f(self.gradient[k], b.gradient[k])),
            rate: f(self.rate, b.rate),
            second: f(self.second, b.second),
        }
    }
}

operators! { [T: Real, const N: usize] Jet<T, N>:
    Add add |a, b| a.both(b, |x, y| x + y);
    Sub sub |a, b| a.both(b, |x, y| x - y);
    Mul mul |a, b| {
        let mixed = a.rate * b.rate;
        Jet {
            value: a.value * b.value,
            gradient: core::array::from_fn(|k| a.gradient[k] * b.value + a.value * b.gradient[k]),
            rate: a.rate * b.value + a.value * b.rate,
            second: a.second * b.value + a.value * b.second + (mixed + mixed),
        }
    };
    Div div |a, b| {
        // f = a / b: f b = a, differentiated once and twice
        let inverse = T::one() / b.value;
        let value = a.value * inverse;
        let rate = (a.rate - value * b.rate) * inverse;
        let mixed = rate * b.rate;
        Jet {
            value,
            gradient: core::array::from_fn(|k| (a.gradient[k] - value * b.gradient[k]) * inverse),
            rate,
            second: (a.second - value * b.second - (mixed + mixed)) * inverse,
        }
    };
    Neg neg |a| Jet { value: -a.value, gradient: a.gradient.map(|g| -g), rate: -a.rate, second: -a.second };
}

impl<T: Real, const N: usize> Real for Jet<T, N> {
    fn constant(value: Dd) -> Self {
        Jet::still(T::constant(value))
    }

    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value.sin_cos();
        (self.outer(s, c, -s), self.outer(c, -s, -c))
    }

    /// Has no derivative at zero.
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        let first = T::constant(Dd::HALF) / root;
        self.outer(root, first, -(first / (self.value + self.value)))
    }

    /// Its derivatives are zero: the jump at zero has none.
    fn sign(self) -> Self {
        Jet::still(self.value.sign())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f = sin(x y) / √(1 + y²), with x = t² and y = 2 + 3 t at t = 0.7: derivatives by hand.
    #[test]
    fn derivatives_are_those_of_calculus() {
        let t = Dd::from(0.7);
        let d = |x: f64| Dd::from(x);
        let f = |x: Jet<Dd, 2>, y: Jet<Dd, 2>| (x * y).sin_cos().0 / (Jet::constant(Dd::ONE) + y * y).sqrt();
        let (x, y) = (t * t, d(2.0) + d(3.0) * t);
        let jet = f(Jet::variable(0, x, t + t, d(2.0)), Jet::variable(1, y, d(3.0), d(0.0)));
        let (s, c) = (x * y).sin_cos();
        let root = (d(1.0) + y * y).sqrt();
        let by_x = y * c / root;
        let by_y = x * c / root - s * y / (root * root * root);
        assert!((jet.gradient[0] - by_x).abs().hi() < 1e-29);
        assert!((jet.gradient[1] - by_y).abs().hi() < 1e-29);
        assert!((jet.rate - (by_x * (t + t) + by_y * d(3.0))).abs().hi() < 1e-28);
        // f̈ by a central difference of ḟ in double-double: error h²
        let rate_at = |t: Dd| {
            let (x, y) = (t * t, d(2.0) + d(3.0) * t);
            f(Jet::variable(0, x, t + t, d(2.0)), Jet::variable(1, y, d(3.0), d(0.0))).rate
        };
        let h = d(1e-8);
        let difference = (rate_at(t + h) - rate_at(t - h)) / (h + h);
        assert!((jet.second - difference).abs().hi() < 1e-12, "{:?} against {difference:?}", jet.second);
    }
}
