//! `[[drive]]` tables: actuators and transmissions, in TOML robot files and in scenes; the schema is in `SCHEMA.md`.

use super::reader::{Range64, Reader};
use super::table::Table;
use super::{messages, Value};
use crate::diagnostic::Place;
use std::fmt;
use toml::de::DeValue;

const DRIVE: &[&str] =
    &["name", "joint", "ratio", "joints", "motor", "actuator", "stages", "efficiency", "limits", "rotor"];
const MOTOR: &[&str] =
    &["torque_constant", "emf_constant", "resistance", "inductance", "rotor_inertia", "friction", "thermal"];
const ACTUATOR: &[&str] = &["C", "f", "d", "T", "position"];
const THERMAL: &[&str] = &["winding_housing", "housing_ambient", "winding_time", "housing_time", "ambient", "limit"];
const STAGE: &[&str] = &["ratio", "stiffness", "damping", "input_inertia", "output_inertia", "efficiency"];

/// A value with its place, which says nothing of the value: equal and printed alike wherever it stands.
#[derive(Clone)]
pub struct Noted<T> {
    /// The value.
    pub value: T,
    /// Where it stands.
    pub place: Place,
}

impl<T: PartialEq> PartialEq for Noted<T> {
    fn eq(&self, other: &Noted<T>) -> bool {
        self.value == other.value
    }
}

impl<T: fmt::Debug> fmt::Debug for Noted<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.value.fmt(f)
    }
}

impl<T> From<Value<T>> for Noted<T> {
    fn from(v: Value<T>) -> Noted<T> {
        Noted { value: v.value, place: v.place }
    }
}

/// A drive as written.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Its name: that of its joint where the file says nothing.
    pub name: Noted<String>,
    /// Its joints, with the speed of the last shaft over that of each \[1 or rad/m\].
    pub joints: Vec<(Noted<String>, f64)>,
    /// What makes the torque.
    pub actuator: Actuator,
    /// Stages of the transmission, from the actuator on.
    pub stages: Vec<Stage>,
    /// η′ and η″ of the gear before the joints.
    pub efficiency: Option<[f64; 2]>,
    /// Greatest input \[V, or the input's unit\].
    pub input_limit: Option<f64>,
    /// Greatest current \[A\].
    pub current_limit: Option<f64>,
    /// The link that carries the rotor, the axis in its frame and the inertia about it \[kg·m²\], where its turning in space
    /// counts.
    pub rotor: Option<(Noted<String>, [f64; 3], f64)>,
    /// What it bears.
    pub rating: Rating,
}

/// What an actuator bears: no part of the equations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rating {
    /// Greatest speed \[rad/s\].
    pub speed: Option<f64>,
    /// Greatest rms current \[A\].
    pub continuous_current: Option<f64>,
    /// How its winding heats.
    pub thermal: Option<Thermal>,
}

/// Thermal data of a motor.
#[derive(Clone, Debug, PartialEq)]
pub struct Thermal {
    /// \[K/W\]
    pub winding_housing: f64,
    /// \[K/W\]
    pub housing_ambient: f64,
    /// \[s\]
    pub winding_time: f64,
    /// \[s\]
    pub housing_time: f64,
    /// \[°C\]
    pub ambient: f64,
    /// \[°C\]
    pub limit: Option<f64>,
}

/// What makes the torque.
#[derive(Clone, Debug, PartialEq)]
pub enum Actuator {
    /// A DC motor.
    Motor {
        /// C_M \[N·m/A\].
        torque_constant: f64,
        /// C_E \[V·s/rad\]; C_M where the file says nothing.
        emf_constant: f64,
        /// R \[Ω\].
        resistance: f64,
        /// L \[H\].
        inductance: Option<f64>,
        /// J \[kg·m²\].
        rotor_inertia: f64,
        /// B \[N·m·s/rad\].
        friction: f64,
    },
    /// ẋ = C x + f M + d u with θ̈ = T ẋ.
    Linear {
        /// C by rows.
        c: Noted<Vec<f64>>,
        /// f.
        f: Vec<f64>,
        /// d.
        d: Vec<f64>,
        /// T.
        t: Vec<f64>,
        /// The row P with θ = P x.
        position: Option<Vec<f64>>,
    },
}

/// A stage of a transmission; rigid without stiffness.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// N: speed before it over speed behind it.
    pub ratio: Noted<f64>,
    /// c \[N·m/rad\], on the side of the joint.
    pub stiffness: Option<f64>,
    /// d \[N·m·s/rad\], on the side of the joint.
    pub damping: Option<f64>,
    /// I′ \[kg·m²\], before the gear.
    pub input_inertia: f64,
    /// I″ \[kg·m²\], behind the gear.
    pub output_inertia: f64,
    /// η′ and η″.
    pub efficiency: Option<[f64; 2]>,
}

