//! Articulated inertias: what a body and the joints beyond it, all free, are to a force (Featherstone 2008, chapter 7).

use super::JointPose;
use crate::real::Real;
use crate::spatial::{symmetric_product, Composite, ForceVector, Mat3, MotionVector, Sym3, Vec3};

/// A coordinate of a joint that its drive alone holds: what q̈ = 1 takes, and what it does.
#[derive(Clone, Debug)]
pub(crate) struct FreeJoint<T> {
    /// U, moment part: of the wrench that accelerates the joint by one.
    pub moment: Vec3<T>,
    /// U, force part.
    pub force: Vec3<T>,
    /// U / D, moment part.
    pub moment_per_inertia: Vec3<T>,
    /// U / D, force part.
    pub force_per_inertia: Vec3<T>,
    /// u / D: q̈ while the parent rests.
    pub rate: T,
}

impl<T> FreeJoint<T> {
    /// From U and U / D, moments first, and u / D.
    pub fn new([moment, force]: [Vec3<T>; 2], per_inertia: [Vec3<T>; 2], rate: T) -> Self {
        let [moment_per_inertia, force_per_inertia] = per_inertia;
        FreeJoint { moment, force, moment_per_inertia, force_per_inertia, rate }
    }
}

/// Articulated inertia about the origin of a frame, in its axes: n = J ε + H a,  f = Hᵀ ε + M a.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ArticulatedInertia<T> {
    /// J \[kg·m²\].
    pub j: Sym3<T>,
    /// H \[kg·m\].
    pub h: Mat3<T>,
    /// M \[kg\].
    pub m: Sym3<T>,
}

impl<T: Real> ArticulatedInertia<T> {
    /// A rigid body: J about the origin, H = \[m c ×\], M = m 1.
    pub fn of_body(i: &Composite<T>) -> Self {
        let o = T::zero();
        ArticulatedInertia {
            j: i.second_moment.second_moment_to_inertia(),
            h: skew(i.first_moment),
            m: Sym3 { xx: i.mass, xy: o, xz: o, yy: i.mass, yz: o, zz: i.mass },
        }
    }

    /// Both on one body.
    pub fn plus(&self, other: &Self) -> Self {
        ArticulatedInertia { j: self.j + other.j, h: self.h + other.h, m: self.m + other.m }
    }

    /// The wrench that this acceleration takes.
    pub fn wrench_of(&self, a: &MotionVector<T>) -> ForceVector<T> {
        ForceVector {
            moment: self.j * a.angular + self.h * a.linear,
            force: self.h.transpose_mul(a.angular) + self.m * a.linear,
        }
    }

    /// What is felt through a joint that is free on a coordinate: I − U Uᵀ / D, where U accelerates the coordinate by one and D, the rotor
    /// included, is what the drive feels of that. `u` is what the drive does against the wrench on the body.
    pub fn free(&self, wrench: ForceVector<T>, inertia: T, u: T, b: usize) -> (FreeJoint<T>, Self) {
        let (j, h, m) = (&self.j, &self.h, &self.m);
        let ForceVector { moment: n, force: f } = wrench;
        let per_inertia = (T::one() / inertia).named("inverse_inertia", b, "");
        let (n_d, f_d) = (n.scale(per_inertia), f.scale(per_inertia));
        let row = |i: usize, n_d: T| (h.row(i) - f.scale(n_d)).to_array();
        let freed = ArticulatedInertia {
            j: *j - symmetric_product(n_d, n),
            h: Mat3 { rows: [row(0, n_d.x), row(1, n_d.y), row(2, n_d.z)] },
            m: *m - symmetric_product(f_d, f),
        };
        (FreeJoint::new([n, f], [n_d, f_d], (u * per_inertia).named("rate", b, "")), freed)
    }

    /// In the parent's axes, about the parent's origin.
    pub fn in_parent(&self, pose: &JointPose<T>) -> Self {
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
    pub fn solve(&self, f: Vec3<T>, n: Vec3<T>) -> [T; 6] {
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
