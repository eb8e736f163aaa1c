//! Functions of straight-line code in Rust.

use super::{array_type, doc, element_type, generics, kernel_path, literal, number_type, wrapped, zero, ALLOW};
use crate::emit::module::{Access, Expression, Index, Routine, RoutineParameter, Statement, Stride};
use crate::emit::target::{Binding, Scope, Target};
use crate::emit::Style;
use crate::identifier::comment;
use std::fmt::Write;
use straightline_graph::element;
use straightline_graph::expr::{Port, Sines};
use straightline_graph::Scalar;

/// How many locals one declaration may hold.
const DECLARATION: usize = 64;

/// The module of short sines.
pub(super) const SHORT_SINES: &str = "short_sines";

/// Rust that depends on `core` alone, for readers: code that a person would defend in review.
pub struct Rust;

impl Target for Rust {
    fn reserved(&self) -> &'static [&'static str] {
        &["live", "trig", SHORT_SINES, "lane", "fma", "fma_if", "fused", "number"]
    }

    fn atom(&self, expression: &Expression, scope: Scope<'_>) -> (String, Binding) {
        let style = scope.style;
        let text = match expression {
            Expression::Zero => zero(style).to_string(),
            Expression::Constant(c, scalar) => {
                let of = if *scalar == style.scalar { style } else { Style::plain(*scalar) };
                let binding = if c.is_negative() && !style.generic { Binding::Sign } else { Binding::Atom };
                return (literal(*c, of), binding);
            }
            Expression::Local(name) => name.clone(),
            Expression::Input { port, at } => place(&scope.ports.inputs[*port], *at, style),
            Expression::InputOfLimb { port, at } => strided(&scope.ports.inputs[*port], at),
            Expression::Slot(k) => format!("live[{k}]{}", lane(style)),
            Expression::Element(array, Index::Number(k)) => format!("{array}[{k}]"),
            Expression::Element(array, Index::Loop(index)) => format!("{array}[{index}]"),
            Expression::Element(array, Index::Strided(at)) => format!("{array}[{}]", turned(at)),
            Expression::Element(array, Index::Row { index, entry, .. }) => format!("{array}[{index}][{entry}]"),
            Expression::Fused { factors: [a, b], is_negated, term, is_subtracted } => {
                let signed = |e: &Expression, minus: bool| match minus {
                    true => format!("-{}", self.operand(e, Binding::Atom, scope)),
                    false => self.expression(e, scope),
                };
                let function = if style.lanes { "fma_if::<FUSED>" } else { "fma" };
                let (a, b, c) = (signed(a, *is_negated), self.expression(b, scope), signed(term, *is_subtracted));
                format!("{function}({a}, {b}, {c})")
            }
            Expression::Widened(scalar, inner) => {
                let typed = match inner.as_ref() {
                    Expression::Constant(_, own) => format!("_{}", own.name()),
                    _ => String::new(),
                };
                format!("{}::from({}{typed})", scalar.name(), self.expression(inner, scope))
            }
            Expression::Rounded(scalar, inner) => {
                format!("(({}) as {})", self.expression(inner, scope), scalar.name())
            }
            Expression::Unary(..) | Expression::Binary(..) => return self.bound(expression, scope),
        };
        (text, Binding::Atom)
    }

    fn call(&self, function: &str, operands: &[String], scope: Scope<'_>) -> String {
        format!("{}({})", kernel_path(function, scope.style), operands.join(", "))
    }

    fn statement(&self, statement: &Statement, routine: &Routine, level: usize) -> String {
        let (scope, style, indent) = (routine.scope(), routine.style, "    ".repeat(level));
        let expression = |e: &Expression| self.expression(e, scope);
        let line = |text: String| format!("{indent}{text}\n");
        match statement {
            Statement::Comment(text) => line(format!("// {}", comment(text))),
            Statement::Declare(locals) => indented(declare(locals, style), level),
            Statement::Set(name, value) => line(format!("{name} = {};", expression(value))),
            Statement::Store { port, at, value } => {
                line(format!("{} = {};", place(&scope.ports.outputs[*port], *at, style), expression(value)))
            }
            Statement::Live { slots, filler } => line(format!("let mut live = [{}; {slots}];", expression(filler))),
            Statement::Part(k) => line(call_of_part(routine, *k)),
            Statement::Load(values) => indented(load(values, style), level),
            Statement::Keep { slot, value } => {
                line(format!("{} = {};", expression(&Expression::Slot(*slot)), expression(value)))
            }
            Statement::SinCos { kernel, sines, cosines, angles } => {
                indented(self.sin_cos(*kernel, [sines, cosines], angles, scope), level)
            }
            Statement::Array { name, values, is_constant } => {
                let (word, number) = (if *is_constant { "static" } else { "let" }, number_type(style));
                let values: Vec<String> = values.iter().map(expression).collect();
                let start = format!("    {word} {name}: [{number}; {}] = [", values.len());
                indented(wrapped(&start, &values, "];"), level)
            }
            Statement::Room { name, filler, count } => {
                line(format!("let mut {name} = [{}; {count}];", expression(filler)))
            }
            Statement::Put { array, index, value } => line(format!("{array}[{index}] = {};", expression(value))),
            Statement::Table { name, rows, is_constant } => {
                let (word, number) = (if *is_constant { "static" } else { "let" }, number_type(style));
                let numbers = |row: &Vec<Expression>| row.iter().map(expression).collect::<Vec<_>>().join(", ");
                let of_type = format!("[[{number}; {}]; {}]", rows.first().map_or(0, Vec::len), rows.len());
                let lines: String = rows.iter().map(|row| format!("{indent}    [{}],\n", numbers(row))).collect();
                format!("{indent}{word} {name}: {of_type} = [\n{lines}{indent}];\n")
            }
            Statement::StoreOfLimb { port, at, value } => {
                line(format!("{} = {};", strided(&scope.ports.outputs[*port], at), expression(value)))
            }
            Statement::Lanes(body) => self.a_loop("lane", "0..N", body, routine, level),
            Statement::Limbs { index, count, is_hidden: false, body } => {
                self.a_loop(index, &format!("0..{count}"), body, routine, level)
            }
            Statement::Limbs { index, count, is_hidden: true, body } => {
                let turns = format!("(0..{count}).take(core::hint::black_box({count}))");
                line("// a compiler that knew the number of turns would write them out".to_string())
                    + &self.a_loop(index, &turns, body, routine, level)
            }
        }
    }

    fn routine(&self, routine: &Routine) -> String {
        let mut out = doc(&routine.doc);
        out.push_str(&head(routine));
        out.push_str(&self.statements(&routine.body, routine, 1));
        out.push_str("}\n");
        for part in &routine.parts {
            out.push('\n');
            out.push_str(&match in_a_module(part) {
                true => module_of_part(&part.name, &self.routine(part)),
                false => self.routine(part),
            });
        }
        out
    }
}