impl Drive {
    /// Numbers of drives that can be set by name: of a drive of one joint `ratio`, of motors their keys (`friction` as `motor_friction`), of the
    /// one elastic stage `stiffness` and `stage_damping`.
    pub const NUMBERS: [&str; 9] = [
        "ratio",
        "torque_constant",
        "emf_constant",
        "resistance",
        "inductance",
        "rotor_inertia",
        "motor_friction",
        "stiffness",
        "stage_damping",
    ];

    /// Sets one of [`NUMBERS`](Drive::NUMBERS); a voltage constant that is the torque constant remains it. `None` if the drive has no such
    /// number.
    ///
    /// # Errors
    /// What the number has to be.
    pub fn set(&mut self, key: &str, value: f64) -> Option<Result<(), &'static str>> {
        let (number, must) = match (key, &mut self.actuator) {
            ("ratio", _) => match (&mut self.stages[..], &mut self.joints[..]) {
                ([], [(_, ratio)]) => (ratio, Must::NotBeZero),
                ([stage], [_]) => (&mut stage.ratio.value, Must::NotBeZero),
                _ => return None,
            },
            ("stiffness", _) => (self.stages.iter_mut().find_map(|s| s.stiffness.as_mut())?, Must::BePositive),
            ("stage_damping", _) => (self.stages.iter_mut().find_map(|s| s.damping.as_mut())?, Must::NotBeNegative),
            (_, Actuator::Motor { torque_constant, emf_constant, resistance, inductance, rotor_inertia, friction }) => {
                match key {
                    "torque_constant" if emf_constant == torque_constant => {
                        *emf_constant = value;
                        (torque_constant, Must::BePositive)
                    }
                    "torque_constant" => (torque_constant, Must::BePositive),
                    "emf_constant" => (emf_constant, Must::NotBeNegative),
                    "resistance" => (resistance, Must::BePositive),
                    "inductance" => (inductance.as_mut()?, Must::BePositive),
                    "rotor_inertia" => (rotor_inertia, Must::BePositive),
                    "motor_friction" => (friction, Must::NotBeNegative),
                    _ => return None,
                }
            }
            _ => return None,
        };
        *number = value;
        Some(if must.holds(value) { Ok(()) } else { Err(must.words().0) })
    }
}

/// Which numbers a key takes.
#[derive(Clone, Copy)]
enum Must {
    BePositive,
    NotBeNegative,
    NotBeZero,
    BeAnEfficiency,
}

impl Must {
    fn holds(self, x: f64) -> bool {
        match self {
            Must::BePositive => x > 0.0,
            Must::NotBeNegative => x >= 0.0,
            Must::NotBeZero => x != 0.0,
            Must::BeAnEfficiency => x > 0.0 && x <= 1.0,
        }
    }

    fn words(self) -> (&'static str, &'static str) {
        match self {
            Must::BePositive => ("positive", "leave the key out where the effect is to be neglected, if it may be"),
            Must::NotBeNegative => ("zero or positive", "write its modulus"),
            Must::NotBeZero => ("not zero", "a direct connection has the ratio 1; a reversing one a negative ratio"),
            Must::BeAnEfficiency => ("above 0 and at most 1", "write 80 % as `0.8`; 1 is a gear without losses"),
        }
    }
}

