//! `"panda.urdf", floating_base, scalar = "f32", functions(inverse_dynamics, mass_matrix), …`

use crate::scene::InlineScene;
use proc_macro2::{Span, TokenTree};
use straightline_codegen::diagnostic::{Diagnostic, Front};
use straightline_codegen::options::table::{OptionGroup, OptionKind, OptionRow};
use straightline_codegen::options::{GivenOptions, OptionValue};
use syn::parse::{Parse, ParseStream};
use syn::punctuated::Punctuated;
use syn::{parenthesized, token, Attribute, Error, Ident, Lit, LitBool, LitStr, Result, Token, Visibility};

/// The robot file, the scene and the options, as both macros take them.
#[derive(Default)]
pub struct Arguments {
    /// The name of the robot file; `None` if it cannot be read.
    pub robot: Option<LitStr>,
    pub scene: Option<SceneArgument>,
    /// The module that the derive puts everything in, where the user can reach it.
    pub module: Option<Ident>,
    pub settings: GivenOptions,
    /// What is wrong with them: what could be read of the others counts nevertheless.
    pub errors: Vec<Error>,
    /// What was asked for as a function and is none.
    pub unknown: Vec<Ident>,
}

impl Arguments {
    /// Those of which nothing can be read.
    pub fn unreadable(error: Error) -> Self {
        let errors = error.into_iter().collect();
        Arguments { errors, ..Arguments::default() }
    }

    /// Where complaints about all of it stand.
    pub fn place(&self) -> Span {
        self.robot.as_ref().map_or_else(Span::call_site, LitStr::span)
    }
}

/// `scene = "still.toml"` or `scene(zero(qd = true))`
pub enum SceneArgument {
    File(LitStr),
    Inline(InlineScene),
}

/// `pub mod panda = "panda.urdf", …`
pub struct ModuleList {
    pub attributes: Vec<Attribute>,
    pub visibility: Visibility,
    pub name: Ident,
    pub arguments: Arguments,
}

impl Parse for ModuleList {
    fn parse(input: ParseStream) -> Result<Self> {
        let attributes = input.call(Attribute::parse_outer)?;
        let visibility = input.parse()?;
        input.parse::<Token![mod]>()?;
        let name = input.parse()?;
        input.parse::<Token![=]>()?;
        Ok(ModuleList { attributes, visibility, name, arguments: input.parse()? })
    }
}

impl Parse for Arguments {
    fn parse(input: ParseStream) -> Result<Self> {
        let mut arguments = Arguments::default();
        match input.peek(LitStr) {
            true => arguments.robot = Some(input.parse()?),
            false => {
                arguments.errors.push(input.error("the path of a robot file comes first, as in \"robots/arm.urdf\""))
            }
        }
        while !input.is_empty() {
            if arguments.robot.is_some() || input.peek(Token![,]) {
                if let Err(error) = input.parse::<Token![,]>() {
                    arguments.errors.extend(error);
                    skip(input)?;
                    continue;
                }
            }
            if !input.is_empty() {
                if let Err(error) = option(input, &mut arguments) {
                    arguments.errors.extend(error);
                    skip(input)?;
                } else if !input.is_empty() && !input.peek(Token![,]) {
                    arguments.errors.push(input.error("a comma is wanted between options"));
                    skip(input)?;
                }
            }
        }
        Ok(arguments)
    }
}

/// Goes on to the next comma.
fn skip(input: ParseStream) -> Result<()> {
    while !input.is_empty() && !input.peek(Token![,]) {
        input.parse::<TokenTree>()?;
    }
    Ok(())
}

/// How macros are spoken to.
const FRONT: Front = Front::Derive;

fn option(input: ParseStream, arguments: &mut Arguments) -> Result<()> {
    let key: Ident = input.parse()?;
    // several scalars are a list of them
    let name = key.to_string();
    let name = if name == "scalars" { "scalar" } else { name.as_str() };
    let row =
        OptionRow::find(name, |row| row.called(FRONT).is_some()).map_err(|unknown| Error::new(key.span(), unknown))?;
    match (row.group, row.name) {
        (OptionGroup::Front, "scene") if arguments.scene.is_some() => {
            Err(Error::new(key.span(), "there is a scene already"))
        }
        (OptionGroup::Front, "scene") => {
            arguments.scene = Some(if input.peek(Token![=]) {
                SceneArgument::File(value(input)?)
            } else {
                SceneArgument::Inline(InlineScene::parse(&key, input)?)
            });
            Ok(())
        }
        (OptionGroup::Front, _) => {
            arguments.module = Some(value::<LitStr>(input)?.parse()?);
            Ok(())
        }
        _ => {
            let mut errors = None;
            let value = value_of(row, &key, input, &mut errors, &mut arguments.unknown)?;
            let given = arguments.settings.give(row, value, FRONT);
            if let (None, Err(wrong)) = (&errors, given) {
                wrong.iter().for_each(|wrong| keep(&mut errors, said(key.span(), wrong)));
            }
            errors.map_or(Ok(()), Err)
        }
    }
}

/// A complaint at a token.
fn said(place: Span, wrong: &Diagnostic) -> Error {
    Error::new(place, wrong.sentence())
}

