//! Numbers as they stand in robot files.

use std::f64::consts::PI;

/// Numbers that are the same for the same seed.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        straightline_core::random::split_mix_64(&mut self.0)
    }

    /// One of `0 .. n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Whether one of so many cases is the case.
    pub fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// One of a list.
    pub fn one_of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    /// Uniform in `low … high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// −1 or 1.
    pub fn sign(&mut self) -> f64 {
        if self.one_in(2) {
            1.0
        } else {
            -1.0
        }
    }

    /// A number of 1e-10 to 1e-18 of either sign: what arithmetic in f64 or f32 leaves where nothing should be left.
    pub fn dust(&mut self) -> f64 {
        let size = 10f64.powi(-10 - self.below(9) as i32);
        self.sign() * significant(self.between(1.0, 10.0), self.below(7) + 1) * size
    }

    /// A right angle cut or rounded after some digits, as files have them; seldom another special angle.
    pub fn right_angle(&mut self) -> f64 {
        let turn = self.one_of(&[0.5, 0.5, 0.5, -0.5, -0.5, 1.0, 1.0, -1.0, 1.5, 0.25, 1.0 / 3.0, 1.0 / 6.0, -2.0]);
        let exact = turn * PI;
        match self.below(4) {
            0 => exact,
            1 => cut(exact, self.below(16) + 1),
            _ => decimals(exact, self.below(15) + 2),
        }
    }
}

/// Rounded to so many digits behind the point.
pub fn decimals(x: f64, digits: usize) -> f64 {
    zero_free_of_sign(format!("{x:.digits$}"))
}

/// The digits behind so many behind the point left out.
pub fn cut(x: f64, digits: usize) -> f64 {
    let text = format!("{x:.20}");
    let point = text.find('.').expect("twenty digits stand behind a point");
    zero_free_of_sign(text[..point + 1 + digits].to_string())
}

/// Rounded to so many significant digits, at least one.
pub fn significant(x: f64, digits: usize) -> f64 {
    zero_free_of_sign(format!("{x:.*e}", digits.max(1) - 1))
}

/// The number of a text; −0 is 0.
fn zero_free_of_sign(text: String) -> f64 {
    text.parse::<f64>().expect("a formatted number is a number") + 0.0
}
