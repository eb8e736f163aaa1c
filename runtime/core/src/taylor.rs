//! Truncated Taylor series in time: a scalar that differentiates whatever runs over it.
//!
//! x(t) = Σ x_k tᵏ with N coefficients over another scalar; x_k is the k-th derivative over k!. The algorithms run over it
//! unchanged, so the derivatives of a torque along a motion come out of the recursion that gives the torque.

use crate::dd::Dd;
use crate::operators::operators;
use crate::real::Real;

/// A truncated Taylor series. How many coefficients are computed is said at run time, so that whatever runs over series is compiled
/// once and not per order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taylor<T, const N: usize> {
    /// The coefficients, that of t⁰ first; zero where they are not computed.
    pub coefficients: [T; N],
    /// How many are computed; [`CONSTANT`] where all but the first are known to be zero.
    terms: usize,
}

/// The terms of a constant: it takes as many as whatever it meets.
const CONSTANT: usize = usize::MAX;

impl<T: Real, const N: usize> Taylor<T, N> {
    /// The series of these coefficients.
    pub fn new(coefficients: [T; N]) -> Self {
        Taylor { coefficients, terms: N }
    }

    /// The series of a function with these derivatives at t = 0, the function itself first; what is not given is zero.
    pub fn from_derivatives(derivatives: impl IntoIterator<Item = T>) -> Self {
        Taylor::truncated(N, derivatives)
    }

    /// The same of so many terms.
    pub fn truncated(terms: usize, derivatives: impl IntoIterator<Item = T>) -> Self {
        let (mut coefficients, mut factorial) = ([T::zero(); N], Dd::ONE);
        for (k, (slot, x)) in coefficients[..terms].iter_mut().zip(derivatives).enumerate() {
            if k > 1 {
                factorial = factorial * Dd::from(k as f64);
            }
            // a quotient of exact numbers rounds once
            *slot = if k > 1 { x / T::constant(factorial) } else { x };
        }
        Taylor { coefficients, terms }
    }

    /// A constant.
    pub fn fixed(value: T) -> Self {
        let mut coefficients = [T::zero(); N];
        coefficients[0] = value;
        Taylor { coefficients, terms: CONSTANT }
    }

    /// The series of `terms` terms with these coefficients, one after the other of those before it.
    fn each(terms: usize, mut coefficient: impl FnMut(&[T; N], usize) -> T) -> Self {
        let mut coefficients = [T::zero(); N];
        for k in 0..computed(terms) {
            coefficients[k] = coefficient(&coefficients, k);
        }
        Taylor { coefficients, terms }
    }

    /// The terms of what follows from both.
    fn with(&self, other: &Self) -> usize {
        self.terms.min(other.terms)
    }

    /// The k-th derivative at t = 0.
    pub fn derivative_at(&self, k: usize) -> T {
        let factorial = (2..=k).fold(Dd::ONE, |product, i| product * Dd::from(i as f64));
        match k {
            0 | 1 => self.coefficients[k],
            _ => self.coefficients[k] * T::constant(factorial),
        }
    }

    /// The derivative; its last coefficient is unknown and stands as zero.
    #[must_use]
    pub fn derivative(&self) -> Self {
        let mut coefficients = [T::zero(); N];
        for k in 1..computed(self.terms) {
            coefficients[k - 1] = self.coefficients[k] * number(k);
        }
        Taylor { coefficients, terms: self.terms }
    }
}

/// How many coefficients there are to compute.
fn computed(terms: usize) -> usize {
    if terms == CONSTANT {
        1
    } else {
        terms
    }
}

fn number<T: Real>(k: usize) -> T {
    T::constant(Dd::from(k as f64))
}

/// a − b, where there is a b.
fn less<T: Real>(a: T, b: Option<T>) -> T {
    b.map_or(a, |b| a - b)
}

/// Σ_{i=from}^{to} a_i b_{k−i}.
fn convolution<T: Real>(a: &[T], b: &[T], k: usize, from: usize, to: usize) -> Option<T> {
    (from..=to).map(|i| a[i] * b[k - i]).reduce(|sum, x| sum + x)
}

operators! { [T: Real, const N: usize] Taylor<T, N>:
    Add add |a, b| Taylor::each(a.with(&b), |_, k| a.coefficients[k] + b.coefficients[k]);
    Sub sub |a, b| Taylor::each(a.with(&b), |_, k| a.coefficients[k] - b.coefficients[k]);
    Neg neg |a| Taylor::each(a.terms, |_, k| -a.coefficients[k]);
    Mul mul |a, b| {
        let (a, terms) = (&a.coefficients, a.with(&b));
        Taylor::each(terms, |_, k| convolution(a, &b.coefficients, k, 0, k).expect("a sum has a first term"))
    };
    // y = a / b from b y = a: y_k = (a_k − Σ_{i≥1} b_i y_{k−i}) / b_0.
    Div div |a, b| {
        Taylor::each(a.with(&b), |y, k| {
            let rest = convolution(&b.coefficients, y, k, 1, k);
            less(a.coefficients[k], rest) / b.coefficients[0]
        })
    };
}

impl<T: Real, const N: usize> Real for Taylor<T, N> {
    fn constant(value: Dd) -> Self {
        Taylor::fixed(T::constant(value))
    }

    /// From ṡ = c ẋ and ċ = −s ẋ: k s_k = Σ_{i≥1} i x_i c_{k−i}, k c_k = −Σ_{i≥1} i x_i s_{k−i}.
    fn sin_cos(self) -> (Self, Self) {
        let (mut s, mut c, mut rates) = ([T::zero(); N], [T::zero(); N], [T::zero(); N]);
        (s[0], c[0]) = self.coefficients[0].sin_cos();
        for k in 1..computed(self.terms) {
            rates[k] = self.coefficients[k] * number(k);
            let (sine, cosine) = (convolution(&rates, &c, k, 1, k), convolution(&rates, &s, k, 1, k));
            s[k] = sine.expect("k ≥ 1") / number(k);
            c[k] = -(cosine.expect("k ≥ 1") / number(k));
        }
        let terms = self.terms;
        (Taylor { coefficients: s, terms }, Taylor { coefficients: c, terms })
    }

    /// From y² = x: 2 y_0 y_k = x_k − Σ_{0<i<k} y_i y_{k−i}.
    fn sqrt(self) -> Self {
        Taylor::each(self.terms, |y, k| match k {
            0 => self.coefficients[0].sqrt(),
            _ => less(self.coefficients[k], convolution(y, y, k, 1, k - 1)) / (y[0] + y[0]),
        })
    }

    /// Constant on either side of zero; at zero as if it stayed there.
    fn sign(self) -> Self {
        Taylor::fixed(self.coefficients[0].sign())
    }

    fn named(self, name: &'static str, index: usize, component: &'static str) -> Self {
        let mut series = self;
        series.coefficients[0] = series.coefficients[0].named(name, index, component);
        series
    }

    fn section(phase: &'static str, body: Option<usize>) {
        T::section(phase, body);
    }
}
