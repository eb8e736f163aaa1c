//! Rotations in the forms that files have.
//!
//! What a file says in the same form keeps its digits. Otherwise angles and quaternions are computed in double-double and rounded once; an
//! angle that reads as a multiple of π/4 or π/6 is written as the f64 that is nearest to it, and a quaternion of right angles in whole numbers.

use crate::description::angle::{self, ROUNDING};
use crate::description::geometry::{unit, vector};
use crate::description::{Angle, AngleUnit, Noted, Rotation, WrittenPose, WrittenTurn};
use crate::diagnostic::Place;
use straightline_core::spatial::{Mat3, Transform};
use straightline_core::Dd;

/// A longer or shorter axis is written with length 1.
const AXIS_DIGITS: f64 = 1e-9;
/// Numbers that are rounded to f64 make a length as near to 1.
const QUATERNION_DIGITS: f64 = 4e-16;

/// A rotation as a file can say it.
pub enum Said {
    /// Nothing is turned.
    Nothing,
    /// Roll, pitch and yaw \[rad\].
    Angles([f64; 3]),
    /// w, x, y, z, of any length.
    Quaternion([f64; 4]),
}

/// As it was written: angles as angles, everything else as a quaternion.
pub fn as_written(rotation: &Rotation) -> Said {
    match rotation {
        Rotation::RollPitchYaw(angles) if angles.iter().all(|angle| angle.value == 0.0) => Said::Nothing,
        Rotation::RollPitchYaw(angles) => Said::Angles(angles.each_ref().map(radians)),
        Rotation::Turns(turns) => match &turns[..] {
            [] => Said::Nothing,
            [WrittenTurn::Quaternion(q)] => Said::Quaternion(q.value),
            _ => Said::Quaternion(quaternion(&angle::rotation(rotation, ROUNDING))),
        },
    }
}

/// Roll, pitch and yaw \[rad\].
pub fn roll_pitch_yaw(rotation: &Rotation) -> [f64; 3] {
    match rotation {
        Rotation::RollPitchYaw(angles) => angles.each_ref().map(radians),
        Rotation::Turns(turns) if turns.is_empty() => [0.0; 3],
        Rotation::Turns(_) => angles(&angle::rotation(rotation, ROUNDING)),
    }
}

/// The angle in radians, with the digits of the file where it has radians.
fn radians(angle: &Angle) -> f64 {
    match angle.unit {
        AngleUnit::Radian => angle.value,
        _ => angle::in_radians(angle, ROUNDING).to_f64(),
    }
}

/// R = Rz(yaw) Ry(pitch) Rx(roll). Yaw comes first, rounded; the other two are those of what is left, so that where pitch is a right angle, and
/// yaw and roll are not told apart, the sum of both is right.
fn angles(r: &Mat3<Dd>) -> [f64; 3] {
    let yaw = angle_of(r.rows[1][0], r.rows[0][0]);
    let (sin, cos) = angle::read(&in_radians(yaw), ROUNDING).sin_cos;
    // Rz(−yaw) R = Ry(pitch) Rx(roll)
    let first = |column: usize| cos * r.rows[0][column] + sin * r.rows[1][column];
    let second = |column: usize| cos * r.rows[1][column] - sin * r.rows[0][column];
    let pitch = angle_of(-r.rows[2][0], first(0));
    let roll = angle_of(-second(2), second(1));
    [roll, pitch, yaw]
}

/// An angle in radians.
pub fn in_radians(value: f64) -> Angle {
    Angle { value, ..Angle::zero(Place::none()) }
}

/// The angle whose sine and cosine are y and x but for a factor: of the angle in f64 one step of Newton, tan(θ − θ₀) = (y c₀ − x s₀) / (x c₀ + y s₀).
fn angle_of(y: Dd, x: Dd) -> f64 {
    let start = angle::of_point(y.to_f64(), x.to_f64());
    let (sin, cos) = Dd::from(start).sin_cos();
    let along = x * cos + y * sin;
    let exact = match along.to_f64() == 0.0 {
        true => Dd::from(start),
        false => Dd::from(start) + (y * cos - x * sin) / along,
    };
    angle::in_radians(&in_radians(exact.to_f64()), ROUNDING).to_f64() + 0.0
}

