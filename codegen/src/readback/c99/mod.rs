//! Reads packages in C99 back: the source's functions are run over the values of the programs, what stands around them is written here a
//! second time and compared word by word, the kernel with its source. The headers declare what the source defines, and the one for C++
//! hands every argument on in its place.

mod around;
mod run;
mod tokens;

use super::values::{TextFormat, TextValue, Values};
use super::{Mismatch, ReadingStop};
use crate::emit::Generated;
use crate::program::written::WrittenFunction;
use around::CAround;
use run::CRun;
use rustc_hash::FxHashMap;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use straightline_graph::expr::Port;
use straightline_graph::Scalar;
use tokens::CText;

/// Who can call a function of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CStorage {
    /// Whoever has the header.
    Public,
    /// The source.
    Private,
    /// The function that it is a part of.
    Part,
}

/// A parameter of a function over arrays.
#[derive(Clone, Debug)]
struct CTextParameter<'t> {
    name: &'t str,
    format: TextFormat,
    length: usize,
    is_written: bool,
}

/// A function that a text defines.
#[derive(Clone, Debug)]
struct CFunction<'t> {
    /// First token.
    start: usize,
    storage: CStorage,
    /// Of functions without a result.
    parameters: Vec<CTextParameter<'t>>,
    /// The brace that opens its body.
    body: usize,
    /// Behind it.
    end: usize,
    /// Whether something knew it.
    claimed: Cell<bool>,
}

/// A function of a package, and what it is to compute.
struct CWanted<'g> {
    name: String,
    inputs: &'g [Port],
    outputs: &'g [Port],
    given: Vec<TextValue>,
    results: Vec<TextValue>,
    format: TextFormat,
    /// Of a run-time parameter: none but its constructor calls it.
    is_private: bool,
}

/// What reads packages of the same programs and prefix.
pub struct CReader<'g> {
    generated: &'g Generated,
    prefix: String,
    values: Values,
    wanted: Vec<CWanted<'g>>,
}

