//! Programs of words: integers of 32 bits, an operation each.

use crate::expr::Port;
use rustc_hash::FxHashMap;
use straightline_core::fixed as kernel;

/// A word of a program, by its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct WordId(pub u32);

impl WordId {
    /// Where it stands in [`WordProgram::words`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// How a product of two words is computed. All but the long ones are its high half, rounded down: see `straightline_core::fixed`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Product {
    /// In one instruction, where the machine has it.
    #[default]
    Wide,
    /// Shifted to the right by so many bits, fewer than 32.
    Long(u32),
    /// From four products of halves.
    Exact,
    /// The same, shifted to the right by so many bits, 1 to 31.
    LongExact(u32),
    /// From three products of halves.
    Full,
    /// Without the lower half of the second word.
    Half,
    /// Without the lower half of both.
    Short,
    /// Of the upper 24 bits of the first word and the upper 8 of the second.
    Uneven,
}

impl Product {
    /// Its function in `straightline_core::fixed`.
    pub fn name(self) -> &'static str {
        match self {
            Product::Wide => "wide",
            Product::Long(_) => "long",
            Product::Exact => "exact",
            Product::LongExact(_) => "long_exact",
            Product::Full => "full",
            Product::Half => "half",
            Product::Short => "short",
            Product::Uneven => "uneven",
        }
    }

    /// Its value.
    pub fn value(self, a: i32, b: i32) -> i32 {
        match self {
            Product::Wide => kernel::wide(a, b),
            Product::Long(by) => kernel::long(a, b, by),
            Product::Exact => kernel::exact(a, b),
            Product::LongExact(by) => kernel::long_exact(a, b, by),
            Product::Full => kernel::full(a, b),
            Product::Half => kernel::half(a, b),
            Product::Short => kernel::short(a, b),
            Product::Uneven => kernel::uneven(a, b),
        }
    }

    /// The function in `straightline_core::fixed` of sines and cosines with such products.
    ///
    /// # Panics
    /// There is none without the lower half of a word.
    pub fn sine_name(self) -> &'static str {
        match self {
            Product::Wide => "sin_cos_wide",
            Product::Exact => "sin_cos_exact",
            Product::Full => "sin_cos_full",
            _ => unreachable!("sines have whole products of no own shift"),
        }
    }

    /// By how many bits it is shifted, if it says so itself.
    pub fn own_shift(self) -> Option<u32> {
        match self {
            Product::Long(by) | Product::LongExact(by) => Some(by),
            _ => None,
        }
    }

    /// By how many units of its last place it is below the product of the words, at most, but for bits that it leaves out.
    pub fn loss(self) -> f64 {
        match self {
            Product::Wide | Product::Long(_) | Product::Exact | Product::LongExact(_) => 1.0,
            // two shifts, and the product of the lower halves
            Product::Full => 3.0,
            Product::Half => 1.0,
            // the product of what both leave out
            Product::Short | Product::Uneven => 1.0,
        }
    }

    /// How many of the lowest bits of its first and of its second word it leaves out.
    pub fn leaves_out(self) -> [u32; 2] {
        match self {
            Product::Wide | Product::Long(_) | Product::Exact | Product::LongExact(_) | Product::Full => [0, 0],
            Product::Half => [0, 16],
            Product::Short => [16, 16],
            Product::Uneven => [8, 24],
        }
    }

    /// The orders of two operands that make different products of them: which operand is the first word, and which the second.
    pub fn orders(self) -> &'static [[usize; 2]] {
        let [first, second] = self.leaves_out();
        if first == second {
            &[[0, 1]]
        } else {
            &[[0, 1], [1, 0]]
        }
    }
}

/// An operation on words. Operands stand before their users.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WordOp {
    /// The input of that flat index.
    Input(u32),
    /// A constant.
    Constant(i32),
    /// a + b.
    Add(WordId, WordId),
    /// a − b.
    Sub(WordId, WordId),
    /// −a.
    Neg(WordId),
    /// The high half of a product.
    Mul(Product, WordId, WordId),
    /// a·2^k.
    Left(WordId, u32),
    /// a/2^k, rounded down.
    Right(WordId, u32),
    /// Sine and cosine of an angle with that point, together, and whether it can lie beyond ±π/4; [`WordOp::Sin`] and [`WordOp::Cos`] alone use it.
    SinCos(WordId, u32, bool),
    /// The sine of a pair; its point is 31.
    Sin(WordId),
    /// The cosine of a pair; its point is 31.
    Cos(WordId),
}

impl WordOp {
    /// The operands, in order.
    pub fn operands(self) -> impl Iterator<Item = WordId> {
        let (a, b) = match self {
            WordOp::Input(_) | WordOp::Constant(_) => (None, None),
            WordOp::Add(a, b) | WordOp::Sub(a, b) | WordOp::Mul(_, a, b) => (Some(a), Some(b)),
            WordOp::Neg(a)
            | WordOp::Left(a, _)
            | WordOp::Right(a, _)
            | WordOp::SinCos(a, ..)
            | WordOp::Sin(a)
            | WordOp::Cos(a) => (Some(a), None),
        };
        a.into_iter().chain(b)
    }
}

