//! Functions of straight-line code in C99.
//!
//! A value is a `const` where it is defined. Arrays are flat, as in the header. Products in sums stand in parentheses, as do sums in products
//! (MISRA C:2012, rule 12.1).

use super::{c_comment, C_INDENT};
use crate::emit::lower::Names;
use crate::emit::module::{Access, Expression, Index, Routine, RoutineParameter, Statement, Stride};
use crate::emit::target::{Binding, Scope, Target};
use std::collections::BTreeMap;
use straightline_graph::expr::op::Text;
use straightline_graph::expr::{Port, Sines};
use straightline_graph::Scalar;

/// How long a line of numbers may be.
const LINE: usize = 110;

/// The storage of arrays of constants that need no code.
pub(super) const STATIC: &str = "static const";

/// C99 that depends on nothing.
pub struct C99<'a> {
    /// All names begin with it.
    pub prefix: &'a str,
    /// What stands between the prefix and a function's name: nothing, or its contact mode.
    pub module: String,
    /// The storage of arrays of constants.
    pub table: &'static str,
}

/// The types of the locals that a list of statements declares.
type Types<'s> = BTreeMap<&'s str, Scalar>;

impl Target for C99<'_> {
    fn reserved(&self) -> &'static [&'static str] {
        &["live", "limb", "turn"]
    }

    fn atom(&self, expression: &Expression, scope: Scope<'_>) -> (String, Binding) {
        let text = match expression {
            Expression::Zero => c_number(0.0, scope.style.scalar),
            Expression::Constant(c, scalar) => {
                let binding = if c.is_negative() { Binding::Sign } else { Binding::Atom };
                return (c_number(scalar.nearest(c.value()), *scalar), binding);
            }
            Expression::Local(name) => name.clone(),
            Expression::Input { port, at } => format!("{}[{at}]", scope.ports.inputs[*port].name),
            Expression::InputOfLimb { port, at } => strided(&scope.ports.inputs[*port].name, at),
            Expression::Slot(k) => format!("live[{k}]"),
            Expression::Element(array, Index::Number(k)) => format!("{array}[{k}]"),
            Expression::Element(array, Index::Loop(index)) => format!("{array}[{index}]"),
            Expression::Element(array, Index::Strided(at)) => strided(array, at),
            Expression::Element(array, Index::Row { index, length, entry }) => {
                strided(array, &Stride { first: *entry, step: *length, index: index.clone() })
            }
            Expression::Widened(scalar, inner) | Expression::Rounded(scalar, inner) => {
                let inner = self.operand(inner, Binding::Atom, scope);
                return (format!("({}){inner}", scalar.c_name()), Binding::Sign);
            }
            Expression::Fused { .. } => unreachable!("a package that fuses is refused"),
            Expression::Unary(..) | Expression::Binary(..) => return self.bound(expression, scope),
        };
        (text, Binding::Atom)
    }

    fn call(&self, function: &str, operands: &[String], scope: Scope<'_>) -> String {
        format!("{}({})", self.kernel(function, scope), operands.join(", "))
    }

    /// A sum of products has them in parentheses.
    fn bound(&self, expression: &Expression, scope: Scope<'_>) -> (String, Binding) {
        use Binding::{Atom, Product, Sign, Sum};
        let operand = |e: &Expression, at_least| self.operand(e, at_least, scope);
        match expression {
            Expression::Unary(op, a) => match op.row().text {
                Text::Sign(sign) => (format!("{sign}{}", operand(a, Atom)), Sign),
                Text::Call(function) => (self.call(function, &[self.expression(a, scope)], scope), Atom),
                _ => unreachable!("sums and products have two operands"),
            },
            Expression::Binary(op, a, b) => match op.row().text {
                Text::Sum(sign) => {
                    let left = match self.bound(a, scope) {
                        (text, Product) => format!("({text})"),
                        (text, _) => text,
                    };
                    (format!("{left} {sign} {}", operand(b, Sign)), Sum)
                }
                Text::Product(sign) => (format!("{} {sign} {}", operand(a, Product), operand(b, Sign)), Product),
                Text::Call(function) => {
                    let operands = [self.expression(a, scope), self.expression(b, scope)];
                    (self.call(function, &operands, scope), Atom)
                }
                Text::Sign(_) => unreachable!("signs have one operand"),
            },
            other => self.atom(other, scope),
        }
    }

    fn statement(&self, statement: &Statement, routine: &Routine, level: usize) -> String {
        self.typed_statement(statement, &Types::new(), routine, level)
    }

    fn statements(&self, statements: &[Statement], routine: &Routine, level: usize) -> String {
        let mut types = Types::new();
        for statement in statements {
            if let Statement::Declare(locals) = statement {
                types.extend(locals.iter().map(|(name, scalar)| (name.as_str(), *scalar)));
            }
        }
        statements.iter().map(|s| self.typed_statement(s, &types, routine, level)).collect()
    }

    fn routine(&self, routine: &Routine) -> String {
        let mut out: String = routine.parts.iter().map(|part| self.routine(part) + "\n").collect();
        out.push_str(&self.head(routine));
        out.push_str("\n{\n");
        for parameter in &routine.parameters {
            match parameter {
                RoutineParameter::Input { port, is_read: false } => {
                    out.push_str(&format!("{C_INDENT}(void){};\n", routine.ports.inputs[*port].name));
                }
                RoutineParameter::Output { port } if routine.ports.outputs[*port].is_empty() => {
                    out.push_str(&format!("{C_INDENT}(void){};\n", routine.ports.outputs[*port].name));
                }
                _ => {}
            }
        }
        if has_sines(&routine.body) {
            let of_turns = self.kernel("turn", routine.scope());
            out.push_str(&format!("{C_INDENT}{of_turns} {};\n", turn(routine)));
        }
        out.push_str(&self.statements(&routine.body, routine, 1));
        out.push_str("}\n");
        out
    }
}