impl<'g> CReader<'g> {
    /// For packages of this robot whose names begin with the prefix.
    pub fn new(generated: &'g Generated, prefix: &str) -> CReader<'g> {
        let mut reader =
            CReader { generated, prefix: prefix.to_string(), values: Values::default(), wanted: Vec::new() };
        let mut names = FxHashMap::default();
        let programs = &generated.programs;
        for program in &programs.functions {
            reader.want(program, "", &mut names);
        }
        for mode in &programs.modes {
            for program in &mode.functions {
                reader.want(program, &format!("contact_{}_", mode.identifier), &mut names);
            }
        }
        for parameter in &programs.parameters {
            reader.want(&parameter.program, "", &mut names);
            reader.wanted.last_mut().expect("one was added").is_private = true;
        }
        reader.values.close();
        reader
    }

    fn want(&mut self, program: &'g WrittenFunction, module: &str, names: &mut FxHashMap<&'g str, u32>) {
        let format = TextFormat::from(program.scalar);
        let mut given = Vec::new();
        for port in &program.graph.inputs {
            let next = names.len() as u32;
            let name = *names.entry(port.name.as_str()).or_insert(next);
            given.extend((0..port.len()).map(|k| self.values.input(name, k, format)));
        }
        let results = self.values.results(&program.graph, &given, format);
        let name = format!("{}_{module}{}", self.prefix, program.name);
        let (inputs, outputs) = (&program.graph.inputs[..], &program.graph.outputs[..]);
        self.wanted.push(CWanted { name, inputs, outputs, given, results, format, is_private: false });
    }

    /// Checks the files of a package.
    ///
    /// # Errors
    /// The first place where one of them is not what it was to be.
    pub fn check(&mut self, files: &[(String, String)]) -> Result<(), Mismatch> {
        let library = format!("{}_dynamics", self.prefix.to_lowercase());
        let text = |ending: &str| {
            let name = format!("{library}.{ending}");
            let found = files.iter().find(|(file, _)| *file == name).map(|(_, text)| text.as_str());
            found.ok_or_else(|| Mismatch {
                function: name,
                line: 1,
                text: String::new(),
                what: "a file is missing".into(),
            })
        };
        let (source, header, wrapper) = (text("c")?, text("h")?, text("hpp")?);
        let mut place = (source, format!("{library}.c"));
        let read = self.read([source, header, wrapper], &mut place);
        read.map_err(|ReadingStop(stop)| {
            let ((at, what), (text, function)) = (*stop, place);
            let before = &text[..at.min(text.len())];
            let start = before.rfind('\n').map_or(0, |k| k + 1);
            let shown = text[start..].lines().next().unwrap_or_default().trim().chars().take(200).collect();
            Mismatch { function, line: before.matches('\n').count() + 1, text: shown, what }
        })
    }

    /// `place` is the text that is read, and the function or file.
    fn read<'t>(&mut self, files: [&'t str; 3], place: &mut (&'t str, String)) -> Result<(), ReadingStop> {
        let [source, header, wrapper] = files;
        let file = place.1.clone();
        let around = CAround::new(self.generated, &self.prefix);
        let (kernel, from) = around.head(source)?;
        let text = CText::read(source, from, false)?;
        let functions = self.definitions(&text)?;
        for wanted in &self.wanted {
            place.1.clone_from(&wanted.name);
            let function = functions.get(wanted.name.as_str());
            let function = function.ok_or_else(|| ReadingStop::at(source.len(), "a function is missing"))?;
            self.values.forget();
            let plain = wanted.format;
            let mut run = CRun::new((&text, &functions), (&kernel, &self.prefix), &mut self.values, plain);
            wanted.compare(&mut run, function)?;
        }
        place.1.clone_from(&file);
        around.functions(&text, &functions)?;
        if let Some(function) = functions.values().find(|function| !function.claimed.get()) {
            return text.stop(function.start, "a function that nothing asked for");
        }
        *place = (header, file.replace(".c", ".h"));
        let declared = CText::read(header, 0, false)?;
        around.header(&declared, &text, &functions)?;
        *place = (wrapper, file.replace(".c", ".hpp"));
        let wanted = self.wanted.iter().filter(|w| !w.is_private).map(|w| (&w.name[..], w.inputs, w.outputs, w.format));
        around.wrapper(&CText::read(wrapper, 0, true)?, wanted)
    }

    /// The functions that a text defines.
    fn definitions<'t>(&self, text: &CText<'t>) -> Result<BTreeMap<&'t str, CFunction<'t>>, ReadingStop> {
        let mut found: BTreeMap<&'t str, CFunction<'t>> = BTreeMap::new();
        let part = format!("{}_PART", self.prefix.to_uppercase());
        let mut at = 0;
        while at < text.len() && text.token(at) != "#" {
            let start = at;
            let storage = match text.token(at) {
                "static" => CStorage::Private,
                word if word == part => CStorage::Part,
                _ => CStorage::Public,
            };
            at += usize::from(storage != CStorage::Public);
            let is_void = text.token(at) == "void";
            let result = match text.token(at) {
                "void" | "int" => "",
                _ => "const char *",
            };
            match result {
                "" => at += 1,
                result => text.these(&mut at, result)?,
            }
            let (name_at, name) = (at, text.name(&mut at)?);
            if !name.starts_with(&format!("{}_", self.prefix)) {
                return text.stop(name_at, "a function whose name does not begin with the prefix");
            }
            let parameters = if is_void { parameters(text, at)? } else { Vec::new() };
            let body = text.behind(at)?;
            if text.token(body) != "{" {
                return text.stop(body, "the body of a function is expected here");
            }
            at = text.behind(body)?;
            let claimed = Cell::new(false);
            let function = CFunction { start, storage, parameters, body, end: at, claimed };
            if found.insert(name, function).is_some() {
                return text.stop(name_at, "a second function of that name");
            }
        }
        text.these(&mut at, "#if defined(__clang__) #pragma clang attribute pop #endif")?;
        match at == text.len() {
            true => Ok(found),
            false => text.stop(at, "something behind the end"),
        }
    }
}

