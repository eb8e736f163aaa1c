//! Types of run-time parameters: the ten inertial parameters of a body, checked when they are made.

use super::{FunctionText, Scalar};
use crate::identifier::doc;
use std::fmt::Write;

/// The error type and the check that all parameters of a file share.
pub fn check(scalar: Scalar) -> String {
    CHECK.replace("f64", scalar.name())
}

const CHECK: &str = "
/// Why inertial parameters cannot belong to a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unphysical {
    /// A number is not finite.
    NotFinite,
    /// The mass is negative.
    NegativeMass,
    /// There is inertia, and no mass to have it.
    InertiaWithoutMass,
    /// The inertia about the mass centre belongs to no distribution of mass: a principal moment is negative, or exceeds the
    /// sum of the other two.
    Inertia,
}

impl core::fmt::Display for Unphysical {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Unphysical::NotFinite => \"an inertial parameter is not finite\",
            Unphysical::NegativeMass => \"a mass is negative\",
            Unphysical::InertiaWithoutMass => \"a body without mass has inertia\",
            Unphysical::Inertia => \"a principal moment of inertia is negative or exceeds the sum of the other two\",
        })
    }
}

/// A body is possible if its mass is not negative and its second moment ½ tr(J) 1 − J about the mass centre has no negative
/// eigenvalue; a rounding error of the trace is forgiven.
fn check_inertia(mass: f64, com: &[f64; 3], inertia: &[f64; 6]) -> Result<(), Unphysical> {
    let [jxx, jxy, jxz, jyy, jyz, jzz] = *inertia;
    if ![mass, com[0], com[1], com[2], jxx, jxy, jxz, jyy, jyz, jzz].iter().all(|x| x.is_finite()) {
        return Err(Unphysical::NotFinite);
    }
    if mass < 0.0 {
        return Err(Unphysical::NegativeMass);
    }
    if mass == 0.0 && inertia.iter().any(|x| *x != 0.0) {
        return Err(Unphysical::InertiaWithoutMass);
    }
    let half = 0.5 * (jxx + jyy + jzz);
    let slack = 16.0 * f64::EPSILON * half;
    let (a, b, c) = (half - jxx + slack, half - jyy + slack, half - jzz + slack);
    let (d, e, f) = (-jxy, -jxz, -jyz);
    let minors = [a * b - d * d, a * c - e * e, b * c - f * f];
    let determinant = a * minors[2] - d * (d * c - f * e) + e * (d * f - b * e);
    let possible = a >= 0.0 && b >= 0.0 && c >= 0.0 && minors.iter().all(|m| *m >= 0.0);
    if possible && determinant >= -slack * half * half {
        Ok(())
    } else {
        Err(Unphysical::Inertia)
    }
}
";

/// The type of one parameter; `constructor` is the program that brings it into the frames of the equations.
pub fn parameter(
    name: &str,
    type_name: &str,
    frame: &str,
    scalars: usize,
    constructor: &FunctionText,
    scalar: Scalar,
) -> String {
    let t = scalar.name();
    let frame = doc(frame);
    let mut out = String::new();
    let _ = write!(
        out,
        "
/// A body on `{frame}`, as the functions take it: made outside the control loop, checked once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct {type_name}([{t}; {scalars}]);

impl {type_name} {{
    /// No mass at all.
    pub const NONE: {type_name} = {type_name}([0.0; {scalars}]);

    /// A body of this mass \\[kg\\], with its mass centre \\[m\\] in the frame `{frame}` and this inertia about the mass centre
    /// in the frame's axes: xx, xy, xz, yy, yz, zz \\[kg·m²\\].
    ///
    /// # Errors
    /// No body has such parameters.
    pub fn new(mass: {t}, com: [{t}; 3], inertia: [{t}; 6]) -> Result<{type_name}, Unphysical> {{
        check_inertia(mass, &com, &inertia)?;
        let mut parameters = [mass; {scalars}];
        {name}_parameters(&[mass], &com, &inertia, &mut parameters);
        Ok({type_name}(parameters))
    }}
}}

"
    );
    out.push_str(&constructor.text.replacen("pub fn ", "fn ", 1));
    out
}