/// The value of an option. What is wrong with single words goes to `errors`, names of items that there are not to `unknown`; words that
/// are right count.
fn value_of(
    row: &OptionRow,
    key: &Ident,
    input: ParseStream,
    errors: &mut Option<Error>,
    unknown: &mut Vec<Ident>,
) -> Result<OptionValue> {
    let is_alone = !input.peek(Token![=]) && !input.peek(token::Paren);
    let wrong_form = || said(key.span(), &row.wrong_form(FRONT));
    let mut right = |text: String, place: Span| match row.wrong_word(&text) {
        None => Some(text),
        Some(wrong) => {
            keep(errors, said(place, &wrong));
            None
        }
    };
    Ok(match &row.kind {
        OptionKind::Flag if is_alone => true.into(),
        OptionKind::Flag => value::<LitBool>(input)?.value.into(),
        OptionKind::Word(_, Some(alone)) if is_alone => (*alone).into(),
        _ if is_alone => return Err(wrong_form()),
        OptionKind::Real(..) | OptionKind::Whole(..) => {
            let given = value(input)?;
            let number = number(&given)?;
            row.wrong_number(number).into_iter().for_each(|wrong| keep(errors, said(given.span(), &wrong)));
            number.into()
        }
        OptionKind::Vector => {
            let numbers = list::<Lit>(input)?.iter().map(number).collect::<Result<Vec<f64>>>()?;
            OptionValue::Numbers(numbers)
        }
        OptionKind::Words(of) if of.is_of_items => {
            let mut known = Vec::new();
            for name in list::<Ident>(input)? {
                match right(name.to_string(), name.span()) {
                    Some(word) => known.push(word),
                    None => unknown.push(name),
                }
            }
            OptionValue::Words(known)
        }
        _ => {
            let words = if input.peek(Token![=]) { vec![value::<LitStr>(input)?] } else { list::<LitStr>(input)? };
            OptionValue::of_words(words.iter().filter_map(|word| right(word.value(), word.span())))
        }
    })
}

/// One error more.
fn keep(errors: &mut Option<Error>, error: Error) {
    match errors {
        None => *errors = Some(error),
        Some(errors) => errors.combine(error),
    }
}

/// ` = value`
fn value<T: Parse>(input: ParseStream) -> Result<T> {
    input.parse::<Token![=]>()?;
    input.parse()
}

/// `(a, b, c)`
fn list<T: Parse>(input: ParseStream) -> Result<Vec<T>> {
    let inner;
    parenthesized!(inner in input);
    Ok(Punctuated::<T, Token![,]>::parse_terminated(&inner)?.into_iter().collect())
}

fn number(literal: &Lit) -> Result<f64> {
    match literal {
        Lit::Float(x) => x.base10_parse(),
        Lit::Int(x) => x.base10_parse(),
        other => Err(Error::new_spanned(other, "a number is wanted")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use straightline_codegen::options::table::TABLE;

    fn arguments(options: &str) -> Arguments {
        syn::parse_str(&format!("\"arm.toml\", {options}")).unwrap_or_else(|error| panic!("{options}: {error}"))
    }

    #[test]
    fn every_row_of_the_table_is_a_key_or_says_why_not() {
        for row in TABLE.iter().filter(|row| row.name != "scene") {
            let written = row.written(FRONT);
            let read = arguments(&written);
            if row.called(FRONT).is_none() {
                assert!(read.errors[0].to_string().starts_with(&format!("there is no option `{}`", row.name)));
                continue;
            }
            assert!(read.errors.is_empty(), "{written}: {:?}", read.errors);
            let mut wanted = GivenOptions::default();
            match row.group {
                OptionGroup::Front => assert_eq!(read.module.expect("a module").to_string(), row.example[0]),
                _ => wanted.give(row, row.parse(row.example, FRONT).unwrap(), FRONT).unwrap(),
            }
            assert_eq!(read.settings, wanted, "{written}");
        }
        assert!(arguments("scene = \"still.toml\"").scene.is_some());
    }

    #[test]
    fn all_that_is_wrong_with_options_is_said_with_what_is_right() {
        let read = arguments(
            "lanes, lans = \"runtime\", fma = \"calller\", angle_tolerance = 0.5, certify_boxes = 1.5, gravity(1.0, 2.0), generic = 3, \
             functions(RNEA, energy), max_part_operations = 99",
        );
        let said: Vec<String> = read.errors.iter().map(ToString::to_string).collect();
        let parts = [
            "`lanes` takes one of standalone, runtime; write `lanes = \"runtime\"`",
            "there is no option `lans`; did you mean `lanes`?",
            "there is no way to fuse `calller`; did you mean `caller`?",
            "angle_tolerance: 0.5 is not between 0 and 0.1 rad",
            "certify_boxes: 1.5 is not between 1 and 100000",
            "`gravity` takes three numbers; write `gravity(0, 0, -1.62)`",
            "expected boolean literal",
            "there is no function `RNEA`; did you mean `inverse_dynamics`?",
            "max_part_operations: 99.0 is not a whole number from 100",
        ];
        assert_eq!(said.len(), parts.len(), "{said:#?}");
        for (said, part) in said.iter().zip(parts) {
            assert!(said.contains(part), "{said} has no {part}");
        }
        let [unknown] = &read.unknown[..] else { panic!("one name is unknown") };
        assert_eq!(unknown, "RNEA");
    }

    #[test]
    fn what_is_alone_and_what_is_switched_off_means_what_it_says() {
        let of = |text: &str| {
            let mut options = straightline_codegen::Options::default();
            let read = arguments(text);
            assert!(read.errors.is_empty(), "{text}: {:?}", read.errors);
            read.settings.apply(&mut options);
            options.hashed()
        };
        assert_eq!(of("fma, generic = false"), "{fma=true;}");
        assert_eq!(of("fma = \"caller\", scalars(\"f64\", \"f32\")"), "{also=[f32,];fma=true;fma_by_caller=true;}");
        assert_eq!(of("certify_boxes = 3, certify = false"), "{}");
    }
}
