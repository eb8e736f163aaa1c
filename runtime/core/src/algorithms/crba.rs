//! The mass matrix H(q): the composite-rigid-body algorithm (Featherstone 2008, table 6.2), with second moments.
//!
//! All that lies outside a joint is one rigid body with mass M, first moment m c and second moment Σ = ∫ r rᵀ dm about the
//! origin of the joint's frame. Σ moves more cheaply than the inertia tensor J = tr(Σ) 1 − Σ. Column j of H is the wrench
//! that accelerates that composite by q̈_j = 1, carried down to the base and projected on every joint that it passes.

use super::joint::JointPose;
use crate::model::{Body, JointKind, Model};
use crate::real::Real;
use crate::spatial::{ForceVector, Sym3, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// H(q), nv × nv, row-major, symmetric, \[kg·m², kg·m, kg\] as the coordinates have it. Entries of joints on different
/// branches are structural zeros.
#[doc(alias = "crba")]
#[doc(alias = "joint space inertia matrix")]
pub fn mass_matrix<T: Real>(model: &Model<T>, q: &[T]) -> Vec<T> {
    let poses = JointPose::all(&model.bodies, q);
    let nv = model.nv();
    let mut h = vec![T::zero(); nv * nv];
    let mut set = |i: usize, j: usize, value: T| {
        h[i * nv + j] = value;
        h[j * nv + i] = value;
    };
    let mut composites: Vec<Composite<T>> = model.bodies.iter().map(Composite::of_body).collect();
    for (b, body) in model.bodies.iter().enumerate().rev() {
        T::section("composite", Some(b));
        let iv = body.joint.iv;
        let composite = composites[b].named(b);
        let joint = &poses[b];

        // The wrench of q̈_j = 1, and the composite, in axes that the joint has turned or slid back already.
        let (column, moved) = match (body.joint.kind, joint.turn) {
            (JointKind::Floating, _) => {
                composite.fill_floating_block(iv, &mut set);
                continue; // a root: nothing below it
            }
            (JointKind::Prismatic, _) => {
                // f = M z,  n = m c × z
                set(iv, iv, with_rotor(composite.mass, body));
                let ms = composite.first_moment;
                let force = Vec3::new(T::zero(), T::zero(), composite.mass);
                let moment = Vec3::new(ms.y, -ms.x, T::zero());
                (ForceVector { moment, force }, composite.slid(joint.slide_or_zero()))
            }
            (JointKind::Revolute, turn) => {
                // f = z × m c,  n = J z = (−Σ_xz, −Σ_yz, Σ_xx + Σ_yy)
                let inertia = composite.second_moment.xx + composite.second_moment.yy;
                set(iv, iv, with_rotor(inertia, body));
                let moved = composite.turned(turn.expect("a revolute joint turns"));
                let (ms, s) = (moved.first_moment, moved.second_moment);
                let force = Vec3::new(-ms.y, ms.x, T::zero());
                (ForceVector { moment: Vec3::new(-s.xz, -s.yz, inertia), force }, moved)
            }
        };
        let Some(parent) = body.parent else { continue };
        composites[parent] = composites[parent].plus(&moved.placed(joint));

        let mut column = joint.placed_wrench(&column);
        let mut ancestor = parent;
        loop {
            T::section("column", Some(b));
            let below = &model.bodies[ancestor];
            project(&column, below, |i, value| set(i, iv, value));
            let Some(next) = below.parent else { break };
            column = poses[ancestor].wrench_to_parent(&column);
            ancestor = next;
        }
    }
    h
}

/// The inertia on a joint's own coordinate, rotor included.
fn with_rotor<T: Real>(inertia: T, body: &Body<T>) -> T {
    body.effects.rotor_inertia.map_or(inertia, |rotor| inertia + rotor)
}

/// What a wrench does along the joint of a body, by velocity coordinate.
fn project<T: Real>(w: &ForceVector<T>, body: &Body<T>, mut set: impl FnMut(usize, T)) {
    let iv = body.joint.iv;
    match body.joint.kind {
        JointKind::Revolute => set(iv, w.moment.z),
        JointKind::Prismatic => set(iv, w.force.z),
        JointKind::Floating => {
            w.force.to_array().into_iter().chain(w.moment.to_array()).enumerate().for_each(|(k, x)| set(iv + k, x));
        }
    }
}

/// The bodies outside a joint as one rigid body, about the origin of the joint's frame.
#[derive(Clone, Copy)]
struct Composite<T> {
    /// M \[kg\].
    mass: T,
    /// M c \[kg·m\].
    first_moment: Vec3<T>,
    /// Σ \[kg·m²\].
    second_moment: Sym3<T>,
}

impl<T: Real> Composite<T> {
    fn of_body(body: &Body<T>) -> Self {
        let total = body.total_about_origin();
        Composite { mass: total.mass, first_moment: total.first_moment, second_moment: total.second_moment }
    }

    fn plus(&self, other: &Self) -> Self {
        Composite {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            second_moment: self.second_moment + other.second_moment,
        }
    }

    fn named(&self, b: usize) -> Self {
        Composite {
            mass: self.mass,
            first_moment: self.first_moment.named("first_moment", b),
            second_moment: self.second_moment.named("second_moment", b),
        }
    }

    /// Turned about z by the angle with this (sin, cos).
    fn turned(&self, (s, c): (T, T)) -> Self {
        Composite {
            mass: self.mass,
            first_moment: self.first_moment.turned(s, c),
            second_moment: self.second_moment.turned(s, c),
        }
    }

    /// Moved along z by q: Σ' = Σ + q (z (m c)'ᵀ + m c zᵀ).
    fn slid(&self, q: T) -> Self {
        let (ms, s) = (self.first_moment, self.second_moment);
        let msz = ms.z + self.mass * q;
        Composite {
            mass: self.mass,
            first_moment: Vec3 { z: msz, ..ms },
            second_moment: Sym3 { xz: s.xz + q * ms.x, yz: s.yz + q * ms.y, zz: s.zz + q * (ms.z + msz), ..s },
        }
    }

    /// In the parent's axes, about the parent's origin.
    fn placed(&self, joint: &JointPose<T>) -> Self {
        let p = joint.translation;
        let ms = joint.placement * self.first_moment;
        let s = joint.placed(self.second_moment);
        // m c' = m c + M p,  Σ' = Σ + p (m c')ᵀ + m c pᵀ
        let ms_new = ms + p.scale(self.mass);
        let shift = Sym3 {
            xx: p.x * (ms.x + ms_new.x),
            xy: p.x * ms_new.y + ms.x * p.y,
            xz: p.x * ms_new.z + ms.x * p.z,
            yy: p.y * (ms.y + ms_new.y),
            yz: p.y * ms_new.z + ms.y * p.z,
            zz: p.z * (ms.z + ms_new.z),
        };
        Composite { mass: self.mass, first_moment: ms_new, second_moment: s + shift }
    }

    /// The 6 × 6 block of a floating base, coordinates (v, ω): f = M v̇ + ε × m c,  n = m c × v̇ + J ε.
    fn fill_floating_block(&self, iv: usize, set: &mut impl FnMut(usize, usize, T)) {
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
