//! Reads packages in C99 back: the source's functions are run over the values of the programs, what stands around them is written here a
//! second time and compared word by word, the kernel with its source. The headers declare what the source defines, and the one for C++
//! hands every argument on in its place.

pub(crate) mod around;
pub mod opencl;
mod run;
pub(crate) mod tokens;

use super::values::{TextFormat, TextValue, Values};
use super::wanted::{of_package, PackageFunction};
use super::{packages, Mismatch, ReadingStop};
use crate::emit::Generated;
use around::CAround;
use run::CRun;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
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

/// What reads packages of the same programs and prefix.
pub struct CReader<'g> {
    generated: &'g Generated,
    prefix: String,
    values: Values,
    wanted: Vec<PackageFunction<'g>>,
}

impl<'g> CReader<'g> {
    /// For packages of this robot whose names begin with the prefix.
    pub fn new(generated: &'g Generated, prefix: &str) -> CReader<'g> {
        let mut values = Values::default();
        let wanted = of_package(generated, prefix, &mut values);
        CReader { generated, prefix: prefix.to_string(), values, wanted }
    }

    /// Checks the files of a package.
    ///
    /// # Errors
    /// The first place where one of them is not what it was to be.
    pub fn check(&mut self, files: &[(String, String)]) -> Result<(), Mismatch> {
        let library = format!("{}_dynamics", self.prefix.to_lowercase());
        let text = |ending: &str| packages::file(files, &format!("{library}.{ending}"));
        let (source, header, wrapper) = (text("c")?, text("h")?, text("hpp")?);
        let mut place = (source, format!("{library}.c"));
        let read = self.read([source, header, wrapper], &mut place);
        read.map_err(|ReadingStop(stop)| {
            let ((at, what), (text, function)) = (*stop, place);
            packages::mismatch(text, at, what, function)
        })
    }

    /// `place` is the text that is read, and the function or file.
    fn read<'t>(&mut self, files: [&'t str; 3], place: &mut (&'t str, String)) -> Result<(), ReadingStop> {
        let [source, header, wrapper] = files;
        let file = place.1.clone();
        let around = CAround::new(self.generated, &self.prefix);
        let (kernel, from) = around.head(source)?;
        let text = CText::read(source, from, false)?;
        let (functions, mut at) = definitions(&text, &self.prefix, "#")?;
        text.these(&mut at, "#if defined(__clang__) #pragma clang attribute pop #endif")?;
        if at != text.len() {
            return text.stop(at, "something behind the end");
        }
        for wanted in &self.wanted {
            self.values.forget();
            compare(wanted, (&text, &functions), (&kernel, &self.prefix), &mut self.values, &mut place.1)?;
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
}

/// The functions that a text defines, up to this word, and where it stands.
fn definitions<'t>(
    text: &CText<'t>,
    prefix: &str,
    end: &str,
) -> Result<(BTreeMap<&'t str, CFunction<'t>>, usize), ReadingStop> {
    let mut found: BTreeMap<&'t str, CFunction<'t>> = BTreeMap::new();
    let part = format!("{}_PART", prefix.to_uppercase());
    let mut at = 0;
    while at < text.len() && text.token(at) != end {
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
        if !name.starts_with(&format!("{prefix}_")) {
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
    Ok((found, at))
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

/// Runs a function of the text, and compares its results; `place` becomes its name.
fn compare<'t>(
    wanted: &PackageFunction<'_>,
    (text, functions): (&CText<'t>, &BTreeMap<&'t str, CFunction<'t>>),
    kernel: (&BTreeSet<String>, &str),
    values: &mut Values,
    place: &mut String,
) -> Result<(), ReadingStop> {
    place.clone_from(&wanted.name);
    let function = functions.get(wanted.name.as_str());
    let function = function.ok_or_else(|| ReadingStop::at(text.text.len(), "a function is missing"))?;
    let run = &mut CRun::new((text, functions), kernel, values, wanted.format);
    let expected = if wanted.is_private { CStorage::Private } else { CStorage::Public };
    if function.storage != expected {
        return text.stop(function.start, "a function that others, or none, can call");
    }
    let ports = || wanted.inputs.iter().map(|p| (p, false)).chain(wanted.outputs.iter().map(|p| (p, true)));
    if function.parameters.len() != ports().count() {
        return text.stop(function.start, "another number of parameters is expected");
    }
    let (mut arguments, mut results) = (Vec::new(), Vec::new());
    let mut given = &wanted.given[..];
    for ((port, is_output), parameter) in ports().zip(&function.parameters) {
        if parameter.name != port.name || parameter.is_written != is_output {
            return text.stop(function.start, format!("the parameter `{}` is expected in its place", port.name));
        }
        let array = match is_output {
            true => run.array(&vec![TextValue::NONE; port.len()], wanted.format),
            false => {
                let (own, rest) = given.split_at(port.len());
                given = rest;
                run.array(own, wanted.format)
            }
        };
        if is_output {
            results.push((port, array));
        }
        arguments.push((array, is_output));
    }
    run.call(function, &arguments)?;
    let mut expected = wanted.results.iter();
    for (port, array) in results {
        for (k, ((found, written), expected)) in run.numbers(array).zip(&mut expected).enumerate() {
            if found == TextValue::NONE {
                return text.stop(function.start, format!("result {k} of `{}` is never put out", port.name));
            }
            if found != *expected {
                return text.stop(written, format!("result {k} of `{}` is to be another value", port.name));
            }
        }
    }
    Ok(())
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
