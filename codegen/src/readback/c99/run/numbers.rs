//! Numbers: sums, products, literals, casts, entries of arrays and calls of the kernel.

use super::{CRan, CRun, CThing};
use crate::readback::values::{TextFormat, TextValue};
use straightline_graph::expr::Sines;

impl CRun<'_, '_> {
    pub(super) fn kernel_name(&self, function: &str, format: TextFormat) -> String {
        let of = if format == TextFormat::F64 { "f64" } else { "f32" };
        format!("{}_{function}_{of}", self.prefix)
    }

    /// Takes the name of a function of the kernel in this format.
    fn kernel(&mut self, functions: &[&'static str], format: TextFormat) -> CRan<&'static str> {
        let found = functions.iter().find(|f| self.kernel_name(f, format) == self.token());
        match found.filter(|_| self.kernel.contains(self.token())) {
            Some(function) => {
                self.at += 1;
                Ok(function)
            }
            None => self.stop("a name that stands for nothing here"),
        }
    }

    /// A call for the sine and the cosine of an angle.
    pub(super) fn sin_cos(&mut self, format: TextFormat) -> CRan<(TextValue, TextValue)> {
        const FUNCTIONS: [&str; 4] = ["sin_cos", "sin_cos_of_sum", "short_sin_cos", "short_sin_cos_of_sum"];
        let function = self.kernel(&FUNCTIONS, format)?;
        let sines = if function.starts_with("short") { Sines::Short } else { Sines::Precise };
        self.mark("(")?;
        let terms = match function {
            "sin_cos" | "short_sin_cos" => vec![self.number(format)?],
            _ => self.sum_of_angles(format)?,
        };
        self.mark(")")?;
        let angle = self.values.angle(terms);
        Ok(self.values.sin_cos(angle, sines))
    }

    /// `next_angle(first_angle(a), b)`
    fn sum_of_angles(&mut self, format: TextFormat) -> CRan<Vec<TextValue>> {
        let function = self.kernel(&["first_angle", "next_angle"], format)?;
        self.mark("(")?;
        let mut terms = Vec::new();
        if function == "next_angle" {
            terms = self.sum_of_angles(format)?;
            self.mark(",")?;
        }
        terms.push(self.number(format)?);
        self.mark(")")?;
        Ok(terms)
    }

    /// A sum in this format.
    pub(super) fn number(&mut self, of: TextFormat) -> CRan<TextValue> {
        let start = self.at;
        let mut sum = self.product(of)?;
        loop {
            let is_minus = match self.token() {
                "+" => false,
                "-" => true,
                _ => return Ok(sum),
            };
            self.at += 1;
            let term = self.product(of)?;
            sum = self.values.add(sum, if is_minus { term.negated() } else { term });
            self.demand(sum, start)?;
        }
    }

    fn product(&mut self, of: TextFormat) -> CRan<TextValue> {
        let start = self.at;
        let mut product = self.signed(of)?;
        loop {
            let is_quotient = match self.token() {
                "*" => false,
                "/" => true,
                _ => return Ok(product),
            };
            self.at += 1;
            let factor = self.signed(of)?;
            product = match is_quotient {
                false => self.values.mul(product, factor),
                true => self.values.div(product, factor),
            };
            self.demand(product, start)?;
        }
    }

    /// What the text computes, some program computes.
    fn demand(&self, value: TextValue, start: usize) -> CRan<()> {
        match self.values.is_wanted(value) {
            true => Ok(()),
            false => {
                let text = &self.text.text[self.text.place(start)..self.text.place(self.at)];
                self.text.stop(start, format!("no program computes `{}`", text.trim()))
            }
        }
    }

    fn signed(&mut self, of: TextFormat) -> CRan<TextValue> {
        match self.takes("-") {
            true => Ok(self.atom(of)?.negated()),
            false => self.atom(of),
        }
    }

    fn atom(&mut self, of: TextFormat) -> CRan<TextValue> {
        let (start, token) = (self.at, self.token());
        let value = match token {
            "(" => {
                self.at += 1;
                match Self::format_of(self.token()) {
                    Some(to) => {
                        self.at += 1;
                        self.mark(")")?;
                        self.cast(to, start)?
                    }
                    None => {
                        let value = self.number(of)?;
                        self.mark(")")?;
                        value
                    }
                }
            }
            _ if token.starts_with(|c: char| c.is_ascii_digit()) => {
                let x = self.literal(of)?;
                self.values.constant(x, of)
            }
            _ => match self.locals.get(token).copied() {
                Some(CThing::Number(value)) => {
                    self.at += 1;
                    value
                }
                Some(CThing::Array(..)) => match self.cell()? {
                    (cell, ..) if self.cells[cell] == TextValue::NONE => {
                        return self.text.stop(start, "a number is read that nothing put there");
                    }
                    (cell, ..) => self.cells[cell],
                },
                Some(CThing::Turn(_, Some((sine, cosine)))) => {
                    self.at += 1;
                    self.mark(".")?;
                    match self.text.name(&mut self.at)? {
                        "sine" => sine,
                        "cosine" => cosine,
                        _ => return self.text.stop(start, "a sine or a cosine is expected here"),
                    }
                }
                Some(_) => return self.stop("something that is not a number"),
                None => {
                    let function = self.kernel(&["sqrt", "sign"], of)?;
                    self.mark("(")?;
                    let operand = self.number(of)?;
                    self.mark(")")?;
                    let value = match function {
                        "sqrt" => self.values.sqrt(operand),
                        _ => self.values.sign(operand),
                    };
                    self.demand(value, start)?;
                    value
                }
            },
        };
        match self.values.format(value) == of {
            true => Ok(value),
            false => self.text.stop(start, "a number of another format"),
        }
    }

    /// Behind `(double)` or `(float)`.
    fn cast(&mut self, to: TextFormat, start: usize) -> CRan<TextValue> {
        let value = match to {
            TextFormat::F64 => {
                let inner = self.atom(TextFormat::F32)?;
                self.values.widened(inner)
            }
            _ => {
                let inner = self.atom(TextFormat::F64)?;
                self.values.rounded(inner)
            }
        };
        self.demand(value, start)?;
        Ok(value)
    }

    /// A number as it is written, in this format.
    fn literal(&mut self, of: TextFormat) -> CRan<f64> {
        let text = self.token();
        let digits = match of {
            TextFormat::F32 => text.strip_suffix('F'),
            _ => Some(text),
        };
        let is_plain = |digits: &&str| {
            digits.contains(['.', 'e']) && digits.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'e' | b'-'))
        };
        let number = digits.filter(is_plain).and_then(|digits| match of {
            TextFormat::F32 => digits.parse::<f32>().ok().map(f64::from),
            _ => digits.parse::<f64>().ok(),
        });
        match number.filter(|x| x.is_finite()) {
            Some(x) => {
                self.at += 1;
                Ok(x)
            }
            None => self.stop("a number of another kind"),
        }
    }
}
