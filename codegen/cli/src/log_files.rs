//! Logs of robots as files, and what is said of them.

use crate::motion::{columns, Columns};
use crate::{files, lerobot, print, CommandFailure};
use std::io::Write;
use std::path::Path;
use straightline_cli::base_motion::{add_base, no_base, unlogged_base};
use straightline_cli::experiment::parquet;
use straightline_cli::log_states::{log_demand, with_whole_states};
use straightline_codegen::diagnostic::six_digits;
use straightline_core::model::{Joint, Model};
use straightline_jit::LoadError;
use straightline_logs::align::{align, AlignedLog, LogReport};
use straightline_logs::log::{from_columns, JointLog, LogQuantity};
use straightline_logs::mcap::LoggedFrames;
use straightline_logs::{csv, mcap, LogError};
use straightline_simulation::html::four_digits;
use straightline_simulation::table::DataTable;
use straightline_view::{frame_poses, ViewedRun};

/// The frame in which poses are.
const WORLD: &str = "world";

/// A log of a robot's states.
pub fn aligned_log(path: &Path, topic: Option<&str>, model: &Model<f64>) -> Result<AlignedLog, CommandFailure> {
    let mut log = log(path, topic)?;
    if let Some(base) = base_of_messages(path, &mut log, model)? {
        return Err(wrong(path, &no_base(base)));
    }
    let aligned = align(&log, &log_demand(model));
    aligned.and_then(|log| with_whole_states(model, log)).map_err(|error| wrong(path, &error))
}

/// Takes the base from messages of poses, where a log has no columns of it. The base of an MCAP file that says nothing of it.
fn base_of_messages<'a>(
    path: &Path,
    log: &mut JointLog,
    model: &'a Model<f64>,
) -> Result<Option<&'a Joint>, CommandFailure> {
    let Some(base) = unlogged_base(model, log).filter(|_| has_extension(path, "mcap")) else { return Ok(None) };
    let poses = mcap::frame_poses(&bytes_of(path)?);
    let is_there = poses.and_then(|poses| add_base(log, base, model, &poses)).map_err(|error| wrong(path, &error))?;
    Ok((!is_there).then_some(base))
}

/// Says why a robot has no functions.
pub fn not_loaded(error: LoadError) -> CommandFailure {
    match error {
        LoadError::Wrong(diagnostics) => print::refused(&diagnostics),
        other @ LoadError::Option { .. } => print::failure(other.to_string()),
    }
}

/// A frequency \[Hz\].
pub fn cutoff(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (1e-3..=1e5).contains(&x) => Ok(x),
        _ => Err("a frequency between 0.001 and 100000 Hz".to_string()),
    }
}

fn wrong(path: &Path, error: &LogError) -> CommandFailure {
    let help: Vec<&str> = Some(error.help.as_str()).filter(|help| !help.is_empty()).into_iter().collect();
    print::failure_with(format!("{}: {error}", path.display()), &help)
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted))
}

fn bytes_of(path: &Path) -> std::io::Result<Vec<u8>> {
    std::fs::read(path).map_err(|e| std::io::Error::new(e.kind(), format!("{}: {e}", path.display())))
}

/// The log of a file, whose kind its name says.
fn log(path: &Path, topic: Option<&str>) -> Result<JointLog, CommandFailure> {
    files::note(path);
    if topic.is_some() && !has_extension(path, "mcap") {
        let text = format!("{} has no topics", path.display());
        return Err(print::failure_with(text, &["`--topic` is for MCAP files: leave it out"]));
    }
    let found = if path.is_dir() {
        lerobot::read(path)
    } else if parquet::is_parquet(path) {
        let table = parquet::read(path).map_err(|why| print::failure(format!("{}: {why}", path.display())))?;
        from_columns(columns(&table))
    } else {
        let bytes = bytes_of(path)?;
        if has_extension(path, "mcap") {
            mcap::read(&bytes, topic)
        } else if has_extension(path, "csv") {
            csv::read(&bytes)
        } else {
            let help = ["logs are folders of LeRobot, or end in .mcap, .csv or .parquet; `ros2 bag convert` makes MCAP of other bags"];
            return Err(print::failure_with(format!("{}: no log that is known", path.display()), &help));
        }
    };
    found.map_err(|error| wrong(path, &error))
}

/// A table with `t`, `q.`, `qd.` and `tau.` of a robot as MCAP: joint states, and poses of all frames in the world.
pub fn mcap_bytes(table: &DataTable, model: &Model<f64>) -> Result<Vec<u8>, CommandFailure> {
    let columns = columns(table);
    let run = ViewedRun::of_columns(model, &columns).map_err(|failures| match failures.into_iter().next() {
        Some(failure) => print::failure_with(failure.what, &[failure.help]),
        None => CommandFailure::Input,
    })?;
    let poses = |q: &Vec<f64>| frame_poses(model, q).iter().map(|pose| (pose.position, pose.turn)).collect();
    let frames = LoggedFrames {
        parent: WORLD.to_string(),
        children: model.frames.iter().map(|frame| frame.name.clone()).collect(),
        poses: run.configurations.iter().map(poses).collect(),
    };
    let bytes = from_columns(columns).and_then(|log| mcap::bytes_with(&log, mcap::TOPIC, &frames.without(WORLD)));
    bytes.map_err(|error| print::failure_with(format!("no log can be made of this: {error}"), &[error.help]))
}

