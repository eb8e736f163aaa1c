//! The module of functions in fixed point: every statement is one operation, which gets the number of what it computes; what stands around the
//! functions is written here a second time.

use super::items::{Items, Sort};
use super::tokens::{self as t, TokenKind, Words};
use super::ReadingStop;
use crate::program::fixed::FixedFunction;
use crate::report::errors::four_digits;
use rustc_hash::FxHashMap;
use straightline_graph::expr::Port;
use straightline_graph::fixed::{WordOp, WordProgram};

type FixedReading<X> = Result<X, ReadingStop>;

/// What converts.
const CONVERSIONS: &str = "
    #[inline] #[must_use]
    pub const fn to_fixed(x: f64, bits: i32) -> i32 {
        let scaled = x * f64::from_bits(((1023 + bits) as u64) << 52);
        (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
    }
    #[inline] #[must_use]
    pub const fn from_fixed(x: i32, bits: i32) -> f64 {
        x as f64 * f64::from_bits(((1023 - bits) as u64) << 52)
    }";

/// A value of a text or of a program: the same number, the same operations.
#[derive(Clone, PartialEq, Eq, Hash)]
enum FixedValue {
    Input(usize),
    Constant(i64),
    /// An operation by its name, on values, with a number and whether an angle turns.
    Operation(&'static str, Vec<usize>, u32, bool),
}

#[derive(Default)]
struct FixedValues {
    numbers: FxHashMap<FixedValue, usize>,
}

impl FixedValues {
    fn number(&mut self, value: FixedValue) -> usize {
        let next = self.numbers.len();
        *self.numbers.entry(value).or_insert(next)
    }

    fn operation(&mut self, name: &'static str, of: &[usize], by: u32, turns: bool) -> usize {
        self.number(FixedValue::Operation(name, of.to_vec(), by, turns))
    }

    /// The results of a program.
    fn results(&mut self, program: &WordProgram) -> Vec<usize> {
        let mut of: Vec<usize> = Vec::new();
        for word in &program.words {
            let operands: Vec<usize> = word.operands().map(|a| of[a.index()]).collect();
            let number = match *word {
                WordOp::Input(k) => self.number(FixedValue::Input(k as usize)),
                WordOp::Constant(c) => self.number(FixedValue::Constant(i64::from(c))),
                WordOp::Add(..) => self.operation("wrapping_add", &operands, 0, false),
                WordOp::Sub(..) => self.operation("wrapping_sub", &operands, 0, false),
                WordOp::Neg(_) => self.operation("wrapping_neg", &operands, 0, false),
                WordOp::Mul(product, ..) => {
                    self.operation(product.name(), &operands, product.own_shift().unwrap_or(0), false)
                }
                WordOp::Left(_, by) => self.operation("<<", &operands, by, false),
                WordOp::Right(_, by) => self.operation(">>", &operands, by, false),
                WordOp::SinCos(_, by, turns) => self.operation(program.sines.sine_name(), &operands, by, turns),
                WordOp::Sin(_) => self.operation("sin", &operands, 0, false),
                WordOp::Cos(_) => self.operation("cos", &operands, 0, false),
            };
            of.push(number);
        }
        program.results.iter().map(|r| of[r.index()]).collect()
    }
}

/// Reads the module, if there is to be one.
pub fn read(items: &Items, words: &mut Words, functions: &[FixedFunction], function: &mut String) -> FixedReading<()> {
    if functions.is_empty() {
        return Ok(());
    }
    "fixed".clone_into(function);
    let Some(item) = items.find(0, Sort::Given, t::FIXED) else {
        return Err(ReadingStop::at(items.text.len(), "`fixed` is missing"));
    };
    item.claimed.set(true);
    let mut reader = FixedReader { items, words, at: item.start };
    reader.is("pub mod fixed {")?;
    reader.is(CONVERSIONS)?;
    for made in functions {
        made.function.name().clone_into(function);
        reader.constants(made)?;
        reader.function(made)?;
    }
    "fixed".clone_into(function);
    reader.is("#[allow(dead_code, clippy::all, clippy::pedantic)] mod words {")?;
    reader.is(straightline_core::sources::FIXED)?;
    reader.is("} }")?;
    match reader.at == item.end {
        true => Ok(()),
        false => items.stop(reader.at, "nothing more is expected"),
    }
}

struct FixedReader<'a, 't> {
    items: &'a Items<'t>,
    words: &'a mut Words,
    at: usize,
}

impl FixedReader<'_, '_> {
    /// Takes these words.
    fn is(&mut self, expected: &str) -> FixedReading<()> {
        let tokens = t::tokens_of_part(expected, self.words).map_err(|(_, what)| ReadingStop::at(0, what))?;
        for token in tokens {
            let text = &expected[token.start as usize..token.end as usize];
            if self.items.kind(self.at) == TokenKind::End || self.items.text_of(self.at) != text {
                return self.items.stop(self.at, format!("`{text}` is expected"));
            }
            self.at += 1;
        }
        Ok(())
    }

    fn next_is(&self, expected: &str) -> bool {
        self.items.kind(self.at) != TokenKind::End && self.items.text_of(self.at) == expected
    }

    fn constants(&mut self, made: &FixedFunction) -> FixedReading<()> {
        let FixedFunction { function, program, .. } = made;
        let name = function.name().to_uppercase();
        let words = &program.words;
        let points = program.input_bits.iter().chain(&program.output_bits);
        for (port, bits) in words.inputs.iter().chain(&words.outputs).zip(points) {
            self.is(&format!("pub const {name}_{}_BITS: i32 = {bits};", port.name.to_uppercase()))?;
        }
        let mut first = 0;
        for port in &words.outputs {
            let own = &program.errors[first..first + port.len()];
            first += port.len();
            let worst = four_digits(own.iter().copied().fold(0.0, f64::max));
            self.is(&format!("pub const {name}_{}_ERROR_BOUND: f64 = {worst:?};", port.name.to_uppercase()))?;
        }
        Ok(())
    }

    fn function(&mut self, made: &FixedFunction) -> FixedReading<()> {
        let FixedFunction { function, program, .. } = made;
        let words = &program.words;
        let array = |port: &Port| port.shape.iter().rev().fold("i32".to_string(), |inner, n| format!("[{inner}; {n}]"));
        self.is(&format!("pub fn {}(", function.name()))?;
        let ports = words.inputs.iter().map(|p| (p, "&")).chain(words.outputs.iter().map(|p| (p, "&mut ")));
        for (k, (port, access)) in ports.enumerate() {
            if k > 0 {
                self.is(",")?;
            }
            let unread = format!("_{}", port.name);
            let name = if access == "&" && self.next_is(&unread) { unread } else { port.name.clone() };
            self.is(&format!("{name}: {access}{}", array(port)))?;
        }
        self.is(") {")?;
        let mut values = FixedValues::default();
        let wanted = values.results(words);
        let mut locals: FxHashMap<String, usize> = FxHashMap::default();
        while self.next_is("let") {
            self.at += 1;
            let name = self.items.text_of(self.at).to_string();
            self.items.word(&mut self.at)?;
            self.is("=")?;
            let value = self.expression(&words.inputs, &mut values, &locals)?;
            self.is(";")?;
            locals.insert(name, value);
        }
        let mut wanted = wanted.iter();
        for port in &words.outputs {
            for k in 0..port.len() {
                self.is(&straightline_graph::element(port, k))?;
                self.is("=")?;
                let at = self.at;
                let value = self.operand(&words.inputs, &mut values, &locals)?;
                if wanted.next() != Some(&value) {
                    return self.items.stop(at, format!("result {k} of `{}` is to be another value", port.name));
                }
                self.is(";")?;
            }
        }
        self.is("}")
    }

    fn expression(
        &mut self,
        inputs: &[Port],
        values: &mut FixedValues,
        locals: &FxHashMap<String, usize>,
    ) -> FixedReading<usize> {
        const SUMS: [(&str, usize); 3] = [("wrapping_add", 2), ("wrapping_sub", 2), ("wrapping_neg", 1)];
        const PRODUCTS: [&str; 8] = ["wide", "exact", "full", "half", "short", "uneven", "long", "long_exact"];
        const SINES: [&str; 3] = ["sin_cos_wide", "sin_cos_exact", "sin_cos_full"];
        let (path, at) = (self.items.text_of(self.at), self.at);
        if !matches!(path, "i32" | "words") {
            let operand = self.operand(inputs, values, locals)?;
            let mark = if self.next_is("<") { "<<" } else { ">>" };
            self.is(mark)?;
            let by = self.items.integer(&mut self.at)?;
            return match u32::try_from(by) {
                Ok(by) if by < 32 => Ok(values.operation(mark, &[operand], by, false)),
                _ => self.items.stop(at, "a shift beyond the word"),
            };
        }
        self.at += 1;
        self.is("::")?;
        let called = self.items.text_of(self.at);
        self.items.word(&mut self.at)?;
        let sum = SUMS.into_iter().find(|(name, _)| path == "i32" && *name == called);
        let product = PRODUCTS.into_iter().find(|name| path == "words" && *name == called);
        let sine = SINES.into_iter().find(|name| path == "words" && *name == called);
        let (mut by, mut turns) = (0, false);
        if sine.is_some() {
            self.is("::<")?;
            by = self.items.integer(&mut self.at)? as u32;
            self.is(",")?;
            turns = self.next_is("true");
            self.is(if turns { "true" } else { "false" })?;
            self.is(">")?;
        }
        let (name, count) = match (sum, product, sine) {
            (Some((name, count)), ..) => (name, count),
            (_, Some(name), _) => (name, 2),
            (.., Some(name)) => (name, 1),
            _ => return self.items.stop(at, "an operation that is not known"),
        };
        self.is("(")?;
        let mut operands = Vec::new();
        for k in 0..count {
            if k > 0 {
                self.is(",")?;
            }
            operands.push(self.operand(inputs, values, locals)?);
        }
        if matches!(name, "long" | "long_exact") {
            self.is(",")?;
            by = self.items.integer(&mut self.at)? as u32;
        }
        self.is(")")?;
        Ok(values.operation(name, &operands, by, turns))
    }

    fn operand(
        &mut self,
        inputs: &[Port],
        values: &mut FixedValues,
        locals: &FxHashMap<String, usize>,
    ) -> FixedReading<usize> {
        if let TokenKind::Number = self.items.kind(self.at) {
            let value = self.items.integer(&mut self.at)? as i64;
            return Ok(values.number(FixedValue::Constant(value)));
        }
        if self.next_is("(") {
            self.is("(-")?;
            let value = self.items.integer(&mut self.at)? as i64;
            self.is(")")?;
            return Ok(values.number(FixedValue::Constant(-value)));
        }
        let at = self.at;
        let name = self.items.text_of(at).to_string();
        self.items.word(&mut self.at)?;
        if let Some(value) = locals.get(&name) {
            if !self.next_is(".") {
                return Ok(*value);
            }
            self.at += 1;
            let half = if self.items.integer(&mut self.at)? == 0 { "sin" } else { "cos" };
            return Ok(values.operation(half, &[*value], 0, false));
        }
        let mut first = 0;
        for port in inputs {
            if port.name == name {
                let mut place = 0;
                for n in &port.shape {
                    self.is("[")?;
                    let k = self.items.integer(&mut self.at)?;
                    self.is("]")?;
                    if k >= *n {
                        return self.items.stop(at, "an index beyond the array");
                    }
                    place = place * n + k;
                }
                return Ok(values.number(FixedValue::Input(first + place)));
            }
            first += port.len();
        }
        self.items.stop(at, "a value that is not known")
    }
}
