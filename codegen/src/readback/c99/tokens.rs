//! Words, numbers, strings and marks of a text in C, without comments and space.

use crate::readback::ReadingStop;

/// A text in tokens.
#[derive(Debug)]
pub struct CText<'t> {
    /// The text.
    pub text: &'t str,
    /// Where each token begins and ends.
    tokens: Vec<(usize, usize)>,
}

/// Marks of two characters; a longer one stands before its beginning.
const LONG_MARKS: [&str; 15] =
    ["--", "++", "->", "<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "+=", "-=", "*=", "/="];

impl<'t> CText<'t> {
    /// The tokens from a place on; comments to the end of a line are for C++ alone.
    pub fn read(text: &'t str, from: usize, is_cpp: bool) -> Result<CText<'t>, ReadingStop> {
        let bytes = text.as_bytes();
        let is_word = |at: usize| bytes.get(at).is_some_and(|b| b.is_ascii_alphanumeric() || *b == b'_');
        let (mut tokens, mut at) = (Vec::new(), from);
        while at < bytes.len() {
            let start = at;
            match bytes[at] {
                b' ' | b'\n' => {
                    at += 1;
                    continue;
                }
                b'/' if text[at..].starts_with("//") && is_cpp => {
                    at += text[at..].find('\n').unwrap_or(text.len() - at);
                    if text[start..at].ends_with(['\\', '/']) {
                        return Err(ReadingStop::at(start, "a comment that may go on"));
                    }
                    continue;
                }
                b'/' if text[at..].starts_with("/*") => {
                    let Some(length) = text[at + 2..].find("*/") else {
                        return Err(ReadingStop::at(start, "a comment without end"));
                    };
                    // nothing in it is another character, or joins lines, for whatever compiler
                    let inner = &text[at + 2..at + 2 + length];
                    if inner.contains("??") || inner.contains("\\\n") || inner.contains("/*") {
                        return Err(ReadingStop::at(start, "a comment with something in it"));
                    }
                    at += length + 4;
                    continue;
                }
                b'"' => {
                    at += 1;
                    while at < bytes.len() && bytes[at] != b'"' && bytes[at] != b'\n' {
                        at += if bytes[at] == b'\\' { 2 } else { 1 };
                    }
                    if bytes.get(at) != Some(&b'"') {
                        return Err(ReadingStop::at(start, "a string without end"));
                    }
                    at += 1;
                }
                digit if digit.is_ascii_digit() => {
                    // what C takes as one number, whatever it means
                    while is_word(at) || bytes.get(at) == Some(&b'.') || is_exponent(bytes, at) {
                        at += 1;
                    }
                }
                _ if is_word(at) => {
                    while is_word(at) {
                        at += 1;
                    }
                }
                mark if mark.is_ascii_graphic() && !matches!(mark, b'\\' | b'?' | b'\'' | b'`' | b'@' | b'$') => {
                    let is_long = LONG_MARKS.iter().any(|long| text[at..].starts_with(long));
                    at += if is_long { 2 } else { 1 };
                }
                _ => return Err(ReadingStop::at(at, "a character that is none of the language")),
            }
            tokens.push((start, at));
        }
        Ok(CText { text, tokens })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.tokens.len()
    }

    /// A token; nothing behind the last.
    pub fn token(&self, at: usize) -> &'t str {
        self.tokens.get(at).map_or("", |(start, end)| &self.text[*start..*end])
    }

    /// The byte where a token begins.
    pub fn place(&self, at: usize) -> usize {
        self.tokens.get(at).map_or(self.text.len(), |(start, _)| *start)
    }

    /// A complaint about a token.
    pub fn stop<X>(&self, at: usize, what: impl Into<String>) -> Result<X, ReadingStop> {
        Err(ReadingStop::at(self.place(at), what))
    }

    /// Takes these tokens.
    pub fn these(&self, at: &mut usize, expected: &str) -> Result<(), ReadingStop> {
        let expected = CText::read(expected, 0, false).expect("what is expected is C");
        for k in 0..expected.len() {
            if self.token(*at) != expected.token(k) {
                return self.stop(*at, format!("`{}` is expected here", expected.token(k)));
            }
            *at += 1;
        }
        Ok(())
    }

    /// Takes one token.
    pub fn mark(&self, at: &mut usize, mark: &str) -> Result<(), ReadingStop> {
        match self.token(*at) == mark {
            true => {
                *at += 1;
                Ok(())
            }
            false => self.stop(*at, format!("`{mark}` is expected here")),
        }
    }

    /// Takes a name.
    pub fn name(&self, at: &mut usize) -> Result<&'t str, ReadingStop> {
        let token = self.token(*at);
        match token.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            true => {
                *at += 1;
                Ok(token)
            }
            false => self.stop(*at, "a name is expected here"),
        }
    }

    /// Takes a whole number, with this behind its digits.
    pub fn integer(&self, at: &mut usize, suffix: &str) -> Result<usize, ReadingStop> {
        let digits = self.token(*at).strip_suffix(suffix);
        // a leading zero would make it octal
        let number = digits.and_then(|digits| digits.parse::<usize>().ok().filter(|n| n.to_string() == digits));
        match number {
            Some(n) => {
                *at += 1;
                Ok(n)
            }
            None => self.stop(*at, "a whole number is expected here"),
        }
    }

    /// Behind the bracket that closes the one that is opened here.
    pub fn behind(&self, at: usize) -> Result<usize, ReadingStop> {
        let mut open = Vec::new();
        for k in at..self.len() {
            match self.token(k) {
                "(" => open.push(")"),
                "[" => open.push("]"),
                "{" => open.push("}"),
                close @ (")" | "]" | "}") if open.pop() != Some(close) => {
                    return self.stop(k, "a bracket that closes another kind");
                }
                _ => {}
            }
            if open.is_empty() {
                return Ok(k + 1);
            }
        }
        self.stop(at, "a bracket that nothing closes")
    }
}

/// Whether a sign that belongs to a number stands there.
fn is_exponent(bytes: &[u8], at: usize) -> bool {
    matches!(bytes.get(at), Some(b'+' | b'-')) && matches!(bytes[at - 1], b'e' | b'E' | b'p' | b'P')
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn tokens_are_those_of_c() {
        let pieces = |text: &'static str| {
            let text = CText::read(text, 0, false).unwrap();
            (0..text.len()).map(|k| text.token(k).to_string()).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(pieces("a[0]=-1.5e-7F*b--c/* x */;"), "a [ 0 ] = - 1.5e-7F * b -- c ;");
        assert_eq!(pieces("\"a\\\"b\" 1.0e+5x-2"), "\"a\\\"b\" 1.0e+5x - 2");
        for text in ["/* ", "\"a", "a\\\n", "/* ?? */", "a // b ?", "é", "'"] {
            assert!(CText::read(text, 0, false).is_err(), "{text}");
        }
        let text = CText::read("(a[1]) {)", 0, false).unwrap();
        assert_eq!(text.behind(0).ok(), Some(6));
        assert!(text.behind(6).is_err());
        assert!(CText::read("x 010 4U", 0, false).unwrap().integer(&mut 1, "").is_err());
    }
}
