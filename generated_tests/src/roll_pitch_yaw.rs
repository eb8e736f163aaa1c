//! Roll, pitch and yaw as robot files give them, read without the compiler; tests of other packages take this file, too.

use nalgebra::Matrix3;
use straightline_core::Dd;

/// R = Rz(yaw) Ry(pitch) Rx(roll), angles in rad.
pub fn rotation(rpy: [f64; 3]) -> Matrix3<Dd> {
    let [(sr, cr), (sp, cp), (sy, cy)] = rpy.map(|a| Dd::from(a).sin_cos());
    let (o, i) = (Dd::ZERO, Dd::ONE);
    let x = Matrix3::new(i, o, o, o, cr, -sr, o, sr, cr);
    let y = Matrix3::new(cp, o, sp, o, i, o, -sp, o, cp);
    let z = Matrix3::new(cy, -sy, o, sy, cy, o, o, o, i);
    z * y * x
}
