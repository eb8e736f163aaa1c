//! Runs a function of a text in C over [`Values`]: the small part of C that bodies of ours are made of.
//!
//! C changes formats of numbers unasked, and lets names stand for others in inner blocks. Here both are refused: operands have one format,
//! and a name that is known stands for one thing.

use super::tokens::CText;
use super::{CFunction, CStorage};
use crate::readback::values::{TextFormat, TextValue, Values};
use crate::readback::ReadingStop;
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};

mod numbers;

/// So deep may functions call each other: a function, its parts.
const DEEPEST: usize = 3;
/// So many turns may a loop take.
const MOST_TURNS: usize = 1 << 12;
/// So many numbers may an array have.
const MOST_NUMBERS: usize = 1 << 20;

type CRan<X> = Result<X, ReadingStop>;

/// What a name stands for.
#[derive(Clone, Copy, Debug)]
enum CThing {
    Number(TextValue),
    /// An array, and whether numbers may be put there.
    Array(CArray, bool),
    Index(usize),
    /// What takes a sine and a cosine.
    Turn(TextFormat, Option<(TextValue, TextValue)>),
}

/// Numbers beside each other.
#[derive(Clone, Copy, Debug)]
pub struct CArray {
    first: usize,
    length: usize,
    format: TextFormat,
}

/// A run through functions of a text.
pub struct CRun<'a, 't> {
    pub text: &'a CText<'t>,
    pub functions: &'a BTreeMap<&'t str, CFunction<'t>>,
    /// What the kernel defines.
    pub kernel: &'a BTreeSet<String>,
    pub prefix: &'a str,
    pub values: &'a mut Values,
    at: usize,
    depth: usize,
    format: TextFormat,
    cells: Vec<TextValue>,
    /// Which token put each number there.
    written: Vec<usize>,
    locals: FxHashMap<&'t str, CThing>,
}

impl<'a, 't> CRun<'a, 't> {
    /// Before a call, in a text of this format.
    pub fn new(
        (text, functions): (&'a CText<'t>, &'a BTreeMap<&'t str, CFunction<'t>>),
        (kernel, prefix): (&'a BTreeSet<String>, &'a str),
        values: &'a mut Values,
        format: TextFormat,
    ) -> CRun<'a, 't> {
        let (cells, written, locals) = (Vec::new(), Vec::new(), FxHashMap::default());
        CRun { text, functions, kernel, prefix, values, at: 0, depth: 0, format, cells, written, locals }
    }

    /// An array of these numbers, of which some may not be there yet.
    pub fn array(&mut self, numbers: &[TextValue], format: TextFormat) -> CArray {
        let first = self.cells.len();
        self.cells.extend_from_slice(numbers);
        self.written.resize(self.cells.len(), 0);
        CArray { first, length: numbers.len(), format }
    }

    /// What stands in an array, and which token put it there.
    pub fn numbers(&self, array: CArray) -> impl Iterator<Item = (TextValue, usize)> + '_ {
        (array.first..array.first + array.length).map(|k| (self.cells[k], self.written[k]))
    }

    /// Calls a function with arrays.
    pub fn call(&mut self, function: &CFunction<'t>, arguments: &[(CArray, bool)]) -> CRan<()> {
        if self.depth == DEEPEST {
            return self.stop("functions call each other without end");
        }
        function.claimed.set(true);
        if function.parameters.len() != arguments.len() {
            return self.stop("a call with another number of arguments");
        }
        let mut locals = FxHashMap::default();
        for (parameter, (array, mutable)) in function.parameters.iter().zip(arguments) {
            let fits = parameter.length == array.length && parameter.format == array.format;
            if !fits || parameter.is_written && !mutable {
                return self.stop("an argument of another type");
            }
            let thing = CThing::Array(*array, parameter.is_written);
            if self.is_taken(parameter.name) || locals.insert(parameter.name, thing).is_some() {
                return self.text.stop(function.start, "a parameter of a name that stands for something else");
            }
        }
        let (at, outer) = (self.at, std::mem::replace(&mut self.locals, locals));
        self.depth += 1;
        self.at = function.body;
        self.block()?;
        self.depth -= 1;
        (self.at, self.locals) = (at, outer);
        Ok(())
    }

    fn stop<X>(&self, what: &str) -> CRan<X> {
        self.text.stop(self.at, what)
    }

