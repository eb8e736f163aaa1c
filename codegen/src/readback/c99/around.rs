//! What stands around the functions of a package: the head of its source, names and sizes, constructors, the headers.

use super::tokens::CText;
use super::{c_name, c_scalar, defined, CFunction, CStorage};
use crate::diagnostic::fnv_1a;
use crate::emit::c99::KERNEL;
use crate::emit::Generated;
use crate::program::written::{DriveNumbers, WrittenParameter};
use crate::readback::values::TextFormat;
use crate::readback::ReadingStop;
use std::collections::{BTreeMap, BTreeSet};
use straightline_graph::expr::Port;

/// Checksum of the lines that tell compilers what to do: what changes there has to be looked at, and written here again.
const GUARDS: u64 = 0xb76a_6c01_4b01_8985;
/// How many they are.
const GUARD_LINES: usize = 29;

type CReading<X> = Result<X, ReadingStop>;
type Definitions<'t> = BTreeMap<&'t str, CFunction<'t>>;

/// What is to stand around the functions.
pub(super) struct CAround<'g> {
    generated: &'g Generated,
    prefix: String,
    upper: String,
    library: String,
}

/// Lines with code, each with its place; code behind a comment is no line of ours, and stays as it is.
pub(super) fn code_lines(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let (mut at, mut inside) = (0, false);
    for line in text.split_inclusive('\n') {
        let (start, mut code) = (at, line.trim());
        at += line.len();
        if inside {
            let Some((_, behind)) = code.split_once("*/") else { continue };
            inside = false;
            code = behind;
        } else if let Some((before, comment)) = code.split_once("/*") {
            match comment.split_once("*/") {
                Some((_, "")) => code = before.trim_end(),
                Some(_) => {}
                None => {
                    inside = true;
                    code = before.trim_end();
                }
            }
        }
        if !code.is_empty() {
            found.push((start, code));
        }
    }
    found
}

/// What the kernel defines whose lines these are.
pub(super) fn kernel_names(lines: &[(usize, &str)], prefix: &str) -> CReading<BTreeSet<String>> {
    let (mut names, mut at) = (BTreeSet::new(), 0);
    let kernel = KERNEL.replace("robot_", &format!("{prefix}_"));
    for section in kernel.split("/*== ").skip(1) {
        let section = section.split_once('\n').map_or("", |(_, body)| body);
        let own = code_lines(section);
        let same = lines[at..].iter().zip(&own).all(|((_, a), (_, b))| a == b);
        if same && lines.len() - at >= own.len() {
            at += own.len();
            defined(section, &mut names);
        }
    }
    match lines.get(at) {
        Some((place, _)) => Err(ReadingStop::at(*place, "a line of the kernel is not that of its source")),
        None => Ok(names),
    }
}

/// A function ends there.
fn ends(text: &CText<'_>, function: &CFunction<'_>, at: usize) -> CReading<()> {
    match at == function.end {
        true => Ok(()),
        false => text.stop(at, "the end of the function is expected here"),
    }
}

