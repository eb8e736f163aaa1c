//! A scene that is written in the macro itself: `scene(zero(qd = true), hold(joints = { wrist = 0.5 }))`, the tables and
//! keys of a scene file. It becomes the text of one, so that there is one reader; each token's place in that text is kept,
//! so that a complaint stands at the token.

use proc_macro2::Span;
use std::ops::Range;
use straightline_codegen::diagnostic::{Diagnostic, Source};
use straightline_codegen::options::scene_file::LISTS;
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::spanned::Spanned;
use syn::{braced, bracketed, parenthesized, token, Error, Ident, Lit, LitStr, Result, Token};

/// The name under which complaints mention the text.
const NAME: &str = "scene(..)";

/// The text of a scene file, and what its pieces stand for.
pub struct InlineScene {
    text: String,
    /// Pieces of the text and the tokens they were made of; a piece may lie within another one.
    pieces: Vec<(Range<usize>, Span)>,
}

impl InlineScene {
    /// What follows `scene`, in parentheses.
    pub fn parse(keyword: &Ident, input: ParseStream) -> Result<Self> {
        let mut scene = InlineScene { text: String::new(), pieces: vec![(0..0, keyword.span())] };
        let content;
        parenthesized!(content in input);
        while !content.is_empty() {
            scene.table(&content)?;
            if !content.is_empty() {
                content.parse::<Token![,]>()?;
            }
        }
        Ok(scene)
    }

    /// As a scene file.
    pub fn source(&self) -> Source {
        Source::new(NAME, self.text.as_str())
    }

    /// A complaint about it, at the token where it arose.
    pub fn error(&self, complaint: &Diagnostic) -> Error {
        let mut message = complaint.title.clone();
        for (word, text) in [("note", &complaint.detail), ("help", &complaint.help)] {
            if !text.is_empty() {
                message.push_str(&format!("\n{word}: {text}"));
            }
        }
        Error::new(self.span(complaint.place.as_ref().map_or(0, |place| place.span.start)), message)
    }

    /// The smallest piece around a place of the text, or else the last one before it.
    fn span(&self, at: usize) -> Span {
        let around = self.pieces.iter().filter(|(piece, _)| piece.contains(&at)).min_by_key(|(piece, _)| piece.len());
        let before = || self.pieces.iter().filter(|(piece, _)| piece.start <= at).max_by_key(|(piece, _)| piece.start);
        around.or_else(before).map_or_else(Span::call_site, |piece| piece.1)
    }

    fn push(&mut self, text: &str, span: Span) {
        let start = self.text.len();
        self.text.push_str(text);
        self.pieces.push((start..self.text.len(), span));
    }

    /// `zero(qd = true)`: the table `[zero]`, or one more of the list `[[payload]]`.
    fn table(&mut self, input: ParseStream) -> Result<()> {
        let name = input.call(Ident::parse_any)?;
        let word = name.unraw().to_string();
        let header = if LISTS.contains(&word.as_str()) { format!("[[{word}]]") } else { format!("[{word}]") };
        self.push(&header, name.span());
        self.text.push('\n');
        let content;
        parenthesized!(content in input);
        while !content.is_empty() {
            self.entry(&content)?;
            self.text.push('\n');
            if !content.is_empty() {
                content.parse::<Token![,]>()?;
            }
        }
        Ok(())
    }

    /// `key = value`, or `key(..)` for a table.
    fn entry(&mut self, input: ParseStream) -> Result<()> {
        if input.peek(LitStr) {
            let key: LitStr = input.parse()?;
            self.push(&quoted(&key.value()), key.span());
        } else {
            let key = input.call(Ident::parse_any)?;
            self.push(&key.unraw().to_string(), key.span());
        }
        self.text.push_str(" = ");
        if input.peek(token::Paren) {
            let content;
            parenthesized!(content in input);
            return self.entries(&content);
        }
        input.parse::<Token![=]>()?;
        self.value(input)
    }

    fn entries(&mut self, content: ParseStream) -> Result<()> {
        self.text.push_str("{ ");
        self.separated(content, Self::entry)?;
        self.text.push_str(" }");
        Ok(())
    }

    fn value(&mut self, input: ParseStream) -> Result<()> {
        let (start, content);
        if input.peek(token::Bracket) {
            let bracket = bracketed!(content in input);
            start = self.text.len();
            self.text.push('[');
            self.separated(&content, Self::value)?;
            self.text.push(']');
            self.pieces.push((start..self.text.len(), bracket.span.join()));
        } else if input.peek(token::Brace) {
            let brace = braced!(content in input);
            start = self.text.len();
            self.entries(&content)?;
            self.pieces.push((start..self.text.len(), brace.span.join()));
        } else {
            let minus: Option<Token![-]> = input.parse()?;
            let literal: Lit = input.parse()?;
            let text = match (&literal, &minus) {
                (Lit::Str(text), None) => quoted(&text.value()),
                (Lit::Bool(flag), None) => flag.value.to_string(),
                (Lit::Int(number), _) if number.suffix().is_empty() => number.base10_digits().to_string(),
                (Lit::Float(number), _) if number.suffix().is_empty() => {
                    let digits = number.base10_digits();
                    let fraction = if digits.ends_with('.') { "0" } else { "" };
                    format!("{digits}{fraction}")
                }
                _ => return Err(Error::new(literal.span(), "a number, a text in quotes, true or false is wanted")),
            };
            let sign = if minus.is_some() { "-" } else { "" };
            self.push(&format!("{sign}{text}"), minus.map_or(literal.span(), |minus| minus.span()));
        }
        Ok(())
    }

