//! Reads what was emitted back, and compares it with the programs that it was to be.
//!
//! The text is cut into words, its items are found, and every function is run over `values`, where two values are the same if and only
//! if the same operations on the same inputs make them. The programs are run there, too. So a text passes if and only if it has, for
//! every result, the program's operations on the program's operands and constants, bit for bit, whatever its locals are called and
//! wherever it is cut: a fused a·b + c counts as the product and the sum, and what a program does not compute no text may compute.
//! Around the functions stands text that follows from their inputs and outputs (batches, stages, modes, parameters): it is written here
//! a second time (`around.rs`), and compared word by word; what is the same in all files is known by its source or its checksum.
//!
//! Nothing of `emit` is used but its source files of the kernel. Whatever is not understood is refused, and so is what nothing asked for.

mod around;
pub mod c99;
mod fixed;
mod items;
pub mod packages;
mod ptx;
mod run;
pub(crate) mod tokens;
mod values;
mod wanted;

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::emit::Generated;
use crate::program::written::WrittenFunction;
use around::Around;
use items::{Items, Sort, TextExtent, Type};
use run::{count_of, Execution, Thing};
use rustc_hash::FxHashMap;
use std::fmt;
use straightline_graph::expr::{Graph, Port};
use tokens::{TokenKind, Words};
use values::{TextFormat, TextValue, Values};

/// Where a text is not what it was to be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// The function, if it is in one.
    pub function: String,
    /// The line, from 1.
    pub line: usize,
    /// What stands there.
    pub text: String,
    /// What is wrong.
    pub what: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Mismatch { function, line, text, what } = self;
        write!(f, "line {line}, `{function}`: {what}: `{text}`")
    }
}

/// Where reading ends, in bytes from the text's first, and why.
#[derive(Clone, Debug)]
pub(crate) struct ReadingStop(Box<(usize, String)>);

impl ReadingStop {
    fn at(at: usize, what: impl Into<String>) -> ReadingStop {
        ReadingStop(Box::new((at, what.into())))
    }
}

/// Checks a finished text against the programs that it was made of.
///
/// # Errors
/// The first place where they disagree.
pub fn check(generated: &Generated) -> Result<(), Mismatch> {
    TextReader::new(generated).check(&generated.text)
}

/// The text, or an internal error: what disagrees with its programs is no text for anybody.
///
/// # Errors
/// The first place where they disagree, with a request to report it.
pub fn checked(generated: Generated) -> Result<Generated, Diagnostics> {
    match check(&generated) {
        Ok(()) => Ok(generated),
        Err(mismatch) => {
            let mut diagnostics = Diagnostics::new();
            diagnostics.push(complaint(&mismatch));
            Err(diagnostics)
        }
    }
}

/// A mismatch as a complaint.
pub fn complaint(mismatch: &Mismatch) -> Diagnostic {
    let Mismatch { function, line, text, what } = mismatch;
    Diagnostic::error(
        "internal-error",
        format!("the text of `{function}` that was about to be written is not the program that was compiled; nothing is written"),
    )
    .detail(format!("line {line} of the text: {what}: `{text}`"))
    .help(
        "this is an error of straightline, not of your files: please report it, with the robot file, the scene and the options",
    )
}

/// A function of the text, and what it is to compute.
struct WantedFunction<'g> {
    path: Vec<u32>,
    name: String,
    word: u32,
    inputs: &'g [Port],
    outputs: &'g [Port],
    given: Vec<TextValue>,
    results: Vec<TextValue>,
    format: TextFormat,
    lanes: bool,
    public: bool,
}

/// What reads texts of the same programs.
pub struct TextReader<'g> {
    generated: &'g Generated,
    words: Words,
    /// Per scalar type: its module, its values, its functions.
    parts: Vec<TextPart<'g>>,
}

struct TextPart<'g> {
    generated: &'g Generated,
    module: Option<&'static str>,
    values: Values,
    wanted: Vec<WantedFunction<'g>>,
}

