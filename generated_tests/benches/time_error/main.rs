//! Run time against error: what accuracy costs, and what is gained by leaving things out.
//!
//! ```text
//! cargo bench -p straightline-generated-tests --bench time_error -- function panda [inverse_dynamics]
//! cargo bench -p straightline-generated-tests --bench time_error -- simulation
//! cargo bench -p straightline-generated-tests --bench time_error -- scaling
//! cargo bench -p straightline-generated-tests --bench time_error
//! ```
//!
//! The last one makes all charts; `redraw panda inverse_dynamics` draws what was measured once more. `STRAIGHTLINE_PEERS_PYTHON` names a Python that has `pinocchio`, for its point in them. Each is a picture, a table and JSON under `generated_tests/record/`. Errors are those of the code
//! that is timed, against the same equations in double-double, which in the same run are held against values of 25 digits.

mod chart;
mod function;
mod kernel;
mod scaling;
mod simulation;

use std::path::{Path, PathBuf};
use straightline_codegen::Function;

/// The charts that are made if none is named.
const FUNCTIONS: [(&str, &str); 6] = [
    ("panda", "inverse_dynamics"),
    ("panda", "mass_matrix"),
    ("panda", "forward_dynamics"),
    ("ur5", "inverse_dynamics"),
    ("solo12", "inverse_dynamics"),
    ("simple_humanoid", "inverse_dynamics"),
];

fn main() {
    // cargo adds `--bench`
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let word = |i: usize| arguments.get(i).map(String::as_str);
    match word(0) {
        Some("function") => one(word(1).unwrap_or("panda"), word(2).unwrap_or("inverse_dynamics")),
        Some("redraw") => {
            let (robot, function) = (word(1).unwrap_or("panda"), word(2).unwrap_or("inverse_dynamics"));
            let path = record(&format!("{}.json", record_name(robot, function)));
            let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            let panel = function::Panel::read(&serde_json::from_str(&text).expect("what was written"));
            chart::function(&panel, &path.with_extension("svg"));
        }
        Some("simulation") => simulation::run(),
        Some("scaling") => scaling::run(),
        Some(other) => panic!("`{other}` is none of function, redraw, simulation, scaling"),
        None => {
            FUNCTIONS.iter().for_each(|(robot, function)| one(robot, function));
            simulation::run();
            scaling::run();
        }
    }
}

fn one(robot: &str, function: &str) {
    let known = Function::from_name(function).unwrap_or_else(|| panic!("there is no function `{function}`"));
    let panel = function::measure(robot, known);
    let name = record_name(robot, function);
    chart::function(&panel, &record(&format!("{name}.svg")));
    write(&format!("{name}.json"), &(serde_json::to_string_pretty(&panel.json()).expect("plain values") + "\n"));
    write(&format!("{name}.md"), &chart::table(&panel));
}

fn record_name(robot: &str, function: &str) -> String {
    format!("2026-11-22-time-error-{robot}-{}", function.replace('_', "-"))
}

/// A file of the record.
pub fn record(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("record").join(name)
}

/// Writes a file of the record.
pub fn write(name: &str, text: &str) {
    let path = record(name);
    std::fs::write(&path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    println!("{}", path.display());
}
