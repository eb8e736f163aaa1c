//! The scalar of the reference: a [`Real`] that nalgebra's products accept.

use crate::dd::Dd;
use crate::real::Real;
use core::ops::{AddAssign, DivAssign, MulAssign, SubAssign};
use num_traits::{One, Zero};

/// A [`Real`] that nalgebra can add and multiply: f32, f64 and [`Dd`].
pub trait Number: Real + nalgebra::Scalar + Zero + One + AddAssign + SubAssign + MulAssign + DivAssign {}

impl<T: Real + nalgebra::Scalar + Zero + One + AddAssign + SubAssign + MulAssign + DivAssign> Number for T {}

impl Zero for Dd {
    fn zero() -> Self {
        Dd::ZERO
    }
    fn is_zero(&self) -> bool {
        *self == Dd::ZERO
    }
}

impl One for Dd {
    fn one() -> Self {
        Dd::ONE
    }
}