impl<'g> TextReader<'g> {
    /// For the text of this, or others in its place.
    pub fn new(generated: &'g Generated) -> TextReader<'g> {
        let mut words = Words::new();
        let mut parts = vec![TextPart::new(generated, None, &mut words)];
        for other in &generated.others {
            parts.push(TextPart::new(other, Some(other.scalar.module()), &mut words));
        }
        TextReader { generated, words, parts }
    }

    /// Checks a text.
    ///
    /// # Errors
    /// The first place where it is not what it was to be.
    pub fn check(&mut self, text: &str) -> Result<(), Mismatch> {
        let mut function = String::new();
        self.read(text, &mut function).map_err(|ReadingStop(stop)| {
            let (at, what) = *stop;
            let before = &text[..at.min(text.len())];
            let start = before.rfind('\n').map_or(0, |k| k + 1);
            let line = text[start..].lines().next().unwrap_or_default().trim();
            let shown: String = line.chars().take(200).collect();
            if function.is_empty() {
                function = self.generated.report.robot.clone();
            }
            Mismatch { function, line: before.matches('\n').count() + 1, text: shown, what }
        })
    }

    fn read(&mut self, text: &str, function: &mut String) -> Result<(), ReadingStop> {
        let items = Items::read(text, &mut self.words)?;
        for part in &mut self.parts {
            part.read(&items, &mut self.words, function)?;
        }
        fixed::read(&items, &mut self.words, &self.generated.fixed, function)?;
        function.clear();
        match items.all.iter().find(|item| !item.claimed.get()) {
            Some(item) => items.stop(item.start, "an item that nothing asked for"),
            None => Ok(()),
        }
    }
}

impl<'g> TextPart<'g> {
    fn new(generated: &'g Generated, module: Option<&'static str>, words: &mut Words) -> TextPart<'g> {
        let mut part = TextPart { generated, module, values: Values::default(), wanted: Vec::new() };
        let programs = &generated.programs;
        for program in &programs.functions {
            part.want(&[], program, true, words);
        }
        for parameter in &programs.parameters {
            part.want(&[], &parameter.program, false, words);
        }
        if let Some(staged) = &programs.staged {
            let stages = staged.stages.iter().map(|s| &s.program);
            for program in stages.chain(staged.functions.iter().map(|(_, program)| program)) {
                part.want(&["staged"], program, false, words);
            }
        }
        for mode in &programs.modes {
            for program in &mode.functions {
                part.want(&["contact", &mode.identifier], program, true, words);
            }
        }
        part.values.close();
        part
    }

    fn want(&mut self, path: &[&str], program: &'g WrittenFunction, public: bool, words: &mut Words) {
        let path: Vec<u32> = self.module.iter().chain(path).map(|m| words.number(m)).collect();
        let format = if program.generic { TextFormat::Any } else { TextFormat::from(program.scalar) };
        let wanted = self.wanted_in(program, format, words);
        let (given, results) = (wanted.given.clone(), wanted.results.clone());
        self.wanted.push(WantedFunction { path: path.clone(), public, ..wanted });
        if !program.lanes {
            return;
        }
        let of_lanes = TextFormat::from(self.generated.scalar);
        let wanted = match of_lanes == format {
            true => WantedFunction { given, results, ..self.wanted_in_name(program, format) },
            false => self.wanted_in(program, of_lanes, words),
        };
        let name = format!("{}_lanes", program.name);
        self.wanted.push(WantedFunction { path, public, word: words.number(&name), name, lanes: true, ..wanted });
    }

