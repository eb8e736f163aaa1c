//! Folders of LeRobot: episodes of a robot as Parquet files, with a description beside them.
//!
//! `meta/info.json` names the joints of `observation.state`; files anywhere in `data/` have the columns `timestamp`, which begins anew with each
//! episode, and lists `observation.state`, `observation.velocity` and `observation.effort`.

use std::path::{Path, PathBuf};
use straightline_cli::experiment::parquet::{wide_columns, WideColumn};
use straightline_logs::log::{from_columns, JointLog};
use straightline_logs::LogError;

/// What is read, and how columns of logs of it begin.
const QUANTITIES: [(&str, &str); 3] =
    [("observation.state", "q"), ("observation.velocity", "qd"), ("observation.effort", "tau")];
/// The time in an episode \[s\].
const TIME: &str = "timestamp";
/// What names of joints may end with.
const POSITION: &str = ".pos";
/// Folders within folders, at most.
const DEEPEST: usize = 8;

/// The joints of all episodes.
///
/// # Errors
/// The folder is none of LeRobot, or a file of it is damaged or does not fit the others.
pub fn read(folder: &Path) -> Result<JointLog, LogError> {
    let joints = joints(folder)?;
    let mut files = Vec::new();
    find(&folder.join("data"), &mut files, DEEPEST);
    files.sort();
    let mut table: Vec<(String, Vec<f64>)> = vec![("t".to_string(), Vec::new())];
    for (_, prefix) in QUANTITIES {
        table.extend(joints.iter().map(|joint| (format!("{prefix}.{joint}"), Vec::new())));
    }
    for path in &files {
        append(path, &joints, &mut table)?;
    }
    if table[0].1.is_empty() {
        return Err(LogError::new(
            "",
            "no file in its folder `data` has rows",
            "episodes are Parquet files in `data/`",
        ));
    }
    table.retain(|(_, column)| !column.is_empty());
    from_columns(table)
}

/// Names of the joints, without the ending `.pos` that all may have.
fn joints(folder: &Path) -> Result<Vec<String>, LogError> {
    let form = "`meta/info.json` has `features`, of these `observation.state`, of that `names`, a list of joints";
    let path = folder.join("meta/info.json");
    let wrong = |what: String| LogError::new("meta/info.json", what, form);
    let text = std::fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
    let info: serde_json::Value = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    let names = &info["features"][QUANTITIES[0].0]["names"];
    // older folders have the list under a word, such as `motors`
    let list = names.as_array().or_else(|| names.as_object()?.values().find_map(serde_json::Value::as_array));
    let named = list.map(|list| list.iter().map(|name| name.as_str().map(str::to_string)).collect::<Option<Vec<_>>>());
    let Some(Some(names)) = named else { return Err(wrong("it does not name the joints".to_string())) };
    let is_plain = names.iter().all(|name| name.ends_with(POSITION));
    let plain = |name: String| if is_plain { name[..name.len() - POSITION.len()].to_string() } else { name };
    Ok(names.into_iter().map(plain).collect())
}

/// Parquet files in a folder and in those in it.
fn find(folder: &Path, files: &mut Vec<PathBuf>, deepest: usize) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() && deepest > 0 {
            find(&path, files, deepest - 1);
        } else if path.extension().is_some_and(|e| e == "parquet") {
            files.push(path);
        }
    }
}

/// Appends the rows of a file.
fn append(path: &Path, joints: &[String], table: &mut [(String, Vec<f64>)]) -> Result<(), LogError> {
    let place = path.display().to_string();
    let wrong = |what: String, help: &str| LogError::new(place.clone(), what, help);
    let wanted: Vec<&str> = QUANTITIES.iter().map(|(name, _)| *name).chain([TIME]).collect();
    let found = wide_columns(path, &wanted).map_err(|what| wrong(what, "the file is no Parquet file, or damaged"))?;
    let column = |name: &str| found.iter().find(|column| column.name == name);
    let Some(WideColumn { width: 1, numbers: times, .. }) = column(TIME) else {
        return Err(wrong(format!("no column `{TIME}` with a number in each row"), "LeRobot writes one"));
    };
    let before = table[0].1.len();
    table[0].1.extend(times);
    for (k, (name, _)) in QUANTITIES.iter().enumerate() {
        let own = &mut table[1 + k * joints.len()..][..joints.len()];
        let had = own.iter().any(|(_, column)| !column.is_empty());
        match column(name) {
            Some(column) if column.width == joints.len() && (had || before == 0) => {
                for (j, (_, to)) in own.iter_mut().enumerate() {
                    to.extend(column.numbers.iter().skip(j).step_by(column.width));
                }
            }
            Some(column) if column.width != joints.len() => {
                let what =
                    format!("`{name}` has {} numbers in a row, and there are {} joints", column.width, joints.len());
                return Err(wrong(what, "`names` in `meta/info.json` has one name per number"));
            }
            None if !had => {}
            _ => return Err(wrong(format!("`{name}` is in some files only"), "all episodes have the same columns")),
        }
    }
    Ok(())
}
