//! What is given for options, and in which words: the same in every front.

use super::table::{Call, OptionGroup, OptionKind, OptionRow, TABLE};
use super::Options;
use crate::choices::{Choice, UnknownWord};
use crate::diagnostic::wording::did_you_mean;
use crate::diagnostic::{Diagnostic, Front, Levels};
use crate::scene::messages::not_in_range;

/// The value of an option, as it is given.
#[derive(Clone, Debug, PartialEq)]
pub enum OptionValue {
    /// Yes or no.
    Flag(bool),
    /// Words or names.
    Words(Vec<String>),
    /// Numbers.
    Numbers(Vec<f64>),
}

impl OptionValue {
    /// Several words or names.
    pub fn of_words(words: impl IntoIterator<Item = impl Into<String>>) -> OptionValue {
        OptionValue::Words(words.into_iter().map(Into::into).collect())
    }

    /// Several choices.
    pub fn of_choices<C: Choice>(choices: impl IntoIterator<Item = C>) -> OptionValue {
        OptionValue::of_words(choices.into_iter().map(C::word))
    }

    pub(super) fn flag(&self) -> bool {
        *self == OptionValue::Flag(true)
    }

    pub(super) fn names(&self) -> &[String] {
        match self {
            OptionValue::Words(words) => words,
            _ => &[],
        }
    }

    pub(super) fn choices<C: Choice>(&self) -> Vec<C> {
        self.names().iter().filter_map(|word| C::from_word(word).ok()).collect()
    }

    pub(super) fn choice<C: Choice>(&self) -> C {
        self.choices()[0]
    }

    fn numbers(&self) -> &[f64] {
        match self {
            OptionValue::Numbers(numbers) => numbers,
            _ => &[],
        }
    }

    pub(super) fn number(&self) -> f64 {
        self.numbers()[0]
    }

    pub(super) fn count(&self) -> usize {
        self.number() as usize
    }

    pub(super) fn vector(&self) -> [f64; 3] {
        let numbers = self.numbers();
        [numbers[0], numbers[1], numbers[2]]
    }
}

macro_rules! from {
    ($($type:ty: $x:ident => $value:expr;)*) => {$(
        impl From<$type> for OptionValue {
            fn from($x: $type) -> OptionValue {
                $value
            }
        }
    )*};
}

from! {
    bool: x => OptionValue::Flag(x);
    f64: x => OptionValue::Numbers(vec![x]);
    usize: x => OptionValue::Numbers(vec![x as f64]);
    i32: x => OptionValue::Numbers(vec![x.into()]);
    [f64; 3]: x => OptionValue::Numbers(x.to_vec());
    &str: x => OptionValue::of_words([x]);
    Vec<String>: x => OptionValue::Words(x);
}

impl<C: Choice> From<C> for OptionValue {
    fn from(choice: C) -> OptionValue {
        OptionValue::of_choices([choice])
    }
}

/// The words of a choice.
pub struct Vocabulary {
    /// Every word and its meaning.
    pub words: fn() -> Vec<(&'static str, &'static str)>,
    unknown: fn(&str) -> Option<UnknownWord>,
    /// Whether the words are names of items, which macros write without quotes.
    pub is_of_items: bool,
}

impl Vocabulary {
    /// That of a type.
    pub const fn of<C: Choice>() -> Vocabulary {
        Vocabulary {
            words: || C::words().into_iter().map(|(word, meaning, _)| (word, meaning)).collect(),
            unknown: |word| C::from_word(word).err(),
            is_of_items: C::IS_ITEM,
        }
    }
}

