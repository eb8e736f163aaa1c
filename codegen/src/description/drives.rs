//! `[[drive]]` tables: actuators and transmissions, in TOML robot files and in scenes; the schema is in `SCHEMA.md`.

use super::reader::{Range64, Reader};
use super::table::Table;
use super::{messages, Value};
use crate::diagnostic::Place;
use std::fmt;
use straightline_core::{Dd, Real};
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

/// A drive as written; over another scalar, with such numbers in place of those that can be set by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive<T = f64> {
    /// Its name: that of its joint where the file says nothing.
    pub name: Noted<String>,
    /// Its joints, with the speed of the last shaft over that of each \[1 or rad/m\].
    pub joints: Vec<(Noted<String>, T)>,
    /// What makes the torque.
    pub actuator: Actuator<T>,
    /// Stages of the transmission, from the actuator on.
    pub stages: Vec<Stage<T>>,
    /// η′ and η″ of the gear before the joints.
    pub efficiency: Option<[T; 2]>,
    /// Greatest input \[V, or the input's unit\].
    pub input_limit: Option<T>,
    /// Greatest current \[A\].
    pub current_limit: Option<T>,
    /// The link that carries the rotor, the axis in its frame and the inertia about it \[kg·m²\], where its turning in space
    /// counts.
    pub rotor: Option<(Noted<String>, [f64; 3], T)>,
    /// What it bears.
    pub rating: Rating,
    /// The numbers of the file that equations have.
    pub written: AsWritten,
}

/// A number as it is written in a file.
#[derive(Clone, Debug)]
pub struct Written {
    /// Which it is: ``ratio of drive `one` ``.
    pub what: String,
    /// Its value.
    pub value: Noted<f64>,
    /// Whether it must not become zero.
    pub is_needed: bool,
}

/// Numbers as they are written: no part of the drive, which may have been given others since.
#[derive(Clone, Debug, Default)]
pub struct AsWritten(pub Vec<Written>);

impl PartialEq for AsWritten {
    fn eq(&self, _: &AsWritten) -> bool {
        true
    }
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
pub enum Actuator<T = f64> {
    /// A DC motor.
    Motor {
        /// C_M \[N·m/A\].
        torque_constant: T,
        /// C_E \[V·s/rad\]; C_M where the file says nothing.
        emf_constant: T,
        /// R \[Ω\].
        resistance: T,
        /// L \[H\].
        inductance: Option<T>,
        /// J \[kg·m²\].
        rotor_inertia: T,
        /// B \[N·m·s/rad\].
        friction: T,
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
pub struct Stage<T = f64> {
    /// N: speed before it over speed behind it.
    pub ratio: Noted<T>,
    /// c \[N·m/rad\], on the side of the joint.
    pub stiffness: Option<T>,
    /// d \[N·m·s/rad\], on the side of the joint.
    pub damping: Option<T>,
    /// I′ \[kg·m²\], before the gear.
    pub input_inertia: T,
    /// I″ \[kg·m²\], behind the gear.
    pub output_inertia: T,
    /// η′ and η″.
    pub efficiency: Option<[T; 2]>,
}

/// What a number of drives is.
#[derive(Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Its name, of stages without the number of the stage.
    pub name: &'static str,
    /// What it means, with its unit.
    pub meaning: &'static str,
    /// Which values files and sweeps may give it.
    pub must: Must,
    /// Which values it may have at run time, where the equations keep their form.
    pub at_run_time: Must,
}

macro_rules! quantities {
    ($($constant:ident: $name:literal, $meaning:literal, $must:ident, $at_run_time:ident;)*) => {
        $(const $constant: &Quantity =
            &Quantity { name: $name, meaning: $meaning, must: Must::$must, at_run_time: Must::$at_run_time };)*

        /// Everything that can be set by name.
        pub const QUANTITIES: &[&Quantity] = &[$($constant),*];
    };
}

quantities! {
    RATIO: "ratio", "speed of the shaft over speed of the joint, or before the gear over behind it \\[1 or rad/m\\]", NotBeZero, NotBeZero;
    TORQUE_CONSTANT: "torque_constant", "C_M \\[N·m/A\\]", BePositive, BePositive;
    EMF_CONSTANT: "emf_constant", "C_E \\[V·s/rad\\]", NotBeNegative, NotBeNegative;
    RESISTANCE: "resistance", "R \\[Ω\\]", BePositive, BePositive;
    INDUCTANCE: "inductance", "L \\[H\\]", BePositive, BePositive;
    ROTOR_INERTIA: "rotor_inertia", "J of the motor about its axis \\[kg·m²\\]", BePositive, BePositive;
    MOTOR_FRICTION: "motor_friction", "B, viscous \\[N·m·s/rad\\]", NotBeNegative, NotBeNegative;
    STIFFNESS: "stiffness", "c of the spring behind the gear \\[N·m/rad\\]", BePositive, BePositive;
    STAGE_DAMPING: "damping", "d of the spring behind the gear \\[N·m·s/rad\\]", NotBeNegative, BePositive;
    INPUT_INERTIA: "input_inertia", "I′ of the gear \\[kg·m²\\]", NotBeNegative, BePositive;
    OUTPUT_INERTIA: "output_inertia", "I″ of the gear \\[kg·m²\\]", NotBeNegative, BePositive;
    EFFICIENCY: "efficiency", "η of the gear in both directions \\[1\\]", BeAnEfficiency, BeAnEfficiency;
    EFFICIENCY_FORWARD: "efficiency_forward", "η′ of the gear while it drives \\[1\\]", BeAnEfficiency, BeAnEfficiency;
    EFFICIENCY_BACKWARD: "efficiency_backward", "η″ of the gear while it is driven \\[1\\]", BeAnEfficiency, BeAnEfficiency;
    INPUT_LIMIT: "input_limit", "greatest \\|u\\| \\[V, or the unit of u\\]", BePositive, BePositive;
    CURRENT_LIMIT: "current_limit", "greatest current \\[A\\]", BePositive, BePositive;
}

/// A number of a drive that can be set by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// Its name: `ratio`, `stage_2_stiffness`.
    pub name: String,
    /// What it is.
    pub quantity: &'static Quantity,
    /// Its value.
    pub value: f64,
    /// Where it stands among the drive's numbers, then those that follow it unless they are set by a name of their own.
    at: Vec<usize>,
}

impl Number {
    /// Whether it is a limit, which no equation has beside saturation.
    pub fn is_limit(&self) -> bool {
        [INPUT_LIMIT, CURRENT_LIMIT].contains(&self.quantity)
    }

