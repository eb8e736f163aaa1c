//! CSV files with a header: `t` and a column per joint and quantity, as [`log::from_columns`](crate::log::from_columns) has them.

use crate::failure::LogError;
use crate::log::{from_columns, JointLog};

/// So many complaints are told one by one.
const MOST_COMPLAINTS: usize = 10;

/// The log of a file. Lines that begin with `#` are remarks; an empty field, `nan` and the like are missing numbers.
///
/// # Errors
/// Fields that are no numbers, rows of another length, columns that make no log.
pub fn read(bytes: &[u8]) -> Result<JointLog, LogError> {
    let mut reader = ::csv::ReaderBuilder::new().trim(::csv::Trim::All).comment(Some(b'#')).from_reader(bytes);
    let headers = reader.headers().map_err(|error| unreadable(&error))?.clone();
    let mut columns: Vec<(String, Vec<f64>)> = headers.iter().map(|name| (name.to_string(), Vec::new())).collect();
    if let Some(twice) = (1..columns.len()).find(|k| columns[..*k].iter().any(|(name, _)| *name == columns[*k].0)) {
        return Err(LogError::new("line 1", format!("two columns `{}`", columns[twice].0), "leave one out"));
    }
    let clock = columns.iter().position(|(name, _)| name == "t");
    let (mut record, mut complaints, mut start) = (::csv::ByteRecord::new(), Vec::new(), None);
    while reader.read_byte_record(&mut record).map_err(|error| unreadable(&error))? {
        for (k, ((name, column), field)) in columns.iter_mut().zip(&record).enumerate() {
            let number = match Some(k) == clock {
                true => seconds(field, &mut start),
                false => number(field),
            };
            if number.is_none() {
                let line = record.position().map_or(0, ::csv::Position::line);
                complaints
                    .push(format!("line {line}: `{}` in column `{name}` is no number", String::from_utf8_lossy(field)));
            }
            column.push(number.unwrap_or(f64::NAN));
        }
        if complaints.len() > MOST_COMPLAINTS {
            complaints.truncate(MOST_COMPLAINTS);
            complaints.push("and so on".to_string());
            break;
        }
    }
    match complaints.is_empty() {
        true => {
            let log = from_columns(columns)?;
            Ok(JointLog { start: start.unwrap_or(0).saturating_mul(1_000_000_000), ..log })
        }
        false => Err(LogError::new(
            "",
            complaints.join("\n  "),
            "numbers have a point, no comma; what is missing stays empty",
        )),
    }
}

fn unreadable(error: &::csv::Error) -> LogError {
    let line = error.position().map_or(String::new(), |p| format!("line {}", p.line()));
    LogError::new(line, error.to_string(), "a log as CSV has a header, then as many fields in each row")
}

fn number(field: &[u8]) -> Option<f64> {
    match field.is_empty() {
        true => Some(f64::NAN),
        false => std::str::from_utf8(field).ok()?.parse().ok(),
    }
}

/// A time stamp, without the whole seconds of the first where that counts from an epoch: doubles have no digits left for nanoseconds there.
fn seconds(field: &[u8], start: &mut Option<i64>) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?;
    let whole = text.split('.').next().unwrap_or("");
    let count = whole.parse::<i64>().ok();
    let first = *start.get_or_insert_with(|| count.filter(|s| *s > 1_000_000).unwrap_or(0));
    match (first, count) {
        (0, _) | (_, None) => number(field).map(|t| t - first as f64),
        (_, Some(count)) => {
            let rest = &text[whole.len()..];
            let rest: f64 = if rest.len() < 2 { 0.0 } else { rest.parse().ok()? };
            Some((count - first) as f64 + rest)
        }
    }
}