impl OptionRow {
    /// The option of that name that every front can be given.
    ///
    /// # Errors
    /// There is none; the names that `is_known` lets through are suggested.
    pub fn find(name: &str, is_known: impl Fn(&OptionRow) -> bool) -> Result<&'static OptionRow, String> {
        let known = || TABLE.iter().filter(|row| is_known(row));
        known().find(|row| row.name == name).ok_or_else(|| {
            let names: Vec<&str> = known().map(|row| row.name).collect();
            let hint = did_you_mean(name, names.iter().copied());
            let hint = hint.unwrap_or_else(|| format!("one of: {}", names.join(", ")));
            format!("there is no option `{}`; {hint}", name.escape_default())
        })
    }

    /// How a front calls it; `None`: it cannot have it.
    pub fn called(&self, front: Front) -> Option<&'static str> {
        let call = match front {
            Front::CommandLine => self.command_line,
            Front::Derive => self.macros,
            Front::Builder => self.builder,
        };
        match call {
            Call::Name => Some(self.name),
            Call::As(name) => Some(name),
            Call::Not(_) => None,
        }
    }

    /// Whether it has a value that is given through the table in that front.
    pub fn is_value(&self, front: Front) -> bool {
        self.group != OptionGroup::Front && self.called(front).is_some()
    }

    /// Whether it is a key of that table of a scene file.
    pub fn stands_in(&self, table: &str) -> bool {
        matches!(self.scene, Call::Name) && [self.table, self.also].contains(&table)
    }

    /// What is wrong with one word or name of its value.
    pub fn wrong_word(&self, word: &str) -> Option<Diagnostic> {
        match &self.kind {
            OptionKind::Word(of, _) | OptionKind::Words(of) => {
                (of.unknown)(word).map(|unknown| Diagnostic::error("unknown-word", unknown.to_string()))
            }
            OptionKind::Codes(level) => Levels::complaint(word, *level),
            _ => None,
        }
    }

    /// What is wrong with a number that is its value.
    pub fn wrong_number(&self, number: f64) -> Option<Diagnostic> {
        let (OptionKind::Real(range, holds) | OptionKind::Whole(range, holds)) = &self.kind else { return None };
        let is_whole = matches!(self.kind, OptionKind::Real(..)) || number.fract() == 0.0;
        let is_right = holds(number) && number.is_finite() && is_whole;
        (!is_right).then(|| not_in_range(self.name, number, range))
    }

    /// What is wrong with its value.
    pub fn wrong(&self, value: &OptionValue, front: Front) -> Vec<Diagnostic> {
        match (&self.kind, value) {
            (OptionKind::Flag, OptionValue::Flag(_)) => Vec::new(),
            (OptionKind::Word(..), OptionValue::Words(words)) if words.len() != 1 => vec![self.wrong_form(front)],
            (
                OptionKind::Word(..) | OptionKind::Words(_) | OptionKind::Names { .. } | OptionKind::Codes(_),
                OptionValue::Words(words),
            ) => words.iter().filter_map(|word| self.wrong_word(word)).collect(),
            (OptionKind::Real(..) | OptionKind::Whole(..), OptionValue::Numbers(x)) if x.len() == 1 => {
                self.wrong_number(x[0]).into_iter().collect()
            }
            (OptionKind::Vector, OptionValue::Numbers(xyz)) if xyz.len() == 3 && xyz.iter().all(|x| x.is_finite()) => {
                Vec::new()
            }
            _ => vec![self.wrong_form(front)],
        }
    }

    /// What the option takes, where it is given something else.
    pub fn wrong_form(&self, front: Front) -> Diagnostic {
        let takes = match &self.kind {
            OptionKind::Flag => "`true` or `false`".to_string(),
            OptionKind::Word(of, _) | OptionKind::Words(of) => {
                let one = if matches!(self.kind, OptionKind::Word(..)) { "one of" } else { "some of" };
                let words: Vec<&str> = (of.words)().iter().map(|(word, _)| *word).collect();
                format!("{one} {}", words.join(", "))
            }
            OptionKind::Names { .. } => "names".to_string(),
            OptionKind::Codes(_) => "codes of warnings".to_string(),
            OptionKind::Real(range, _) | OptionKind::Whole(range, _) => format!("a number: {range}"),
            OptionKind::Vector => "three numbers".to_string(),
            OptionKind::OfFront => "a text".to_string(),
        };
        let title = format!("`{}` takes {takes}", self.name);
        Diagnostic::error("wrong-type", title).help(format!("write `{}`", self.written(front)))
    }

    /// The value of these words.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn parse(&self, words: &[&str], front: Front) -> Result<OptionValue, Vec<Diagnostic>> {
        let numbers = || words.iter().map(|word| word.trim().parse().ok()).collect::<Option<Vec<f64>>>();
        let value = match &self.kind {
            OptionKind::Flag => words.first().map_or(Some(true), |word| word.parse().ok()).map(OptionValue::Flag),
            _ if self.is_number() => numbers().map(OptionValue::Numbers),
            _ => Some(OptionValue::of_words(words.iter().copied())),
        };
        let value = value.ok_or_else(|| vec![self.wrong_form(front)])?;
        let wrong = self.wrong(&value, front);
        if wrong.is_empty() {
            Ok(value)
        } else {
            Err(wrong)
        }
    }

    /// Whether its value is numbers.
    pub fn is_number(&self) -> bool {
        matches!(self.kind, OptionKind::Vector | OptionKind::Real(..) | OptionKind::Whole(..))
    }

    /// Whether its example is a list: in brackets.
    fn is_list(&self) -> bool {
        matches!(self.kind, OptionKind::Vector | OptionKind::Names { .. } | OptionKind::Codes(_))
            || self.example.len() > 1
    }

    /// Its example: words in quotes.
    fn quoted(&self, quotes: bool) -> String {
        let text = |word: &&str| if quotes && !self.is_number() { format!("{word:?}") } else { word.to_string() };
        self.example.iter().map(text).collect::<Vec<_>>().join(", ")
    }

    /// Its example as a front writes it.
    pub fn written(&self, front: Front) -> String {
        let name = self.called(front).unwrap_or(self.name);
        let is_item = matches!(&self.kind, OptionKind::Words(of) if of.is_of_items);
        match front {
            Front::CommandLine => {
                let flag = format!("--{}", name.replace('_', "-"));
                let values = match &self.kind {
                    _ if self.example.is_empty() => return flag,
                    OptionKind::Vector | OptionKind::Names { commas: true } => vec![self.example.join(",")],
                    _ => self.example.iter().map(ToString::to_string).collect(),
                };
                values.iter().map(|value| format!("{flag}={value}")).collect::<Vec<_>>().join(" ")
            }
            Front::Derive if self.example.is_empty() => name.to_string(),
            Front::Derive if self.is_list() => format!("{name}({})", self.quoted(!is_item)),
            Front::Derive => format!("{name} = {}", self.quoted(!is_item)),
            Front::Builder => format!(".option({name:?}, {})", self.bracketed()),
        }
    }

    /// Its example as a scene file writes it.
    pub fn written_in_scene(&self) -> String {
        format!("{} = {}", self.name, self.bracketed())
    }

    fn bracketed(&self) -> String {
        match self.example {
            [] => "true".to_string(),
            _ if self.is_list() => format!("[{}]", self.quoted(true)),
            _ => self.quoted(true),
        }
    }
}

