//! 3×3 matrices, general and symmetric.

use super::Vec3;
use crate::dd::Dd;
use crate::operators::operators;
use crate::real::Real;
use core::ops::Mul;

/// A 3×3 matrix, by rows. A rotation `r_ab` turns components in frame b into components in frame a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<T> {
    /// From above.
    pub rows: [[T; 3]; 3],
}

impl<T: Real> Mat3<T> {
    /// The unit matrix.
    pub fn identity() -> Self {
        let (o, i) = (T::zero(), T::one());
        Mat3 { rows: [[i, o, o], [o, i, o], [o, o, i]] }
    }

    /// R_z: the turn about z by the angle with this sine and cosine.
    pub fn about_z(sin: T, cos: T) -> Self {
        let (o, i) = (T::zero(), T::one());
        Mat3 { rows: [[cos, -sin, o], [sin, cos, o], [o, o, i]] }
    }

    /// A matrix from its columns.
    pub fn from_columns(a: Vec3<T>, b: Vec3<T>, c: Vec3<T>) -> Self {
        Mat3 { rows: [[a.x, b.x, c.x], [a.y, b.y, c.y], [a.z, b.z, c.z]] }
    }

    /// a bᵀ.
    pub fn outer(a: Vec3<T>, b: Vec3<T>) -> Self {
        Mat3::from_columns(a.scale(b.x), a.scale(b.y), a.scale(b.z))
    }

    /// Column `j`.
    pub fn column(&self, j: usize) -> Vec3<T> {
        Vec3::new(self.rows[0][j], self.rows[1][j], self.rows[2][j])
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> Vec3<T> {
        Vec3::from(self.rows[i])
    }

    /// The transpose.
    #[must_use]
    pub fn transpose(&self) -> Self {
        Mat3 { rows: [self.column(0).to_array(), self.column(1).to_array(), self.column(2).to_array()] }
    }

    /// `selfᵀ v`.
    pub fn transpose_mul(&self, v: Vec3<T>) -> Vec3<T> {
        Vec3::new(self.column(0).dot(v), self.column(1).dot(v), self.column(2).dot(v))
    }

    /// R_z A R_zᵀ: turned about z by the angle with this sine and cosine. The upper left block splits into its trace and
    /// its skew part, which stay, and a deviator, which one number e turns: 12 multiplications in all.
    #[must_use]
    pub fn turned(&self, sin: T, cos: T) -> Self {
        let [[a, b, xz], [c, d, yz], [zx, zy, zz]] = self.rows;
        let e = (a - d) * cos - (b + c) * sin;
        let (along, across) = (e * cos, e * sin);
        let column = Vec3::new(xz, yz, zz).turned(sin, cos);
        let row = Vec3::new(zx, zy, zz).turned(sin, cos);
        Mat3 { rows: [[d + along, b + across, column.x], [c + across, a - along, column.y], [row.x, row.y, zz]] }
    }

    /// Every entry through `f`.
    pub fn map<U>(&self, mut f: impl FnMut(T) -> U) -> Mat3<U> {
        Mat3 { rows: self.rows.map(|r| r.map(&mut f)) }
    }
}

impl<T: Real> Mul<Vec3<T>> for Mat3<T> {
    type Output = Vec3<T>;
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        Vec3::new(self.row(0).dot(v), self.row(1).dot(v), self.row(2).dot(v))
    }
}

operators! { [T: Real] Mat3<T>:
    Mul mul |a, b| Mat3::from_columns(a * b.column(0), a * b.column(1), a * b.column(2));
    Add add |a, b| Mat3::from_columns(a.column(0) + b.column(0), a.column(1) + b.column(1), a.column(2) + b.column(2));
}

/// A symmetric 3×3 matrix: an inertia tensor or a second moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sym3<T> {
    /// Entry (0, 0).
    pub xx: T,
    /// Entries (0, 1) and (1, 0).
    pub xy: T,
    /// Entries (0, 2) and (2, 0).
    pub xz: T,
    /// Entry (1, 1).
    pub yy: T,
    /// Entries (1, 2) and (2, 1).
    pub yz: T,
    /// Entry (2, 2).
    pub zz: T,
}

