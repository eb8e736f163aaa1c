//! Several bodies as one rigid body: mass, first and second moment, which is what both forms of the mass matrix carry down.

use crate::real::Real;
use crate::spatial::{ForceVector, MotionVector, Sym3, Vec3};

/// The bodies outside a joint as one rigid body, about the origin of the joint's frame.
#[derive(Clone, Copy, Debug)]
pub struct Composite<T> {
    /// M \[kg\].
    pub mass: T,
    /// M c \[kg·m\].
    pub first_moment: Vec3<T>,
    /// Σ \[kg·m²\].
    pub second_moment: Sym3<T>,
}

impl<T: Real> Composite<T> {
    /// Both as one.
    pub fn plus(&self, other: &Self) -> Self {
        Composite {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            second_moment: self.second_moment + other.second_moment,
        }
    }

    /// With names for generated code.
    pub fn named(&self, b: usize) -> Self {
        Composite {
            mass: self.mass,
            first_moment: self.first_moment.named("first_moment", b),
            second_moment: self.second_moment.named("second_moment", b),
        }
    }

    /// Turned about z by the angle with this (sin, cos).
    pub fn turned(&self, (s, c): (T, T)) -> Self {
        Composite {
            mass: self.mass,
            first_moment: self.first_moment.turned(s, c),
            second_moment: self.second_moment.turned(s, c),
        }
    }

    /// Moved along z by q: Σ' = Σ + q (z (m c)'ᵀ + m c zᵀ).
    pub fn slid(&self, q: T) -> Self {
        let (ms, s) = (self.first_moment, self.second_moment);
        let msz = ms.z + self.mass * q;
        Composite {
            mass: self.mass,
            first_moment: Vec3 { z: msz, ..ms },
            second_moment: Sym3 { xz: s.xz + q * ms.x, yz: s.yz + q * ms.y, zz: s.zz + q * (ms.z + msz), ..s },
        }
    }

    /// About an origin that lies at −p in the same axes, after first and second moment were turned into these.
    pub fn moved(mass: T, (ms, s): (Vec3<T>, Sym3<T>), p: Vec3<T>) -> Self {
        // m c' = m c + M p,  Σ' = Σ + p (m c')ᵀ + m c pᵀ
        let ms_new = ms + p.scale(mass);
        let shift = Sym3 {
            xx: p.x * (ms.x + ms_new.x),
            xy: p.x * ms_new.y + ms.x * p.y,
            xz: p.x * ms_new.z + ms.x * p.z,
            yy: p.y * (ms.y + ms_new.y),
            yz: p.y * ms_new.z + ms.y * p.z,
            zz: p.z * (ms.z + ms_new.z),
        };
        Composite { mass, first_moment: ms_new, second_moment: s + shift }
    }

    /// The wrench about the origin that this acceleration, from rest, takes: f = M a + ε × m c,  n = m c × a + J ε.
    pub fn wrench_of(&self, a: &MotionVector<T>) -> ForceVector<T> {
        let j = self.second_moment.second_moment_to_inertia();
        ForceVector {
            moment: self.first_moment.cross(a.linear) + j * a.angular,
            force: a.linear.scale(self.mass) + a.angular.cross(self.first_moment),
        }
    }
}
