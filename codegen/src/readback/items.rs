//! The items of a text: modules, functions with their signatures, and what else there is, each to be claimed once by what knows it.

use super::tokens::{self as t, Token, TokenKind, Words};
use super::values::TextFormat;
use super::ReadingStop;
use rustc_hash::FxHashMap;
use std::cell::Cell;

/// How many there are in a dimension of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextExtent {
    /// So many.
    Of(usize),
    /// One per lane.
    Lanes,
}

/// A type of a parameter or local.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Type {
    /// A number.
    Number(TextFormat),
    /// An array of numbers, extents outermost first.
    Array(Vec<TextExtent>, TextFormat),
    /// A type by its name.
    Named(u32),
    /// A reference, mutable or not.
    To(bool, Box<Type>),
}

/// A parameter of a function.
#[derive(Clone, Debug)]
pub struct TextParameter {
    /// The word of its identifier.
    pub name: u32,
    /// Its type.
    pub of: Type,
    /// Whether its name says that it is used.
    pub used: bool,
}

/// A function's signature and where its body is.
#[derive(Clone, Debug)]
pub struct TextFunction {
    /// Constant parameters `N` and `FUSED`, in order, or `T`.
    pub generics: Vec<u32>,
    /// Its parameters.
    pub parameters: Vec<TextParameter>,
    /// Token of the brace that opens the body.
    pub body: usize,
}

/// What kind of item it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sort {
    /// `fn`
    Function,
    /// `struct`
    Struct,
    /// `enum`
    Enum,
    /// `const`
    Constant,
    /// `impl Type`
    Impl,
    /// `impl Trait for Type`
    ImplOf,
    /// `use`
    Use,
    /// `mod` of given text
    Given,
}

/// An item.
#[derive(Clone, Debug)]
pub struct TextItem {
    /// The module in which it stands.
    pub module: usize,
    /// What it is.
    pub sort: Sort,
    /// Its name; of an `impl`, that of the type.
    pub name: u32,
    /// First token, at `pub` if that is there.
    pub start: usize,
    /// Behind its last token.
    pub end: usize,
    /// Whether it stands in `with_threads!`.
    pub threads: bool,
    /// Whether something knew it.
    pub claimed: Cell<bool>,
}

/// A module: its parent, and its name.
#[derive(Clone, Copy, Debug)]
pub struct TextModule {
    /// The module around it.
    pub parent: usize,
    /// The word of its identifier.
    pub name: u32,
}

/// A text in tokens and items.
#[derive(Clone, Debug)]
pub struct Items<'t> {
    /// The text.
    pub text: &'t str,
    /// Its tokens.
    pub tokens: Vec<Token>,
    /// Its modules; the first is the text itself.
    pub modules: Vec<TextModule>,
    /// Its items.
    pub all: Vec<TextItem>,
    /// Items with names, by module, sort and name.
    pub named: FxHashMap<(usize, Sort, u32), usize>,
}

type ParsedItems<X> = Result<X, ReadingStop>;

impl<'t> Items<'t> {
    /// The items of a text.
    pub fn read(text: &'t str, words: &mut Words) -> ParsedItems<Items<'t>> {
        let tokens = t::tokens(text, words).map_err(|(at, what)| ReadingStop::at(at, what))?;
        let modules = vec![TextModule { parent: 0, name: t::UNDERSCORE }];
        let mut items = Items { text, tokens, modules, all: Vec::new(), named: FxHashMap::default() };
        let end = items.tokens.len() - 1;
        items.module(0, 0, end, false)?;
        Ok(items)
    }

    /// The token at a place.
    pub fn kind(&self, at: usize) -> TokenKind {
        self.tokens[at].kind
    }

    /// The text of a token.
    pub fn text_of(&self, at: usize) -> &'t str {
        &self.text[self.tokens[at].start as usize..self.tokens[at].end as usize]
    }

    /// A complaint about a token.
    pub fn stop<X>(&self, at: usize, what: impl Into<String>) -> ParsedItems<X> {
        Err(ReadingStop::at(self.tokens[at].start as usize, what))
    }

