//! The kernel of sines, cosines, roots and signs in C, of which a package gets what it uses.
//!
//! Another function, such as a shorter sine in f32, is a section of `pasted/kernel.c`, under the name by which routines call it.

use std::collections::BTreeSet;

/// The twin of `runtime/core/src/trig.rs`, in sections.
pub const KERNEL: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/pasted/kernel.c"));

/// How a section begins.
const SECTION: &str = "/*== ";

/// The sections that a text uses, and those that they use, in order; their names begin with the prefix.
pub(super) fn used_by(text: &str, prefix: &str) -> String {
    let source = KERNEL.replace("robot_", &format!("{prefix}_"));
    let mut names: BTreeSet<String> = words(text).map(str::to_string).collect();
    let mut out = String::new();
    // what a section needs stands before it
    for section in source.split(SECTION).skip(1).collect::<Vec<_>>().into_iter().rev() {
        let (_, body) = section.split_once('\n').expect("a section has a line with its name");
        if defined(body).any(|name| names.contains(name)) {
            names.extend(words(body).map(str::to_string));
            out.insert_str(0, body);
        }
    }
    out
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
}

/// The functions and types that a section defines.
fn defined(section: &str) -> impl Iterator<Item = &str> {
    section.lines().filter_map(|line| match line.strip_prefix("} ") {
        Some(name) => name.strip_suffix(';'),
        None => line.strip_prefix("static ").and_then(|head| words(head.split('(').next()?).last()),
    })
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn a_text_gets_the_sections_that_it_uses_and_no_others() {
        let text = used_by("x = arm_sqrt_f64(y);", "arm");
        assert!(text.contains("arm_to_bits_f64(double x)\n{") && text.contains("arm_sqrt_f64(double x)\n{"), "{text}");
        assert!(!text.contains("sin") && !text.contains("float"), "{text}");
        assert_eq!(used_by("x = arm_sqrt_f64_of(y) + sqrt_f64(y);", "arm"), "");
        let text = used_by("arm_next_angle_f32", "arm");
        assert!(text.starts_with("/* The sum of some angles") && !text.contains("robot_"), "{text}");
    }
}
