//! Angles: which are taken as multiples of a right angle, and rotations made of them.
//!
//! An angle in radians is a rounded number: `1.5707963267948966` is π/2 up to 6e-17, `1.5707` up to 1e-4. Within the
//! tolerance (by default [`ROUNDING`]) of a multiple of π/4 or π/6 it is taken as that; otherwise literally.

use super::geometry::{about, snap_rotation, unit, vector};
use crate::description::{Angle, AngleUnit, Rotation, WrittenPose, WrittenTurn};
use straightline_core::spatial::{Mat3, Transform, Vec3};
use straightline_core::Dd;

/// The default tolerance \[rad\]: what the nearest f64 of a few turns can be off.
pub const ROUNDING: f64 = 1e-15;
/// So near to a right angle \[rad\] an angle is doubtful.
pub const DOUBTFUL: f64 = 1e-3;
/// Greater angles \[rad\] are not computed with.
pub const GREATEST_ANGLE: f64 = 1e6;

/// How an angle was understood.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// Sine and cosine of what it is taken as.
    pub sin_cos: (Dd, Dd),
    /// The multiple of π/12 that it is taken as.
    pub special: Option<i64>,
    /// The nearest multiple of π/2.
    pub right_angles: i64,
    /// Distance of the written angle from `special`, or else from `right_angles` \[rad\].
    pub deviation: f64,
}

impl Reading {
    /// Whether a right angle may be meant, and is not what it is taken as.
    pub fn is_doubtful(&self) -> bool {
        self.special.is_none() && self.deviation.abs() <= DOUBTFUL
    }
}

/// Twelfths of π in one unit, where that is a whole number.
fn twelfths(angle: &Angle) -> Option<i64> {
    // the remainder of a floating-point division is exact
    let (full_turn, per_twelfth) = match angle.unit {
        AngleUnit::Radian => return (angle.value == 0.0).then_some(0),
        AngleUnit::Degree => (360.0, 1.0 / 15.0),
        AngleUnit::QuarterTurn => (4.0, 6.0),
        AngleUnit::Turn => (1.0, 24.0),
    };
    let rest = angle.value % full_turn;
    let twelfths = match angle.unit {
        AngleUnit::Degree => (rest % 15.0 == 0.0).then_some(rest / 15.0)?,
        _ => rest * per_twelfth,
    };
    (twelfths.fract() == 0.0).then_some(twelfths as i64)
}

/// The angle in radians.
pub(crate) fn radians(angle: &Angle) -> Dd {
    let x = Dd::from(angle.value);
    match angle.unit {
        AngleUnit::Radian => x,
        AngleUnit::Degree => x * Dd::PI / Dd::from(180.0),
        AngleUnit::QuarterTurn => x * Dd::FRAC_PI_2,
        AngleUnit::Turn => x * (Dd::PI + Dd::PI),
    }
}

/// Reads an angle.
pub(crate) fn read(angle: &Angle, tolerance: f64) -> Reading {
    let x = radians(angle);
    if x.to_f64().is_nan() || x.to_f64().abs() > GREATEST_ANGLE {
        // an error of its own, and nothing that an integer could count
        return Reading { sin_cos: (Dd::ZERO, Dd::ONE), special: None, right_angles: 0, deviation: f64::INFINITY };
    }
    let is_special = |m: i64| m % 2 == 0 || m % 3 == 0;
    let twelfth = Dd::PI / Dd::from(12.0);
    let off = |m: i64| (x - twelfth * Dd::from(m as f64)).to_f64();
    let right_angles = (x / Dd::FRAC_PI_2).to_f64().round() as i64;
    if let Some(m) = twelfths(angle).filter(|&m| is_special(m)) {
        return Reading { sin_cos: sin_cos_of_twelfths(m), special: Some(m), right_angles, deviation: 0.0 };
    }
    let nearest = (x / twelfth).to_f64().round() as i64;
    if is_special(nearest) && off(nearest).abs() <= tolerance {
        let sin_cos = sin_cos_of_twelfths(nearest);
        return Reading { sin_cos, special: Some(nearest), right_angles, deviation: off(nearest) };
    }
    Reading { sin_cos: x.sin_cos(), special: None, right_angles, deviation: off(6 * right_angles) }
}

/// sin and cos of m π/12, m a multiple of 2 or 3.
fn sin_cos_of_twelfths(m: i64) -> (Dd, Dd) {
    fn sin(m: i64) -> Dd {
        match m.rem_euclid(24) {
            m @ 13..=23 => -sin(m - 12),
            m @ 7..=12 => sin(12 - m),
            0 => Dd::ZERO,
            2 => Dd::HALF,
            3 => Dd::HALF.sqrt(),
            4 => Dd::from(0.75).sqrt(),
            6 => Dd::ONE,
            m => unreachable!("{m} twelfths of π are no special angle"),
        }
    }
    (sin(m), sin(m + 6))
}