    /// Takes this mark.
    pub fn mark(&self, at: &mut usize, mark: u8) -> ParsedItems<()> {
        if self.kind(*at) == TokenKind::Mark(mark) {
            *at += 1;
            return Ok(());
        }
        self.stop(*at, format!("`{}` is missing here", char::from(mark)))
    }

    /// Takes this word.
    pub fn keyword(&self, at: &mut usize, word: u32) -> ParsedItems<()> {
        if self.kind(*at) == TokenKind::Word(word) {
            *at += 1;
            return Ok(());
        }
        self.stop(*at, "another word is expected here")
    }

    /// Takes these words and marks, which spaces part.
    pub fn these(&self, at: &mut usize, expected: &str) -> ParsedItems<()> {
        for text in expected.split(' ') {
            if self.text_of(*at) != text {
                return self.stop(*at, format!("`{text}` is expected here"));
            }
            *at += 1;
        }
        Ok(())
    }

    /// Takes any word.
    pub fn word(&self, at: &mut usize) -> ParsedItems<u32> {
        match self.kind(*at) {
            TokenKind::Word(word) => {
                *at += 1;
                Ok(word)
            }
            _ => self.stop(*at, "a name is missing here"),
        }
    }

    /// Takes a whole number.
    pub fn integer(&self, at: &mut usize) -> ParsedItems<usize> {
        let is_number = self.kind(*at) == TokenKind::Number;
        match self.text_of(*at).parse().ok().filter(|_| is_number) {
            Some(n) => {
                *at += 1;
                Ok(n)
            }
            None => self.stop(*at, "a whole number is missing here"),
        }
    }

    /// Behind attributes that change no meaning.
    fn attributes(&self, mut at: usize) -> ParsedItems<usize> {
        while self.kind(at) == TokenKind::Mark(b'#') {
            at += 1;
            if self.kind(at) != TokenKind::Mark(b'[') {
                return self.stop(at, "an attribute of the file");
            }
            match self.kind(at + 1) {
                TokenKind::Word(t::ALLOW | t::DOC | t::INLINE | t::DERIVE | t::REPR | t::MUST_USE) => {}
                _ => return self.stop(at + 1, "an attribute that is not known"),
            }
            at = self.tokens[at].closes as usize + 1;
        }
        Ok(at)
    }

    /// The items of a module between two tokens.
    fn module(&mut self, module: usize, start: usize, end: usize, threads: bool) -> ParsedItems<()> {
        let mut at = start;
        while at < end {
            at = self.attributes(at)?;
            let start = at;
            if self.kind(at) == TokenKind::Word(t::PUB) {
                at += 1;
            }
            let (sort, name) = match self.kind(at) {
                TokenKind::Word(t::USE) => (Sort::Use, t::UNDERSCORE),
                TokenKind::Word(t::MOD) => {
                    let mut inner = at + 1;
                    let name = self.word(&mut inner)?;
                    let open = inner;
                    self.mark(&mut inner, b'{')?;
                    at = self.tokens[open].closes as usize + 1;
                    let is_given = matches!(name, t::TRIG | t::SHORT_SINES | t::BATCH | t::FUSED_MODULE | t::FIXED);
                    if self.is_root(module) && is_given {
                        self.push(TextItem::new(module, Sort::Given, name, start, at, threads))?;
                    } else {
                        self.modules.push(TextModule { parent: module, name });
                        self.module(self.modules.len() - 1, inner, at - 1, threads)?;
                    }
                    continue;
                }
                TokenKind::Word(t::CONST) => (Sort::Constant, self.word(&mut (at + 1))?),
                TokenKind::Word(t::STRUCT) => (Sort::Struct, self.word(&mut (at + 1))?),
                TokenKind::Word(t::ENUM) => (Sort::Enum, self.word(&mut (at + 1))?),
                TokenKind::Word(t::FN) => (Sort::Function, self.word(&mut (at + 1))?),
                TokenKind::Word(t::IMPL) => {
                    at += 1;
                    if self.kind(at) == TokenKind::Mark(b'<') {
                        at = self.behind_generics(at)?;
                    }
                    // the last word of the path, or the one behind `for`
                    let (mut name, mut sort) = (t::UNDERSCORE, Sort::Impl);
                    while self.kind(at) != TokenKind::Mark(b'{') {
                        match self.kind(at) {
                            TokenKind::Word(t::FOR) => sort = Sort::ImplOf,
                            TokenKind::Word(word) => name = word,
                            TokenKind::Mark(b'<') => {
                                at = self.behind_generics(at)?;
                                continue;
                            }
                            TokenKind::Mark(b':') => {}
                            _ => return self.stop(at, "an `impl` that is not known"),
                        }
                        at += 1;
                    }
                    (sort, name)
                }
                TokenKind::Mark(b':') => {
                    let is_ours = self.kind(at + 2) == TokenKind::Word(t::STRAIGHTLINE)
                        && self.kind(at + 5) == TokenKind::Word(t::WITH_THREADS)
                        && [(1, b':'), (3, b':'), (4, b':'), (6, b'!'), (7, b'{')]
                            .iter()
                            .all(|(k, mark)| self.kind(at + k) == TokenKind::Mark(*mark));
                    if !is_ours || threads || start != at {
                        return self.stop(at, "a macro that is not known");
                    }
                    let close = self.tokens[at + 7].closes as usize;
                    self.module(module, at + 8, close, true)?;
                    at = close + 1;
                    continue;
                }
                _ => return self.stop(at, "an item that is not known"),
            };
            // to the brace that closes it, or to the semicolon
            at = self.end_of_item(at, sort)?;
            self.push(TextItem::new(module, sort, name, start, at, threads))?;
        }
        Ok(())
    }

