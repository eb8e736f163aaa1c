//! Columns of lists as the numbers of many states.
//!
//! Lists whose numbers lie one behind the other are taken as they lie; others are copied, and so are those of single precision. A row is null
//! where its list is, or any of its numbers.

use crate::failure;
use crate::robot::FleetRobot;
use datafusion::arrow::array::{Array, ArrayRef, AsArray, Float64Array};
use datafusion::arrow::buffer::NullBuffer;
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::{DataType, Float32Type, Float64Type};
use datafusion::error::Result;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use straightline_jit::BatchLayout;

/// The numbers of a column.
#[derive(Debug)]
pub struct States<'a> {
    numbers: Cow<'a, [f64]>,
    layout: BatchLayout,
    /// Rows that have no state.
    pub nulls: Option<NullBuffer>,
}

impl States<'_> {
    /// A number.
    pub fn at(&self, row: usize, entry: usize) -> f64 {
        self.numbers[row * self.layout.by_state + entry * self.layout.by_entry]
    }

    /// As batches take them, from a row on.
    pub fn batch_from(&self, row: usize) -> (&[f64], BatchLayout) {
        (&self.numbers[(row * self.layout.by_state).min(self.numbers.len())..], self.layout)
    }
}

/// The rows that have a state in all columns; `None` where all have.
pub fn rows_with_all(columns: &[States<'_>]) -> Option<NullBuffer> {
    columns.iter().fold(None, |nulls, column| NullBuffer::union(nulls.as_ref(), column.nulls.as_ref()))
}

/// The type that an argument is taken in: lists and structs as they are, if their numbers are floating; `None` of what has no numbers.
pub fn taken_as(kind: &DataType) -> Option<DataType> {
    let is_float = |kind: &DataType| matches!(kind, DataType::Float64 | DataType::Float32);
    match kind {
        DataType::List(of) | DataType::LargeList(of) | DataType::FixedSizeList(of, _) if is_float(of.data_type()) => {
            Some(kind.clone())
        }
        DataType::Struct(fields) if fields.iter().all(|field| field.data_type().is_numeric()) => Some(kind.clone()),
        DataType::List(of)
        | DataType::LargeList(of)
        | DataType::FixedSizeList(of, _)
        | DataType::ListView(of)
        | DataType::LargeListView(of)
            if of.data_type().is_numeric() || of.data_type().is_null() =>
        {
            Some(DataType::new_list(DataType::Float64, true))
        }
        DataType::Null => Some(DataType::new_list(DataType::Float64, true)),
        _ => None,
    }
}

/// Refuses types of another length than the robot's.
///
/// # Errors
/// Every row would be wrong.
pub fn check_type(argument: &str, kind: &DataType, robot: &FleetRobot, expected: usize) -> Result<()> {
    match kind {
        DataType::FixedSizeList(_, length) if *length as usize != expected => {
            Err(failure::length_of_type(argument, &robot.name, expected, *length))
        }
        DataType::Struct(fields) => {
            let found: Vec<String> = fields.iter().map(|field| field.name().clone()).collect();
            let is_sound = found.len() == expected && (expected != robot.joints.len() || found == robot.joints);
            if is_sound {
                return Ok(());
            }
            Err(failure::other_joints(argument, &robot.name, &robot.joints, &found))
        }
        _ => Ok(()),
    }
}

/// The states of a column of `expected` numbers per row.
///
/// # Errors
/// A list has another length.
pub fn states<'a>(argument: &str, array: &'a ArrayRef, robot: &FleetRobot, expected: usize) -> Result<States<'a>> {
    check_type(argument, array.data_type(), robot, expected)?;
    let nulls = array.nulls().cloned();
    let (rows, lists) = (array.len(), Lists { argument, robot: &robot.name, expected, nulls: &nulls });
    match array.data_type() {
        DataType::List(_) => {
            let array = array.as_list::<i32>();
            let at = array.value_offsets();
            let is_dense = at.windows(2).all(|pair| pair[1] - pair[0] == expected as i32);
            lists.states(rows, array.values(), is_dense, |row| at[row] as usize..at[row + 1] as usize)
        }
        DataType::LargeList(_) => {
            let array = array.as_list::<i64>();
            let at = array.value_offsets();
            let is_dense = at.windows(2).all(|pair| pair[1] - pair[0] == expected as i64);
            lists.states(rows, array.values(), is_dense, |row| at[row] as usize..at[row + 1] as usize)
        }
        DataType::FixedSizeList(_, length) => {
            let (array, length) = (array.as_fixed_size_list(), *length as usize);
            lists.states(rows, array.values(), length == expected, |row| {
                let first = array.value_offset(row) as usize;
                first..first + length
            })
        }
        DataType::Struct(_) => of_struct(array.as_struct().columns(), nulls, rows),
        other => Err(failure::no_numbers("a function of robots", argument, other)),
    }
}

