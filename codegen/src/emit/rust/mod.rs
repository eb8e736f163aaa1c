//! Rust: files of functions that depend on `core` alone.

mod associated;
mod batch;
pub mod c_package;
mod constants;
mod contact;
mod file;
mod fixed;
mod frames;
pub mod fused;
mod parameter;
mod routine;
mod self_test;
mod staged;
pub mod stubs;

pub use associated::associated_items;
pub use file::{file, kernel, measurable, scalar_module, symbol};
pub use fixed::fixed_module;
pub use routine::Rust;

use super::module::{Routine, StateCertificate};
use super::{Style, Target};
use straightline_graph::element;
use straightline_graph::expr::{Constant, Port};
use straightline_graph::Scalar;

/// What makes sense in code that a person writes: no numbers near π/4, no locals declared before their values.
const ALLOW: &str = "#[allow(clippy::all)]";

/// A function of straight-line code.
fn routine(routine: &Routine) -> String {
    Rust.routine(routine)
}

/// A bound of errors at a state, or a comment that says why there is none.
fn bound(bound: &StateCertificate) -> String {
    match bound {
        Ok(bound) => routine(bound),
        Err(why) => format!("// {why}\n"),
    }
}

/// The array type of a port: `[f64; 7]`, `[[f64; 7]; 6]`; what has a type of its own is the same for all lanes.
pub fn array_type(port: &Port, style: Style) -> String {
    match &port.wrapper {
        Some(wrapper) => wrapper.clone(),
        None => port.shape.iter().rev().fold(element_type(style), |inner, n| format!("[{inner}; {n}]")),
    }
}

/// The type of one scalar of a port.
fn element_type(style: Style) -> String {
    match style.lanes {
        true => format!("[{}; N]", number_type(style)),
        false => number_type(style).to_string(),
    }
}

/// The type of a number.
fn number_type(style: Style) -> &'static str {
    match style.generic {
        true => "T",
        false => style.scalar.name(),
    }
}

/// The value of [`element_type`] that is zero.
fn zero(style: Style) -> &'static str {
    match (style.generic, style.lanes) {
        (true, _) => "T::zero()",
        (false, true) => "[0.0; N]",
        (false, false) => "0.0",
    }
}

/// The path of a function of the kernel.
fn kernel_path(function: &str, style: Style) -> String {
    match style.generic {
        true => format!("T::{function}"),
        false => format!("trig::{function}_{}", style.scalar.name()),
    }
}

/// The generic parameters of a function.
fn generics(style: Style) -> &'static str {
    match (style.lanes, style.fused) {
        (false, _) if style.generic => "<T: Real>",
        (false, _) => "",
        (true, false) => "<const N: usize>",
        (true, true) => "<const N: usize, const FUSED: bool>",
    }
}

/// What an array holds before its elements are computed: the first number of the inputs. An array of zeros would be filled by a call of
/// `memset` where there are no vector instructions.
fn filler<'a>(inputs: impl IntoIterator<Item = &'a Port>) -> String {
    inputs.into_iter().find(|p| !p.is_empty()).map_or("0.0".to_string(), |p| element(p, 0))
}

/// A number as a literal of the scalar; beyond its range the constant `INFINITY`, which means no limit where it is one, and is refused
/// in a function ([`crate::compile()`]).
fn number(x: f64, scalar: Scalar) -> String {
    let (held, name) = (scalar.rounded(x), scalar.name());
    match () {
        () if held.is_nan() => format!("{name}::NAN"),
        () if held.is_infinite() => format!("{}{name}::INFINITY", if held < 0.0 { "-" } else { "" }),
        () => scalar.literal(x),
    }
}

/// The constant, rounded once to the scalar's format, as the shortest literal that reads back to it; for any scalar in two
/// parts.
fn literal(c: Constant, style: Style) -> String {
    match (style.generic, style.scalar) {
        (true, _) => format!("number::<T>({:?}, {:?})", c.value().hi(), c.value().lo()),
        (false, scalar) => number(scalar.nearest(c.value()), scalar),
    }
}

/// Texts above an item, line by line.
fn doc(text: &str) -> String {
    text.lines().map(|line| format!("///{}{line}\n", if line.is_empty() { "" } else { " " })).collect()
}

/// `start`, the items with commas, `end`; lines of bounded length.
fn wrapped(start: &str, items: &[String], end: &str) -> String {
    let mut text = String::from(start);
    let mut column = start.len();
    for (i, item) in items.iter().enumerate() {
        if i > 0 {
            text.push(',');
            if column + item.len() + 3 > 110 {
                text.push_str("\n        ");
                column = 8;
            } else {
                text.push(' ');
                column += 2;
            }
        }
        text.push_str(item);
        column += item.len();
    }
    text.push_str(end);
    text.push('\n');
    text
}

/// A text about numbers, of which `{t}` is the type.
fn of_scalar(text: &str, scalar: Scalar) -> String {
    text.replace("{t}", scalar.name())
}

/// A text in a block of its own.
fn indented(text: &str) -> String {
    let line = |l: &str| if l.is_empty() { "\n".to_string() } else { format!("    {l}\n") };
    text.lines().map(line).collect()
}

/// A source file in a block of its own, where it has no documentation of its own.
fn pasted(source: &str) -> String {
    let line = |l: &str| l.strip_prefix("//!").map_or_else(|| l.to_string(), |doc| format!("//{doc}"));
    indented(&source.lines().map(line).collect::<Vec<_>>().join("\n"))
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn a_number_is_a_literal_or_a_constant_of_its_type() {
        for (x, scalar, text) in [
            (0.1, Scalar::F32, "0.1"),
            (1e40, Scalar::F32, "f32::INFINITY"),
            (-f64::MAX, Scalar::F32, "-f32::INFINITY"),
            (1e40, Scalar::F64, "1e40"),
            (f64::INFINITY, Scalar::F64, "f64::INFINITY"),
            (1e-45, Scalar::F32, "1e-45"),
            (f64::NAN, Scalar::F64, "f64::NAN"),
        ] {
            assert_eq!(number(x, scalar), text);
        }
    }
}