impl Reader<'_> {
    /// The drives of an array of tables `[[drive]]`.
    pub fn drives_at(&mut self, top: &Table) -> Vec<Drive> {
        let tables = self.tables_at(top, "drive");
        tables.into_iter().filter_map(|table| self.drive(table)).collect()
    }

    fn drive(&mut self, mut table: Table) -> Option<Drive> {
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
        let (mut input_limit, mut current_limit, mut rating) = (None, None, Rating::default());
        if let Some(limits) = limits {
            self.check_keys(&limits, &["input", "current", "continuous_current", "speed"]);
            input_limit = self.judged(&limits, "input", Must::BePositive);
            current_limit = self.judged(&limits, "current", Must::BePositive);
            rating.continuous_current = self.judged(&limits, "continuous_current", Must::BePositive);
            rating.speed = self.judged(&limits, "speed", Must::BePositive);
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
        Some(Drive {
            name: name.into(),
            joints,
            actuator,
            stages: stages?,
            efficiency,
            input_limit,
            current_limit,
            rotor,
            rating,
        })
    }

    /// A number of a range, or a complaint.
    fn judged(&mut self, table: &Table, key: &str, must: Must) -> Option<f64> {
        let x = self.real_at(table, key, Range64::Finite)?;
        if must.holds(x.value) {
            return Some(x.value);
        }
        let (be, help) = must.words();
        self.diagnostics.push(messages::drive_number(&table.what(key), x.value, be, help).at(&x.place));
        None
    }

    fn required(&mut self, table: &Table, key: &str, example: &str, must: Must) -> Option<f64> {
        self.require(table, key, example);
        self.judged(table, key, must)
    }

    fn joints(&mut self, table: &Table, joint: Option<Value<String>>) -> Option<Vec<(Noted<String>, f64)>> {
        let Some(joints) = self.table_at(table, "joints", &format!("joints of {}", table.owner)) else {
            if !table.has("joints") {
                self.require(table, "joint", "joint = \"...\"");
            }
            let ratio = match table.has("ratio") {
                true => self.judged(table, "ratio", Must::NotBeZero)?,
                false => 1.0,
            };
            return Some(vec![(joint?.into(), ratio)]);
        };
        let mut found = Vec::new();
        for key in joints.table.keys() {
            let ratio = self.judged(&joints, key.get_ref(), Must::NotBeZero);
            let name = self.name("joint", key.get_ref(), &key.span());
            found.push((name?.into(), ratio?));
        }
        // in the file's order, whatever the parser's
        found.sort_by_key(|(name, _): &(Noted<String>, f64)| name.place.span.start);
        if found.is_empty() {
            self.complain(&joints.span, messages::missing_key(&joints.owner, "joint", "joints = { wrist = 50.0 }"));
            return None;
        }
        Some(found)
    }

    fn motor(&mut self, table: &Table) -> Option<Actuator> {
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
        Some(Actuator::Motor {
            torque_constant: torque_constant?,
            emf_constant: emf_constant?.or(torque_constant)?,
            resistance: resistance?,
            inductance: inductance?,
            rotor_inertia: rotor_inertia?,
            friction: friction?.unwrap_or(0.0),
        })
    }

    fn thermal(&mut self, table: &Table) -> Option<Thermal> {
        self.check_keys(table, THERMAL);
        let mut needed = |key: &str| self.required(table, key, &format!("{key} = 2.0"), Must::BePositive);
        let (winding_housing, housing_ambient) = (needed("winding_housing"), needed("housing_ambient"));
        let (winding_time, housing_time) = (needed("winding_time"), needed("housing_time"));
        let ambient = self.real_at(table, "ambient", Range64::Finite).map_or(25.0, |x| x.value);
        let limit = self.real_at(table, "limit", Range64::Finite);
        if let Some(limit) = limit.as_ref().filter(|limit| limit.value <= ambient) {
            let (be, help) =
                ("above the ambient temperature", "temperatures are in °C; `ambient` is 25 unless it is given");
            self.diagnostics.push(messages::drive_number(&table.what("limit"), limit.value, be, help).at(&limit.place));
        }
        Some(Thermal {
            winding_housing: winding_housing?,
            housing_ambient: housing_ambient?,
            winding_time: winding_time?,
            housing_time: housing_time?,
            ambient,
            limit: limit.map(|x| x.value),
        })
    }

    fn actuator(&mut self, table: &Table) -> Option<Actuator> {
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
        let flat = Value::new(c.value.concat(), c.place);
        let position = position.map(|p| p.value);
        Some(Actuator::Linear { c: flat.into(), f: f.value, d: d.value, t: t.value, position })
    }

    fn row_at(&mut self, table: &Table, key: &str) -> Option<Value<Vec<f64>>> {
        let (value, span) = table.get(key)?;
        let row = self.row(&table.what(key), value, &span)?;
        Some(self.value(row, &span))
    }

    fn rows_at(&mut self, table: &Table, key: &str) -> Option<Value<Vec<Vec<f64>>>> {
        let (value, span) = table.get(key)?;
        let DeValue::Array(rows) = value else {
            self.wrong_type(&table.what(key), "rows in an array", value, &span);
            return None;
        };
        let rows: Vec<_> = rows.iter().map(|r| self.row(&table.what(key), r.get_ref(), &r.span())).collect();
        let rows: Option<Vec<Vec<f64>>> = rows.into_iter().collect();
        Some(self.value(rows?, &span))
    }

    fn stages(&mut self, table: &Table) -> Option<Vec<Stage>> {
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
            stages.push(Stage {
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
    fn efficiency(&mut self, table: &Table) -> Option<[f64; 2]> {
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

    fn rotor(&mut self, table: &Table, actuator: &Actuator) -> Option<(Noted<String>, [f64; 3], f64)> {
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
            (false, Actuator::Motor { rotor_inertia, .. }) => Some(*rotor_inertia),
            _ => self.required(&rotor, "inertia", "inertia = 1e-5", Must::BePositive),
        };
        Some((link?.into(), axis.value, inertia?))
    }
}
