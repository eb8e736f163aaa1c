//! Text: from a schedule to Rust source that a person would defend in review.
//!
//! No algebra happens here. A program becomes one function, or a few when it is long; values get the names that the
//! algorithm gave them; every section of the algorithm is a block under a comment.

pub mod batch;
mod body;
pub mod c_package;
pub mod contact;
mod doc;
pub mod error_bound;
mod file;
pub mod fused;
pub mod generated;
mod limbs;
mod names;
pub mod parameter;
pub mod staged;
mod style;

pub use body::{function, FunctionText};
pub use file::{file, kernel, preamble, scalar_module, Item, Provenance, GENERIC};
pub use generated::Generated;
pub use names::Names;

use straightline_graph::expr::Port;
use straightline_graph::{element, Scalar};

/// How a function is written: over one state or over lanes of states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// The scalar type.
    pub scalar: Scalar,
    /// Whether every scalar of inputs and outputs is an array over `N` lanes.
    pub lanes: bool,
    /// Whether a·b + c is one operation where the machine has it: [`fused::module`].
    pub fused: bool,
    /// Whether that operation is `crate::mul_add_f64` of the crate around the output, not that of `std`.
    pub fused_by_caller: bool,
    /// Whether the function takes any `T: straightline::Real` in place of `scalar`.
    pub generic: bool,
}

impl Style {
    /// One state.
    pub fn plain(scalar: Scalar) -> Self {
        Style { scalar, lanes: false, fused: false, fused_by_caller: false, generic: false }
    }

    /// With a·b + c as one operation, or without.
    pub fn fused(self, fused: bool) -> Self {
        Style { fused, ..self }
    }

    /// With that operation from the crate around the output.
    pub fn by_caller(self, fused_by_caller: bool) -> Self {
        Style { fused_by_caller, ..self }
    }

    /// In any scalar; in it nothing is fused.
    pub fn generic(self) -> Self {
        Style { generic: true, fused: false, ..self }
    }

    /// `N` states at once.
    pub fn lanes(self) -> Self {
        Style { lanes: true, ..self }
    }

    /// The type of one scalar of a port.
    fn element_type(self) -> String {
        match self.lanes {
            true => format!("[{}; N]", self.scalar_name()),
            false => self.scalar_name().to_string(),
        }
    }

    /// The type of a number.
    fn scalar_name(self) -> &'static str {
        if self.generic {
            "T"
        } else {
            self.scalar.name()
        }
    }

    /// The value of [`Style::element_type`] that is zero.
    fn zero(self) -> &'static str {
        match (self.generic, self.lanes) {
            (true, _) => "T::zero()",
            (false, true) => "[0.0; N]",
            (false, false) => "0.0",
        }
    }

    /// The array type of a port; what has a type of its own is the same for all lanes.
    pub fn array_type(self, port: &Port) -> String {
        match port.wrapper {
            Some(_) => array_type(port, self.scalar),
            None => shaped(port, self.element_type()),
        }
    }

    /// The place of scalar `k` of a port, in lanes that of one lane.
    fn element(self, port: &Port, k: usize) -> String {
        match (&port.wrapper, self.generic) {
            (Some(_), true) => format!("T::constant(Dd::from(f64::from({})))", element(port, k)),
            (Some(_), false) => element(port, k),
            (None, _) => element(port, k) + self.lane(),
        }
    }

    /// The path of a function of the kernel.
    fn kernel(self, function: &str) -> String {
        match self.generic {
            true => format!("T::{function}"),
            false => format!("trig::{function}_{}", self.scalar.name()),
        }
    }

    /// The path of a sine and cosine; over lanes it is told whether to fuse.
    fn sin_cos(self, function: &str) -> String {
        let scalar = self.scalar.name();
        match (self.fused, self.lanes) {
            (false, _) => self.kernel(function),
            (true, false) => format!("fused::{function}_{scalar}"),
            (true, true) => format!("fused::{function}_if_{scalar}::<FUSED>"),
        }
    }

    /// The index of the lane.
    fn lane(self) -> &'static str {
        if self.lanes {
            "[lane]"
        } else {
            ""
        }
    }

    /// The generic parameters.
    fn generics(self) -> &'static str {
        match (self.lanes, self.fused) {
            (false, _) if self.generic => "<T: Real>",
            (false, _) => "",
            (true, false) => "<const N: usize>",
            (true, true) => "<const N: usize, const FUSED: bool>",
        }
    }
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

fn shaped(port: &Port, element: String) -> String {
    port.shape.iter().rev().fold(element, |inner, n| format!("[{inner}; {n}]"))
}

/// The array type of a port: `[f64; 7]`, `[[f64; 7]; 6]`.
pub fn array_type(port: &Port, scalar: Scalar) -> String {
    if let Some(wrapper) = &port.wrapper {
        return wrapper.clone();
    }
    shaped(port, scalar.name().to_string())
}

/// What an array holds before its elements are computed: the first number of the inputs. An array of zeros would be filled by a call of
/// `memset` where there are no vector instructions.
pub fn filler<'a>(inputs: impl IntoIterator<Item = &'a Port>) -> String {
    inputs.into_iter().find(|p| !p.is_empty()).map_or("0.0".to_string(), |p| element(p, 0))
}

/// A number as a literal of the scalar; beyond its range the constant `INFINITY`, which means no limit where it is one, and is refused
/// in a function ([`crate::compile()`]).
pub(crate) fn number(x: f64, scalar: Scalar) -> String {
    let (held, name) = (scalar.rounded(x), scalar.name());
    match () {
        () if held.is_nan() => format!("{name}::NAN"),
        () if held.is_infinite() => format!("{}{name}::INFINITY", if held < 0.0 { "-" } else { "" }),
        () => scalar.literal(x),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_a_literal_or_a_constant_of_its_type() {
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
