//! CSV files with a header: `t` and a column per joint and quantity, as [`log::from_columns`](crate::log::from_columns) has them.

use crate::failure::LogError;
use crate::log::{from_columns, JointLog};
use crate::threads::{in_threads, processors};

/// So many complaints are told one by one.
const MOST_COMPLAINTS: usize = 10;

/// Bytes that are worth a thread.
const WORTH: usize = 1 << 20;

/// The log of a file. Lines that begin with `#` are remarks; an empty field, `nan` and the like are missing numbers.
///
/// # Errors
/// Fields that are no numbers, rows of another length, columns that make no log.
pub fn read(bytes: &[u8]) -> Result<JointLog, LogError> {
    let mut reader = reader(bytes, true);
    let headers = reader.headers().map_err(|error| unreadable(&error))?.clone();
    let names: Vec<String> = headers.iter().map(ToString::to_string).collect();
    if let Some(twice) = (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
        return Err(LogError::new("line 1", format!("two columns `{}`", names[twice]), "leave one out"));
    }
    let clock = names.iter().position(|name| name == "t");
    let body = (reader.position().byte() as usize).min(bytes.len());
    let mut first = ::csv::ByteRecord::new();
    let has_rows = reader.read_byte_record(&mut first).map_err(|error| unreadable(&error))?;
    let field = clock.filter(|_| has_rows).and_then(|k| first.get(k)).map(<[u8]>::trim_ascii);
    let table = CsvTable { names: &names, clock, start: field.map_or(0, whole_seconds) };
    let parts = parts(&bytes[body..], 1 + line_ends(&bytes[..body]));
    let lines: u64 = parts.iter().map(|part| part.lines).sum();
    // the first takes those of all others, too; a row has a byte for each column at least
    let rows = |bytes: usize, lines: u64| (bytes / names.len().max(1)).min(lines as usize);
    let most = |k: usize| if k == 0 { rows(bytes.len(), lines) } else { rows(parts[k].bytes.len(), parts[k].lines) };
    let mut read = in_threads(parts.len(), |k| table.rows(&parts[k], most(k))).into_iter();
    let (mut columns, mut complaints) = read.next().transpose()?.unwrap_or_default();
    for rows in read {
        let (more, wrong) = rows?;
        columns.iter_mut().zip(more).for_each(|(column, more): (&mut Vec<f64>, _)| column.extend(more));
        complaints.extend(wrong);
    }
    if complaints.len() > MOST_COMPLAINTS {
        complaints.truncate(MOST_COMPLAINTS);
        complaints.push("and so on".to_string());
    }
    match complaints.is_empty() {
        true => {
            let start = table.start.saturating_mul(1_000_000_000);
            let log = from_columns(names.into_iter().zip(columns).collect())?;
            Ok(JointLog { start, ..log })
        }
        false => Err(LogError::new(
            "",
            complaints.join("\n  "),
            "numbers have a point, no comma; what is missing stays empty",
        )),
    }
}

/// Spaces about names are left out; those about numbers are where they are read.
fn reader(bytes: &[u8], has_headers: bool) -> ::csv::Reader<&[u8]> {
    let mut builder = ::csv::ReaderBuilder::new();
    builder.trim(::csv::Trim::Headers).comment(Some(b'#')).flexible(true).has_headers(has_headers);
    builder.from_reader(bytes)
}

/// Rows that a thread reads.
struct CsvPart<'a> {
    bytes: &'a [u8],
    /// The number of its first line.
    first: u64,
    /// How many end in it.
    lines: u64,
}

/// Rows in parts for threads. A line that may go on behind its end, by a quotation mark, is not taken apart.
fn parts(body: &[u8], first: u64) -> Vec<CsvPart<'_>> {
    let count = (body.len() / WORTH).clamp(1, processors());
    if body.contains(&b'"') {
        return vec![CsvPart { bytes: body, first, lines: line_ends(body) }];
    }
    let (mut left, mut line, mut parts) = (body, first, Vec::new());
    for k in 0..count {
        let about = left.len() / (count - k);
        let end = left[about..].iter().position(|byte| *byte == b'\n').map_or(left.len(), |at| about + at + 1);
        let (part, rest) = left.split_at(end);
        let lines = line_ends(part);
        parts.push(CsvPart { bytes: part, first: line, lines });
        line += lines;
        left = rest;
    }
    parts
}