    /// Whether it is another's, by whatever name.
    pub fn is(&self, other: &Number) -> bool {
        self.at[0] == other.at[0]
    }
}

impl<T> Drive<T> {
    /// All numbers in their order, each with the stage that it is of.
    fn flat(&mut self) -> Vec<(&'static Quantity, Option<usize>, &mut T)> {
        let mut all: Vec<(&'static Quantity, Option<usize>, &mut T)> = Vec::new();
        if let Actuator::Motor { torque_constant, emf_constant, resistance, inductance, rotor_inertia, friction } =
            &mut self.actuator
        {
            all.extend([
                (TORQUE_CONSTANT, None, torque_constant),
                (EMF_CONSTANT, None, emf_constant),
                (RESISTANCE, None, resistance),
                (ROTOR_INERTIA, None, rotor_inertia),
                (MOTOR_FRICTION, None, friction),
            ]);
            all.extend(inductance.as_mut().map(|x| (INDUCTANCE, None, x)));
        }
        for (k, stage) in self.stages.iter_mut().enumerate() {
            let of = Some(k);
            all.push((RATIO, of, &mut stage.ratio.value));
            all.extend(stage.stiffness.as_mut().map(|x| (STIFFNESS, of, x)));
            all.extend(stage.damping.as_mut().map(|x| (STAGE_DAMPING, of, x)));
            all.push((INPUT_INERTIA, of, &mut stage.input_inertia));
            all.push((OUTPUT_INERTIA, of, &mut stage.output_inertia));
            for [forward, backward] in stage.efficiency.iter_mut().map(|both| both.each_mut()) {
                all.extend([(EFFICIENCY_FORWARD, of, forward), (EFFICIENCY_BACKWARD, of, backward)]);
            }
        }
        for [forward, backward] in self.efficiency.iter_mut().map(|both| both.each_mut()) {
            all.extend([(EFFICIENCY_FORWARD, None, forward), (EFFICIENCY_BACKWARD, None, backward)]);
        }
        all.extend(self.input_limit.as_mut().map(|x| (INPUT_LIMIT, None, x)));
        all.extend(self.current_limit.as_mut().map(|x| (CURRENT_LIMIT, None, x)));
        // what has no name of its own, or not always
        all.extend(self.rotor.as_mut().map(|(_, _, inertia)| (ROTOR_INERTIA, None, inertia)));
        all.extend(self.joints.iter_mut().map(|(_, ratio)| (RATIO, None, ratio)));
        all
    }
}

impl Drive {
    /// Numbers that can be set by name, as far as the drive has them: of a motor its keys (`friction` as `motor_friction`), of stages
    /// `stage_2_ratio` and so on, of the drive `efficiency`, `input_limit` and `current_limit`, and `joint_ratio` of the one joint. For
    /// short, `ratio` is that of the only gear, `stiffness` and `stage_damping` those of the first elastic stage. A voltage constant that is the
    /// torque constant remains it, and so does the inertia of a rotor that turns in space remain the motor's.
    pub fn numbers(&self) -> Vec<Number> {
        let mut copy = self.clone();
        let flat: Vec<_> = copy.flat().into_iter().map(|(quantity, stage, x)| (quantity, stage, *x)).collect();
        let (joints, rotors) = (self.joints.len(), usize::from(self.rotor.is_some()));
        let (joint_ratio, rotor) = (flat.len() - joints, flat.len() - joints - rotors);
        let is_motor = matches!(self.actuator, Actuator::Motor { .. });
        let mut all: Vec<Number> = Vec::new();
        let mut add =
            |name: String, quantity, at: Vec<usize>| all.push(Number { name, quantity, value: flat[at[0]].2, at });
        for (k, (quantity, stage, x)) in flat[..rotor].iter().enumerate() {
            let named = |name: &str| stage.map_or(name.to_string(), |stage| format!("stage_{}_{name}", stage + 1));
            let next = |quantity| flat.get(k + 1).filter(|next| next.0 == quantity && next.2 == *x).map(|_| k + 1);
            let follower = match quantity.name {
                "torque_constant" => next(EMF_CONSTANT),
                "rotor_inertia" => (rotors == 1 && flat[rotor].2 == *x).then_some(rotor),
                _ => None,
            };
            add(named(quantity.name), quantity, [k].into_iter().chain(follower).collect());
            if *quantity == EFFICIENCY_FORWARD {
                next(EFFICIENCY_BACKWARD)
                    .into_iter()
                    .for_each(|other| add(named(EFFICIENCY.name), EFFICIENCY, vec![k, other]));
            }
        }
        if rotors == 1 && !is_motor {
            add(ROTOR_INERTIA.name.to_string(), ROTOR_INERTIA, vec![rotor]);
        }
        if joints == 1 {
            add("joint_ratio".to_string(), RATIO, vec![joint_ratio]);
        }
        // for short
        let at = |quantity: &'static Quantity| flat.iter().position(|x| x.0 == quantity && x.1.is_some());
        let ratio = match (self.stages.len(), joints) {
            (0, 1) => Some(joint_ratio),
            (1, 1) => at(RATIO),
            _ => None,
        };
        for (name, quantity, at) in [
            ("ratio", RATIO, ratio),
            ("stiffness", STIFFNESS, at(STIFFNESS)),
            ("stage_damping", STAGE_DAMPING, at(STAGE_DAMPING)),
        ] {
            at.into_iter().for_each(|at| add(name.to_string(), quantity, vec![at]));
        }
        all
    }

