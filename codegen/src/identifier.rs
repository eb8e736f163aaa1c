//! What people call things, as it stands in generated code: identifiers, and text in comments and documentation.
//!
//! Everything that a robot file or a scene names passes through here. An identifier is ASCII: other letters are transliterated
//! (`Fuß` becomes `fuss`), so that composed and decomposed letters are the same name, C takes it, and no letter looks like
//! another one. What a language or the generated file itself needs for something else gets a word more (`box` of a body becomes
//! `box_body`); two names that become one are for the caller to refuse.

use crate::function::{ContactFunction, Function, Quantity};
use deunicode::deunicode_with_tofu;

mod reserved;

use reserved::{words, RESERVED};

/// An identifier has at most so many characters, without what it gets for being reserved.
const LONGEST: usize = 64;
/// Of a name, a comment shows so many characters.
const LONGEST_SHOWN: usize = 200;

/// What an identifier is made of a name without a letter or digit; nothing else becomes that.
pub const UNNAMED: &str = "unnamed";

/// What the generated file puts behind the name of a function.
const BEHIND_FUNCTIONS: [&str; 9] =
    ["part", "lanes", "in_lanes", "batch", "error_bound", "values", "program", "cost", "figures"];

/// A name as a word of small letters, digits and `_`: `left hand-2` becomes `left_hand_2`. It may be reserved; as a beginning of
/// longer identifiers it will do.
pub fn snake_case(name: &str) -> String {
    let ascii = if name.is_ascii() { name.into() } else { deunicode_with_tofu(name, " ") };
    let mut out = String::new();
    for c in ascii.chars() {
        if c.is_ascii_alphanumeric() {
            out.push(c.to_ascii_lowercase());
        } else if !out.is_empty() && !out.ends_with('_') {
            out.push('_');
        }
    }
    out.truncate(LONGEST);
    let out = out.trim_end_matches('_');
    match out.chars().next() {
        Some(c) if c.is_ascii_digit() => format!("n{out}"),
        None => UNNAMED.to_string(),
        _ => out.to_string(),
    }
}

/// A name as an identifier of its own, in Rust and in C; one that is reserved says what it is the name of: `box` of a `body`
/// becomes `box_body`.
pub fn identifier(name: &str, what: &str) -> String {
    let word = snake_case(name);
    match is_reserved(&word) {
        true => format!("{word}_{what}"),
        false => word,
    }
}

/// A name as a module with a variant of its own beside it, both among their like only: what is reserved for inputs or functions is not
/// for them. A keyword, or a type that the module would hide, gets a word more.
pub fn module_name(name: &str, what: &str) -> String {
    let word = snake_case(name);
    match words(&RESERVED[..2]).any(|reserved| reserved == word) {
        true => format!("{word}_{what}"),
        false => word,
    }
}

/// An identifier as a type: `left_hand_2` becomes `LeftHand2`.
pub fn upper_camel_case(name: &str) -> String {
    let word = |w: &str| {
        let mut letters = w.chars();
        letters.next().map(|c| c.to_ascii_uppercase()).into_iter().chain(letters).collect::<String>()
    };
    name.split('_').map(word).collect()
}

/// All words that are reserved one by one.
pub fn reserved() -> impl Iterator<Item = &'static str> {
    words(&RESERVED)
}

/// Whether a word of small letters, or the type made of it, means something else in generated code.
pub fn is_reserved(word: &str) -> bool {
    let type_name = upper_camel_case(word);
    reserved().any(|r| r == word || upper_camel_case(r) == type_name)
        || word.strip_suffix("_error").is_some_and(|word| reserved().any(|r| r == word))
        || Quantity::named(word).is_some()
        || belongs_to_a_function(word)
}

/// Whether it is a function, or what the file has of one: `energy_lanes`, `energy_part12`.
fn belongs_to_a_function(word: &str) -> bool {
    let plain = Function::known().map(Function::name);
    let mut functions = plain.chain(ContactFunction::ALL.iter().map(|f| f.name()));
    functions.any(|function| match word.strip_prefix(function) {
        Some("") => true,
        Some(rest) => rest.strip_prefix('_').is_some_and(|rest| BEHIND_FUNCTIONS.iter().any(|b| rest.starts_with(b))),
        None => false,
    })
}

/// Whether C and Rust can use it as the beginning of names.
pub fn is_prefix(text: &str) -> bool {
    let mut bytes = text.bytes();
    text.len() <= LONGEST
        && bytes.next().is_some_and(|b| b.is_ascii_alphabetic() || b == b'_')
        && bytes.all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// A robot's name as the beginning of names in C, or as that of a file: as [`snake_case`], but capital letters stay; a leading digit
/// gets `robot_` in front.
pub fn prefix(name: &str) -> String {
    let ascii = if name.is_ascii() { name.into() } else { deunicode_with_tofu(name, " ") };
    let words = ascii.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let mut text = words.collect::<Vec<_>>().join("_");
    if !text.starts_with(|c: char| c.is_ascii_alphabetic()) {
        text.insert_str(0, "robot_");
    }
    text.truncate(LONGEST);
    text.trim_end_matches('_').to_string()
}

/// An identifier as the name of a package for cargo.
pub fn package_name(identifier: &str) -> String {
    let words: Vec<&str> = identifier.split('_').filter(|word| !word.is_empty()).collect();
    let name = words.join("-");
    match name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        true => name,
        false => format!("robot-{name}"),
    }
}

