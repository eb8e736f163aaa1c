//! Inertia as a solid that one can see: the ellipsoid of uniform density that has the same mass, centre of mass and inertia as a body.
//!
//! A solid ellipsoid of mass m with the semi-axes a, b, c has the second moments Σ = m/5 diag(a², b², c²) about its centre, and
//! Σ = ½ tr(J) 1 − J. So along the principal axis of I₁ its semi-axis is a = √(5/(2m) (I₂ + I₃ − I₁)). Inertia that no rigid body can have
//! has no such root: that semi-axis is zero, and the ellipsoid is seen to be flat.

use nalgebra::{Matrix3, Rotation3, SymmetricEigen, UnitQuaternion};
use straightline_core::model::Body;
use straightline_core::spatial::{SpatialInertia, Sym3, Vec3};

/// A solid ellipsoid, in the canonical frame of its body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertiaEllipsoid {
    /// Its centre, which is the centre of mass \[m\].
    pub center: [f64; 3],
    /// The turn from its principal axes to those of the body: unit quaternion x, y, z, w.
    pub turn: [f64; 4],
    /// Semi-axes \[m\], none negative.
    pub semi_axes: [f64; 3],
}

/// The ellipsoid of a body with all that it carries; `None` where there is no mass.
pub fn inertia_ellipsoid(body: &Body<f64>) -> Option<InertiaEllipsoid> {
    let total = body.total_about_origin();
    // Σ_c = Σ_o − m c cᵀ
    let (m, c) = (total.mass, total.first_moment.scale(1.0 / total.mass));
    let of_point = |a: f64, b: f64| m * a * b;
    let s = total.second_moment;
    let second = match body.load {
        // nothing cancels
        None => body.inertia.second_moment_com,
        Some(_) => Sym3 {
            xx: s.xx - of_point(c.x, c.x),
            xy: s.xy - of_point(c.x, c.y),
            xz: s.xz - of_point(c.x, c.z),
            yy: s.yy - of_point(c.y, c.y),
            yz: s.yz - of_point(c.y, c.z),
            zz: s.zz - of_point(c.z, c.z),
        },
    };
    // not a number is no mass, too
    (m > 0.0 && m.is_finite()).then(|| of_second_moment(m, c, second)).filter(is_finite)
}

fn is_finite(of: &InertiaEllipsoid) -> bool {
    of.center.iter().chain(&of.turn).chain(&of.semi_axes).all(|x| x.is_finite())
}

fn of_second_moment(m: f64, c: Vec3<f64>, s: Sym3<f64>) -> InertiaEllipsoid {
    let matrix = Matrix3::new(s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz);
    let eigen = SymmetricEigen::new(matrix);
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    // Σ₁ = m a² / 5
    let semi_axis = |k: usize| (5.0 * eigen.eigenvalues[k].max(0.0) / m).sqrt();
    InertiaEllipsoid {
        center: c.to_array(),
        turn: [turn.i, turn.j, turn.k, turn.w],
        semi_axes: [0, 1, 2].map(semi_axis),
    }
}

impl InertiaEllipsoid {
    /// The inertia of this ellipsoid with a uniform density that adds up to `mass` \[kg\], in the axes of the body.
    pub fn inertia(&self, mass: f64) -> SpatialInertia<f64> {
        let [a, b, c] = self.semi_axes.map(|x| x * x);
        let principal = Matrix3::from_diagonal(&[b + c, c + a, a + b].map(|x| mass / 5.0 * x).into());
        let [x, y, z, w] = self.turn;
        let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z)).to_rotation_matrix();
        let j = turn.matrix() * principal * turn.matrix().transpose();
        let tensor = Sym3 { xx: j[(0, 0)], xy: j[(0, 1)], xz: j[(0, 2)], yy: j[(1, 1)], yz: j[(1, 2)], zz: j[(2, 2)] };
        SpatialInertia::new(mass, Vec3::from(self.center), tensor)
    }
}