impl C99<'_> {
    /// The name of something of the kernel.
    fn kernel(&self, function: &str, scope: Scope<'_>) -> String {
        format!("{}_{function}_{}", self.prefix, scope.style.scalar.name())
    }

    /// What stands before the body.
    fn head(&self, routine: &Routine) -> String {
        let scalar = routine.style.scalar.c_name();
        let storage = match routine.access {
            Access::Public => "",
            Access::Private => "static ",
            Access::Part => &format!("{} ", part_storage(self.prefix)),
        };
        let (inputs, outputs) = (&routine.ports.inputs, &routine.ports.outputs);
        let parameter = |p: &RoutineParameter| match p {
            RoutineParameter::Input { port, .. } => array(&format!("const {scalar}"), &inputs[*port]),
            RoutineParameter::Live { slots, is_written: true } => format!("{scalar} live[{slots}]"),
            RoutineParameter::Live { slots, is_written: false } => format!("const {scalar} live[{slots}]"),
            RoutineParameter::Output { port } => array(scalar, &outputs[*port]),
        };
        let parameters: Vec<String> = routine.parameters.iter().map(parameter).collect();
        format!("{storage}void {}_{}{}({})", self.prefix, self.module, routine.name, parameters.join(", "))
    }

    fn typed_statement(&self, statement: &Statement, types: &Types<'_>, routine: &Routine, level: usize) -> String {
        let (scope, indent) = (routine.scope(), C_INDENT.repeat(level));
        let scalar = routine.style.scalar.c_name();
        let expression = |e: &Expression| self.expression(e, scope);
        let line = |text: String| format!("{indent}{text}\n");
        match statement {
            Statement::Comment(text) => line(format!("/* {} */", c_comment(text))),
            // where their values are
            Statement::Declare(_) => String::new(),
            Statement::Set(name, value) => {
                let scalar = types.get(name.as_str()).map_or(scalar, |scalar| scalar.c_name());
                line(format!("const {scalar} {name} = {};", expression(value)))
            }
            Statement::Store { port, at, value } => {
                line(format!("{}[{at}] = {};", scope.ports.outputs[*port].name, expression(value)))
            }
            // what is read of it was written before
            Statement::Live { slots, .. } => line(format!("{scalar} live[{slots}];")),
            Statement::Part(k) => line(self.call_of_part(routine, *k)),
            Statement::Load(values) => {
                values.iter().map(|(name, slot)| line(format!("const {scalar} {name} = live[{slot}];"))).collect()
            }
            Statement::Keep { slot, value } => line(format!("live[{slot}] = {};", expression(value))),
            Statement::SinCos { kernel, sines, cosines, angles } => {
                let turn = turn(routine);
                let half = |name: &Option<String>, half: &str| match name {
                    Some(name) => line(format!("const {scalar} {name} = {turn}.{half};")),
                    None => String::new(),
                };
                let pairs = sines.iter().zip(cosines).zip(angles).map(|((sine, cosine), terms)| {
                    line(format!("{turn} = {};", self.sin_cos(*kernel, terms, scope)))
                        + &half(sine, "sine")
                        + &half(cosine, "cosine")
                });
                pairs.collect()
            }
            Statement::Array { name, values, is_constant } => {
                let storage = if *is_constant { self.table } else { "const" };
                let values: Vec<String> = values.iter().map(expression).collect();
                let start = format!("{indent}{storage} {scalar} {name}[{}] = {{", values.len());
                wrapped(&start, &values, "};", &indent)
            }
            Statement::Table { name, rows, is_constant } => {
                let storage = if *is_constant { self.table } else { "const" };
                let values: Vec<String> = rows.iter().flatten().map(expression).collect();
                let start = format!("{indent}{storage} {scalar} {name}[{}] = {{", values.len());
                wrapped(&start, &values, "};", &indent)
            }
            Statement::StoreOfLimb { port, at, value } => {
                line(format!("{} = {};", strided(&scope.ports.outputs[*port].name, at), expression(value)))
            }
            Statement::Room { name, count, .. } => line(format!("{scalar} {name}[{count}];")),
            Statement::Put { array, index, value } => line(format!("{array}[{index}] = {};", expression(value))),
            Statement::Limbs { index, count, body, .. } => {
                let body = self.statements(body, routine, level + 1);
                format!("{indent}for (uint32_t {index} = 0U; {index} < {count}U; {index}++) {{\n{body}{indent}}}\n")
            }
            Statement::Lanes(_) => unreachable!("a package with lanes is refused"),
        }
    }

    /// The kernel's call for one angle; a sum goes through with what its rounding lost.
    fn sin_cos(&self, kernel: Sines, terms: &[Expression], scope: Scope<'_>) -> String {
        let expression = |e: &Expression| self.expression(e, scope);
        let [of_one, of_sum] = match kernel {
            Sines::Precise => ["sin_cos", "sin_cos_of_sum"],
            Sines::Short => ["short_sin_cos", "short_sin_cos_of_sum"],
        };
        match terms {
            [angle] => self.call(of_one, &[expression(angle)], scope),
            terms => {
                let first = self.call("first_angle", &[expression(&terms[0])], scope);
                let sum =
                    terms[1..].iter().fold(first, |sum, term| self.call("next_angle", &[sum, expression(term)], scope));
                self.call(of_sum, &[sum], scope)
            }
        }
    }

    /// `arm_mass_matrix_part2(q, live, h);`
    fn call_of_part(&self, routine: &Routine, k: usize) -> String {
        let (part, ports) = (&routine.parts[k], &routine.ports);
        let argument = |p: &RoutineParameter| match p {
            RoutineParameter::Input { port, .. } => ports.inputs[*port].name.clone(),
            RoutineParameter::Live { .. } => "live".to_string(),
            RoutineParameter::Output { port } => ports.outputs[*port].name.clone(),
        };
        let arguments: Vec<String> = part.parameters.iter().map(argument).collect();
        format!("{}_{}{}({});", self.prefix, self.module, part.name, arguments.join(", "))
    }
}

