//! A robot: what its file says, and what its functions are made of.

use crate::errors::{self, RobotError};
use crate::function::{MadeFunction, PythonFunction};
use crate::options::{given_options, FRONT};
use pyo3::exceptions::{PyAttributeError, PyKeyError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::path::PathBuf;
use std::sync::Mutex;
use straightline_cli::html;
use straightline_codegen::compile::{compile, compile_programs, explain, CheckedPrograms};
use straightline_codegen::diagnostic::wording::did_you_mean;
use straightline_codegen::diagnostic::{Diagnostics, Reporting, Severity, Source};
use straightline_codegen::options::{scene_file, GivenOptions, OptionValue, Options, SceneFile};
use straightline_codegen::program::parameter::parameter_program;
use straightline_codegen::program::stored::{NoStore, ProgramStore};
use straightline_codegen::scene::{Base, Zero};
use straightline_codegen::{Function, Generated, Robot as RobotEquations, Scalar};
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::{self, Graph};
use straightline_jit::{ExecutionMode, Number, ProgramFolder, Robot};

/// Names of all functions that robots can have, each with what it computes, its inputs and its results.
#[pyfunction]
pub fn function_table() -> Vec<(&'static str, &'static str, Vec<String>, Vec<&'static str>)> {
    let row = |function: Function| {
        let spec = function.spec();
        let inputs = spec.inputs.iter().map(|quantity| quantity.name()).collect();
        (spec.name, spec.summary, inputs, spec.outputs.iter().map(|output| output.name).collect())
    };
    Function::known().map(row).collect()
}

/// A robot file in its scene, with options.
#[pyclass(frozen, name = "LoadedRobot", module = "straightline._straightline")]
pub struct PythonRobot {
    source: Source,
    scene: SceneFile,
    settings: GivenOptions,
    /// The robot in its scene.
    pub model: Model<Dd>,
    /// The frames of functions that answer per frame.
    pub frames: Vec<String>,
    /// The scalar type.
    pub scalar: Scalar,
    /// Functions that the robot has.
    functions: Vec<Function>,
    /// Functions that were named.
    named: Vec<Function>,
    warnings: Diagnostics,
    /// Where programs are kept.
    folder: Option<ProgramFolder>,
    /// What it was made of, for copies in other processes.
    pub state: Py<PyTuple>,
    /// Held while a function is compiled: compiling takes memory, and one function is not compiled twice.
    compiling: Mutex<()>,
}

impl PythonRobot {
    /// The options for these functions. The front's own values count before those of the scene file.
    pub fn options(&self, functions: &[Function]) -> Options {
        let functions = Some(OptionValue::of_choices(functions.iter().copied()));
        options(&self.scene, &self.settings, functions)
    }

    /// Makes a function.
    ///
    /// # Errors
    /// What the compiler complains of.
    pub fn make(&self, function: Function) -> PyResult<MadeFunction> {
        let options = self.options(&[function]);
        match self.scalar {
            Scalar::F32 => self.load(function, &options).map(MadeFunction::F32),
            _ => self.load(function, &options).map(MadeFunction::F64),
        }
    }

    fn load<T: Number>(&self, function: Function, options: &Options) -> PyResult<Robot<T>> {
        let store = self.folder.as_ref().map_or(&NoStore as &dyn ProgramStore, |folder| folder);
        let robot = Robot::load_by(&self.source, options, ExecutionMode::best(), store);
        let robot = robot.map_err(|error| errors::of_load(&error))?;
        let none = || RobotError::new_err(format!("nothing is left of `{}` in this scene", function.name()));
        robot.function(function.name()).map_err(|_| none())?;
        Ok(robot)
    }

    /// What is doubtful about a function, but was not said when the robot was loaded.
    pub fn further_warnings(&self, said: &Diagnostics) -> Option<String> {
        let further = said.without(|diagnostic| self.warnings.iter().any(|known| known == diagnostic));
        (further.count(Severity::Warning) > 0).then(|| further.render().trim_end().to_string())
    }

    /// Keeps others from compiling meanwhile.
    pub fn compiling(&self) -> &Mutex<()> {
        &self.compiling
    }

    /// The text of these functions, with all that is said of it.
    ///
    /// # Errors
    /// What the compiler complains of.
    pub fn generate(&self, options: &Options) -> Result<Generated, Diagnostics> {
        compile(&self.source, options)
    }

    /// The options for functions of these names; without names for those that were named when the robot was loaded, or else for all
    /// that are made without being named.
    fn options_of(&self, names: Option<Vec<String>>) -> PyResult<Options> {
        let names = names.map(|names| names.iter().map(|name| self.find(name)).collect::<PyResult<Vec<_>>>());
        Ok(match names.transpose()? {
            Some(functions) => self.options(&functions),
            None => options(&self.scene, &self.settings, None),
        })
    }

    /// What makes the input of a parameter of that name.
    fn parameter_graph(&self, name: &str) -> PyResult<Graph> {
        let options = self.options(&[]).knowing(&self.source);
        let parameters = options.scene.parameters.iter().filter(|parameter| parameter.is_of(&self.model));
        let mut names = Vec::new();
        for parameter in parameters {
            if parameter.input_name() == name {
                return Ok(parameter_program(&RobotEquations::new(self.model.clone()), parameter, &options));
            }
            names.push(parameter.input_name());
        }
        let known = if names.is_empty() { "none".to_string() } else { names.join(", ") };
        Err(PyKeyError::new_err(format!("the scene has no parameter `{name}`; there is {known}")))
    }

    fn find(&self, name: &str) -> PyResult<Function> {
        let found = self.functions.iter().find(|function| function.name() == name);
        found.copied().ok_or_else(|| PyAttributeError::new_err(self.lacking(name)))
    }
}

/// These options; the functions in place of those that are named.
fn options(scene: &SceneFile, settings: &GivenOptions, functions: Option<OptionValue>) -> Options {
    let mut settings = settings.clone();
    if let Some(functions) = functions {
        settings.set("functions", functions, FRONT).expect("functions have names");
    }
    let reporting = Reporting { front: FRONT, ..Reporting::default() };
    scene.clone().with(&settings, Options { reporting, ..Options::default() })
}

/// The functions of a robot in a scene, also those that are made for who names them only.
fn functions_of(model: &Model<Dd>, frames: &[String], options: &Options) -> Vec<Function> {
    let is_input = options.scene.parameters.iter().any(|parameter| parameter.is_of(model));
    let is_there = |function: &Function| {
        function.is_of(model)
            && (is_input || !function.is_of_scene_parameters())
            && (options.scene.base != Base::Moving || !function.spec().solves)
            && !(frames.is_empty() && function.is_per_frame())
    };
    Function::known().filter(is_there).collect()
}

#[pymethods]
impl PythonRobot {
    /// From (path, text of the robot file, None or path and text of the scene file, options, where programs are kept: None, a path, or "" for the
    /// user's folder).
    #[new]
    fn new(py: Python<'_>, state: Bound<'_, PyTuple>) -> PyResult<PythonRobot> {
        type File = (String, Vec<u8>);
        type Given<'py> = (String, Vec<u8>, Option<File>, Vec<(String, Bound<'py, PyAny>)>, Option<PathBuf>);
        let (path, text, scene, given, folder): Given<'_> = state.extract()?;
        let folder = folder.and_then(|path| match path.as_os_str().is_empty() {
            true => ProgramFolder::of_user(),
            false => Some(ProgramFolder::new(path)),
        });
        let keywords = PyDict::new(py);
        given.iter().try_for_each(|(name, value)| keywords.set_item(name, value))?;
        let settings = given_options(&keywords)?;
        let state = state.unbind();
        py.detach(|| {
            let source = Source::from_bytes(&path, text);
            let scene = scene.map(|(path, text)| scene_file::read_partly(&Source::from_bytes(&path, text)));
            let scene = scene.unwrap_or_default();
            let none = OptionValue::of_choices::<Function>([]);
            let alone = options(&scene, &settings, Some(none));
            let CheckedPrograms { model, frames, warnings, .. } =
                compile_programs(&source, &alone).map_err(|wrong| errors::of_diagnostics(&wrong))?;
            let whole = options(&scene, &settings, None);
            let is_named = [&settings, &scene.settings].iter().any(|given| given.has("functions"));
            let named = if is_named { whole.functions.clone() } else { Vec::new() };
            let functions = functions_of(&model, &frames, &whole);
            let scalar = whole.scalar;
            let compiling = Mutex::new(());
            Ok(PythonRobot {
                source,
                scene,
                settings,
                model,
                frames,
                scalar,
                functions,
                named,
                warnings,
                folder,
                state,
                compiling,
            })
        })
    }

    /// The robot's name.
    #[getter]
    fn name(&self) -> &str {
        &self.model.name
    }

    /// Joints in the order of their coordinates.
    #[getter]
    fn joint_names(&self) -> Vec<&str> {
        self.model.joints().iter().map(|joint| joint.name.as_str()).collect()
    }

    /// Kinds of joints, in the same order.
    #[getter]
    fn joint_kinds(&self) -> Vec<&'static str> {
        self.model.joints().iter().map(|joint| joint.kind.row().name).collect()
    }

    /// Drives in the order of the inputs u.
    #[getter]
    fn drive_names(&self) -> Vec<&str> {
        self.model.drives.iter().map(|drive| drive.name.as_str()).collect()
    }

    /// Frames of functions that answer per frame.
    #[getter]
    fn frames(&self) -> Vec<&str> {
        self.frames.iter().map(String::as_str).collect()
    }

    /// Number of configuration coordinates.
    #[getter]
    fn nq(&self) -> usize {
        self.model.nq()
    }

    /// Number of velocity coordinates.
    #[getter]
    fn nv(&self) -> usize {
        self.model.nv()
    }

    /// Name of the scalar type, as NumPy calls it.
    #[getter]
    fn dtype(&self) -> &'static str {
        match self.scalar {
            Scalar::F32 => "float32",
            _ => "float64",
        }
    }

    /// How functions are executed.
    #[getter]
    fn execution(&self) -> String {
        ExecutionMode::best().to_string()
    }

    /// Names of the functions.
    #[getter]
    fn functions(&self) -> Vec<&'static str> {
        self.functions.iter().map(|function| function.name()).collect()
    }

    /// What of the scene makes derivative functions other than the derivatives of functions, with what to do about it.
    #[getter]
    fn undifferentiable(&self) -> Option<&'static str> {
        let scene = self.options(&[]).scene;
        if scene.by_columns {
            return Some("matrices that are written by columns: leave `matrices` out of [outputs]");
        }
        let is_held = scene.zero != Zero::default();
        is_held.then_some("velocities or accelerations that are held at zero: leave [zero] out, and give zeros")
    }

    /// Names of functions that were named by option `functions`.
    #[getter]
    fn named(&self) -> Vec<&'static str> {
        self.named.iter().map(|function| function.name()).collect()
    }

    /// What the compiler says of the file, as text, and how much of it is a warning.
    #[getter]
    fn warnings(&self) -> (String, usize) {
        (self.warnings.render().trim_end().to_string(), self.warnings.count(Severity::Warning))
    }

    /// The function of that name.
    fn function(self_: Py<PythonRobot>, name: &str) -> PyResult<PythonFunction> {
        let function = self_.get().find(name)?;
        Ok(PythonFunction::new(self_, function))
    }

    /// Why there is no function of that name.
    fn lacking(&self, name: &str) -> String {
        let called = Function::called(name).filter(|function| self.functions.contains(function));
        let hint = called.map(|function| format!("did you mean `{}`?", function.name()));
        let hint = hint.or_else(|| did_you_mean(name, self.functions()));
        let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
        let robot = &self.model.name;
        match Function::from_name(name) {
            Some(_) => format!("the robot {robot:?} has no function `{name}`, which is of other robots or scenes"),
            None => format!("the robot {robot:?} has no attribute `{name}`{hint}"),
        }
    }

    /// Names and shapes of the numbers that make the input of a scene's parameter: mass, centre of mass, inertia; or those of a drive.
    fn parameter_inputs(&self, name: &str) -> PyResult<Vec<(String, Vec<usize>)>> {
        let ports = self.parameter_graph(name)?.inputs;
        Ok(ports.into_iter().map(|port| (port.name, port.shape)).collect())
    }

    /// The input of a scene's parameter, made of these numbers.
    fn parameter(&self, name: &str, numbers: Vec<f64>) -> PyResult<Vec<f64>> {
        Ok(expr::evaluate(&self.parameter_graph(name)?, &numbers))
    }

    /// The generated Rust of these functions.
    #[pyo3(signature = (functions=None))]
    fn rust(&self, py: Python<'_>, functions: Option<Vec<String>>) -> PyResult<String> {
        let options = self.options_of(functions)?;
        let generated = py.detach(|| self.generate(&options));
        generated.map(|generated| generated.text).map_err(|wrong| errors::of_diagnostics(&wrong))
    }

    /// The report of these functions, as a page of HTML.
    #[pyo3(signature = (functions=None))]
    fn report(&self, py: Python<'_>, functions: Option<Vec<String>>) -> PyResult<String> {
        let options = self.options_of(functions)?;
        let page = py.detach(|| {
            let generated = explain(&self.source, &options)?;
            Ok(html::page(&self.source, &options, &generated))
        });
        page.map_err(|wrong: Diagnostics| errors::of_diagnostics(&wrong))
    }
}
