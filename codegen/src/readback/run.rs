//! Runs a function of the text over [`Values`]: the small part of Rust that bodies of ours are made of.
//!
//! Names mean what Rust's scopes say: a local shadows an earlier one and ends with its block, a loop over limbs runs once per limb, a
//! loop over lanes for one lane that stands for all, a call binds parameters by their place. Types are compared, so that no number
//! changes its format unnoticed.

use super::items::{Items, TextExtent, TextFunction, Type};
use super::tokens::{self as t, TokenKind};
use super::values::{TextFormat, TextValue, Values};
use super::ReadingStop;
use rustc_hash::FxHashMap;
use std::rc::Rc;

mod numbers;
mod sines;
mod statements;

/// So deep may functions call each other: a function over lanes, its body, parts.
const DEEPEST: usize = 4;
/// So many turns may a loop over limbs take.
const LONGEST: usize = 1 << 12;

type Ran<X> = Result<X, ReadingStop>;

/// An array, by itself or behind a reference.
#[derive(Clone, Copy, Debug)]
pub struct ArrayPlace {
    array: u32,
    mutable: bool,
    reference: bool,
}

/// What a name stands for.
#[derive(Clone, Copy, Debug)]
pub enum Thing {
    /// A number.
    Number(TextValue),
    /// A local that waits for its number.
    Declared(TextFormat),
    /// Numbers in an array.
    Place(ArrayPlace),
    /// A reference to a type of that name around an array.
    Wrapped(u32, ArrayPlace),
    /// Which limb.
    Index(usize),
    /// Which lane.
    Lane,
}

#[derive(Clone, Debug)]
struct Array {
    first: u32,
    extents: Vec<TextExtent>,
    format: TextFormat,
}

#[derive(Clone, Copy, Debug)]
struct Local {
    name: u32,
    shadowed: u32,
    thing: Thing,
}

/// Names that modules make known.
#[derive(Clone, Copy, Debug, Default)]
pub struct KnownNames {
    /// The module `trig`.
    pub trig: bool,
    /// The module `short_sines`.
    pub short_sines: bool,
    /// The module `fused`, and its functions `fma` and `fma_if`.
    pub fused: [bool; 3],
    /// The trait `Real`, the type `Dd`, and `number`.
    pub generic: bool,
}

/// A run through functions of a text.
pub struct Execution<'a, 't> {
    items: &'a Items<'t>,
    values: &'a mut Values,
    functions: &'a mut FxHashMap<usize, Rc<TextFunction>>,
    /// What each module knows.
    known_in: &'a FxHashMap<usize, KnownNames>,
    known: KnownNames,
    module: usize,
    /// The format of functions that are not generic.
    plain: TextFormat,
    at: usize,
    depth: usize,
    cells: Vec<TextValue>,
    written: Vec<u32>,
    arrays: Vec<Array>,
    locals: Vec<Local>,
    /// Per word, one more than the local that it names.
    named: Vec<u32>,
    /// Locals before this one are another function's.
    own: usize,
    /// The first array that the function is given and uses.
    given: Option<u32>,
    names: Vec<u32>,
}

