//! Rows `[[dh]]` of robot files in TOML: joints and links by Denavit and Hartenberg's parameters, in either convention.
//!
//! Standard (Denavit and Hartenberg 1955): T = Rot(z, θ) Trans(z, d) Trans(x, a) Rot(x, α), the joint along z of the frame before. Modified (Craig
//! 1986): T = Rot(x, α) Trans(x, a) Rot(z, θ) Trans(z, d), the joint along z of the link's own frame. The coordinate adds to θ or d.

use super::reader::{FileReader, Range64};
use super::table::{TomlTable, DRIVE_KEYS, INERTIAL_KEYS};
use super::{
    Angle, Description, JointDrive, JointLimits, JointType, Noted, Placement, Rotation, WrittenInertial, WrittenJoint,
    WrittenLink, WrittenPose,
};
use straightline_core::joint::Dialect;

const ROW: &[&str] = &[
    "name",
    "kind",
    "link",
    "parent",
    "a",
    "alpha",
    "alpha_rad",
    "alpha_deg",
    "alpha_quarter_turns",
    "alpha_turns",
    "d",
    "theta",
    "theta_rad",
    "theta_deg",
    "theta_quarter_turns",
    "theta_turns",
    "limits",
];

/// Which frame of a link its row places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum DhConvention {
    /// z of the frame is the axis of the next joint.
    Standard,
    /// z of the frame is the axis of the link's own joint.
    Modified,
}

/// The words of [`DhConvention`].
pub(super) const CONVENTIONS: [(&str, DhConvention); 2] =
    [("standard", DhConvention::Standard), ("modified", DhConvention::Modified)];

/// A row as it is written.
struct DhRow {
    joint: Noted<String>,
    link: Noted<String>,
    kind: Noted<JointType>,
    inertial: Option<WrittenInertial>,
    limits: JointLimits,
    drive: JointDrive,
    /// Along and about z by d and θ.
    about_z: WrittenPose,
    /// Along and about x by a and α.
    about_x: WrittenPose,
}

impl FileReader<'_> {
    /// Adds the joints and links of all rows.
    pub(super) fn dh_rows_at(&mut self, top: &TomlTable, convention: Option<DhConvention>, robot: &mut Description) {
        let mut before: Option<Noted<String>> = None;
        for (k, mut table) in self.tables_at(top, "dh").into_iter().enumerate() {
            let place = self.place(&table.span);
            let named = |what: &str| Noted::new(format!("{what}{}", k + 1), place.clone());
            let joint = match table.has("name") {
                true => self.name_at(&table, "name", "joint"),
                false => Some(named("joint")),
            };
            if let Some(joint) = &joint {
                table.owner = format!("joint `{}`", joint.value);
            }
            let link = match table.has("link") {
                true => self.name_at(&table, "link", "link"),
                false => Some(named("link")),
            };
            let parent = match (table.has("parent"), &before) {
                (true, _) => self.name_at(&table, "parent", "link"),
                (false, Some(before)) => Some(before.clone()),
                (false, None) => Some(Noted::new("base".to_string(), place.clone())),
            };
            before.clone_from(&link);
            let (Some(joint), Some(link), Some(parent)) = (joint, link, parent) else {
                robot.has_holes = true;
                continue;
            };
            let Some(row) = self.dh_row(&table, joint, link) else {
                robot.has_holes = true;
                continue;
            };
            if k == 0 && !table.has("parent") && robot.link(&parent.value).is_none() {
                robot.links.push(WrittenLink { name: parent.clone(), inertial: None, is_carrier: false });
            }
            // without a convention, of which it was complained, everything else is judged all the same
            add(row, parent, convention.unwrap_or(DhConvention::Standard), robot);
        }
    }

    fn dh_row(&mut self, table: &TomlTable, joint: Noted<String>, link: Noted<String>) -> Option<DhRow> {
        self.check_keys(table, &[ROW, INERTIAL_KEYS, DRIVE_KEYS].concat());
        self.require(table, "kind", "kind = \"revolute\"");
        let is_row = |kind: &JointType| kind.kind.is_some_and(|kind| kind.is_single());
        let words = JointType::words(Dialect::JointFrames).into_iter().filter(|(_, kind)| is_row(kind));
        let kind = self.word_at(table, "kind", &words.collect::<Vec<_>>());
        let has_inertial = INERTIAL_KEYS.iter().any(|key| table.has(key));
        let inertial = if has_inertial { self.inertial_at(table) } else { None };
        let limits = self.limits_at(table, "limits");
        let drive = self.drive_at(table);
        let [about_x, about_z] = [(0, "a", "alpha"), (2, "d", "theta")].map(|(axis, along, about)| {
            let mut pose = WrittenPose::identity(self.place(&table.span));
            if let Some(length) = self.real_at(table, along, Range64::Finite) {
                pose.xyz.value[axis] = length.value;
                pose.xyz.place = length.place;
            }
            if let Some(angle) = self.angle_at(table, about) {
                let mut angles = [0; 3].map(|_| Angle::zero(angle.place.clone()));
                angles[axis] = angle;
                pose.rotation = Rotation::RollPitchYaw(angles);
            }
            pose
        });
        let complete = kind.filter(|_| !has_inertial || inertial.is_some());
        complete.map(|kind| DhRow { joint, link, kind, inertial, limits, drive, about_z, about_x })
    }
}

/// Adds a row: what stands before the joint and behind it is fixed, with links without mass between.
fn add(row: DhRow, parent: Noted<String>, convention: DhConvention, robot: &mut Description) {
    let DhRow { joint: name, link, kind, inertial, limits, drive, about_z, about_x } = row;
    let place = name.place.clone();
    let carrier = Noted::new(format!("{}_carrier", name.value), place.clone());
    let axis = Noted::new([0.0, 0.0, 1.0], place.clone());
    let moving = |parent: Noted<String>, child: Noted<String>| WrittenJoint {
        name: name.clone(),
        kind: kind.clone(),
        parent,
        child,
        placement: Placement::Frames { origin: about_z, axis: axis.clone() },
        limits,
        drive,
    };
    let offset = |parent: Noted<String>, child: Noted<String>| {
        let own = Noted::new(format!("{}_offset", name.value), place.clone());
        WrittenJoint::fixed(own, parent, child, about_x)
    };
    robot.joints.extend(match convention {
        DhConvention::Standard => [moving(parent, carrier.clone()), offset(carrier.clone(), link.clone())],
        DhConvention::Modified => [offset(parent, carrier.clone()), moving(carrier.clone(), link.clone())],
    });
    robot.links.push(WrittenLink { name: carrier, inertial: None, is_carrier: true });
    robot.links.push(WrittenLink { name: link, inertial, is_carrier: false });
}
