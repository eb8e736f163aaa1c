//! The native part of the Python package `straightline`: a robot file becomes functions over NumPy arrays.
//!
//! `python/straightline/__init__.py` is what users import; it reads files and makes robots of what stands here.
#![forbid(unsafe_code)]

mod arguments;
mod arrays;
mod call;
mod documentation;
mod errors;
mod forks;
mod function;
mod options;
mod robot;

use pyo3::prelude::*;

/// What `straightline/__init__.py` is made of.
#[pymodule]
mod _straightline {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::errors::RobotError;
    #[pymodule_export]
    use super::forks::{after_fork, before_fork};
    #[pymodule_export]
    use super::function::PythonFunction;
    #[pymodule_export]
    use super::options::option_table;
    #[pymodule_export]
    use super::robot::{function_table, PythonRobot};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", straightline_codegen::VERSION)
    }
}