    /// Whether a module is the text itself, or the same in another scalar.
    pub fn is_root(&self, module: usize) -> bool {
        let TextModule { parent, name } = self.modules[module];
        module == 0 || parent == 0 && matches!(name, t::SINGLE | t::DOUBLE)
    }

    fn push(&mut self, item: TextItem) -> ParsedItems<()> {
        let key = (item.module, item.sort, item.name);
        let number = self.all.len();
        if item.sort != Sort::Use && self.named.insert(key, number).is_some() {
            return self.stop(item.start, "a second item of that name");
        }
        self.all.push(item);
        Ok(())
    }

    fn end_of_item(&self, mut at: usize, sort: Sort) -> ParsedItems<usize> {
        let braces_end = !matches!(sort, Sort::Use | Sort::Constant);
        loop {
            match self.kind(at) {
                TokenKind::End => return self.stop(at, "an item without end"),
                TokenKind::Mark(b';') => return Ok(at + 1),
                TokenKind::Mark(b'{') if braces_end => return Ok(self.tokens[at].closes as usize + 1),
                TokenKind::Mark(b'(' | b'[' | b'{') => at = self.tokens[at].closes as usize + 1,
                TokenKind::Mark(b')' | b']' | b'}') => return self.stop(at, "an item without end"),
                _ => at += 1,
            }
        }
    }

    fn behind_generics(&self, mut at: usize) -> ParsedItems<usize> {
        let mut depth = 0;
        loop {
            match self.kind(at) {
                TokenKind::Mark(b'<') => depth += 1,
                TokenKind::Mark(b'>') => depth -= 1,
                TokenKind::End => return self.stop(at, "`>` is missing here"),
                _ => {}
            }
            at += 1;
            if depth == 0 {
                return Ok(at);
            }
        }
    }

    /// The place of an item, by its name.
    pub fn find_place(&self, module: usize, sort: Sort, name: u32) -> Option<usize> {
        self.named.get(&(module, sort, name)).copied()
    }

    /// An item by its name.
    pub fn find(&self, module: usize, sort: Sort, name: u32) -> Option<&TextItem> {
        self.find_place(module, sort, name).map(|k| &self.all[k])
    }

    /// A module in a module.
    pub fn inner(&self, parent: usize, name: u32) -> Option<usize> {
        (1..self.modules.len()).find(|m| self.modules[*m].parent == parent && self.modules[*m].name == name)
    }

