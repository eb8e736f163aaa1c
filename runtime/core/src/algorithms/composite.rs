//! Several bodies as one rigid body: mass, first and second moment, which is what both forms of the mass matrix carry down.

use crate::real::Real;
use crate::spatial::{Sym3, Vec3};

/// The bodies outside a joint as one rigid body, about the origin of the joint's frame.
#[derive(Clone, Copy)]
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

    /// The 6 × 6 block of a floating base, coordinates (v, ω): f = M v̇ + ε × m c,  n = m c × v̇ + J ε.
    pub fn fill_floating_block(&self, iv: usize, set: &mut impl FnMut(usize, usize, T)) {
        let (ms, s) = (self.first_moment, self.second_moment);
        let j = s.second_moment_to_inertia();
        for k in 0..3 {
            set(iv + k, iv + k, self.mass);
        }
        // row v_i, column ω_k: (e_k × m c)_i
        set(iv, iv + 4, ms.z);
        set(iv, iv + 5, -ms.y);
        set(iv + 1, iv + 3, -ms.z);
        set(iv + 1, iv + 5, ms.x);
        set(iv + 2, iv + 3, ms.y);
        set(iv + 2, iv + 4, -ms.x);
        for (row, column, value) in [(0, 0, j.xx), (0, 1, j.xy), (0, 2, j.xz), (1, 1, j.yy), (1, 2, j.yz), (2, 2, j.zz)]
        {
            set(iv + 3 + row, iv + 3 + column, value);
        }
    }
}
