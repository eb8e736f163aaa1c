//! What a person is told about a file: where, what stands there, why it is doubted, what to write instead.
//!
//! All fronts (command line, build script, macro) print the same text: [`Diagnostics::render`] for people,
//! [`Diagnostics::lines`] where one line is all there is. Sources are UTF-8; lines and columns count from 1, columns in
//! characters.

pub mod codes;
pub mod levels;
pub mod messages;
mod source;
pub mod wording;

pub use levels::{Front, Level, Levels, Reporting};
pub use source::{fnv_1a, Place, Source};

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level as Shown, Origin, Renderer, Snippet};
use std::fmt;
use std::path::{Path, PathBuf};

/// A longer line is not shown with its complaint.
const LONGEST_LINE_SHOWN: usize = 400;

/// The nearest number of six digits: what people are shown of numbers that were computed.
pub fn six_digits(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// No output.
    Error,
    /// Doubtful: the text says what was assumed.
    Warning,
    /// Worth knowing.
    Note,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        })
    }
}

/// One complaint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// A short name of the kind of complaint, such as `negative-mass`.
    pub code: &'static str,
    /// Where.
    pub place: Option<Place>,
    /// What, in one line.
    pub title: String,
    /// The values, what was assumed; may be empty.
    pub detail: String,
    /// What to write instead; may be empty.
    pub help: String,
    /// Other places that belong to it, each with a word on what stands there.
    pub related: Vec<(Place, String)>,
    /// An option of the fronts and its value: `{option}` in the texts becomes what the front that speaks writes.
    pub option: Option<(&'static str, Option<String>)>,
    /// Whether one line says it all, also for people.
    pub brief: bool,
}

impl Diagnostic {
    /// A complaint of that severity.
    pub fn new(severity: Severity, code: &'static str, title: impl Into<String>) -> Diagnostic {
        Diagnostic {
            severity,
            code,
            place: None,
            title: title.into(),
            detail: String::new(),
            help: String::new(),
            related: Vec::new(),
            option: None,
            brief: false,
        }
    }

    /// An error.
    pub fn error(code: &'static str, title: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Error, code, title)
    }

    /// A warning.
    pub fn warning(code: &'static str, title: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Warning, code, title)
    }

    /// A note.
    pub fn note(code: &'static str, title: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Note, code, title)
    }

    /// With its place; [`Place::none`] leaves it without.
    #[must_use]
    pub fn at(mut self, place: &Place) -> Diagnostic {
        self.place = place.is_some().then(|| place.clone());
        self
    }

    /// With the values and what was assumed.
    #[must_use]
    pub fn detail(mut self, detail: impl Into<String>) -> Diagnostic {
        self.detail = detail.into();
        self
    }

    /// With the remedy.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help = help.into();
        self
    }

    /// What is wrong and what to do, in one line.
    pub fn sentence(&self) -> String {
        let parts = [self.title.as_str(), self.help.as_str()];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
    }

    /// With an option of the fronts, and its value unless it is switched on: where `{option}` stands in the texts, the
    /// front that speaks writes it in its own way.
    #[must_use]
    pub fn option(mut self, name: &'static str, value: Option<String>) -> Diagnostic {
        self.option = Some((name, value));
        self
    }

    /// In one line, also for people.
    #[must_use]
    pub fn brief(mut self) -> Diagnostic {
        self.brief = true;
        self
    }

    /// In the words of a front.
    fn said_by(mut self, front: Front) -> Diagnostic {
        if let Some((name, value)) = self.option.take() {
            let option = front.option(name, value.as_deref());
            for text in [&mut self.title, &mut self.detail, &mut self.help] {
                *text = text.replace("{option}", &option);
            }
        }
        self
    }

    /// With another place that belongs to it.
    #[must_use]
    pub fn related(mut self, place: &Place, word: impl Into<String>) -> Diagnostic {
        if place.is_some() {
            self.related.push((place.clone(), word.into()));
        }
        self
    }

    /// One line: `path:line:column: error: title; detail; help: remedy`, control characters escaped.
    pub fn line(&self) -> String {
        let place = self.place.as_ref().map_or_else(String::new, |place| format!("{place}: "));
        let line = format!("{place}{}: {}", self.severity, self.said());
        line.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
    }
}

