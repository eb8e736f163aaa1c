//! 3-vectors.

use crate::operators::operators;
use crate::real::Real;

/// A 3-vector; the frame it is expressed in stands in the name of the variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<T> {
    /// Component along x.
    pub x: T,
    /// Component along y.
    pub y: T,
    /// Component along z.
    pub z: T,
}

impl<T> Vec3<T> {
    /// A vector from its components.
    pub const fn new(x: T, y: T, z: T) -> Self {
        Vec3 { x, y, z }
    }
}

impl<T: Real> Vec3<T> {
    /// The null vector.
    pub fn zero() -> Self {
        Vec3::new(T::zero(), T::zero(), T::zero())
    }

    /// The unit vector along axis `k`: 0 is x.
    pub fn unit(k: usize) -> Self {
        Vec3::from(core::array::from_fn(|j| if j == k { T::one() } else { T::zero() }))
    }

    /// The unit vector along z.
    pub fn unit_z() -> Self {
        Vec3::new(T::zero(), T::zero(), T::one())
    }

    /// Every component through `f`.
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> Vec3<U> {
        Vec3::new(f(self.x), f(self.y), f(self.z))
    }

    /// `self · other`.
    pub fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// `self × other`.
    #[must_use]
    pub fn cross(self, b: Self) -> Self {
        let a = self;
        Vec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
    }

    /// `self` times a number.
    #[must_use]
    pub fn scale(self, k: T) -> Self {
        Vec3::new(self.x * k, self.y * k, self.z * k)
    }

    /// R_z v: turned about z by the angle with this sine and cosine. 4 multiplications, 2 additions.
    #[must_use]
    pub fn turned(self, sin: T, cos: T) -> Self {
        Vec3::new(self.x * cos - self.y * sin, self.y * cos + self.x * sin, self.z)
    }

    /// The same where the angle is known to [change](Real::turned_about).
    #[must_use]
    pub fn turned_about(self, angle: (T, T), turning: Option<T>) -> Self {
        let [x, y] = T::turned_about([self.x, self.y], angle, turning);
        Vec3::new(x, y, self.z)
    }

    /// The components as an array.
    pub fn to_array(self) -> [T; 3] {
        [self.x, self.y, self.z]
    }

    /// See [`Real::named`].
    #[must_use]
    pub fn named(self, name: &'static str, index: usize) -> Self {
        Vec3::new(self.x.named(name, index, "x"), self.y.named(name, index, "y"), self.z.named(name, index, "z"))
    }
}

impl<T> From<[T; 3]> for Vec3<T> {
    fn from([x, y, z]: [T; 3]) -> Self {
        Vec3 { x, y, z }
    }
}

operators! { [T: Real] Vec3<T>:
    Add add |a, b| Vec3::new(a.x + b.x, a.y + b.y, a.z + b.z);
    Sub sub |a, b| Vec3::new(a.x - b.x, a.y - b.y, a.z - b.z);
    Neg neg |a| Vec3::new(-a.x, -a.y, -a.z);
}
