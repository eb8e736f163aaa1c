//! Forward dynamics without H: articulated-body inertias (Featherstone 2008, table 7.1).
//!
//! Two steps. The recursive Newton-Euler algorithm gives h; what is left, H x = tau − h, is solved by the articulated-body
//! recursion of a robot at rest without gravity, which has no velocity terms at all. An articulated inertia is
//! 6 × 6 in blocks of the acceleration (ε, a) of the joint frame's origin: n = J ε + H a,  f = Hᵀ ε + M a.

use super::joint::JointPose;
use super::rnea::bias_force;
use crate::model::{Body, JointKind, Model};
use crate::real::Real;
use crate::spatial::{ForceVector, Mat3, MotionVector, Sym3, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// q̈ \[rad/s² or m/s²\] that the generalized forces tau \[N·m or N\] cause, by the articulated-body algorithm.
#[doc(alias = "aba")]
#[doc(alias("ABA", "articulated body"))]
pub fn forward_dynamics_aba<T: Real>(model: &Model<T>, q: &[T], qd: &[T], tau: &[T]) -> Vec<T> {
    let bias = bias_force(model, q, qd);
    let drive: Vec<T> = tau.iter().zip(&bias).map(|(&t, &h)| t - h).collect();
    solve_articulated(model, q, &drive)
}

/// x with H(q) x = `drive`, without forming H.
///
/// Divides by what each joint feels of the mass beyond it, with the joints beyond free: positive as long as every joint
/// moves some mass or inertia; a joint that moves none has no forward dynamics, and what comes out is not finite.
#[doc(alias("ABA"))]
pub fn solve_articulated<T: Real>(model: &Model<T>, q: &[T], drive: &[T]) -> Vec<T> {
    let poses = JointPose::all(&model.bodies, q);
    let mut inertias: Vec<ArticulatedInertia<T>> = model.bodies.iter().map(ArticulatedInertia::of_body).collect();
    // forces that reach the base if no joint above accelerates
    let mut biases = vec![ForceVector::zero(); model.bodies.len()];
    let mut joints: Vec<Option<FreeJoint<T>>> = vec![None; model.bodies.len()];
    let mut x = vec![T::zero(); model.nv()];

    for (b, body) in model.bodies.iter().enumerate().rev() {
        T::section("articulated", Some(b));
        let (iv, pose) = (body.joint.iv, &poses[b]);
        let (joint, freed) = match body.joint.kind {
            JointKind::Floating => {
                let known = ForceVector {
                    force: Vec3::new(drive[iv], drive[iv + 1], drive[iv + 2]),
                    moment: Vec3::new(drive[iv + 3], drive[iv + 4], drive[iv + 5]),
                };
                let root = inertias[b].solve(known.force - biases[b].force, known.moment - biases[b].moment);
                x[iv..iv + 6].copy_from_slice(&root);
                continue;
            }
            kind => {
                let slides = kind == JointKind::Prismatic;
                let along = if slides { biases[b].force.z } else { biases[b].moment.z };
                let u = drive[iv] - along;
                match body.effects.rotor_inertia {
                    Some(rotor) => inertias[b].free_with_rotor(slides, rotor, u, b),
                    None if slides => inertias[b].free_slide(u, b),
                    None => inertias[b].free_turn(u, b),
                }
            }
        };
        if let Some(parent) = body.parent {
            let bias = biases[b]
                + ForceVector { moment: joint.moment.scale(joint.rate), force: joint.force.scale(joint.rate) };
            biases[parent] = biases[parent] + pose.wrench_to_parent(&bias);
            inertias[parent] = inertias[parent].plus(&freed.in_parent(pose));
        }
        joints[b] = Some(joint);
    }

    let mut accelerations: Vec<MotionVector<T>> = Vec::with_capacity(model.bodies.len());
    let rest = MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("forward", Some(b));
        let iv = body.joint.iv;
        let Some(joint) = &joints[b] else {
            accelerations.push(MotionVector {
                linear: Vec3::new(x[iv], x[iv + 1], x[iv + 2]),
                angular: Vec3::new(x[iv + 3], x[iv + 4], x[iv + 5]),
            });
            continue;
        };
        let pose = &poses[b];
        let parent = body.parent.map_or(&rest, |p| &accelerations[p]);
        let mut angular = pose.to_child(parent.angular);
        let mut linear = pose.to_child(parent.linear + parent.angular.cross(pose.translation));
        if let Some(slide) = pose.slide {
            linear = Vec3::new(linear.x + angular.y * slide, linear.y - angular.x * slide, linear.z);
        }
        // q̈ = u / D − (U / D) · (ε, a) of the body with its joint held
        let qdd = joint.rate - joint.moment_per_inertia.dot(angular) - joint.force_per_inertia.dot(linear);
        let qdd = qdd.named("acceleration", iv, "");
        x[iv] = qdd;
        match body.joint.kind {
            JointKind::Revolute => angular.z = angular.z + qdd,
            _ => linear.z = linear.z + qdd,
        }
        accelerations.push(MotionVector { angular, linear });
    }
    x
}

