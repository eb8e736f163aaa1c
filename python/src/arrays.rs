//! Inputs and results as arrays of NumPy.
//!
//! An input has the axes of its port, behind axes that count states; these follow the rules of NumPy for arrays of different shapes. What the
//! executed function cannot read in place (other types, negative strides, gaps) is copied.

use numpy::ndarray::ArrayViewD;
use numpy::{
    BorrowError, Element, IxDyn, PyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyReadwriteArrayDyn,
    PyUntypedArray, PyUntypedArrayMethods,
};
use numpy::{PyArray1, PyArrayDescrMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use straightline_graph::expr::Port;
use straightline_jit::{BatchLayout, Number};

/// A number that NumPy has, too.
pub trait ArrayNumber: Number + Element {}

impl ArrayNumber for f32 {}
impl ArrayNumber for f64 {}

/// The numbers of an input of one state, if it is a row of them as it is: what most calls give. To copy a few numbers takes less than to keep
/// others from writing to them.
pub fn row<T: ArrayNumber>(port: &Port, value: &Bound<'_, PyAny>) -> Option<Vec<T>> {
    let array = value.cast::<PyArray1<T>>().ok()?;
    let fits = port.shape.len() == 1 && array.len() == port.shape[0] && array.is_aligned();
    fits.then(|| array.to_vec().ok()).flatten()
}

/// An input for one state or many.
pub struct InputArray<'py, T: ArrayNumber> {
    array: Bound<'py, PyArrayDyn<T>>,
    /// Axes that count states.
    states: Vec<usize>,
}

impl<'py, T: ArrayNumber> InputArray<'py, T> {
    /// Reads what was given for an input. A single number stands for all entries.
    ///
    /// # Errors
    /// What is no array of numbers, or has another shape.
    pub fn read(port: &Port, value: &Bound<'py, PyAny>) -> PyResult<InputArray<'py, T>> {
        let py = value.py();
        let array = match value.cast::<PyArrayDyn<T>>() {
            Ok(array) => array.clone(),
            Err(_) => converted::<T>(port, value)?,
        };
        if array.ndim() == 0 {
            let shape = PyTuple::new(py, &port.shape)?;
            let filled = numpy_function(py, "full")?.call1((shape, array))?.cast_into::<PyArrayDyn<T>>()?;
            return Ok(InputArray { array: filled, states: Vec::new() });
        }
        let shape = array.shape();
        let own = shape.len().checked_sub(port.shape.len());
        match own.map(|axes| shape.split_at(axes)) {
            Some((states, entries)) if entries == port.shape => Ok(InputArray { states: states.to_vec(), array }),
            _ => {
                let message = format!(
                    "`{}` has shape {}; {} is expected, or (..., {}) of many states",
                    port.name,
                    tuple(shape),
                    tuple(&port.shape),
                    list(&port.shape)
                );
                Err(PyValueError::new_err(message))
            }
        }
    }

    /// Its numbers, to be read for states along these axes.
    ///
    /// # Errors
    /// If something else writes to it.
    pub fn borrow(self, port: &Port, states: &[usize]) -> PyResult<BorrowedInput<'py, T>> {
        let entries = port.len();
        if !self.states.is_empty() && self.states != states {
            let shape: Vec<usize> = states.iter().chain(&port.shape).copied().collect();
            let py = self.array.py();
            let broadcast = numpy_function(py, "broadcast_to")?.call1((&self.array, PyTuple::new(py, shape)?))?;
            let array = in_rows::<T>(&broadcast)?;
            return borrowed(port, array, BatchLayout::states_of(entries));
        }
        let layout = match self.states.is_empty() {
            true => BatchLayout { by_state: 0, by_entry: 1 },
            false => BatchLayout::states_of(entries),
        };
        let array = &self.array;
        let is_readable = array.is_aligned();
        if is_readable && array.is_c_contiguous() {
            return borrowed(port, self.array, layout);
        }
        if is_readable && array.ndim() == 2 && self.states.len() == 1 && array.is_fortran_contiguous() {
            let layout = BatchLayout::entries_of(states[0]);
            return borrowed(port, self.array, layout);
        }
        borrowed(port, in_rows(array.as_any())?, layout)
    }
}

/// An input that nobody writes to meanwhile.
pub struct BorrowedInput<'py, T: ArrayNumber> {
    array: PyReadonlyArrayDyn<'py, T>,
    layout: BatchLayout,
}