    /// What can be set beside its [`numbers`](Drive::numbers), but is no parameter at run time: `joint_ratio_elbow` of each of several joints,
    /// entries of an actuator's matrices (`C_1_2`, `f_1`, `d_1`, `T_1`, `position_1`), and what the actuator bears.
    fn others(&mut self) -> Vec<(String, Option<Must>, &mut f64)> {
        let mut all: Vec<(String, Option<Must>, &mut f64)> = Vec::new();
        if self.joints.len() > 1 {
            let ratio = |(joint, n)| (format!("joint_ratio_{}", joint), Some(Must::NotBeZero), n);
            all.extend(self.joints.iter_mut().map(|(joint, n)| ratio((&joint.value, n))));
        }
        if let Actuator::Linear { c, f, d, t, position } = &mut self.actuator {
            let n = f.len();
            let entry = |(k, x)| (format!("C_{}_{}", k / n + 1, k % n + 1), None, x);
            all.extend(c.value.iter_mut().enumerate().map(entry));
            for (key, row) in
                [("f", f), ("d", d), ("T", t)].into_iter().chain(position.as_mut().map(|p| ("position", p)))
            {
                all.extend(row.iter_mut().enumerate().map(|(k, x)| (format!("{key}_{}", k + 1), None, x)));
            }
        }
        let Rating { speed, continuous_current, thermal } = &mut self.rating;
        let borne = [("speed_limit", speed), ("continuous_current", continuous_current)];
        let positive = |name: &str| (name.to_string(), Some(Must::BePositive));
        for (name, x) in borne.into_iter().filter_map(|(name, x)| Some((positive(name), x.as_mut()?))) {
            all.push((name.0, name.1, x));
        }
        if let Some(Thermal { winding_housing, housing_ambient, winding_time, housing_time, ambient, limit }) = thermal
        {
            for (name, x) in [
                ("winding_housing", winding_housing),
                ("housing_ambient", housing_ambient),
                ("winding_time", winding_time),
                ("housing_time", housing_time),
            ] {
                all.push((name.to_string(), Some(Must::BePositive), x));
            }
            all.push(("ambient".to_string(), None, ambient));
            all.extend(limit.as_mut().map(|x| ("temperature_limit".to_string(), None, x)));
        }
        all
    }

