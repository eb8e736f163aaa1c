//! A call of a function, for one state or many.

use crate::arguments::CallArguments;
use crate::arrays::{common_states, result_of, row, ArrayNumber, BorrowedInput, InputArray, OutputArray};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use straightline_graph::expr::Counts;
use straightline_jit::{BatchLayout, CallError, LoadedFunction};

/// Operations from which on other threads of Python run meanwhile: it takes as long to let them.
const LONG: usize = 20_000;
/// As many operations a pair of sine and cosine takes.
const OPERATIONS_OF_SINES: usize = 25;

/// Calls a function; its results in their order.
///
/// # Errors
/// What is wrong with the arguments.
pub fn call<'py, T: ArrayNumber>(
    py: Python<'py>,
    function: &LoadedFunction<T>,
    arguments: &CallArguments<'py>,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let (inputs, outputs) = (function.inputs(), function.outputs());
    let rows = inputs.iter().zip(&arguments.inputs).map(|(port, value)| row(port, value));
    if let Some(rows) = rows.collect::<Option<Vec<Vec<T>>>>() {
        let rows: Vec<&[T]> = rows.iter().map(Vec::as_slice).collect();
        match &arguments.out {
            None => return one_state(py, function, &rows),
            Some(out) => {
                let results = OutputArray::given(out, outputs, &[])?;
                if results.iter().all(OutputArray::is_row_by_row) {
                    return one_state_into(py, function, (&rows, &arguments.inputs), results);
                }
            }
        }
    }
    let read = inputs.iter().zip(&arguments.inputs).map(|(port, value)| InputArray::read(port, value));
    let read = read.collect::<PyResult<Vec<InputArray<'py, T>>>>()?;
    let states = common_states(inputs, &read)?;
    let borrowed = read.into_iter().zip(inputs).map(|(array, port)| array.borrow(port, &states));
    let borrowed = borrowed.collect::<PyResult<Vec<BorrowedInput<'py, T>>>>()?;
    let mut results = match &arguments.out {
        Some(out) => OutputArray::given(out, outputs, &states)?,
        None => outputs.iter().map(|port| OutputArray::fresh(py, port, &states)).collect::<PyResult<Vec<_>>>()?,
    };
    {
        let numbers: Vec<(&[T], BatchLayout)> = borrowed.iter().map(BorrowedInput::numbers).collect();
        let slices: Vec<&mut [T]> = results.iter_mut().map(OutputArray::numbers).collect();
        let (count, threads) = (states.iter().product(), arguments.threads);
        let run = || many_states(function, count, &numbers, slices, threads);
        let is_long = count.saturating_mul(operations(function.counts())) > LONG;
        let done = if is_long { py.detach(run) } else { run() };
        done.map_err(broken)?;
    }
    Ok(results.into_iter().map(OutputArray::finish).collect())
}

fn operations(counts: Counts) -> usize {
    counts.flops() + OPERATIONS_OF_SINES * counts.sin_cos
}

/// Of one state.
fn one_state<'py, T: ArrayNumber>(
    py: Python<'py>,
    function: &LoadedFunction<T>,
    inputs: &[&[T]],
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let mut numbers = vec![T::default(); function.outputs().iter().map(|port| port.len()).sum()];
    let mut rest = &mut numbers[..];
    let mut slices: Vec<&mut [T]> = Vec::with_capacity(function.outputs().len());
    for port in function.outputs() {
        let (own, behind) = rest.split_at_mut(port.len());
        slices.push(own);
        rest = behind;
    }
    run_once(py, function, inputs, &mut slices)?;
    Ok(function.outputs().iter().zip(&slices).map(|(port, numbers)| result_of(py, port, numbers)).collect())
}

/// Of one state, whose inputs were copied from these arrays, into arrays of the caller.
fn one_state_into<'py, T: ArrayNumber>(
    py: Python<'py>,
    function: &LoadedFunction<T>,
    (inputs, arrays): (&[&[T]], &[Bound<'py, PyAny>]),
    mut results: Vec<OutputArray<'py, T>>,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    for (port, result) in function.outputs().iter().zip(&results) {
        arrays.iter().try_for_each(|array| result.is_apart(port, array))?;
    }
    let mut slices: Vec<&mut [T]> = results.iter_mut().map(OutputArray::numbers).collect();
    run_once(py, function, inputs, &mut slices)?;
    Ok(results.into_iter().map(OutputArray::finish).collect())
}

fn run_once<T: ArrayNumber>(
    py: Python<'_>,
    function: &LoadedFunction<T>,
    inputs: &[&[T]],
    results: &mut [&mut [T]],
) -> PyResult<()> {
    let mut run = || function.call(inputs, results);
    let done = if operations(function.counts()) > LONG { py.detach(run) } else { run() };
    done.map_err(broken)
}

/// Of many states, which threads share; results row by row.
fn many_states<T: ArrayNumber>(
    function: &LoadedFunction<T>,
    states: usize,
    inputs: &[(&[T], BatchLayout)],
    mut results: Vec<&mut [T]>,
    threads: usize,
) -> Result<(), CallError> {
    if states == 1 {
        let numbers: Option<Vec<&[T]>> = inputs
            .iter()
            .zip(function.inputs())
            .map(|((numbers, layout), port)| (layout.by_entry == 1 || port.len() == 1).then(|| &numbers[..port.len()]))
            .collect();
        if let Some(numbers) = numbers {
            return function.call(&numbers, &mut results);
        }
    }
    let rows =
        results.into_iter().zip(function.outputs()).map(|(slice, port)| (slice, BatchLayout::states_of(port.len())));
    function.batch_in_threads(threads, states, inputs, &mut rows.collect::<Vec<_>>())
}

/// Arguments were checked: what the function says of them is an error of ours.
fn broken(error: CallError) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}