fn line_ends(bytes: &[u8]) -> u64 {
    bytes.iter().filter(|byte| **byte == b'\n').count() as u64
}

/// How many lines stand before the record that begins there, with remarks and empty lines in front of it.
fn lines_before(bytes: &[u8], mut at: usize) -> u64 {
    while let Some(b'#' | b'\r' | b'\n') = bytes.get(at) {
        at += bytes[at..].iter().position(|byte| *byte == b'\n').map_or(bytes.len() - at, |end| end + 1);
    }
    line_ends(&bytes[..at])
}

/// What rows of a table are read by.
struct CsvTable<'a> {
    names: &'a [String],
    /// The column of time stamps.
    clock: Option<usize>,
    /// Whole seconds that time stamps are counted from.
    start: i64,
}

impl CsvTable<'_> {
    /// The columns of some rows, with room for so many, and what is wrong in them.
    fn rows(&self, part: &CsvPart, room: usize) -> Result<(Vec<Vec<f64>>, Vec<String>), LogError> {
        let CsvPart { bytes, first, .. } = *part;
        let mut reader = reader(bytes, false);
        let (mut record, mut complaints) = (::csv::ByteRecord::new(), Vec::new());
        let mut columns: Vec<Vec<f64>> = self.names.iter().map(|_| Vec::with_capacity(room + 1)).collect();
        while reader.read_byte_record(&mut record).map_err(|error| unreadable(&error))? {
            let line = || first + lines_before(bytes, record.position().map_or(0, ::csv::Position::byte) as usize);
            if record.len() != columns.len() {
                let what = format!("{} fields, and the header has {}", record.len(), columns.len());
                return Err(LogError::new(format!("line {}", line()), what, FORM));
            }
            for (k, (column, field)) in columns.iter_mut().zip(&record).enumerate() {
                let field = field.trim_ascii();
                let number = if Some(k) == self.clock { seconds(field, self.start) } else { number(field) };
                if number.is_none() {
                    let (field, name) = (String::from_utf8_lossy(field), &self.names[k]);
                    complaints.push(format!("line {}: `{field}` in column `{name}` is no number", line()));
                }
                column.push(number.unwrap_or(f64::NAN));
            }
            if complaints.len() > MOST_COMPLAINTS {
                break;
            }
        }
        Ok((columns, complaints))
    }
}

const FORM: &str = "a log as CSV has a header, then as many fields in each row";

fn unreadable(error: &::csv::Error) -> LogError {
    let line = error.position().map_or(String::new(), |p| format!("line {}", p.line()));
    LogError::new(line, error.to_string(), FORM)
}

fn number(field: &[u8]) -> Option<f64> {
    match field.is_empty() {
        true => Some(f64::NAN),
        false => std::str::from_utf8(field).ok()?.parse().ok(),
    }
}

/// The whole seconds of the first time stamp, where it counts from an epoch.
fn whole_seconds(field: &[u8]) -> i64 {
    let whole = std::str::from_utf8(field).ok().and_then(|text| text.split('.').next());
    whole.and_then(|whole| whole.parse::<i64>().ok()).filter(|s| *s > 1_000_000).unwrap_or(0)
}

/// A time stamp, without the whole seconds of the first where that counts from an epoch: doubles have no digits left for nanoseconds there.
fn seconds(field: &[u8], first: i64) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?;
    let whole = text.split('.').next().unwrap_or("");
    match (first, whole.parse::<i64>().ok()) {
        (0, _) | (_, None) => number(field).map(|t| t - first as f64),
        (_, Some(count)) => {
            let rest = &text[whole.len()..];
            let rest: f64 = if rest.len() < 2 { 0.0 } else { rest.parse().ok()? };
            Some((count - first) as f64 + rest)
        }
    }
}