/// A name as part of a comment, in Rust, C and TOML: it stays on its line, does not end or begin a comment, and shows what no eye
/// sees or what turns the writing around (as `\u{202e}`).
pub fn comment(name: &str) -> String {
    let mut shown: String = name.chars().take(LONGEST_SHOWN).map(|c| escaped(c).unwrap_or(c.into())).collect();
    if name.chars().nth(LONGEST_SHOWN).is_some() {
        shown.push('…');
    }
    shown.replace("*/", "* /").replace("/*", "/ *")
}

/// A name between backquotes in documentation.
pub fn doc(name: &str) -> String {
    comment(name).replace('`', "'")
}

/// Texts as elements of an array of strings, each a literal of Rust.
pub fn string_literals<'a>(texts: impl IntoIterator<Item = &'a str>) -> String {
    texts.into_iter().map(string_literal).collect::<Vec<_>>().join(", ")
}

/// A text as a literal of Rust.
pub fn string_literal(text: &str) -> String {
    let inner = |c: char| match c {
        '"' => "\\\"".to_string(),
        '\\' => "\\\\".to_string(),
        c => escaped(c).unwrap_or(c.into()),
    };
    format!("\"{}\"", text.chars().map(inner).collect::<String>())
}

/// The escape of what has no glyph of its own: control characters, ends of lines, marks that change the direction of writing or have
/// no width.
fn escaped(c: char) -> Option<String> {
    let is_invisible = c.is_control()
        || matches!(c,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}'
            | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}');
    is_invisible.then(|| c.escape_default().to_string())
}

/// The last part of a path.
pub fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn a_name_becomes_an_identifier_whatever_it_is_made_of() {
        for (name, expected) in [
            ("tool", "tool"),
            ("left hand-2", "left_hand_2"),
            ("2nd-load", "n2nd_load"),
            ("Fu\u{df}", "fuss"),
            ("r\u{e9}gulateur", "regulateur"),
            ("re\u{301}gulateur", "regulateur"),
            ("\u{440}\u{443}\u{43a}\u{430}", "ruka"),
            ("\u{673a}\u{5668}\u{4eba}", "ji_qi_ren"),
            ("a\u{202e}b", "ab"),
            ("box", "box_body"),
            ("Self", "self_body"),
            ("h", "h_body"),
            ("N", "n_body"),
            ("Box", "box_body"),
            ("as-ref", "as_ref_body"),
            ("inverse dynamics", "inverse_dynamics_body"),
            ("energy_part3", "energy_part3_body"),
            ("tau_error", "tau_error_body"),
            ("energy_absorber", "energy_absorber"),
            ("body", "body"),
            ("\u{2026}", UNNAMED),
            ("", UNNAMED),
        ] {
            assert_eq!(identifier(name, "body"), expected, "{name:?}");
        }
        for (name, expected) in
            [("mass", "mass"), ("q", "q"), ("loop", "loop_mode"), ("self", "self_mode"), ("f64", "f64_mode")]
        {
            assert_eq!(module_name(name, "mode"), expected);
        }
        let long = identifier(&"ab_".repeat(1000), "body");
        assert!(long.len() <= LONGEST && !long.ends_with('_'), "{long}");
    }

    pub fn every_name_is_a_prefix_and_every_prefix_makes_a_package() {
        for (name, expected) in [
            ("panda", "panda"),
            ("UR-5 e", "UR_5_e"),
            ("7dof", "robot_7dof"),
            ("(2R)", "robot_2R"),
            ("[7dof]", "robot_7dof"),
            ("", "robot"),
            ("__", "robot"),
            ("\u{440}\u{443}\u{43a}\u{430}", "ruka"),
        ] {
            assert_eq!(prefix(name), expected);
            assert!(is_prefix(&prefix(name)));
        }
        assert!(is_prefix(&prefix(&"9".repeat(1000))));
        assert!(!is_prefix("a-b") && !is_prefix("") && !is_prefix("9") && !is_prefix(&"a".repeat(1000)));
        for (identifier, package) in
            [("panda_dynamics", "panda-dynamics"), ("_2r__dynamics", "robot-2r-dynamics"), ("__", "robot-")]
        {
            assert_eq!(package_name(identifier), package);
        }
    }

    pub fn no_reserved_word_is_left_as_an_identifier() {
        for word in reserved() {
            assert_eq!(snake_case(word), word, "reserved words are written as identifiers are");
            assert!(is_reserved(word) && !is_reserved(&identifier(word, "body")), "{word}");
            assert!(!is_reserved(&identifier(word, "mode")), "{word}");
        }
    }

    pub fn a_name_cannot_leave_the_comment_it_stands_in() {
        assert_eq!(comment("a*/\nint x;"), "a* /\\nint x;");
        assert_eq!(comment("a/*b"), "a/ *b");
        assert_eq!(comment("\u{202e}a\u{2028}b\rc"), "\\u{202e}a\\u{2028}b\\rc");
        assert_eq!(comment("Greifer, f\u{fc}nf"), "Greifer, f\u{fc}nf");
        assert!(comment(&"x".repeat(100_000)).len() < 1000);
        assert_eq!(doc("a`b"), "a'b");
    }

    /// A literal for each of these; `read` reads it back as the language does.
    pub fn a_literal_reads_back_to_the_text(read: impl Fn(&str) -> String) {
        for text in ["a\"b\\c\n", "\u{202e}\u{0}\u{feff}", "\u{440}\u{443}\u{43a}\u{430} {}", "e\u{301}"] {
            let literal = string_literal(text);
            assert!(!literal.chars().any(|c| escaped(c).is_some()), "{literal}");
            assert_eq!(read(&literal), text);
        }
    }
}