    fn wanted_in_name(&self, program: &'g WrittenFunction, format: TextFormat) -> WantedFunction<'g> {
        let Graph { inputs, outputs, .. } = &program.graph;
        WantedFunction {
            path: Vec::new(),
            name: program.name.clone(),
            word: 0,
            inputs,
            outputs,
            given: Vec::new(),
            results: Vec::new(),
            format,
            lanes: false,
            public: false,
        }
    }

    /// The results of a program in a format.
    fn wanted_in(&mut self, program: &'g WrittenFunction, format: TextFormat, words: &mut Words) -> WantedFunction<'g> {
        let mut given = Vec::new();
        for port in &program.graph.inputs {
            let name = words.number(&port.name);
            given.extend((0..port.len()).map(|k| self.values.input(name, k, format)));
        }
        let results = self.values.results(&program.graph, &given, format);
        let word = words.number(&program.name);
        WantedFunction { word, given, results, ..self.wanted_in_name(program, format) }
    }

    /// Reads this part of a text.
    fn read(&mut self, items: &Items, words: &mut Words, function: &mut String) -> Result<(), ReadingStop> {
        let nothing = |name: &str| ReadingStop::at(items.text.len(), format!("`{name}` is missing"));
        let root = match self.module {
            Some(module) => items.inner(0, words.number(module)).ok_or_else(|| nothing(module))?,
            None => 0,
        };
        function.clear();
        let around = Around { items, words, generated: self.generated, root };
        let known = around.read()?;
        let plain = TextFormat::from(self.generated.scalar);
        let mut signatures = FxHashMap::default();
        for wanted in &self.wanted {
            function.clone_from(&wanted.name);
            let module = wanted
                .path
                .iter()
                .skip(usize::from(self.module.is_some()))
                .try_fold(root, |m, name| items.inner(m, *name));
            let module = module.ok_or_else(|| nothing(&wanted.name))?;
            let item = items
                .named
                .get(&(module, Sort::Function, wanted.word))
                .copied()
                .ok_or_else(|| nothing(&wanted.name))?;
            // functions of bounds may be in another scalar than the file
            let own = if wanted.format == TextFormat::Any { plain } else { wanted.format };
            self.values.forget();
            let count = words.len();
            let mut run = Execution::new(items, &mut self.values, &mut signatures, count, (&known, own));
            wanted.compare(&mut run, item, items, words)?;
        }
        Ok(())
    }
}

impl WantedFunction<'_> {
    /// Runs the function of the text, and compares its results.
    fn compare(&self, run: &mut Execution, item: usize, items: &Items, words: &mut Words) -> Result<(), ReadingStop> {
        let signature = run.signature(item)?;
        let start = items.all[item].start;
        if self.public && items.kind(start) != TokenKind::Word(tokens::PUB) {
            return items.stop(start, "a function that nobody can call");
        }
        let generics: &[u32] = match (self.lanes, self.format) {
            (true, _) => &[tokens::N],
            (false, TextFormat::Any) => &[tokens::T],
            (false, _) => &[],
        };
        if signature.generics != generics {
            return items.stop(start, "other generic parameters are expected");
        }
        let ports = || self.inputs.iter().map(|p| (p, false)).chain(self.outputs.iter().map(|p| (p, true)));
        if signature.parameters.len() != ports().count() {
            return items.stop(start, format!("{} parameters are expected", ports().count()));
        }
        let (mut arguments, mut results) = (Vec::new(), Vec::new());
        let mut given = &self.given[..];
        for ((port, is_output), parameter) in ports().zip(&signature.parameters) {
            let named = words.number(&port.name) == parameter.name
                || words.number(&format!("_{}", port.name)) == parameter.name;
            if !named {
                return items.stop(start, format!("the parameter `{}` is expected in its place", port.name));
            }
            let mut extents: Vec<TextExtent> = port.shape.iter().map(|n| TextExtent::Of(*n)).collect();
            let of = match &port.wrapper {
                Some(wrapper) => Type::Named(words.number(wrapper)),
                None => {
                    extents.extend(self.lanes.then_some(TextExtent::Lanes));
                    Type::Array(extents.clone(), self.format)
                }
            };
            if parameter.of != Type::To(is_output, Box::new(of)) {
                return items.stop(start, format!("the parameter `{}` is to have another type", port.name));
            }
            let numbers = match is_output {
                true => vec![TextValue::NONE; port.len()],
                false => {
                    let (own, rest) = given.split_at(port.len());
                    given = rest;
                    own.to_vec()
                }
            };
            debug_assert!(count_of(&extents) == port.len(), "an array has room for its port");
            let place = run.array(&extents, self.format, &numbers, is_output);
            if is_output {
                results.push((port, place));
            }
            arguments.push(match &port.wrapper {
                Some(wrapper) => Thing::Wrapped(words.number(wrapper), place),
                None => Thing::Place(place),
            });
        }
        run.call(item, &arguments)?;
        let mut wanted = self.results.iter();
        for (port, place) in results {
            let (numbers, written) = run.numbers(place);
            for (k, ((found, wanted), token)) in numbers.iter().zip(&mut wanted).zip(written).enumerate() {
                if found == wanted {
                    continue;
                }
                let what = match *found {
                    TextValue::NONE => format!("result {k} of `{}` is never put out", port.name),
                    _ => format!("result {k} of `{}` is to be another value", port.name),
                };
                return items.stop(if *found == TextValue::NONE { start } else { *token as usize }, what);
            }
        }
        Ok(())
    }
}
