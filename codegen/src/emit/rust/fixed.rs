//! Functions in fixed point, as a module of the file: what depends on `core` alone, wraps where it may and panics nowhere.

use super::{doc, indented, pasted};
use crate::emit::Names;
use crate::program::fixed::FixedFunction;
use crate::report::errors::four_digits;
use std::fmt::Write;
use straightline_graph::element;
use straightline_graph::expr::Port;
use straightline_graph::fixed::{WordId, WordOp};

/// The source of products and sines.
const WORDS: &str = straightline_core::sources::FIXED;

/// What the module is, and how to convert.
const HEAD: &str = "
/// The same functions in fixed point, over integers of 32 bits, for machines without floating point.
///
/// A number x with the binary point f is the integer x·2^f. Each array has a point of its own, a constant beside its function. Inputs have to
/// lie in the ranges that stand at the function: then no integer overflows, and no result is further off than its constant says, certified. Outside
/// of them results are meaningless; nothing panics.
#[allow(clippy::all, clippy::pedantic)]
pub mod fixed {
    /// The integer for a number at a binary point, rounded to nearest: an input.
    #[inline]
    #[must_use]
    pub const fn to_fixed(x: f64, bits: i32) -> i32 {
        let scaled = x * f64::from_bits(((1023 + bits) as u64) << 52);
        (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
    }

    /// The number that an integer at a binary point stands for: a result.
    #[inline]
    #[must_use]
    pub const fn from_fixed(x: i32, bits: i32) -> f64 {
        x as f64 * f64::from_bits(((1023 - bits) as u64) << 52)
    }
";

/// The module of functions in fixed point.
pub fn fixed_module(functions: &[FixedFunction]) -> String {
    let mut text = HEAD.to_string();
    for function in functions {
        let own = constants(function) + &self::function(function);
        text.push_str(&indented(&own));
    }
    let words = format!("\n#[allow(dead_code, clippy::all, clippy::pedantic)]\nmod words {{\n{}}}\n", pasted(WORDS));
    text + &indented(&words) + "}\n"
}

/// Points of inputs and outputs, and bounds of errors.
fn constants(made: &FixedFunction) -> String {
    let FixedFunction { function, program, .. } = made;
    let name = function.name();
    let upper = name.to_uppercase();
    let mut text = String::new();
    let inputs = program.words.inputs.iter().zip(&program.input_bits);
    let outputs = program.words.outputs.iter().zip(&program.output_bits);
    for (port, bits) in inputs.chain(outputs) {
        let _ = writeln!(
            text,
            "\n/// Binary point of `{}` of [`{name}`].\npub const {upper}_{}_BITS: i32 = {bits};",
            port.name,
            port.name.to_uppercase()
        );
    }
    let mut first = 0;
    for port in &program.words.outputs {
        let own = &program.errors[first..first + port.len()];
        first += port.len();
        let worst = four_digits(own.iter().copied().fold(0.0, f64::max));
        let _ = writeln!(
            text,
            "\n/// Certified bound of the errors of `{}` of [`{name}`], in its unit: how far a result can be from the exact dynamics of the robot \
             file, the rounding of the inputs included.\npub const {upper}_{}_ERROR_BOUND: f64 = {worst:?};",
            port.name,
            port.name.to_uppercase()
        );
    }
    text
}

fn array(port: &Port) -> String {
    port.shape.iter().rev().fold("i32".to_string(), |inner, n| format!("[{inner}; {n}]"))
}

/// Whether a word reads an input of a port that begins there.
fn is_read(made: &FixedFunction, first: usize, port: &Port) -> bool {
    let own = first as u32..(first + port.len()) as u32;
    made.program.words.words.iter().any(|w| matches!(w, WordOp::Input(k) if own.contains(k)))
}

/// The function.
fn function(made: &FixedFunction) -> String {
    let FixedFunction { function, program, graph, .. } = made;
    let words = &program.words;
    let [products, sums, shifts, sines] = words.counts();
    let mut about = format!("{}\n\nInputs within:\n", function.summary());
    for line in made.ranges() {
        let _ = writeln!(about, "* {}", line.replace('[', "\\[").replace(']', "\\]"));
    }
    let _ = writeln!(about, "\n{products} products, {sums} sums, {shifts} shifts, {sines} pairs of sine and cosine.");
    let mut text = format!("\n{}", doc(&about));
    let mut parameters = Vec::new();
    let mut first = 0;
    for port in &words.inputs {
        let unread = if is_read(made, first, port) { "" } else { "_" };
        parameters.push(format!("{unread}{}: &{}", port.name, array(port)));
        first += port.len();
    }
    parameters.extend(words.outputs.iter().map(|port| format!("{}: &mut {}", port.name, array(port))));
    let _ = writeln!(text, "pub fn {}({}) {{", function.name(), parameters.join(", "));
    let ports = words.inputs.iter().chain(&words.outputs).map(|port| port.name.as_str());
    let mut names = Names::with_taken(ports.chain(["words"]));
    let mut called: Vec<String> = Vec::new();
    let inputs: Vec<String> =
        words.inputs.iter().flat_map(|port| (0..port.len()).map(|k| element(port, k)).collect::<Vec<_>>()).collect();
    for (i, word) in words.words.iter().enumerate() {
        let v = |a: WordId| called[a.index()].as_str();
        let value = match *word {
            WordOp::Input(k) => {
                called.push(inputs[k as usize].clone());
                continue;
            }
            WordOp::Constant(c) => {
                called.push(if c < 0 { format!("({c})") } else { c.to_string() });
                continue;
            }
            WordOp::SinCos(a, bits, turns) => {
                let (name, sines) = (names.temporary(), words.sines.sine_name());
                let _ = writeln!(text, "    let {name} = words::{sines}::<{bits}, {turns}>({});", v(a));
                called.push(name);
                continue;
            }
            WordOp::Sin(pair) => {
                called.push(format!("{}.0", v(pair)));
                continue;
            }
            WordOp::Cos(pair) => {
                called.push(format!("{}.1", v(pair)));
                continue;
            }
            WordOp::Add(a, b) => format!("i32::wrapping_add({}, {})", v(a), v(b)),
            WordOp::Sub(a, b) => format!("i32::wrapping_sub({}, {})", v(a), v(b)),
            WordOp::Neg(a) => format!("i32::wrapping_neg({})", v(a)),
            WordOp::Mul(product, a, b) => {
                let by = product.own_shift().map(|by| format!(", {by}")).unwrap_or_default();
                format!("words::{}({}, {}{by})", product.name(), v(a), v(b))
            }
            WordOp::Left(a, k) => format!("{} << {k}", v(a)),
            WordOp::Right(a, k) => format!("{} >> {k}", v(a)),
        };
        let note = graph.notes[program.node[i].index()].name;
        let name = match note {
            Some((quantity, index, part)) => names.named(quantity, index, part),
            None => names.temporary(),
        };
        let _ = writeln!(text, "    let {name} = {value};");
        called.push(name);
    }
    let mut results = words.results.iter();
    for port in &words.outputs {
        for (k, word) in results.by_ref().take(port.len()).enumerate() {
            let _ = writeln!(text, "    {} = {};", element(port, k), called[word.index()]);
        }
    }
    text + "}\n"
}