impl Diagnostic {
    /// Title, detail and help.
    fn said(&self) -> String {
        let detail = if self.detail.is_empty() { String::new() } else { format!("; {}", self.detail) };
        let help = if self.help.is_empty() { String::new() } else { format!("; help: {}", self.help) };
        format!("{}{detail}{help}", self.title)
    }

    /// The file and what is said of it, for people.
    fn in_one_line(&self) -> String {
        let file = self.place.as_ref().map_or_else(String::new, |place| format!("{}: ", place.file));
        format!("{file}{}", self.said())
    }
}

/// The complaints about one or more files, with what else was found while reading them.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    read: Box<FilesRead>,
    /// How often each code was pushed, in the order of their first complaints.
    counts: Vec<(&'static str, usize)>,
    reporting: Reporting,
}

/// What was read.
#[derive(Clone, Debug, Default)]
struct FilesRead {
    sources: Vec<Source>,
    /// Files that the one that is read names, with sums of their bytes.
    named: Vec<(PathBuf, u64)>,
}

impl FilesRead {
    fn note(&mut self, file: &Path, sum: impl FnOnce() -> u64) {
        if !self.named.iter().any(|(known, _)| known == file) {
            self.named.push((file.to_path_buf(), sum()));
        }
    }
}

impl Diagnostics {
    /// Of complaints with the same code, so many are kept.
    pub const SHOWN_PER_CODE: usize = 100;

    /// No complaints.
    pub fn new() -> Diagnostics {
        Diagnostics::default()
    }

    /// No complaints yet: they will be said in the words of a front, each at its level; what is wrong with the levels is
    /// said first.
    pub fn reporting(reporting: &Reporting) -> Diagnostics {
        let mut diagnostics = Diagnostics { reporting: reporting.clone(), ..Diagnostics::default() };
        reporting.levels.complaints().for_each(|complaint| diagnostics.push(complaint));
        diagnostics
    }

    /// Makes a source known, so that its lines can be shown.
    pub fn add_source(&mut self, source: &Source) {
        if self.source(source.path()).is_none() {
            self.read.sources.push(source.clone());
        }
    }

    /// Remembers a file that the one that is read names, such as one that it includes or a mesh: the result depends on it.
    pub fn note_file(&mut self, file: &Path, bytes: &[u8]) {
        self.read.note(file, || fnv_1a(bytes.iter().copied()));
    }

    /// The files that the one that was read names, with sums of their bytes.
    pub fn named_files(&self) -> impl Iterator<Item = (&Path, u64)> {
        self.read.named.iter().map(|(file, sum)| (file.as_path(), *sum))
    }

    /// The sources that are known.
    pub fn sources(&self) -> impl Iterator<Item = &Source> {
        self.read.sources.iter()
    }

    /// The source of that path.
    pub fn source(&self, path: &str) -> Option<&Source> {
        self.read.sources.iter().find(|s| s.path() == path)
    }

