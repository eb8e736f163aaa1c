//! Statements: locals, arrays, assignments, loops and calls that fill arrays.

use super::{count_of, Array, ArrayPlace, Execution, Ran, Thing, LONGEST};
use crate::readback::items::{Sort, TextExtent, TextFunction, Type};
use crate::readback::tokens::{self as t, TokenKind};
use crate::readback::values::{TextFormat, TextValue};

impl<'t> Execution<'_, 't> {
    /// `{ … }`
    pub(super) fn block(&mut self, function: &TextFunction, format: TextFormat) -> Ran<()> {
        let count = self.locals.len();
        let end = self.items.tokens[self.at].closes as usize;
        self.mark(b'{')?;
        while self.at < end {
            match self.kind() {
                TokenKind::Word(t::LET) => {
                    self.at += 1;
                    self.let_(format)?;
                }
                TokenKind::Word(t::STATIC) => {
                    self.at += 1;
                    self.array_of_limbs(format, true)?;
                }
                TokenKind::Word(t::FOR) => self.for_(function, format)?,
                TokenKind::Word(name) => {
                    let is_local = self.local(name).is_some();
                    match self.ahead(1) {
                        TokenKind::Mark(b'=') => self.assign_local(name, format)?,
                        TokenKind::Mark(b'[') if is_local => self.assign_place(format)?,
                        TokenKind::Mark(b'(' | b':') if !is_local => self.statement_call(function, end)?,
                        _ => return self.stop("a statement that is not known"),
                    }
                }
                _ => return self.stop("a statement that is not known"),
            }
        }
        for local in &self.locals[count..] {
            let Thing::Place(ArrayPlace { array, mutable: true, reference: false }) = local.thing else { continue };
            let Array { first, ref extents, .. } = self.arrays[array as usize];
            let cells = first as usize..first as usize + count_of(extents);
            if self.written[cells].contains(&0) {
                return self.items.stop(end, "an array has a number that nothing puts there");
            }
        }
        self.at = end + 1;
        self.unbind(count);
        Ok(())
    }

    pub(super) fn assign_local(&mut self, name: u32, format: TextFormat) -> Ran<()> {
        let Some(k) = self.local(name) else { return self.stop("a name that stands for nothing here") };
        let Thing::Declared(of) = self.locals[k].thing else {
            return self.stop("a second value of a local, or of something that takes none");
        };
        self.at += 2;
        let value = self.number(of, format)?;
        // no statement declares locals on its way
        self.locals[k].thing = Thing::Number(value);
        self.mark(b';')
    }

    pub(super) fn assign_place(&mut self, format: TextFormat) -> Ran<()> {
        let start = self.at;
        let (cell, of, mutable) = self.cell()?;
        if !mutable {
            return self.items.stop(start, "a value is put where none may be");
        }
        self.mark(b'=')?;
        let value = self.number(of, format)?;
        self.cells[cell] = value;
        self.written[cell] = start as u32;
        self.mark(b';')
    }

    /// `name_part2::name_part2(q, &mut live, tau);`, `name_part2(q, &mut live, tau);`, or the same as the last thing of a function.
    pub(super) fn statement_call(&mut self, function: &TextFunction, end: usize) -> Ran<()> {
        let start = self.at;
        let mut name = self.word()?;
        let mut module = Some(self.module);
        if self.kind() == TokenKind::Mark(b':') && matches!(self.ahead(2), TokenKind::Word(_)) {
            module = self.items.inner(self.module, name);
            self.these(": :")?;
            name = self.word()?;
        }
        let item = module.and_then(|module| self.items.find_place(module, Sort::Function, name));
        let Some(item) = item.filter(|item| self.is_visible(*item)) else {
            return self.items.stop(start, "a call of something that is not known");
        };
        let mut given = Vec::new();
        if self.kind() == TokenKind::Mark(b':') {
            self.these(": : <")?;
            given = self.listed(b'>', |run| {
                let word = run.word()?;
                let fused_of_file = word == t::FUSED && run.known.fused[2];
                match function.generics.contains(&word) || fused_of_file {
                    true => Ok(word),
                    false => run.items.stop(run.at - 1, "a name that stands for nothing here"),
                }
            })?;
        }
        let called = self.signature(item)?;
        // what is not given follows from the arguments: the number of lanes, the scalar
        let follows = given.is_empty() && !called.generics.contains(&t::FUSED);
        if !follows && given != called.generics {
            return self.items.stop(start, "other generic arguments than the function has parameters");
        }
        self.mark(b'(')?;
        let arguments = self.listed(b')', Self::argument)?;
        let behind = self.at;
        self.at = start;
        self.call(item, &arguments)?;
        self.at = behind;
        if self.at < end {
            self.mark(b';')?;
        }
        Ok(())
    }

    /// Whether a function may be called from here: one of an inner module is public.
    fn is_visible(&self, item: usize) -> bool {
        let item = &self.items.all[item];
        item.module == self.module || self.items.kind(item.start) == TokenKind::Word(t::PUB)
    }

    pub(super) fn argument(&mut self) -> Ran<Thing> {
        let mut reference = None;
        if self.takes(b'&') {
            let mutable = self.kind() == TokenKind::Word(t::MUT);
            self.at += usize::from(mutable);
            reference = Some(mutable);
        }
        let start = self.at;
        let name = self.word()?;
        let Some(k) = self.local(name) else {
            return self.items.stop(start, "a name that stands for nothing here");
        };
        match (self.locals[k].thing, reference) {
            (Thing::Place(place), Some(mutable)) if !place.reference && (place.mutable || !mutable) => {
                Ok(Thing::Place(ArrayPlace { mutable, reference: true, ..place }))
            }
            (thing @ (Thing::Place(_) | Thing::Wrapped(..)), None) => Ok(thing),
            _ => self.items.stop(start, "an argument that is not known"),
        }
    }

    /// Behind `let`.
    pub(super) fn let_(&mut self, format: TextFormat) -> Ran<()> {
        match self.kind() {
            TokenKind::Mark(b'[') => {
                self.at += 1;
                self.pattern()?;
                let names = std::mem::take(&mut self.names);
                self.mark(b':')?;
                let start = self.at;
                let Type::Array(extents, of) = self.items.type_of(&mut self.at, format)? else {
                    return self.items.stop(start, "an array is expected here");
                };
                if extents != [TextExtent::Of(names.len())] {
                    return self.items.stop(start, "as many names as numbers are expected here");
                }
                if self.takes(b';') {
                    names.iter().for_each(|name| self.bind(*name, Thing::Declared(of)));
                } else {
                    self.mark(b'=')?;
                    let values = self.list(of, format)?;
                    self.bind_all(&names, &values)?;
                    self.mark(b';')?;
                }
                self.names = names;
                Ok(())
            }
            TokenKind::Mark(b'(') => self.sines(format),
            TokenKind::Word(t::MUT) => {
                self.at += 1;
                self.array_to_fill(format)
            }
            TokenKind::Word(name) => {
                if self.ahead(1) == TokenKind::Mark(b':') && self.ahead(2) == TokenKind::Mark(b'[') {
                    return self.array_of_limbs(format, false);
                }
                self.at += 1;
                self.mark(b':')?;
                let start = self.at;
                let Type::Number(of) = self.items.type_of(&mut self.at, format)? else {
                    return self.items.stop(start, "the type of a number is expected here");
                };
                self.mark(b';')?;
                self.bind(name, Thing::Declared(of));
                Ok(())
            }
            _ => self.stop("a local that is not known"),
        }
    }

    /// Names up to `]`, into `self.names`.
    pub(super) fn pattern(&mut self) -> Ran<()> {
        self.names.clear();
        loop {
            let name = self.word()?;
            if name != t::UNDERSCORE && self.names.contains(&name) {
                return self.items.stop(self.at - 1, "a second local of that name");
            }
            self.names.push(name);
            if self.takes(b']') {
                return Ok(());
            }
            self.mark(b',')?;
        }
    }

    pub(super) fn bind_all(&mut self, names: &[u32], values: &[TextValue]) -> Ran<()> {
        if names.len() != values.len() {
            return self.stop("as many names as numbers are expected here");
        }
        for (name, value) in names.iter().zip(values) {
            if *name != t::UNDERSCORE {
                self.bind(*name, Thing::Number(*value));
            }
        }
        Ok(())
    }

    /// `live = [q[0]; 12];`, `forces = [T::zero(); 4];`, `live = [[0.0; N]; 12];` behind `let mut`.
    pub(super) fn array_to_fill(&mut self, format: TextFormat) -> Ran<()> {
        let name = self.word()?;
        self.these("= [")?;
        let lanes = self.takes(b'[');
        let start = self.at;
        let value = self.number(format, format)?;
        if value != self.zero(format) && self.first_given() != Some(value) {
            return self
                .items
                .stop(start, "an array begins with zeros, or the first number that the function is given");
        }
        if lanes {
            self.these("; N ]")?;
        }
        self.mark(b';')?;
        let n = self.integer()?;
        self.these("] ;")?;
        if n > self.items.text.len() {
            return self.stop("an array that is too long");
        }
        let extents = [TextExtent::Of(n), TextExtent::Lanes];
        let place = self.array(&extents[..1 + usize::from(lanes)], format, &vec![value; n], true);
        self.bind(name, Thing::Place(ArrayPlace { reference: false, ..place }));
        Ok(())
    }

    /// `x1: [f64; 4] = [a, b, c, d];` or `C1: [[f64; 2]; 4] = [[a, b], …];` behind `let` or `static`.
    pub(super) fn array_of_limbs(&mut self, format: TextFormat, is_static: bool) -> Ran<()> {
        let name = self.word()?;
        self.mark(b':')?;
        let start = self.at;
        let Type::Array(extents, of) = self.items.type_of(&mut self.at, format)? else {
            return self.items.stop(start, "an array is expected here");
        };
        self.mark(b'=')?;
        let first = self.at;
        let (values, found) = match extents[..] {
            [_, _] => self.rows(of, format)?,
            _ => {
                let values = self.list(of, format)?;
                let found = vec![TextExtent::Of(values.len())];
                (values, found)
            }
        };
        let is_name = |at: usize| matches!(self.items.kind(at), TokenKind::Word(_));
        if is_static && (first..self.at).any(is_name) {
            return self.items.stop(first, "what is static knows no locals");
        }
        if extents != found {
            return self.items.stop(start, "an array of another length");
        }
        self.mark(b';')?;
        let place = self.array(&extents, of, &values, false);
        self.bind(name, Thing::Place(ArrayPlace { reference: false, ..place }));
        Ok(())
    }

    /// `[[a, b], [c, d]]`, and the extents of that.
    fn rows(&mut self, of: TextFormat, format: TextFormat) -> Ran<(Vec<TextValue>, Vec<TextExtent>)> {
        let start = self.at;
        self.mark(b'[')?;
        let rows = self.listed(b']', |run| run.list(of, format))?;
        let length = rows.first().map_or(0, Vec::len);
        if rows.iter().any(|row| row.len() != length) {
            return self.items.stop(start, "rows of other lengths");
        }
        let extents = vec![TextExtent::Of(rows.len()), TextExtent::Of(length)];
        Ok((rows.concat(), extents))
    }

    /// `[a, b, c]`
    pub(super) fn list(&mut self, of: TextFormat, format: TextFormat) -> Ran<Vec<TextValue>> {
        self.mark(b'[')?;
        self.listed(b']', |run| run.number(of, format))
    }

    /// `for limb in 0..4 { … }`, `for limb in (0..4).take(core::hint::black_box(4)) { … }`, `for lane in 0..N { … }`
    pub(super) fn for_(&mut self, function: &TextFunction, format: TextFormat) -> Ran<()> {
        self.at += 1;
        let name = self.word()?;
        self.items.keyword(&mut self.at, t::IN)?;
        let start = self.at;
        let is_hidden = self.takes(b'(');
        if self.integer()? != 0 {
            return self.items.stop(start, "a loop that does not begin at 0");
        }
        self.these(". .")?;
        let count = self.locals.len();
        if !is_hidden && self.kind() == TokenKind::Word(t::N) && function.generics.contains(&t::N) {
            self.at += 1;
            self.bind(name, Thing::Lane);
            self.block(function, format)?;
            self.unbind(count);
            return Ok(());
        }
        let turns = self.integer()?;
        if is_hidden {
            self.these(") . take ( core : : hint : : black_box (")?;
            if self.integer()? != turns {
                return self.items.stop(start, "a loop of two lengths");
            }
            self.these(") )")?;
        }
        if !(1..=LONGEST).contains(&turns) {
            return self.items.stop(start, "a loop of that length");
        }
        let body = self.at;
        for turn in 0..turns {
            self.at = body;
            self.bind(name, Thing::Index(turn));
            self.block(function, format)?;
            self.unbind(count);
        }
        Ok(())
    }
}
