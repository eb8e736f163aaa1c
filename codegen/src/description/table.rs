//! Walking a TOML document with places, so that one run finds all complaints.

use super::reader::{FileReader, Range64};
use super::{messages, Angle, AngleUnit, JointDrive, JointLimits, Noted, Rotation, WrittenInertial, WrittenPose};
use crate::diagnostic::{Diagnostic, Diagnostics, Source};
use std::ops::Range;
use straightline_core::spatial::Sym3;
use toml::de::{DeTable, DeValue};
use toml::Spanned;
use toml_parser::lexer::TokenKind;

type Span = Range<usize>;

/// Parts of a dotted key, and brackets inside each other: the parser recurses as deep.
const DEEPEST: usize = 16;

/// A table and how complaints name it.
pub struct TomlTable<'a, 'i> {
    /// What it describes, in complaints: ``joint `elbow` ``.
    pub owner: String,
    /// Keys and values.
    pub table: &'a DeTable<'i>,
    /// Where it stands.
    pub span: Span,
}

/// Whether a text is TOML, right or nearly, and its top table is as asked for.
pub fn holds(text: &str, is_it: fn(&TomlTable) -> bool) -> bool {
    wrong_bracket(text).is_none() && is_it(&TomlTable::of_document(&DeTable::parse_recoverable(text).0))
}

/// The document, or complaints about its syntax.
pub fn parse<'i>(source: &'i Source, diagnostics: &mut Diagnostics) -> Option<Spanned<DeTable<'i>>> {
    let mut reader = FileReader::new(source, diagnostics);
    if let Some((span, complaint)) = wrong_bracket(source.text()) {
        reader.complain(&span, complaint);
        return None;
    }
    let (document, errors) = DeTable::parse_recoverable(source.text());
    let mut last_line = 0;
    for error in &errors {
        let span = error.span().unwrap_or(0..0);
        // what follows on a line follows from its first error
        let line = reader.place(&span).line;
        if std::mem::replace(&mut last_line, line) == line {
            continue;
        }
        let said = error.message().lines().next().unwrap_or("");
        reader.complain(&span, messages::toml_syntax(said));
    }
    errors.is_empty().then_some(document)
}

/// The first bracket that does not match, or bracket or dotted key that nests deeply, which the parser's recursion does not bear.
fn wrong_bracket(text: &str) -> Option<(Span, Diagnostic)> {
    let mut open: Vec<(TokenKind, Span)> = Vec::new();
    let mut parts = 0;
    for token in toml_parser::Source::new(text).lex() {
        let span = token.span().start()..token.span().end();
        parts = match token.kind() {
            TokenKind::Dot => parts + 1,
            TokenKind::Equals
            | TokenKind::Comma
            | TokenKind::Newline
            | TokenKind::LeftCurlyBracket
            | TokenKind::LeftSquareBracket => 0,
            _ => parts,
        };
        if parts >= DEEPEST {
            return Some((span, messages::too_complex("parts of a dotted key", DEEPEST)));
        }
        match token.kind() {
            kind @ (TokenKind::LeftCurlyBracket | TokenKind::LeftSquareBracket) => open.push((kind, span.clone())),
            TokenKind::RightCurlyBracket | TokenKind::RightSquareBracket => {
                let closes = match token.kind() {
                    TokenKind::RightCurlyBracket => TokenKind::LeftCurlyBracket,
                    _ => TokenKind::LeftSquareBracket,
                };
                if open.pop().is_none_or(|(kind, _)| kind != closes) {
                    return Some((span, messages::toml_syntax("this bracket closes none")));
                }
            }
            _ => {}
        }
        if open.len() > DEEPEST {
            return Some((span, messages::too_complex("brackets inside each other", DEEPEST)));
        }
    }
    open.pop().map(|(_, span)| (span, messages::toml_syntax("this bracket is never closed")))
}

impl<'a, 'i> TomlTable<'a, 'i> {
    /// The top table.
    pub fn of_document(document: &'a Spanned<DeTable<'i>>) -> TomlTable<'a, 'i> {
        TomlTable { owner: "the file".to_string(), table: document.get_ref(), span: 0..0 }
    }

    /// Value and span of a key.
    pub fn get(&self, key: &str) -> Option<(&'a DeValue<'i>, Span)> {
        self.table.get(key).map(|value| (value.get_ref(), value.span()))
    }

    /// Whether the file has the key.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// `com of link x`.
    pub fn what(&self, key: &str) -> String {
        format!("{key} of {}", self.owner)
    }
}

/// How a value's type is called.
fn type_name(value: &DeValue) -> String {
    match value {
        DeValue::Array(array) => format!("an array of {}", array.len()),
        DeValue::String(_) => "a string".to_string(),
        DeValue::Integer(_) | DeValue::Float(_) => "a number".to_string(),
        DeValue::Boolean(_) => "a boolean".to_string(),
        DeValue::Datetime(_) => "a date".to_string(),
        DeValue::Table(_) => "a table".to_string(),
    }
}

