//! The mass matrix of a [`ReducedModel`]: composite rigid bodies in second moments, as in `crba.rs`.
//!
//! H belongs to the torques, so it takes base inertial parameters as well as any other distribution of mass that moves the
//! same. A composite of bodies that [stay](ReducedBody::stays) is put together in the base axes of their chain: there the
//! constants turn, and no composite.

use super::reduced_dynamics::along_joint;
use super::reduced_turn::Turn;
use crate::joint::FLOATING_BASE;
use crate::real::Real;
use crate::reduced::{ReducedBody, ReducedJoint, ReducedModel};
use crate::spatial::{Composite, ForceVector, Mat3, Sym3, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// H(q), nv × nv, row-major, symmetric, without rotors: [`mass_matrix`](super::mass_matrix) of the full robot. Longer than 80 lines: the order of the
/// one sweep is that of the equations.
pub fn reduced_mass_matrix<T: Real>(model: &ReducedModel<T>, q: &[T]) -> Vec<T> {
    let turns = Turn::all(model, q);
    let nv = model.nv();
    let mut h = vec![T::zero(); nv * nv];
    let mut set = |i: usize, j: usize, value: T| {
        h[i * nv + j] = value;
        h[j * nv + i] = value;
    };
    let mut composites: Vec<Composite<T>> =
        model.bodies.iter().zip(&turns).map(|(body, turn)| of_body(body, turn)).collect();
    for (b, body) in model.bodies.iter().enumerate().rev() {
        T::section("composite", Some(b));
        let (iv, composite, turn) = (body.iv, composites[b].named(b), &turns[b]);
        // in base axes, which the joint has turned or slid from already
        let (moved, columns) = match body.kind {
            ReducedJoint::Free => {
                let composite = in_metres(&composite, model.per_unit);
                let own = &q[body.iq..body.iq + FLOATING_BASE.nq()];
                let mut set = |i, j, value| set(iv + i, iv + j, value);
                FLOATING_BASE.mechanics().block(&composite, own, FLOATING_BASE.nv(), &mut set);
                continue;
            }
            ReducedJoint::Slide => {
                // f = M z,  n = m c × z
                set(iv, iv, composite.mass);
                let ms = composite.first_moment;
                let force = Vec3::new(T::zero(), T::zero(), composite.mass);
                let moment = Vec3::new(ms.y, -ms.x, T::zero());
                (composite.slid(q[body.iq]), vec![ForceVector { moment, force }])
            }
            ReducedJoint::Turn => {
                // f = z × m c,  n = J z = (−Σ_xz, −Σ_yz, Σ_xx + Σ_yy)
                let inertia = composite.second_moment.xx + composite.second_moment.yy;
                set(iv, iv, inertia);
                let moved = match turn.angle {
                    Some(angle) if !body.stays => composite.turned(angle),
                    _ => composite,
                };
                let (ms, s) = (moved.first_moment, moved.second_moment);
                let force = Vec3::new(-ms.y, ms.x, T::zero());
                (moved, vec![ForceVector { moment: Vec3::new(-s.xz, -s.yz, inertia), force }])
            }
            ReducedJoint::Ball => {
                // f = e_k × m c,  n = J e_k in own axes, J = tr(Σ) 1 − Σ
                let (ms, inertia) = (composite.first_moment, composite.second_moment.second_moment_to_inertia());
                let columns = [0, 1, 2].map(|k| {
                    let axis = Vec3::unit(k);
                    ForceVector { moment: inertia * axis, force: axis.cross(ms) }
                });
                for (j, column) in columns.iter().enumerate() {
                    let along = column.moment.to_array();
                    (0..=j).for_each(|k| set(iv + j, iv + k, along[k]));
                }
                (composite, columns.to_vec())
            }
        };
        let arm_of = |b: usize| {
            let body = &model.bodies[b];
            let own = body.parent.map(|p| turns[p].own_to_described(&model.bodies[p], body.translation));
            own.unwrap_or(body.translation)
        };
        let Some(parent) = body.parent else { continue };
        let placed = placed(&moved, body, turn, arm_of(b));
        composites[parent] = composites[parent].plus(&placed);

        // to the base, projected on each joint that it passes
        for (iv, column) in (iv..).zip(columns) {
            let (mut below, mut wrench) = (b, column);
            while let Some(ancestor) = model.bodies[below].parent {
                T::section("column", Some(b));
                let (body, turn) = (&model.bodies[below], &turns[below]);
                let force = turn.base_to_parent(body, wrench.force);
                let moment = turn.base_to_parent(body, wrench.moment) + arm_of(below).cross(force);
                let over = &model.bodies[ancestor];
                along_joint(model, over, &ForceVector { moment, force }, &mut |k, x| set(iv, k, x));
                let turned = |v| turns[ancestor].described_to_base(over, v);
                let moment = match over.kind {
                    // q z × F
                    ReducedJoint::Slide => {
                        let slide = q[over.iq];
                        moment + Vec3::new(-(slide * force.y), slide * force.x, T::zero())
                    }
                    _ => moment,
                };
                wrench = ForceVector { moment: turned(moment), force: turned(force) };
                below = ancestor;
            }
        }
    }
    h
}

/// In the axes in which the body is described.
pub(super) fn of_body<T: Real>(body: &ReducedBody<T>, turn: &Turn<T>) -> Composite<T> {
    let own = Composite { mass: body.mass, first_moment: body.first_moment, second_moment: body.second_moment };
    match turn.angle {
        Some(angle) if body.stays => own.turned(angle),
        _ => own,
    }
}

/// From base axes to those of the parent's description, about the parent's origin, p = arm before it.
fn placed<T: Real>(composite: &Composite<T>, body: &ReducedBody<T>, turn: &Turn<T>, p: Vec3<T>) -> Composite<T> {
    let ms = turn.base_to_parent(body, composite.first_moment);
    let s = match (&turn.free, turn.continues) {
        (Some(r), _) => rotated(&body.rotation, rotated(r, composite.second_moment, false), body.permutes),
        (None, true) => composite.second_moment,
        (None, false) => rotated(&body.rotation, composite.second_moment, body.permutes),
    };
    Composite::moved(composite.mass, (ms, s), p)
}

/// With lengths in metres.
fn in_metres<T: Real>(composite: &Composite<T>, per_unit: T) -> Composite<T> {
    let (mass, first_moment) = (composite.mass * per_unit * per_unit, composite.first_moment.scale(per_unit));
    Composite { mass, first_moment, ..*composite }
}

/// E S Eᵀ. Where E is dense, E (S − S_zz 1) Eᵀ + S_zz 1, its last entry from the trace, which no rotation changes.
pub(super) fn rotated<T: Real>(e: &Mat3<T>, s: Sym3<T>, permutes: bool) -> Sym3<T> {
    if permutes {
        return s.rotated(e);
    }
    let (xx, yy) = (s.xx - s.zz, s.yy - s.zz);
    let r = Sym3 { xx, yy, zz: T::zero(), ..s }.rotated(e);
    Sym3 { xx: r.xx + s.zz, yy: r.yy + s.zz, zz: s.zz + (xx + yy - r.xx - r.yy), ..r }
}
