//! Angles, rotations and poses as they are written.

use super::Noted;
use crate::diagnostic::Place;

/// The unit in which an angle is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AngleUnit {
    /// Radians.
    Radian,
    /// Degrees.
    Degree,
    /// Multiples of π/2.
    QuarterTurn,
    /// Multiples of 2π.
    Turn,
}

/// An angle as written.
#[derive(Clone, Debug, PartialEq)]
pub struct Angle {
    /// The number.
    pub value: f64,
    /// Its unit.
    pub unit: AngleUnit,
    /// How it is written; empty if it is left out.
    pub text: String,
    /// Where.
    pub place: Place,
}

impl Angle {
    /// No angle, where the file says nothing.
    pub fn zero(place: Place) -> Angle {
        Angle { value: 0.0, unit: AngleUnit::Radian, text: String::new(), place }
    }
}

/// A rotation as written.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // most poses have angles, and no robot so many poses that their room counts
pub enum Rotation {
    /// Roll (about x), pitch (about y), yaw (about z): R = Rz(yaw) Ry(pitch) Rx(roll).
    RollPitchYaw([Angle; 3]),
    /// Turns, each in the axes that those before it lead to: the product of their matrices in this order.
    Turns(Vec<WrittenTurn>),
}

/// A turn as written, from one set of axes to the next. Vectors have a direction and any length.
#[derive(Clone, Debug, PartialEq)]
pub enum WrittenTurn {
    /// By an angle about an axis.
    About {
        /// The axis.
        axis: Noted<[f64; 3]>,
        /// The angle.
        angle: Angle,
    },
    /// By a quaternion w, x, y, z.
    Quaternion(Noted<[f64; 4]>),
    /// To an x axis, and a y axis of which the part across x counts.
    Axes(Noted<[[f64; 3]; 2]>),
    /// Brings z to this direction on the shortest way; to −z about x.
    ZTo(Noted<[f64; 3]>),
}

impl Rotation {
    /// No rotation, where the file says nothing.
    pub fn identity(place: Place) -> Rotation {
        Rotation::RollPitchYaw([Angle::zero(place.clone()), Angle::zero(place.clone()), Angle::zero(place)])
    }

    /// Whether nothing turns, as it is written.
    pub fn is_identity(&self) -> bool {
        match self {
            Rotation::RollPitchYaw(angles) => angles.iter().all(|angle| angle.value == 0.0),
            Rotation::Turns(turns) => turns.iter().all(|turn| match turn {
                WrittenTurn::About { angle, .. } => angle.value == 0.0,
                WrittenTurn::Quaternion(q) => q.value[1..] == [0.0; 3],
                _ => false,
            }),
        }
    }

    pub(super) fn angles(&self, of: String) -> Vec<(String, &Angle)> {
        match self {
            Rotation::RollPitchYaw(rpy) => {
                ["roll", "pitch", "yaw"].into_iter().map(|name| format!("{name} of {of}")).zip(rpy.iter()).collect()
            }
            Rotation::Turns(turns) => {
                let mut angles = Vec::new();
                for turn in turns {
                    if let WrittenTurn::About { angle, .. } = turn {
                        angles.push((format!("an angle of {of}"), angle));
                    }
                }
                angles
            }
        }
    }
}

/// A pose as written.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenPose {
    /// Position \[m\].
    pub xyz: Noted<[f64; 3]>,
    /// Orientation.
    pub rotation: Rotation,
}

impl WrittenPose {
    /// Frames that coincide, where the file says nothing.
    pub fn identity(place: Place) -> WrittenPose {
        WrittenPose { xyz: Noted::new([0.0; 3], place.clone()), rotation: Rotation::identity(place) }
    }

    /// Whether frames coincide, as it is written.
    pub fn is_identity(&self) -> bool {
        self.xyz.value == [0.0; 3] && self.rotation.is_identity()
    }
}