/// A program of words. Equal operations are one word.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WordProgram {
    /// The operations.
    pub words: Vec<WordOp>,
    /// Input groups; [`WordOp::Input`] counts through them.
    pub inputs: Vec<Port>,
    /// Output groups.
    pub outputs: Vec<Port>,
    /// The words that are put out, group after group.
    pub results: Vec<WordId>,
    /// How products are computed in sines and cosines: [`Product::Wide`], [`Product::Exact`] or [`Product::Full`].
    pub sines: Product,
}

/// The word that left 32 bits, and the value that it should have had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordOverflow {
    /// The word.
    pub word: WordId,
    /// Its value.
    pub value: i64,
}

impl WordProgram {
    /// Sine and cosine as the program computes them.
    ///
    /// # Panics
    /// At a point that [`WordProgram::has_sines_at`] does not know.
    pub fn sin_cos(&self, angle: i32, bits: u32, turns: bool) -> (i32, i32) {
        macro_rules! at {
            ($($bits:literal)*) => {
                match (bits, self.sines, turns) {
                    $(
                        ($bits, Product::Wide, true) => kernel::sin_cos_wide::<$bits, true>(angle),
                        ($bits, Product::Wide, false) => kernel::sin_cos_wide::<$bits, false>(angle),
                        ($bits, Product::Exact, true) => kernel::sin_cos_exact::<$bits, true>(angle),
                        ($bits, Product::Exact, false) => kernel::sin_cos_exact::<$bits, false>(angle),
                        ($bits, Product::Full, true) => kernel::sin_cos_full::<$bits, true>(angle),
                        ($bits, Product::Full, false) => kernel::sin_cos_full::<$bits, false>(angle),
                    )*
                    _ => unreachable!("angles have a point from 24 to 31, and sines whole products"),
                }
            };
        }
        at!(24 25 26 27 28 29 30 31)
    }

    /// Whether there are sines and cosines of angles with this point.
    pub fn has_sines_at(bits: i32) -> bool {
        (24..=31).contains(&bits)
    }

    /// The results for these inputs.
    ///
    /// # Errors
    /// The first word that overflows.
    ///
    /// # Panics
    /// If the number of inputs is not the program's.
    pub fn run(&self, inputs: &[i32]) -> Result<Vec<i32>, WordOverflow> {
        let values = self.values(inputs)?;
        Ok(self.results.iter().map(|r| values[r.index()]).collect())
    }

    /// The values of all words; of a pair of sine and cosine that of its sine.
    ///
    /// # Errors
    /// As [`WordProgram::run`].
    ///
    /// # Panics
    /// As [`WordProgram::run`].
    pub fn values(&self, inputs: &[i32]) -> Result<Vec<i32>, WordOverflow> {
        assert_eq!(inputs.len(), self.inputs.iter().map(Port::len).sum::<usize>(), "one word per input scalar");
        let mut values: Vec<i32> = Vec::with_capacity(self.words.len());
        let mut cosines: FxHashMap<u32, i32> = FxHashMap::default();
        for (i, word) in self.words.iter().enumerate() {
            let v = |a: WordId| values[a.index()];
            let long = |a: WordId| i64::from(v(a));
            let value = match *word {
                WordOp::Input(k) => i64::from(inputs[k as usize]),
                WordOp::Constant(c) => i64::from(c),
                WordOp::Add(a, b) => long(a) + long(b),
                WordOp::Sub(a, b) => long(a) - long(b),
                WordOp::Neg(a) => -long(a),
                WordOp::Mul(product, a, b) => match product.own_shift() {
                    Some(by) => (long(a) * long(b)) >> by,
                    None => i64::from(product.value(v(a), v(b))),
                },
                WordOp::Left(a, k) => long(a) << k,
                WordOp::Right(a, k) => long(a) >> k,
                WordOp::SinCos(a, bits, turns) => {
                    let (sin, cos) = self.sin_cos(v(a), bits, turns);
                    cosines.insert(i as u32, cos);
                    i64::from(sin)
                }
                WordOp::Sin(a) => long(a),
                WordOp::Cos(a) => i64::from(cosines[&a.0]),
            };
            let word = i32::try_from(value).map_err(|_| WordOverflow { word: WordId(i as u32), value })?;
            values.push(word);
        }
        Ok(values)
    }

    /// How many products, sums and changes of sign, shifts, and pairs of sine and cosine there are.
    pub fn counts(&self) -> [usize; 4] {
        let count = |is: &dyn Fn(&WordOp) -> bool| self.words.iter().filter(|w| is(w)).count();
        [
            count(&|w| matches!(w, WordOp::Mul(..))),
            count(&|w| matches!(w, WordOp::Add(..) | WordOp::Sub(..) | WordOp::Neg(_))),
            count(&|w| matches!(w, WordOp::Left(..) | WordOp::Right(..))),
            count(&|w| matches!(w, WordOp::SinCos(..))),
        ]
    }
}
