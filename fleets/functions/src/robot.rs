//! Robots that functions are executed of: read once where a query is planned, compiled once in a process, and forgotten when many others came after.

use crate::bounded::BoundedMap;
use crate::failure;
use crate::text::{hexadecimal, stamp, CarriedText, RobotFolder, RobotText};
use datafusion::error::{DataFusionError, Result};
use datafusion::scalar::ScalarValue;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use std::time::SystemTime;
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::function::base_parameter_lists;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_core::base_parameters::JointParameter;
use straightline_core::model::{JointEffects, Model};
use straightline_core::Dd;
use straightline_jit::{LoadedFunction, Robot};

/// Programs that a process keeps at most.
const MOST_PROGRAMS: usize = 2048;
/// Texts that planning keeps at most.
const MOST_TEXTS: usize = 2048;

/// What of a robot is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RobotUse {
    /// Its joints and their limits.
    Joints,
    /// A function.
    Function(Function),
    /// The regressor of inverse dynamics.
    Regressor,
}

/// A robot, for one use.
#[derive(Debug)]
pub struct FleetRobot {
    /// The name by which the query has it.
    pub name: String,
    /// Per velocity coordinate the joint; of a joint with several the place among them behind a point.
    pub joints: Vec<String>,
    /// Per velocity coordinate the greatest effort \[N·m or N\]; infinite where the file says none or 0.
    pub efforts: Vec<f64>,
    /// The regressor's columns, where it is asked for.
    pub regressor: Option<RegressorColumns>,
    robot: Robot<f64>,
}

/// The base parameters of a robot, as `straightline identify` has them.
#[derive(Debug)]
pub struct RegressorColumns {
    /// The sum that each is.
    pub names: Vec<String>,
    /// Their values by the robot file.
    pub nominal: Vec<f64>,
    /// Row and column of each entry that is not zero everywhere, column by column.
    pub places: Vec<[usize; 2]>,
    /// Per velocity coordinate what joints add without a column: springs.
    others: Vec<KnownEffects>,
}

/// What a joint adds to forces, and what of it has no column.
#[derive(Debug)]
struct KnownEffects {
    effects: JointEffects<f64>,
    left: Vec<(JointParameter, f64)>,
}

impl RegressorColumns {
    /// What a joint adds without a column \[N·m or N\].
    pub fn known_force(&self, joint: usize, q: f64, qd: f64) -> f64 {
        let KnownEffects { effects, left } = &self.others[joint];
        left.iter().map(|(kind, x)| x * kind.force(effects, [q, qd, 0.0])).sum()
    }
}

type Key = ([u8; 32], String, RobotUse);
type Loaded = std::result::Result<Arc<FleetRobot>, Arc<DataFusionError>>;
type ReadText = std::result::Result<Arc<RobotText>, Arc<DataFusionError>>;

static PROGRAMS: LazyLock<BoundedMap<Key, Loaded>> = LazyLock::new(|| BoundedMap::new(MOST_PROGRAMS));
/// By file, name, hash and when the file was changed last.
type TextKey = (PathBuf, String, Option<(SystemTime, u64)>);
static TEXTS: LazyLock<BoundedMap<TextKey, ReadText>> = LazyLock::new(|| BoundedMap::new(MOST_TEXTS));

/// How many programs the process keeps.
pub fn programs_kept() -> usize {
    PROGRAMS.count()
}

/// What planning makes of a literal: the text of the robot, which is sound for this use. A literal that has it already stays.
///
/// # Errors
/// What is wrong with the literal, the file, or the robot in it.
pub fn carried(function: &str, literal: &ScalarValue, folder: &RobotFolder, of: RobotUse) -> Result<ScalarValue> {
    match CarriedText::of(literal) {
        Some(_) => Ok(literal.clone()),
        None => Ok(read(function, literal, folder, of)?.literal()),
    }
}

/// What the plan of a table carries of a robot that a query names: its text, found sound.
///
/// # Errors
/// What is wrong with the name, the file, or the robot in it.
pub fn robot_literal(table: &str, name: &str, folder: &RobotFolder) -> Result<ScalarValue> {
    carried(table, &ScalarValue::from(name), folder, RobotUse::Joints)
}

/// The robot of a literal, whether or not planning was there before.
///
/// # Errors
/// As [`carried`].
pub fn robot(function: &str, literal: &ScalarValue, folder: &RobotFolder, of: RobotUse) -> Result<Arc<FleetRobot>> {
    match CarriedText::of(literal) {
        Some(text) => loaded(text, None, of),
        None => {
            let text = read(function, literal, folder, of)?;
            loaded(CarriedText { name: &text.name, hash: &text.hash, bytes: &text.bytes }, None, of)
        }
    }
}

/// The text of a literal, from the folder; found sound for this use.
fn read(function: &str, literal: &ScalarValue, folder: &RobotFolder, of: RobotUse) -> Result<Arc<RobotText>> {
    let written = match literal.try_as_str() {
        Some(Some(written)) => written,
        Some(None) => return Err(failure::no_robot(function, &"NULL")),
        None => return Err(failure::no_robot(function, &format!("of type {}", literal.data_type()))),
    };
    let file = folder.file(written);
    let key = (file.clone().unwrap_or_default(), written.to_string(), file.as_deref().and_then(stamp));
    let text =
        TEXTS.get_or_make(key.clone(), || folder.read(written).map(Arc::new).map_err(Arc::new)).map_err(|wrong| {
            // files have a time by which they are read again; an address is asked again
            if file.is_none() {
                TEXTS.forget(&key);
            }
            again(wrong)
        })?;
    loaded(CarriedText { name: &text.name, hash: &text.hash, bytes: &text.bytes }, file.as_deref(), of)?;
    Ok(text)
}

