//! The rows of a six-vector of a frame, such as its velocity, that are asked for.

/// Which of three linear and three angular rows are asked for, in this order, along world axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rows {
    wanted: [bool; 6],
}

impl Rows {
    /// All.
    pub const ALL: Rows = Rows { wanted: [true; 6] };
    /// Those along the world's axes.
    pub const LINEAR: Rows = Rows { wanted: [true, true, true, false, false, false] };
    /// Those about the world's axes.
    pub const ANGULAR: Rows = Rows { wanted: [false, false, false, true, true, true] };
    /// Their words in scene files, in order.
    pub const WORDS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

    /// These, by their places.
    pub fn of(places: impl IntoIterator<Item = usize>) -> Rows {
        let mut rows = Rows { wanted: [false; 6] };
        places.into_iter().for_each(|k| rows.wanted[k] = true);
        rows
    }

    /// Their places, in order.
    pub fn places(self) -> impl Iterator<Item = usize> {
        (0..6).filter(move |k| self.wanted[*k])
    }

    /// Their words, in order.
    pub fn words(self) -> Vec<&'static str> {
        self.places().map(|k| Rows::WORDS[k]).collect()
    }
}