/// A joint that its drive alone holds: what q̈ = 1 takes, and what it does.
#[derive(Clone, Debug)]
struct FreeJoint<T> {
    /// U, moment part: of the wrench that accelerates the joint by one.
    moment: Vec3<T>,
    /// U, force part.
    force: Vec3<T>,
    /// U / D, moment part.
    moment_per_inertia: Vec3<T>,
    /// U / D, force part.
    force_per_inertia: Vec3<T>,
    /// u / D: q̈ while the parent rests.
    rate: T,
}

/// Articulated inertia about the origin of a frame, in its axes: n = J ε + H a,  f = Hᵀ ε + M a.
#[derive(Clone, Copy, Debug)]
struct ArticulatedInertia<T> {
    /// J \[kg·m²\].
    j: Sym3<T>,
    /// H \[kg·m\].
    h: Mat3<T>,
    /// M \[kg\].
    m: Sym3<T>,
}

impl<T: Real> ArticulatedInertia<T> {
    /// A rigid body: J about the origin, H = \[m c ×\], M = m 1.
    fn of_body(body: &Body<T>) -> Self {
        let (i, o) = (body.total_about_origin(), T::zero());
        ArticulatedInertia {
            j: i.second_moment.second_moment_to_inertia(),
            h: skew(i.first_moment),
            m: Sym3 { xx: i.mass, xy: o, xz: o, yy: i.mass, yz: o, zz: i.mass },
        }
    }

    fn plus(&self, other: &Self) -> Self {
        ArticulatedInertia { j: self.j + other.j, h: self.h + other.h, m: self.m + other.m }
    }

    /// What is felt through a revolute joint about z that is free: I − U Uᵀ / D with U = I z, D = J_zz. Row and column z
    /// vanish, and are not computed.
    fn free_turn(&self, u: T, b: usize) -> (FreeJoint<T>, Self) {
        let (j, h, m, o) = (&self.j, &self.h, &self.m, T::zero());
        let per_inertia = (T::one() / j.zz).named("inverse_inertia", b, "");
        let (n, f) = (Vec3::new(j.xz, j.yz, j.zz), h.row(2));
        let n_d = Vec3::new(n.x * per_inertia, n.y * per_inertia, T::one());
        let f_d = f.scale(per_inertia);
        let freed = ArticulatedInertia {
            j: Sym3 { xx: j.xx - n_d.x * n.x, xy: j.xy - n_d.x * n.y, yy: j.yy - n_d.y * n.y, xz: o, yz: o, zz: o },
            h: Mat3 {
                rows: [
                    (h.row(0) - f.scale(n_d.x)).to_array(),
                    (h.row(1) - f.scale(n_d.y)).to_array(),
                    Vec3::zero().to_array(),
                ],
            },
            m: *m - symmetric_product(f_d, f),
        };
        let joint = FreeJoint {
            moment: n,
            force: f,
            moment_per_inertia: n_d,
            force_per_inertia: f_d,
            rate: (u * per_inertia).named("rate", b, ""),
        };
        (joint, freed)
    }

    /// The same for a joint whose rotor has inertia too: D = J_zz + I, or M_zz + I, and nothing vanishes.
    fn free_with_rotor(&self, slides: bool, rotor: T, u: T, b: usize) -> (FreeJoint<T>, Self) {
        let (j, h, m) = (&self.j, &self.h, &self.m);
        let (n, f, own) = if slides {
            (h.column(2), Vec3::new(m.xz, m.yz, m.zz), m.zz)
        } else {
            (Vec3::new(j.xz, j.yz, j.zz), h.row(2), j.zz)
        };
        let per_inertia = (T::one() / (own + rotor)).named("inverse_inertia", b, "");
        let (n_d, f_d) = (n.scale(per_inertia), f.scale(per_inertia));
        let row = |i: usize, n_d: T| (h.row(i) - f.scale(n_d)).to_array();
        let freed = ArticulatedInertia {
            j: *j - symmetric_product(n_d, n),
            h: Mat3 { rows: [row(0, n_d.x), row(1, n_d.y), row(2, n_d.z)] },
            m: *m - symmetric_product(f_d, f),
        };
        let joint = FreeJoint {
            moment: n,
            force: f,
            moment_per_inertia: n_d,
            force_per_inertia: f_d,
            rate: (u * per_inertia).named("rate", b, ""),
        };
        (joint, freed)
    }

