//! Text: from a schedule to Rust source that a person would defend in review.
//!
//! No algebra happens here. A program becomes one function, or a few when it is long; values get the names that the
//! algorithm gave them; every section of the algorithm is a block under a comment.

mod body;
mod file;
mod names;
pub mod parameter;

pub use body::{function, FunctionText};
pub use file::{file, kernel, preamble, scalar_module, Item, Provenance};
pub use names::{snake_case, upper_camel_case, Names};

use crate::expr::Port;

/// The scalar type of generated code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scalar {
    /// Double precision.
    F64,
    /// Single precision.
    F32,
}

impl Scalar {
    /// Its Rust name.
    pub fn name(self) -> &'static str {
        match self {
            Scalar::F64 => "f64",
            Scalar::F32 => "f32",
        }
    }

    /// The module of a generated file that has the same items in this scalar.
    pub fn module(self) -> &'static str {
        match self {
            Scalar::F64 => "double",
            Scalar::F32 => "single",
        }
    }

    /// Its size in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Scalar::F64 => 8,
            Scalar::F32 => 4,
        }
    }
}

/// The array type of a port: `[f64; 7]`, `[[f64; 7]; 6]`.
pub fn array_type(port: &Port, scalar: Scalar) -> String {
    if let Some(wrapper) = &port.wrapper {
        return wrapper.clone();
    }
    port.shape.iter().rev().fold(scalar.name().to_string(), |inner, n| format!("[{inner}; {n}]"))
}

/// The place of scalar `k` of a port: `h[2][3]`.
pub fn element(port: &Port, k: usize) -> String {
    let mut rest = k;
    let mut indices = Vec::new();
    for n in port.shape.iter().rev() {
        indices.push(rest % n);
        rest /= n;
    }
    let name = if port.wrapper.is_some() { format!("{}.0", port.name) } else { port.name.clone() };
    indices.iter().rev().fold(name, |text, i| format!("{text}[{i}]"))
}

/// Element k of ports that stand one after the other.
pub fn element_of(ports: &[Port], mut k: usize) -> String {
    for port in ports {
        if k < port.len() {
            return element(port, k);
        }
        k -= port.len();
    }
    panic!("an element beyond the ports");
}

/// A name from a robot file as part of a comment: it stays on its line, and in C does not end the comment.
pub fn one_line(name: &str) -> String {
    let is_break = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    name.chars().map(|c| if is_break(c) { ' ' } else { c }).collect::<String>().replace("*/", "* /")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_cannot_leave_the_comment_it_stands_in() {
        assert_eq!(one_line("a*/\nint x;"), "a* / int x;");
    }
}
