//! The scalar of the reference: a [`Real`] that nalgebra's products accept.

use crate::dd::Dd;
use crate::dual::Dual;
use crate::magnitude::Magnitude;
use crate::operators::operators;
use crate::real::Real;
use core::ops::{AddAssign, DivAssign, MulAssign, SubAssign};
use num_traits::{One, Zero};

/// A [`Real`] that nalgebra can add and multiply: f32, f64, [`Dd`], and [`Magnitude`], over which every formula says its natural scale, too.
pub trait ReferenceReal: Real + nalgebra::Scalar + Zero + One + AddAssign + SubAssign + MulAssign + DivAssign {}

impl<T: Real + nalgebra::Scalar + Zero + One + AddAssign + SubAssign + MulAssign + DivAssign> ReferenceReal for T {}

macro_rules! number {
    ([$($parameters:tt)*] $T:ty) => {
        impl<$($parameters)*> Zero for $T {
            fn zero() -> Self {
                Real::zero()
            }
            fn is_zero(&self) -> bool {
                *self == <$T as Real>::zero()
            }
        }

        impl<$($parameters)*> One for $T {
            fn one() -> Self {
                Real::one()
            }
        }
    };
}

number!([] Dd);
number!([] Magnitude);
number!([T: Real + PartialEq, const N: usize] Dual<T, N>);

operators!(assign [] Magnitude);
operators!(assign [T: Real, const N: usize] Dual<T, N>);