    fn separated(
        &mut self,
        content: ParseStream,
        mut item: impl FnMut(&mut Self, ParseStream) -> Result<()>,
    ) -> Result<()> {
        while !content.is_empty() {
            item(self, content)?;
            if !content.is_empty() {
                content.parse::<Token![,]>()?;
                self.text.push_str(", ");
            }
        }
        Ok(())
    }
}

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    let mut out = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use straightline_codegen::diagnostic::Diagnostics;
    use straightline_codegen::options::scene_file::{read, SceneFile};
    use straightline_codegen::scene::{Budget, Gravity, ResultPart, Zero};
    use straightline_codegen::Function;
    use syn::parse::Parse;

    struct ParsedScene(InlineScene);

    impl Parse for ParsedScene {
        fn parse(input: ParseStream) -> Result<Self> {
            let keyword = input.parse()?;
            InlineScene::parse(&keyword, input).map(ParsedScene)
        }
    }

    fn scene(text: &str) -> InlineScene {
        syn::parse_str::<ParsedScene>(text).unwrap_or_else(|error| panic!("{text}: {error}")).0
    }

    fn understood(text: &str) -> SceneFile {
        let mut diagnostics = Diagnostics::new();
        read(&scene(text).source(), &mut diagnostics).unwrap_or_else(|| panic!("{diagnostics}"))
    }

    #[test]
    fn every_kind_of_table_and_value_is_that_of_a_scene_file() {
        let file = understood(
            r#"scene(
                outputs(functions = ["gravity_force"], mass_matrix(joints = ["a b"], part = "diagonal"), staged = true,),
                hold(gravity = [0.0, 0., -1_0.5e-1], joints = { "wrist-1" = -1, elbow = 0.25 }),
                payload(name = "tool", frame = "hand", mass = 2),
                payload(name = "cam\"era", frame = "hand", mass = 1e-1, com = [0.0, 0.0, 0.5]),
                zero(qd = true),
                budget(gravity_force(max_flops = 400)),
            )"#,
        );
        let scene = &file.scene;
        assert_eq!(scene.gravity, Gravity::Constant([0.0, 0.0, -1.05]));
        assert_eq!(scene.locked, [("wrist-1".to_string(), -1.0), ("elbow".to_string(), 0.25)]);
        let payloads: Vec<(&str, f64)> = scene.payloads.iter().map(|p| (p.name.as_str(), p.mass)).collect();
        assert_eq!(payloads, [("tool", 2.0), ("cam\"era", 0.1)]);
        assert_eq!(scene.zero, Zero { qd: true, ..Zero::default() });
        assert_eq!(scene.outputs[&Function::MassMatrix].part, ResultPart::Diagonal);
        assert_eq!(scene.outputs[&Function::MassMatrix].joints, ["a b"]);
        assert!(scene.staged);
        assert_eq!(scene.budgets[&Function::GravityForce], Budget { max_flops: Some(400), ..Budget::default() });
    }

    #[test]
    fn a_list_may_hold_its_first_table_alone_and_keywords_are_names() {
        let file = understood(r#"scene(loop(name = "closed", frame = "a", with = "b", constrained = ["px"]))"#);
        assert_eq!(file.scene.contacts.loops.len(), 1);
    }

    /// The piece of the text that a complaint is put at.
    fn piece_at(scene: &InlineScene, at: usize) -> &str {
        let found = scene.pieces.iter().filter(|p| p.0.contains(&at)).min_by_key(|p| p.0.len()).expect("a piece");
        &scene.text[found.0.clone()]
    }

    #[test]
    fn a_complaint_is_put_at_the_token_it_is_about() {
        for (text, piece) in [
            (r#"scene(zero(qdot = true))"#, "qdot"),
            (r#"scene(zero(qd = 3))"#, "3"),
            (r#"scene(nought(qd = true))"#, "[nought]"),
            (r#"scene(hold(gravity = [0.0, "x", 1.0]))"#, "\"x\""),
            (r#"scene(payload(name = "tool", frame = "hand", mass = -"1"))"#, ""),
        ] {
            if piece.is_empty() {
                assert!(syn::parse_str::<ParsedScene>(text).is_err(), "{text}");
                continue;
            }
            let scene = scene(text);
            let mut diagnostics = Diagnostics::new();
            assert!(read(&scene.source(), &mut diagnostics).is_none(), "{text}");
            let complaint = diagnostics.iter().next().expect("a complaint");
            let place = complaint.place.as_ref().expect("a place");
            assert_eq!(piece_at(&scene, place.span.start), piece, "{}", scene.text);
            assert!(scene.error(complaint).to_string().starts_with(&complaint.title));
        }
    }
}