/// The same complaint once more.
fn again(failure: Arc<DataFusionError>) -> DataFusionError {
    match &*failure {
        DataFusionError::Plan(text) => DataFusionError::Plan(text.clone()),
        _ => DataFusionError::Shared(failure),
    }
}

/// Compiled now, or before.
fn loaded(text: CarriedText<'_>, file: Option<&Path>, of: RobotUse) -> Result<Arc<FleetRobot>> {
    let key = (*text.hash, text.name.to_string(), of);
    PROGRAMS.get_or_make(key, || FleetRobot::load(text, file, of).map(Arc::new).map_err(Arc::new)).map_err(again)
}

/// As `straightline residuals` has them, whose bits these are.
fn options(functions: &[Function], parameters: &[JointParameter]) -> Options {
    let mut options =
        Options { functions: functions.to_vec(), optimise: OptimisationTier::Quick, ..Options::default() };
    options.scene.regressor = parameters.to_vec();
    options
}

impl FleetRobot {
    fn load(text: CarriedText<'_>, file: Option<&Path>, of: RobotUse) -> Result<FleetRobot> {
        let source = match file {
            Some(file) => Source::of_file(text.name, text.bytes, file),
            None => Source::from_bytes(text.name, text.bytes),
        };
        let load = |functions: &[Function], parameters: &[JointParameter]| {
            let robot = Robot::<f64>::load(&source, &options(functions, parameters));
            robot.map_err(|wrong| failure::broken_robot(&wrong.to_string()))
        };
        let (robot, kinds) = match of {
            RobotUse::Joints => (load(&[], &[])?, Vec::new()),
            RobotUse::Function(function) => (load(&[function], &[])?, Vec::new()),
            RobotUse::Regressor => {
                let has_rotors = load(&[], &[])?.model().bodies.iter().any(|body| body.effects.rotor_inertia.is_some());
                let rotors = has_rotors.then_some(JointParameter::RotorInertia);
                let others = [JointParameter::Damping, JointParameter::Coulomb, JointParameter::Offset];
                let kinds: Vec<JointParameter> = rotors.into_iter().chain(others).collect();
                (load(&[Function::TorqueRegressor], &kinds)?, kinds)
            }
        };
        let others: Vec<String> = robot.warnings().named_files().map(|(file, _)| file.display().to_string()).collect();
        if !others.is_empty() {
            return Err(failure::names_files(text.name, &others));
        }
        let regressor = (of == RobotUse::Regressor).then(|| RegressorColumns::of(robot.model(), &kinds));
        let (joints, efforts) = of_rates(robot.model());
        Ok(FleetRobot { name: text.name.to_string(), joints, efforts, regressor, robot })
    }

    /// The function that it was loaded for.
    ///
    /// # Panics
    /// If it was loaded for none.
    pub fn function(&self) -> &LoadedFunction<f64> {
        self.robot.functions().first().expect("the robot was loaded for a function")
    }

    /// Why its joints' efforts say nothing of its parameters, if so.
    pub fn refusal(&self) -> Option<String> {
        let model = self.robot.model();
        if model.floats() {
            return Some("its base floats, and efforts of joints do not say how it moves".to_string());
        }
        if !model.closure.is_empty() {
            return Some("it has closed loops".to_string());
        }
        if model.bodies.len() > model.joints().len() {
            return Some("it has joints that follow others".to_string());
        }
        let other = model.joints().into_iter().find(|joint| joint.kind.nv() > 1);
        other.map(|joint| format!("joint `{}` has several coordinates", joint.name))
    }
}

/// Names and greatest efforts, per velocity coordinate.
fn of_rates(model: &Model<Dd>) -> (Vec<String>, Vec<f64>) {
    let joints = model.joints();
    let rates = joints.iter().filter(|joint| joint.iv < model.nv()).flat_map(|joint| {
        let count = joint.kind.nv();
        let effort = joint.limits.effort;
        // zeros are what some files write for none
        let effort = if effort > 0.0 { effort } else { f64::INFINITY };
        (0..count).map(move |k| match count {
            1 => (joint.name.clone(), effort),
            _ => (format!("{}.{k}", joint.name), effort),
        })
    });
    rates.unzip()
}

impl RegressorColumns {
    fn of(model: &Model<Dd>, kinds: &[JointParameter]) -> RegressorColumns {
        let list = base_parameter_lists(model, &[Function::TorqueRegressor]).into_iter().next();
        let (names, nominal, places) =
            list.map_or_else(Default::default, |list| (list.names, list.values, list.places));
        let bodies = model.bodies_in_order().into_iter().map(|b| &model.bodies[b]);
        let others = bodies.map(|body| {
            let left = JointParameter::EVERY.into_iter().filter(|kind| !kinds.contains(kind));
            let left = left.map(|kind| (kind, kind.value(&body.effects).to_f64())).filter(|(_, x)| *x != 0.0);
            KnownEffects { effects: body.effects.map(|x| x.to_f64()), left: left.collect() }
        });
        RegressorColumns { names, nominal, places, others: others.collect() }
    }
}

/// A hash as queries write it.
pub fn written_hash(bytes: &[u8]) -> String {
    format!("sha256:{}", hexadecimal(&RobotText::new("", bytes.to_vec()).hash))
}