fn row_of(name: &str) -> &'static OptionRow {
    TABLE.iter().find(|row| row.name == name).expect("what was given is in the table")
}

/// Options that were given, with their values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenOptions {
    given: Vec<(&'static str, OptionValue)>,
}

impl GivenOptions {
    /// Gives an option a value, in place of an earlier one; levels of warnings are added.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn give(&mut self, row: &'static OptionRow, value: OptionValue, front: Front) -> Result<(), Vec<Diagnostic>> {
        let wrong = row.wrong(&value, front);
        if !wrong.is_empty() {
            return Err(wrong);
        }
        if !matches!(row.kind, OptionKind::Codes(_)) {
            self.given.retain(|(name, _)| *name != row.name);
        }
        self.given.push((row.name, value));
        Ok(())
    }

    /// Gives the option of that name a value, as [`GivenOptions::give`] does.
    ///
    /// # Errors
    /// What is wrong with it, or that there is none.
    pub fn set(&mut self, name: &str, value: impl Into<OptionValue>, front: Front) -> Result<(), Vec<Diagnostic>> {
        let row = OptionRow::find(name, |row| row.is_value(front));
        let row = row.map_err(|unknown| vec![Diagnostic::error("unknown-key", unknown)])?;
        self.give(row, value.into(), front)
    }

    /// Whether an option was given.
    pub fn has(&self, name: &str) -> bool {
        self.value(name).is_some()
    }

    pub(super) fn value(&self, name: &str) -> Option<&OptionValue> {
        self.given.iter().find(|(given, _)| *given == name).map(|(_, value)| value)
    }

    /// Adds others, which count before these.
    pub fn extend(&mut self, others: &GivenOptions) {
        for (name, value) in &others.given {
            self.give(row_of(name), value.clone(), Front::CommandLine).expect("it was right when it was given");
        }
    }

    /// Sets them, in the order of the table; levels of warnings in the order in which they were given.
    pub fn apply(&self, options: &mut Options) {
        let levels = TABLE.iter().position(|row| row.group == OptionGroup::Reporting);
        let place = |name: &str| TABLE.iter().position(|row| row.name == name).min(levels);
        let mut given: Vec<_> = self.given.iter().collect();
        given.sort_by_key(|(name, _)| place(name));
        given.into_iter().for_each(|(name, value)| (row_of(name).set)(options, value));
    }
}
