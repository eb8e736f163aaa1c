//! Names of locals: readable, unique, and the same on every run.

use rustc_hash::FxHashSet;

/// Hands out names that are not taken.
#[derive(Debug, Default)]
pub struct Names {
    taken: FxHashSet<String>,
    temporaries: usize,
}

impl Names {
    /// With these names taken.
    pub fn with_taken<'a>(taken: impl IntoIterator<Item = &'a str>) -> Self {
        Names { taken: taken.into_iter().map(str::to_string).collect(), temporaries: 0 }
    }

    /// `omega3_x` for `("omega", 2, "x")`: bodies are counted from 1, as in the literature. A taken name gets a number.
    pub fn named(&mut self, quantity: &str, index: usize, component: &str) -> String {
        let base = if component.is_empty() {
            format!("{quantity}{}", index + 1)
        } else {
            format!("{quantity}{}_{component}", index + 1)
        };
        let mut name = base.clone();
        let mut k = 2;
        while !self.taken.insert(name.clone()) {
            name = format!("{base}_{k}");
            k += 1;
        }
        name
    }

    /// `t1`, `t2`, …
    pub fn temporary(&mut self) -> String {
        loop {
            self.temporaries += 1;
            let name = format!("t{}", self.temporaries);
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }
}
