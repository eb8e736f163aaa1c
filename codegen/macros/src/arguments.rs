//! `"panda.urdf", floating_base, scalar = "f32", functions(inverse_dynamics, mass_matrix), …`

use crate::scene::InlineScene;
use proc_macro2::{Span, TokenTree};
use straightline_codegen::certify::Effort;
use straightline_codegen::choices::{Choice, Lanes};
use straightline_codegen::diagnostic::wording::did_you_mean;
use straightline_codegen::diagnostic::{Level, Levels};
use straightline_codegen::Options;
use syn::parse::{Parse, ParseStream};
use syn::punctuated::Punctuated;
use syn::{parenthesized, Attribute, Error, Ident, Lit, LitInt, LitStr, Result, Token, Visibility};

/// The robot file, the scene and the options, as both macros take them.
pub struct Arguments {
    /// The name of the robot file; `None` if it cannot be read.
    pub robot: Option<LitStr>,
    pub scene: Option<SceneArgument>,
    /// The module that the derive puts everything in, where the user can reach it.
    pub module: Option<Ident>,
    pub options: Options,
    /// What is wrong with them: what could be read of the others counts nevertheless.
    pub errors: Vec<Error>,
    /// What was asked for as a function and is none.
    pub unknown: Vec<Ident>,
}

