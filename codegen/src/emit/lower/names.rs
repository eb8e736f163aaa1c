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

    /// This name, or with a number if it is taken; it may be handed out again.
    pub fn free(&self, name: &str) -> String {
        let numbered = (2..).map(|k| format!("{name}_{k}"));
        let free = [name.to_string()].into_iter().chain(numbered).find(|name| !self.taken.contains(name));
        free.expect("numbers do not end")
    }

    /// `c1`, `c2`, … with the prefix `c`.
    pub fn numbered(&mut self, prefix: &str) -> String {
        let free = (1..).map(|k| format!("{prefix}{k}")).find(|name| !self.taken.contains(name));
        let name = free.expect("numbers do not end");
        self.taken.insert(name.clone());
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
