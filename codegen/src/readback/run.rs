//! Runs a function of the text over [`Values`]: the small part of Rust that bodies of ours are made of.
//!
//! Names mean what Rust's scopes say: a local shadows an earlier one and ends with its block, a loop over limbs runs once per limb, a
//! loop over lanes for one lane that stands for all, a call binds parameters by their place. Types are compared, so that no number
//! changes its format unnoticed.

use super::items::{Extent, Function, Items, Sort, Type};
use super::tokens::{self as t, Kind};
use super::values::{Format, Value, Values};
use super::Stop;
use rustc_hash::FxHashMap;
use std::rc::Rc;

/// So deep may functions call each other: a function over lanes, its body, parts.
const DEEPEST: usize = 4;
/// So many turns may a loop over limbs take.
const LONGEST: usize = 1 << 12;

type Ran<X> = Result<X, Stop>;

/// An array, by itself or behind a reference.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    array: u32,
    mutable: bool,
    reference: bool,
}

/// What a name stands for.
#[derive(Clone, Copy, Debug)]
pub enum Thing {
    /// A number.
    Number(Value),
    /// A local that waits for its number.
    Declared(Format),
    /// Numbers in an array.
    Place(Place),
    /// A reference to a type of that name around an array.
    Wrapped(u32, Place),
    /// Which limb.
    Index(usize),
    /// Which lane.
    Lane,
}

#[derive(Clone, Debug)]
struct Array {
    first: u32,
    extents: Vec<Extent>,
    format: Format,
}

#[derive(Clone, Copy, Debug)]
struct Local {
    name: u32,
    shadowed: u32,
    thing: Thing,
}

/// Names that modules make known.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known {
    /// The module `trig`.
    pub trig: bool,
    /// The module `fused`, and its functions `fma` and `fma_if`.
    pub fused: [bool; 3],
    /// The trait `Real`, the type `Dd`, and `number`.
    pub generic: bool,
}