/// The columns of a log as runs have them: rows with all positions, in the order of time.
pub fn run_columns(path: &Path, model: &Model<f64>) -> Result<Columns, CommandFailure> {
    let mut log = log(path, None)?;
    // a base of which nothing is said is drawn standing still
    base_of_messages(path, &mut log, model)?;
    let JointLog { joints, times, columns, .. } = log;
    let positions = &columns[LogQuantity::Position as usize];
    let mut last = f64::NEG_INFINITY;
    let mut is_whole = |i: &usize| {
        let whole = times[*i] > last && positions.iter().all(|column| column.is_empty() || column[*i].is_finite());
        if whole {
            last = times[*i];
        }
        whole
    };
    let rows: Vec<usize> = (0..times.len()).filter(|i| is_whole(i)).collect();
    let mut found = vec![("t".to_string(), rows.iter().map(|i| times[*i]).collect())];
    for (prefix, columns) in ["q", "qd", "tau", "qdd"].iter().zip(&columns) {
        let written = joints.iter().zip(columns).filter(|(_, column)| !column.is_empty());
        let picked =
            written.map(|(joint, column)| (format!("{prefix}.{joint}"), rows.iter().map(|i| column[*i]).collect()));
        // what is plotted has a number in every row
        found.extend(picked.filter(|(_, column): &(String, Vec<f64>)| column.iter().all(|x| x.is_finite())));
    }
    Ok(found)
}

/// A table in columns as wide as they need.
pub fn print_table(out: &mut impl Write, head: &[&str], rows: &[Vec<String>]) -> std::io::Result<()> {
    let width =
        |k: usize| rows.iter().map(|r| r[k].chars().count()).chain([head[k].chars().count()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let mut line = |cells: &mut dyn Iterator<Item = &str>| -> std::io::Result<()> {
        for (k, (cell, width)) in cells.zip(&widths).enumerate() {
            match k {
                0 => write!(out, "{cell:<width$}")?,
                _ => write!(out, "  {cell:>width$}")?,
            }
        }
        writeln!(out)
    };
    line(&mut head.iter().copied())?;
    rows.iter().try_for_each(|row| line(&mut row.iter().map(String::as_str)))
}

/// So many places are named one by one.
const MOST_PLACES: usize = 5;

/// What was met in a log.
pub fn report_lines(report: &LogReport) -> Vec<String> {
    let LogReport { rows, kept, period, .. } = report;
    let rate = if *period > 0.0 { four_digits(1.0 / period) } else { "0".to_string() };
    let mut lines = vec![format!("{kept} of {rows} rows, {rate} Hz; longest step {} s", six_digits(report.longest))];
    let mut count = |n: usize, what: &str| {
        if n > 0 {
            lines.push(format!("{n} {what}"));
        }
    };
    count(report.incomplete, "rows left out that lack a number, or have one that is not finite or beyond 1e50");
    count(report.duplicates, "rows left out with the time stamp of the row before");
    count(report.reordered, "messages with joints in another order, or other joints, than the message before");
    count(report.unstamped, "messages without a time stamp of their own, taken at the time at which they were logged");
    let listed = |all: &[(f64, f64)], shown: &dyn Fn(&(f64, f64)) -> String| {
        let rest = if all.len() > MOST_PLACES { ", …" } else { "" };
        all.iter().take(MOST_PLACES).map(shown).collect::<Vec<_>>().join(", ") + rest
    };
    if !report.gaps.is_empty() {
        let gaps = listed(&report.gaps, &|(from, to)| format!("{from:.4} to {to:.4} s"));
        lines.push(format!("{} gaps: {gaps}", report.gaps.len()));
    }
    if !report.jumps.is_empty() {
        let jumps = listed(&report.jumps, &|(at, by)| format!("by {by:.4} s at {at:.4} s"));
        lines.push(format!("the clock jumps back {} times: {jumps}", report.jumps.len()));
    }
    for (what, names) in [
        ("joints of the log that the robot does not have", &report.unknown),
        ("joints that others determine, and that were not read", &report.determined),
        ("without velocity, for which positions were differentiated", &report.without_velocity),
        ("not in the log, and taken as zero, as forces do not depend on it", &report.without_position),
        ("forces that are not measured", &report.without_effort),
        ("not read", &report.others),
    ] {
        if !names.is_empty() {
            lines.push(format!("{what}: {}", names.join(", ")));
        }
    }
    lines
}