/// Whether a part stands in a module of its own: rustc compiles modules at once, and functions of one module one after the other. What is
/// over lanes becomes part of its callers.
fn in_a_module(part: &Routine) -> bool {
    !part.style.lanes
}

/// A part in a module of its name, which takes what the one around it has.
fn module_of_part(name: &str, text: &str) -> String {
    let uses = "    #[allow(unused_imports, clippy::wildcard_imports)]\n    use super::*;\n";
    format!("mod {name} {{\n{uses}\n{}}}\n", super::indented(text))
}

impl Rust {
    fn a_loop(&self, index: &str, turns: &str, body: &[Statement], routine: &Routine, level: usize) -> String {
        let (indent, body) = ("    ".repeat(level), self.statements(body, routine, level + 1));
        format!("{indent}for {index} in {turns} {{\n{body}{indent}}}\n")
    }

    /// Sines and cosines of some angles by one call of the kernel.
    fn sin_cos(
        &self,
        kernel: Sines,
        halves: [&[Option<String>]; 2],
        angles: &[Vec<Expression>],
        scope: Scope<'_>,
    ) -> String {
        let style = scope.style;
        let short = |function: &str| format!("{SHORT_SINES}::{function}_{}", style.scalar.name());
        let path = |function: &str| match kernel {
            Sines::Short => short(function),
            Sines::Precise => sin_cos_path(function, style),
        };
        let path_of_sum = match kernel {
            Sines::Short => short("sum_of_angles"),
            Sines::Precise => kernel_path("sum_of_angles", style),
        };
        let expression = |e: &Expression| self.expression(e, scope);
        // a sum goes through with what its rounding lost
        let sums = angles.iter().any(|terms| terms.len() > 1);
        let argument = |terms: &Vec<Expression>| match (sums, terms.as_slice()) {
            (false, terms) => expression(&terms[0]),
            (true, [angle]) if style.generic => format!("[{}, T::zero()]", expression(angle)),
            (true, [angle]) => format!("[{}, 0.0]", expression(angle)),
            (true, terms) => {
                let terms = terms.iter().map(expression).collect::<Vec<_>>().join(", ");
                match style.generic {
                    true => format!("T::sum_of_angles(&[{terms}])"),
                    false => format!("{path_of_sum}([{terms}])"),
                }
            }
        };
        let arguments: Vec<String> = angles.iter().map(argument).collect();
        let (single, several) = match (sums, style.generic) {
            (false, _) => ("sin_cos", "sin_cos_lanes"),
            (true, false) => ("sin_cos_of_sum", "sin_cos_lanes_of_sums"),
            (true, true) => ("sin_cos_of_pair", "sin_cos_lanes_of_pairs"),
        };
        let names = |half: &[Option<String>]| -> Vec<String> {
            half.iter().map(|name| name.clone().unwrap_or("_".to_string())).collect()
        };
        let [sines, cosines] = halves.map(names);
        match (sines.as_slice(), cosines.as_slice(), arguments.as_slice()) {
            ([s], [c], [angle]) => format!("    let ({s}, {c}) = {}({angle});\n", path(single)),
            _ => [
                wrapped("    let ([", &sines, "],"),
                wrapped("        [", &cosines, "]) ="),
                wrapped(&format!("        {}([", path(several)), &arguments, "]);"),
            ]
            .concat(),
        }
    }
}