/// `(const double q[7], double *none)`
fn parameters<'t>(text: &CText<'t>, open: usize) -> Result<Vec<CTextParameter<'t>>, ReadingStop> {
    let mut at = open;
    text.mark(&mut at, "(")?;
    let mut found = Vec::new();
    loop {
        let is_written = text.token(at) != "const";
        at += usize::from(!is_written);
        let format = match text.token(at) {
            "double" => TextFormat::F64,
            "float" => TextFormat::F32,
            _ => return text.stop(at, "the type of a number is expected here"),
        };
        at += 1;
        let is_pointer = text.token(at) == "*";
        at += usize::from(is_pointer);
        let name = text.name(&mut at)?;
        let mut length = 0;
        if !is_pointer {
            text.mark(&mut at, "[")?;
            length = text.integer(&mut at, "")?;
            text.mark(&mut at, "]")?;
        }
        found.push(CTextParameter { name, format, length, is_written });
        if text.token(at) == ")" {
            return Ok(found);
        }
        text.mark(&mut at, ",")?;
    }
}

impl CWanted<'_> {
    /// Runs the function of the text, and compares its results.
    fn compare<'t>(&self, run: &mut CRun<'_, 't>, function: &CFunction<'t>) -> Result<(), ReadingStop> {
        let text = run.text;
        let expected = if self.is_private { CStorage::Private } else { CStorage::Public };
        if function.storage != expected {
            return text.stop(function.start, "a function that others, or none, can call");
        }
        let ports = || self.inputs.iter().map(|p| (p, false)).chain(self.outputs.iter().map(|p| (p, true)));
        if function.parameters.len() != ports().count() {
            return text.stop(function.start, "another number of parameters is expected");
        }
        let (mut arguments, mut results) = (Vec::new(), Vec::new());
        let mut given = &self.given[..];
        for ((port, is_output), parameter) in ports().zip(&function.parameters) {
            if parameter.name != port.name || parameter.is_written != is_output {
                return text.stop(function.start, format!("the parameter `{}` is expected in its place", port.name));
            }
            let array = match is_output {
                true => run.array(&vec![TextValue::NONE; port.len()], self.format),
                false => {
                    let (own, rest) = given.split_at(port.len());
                    given = rest;
                    run.array(own, self.format)
                }
            };
            if is_output {
                results.push((port, array));
            }
            arguments.push((array, is_output));
        }
        run.call(function, &arguments)?;
        let mut wanted = self.results.iter();
        for (port, array) in results {
            for (k, ((found, written), wanted)) in run.numbers(array).zip(&mut wanted).enumerate() {
                if found == TextValue::NONE {
                    return text.stop(function.start, format!("result {k} of `{}` is never put out", port.name));
                }
                if found != *wanted {
                    return text.stop(written, format!("result {k} of `{}` is to be another value", port.name));
                }
            }
        }
        Ok(())
    }
}

/// What C calls a format.
fn c_name(format: TextFormat) -> &'static str {
    if format == TextFormat::F32 {
        "float"
    } else {
        "double"
    }
}

/// The names that a section of the kernel defines.
fn defined(section: &str, names: &mut BTreeSet<String>) {
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    for line in section.lines() {
        let head = match (line.strip_prefix("} "), line.strip_prefix("static ")) {
            (Some(rest), _) => rest.trim_end_matches(';'),
            (_, Some(rest)) => rest.split('(').next().unwrap_or_default(),
            _ => continue,
        };
        names.extend(head.rsplit(|c| !word(c)).next().map(str::to_string));
    }
}

/// What C calls numbers of a scalar type, and what stands behind its constants.
fn c_scalar(scalar: Scalar) -> (&'static str, &'static str) {
    match c_name(TextFormat::from(scalar)) {
        "float" => ("float", "F"),
        name => (name, ""),
    }
}