/// `q[7U + (3U * limb)]`
fn strided(array: &str, Stride { first, step, index }: &Stride) -> String {
    let turns = if *step == 1 { index.clone() } else { format!("({step}U * {index})") };
    format!("{array}[{first}U + {turns}]")
}

/// The macro before parts of functions.
pub(super) fn part_storage(prefix: &str) -> String {
    format!("{}_PART", prefix.to_uppercase())
}

/// The name of the local that takes a sine and a cosine.
fn turn(routine: &Routine) -> String {
    let ports = routine.ports.inputs.iter().chain(&routine.ports.outputs).map(|p| p.name.as_str());
    Names::with_taken(ports).free("turn")
}

fn has_sines(statements: &[Statement]) -> bool {
    statements.iter().any(|s| match s {
        Statement::SinCos { .. } => true,
        Statement::Limbs { body, .. } | Statement::Lanes(body) => has_sines(body),
        _ => false,
    })
}

/// A parameter: an array, of no numbers at all a pointer.
fn array(c_type: &str, port: &Port) -> String {
    match port.len() {
        0 => format!("{c_type} *{}", port.name),
        n => format!("{c_type} {}[{n}]", port.name),
    }
}

/// A number as a constant of C, which reads back to it where the compiler reads constants as IEEE 754 says.
pub(super) fn c_number(x: f64, scalar: Scalar) -> String {
    scalar.literal(x) + scalar.c_suffix()
}

/// The items with commas, in lines of bounded length.
fn wrapped(start: &str, items: &[String], end: &str, indent: &str) -> String {
    let mut text = start.to_string();
    let mut column = start.len();
    for (i, item) in items.iter().enumerate() {
        if i > 0 {
            text.push(',');
            let fits = column + item.len() + 3 <= LINE;
            let gap = if fits { " ".to_string() } else { format!("\n{indent}{C_INDENT}") };
            column = if fits { column + 2 } else { gap.len() };
            text.push_str(&gap);
        }
        text.push_str(item);
        column += item.len();
    }
    text + end + "\n"
}
