//! Parts that are fixed to each other, as one body.

use super::geometry::{magnitude, point, snap_tensor, snap_vector};
use straightline_core::spatial::{SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::Dd;

/// What a link adds to its body, in the body's canonical frame.
pub(crate) struct Part {
    /// \[kg\].
    pub mass: Dd,
    /// Centre of mass \[m\].
    pub com: Vec3<Dd>,
    /// Inertia tensor about the centre of mass \[kg·m²\].
    pub inertia_com: Sym3<Dd>,
}

impl Part {
    /// Mass, centre of mass and inertia about it in a frame whose pose in the body's is given.
    pub fn placed(mass: Dd, com: Vec3<Dd>, inertia_com: Sym3<Dd>, x_body_part: &Transform<Dd>) -> Part {
        let inertia_com = snap_tensor(inertia_com.rotated(&x_body_part.rotation));
        Part { mass, com: point(x_body_part, com), inertia_com }
    }

    /// A body as it is.
    pub fn of(inertia: &SpatialInertia<Dd>) -> Part {
        Part { mass: inertia.mass, com: inertia.com, inertia_com: inertia.inertia_com }
    }
}

/// The inertia of parts that are fixed to each other: centres of mass weighed, tensors by the parallel-axis theorem
/// J = Σ J_i + m_i (d_i·d_i 1 − d_i d_iᵀ), d_i from the common centre of mass to that of part i.
pub(crate) fn merge(parts: &[Part]) -> SpatialInertia<Dd> {
    let massive: Vec<&Part> = parts.iter().filter(|p| p.mass != Dd::ZERO).collect();
    let mass = massive.iter().fold(Dd::ZERO, |sum, p| sum + p.mass);
    let com = match massive[..] {
        [] => parts.first().map_or(Vec3::zero(), |p| p.com),
        [single] => single.com,
        _ => {
            let scale = massive.iter().map(|p| magnitude(p.com)).fold(0.0, f64::max);
            let moment = massive.iter().fold(Vec3::zero(), |sum, p| sum + p.com.scale(p.mass));
            snap_vector(moment.map(|x| x / mass), scale)
        }
    };
    let mut inertia = parts.iter().fold(Sym3::zero(), |sum, p| sum + p.inertia_com);
    if massive.len() > 1 {
        for part in massive {
            let d = part.com - com;
            let m = part.mass;
            inertia = inertia
                + Sym3 {
                    xx: m * (d.y * d.y + d.z * d.z),
                    xy: -(m * d.x * d.y),
                    xz: -(m * d.x * d.z),
                    yy: m * (d.x * d.x + d.z * d.z),
                    yz: -(m * d.y * d.z),
                    zz: m * (d.x * d.x + d.y * d.y),
                };
        }
    }
    SpatialInertia::new(mass, com, snap_tensor(inertia))
}