    /// The signature of a function.
    pub fn function(&self, item: &TextItem, format: TextFormat) -> ParsedItems<TextFunction> {
        let mut at = item.start + usize::from(self.kind(item.start) == TokenKind::Word(t::PUB)) + 2;
        let mut generics = Vec::new();
        let mut format = format;
        if self.kind(at) == TokenKind::Mark(b'<') {
            at += 1;
            while self.kind(at) != TokenKind::Mark(b'>') {
                match self.word(&mut at)? {
                    t::CONST => {
                        let name = self.word(&mut at)?;
                        self.mark(&mut at, b':')?;
                        let kind = self.word(&mut at)?;
                        if !matches!((name, kind), (t::N, t::USIZE) | (t::FUSED, t::BOOL)) {
                            return self.stop(at - 1, "a constant parameter that is not known");
                        }
                        generics.push(name);
                    }
                    t::T => {
                        self.mark(&mut at, b':')?;
                        self.keyword(&mut at, t::REAL)?;
                        generics.push(t::T);
                        format = TextFormat::Any;
                    }
                    _ => return self.stop(at - 1, "a type parameter that is not known"),
                }
                if self.kind(at) != TokenKind::Mark(b'>') {
                    self.mark(&mut at, b',')?;
                }
            }
            at += 1;
        }
        let end = self.tokens[at].closes as usize;
        self.mark(&mut at, b'(')?;
        let mut parameters: Vec<TextParameter> = Vec::new();
        while at < end {
            let name = self.word(&mut at)?;
            let used = !self.text_of(at - 1).starts_with('_');
            if parameters.iter().any(|p| p.name == name) {
                return self.stop(at - 1, "a second parameter of that name");
            }
            self.mark(&mut at, b':')?;
            let of = self.type_of(&mut at, format)?;
            parameters.push(TextParameter { name, of, used });
            if at < end {
                self.mark(&mut at, b',')?;
            }
        }
        at += 1;
        if self.kind(at) != TokenKind::Mark(b'{') {
            return self.stop(at, "a function of another kind");
        }
        Ok(TextFunction { generics, parameters, body: at })
    }

    /// Takes a type; `T` is the format of a generic function.
    pub fn type_of(&self, at: &mut usize, format: TextFormat) -> ParsedItems<Type> {
        match self.kind(*at) {
            TokenKind::Mark(b'&') => {
                *at += 1;
                let mutable = self.kind(*at) == TokenKind::Word(t::MUT);
                *at += usize::from(mutable);
                Ok(Type::To(mutable, Box::new(self.type_of(at, format)?)))
            }
            TokenKind::Mark(b'[') => {
                *at += 1;
                let inner = self.type_of(at, format)?;
                self.mark(at, b';')?;
                let extent = match self.kind(*at) {
                    TokenKind::Word(t::N) => {
                        *at += 1;
                        TextExtent::Lanes
                    }
                    _ => TextExtent::Of(self.integer(at)?),
                };
                self.mark(at, b']')?;
                match inner {
                    Type::Number(format) => Ok(Type::Array(vec![extent], format)),
                    Type::Array(mut extents, format) if extent != TextExtent::Lanes => {
                        extents.insert(0, extent);
                        Ok(Type::Array(extents, format))
                    }
                    _ => self.stop(*at - 1, "an array of something that is not a number"),
                }
            }
            TokenKind::Word(word) => {
                *at += 1;
                Ok(match word {
                    t::F64 => Type::Number(TextFormat::F64),
                    t::F32 => Type::Number(TextFormat::F32),
                    t::T if format == TextFormat::Any => Type::Number(TextFormat::Any),
                    word => Type::Named(word),
                })
            }
            _ => self.stop(*at, "a type is missing here"),
        }
    }
}

impl TextItem {
    fn new(module: usize, sort: Sort, name: u32, start: usize, end: usize, threads: bool) -> TextItem {
        TextItem { module, sort, name, start, end, threads, claimed: Cell::new(false) }
    }
}
