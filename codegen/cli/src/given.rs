//! Options as arguments: one for each row of the compiler's table.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};
use straightline_codegen::diagnostic::Front;
use straightline_codegen::options::table::{OptionGroup, OptionKind, OptionRow, TABLE};
use straightline_codegen::options::GivenOptions;

const FRONT: Front = Front::CommandLine;

/// The options of a [`OptionGroup`] that are given.
#[derive(Clone, Debug, Default)]
pub struct Given<const GROUP: u8> {
    pub settings: GivenOptions,
}

impl<const GROUP: u8> Given<GROUP> {
    fn rows() -> impl Iterator<Item = &'static OptionRow> {
        TABLE.iter().filter(|row| row.group as u8 == GROUP && row.is_value(FRONT))
    }
}

fn heading(group: u8) -> &'static str {
    let of = |of: OptionGroup| of as u8 == group;
    match group {
        _ if of(OptionGroup::Program) => "What is generated",
        _ if of(OptionGroup::Model) => "How the robot file is read",
        _ => "What is said",
    }
}

/// What an argument's text consists of.
fn parts<'a>(row: &OptionRow, text: &'a str) -> Vec<&'a str> {
    match row.kind {
        OptionKind::Vector => text.split(',').collect(),
        _ => vec![text],
    }
}

/// The argument of an option.
fn argument(row: &'static OptionRow) -> Arg {
    let name = row.called(FRONT).expect("the row has an argument");
    let is_list = matches!(row.kind, OptionKind::Words(_) | OptionKind::Names { commas: false } | OptionKind::Codes(_));
    let repeated = if is_list { "; may be repeated" } else { "" };
    let default = if row.default == "off" { String::new() } else { format!(" [default: {}]", row.default) };
    let arg = Arg::new(row.name)
        .long(&*name.replace('_', "-").leak())
        .help(format!("{}{repeated}{default}", row.doc))
        .value_name(if row.metavar.is_empty() { "BOOL" } else { row.metavar })
        .action(if is_list { ArgAction::Append } else { ArgAction::Set });
    let right = move |text: &str| match row.parse(&parts(row, text), FRONT) {
        Ok(_) => Ok(text.to_string()),
        Err(wrong) => Err(wrong[0].sentence()),
    };
    let optional =
        |arg: Arg, value: &'static str| arg.num_args(0..=1).require_equals(true).default_missing_value(value);
    match &row.kind {
        OptionKind::Flag => optional(arg, "true").value_parser(["true", "false"]).hide_possible_values(true),
        OptionKind::Word(of, alone) => {
            let arg = arg.value_parser(possible((of.words)()));
            alone.iter().fold(arg, |arg, alone| optional(arg, alone))
        }
        OptionKind::Words(of) => arg.value_parser(possible((of.words)())),
        OptionKind::Names { commas: false } => arg,
        OptionKind::Names { commas: true } => arg.value_delimiter(','),
        OptionKind::Vector => arg.allow_hyphen_values(true).value_parser(right),
        OptionKind::Codes(_) | OptionKind::Real(..) | OptionKind::Whole(..) | OptionKind::OfFront => {
            arg.value_parser(right)
        }
    }
}

/// One of these words, each with its meaning.
pub fn possible(words: Vec<(&'static str, &'static str)>) -> impl TypedValueParser<Value = String> {
    PossibleValuesParser::new(words.into_iter().map(|(word, meaning)| PossibleValue::new(word).help(meaning)))
}

impl<const GROUP: u8> Args for Given<GROUP> {
    fn augment_args(command: Command) -> Command {
        let command = command.next_help_heading(heading(GROUP));
        Self::rows().fold(command, |command, row| command.arg(argument(row)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<const GROUP: u8> FromArgMatches for Given<GROUP> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut given = Given::default();
        given.update_from_arg_matches(matches)?;
        Ok(given)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        for row in Self::rows() {
            let Some(words) = matches.get_many::<String>(row.name) else { continue };
            let words: Vec<&str> = words.flat_map(|text| parts(row, text)).collect();
            let value = row.parse(&words, FRONT);
            let given = value.and_then(|value| self.settings.give(row, value, FRONT));
            given.map_err(|wrong| Error::raw(ErrorKind::ValueValidation, wrong[0].sentence()))?;
        }
        Ok(())
    }
}