    /// Adds a complaint. Of one code, [`Diagnostics::SHOWN_PER_CODE`] are kept and the others counted.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        let diagnostic = diagnostic.said_by(self.reporting.front);
        let Some(diagnostic) = self.reporting.levels.applied(diagnostic) else { return };
        let code = diagnostic.code;
        let index = self.counts.iter().position(|c| c.0 == code).unwrap_or_else(|| {
            self.counts.push((code, 0));
            self.counts.len() - 1
        });
        self.counts[index].1 += 1;
        if self.counts[index].1 <= Self::SHOWN_PER_CODE {
            self.list.push(diagnostic);
        }
    }

    /// Adds all of `other`.
    pub fn extend(&mut self, other: Diagnostics) {
        for source in &other.read.sources {
            self.add_source(source);
        }
        for (file, sum) in other.read.named {
            self.read.note(&file, || sum);
        }
        for diagnostic in other.list {
            self.push(diagnostic);
        }
    }

    /// All complaints, in the order of their places once [`Diagnostics::sort`] was called.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.list.iter()
    }

    /// For every code of which complaints were dropped: the code, and how many.
    pub fn dropped(&self) -> impl Iterator<Item = (&'static str, usize)> + '_ {
        self.counts.iter().filter(|c| c.1 > Self::SHOWN_PER_CODE).map(|&(code, n)| (code, n - Self::SHOWN_PER_CODE))
    }

    /// Whether there is no complaint.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Number of complaints.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there is an error.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    /// The complaints of that severity or worse, and those that are always said.
    #[must_use]
    pub fn at_least(&self, severity: Severity) -> Diagnostics {
        let list = self.list.iter().filter(|d| d.severity <= severity || codes::is_firm(d.code)).cloned().collect();
        Diagnostics { list, ..self.clone() }
    }

    /// All but those complaints.
    #[must_use]
    pub fn without(&self, which: impl Fn(&Diagnostic) -> bool) -> Diagnostics {
        let list = self.list.iter().filter(|d| !which(d)).cloned().collect();
        Diagnostics { list, ..self.clone() }
    }

    /// Number of complaints of that severity.
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|d| d.severity == severity).count()
    }

    /// Orders the complaints by their places: those without a place last, otherwise as they came.
    pub fn sort(&mut self) {
        self.list.sort_by(|a, b| match (&a.place, &b.place) {
            (Some(x), Some(y)) => (&x.file, x.span.start).cmp(&(&y.file, y.span.start)),
            (Some(_), None) => std::cmp::Ordering::Less,
            (None, Some(_)) => std::cmp::Ordering::Greater,
            (None, None) => std::cmp::Ordering::Equal,
        });
    }

    /// One line per complaint, as [`Diagnostic::line`].
    pub fn lines(&self) -> Vec<String> {
        self.list.iter().map(Diagnostic::line).collect()
    }

    /// Every complaint with its source line, in rustc's style, without colours.
    pub fn render(&self) -> String {
        self.render_with(&Renderer::plain())
    }

    /// Every complaint with its source line, in rustc's style, in colours.
    pub fn render_coloured(&self) -> String {
        self.render_with(&Renderer::styled())
    }

    fn render_with(&self, renderer: &Renderer) -> String {
        let renderer = renderer.clone().decor_style(DecorStyle::Ascii);
        self.list.iter().map(|d| renderer.render(&[self.group(d)]) + "\n\n").collect()
    }

    fn group<'a>(&'a self, diagnostic: &'a Diagnostic) -> Group<'a> {
        let level = match diagnostic.severity {
            Severity::Error => Shown::ERROR,
            Severity::Warning => Shown::WARNING,
            Severity::Note => Shown::NOTE,
        };
        if diagnostic.brief {
            return level
                .primary_title(plain(&diagnostic.in_one_line()))
                .id(diagnostic.code)
                .elements([] as [Origin; 0]);
        }
        let mut group = level.primary_title(plain(&diagnostic.title)).id(diagnostic.code).elements([] as [Origin; 0]);
        if let Some(place) = &diagnostic.place {
            group = self.show(group, place, AnnotationKind::Primary, "");
        }
        for (place, word) in &diagnostic.related {
            group = self.show(group, place, AnnotationKind::Context, word);
        }
        if !diagnostic.detail.is_empty() {
            group = group.element(Shown::NOTE.message(plain(&diagnostic.detail)));
        }
        if !diagnostic.help.is_empty() {
            group = group.element(Shown::HELP.message(plain(&diagnostic.help)));
        }
        group
    }

    /// The line of `place` with a caret, or the place alone where there is no line to show.
    fn show<'a>(&'a self, group: Group<'a>, place: &'a Place, kind: AnnotationKind, word: &'a str) -> Group<'a> {
        let origin = || Origin::path(&*place.file).line(place.line).char_column(place.column);
        let Some(source) = self.source(&place.file) else { return group.element(origin()) };
        let line = source.line(place.line);
        if line.len() > LONGEST_LINE_SHOWN {
            return group.element(origin());
        }
        let start = place.span.start.clamp(line.start, line.end) - line.start;
        let end = place.span.end.clamp(line.start, line.end) - line.start;
        let mark = kind.span(start..end.max(start));
        let mark = if word.is_empty() { mark } else { mark.label(word) };
        group.element(Snippet::source(&source.text()[line]).line_start(place.line).path(&*place.file).annotation(mark))
    }
}

/// Text from a file may hold anything; what a terminal would act upon is replaced.
fn plain(text: &str) -> String {
    annotate_snippets::normalize_untrusted_str(text)
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render())
    }
}