/// Lines of one level, in that many.
fn indented(text: String, level: usize) -> String {
    (1..level).fold(text, |text, _| super::indented(&text))
}

/// What stands before the body.
fn head(routine: &Routine) -> String {
    let Routine { name, style, access, .. } = routine;
    // a body over lanes becomes part of its caller, and takes the caller's vector instructions
    let inline = match (style.lanes, access) {
        (true, _) => "\n#[inline(always)]",
        (false, Access::Part) => "\n#[inline(never)]",
        (false, _) => "",
    };
    let is_public = *access == Access::Public || *access == Access::Part && in_a_module(routine);
    let word = if is_public { "pub fn" } else { "fn" };
    let parameters: Vec<String> = routine.parameters.iter().map(|p| parameter(routine, p)).collect();
    format!("{ALLOW}{inline}\n{word} {name}{}({}) {{\n", generics(*style), parameters.join(", "))
}

fn parameter(routine: &Routine, parameter: &RoutineParameter) -> String {
    let (style, ports) = (routine.style, &routine.ports);
    match parameter {
        RoutineParameter::Input { port, is_read } => {
            let (port, underscore) = (&ports.inputs[*port], if *is_read { "" } else { "_" });
            format!("{underscore}{}: &{}", port.name, array_type(port, style))
        }
        RoutineParameter::Live { slots, is_written } => {
            format!("live: &{}[{}; {slots}]", if *is_written { "mut " } else { "" }, element_type(style))
        }
        RoutineParameter::Output { port } => {
            let port = &ports.outputs[*port];
            format!("{}: &mut {}", port.name, array_type(port, style))
        }
    }
}