impl<T: Real> Sym3<T> {
    /// The null matrix.
    pub fn zero() -> Self {
        let o = T::zero();
        Sym3 { xx: o, xy: o, xz: o, yy: o, yz: o, zz: o }
    }

    /// Every entry through `f`.
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> Sym3<U> {
        Sym3 { xx: f(self.xx), xy: f(self.xy), xz: f(self.xz), yy: f(self.yy), yz: f(self.yz), zz: f(self.zz) }
    }

    /// See [`Real::named`].
    #[must_use]
    pub fn named(self, name: &'static str, index: usize) -> Self {
        Sym3 {
            xx: self.xx.named(name, index, "xx"),
            xy: self.xy.named(name, index, "xy"),
            xz: self.xz.named(name, index, "xz"),
            yy: self.yy.named(name, index, "yy"),
            yz: self.yz.named(name, index, "yz"),
            zz: self.zz.named(name, index, "zz"),
        }
    }

    /// The full matrix.
    pub fn to_matrix(self) -> Mat3<T> {
        Mat3 { rows: [[self.xx, self.xy, self.xz], [self.xy, self.yy, self.yz], [self.xz, self.yz, self.zz]] }
    }

    /// The upper triangle of a matrix that is symmetric.
    pub fn from_matrix(m: &Mat3<T>) -> Self {
        let r = &m.rows;
        Sym3 { xx: r[0][0], xy: r[0][1], xz: r[0][2], yy: r[1][1], yz: r[1][2], zz: r[2][2] }
    }

    /// `R self Rᵀ`, for a rotation R = r_ab: from frame b to frame a.
    #[must_use]
    pub fn rotated(self, r_ab: &Mat3<T>) -> Self {
        Sym3::from_matrix(&(*r_ab * self.to_matrix() * r_ab.transpose()))
    }

    /// R_z self R_zᵀ: turned about z by the angle with this sine and cosine. The upper left block is its trace, which
    /// stays, and a deviator, which one number e turns: 8 multiplications in all.
    #[must_use]
    pub fn turned(self, sin: T, cos: T) -> Self {
        let e = (self.xx - self.yy) * cos - (self.xy + self.xy) * sin;
        let along = e * cos;
        let z = Vec3::new(self.xz, self.yz, self.zz).turned(sin, cos);
        Sym3 { xx: self.yy + along, xy: self.xy + e * sin, xz: z.x, yy: self.xx - along, yz: z.y, zz: self.zz }
    }

    /// Second moment Σ = ½ tr(J) 1 − J of an inertia tensor J about the same point; Σ = ∫ x xᵀ dm.
    #[must_use]
    pub fn inertia_to_second_moment(self) -> Self {
        let half_trace = (self.xx + self.yy + self.zz) * T::constant(Dd::HALF);
        Sym3 {
            xx: half_trace - self.xx,
            xy: -self.xy,
            xz: -self.xz,
            yy: half_trace - self.yy,
            yz: -self.yz,
            zz: half_trace - self.zz,
        }
    }

    /// Inertia tensor J = tr(Σ) 1 − Σ of a second moment Σ about the same point.
    #[must_use]
    pub fn second_moment_to_inertia(self) -> Self {
        Sym3 {
            xx: self.yy + self.zz,
            xy: -self.xy,
            xz: -self.xz,
            yy: self.xx + self.zz,
            yz: -self.yz,
            zz: self.xx + self.yy,
        }
    }
}

impl<T: Real> Mul<Vec3<T>> for Sym3<T> {
    type Output = Vec3<T>;
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        self.to_matrix() * v
    }
}

operators! { [T: Real] Sym3<T>:
    Add add |a, b| Sym3 {
        xx: a.xx + b.xx, xy: a.xy + b.xy, xz: a.xz + b.xz,
        yy: a.yy + b.yy, yz: a.yz + b.yz, zz: a.zz + b.zz,
    };
    Sub sub |a, b| Sym3 {
        xx: a.xx - b.xx, xy: a.xy - b.xy, xz: a.xz - b.xz,
        yy: a.yy - b.yy, yz: a.yz - b.yz, zz: a.zz - b.zz,
    };
}
