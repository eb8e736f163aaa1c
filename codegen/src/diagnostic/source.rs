//! Texts, and places in them.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Distance of the marks from which columns are counted \[bytes\].
const MARK: usize = 1024;

/// A text with its name.
///
/// ```
/// use straightline_codegen::diagnostic::Source;
/// let source = Source::new("arm.urdf", "<robot/>");
/// assert_eq!(source.place(1..6).to_string(), "arm.urdf:1:2");
/// ```
#[derive(Clone, Debug)]
pub struct Source {
    inner: Arc<SourceInner>,
}

#[derive(Debug)]
struct SourceInner {
    path: Arc<str>,
    /// Where it was read, if not at `path`.
    file: Option<PathBuf>,
    text: String,
    invalid_utf8: Option<usize>,
    line_starts: Vec<usize>,
    /// Number of characters that begin before byte `i * MARK`.
    marks: Vec<usize>,
}

impl Source {
    /// A text and the path under which complaints name it.
    pub fn new(path: &str, text: impl Into<String>) -> Source {
        let mut text = text.into();
        if text.starts_with('\u{feff}') {
            text.remove(0);
        }
        Source::build(path, text, None)
    }

    /// As [`Source::new`], from bytes. Bytes that are not UTF-8 are remembered, and readers refuse the source.
    pub fn from_bytes(path: &str, bytes: impl Into<Vec<u8>>) -> Source {
        match String::from_utf8(bytes.into()) {
            Ok(text) => Source::new(path, text),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                Source::build(path, String::from_utf8_lossy(error.as_bytes()).into_owned(), Some(at))
            }
        }
    }

    /// As [`Source::from_bytes`], of a file that complaints name by another path: what it names itself is looked for beside the file.
    pub fn of_file(path: &str, bytes: impl Into<Vec<u8>>, file: &Path) -> Source {
        let Source { inner } = Source::from_bytes(path, bytes);
        let inner = Arc::into_inner(inner).expect("nobody else has it yet");
        Source { inner: Arc::new(SourceInner { file: Some(file.to_path_buf()), ..inner }) }
    }

    fn build(path: &str, text: String, invalid_utf8: Option<usize>) -> Source {
        let bytes = text.as_bytes();
        let mut line_starts = vec![0];
        let mut marks = Vec::with_capacity(bytes.len() / MARK + 1);
        let mut characters = 0;
        for (i, &byte) in bytes.iter().enumerate() {
            if i.is_multiple_of(MARK) {
                marks.push(characters);
            }
            if byte & 0xC0 != 0x80 {
                characters += 1;
            }
            if byte == b'\n' {
                line_starts.push(i + 1);
            }
        }
        if bytes.len().is_multiple_of(MARK) {
            marks.push(characters);
        }
        Source {
            inner: Arc::new(SourceInner { path: path.into(), file: None, text, invalid_utf8, line_starts, marks }),
        }
    }

    /// The path under which complaints name it.
    pub fn path(&self) -> &str {
        &self.inner.path
    }

    /// Where it was read.
    pub fn file(&self) -> &Path {
        self.inner.file.as_deref().unwrap_or_else(|| Path::new(self.path()))
    }

    /// The text, without a byte order mark.
    pub fn text(&self) -> &str {
        &self.inner.text
    }

    /// Where the bytes stop being UTF-8.
    pub fn invalid_utf8(&self) -> Option<usize> {
        self.inner.invalid_utf8
    }

    /// The place of a range of bytes; a range beyond the end becomes the end.
    pub fn place(&self, span: Range<usize>) -> Place {
        let start = self.boundary(span.start);
        let end = self.boundary(span.end.max(start));
        let line = self.inner.line_starts.partition_point(|&s| s <= start);
        let column = self.characters_before(start) - self.characters_before(self.inner.line_starts[line - 1]) + 1;
        Place { file: self.inner.path.clone(), line, column, span: start..end }
    }

    /// The greatest character boundary up to `at`.
    fn boundary(&self, at: usize) -> usize {
        let mut at = at.min(self.inner.text.len());
        while !self.inner.text.is_char_boundary(at) {
            at -= 1;
        }
        at
    }

    fn characters_before(&self, at: usize) -> usize {
        let mark = at / MARK;
        let rest = &self.inner.text.as_bytes()[mark * MARK..at];
        self.inner.marks[mark] + rest.iter().filter(|&&b| b & 0xC0 != 0x80).count()
    }

    /// The bytes of a line, without its end.
    pub(super) fn line(&self, line: usize) -> Range<usize> {
        let start = self.inner.line_starts[line - 1];
        let end = self.inner.line_starts.get(line).map_or(self.inner.text.len(), |&next| next - 1);
        start..start + self.inner.text[start..end].trim_end_matches('\r').len()
    }
}

/// Where something stands in a file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// Path of the file.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Range of bytes in the file's text.
    pub span: Range<usize>,
}

impl Place {
    /// A place in no file: for values that are given by an option or assumed.
    pub fn none() -> Place {
        Place { file: "".into(), line: 0, column: 0, span: 0..0 }
    }

    /// Whether it is a place in a file.
    pub fn is_some(&self) -> bool {
        self.line > 0
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// A hash of bytes that is the same in every version and on every machine: FNV-1a.
pub fn fnv_1a(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes
        .into_iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}
