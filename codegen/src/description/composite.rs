//! Joints of several coordinates that are written as one and read as single joints, with links without mass in between: a row of the table each.
//!
//! Coordinates, units and names in reports and code are those of the single joints: `base` of kind `planar` has the joints `base_x`, `base_y` and
//! `base_theta`. Equations, bounds and tests need nothing further.

use super::{
    JointDrive, JointLimits, JointType, Noted, Placement, WrittenCoupling, WrittenJoint, WrittenLink, WrittenPose,
};
use straightline_core::joint::{Dialect, Measure};

/// A kind of joint that is read as several.
#[derive(Debug, PartialEq)]
pub struct CompositeKind {
    /// The word for it.
    pub word: &'static str,
    /// The files that have the word.
    pub dialects: &'static [Dialect],
    /// What it lets the child do.
    pub summary: &'static str,
    /// Whether the file gives an axis.
    pub has_axis: bool,
    /// Whether the file gives a second one.
    pub has_second_axis: bool,
    /// Whether the second joint follows the first one, by a pitch.
    pub has_pitch: bool,
    /// The single joints, the outermost first.
    pub parts: &'static [CompositePart],
}

/// One of the single joints.
#[derive(Debug, PartialEq)]
pub struct CompositePart {
    /// What stands behind the joint's name, after an underscore; nothing: the name itself.
    pub suffix: &'static str,
    /// Whether it turns or slides.
    pub measure: Measure,
    /// Along what.
    pub along: PartAxis,
}

/// The axis of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartAxis {
    /// That of the joint.
    Axis,
    /// The second one.
    SecondAxis,
    /// The first or second direction across the axis, so that both and the axis are right-handed.
    Across(usize),
    /// An axis of the joint frame.
    Frame(usize),
}

const fn part(suffix: &'static str, measure: Measure, along: PartAxis) -> CompositePart {
    CompositePart { suffix, measure, along }
}

const PLAIN: CompositeKind = CompositeKind {
    word: "",
    dialects: &[Dialect::JointFrames],
    summary: "",
    has_axis: true,
    has_second_axis: false,
    has_pitch: false,
    parts: &[],
};

/// All of them.
pub static COMPOSITES: &[CompositeKind] = &[
    CompositeKind {
        word: "planar",
        dialects: Dialect::FRAMES,
        summary: "slides along two directions across the axis and turns about it; x, y and the axis are right-handed",
        parts: &[
            part("x", Measure::Length, PartAxis::Across(0)),
            part("y", Measure::Length, PartAxis::Across(1)),
            part("theta", Measure::Angle, PartAxis::Axis),
        ],
        ..PLAIN
    },
    CompositeKind {
        word: "translation",
        summary: "slides along x, y and z of the joint frame, which is fixed to the parent",
        has_axis: false,
        parts: &[
            part("x", Measure::Length, PartAxis::Frame(0)),
            part("y", Measure::Length, PartAxis::Frame(1)),
            part("z", Measure::Length, PartAxis::Frame(2)),
        ],
        ..PLAIN
    },
    CompositeKind {
        word: "universal",
        dialects: &[Dialect::JointFrames, Dialect::Sdf],
        summary: "turns about `axis`, and then about `axis2`, which turns with it",
        has_second_axis: true,
        parts: &[part("1", Measure::Angle, PartAxis::Axis), part("2", Measure::Angle, PartAxis::SecondAxis)],
        ..PLAIN
    },
    CompositeKind {
        word: "revolute2",
        dialects: &[Dialect::Sdf],
        summary: "the same",
        has_second_axis: true,
        parts: &[part("1", Measure::Angle, PartAxis::Axis), part("2", Measure::Angle, PartAxis::SecondAxis)],
        ..PLAIN
    },
    CompositeKind {
        word: "cylindrical",
        summary: "slides along the axis and turns about it, each by itself",
        parts: &[part("slide", Measure::Length, PartAxis::Axis), part("turn", Measure::Angle, PartAxis::Axis)],
        ..PLAIN
    },
    CompositeKind {
        word: "helical",
        summary:
            "turns about the axis and slides along it by the pitch, a joint that follows: one coordinate \\[rad\\]",
        has_pitch: true,
        parts: &[part("", Measure::Angle, PartAxis::Axis), part("slide", Measure::Length, PartAxis::Axis)],
        ..PLAIN
    },
    CompositeKind {
        word: "screw",
        dialects: &[Dialect::Sdf],
        summary: "the same",
        has_pitch: true,
        parts: &[part("", Measure::Angle, PartAxis::Axis), part("slide", Measure::Length, PartAxis::Axis)],
        ..PLAIN
    },
];

