//! Solids of uniform density: volume, and principal moments about the centre per mass, in closed form.
//!
//! Lengths are as MJCF has them: radii and half lengths, the axis along z.

use straightline_core::Dd;

/// A solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Solid {
    /// Radius.
    Sphere,
    /// Radius and half length of the cylinder between both half spheres.
    Capsule,
    /// Radius and half length.
    Cylinder,
    /// Half lengths.
    Box,
    /// Half axes.
    Ellipsoid,
}

impl Solid {
    /// The solid that a word means.
    pub fn of_word(word: &str) -> Option<Solid> {
        Some(match word {
            "sphere" => Solid::Sphere,
            "capsule" => Solid::Capsule,
            "cylinder" => Solid::Cylinder,
            "box" => Solid::Box,
            "ellipsoid" => Solid::Ellipsoid,
            _ => return None,
        })
    }

    /// How many numbers its size has.
    pub fn sizes(self) -> usize {
        match self {
            Solid::Sphere => 1,
            Solid::Capsule | Solid::Cylinder => 2,
            Solid::Box | Solid::Ellipsoid => 3,
        }
    }

    /// Volume \[m³\], and principal moments per mass \[m²\].
    pub fn of_size(self, size: [Dd; 3]) -> (Dd, [Dd; 3]) {
        let [a, b, c] = size;
        let n = |x: f64| Dd::from(x);
        let ball = n(4.0) / n(3.0) * Dd::PI; // volume of the unit ball
        match self {
            // V = 4/3 π r³, J/m = 2/5 r²
            Solid::Sphere => (ball * a * a * a, [n(2.0) / n(5.0) * a * a; 3]),
            // V = 8 a b c, J/m = (b² + c²)/3
            Solid::Box => (n(8.0) * a * b * c, sums([a, b, c], n(3.0))),
            // V = 4/3 π a b c, J/m = (b² + c²)/5
            Solid::Ellipsoid => (ball * a * b * c, sums([a, b, c], n(5.0))),
            // V = 2 π r² h, J/m = r²/4 + h²/3 across and r²/2 along
            Solid::Cylinder => {
                let across = a * a / n(4.0) + b * b / n(3.0);
                (n(2.0) * Dd::PI * a * a * b, [across, across, a * a / n(2.0)])
            }
            Solid::Capsule => capsule(a, b),
        }
    }
}

/// A cylinder of radius r and half length h between two half balls, whose centres of mass are 3/8 r beyond its ends:
/// of the ball about its own centre 2/5 m r², moved apart by h it is m (2/5 r² + h² + 3/4 h r) across.
fn capsule(r: Dd, h: Dd) -> (Dd, [Dd; 3]) {
    let n = |x: f64| Dd::from(x);
    let cylinder = n(2.0) * h; // volumes per π r²
    let balls = n(4.0) / n(3.0) * r;
    let whole = cylinder + balls;
    let of_ball = n(2.0) / n(5.0) * r * r;
    let across = cylinder * (r * r / n(4.0) + h * h / n(3.0)) + balls * (of_ball + h * h + n(0.75) * h * r);
    let along = cylinder * r * r / n(2.0) + balls * of_ball;
    (Dd::PI * r * r * whole, [across / whole, across / whole, along / whole])
}

/// (b² + c²)/n, (c² + a²)/n, (a² + b²)/n.
fn sums([a, b, c]: [Dd; 3], n: Dd) -> [Dd; 3] {
    [(b * b + c * c) / n, (c * c + a * a) / n, (a * a + b * b) / n]
}
