//! Numbers that know how large the terms were that they are made of: what an error is to be compared with.
//!
//! A sum of large terms may be small, and what rounding leaves in it is of the size of the terms. [`Magnitude`] carries that size along: it
//! is how far the value moves if each constant and each input moves by a small part of its own size, over that part. An error
//! of ε times the size is what an evaluation with unit roundoff ε is allowed. The part is a thousandth, not infinitesimal, so that the square of what
//! cancels altogether, such as the moment of inertia of a mass on the axis, has a size, too.
//!
//! Movements add as those of independent numbers do, by the root of the sum of their squares. So vectors keep their size when they are turned: along
//! a chain of a hundred rotations a sum of moduli would grow like 1.7¹⁰⁰.

use crate::dd::Dd;
use crate::operators::operators;
use crate::real::Real;
use crate::trig::sqrt_f64;

/// The part of their sizes by which numbers are moved.
const PART: f64 = 1e-3;

/// A value and the size of what it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Magnitude {
    /// The value.
    pub value: Dd,
    /// How large its terms are; never less than the value.
    pub size: f64,
}

impl Magnitude {
    /// A number that is as large as it is.
    pub fn new(value: Dd) -> Self {
        Magnitude { value, size: value.hi().abs() }
    }

    /// The same number as a part of something of this size, such as a component of a vector of this length.
    #[must_use]
    pub fn of_size(self, size: f64) -> Self {
        Magnitude { size: self.size.max(size), ..self }
    }

    /// A value that two movements move.
    fn moved(value: Dd, by: [f64; 2]) -> Self {
        Magnitude::new(value).of_size(length(by))
    }
}

/// √(a² + b²), of squares that would leave the range of f64, too.
fn length([a, b]: [f64; 2]) -> f64 {
    let (most, least) = if a > b { (a, b) } else { (b, a) };
    match least / most {
        part if part > 1e-5 && part <= 1.0 => most * sqrt_f64(1.0 + part * part),
        // the lesser is next to nothing, or one is no number
        _ => most + least,
    }
}

operators! { [] Magnitude:
    Add add |a, b| Magnitude::moved(a.value + b.value, [a.size, b.size]);
    Sub sub |a, b| Magnitude::moved(a.value - b.value, [a.size, b.size]);
    Mul mul |a, b| {
        let [x, y] = [a, b].map(|v| v.value.hi().abs());
        // (a + δa)(b + δb) − ab = δa b + a δb + δa δb
        Magnitude::moved(a.value * b.value, [length([a.size * y, x * b.size]), PART * a.size * b.size])
    };
    Div div |a, b| {
        let value = a.value / b.value;
        let by = b.value.hi().abs();
        Magnitude::moved(value, [a.size / by, value.hi().abs() * b.size / by])
    };
    Neg neg |a| Magnitude { value: -a.value, ..a };
}

impl Real for Magnitude {
    fn constant(value: Dd) -> Self {
        Magnitude::new(value)
    }

    /// Both are parts of a rotation, whose size is one.
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (Magnitude { value: sin, size: 1.0 }, Magnitude { value: cos, size: 1.0 })
    }

    fn sin_cos_of_sum(angles: &[Self]) -> (Self, Self) {
        angles.iter().fold(Self::zero(), |sum, angle| sum + *angle).sin_cos()
    }

    fn sqrt(self) -> Self {
        let root = Dd::sqrt(self.value);
        Magnitude::moved(root, [self.size / (2.0 * root.hi()), root.hi()])
    }

    fn sign(self) -> Self {
        Magnitude::new(Real::sign(self.value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cancels_keeps_the_size_of_its_terms() {
        let [a, b] = [1e6 + 1.0, 1e6].map(|x| Magnitude::new(Dd::from(x)));
        let rest = a - b;
        assert_eq!(rest.value, Dd::ONE);
        assert!((rest.size / 2e12f64.sqrt() - 1.0).abs() < 1e-6, "{rest:?}");
    }

    #[test]
    fn sizes_never_fall_below_values_nor_leave_the_range() {
        let large = Magnitude::new(Dd::from(1e200));
        assert!(((large + large).size / 2e200 - 1.0).abs() < 1e-15);
        assert!(((large - large).size / (2f64.sqrt() * 1e200) - 1.0).abs() < 1e-15);
        assert!((Magnitude::new(Dd::ZERO) / Magnitude::new(Dd::ZERO)).value.hi().is_nan());
    }

    #[test]
    fn what_is_turned_keeps_its_size() {
        let mut vector = [3.0, 0.0].map(|x| Magnitude::new(Dd::from(x)).of_size(3.0));
        for turn in 0..400 {
            let (sin, cos) = Magnitude::new(Dd::from(0.1 * f64::from(turn))).sin_cos();
            vector = [cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1]];
        }
        // √2 of the first angle, and as much more for each; a sum of moduli comes to 1e60
        assert!(vector.iter().all(|x| x.size < 3.0 * 21.0), "{vector:?}");
    }

    #[test]
    fn a_component_that_vanishes_counts_with_its_vector() {
        let [zero, two] = [0.0, 2.0].map(|x| Magnitude::new(Dd::from(x)));
        assert!(((zero.of_size(0.5) * two).size - 1.0).abs() < 1e-5);
        // and a square that vanishes with a thousandth of its own
        let point = zero.of_size(2.0);
        assert!(((point * point).size / 4e-3 - 1.0).abs() < 1e-12);
        assert_eq!((zero * two).size, 0.0);
    }

    #[test]
    fn a_small_divisor_makes_what_its_terms_leave_large() {
        let [a, b, c] = [1.0, 1.001, 1.0].map(|x| Magnitude::new(Dd::from(x)));
        let quotient = a / (b - c);
        assert!((quotient.size / (1000.0 * 1000.0 * 2.002f64.sqrt()) - 1.0).abs() < 2e-3, "{quotient:?}");
    }
}