    /// The names of everything that [`set`](Drive::set) sets.
    pub fn names(&self) -> Vec<String> {
        let numbers = self.numbers().into_iter().map(|number| number.name);
        numbers.chain(self.clone().others().into_iter().map(|(name, ..)| name)).collect()
    }

    /// Sets one of its numbers: those that can be parameters at run time, and entries of actuators, ratios of several joints and
    /// what the actuator bears. `None` if the drive has no such number.
    ///
    /// # Errors
    /// What the number has to be.
    pub fn set(&mut self, name: &str, value: f64) -> Option<Result<(), &'static str>> {
        let must = match self.numbers().into_iter().find(|number| number.name == name) {
            Some(number) => {
                *self = self.with(std::slice::from_ref(&number), &[value]);
                Some(number.quantity.must)
            }
            None => {
                let (_, must, x) = self.others().into_iter().find(|(other, ..)| other == name)?;
                *x = value;
                must
            }
        };
        let is_hot = |t: &Thermal| t.limit.is_some_and(|limit| limit <= t.ambient);
        Some(match must {
            Some(must) if !must.holds(value) => Err(must.words().0),
            _ if self.rating.thermal.as_ref().is_some_and(is_hot) => match name {
                "ambient" => Err("below the limit of the winding"),
                _ => Err("above the ambient temperature"),
            },
            _ => Ok(()),
        })
    }

    /// The same drive over another scalar, with these values of some of its numbers.
    #[must_use]
    pub fn with<T: Real>(&self, numbers: &[Number], values: &[T]) -> Drive<T> {
        let mut drive = self.over::<T>();
        let mut flat = drive.flat();
        // what is named itself does not follow
        for follows in [true, false] {
            for (number, value) in numbers.iter().zip(values) {
                let at = if follows { &number.at[1..] } else { &number.at[..1] };
                at.iter().for_each(|at| *flat[*at].2 = *value);
            }
        }
        drive
    }

    /// The same drive with rigid stages, or without losses.
    #[must_use]
    pub fn in_part(&self, is_elastic: bool, is_lossy: bool) -> Drive {
        let mut drive = self.clone();
        for stage in &mut drive.stages {
            stage.stiffness = stage.stiffness.filter(|_| is_elastic);
            stage.damping = stage.damping.filter(|_| is_elastic);
            stage.efficiency = stage.efficiency.filter(|_| is_lossy);
        }
        drive.efficiency = drive.efficiency.filter(|_| is_lossy);
        drive
    }

