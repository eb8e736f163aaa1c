//! `[[drive]]` tables: actuators and transmissions, in TOML robot files and in scenes; the schema is in `SCHEMA.md`.

use super::Noted;
use straightline_core::{Dd, Real};

mod numbers;
mod read;

use numbers::*;
pub use numbers::{DriveNumber, Must, NumberKind, QUANTITIES};

/// A drive as written; over another scalar, with such numbers in place of those that can be set by name.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenDrive<T = f64> {
    /// Its name: that of its joint where the file says nothing.
    pub name: Noted<String>,
    /// Its joints, with the speed of the last shaft over that of each \[1 or rad/m\].
    pub joints: Vec<(Noted<String>, T)>,
    /// What makes the torque.
    pub actuator: WrittenActuator<T>,
    /// Stages of the transmission, from the actuator on.
    pub stages: Vec<TransmissionStage<T>>,
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
    pub rating: WrittenRating,
    /// The numbers of the file that equations have.
    pub written: AsWritten,
}

/// A number as it is written in a file.
#[derive(Clone, Debug)]
pub struct WrittenNumber {
    /// Which it is: ``ratio of drive `one` ``.
    pub what: String,
    /// Its value.
    pub value: Noted<f64>,
    /// Whether it must not become zero.
    pub is_needed: bool,
}

/// Numbers as they are written: no part of the drive, which may have been given others since.
#[derive(Clone, Debug, Default)]
pub struct AsWritten(pub Vec<WrittenNumber>);

impl PartialEq for AsWritten {
    fn eq(&self, _: &AsWritten) -> bool {
        true
    }
}

/// What an actuator bears: no part of the equations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WrittenRating {
    /// Greatest speed \[rad/s\].
    pub speed: Option<f64>,
    /// Greatest rms current \[A\].
    pub continuous_current: Option<f64>,
    /// How its winding heats.
    pub thermal: Option<WrittenThermal>,
}

/// Thermal data of a motor.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenThermal {
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
pub enum WrittenActuator<T = f64> {
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
pub struct TransmissionStage<T = f64> {
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

impl WrittenDrive {
    /// Numbers that can be set by name, as far as the drive has them: of a motor its keys (`friction` as `motor_friction`), of stages
    /// `stage_2_ratio` and so on, of the drive `efficiency`, `input_limit` and `current_limit`, and `joint_ratio` of the one joint. For
    /// short, `ratio` is that of the only gear, `stiffness` and `stage_damping` those of the first elastic stage. A voltage constant that is the
    /// torque constant remains it, and so does the inertia of a rotor that turns in space remain the motor's.
    pub fn numbers(&self) -> Vec<DriveNumber> {
        let mut copy = self.clone();
        let flat: Vec<_> = copy.flat().into_iter().map(|(quantity, stage, x)| (quantity, stage, *x)).collect();
        let (joints, rotors) = (self.joints.len(), usize::from(self.rotor.is_some()));
        let (joint_ratio, rotor) = (flat.len() - joints, flat.len() - joints - rotors);
        let is_motor = matches!(self.actuator, WrittenActuator::Motor { .. });
        let mut all: Vec<DriveNumber> = Vec::new();
        let mut add =
            |name: String, quantity, at: Vec<usize>| all.push(DriveNumber { name, quantity, value: flat[at[0]].2, at });
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
        let at = |quantity: &'static NumberKind| flat.iter().position(|x| x.0 == quantity && x.1.is_some());
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

    /// What can be set beside its [`numbers`](WrittenDrive::numbers), but is no parameter at run time: `joint_ratio_elbow` of each of several joints,
    /// entries of an actuator's matrices (`C_1_2`, `f_1`, `d_1`, `T_1`, `position_1`), and what the actuator bears.
    fn others(&mut self) -> Vec<(String, Option<Must>, &mut f64)> {
        let mut all: Vec<(String, Option<Must>, &mut f64)> = Vec::new();
        if self.joints.len() > 1 {
            let ratio = |(joint, n)| (format!("joint_ratio_{}", joint), Some(Must::NotBeZero), n);
            all.extend(self.joints.iter_mut().map(|(joint, n)| ratio((&joint.value, n))));
        }
        if let WrittenActuator::Linear { c, f, d, t, position } = &mut self.actuator {
            let n = f.len();
            let entry = |(k, x)| (format!("C_{}_{}", k / n + 1, k % n + 1), None, x);
            all.extend(c.value.iter_mut().enumerate().map(entry));
            for (key, row) in
                [("f", f), ("d", d), ("T", t)].into_iter().chain(position.as_mut().map(|p| ("position", p)))
            {
                all.extend(row.iter_mut().enumerate().map(|(k, x)| (format!("{key}_{}", k + 1), None, x)));
            }
        }
        let WrittenRating { speed, continuous_current, thermal } = &mut self.rating;
        let borne = [("speed_limit", speed), ("continuous_current", continuous_current)];
        let positive = |name: &str| (name.to_string(), Some(Must::BePositive));
        for (name, x) in borne.into_iter().filter_map(|(name, x)| Some((positive(name), x.as_mut()?))) {
            all.push((name.0, name.1, x));
        }
        if let Some(WrittenThermal { winding_housing, housing_ambient, winding_time, housing_time, ambient, limit }) =
            thermal
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

    /// The names of everything that [`set`](WrittenDrive::set) sets.
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
        let is_hot = |t: &WrittenThermal| t.limit.is_some_and(|limit| limit <= t.ambient);
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
    pub fn with<T: Real>(&self, numbers: &[DriveNumber], values: &[T]) -> WrittenDrive<T> {
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
    pub fn in_part(&self, is_elastic: bool, is_lossy: bool) -> WrittenDrive {
        let mut drive = self.clone();
        for stage in &mut drive.stages {
            stage.stiffness = stage.stiffness.filter(|_| is_elastic);
            stage.damping = stage.damping.filter(|_| is_elastic);
            stage.efficiency = stage.efficiency.filter(|_| is_lossy);
        }
        drive.efficiency = drive.efficiency.filter(|_| is_lossy);
        drive
    }

    fn over<T: Real>(&self) -> WrittenDrive<T> {
        let t = |x: f64| T::constant(Dd::from(x));
        let both = |e: [f64; 2]| e.map(t);
        let stage = |s: &TransmissionStage| TransmissionStage {
            ratio: Noted { value: t(s.ratio.value), place: s.ratio.place.clone() },
            stiffness: s.stiffness.map(t),
            damping: s.damping.map(t),
            input_inertia: t(s.input_inertia),
            output_inertia: t(s.output_inertia),
            efficiency: s.efficiency.map(both),
        };
        WrittenDrive {
            name: self.name.clone(),
            joints: self.joints.iter().map(|(joint, ratio)| (joint.clone(), t(*ratio))).collect(),
            actuator: match &self.actuator {
                WrittenActuator::Motor {
                    torque_constant,
                    emf_constant,
                    resistance,
                    inductance,
                    rotor_inertia,
                    friction,
                } => WrittenActuator::Motor {
                    torque_constant: t(*torque_constant),
                    emf_constant: t(*emf_constant),
                    resistance: t(*resistance),
                    inductance: inductance.map(t),
                    rotor_inertia: t(*rotor_inertia),
                    friction: t(*friction),
                },
                WrittenActuator::Linear { c, f, d, t, position } => WrittenActuator::Linear {
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
