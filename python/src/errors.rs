//! What users see where something is wrong.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::PyErr;
use straightline_codegen::diagnostic::{Diagnostic, Diagnostics};
use straightline_jit::LoadError;

create_exception!(
    straightline,
    RobotError,
    PyValueError,
    "What is wrong with a robot file, its scene or the options, with its line: the text of the compiler."
);

/// All that the compiler complains of.
pub fn of_diagnostics(diagnostics: &Diagnostics) -> PyErr {
    RobotError::new_err(diagnostics.render().trim_end().to_string())
}

/// What is wrong with values of options.
pub fn of_options(wrong: Vec<Diagnostic>) -> PyErr {
    let mut all = Diagnostics::new();
    wrong.into_iter().for_each(|diagnostic| all.push(diagnostic));
    of_diagnostics(&all)
}

/// Why a function is not made.
pub fn of_load(error: &LoadError) -> PyErr {
    RobotError::new_err(error.to_string())
}
