//! Options as keyword arguments: one for each row of the compiler's table.

use crate::errors;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};
use straightline_codegen::diagnostic::Front;
use straightline_codegen::options::table::{OptionKind, OptionRow, TABLE};
use straightline_codegen::options::{GivenOptions, OptionValue};

/// The compiler has no front for Python; the derive writes options as Python does, `angle_tolerance = 1e-6`.
pub const FRONT: Front = Front::Derive;

/// Names of all options, each with what it does and its example as Python writes it.
#[pyfunction]
pub fn option_table(py: Python<'_>) -> PyResult<Vec<(&'static str, &'static str, Bound<'_, PyAny>)>> {
    let rows = TABLE.iter().filter(|row| row.is_value(FRONT));
    rows.map(|row| Ok((row.name, row.doc, example(py, row)?))).collect()
}

/// A value that is not the default.
fn example<'py>(py: Python<'py>, row: &OptionRow) -> PyResult<Bound<'py, PyAny>> {
    let words = row.example;
    let numbers: Vec<f64> = words.iter().filter_map(|word| word.parse().ok()).collect();
    match &row.kind {
        OptionKind::Flag => Ok(PyBool::new(py, true).to_owned().into_any()),
        OptionKind::Word(..) => words[0].into_pyobject(py).map(Bound::into_any).map_err(Into::into),
        OptionKind::Real(..) => numbers[0].into_pyobject(py).map(Bound::into_any).map_err(Into::into),
        OptionKind::Whole(..) => (numbers[0] as i64).into_pyobject(py).map(Bound::into_any).map_err(Into::into),
        _ if row.is_number() => numbers.into_pyobject(py),
        _ => words.to_vec().into_pyobject(py),
    }
}

/// Options that were given by name. `None` is as good as nothing.
///
/// # Errors
/// `TypeError` for names that are no options and values of other types; `RobotError` with all values that are wrong.
pub fn given_options(keywords: &Bound<'_, PyDict>) -> PyResult<GivenOptions> {
    let (mut given, mut wrong) = (GivenOptions::default(), Vec::new());
    for (name, value) in keywords {
        let name: String = name.extract()?;
        let row = OptionRow::find(&name, |row| row.is_value(FRONT)).map_err(PyTypeError::new_err)?;
        if let Some(value) = option_value(row, &value)? {
            wrong.extend(given.give(row, value, FRONT).err().unwrap_or_default());
        }
    }
    match wrong.is_empty() {
        true => Ok(given),
        false => Err(errors::of_options(wrong)),
    }
}

/// The value of an option; `None` where it is switched off and has no word for that.
fn option_value(row: &OptionRow, value: &Bound<'_, PyAny>) -> PyResult<Option<OptionValue>> {
    if value.is_none() {
        return Ok(None);
    }
    if let Ok(flag) = value.extract::<bool>() {
        return Ok(match (&row.kind, flag) {
            (OptionKind::Word(_, Some(alone)), true) => Some((*alone).into()),
            (OptionKind::Word(..), false) => None,
            _ => Some(flag.into()),
        });
    }
    if let Ok(word) = value.cast::<PyString>() {
        return Ok(Some(OptionValue::of_words([word.to_string()])));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(Some(number.into()));
    }
    let of_another_type = || PyTypeError::new_err(row.wrong_form(FRONT).sentence());
    let items = value.try_iter().map_err(|_| of_another_type())?.collect::<PyResult<Vec<_>>>()?;
    if let Ok(words) = items.iter().map(|item| item.extract()).collect::<PyResult<Vec<String>>>() {
        let is_empty_vector = words.is_empty() && row.is_number();
        return if is_empty_vector { Err(of_another_type()) } else { Ok(Some(OptionValue::Words(words))) };
    }
    let numbers = items.iter().map(|item| item.extract()).collect::<PyResult<Vec<f64>>>();
    numbers.map(|numbers| Some(OptionValue::Numbers(numbers))).map_err(|_| of_another_type())
}
