//! A function of a robot, as Python calls it.

use crate::arguments::CallArguments;
use crate::arrays::{result_of, ArrayNumber};
use crate::call::call;
use crate::documentation::{self, FunctionPorts};
use crate::errors::{self, RobotError};
use crate::forks::WithoutForks;
use crate::robot::PythonRobot;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};
use std::sync::{OnceLock, PoisonError};
use straightline_codegen::diagnostic::Diagnostics;
use straightline_codegen::Function;
use straightline_graph::expr::{Counts, Port};
use straightline_jit::{LoadedFunction, Robot};

/// A function that can be executed, in its robot's numbers.
pub enum MadeFunction {
    /// In f32.
    F32(Robot<f32>),
    /// In f64.
    F64(Robot<f64>),
}

/// What does not depend on the numbers.
macro_rules! of_made {
    ($made:expr, $function:ident => $value:expr) => {
        match $made {
            MadeFunction::F32(robot) => {
                let $function: &LoadedFunction<f32> = &robot.functions()[0];
                $value
            }
            MadeFunction::F64(robot) => {
                let $function: &LoadedFunction<f64> = &robot.functions()[0];
                $value
            }
        }
    };
}

impl MadeFunction {
    fn inputs(&self) -> &[Port] {
        of_made!(self, function => function.inputs())
    }

    fn outputs(&self) -> &[Port] {
        of_made!(self, function => function.outputs())
    }

    fn counts(&self) -> Counts {
        of_made!(self, function => function.counts())
    }

    fn warnings(&self) -> &Diagnostics {
        match self {
            MadeFunction::F32(robot) => robot.warnings(),
            MadeFunction::F64(robot) => robot.warnings(),
        }
    }
}

// A function of a robot. It is compiled when it is called or asked about for the first time. The documentation of a class would hide that of
// each function, which `__doc__` gives.
#[pyclass(frozen, name = "Function", module = "straightline")]
pub struct PythonFunction {
    robot: Py<PythonRobot>,
    function: Function,
    made: OnceLock<MadeFunction>,
    /// The type of several results.
    results: PyOnceLock<Py<PyAny>>,
}

impl PythonFunction {
    /// One that is not compiled yet.
    pub fn new(robot: Py<PythonRobot>, function: Function) -> PythonFunction {
        PythonFunction { robot, function, made: OnceLock::new(), results: PyOnceLock::new() }
    }

    /// What executes it.
    fn made(&self, py: Python<'_>) -> PyResult<&MadeFunction> {
        match self.made.get() {
            Some(made) => Ok(made),
            None => self.make(py),
        }
    }

    /// Compiles it, unless another thread has meanwhile, and says what is doubtful about it.
    #[cold]
    fn make(&self, py: Python<'_>) -> PyResult<&MadeFunction> {
        let robot = self.robot.get();
        let warnings = py.detach(|| {
            let _unforked = WithoutForks::begin();
            let _alone = robot.compiling().lock().unwrap_or_else(PoisonError::into_inner);
            if self.made.get().is_some() {
                return Ok(None);
            }
            let made = robot.make(self.function)?;
            let warnings = robot.further_warnings(made.warnings());
            let _ = self.made.set(made);
            Ok::<_, PyErr>(warnings)
        })?;
        if let Some(text) = warnings {
            let category = py.import("straightline._robot")?.getattr("RobotWarning")?;
            py.import("warnings")?.call_method1("warn", (text, category))?;
        }
        Ok(self.made.get().expect("it was made"))
    }

    /// One result is an array; several are a tuple with names.
    fn results<'py>(
        &self,
        py: Python<'py>,
        ports: &[Port],
        mut arrays: Vec<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if arrays.len() == 1 {
            return Ok(arrays.remove(0));
        }
        let of_names = || -> PyResult<Py<PyAny>> {
            let names: Vec<&str> = ports.iter().map(|port| port.name.as_str()).collect();
            let module = py.import(intern!(py, "straightline._results"))?;
            Ok(module.getattr("result_type")?.call1((self.function.name(), PyTuple::new(py, names)?))?.unbind())
        };
        let named = self.results.get_or_try_init(py, of_names)?;
        named.bind(py).call1(PyTuple::new(py, arrays)?)
    }

    fn run<'py, T: ArrayNumber>(
        &self,
        py: Python<'py>,
        function: &LoadedFunction<T>,
        positions: &Bound<'py, PyTuple>,
        names: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = CallArguments::read(self.function.name(), function.inputs(), positions, names)?;
        self.results(py, function.outputs(), call(py, function, &arguments)?)
    }

    fn shapes<'py>(py: Python<'py>, ports: &[Port]) -> PyResult<Bound<'py, PyDict>> {
        let shapes = PyDict::new(py);
        ports.iter().try_for_each(|port| shapes.set_item(&port.name, PyTuple::new(py, &port.shape)?))?;
        Ok(shapes)
    }
}