impl<'a, 't> Execution<'a, 't> {
    /// Before a call.
    pub fn new(
        items: &'a Items<'t>,
        values: &'a mut Values,
        functions: &'a mut FxHashMap<usize, Rc<TextFunction>>,
        words: usize,
        (known_in, plain): (&'a FxHashMap<usize, KnownNames>, TextFormat),
    ) -> Execution<'a, 't> {
        Execution {
            items,
            values,
            functions,
            known_in,
            known: KnownNames::default(),
            module: 0,
            plain,
            at: 0,
            depth: 0,
            cells: Vec::new(),
            written: Vec::new(),
            arrays: Vec::new(),
            locals: Vec::new(),
            named: vec![0; words],
            own: 0,
            given: None,
            names: Vec::new(),
        }
    }

    /// An array of these numbers, which a function may be given.
    pub fn array(
        &mut self,
        extents: &[TextExtent],
        format: TextFormat,
        numbers: &[TextValue],
        mutable: bool,
    ) -> ArrayPlace {
        let first = self.cells.len() as u32;
        self.cells.extend_from_slice(numbers);
        self.written.resize(self.cells.len(), 0);
        self.arrays.push(Array { first, extents: extents.to_vec(), format });
        ArrayPlace { array: self.arrays.len() as u32 - 1, mutable, reference: true }
    }

    /// What stands in an array now, and which token put each number there.
    pub fn numbers(&self, place: ArrayPlace) -> (&[TextValue], &[u32]) {
        let array = &self.arrays[place.array as usize];
        let range = array.first as usize..array.first as usize + count_of(&array.extents);
        (&self.cells[range.clone()], &self.written[range])
    }

    /// Calls a function of the text.
    pub fn call(&mut self, item: usize, arguments: &[Thing]) -> Ran<()> {
        let items = self.items;
        if self.depth == DEEPEST {
            return items.stop(self.at, "functions call each other without end");
        }
        items.all[item].claimed.set(true);
        let function = self.signature(item)?;
        if function.parameters.len() != arguments.len() {
            return items.stop(self.at, "a call with another number of arguments");
        }
        let (at, own, given, count) = (self.at, self.own, self.given, self.locals.len());
        let (module, known) = (self.module, self.known);
        for (parameter, argument) in function.parameters.iter().zip(arguments) {
            if !self.fits(*argument, &parameter.of) {
                return items.stop(self.at, "an argument of another type");
            }
        }
        self.own = count;
        self.given = function.parameters.iter().zip(arguments).find_map(|(p, argument)| match argument {
            Thing::Place(place) if p.used => Some(place.array),
            _ => None,
        });
        for (parameter, argument) in function.parameters.iter().zip(arguments) {
            self.bind(parameter.name, *argument);
        }
        self.depth += 1;
        self.module = items.all[item].module;
        self.known = self.known_in.get(&self.module).copied().unwrap_or_default();
        self.at = function.body;
        let format = if function.generics.contains(&t::T) { TextFormat::Any } else { self.plain };
        self.block(&function, format)?;
        self.depth -= 1;
        self.unbind(count);
        (self.at, self.own, self.given) = (at, own, given);
        (self.module, self.known) = (module, known);
        Ok(())
    }

    /// The signature of a function of the text.
    pub fn signature(&mut self, item: usize) -> Ran<Rc<TextFunction>> {
        if let Some(function) = self.functions.get(&item) {
            return Ok(function.clone());
        }
        let function = Rc::new(self.items.function(&self.items.all[item], self.plain)?);
        self.functions.insert(item, function.clone());
        Ok(function)
    }

    fn fits(&self, thing: Thing, of: &Type) -> bool {
        let (wanted_mutable, of) = match of {
            Type::To(mutable, of) => (*mutable, &**of),
            _ => return false,
        };
        match (thing, of) {
            (Thing::Place(place), Type::Array(extents, format)) => {
                let array = &self.arrays[place.array as usize];
                place.reference
                    && (place.mutable || !wanted_mutable)
                    && array.extents == *extents
                    && array.format == *format
            }
            (Thing::Wrapped(name, _), Type::Named(wanted)) => name == *wanted && !wanted_mutable,
            _ => false,
        }
    }

    fn bind(&mut self, name: u32, thing: Thing) {
        let shadowed = self.named[name as usize];
        self.locals.push(Local { name, shadowed, thing });
        self.named[name as usize] = self.locals.len() as u32;
    }

    fn unbind(&mut self, count: usize) {
        for local in self.locals.drain(count..).rev() {
            self.named[local.name as usize] = local.shadowed;
        }
    }

    fn local(&self, name: u32) -> Option<usize> {
        (self.named[name as usize] as usize).checked_sub(1).filter(|k| *k >= self.own)
    }

    fn kind(&self) -> TokenKind {
        self.items.tokens[self.at].kind
    }

    fn ahead(&self, by: usize) -> TokenKind {
        self.items.tokens[self.at + by].kind
    }

    /// Whether a number stands here that does not say its format.
    fn begins_with_a_number(&self) -> bool {
        let at = self.at + usize::from(self.kind() == TokenKind::Mark(b'-'));
        self.items.tokens[at].kind == TokenKind::Number && !self.items.text_of(at).ends_with("_f32")
    }

    /// Whether there is a name before the bracket closes that is open here.
    fn names_a_value(&self) -> bool {
        let mut open = 1;
        for token in &self.items.tokens[self.at..] {
            match token.kind {
                TokenKind::Word(_) => return true,
                TokenKind::Mark(b'(') => open += 1,
                TokenKind::Mark(b')') => open -= 1,
                TokenKind::End => return false,
                _ => {}
            }
            if open == 0 {
                return false;
            }
        }
        false
    }

    fn stop<X>(&self, what: &str) -> Ran<X> {
        self.items.stop(self.at, what)
    }

    fn mark(&mut self, mark: u8) -> Ran<()> {
        match self.takes(mark) {
            true => Ok(()),
            false => self.items.mark(&mut self.at, mark),
        }
    }

    fn these(&mut self, expected: &str) -> Ran<()> {
        self.items.these(&mut self.at, expected)
    }

    /// Takes this mark, if it stands here.
    fn takes(&mut self, mark: u8) -> bool {
        let is_here = self.kind() == TokenKind::Mark(mark);
        self.at += usize::from(is_here);
        is_here
    }

    /// What stands between commas, up to this mark.
    fn listed<X>(&mut self, close: u8, mut each: impl FnMut(&mut Self) -> Ran<X>) -> Ran<Vec<X>> {
        let mut all = Vec::new();
        while !self.takes(close) {
            all.push(each(self)?);
            if self.kind() != TokenKind::Mark(close) {
                self.mark(b',')?;
            }
        }
        Ok(all)
    }

    fn word(&mut self) -> Ran<u32> {
        self.items.word(&mut self.at)
    }

    fn integer(&mut self) -> Ran<usize> {
        self.items.integer(&mut self.at)
    }
}

/// How many numbers an array has per lane.
pub fn count_of(extents: &[TextExtent]) -> usize {
    let of = |extent: &TextExtent| match extent {
        TextExtent::Of(n) => *n,
        TextExtent::Lanes => 1,
    };
    extents.iter().map(of).product()
}
