//! Words, numbers and marks of a text, without comments and space.

use rustc_hash::FxHashMap;

/// What stands at a place of the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TokenKind {
    /// An identifier or keyword, by its number.
    Word(u32),
    /// A number as it is written.
    Number,
    /// A string in quotes.
    Text,
    /// A lifetime.
    Life,
    /// One character of punctuation.
    Mark(u8),
    /// Nothing more.
    End,
}

/// A token, and where it stands.
#[derive(Clone, Copy, Debug)]
pub struct Token {
    /// What it is.
    pub kind: TokenKind,
    /// First byte.
    pub start: u32,
    /// Behind its last byte.
    pub end: u32,
    /// Of an opening bracket, the number of the token that closes it.
    pub closes: u32,
}

macro_rules! words {
    ($($name:ident = $text:literal,)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        #[derive(Clone, Copy)]
        enum KnownTokens { $($name,)* }
        $(#[doc = concat!("`", $text, "`")] pub const $name: u32 = KnownTokens::$name as u32;)*
        const KNOWN: &[&str] = &[$($text,)*];
    };
}

words! {
    LET = "let", MUT = "mut", FOR = "for", IN = "in", FN = "fn", PUB = "pub", CONST = "const", STATIC = "static", USE = "use",
    MOD = "mod", STRUCT = "struct", ENUM = "enum", IMPL = "impl", SUPER = "super", AS = "as", UNDERSCORE = "_",
    F32 = "f32", F64 = "f64", USIZE = "usize", BOOL = "bool", T = "T", REAL = "Real",
    ZERO = "zero", CONSTANT = "constant", NUMBER = "number",
    N = "N", FUSED = "FUSED", FMA = "fma", FMA_IF = "fma_if", FUSED_MODULE = "fused", TRIG = "trig", SHORT_SINES = "short_sines", BATCH = "batch",
    COST = "Cost", FIGURES = "Figures", UNPHYSICAL = "Unphysical", CHECK_INERTIA = "check_inertia",
    OUT_OF_RANGE = "OutOfRange", CHECK_NUMBER = "check_number",
    ALLOW = "allow", DOC = "doc", DERIVE = "derive", INLINE = "inline", MUST_USE = "must_use", REPR = "repr",
    FIXED = "fixed", SINGLE = "single", DOUBLE = "double", STRAIGHTLINE = "straightline", WITH_THREADS = "with_threads",
}

/// Numbers of words.
#[derive(Clone, Debug)]
pub struct Words {
    numbers: FxHashMap<Box<str>, u32>,
}

impl Words {
    /// Those of the language.
    pub fn new() -> Words {
        Words { numbers: KNOWN.iter().enumerate().map(|(k, word)| (Box::from(*word), k as u32)).collect() }
    }

    /// The number of a word.
    pub fn number(&mut self, word: &str) -> u32 {
        if let Some(number) = self.numbers.get(word) {
            return *number;
        }
        let number = self.numbers.len() as u32;
        self.numbers.insert(Box::from(word), number);
        number
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.numbers.len()
    }
}

/// The tokens of a text, an [`TokenKind::End`] behind them; or the place and what is wrong there.
pub fn tokens(text: &str, words: &mut Words) -> Result<Vec<Token>, (usize, &'static str)> {
    let mut open: Vec<usize> = Vec::new();
    lexed(text, words, |tokens, kind, start| {
        match kind {
            TokenKind::Mark(b'(' | b'[' | b'{') => open.push(tokens.len()),
            TokenKind::Mark(mark @ (b')' | b']' | b'}')) => {
                let opened = open.pop().ok_or((start, "a bracket that nothing opens"))?;
                let expected = match text.as_bytes()[tokens[opened].start as usize] {
                    b'(' => b')',
                    b'[' => b']',
                    _ => b'}',
                };
                if mark != expected {
                    return Err((start, "a bracket that closes another kind"));
                }
                tokens[opened].closes = tokens.len() as u32;
            }
            _ => {}
        }
        Ok(())
    })
    .and_then(|tokens| match open.pop() {
        Some(opened) => Err((tokens[opened].start as usize, "a bracket that nothing closes")),
        None => Ok(tokens),
    })
}

/// The tokens of a part of a text, whose brackets may be closed elsewhere.
pub fn tokens_of_part(text: &str, words: &mut Words) -> Result<Vec<Token>, (usize, &'static str)> {
    let mut tokens = lexed(text, words, |_, _, _| Ok(()))?;
    tokens.pop();
    Ok(tokens)
}

/// The tokens of a text, of each of which is `seen` what stands before it.
fn lexed(
    text: &str,
    words: &mut Words,
    mut seen: impl FnMut(&mut [Token], TokenKind, usize) -> Result<(), (usize, &'static str)>,
) -> Result<Vec<Token>, (usize, &'static str)> {
    let bytes = text.as_bytes();
    let mut tokens: Vec<Token> = Vec::with_capacity(bytes.len() / 4);
    let mut at = 0;
    while at < bytes.len() {
        let start = at;
        let kind = match bytes[at] {
            b' ' | b'\n' | b'\r' | b'\t' => {
                at += 1;
                continue;
            }
            b'/' if bytes.get(at + 1) == Some(&b'/') => {
                while at < bytes.len() && bytes[at] != b'\n' {
                    at += 1;
                }
                continue;
            }
            b'/' if bytes.get(at + 1) == Some(&b'*') => return Err((at, "a block comment")),
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                while at < bytes.len() && is_word(bytes[at]) {
                    at += 1;
                }
                TokenKind::Word(words.number(&text[start..at]))
            }
            b'0'..=b'9' => {
                at = number(bytes, at);
                TokenKind::Number
            }
            b'"' => {
                at += 1;
                while at < bytes.len() && bytes[at] != b'"' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                if at >= bytes.len() {
                    return Err((start, "a string without end"));
                }
                at += 1;
                TokenKind::Text
            }
            b'\'' => {
                at += 1;
                while at < bytes.len() && is_word(bytes[at]) {
                    at += 1;
                }
                TokenKind::Life
            }
            mark if mark.is_ascii_graphic() => {
                at += 1;
                TokenKind::Mark(mark)
            }
            _ => return Err((at, "a character that is none of the language")),
        };
        seen(&mut tokens, kind, start)?;
        tokens.push(Token { kind, start: start as u32, end: at as u32, closes: 0 });
    }
    let end = bytes.len() as u32;
    tokens.push(Token { kind: TokenKind::End, start: end, end, closes: 0 });
    Ok(tokens)
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// Behind a number: digits, a fraction, an exponent, a type.
fn number(bytes: &[u8], mut at: usize) -> usize {
    let is_digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    while is_digit(at) {
        at += 1;
    }
    if bytes.get(at) == Some(&b'.') && is_digit(at + 1) {
        at += 1;
        while is_digit(at) {
            at += 1;
        }
    }
    if bytes.get(at) == Some(&b'e') {
        let sign = usize::from(matches!(bytes.get(at + 1), Some(b'-' | b'+')));
        if is_digit(at + 1 + sign) {
            at += 1 + sign;
            while is_digit(at) {
                at += 1;
            }
        }
    }
    while at < bytes.len() && is_word(bytes[at]) {
        at += 1;
    }
    at
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    fn pieces(text: &str) -> Vec<String> {
        let tokens = tokens(text, &mut Words::new()).unwrap();
        tokens
            .iter()
            .filter(|t| t.kind != TokenKind::End)
            .map(|t| text[t.start as usize..t.end as usize].into())
            .collect()
    }

    pub fn numbers_fields_and_ranges_are_told_apart() {
        assert_eq!(pieces("a.0[3]"), ["a", ".", "0", "[", "3", "]"]);
        assert_eq!(pieces("0..N // x\n-1.5e-7_f32*1e16"), ["0", ".", ".", "N", "-", "1.5e-7_f32", "*", "1e16"]);
        assert_eq!(pieces(r#"&'a "x\"//" {}"#), ["&", "'a", r#""x\"//""#, "{", "}"]);
    }

    pub fn what_is_no_text_of_ours_is_refused() {
        for text in ["(]", "(", ")", "\"", "/* */", "é"] {
            assert!(tokens(text, &mut Words::new()).is_err(), "{text}");
        }
    }
}
