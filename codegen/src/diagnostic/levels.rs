//! What becomes of warnings, and in whose words: the levels that a person gives to codes, and the front that speaks.

use super::messages as say;
use super::{codes, Diagnostic, Severity};
use std::fmt;

/// Stands for the codes of all warnings.
pub const ALL_WARNINGS: &str = "warnings";

/// What becomes of a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Nothing is said.
    Allow,
    /// It is said.
    Warn,
    /// It is an error.
    Deny,
}

impl Level {
    /// All of them.
    pub const ALL: [Level; 3] = [Level::Allow, Level::Warn, Level::Deny];

    /// Its word in options and in scene files.
    pub fn word(self) -> &'static str {
        match self {
            Level::Allow => "allow",
            Level::Warn => "warn",
            Level::Deny => "deny",
        }
    }
}

/// The levels of codes. Of several for one code the last counts; a code by its name counts before [`ALL_WARNINGS`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Levels {
    list: Vec<(String, Level)>,
}

impl Levels {
    /// Gives a code, or [`ALL_WARNINGS`], a level.
    pub fn set(&mut self, code: impl Into<String>, level: Level) {
        self.list.push((code.into(), level));
    }

    /// Gives each of these codes a level.
    pub fn set_all(&mut self, codes: &[String], level: Level) {
        codes.iter().for_each(|code| self.set(code, level));
    }

    /// Adds those of `later`, which count before these.
    pub fn extend(&mut self, later: &Levels) {
        self.list.extend(later.list.iter().cloned());
    }

    /// Codes and levels in the order in which they were given.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Level)> {
        self.list.iter().map(|(code, level)| (code.as_str(), *level))
    }

    /// The level of a code, if it has one.
    pub fn of(&self, code: &str) -> Option<Level> {
        let last = |code: &str| self.list.iter().rev().find(|(c, _)| c == code).map(|(_, level)| *level);
        last(code).or_else(|| last(ALL_WARNINGS))
    }

    /// What is wrong with the level of a code.
    pub fn complaint(code: &str, level: Level) -> Option<Diagnostic> {
        match codes::find(code) {
            _ if code == ALL_WARNINGS => None,
            None => Some(say::unknown_code(code)),
            Some(c) if c.severity == Severity::Error && level != Level::Deny => Some(say::level_of_error(level, code)),
            Some(c) if c.is_firm && level == Level::Allow => Some(say::level_of_firm(code)),
            Some(_) => None,
        }
    }

    /// What is wrong with these.
    pub fn complaints(&self) -> impl Iterator<Item = Diagnostic> + '_ {
        self.iter().filter_map(|(code, level)| Self::complaint(code, level))
    }

    /// The complaint at its level; `None` if nothing is to be said. Notes can be left out, but not become errors with all
    /// warnings.
    pub(super) fn applied(&self, mut diagnostic: Diagnostic) -> Option<Diagnostic> {
        let named = self.list.iter().any(|(code, _)| code == diagnostic.code);
        if diagnostic.severity == Severity::Error || (diagnostic.severity == Severity::Note && !named) {
            return Some(diagnostic);
        }
        match self.of(diagnostic.code) {
            Some(Level::Allow) if codes::is_firm(diagnostic.code) => Some(diagnostic),
            Some(Level::Allow) => None,
            Some(Level::Deny) => {
                diagnostic.severity = Severity::Error;
                Some(diagnostic)
            }
            Some(Level::Warn) => {
                diagnostic.severity = Severity::Warning;
                Some(diagnostic)
            }
            None => Some(diagnostic),
        }
    }
}

/// Who speaks: each front has a way of its own to write options.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Front {
    /// `--angle-tolerance 1e-6`
    #[default]
    CommandLine,
    /// `angle_tolerance = 1e-6` in the attribute
    Derive,
    /// `.angle_tolerance(1e-6)` in a build script
    Builder,
}

impl Front {
    /// An option as this front writes it: its name as a Rust identifier, and its value; without one it is switched on.
    pub fn option(self, name: &str, value: Option<&str>) -> String {
        match (self, value) {
            (Front::CommandLine, None) => format!("--{}", name.replace('_', "-")),
            (Front::CommandLine, Some(value)) => format!("--{} {value}", name.replace('_', "-")),
            (Front::Derive, None) => name.to_string(),
            (Front::Derive, Some(value)) => format!("{name} = {value}"),
            (Front::Builder, value) => format!(".{name}({})", value.unwrap_or("true")),
        }
    }
}

/// How complaints are said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reporting {
    /// What becomes of warnings.
    pub levels: Levels,
    /// In whose words.
    pub front: Front,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn the_last_level_counts_and_a_code_before_all_warnings() {
        let mut levels = Levels::default();
        levels.set("axis-length", Level::Deny);
        levels.set("axis-length", Level::Warn);
        levels.set(ALL_WARNINGS, Level::Allow);
        assert_eq!(levels.of("axis-length"), Some(Level::Warn));
        assert_eq!(levels.of("zero-mass"), Some(Level::Allow));
        assert!(levels.applied(Diagnostic::warning("zero-mass", "")).is_none());
        assert!(levels.applied(Diagnostic::error("zero-mass", "")).is_some());
        assert!(levels.applied(Diagnostic::note("more-complaints", "")).is_some());
    }

    pub fn levels_of_nothing_and_of_errors_are_refused() {
        let said = |code, level| Levels::complaint(code, level).map(|d| d.line());
        assert_eq!(said("axis-length", Level::Allow), None);
        assert_eq!(said(ALL_WARNINGS, Level::Deny), None);
        let wrong = "error: no complaint has the code `axis-lenth`; help: did you mean `axis-length`?";
        assert_eq!(said("axis-lenth", Level::Allow).as_deref(), Some(wrong));
        assert!(said("negative-mass", Level::Allow).is_some_and(|line| line.contains("is an error")));
        assert_eq!(said("negative-mass", Level::Deny), None);
    }

    pub fn every_front_writes_options_its_own_way() {
        let all = [Front::CommandLine, Front::Derive, Front::Builder];
        let tolerance = all.map(|front| front.option("angle_tolerance", Some("1e-6")));
        assert_eq!(tolerance, ["--angle-tolerance 1e-6", "angle_tolerance = 1e-6", ".angle_tolerance(1e-6)"]);
        let floats = all.map(|front| front.option("floating_base", None));
        assert_eq!(floats, ["--floating-base", "floating_base", ".floating_base(true)"]);
    }
}