#[pymethods]
impl PythonFunction {
    #[pyo3(signature = (*args, **kwargs))]
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        args: &Bound<'py, PyTuple>,
        kwargs: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        of_made!(self.made(py)?, function => self.run(py, function, args, kwargs))
    }

    /// It is called as an attribute of a robot, not of a class; `help` shows what has this method as it shows functions.
    fn __get__(self_: Py<PythonFunction>, _robot: Py<PyAny>, _class: Py<PyAny>) -> Py<PythonFunction> {
        self_
    }

    #[getter]
    fn __name__(&self) -> &'static str {
        self.function.name()
    }

    #[getter]
    fn __qualname__(&self) -> String {
        format!("Robot.{}", self.function.name())
    }

    #[getter]
    fn __doc__(&self, py: Python<'_>) -> PyResult<String> {
        let made = self.made(py)?;
        let ports = FunctionPorts { inputs: made.inputs(), outputs: made.outputs() };
        let options = self.robot.get().options(&[self.function]);
        Ok(documentation::of_function(self.function, &ports, &options.scene))
    }

    #[getter]
    fn __signature__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names: Vec<&str> = self.made(py)?.inputs().iter().map(|port| port.name.as_str()).collect();
        py.import("straightline._results")?.getattr("signature")?.call1((names,))
    }

    /// Names and shapes of what goes in.
    #[getter]
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        PythonFunction::shapes(py, self.made(py)?.inputs())
    }

    /// Names and shapes of what comes out.
    #[getter]
    fn outputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        PythonFunction::shapes(py, self.made(py)?.outputs())
    }

    /// Operations but sines and cosines, and pairs of these.
    #[getter]
    fn cost(&self, py: Python<'_>) -> PyResult<(usize, usize)> {
        let counts = self.made(py)?.counts();
        Ok((counts.flops(), counts.sin_cos))
    }

    /// The same if it is compiled already.
    #[getter]
    fn known_cost(&self) -> Option<(usize, usize)> {
        self.made.get().map(|made| (made.counts().flops(), made.counts().sin_cos))
    }

    /// How it is executed.
    #[getter]
    fn execution(&self, py: Python<'_>) -> PyResult<String> {
        Ok(of_made!(self.made(py)?, function => function.execution().to_string()))
    }

    /// Certified bounds of the rounding errors of its results, for inputs in their ranges.
    #[getter]
    fn error_bound<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let robot = self.robot.get();
        let mut options = robot.options(&[self.function]);
        options.certify.get_or_insert_default();
        let generated = py.detach(|| robot.generate(&options)).map_err(|wrong| errors::of_diagnostics(&wrong))?;
        let report = generated.report.functions.get(self.function.name());
        let errors = report.and_then(|report| report.errors.as_ref());
        let refused = errors.map_or(Some("the function has none"), |errors| errors.refused);
        if let Some(why) = refused {
            return Err(RobotError::new_err(format!("no bound of `{}` is certified: {why}", self.function.name())));
        }
        let outputs = errors.map_or(&[][..], |errors| &errors.outputs);
        let ports: Vec<Port> = outputs.iter().map(|output| Port::new(&output.name, &output.shape)).collect();
        let arrays = ports.iter().zip(outputs).map(|(port, output)| result_of(py, port, &output.bounds)).collect();
        self.results(py, &ports, arrays)
    }

    fn __repr__(&self) -> String {
        format!("<function {} of the robot {:?}>", self.function.name(), self.robot.get().model.name)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let of_state = py.import("straightline._robot")?.getattr("_function")?;
        (of_state, (&self.robot.get().state, self.function.name())).into_pyobject(py)
    }

    fn __copy__(self_: Py<PythonFunction>) -> Py<PythonFunction> {
        self_
    }

    fn __deepcopy__(self_: Py<PythonFunction>, _memo: Py<PyAny>) -> Py<PythonFunction> {
        self_
    }
}
