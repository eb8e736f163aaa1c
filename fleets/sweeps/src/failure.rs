//! What this package complains of, in one table. What is wrong with robots and experiments their readers say.

use datafusion::error::DataFusionError;
use std::fmt::Display;
use straightline_cli::experiment::parameter::ParameterRange;
use straightline_codegen::diagnostic::{Diagnostic, Diagnostics, Source};

/// Other arguments than a sweep has.
pub fn arguments(found: usize) -> DataFusionError {
    DataFusionError::Plan(format!(
        "`sweep` has 5 arguments, not {found}: sweep(robot, experiment, ranges, samples, seed)\n\
         help: all are literals, such as sweep('panda.urdf', 'panda_reach.toml', 'panda_link7.mass=0.5:3', 1000, 7)"
    ))
}

/// An argument that cannot be.
pub fn argument(name: &str, found: &dyn Display, be: &str) -> DataFusionError {
    DataFusionError::Plan(format!("`{name}` of `sweep` is {found}\nhelp: it is {be}"))
}

/// A call that no sweep made.
pub fn other_plan() -> DataFusionError {
    DataFusionError::Plan("`sweep_sample` is a part of the table `sweep`\nhelp: SELECT … FROM sweep(robot, experiment, ranges, samples, seed)".to_string())
}

/// What the readers of robots and experiments say.
pub fn said(diagnostics: &Diagnostics) -> DataFusionError {
    DataFusionError::Plan(diagnostics.render().trim_end().to_string())
}

/// What is wrong with a part of the ranges, under which a caret stands.
pub fn at_range(ranges: &Source, part: std::ops::Range<usize>, wrong: Diagnostic) -> DataFusionError {
    let mut diagnostics = Diagnostics::new();
    diagnostics.add_source(ranges);
    diagnostics.push(wrong.at(&ranges.place(part)));
    said(&diagnostics)
}

/// A text that is no range.
pub fn no_range(be: &str) -> Diagnostic {
    Diagnostic::error("unknown-parameter", "this is no range").help(format!("write {be}"))
}

/// A number that is drawn twice.
pub fn drawn_twice(path: &str) -> Diagnostic {
    Diagnostic::error("unknown-parameter", format!("`{path}` has two ranges")).help("give each number one range")
}

/// An end of a range that makes no robot.
pub fn no_robot_at(range: &ParameterRange, value: f64, why: &str) -> Diagnostic {
    let title = format!("`{}` = {value} makes no robot: {why}", range.path);
    Diagnostic::error("not-in-range", title).help("let both ends of a range be numbers that the robot can have")
}

/// An experiment without a motion.
pub fn no_motion(experiment: &str) -> DataFusionError {
    DataFusionError::Plan(format!("{experiment} prescribes no motion\nhelp: write a table [motion]"))
}
