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

/// A name from a robot file as an identifier: `left hand-2` becomes `left_hand_2`.
pub fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            out.push(c.to_ascii_lowercase());
        } else if !out.is_empty() && !out.ends_with('_') {
            out.push('_');
        }
    }
    let out = out.trim_end_matches('_');
    match out.chars().next() {
        Some(c) if c.is_ascii_digit() => format!("n{out}"),
        None => "unnamed".to_string(),
        _ => out.to_string(),
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