    fn token(&self) -> &'t str {
        self.text.token(self.at)
    }

    fn mark(&mut self, mark: &str) -> CRan<()> {
        self.text.mark(&mut self.at, mark)
    }

    fn takes(&mut self, mark: &str) -> bool {
        let is_here = self.token() == mark;
        self.at += usize::from(is_here);
        is_here
    }

    /// Whether a function or something of the language is called so.
    fn is_taken(&self, name: &str) -> bool {
        const LANGUAGE: [&str; 10] =
            ["const", "static", "double", "float", "for", "uint32_t", "void", "return", "if", "else"];
        self.functions.contains_key(name) || self.kernel.contains(name) || LANGUAGE.contains(&name)
    }

    fn bind(&mut self, name: &'t str, thing: CThing, names: &mut Vec<&'t str>) -> CRan<()> {
        if self.is_taken(name) || self.locals.insert(name, thing).is_some() {
            return self.stop("a name that stands for something else already");
        }
        names.push(name);
        Ok(())
    }

    /// The format that a word stands for.
    fn format_of(word: &str) -> Option<TextFormat> {
        match word {
            "double" => Some(TextFormat::F64),
            "float" => Some(TextFormat::F32),
            _ => None,
        }
    }

    fn type_word(&mut self) -> CRan<TextFormat> {
        match Self::format_of(self.token()) {
            Some(format) => {
                self.at += 1;
                Ok(format)
            }
            None => self.stop("the type of a number is expected here"),
        }
    }

    /// `{ … }`
    fn block(&mut self) -> CRan<()> {
        self.mark("{")?;
        let mut names = Vec::new();
        while !self.takes("}") {
            self.statement(&mut names)?;
        }
        for name in names {
            if let Some(CThing::Array(array, _)) = self.locals.remove(name) {
                if self.numbers(array).any(|(value, _)| value == TextValue::NONE) {
                    return self.stop(&format!("a number of `{name}` is never put there"));
                }
            }
        }
        Ok(())
    }

    fn statement(&mut self, names: &mut Vec<&'t str>) -> CRan<()> {
        let word = self.token();
        match word {
            "(" => {
                self.text.these(&mut self.at, "(void)")?;
                let name = self.text.name(&mut self.at)?;
                match self.locals.get(name) {
                    Some(CThing::Array(..)) => self.mark(";"),
                    _ => self.stop("a name that stands for no array"),
                }
            }
            "static" => {
                self.at += 1;
                self.constant(true, names)
            }
            "const" => self.constant(false, names),
            "double" | "float" => {
                let format = self.type_word()?;
                let name = self.text.name(&mut self.at)?;
                self.mark("[")?;
                let n = self.text.integer(&mut self.at, "")?;
                if n > MOST_NUMBERS {
                    return self.stop("an array that is too long");
                }
                self.text.these(&mut self.at, "];")?;
                let array = self.array(&vec![TextValue::NONE; n], format);
                self.bind(name, CThing::Array(array, true), names)
            }
            "for" => self.a_loop(),
            _ => match (self.locals.get(word).copied(), self.text.token(self.at + 1)) {
                (Some(CThing::Turn(format, _)), "=") => {
                    self.at += 2;
                    let both = self.sin_cos(format)?;
                    self.locals.insert(word, CThing::Turn(format, Some(both)));
                    self.mark(";")
                }
                (Some(CThing::Array(..)), "[") => self.store(),
                (None, "(") => self.call_of_part(),
                (None, _) if word == self.kernel_name("turn", self.format) && self.kernel.contains(word) => {
                    self.at += 1;
                    let name = self.text.name(&mut self.at)?;
                    self.mark(";")?;
                    self.bind(name, CThing::Turn(self.format, None), names)
                }
                _ => self.stop("a statement that is not known"),
            },
        }
    }

    /// `const double x = …;`, `const double x[4] = {…};`
    fn constant(&mut self, is_static: bool, names: &mut Vec<&'t str>) -> CRan<()> {
        self.mark("const")?;
        let format = self.type_word()?;
        let name = self.text.name(&mut self.at)?;
        let start = self.at;
        if !self.takes("[") {
            self.mark("=")?;
            let value = self.number(format)?;
            self.mark(";")?;
            return match is_static {
                true => self.text.stop(start, "an array is expected here"),
                false => self.bind(name, CThing::Number(value), names),
            };
        }
        let n = self.text.integer(&mut self.at, "")?;
        self.text.these(&mut self.at, "] = {")?;
        let first = self.at;
        let mut values = vec![self.number(format)?];
        while self.takes(",") {
            values.push(self.number(format)?);
        }
        let is_name = |k: usize| self.text.token(k).starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        if is_static && (first..self.at).any(is_name) {
            return self.text.stop(first, "what is static knows no locals");
        }
        self.text.these(&mut self.at, "};")?;
        if values.len() != n {
            return self.text.stop(start, "an array of another length");
        }
        let array = self.array(&values, format);
        self.bind(name, CThing::Array(array, false), names)
    }

    /// `for (uint32_t limb = 0U; limb < 4U; limb++) { … }`
    fn a_loop(&mut self) -> CRan<()> {
        self.text.these(&mut self.at, "for (uint32_t")?;
        let index = self.text.name(&mut self.at)?;
        self.text.these(&mut self.at, &format!("= 0U; {index} <"))?;
        let turns = self.text.integer(&mut self.at, "U")?;
        self.text.these(&mut self.at, &format!("; {index}++)"))?;
        if !(1..=MOST_TURNS).contains(&turns) {
            return self.stop("a loop of that length");
        }
        let body = self.at;
        for turn in 0..turns {
            self.at = body;
            let mut names = Vec::new();
            self.bind(index, CThing::Index(turn), &mut names)?;
            self.block()?;
            self.locals.remove(index);
        }
        Ok(())
    }

    fn store(&mut self) -> CRan<()> {
        let start = self.at;
        let (cell, format, mutable) = self.cell()?;
        if !mutable {
            return self.text.stop(start, "a value is put where none may be");
        }
        self.mark("=")?;
        let value = self.number(format)?;
        self.cells[cell] = value;
        self.written[cell] = start;
        self.mark(";")
    }

    /// `x[3]`, `x[limb]`, `x[7U + (3U * limb)]`: the number's place, its format, and whether it may be put there.
    fn cell(&mut self) -> CRan<(usize, TextFormat, bool)> {
        let start = self.at;
        let name = self.text.name(&mut self.at)?;
        let Some(CThing::Array(array, mutable)) = self.locals.get(name).copied() else {
            return self.text.stop(start, "a name that stands for no array");
        };
        self.mark("[")?;
        let k = self.index()?;
        self.mark("]")?;
        match k < array.length {
            true => Ok((array.first + k, array.format, mutable)),
            false => self.text.stop(start, "a number behind the end of its array"),
        }
    }

    /// `3`, `limb`, `7U + limb`, `7U + (3U * limb)`
    fn index(&mut self) -> CRan<usize> {
        if let Some(turn) = self.turn() {
            return Ok(turn);
        }
        if !self.token().ends_with('U') {
            return self.text.integer(&mut self.at, "");
        }
        let first = self.text.integer(&mut self.at, "U")?;
        self.mark("+")?;
        let step = match self.takes("(") {
            true => Some(self.text.integer(&mut self.at, "U")?),
            false => None,
        };
        if step.is_some() {
            self.mark("*")?;
        }
        let Some(turn) = self.turn() else { return self.stop("the index of a loop is expected here") };
        if step.is_some() {
            self.mark(")")?;
        }
        Ok(first.saturating_add(step.unwrap_or(1).saturating_mul(turn)))
    }

    /// Takes the index of a loop, if it stands here: which turn it is.
    fn turn(&mut self) -> Option<usize> {
        let Some(CThing::Index(turn)) = self.locals.get(self.token()).copied() else { return None };
        self.at += 1;
        Some(turn)
    }

    /// `arm_mass_matrix_part2(q, live, h);`
    fn call_of_part(&mut self) -> CRan<()> {
        let (start, name) = (self.at, self.token());
        let function = match self.functions.get(name) {
            Some(function) if function.storage != CStorage::Public => function,
            _ => return self.stop("a call of something that is not known"),
        };
        self.at += 2;
        let mut arguments: Vec<(CArray, bool)> = Vec::new();
        loop {
            let name = self.text.name(&mut self.at)?;
            let Some(CThing::Array(array, mutable)) = self.locals.get(name).copied() else {
                return self.text.stop(self.at - 1, "a name that stands for no array");
            };
            if arguments.iter().any(|(other, _)| other.first == array.first && array.length > 0) {
                return self.text.stop(self.at - 1, "an array is given twice");
            }
            arguments.push((array, mutable));
            if self.takes(")") {
                break;
            }
            self.mark(",")?;
        }
        self.mark(";")?;
        let behind = self.at;
        self.at = start;
        self.call(function, &arguments)?;
        self.at = behind;
        Ok(())
    }
}