impl FileReader<'_> {
    /// Complains of every key that is not known.
    pub fn check_keys(&mut self, table: &TomlTable, known: &[&str]) {
        for key in table.table.keys() {
            if !known.contains(&key.get_ref().as_ref()) {
                self.complain(&key.span(), messages::unknown_key(&table.owner, key.get_ref(), known));
            }
        }
    }

    /// Complains if a key is missing.
    pub fn require(&mut self, table: &TomlTable, key: &str, example: &str) {
        if !table.has(key) {
            self.complain(&table.span, messages::missing_key(&table.owner, key, example));
        }
    }

    /// Complains of a value of another type.
    pub fn wrong_type(&mut self, what: &str, expected: &str, value: &DeValue, span: &Span) {
        self.complain(span, messages::wrong_type(what, expected, &type_name(value)));
    }

    /// A number, or a complaint.
    pub fn real(&mut self, what: &str, value: &DeValue, span: &Span, range: Range64) -> Option<f64> {
        match value {
            DeValue::Float(float) => self.number(what, float.as_str(), span, range),
            DeValue::Integer(integer) if integer.radix() == 10 => self.number(what, integer.as_str(), span, range),
            DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(integer) => Some(integer as f64),
                Err(_) => {
                    self.complain(span, messages::not_a_number(what, integer.as_str()));
                    None
                }
            },
            _ => {
                self.wrong_type(what, "a number", value, span);
                None
            }
        }
    }

    /// The number of a key; `None` where there is no such key, or after a complaint.
    pub fn real_at(&mut self, table: &TomlTable, key: &str, range: Range64) -> Option<Noted<f64>> {
        let (value, span) = table.get(key)?;
        let value = self.real(&table.what(key), value, &span, range)?;
        Some(self.value(value, &span))
    }

    /// `true` or `false`.
    pub fn flag_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<bool>> {
        let (value, span) = table.get(key)?;
        match value {
            DeValue::Boolean(flag) => Some(self.value(*flag, &span)),
            _ => {
                self.wrong_type(&table.what(key), "`true` or `false`", value, &span);
                None
            }
        }
    }

    /// A whole number that is not negative.
    pub fn count_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<usize>> {
        let (value, span) = table.get(key)?;
        let count = match value {
            DeValue::Integer(integer) => usize::from_str_radix(integer.as_str(), integer.radix()).ok(),
            _ => None,
        };
        if count.is_none() {
            let found = match value {
                DeValue::Integer(_) | DeValue::Float(_) => {
                    self.source.text().get(span.clone()).unwrap_or("").to_string()
                }
                _ => type_name(value),
            };
            let what = table.what(key);
            self.complain(&span, messages::wrong_type(&what, "a whole number from 0", &found));
        }
        count.map(|count| self.value(count, &span))
    }

    /// An array of names of something.
    pub fn names_at(&mut self, table: &TomlTable, key: &str, what: &str) -> Vec<Noted<String>> {
        let Some((value, span)) = table.get(key) else { return Vec::new() };
        let DeValue::Array(array) = value else {
            self.wrong_type(&table.what(key), "an array of names", value, &span);
            return Vec::new();
        };
        let mut names = Vec::new();
        for item in array.iter() {
            match item.get_ref() {
                DeValue::String(text) => names.extend(self.name(what, text, &item.span())),
                other => self.wrong_type(&table.what(key), "a name", other, &item.span()),
            }
        }
        names
    }

    /// The text of a key; `None` likewise.
    pub fn string_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<String>> {
        let (value, span) = table.get(key)?;
        match value {
            DeValue::String(text) => Some(self.value(text.to_string(), &span)),
            _ => {
                self.wrong_type(&table.what(key), "a string", value, &span);
                None
            }
        }
    }

    /// The text of a key as a name: not empty, and of characters that can be shown.
    pub fn name_at(&mut self, table: &TomlTable, key: &str, what: &str) -> Option<Noted<String>> {
        let text = self.string_at(table, key)?;
        self.name(what, &text.value, &text.place.span)
    }

    /// One of a few words.
    pub fn word_at<T: Copy>(&mut self, table: &TomlTable, key: &str, words: &[(&str, T)]) -> Option<Noted<T>> {
        let text = self.string_at(table, key)?;
        self.word(&table.what(key), &text, words).map(|value| Noted::new(value, text.place))
    }

    /// What a word stands for, or a complaint.
    pub fn word<T: Copy>(&mut self, what: &str, text: &Noted<String>, words: &[(&str, T)]) -> Option<T> {
        let known = words.iter().find(|w| w.0 == text.value);
        if known.is_none() {
            let known: Vec<&str> = words.iter().map(|w| w.0).collect();
            self.diagnostics.push(messages::unknown_word(what, &text.value, &known).at(&text.place));
        }
        known.map(|w| w.1)
    }

    /// So many numbers in an array; `form` says so in words.
    pub fn reals_at<const N: usize>(
        &mut self,
        table: &TomlTable,
        key: &str,
        form: &str,
        range: Range64,
    ) -> Option<[f64; N]> {
        let (value, span) = table.get(key)?;
        let what = table.what(key);
        let DeValue::Array(array) = value else {
            self.wrong_type(&what, form, value, &span);
            return None;
        };
        if array.len() != N {
            self.complain(&span, messages::wrong_count(&what, form, array.len()));
            return None;
        }
        let numbers: Vec<_> = array.iter().map(|item| self.real(&what, item.get_ref(), &item.span(), range)).collect();
        let numbers: Option<Vec<f64>> = numbers.into_iter().collect();
        numbers?.try_into().ok()
    }

    /// Numbers in an array; all complaints of them before `None`.
    pub fn all_reals_at(&mut self, table: &TomlTable, key: &str, range: Range64) -> Option<Vec<f64>> {
        let (value, span) = table.get(key)?;
        let what = table.what(key);
        let DeValue::Array(array) = value else {
            self.wrong_type(&what, "an array of numbers", value, &span);
            return None;
        };
        let numbers: Vec<_> = array.iter().map(|item| self.real(&what, item.get_ref(), &item.span(), range)).collect();
        numbers.into_iter().collect()
    }

    fn triple(&mut self, what: &str, value: &DeValue, span: &Span) -> Option<[(f64, Span); 3]> {
        let DeValue::Array(array) = value else {
            self.wrong_type(what, "three numbers in an array", value, span);
            return None;
        };
        if array.len() != 3 {
            self.complain(span, messages::wrong_count(what, "three numbers", array.len()));
            return None;
        }
        let numbers: Vec<_> = array
            .iter()
            .map(|item| self.real(what, item.get_ref(), &item.span(), Range64::Finite).map(|x| (x, item.span())))
            .collect();
        let mut numbers = numbers.into_iter().flatten();
        Some([numbers.next()?, numbers.next()?, numbers.next()?])
    }

    /// Numbers in an array.
    pub fn row(&mut self, what: &str, value: &DeValue, span: &Span) -> Option<Vec<f64>> {
        let DeValue::Array(array) = value else {
            self.wrong_type(what, "numbers in an array", value, span);
            return None;
        };
        let numbers: Vec<Option<f64>> =
            array.iter().map(|item| self.real(what, item.get_ref(), &item.span(), Range64::Finite)).collect();
        numbers.into_iter().collect()
    }

    /// Three numbers in an array.
    pub fn vector_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<[f64; 3]>> {
        let (value, span) = table.get(key)?;
        let [x, y, z] = self.triple(&table.what(key), value, &span)?;
        Some(self.value([x.0, y.0, z.0], &span))
    }

    /// A required vector; a placeholder after a complaint.
    pub fn required_vector(&mut self, table: &TomlTable, key: &str, example: &str) -> Noted<[f64; 3]> {
        self.require(table, key, example);
        self.vector_at(table, key).unwrap_or_else(|| self.value([0.0, 0.0, 1.0], &table.span))
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
            Some(angles) => Rotation { rpy: angles.map(|(value, span)| self.angle(value, unit, &span)) },
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

    /// The table of that key.
    pub fn table_at<'a, 'i>(&mut self, table: &TomlTable<'a, 'i>, key: &str, owner: &str) -> Option<TomlTable<'a, 'i>> {
        let (value, span) = table.get(key)?;
        match value {
            DeValue::Table(inner) => Some(TomlTable { owner: owner.to_string(), table: inner, span }),
            _ => {
                self.wrong_type(owner, "a table", value, &span);
                None
            }
        }
    }

    /// The tables of an array `[[key]]`.
    pub fn tables_at<'a, 'i>(&mut self, table: &TomlTable<'a, 'i>, key: &str) -> Vec<TomlTable<'a, 'i>> {
        let Some((value, span)) = table.get(key) else { return Vec::new() };
        let DeValue::Array(array) = value else {
            self.wrong_type(key, &format!("`[[{key}]]` tables"), value, &span);
            return Vec::new();
        };
        let mut tables = Vec::new();
        for (i, item) in array.iter().enumerate() {
            match item.get_ref() {
                DeValue::Table(inner) => {
                    tables.push(TomlTable { owner: format!("{key} {}", i + 1), table: inner, span: item.span() });
                }
                other => self.wrong_type(&format!("{key} {}", i + 1), "a table", other, &item.span()),
            }
        }
        tables
    }
}