/// A run through functions of a text.
pub struct Run<'a, 't> {
    items: &'a Items<'t>,
    values: &'a mut Values,
    functions: &'a mut FxHashMap<usize, Rc<Function>>,
    known: Known,
    module: usize,
    /// The format of functions that are not generic.
    plain: Format,
    at: usize,
    depth: usize,
    cells: Vec<Value>,
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

impl<'a, 't> Run<'a, 't> {
    /// Before a call.
    pub fn new(
        items: &'a Items<'t>,
        values: &'a mut Values,
        functions: &'a mut FxHashMap<usize, Rc<Function>>,
        words: usize,
        (module, known, plain): (usize, Known, Format),
    ) -> Run<'a, 't> {
        Run {
            items,
            values,
            functions,
            known,
            module,
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
    pub fn array(&mut self, extents: &[Extent], format: Format, numbers: &[Value], mutable: bool) -> Place {
        let first = self.cells.len() as u32;
        self.cells.extend_from_slice(numbers);
        self.written.resize(self.cells.len(), 0);
        self.arrays.push(Array { first, extents: extents.to_vec(), format });
        Place { array: self.arrays.len() as u32 - 1, mutable, reference: true }
    }

    /// What stands in an array now, and which token put each number there.
    pub fn numbers(&self, place: Place) -> (&[Value], &[u32]) {
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
        self.at = function.body;
        let format = if function.generics.contains(&t::T) { Format::Any } else { self.plain };
        self.block(&function, format)?;
        self.depth -= 1;
        self.unbind(count);
        (self.at, self.own, self.given) = (at, own, given);
        Ok(())
    }

    /// The signature of a function of the text.
    pub fn signature(&mut self, item: usize) -> Ran<Rc<Function>> {
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

    fn kind(&self) -> Kind {
        self.items.tokens[self.at].kind
    }

    fn ahead(&self, by: usize) -> Kind {
        self.items.tokens[self.at + by].kind
    }

    /// Whether a number stands here that does not say its format.
    fn begins_with_a_number(&self) -> bool {
        let at = self.at + usize::from(self.kind() == Kind::Mark(b'-'));
        self.items.tokens[at].kind == Kind::Number && !self.items.text_of(at).ends_with("_f32")
    }

    /// Whether there is a name before the bracket closes that is open here.
    fn names_a_value(&self) -> bool {
        let mut open = 1;
        for token in &self.items.tokens[self.at..] {
            match token.kind {
                Kind::Word(_) => return true,
                Kind::Mark(b'(') => open += 1,
                Kind::Mark(b')') => open -= 1,
                Kind::End => return false,
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
        if self.kind() == Kind::Mark(mark) {
            self.at += 1;
            return Ok(());
        }
        self.items.mark(&mut self.at, mark)
    }

    fn word(&mut self) -> Ran<u32> {
        self.items.word(&mut self.at)
    }

    fn integer(&mut self) -> Ran<usize> {
        self.items.integer(&mut self.at)
    }

    /// `{ … }`
    fn block(&mut self, function: &Function, format: Format) -> Ran<()> {
        let count = self.locals.len();
        let end = self.items.tokens[self.at].closes as usize;
        self.mark(b'{')?;
        while self.at < end {
            match self.kind() {
                Kind::Word(t::LET) => {
                    self.at += 1;
                    self.let_(format)?;
                }
                Kind::Word(t::STATIC) => {
                    self.at += 1;
                    self.array_of_limbs(format, true)?;
                }
                Kind::Word(t::FOR) => self.for_(function, format)?,
                Kind::Word(name) => {
                    let is_local = self.local(name).is_some();
                    match self.ahead(1) {
                        Kind::Mark(b'=') => self.assign_local(name, format)?,
                        Kind::Mark(b'[') if is_local => self.assign_place(format)?,
                        Kind::Mark(b'(' | b':') if !is_local => self.statement_call(function, end)?,
                        _ => return self.stop("a statement that is not known"),
                    }
                }
                _ => return self.stop("a statement that is not known"),
            }
        }
        for local in &self.locals[count..] {
            let Thing::Place(Place { array, mutable: true, reference: false }) = local.thing else { continue };
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

    fn assign_local(&mut self, name: u32, format: Format) -> Ran<()> {
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

    fn assign_place(&mut self, format: Format) -> Ran<()> {
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

    /// `name_part2(q, &mut live, tau);`, or the same as the last thing of a function.
    fn statement_call(&mut self, function: &Function, end: usize) -> Ran<()> {
        let start = self.at;
        let name = self.word()?;
        let Some(item) = self.items.named.get(&(self.module, Sort::Function, name)).copied() else {
            return self.items.stop(start, "a call of something that is not known");
        };
        let mut given = Vec::new();
        if self.kind() == Kind::Mark(b':') {
            self.mark(b':')?;
            self.mark(b':')?;
            self.mark(b'<')?;
            loop {
                let word = self.word()?;
                let fused_of_file = word == t::FUSED && self.known.fused[2];
                if !(function.generics.contains(&word) || fused_of_file) {
                    return self.items.stop(self.at - 1, "a name that stands for nothing here");
                }
                given.push(word);
                if self.kind() != Kind::Mark(b',') {
                    break;
                }
                self.at += 1;
            }
            self.mark(b'>')?;
        }
        let called = self.signature(item)?;
        // what is not given follows from the arguments: the number of lanes, the scalar
        let follows = given.is_empty() && !called.generics.contains(&t::FUSED);
        if !follows && given != called.generics {
            return self.items.stop(start, "other generic arguments than the function has parameters");
        }
        self.mark(b'(')?;
        let mut arguments = Vec::new();
        while self.kind() != Kind::Mark(b')') {
            arguments.push(self.argument()?);
            if self.kind() != Kind::Mark(b')') {
                self.mark(b',')?;
            }
        }
        self.at += 1;
        let behind = self.at;
        self.at = start;
        self.call(item, &arguments)?;
        self.at = behind;
        if self.at < end {
            self.mark(b';')?;
        }
        Ok(())
    }

    fn argument(&mut self) -> Ran<Thing> {
        let mut reference = None;
        if self.kind() == Kind::Mark(b'&') {
            self.at += 1;
            let mutable = self.kind() == Kind::Word(t::MUT);
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
                Ok(Thing::Place(Place { mutable, reference: true, ..place }))
            }
            (thing @ (Thing::Place(_) | Thing::Wrapped(..)), None) => Ok(thing),
            _ => self.items.stop(start, "an argument that is not known"),
        }
    }

    /// Behind `let`.
    fn let_(&mut self, format: Format) -> Ran<()> {
        match self.kind() {
            Kind::Mark(b'[') => {
                self.at += 1;
                self.pattern()?;
                let names = std::mem::take(&mut self.names);
                self.mark(b':')?;
                let start = self.at;
                let Type::Array(extents, of) = self.items.type_of(&mut self.at, format)? else {
                    return self.items.stop(start, "an array is expected here");
                };
                if extents != [Extent::Of(names.len())] {
                    return self.items.stop(start, "as many names as numbers are expected here");
                }
                if self.kind() == Kind::Mark(b';') {
                    self.at += 1;
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
            Kind::Mark(b'(') => self.sines(format),
            Kind::Word(t::MUT) => {
                self.at += 1;
                self.array_to_fill(format)
            }
            Kind::Word(name) => {
                if self.ahead(1) == Kind::Mark(b':') && self.ahead(2) == Kind::Mark(b'[') {
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
    fn pattern(&mut self) -> Ran<()> {
        self.names.clear();
        loop {
            let name = self.word()?;
            if name != t::UNDERSCORE && self.names.contains(&name) {
                return self.items.stop(self.at - 1, "a second local of that name");
            }
            self.names.push(name);
            if self.kind() == Kind::Mark(b']') {
                self.at += 1;
                return Ok(());
            }
            self.mark(b',')?;
        }
    }

    fn bind_all(&mut self, names: &[u32], values: &[Value]) -> Ran<()> {
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
    fn array_to_fill(&mut self, format: Format) -> Ran<()> {
        let name = self.word()?;
        self.mark(b'=')?;
        self.mark(b'[')?;
        let lanes = self.kind() == Kind::Mark(b'[');
        self.at += usize::from(lanes);
        let start = self.at;
        let value = self.number(format, format)?;
        if value != self.zero(format) && self.first_given() != Some(value) {
            return self
                .items
                .stop(start, "an array begins with zeros, or the first number that the function is given");
        }
        if lanes {
            self.mark(b';')?;
            self.items.keyword(&mut self.at, t::N)?;
            self.mark(b']')?;
        }
        self.mark(b';')?;
        let n = self.integer()?;
        self.mark(b']')?;
        self.mark(b';')?;
        if n > self.items.text.len() {
            return self.stop("an array that is too long");
        }
        let extents = [Extent::Of(n), Extent::Lanes];
        let place = self.array(&extents[..1 + usize::from(lanes)], format, &vec![value; n], true);
        self.bind(name, Thing::Place(Place { reference: false, ..place }));
        Ok(())
    }

    /// `x1: [f64; 4] = [a, b, c, d];` behind `let` or `static`.
    fn array_of_limbs(&mut self, format: Format, is_static: bool) -> Ran<()> {
        let name = self.word()?;
        self.mark(b':')?;
        let start = self.at;
        let Type::Array(extents, of) = self.items.type_of(&mut self.at, format)? else {
            return self.items.stop(start, "an array is expected here");
        };
        self.mark(b'=')?;
        let first = self.at;
        let values = self.list(of, format)?;
        let is_name = |at: usize| matches!(self.items.kind(at), Kind::Word(_));
        if is_static && (first..self.at).any(is_name) {
            return self.items.stop(first, "what is static knows no locals");
        }
        if extents != [Extent::Of(values.len())] {
            return self.items.stop(start, "an array of another length");
        }
        self.mark(b';')?;
        let place = self.array(&extents, of, &values, false);
        self.bind(name, Thing::Place(Place { reference: false, ..place }));
        Ok(())
    }

    /// `[a, b, c]`
    fn list(&mut self, of: Format, format: Format) -> Ran<Vec<Value>> {
        let mut values = Vec::new();
        self.mark(b'[')?;
        while self.kind() != Kind::Mark(b']') {
            values.push(self.number(of, format)?);
            if self.kind() != Kind::Mark(b']') {
                self.mark(b',')?;
            }
        }
        self.at += 1;
        Ok(values)
    }

    /// `for limb in 0..4 { … }`, `for lane in 0..N { … }`
    fn for_(&mut self, function: &Function, format: Format) -> Ran<()> {
        self.at += 1;
        let name = self.word()?;
        self.items.keyword(&mut self.at, t::IN)?;
        let start = self.at;
        if self.integer()? != 0 {
            return self.items.stop(start, "a loop that does not begin at 0");
        }
        self.mark(b'.')?;
        self.mark(b'.')?;
        let count = self.locals.len();
        if self.kind() == Kind::Word(t::N) && function.generics.contains(&t::N) {
            self.at += 1;
            self.bind(name, Thing::Lane);
            self.block(function, format)?;
            self.unbind(count);
            return Ok(());
        }
        let turns = self.integer()?;
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

    /// `(s, c) = trig::sin_cos_f64(q[2]);` and its like for several angles, behind `let`.
    fn sines(&mut self, format: Format) -> Ran<()> {
        self.mark(b'(')?;
        let several = self.kind() == Kind::Mark(b'[');
        let mut halves = [Vec::new(), Vec::new()];
        for (k, half) in halves.iter_mut().enumerate() {
            if several {
                self.mark(b'[')?;
                self.pattern()?;
                half.clone_from(&self.names);
            } else {
                half.push(self.word()?);
            }
            self.mark(if k == 0 { b',' } else { b')' })?;
        }
        self.mark(b'=')?;
        let start = self.at;
        let function = self.kernel(format)?;
        let (lanes, sums) = match function {
            "sin_cos" => (false, false),
            "sin_cos_of_sum" | "sin_cos_of_pair" => (false, true),
            "sin_cos_lanes" => (true, false),
            "sin_cos_lanes_of_sums" | "sin_cos_lanes_of_pairs" => (true, true),
            _ => return self.items.stop(start, "sine and cosine are expected here"),
        };
        if lanes != several {
            return self.items.stop(start, "sine and cosine of another number of angles");
        }
        self.mark(b'(')?;
        let mut angles = Vec::new();
        if lanes {
            self.mark(b'[')?;
            while self.kind() != Kind::Mark(b']') {
                angles.push(self.angle(sums, format)?);
                if self.kind() != Kind::Mark(b']') {
                    self.mark(b',')?;
                }
            }
            self.at += 1;
        } else {
            angles.push(self.angle(sums, format)?);
        }
        self.mark(b')')?;
        self.mark(b';')?;
        let (sines, cosines): (Vec<Value>, Vec<Value>) = angles.iter().map(|a| self.values.sin_cos(*a)).unzip();
        if halves[0].iter().any(|name| *name != t::UNDERSCORE && halves[1].contains(name)) {
            return self.items.stop(start, "a second local of that name");
        }
        for (names, values) in halves.iter().zip([sines, cosines]) {
            self.bind_all(names, &values)?;
        }
        Ok(())
    }

    /// The first number of [`Run::given`].
    fn first_given(&self) -> Option<Value> {
        self.cells.get(self.arrays[self.given? as usize].first as usize).copied()
    }

    fn zero(&mut self, format: Format) -> Value {
        match format {
            Format::Any => self.values.long(0.0, 0.0),
            format => self.values.constant(0.0, format),
        }
    }

    /// An angle, alone or as a sum with what its rounding lost.
    fn angle(&mut self, sums: bool, format: Format) -> Ran<Value> {
        if !sums {
            let value = self.number(format, format)?;
            return Ok(self.values.angle([value]));
        }
        let start = self.at;
        if self.kind() == Kind::Mark(b'[') {
            let pair = self.list(format, format)?;
            let zero = self.zero(format);
            return match pair.as_slice() {
                [angle, tail] if *tail == zero => Ok(self.values.angle([*angle])),
                _ => self.items.stop(start, "an angle and nothing that it lost are expected here"),
            };
        }
        if self.kernel(format)? != "sum_of_angles" {
            return self.items.stop(start, "a sum of angles is expected here");
        }
        self.mark(b'(')?;
        if format == Format::Any {
            self.mark(b'&')?;
        }
        let terms = self.list(format, format)?;
        self.mark(b')')?;
        if terms.is_empty() {
            return self.items.stop(start, "a sum of nothing");
        }
        Ok(self.values.angle(terms))
    }

    /// Takes the path of a function of the kernel in this format: its name without the format.
    fn kernel(&mut self, format: Format) -> Ran<&'t str> {
        let start = self.at;
        let module = self.word()?;
        self.mark(b':')?;
        self.mark(b':')?;
        let at = self.at;
        self.word()?;
        let name = self.items.text_of(at);
        let suffix = match format {
            Format::F64 => "_f64",
            Format::F32 => "_f32",
            Format::Any => "",
        };
        let known = match module {
            _ if self.local(module).is_some() => false,
            t::TRIG => self.known.trig && format != Format::Any,
            t::FUSED_MODULE => self.known.fused[0] && format != Format::Any,
            t::T => self.known.generic && format == Format::Any,
            _ => false,
        };
        let Some(function) = name.strip_suffix(suffix).filter(|_| known) else {
            return self.items.stop(start, "a function that is not known");
        };
        if module != t::FUSED_MODULE {
            return Ok(function);
        }
        // `sin_cos_if_f64::<FUSED>` is told whether to fuse
        let told = |function: &str| matches!(function, "sin_cos_if" | "sin_cos_of_sum_if");
        let function = match function {
            "sin_cos_if" => "sin_cos",
            "sin_cos_of_sum_if" => "sin_cos_of_sum",
            "sin_cos" | "sin_cos_of_sum" | "sin_cos_lanes" | "sin_cos_lanes_of_sums" => function,
            _ => return self.items.stop(start, "a function that is not known"),
        };
        if told(name.strip_suffix(suffix).unwrap_or_default()) {
            self.told_whether_to_fuse()?;
        }
        Ok(function)
    }

    /// `::<FUSED>`
    fn told_whether_to_fuse(&mut self) -> Ran<()> {
        self.mark(b':')?;
        self.mark(b':')?;
        self.mark(b'<')?;
        self.items.keyword(&mut self.at, t::FUSED)?;
        self.mark(b'>')
    }

    /// A sum, in the format `of`; `format` is that of the function.
    fn number(&mut self, of: Format, format: Format) -> Ran<Value> {
        let start = self.at;
        let mut sum = self.product(of, format)?;
        while let Kind::Mark(mark @ (b'+' | b'-')) = self.kind() {
            self.at += 1;
            let term = self.product(of, format)?;
            sum = self.values.add(sum, if mark == b'-' { term.negated() } else { term });
            self.demand(sum, start)?;
        }
        Ok(sum)
    }

    fn product(&mut self, of: Format, format: Format) -> Ran<Value> {
        let start = self.at;
        let mut product = self.signed(of, format)?;
        while let Kind::Mark(mark @ (b'*' | b'/')) = self.kind() {
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
    fn demand(&self, value: Value, start: usize) -> Ran<()> {
        if self.values.is_wanted(value) {
            return Ok(());
        }
        let text =
            &self.items.text[self.items.tokens[start].start as usize..self.items.tokens[self.at - 1].end as usize];
        self.items.stop(start, format!("no program computes `{text}`"))
    }

    fn signed(&mut self, of: Format, format: Format) -> Ran<Value> {
        if self.kind() == Kind::Mark(b'-') {
            self.at += 1;
            return Ok(self.signed(of, format)?.negated());
        }
        self.atom(of, format)
    }

    fn atom(&mut self, of: Format, format: Format) -> Ran<Value> {
        let start = self.at;
        let value = match self.kind() {
            Kind::Number => match of {
                Format::Any => return self.stop("a number of no format"),
                of => {
                    let x = self.literal(of)?;
                    self.values.constant(x, of)
                }
            },
            Kind::Mark(b'(') => {
                let close = self.items.tokens[start].closes as usize;
                let is_cast = self.ahead(1) == Kind::Mark(b'(')
                    && self.items.kind(self.items.tokens[start + 1].closes as usize + 1) == Kind::Word(t::AS);
                self.at += 1;
                if is_cast && (of, format) == (Format::F32, Format::F32) {
                    self.at += 1;
                    let value = self.number(Format::F64, format)?;
                    self.mark(b')')?;
                    self.items.keyword(&mut self.at, t::AS)?;
                    self.items.keyword(&mut self.at, t::F32)?;
                    self.mark(b')')?;
                    let rounded = self.values.rounded(value);
                    self.demand(rounded, start)?;
                    return Ok(rounded);
                }
                let value = self.number(of, format)?;
                self.mark(b')')?;
                debug_assert!(self.at == close + 1, "an expression ends at its bracket");
                value
            }
            Kind::Word(name) => match self.local(name) {
                Some(k) => match self.locals[k].thing {
                    Thing::Number(value) => {
                        self.at += 1;
                        value
                    }
                    Thing::Wrapped(..) if format == Format::Any => return self.stop("a number of another format"),
                    Thing::Place(_) | Thing::Wrapped(..) => {
                        let (cell, ..) = self.cell()?;
                        match self.cells[cell] {
                            Value::NONE => return self.items.stop(start, "a result is read"),
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
    fn literal(&mut self, of: Format) -> Ran<f64> {
        let text = self.items.text_of(self.at);
        let (digits, suffix) = match text.split_once('_') {
            Some((digits, suffix)) => (digits, Some(suffix)),
            None => (text, None),
        };
        let is_float = digits.contains(['.', 'e']);
        let fits = match suffix {
            None => true,
            Some("f32") => of == Format::F32,
            Some("f64") => of == Format::F64,
            Some(_) => false,
        };
        let number = match of {
            Format::F32 => digits.parse::<f32>().ok().map(f64::from),
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
    fn call_of_number(&mut self, name: u32, of: Format, format: Format) -> Ran<Value> {
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
            t::T if format == Format::Any && self.known.generic && self.ahead(3) == Kind::Word(t::ZERO) => {
                self.at += 1;
                self.mark(b':')?;
                self.mark(b':')?;
                self.at += 1;
                self.mark(b'(')?;
                self.mark(b')')?;
                Ok(self.values.long(0.0, 0.0))
            }
            t::T if format == Format::Any && self.known.generic && self.ahead(3) == Kind::Word(t::CONSTANT) => {
                // T::constant(Dd::from(f64::from(body.0[3])))
                self.at += 1;
                self.mark(b':')?;
                self.mark(b':')?;
                self.at += 1;
                self.mark(b'(')?;
                for word in [t::DD, t::F64] {
                    self.items.keyword(&mut self.at, word)?;
                    self.mark(b':')?;
                    self.mark(b':')?;
                    self.items.keyword(&mut self.at, t::FROM)?;
                    self.mark(b'(')?;
                }
                let (cell, _, mutable) = self.cell()?;
                (0..3).try_for_each(|_| self.mark(b')'))?;
                if mutable {
                    return self.items.stop(start, "a constant that may change");
                }
                Ok(self.cells[cell])
            }
            t::NUMBER if format == Format::Any && self.known.generic => {
                self.at += 1;
                self.mark(b':')?;
                self.mark(b':')?;
                self.mark(b'<')?;
                self.items.keyword(&mut self.at, t::T)?;
                self.mark(b'>')?;
                self.mark(b'(')?;
                let high = self.signed_literal()?;
                self.mark(b',')?;
                let low = self.signed_literal()?;
                self.mark(b')')?;
                Ok(self.values.long(high, low))
            }
            // f64::from(x), of x in f32
            t::F64 if (of, format) == (Format::F64, Format::F32) => {
                self.at += 1;
                self.mark(b':')?;
                self.mark(b':')?;
                self.items.keyword(&mut self.at, t::FROM)?;
                self.mark(b'(')?;
                // numbers alone would be of f64; beside a value they have its format
                if self.begins_with_a_number() && !self.names_a_value() {
                    return self.stop("a number of no format");
                }
                let value = self.number(Format::F32, format)?;
                self.mark(b')')?;
                let widened = self.values.widened(value);
                self.demand(widened, start)?;
                Ok(widened)
            }
            t::TRIG | t::T if self.ahead(1) == Kind::Mark(b':') => {
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

    fn signed_literal(&mut self) -> Ran<f64> {
        let negative = self.kind() == Kind::Mark(b'-');
        self.at += usize::from(negative);
        if self.kind() != Kind::Number {
            return self.stop("a number is expected here");
        }
        let x = self.literal(Format::F64)?;
        Ok(if negative { -x } else { x })
    }

    /// `q[3]`, `h[2][lane]`, `body.0[7]`: its cell, its format, and whether it may be written.
    fn cell(&mut self) -> Ran<(usize, Format, bool)> {
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
            match (*extent, self.items.kind(at)) {
                (Extent::Of(n), Kind::Number) => {
                    let index = self.items.integer(&mut at)?;
                    if index >= n {
                        return self.items.stop(at - 1, "an index beyond the end");
                    }
                    cell = cell * n + index;
                }
                (extent, Kind::Word(name)) => {
                    let thing = self.local(name).map(|k| self.locals[k].thing);
                    match (extent, thing) {
                        (Extent::Of(n), Some(Thing::Index(index))) if index < n => cell = cell * n + index,
                        (Extent::Lanes, Some(Thing::Lane)) => {}
                        _ => return self.items.stop(at, "an index of another kind"),
                    }
                    at += 1;
                }
                _ => return self.items.stop(at, "an index is expected here"),
            }
            self.items.mark(&mut at, b']')?;
        }
        self.at = at;
        Ok((first as usize + cell, format, place.mutable))
    }
}

/// How many numbers an array has per lane.
pub fn count_of(extents: &[Extent]) -> usize {
    let of = |extent: &Extent| match extent {
        Extent::Of(n) => *n,
        Extent::Lanes => 1,
    };
    extents.iter().map(of).product()
}