    fn over<T: Real>(&self) -> Drive<T> {
        let t = |x: f64| T::constant(Dd::from(x));
        let both = |e: [f64; 2]| e.map(t);
        let stage = |s: &Stage| Stage {
            ratio: Noted { value: t(s.ratio.value), place: s.ratio.place.clone() },
            stiffness: s.stiffness.map(t),
            damping: s.damping.map(t),
            input_inertia: t(s.input_inertia),
            output_inertia: t(s.output_inertia),
            efficiency: s.efficiency.map(both),
        };
        Drive {
            name: self.name.clone(),
            joints: self.joints.iter().map(|(joint, ratio)| (joint.clone(), t(*ratio))).collect(),
            actuator: match &self.actuator {
                Actuator::Motor { torque_constant, emf_constant, resistance, inductance, rotor_inertia, friction } => {
                    Actuator::Motor {
                        torque_constant: t(*torque_constant),
                        emf_constant: t(*emf_constant),
                        resistance: t(*resistance),
                        inductance: inductance.map(t),
                        rotor_inertia: t(*rotor_inertia),
                        friction: t(*friction),
                    }
                }
                Actuator::Linear { c, f, d, t, position } => Actuator::Linear {
                    c: c.clone(),
                    f: f.clone(),
                    d: d.clone(),
                    t: t.clone(),
                    position: position.clone(),
                },
            },
            stages: self.stages.iter().map(stage).collect(),
            efficiency: self.efficiency.map(both),
            input_limit: self.input_limit.map(t),
            current_limit: self.current_limit.map(t),
            rotor: self.rotor.as_ref().map(|(link, axis, inertia)| (link.clone(), *axis, t(*inertia))),
            rating: self.rating.clone(),
            written: self.written.clone(),
        }
    }
}

/// Which numbers a key takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Must {
    /// Above zero.
    BePositive,
    /// Zero or above.
    NotBeNegative,
    /// Not zero.
    NotBeZero,
    /// Above zero, at most one.
    BeAnEfficiency,
}

impl Must {
    /// Whether a number is of them.
    pub fn holds(self, x: f64) -> bool {
        match self {
            Must::BePositive => x > 0.0,
            Must::NotBeNegative => x >= 0.0,
            Must::NotBeZero => x != 0.0,
            Must::BeAnEfficiency => x > 0.0 && x <= 1.0,
        }
    }

    /// The same in Rust, of a variable `x` that is finite.
    pub fn condition(self) -> &'static str {
        match self {
            Must::BePositive => "x > 0.0",
            Must::NotBeNegative => "x >= 0.0",
            Must::NotBeZero => "x != 0.0",
            Must::BeAnEfficiency => "x > 0.0 && x <= 1.0",
        }
    }

    /// What a number must be, and what to write otherwise.
    pub fn words(self) -> (&'static str, &'static str) {
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
        let (mut input_limit, mut current_limit, mut rating) = (None, None, Rating::default());
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
            written: AsWritten(std::mem::take(&mut self.drive_numbers)),
        })
    }

    /// A number of a range that equations have, or a complaint.
    fn judged(&mut self, table: &Table, key: &str, must: Must) -> Option<f64> {
        let x = self.in_range(table, key, must)?;
        let is_needed = !must.holds(0.0);
        let value = x.value;
        self.drive_numbers.push(Written { what: table.what(key), value: x.into(), is_needed });
        Some(value)
    }

    /// A number of a range that no equation has, or a complaint.
    fn rated(&mut self, table: &Table, key: &str, must: Must) -> Option<f64> {
        self.in_range(table, key, must).map(|x| x.value)
    }

    fn in_range(&mut self, table: &Table, key: &str, must: Must) -> Option<Value<f64>> {
        let x = self.real_at(table, key, Range64::Finite)?;
        if must.holds(x.value) {
            return Some(x);
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
        for (key, row) in [("f", &f), ("d", &d), ("T", &t)].into_iter().chain(position.iter().map(|p| ("position", p)))
        {
            self.write_down(&a, key, row);
        }
        let flat = Value::new(c.value.concat(), c.place);
        self.write_down(&a, "C", &flat);
        let position = position.map(|p| p.value);
        Some(Actuator::Linear { c: flat.into(), f: f.value, d: d.value, t: t.value, position })
    }

    fn write_down(&mut self, table: &Table, key: &str, row: &Value<Vec<f64>>) {
        let (what, place) = (table.what(key), &row.place);
        let noted = |x: &f64| Noted { value: *x, place: place.clone() };
        let written = |x: &f64| Written { what: what.clone(), value: noted(x), is_needed: false };
        self.drive_numbers.extend(row.value.iter().map(written));
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
