//! What links and joints are made of, read from a table: inertias, rotations, poses, limits, drives.

use super::{Span, TomlTable};
use crate::description::reader::{FileReader, Range64};
use crate::description::toml::AXES;
use crate::description::{
    messages, Angle, AngleUnit, JointDrive, JointLimits, Noted, Rotation, WrittenInertial, WrittenPose,
};
use straightline_core::spatial::Sym3;
use toml::de::DeValue;
use toml::Spanned;

/// Keys of what [`FileReader::inertial_at`] reads.
pub const INERTIAL_KEYS: &[&str] = &[
    "mass",
    "com",
    "inertia",
    "inertia_rpy",
    "inertia_rpy_rad",
    "inertia_rpy_deg",
    "inertia_rpy_quarter_turns",
    "inertia_rpy_turns",
];
/// Keys of what [`FileReader::drive_at`] reads.
pub const DRIVE_KEYS: &[&str] = &["damping", "friction", "rotor_inertia", "gear_ratio", "armature", "spring"];

impl FileReader<'_> {
    /// An axis: a word for one of the frame's, or a vector.
    pub fn axis_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<[f64; 3]>> {
        match table.get(key) {
            Some((DeValue::String(_), _)) => self.word_at(table, key, &AXES),
            _ => self.vector_at(table, key),
        }
    }

    /// An inertia tensor: a table `{ xx, yy, zz, xy, xz, yz }`, three principal moments, or a 3×3 matrix.
    pub fn tensor_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<Sym3<f64>>> {
        const FORMS: &str = "`{ xx = …, yy = …, zz = …, xy = 0, xz = 0, yz = 0 }`, three moments or a 3×3 matrix";
        let (value, span) = table.get(key)?;
        let what = table.what(key);
        let tensor = match value {
            DeValue::Table(entries) => {
                let entries = TomlTable { owner: what, table: entries, span: span.clone() };
                self.check_keys(&entries, &["xx", "yy", "zz", "xy", "xz", "yz"]);
                for diagonal in ["xx", "yy", "zz"] {
                    self.require(&entries, diagonal, "{ xx = 0.1, yy = 0.1, zz = 0.1 }");
                }
                let mut entry = |key: &str, default| match entries.has(key) {
                    true => self.real_at(&entries, key, Range64::Finite).map(|v| v.value),
                    false => default,
                };
                let (xx, yy, zz) = (entry("xx", None), entry("yy", None), entry("zz", None));
                let (xy, xz, yz) = (entry("xy", Some(0.0)), entry("xz", Some(0.0)), entry("yz", Some(0.0)));
                Sym3 { xx: xx?, yy: yy?, zz: zz?, xy: xy?, xz: xz?, yz: yz? }
            }
            DeValue::Array(rows) if rows.iter().any(|row| row.get_ref().is_array()) => {
                if rows.len() != 3 {
                    self.complain(&span, messages::wrong_count(&what, "three rows", rows.len()));
                    return None;
                }
                let rows: Vec<_> = rows.iter().map(|row| self.triple(&what, row.get_ref(), &row.span())).collect();
                let m: Vec<[f64; 3]> = rows.into_iter().flatten().map(|row| row.map(|entry| entry.0)).collect();
                if m.len() != 3 {
                    return None;
                }
                for (i, j) in [(0, 1), (0, 2), (1, 2)] {
                    if (m[i][j] - m[j][i]).abs() > 1e-9 * (m[i][j].abs() + m[j][i].abs()) {
                        self.complain(&span, messages::not_symmetric(&table.owner, i + 1, j + 1, m[i][j], m[j][i]));
                        return None;
                    }
                }
                Sym3 { xx: m[0][0], xy: m[0][1], xz: m[0][2], yy: m[1][1], yz: m[1][2], zz: m[2][2] }
            }
            DeValue::Array(_) => {
                let [xx, yy, zz] = self.triple(&what, value, &span)?.map(|entry| entry.0);
                Sym3 { xx, yy, zz, xy: 0.0, xz: 0.0, yz: 0.0 }
            }
            _ => {
                self.wrong_type(&what, FORMS, value, &span);
                return None;
            }
        };
        Some(self.value(tensor, &span))
    }

    /// The units in which an angle key may be written.
    const UNITS: [(&'static str, AngleUnit); 5] = [
        ("", AngleUnit::Radian),
        ("_rad", AngleUnit::Radian),
        ("_deg", AngleUnit::Degree),
        ("_quarter_turns", AngleUnit::QuarterTurn),
        ("_turns", AngleUnit::Turn),
    ];

    /// The key of an angle or a triple of angles, with its unit; a second spelling is complained of.
    fn angle_key(&mut self, table: &TomlTable, stem: &str) -> Option<(String, AngleUnit)> {
        let mut found: Option<(String, AngleUnit)> = None;
        for (suffix, unit) in Self::UNITS {
            let key = format!("{stem}{suffix}");
            if let Some((_, span)) = table.get(&key) {
                match &found {
                    Some((first, _)) => self.complain(&span, messages::written_twice(&table.owner, first, &key)),
                    None => found = Some((key, unit)),
                }
            }
        }
        found
    }

    fn angle(&self, value: f64, unit: AngleUnit, span: &Span) -> Angle {
        let text = self.source.text().get(span.clone()).unwrap_or("").to_string();
        Angle { value, unit, text, place: self.place(span) }
    }

    /// An angle in any unit: `alpha`, `alpha_deg`, …
    pub fn angle_at(&mut self, table: &TomlTable, stem: &str) -> Option<Angle> {
        let (key, unit) = self.angle_key(table, stem)?;
        let value = self.real_at(table, &key, Range64::Finite)?;
        Some(self.angle(value.value, unit, &value.place.span))
    }

    /// Roll, pitch and yaw in any unit: `rpy_deg`, …
    pub fn rotation_at(&mut self, table: &TomlTable, stem: &str) -> Rotation {
        let none = Rotation::identity(self.place(&table.span));
        let Some((key, unit)) = self.angle_key(table, stem) else { return none };
        let Some((value, span)) = table.get(&key) else { return none };
        match self.triple(&table.what(&key), value, &span) {
            Some(angles) => Rotation::RollPitchYaw(angles.map(|(value, span)| self.angle(value, unit, &span))),
            None => none,
        }
    }

    /// Mass, centre of mass and inertia of the table of a link.
    pub fn inertial_at(&mut self, table: &TomlTable) -> Option<WrittenInertial> {
        self.require(table, "mass", "mass = 1.0");
        let mass = self.real_at(table, "mass", Range64::Finite);
        let com = self.vector_at(table, "com").unwrap_or_else(|| self.value([0.0; 3], &table.span));
        let rotation = self.rotation_at(table, "inertia_rpy");
        let zero = Sym3 { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 };
        let inertia = match table.has("inertia") {
            true => self.tensor_at(table, "inertia"),
            false => Some(self.value(zero, &table.span)),
        };
        Some(WrittenInertial { mass: mass?, com, rotation, inertia: inertia? })
    }

    /// Position `xyz` and roll, pitch and yaw.
    pub fn pose_at(&mut self, table: &TomlTable) -> WrittenPose {
        let xyz = self.vector_at(table, "xyz").unwrap_or_else(|| self.value([0.0; 3], &table.span));
        WrittenPose { xyz, rotation: self.rotation_at(table, "rpy") }
    }

    /// `[lower, upper]`, or `{ lower, upper, velocity, effort }`.
    pub fn limits_at(&mut self, table: &TomlTable, key: &str) -> JointLimits {
        let Some((value, span)) = table.get(key) else { return JointLimits::default() };
        let what = table.what(key);
        match value {
            DeValue::Array(pair) => {
                if pair.len() != 2 {
                    self.complain(&span, messages::wrong_count(&what, "two numbers", pair.len()));
                    return JointLimits::default();
                }
                let mut read = |i: usize| {
                    let item: &Spanned<DeValue> = &pair[i];
                    let x = self.real(&what, item.get_ref(), &item.span(), Range64::Limit)?;
                    Some(self.value(x, &item.span()))
                };
                JointLimits { lower: read(0), upper: read(1), ..JointLimits::default() }
            }
            DeValue::Table(entries) => {
                let entries = TomlTable { owner: what, table: entries, span };
                self.check_keys(&entries, &["lower", "upper", "velocity", "effort"]);
                let mut read = |key: &str| self.real_at(&entries, key, Range64::Limit);
                JointLimits {
                    lower: read("lower"),
                    upper: read("upper"),
                    velocity: read("velocity"),
                    effort: read("effort"),
                }
            }
            _ => {
                self.wrong_type(&what, "`{ lower = …, upper = …, velocity = …, effort = … }`", value, &span);
                JointLimits::default()
            }
        }
    }

    /// Rotor, friction and spring of a joint, from keys of its table.
    pub fn drive_at(&mut self, table: &TomlTable) -> JointDrive {
        let mut drive = JointDrive {
            damping: self.real_at(table, "damping", Range64::Finite),
            friction: self.real_at(table, "friction", Range64::Finite),
            rotor_inertia: self.real_at(table, "rotor_inertia", Range64::Finite),
            gear_ratio: self.real_at(table, "gear_ratio", Range64::Finite),
            armature: self.real_at(table, "armature", Range64::Finite),
            ..JointDrive::default()
        };
        if let Some(spring) = self.table_at(table, "spring", &format!("spring of {}", table.owner)) {
            self.check_keys(&spring, &["stiffness", "rest"]);
            self.require(&spring, "stiffness", "spring = { stiffness = 10.0, rest = 0.0 }");
            drive.spring_stiffness = self.real_at(&spring, "stiffness", Range64::Finite);
            drive.spring_rest = self.real_at(&spring, "rest", Range64::Finite);
        }
        drive
    }
}