impl<'g> CAround<'g> {
    pub fn new(generated: &'g Generated, prefix: &str) -> CAround<'g> {
        let library = format!("{}_dynamics", prefix.to_lowercase());
        CAround { generated, prefix: prefix.to_string(), upper: prefix.to_uppercase(), library }
    }

    /// All before the functions: what the kernel defines, and where it ends.
    pub fn head(&self, source: &str) -> CReading<(BTreeSet<String>, usize)> {
        let end = source.find(&format!("\nint {}_nq(void)\n", self.prefix));
        let Some(end) = end else { return Err(ReadingStop::at(0, "there are no functions")) };
        let lines = code_lines(&source[..end]);
        let mut at = 0;
        let these = |at: &mut usize, expected: &[&str]| {
            for line in expected {
                let (place, found) = lines.get(*at).copied().unwrap_or((end, ""));
                if found != *line {
                    return Err(ReadingStop::at(place, format!("`{line}` is expected here")));
                }
                *at += 1;
            }
            Ok(())
        };
        these(&mut at, &[&format!("#include \"{}.h\"", self.library)])?;
        these(
            &mut at,
            &["float", "stdbool", "stddef", "stdint"].map(|h| format!("#include <{h}.h>")).each_ref().map(|l| &l[..]),
        )?;
        let guards = lines.iter().skip(at).take(GUARD_LINES).map(|(_, line)| *line);
        let sum = fnv_1a(guards.flat_map(|line| line.bytes().chain([b'\n'])));
        if sum != GUARDS {
            let place = lines.get(at).map_or(end, |(place, _)| *place);
            return Err(ReadingStop::at(
                place,
                format!("what compilers are told is not the same (checksum {sum:#018x})"),
            ));
        }
        at += GUARD_LINES;
        const OF_DOUBLE: [&str; 3] = [
            "#if (DBL_MANT_DIG != 53) || (DBL_MAX_EXP != 1024)",
            "#error \"double must be that of IEEE 754\"",
            "#endif",
        ];
        if source[end..].contains("double") {
            these(&mut at, &OF_DOUBLE)?;
        }
        // GCC may be told to leave operations where they stand, which changes none
        const KEPT_ORDER: [&str; 3] =
            ["#if defined(__GNUC__) && !defined(__clang__)", "#pragma GCC optimize(\"no-schedule-insns\")", "#endif"];
        if lines.get(at).is_some_and(|(_, line)| *line == KEPT_ORDER[0]) {
            these(&mut at, &KEPT_ORDER)?;
        }
        let part = format!("{}_PART", self.upper);
        if source[end..].contains(&part) {
            let attribute = format!("#define {part} static __attribute__((noinline))");
            these(
                &mut at,
                &["#if defined(__GNUC__)", &attribute, "#else", &format!("#define {part} static"), "#endif"],
            )?;
        }
        Ok((kernel_names(&lines[at..], &self.prefix)?, end))
    }

    /// The functions that are no programs.
    pub fn functions(&self, text: &CText<'_>, functions: &Definitions<'_>) -> CReading<()> {
        let g = self.generated;
        let p = &self.prefix;
        let sizes = [
            ("nq", g.model.nq()),
            ("nv", g.model.nv()),
            ("joint_count", g.model.joints().len()),
            ("frame_count", g.frames.len()),
        ];
        for (name, n) in sizes {
            self.is(text, functions, name, &format!("int {p}_{name}(void) {{ return {n}; }}"))?;
        }
        let (_, suffix) = c_scalar(g.scalar);
        let check = format!("int {p}_arithmetic_check(void) {{ return {p}_arithmetic_check_{}(); }}", g.scalar.name());
        self.is(text, functions, "arithmetic_check", &check)?;
        let joints: Vec<&str> = g.model.joints().iter().map(|joint| joint.name.as_str()).collect();
        self.names(text, functions, "joint", &joints)?;
        self.names(text, functions, "frame", &g.frames.iter().map(String::as_str).collect::<Vec<_>>())?;
        for parameter in &g.programs.parameters {
            self.constructor(text, functions, parameter, suffix)?;
        }
        Ok(())
    }

    fn function<'f, 't>(&self, functions: &'f Definitions<'t>, name: &str) -> CReading<&'f CFunction<'t>> {
        let name = format!("{}_{name}", self.prefix);
        let function = functions.get(name.as_str());
        let function = function.ok_or_else(|| ReadingStop::at(0, format!("`{name}` is missing")))?;
        function.claimed.set(true);
        Ok(function)
    }

    /// A function is these words.
    fn is(&self, text: &CText<'_>, functions: &Definitions<'_>, name: &str, expected: &str) -> CReading<()> {
        let function = self.function(functions, name)?;
        let mut at = function.start;
        text.these(&mut at, expected)?;
        ends(text, function, at)
    }

    /// What gives the name of a joint or a frame.
    fn names(&self, text: &CText<'_>, functions: &Definitions<'_>, what: &str, names: &[&str]) -> CReading<()> {
        let function = self.function(functions, &format!("{what}_name"))?;
        let mut at = function.start;
        text.these(&mut at, &format!("const char *{}_{what}_name(int i) {{", self.prefix))?;
        if names.is_empty() {
            text.these(&mut at, "(void)i; return NULL; }")?;
            return ends(text, function, at);
        }
        let n = names.len();
        text.these(&mut at, &format!("static const char *const names[{n}] = {{"))?;
        for name in names {
            let start = at;
            let mut bytes = Vec::new();
            while text.token(at).starts_with('"') {
                bytes.extend(
                    string(text.token(at))
                        .ok_or_else(|| ReadingStop::at(text.place(at), "another string is expected"))?,
                );
                at += 1;
            }
            if at == start || bytes != name.replace('\0', "").as_bytes() {
                return text.stop(start, format!("the name of a {what} is another"));
            }
            text.mark(&mut at, ",")?;
        }
        let rest =
            format!("}}; const char *name = NULL; if ((i >= 0) && (i < {n})) {{ name = names[i]; }} return name; }}");
        text.these(&mut at, &rest)?;
        ends(text, function, at)
    }

    /// What makes a run-time parameter.
    fn constructor(
        &self,
        text: &CText<'_>,
        functions: &Definitions<'_>,
        parameter: &WrittenParameter,
        suffix: &str,
    ) -> CReading<()> {
        let (t, _) = c_scalar(self.generated.scalar);
        let (p, of, program) = (&self.prefix, self.generated.scalar.name(), &parameter.program.name);
        let input = program.strip_suffix("_parameters").unwrap_or(program);
        let name = format!("{input}_new");
        let n: usize = parameter.program.graph.outputs.iter().map(Port::len).sum();
        if let Some(numbers) = &parameter.numbers {
            let expected = self.drive(input, program, numbers, (n, suffix));
            return self.is(text, functions, &name, &expected);
        }
        let function = self.function(functions, &name)?;
        let mut at = function.start;
        let head =
            format!("int {p}_{name}({t} mass, const {t} com[3], const {t} inertia[6], {t} {input}[{n}]) {{ const int");
        text.these(&mut at, &head)?;
        let why = text.name(&mut at)?;
        text.these(&mut at, &format!("= {p}_check_inertia_{of}(mass, com, inertia); if ({why} == 0) {{ const {t}"))?;
        let masses = text.name(&mut at)?;
        if why == masses || [why, masses].iter().any(|name| [input, "mass", "com", "inertia"].contains(name)) {
            return text.stop(at, "a name that stands for something else already");
        }
        let rest = format!("[1] = {{mass}}; {p}_{program}({masses}, com, inertia, {input}); }} return {why}; }}");
        text.these(&mut at, &rest)?;
        ends(text, function, at)
    }

    /// The text of a drive's constructor.
    fn drive(&self, input: &str, program: &str, numbers: &DriveNumbers, (n, suffix): (usize, &str)) -> String {
        let (t, _) = c_scalar(self.generated.scalar);
        let p = &self.prefix;
        let finite = |x: &str| format!("{p}_is_finite_{}({x})", self.generated.scalar.name());
        let names: Vec<&str> = numbers.numbers.iter().map(|number| number.name.as_str()).collect();
        let arguments: String = names.iter().map(|name| format!("{t} {name}, ")).collect();
        let mut out = format!(
            "int {p}_{input}_new({arguments}{t} made[{n}]) {{ const {t} numbers[{}] = {{{}}}; {t} parameters[{n}]; int why = 0; ",
            names.len(),
            names.join(", ")
        );
        for (k, number) in numbers.numbers.iter().enumerate() {
            let x = &number.name;
            let mut condition = finite(x);
            for (how, with) in number.quantity.at_run_time.comparisons() {
                let with = format!("{with:?}{suffix}");
                condition += &match *how {
                    "!=" => format!(" && (({x} < {with}) || ({x} > {with}))"),
                    how => format!(" && ({x} {how} {with})"),
                };
            }
            out += &format!("if (!({condition})) {{ why = {}; }} else ", k + 1);
        }
        let all: Vec<String> = (0..n).map(|k| finite(&format!("parameters[{k}]"))).collect();
        let copies: String = (0..n).map(|k| format!("made[{k}] = parameters[{k}]; ")).collect();
        out + &format!(
            "{{ {p}_{program}(numbers, parameters); if ({}) {{ {copies} }} else {{ why = {}; }} }} return why; }}",
            all.join(" && "),
            names.len() + 1
        )
    }

    /// The header declares what the source defines, and nothing else.
    pub fn header(&self, header: &CText<'_>, source: &CText<'_>, functions: &Definitions<'_>) -> CReading<()> {
        let (u, g) = (&self.upper, self.generated);
        let mut at = 0;
        let of_robot: Vec<_> = g.items.iter().map(|item| item.function).collect();
        let counts: String = crate::function::base_parameter_lists(&g.model, &of_robot)
            .iter()
            .map(|list| format!("#define {u}_{}_PARAMETER_COUNT {} ", list.prefix, list.names.len()))
            .collect();
        let head = format!(
            "#ifndef {u}_DYNAMICS_H #define {u}_DYNAMICS_H #define {u}_NQ {} #define {u}_NV {} #define {u}_JOINT_COUNT {} \
             #define {u}_FRAME_COUNT {} {counts} #ifdef __cplusplus extern \"C\" {{ #endif",
            g.model.nq(),
            g.model.nv(),
            g.model.joints().len(),
            g.frames.len()
        );
        header.these(&mut at, &head)?;
        let mut declared: BTreeSet<&str> = BTreeSet::new();
        while at < header.len() && !["#", "static"].contains(&header.token(at)) {
            let start = at;
            while at < header.len() && header.token(at) != "(" {
                at += 1;
            }
            let name = header.token(at - 1);
            let function = functions.get(name).filter(|function| function.storage == CStorage::Public);
            let Some(function) = function else { return header.stop(start, "a function that the source has not") };
            let same =
                (function.start..function.body).all(|k| header.token(start + k - function.start) == source.token(k));
            at = start + (function.body - function.start);
            if !same || !declared.insert(name) {
                return header.stop(start, "a function is declared otherwise than it is defined, or again");
            }
            header.mark(&mut at, ";")?;
        }
        let is_missing =
            |(name, function): &(&&str, &CFunction)| function.storage == CStorage::Public && !declared.contains(**name);
        if let Some((name, _)) = functions.iter().find(is_missing) {
            return header.stop(at, format!("`{name}` is not declared"));
        }
        self.entries(header, &mut at)?;
        header.these(&mut at, "#ifdef __cplusplus } #endif #endif")?;
        match at == header.len() {
            true => Ok(()),
            false => header.stop(at, "something behind the end"),
        }
    }

    /// Which entries of matrix results can be non-zero.
    fn entries(&self, header: &CText<'_>, at: &mut usize) -> CReading<()> {
        for (function, figures) in &self.generated.report.functions {
            for of in &figures.entries {
                let name = format!("{}_{}_{}", self.upper, function.to_uppercase(), of.output.to_uppercase());
                for (what, numbers) in [("ROW_STARTS", &of.row_starts), ("COLUMNS", &of.columns)] {
                    // no array of C is empty
                    let numbers = if numbers.is_empty() { &[0][..] } else { numbers };
                    let list = format!("{numbers:?}").replace(['[', ']'], "");
                    header.these(at, &format!("static const int {name}_{what}[{}] = {{{list}}};", numbers.len()))?;
                }
            }
        }
        Ok(())
    }

    /// The header for C++ hands every argument on in its place.
    pub fn wrapper<'w>(
        &self,
        text: &CText<'_>,
        wanted: impl Iterator<Item = (&'w str, &'w [Port], &'w [Port], TextFormat)>,
    ) -> CReading<()> {
        let (u, p, l, g) = (&self.upper, &self.prefix, &self.library, self.generated);
        let (t, _) = c_scalar(g.scalar);
        let mut at = 0;
        let head = format!(
            "#ifndef {u}_DYNAMICS_HPP #define {u}_DYNAMICS_HPP #include \"{l}.h\" #include <array> #include <cstddef> namespace {l} {{ \
             using Scalar = {t}; constexpr std::size_t nq = {}; constexpr std::size_t nv = {}; constexpr std::size_t joint_count = {}; \
             constexpr std::size_t frame_count = {}; inline int arithmetic_check() noexcept {{ return {p}_arithmetic_check(); }}",
            g.model.nq(),
            g.model.nv(),
            g.model.joints().len(),
            g.frames.len()
        );
        text.these(&mut at, &head)?;
        let mut pieces: Vec<String> =
            g.programs.parameters.iter().map(|parameter| self.made_in_cpp(parameter)).collect();
        pieces.extend(wanted.map(|wanted| self.overloads(wanted)));
        while text.token(at) != "}" {
            let found = pieces.iter().position(|piece| text.these(&mut { at }, piece).is_ok());
            let Some(found) = found else { return text.stop(at, "something that nothing asked for, or otherwise") };
            text.these(&mut at, &pieces.swap_remove(found))?;
        }
        if let Some(piece) = pieces.first() {
            return text.stop(at, format!("`{piece}` is missing"));
        }
        text.these(&mut at, "} #endif")?;
        match at == text.len() {
            true => Ok(()),
            false => text.stop(at, "something behind the end"),
        }
    }

    fn made_in_cpp(&self, parameter: &WrittenParameter) -> String {
        let (p, program) = (&self.prefix, &parameter.program.name);
        let x = program.strip_suffix("_parameters").unwrap_or(program);
        let n: usize = parameter.program.graph.outputs.iter().map(Port::len).sum();
        let (head, arguments) = match &parameter.numbers {
            Some(numbers) => {
                let names: Vec<&str> = numbers.numbers.iter().map(|number| number.name.as_str()).collect();
                let head: String = names.iter().map(|name| format!("Scalar {name}, ")).collect();
                (format!("{head}{x}_type& made"), format!("{}, made.data()", names.join(", ")))
            }
            None => (
                format!("Scalar mass, const std::array<Scalar, 3>& com, const std::array<Scalar, 6>& inertia, {x}_type& {x}"),
                format!("mass, com.data(), inertia.data(), {x}.data()"),
            ),
        };
        format!("using {x}_type = std::array<Scalar, {n}>; inline int {x}_new({head}) noexcept {{ return {p}_{x}_new({arguments}); }}")
    }

    fn overloads(&self, (name, inputs, outputs, format): (&str, &[Port], &[Port], TextFormat)) -> String {
        let t = c_name(format);
        let own = name.strip_prefix(&format!("{}_", self.prefix)).unwrap_or(name);
        let ports = || inputs.iter().map(|p| (p, "const ")).chain(outputs.iter().map(|p| (p, "")));
        let list = |of: &dyn Fn(&Port, &str) -> String| ports().map(|(p, c)| of(p, c)).collect::<Vec<_>>().join(", ");
        let arrays = list(&|p, c| format!("{c}std::array<{t}, {}>& {}", p.len(), p.name));
        let data = list(&|p, _| format!("{}.data()", p.name));
        let mut out = format!("inline void {own}({arrays}) noexcept {{ {name}({data}); }}");
        if ports().all(|(p, _)| !p.is_empty()) {
            let plain = list(&|p, c| format!("{c}{t} (&{})[{}]", p.name, p.len()));
            let names = list(&|p, _| p.name.clone());
            out += &format!(" inline void {own}({plain}) noexcept {{ {name}({names}); }}");
        }
        out
    }
}

/// The bytes of a literal.
fn string(literal: &str) -> Option<Vec<u8>> {
    let mut bytes = literal.strip_prefix('"')?.strip_suffix('"')?.bytes();
    let mut out = Vec::new();
    while let Some(byte) = bytes.next() {
        if byte != b'\\' {
            // three of them would be another character
            (byte != b'?' && byte.is_ascii()).then(|| out.push(byte))?;
            continue;
        }
        match bytes.next()? {
            escaped @ (b'"' | b'\\' | b'?') => out.push(escaped),
            first => {
                let digits = [first, bytes.next()?, bytes.next()?];
                let text = std::str::from_utf8(&digits).ok()?;
                out.push(u8::from_str_radix(text, 8).ok()?);
            }
        }
    }
    Some(out)
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn literals_are_read_as_c_reads_them() {
        assert_eq!(string(r#""a\"\\\?\303\237""#).as_deref(), Some(&b"a\"\\?\xc3\x9f"[..]));
        for literal in [r#""\x41""#, r#""??/""#, r#""\9""#, "a"] {
            assert_eq!(string(literal), None, "{literal}");
        }
    }

    pub fn lines_are_those_with_code() {
        let text = "/* a\n * b */\nx = 1; /* c */\n\n/* d */\n  y\n/* e */ f(); /* g */\n/*\n*/ h\n";
        let lines: Vec<&str> = code_lines(text).into_iter().map(|(_, line)| line).collect();
        assert_eq!(lines, ["x = 1;", "y", "/* e */ f(); /* g */", " h"]);
    }
}
