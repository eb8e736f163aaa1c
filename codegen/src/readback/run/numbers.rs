//! Numbers: sums, products, literals, calls that give one, and entries of arrays.

use super::{Array, Execution, Ran, Thing};
use crate::readback::items::TextExtent;
use crate::readback::tokens::{self as t, TokenKind};
use crate::readback::values::{TextFormat, TextValue};

impl<'t> Execution<'_, 't> {
    /// A sum, in the format `of`; `format` is that of the function.
    pub(super) fn number(&mut self, of: TextFormat, format: TextFormat) -> Ran<TextValue> {
        let start = self.at;
        let mut sum = self.product(of, format)?;
        while let TokenKind::Mark(mark @ (b'+' | b'-')) = self.kind() {
            self.at += 1;
            let term = self.product(of, format)?;
            sum = self.values.add(sum, if mark == b'-' { term.negated() } else { term });
            self.demand(sum, start)?;
        }
        Ok(sum)
    }

    pub(super) fn product(&mut self, of: TextFormat, format: TextFormat) -> Ran<TextValue> {
        let start = self.at;
        let mut product = self.signed(of, format)?;
        while let TokenKind::Mark(mark @ (b'*' | b'/')) = self.kind() {
            self.at += 1;
            let factor = self.signed(of, format)?;
            product = match mark {
                b'*' => self.values.mul(product, factor),
                _ => self.values.div(product, factor),
            };
            self.demand(product, start)?;
        }
        Ok(product)
    }

    /// What the text computes, some program computes.
    pub(super) fn demand(&self, value: TextValue, start: usize) -> Ran<()> {
        if self.values.is_wanted(value) {
            return Ok(());
        }
        let text =
            &self.items.text[self.items.tokens[start].start as usize..self.items.tokens[self.at - 1].end as usize];
        self.items.stop(start, format!("no program computes `{text}`"))
    }

    pub(super) fn signed(&mut self, of: TextFormat, format: TextFormat) -> Ran<TextValue> {
        if self.takes(b'-') {
            return Ok(self.signed(of, format)?.negated());
        }
        self.atom(of, format)
    }

    pub(super) fn atom(&mut self, of: TextFormat, format: TextFormat) -> Ran<TextValue> {
        let start = self.at;
        let value = match self.kind() {
            TokenKind::Number => match of {
                TextFormat::Any => return self.stop("a number of no format"),
                of => {
                    let x = self.literal(of)?;
                    self.values.constant(x, of)
                }
            },
            TokenKind::Mark(b'(') => {
                let close = self.items.tokens[start].closes as usize;
                let is_cast = self.ahead(1) == TokenKind::Mark(b'(')
                    && self.items.kind(self.items.tokens[start + 1].closes as usize + 1) == TokenKind::Word(t::AS);
                self.at += 1;
                if is_cast && (of, format) == (TextFormat::F32, TextFormat::F32) {
                    self.at += 1;
                    let value = self.number(TextFormat::F64, format)?;
                    self.these(") as f32 )")?;
                    let rounded = self.values.rounded(value);
                    self.demand(rounded, start)?;
                    return Ok(rounded);
                }
                let value = self.number(of, format)?;
                self.mark(b')')?;
                debug_assert!(self.at == close + 1, "an expression ends at its bracket");
                value
            }
            TokenKind::Word(name) => match self.local(name) {
                Some(k) => match self.locals[k].thing {
                    Thing::Number(value) => {
                        self.at += 1;
                        value
                    }
                    Thing::Wrapped(..) if format == TextFormat::Any => return self.stop("a number of another format"),
                    Thing::Place(_) | Thing::Wrapped(..) => {
                        let (cell, ..) = self.cell()?;
                        match self.cells[cell] {
                            TextValue::NONE => return self.items.stop(start, "a result is read"),
                            value => value,
                        }
                    }
                    Thing::Declared(_) => return self.stop("a local without a value"),
                    _ => return self.stop("something that is not a number"),
                },
                None => self.call_of_number(name, of, format)?,
            },
            _ => return self.stop("a number is expected here"),
        };
        if self.values.format(value) != of {
            return self.items.stop(start, "a number of another format");
        }
        Ok(value)
    }

    /// A number as it is written, in this format.
    pub(super) fn literal(&mut self, of: TextFormat) -> Ran<f64> {
        let text = self.items.text_of(self.at);
        let (digits, suffix) = match text.split_once('_') {
            Some((digits, suffix)) => (digits, Some(suffix)),
            None => (text, None),
        };
        let is_float = digits.contains(['.', 'e']);
        let fits = match suffix {
            None => true,
            Some("f32") => of == TextFormat::F32,
            Some("f64") => of == TextFormat::F64,
            Some(_) => false,
        };
        let number = match of {
            TextFormat::F32 => digits.parse::<f32>().ok().map(f64::from),
            _ => digits.parse::<f64>().ok(),
        };
        match number.filter(|x| is_float && fits && x.is_finite()) {
            Some(x) => {
                self.at += 1;
                Ok(x)
            }
            None => self.stop("a number of another kind"),
        }
    }

    /// A call, or a path, whose value is a number.
    pub(super) fn call_of_number(&mut self, name: u32, of: TextFormat, format: TextFormat) -> Ran<TextValue> {
        let start = self.at;
        match name {
            t::FMA | t::FMA_IF => {
                self.at += 1;
                let told = name == t::FMA_IF;
                if told {
                    self.told_whether_to_fuse()?;
                }
                if !self.known.fused[1 + usize::from(told)] {
                    return self.items.stop(start, "a name that stands for nothing here");
                }
                self.mark(b'(')?;
                let a = self.number(of, format)?;
                self.mark(b',')?;
                let b = self.number(of, format)?;
                let product = self.values.mul(a, b);
                self.demand(product, start)?;
                self.mark(b',')?;
                let c = self.number(of, format)?;
                self.mark(b')')?;
                let sum = self.values.add(product, c);
                self.demand(sum, start)?;
                Ok(sum)
            }
            // a caller's scalar
            t::T if format == TextFormat::Any && self.known.generic && self.ahead(3) == TokenKind::Word(t::ZERO) => {
                self.these("T : : zero ( )")?;
                Ok(self.values.long(0.0, 0.0))
            }
            t::T if format == TextFormat::Any
                && self.known.generic
                && self.ahead(3) == TokenKind::Word(t::CONSTANT) =>
            {
                self.constant_of_cell(start)
            }
            t::NUMBER if format == TextFormat::Any && self.known.generic => self.number_in_two(),
            t::F64 if (of, format) == (TextFormat::F64, TextFormat::F32) => self.widened(start, format),
            t::TRIG | t::T if self.ahead(1) == TokenKind::Mark(b':') => {
                let function = self.kernel(of)?;
                self.mark(b'(')?;
                let a = self.number(of, format)?;
                self.mark(b')')?;
                let value = match function {
                    "sqrt" => self.values.sqrt(a),
                    "sign" => self.values.sign(a),
                    _ => return self.items.stop(start, "a function that gives no number"),
                };
                self.demand(value, start)?;
                Ok(value)
            }
            _ => self.stop("a name that stands for nothing here"),
        }
    }

    /// `T::constant(Dd::from(f64::from(body.0[3])))`
    fn constant_of_cell(&mut self, start: usize) -> Ran<TextValue> {
        self.these("T : : constant ( Dd : : from ( f64 : : from (")?;
        let (cell, _, mutable) = self.cell()?;
        self.these(") ) )")?;
        if mutable {
            return self.items.stop(start, "a constant that may change");
        }
        Ok(self.cells[cell])
    }

    /// `number::<T>(high, low)`
    fn number_in_two(&mut self) -> Ran<TextValue> {
        self.these("number : : < T > (")?;
        let high = self.signed_literal()?;
        self.mark(b',')?;
        let low = self.signed_literal()?;
        self.mark(b')')?;
        Ok(self.values.long(high, low))
    }

    /// `f64::from(x)`, of x in f32
    fn widened(&mut self, start: usize, format: TextFormat) -> Ran<TextValue> {
        self.these("f64 : : from (")?;
        // numbers alone would be of f64; beside a value they have its format
        if self.begins_with_a_number() && !self.names_a_value() {
            return self.stop("a number of no format");
        }
        let value = self.number(TextFormat::F32, format)?;
        self.mark(b')')?;
        let widened = self.values.widened(value);
        self.demand(widened, start)?;
        Ok(widened)
    }

    pub(super) fn signed_literal(&mut self) -> Ran<f64> {
        let negative = self.takes(b'-');
        if self.kind() != TokenKind::Number {
            return self.stop("a number is expected here");
        }
        let x = self.literal(TextFormat::F64)?;
        Ok(if negative { -x } else { x })
    }

    /// `q[3]`, `h[2][lane]`, `body.0[7]`, `qd[6 + 3 * limb]`: its cell, its format, and whether it may be written.
    pub(super) fn cell(&mut self) -> Ran<(usize, TextFormat, bool)> {
        let start = self.at;
        let name = self.word()?;
        let Some(k) = self.local(name) else {
            return self.items.stop(start, "a name that stands for nothing here");
        };
        let place = match self.locals[k].thing {
            Thing::Place(place) => place,
            Thing::Wrapped(_, place) => {
                self.mark(b'.')?;
                if self.integer()? != 0 {
                    return self.items.stop(start, "a field that is not there");
                }
                place
            }
            _ => return self.items.stop(start, "something without indices"),
        };
        let Array { first, ref extents, format } = self.arrays[place.array as usize];
        let mut cell = 0;
        let mut at = self.at;
        for extent in extents {
            self.items.mark(&mut at, b'[')?;
            match *extent {
                TextExtent::Of(n) => {
                    let index = self.index(&mut at)?;
                    if index >= n {
                        return self.items.stop(at - 1, "an index beyond the end");
                    }
                    cell = cell * n + index;
                }
                TextExtent::Lanes => {
                    let TokenKind::Word(name) = self.items.kind(at) else {
                        return self.items.stop(at, "an index is expected here");
                    };
                    let Some(Thing::Lane) = self.local(name).map(|k| self.locals[k].thing) else {
                        return self.items.stop(at, "an index of another kind");
                    };
                    at += 1;
                }
            }
            self.items.mark(&mut at, b']')?;
        }
        self.at = at;
        Ok((first as usize + cell, format, place.mutable))
    }

    /// `3`, `limb`, `3 * limb`, `7 + limb`, `7 + 3 * limb`
    fn index(&self, at: &mut usize) -> Ran<usize> {
        let is_number = |at: usize| self.items.kind(at) == TokenKind::Number;
        if !is_number(*at) {
            return self.turn(at);
        }
        let first = self.items.integer(at)?;
        match self.items.kind(*at) {
            TokenKind::Mark(b'*') => {
                *at += 1;
                Ok(first.saturating_mul(self.turn(at)?))
            }
            TokenKind::Mark(b'+') => {
                *at += 1;
                let mut step = 1;
                if is_number(*at) {
                    step = self.items.integer(at)?;
                    self.items.mark(at, b'*')?;
                }
                Ok(first.saturating_add(step.saturating_mul(self.turn(at)?)))
            }
            _ => Ok(first),
        }
    }

    /// The index of a loop over limbs: which turn it is.
    fn turn(&self, at: &mut usize) -> Ran<usize> {
        let TokenKind::Word(name) = self.items.kind(*at) else {
            return self.items.stop(*at, "an index is expected here");
        };
        let Some(Thing::Index(turn)) = self.local(name).map(|k| self.locals[k].thing) else {
            return self.items.stop(*at, "an index of another kind");
        };
        *at += 1;
        Ok(turn)
    }
}