/// A composite joint of a file, with what single joints have no place for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrittenComposite {
    /// Which it is.
    pub of: &'static CompositeKind,
    /// The second axis, where it has one.
    pub second_axis: [f64; 3],
    /// The pitch \[m/rad\], where it has one.
    pub pitch: f64,
}

impl CompositeKind {
    /// As a type of joints of which nothing further is read.
    pub fn joint_type(&'static self) -> JointType {
        let composite = Some(WrittenComposite { of: self, second_axis: [0.0; 3], pitch: 0.0 });
        JointType { word: self.word, composite, ..JointType::FIXED }
    }
}

/// The directions u and v across an axis of the joint frame with u × v along it; `None` of an oblique one.
fn across(axis: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let unit = |k: usize| std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
    let mut along = (0..3).filter(|k| axis[*k] != 0.0);
    let (Some(k), None) = (along.next(), along.next()) else { return None };
    let [u, v] = [unit((k + 1) % 3), unit((k + 2) % 3)];
    Some(if axis[k] > 0.0 { [u, v] } else { [v, u] })
}

impl WrittenJoint {
    /// Whether the axis of a composite joint is one that it can have.
    pub(super) fn has_fit_axis(&self) -> bool {
        let Some(composite) = self.kind.value.composite else { return true };
        let needs_frame = composite.of.parts.iter().any(|part| matches!(part.along, PartAxis::Across(_)));
        !needs_frame || matches!(&self.placement, Placement::Frames { axis, .. } if across(axis.value).is_some())
    }

    /// The single joints of a composite one, the links between them and what couples them; the joint itself if it is none.
    pub(super) fn expanded(self) -> (Vec<WrittenJoint>, Vec<WrittenLink>, Vec<WrittenCoupling>) {
        let (Some(composite), Placement::Frames { origin, axis }) = (self.kind.value.composite, &self.placement) else {
            return (vec![self], Vec::new(), Vec::new());
        };
        let place = &self.name.place;
        let sides = across(axis.value).unwrap_or_default();
        let named = |suffix: &str| match suffix {
            "" => self.name.clone(),
            _ => Noted::new(format!("{}_{suffix}", self.name.value), place.clone()),
        };
        let last = composite.of.parts.len() - 1;
        let carrier = |k: usize| Noted::new(format!("{}_carrier{}", self.name.value, k + 1), place.clone());
        let links = (0..last).map(|k| WrittenLink { name: carrier(k), inertial: None, is_carrier: true }).collect();
        let joint = |(k, part): (usize, &'static CompositePart)| {
            let direction = match part.along {
                PartAxis::Axis => axis.value,
                PartAxis::SecondAxis => composite.second_axis,
                PartAxis::Across(side) => sides[side],
                PartAxis::Frame(i) => std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 }),
            };
            let axis = Noted::new(direction, axis.place.clone());
            let origin = if k == 0 { origin.clone() } else { WrittenPose::identity(place.clone()) };
            // of one coordinate the first joint has what the file says of it
            let (limits, drive) = match composite.of.has_pitch && k == 0 {
                true => (self.limits.clone(), self.drive.clone()),
                false => (JointLimits::default(), JointDrive::default()),
            };
            let has_range = limits.lower.is_some() || limits.upper.is_some();
            let kind = JointType { has_range, ..JointType::free_along(part.measure) };
            WrittenJoint {
                name: named(part.suffix),
                kind: Noted::new(kind, self.kind.place.clone()),
                parent: if k == 0 { self.parent.clone() } else { carrier(k - 1) },
                child: if k == last { self.child.clone() } else { carrier(k) },
                placement: Placement::Frames { origin, axis },
                limits,
                drive,
            }
        };
        let joints: Vec<WrittenJoint> = composite.of.parts.iter().enumerate().map(joint).collect();
        let coupling = composite.of.has_pitch.then(|| WrittenCoupling {
            joint: joints[1].name.clone(),
            source: joints[0].name.clone(),
            ratio: Noted::new(composite.pitch, place.clone()),
            offset: Noted::new(0.0, place.clone()),
        });
        (joints, links, coupling.into_iter().collect())
    }
}