impl<T: ArrayNumber> BorrowedInput<'_, T> {
    /// Its numbers and where they are.
    pub fn numbers(&self) -> (&[T], BatchLayout) {
        (self.array.as_slice().expect("it is contiguous"), self.layout)
    }
}

fn borrowed<'py, T: ArrayNumber>(
    port: &Port,
    array: Bound<'py, PyArrayDyn<T>>,
    layout: BatchLayout,
) -> PyResult<BorrowedInput<'py, T>> {
    let borrowed = array.try_into_readonly();
    let busy = |_| PyValueError::new_err(format!("`{}` is written to by another call", port.name));
    Ok(BorrowedInput { array: borrowed.map_err(busy)?, layout })
}

/// The axes of states that all inputs have together.
///
/// # Errors
/// If they do not fit.
pub fn common_states<T: ArrayNumber>(ports: &[Port], inputs: &[InputArray<'_, T>]) -> PyResult<Vec<usize>> {
    let mut common: Vec<usize> = Vec::new();
    for input in inputs {
        if let Some(further) = input.states.len().checked_sub(common.len()) {
            common.splice(0..0, std::iter::repeat_n(1, further));
        }
        for (one, other) in common.iter_mut().rev().zip(input.states.iter().rev()) {
            match (*one, *other) {
                (a, b) if a == b => {}
                (1, b) => *one = b,
                (_, 1) => {}
                _ => {
                    let shapes = ports
                        .iter()
                        .zip(inputs)
                        .map(|(port, input)| format!("`{}` {}", port.name, tuple(input.array.shape())));
                    let shapes: Vec<String> = shapes.collect();
                    return Err(PyValueError::new_err(format!(
                        "inputs are of different numbers of states: {}",
                        shapes.join(", ")
                    )));
                }
            }
        }
    }
    Ok(common)
}

/// A number, a list or another array as an array of these numbers.
fn converted<'py, T: ArrayNumber>(port: &Port, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let py = value.py();
    let unreadable = |error: PyErr| {
        let message = format!("`{}` cannot be read as numbers: {}", port.name, error.value(py));
        match error.is_instance_of::<PyTypeError>(py) {
            true => PyTypeError::new_err(message),
            false => PyValueError::new_err(message),
        }
    };
    let array = numpy_function(py, "asarray")?.call1((value,)).map_err(unreadable)?;
    let array = array.cast_into::<PyUntypedArray>()?;
    if !matches!(array.dtype().kind(), b'b' | b'i' | b'u' | b'f') {
        let message = format!("`{}` has dtype {}; {} is expected", port.name, array.dtype(), numpy::dtype::<T>(py));
        return Err(PyTypeError::new_err(message));
    }
    let array = array.call_method1(intern!(py, "astype"), (numpy::dtype::<T>(py),)).map_err(unreadable)?;
    Ok(array.cast_into::<PyArrayDyn<T>>()?)
}

/// The same, row by row and aligned.
fn in_rows<'py, T: ArrayNumber>(array: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let py = array.py();
    let keywords = PyDict::new(py);
    keywords.set_item(intern!(py, "requirements"), "CA")?;
    let rows = numpy_function(py, "require")?.call((array,), Some(&keywords))?;
    Ok(rows.cast_into::<PyArrayDyn<T>>()?)
}

fn numpy_function<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import(intern!(py, "numpy"))?.getattr(name)
}

/// An array of results of one state, with what was computed.
pub fn result_of<'py, T: ArrayNumber>(py: Python<'py>, port: &Port, numbers: &[T]) -> Bound<'py, PyAny> {
    match port.shape.len() {
        1 => PyArray1::from_slice(py, numbers).into_any(),
        _ => {
            let view = ArrayViewD::from_shape(IxDyn(&port.shape), numbers).expect("as many numbers as the port has");
            PyArray::from_array(py, &view).into_any()
        }
    }
}

/// Where results are written, each with its port.
pub struct OutputArray<'py, T: ArrayNumber> {
    object: Bound<'py, PyArrayDyn<T>>,
    array: PyReadwriteArrayDyn<'py, T>,
    /// What is written instead, where the array is not row by row: it is copied afterwards.
    rows: Option<Vec<T>>,
}

