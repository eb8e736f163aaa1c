//! What this package complains of, in one table: what it is, the value, the remedy. What is wrong with a robot file the compiler says.

use datafusion::error::DataFusionError;
use std::fmt::Display;
use std::path::Path;

/// What is found while a query is planned.
fn while_planning(text: String) -> DataFusionError {
    DataFusionError::Plan(text)
}

/// What only rows tell.
fn of_rows(text: String) -> DataFusionError {
    DataFusionError::Execution(text)
}

/// The robot is no literal.
pub fn robot_of_rows(function: &str) -> DataFusionError {
    while_planning(format!(
        "the robot of `{function}` is computed row by row\nhelp: write it as a literal, such as 'panda.urdf'; rows of different robots are told apart by WHERE or CASE"
    ))
}

/// The robot is null, or neither a text nor what planning makes of it.
pub fn no_robot(function: &str, found: &dyn Display) -> DataFusionError {
    while_planning(format!(
        "the robot of `{function}` is {found}\nhelp: write the path of a robot file, such as 'panda.urdf'"
    ))
}

/// A name that only who plans can read.
pub fn unread(name: &str) -> DataFusionError {
    while_planning(format!(
        "`{name}` was not read while the query was planned\nhelp: files are read by a session that `register` was given a folder for"
    ))
}

/// A file that cannot be read.
pub fn unreadable(name: &str, file: &Path, why: &dyn Display) -> DataFusionError {
    let file = file.display();
    while_planning(format!("`{name}` cannot be read: {file}: {why}\nhelp: names count from the folder of robots"))
}

/// A place that is neither a file nor an address.
pub fn not_a_file(name: &str, scheme: &str) -> DataFusionError {
    while_planning(format!(
        "`{name}` is not read by `{scheme}`: robots are files, or have an address of `http` or `https`\nhelp: copy it into the folder of robots; the hash behind `#sha256:` says that it is the same"
    ))
}

/// An address that may answer something else tomorrow.
pub fn address_without_hash(name: &str) -> DataFusionError {
    while_planning(format!(
        "`{name}` has no hash\nhelp: write `#sha256:` and the hash of the file behind the address, as `sha256sum` prints it, so that the query says which robot it means"
    ))
}

/// An address that does not answer, or not with a file.
pub fn unreachable(name: &str, why: &dyn Display) -> DataFusionError {
    while_planning(format!(
        "`{name}` cannot be fetched: {why}\nhelp: who plans the query fetches it, within 30 s and up to 64 MB; a copy in the folder of robots serves as well"
    ))
}

/// A text that cannot be a hash.
pub fn no_hash(name: &str, hash: &str) -> DataFusionError {
    let found = hash.chars().count();
    while_planning(format!("the hash `{hash}` of `{name}` has {found} characters\nhelp: SHA-256 has 64 hexadecimal digits; leave `#sha256:` out if any file will do"))
}

/// A file that is not the one that was meant.
pub fn other_hash(name: &str, wanted: &str, found: &str) -> DataFusionError {
    while_planning(format!(
        "`{name}` is another file\n  wanted: sha256:{wanted}\n  found:  sha256:{found}\nhelp: if the file is the right one, write its hash"
    ))
}

/// A file whose text alone is not the robot.
pub fn names_files(name: &str, others: &[String]) -> DataFusionError {
    let others = others.join(", ");
    while_planning(format!(
        "`{name}` takes other files: {others}\nhelp: executors get its text alone; `straightline convert` makes one file of them"
    ))
}

/// What the compiler says.
pub fn broken_robot(text: &str) -> DataFusionError {
    while_planning(text.to_string())
}

/// Why a robot has no such result.
pub fn refused(function: &str, robot: &str, why: &str) -> DataFusionError {
    while_planning(format!("`{function}` is not for `{robot}`: {why}"))
}

/// Other arguments than the function has.
pub fn arguments(function: &str, expected: &[&str], found: usize) -> DataFusionError {
    let (count, names) = (expected.len() + 1, expected.join(", "));
    while_planning(format!("`{function}` has {count} arguments, not {found}: {function}(robot, {names})"))
}

/// An argument that is no list of numbers.
pub fn no_numbers(function: &str, argument: &str, found: &dyn Display) -> DataFusionError {
    while_planning(format!(
        "`{argument}` of `{function}` is of type {found}\nhelp: it is a list of numbers, or a struct with a number per joint; make_array(a, b) makes a list of columns"
    ))
}

/// A struct with other fields than the robot has joints.
pub fn other_joints(argument: &str, robot: &str, expected: &[String], found: &[String]) -> DataFusionError {
    let (expected, found) = (expected.join(", "), found.join(", "));
    while_planning(format!("`{argument}` has the fields {found}\nhelp: `{robot}` has, in this order, {expected}"))
}

/// Lists that are all of another length, by their type.
pub fn length_of_type(argument: &str, robot: &str, expected: usize, found: i32) -> DataFusionError {
    while_planning(format!("`{argument}` has {found} numbers in every row, `{robot}` takes {expected}"))
}

/// A list of another length.
pub fn length(argument: &str, robot: &str, expected: usize, found: usize, row: usize) -> DataFusionError {
    of_rows(format!(
        "`{argument}` has {found} numbers in row {row} of its batch, `{robot}` takes {expected}\nhelp: cardinality({argument}) = {expected} selects the rows that are sound"
    ))
}

/// A product that exact sums do not hold.
pub fn beyond_sums(argument: &str, value: f64) -> DataFusionError {
    of_rows(format!(
        "a product of regressor and efforts is {value}, which exact sums do not hold\nhelp: are all numbers of `{argument}` and of the motion finite, and in SI units?"
    ))
}

/// Sums that grew too large.
pub fn sums_overflow() -> DataFusionError {
    of_rows(
        "the sums of the normal equations exceed 1.8e19\nhelp: fewer rows per group, and efforts in SI units"
            .to_string(),
    )
}

/// States of two different sums.
pub fn other_state() -> DataFusionError {
    DataFusionError::Internal("partial sums of another robot were to be merged".to_string())
}

/// What is no result of `regressor_normal_equations`.
pub fn no_equations(found: &dyn Display) -> DataFusionError {
    while_planning(format!(
        "`identified_parameters` takes what `regressor_normal_equations` gives, not {found}\nhelp: identified_parameters(regressor_normal_equations(robot, q, qd, qdd, effort))"
    ))
}
