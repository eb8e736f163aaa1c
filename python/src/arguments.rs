//! Arguments of a call: inputs by position or by name, `out` and `threads`.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString, PyTuple};
use straightline_codegen::diagnostic::wording::did_you_mean;
use straightline_graph::expr::Port;

/// As many threads can share the states of a call.
const MOST_THREADS: usize = 1024;

/// What a function is called with.
pub struct CallArguments<'py> {
    /// One value per input, in their order.
    pub inputs: Vec<Bound<'py, PyAny>>,
    /// Where results are written.
    pub out: Option<Bound<'py, PyAny>>,
    /// How many threads share the states.
    pub threads: usize,
}

impl<'py> CallArguments<'py> {
    /// Reads them.
    ///
    /// # Errors
    /// `TypeError` where inputs are missing, too many, given twice or unknown.
    pub fn read(
        function: &str,
        ports: &[Port],
        positions: &Bound<'py, PyTuple>,
        names: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<CallArguments<'py>> {
        if positions.len() > ports.len() {
            let message = format!("{} takes {}: {} are given", function, listed(ports), positions.len());
            return Err(PyTypeError::new_err(message));
        }
        let mut arguments = CallArguments { inputs: positions.iter().collect(), out: None, threads: 1 };
        match names {
            None if positions.len() == ports.len() => return Ok(arguments),
            None => {}
            Some(names) => arguments.read_names(function, ports, names)?,
        }
        match arguments.inputs.len() == ports.len() {
            true => Ok(arguments),
            false => {
                let given = |port: &&Port| names.is_some_and(|names| names.contains(&port.name).unwrap_or(false));
                let missing: Vec<String> =
                    ports.iter().skip(positions.len()).filter(|port| !given(port)).map(quoted).collect();
                Err(PyTypeError::new_err(format!("{function} takes {}: {} missing", listed(ports), missing.join(", "))))
            }
        }
    }

    fn read_names(&mut self, function: &str, ports: &[Port], names: &Bound<'py, PyDict>) -> PyResult<()> {
        let by_position = self.inputs.len();
        let mut named: Vec<Option<Bound<'py, PyAny>>> = vec![None; ports.len()];
        for (name, value) in names {
            // as a name in a program mostly is; to make a text of it takes longer than the rest
            if name.is(intern!(names.py(), "out")) {
                self.out = (!value.is_none()).then_some(value);
                continue;
            }
            let name = name.cast::<PyString>()?.to_string();
            match ports.iter().position(|port| port.name == name) {
                Some(k) if k < by_position => {
                    return Err(PyTypeError::new_err(format!("{function}: `{name}` is given by position and by name")));
                }
                Some(k) => named[k] = Some(value),
                None if name == "out" => self.out = (!value.is_none()).then_some(value),
                None if name == "threads" => self.threads = threads(&value)?,
                None => {
                    let known = ports.iter().map(|port| port.name.as_str()).chain(["out", "threads"]);
                    let hint = did_you_mean(&name, known).unwrap_or_else(|| format!("it takes {}", listed(ports)));
                    return Err(PyTypeError::new_err(format!("{function} has no input `{name}`; {hint}")));
                }
            }
        }
        // those behind a missing one are counted as missing by the caller
        self.inputs.extend(named.into_iter().skip(by_position).flatten());
        Ok(())
    }
}

fn quoted(port: &Port) -> String {
    format!("`{}`", port.name)
}

fn listed(ports: &[Port]) -> String {
    match ports {
        [] => "no input".to_string(),
        _ => ports.iter().map(quoted).collect::<Vec<_>>().join(", "),
    }
}

fn threads(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    if value.is_none() {
        return Ok(1);
    }
    let number = match value.is_instance_of::<PyBool>() {
        true => None,
        false => value.extract::<i64>().ok(),
    };
    let number = number.ok_or_else(|| PyTypeError::new_err("`threads` takes a whole number"))?;
    usize::try_from(number).ok().filter(|threads| (1..=MOST_THREADS).contains(threads)).ok_or_else(|| {
        PyValueError::new_err(format!("`threads` is {number}; a number from 1 to {MOST_THREADS} is expected"))
    })
}
