//! Samples over time from CSV and JSON files, with the place of whatever is wrong.

use super::messages as say;
use straightline_codegen::diagnostic::{Diagnostics, Place, Source};

/// Columns of numbers by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// Names and numbers, all of one length.
    pub columns: Vec<(String, Vec<f64>)>,
}

impl Columns {
    /// The column of that name.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|(n, _)| n == name).map(|(_, column)| &column[..])
    }

    /// The names.
    pub fn names(&self) -> Vec<&str> {
        self.columns.iter().map(|(name, _)| name.as_str()).collect()
    }
}

/// Reads samples: JSON if the file's name ends so, else CSV. The column `t` is there, and goes on from row to row. Complaints go
/// to `diagnostics`; `None` after errors.
pub fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<Columns> {
    let mut found = Diagnostics::new();
    found.add_source(source);
    let columns = table(source, &mut found);
    if let Some(columns) = &columns {
        match columns.get("t") {
            None => found.push(say::column_missing("t", &columns.names()).at(&source.place(0..0))),
            Some([]) => found.push(say::not_samples("there is no row").at(&source.place(0..0))),
            Some(times) => {
                if let Some(k) = (1..times.len()).find(|k| times[*k] <= times[k - 1]) {
                    found.push(say::time_goes_back(times[k], times[k - 1]).at(&row_place(source, k)));
                }
            }
        }
    }
    let sound = !found.has_errors();
    diagnostics.extend(found);
    columns.filter(|_| sound)
}

/// Reads columns, whatever they are: JSON if the file's name ends so, else CSV. Complaints go to `diagnostics`; `None` after errors.
pub fn table(source: &Source, diagnostics: &mut Diagnostics) -> Option<Columns> {
    let mut found = Diagnostics::new();
    found.add_source(source);
    let columns = match source.path().ends_with(".json") {
        true => json(source, &mut found),
        false => csv(source, &mut found),
    };
    let sound = !found.has_errors();
    diagnostics.extend(found);
    columns.filter(|_| sound)
}

fn csv_reader(source: &Source) -> ::csv::Reader<&[u8]> {
    ::csv::ReaderBuilder::new().trim(::csv::Trim::All).comment(Some(b'#')).from_reader(source.text().as_bytes())
}

/// The line of a position.
fn line_place(source: &Source, position: Option<&::csv::Position>) -> Place {
    let at = position.map_or(0, |p| (p.byte() as usize).min(source.text().len()));
    let line = source.text()[at..].lines().next().map_or(0, str::len);
    source.place(at..at + line)
}

/// Where a row stands; of JSON the file.
fn row_place(source: &Source, row: usize) -> Place {
    match source.path().ends_with(".json") {
        true => source.place(0..0),
        false => {
            let record = csv_reader(source).into_records().nth(row).and_then(Result::ok);
            line_place(source, record.as_ref().and_then(|record| record.position()))
        }
    }
}

fn csv(source: &Source, diagnostics: &mut Diagnostics) -> Option<Columns> {
    let mut reader = csv_reader(source);
    let place = |position: Option<&::csv::Position>| line_place(source, position);
    let names = match reader.headers() {
        Ok(names) => names.clone(),
        Err(error) => {
            diagnostics.push(say::not_samples(&error.to_string()).at(&place(error.position())));
            return None;
        }
    };
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for name in &names {
        if columns.iter().any(|(known, _)| known == name) {
            diagnostics.push(say::not_samples(&format!("two columns are called `{name}`")).at(&place(None)));
        }
        columns.push((name.to_string(), Vec::new()));
    }
    for record in reader.records() {
        let record = match record {
            Ok(record) => record,
            Err(error) => {
                diagnostics.push(say::not_samples(&error.to_string()).at(&place(error.position())));
                return None;
            }
        };
        for ((name, column), text) in columns.iter_mut().zip(&record) {
            let number = text.parse::<f64>().ok().filter(|x| x.is_finite());
            if number.is_none() {
                diagnostics.push(say::not_a_number(name, text).at(&place(record.position())));
            }
            column.push(number.unwrap_or(0.0));
        }
    }
    Some(Columns { columns })
}

fn json(source: &Source, diagnostics: &mut Diagnostics) -> Option<Columns> {
    let whole = source.place(0..0);
    let object: serde_json::Map<String, serde_json::Value> = match serde_json::from_str(source.text()) {
        Ok(object) => object,
        Err(error) => {
            let start: usize =
                source.text().split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
            let at = (start + error.column().saturating_sub(1)).min(source.text().len());
            diagnostics.push(say::not_samples(&error.to_string()).at(&source.place(at..at)));
            return None;
        }
    };
    let mut columns = Columns::default();
    for (name, value) in &object {
        let Some(array) = value.as_array() else {
            diagnostics.push(say::not_samples(&format!("`{name}` is no array of numbers")).at(&whole));
            continue;
        };
        let number = |x: &serde_json::Value| x.as_f64().filter(|x| x.is_finite());
        if let Some(bad) = array.iter().find(|x| number(x).is_none()) {
            diagnostics.push(say::not_a_number(name, &bad.to_string()).at(&whole));
        }
        columns.columns.push((name.clone(), array.iter().map(|x| number(x).unwrap_or(0.0)).collect()));
    }
    let length = columns.columns.first().map_or(0, |(_, column)| column.len());
    if let Some((name, column)) = columns.columns.iter().find(|(_, column)| column.len() != length) {
        let why = format!("`{name}` has {} numbers, the first array {length}", column.len());
        diagnostics.push(say::not_samples(&why).at(&whole));
    }
    Some(columns)
}