/// `name_part2::name_part2(q, &mut live, tau);`, over lanes `name_part2(q, &mut live, tau);`
fn call_of_part(routine: &Routine, k: usize) -> String {
    let (part, ports) = (&routine.parts[k], &routine.ports);
    let argument = |p: &RoutineParameter| match p {
        RoutineParameter::Input { port, .. } => ports.inputs[*port].name.clone(),
        RoutineParameter::Live { is_written, .. } => format!("&{}live", if *is_written { "mut " } else { "" }),
        RoutineParameter::Output { port } => ports.outputs[*port].name.clone(),
    };
    let arguments: Vec<String> = part.parameters.iter().map(argument).collect();
    let generic = if routine.style.lanes && routine.style.fused { "::<N, FUSED>" } else { "" };
    let module = if in_a_module(part) { format!("{}::", part.name) } else { String::new() };
    format!("{module}{}{generic}({});", part.name, arguments.join(", "))
}

/// Locals of all formats, those of one format together.
fn declare(locals: &[(String, Scalar)], style: Style) -> String {
    let mut out = String::new();
    for scalar in [Scalar::F32, Scalar::F64] {
        let number = if scalar == style.scalar { number_type(style) } else { scalar.name() };
        let names = locals.iter().filter(|(_, s)| *s == scalar).map(|(name, _)| name.clone());
        for names in names.collect::<Vec<String>>().chunks(DECLARATION) {
            match names {
                [name] => {
                    let _ = writeln!(out, "    let {name}: {number};");
                }
                names => out.push_str(&wrapped("    let [", names, &format!("]: [{number}; {}];", names.len()))),
            }
        }
    }
    out
}

fn load(values: &[(String, usize)], style: Style) -> String {
    let mut out = String::new();
    for chunk in values.chunks(DECLARATION) {
        let names: Vec<String> = chunk.iter().map(|(name, _)| name.clone()).collect();
        let slots: Vec<String> = chunk.iter().map(|(_, slot)| format!("live[{slot}]{}", lane(style))).collect();
        let end = format!("]: [{}; {}] =", number_type(style), names.len());
        out.push_str(&wrapped("    let [", &names, &end));
        out.push_str(&wrapped("        [", &slots, "];"));
    }
    out
}

/// The place of scalar `k` of a port, in lanes that of one lane.
fn place(port: &Port, k: usize, style: Style) -> String {
    match (&port.wrapper, style.generic) {
        (Some(_), true) => format!("T::constant(Dd::from(f64::from({})))", element(port, k)),
        (Some(_), false) => element(port, k),
        (None, _) => element(port, k) + lane(style),
    }
}

/// The place of a number of a port in a loop, which counts through one of its axes.
fn strided(port: &Port, at: &Stride) -> String {
    let (mut rest, mut inner) = (at.first, port.len());
    let mut text = port.name.clone();
    let mut step = at.step;
    for n in &port.shape {
        inner /= n;
        let (first, of_axis) = (rest / inner, step / inner);
        rest %= inner;
        step %= inner;
        let _ = match of_axis {
            0 => write!(text, "[{first}]"),
            step => write!(text, "[{}]", turned(&Stride { first, step, index: at.index.clone() })),
        };
    }
    text
}

/// `limb`, `3 * limb`, `7 + limb`, `7 + 3 * limb`
fn turned(Stride { first, step, index }: &Stride) -> String {
    let turns = if *step == 1 { index.clone() } else { format!("{step} * {index}") };
    match first {
        0 => turns,
        first => format!("{first} + {turns}"),
    }
}

/// The index of the lane.
fn lane(style: Style) -> &'static str {
    match style.lanes {
        true => "[lane]",
        false => "",
    }
}

/// The path of a sine and cosine; over lanes it is told whether to fuse.
fn sin_cos_path(function: &str, style: Style) -> String {
    let scalar = style.scalar.name();
    match (style.fused, style.lanes) {
        (false, _) => kernel_path(function, style),
        (true, false) => format!("fused::{function}_{scalar}"),
        (true, true) => format!("fused::{function}_if_{scalar}::<FUSED>"),
    }
}
