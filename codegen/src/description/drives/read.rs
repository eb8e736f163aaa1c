//! Drives as robot files write them.

use super::{
    AsWritten, Must, TransmissionStage, WrittenActuator, WrittenDrive, WrittenNumber, WrittenRating, WrittenThermal,
};
use crate::description::reader::{FileReader, Range64};
use crate::description::table::TomlTable;
use crate::description::{messages, Noted};
use toml::de::DeValue;

const DRIVE: &[&str] =
    &["name", "joint", "ratio", "joints", "motor", "actuator", "stages", "efficiency", "limits", "rotor"];
const MOTOR: &[&str] =
    &["torque_constant", "emf_constant", "resistance", "inductance", "rotor_inertia", "friction", "thermal"];
const ACTUATOR: &[&str] = &["C", "f", "d", "T", "position"];
const THERMAL: &[&str] = &["winding_housing", "housing_ambient", "winding_time", "housing_time", "ambient", "limit"];
const STAGE: &[&str] = &["ratio", "stiffness", "damping", "input_inertia", "output_inertia", "efficiency"];

impl FileReader<'_> {
    /// The drives of an array of tables `[[drive]]`.
    pub fn drives_at(&mut self, top: &TomlTable) -> Vec<WrittenDrive> {
        let tables = self.tables_at(top, "drive");
        tables.into_iter().filter_map(|table| self.drive(table)).collect()
    }

    fn drive(&mut self, mut table: TomlTable) -> Option<WrittenDrive> {
        self.drive_numbers.clear();
        let named = self.name_at(&table, "name", "drive");
        let joint = self.name_at(&table, "joint", "joint");
        let name = named.or_else(|| joint.clone());
        if let Some(name) = &name {
            table.owner = format!("drive `{}`", name.value);
        }
        self.check_keys(&table, DRIVE);
        let joints = self.joints(&table, joint);
        for (a, b) in [("joint", "joints"), ("ratio", "joints"), ("motor", "actuator")] {
            if let (true, Some((_, span))) = (table.has(a), table.get(b)) {
                self.complain(&span, messages::written_twice(&table.owner, a, b));
            }
        }
        let actuator = match table.has("actuator") {
            true => self.actuator(&table),
            false => self.motor(&table),
        };
        let stages = self.stages(&table);
        let efficiency = self.efficiency(&table);
        let limits = self.table_at(&table, "limits", &format!("limits of {}", table.owner));
        let (mut input_limit, mut current_limit, mut rating) = (None, None, WrittenRating::default());
        if let Some(limits) = limits {
            self.check_keys(&limits, &["input", "current", "continuous_current", "speed"]);
            input_limit = self.rated(&limits, "input", Must::BePositive);
            current_limit = self.rated(&limits, "current", Must::BePositive);
            rating.continuous_current = self.rated(&limits, "continuous_current", Must::BePositive);
            rating.speed = self.rated(&limits, "speed", Must::BePositive);
            for key in ["current", "continuous_current"] {
                if let (true, Some((_, span))) = (table.has("actuator"), limits.get(key)) {
                    self.complain(&span, messages::unknown_key(&limits.owner, key, &["input", "speed"]));
                }
            }
        }
        if let Some(motor) = self.table_at(&table, "motor", &format!("motor of {}", table.owner)) {
            if let Some(thermal) = self.table_at(&motor, "thermal", &format!("thermal data of {}", table.owner)) {
                rating.thermal = self.thermal(&thermal);
            }
        }
        let (actuator, joints) = (actuator?, joints?);
        let rotor = match table.has("rotor") {
            true => Some(self.rotor(&table, &actuator)?),
            false => None,
        };
        let name = match name {
            Some(name) => name,
            None => {
                self.require(&table, "name", "name = \"...\"");
                return None;
            }
        };
        Some(WrittenDrive {
            name,
            joints,
            actuator,
            stages: stages?,
            efficiency,
            input_limit,
            current_limit,
            rotor,
            rating,
            written: AsWritten(std::mem::take(&mut self.drive_numbers)),
        })
    }

    /// A number of a range that equations have, or a complaint.
    fn judged(&mut self, table: &TomlTable, key: &str, must: Must) -> Option<f64> {
        let x = self.in_range(table, key, must)?;
        let is_needed = !must.holds(0.0);
        let value = x.value;
        self.drive_numbers.push(WrittenNumber { what: table.what(key), value: x, is_needed });
        Some(value)
    }

    /// A number of a range that no equation has, or a complaint.
    fn rated(&mut self, table: &TomlTable, key: &str, must: Must) -> Option<f64> {
        self.in_range(table, key, must).map(|x| x.value)
    }

    fn in_range(&mut self, table: &TomlTable, key: &str, must: Must) -> Option<Noted<f64>> {
        let x = self.real_at(table, key, Range64::Finite)?;
        if must.holds(x.value) {
            return Some(x);
        }
        let (be, help) = must.words();
        self.diagnostics.push(messages::drive_number(&table.what(key), x.value, be, help).at(&x.place));
        None
    }

    fn required(&mut self, table: &TomlTable, key: &str, example: &str, must: Must) -> Option<f64> {
        self.require(table, key, example);
        self.judged(table, key, must)
    }

    fn joints(&mut self, table: &TomlTable, joint: Option<Noted<String>>) -> Option<Vec<(Noted<String>, f64)>> {
        let Some(joints) = self.table_at(table, "joints", &format!("joints of {}", table.owner)) else {
            if !table.has("joints") {
                self.require(table, "joint", "joint = \"...\"");
            }
            let ratio = match table.has("ratio") {
                true => self.judged(table, "ratio", Must::NotBeZero)?,
                false => 1.0,
            };
            return Some(vec![(joint?, ratio)]);
        };
        let mut found = Vec::new();
        for key in joints.table.keys() {
            let ratio = self.judged(&joints, key.get_ref(), Must::NotBeZero);
            let name = self.name("joint", key.get_ref(), &key.span());
            found.push((name?, ratio?));
        }
        // in the file's order, whatever the parser's
        found.sort_by_key(|(name, _): &(Noted<String>, f64)| name.place.span.start);
        if found.is_empty() {
            self.complain(&joints.span, messages::missing_key(&joints.owner, "joint", "joints = { wrist = 50.0 }"));
            return None;
        }
        Some(found)
    }

    fn motor(&mut self, table: &TomlTable) -> Option<WrittenActuator> {
        const EXAMPLE: &str = "motor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-5 }";
        self.require(table, "motor", EXAMPLE);
        let motor = self.table_at(table, "motor", &format!("motor of {}", table.owner))?;
        self.check_keys(&motor, MOTOR);
        let torque_constant = self.required(&motor, "torque_constant", "torque_constant = 0.05", Must::BePositive);
        let resistance = self.required(&motor, "resistance", "resistance = 1.2", Must::BePositive);
        let rotor_inertia = self.required(&motor, "rotor_inertia", "rotor_inertia = 1e-5", Must::BePositive);
        let mut optional = |key: &str, must: Must| match motor.has(key) {
            true => self.judged(&motor, key, must).map(Some),
            false => Some(None),
        };
        let inductance = optional("inductance", Must::BePositive);
        let friction = optional("friction", Must::NotBeNegative);
        let emf_constant = optional("emf_constant", Must::NotBeNegative);
        Some(WrittenActuator::Motor {
            torque_constant: torque_constant?,
            emf_constant: emf_constant?.or(torque_constant)?,
            resistance: resistance?,
            inductance: inductance?,
            rotor_inertia: rotor_inertia?,
            friction: friction?.unwrap_or(0.0),
        })
    }

    fn thermal(&mut self, table: &TomlTable) -> Option<WrittenThermal> {
        self.check_keys(table, THERMAL);
        let mut needed = |key: &str| {
            self.require(table, key, &format!("{key} = 2.0"));
            self.rated(table, key, Must::BePositive)
        };
        let (winding_housing, housing_ambient) = (needed("winding_housing"), needed("housing_ambient"));
        let (winding_time, housing_time) = (needed("winding_time"), needed("housing_time"));
        let ambient = self.real_at(table, "ambient", Range64::Finite).map_or(25.0, |x| x.value);
        let limit = self.real_at(table, "limit", Range64::Finite);
        if let Some(limit) = limit.as_ref().filter(|limit| limit.value <= ambient) {
            let (be, help) =
                ("above the ambient temperature", "temperatures are in °C; `ambient` is 25 unless it is given");
            self.diagnostics.push(messages::drive_number(&table.what("limit"), limit.value, be, help).at(&limit.place));
        }
        Some(WrittenThermal {
            winding_housing: winding_housing?,
            housing_ambient: housing_ambient?,
            winding_time: winding_time?,
            housing_time: housing_time?,
            ambient,
            limit: limit.map(|x| x.value),
        })
    }

    fn actuator(&mut self, table: &TomlTable) -> Option<WrittenActuator> {
        let a = self.table_at(table, "actuator", &format!("actuator of {}", table.owner))?;
        self.check_keys(&a, ACTUATOR);
        for key in &ACTUATOR[..4] {
            self.require(&a, key, "actuator = { C = [[0, 1], [0, -2]], f = [0, -10], d = [0, 5], T = [0, 1] }");
        }
        let c = self.rows_at(&a, "C");
        let mut row = |key: &str| self.row_at(&a, key);
        let (f, d, t) = (row("f"), row("d"), row("T"));
        let position = if a.has("position") { Some(row("position")?) } else { None };
        let (c, f, d, t) = (c?, f?, d?, t?);
        let n = f.value.len();
        let mut fits = n > 0 && c.value.len() == n && c.value.iter().all(|row| row.len() == n);
        fits &= [&d, &t].into_iter().chain(&position).all(|row| row.value.len() == n);
        if !fits {
            self.complain(&a.span, messages::actuator_shape(&a.owner, n));
            return None;
        }
        for (key, row) in [("f", &f), ("d", &d), ("T", &t)].into_iter().chain(position.iter().map(|p| ("position", p)))
        {
            self.write_down(&a, key, row);
        }
        let flat = Noted::new(c.value.concat(), c.place);
        self.write_down(&a, "C", &flat);
        let position = position.map(|p| p.value);
        Some(WrittenActuator::Linear { c: flat, f: f.value, d: d.value, t: t.value, position })
    }

    fn write_down(&mut self, table: &TomlTable, key: &str, row: &Noted<Vec<f64>>) {
        let (what, place) = (table.what(key), &row.place);
        let noted = |x: &f64| Noted { value: *x, place: place.clone() };
        let written = |x: &f64| WrittenNumber { what: what.clone(), value: noted(x), is_needed: false };
        self.drive_numbers.extend(row.value.iter().map(written));
    }

    fn row_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<Vec<f64>>> {
        let (value, span) = table.get(key)?;
        let row = self.row(&table.what(key), value, &span)?;
        Some(self.value(row, &span))
    }

    fn rows_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<Vec<Vec<f64>>>> {
        let (value, span) = table.get(key)?;
        let DeValue::Array(rows) = value else {
            self.wrong_type(&table.what(key), "rows in an array", value, &span);
            return None;
        };
        let rows: Vec<_> = rows.iter().map(|r| self.row(&table.what(key), r.get_ref(), &r.span())).collect();
        let rows: Option<Vec<Vec<f64>>> = rows.into_iter().collect();
        Some(self.value(rows?, &span))
    }

    fn stages(&mut self, table: &TomlTable) -> Option<Vec<TransmissionStage>> {
        if let Some((value, span)) = table.get("stages").filter(|(value, _)| !value.is_array()) {
            self.wrong_type(&table.what("stages"), "an array of tables", value, &span);
            return None;
        }
        let mut stages = Vec::new();
        let mut is_good = true;
        for (i, mut stage) in self.tables_at(table, "stages").into_iter().enumerate() {
            stage.owner = format!("stage {} of {}", i + 1, table.owner);
            self.check_keys(&stage, STAGE);
            let ratio = match stage.has("ratio") {
                true => self.judged(&stage, "ratio", Must::NotBeZero),
                false => Some(1.0),
            };
            let place = stage.get("ratio").map_or_else(|| stage.span.clone(), |(_, span)| span);
            let mut optional = |key: &str, must: Must| match stage.has(key) {
                true => self.judged(&stage, key, must).map(Some),
                false => Some(None),
            };
            let stiffness = optional("stiffness", Must::BePositive);
            let damping = optional("damping", Must::BePositive);
            let (before, behind) =
                (optional("input_inertia", Must::NotBeNegative), optional("output_inertia", Must::NotBeNegative));
            if stage.has("damping") {
                self.require(&stage, "stiffness", "stiffness = 1e4");
            }
            let efficiency = self.efficiency(&stage);
            let (Some(ratio), Some(stiffness), Some(damping), Some(before), Some(behind)) =
                (ratio, stiffness, damping, before, behind)
            else {
                is_good = false;
                continue;
            };
            stages.push(TransmissionStage {
                ratio: Noted { value: ratio, place: self.place(&place) },
                stiffness,
                damping,
                input_inertia: before.unwrap_or(0.0),
                output_inertia: behind.unwrap_or(0.0),
                efficiency,
            });
        }
        is_good.then_some(stages)
    }

    /// A number for both directions, or `{ forward, backward }`.
    fn efficiency(&mut self, table: &TomlTable) -> Option<[f64; 2]> {
        let (value, _) = table.get("efficiency")?;
        if !value.is_table() {
            return self.judged(table, "efficiency", Must::BeAnEfficiency).map(|both| [both; 2]);
        }
        let both = self.table_at(table, "efficiency", &format!("efficiency of {}", table.owner))?;
        self.check_keys(&both, &["forward", "backward"]);
        let forward = self.required(&both, "forward", "forward = 0.8", Must::BeAnEfficiency);
        let backward = self.required(&both, "backward", "backward = 0.7", Must::BeAnEfficiency);
        Some([forward?, backward?])
    }

    fn rotor(&mut self, table: &TomlTable, actuator: &WrittenActuator) -> Option<(Noted<String>, [f64; 3], f64)> {
        let rotor = self.table_at(table, "rotor", &format!("rotor of {}", table.owner))?;
        self.check_keys(&rotor, &["link", "axis", "inertia"]);
        self.require(&rotor, "link", "link = \"...\"");
        self.require(&rotor, "axis", "axis = [0.0, 0.0, 1.0]");
        let link = self.name_at(&rotor, "link", "link");
        let axis = self.vector_at(&rotor, "axis")?;
        let length = axis.value.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !(1e-6..=1e6).contains(&length) {
            let (be, help) = ("a direction", "write its components, such as `[0.0, 0.0, 1.0]`");
            self.diagnostics.push(messages::drive_number(&rotor.what("axis"), length, be, help).at(&axis.place));
            return None;
        }
        let inertia = match (rotor.has("inertia"), actuator) {
            (false, WrittenActuator::Motor { rotor_inertia, .. }) => Some(*rotor_inertia),
            _ => self.required(&rotor, "inertia", "inertia = 1e-5", Must::BePositive),
        };
        Some((link?, axis.value, inertia?))
    }
}
