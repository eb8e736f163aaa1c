//! The words by which every front names what can be chosen: functions, scalars, rules, methods.

pub mod machine;

pub use machine::{Memory, TargetMachine};

use crate::diagnostic::wording::did_you_mean;
use crate::function::{ForwardDynamicsMethod, Function};
use std::fmt;
use straightline_graph::expr::Grade;
use straightline_graph::Scalar;

/// A choice that has words.
pub trait Choice: Copy + PartialEq + Sized + 'static {
    /// What is chosen, in messages.
    const WHAT: &'static str;

    /// Every word, its meaning in a sentence, and the choice it stands for.
    fn words() -> Vec<(&'static str, &'static str, Self)>;

    /// Whether the words are names of items, which macros write without quotes.
    const IS_ITEM: bool = false;

    /// Its word.
    fn word(self) -> &'static str {
        Self::words().iter().find(|w| w.2 == self).expect("every choice has a word").0
    }

    /// The choice that someone may mean who calls it by another name.
    fn called(_: &str) -> Option<&'static str> {
        None
    }

    /// The choice behind a word.
    ///
    /// # Errors
    /// The word is none of [`Choice::words`].
    fn from_word(word: &str) -> Result<Self, UnknownWord> {
        let words = Self::words();
        match words.iter().find(|(w, _, _)| *w == word) {
            Some((_, _, choice)) => Ok(*choice),
            None => Err(UnknownWord {
                what: Self::WHAT,
                word: word.to_string(),
                known: words.iter().map(|(w, _, _)| *w).collect(),
                called: Self::called(word),
            }),
        }
    }
}

/// A word that names nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownWord {
    /// What it should have named.
    pub what: &'static str,
    /// The word.
    pub word: String,
    /// The words that there are.
    pub known: Vec<&'static str>,
    /// The word of what is called so elsewhere.
    pub called: Option<&'static str>,
}

impl fmt::Display for UnknownWord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "there is no {} `{}`", self.what, self.word.escape_default())?;
        let called = self.called.map(|word| format!("did you mean `{word}`?"));
        match called.or_else(|| did_you_mean(&self.word, self.known.iter().copied())) {
            Some(hint) => write!(f, "; {hint}"),
            None => write!(f, "; one of: {}", self.known.join(", ")),
        }
    }
}

impl std::error::Error for UnknownWord {}

/// How identical limbs are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LimbForm {
    /// Each by itself, with its own constants folded: fewest operations.
    #[default]
    Apart,
    /// As lanes of one body, wherever two are alike: least code.
    Lanes,
    /// As lanes where that is measured to be faster, otherwise apart: see [`LimbForm::of`].
    Auto,
    /// As turns of one loop, wherever two are alike, with a row of constants each: least code where there are no vectors. The same
    /// operations as [`LimbForm::Lanes`].
    Rolled,
}

impl LimbForm {
    /// Whether it is nothing without limbs that are alike.
    pub fn needs_limbs(self) -> bool {
        matches!(self, LimbForm::Lanes | LimbForm::Rolled)
    }
}

/// How columns of matrices are computed that a function solves for, all by the same operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColumnForm {
    /// As lanes of loops where that takes hardly more operations, and no machine is named whose registers the order of operations is made for.
    #[default]
    Auto,
    /// Each by itself.
    Apart,
    /// As lanes of loops wherever four are alike: least code.
    Lanes,
}

/// How much is tried for programs of few operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum OptimisationTier {
    /// Everything that is known to save operations.
    #[default]
    Full,
    /// What takes milliseconds: one form of the robot, one method of forward dynamics.
    Quick,
}

/// The functions over lanes and batches beside the plain ones: where the drivers of the batches come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lanes {
    /// Pasted into the output, which depends on `core` alone: batches use the vector instructions that the crate is compiled
    /// for, and one thread.
    Standalone,
    /// The package `straightline`: the vector instructions of the machine at run time (its feature `std`), several threads
    /// (its feature `rayon`).
    Runtime,
}

/// Which entries of matrices are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum WrittenEntries {
    /// All.
    #[default]
    All,
    /// All, and beside them constants that say which can be non-zero.
    Patterns,
    /// Those that can be non-zero, of symmetric matrices one triangle, packed, with the same constants.
    Nonzeros,
}

/// By what a·b + c is computed in one rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fusion {
    /// As the machine can, by `std`: the last bits depend on it.
    Std,
    /// By `mul_add_f64` (of f32 `mul_add_f32`) of the crate around the output, which needs `core` alone then.
    Caller,
}

/// How programs in fixed point multiply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FixedProducts {
    /// By the high half of products of 64 bits, which the machine has.
    Wide,
    /// From products of 16 bits each, as the machine has no more than 32 bits of a product.
    Halves,
}

impl Choice for Function {
    const WHAT: &'static str = "function";
    const IS_ITEM: bool = true;
    fn words() -> Vec<(&'static str, &'static str, Self)> {
        Function::known().map(|f| (f.name(), f.summary(), f)).collect()
    }
    fn called(alias: &str) -> Option<&'static str> {
        Function::called(alias).map(Function::name)
    }
}

impl Choice for Scalar {
    const WHAT: &'static str = "scalar";
    fn words() -> Vec<(&'static str, &'static str, Self)> {
        Scalar::ALL.iter().map(|s| (s.name(), s.description(), *s)).collect()
    }
}

