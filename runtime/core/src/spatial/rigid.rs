//! Poses, twists, wrenches and inertias.

use super::{Mat3, Sym3, Vec3};
use crate::operators::operators;
use crate::real::Real;

/// The pose of a frame b in a frame a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform<T> {
    /// r_ab: columns are b's axes in a.
    pub rotation: Mat3<T>,
    /// Origin of b in a \[m\].
    pub translation: Vec3<T>,
}

impl<T: Real> Transform<T> {
    /// Frames that coincide.
    pub fn identity() -> Self {
        Transform { rotation: Mat3::identity(), translation: Vec3::zero() }
    }

    /// The pose of c in a, from this pose of b in a and that of c in b.
    pub fn compose(&self, x_bc: &Transform<T>) -> Transform<T> {
        Transform {
            rotation: self.rotation * x_bc.rotation,
            translation: self.translation + self.rotation * x_bc.translation,
        }
    }

    /// The pose of a in b.
    pub fn inverse(&self) -> Transform<T> {
        Transform { rotation: self.rotation.transpose(), translation: -self.rotation.transpose_mul(self.translation) }
    }

    /// Every entry through `f`.
    pub fn map<U: Real>(&self, mut f: impl FnMut(T) -> U) -> Transform<U> {
        Transform { rotation: self.rotation.map(&mut f), translation: self.translation.map(f) }
    }
}

/// A twist or an acceleration: angular part first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionVector<T> {
    /// ω \[rad/s\] or ε \[rad/s²\].
    pub angular: Vec3<T>,
    /// Of the frame's origin, classical: v \[m/s\] or a \[m/s²\].
    pub linear: Vec3<T>,
}

/// A wrench: moment about the frame's origin first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceVector<T> {
    /// M \[N·m\].
    pub moment: Vec3<T>,
    /// F \[N\].
    pub force: Vec3<T>,
}

impl<T: Real> ForceVector<T> {
    /// No force, no moment.
    pub fn zero() -> Self {
        ForceVector { moment: Vec3::zero(), force: Vec3::zero() }
    }
}

operators! { [T: Real] ForceVector<T>:
    Add add |a, b| ForceVector { moment: a.moment + b.moment, force: a.force + b.force };
}

/// Mass, centre of mass and inertia of a body, in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialInertia<T> {
    /// m \[kg\].
    pub mass: T,
    /// Centre of mass \[m\].
    pub com: Vec3<T>,
    /// First moment m c \[kg·m\].
    pub first_moment: Vec3<T>,
    /// Inertia tensor about the centre of mass J_c \[kg·m²\].
    pub inertia_com: Sym3<T>,
    /// Differences of the diagonal of J_c, (J_zz − J_yy, J_xx − J_zz, J_yy − J_xx) \[kg·m²\]: what ω × J ω
    /// takes of it.
    pub anisotropy_com: Vec3<T>,
    /// Second moment about the centre of mass Σ_c = ½ tr(J_c) 1 − J_c \[kg·m²\].
    pub second_moment_com: Sym3<T>,
    /// Second moment about the frame's origin Σ_o = Σ_c + m c cᵀ \[kg·m²\].
    pub second_moment: Sym3<T>,
}

impl<T: Real> SpatialInertia<T> {
    /// From mass \[kg\], centre of mass \[m\] and inertia tensor about the centre of mass \[kg·m²\], in the frame's axes.
    pub fn new(mass: T, com: Vec3<T>, inertia_com: Sym3<T>) -> Self {
        let first_moment = com.scale(mass);
        let second_moment_com = inertia_com.inertia_to_second_moment();
        let second_moment = second_moment_com + symmetric_product(com, first_moment);
        let j = inertia_com;
        SpatialInertia {
            mass,
            com,
            first_moment,
            inertia_com,
            anisotropy_com: Vec3::new(j.zz - j.yy, j.xx - j.zz, j.yy - j.xx),
            second_moment_com,
            second_moment,
        }
    }

    /// No mass.
    pub fn zero() -> Self {
        SpatialInertia::new(T::zero(), Vec3::zero(), Sym3::zero())
    }

    /// Every number through `f`.
    pub fn map<U: Real>(&self, mut f: impl FnMut(T) -> U) -> SpatialInertia<U> {
        SpatialInertia {
            mass: f(self.mass),
            com: self.com.map(&mut f),
            first_moment: self.first_moment.map(&mut f),
            inertia_com: self.inertia_com.map(&mut f),
            anisotropy_com: self.anisotropy_com.map(&mut f),
            second_moment_com: self.second_moment_com.map(&mut f),
            second_moment: self.second_moment.map(f),
        }
    }
}

/// The symmetric product a bᵀ of two parallel vectors.
pub(crate) fn symmetric_product<T: Real>(a: Vec3<T>, b: Vec3<T>) -> Sym3<T> {
    Sym3 { xx: a.x * b.x, xy: a.x * b.y, xz: a.x * b.z, yy: a.y * b.y, yz: a.y * b.z, zz: a.z * b.z }
}