impl Arguments {
    /// Those of which nothing can be read.
    pub fn unreadable(error: Error) -> Self {
        let errors = error.into_iter().collect();
        Arguments { robot: None, scene: None, module: None, options: Options::default(), errors, unknown: Vec::new() }
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
pub struct Module {
    pub attributes: Vec<Attribute>,
    pub visibility: Visibility,
    pub name: Ident,
    pub arguments: Arguments,
}

impl Parse for Module {
    fn parse(input: ParseStream) -> Result<Self> {
        let attributes = input.call(Attribute::parse_outer)?;
        let visibility = input.parse()?;
        input.parse::<Token![mod]>()?;
        let name = input.parse()?;
        input.parse::<Token![=]>()?;
        Ok(Module { attributes, visibility, name, arguments: input.parse()? })
    }
}

impl Parse for Arguments {
    fn parse(input: ParseStream) -> Result<Self> {
        let mut arguments = Arguments {
            robot: None,
            scene: None,
            module: None,
            options: Options::default(),
            errors: Vec::new(),
            unknown: Vec::new(),
        };
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

/// All options, in the order of the documentation.
const OPTIONS: &[&str] = &[
    "functions",
    "frames",
    "scalar",
    "scalars",
    "floating_base",
    "joint_order",
    "generic",
    "fma",
    "fma_by_caller",
    "lanes",
    "gravity",
    "angle_tolerance",
    "rules",
    "forward_dynamics",
    "limbs",
    "max_part_operations",
    "certify",
    "certify_boxes",
    "certify_seconds",
    "certify_state",
    "scene",
    "module",
    "allow",
    "warn",
    "deny",
];

fn option(input: ParseStream, arguments: &mut Arguments) -> Result<()> {
    let key: Ident = input.parse()?;
    let options = &mut arguments.options;
    match key.to_string().as_str() {
        "scene" if arguments.scene.is_some() => return Err(Error::new(key.span(), "there is a scene already")),
        "scene" => {
            arguments.scene = Some(if input.peek(Token![=]) {
                SceneArgument::File(value(input)?)
            } else {
                SceneArgument::Inline(InlineScene::parse(&key, input)?)
            });
        }
        "module" => arguments.module = Some(value::<LitStr>(input)?.parse()?),
        "floating_base" => options.model.floating_base = true,
        "certify" => drop(options.certify.get_or_insert_default()),
        "certify_state" => options.certify.get_or_insert_default().companions = true,
        "certify_boxes" => options.certify.get_or_insert_default().boxes = count(input, Effort::MOST_BOXES)?,
        "certify_seconds" => {
            let given = value::<Lit>(input)?;
            let seconds = number(&given)?;
            if !(seconds > 0.0 && seconds <= Effort::MOST_SECONDS) {
                return Err(Error::new(given.span(), format!("seconds, above 0 and up to {}", Effort::MOST_SECONDS)));
            }
            let effort = options.certify.get_or_insert_default();
            let boxes = (effort.boxes > 1).then_some(effort.boxes);
            *effort = Effort::new(boxes, Some(seconds), effort.companions);
        }
        "scalar" => options.scalar = word(input)?,
        "scalars" => {
            let mut scalars = all(list::<LitStr>(input)?.iter().map(|name| parsed(&name.value(), name)))?.into_iter();
            options.scalar = scalars.next().ok_or_else(|| Error::new(key.span(), "scalars(\"f64\", \"f32\")"))?;
            options.also = scalars.collect();
        }
        "lanes" => options.lanes = Some(Lanes::Runtime),
        "fma" => options.fma = true,
        "fma_by_caller" => (options.fma, options.fma_by_caller) = (true, true),
        "generic" => options.generic = true,
        "rules" => options.grade = word(input)?,
        "forward_dynamics" => options.forward_dynamics = word(input)?,
        "limbs" => options.limbs = word(input)?,
        "max_part_operations" => options.limits.operations = value::<LitInt>(input)?.base10_parse()?,
        "angle_tolerance" => options.model.angle_tolerance = number(&value(input)?)?,
        "functions" => {
            // those that are known are wanted, whatever is wrong with the others
            let mut errors = None;
            options.functions = Vec::new();
            for name in list::<Ident>(input)? {
                match parsed(&name.to_string(), &name) {
                    Ok(function) => options.functions.push(function),
                    Err(error) => {
                        keep(&mut errors, error);
                        arguments.unknown.push(name);
                    }
                }
            }
            options.functions.sort_unstable();
            options.functions.dedup();
            errors.map_or(Ok(()), Err)?;
        }
        "frames" => options.frames = strings(input)?,
        "joint_order" => options.model.joint_order = Some(strings(input)?),
        "gravity" => {
            let numbers = list::<Lit>(input)?.iter().map(number).collect::<Result<Vec<f64>>>()?;
            let three = || Error::new(key.span(), "gravity takes three numbers: gravity(0.0, 0.0, -9.81)");
            options.model.gravity = Some(numbers.try_into().map_err(|_| three())?);
        }
        "allow" => levels(input, options, Level::Allow)?,
        "warn" => levels(input, options, Level::Warn)?,
        "deny" => levels(input, options, Level::Deny)?,
        other => {
            let hint = did_you_mean(other, OPTIONS.iter().copied());
            let hint = hint.unwrap_or_else(|| format!("one of: {}", OPTIONS.join(", ")));
            return Err(Error::new(key.span(), format!("there is no option `{other}`; {hint}")));
        }
    }
    Ok(())
}

/// `("near-right-angle", "axis-length")`
fn levels(input: ParseStream, options: &mut Options, level: Level) -> Result<()> {
    let mut errors = None;
    for code in list::<LitStr>(input)? {
        match Levels::complaint(&code.value(), level) {
            None => options.reporting.levels.set(code.value(), level),
            Some(complaint) => {
                let said = [complaint.title, complaint.help].join("; ");
                keep(&mut errors, Error::new(code.span(), said));
            }
        }
    }
    errors.map_or(Ok(()), Err)
}

/// One error more.
fn keep(errors: &mut Option<Error>, error: Error) {
    match errors {
        None => *errors = Some(error),
        Some(errors) => errors.combine(error),
    }
}

/// All values, or all errors.
fn all<T>(results: impl Iterator<Item = Result<T>>) -> Result<Vec<T>> {
    let (mut values, mut errors) = (Vec::new(), None);
    for result in results {
        match result {
            Ok(value) => values.push(value),
            Err(error) => keep(&mut errors, error),
        }
    }
    errors.map_or(Ok(values), Err)
}

/// ` = value`
fn value<T: Parse>(input: ParseStream) -> Result<T> {
    input.parse::<Token![=]>()?;
    input.parse()
}

/// ` = 40`, from 1.
fn count(input: ParseStream, most: usize) -> Result<usize> {
    let literal: LitInt = value(input)?;
    let count: usize = literal.base10_parse()?;
    match (1..=most).contains(&count) {
        true => Ok(count),
        false => Err(Error::new(literal.span(), format!("a number between 1 and {most}"))),
    }
}

/// `(a, b, c)`
fn list<T: Parse>(input: ParseStream) -> Result<Vec<T>> {
    let inner;
    parenthesized!(inner in input);
    Ok(Punctuated::<T, Token![,]>::parse_terminated(&inner)?.into_iter().collect())
}

fn strings(input: ParseStream) -> Result<Vec<String>> {
    Ok(list::<LitStr>(input)?.iter().map(LitStr::value).collect())
}

/// ` = "word"`
fn word<T: Choice>(input: ParseStream) -> Result<T> {
    let text: LitStr = value(input)?;
    parsed(&text.value(), &text)
}

fn parsed<T: Choice>(text: &str, place: &dyn quote::ToTokens) -> Result<T> {
    T::from_word(text).map_err(|error| Error::new_spanned(place, error))
}

fn number(literal: &Lit) -> Result<f64> {
    match literal {
        Lit::Float(x) => x.base10_parse(),
        Lit::Int(x) => x.base10_parse(),
        other => Err(Error::new_spanned(other, "a number is wanted")),
    }
}