/// Choices: what is chosen, and every word with its choice and its meaning.
macro_rules! choices {
    ($($type:ident $what:literal { $($word:literal $choice:ident $meaning:literal,)* })*) => {$(
        impl Choice for $type {
            const WHAT: &'static str = $what;
            fn words() -> Vec<(&'static str, &'static str, Self)> {
                vec![$(($word, $meaning, $type::$choice)),*]
            }
        }
    )*};
}

choices! {
    Grade "set of rules" {
        "all" Algebraic "fewest operations; rounding may differ from the generic runtime",
        "exact" Exact "the generic runtime, bit for bit",
    }
    OptimisationTier "tier of optimisation" {
        "full" Full "fewest operations: forms of the robot are searched",
        "quick" Quick "milliseconds: one form of the robot, forward dynamics by articulated bodies",
    }
    ForwardDynamicsMethod "method of forward dynamics" {
        "cheaper" Cheaper "whichever takes fewer operations for this robot",
        "articulated-body" ArticulatedBody "articulated bodies",
        "factorisation" Factorisation "mass matrix and its branch-sparse factor",
    }
    LimbForm "form of identical limbs" {
        "apart" Apart "each by itself, with its own constants: fewest operations",
        "lanes" Lanes "as lanes of one body: least code, and least time where there are four",
        "auto" Auto "as lanes where that is measured to be faster, otherwise apart",
        "rolled" Rolled "one loop over them with a row of constants each: least code on microcontrollers",
    }
    ColumnForm "form of columns that are alike" {
        "auto" Auto "as lanes of one loop where that takes hardly more operations",
        "apart" Apart "each by itself",
        "lanes" Lanes "as lanes of one loop wherever four are alike: least code",
    }
    Lanes "home of the batches" {
        "standalone" Standalone "core alone; the vector instructions that the crate is compiled for",
        "runtime" Runtime "the package `straightline`: the machine's instructions, and threads",
    }
    WrittenEntries "way to write matrices" {
        "all" All "every entry",
        "patterns" Patterns "every entry, and constants that say which can be non-zero: where rows begin, and columns",
        "nonzeros" Nonzeros "the entries that can be non-zero, of symmetric matrices the lower triangle, row by row, with the same constants",
    }
    Memory "memory" {
        "flash" Flash "fetching takes time: fewest bytes, sines by calls",
        "tcm" Tcm "fetching takes none: fewest cycles, sines in place",
    }
    FixedProducts "way to multiply words" {
        "mulh" Wide "the high half of a product of 64 bits, one instruction on rv32im, Cortex-M3 and M4",
        "muls" Halves "products of 16 bits each, for Cortex-M0 and M0+; words are halved where the error allows it",
    }
    Fusion "way to fuse" {
        "std" Std "as the machine can, by std: the last bits depend on it then",
        "caller" Caller "always, by `mul_add_f64` of the crate around the output, which needs core alone",
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn every_word_means_what_it_says() {
        fn all<C: Choice + fmt::Debug>() {
            for (word, meaning, choice) in C::words() {
                assert_eq!(C::from_word(word), Ok(choice));
                assert!(!meaning.is_empty());
            }
        }
        all::<Function>();
        all::<Scalar>();
        all::<Grade>();
        all::<OptimisationTier>();
        all::<ForwardDynamicsMethod>();
        all::<LimbForm>();
        all::<Lanes>();
        all::<WrittenEntries>();
        all::<FixedProducts>();
        all::<Fusion>();
        all::<TargetMachine>();
        all::<Memory>();
    }

    pub fn an_unknown_word_is_answered_with_the_known_ones() {
        let error = Scalar::from_word("half").unwrap_err();
        assert_eq!(error.to_string(), "there is no scalar `half`; one of: f64, f32");
    }

    pub fn a_word_that_is_nearly_known_or_known_elsewhere_is_answered_with_the_one_that_is_meant() {
        for (word, meant) in
            [("inverse_dynamic", "inverse_dynamics"), ("RNEA", "inverse_dynamics"), ("aba", "forward_dynamics")]
        {
            let error = Function::from_word(word).unwrap_err();
            assert_eq!(error.to_string(), format!("there is no function `{word}`; did you mean `{meant}`?"));
        }
    }

    /// What is certified is proven; what agrees on many states is tested.
    pub fn the_documents_say_proven_of_bounds_and_tested_of_tests() {
        for name in [
            "README.md",
            "ARCHITECTURE.md",
            "CHANGELOG.md",
            "codegen/SCENES.md",
            "codegen/SCHEMA.md",
            "codegen/SIMULATION.md",
        ] {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
            let text = std::fs::read_to_string(path).expect("the document is there");
            let paragraphs = text.split("\n\n").flat_map(|p| p.split("\n- ")).flat_map(|p| p.split("\n|"));
            for paragraph in paragraphs.map(|p| p.to_lowercase().replace("provenance", "")) {
                let words = ["proven", "proves", "prove ", "proof"];
                let says = words.iter().any(|word| paragraph.contains(word));
                let is_certified = ["bound", "rounding", "certif", "error"].iter().any(|word| paragraph.contains(word));
                assert!(!says || is_certified, "{name}: {paragraph}");
            }
        }
    }
}