/// w, x, y, z, the greatest of them 1: a row of 4 q qᵀ, so that no root is taken.
pub fn quaternion(r: &Mat3<Dd>) -> [f64; 4] {
    let m = &r.rows;
    let [x, y, z] = [m[0][0], m[1][1], m[2][2]];
    let one = Dd::ONE;
    let squares = [one + x + y + z, one + x - y - z, one - x + y - z, one - x - y + z];
    let cross = [
        [Dd::ZERO, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]],
        [Dd::ZERO, Dd::ZERO, m[1][0] + m[0][1], m[0][2] + m[2][0]],
        [Dd::ZERO, Dd::ZERO, Dd::ZERO, m[2][1] + m[1][2]],
        [Dd::ZERO; 4],
    ];
    let by_size = |a: &usize, b: &usize| squares[*a].to_f64().total_cmp(&squares[*b].to_f64());
    // of equal ones the first, so that w is positive where it can be
    let greatest = (0..4).rev().max_by(by_size).unwrap_or(0);
    std::array::from_fn(|i| match i.cmp(&greatest) {
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Less => (cross[i][greatest] / squares[greatest]).to_f64() + 0.0,
        std::cmp::Ordering::Greater => (cross[greatest][i] / squares[greatest]).to_f64() + 0.0,
    })
}

/// A pose rounded to f64, its rotation as a quaternion.
pub fn pose_of(pose: &Transform<Dd>) -> WrittenPose {
    let turns = match pose.rotation == Mat3::identity() {
        true => Vec::new(),
        false => vec![WrittenTurn::Quaternion(Noted::assumed(quaternion(&pose.rotation)))],
    };
    WrittenPose { xyz: Noted::assumed(pose.translation.to_array().map(Dd::to_f64)), rotation: Rotation::Turns(turns) }
}

/// The axis as it is where it is that long, as it is written with so many digits.
pub fn of_length_one(axis: [f64; 3]) -> [f64; 3] {
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    match unit(vector(axis)) {
        Some(unit) if (length - 1.0).abs() > AXIS_DIGITS => unit.to_array().map(Dd::to_f64),
        _ => axis,
    }
}

/// The quaternion with length 1, of which only one that has it to the last digits keeps its numbers.
pub fn unit_quaternion(q: [f64; 4]) -> [f64; 4] {
    let greatest = q.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    // scaled first, so that no square leaves f64's range; files with the null quaternion are refused
    let scaled = q.map(|x| Dd::from(x) / Dd::from(greatest));
    let length = scaled.iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
    match ((length * Dd::from(greatest)).to_f64() - 1.0).abs() > QUATERNION_DIGITS {
        true => scaled.map(|x| (x / length).to_f64()),
        false => q,
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI};

    fn rotation_of(rpy: [f64; 3]) -> Rotation {
        Rotation::RollPitchYaw(rpy.map(in_radians))
    }

    fn farthest(a: &Mat3<Dd>, b: &Mat3<Dd>) -> f64 {
        let off = |i: usize, j: usize| (a.rows[i][j] - b.rows[i][j]).abs().to_f64();
        (0..9).map(|k| off(k / 3, k % 3)).fold(0.0, f64::max)
    }

    /// By angles and by a quaternion, also where roll and yaw turn about one axis, or nearly.
    pub fn rotations_come_back() {
        let some =
            [0.0, 1e-9, 0.3, -1.1, FRAC_PI_2, FRAC_PI_2 - 1e-9, FRAC_PI_2 - 3e-16, -FRAC_PI_2, FRAC_PI_3, 2.9, PI];
        for roll in some {
            for pitch in some {
                for yaw in some {
                    let before = angle::rotation(&rotation_of([roll, pitch, yaw]), ROUNDING);
                    let by_angles = angle::rotation(&rotation_of(angles(&before)), ROUNDING);
                    let turn = WrittenTurn::Quaternion(Noted::assumed(quaternion(&before)));
                    let by_quaternion = angle::rotation(&Rotation::Turns(vec![turn]), ROUNDING);
                    let q = unit_quaternion(quaternion(&before));
                    assert!((q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-15, "{q:?}");
                    let turn = WrittenTurn::Quaternion(Noted::assumed(q));
                    let by_unit = angle::rotation(&Rotation::Turns(vec![turn]), ROUNDING);
                    for after in [by_angles, by_quaternion, by_unit] {
                        let off = farthest(&before, &after);
                        assert!(off < 1.2e-15, "{roll:?} {pitch:?} {yaw:?}: {off:e}");
                    }
                }
            }
        }
    }

    pub fn right_angles_stay_exact() {
        for (roll, pitch, yaw) in (0..64).map(|k| (k % 4, k / 4 % 4, k / 16)) {
            let rpy = [roll, pitch, yaw].map(|quarters| f64::from(quarters) * FRAC_PI_2);
            let before = angle::rotation(&rotation_of(rpy), ROUNDING);
            let q = quaternion(&before);
            assert!(q.iter().all(|x| [0.0, 1.0].contains(&x.abs())), "{rpy:?}: {q:?}");
            assert_eq!(before, angle::rotation(&rotation_of(angles(&before)), ROUNDING), "{rpy:?}");
            for q in [q, unit_quaternion(q)] {
                let turn = WrittenTurn::Quaternion(Noted::assumed(q));
                assert_eq!(before, angle::rotation(&Rotation::Turns(vec![turn]), ROUNDING), "{rpy:?}");
            }
        }
    }
}