/// `m π/12` in words: `π/2`, `-3π/4`.
pub(crate) fn name_of_twelfths(m: i64) -> String {
    if m == 0 {
        return "0".to_string();
    }
    let divisor = [1, 2, 3, 4, 6].into_iter().find(|d| (m * d) % 12 == 0).unwrap_or(12);
    let times = m * divisor / 12;
    let sign = if times < 0 { "-" } else { "" };
    let times = match times.abs() {
        1 => String::new(),
        n => n.to_string(),
    };
    let over = if divisor == 1 { String::new() } else { format!("/{divisor}") };
    format!("{sign}{times}π{over}")
}

/// What an angle is taken as \[rad\].
pub(crate) fn in_radians(angle: &Angle, tolerance: f64) -> Dd {
    match read(angle, tolerance).special {
        Some(m) => Dd::PI * Dd::from(m as f64) / Dd::from(12.0),
        None => radians(angle),
    }
}

/// The f64 nearest to the angle of a point (x, y) from the x axis \[rad\], as `y.atan2(x)`, of which libraries of the machines differ in the last
/// bit: here all have the same.
///
/// tan(θ − θ₀) = (y cos θ₀ − x sin θ₀) / (x cos θ₀ + y sin θ₀) in double-double, three times: of an error e each step leaves e³/3, of the 0.004
/// that the first guess is off at most less than 10⁻²³ after two.
pub(crate) fn of_point(y: f64, x: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let (shorter, longer) = (y.abs().min(x.abs()), y.abs().max(x.abs()));
    let ratio = if shorter == 0.0 { 0.0 } else { shorter / longer };
    // arc tangent from 0 to 1
    let in_octant = ratio * (FRAC_PI_4 + 0.273 * (1.0 - ratio));
    let in_quarter = if y.abs() > x.abs() { FRAC_PI_2 - in_octant } else { in_octant };
    let in_half = if x.is_sign_negative() { PI - in_quarter } else { in_quarter };
    let mut angle = Dd::from(in_half.copysign(y));
    let (y, x) = (Dd::from(y), Dd::from(x));
    for _ in 0..3 {
        let (sin, cos) = angle.sin_cos();
        let along = x * cos + y * sin;
        // of the point at the origin there is no angle
        if along.to_f64() != 0.0 {
            angle += (y * cos - x * sin) / along;
        }
    }
    angle.to_f64()
}

/// A pose in numbers.
pub(crate) fn transform(pose: &WrittenPose, tolerance: f64) -> Transform<Dd> {
    Transform { rotation: rotation(&pose.rotation, tolerance), translation: vector(pose.xyz.value) }
}

/// The matrix of a rotation as written.
pub(crate) fn rotation(rotation: &Rotation, tolerance: f64) -> Mat3<Dd> {
    match rotation {
        Rotation::RollPitchYaw(rpy) => roll_pitch_yaw(rpy, tolerance),
        Rotation::Turns(turns) => {
            turns.iter().fold(Mat3::identity(), |product, turn| snap_rotation(product * turned(turn, tolerance)))
        }
    }
}

/// The matrix of one turn. A vector without a direction, of which readers complain, turns nothing.
fn turned(turn: &WrittenTurn, tolerance: f64) -> Mat3<Dd> {
    let matrix = match turn {
        WrittenTurn::About { axis, angle } => {
            unit(vector(axis.value)).map(|e| about(e, read(angle, tolerance).sin_cos))
        }
        WrittenTurn::Quaternion(q) => quaternion(q.value),
        WrittenTurn::Axes(axes) => {
            let [x, y] = axes.value.map(vector);
            unit(x).and_then(|x| {
                let z = unit(x.cross(y))?;
                Some(Mat3::from_columns(x, z.cross(x), z))
            })
        }
        WrittenTurn::ZTo(direction) => unit(vector(direction.value)).map(z_to),
    };
    snap_rotation(matrix.unwrap_or_else(Mat3::identity))
}

/// R of a quaternion of any length: no root is taken, so that entries which are 0 or ±1 come out as that.
fn quaternion(q: [f64; 4]) -> Option<Mat3<Dd>> {
    let greatest = q.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    if greatest < 1e-100 {
        return None;
    }
    let [w, x, y, z] = q.map(|x| Dd::from(x) / Dd::from(greatest));
    let square = w * w + x * x + y * y + z * z; // between 1 and 4
    let twice = |a: Dd| (a + a) / square;
    let row = |own: Dd, a: Dd, b: Dd| (w * w + own * own - a * a - b * b) / square;
    Some(Mat3 {
        rows: [
            [row(x, y, z), twice(x * y - w * z), twice(x * z + w * y)],
            [twice(x * y + w * z), row(y, x, z), twice(y * z - w * x)],
            [twice(x * z - w * y), twice(y * z + w * x), row(z, x, y)],
        ],
    })
}

