//! Inertial parameters moved from body to body.

use super::*;

/// Moves what a joint's torque cannot tell from the parent's to the parent (Khalil and Dombre 2002, chapter 9, in second
/// moments): what lies on a revolute axis; of a sliding body all of the second moment; of a body on a ball joint all of the
/// mass.
///
/// Any part of it may stay: where `vanish` says so, as much is moved as makes that component of the parent vanish; where
/// `balances` says so, as much as leaves Σ_zz = −Σ_xx or −Σ_yy.
pub(super) fn regroup(
    bodies: &mut [ReducedBody<Dd>],
    i: usize,
    lever: f64,
    vanish: [Option<usize>; 3],
    balances: [bool; 2],
) {
    let body = bodies[i].clone();
    let (rotation, a, p) = (body.rotation, body.rotation.column(2), body.translation);
    match body.kind {
        ReducedJoint::Free => {}
        // the joint holds its origin whatever the body does
        ReducedJoint::Ball => {
            bodies[i].mass = Dd::ZERO;
            if let Some(parent) = body.parent {
                hand_on(&mut bodies[parent], [p, a], [body.mass, Dd::ZERO, Dd::ZERO]);
            }
        }
        ReducedJoint::Turn => {
            let (mut m, mut mz, mut szz) = (body.mass, body.first_moment.z, body.second_moment.zz);
            if let Some(before) = body.parent.map(|p| &bodies[p]) {
                let (ms, s) = (before.first_moment.to_array(), before.second_moment);
                let (s, p, a) = ([s.xx, s.yy, s.zz], p.to_array(), a.to_array());
                // never by a small divisor: that would make large parameters that cancel
                let by = |k: Option<usize>, x: &[Dd; 3], unit: f64| k.filter(|k| x[*k].abs().hi() > WORTH * unit);
                // p_k m + a_k m c_z = −m c_k of the parent, for one k or for two
                match (by(vanish[0], &p, lever), by(vanish[1], &a, 1.0)) {
                    (Some(j), Some(k)) if (p[j] * a[k] - p[k] * a[j]).abs().hi() > WORTH * WORTH * lever => {
                        let det = p[j] * a[k] - p[k] * a[j];
                        (m, mz) = ((a[j] * ms[k] - a[k] * ms[j]) / det, (p[k] * ms[j] - p[j] * ms[k]) / det);
                    }
                    (Some(k), _) => m = -(ms[k] + a[k] * mz) / p[k],
                    (None, Some(k)) => mz = -(ms[k] + p[k] * m) / a[k],
                    (None, None) => {}
                }
                if let Some(k) = by(vanish[2], &a, 1.0) {
                    let two = Dd::from(2.0);
                    szz = -(s[k] + p[k] * p[k] * m + two * p[k] * a[k] * mz) / (a[k] * a[k]);
                } else if let Some(k) = balances.iter().position(|b| *b) {
                    szz = body.second_moment.zz + [body.second_moment.xx, body.second_moment.yy][k];
                }
            }
            let own = &mut bodies[i];
            own.mass = body.mass - m;
            own.first_moment.z = body.first_moment.z - mz;
            own.second_moment.zz = body.second_moment.zz - szz;
            match body.parent {
                Some(parent) => hand_on(&mut bodies[parent], [p, a], [m, mz, szz]),
                None => {
                    // turns about a fixed axis: one moment of inertia
                    let s = own.second_moment;
                    own.second_moment = Sym3 { xx: s.xx + s.yy, ..Sym3::zero() };
                }
            }
        }
        ReducedJoint::Slide => {
            let (s0, c0) = body.offset;
            let moved = body.second_moment.turned(s0, c0).rotated(&rotation);
            let own = &mut bodies[i];
            own.second_moment = Sym3::zero();
            match body.parent {
                Some(parent) => bodies[parent].second_moment = bodies[parent].second_moment + moved,
                None => own.first_moment = Vec3::zero(),
            }
        }
    }
}

/// Adds a mass m at p, with a first moment and a second moment along the axis a, to a body.
fn hand_on(to: &mut ReducedBody<Dd>, [p, a]: [Vec3<Dd>; 2], [m, mz, szz]: [Dd; 3]) {
    let mass = to.mass + m;
    to.mass = mass;
    to.first_moment = to.first_moment + p.scale(m) + a.scale(mz);
    let cross = symmetric_product(p, a);
    let moved = scaled(symmetric_square(p), m) + scaled(cross, mz) + scaled(symmetric_square(a), szz);
    to.second_moment = to.second_moment + moved;
    // what vanishes does so exactly
    let dust = |x: Dd, scale: Dd| if x.abs().hi() <= DUST * scale.abs().hi() { Dd::ZERO } else { x };
    let ms = to.first_moment;
    let (x, y, z) = (p.x * m, p.y * m + a.y * mz, p.z * m + a.z * mz);
    to.first_moment = Vec3::new(dust(ms.x, x), dust(ms.y, y), dust(ms.z, z));
    let s = to.second_moment;
    let (xx, yy, zz) = (dust(s.xx, moved.xx), dust(s.yy, moved.yy), dust(s.zz, moved.zz));
    to.second_moment = Sym3 { xx, yy, zz, ..s };
}

fn scaled(s: Sym3<Dd>, k: Dd) -> Sym3<Dd> {
    s.map(|x| x * k)
}

/// v vᵀ.
fn symmetric_square(v: Vec3<Dd>) -> Sym3<Dd> {
    Sym3 { xx: v.x * v.x, xy: v.x * v.y, xz: v.x * v.z, yy: v.y * v.y, yz: v.y * v.z, zz: v.z * v.z }
}

/// a bᵀ + b aᵀ.
fn symmetric_product(a: Vec3<Dd>, b: Vec3<Dd>) -> Sym3<Dd> {
    Sym3 {
        xx: (a.x * b.x) * Dd::from(2.0),
        xy: a.x * b.y + a.y * b.x,
        xz: a.x * b.z + a.z * b.x,
        yy: (a.y * b.y) * Dd::from(2.0),
        yz: a.y * b.z + a.z * b.y,
        zz: (a.z * b.z) * Dd::from(2.0),
    }
}