impl<'py, T: ArrayNumber> OutputArray<'py, T> {
    /// New ones for states along these axes.
    ///
    /// # Errors
    /// None that can happen to a new array.
    pub fn fresh(py: Python<'py>, port: &Port, states: &[usize]) -> PyResult<OutputArray<'py, T>> {
        let shape: Vec<usize> = states.iter().chain(&port.shape).copied().collect();
        let object = PyArrayDyn::<T>::zeros(py, IxDyn(&shape), false);
        let array = object.try_readwrite()?;
        Ok(OutputArray { object, array, rows: None })
    }

    /// Those that the caller gave as `out`.
    ///
    /// # Errors
    /// If there are more or fewer than results; if one has another type or shape, cannot be written, or overlaps an input or another result.
    pub fn given(out: &Bound<'py, PyAny>, ports: &[Port], states: &[usize]) -> PyResult<Vec<OutputArray<'py, T>>> {
        let is_list = out.is_instance_of::<PyTuple>() || out.is_instance_of::<PyList>();
        let arrays: Vec<Bound<'py, PyAny>> = match is_list {
            true => out.try_iter()?.collect::<PyResult<_>>()?,
            false => vec![out.clone()],
        };
        if arrays.len() != ports.len() {
            let names: Vec<String> = ports.iter().map(|port| format!("`{}`", port.name)).collect();
            let message =
                format!("`out` has {}; a tuple of {} is expected: {}", arrays.len(), ports.len(), names.join(", "));
            return Err(PyValueError::new_err(message));
        }
        ports.iter().zip(&arrays).map(|(port, array)| OutputArray::of(port, array, states)).collect()
    }

    fn of(port: &Port, value: &Bound<'py, PyAny>, states: &[usize]) -> PyResult<OutputArray<'py, T>> {
        let (py, name) = (value.py(), &port.name);
        let Ok(object) = value.cast::<PyArrayDyn<T>>() else {
            let found = match value.cast::<PyUntypedArray>() {
                Ok(array) => format!("an array of {}", array.dtype()),
                Err(_) => format!("{}", value.get_type().name()?),
            };
            let message = format!("`out` for `{name}` is {found}; an array of {} is expected", numpy::dtype::<T>(py));
            return Err(PyTypeError::new_err(message));
        };
        let shape: Vec<usize> = states.iter().chain(&port.shape).copied().collect();
        if object.shape() != shape {
            let message =
                format!("`out` for `{name}` has shape {}; {} is expected", tuple(object.shape()), tuple(&shape));
            return Err(PyValueError::new_err(message));
        }
        if !object.is_aligned() {
            return Err(PyValueError::new_err(format!("`out` for `{name}` is not aligned")));
        }
        let array = object.try_readwrite().map_err(|error| match error {
            BorrowError::NotWriteable => PyValueError::new_err(format!("`out` for `{name}` is read-only")),
            _ => overlap(port),
        })?;
        let rows = (!object.is_c_contiguous()).then(|| vec![T::default(); object.len()]);
        Ok(OutputArray { object: object.clone(), array, rows })
    }

    /// Whether it has memory in common with an input that is a row of numbers.
    ///
    /// # Errors
    /// If it has.
    pub fn is_apart(&self, port: &Port, input: &Bound<'py, PyAny>) -> PyResult<()> {
        let Ok(input) = input.cast::<PyArrayDyn<T>>() else { return Ok(()) };
        let bytes = |array: &Bound<'py, PyArrayDyn<T>>| {
            let first = array.data() as usize;
            first..first + array.len() * T::BYTES
        };
        let (input, own) = (bytes(input), bytes(&self.object));
        match input.start < own.end && own.start < input.end {
            true => Err(overlap(port)),
            false => Ok(()),
        }
    }

    /// Whether results are written to it directly.
    pub fn is_row_by_row(&self) -> bool {
        self.rows.is_none()
    }

    /// Where results are written, row by row.
    pub fn numbers(&mut self) -> &mut [T] {
        match &mut self.rows {
            Some(rows) => rows,
            None => self.array.as_slice_mut().expect("it is contiguous"),
        }
    }

    /// The array, with what was written.
    pub fn finish(mut self) -> Bound<'py, PyAny> {
        if let Some(rows) = &self.rows {
            let mut array = self.array.as_array_mut();
            let view = ArrayViewD::from_shape(array.raw_dim(), rows).expect("as many numbers as the array has");
            array.assign(&view);
        }
        self.object.into_any()
    }
}

fn overlap(port: &Port) -> PyErr {
    let name = &port.name;
    PyValueError::new_err(format!("`out` for `{name}` overlaps an input or another result, or another call uses it"))
}

fn list(shape: &[usize]) -> String {
    shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// A shape as Python writes it.
fn tuple(shape: &[usize]) -> String {
    format!("({}{})", list(shape), if shape.len() == 1 { "," } else { "" })
}