/// A number per field.
fn of_struct(columns: &[ArrayRef], mut nulls: Option<NullBuffer>, rows: usize) -> Result<States<'static>> {
    let mut numbers = Vec::with_capacity(columns.len() * rows);
    for column in columns {
        let column = cast(column, &DataType::Float64)?;
        numbers.extend_from_slice(column.as_primitive::<Float64Type>().values());
        nulls = NullBuffer::union(nulls.as_ref(), column.nulls());
    }
    Ok(States { numbers: Cow::Owned(numbers), layout: BatchLayout::entries_of(rows), nulls })
}

/// What lists are for.
struct Lists<'a> {
    argument: &'a str,
    robot: &'a str,
    expected: usize,
    nulls: &'a Option<NullBuffer>,
}

impl Lists<'_> {
    /// Of lists that begin and end there among the numbers, of the right length and one behind the other if `is_dense`.
    fn states<'a>(
        &self,
        rows: usize,
        values: &'a ArrayRef,
        is_dense: bool,
        place: impl Fn(usize) -> Range<usize>,
    ) -> Result<States<'a>> {
        let n = self.expected;
        let is_null = |row: usize| self.nulls.as_ref().is_some_and(|nulls| nulls.is_null(row));
        let is_wrong = |row: &usize| place(*row).len() != n && !is_null(*row);
        if let Some(row) = (0..rows).filter(|_| !is_dense).find(is_wrong) {
            return Err(failure::length(self.argument, self.robot, n, place(row).len(), row));
        }
        let first = if rows > 0 { place(0).start } else { 0 };
        let numbers = numbers(values)?;
        let nulls = self.with_null_numbers(rows, values, &place);
        let layout = BatchLayout::states_of(n);
        if is_dense {
            let range = first..first + rows * n;
            let numbers = match numbers {
                Cow::Borrowed(numbers) => Cow::Borrowed(&numbers[range]),
                Cow::Owned(numbers) => Cow::Owned(numbers[range].to_vec()),
            };
            return Ok(States { numbers, layout, nulls });
        }
        let mut copied = vec![0.0; rows * n];
        for (row, own) in copied.chunks_exact_mut(n.max(1)).enumerate().filter(|(row, _)| !is_null(*row)) {
            own.copy_from_slice(&numbers[place(row)]);
        }
        Ok(States { numbers: Cow::Owned(copied), layout, nulls })
    }

    /// Rows whose list is null, or one of its numbers.
    fn with_null_numbers(
        &self,
        rows: usize,
        values: &ArrayRef,
        place: impl Fn(usize) -> Range<usize>,
    ) -> Option<NullBuffer> {
        let Some(of_numbers) = values.nulls().filter(|nulls| nulls.null_count() > 0) else { return self.nulls.clone() };
        let has_all: NullBuffer = (0..rows).map(|row| place(row).all(|k| of_numbers.is_valid(k))).collect();
        NullBuffer::union(self.nulls.as_ref(), Some(&has_all))
    }
}

/// In double precision.
fn numbers(values: &ArrayRef) -> Result<Cow<'_, [f64]>> {
    match values.data_type() {
        DataType::Float64 => Ok(Cow::Borrowed(values.as_primitive::<Float64Type>().values())),
        DataType::Float32 => {
            let values = values.as_primitive::<Float32Type>().values();
            Ok(Cow::Owned(values.iter().map(|x| f64::from(*x)).collect()))
        }
        _ => Ok(Cow::Owned(cast(values, &DataType::Float64)?.as_primitive::<Float64Type>().values().to_vec())),
    }
}

/// Columns of numbers, null where rows have no state.
pub fn columns(found: Vec<Vec<f64>>, nulls: Option<&NullBuffer>) -> Vec<ArrayRef> {
    let column = |numbers: Vec<f64>| Arc::new(Float64Array::new(numbers.into(), nulls.cloned())) as ArrayRef;
    found.into_iter().map(column).collect()
}