    /// The same for a free prismatic joint along z: D = M_zz; row and column z of the force part vanish.
    fn free_slide(&self, u: T, b: usize) -> (FreeJoint<T>, Self) {
        let (j, h, m, o) = (&self.j, &self.h, &self.m, T::zero());
        let per_inertia = (T::one() / m.zz).named("inverse_inertia", b, "");
        let (n, f) = (h.column(2), Vec3::new(m.xz, m.yz, m.zz));
        let n_d = n.scale(per_inertia);
        let f_d = Vec3::new(f.x * per_inertia, f.y * per_inertia, T::one());
        let freed = ArticulatedInertia {
            j: *j - symmetric_product(n_d, n),
            h: Mat3::from_columns(h.column(0) - n.scale(f_d.x), h.column(1) - n.scale(f_d.y), Vec3::zero()),
            m: Sym3 { xx: m.xx - f_d.x * f.x, xy: m.xy - f_d.x * f.y, yy: m.yy - f_d.y * f.y, xz: o, yz: o, zz: o },
        };
        let joint = FreeJoint {
            moment: n,
            force: f,
            moment_per_inertia: n_d,
            force_per_inertia: f_d,
            rate: (u * per_inertia).named("rate", b, ""),
        };
        (joint, freed)
    }

    /// In the parent's axes, about the parent's origin.
    fn in_parent(&self, pose: &JointPose<T>) -> Self {
        let moved = match (pose.turn, pose.slide) {
            (Some((s, c)), _) => {
                ArticulatedInertia { j: self.j.turned(s, c), h: self.h.turned(s, c), m: self.m.turned(s, c) }
            }
            (None, Some(q)) => self.shifted(Vec3::new(T::zero(), T::zero(), q)),
            (None, None) => *self,
        };
        let e = &pose.placement;
        ArticulatedInertia { j: pose.placed(moved.j), h: *e * moved.h * e.transpose(), m: pose.placed(moved.m) }
            .shifted(pose.translation)
    }

    /// About an origin from which the present one stands at p: with P = \[p×\], H' = H + P M,  J' = J − H P + P H'ᵀ.
    fn shifted(&self, p: Vec3<T>) -> Self {
        let (h, m) = (&self.h, self.m.to_matrix());
        let h_new = *h + Mat3::from_columns(p.cross(m.column(0)), p.cross(m.column(1)), p.cross(m.column(2)));
        // row i of −H P is p × (row i of H), column i of P H'ᵀ is p × (row i of H'); on the diagonal the two meet
        let minus_hp = [0, 1].map(|i| p.cross(h.row(i)));
        let p_ht = [1, 2].map(|i| p.cross(h_new.row(i)));
        let both = [0, 1, 2].map(|i| p.cross(h.row(i) + h_new.row(i)));
        let j = Sym3 {
            xx: self.j.xx + both[0].x,
            xy: self.j.xy + (minus_hp[0].y + p_ht[0].x),
            xz: self.j.xz + (minus_hp[0].z + p_ht[1].x),
            yy: self.j.yy + both[1].y,
            yz: self.j.yz + (minus_hp[1].z + p_ht[1].y),
            zz: self.j.zz + both[2].z,
        };
        ArticulatedInertia { j, h: h_new, m: self.m }
    }

    /// (a, ε) of a free body under the force f and the moment n: a dense L D Lᵀ of six. Positive definite, so no
    /// pivoting; the pivots are inertias as above.
    fn solve(&self, f: Vec3<T>, n: Vec3<T>) -> [T; 6] {
        let (j, h, m) = (self.j.to_matrix(), &self.h, self.m.to_matrix());
        let mut a = [[T::zero(); 6]; 6];
        for r in 0..3 {
            for c in 0..3 {
                a[r][c] = m.rows[r][c];
                a[r + 3][c] = h.rows[r][c];
                a[r + 3][c + 3] = j.rows[r][c];
            }
        }
        let mut x = [f.x, f.y, f.z, n.x, n.y, n.z];
        let mut inverse_pivots = [T::zero(); 6];
        for k in 0..6 {
            inverse_pivots[k] = T::one() / a[k][k];
            let column = a.map(|row| row[k]); // L D
            for r in k + 1..6 {
                let factor = column[r] * inverse_pivots[k];
                for (entry, &below) in a[r][k + 1..=r].iter_mut().zip(&column[k + 1..]) {
                    *entry = *entry - factor * below;
                }
                x[r] = x[r] - factor * x[k];
            }
        }
        // a holds L D below the diagonal
        for k in (0..6).rev() {
            for r in k + 1..6 {
                x[k] = x[k] - a[r][k] * x[r];
            }
            x[k] = x[k] * inverse_pivots[k];
        }
        x
    }
}

/// \[v×\].
fn skew<T: Real>(v: Vec3<T>) -> Mat3<T> {
    let o = T::zero();
    Mat3 { rows: [[o, -v.z, v.y], [v.z, o, -v.x], [-v.y, v.x, o]] }
}

/// a bᵀ of two parallel vectors.
fn symmetric_product<T: Real>(a: Vec3<T>, b: Vec3<T>) -> Sym3<T> {
    Sym3 { xx: a.x * b.x, xy: a.x * b.y, xz: a.x * b.z, yy: a.y * b.y, yz: a.y * b.z, zz: a.z * b.z }
}
