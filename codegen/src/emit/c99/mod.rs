//! C: packages of C99 that need no library, and the header that all packages with C functions have.

mod cpp;
mod header;
pub mod interface;
pub(crate) mod kernel;
pub mod opencl;
mod parameter;
mod readme;
mod routine;
mod source;

pub use kernel::KERNEL;
pub use routine::C99;

use super::package::{rust_alone, PackageKind};
use super::Generated;
use crate::identifier::comment;
use interface::Interface;

/// A level of C.
const C_INDENT: &str = "    ";

/// Functions in C99.
pub const C99_SOURCE: PackageKind = PackageKind {
    name: "c99",
    doc: "a C99 source without libraries, its header, and one for C++",
    is_c: true,
    refusal: |generated| {
        rust_alone(generated).or(match () {
            () if generated.style.fused => Some([
                "C99 has a·b + c in one rounding in the library libm alone, which a package of C99 does without",
                "leave out `fma`; `--as c-abi` has it",
            ]),
            () if generated.lanes.is_some() => Some([
                "a package of C99 has no functions over lanes and batches",
                "leave out `lanes`, and call a function once per state; `--as c-abi` has them",
            ]),
            () => None,
        })
    },
    files,
};

/// The files of the package; all C names begin with `prefix`.
fn files(generated: &Generated, prefix: &str) -> Vec<(String, String)> {
    let interface = Interface::new(generated, prefix);
    let library = &interface.library;
    vec![
        (format!("{library}.h"), interface.header(&interface.all_exported(), &interface.check_in_header())),
        (format!("{library}.c"), interface.source()),
        (format!("{library}.hpp"), interface.wrapper_for_cpp()),
        ("README.md".to_string(), interface.readme()),
    ]
}

/// A name as part of a comment of C: nothing in it is a trigraph or looks like a comment.
fn c_comment(text: &str) -> String {
    let mut text = comment(text).replace("//", "/ /");
    while text.contains("??") {
        text = text.replace("??", "? ?");
    }
    text
}

/// A text as a literal of C: other bytes than those of plain ASCII are octal, each in a literal of its own.
fn c_string(text: &str) -> String {
    let mut out = String::from("\"");
    let mut is_octal = false;
    for byte in text.bytes().filter(|b| *b != 0) {
        let plain = (b' '..=b'~').contains(&byte);
        // an escape ends where its literal does, or at the next one
        if is_octal && plain {
            out.push_str("\" \"");
        }
        is_octal = !plain;
        match byte {
            b'"' | b'\\' | b'?' => out.extend(['\\', char::from(byte)]),
            byte if plain => out.push(char::from(byte)),
            byte => out.push_str(&format!("\\{byte:03o}")),
        }
    }
    out.push('"');
    out
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn what_people_call_things_stays_in_its_comment_and_its_literal() {
        assert_eq!(c_comment("a*/ http://x ???/"), "a* / http:/ /x ? ? ?/");
        for (text, literal) in [
            ("arm", "\"arm\""),
            ("a\"b\\c", "\"a\\\"b\\\\c\""),
            ("Fu\u{df}1", "\"Fu\\303\\237\" \"1\""),
            ("a\0??/", "\"a\\?\\?/\""),
            ("\n", "\"\\012\""),
        ] {
            assert_eq!(c_string(text), literal);
        }
    }
}
