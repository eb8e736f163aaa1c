//! A language that functions are written in.

use super::module::{Expression, Ports, Routine, Statement};
use super::Style;
use straightline_graph::expr::op::Text;

/// Where an expression stands.
#[derive(Clone, Copy, Debug)]
pub struct Scope<'a> {
    /// Over what the function is, and in which operations.
    pub style: Style,
    /// The inputs and outputs of its program.
    pub ports: &'a Ports,
}

impl Routine {
    /// Where its expressions stand.
    pub fn scope(&self) -> Scope<'_> {
        Scope { style: self.style, ports: &self.ports }
    }
}

/// How strongly an expression binds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Binding {
    /// As a sum.
    Sum,
    /// As a product.
    Product,
    /// As a sign.
    Sign,
    /// It needs no parentheses anywhere.
    Atom,
}

/// A language: how each thing of a [`Routine`] is written. What is provided suits languages with the usual operators.
pub trait Target {
    /// Words that no local may have for a name.
    fn reserved(&self) -> &'static [&'static str];

    /// What is neither an operator nor a call, or operators in its own way.
    fn atom(&self, expression: &Expression, scope: Scope<'_>) -> (String, Binding);

    /// A call of the kernel.
    fn call(&self, function: &str, operands: &[String], scope: Scope<'_>) -> String;

    /// A statement, with its line ends, in a function of that many levels.
    fn statement(&self, statement: &Statement, routine: &Routine, level: usize) -> String;

    /// A function, with its parts behind it.
    fn routine(&self, routine: &Routine) -> String;

    /// An expression.
    fn expression(&self, expression: &Expression, scope: Scope<'_>) -> String {
        self.bound(expression, scope).0
    }

    /// An expression, in parentheses where it binds less than its surroundings.
    fn operand(&self, expression: &Expression, at_least: Binding, scope: Scope<'_>) -> String {
        let (text, binding) = self.bound(expression, scope);
        match binding < at_least {
            true => format!("({text})"),
            false => text,
        }
    }

    /// An expression, and how strongly it binds.
    fn bound(&self, expression: &Expression, scope: Scope<'_>) -> (String, Binding) {
        use Binding::{Atom, Product, Sign, Sum};
        let operand = |e: &Expression, at_least: Binding| self.operand(e, at_least, scope);
        let call = |function, operands: &[&Expression]| {
            let operands: Vec<String> = operands.iter().map(|e| self.expression(e, scope)).collect();
            (self.call(function, &operands, scope), Atom)
        };
        match expression {
            Expression::Unary(op, a) => match op.row().text {
                Text::Sign(sign) => (format!("{sign}{}", operand(a, Atom)), Sign),
                Text::Call(function) => call(function, &[a]),
                _ => unreachable!("sums and products have two operands"),
            },
            Expression::Binary(op, a, b) => match op.row().text {
                Text::Sum(sign) => (format!("{} {sign} {}", operand(a, Sum), operand(b, Product)), Sum),
                Text::Product(sign) => (format!("{} {sign} {}", operand(a, Product), operand(b, Sign)), Product),
                Text::Call(function) => call(function, &[a, b]),
                Text::Sign(_) => unreachable!("signs have one operand"),
            },
            other => self.atom(other, scope),
        }
    }

    /// Statements, one after the other.
    fn statements(&self, statements: &[Statement], routine: &Routine, level: usize) -> String {
        statements.iter().map(|s| self.statement(s, routine, level)).collect()
    }
}