/// The shortest turn that brings z to the unit vector e; to −z the one about x.
pub(crate) fn z_to(e: Vec3<Dd>) -> Mat3<Dd> {
    let across = Vec3::unit_z().cross(e);
    let sin = across.dot(across).sqrt();
    let axis = unit(across).unwrap_or_else(|| Vec3::new(Dd::ONE, Dd::ZERO, Dd::ZERO));
    about(axis, (sin, e.z))
}

/// R = Rz(yaw) Ry(pitch) Rx(roll).
fn roll_pitch_yaw(rpy: &[Angle; 3], tolerance: f64) -> Mat3<Dd> {
    let [(sr, cr), (sp, cp), (sy, cy)] = [0, 1, 2].map(|i| read(&rpy[i], tolerance).sin_cos);
    snap_rotation(Mat3 {
        rows: [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ],
    })
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;
    use crate::diagnostic::Place;
    use straightline_core::random::Random;

    fn angle(value: f64, unit: AngleUnit) -> Angle {
        Angle { value, unit, text: String::new(), place: Place::none() }
    }

    pub fn special_angles_have_names() {
        let names: Vec<String> = [0, 6, -6, 12, 24, 3, -9, 2, 4, 8, 10, 18, 36].map(name_of_twelfths).into();
        let expected = ["0", "π/2", "-π/2", "π", "2π", "π/4", "-3π/4", "π/6", "π/3", "2π/3", "5π/6", "3π/2", "3π"];
        assert_eq!(names, expected);
    }

    pub fn table_of_special_angles_agrees_with_the_series() {
        for m in (-48..=48).filter(|m| m % 2 == 0 || m % 3 == 0) {
            let (s, c) = sin_cos_of_twelfths(m);
            let (s2, c2) = (Dd::PI / Dd::from(12.0) * Dd::from(m as f64)).sin_cos();
            assert!((s - s2).abs().to_f64() < 1e-30 && (c - c2).abs().to_f64() < 1e-30, "{m}");
        }
    }

    pub fn right_angles_are_exact_in_every_unit() {
        for (value, unit) in [
            (90.0, AngleUnit::Degree),
            (-270.0, AngleUnit::Degree),
            (1.0, AngleUnit::QuarterTurn),
            (0.25, AngleUnit::Turn),
            (std::f64::consts::FRAC_PI_2, AngleUnit::Radian),
        ] {
            assert_eq!(read(&angle(value, unit), ROUNDING).sin_cos, (Dd::ONE, Dd::ZERO), "{value} {unit:?}");
        }
    }

    pub fn tolerance_zero_takes_radians_literally() {
        let reading = read(&angle(std::f64::consts::FRAC_PI_2, AngleUnit::Radian), 0.0);
        assert_eq!(reading.special, None);
        assert_eq!(reading.sin_cos.1.to_f64(), 6.123233995736766e-17);
        assert_eq!(reading.sin_cos.0.to_f64(), 1.0);
    }

    pub fn an_angle_beyond_the_tolerance_is_literal_and_within_it_exact() {
        let x = angle("1.57079632679".parse().expect("a number"), AngleUnit::Radian);
        assert_eq!(read(&x, ROUNDING).special, None);
        assert!((read(&x, ROUNDING).deviation + 4.9e-12).abs() < 1e-13);
        assert_eq!(read(&x, 1e-6).special, Some(6));
    }

    pub fn the_angle_of_a_point_is_the_nearest_and_needs_no_library() {
        use std::f64::consts::{FRAC_PI_2, PI};
        let exact =
            [(0.0, 1.0, 0.0), (0.0, -1.0, PI), (-0.0, -1.0, -PI), (1.0, 0.0, FRAC_PI_2), (-1.0, -0.0, -FRAC_PI_2)];
        for (y, x, angle) in exact.into_iter().chain([(0.0, 0.0, 0.0), (1e-300, 1.0, 1e-300)]) {
            assert_eq!(of_point(y, x), angle, "{y:?} {x:?}");
        }
        let mut random = Random(1);
        for k in 0..20_000 {
            // angles all around, and near to the axes
            let turn = random.symmetric([PI, 1e-6][k % 2]) + FRAC_PI_2 * random.below(4) as f64;
            let (sin, cos) = Dd::from(turn).sin_cos();
            let (y, x) = (sin.to_f64(), cos.to_f64());
            let angle = of_point(y, x);
            let (sin, cos) = Dd::from(angle).sin_cos();
            // what it is off, beside half of its last digit
            let off = ((Dd::from(y) * cos - Dd::from(x) * sin) / (Dd::from(x) * cos + Dd::from(y) * sin)).to_f64();
            let digit = f64::from_bits(angle.abs().to_bits() + 1) - angle.abs();
            assert!(off.abs() <= 0.5 * digit * (1.0 + 1e-9), "{y:?} {x:?}: {angle:?} is off by {off:e}");
            assert!((angle - y.atan2(x)).abs() <= digit, "{y:?} {x:?}: {angle:?} beside {:?}", y.atan2(x));
        }
    }
}
